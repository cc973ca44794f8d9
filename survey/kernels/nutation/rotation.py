"""The rotation of the body at given times: momenta across the line of nodes, and where a nutation
has its origin.

p_theta = -A u'/s and X = (b - a u)/s with s = sin theta, signed: on motions that pass a pole
exactly, psi and phi go without their jumps of pi there, and s changes its sign instead. Time from
the lower turning point as in `motion`.
"""

from math import floor, inf, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.math.elliptic import MEANS, means
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import records as rc
from survey.kernels.nutation import wells as nu
from survey.kernels.nutation.motion import angles, cosine_by_means, first_kind, locate, rates

# at a time: sin theta (signed), p_theta, X; of a start: time since u = ul, psi and phi since then,
# less drift
SINE, P_THETA, ACROSS = range(3)
SINCE, PSI_SINCE, PHI_SINCE = range(3)
PLACE = 3
# Values, then their bounds.
VALUES, BARS = range(2)
FIRST_ORDER = 0.03  # of a radian of the nutation: greater errors of time are not of first order


@inline
def begin(row, start, period):
    """(1 + c)/2, (1 - c)/2, z, the rate of z, a quarter of its period and k' at the start, as in `motion`."""
    roots = sqrt(row[nu.Q_LOW]), sqrt(row[nu.Q_HIGH])
    g = roots[0] * roots[1]
    kc, rate = sqrt(0.5 * nu.above(row, g) / g), sqrt(g)
    quarter = 0.25 * period[rc.PERIOD] * rate
    done, left = start[rc.DONE] * roots[1], start[rc.LEFT] * roots[0]
    low, high = left / (done + left), done / (done + left)
    sine, c = 2.0 * sqrt(low * high), low - high
    z = first_kind(sine, c, kc) if c >= 0.0 else 2.0 * quarter - first_kind(sine, -c, kc)
    return low, high, z, rate, quarter, kc


@kernel
def origins(rows, starts, periods, out):
    """Fill `out` (n, 2, PLACE), VALUES and BARS: SINCE in units of A, negative where u = ul comes
    after t = 0.
    """
    at = np.empty(rc.LOCATED)
    for i in range(len(rows)):
        row, period = rows[i], periods[i]
        low, high, z, rate, quarter, kc = begin(row, starts[i], period)
        locate(row, low, high, low - high, (sqrt(row[nu.Q_LOW]), sqrt(row[nu.Q_HIGH])), kc, at)
        down = 0.25 * (period[rc.PRECESSION] + period[rc.SPIN])
        first, second = angles(row, z / rate, 0.5 * period[rc.PERIOD], down, at)
        side = starts[i, rc.DIRECTION]
        out[i, VALUES, SINCE] = side * z / rate
        out[i, VALUES, PSI_SINCE], out[i, VALUES, PHI_SINCE] = (
            side * (first + second),
            side * (second - first),
        )
        relative = period[rc.PERIOD_BAR] / period[rc.PERIOD]
        speed = row[nu.WIDTH] * sqrt(at[rc.RISEN] * at[rc.TO_RISE]) * at[rc.ROOT]
        delay = (
            starts[i, rc.START_BAR] / max(speed, nu.TINY)
            + (16.0 * ROUNDOFF + relative) * (1.0 + quarter) / rate
        )
        up, down_rate = rates(row, at)
        bar = (abs(up) + abs(down_rate)) * delay + (24.0 * ROUNDOFF + 2.0 * relative) * (
            abs(first) + abs(second)
        )
        bar += period[rc.PRECESSION_BAR] + period[rc.SPIN_BAR] + 24.0 * ROUNDOFF * abs(down)
        out[i, BARS, SINCE], out[i, BARS, PSI_SINCE], out[i, BARS, PHI_SINCE] = delay, bar, bar
        if delay * rate > FIRST_ORDER:
            out[i, BARS] = inf


@kernel
def fill_angles(rows, starts, periods, times, out):
    """Fill `out` (n, m, 2, PLACE), VALUES and BARS, at `times` (n, m), in units of A."""
    pairs, at = np.empty((2, MEANS)), np.empty(rc.LOCATED)
    for i in range(len(rows)):
        row, period = rows[i], periods[i]
        low, high, z0, rate, quarter, kc = begin(row, starts[i], period)
        roots = sqrt(row[nu.Q_LOW]), sqrt(row[nu.Q_HIGH])
        last = means(kc, pairs)
        locate(row, low, high, low - high, roots, kc, at)
        speed = row[nu.WIDTH] * sqrt(at[rc.RISEN] * at[rc.TO_RISE]) * at[rc.ROOT]
        start_delay = starts[i, rc.START_BAR] / max(speed, nu.TINY)
        z0 *= starts[i, rc.DIRECTION]
        relative = period[rc.PERIOD_BAR] / period[rc.PERIOD]
        for j in range(times.shape[1]):
            n = floor((z0 + rate * times[i, j]) / (4.0 * quarter) + 0.5)
            z = z0 + rate * (times[i, j] - n * period[rc.PERIOD])
            rising = 1.0 if z >= 0.0 else -1.0
            low, high, c = cosine_by_means(min(abs(z), 2.0 * quarter), kc, quarter, pairs, last)
            locate(row, low, high, c, roots, kc, at)
            delay = (relative + 4.0 * ROUNDOFF) * abs(times[i, j]) + start_delay
            delay += (16.0 * ROUNDOFF + relative) * (1.0 + quarter) / rate
            # passages of u = ul since the motion's first lower turning point, and of u = uh: the
            # sides of the poles
            side = 1.0
            if row[nu.LOW_MINUS] == 0.0 and (n + (z < 0.0) - (z0 < 0.0)) % 2.0 != 0.0:
                side = -1.0
            if row[nu.HIGH_PLUS] == 0.0 and n % 2.0 != 0.0:
                side = -side
            _place(row, at, rising, side, delay, out[i, j])
            if delay * rate > FIRST_ORDER:
                out[i, j, BARS] = inf


@kernel
def _place(row, at, rising, side, delay, out):
    """Of one time, from the numbers `at` of `motion.locate`; an error of time, `delay`, moves them
    by their slopes.
    """
    width, near, far = row[nu.WIDTH], at[rc.TO_PLUS], at[rc.TO_MINUS]
    # P/(1 - u^2) = Q; a pole that is a turning point divides out
    height = (1.0 if row[nu.HIGH_PLUS] == 0.0 else width * at[rc.TO_RISE] / near) * (
        1.0 if row[nu.LOW_MINUS] == 0.0 else width * at[rc.RISEN] / far
    )
    sine, p_theta = sqrt(near * far), at[rc.ROOT] * sqrt(height)
    one = 0.5 * row[nu.MINUS] * sqrt(far / near) if row[nu.MINUS] != 0.0 else 0.0
    two = 0.5 * row[nu.PLUS] * sqrt(near / far) if row[nu.PLUS] != 0.0 else 0.0
    across, least = one + two, max(sine, nu.TINY)
    slope = (two - one) / least if one != 0.0 or two != 0.0 else 0.0
    out[VALUES, SINE], out[VALUES, P_THETA], out[VALUES, ACROSS] = (
        side * sine,
        -side * rising * p_theta,
        side * across,
    )
    noise = row[nu.NOISE_ENDS] + 16.0 * ROUNDOFF
    tilt = p_theta * delay + noise * min(near, far) / least
    out[BARS, SINE] = abs(at[rc.HERE]) * tilt + 4.0 * ROUNDOFF * sine
    relative = 0.5 * (row[nu.NOISE_LOW] + row[nu.NOISE_HIGH]) + row[nu.NOISE_WIDTH] + noise
    out[BARS, P_THETA] = (
        abs(row[nu.K] * at[rc.HERE]) * sine + abs(across * slope)
    ) * delay + relative * p_theta
    out[BARS, ACROSS] = abs(slope) * tilt + 8.0 * ROUNDOFF * (abs(one) + abs(two))
