"""Do the curves that are found explain how many multipliers are outside the unit circle, all over
the map?

This number is certain at most points of the lattice that was searched. It changes by what passes
the circle: a real multiplier counts for 1, a complex pair for 2, and of a symplectic or reversible
system a pair at 1 or -1 for 1, and two pairs that collide for 2 (see `segments`). Of symplectic
systems the Maslov index (see `maslov`) counts passages of 1 and of -1 with their signs, whatever
the other multipliers do: both edges of a tongue between two points show, where they count the same
way.
"""

import numpy as np

from survey.measures.floquet import monodromy, multipliers
from survey.measures.floquet.multipliers import COLLISION, NEIMARK_SACKER, Discs
from survey.measures.segments import UNKNOWN, segments

WEIGHTS = {NEIMARK_SACKER: 2, COLLISION: 2}  # of others 1
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
        certain = (beyond | within).all(axis=1)
        if structure == "symplectic":  # of one Krein sign, and so on the circle
            within |= multipliers.clusters(discs, np.flatnonzero(~certain)) != 0
            certain = (beyond | within).all(axis=1)
        found[i : i + CHUNK] = np.where(certain, beyond.sum(axis=1), -1)
    return found


def known(counts):
    """The numbers of `outside`, UNKNOWN where they are not certain."""
    return np.where(counts >= 0, counts, UNKNOWN)


def unexplained(counts, curves, passed=None):
    """(segments that are not explained, all) of a map, from the `counts` (n, n) at the points of a
    lattice over the unit square, -1 where not known, and the curves [(kind, positions (m, 2))];
    `passed` {kind: (n, n)} are the Maslov indices of those kinds that have one.
    """
    all_of = segments(known(counts), curves, WEIGHTS)
    for kind, index in (passed or {}).items():
        for segment, explained in segments(
            index, [one for one in curves if one[0] == kind], {}
        ).items():
            all_of[segment] = all_of.get(segment, True) and explained
    return sum(not explained for explained in all_of.values()), len(all_of)
