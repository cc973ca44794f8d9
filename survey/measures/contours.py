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
TO_GRAIN = 50  # halvings, to the rounding of a position: where a function ends on a line
DENSER = 8  # times the nodes of a line, where one line alone is searched
SURE = 1e-9  # half the width of what brackets a point
# of the distance between two lines: how far from a curve's chord it is searched for at its end, and
# how near that comes; and the nodes on a line across
ASIDE, LEAST, NODES = 0.5, 1e-3, 9


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


def continued(function, number):
    """Values (number^2) on the `lattice`, and past the end of the function at nodes next to it: there of
    the sign at the end, so that a curve less than a cell beside it is not cut.
    """
    x = lattice(number)
    values = function(x)[0]
    nodes, known = np.arange(values.size).reshape(number, number), np.isfinite(values)
    one, other = (
        np.append(nodes[:-1], nodes[:, :-1].T), np.append(nodes[1:], nodes[:, 1:].T)
    )  # fmt: skip
    inner, outer = np.append(one, other), np.append(other, one)
    ends = known[inner] & ~known[outer]
    inner, outer = inner[ends], outer[ends]
    value = _at_end(function, x[inner], x[outer], values[inner], HALVINGS)[1]
    crossed = (value > 0.0) != (values[inner] > 0.0)
    values[outer[~crossed]] = values[inner[~crossed]]
    values[outer[crossed]] = -values[inner[crossed]]
    return values


def to_the_end(function, grain, line, number):
    """The curve `line`, (positions, errors) as of `lines`, with further points at ends where the
    function ends, less than a cell ahead.
    """
    closed = np.array_equal(line[0][0], line[0][-1])
    for _ in range(0 if closed else 2):
        line = [part[::-1] for part in _longer(function, grain, *line, 1.0 / (number - 1))]
    return tuple(line)


def _longer(function, grain, x, error, step):
    """The curve with points behind its last one, on lines across it that halve the distance to its
    end.
    """
    tip = x[-1]
    around = np.clip(tip + step * np.array([(i, k) for i in (-1, 0, 1) for k in (-1, 0, 1)]), 0, 1)
    apart = np.flatnonzero(np.hypot(*(x - tip).T) > 0.5 * step)
    on_border = ((tip <= 0.0) | (tip >= 1.0)).any()
    if on_border or not apart.size or np.isfinite(function(around)[0]).all():
        return x, error
    chord = tip - x[apart[-1]]
    axis = int(np.argmax(abs(chord)))
    chord *= step / abs(chord[axis])
    nodes = ASIDE * step * np.linspace(-1.0, 1.0, NODES)
    points, errors, near, far = [x], [error], 0.0, 1.0
    while far - near > LEAST:
        part = 0.5 * (near + far)
        goal = tip + part * chord

        def at(which, t, goal=goal):
            here = np.where(np.arange(2) == axis, goal, t[..., None])
            value, bar = function(here.reshape(-1, 2))
            return value.reshape(t.shape), bar.reshape(t.shape)

        t = goal[1 - axis] + nodes
        found, bars, sure = _on_line(at, t, at(None, t)[0], grain, HALVINGS)
        apart = np.where(
            sure & (found >= 0.0) & (found <= 1.0), abs(found - goal[1 - axis]), np.inf
        )
        if np.isinf(apart).all() or not 0.0 <= goal[axis] <= 1.0:
            far = part
            continue
        near, best = part, np.argmin(apart)
        points.append(np.where(np.arange(2) == axis, goal, found[best])[None])
        errors.append(bars[best, None])
    return np.concatenate(points), np.concatenate(errors)


def lines(function, square, number, values=None, halvings=HALVINGS):
    """[(positions (m, 2), errors (m))] of the curves function(x) = 0, from border to border or
    round.

    Where only a border of the `square` is asked for, the points there, each alone.

    function(positions (m, 2)) -> (values, error bounds), NaN where there is none; `values`: those
    on the `lattice`, where they are known.
    """
    if square.across is not None and values is None:
        number = (number - 1) * DENSER + 1
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
    """The points on the line through positions x (number, 2) at which the sign of the function changes,
    also between a node and where the function ends before the next one.
    """

    def at(which, t):
        value, bar = function(np.stack([t, np.full(t.shape, square.across)], -1).reshape(-1, 2))
        return value.reshape(t.shape), bar.reshape(t.shape)

    found, error, sure = _on_line(at, x[:, 0], values, square.grain, halvings)
    order = np.argsort(found[sure])
    points = np.stack([found, np.full(found.shape, square.across)], axis=1)[sure][order]
    return list(zip(points[:, None], error[sure][order, None], strict=True))


def _on_line(at, t, values, grain, halvings):
    """(positions, errors, are signs certain?) of the changes of sign between nodes t, also between
    one and where the function ends before the next; at(which, t) as the function of `close_in`.
    """
    known = np.isfinite(values)
    ends = np.flatnonzero(known[1:] != known[:-1])
    inner, outer = ends + known[ends + 1], ends + known[ends]
    last, value = _at_end(
        lambda middle: at(None, middle), t[inner], t[outer], values[inner], TO_GRAIN
    )
    both = np.flatnonzero(known[1:] & known[:-1])
    low, high = np.append(t[both], t[inner]), np.append(t[both + 1], last)
    below, above = np.append(values[both], values[inner]), np.append(values[both + 1], value)
    some = np.flatnonzero((below > 0.0) != (above > 0.0))
    if not some.size:
        return np.zeros(0), np.zeros(0), np.zeros(0, bool)
    return _halved(at, low[some], high[some], grain, halvings)


def _at_end(function, last, beyond, value, halvings):
    """(position, value) of the function just before it ends, between positions `last` (n) or (n, 2),
    where it has these values, and `beyond`, where it has none.
    """
    for _ in range(halvings if len(last) else 0):
        middle = 0.5 * (last + beyond)
        here = function(middle)[0]
        on = np.isfinite(here)
        value = np.where(on, here, value)
        on = on.reshape(-1, *[1] * (last.ndim - 1))
        last, beyond = np.where(on, middle, last), np.where(on, beyond, middle)
    return last, value


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

    x[rows, along], error, sure = _halved(at, low, high, grain, halvings)
    return x, error, sure


def _halved(at, low, high, grain, halvings):
    """(positions, errors, are signs certain?) of zeros between low and high (n); at(which, t) as
    the function of `close_in`.
    """
    rows = np.arange(low.size)
    sign = np.sign(at(rows, low[:, None])[0][:, 0])
    # these begin at the other end, where the function is known
    lost = np.flatnonzero(np.isnan(sign))
    if lost.size:
        low, high = low.copy(), high.copy()
        low[lost], high[lost] = high[lost], low[lost]
        sign[lost] = np.sign(at(lost, low[lost, None])[0][:, 0])
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        same = np.sign(at(rows, middle[:, None])[0][:, 0]) == sign
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    t, width, sure = close_in(at, 0.5 * (low + high), abs(high - low), np.full(low.size, grain))
    return t, width + grain, sure & (width < SURE) & (t >= 0.0) & (t <= 1.0)


def runs(good):
    """Index arrays of the runs of at least two that are good, or of a single point."""
    parts = np.split(np.arange(good.size), 1 + np.flatnonzero(np.diff(good)))
    return [part for part in parts if (part.size > 1 or good.size == 1) and good[part[0]]]
