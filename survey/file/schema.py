"""What a survey's dataset holds: checked when one is opened, for whoever wrote the file may be a stranger.

Nothing here reads more than attributes, types, dimensions and coordinates; what stands beside a map (edges, curves,
cells) is checked where it is used.
"""

import math
from collections.abc import Mapping

import numpy as np

from survey.errors import Damaged

# deflate makes nothing smaller than this: a file that is larger than it can be holds values that were never written
RATIO, SPARE = 1032, 2**20
CHUNK = 2**28  # bytes: no tile of survey takes a hundredth of it
AXIS = 10**8  # values: a workflow allows no more
VARIABLES, FLAGS = 2000, 28
REQUIRED = ("scene", "options", "method", "rtol")
TEXTS = (
    "scene", "options", "method", "title", "summary", "scene_text", "scene_hash", "workflow", "boundaries", "refine",
    "status_counts", "verdict_counts", "areas",
)  # fmt: skip
PACKING = ("scale_factor", "add_offset", "missing_value", "_Unsigned")
ENCODINGS = ("utf-8", "ascii")


def check(ds, whole=True):
    """Raise Damaged, naming the part, where the dataset is none that survey writes.

    `whole`, as files are: all attributes are there, the flags of the status too, and each axis has finite numbers.
    """
    _check_attributes(ds.attrs, REQUIRED if whole else ("scene",))
    _check_points(ds)
    for name, variable in ds.variables.items():
        _check_variable(ds, name, variable)
    if whole:
        _flags_of("status", ds.status.attrs)
        _check_axes(ds)


def check_declared(file, size):
    """Raise Damaged where an open netCDF4 file of `size` bytes declares more than it can hold, or other types."""
    if len(file.variables) > VARIABLES:
        raise Damaged(f"it has {len(file.variables):,} variables, and no survey has more than {VARIABLES:,}")
    whole = 0
    for name, variable in file.variables.items():
        kind = np.dtype(object) if variable.dtype is str else variable.datatype
        if not isinstance(kind, np.dtype) or kind.kind not in "iufSO":
            raise Damaged(f"the variable {name} holds neither numbers nor text")
        if name in variable.dimensions and variable.size > AXIS:
            raise Damaged(f"the axis {name} has {variable.size:,} values, more than {AXIS:,}")
        _check_packing(name, variable)
        whole += math.prod(variable.shape) * kind.itemsize
        chunks = variable.chunking()
        if isinstance(chunks, list) and math.prod(chunks) * kind.itemsize > CHUNK:
            raise Damaged(f"the variable {name} has chunks of {math.prod(chunks) * kind.itemsize:,} bytes")
    if whole > RATIO * size + SPARE:
        raise Damaged(f"it declares {whole:,} bytes of values, more than a file of {size:,} bytes can hold")


def _check_packing(name, variable):
    attributes = variable.ncattrs()
    for key in PACKING:
        if key in attributes:
            raise Damaged(f"the variable {name} has the attribute {key}, and values of surveys are stored as they are")
    if np.size(variable.getncattr("_FillValue") if "_FillValue" in attributes else 0) != 1:
        raise Damaged(f"the variable {name} has more than one _FillValue, or none that is one")
    encoding = variable.getncattr("_Encoding") if "_Encoding" in attributes else "utf-8"
    if str(encoding).lower().replace("utf8", "utf-8") not in ENCODINGS:
        raise Damaged(f"{name}._Encoding = {str(encoding)[:60]!r} (allowed: {', '.join(ENCODINGS)})")


def _check_attributes(given, required):
    for name in required:
        if name not in given:
            raise Damaged(f"the attribute {name} is missing")
    for name in TEXTS:
        if not isinstance(given.get(name, ""), str):
            raise Damaged(f"the attribute {name} is {_repr(given[name])}, and should be a text")
    if not given["scene"]:
        raise Damaged("the attribute scene is empty")
    rtol = given.get("rtol", 0.5)
    if not (isinstance(rtol, (int, float, np.integer, np.floating)) and 0 < rtol < 1):
        raise Damaged(f"the attribute rtol is {_repr(rtol)}, and should be a number between 0 and 1")
    options(given)


def options(given):
    """{name: value} in the attribute `options`; raises Damaged."""
    pairs = [pair.split("=") for pair in given.get("options", "").split(", ") if pair]
    if any(len(pair) != 2 for pair in pairs):
        raise Damaged(f"the attribute options is {_repr(given['options'])}, and should read name=value, name=value")
    return dict(pairs)


def flags(meaning):
    """{flag meaning: code} from the attributes of a CF flag variable; raises Damaged."""
    words, codes = meaning.get("flag_meanings"), np.atleast_1d(meaning.get("flag_values", ()))
    names = words.split() if isinstance(words, str) else []
    if not names or codes.dtype.kind not in "iu" or codes.shape != (len(names),):
        raise Damaged("flag_meanings and flag_values do not name one integer each")
    if len(names) > FLAGS or len(set(names)) < len(names) or np.unique(codes).size < codes.size:
        raise Damaged(f"flag_meanings and flag_values name something twice, or more than {FLAGS} flags")
    if codes.min() < -128 or codes.max() > 127:
        raise Damaged("flag_values reach beyond a byte")
    return dict(zip(names, codes.tolist(), strict=True))


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
            raise Damaged(f"the variable {name} should hold an integer for each point")


def _check_variable(ds, name, variable):
    if not isinstance(name, str):
        raise Damaged(f"{name!r} is no name of a variable")
    given = variable.attrs
    for key in ("long_name", "units", "symbol", "comment"):
        if not isinstance(given.get(key, ""), str):
            raise Damaged(f"{name}.{key} is {_repr(given[key])}, and should be a text")
    if "flag_values" in given or "flag_meanings" in given:
        _flags_of(name, given)
    if "flag_values" in given and variable.dtype.kind not in "iu":
        raise Damaged(f"{name} has flags, and holds no integers")
    of_points = name in ds.data_vars and set(ds.status.dims) <= set(variable.dims)
    if of_points and variable.dtype.kind not in "iuf":
        raise Damaged(f"{name} does not hold a number for each point")
    bar = ds.variables.get(f"{name}_error")
    if bar is not None and (bar.dims != variable.dims or bar.dtype.kind != "f"):
        raise Damaged(f"{name}_error is no error bar for each value of {name}")


def _flags_of(name, meaning):
    try:
        flags(meaning)
    except Damaged as error:
        raise Damaged(f"{name}: {error}") from None


def _check_axes(ds):
    for dim in ds.status.dims:
        axis = ds.variables.get(dim)
        if axis is None:
            continue
        if axis.dims != (dim,) or axis.dtype.kind not in "iuf":
            raise Damaged(f"the axis {dim} is no list of numbers")
        if not np.isfinite(axis.values).all():
            raise Damaged(f"the axis {dim} holds what is no finite number")


def edges(ds):
    """Raise Damaged unless the rows' edges of tongues are whole: `edge_*` along the dimension `edge`."""
    _along(ds, "edge", "edge_position", "edge_position_error", "edge_class", "edge_index")
    _divided(ds, "edge_count", "edge")
    _coded(ds, "edge_class")
    if not set(ds.edge_count.dims) <= set(ds.status.dims) or ds.attrs.get("boundaries") not in ds.status.dims:
        raise Damaged("edge_count, or the attribute boundaries, does not name axes of the map")


def curves(ds):
    """Raise Damaged unless the boundary curves are whole: `curve_*` along the dimensions `curve` and `curve_point`."""
    _along(ds, "curve", "curve_count", "curve_class", *(["curve_index"] if "curve_index" in ds else []))
    _along(ds, "curve_point", *(f"curve_{dim}" for dim in ds.status.dims))
    _divided(ds, "curve_count", "curve_point")
    _coded(ds, "curve_class")


def cells(ds):
    """Raise Damaged unless the cells of a refined map and the areas of its verdicts are whole."""
    if ds.attrs.get("refine") != ", ".join(ds.status.dims) or len(ds.status.dims) != 2:
        raise Damaged("the attribute refine does not name the two axes of the map")
    _along(ds, "cell", "cell_verdict", *(f"cell_{dim}_{end}" for dim in ds.status.dims for end in ("low", "high")))
    _coded(ds, "cell_verdict")
    if "undecided" not in flags(ds.cell_verdict.attrs) or not ds.sizes["cell"]:
        raise Damaged("cell_verdict has no flag undecided, or no values")
    areas(ds)


def areas(ds):
    """Raise Damaged unless each verdict has its area and its share."""
    _along(ds, "area_verdict", "area_verdict", "area", "area_error", "area_fraction", "area_fraction_error")
    if len(flags(ds.area_verdict.attrs)) != ds.sizes["area_verdict"]:
        raise Damaged("area_verdict does not name a verdict for each area")


def _along(ds, what, *names):
    """Raise Damaged unless the dataset has these variables, all numbers along the dimension `what` alone."""
    for name in names:
        variable = ds.variables.get(name)
        if variable is None or variable.dims != (what,) or variable.dtype.kind not in "iuf":
            raise Damaged(f"{name} should hold a number for each {what}")


def _divided(ds, count, what):
    """Raise Damaged unless the integers `count` divide the dimension `what` among them."""
    number = ds[count].values if count in ds else np.array([-1])
    if number.dtype.kind not in "iu" or (number < 0).any() or number.sum(dtype=float) != ds.sizes.get(what, 0):
        raise Damaged(f"{count} does not tell how the values along {what} are divided")


def _coded(ds, name):
    """Raise Damaged unless every value of a flag variable is one of its flags."""
    if not np.isin(ds[name].values, list(flags(ds[name].attrs).values())).all():
        raise Damaged(f"{name} holds codes that its flag_values do not name")


def _repr(value):
    text = "a table" if isinstance(value, Mapping) else repr(value)
    return text if len(text) <= 60 else f"{text[:56]} ..."
