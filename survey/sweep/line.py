"""The boundaries that a line along one parameter meets, all others fixed: exact as the curves of
[boundaries] are.

Where a scene's family finds curves without rows, the line is the border of a narrow map: there the
curves end at points of their own, and the error of such a point is along the border.
"""

from dataclasses import dataclass

import numpy as np

from survey import measures
from survey.errors import BadInput
from survey.measures.square import Square

NARROW = 1e-3  # the map's width, relative to 1 + |value|
SAME = 4.0  # error bounds within which two points are the same


@dataclass(frozen=True)
class OnLine:
    """Boundaries, ascending: `position`, its `error`, `kind` (a code of the family's CLASSES).

    `complete`: is it shown that these are all? None where this is not known. `index`: their numbers, if they
    have any.
    """

    position: np.ndarray
    error: np.ndarray
    kind: np.ndarray
    complete: bool | None = None
    index: np.ndarray | None = None

    def __getitem__(self, those):
        index = None if self.index is None else self.index[those]
        return OnLine(
            self.position[those], self.error[those], self.kind[those], self.complete, index
        )


def together(parts, complete):
    """The OnLine of all parts, one after another."""

    def all_of(name):
        values = [getattr(part, name) for part in parts]
        return None if any(one is None for one in values) else np.concatenate(values)

    return OnLine(*map(all_of, ("position", "error", "kind")), complete, all_of("index"))


def on_line(scene, options, along, ends, fixed):
    """The OnLine between `ends` (low, high) of the parameter `along`; `fixed`: {name: value} of all
    others.

    Raises BadInput where the scene's family knows no curves.
    """
    measure = measures.curves(scene)
    is_closed = hasattr(measure, "closed")  # others are searched along any axis
    second = second_axis(measure, scene, along, fixed, options) if is_closed else ""
    if second:
        bounds = _bounds(next(p for p in scene.PARAMETERS if p.name == second), fixed[second])
    else:
        bounds, scene = (0.0, 1.0), _Flat(scene)
    others = {name: value for name, value in fixed.items() if name != second}
    low, high = (np.array(pair, float) for pair in zip(ends, bounds, strict=True))
    value = fixed.get(second, 0.0)
    square = Square(low, high, np.array([False, False]), across=float(value != bounds[0]))
    if hasattr(measure, "searched"):
        curves = measure.searched(scene, square, [along, second], others, options)
    else:
        curves = measure.closed(square, [along, second], others, options)
    here = np.flatnonzero(curves.parameters[:, 1] == value)
    position, kind = curves.parameters[here, 0], np.repeat(curves.kind, curves.count)[here]
    error = np.asarray(curves.error)[here] * (ends[1] - ends[0]) + np.spacing(abs(position))
    index = None if curves.index is None else np.repeat(curves.index, curves.count)[here]
    found = OnLine(position, error, kind, curves.complete, index)[np.lexsort((position, kind))]
    near = np.diff(found.position) <= SAME * (found.error[1:] + found.error[:-1])
    keep = np.ones(position.size, bool)
    keep[1:] = ~(near & (np.diff(found.kind) == 0))
    found = found[keep]
    return found[np.lexsort((found.kind, found.position))]


def second_axis(measure, scene, along, fixed, options):
    """The parameter that spans a map with `along` on which curves are known; "" where they are
    known along it alone.

    Raises BadInput if there is neither.
    """
    if measure.refusal([along], scene, options) is None:
        return ""
    for p in scene.PARAMETERS:
        known = p.name != along and np.isfinite(fixed.get(p.name, np.nan))
        if known and measure.refusal([along, p.name], scene, options) is None:
            return p.name
    raise BadInput(
        f"no boundaries are known along {along}: {measure.refusal([along], scene, options)}"
    )


def _bounds(parameter, value):
    """(low, high) of a narrow range inside the parameter's domain, of which `value` is an end."""
    width = NARROW * (1.0 + abs(value))
    for other in (value + width, value - width):
        inside = parameter.holds([other]).all() and not any(
            min(value, other) <= excluded <= max(value, other) for excluded in parameter.excluded
        )
        if inside:
            return min(value, other), max(value, other)
    raise BadInput(
        f"{parameter.name} = {value:g}: no boundaries can be found so close to the ends of its domain"
    )


class _Flat:
    """A scene with a second parameter, "", on which nothing depends."""

    def __init__(self, scene):
        self._scene = scene

    def __getattr__(self, name):
        return getattr(self._scene, name)

    def solve(self, point, request):
        """As the scene does; points that differ by the second parameter alone are solved once."""
        columns = np.broadcast_arrays(*(np.atleast_1d(values) for values in point.values()))
        own = {name: values for name, values in zip(point, columns, strict=True) if name}
        rows, where = np.unique(np.stack([*own.values()], axis=-1), axis=0, return_inverse=True)
        out = self._scene.solve(dict(zip(own, rows.T, strict=True)), request)
        return {name: values[where.reshape(-1)] for name, values in out.items()}
