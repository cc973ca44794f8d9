"""The separatrix k = 1 of a satellite as a problem of scattering: f'' + (2 sech^2 u + 2 rho sech u
+ m) f = 0.

f is Jost's solution, f exp(nu u) -> 1 as u -> inf, nu^2 = -m: a series in exp(-u) where that is
small, then Taylor series along the axis down to u = 0. As the coefficient is even, f(0) and f'(0)
hold all of it.

Source: derived in `scenes/satellite.md` ("The separatrix").
"""

from math import exp, log

import numpy as np

from survey.kernels.jit import kernel
from survey.kernels.math.roundoff import EPS

ORDER = 24
TAIL = 48  # terms of the series in exp(-u)
REACH = 0.25  # of the singularities' distance, and of the wave's length, for a step
# A passage: Re f f'* and its bar, |f f'| and its bar, at u = 0.
PRODUCT, PRODUCT_BAR, SIZE, SIZE_BAR = range(4)
PASSAGE = 4
FAR = 8.0  # exp(u) where the tail's series starts, at rho = 0


@kernel
def _tail(nu, rho, u):
    """f and f' at u by the series of f exp(nu u) in x = exp(-u): n (n + 2 nu) a_n = -sum of v_m a_(n - m)."""
    x, a = exp(-u), np.zeros(TAIL, np.complex128)
    a[0] = 1.0
    value, slope, power = a[0], -nu * a[0], 1.0
    for n in range(1, TAIL):
        total = 0.0 + 0.0j
        for m in range(1, n + 1):
            half = m // 2
            sign = 1.0 if half % 2 == 0 else -1.0
            total += (4.0 * rho * sign if m % 2 else -8.0 * sign * half) * a[n - m]
        a[n] = -total / (n * (n + 2.0 * nu))
        power *= x
        value += a[n] * power
        slope -= (nu + n) * a[n] * power
    phase = np.exp(-nu * u)
    return value * phase, slope * phase


@kernel
def _step(f, slope, u, h, rho, rest, work, series):
    """f and f' at u + h by Taylor series; work (3, ORDER + 1): of sech, tanh, sech^2."""
    s, th, square = work[0], work[1], work[2]
    rise = exp(-abs(u))
    s[0] = 2.0 * rise / (1.0 + rise * rise)
    th[0] = (1.0 - rise * rise) / (1.0 + rise * rise)
    series[0], series[1] = f, slope
    for n in range(ORDER):
        both = product = 0.0
        for i in range(n + 1):
            both += s[i] * s[n - i]
            product += s[i] * th[n - i]
        square[n] = both
        s[n + 1], th[n + 1] = -product / (n + 1), both / (n + 1)
        if n + 2 <= ORDER:
            total = rest * series[n]
            for i in range(n + 1):
                total += 2.0 * (square[i] + rho * s[i]) * series[n - i]
            series[n + 2] = -total / ((n + 1) * (n + 2))
    value, first = 0.0 + 0.0j, 0.0 + 0.0j
    for n in range(ORDER, 0, -1):
        value = value * h + series[n]
        first = first * h + n * series[n]
    return value * h + series[0], first


@kernel
def _jost(rho, rest, nu, finer, work, series):
    """f and f' at 0, with steps `finer` times as short as they need be, and how many."""
    size = 1.0 + abs(rho)
    start = log(FAR * finer * size)
    count = int(np.ceil(start * size * finer / REACH))
    f, slope = _tail(nu, rho, start)
    h = start / count
    for i in range(count):
        f, slope = _step(f, slope, h * (count - i), -h, rho, rest, work, series)
    return f, slope, count


@kernel
def jost(rho, rest, rate, oscillates, out):
    """Fill `out` (n, PASSAGE) for each rho; rate = |nu| > 0."""
    work, series = np.zeros((3, ORDER + 1)), np.zeros(ORDER + 1, np.complex128)
    for i in range(len(rho)):
        nu = complex(0.0, -rate[i]) if oscillates[i] else complex(rate[i], 0.0)
        f, slope, count = _jost(rho[i], rest[i], nu, 1.0, work, series)
        g, other, _ = _jost(rho[i], rest[i], nu, 1.5, work, series)
        one, two = f * slope.conjugate(), g * other.conjugate()
        size = abs(one)
        rounding = 8.0 * EPS * (1.0 + abs(rho[i]) + count) * size
        out[i, PRODUCT] = two.real
        out[i, PRODUCT_BAR] = 2.0 * abs(two.real - one.real) + rounding
        out[i, SIZE], out[i, SIZE_BAR] = abs(two), 2.0 * abs(abs(two) - size) + rounding
