"""Several runs of one survey joined along an axis, in memory or as a file."""

import os
import tempfile
import tomllib
import warnings
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import tomli_w
import xarray as xr

from survey.analysis.point import of_points
from survey.analysis.zoom import unchanged
from survey.errors import BadInput
from survey.file import disk, reading, schema
from survey.file.labels import FILL, as_stored, command, fill_of, flag_codes, now, tally
from survey.file.map_file import TILE_POINTS, MapFile
from survey.grid import halved
from survey.request.output_path import check_path
from survey.wording import counted, short, shown

SAME = ("scene", "scene_hash", "options", "method", "rtol")
OF_PARTS = {"boundaries": "[boundaries]", "surfaces": "[boundaries]", "refine": "[refine]"}
SUMMED = ("wall_time_s", "compile_time_s")
OF_RUN = ("fingerprint", "blocks_reused", "points_reused")


def concat(datasets: Iterable[xr.Dataset | str | os.PathLike[str]]) -> xr.Dataset:
    """Join surveys that differ in the values of one axis, or in one fixed parameter, which becomes
    an axis.

    An axis of names, such as those of bodies, may have parameters along it, which differ too.

    Parameters
    ----------
    datasets : two or more datasets of surveys, or paths of their files, in any order.

    Returns
    -------
    xarray.Dataset, sorted along that axis if it is one of numbers, with counts of the whole. Points that several
    contain are kept once; where they differ within their error bars, as on dense maps, which are solved as wholes,
    those of the part that is given first are kept, and a warning and `history` say so. Edges, curves, surfaces and
    cells are left out, with a warning: they belong to the parts.

    Raises
    ------
    survey.BadInput where the parts do not belong together: different scenes, options, methods, rtol
    or sets of outputs, more than one axis that differs, or values at a common point that differ beyond
    their error bars.
    """
    joined, notes = _together(datasets)
    if notes:
        warnings.warn(f"concat: {notes}", stacklevel=2)
    return joined


def _together(datasets):
    """(The joined survey, what of the parts is left out or chosen, in words; "" if nothing is.)"""
    datasets = _as_list(datasets)
    given = [_part(part) for part in datasets]
    names = [
        f"survey {i + 1} of the list" if isinstance(part, xr.Dataset) else str(part)
        for i, part in enumerate(datasets)
    ]
    tables = dict.fromkeys(
        OF_PARTS[name] for name in OF_PARTS if any(name in part.attrs for part in given)
    )
    left_out = (
        f"the results of {' and '.join(tables)} belong to the parts, and are left out"
        if tables
        else ""
    )
    joined, chosen = _concat([of_points(part) for part in given], names)
    if all(part.attrs.get("complete") == 1 for part in given):
        joined.attrs["complete"] = 1  # also when it is saved
    return joined, "; ".join(filter(None, (left_out, *chosen)))


def _concat(parts, names):
    """(The joined survey, lines about values that were chosen); `names` (of each part): what it is called."""
    if len(parts) < 2:
        raise BadInput(f"concat: give two or more surveys, not {len(parts)}")
    for part in parts[1:]:
        _check_alike(parts[0], part)
    axis, beside = _axis(parts)
    about = parts[0][axis].attrs
    parts = [_along(part, axis, beside) for part in parts]
    joined, chosen = parts[0], []
    for i, part in enumerate(parts[1:], start=1):
        joined, differ = _joined(joined, part, axis)
        chosen += _chosen(differ, axis, parts[:i], part, names)
    joined = joined.assign_coords({axis: (axis, joined[axis].values, about)})
    return _described(joined, parts, axis, chosen), chosen


def _chosen(differ, axis, before, part, names):
    """Lines that say which of the parts `before` has the values that are kept where those of `part` differ."""
    lines = []
    for i, other in enumerate(before):
        own = differ[np.isin(differ, other[axis].values)]
        differ = differ[~np.isin(differ, own)]
        if own.size:
            lines.append(
                f"at {counted(own.size, 'common value')} of {axis}, {shown(own.min())} to {shown(own.max())}, the "
                f"values of {names[i]} are kept; those of {names[len(before)]} differ within the error bars"
            )
    return lines


def _along(part, axis, beside):
    """The survey with the axis as a dimension, along which the coordinates `beside` are, too."""
    if axis in part.dims:
        return part
    values = {
        name: (axis, np.atleast_1d(part[name].values), part[name].attrs) for name in (axis, *beside)
    }
    return part.drop_vars(values).expand_dims(axis).assign_coords(values)


def merge(paths, output):
    """Write the `concat` of the files to the netCDF file `output`; returns the Dataset, and what of
    the parts is left out or chosen, in words. Nothing is replaced.
    """
    output = check_path(output)
    if output.exists():
        raise BadInput(f"{output} exists; name another file with -o, or remove it first")
    try:
        joined, left_out = _together(list(paths))
    except BadInput as error:
        raise BadInput(str(error).replace("concat:", "merge:", 1)) from None
    with (
        disk.refused(output),
        tempfile.TemporaryDirectory(dir=output.parent, prefix=f".{output.name}.") as folder,
    ):
        _write(joined, output, Path(folder))
    return joined, left_out


def _as_list(datasets):
    if isinstance(datasets, (str, Path, xr.Dataset)) or not hasattr(datasets, "__iter__"):
        raise BadInput(
            f"concat: give a list of surveys, such as [one, other], not {shown(datasets)}"
        )
    return list(datasets)


def _part(given):
    if not isinstance(given, xr.Dataset):
        return reading.load(given)
    if "status" not in given or "scene" not in given.attrs:
        raise BadInput(
            "concat: a dataset was not written by survey: it has no status, or no attribute scene"
        )
    schema.refuse_stacked(given, "concat: a")
    schema.check(given, complete=False)
    return given


def _check_alike(one, other):
    for key in SAME:
        if one.attrs.get(key) != other.attrs.get(key):
            if key == "scene":
                both = " and ".join(short(ds.attrs["scene"]) for ds in (one, other))
                raise BadInput(f"concat: the surveys are of different scenes: {both}")
            both = " and ".join(shown(ds.attrs.get(key)) for ds in (one, other))
            raise BadInput(f"concat: the surveys differ in {key}: {both}")
    names = [set(ds.data_vars) for ds in (one, other)]
    if names[0] != names[1]:
        only = ", ".join(sorted(names[0] ^ names[1]))
        raise BadInput(
            f"concat: only one of the surveys has {only}; leave it out of the other (drop_vars)"
        )


def _axis(parts):
    """The one coordinate that differs, and the others that differ along it, if it is one of names."""
    names = set().union(*(part.coords for part in parts))
    absent = sorted(name for name in names if any(name not in part.coords for part in parts))
    if absent:
        raise BadInput(f"concat: only some of the surveys have {', '.join(map(str, absent))}")
    first = parts[0]
    different = [name for name in first.coords if any(not part[name].variable.equals(first[name].variable)
                                                      for part in parts[1:])]  # fmt: skip
    named = [name for name in different if first[name].dtype.kind in "UO"]
    if len(named) == 1 and all(
        part[name].dims in ((), (named[0],)) for part in parts for name in different
    ):
        return named[0], [name for name in different if name != named[0]]
    if len(different) != 1:
        what = (
            f"in {', '.join(map(str, different))}"
            if different
            else "in none: they have the same points"
        )
        raise BadInput(f"concat: surveys are joined along one axis, but these differ {what}")
    name = different[0]
    if first[name].dtype.kind not in "iuf" or any(
        part[name].dims not in ((), (name,)) for part in parts
    ):
        raise BadInput(
            f"concat: surveys cannot be joined along {name}: it is not an axis of numbers or names"
        )
    return name, []


def _joined(one, other, axis):
    """(Both, in ascending order, the values of the axis at which they differ within their error
    bars); raises BadInput where they contradict each other.
    """
    _, at, there = np.intersect1d(one[axis].values, other[axis].values, return_indices=True)
    common = one.isel({axis: at})
    differ = _differ(common, other.transpose(*one.status.dims, ...).isel({axis: there}), axis)
    rest = np.setdiff1d(np.arange(other.sizes[axis]), there)
    joined = xr.concat(
        [one, other.isel({axis: rest})], axis, combine_attrs="override", join="exact"
    )
    joined = joined.transpose(*one.status.dims, ...)
    joined = joined.sortby(axis) if joined[axis].dtype.kind in "iuf" else joined
    return joined, common[axis].values[differ]


def _differ(one, other, axis):
    """Where along the axis two surveys of the same points differ, but within their error bars, or
    where one alone is undecided; raises BadInput where they differ otherwise.
    """
    differ = np.zeros(one.sizes[axis], bool)
    if not differ.size or one.equals(other):
        return differ
    for name, variable in one.data_vars.items():
        a, b = variable.values, other[name].transpose(*variable.dims).values
        same = a == b
        if a.dtype.kind == "f":
            same |= np.isnan(a) & np.isnan(b)
        if same.all():
            continue
        across = tuple(i for i, dim in enumerate(variable.dims) if dim != axis)
        differ |= ~same.all(axis=across)
        if (own := str(name).removesuffix("_error")) != name and own in one:
            continue  # which bar belongs to which value
        agree = same | _within(one, other, name, a, b)
        if not agree.all():
            i = tuple(int(k) for k in np.argwhere(~agree)[0])
            value = shown(one[axis].values[i[variable.dims.index(axis)]])
            bars = f"{name}_error" in one
            both = f"{_named(one[name], a[i])} and {_named(other[name], b[i])}"
            raise BadInput(
                f"concat: the surveys have different values at common points, such as {axis} = {value}, where {name} "
                f"is {both}{', beyond the error bars' if bars else ''}; leave these points out of one of the surveys, "
                "with ds.sel, or solve both again with one version"
            )
    return differ


def _named(variable, value):
    """The value as messages show it: a flag by its meaning, as verdicts and statuses are."""
    if "flag_values" not in variable.attrs:
        return shown(value)
    return next(
        (word for word, code in flag_codes(variable.attrs).items() if code == value), shown(value)
    )


def _within(one, other, name, a, b):
    """Where values a and b of an output differ within their error bars, or one alone is undecided."""
    if f"{name}_error" in one:
        dims = one[name].dims
        bars = [ds[f"{name}_error"].transpose(*dims).values.astype(float) for ds in (one, other)]
        with np.errstate(invalid="ignore"):
            return abs(a - b) <= bars[0] + bars[1]
    known = one[name].attrs
    undecided = flag_codes(known).get("undecided") if "flag_values" in known else None
    return np.zeros(a.shape, bool) if undecided is None else (a == undecided) | (b == undecided)


def _described(joined, parts, axis, chosen):
    """With the counts and attributes of the whole."""
    attributes = {key: value for key, value in parts[0].attrs.items() if key not in OF_RUN}
    for key in attributes:
        values = list(dict.fromkeys(str(part.attrs.get(key)) for part in parts))
        if key in SUMMED:
            attributes[key] = float(sum(part.attrs.get(key, 0.0) for part in parts))
        elif len(values) > 1 and key.startswith(
            ("version_", "commit", "dirty", "kernel_hash", "cpu", "source")
        ):
            attributes[key] = " | ".join(values)
    if "workflow" in attributes:
        attributes["workflow"] = _workflow(attributes["workflow"], joined[axis])
    attributes["history"] = (
        f"{now()}: {command()}: {counted(len(parts), 'survey')} joined along {axis}"
    ) + "".join(f"; {line}" for line in chosen)
    joined = joined.copy()
    joined.attrs = attributes  # in place of those of the first part
    total = tally(joined)
    for arrays in reading.pieces(joined):
        total.add(arrays)
    return joined.assign_attrs(total.attributes)


def _workflow(text, coordinate):
    """The workflow with the joined axis, without what belongs to the parts."""
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return text
    if not isinstance(data.get("axes"), dict):
        return text
    data = {key: table for key, table in data.items() if key not in ("boundaries", "refine")}
    numbers = coordinate.dtype.kind in "iuf"
    data["axes"] |= {
        coordinate.name: unchanged(coordinate.values) if numbers else coordinate.values.tolist()
    }
    return tomli_w.dumps(data)


def _write(joined, output, folder):
    """Write a survey's dataset as a run does, a row of tiles at a time."""
    point = joined.status.dims
    masked = {
        name: {FILL: np.int32(fill_of(v))}
        for name, v in joined.data_vars.items()
        if fill_of(v) is not None
    }
    variables = {
        name: (v.dims, v.attrs | masked.get(name, {})) for name, v in joined.data_vars.items()
    }
    coordinates = {name: (c.dims, c.values.astype("U") if c.dtype.kind == "O" else c.values, c.attrs)
                   for name, c in joined.coords.items()}  # fmt: skip
    layout = {name: (np.dtype("int32") if name in masked else v.dtype, None, v.shape[len(point) :])
              for name, v in joined.data_vars.items()}  # fmt: skip
    tile = halved(joined.status.shape, TILE_POINTS)
    file = MapFile(output, folder, coordinates, variables, layout, joined.status.shape, tile)
    try:
        rows = (
            max(1, reading.PIECE // max(1, joined.status[0].size)) // tile[0] * tile[0] or tile[0]
        )
        for first in range(0, joined.sizes[point[0]], rows):
            cut = slice(first, min(first + rows, joined.sizes[point[0]]))
            where = (cut, *(slice(0, joined.sizes[dim]) for dim in point[1:]))
            for name, variable in joined.data_vars.items():
                file.write(name, as_stored(variable.isel({point[0]: cut})), where)
        kept = {key: value for key, value in joined.attrs.items() if key != "complete"}
        file.publish(kept | {"date_created": now()})
    finally:
        file.discard()
