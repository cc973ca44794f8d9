"""The work-precision chart: error against the reference values over time per point, for every method and peer.

Everything that belongs to one scene lies in the file of its name beside this one:

    ERROR                  the output whose error is charted
    references(work)       [(parameters, options, {output: exact value}, verdict or None), ...] like the work's points,
                           the very same list for works that share it
    works()                {name of the work: (point, options)}, what is timed; the arrays of `point` broadcast
    system(point, options) the same question as ODEs, for the peers in `survey.precision.peers`
    outcome(ends)          {ERROR: values} from the states (points, n) at the ends of the spans, and "verdict" if any
    LIMITED                the method whose operations, at the machine's peak rate, are the least time of the chart
    operations_of(run)     its operations while `run()` solves a work with it (both optional)
    MOST                   {method: number of points that it is timed on}, for those that need long (optional)
"""

import csv
import importlib.util
import json
import os
import platform
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from functools import partial
from math import prod
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import survey.precision.cases as cases
import survey.precision.peers as programs
import survey.scenes as scenes
from survey import modules
from survey.errors import BadInput
from survey.file.labels import provenance
from survey.grid import lines
from survey.measures.hill import dense
from survey.precision import peak
from survey.request import workflow
from survey.scene import Request, exists

SETTINGS = tuple(10.0**-n for n in range(4, 14))
REPEATS = 5
ENOUGH_SECONDS = 0.5
# Methods other than auto, which treats a map as a whole, are timed on so many points of it.
POINTS = 10_000


@dataclass
class Record:
    """One measured point of the chart; `error` is the largest |error| / (1 + |value|) over the references."""

    work: str
    method: str
    peer: str
    setting: float
    error: float
    seconds_per_point: float
    wrong_verdicts: int
    compile_seconds: float


@dataclass
class Least:
    """The least time of a method's steps: its operations at the peak rate, multiplied and added apart or fused."""

    work: str
    method: str
    setting: float
    operations_per_point: float
    seconds_per_point: float
    seconds_per_point_fused: float


def write(scene, directory, peers=False, say=lambda line: None):
    """Measure and write precision_SCENE.json, .csv and .png into `directory`; returns the three paths."""
    directory = Path(directory)
    scenes.load(scene)
    case = modules.load(cases, scene, "scene with a precision chart")
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"-o {str(directory)!r}: cannot make this folder ({error.strerror})") from None
    records = measure(scene, case, peers, say)
    paths = [directory / f"precision_{scene}.{kind}" for kind in ("json", "csv", "png")]
    machine = provenance() | {"system": platform.platform(), "threads": 1} | limit(scene, case)
    machine["missing_peers"] = missing(peers)
    paths[0].write_text(json.dumps({"records": [asdict(r) for r in records], "machine": machine}, indent=1) + "\n")
    with open(paths[1], "w", newline="") as file:
        table = csv.DictWriter(file, list(asdict(records[0])))
        table.writeheader()
        table.writerows(asdict(record) for record in records)
    from survey.precision.chart import draw

    draw(records, machine, scene, case.ERROR, paths[2])
    return paths


def measure(scene, case, peers=False, say=lambda line: None):
    """The records of every method (and, if asked, of every peer that is installed) at every setting.

    A method is left out where it has no answer for a reference of the work (closed forms, where there is none).
    """
    module = scenes.load(scene)
    methods = ["auto", *workflow.methods_of(module, next(iter(case.works().values()))[1])]
    fewer = getattr(case, "MOST", {})
    runs = {(method, ""): (_solver(module, method, case.ERROR), fewer.get(method)) for method in methods}
    absent = missing(peers)
    for name in absent:
        say(f"{name} is not installed and is missing in the chart: pip install 'survey[bench]'")
    for name in sorted(set(modules.names(programs)) - set(absent)) if peers else ():
        peer = modules.load(programs, name, "peer")
        runs["", name] = _peer(case, peer), peer.POINTS
    whole = case.works()
    thinned = {work: (_thinned(point), options) for work, (point, options) in whole.items()}
    records = []
    for (method, peer), (solve, most) in runs.items():
        works = whole if peer or method == "auto" else thinned
        compile_seconds = _first_call(solve, works, most) if peer else _cold(scene, method)
        for point, options in works.values() if method else ():  # every path is compiled before it is timed
            solve(point, options, SETTINGS[0])
        for setting in SETTINGS:
            judged = {}
            for work, (point, options) in works.items():
                references = case.references(work)
                if method == "auto":  # it treats a dense row as a whole: its error is that within such a row
                    judged, references = {}, [_within(reference, point) for reference in references]
                if id(references) not in judged:
                    judged[id(references)] = _against(solve, references, case.ERROR, setting)
                error, wrong = judged[id(references)]
                if np.isnan(error):
                    continue
                seconds = _per_point(solve, point, options, setting, most)
                records.append(Record(work, method, peer, setting, error, seconds, wrong, compile_seconds))
        say(f"{scene}: {method or peer} measured")
    return records


def missing(peers):
    """Names of the peers that are asked for and not installed."""
    return [name for name in modules.names(programs) if peers and not importlib.util.find_spec(name)]


def limit(scene, case):
    """The machine's rates, and the least seconds per point that the operations of one method leave possible."""
    rates = peak.rates()
    if not hasattr(case, "LIMITED"):
        return {"rates": rates, "least": []}
    solve = _solver(scenes.load(scene), case.LIMITED, case.ERROR)
    least = []
    for work, (point, options) in case.works().items():
        point = _thinned(point)
        for setting in SETTINGS:
            count = case.operations_of(partial(solve, point, options, setting)) / _points(point)
            seconds = [0.5e-9 * count / rate for rate in rates.values()]
            least.append(Least(work, case.LIMITED, setting, count, *seconds))
    return {"rates": rates, "least": [asdict(entry) for entry in least]}


def _peer(case, peer):
    """A function of (point, options, rtol) that has the peer integrate the scene's equations."""

    def solve(point, options, rtol):
        return case.outcome(peer.integrate(case.system(point, options), rtol))

    return solve


def _lines(point):
    """The `lines` of a work, whose arrays have as many dimensions each, of length 1 where they do not vary."""
    shapes = {name: np.shape(values) for name, values in point.items()}
    own = {name: tuple(i for i, size in enumerate(shape) if size > 1) for name, shape in shapes.items()}
    return lines({name: (own[name], np.ravel(values)) for name, values in point.items()})


def _within(reference, point):
    """The reference as the first point of a row of the work, where the work has rows."""
    parameters, options, exact, verdict = reference
    dense = [name for name in _lines(point) if np.shape(point[name])[-1] > 1]
    if not dense:
        return reference
    whole = {name: np.array([[value]]) for name, value in parameters.items()}
    whole |= {name: np.concatenate([whole[name], np.atleast_2d(point[name])], axis=1) for name in dense}
    return whole, options, exact, verdict


def _solver(module, method, error):
    """A function of (point, options, rtol) that calls the scene for the output `error` and the verdict; see `works`."""

    def solve(point, options, rtol):
        options = workflow.check_options(module, options, point)
        used = workflow.check_parameters(module, module.TITLE, options, point)
        wanted = frozenset(o.name for o in module.OUTPUTS if exists(o, options) and o.name in (error, "verdict"))
        request = Request(options, method, rtol, wanted, _lines(point))
        ndim = max(np.ndim(values) for values in point.values()) or 1
        whole = {key: np.asarray(point.get(key, p.default), float) for key, p in used.items()}
        dense.panels.cache_clear()  # every call pays for its set-up
        return module.solve({key: v if v.ndim else v.reshape((1,) * ndim) for key, v in whole.items()}, request)

    return solve


def _cold(scene, method):
    """Compile seconds of the method in a new process with an empty kernel cache."""
    words = f"from survey import precision; print(precision.first_call({scene!r}, {method!r}))"
    with TemporaryDirectory() as empty:
        environment = os.environ | {"NUMBA_CACHE_DIR": empty}
        told = subprocess.run(
            [sys.executable, "-c", words], capture_output=True, text=True, check=True, env=environment
        )
    return float(told.stdout)


def first_call(scene, method):
    """Seconds that the first call of a scene's method takes in this process, less those of the second."""
    case = modules.load(cases, scene, "scene with a precision chart")
    solve = _solver(scenes.load(scene), method, case.ERROR)
    return _first_call(solve, case.works(), getattr(case, "MOST", {}).get(method))


def _first_call(solve, works, most=None):
    """Seconds of the first call less those of the second, on the smallest work."""
    point, options = min(works.values(), key=lambda work: _points(work[0]))
    point = _share(point, most)
    times = []
    for _ in range(2):
        start = time.perf_counter()
        solve(point, options, 1e-8)
        times.append(time.perf_counter() - start)
    return max(0.0, times[0] - times[1])


def _against(solve, references, name, rtol):
    """(largest relative error, NaN if there is one; number of wrong verdicts) over the references.

    Undecided is not wrong.
    """
    worst, wrong = 0.0, 0
    for parameters, options, exact, verdict in references:
        solved = solve(parameters, options, rtol)
        value = float(np.ravel(solved[name])[0])
        worst = float(np.maximum(worst, abs(value - exact[name]) / (1 + abs(exact[name]))))
        if verdict is not None and "verdict" in solved:
            wrong += int(np.ravel(solved["verdict"])[0]) not in (-1, verdict)
    return worst, wrong


def _per_point(solve, point, options, rtol, most=None):
    """Median seconds per point of a few calls, on at most `most` points of the work."""
    point = _share(point, most)
    times, begin = [], time.perf_counter()
    while len(times) < REPEATS and (not times or time.perf_counter() - begin < ENOUGH_SECONDS):
        start = time.perf_counter()
        solve(point, options, rtol)
        times.append(time.perf_counter() - start)
    return float(np.median(times)) / _points(point)


def _thinned(point):
    """About POINTS points of a larger map, in whole rows: enough where rows share nothing."""
    every = -(-_points(point) // POINTS)
    return {name: values[::every] if np.ndim(values) > 1 else values for name, values in point.items()}


def _share(point, most):
    """At most `most` points of the work, drawn at random."""
    if most is None or _points(point) <= most:
        return point
    names, flat = list(point), [values.ravel() for values in np.broadcast_arrays(*point.values())]
    chosen = np.random.default_rng(0).permutation(flat[0].size)[:most]
    return {name: values[chosen] for name, values in zip(names, flat, strict=True)}


def _points(point):
    return prod(np.broadcast_shapes(*(np.shape(values) for values in point.values())))
