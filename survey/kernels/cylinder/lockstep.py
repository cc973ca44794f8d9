"""Many trajectories of a flow on the cylinder in lock step: Taylor series in t, one lane a
solution, its own steps.

The 16th root that limits a step is taken from the bits of a number, so no lane calls libm, and the loops over
lanes are vector code. In axes turned by a (symmetry S4 of `gyrostat.md`) c23 = 0, and psi = phi - a obeys,
with S = sin psi, C = cos psi,

    psi' = w,  S' = C w,  C' = -S w,  w' = b12 S' + b31 C' - d C S + s2 C - s3 S        (57):

three Cauchy products. Each step computes S and C afresh. Errors are carried as in `steps`, by the
variational equation in its Lienard form (`flow.variation`), to order LOW.

Steps never depend on the requested times: those within a step are evaluated from its series, for GROUP
lanes at once. Nor does any solution depend on its neighbours. A lane that has finished takes the next row.

The loops over lanes are short, and sums end with the latest coefficients: processors overlap iterations only
while these are independent and fit into the window of instructions that they reorder.
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
    finite,
    start_sign,
)
from survey.kernels.jit import inline, kernel, part, splice
from survey.kernels.math.roots import sixteenth_root
from survey.kernels.math.roundoff import ROUNDOFF_UP
from survey.kernels.unroll import (
    both,
    consecutive,
    counted,
    first_of,
    fma,
    largest,
    put,
    root,
    selected,
    smallest,
    spread,
    transposed,
    unroll,
)

ORDER = 16
LOW = 6
LANES = 32
GROUP = 8  # lanes that are served together, and times of each

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
# Rows of the step: how long it is, and what its series leaves out of w at its end.
(DT, CUT) = range(2)
STEP = 2
# Where the tables begin in the work space of all lanes: the series, the states after and before the
# step, what stays fixed, the step, what has become of the lane; for each of GROUP times how long after the
# start of the step it is, what is found there, and whether bars are narrow enough (1 or 0); how many of these
# times lie in the step, and the column of the first time in the step.
AFTER = TABLE
BEFORE = AFTER + STATE
WHAT_STAYS = BEFORE + STATE
OF_STEP = WHAT_STAYS + FIXED
FATE = OF_STEP + STEP
FOUND = FATE + 1
EACH = rc.STATE + 2
NUMBER = FOUND + EACH * GROUP
BEGAN = NUMBER + 1
ROWS = BEGAN + 1

# what a step has made of a lane, or the sum of both: it has passed its next time
PASSED, LOST = 1.0, 2.0
# Shorter steps have only a share of the tolerance, so that many short ones add up to what a few
# long ones do.
SHORT = 1.0 / 8.0
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


def _orders(n):
    """What adds the coefficients n + 1 and n + 2 of the series of S, C and w of a lane, whose sums take the
    same earlier coefficients: these are fetched once.
    """

    @unroll
    def expand(T, fixed, i):
        p12, p31, p2, p3, pd = (fixed[row, i] for row in (P12, P31, P2, P3, PD))
        s, c, w = ([T[row + k, i] for k in range(n + 1)] for row in (SIN, COS, W))
        sums = {n: (), n + 1: ()}
        for k in range(1, n + 1):
            for m in sums if k < n else (n + 1,):
                sums[m] = _plus(sums[m], (c[k], w[m - k]), (s[k], w[m - k]), (c[k], s[m - k]))
        for m, known in sums.items():  # what waits for the latest coefficients comes last
            known = _plus(known, (c[m], w[0]), (s[m], w[0]), (c[m], s[0]))
            if m > 0:
                known = _plus(known, (c[0], w[m]), (s[0], w[m]), (c[0], s[m]))
            cw, sw, cs = known
            r, g = 1.0 / (m + 1), fma(-pd, cs, fma(-p3, s[m], p2 * c[m]))
            s.append(cw * r)
            c.append(-sw * r)
            w.append(fma(-p31, sw, fma(p12, cw, g)) * r)
            for row, series_of in ((SIN, s), (COS, c), (W, w)):
                T[row + m + 1, i] = series_of[m + 1]

    return expand


def _plus(sums, *products):
    """Each of the sums with the product of two numbers more."""
    if not sums:
        return tuple(a * b for a, b in products)
    return tuple(fma(a, b, rest) for (a, b), rest in zip(products, sums, strict=True))


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


_to_2, _to_4, _to_6, _to_8, _to_10, _to_12, _to_14, _to_16 = map(_orders, range(0, ORDER, 2))


@unroll
def vary_lane(T, i):
    """Series of the variations of lane i, u' = f u + z, z' = g' u, from those of f and g' in T."""
    f, dg = ([T[row + n, i] for n in range(LOW + 1)] for row in (F_, DG))
    for first, u, z in ((U1, [1.0], [-f[0]]), (U2, [0.0], [1.0])):
        for n in range(LOW):
            r = 1.0 / (n + 1)
            fu, gu = convolved(f, u, n), convolved(dg, u, n)
            u.append((fu + z[n]) * r)
            z.append(gu * r)
        for n in range(LOW + 1):
            T[first + n, i], T[first + LOW + 1 + n, i] = u[n], z[n]


def convolved(a, b, n):
    """The coefficient n of the product of two series; the latest coefficients of b come last."""
    total = a[n] * b[0]
    for k in range(n - 1, -1, -1):
        total = fma(a[k], b[n - k], total)
    return total


@unroll
def _functions(T, fixed, i):
    """Series of f and g' of lane i."""
    p12, p31, p2, p3, pd = (fixed[row, i] for row in (P12, P31, P2, P3, PD))
    s, c = ([T[row + n, i] for n in range(LOW + 1)] for row in (SIN, COS))
    for n in range(LOW + 1):
        double = -2.0 * convolved(s, s, n)
        double = 1.0 + double if n == 0 else double  # cos 2 psi
        T[F_ + n, i] = fma(-p31, s[n], p12 * c[n])
        T[DG + n, i] = fma(-p3, c[n], fma(-p2, s[n], -pd * double))


@inline
def series(T, state, fixed):
    """All coefficients of all lanes; in several loops, since one has more numbers than there are
    registers.
    """
    _begin(T, state)
    for i in range(LANES):
        _to_2(T, fixed, i)
    for i in range(LANES):
        _to_4(T, fixed, i)
    for i in range(LANES):
        _to_6(T, fixed, i)
    for i in range(LANES):
        _to_8(T, fixed, i)
    for i in range(LANES):
        _to_10(T, fixed, i)
    for i in range(LANES):
        _to_12(T, fixed, i)
    for i in range(LANES):
        _to_14(T, fixed, i)
    for i in range(LANES):
        _to_16(T, fixed, i)
    for i in range(LANES):
        _functions(T, fixed, i)
    for i in range(LANES):
        vary_lane(T, i)


@inline
def split(work):
    """The parts of the work array: series, state, state before the step, what stays fixed, the step, what
    has become of lanes.
    """
    return (
        work[:AFTER],
        work[AFTER:BEFORE],
        work[BEFORE:WHAT_STAYS],
        work[WHAT_STAYS:OF_STEP],
        work[OF_STEP:FATE],
        work[FATE],
    )


@inline
def step(T, state, before, fixed, taken, fate, tolerance):
    """One step of every lane."""
    series(T, state, fixed)
    advance(T, state, before, fixed, taken, fate, tolerance)
    note_turnings(state)


@inline
def advance(T, state, before, fixed, taken, fate, tolerance):
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
        size = size * max(1.0, SHORT * state[RATE, i])
        size = size / (tolerance * (1.0 + abs(w)))
        # within `flow.longest_step` w has one zero at most
        square = fixed[PDG, i] + fixed[PF, i] * (abs(w) + 0.25 * fixed[PF, i])
        rate = max(sixteenth_root(size) if size > 0.0 else 0.0, math.sqrt(square)) + 1e-150
        dt = 1.0 / rate
        due = (fixed[NEXT, i] - state[TIME, i]) - state[TIME_LOW, i] <= dt
        high = state[TIME, i] + dt
        state[TIME_LOW, i] += dt - (high - state[TIME, i])
        state[TIME, i], state[RATE, i] = high, rate
        taken[DT, i], fate[i] = dt, PASSED if due else 0.0
    for i in range(LANES):
        rise, v = moved(coefficients(T, i), taken[DT, i])
        state[PSI, i], state[V, i] = state[PSI, i] + rise, v
    for i in range(LANES):
        v, dt, ends = state[V, i], taken[DT, i], last_terms(T, i)
        cut = left_out(ends, dt)
        # where the series ends nothing limits the step, and 0 times a power that overflows is NaN
        cut = cut if ends[0] + ends[1] + ends[2] + ends[3] > 0.0 else 0.0
        taken[CUT, i] = cut
        carried = state[SAA, i], state[SAB, i], state[SBB, i]
        jacobian = varied(variations(T, i), dt)
        saa, sab, sbb = carried_on(carried, jacobian, dt, v, cut, fixed[PF, i], fixed[PG, i])
        state[SAA, i], state[SAB, i], state[SBB, i] = saa, sab, sbb
        state[STEPS, i] += 1.0
        good = saa < TRUST and sbb < (1.0 + abs(v)) * (1.0 + abs(v))
        fate[i] += 0.0 if good else LOST


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
    return u1, u2, fma(f, u1, z1), fma(f, u2, z2)


def polynomial(coefficients, x):
    *lower, total = coefficients
    for coefficient in reversed(lower):
        total = fma(total, x, coefficient)
    return total


@unroll
def last_terms(T, i):
    """The sizes of the last term of w, of the one before, and those of the two before these, times FALL."""
    last, previous, third, fourth = (abs(T[W + ORDER - n, i]) for n in range(4))
    return last, previous, FALL * third, FALL * fourth


@unroll
def left_out(ends, h):
    """What a series leaves out at h beyond its last term, of order ORDER: as much as its last terms
    (`ends`, from `last_terms`, of which one may be small by accident) where these fall by a third in two
    orders, more where they fall less: what follows the last two is bounded with the help of the others.
    """
    last, previous, third, fourth = ends
    h2 = h * h
    h4 = h2 * h2
    high, low = (last * h + previous) * h2, largest(third * h, fourth)
    fallen = smallest(FALL * high / (low + 1e-300), 0.9)
    return h4 * h4 * h4 * h * largest(high + low, high * (2.0 * fallen / (1.0 - fallen)))


@unroll
def carried_on(carried, jacobian, dt, v, cut, most_f, most_g):
    """The error ellipse at dt in a step, where w = v, from the one at its start, if its series leaves out `cut`
    of w.
    """
    saa, sab, sbb = carried
    u1, u2, z1, z2 = jacobian
    speed = most_f * abs(v) + most_g
    e = cut * dt * (1.0 / ORDER) + ROUNDOFF_UP * (4.0 + 3.0 * dt * (abs(v) + dt * speed))
    g = cut + ROUNDOFF_UP * (1.5 * abs(v) + 8.0 * dt * speed)
    first, second = fma(u1, saa, u2 * sab), fma(u1, sab, u2 * sbb)
    third, fourth = fma(z1, saa, z2 * sab), fma(z1, sab, z2 * sbb)
    e, g = e * e, g * g
    return (  # squares that cancel leave rounding of either sign
        largest(fma(u1, first, fma(u2, second, e)), e),
        fma(z1, first, z2 * second),
        largest(fma(z1, third, fma(z2, fourth, g)), g),
    )


@unroll
def ellipse(carried, jacobian, dt, v, ends, most_f, most_g):
    """The error ellipse at dt in a step, where w = v, from the one at its start; `ends` as in `left_out`."""
    return carried_on(carried, jacobian, dt, v, left_out(ends, dt), most_f, most_g)


@inline
def note_turnings(state):
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
def moved(c, dt):
    """The change of psi, and w, at dt; even and odd powers apart: half as long a chain."""
    square = dt * dt
    x = [c[n] * (1.0 / (n + 1)) for n in range(ORDER + 1)]
    rise, v = (fma(polynomial(a[2::2], square), dt, polynomial(a[1::2], square)) for a in (x, c))
    return fma(rise, dt, c[0]) * dt, fma(v, dt, c[0])


@inline
def passed(fate):
    """Has a lane passed its next time?"""
    return (fate == PASSED) | (fate == PASSED + LOST)


def at_lanes(row, size):
    """What reads `size` rows, from `row` on, of GROUP lanes of the work space in one row."""

    @unroll
    def read(work, first):
        # of one array, whose rows are LANES apart: offsets known to LLVM, which else computes 40 products a call
        return tuple(consecutive(work, (first + LANES * (row + n),), GROUP) for n in range(size))

    return read


_coefficients_at, _variations_at = at_lanes(W, ORDER + 1), at_lanes(U1, 5 * (LOW + 1))
_after_at, _before_at = at_lanes(AFTER, STATE), at_lanes(BEFORE, STATE)
_fixed_at, _step_at = at_lanes(WHAT_STAYS, FIXED), at_lanes(OF_STEP, STEP)


@unroll
def _find(work, first, at):
    """Find phi, w and their bars of GROUP lanes, from the `first` on, each at one time in its step. The times, from
    the starts of the steps, stand in the row at `at`; what is found, and whether bars are narrow enough (1 or
    0), is written to the rows after it. Returns how many are not narrow enough.
    """
    after, before, fixed = _after_at(work, first), _before_at(work, first), _fixed_at(work, first)
    _end, cut = _step_at(work, first)
    dt = consecutive(work, (at,), GROUP)
    part = dt * after[RATE]
    part = part * part
    part = part * part
    cut = cut * (part * part * part)  # falls as the 13th power at least, see `left_out`
    x, v = moved(_coefficients_at(work, first), dt)
    carried = before[SAA], before[SAB], before[SBB]
    jacobian = varied(_variations_at(work, first), dt)
    saa, _sab, sbb = carried_on(carried, jacobian, dt, v, cut, fixed[PF], fixed[PG])
    share, turns, angle = 2.0 * after[STEPS], after[TURNS], fixed[TURN]
    wide, high = 1.01 * root(share * saa), 1.01 * root(share * sbb)  # as `steps.bar`
    narrow = both(wide <= TRUST, high <= TRUST * (1.0 + abs(v)))
    slip = 3e-16 * (abs(turns) * TWO_PI + abs(angle))  # rounds where these are added to psi
    found = {
        rc.PHI: ((before[PSI] + x) + angle) + turns * TWO_PI,
        rc.W: v,
        rc.PHI_BAR: wide + slip,
        rc.W_BAR: high,
        rc.STATE: selected(narrow, spread(1.0, dt)),
    }
    for row, numbers in found.items():
        put(work, (at + LANES * (1 + row),), numbers)
    return GROUP - counted(narrow)


@unroll
def _ahead(work, first, times, row, column):
    """Note how long after the starts of their steps the next times of GROUP lanes are, from the `first` on. NUMBER
    holds how many times are left; afterwards, how many of the next GROUP lie in the step.
    """
    lanes = []
    for i in range(GROUP):
        start, low, end, left = (
            work[first + (i + LANES * n)]
            for n in (BEFORE + TIME, BEFORE + TIME_LOW, OF_STEP + DT, NUMBER)
        )
        asked = first_of(GROUP, left)
        dt = (consecutive(times, (row[first + i], column[first + i]), GROUP, asked) - start) - low
        within = both(asked, dt <= end)
        work[first + (i + LANES * NUMBER)] = counted(within)
        lanes.append(selected(within, dt))
    for s, dt in enumerate(transposed(lanes)):
        put(work, (first + LANES * (FOUND + EACH * s),), dt)


@unroll
def _keep(work, first, row, column, planes):
    """Record what was found of GROUP lanes, from the `first` on, at the first NUMBER times of each."""
    number = [work[first + (i + LANES * NUMBER)] for i in range(GROUP)]
    for n in range(rc.STATE):
        places = [first + LANES * (FOUND + EACH * s + 1 + n) for s in range(GROUP)]
        found = transposed([consecutive(work, (at,), GROUP) for at in places])
        for i in range(GROUP):
            put(
                planes, (n, row[first + i], column[first + i]), found[i], first_of(GROUP, number[i])
            )


@part
def _lose(work, i):
    """Lane i is lost at the first of its times at which bars are too wide."""
    for s in range(int(work[LANES * NUMBER + i])):
        if not work[LANES * (FOUND + EACH * s + 1 + rc.STATE) + i] > 0.0:
            work[LANES * NUMBER + i], work[LANES * FATE + i] = s, LOST
            break


@kernel
def record(work, times, row, column, sizes, planes, turnings):
    """Record the times that lie in the step of each lane, of the work space in one row; lanes whose bars
    are too wide are lost.
    """
    for i in range(LANES):
        work[LANES * BEGAN + i] = column[i]
    for first in range(0, LANES, GROUP):
        most = 1.0 * GROUP
        while most == GROUP:
            most, wide = 0.0, 0.0
            for i in range(first, first + GROUP):
                due = passed(work[LANES * FATE + i])
                work[LANES * NUMBER + i] = sizes[i] - column[i] if due else 0.0
                most = max(most, work[LANES * NUMBER + i])
            if most == 0.0:
                break
            _ahead(work, first, times, row, column)
            most = 0.0
            for i in range(first, first + GROUP):
                most = max(most, work[LANES * NUMBER + i])
            for s in range(int(most)):
                wide += _find(work, first, first + LANES * (FOUND + EACH * s))
            if wide > 0.0:
                for i in range(first, first + GROUP):
                    _lose(work, i)
            _keep(work, first, row, column, planes)
            for i in range(first, first + GROUP):
                column[i] += int(work[LANES * NUMBER + i])
    if turnings.shape[1] > 0:
        for i in range(LANES):
            if row[i] >= 0:
                began = int(work[LANES * BEGAN + i])
                turnings_at(work, i, planes, row[i], began, column[i], turnings)


@part
def turnings_at(work, i, planes, k, first, last, turnings):
    """The turning points before the times `first` to `last` - 1 of row k, which lie in the step of lane i."""
    before = LANES * BEFORE + i
    count, sign = work[before + LANES * COUNT], work[before + LANES * SIGN]
    # then w is 0 at the start and nowhere else
    from_rest = work[before + LANES * STEPS] == 0.0 and work[before + LANES * V] == 0.0
    known = work[before + LANES * UNSURE] < 3.0 and count >= 0.0
    for j in range(first, last):
        v = planes[rc.W, k, j]
        turned = sign * v < 0.0 and not from_rest
        sure = known and (abs(v) > planes[rc.W_BAR, k, j] or from_rest)
        turnings[k, j] = int(count) + turned if sure else UNDETERMINED


@inline
def nothing(planes, k, first):
    """Nothing is known in row k from the `first` column on."""
    for n in range(rc.STATE):
        for j in range(first, planes.shape[2]):
            planes[n, k, j] = math.nan


@kernel
def _refill(P, starts, times, waiting, state, fixed, row, column, sizes, status):
    """Give free lanes the rows that wait; returns the first that still waits."""
    for i in range(LANES):
        while waiting < len(P) and row[i] < 0:
            size = finite(times[waiting])
            if size == 0:
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
                fixed[NEXT, i], row[i], column[i], sizes[i] = times[waiting, 0], waiting, 0, size
            waiting += 1
    return waiting


@inline
def due(row, fate, state, limit):
    """Has a lane that has a row passed its next time, or come to its end? As a rule none has."""
    number = 0
    for i in range(LANES):
        ended = (fate[i] != 0.0) | (state[STEPS, i] >= limit)
        number += np.int64((row[i] >= 0) & ended)
    return number > 0


@part
def free(limit, times, row, column, sizes, state, fixed, fate, planes, status):
    """Note the next time of each lane, and free those that have ended; returns whether any has."""
    freed = False
    for i in range(LANES):
        if row[i] < 0 or (fate[i] == 0.0 and state[STEPS, i] < limit):
            continue
        r, ending = row[i], -1
        if column[i] == sizes[i]:
            ending = OK
        elif fate[i] >= LOST:
            ending = NO_CONVERGENCE if math.isfinite(state[V, i]) else OVERFLOW
        elif state[STEPS, i] >= limit:
            ending = STEP_LIMIT
        fixed[NEXT, i] = times[r, column[i]] if ending < 0 else math.inf
        if ending >= 0:
            nothing(planes, r, column[i])
            status[r], row[i], freed = ending, -1, True
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
    T, state, before, fixed, taken, fate = split(work)
    flat, tolerance = work.reshape(-1), min(tolerance, COARSEST)
    row, sizes = np.full(LANES, -1), np.zeros(LANES, dtype=np.int64)
    column = np.zeros(LANES, dtype=np.int64)
    fixed[NEXT, :] = math.inf  # of lanes that stay free, too
    waiting = np.int64(0)  # a literal 0 would have `_refill` compiled twice
    waiting, steps = _refill(P, starts, times, waiting, state, fixed, row, column, sizes, status), 0
    while busy(row):
        step(T, state, before, fixed, taken, fate, tolerance)
        steps += LANES
        if not due(row, fate, state, limit):
            continue
        record(flat, times, row, column, sizes, planes, turnings)
        if free(limit, times, row, column, sizes, state, fixed, fate, planes, status):
            waiting = _refill(P, starts, times, waiting, state, fixed, row, column, sizes, status)
    return steps
