"""Edges along one axis that no function of `bifurcations` shows, from numbers that are counted: of
the multipliers outside the unit circle and, of symplectic systems, the Maslov index.

Where two multipliers, or two pairs, pass the circle together, as those of two equal oscillators do,
the functions touch zero without a change of sign; so they do not at an edge that they pass twice
between two points of the lattice. Between points at which a number is certain, on the lattice and
beside the edges found, and these do not explain its change, the axis is halved until the number is
certain no nearer: an edge lies in what is left.
"""

import numpy as np

from survey.measures.floquet import row_count
from survey.measures.floquet.monodromy import Matrices
from survey.measures.floquet.multipliers import (
    COLLISION,
    MINUS_ONE,
    NEIMARK_SACKER,
    PLUS_ONE,
    UNDECIDED,
    Discs,
    krein,
)
from survey.measures.segments import UNKNOWN, along, cut, halves

HALVINGS = 60
SAME = 1e-9  # of the axis: edges of one kind so near may be one that is found twice
# how far beside an edge the number is asked for, in SAME or in the edge's error; how that is widened
ASIDE, WIDER, WIDENED = 4.0, 16.0, 5
REAL = 1e-3  # rad: arguments of multipliers that count as real


def edges(count, kinds_of, values, ticks, found, grain):
    """[(kind, position, its error)] of edges that are missing among those `found` [(kind, position,
    its error)], and along how many parts of the axis the number is still unexplained.

    `count(positions (N))` is the number (N), or UNKNOWN, `values` that at the `ticks`,
    `kinds_of(positions)` the kind of edges, or UNDECIDED, where there is none; no position is known
    better than to within `grain`.
    """
    ticks, values = _beside(count, values, ticks, found)
    found = [one[:2] for one in found]
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


def crossings(order, values, ticks, found):
    """Positions between two points at which the `order` of Krein signs differs, `values` that at the
    `ticks`, and no edge was `found`: where multipliers of unlike signs pass each other they leave
    the circle, as a rule, and a narrow tongue lies there.
    """
    known = np.flatnonzero(values != UNKNOWN)
    ends = np.stack([known[:-1], known[1:]], axis=1)
    edges = np.sort([x for _, x, _ in found])
    met = np.diff(np.searchsorted(edges, ticks[ends]))[:, 0] > 0
    ends = ends[~met & (np.diff(values[ends])[:, 0] != 0)]
    return _halved(order, ticks[ends], values[ends], SAME)[2]


def order(M, E):
    """The order of the Krein signs along the upper half of the unit circle, as an integer (N), of
    matrices (N, n, n) known to within E; UNKNOWN where not all multipliers are certainly simple and
    on it.
    """
    discs = Discs(Matrices.plain(M, E))
    signs, m = krein(discs), M.shape[1] // 2
    upper = discs.centre.imag > discs.bars
    found = np.full(len(M), UNKNOWN)
    some = np.flatnonzero((signs != 0).all(axis=1) & (upper.sum(axis=1) == m))
    angle = np.where(upper, np.angle(discs.centre), np.inf)[some]
    ranked = np.take_along_axis(signs[some], angle.argsort(axis=1)[:, :m], axis=1)
    found[some] = ranked @ (2 * np.arange(m) - m + 1)
    return found


def _beside(count, values, ticks, found):
    """The ticks and the numbers there, with those on both sides of the edges: a change across two
    edges could be explained by one of them and another that is missing.
    """
    position = np.array([x for _, x, _ in found])
    error = np.array([bar for *_, bar in found])
    width = np.maximum(ASIDE * SAME, ASIDE * error)
    at, number = [ticks], [values]
    left = np.arange(2 * len(found))  # the lower sides, then the upper ones
    for _ in range(WIDENED):
        edge, side = left % max(1, len(found)), np.where(left < len(found), -1.0, 1.0)
        x = position[edge] + side * width[edge]
        gap = abs(x[:, None] - position)
        some = (x > 0.0) & (x < 1.0) & (gap.min(axis=1, initial=np.inf) >= 0.5 * width[edge])
        left, x = left[some], x[some]
        if not left.size:
            break
        there = count(x)
        at.append(x)
        number.append(there)
        left = left[there == UNKNOWN]
        width *= WIDER
    at, first = np.unique(np.concatenate(at), return_index=True)
    return at, np.concatenate(number)[first]


def _lost(values, ticks, found):
    """The segments (first, last) whose change the edges do not explain."""
    explained = along(values, ticks, found, row_count.WEIGHTS, near=SAME)
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
    """How multipliers of matrices (N, n, n), known to reach the unit circle there, pass it (N);
    UNDECIDED where a matrix is not finite, as at a pole, past which they jump.
    """
    found = np.full(len(M), UNDECIDED)
    finite = np.flatnonzero(np.isfinite(M).all(axis=(1, 2)))
    multipliers = np.linalg.eigvals(M[finite])
    angle = abs(np.angle(multipliers))
    if structure == "none":
        near = abs(abs(multipliers) - 1.0).argmin(axis=1)[:, None]
        angle, pair = np.take_along_axis(angle, near, axis=1), NEIMARK_SACKER
    else:  # all may be on the circle: the one at 1 or -1 passes, else two that have met elsewhere
        angle = np.where(abs(abs(multipliers) - 1.0) < REAL, angle, 0.5 * np.pi)
        pair = COLLISION
    plus, minus = angle.min(axis=1), np.pi - angle.max(axis=1)
    kind = np.where(plus < minus, PLUS_ONE, MINUS_ONE)
    found[finite] = np.where(np.minimum(plus, minus) < REAL, kind, pair)
    return found
