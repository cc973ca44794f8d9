"""Birkhoff's normal form at the triangular libration points in double-double arithmetic: the plans
of `lie_plan`.

As `lie`, with two rows for each real number: the high and the low part of a coefficient's real part
and imaginary part, its size and its bar, both float64. `ROUND`, `CONSTANT` and the bounds of sums
are those of `lie` with DIGIT, the bound of one operation of double-doubles, in place of float64's.
What is known of the frequencies, which lose digits towards mu_R, enters as a relative error of the
linear forms and of each divisor (`start`).
"""

from math import inf, nan, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.libration.lie import SLACK, K, frequencies, measure
from survey.kernels.libration.lie_plan import (
    BY,
    CLEAR,
    COEFFICIENT_BAR,
    DELTA,
    DIVIDE,
    ETA,
    FACTOR,
    FINISH,
    FIRST,
    FROM,
    IMAGINARY,
    LACK,
    LAST,
    LINEAR,
    MULTIPLY,
    NUMBER,
    ONE,
    OPERATION,
    REAL,
    SIGN,
    SOURCE,
    TARGET,
    TO,
    XI,
)
from survey.kernels.math import double

LANES = 16
RE, RE_LOW, IM, IM_LOW, SIZE, BAR = (n * LANES for n in range(6))
WIDTH = 6 * LANES
DIVISOR, DIVISOR_LOW, OFF = (n * LANES for n in range(3))
DIVISOR_WIDTH = 3 * LANES
# of one operation, relative: at most 7 squares of the unit roundoff, which is 2^-53
DIGIT = 2.0**-103
ROUND = 2.2 * DIGIT
CONSTANT = 3.0 * DIGIT
LEAST = 1e-9  # s below it is at mu_R itself
NARROW = 1e-20  # a divisor below it is not divided by


@kernel
def normal_forms(code, indices, numbers, harmonics, diagonal, rows, mu, values, norms):
    """As `lie.normal_forms`; the bars include the rounding of the values to float64."""
    big, divisors = np.zeros((rows, WIDTH)), np.empty((len(harmonics), DIVISOR_WIDTH))
    for first in range(0, len(mu), LANES):
        count = min(LANES, len(mu) - first)
        for i in range(LANES):
            start(mu[first + min(i, count - 1)], i, harmonics, big, divisors)
        run(code, indices, numbers, divisors, big, norms, first, count)
        for d in range(len(diagonal)):
            row = big[diagonal[d]]
            for i in range(count):
                values[REAL, d, first + i] = row[RE + i]
                values[IMAGINARY, d, first + i] = row[IM + i]
                values[COEFFICIENT_BAR, d, first + i] = (
                    row[BAR + i] + abs(row[RE_LOW + i]) + abs(row[IM_LOW + i])
                ) * SLACK


@inline
def _set(row, i, re, im, relative):
    row[RE + i], row[RE_LOW + i], row[IM + i], row[IM_LOW + i] = re[0], re[1], im[0], im[1]
    size = sqrt(re[0] * re[0] + im[0] * im[0]) * SLACK
    row[SIZE + i] = size * (1.0 + relative)
    row[BAR + i] = size * (relative + ROUND)


@kernel
def start(mu, i, harmonics, big, divisors):
    """As `lie.start`; a divisor's row holds DIVISOR, DIVISOR_LOW and OFF, its relative error.

    s^2 = 1 - 27 mu (1 - mu) has an absolute error of 6 DIGIT, since its terms are at most 1. So s
    has the error `e` below, v = (1 - s)/2 and u = 1 - v have at most 11 DIGIT + e/2, and their
    roots, since u >= 1/2 and v is computed without cancellation, the relative error W = 14 DIGIT +
    e/2; the linear forms contain 1/sqrt(s) besides.
    """
    s, u, v, w1, w2 = frequencies(mu if mu > 0.0 and mu <= 0.5 else nan)
    if not s[0] > LEAST:
        s = (nan, nan)
    e = 4.0 * DIGIT / s[0] + 2.0 * DIGIT
    known, forms = 14.0 * DIGIT + 0.5 * e, 100.0 * DIGIT + 3.0 * e + e / s[0]
    delta = double.two_sum(1.0, -2.0 * mu)
    k = double.mul(K, delta)
    for j in range(2):
        omega, square = (w1, u) if j == 0 else (w2, v)
        sign = 1.0 if j == 0 else -1.0
        plus = double.add(square, (0.75, 0.0))
        h = double.sqrt(double.div(plus, double.times(double.mul(omega, s), 2.0)))
        g = double.div(h, plus)
        re, im = double.mul(k, g), double.times(double.mul(omega, g), 2.0 * sign)
        # keys ascend: zbar2, zbar1, z2, z1
        _set(big[XI + 3 - j], i, re, im, forms)
        _set(big[XI + 1 - j], i, re, double.neg(im), forms)
        _set(big[ETA + 3 - j], i, double.neg(h), (0.0, 0.0), forms)
        _set(big[ETA + 1 - j], i, double.neg(h), (0.0, 0.0), forms)
    _set(big[DELTA], i, delta, (0.0, 0.0), 0.0)
    _set(big[ONE], i, (1.0, 0.0), (0.0, 0.0), 0.0)
    for n in range(len(harmonics)):
        k1, k2, k3 = harmonics[n, 0], harmonics[n, 1], harmonics[n, 2]
        divisor = double.add(double.sub(double.times(w1, k1), double.times(w2, k2)), (k3, 0.0))
        size = abs(divisor[0])
        off = (abs(k1) + abs(k2)) * (known + 3.0 * DIGIT) + 3.0 * DIGIT * abs(k3)
        divisors[n, DIVISOR + i] = divisor[0] if size >= NARROW else nan
        divisors[n, DIVISOR_LOW + i] = divisor[1]
        divisors[n, OFF + i] = off / size if off < 0.1 * size else inf


@kernel
def run(code, indices, numbers, divisors, big, norms, lane, count):
    """As `lie.run`."""
    for c in range(len(code)):
        operation, first, last = code[c, OPERATION], code[c, FIRST], code[c, LAST]
        target, source = np.uint64(code[c, TARGET]), np.uint64(code[c, SOURCE])
        factor = np.uint64(code[c, FACTOR])
        if operation == MULTIPLY:
            for t in range(first, last):
                _multiply(big[target + indices[TO, t]], big[source + indices[FROM, t]], big[factor + indices[BY, t]],
                          numbers[NUMBER, t], numbers[SIGN, t])  # fmt: skip
        elif operation == LINEAR:
            for t in range(first, last):
                _linear(
                    big[indices[TO, t]], big[indices[FROM, t]], numbers[NUMBER, t], numbers[LACK, t]
                )
        elif operation == CLEAR:
            for r in range(last):
                row = big[target + np.uint64(r)]
                for i in range(WIDTH):
                    row[i] = 0.0
        elif operation == FINISH:
            for r in range(last):
                _finish(big[target + np.uint64(r)])
        elif operation == DIVIDE:
            for t in range(first, last):
                _divide(
                    big[target + indices[TO, t]],
                    big[source + indices[FROM, t]],
                    divisors[indices[BY, t]],
                    numbers[SIGN, t],
                )
        else:
            measure(
                big,
                source,
                indices,
                first,
                last,
                norms[target, :, :, lane : lane + count],
                RE,
                IM,
                BAR,
            )


@inline
def _multiply(out, f, g, number, sign):
    """out += number f g, f conjugated if sign = -1; `number` is a whole number."""
    size = abs(number)
    for i in range(LANES):
        p = double.times((f[RE + i], f[RE_LOW + i]), number)
        q = double.times((f[IM + i], f[IM_LOW + i]), number * sign)
        a, b = (g[RE + i], g[RE_LOW + i]), (g[IM + i], g[IM_LOW + i])
        re = double.add(
            (out[RE + i], out[RE_LOW + i]), double.sub(double.mul(p, a), double.mul(q, b))
        )
        im = double.add(
            (out[IM + i], out[IM_LOW + i]), double.add(double.mul(p, b), double.mul(q, a))
        )
        bar = size * (f[SIZE + i] * g[BAR + i] + f[BAR + i] * g[SIZE + i])
        out[RE + i], out[RE_LOW + i], out[IM + i], out[IM_LOW + i] = re[0], re[1], im[0], im[1]
        out[BAR + i] += bar + DIGIT * (abs(re[0]) + abs(im[0]))


@inline
def _linear(out, f, number, low):
    """out += (number + low) f."""
    size = abs(number)
    for i in range(LANES):
        re = double.mul((f[RE + i], f[RE_LOW + i]), (number, low))
        im = double.mul((f[IM + i], f[IM_LOW + i]), (number, low))
        re = double.add((out[RE + i], out[RE_LOW + i]), re)
        im = double.add((out[IM + i], out[IM_LOW + i]), im)
        out[RE + i], out[RE_LOW + i], out[IM + i], out[IM_LOW + i] = re[0], re[1], im[0], im[1]
        out[BAR + i] += size * (f[BAR + i] + CONSTANT * f[SIZE + i]) + DIGIT * (
            abs(re[0]) + abs(im[0])
        )


@inline
def _finish(row):
    """The size of a sum, and its own roundings to come."""
    for i in range(LANES):
        size = sqrt(row[RE + i] * row[RE + i] + row[IM + i] * row[IM + i])
        row[SIZE + i] = size * SLACK + row[BAR + i]
        row[BAR + i] += ROUND * row[SIZE + i]


@inline
def _divide(out, f, divisor, sign):
    """out = sign f / divisor, f conjugated if sign = -1."""
    for i in range(LANES):
        scale = double.div((sign, 0.0), (divisor[DIVISOR + i], divisor[DIVISOR_LOW + i]))
        re = double.mul(scale, (f[RE + i], f[RE_LOW + i]))
        im = double.mul(double.times(scale, sign), (f[IM + i], f[IM_LOW + i]))
        out[RE + i], out[RE_LOW + i], out[IM + i], out[IM_LOW + i] = re[0], re[1], im[0], im[1]
        off = 1.2 * divisor[OFF + i]
        out[SIZE + i] = abs(scale[0]) * f[SIZE + i] * (1.0 + off) * SLACK
        out[BAR + i] = (
            abs(scale[0]) * f[BAR + i] * (1.0 + off) * SLACK
            + (CONSTANT + ROUND + off) * out[SIZE + i]
        )
