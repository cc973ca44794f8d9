"""The gyrostat paper's printed formulas, each tested: a page for a reader of the paper.

    python workflows/gyrostat_errata.py [-o results]

Needs mpmath: pip install -e ".[test]". Residuals to 40 digits at random parameters: motions are
checked against the six equations (1)-(6), the formulas of the elliptic case against u'^2 = P4(u) /
4. The corrections are derived in survey/scenes/gyrostat.md.
"""

# ruff: noqa: E501  (the rows of the page's tables)
import gyrostat_elliptic as elliptic
from errata import number, numbers, same_dice, worst, write
from gyrostat_elliptic import abel
from mpmath import cos, cosh, diff, exp, log, matrix, mpf, pi, sin, sinh, sqrt, tan

DEFINED = ("A11", "A22", "A33", "A23", "A12", "A31", "B11", "B22", "B33", "B12", "B31", "B23", "C11", "C22", "C33",
           "C12", "C31", "C23", "l1", "l2", "l3", "s1", "s2", "s3")  # fmt: skip


class Body:
    """A gyrostat at random in [0.3, 1.3] up to sign, but for what is given; A is made definite."""

    def __init__(self, dice, **given):
        for name in DEFINED:
            setattr(self, name, number(dice))
        self.A11, self.A22, self.A33 = (3 + abs(x) for x in (self.A11, self.A22, self.A33))
        for name, value in given.items():
            setattr(self, name, mpf(value))

    def tensor(self, m):
        a, b, c, d, e, f = (getattr(self, m + ij) for ij in ("11", "12", "31", "22", "23", "33"))
        return matrix([[a, b, c], [b, d, e], [c, e, f]])

    def moment(self, w, nu):
        """A w' by the vector form (A w + lambda) x w + (B w) x nu + nu x (C nu) + s x nu."""
        A, B, C = (self.tensor(m) for m in "ABC")
        momentum = A * w + matrix([self.l1, self.l2, self.l3])
        parts = (
            cross(momentum, w),
            cross(B * w, nu),
            cross(nu, C * nu),
            cross(matrix([self.s1, self.s2, self.s3]), nu),
        )
        return parts[0] + parts[1] + parts[2] + parts[3]

    def reduced(self):
        """b12, b31, d, c23, s2, s3 over A11."""
        six = self.B12, self.B31, self.C22 - self.C33, self.C23, self.s2, self.s3
        return [x / self.A11 for x in six]


def cross(a, b):
    return matrix([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def vertical(theta, phi):
    """nu (17), (19), (20)."""
    return matrix([cos(theta), sin(theta) * sin(phi), sin(theta) * cos(phi)])


def about_first(body, theta, phi, w):
    """A w' of a body that turns about axis 1 at the rate w."""
    return body.moment(matrix([w, 0, 0]), vertical(theta, phi))


# the printed formulas that need correction: each function gives (residual as printed, residual
# corrected)


def harmonics(dice):
    """(25): the third equation on rotations about axis 1."""
    b, theta, phi, w = Body(dice, A12=0, A31=0), *numbers(dice, 3)
    c, s = cos(theta), sin(theta)

    def equation(last):
        return (
            (-b.B12 * c - b.l2 + b.B11 * s * sin(phi)) * w + (b.C12 * c - b.s2) * c - b.C12 * s * s / 2
            + b.C23 * s * c * cos(phi) + ((b.C22 - b.C11) * c + b.s1) * s * sin(phi) - b.C31 * last * sin(2 * phi) / 2
            + b.C12 * s * s * cos(2 * phi) / 2
        )  # fmt: skip

    true = about_first(b, theta, phi, w)[2]
    return abs(equation(s * c) - true), abs(equation(s * s) - true)


def downwards(dice):
    """(40), (41) at cos theta0 = -1."""
    b = Body(dice, A12=0, A31=0)
    m, residual = number(dice), []
    for sign in (1, -1):
        b.l2, b.l3, b.s2, b.s3 = -sign * b.B12, -sign * b.B31, sign * b.C12, sign * b.C31
        residual.append(worst(about_first(b, pi, 0, m)))
    return tuple(residual)


def case_a(dice):
    """A body with the conditions (44)-(48), theta, phi, w."""
    theta = mpf("0.4") + abs(number(dice)) / 2
    b = Body(dice, A12=0, A31=0, B11=0, C12=0, C23=0, C31=0, s2=0, s3=0)
    b.C33, b.s1 = b.C22, (b.C11 - b.C22) * cos(theta)
    b.l2, b.l3 = -b.B12 * cos(theta), -b.B31 * cos(theta)
    return b, theta, number(dice), number(dice)


def first_integral(dice):
    """(49): its derivative by t against equation (1)."""
    b, theta, phi, w = case_a(dice)
    true = about_first(b, theta, phi, w)[0]
    printed = diff(lambda x: (b.B12 * cos(x) - b.B31 * sin(x)) * sin(theta), phi) * w
    return abs(printed - true), abs(
        diff(lambda x: (b.B12 * sin(x) + b.B31 * cos(x)) * sin(theta), phi) * w - true
    )


def areas(dice):
    """The line after (49): the integral (7) solved for A11 phi'."""
    b, theta, phi, w = case_a(dice)
    k = (b.tensor("A") * matrix([w, 0, 0]) + matrix([b.l1, b.l2, b.l3])).T * vertical(theta, phi)
    rest = k[0] / cos(theta) - b.l1 - b.A11 * w
    wrong, right = b.B12 * cos(phi) - b.B31 * sin(phi), b.B12 * sin(phi) + b.B31 * cos(phi)
    return abs(wrong * sin(theta) + rest), abs(right * sin(theta) + rest)


def polynomial(dice):
    """(59): the polynomial of w = l cos phi + m sin phi + n."""
    b12, b31, d, c23, s2, s3 = six = numbers(dice, 6)
    m, k, n, phi = numbers(dice, 4)  # k is the paper's l
    w, slope = k * cos(phi) + m * sin(phi) + n, -k * sin(phi) + m * cos(phi)
    true = abel(six, w, slope, phi)

    def value(factor):
        return (
            (k * (m - b12) + k * m - m * b31 + 2 * c23) * cos(2 * phi) / 2
            + factor * (m * m - k * k - m * b12 + k * b31 + d) * sin(2 * phi)
            + (n * (m - b12) - s2) * cos(phi) + (n * (b31 - k) + s3) * sin(phi) + factor * (m * b31 - k * b12)
        )  # fmt: skip

    return abs(value(1) - true), abs(value(mpf("0.5")) - true)


def trigonometric(dice, sign=-1, constant=lambda mu, b, n: n, root=lambda b: None):
    """Residual of (57) for the trigonometric solution; c23 = sign (mu^2 - mu) b12 b31, or mu = root(body)."""
    b, n, phi = Body(dice, B11=0), number(dice), number(dice)
    mu = mpf("1.3") + abs(number(dice))
    b.C23 = sign * (mu * mu - mu) * b.B12 * b.B31 / b.A11
    b.C33 = b.C22 - b.C23 * (b.B12**2 - b.B31**2) / (b.B12 * b.B31)
    mu = mu if root(b) is None else root(b)
    b.s2, b.s3 = n * (mu - 1) * b.B12, n * (mu - 1) * b.B31
    _, _, d, c23, s2, s3 = b.reduced()
    six = b.B12 / b.A11, b.B31 / b.A11, d, c23, s2, s3
    w = mu * (b.B31 * cos(phi) + b.B12 * sin(phi)) / b.A11 + constant(mu, b, n)
    return abs(abel(six, w, mu * (b.B12 * cos(phi) - b.B31 * sin(phi)) / b.A11, phi))


def root_of(inertia, sign):
    """mu by sqrt(1/4 - inertia C23 / (B12 B31))."""
    return lambda b: (
        mpf("0.5") + sign * sqrt(mpf("0.25") - getattr(b, inertia) * b.C23 / (b.B12 * b.B31))
    )


def with_root(*root):
    return lambda dice: trigonometric(dice, root=root_of(*root))


def constant_61(dice):
    """The printed constant of (61)."""
    return trigonometric(dice, constant=lambda mu, b, n: mu * b.C23 / (b.B12 * b.B31))


ERRATA = (
    ("(25), (35)", "`-(1/2) C31 sin th cos th sin 2phi`", "`-(1/2) C31 sin^2 th sin 2phi`; (35) then repeats (36)", harmonics),
    ("(40), (41)", "for `cos th = 1` alone", "for `cos th = -1`: `l2 = B12`, `l3 = B31`, `s2 = -C12`, `s3 = -C31`", downwards),
    ("(49)", "`A11 phi' = (B12 cos phi - B31 sin phi) sin th + n`", "`(B12 sin phi + B31 cos phi) sin th + n`", first_integral),
    ("line after (49)", "the same bracket", "the same correction", areas),
    ("(59)", "sin 2phi term and constant without 1/2", "a factor 1/2 before both; (60) is unharmed", polynomial),
    ("after (60)", "`mu^2 - mu = c23 / (b12 b31)`", "`mu^2 - mu = -c23 / (b12 b31)`", same_dice(lambda d: trigonometric(d, 1), trigonometric)),
    ("(61), constant", "`mu A11 C23 / (B12 B31)`", "`A11 n*`, and n* is fixed by s", same_dice(constant_61, trigonometric)),
    ("after (61)", "`mu = 1/2 + sqrt(1/4 - B11 C23 / (B12 B31))`", "`1/2 +- sqrt(1/4 - A11 C23 / (B12 B31))`: both roots", same_dice(with_root("B11", 1), with_root("A11", 1), with_root("A11", -1))),
    ("after (63)", "`phi = sqrt(...)`", "`phi' = +-sqrt(...)`", elliptic.velocity),
    ("(66) and the integral", "`a0 u^2 + (a0 u1 + 3 a1) u + a0 u1^2 + 3 a1 u1 + 3 a2`", "`a0 u^2 + 2 (a0 u1 + 2 a1) u + 3 a0 u1^2 + 8 a1 u1 + 6 a2`", elliptic.bracket),
    ("b and c, in variant 1", "`b = 3 (a0 u1 + a1)`, `c = 3 (a0 u1^2 + 2 a1 u1 + a2)`", "`b = 4 (...)`, `c = 6 (...)`", elliptic.variant_of(1, {"factors": (3, 3)}, {})),
    ("b and c, in variant 2", "the same", "the same", elliptic.variant_of(2, {"factors": (3, 3)}, {})),
    ("b and c, in variant 3", "the same (with sin)", "the same", elliptic.variant_of(3, {"factors": (3, 3)}, {})),
    ("conditions of the variants", "`(a0 u1 + a1)^2 + 4 (a0 a2 - a1^2)`", "`(a0 u1 + a1)^2 + 3 (a0 a2 - a1^2)`; at two double roots", elliptic.condition),
    ("variant 3", "`sh tau` beside `cos tau`", "`sin tau`", elliptic.variant_of(3, {"third": sinh}, {})),
    ("variants 1-3, sign", "one sign of the root", "a factor e = sgn u'(0) sgn z0; at e = -1", elliptic.signs),
    ("end", "rational in `P(t)` (Weierstrass)", "rational in `P(t/2)` and `P'(t/2)`", same_dice(lambda d: elliptic.elliptic(d, False), elliptic.elliptic)),
)  # fmt: skip


# formulas that are right as printed: each function gives its residual


def full_equations(dice):
    """(1)-(3), component by component, against the vector form."""
    b = Body(dice)
    w, nu = (matrix(numbers(dice, 3)) for _ in range(2))
    (w1, w2, w3), (v1, v2, v3) = w, nu
    printed = [
        (b.A12 * w1 + b.A22 * w2 + b.A23 * w3) * w3 - (b.A31 * w1 + b.A23 * w2 + b.A33 * w3) * w2
        + (b.B12 * w1 + b.B22 * w2 + b.B23 * w3) * v3 - (b.B31 * w1 + b.B23 * w2 + b.B33 * w3) * v2
        + b.l2 * w3 - b.l3 * w2 - (b.C12 * v1 + b.C22 * v2 + b.C23 * v3) * v3
        + (b.C31 * v1 + b.C23 * v2 + b.C33 * v3) * v2 + b.s2 * v3 - b.s3 * v2,
        (b.A31 * w1 + b.A23 * w2 + b.A33 * w3) * w1 - (b.A11 * w1 + b.A12 * w2 + b.A31 * w3) * w3
        + (b.B31 * w1 + b.B23 * w2 + b.B33 * w3) * v1 - (b.B11 * w1 + b.B12 * w2 + b.B31 * w3) * v3
        + b.l3 * w1 - b.l1 * w3 - (b.C31 * v1 + b.C23 * v2 + b.C33 * v3) * v1
        + (b.C11 * v1 + b.C12 * v2 + b.C31 * v3) * v3 + b.s3 * v1 - b.s1 * v3,
        (b.A11 * w1 + b.A12 * w2 + b.A31 * w3) * w2 - (b.A12 * w1 + b.A22 * w2 + b.A23 * w3) * w1
        + (b.B11 * w1 + b.B12 * w2 + b.B31 * w3) * v2 - (b.B12 * w1 + b.B22 * w2 + b.B23 * w3) * v1
        + b.l1 * w2 - b.l2 * w1 - (b.C11 * v1 + b.C12 * v2 + b.C31 * v3) * v2
        + (b.C12 * v1 + b.C22 * v2 + b.C23 * v3) * v1 + b.s1 * v2 - b.s2 * v1,
    ]  # fmt: skip
    return worst(matrix(printed) - b.moment(w, nu))


def integrals(dice):
    """(7), (8): derivatives along (1)-(6)."""
    b = Body(dice)
    w, nu = (matrix(numbers(dice, 3)) for _ in range(2))
    turn = cross(nu, w)
    momentum = b.tensor("A") * w + matrix([b.l1, b.l2, b.l3])
    return worst([(b.moment(w, nu).T * nu + momentum.T * turn)[0], 2 * (nu.T * turn)[0]])


def rotation(dice):
    """(10)-(12) with (19), (20), and (21), (22), which eliminate w1'."""
    b, theta, phi, w = Body(dice), *numbers(dice, 3)
    v1, v2, v3 = vertical(theta, phi)
    p2, p3 = b.C12 * v1 + b.C22 * v2 + b.C23 * v3, b.C31 * v1 + b.C23 * v2 + b.C33 * v3
    p1 = b.C11 * v1 + b.C12 * v2 + b.C31 * v3
    first = (b.B12 * v3 - b.B31 * v2) * w - p2 * v3 + p3 * v2 + b.s2 * v3 - b.s3 * v2
    second = (
        b.A31 * w * w
        + (b.B31 * v1 - b.B11 * v3) * w
        + b.l3 * w
        - p3 * v1
        + p1 * v3
        + b.s3 * v1
        - b.s1 * v3
    )
    third = (
        -b.A12 * w * w
        + (b.B11 * v2 - b.B12 * v1) * w
        - b.l2 * w
        - p1 * v2
        + p2 * v1
        + b.s1 * v2
        - b.s2 * v1
    )
    true = about_first(b, theta, phi, w)
    rest = (b.B31 * v2 - b.B12 * v3) * w + p2 * v3 - p3 * v2 - b.s2 * v3 + b.s3 * v2
    eliminated = b.A11 * second + b.A12 * rest, b.A11 * third + b.A31 * rest
    wanted = b.A11 * true[1] - b.A12 * true[0], b.A11 * true[2] - b.A31 * true[0]
    return worst(
        [
            first - true[0],
            second - true[1],
            third - true[2],
            eliminated[0] - wanted[0],
            eliminated[1] - wanted[1],
        ]
    )


def second_equation(dice):
    """(24)."""
    b, theta, phi, w = Body(dice, A12=0, A31=0), *numbers(dice, 3)
    c, s = cos(theta), sin(theta)
    value = (
        (b.B31 * c + b.l3 - b.B11 * s * cos(phi)) * w + (b.s3 - b.C31 * c) * c + b.C31 * s * s / 2
        - b.C23 * s * c * sin(phi) + ((b.C11 - b.C33) * c - b.s1) * s * cos(phi) + b.C12 * s * s * sin(2 * phi) / 2
        + b.C31 * s * s * cos(2 * phi) / 2
    )  # fmt: skip
    return abs(value - about_first(b, theta, phi, w)[1])


def conditions(dice):
    """(26)-(34), (36): harmonics 1, cos, sin, cos 2phi, sin 2phi of the second and third equations,
    at w^0 and w^1.
    """
    b, theta = Body(dice, A12=0, A31=0), number(dice)
    c, s = cos(theta), sin(theta)
    nodes = [2 * pi * k / 8 for k in range(8)]
    rest = {phi: about_first(b, theta, phi, 0) for phi in nodes}
    rate = {phi: about_first(b, theta, phi, 1) - rest[phi] for phi in nodes}

    def part(values, i, wave):
        return sum(values[phi][i] * wave(phi) for phi in nodes) / 4

    def one(phi):
        return mpf("0.5")

    found = [
        (part(rate, 1, one), b.B31 * c + b.l3), (part(rate, 2, one), -(b.B12 * c + b.l2)),
        (part(rate, 1, cos), -b.B11 * s), (part(rate, 2, sin), b.B11 * s),
        (part(rest, 1, one), (b.s3 - b.C31 * c) * c + b.C31 * s * s / 2),
        (part(rest, 2, one), -((b.s2 - b.C12 * c) * c + b.C12 * s * s / 2)),
        (part(rest, 1, sin), -b.C23 * s * c), (part(rest, 2, cos), b.C23 * s * c),
        (part(rest, 1, cos), ((b.C11 - b.C33) * c - b.s1) * s), (part(rest, 2, sin), ((b.C22 - b.C11) * c + b.s1) * s),
        (part(rest, 1, lambda x: sin(2 * x)), b.C12 * s * s / 2), (part(rest, 2, lambda x: cos(2 * x)), b.C12 * s * s / 2),
        (part(rest, 1, lambda x: cos(2 * x)), b.C31 * s * s / 2),
    ]  # fmt: skip
    return worst(a - b for a, b in found)


def upwards(dice):
    """(40)-(42): A w' = 0 at nu = (1, 0, 0)."""
    b = Body(dice, A12=0, A31=0)
    b.l2, b.l3, b.s2, b.s3 = -b.B12, -b.B31, b.C12, b.C31
    return worst(about_first(b, 0, 0, number(dice)))


def set_a(dice):
    """(44)-(48): the second and third equations hold, and the first is that before (49)."""
    b, theta, phi, w = case_a(dice)
    true = about_first(b, theta, phi, w)
    return worst(
        [true[1], true[2], true[0] - w * (b.B12 * cos(phi) - b.B31 * sin(phi)) * sin(theta)]
    )


def quadrature(P, Q, n, A, u0=0):
    """u = tan(phi / 2) at t after u0, of A phi' = P sin phi + Q cos phi + n; the printed forms are u0 = 0."""
    square = n * n - P * P - Q * Q
    root = sqrt(abs(square))

    def u(t):
        if square == 0:
            return (2 * A * u0 + (n + Q + P * u0) * t) / (2 * A - (P + (n - Q) * u0) * t)
        T = (
            tan(root * t / (2 * A))
            if square > 0
            else sinh(root * t / (2 * A)) / cosh(root * t / (2 * A))
        )
        return (u0 * root + (n + Q + P * u0) * T) / (root - (P + (n - Q) * u0) * T)

    return u


def printed_quadrature(P, Q, n, A):
    square = n * n - P * P - Q * Q
    if square > 0:
        m = sqrt(square) / (2 * A)
        return lambda t: (n + Q) * tan(m * t) / (2 * A * m - P * tan(m * t))
    if square < 0:
        kappa = sqrt(-square) / A
        return lambda t: (
            (n + Q) * (1 - exp(kappa * t)) / ((P - A * kappa) * exp(kappa * t) - (P + A * kappa))
        )
    return lambda t: (n + Q) * t / (2 * A - P * t)


def turning_rate(u, P, Q, n, A, t):
    """Residual of A phi' = P sin phi + Q cos phi + n for u = tan(phi / 2)."""
    x = u(t)
    return abs(2 * A * diff(u, t) - (2 * P * x + Q * (1 - x * x) + n * (1 + x * x)))


def cases(dice):
    """P, Q, n, A11 for the three cases of (50)."""
    P, Q, A = number(dice), number(dice), 3 + abs(number(dice))
    length = sqrt(P * P + Q * Q)
    yield from ((P, Q, n, A) for n in (2 * length, length / 3))
    yield mpf(3), mpf(-4), mpf(5), A


def three_cases(dice):
    """After (50), with t0 = 0, and the limit of case 2."""
    t, residual = mpf("0.7"), []
    for P, Q, n, A in cases(dice):
        residual.append(turning_rate(printed_quadrature(P, Q, n, A), P, Q, n, A, t))
        if n * n < P * P + Q * Q:
            kappa = sqrt(P * P + Q * Q - n * n) / A
            residual.append(printed_quadrature(P, Q, n, A)(120 / kappa) - (P + A * kappa) / (Q - n))
    return worst(residual)


def set_b(dice):
    """(53)-(57), s1 = 0 and k = 0."""
    b = Body(dice, A12=0, A31=0, B11=0, l2=0, l3=0, C12=0, C31=0, s1=0)
    phi, w = number(dice), number(dice)
    true = about_first(b, pi / 2, phi, w)
    momentum = b.tensor("A") * matrix([w, 0, 0]) + matrix([b.l1, 0, 0])
    k = (momentum.T * vertical(pi / 2, phi))[0]
    return worst([true[1], true[2], k, abel(b.reduced(), w, true[0] / b.A11 / w, phi)])


def system_60(dice):
    """(60) for l, m, n* with s, c23, d from it: (57) holds."""
    b12, b31, n, mu, phi = numbers(dice, 5)
    k, m = mu * b31, mu * b12
    d, c23 = -(m * m - k * k - m * b12 + k * b31), -(2 * k * m - k * b12 - m * b31) / 2
    six = b12, b31, d, c23, n * (m - b12), n * (k - b31)
    return abs(abel(six, k * cos(phi) + m * sin(phi) + n, -k * sin(phi) + m * cos(phi), phi))


RIGHT = (
    ("(1)-(6)", "equal the vector form", full_equations),
    ("(7), (8)", "are integrals", integrals),
    ("(10)-(12), (19)-(22)", "rotation about axis 1; elimination of w1'", rotation),
    ("(24)", "second equation on it", second_equation),
    ("(26)-(34), (36)", "harmonics of (24) and of the corrected (25)", conditions),
    ("(40)-(42)", "at cos th = 1", upwards),
    ("(44)-(48), line before (49)", "case A is invariant", set_a),
    ("after (50)", "its three closed forms and the limit in case 2", three_cases),
    ("(53)-(57), k = 0", "case B is invariant; Abel's equation", set_b),
    ("(60)", "conditions of the trigonometric solution", system_60),
    ("(63)", "energy at b = 0", elliptic.level),
    ("(64), (65)", "the quartic", elliptic.substitution),
    ("(67), (68), expanded g2, g3, 27 G", "invariants; disc P4 = 256 G", elliptic.expanded),
)


# what the paper leaves out: each function gives the residual of what fills the gap


def inclined(dice):
    """Uniform rotation about the vertical by an axis that is not principal."""
    b, m = Body(dice), number(dice)
    b.s3 = -(b.A31 * m * m + (b.B31 + b.l3) * m - b.C31)
    b.s2 = -(b.A12 * m * m + (b.B12 + b.l2) * m - b.C12)
    return worst(about_first(b, 0, 0, m))


def any_start(dice):
    """The closed forms of (50) from any u0."""
    u0 = 5 * number(dice)
    return worst(turning_rate(quadrature(*case, u0), *case, mpf("0.3")) for case in cases(dice))


def general_solution(dice):
    """d : c23 = b12^2 - b31^2 : b12 b31 and s || b: |w - mu2 X|^mu2 / |w - mu1 X|^mu1 is constant
    along (57).
    """
    b12, b31, sigma, phi, w = numbers(dice, 5)
    mu1 = mpf("1.2") + abs(number(dice))
    mu2 = 1 - mu1
    delta = mu1 * mu2
    six = b12, b31, delta * (b12**2 - b31**2), delta * b12 * b31, sigma * b12, sigma * b31

    def value(phi, w):
        X = b12 * sin(phi) + b31 * cos(phi) - sigma / delta
        return mu2 * log(abs(w - mu2 * X)) - mu1 * log(abs(w - mu1 * X))

    slope = -abel(six, w, 0, phi) / w
    return abs(diff(value, (phi, w), (1, 0)) + slope * diff(value, (phi, w), (0, 1)))


GAPS = (
    ("after (42)", "About the vertical the rotation is uniform for an axis that is not principal too, if only `A31 m^2 + (B31 + l3) m - C31 + s3 = 0` and `A12 m^2 + (B12 + l2) m - C12 + s2 = 0`.", inclined),
    ("(26)-(36)", "They are necessary and sufficient for the whole set w2 = w3 = 0, nu1 = cos th to be invariant, not for single motions on it: the line above is one that breaks (23).", inclined),
    ("after (50)", "The forms start at phi = 0: in case 2 real t0 reach only the arc between the equilibria that holds phi = 0. From any u0, `u = (u0 D + (n + Q + P u0) T) / (D - (P + (n - Q) u0) T)` with P = B12 sin th, Q = B31 sin th, D^2 = abs(n^2 - P^2 - Q^2), T = tan or th of D t / (2 A11).", any_start),
    ("(58)-(61)", "Not one solution but all: under the same two conditions (57) is `w dw/dF = w + sigma - delta F`, and `abs(w - mu2 X)^mu2 / abs(w - mu1 X)^mu1` is constant, X = F - sigma / delta, mu1 + mu2 = 1, mu1 mu2 = delta (delta < 1/4), F = b12 sin phi + b31 cos phi.", general_solution),
    ("(66)", "The triple root c = 0 is left out.", elliptic.triple_root),
    ("(66)", "The quadruple root is left out.", elliptic.quadruple_root),
    ("(68)", "Nothing needs G != 0, but P' is needed unless u0 is a root of P4; P4 may also have its double roots off the real axis, where w is the trigonometric solution.", elliptic.elliptic),
)  # fmt: skip


PAGE = """# The gyrostat paper's printed formulas, tested

Made by `python workflows/gyrostat_errata.py`. Source: M. E. Lesina, Ya. V. Zinovyeva, *Rotation of a gyrostat in a magnetic
field with the Barnett-London effect* (2004), as a scanned text: a slip may be the scan's. Every residual was computed by
this command, in {digits}-digit arithmetic, the worst (corrected, right) or the least (printed) of {trials} random sets of parameters.
Motions are checked against the six equations (1)-(6), the elliptic case against u'^2 = P4(u) / 4; the corrections are derived
in `survey/scenes/gyrostat.md`. th = theta0, l = lambda, lower case = over A11.

## What must be corrected

| place | printed | correct | residual, printed | corrected |
|---|---|---|---|---|
{errata}

The slips of (25), (35) and (59) change no later formula. The printed bracket of (66) is the quotient of a cubic; b, c and
the conditions of the variants inherit it.

## What is right as printed

| place | what | residual |
|---|---|---|
{right}

(13)-(18), (23), (37)-(39), (43), (51), (52), (56), (58) and (62) are definitions, assumptions or read off from these. The
citations were not checked.

## What does not follow, or is missing

| place | what is true | residual |
|---|---|---|
{gaps}
"""
if __name__ == "__main__":
    write(__doc__, "gyrostat_errata", PAGE, {"errata": ERRATA, "right": RIGHT, "gaps": GAPS})
