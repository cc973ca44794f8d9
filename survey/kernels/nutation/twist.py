"""Second derivatives of the action of a nutation, by quadratures without singular ends, and the
twist they make.

2 pi J is the integral of sqrt P/(1 - u^2) along a closed path about [ul, uh]. As a function of E =
L - a^2, b and a its second derivatives have no poles at u = +-1: they are the integrals of
q(u)/P^(3/2), q of degree 4 at most (S26). In c of (S17), where 1/s^3 stands by parts, nothing is
left that grows without limit in a narrow well (S27). Sums as in `action`.
"""

from math import pi, sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.math.bounded import add, div, exact, mul, root, scaled, sub
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import wells as nu
from survey.kernels.nutation.action import _C, _SQUARE, STEP

# of the action over E, b and a; then its first derivative over E
EE, EB, EA, BB, BA, AA, FIRST = range(7)
DERIVATIVES = 7
KAM, ISOENERGETIC, KAM_3, ISOENERGETIC_3 = range(4)
TWISTS = 4
_SUMS = 64.0 * ROUNDOFF


@inline
def sums(x2, y2):
    """Integrals over [0, pi] of sin^2/R^3, cos^2/R^3 and cos^2/R^5, R^2 = x2 sin^2 + y2 cos^2, with
    bounds (S27).
    """
    first = second = third = 0.0
    for i in range(_C.size):
        s2 = _SQUARE[i]
        c2 = _C[i] * _C[i]
        square = x2[0] * s2 + y2[0] * c2
        part = STEP * _C[i] * sqrt(s2) / (square * sqrt(square))
        first += part * s2
        second += part * c2
        third += part * c2 / square
    noise = x2[1] / x2[0] + y2[1] / y2[0]
    cubic, fifth = 1.5 * noise + _SUMS, 2.5 * noise + _SUMS
    return (first, cubic * first), (second, cubic * second), (third, fifth * third)


@inline
def even_part(p, q):
    """c^0, c^2, c^4 of the product of two quadratic polynomials in c, coefficients (c^0, c^1, c^2)."""
    second = add(add(mul(p[0], q[2]), mul(p[2], q[0])), mul(p[1], q[1]))
    return mul(p[0], q[0]), second, mul(p[2], q[2])


@inline
def times(p, q):
    """The product of two linear forms (c^0, c^1) of c."""
    return mul(p[0], q[0]), add(mul(p[0], q[1]), mul(p[1], q[0])), mul(p[1], q[1])


@inline
def plus(p, q):
    """p[0] + q[0], p[1] + q[1], p[2] + q[2]."""
    return add(p[0], q[0]), add(p[1], q[1]), add(p[2], q[2])


@inline
def times_number(p, number):
    return mul(p[0], number), mul(p[1], number), mul(p[2], number)


@inline
def integral(p, q, parts, factor):
    """Of p q/P^(3/2), two quadratic forms in c; factor = 4/(pi g^2), and 1/(2 pi) of it is a
    derivative of J.
    """
    x, width2, all_cubes, sine_cubes, fifths = parts
    zeroth, second, fourth = even_part(p, q)
    fourth = mul(width2, fourth)
    most = mul(add(zeroth, mul(width2, add(second, fourth))), mul(x, fifths))
    less = mul(add(second, scaled(fourth, 2.0)), all_cubes)
    rest = sub(mul(fourth, sine_cubes), less)
    return mul(factor, sub(rest, scaled(most, 3.0)))


@kernel
def derivatives(row, out):
    """Fill `out` (2, DERIVATIVES), values and bounds, of a well, a row of `wells`; times in units of A."""
    q_low = row[nu.Q_LOW], (row[nu.NOISE_LOW] + ROUNDOFF) * row[nu.Q_LOW]
    q_high = row[nu.Q_HIGH], (row[nu.NOISE_HIGH] + ROUNDOFF) * row[nu.Q_HIGH]
    k, width, low, high = exact(row[nu.K]), row[nu.WIDTH], root(q_low), root(q_high)
    k = k[0], ROUNDOFF * abs(k[0])
    g = mul(low, high)
    above = nu.above(row, g[0])
    x2 = 0.5 * above, 0.5 * (row[nu.NOISE_ABOVE] + 8.0 * ROUNDOFF) * above
    # (x^2 - y^2)/width^2, from the difference itself where its terms have different signs
    if row[nu.MIDDLE] >= 0.0 or width == 0.0:
        bar = row[nu.NOISE_ABOVE] * above + 8.0 * ROUNDOFF * (abs(row[nu.BEND]) + abs(row[nu.K]))
        x = div(scaled(mul(k, (row[nu.BEND], bar)), -0.0625), x2)
    else:
        square = width * width
        x = div(sub(x2, g), (square, (2.0 * row[nu.NOISE_WIDTH] + 2.0 * ROUNDOFF) * square))
    sines, cosines, fifths = sums(x2, g)
    width2 = width * width, 2.0 * (row[nu.NOISE_WIDTH] + ROUNDOFF) * width * width
    parts = x, width2, add(sines, cosines), sines, fifths
    # linear forms in c: W, u W, (1 - u) W, (1 + u) W, with c^1 over the width
    both = add(low, high)
    total = (row[nu.SUM], row[nu.BAR_LOW] + row[nu.BAR_HIGH] + ROUNDOFF * abs(row[nu.SUM]))
    slope = div(mul(k, total), both)
    tilt = sub(scaled(mul(slope, total), 0.5), scaled(both, 0.25))
    end_low, end_high = (row[nu.LOW], row[nu.BAR_LOW]), (row[nu.HIGH], row[nu.BAR_HIGH])
    w = scaled(both, 0.5), slope
    uw = scaled(add(mul(high, end_low), mul(low, end_high)), 0.5), tilt
    plus_low, plus_high = (row[nu.LOW_PLUS], row[nu.BAR_LOW]), (row[nu.HIGH_PLUS], row[nu.BAR_HIGH])
    minus_low = (row[nu.LOW_MINUS], row[nu.BAR_LOW])
    minus_high = (row[nu.HIGH_MINUS], row[nu.BAR_HIGH])
    near = scaled(add(mul(high, plus_low), mul(low, plus_high)), 0.5), sub(slope, tilt)
    far = scaled(add(mul(high, minus_low), mul(low, minus_high)), 0.5), add(slope, tilt)
    # (b - a u) W, and (E + k u^2) W^2
    minus, plus_gap = row[nu.MINUS], row[nu.PLUS]
    gaps = (minus, ROUNDOFF * abs(minus)), (plus_gap, ROUNDOFF * abs(plus_gap))
    side = (
        scaled(add(mul(gaps[0], far[0]), mul(gaps[1], near[0])), 0.5),
        scaled(add(mul(gaps[0], far[1]), mul(gaps[1], near[1])), 0.5),
    )
    a = scaled(sub(gaps[1], gaps[0]), 0.5)
    energy = sub((row[nu.L], 2.0 * ROUNDOFF * abs(row[nu.L])), mul(a, a))
    ww, uu, wu = times(w, w), times(uw, uw), times(w, uw)
    rest = plus(times_number(ww, energy), times_number(uu, k))
    factor = div(exact(4.0 / pi), mul(g, g))
    found = (
        scaled(integral(times(near, far), ww, parts, factor), -0.25),
        scaled(integral(times(side, w), ww, parts, factor), 0.5),
        scaled(integral(times(side, w), wu, parts, factor), -0.5),
        scaled(integral(rest, ww, parts, factor), -1.0),
        integral(rest, wu, parts, factor),
        scaled(integral(rest, uu, parts, factor), -1.0),
        scaled(add(mul(x2, sines), mul(g, cosines)), 0.5 / pi),
    )
    for i in range(DERIVATIVES):
        out[0, i], out[1, i] = found[i]


@inline
def minor(p, q, r):
    """p q - r^2."""
    return sub(mul(p, q), mul(r, r))


@kernel
def twists(rows, bodies, out):
    """Fill `out` (n, 2, TWISTS), values and bounds, of wells `rows` (n, SIZE) of `bodies` (n, 3):
    A, C, p_phi.

    With H in the actions J, p_phi (p_psi is kept) and J, p_psi, p_phi: determinants of the second
    derivatives, KAM and KAM_3, and of these bordered by the frequencies, ISOENERGETIC and
    ISOENERGETIC_3. NaN where K of a row is NaN.
    """
    first = np.empty((2, DERIVATIVES))
    for i in range(len(rows)):
        derivatives(rows[i], first)
        size_a, size_c, a = bodies[i]
        ratio = div(exact(size_a), exact(size_c))
        pull = scaled(mul(ratio, exact(a)), -2.0)  # of E over p_phi at constant energy
        ee, eb, ea = pair(first, EE), pair(first, EB), pair(first, EA)
        bb, ba, e = pair(first, BB), pair(first, BA), pair(first, FIRST)
        inner = sub(pair(first, AA), scaled(mul(ratio, e), 2.0))
        edge = add(inner, add(scaled(mul(pull, ea), 2.0), mul(mul(pull, pull), ee)))
        corner = add(ba, mul(pull, eb))
        flat = minor(ee, inner, ea)
        twisted = mul(ee, minor(bb, inner, ba))
        twisted = sub(twisted, mul(eb, sub(mul(eb, inner), mul(ba, ea))))
        twisted = add(twisted, mul(ea, sub(mul(eb, ba), mul(bb, ea))))
        period = scaled(mul(exact(size_a), e), 2.0)  # the period over 2 pi
        cube = mul(mul(period, period), period)
        fourth = mul(cube, period)
        area = scaled(mul(exact(size_a), exact(size_a)), 4.0)
        store(out, i, KAM, div(mul(area, flat), fourth))
        store(out, i, ISOENERGETIC, div(edge, cube))
        store(out, i, KAM_3, div(mul(area, scaled(twisted, -1.0)), mul(fourth, period)))
        store(out, i, ISOENERGETIC_3, div(scaled(minor(bb, edge, corner), -1.0), fourth))


@inline
def pair(table, j):
    return table[0, j], table[1, j]


@inline
def store(out, i, j, value):
    out[i, 0, j], out[i, 1, j] = value
