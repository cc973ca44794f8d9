"""Do deviations from the invariant set grow along a limit of the reduced motion? Transversal
exponents and multipliers.

The set carries (phi, w). Beside it, at |nu| = 1, lie w2, w3 and eta = nu1 / sin theta: to first order three linear
equations with coefficients in w, sin phi and cos phi. In case B the integral k (7) is 0 on the set and
its gradient is transversal: one exponent is 0, one multiplier 1, which only leads to a neighbouring value of k; it is
taken out, and two remain, with the sum and the product of two. In case A k varies along the set, and all three count.
About the vertical the set is a line of steady rotations: beside it, at the same k, are w2, w3, nu2, nu3.

In case B the divergence is (B12, B31) S^-1 (-cos phi, sin phi), S the block of A in axes 2 and 3,
whatever the other parameters. For S = a 1 it is -(A11 / a) f, so that no attracting limit of the
reduced flow is observable.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from survey.kernels.body import transversal as kernel
from survey.kernels.cylinder.flow import coefficients
from survey.kernels.math.roundoff import EPS
from survey.measures.body.system import CASE_A, CASE_B, ROUNDING, VERTICAL

UNDECIDED, UNSTABLE, STABLE = -1, 0, 1
MOST = 4  # exponents beside a limit: 2 in case B, 3 in case A, 4 about the vertical


@dataclass(frozen=True)
class TransversalStability:
    """Of deviations beside a limit: exponents or, over a period, multipliers (complex), the largest
    rate of growth, and whether that is below 0 (`stable`).
    """

    values: np.ndarray
    bars: np.ndarray
    growth: float
    growth_bar: float
    stable: int
    period: float = np.nan
    period_bar: float = np.nan


NOTHING = TransversalStability(np.zeros(0, complex), np.zeros(0), np.nan, np.nan, UNDECIDED)


@dataclass(frozen=True)
class Linear:
    """z' = (M[0] + w M[1] + sin phi M[2] + cos phi M[3]) z for z = (w2, w3, eta) over their units;
    w is 1 / time.
    """

    M: np.ndarray
    slip: float  # what rounding leaves of M, relative
    free: bool  # is the divergence 0 throughout?

    def at(self, phi, w):
        return self.M[0] + w * self.M[1] + math.sin(phi) * self.M[2] + math.cos(phi) * self.M[3]

    def size(self, w):
        """Bound of the norm at any phi."""
        return sum(
            np.linalg.norm(m, np.inf) * s
            for m, s in zip(self.M, (1.0, abs(w), 1.0, 1.0), strict=True)
        )


def linear(placed):
    """The Linear equations of deviations from the set (case A or B)."""
    b, theta = placed.system, placed.theta
    sin, cos = (1.0, 0.0) if placed.case == CASE_B else (math.sin(theta), math.cos(theta))
    unit = _rate(placed)

    def matrix(w, s, c):
        J = b.jacobian(np.array([w, 0.0, 0.0]), np.array([cos, sin * s, sin * c]))
        columns = np.zeros((6, 3))
        columns[1, 0] = columns[2, 1] = unit
        columns[3:, 2] = sin, -cos * s, -cos * c
        rows = (J @ columns)[1:4]
        return rows / np.array([unit, unit, sin])[:, None]

    up = matrix(0.0, 0.0, 1.0)
    down = matrix(0.0, 0.0, -1.0)
    side = matrix(0.0, 1.0, 0.0)
    fast = matrix(unit, 0.0, 1.0)
    constant = 0.5 * (up + down)
    M = np.ascontiguousarray([constant, (fast - up) / unit, side - constant, up - constant])
    slip = 4.0 * ROUNDING * np.linalg.cond(b.A)
    return Linear(M, slip, placed.case == CASE_B and not placed.six[:2].any())


def _rate(placed):
    """A rate of the size of those of the reduced flow, the unit of w2 and w3: then M is balanced."""
    b, six = placed.system, np.abs(placed.six)
    return math.sqrt((np.abs(b.C).max() + np.abs(b.s).max()) / b.A[0, 0]) + six[:2].max() or 1.0


def at_rest(placed, phi, bar):
    """The TransversalStability of the equilibrium at phi, known within its bar."""
    beside = linear(placed)
    matrix = beside.at(phi, 0.0)
    off = beside.slip * beside.size(0.0) + bar * sum(
        np.linalg.norm(m, np.inf) for m in beside.M[2:]
    )
    if placed.case == CASE_A:
        return of_matrix(matrix, off)
    trace, minors = np.trace(matrix), _minors(matrix)
    size = np.linalg.norm(matrix, np.inf)
    trace, trace_bar = (0.0, 0.0) if beside.free else (trace, 3.0 * (off + 4.0 * EPS * size))
    roots, bars = quadratic(
        trace, minors, trace_bar, minors_bar := 6.0 * (off + 4.0 * EPS * size) * size
    )
    order = np.argsort(-roots.real, kind="stable")
    roots, bars = roots[order], bars[order]
    stable = _negative([trace, -minors], [trace_bar, minors_bar], beside.free)
    growth = (
        0.5 * trace if minors - minors_bar > (0.5 * abs(trace) + trace_bar) ** 2 else roots[0].real
    )
    growth_bar = 0.5 * trace_bar if growth == 0.5 * trace else bars[0]
    return TransversalStability(roots, bars, float(growth), float(growth_bar), stable)


def _minors(matrix):
    """Sum of the principal minors of order 2."""
    return 0.5 * (np.trace(matrix) ** 2 - np.trace(matrix @ matrix))


def _negative(numbers, bars, neutral):
    """Are all numbers negative? The first may be exactly 0 where that is `neutral`: nothing grows
    or decays.
    """
    pairs = list(zip(numbers, bars, strict=True))
    if any(x - bar > 0.0 for x, bar in pairs):
        return UNSTABLE
    return STABLE if all(x + bar < 0.0 for x, bar in pairs[int(neutral) :]) else UNDECIDED


def quadratic(total, product, total_bar, product_bar):
    """Both roots of x^2 - total x + product, with bars that hold near a double root too."""
    middle, square = 0.5 * total, 0.25 * total * total - product
    root = np.sqrt(complex(square))
    large = middle + (root if middle * root.real >= 0.0 else -root)
    other = product / large if root.imag == 0.0 and large != 0.0 else middle - (large - middle)
    roots = np.array([large, other])
    gap = 2.0 * abs(root)
    bars = []
    for x in roots:
        off = 1.1 * (abs(x) * total_bar + product_bar) + total_bar * total_bar
        rest = gap * gap - 4.0 * off
        bars.append(
            2.0 * off / (gap + math.sqrt(rest))
            if rest > 0.0
            else 0.5 * gap + math.sqrt(0.25 * gap * gap + off)
        )
    return roots, 1.01 * np.array(bars) + 4.0 * EPS * np.abs(roots)


def of_matrix(matrix, off):
    """Eigenvalues of a real matrix known within `off` (a norm), as exponents; near a defective one
    with wide bars.
    """
    if not np.isfinite(matrix).all():
        return NOTHING
    values, vectors = np.linalg.eig(matrix)
    size = np.linalg.norm(matrix)
    n = len(matrix)
    off = n * off + 8.0 * n * EPS * size
    with np.errstate(all="ignore"):
        try:
            left = np.linalg.inv(vectors)
            condition = np.linalg.norm(left, axis=1) * np.linalg.norm(vectors, axis=0)
        except np.linalg.LinAlgError:
            condition = np.full(n, np.inf)
    apart = np.array(
        [min([abs(x - y) for j, y in enumerate(values) if j != i]) for i, x in enumerate(values)]
    )
    first = 2.0 * condition * off
    # Elsner's bound, for any matrix
    wide = 2.0 * (2.0 * size + off) ** (1.0 - 1.0 / n) * off ** (1.0 / n)
    bars = np.where(first < 0.1 * apart, first, np.minimum(np.maximum(first, apart), wide))
    bars = np.where(np.isfinite(bars), bars, wide)
    order = np.lexsort((values.imag, -values.real))
    values, bars = values[order], bars[order]
    high, low = np.max(values.real + bars), np.max(values.real - bars)
    stable = STABLE if high < 0.0 else UNSTABLE if low > 0.0 else UNDECIDED
    middle = values.real.max()
    return TransversalStability(
        values, bars, float(middle), float(max(high - middle, middle - low)), stable
    )


def along(placed, start, rotates):
    """The TransversalStability of the periodic motion from `start` (phi, w and their bars):
    multipliers over a period, growth per unit of time.

    Where the motion does not close within the bars, NOTHING.
    """
    beside = linear(placed)
    p = np.ascontiguousarray(coefficients(*placed.six))
    start, bars = np.array(start[:2], float), np.array(start[2:], float)
    found = [
        _monodromy(beside, p, start + side * bars, rotates)
        for side in ((0.0, 1.0, -1.0) if bars.any() else (0.0,))
    ]
    if any(one is None for one in found):
        return NOTHING
    matrix, (period, period_bar, log_det, log_bar, off) = found[0]
    for other, notes in found[1:]:  # what the start is off
        off = max(off, found[0][1][kernel.MATRIX_BAR] + 1.2 * np.abs(other - matrix).max())
        period_bar = max(
            period_bar, found[0][1][kernel.PERIOD_BAR] + 1.2 * abs(notes[kernel.PERIOD] - period)
        )
        log_bar = max(
            log_bar, found[0][1][kernel.LOG_DET_BAR] + 1.2 * abs(notes[kernel.LOG_DET] - log_det)
        )
    if not (log_bar < 1.0 and period_bar < 0.1 * period):
        return NOTHING
    lasting = {"period": period, "period_bar": period_bar}
    if placed.case == CASE_A:
        found = of_matrix(matrix, 3.0 * off)
        sizes = np.abs(found.values)
        high, low = np.max(sizes + found.bars), np.max(sizes - found.bars)
        stable = STABLE if high < 1.0 else UNSTABLE if low > 1.0 else UNDECIDED
        order = np.argsort(-sizes, kind="stable")
        return _timed(found.values[order], found.bars[order], stable, lasting)
    log_det, log_bar = (0.0, 0.0) if beside.free else (log_det, log_bar)
    total, total_bar = np.trace(matrix) - 1.0, 3.0 * off + 4.0 * EPS * np.abs(np.diag(matrix)).max()
    product = math.exp(log_det)
    product_bar = 1.1 * product * (log_bar + EPS)
    values, bars = quadratic(total, product, total_bar, product_bar)
    order = np.argsort(-np.abs(values), kind="stable")
    stable = _negative(
        [log_det, abs(total) - 1.0 - product], [log_bar, total_bar + product_bar + 2.0 * EPS * (1.0 + product)],
        beside.free,
    )  # fmt: skip
    found = _timed(values[order], bars[order], stable, lasting)
    # a pair of complex multipliers
    if 4.0 * (product - product_bar) > (abs(total) + total_bar) ** 2:
        growth, bar = 0.5 * log_det / period, 0.5 * log_bar / period
        return replace(
            found, growth=growth, growth_bar=bar + abs(growth) * (1.1 * period_bar / period + EPS)
        )
    return found


def _monodromy(beside, p, start, rotates):
    """The matrix over a period and what the kernel notes of it; None where the motion does not close."""
    matrix = np.empty((kernel.SIZE, kernel.SIZE))
    notes = np.zeros(5)
    closed = kernel.monodromy(p, beside.M, beside.slip, start, bool(rotates), matrix, notes)
    return (
        (matrix, notes)
        if closed and np.isfinite(matrix).all() and np.isfinite(notes).all()
        else None
    )


def _timed(values, bars, stable, lasting):
    """Multipliers over a period, the largest of which grows at a rate per unit of time."""
    period, period_bar = lasting["period"], lasting["period_bar"]
    sizes = np.abs(values)
    high, low, middle = np.max(sizes + bars), np.max(sizes - bars), np.max(sizes)
    if not (low > 0.0 and math.isfinite(high)):
        return TransversalStability(values, bars, np.nan, np.nan, stable, **lasting)
    growth = math.log(middle) / period
    bar = max(math.log(high / middle), math.log(middle / low)) / period
    return TransversalStability(
        values,
        bars,
        growth,
        bar + abs(growth) * (1.1 * period_bar / period + EPS),
        stable,
        **lasting,
    )


def fast(placed):
    """That of a spin-up, w -> +-inf: unstable where A11 lies between the other two principal moments,
    else undecided.

    To leading order d(w2, w3)/dt = w S^-1 J (S - A11) (w2, w3): the squares of its exponents are
    -det(S - A11)/det S.
    """
    S, a = placed.system.A[1:, 1:], placed.system.A[0, 0]
    between = np.linalg.det(S - a * np.eye(2)) if placed.case != VERTICAL else 0.0
    scale = (np.abs(S).max() + a) ** 2
    return UNSTABLE if between < -100.0 * ROUNDING * scale else UNDECIDED


def steady(system, w, nu, off=0.0):
    """That of a fixed point (w, nu) of the whole body at its k and |nu| = 1: four exponents.

    `off` is what the state may be off. Where A nu vanishes it cannot: k always moves with w.
    """
    J = system.jacobian(w, nu)
    momentum = system.A @ w + system.moment
    tangent = _normal_to(nu)  # (3, 2)
    along_nu = system.A @ nu
    spins = _normal_to(along_nu)
    frame = np.zeros((6, 4))
    frame[:3, :2] = spins
    frame[3:, 2:] = tangent
    frame[:3, 2:] = -np.outer(along_nu, momentum @ tangent) / (along_nu @ along_nu)  # keeps k
    image = J @ frame
    matrix = np.vstack([spins.T @ image[:3], tangent.T @ image[3:]])
    # the part of w along A nu follows from the rest
    size = np.abs(J).max()
    unit = math.sqrt(max(np.abs(matrix[:2, 2:]).max(), 1e-300))
    scale = np.array([unit, unit, 1.0, 1.0]) if unit > 1e-100 else np.ones(4)
    matrix = matrix * scale[None, :] / scale[:, None]
    slip = (
        (ROUNDING + off)
        * np.linalg.cond(system.A)
        * max(np.abs(matrix).max(), size * min(1.0, unit))
    )
    return of_matrix(matrix, slip)


def _normal_to(v):
    """Two orthonormal columns normal to v."""
    return np.linalg.svd(v[None, :])[2][1:].T
