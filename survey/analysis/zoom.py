"""A finer sweep of a part of a map, the same workflow otherwise."""

import tomllib
import warnings

import numpy as np

from survey import api, modules
from survey.analysis.point import asked
from survey.errors import BadInput, Damaged
from survey.file.labels import count, describe
from survey.grid import coordinates, logarithmic
from survey.request import user_scene, workflow
from survey.sweep import extras, solve


def sweep(ds, ranges, num=None, output=None):
    """The dataset of the finer map, in memory; or written by `survey.run` where there is an `output`."""
    ranges = _ranges(ds, ranges)
    data = _workflow(ds, ranges, num)
    checked = workflow.check(data, output=output, default_path="zoom.nc")
    _warn(ds, ranges)
    if output is not None:
        return api.run(data, output=output)
    found = solve.compute(checked.grid, checked.scene, checked.request)
    finer = count(describe(checked.grid, checked.scene, checked.name, checked.request, found))
    for beside in extras.extras(checked, lambda name, make: make()):
        finer = finer.assign(beside.variables).assign_attrs(beside.attrs)
    return finer.assign_attrs(title=checked.title, workflow=checked.text)


def _ranges(ds, ranges):
    """{axis: (low, high)}; raises BadInput for one that is no axis or no range."""
    axes = [dim for dim in ds.status.dims if dim in ds.coords]
    if not ranges:
        raise BadInput(f"zoom: give a range for at least one axis, such as {axes[0] if axes else 'k'}=(0.1, 0.2)")
    for name, ends in ranges.items():
        if name not in axes:
            raise BadInput(modules.unknown("axis", name, axes))
        if np.shape(ends) != (2,) or not np.isfinite(np.asarray(ends, float)).all() or not ends[0] < ends[1]:
            raise BadInput(f"{name} = {ends!r}: give two numbers, the lower one first, such as {name}=(0.1, 0.2)")
    return {name: (float(low), float(high)) for name, (low, high) in ranges.items()}


def _warn(ds, ranges):
    """One warning for ranges that reach beyond the map: where the parameters' domains allow it, they are solved."""
    told = []
    for name, (low, high) in ranges.items():
        least, most = float(ds[name].min()), float(ds[name].max())
        if low < least or high > most:
            told.append(f"{name} = ({low:g}, {high:g}) reaches beyond the map's {least:g} to {most:g}")
    if told:
        warnings.warn(f"zoom: {'; '.join(told)}; it is solved there too", stacklevel=4)


def _workflow(ds, ranges, num):
    """The workflow as a mapping: that in the file, or what the attributes say, with other axes."""
    data = _further(ds)
    data |= {"title": f"{ds.attrs.get('title', '')}, a part".lstrip(", "), "scene": user_scene.of_dataset(ds)}
    scene = user_scene.find(data["scene"])[1]
    data |= {"options": asked(ds, scene), "axes": _axes(ds, ranges, num)}
    solver = {"method": ds.attrs.get("method"), "rtol": ds.attrs.get("rtol")}
    data["solver"] = {key: str(v) if key == "method" else float(v) for key, v in solver.items() if v is not None}
    known = {o.name for o in scene.OUTPUTS}
    data["output"] = {"variables": [name for name in ds.data_vars if name in known]}
    axes = [dim for dim in ds.status.dims if dim in ds.coords]
    if data.get("boundaries", {}).get("axis") not in (None, *axes):
        del data["boundaries"]
    if len(axes) != 2:
        data.pop("refine", None)
    return data


def _further(ds):
    """What else the workflow in the file asks for: [boundaries] and [refine], and nothing that names a file."""
    try:
        told = tomllib.loads(ds.attrs.get("workflow", ""))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise Damaged(f"the attribute workflow is no TOML ({error})") from None
    return {key: told[key] for key in ("boundaries", "refine") if isinstance(told.get(key), dict)}


def _axes(ds, ranges, num):
    """The table [axes]: ranges spread anew, the others as they are, numbers."""
    table = {}
    for name, coord in ds.coords.items():
        if coord.dtype.kind not in "fi" or name not in _parameters(ds):
            continue
        if coord.ndim == 0:
            table[name] = float(coord)
        elif coord.dims != (name,):
            raise BadInput(f"zoom: {name} lies along {', '.join(coord.dims)}: points, no map; use survey.evaluate")
        elif name in ranges:
            low, high = ranges[name]
            spacing = "log" if logarithmic(coord.values) else "linear"
            table[name] = {"start": low, "stop": high, "num": _number(num, name, coord.size), "spacing": spacing}
        else:
            table[name] = _as_it_is(coord.values)
    return table


def _parameters(ds):
    return {p.name for p in user_scene.find(user_scene.of_dataset(ds))[1].PARAMETERS}


def _as_it_is(values):
    """The axis with the same bits: by its ends where that gives them, else value by value."""
    for spacing in ("linear", "log")[: 1 + (values.min() > 0)] if values.size > 1 else ():
        start, stop = float(values[0]), float(values[-1])
        if np.array_equal(coordinates(start, stop, values.size, spacing), values):
            return {"start": start, "stop": stop, "num": values.size, "spacing": spacing}
    return {"values": values.astype(float).tolist()}


def _number(num, name, size):
    """How many values the axis gets: as many as it has, one number for all, or one by name."""
    number = num.get(name, size) if isinstance(num, dict) else size if num is None else num
    if isinstance(number, bool) or not isinstance(number, (int, np.integer)) or number < 2:
        raise BadInput(f"num = {number!r}: give a whole number from 2 on, or one for each axis: {{{name!r}: 200}}")
    return int(number)
