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
from survey.measures.segments import UNKNOWN, along

SHARES = (0.5, 0.31, 0.69)  # of a part: where it is cut, the first at which the number is known
HALVINGS = 60
REAL = 1e-3  # rad: arguments of multipliers that count as real


def edges(count, kind_of, values, ticks, found, grain):
    """[(kind, position, its error)] of edges that are missing among those `found` [(kind,
    position)], and along how many parts of the axis the number is still unexplained.

    `count(position)` is the number, or UNKNOWN, `values` that at the `ticks`, `kind_of(position)`
    the kind of an edge, or UNDECIDED, where there is none; no position is known better than to within `grain`.
    """
    missing = []
    passed = []
    for first, last in _lost(values, ticks, found):
        parts = [(ticks[first], values[first], ticks[last], values[last])]
        while parts:
            low, below, high, above = parts.pop()
            at, value = _cut(count, low, high) if high - low > grain else (low, UNKNOWN)
            if value != UNKNOWN:
                parts += [(low, below, at, value)] if value != below else []
                parts += [(at, value, high, above)] if value != above else []
                continue
            low, high = _shrunk(count, below, low, at), _shrunk(count, above, high, at)
            middle = 0.5 * (low + high)
            if (kind := kind_of(middle)) == UNDECIDED:
                continue
            missing.append((kind, middle, 0.5 * (high - low) + grain))
            passed += [missing[-1][:2]] * max(abs(above - below), 2)  # perhaps together
    everything = found + passed
    return missing, len(_lost(values, ticks, everything))


def _lost(values, ticks, found):
    """The segments (first, last) whose change the edges do not explain."""
    explained = along(values, ticks, found, row_count.WEIGHTS)
    return [segment for segment, good in explained.items() if not good]


def _cut(count, low, high):
    """(a position between, the number there), known at one of SHARES if possible."""
    for share in SHARES:
        at = low + share * (high - low)
        if (value := count(at)) != UNKNOWN:
            return at, value
    return low + SHARES[0] * (high - low), UNKNOWN


def _shrunk(count, value, known, unknown):
    """The position nearest to `unknown`, from `known` on, up to which the number has this value."""
    for _ in range(HALVINGS):
        middle = 0.5 * (known + unknown)
        if middle in (known, unknown):
            break
        if count(middle) == value:
            known = middle
        else:
            unknown = middle
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
