"""Edges of the tongues of a Hill problem as points on curves: every zero of the four half-period factors on an axis.

    y1 = 0   even antiperiodic      y2' = 0  odd antiperiodic      y1' = 0  even periodic      y2 = 0  odd periodic

The factors are analytic in every parameter, so on panels short enough each is its Chebyshev series to rounding, and
the eigenvalues of the series' colleague matrix are all its zeros, double ones too. Each is then bracketed by signs of
the factor itself that are certain against its error bound. A row is complete when, between its edges and at its ends,
every factor has the sign that the list implies, and the rotation number counts the same tongues; else its panels are
halved.

Sources: W. Magnus, S. Winkler, Hill's Equation (1966), theorem 1.1; J. P. Boyd, SIAM J. Numer. Anal. 40 (2002) 1666.
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
# Cells of a panel in which zeros are looked for, and steps of Newton's method in one.
CELLS, NEWTON = 192, 5
# The last coefficients of a converged series, relative to its largest.
CONVERGED = 1e-9
# Panels are halved DEEP times; up to DEEPEST about FEW points of a row, where edges accumulate, not where F is noise.
DEEP, DEEPEST, FEW = 13, 45, 4
HALVINGS = 3
ROUNDS = 12
# So many half widths beside an edge the verdict is certain without double-double arithmetic.
ASIDE = 8


@dataclass
class Edges:
    """Edges by row, ascending: `row`, `position`, its `error`, `kind` (of CLASSES), `index`; and who is `complete`."""

    row: np.ndarray
    position: np.ndarray
    error: np.ndarray
    kind: np.ndarray
    index: np.ndarray
    complete: np.ndarray


def find(solve, rows, low, high, panels=4):
    """All edges between `low` and `high` on each of `rows` rows.

    `solve(row, x, wanted)` gives the outputs `wanted`, with their bounds, at x (m, n), one row number for each of m.
    """
    found, left = [], np.arange(rows)
    complete = np.zeros(rows, np.bool_)
    for attempt in range(HALVINGS):
        edges = _close_in(solve, *_candidates(solve, left, low, high, panels << attempt), low, high)
        sound = _complete(solve, left, edges, low, high)
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
    row, position, *others = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
    order = np.lexsort((position, row))
    complete = np.logical_and.reduce([part.complete for part in parts])
    return Edges(row[order], position[order], *(values[order] for values in others), complete)


def _candidates(solve, rows, low, high, panels):
    """(row, kind, position) of the zeros of the factors' series, and the radius of their panels."""
    ends = np.linspace(low, high, panels + 1)
    row = np.repeat(rows, panels)
    left, right = np.tile(ends[:-1], rows.size), np.tile(ends[1:], rows.size)
    x, matrix = nodes(NODES), to_coefficients(cosines(NODES))
    found = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0), np.zeros(0))]
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
        which, zeros = _all_zeros(series[kind, panel])
        kind, panel = kind[which], panel[which]
        found.append((row[panel], kind, middle[panel] + radius[panel] * zeros, radius[panel]))
        row = np.repeat(row[rough], 2)
        left, right = _halves(left[rough], middle[rough]), _halves(middle[rough], right[rough])
        if not row.size:
            break
    return tuple(np.concatenate(values) for values in zip(*found, strict=True))


def _halves(one, other):
    return np.stack([one, other], axis=1).reshape(-1)


def _all_zeros(series):
    """(which series, zero) of all real zeros in [-1, 1] of the series (n, NODES).

    In theta = arccos x a series is seen to have no zero in a cell, or to be monotonic there, from its value and slope
    in the middle and a bound of its second derivative; where that leaves a cell open, eigenvalues tell.
    """
    k, half = np.arange(NODES), 0.5 * np.pi / CELLS
    edges = np.pi * np.arange(CELLS + 1) / CELLS
    at_edges = series @ np.cos(k[:, None] * edges)
    middle = series @ np.cos(k[:, None] * (edges[:-1] + half))
    slope, bend = abs(series @ (k[:, None] * np.sin(k[:, None] * (edges[:-1] + half)))), abs(series) @ (k * k)
    none = abs(middle) > half * slope + (0.5 * half * half) * bend[:, None]
    changes = (at_edges[:, 1:] < 0) != (at_edges[:, :-1] < 0)
    clear = (none | (slope > half * bend[:, None])).all(axis=1)
    which, cell = np.nonzero(changes & ~none & clear[:, None])
    theta, own = edges[cell] + half, series[which]
    for _ in range(NEWTON):
        angles = k * theta[:, None]
        step = (own * np.cos(angles)).sum(axis=1) / (own * k * np.sin(angles)).sum(axis=1)
        theta = np.clip(theta + step, edges[cell], edges[cell + 1])
    found = [(which, np.cos(theta))]
    for i in np.flatnonzero(~clear):
        zeros = _zeros(series[i])
        found.append((np.full(zeros.size, i), zeros))
    which, zeros = (np.concatenate(values) for values in zip(*found, strict=True))
    return which, zeros


def _zeros(series):
    """Real zeros in [-1, 1] and a little beyond; a double zero that rounding lifted stands there twice."""
    if abs(series[0]) > abs(series[1:]).sum():
        return np.zeros(0)
    series = series[: np.flatnonzero(abs(series) > 1e-15 * abs(series).max())[-1] + 1]
    zeros = chebyshev.chebroots(series)
    return zeros.real[(abs(zeros.imag) < 1e-6) & (abs(zeros.real) <= 1 + 1e-9)]


def _close_in(solve, row, kind, x, radius, low, high):
    """(row, position, error, kind, index) of the zeros that change sign and lie on the axis, each once."""

    def function(who, x):
        return of_kind(solve(row[who], x, FACTORS), kind[who])

    scale = max(abs(low), abs(high))
    x, width, sure = close_in(function, x, np.minimum(1e-9 * scale, 1e-4 * radius), 4 * np.spacing(abs(x)))
    inside = sure & (x >= low) & (x <= high)
    row, kind, x, width = (values[inside] for values in (row, kind, x, width))
    order = np.lexsort((x, kind, row))
    row, kind, x, width = (values[order] for values in (row, kind, x, width))
    same = (np.diff(row) == 0) & (np.diff(kind) == 0) & (np.diff(x) <= width[1:] + width[:-1])
    keep = np.concatenate([[True], ~same]) if x.size else np.zeros(0, bool)
    row, kind, x, width = (values[keep] for values in (row, kind, x, width))
    sides = x[:, None] + ASIDE * width[:, None] * np.array([-1.0, 1.0])
    index = tongue(solve(row, sides, COUNTS), kind) if x.size else np.zeros(0, int)
    return row, x, width, kind, index


def of_kind(out, kind):
    """The factor, and its error bound, that belongs to each row's kind."""
    rows = np.arange(kind.size)
    return (np.stack([out[name + end] for name in FACTORS])[kind, rows] for end in ("", "_error"))


def tongue(out, kind):
    """The tongue's number from the rotation number close by its edge, at m points (n, m), odd where antiperiodic."""
    near = np.rint(2 * np.nan_to_num(out["rotation_number"])).astype(int)
    return near[np.arange(kind.size), np.argmax(near % 2 == (kind < 2)[:, None], axis=1)]


def close_in(function, x, width, grain, widest=np.inf):
    """Sharpen simple zeros near x (n) on lines: (x, half width, certain), with opposite, certain signs at its ends.

    `function(who, x)` gives the functions `who` (m indices into the lines) and their error bounds at x (m, 3);
    `grain` (n) is the rounding of x; zeros that are not certain between signs `widest` away are given up.
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
            reach = np.minimum(least + 4 * bend * step**2 / wide, 0.5 * wide)  # bars, and Newton's error
        better = certain & (abs(step) <= wide) & (least < 0.5 * wide) & (attempt < ROUNDS - 1)
        x[left[better]] += step[better]
        width[left] = np.where(better, reach, np.where(certain, wide, 3 * wide))
        sure[left] = certain & ~better
        left = left[(better | ~certain) & (width[left] <= widest)]
    return x, width, sure


def _complete(solve, rows, edges, low, high):
    """Which rows are complete: the factors' signs and the rotation number are as listed, at the ends and between."""
    order = np.lexsort((edges[1], edges[0]))
    row, x, width, kind, index = (values[order] for values in edges)
    own = [np.flatnonzero(row == r) for r in rows]
    most = max((mine.size for mine in own), default=0) + 3
    points = np.full((rows.size, most), float(high))
    for i, mine in enumerate(own):
        points[i, 0] = low
        points[i, 1 : mine.size + 2] = 0.5 * (np.concatenate([[low], x[mine]]) + np.concatenate([x[mine], [high]]))
    out = solve(rows, points, (*FACTORS, *COUNTS))
    signs = np.stack([np.where(abs(out[n]) > out[f"{n}_error"], np.sign(out[n]), 0) for n in FACTORS])
    band = _band(out)
    sound = np.isfinite([out[name] for name in FACTORS]).all(axis=(0, 2))
    for i, mine in enumerate(own):
        # at both ends and between edges; between edges closer than their errors nothing is known
        known = np.ones(mine.size + 3, np.bool_)
        known[2:-2] = np.diff(x[mine]) > width[mine][1:] + width[mine][:-1]
        known[[0, -1]] = [(abs(x[mine] - end) > width[mine]).all() for end in (low, high)]
        seen = np.where(known, signs[:, i, : mine.size + 3], 0)
        sound[i] &= _signs_agree(seen, kind[mine])
        sound[i] &= _rotation_agrees(np.where(known, band[i, : mine.size + 3], np.nan), index[mine])
    return sound


def _signs_agree(seen, kind):
    """Do the signs (4, m + 3; 0 unknown) of the factors at the ends and between m edges change at those alone?"""
    turns = np.cumsum(np.pad(kind == np.arange(len(FACTORS))[:, None], ((0, 0), (2, 1))), axis=1)
    straight = seen * np.where(turns % 2, -1, 1)
    return bool(((straight >= 0).all(axis=1) | (straight <= 0).all(axis=1)).all())


def _band(out):
    """2 theta / 2 pi to the half: n in the gap of tongue n, n + 1/2 in the band above it; NaN where it is not known."""
    turns, bar = 2 * out["rotation_number"], 2 * out["rotation_number_error"]
    nearest = np.rint(turns)
    inside = (out["verdict"] == STABLE) & (abs(turns - nearest) > bar)
    return np.where(out["verdict"] == UNSTABLE, nearest, np.where(inside, np.floor(turns) + 0.5, np.nan))


def _rotation_agrees(band, index):
    """Does every edge lie between its tongue n and a band beside it, as `band` (m + 3), at the ends too, says?"""
    before, after = abs(band[1:-2] - index), abs(band[2:-1] - index)
    wrong = (before > 0.5) | (after > 0.5) | (before == after)
    return not wrong.any() and not (abs(band[[0, -2]] - band[[1, -1]]) > 0).any()
