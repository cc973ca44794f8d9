"""Dense maps of a linear periodic system: the characteristic polynomial as Chebyshev series in one
or two parameters.

Where A is analytic in the parameters so is the polynomial. Its coefficients are series on panels of the map, solved at
their nodes; panels on which they converge slowly, or vary by more orders than the accuracy allows, are halved. A point
is answered from the series alone (`kernels.floquet.characteristic`); one whose verdict or accuracy these leave open,
or whose Krein signs, is solved on its own. For symplectic and reversible systems the polynomial is
that of the s = l + 1 / l, and Krein signs come from the traces of J times polynomials of M: with
adj(l - M) = sum_k l^(n-1-k) B_k and v the eigenvector of l, |v|^2 / (v* i J v) = tr(adj(l - M) i J)
/ p'(l).

The bound of a coefficient: those at the nodes times the largest magnitudes that their Lagrange
polynomials have in a part of the panel, the tails of the series, and rounding; it is
tested at a few points that are not nodes. All depends on the axes of the map, never on the block.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 4, 8 and
15; F. R. Gantmacher, The Theory of Matrices (1959), IV.4 (B_k).
"""

import threading
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from survey import waiting
from survey.kernels.floquet import characteristic, leverrier, steps
from survey.kernels.floquet.characteristic import LANES, PARTS
from survey.kernels.math import chebyshev
from survey.kernels.math.roundoff import EPS
from survey.measures.floquet import monodromy
from survey.measures.floquet.answers import Answers
from survey.measures.floquet.multipliers import not_symplectic

DEGREES = np.arange(8, 42, 2)
# nodes of the lines that show the degrees that are needed: at first, and where these are too few
FEW_PROBED, PROBED = 32, 48
POINTS_PER_NODE = 4  # a panel pays if there are this many points for each that it solves
SMALLEST = 16  # points of an axis
FEWEST = 4096  # points on their own from which on series pay
BEST, SHARE = 1e-14, 1e-3  # accuracy of M at the nodes; of the requested one, where that is less
FINER = 0.1  # of that accuracy, where it is what a panel lacks
MOST_DEEP = 12  # halvings
LEAST = 0.5  # the share of those that their own bounds answer, below which cutting is of no use
MOST = 0.9  # the share of the nodes answered to the requested accuracy from which on a panel serves
# points that are no nodes
TRIED = np.array([[0.137, -0.713], [-0.551, 0.318], [0.862, 0.907], [-0.934, -0.269]])
LARGEST = 12  # states
TOGETHER = 4096  # points that are answered together: what they need fits into the cache
SERVED = frozenset({"multiplier_re", "multiplier_im", "spectral_radius", "exponent", "period", "krein", "crossing",
                    "verdict"})  # fmt: skip
_ONE_AT_A_TIME = threading.Lock()


@dataclass(frozen=True)
class Axis:
    """An axis of the map: the parameter's number, the number of points, the least and the greatest
    coordinate, which is 1 / the parameter if `inverse`, else the parameter.
    """

    column: int
    number: int
    low: float
    high: float
    inverse: bool = False

    def coordinate(self, values):
        """Coordinates of values of the parameter, and values of coordinates."""
        return 1.0 / values if self.inverse else values

    @property
    def inverted(self):
        """The same axis with 1 / the coordinate."""
        return replace(self, low=1.0 / self.high, high=1.0 / self.low, inverse=not self.inverse)


@dataclass(frozen=True)
class SeriesMap:
    """What series are made for: they are the same for equal maps. `fixed`: values of all parameters."""

    system: object
    structure: str
    rtol: float
    asked: tuple[bool, ...]
    axes: tuple[Axis, ...]
    fixed: tuple[float, ...]

    @property
    def paired(self):
        """Is 1 / conj(l) a multiplier with l?"""
        return self.structure != "none"

    def points(self, *x):
        """Points (N, parameters) at positions of the axes."""
        out = np.tile(np.array(self.fixed), (len(x[0]), 1))
        for axis, values in zip(self.axes, x, strict=True):
            out[:, axis.column] = axis.coordinate(values)
        return out


@dataclass(frozen=True)
class RootPanel:
    """A part of the map: middles and radii of its sides, series (n1, K n2), their bounds (K, PARTS
    n1, PARTS n2), where n1 is 1 (K, 1, PARTS n2), and roots at the nodes.
    """

    middle: tuple[float, ...]
    radius: tuple[float, ...]
    series: np.ndarray
    doubts: np.ndarray
    starts: np.ndarray

    @property
    def sizes(self):
        """The numbers of nodes (n1, n2)."""
        return self.starts.shape[:2]


def flags(wanted):
    """What the kernel is asked for (see `kernels.floquet.characteristic`), by names of outputs."""
    groups = (
        {"multiplier_re", "multiplier_im"},
        {"spectral_radius", "exponent"},
        {"verdict"},
        {"crossing"},
        {"krein"},
    )
    return tuple(bool(group & wanted) for group in groups)


def axes_of(lines):
    """The Axes of a map that series may serve, from {column: (number, low, high)}: two at most, the
    longest.
    """
    some = [
        Axis(column, *line)
        for column, line in lines.items()
        if line[0] >= SMALLEST and line[2] > line[1]
    ]
    return tuple(
        sorted(sorted(some, key=lambda a: (-a.number, a.column))[:2], key=lambda a: a.column)
    )


def _by_period(system, axes, fixed):
    """The axes, with 1 / the parameter where the period is more nearly linear in it, as in that of a
    frequency: M depends on products of the period and A, and series converge faster.
    """
    if not callable(system.period):
        return axes
    middles = {axis.column: 0.5 * (axis.low + axis.high) for axis in axes}
    found = []
    for axis in axes:
        bends = []
        for one in (axis, axis.inverted) if axis.low * axis.high > 0.0 else ():
            points = np.tile(fixed, (3, 1))
            for column, middle in middles.items():
                points[:, column] = middle
            points[:, axis.column] = one.coordinate(np.linspace(one.low, one.high, 3))
            with np.errstate(all="ignore"):
                first, second, third = system.periods(points)
            bends.append(abs(first - 2.0 * second + third))
        found.append(axis.inverted if bends and bends[1] < 0.5 * bends[0] else axis)
    return tuple(found)


def serves(system, structure, wanted, lines):
    """May series answer the points?"""
    return _of_series(system, structure, wanted) and bool(axes_of(lines))


def serves_scattered(system, structure, wanted, ranges):
    """May series answer points on their own, whose parameters lie within `ranges`, {column:
    (number, low, high)}?
    """
    known = _of_series(system, structure, wanted) and len(ranges) == 2
    return known and all(number >= FEWEST and high > low for number, low, high in ranges.values())


def _of_series(system, structure, wanted):
    paired_odd = structure != "none" and system.n % 2
    return wanted <= SERVED and system.n <= LARGEST and not paired_odd and system.conserved is None


def solve(system, structure, points, rtol, wanted, lines, answer):
    """Answer the points (..., parameters) of a block that series serve; returns those (N, bool)
    still to be solved.

    `points` has the block's axes first; a parameter in `lines` varies along one of them.
    """
    axes = axes_of(lines)
    shape = points.shape[:-1]
    index = np.arange(np.prod(shape)).reshape(shape)
    along = []
    for axis in axes:
        own = points[..., axis.column]
        varies = [k for k in range(len(shape)) if (own.take(0, k) != own.take(-1, k)).any()]
        along.append(varies[0] if varies else None)
    for k in along:
        index = index[..., None] if k is None else index
    moved = [
        k if k is not None else len(shape) + along[:i].count(None) for i, k in enumerate(along)
    ]
    index = np.moveaxis(index, moved, range(-len(axes), 0))
    index = index.reshape(-1, *index.shape[-len(axes) :])
    flat = points.reshape(-1, points.shape[-1])
    left = np.ones(index.size, bool)
    for own in index:
        own = own.reshape(len(own), -1) if len(axes) == 2 else own.reshape(1, -1)
        fixed = flat[own[0, 0]].copy()
        fixed[[axis.column for axis in axes]] = 0.0
        if not np.isfinite(fixed).all():
            continue
        key = SeriesMap(
            system, structure, rtol, flags(wanted), _by_period(system, axes, fixed), tuple(fixed)
        )
        with _ONE_AT_A_TIME:
            found = panels(key)
        first, last = key.axes[0], key.axes[-1]
        rows = first.coordinate(flat[own[:, 0], first.column]) if len(axes) == 2 else np.zeros(1)
        columns = last.coordinate(flat[own[0], last.column])
        free = np.ones(own.shape, bool)
        for panel in found:
            x, y = (_scaled(values, panel, k) for k, values in ((0, rows), (-1, columns)))
            if len(axes) == 1:
                x = np.zeros(1)
            inside = np.flatnonzero(abs(x) <= 1.0), np.flatnonzero(abs(y) <= 1.0)
            if not (inside[0].size and inside[1].size):
                continue
            _answer(key, panel, x[inside[0]], y[inside[1]], own[np.ix_(*inside)], answer)
            free[np.ix_(*inside)] = False
        left[own[~free]] = False
    left |= answer.missed
    return left


def scattered(system, structure, points, rtol, wanted, ranges, answer):
    """As `solve`, of points (N, parameters) on their own that differ in the two parameters of
    `ranges` alone.
    """
    column, left = sorted(ranges), np.ones(len(points), bool)
    # a map of as many points
    axes = tuple(Axis(k, int(ranges[k][0] ** 0.5), *ranges[k][1:]) for k in column)
    fixed = points[0].copy()
    fixed[column] = 0.0
    if not np.isfinite(fixed).all():
        return left
    axes = _by_period(system, axes, fixed)
    key = SeriesMap(system, structure, rtol, flags(wanted), axes, tuple(fixed))
    with _ONE_AT_A_TIME:
        found = panels(key)
    at = [axis.coordinate(points[:, axis.column]) for axis in axes]
    for panel in found:
        x = np.stack([_scaled(values, panel, side) for side, values in enumerate(at)])
        inside = np.flatnonzero(left & (abs(x) <= 1.0).all(axis=0))
        if inside.size:
            _answer_points(key, panel, np.ascontiguousarray(x[:, inside]), inside, answer)
            left[inside] = False
    return left | answer.missed


def _scaled(values, panel, side):
    """Positions from -1 to 1; at an end rounding may leave it by what the bounds allow for."""
    middle, radius = panel.middle[side], panel.radius[side]
    x = (values - middle) / radius
    most = 1.0 + 4 * EPS * max(1.0, abs(middle) / radius)
    return np.where(abs(x) <= most, np.clip(x, -1.0, 1.0), x)


def _answer(key, panel, x, y, outputs, answer):
    """Answer the points of a panel at x (rows), y (columns), between -1 and 1."""
    n1, n2 = panel.sizes
    waiting.wait("series")
    near = _part(x, n1), _part(y, n2)
    columns = min(len(y), TOGETHER)
    rows = max(1, TOGETHER // columns)
    blocks = _Blocks(key, panel, rows * -(-columns // LANES))
    for i in range(0, len(x), rows):
        for j in range(0, len(y), columns):
            own, places = slice(i, i + rows), slice(j, j + columns)
            some = np.ascontiguousarray(outputs[own, places])
            given = (
                panel.series, panel.doubts, np.ascontiguousarray(x[own]), np.ascontiguousarray(y[places]),
                np.concatenate([near[0][own], near[1][places]]), panel.starts, some, blocks.needed,
            )  # fmt: skip
            used = blocks.first(len(some) * -(-some.shape[1] // LANES))
            characteristic.fill_rows(*given, *used)
            blocks.answer(used, answer)


def _answer_points(key, panel, x, outputs, answer):
    """Answer the points of a panel at x (2, N), each between -1 and 1."""
    n1, n2 = panel.sizes
    waiting.wait("series")
    near = np.stack([_part(x[0], n1), _part(x[1], n2)])
    # terms beyond these, of all n2 series, are a tenth of the bounds at most
    rest = np.cumsum(abs(panel.series[::-1]), axis=0)[::-1].reshape(n1, -1, n2)
    terms = (rest > 0.1 * panel.doubts.min(axis=(1, 2))[:, None] / n2).sum(axis=0)
    doubts, blocks = 1.1 * panel.doubts, _Blocks(key, panel, TOGETHER // LANES)
    for i in range(0, len(outputs), TOGETHER):
        own = slice(i, i + TOGETHER)
        given = (
            panel.series, terms, doubts, np.ascontiguousarray(x[:, own]), np.ascontiguousarray(near[:, own]),
            panel.starts, outputs[own], blocks.needed,
        )  # fmt: skip
        used = blocks.first(-(-len(outputs[own]) // LANES))
        characteristic.fill_points(*given, *used)
        blocks.answer(used, answer)


class _Blocks:
    """What `characteristic.answer` takes, of a number of blocks of points."""

    def __init__(self, key, panel, number):
        self.key, self.asked = key, np.array(key.asked)
        K, d = len(panel.doubts), panel.starts.shape[2]
        self.needed = d if characteristic.is_short(key.system.n, self.asked) else K
        self.arrays = characteristic.blocks(number, K, d)

    def first(self, number):
        """The arrays of the first blocks."""
        return tuple(values[:number] for values in self.arrays)

    def answer(self, used, answer):
        key = self.key
        characteristic.answer(
            *used, True, key.system.n, key.paired, self.asked, key.rtol, answer.floats, answer.signs, answer.verdict,
            answer.crossing, answer.missed,
        )  # fmt: skip


def _part(x, n):
    """The number of the part that holds x, of which each of n nodes has PARTS, all equal in the
    angle; 0 if n is 1.
    """
    last = n * PARTS - 1 if n > 1 else 0
    return np.clip(
        (np.arccos(np.clip(x, -1.0, 1.0)) * (n * PARTS / np.pi)).astype(np.int64), 0, last
    )


@lru_cache(maxsize=32)
def panels(key):
    """The RootPanels of a SeriesMap, in which its points are looked for in this order: the same for all blocks."""
    number = [axis.number for axis in key.axes]
    budget = float(np.prod(number)) / POINTS_PER_NODE
    left = [(tuple((axis.low, axis.high) for axis in key.axes), 0)]
    found = []
    while left:
        sides, depth = left.pop(0)
        share = [
            n * (b - a) / (axis.high - axis.low)
            for n, (a, b), axis in zip(number, sides, key.axes, strict=True)
        ]
        made, spent, cut = _panel(key, sides, min(budget, float(np.prod(share)) / POINTS_PER_NODE))
        budget -= spent
        if made is not None:
            found.append(made)
        elif cut is not None and depth < MOST_DEEP:
            low, high = sides[cut]
            for one in ((low, 0.5 * (low + high)), (0.5 * (low + high), high)):
                left.append(((*sides[:cut], one, *sides[cut + 1 :]), depth + 1))
    return tuple(found)


def _panel(key, sides, budget):
    """(the RootPanel or None, points solved, the side to be cut or None) of a part of the map, within a
    budget.
    """
    middle = tuple(0.5 * (a + b) for a, b in sides)
    radius = tuple(0.5 * (b - a) for a, b in sides)
    degrees, spent, known = _degrees(key, middle, radius, budget)
    if degrees is None:
        return None, spent, None
    longest = int(np.argmax(degrees))
    if degrees[longest] > DEGREES[-1]:
        return None, spent, longest
    # the nodes of a line by itself that have shown the degree serve as they are
    alone = len(degrees) == 1
    sizes = [PROBED] if alone else [int(DEGREES[np.searchsorted(DEGREES, n)]) for n in degrees]
    x = np.stack(
        np.meshgrid(*map(chebyshev.symmetric_nodes, sizes), indexing="ij"), axis=-1
    ).reshape(-1, len(sizes))
    tried = TRIED[:, : len(sizes)]
    if not alone:
        if spent + np.prod(sizes) > budget:
            return None, spent, None
        known = _coefficients(key, middle, radius, np.concatenate([x, tried]))
        spent += len(x) + len(tried)
        if known is None:
            return None, spent, None
    panel, cut = _tested(key, middle, radius, sizes, x, tried, *known)
    if panel is None and SHARE * key.rtol > BEST and spent + len(x) + len(tried) <= budget:
        # where multipliers are close to each other, more accurate nodes may do
        values, bars = known
        if _tested(key, middle, radius, sizes, x, tried, values, FINER * bars)[0] is not None:
            known = _coefficients(key, middle, radius, np.concatenate([x, tried]), FINER)
            spent += len(x) + len(tried)
            if known is not None:
                panel, cut = _tested(key, middle, radius, sizes, x, tried, *known)
    return panel, spent, cut


def _tested(key, middle, radius, sizes, x, tried, values, bars):
    """(the RootPanel of values and bounds at the nodes x and at `tried`, None) if it serves, else (None, the
    side to be cut or None).
    """
    panel = _expanded(key, middle, radius, sizes, values[: len(x)], bars[: len(x)])
    if panel is None:
        return None, int(np.argmax(sizes))
    served = _served(key, panel, x)
    if served >= MOST and _holds(panel, tried, values[len(x) :], bars[len(x) :]):
        return panel, None
    # what varies most is cut: the size of the coefficients, or what they need
    own = bars[: len(x)].T.reshape(-1, *(sizes if len(sizes) == 2 else (1, sizes[0])))
    nodes_alone = replace(panel, doubts=_in_parts(own))
    hopeless = _served(key, nodes_alone, x) < LEAST
    return None, None if hopeless else _steepest(sizes, values[: len(x)])


def _degrees(key, middle, radius, budget):
    """The number of nodes that each side asks for, beyond DEGREES if none is enough; the points
    solved; and, on a line by itself, what `_coefficients` gives at its PROBED nodes and at TRIED.
    """
    sides = len(middle)
    ends = [0.0] if sides == 1 else [-0.97, 0.97]
    if 2.0 * PROBED * sides * len(ends) > budget:
        return None, 0, None
    needed, spent, open_ = np.zeros(sides, np.int64), 0, list(range(sides))
    for number in (PROBED,) if sides == 1 else (FEW_PROBED, PROBED):
        x = chebyshev.symmetric_nodes(number)
        lines = [np.stack([x if k == side else np.full(number, end) for k in range(sides)], axis=1)
                 for side in open_ for end in ends]  # fmt: skip
        given = np.concatenate([*lines, TRIED[:, :1]] if sides == 1 else lines)
        known = _coefficients(key, middle, radius, given)
        spent += len(given)
        if known is None:
            return None, spent, None
        values, bars = (
            part[: number * len(lines)].reshape(len(open_), -1, number, part.shape[1])
            for part in known
        )
        for side, *own in zip(open_, values, bars, strict=True):
            terms = max(_terms(key, *line) for line in zip(*own, strict=True))
            needed[side] = terms + 4 if terms < number - 4 else 10 * PROBED
        open_ = [side for side in open_ if needed[side] > PROBED]
        if not open_:
            break
    return needed, spent, known


def _terms(key, line, bars):
    """The number of terms that count in the series of coefficients (nodes, K) known within `bars`."""
    series = abs(chebyshev.by_columns(len(line)).T @ line)
    noise = np.maximum(0.25 * bars.max(axis=0), 1e-15 * abs(line).max(axis=0))
    noise = np.maximum(noise, 1e-3 * key.rtol * (1.0 + abs(line).min(axis=0)))
    return 1 + int(np.flatnonzero((series > noise).any(axis=1)).max(initial=0))


def _coefficients(key, middle, radius, x, share=1.0):
    """Coefficients (N, K) of the polynomial at x (N, sides) on a panel, and their bounds; None if
    there are none. `share`: of the accuracy of M that is usual there.
    """
    points = key.points(
        *(m + r * x[:, k] for k, (m, r) in enumerate(zip(middle, radius, strict=True)))
    )
    return at_points(key.system, key.structure, points, max(BEST, share * SHARE * key.rtol))


def at_points(system, structure, points, accuracy):
    """Coefficients (N, K) of the polynomial at the points (N, parameters), from M to this accuracy, and
    their bounds; None where no series serves.
    """
    if not system.smooth(points[0]):
        return None
    with np.errstate(all="ignore"):
        own = monodromy.SystemPoints(system, points, halves=True, paired=structure != "none")
        if not _is_analytic(own):
            return None
        every = np.arange(len(points))
        n = system.n
        paired = structure != "none"
        out = np.empty(
            (2, len(points), n // 2 * (2 if structure == "symplectic" else 1) if paired else n)
        )

        def finish(some, matrices, scale, *steps_of):
            out[:, some] = coefficients(matrices.M, matrices.E, scale, structure, steps_of)
            units = scale[:, :, None] / scale[:, None, :]
            if (
                structure == "symplectic"
                and not_symplectic(units * matrices.M, units * matrices.E).any()
            ):
                out[:, some] = np.nan  # each point for itself

        method = monodromy.method_of("auto")
        monodromy.solve(own, method, accuracy, np.ones(len(points)), every, finish)
    return out if np.isfinite(out).all() else None


def is_analytic(system, points):
    """Is M analytic in the parameters about the points, as far as the code tells?"""
    if not system.smooth(points[0]):
        return False
    with np.errstate(all="ignore"):
        return _is_analytic(monodromy.SystemPoints(system, points))


def _is_analytic(own):
    programs = own.groups[0].programs if own.groups else ()
    same = all(group.programs is programs for group in own.groups)
    return own.valid.all() and same and all(p.analytic for p in programs)


def coefficients(M, E, scale, structure, steps_of=None):
    """Those of the polynomial but its first, 1, from the highest power on (N, K), and their bounds.

    M (N, n, n) are known within E, in the units `scale` (N, n) of the states; `steps_of`: see `monodromy.solve`, or
    None, where only E is known. For p(l) = l^n + c_1 l^(n-1) + ... dc_k = -tr(B_(k-1) dM). c_k comes from B_(k-1), or,
    where rounding asks for it, from the computed eigenvalues, which are those of a matrix within 8 n EPS |M| of M.
    """
    N, n = M.shape[:2]
    m = n // 2
    kept = n if structure == "none" else m
    M, E, units = (np.ascontiguousarray(values) for values in (M, E, scale))
    powers, sums = np.empty((N, kept, n, n)), np.empty((N, 5, n + 1))
    unknown = np.full((N, n + 1), np.inf)
    leverrier.coefficients(M, E, units, unknown, unknown, np.zeros(N), powers, sums)
    rounded = sums[:, 1, 1 : kept + 1]
    if steps_of is None:
        more = sums[:, 2, 1 : kept + 1] - rounded
    else:
        more = np.empty((N, kept))
        steps.gradients(*steps_of, powers, more)
        more *= 1.001
    rough = np.flatnonzero(~(2.0 * rounded < more).all(axis=1))
    if rough.size:
        sums[rough] = _by_eigenvalues(M[rough], E[rough], units[rough])
    c, rounded, bars, *form = np.moveaxis(sums, 1, 0)
    c, bars = c[:, : kept + 1], bars[:, : kept + 1]
    if steps_of is not None:
        bars = rounded[:, : kept + 1].copy()
        bars[:, 1:] += more
    if structure == "none":
        return c[:, 1:], bars[:, 1:]
    values, doubts = _in_sums(c[:, ::-1], bars[:, ::-1], m)
    if structure == "symplectic":
        forms = _in_sums(*(part[:, m:0:-1] for part in form), m - 1)
        return np.concatenate([values[:, 1:], forms[0]], axis=1), np.concatenate(
            [doubts[:, 1:], forms[1]], axis=1
        )
    return values[:, 1:], doubts[:, 1:]


def _by_eigenvalues(M, E, units):
    """`sums` of `leverrier.coefficients` with the polynomial of the computed eigenvalues beside."""
    N, n = M.shape[:2]
    near = 8 * n * EPS * np.sqrt((M * M).sum(axis=(1, 2)))
    own = np.linalg.eigvals(M).astype(complex)
    c, moduli = np.zeros((N, n + 1), complex), np.zeros((N, n + 1))
    c[:, 0] = moduli[:, 0] = 1.0
    for i in range(n):
        c[:, 1 : i + 2] -= own[:, i, None] * c[:, : i + 1]
        moduli[:, 1 : i + 2] += abs(own[:, i, None]) * moduli[:, : i + 1]
    others = np.ascontiguousarray(c.real), 4 * n * EPS * moduli
    sums = np.empty((N, 5, n + 1))
    leverrier.coefficients(M, E, units, *others, near, np.empty((N, 0, n, n)), sums)
    return sums


def _in_sums(c, bars, m):
    """The sum of c_j (l^j + l^-j), c_0 once, as a polynomial of s = l + 1 / l, highest power first,
    and bounds.
    """
    change = sums_of_powers(m)
    return (c @ change)[:, ::-1], ((bars + 4 * EPS * abs(c)) @ abs(change))[:, ::-1]


@lru_cache
def sums_of_powers(m):
    """Row j: l^j + l^-j (1 for j = 0) as a polynomial of s = l + 1 / l, from the constant term on
    (m + 1, m + 1).
    """
    rows = np.zeros((m + 1, m + 1))
    before, own = np.zeros((2, m + 1))
    before[0] = 2.0
    rows[0, 0] = 1.0
    if m:
        own[1] = rows[1, 1] = 1.0
    for j in range(2, m + 1):
        before, own = own, np.roll(own, 1) - before
        rows[j] = own
    return rows


def _expanded(key, middle, radius, sizes, values, bars):
    """The RootPanel of values (nodes, K) at the nodes; None if a bound is not finite."""
    K = values.shape[1]
    ulps = [
        (4 + (1 + axis.inverse) * (abs(m) + r)) / r
        for axis, m, r in zip(key.axes, middle, radius, strict=True)
    ]
    n1, n2 = sizes if len(sizes) == 2 else (1, sizes[0])
    series = np.empty((n1, K, n2))
    doubts = []
    for k in range(K):
        grid = values[:, k].reshape(n1, n2)
        own, doubt = chebyshev.expand(grid, chebyshev.by_columns(n2), ulps[-1])
        total = (
            doubt[:, None] + bars[:, k].reshape(n1, n2) @ chebyshev.largest_lagrange(n2, PARTS).T
        )
        if n1 > 1:
            own, tail = chebyshev.transform(own, chebyshev.by_columns(n1), ulps[0])
            total = tail + chebyshev.largest_lagrange(n1, PARTS) @ total
        series[:, k] = own
        doubts.append(1.0001 * total)  # rounding of these sums
    doubts = np.array(doubts)
    if not np.isfinite(doubts).all():
        return None
    d = key.system.n // (2 if key.paired else 1)
    starts = characteristic.roots(np.ascontiguousarray(values[:, :d])).reshape(n1, n2, d, 2)
    return RootPanel(middle, radius, series.reshape(n1, K * n2), doubts, starts)


def _in_parts(bars):
    """Bounds (K, n1, n2) at the nodes, in the parts next to each."""
    along = np.repeat(bars, PARTS, axis=2)
    return np.repeat(along, PARTS, axis=1) if bars.shape[1] > 1 else along


def _served(key, panel, x):
    """The share of positions x that the panel answers as asked."""
    n1 = len(panel.series)
    rows = x[:, 0].reshape(n1, -1)[:, 0] if x.shape[1] == 2 else np.zeros(1)
    columns = x[:, -1].reshape(n1, -1)[0]
    answer = Answers(len(x), key.system.n)
    _answer(key, panel, rows, columns, np.arange(len(x)).reshape(rows.size, columns.size), answer)
    return 1.0 - answer.missed.mean()


def _holds(panel, x, values, bars):
    """Are the series within their bounds where points were solved on their own?"""
    K = len(panel.doubts)
    series = panel.series.reshape(len(panel.series), K, -1)
    for at, value, bar in zip(x, values, bars, strict=True):
        one = np.cos(np.arange(series.shape[2]) * np.arccos(at[-1]))
        two = np.cos(np.arange(len(series)) * np.arccos(at[0])) if len(series) > 1 else np.ones(1)
        off = abs(np.einsum("i,ikj,j->k", two, series, one) - value)
        here = panel.doubts[:, _part(at[0], len(series)), _part(at[-1], series.shape[2])]
        if not (off <= here + bar).all():
            return False
    return True


def _steepest(sizes, values):
    """The side along which the coefficients' size varies most, or that has the more nodes."""
    if len(sizes) == 1:
        return 0
    size = np.log(1.0 + abs(values).max(axis=1)).reshape(sizes)
    spread = [np.ptp(size, axis=k).max() for k in range(2)]
    if max(spread) > 1.0 + min(spread):
        return int(np.argmax(spread))
    return int(np.argmax(sizes))
