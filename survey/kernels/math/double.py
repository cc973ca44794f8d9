"""Double-double numbers: a pair (hi, lo) of float64 whose exact sum, |lo| <= ulp(hi) / 2, carries about 31 digits.

Each operation is good to a few PAIR_ROUNDOFF (`roundoff`), relative to its result. Strict floats
are what makes them right: no fastmath, no contraction. Range: products between 1e-290 and 1e300.
The error of a product takes one fused instruction where the processor has it and Dekker's splitting
elsewhere: both are exact, so the bits are the same.

Sources: T. J. Dekker, Numer. Math. 18 (1971) 224 (product, split); D. H. Bailey's QD (add, div,
sqrt); T. Ogita, S. M. Rump, S. Oishi, SIAM J. Sci. Comput. 26 (2005) 1955 (inner products); DLMF
19.8(i) (mean).
"""

from fractions import Fraction
from math import sqrt as root

from llvmlite import ir
from numba import types
from numba.extending import lower_builtin, type_callable

from survey.kernels.jit import HAS_FMA, inline

SPLITTER = 134217729.0  # 2^27 + 1
PI = (3.141592653589793, 1.2246467991473532e-16)
HALF_PI = (1.5707963267948966, 6.123233995736766e-17)
HALF_PI_REST = -1.4973849048591698e-33  # for what is left of pi / 2 beside it
MEANS = 20
GAP = 1e-16  # convergence is quadratic: the next mean has every digit


def of_fraction(number):
    """A Fraction as (hi, lo)."""
    high = float(number)
    return high, float(number - Fraction(high))


@inline
def two_sum(a, b):
    """a + b exactly: the rounded sum and its error."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@inline
def quick_two_sum(a, b):
    """As `two_sum`, where |a| >= |b| or a = 0."""
    s = a + b
    return s, b - (s - a)


def split_error(a, b, p):
    """a b - p exactly, p the rounded product."""
    c, d = SPLITTER * a, SPLITTER * b
    high, other = c - (c - a), d - (d - b)
    low, rest = a - high, b - other
    return ((high * other - p) + high * rest + low * other) + low * rest


def fused_error(a, b, p):
    """As `split_error`, by one instruction of compiled code."""
    return split_error(a, b, p)


@type_callable(fused_error)
def _typed(context):
    return lambda a, b, p: types.float64(types.float64, types.float64, types.float64)


@lower_builtin(fused_error, types.float64, types.float64, types.float64)
def _fused(context, builder, signature, values):
    a, b, p = values
    double = ir.DoubleType()
    fma = builder.module.declare_intrinsic(
        "llvm.fma", (double,), ir.FunctionType(double, (double,) * 3)
    )
    return builder.call(fma, [a, b, builder.fneg(p)])


_error = fused_error if HAS_FMA else inline(split_error)


@inline
def two_prod(a, b):
    """a b exactly: the rounded product and its error."""
    p = a * b
    return p, _error(a, b, p)


@inline
def neg(a):
    return -a[0], -a[1]


@inline
def add(a, b):
    """a + b, however much of it cancels."""
    s, e = two_sum(a[0], b[0])
    t, f = two_sum(a[1], b[1])
    s, e = quick_two_sum(s, e + t)
    return quick_two_sum(s, e + f)


@inline
def sub(a, b):
    return add(a, neg(b))


@inline
def loose(a, b):
    """a + b within PAIR_ROUNDOFF (|a| + |b|): half of `add`, for terms of one sign, or with errors
    of their own.
    """
    s, e = two_sum(a[0], b[0])
    return quick_two_sum(s, e + (a[1] + b[1]))


@inline
def shifted(a, number):
    """a plus a float64."""
    s, e = two_sum(a[0], number)
    return quick_two_sum(s, e + a[1])


@inline
def mul(a, b):
    p, e = two_prod(a[0], b[0])
    return quick_two_sum(p, e + (a[0] * b[1] + a[1] * b[0]))


@inline
def sum_of_products(a, b, c, d, e, f):
    """a b + c d + e f, within 3 PAIR_ROUNDOFF of the sum of |terms|."""
    p, x = two_prod(a[0], b[0])
    q, y = two_prod(c[0], d[0])
    r, z = two_prod(e[0], f[0])
    s, u = two_sum(p, q)
    s, v = two_sum(s, r)
    x += a[0] * b[1] + a[1] * b[0]
    y += c[0] * d[1] + c[1] * d[0]
    z += e[0] * f[1] + e[1] * f[0]
    return two_sum(s, (u + v) + ((x + y) + z))


@inline
def times(a, number):
    """a times a float64."""
    p, e = two_prod(a[0], number)
    return quick_two_sum(p, e + a[1] * number)


@inline
def scaled(a, power):
    """a times a power of two, exactly."""
    return a[0] * power, a[1] * power


@inline
def square(a):
    p, e = two_prod(a[0], a[0])
    return quick_two_sum(p, e + 2.0 * a[0] * a[1])


@inline
def over(a, number):
    """a divided by a float64."""
    q = a[0] / number
    p, e = two_prod(q, number)
    return quick_two_sum(q, (((a[0] - p) - e) + a[1]) / number)


@inline
def div(a, b):
    q = a[0] / b[0]
    rest = sub(a, times(b, q))
    r = rest[0] / b[0]
    rest = sub(rest, times(b, r))
    return add(quick_two_sum(q, r), (rest[0] / b[0], 0.0))


@inline
def ratio(a, b):
    """a/b to 4 PAIR_ROUNDOFF: a third of the work of `div` (Joldes, Muller, Popescu 2017, algorithm 17)."""
    q = a[0] / b[0]
    p = times(b, q)
    return quick_two_sum(q, ((a[0] - p[0]) + (a[1] - p[1])) / b[0])


@inline
def sqrt(a):
    """The square root of a >= 0, by one step of Newton's from float64's."""
    if a[0] == 0.0:
        return 0.0, 0.0
    s = root(a[0])
    rest = sub(a, two_prod(s, s))
    return quick_two_sum(s, rest[0] / (2.0 * s))


@inline
def positive_root(a):
    """As `sqrt`, of a > 0."""
    s = root(a[0])
    p, e = two_prod(s, s)
    return quick_two_sum(s, ((a[0] - p) - e + a[1]) / (2.0 * s))


@inline
def mean(a, b):
    """The arithmetic-geometric mean of a and b > 0; K = pi / (2 mean(1, k'))."""
    for _ in range(MEANS):
        if abs(a[0] - b[0]) <= GAP * a[0]:
            break
        a, b = times(add(a, b), 0.5), sqrt(mul(a, b))
    return times(add(a, b), 0.5)


@inline
def plus_product(s, c, a, b):
    """(s, c), a sum and what its float64 has lost, with the product of the pairs a and b added."""
    p, e = two_prod(a[0], b[0])
    s, q = two_sum(s, p)
    return s, c + (q + (e + (a[0] * b[1] + a[1] * b[0])))


@inline
def convolved(a, b, n):
    """Coefficient n of the product of two series (2, orders), hi and lo; its error is relative to the sum of |terms|.

    An inner product in which the exact float64 sum of the leading parts is corrected once, at the
    end.
    """
    s, c = 0.0, 0.0
    for i in range(n + 1):
        s, c = plus_product(s, c, (a[0, i], a[1, i]), (b[0, n - i], b[1, n - i]))
    return quick_two_sum(s, c)


@inline
def total(series):
    """The sum of the coefficients of a series (2, orders), the last ones, the smallest, first."""
    s = (0.0, 0.0)
    for n in range(series.shape[1] - 1, -1, -1):
        s = add(s, (series[0, n], series[1, n]))
    return s


@inline
def slope(series):
    """The sum of n times coefficient n: the derivative at 1."""
    s = (0.0, 0.0)
    for n in range(series.shape[1] - 1, 0, -1):
        s = add(s, times((series[0, n], series[1, n]), float(n)))
    return s
