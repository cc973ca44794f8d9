"""As `kernels/brun.py` and `methods/agm.py`, in lanes: with few steps, with more, or in double-double at last.

Points are columns of GIVEN numbers: A, C, epsilon, theta0, p_theta0, b, a; or l, the sign of k, -1 for the lower of two
wells and 1 for the upper one, C/A, nothing, b, a.
"""

import numpy as np

from survey.kernels import double as dd
from survey.kernels import nutation_action, nutation_fine
from survey.kernels import nutation_lanes as nl
from survey.kernels.brun import of_state
from survey.kernels.jit import inline, kernel, splice
from survey.kernels.nutation_lanes import GIVEN, GOOD, OUTPUTS, TILE, WELLS, A, B, finish, put

FEW, MORE = (8, 1, 8), (30, 4, 26)  # steps of Laguerre's method and of Newton's, means
LEFT, DONE, CANCELLED = 0, 1, 2


@inline
def polynomial(work, k, level, at_plus, at_minus, i):
    put(work, nl.K, i, k)
    put(work, nl.L, i, level)
    put(work, nl.PLUS_POLE, i, at_plus)
    put(work, nl.MINUS_POLE, i, at_minus)
    put(work, nl.MINUS, i, dd.two_sum(work[B + i], -work[A + i]))
    put(work, nl.PLUS, i, dd.two_sum(work[B + i], work[A + i]))


@kernel
def states(work):
    """The polynomials of initial states."""
    for i in range(TILE):
        b, a = work[B + i], work[A + i]
        k, level, at_plus, at_minus, u, inside = of_state(
            work[i], work[TILE + i], work[2 * TILE + i], work[3 * TILE + i], work[4 * TILE + i], b, a
        )
        polynomial(work, (k[0] if inside else np.nan, k[1]), level, at_plus, at_minus, i)
        work[nl.U + i] = u[0]


@kernel
def integrals(work):
    """The polynomials of scaled integrals."""
    for i in range(TILE):
        level, sign, product = work[i], work[TILE + i], dd.two_prod(work[B + i], work[A + i])
        high = dd.two_sum(level, sign)
        polynomial(work, (sign, 0.0), (level, 0.0), dd.sub(high, product), dd.add(high, product), i)
        work[nl.U + i] = 2.0 * work[2 * TILE + i]


@kernel
def enter(points, first, work):
    """A tile of points, the last of which is repeated."""
    last = points.shape[1] - 1
    for j in range(GIVEN):
        for i in range(TILE):
            work[j * TILE + i] = points[j, min(first + i, last)]


@kernel
def leave(work, told, first, out, wells, done):
    for i in range(min(TILE, len(done) - first)):
        for j in range(OUTPUTS):
            out[j, first + i] = told[j * TILE + i]
        wells[first + i], done[first + i] = work[WELLS + i], work[GOOD + i]


@kernel
def solve(work, steps, exactly, actions):
    if steps[1] > 1:
        nl.approach_slowly(work, steps[0])
    else:
        nl.approach(work, steps[0])
    nl.wells(work, steps[1])
    nl.means(work, steps[2])
    if exactly:
        nutation_fine.fine(work)
    if actions:
        nl.small_actions(work)


@kernel
def tell_states(work, told):
    for i in range(TILE):
        a, c = work[i], work[TILE + i]
        finish(work, a, work[A + i] * ((a - c) / (a * c)), i, told)


@kernel
def tell_integrals(work, told):
    for i in range(TILE):
        ratio = work[3 * TILE + i]
        finish(work, 1.0, work[A + i] * ((1.0 - ratio) / ratio), i, told)


@splice
def answer(polynomials, tell, points, steps, exactly, actions, out, wells, done):
    """Tile after tile: the polynomials of its points, their wells, and what is told of these."""
    work, told = np.zeros(nutation_fine.ALL), np.empty(OUTPUTS * TILE)
    for first in range(0, len(done), TILE):
        enter(points, first, work)
        polynomials(work)
        solve(work, steps, exactly, actions)
        tell(work, told)
        if actions:
            nutation_action.mend(work, told)
        leave(work, told, first, out, wells, done)


@kernel
def of_states(points, steps, exactly, actions, out, wells, done):
    """Outputs (OUTPUTS, n) of initial states (GIVEN, n), the numbers of wells (n), and which are DONE (n).

    exactly: CANCELLED ones too; actions: accurate ones of small wells.
    """
    answer(states, tell_states, points, steps, exactly, actions, out, wells, done)


@kernel
def of_integrals(points, steps, exactly, actions, out, wells, done):
    """As `of_states`, at scaled integrals."""
    answer(integrals, tell_integrals, points, steps, exactly, actions, out, wells, done)
