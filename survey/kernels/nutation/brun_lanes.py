"""As `kernels/nutation/brun.py` and `methods/agm.py`, in lanes: with few steps, with more, lastly
in double-double.

Points are a tuple of GIVEN arrays: of states, or of scaled integrals in their place (see `records`).
"""

import numpy as np

from survey.kernels.jit import inline, kernel, splice
from survey.kernels.math import double as dd
from survey.kernels.nutation import action, lanes_double
from survey.kernels.nutation import lanes as nl
from survey.kernels.nutation.brun import of_state
from survey.kernels.nutation.lanes import GIVEN, GOOD, OUTPUTS, TILE, WELLS, A, B, finish, store

# steps of Laguerre's method and of Newton's, means; at first from the initial state or from the
# poles
FEW, FEW_FROM_POLES, MORE, MOST = (3, 1, 6), (6, 1, 6), (12, 1, 12), (30, 4, 26)
LEFT, CANCELLED, DONE = 0, 1, 2


@inline
def polynomial(work, k, level, at_plus, at_minus, i):
    store(work, nl.K, i, k)
    store(work, nl.L, i, level)
    store(work, nl.PLUS_POLE, i, at_plus)
    store(work, nl.MINUS_POLE, i, at_minus)
    store(work, nl.MINUS, i, dd.two_sum(work[B + i], -work[A + i]))
    store(work, nl.PLUS, i, dd.two_sum(work[B + i], work[A + i]))


@kernel
def states(work):
    """The polynomials of initial states."""
    for i in range(TILE):
        b, a = work[B + i], work[A + i]
        k, level, at_plus, at_minus, u, inside = of_state(
            work[nl.SIZE_A + i],
            work[nl.SIZE_C + i],
            work[nl.EPSILON + i],
            work[nl.THETA + i],
            work[nl.P_THETA + i],
            b,
            a,
        )
        polynomial(work, (k[0] if inside else np.nan, k[1]), level, at_plus, at_minus, i)
        work[nl.U + i] = u[0]
        work[nl.HERE + i] = work[nl.P_THETA + i] ** 2 * (1.0 - u[0]) * (1.0 + u[0])


@kernel
def integrals(work):
    """The polynomials of scaled integrals."""
    for i in range(TILE):
        level, sign = work[nl.GIVEN_LEVEL + i], work[nl.SIGN + i]
        product = dd.two_prod(work[B + i], work[A + i])
        high = dd.two_sum(level, sign)
        polynomial(work, (sign, 0.0), (level, 0.0), dd.sub(high, product), dd.add(high, product), i)
        work[nl.U + i] = 2.0 * work[nl.WELL + i]


@inline
def together(which, first):
    """The points of a tile lie side by side."""
    return first + TILE <= len(which) and which[first + TILE - 1] == which[first] + TILE - 1


@kernel
def enter(points, which, first, work):
    """A tile of the points `which`, the last of which is repeated."""
    start, last = which[first], len(which) - 1
    if together(which, first):
        for j in range(GIVEN):
            row = points[j][start : start + TILE]
            for i in range(TILE):
                work[j * TILE + i] = row[i]
        return
    for i in range(TILE):
        at = which[min(first + i, last)]
        for j in range(GIVEN):
            work[j * TILE + i] = points[j][at]


@kernel
def leave(work, answers, which, first, kept, out, wells, done):
    start = which[first]
    if together(which, first):
        for j in range(OUTPUTS):
            if kept[j]:
                row = out[j, start : start + TILE]
                for i in range(TILE):
                    row[i] = answers[j * TILE + i]
        number, state = wells[start : start + TILE], done[start : start + TILE]
        for i in range(TILE):
            number[i], state[i] = work[WELLS + i], work[GOOD + i]
        return
    for i in range(min(TILE, len(which) - first)):
        at = which[first + i]
        for j in range(OUTPUTS):
            out[j, at] = answers[j * TILE + i]
        wells[at], done[at] = work[WELLS + i], work[GOOD + i]


@splice
def solve(work, steps, within, exactly, actions):
    if steps[1] > 1:
        nl.approach_slowly(work, steps[0])
    else:
        if within:
            nl.inside(work)
            nl.approach_roughly(work, steps[0])
            nl.approach(work, 0)
        else:  # float32 may miss a narrow well on the way: it only says where to start
            nl.poles(work)
            nl.approach_roughly(work, 0)
            nl.approach(work, steps[0])
    nl.wells(work, steps[1])
    nl.means(work, steps[2])
    if exactly:
        lanes_double.fill(work, steps[2])
    if actions:
        nl.small_actions(work)


@kernel
def answer_states(work, answers):
    for i in range(TILE):
        a, c = work[nl.SIZE_A + i], work[nl.SIZE_C + i]
        finish(work, a, work[A + i] * ((a - c) / (a * c)), i, answers)


@kernel
def answer_integrals(work, answers):
    for i in range(TILE):
        ratio = work[nl.RATIO + i]
        finish(work, 1.0, work[A + i] * ((1.0 - ratio) / ratio), i, answers)


@kernel
def in_state(done, low, high, which):
    """Those of the points `which` whose state is in this range."""
    found, count = np.empty(len(which), np.int64), 0
    for i in which:
        found[count] = i
        count += (done[i] >= low) & (done[i] <= high)
    return found[:count]


@splice
def answer(polynomials, fill, known_u, points, actions, kept, out, wells, done):
    """Tile after tile: the polynomials of its points, their wells, and their answers.

    All of them go with FEW steps, what these leave with MORE and then with MOST; exactly where that
    is asked for.
    """
    work, answers = np.zeros(lanes_double.ALL), np.empty(OUTPUTS * TILE)
    left = which = np.arange(len(done))
    for n in range(6):
        steps, exactly = (FEW if known_u else FEW_FROM_POLES, MORE, MOST)[n // 2], n % 2 == 1
        for first in range(0, len(which), TILE):
            enter(points, which, first, work)
            polynomials(work)
            solve(work, steps, known_u and n < 2, exactly, actions)
            fill(work, answers)
            if actions:
                action.mend(work, answers)
            leave(work, answers, which, first, kept, out, wells, done)
        left = in_state(done, LEFT, CANCELLED, left) if exactly else left
        which = left if exactly else in_state(done, CANCELLED, CANCELLED, left)


def compile_some(kernel):
    """Compile some of the kernels of which `of_states` or `of_integrals` is made, by calls on zeros."""
    work, answers = np.zeros(lanes_double.ALL), np.zeros(OUTPUTS * TILE)
    (states if kernel is of_states else integrals)(work)
    nl.approach_slowly(work, 1)
    nl.inside(work)
    nl.approach_roughly(work, 1)
    nl.approach(work, 1)
    nl.means(work, 1)
    nl.small_actions(work)
    (answer_states if kernel is of_states else answer_integrals)(work, answers)
    action.mend(work, answers)


def compile_others():
    """As `compile_some`, for a process beside that one."""
    work, answers = np.zeros(lanes_double.ALL), np.zeros(OUTPUTS * TILE)
    one, which = np.zeros(1), np.zeros(1, np.int64)
    enter((one,) * GIVEN, which, 0, work)
    leave(work, answers, which, 0, np.ones(OUTPUTS, bool), np.zeros((OUTPUTS, 1)), one, one)
    nl.wells(work, 1)
    lanes_double.begin(work)
    lanes_double.go(work, 1)
    lanes_double.end(work)


@kernel
def of_states(points, actions, kept, out, wells, done):
    """Outputs (OUTPUTS, n) of initial states, the numbers of wells (n), and which are
    DONE (n).

    actions: accurate ones of small wells; kept: the rows of `out` to fill.
    """
    answer(states, answer_states, True, points, actions, kept, out, wells, done)


@kernel
def of_integrals(points, actions, kept, out, wells, done):
    """As `of_states`, at scaled integrals."""
    answer(integrals, answer_integrals, False, points, actions, kept, out, wells, done)
