"""Formulas of the gyrostat paper for b = 0, (62)-(68), as printed and corrected: residuals for
`gyrostat_errata.py`.

The derivatives of u = tan(phi/2) are checked against u'^2 = P4(u) / 4, those of w against (57).
"""

from errata import number, numbers, worst
from mpmath import cos, cosh, diff, exp, matrix, mp, mpf, sin, sinh, sqrt, tan


def abel(six, w, slope, phi):
    """w w_phi - f w - g of (57), everything over A11; zero for a solution."""
    b12, b31, d, c23, s2, s3 = six
    f = b12 * cos(phi) - b31 * sin(phi)
    return (
        w * slope
        - f * w
        + d * cos(phi) * sin(phi)
        + c23 * cos(2 * phi)
        - s2 * cos(phi)
        + s3 * sin(phi)
    )


def energy(dice):
    """(63) and what follows: parameters d, c23, s2, s3, n over A11, and the square of phi'."""
    d, c23, s2, s3 = numbers(dice, 4)
    n = 4 + abs(number(dice))

    def square(phi):
        return d * cos(2 * phi) / 2 - c23 * sin(2 * phi) + 2 * s2 * sin(phi) + 2 * s3 * cos(phi) + n

    return (d, c23, s2, s3, n), square


def velocity(dice):
    """phi' = +-sqrt(...): its derivative, against (57) with b = 0; and phi = sqrt(...)."""
    (d, c23, s2, s3, _n), square = energy(dice)
    phi = number(dice)
    root = sqrt(square(phi))
    return abs(phi - root), worst(
        abel((0, 0, d, c23, s2, s3), w, diff(square, phi) / (2 * w), phi) for w in (root, -root)
    )


def quartic(a, u):
    return a[0] * u**4 + 4 * a[1] * u**3 + 6 * a[2] * u**2 + 4 * a[3] * u + a[4]


def with_double_root(a0, a1, a2, u1):
    """a0..a4 so that u1 is a root of P4 and of its derivative."""
    a3 = -(a0 * u1**3 + 3 * a1 * u1**2 + 3 * a2 * u1)
    a4 = -(a0 * u1**4 + 4 * a1 * u1**3 + 6 * a2 * u1**2 + 4 * a3 * u1)
    return a0, a1, a2, a3, a4


def bracket(dice):
    """(66)."""
    a0, a1, a2, u1, u = numbers(dice, 5)
    true = quartic(with_double_root(a0, a1, a2, u1), u)
    printed = a0 * u * u + (a0 * u1 + 3 * a1) * u + a0 * u1**2 + 3 * a1 * u1 + 3 * a2
    right = a0 * u * u + 2 * (a0 * u1 + 2 * a1) * u + 3 * a0 * u1**2 + 8 * a1 * u1 + 6 * a2
    return abs((u - u1) ** 2 * printed - true), abs((u - u1) ** 2 * right - true)


def multiple(dice, variant):
    """a0..a2 and u1 of a P4 with the double root u1 for variant 1, 2 or 3, and u0 near u1 where P4 > 0."""
    a0, u1, z0 = abs(number(dice)), number(dice), mpf("0.2") + mpf(dice.random()) / 5
    roots = {1: (3, 4), 2: (2, 2), 3: (-2, 3)}[variant]  # of the quadratic factor, in z = u - u1
    p, q = (mpf(r) + mpf(dice.random()) / 3 for r in roots)
    q = p if variant == 2 else q
    b, c = -a0 * (p + q), a0 * p * q
    z0 = z0 + (q if c < 0 else 0)  # where P4 > 0
    a1 = (b / 4) - a0 * u1
    a2 = c / 6 - a0 * u1**2 - 2 * a1 * u1
    return (a0, a1, a2), u1, u1 + z0


def shortened(a, u1, factors=(4, 6)):
    """b and c, printed with the factors 3 and 3."""
    a0, a1, a2 = a
    return factors[0] * (a0 * u1 + a1), factors[1] * (a0 * u1**2 + 2 * a1 * u1 + a2)


def elementary(variant, a, u1, u0, factors=(4, 6), e=1, third=sin):
    """u(t) by variant 1, 2 or 3; `third` is the function of the second term of variant 3 (printed sh)."""
    b, c = shortened(a, u1, factors)
    z0 = u0 - u1
    head, q = 2 * c + b * z0, a[0] * z0**2 + b * z0 + c
    if variant == 1:
        return lambda t: (
            u1
            + 2
            * c
            * z0
            / (head * cosh(sqrt(c) * t / 2) - 2 * e * sqrt(c * q) * sinh(sqrt(c) * t / 2) - b * z0)
        )
    if variant == 2:
        return lambda t: (
            u1 + 2 * c * z0 / (head * exp(-e * mp.sign(head) * sqrt(c) * t / 2) - b * z0)
        )
    root = sqrt(-c)
    return lambda t: (
        u1
        + 2
        * c
        * z0
        / (head * cos(root * t / 2) + 2 * e * sqrt(-c * q) * third(root * t / 2) - b * z0)
    )


def motion(a, u1, u, t):
    """u'^2 - P4(u) / 4."""
    return abs(diff(u, t) ** 2 - quartic(with_double_root(*a, u1), u(t)) / 4)


def variant_of(variant, *cases):
    """Residuals of the variant, as printed and right, by the arguments of `elementary`."""

    def test(dice):
        a, u1, u0 = multiple(dice, variant)
        return tuple(
            motion(a, u1, elementary(variant, a, u1, u0, **case), mpf("0.2")) for case in cases
        )

    return test


def condition(dice):
    """(a0 u1 + a1)^2 + 3 (a0 a2 - a1^2) where P4 has two double roots."""
    (a0, a1, a2), u1, _u0 = multiple(dice, 2)
    return tuple(abs((a0 * u1 + a1) ** 2 + k * (a0 * a2 - a1**2)) for k in (4, 3))


def signs(dice):
    """u'(0) of the branch e = -1 of variants 1 to 3."""
    printed, right = [], []
    for variant in (1, 2, 3):
        a, u1, u0 = multiple(dice, variant)
        wanted = -mp.sign(u0 - u1) * sqrt(quartic(with_double_root(*a, u1), u0)) / 2
        found = [abs(diff(elementary(variant, a, u1, u0, e=e), 0) - wanted) for e in (1, -1)]
        printed, right = [*printed, found[0]], [*right, found[1]]
    return min(printed), max(right)


def triple_root(dice):
    """c = 0: z = 16 z0 / (16 - 8 e sqrt(a0 z0^2 + b z0) t + b z0 t^2)."""
    (a0, b, z0), t = map(abs, numbers(dice, 3)), mpf("0.2")

    def z(t):
        return 16 * z0 / (16 - 8 * sqrt(a0 * z0**2 + b * z0) * t + b * z0 * t**2)

    return abs(diff(z, t) ** 2 - z(t) ** 3 * (a0 * z(t) + b) / 4)


def quadruple_root(dice):
    """b = c = 0: 1 / z = 1 / z0 - sgn u'(0) sqrt(a0) t / 2."""
    a0, z0, t = abs(number(dice)), number(dice), mpf("0.2")

    def z(t):
        return 1 / (1 / z0 - sqrt(a0) * t / 2)

    return abs(diff(z, t) - sqrt(a0) * z(t) ** 2 / 2)


@mp.extradps(20)  # which the doublings lose
def weierstrass(z, g2, g3, terms=24, doublings=6):
    """P(z) and P'(z): the Laurent series at z / 64, doubled six times (DLMF 23.9, 23.10)."""
    c = [0, 0, g2 / 20, g3 / 28]
    for n in range(4, terms):
        c.append(3 * sum(c[m] * c[n - m] for m in range(2, n - 1)) / ((2 * n + 1) * (n - 3)))
    x = z / 2**doublings
    value = x**-2 + sum(c[n] * x ** (2 * n - 2) for n in range(2, terms))
    slope = -2 * x**-3 + sum((2 * n - 2) * c[n] * x ** (2 * n - 3) for n in range(2, terms))
    for _ in range(doublings):
        second = 6 * value**2 - g2 / 2
        value, slope = (
            -2 * value + (second / (2 * slope)) ** 2,
            (-4 * slope**4 + 12 * value * slope**2 * second - second**3) / (4 * slope**3),
        )
    return value, slope


def coefficients(d, c23, s2, s3, n):
    """(65)."""
    return d / 2 + n - 2 * s3, s2 + c23, (-3 * d + 2 * n) / 6, s2 - c23, d / 2 + n + 2 * s3


def invariants(a):
    """(67)."""
    return a[0] * a[4] - 4 * a[1] * a[3] + 3 * a[2] ** 2, (
        a[0] * a[2] * a[4]
        + 2 * a[1] * a[2] * a[3]
        - a[2] ** 3
        - a[4] * a[1] ** 2
        - a[0] * a[3] ** 2
    )


def elliptic(dice, half=True):
    """u'^2 - P4(u) / 4 of the Biermann-Weierstrass formula, in P(t / 2) or, as the paper has it, in P(t)."""
    a = coefficients(*energy(dice)[0])
    g2, g3 = invariants(a)
    u0 = number(dice)
    R = [quartic(a, u0), *(diff(lambda x: quartic(a, x), u0, k) for k in (1, 2, 3, 4))]

    def u(t):
        p, slope = weierstrass(t / 2 if half else t, g2, g3)
        above = -sqrt(R[0]) * slope + R[1] * (p - R[2] / 24) / 2 + R[0] * R[3] / 24
        return u0 + above / (2 * (p - R[2] / 24) ** 2 - R[0] * R[4] / 48)

    t = mpf("0.3")
    return abs(diff(u, t) ** 2 - quartic(a, u(t)) / 4)


def level(dice):
    """(63): its derivative by phi, with w^2 for A11 w^2 over A11."""
    (d, c23, s2, s3, _), square = energy(dice)
    phi = number(dice)
    return abs(abel((0, 0, d, c23, s2, s3), 1, diff(square, phi) / 2, phi))


def substitution(dice):
    """(64), (65): P4(u) = (1 + u^2)^2 phi'^2."""
    values, square = energy(dice)
    phi = number(dice)
    u = tan(phi / 2)
    return abs(quartic(coefficients(*values), u) - (1 + u * u) ** 2 * square(phi))


def expanded(dice):
    """The expanded g2, g3 and 27 G, and (67), (68) by the discriminant of P4 = 256 G."""
    d, c23, s2, s3, n = values = energy(dice)[0]
    a = coefficients(*values)
    g2, g3 = invariants(a)
    long = (
        8 * n**3
        - 18 * n * (d * d + 4 * c23**2 + 2 * (s2**2 + s3**2))
        - 54 * d * (s2**2 - s3**2)
        - 216 * c23 * s2 * s3
    )
    G = (4 * n * n + 3 * d * d + 12 * (c23**2 - s2**2 - s3**2)) ** 3 - long**2
    whole = [a[0], 4 * a[1], 6 * a[2], 4 * a[3], a[4]]
    slope = [4 * a[0], 12 * a[1], 12 * a[2], 4 * a[3]]
    rows = [[0] * i + whole + [0] * (2 - i) for i in range(3)] + [
        [0] * i + slope + [0] * (3 - i) for i in range(4)
    ]
    discriminant = mp.det(matrix(rows)) / a[0]  # Sylvester's resultant of P4 and its derivative
    short = d * d + 4 * n * n / 3 + 4 * (c23**2 - s2**2 - s3**2)
    return worst(
        [
            short - g2,
            long / 27 - g3,
            G / 27 - (g2**3 - 27 * g3**2),
            discriminant / 256 - (g2**3 - 27 * g3**2),
        ]
    )
