"""Do the curves that are found explain how many multipliers are outside the unit circle, all over the map?

Along the rows and columns of the lattice that was searched, this number is certain at most points. Between two of them
it changes by what passes the circle: a real multiplier counts for 1, a complex pair for 2, and of a symplectic or
reversible system a pair at 1 or -1 for 1, and two pairs that collide for 2. A segment whose curves do not add up to the
change, with any signs, has lost one. A curve that it meets next to its ends may belong to the segment beside it, and
two that it meets next to one another may be one that is drawn twice: these may count or not. Curves that end inside the
map, as between the edges of a narrow tongue, or that cancel between two points of the lattice, do not show here.
"""

from itertools import pairwise

import numpy as np

from survey.measures.floquet import monodromy
from survey.measures.floquet.multipliers import COLLISION, NEIMARK_SACKER, Discs

WEIGHTS = {NEIMARK_SACKER: 2, COLLISION: 2}  # of others 1
NEAR = 1e-3  # of the map: what chords of curves may be off
CHUNK = 4096  # matrices whose discs are made together


def outside(M, E, structure):
    """The number (N) of multipliers that are certainly outside the unit circle; -1 where others may be."""
    found = np.full(len(M), -1)
    for i in range(0, len(M), CHUNK):
        discs = Discs(monodromy.Matrices.plain(M[i : i + CHUNK], E[i : i + CHUNK]))
        low, high = discs.moduli
        beyond = np.where(discs.together, low[:, None, :], np.inf).min(axis=2) > 1.0
        within = np.where(discs.together, high[:, None, :], 0.0).max(axis=2) < 1.0
        if structure != "none":
            within |= discs.on_circle
        known = (beyond | within).all(axis=1)
        found[i : i + CHUNK] = np.where(known, beyond.sum(axis=1), -1)
    return found


def unexplained(counts, curves):
    """(segments that are not explained, all) of a map, from the `counts` (n, n) at the points of a lattice over the
    unit square, -1 where not known, and the curves [(kind, positions (m, 2))].
    """
    lost, total = 0, 0
    for axis in (0, 1):
        lines = counts if axis == 1 else counts.T  # along the axis, by the place on the other one
        ticks = np.linspace(0.0, 1.0, len(lines))
        met = [_met(curves, axis, tick) for tick in ticks]
        for line, (places, weights, twice) in list(zip(lines, met, strict=True))[1:-1]:
            known = np.flatnonzero(line >= 0)
            for first, last in pairwise(known):
                total += 1
                change, low, high = line[last] - line[first], ticks[first], ticks[last]
                inside = (places > low - NEAR) & (places < high + NEAR)
                sure = (places > low + NEAR) & (places < high - NEAR) & ~twice
                lost += not _explained(change, weights[inside & sure], weights[inside & ~sure])
    return lost, total


def _met(curves, axis, tick):
    """Where the line along the axis, at `tick` of the other one, meets curves: positions, weights, and which of them
    may be drawn twice.
    """
    places, weights, kinds = [np.zeros(0)], [np.zeros(0, int)], [np.zeros(0, int)]
    for kind, x in curves:
        off = x[:, 1 - axis] - tick
        at = np.flatnonzero((off[:-1] < 0) != (off[1:] < 0))
        share = off[at] / (off[at] - off[at + 1])
        places.append(x[at, axis] + share * (x[at + 1, axis] - x[at, axis]))
        weights.append(np.full(at.size, WEIGHTS.get(kind, 1)))
        kinds.append(np.full(at.size, kind))
    place, kind = np.concatenate(places), np.concatenate(kinds)
    near = (abs(place[:, None] - place) < NEAR) & (kind[:, None] == kind)
    return place, np.concatenate(weights), near.sum(axis=1) > 1


def _explained(change, weights, optional):
    """Is the change a sum of all weights and some of the optional ones, each with either sign?"""
    sums = {0}
    for weight in weights:
        sums = {total + sign * weight for total in sums for sign in (-1, 1)}
    for weight in optional:
        sums |= {total + sign * weight for total in sums for sign in (-1, 1)}
    return int(change) in sums
