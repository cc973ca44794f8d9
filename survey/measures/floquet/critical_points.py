"""Orbits with a multiplier on the unit circle: Newton's method, and that they exist; see
`critical`.

With y = (x, v, ...) of `critical` and G(y) the differences of y(1) and y(0), and what its linear conditions leave, such
an orbit is a simple zero of G. If |1 - B G'| <= q < 1 for all y of a ball about the computed one, B nearly the inverse
of G', and |B G| <= (1 - q) r there, r the ball's radius, it exists, and is alone in the ball (Krawczyk). Its distance
from the computed one is at most |B G| + |1 - B G'| r in each component, those of the parameters
among them. `existence`, whose series and bounds are used, says which of these bounds are not
strict.
"""

from dataclasses import dataclass

import numpy as np

from survey.kernels.floquet.steps import products
from survey.kernels.math.roundoff import EPS, ROUNDOFF
from survey.measures.floquet import existence, monodromy
from survey.measures.floquet.continuation import floored
from survey.measures.floquet.critical import Critical
from survey.measures.floquet.multipliers import NEIMARK_SACKER
from survey.measures.floquet.newton import ROUGH, ROUGH_REACH, ROUGHLY, applied, inverse

RTOL = 1e-13
TRIALS, CONVERGED, FIRST, CONTRACTION = 12, 1e-9, 0.5, 0.7  # relative: the last step, and the first
CHUNK = 64  # orbits that are shown to exist together


@dataclass
class ShownCritical:
    """Which orbits exist; bounds of their y; their M by x(0) alone, with bounds, and f at x(0),
    with bounds.
    """

    good: np.ndarray
    dy: np.ndarray
    M: np.ndarray
    dM: np.ndarray
    f: np.ndarray
    df: np.ndarray


@dataclass(frozen=True)
class CriticalPoints:
    """The orbits of one `critical` equation; `given`: all parameters. The varied ones change by `scale`,
    relative if `log`.
    """

    critical: Critical
    given: np.ndarray
    scale: np.ndarray
    log: np.ndarray

    @property
    def method(self):
        """The method by whose propagators bounds are made."""
        return monodromy.method_of("auto")

    @property
    def reach(self):
        """That of the Taylor series."""
        return self.method.floquet_reach(RTOL)

    def parameters(self, y):
        """All parameters (N, parameters) at y (N, size)."""
        return self.critical.points(np.tile(self.given, (len(y), 1)), y)

    def flow(self, y, derived=True, reach=ROUGH_REACH, tolerance=ROUGH):
        """y(1) from y(0) = y (N, size), its derivatives, the largest moduli; NaN where there is none."""
        (N, n), points = y.shape, self.parameters(y)
        X = np.full((N, n), np.nan)
        M = np.full((N * derived, n, n), np.nan)
        size = np.full((N, n), np.nan)
        usable = np.flatnonzero(np.isfinite(y).all(axis=1))
        for inside, programs in self.critical.traced(points[usable], y[usable]):
            own = usable[inside]
            span = np.ones(own.size)
            X[own], found, size[own], _steps = programs.flow(
                programs.numbers(points[own]), y[own], span, reach, derived, tolerance=tolerance
            )
            if derived:
                M[own] = found
        return X, M, size

    def slopes(self, y):
        """x' (N, n) at t = 0."""
        points = self.parameters(y)
        found = np.full((len(y), self.critical.n), np.nan)
        for own, programs in self.critical.traced(points, y):
            found[own] = programs.slopes(programs.numbers(points[own]), np.zeros(own.size), y[own])[
                0
            ][:, : found.shape[1]]
        return found

    def linearised(self, y, **how):
        """y(1) - y(0) with signs, of what is not constant (N, m), its derivatives (N, m, size), and
        sizes of y.
        """
        m, signs = self.critical.moving, self.critical.signs
        X, M, moduli = self.flow(y, **how)
        value = signs * X[:, :m] - y[:, :m]
        slope = signs[:, None] * M[:, :m]
        slope[:, np.arange(m), np.arange(m)] -= 1.0
        slope[~np.isfinite(value).all(axis=1)] = np.nan
        return value, slope, self._sizes(y, moduli)

    def _sizes(self, y, moduli):
        """What lengths are relative to (N, size)."""
        own = self.critical
        n = self.critical.n
        size = np.ones_like(y)
        parts = [(0, n), (n, own.moving)]
        for low, high in parts:
            size[:, low:high] = floored(moduli[:, low:high])
        if own.free:
            size[:, own.period_at] = abs(y[:, own.period_at])
        if own.drifts:
            x, v = (floored(moduli[:, low:high]).max(axis=1) for low, high in parts)
            size[:, own.angle_at] = v / x * abs(y[:, own.period_at])
        size[:, own.parameters_at :] = self.scale * np.where(
            self.log, abs(y[:, own.parameters_at :]), 1.0
        )
        return size

    def conditions(self, y):
        """Rows (N, k, size) and values (N, k) of the linear conditions but for those on parameters,
        about y.
        """
        own = self.critical
        n = self.critical.n
        v, w = y[:, n : 2 * n], y[:, 2 * n : 3 * n]
        rows = []
        row = np.zeros_like(y)
        if own.kind == NEIMARK_SACKER:
            squares = ((v * v) + (w * w)).sum(axis=1, keepdims=True)
            row[:, n : 2 * n], row[:, 2 * n : 3 * n] = v / squares, w / squares
            across = np.zeros_like(y)
            across[:, n : 2 * n], across[:, 2 * n : 3 * n] = -w / squares, v / squares
            rows += [row, across]
        else:
            row[:, n : 2 * n] = v / (v * v).sum(axis=1, keepdims=True)
            rows.append(row)
        if own.free:
            f = self.slopes(y)
            f = f / np.sqrt((f * f).sum(axis=1, keepdims=True))
            for at in (0, n) if own.drifts else (0,):
                row = np.zeros_like(y)
                row[:, at : at + n] = f
                rows.append(row)
        rows = np.stack(rows, axis=1)
        values = (rows * y[:, None, :]).sum(axis=2)
        values[:, 0] = 1.0
        if own.kind == NEIMARK_SACKER:
            values[:, 1] = 0.0
        if own.drifts:
            values[:, -1] = 0.0
        return rows, values

    def _with_conditions(self, y, rows, values):
        """These rows and values after those of the conditions about y."""
        own_rows, own_values = self.conditions(y)
        return np.concatenate([own_rows, rows], axis=1), np.concatenate(
            [own_values, values], axis=1
        )

    def held(self, y, coordinate):
        """The row that holds this coordinate (N) where it is, and its value."""
        row = np.zeros((len(y), 1, y.shape[1]))
        row[np.arange(len(y)), 0, coordinate] = 1.0
        return row, y[np.arange(len(y)), coordinate][:, None]

    def solved(self, y, rows, values):
        """Newton's method from y, under these conditions too: (y, which are found)."""
        y, good, _slope, _size = self.newton(y, *self._with_conditions(y, rows, values))
        # to rounding, under the conditions about what is found, as `shown` has them
        near = np.flatnonzero(good)
        both = self._with_conditions(y[near], rows[near], values[near])
        how = {"reach": self.reach, "tolerance": ROUNDOFF}
        fine, found, _slope, _size = self.newton(y[near], *both, how, CONVERGED)
        y[near], good[near] = fine, found
        return y, good

    def newton(self, y, rows, values, how=(), last=ROUGHLY, first=FIRST):
        """(y, which converge, last derivatives of the equations, sizes of y), under these
        conditions alone.

        `how` the flow is computed; `last` and `first`: the longest steps.
        """
        (N, n), y = y.shape, y.copy()
        found = np.zeros(N, bool)
        live = np.flatnonzero(np.isfinite(y).all(axis=1))
        most = np.full(N, first)
        slopes = np.full((N, self.critical.moving, n), np.nan)
        sizes = np.ones((N, n))
        for _ in range(TRIALS):
            if not live.size:
                break
            value, slopes[live], sizes[live] = self.linearised(y[live], **dict(how))
            value = np.concatenate([value, applied(rows[live], y[live]) - values[live]], axis=1)
            with np.errstate(all="ignore"):
                step = -applied(inverse(np.concatenate([slopes[live], rows[live]], axis=1)), value)
                length = (abs(step) / sizes[live]).max(axis=1)
                good = length <= most[live]
            y[live[good]] += step[good]
            most[live] = np.maximum(CONTRACTION * length, last)
            done = good & (length <= last)
            found[live[done]] = True
            live = live[good & ~done]
        return y, found, slopes, sizes

    def shown(self, y, rows, values):
        """ShownCritical of the orbits near y under these conditions too."""
        n = self.critical.n
        N, size = y.shape
        out = ShownCritical(np.zeros(N, bool), np.full((N, size), np.inf), *np.full((2, N, n, n), np.nan),
                    *np.full((2, N, n), np.nan))  # fmt: skip
        rows, values = self._with_conditions(y, rows, values)
        points = self.parameters(y)
        for some, programs in self.critical.traced(points, y):
            for i in range(0, some.size, CHUNK):
                own = some[i : i + CHUNK]
                with np.errstate(all="ignore"):
                    self._show(out, own, programs, points[own], y[own], rows[own], values[own])
        return out

    def _show(self, out, which, programs, points, y, rows, values):
        numbers, span = programs.numbers(points), np.ones(len(y))
        X, _M, _size, counts = programs.flow(numbers, y, span, self.reach, derived=False)
        there = np.flatnonzero(np.isfinite(X).all(axis=1) & (counts > 0))
        if not there.size:
            return
        which, y, rows, values = which[there], y[there], rows[there], values[there]
        numbers = existence.chosen(numbers, there)
        path = existence.OrbitSteps(programs, numbers, y, span[there], counts[there], self.reach)
        path.enough = existence.WIDEST * path.extent
        path.propagate(self.method)
        left = np.arange(len(y))
        for factor in existence.RADII:
            good, dy, M, E = certified(path, y, rows, values, self.critical.signs, factor)
            new = left[good[left]]
            self._put(
                out,
                which[new],
                programs,
                existence.chosen(numbers, new),
                y[new],
                dy[new],
                M[new],
                E[new],
            )
            left = left[~good[left]]

    def _put(self, out, which, programs, numbers, y, dy, M, E):
        n = self.critical.n
        f, df = programs.slopes(numbers, np.zeros(len(y)), y, dy)
        out.good[which], out.dy[which] = True, dy
        out.M[which], out.dM[which] = M[:, :n, :n], E[:, :n, :n]
        out.f[which] = f[:, :n]
        out.df[which] = existence.WIDER * df[:, :n] + 8 * EPS * abs(f[:, :n])


def certified(path, y, rows, values, signs, factor):
    """(which exist, bounds of y, M, its bounds) of the zeros within `factor` |B G|; see the head of
    the module.
    """
    N, n = y.shape
    m = len(signs)
    point = path.point
    last = path.last
    s = path.scale
    delta = path.defect / s[point]
    wide, off = path.spread_of(delta)
    M, E, R = np.empty((3, N, n, n))
    products(path.F, path.error, path.doubt, path.first, n, M, E, R)
    scaled = rows * s[:, None, :]
    unit = abs(scaled).max(axis=2)  # of a condition
    scaled /= unit[:, :, None]
    left = scaled * (y / s)[:, None, :]
    goal = values / unit
    rest = abs(left.sum(axis=2) - goal) + (n + 4) * EPS * (abs(left).sum(axis=2) + abs(goal))
    off_G = np.concatenate(
        [abs(signs * path.end[:, :m] - y[:, :m]) / s[:, :m] * (1 + EPS) + off[last, :m], rest],
        axis=1,
    )
    slope = np.concatenate([signs[:, None] * M[:, :m], scaled], axis=1)
    slope[:, np.arange(m), np.arange(m)] -= 1.0
    B = inverse(slope)
    size = abs(B)
    near = (size * off_G[:, None, :]).sum(axis=2).max(axis=1)
    radius = factor * near
    begins, tube = path.tube(radius, delta, wide, off)
    width = path.noise_X + (tube[:, None] * s[point])[:, :, None]
    noise = (
        existence.WIDER * existence.SAMPLED * path.rows_of(path.along(path.programs.A, width)[1])
    )
    error = path.error + path.h * noise * np.exp(path.h * (path.norm + noise))
    doubt = path.doubt * (error / path.error)
    second = path.spread_of(np.repeat((n * error * existence.WIDER * begins)[:, None], n, axis=1))[
        1
    ]
    first_order = (wide * radius[point, None] + off).max(axis=1)
    stays = (second.max(axis=1) <= (existence.WIDER - 1.0) * first_order) & (
        tube <= path.enough[point]
    )
    stays = np.logical_and.reduceat(stays, path.first[:-1])
    products(path.F, error, doubt, path.first, n, M, E, R)
    bounds = np.concatenate([E[:, :m], 4 * EPS * abs(scaled)], axis=1)
    residual = abs(existence.product(B, slope) - np.eye(n)) + (n + 4) * EPS * existence.product(
        size, abs(slope)
    )
    rows_of = (residual + existence.product(size, bounds)).sum(axis=2)
    q = rows_of.max(axis=1)
    off_G[:, :m] += second.max(axis=1)[last, None]
    near = (size * off_G[:, None, :]).sum(axis=2)
    good = (
        stays & (q < 1) & (near.max(axis=1) <= (1 - q) * radius) & np.isfinite(E).all(axis=(1, 2))
    )
    dy = (near + rows_of * radius[:, None]) * s * (1 + 8 * EPS) + EPS * abs(y)
    back = s[:, :, None] / s[:, None, :]
    return good, dy, M * back, E * back
