"""That a symmetric periodic orbit exists near a computed one, by multiple shooting; its bounds and
its multipliers.

As in `existence`, X(t) is the Taylor series of all steps along half of the orbit (see `symmetry`).
Here the states at the beginnings of shots, of some steps each, are unknown, beside the time: with
F_k the propagators of the shots, and G the inverse of the linear equations x_k+1 = F_k x_k with
their conditions at both ends, a box of deviations is mapped into itself if

    |G| (defects of X + what F_k does not tell of deviations in the box) <= the box,

and so holds an orbit (Brouwer; Krawczyk). Errors travel no farther than a shot before G, which
bounds the deviations at all times, carries them: a growth by thousands over the period counts as
little as it matters. `existence`, whose series and bounds are used, says which of these
bounds are not strict.

Sources: R. Krawczyk, Computing 4 (1969) 187; H. B. Keller, Numerical Methods for Two-Point
Boundary-Value Problems (1968), 2.
"""

import numpy as np

from survey.kernels.floquet.flow import spread
from survey.kernels.floquet.shooting import responses
from survey.kernels.floquet.steps import products
from survey.kernels.math.roundoff import EPS
from survey.measures.floquet.existence import (
    RADII,
    SAMPLED,
    WIDER,
    OrbitSteps,
    ShownOrbits,
    product,
)
from survey.measures.floquet.newton import inverse

SHOT = 0.5  # the logarithm of how much deviations may grow in a shot of several steps
SURE = 1e-2  # of 1 - B W, in the maximum norm


def certified(programs, numbers, x, T, guess, plane, counts, method, reach, symmetry):
    """As `existence.certified`: ShownOrbits, of symmetric orbits near x (N, n), half of whose period is
    near T (N).
    """
    with np.errstate(all="ignore"):
        path = OrbitSteps(programs, numbers, x, T, counts, reach)
        path.propagate(method)
        half = _Half(path, x, T, symmetry)
        shown = half.certify(RADII[0])
        for factor in RADII[1:]:
            if not shown.good.all():
                shown.improve(half.certify(factor))
        return shown


class _Half:
    """Half orbits along OrbitSteps, in the units that balance A."""

    def __init__(self, path, x, T, symmetry):
        self.path, self.x, self.T, self.symmetry = path, x, T, symmetry
        s, point = path.scale, path.point
        N, n = x.shape
        ends, unknown = symmetry.ends, symmetry.unknown
        # a defect early in a step grows until its end
        delta = path.defect / s[point]
        self.delta = delta + np.expm1(path.h * path.norm)[:, None] * delta.max(
            axis=1, keepdims=True
        )
        self.delta[:, list(symmetry.transverse)] = 0.0
        self._cut()
        M, E, R = np.empty((3, N, n, n))
        products(path.F, path.error, path.doubt, path.first, n, M, E, R)
        self.f_end = path.f_end / s
        self.fastest = abs(self.f_end).max(axis=1)
        self.unit = 1.0 / self.fastest  # of T
        W = np.concatenate(
            [M[:, ends[:, None], unknown], (self.f_end * self.unit[:, None])[:, ends, None]], axis=2
        )
        B = inverse(W)
        m = len(ends)
        off = abs(product(B, W) - np.eye(m)) + (m + 4) * EPS * product(abs(B), abs(W))
        off = off + product(
            abs(B), np.concatenate([R[:, ends[:, None], unknown], np.zeros((N, m, 1))], axis=2)
        )
        self.lost = off.sum(axis=2).max(axis=1)
        self.back = np.zeros((N, n + 1, m))
        self.back[:, unknown], self.back[:, n] = B[:, :-1], B[:, -1]
        self.missed = abs(path.end / s)[:, ends] * (1 + EPS)
        self.dT = 4 * EPS * T

    def _cut(self):
        """Join steps to shots: `cuts`, their first steps, `first`, the orbits' first shots, and
        their propagators.
        """
        path = self.path
        n = self.path.n
        growth = path.h * path.norm
        before = np.cumsum(growth) - growth
        number = np.floor((before - before[path.first[:-1]][path.point]) / SHOT)
        begins = np.ones(number.size, bool)
        begins[1:] = (number[1:] != number[:-1]) | (path.point[1:] != path.point[:-1])
        self.cuts = np.append(np.flatnonzero(begins), number.size)
        self.shot = np.cumsum(begins) - 1
        self.first = np.searchsorted(self.cuts, path.first)
        self.F, E, R = np.empty((3, self.cuts.size - 1, n, n))
        products(path.F, path.error, path.doubt, self.cuts, n, self.F, E, R)
        self.rounding = R.sum(axis=2)

    def _responses(self, delta, at_end, around):
        """Bounds of the deviations at the steps' beginnings and at the end, and of the time, from
        their sources.

        `around` bounds the deviations at the shots' beginnings for what rounds the shots'
        propagators.
        """
        path, N, last_steps = self.path, len(self.x), self.cuts[1:] - 1
        wide, off = np.empty((2, *delta.shape))
        spread(path.F, np.ascontiguousarray(delta), self.cuts, wide, off)
        states = np.empty((len(self.F), path.n))
        last = np.empty_like(self.x)
        time_bar = np.empty(N)
        own = off[last_steps] + self.rounding * around[:, None]
        responses(
            self.F, own, self.first, self.back, self.symmetry.ends, at_end, states, last, time_bar
        )
        more = np.where(self.lost < SURE, 1.0 + 2.0 * self.lost, np.inf)
        states = states * more[path.point[self.cuts[:-1]], None]
        begins = np.empty(delta.shape)
        begins[1:] = wide[:-1] * states[self.shot[1:]].max(axis=1, keepdims=True) + off[:-1]
        begins[self.cuts[:-1]] = states
        begins[:, list(self.symmetry.transverse)] = 0.0
        return begins, last * more[:, None], time_bar * more

    def certify(self, factor):
        """ShownOrbits, of the orbits in a box `factor` times as wide as the linear equations tell."""
        path, symmetry, s, point = self.path, self.symmetry, self.path.scale, self.path.point
        transverse = list(symmetry.transverse)
        a_end = path.norm[path.last]
        at_end = self.missed + (self.dT * self.fastest)[:, None]
        first = self._responses(self.delta, at_end, np.zeros(len(self.F)))
        states, last, time_bar = (factor * one for one in first)
        shift = self.dT + time_bar * self.unit
        begins = states.max(axis=1)
        tube = WIDER * (np.exp(path.h * path.norm) * begins + self.delta.max(axis=1))
        width = path.noise_X + (tube[:, None] * s[point])[:, :, None]
        width[:, transverse] = 0.0
        noise = WIDER * SAMPLED * path.rows_of(path.along(path.programs.A, width)[1])
        error = path.error + path.h * noise * np.exp(path.h * (path.norm + noise))
        doubt = path.doubt * (error / path.error)
        second = np.repeat((error * begins)[:, None], self.x.shape[1], axis=1)
        second[:, transverse] = 0.0
        moved = (
            shift * a_end * WIDER * (last.max(axis=1) + shift * self.fastest)
            + shift * 4 * EPS * self.fastest
        )
        states_2, last_2, time_bar_2 = self._responses(
            self.delta + second, at_end + moved[:, None], begins[self.cuts[:-1]]
        )
        inside = (states_2 <= states).all(axis=1)
        good = (
            np.logical_and.reduceat(inside, path.first[:-1])
            & (last_2 <= last).all(axis=1)
            & (time_bar_2 <= time_bar)
        )
        good &= ~symmetry.couples(path.largest)
        return self._shown(
            good, states_2[path.first[:-1]], self.dT + time_bar_2 * self.unit, error, doubt, a_end
        )

    def _shown(self, good, start, dT, error, doubt, a_end):
        path, symmetry, s = self.path, self.symmetry, self.path.scale
        N, n = self.x.shape
        x, unknown = self.x, symmetry.unknown
        dx = np.zeros((N, n))
        dx[:, unknown] = (start * s)[:, unknown] * (1 + 8 * EPS) + EPS * abs(x[:, unknown])
        f, df = path.programs.slopes(path.own, np.zeros(N), x, dx)
        f, df = f / s, (WIDER * df + 8 * EPS * abs(f)) / s
        time_bar = WIDER * dT * a_end
        M, E = self._product(path.F, error, doubt, time_bar)
        own = (
            (M, E)
            if not symmetry.transverse
            else self._product(symmetry.block(path.F), error, doubt, time_bar)
        )
        good = good & np.isfinite(E).all(axis=(1, 2))
        M, E, others = symmetry.matrices(M, E, f, df, *own)
        back = s[:, :, None] / s[:, None, :]
        return ShownOrbits(
            good, x, dx, 2.0 * self.T, 2.0 * dT, M * back, E * back, path.square, others
        )

    def _product(self, F, error, doubt, time_bar):
        """dx(T/2)/dx(0) and its bounds, the shift of its end within `time_bar` included."""
        M, E, R = np.empty((3, len(time_bar), *F.shape[1:]))
        products(F, error, doubt, self.path.first, F.shape[1], M, E, R)
        return M, E + time_bar[:, None, None] * (abs(M) + E).max(axis=1, keepdims=True)
