"""u, psi and phi of a nutation at given times: u by an elliptic function, the angles by R_J (S7),
(S16).

u = (ul wl + uh wh)/(wl + wh), wl = sqrt Q(uh) (1 + c)/2, wh = sqrt Q(ul) (1 - c)/2, c = cn(sqrt g
t/A), with 1 - m = (s + g)/(2 g), of any size (S17): real roots and conjugate ones are one case.
"""

from math import hypot, sqrt

import numpy as np

from survey.kernels.jit import inline
from survey.kernels.math.carlson import rf, rj_spread
from survey.kernels.math.elliptic import MEANS, jacobi, means
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import records as rc
from survey.kernels.nutation import wells as nu


@inline
def first_kind(sine, cosine, kc):
    """F(chi) from sin chi and cos chi (DLMF 19.25.5), chi <= pi/2."""
    delta = hypot(cosine, kc * sine)
    return sine * rf(cosine * cosine, 0.5 * (1.0 + delta * delta), delta)


@inline
def since(far, near, middle, spread, ratio, rest, q_origin, root, width):
    """The integral of dt/(distance from a pole) since u was at a turning point, less t/far.

    far, near: the distances from the pole of that turning point and of u; ratio = |u - that|/width, rest = 1 - ratio;
    root = sqrt Q(u). middle = X0 + s, next to 0 where the motion nearly stops; spread = g^2 - s^2.
    """
    if ratio < 1e-290:
        return 0.0
    x = q_origin * rest / ratio
    third = rj_spread(
        x, middle, sqrt(q_origin) * root / ratio, spread, q_origin * near / (ratio * far)
    )
    return 2.0 * width * q_origin / (3.0 * far * far) * third


@inline
def locate(row, low, high, c, roots, kc, out):
    """Fill `out` (LOCATED) from (1 + c)/2, (1 - c)/2 and c, each with all its digits; sqrt Q(u) = g
    dn/(wl + wh).
    """
    left, right = roots[1] * low, roots[0] * high
    total = left + right
    left, right = left / total, right / total
    out[rc.TO_PLUS] = row[nu.LOW_PLUS] * left + row[nu.HIGH_PLUS] * right
    out[rc.TO_MINUS] = row[nu.LOW_MINUS] * left + row[nu.HIGH_MINUS] * right
    out[rc.HERE] = row[nu.LOW] * left + row[nu.HIGH] * right
    out[rc.RISEN], out[rc.TO_RISE] = right, left
    g = roots[0] * roots[1]
    out[rc.ROOT] = g * hypot(c, 2.0 * kc * sqrt(low * high)) / total
    above = nu.above(row, g)
    out[rc.FROM_LOW], out[rc.FROM_HIGH] = above + g * c / high, above - g * c / low


@inline
def angles(row, tau, half, down, at):
    """(b - a) G- / 2 and (b + a) G+ / 2 at the time tau in [0, half] since u = ul; `down` is the
    latter at `half`.
    """
    width, spread = row[nu.WIDTH], nu.spread(row)
    first = second = 0.0
    if row[nu.MINUS] != 0.0:
        far = row[nu.LOW_PLUS]
        rest = tau / far + since(
            far,
            at[rc.TO_PLUS],
            at[rc.FROM_LOW],
            spread,
            at[rc.RISEN],
            at[rc.TO_RISE],
            row[nu.Q_LOW],
            at[rc.ROOT],
            width,
        )
        first = 0.5 * row[nu.MINUS] * rest
    if row[nu.PLUS] != 0.0:
        far = row[nu.HIGH_MINUS]
        rest = (half - tau) / far + since(
            far,
            at[rc.TO_MINUS],
            at[rc.FROM_HIGH],
            spread,
            at[rc.TO_RISE],
            at[rc.RISEN],
            row[nu.Q_HIGH],
            at[rc.ROOT],
            width,
        )
        second = down - 0.5 * row[nu.PLUS] * rest
    return first, second


@inline
def rates(row, at):
    """(b - a)/(2(1 - u)) and (b + a)/(2(1 + u))."""
    up = 0.5 * row[nu.MINUS] / at[rc.TO_PLUS] if row[nu.MINUS] != 0.0 else 0.0
    return up, (0.5 * row[nu.PLUS] / at[rc.TO_MINUS] if row[nu.PLUS] != 0.0 else 0.0)


@inline
def cosine_by_means(z, kc, quarter, pairs, last):
    """(1 + c)/2, (1 - c)/2 and c = cn z, for z in [0, 2 K]."""
    over = z > quarter
    sn, cn, _dn = jacobi(2.0 * quarter - z if over else z, pairs, last)
    cn = abs(cn)
    near, far = 0.5 * (1.0 + cn), 0.5 * sn * sn / (1.0 + cn)
    return (far, near, -cn) if over else (near, far, cn)


@inline
def motion(cosine, row, start, period, times, out):
    """Fill `out` (m, MOTION) at `times` (m) in units of A, from the `start` and the `period`
    (columns of `records`).

    cosine(z, kc, quarter, pairs, last) gives (1 + c)/2, (1 - c)/2 and c for z in [0, 2 K].
    """
    pairs, at = np.empty((2, MEANS)), np.empty(rc.LOCATED)
    roots = sqrt(row[nu.Q_LOW]), sqrt(row[nu.Q_HIGH])
    g = roots[0] * roots[1]
    kc, rate = sqrt(0.5 * nu.above(row, g) / g), sqrt(g)
    last = means(kc, pairs)
    quarter = 0.25 * period[rc.PERIOD] * rate
    # in half a period
    up = 0.25 * (period[rc.PRECESSION] - period[rc.SPIN])
    down = 0.25 * (period[rc.PRECESSION] + period[rc.SPIN])
    turn, half = 4.0 * quarter, 0.5 * period[rc.PERIOD]
    done, left = start[rc.DONE] * roots[1], start[rc.LEFT] * roots[0]
    low, high = left / (done + left), done / (done + left)
    sine, c = 2.0 * sqrt(low * high), low - high
    z0 = first_kind(sine, c, kc) if c >= 0.0 else 2.0 * quarter - first_kind(sine, -c, kc)
    locate(row, low, high, c, roots, kc, at)
    first, second = angles(row, z0 / rate, half, down, at)
    base_up, base_down = start[rc.DIRECTION] * first, start[rc.DIRECTION] * second
    start_delay = start[rc.START_BAR] / max(
        row[nu.WIDTH] * sqrt(at[rc.RISEN] * at[rc.TO_RISE]) * at[rc.ROOT], nu.TINY
    )
    # an error of the initial phase shifts the start and what follows equally
    first_up, first_down = rates(row, at)
    z0 *= start[rc.DIRECTION]
    relative = period[rc.PERIOD_BAR] / period[rc.PERIOD]
    for j in range(len(times)):
        z = z0 + rate * times[j]
        # a float, since the number of periods may exceed any integer type
        n = np.floor(z / turn + 0.5)
        # whole periods are subtracted in time, where the period is known best
        z = z0 + rate * (times[j] - n * period[rc.PERIOD])
        side = 1.0 if z >= 0.0 else -1.0
        z = min(abs(z), 2.0 * quarter)
        low, high, c = cosine(z, kc, quarter, pairs, last)
        locate(row, low, high, c, roots, kc, at)
        first, second = angles(row, z / rate, half, down, at)
        first, second = side * first - base_up, side * second - base_down
        all_up, all_down = first + 2.0 * n * up, second + 2.0 * n * down
        delay = (relative + 4.0 * ROUNDOFF) * abs(times[j]) + (16.0 * ROUNDOFF + relative) * (
            1.0 + quarter
        ) / rate
        rate_up, rate_down = rates(row, at)
        change = abs(rate_up - first_up) + abs(rate_down - first_down)
        moved = (abs(rate_up) + abs(rate_down)) * delay + change * start_delay
        delay += start_delay
        speed = row[nu.WIDTH] * sqrt(at[rc.RISEN] * at[rc.TO_RISE]) * at[rc.ROOT]
        bend = (
            row[nu.WIDTH] * max(row[nu.Q_LOW], row[nu.Q_HIGH])
            + 4.0 * abs(row[nu.K]) * row[nu.WIDTH] ** 2
        )
        rounding = 3.0 * (row[nu.BAR_LOW] + row[nu.BAR_HIGH]) + 8.0 * ROUNDOFF * row[nu.WIDTH]
        out[j, rc.U] = at[rc.HERE]
        out[j, rc.PSI], out[j, rc.PHI] = all_up + all_down, all_down - all_up
        out[j, rc.U_BAR] = speed * delay + bend * delay * delay + rounding
        size = abs(first) + abs(second) + abs(base_up) + abs(base_down) + abs(up) + abs(down)
        turned = abs(n) * (period[rc.PRECESSION_BAR] + 4.0 * ROUNDOFF * (abs(up) + abs(down)))
        out[j, rc.PSI_BAR] = moved + (24.0 * ROUNDOFF + 2.0 * relative) * size + turned
        out[j, rc.PHI_BAR] = out[j, rc.PSI_BAR]
