"""Edges along one axis that no function of `bifurcations` shows, from numbers that are counted: of
the multipliers outside the unit circle and, of symplectic systems, the Maslov index.

Where two multipliers, or two pairs, pass the circle together, as those of two equal oscillators do,
the functions touch zero without a change of sign; so they do not at an edge that they pass twice
between two points of the lattice. Between points at which a number is certain and the edges found
do not explain its change, the axis is halved until the number is certain no nearer: an edge lies in
what is left.
"""

import numpy as np

from survey.measures.floquet import row_count
from survey.measures.floquet.multipliers import (
    COLLISION,
    MINUS_ONE,
    NEIMARK_SACKER,
    PLUS_ONE,
    UNDECIDED,
)
from survey.measures.segments import UNKNOWN, along, cut, halves

HALVINGS = 60
REAL = 1e-3  # rad: arguments of multipliers that count as real


def edges(count, kinds_of, values, ticks, found, grain):
    """[(kind, position, its error)] of edges that are missing among those `found` [(kind,
    position)], and along how many parts of the axis the number is still unexplained.

    `count(positions (N))` is the number (N), or UNKNOWN, `values` that at the `ticks`,
    `kinds_of(positions)` the kind of edges, or UNDECIDED, where there is none; no position is known
    better than to within `grain`.
    """
    lost = np.array(_lost(values, ticks, found), int).reshape(-1, 2)
    ends, numbers, between = _halved(count, ticks[lost], values[lost], grain)
    order = np.argsort(between)
    ends, numbers, between = ends[order], numbers[order], between[order]
    sides = [_shrunk(count, numbers[:, side], ends[:, side], between) for side in (0, 1)]
    middle, half = 0.5 * (sides[0] + sides[1]), 0.5 * (sides[1] - sides[0])
    kinds = kinds_of(middle) if middle.size else np.zeros(0, int)
    # two at least: perhaps they pass together
    copies = np.maximum(abs(np.diff(numbers)[:, 0]), 2)
    known = np.flatnonzero(kinds != UNDECIDED)
    missing = [(int(kinds[i]), float(middle[i]), float(half[i] + grain)) for i in known]
    passed = [missing[k][:2] for k, i in enumerate(known) for _ in range(copies[i])]
    return missing, len(_lost(values, ticks, found + passed))


def _lost(values, ticks, found):
    """The segments (first, last) whose change the edges do not explain."""
    explained = along(values, ticks, found, row_count.WEIGHTS)
    return [segment for segment, good in explained.items() if not good]


def _halved(count, ends, numbers, grain):
    """(ends (m, 2), the numbers there (m, 2), a position in between (m)) of parts in which the number
    is nowhere known, halved from parts along which it changes.
    """
    done = []
    while len(ends):
        between, number = ends.mean(axis=1), np.full(len(ends), UNKNOWN)
        wide = np.flatnonzero(np.diff(ends)[:, 0] > grain)
        between[wide], number[wide] = cut(lambda _some, at: count(at), ends[wide])
        known = number != UNKNOWN
        done.append((ends[~known], numbers[~known], between[~known]))
        lower, upper = halves(ends[known], numbers[known], between[known], number[known])
        ends, numbers = (np.concatenate([lower[k], upper[k]]) for k in (0, 1))
    if not done:
        return np.zeros((0, 2)), np.zeros((0, 2), int), np.zeros(0)
    return tuple(np.concatenate(list(part)) for part in zip(*done, strict=True))


def _shrunk(count, numbers, known, unknown):
    """The positions nearest to `unknown` (m), from `known` (m) on, up to which the number is that of
    `numbers` (m).
    """
    known, unknown = known.copy(), unknown.copy()
    for _ in range(HALVINGS):
        middle = 0.5 * (known + unknown)
        some = np.flatnonzero((middle != known) & (middle != unknown))
        if not some.size:
            break
        same = count(middle[some]) == numbers[some]
        known[some[same]] = middle[some[same]]
        unknown[some[~same]] = middle[some[~same]]
    return known


def kinds(M, structure):
    """How the multipliers nearest to the unit circle, of matrices (N, n, n), pass it (N); UNDECIDED
    where a matrix is not finite, as at a pole, past which they jump.
    """
    found = np.full(len(M), UNDECIDED)
    finite = np.flatnonzero(np.isfinite(M).all(axis=(1, 2)))
    multipliers = np.linalg.eigvals(M[finite])
    nearest = abs(abs(multipliers) - 1.0).argmin(axis=1)
    angle = abs(np.angle(multipliers[np.arange(finite.size), nearest]))
    pair = NEIMARK_SACKER if structure == "none" else COLLISION
    found[finite] = np.where(
        angle < REAL, PLUS_ONE, np.where(angle > np.pi - REAL, MINUS_ONE, pair)
    )
    return found
