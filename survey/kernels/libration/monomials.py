"""Index tables of real polynomials in z1, z2, z3 and their conjugates, even in the third pair.

A monomial is z^a zbar^b; its harmonic is k = b - a. Of each pair of conjugates (k and -k) a polynomial keeps one
coefficient, that of the representative, whose first k_j != 0 is positive; k = 0 is its own conjugate. Representatives
are sorted by |k_1| + |k_2| + |k_3|, so that those up to a cutoff, the diagonal ones first, are the leading rows.

The tables are numpy arrays, made once; kernels take them as they are.
"""

from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np

BASE = 64  # exponents are digits of a key
# Rows of a table of terms: row of the product, row of f, index of g, C, sign of f.
OUT, LEFT, RIGHT, NUMBER, SIGN = range(5)


@dataclass(frozen=True)
class Monomials:
    """All monomials of one degree: exponents (n, 6), harmonic (n, 3), representative's row, sign -1
    if conjugate.
    """

    exponents: np.ndarray
    harmonic: np.ndarray
    row: np.ndarray
    sign: np.ndarray
    keys: np.ndarray  # sorted

    def rows(self, cutoff):
        """How many representatives have |k| <= cutoff."""
        return int(((self.sign > 0) & (norm(self.harmonic) <= cutoff)).sum())

    def find(self, exponents):
        """Indices of `exponents` (n, 6), which are of this degree."""
        return np.searchsorted(self.keys, key(exponents))


def key(exponents):
    return exponents @ BASE ** np.arange(6)[::-1]


def norm(harmonic):
    return np.abs(harmonic).sum(axis=-1)


@cache
def monomials(degree, planar=False):
    """The `Monomials` of a degree; `planar`: without the third pair."""
    pairs = 2 if planar else 3
    found = [e for e in product(range(degree + 1), repeat=2 * pairs - 1) if sum(e) <= degree]
    full = np.array([(*e, degree - sum(e)) for e in found], dtype=np.int64).reshape(-1, 2 * pairs)
    exponents = np.zeros((len(full), 6), np.int64)
    exponents[:, :pairs], exponents[:, 3 : 3 + pairs] = full[:, :pairs], full[:, pairs:]
    exponents = exponents[(exponents[:, 2] + exponents[:, 5]) % 2 == 0]
    exponents = exponents[np.argsort(key(exponents))]
    harmonic = exponents[:, 3:] - exponents[:, :3]
    first = np.take_along_axis(harmonic, np.argmax(harmonic != 0, axis=1)[:, None], axis=1)[:, 0]
    # diagonal monomials in the order 200, 110, 020, 101, ...: powers of r3, then of r2, ascending
    rank = np.lexsort((exponents[:, 4], exponents[:, 5], *(-harmonic.T), norm(harmonic)))
    rank = rank[first[rank] >= 0]
    row = np.empty(len(exponents), np.int64)
    row[rank] = np.arange(len(rank))
    keys = key(exponents)
    partner = np.searchsorted(keys, key(np.roll(exponents, 3, axis=1)))
    row = np.where(first >= 0, row, row[partner])
    return Monomials(exponents, harmonic, row, np.where(first >= 0, 1, -1), keys)


@cache
def products(degree, factor, planar=True):
    """Terms (OUT to SIGN, T) of the product of polynomials of two degrees; f, out are
    representatives' rows, g is an index among all monomials: out += C f g, where f is conjugated if
    its sign is -1."""
    f, g = monomials(degree, planar), monomials(factor, planar)
    together = f.exponents[:, None] + g.exponents[None]
    return _terms(
        monomials(degree + factor, planar), f, together, np.ones(together.shape[:2], np.int64)
    )


@cache
def brackets(degree, factor):
    """As `products`: terms of the Poisson bracket {f, i g} = -sum over j of f_zj g_zbarj - f_zbarj
    g_zj.

    {z_j, zbar_j} = i. Of g only the monomials with k != 0 are used.
    """
    f, g = monomials(degree), monomials(factor)
    parts = []
    for j in range(3):
        a, b = f.exponents[:, None, j], f.exponents[:, None, 3 + j]
        c, d = g.exponents[None, :, j], g.exponents[None, :, 3 + j]
        together = f.exponents[:, None] + g.exponents[None]
        together[..., [j, 3 + j]] -= 1
        number = (b * c - a * d) * (norm(g.harmonic) > 0)
        parts.append(_terms(monomials(degree + factor - 2), f, together, number))
    terms = np.concatenate(parts, axis=1)
    return terms[:, np.lexsort((terms[RIGHT], terms[LEFT], terms[OUT]))]


def _terms(out, f, exponents, number):
    """OUT to SIGN of the pairs with number != 0 whose product is a representative."""
    i, j = np.nonzero(number)
    index = out.find(exponents[i, j])
    kept = out.sign[index] > 0
    i, j, index = i[kept], j[kept], index[kept]
    terms = np.stack([out.row[index], f.row[i], j, number[i, j], f.sign[i]])
    return terms[:, np.argsort(terms[OUT], kind="stable")]
