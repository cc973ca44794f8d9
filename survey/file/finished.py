"""What a run does when a finished file exists at its output path: report it complete, or refuse to
overwrite it.
"""

import hashlib
import tomllib
from pathlib import Path

import numpy as np

from survey.errors import BadInput
from survey.file import unfinished
from survey.file.disk import digest_of
from survey.file.labels import counts_in
from survey.file.reading import attributes_of
from survey.grid import coordinates

# keys of a workflow that change no value of the file
OF_PICTURES = ("output.path", "output.figures", "output.style")
REPEATED = ("worker_died", "pending")  # points for which a run is repeated


def attributes(path):
    """The global attributes of the complete, intact file at `path`; {} if there is none, or it is
    damaged.

    Raises BadInput if another program has written it.
    """
    path = Path(path)
    try:
        if not _is_intact(path):
            return {}
        found = attributes_of(path)
    except (OSError, RuntimeError):
        return {}
    if "scene" not in found and "complete" not in found:
        raise BadInput(
            f"{path}: this netCDF file was not written by survey; write to another with -o, or use --fresh"
        )
    return found if found.get("complete") == 1 else {}


def _is_intact(path):
    """Is there a file, which matches its digest, or has none?"""
    digest = digest_of(path)
    with open(path, "rb") as file:
        return (
            not digest.exists()
            or hashlib.file_digest(file, "sha256").hexdigest().encode() in digest.read_bytes()
        )


def lost(found):
    """Does a file of these attributes have points for which the run should be repeated?"""
    return any(counts_in(found).get("status", {}).get(name) for name in REPEATED)


def changes(found, workflow):
    """['solver.rtol 1e-10 -> 1e-09', ...]: what the workflow of the file and this one ask for differently."""
    try:
        return unfinished.differences(found["workflow"], workflow, OF_PICTURES)
    except (KeyError, ValueError):
        return ["workflow unknown -> this one"]


def refuse(path, found, workflow, code, scene_hash, processor=""):
    """Raise BadInput: the file at `path` is of another workflow, or of other code than this
    (`code`: its versions), or from another `processor` alone (see `unfinished.from_processor`).
    """
    causes = [processor] if processor else []
    differences = changes(found, workflow)
    if differences:
        causes.append(f"of another workflow ({unfinished.listed(differences)})")
    if found.get("scene_hash", "") != scene_hash:
        causes.append("of different functions of your own")
    if not causes:
        versions = {name: found.get(f"version_{name}") for name in ("survey", "numba", "llvmlite")}
        other = [
            f"{name} {old} -> {code[name]}"
            for name, old in versions.items()
            if name in code and code[name] != old
        ]
        causes.append(
            f"from another version of the code ({', '.join(other) or 'its sources differ'})"
        )
    extend = (
        f", or extend it with --reuse {path}, which says if values can be taken"
        if _has_values_for(found, workflow, causes)
        else ""
    )
    points = found.get("points")
    many = f" of {points:,} points" if isinstance(points, (int, np.integer)) else ""
    raise BadInput(
        f"{path} is a finished survey{many} {' and '.join(causes)}; write to another file with -o, "
        f"{'' if extend else 'or '}replace it with --fresh{extend} "
        f"(in Python output=, fresh=True{', reuse=' if extend else ''})"
    )


def _has_values_for(found, workflow, causes):
    """Could --reuse take values from the file? The other workflow differs in its axes alone, which
    have common values, or asks for fewer variables.
    """
    if len(causes) != 1 or not changes(found, workflow):
        return False  # the code, or the user's functions, are others
    try:
        old, new = tomllib.loads(found["workflow"]), tomllib.loads(workflow)
        more = {key for key in ("scene", "options", "solver") if old.get(key) != new.get(key)}
        before, now = (data.get("output", {}).get("variables") for data in (old, new))
        fewer = before in (None, now) or set(now or ()) < set(before)
        both = old["axes"].keys() & new["axes"].keys()
        meet = (np.isin(_values(old["axes"][key]), _values(new["axes"][key])).any() for key in both)
        return not more and fewer and all(meet)
    except (KeyError, TypeError, ValueError, AttributeError):
        return False


def _values(axis):
    """The values of an axis as a workflow gives it."""
    if isinstance(axis, dict):
        return axis["values"] if "values" in axis else coordinates(**axis)
    return np.ravel(axis)
