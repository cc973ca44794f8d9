"""Birkhoff's normal form at the triangular libration points, many mu in lock step: the plans of
`lie_plan`.

A row is a coefficient in all lanes: real part, imaginary part, size and bar. `size` bounds its modulus, and `bar` the
modulus of its error plus ROUND sizes, which covers the roundings of the products that the row enters; so a product of
f and g adds |C| (size_f bar_g + bar_f size_g), and each addition to a sum the rounding of that partial sum (running
error analysis: N. J. Higham, Accuracy and Stability of Numerical Algorithms, 3.3). Second-order products of bars are
in it, as size includes the error. A lane's operations do not depend on its neighbours.
"""

from math import nan, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
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
    LAST,
    LINEAR,
    MULTIPLY,
    NORM,
    NORM_BAR,
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
from survey.kernels.math.roundoff import ROUNDOFF

LANES = 32
RE, IM, SIZE, BAR, WIDTH = 0, LANES, 2 * LANES, 3 * LANES, 4 * LANES
# a product's roundings are 3 sqrt 2 ROUNDOFF of |C| |f| |g|, shared by two factors
ROUND = 2.2 * ROUNDOFF
# beyond ROUND: a constant has four, and its product one; a quotient by a divisor, three
CONSTANT = 3.0 * ROUNDOFF
FORMS = 1.01 * ROUNDOFF  # the linear forms' relative error: rounded double-doubles
SLACK = 1.0 + 1e-9  # the roundings of the bars themselves
K = (1.299038105676658, -3.5759170798963886e-17)  # 3 sqrt(3) / 4
LEAST = 3e-7  # s below it, which is mu within 4e-15 of mu_R, has not all digits in double-double
NARROW = 1e-12  # a divisor below it is not divided by


@kernel
def normal_forms(code, indices, numbers, harmonics, diagonal, rows, mu, values, norms):
    """values (3, M, N): REAL to COEFFICIENT_BAR of the M diagonal coefficients.

    norms (measured, 2, 3, N): NORM, NORM_BAR. NaN where mu lies outside (0, mu_R) or next to mu_R,
    and in what a divisor below NARROW would enter.
    """
    big, divisors = np.zeros((rows, WIDTH)), np.empty((len(harmonics), LANES))
    for first in range(0, len(mu), LANES):
        count = min(LANES, len(mu) - first)
        for i in range(LANES):
            start(mu[first + min(i, count - 1)], i, harmonics, big, divisors)
        run(code, indices, numbers, divisors, big, norms, first, count)
        for d in range(len(diagonal)):
            for i in range(count):
                values[REAL, d, first + i] = big[diagonal[d], RE + i]
                values[IMAGINARY, d, first + i] = big[diagonal[d], IM + i]
                values[COEFFICIENT_BAR, d, first + i] = big[diagonal[d], BAR + i] * SLACK


@inline
def frequencies(mu):
    """(s, u, v, w1, w2) as double-doubles: s = u - v = sqrt(1 - 27 mu (1 - mu)), u = w1^2, v = w2^2."""
    square = double.two_prod(mu, mu)
    y = double.sub((mu, 0.0), square)
    s = double.sqrt(double.sub((1.0, 0.0), double.times(y, 27.0)))
    v = double.div(double.times(y, 13.5), double.add((1.0, 0.0), s))
    u = double.sub((1.0, 0.0), v)
    return s, u, v, double.sqrt(u), double.sqrt(v)


@inline
def _set(row, i, re, im, relative):
    row[RE + i], row[IM + i] = re, im
    size = sqrt(re * re + im * im)
    row[SIZE + i] = size * (1.0 + relative)
    row[BAR + i] = size * (relative + ROUND)


@kernel
def start(mu, i, harmonics, big, divisors):
    """Lane i: the linear forms of xi and eta in z1, z2 and conjugates, in the order of their keys,
    and the divisors.
    """
    s, u, v, w1, w2 = frequencies(mu if mu > 0.0 and mu <= 0.5 else nan)
    if not s[0] > LEAST:
        s = (nan, nan)
    delta = double.two_sum(1.0, -2.0 * mu)
    k = double.mul(K, delta)
    for j in range(2):
        omega, square = (w1, u) if j == 0 else (w2, v)
        sign = 1.0 if j == 0 else -1.0
        plus = double.add(square, (0.75, 0.0))
        h = double.sqrt(double.div(plus, double.times(double.mul(omega, s), 2.0)))
        g = double.div(h, plus)
        re, im = double.mul(k, g)[0], 2.0 * sign * double.mul(omega, g)[0]
        # keys ascend: zbar2, zbar1, z2, z1
        _set(big[XI + 3 - j], i, re, im, FORMS)
        _set(big[XI + 1 - j], i, re, -im, FORMS)
        _set(big[ETA + 3 - j], i, -h[0], 0.0, FORMS)
        _set(big[ETA + 1 - j], i, -h[0], 0.0, FORMS)
    _set(big[DELTA], i, delta[0], 0.0, FORMS)
    _set(big[ONE], i, 1.0, 0.0, 0.0)
    for n in range(len(harmonics)):
        k1, k2, k3 = harmonics[n, 0], harmonics[n, 1], harmonics[n, 2]
        divisor = double.add(double.sub(double.times(w1, k1), double.times(w2, k2)), (k3, 0.0))[0]
        divisors[n, i] = divisor if abs(divisor) >= NARROW else nan


@kernel
def run(code, indices, numbers, divisors, big, norms, lane, count):
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
                _linear(big[indices[TO, t]], big[indices[FROM, t]], numbers[NUMBER, t])
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
    """out += number f g, f conjugated if sign = -1."""
    other, size = number * sign, abs(number)
    for i in range(LANES):
        p, q = number * f[RE + i], other * f[IM + i]
        re = out[RE + i] + (p * g[RE + i] - q * g[IM + i])
        im = out[IM + i] + (p * g[IM + i] + q * g[RE + i])
        bar = size * (f[SIZE + i] * g[BAR + i] + f[BAR + i] * g[SIZE + i])
        out[RE + i], out[IM + i] = re, im
        out[BAR + i] += bar + ROUNDOFF * (abs(re) + abs(im))


@inline
def _linear(out, f, number):
    """out += number f."""
    size = abs(number)
    for i in range(LANES):
        re, im = out[RE + i] + number * f[RE + i], out[IM + i] + number * f[IM + i]
        out[RE + i], out[IM + i] = re, im
        out[BAR + i] += size * (f[BAR + i] + CONSTANT * f[SIZE + i]) + ROUNDOFF * (
            abs(re) + abs(im)
        )


@inline
def _finish(row):
    """The size of a sum, and its own roundings to come."""
    for i in range(LANES):
        size = sqrt(row[RE + i] * row[RE + i] + row[IM + i] * row[IM + i])
        row[SIZE + i] = size + row[BAR + i]
        row[BAR + i] += ROUND * row[SIZE + i]


@inline
def _divide(out, f, divisor, sign):
    """out = sign f / divisor, f conjugated if sign = -1."""
    for i in range(LANES):
        scale = sign / divisor[i]
        out[RE + i], out[IM + i] = scale * f[RE + i], scale * sign * f[IM + i]
        out[SIZE + i] = abs(scale) * f[SIZE + i] * SLACK
        out[BAR + i] = abs(scale) * f[BAR + i] + (CONSTANT + ROUND) * out[SIZE + i]


@inline
def measure(big, source, weights, first, last, out, real, imaginary, bar):
    """Sums over a degree's monomials, both conjugates, of |k_j| |F|, and their bars; where a row's
    parts begin.
    """
    out[:] = 0.0
    for t in range(first, last):
        row = big[source + np.uint64(t - first)]
        for j in range(3):
            weight = 2.0 * float(weights[j, t])
            for i in range(out.shape[2]):
                out[NORM, j, i] += weight * sqrt(
                    row[real + i] * row[real + i] + row[imaginary + i] * row[imaginary + i]
                )
                out[NORM_BAR, j, i] += weight * row[bar + i]
    for j in range(3):
        for i in range(out.shape[2]):
            out[NORM_BAR, j, i] = (
                out[NORM_BAR, j, i] * SLACK + (last - first + 4) * ROUNDOFF * out[NORM, j, i]
            )
