"""Many solutions of flows that are programs in lock step: over phi while they are far from turning
points, and in time.

All lanes run one program, each with its own numbers, operation by operation (see `program`): series
S[value, order, lane]. Steps, error bounds and what is noted at angles and times are those of
`lockstep_phi` and `lockstep`, which see only the series of f, g, g' and bounds of them. Those hold
on the whole circle where f and g are simple; elsewhere bounds are found for some way ahead, and
steps stay where they hold. On a line phi is counted from its value at the start of the step.

A value that is a polynomial in phi has no orders above its degree, and these are not computed.
"""

import math

import numpy as np

from survey.kernels.cylinder import balls, bounds, lockstep, program
from survey.kernels.cylinder import lockstep_abel as near
from survey.kernels.cylinder import lockstep_phi as far
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.balls import VECTOR
from survey.kernels.cylinder.bounds import ON_DG, ON_F, ON_G
from survey.kernels.cylinder.flow import BOUND_DG, BOUND_F, BOUND_G, TWO_PI, TWO_PI_LOW, reduced
from survey.kernels.cylinder.lockstep import (
    DG,
    F_,
    LANES,
    LOW,
    NEAREST,
    ORDER,
    PDG,
    PF,
    PG,
    PSI,
    RATE,
    SAA,
    SAB,
    SBB,
    SIGN,
    STEPS,
    TIME,
    TIME_LOW,
    TURN,
    TURNS,
    V,
    W,
    coefficients,
    ellipse,
    last_terms,
    variations,
    varied,
)
from survey.kernels.cylinder.program import (
    ADD,
    AT_REST,
    CODE,
    CONSTANT,
    DG_AT,
    DIVIDE,
    F_AT,
    FIRST,
    FORCES,
    FROM,
    G_AT,
    MIRRORED,
    MULTIPLY,
    ON_CIRCLE,
    OPERATIONS,
    OVER,
    PLUS,
    RADIUS,
    REVERSED,
    SECH_SQUARED,
    SECOND,
    SLOTS,
    SUBTRACT,
    TIMES,
    UNLIMITED,
    WIDTH,
    function,
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
    row_of,
    runs_into_node,
    to_target,
    trusted,
    unturned,
    values,
)
from survey.kernels.jit import inline, kernel, part, splice
from survey.kernels.math.newton import bracketed
from survey.kernels.math.roundoff import ROUNDOFF_UP
from survey.kernels.unroll import summed, unroll

GOING = -1  # what has not ended
LEAST_SQUARE = 1e-300  # of a bar: smaller ones would underflow as they are carried on
SERIES = ORDER + 1  # coefficients of a value
# Bounds that a lane holds: what they leave out, the middle of the angles, their half width, and what
# `bounds.bounded` says of these.
LEFT_OUT, CENTRE, REACH, HELD = range(4)
HOLD = HELD + bounds.KNOWN
# of the half width: how far ahead the middle is, and the least way ahead that serves another step
AHEAD, ENOUGH = 0.85, 0.9
# w keeps its sign over a way r if w^2 > ONE_WAY r |g|: it stays above 0.75 w - sqrt(r |g|) > 0 (see
# `bounds.leaving_at_most`)
ONE_WAY = 2.0
FREE = (
    4.0  # |phi| up to which the rounding of phi is counted in every step (see `lockstep.ellipse`)
)


@kernel
def _alike(p, q):
    """Are the programs p and q the same but for their numbers?"""
    same = (
        p[REVERSED] == q[REVERSED] and p[MIRRORED] == q[MIRRORED] and p[ON_CIRCLE] == q[ON_CIRCLE]
    )
    for k in range(SLOTS, DG_AT + 1):
        same &= p[k] == q[k]
    i = OPERATIONS
    while same and i < OPERATIONS + WIDTH * int(p[SLOTS]):
        code = p[i + CODE]
        same = code == q[i + CODE]
        same &= code == CONSTANT or code == OVER or p[i + FIRST] == q[i + FIRST]
        same &= (
            code == CONSTANT or code == PLUS or code == FROM or code == TIMES
            or p[i + SECOND] == q[i + SECOND]
        )  # fmt: skip
        i += WIDTH
    return same


@kernel
def grouped(P):
    """For every row the first row that has the same program."""
    leads = np.empty(len(P), np.int64)
    for r in range(len(P)):
        lead = leads[r - 1] if r else 0  # as a rule, that of the row before
        if not _alike(P[lead], P[r]):
            lead = 0
            while lead < r and not (leads[lead] == lead and _alike(P[lead], P[r])):
                lead += 1
        leads[r] = lead
    return leads


@kernel
def _degrees(operations, of_angle, degree):
    """Fill `degree`: orders of every value above it are 0 where those of phi above `of_angle` are."""
    degree[0] = of_angle
    for i in range(1, len(degree)):
        code, a, b = operations[i, 0], operations[i, 1], operations[i, 2]
        if code == CONSTANT:
            degree[i] = 0
        elif code == ADD or code == SUBTRACT:
            degree[i] = max(degree[a], degree[b])
        elif code == PLUS or code == TIMES or code == FROM:
            degree[i] = degree[a]
        elif code == MULTIPLY:
            degree[i] = min(degree[a] + degree[b], ORDER)
        else:
            degree[i] = ORDER
        if i == len(degree) - 2:
            degree[i] = ORDER  # of w


# Series stand in one flat array, LANES numbers an order, so that LLVM sees which overlap: a, b, o are
# where orders begin in S, x where a number does in N.


@unroll
def _clear(S, o, i):
    S[o + i] = 0.0


@unroll
def _sum(S, a, sign, b, o, i):
    S[o + i] = S[a + i] + sign * S[b + i]


@unroll
def _affine(S, sign, a, N, x, share, o, i):
    S[o + i] = sign * S[a + i] + share * N[x + i]


@unroll
def _scaled(S, a, N, x, o, i):
    S[o + i] = N[x + i] * S[a + i]


@unroll
def _divided(S, sign, a, N, x, share, b, o, i):
    S[o + i] = (sign * S[a + i] + share * N[x + i] - S[o + i]) / S[b + i]


@unroll
def _times(S, K, factor, n, o, i):
    """Multiply by the factor; K is n times as much."""
    value = factor * S[o + i]
    S[o + i], K[o + i] = value, n * value


@unroll
def _term(A, a, B, b, C, o, i):
    C[o + i] = C[o + i] + A[a + i] * B[b + i]


@unroll
def _four_terms(A, a, B, b, C, o, i):
    """Four at once: sums are read and written less often."""
    terms = (A[a + LANES * k + i] * B[b + LANES * (3 - k) + i] for k in range(4))
    C[o + i] = C[o + i] + summed(terms)


@kernel
def _decoded(p, operations):
    """Fill `operations` (values, 3) with code, first and second operand; the last two values are w and
    f w.
    """
    for i in range(len(operations) - 2):
        at = OPERATIONS + WIDTH * i
        code = int(p[at + CODE])
        numbers = code == CONSTANT or code == PLUS or code == TIMES or code == FROM
        operations[i, 0] = code
        operations[i, 1] = 0 if code == CONSTANT or code == OVER else int(p[at + FIRST])
        operations[i, 2] = 0 if numbers else int(p[at + SECOND])
    operations[-1, 0], operations[-1, 1], operations[-1, 2] = (
        MULTIPLY,
        int(p[F_AT]),
        len(operations) - 2,
    )


@splice
def _tables(p, of_angle):
    """(operations, numbers, S, K, degree) of the lanes that run the program p: see `_decoded`,
    `program.note`, `_extend` and `_degrees`.
    """
    slots = max(1, int(p[SLOTS]))
    operations, degree = np.zeros((slots + 2, 3), np.int64), np.zeros(slots + 2, np.int64)
    _decoded(p, operations)
    _degrees(operations, of_angle, degree)
    S = np.zeros((slots + 2) * SERIES * LANES)
    return operations, np.zeros((2 * slots, LANES)), S, np.zeros_like(S), degree


@splice
def _ball_tables(p):
    """The `tables` (points, over, known, out, numbers, centres, radii, lanes) and `hold` of `_bound`."""
    slots = max(1, int(p[SLOTS]))
    points, numbers = np.zeros(slots * 2 * LANES), np.zeros(slots * 2 * LANES)
    over = np.zeros(len(points) * (bounds.DERIVATIVES + 1))
    known, out, lanes = np.zeros(slots, np.bool_), np.empty(bounds.KNOWN), np.zeros(LANES, np.int64)
    tables = points, over, known, out, numbers, np.zeros(LANES), np.zeros(LANES), lanes
    return tables, np.zeros((HOLD, LANES))


@kernel
def _extend(operations, N, degree, S, K, n, first, last, width):
    """Fill S[i, n], order n of the values from `first` to `last` - 1, and K[i, n], n times as much,
    from the lower orders and order n of phi; of the first `width` lanes.

    That is as a rule all of them: a short loop of known length would be unrolled, not vector code.
    """
    share, whole = 1.0 if n == 0 else 0.0, float(n)
    for i in range(first, last):
        if n > degree[i]:
            continue
        code, a, b = operations[i, 0], operations[i, 1], operations[i, 2]
        x, o, factor = 2 * LANES * i, LANES * (SERIES * i + n), 1.0
        one, two = LANES * SERIES * a, LANES * SERIES * b
        if code == CONSTANT:
            for q in range(width):
                _affine(S, 0.0, 0, N, x, share, o, q)
        elif code == ADD or code == SUBTRACT:
            sign = 1.0 if code == ADD else -1.0
            for q in range(width):
                _sum(S, one + LANES * n, sign, two + LANES * n, o, q)
        elif code == PLUS or code == FROM:
            sign = 1.0 if code == PLUS else -1.0
            for q in range(width):
                _affine(S, sign, one + LANES * n, N, x, share, o, q)
        elif code == TIMES:
            for q in range(width):
                _scaled(S, one + LANES * n, N, x, o, q)
        elif code > OVER and n == 0:
            for q in range(width):
                S[o + q] = function(code, S[one + q], N[x + q])
        elif code == SECH_SQUARED:
            for q in range(width):
                _affine(S, -1.0, two + LANES * n, N, x, 0.0, o, q)
        else:  # the sum of A[k] S[n - k] over k
            A, series, other, low, high = S, one, two, n - degree[b], degree[a]
            if code == DIVIDE or code == OVER:
                series, other, low, high = two, LANES * SERIES * i, 1, degree[b]
            elif code > OVER:
                A, factor, low = K, 1.0 / n, max(low, 1)
            for q in range(width):
                _clear(S, o, q)
            k, high = max(low, 0), min(high, n)
            while k + 3 <= high:
                for q in range(width):
                    _four_terms(A, series + LANES * k, S, other + LANES * (n - k - 3), S, o, q)
                k += 4
            while k <= high:
                for q in range(width):
                    _term(A, series + LANES * k, S, other + LANES * (n - k), S, o, q)
                k += 1
            if code == DIVIDE or code == OVER:
                sign, number = (1.0, 0.0) if code == DIVIDE else (0.0, share)
                for q in range(width):
                    _divided(S, sign, one + LANES * n, N, x, number, two, o, q)
        for q in range(width):
            _times(S, K, factor, whole, o, q)


@inline
def _room(hold, q, phi, w):
    """(how far phi of lane q may move until its bounds end, does w keep its sign on that way?)."""
    away, reach = phi - hold[CENTRE, q], hold[REACH, q]
    ahead = reach - (away if w > 0.0 else -away)
    one_way = w * w > ONE_WAY * ahead * hold[HELD + ON_G, q]
    return (ahead if one_way else reach - abs(away)), one_way


@inline
def _rate(hold, q, phi, w):
    """A rate: for the time 1 / rate the angle of lane q stays where its bounds hold."""
    room, one_way = _room(hold, q, phi, w)
    most_f, most_g, room = hold[HELD + ON_F, q], hold[HELD + ON_G, q], max(room, 1e-300)
    if not one_way:
        return bounds.leaving(most_f, most_g, room, abs(w))
    slow = bounds.leaving_at_most(1.05, most_f, most_g, room, abs(w))
    return min(slow, bounds.leaving_at_most(1.25, most_f, most_g, room, abs(w)))


@inline
def _serves(hold, q, phi, w):
    """Do the bounds of lane q hold for a step from here that is not short, with little left out?"""
    reach = hold[REACH, q]
    if not abs(phi - hold[CENTRE, q]) <= reach:
        return False
    room, _one_way = _room(hold, q, phi, w)
    f, more_f = hold[HELD + bounds.SHOWN_F, q], hold[HELD + bounds.MORE_F, q]
    g, more_g = hold[HELD + bounds.SHOWN_G, q], hold[HELD + bounds.MORE_G, q]
    return room > ENOUGH * reach and bounds.hidden(f, more_f, g, more_g, reach, w) <= 1.0


@splice
def _bound(p, N, phi, w, row, tables, hold):
    """Find bounds of f, g, g', g'' for the busy lanes whose last ones no longer serve, about phi or an
    angle ahead of it, and keep them in `hold`; the radius follows from what the last ones left out (see
    `bounds.bounded`).
    """
    points, over, known, out, numbers, centres, radii, lanes = tables
    none, count = np.zeros(LANES), 0
    for q in range(LANES):
        if row[q] >= 0 and not _serves(hold, q, phi[q], w[q]):
            radius = hold[REACH, q] * bounds.wider(hold[LEFT_OUT, q])
            hold[REACH, q], lanes[count] = min(radius, 1.0 + abs(phi[q])), q
            count += 1
    while count > 0:
        for j in range(count):
            q = lanes[j]
            radius, speed = hold[REACH, q], abs(w[q])
            one_way = speed * speed > ONE_WAY * 2.0 * radius * hold[HELD + ON_G, q]
            shift = (AHEAD if w[q] > 0.0 else -AHEAD) * radius if one_way else 0.0
            centres[j], radii[j], hold[CENTRE, q] = phi[q] + shift, radius, phi[q] + shift
            for k in range(0, len(N), LANES):
                numbers[k + j] = N[k + q]
        balls.balls(p, numbers, known, centres[:count], none, points)
        balls.balls(p, numbers, known, centres[:count], radii, over)
        left = 0
        for j in range(count):
            q = lanes[j]
            left_out = bounds.bounded(p, points, over, j, radii[j], w[q], out)
            hold[LEFT_OUT, q] = left_out
            for k in range(len(out)):
                hold[HELD + k, q] = out[k]
            if left_out > 1.0:
                hold[REACH, q] *= min(bounds.wider(left_out), 0.9)
                lanes[left], left = q, left + 1
        count = left


@unroll
def _onward(S, K, sign, side, r, x, g, w, fw, i):
    """The next order of phi and w, in S from x, w on."""
    times = side * S[w + i]
    K[x + LANES + i], S[x + LANES + i] = times, times * r
    S[w + LANES + i] = (sign * S[fw + i] + side * S[g + i]) * r


@splice
def _in_time(p, operations, N, degree, S, K, T, phi, speed, width):
    """Fill the rows W, F_ and DG of T with the series in time through phi and w = speed (LANES)."""
    forces, slots, step = max(1, int(p[FORCES])), len(degree) - 2, LANES * SERIES
    f, g, dg, w = step * int(p[F_AT]), step * int(p[G_AT]), step * int(p[DG_AT]), step * slots
    sign, side = p[REVERSED], p[MIRRORED]
    for q in range(width):
        S[q], K[q], S[w + q] = side * phi[q], 0.0, speed[q]
    for n in range(ORDER):
        _extend(operations, N, degree, S, K, n, 1, forces, width)
        _extend(operations, N, degree, S, K, n, slots + 1, slots + 2, width)
        at = LANES * n
        for q in range(width):
            _onward(S, K, sign, side, 1.0 / (n + 1), at, g + at, w + at, w + step + at, q)
    for n in range(ORDER + 1):
        for q in range(width):
            T[W + n, q] = S[w + LANES * n + q]
    for n in range(LOW + 1):
        _extend(operations, N, degree, S, K, n, forces, slots, width)
        for q in range(width):
            T[F_ + n, q], T[DG + n, q] = sign * S[f + LANES * n + q], S[dg + LANES * n + q]


@splice
def _begin(circle, state, fixed, phi):
    """Take whole turns out of psi, or on a line have psi count from the angle `phi` of the lane."""
    for i in range(LANES):
        psi = state[PSI, i]
        if circle:
            k = (psi * (1.0 / TWO_PI) + NEAREST) - NEAREST
            psi = (psi - k * TWO_PI) - k * TWO_PI_LOW
            state[PSI, i], phi[i] = psi, psi
            state[TURNS, i] += k
            continue
        phi[i] = fixed[TURN, i] + psi
        if abs(phi[i]) <= FREE:
            state[PSI, i], fixed[TURN, i] = phi[i], 0.0
        else:  # its rounding is one more term of the error
            slip = ROUNDOFF_UP * abs(phi[i])
            state[SAA, i] += slip * slip
            state[STEPS, i] += 1.0
            state[PSI, i], fixed[TURN, i] = 0.0, phi[i]


@splice
def _stay(state, fixed, phi, hold):
    """Note the bounds, that of g' raised so that `lockstep.advance` stays where they hold."""
    for i in range(LANES):
        rate = _rate(hold, i, phi[i], state[V, i])
        fixed[PF, i], fixed[PG, i] = hold[HELD + ON_F, i], hold[HELD + ON_G, i]
        fixed[PDG, i] = max(hold[HELD + ON_DG, i], rate * rate)


@splice
def _hold_nothing(hold, i):
    """Lane i begins with no bounds."""
    for k in range(HOLD):
        hold[k, i] = 0.0
    hold[CENTRE, i], hold[REACH, i] = math.inf, 1.0


@splice
def _enter(
    P, leads, lead, starts, times, waiting, state, fixed, numbers, hold, row, column, sizes, status
):  # fmt: skip
    """Give free lanes the rows of the program `lead` that wait; returns the first that still waits."""
    circle = P[lead, ON_CIRCLE] > 0.0
    for i in range(LANES):
        while waiting < len(P) and row[i] < 0:
            if leads[waiting] != lead:
                waiting += 1
                continue
            size = finite(times[waiting])
            if size == 0:
                status[waiting] = OK
            else:
                p, w0 = P[waiting], starts[waiting, rc.START_W]
                rest, turns = starts[waiting, rc.START_PHI], 0.0
                if circle:
                    rest, turns = reduced(rest)
                for k in range(len(state)):
                    state[k, i] = 0.0
                state[PSI, i], state[TURNS, i], state[V, i] = rest, turns, w0
                slip = ROUNDOFF_UP * 4.0 * (turns != 0.0)
                state[SAA, i], state[RATE, i] = slip * slip, 1.0 + abs(w0)
                if w0 == 0.0 and p[AT_REST] == 0.0:
                    state[SBB, i] = LEAST_SQUARE  # g may have underflowed
                fixed[PF, i], fixed[PG, i], fixed[PDG, i] = p[BOUND_F], p[BOUND_G], p[BOUND_DG]
                fixed[TURN, i] = 0.0
                _hold_nothing(hold, i)
                program.note(p, numbers, i, i + 1)
                fixed[lockstep.NEXT, i], row[i], column[i] = times[waiting, 0], waiting, 0
                sizes[i] = size
            waiting += 1
    return waiting


@kernel
def trajectories(P, leads, lead, starts, times, tolerance, limit, planes, turnings, status):
    """As `lockstep.trajectories`, of the rows of P that have the program `lead`: see `grouped`."""
    work = np.zeros((lockstep.ROWS, LANES))
    T, state, before, fixed, taken, fate = lockstep.split(work)
    flat, p, tolerance = work.reshape(-1), P[lead], min(tolerance, lockstep.COARSEST)
    circle, limited = p[ON_CIRCLE] > 0.0, p[RADIUS] < UNLIMITED
    operations, numbers, S, K, degree = _tables(p, ORDER)
    N, width = numbers.ravel(), min(LANES, (len(P) - lead + VECTOR - 1) // VECTOR * VECTOR)
    phi = np.zeros(LANES)
    tables, hold = _ball_tables(p)
    fixed[lockstep.NEXT, :] = math.inf  # of lanes that stay free, too
    row, sizes = np.full(LANES, -1), np.zeros(LANES, dtype=np.int64)
    column = np.zeros(LANES, dtype=np.int64)
    waiting, free = np.int64(lead), True
    while True:
        if free:
            waiting = _enter(
                P, leads, lead, starts, times, waiting, state, fixed, numbers, hold, row, column, sizes, status
            )  # fmt: skip
            if not lockstep.busy(row):
                return
        _begin(circle, state, fixed, phi)
        if limited:
            _bound(p, N, phi, state[V], row, tables, hold)
            _stay(state, fixed, phi, hold)
        _in_time(p, operations, N, degree, S, K, T, phi, state[V], width)
        for i in range(LANES):
            lockstep.vary_lane(T, i)
        for i in range(LANES):
            if state[SIGN, i] == 0.0 and state[STEPS, i] <= 1.0:
                start = state[V, i] if state[V, i] != 0.0 else T[W + 1, i]
                still = state[V, i] == 0.0 and abs(start) <= 8.0 * ROUNDOFF_UP * fixed[PG, i]
                state[SIGN, i] = 0.0 if still else (1.0 if start > 0.0 else -1.0)
        lockstep.advance(T, state, before, fixed, taken, fate, tolerance)
        lockstep.note_turnings(state)
        free = False
        if lockstep.due(row, fate, state, limit):
            lockstep.record(flat, times, row, column, sizes, planes, turnings)
            free = lockstep.free(
                limit, times, row, column, sizes, state, fixed, fate, planes, status
            )


@splice
def _in_angle(p, operations, N, degree, S, K, phi, w, forms, width):
    """Fill `forms` (2 ORDER, LANES) with the series of f / w and g / w^2 in the angle from phi on."""
    forces, step = max(1, int(p[FORCES])), LANES * SERIES
    f, g, sign, side = step * int(p[F_AT]), step * int(p[G_AT]), p[REVERSED], p[MIRRORED]
    for q in range(width):
        S[q], S[LANES + q], K[q], K[LANES + q] = side * phi[q], side, 0.0, side
    for n in range(far.ORDER):
        _extend(operations, N, degree, S, K, n, 1, forces, width)
        for q in range(width):
            inverse = 1.0 / w[q]
            forms[n, q] = sign * S[f + LANES * n + q] * inverse
            forms[far.ORDER + n, q] = side * S[g + LANES * n + q] * (inverse * inverse)


@splice
def _enter_far(
    P, leads, lead, starts, targets, planes, status, timed, waiting, state, fixed, numbers, hold, row,
    sizes, goal,
):  # fmt: skip
    """Give free lanes the rows of the program `lead` that wait, whose status is OK at first; returns
    the first that still waits. Of rows that do not begin here nothing is known yet.
    """
    circle = P[lead, ON_CIRCLE] > 0.0
    for i in range(LANES):
        while waiting < len(P) and row[i] < 0:
            p, w0 = P[waiting], starts[waiting, rc.START_W]
            own = row_of(targets, waiting)
            begun = leads[waiting] != lead
            if leads[waiting] == lead and math.isfinite(own[0]) and w0 > 0.0:
                phi, turns = starts[waiting, rc.START_PHI], 0.0
                if circle:
                    phi, turns = reduced(phi)
                slip = (4.0 * ROUNDOFF_UP) * (turns != 0.0)
                bend = p[BOUND_F] + p[BOUND_G] / w0 if circle else 1.0
                bound = slip * bend
                # on a line the first step will show
                if not circle or far._far(w0, bound, p[BOUND_G]):
                    for k in range(far.STATE):
                        state[k, i] = 0.0
                    fixed[BOUND_F, i], fixed[BOUND_G, i] = p[BOUND_F], p[BOUND_G]
                    state[far.AT, i], state[far.TURNED, i], state[far.W, i] = phi, turns, w0
                    state[far.RATE, i] = 2.0 + bend / w0
                    state[far.W_BOUND, i], state[far.T_BOUND, i] = bound, slip / w0
                    program.note(p, numbers, i, i + 1)
                    row[i] = waiting
                    _hold_nothing(hold, i)
                    sizes[i], goal[i] = finite(own), own[0]
                    for k in range(sizes[i]):
                        status[waiting, k] = OK
                    begun = True
            if not begun:
                far.nothing(planes, waiting, 0, timed)
            waiting += 1
        if row[i] < 0:
            state[far.AT, i], state[far.W, i] = 0.0, 1.0  # a free lane moves too
    return waiting


_expand = far.expansion(far.given)


@kernel
def abels(P, leads, lead, starts, targets, tolerance, limit, ahead, planes, status, timed):
    """As `lockstep_phi.abels`, of the rows of P that have the program `lead`."""
    p, tolerance = P[lead], min(tolerance, lockstep.COARSEST)
    circle, limited = p[ON_CIRCLE] > 0.0, p[RADIUS] < UNLIMITED
    work = np.zeros((far.ROWS, LANES))
    T, state, before = (
        work[: far.AFTER],
        work[far.AFTER : far.BEFORE],
        work[far.BEFORE : far.OF_STEP],
    )
    step, fixed, flat = work[far.OF_STEP : far.WHAT_STAYS], work[far.WHAT_STAYS :], work.reshape(-1)
    operations, numbers, S, K, degree = _tables(p, 1)
    N, width = numbers.ravel(), min(LANES, (len(P) - lead + VECTOR - 1) // VECTOR * VECTOR)
    forms = np.zeros((2 * far.ORDER, LANES))
    tables, hold = _ball_tables(p)
    row, sizes = np.full(LANES, -1), np.zeros(LANES, np.int64)
    goal = np.zeros(LANES)
    waiting, free, ended = np.int64(lead), True, np.zeros(LANES, dtype=np.bool_)
    while True:
        if free:
            waiting = _enter_far(
                P, leads, lead, starts, targets, planes, status, timed, waiting, state, fixed, numbers, hold,
                row, sizes, goal
            )  # fmt: skip
            if not lockstep.busy(row):
                return
        if circle:
            for i in range(LANES):
                psi = state[far.AT, i]
                k = (psi * (1.0 / TWO_PI) + NEAREST) - NEAREST
                state[far.AT, i] = (psi - k * TWO_PI) - k * TWO_PI_LOW
                state[far.TURNED, i] += k
                # what that rounds shifts the solution
                slip = (4.0 * ROUNDOFF_UP) * abs(k)
                state[far.W_BOUND, i] += slip * (
                    fixed[BOUND_F, i] + fixed[BOUND_G, i] / state[far.W, i]
                )
                state[far.T_BOUND, i] += slip / state[far.W, i]
        if limited:
            _bound(p, N, state[far.AT], state[far.W], row, tables, hold)
            for i in range(LANES):
                # a step of at most 0.8 of what is left, on which series fall: see `lockstep_phi._advance`
                left = hold[CENTRE, i] + hold[REACH, i] - state[far.AT, i]
                fixed[BOUND_F, i] = max(hold[HELD + ON_F, i], 0.625 * state[far.W, i] / left)
                fixed[BOUND_G, i] = hold[HELD + ON_G, i]
        _in_angle(p, operations, N, degree, S, K, state[far.AT], state[far.W], forms, width)
        for n in range(far.ORDER):
            for i in range(LANES):
                T[far.F_ + n, i], T[far.G_ + n, i] = forms[n, i], forms[far.ORDER + n, i]
        _expand(T)
        far._advance(T, state, before, step, fixed, tolerance)
        for i in range(LANES):
            x = state[far.AT, i] + state[far.TURNED, i] * TWO_PI
            near = not (x + 1e-9 * (1.0 + abs(x)) < goal[i])
            ended[i] = (
                near
                | (not far._far(state[far.W, i], state[far.W_BOUND, i], fixed[BOUND_G, i]))
                | (state[far.COUNT, i] >= limit)
            )
        free = False
        for i in range(LANES):
            if row[i] < 0 or not ended[i]:
                continue
            k, w, bound = row[i], state[far.W, i], state[far.W_BOUND, i]
            sound = math.isfinite(w) and bound < far.SURE * w
            size, j = sizes[i], int(state[far.COLUMN, i])
            if sound:
                j = far.record(flat, i, targets, k, j, size, planes, timed)
            if j < size and sound and far._far(w, bound, fixed[BOUND_G, i]):
                if state[far.COUNT, i] < limit:
                    state[far.COLUMN, i], goal[i] = j, row_of(targets, k)[j]
                    continue
            far.nothing(planes, k, j, timed)
            for n in range(far.STATE):
                ahead[k, n] = state[n, i] if sound else before[n, i]
            ahead[k, far.COLUMN] = j
            if j < size and state[far.COUNT, i] >= limit:
                far.stop(j, size, status[k])
                ahead[k, far.COLUMN] = size
            row[i], free = -1, True


@unroll
def _damping(series_of, dt):
    """f at dt."""
    return lockstep.polynomial(series_of[4 * (LOW + 1) : 5 * (LOW + 1)], dt)


@kernel
def cross(T, state, before, fixed, i, reach, total, end, block, size):
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
    most_f, most_g = fixed[PF, i], fixed[PG, i]
    ends = last_terms(T, i)
    # psi is nearly the cubic with these w, and these w', at both ends
    bulge = 6.0 * total / reach - 3.0 * (w + end)
    first, last = ((end - w) + bulge) / reach, ((end - w) - bulge) / reach
    for j in range(near.BLOCK):
        rise = max(block[near.GOAL + j] - psi, 0.0)
        rest = max(total - rise, 0.0)
        since, left = near._coast(w, first, rise), near._coast(end, -last, rest)
        dt = max(min(since if rise < rest else reach - left, reach), 0.0)
        block[near.DT + j] = near._nearer(c, rise, dt, reach)[0]
    for _ in range(near.NEWTON):
        for j in range(near.BLOCK):
            block[near.DT + j], v, miss = near._nearer(
                c, block[near.GOAL + j] - psi, block[near.DT + j], reach
            )
            # what two more steps leave of psi is to be less than a share of its rounding
            left, speed = miss * miss * (most_f * v + most_g), v * v
            block[near.MISS + j] = (
                left * left * (most_f * v + most_g) - 1e-17 * speed * speed * speed
            )
    for j in range(size):
        if not block[near.MISS + j] <= 0.0:
            given = (0.0, (psi, c), block[near.GOAL + j], True)
            narrow = (1e-17 + 2e-16 * reach, 0.0)
            block[near.DT + j] = bracketed(
                to_target, near._at, given, block[near.DT + j], (0.0, reach), narrow, 60
            )[1]
    for j in range(near.BLOCK):
        dt = block[near.DT + j]
        x, v = lockstep.moved(c, dt)
        x += psi
        a, b, d = ellipse(carried, varied(vary, dt), dt, v, ends, most_f, most_g)
        a += block[near.SQUARE + j] + (4e-16 * dt * v) * (4e-16 * dt * v)
        _v, slope = near._slowing(c, dt)
        f = _damping(vary, dt)
        more = min(max((block[near.GOAL + j] - x) / max(v, 1e-300), -dt), reach - dt)
        g = slope - f * v
        v, dt = v + more * slope, dt + more
        value, time, value_bar, time_bar = crossing(n, v, t + (dt + t_low), a, b, d, f, g)
        block[near.VALUE + j], block[near.TIMES + j] = value, time
        block[near.VALUE_BAR + j], block[near.TIME_BAR + j] = value_bar, time_bar
        block[near.SQUARE + j] = a


@part
def _pass(p, T, state, before, fixed, delay, i, block, targets, j, doubt, started, floats, status):
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
            near._to_rest,
            near._at,
            c,
            reach * before[V, i] / (before[V, i] - v1),
            (0.0, reach),
            (1e-17 + 4e-16 * reach, 0.0),
            60,
        )[1]
        x, v1 = lockstep.moved(c, reach)
        x1 = before[PSI, i] + x
        carried = before[SAA, i], before[SAB, i], before[SBB, i]
        jacobian = varied(variations(T, i), reach)
        saa, _sab, sbb = ellipse(
            carried, jacobian, reach, v1, last_terms(T, i), fixed[PF, i], fixed[PG, i]
        )
    while j < size and unturned(targets[j], turns) - angle <= x1:
        count = 0
        while (
            count < near.BLOCK
            and j + count < size
            and unturned(targets[j + count], turns) - angle <= x1
        ):
            target = targets[j + count]
            block[near.GOAL + count] = unturned(target, turns) - angle
            block[near.SQUARE + count] = (3e-16 * target) ** 2 + (2e-16 * angle) ** 2
            count += 1
        for k in range(count, near.BLOCK):
            block[near.GOAL + k], block[near.SQUARE + k] = block[near.GOAL + count - 1], 0.0
        cross(T, state, before, fixed, i, reach, x1 - before[PSI, i], v1, block, count)
        for k in range(count):
            row = floats[j]
            row[rc.VALUE], row[rc.TIME] = block[near.VALUE + k], block[near.TIMES + k]
            row[rc.VALUE_BAR], row[rc.TIME_BAR] = (
                block[near.VALUE_BAR + k],
                block[near.TIME_BAR + k] + delay,
            )
            usable = bar(n, block[near.SQUARE + k]) < TRUST and row[rc.VALUE_BAR] < TRUST * (
                1.0 + abs(row[rc.VALUE])
            )
            usable = usable and row[rc.TIME_BAR] < TRUST * (1.0 + row[rc.TIME])
            status[j] = OK if usable else NO_CONVERGENCE
            if doubt < 0 and not certain(row):
                doubt = j
            j += 1
    bar_phi, bar_w = bar(n, saa), bar(n, sbb)
    edge = bar_phi * 1.1 + 4e-16 * abs(x1 + turns * TWO_PI) + 2e-16 * abs(angle)
    # from here on a turning point lies beyond x1
    while doubt >= 0 and doubt < j and x1 - (unturned(targets[doubt], turns) - angle) > edge:
        doubt += 1
    if doubt == j:
        doubt = -1
    if turned:
        ending = TURNING if clean_turning(p, x1 + angle, bar_phi, bar_w) else SEPARATRIX
        t = before[TIME, i]
        bar_t = bar_w / abs(values(p, x1 + angle)[1]) + 3e-16 * t if ending == TURNING else 0.0
        for k in range(doubt if doubt >= 0 else j, size):
            if k >= j or not certain(floats[k]):
                status[k] = ending
                floats[k, rc.VALUE] = (x1 + angle) + turns * TWO_PI
                floats[k, rc.TIME] = t + (reach + before[TIME_LOW, i])
                floats[k, rc.VALUE_BAR] = edge + 4e-16 * abs(floats[k, rc.VALUE])
                floats[k, rc.TIME_BAR] = bar_t * 1.2 + delay
        return size, -1, started, OK
    if not trusted(saa, sbb, v1):
        return j, doubt, started, NO_CONVERGENCE
    if started and not v1 > 2.0 * bar_w:
        return j, doubt, started, SEPARATRIX
    started = started or v1 > 2.0 * bar_w
    if j < size and runs_into_node(p, x1 + angle, v1, unturned(targets[j], turns), 0.0):
        return j, doubt, started, EQUILIBRIUM
    return j, doubt, started, (GOING if j < size or doubt >= 0 else OK)


@splice
def _calm(T, state, before, fixed, goal, doubt, started, calm):
    """Where a step has passed no target and is far from any ending: as `lockstep_abel._calm`, with f,
    g and g' from the series of the step.
    """
    for i in range(LANES):
        v, square, dt = state[V, i], state[SBB, i], 1.0 / state[RATE, i]
        c, vary = coefficients(T, i), lockstep.variations(T, i)
        most_f, most_g = fixed[PF, i], fixed[PG, i]
        f, (_v, slope) = _damping(vary, dt), near._slowing(c, dt)
        g = slope - f * v
        x = (state[PSI, i] + fixed[TURN, i]) + state[TURNS, i] * TWO_PI
        no_node = (v * most_f > 0.31 * most_g) | (f > 1e-3 * most_f) | (g < -1e-3 * most_g)
        quiet = (x + 1e-9 * (1.0 + abs(x)) < goal[i]) & no_node
        quiet = quiet & (v * v > 9.0 * state[STEPS, i] * square) & (v > 0.0)
        calm[i] = (
            quiet & (doubt[i] < 0) & (state[SAA, i] < TRUST) & (square < (1.0 + v) * (1.0 + v))
        )
        started[i] = started[i] | calm[i]


@splice
def _enter_near(
    P, leads, lead, starts, targets, waiting, state, fixed, numbers, hold, row, sizes, goal,
    started, column, delay, ahead, planes, status,
):  # fmt: skip
    """Give free lanes the rows of the program `lead` that wait; returns the first that still waits."""
    for i in range(LANES):
        while waiting < len(P) and row[i] < 0:
            r, p = waiting, P[waiting]
            waiting += 1
            phi0, w0, size = (
                starts[r, rc.START_PHI],
                starts[r, rc.START_W],
                finite(row_of(targets, r)),
            )
            begun = ahead[r, far.W] > 0.0
            first = int(ahead[r, far.COLUMN]) if begun else 0
            if leads[r] != lead or first >= size:
                continue
            phi, turns = phi0, 0.0
            if p[ON_CIRCLE] > 0.0:
                phi, turns = reduced(phi0)
            elif w0 == 0.0:
                bounds.bound_near(p, phi0, w0)
            at, rows, codes = row_of(targets, r)[:size], planes[:, r, :size].T, status[r, :size]
            if not begun and at_rest(p, phi, phi0, w0, at, rows, codes):
                continue
            for k in range(len(state)):
                state[k, i] = 0.0
            slip, own, fixed[TURN, i] = ROUNDOFF_UP * 4.0 * (turns != 0.0), w0, 0.0
            state[PSI, i], state[TURNS, i], state[SAA, i], delay[i] = phi, turns, slip * slip, 0.0
            if begun:  # at an exact angle
                own, delay[i] = ahead[r, far.W], ahead[r, far.T_BOUND]
                state[PSI, i], state[TURNS, i] = ahead[r, far.AT], ahead[r, far.TURNED]
                state[TIME, i], state[TIME_LOW, i] = ahead[r, far.TIME], ahead[r, far.TIME_LOW]
                state[SAA, i], state[SBB, i] = 0.0, ahead[r, far.W_BOUND] * ahead[r, far.W_BOUND]
                state[STEPS, i] = 1.0
            state[V, i], state[RATE, i] = own, 1.0 + own
            _hold_nothing(hold, i)
            fixed[PF, i], fixed[PG, i], fixed[PDG, i] = p[BOUND_F], p[BOUND_G], p[BOUND_DG]
            fixed[lockstep.NEXT, i] = math.inf
            program.note(p, numbers, i, i + 1)
            row[i], sizes[i], column[i], started[i] = r, size, first, own > 0.0
            goal[i] = row_of(targets, r)[first]
    return waiting


@kernel
def abels_near(P, leads, lead, starts, targets, tolerance, limit, ahead, planes, status):
    """As `lockstep_abel.abels`, of the rows of P that have the program `lead`; on a line they are left
    with bounds of some place.
    """
    work, block = np.zeros((lockstep.ROWS, LANES)), np.zeros(8 * near.BLOCK)
    T, state, before, fixed, taken, fate = lockstep.split(work)
    p, tolerance = P[lead].copy(), min(tolerance, lockstep.COARSEST)
    circle, limited = p[ON_CIRCLE] > 0.0, p[RADIUS] < UNLIMITED
    operations, numbers, S, K, degree = _tables(p, ORDER)
    N, width = numbers.ravel(), min(LANES, (len(P) - lead + VECTOR - 1) // VECTOR * VECTOR)
    phi = np.zeros(LANES)
    tables, hold = _ball_tables(p)
    row, sizes, column = np.full(LANES, -1), np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    doubt, goal, delay = np.full(LANES, -1), np.zeros(LANES), np.zeros(LANES)
    started, calm = np.zeros(LANES, np.bool_), np.zeros(LANES, np.bool_)
    waiting, free = np.int64(lead), True
    while True:
        if free:
            for i in range(LANES):
                if row[i] < 0:
                    doubt[i] = -1
            waiting = _enter_near(
                P, leads, lead, starts, targets, waiting, state, fixed, numbers, hold, row, sizes, goal,
                started, column, delay, ahead, planes, status
            )  # fmt: skip
            if not lockstep.busy(row):
                return
        _begin(circle, state, fixed, phi)
        if limited:
            _bound(p, N, phi, state[V], row, tables, hold)
            _stay(state, fixed, phi, hold)
        _in_time(p, operations, N, degree, S, K, T, phi, state[V], width)
        for i in range(LANES):
            lockstep.vary_lane(T, i)
        lockstep.advance(T, state, before, fixed, taken, fate, tolerance)
        _calm(T, state, before, fixed, goal, doubt, started, calm)
        free = False
        for i in range(LANES):
            if row[i] < 0 or (calm[i] and state[STEPS, i] < limit):
                continue
            r, size = row[i], sizes[i]
            own = P[r]
            if not circle:  # how far ahead the bounds hold, and these
                end = state[PSI, i] + fixed[TURN, i]
                own[RADIUS] = max(hold[CENTRE, i] + hold[REACH, i] - end, 0.0)
                for k in range(bounds.BOUNDS):
                    own[BOUND_F + k] = hold[HELD + k, i]
            column[i], doubt[i], started[i], ending = _pass(
                own, T, state, before, fixed, delay[i], i, block, row_of(targets, r)[:size], column[i], doubt[i],
                started[i], planes[:, r, :size].T, status[r, :size]
            )  # fmt: skip
            if column[i] < size:
                goal[i] = row_of(targets, r)[column[i]]
            if ending == GOING and state[STEPS, i] >= limit:
                ending = STEP_LIMIT
            if ending != GOING:
                if ending != OK:
                    conclude(ending, doubt[i], column[i], planes[:, r, :size].T, status[r, :size])
                row[i], free = -1, True
