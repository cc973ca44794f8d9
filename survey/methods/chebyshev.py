"""Gauss-Chebyshev quadrature of nutations between their turning points, u = middle + half width cos
x.

The nearest singularities (the other roots of P, the poles) determine how many nodes are needed.
Domain: away from separatrices and near passages of poles, where it needs many nodes;
`no_convergence` beyond MOST, and in time beyond LONGEST. The independent check.

Source: DLMF 3.5(v); integrals (S3), (S4), (S15) of `scenes/brun.md`.
"""

from math import atan2, cos, exp, inf, log1p, pi, sin, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.math.double import two_sum
from survey.kernels.math.newton import bracketed
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import records as rc
from survey.kernels.nutation import wells as nu

ORDER = 0  # no steps: convergence is exponential
SERVES = ("nutation",)
_FIRST, _MOST = 8, 2**15
_LONGEST = 512  # terms of the series in time
_FULL = 38.0  # the first neglected coefficient is exp(-FULL)
# Sums over nodes: T/A, the halves of the advances, the action, and the rounding of Q relative to it.
_TIME, _UP, _DOWN, _ACTION, _ROUGH = range(5)
_SUMS = 5
# Integrands: dt/dx / A, the rates of both angles, then u and Q; the integrals are those of the first
# three.
_HERE, _SQUARE = 3, 4
_INTEGRANDS, _INTEGRALS = 5, 3


@inline
def _rate(row):
    """Logarithm of the sum of the half axes of the ellipse about [ul, uh], scaled to [-1, 1],
    without singularities.
    """
    width, total, k, bend = row[nu.WIDTH], row[nu.SUM], row[nu.K], row[nu.BEND]
    if width <= 0.0:
        return inf
    poles = 2.0 * min(row[nu.HIGH_PLUS] if row[nu.MINUS] != 0.0 else 2.0,
                      row[nu.LOW_MINUS] if row[nu.PLUS] != 0.0 else 2.0) / width  # fmt: skip
    least = log1p(poles + sqrt(poles * (2.0 + poles)))
    if k == 0.0:
        return least
    if k * bend < 0.0:  # real roots of Q: their distances from the ends, each from their product
        spread = sqrt(-bend / k)
        high, low = 2.0 * row[nu.HIGH] + total, 2.0 * row[nu.LOW] + total
        near = (
            min(row[nu.Q_HIGH] / (abs(high) + spread), row[nu.Q_LOW] / (abs(low) + spread))
            * 2.0
            / abs(k)
        )
        gap = 2.0 * near / width
        return min(least, log1p(gap + sqrt(gap * (2.0 + gap))))
    y = sqrt(bend / k) / width
    x = 2.0 * abs(total) / width
    sides = 0.5 * (sqrt((x + 1.0) ** 2 + y * y) + sqrt((x - 1.0) ** 2 + y * y))
    height = sides - 1.0 if sides - 1.0 > 1e-6 else 0.5 * y * y
    return min(least, log1p(height + sqrt(height * (2.0 + height))))


@inline
def _gathered(total, term):
    high, low = two_sum(total[0], term)
    return high, total[1] + low


@inline
def _sums(row, n, out):
    """Fill `out` (_SUMS), by n nodes in x = 0..pi."""
    low, high, bow = row[nu.Q_LOW], row[nu.Q_HIGH], row[nu.K] * row[nu.WIDTH] ** 2
    minus, plus = row[nu.MINUS], row[nu.PLUS]
    # sums and their roundings: of thousands of nodes near poles
    time = up = down = action = (0.0, 0.0)
    rough = 0.0
    for i in range(n):
        c = sin((n - i - 0.5) * (0.5 * pi / n))  # cos x/2, with all its digits where it is small
        s = sin((i + 0.5) * (0.5 * pi / n))
        c, s = c * c, s * s
        square = low * s + high * c - bow * s * c
        root = sqrt(square)
        to_plus = row[nu.LOW_PLUS] * s + row[nu.HIGH_PLUS] * c
        to_minus = row[nu.LOW_MINUS] * s + row[nu.HIGH_MINUS] * c
        time = _gathered(time, 1.0 / root)
        up = _gathered(up, 1.0 / (to_plus * root) if minus != 0.0 else 0.0)
        down = _gathered(down, 1.0 / (to_minus * root) if plus != 0.0 else 0.0)
        action = _gathered(action, s * c * root / (to_plus * to_minus))
        rough = max(rough, (low * s + high * c + abs(bow) * s * c) / square)
    step = pi / n
    out[_TIME], out[_UP], out[_DOWN] = (
        2.0 * step * (time[0] + time[1]),
        step * (up[0] + up[1]) * minus,
        step * (down[0] + down[1]) * plus,
    )
    out[_ACTION], out[_ROUGH] = row[nu.WIDTH] ** 2 * step * (action[0] + action[1]) / pi, rough


@inline
def _periods_of(row, n, speed, coarse, fine, out):
    """See `agm._periods_of`; the error of n nodes follows from the difference to half of them."""
    _sums(row, n // 2, coarse)
    _sums(row, n, fine)
    noise = row[nu.NOISE_LOW] + row[nu.NOISE_HIGH] + 16.0 * ROUNDOFF * fine[_ROUGH]
    seen, missed = exp(-speed * n), exp(-2.0 * speed * n)
    for i in range(_ROUGH):
        coarse[i] = 10.0 * (abs(fine[i] - coarse[i]) * seen + abs(fine[i]) * missed) + noise * abs(
            fine[i]
        )
    coarse[_UP] += row[nu.NOISE_ENDS] * abs(fine[_UP])
    coarse[_DOWN] += row[nu.NOISE_ENDS] * abs(fine[_DOWN])
    coarse[_ACTION] += 2.5 * row[nu.NOISE_WIDTH] * fine[_ACTION]
    out[rc.PERIOD], out[rc.ACTION] = fine[_TIME], fine[_ACTION]
    out[rc.PRECESSION], out[rc.SPIN] = fine[_UP] + fine[_DOWN], fine[_DOWN] - fine[_UP]
    out[rc.PERIOD_BAR], out[rc.ACTION_BAR] = coarse[_TIME], coarse[_ACTION]
    out[rc.PRECESSION_BAR] = out[rc.SPIN_BAR] = coarse[_UP] + coarse[_DOWN]


@kernel
def nutation_periods(rows, kinds, tolerance, out):
    """See `agm.nutation_periods`."""
    coarse, fine = np.empty(_SUMS), np.empty(_SUMS)
    for i in range(len(rows)):
        if kinds[i] >= nu.NUTATION:
            speed = _rate(rows[i])
            n = _FIRST
            while 2.0 * n * speed < _FULL and n <= _MOST:
                n *= 2
            if n <= _MOST:
                _periods_of(rows[i], n, speed, coarse, fine, out[i])


@inline
def _integrands(row, x, out):
    """Fill `out` (_INTEGRANDS) at u = ul + (uh - ul) sin^2(x/2)."""
    s, c = sin(0.5 * x) ** 2, cos(0.5 * x) ** 2
    q = row[nu.Q_LOW] * c + row[nu.Q_HIGH] * s - row[nu.K] * row[nu.WIDTH] ** 2 * s * c
    to_plus = row[nu.LOW_PLUS] * c + row[nu.HIGH_PLUS] * s
    to_minus = row[nu.LOW_MINUS] * c + row[nu.HIGH_MINUS] * s
    out[_TIME] = 1.0 / sqrt(q)
    out[_UP] = 0.5 * row[nu.MINUS] / to_plus * out[_TIME] if row[nu.MINUS] != 0.0 else 0.0
    out[_DOWN] = 0.5 * row[nu.PLUS] / to_minus * out[_TIME] if row[nu.PLUS] != 0.0 else 0.0
    out[_HERE], out[_SQUARE] = row[nu.LOW] * c + row[nu.HIGH] * s, q


@inline
def _series(row, n, waves, value):
    """Coefficients of the integrals from 0 to x: waves[:, 0] x + sum of waves[:, j] sin j x."""
    waves[:, :n] = 0.0
    for i in range(n):
        x = (i + 0.5) * pi / n
        _integrands(row, x, value)
        for j in range(n):
            wave = cos(j * x) * (2.0 / n if j else 1.0 / n) / (j if j else 1.0)
            for m in range(_INTEGRALS):
                waves[m, j] += wave * value[m]


@inline
def _integrals(waves, n, x, out):
    """Fill `out` (_INTEGRALS) at x in [0, pi] since u = ul."""
    for m in range(_INTEGRALS):
        total = 0.0
        for j in range(n - 1, 0, -1):
            total += waves[m, j] * sin(j * x)
        out[m] = waves[m, 0] * x + total


@inline
def _when(row, waves, n, time, value, out):
    """x at which `time` is reached; `out` as `_integrals`."""
    first, given = pi * time / (pi * waves[_TIME, 0]), (row, waves, n, time, value, out)
    return bracketed(_to_time, _integrals, given, first, (0.0, pi), (0.0, 4.0 * ROUNDOFF), 100)[0]


@inline
def _to_time(integrals, given, x):
    row, waves, n, time, value, out = given
    integrals(waves, n, x, out)
    _integrands(row, x, value)
    return out[_TIME] - time, value[_TIME], not (out[_TIME] - time) / value[_TIME] > 0.0


@inline
def _motion(row, start, n, noise, times, waves, out):
    """See `kernels.nutation.motion.motion`."""
    value, here = np.empty(_INTEGRANDS), np.empty(_INTEGRALS)
    _series(row, n, waves, value)
    half = pi * waves[_TIME, 0]
    size = pi * (abs(waves[_UP, 0]) + abs(waves[_DOWN, 0]))
    x = 2.0 * atan2(sqrt(start[rc.DONE]), sqrt(start[rc.LEFT]))
    _integrals(waves, n, x, here)
    _integrands(row, x, value)
    start_delay = (
        start[rc.START_BAR]
        * value[_TIME]
        / max(row[nu.WIDTH] * abs(sin(0.5 * x) * cos(0.5 * x)), nu.TINY)
    )
    first_up, first_down = value[_UP] / value[_TIME], value[_DOWN] / value[_TIME]
    side = start[rc.DIRECTION]
    first, base_up, base_down = side * here[_TIME], side * here[_UP], side * here[_DOWN]
    for j in range(len(times)):
        turns = np.floor((first + times[j]) / (2.0 * half) + 0.5)
        time = first + times[j] - turns * 2.0 * half
        side = 1.0 if time >= 0.0 else -1.0
        x = _when(row, waves, n, min(abs(time), half), value, here)
        _integrands(row, x, value)
        up = side * here[_UP] - base_up + 2.0 * pi * turns * waves[_UP, 0]
        down = side * here[_DOWN] - base_down + 2.0 * pi * turns * waves[_DOWN, 0]
        delay = 2.0 * noise * (abs(times[j]) + half)
        wide = row[nu.WIDTH]
        bend = row[nu.WIDTH] * (
            row[nu.Q_LOW] + row[nu.Q_HIGH] + 4.0 * abs(row[nu.K]) * row[nu.WIDTH]
        )
        speed = wide * abs(sin(0.5 * x) * cos(0.5 * x)) / value[_TIME]
        rate_up, rate_down = value[_UP] / value[_TIME], value[_DOWN] / value[_TIME]
        change = abs(rate_up - first_up) + abs(rate_down - first_down)
        moved = (abs(rate_up) + abs(rate_down)) * delay + change * start_delay
        delay += start_delay
        out[j, rc.U], out[j, rc.PSI], out[j, rc.PHI] = value[_HERE], up + down, down - up
        rounding = 3.0 * (row[nu.BAR_LOW] + row[nu.BAR_HIGH])
        out[j, rc.U_BAR] = speed * delay + bend * delay * delay + rounding + 8.0 * ROUNDOFF * wide
        out[j, rc.PSI_BAR] = out[j, rc.PHI_BAR] = (
            moved + 2.0 * noise * (1.0 + abs(turns)) * 2.0 * size
        )


@kernel
def nutation_motions(rows, kinds, starts, periods, times, out):
    """See `agm.nutation_motions`; by Fourier series of the integrals, of at most LONGEST terms."""
    waves = np.empty((_INTEGRALS, _LONGEST))
    for i in range(len(rows)):
        if kinds[i] >= nu.NUTATION:
            speed = _rate(rows[i])
            n = _FIRST
            while 2.0 * n * speed < 2.0 * _FULL and n <= _LONGEST:
                n *= 2
            if n <= _LONGEST:
                noise = periods[i, rc.PERIOD_BAR] / periods[i, rc.PERIOD] + 4.0 * ROUNDOFF * n
                _motion(rows[i], starts[i], n, noise, times[i], waves, out[i])
