"""The work-precision chart: error with respect to reference values against time per point, for
every method and peer.

Everything specific to a scene is in the file of its name in `cases/`:

    ERROR                  the output whose error is charted
    references(work)       [(parameters, options, {output: exact value}, verdict or None), ...] like the work's points,
                           the very same list for works that share it
    works()                {name of the work: (point, options)}, which is timed; the arrays of `point` broadcast
    system(point, options) the same question as ODEs, for the peers in `survey.precision.peers` (optional)
    outcome(ends)          {ERROR: values} from the states (points, n) at the ends of the spans, and "verdict" if any
    LIMITED                the method whose operations, at the machine's peak rate, give the least time in the chart
    operations_of(run)     its operations while `run()` solves a work with it (both optional)
    MOST                   {method: number of points that it is timed on}, for slow ones (optional)
    SCENE                  the scene, where the file has another name: its name, or the object of one's own (optional)
    ALL                    works for which all outputs are asked, not ERROR and the verdict alone (optional)
    NOTE                   what a reader of the chart must know, such as that peers are asked for less (optional)

Where a parameter for which one solution serves all values (times, angles) varies along the last
axis, samples of the work keep whole rows.
"""

import csv
import importlib.util
import json
import os
import pickle
import platform
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import version
from math import prod
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import psutil

from survey import grid, modules, scenes
from survey.errors import BadInput
from survey.file.labels import provenance
from survey.measures.cylinder import basins, fate
from survey.measures.floquet import dense as floquet
from survey.measures.hill import dense
from survey.precision import cases, flops
from survey.precision import peers as programs
from survey.precision.cases import own_file
from survey.request import ranges
from survey.request.checks import check_options, check_parameters, methods_of
from survey.scene import Request, existing_outputs
from survey.waiting import compile_seconds

SETTINGS = tuple(10.0**-n for n in range(4, 14))
REPEATS = 5
ENOUGH_SECONDS = 0.5
# seconds that a method may take for a work at one setting: if more, it gets no finer ones
LONG = 20.0
# Points of a map on which methods other than auto, which treats a map as a whole, are timed.
POINTS = 10_000
# scattered points with which a reference is solved, as from 4,096 on they may share series
TOGETHER = 5_000


@dataclass
class ChartRecord:
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
    """The least time of a method's steps: its operations at the peak rate, with separate or fused
    multiply-adds.
    """

    work: str
    method: str
    setting: float
    operations_per_point: float
    seconds_per_point: float
    seconds_per_point_fused: float


def write(scene, directory, peers=False, say=lambda line: None):
    """Measure and write precision_SCENE.json, .csv and .png into `directory`; returns the three paths."""
    directory = Path(directory)
    case = _case(scene)
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(
            f"-o {str(directory)!r}: cannot make this folder ({error.strerror})"
        ) from None
    records = measure(scene, case, peers, say)
    name = getattr(case, "NAME", scene)
    paths = [directory / f"precision_{name}.{kind}" for kind in ("json", "csv", "png")]
    machine = provenance() | {"system": platform.platform(), "threads": 1} | limit(scene, case)
    machine |= {"missing_peers": missing(peers), "note": getattr(case, "NOTE", "")}
    machine |= {
        "load": psutil.getloadavg(),
        "entry": "scene.solve",
        "outputs": outputs(case),
        "works": described(case),
    }
    machine["peers"] = {peer: version(peer) for peer in sorted({r.peer for r in records} - {""})}
    paths[0].write_text(
        json.dumps({"records": [asdict(r) for r in records], "machine": machine}, indent=1) + "\n",
        encoding="utf-8",
    )
    with open(paths[1], "w", newline="") as file:
        table = csv.DictWriter(file, list(asdict(records[0])))
        table.writeheader()
        table.writerows(asdict(record) for record in records)
    from survey.precision.chart import draw

    draw(records, machine, name, case.ERROR, paths[2])
    return paths


def _case(scene):
    """The case of a chart: a file in `cases`, or one made for a file of one's own."""
    if ranges.is_file(scene):
        return own_file.case(scene)
    found = modules.load(cases, scene, "precision chart")
    if found is own_file:
        raise BadInput(
            "own_file: name your own file, such as my_equation.py, or a workflow that names it"
        )
    return found


def outputs(case):
    """{work: the outputs that are timed}, in words."""
    return {
        work: "all" if work in getattr(case, "ALL", ()) else f"{case.ERROR}, verdict"
        for work in case.works()
    }


def described(case):
    """{work: the number of its points, the ranges of its parameters, and its options}."""
    return {
        work: {"points": _points(point), **options}
        | {name: [float(np.min(values)), float(np.max(values))] for name, values in point.items()}
        for work, (point, options) in case.works().items()
    }


def measure(scene, case, peers=False, say=lambda line: None):
    """The records of every method (and, if requested, of every installed peer) at every setting.

    A method is left out of a work if it has no answer for one of its references (closed forms,
    where there is none).
    """
    module = _scene(scene, case)
    methods = ["auto", *methods_of(module, next(iter(case.works().values()))[1])]
    fewer = getattr(case, "MOST", {})
    runs = {
        (method, ""): (_solver(module, method, case.ERROR), fewer.get(method)) for method in methods
    }
    absent = missing(peers)
    for name in absent:
        say(
            f"{name} is not installed and is missing from the chart: pip install 'stability-survey[bench]'"
        )
    for name in (
        sorted(set(modules.names(programs)) - set(absent))
        if peers and hasattr(case, "system")
        else ()
    ):
        peer = modules.load(programs, name, "peer")
        runs["", name] = _peer(case, peer), peer.POINTS
    full = case.works()
    shared = _shared(module)
    with_all_outputs = getattr(case, "ALL", ())
    thinned = {work: (_thinned(point), options) for work, (point, options) in full.items()}
    records = []
    for (method, peer), (solve, most) in runs.items():
        works = full if peer or method == "auto" else thinned
        timed = {
            work: (_sample(point, most, shared), options)
            for work, (point, options) in works.items()
        }
        smallest = timed[_smallest(works)]
        compile_seconds = _first_call(solve, *smallest) if peer else _cold(scene, method, smallest)
        for work, (point, options) in timed.items():  # every path is compiled before it is timed
            solve(point, options, SETTINGS[0]) if peer or work not in with_all_outputs else solve(
                point, options, SETTINGS[0], everything=True
            )
        slow = set()
        for setting in SETTINGS:
            errors = {}
            for work, (point, _options) in works.items():
                if work in slow:
                    continue
                began, references = time.process_time(), case.references(work)
                # it treats a dense row as a whole: its error is the one within such a row
                if method == "auto":
                    errors = {}
                    references = [_within(reference, point) for reference in references]
                if id(references) not in errors:
                    errors[id(references)] = _against(solve, references, case.ERROR, setting)
                error, wrong = errors[id(references)]
                if np.isnan(error):
                    continue
                asked = (
                    solve
                    if peer or work not in with_all_outputs
                    else partial(solve, everything=True)
                )
                seconds = _per_point(asked, *timed[work], setting)
                records.append(
                    ChartRecord(work, method, peer, setting, error, seconds, wrong, compile_seconds)
                )
                if time.process_time() - began > LONG:
                    slow.add(work)
                    say(
                        f"{scene}: {method or peer} is slow for {work}: nothing finer than {setting:g} is measured"
                    )
        say(f"{scene}: {method or peer} measured")
    return records


def _scene(chart, case):
    """The scene of a chart: a module, or one of one's own."""
    scene = getattr(case, "SCENE", chart)
    return scenes.load(scene) if isinstance(scene, str) else scene


def missing(peers):
    """Names of the requested peers that are not installed."""
    return [
        name for name in modules.names(programs) if peers and not importlib.util.find_spec(name)
    ]


def limit(scene, case):
    """The machine's rates, and the least seconds per point that the operations of one method allow."""
    rates = flops.rates()
    if not hasattr(case, "LIMITED"):
        return {"rates": rates, "least": []}
    solve = _solver(_scene(scene, case), case.LIMITED, case.ERROR)
    least = []
    for work, (point, options) in case.works().items():
        point = _thinned(point)
        for setting in SETTINGS:
            count = case.operations_of(partial(solve, point, options, setting)) / _points(point)
            seconds = [0.5e-9 * count / rate for rate in rates.values()]
            least.append(Least(work, case.LIMITED, setting, count, *seconds))
    return {"rates": rates, "least": [asdict(entry) for entry in least]}


def _peer(case, peer):
    """A function of (point, options, rtol) that integrates the scene's equations with the peer."""

    def solve(point, options, rtol):
        return case.outcome(peer.integrate(case.system(point, options), rtol))

    return solve


def _axes(point):
    """{name: (its dimensions, its values)} of a work, whose arrays have as many dimensions each, of
    length 1 where they do not vary.
    """
    shapes = {name: np.shape(values) for name, values in point.items()}
    own = {
        name: tuple(i for i, size in enumerate(shape) if size > 1) for name, shape in shapes.items()
    }
    return {name: (own[name], np.ravel(values)) for name, values in point.items()}


def _within(reference, point):
    """The reference as the first point of a row of the work, or of scattered points about it, if
    the work has such.
    """
    parameters, options, exact, verdict = reference
    axes = _axes(point)
    dense = [name for name in grid.lines(axes) if np.shape(point[name])[-1] > 1]
    if not dense:
        about = {
            name: values[:TOGETHER]
            for name, (_, values) in axes.items()
            if np.size(values) >= TOGETHER
        }
        if not about or not all(
            v.min() <= parameters[name] <= v.max() for name, v in about.items()
        ):
            return reference
        inputs = {name: np.array([value]) for name, value in parameters.items()}
        return (
            inputs | {name: np.append(inputs[name], v) for name, v in about.items()},
            options,
            exact,
            verdict,
        )
    inputs = {name: np.array([[value]]) for name, value in parameters.items()}
    inputs |= {
        name: np.concatenate([inputs[name], np.atleast_2d(point[name])], axis=1) for name in dense
    }
    return inputs, options, exact, verdict


def _solver(module, method, error):
    """A function of (point, options, rtol) that calls the scene for the output `error` and the
    verdict; see `works`.

    A run knows its axes before its first block: they are described once for each point.
    """
    described = {}

    def solve(point, options, rtol, everything=False):
        options = check_options(module, options, point)
        used = check_parameters(module, module.TITLE, options, point)
        asked = [o.name for o in existing_outputs(module, options) if not o.on_request]
        wanted = frozenset(name for name in asked if everything or name in (error, "verdict"))
        ndim = max(np.ndim(values) for values in point.values()) or 1
        arrays = {key: np.asarray(point.get(key, p.default), float) for key, p in used.items()}
        if described.get("point") is not point:
            axes = _axes(arrays)
            described.update(
                point=point, axes=(grid.lines(axes), grid.fixed(axes), grid.ranges(axes))
            )
        request = Request(options, method, rtol, wanted, *described["axes"])
        dense.panels.cache_clear()  # every call includes its set-up
        floquet.panels.cache_clear()
        fate.forget()
        basins.forget()
        if hasattr(module, "forget"):
            module.forget()
        return module.solve(
            {key: v if v.ndim else v.reshape((1,) * ndim) for key, v in arrays.items()}, request
        )

    return solve


def _cold(scene, method, work):
    """Compile seconds of the method for a work in a new process with an empty kernel cache."""
    with TemporaryDirectory() as empty:
        given = Path(empty, "work.pickle")
        given.write_bytes(pickle.dumps(work))
        program = f"from survey import precision; print(precision.first_call({scene!r}, {method!r}, {str(given)!r}))"
        environment = os.environ | {"NUMBA_CACHE_DIR": empty}
        done = subprocess.run(
            [sys.executable, "-c", program],
            capture_output=True,
            text=True,
            check=True,
            env=environment,
        )
    return float(done.stdout)


def first_call(scene, method, path):
    """Seconds of the first call of a scene's method in this process, minus those of the second.

    `path`: a file that holds the work, whose making may compile kernels.
    """
    case = _case(scene)
    return _first_call(
        _solver(_scene(scene, case), method, case.ERROR), *pickle.loads(Path(path).read_bytes())
    )


def _smallest(works):
    """The name of the work with the fewest points."""
    return min(works, key=lambda work: _points(works[work][0]))


def _shared(module):
    """The parameters for which one solution serves all values, such as times."""
    return {parameter.name for parameter in module.PARAMETERS if parameter.uncut}


def _first_call(solve, point, options):
    """Seconds of processor time of the first call minus those of the second."""
    times = []
    for _ in range(2):
        start = time.process_time()
        solve(point, options, 1e-8)
        times.append(time.process_time() - start)
    return max(0.0, times[0] - times[1])


def _against(solve, references, name, rtol):
    """(largest relative error, NaN if there is one; number of wrong verdicts) over the references.

    Undecided is not wrong, and what it leaves without a value has no error.
    """
    worst, wrong = 0.0, 0
    for parameters, options, exact, verdict in references:
        solved = solve(parameters, options, rtol)
        wanted = np.atleast_1d(exact[name])
        value = np.ravel(solved[name])[: wanted.size]
        if (
            np.isnan(value).any()
            and verdict is not None
            and np.ravel(solved.get("verdict", 0))[0] == -1
        ):
            continue
        worst = float(np.maximum(worst, np.max(abs(value - wanted) / (1 + abs(wanted)))))
        if verdict is not None and "verdict" in solved:
            wrong += int(np.ravel(solved["verdict"])[0]) not in (-1, verdict)
    return worst, wrong


def _per_point(solve, point, options, rtol):
    """Median seconds of processor time per point of a few calls: all run on one thread, beside
    others perhaps.

    Those that compile do not count, as for the first points that need double-double arithmetic.
    """
    times = []
    compiled = []
    begin = time.perf_counter()
    while len(times + compiled) < REPEATS and (
        not times or time.perf_counter() - begin < ENOUGH_SECONDS
    ):
        compiling, start = compile_seconds(), time.process_time()
        solve(point, options, rtol)
        (times if compile_seconds() == compiling else compiled).append(time.process_time() - start)
    return float(np.median(times or compiled)) / _points(point)


def _thinned(point):
    """About POINTS points of a larger map, in complete rows: enough where rows are independent."""
    every = -(-_points(point) // POINTS)
    return {
        name: values[::every] if np.ndim(values) > 1 else values for name, values in point.items()
    }


def _sample(point, most, shared=()):
    """At most `most` random points of the work, or about as many in whole rows where one of
    `shared` varies along them.

    The parameters of `shared` are those for which one solution serves all values.
    """
    if most is None or _points(point) <= most:
        return point
    if any(
        name in shared and np.shape(values)[-1:] > (1,)
        for name, values in point.items()
        if np.ndim(values) > 1
    ):
        columns = max(np.shape(values)[-1] for values in point.values())
        rows = max(np.shape(values)[0] for values in point.values() if np.ndim(values) > 1)
        chosen = np.random.default_rng(0).permutation(rows)[: max(1, most // columns)]
        return {
            name: values[chosen] if len(values) == rows else values
            for name, values in point.items()
        }
    names = list(point)
    flat = [values.ravel() for values in np.broadcast_arrays(*point.values())]
    chosen = np.random.default_rng(0).permutation(flat[0].size)[:most]
    return {name: values[chosen] for name, values in zip(names, flat, strict=True)}


def _points(point):
    return prod(np.broadcast_shapes(*(np.shape(values) for values in point.values())))
