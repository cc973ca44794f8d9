"""Which products and brackets bring a Hamiltonian at L4 to Birkhoff's normal form: made once for an
order, in numpy.

Lie transforms by chi_3, chi_4, ... in turn. With F_d the terms of degree d so far, {H2, chi_s} + (off-diagonal part of
F_s) = 0 and F_d becomes the sum over n of ad^n F_{d - n (s - 2)} / n!, ad f = {f, chi_s}; the terms in H2 join those of
F_s: coefficient 1/n! - 1/(n + 1)!. Sums are nested (Horner), the lowest degree innermost. A diagonal coefficient sees
few of the terms before: of {f, chi_s} up to |k| <= c only f up to |k| <= c + s counts, and the normal form of degree
2 m needs no generator beyond chi_{m + 1}.

Sources: A. Deprit, Cel. Mech. 1 (1969) 12; A. J. Dragt, J. M. Finn, J. Math. Phys. 17 (1976) 2215.
"""

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from math import comb, factorial, isqrt, sqrt
from typing import NamedTuple

import numpy as np

from survey.kernels.libration.monomials import OUT, RIGHT, brackets, monomials, norm, products

CLEAR, MULTIPLY, LINEAR, FINISH, DIVIDE, MEASURE = range(6)
# A line of the code: the operation; rows of target, source and factor; first and last of the terms.
OPERATION, TARGET, SOURCE, FACTOR, FIRST, LAST = range(6)
# A term, in `indices`: rows of the target, of f and of g, past those of its line; of a quotient BY is
# the divisor; of a norm the three are |k_1|, |k_2|, |k_3|.
TO, FROM, BY = range(3)
# In `numbers`: its factor, and the sign that says whether f is conjugated; of a multiple, what the
# factor lacks.
NUMBER, SIGN = range(2)
LACK = SIGN
# What the kernel fills of a coefficient, and of a norm.
REAL, IMAGINARY, COEFFICIENT_BAR = range(3)
NORM, NORM_BAR = range(2)
# the rows set before the first operation, and the first other one
XI, ETA, DELTA, ONE, WORK = 0, 4, 8, 9, 10
NONE = -1
SQRT_3 = Fraction(isqrt(3 * 10**80), 10**40)  # 40 digits


class Plan(NamedTuple):
    """What the kernel runs: arrays."""

    code: np.ndarray  # lines (n, OPERATION to LAST)
    indices: np.ndarray  # (3, T) of the terms: TO, FROM, BY
    numbers: np.ndarray  # (2, T) of the terms: NUMBER, SIGN
    harmonics: np.ndarray  # (m, 3) of the divisors
    diagonal: np.ndarray  # rows of the normal form's coefficients
    rows: int
    measured: list  # (stage, degree) of the norms


@dataclass
class Draft:
    """A plan in the making."""

    rows: int = WORK
    code: list = field(default_factory=list)
    indices: list = field(default_factory=list)
    numbers: list = field(default_factory=list)
    terms: int = 0
    divisors: np.ndarray | None = None
    measured: list = field(default_factory=list)
    kept: dict = field(default_factory=dict)

    def allocate(self, count):
        self.rows += count
        return self.rows - count

    def hold(self, indices, numbers, name=None):
        """First and last of these terms, which are kept once under their name."""
        if name is None or name not in self.kept:
            first, self.terms = self.terms, self.terms + len(indices[0])
            self.indices.append(np.array(indices, np.int64).reshape(3, -1))
            self.numbers.append(np.array(numbers, float).reshape(2, -1))
            self.kept[name] = first
        first = self.kept[name]
        return first, first + len(indices[0])

    def add(self, operation, target=0, source=0, factor=0, first=0, last=0):
        """A line of the code, OPERATION to LAST."""
        self.code.append((operation, target, source, factor, first, last))

    def multiply(self, name, terms, rows, target, source, factor):
        """target += the terms' sum, for the first `rows` rows of the target."""
        first, _last = self.hold(terms[: RIGHT + 1], terms[RIGHT + 1 :], name)
        self.add(
            MULTIPLY, target, source, factor, first, first + int(np.searchsorted(terms[OUT], rows))
        )

    def linear(self, target, source, start, stop, number):
        """Rows start to stop of the target += number times those of the source."""
        if stop > start and number != 0.0:
            at = np.arange(start, stop)
            zero = np.zeros(len(at))
            pair = zero + float(number), zero + float(number - Fraction(float(number)))
            first, last = self.hold((target + at, source + at, zero), pair)
            self.add(LINEAR, 0, 0, 0, first, last)

    def plan(self, diagonal):
        indices, numbers = (np.concatenate(part, axis=1) for part in (self.indices, self.numbers))
        code, harmonics = np.array(self.code, np.int64), self.divisors.astype(float)
        return Plan(
            code, indices.astype(np.uint64), numbers, harmonics, diagonal, self.rows, self.measured
        )


def chain(stage, degree):
    """(degree j, n) of the terms ad^n F_j / n! of F_degree that are not zero, n >= 1, ascending in n."""
    step = stage - 2
    found = [(degree - n * step, n) for n in range(1, degree) if degree - n * step > 2]
    return [(j, n) for j, n in found if j >= stage or j % 2 == 0]


@cache
def cutoffs(order, remainders=False):
    """{stage: {degree: |k| up to which its terms are needed after that stage}}, NONE where they are not."""
    last = order if remainders else order // 2 + 1
    top = order + remainders
    need = {last: {d: 0 if d % 2 == 0 else NONE for d in range(3, top + 1)}}
    for stage in range(last, 2, -1):
        if remainders:
            need[stage] = {d: d if d > stage else need[stage][d] for d in need[stage]}
        before = dict(need[stage])
        before[stage] = stage
        for degree in range(stage + 1, top + 1):
            limit = need[stage][degree]
            for j, n in sources(stage, degree, limit):
                before[j] = max(before[j], min(j, limit + n * stage))
        need[stage - 1] = before
    return need


def sources(stage, degree, limit):
    """The part of the chain that reaches terms up to |k| <= limit; none where only {K_j, chi} does
    and limit is 0.
    """
    links = [] if limit == NONE else chain(stage, degree)
    return [] if limit == 0 and links and links[0][0] < stage else links


@cache
def plan(order, remainders=False):
    """The `Plan` for the normal form of degrees 4, 6, ..., `order`.

    With `remainders` all terms up to degree order + 1 are kept through all stages, and their norms
    measured.
    """
    if order < 4 or order % 2:
        raise ValueError("the order of a normal form is even, and at least 4")
    need, out = cutoffs(order, remainders), Draft()
    top, last = order + remainders, max(need)
    F = {d: out.allocate(rows(d, need[2][d])) for d in range(3, top + 1)}
    expand(out, F, need[2])
    harmonics = np.concatenate(
        [monomials(s).harmonic[monomials(s).sign > 0] for s in range(3, last + 1)]
    )
    out.divisors = np.unique(harmonics[norm(harmonics) > 0], axis=0)
    chi = out.allocate(max(len(monomials(s).keys) for s in range(3, last + 1)))
    parts = [out.allocate(max(rows(d, need[2][d]) for d in range(3, top + 1))) for _ in range(2)]
    measure(out, 2, top, F, remainders)
    for stage in range(3, last + 1):
        divide(out, stage, chi, F[stage])
        for degree in range(top, stage, -1):
            transform(out, stage, degree, need[stage][degree], F, chi, parts)
        measure(out, stage, top, F, remainders)
    return out.plan(np.concatenate([F[d] + np.arange(rows(d, 0)) for d in range(4, order + 1, 2)]))


def solved(normal_forms, mu, order, remainders=False):
    """What a kernel like `lie.normal_forms` gives at mu (N): values (3, M, N), {(stage, degree):
    norms (2, 3, N)}.
    """
    what, mu = plan(order, remainders), np.ascontiguousarray(mu, dtype=float)
    values = np.empty((3, len(what.diagonal), mu.size))
    norms = np.empty((len(what.measured), 2, 3, mu.size))
    normal_forms(*what[:6], mu, values, norms)
    return values, dict(zip(what.measured, norms, strict=True))


def rows(degree, cutoff):
    return 0 if cutoff == NONE else monomials(degree).rows(cutoff)


def divide(out, stage, chi, source):
    """chi / i = F / (Omega . k), for all monomials with k != 0."""
    m = monomials(stage)
    indices = np.flatnonzero(norm(m.harmonic) > 0)
    own = m.harmonic[indices] * m.sign[indices, None]
    at = (out.divisors[None] == own[:, None]).all(axis=2).argmax(axis=1)
    first, last = out.hold((indices, m.row[indices], at), (m.sign[indices], m.sign[indices]))
    out.add(DIVIDE, chi, source, 0, first, last)


def transform(out, stage, degree, limit, F, chi, parts):
    """F_degree of the next stage from those of this one, in place, up to |k| <= limit."""
    links, at = sources(stage, degree, limit), None
    for j, n in reversed(links):
        count, diagonal = rows(j, min(j, limit + n * stage)), rows(j, 0)
        target = parts[n % 2]
        out.add(CLEAR, target, 0, 0, 0, count)
        share = Fraction(1, factorial(n))
        if j > stage:
            out.linear(target, F[j], 0, count, share)
        else:  # below and at the stage the diagonal is the normal form's
            out.linear(target, F[j], 0, diagonal, share if j % 2 == 0 else 0)
        if j == stage:
            out.linear(target, F[j], diagonal, count, share - Fraction(1, factorial(n + 1)))
        if at is not None:
            bracket(out, at[0], stage, count, target, at[1], chi)
        out.add(FINISH, target, 0, 0, 0, count)
        at = j, target
    if at is not None:
        count = rows(degree, limit)
        bracket(out, at[0], stage, count, F[degree], at[1], chi)
        out.add(FINISH, F[degree], 0, 0, 0, count)


def bracket(out, degree, stage, count, target, source, chi):
    out.multiply((degree, stage), brackets(degree, stage), count, target, source, chi)


def measure(out, stage, top, F, wanted):
    """Sums over the off-diagonal terms of |k_j| |F|, for every degree beyond the stage."""
    for degree in range(stage + 1, top + 1) if wanted else ():
        m = monomials(degree)
        at = np.argsort(m.row + len(m.row) * (m.sign < 0))[: m.rows(degree)]
        k = np.abs(m.harmonic[at])
        first, last = out.hold((k[:, 0], k[:, 1], k[:, 2]), np.zeros((2, len(k))), ("norm", degree))
        out.add(MEASURE, len(out.measured), F[degree], 0, first, last)
        out.measured.append((stage, degree))


def expand(out, F, cut):
    """F_n, n >= 3, the Taylor expansion at L4, from products xi^i eta^j of the linear forms, degree
    by degree.
    """
    top = max(F)
    width = [max([min(m, cut[n]) for n in range(max(m, 3), top + 1) if (n - m) % 2 == 0], default=NONE)
             for m in range(top + 1)]  # fmt: skip
    for m in range(top - 1, -1, -1):
        width[m] = max(width[m], min(m, width[m + 1] + 1))
    count = [monomials(m, True).rows(width[m]) for m in range(top + 1)]
    size = max(count)
    # xi^i eta^(m - i), delta in odd i
    powers = [[out.allocate(size) for _ in range(top + 1)] for _ in range(2)]
    pure = [ONE, *[out.allocate(size) for _ in range(2)]]  # xi^m
    for n in F:
        out.add(CLEAR, F[n], 0, 0, 0, rows(n, cut[n]))
    before, xi = [ONE], ONE
    for m in range(top + 1):
        if m > 0:
            before, xi = _next(out, m, count[m], before, xi, powers[m % 2], pure[1 + m % 2])
        for n in range(max(m, 3), top + 1):
            if (n - m) % 2 == 0:
                _collect(out, n, m, F[n], rows(n, cut[n]), before)
    for n in F:
        out.add(FINISH, F[n], 0, 0, 0, rows(n, cut[n]))


def _next(out, m, count, before, xi, targets, pure):
    """The products of degree m, as rows by i = 0, ..., m, and xi^m."""
    terms = products(m - 1, 1)
    for i in range(m):
        _product(out, (m, "p"), terms, count, targets[i], before[i], ETA)
    _product(out, (m, "p"), terms, count, pure, xi, XI)
    if m % 2 == 0:
        return [*targets[:m], pure], pure
    _product(out, (m, "delta"), products(m, 0), count, targets[m], pure, DELTA)
    return targets[: m + 1], pure


def _product(out, name, terms, count, target, source, factor):
    out.add(CLEAR, target, 0, 0, 0, count)
    out.multiply(name, terms, count, target, source, factor)
    out.add(FINISH, target, 0, 0, 0, count)


def _collect(out, n, m, target, count, powers):
    """F_n += its terms in zeta^(n - m), with zeta = (z3 + zbar3) / sqrt 2."""
    basis, planar, half = monomials(n), monomials(m, True), (n - m) // 2
    full = basis.exponents[(basis.sign > 0) & (basis.row < count)]
    at = basis.row[(basis.sign > 0) & (basis.row < count)]
    chosen = full[:, 2] + full[:, 5] == n - m
    full, at = full[chosen], at[chosen]
    flat = full.copy()
    flat[:, [2, 5]] = 0
    row = planar.row[planar.find(flat)]
    spread = np.array([comb(2 * half, int(p)) for p in full[:, 2]]) / 2.0**half
    for i in range(m + 1):
        rational, root = potential(n, i, m - i)
        if rational != 0 and len(at):
            number = float(rational) * (sqrt(3.0) if root else 1.0) * spread
            exact = rational * (SQRT_3 if root else 1)
            low = [
                float(exact * Fraction(share) - Fraction(high))
                for share, high in zip(spread, number, strict=True)
            ]
            first, last = out.hold((target + at, powers[i] + row, np.zeros(len(at))), (number, low))
            out.add(LINEAR, 0, 0, 0, first, last)


@cache
def potential(n, i, j):
    """Coefficient of xi^i eta^j zeta^(n - i - j) in H_n, n >= 3, without the factor delta = 1 - 2
    mu of odd i.

    A rational number, and whether sqrt(3) is to multiply it.

    H_n = -(-1)^n [(1 - mu) R_n(s) + mu R_n(s')], s = xi/2 + sqrt(3) eta/2, s' = s with -xi, R_n = |q|^n P_n(s/|q|).
    """
    total = Fraction(0)
    for t in range(n // 2 + 1):
        legendre = Fraction(
            (-1) ** t * factorial(2 * n - 2 * t),
            2**n * factorial(t) * factorial(n - t) * factorial(n - 2 * t),
        )
        for a in range(t + 1):  # xi^(2 a) eta^(2 b) zeta^(2 c) of |q|^(2 t)
            b, c = (j - (n - 2 * t - (i - 2 * a))), (n - i - j) // 2
            if i < 2 * a or b < 0 or b % 2 or a + b // 2 + c != t or n - 2 * t < i - 2 * a:
                continue
            b //= 2
            # of eta in s^(n - 2 t); its sqrt 3 come in pairs but for one
            power = n - 2 * t - (i - 2 * a)
            spread = Fraction(factorial(t), factorial(a) * factorial(b) * factorial(c))
            total += (
                legendre
                * spread
                * comb(n - 2 * t, power)
                * Fraction(3 ** (power // 2), 2 ** (n - 2 * t))
            )
    return -((-1) ** n) * total, j % 2 == 1
