"""Midpoint Taylor, order 16: both fundamental solutions of y'' + z y = 0 as power series about the
middle of a step.

On a step z is replaced by its projection on the Legendre polynomials of degree <= 9, from ten Gauss
points; the solutions see that error only through their own components of degree >= 10. With x in
[-1, 1] the series a (even start: a = 1, a' = 0) to x^16 and b (b = 0, b' = 1) to x^17 give Y(+h/2)
and Y(-h/2), and P = Y(+h/2) Y(-h/2)^-1 has a local error of h^17. Domain: any z smooth on the scale
of a step; best up to 1e-13. Linear systems of n states likewise, from the power series of A
(`kernels/floquet/steps.py`).

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, I.8 (Taylor
series) and II.7 (why Gauss points give twice the order).
"""

import math

import numpy as np
from numpy.polynomial import legendre

from survey.kernels.floquet import steps
from survey.kernels.jit import kernel, splice
from survey.kernels.lanes import chain, scatter
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.unroll import fma, unroll

ORDER = 16
SERVES = ("danby", "floquet", "hill", "orbit")
_ABOUT = "Midpoint Taylor, order 16: power series about the middle of each step, "
ABOUT = {
    "danby": _ABOUT
    + "of the propagator of the four linear equations about L4, over half a period.",
    "floquet": _ABOUT + "of the propagator of x' = A(t) x, of n states.",
    "hill": _ABOUT + "of both fundamental solutions of y'' + z y = 0.",
    "orbit": _ABOUT + "of the orbit and of the propagator of small deviations from it.",
}
COST = {"danby": 600.0}  # time, relative to the default of each family

_DEGREE = 9
_POINTS, _WEIGHTS = legendre.leggauss(_DEGREE + 1)
NODES = tuple(0.5 + 0.5 * _POINTS)
_HALF = (_DEGREE + 1) // 2
# Samples -> Legendre coefficients (well conditioned), then -> powers of x: the noise of the second
# stage is relative to each Legendre coefficient, and these decay. Sums and differences of mirrored
# samples give the even and odd ones.
_TO_LEGENDRE = np.array(
    [(j + 0.5) * _WEIGHTS * legendre.Legendre.basis(j)(_POINTS) for j in range(_DEGREE + 1)]
)
_TO_POWERS = np.zeros((_DEGREE + 1, _DEGREE + 1))
for _j in range(_DEGREE + 1):
    _TO_POWERS[: _j + 1, _j] = legendre.leg2poly([0.0] * _j + [1.0])
_TO_LEGENDRE = np.stack([_TO_LEGENDRE[parity::2, _HALF:] for parity in (0, 1)])
_TO_POWERS = np.stack([_TO_POWERS[parity::2, parity::2] for parity in (0, 1)])
WIDTH = _DEGREE + 4
_TAIL, _SIZE, _ALIAS = _DEGREE + 1, _DEGREE + 2, _DEGREE + 3
# a faster fall than this of two Legendre coefficients to the next two is not trusted
_SLOWEST = 0.02
_ROUNDING = 4.0 * ROUNDOFF  # of an entry of one step, about four roundings


floquet_factors = steps.factors


def floquet_reach(rtol):
    """How far the norm of A times half a step may go for accuracy rtol; bounds of what is missing
    are far larger.
    """
    return (1e-7 * max(rtol, 1e-14) * math.factorial(ORDER + 1)) ** (1 / (ORDER + 1))


def hill_density(rtol):
    """Steps per radian of the fastest phase, and per distance to the nearest singularity of z, for
    accuracy rtol.
    """
    scale = max(rtol, 1e-14) ** (-1 / ORDER)
    return 0.13 * scale, 0.88 * scale


@unroll
def _product(matrix, k, x, i):
    """Row k of the matrix times lane i of x."""
    total = matrix[k, 0] * x[0, i]
    for j in range(1, _HALF):
        total = fma(matrix[k, j], x[j, i], total)
    return total


@splice
def _hill_row(samples, h, coefficients):
    """Per function, in units of -4/h^2: powers of x, the last two Legendre coefficients, the
    largest sample, and what components of degree >= 20 add to the low coefficients, where the Gauss
    points take them for these. What rounding is relative to may be larger than the samples: then it
    follows them.
    """
    count = samples.shape[2]
    paired, series = np.empty((_HALF, count)), np.empty((_HALF, count))
    for c in range(2):
        first = c * WIDTH
        for i in range(count):
            coefficients[first + _TAIL, i] = coefficients[first + _SIZE, i] = 0.0
            coefficients[first + _ALIAS, i] = 1e-300
        for parity in range(2):
            sign = 1.0 - 2.0 * parity
            for k in range(_HALF):
                for i in range(count):
                    left, right = samples[c, _HALF - 1 - k, i], samples[c, _HALF + k, i]
                    paired[k, i] = right + sign * left
                    largest = max(abs(left), abs(right))
                    coefficients[first + _SIZE, i] = max(
                        coefficients[first + _SIZE, i], 0.25 * h[i] * h[i] * largest
                    )
            for k in range(_HALF):
                for i in range(count):
                    series[k, i] = _product(_TO_LEGENDRE[parity], k, paired, i)
            for k in range(_HALF):
                for i in range(count):
                    power = -0.25 * h[i] * h[i] * _product(_TO_POWERS[parity], k, series, i)
                    coefficients[first + 2 * k + parity, i] = power
            for i in range(count):
                coefficients[first + _TAIL, i] += 0.25 * h[i] * h[i] * abs(series[_HALF - 1, i])
                coefficients[first + _ALIAS, i] += 0.25 * h[i] * h[i] * abs(series[_HALF - 2, i])
        if samples.shape[1] > 2 * _HALF:
            for i in range(count):
                given = 0.25 * h[i] * h[i] * samples[c, 2 * _HALF, i]
                coefficients[first + _SIZE, i] = max(coefficients[first + _SIZE, i], given)
        for i in range(count):  # at the rate at which the last four fall, five times two degrees on
            tail = coefficients[first + _TAIL, i]
            rate = min(max(tail / coefficients[first + _ALIAS, i], _SLOWEST), 1.0)
            square = rate * rate
            coefficients[first + _ALIAS, i] = tail * (square * square * rate)


def _convolved(z, x, n, zeros=()):
    """The n-th coefficient of the product of the series z, of degree 9, and x, the `zeros` of which
    are passed over.
    """
    first, *others = (j for j in range(max(0, n - _DEGREE), n + 1) if j not in zeros)
    total = z[n - first] * x[first]
    for j in others:
        total = fma(z[n - j], x[j], total)
    return total


def _sums(terms):
    """The sums of the terms from each on, from the small end."""
    sums = terms[-1:]
    for term in reversed(terms[:-1]):
        sums.insert(0, term + sums[0])
    return sums


@unroll
def hill_step(f, c2, p, h):
    """P and its local error bounds."""
    c2 = -0.25 * h * h * c2
    z = [fma(p, fma(p, c2, f[WIDTH]), f[0])]
    z += [fma(p, f[WIDTH + k], f[k]) for k in range(1, _DEGREE + 1)]
    a, b = [1.0, 0.0, z[0] * (1 / 2)], [0.0, 1.0, 0.0]
    for n in range(1, ORDER):
        b.append(_convolved(z, b, n, (0, 2)) * (1 / ((n + 2) * (n + 1))))
        if n < ORDER - 1:
            a.append(_convolved(z, a, n, (1,)) * (1 / ((n + 2) * (n + 1))))
    # The sum of these sums is that of k times the k-th coefficient, for the slopes.
    a_even_sums, a_odd_sums = _sums(a[2::2]), _sums(a[3::2])
    b_even_sums, b_odd_sums = _sums(b[4::2]), _sums(b[3::2])
    a_even, a_odd = 1.0 + a_even_sums[0], a_odd_sums[0]
    b_even, b_odd = b_even_sums[0], 1.0 + b_odd_sums[0]
    # Slopes: that of an even series is odd.
    da_odd = 2.0 * _sums(a_even_sums)[0]
    da_even = a_odd + 2.0 * _sums(a_odd_sums)[0]
    db_odd = 2.0 * (b_even + _sums(b_even_sums)[0])
    db_even = b_odd + 2.0 * _sums(b_odd_sums)[0]
    a_end, a_start = a_even + a_odd, a_even - a_odd
    b_end, b_start = b_odd + b_even, b_even - b_odd
    da_end, da_start = da_even + da_odd, da_even - da_odd
    db_end, db_start = db_even + db_odd, db_even - db_odd
    p11 = fma(a_end, db_start, -b_end * da_start)
    p12 = fma(b_end, a_start, -a_end * b_start)
    p21 = fma(da_end, db_start, -db_end * da_start)
    p22 = fma(db_end, a_start, -da_end * b_start)
    # Truncation: the next two coefficients, at the rate at which the last four fall; that rate,
    # with its accidents, is not trusted below 1/50, nor by more than a factor of 3.
    a_last, b_last = abs(a[15]) + abs(a[16]), abs(b[16]) + abs(b[17])
    a_before, b_before = abs(a[13]) + abs(a[14]) + 1e-150, abs(b[14]) + abs(b[15]) + 1e-150
    inverse = 3.0 / (a_before * b_before)
    a_tail = a_last * (a_last * b_before * inverse + 0.06)
    b_tail = b_last * (b_last * a_before * inverse + 0.06)
    by_value = a_tail * (abs(b_even) + abs(b_odd)) + b_tail * (abs(a_even) + abs(a_odd))
    by_slope = a_tail * (abs(db_even) + abs(db_odd)) + b_tail * (abs(da_even) + abs(da_odd))
    # What the projection left out acts only through the solutions' own components of that degree.
    missing = (f[10] + abs(p) * f[WIDTH + 10]) * (
        4.0 * (abs(a[9]) + abs(a[10]) + abs(b[9]) + abs(b[10]))
    )
    missing = missing + 8.0 * (f[12] + abs(p) * f[WIDTH + 12])
    size = f[11] + abs(p) * (f[WIDTH + 11] + abs(p * c2))
    # z's rounding reaches y within the step where what it is relative to is large on the step's
    # scale
    missing = missing + 2.0 * _ROUNDING * ((size - 1.0) + abs(size - 1.0))
    d11 = by_slope + 19.0 * by_value + missing + _ROUNDING
    d12 = 2.0 * by_value + missing + 2.0 * _ROUNDING
    d21 = 38.0 * by_slope + missing + 4.0 * _ROUNDING * size
    half, steep = 0.5 * h, 2.0 / h
    return p11, p12 * half, p21 * steep, p22, d11, d12 * half, d21 * steep


@kernel
def hill_chain(samples, c2, h, p, order, starts, ends, out):
    chain(_hill_row, hill_step, WIDTH, samples, c2, h, p, order, starts, ends, out)


@kernel
def hill_scatter(samples, c2, h, p, order, starts, out):
    scatter(_hill_row, hill_step, WIDTH, samples, c2, h, p, order, starts, out)
