"""The real roots of g with their multiplicities, in disjoint discs that are proven to hold them, in
double-double.

About a centre c, g(c + x) = a0 + a1 x + a2 x^2 + a3 x^3 + rest, |rest| <= B |x|^4. Where on a circle |x| = r one term k
is larger than all others together, the disc holds k roots (Pellet's theorem), and with k = 0 none. The turn is cut into
pieces, and these into halves, until each is free of roots or inside such a disc. A disc is shrunk about the root of the
derivative k - 1 next to its centre, as far as rounding allows; what is larger than rounding explains is cut further.

Source: M. Marden, Geometry of Polynomials (1966), section 31.
"""

import math

import numpy as np

from survey.kernels.cylinder.flow import C23, S2, S3, TWO_PI, D
from survey.kernels.jit import inline, kernel
from survey.kernels.math.angles_double import sine_cosine
from survey.kernels.math.double import add, mul, neg, scaled, shifted, square, times
from survey.kernels.math.roundoff import PAIR_ROUNDOFF

# of a disc; ROOTS: their number with multiplicity, or NO_REAL
CENTRE, CENTRE_LOW, RADIUS, ROOTS, SLOPE = range(5)
NO_REAL = -2.0  # a pair of complex roots
MOST_DISCS = 8
BOUNDS = 4  # in the table of coefficients: the bounds of |a0| to |a3|, then B

_ROUGH = 64.0 * PAIR_ROUNDOFF  # rounding of a coefficient, relative to its bound
_PIECES, _START = 32, -3.018  # the first pieces reach from _START over a turn
_WIDER = 1.0 + 1e-9  # pieces overlap by more than rounding
_MARGIN = 1.0 + 1e-6
_COSH = 1.6  # sin and cos on a circle about a real centre: cosh(2 r), r <= 0.5
_MOST = 20_000  # pieces; some hundred are usual
_NOISY = 4.0  # a disc of so many times the radius that rounding alone gives is not cut further
_X, _X_LOW, _HALF = range(3)  # columns of the pieces that wait: the middle, half the width


@kernel
def discs(p, found):
    """Fill `found` (MOST_DISCS, 5) with disjoint discs that hold all real roots of g, and return
    their number.
    """
    q, a, stack = np.zeros(6), np.zeros(9), np.zeros((4096, 3))
    count = 0
    unit = normalised(p, q, a)
    if unit == 0.0:
        return 0
    for top in range(_PIECES):
        half = 0.5 * TWO_PI / _PIECES
        stack[top, _X], stack[top, _X_LOW], stack[top, _HALF] = (
            _START + (2 * top + 1) * half,
            0.0,
            half * _WIDER,
        )
    top, work = _PIECES, 0
    while top > 0:
        top -= 1
        middle, half = (stack[top, _X], stack[top, _X_LOW]), stack[top, _HALF]
        work += 1
        if held(found, count, middle, half, True) > 0.0:
            continue
        if work > _MOST or top + 2 >= len(stack):  # is certain to be more than what is left
            count = added(found, count, middle, half, 4.0, 0.0)
            continue
        expand(q, middle, a)
        if dominates(a, 0, half):
            continue
        centre, radius, roots = middle, half, 0
        for k in range(1, 4):
            reach = (2.0 if k == 1 else k + 2.0) * half
            if dominates(a, k, reach):
                roots = -1 if held(found, count, middle, reach, False) == k else k
                break
        if roots < 0:
            continue
        if roots > 0:
            centre = stationary(q, middle, roots, reach, a)
            radius, least = shrunk(a, roots)
            inside = abs((centre[0] - middle[0]) + (centre[1] - middle[1])) + radius < reach
            if inside and dominates(a, roots, radius):
                if roots == 1 or radius <= _NOISY * least:
                    count = added(found, count, centre, radius, float(roots), a[1] * unit)
                    continue
                if roots == 2 and lifted(a, radius):
                    count = added(found, count, centre, radius, NO_REAL, a[1] * unit)
                    continue
                if radius > 0.5 * half:
                    centre, radius = middle, half
            else:
                centre, radius = middle, half
        radius *= 0.5
        for side in (1.0, -1.0):
            x = shifted(centre, side * radius)
            stack[top, _X], stack[top, _X_LOW], stack[top, _HALF] = x[0], x[1], radius * _WIDER
            top += 1
    return count


@inline
def normalised(p, q, a):
    """Fill q with the coefficients of g over a power of two, exactly, and a[BOUNDS:]; the power, or
    0 where g = 0.
    """
    largest = max(max(abs(p[D]), abs(p[C23])), max(abs(p[S2]), abs(p[S3])))
    if largest == 0.0:
        return 0.0
    power = math.frexp(largest)[1]
    for i in range(2, 6):
        q[i] = math.ldexp(p[i], -power)
    c, s, n = math.hypot(0.5 * q[D], q[C23]), math.hypot(q[S2], q[S3]), 1.0
    for k in range(5):
        a[BOUNDS + k] = (c + s) / n
        c, n = 2.0 * c, n * (k + 1.0)
    a[BOUNDS + 4] *= _COSH
    return math.ldexp(1.0, power)


@kernel
def expand(q, phi, a):
    """Fill a[:4] with the Taylor coefficients of g about phi."""
    s, c = sine_cosine(phi)
    double_s, double_c = scaled(mul(s, c), 2.0), shifted(scaled(square(s), -2.0), 1.0)
    even = add(times(double_s, -0.5 * q[D]), times(double_c, -q[C23]))
    odd = add(scaled(times(double_s, q[C23]), 2.0), times(double_c, -q[D]))
    one, two = add(times(c, q[S2]), times(s, -q[S3])), neg(add(times(s, q[S2]), times(c, q[S3])))
    a[0], a[1] = add(even, one)[0], add(odd, two)[0]
    a[2] = -0.5 * add(scaled(even, 4.0), one)[0]
    a[3] = add(scaled(odd, 4.0), two)[0] / -6.0


@kernel
def dominates(a, k, r):
    """Is term k of g larger than all others together, at |x| = r?"""
    others, own, power = 0.0, 0.0, 1.0
    for j in range(4):
        if j == k:
            own = (abs(a[j]) - _ROUGH * a[BOUNDS + j]) * power
        else:
            others += (abs(a[j]) + _ROUGH * a[BOUNDS + j]) * power
        power *= r
    return own > (others + a[BOUNDS + 4] * power) * _MARGIN


@inline
def stationary(q, middle, k, reach, a):
    """The root of derivative k - 1 of g that Newton's method finds from `middle`; a is expanded there."""
    x, last = middle, reach
    for _ in range(12):
        step = a[k - 1] / (k * a[k])
        if not abs(step) <= last:
            break
        x, last = shifted(x, -step), 0.5 * abs(step)
        expand(q, x, a)
        if last <= 1e-31:
            break
    return x


@inline
def shrunk(a, k):
    """A radius at which the terms below k come to less than half of term k, and that of rounding alone."""
    radius, least = 0.0, 0.0
    for j in range(k):
        rough, power = _ROUGH * a[BOUNDS + j], 1.0 / (k - j)
        radius = max(radius, 2.0 * (k * (abs(a[j]) + rough) / abs(a[k])) ** power)
        least = max(least, 2.0 * (k * rough / abs(a[k])) ** power)
    return radius, least


@inline
def lifted(a, r):
    """Has g one sign for real |x| <= r, by g >= a0 - |a1| r + x^2 (a2 - |a3| r - B r^2)?"""
    e0 = _ROUGH * a[BOUNDS]
    e1 = _ROUGH * a[BOUNDS + 1]
    e2 = _ROUGH * a[BOUNDS + 2]
    e3 = _ROUGH * a[BOUNDS + 3]
    level = abs(a[0]) - e0 > (abs(a[1]) + e1) * r * _MARGIN
    return (
        a[0] * a[2] > 0.0
        and level
        and abs(a[2]) - e2 > ((abs(a[3]) + e3) * r + a[BOUNDS + 4] * r * r) * _MARGIN
    )


@inline
def gap(disc, x):
    """The distance of x from the centre of a disc, on the circle, and the error that a turn taken
    out makes.
    """
    away = abs((disc[CENTRE] - x[0]) + (disc[CENTRE_LOW] - x[1]))
    return (abs(away - TWO_PI), 4e-15) if away > 3.0 else (away, 0.0)


@kernel
def held(found, count, x, r, outside):
    """How many roots are in the discs that lie inside that of radius r about x; or `outside`: that
    it lies inside.
    """
    roots = 0.0
    for i in range(count):
        away, error = gap(found[i], x)
        if outside:
            if away + error + r <= found[i, RADIUS]:
                roots += abs(found[i, ROOTS])
        elif away + error + found[i, RADIUS] < r:
            roots += abs(found[i, ROOTS])
    return roots


@kernel
def added(found, count, x, r, roots, slope):
    """Append a disc, unless one with as many roots overlaps it: it is the same; one with fewer is
    taken into it.
    """
    kept = 0
    for i in range(count):
        away, error = gap(found[i], x)
        if away <= r + found[i, RADIUS] + error:
            if abs(found[i, ROOTS]) >= abs(roots):
                return count
            r = max(r, away + error + found[i, RADIUS])
        else:
            for k in range(5):
                found[kept, k] = found[i, k]
            kept += 1
    if kept < len(found):
        found[kept, CENTRE], found[kept, CENTRE_LOW], found[kept, RADIUS] = x[0], x[1], r
        found[kept, ROOTS], found[kept, SLOPE] = roots, slope
        kept += 1
    return kept
