"""The numbers of curves along which a pair of multipliers of a symplectic system passes 1 or -1.

The Maslov index counts such passages (see `maslov`), so it differs by 1 between the two sides of a
curve, and the greater of the two is the same all along: the curve's number, which tells it from all
others of its class that a line across the map meets. Of Hill's equation y'' + (a + ...) y = 0 it
counts the edges of the class below a, this one included.
"""

from functools import partial

import numpy as np

from survey.measures.segments import UNKNOWN

ASIDE = (1e-5, 1e-6, 1e-4)  # of the map: how far from a curve its sides are looked at, in turn
SOME = 7  # points of a curve


def of_curves(curves, square, index):
    """The numbers (C) of the Curves on a map; UNKNOWN where they are not certain, as of a curve whose
    neighbour is nearer than its sides.

    The function `index` takes a class and positions (N, 2), and returns the index there, or None if
    the class has none.
    """
    found = np.full(len(curves.count), UNKNOWN, dtype=np.int32)
    x, normal = np.empty((2, found.size, SOME, 2))
    ends = np.cumsum(curves.count)
    for k, (first, last) in enumerate(zip(ends - curves.count, ends, strict=True)):
        own = square.positions(curves.parameters[first:last])
        some = np.linspace(0, len(own) - 1, SOME + 2).astype(int)[1:-1]
        x[k], normal[k] = own[some], _normals(own)[some]
    for kind in np.unique(curves.kind):
        own = np.flatnonzero(curves.kind == kind)
        at = (values[own].reshape(-1, 2) for values in (x, normal))
        for k, numbers in zip(
            own, _numbers(*at, partial(index, kind)).reshape(-1, SOME), strict=True
        ):
            known = np.unique(numbers[numbers != UNKNOWN])
            if known.size == 1:
                found[k] = known[0]
    return found


def _normals(x):
    """Unit vectors across a curve of positions x (m, 2); along the first axis where it is one point."""
    if len(x) < 2:
        return np.array([[1.0, 0.0]])
    along = np.gradient(x, axis=0)
    return along[:, ::-1] * [1.0, -1.0] / np.maximum(np.hypot(*along.T), 1e-300)[:, None]


def _numbers(x, normal, index):
    """The numbers at points x (m, 2) of curves, UNKNOWN where they are not certain."""
    found = np.full(len(x), UNKNOWN, dtype=np.int64)
    for aside in ASIDE:
        left = np.flatnonzero(found == UNKNOWN)
        sides = np.concatenate([x[left] - aside * normal[left], x[left] + aside * normal[left]])
        values = index(sides) if left.size else None
        if values is None:
            break
        one, other = values.astype(np.int64).reshape(2, -1)
        inside = ((sides >= 0.0) & (sides <= 1.0)).all(axis=1).reshape(2, -1).all(axis=0)
        known = inside & (one != UNKNOWN) & (other != UNKNOWN) & (abs(one - other) == 1)
        found[left[known]] = np.maximum(one, other)[known]
    return found
