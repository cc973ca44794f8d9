"""A finer sweep of a part of a map, with otherwise the same workflow."""

import tomllib
import warnings

import numpy as np

from survey import api, modules
from survey.analysis.areas import refuse_members
from survey.analysis.given import check_names, options_at
from survey.analysis.point import unknown_axis
from survey.errors import BadInput, Damaged
from survey.file.labels import count, describe
from survey.grid import coordinates, logarithmic
from survey.request import user_scene, workflow
from survey.request.checks import is_number
from survey.sweep import edges_and_cells, solve
from survey.wording import shown


def sweep(ds, ranges, num=None, output=None):
    """The dataset of the finer map, in memory; or written by `survey.run` where there is an `output`."""
    check_names(ds, user_scene.find(user_scene.of_dataset(ds))[1])
    ranges = _ranges(ds, ranges)
    for name in num if isinstance(num, dict) else ():
        if name not in ranges:
            raise BadInput(f"num: {modules.unknown('axis with a range', name, list(ranges))}")
    if any(
        c.ndim and c.dims[0] in ds.coords and ds[c.dims[0]].dtype.kind in "UO"
        for c in ds.coords.values()
    ):
        _warn(ds, ranges)
        return _of_names(ds, ranges, num, output)
    data = _workflow(ds, ranges, num)
    checked = workflow.check(data, output=output, default_path="zoom.nc")
    _warn(ds, ranges)
    if output is not None:
        return api.run(data, output=output)
    found = solve.compute(checked.grid, checked.scene, checked.request)
    finer = count(
        describe(checked.grid, checked.scene, checked.name, checked.request, found), found
    )
    for further in edges_and_cells.find(checked, lambda name, make: make()):
        finer = finer.assign(further.variables).assign_attrs(further.attrs)
    return finer.assign_attrs(title=checked.title, workflow=checked.text)


def _of_names(ds, ranges, num, output):
    """The finer map of a survey with an axis of names, along which parameters lie, which no workflow
    can have.
    """
    if output is not None:
        raise BadInput(
            "zoom: a workflow cannot have an axis of names; leave output out, and save the result "
            "with to_netcdf"
        )
    name = user_scene.of_dataset(ds)
    scene = user_scene.find(name)[1]
    given = {key: ds[key] for key in _parameters(ds) & set(ds.coords) - ranges.keys()}
    given |= {key: coordinates(**_finer(ds[key], ends, num)) for key, ends in ranges.items()}
    outputs = {o.name for o in scene.OUTPUTS} & set(ds.data_vars)
    solver = {
        "method": str(ds.attrs["method"]),
        "rtol": float(ds.attrs["rtol"]),
        "variables": sorted(outputs),
    }
    found = api.evaluate(name, **given, **options_at(ds, scene), **solver)
    return found.transpose(*ds.status.dims, ...)


def _ranges(ds, ranges):
    """{axis: (low, high)}; raises BadInput for an unknown axis or an invalid range."""
    given = [dim for dim in ds.status.dims if dim in ds.coords]
    axes = [dim for dim in given if ds[dim].dtype.kind in "iuf"]
    for name in given:
        if name not in axes and (name in ranges or not axes):
            value = f" = {shown(ranges[name])}:" if name in ranges else " is"
            raise BadInput(
                f"zoom: {name}{value} an axis of names, and nothing lies between them; survey.evaluate solves "
                "further ones"
            )
    if not axes:
        refuse_members(ds, "zoom", "survey.evaluate solves further ones")
        raise BadInput(
            "zoom: this survey has no axis of which a part could be solved; survey.evaluate solves further points"
        )
    if not ranges:
        raise BadInput(f"zoom: give a range for at least one axis, such as {axes[0]}=(0.1, 0.2)")
    for name, ends in ranges.items():
        if name not in axes:
            if name in ds.status.dims:
                refuse_members(ds, "zoom", "survey.evaluate solves further ones")
            raise BadInput(unknown_axis(ds, name, axes))
        if (
            np.shape(ends) != (2,)
            or not all(map(is_number, ends))
            or not -np.inf < ends[0] < ends[1] < np.inf
        ):
            raise BadInput(
                f"{name} = {shown(ends)}: give two numbers, the lower one first, such as {name}=(0.1, 0.2)"
            )
    return {name: (float(low), float(high)) for name, (low, high) in ranges.items()}


def _warn(ds, ranges):
    """One warning for ranges that extend beyond the map, which are solved within the parameters' domains."""
    beyond = []
    for name, (low, high) in ranges.items():
        least, most = float(ds[name].min()), float(ds[name].max())
        if low < least or high > most:
            beyond.append(
                f"{name} = ({low:g}, {high:g}) extends beyond the map's {least:g} to {most:g}"
            )
    if beyond:
        warnings.warn(f"zoom: {'; '.join(beyond)}; it is solved there too", stacklevel=4)


def _workflow(ds, ranges, num):
    """The workflow with new axes, as a mapping: from the one in the file and the attributes."""
    data = _further(ds) | workflow_of(ds, ranges, num)
    axes = [dim for dim in ds.status.dims if dim in ds.coords]
    table = data.get("boundaries", {})
    plane = table.get("plane")
    if isinstance(plane, list):
        table["plane"] = plane = [name for name in plane if name in axes]
    if table.get("axis") not in (None, *axes) or (plane is not None and len(plane) < 2):
        del data["boundaries"]
    if len(axes) != 3:
        data.get("boundaries", {}).pop("surfaces", None)
    if len(axes) != 2:
        data.pop("refine", None)
    return data


def workflow_of(ds, ranges=None, num=None):
    """The workflow of the points alone, as a mapping, from the attributes: the same points, or with
    new axes.
    """
    title = str(ds.attrs.get("title", ""))
    data = {
        "title": f"{title}, a part".lstrip(", ") if ranges else title,
        "scene": user_scene.of_dataset(ds),
    }
    scene = user_scene.find(data["scene"])[1]
    data |= {"options": options_at(ds, scene), "axes": _axes(ds, ranges or {}, num)}
    solver = {"method": ds.attrs.get("method"), "rtol": ds.attrs.get("rtol")}
    data["solver"] = {
        key: str(v) if key == "method" else float(v) for key, v in solver.items() if v is not None
    }
    known = {o.name for o in scene.OUTPUTS}
    return data | {"output": {"variables": [name for name in ds.data_vars if name in known]}}


def _further(ds):
    """The tables [boundaries] and [refine] of the workflow in the file, and nothing that names a file."""
    try:
        stored = tomllib.loads(ds.attrs.get("workflow", ""))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise Damaged(f"the attribute workflow is not TOML ({error})") from None
    return {
        key: stored[key] for key in ("boundaries", "refine") if isinstance(stored.get(key), dict)
    }


def _axes(ds, ranges, num):
    """The table [axes]: new ranges, other axes unchanged, and numbers."""
    table = {}
    for name, coord in ds.coords.items():
        if coord.dtype.kind not in "fi" or name not in _parameters(ds):
            continue
        if coord.ndim == 0:
            table[name] = float(coord)
        elif coord.dims != (name,):
            raise BadInput(
                f"zoom: {name} lies along {', '.join(coord.dims)}: these are points, not a map; use survey.evaluate"
            )
        elif name in ranges:
            table[name] = _finer(coord, ranges[name], num)
        else:
            table[name] = unchanged(coord.values)
    return table


def _finer(coord, ends, num):
    """The range of a new axis, spaced as the old one."""
    spacing = "log" if logarithmic(coord.values) else "linear"
    return {
        "start": ends[0],
        "stop": ends[1],
        "num": _number(num, coord.name, coord.size),
        "spacing": spacing,
    }


def _parameters(ds):
    return {p.name for p in user_scene.find(user_scene.of_dataset(ds))[1].PARAMETERS}


def unchanged(values):
    """The axis with the same bits: by its ends if that reproduces them, else value by value."""
    for spacing in ("linear", "log")[: 1 + (values.min() > 0)] if values.size > 1 else ():
        start, stop = float(values[0]), float(values[-1])
        if np.array_equal(coordinates(start, stop, values.size, spacing), values):
            return {"start": start, "stop": stop, "num": values.size, "spacing": spacing}
    return {"values": values.astype(float).tolist()}


def _number(num, name, size):
    """The number of values of the axis: as many as it has, one number for all axes, or one by name."""
    number = num.get(name, size) if isinstance(num, dict) else size if num is None else num
    if isinstance(number, bool) or not isinstance(number, (int, np.integer)) or number < 2:
        raise BadInput(
            f"num = {number!r}: give an integer of at least 2, or one for each axis: {{{name!r}: 200}}"
        )
    return int(number)
