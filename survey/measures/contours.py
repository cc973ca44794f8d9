"""Zero curves on a map of a function that can be evaluated anywhere, each point bracketed by
certain signs.

They are searched for on a lattice of lines, by marching squares. A closed curve narrower than the
distance between two lines may be missed. Positions are those of `survey.measures.square`.
"""

import contourpy
import numpy as np
from scipy.ndimage import distance_transform_edt

from survey.measures.hill.edges import close_in

HALVINGS = 30
SURE = 1e-9  # half the width of what brackets a point


def lattice(number, across=None):
    """Positions (number^2, 2) of the crossings of the lines, the second axis running fastest.

    `across`: only those (number, 2) at this position on the second axis.
    """
    ticks = np.linspace(0.0, 1.0, number)
    first, second = np.meshgrid(ticks, ticks if across is None else across, indexing="ij")
    return np.stack([first.ravel(), second.ravel()], axis=1)


def filled(values):
    """The values on a lattice, those that are not finite replaced by the nearest ones that are; 0
    if none is.
    """
    unknown = ~np.isfinite(values)
    if unknown.all():
        return np.zeros(values.shape)
    return values[
        tuple(distance_transform_edt(unknown, return_distances=False, return_indices=True))
    ]


def lines(function, square, number, values=None, halvings=HALVINGS):
    """[(positions (m, 2), errors (m))] of the curves function(x) = 0, from border to border or
    round.

    Where only a border of the `square` is asked for, the points there, each alone.

    function(positions (m, 2)) -> (values, error bounds), NaN where there is none; `values`: those
    on the `lattice`, where they are known.
    """
    x = lattice(number, square.across)
    values = function(x)[0] if values is None else values
    if square.across is not None:
        return _crossings(function, square, x, values, halvings)
    values, (first, second) = values.reshape(number, number), x.T.reshape(2, number, number)
    found = contourpy.contour_generator(second, first, np.ma.masked_invalid(values)).lines(0.0)
    drawn = []
    for line in found:
        x, error, sure = _closed_in(
            function, np.asarray(line)[:, ::-1], square.grain, number, halvings
        )
        drawn += [(x[part], error[part]) for part in runs(sure)]
    return drawn


def _crossings(function, square, x, values, halvings):
    """The points on the line through positions x (number, 2) at which the sign of the function changes."""
    with np.errstate(invalid="ignore"):
        changes = np.isfinite(values[1:] + values[:-1]) & (
            (values[1:] > 0.0) != (values[:-1] > 0.0)
        )
    if not changes.any():
        return []
    start = 0.5 * (x[1:] + x[:-1])[changes]
    found, error, sure = _closed_in(function, start, square.grain, len(x), halvings)
    return [(found[[i]], error[[i]]) for i in np.flatnonzero(sure)]


def _closed_in(function, x, grain, number, halvings):
    """(positions, errors, are signs certain?) of a curve through positions x, each between two
    crossings of lines.
    """
    step, rows = (number - 1) * x, np.arange(len(x))
    along = np.argmax(abs(step - np.rint(step)), axis=1)
    x[rows, 1 - along] = np.rint(step)[rows, 1 - along] / (number - 1)
    low = np.floor(step)[rows, along] / (number - 1)
    high = np.minimum(low + 1.0 / (number - 1), 1.0)

    def at(which, t):
        here = np.repeat(x[which][:, None], t.shape[1], axis=1)
        here[np.arange(len(t)), :, along[which]] = t
        value, bar = function(here.reshape(-1, 2))
        return value.reshape(t.shape), bar.reshape(t.shape)

    sign = np.sign(at(rows, low[:, None])[0][:, 0])
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        same = np.sign(at(rows, middle[:, None])[0][:, 0]) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    t, width, sure = close_in(at, 0.5 * (low + high), high - low, np.full(len(x), grain))
    sure &= (width < SURE) & (t >= 0.0) & (t <= 1.0)
    x[rows, along] = t
    return x, width + grain, sure


def runs(good):
    """Index arrays of the runs of at least two that are good, or of a single point."""
    parts = np.split(np.arange(good.size), 1 + np.flatnonzero(np.diff(good)))
    return [part for part in parts if (part.size > 1 or good.size == 1) and good[part[0]]]
