"""Midpoint Taylor, order 16: both fundamental solutions of y'' + z y = 0 as power series about the middle of a step.

On a step z is replaced by its projection on the Legendre polynomials of degree <= 9, from ten Gauss points; the
solutions see that error only through their own components of degree >= 10. With x in [-1, 1] the series
a (even start: a = 1, a' = 0) to x^16 and b (b = 0, b' = 1) to x^17 give Y(+h/2) and Y(-h/2), and
P = Y(+h/2) Y(-h/2)^-1 has a local error of h^17. Domain: any z smooth on the scale of a step; best up to 1e-13.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, I.8 (Taylor series) and
II.7 (why Gauss points give twice the order).
"""

import numpy as np
from numpy.polynomial import legendre

from survey.kernels.jit import inline, kernel, splice
from survey.kernels.lanes import chain, scatter

ORDER = 16
SERVES = ("hill",)

DEGREE = 9
_POINTS, _WEIGHTS = legendre.leggauss(DEGREE + 1)
NODES = tuple(0.5 + 0.5 * _POINTS)
HALF = (DEGREE + 1) // 2
# Samples -> Legendre coefficients (well conditioned), then -> powers of x: the noise of the second stage is relative
# to each Legendre coefficient, and these decay. Sums and differences of mirrored samples give the even and odd ones.
TO_LEGENDRE = np.array([(j + 0.5) * _WEIGHTS * legendre.Legendre.basis(j)(_POINTS) for j in range(DEGREE + 1)])
TO_POWERS = np.zeros((DEGREE + 1, DEGREE + 1))
for _j in range(DEGREE + 1):
    TO_POWERS[: _j + 1, _j] = legendre.leg2poly([0.0] * _j + [1.0])
TO_LEGENDRE = np.stack([TO_LEGENDRE[parity::2, HALF:] for parity in (0, 1)])
TO_POWERS = np.stack([TO_POWERS[parity::2, parity::2] for parity in (0, 1)])
WIDTH = DEGREE + 3
TAIL, SIZE = DEGREE + 1, DEGREE + 2
ROUNDING = 4.4e-16


def hill_density(rtol):
    """Steps per radian of the fastest phase, and per distance to the nearest singularity of z, for accuracy rtol."""
    scale = max(rtol, 1e-14) ** (-1 / ORDER)
    return 0.13 * scale, 0.88 * scale


@splice
def _product(matrix, k, x, i):
    """Row k of the matrix times lane i of x."""
    first = matrix[k, 0] * x[0, i] + matrix[k, 1] * x[1, i]
    return first + matrix[k, 2] * x[2, i] + matrix[k, 3] * x[3, i] + matrix[k, 4] * x[4, i]


@splice
def hill_row(samples, h, coefficients):
    """Per function, in units of -4/h^2: powers of x, then the last two Legendre coefficients, then the largest."""
    count = samples.shape[2]
    paired, series = np.empty((HALF, count)), np.empty((HALF, count))
    for c in range(2):
        first = c * WIDTH
        for i in range(count):
            coefficients[first + TAIL, i] = coefficients[first + SIZE, i] = 0.0
        for parity in range(2):
            sign = 1.0 - 2.0 * parity
            for k in range(HALF):
                for i in range(count):
                    left, right = samples[c, HALF - 1 - k, i], samples[c, HALF + k, i]
                    paired[k, i] = right + sign * left
                    largest = max(abs(left), abs(right))
                    coefficients[first + SIZE, i] = max(coefficients[first + SIZE, i], 0.25 * h[i] * h[i] * largest)
            for k in range(HALF):
                for i in range(count):
                    series[k, i] = _product(TO_LEGENDRE[parity], k, paired, i)
            for k in range(HALF):
                for i in range(count):
                    power = -0.25 * h[i] * h[i] * _product(TO_POWERS[parity], k, series, i)
                    coefficients[first + 2 * k + parity, i] = power
            for i in range(count):
                coefficients[first + TAIL, i] += 0.25 * h[i] * h[i] * abs(series[HALF - 1, i])


@inline
def hill_step(f, c2, p, h):
    """P and its local error bounds. Straight code: a loop over the coefficients would not become vector code."""
    c2 = -0.25 * h * h * c2
    z0 = f[0] + p * (f[WIDTH + 0] + p * c2)
    z1 = f[1] + p * f[WIDTH + 1]
    z2 = f[2] + p * f[WIDTH + 2]
    z3 = f[3] + p * f[WIDTH + 3]
    z4 = f[4] + p * f[WIDTH + 4]
    z5 = f[5] + p * f[WIDTH + 5]
    z6 = f[6] + p * f[WIDTH + 6]
    z7 = f[7] + p * f[WIDTH + 7]
    z8 = f[8] + p * f[WIDTH + 8]
    z9 = f[9] + p * f[WIDTH + 9]
    # fmt: off
    a2 = z0 * (1 / 2)
    a3 = z1 * (1 / 6)
    b3 = z0 * (1 / 6)
    a4 = (z2 + z0 * a2) * (1 / 12)
    b4 = z1 * (1 / 12)
    a5 = (z3 + z1 * a2 + z0 * a3) * (1 / 20)
    b5 = (z2 + z0 * b3) * (1 / 20)
    a6 = (z4 + z2 * a2 + z1 * a3 + z0 * a4) * (1 / 30)
    b6 = (z3 + z1 * b3 + z0 * b4) * (1 / 30)
    a7 = (z5 + z3 * a2 + z2 * a3 + z1 * a4 + z0 * a5) * (1 / 42)
    b7 = (z4 + z2 * b3 + z1 * b4 + z0 * b5) * (1 / 42)
    a8 = (z6 + z4 * a2 + z3 * a3 + z2 * a4 + z1 * a5 + z0 * a6) * (1 / 56)
    b8 = (z5 + z3 * b3 + z2 * b4 + z1 * b5 + z0 * b6) * (1 / 56)
    a9 = (z7 + z5 * a2 + z4 * a3 + z3 * a4 + z2 * a5 + z1 * a6 + z0 * a7) * (1 / 72)
    b9 = (z6 + z4 * b3 + z3 * b4 + z2 * b5 + z1 * b6 + z0 * b7) * (1 / 72)
    a10 = (z8 + z6 * a2 + z5 * a3 + z4 * a4 + z3 * a5 + z2 * a6 + z1 * a7 + z0 * a8) * (1 / 90)
    b10 = (z7 + z5 * b3 + z4 * b4 + z3 * b5 + z2 * b6 + z1 * b7 + z0 * b8) * (1 / 90)
    a11 = (z9 + z7 * a2 + z6 * a3 + z5 * a4 + z4 * a5 + z3 * a6 + z2 * a7 + z1 * a8 + z0 * a9) * (1 / 110)
    b11 = (z8 + z6 * b3 + z5 * b4 + z4 * b5 + z3 * b6 + z2 * b7 + z1 * b8 + z0 * b9) * (1 / 110)
    a12 = (z8 * a2 + z7 * a3 + z6 * a4 + z5 * a5 + z4 * a6 + z3 * a7 + z2 * a8 + z1 * a9 + z0 * a10) * (1 / 132)
    b12 = (z9 + z7 * b3 + z6 * b4 + z5 * b5 + z4 * b6 + z3 * b7 + z2 * b8 + z1 * b9 + z0 * b10) * (1 / 132)
    a13 = (z9 * a2 + z8 * a3 + z7 * a4 + z6 * a5 + z5 * a6
           + z4 * a7 + z3 * a8 + z2 * a9 + z1 * a10 + z0 * a11) * (1 / 156)
    b13 = (z8 * b3 + z7 * b4 + z6 * b5 + z5 * b6 + z4 * b7 + z3 * b8 + z2 * b9 + z1 * b10 + z0 * b11) * (1 / 156)
    a14 = (z9 * a3 + z8 * a4 + z7 * a5 + z6 * a6 + z5 * a7
           + z4 * a8 + z3 * a9 + z2 * a10 + z1 * a11 + z0 * a12) * (1 / 182)
    b14 = (z9 * b3 + z8 * b4 + z7 * b5 + z6 * b6 + z5 * b7
           + z4 * b8 + z3 * b9 + z2 * b10 + z1 * b11 + z0 * b12) * (1 / 182)
    a15 = (z9 * a4 + z8 * a5 + z7 * a6 + z6 * a7 + z5 * a8
           + z4 * a9 + z3 * a10 + z2 * a11 + z1 * a12 + z0 * a13) * (1 / 210)
    b15 = (z9 * b4 + z8 * b5 + z7 * b6 + z6 * b7 + z5 * b8
           + z4 * b9 + z3 * b10 + z2 * b11 + z1 * b12 + z0 * b13) * (1 / 210)
    a16 = (z9 * a5 + z8 * a6 + z7 * a7 + z6 * a8 + z5 * a9
           + z4 * a10 + z3 * a11 + z2 * a12 + z1 * a13 + z0 * a14) * (1 / 240)
    b16 = (z9 * b5 + z8 * b6 + z7 * b7 + z6 * b8 + z5 * b9
           + z4 * b10 + z3 * b11 + z2 * b12 + z1 * b13 + z0 * b14) * (1 / 240)
    b17 = (z9 * b6 + z8 * b7 + z7 * b8 + z6 * b9 + z5 * b10
           + z4 * b11 + z3 * b12 + z2 * b13 + z1 * b14 + z0 * b15) * (1 / 272)
    # fmt: on
    # Sums from the small end; the sum of those sums is that of k times the k-th coefficient, for the slopes.
    a14s = a14 + a16
    a12s = a12 + a14s
    a10s = a10 + a12s
    a8s = a8 + a10s
    a6s = a6 + a8s
    a4s = a4 + a6s
    a2s = a2 + a4s
    a13s = a13 + a15
    a11s = a11 + a13s
    a9s = a9 + a11s
    a7s = a7 + a9s
    a5s = a5 + a7s
    a_odd = a3 + a5s
    b14s = b14 + b16
    b12s = b12 + b14s
    b10s = b10 + b12s
    b8s = b8 + b10s
    b6s = b6 + b8s
    b_even = b4 + b6s
    b15s = b15 + b17
    b13s = b13 + b15s
    b11s = b11 + b13s
    b9s = b9 + b11s
    b7s = b7 + b9s
    b5s = b5 + b7s
    b3s = b3 + b5s
    a_even, b_odd = 1.0 + a2s, 1.0 + b3s
    # Slopes: that of an even series is odd.
    da_odd = 2.0 * (a2s + (a4s + (a6s + (a8s + (a10s + (a12s + (a14s + a16)))))))
    da_even = a_odd + 2.0 * (a_odd + (a5s + (a7s + (a9s + (a11s + (a13s + a15))))))
    db_odd = 2.0 * (b_even + (b_even + (b6s + (b8s + (b10s + (b12s + (b14s + b16)))))))
    db_even = b_odd + 2.0 * (b3s + (b5s + (b7s + (b9s + (b11s + (b13s + (b15s + b17)))))))
    a_end, a_start = a_even + a_odd, a_even - a_odd
    b_end, b_start = b_odd + b_even, b_even - b_odd
    da_end, da_start = da_even + da_odd, da_even - da_odd
    db_end, db_start = db_even + db_odd, db_even - db_odd
    p11 = a_end * db_start - b_end * da_start
    p12 = b_end * a_start - a_end * b_start
    p21 = da_end * db_start - db_end * da_start
    p22 = db_end * a_start - da_end * b_start
    # Truncation: the next two coefficients, at the rate at which the last four fall; that rate, with its accidents,
    # is not trusted below 1/50, nor by more than a factor of 3.
    a_last, b_last = abs(a15) + abs(a16), abs(b16) + abs(b17)
    a_before, b_before = abs(a13) + abs(a14) + 1e-150, abs(b14) + abs(b15) + 1e-150
    inverse = 3.0 / (a_before * b_before)
    a_tail = a_last * (a_last * b_before * inverse + 0.06)
    b_tail = b_last * (b_last * a_before * inverse + 0.06)
    by_value = a_tail * (abs(b_even) + abs(b_odd)) + b_tail * (abs(a_even) + abs(a_odd))
    by_slope = a_tail * (abs(db_even) + abs(db_odd)) + b_tail * (abs(da_even) + abs(da_odd))
    # What the projection left out acts only through the solutions' own components of that degree.
    missing = (f[10] + abs(p) * f[WIDTH + 10]) * (4.0 * (abs(a9) + abs(a10) + abs(b9) + abs(b10)))
    size = f[11] + abs(p) * (f[WIDTH + 11] + abs(p * c2))
    d11 = by_slope + 19.0 * by_value + missing + ROUNDING
    d12 = 2.0 * by_value + missing + 2.0 * ROUNDING
    d21 = 38.0 * by_slope + missing + 4.0 * ROUNDING * size
    half, steep = 0.5 * h, 2.0 / h
    return p11, p12 * half, p21 * steep, p22, d11, d12 * half, d21 * steep


@kernel
def hill_chain(samples, c2, h, p, order, starts, ends, out):
    chain(hill_row, hill_step, WIDTH, samples, c2, h, p, order, starts, ends, out)


@kernel
def hill_scatter(samples, c2, h, p, order, starts, out):
    scatter(hill_row, hill_step, WIDTH, samples, c2, h, p, order, starts, out)
