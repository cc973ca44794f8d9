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

from survey.kernels.jit import inline, kernel
from survey.kernels.lanes import chain

ORDER = 16
SERVES = ("hill",)

DEGREE = 9
_POINTS, _WEIGHTS = legendre.leggauss(DEGREE + 1)
NODES = tuple(0.5 + 0.5 * _POINTS)
# Samples -> Legendre coefficients (well conditioned), then -> powers of x: the noise of the second stage is relative
# to each Legendre coefficient, and these decay.
TO_LEGENDRE = np.array([(j + 0.5) * _WEIGHTS * legendre.Legendre.basis(j)(_POINTS) for j in range(DEGREE + 1)])
TO_POWERS = np.zeros((DEGREE + 1, DEGREE + 1))
for _j in range(DEGREE + 1):
    TO_POWERS[: _j + 1, _j] = legendre.leg2poly([0.0] * _j + [1.0])
# By columns, so that products with them become vector code.
LEGENDRE_COLUMNS, POWER_COLUMNS = TO_LEGENDRE.T.copy(), TO_POWERS.T.copy()
WIDTH = DEGREE + 3
TAIL, SIZE = DEGREE + 1, DEGREE + 2
ROUNDING = 4.4e-16


def hill_density(rtol):
    """Steps per radian of the fastest phase, and per distance to the nearest singularity of z, for accuracy rtol."""
    scale = max(rtol, 1e-14) ** (-1 / ORDER)
    return 0.12 * scale, 0.85 * scale


@inline
def hill_row(samples, coefficients):
    """Per function: powers of x, then the last two Legendre coefficients, then the largest sample."""
    series = np.empty(DEGREE + 1)
    for c in range(2):
        size = 0.0
        for i in range(DEGREE + 1):
            size = max(size, abs(samples[c, i]))
            series[i] = coefficients[c, i] = 0.0
        for j in range(DEGREE + 1):
            for i in range(DEGREE + 1):
                series[i] += LEGENDRE_COLUMNS[j, i] * samples[c, j]
        for j in range(DEGREE + 1):
            for i in range(j + 1):
                coefficients[c, i] += POWER_COLUMNS[j, i] * series[j]
        coefficients[c, TAIL] = abs(series[DEGREE]) + abs(series[DEGREE - 1])
        coefficients[c, SIZE] = size


@inline
def hill_step(f, c2, p, h):
    """P and its local error bounds. Straight code: a loop over the coefficients would not become vector code."""
    q = -0.25 * h * h
    z0 = q * (f[0, 0] + p * f[1, 0] + p * p * c2)
    z1 = q * (f[0, 1] + p * f[1, 1])
    z2 = q * (f[0, 2] + p * f[1, 2])
    z3 = q * (f[0, 3] + p * f[1, 3])
    z4 = q * (f[0, 4] + p * f[1, 4])
    z5 = q * (f[0, 5] + p * f[1, 5])
    z6 = q * (f[0, 6] + p * f[1, 6])
    z7 = q * (f[0, 7] + p * f[1, 7])
    z8 = q * (f[0, 8] + p * f[1, 8])
    z9 = q * (f[0, 9] + p * f[1, 9])
    # fmt: off
    a2 = z0 * (1 / 2)
    a3 = z1 * (1 / 6)
    a4 = (z0 * a2 + z2) * (1 / 12)
    a5 = (z0 * a3 + z1 * a2 + z3) * (1 / 20)
    a6 = (z0 * a4 + z1 * a3 + z2 * a2 + z4) * (1 / 30)
    a7 = (z0 * a5 + z1 * a4 + z2 * a3 + z3 * a2 + z5) * (1 / 42)
    a8 = (z0 * a6 + z1 * a5 + z2 * a4 + z3 * a3 + z4 * a2 + z6) * (1 / 56)
    a9 = (z0 * a7 + z1 * a6 + z2 * a5 + z3 * a4 + z4 * a3 + z5 * a2 + z7) * (1 / 72)
    a10 = (z0 * a8 + z1 * a7 + z2 * a6 + z3 * a5 + z4 * a4 + z5 * a3 + z6 * a2 + z8) * (1 / 90)
    a11 = (z0 * a9 + z1 * a8 + z2 * a7 + z3 * a6 + z4 * a5 + z5 * a4 + z6 * a3 + z7 * a2 + z9) * (1 / 110)
    a12 = (z0 * a10 + z1 * a9 + z2 * a8 + z3 * a7 + z4 * a6 + z5 * a5 + z6 * a4 + z7 * a3 + z8 * a2) * (1 / 132)
    a13 = (z0 * a11 + z1 * a10 + z2 * a9 + z3 * a8 + z4 * a7 + z5 * a6 + z6 * a5 + z7 * a4
           + z8 * a3 + z9 * a2) * (1 / 156)
    a14 = (z0 * a12 + z1 * a11 + z2 * a10 + z3 * a9 + z4 * a8 + z5 * a7 + z6 * a6 + z7 * a5
           + z8 * a4 + z9 * a3) * (1 / 182)
    a15 = (z0 * a13 + z1 * a12 + z2 * a11 + z3 * a10 + z4 * a9 + z5 * a8 + z6 * a7 + z7 * a6
           + z8 * a5 + z9 * a4) * (1 / 210)
    a16 = (z0 * a14 + z1 * a13 + z2 * a12 + z3 * a11 + z4 * a10 + z5 * a9 + z6 * a8 + z7 * a7
           + z8 * a6 + z9 * a5) * (1 / 240)
    b3 = z0 * (1 / 6)
    b4 = z1 * (1 / 12)
    b5 = (z0 * b3 + z2) * (1 / 20)
    b6 = (z0 * b4 + z1 * b3 + z3) * (1 / 30)
    b7 = (z0 * b5 + z1 * b4 + z2 * b3 + z4) * (1 / 42)
    b8 = (z0 * b6 + z1 * b5 + z2 * b4 + z3 * b3 + z5) * (1 / 56)
    b9 = (z0 * b7 + z1 * b6 + z2 * b5 + z3 * b4 + z4 * b3 + z6) * (1 / 72)
    b10 = (z0 * b8 + z1 * b7 + z2 * b6 + z3 * b5 + z4 * b4 + z5 * b3 + z7) * (1 / 90)
    b11 = (z0 * b9 + z1 * b8 + z2 * b7 + z3 * b6 + z4 * b5 + z5 * b4 + z6 * b3 + z8) * (1 / 110)
    b12 = (z0 * b10 + z1 * b9 + z2 * b8 + z3 * b7 + z4 * b6 + z5 * b5 + z6 * b4 + z7 * b3 + z9) * (1 / 132)
    b13 = (z0 * b11 + z1 * b10 + z2 * b9 + z3 * b8 + z4 * b7 + z5 * b6 + z6 * b5 + z7 * b4 + z8 * b3) * (1 / 156)
    b14 = (z0 * b12 + z1 * b11 + z2 * b10 + z3 * b9 + z4 * b8 + z5 * b7 + z6 * b6 + z7 * b5
           + z8 * b4 + z9 * b3) * (1 / 182)
    b15 = (z0 * b13 + z1 * b12 + z2 * b11 + z3 * b10 + z4 * b9 + z5 * b8 + z6 * b7 + z7 * b6
           + z8 * b5 + z9 * b4) * (1 / 210)
    b16 = (z0 * b14 + z1 * b13 + z2 * b12 + z3 * b11 + z4 * b10 + z5 * b9 + z6 * b8 + z7 * b7
           + z8 * b6 + z9 * b5) * (1 / 240)
    b17 = (z0 * b15 + z1 * b14 + z2 * b13 + z3 * b12 + z4 * b11 + z5 * b10 + z6 * b9 + z7 * b8
           + z8 * b7 + z9 * b6) * (1 / 272)
    # fmt: on
    a_even = 1.0 + (a2 + (a4 + (a6 + (a8 + (a10 + (a12 + (a14 + a16)))))))
    a_odd = a3 + (a5 + (a7 + (a9 + (a11 + (a13 + a15)))))
    b_even = b4 + (b6 + (b8 + (b10 + (b12 + (b14 + b16)))))
    b_odd = 1.0 + (b3 + (b5 + (b7 + (b9 + (b11 + (b13 + (b15 + b17)))))))
    # Slopes: that of an even series is odd.
    da_odd = 2 * a2 + (4 * a4 + (6 * a6 + (8 * a8 + (10 * a10 + (12 * a12 + (14 * a14 + 16 * a16))))))
    da_even = 3 * a3 + (5 * a5 + (7 * a7 + (9 * a9 + (11 * a11 + (13 * a13 + 15 * a15)))))
    db_odd = 4 * b4 + (6 * b6 + (8 * b8 + (10 * b10 + (12 * b12 + (14 * b14 + 16 * b16)))))
    db_even = 1.0 + (3 * b3 + (5 * b5 + (7 * b7 + (9 * b9 + (11 * b11 + (13 * b13 + (15 * b15 + 17 * b17)))))))
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
    a_tail = 3.0 * a_last * (a_last / (abs(a13) + abs(a14) + 1e-300) + 0.02)
    b_tail = 3.0 * b_last * (b_last / (abs(b14) + abs(b15) + 1e-300) + 0.02)
    a_size, da_size = abs(a_even) + abs(a_odd), abs(da_even) + abs(da_odd)
    b_size, db_size = abs(b_even) + abs(b_odd), abs(db_even) + abs(db_odd)
    # What the projection left out acts only through the solutions' own components of that degree.
    missing = abs(q) * (f[0, 10] + abs(p) * f[1, 10]) * (4.0 * (abs(a9) + abs(a10) + abs(b9) + abs(b10)))
    size = abs(q) * (f[0, 11] + abs(p) * f[1, 11] + p * p * abs(c2))
    d11 = a_tail * (db_size + 18.0 * b_size) + b_tail * (da_size + 19.0 * a_size) + missing + ROUNDING
    d12 = 2.0 * (a_tail * b_size + b_tail * a_size) + missing + 2.0 * ROUNDING
    d21 = 36.0 * a_tail * db_size + 38.0 * b_tail * da_size + missing + 4.0 * ROUNDING * size
    half = 0.5 * h
    return p11, p12 * half, p21 / half, p22, d11, d12 * half, d21 / half


@kernel
def hill_chain(samples, c2, h, p, order, starts, ends, out):
    chain(hill_row, hill_step, WIDTH, samples, c2, h, p, order, starts, ends, out)
