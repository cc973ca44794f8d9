"""Solutions w(phi) of Abel's equation (57) for many systems in lock step: w and t at given angles.

Far from turning points phi is the variable (`lockstep_phi`); from there on the steps are those of
`lockstep`, in time, and errors are bounded as there. A step's series serves all the angles that it
passes, BLOCK of them at once: Newton's method gives the times, then come w, t and their error bars.
Turning points, targets in doubt and the ends of solutions are treated as in `steps.abel`.
"""

import math

import numpy as np

from survey.kernels.cylinder import lockstep_phi as far
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import (
    B12,
    B31,
    BOUND_DDG,
    BOUND_DG,
    BOUND_F,
    BOUND_G,
    C23,
    S2,
    S3,
    TWO_PI,
    TWO_PI_LOW,
    D,
    reduced,
)
from survey.kernels.cylinder.lockstep import (
    COARSEST,
    LANES,
    NEAREST,
    NEXT,
    ORDER,
    P2,
    P3,
    P12,
    P31,
    PD,
    PDG,
    PF,
    PG,
    PSI,
    RATE,
    ROWS,
    SAA,
    SAB,
    SBB,
    STEPS,
    TIME,
    TIME_LOW,
    TURN,
    TURNS,
    V,
    advance,
    busy,
    coefficients,
    ellipse,
    enter,
    last_terms,
    moved,
    polynomial,
    series,
    sine_cosine,
    split,
    variations,
    varied,
)
from survey.kernels.cylinder.steps import (
    EQUILIBRIUM,
    NO_CONVERGENCE,
    OK,
    OVERFLOW,
    SEPARATRIX,
    STEP_LIMIT,
    TRUST,
    TURNING,
    at_rest,
    bar,
    certain,
    clean_turning,
    conclude,
    crossing,
    finite,
    node_possible,
    row_of,
    runs_into_node,
    to_target,
    trusted,
    unturned,
    values,
)
from survey.kernels.jit import constant, inline, part, splice
from survey.kernels.math.newton import bracketed
from survey.kernels.unroll import unroll

BLOCK = 8
NEWTON = 1  # further steps; one more, by the derivatives, and most are at rounding
# Where the columns of a block begin: psi, the time in the step, the square of psi's error; what
# `steps.crossing` makes of them; what Newton's method has left. One flat array: LLVM sees that they
# do not overlap.
_SIZE = 8 * BLOCK
GOAL, DT, SQUARE, VALUE, TIMES, VALUE_BAR, TIME_BAR, MISS = range(0, _SIZE, BLOCK)
_GOING = -1


@inline
def _nearer(c, rise, dt, reach):
    """One step of Newton's method from dt to where psi has risen by `rise`; with w and the residual at dt."""
    x, v = moved(c, dt)
    miss = rise - x
    return min(max(dt + miss / max(v, 1e-300), 0.0), reach), v, miss


@inline
def _coast(w, change, distance):
    """How long a distance takes from w on at a constant w' = `change`, if it is reached."""
    square = w * w + 2.0 * change * distance
    return 2.0 * distance / (w + math.sqrt(max(square, 0.0)) + 1e-300)


@inline
def _forces(fixed, i):
    """The coefficients of f and g of lane i."""
    return fixed[P12, i], fixed[P31, i], fixed[P2, i], fixed[P3, i], fixed[PD, i]


@inline
def _functions(forces, x):
    """f, g and g' at the angle x, from `_forces`."""
    p12, p31, p2, p3, pd = forces
    k = (x * (1.0 / TWO_PI) + NEAREST) - NEAREST
    sine, cosine = sine_cosine((x - k * TWO_PI) - k * TWO_PI_LOW)
    g = p2 * cosine - p3 * sine - pd * (sine * cosine)
    dg = -pd * ((cosine - sine) * (cosine + sine)) - p2 * sine - p3 * cosine
    return p12 * cosine - p31 * sine, g, dg


@inline
def _at(_p, given, dt):
    """(psi, w, 0, 0) at dt of a step: stands for a method's `flow_at`."""
    psi, c = given
    x, v = moved(c, dt)
    return psi + x, v, 0.0, 0.0


@unroll
def _slowing(c, dt):
    """w and w' at dt."""
    slope = [c[n] * float(n) for n in range(1, ORDER + 1)]
    square = dt * dt
    v, a = (polynomial(x[0::2], square) + polynomial(x[1::2], square) * dt for x in (c, slope))
    return v, a


@inline
def _to_rest(_at, c, dt):
    """The residual of w = 0, which is positive before."""
    v, slope = _slowing(c, dt)
    return v, slope, v > 0.0


@part
def _cross(T, state, before, fixed, i, reach, total, end, block, size):
    """Fill the block from its GOALs, the first `size` of which count, at up to `reach` in the step;
    there psi has risen by `total`, and w = `end`.
    """
    c, vary = coefficients(T, i), variations(T, i)
    psi, w, n, t, t_low = (
        before[PSI, i],
        before[V, i],
        state[STEPS, i],
        before[TIME, i],
        before[TIME_LOW, i],
    )
    carried = before[SAA, i], before[SAB, i], before[SBB, i]
    forces, most_f, most_g = _forces(fixed, i), fixed[PF, i], fixed[PG, i]
    ends = last_terms(T, i)
    # psi is nearly the cubic with these w, and these w', at both ends
    bulge = 6.0 * total / reach - 3.0 * (w + end)
    first, last = ((end - w) + bulge) / reach, ((end - w) - bulge) / reach
    for j in range(BLOCK):
        rise = max(block[GOAL + j] - psi, 0.0)
        rest = max(total - rise, 0.0)
        since, left = _coast(w, first, rise), _coast(end, -last, rest)
        dt = max(min(since if rise < rest else reach - left, reach), 0.0)
        block[DT + j] = _nearer(c, rise, dt, reach)[0]
    for _ in range(NEWTON):
        for j in range(BLOCK):
            block[DT + j], v, miss = _nearer(c, block[GOAL + j] - psi, block[DT + j], reach)
            # what two more steps leave of psi is to be less than a share of its rounding
            left, speed = miss * miss * (most_f * v + most_g), v * v
            block[MISS + j] = left * left * (most_f * v + most_g) - 1e-17 * speed * speed * speed
    for j in range(size):
        if not block[MISS + j] <= 0.0:
            given = (0.0, (psi, c), block[GOAL + j], True)
            block[DT + j] = bracketed(to_target, _at, given, block[DT + j], (0.0, reach), (1e-17 + 2e-16 * reach, 0.0),
                                     60)[1]  # fmt: skip
    for j in range(BLOCK):
        dt = block[DT + j]
        x, v = moved(c, dt)
        x += psi
        a, b, d = ellipse(carried, varied(vary, dt), dt, v, ends, most_f, most_g)
        a += block[SQUARE + j] + (4e-16 * dt * v) * (4e-16 * dt * v)
        f, g, _dg = _functions(forces, x)
        more = min(max((block[GOAL + j] - x) / max(v, 1e-300), -dt), reach - dt)
        v, dt = v + more * (f * v + g), dt + more
        value, time, value_bar, time_bar = crossing(n, v, t + (dt + t_low), a, b, d, f, g)
        block[VALUE + j], block[TIMES + j] = value, time
        block[VALUE_BAR + j], block[TIME_BAR + j] = value_bar, time_bar
        block[SQUARE + j] = a


@part
def _pass(T, state, before, fixed, q, i, block, targets, j, doubt, started, floats, status):
    """Note what the step of lane i passes; returns (next target, first in doubt, has it left w =
    0?, how it ends).
    """
    size, turns, angle, n = len(targets), before[TURNS, i], fixed[TURN, i], state[STEPS, i]
    x1, v1, reach = state[PSI, i], state[V, i], 1.0 / state[RATE, i]
    if not (math.isfinite(x1) and math.isfinite(v1)):
        return j, doubt, started, OVERFLOW
    saa, sbb = state[SAA, i], state[SBB, i]
    turned = v1 <= 0.0
    if turned:
        c = coefficients(T, i)
        reach = bracketed(
            _to_rest,
            _at,
            c,
            reach * before[V, i] / (before[V, i] - v1),
            (0.0, reach),
            (1e-17 + 4e-16 * reach, 0.0),
            60,
        )[1]
        x, v1 = moved(c, reach)
        x1 = before[PSI, i] + x
        carried = before[SAA, i], before[SAB, i], before[SBB, i]
        jacobian = varied(variations(T, i), reach)
        saa, _sab, sbb = ellipse(
            carried, jacobian, reach, v1, last_terms(T, i), fixed[PF, i], fixed[PG, i]
        )
    while j < size and unturned(targets[j], turns) - angle <= x1:
        count = 0
        while (
            count < BLOCK and j + count < size and unturned(targets[j + count], turns) - angle <= x1
        ):
            target = targets[j + count]
            block[GOAL + count] = unturned(target, turns) - angle
            block[SQUARE + count] = (3e-16 * target) ** 2 + (5e-16 * (angle != 0.0)) ** 2
            count += 1
        for k in range(count, BLOCK):
            block[GOAL + k], block[SQUARE + k] = block[GOAL + count - 1], 0.0
        _cross(T, state, before, fixed, i, reach, x1 - before[PSI, i], v1, block, count)
        for k in range(count):
            row = floats[j]
            row[rc.VALUE], row[rc.TIME] = block[VALUE + k], block[TIMES + k]
            row[rc.VALUE_BAR], row[rc.TIME_BAR] = block[VALUE_BAR + k], block[TIME_BAR + k]
            usable = bar(n, block[SQUARE + k]) < TRUST and row[rc.VALUE_BAR] < TRUST * (
                1.0 + abs(row[rc.VALUE])
            )
            usable = usable and row[rc.TIME_BAR] < TRUST * (1.0 + row[rc.TIME])
            status[j] = OK if usable else NO_CONVERGENCE
            if doubt < 0 and not certain(row):
                doubt = j
            j += 1
    bar_phi, bar_w = bar(n, saa), bar(n, sbb)
    edge = bar_phi * 1.1 + 4e-16 * abs(x1 + turns * TWO_PI) + 5e-16 * (angle != 0.0)
    # from here on a turning point lies beyond x1
    while doubt >= 0 and doubt < j and x1 - (unturned(targets[doubt], turns) - angle) > edge:
        doubt += 1
    if doubt == j:
        doubt = -1
    if turned:
        ending = TURNING if clean_turning(constant(q), x1, bar_phi, bar_w) else SEPARATRIX
        t = before[TIME, i]
        bar_t = bar_w / abs(values(constant(q), x1)[1]) + 3e-16 * t if ending == TURNING else 0.0
        for k in range(doubt if doubt >= 0 else j, size):
            if k >= j or not certain(floats[k]):
                status[k] = ending
                floats[k, rc.VALUE] = (x1 + angle) + turns * TWO_PI
                floats[k, rc.TIME] = t + (reach + before[TIME_LOW, i])
                floats[k, rc.VALUE_BAR] = edge + 4e-16 * abs(floats[k, rc.VALUE])
                floats[k, rc.TIME_BAR] = bar_t * 1.2
        return size, -1, started, OK
    if not trusted(saa, sbb, v1):
        return j, doubt, started, NO_CONVERGENCE
    if started and not v1 > 2.0 * bar_w:
        return j, doubt, started, SEPARATRIX
    started = started or v1 > 2.0 * bar_w
    if j < size and runs_into_node(constant(q), x1, v1, unturned(targets[j], turns) - angle, 0.0):
        return j, doubt, started, EQUILIBRIUM
    return j, doubt, started, (_GOING if j < size or doubt >= 0 else OK)


@part
def _refill(
    P,
    starts,
    targets,
    waiting,
    state,
    fixed,
    axes,
    row,
    sizes,
    goal,
    started,
    column,
    ahead,
    planes,
    status,
):
    """Give free lanes the rows that wait; returns the first that still waits."""
    for i in range(LANES):
        while waiting < len(P) and row[i] < 0:
            begun, first = ahead[waiting, far.W] > 0.0, int(ahead[waiting, far.COLUMN])
            if begun and first == targets.shape[1]:  # all are known
                waiting += 1
                continue
            p = P[waiting]
            phi0 = starts[waiting, rc.START_PHI]
            w0 = starts[waiting, rc.START_W]
            own = row_of(targets, waiting)
            size = finite(own)
            at, rows, codes = (
                own[:size],
                planes[:, waiting, :size].T,
                status[waiting, :size],
            )
            if first < size and (
                begun or not at_rest(p, reduced(phi0)[0], phi0, w0, at, rows, codes)
            ):
                enter(p, phi0, w0, state, fixed, i)
                fixed[NEXT, i], row[i], sizes[i] = math.inf, waiting, size
                # number by number: an assignment to a slice would take a second to compile
                axes[i, B12], axes[i, B31], axes[i, D] = fixed[P12, i], fixed[P31, i], fixed[PD, i]
                axes[i, C23], axes[i, S2], axes[i, S3] = 0.0, fixed[P2, i], fixed[P3, i]
                axes[i, BOUND_F], axes[i, BOUND_G], axes[i, BOUND_DG] = (
                    fixed[PF, i],
                    fixed[PG, i],
                    fixed[PDG, i],
                )
                axes[i, BOUND_DDG] = p[BOUND_DDG]
                if begun:
                    _go_on(ahead[waiting], state, fixed, i)
                column[i], started[i] = first, state[V, i] > 0.0
                goal[i] = own[first] - fixed[TURN, i]
            waiting += 1
    return waiting


@inline
def _go_on(reached, state, fixed, i):
    """Set lane i, after `enter`, to what `lockstep_phi` reached; error bounds at an angle become
    those at a time.
    """
    w, delay = reached[far.W], reached[far.T_BOUND]
    state[PSI, i], state[TURNS, i], state[V, i] = (
        reached[far.AT] - fixed[TURN, i],
        reached[far.TURNED],
        w,
    )
    state[TIME, i], state[TIME_LOW, i] = reached[far.TIME], reached[far.TIME_LOW]
    wide, tall = w * delay, reached[far.W_BOUND] + (fixed[PF, i] * w + fixed[PG, i]) * delay
    state[SAA, i] += wide * wide
    state[SBB, i], state[STEPS, i] = tall * tall, 1.0


@inline
def _calm(state, fixed, goal, doubt, started, calm):
    """Where a step has passed no target and is far from any ending: `_pass` would note nothing but
    that w has risen.
    """
    for i in range(LANES):
        psi, v, square = state[PSI, i], state[V, i], state[SBB, i]
        x = psi + state[TURNS, i] * TWO_PI
        f, g, dg = _functions(_forces(fixed, i), psi)
        no_node = (v * fixed[PF, i] > 0.3 * fixed[PG, i]) | (
            not node_possible(f, g, dg, fixed[PF, i])
        )
        quiet = x + 1e-9 * (1.0 + abs(x)) < goal[i]
        quiet = quiet & no_node & (v * v > 9.0 * state[STEPS, i] * square) & (v > 0.0)
        calm[i] = (
            quiet & (doubt[i] < 0) & (state[SAA, i] < TRUST) & (square < (1.0 + v) * (1.0 + v))
        )
        started[i] = started[i] | calm[i]


@splice
def abels(P, starts, targets, tolerance, limit, ahead, planes, status):
    """w and t at the ascending targets >= phi0 of each row, which end at its first infinity; as
    `steps.abels`.

    P (rows, 10) from `flow.coefficients`; targets (rows or 1, n), planes (STATE, rows, n); `ahead` as
    `lockstep_phi.abels` left it, which comes first.
    """
    work, block = np.zeros((ROWS, LANES)), np.zeros(_SIZE)
    T, state, before, fixed, taken, fate = split(work)
    axes = np.zeros((LANES, BOUND_DDG + 1))  # coefficients and bounds in the axes of the lane
    tolerance = min(tolerance, COARSEST)
    row, sizes = np.full(LANES, -1), np.zeros(LANES, dtype=np.int64)
    column, doubt = np.zeros(LANES, dtype=np.int64), np.full(LANES, -1)
    goal = np.zeros(LANES)
    started = np.zeros(LANES, dtype=np.bool_)
    calm = np.zeros(LANES, dtype=np.bool_)
    waiting, free = np.int64(0), True  # a literal 0 would have `_refill` compiled twice
    while True:
        if free:
            for i in range(LANES):
                if row[i] < 0:
                    doubt[i] = -1
            waiting = _refill(
                P, starts, targets, waiting, state, fixed, axes, row, sizes, goal, started, column, ahead,
                planes, status
            )  # fmt: skip
            if not busy(row):
                return
        series(T, state, fixed)
        advance(T, state, before, fixed, taken, fate, tolerance)
        _calm(state, fixed, goal, doubt, started, calm)
        free = False
        for i in range(LANES):
            if row[i] < 0 or (calm[i] and state[STEPS, i] < limit):
                continue
            r, size = row[i], sizes[i]
            column[i], doubt[i], started[i], ending = _pass(
                T, state, before, fixed, axes[i], i, block, row_of(targets, r)[:size], column[i], doubt[i], started[i],
                planes[:, r, :size].T, status[r, :size]
            )  # fmt: skip
            if column[i] < size:
                goal[i] = row_of(targets, r)[column[i]] - fixed[TURN, i]
            if ending == _GOING and state[STEPS, i] >= limit:
                ending = STEP_LIMIT
            if ending != _GOING:
                if ending != OK:
                    conclude(ending, doubt[i], column[i], planes[:, r, :size].T, status[r, :size])
                row[i], free = -1, True
