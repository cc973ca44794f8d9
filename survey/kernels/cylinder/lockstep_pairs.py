"""Many trajectories of the gyrostat in lock step to some 23 digits: for what float64 leaves open, where
double-double arithmetic (`flow_double`), one by one, takes ten times as long.

Taylor series of order 32 as in `lockstep`, in the axes of the parameters. The first PAIRS coefficients of
S, C and w are double-doubles, and so are phi, w and t. A later one counts for less than 1e-6 of w within a
step, so that float64 knows it to 1e-22:

    phi' = w,  S' = C w,  C' = -S w,  w' = b12 S' + b31 C' - d C S - c23 (1 - 2 S S) + s2 C - s3 S      (57)

Error bounds are carried in float64, as there. S, C and W below are tables (LOWER + PAIRS, LANES) of
the coefficients and, from row LOWER on, of the second parts of the pairs; `six` (SIX, LANES) holds the
parameters, `low` (2, LANES) the second parts of phi and w, `sums` (9, LANES) anything.

Sources: those of `kernels.math.double` and `kernels.cylinder.flow_double`.
"""

import math
from fractions import Fraction

import numpy as np

from survey.kernels.cylinder import lockstep
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.balls import VECTOR
from survey.kernels.cylinder.flow import (
    B12,
    B31,
    BOUND_DG,
    BOUND_F,
    BOUND_G,
    C23,
    S2,
    S3,
    SIX,
    TWO_PI,
    D,
)
from survey.kernels.cylinder.lockstep import (
    DG,
    F_,
    FALL,
    LANES,
    LOW,
    NEAREST,
    NEXT,
    PDG,
    PF,
    PG,
    PSI,
    RATE,
    SAA,
    SAB,
    SBB,
    SIGN,
    STATE,
    STEPS,
    TIME,
    TIME_LOW,
    TURNS,
    V,
    busy,
    varied,
)
from survey.kernels.cylinder.steps import OK, TRUST, bar, finite, start_sign
from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd
from survey.kernels.math.angles_double import centred, radians
from survey.kernels.math.roundoff import PAIR_ROUNDOFF, ROUNDOFF_UP

ORDER = 32
PAIRS = 10  # orders 0 to 9
SERVES = ()  # used before `taylor_double`; users cannot choose it
FLOW_FINEST = 1.0  # nothing to refine
FLOW_WORK = 1
FLOW_UNCOUNTED = True
TOLERANCE = 1e-24  # truncation of one step, relative to 1 + |w|
# relative rounding of one step in double-double: 16 operations, with room
ROUGH = 16.0 * PAIR_ROUNDOFF
# what float64 loses of a coefficient from PAIRS on: a few roundings, with room
LATER = 64.0 * ROUNDOFF_UP
LEAST = 1e-21  # of w' times the step: the same, should these coefficients happen to be small
LOWER = ORDER + 1  # where the second parts begin
TERMS = 13  # of sin and cos of up to an eighth of a turn
EXACT = 6  # of these are pairs


# 1 / (n + 1); coefficients of sin x / x and of cos x in x^2
PARTS = np.array([dd.of_fraction(Fraction(1, n + 1)) for n in range(ORDER + 1)])
SINE, COSINE = (
    np.array([dd.of_fraction(Fraction((-1) ** n, math.factorial(2 * n + k))) for n in range(TERMS)])
    for k in (1, 0)
)


@inline
def _begin(S, C, W, state, low, sums, lanes):
    """Take whole turns out of phi; the first coefficients."""
    z, rest, quarter = sums[0:2], sums[2:4], sums[4]
    sine, cosine = sums[5:7], sums[7:9]
    for i in range(lanes):
        k = (state[PSI, i] * (1.0 / TWO_PI) + NEAREST) - NEAREST
        state[PSI, i], low[0, i] = dd.add((state[PSI, i], low[0, i]), dd.neg(radians(k)))
        state[TURNS, i] += k
        W[0, i], W[LOWER, i] = state[V, i], low[1, i]
    for i in range(lanes):
        quarter[i] = (state[PSI, i] * (2.0 / math.pi) + NEAREST) - NEAREST
        x = dd.add((state[PSI, i], low[0, i]), dd.neg(radians(0.25 * quarter[i])))
        rest[0, i], rest[1, i] = x
        z[0, i], z[1, i] = dd.square(x)
        sine[0, i] = sine[1, i] = cosine[0, i] = cosine[1, i] = 0.0
    for n in range(TERMS - 1, -1, -1):
        one, two = SINE[n], COSINE[n]
        if n >= EXACT:
            for i in range(lanes):
                sine[0, i] = sine[0, i] * z[0, i] + one[0]
                cosine[0, i] = cosine[0, i] * z[0, i] + two[0]
        else:
            _horner(sine, z, one, lanes)
            _horner(cosine, z, two, lanes)
    for i in range(lanes):
        q = quarter[i]
        one, two = (
            dd.mul((sine[0, i], sine[1, i]), (rest[0, i], rest[1, i])),
            (cosine[0, i], cosine[1, i]),
        )
        swapped = abs(q) == 1.0
        back = -1.0 if (q > 1.5) | ((-2.5 < q) & (q < -0.5)) else 1.0
        under = -1.0 if (q > 0.5) | (q < -1.5) else 1.0
        S[0, i], S[LOWER, i] = (
            back * (two[0] if swapped else one[0]),
            back * (two[1] if swapped else one[1]),
        )
        C[0, i], C[LOWER, i] = (
            under * (one[0] if swapped else two[0]),
            under * (one[1] if swapped else two[1]),
        )


@inline
def _horner(total, x, term, lanes):
    """total x + term, of pairs."""
    for i in range(lanes):
        product = dd.mul((total[0, i], total[1, i]), (x[0, i], x[1, i]))
        total[0, i], total[1, i] = dd.loose(product, (term[0], term[1]))


@kernel
def _product_of_pairs(total, A, B, n, lanes):
    """Coefficient n of the product of two series, pairs, in `total` (2, LANES): see `double.convolved`."""
    for i in range(lanes):
        total[0, i] = total[1, i] = 0.0
    for k in range(n + 1):
        for i in range(lanes):
            a, b = (A[k, i], A[LOWER + k, i]), (B[n - k, i], B[LOWER + n - k, i])
            total[0, i], total[1, i] = dd.plus_product(total[0, i], total[1, i], a, b)


@kernel
def _product(total, A, B, n, lanes):
    """Coefficient n >= 3 of the product of two series in row 0 of `total`, four terms at once."""
    for i in range(lanes):
        total[0, i] = 0.0
    for k in range(0, n - 2, 4):
        for i in range(lanes):
            total[0, i] += (A[k, i] * B[n - k, i] + A[k + 1, i] * B[n - k - 1, i]) + (
                A[k + 2, i] * B[n - k - 2, i] + A[k + 3, i] * B[n - k - 3, i]
            )
    for k in range((n + 1) // 4 * 4, n + 1):
        for i in range(lanes):
            total[0, i] += A[k, i] * B[n - k, i]


@inline
def _expand(S, C, W, T, six, sums, lanes):
    """All coefficients of all lanes, and those of f and g' to order LOW in T."""
    cw, sw, cs, ss = sums[0:2], sums[2:4], sums[4:6], sums[6:8]
    for n in range(ORDER):
        if n < PAIRS - 1:
            _product_of_pairs(cw, C, W, n, lanes)
            _product_of_pairs(sw, S, W, n, lanes)
            _product_of_pairs(cs, C, S, n, lanes)
            _product_of_pairs(ss, S, S, n, lanes)
            _onward(S, C, W, six, sums, n, lanes)
        else:
            _product(cw, C, W, n, lanes)
            _product(sw, S, W, n, lanes)
            _product(cs, C, S, n, lanes)
            _product(ss, S, S, n, lanes)
            r = PARTS[n, 0]
            for i in range(lanes):
                g = (six[S2, i] * C[n, i] - six[S3, i] * S[n, i]) - (
                    six[D, i] * cs[0, i] - 2.0 * six[C23, i] * ss[0, i]
                )
                W[n + 1, i] = (six[B12, i] * cw[0, i] - six[B31, i] * sw[0, i] + g) * r
                S[n + 1, i], C[n + 1, i] = cw[0, i] * r, -sw[0, i] * r
        if n <= LOW:
            one = 1.0 if n == 0 else 0.0
            for i in range(lanes):
                T[F_ + n, i] = six[B12, i] * C[n, i] - six[B31, i] * S[n, i]
                T[DG + n, i] = (
                    4.0 * six[C23, i] * cs[0, i]
                    - six[D, i] * (one - 2.0 * ss[0, i])
                    - (six[S2, i] * S[n, i] + six[S3, i] * C[n, i])
                )


@kernel
def _onward(S, C, W, six, sums, n, lanes):
    """The next coefficients, pairs, from the products of order n."""
    part, one, m = (PARTS[n, 0], PARTS[n, 1]), 1.0 if n == 0 else 0.0, LOWER + n
    for i in range(lanes):
        cw, sw = dd.quick_two_sum(sums[0, i], sums[1, i]), dd.quick_two_sum(sums[2, i], sums[3, i])
        sums[0, i], sums[1, i] = dd.mul(cw, part)
        sums[2, i], sums[3, i] = dd.mul(dd.neg(sw), part)
        total = dd.loose(dd.times(cw, six[B12, i]), dd.times(sw, -six[B31, i]))
        total = dd.loose(total, dd.times((C[n, i], C[m, i]), six[S2, i]))
        total = dd.loose(total, dd.times((S[n, i], S[m, i]), -six[S3, i]))
        cs, ss = dd.quick_two_sum(sums[4, i], sums[5, i]), dd.quick_two_sum(sums[6, i], sums[7, i])
        total = dd.loose(total, dd.times(cs, -six[D, i]))
        total = dd.loose(total, dd.times(dd.shifted(dd.scaled(ss, -2.0), one), -six[C23, i]))
        W[n + 1, i], W[m + 1, i] = dd.mul(total, part)
    for i in range(lanes):
        S[n + 1, i], S[m + 1, i] = sums[0, i], sums[1, i]
        C[n + 1, i], C[m + 1, i] = sums[2, i], sums[3, i]


@inline
def _move(W, dt, x, v, first, last):
    """phi less that at the start, and w, in x and v (2, LANES), at dt of a step, of the lanes `first` to `last` - 1."""
    for i in range(first, last):
        x[0, i] = x[1, i] = v[0, i] = v[1, i] = 0.0
    for n in range(ORDER, PAIRS - 1, -1):
        for i in range(first, last):
            v[0, i] = v[0, i] * dt[i] + W[n, i]
            x[0, i] = x[0, i] * dt[i] + W[n, i] * PARTS[n, 0]
    for n in range(PAIRS - 1, -1, -1):
        for i in range(first, last):
            term = W[n, i], W[LOWER + n, i]
            v[0, i], v[1, i] = dd.loose(dd.times((v[0, i], v[1, i]), dt[i]), term)
            rise = dd.mul(term, (PARTS[n, 0], PARTS[n, 1]))
            x[0, i], x[1, i] = dd.loose(dd.times((x[0, i], x[1, i]), dt[i]), rise)
    for i in range(first, last):
        x[0, i], x[1, i] = dd.times((x[0, i], x[1, i]), dt[i])


@inline
def _ellipse(W, fixed, i, carried, jacobian, dt, v):
    """The error ellipse at dt in a step, where w = v, from the one at its start: as `lockstep.ellipse`."""
    saa, sab, sbb = carried
    u1, u2, z1, z2 = jacobian
    fourth = (dt * dt) * (dt * dt)
    power = (fourth * fourth) * (fourth * fourth)  # 16
    power *= (fourth * fourth) * fourth * dt  # ORDER - 3
    high = (abs(W[ORDER, i]) * dt + abs(W[ORDER - 1, i])) * dt * dt
    low = FALL * max(abs(W[ORDER - 2, i]) * dt, abs(W[ORDER - 3, i]))
    reach = abs(v) + dt * (fixed[PF, i] * abs(v) + fixed[PG, i])
    change = dt * (fixed[PF, i] * reach + fixed[PG, i])
    later = ((abs(W[PAIRS + 3, i]) * dt + abs(W[PAIRS + 2, i])) * dt + abs(W[PAIRS + 1, i])) * dt
    later = (later + abs(W[PAIRS, i])) * (fourth * fourth) * dt * dt  # of order PAIRS
    g = 2.0 * power * (high + low) + LATER * later + LEAST * change
    g += ROUGH * (1.0 + abs(v) + change)
    e = g * dt + ROUGH * (4.0 + dt * reach)
    return (
        u1 * u1 * saa + 2.0 * u1 * u2 * sab + u2 * u2 * sbb + e * e,
        u1 * z1 * saa + (u1 * z2 + u2 * z1) * sab + u2 * z2 * sbb,
        z1 * z1 * saa + 2.0 * z1 * z2 * sab + z2 * z2 * sbb + g * g,
    )


@inline
def _advance(W, T, state, before, low, low_before, fixed, dt, fate, sums, lanes):
    """One step dt of every lane; `before` and `low_before` keep the state before it."""
    x, v = sums[1:3], sums[3:5]
    for i in range(lanes):
        for k in range(STATE):
            before[k, i] = state[k, i]
        low_before[0, i], low_before[1, i] = low[0, i], low[1, i]
    for i in range(lanes):
        w, guess = state[V, i], state[RATE, i]
        last, previous = abs(W[ORDER, i]), abs(W[ORDER - 1, i])
        fall = FALL * guess * guess
        size = max(last, fall * abs(W[ORDER - 2, i]))
        size = max(size, max(previous, fall * abs(W[ORDER - 3, i])) * guess)
        size = size * max(1.0, lockstep.SHORT * guess) / (TOLERANCE * (1.0 + abs(w)))
        root = math.sqrt(math.sqrt(math.sqrt(math.sqrt(size))))
        square = fixed[PDG, i] + fixed[PF, i] * (abs(w) + 0.25 * fixed[PF, i])
        state[RATE, i] = math.sqrt(max(root, square) + 1e-300)
        dt[i] = 1.0 / state[RATE, i]
    _move(W, dt, x, v, 0, lanes)
    for i in range(lanes):
        h, w = dt[i], v[0, i]
        passed = (fixed[NEXT, i] - state[TIME, i]) - state[TIME_LOW, i] <= h
        carried = state[SAA, i], state[SAB, i], state[SBB, i]
        state[SAA, i], state[SAB, i], state[SBB, i] = _ellipse(
            W, fixed, i, carried, varied(lockstep.variations(T, i), h), h, w
        )
        good = state[SAA, i] < TRUST and state[SBB, i] < (1.0 + abs(w)) * (1.0 + abs(w))
        fate[i] = (lockstep.PASSED if passed else 0.0) + (0.0 if good else lockstep.LOST)
    for i in range(lanes):
        time = dd.shifted((state[TIME, i], state[TIME_LOW, i]), dt[i])
        phi = dd.add((state[PSI, i], low[0, i]), (x[0, i], x[1, i]))
        state[TIME, i], state[TIME_LOW, i] = time
        state[PSI, i], low[0, i] = phi
        state[V, i], low[1, i] = v[0, i], v[1, i]
        state[STEPS, i] += 1.0


@inline
def _narrow(planes, k, j, slip):
    """Are the bars narrow enough, that of phi but for `slip`?"""
    most = TRUST * (1.0 + abs(planes[rc.W, k, j]))
    return planes[rc.PHI_BAR, k, j] - slip <= TRUST and planes[rc.W_BAR, k, j] <= most


@kernel
def _serve(W, T, state, before, low_before, fixed, taken, i, times, k, first, size, planes, sums):
    """Record phi, w and their bars of lane i at the times of row k, from the `first` on, within the step,
    which ends after `taken`; returns the next, and whether all bars were narrow enough.
    """
    dt, x, v = sums[0], sums[1:3], sums[3:5]
    carried, n = (before[SAA, i], before[SAB, i], before[SBB, i]), state[STEPS, i]
    for j in range(first, size):
        h = (times[k, j] - before[TIME, i]) - before[TIME_LOW, i]
        if not h <= taken[i]:
            return j, True
        dt[i] = h
        _move(W, dt, x, v, i, i + 1)
        w = v[0, i]
        saa, _sab, sbb = _ellipse(W, fixed, i, carried, varied(lockstep.variations(T, i), h), h, w)
        phi = dd.add((before[PSI, i], low_before[0, i]), (x[0, i], x[1, i]))
        phi = dd.add(phi, radians(before[TURNS, i]))[0]
        late = 4.0 * ROUNDOFF_UP * h  # the time in the step is float64's
        wide = bar(n, saa) + late * abs(w) + ROUNDOFF_UP * abs(phi)
        high = bar(n, sbb) + late * (fixed[PF, i] * abs(w) + fixed[PG, i]) + ROUNDOFF_UP * abs(w)
        planes[rc.PHI, k, j], planes[rc.PHI_BAR, k, j] = phi, wide
        planes[rc.W, k, j], planes[rc.W_BAR, k, j] = w, high
        if not _narrow(planes, k, j, ROUNDOFF_UP * abs(phi)):
            return j, False
    return size, True


@kernel
def _refill(P, starts, times, waiting, state, low, fixed, six, row, column, sizes, status):
    """Give free lanes the rows that wait; returns the first that still waits."""
    for i in range(LANES):
        while waiting < len(P) and row[i] < 0:
            size = finite(times[waiting])
            if size == 0:
                status[waiting] = OK
            else:
                p, w0 = P[waiting], starts[waiting, rc.START_W]
                phi, turns = centred((starts[waiting, rc.START_PHI], 0.0))
                for k in range(STATE):
                    state[k, i] = 0.0
                for k in range(SIX):
                    six[k, i] = p[k]
                state[PSI, i], low[0, i] = phi
                state[TURNS, i], state[V, i], low[1, i] = turns, w0, 0.0
                fixed[PF, i], fixed[PG, i], fixed[PDG, i] = p[BOUND_F], p[BOUND_G], p[BOUND_DG]
                square = p[BOUND_DG] + p[BOUND_F] * (abs(w0) + 0.25 * p[BOUND_F])
                state[RATE, i] = abs(w0) + math.sqrt(square)
                state[SIGN, i] = start_sign(p, phi[0], w0)
                fixed[NEXT, i], row[i], column[i], sizes[i] = times[waiting, 0], waiting, 0, size
            waiting += 1
    return waiting


@kernel
def flow_trajectories(P, starts, times, tolerance, limit, planes, turnings, status):
    """As `lockstep.trajectories`; `tolerance` has no meaning here."""
    work = np.zeros((lockstep.ROWS, LANES))
    T, state, before, fixed, taken, fate = lockstep.split(work)
    S, C, W = (
        np.zeros((LOWER + PAIRS, LANES)),
        np.zeros((LOWER + PAIRS, LANES)),
        np.zeros((LOWER + PAIRS, LANES)),
    )
    low, low_before = np.zeros((2, LANES)), np.zeros((2, LANES))
    six, sums = np.zeros((SIX, LANES)), np.zeros((9, LANES))
    fixed[NEXT, :] = math.inf  # of lanes that stay free, too
    row, sizes = np.full(LANES, -1), np.zeros(LANES, dtype=np.int64)
    column = np.zeros(LANES, dtype=np.int64)
    waiting, lanes = np.int64(0), min(LANES, (len(P) + VECTOR - 1) // VECTOR * VECTOR)
    waiting = _refill(P, starts, times, waiting, state, low, fixed, six, row, column, sizes, status)
    while busy(row):
        _begin(S, C, W, state, low, sums, lanes)
        _expand(S, C, W, T, six, sums, lanes)
        for i in range(LANES):
            lockstep.vary_lane(T, i)
        _advance(W, T, state, before, low, low_before, fixed, taken[lockstep.DT], fate, sums, lanes)
        lockstep.note_turnings(state)
        for i in range(LANES):
            if row[i] >= 0 and lockstep.passed(fate[i]):
                first = column[i]
                column[i], narrow = _serve(
                    W, T, state, before, low_before, fixed, taken[lockstep.DT], i, times, row[i], first, sizes[i],
                    planes, sums
                )  # fmt: skip
                if turnings.shape[1] > 0:
                    lockstep.turnings_at(
                        work.reshape(-1), i, planes, row[i], first, column[i], turnings
                    )
                if not narrow:
                    fate[i] = lockstep.LOST
        if lockstep.free(limit, times, row, column, sizes, state, fixed, fate, planes, status):
            waiting = _refill(
                P, starts, times, waiting, state, low, fixed, six, row, column, sizes, status
            )
