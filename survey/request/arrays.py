"""Parameters given as numbers and arrays: their dimensions are named, they are checked, and a grid
is made of them.
"""

import warnings
from collections.abc import Hashable, Iterable, Mapping
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import xarray as xr

from survey.errors import BadInput
from survey.grid import Grid
from survey.request import physical
from survey.scene import Parameter, Request
from survey.wording import counted, short, shown

Labelled: TypeAlias = xr.Variable | xr.DataArray


def as_labelled(key: str, value: Any) -> Labelled:
    """The parameter as float64 numbers with dimensions: plain numbers and NumPy arrays become a Variable, which
    is faster to make, all else a DataArray.
    """
    given = value
    if isinstance(value, xr.Variable):
        value = xr.DataArray(value)
    unnamed = not isinstance(value, xr.DataArray)
    array = _array(key, value) if unnamed and not hasattr(value, "dask") else value
    if unnamed and array.ndim > 1:
        raise BadInput(
            f"{short(key, 40)}: an array of {array.ndim} dimensions needs names for them; give a DataArray"
        )
    if array.dtype.kind not in "iuf":  # xarray itself may fail on whole numbers beyond floats
        raise _not_real(key, value.values if isinstance(given, xr.DataArray) else given)
    if array.size == 0:
        raise BadInput(f"{short(key, 40)}: an empty array has no points; give at least one value")
    if unnamed and isinstance(array, np.ndarray):
        return xr.Variable(
            (key,) if array.ndim else (), np.array(array, dtype=float), fastpath=True
        )
    if unnamed:
        value = xr.DataArray(array, dims=(key,) if array.ndim else ())
    return (
        value.astype(float)
        if is_lazy(value)
        else value.copy(data=np.array(value.values, dtype=float))
    )


def as_data_array(array: Labelled) -> xr.DataArray:
    """The same numbers as a DataArray."""
    return array if isinstance(array, xr.DataArray) else xr.DataArray(array)


def is_lazy(array: Labelled) -> bool:
    """Is it a dask array? (`chunks` alone is slow where it is not.)"""
    return not isinstance(array.data, np.ndarray) and bool(array.chunks)


def _array(key: str, value: Any) -> npt.NDArray[Any]:
    """The parameter as an array; masked values are NaN, which affects only their points."""
    try:
        if np.ma.isMaskedArray(value):
            return np.ma.filled(value.astype(float), np.nan)
        return np.asarray(value)
    except Exception:  # a list of lists of unequal lengths; an object of any kind
        raise _not_real(key, value) from None


def _not_real(key: str, value: Any) -> BadInput:
    return BadInput(
        f"{short(key, 40)} = {shown(value)}: it must be a real number or an array of real numbers"
    )


def check_dimensions(module: Any, given: Mapping[str, Labelled]) -> None:
    """Raise BadInput if coordinates disagree along a shared dimension, or a dimension has the name
    of an output.
    """
    wide = [array for array in given.values() if array.dims]
    if not wide:
        return
    try:
        if len(wide) > 1 and any(isinstance(array, xr.DataArray) for array in wide):
            xr.align(*map(as_data_array, wide), join="exact", copy=False)
    except ValueError as error:
        raise BadInput(
            f"the parameters' coordinates disagree: {str(error).splitlines()[0]}; align them first"
        ) from None
    foreign = {key: array.dims for key, array in given.items() if array.dims not in ((), (key,))}
    if not foreign:
        return
    outputs = {output.name for output in module.OUTPUTS} | {
        "status",
        *getattr(module, "DIMENSIONS", ()),
    }
    clashes = outputs | {name for name, other in given.items() if not other.ndim}
    for key, dims in foreign.items():
        for dim in set(dims) & clashes - {key}:
            what = (
                "an output or its dimension"
                if dim in outputs
                else "a parameter that is a single number"
            )
            raise BadInput(f"{key}: its dimension {dim!r} clashes with {what}; rename it")


def check_domains(
    used: dict[str, Parameter],
    given: Mapping[str, Labelled],
    request: Request,
    named: Iterable[str],
) -> None:
    """Raise BadInput for a single value outside its domain; warn of arrays with such that look like
    degrees.
    """
    for key, array in given.items():
        if is_lazy(array) or (array.ndim and used[key].units != "rad"):
            continue
        outside = ~used[key].holds(array.values, request.variables)
        if not outside.any():
            continue
        value = float(array.values[outside][0])
        hint = physical.hint(used[key], value, named)
        if array.ndim == 0:
            raise BadInput(
                f"{key} = {value:g} is outside its domain; allowed: {used[key].domain}{hint}"
            )
        if hint and f"{key}{physical.DEGREES}" not in named:
            what = f"{counted(outside.sum(), 'value')} outside the domain, such as {value:g}"
            warnings.warn(f"evaluate: {key} has {what}{hint}", stacklevel=3)


def grid_of(used: dict[str, Parameter], given: Mapping[str, Labelled]) -> Grid:
    """The Grid of the parameters; raises BadInput where sizes of a dimension differ."""
    sizes: dict[Hashable, int] = {}
    for key, array in given.items():
        for dim, size in zip(array.dims, array.shape, strict=True):
            if sizes.setdefault(dim, size) != size:
                here = counted(size, "value")
                raise BadInput(
                    f"{key}: dimension {dim!r} has {here} here and {sizes[dim]:,} in another parameter"
                )
    return Grid(
        sizes=sizes,
        parameters={key: (array.dims, array.values) for key, array in given.items()},
        uncut=frozenset(
            dim for key, array in given.items() if used[key].uncut for dim in array.dims
        ),
    )


def own_coordinates(given: Mapping[str, Labelled]) -> dict[Hashable, xr.Variable]:
    """Coordinates that the caller's DataArrays bring along, without what these bring along in turn."""
    own: dict[Hashable, xr.Variable] = {}
    for array in given.values():
        if not isinstance(array, xr.DataArray):
            continue
        own |= {name: coord.variable for name, coord in array.coords.items() if name not in given}
    return own
