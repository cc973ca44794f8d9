"""The work-precision chart: error against the reference values over time per point, for every method and peer.

Everything that belongs to one scene lies in the file of its name beside this one:

    ERROR                  the output whose error is charted
    references()           [(parameters, options, {output: exact value}, verdict or None), ...]
    works()                {name of the work: (point, options)}, what is timed; the arrays of `point` broadcast
    peers()                {name: function(point, options, rtol) -> {ERROR: values}}, those that are installed
    missing()              names of the peers that are not
"""

import csv
import json
import os
import platform
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from math import prod
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import survey.precision as folder
import survey.scenes as scenes
from survey import modules, workflow
from survey.dataset import provenance
from survey.errors import BadInput
from survey.scene import Request, exists

SETTINGS = tuple(10.0**-n for n in range(4, 14))
REPEATS = 5
ENOUGH_SECONDS = 2.0
PEER_POINTS = 40  # of peers that go point by point, whatever the work


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


def write(scene, directory, peers=False, say=lambda line: None):
    """Measure and write precision_SCENE.json, .csv and .png into `directory`; returns the three paths."""
    directory = Path(directory)
    modules.load(scenes, scene, "scene")
    case = modules.load(folder, scene, "scene with a precision chart")
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(f"-o {str(directory)!r}: cannot make this folder ({error.strerror})") from None
    records = measure(scene, case, peers, say)
    paths = [directory / f"precision_{scene}.{kind}" for kind in ("json", "csv", "png")]
    machine = provenance() | {"system": platform.platform(), "threads": 1}
    paths[0].write_text(json.dumps({"records": [asdict(r) for r in records], "machine": machine}, indent=1) + "\n")
    with open(paths[1], "w", newline="") as file:
        table = csv.DictWriter(file, list(asdict(records[0])))
        table.writeheader()
        table.writerows(asdict(record) for record in records)
    from survey.chart import draw

    draw(records, scene, case.ERROR, paths[2])
    return paths


def measure(scene, case, peers=False, say=lambda line: None):
    """The records of every method (and, if asked, of every peer that is installed) at every setting."""
    module = modules.load(scenes, scene, "scene")
    runs = {(method, ""): _solver(module, method) for method in ["auto", *workflow.methods_of(module)]}
    if peers:
        runs |= {("", name): function for name, function in case.peers().items()}
        for name in case.missing():
            say(f"{name} is not installed and is missing in the chart: pip install 'survey[bench]'")
    references, works = case.references(), case.works()
    records = []
    for (method, peer), solve in runs.items():
        compile_seconds = _first_call(solve, works) if peer else _cold(scene, method)
        for setting in SETTINGS:
            error, wrong = _against(solve, references, case.ERROR, setting)
            for work, (point, options) in works.items():
                seconds = _per_point(solve, point, options, setting, PEER_POINTS if peer else None)
                records.append(Record(work, method, peer, setting, error, seconds, wrong, compile_seconds))
        say(f"{scene}: {method or peer} measured")
    return records


def _solver(module, method):
    """A function of (point, options, rtol) that calls the scene on one thread; see `works`."""

    def solve(point, options, rtol):
        options = workflow.check_options(module, options, point)
        used = workflow.check_parameters(module, module.TITLE, options, point)
        request = Request(options, method, rtol, frozenset(o.name for o in module.OUTPUTS if exists(o, options)))
        ndim = max(np.ndim(values) for values in point.values()) or 1
        whole = {key: np.asarray(point.get(key, p.default), float) for key, p in used.items()}
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
    case = modules.load(folder, scene, "scene with a precision chart")
    return _first_call(_solver(modules.load(scenes, scene, "scene"), method), case.works())


def _first_call(solve, works):
    """Seconds of the first call less those of the second, on the smallest work."""
    point, options = min(works.values(), key=lambda work: _points(work[0]))
    times = []
    for _ in range(2):
        start = time.perf_counter()
        solve(point, options, 1e-8)
        times.append(time.perf_counter() - start)
    return max(0.0, times[0] - times[1])


def _against(solve, references, name, rtol):
    """(largest relative error, number of wrong verdicts) over the references; undecided is not wrong."""
    worst, wrong = 0.0, 0
    for parameters, options, exact, verdict in references:
        solved = solve(parameters, options, rtol)
        value = float(np.ravel(solved[name])[0])
        worst = max(worst, abs(value - exact[name]) / (1 + abs(exact[name])))
        if verdict is not None and "verdict" in solved:
            wrong += int(np.ravel(solved["verdict"])[0]) not in (-1, verdict)
    return worst, wrong


def _per_point(solve, point, options, rtol, most=None):
    """Median seconds per point of a few calls, on at most `most` points of the work."""
    if most:
        names, flat = list(point), [values.ravel() for values in np.broadcast_arrays(*point.values())]
        chosen = np.random.default_rng(0).permutation(flat[0].size)[:most]
        point = {name: values[chosen] for name, values in zip(names, flat, strict=True)}
    times, begin = [], time.perf_counter()
    while len(times) < REPEATS and (not times or time.perf_counter() - begin < ENOUGH_SECONDS):
        start = time.perf_counter()
        solve(point, options, rtol)
        times.append(time.perf_counter() - start)
    return float(np.median(times)) / _points(point)


def _points(point):
    return prod(np.broadcast_shapes(*(np.shape(values) for values in point.values())))
