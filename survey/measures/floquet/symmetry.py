"""Periodic orbits that are their own mirror images under a reversal of time, of autonomous systems:
half of each is enough.

Let R change the sign of half of the states, the odd ones, and f(R x) = -R f(x). An orbit whose odd
states are 0 at t = 0 and half a period later is its own mirror image, and periodic. Such orbits
form families, in which one of the even states at t = 0, `held`, is a parameter; unknown are the
others and T. With X = dx(T/2)/dx(0) and R its signs as a diagonal matrix,

    M = R X^-1 R X,    M + M^-1 = M + R M R = twice the blocks of M of the even and of the odd states,

so that every eigenvalue k of the odd block belongs to a pair of multipliers with l + 1/l = 2 k.
Along the orbit f is odd at t = 0, and an eigenvector of k = 1: that pair, of the phase and of what
is conserved, is not judged. The others are the eigenvalues of the matrix (0 1; -1 2 K), K the odd
block without f.

The `transverse` states, if there are any, are 0 on all orbits, and f does not couple them to the
others there: they have a block of M of their own, which alone is judged.

Sources: M. Henon, Annales d'Astrophysique 28 (1965) 499; J. S. W. Lamb, J. A. G. Roberts, Physica D
112 (1998) 1.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from survey.kernels.math.roundoff import EPS
from survey.measures.floquet import monodromy
from survey.measures.floquet.existence import deflated, product

SHARE = 0.5  # of the period, that is integrated


@dataclass(frozen=True)
class Symmetry:
    """Numbers of the states (of n) that are odd, held and transverse."""

    n: int
    odd: tuple
    held: int
    transverse: tuple = ()

    @cached_property
    def signs(self):
        """The signs of the states in the mirror (n)."""
        return np.where(np.isin(np.arange(self.n), self.odd), -1.0, 1.0)

    @cached_property
    def ends(self):
        """The states that have to be 0 half a period later: the others follow."""
        return np.array([k for k in self.odd if k not in self.transverse], dtype=int)

    @cached_property
    def unknown(self):
        """The states that are unknown at t = 0."""
        given = (*self.odd, *self.transverse, self.held)
        return np.array([k for k in range(self.n) if k not in given], dtype=int)

    @cached_property
    def _given(self):
        return np.setdiff1d(np.arange(self.n), self.unknown)

    @cached_property
    def _rest(self):
        return np.setdiff1d(np.arange(self.n), self.transverse)

    @property
    def judged(self):
        """The number of multipliers that are judged."""
        return len(self.transverse) or self.n - 2

    def started(self, x, guess):
        """The states x (N, n) with those that are known at t = 0 as they are in the guess, or 0."""
        x = x.copy()
        x[:, self._given] = 0.0
        x[:, self.held] = guess[:, self.held]
        return x

    def linearised(self, X, M, f, x, guess):
        """What must vanish (N, n + 1), and its derivatives by (x(0), T), of X = x(T/2), M = dX/dx(0)
        and f there.
        """
        N, n, m = len(x), self.n, len(self.ends)
        value, slope = np.empty((N, n + 1)), np.zeros((N, n + 1, n + 1))
        value[:, :m], value[:, m:] = X[:, self.ends], (x - self.started(x, guess))[:, self._given]
        slope[:, :m, :n], slope[:, :m, n] = M[:, self.ends], SHARE * f[:, self.ends]
        slope[:, np.arange(m, n + 1), self._given] = 1.0
        return value, slope

    def couples(self, A):
        """Are transverse states coupled to others in a matrix A (N, n, n), entries of which are moduli?"""
        if not self.transverse:
            return np.zeros(len(A), bool)
        one, two = np.array(self.transverse), self._rest
        return (A[:, one[:, None], two] != 0.0).any(axis=(1, 2)) | (
            A[:, two[:, None], one] != 0.0
        ).any(axis=(1, 2))

    def block(self, matrices):
        """The rows and columns of matrices (N, n, n) that belong to the states whose motions are judged."""
        own = np.array(self.transverse or range(self.n))
        return np.ascontiguousarray(matrices[:, own[:, None], own])

    def matrices(self, X, E, f, df, own, doubt):
        """M of the period (N, n, n) and bounds, and the Matrices of the multipliers that are
        judged.

        X is known to within E, f at t = 0 to within df (N, n), and the `block` of X, `own`, to
        within `doubt`.
        """
        Y, dY = _inverse(X, E)
        R = self.signs
        mirrored = R[:, None] * Y * R
        M = product(mirrored, X)
        bounds = (
            product(abs(Y), E) + product(dY, abs(X) + E) + self.n * EPS * product(abs(Y), abs(X))
        )
        K, dK = self._odd_block(own, doubt)
        if not self.transverse:
            odd = np.array(self.odd)
            K, dK = deflated(K, dK, f[:, odd], df[:, odd])
        N, m = K.shape[:2]
        judged, doubt = np.zeros((2, N, 2 * m, 2 * m))
        judged[:, :m, m:], judged[:, m:, :m] = np.eye(m), -np.eye(m)
        judged[:, m:, m:], doubt[:, m:, m:] = 2.0 * K, 2.0 * dK
        return M, bounds, monodromy.Matrices.plain(judged, doubt)

    def _odd_block(self, X, E):
        """That of M and its bounds, from the `block` X of dx(T/2)/dx(0) that is known to within E.

        With X^-1 = Y it is 2 Y_oo X_oo - 1 and 1 - 2 Y_oe X_eo, o odd, e even: the better one of
        them is taken.
        """
        Y, dY = _inverse(X, E)
        is_odd = self.signs[np.array(self.transverse or range(self.n))] < 0
        odd, even = np.flatnonzero(is_odd)[:, None], np.flatnonzero(~is_odd)[:, None]
        found = []
        for middle, sign in ((odd, 1.0), (even, -1.0)):
            y, x, dy, dx = (
                Y[:, odd, middle.T],
                X[:, middle, odd.T],
                dY[:, odd, middle.T],
                E[:, middle, odd.T],
            )
            value = sign * (2.0 * product(y, x) - np.eye(len(odd)))
            size = product(abs(y), abs(x))
            bar = (
                2.0 * (product(abs(y), dx) + product(dy, abs(x) + dx))
                + 2 * (self.n + 2) * EPS * size
            )
            found.append((value, bar + 2 * EPS * abs(value) + 2 * EPS * np.eye(len(odd))))
        (one, bar), (other, other_bar) = found
        better = other_bar < bar
        return np.where(better, other, one), np.where(better, other_bar, bar)


def _inverse(X, E):
    """The inverses of matrices that are known to within E, and bounds (infinite where there are
    none).

    With Q = |1 - Y X| + |Y| E, |X^-1 - Y| <= (Q + Q^2 + ...) |Y|.
    """
    n = X.shape[1]
    Y = monodromy.inverse(X)
    with np.errstate(all="ignore"):
        size = abs(Y)
        Q = (
            abs(product(Y, X) - np.eye(n))
            + product(size, E)
            + (n + 2) * EPS * (product(size, abs(X)) + np.eye(n))
        )
        q = Q.sum(axis=2).max(axis=1)[:, None, None]
        tail = q / (1.0 - q) * size.max(axis=1, keepdims=True)
        bounds = product(Q, size + tail) * (1 + 2 * n * EPS)
        return Y, np.where(q < 0.9, bounds, np.inf)
