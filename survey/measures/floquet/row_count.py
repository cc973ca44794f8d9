"""Do the curves that are found explain how many multipliers are outside the unit circle, all over the map?

Along the rows and columns of the lattice that was searched, this number is certain at most points. Between two of them
it changes by what passes the circle: a real multiplier counts for 1, a complex pair for 2, and of a symplectic or
reversible system a pair at 1 or -1 for 1, and two pairs that collide for 2. A segment whose curves do not add up to the
change, with any signs, has lost one. A curve that it meets next to its ends may belong to the segment beside it, and
two that it meets next to one another may be one that is drawn twice: these may count or not. Curves that end inside the
map, as between the edges of a narrow tongue, or that cancel between two points of the lattice, do not show here. Of
symplectic systems the Maslov index (see `maslov`) counts passages of 1 and of -1 with their signs, whatever the other
multipliers do: both edges of a tongue between two points show, where they count the same way.
"""

from itertools import pairwise

import numpy as np

from survey.measures.floquet import monodromy
from survey.measures.floquet.maslov import UNKNOWN
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


def unexplained(counts, curves, passed=None):
    """(segments that are not explained, all) of a map, from the `counts` (n, n) at the points of a lattice over the
    unit square, -1 where not known, and the curves [(kind, positions (m, 2))]; `passed` {kind: (n, n)} are the Maslov
    indices of those kinds that have one.
    """
    all_of = segments(np.where(counts >= 0, counts, UNKNOWN), curves, WEIGHTS)
    for kind, index in (passed or {}).items():
        for segment, explained in segments(index, [one for one in curves if one[0] == kind], {}).items():
            all_of[segment] = all_of.get(segment, True) and explained
    return sum(not explained for explained in all_of.values()), len(all_of)


def segments(values, curves, weights_of, border=1):
    """{(axis, number of the line across it, first, last point): do the curves explain the change of `values`?}, of
    integers (n, n) at the lattice's points, or UNKNOWN; each curve counts for 1, or for `weights_of` its kind. The
    `border` is as many lines wide, which are left out.
    """
    found = {}
    for axis in (0, 1):
        lines = values if axis == 1 else values.T  # along the axis, by the place on the other one
        ticks = np.linspace(0.0, 1.0, len(lines))
        for number in range(border, len(lines) - border):
            line, (places, weights, twice) = lines[number], _met(curves, axis, ticks[number], weights_of)
            for first, last in pairwise(np.flatnonzero(line != UNKNOWN)):
                low, high = ticks[first], ticks[last]
                inside = (places > low - NEAR) & (places < high + NEAR)
                sure = (places > low + NEAR) & (places < high - NEAR) & ~twice
                change = line[last] - line[first]
                found[axis, number, first, last] = _explained(change, weights[inside & sure], weights[inside & ~sure])
    return found


def _met(curves, axis, tick, weights_of):
    """Where the line along the axis, at `tick` of the other one, meets curves: positions, weights (1 but for
    `weights_of` {kind: weight}), and which of them may be drawn twice.
    """
    places, weights, kinds = [np.zeros(0)], [np.zeros(0, int)], [np.zeros(0, int)]
    for kind, x in curves:
        off = x[:, 1 - axis] - tick
        at = np.flatnonzero((off[:-1] < 0) != (off[1:] < 0))
        share = off[at] / (off[at] - off[at + 1])
        places.append(x[at, axis] + share * (x[at + 1, axis] - x[at, axis]))
        weights.append(np.full(at.size, weights_of.get(kind, 1)))
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
