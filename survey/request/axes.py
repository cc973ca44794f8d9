"""The axes of a workflow: entries of [axes] -> coordinates, checked, and the grid that they span."""

from math import prod

import numpy as np

from survey.errors import BadInput
from survey.grid import Grid, check_axis, coordinates
from survey.request import physical
from survey.request.schema import Listed, Spread
from survey.wording import shown

MAX_POINTS = 10**11  # of a map


def check_size(axes):
    """Raise BadInput for a map of too many points, before any is made."""
    points = prod(axis.num if isinstance(axis, Spread) else 1 for axis in axes.values())
    if points > MAX_POINTS:
        raise BadInput(
            f"the axes span {points:.3g} points; a map holds at most {MAX_POINTS:.0e}; use fewer"
        )


def as_float(key, number):
    """The number as a float; raises BadInput for an integer too large to be one."""
    try:
        return float(number)
    except OverflowError:
        raise BadInput(f"{key} = {shown(number)}: it exceeds the largest number, 1.8e308") from None


def values_of(key, axis):
    """The coordinates of an axis, or the single number."""
    if isinstance(axis, Spread):
        try:
            values = coordinates(axis.start, axis.stop, axis.num, axis.spacing)
        except BadInput as error:
            raise BadInput(f"{key}: {error}") from None
    elif isinstance(axis, (Listed, list)):
        values = np.array(getattr(axis, "values", axis), dtype=float)
    else:
        return np.float64(axis)
    check_axis(key, values)
    return values


def check_domain(parameter, values, outputs, others=(), given=()):
    """Raise BadInput if a single value or an end of an axis lies outside the parameter's domain for
    these outputs.

    `others`: names of the parameters that may take its place; `given`: those of the axes as they
    were given.
    """
    ends = np.atleast_1d(values)[[0, -1]]
    for value in ends[~parameter.holds(ends, outputs)]:
        what = "is" if np.ndim(values) == 0 else "has an end"
        instead = (
            f"; instead of {parameter.name} you can give {' or '.join(others)}" if others else ""
        )
        raise BadInput(
            f"axes.{parameter.name} {what} {value:g}, outside its domain; allowed: {parameter.domain}"
            f"{physical.hint(parameter, float(value), given)}{instead}"
        )


def grid_of(parameters, given):
    """The grid of the workflow's axes (their order is that of the dimensions), fixed numbers and defaults."""
    axes = {key: values for key, values in given.items() if np.ndim(values)}
    fixed = {
        key: given.get(key, parameter.default)
        for key, parameter in parameters.items()
        if key not in axes
    }
    return Grid(
        sizes={key: values.size for key, values in axes.items()},
        parameters={key: ((key,), values) for key, values in axes.items()}
        | {key: ((), np.float64(value)) for key, value in fixed.items()},
        uncut=frozenset(key for key in axes if parameters[key].uncut),
    )
