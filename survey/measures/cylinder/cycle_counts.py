"""Do the curves that are found explain how many cycles there are, all over a map of two parameters?

Rotations with w > 0, those with w < 0, and librations are counted where the return maps are
conclusive. Their numbers change by 2 at a fold of cycles of that kind, that of librations by 1 at a
Hopf bifurcation; at a saddle connection, at a fold of equilibria, which may lie on a cycle, and
where the ends change, by 1 or not at all (see `segments`). On a line a fold of equilibria that a
branch passes lies on no rotation, and leaves their numbers as they are.
"""

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.program import COLUMNS
from survey.measures import contours
from survey.measures.cylinder import connections
from survey.measures.cylinder.fate import KINDS, LIBRATIONS, MINUS, PLUS, G, remembered
from survey.measures.segments import UNKNOWN, along, segments
from survey.methods import taylor

LINES = 33
WITHIN = 1e-8  # of the map: what positions on a border may be off
BESIDE = (0.2, 0.02, 2e-3, 2e-4)  # of the gap to the next point of a curve
SIDES = {PLUS: 1, MINUS: -1}
HOPF = ("supercritical_hopf", "subcritical_hopf")
OPTIONAL = ("homoclinic", "heteroclinic", "fold", "ends")
WEIGHTS = {"cycle_fold": 2}


def on_lattice(plane):
    """The numbers of cycles of each kind (3, LINES, LINES) at the points of a lattice over the map,
    or UNKNOWN.
    """
    counts = np.array([_count(row) for row in plane.flows(contours.lattice(LINES))])
    return counts.T.reshape(-1, LINES, LINES)


def lost(plane, rows, counts):
    """The segments (low, high), positions, of the lattice's lines along which curves do not explain
    the numbers of cycles.

    `rows` are those of `bifurcations.found`.
    """
    missed = set()
    for kind, values in zip(KINDS, counts, strict=True):
        own = [
            (name, plane.positions(xy))
            for name, xy, _error, known in rows
            if _counts_for(kind, name, known)
        ]
        explained = segments(values, own, WEIGHTS, optional=OPTIONAL)
        missed |= {segment for segment, good in explained.items() if not good}
    ticks = np.linspace(0.0, 1.0, LINES)
    return [
        ticks[np.array([[first, number], [last, number]])][:, :: 1 - 2 * axis]
        for axis, number, first, last in sorted(missed)
    ]


def _met(plane, rows):
    """[(name, position, known)] of the points on the border that is asked for alone; `known` with
    the sides on which folds are "passed" (see `connections.passes`).
    """
    value = plane.square.parameters(np.array([0.0, plane.square.across]))[1]
    met = []
    for name, xy, errors, known in rows:
        for i in np.flatnonzero(xy[:, 1] == value):
            position = plane.positions(xy[i : i + 1])[0, 0]
            passed = connections.passes(plane, position, errors[i]) if name == "fold" else ()
            met.append((name, position, known | {"passed": passed}))
    return met


def lost_on_border(plane, rows):
    """Parts (low, high) of the border that is asked for alone, along which points of the curves on
    it do not explain the numbers of cycles; `rows` are those of `bifurcations.found`.
    """
    met = _met(plane, rows)
    ticks, counts = _on_border(plane, met)
    parts = set()
    for kind, values in zip(KINDS, counts, strict=True):
        own = [
            (name, position)
            for name, position, known in met
            if _counts_for(kind, name, known) and SIDES.get(kind) not in known["passed"]
        ]
        explained = along(values, ticks, own, WEIGHTS, OPTIONAL, WITHIN)
        parts |= {segment for segment, good in explained.items() if not good}
    return [
        (max(0.0, ticks[first] - WITHIN), min(1.0, ticks[last] + WITHIN))
        for first, last in sorted(parts)
    ]


def _on_border(plane, met):
    """Ticks of the border that is asked for alone (m), of which some lie beside each point of the
    curves on it, `met` as by `_met`, and the numbers of cycles of each kind (3, m) there, or UNKNOWN.
    """
    met = np.unique([position for _name, position, _known in met])
    gaps = np.diff(np.concatenate([[0.0], met, [1.0]]))
    shares = np.array(BESIDE)[:, None]
    beside = np.concatenate([met - shares * gaps[:-1], met + shares * gaps[1:]]).ravel()
    ticks = np.unique(np.concatenate([np.linspace(0.0, 1.0, LINES), beside]))
    x = np.column_stack([ticks, np.full(ticks.size, plane.square.across)])
    return ticks, np.array([_count(row) for row in plane.flows(x)]).T


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
