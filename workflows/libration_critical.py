"""Critical mass ratios of the triangular libration points, to 30 digits, by exact integer algebra.

    python workflows/libration_critical.py [-o results]

Every value is a zero of an integer polynomial in v = omega2^2 without poles (0 < v < 1/2 is 0 < mu
< mu_R). Sturm's theorem counts the zeros, so none is missing; each lies between two rational
numbers where the polynomial has opposite signs. Nothing is rounded before mu is printed. Equation
numbers: survey/scenes/libration.md.
"""

import csv
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import reduce
from itertools import pairwise
from math import gcd, lcm

import numpy as np
from script import parser

import survey
from survey.kernels.libration.coefficients import FORMS, LABELS
from survey.measures.libration.normal_form import vectors

DIGITS = 60  # of the square roots that lead from v to mu
SHOWN = Decimal("1e-31")  # mu is printed in multiples of it
ERROR = Decimal("2e-31")
WIDTH = Fraction(1, 2**150)  # of v
END = Fraction(1, 2)  # v at mu_R
POLYNOMIALS = (
    [1, -1],
    [0, 1],
    [1, -2],
    [-4, 5],
    [1, -5],
    [-9, 10],
    [1, -10],
    [3, 1],
    [4, -1],
    [9, -4, 4],
)


# polynomials: lists of integers, ascending


def times(*polynomials):
    """Their product."""
    return reduce(_times, polynomials, [1])


def _times(a, b):
    product = [0] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            product[i + j] += x * y
    return product


def plus(a, b):
    longer, shorter = (a, b) if len(a) >= len(b) else (b, a)
    return trimmed(
        [x + y for x, y in zip(longer, shorter + [0] * (len(longer) - len(shorter)), strict=True)]
    )


def trimmed(a):
    """Without leading zeros; the zero polynomial is []."""
    while a and a[-1] == 0:
        a = a[:-1]
    return a


def at(a, x):
    """The value at a rational x."""
    value = Fraction(0)
    for coefficient in reversed(a):
        value = value * x + coefficient
    return value


def sign(a, x):
    value = at(a, x)
    return (value > 0) - (value < 0)


def primitive(a):
    """Divided by the greatest common divisor of the coefficients."""
    divisor = gcd(*a) if a else 1
    return [x // divisor for x in a]


def remainder(a, b):
    """A positive multiple of the remainder of a / b."""
    while len(a) >= len(b):
        factor, lead = abs(b[-1]), a[-1] * (1 if b[-1] > 0 else -1)
        shifted = [0] * (len(a) - len(b)) + b
        a = trimmed([factor * x - lead * y for x, y in zip(a, shifted, strict=True)][:-1])
    return primitive(a)


def divided(a, b):
    """a / b if b, of which the leading coefficients are coprime, divides it in integers, else None."""
    a, quotient = list(a), [0] * max(len(a) - len(b) + 1, 1)
    while len(a) >= len(b):
        if a[-1] % b[-1]:
            return None
        quotient[len(a) - len(b)] = factor = a[-1] // b[-1]
        for i, y in enumerate(b):
            a[len(a) - len(b) + i] -= factor * y
        a.pop()
    return None if any(a) else quotient


def sturm(a):
    """The Sturm chain of a."""
    chain = [primitive(a), primitive([i * x for i, x in enumerate(a)][1:])]
    while len(chain[-1]) > 1:
        chain.append([-x for x in remainder(chain[-2], chain[-1])])
        if not chain[-1]:
            chain.pop()
            break
    return chain


def count(chain, low, high):
    """Number of different zeros in low < v <= high."""
    changes = []
    for x in (low, high):
        signs = [s for s in (sign(a, x) for a in chain) if s]
        changes.append(sum(s != t for s, t in pairwise(signs)))
    return changes[0] - changes[1]


def zeros(a, low=Fraction(0), high=END):
    """Every zero in low < v < high, as a pair of rationals, WIDTH apart or less, where a has
    opposite signs.

    Zeros at 0 and END are divided out.
    """
    for factor in ([0, 1], [1, -2]):
        while (quotient := divided(a, factor)) is not None:
            a = quotient
    chain = sturm(a)
    return [_refined(a, *interval) for interval in _isolated(chain, low, high)]


def _isolated(chain, low, high):
    number = count(chain, low, high)
    if number <= 1:
        return [(low, high)] * number
    middle = (low + high) / 2
    return _isolated(chain, low, middle) + _isolated(chain, middle, high)


def _refined(a, low, high):
    """The interval of a single zero, halved until WIDTH."""
    below = sign(a, low)
    assert below * sign(a, high) < 0, "a zero of even order, or at the end of an interval"
    while high - low > WIDTH:
        middle = (low + high) / 2
        here = sign(a, middle)
        if here == 0:
            return middle, middle
        low, high = (middle, high) if here == below else (low, middle)
    return low, high


# terms: (numerator in v, common denominator, powers of the FORM_FACTORS), as in FORMS


def term(name, w1=0, w2=0, weight=1):
    """A form of the table times weight omega1^w1 omega2^w2."""
    common, powers, numerator = FORMS[name]
    return [weight * x for x in numerator], common, (powers[0] + w1, powers[1] + w2, *powers[2:])


def product(*terms):
    numerators, commons, powers = zip(*terms, strict=True)
    return (
        times(*numerators),
        reduce(int.__mul__, commons),
        tuple(map(sum, zip(*powers, strict=True))),
    )


def rational(a):
    """The term without omega1, omega2, of which only even powers may occur: u and v instead."""
    numerator, common, (w1, w2, u, v, *others) = a
    assert w1 % 2 == 0 and w2 % 2 == 0
    return numerator, common, (u + w1 // 2, v + w2 // 2, *others)


def summed(*terms):
    """The numerator of a sum of terms, without the factors of its denominator: zeros only, no poles."""
    return primitive(_reduced(numerators([terms])[0]))


def numerators(sums):
    """The numerators of several sums of terms over one common denominator."""
    sums = [[rational(a) for a in terms] for terms in sums]
    flat = [a for terms in sums for a in terms]
    common = lcm(*(denominator for _, denominator, _ in flat))
    least = [min(powers) for powers in zip(*(powers for _, _, powers in flat), strict=True)]
    found = []
    for terms in sums:
        total = []
        for numerator, denominator, powers in terms:
            factors = [
                f for f, n, m in zip(POLYNOMIALS, powers, least, strict=True) for _ in range(n - m)
            ]
            total = plus(total, [common // denominator * x for x in times(numerator, *factors)])
        found.append(total)
    return found


def _reduced(a):
    for factor in POLYNOMIALS:
        while (quotient := divided(a, factor)) is not None:
            a = quotient
    return a


def discriminant():
    """a11^2 - 4 a20 a02."""
    return summed(product(term("a11"), term("a11")), product(term("a20", weight=-4), term("a02")))


def determinant_2():
    """det N'' in the plane."""
    return summed(
        product(term("200", weight=4), term("020")), product(term("110", weight=-1), term("110"))
    )


def determinant_3():
    """det N''."""
    return summed(
        product(term("200", weight=8), term("020"), term("002")),
        product(term("110", weight=2), term("101"), term("011")),
        product(term("200", weight=-2), term("011"), term("011")),
        product(term("020", weight=-2), term("101"), term("101")),
        product(term("002", weight=-2), term("110"), term("110")),
    )


def on_rays():
    """L = N = 0 and M there, as polynomials in a whose coefficients are polynomials in v.

    r = (a omega2 / omega1, 1, omega2 (1 - a)), which makes both rational; M is divided by omega2.
    """
    quadratic = numerators([[term("a02")], [term("a11", -1, 1)], [term("a20", -2, 2)]])
    powers = [[], [], [], []]
    for label in LABELS[6:]:
        i, _, k = map(int, label)
        for j, binomial in enumerate(([1], [1, -1], [1, -2, 1], [1, -3, 3, -1])[k]):
            powers[i + j].append(term(label, -i, i + k - 1, binomial))
    return quadratic, numerators(powers)


def resultant(a, b):
    """The resultant of two polynomials whose coefficients are polynomials (Sylvester's determinant)."""
    n, m = len(a) - 1, len(b) - 1
    rows = [[[]] * i + a[::-1] + [[]] * (m - 1 - i) for i in range(m)]
    rows += [[[]] * i + b[::-1] + [[]] * (n - 1 - i) for i in range(n)]
    return _determinant(rows)


def _determinant(rows):
    if not rows:
        return [1]
    total = []
    for i, row in enumerate(rows):
        if row[0]:
            minor = _determinant([other[1:] for other in rows[:i] + rows[i + 1 :]])
            total = plus(total, times(row[0], minor, [(-1) ** i])) if minor else total
    return total


# from v = omega2^2 to mu


def decimal(x):
    """A rational number to DIGITS digits (in a context of that precision)."""
    return Decimal(x.numerator) / Decimal(x.denominator)


def mass(v):
    """mu of v (a Decimal), to nearly DIGITS digits: mu (1 - mu) = (4/27) v (1 - v)."""
    g = 4 * v * (1 - v) / 27
    return 2 * g / (1 + (1 - 4 * g).sqrt())


@dataclass(frozen=True)
class Value:
    """A critical mass ratio, good to ERROR, its symbol, and what happens there."""

    symbol: str
    what: str
    mu: Decimal
    order: int | str = ""


def value(symbol, what, v):
    """The Value between two rationals v."""
    with localcontext(prec=DIGITS):
        low, high = (mass(decimal(x)) for x in v)
        mu = ((low + high) / 2).quantize(SHOWN)
        assert max(high - mu, mu - low) < ERROR - SHOWN
    return Value(symbol, what, mu)


def one(name):
    """The only zero of a form of the table; raises ValueError if there are none or several."""
    [zero] = zeros(numerator(name))
    return zero


def numerator(name):
    return trimmed(list(FORMS[name][2]))


def boundaries():
    """The values that divide the interval of linear stability, ascending."""
    return [
        value("mu**", "a20 = 0: alpha1 of (3.11) goes through infinity", one("a20")),
        value("mu_c", "D4 = 0: the ray alpha2 enters the octant", one("D4")),
        value("mu2", "omega1 = 3 omega2: unstable", (Fraction(1, 10),) * 2),
        value("mu_d", "a02 = 0: the ray alpha2 leaves the octant", one("a02")),
        value("mu1", "omega1 = 2 omega2: unstable", (Fraction(1, 5),) * 2),
        value("mu_R", "omega1 = omega2: linear stability ends", (END, END)),
    ]


def determinants():
    """Zeros of det N'', of D6, and of M on the two lines of L = N = 0."""
    found = [value("det3", "det N'' = 0 (3 x 3)", zero) for zero in zeros(determinant_3())]
    found += [value("D6", "D6 = 0", zero) for zero in zeros(numerator("D6"))]
    rays = (
        (zero, min((1, 2), key=lambda ray: abs(on_ray(zero[0], ray))))
        for zero in zeros(ray_resultant())
    )
    return found + [
        value(f"M{ray}", f"M = 0 on the line of alpha{ray}, outside the octant", z)
        for z, ray in rays
    ]


def coefficients():
    """Zeros of single coefficients."""
    pairs = ((label, zero) for label in LABELS for zero in zeros(numerator(label)))
    return [value(f"c{label}", f"c{label} = 0", zero) for label, zero in pairs]


def ray_resultant():
    """The polynomial whose zeros are those of M on the lines of L = N = 0 (3.10)."""
    return primitive(_reduced(resultant(*on_rays())))


def on_ray(v, ray):
    """M / omega2 on the line of alpha1 or alpha2 (3.11) at a rational v, times a positive factor,
    to many digits.
    """
    quadratic, cubic = ([at(a, v) for a in polynomial] for polynomial in on_rays())
    # the sign of the common denominators, from a20 = (numerator) / (144 s^2 (1 - 5u) (4 - u) (4 -
    # v)), 1 - 5u < 0
    common = 1 if (quadratic[2] > 0) == (at(numerator("a20"), v) < 0) else -1
    with localcontext(prec=DIGITS):
        (q0, q1, q2), (m0, m1, m2, m3) = map(decimal, quadratic), map(decimal, cubic)
        root = (q1 * q1 - 4 * q0 * q2).sqrt() * common * (1 if ray == 1 else -1)
        a = (root - q1) / (2 * q2)
        return m0 + a * (m1 + a * (m2 + a * m3))


def resonances(highest=8):
    """Every resonance k1 omega1 - k2 omega2 + k3 = 0 in 0 < mu < mu_R with even k3 up to an order,
    ascending in mu.
    """
    found = []
    with localcontext(prec=DIGITS):
        for k1, k2, k3 in vectors(highest).astype(int).tolist():
            if k1 == k2 == 0:
                continue
            # (k1^2 + k2^2) omega2^2 - 2 k2 k3 omega2 + k3^2 - k1^2 = 0, where omega1 > 0
            inside = k1 * k1 + k2 * k2 - k3 * k3
            for side in (1, -1) if k1 and inside >= 0 else (1,) if k1 == 0 else ():
                root = Decimal(inside if k1 else 0).sqrt()
                w2 = (k2 * k3 + side * k1 * root) / (k1 * k1 + k2 * k2)
                if 0 < w2 and 2 * w2 * w2 < 1 and k1 * (k2 * w2 - k3) >= 0:
                    definite = "definite" if min(k1, k2, k3) >= 0 else "indefinite"
                    order = abs(k1) + abs(k2) + abs(k3)
                    mu = mass(w2 * w2).quantize(SHOWN)
                    found.append(Value(f"({k1}, {k2}, {k3})", f"resonance, {definite}", mu, order))
    return sorted(found, key=lambda value: (value.mu, value.order))


def claims():
    """What Sturm's theorem and exact signs say: [(sentence, does it hold?)]."""
    chain = sturm(ray_resultant())
    low, high = (one(name)[0] for name in ("D4", "a02"))
    [inside] = [zero for zero in zeros(ray_resultant()) if low < zero[0] < high]
    return [
        ("a11^2 - 4 a20 a02 > 0 for all 0 < mu <= mu_R: its numerator has no zero", always(discriminant())),
        ("det N'' (2 x 2, planar) < 0 for all 0 < mu <= mu_R: its numerator has no zero", always(determinant_2())),
        ("D4 and a02 have one zero each, so the sector has 0, 1, 0 rays below, in and above (3.12)",
         all(len(zeros(numerator(name))) == 1 for name in ("D4", "a02"))),
        ("M has one zero on the lines of L = N = 0 between mu_c and mu_d, and it lies on that of alpha1, not in the "
         "octant: M(alpha2, 1, beta2) is never 0 there", count(chain, low, high) == 1
         and abs(on_ray(inside[0], 1)) < abs(on_ray(inside[0], 2)) / 10**20),
    ]  # fmt: skip


def always(a):
    """Has the polynomial no zero in 0 < v <= 1/2 (but those at 0, which are divided out)?"""
    while a[0] == 0:
        a = a[1:]
    return count(sturm(a), Fraction(0), END) == 0


COLUMNS = ("symbol", "mu", "error", "order", "what")
PAGE = """# Critical mass ratios of the triangular libration points

Made by `python workflows/libration_critical.py`; `libration_critical_values.csv` holds the same numbers. Each is a zero
of an integer polynomial in omega2^2, enclosed by an exact change of sign and counted by Sturm's theorem, so that none
is missing in 0 < mu <= mu_R. All digits are right, within {error}. The polynomials come from the closed forms
(`survey/scenes/libration.md`), and are as sure as these are.

## What divides the interval of linear stability

| | mu | |
|---|---|---|
{boundaries}

The intervals of the source's theorem:

| | printed (3.12) | here |
|---|---|---|
{intervals}

L4 and L5 are formally stable in the intervals (3.1). In (3.2), which are {share:.3f} % of the interval of linear
stability, the form M of order 6 does not vanish on the one ray that order 4 leaves open: it is {below:.6f} just above
mu_c, {above:.6f} just below mu_d, and has its only pole at mu2. That proves formal stability but where omega1 and
omega2 are both rational, which no float64 mu makes them (`survey/scenes/libration.md`).

## Certified by exact arithmetic

| | holds |
|---|---|
{claims}

## Determinants, D6, and M on the lines of L = N = 0

| | mu | |
|---|---|---|
{determinants}

M vanishes on these lines outside the octant r >= 0 only, which says nothing against formal stability; there N and M
together do not give steepness.

## Zeros of single coefficients

| | mu | |
|---|---|---|
{coefficients}

The other coefficients have none.

## Resonances k1 omega1 - k2 omega2 + k3 = 0, k3 even, to order 8

| k | mu | order, sign |
|---|---|---|
{resonances}

Odd k3 does not matter: H is even in the coordinate and momentum across the plane. In a definite one k1, k2, k3 >= 0.
"""


def table(values):
    return "\n".join(
        f"| {v.symbol} | {v.mu} | {f'{v.order}, ' * bool(v.order)}{v.what} |" for v in values
    )


def intervals(named):
    """The intervals (3.1) and (3.2), with the ends that (3.12) prints and in full."""
    c, two, d, one_, end = (
        f"{named[name].mu:.15f}" for name in ("mu_c", "mu2", "mu_d", "mu1", "mu_R")
    )
    return [
        "| (3.1) | 0 < mu < 0.010913... | 0 < mu < " + c + " |",
        f"| | 0.016376... < mu < mu1 | {d} < mu < {one_} |",
        f"| | mu1 < mu < mu_R | {one_} < mu < {end} |",
        f"| (3.2) | 0.010913... < mu < 0.013516... | {c} < mu < {two} |",
        f"| | 0.013516... < mu < 0.016376... | {two} < mu < {d} |",
    ]


def page():
    """The page, and all values."""
    first, second, third, fourth = boundaries(), determinants(), coefficients(), resonances()
    named = {v.symbol: v for v in first}
    c, d = float(named["mu_c"].mu), float(named["mu_d"].mu)
    ends = survey.evaluate(
        "libration", mu=[np.nextafter(c, 1), np.nextafter(d, 0)], variables=["M_ray"]
    ).M_ray
    text = PAGE.format(
        error=f"{ERROR:.0e}",
        boundaries=table(first),
        intervals="\n".join(intervals(named)),
        share=100 * (named["mu_d"].mu - named["mu_c"].mu) / named["mu_R"].mu,
        below=float(ends[0]),
        above=float(ends[1]),
        claims="\n".join(
            f"| {sentence} | {'yes' if holds else 'NO'} |" for sentence, holds in claims()
        ),
        determinants=table(second),
        coefficients=table(third),
        resonances=table(fourth),
    )
    return text, first + second + third + fourth


def main():
    folder = parser(__doc__, "the page and its table").parse_args().output
    text, values = page()
    written, listed = (
        folder / "libration_critical_values.md",
        folder / "libration_critical_values.csv",
    )
    written.write_text(text, encoding="utf-8")
    with listed.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(COLUMNS)
        out.writerows((v.symbol, v.mu, ERROR, v.order, v.what) for v in values)
    print(written, listed, sep="\n")


if __name__ == "__main__":
    main()
