"""Many trajectories of a flow on the cylinder in lock step: Taylor series in t, one lane a
solution, its own steps.

Order 16: its 16th root is four square roots, so no lane calls libm, and the loops over lanes are
vector code. In axes turned by a (symmetry S4 of `gyrostat.md`) c23 = 0, and psi = phi - a obeys,
with S = sin psi, C = cos psi,

    psi' = w,  S' = C w,  C' = -S w,  w' = b12 S' + b31 C' - d C S + s2 C - s3 S        (57):

three Cauchy products. Each step computes S and C afresh. Errors are carried as in `steps`, by the
variational equation in its Lienard form (`flow.variation`), to order LOW.

Steps never depend on the requested times: those within a step are evaluated from its series, the
first of BLOCK lanes, then the second and so on. Nor does any solution depend on its neighbours. A
lane that has finished takes the next row.
"""

import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import (
    B12,
    B31,
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
from survey.kernels.cylinder.steps import (
    NO_CONVERGENCE,
    OK,
    OVERFLOW,
    STEP_LIMIT,
    TRUST,
    UNDETERMINED,
    bar,
    finite,
    start_sign,
)
from survey.kernels.jit import inline, kernel, splice
from survey.kernels.math.roundoff import ROUNDOFF_UP
from survey.kernels.unroll import unroll

ORDER = 16
LOW = 6
LANES = 32

# Rows of the series: S, C, w and U1, Z1, U2, Z2 (variations), f, g'.
SIN, COS, W = 0, ORDER + 1, 2 * (ORDER + 1)
_SERIES = 3 * (ORDER + 1)
U1, Z1, U2, Z2, F_, DG = (_SERIES + i * (LOW + 1) for i in range(6))
TABLE = DG + LOW + 1
# Rows of the state that a step changes, ...
(PSI, TURNS, V, TIME, TIME_LOW, RATE, SAA, SAB, SBB, STEPS, SIGN, UNSURE, COUNT) = range(13)
STATE = 13
# ... and of what it does not: the coefficients, their bounds, the next requested time, a.
(P12, P31, PD, P2, P3, PF, PG, PDG, NEXT, TURN) = range(10)
FIXED = 10
# Rows of what is found at a time in the step: is there one, when, and there phi, w, their bars,
# whether these are narrow enough, and the turnings before.
(DUE, AFTER, PHI_AT, V_AT, WIDE_AT, HIGH_AT, NARROW, TURNINGS_AT) = range(8)
FOUND = 8
ROWS = TABLE + 2 * STATE + FIXED + FOUND + 1

# what a step has made of a lane, or the sum of both: it has passed its next time
_PASSED, _LOST = 1.0, 2.0
BLOCK = 8  # lanes whose times are served together
# Shorter steps have only a share of the tolerance, so that many short ones add up to what a few
# long ones do.
_SHORT = 1.0 / 8.0
COARSEST = 1e-11  # per step: above, the terms that follow the last two may be no smaller than these
FALL = 1.0 / 50.0  # by more, two terms further on, no series is trusted to fall
_MANY = -1e9  # a count that stays below zero

# Cody and Waite's reduction, and the polynomials of fdlibm's kernels for sin and cos in [-pi/4,
# pi/4].
NEAREST = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to an integer
_HALF_PI, _HALF_PI_LOW = 0.5 * math.pi, 6.123233995736766e-17
_S1, _S2, _S3 = -1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04
_S4, _S5, _S6 = 2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10
_C1, _C2, _C3 = 4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05
_C4, _C5, _C6 = -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11


@inline
def sine_cosine(x):
    """sin and cos of x in [-3.2, 3.2], to 1 ulp; branch-free and without libm."""
    k = (x * (1.0 / _HALF_PI) + NEAREST) - NEAREST
    first = x - k * _HALF_PI  # exact
    r = first - k * _HALF_PI_LOW
    low = (first - r) - k * _HALF_PI_LOW
    z = r * r
    odd = _S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))
    s = r + (low + r * z * (_S1 + z * odd))
    even = _C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6))))
    half = 0.5 * z
    top = 1.0 - half
    c = top + (((1.0 - top) - half) + (z * z * even - r * low))
    swapped = abs(k) == 1.0
    sine = c if swapped else s
    cosine = s if swapped else c
    sine = -sine if k > 1.5 or (-2.5 < k and k < -0.5) else sine
    cosine = -cosine if k > 0.5 or k < -1.5 else cosine
    return sine, cosine


def _orders(first, last):
    """What adds the coefficients first + 1 to `last` of the series of S, C and w of a lane."""

    @unroll
    def expand(T, fixed, i):
        p12, p31, p2, p3, pd = (fixed[row, i] for row in (P12, P31, P2, P3, PD))
        s, c, w = ([T[row + n, i] for n in range(first + 1)] for row in (SIN, COS, W))
        for n in range(first, last):
            r = 1.0 / (n + 1)
            cw, sw, cs = _product(c, w, n), _product(s, w, n), _product(c, s, n)
            g = p2 * c[n] - p3 * s[n] - pd * cs
            s.append(cw * r)
            c.append(-sw * r)
            w.append((p12 * cw - p31 * sw + g) * r)
            T[SIN + n + 1, i], T[COS + n + 1, i], T[W + n + 1, i] = s[n + 1], c[n + 1], w[n + 1]

    return expand


def _product(a, b, n):
    """Coefficient n of the product of two series, from the outside."""
    terms = [a[n - k] * b[k] + a[k] * b[n - k] for k in range((n + 1) // 2)]
    terms += [a[n // 2] * b[n // 2]] if n % 2 == 0 else []
    return sum(terms[1:], terms[0])


@inline
def _begin(T, state):
    """Take whole turns out of psi; the first coefficients."""
    for i in range(LANES):
        psi = state[PSI, i]
        k = (psi * (1.0 / TWO_PI) + NEAREST) - NEAREST
        psi = (psi - k * TWO_PI) - k * TWO_PI_LOW
        s, c = sine_cosine(psi)
        state[PSI, i] = psi
        state[TURNS, i] += k
        T[SIN, i], T[COS, i], T[W, i] = s, c, state[V, i]


_low_orders, _middle_orders, _high_orders = _orders(0, 7), _orders(7, 12), _orders(12, ORDER)


def vary(T, f, dg, i):
    """Series of the variations of lane i, u' = f u + z, z' = g' u, from those of f and g'."""
    for first, u, z in ((U1, [1.0], [-f[0]]), (U2, [0.0], [1.0])):
        for n in range(LOW):
            r = 1.0 / (n + 1)
            fu = sum((f[k] * u[n - k] for k in range(1, n + 1)), f[0] * u[n])
            gu = sum((dg[k] * u[n - k] for k in range(1, n + 1)), dg[0] * u[n])
            u.append((fu + z[n]) * r)
            z.append(gu * r)
        for n in range(LOW + 1):
            T[first + n, i], T[first + LOW + 1 + n, i] = u[n], z[n]


@unroll
def vary_lane(T, i):
    """Series of the variations of lane i, from those of f and g' in T."""
    vary(T, *([T[row + n, i] for n in range(LOW + 1)] for row in (F_, DG)), i)


@unroll
def _vary(T, fixed, i):
    """Series of f and g', and of the variations, of lane i."""
    p12, p31, p2, p3, pd = (fixed[row, i] for row in (P12, P31, P2, P3, PD))
    s, c = [T[SIN + n, i] for n in range(LOW + 1)], [T[COS + n, i] for n in range(LOW + 1)]
    f, dg = [], []
    for n in range(LOW + 1):
        squares = _product(s, s, n)
        double = 1.0 - 2.0 * squares if n == 0 else -2.0 * squares  # cos 2 psi
        f.append(p12 * c[n] - p31 * s[n])
        dg.append(-pd * double - p2 * s[n] - p3 * c[n])
        T[F_ + n, i], T[DG + n, i] = f[n], dg[n]
    vary(T, f, dg, i)


@inline
def series(T, state, fixed):
    """All coefficients of all lanes; in several loops, since one has more numbers than there are
    registers.
    """
    _begin(T, state)
    for i in range(LANES):
        _low_orders(T, fixed, i)
    for i in range(LANES):
        _middle_orders(T, fixed, i)
    for i in range(LANES):
        _high_orders(T, fixed, i)
    for i in range(LANES):
        _vary(T, fixed, i)


@inline
def split(work):
    """The parts of the work array: series, state, state before the step, what stays fixed, what is
    found at a time, what became of lanes.
    """
    first, second = TABLE + STATE, TABLE + 2 * STATE
    third = second + FIXED
    return (
        work[:TABLE],
        work[TABLE:first],
        work[first:second],
        work[second:third],
        work[third : third + FOUND],
        work[third + FOUND],
    )


@inline
def step(T, state, before, fixed, fate, tolerance):
    """One step of every lane."""
    series(T, state, fixed)
    advance(T, state, before, fixed, fate, tolerance)
    _turnings(state)


@inline
def advance(T, state, before, fixed, fate, tolerance):
    """One step of every lane; `before` keeps the state before it."""
    for k in range(STATE):
        for i in range(LANES):
            before[k, i] = state[k, i]
    for i in range(LANES):
        w, last, previous = state[V, i], abs(T[W + ORDER, i]), abs(T[W + ORDER - 1, i])
        # a term that vanishes, as every second does where the motion starts at rest, proves
        # nothing: two more count
        fall = FALL * state[RATE, i] * state[RATE, i]
        size = max(last, fall * abs(T[W + ORDER - 2, i]))
        size = max(size, max(previous, fall * abs(T[W + ORDER - 3, i])) * state[RATE, i])
        size = size * max(1.0, _SHORT * state[RATE, i])
        size = size / (tolerance * (1.0 + abs(w)))
        # within `flow.longest_step` w has one zero at most
        square = fixed[PDG, i] + fixed[PF, i] * (abs(w) + 0.25 * fixed[PF, i])
        rate = math.sqrt(max(math.sqrt(math.sqrt(math.sqrt(size))), square) + 1e-300)
        dt = 1.0 / rate
        passed = (fixed[NEXT, i] - state[TIME, i]) - state[TIME_LOW, i] < dt
        x, v = T[W + ORDER, i] * (1.0 / (ORDER + 1)), T[W + ORDER, i]
        for k in range(ORDER - 1, 0, -1):
            x, v = x * dt + T[W + k, i] * (1.0 / (k + 1)), v * dt + T[W + k, i]
        x, v = state[PSI, i] + (x * dt + w) * dt, w + v * dt
        u1, z1, u2, z2, f = (
            T[U1 + LOW, i],
            T[Z1 + LOW, i],
            T[U2 + LOW, i],
            T[Z2 + LOW, i],
            T[F_ + LOW, i],
        )
        for k in range(LOW - 1, -1, -1):
            u1, z1 = u1 * dt + T[U1 + k, i], z1 * dt + T[Z1 + k, i]
            u2, z2, f = u2 * dt + T[U2 + k, i], z2 * dt + T[Z2 + k, i], f * dt + T[F_ + k, i]
        z1, z2 = z1 + f * u1, z2 + f * u2
        ends = last, previous, FALL * abs(T[W + ORDER - 2, i]), FALL * abs(T[W + ORDER - 3, i])
        carried, jacobian = (state[SAA, i], state[SAB, i], state[SBB, i]), (u1, u2, z1, z2)
        state[SAA, i], state[SAB, i], sbb = ellipse(
            carried, jacobian, dt, v, ends, fixed[PF, i], fixed[PG, i]
        )
        n = state[STEPS, i] + 1.0
        state[SBB, i], state[STEPS, i] = sbb, n
        high = state[TIME, i] + dt
        state[TIME_LOW, i] += dt - (high - state[TIME, i])
        state[TIME, i], state[PSI, i], state[V, i], state[RATE, i] = high, x, v, rate
        good = state[SAA, i] < TRUST and sbb < (1.0 + abs(v)) * (1.0 + abs(v))
        fate[i] = (_PASSED if passed else 0.0) + (0.0 if good else _LOST)


@unroll
def coefficients(T, i):
    return tuple(T[W + n, i] for n in range(ORDER + 1))


@unroll
def variations(T, i):
    return tuple(T[row + n, i] for row in (U1, Z1, U2, Z2, F_) for n in range(LOW + 1))


@unroll
def varied(series_of, dt):
    """The Jacobian (psi_psi, psi_w, w_psi, w_w) at dt, as in `flow.jacobian`."""
    u1, z1, u2, z2, f = (
        polynomial(series_of[row * (LOW + 1) : (row + 1) * (LOW + 1)], dt) for row in range(5)
    )
    return u1, u2, z1 + f * u1, z2 + f * u2


def polynomial(coefficients, x):
    *lower, total = coefficients
    for coefficient in reversed(lower):
        total = total * x + coefficient
    return total


@inline
def last_terms(T, i):
    """`ends` of `lockstep.ellipse`."""
    last, previous = abs(T[W + ORDER, i]), abs(T[W + ORDER - 1, i])
    return last, previous, FALL * abs(T[W + ORDER - 2, i]), FALL * abs(T[W + ORDER - 3, i])


@inline
def left_out(ends, h):
    """What a series leaves out at h beyond its last term, of order ORDER: as much as its last terms
    (`ends` of `ellipse`, of which one may be small by accident) where these fall by a third in two
    orders, more where they fall less.
    """
    last, previous, third, fourth = ends
    h2 = h * h
    h4 = h2 * h2
    high, low = (last * h + previous) * h2, max(third * h, fourth)
    fallen = min(FALL * high / (low + 1e-300), 0.9)
    return h4 * h4 * h4 * h * max(high + low, high * (2.0 * fallen / (1.0 - fallen)))


@inline
def ellipse(carried, jacobian, dt, v, ends, most_f, most_g):
    """The error ellipse at dt in a step, where w = v, from the one at its start.

    `ends`: the sizes of the last term of w, of the one before, and those of the two before these,
    times FALL: what follows the last two is bounded with the help of the others.
    """
    saa, sab, sbb = carried
    u1, u2, z1, z2 = jacobian
    cut = left_out(ends, dt)
    speed = most_f * abs(v) + most_g
    e = cut * dt * (1.0 / ORDER) + ROUNDOFF_UP * (4.0 + 3.0 * dt * (abs(v) + dt * speed))
    g = cut + ROUNDOFF_UP * (1.5 * abs(v) + 8.0 * dt * speed)
    return (
        u1 * u1 * saa + 2.0 * u1 * u2 * sab + u2 * u2 * sbb + e * e,
        u1 * z1 * saa + (u1 * z2 + u2 * z1) * sab + u2 * z2 * sbb,
        z1 * z1 * saa + 2.0 * z1 * z2 * sab + z2 * z2 * sbb + g * g,
    )


@inline
def _turnings(state):
    """Count the sign changes of w; where the bar reaches zero for more than two steps the count is lost."""
    for i in range(LANES):
        v, sign, unsure, count = state[V, i], state[SIGN, i], state[UNSURE, i], state[COUNT, i]
        near = not v * v > 2.0402 * state[STEPS, i] * state[SBB, i]
        lost = unsure > 2.0
        passed = count + (1.0 if v * sign < 0.0 else 0.0)
        state[COUNT, i] = count if near else (_MANY if lost else passed)
        state[SIGN, i] = sign if near else (1.0 if v > 0.0 else -1.0)
        state[UNSURE, i] = unsure + 1.0 if near else 0.0


@inline
def enter(p, phi0, w0, state, fixed, i):
    """Set lane i to the start of a solution, in axes where c23 = 0."""
    angle, wide, tall = 0.0, p[D] + 0.0, 2.0 * p[C23]  # no negative zero: its sign is taken
    if tall != 0.0:
        angle = 0.5 * math.atan2(-tall if wide >= 0.0 else tall, abs(wide))
        wide = math.copysign(math.sqrt(wide * wide + tall * tall), wide)
    s, c = math.sin(angle), math.cos(angle)
    rest, turns = reduced(phi0)
    fixed[P12, i], fixed[P31, i] = p[B12] * c - p[B31] * s, p[B12] * s + p[B31] * c
    fixed[P2, i], fixed[P3, i], fixed[PD, i] = p[S2] * c - p[S3] * s, p[S2] * s + p[S3] * c, wide
    fixed[PF, i], fixed[PG, i], fixed[PDG, i], fixed[TURN, i] = (
        p[BOUND_F],
        p[BOUND_G],
        p[BOUND_DG],
        angle,
    )
    for k in range(STATE):
        state[k, i] = 0.0
    state[PSI, i], state[TURNS, i], state[V, i] = rest - angle, turns, w0
    slip = ROUNDOFF_UP * 4.0 * (turns != 0.0 or angle != 0.0)
    state[SAA, i] = slip * slip
    state[RATE, i] = abs(w0) + math.sqrt(p[BOUND_DG] + p[BOUND_F] * (abs(w0) + 0.25 * p[BOUND_F]))
    state[SIGN, i] = start_sign(p, rest, w0)


@unroll
def _moved(c, dt):
    """The change of psi, and w, at dt, as in `advance`."""
    x, v = c[ORDER] * (1.0 / (ORDER + 1)), c[ORDER]
    for k in range(ORDER - 1, 0, -1):
        x, v = x * dt + c[k] * (1.0 / (k + 1)), v * dt + c[k]
    return (x * dt + c[0]) * dt, c[0] + v * dt


@inline
def _passed(fate):
    return (fate == _PASSED) | (fate == _PASSED + _LOST)


@inline
def _due(state, before, fixed, found, fate, first):
    """Set DUE and AFTER of BLOCK lanes, from the `first` on, by whether their next time lies in the
    step; how many do?
    """
    count = 0
    for j in range(BLOCK):
        i = np.uint64(first + j)  # no index that may count from the end: else no vector code
        after = (fixed[NEXT, i] - before[TIME, i]) - before[TIME_LOW, i]
        due = _passed(fate[i]) & (after < 1.0 / state[RATE, i])
        found[DUE, i], found[AFTER, i] = (1.0, after) if due else (0.0, 0.0)
        count += due
    return count


@inline
def _evaluate(T, state, before, fixed, found, first):
    """Find what there is AFTER the start of the step in BLOCK lanes."""
    for j in range(BLOCK):
        i = np.uint64(first + j)
        dt = found[AFTER, i]
        x, v = _moved(coefficients(T, i), dt)
        carried = before[SAA, i], before[SAB, i], before[SBB, i]
        jacobian = varied(variations(T, i), dt)
        saa, _sab, sbb = ellipse(
            carried, jacobian, dt, v, last_terms(T, i), fixed[PF, i], fixed[PG, i]
        )
        n, turns, angle = state[STEPS, i], state[TURNS, i], fixed[TURN, i]
        count, sign, unsure = before[COUNT, i], before[SIGN, i], before[UNSURE, i]
        wide, high = bar(n, saa), bar(n, sbb)
        # then w is 0 at the start and nowhere else
        from_rest = (before[STEPS, i] == 0.0) & (before[V, i] == 0.0)
        sure = (unsure < 3.0) & (count >= 0.0) & ((abs(v) > high) | from_rest)
        passed = (sign * v < 0.0) & (not from_rest)
        narrow = (wide < TRUST) & (high < TRUST * (1.0 + abs(v)))
        found[PHI_AT, i], found[V_AT, i] = ((before[PSI, i] + x) + angle) + turns * TWO_PI, v
        found[WIDE_AT, i] = wide + 3e-16 * (abs(turns) * TWO_PI + abs(angle))
        found[HIGH_AT, i], found[NARROW, i] = high, 1.0 if narrow else 0.0
        found[TURNINGS_AT, i] = count + (1.0 if passed else 0.0) if sure else float(UNDETERMINED)


@kernel
def _note(times, fixed, found, fate, row, column, first, planes, turnings):
    """Note what BLOCK lanes have found for their next times; those whose bars are too wide are lost."""
    for i in range(first, first + BLOCK):
        if found[DUE, i] == 0.0:
            continue
        if found[NARROW, i] == 0.0:
            fate[i] = _LOST
            continue
        r, j = row[i], column[i]
        planes[rc.PHI, r, j], planes[rc.PHI_BAR, r, j] = found[PHI_AT, i], found[WIDE_AT, i]
        planes[rc.W, r, j], planes[rc.W_BAR, r, j] = found[V_AT, i], found[HIGH_AT, i]
        turnings[r, j] = int(found[TURNINGS_AT, i])
        column[i] = j + 1
        fixed[NEXT, i] = times[r, j + 1] if j + 1 < times.shape[1] else math.inf


@kernel
def _refill(P, starts, times, waiting, state, fixed, row, column, status):
    """Give free lanes the rows that wait; returns the first that still waits."""
    for i in range(LANES):
        while waiting < len(P) and row[i] < 0:
            if finite(times[waiting]) == 0:
                status[waiting] = OK
            else:
                enter(
                    P[waiting],
                    starts[waiting, rc.START_PHI],
                    starts[waiting, rc.START_W],
                    state,
                    fixed,
                    i,
                )
                fixed[NEXT, i], row[i], column[i] = times[waiting, 0], waiting, 0
            waiting += 1
    return waiting


@kernel
def _free(limit, state, fixed, fate, row, status):
    """Free the lanes that have ended; returns whether any has."""
    freed = False
    for i in range(LANES):
        if row[i] < 0 or (fate[i] == 0.0 and state[STEPS, i] < limit):
            continue
        r, ending = row[i], -1
        if _passed(fate[i]) and fixed[NEXT, i] == math.inf:
            ending = OK
        if ending < 0 and fate[i] >= _LOST:
            ending = NO_CONVERGENCE if math.isfinite(state[V, i]) else OVERFLOW
        if ending < 0 and state[STEPS, i] >= limit:
            ending = STEP_LIMIT
        if ending >= 0:
            status[r], row[i], fixed[NEXT, i], freed = ending, -1, math.inf, True
    return freed


@inline
def busy(row):
    """Has any lane a row?"""
    for i in range(LANES):
        if row[i] >= 0:
            return True
    return False


@splice
def trajectories(P, starts, times, tolerance, limit, planes, turnings, status):
    """phi, w, their bars and turnings at the ascending times >= 0 of each row, which end at its
    first infinity.

    P (rows, 10) from `flow.coefficients`; as `steps.trajectories`. Returns the number of steps of
    lanes, free ones too.
    """
    work = np.zeros((ROWS, LANES))  # one array: LLVM sees that its rows do not overlap
    T, state, before, fixed, found, fate = split(work)
    tolerance = min(tolerance, COARSEST)
    row, column = np.full(LANES, -1), np.zeros(LANES, dtype=np.int64)
    fixed[NEXT, :] = math.inf  # of lanes that stay free, too
    waiting = np.int64(0)  # a literal 0 would have `_refill` compiled twice
    waiting, steps = _refill(P, starts, times, waiting, state, fixed, row, column, status), 0
    while busy(row):
        step(T, state, before, fixed, fate, tolerance)
        steps += LANES
        for first in range(0, LANES, BLOCK):
            while _due(state, before, fixed, found, fate, first):
                _evaluate(T, state, before, fixed, found, first)
                _note(times, fixed, found, fate, row, column, first, planes, turnings)
        if _free(limit, state, fixed, fate, row, status):
            waiting = _refill(P, starts, times, waiting, state, fixed, row, column, status)
    return steps
