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

from survey.kernels import danby
from survey.kernels.danby import COLUMN, COLUMNS, D1, D2, OWN, TILE, E
from survey.kernels.jit import inline, kernel, splice
from survey.kernels.lanes import chain, scatter

ORDER = 16
SERVES = ("danby", "hill")
COST = {"danby": 10.0}  # time, relative to the default of each family

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
ENDS = OWN + WIDTH


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


def danby_steps(e, rtol):
    """Steps of half a period for accuracy rtol."""
    x = -np.log1p(-e)
    return max(rtol, 1e-14) ** (-1 / ORDER) * (0.6 + 1.15 * np.sqrt(x) + 0.4 * x)


@splice
def _danby_row(v, k, work, count):
    """Powers of x in k r(f) (rows OWN to OWN + 9), and a bound of the Legendre coefficients left out (OWN + 10)."""
    paired, series = np.empty((HALF, TILE)), np.empty((HALF, TILE))
    for i in range(count):
        work[OWN + TAIL, i] = work[OWN + SIZE, i] = 0.0
    for parity in range(2):
        sign = 1.0 - 2.0 * parity
        for j in range(HALF):
            left, right = v[HALF - 1 - j], v[HALF + j]
            for i in range(count):
                e = work[E, i]
                paired[j, i] = k / ((1.0 - e) + e * right) + sign * (k / ((1.0 - e) + e * left))
        for j in range(HALF):
            for i in range(count):
                series[j, i] = _product(TO_LEGENDRE[parity], j, paired, i)
        for j in range(HALF):
            for i in range(count):
                work[OWN + 2 * j + parity, i] = _product(TO_POWERS[parity], j, series, i)
        for i in range(count):
            work[OWN + TAIL, i] += abs(series[HALF - 1, i])
            work[OWN + SIZE, i] += abs(series[HALF - 2, i])
    for i in range(count):  # those left out, at the rate at which the last four fall
        tail = work[OWN + TAIL, i]
        work[OWN + TAIL, i] = tail * (2.0 * tail / (work[OWN + SIZE, i] + 1e-150) + 0.004)


@inline
def _danby_column(f, i, k, d1, d2, x0, q0, p0, m0):
    """A column of Y at both ends of a step, and the bound of its errors."""
    r0, r1, r2, r3, r4 = f[OWN, i], f[OWN + 1, i], f[OWN + 2, i], f[OWN + 3, i], f[OWN + 4, i]
    r5, r6, r7, r8, r9 = f[OWN + 5, i], f[OWN + 6, i], f[OWN + 7, i], f[OWN + 8, i], f[OWN + 9, i]
    # fmt: off
    x1 = k * (p0 - m0)
    m1 = k * (x0 - q0)
    q1 = -x1 - d2 * (r0 * m0)
    p1 = d1 * (r0 * x0) - m1
    x2 = k * (p1 - m1) * (1 / 2)
    m2 = k * (x1 - q1) * (1 / 2)
    q2 = -x2 - d2 * (r1 * m0 + r0 * m1) * (1 / 2)
    p2 = d1 * (r1 * x0 + r0 * x1) * (1 / 2) - m2
    x3 = k * (p2 - m2) * (1 / 3)
    m3 = k * (x2 - q2) * (1 / 3)
    q3 = -x3 - d2 * (r2 * m0 + r1 * m1 + r0 * m2) * (1 / 3)
    p3 = d1 * (r2 * x0 + r1 * x1 + r0 * x2) * (1 / 3) - m3
    x4 = k * (p3 - m3) * (1 / 4)
    m4 = k * (x3 - q3) * (1 / 4)
    q4 = -x4 - d2 * (r3 * m0 + r2 * m1 + r1 * m2 + r0 * m3) * (1 / 4)
    p4 = d1 * (r3 * x0 + r2 * x1 + r1 * x2 + r0 * x3) * (1 / 4) - m4
    x5 = k * (p4 - m4) * (1 / 5)
    m5 = k * (x4 - q4) * (1 / 5)
    q5 = -x5 - d2 * (r4 * m0 + r3 * m1 + r2 * m2 + r1 * m3 + r0 * m4) * (1 / 5)
    p5 = d1 * (r4 * x0 + r3 * x1 + r2 * x2 + r1 * x3 + r0 * x4) * (1 / 5) - m5
    x6 = k * (p5 - m5) * (1 / 6)
    m6 = k * (x5 - q5) * (1 / 6)
    q6 = -x6 - d2 * (r5 * m0 + r4 * m1 + r3 * m2 + r2 * m3 + r1 * m4 + r0 * m5) * (1 / 6)
    p6 = d1 * (r5 * x0 + r4 * x1 + r3 * x2 + r2 * x3 + r1 * x4 + r0 * x5) * (1 / 6) - m6
    x7 = k * (p6 - m6) * (1 / 7)
    m7 = k * (x6 - q6) * (1 / 7)
    q7 = -x7 - d2 * (r6 * m0 + r5 * m1 + r4 * m2 + r3 * m3 + r2 * m4 + r1 * m5 + r0 * m6) * (1 / 7)
    p7 = d1 * (r6 * x0 + r5 * x1 + r4 * x2 + r3 * x3 + r2 * x4 + r1 * x5 + r0 * x6) * (1 / 7) - m7
    x8 = k * (p7 - m7) * (1 / 8)
    m8 = k * (x7 - q7) * (1 / 8)
    q8 = -x8 - d2 * (r7 * m0 + r6 * m1 + r5 * m2 + r4 * m3 + r3 * m4 + r2 * m5 + r1 * m6 + r0 * m7) * (1 / 8)
    p8 = d1 * (r7 * x0 + r6 * x1 + r5 * x2 + r4 * x3 + r3 * x4 + r2 * x5 + r1 * x6 + r0 * x7) * (1 / 8) - m8
    x9 = k * (p8 - m8) * (1 / 9)
    m9 = k * (x8 - q8) * (1 / 9)
    q9 = -x9 - d2 * (r8 * m0 + r7 * m1 + r6 * m2 + r5 * m3 + r4 * m4 + r3 * m5 + r2 * m6 + r1 * m7 + r0 * m8) * (1 / 9)
    p9 = d1 * (r8 * x0 + r7 * x1 + r6 * x2 + r5 * x3 + r4 * x4 + r3 * x5 + r2 * x6 + r1 * x7 + r0 * x8) * (1 / 9) - m9
    x10 = k * (p9 - m9) * (1 / 10)
    m10 = k * (x9 - q9) * (1 / 10)
    q10 = -x10 - d2 * (r9 * m0 + r8 * m1 + r7 * m2 + r6 * m3 + r5 * m4 + r4 * m5 + r3 * m6 + r2 * m7 + r1 * m8
             + r0 * m9) * (1 / 10)
    p10 = d1 * (r9 * x0 + r8 * x1 + r7 * x2 + r6 * x3 + r5 * x4 + r4 * x5 + r3 * x6 + r2 * x7 + r1 * x8
             + r0 * x9) * (1 / 10) - m10
    x11 = k * (p10 - m10) * (1 / 11)
    m11 = k * (x10 - q10) * (1 / 11)
    q11 = -x11 - d2 * (r9 * m1 + r8 * m2 + r7 * m3 + r6 * m4 + r5 * m5 + r4 * m6 + r3 * m7 + r2 * m8 + r1 * m9
             + r0 * m10) * (1 / 11)
    p11 = d1 * (r9 * x1 + r8 * x2 + r7 * x3 + r6 * x4 + r5 * x5 + r4 * x6 + r3 * x7 + r2 * x8 + r1 * x9
             + r0 * x10) * (1 / 11) - m11
    x12 = k * (p11 - m11) * (1 / 12)
    m12 = k * (x11 - q11) * (1 / 12)
    q12 = -x12 - d2 * (r9 * m2 + r8 * m3 + r7 * m4 + r6 * m5 + r5 * m6 + r4 * m7 + r3 * m8 + r2 * m9 + r1 * m10
             + r0 * m11) * (1 / 12)
    p12 = d1 * (r9 * x2 + r8 * x3 + r7 * x4 + r6 * x5 + r5 * x6 + r4 * x7 + r3 * x8 + r2 * x9 + r1 * x10
             + r0 * x11) * (1 / 12) - m12
    x13 = k * (p12 - m12) * (1 / 13)
    m13 = k * (x12 - q12) * (1 / 13)
    q13 = -x13 - d2 * (r9 * m3 + r8 * m4 + r7 * m5 + r6 * m6 + r5 * m7 + r4 * m8 + r3 * m9 + r2 * m10 + r1 * m11
             + r0 * m12) * (1 / 13)
    p13 = d1 * (r9 * x3 + r8 * x4 + r7 * x5 + r6 * x6 + r5 * x7 + r4 * x8 + r3 * x9 + r2 * x10 + r1 * x11
             + r0 * x12) * (1 / 13) - m13
    x14 = k * (p13 - m13) * (1 / 14)
    m14 = k * (x13 - q13) * (1 / 14)
    q14 = -x14 - d2 * (r9 * m4 + r8 * m5 + r7 * m6 + r6 * m7 + r5 * m8 + r4 * m9 + r3 * m10 + r2 * m11 + r1 * m12
             + r0 * m13) * (1 / 14)
    p14 = d1 * (r9 * x4 + r8 * x5 + r7 * x6 + r6 * x7 + r5 * x8 + r4 * x9 + r3 * x10 + r2 * x11 + r1 * x12
             + r0 * x13) * (1 / 14) - m14
    x15 = k * (p14 - m14) * (1 / 15)
    m15 = k * (x14 - q14) * (1 / 15)
    q15 = -x15 - d2 * (r9 * m5 + r8 * m6 + r7 * m7 + r6 * m8 + r5 * m9 + r4 * m10 + r3 * m11 + r2 * m12 + r1 * m13
             + r0 * m14) * (1 / 15)
    p15 = d1 * (r9 * x5 + r8 * x6 + r7 * x7 + r6 * x8 + r5 * x9 + r4 * x10 + r3 * x11 + r2 * x12 + r1 * x13
             + r0 * x14) * (1 / 15) - m15
    x16 = k * (p15 - m15) * (1 / 16)
    m16 = k * (x15 - q15) * (1 / 16)
    q16 = -x16 - d2 * (r9 * m6 + r8 * m7 + r7 * m8 + r6 * m9 + r5 * m10 + r4 * m11 + r3 * m12 + r2 * m13 + r1 * m14
             + r0 * m15) * (1 / 16)
    p16 = d1 * (r9 * x6 + r8 * x7 + r7 * x8 + r6 * x9 + r5 * x10 + r4 * x11 + r3 * x12 + r2 * x13 + r1 * x14
             + r0 * x15) * (1 / 16) - m16
    # fmt: on
    x_even, x_odd = x0 + _sum(x2, x4, x6, x8, x10, x12, x14, x16), _sum(x1, x3, x5, x7, x9, x11, x13, x15)
    q_even, q_odd = q0 + _sum(q2, q4, q6, q8, q10, q12, q14, q16), _sum(q1, q3, q5, q7, q9, q11, q13, q15)
    p_even, p_odd = p0 + _sum(p2, p4, p6, p8, p10, p12, p14, p16), _sum(p1, p3, p5, p7, p9, p11, p13, p15)
    m_even, m_odd = m0 + _sum(m2, m4, m6, m8, m10, m12, m14, m16), _sum(m1, m3, m5, m7, m9, m11, m13, m15)
    # Truncation: the next two coefficients, at the rate at which the last four fall, with a margin of 2.
    last, before = _largest(x15, q15, p15, m15) + _largest(x16, q16, p16, m16), _largest(x13, q13, p13, m13)
    before += _largest(x14, q14, p14, m14) + 1e-150
    error = last * (2.0 * last / before + 0.004)
    # What the projection left out acts only through the solutions' own components of that degree.
    error += 4.0 * d1 * f[OWN + TAIL, i] * (abs(x9) + abs(x10) + abs(m9) + abs(m10))
    return (
        x_even + x_odd, q_even + q_odd, p_even + p_odd, m_even + m_odd,
        x_even - x_odd, q_even - q_odd, p_even - p_odd, m_even - m_odd, error, error,
    )  # fmt: skip


@inline
def _sum(a, b, c, d, e, f, g, h):
    """The sum, from the small end."""
    return a + (b + (c + (d + (e + (f + (g + h))))))


@inline
def _largest(a, b, c, d):
    return max(max(abs(a), abs(b)), max(abs(c), abs(d)))


@splice
def danby_columns(v, h, work, count):
    """See `kernels.danby.chain`."""
    k = 0.5 * h
    _danby_row(v, k, work, count)
    for c in range(4):
        x, q, p, m = 1.0 * (c == 0), 1.0 * (c == 1), 1.0 * (c == 2), 1.0 * (c == 3)
        for i in range(count):  # into rows that are constants, else it would not become vector code
            ends = _danby_column(work, i, k, work[D1, i], work[D2, i], x, q, p, m)
            for j in range(COLUMN):
                work[ENDS + j, i] = ends[j]
        for j in range(COLUMN):
            for i in range(count):
                work[COLUMNS + COLUMN * c + j, i] = work[ENDS + j, i]


@kernel
def danby_chain(v, h, e, d1, d2, out):
    """See `kernels.danby.chain`."""
    danby.chain(danby_columns, WIDTH + COLUMN, v, h, e, d1, d2, out)
