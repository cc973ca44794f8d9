"""The structure of a survey's dataset, checked when one is opened, since the file may be untrusted.

Only attributes, types, dimensions and coordinates are read here; edges, curves, surfaces and cells
are checked where they are used.
"""

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from survey.errors import BadInput, Damaged

# the largest compression ratio of deflate: a file that declares more holds values that were never
# written
RATIO = 1032
SPARE = 2**20
CHUNK = 2**28  # bytes: tiles of survey are a hundred times smaller
AXIS = 10**8  # values: more than a workflow allows
ROUNDED = 1e-9  # of an axis: by how much the end of a cell, or a vertex, may lie beyond it
AREA = 1e300  # so that sums and fractions of areas stay within the range of floats
VARIABLES, FLAGS = 2000, 28
REQUIRED = ("scene", "options", "method", "rtol")
TEXTS = (
    "scene", "options", "method", "title", "summary", "scene_text", "scene_hash", "workflow", "boundaries", "surfaces",
    "boundary_planes", "refine", "status_counts", "verdict_counts", "areas",
)  # fmt: skip
PACKING = ("scale_factor", "add_offset", "missing_value", "_Unsigned")
ENCODINGS = ("utf-8", "ascii")


def refuse_stacked(ds, which):
    """Raise BadInput where axes of `which` survey are stacked."""
    for dim in ds.status.dims:
        own = ds[dim].values if dim in ds.coords else np.zeros(0)
        if own.dtype == object and own.size and isinstance(own.flat[0], tuple):
            raise BadInput(
                f"{which} survey is stacked along {dim}: restore its axes with .unstack()"
            )


def check(ds, complete=True):
    """Raise Damaged, naming the part, where the dataset is not one that survey writes.

    `complete`, as in files: with all attributes and the flags of the status, and finite numbers on
    each axis.
    """
    _check_attributes(ds.attrs, REQUIRED if complete else ("scene",))
    _check_points(ds)
    for name, variable in ds.variables.items():
        _check_variable(ds, name, variable)
    if complete:
        _flags_of("status", ds.status.attrs)
        _check_axes(ds)


def check_declared(file, size):
    """Raise Damaged where an open netCDF4 file of `size` bytes declares more than it can hold, or
    unknown types.
    """
    if len(file.variables) > VARIABLES:
        raise Damaged(
            f"it has {len(file.variables):,} variables; no survey has more than {VARIABLES:,}"
        )
    declared = 0
    for name, variable in file.variables.items():
        kind = np.dtype(object) if variable.dtype is str else variable.datatype
        if not isinstance(kind, np.dtype) or kind.kind not in "iufSO":
            raise Damaged(f"the variable {name} contains neither numbers nor text")
        if name in variable.dimensions and variable.size > AXIS:
            raise Damaged(f"the axis {name} has {variable.size:,} values, more than {AXIS:,}")
        _check_packing(name, variable)
        declared += math.prod(variable.shape) * kind.itemsize
        chunks = variable.chunking()
        if isinstance(chunks, list) and math.prod(chunks) * kind.itemsize > CHUNK:
            raise Damaged(
                f"the variable {name} has chunks of {math.prod(chunks) * kind.itemsize:,} bytes"
            )
    if declared > RATIO * size + SPARE:
        raise Damaged(
            f"it declares {declared:,} bytes of values, more than a file of {size:,} bytes can hold"
        )


def _check_packing(name, variable):
    attributes = variable.ncattrs()
    for key in PACKING:
        if key in attributes:
            raise Damaged(
                f"the variable {name} has the attribute {key}, but surveys store values as they are"
            )
    if np.size(variable.getncattr("_FillValue") if "_FillValue" in attributes else 0) != 1:
        raise Damaged(f"the variable {name} must have a single _FillValue")
    encoding = variable.getncattr("_Encoding") if "_Encoding" in attributes else "utf-8"
    if str(encoding).lower().replace("utf8", "utf-8") not in ENCODINGS:
        raise Damaged(
            f"{name}._Encoding = {str(encoding)[:60]!r} (allowed: {', '.join(ENCODINGS)})"
        )


def _check_attributes(given, required):
    for name in required:
        if name not in given:
            raise Damaged(f"the attribute {name} is missing")
    for name in TEXTS:
        if not isinstance(given.get(name, ""), str):
            raise Damaged(f"the attribute {name} is {_brief(given[name])}; it must be text")
    if not given["scene"]:
        raise Damaged("the attribute scene is empty")
    rtol = given.get("rtol", 0.5)
    if not (isinstance(rtol, (int, float, np.integer, np.floating)) and 0 < rtol < 1):
        raise Damaged(f"the attribute rtol is {_brief(rtol)}; it must be a number between 0 and 1")
    options(given)


def options(given):
    """{name: value} in the attribute `options`; raises Damaged."""
    pairs = [pair.split("=") for pair in given.get("options", "").split(", ") if pair]
    if any(len(pair) != 2 for pair in pairs):
        raise Damaged(
            f"the attribute options is {_brief(given['options'])}; it must have the form name=value, name=value"
        )
    return dict(pairs)


def flags(attributes):
    """{flag meaning: code} from the attributes of a CF flag variable; raises Damaged."""
    meanings = attributes.get("flag_meanings")
    codes = np.atleast_1d(attributes.get("flag_values", ()))
    if not isinstance(meanings, str) or codes.dtype.kind not in "iu" or codes.ndim != 1:
        meanings = ""
        codes = np.zeros(0, int)
    return dict(_flags(meanings, tuple(codes.tolist())))


@lru_cache(maxsize=64)
def _flags(meanings, codes):
    names = meanings.split()
    if not names or len(codes) != len(names):
        raise Damaged("flag_meanings and flag_values must pair each meaning with an integer")
    if len(names) > FLAGS or len(set(names)) < len(names) or len(set(codes)) < len(codes):
        raise Damaged(
            f"flag_meanings and flag_values have duplicates, or more than {FLAGS} entries"
        )
    if min(codes) < -128 or max(codes) > 127:
        raise Damaged("flag_values must fit into a byte")
    return dict(zip(names, codes, strict=True))


def _check_points(ds):
    if "status" not in ds.data_vars:
        raise Damaged("the variable status is missing, or is a coordinate")
    axes = ds.status.dims
    if 0 in ds.status.shape:
        raise Damaged(f"the axis {axes[ds.status.shape.index(0)]} has no values")
    for name in ("status", "verdict"):
        if name not in ds.data_vars:
            continue
        if ds[name].dtype.kind != "i" or set(ds[name].dims) != set(axes):
            raise Damaged(
                f"the variable {name} must hold an integer for each point (means and other arithmetic leave none)"
            )


def _check_variable(ds, name, variable):
    if not isinstance(name, str):
        raise Damaged(f"{name!r} is not a variable name")
    given = variable.attrs
    for key in ("long_name", "units", "symbol", "comment"):
        if not isinstance(given.get(key, ""), str):
            raise Damaged(f"{name}.{key} is {_brief(given[key])}; it must be text")
    if "flag_values" in given or "flag_meanings" in given:
        _flags_of(name, given)
    if "flag_values" in given and variable.dtype.kind not in "iu":
        raise Damaged(f"{name} has flags, but does not hold integers")
    of_points = name in ds.data_vars and set(ds.status.dims) <= set(variable.dims)
    if of_points and variable.dtype.kind not in "iuf":
        raise Damaged(f"{name} does not hold a number for each point")
    bar = ds.variables.get(f"{name}_error")
    if bar is not None and (bar.dims != variable.dims or bar.dtype.kind != "f"):
        raise Damaged(f"{name}_error must hold an error bar for each value of {name}")
    if bar is not None and variable.dtype.kind != "f":
        raise Damaged(f"{name} has error bars, but does not hold floating-point numbers")


def _flags_of(name, attributes):
    try:
        flags(attributes)
    except Damaged as error:
        raise Damaged(f"{name}: {error}") from None


def _check_axes(ds):
    for dim in ds.status.dims:
        axis = ds.variables.get(dim)
        if axis is None:
            continue
        if axis.dims != (dim,) or not (axis.dtype.kind in "iufU" or _is_text(axis)):
            raise Damaged(f"the axis {dim} must be one-dimensional, and hold numbers or names")
        if axis.dtype.kind in "iuf" and not np.isfinite(axis.values).all():
            raise Damaged(f"the axis {dim} contains values that are not finite")


def _is_text(axis):
    return axis.dtype.kind == "O" and all(isinstance(value, str) for value in axis.values.ravel())


def edges(ds):
    """Raise Damaged unless the edges of tongues are consistent: `edge_*` along the dimension `edge`."""
    names = (
        "edge_position",
        "edge_position_error",
        "edge_class",
        *(["edge_index"] if "edge_index" in ds else []),
    )
    _along(ds, "edge", *names)
    _divided(ds, "edge_count", "edge")
    _coded(ds, "edge_class")
    if (
        not set(ds.edge_count.dims) <= set(ds.status.dims)
        or ds.attrs.get("boundaries") not in ds.status.dims
    ):
        raise Damaged("edge_count and the attribute boundaries must refer to axes of the map")


def curves(ds):
    """Raise Damaged unless the boundary curves are consistent: `curve_*` along `curve` and `curve_point`."""
    _along(
        ds, "curve", "curve_count", "curve_class", *(["curve_index"] if "curve_index" in ds else [])
    )
    _along(ds, "curve_point", *(f"curve_{dim}" for dim in ds.status.dims))
    _divided(ds, "curve_count", "curve_point")
    _coded(ds, "curve_class")
    planes = ds.attrs.get("boundary_planes")
    pairs = [pair.split(", ") for pair in planes.split("; ")] if planes is not None else []
    if not all(len(pair) == 2 and set(pair) <= set(ds.coords) for pair in pairs):
        raise Damaged("the attribute boundary_planes must name pairs of axes, such as a, b; b, c")


def surfaces(ds):
    """Raise Damaged unless the boundary surfaces are consistent: vertices, triangles and classes,
    on the three axes.
    """
    axes = ds.status.dims
    if len(axes) != 3 or ds.attrs.get("surfaces") != ", ".join(axes):
        raise Damaged("the attribute surfaces must name the three axes of the survey")
    _along(ds, "surface", "surface_vertices", "surface_triangles", "surface_class")
    _along(
        ds,
        "surface_vertex",
        "surface_position_error",
        "surface_axis",
        *(f"surface_{dim}" for dim in axes),
    )
    _divided(ds, "surface_vertices", "surface_vertex")
    _divided(ds, "surface_triangles", "surface_triangle")
    _coded(ds, "surface_class")
    _coded(ds, "surface_axis")
    if flags(ds.surface_axis.attrs) != {dim: k for k, dim in enumerate(axes)}:
        raise Damaged("the flags of surface_axis must be the axes of the survey, from 0")
    for dim in axes:
        if ds.sizes[dim] > 1:  # else a plane was taken out
            _on_axis(ds, dim, f"surface_{dim}")
        elif not np.isfinite(ds[f"surface_{dim}"].values).all():
            raise Damaged(f"surface_{dim} contains values that are not finite")
    if not (ds.surface_position_error.values >= 0).all():
        raise Damaged("surface_position_error must hold numbers that are not negative")
    corners = ds.variables.get("surface_corners")
    if corners is None or corners.dims[:1] != ("surface_triangle",) or corners.shape[1:] != (3,):
        raise Damaged("surface_corners must hold three vertices of each surface_triangle")
    if corners.dtype.kind not in "iu":
        raise Damaged("surface_corners must hold integers")
    ends = np.cumsum(ds.surface_vertices.values.astype(np.int64))
    last = np.repeat(ends, ds.surface_triangles.values)[:, None]
    first = np.repeat(ends - ds.surface_vertices.values, ds.surface_triangles.values)[:, None]
    if not ((corners.values >= first) & (corners.values < last)).all():
        raise Damaged("surface_corners must be vertices of the triangle's own surface")


def cells(ds):
    """Raise Damaged unless the cells of a refined map and the areas of its verdicts are consistent."""
    if ds.attrs.get("refine") != ", ".join(ds.status.dims) or len(ds.status.dims) != 2:
        raise Damaged("the attribute refine must name the two axes of the map")
    _along(
        ds,
        "cell",
        "cell_verdict",
        *(f"cell_{dim}_{end}" for dim in ds.status.dims for end in ("low", "high")),
    )
    for dim in ds.status.dims:
        _on_axis(ds, dim, f"cell_{dim}_low", f"cell_{dim}_high")
    _coded(ds, "cell_verdict")
    if "undecided" not in flags(ds.cell_verdict.attrs) or not ds.sizes["cell"]:
        raise Damaged("cell_verdict must have a flag undecided, and values")
    areas(ds)


def areas(ds):
    """Raise Damaged unless each verdict has its area and its fraction of the map, which add up to a whole."""
    names = ("area", "area_error", "area_fraction", "area_fraction_error")
    _along(ds, "area_verdict", "area_verdict", *names)
    for name in names:
        values = ds[name].values.astype(float)
        if not (values >= 0).all() or not (values / AREA < 1).all():
            raise Damaged(f"{name} must hold finite numbers that are not negative")
    if not abs(ds.area_fraction.values.astype(float).sum() - 1) < 1e-6:
        raise Damaged("area_fraction must add up to 1")
    if len(flags(ds.area_verdict.attrs)) != ds.sizes["area_verdict"]:
        raise Damaged("area_verdict must name a verdict for each area")


def _along(ds, what, *names):
    """Raise Damaged unless the dataset has these variables, all numbers along the dimension `what` alone."""
    for name in names:
        variable = ds.variables.get(name)
        if variable is None or variable.dims != (what,) or variable.dtype.kind not in "iuf":
            raise Damaged(
                f"{name} must hold a number for each {what}; join surveys by survey.concat, not by xarray"
            )


def _on_axis(ds, dim, *names):
    """Raise Damaged unless the values of these variables lie on the axis `dim`."""
    first, last = np.sort(ds[dim].values.astype(float)[[0, -1]])
    values = np.concatenate([ds[name].values.astype(float) for name in names])
    if not (
        (values - first >= ROUNDED * (first - last)) & (values - last <= ROUNDED * (last - first))
    ).all():
        raise Damaged(f"{' and '.join(names)} must lie on the axis {dim}")


def _divided(ds, count, what):
    """Raise Damaged unless the integers `count` partition the dimension `what`."""
    number = ds[count].values if count in ds else np.array([-1])
    if (
        number.dtype.kind not in "iu"
        or (number < 0).any()
        or number.sum(dtype=float) != ds.sizes.get(what, 0)
    ):
        raise Damaged(f"{count} must add up to the number of values along {what}")


def _coded(ds, name):
    """Raise Damaged unless every value of a flag variable is one of its flags."""
    if not np.isin(ds[name].values, list(flags(ds[name].attrs).values())).all():
        raise Damaged(f"{name} contains codes that are not among its flag_values")


def _brief(value):
    text = "a table" if isinstance(value, Mapping) else repr(value)
    return text if len(text) <= 60 else f"{text[:56]} ..."
