"""That a periodic orbit exists near a computed one, and bounds of it and of its monodromy matrix.

Let X(t) be the Taylor series of all steps, off from the solution by its defect X' - f(t, X), which is
sampled at NODES, and by the jumps from step to step; y = x(0), or (x(0), T); G(y) = x(T) - x(0) and the plane's
equation; B nearly the inverse of G'. If |1 - B G'| <= q < 1 for all y of a ball of radius r about the computed y, and
|B G(y)| <= (1 - q) r, there is one periodic orbit in the ball (Banach; Krawczyk), and it is within |B G(y)| / (1 - q).
All solutions that begin in the ball are in a tube about X, WIDER than the linear equation says, which is checked with
the second-order terms. A = df/dx changes within the tube by no more than `noise`: its operations are evaluated with
the tube's width as the error of the states. So the bounds of M, which include `noise`, hold for all of them, and for
the orbit: verdicts need nothing else.

Not strict: samples at NODES stand for all times (taken SAMPLED times), widths of the
tube enter to first order (taken WIDER), and the series of A is cut off as in
`kernels.floquet.steps`.

The autonomous system's multiplier +1 is not given or judged: the others are those of M in the
coordinates x_i - (f_i / f_k) x_k, i not k, of the space in which f counts as 0.

Sources: R. Krawczyk, Computing 4 (1969) 187; W. Tucker, Validated Numerics (2011), 5 and 6.
"""

from dataclasses import dataclass, fields

import numpy as np

from survey import waiting
from survey.kernels.floquet.discs import couplings
from survey.kernels.floquet.flow import ORDER, spread
from survey.kernels.floquet.steps import carried, products
from survey.kernels.math.roundoff import EPS, ROUNDOFF_UP
from survey.measures.floquet import monodromy, probing
from survey.measures.floquet.newton import applied, bordered, chosen, inverse

# of a step; sums with the ends of steps are exact
NODES = np.array([0.0, 0.25, 0.5, 0.75, 0.875, 1.0])
MIDDLE = 2  # of NODES
BETWEEN = (np.arange(64) + 0.5) / 64  # where f may have spikes
MEAN = np.array([7.0, 32.0, 12.0, 32.0, 0.0, 7.0]) / 90.0  # over a step, by NODES (Boole)
SAMPLED = 1.25  # samples within a step, whose length is a small part of the radius of convergence
WIDER = 1.1  # the tube than the linear equation says, and bounds to first order in its width
RADII = (1.1, 2.1)  # of the ball, relative to |B G|: the first that serves
WIDEST = 1e-3  # of the tube, relative to the largest state


@dataclass
class ShownOrbits:
    """Orbits that exist: states, periods, M and what their multipliers follow from, each with
    bounds; mean squares of the states, without."""

    good: np.ndarray
    x: np.ndarray
    dx: np.ndarray
    T: np.ndarray
    dT: np.ndarray
    M: np.ndarray
    dM: np.ndarray
    square: np.ndarray
    others: monodromy.Matrices

    def improve(self, other):
        """Take over the orbits that only `other` shows."""
        those = ~self.good & other.good
        for one in fields(self):
            getattr(self, one.name)[those] = getattr(other, one.name)[those]


def certified(programs, numbers, x, T, guess, plane, counts, method, reach):
    """ShownOrbits, of orbits near (x, T); see the head of the module. All is in the units that balance A,
    but the results.
    """
    with np.errstate(all="ignore"):
        path = OrbitSteps(programs, numbers, x, T, counts, reach)
        path.enough = WIDEST * np.maximum(path.extent, (abs(guess) / path.scale).max(axis=1))
        path.propagate(method)
        shown = path.certify(x, T, plane, RADII[0])
        for factor in RADII[1:]:
            if not shown.good.all():
                shown.improve(path.certify(x, T, plane, factor))
        return shown


def _compile_some():
    """Compile what is needed after the propagators, by calls on nothing, while another process compiles these."""
    if waiting.other_compiler:
        F, rows, bars, first = np.zeros((0, 2, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(1, int)
        spread(F, rows, first, rows, rows)
        products(F, bars, bars, first, 2, F, F, F)
        couplings(F, F, F, rows + 0j, F + 0j, F + 0j, F)
        waiting.wait("steps")


class OrbitSteps:
    """The Taylor series of the steps along N orbits, whose bounds follow."""

    def __init__(self, programs, numbers, x, T, counts, reach):
        N, n = x.shape
        self.programs, self.n = programs, n
        self.first = np.concatenate([[0], np.cumsum(counts)])
        self.point = np.repeat(np.arange(N), counts)
        self.last = self.first[1:] - 1
        self.own = numbers
        self.numbers = chosen(numbers, self.point)
        X, begin, self.h, series = programs.flow(
            numbers, x, T, reach, derived=False, first=self.first
        )
        self.begin, self.t = begin, begin[:, None] + self.h[:, None] * NODES
        k = np.arange(ORDER + 1.0)
        moduli = abs(series)
        self.X = _sum(series)
        self.noise_X = ROUNDOFF_UP * _sum(moduli * (2 * k + 2))
        dX = _slopes(series, self.h)
        noise = ROUNDOFF_UP * _sum((moduli * k * (2 * k + 2))[:, :, 1:]) / self.h[:, None, None]
        f, df = (one[..., 0].swapaxes(1, 2) for one in self.along(programs.f, self.noise_X))
        defect = (abs(dX - f) + df + noise).max(axis=2)
        if probing.suspects(programs.f):  # a step may have passed a spike
            defect = np.fmax(defect, self._between(series))
        self.defect = SAMPLED * self.h[:, None] * defect
        # a series begins where the one before it ends, as it is summed
        end, begins = self.X[:-1, :, -1], series[1:, :, 0]
        self.defect[:-1] += np.where(
            (self.point[1:] == self.point[:-1])[:, None], abs(end - begins), 0.0
        )
        self.defect += self.noise_X[:, :, -1]
        self.f_end = f[self.last, :, -1]
        A, dA = self.along(programs.A, self.noise_X)
        self.largest = np.maximum.reduceat(abs(A).max(axis=1), self.first[:-1], axis=0)
        self.scale = monodromy.balanced(self.largest)
        self.ratio = (self.scale[:, None, :] / self.scale[:, :, None])[self.point]
        self.norm = SAMPLED * (abs(A).max(axis=1) * self.ratio).sum(axis=2).max(axis=1)
        self.noise = SAMPLED * self.rows_of(dA)
        size = (abs(self.X).max(axis=2) / self.scale[self.point]).max(axis=1)
        self.extent = np.maximum.reduceat(size, self.first[:-1])
        self.end = X
        squares = (self.X * self.X).sum(axis=1) @ MEAN
        self.square = np.add.reduceat(squares * self.h, self.first[:-1]) / T

    def _between(self, series):
        """The defect (tasks, n) of the series X' - f(t, X) at BETWEEN; infinite where there is none."""
        X, dX = _sum(series, BETWEEN), _slopes(series, self.h, BETWEEN)
        t = self.begin[:, None] + self.h[:, None] * BETWEEN
        f, _ = self.programs.along(self.programs.f, self.numbers, t, X, 0.0 * X)
        off = abs(dX - f[..., 0].swapaxes(1, 2)).max(axis=2)
        return np.where(np.isnan(off), np.inf, off)

    def along(self, program, width):
        """A program's values at the nodes, and bounds, if the states are known to within `width`."""
        return self.programs.along(program, self.numbers, self.t, self.X, width)

    def rows_of(self, errors):
        """The maximum norm of errors of A (tasks, m, n, n), the largest at NODES, in balanced units."""
        return (errors * self.ratio[:, None]).sum(axis=3).max(axis=(1, 2))

    def propagate(self, method):
        """The propagators F of the steps, with bounds of their errors in each entry."""
        tasks, n, A = len(self.point), self.n, self.programs.A
        values = self.numbers[0].copy()
        values[:, self.programs.states_at] = self.X[:, :, MIDDLE]
        self.F, self.error, self.doubt = np.empty((tasks, n, n)), np.empty(tasks), np.empty(tasks)
        _compile_some()
        method.floquet_factors(
            A.operations, A.signs, A.inside, A.order, A.used, A.terms, values, self.scale[self.point], self.noise, n,
            np.arange(tasks), self.begin + 0.5 * self.h, 0.5 * self.h, self.F, self.error, self.doubt,
        )  # fmt: skip

    def spread_of(self, delta):
        """See `kernels.floquet.flow.spread`: what local errors delta (tasks, n) become."""
        wide, off = np.empty((2, len(self.point), self.n))
        spread(self.F, np.ascontiguousarray(delta), self.first, wide, off)
        return wide, off

    def tube(self, radius, delta, wide, off):
        """How far motions that begin within radius (N) are from the series, at the steps'
        beginnings and throughout.
        """
        begins = np.concatenate(
            [[0.0], (wide[:-1] * radius[self.point[:-1], None] + off[:-1]).max(axis=1)]
        )
        begins[self.first[:-1]] = radius
        return begins, WIDER * (np.exp(self.h * self.norm) * begins + delta.max(axis=1))

    def bars(self, dx):
        """Error bounds of the series X (tasks, n, NODES), if x(0) is known to within dx (N, n)."""
        radius = (dx / self.scale).max(axis=1)
        delta = self.defect / self.scale[self.point]
        tube = self.tube(radius, delta, *self.spread_of(delta))[1]
        return self.noise_X + (tube[:, None] * self.scale[self.point])[:, :, None]

    def certify(self, x, T, plane, factor):
        """ShownOrbits of the orbits near x (N, n), T (N), within `factor` |B G|."""
        n, N, point, last, s = self.n, len(x), self.point, self.last, self.scale
        delta = self.defect / s[point]
        wide, off = self.spread_of(delta)
        M, E = np.empty((2, N, n, n))
        products(self.F, self.error, self.doubt, self.first, n, M, E, np.empty_like(E))
        f_end, a_end = self.f_end / s, self.norm[last]
        fastest = abs(f_end).max(axis=1)
        dT = 4 * EPS * T
        off_G = abs(self.end - x) / s * (1 + EPS) + off[last] + (dT * fastest)[:, None]
        slope = M - np.eye(n)
        if plane is not None:
            unit = 1.0 / fastest  # of T
            row = plane[0] * s
            row /= abs(row).max(axis=1, keepdims=True)
            planar = (
                plane[0] * s / abs(plane[0] * s).max(axis=1, keepdims=True) * ((x - plane[1]) / s)
            )
            phase = abs(planar.sum(axis=1)) + (n + 4) * EPS * abs(planar).sum(axis=1)
            off_G = np.concatenate([off_G, phase[:, None]], axis=1)
            slope = bordered(slope, f_end * unit[:, None], row)
        B = inverse(slope)
        size = abs(B)
        near = (size * off_G[:, None, :]).sum(axis=2).max(axis=1)
        radius = factor * near
        # the tube, in the maximum norm of balanced units
        begins, tube = self.tube(radius, delta, wide, off)
        width = self.noise_X + (tube[:, None] * s[point])[:, :, None]
        noise = WIDER * SAMPLED * self.rows_of(self.along(self.programs.A, width)[1])
        error = self.error + self.h * noise * np.exp(self.h * (self.norm + noise))
        doubt = self.doubt * (error / self.error)
        second = self.spread_of(np.repeat((n * error * WIDER * begins)[:, None], n, axis=1))[1].max(
            axis=1
        )
        first_order = (wide * radius[point, None] + off).max(axis=1)
        stays = (second <= (WIDER - 1.0) * first_order) & (tube <= self.enough[point])
        stays = np.logical_and.reduceat(stays, self.first[:-1])
        R = np.empty_like(E)
        products(self.F, error, doubt, self.first, n, M, E, R)
        shift = dT if plane is None else dT + radius * unit
        E = E + (WIDER * shift * a_end)[:, None, None] * (abs(M) + E).max(axis=1, keepdims=True)
        bounds = E
        if plane is not None:
            moved = a_end * (WIDER * first_order[last] + shift * fastest) + 4 * EPS * fastest
            bounds = bordered(
                E, np.repeat((WIDER * unit * moved)[:, None], n, axis=1), 4 * EPS * abs(row)
            )
        m = n if plane is None else n + 1
        residual = abs(product(B, slope) - np.eye(m)) + (m + 4) * EPS * product(size, abs(slope))
        q = (residual + product(size, bounds)).sum(axis=2).max(axis=1)
        off_G[:, :n] += second[last, None]
        near = (size * off_G[:, None, :]).sum(axis=2).max(axis=1)
        shown = stays & (q < 1) & (near <= (1 - q) * radius) & np.isfinite(E).all(axis=(1, 2))
        final = np.minimum(near / (1 - q), radius) * (1 + 8 * EPS)
        dx = final[:, None] * s
        f = df = None
        if plane is not None:
            dT = final * unit * (1 + 4 * EPS) + EPS * T
            f, df = self.programs.slopes(self.own, np.zeros(N), x, dx)
            f, df = f / s, (WIDER * df + 8 * EPS * abs(f)) / s
        others = self._sharp(
            M, E, R, error, doubt, WIDER * shift * a_end, np.flatnonzero(shown), f, df
        )
        back = s[:, :, None] / s[:, None, :]
        return ShownOrbits(
            shown, x, dx + EPS * abs(x), T, dT, M * back, E * back, self.square, others
        )

    def _sharp(self, M, E, R, error, doubt, time_bar, which, f, df):
        """The Matrices of the multipliers that are judged: those of M, or, if f is given, those but
        for its +1.

        Errors are carried in the coordinates of eigenvectors; `time_bar` bounds what the end's shift
        adds, relative to M.
        """
        N, n = M.shape[:2]
        judged, bounds = (M, E) if f is None else deflated(M, E, f, df)
        found = monodromy.Matrices.plain(judged, bounds)
        values = np.ones((N, n), complex)
        vectors = np.full((N, n, n), np.nan, complex)
        own, directions = np.linalg.eig(judged[which])
        if f is None:
            values[which], vectors[which] = own, directions
        else:
            values[which, 1:] = own
            vectors[which] = completed(M[which], f[which], own, directions)
        inverses = np.full_like(vectors, np.nan)
        inverses[which] = monodromy.inverse(vectors[which])
        extra = np.full((N, n, n), np.nan)
        waiting.wait("carried")
        carried(self.F, error, doubt, self.first, which, n, vectors, inverses, extra)
        tall = product(abs(M) + E, abs(vectors))
        extra += (
            time_bar[:, None, None]
            * abs(inverses).sum(axis=2)[:, :, None]
            * tall.max(axis=1, keepdims=True)
        )
        if f is None:
            found.R, found.extra, found.V, found.W, found.centre = (
                R,
                extra,
                vectors,
                inverses,
                values,
            )
        else:
            # V^-1 M V, V including f, is near diag(1, centre); f itself is V (1, off)
            known = np.full((N, n, n), np.inf)
            couplings(M, R, extra, values, vectors, inverses, known)
            off = 1.01 * applied(abs(inverses), df)
            share = np.where(off[:, :1] < 0.01, 1.02 * off, np.inf)
            found.make_room()
            found.extra = (known[:, 1:, 1:] + share[:, 1:, None] * known[:, :1, 1:]) * (1 + 8 * EPS)
            found.R = np.zeros_like(judged)
            found.centre[which], found.V[which] = own, directions
            found.W[which] = monodromy.inverse(directions)
        found.sharp[which] = np.isfinite(found.extra[which]).all(axis=(1, 2))
        return found


def _sum(series, nodes=NODES):
    """The series (N, n, K) at nodes (N, n, m), by Horner's rule."""
    total = np.zeros((*series.shape[:2], nodes.size))
    for k in range(series.shape[2] - 1, -1, -1):
        total = total * nodes + series[:, :, k, None]
    return total


def _slopes(series, h, nodes=NODES):
    """The derivatives by time of the series of steps of lengths h (N), as `_sum`."""
    return _sum((series * np.arange(ORDER + 1.0))[:, :, 1:], nodes) / h[:, None, None]


def product(A, B):
    """Products of matrices (N, n, n), with sums in the same order in any block."""
    return (A[:, :, :, None] * B[:, None, :, :]).sum(axis=2)


def deflated(M, E, f, df):
    """M without its multiplier +1, whose eigenvector is f to within df (N, n): (N, n - 1, n - 1),
    and bounds.

    In the coordinates x_i - (f_i / f_k) x_k, i not k, f is 0.
    """
    N, n = f.shape
    out, bounds = np.empty((2, N, n - 1, n - 1))
    rows, (k, rest) = np.arange(N), _pivots(f)
    pivot = f[rows, k]
    q = f / pivot[:, None]
    dq = (df + abs(q) * df[rows, k, None]) / (abs(pivot) - df[rows, k])[:, None] + 2 * EPS * abs(q)
    dq = np.where((abs(pivot) > df[rows, k])[:, None], dq, np.inf)
    line, d_line = M[rows, k], E[rows, k]
    for i in range(n - 1):
        a = rest[:, i]
        for j in range(n - 1):
            b = rest[:, j]
            own, from_k, d_k = M[rows, a, b], line[rows, b], d_line[rows, b]
            share, d_share = q[rows, a], dq[rows, a]
            out[:, i, j] = own - share * from_k
            bounds[:, i, j] = E[rows, a, b] + abs(share) * d_k + d_share * (abs(from_k) + d_k)
            bounds[:, i, j] += 2 * EPS * (abs(own) + abs(share * from_k))
    return out, bounds


def completed(M, f, values, directions):
    """Eigenvectors of M (N, n, n): f, that of +1, and those that the eigenvectors of `deflated` M
    stand for.
    """
    N, n = f.shape
    rows, (k, rest) = np.arange(N), _pivots(f)
    out = np.zeros((N, n, n), complex)
    out[:, :, 0] = f
    out[rows[:, None], rest, 1:] = directions
    along = (M[rows, k][:, :, None] * out[:, :, 1:]).sum(axis=1) / f[rows, k, None]
    with np.errstate(all="ignore"):
        out[:, :, 1:] += f[:, :, None] * (along / (values - 1.0))[:, None, :]
    return np.where(np.isfinite(out), out, np.nan)


def _pivots(f):
    """The index of the largest component of f (N, n), and the others."""
    n = f.shape[1]
    k = abs(f).argmax(axis=1)
    return k, np.array([[j for j in range(n) if j != i] for i in range(n)])[k]
