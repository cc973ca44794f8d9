"""Do the curves that are found explain how many cycles there are, all over a map of two parameters?

Rotations with w > 0, those with w < 0, and librations are counted where the return maps are
conclusive. Their numbers change by 2 at a fold of cycles of that kind, that of librations by 1 at a
Hopf bifurcation; at a saddle connection, at a fold of equilibria, which may lie on a cycle, and
where the ends change, by 1 or not at all (see `segments`).
"""

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.program import COLUMNS
from survey.measures import contours
from survey.measures.cylinder.fate import KINDS, LIBRATIONS, MINUS, PLUS, G, remembered
from survey.measures.segments import UNKNOWN, segments
from survey.methods import taylor

LINES = 33
HOPF = ("supercritical_hopf", "subcritical_hopf")
OPTIONAL = ("homoclinic", "heteroclinic", "fold", "ends")


def on_lattice(plane):
    """The numbers of cycles of each kind (3, LINES, LINES) at the points of a lattice over the map,
    or UNKNOWN.
    """
    counts = np.array([_count(row) for row in plane.flows(contours.lattice(LINES))])
    return counts.T.reshape(-1, LINES, LINES)


def unexplained(plane, rows, counts):
    """The number of segments of the lattice's lines along which curves do not explain the numbers
    of cycles.

    `rows` are those of `bifurcations.found`.
    """
    missed = set()
    for kind, values in zip(KINDS, counts, strict=True):
        own = [
            (name, plane.positions(xy))
            for name, xy, _error, known in rows
            if _counts_for(kind, name, known)
        ]
        explained = segments(values, own, {"cycle_fold": 2}, optional=OPTIONAL)
        missed |= {segment for segment, good in explained.items() if not good}
    return len(missed)


def _count(row):
    """The numbers of the cycles of each kind of one flow, or UNKNOWN."""
    if np.isfinite(row).all():
        s = remembered(taylor, row if len(row) > COLUMNS else row[: rc.SIX])
        on_curve = len(row) == COLUMNS and s.K == 0.0
        if s.stratum == G and not (s.folded or s.unknown or on_curve) and s.conclusive:
            return [len(s.cycles(kind).table) for kind in KINDS]
    return [UNKNOWN] * len(KINDS)


def _counts_for(kind, name, known):
    """Do curves of this name change the number of cycles of a kind?"""
    if name == "cycle_fold":
        w = known["cycle_w"][0][0]
        return kind == (PLUS if w > 0.0 else MINUS if w < 0.0 else LIBRATIONS)
    return name in OPTIONAL or (name in HOPF and kind == LIBRATIONS)
