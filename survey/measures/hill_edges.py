"""Edges of the tongues of a Hill problem as points on curves: every zero of the four half-period factors on an axis.

    y1 = 0   even antiperiodic      y2' = 0  odd antiperiodic      y1' = 0  even periodic      y2 = 0  odd periodic

The factors are analytic in every parameter, so on panels short enough each is its Chebyshev series to rounding, and
the eigenvalues of the series' colleague matrix are all its zeros, double ones too. Each is then closed in by signs of
the factor itself, certain against its bar. A row is complete when, between its edges, every factor has the sign that
the list says; else its panels are halved.

Sources: W. Magnus, S. Winkler, Hill's Equation (1966), theorem 1.1; J. P. Boyd, SIAM J. Numer. Anal. 40 (2002) 1666.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from survey.scene import Output

FACTORS = ("y1", "dy2", "dy1", "y2")
CLASSES = {"even_antiperiodic": 0, "odd_antiperiodic": 1, "even_periodic": 2, "odd_periodic": 3}
NEEDS = (*FACTORS, "rotation_number", "verdict")
OUTPUTS = (
    Output("edge_class", "kind of the solution on the edge of a tongue", flags=CLASSES),
    Output("edge_index", "number of the tongue: twice its rotation number", "n", integer=True),
)
NODES = 24
# The last coefficients of a converged series, relative to its largest.
CONVERGED = 1e-9
DEEPEST = 14
HALVINGS = 3
ROUNDS = 6


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

    `solve(row, x)` gives the outputs NEEDS, with the bars of the factors, at x (m, n), one row number for each of m.
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
    row, position, error, kind, index = (np.concatenate(values) for values in zip(*found, strict=True))
    order = np.lexsort((position, row))
    return Edges(row[order], position[order], error[order], kind[order], index[order], complete)


def _candidates(solve, rows, low, high, panels):
    """(row, kind, position) of the zeros of the factors' series."""
    ends = np.linspace(low, high, panels + 1)
    row = np.repeat(rows, panels)
    left, right = np.tile(ends[:-1], rows.size), np.tile(ends[1:], rows.size)
    nodes = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    matrix = 2 / NODES * np.cos(np.pi * np.outer(np.arange(NODES), np.arange(NODES) + 0.5) / NODES)
    matrix[0] /= 2
    found = [(np.zeros(0, int), np.zeros(0, int), np.zeros(0))]
    for depth in range(DEEPEST):
        middle, radius = 0.5 * (left + right), 0.5 * (right - left)
        out = solve(row, middle[:, None] + radius[:, None] * nodes)
        series = np.stack([out[name] for name in FACTORS]) @ matrix.T
        size, tail = abs(series).max(axis=2), abs(series[:, :, -3:]).max(axis=2)
        rough = ~(tail <= CONVERGED * size).all(axis=0) & (depth < DEEPEST - 1)
        for panel in np.flatnonzero(~rough & np.isfinite(size).all(axis=0)):
            for kind in range(len(FACTORS)):
                zeros = _zeros(series[kind, panel])
                number = np.full(zeros.size, 1)
                found.append((number * row[panel], number * kind, middle[panel] + radius[panel] * zeros))
        row = np.repeat(row[rough], 2)
        left, right = _halves(left[rough], middle[rough]), _halves(middle[rough], right[rough])
        if not row.size:
            break
    return tuple(np.concatenate(values) for values in zip(*found, strict=True))


def _halves(one, other):
    return np.stack([one, other], axis=1).reshape(-1)


def _zeros(series):
    """Real zeros in [-1, 1], a little beyond its ends, and of a double zero that rounding lifted, its place twice."""
    if abs(series[0]) > abs(series[1:]).sum():
        return np.zeros(0)
    series = series[: np.flatnonzero(abs(series) > 1e-15 * abs(series).max())[-1] + 1]
    zeros = chebyshev.chebroots(series)
    return zeros.real[(abs(zeros.imag) < 1e-6) & (abs(zeros.real) <= 1 + 1e-9)]


def _close_in(solve, row, kind, x, low, high):
    """Sharpen each zero, with a half width at whose ends the factor has opposite, certain signs; drop doubles."""
    scale = np.maximum(abs(low), abs(high))
    width = np.full(x.size, 1e-9 * scale)
    sure = np.zeros(x.size, np.bool_)
    index = np.zeros(x.size, int)
    names = np.arange(x.size)
    for _ in range(ROUNDS):
        if not x.size:
            break
        sides = x[:, None] + width[:, None] * np.array([-1.0, 0.0, 1.0])
        out = solve(row, sides)
        f = np.stack([out[name] for name in FACTORS])[kind, names]
        bar = np.stack([out[f"{name}_error"] for name in FACTORS])[kind, names]
        certain = (abs(f[:, 0]) > bar[:, 0]) & (abs(f[:, 2]) > bar[:, 2]) & (np.sign(f[:, 0]) == -np.sign(f[:, 2]))
        slope = (f[:, 2] - f[:, 0]) / (sides[:, 2] - sides[:, 0])
        with np.errstate(all="ignore"):
            step = np.where(slope != 0, -f[:, 1] / slope, 0.0)
            reach = 3 * bar[:, 1] / abs(slope) + 4 * np.spacing(abs(x))
        sure |= certain
        index = np.where(certain | ~sure, np.rint(2 * out["rotation_number"][:, 1]).astype(int), index)
        best = certain & (abs(step) <= width)
        # inside a bracket: go to the secant's zero and close in; outside: widen
        narrower = np.maximum(reach, np.minimum(0.1 * width, 10 * abs(step)))
        moved = best & (narrower < 0.5 * width)
        x = np.where(moved, x + step, x)
        width = np.where(moved, np.maximum(narrower, 2 * np.spacing(abs(x))), np.where(certain, width, 3 * width))
    final = solve(row, x[:, None] + width[:, None] * np.array([-1.0, 1.0])) if x.size else None
    if final is not None:
        f = np.stack([final[name] for name in FACTORS])[kind, names]
        bar = np.stack([final[f"{name}_error"] for name in FACTORS])[kind, names]
        sure = (abs(f) > bar).all(axis=1) & (np.sign(f[:, 0]) == -np.sign(f[:, 1]))
    inside = sure & (x >= low) & (x <= high)
    row, kind, x, width, index = (values[inside] for values in (row, kind, x, width, index))
    order = np.lexsort((x, kind, row))
    row, kind, x, width, index = (values[order] for values in (row, kind, x, width, index))
    same = (np.diff(row) == 0) & (np.diff(kind) == 0) & (np.diff(x) <= width[1:] + width[:-1])
    keep = np.concatenate([[True], ~same]) if x.size else np.zeros(0, bool)
    return row[keep], x[keep], width[keep], kind[keep], index[keep]


def _complete(solve, rows, edges, low, high):
    """Which rows are complete: between neighbouring edges every factor has the sign that the list says."""
    sound = np.ones(rows.size, np.bool_)
    by_row = {r: np.flatnonzero(edges[0] == r) for r in rows}
    most = max((own.size for own in by_row.values()), default=0) + 1
    places = np.empty((rows.size, most))
    for i, r in enumerate(rows):
        x = np.sort(edges[1][by_row[r]])
        between = 0.5 * (np.concatenate([[low], x]) + np.concatenate([x, [high]]))
        places[i] = np.concatenate([between, np.full(most - between.size, between[-1])])
    out = solve(rows, places)
    signs = np.stack([np.where(abs(out[n]) > out[f"{n}_error"], np.sign(out[n]), 0) for n in FACTORS])
    for i, r in enumerate(rows):
        own = by_row[r][np.argsort(edges[1][by_row[r]])]
        expected = signs[:, i, 0]
        for at, edge in enumerate(own, 1):
            expected = np.where(np.arange(4) == edges[3][edge], -expected, expected)
            told = signs[:, i, at]
            if at < own.size and np.diff(edges[1][own[at - 1 : at + 1]]) <= edges[2][own[at - 1 : at + 1]].sum():
                told = 0 * told  # between edges closer than their errors nothing is told
            known = (told != 0) & (expected != 0)
            sound[i] &= bool((told == expected)[known].all())
            expected = np.where(told != 0, told, expected)
    return sound
