"""Double-double arithmetic of this folder's own, not the kernels': pairs (high, low) with a fused
multiply-add.

Sums and products are those of M. Joldes, J.-M. Muller, V. Popescu, ACM Trans. Math. Softw. 44
(2017) 15res (algorithms 6, 12, 17), good to about 2^-102 relative. A series is an array (2, terms).
"""

from math import sqrt

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from survey.truth.compiled import inline

PI = (3.141592653589793, 1.2246467991473532e-16)
HALF_PI_PARTS = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33)


@intrinsic
def fma(typingctx, a, b, c):
    """a b + c, rounded once."""

    def code(context, builder, signature, values):
        double = ir.DoubleType()
        fused = builder.module.declare_intrinsic(
            "llvm.fma", (double,), ir.FunctionType(double, (double,) * 3)
        )
        return builder.call(fused, values)

    return types.float64(types.float64, types.float64, types.float64), code


@inline
def pair(row, n):
    """The number in columns n and n + 1 of a row, high and low."""
    return row[n], row[n + 1]


@inline
def keep(row, n, x):
    """Set columns n and n + 1 of a row."""
    row[n], row[n + 1] = x


@inline
def two_sum(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@inline
def fast(a, b):
    s = a + b
    return s, b - (s - a)


@inline
def add(x, y):
    s, e = two_sum(x[0], y[0])
    t, f = two_sum(x[1], y[1])
    s, e = fast(s, e + t)
    return fast(s, e + f)


@inline
def neg(x):
    return -x[0], -x[1]


@inline
def sub(x, y):
    return add(x, (-y[0], -y[1]))


@inline
def mul(x, y):
    p = x[0] * y[0]
    e = fma(x[0], y[0], -p)
    t = fma(x[0], y[1], x[1] * y[1])
    return fast(p, e + fma(x[1], y[0], t))


@inline
def times(x, c):
    p = x[0] * c
    return fast(p, fma(x[1], c, fma(x[0], c, -p)))


@inline
def div(x, y):
    q = x[0] / y[0]
    r = sub(x, times(y, q))
    p = r[0] / y[0]
    r = sub(r, times(y, p))
    q, p = fast(q, p)
    return add((q, p), (r[0] / y[0], 0.0))


@inline
def root(x):
    if x[0] <= 0.0:
        return 0.0, 0.0
    r = sqrt(x[0])
    e = sub(x, (r * r, fma(r, r, -(r * r))))
    r, p = fast(r, e[0] / (2.0 * r))
    e = sub(x, mul((r, p), (r, p)))
    return add((r, p), (e[0] / (2.0 * r), 0.0))


@inline
def conv(a, b, n):
    """Term n of the product of two series: one compensated sum."""
    high, low = 0.0, 0.0
    for i in range(n + 1):
        x, y = a[0, i], b[0, n - i]
        p = x * y
        e = fma(x, y, -p)
        high, f = two_sum(high, p)
        low += f + (e + fma(x, b[1, n - i], a[1, i] * y))
    return fast(high, low)


@inline
def store(series, n, x):
    series[0, n], series[1, n] = x


@inline
def get(series, n):
    return series[0, n], series[1, n]


@inline
def horner(series, h):
    """The series at h."""
    n = series.shape[1] - 1
    x = (series[0, n], series[1, n])
    for i in range(n - 1, -1, -1):
        x = add(mul(x, h), (series[0, i], series[1, i]))
    return x


@inline
def slope(series, h):
    """Its derivative at h."""
    n = series.shape[1] - 1
    x = times((series[0, n], series[1, n]), float(n))
    for i in range(n - 1, 0, -1):
        x = add(mul(x, h), times((series[0, i], series[1, i]), float(i)))
    return x


@inline
def mean(a, b):
    """The arithmetic-geometric mean."""
    for _ in range(60):
        if abs(a[0] - b[0]) <= 1e-17 * abs(a[0]):
            break
        a, b = times(add(a, b), 0.5), root(mul(a, b))
    return times(add(a, b), 0.5)


@inline
def reach(series, scale, tolerance):
    """The h at which the last two terms of a series are `tolerance` times `scale`."""
    n = series.shape[1]
    a, b = abs(series[0, n - 1]) + 1e-300, abs(series[0, n - 2]) + 1e-300
    return min(
        (tolerance * scale / a) ** (1.0 / (n - 1)), (tolerance * scale / b) ** (1.0 / (n - 2))
    )


@inline
def sine_cosine(x):
    """Sine and cosine of a double-double (moderate) angle: reduced by pi/2, then halved and summed."""
    q = np.rint(x[0] / HALF_PI_PARTS[0])
    r = (x[0], x[1])
    for part in HALF_PI_PARTS:
        p = q * part
        r = sub(r, (p, fma(q, part, -p)))
    h = times(r, 1.0 / 64.0)
    # sin and 1 - cos of r/64
    h2 = mul(h, h)
    s, c = (0.0, 0.0), (0.0, 0.0)
    for i in range(9, 0, -1):
        s = div(mul(add((1.0, 0.0), neg(s)), h2), ((2.0 * i) * (2.0 * i + 1.0), 0.0))
        c = div(mul(add((1.0, 0.0), neg(c)), h2), ((2.0 * i + 1.0) * (2.0 * i + 2.0), 0.0))
    sin = mul(h, sub((1.0, 0.0), s))
    short = times(mul(h2, sub((1.0, 0.0), c)), 0.5)  # 1 - cos
    for _ in range(6):
        sin, short = (
            mul(times(sin, 2.0), sub((1.0, 0.0), short)),
            times(mul(short, sub((2.0, 0.0), short)), 2.0),
        )
    cos = sub((1.0, 0.0), short)
    k = int(q) & 3
    if k == 0:
        return sin, cos
    if k == 1:
        return cos, neg(sin)
    if k == 2:
        return neg(sin), neg(cos)
    return neg(cos), sin
