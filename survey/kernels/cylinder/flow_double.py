"""The flow on the cylinder in double-double arithmetic: Taylor series of order 30, for what float64
leaves open.

As `flow` and `steps`, whose error ellipse is carried here too, by the variational equation in
float64, which serves the bars only. A step expands S = sin phi, C = cos phi and w in A[quantity, hi
or lo, order]; each step computes S and C afresh.

    phi' = w,  S' = C w,  C' = -S w,  w' = b12 S' + b31 C' - d C S - c23 (1 - 2 S S) + s2 C - s3 S      (57)

Sources: those of `kernels.math.double`; A. Jorba, M. Zou, Experimental Mathematics 14 (2005) 99-117
(steps).
"""

import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.equilibria import EQUILIBRIUM_SIZE, MOST, equilibria_inside
from survey.kernels.cylinder.flow import (
    B12,
    B31,
    BOUND_DG,
    BOUND_F,
    BOUND_G,
    C23,
    COS,
    COS2,
    LOW,
    S2,
    S3,
    SIN,
    SIN2,
    TWO_PI,
    D,
    jacobian,
    longest_step,
    table,
    values,
    variation,
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
    UNDETERMINED,
    bar,
    certain,
    conclude,
    rests,
    runs_into_node,
    trusted,
    unturned,
)
from survey.kernels.cylinder.winding import ends, zeros
from survey.kernels.jit import inline, kernel
from survey.kernels.math.angles_double import centred, radians, sine_cosine
from survey.kernels.math.double import (
    add,
    convolved,
    mul,
    neg,
    over,
    shifted,
    square,
    times,
    two_prod,
)
from survey.kernels.math.newton import bracketed
from survey.kernels.math.roundoff import PAIR_ROUNDOFF, ROUNDOFF_UP

ORDER = 30
TOLERANCE = 1e-30  # truncation of one step, relative to 1 + |w|
# nearer to an equilibrium than this, relative, the direction of the flow has no digits
FLAT = 1e-22
ROUGH = 16.0 * PAIR_ROUNDOFF  # rounding of a sum or a product of the series, relative
FALL = 1.0 / 50.0  # by more, two terms further on, no series is trusted to fall
LIMIT = 20_000  # steps; about 0.4 s
# steps may grow by this factor: what needs more than LIMIT even then is given up at once
SLOWER = 3.0
_S, _C, _W = range(3)


@inline
def scratch():
    """The series of S, C and w."""
    return np.zeros((3, 2, ORDER + 1))


@inline
def force(p, s, c, sw, cw, cs, double):
    """b12 C w - b31 S w + g, from the products."""
    f = add(times(cw, p[B12]), times(sw, -p[B31]))
    g = add(times(c, p[S2]), times(s, -p[S3]))
    return add(f, add(g, add(times(cs, -p[D]), times(double, -p[C23]))))


@kernel
def acceleration(p, phi):
    """g at phi, to ROUGH times BOUND_G."""
    s, c = sine_cosine(phi)
    nothing, double = (0.0, 0.0), shifted(times(square(s), -2.0), 1.0)
    return force(p, s, c, nothing, nothing, mul(c, s), double)


@kernel
def energy(p, phi, w, rest):
    """H(phi, w) - H(rest, 0), H = w^2/2 + V, rounded; and a bound of its error for an equilibrium
    next to `rest`.
    """
    s, c = sine_cosine(centred((phi, 0.0))[0])
    s0, c0 = sine_cosine(centred((rest, 0.0))[0])
    kinetic = times(two_prod(w, w), 0.5)
    first = add(times(add(s, neg(s0)), -p[S2]), times(add(c, neg(c0)), -p[S3]))
    second = add(
        times(add(square(s), neg(square(s0))), 0.5 * p[D]),
        times(add(mul(s, c), neg(mul(s0, c0))), p[C23]),
    )
    return add(kinetic, add(first, second))[0], ROUGH * (w * w + p[BOUND_G])


@kernel
def begin(p, phi, w, A, T):
    """Expand at (phi, w), for the variational equation in T too; returns the step."""
    s, c = sine_cosine(phi)
    A[_S, 0, 0], A[_S, 1, 0] = s
    A[_C, 0, 0], A[_C, 1, 0] = c
    A[_W, 0, 0], A[_W, 1, 0] = w
    for n in range(ORDER):
        s, c = (A[_S, 0, n], A[_S, 1, n]), (A[_C, 0, n], A[_C, 1, n])
        cw = convolved(A[_C], A[_W], n)
        sw = convolved(A[_S], A[_W], n)
        cs = convolved(A[_C], A[_S], n)
        double = shifted(times(convolved(A[_S], A[_S], n), -2.0), 1.0 if n == 0 else 0.0)
        if n <= LOW:
            T[n, SIN], T[n, COS], T[n, SIN2], T[n, COS2] = s[0], c[0], 2.0 * cs[0], double[0]
        A[_W, 0, n + 1], A[_W, 1, n + 1] = over(force(p, s, c, sw, cw, cs, double), n + 1.0)
        A[_S, 0, n + 1], A[_S, 1, n + 1] = over(cw, n + 1.0)
        A[_C, 0, n + 1], A[_C, 1, n + 1] = over(neg(sw), n + 1.0)
    variation(p, T)
    h = longest_step(p, w[0])
    for n in range(ORDER - 3, ORDER + 1):
        # as in `taylor`: a last term that happens to vanish proves nothing
        share = 1.0 if n > ORDER - 2 else FALL
        term = share * max(abs(A[_W, 0, n - 1]) / n, abs(A[_W, 0, n]) / (1.0 + abs(w[0]))) + 1e-300
        h = min(h, (TOLERANCE / term) ** (1.0 / n))
    return h


@kernel
def at(phi, A, dt):
    """phi and w at dt (double-double) after the start of the step."""
    w = (A[_W, 0, ORDER], A[_W, 1, ORDER])
    x = over(w, ORDER + 1.0)
    for n in range(ORDER - 1, -1, -1):
        term = (A[_W, 0, n], A[_W, 1, n])
        w, x = add(mul(w, dt), term), add(mul(x, dt), over(term, n + 1.0))
    return add(phi, mul(x, dt)), w


@inline
def round_about(ellipse):
    """The error ellipse (phi phi, phi w, w w) as `carried` takes it."""
    a, b, c = ellipse
    return a, b, c, 1.0, 0.0, False


@inline
def spread(ellipse):
    """(phi phi, phi w, w w), and w w at a given phi, of what `carried` returns."""
    pp, pq, qq, x, y, _on = ellipse
    a, c = x * x * pp - 2.0 * x * y * pq + y * y * qq, y * y * pp + 2.0 * x * y * pq + x * x * qq
    return max(a, 0.0), x * y * (pp - qq) + (x * x - y * y) * pq, max(c, 0.0), qq / (x * x)


@kernel
def carried(p, A, T, dt, w, ellipse):
    """The error ellipse after dt of the current step: as `steps.carried`, along (x, y) and across
    it.

    (x, y) is the direction of the flow, of (w, w'), once `on` it. The flow carries its own
    direction with it: what errs along it, in time, never comes across it, and only that grows where
    solutions part, at saddles. In other axes rounding would mix the two.
    """
    pp, pq, qq, x, y, on = ellipse
    a, b, c, d = jacobian(T, dt)
    rate = 0.0
    for n in range(ORDER, 0, -1):
        rate = rate * dt + n * A[_W, 0, n]
    size, along_w, along_v = math.hypot(w, rate), a * x + b * y, c * x + d * y
    known = size > FLAT * (abs(w) + p[BOUND_G])
    if not known:
        size = math.hypot(along_w, along_v)
    u, v = (w / size, rate / size) if known else (along_w / size, along_v / size)
    across_w, across_v = b * x - a * y, d * x - c * y
    one = u * along_w + v * along_v
    shear = u * across_w + v * across_v
    two = u * across_v - v * across_w
    leak = 0.0 if on or not known else u * along_v - v * along_w
    bound = p[BOUND_F] * abs(w) + p[BOUND_G]
    e = TOLERANCE + ROUGH * (4.0 + 3.0 * dt * (abs(w) + dt * bound))
    f = TOLERANCE * (1.0 + abs(w)) + ROUGH * (1.5 * abs(w) + 8.0 * dt * bound)
    e, f = e * e, f * f
    return (
        one * one * pp + 2.0 * one * shear * pq + shear * shear * qq + u * u * e + v * v * f,
        one * leak * pp + (one * two + shear * leak) * pq + shear * two * qq + u * v * (f - e),
        leak * leak * pp + 2.0 * leak * two * pq + two * two * qq + v * v * e + u * u * f,
        u,
        v,
        on or known,
    )


@kernel
def side(p, phi, w):
    """Sign of w just after the start: that of g where w = 0, and 0 at an equilibrium."""
    g = acceleration(p, phi)[0] if w == 0.0 else w
    if abs(g) <= (4.0 * ROUGH * p[BOUND_G] if w == 0.0 else 0.0):
        return 0
    return 1 if g > 0.0 else -1


@kernel
def clean(p, phi, w, bar_phi, bar_w):
    """Is a zero of w certain near phi: does g keep its sign over the error bounds?"""
    g = abs(acceleration(p, phi)[0])
    return (
        10.0 * (p[BOUND_DG] * bar_phi + p[BOUND_F] * (abs(w) + bar_w)) + 4.0 * ROUGH * p[BOUND_G]
        < g
    )


@kernel
def trajectory(p, phi0, w0, asked, floats, turnings):
    """As `steps.trajectory`, and `winding.counts`."""
    phi, turns = centred((phi0, 0.0))
    start, still = (phi, (w0, 0.0), (0.0, 0.0, 0.0)), rests(p, phi0, w0)
    return followed(p, start, turns, (0.0, 0.0), side(p, phi, w0), still, asked, floats, turnings)


@kernel
def followed(p, start, turns, origin, sign, still, asked, floats, turnings):
    """`trajectory` from `start`: phi and w (double-doubles) and their error ellipse.

    `origin` is the time there, and its error; `sign` that of w just after it, and `still` whether
    it is an equilibrium.
    """
    A, T, eqs, end = scratch(), table(), np.zeros((MOST, EQUILIBRIUM_SIZE)), np.zeros(5)
    size, _hidden = equilibria_inside(p, eqs)
    phi, w, ellipse = start[0], start[1], round_about(start[2])
    t, at_rest, origin_bar = (origin[0], 0.0), w[0] == 0.0, origin[1]
    count, j, unsure = 0, 0, 0
    known, since = False, (0.0, 0.0)  # `end` gives the turnings after that time
    for n in range(1, LIMIT):
        h = begin(p, phi, w, A, T)
        if not (h > 0.0 and math.isfinite(h)):
            return OVERFLOW
        if asked[j] - t[0] > SLOWER * h * (LIMIT - n):
            return STEP_LIMIT
        while j < len(asked):
            dt = add((asked[j], 0.0), neg(t))
            if dt[0] >= h:
                break
            x, v = at(phi, A, dt)
            a, _b, c, _d = spread(carried(p, A, T, dt[0], v[0], ellipse))
            delay = n * ROUGH * (asked[j] - min(origin[0], 0.0)) + origin_bar  # error of the time
            wide = bar(n, a) + abs(v[0]) * delay
            high = bar(n, c) + (p[BOUND_F] * abs(v[0]) + p[BOUND_G]) * delay
            if not (wide < TRUST and high < TRUST * (1.0 + abs(v[0]))):
                return NO_CONVERGENCE
            floats[j, rc.PHI], floats[j, rc.W] = add(x, radians(turns))[0], v[0]
            floats[j, rc.PHI_BAR], floats[j, rc.W_BAR] = (
                wide + ROUNDOFF_UP * abs(floats[j, rc.PHI]),
                high + ROUNDOFF_UP * abs(v[0]),
            )
            from_rest = n == 1 and at_rest
            if still:
                turnings[j] = 0
            elif known:
                more = zeros(end, add((asked[j], 0.0), neg(since))[0])
                turnings[j] = count + more if more >= 0 else UNDETERMINED
            elif unsure < 3 and (abs(v[0]) > high or from_rest):
                turnings[j] = count + (v[0] * sign < 0.0 and not from_rest)
            j += 1
        if j == len(asked):
            return OK
        x, v = at(phi, A, (h, 0.0))
        ellipse = carried(p, A, T, h, v[0], ellipse)
        saa, _b, sbb, _d = spread(ellipse)
        t = shifted(t, h)
        phi, w = x, v
        if abs(phi[0]) > math.pi:
            phi, k = centred(phi)
            turns += k
        if not trusted(saa, sbb, w[0]):
            return NO_CONVERGENCE if math.isfinite(w[0]) else OVERFLOW
        bar_phi, bar_w = bar(n, saa), bar(n, sbb)
        if known or still or abs(w[0]) <= bar_w:
            unsure += not known
            continue
        if unsure > 2:
            unsure = LIMIT  # permanently
            continue
        count += w[0] * sign < 0.0
        sign, unsure = (1 if w[0] > 0.0 else -1), 0
        # its angle is that of float64
        known = ends(
            p,
            eqs,
            size,
            phi[0],
            w[0],
            bar_phi + ROUNDOFF_UP * abs(phi[0]),
            bar_w + ROUNDOFF_UP * abs(w[0]),
            end,
        )
        since = t
    return STEP_LIMIT


@kernel
def passage(phi, A, target, h):
    """dt in [0, h] where phi = target, for w > 0 on the step."""
    given = phi, A, target
    dt = bracketed(_to_target, at, given, 0.5 * h, (0.0, h), (1e-17 + 1e-16 * h, 0.0), 60)[1]
    return sharpened(_to_target_exactly, given, dt, h)


@inline
def _to_target_exactly(given, dt):
    phi, A, target = given
    x, w = at(phi, A, dt)
    return add(x, neg(target))[0], w[0]


@inline
def _to_target(at, given, dt):
    off, slope = _to_target_exactly(given, (dt, 0.0))
    return off, slope, off < 0.0


@kernel
def time_of_turning(p, phi, A, h):
    """dt in [0, h] where w > 0 changes sign on the step."""
    given = p, phi, A
    dt = bracketed(_to_rest, at, given, 0.5 * h, (0.0, h), (1e-17 + 1e-16 * h, 0.0), 60)[1]
    return sharpened(_to_rest_exactly, given, dt, h)


@inline
def _to_rest(at, given, dt):
    p, phi, A = given
    x, w = at(phi, A, (dt, 0.0))
    f, g, _dg = values(p, x[0])
    return w[0], f * w[0] + g, w[0] > 0.0


@inline
def _to_rest_exactly(given, dt):
    p, phi, A = given
    x, w = at(phi, A, dt)
    return w[0], values(p, x[0])[0] * w[0] + acceleration(p, x)[0]


@inline
def sharpened(residual, given, dt, h):
    """The zero next to dt in double-double; residual(given, dt) -> (value, slope)."""
    exact = (dt, 0.0)
    for _ in range(3):
        value, slope = residual(given, exact)
        move = -value / slope if slope != 0.0 else 0.0
        if not abs(move) < 1e-8 * h:
            break
        exact = shifted(exact, move)
    return exact


@kernel
def abel(p, phi0, w0, targets, floats, status):
    """As `steps.abel`."""
    phi, turns = centred((phi0, 0.0))
    j, size = 0, len(targets)
    while j < size and targets[j] == phi0:
        floats[j, rc.VALUE], status[j] = w0, OK
        floats[j, rc.TIME] = floats[j, rc.VALUE_BAR] = floats[j, rc.TIME_BAR] = 0.0
        j += 1
    sign = side(p, phi, w0)
    if sign <= 0:
        for i in range(j, size):
            status[i] = TURNING if sign < 0 else (EQUILIBRIUM if rests(p, phi0, w0) else SEPARATRIX)
            floats[i, rc.VALUE] = phi0
            floats[i, rc.TIME] = floats[i, rc.VALUE_BAR] = floats[i, rc.TIME_BAR] = 0.0
        return
    passed(p, (phi, (w0, 0.0), (0.0, 0.0, 0.0)), turns, 0.0, j, targets, floats, status)


@kernel
def passed(p, start, turns, origin, first, targets, floats, status):
    """`abel` from `start`, as that of `followed`, at the time `origin`, for the targets from number
    `first` on.
    """
    A, T = scratch(), table()
    phi, w, ellipse = start[0], start[1], round_about(start[2])
    t, n, started = (origin, 0.0), 0, w[0] > 0.0
    j, size, doubt, ending = first, len(targets), -1, OK  # doubt: the first target in doubt
    while j < size or doubt >= 0:
        if n >= LIMIT:
            ending = STEP_LIMIT
            break
        h = begin(p, phi, w, A, T)
        n += 1
        if not (h > 0.0 and math.isfinite(h)):
            ending = OVERFLOW
            break
        dt = (h, 0.0)
        x, v = at(phi, A, dt)
        turned = v[0] <= 0.0
        if turned:
            dt = time_of_turning(p, phi, A, h)
            x, v = at(phi, A, dt)
        while j < size:
            target = add((targets[j], 0.0), neg(radians(turns)))
            if add(target, neg(x))[0] > 0.0:
                break
            when = passage(phi, A, target, dt[0])
            _x, there = at(phi, A, when)
            a, _b, c, d = spread(carried(p, A, T, when[0], there[0], ellipse))
            more = (ROUGH * (abs(targets[j]) + h * there[0])) ** 2
            fill(p, floats[j], n, target, there[0], add(t, when)[0], a + more, c, d, more)
            usable = bar(n, a) < TRUST and floats[j, rc.VALUE_BAR] < TRUST * (1.0 + abs(there[0]))
            usable = usable and floats[j, rc.TIME_BAR] < TRUST * (1.0 + abs(floats[j, rc.TIME]))
            status[j] = OK if usable else NO_CONVERGENCE
            if doubt < 0 and not certain(floats[j]):
                doubt = j
            j += 1
        ellipse = carried(p, A, T, dt[0], v[0], ellipse)
        saa, _b, sbb, _d = spread(ellipse)
        bar_phi, bar_w = bar(n, saa), bar(n, sbb)
        edge = 1.1 * bar_phi + ROUGH * (1.0 + abs(x[0] + turns * TWO_PI))
        # from here on a turning point lies beyond x
        while (
            0 <= doubt < j
            and add(x, neg(add((targets[doubt], 0.0), neg(radians(turns)))))[0] > edge
        ):
            doubt += 1
        if doubt == j:
            doubt = -1
        if turned:
            ending = TURNING if clean(p, x, v[0], bar_phi, bar_w) else SEPARATRIX
            bar_t = 1.2 * bar_w / abs(acceleration(p, x)[0]) if ending == TURNING else 0.0
            end, when = add(x, radians(turns))[0], add(t, dt)[0]
            for i in range(doubt if doubt >= 0 else j, size):
                if i >= j or not certain(floats[i]):
                    status[i] = ending
                    floats[i, rc.VALUE], floats[i, rc.TIME] = end, when
                    floats[i, rc.VALUE_BAR], floats[i, rc.TIME_BAR] = (
                        edge + ROUNDOFF_UP * abs(end),
                        bar_t + ROUNDOFF_UP * when,
                    )
            return
        phi, w, t = x, v, shifted(t, h)
        if phi[0] > math.pi:
            phi, k = centred(phi)
            turns += k
        if not trusted(saa, sbb, w[0]):
            ending = NO_CONVERGENCE if math.isfinite(w[0]) else OVERFLOW
            break
        started = started or w[0] > 2.0 * bar_w
        if started and not w[0] > 2.0 * bar_w:
            ending = SEPARATRIX
            break
        if j < size and runs_into_node(p, phi[0], w[0], unturned(targets[j], turns), 0.0):
            ending = EQUILIBRIUM
            break
    conclude(ending, doubt, j, floats, status)


@inline
def fill(p, row, n, phi, w, t, a, c, d, more):
    """w, t and their bars where phi, off by the root of `more`, is passed, as
    `steps.fill_crossing`; d: w w there.
    """
    n += 1  # the target errs too
    row[rc.VALUE], row[rc.TIME] = max(w, 0.0), t
    f, g = values(p, phi[0])[0], acceleration(p, phi)[0]
    slope = (f * w + g) / w if w > 0.0 else math.inf
    spread = bar(n, d + slope * slope * more) if w > 0.0 else math.inf
    bar_phi, bar_w = bar(n, a), bar(n, c)
    if not spread < 0.1 * w:
        spread = 2.0 * (bar_w + math.sqrt(abs(2.0 * (abs(g) + abs(f) * bar_w) * bar_phi))) + w
    row[rc.VALUE_BAR] = spread + ROUNDOFF_UP * w
    accel = max(abs(f * w + g), 1e-300)
    delay = min(bar_phi / w if w > 0.0 else math.inf, spread / accel + bar_w / accel) * 1.2
    row[rc.TIME_BAR] = delay + ROUNDOFF_UP * abs(t)
