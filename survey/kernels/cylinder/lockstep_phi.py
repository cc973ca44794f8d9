"""Solutions w(phi) of Abel's equation (57) for many systems in lock step, while they are far from
turning points.

There phi is the better variable. In units of w = w0 at the start of a step, from which s = psi -
psi0 counts,

    w = w0 omega,  omega q = g / w0^2,  omega' = f / w0 + q,  omega r = 1,  t' = r / w0          (57),

with f and g in closed form: two Cauchy products, where the motion in time has three (see
`lockstep`); psi is phi less whole turns. A value at an angle is a polynomial, without Newton's
method. The variational equation has one component:

    (dw)' = -(g / w^2) dw,  (dt)' = -dw / w^2,

and bounds of both errors are carried on by sums of positive terms. A solution leaves where w^2 is
small or its bound is not; `lockstep_abel` goes on with it from there.
"""

import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import (
    B12,
    B31,
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
    FALL,
    LANES,
    NEAREST,
    SHORT,
    busy,
    convolved,
    left_out,
    polynomial,
    sine_cosine,
)
from survey.kernels.cylinder.steps import OK, STEP_LIMIT, finite, row_of, unturned
from survey.kernels.jit import inline, kernel, splice
from survey.kernels.math.roots import sixteenth_root
from survey.kernels.math.roundoff import ROUNDOFF_UP
from survey.kernels.unroll import (
    consecutive,
    counted,
    fma,
    largest,
    put,
    selected,
    spread,
    unroll,
)

ORDER = 16
VARIED = 6  # order of the series of g / w^2, which is integrated
# Rows of the series: f / w0 and g / w0^2, or what they are made of; omega, q, r, and the integral of r.
F_, G_, OMEGA = 0, ORDER, 2 * ORDER
Q, R = OMEGA + ORDER + 1, OMEGA + 2 * ORDER + 1
INTEGRAL = R + ORDER + 1
TABLE = INTEGRAL + ORDER + 1
# Rows of a state: where the solution stands, its error bounds, the next target, and 1 / the last
# step.
(AT, TURNED, W, TIME, TIME_LOW, W_BOUND, T_BOUND, COUNT, COLUMN, RATE) = range(10)
STATE = 10
FIXED = BOUND_G + 1  # rows of what stays fixed: as the columns of `flow.coefficients`
# Of a step: the error bound of w at its targets, a lower bound of w, an upper bound of |dw/dphi|, its length, 1 / w
# at its start, and what the series of w and of the time leave out.
W_WITHIN, LOWEST, STEEPEST, H, INVERSE, CUT, CUT_TIME = range(7)
STEP = 7
# Where the tables begin in the work space of all lanes: the series, the states after and before the
# step, the step, and what stays fixed.
AFTER = TABLE
BEFORE = AFTER + STATE
OF_STEP = BEFORE + STATE
WHAT_STAYS = OF_STEP + STEP
ROWS = WHAT_STAYS + FIXED
_END, _TURNS = LANES * (AFTER + AT), LANES * (BEFORE + TURNED)  # in one row
FAR = 2.0  # phi is the variable while w^2 is greater than this times the bound of |g|, ...
SURE = 1e-3  # and while the error bound of w is smaller than this share of it
BLOCK = 16  # targets at once: two vectors


@unroll
def _functions(T, fixed, i, s, c, inverse):
    """The first two coefficients of f / w0 and of both harmonics of g / w0^2, from sin and cos of psi
    and 1 / w0.
    """
    b12, b31, d, c23, s2, s3 = (fixed[row, i] for row in (B12, B31, D, C23, S2, S3))
    f = [(b12 * c - b31 * s) * inverse, -(b12 * s + b31 * c) * inverse]
    square = inverse * inverse
    one = [(s2 * c - s3 * s) * square, -(s2 * s + s3 * c) * square]
    product, double = s * c, (c - s) * (c + s)  # sin 2 psi / 2 and cos 2 psi
    two = [-(d * product + c23 * double) * square, (4.0 * c23 * product - d * double) * square]
    for n in range(2):
        T[F_ + n, i], T[G_ + n, i], T[G_ + 2 + n, i] = f[n], one[n], two[n]


def _of_harmonics(T, i, first, last):
    """The coefficients `first` to `last` - 1 of f / w0 and g / w0^2, from `_functions`."""
    f, one, two = ([T[row, i], T[row + 1, i]] for row in (F_, G_, G_ + 2))
    shares = {n: (-1.0) ** (n // 2) / math.factorial(n) for n in range(first, last)}
    return {n: share * f[n % 2] for n, share in shares.items()}, {
        n: share * one[n % 2] + share * 4.0 ** (n // 2) * two[n % 2] for n, share in shares.items()
    }


def given(T, i, first, last):
    """Likewise, where they are in the rows F_ and G_ themselves."""
    return tuple({n: T[row + n, i] for n in range(first, last)} for row in (F_, G_))


def _orders(first, last, functions):
    """What adds the coefficients `first` to `last` - 1 of q, and those one higher of omega, of a lane."""

    @unroll
    def expand(T, i):
        f, g = functions(T, i, first, last)
        omega, q = [T[OMEGA + n, i] for n in range(first + 1)], [T[Q + n, i] for n in range(first)]
        for n in range(first, last, 2):
            rest = _less_two(g[n], g[n + 1], omega, q, n, n)
            for m, value in zip((n, n + 1), rest, strict=True):
                if m > n:  # what waits for the latest coefficients comes last
                    value = fma(-omega[m], q[0], value)
                    if n:
                        value = fma(-omega[1], q[n], value)
                q.append(value)
                omega.append((f[m] + value) * (1.0 / (m + 1)))
                T[Q + m, i], T[OMEGA + m + 1, i] = q[m], omega[m + 1]

    return expand


def _less_two(one, two, a, b, n, last):
    """`one` less a[k] b[n - k] for k from 1 to n, and `two` less a[k] b[n + 1 - k] for k from 2 to `last`: both at
    once, since they take the same coefficients, and the latest of these last.
    """
    for k in sorted(range(1, max(n, last) + 1), key=lambda k: max(k, n - k)):
        if k <= n:
            one = fma(-a[k], b[n - k], one)
        if 2 <= k <= last:
            two = fma(-a[k], b[n + 1 - k], two)
    return one, two


def _inverses(first, last):
    """What adds the coefficients `first` + 1 to `last` of r, and of its integral, of a lane."""

    @unroll
    def expand(T, i):
        omega, r = (
            [T[OMEGA + n, i] for n in range(last + 1)],
            [T[R + n, i] for n in range(first + 1)],
        )
        for n in range(first + 1, last + 1, 2):
            one, two = _less_two(0.0, 0.0, omega, r, n, n + 1)
            r += [one, fma(-omega[1], one, two)]
            for m in (n, n + 1):
                T[R + m, i], T[INTEGRAL + m, i] = r[m], r[m] * (1.0 / (m + 1))

    return expand


def expansion(functions):
    """What fills omega, q, r and its integral of all lanes, from what `functions` makes of F_ and G_.

    In several loops, since one has more numbers than there are registers.
    """
    low, middle, high = (_orders(*ends, functions) for ends in ((0, 8), (8, 12), (12, ORDER)))
    low_inverses, high_inverses = _inverses(0, 10), _inverses(10, ORDER)

    @inline
    def expand(T):
        for i in range(LANES):
            T[OMEGA, i], T[R, i], T[INTEGRAL, i] = 1.0, 1.0, 1.0
        for i in range(LANES):
            low(T, i)
        for i in range(LANES):
            middle(T, i)
        for i in range(LANES):
            high(T, i)
        for i in range(LANES):
            low_inverses(T, i)
        for i in range(LANES):
            high_inverses(T, i)

    return expand


_expand = expansion(_of_harmonics)


@inline
def _series(T, state, fixed):
    """All coefficients of all lanes; whole turns are taken out of psi."""
    for i in range(LANES):
        psi = state[AT, i]
        k = (psi * (1.0 / TWO_PI) + NEAREST) - NEAREST
        state[AT, i] = (psi - k * TWO_PI) - k * TWO_PI_LOW
        state[TURNED, i] += k
        # what that rounds shifts the solution
        slip = (4.0 * ROUNDOFF_UP) * abs(k)
        state[W_BOUND, i] += slip * (fixed[BOUND_F, i] + fixed[BOUND_G, i] / state[W, i])
        state[T_BOUND, i] += slip / state[W, i]
    for i in range(LANES):
        s, c = sine_cosine(state[AT, i])
        _functions(T, fixed, i, s, c, 1.0 / state[W, i])
    _expand(T)


def _coefficients(row, size):
    @unroll
    def read(T, i):
        return tuple(T[row + n, i] for n in range(size))

    return read


_omega = _coefficients(OMEGA, ORDER + 1)
_integral = _coefficients(INTEGRAL, ORDER + 1)
_low_q, _low_r = _coefficients(Q, VARIED + 1), _coefficients(R, VARIED + 1)


def _last_of(row, share):
    """`lockstep.left_out`'s `ends` of a series that begins in a row, times `share`."""

    @unroll
    def read(T, i):
        last, previous, third, fourth = (share * abs(T[row + ORDER - n, i]) for n in range(4))
        return last, previous, FALL * third, FALL * fourth

    return read


_last_of_omega, _last_of_r = _last_of(OMEGA, 1.0), _last_of(R, 1.0 / ORDER)


@unroll
def _rise(omega, s):
    """omega - 1 at s; even and odd powers apart: half as long a chain."""
    square = s * s
    return fma(polynomial(omega[2::2], square), s, polynomial(omega[1::2], square)) * s


@unroll
def _elapsed(integral, s):
    """w0 (t - t0) at s."""
    square = s * s
    return fma(polynomial(integral[1::2], square), s, polynomial(integral[0::2], square)) * s


@unroll
def _contracted(q, r, h):
    """What dw has been multiplied by at h, exp(-integral of g / w^2), and a bound of its relative error."""
    rates = [convolved(q, r, n) * (1.0 / (n + 1)) for n in range(VARIED + 1)]
    exponent = h * polynomial(rates, h)
    half = 0.0625 * exponent  # of an eighth of it
    part = (1.0 - half) / (1.0 + half)
    part *= part
    part *= part
    power = h
    for _ in range(VARIED - 2):
        power = power * h
    # any one of the last terms may happen to be small
    last, previous, third = (abs(rates[VARIED - n]) for n in range(3))
    left = ((last * h + previous) * h + 0.1 * third) * power
    return part * part, left + abs(exponent) * exponent * exponent * (1.0 / 700.0) + 1e-14


@inline
def _advance(T, state, before, step, fixed, tolerance):
    """One step of every lane; `before` keeps the state before it."""
    for k in range(STATE):
        for i in range(LANES):
            before[k, i] = state[k, i]
    for i in range(LANES):
        w, psi, most_f, most_g = state[W, i], state[AT, i], fixed[BOUND_F, i], fixed[BOUND_G, i]
        ends, ends_r = _last_of_omega(T, i), _last_of_r(T, i)
        inverse = 1.0 / w
        # at most half of w is lost within a step this short
        slope = most_f + 2.0 * most_g * inverse
        least = 2.0 * slope * inverse
        relative, guess = w / (1.0 + w), state[RATE, i]
        size = max(max(ends[0], ends[2] * guess * guess) * relative, ends_r[0])
        size = max(size, max(max(ends[1], ends[3] * guess * guess) * relative, ends_r[1]) * guess)
        size = size * max(1.0, SHORT * guess) / tolerance
        rate = max(sixteenth_root(size), max(least, 0.25))
        end = psi + 1.0 / rate
        h = end - psi
        step[CUT, i], step[CUT_TIME, i] = w * left_out(ends, h), left_out(ends_r, h)
        step[H, i], step[STEEPEST, i], step[INVERSE, i] = h, slope, inverse
        state[AT, i], state[RATE, i] = end, rate
    for i in range(LANES):
        w, h = state[W, i], step[H, i]
        spent = _elapsed(_integral(T, i), h) * step[INVERSE, i]
        high = state[TIME, i] + spent
        state[TIME_LOW, i] += spent - (high - state[TIME, i])
        state[TIME, i], state[W, i] = high, w + w * _rise(_omega(T, i), h)
    for i in range(LANES):
        w, v, h = before[W, i], state[W, i], step[H, i]
        most_g, slope, inverse = fixed[BOUND_G, i], step[STEEPEST, i], step[INVERSE, i]
        lowest = 0.5 * (w + v - h * slope)
        local = step[CUT, i] + ROUNDOFF_UP * (1.5 * max(w, v) + 8.0 * h * slope)
        bound, most = state[W_BOUND, i], 1.0 / (lowest * lowest)
        grown = h * most_g * most
        within = bound * (1.0 + grown + grown * grown) + local  # grown < 1
        contracted, doubt = _contracted(_low_q(T, i), _low_r(T, i), h)
        doubt += 4.0 * grown * within * inverse  # the square of the error
        step[W_WITHIN, i], step[LOWEST, i] = within, lowest
        state[W_BOUND, i] = contracted * (1.0 + doubt) * bound + local
        cut_t = 2.0 * inverse * h * step[CUT_TIME, i]
        state[T_BOUND, i] += h * within * most + cut_t + ROUNDOFF_UP * (4.0 * h * inverse)
        state[COUNT, i] += 1.0


def at_lane(row, size):
    """What reads `size` rows of a lane, from `row` on, of the work space in one row."""

    @unroll
    def read(work, i):
        # of one array, whose rows are LANES apart: offsets known to LLVM, which else computes 40 products a call
        return tuple(work[i + LANES * (row + n)] for n in range(size))

    return read


_omega_at, _integral_at = at_lane(OMEGA, ORDER + 1), at_lane(INTEGRAL, ORDER + 1)
_before_at, _step_at = at_lane(BEFORE, STATE), at_lane(OF_STEP, STEP)
_after_at = at_lane(AFTER, STATE)


@unroll
def _reached(work, i, targets, k, first):
    """How far BLOCK targets lie into the step, what rounding may shift the farthest, and which are passed."""
    before, end = _before_at(work, i), _after_at(work, i)[AT]
    target = consecutive(targets, (k, first), BLOCK)
    x = (target - before[TURNED] * TWO_PI) - before[TURNED] * TWO_PI_LOW
    passed = x <= end
    farthest = abs(before[AT] + before[TURNED] * TWO_PI) + (end - before[AT])
    return selected(passed, largest(x - before[AT], 0.0)), 3e-16 * farthest, passed


def _recording(whole):
    """Two functions that record a block: w and its error bounds, which returns how many targets lie in
    the step, and t and its own.

    Where there is room for the `whole` block, what lies beyond the step is written too, and replaced later.
    """

    @unroll
    def values(work, i, targets, at, first, planes, k):
        s, slip, passed = _reached(work, i, targets, at, first)
        w, step, where = _before_at(work, i)[W], _step_at(work, i), None if whole else passed
        put(planes, (rc.VALUE, k, first), w + w * _rise(_omega_at(work, i), s), where)
        bar = 1.02 * (step[W_WITHIN] + step[STEEPEST] * slip)
        put(planes, (rc.VALUE_BAR, k, first), spread(bar, s), where)
        return counted(passed)

    @unroll
    def times(work, i, targets, at, first, planes, k):
        s, slip, passed = _reached(work, i, targets, at, first)
        before, where = _before_at(work, i), None if whole else passed
        inverse, slowest = 1.0 / before[W], 1.0 / _step_at(work, i)[LOWEST]
        t = before[TIME] + (_elapsed(_integral_at(work, i), s) * inverse + before[TIME_LOW])
        put(planes, (rc.TIME, k, first), t, where)
        bars = 1.02 * (_after_at(work, i)[T_BOUND] + slip * slowest) + 4e-16 * t
        put(planes, (rc.TIME_BAR, k, first), bars, where)

    return values, times


_whole_values, _whole_times = _recording(True)
_last_values, _last_times = _recording(False)


@kernel
def record(work, i, targets, k, first, size, planes, timed):
    """Record lane i of the work space, in one row, at the targets of row k, from the `first` on, within
    the step, with the times if `timed`; returns the next.
    """
    at, end, turns = min(k, len(targets) - 1), work[_END + i], work[_TURNS + i]
    while True:
        if first + BLOCK <= size:
            count = int(_whole_values(work, i, targets, at, first, planes, k))
            if timed:
                _whole_times(work, i, targets, at, first, planes, k)
        else:
            count = int(_last_values(work, i, targets, at, first, planes, k))
            if timed:
                _last_times(work, i, targets, at, first, planes, k)
        first += count
        if count < BLOCK or not unturned(targets[at, first], turns) <= end:
            return first


@inline
def nothing(planes, k, first, timed):
    """Nothing is known in row k from the `first` column on: NaN, times only if `timed`."""
    for n in range(0, rc.STATE, 1 if timed else 2):
        own = planes[n, k]
        for j in range(first, len(own)):
            own[j] = math.nan


@inline
def stop(first, size, status):
    """Note that too many steps were taken for the targets from the `first` on."""
    for j in range(first, size):
        status[j] = STEP_LIMIT


@inline
def _far(w, bound, most_g):
    """Is phi the variable?"""
    return w * w > FAR * most_g and bound < SURE * w


@kernel
def _refill(P, starts, targets, planes, status, timed, waiting, state, fixed, row, sizes, goal):
    """Give free lanes the rows that wait, whose status is OK at first; returns the first that still
    waits. Of rows that do not begin here nothing is known yet.
    """
    width = status.shape[1]
    for i in range(LANES):
        while waiting < len(P) and row[i] < 0:
            begun = False
            p, w0, own = P[waiting], starts[waiting, rc.START_W], row_of(targets, waiting)
            if math.isfinite(own[0]) and w0 > 0.0:
                psi, turns = reduced(starts[waiting, rc.START_PHI])
                slip = (4.0 * ROUNDOFF_UP) * (turns != 0.0)
                bend = p[BOUND_F] + p[BOUND_G] / w0
                bound = slip * bend
                if _far(w0, bound, p[BOUND_G]):
                    for k in range(FIXED):
                        fixed[k, i] = p[k]
                    for k in range(STATE):
                        state[k, i] = 0.0
                    state[AT, i], state[TURNED, i], state[W, i], state[RATE, i] = (
                        psi,
                        turns,
                        w0,
                        2.0 + bend / w0,
                    )
                    state[W_BOUND, i], state[T_BOUND, i] = bound, slip / w0
                    row[i], goal[i], sizes[i] = waiting, own[0], width
                    if not math.isfinite(own[width - 1]):
                        sizes[i] = finite(own)
                    for k in range(sizes[i]):
                        status[waiting, k] = OK
                    begun = True
            if not begun:
                nothing(planes, waiting, 0, timed)
            waiting += 1
        if row[i] < 0:
            state[AT, i], state[W, i] = 0.0, 1.0  # a free lane moves too
    return waiting


@splice
def abels(P, starts, targets, tolerance, limit, ahead, planes, status, timed):
    """Follow each row as far as phi is the variable; arguments as in `lockstep_abel.abels`, but
    that the rows of `targets` end with BLOCK infinities, and results go to planes (STATE, rows, n), those of
    the time only if `timed`.

    `ahead` (rows, STATE), zeros when called: how far. W stays 0 where a row has not begun, and
    COLUMN is the number of its targets where all are known.
    """
    work = np.zeros((ROWS, LANES))  # LLVM: rows do not overlap
    T, state, before = work[:AFTER], work[AFTER:BEFORE], work[BEFORE:OF_STEP]
    step, fixed, flat = work[OF_STEP:WHAT_STAYS], work[WHAT_STAYS:], work.reshape(-1)
    tolerance = min(tolerance, COARSEST)
    row, sizes = np.full(LANES, -1), np.zeros(LANES, np.int64)
    goal = np.zeros(LANES)
    waiting = np.int64(0)  # a literal 0 would have `_refill` compiled twice
    free, ended = True, np.zeros(LANES, dtype=np.bool_)
    while True:
        if free:
            waiting = _refill(
                P, starts, targets, planes, status, timed, waiting, state, fixed, row, sizes, goal
            )
            if not busy(row):
                return
        _series(T, state, fixed)
        _advance(T, state, before, step, fixed, tolerance)
        for i in range(LANES):
            x = state[AT, i] + state[TURNED, i] * TWO_PI
            near = not (x + 1e-9 * (1.0 + abs(x)) < goal[i])
            ended[i] = (
                near
                | (not _far(state[W, i], state[W_BOUND, i], fixed[BOUND_G, i]))
                | (state[COUNT, i] >= limit)
            )
        free = False
        for i in range(LANES):
            if row[i] < 0 or not ended[i]:
                continue
            k, sound = row[i], math.isfinite(state[W, i]) and state[W_BOUND, i] < SURE * state[W, i]
            size, j = sizes[i], int(state[COLUMN, i])
            if sound:
                j = record(flat, i, targets, k, j, size, planes, timed)
            far = _far(state[W, i], state[W_BOUND, i], fixed[BOUND_G, i])
            if j < size and sound and far and state[COUNT, i] < limit:
                state[COLUMN, i], goal[i] = j, row_of(targets, k)[j]
                continue
            nothing(planes, k, j, timed)
            for n in range(STATE):
                ahead[k, n] = state[n, i] if sound else before[n, i]
            ahead[k, COLUMN] = j
            if j < size and state[COUNT, i] >= limit:
                stop(j, size, status[k])
                ahead[k, COLUMN] = size
            row[i], free = -1, True
