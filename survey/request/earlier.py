"""A file whose values a survey may take over: `survey run --reuse`, checked."""

import tomllib
from pathlib import Path

import numpy as np

from survey.errors import BadInput
from survey.file import finished, reading
from survey.file.blocks import of_output, other_processor
from survey.request import workflow as workflows
from survey.sweep import reuse
from survey.sweep.fingerprint import fingerprint
from survey.sweep.reuse import Earlier
from survey.wording import short, shown

FURTHER = ("boundaries", "refine")  # found again, never taken from a file


def find(workflow, path, fresh=False):
    """(survey.sweep.reuse.Earlier or None, a sentence on how much of the file at `path` is taken
    over, or why not).

    Raises BadInput or Damaged if there is no survey in the file, or if it is finished, nothing is
    taken from it and the run would replace it without being `fresh`.
    """
    ds = reading.load(Path(path))
    found = None
    why = _unlike(workflow, ds.attrs)
    if not why:
        found, why = _common(workflow, ds, Path(path))
    if why and not (fresh or finished.lost(ds.attrs)) and _is_output(workflow, path):
        remedy = (
            "write to another file with -o, or replace it with --fresh "
            "(in Python output=, fresh=True)"
        )
        raise BadInput(f"{path}: nothing can be taken from this file: {why}; {remedy}")
    if why:
        return None, f"{path}: nothing is taken from this file: {why}"
    return (
        found,
        f"{path}: {found.points:,} of {workflow.grid.points:,} points are taken from this file",
    )


def _is_output(workflow, path):
    return workflow.path.exists() and workflow.path.samefile(path)


def _unlike(workflow, attributes):
    """Why the file's values have other bits than those of this workflow at the same points, or ""."""
    if finished.lost(attributes):
        return "workers died while it was computed"
    if not attributes.get("workflow"):
        return "it holds no workflow, as files of survey.evaluate do not"
    try:
        data = tomllib.loads(attributes["workflow"])
        if data.get("scene") != workflow.name:
            return f"another scene ({shown(data.get('scene'))}, not {shown(workflow.name)})"
        if attributes.get("scene_hash") != getattr(workflow.scene, "HASH", None):
            return "a different text of your own scene"
        old = _checked(workflow, attributes)
    except (KeyError, TypeError, ValueError) as error:  # BadInput is a ValueError
        return f"its workflow cannot be read ({short(error, 150)})"
    before, now = fingerprint(old), fingerprint(workflow)
    for key in ("method", "rtol"):
        if before[key] != now[key]:
            return f"its {key} is {before[key]}, not {now[key]}"
    options = [dict(checked.request.options) for checked in (old, workflow)]
    if options[0] != options[1]:
        return _other_option(*options)
    more = sorted(workflow.request.variables - old.request.variables)
    if more:
        return f"it has no {', '.join(more)}, and all values of a point are computed together"
    if "fingerprint" not in attributes:
        return "several surveys were joined in it; name one of their files"
    if attributes.get("fingerprint") != of_output(before):
        return f"it is {other_processor(before, attributes) or 'from another version of the code'}"
    return ""


def _other_option(before, now):
    """The first option that differs, in words."""
    key = next(key for key in (before | now) if before.get(key) != now.get(key))
    if key not in before:
        return f"it has no option {key}, which is {now[key]} here"
    here = f"not {now[key]}" if key in now else "which does not exist here"
    return f"its option {key} is {before[key]}, {here}"


def _checked(workflow, attributes):
    """The workflow of the file, as this version of the code understands it, with our scene: it may
    name code.
    """
    data = {
        key: table
        for key, table in tomllib.loads(attributes["workflow"]).items()
        if key not in FURTHER
    }
    data.get("output", {}).pop("figures", None)
    ours = workflow.scene if hasattr(workflow.scene, "HASH") else workflow.name
    return workflows.check(data | {"scene": ours}, output=workflow.path)


def _common(workflow, ds, path):
    """(the Earlier, "") of the points that are in both; (None, why) where there are none, or their
    bits differ.
    """
    old, new = _checked(workflow, ds.attrs).grid, workflow.grid
    if old.parameters.keys() != new.parameters.keys():
        return None, "its parameters are different"
    where, fixed = {}, {}
    for name, (dims, values) in new.parameters.items():
        index = _indices(np.atleast_1d(old.parameters[name][1]), np.atleast_1d(values))
        if name in new.uncut and not np.array_equal(index, np.arange(old.sizes.get(name, 1))):
            return None, f"one solution serves the whole axis {name}, and that axis differs"
        if (index < 0).all():
            return None, f"it has no value of {name} that is needed here"
        if dims:
            where[name] = index
        elif name in old.sizes:
            fixed[name] = int(index[0])
    where, shared = (
        {dim: where[dim] for dim in new.sizes},
        tuple(dim for dim in new.sizes if dim in old.sizes),
    )
    found = Earlier(str(path.absolute()), path.stat().st_mtime_ns, where, shared, fixed)
    why = reuse.obstacle(workflow.scene, workflow.request, new, found, old)
    return (None, why) if why else (found, "")


def _indices(old, new):
    """For each new value the index of the same float among the old ones, or -1."""
    order = np.argsort(old)
    index = order[np.minimum(np.searchsorted(old[order], new), old.size - 1)]
    return np.where(old[index] == new, index, -1)
