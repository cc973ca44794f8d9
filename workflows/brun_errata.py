"""The printed formulas of the paper on quadratures of Kobb's type, each tested: a page for a reader
of the paper.

    python workflows/brun_errata.py [-o results]

Needs mpmath: pip install -e ".[test]". Residuals to 40 digits at random bodies and states: the
Hamiltonian is held against the kinetic energy of the turning rotation matrix, integrals by their
Poisson brackets, quadratures by their derivatives along the motion. The corrections are derived in
survey/scenes/brun.md.
"""

# ruff: noqa: E501  (the rows of the page's tables)
from errata import number, write
from mpmath import cos, diff, matrix, mpf, sin, sqrt


class Motion:
    """A body A, B, C (A = B = 2C unless given) in the field epsilon, at an instant with p_theta > 0."""

    def __init__(self, dice, ratios=(2, 2)):
        self.C = abs(number(dice))
        self.A, self.B = (mpf(ratio) * self.C for ratio in ratios)
        self.eps, self.phi, self.psi = number(dice), number(dice), number(dice)
        self.theta = mpf("0.4") + abs(number(dice))
        self.rates = [abs(number(dice)), number(dice), number(dice)]  # of theta, phi, psi

    def turned(self, theta, phi, psi):
        """R = Rz(psi) Rx(theta) Rz(phi)."""
        x = matrix([[1, 0, 0], [0, cos(theta), -sin(theta)], [0, sin(theta), cos(theta)]])
        return about_z(psi) * x * about_z(phi)

    def spin(self, rates):
        """(p, q, r) of R^T R'."""
        here = self.theta, self.phi, self.psi

        def entry(i, j):
            return diff(
                lambda t: self.turned(*(x + t * v for x, v in zip(here, rates, strict=True)))[i, j],
                0,
            )

        change = self.turned(*here).T * matrix([[entry(i, j) for j in range(3)] for i in range(3)])
        return change[2, 1], change[0, 2], change[1, 0]

    def kinetic(self, rates):
        p, q, r = self.spin(rates)
        return (self.A * p * p + self.B * q * q + self.C * r * r) / 2

    def vertical(self):
        """gamma, gamma', gamma''."""
        return self.turned(self.theta, self.phi, self.psi).T * matrix([0, 0, 1])

    def energy(self):
        """(2)."""
        g = self.vertical()
        field = self.A * g[0] ** 2 + self.B * g[1] ** 2 + self.C * g[2] ** 2
        return self.kinetic(self.rates) + self.eps * field / 2

    def momenta(self):
        """p_theta, p_phi, p_psi by (5): T is quadratic, so differences are derivatives."""
        found = []
        for i in range(3):
            up, down = ([x + s * (i == j) for j, x in enumerate(self.rates)] for s in (1, -1))
            found.append((self.kinetic(up) - self.kinetic(down)) / 2)
        return found

    def state(self):
        return [self.theta, self.phi, self.psi, *self.momenta()]


def about_z(angle):
    return matrix([[cos(angle), -sin(angle), 0], [sin(angle), cos(angle), 0], [0, 0, 1]])


def brackets(theta, phi, momenta, sign):
    """The two square brackets of (6) and (7)."""
    p_theta, p_phi, p_psi = momenta
    x = (p_psi - p_phi * cos(theta)) / sin(theta)
    return x * sin(phi) + p_theta * cos(phi), x * cos(phi) + sign * p_theta * sin(phi)


def hamiltonian(m, state, factor=0.5, sign=-1):
    """(6)."""
    theta, phi, _psi, *momenta = state
    first, second = brackets(theta, phi, momenta, sign)
    field = (m.A * sin(phi) ** 2 + m.B * cos(phi) ** 2) * sin(theta) ** 2 + m.C * cos(theta) ** 2
    return factor * (first**2 / m.A + second**2 / m.B + momenta[1] ** 2 / m.C + m.eps * field)


def clebsch(m, state, sign=-1, field=1):
    """F2 of (7)."""
    theta, phi, _psi, *momenta = state
    first, second = brackets(theta, phi, momenta, sign)
    across = (m.B * m.C * sin(phi) ** 2 + m.A * m.C * cos(phi) ** 2) * sin(
        theta
    ) ** 2 + m.A * m.B * cos(theta) ** 2
    return first**2 + second**2 + momenta[1] ** 2 - field * m.eps * across


def bracket(f, g, state):
    """The Poisson bracket (f, g)."""

    def slope(function, i):
        return diff(lambda x: function([*state[:i], x, *state[i + 1 :]]), state[i])

    return sum(slope(f, i) * slope(g, i + 3) - slope(f, i + 3) * slope(g, i) for i in range(3))


def radicand(m, alpha1, alpha2):
    return 2 * alpha1 * m.C - alpha2 - 6 * m.eps * m.C**2


def quartic(m, u, alphas, p_phi=None, doubled=1):
    """a4 u^4 + .. + a0 of (9); `doubled` multiplies alpha1."""
    alpha1, alpha2, alpha3 = doubled * alphas[0], alphas[1], alphas[2]
    p_phi = sqrt(radicand(m, alpha1, alpha2)) if p_phi is None else p_phi
    a0 = 8 * m.eps * m.C**2 + 2 * alpha2 - 2 * alpha1 * m.C - alpha3**2
    return -2 * m.C**2 * m.eps * u**4 - alpha2 * u**2 + 2 * alpha3 * p_phi * u + a0


class Instant:
    """What (9)-(11) need of a motion with p_theta > 0, p_phi > 0: alphas with alpha1 = 2h, u, sqrt
    P, a1, rates.
    """

    def __init__(self, dice, positive=True):
        while True:
            self.m = m = Motion(dice)
            self.p_theta, self.p_phi, self.p_psi = m.momenta()
            if (self.p_phi > 0) == positive:
                break
        self.h = m.energy()
        self.alphas = [2 * self.h, clebsch(m, m.state()), self.p_psi]
        self.u = cos(m.theta)
        self.root = sin(m.theta) * self.p_theta
        self.d_theta, self.d_phi, self.d_psi = m.rates
        self.du = -sin(m.theta) * self.d_theta
        self.a1 = 2 * self.p_psi * self.p_phi

    def w_rate(self):
        """d/dt of dW/d alpha1 along the motion, W of (9) with p_theta > 0."""
        rest = self.alphas[1:]
        p_theta = diff(lambda x: sqrt(quartic(self.m, self.u, [x, *rest])), self.alphas[0]) / sin(
            self.m.theta
        )
        p_phi = diff(lambda x: sqrt(radicand(self.m, x, rest[0])), self.alphas[0])
        return p_theta * self.d_theta + p_phi * self.d_phi


# the printed formulas that need correction: each function gives (residual as printed, residual
# corrected)


def dots(dice):
    m = Motion(dice)
    (theta, phi, psi), (d_theta, d_phi, d_psi) = (m.theta, m.phi, m.psi), m.rates
    true = m.spin(m.rates)

    def residual(x):
        p, q = (
            x * sin(theta) * sin(phi) + d_theta * cos(phi),
            x * sin(theta) * cos(phi) - d_theta * sin(phi),
        )
        return max(abs(a - b) for a, b in zip((p, q, x * cos(theta) + d_phi), true, strict=True))

    return residual(psi), residual(d_psi)


def factors(dice):
    m = Motion(dice, ratios=(2, 1.5))
    return tuple(abs(hamiltonian(m, m.state(), factor) - m.energy()) for factor in (1, mpf(1) / 2))


def sign_in_h(dice):
    m = Motion(dice, ratios=(2, 1.5))
    return tuple(abs(hamiltonian(m, m.state(), sign=sign) - m.energy()) for sign in (1, -1))


def sign_in_f2(dice):
    m = Motion(dice, ratios=(2, 1.5))
    return tuple(
        abs(
            bracket(
                lambda s: hamiltonian(m, s), lambda s, sign=sign: clebsch(m, s, sign), m.state()
            )
        )
        for sign in (1, -1)
    )


def first_constant(dice):
    at = Instant(dice)
    return tuple(
        abs(radicand(at.m, alpha1, at.alphas[1]) - at.p_phi**2) for alpha1 in (at.h, 2 * at.h)
    )


def negative_spin(dice):
    at = Instant(dice, positive=False)
    square = at.root**2
    return abs(quartic(at.m, at.u, at.alphas) - square), abs(
        quartic(at.m, at.u, at.alphas, at.p_phi) - square
    )


def coefficients(dice):
    at = Instant(dice)
    square, halved = at.root**2, [at.h, *at.alphas[1:]]
    return abs(quartic(at.m, at.u, halved, at.p_phi) - square), abs(
        quartic(at.m, at.u, halved, at.p_phi, 2) - square
    )


def time_of_w(dice):
    at = Instant(dice)
    return abs(at.w_rate() - 1), abs(at.w_rate() - mpf(1) / 2)


def first_quadrature(dice):
    at = Instant(dice)
    C, x = at.m.C, at.alphas[2] ** 2 * at.u / at.a1
    corrected = C * at.d_phi / at.p_phi - C * (2 * x - 1) * at.du / ((1 - at.u**2) * at.root)
    return abs(-2 * C * (x - 1) * at.du / at.root - 1), abs(corrected - mpf(1) / 2)


def second_quadrature(dice):
    at = Instant(dice)
    part = (2 - at.u**2 - 2 * at.alphas[2] ** 2 * at.u / at.a1) * at.du / at.root
    return abs(part), abs(-at.d_phi / (2 * at.p_phi) - part / (2 * (1 - at.u**2)))


def third_quadrature(dice):
    at = Instant(dice)
    part = (at.p_psi - at.a1 * at.u / (2 * at.p_psi)) * at.du / at.root
    return abs(at.d_psi + part), abs(at.d_psi + part / (1 - at.u**2))


ERRATA = (
    ("(3)", "`p = psi sin th sin phi + ..`, `psi` in all three", "`psi'`: the dots are lost", dots),
    ("(6)", "`1/A`, `1/B`, `1/C`, `eps`", "`1/(2A)`, `1/(2B)`, `1/(2C)`, `eps/2`: printed is 2H of (2)", factors),
    ("(6)", "second bracket `.. + p_th sin phi`", "`.. - p_th sin phi`, as in (8)", sign_in_h),
    ("(7)", "F2, second bracket `.. + p_th sin phi`", "`.. - p_th sin phi`; else (F1, F2) is not 0", sign_in_f2),
    ("(7)", "`F1 = H = alpha1`, H of (2)", "`alpha1 = 2h`: (8) and the root in a1 need it", first_constant),
    ("a0 .. a4", "with `alpha1 = H`", "with `alpha1 = 2h`, or `4 alpha1 C` for `2 alpha1 C` in a0 and a1", coefficients),
    ("a1", "`2 alpha3 sqrt(2 alpha1 C - alpha2 - 6 eps C^2)`", "`2 alpha3 p_phi`: the root loses `p_phi < 0`", negative_spin),
    ("(10)", "`dW/d alpha1 = t + beta1`", "`(t + beta1)/2`, as `alpha1 = 2h`", time_of_w),
    ("(11), 1", "`t + beta1 = -Int 2C (alpha3^2 u/a1 - 1) du/sqrt P`", "`(t + beta1)/2 = C phi/p_phi - C Int (2 alpha3^2 u/a1 - 1) du/((1 - u^2) sqrt P)`", first_quadrature),
    ("(11), 2", "`beta2 = -Int (2 - u^2 - 2 alpha3^2 u/a1) du/sqrt P`", "`beta2 = -phi/(2 p_phi) - (1/2) Int (2 - u^2 - 2 alpha3^2 u/a1) du/((1 - u^2) sqrt P)`", second_quadrature),
    ("(11), 3", "`beta3 = psi + Int (alpha3 - a1 u/(2 alpha3)) du/sqrt P`", "`beta3 = psi + Int (alpha3 - a1 u/(2 alpha3)) du/((1 - u^2) sqrt P)`", third_quadrature),
)  # fmt: skip


def projections(dice):
    m = Motion(dice)
    g = sin(m.theta) * sin(m.phi), sin(m.theta) * cos(m.phi), cos(m.theta)
    return max(abs(a - b) for a, b in zip(g, m.vertical(), strict=True))


def involution(dice):
    m = Motion(dice, ratios=(abs(number(dice)) + mpf("0.7"), mpf("1.4")))
    pairs = ((lambda s: hamiltonian(m, s), lambda s: clebsch(m, s)), (lambda s: hamiltonian(m, s), lambda s: s[5]),
             (lambda s: clebsch(m, s), lambda s: s[5]))  # fmt: skip
    return max(abs(bracket(f, g, m.state())) for f, g in pairs)


def hamilton_jacobi(dice):
    at = Instant(dice)
    m = at.m
    first, second = brackets(m.theta, m.phi, (at.p_theta, at.p_phi, at.p_psi), -1)
    left = (first**2 + second**2) / 2 + at.p_phi**2 + m.C**2 * m.eps * (1 + sin(m.theta) ** 2)
    return abs(left - at.alphas[0] * m.C)


def separated(dice):
    at = Instant(dice)
    return abs(sqrt(quartic(at.m, at.u, at.alphas)) / sin(at.m.theta) - at.p_theta)


RIGHT = (
    ("(3)", "the direction cosines gamma", projections),
    ("(7)", "with the corrected sign F1, F2, F3 are in involution, for any A, B, C", involution),
    ("(8)", "with `alpha1 = 2h`", hamilton_jacobi),
    ("(9), a0 .. a4", "with `alpha1 = 2h`, `p_phi > 0`, `p_th > 0`", separated),
)


def dependent(dice):
    ratio = abs(number(dice)) + mpf("0.5")
    m = Motion(dice, ratios=(ratio, ratio))
    p_phi = m.momenta()[1]
    f2 = 2 * m.A * m.energy() - (m.A - m.C) / m.C * p_phi**2 - m.eps * m.A * (m.A + m.C)
    return abs(clebsch(m, m.state()) - f2)


def jacobian(dice):
    """The determinant d(F1, F2, F3)/d(p_theta, p_phi, p_psi), printed as never 0."""
    ratio = abs(number(dice)) + mpf("0.5")
    m = Motion(dice, ratios=(ratio, ratio))
    s = m.state()

    def slope(f, i):
        return diff(lambda x: f([*s[:i], x, *s[i + 1 :]]), s[i])

    both = [[slope(lambda s, f=f: f(m, s), i) for i in (3, 4)] for f in (hamiltonian, clebsch)]
    determinant = both[0][0] * both[1][1] - both[0][1] * both[1][0]
    return abs(determinant + 2 * (m.A - m.C) * s[3] * s[4] / (m.A * m.C))


def any_ratio(dice):
    """(S2) for A = B and any C."""
    ratio = abs(number(dice)) + mpf("0.5")
    m = Motion(dice, ratios=(ratio, ratio))
    p_theta, a, b = m.momenta()
    u, k = cos(m.theta), m.eps * m.A * (m.A - m.C)
    level = 2 * m.A * m.energy() - m.A / m.C * a * a - m.eps * m.A**2 + a * a
    return abs(
        (1 - u * u) * (level + k * u * u)
        - (a * a + b * b - 2 * a * b * u)
        - (sin(m.theta) * p_theta) ** 2
    )


def combined(dice):
    """t = -2C Int du/sqrt P."""
    at = Instant(dice)
    return abs(-2 * at.m.C * at.du / at.root - 1)


GAPS = (
    ("(7)", "For A = B, F2 says nothing new: `F2 = 2 A H - ((A - C)/C) p_phi^2 - eps A (A + C)`. Take H, p_phi, p_psi.", dependent),
    ("after (7)", "The determinant called non-zero is `-2 (A - C) p_th p_phi/(A C)`: it is 0 wherever p_phi or p_th is.", jacobian),
    ("the title", "A = B = 2C is not needed: for A = B and any C, `(sin th p_th)^2 = (1 - u^2)(L + k u^2) - (p_phi^2 + p_psi^2 - 2 p_phi p_psi u)`, `k = eps A (A - C)`, `L = 2 A h - (A/C) p_phi^2 - eps A^2 + p_phi^2`.", any_ratio),
    ("after (11)", "(11) as such has third-kind integrals and phi in it, and no single-valued inverse; its first line plus 2C times the second has: `t = -2C Int du/sqrt P`, u an elliptic function of t.", combined),
)  # fmt: skip


PAGE = """# The printed formulas of the quadratures of Kobb's type, tested

Made by `python workflows/brun_errata.py`. Source: A. A. Bekov, M. D. Shinibaev et al., *On quadratures of Kobb's type in the
case A = B = 2C* (in Russian), as a scanned text: a slip may be the scan's. Every residual was computed by this command, in
{digits}-digit arithmetic, the worst (corrected, right, missing) or the least (printed) of {trials} random bodies and states: H against the
energy of the turning rotation matrix, integrals by their Poisson brackets, (10) and (11) by their derivatives along the
motion (upper sign: p_th > 0). The corrections are derived in `survey/scenes/brun.md`. u = cos th, P = a4 u^4 + .. + a0.

## What must be corrected

| place | printed | correct | residual, printed | corrected |
|---|---|---|---|---|
{errata}

The slip of (6) and (7) is gone in (8). After (5), mu is G times the attracting mass, not the gravitational constant.
`p_phi = C r0 - const` is to be read as "p_phi = C r0, a constant". Each line of (11) lacks what p_phi and the measure
`d th = -du/sin th` bring: (9) depends on alpha1 and alpha2 through p_phi, too.

## What is right as printed

| place | what | residual |
|---|---|---|
{right}

(1), (2), (4), (5) are definitions. The attribution to Kobb and the references were not checked.

## What does not follow, or is missing

| place | what is true | residual |
|---|---|---|
{gaps}
"""


if __name__ == "__main__":
    write(__doc__, "brun_errata", PAGE, {"errata": ERRATA, "right": RIGHT, "gaps": GAPS})
