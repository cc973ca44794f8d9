"""How long runs on this machine have taken, by which `survey plan` corrects its estimates.

It is a list of records, the latest last, in the user's cache. A file that cannot be read or written
counts as none.
"""

import contextlib
import json
import os
import tempfile
from math import inf, log
from pathlib import Path
from statistics import median

import numba
import platformdirs

from survey.kernels import jit
from survey.sweep.announce import always_compiled

MOST = 400  # records that are kept
# seconds: a shorter run has spent them on beginning, and would tell a longer one a multiple of its
# time
SHORT = 1.0
MOST_UNANSWERED = 0.5
LITTLE = 1e-3  # seconds of an estimate: beside the beginning of a run they cannot be measured
# a run of fewer seconds that took more times its estimate has spent them on beginning, as a window does
LONG, SLOWEST = 10.0, 10.0
FAR = 25.0  # and nothing of one whose estimate is more times its own
KERNEL_OPTIONS = ("question", "motion", "order", "case")  # which select what is compiled
# [seconds estimated, measured] of the points; of edges, curves and cells
PARTS = ("kernels", "further")


def note(workflow, estimated, measured, compiling, unanswered=0.0):
    """Keep what a complete run has taken: `estimated` and `measured` are {part: seconds of wall
    time}; `unanswered`: the share of its points that have no answer, which take less than others.
    """
    if numba.config.DISABLE_JIT or unanswered > MOST_UNANSWERED:
        return
    record = _about(workflow) | {"hash": jit.KERNEL_HASH, "compiling": round(compiling, 2)}
    for part in PARTS:
        if estimated.get(part, 0.0) > LITTLE and measured.get(part, 0.0) > SHORT:
            record[part] = [
                float(f"{seconds:.3g}") for seconds in (estimated[part], measured[part])
            ]
    with contextlib.suppress(OSError, RuntimeError):  # RuntimeError: no home
        path = _path()
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent) as folder:
            path_new = Path(folder) / path.name
            path_new.write_text(json.dumps([*_records(), record][-MOST:]), encoding="utf-8")
            os.replace(path_new, path)


def factor(workflow, part, estimated):
    """The factor for the estimated seconds of a part on this machine; 1 if nothing is
    known.

    The runs most like this one decide: of the same question on the same axes, else of the question,
    of the scene; of those the three of nearest length. Edges and cells are no measure of each other.
    """
    about = _about(workflow)
    alike = ("tables",) if part == "further" else ()
    for keys in (
        ("scene", "options", "method", "axes"),
        ("scene", "options", "method"),
        ("scene",),
    ):
        like = [
            one[part]
            for one in _records()
            if part in one
            and all(one.get(key) == about[key] for key in (*keys, *alike))
            and (one[part][1] > LONG or one[part][0] * FAR >= estimated)
        ]
        if like and estimated > 0.0:
            like.sort(key=lambda pair: abs(log(pair[0] / estimated)))
            return median(_rate(*pair) for pair in like[:3])
    return 1.0


def _rate(expected, taken):
    """How many times the expected seconds a run has taken, as far as that tells of longer ones."""
    return taken / expected if taken > LONG else min(taken / expected, SLOWEST)


def knows(workflow):
    """Has the scene run here before?"""
    about = _about(workflow)
    return any(
        one.get("scene") == about["scene"] and any(part in one for part in PARTS)
        for one in _records()
    )


def compiling(workflow):
    """(seconds of compiling at the last run like this one that had to, or None; is what this run
    needs compiled, by whatever runs?)
    """
    about = _about(workflow)
    records = [{"kernels_of": one.get("scene")} | one for one in _records()]
    same = [
        one
        for one in records
        if all(one.get(key) == about[key] for key in ("kernels_of", "method"))
    ]
    like = [one for one in same if _selecting(one) == _selecting(about)]
    tables = {name for one in like if one["hash"] == jit.KERNEL_HASH for name in _tables(one)}
    known = {"", *_tables(about)} <= tables and not always_compiled(workflow.scene)
    spent = [
        one["compiling"]
        for one in like
        if one["compiling"] > 1.0 and one.get("tables") == about["tables"]
    ]
    return (spent[-1] if spent else None), known


def _selecting(record):
    """The options of a record that select what is compiled."""
    pairs = str(record.get("options", "")).split(",")
    return [pair for pair in pairs if pair.split("=")[0] in KERNEL_OPTIONS]


def _tables(record):
    """The tables of a record, "" for the points, which every run has."""
    return {"", *str(record.get("tables", "")).split(",")}


def _about(workflow):
    """What distinguishes runs whose times differ for reasons other than the number of points."""
    request = workflow.request
    scene = getattr(workflow.scene, "HASH", workflow.name)
    own = hasattr(workflow.scene, "HASH") and not always_compiled(workflow.scene)
    return {
        "scene": scene,
        # equations of one's own that are recorded, not compiled, have those of their family
        "kernels_of": workflow.scene.FAMILY if own else scene,
        "options": ",".join(f"{key}={value}" for key, value in request.options.items()),
        "method": request.method,
        "axes": ",".join(workflow.grid.sizes),
        "tables": ",".join(
            name for name in ("boundaries", "surfaces", "refine") if getattr(workflow, name)
        ),
    }


def _path():
    return Path(platformdirs.user_cache_dir("survey")) / "times.json"


def _records():
    try:
        found = json.loads(_path().read_text(encoding="utf-8"))
        return [one for one in found if _is_record(one)]
    except (OSError, ValueError, TypeError, RuntimeError):  # too deep, or no home: RuntimeError
        return []


def _is_record(one):
    """Is it one of ours, and not what another program has left there?"""
    try:
        pairs = [one[part] for part in PARTS if part in one]
        numbers = [number for pair in pairs for number in pair]
        return (
            one["compiling"] >= 0
            and len(numbers) == 2 * len(pairs)
            and all(0 < number < inf for number in numbers)
        )
    except (KeyError, TypeError):
        return False
