"""Verdicts as words, as masks, and combined ones as a survey that can be drawn."""

import numpy as np
import xarray as xr

from survey import modules, status
from survey.errors import BadInput
from survey.file.labels import UNDECIDED, flag_attributes, flag_codes
from survey.wording import shown

COMBINED = {"no": 0, "yes": 1}


def names(ds):
    """The verdict of every point as a word (str), or its status where there is no answer."""
    kinds = _kinds(ds)
    words = np.full(ds.status.shape, "", object)
    for name, where in kinds.items():
        words[where] = name
    about = {"long_name": "verdict, or status where there is no answer", "units": "1"}
    return xr.DataArray(
        words.astype(str), ds.status.coords, ds.status.dims, name="verdict_name", attrs=about
    )


def where(ds, name):
    """True where the verdict, or the status, is `name`."""
    kinds = _kinds(ds)
    codes = flag_codes(ds.status.attrs)
    if not isinstance(name, str):
        raise BadInput(
            f"where: give the name of one verdict or status, not {shown(name)}; join several by | and &"
        )
    if name in kinds:
        found = kinds[name]
    elif name in codes:
        found = ds.status.values == codes[name]
    else:
        raise BadInput(
            modules.unknown(
                "verdict or status", name, [*kinds, *(n for n in codes if n not in kinds)]
            )
        )
    about = {"long_name": name.replace("_", " "), "units": "1"}
    return xr.DataArray(found, ds.status.coords, ds.status.dims, name=name, attrs=about)


def _kinds(ds):
    """{verdict, then status of points without an answer: where it is}."""
    dims = ds.status.dims
    kinds = {}
    statuses = {code: name for name, code in flag_codes(ds.status.attrs).items()}
    open_ = np.ones(ds.status.shape, bool)
    if "verdict" in ds:
        verdict = ds.verdict.transpose(*dims).values
        open_ = (verdict == UNDECIDED) & (ds.status.values != status.OK)
        kinds = {
            name: (verdict == code) & ~open_ for name, code in flag_codes(ds.verdict.attrs).items()
        }
    for code in np.unique(ds.status.values[open_]):
        kinds[statuses[int(code)]] = open_ & (ds.status.values == code)
    return kinds


def combined(ds, given):
    """The survey with a variable "combined" of flags, from an array of booleans at its points;
    raises BadInput.
    """
    if not isinstance(given, xr.DataArray) and np.shape(given) == ds.status.shape:
        given = xr.DataArray(np.asarray(given), ds.status.coords, ds.status.dims)
    if (
        not isinstance(given, xr.DataArray)
        or given.dtype != bool
        or set(given.dims) != set(ds.status.dims)
    ):
        raise BadInput(
            "map: an array to be drawn holds booleans at the points of the survey, such as "
            "a.survey.where('stable') & b.survey.where('stable')"
        )
    try:
        given = xr.align(given, ds.status, join="exact")[0]
    except ValueError:
        raise BadInput(
            "map: the coordinates of the array are not those of the survey; combine surveys with "
            "the same axes"
        ) from None
    about = {"long_name": _title(ds, given).replace("_", " "), "units": "1"}
    codes = xr.DataArray(
        given.values.astype(np.int8),
        given.coords,
        given.dims,
        attrs=about | flag_attributes(COMBINED),
    )
    return ds.assign(combined=codes, status=xr.zeros_like(ds.status).assign_attrs(ds.status.attrs))


def _title(ds, given):
    """The array's name, unless it is one that xarray kept from what the array was made of, as in `~stable`."""
    name = given.name
    if name in _kinds(ds) or name in flag_codes(ds.status.attrs):
        own = bool((where(ds, name) == given).all())
    else:
        own = name is not None and name not in ds.variables
    return str(name) if own else "combined verdict"
