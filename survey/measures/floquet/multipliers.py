"""Multipliers from a monodromy matrix M that is known to within E, and what certainly follows from
them.

With any nonsingular V, M is similar to (W V)^-1 W M V, W V = 1 nearly: its diagonal entries, with
the sums of the moduli of the others of their rows, are Gershgorin's discs, and E widens them. V are
the eigenvectors of M, or of M plus a small perturbation where they are nearly dependent: any V is
allowed, and the narrowest discs are kept. A disc, or several that touch, apart from all others
holds as many multipliers as it has centres.

Where M is symplectic or reversible, 1 / conj(l) is a multiplier with l. So an isolated disc whose
mirror image in the unit circle meets no other one holds a multiplier on the circle.

Sources: R. A. Horn, C. R. Johnson, Matrix Analysis (2013), 6.1 and 6.4; V. A. Yakubovich, V. M.
Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975), III.
"""

import numpy as np

from survey.kernels.floquet import discs
from survey.kernels.floquet.characteristic import TIE
from survey.kernels.math.roundoff import EPS
from survey.measures.floquet.monodromy import inverse

UNDECIDED, UNSTABLE, STABLE, MARGINAL = -1, 0, 1, 2
NONE, PLUS_ONE, MINUS_ONE, NEIMARK_SACKER, COLLISION = range(5)
PERTURBED = (1.0, 1e3)  # perturbations of M that are tried, relative to the largest entry of E
POWERS = 12  # of 2: the highest power of M that is looked at


class Discs:
    """Discs of N matrices: centres and radii (N, n), by descending modulus, then angle; `together`
    (N, n, n): do they hold their multipliers together? `V` the columns whose discs they are,
    `coupling` (N, n, n) what couples these.
    """

    def __init__(self, matrices):
        M, E, known = matrices.M, matrices.E, matrices
        N, n = M.shape[:2]
        self.centre = np.zeros((N, n), complex)
        self.radius = np.full((N, n), np.inf)
        self.V = np.zeros((N, n, n), complex)
        self.coupling = np.full((N, n, n), np.inf)
        good = np.isfinite(M).all(axis=(1, 2)) & np.isfinite(E).all(axis=(1, 2))
        some = np.flatnonzero(good & known.sharp)
        if some.size:
            own = known[some]
            self._improve(some, own.M, own.R, own.extra, own.centre, own.V, own.W)
        some = np.flatnonzero(good & ~known.sharp)
        if some.size:
            self._coordinates(some, M, E, M[some])
        for times in PERTURBED:
            left = np.flatnonzero(good & self._doubtful())
            if left.size:
                off = np.cos(1.0 + 7.0 * np.arange(n * n)).reshape(n, n)  # no special direction
                with np.errstate(over="ignore"):
                    near = M[left] + times * E[left].max(axis=(1, 2), keepdims=True) * off
                finite = np.isfinite(near).all(axis=(1, 2))
                self._coordinates(left[finite], M, E, near[finite])
        self.together = self._touching()
        self._narrow()
        self.reorder(order(self.centre, self.bars))

    def _doubtful(self):
        """Where another V may serve better: discs that are far wider than what M asks for."""
        with np.errstate(invalid="ignore"):
            return ~(self.radius.max(axis=1) < 1e-9 * (1 + abs(self.centre).max(axis=1)))

    def _coordinates(self, which, M, E, near):
        """Try the eigenvectors of `near`."""
        centre, V = np.linalg.eig(near)
        V = V.astype(complex)
        self._improve(
            which, M[which], E[which], np.zeros(V.shape), centre.astype(complex), V, inverse(V)
        )

    def _improve(self, which, M, E, extra, centre, V, W):
        """Take the discs in the coordinates V where they are narrower; see `discs.couplings`."""
        with np.errstate(all="ignore"):
            coupling = np.empty(V.shape)
            discs.couplings(*map(np.ascontiguousarray, (M, E, extra, centre, V, W)), coupling)
            radius = coupling.sum(axis=2) * (1 + 8 * EPS)
            radius = np.where(np.isfinite(radius) & np.isfinite(centre), radius, np.inf)
            better = radius.max(axis=1) < self.radius[which].max(axis=1)
        some = which[better]
        self.centre[some], self.radius[some] = centre[better], radius[better]
        self.V[some], self.coupling[some] = V[better], coupling[better]

    def _touching(self):
        with np.errstate(invalid="ignore"):
            gap = abs(self.centre[:, :, None] - self.centre[:, None, :])
            touch = ~(gap > (self.radius[:, :, None] + self.radius[:, None, :]) * (1 + 8 * EPS))
        n = touch.shape[1]
        reach = 1
        while reach < n:
            touch = (touch.astype(np.uint8) @ touch.astype(np.uint8)) > 0
            reach *= 2
        return touch

    def _narrow(self):
        """Make isolated discs narrower: in other units of their column, what couples it to others
        counts t times.

        t is such that the discs of the others, in whose rows it counts 1 / t times, still keep
        away.
        """
        n = self.centre.shape[1]
        at = np.arange(n)
        with np.errstate(all="ignore"):
            own = self.coupling[:, at, at]
            off = self.radius - own
            gap = (
                abs(self.centre[:, :, None] - self.centre[:, None, :])
                - own[:, :, None]
                - self.radius[:, None, :]
            )
            gap[:, at, at] = np.inf
            # of j, in whose row i counts
            share = (2.0 * np.swapaxes(self.coupling, 1, 2) / gap).copy()
            share[:, at, at] = 0.0
            t = np.clip(share.max(axis=2), 1e-12, 1.0)
            clear = self.isolated & (gap.min(axis=2) > 2.0 * t * off)
            self.radius = np.where(clear, (own + t * off) * (1 + 8 * EPS), self.radius)

    def reorder(self, order):
        """Put the discs into this order (N, n)."""
        rows = np.arange(len(order))[:, None]
        self.centre, self.radius = self.centre[rows, order], self.radius[rows, order]
        self.V = np.take_along_axis(self.V, order[:, None, :], axis=2)
        for name in ("coupling", "together"):
            kept = np.take_along_axis(getattr(self, name), order[:, :, None], axis=1)
            setattr(self, name, np.take_along_axis(kept, order[:, None, :], axis=2))

    @property
    def isolated(self):
        """Discs that hold exactly one multiplier (N, n)."""
        return self.together.sum(axis=2) == 1

    @property
    def bars(self):
        """How far the multipliers of a disc's cluster may lie from its centre (N, n)."""
        with np.errstate(invalid="ignore"):
            far = abs(self.centre[:, :, None] - self.centre[:, None, :]) + self.radius[:, None, :]
            far = np.where(self.together, far, 0.0)
        bars = far.max(axis=2)
        return np.where(np.isfinite(bars), bars, np.inf)

    @property
    def moduli(self):
        """The least and the largest modulus in each disc (N, n) each."""
        size = abs(self.centre)
        return np.maximum(size - self.radius, 0.0) * (1 - 4 * EPS), (size + self.radius) * (
            1 + 4 * EPS
        )

    @property
    def on_circle(self):
        """Discs of symplectic or reversible systems that hold one multiplier, on the unit circle (N, n)."""
        low, high = self.moduli
        off = np.maximum(high - 1.0, 1.0 - low)
        with np.errstate(invalid="ignore"):
            gap = (
                abs(self.centre[:, :, None] - self.centre[:, None, :])
                - self.radius[:, :, None]
                - self.radius[:, None, :]
            )
            n = gap.shape[1]
            gap[:, np.arange(n), np.arange(n)] = np.inf
            # z and 1 / conj(z) are apart by | |z| - 1 / |z| | <= 2.2 | |z| - 1 | near the circle
            return self.isolated & (off < 0.05) & (gap.min(axis=2) > 2.2 * off)


def order(centre, bars):
    """The order (N, n) by descending modulus, then angle: where bars, or rounding, leave open which modulus is
    larger, they count as equal.
    """
    by_size = np.argsort(-abs(centre), axis=1, kind="stable")
    size, bars, angle = (
        np.take_along_axis(of, by_size, axis=1) for of in (abs(centre), bars, np.angle(centre))
    )
    with np.errstate(invalid="ignore"):
        least = np.minimum.accumulate((size - bars) * (1 - TIE), axis=1)
        lower = size[:, 1:] + bars[:, 1:] < least[:, :-1]
    group = np.pad(np.cumsum(lower, axis=1), ((0, 0), (1, 0)))
    return np.take_along_axis(by_size, np.lexsort((angle, group), axis=1), axis=1)


def symplectic_form(n):
    """J = (0 1; -1 0) of n states, coordinates and then momenta."""
    J, m = np.zeros((n, n)), n // 2
    J[:m, n - m :], J[n - m :, :m] = np.eye(m), -np.eye(m)
    return J


def not_symplectic(M, E):
    """Where (N) M^T J M, M known within E, is certainly not J."""
    n = M.shape[1]
    size = abs(M) + E
    J = symplectic_form(n)
    with np.errstate(all="ignore"):
        off = abs(np.swapaxes(M, 1, 2) @ J @ M - J)
        wide = np.swapaxes(size, 1, 2) @ abs(J) @ (E + 4 * n * EPS * size)
        return (off > (wide + np.swapaxes(wide, 1, 2)) * (1 + 16 * n * EPS)).any(axis=(1, 2))


def not_conserved(w, M, E):
    """Where (N) w M, w (N, n), M known within E, is certainly not w."""
    with np.errstate(all="ignore"):
        off = abs(np.einsum("ni,nij->nj", w, M) - w)
        wide = np.einsum("ni,nij->nj", abs(w), E + 4 * M.shape[1] * EPS * abs(M)) + 4 * EPS * abs(w)
        return (off > wide).any(axis=1)


def radius(own):
    """The spectral radius and its error bound (N)."""
    low, high = own.moduli
    top = high.max(axis=1)
    least = np.where(own.together, low[:, None, :], np.inf).min(axis=2).max(axis=1)
    value = abs(own.centre).max(axis=1)
    return value, np.maximum(top - value, value - least)


def verdicts(own, M, E, paired):
    """The verdict (N); `paired`: with l, 1 / conj(l) is a multiplier (symplectic and reversible systems)."""
    low, high = own.moduli
    least = np.where(own.together, low[:, None, :], np.inf).min(axis=2)
    most = np.where(own.together, high[:, None, :], 0.0).max(axis=2)
    verdict = np.full(len(M), UNDECIDED, dtype=np.int8)
    outside = (least > 1.0).any(axis=1)
    if paired:
        outside |= (most < 1.0).any(axis=1)
        verdict[own.on_circle.all(axis=1)] = STABLE
    else:
        verdict[(most < 1.0).all(axis=1)] = STABLE
    verdict[outside] = UNSTABLE
    left = np.flatnonzero(
        (verdict == UNDECIDED) & np.isfinite(E).all(axis=(1, 2)) & np.isfinite(M).all(axis=(1, 2))
    )
    if left.size:
        verdict[left] = by_powers(M[left], E[left], not paired)
    return verdict


def by_powers(M, E, may_be_stable):
    """The verdict by powers of M: stable if a norm of one is below 1, unstable if a trace exceeds
    n.

    Where multipliers are nearly defective this tells what discs cannot.
    """
    out = np.full(len(M), UNDECIDED, dtype=np.int8)
    discs.powers(np.ascontiguousarray(M), np.ascontiguousarray(E), POWERS, may_be_stable, out)
    return out


def krein(own):
    """Krein signs (N, n) of multipliers on the unit circle: the sign of i v* J v; 0 where there is
    none, or is open.

    J = (0 1; -1 0) in blocks: the first half of the states are coordinates, the second their
    momenta.
    """
    V = own.V
    n = own.V.shape[1]
    m = n // 2
    with np.errstate(all="ignore"):
        JV = np.concatenate([V[:, m:], -V[:, :m]], axis=1)
        form = (1j * (V.conj() * JV).sum(axis=1)).real
        gap = (
            abs(own.centre[:, :, None] - own.centre[:, None, :])
            - own.radius[:, :, None]
            - own.radius[:, None, :]
        )
        gap[:, np.arange(n), np.arange(n)] = np.inf
        # to first order the eigenvector i is off by sum over j of V_j coupling_ji / (l_i - l_j)
        mixed = np.swapaxes(own.coupling, 1, 2) / np.where(gap > 0, gap, 0.0)
        off = (abs(V)[:, None] * mixed[:, :, None, :]).sum(axis=3)  # (N, i, row)
        size = np.swapaxes(abs(V), 1, 2)
        swapped = np.concatenate([size[:, :, m:], size[:, :, :m]], axis=2)
        other = np.concatenate([off[:, :, m:], off[:, :, :m]], axis=2)
        doubt = (2.0 * off * swapped + off * other).sum(axis=2) * 1.5 + 8 * n * EPS * (
            size * swapped
        ).sum(axis=2)
        sign = np.where(abs(form) > doubt, np.sign(form), 0.0)
    return np.where(own.on_circle, sign, 0.0).astype(np.int8)


def clusters(own, which):
    """Krein signs (N, n) of clusters of multipliers in symplectic systems, of the points `which`; 0
    elsewhere.

    A cluster is what discs that meet hold together. Where v* (i J) v has one sign on its invariant subspace, M is
    unitary there in that form: all of the cluster are on the unit circle, and stay there. With V the columns of the
    discs, the subspace is V_1 + V_2 X, |X| <= 2 |C_21| / s where s^2 = (gap - |C_11| - |C_22|)^2 - 4 |C_12| |C_21| > 0,
    C the couplings and gap the distance of the clusters' centres (Stewart).
    """
    signs = np.zeros(own.centre.shape, dtype=np.int8)
    n = own.centre.shape[1]
    m = n // 2
    for p in which:
        V, C, centre = own.V[p], own.coupling[p], own.centre[p]
        if not (np.isfinite(C).all() and np.isfinite(V).all()):
            continue
        J = np.concatenate([V[m:], -V[:m]])
        form = 1j * (V.conj().T @ J)
        form = 0.5 * (form + form.conj().T)
        size = abs(V).T @ np.concatenate([abs(V[m:]), abs(V[:m])])
        for one in np.unique(own.together[p], axis=0):
            if one.sum() < 2:
                continue
            two = ~one
            inner = np.linalg.eigvalsh(form[np.ix_(one, one)])
            # the norms of C_11, C_12, C_21 and C_22
            c11, c12, c21, c22 = (
                np.linalg.norm(C[np.ix_(a, b)]) for a in (one, two) for b in (one, two)
            )
            gap = abs(centre[one][:, None] - centre[two]).min() if two.any() else np.inf
            apart = gap - c11 - c22
            if not apart > 0 or not apart**2 > 4.0 * c12 * c21:
                continue
            x = 2.0 * c21 / np.sqrt(apart**2 - 4.0 * c12 * c21) if two.any() else 0.0
            doubt = 2.0 * x * np.linalg.norm(form[np.ix_(one, two)]) + x * x * np.linalg.norm(
                form[np.ix_(two, two)]
            )
            doubt += 16 * n * EPS * np.linalg.norm(size) * (1.0 + x) ** 2
            if abs(inner).min() > 1.01 * doubt and (inner[0] > 0) == (inner[-1] > 0):
                signs[p, one] = np.sign(inner[0])
    return signs


def crossing(own, verdict, paired, signs=None):
    """How stability is lost nearest, or has been lost (N).

    Of multipliers all on the circle, by the shortest arc: to 1, to -1, or between two of opposite
    Krein sign (of any two if `signs` is None). Otherwise by the leading multiplier, the one of the
    largest modulus.
    """
    centre, bars = own.centre, own.bars
    N, n = centre.shape
    out = np.full(N, UNDECIDED, dtype=np.int8)
    with np.errstate(invalid="ignore"):
        modulus = abs(centre)
        lead = modulus.argmax(axis=1)
        rows = np.arange(N)
        leader = centre[rows, lead]
        conjugate = abs(centre - leader.conj()[:, None]) <= bars + bars[rows, lead, None]
        rivals = (modulus + bars >= (modulus - bars)[rows, lead, None]) & ~conjugate
        rivals[rows, lead] = False
        alone = own.isolated[rows, lead] & ~rivals.any(axis=1)
        complex_ = abs(leader.imag) > bars[rows, lead]
        kind = np.where(leader.real > 0, PLUS_ONE, MINUS_ONE)
        # two pairs collide, and one is on the circle
        kind = np.where(
            complex_, (COLLISION if n > 3 else UNDECIDED) if paired else NEIMARK_SACKER, kind
        )
        out[alone] = kind[alone]
    circle = (verdict == STABLE) & paired
    if not paired or not circle.any():
        return out
    angle, arc_bar = np.angle(centre[circle]), 2 * bars[circle]
    to_plus, to_minus = 2 * abs(angle), 2 * (np.pi - abs(angle))
    gaps = abs(np.exp(1j * angle)[:, :, None] - np.exp(1j * angle)[:, None, :])
    arcs = 2 * np.arcsin(np.clip(gaps / 2, 0, 1))
    pairs = arc_bar[:, :, None] + arc_bar[:, None, :]
    upper = (angle > 0)[:, :, None] & (angle > 0)[:, None, :]
    may = upper & ~np.eye(n, dtype=bool)
    if signs is not None:
        may &= signs[circle][:, :, None] * signs[circle][:, None, :] < 0
    arcs = np.where(may, arcs, np.inf)
    least = [to_plus.min(axis=1), to_minus.min(axis=1), arcs.min(axis=(1, 2))]
    doubt = [
        2 * arc_bar.max(axis=1),
        2 * arc_bar.max(axis=1),
        np.where(may, pairs, 0).max(axis=(1, 2)),
    ]
    least, doubt = np.array(least), np.array(doubt)
    first = least.argmin(axis=0)
    columns = np.arange(first.size)
    second = least.copy()
    second[first, columns] = np.inf
    clear = second.min(axis=0) - least[first, columns] > doubt.max(axis=0)
    out[circle] = np.where(clear, np.array([PLUS_ONE, MINUS_ONE, COLLISION])[first], UNDECIDED)
    return out


def by_determinant(own, centre, bars, growth):
    """Centres and bars of multipliers where the smallest, if it is real, follows from the others by
    Liouville: the product of all is exp(growth[0]), `growth` (2, N) with its error bound.

    Beside huge multipliers this tells far more of a small one than M does, whose errors are those
    of its largest entry.
    """
    centre, bars, rows = centre.copy(), bars.copy(), np.arange(len(centre))
    with np.errstate(all="ignore"):
        least = abs(centre).argmin(axis=1)
        others = np.where(np.arange(centre.shape[1]) == least[:, None], 1.0, centre)
        share = np.where(np.arange(centre.shape[1]) == least[:, None], 0.0, bars / abs(others))
        # |1 / prod (1 + d_j) - 1| <= x / (1 - x) with x = prod (1 + |d_j|) - 1
        x = np.expm1(np.log1p(share).sum(axis=1))
        value = np.exp(growth[0]) / np.prod(others, axis=1).real
        rounding = 8 * (centre.shape[1] + 1) * EPS
        bar = abs(value) * (x / (1.0 - x) + np.expm1(growth[1]) + rounding) * (1.0 + x) + 1e-300
        good = (
            own.isolated.all(axis=1)
            & (centre[rows, least].imag == 0)
            & (x < 0.5)
            & (growth[1] < 0.5)
        )
        good &= (bar < bars[rows, least]) & (
            abs(value - centre[rows, least]) <= bar + bars[rows, least]
        )
    centre[rows[good], least[good]], bars[rows[good], least[good]] = value[good], bar[good]
    return centre, bars


def symmetric(own):
    """Centres and bars of paired multipliers: those outside the circle, and their mirror images in
    it, exactly.
    """
    centre, bars = own.centre.copy(), own.bars.copy()
    on = own.on_circle
    with np.errstate(all="ignore"):
        centre = np.where(on, centre / abs(centre), centre)
        mirror = 1 / centre.conj()
        distance = abs(mirror[:, :, None] - centre[:, None, :])  # (N, i, j): the image of i is j
        n = centre.shape[1]
        rows = np.arange(len(centre))
        for i in range(n):
            outside = (abs(centre[:, i]) > 1) & ~on[:, i] & own.isolated[:, i]
            j = np.where(np.isfinite(distance[:, i]), distance[:, i], np.inf).argmin(axis=1)
            ok = outside & (j != i) & own.isolated[rows, j] & (abs(centre[rows, j]) < 1)
            # |1 / (c + d) - 1 / c| <= r / (|c| (|c| - r))
            bar = bars[:, i] / (
                abs(centre[:, i]) * (abs(centre[:, i]) - bars[:, i])
            ) + 2 * EPS / abs(centre[:, i])
            ok &= (abs(centre[:, i]) > 2 * bars[:, i]) & (
                distance[rows, i, j] <= bar + bars[rows, j]
            )
            centre[rows[ok], j[ok]] = mirror[ok, i]
            bars[rows[ok], j[ok]] = bar[ok]
    return centre, bars
