"""The flow on the cylinder phi' = w, w' = f(phi) w + g(phi): coefficients, Taylor series,
variational equation.

f = b12 cos phi - b31 sin phi = F',  F = b12 sin phi + b31 cos phi,
g = -d cos phi sin phi - c23 cos 2phi + s2 cos phi - s3 sin phi = -V'            (57), corrected reading.

A step keeps its work in one table T[n, row]: the coefficient of (t - t_n)^n of each quantity (rows
below), and in the last line T[LAST] what a method notes about the step (its truncation error, its
step size).

A row p with more than COLUMNS columns holds any other f and g, as a `program`; on a line, where
`on_circle` is False, phi is not taken mod 2 pi, and the bounds in p are those near the angle of the
last `series`. Rows of the gyrostat are read-only arrays: by that kernels for them are compiled
without the program (see `for_constants`).
"""

import math

import numpy as np

from survey.kernels.cylinder import bounds, program
from survey.kernels.cylinder.program import COLUMNS, ON_CIRCLE
from survey.kernels.cylinder.records import GIVEN, PHI0, SIX, START_PHI, START_W, W0
from survey.kernels.jit import for_constants, inline, kernel, part
from survey.kernels.math.roundoff import ROUNDOFF_UP
from survey.kernels.unroll import consecutive, element, permuted, put, summed, unroll

# of the Taylor series in t; near -ln(eps)/2 + 1 = 19 the work per unit of time is least (Jorba &
# Zou)
ORDER = 20
LOW = 8  # order of the series of the variational equation, which only carries error bounds
LAST = ORDER + 1
ROWS = 14
PHI, W, SIN, COS, SIN2, COS2, E, Y, U1, Z1, U2, Z2, F_, DG = range(ROWS)
# E = integral of f (exp E is the area factor), Y = integral of g (the change of w - F), U, Z the
# variations of phi and of y = w - F for unit changes of phi (1) and w (2), F_ = f, DG = g'.

# Columns of T[LAST]. WEIGHT: sum of |b_i| over the stages of a Runge-Kutta step, which all round phi; 0 for series.
TRUNC_PHI, TRUNC_W, STEP, WEIGHT = range(4)

B12, B31, D, C23, S2, S3, BOUND_F, BOUND_G, BOUND_DG, BOUND_DDG = range(10)
OF_F, OF_G = slice(B12, B31 + 1), slice(D, S3 + 1)  # the parameters of f, and those of g
TWO_PI = 2.0 * math.pi
TWO_PI_LOW = 2.4492935982947064e-16  # 2 pi - TWO_PI


def coefficients(b12, b31, d, c23, s2, s3):
    """Rows of the six parameters (arrays of one shape) and bounds of |f|, |g|, |g'|, |g''| over the
    circle.
    """
    b, c, s = np.hypot(b12, b31), np.hypot(0.5 * np.asarray(d), c23), np.hypot(s2, s3)
    P = np.stack([b12, b31, d, c23, s2, s3, b, c + s, 2.0 * c + s, 4.0 * c + s], axis=-1)
    P.flags.writeable = False
    return P


@inline
def _always(p):
    return True


@for_constants(_always)
def on_circle(p):
    """Do f and g have the period 2 pi?"""
    return len(p) == COLUMNS or p[ON_CIRCLE] > 0.0


@inline
def _length(x, y):
    """sqrt(x^2 + y^2); libm's takes six times as long."""
    square = x * x + y * y
    return math.sqrt(square) if 1e-280 < square and square < 1e280 else math.hypot(x, y)


@kernel
def spread(rows, P, starts):
    """Fill P with the `coefficients` of rows of GIVEN numbers (see `records`), and starts with
    their phi0, w0.
    """
    for i in range(len(rows)):
        starts[i, START_PHI], starts[i, START_W] = rows[i, PHI0], rows[i, W0]
        for k in range(SIX):
            P[i, k] = rows[i, k]
        b = _length(P[i, B12], P[i, B31])
        c = _length(0.5 * P[i, D], P[i, C23])
        s = _length(P[i, S2], P[i, S3])
        P[i, BOUND_F], P[i, BOUND_G], P[i, BOUND_DG], P[i, BOUND_DDG] = (
            b,
            c + s,
            2.0 * c + s,
            4.0 * c + s,
        )


@kernel
def spread_programs(rows, P, starts):
    """As `spread`, of programs."""
    for i in range(len(rows)):
        starts[i, START_PHI], starts[i, START_W] = rows[i, PHI0], rows[i, W0]
        for k in range(P.shape[1]):
            P[i, k] = rows[i, k if k < SIX else k + GIVEN - SIX]


@inline
def _no_bounds_needed(p, phi, w):
    pass


@for_constants(_no_bounds_needed)
def bound_start(p, phi, w):
    """On a line, write bounds near phi into p, where a solution starts with w."""
    if not on_circle(p):
        bounds.bound_near(p, phi, w)


@inline
def gyrostat(p, phi):
    """f, g, g' at phi, where p is no program."""
    s, c = math.sin(phi), math.cos(phi)
    s2, c2 = 2.0 * s * c, (c - s) * (c + s)
    f = p[B12] * c - p[B31] * s
    g = -0.5 * p[D] * s2 - p[C23] * c2 + p[S2] * c - p[S3] * s
    dg = -p[D] * c2 + 2.0 * p[C23] * s2 - p[S2] * s - p[S3] * c
    return f, g, dg


@for_constants(gyrostat)
def values(p, phi):
    """f, g, g' at phi."""
    return program.values(p, phi) if len(p) > COLUMNS else gyrostat(p, phi)


@inline
def potential(p, phi):
    """V = (d/2) sin^2 phi + (c23/2) sin 2phi - s2 sin phi - s3 cos phi, g = -V'."""
    s, c = math.sin(phi), math.cos(phi)
    return 0.5 * p[D] * s * s + p[C23] * s * c - p[S2] * s - p[S3] * c


def _to_order(order):
    """What adds the coefficients 1 to `order` of the series in T to those of order 0.

    (sin phi)' = w cos phi and the like: SIN to COS2 as one vector. Sums begin with the products that are known
    first, and end with those of the latest coefficients.
    """

    @unroll
    def expand(p, T):
        b12, b31, d, c23, s2, s3 = (p[i] for i in range(SIX))
        waves, w = [consecutive(T, (0, SIN), 4)], [T[0, W]]
        for n in range(order):
            known_first = sorted(range(n + 1), key=lambda k, n=n: max(k, n - k))
            total = summed(w[k] * waves[n - k] for k in known_first)
            r = 1.0 / (n + 1)
            sn, cn, sin2, cos2 = (element(waves[n], i) for i in range(4))
            y = (-0.5 * d * sin2 - c23 * cos2 + s2 * cn - s3 * sn) * r
            new = permuted(total, (1, 0, 3, 2), (r, -r, 2.0 * r, -2.0 * r))
            w.append(b12 * element(new, 0) + b31 * element(new, 1) + y)  # w = F + y
            waves.append(new)
            put(T, (n + 1, SIN), new)
            T[n + 1, PHI], T[n + 1, W], T[n + 1, Y] = w[n] * r, w[n + 1], y
            T[n + 1, E] = (b12 * cn - b31 * sn) * r

    return expand


_to_full, _to_low = _to_order(ORDER), _to_order(LOW)


@kernel
def _series_of_gyrostat(p, phi, w, T, order):
    s, c = math.sin(phi), math.cos(phi)
    T[0, PHI], T[0, W], T[0, SIN], T[0, COS] = phi, w, s, c
    T[0, SIN2], T[0, COS2] = 2.0 * s * c, (c - s) * (c + s)
    T[0, E] = T[0, Y] = 0.0
    if order == LOW:
        _to_low(p, T)
    else:
        _to_full(p, T)


@for_constants(_series_of_gyrostat)
def series(p, phi, w, T, order):
    """Fill rows PHI..Y of T with the series through (phi, w) up to t^order; that of a gyrostat is LOW or ORDER."""
    if len(p) == COLUMNS:
        _series_of_gyrostat(p, phi, w, T, order)
        return
    if not on_circle(p):
        bounds.bound_near(p, phi, w)
    program.in_time(p, phi, w, order, T[:, PHI], T[:, W], T[:, E], T[:, Y])


@kernel
def _rates_of_gyrostat(p, T):
    for n in range(LOW):
        T[n, F_] = p[B12] * T[n, COS] - p[B31] * T[n, SIN]
        T[n, DG] = (
            -p[D] * T[n, COS2] + 2.0 * p[C23] * T[n, SIN2] - p[S2] * T[n, SIN] - p[S3] * T[n, COS]
        )
    T[LOW, F_] = p[B12] * T[LOW, COS] - p[B31] * T[LOW, SIN]


@for_constants(_rates_of_gyrostat)
def rates(p, T):
    """Fill rows F_ and DG of T up to t^LOW, from the series of phi or of its sin and cos."""
    if len(p) > COLUMNS:
        program.along(p, T[: LOW + 1, PHI], T[: LOW + 1, F_], T[: LOW + 1, DG])
    else:
        _rates_of_gyrostat(p, T)


@part
def variation(p, T):
    """Fill rows U1..DG up to t^LOW: u' = f u + z, z' = g' u, from the series in T."""
    rates(p, T)
    T[0, U1], T[0, Z1], T[0, U2], T[0, Z2] = 1.0, -T[0, F_], 0.0, 1.0
    for n in range(LOW):
        a0 = a1 = a2 = a3 = 0.0
        for k in range(n + 1):
            u1, u2 = T[n - k, U1], T[n - k, U2]
            a0 += T[k, F_] * u1
            a1 += T[k, DG] * u1
            a2 += T[k, F_] * u2
            a3 += T[k, DG] * u2
        r = 1.0 / (n + 1)
        T[n + 1, U1], T[n + 1, Z1] = (a0 + T[n, Z1]) * r, a1 * r
        T[n + 1, U2], T[n + 1, Z2] = (a2 + T[n, Z2]) * r, a3 * r


@inline
def inside(T, dt):
    """(phi, w, integral of f, integral of g) at dt after the start of the step in T, of which
    `series` has ORDER.
    """
    phi, w, e, y = T[ORDER, PHI], T[ORDER, W], T[ORDER, E], T[ORDER, Y]
    for n in range(ORDER - 1, -1, -1):
        phi, w, e, y = phi * dt + T[n, PHI], w * dt + T[n, W], e * dt + T[n, E], y * dt + T[n, Y]
    return phi, w, e, y


@kernel
def jacobian(T, dt):
    """d(phi, w)(dt) / d(phi, w)(0) as (phi_phi, phi_w, w_phi, w_w)."""
    u1, z1, u2, z2, f = T[LOW, U1], T[LOW, Z1], T[LOW, U2], T[LOW, Z2], T[LOW, F_]
    for n in range(LOW - 1, -1, -1):
        u1, z1, u2 = u1 * dt + T[n, U1], z1 * dt + T[n, Z1], u2 * dt + T[n, U2]
        z2, f = z2 * dt + T[n, Z2], f * dt + T[n, F_]
    return u1, u2, z1 + f * u1, z2 + f * u2


@inline
def table():
    """An empty table for the steps of one trajectory."""
    return np.zeros((LAST + 1, ROWS))


@inline
def reduced(phi):
    """phi in [-pi, pi] and the number of turns taken out of it."""
    rest = math.copysign(abs(phi) % TWO_PI, phi)  # exact
    turns = math.floor((phi - rest) / TWO_PI + 0.5)
    rest -= turns * TWO_PI_LOW
    if abs(rest) > math.pi:
        k = 1.0 if rest > 0.0 else -1.0
        return (rest - k * TWO_PI) - k * TWO_PI_LOW, turns + k
    return rest, turns


@inline
def centred(phi):
    """phi in [-pi, pi], and how far off it is where turns were taken out."""
    if abs(phi) <= math.pi:
        return phi, 0.0
    rest, _turns = reduced(phi)
    return rest, 4.0 * ROUNDOFF_UP


@inline
def _longest_step_of_gyrostat(p, w):
    return 1.0 / math.sqrt(p[BOUND_DG] + p[BOUND_F] * (abs(w) + 0.25 * p[BOUND_F]) + 1e-300)


@for_constants(_longest_step_of_gyrostat)
def longest_step(p, w):
    """A step within which w has at most one zero.

    w'' - f w' - (f' w + g') w = 0; without its damping the restoring force is Q = -g' - f^2/4 - f'
    w/2, so by Sturm zeros of w are pi / sqrt(max Q) apart at least. Here a third of that.
    """
    step = _longest_step_of_gyrostat(p, w)
    limited = len(p) > COLUMNS and p[program.RADIUS] < program.UNLIMITED
    return min(step, bounds.longest_step(p, w)) if limited else step
