"""Edges of the tongues of a Hill problem as points on curves: every zero of the four half-period
factors on an axis.

    y1 = 0   even antiperiodic      y2' = 0  odd antiperiodic      y1' = 0  even periodic      y2 = 0  odd periodic

The factors are analytic in every parameter, so on panels short enough each is its Chebyshev series
to rounding, and the eigenvalues of the series' colleague matrix are all its zeros, double ones too.
Each is then bracketed by signs of the factor itself that are certain against its error bound. A row
is complete when, between its edges and at its ends, every factor has the sign that the list
implies, and the rotation number counts the same tongues; else its panels are halved.

Sources: W. Magnus, S. Winkler, Hill's Equation (1966), theorem 1.1; J. P. Boyd, SIAM J. Numer.
Anal. 40 (2002) 1666.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from survey.kernels.hill.answers import STABLE, UNSTABLE
from survey.kernels.math.chebyshev import cosines, nodes, to_coefficients
from survey.scene import Output

FACTORS = ("y1", "dy2", "dy1", "y2")
CLASSES = {"even_antiperiodic": 0, "odd_antiperiodic": 1, "even_periodic": 2, "odd_periodic": 3}
COUNTS = ("rotation_number", "verdict")
OUTPUTS = (
    Output("edge_class", "kind of the solution on the edge of a tongue", flags=CLASSES),
    Output("edge_index", "number of the tongue: twice its rotation number", "n", integer=True),
)
NODES = 24
# Cells of a panel in which zeros are looked for, at first and where these tell too little, and steps of
# Newton's method in one.
CELLS, NEWTON = (32, 192), 6
# The last coefficients of a converged series, relative to its largest.
CONVERGED = 1e-9
# Panels are halved DEEP times; up to DEEPEST about FEW points of a row, where edges accumulate, not
# where F is noise.
DEEP, DEEPEST, FEW = 13, 45, 4
HALVINGS = 3
ROUNDS = 12
TOGETHER = 8  # edges of a row that share its samples and its steps
# So many half widths beside an edge the verdict is certain without double-double arithmetic.
ASIDE = 8


def has_factors(scene):
    """Has the scene factors at T/2? They need an even z and no damping."""
    return getattr(scene, "EVEN", True) and not getattr(scene, "DAMPED", False)


@dataclass
class Edges:
    """Edges by row, ascending: `row`, `position`, its `error`, `kind` (of CLASSES), `index`; and
    which rows are `complete`.
    """

    row: np.ndarray
    position: np.ndarray
    error: np.ndarray
    kind: np.ndarray
    index: np.ndarray
    complete: np.ndarray


def find(solve, rows, low, high, panels=4):
    """All edges between `low` and `high` on each of `rows` rows.

    `solve(row, x, wanted)` gives the outputs `wanted`, with their bounds, at x (m, n), one row
    number for each of m.
    """
    found = []
    left = np.arange(rows)
    complete = np.zeros(rows, np.bool_)
    for attempt in range(HALVINGS):
        edges = _close_in(solve, *_candidates(solve, left, low, high, panels << attempt), low, high)
        sound, index = _complete(solve, left, edges, low, high)
        edges = *edges, index
        last = attempt == HALVINGS - 1
        done = left if last else left[sound]
        complete[left[sound]] = True
        keep = np.isin(edges[0], done)
        found.append([values[keep] for values in edges])
        left = left[~sound]
        if not left.size:
            break
    return joined([Edges(*values, complete) for values in found])


def joined(parts):
    """The Edges of all parts of the same rows, which are complete where each part is."""
    names = ("row", "position", "error", "kind", "index")
    row, position, *others = (
        np.concatenate([getattr(part, name) for part in parts]) for name in names
    )
    order = np.lexsort((position, row))
    complete = np.logical_and.reduce([part.complete for part in parts])
    return Edges(row[order], position[order], *(values[order] for values in others), complete)


def _candidates(solve, rows, low, high, panels):
    """(row, kind, position) of the zeros of the factors' series, the radius of their panels, and the
    slopes there, NaN where none is known.
    """
    ends = np.linspace(low, high, panels + 1)
    row = np.repeat(rows, panels)
    left, right = np.tile(ends[:-1], rows.size), np.tile(ends[1:], rows.size)
    x, matrix = nodes(NODES), to_coefficients(cosines(NODES))
    found = [(np.zeros(0, int), np.zeros(0, int), *np.zeros((3, 0)))]
    for depth in range(DEEPEST):
        middle, radius = 0.5 * (left + right), 0.5 * (right - left)
        out = solve(row, middle[:, None] + radius[:, None] * x, FACTORS)
        series = np.stack([out[name] for name in FACTORS]) @ matrix.T
        noise = np.stack([out[f"{name}_error"] for name in FACTORS]).max(axis=2)
        size, tail = abs(series).max(axis=2), abs(series[:, :, -3:]).max(axis=2)
        rough = ~(tail <= CONVERGED * size + noise).all(axis=0) & (depth < DEEPEST - 1)
        if depth >= DEEP:
            rough &= np.bincount(row[rough], minlength=row.max() + 1)[row] <= FEW
        known = np.isfinite(size).all(axis=0) & ~rough
        kind, panel = np.nonzero((size > noise) & known)
        which, zeros, slope = _all_zeros(series[kind, panel])
        kind, panel = kind[which], panel[which]
        own = radius[panel]
        found.append((row[panel], kind, middle[panel] + own * zeros, own, slope / own))
        row = np.repeat(row[rough], 2)
        left, right = _halves(left[rough], middle[rough]), _halves(middle[rough], right[rough])
        if not row.size:
            break
    return tuple(np.concatenate(values) for values in zip(*found, strict=True))


def _halves(one, other):
    return np.stack([one, other], axis=1).reshape(-1)


def _all_zeros(series, cells=CELLS):
    """(which series, zero, slope there) of all real zeros in [-1, 1] of the series (n, NODES).

    In theta = arccos x a series is seen to have no zero in a cell, or to be monotonic there, from
    its value and slope in the middle and a bound of its second derivative; where that leaves a cell
    open, finer `cells` tell, and at last eigenvalues.
    """
    number, *finer = cells
    k, half = np.arange(NODES), 0.5 * np.pi / number
    edges = np.pi * np.arange(number + 1) / number
    at_edges = series @ np.cos(k[:, None] * edges)
    middle = series @ np.cos(k[:, None] * (edges[:-1] + half))
    slope = abs(series @ (k[:, None] * np.sin(k[:, None] * (edges[:-1] + half))))
    bend = abs(series) @ (k * k)
    none = abs(middle) > half * slope + (0.5 * half * half) * bend[:, None]
    changes = (at_edges[:, 1:] < 0) != (at_edges[:, :-1] < 0)
    clear = (none | (slope > 2 * half * bend[:, None])).all(axis=1)  # it varies by half at most
    which, cell = np.nonzero(changes & ~none & clear[:, None])
    theta, own = edges[cell] + half, np.ascontiguousarray(series[which].T)
    derivative = chebyshev.chebder(own)
    for _ in range(NEWTON):
        x = np.cos(theta)
        value, slope = (chebyshev.chebval(x, of, tensor=False) for of in (own, derivative))
        theta = np.clip(theta + value / (slope * np.sin(theta)), edges[cell], edges[cell + 1])
    found, left = [(which, np.cos(theta), slope)], np.flatnonzero(~clear)
    if finer:
        own, *others = _all_zeros(series[left], finer)
        found.append((left[own], *others))
    for i in left if not finer else ():
        zeros = _zeros(series[i])
        found.append((np.full(zeros.size, i), zeros, np.full(zeros.size, np.nan)))
    return tuple(np.concatenate(values) for values in zip(*found, strict=True))


def _zeros(series):
    """Real zeros in [-1, 1] and a little beyond; a double zero that rounding lifted stands there twice."""
    if abs(series[0]) > abs(series[1:]).sum():
        return np.zeros(0)
    series = series[: np.flatnonzero(abs(series) > 1e-15 * abs(series).max())[-1] + 1]
    zeros = chebyshev.chebroots(series)
    return zeros.real[(abs(zeros.imag) < 1e-6) & (abs(zeros.real) <= 1 + 1e-9)]


def _close_in(solve, row, kind, x, radius, slope, low, high):
    """(row, position, error, kind) of the zeros that change sign and lie on the axis, each once, by
    row and position.
    """

    def function(which, x):
        return of_kind(on_rows(solve, row[which], x, FACTORS), kind[which])

    if not x.size:
        return row, x, radius, kind
    grain = 4 * np.spacing(abs(x))
    width = np.minimum(1e-9 * max(abs(low), abs(high)), 1e-4 * radius)
    f, bar = (values[:, 0] for values in function(np.arange(x.size), x[:, None]))
    with np.errstate(all="ignore"):  # Newton's step by the series' slope
        step, sharp = -f / slope, 3 * bar / abs(slope) + 2 * grain
    near = (abs(step) < width) & (sharp < width)
    x, width, sure = close_in(
        function, np.where(near, x + step, x), np.where(near, sharp, width), grain
    )
    inside = sure & (x >= low) & (x <= high)
    row, kind, x, width = (values[inside] for values in (row, kind, x, width))
    order = np.lexsort((x, kind, row))
    row, kind, x, width = (values[order] for values in (row, kind, x, width))
    same = (np.diff(row) == 0) & (np.diff(kind) == 0) & (np.diff(x) <= width[1:] + width[:-1])
    keep = np.concatenate([[True], ~same]) if x.size else np.zeros(0, bool)
    row, kind, x, width = (values[keep] for values in (row, kind, x, width))
    order = np.lexsort((x, row))
    return tuple(values[order] for values in (row, x, width, kind))


def on_rows(solve, row, x, wanted):
    """solve(row, x, wanted) at x (m, n); up to TOGETHER neighbours of one row are solved as one row of x."""
    order = np.lexsort((x[:, 0], row))
    row, slot = row[order], np.arange(row.size)
    slot = (slot - np.searchsorted(row, row)) % TOGETHER
    line = np.cumsum(slot == 0) - 1
    starts = np.flatnonzero(slot == 0)
    together = np.repeat(x[order[starts], None], slot.max(initial=0) + 1, axis=1)
    together[line, slot] = x[order]
    out = solve(row[starts], together.reshape(starts.size, together[:1].size), wanted)
    back = np.argsort(order)
    return {
        name: values.reshape(together.shape)[line[back], slot[back]] for name, values in out.items()
    }


def of_kind(out, kind):
    """The factor, and its error bound, that belongs to each row's kind."""
    rows = np.arange(kind.size)
    return (np.stack([out[name + end] for name in FACTORS])[kind, rows] for end in ("", "_error"))


def tongue(out, kind):
    """The tongue's number from the rotation number close by its edge, at m points (n, m), odd where
    antiperiodic.
    """
    near = np.rint(2 * np.nan_to_num(out["rotation_number"])).astype(int)
    return near[np.arange(kind.size), np.argmax(near % 2 == (kind < 2)[:, None], axis=1)]


def close_in(function, x, width, grain, widest=np.inf):
    """Sharpen simple zeros near x (n) on lines: (x, half width, certain), with opposite, certain
    signs at its ends.

    `function(which, x)` gives the functions `which` (m indices into the lines) and their error bounds
    at x (m, 3); `grain` (n) is the rounding of x; zeros that are not certain between signs `widest`
    away are given up.
    """
    x, width, sure = x.copy(), width.copy(), np.zeros(x.size, np.bool_)
    left = np.arange(x.size)
    for attempt in range(ROUNDS):
        if not left.size:
            break
        wide = width[left]
        f, bar = function(left, x[left, None] + wide[:, None] * np.array([-1.0, 0.0, 1.0]))
        certain = (abs(f) > bar)[:, ::2].all(axis=1) & (np.sign(f[:, 0]) == -np.sign(f[:, 2]))
        with np.errstate(all="ignore"):
            slope = (f[:, 2] - f[:, 0]) / (2 * wide)
            step = np.nan_to_num(-f[:, 1] / slope)
            bend = abs((f[:, 2] - f[:, 1]) - (f[:, 1] - f[:, 0])) / abs(f[:, 2] - f[:, 0])
            least = 3 * bar[:, 1] / abs(slope) + 2 * grain[left]
            # bars, and Newton's error
            reach = np.minimum(least + 4 * bend * step**2 / wide, 0.5 * wide)
        better = certain & (abs(step) <= wide) & (least < 0.5 * wide) & (attempt < ROUNDS - 1)
        # the function is far from straight between certain signs: the half that holds the zero
        halved = certain & (abs(step) > wide) & (abs(f[:, 1]) > bar[:, 1]) & (attempt < ROUNDS - 1)
        step = np.where(halved, np.copysign(0.5 * wide, f[:, 1] * f[:, 0]), step)
        on = better | halved
        x[left[on]] += step[on]
        reach = np.where(halved, 0.5 * wide, reach)
        width[left] = np.where(on, reach, np.where(certain, wide, 3 * wide))
        sure[left] = certain & ~on
        left = left[(on | ~certain) & (width[left] <= widest)]
    return x, width, sure


def _complete(solve, rows, edges, low, high):
    """Which rows are complete: the factors' signs and the rotation number are as listed, at the
    ends and between. And the numbers of the tongues of the edges, from the bands beside them.
    """
    row, x, width, kind = edges
    row_at = np.searchsorted(rows, row)
    number = np.bincount(row_at, minlength=rows.size)
    own = np.arange(row.size) - np.searchsorted(row, row)
    # of each row both ends, the middles between them and its edges, and its upper end again
    listed = np.full((rows.size, number.max(initial=0) + 2), float(high))
    listed[:, 0], listed[row_at, own + 1] = low, x
    points = np.pad(
        0.5 * (listed[:, :-1] + listed[:, 1:]), ((0, 0), (1, 1)), constant_values=(low, high)
    )
    out = solve(rows, points, (*FACTORS, *COUNTS))
    known = np.arange(points.shape[1]) < number[:, None] + 3
    last, close = number + 2, np.flatnonzero(own > 0)
    # between edges closer than their errors nothing is known, nor at an end that is an edge
    known[row_at[close], own[close] + 1] = (
        np.diff(x)[close - 1] > (width[1:] + width[:-1])[close - 1]
    )
    for end, at in ((low, np.zeros_like(last)), (high, last)):
        on = row_at[abs(x - end) <= width]
        known[on, at[on]] = False
    sound = np.isfinite([out[name] for name in FACTORS]).all(axis=(0, 2))
    signs = np.stack(
        [np.where(known & (abs(out[n]) > out[f"{n}_error"]), np.sign(out[n]), 0) for n in FACTORS]
    )
    turns = np.zeros(signs.shape, int)
    turns[kind, row_at, own + 2] = 1
    # the factors change sign at their edges alone
    straight = signs * np.where(np.cumsum(turns, axis=2) % 2, -1, 1)
    sound &= ((straight >= 0).all(axis=2) | (straight <= 0).all(axis=2)).all(axis=0)
    # every edge lies between its tongue n and a band beside it, at the ends of the row too
    band = np.where(known, _band(out), np.nan)
    before, after = (band[row_at, own + side] for side in (1, 2))
    of_before, of_after = _beside(before, kind), _beside(after, kind)
    wrong = (before == after) | (abs(of_before - of_after) > 0)
    wrong |= (np.isnan(of_before) != np.isnan(before)) | (np.isnan(of_after) != np.isnan(after))
    index = np.where(np.isnan(of_before), of_after, of_before)
    unknown = np.flatnonzero(np.isnan(index))
    if unknown.size:
        sides = x[unknown, None] + ASIDE * width[unknown, None] * np.array([-1.0, 1.0])
        index[unknown] = tongue(on_rows(solve, row[unknown], sides, COUNTS), kind[unknown])
    sound[row_at[wrong]] = False
    each = np.arange(rows.size)
    sound &= ~(abs(band[:, 0] - band[:, 1]) > 0)
    sound &= ~(abs(band[each, last] - band[each, last - 1]) > 0)
    return sound, index.astype(int)


def _beside(band, kind):
    """The number of the tongue, odd where antiperiodic, that an edge of a band or gap bounds (see
    `_band`); NaN where there is none, or the band is not known.
    """
    low, odd = np.floor(band), (kind < 2).astype(float)
    fits = low % 2 == odd
    return np.where(band == low, np.where(fits, low, np.nan), np.where(fits, low, low + 1))


def _band(out):
    """2 theta / 2 pi to the half: n in the gap of tongue n, n + 1/2 in the band above it; NaN where
    it is not known.
    """
    turns, bar = 2 * out["rotation_number"], 2 * out["rotation_number_error"]
    nearest = np.rint(turns)
    inside = (out["verdict"] == STABLE) & (abs(turns - nearest) > bar)
    return np.where(
        out["verdict"] == UNSTABLE, nearest, np.where(inside, np.floor(turns) + 0.5, np.nan)
    )
