"""Where the branches of the saddles go: for t -> +inf the unstable ones, for t -> -inf the stable
ones.

A stable branch is an unstable one of the system that S1, (b, w, t) -> -(b, w, t), makes of it,
whose cycles are those of the system itself with their maps inverted. Where b = 0 the branches are
level curves of H: each comes back to its saddle, or runs into another of the same energy.
"""

from dataclasses import replace

import numpy as np

from survey.kernels.cylinder import branches
from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import fate as kf
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder import returns as rt
from survey.kernels.cylinder.flow import OF_F
from survey.kernels.cylinder.program import COLUMNS
from survey.measures.cylinder.fate import I1, LIBRATIONS, MINUS, PLUS, Cycles, followed, outline
from survey.measures.cylinder.separatrices import TWO_PI, Level, far_end
from survey.measures.cylinder.separatrix import symmetric

BRANCHES = ("unstable_left", "unstable_right", "stable_left", "stable_right")
(
    UNDECIDED,
    NONE,
    EQUILIBRIUM,
    ROTATION_PLUS,
    ROTATION_MINUS,
    LIBRATION,
    PLUS_INFINITY,
    MINUS_INFINITY,
) = range(-1, 7)
_OF_FATES = {
    kf.EQUILIBRIUM: EQUILIBRIUM, kf.ROTATION_PLUS: ROTATION_PLUS, kf.ROTATION_MINUS: ROTATION_MINUS,
    kf.LIBRATION: LIBRATION, kf.SPIN_UP_PLUS: PLUS_INFINITY, kf.SPIN_UP_MINUS: MINUS_INFINITY,
}  # fmt: skip
_BACKWARD = {ROTATION_PLUS: ROTATION_MINUS, ROTATION_MINUS: ROTATION_PLUS,
             PLUS_INFINITY: MINUS_INFINITY, MINUS_INFINITY: PLUS_INFINITY}  # fmt: skip


def table(method, s, rtol):
    """(end, limit) of every branch, (equilibria, 4) each, of the Skeleton s.

    limit: the number of the equilibrium, or of the cycle among those with w > 0, w < 0 and the
    librations, from 1; 0 if there is none.
    """
    end = np.full((len(s.equilibria), len(BRANCHES)), NONE)
    limit = np.zeros_like(end)
    saddles = np.flatnonzero(s.equilibria[:, eq.KIND] == eq.SADDLE)
    if not len(saddles):
        return end, limit
    if s.stratum == I1:
        for row in saddles:
            for at, side in enumerate((-1.0, 1.0)):
                reached = level_end(s, row, side)
                end[row, at::2], limit[row, at::2] = (
                    (EQUILIBRIUM, reached + 1) if reached >= 0 else (UNDECIDED, 0)
                )
        return end, limit
    for first, flow in ((0, s), (2, backward(s))):
        starts = np.zeros((2 * len(saddles), rc.START))
        branches.of_saddles(flow.p, flow.equilibria, starts)
        for i, found in enumerate(followed(method, flow, starts, rtol)):
            at = saddles[i // 2], first + i % 2
            kind = _OF_FATES.get(int(found[rc.VERDICT]), UNDECIDED)
            end[at] = _BACKWARD.get(kind, kind) if first else kind
            limit[at] = _number(s, end[at], int(found[rc.LIMIT]))
    return end, limit


def backward(s):
    """The Skeleton of the flow that S1 makes of that of s."""
    flipped = s.p.copy()
    flipped[OF_F] *= -1.0
    turned = outline(flipped if len(s.p) > COLUMNS else flipped[: rc.SIX])
    swapped = {PLUS: MINUS, MINUS: PLUS, LIBRATIONS: LIBRATIONS}
    return replace(
        turned, search=lambda _turned, kind, _above=0.0: _inverted(s.cycles(swapped[kind]))
    )


def _inverted(cycles):
    """Fixed points of the inverse of a return map."""
    table = cycles.table.copy()
    table[:, [rt.BELOW, rt.ABOVE]] *= -1.0
    table[:, rt.MULTIPLIER] = 1.0 / cycles.table[:, rt.MULTIPLIER]
    table[:, rt.MULTIPLIER_BAR] = (
        cycles.table[:, rt.MULTIPLIER_BAR] / cycles.table[:, rt.MULTIPLIER] ** 2
    )
    return Cycles(table, cycles.threshold[::-1], cycles.conclusive)


def _number(s, end, index):
    """The number of a limit in the tables of the portrait."""
    before = {
        EQUILIBRIUM: 0,
        ROTATION_PLUS: 0,
        ROTATION_MINUS: len(s.plus),
        LIBRATION: len(s.plus) + len(s.minus),
    }
    return before[end] + index + 1 if end in before and index >= 0 else 0


def level_end(s, row, side):
    """b = 0: the equilibrium that the branches on this side of the saddle `row` tend to, or -1
    where that is open.
    """
    level = Level(s.p, s.equilibria[row])
    far, turns = far_end(level, s, side)
    if turns or abs(far) >= TWO_PI:
        return row
    gaps = np.abs(np.sin(0.5 * (s.equilibria[:, eq.ANGLE] - level.angle - far)))
    return int(np.argmin(gaps)) if symmetric(s.p) else -1
