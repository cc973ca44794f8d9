"""Systems of no stated structure whose solutions are bounded but do not all decay, by what is exact
in A.

The error bar of a multiplier on the unit circle reaches both sides of it, so that no verdict
follows from it alone. But where, at a point,

- J A is symmetric, as in a Hamiltonian system with states (q, p) (of two states: the trace of A
  is 0), or R A(-t) R = -A(t) with signs R of the states, the multipliers l come with 1 / l: where
  they are certainly on the circle as those of such a system (see `stability`), no solution grows
  and none decays;
- A is antisymmetric: |x| is constant;
- some states have no effect (their columns of A are 0), or are constant (their rows are 0): as many
  multipliers are 1, and where all others are certainly inside the circle every solution is bounded.

Entries are 0, the same or opposite if their operations are, or if their values are and have no
rounding. Source: V. A. Yakubovich, V. M. Starzhinskii, Linear Differential Equations with Periodic
Coefficients (1975), chapters 2 and 3.
"""

import numpy as np

from survey.kernels.floquet import program as pg
from survey.measures.floquet.monodromy import Matrices
from survey.measures.floquet.multipliers import MARGINAL, STABLE, UNDECIDED


def verdicts(points, those, matrices, judge):
    """Verdicts (K) of the SystemPoints `those` from their Matrices: unstable, marginal or undecided.

    The function `judge` takes Matrices and a structure, and returns the verdicts that follow.
    """
    n, found = points.n, np.full(len(those), UNDECIDED)
    antisymmetric, hamiltonian, reversible = np.ones((3, len(those)), dtype=bool)
    columns, rows = np.ones((2, len(those), n), dtype=bool)
    number = points.group_of(those)
    for g in np.unique(number):
        mine, programs = np.flatnonzero(number == g), points.groups[g].programs
        for program in programs:
            entries = Entries(program, points.points[those[mine]])
            antisymmetric[mine] &= entries.antisymmetric(n)
            hamiltonian[mine] &= entries.hamiltonian(n)
            reversible[mine] &= entries.reversible(n) & (len(programs) == 1)
            columns[mine] &= entries.zero(pg.COLUMN, n)
            rows[mine] &= entries.zero(pg.ROW, n)
    found[antisymmetric] = MARGINAL
    for structure, having in (("symplectic", hamiltonian), ("reversible", reversible)):
        own = np.flatnonzero(having & (found == UNDECIDED))
        if own.size:
            as_such = judge(matrices[own], structure)
            found[own] = np.where(as_such == STABLE, MARGINAL, as_such)
    for ones in (columns, rows):
        open_ = ones.any(axis=1) & (found == UNDECIDED)
        for one in np.unique(ones[open_], axis=0):
            own = np.flatnonzero(open_ & (ones == one).all(axis=1))
            inside = one.all() or judge(_without(matrices[own], one), "none") == STABLE
            found[own] = np.where(inside, MARGINAL, UNDECIDED)
    return found


def _without(matrices, ones):
    """The Matrices of the states but for those that have the multiplier 1, `ones` (n)."""
    M, E = (X[:, ~ones][:, :, ~ones] for X in (matrices.M, matrices.E))
    return Matrices.plain(np.ascontiguousarray(M), np.ascontiguousarray(E))


class Entries:
    """What is exact, at points (N, parameters), in the entries of A on a piece of the period."""

    def __init__(self, program, points):
        self.program, self.size = program, len(points)
        self.numbers = self.values, errors = program.numbers(points)
        self.exact = errors == 0.0
        self.terms = {}  # the numbers before each basis function, by row and column
        for basis, i, j, number in program.terms:
            self.terms.setdefault((i, j), {})[basis] = number

    def zero(self, side, n):
        """Which (N, n) columns, or rows, of A are 0: `side` is a column of `program.terms`."""
        found = np.ones((self.size, n), dtype=bool)
        for term in self.program.terms:
            found[:, term[side]] &= self._is_zero(term[pg.NUMBER])
        return found

    def antisymmetric(self, n):
        """Where (N) A_ij = -A_ji."""
        return self._all(((i, j), (j, i), -1) for i in range(n) for j in range(i + 1))

    def hamiltonian(self, n):
        """Where (N) J A is symmetric, the states being (q, p)."""
        if n % 2:
            return np.zeros(self.size, dtype=bool)
        m = n // 2
        pairs = [(i, j) for i in range(m) for j in range(m)]
        return self._all(
            same
            for i, j in pairs
            for same in (
                ((i, m + j), (j, m + i), 1),
                ((m + i, j), (m + j, i), 1),
                ((m + i, m + j), (j, i), -1),
            )
        )

    def reversible(self, n):
        """Where (N) R A(-t) R = -A(t) with signs R."""
        found, zero = np.zeros(self.size, dtype=bool), np.zeros(self.size)
        for own, images, bars in self.program.waves.found(n, self.numbers, zero, zero):
            exact = all((off == 0.0).all() for off in (bars or {}).values())
            found[own] = exact and images.reversal is not None
        return found

    def _all(self, equations):
        """Where (N) all entries are equal, or opposite where the sign is -1: (one, other, sign)."""
        found = np.ones(self.size, dtype=bool)
        for one, other, sign in equations:
            left, right = self.terms.get(one, {}), self.terms.get(other, {})
            for basis in left.keys() | right.keys():
                found &= self._same(left.get(basis), right.get(basis), sign)
        return found

    def _same(self, one, other, sign):
        """Where (N) a number is the other one times the sign; None is 0."""
        if one is None or other is None:
            return self._is_zero(one if other is None else other)
        (own, first), (others, second) = map(self._unsigned, (one, other))
        if first == second and own == sign * others:
            return True
        values = self.values
        return (
            self.exact[:, one] & self.exact[:, other] & (values[:, one] == sign * values[:, other])
        )

    def _is_zero(self, number):
        return self.exact[:, number] & (self.values[:, number] == 0.0)

    def _unsigned(self, number):
        """(sign, number) without factors of -1."""
        sign, numbers = 1, self.program.graph.numbers
        while numbers[number][0] == "multiply":
            one, other = numbers[number][1:]
            if numbers[other] == ("constant", -1.0):
                one, other = other, one
            if numbers[one] != ("constant", -1.0):
                break
            sign, number = -sign, other
        return sign, number
