"""The verdict of a Hill problem everywhere in cells of a plane of two parameters, so that no tongue
is missed.

The half-period factors are analytic in the parameters, so on blocks small enough each is its tensor
Chebyshev series to within a bound: the bounds at its nodes times the Lebesgue constants, the tails
of the series, and rounding. A series that misses the factor between its nodes has that in its
tails. Where a series no longer serves, the halves of its block are solved, unless they are of few cells; all
other halving is done on the series alone (`survey.kernels.hill.cells`).

Sources: W. Magnus, S. Winkler, Hill's Equation (1966), theorem 1.1; L. N. Trefethen, Approximation
Theory and Approximation Practice (2013), chapters 3, 8, 15.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev

from survey.kernels.hill.answers import STABLE, UNDECIDED, UNSTABLE
from survey.kernels.hill.cells import (
    AXIS,
    BLOCK,
    ENOUGH,
    HALVED_X,
    HALVED_Y,
    INDEX_X,
    INDEX_Y,
    STABLE_PART,
    UNSOLVED,
    UNSTABLE_PART,
    VERDICT,
    descend,
)
from survey.kernels.math.chebyshev import lebesgue, nodes, tail, to_coefficients
from survey.kernels.math.roundoff import EPS
from survey.measures.hill.edges import FACTORS, has_factors
from survey.measures.tasks import in_turn

OUTPUTS = FACTORS  # what `find` asks of the scene
VERDICTS = {"undecided": UNDECIDED, "unstable": UNSTABLE, "stable": STABLE}
NODES = 16
CHECK = 0.539  # near an extremum of T_16, and of no period with it
START = 2  # halvings of the first blocks
BATCH = 16  # blocks of one task
MOST = 10_000_000  # cells
# On maps of more than 2^LARGE cells no block of fewer than 2^FEWEST cells is solved again. In `satellite_areas` those
# beside the excluded inertia ratio took two thirds of the time and decided none of 138,000 cells. Smaller maps have
# a lower limit, or none.
FEWEST, LARGE = 3, 12
# A cell between two of the smallest parts of each side; its VERDICT is where a leaf has it.
LOW_X, HIGH_X, LOW_Y, HIGH_Y = range(4)
MERGED = VERDICT + 1

X = nodes(NODES)
POINTS = np.append(X, CHECK)
POLYNOMIALS = chebyshev.chebvander(POINTS, NODES - 1)
TRANSFORM = to_coefficients(POLYNOMIALS[:NODES].T)
LEBESGUE = lebesgue(NODES)
DEGREE = np.arange(NODES)


@dataclass(frozen=True)
class Side:
    """A side of a rectangle: from `low` to `high`, halved at most `depth` times; `log`: at the
    geometric mean.
    """

    low: float
    high: float
    depth: int
    log: bool = False

    def at(self, part):
        """The parameter after the `part` (0 to 1) of the side; both ends exact."""
        inside = (
            self.low * (self.high / self.low) ** part
            if self.log
            else self.low * (1 - part) + self.high * part
        )
        return np.where(part == 0, self.low, np.where(part == 1, self.high, inside))

    def length(self, start, end):
        """The length of the side between two of its parts; nothing cancels."""
        if not self.log:
            return (self.high - self.low) * (end - start)
        rate = np.log(self.high / self.low)
        return self.at(start) * np.expm1(rate * (end - start))

    def halves(self):
        """Series on a cell -> on its lower and upper half: matrices (depth, 2, NODES, NODES)."""
        out = np.empty((self.depth, 2, NODES, NODES))
        for level in range(self.depth):
            middle = np.tanh(-0.25 * np.log(self.high / self.low) / 2**level) if self.log else 0.0
            for side, x in enumerate(
                ((middle + 1) / 2 * (X + 1) - 1, 1 - (1 - middle) / 2 * (1 - X))
            ):
                out[level, side] = TRANSFORM @ chebyshev.chebvander(x, NODES - 1)
        return out


@dataclass
class Cells:
    """`box` (M, 4): low and high along both axes; `verdict`; the areas `stable` and `unstable` at
    least, `total`.

    `points` were solved. Undecided cells are as small as the axes' depths allow.
    """

    box: np.ndarray
    verdict: np.ndarray
    stable: float
    unstable: float
    total: float
    points: int


def _factors(out):
    """The factors and their bounds (B, 4, n, n)."""
    values = np.stack([out[name] for name in FACTORS], axis=1)
    return values, np.stack([out[f"{name}_error"] for name in FACTORS], axis=1)


def serves(scene):
    """Are its cells found here?"""
    return has_factors(scene)


def by_factors(series, doubts, blocks, depth, halves):
    """The cells of blocks, and their number: see `kernels.hill.cells.descend`."""
    fewest = int(np.clip(depth.sum() - LARGE, 0, FEWEST))
    return descend(series, doubts, blocks, depth, halves, fewest)


def find(solve, x, y, each=in_turn, report=None, values=_factors, descend=by_factors):
    """The Cells of the rectangle of the Sides x and y.

    `solve(x, y)` gives the four factors with their error bounds at broadcast arrays of both
    parameters, NaN where there are none; `each`: see `measures.tasks`. `report(part, points)` is
    called with the part of the rectangle that is settled, and the number of points solved for it.
    `values(out)` makes functions and their bounds of what is solved, and `descend` decides cells by
    them. Raises OverflowError if there are more than MOST cells.
    """
    depth = np.array([x.depth, y.depth])
    halves = np.full((2, max(depth.max(), 1), 2, NODES, NODES), np.nan)
    halves[0, : x.depth], halves[1, : y.depth] = x.halves(), y.halves()
    todo = _first(depth)
    kept = []
    points = 0

    def task(blocks):
        leaves, count = descend(*_series(solve, x, y, blocks, values), blocks, depth, halves)
        return leaves[:count]

    while len(todo):
        batches = [todo[first : first + BATCH] for first in range(0, len(todo), BATCH)]
        leaves = np.concatenate(each(task, batches, "parts of the cells"))
        points += len(todo) * POINTS.size**2
        unsolved = leaves[:, VERDICT] == UNSOLVED
        todo = leaves[unsolved, :BLOCK].astype(np.int64)
        kept.append(leaves[~unsolved])
        if report:
            report(1 - float((0.5 ** (todo[:, HALVED_X] + todo[:, HALVED_Y])).sum()), points)
        if sum(map(len, kept)) > MOST:
            raise OverflowError(f"more than {MOST:,} cells")
    return _gathered(x, y, depth, np.concatenate(kept), points)


def accuracy(depth):
    """The rtol with which `find` asks for the factors where cells are halved so often: below what
    series leave out.
    """
    return float(np.clip(1e-2 * ENOUGH * 0.5**depth, 1e-13, 1e-9))


def _first(depth):
    """The first blocks (B, BLOCK), as `descend` takes them."""
    level = np.minimum(depth, START)
    i, j = (
        grid.reshape(-1)
        for grid in np.meshgrid(*(np.arange(1 << at) for at in level), indexing="ij")
    )
    blocks = np.empty((i.size, BLOCK), np.int64)
    blocks[:, HALVED_X], blocks[:, INDEX_X] = level[0], i
    blocks[:, HALVED_Y], blocks[:, INDEX_Y] = level[1], j
    return blocks


def _series(solve, x, y, blocks, of):
    """The functions' series (B, 4, n, n) on blocks, and what each leaves open: tails in x, in y,
    the rest (B, 4, 3).
    """
    middle_x, radius_x = _spans(x, blocks[:, HALVED_X], blocks[:, INDEX_X])
    middle_y, radius_y = _spans(y, blocks[:, HALVED_Y], blocks[:, INDEX_Y])
    out = solve(
        (middle_x[:, None] + radius_x[:, None] * POINTS)[:, :, None],
        (middle_y[:, None] + radius_y[:, None] * POINTS)[:, None, :],
    )
    values, bars = of(out)
    bars = bars.max(axis=(2, 3))
    series = TRANSFORM @ values[..., :NODES, :NODES] @ TRANSFORM.T
    size = abs(series)
    by_x, by_y = size.sum(axis=3), size.sum(axis=2)
    between = POLYNOMIALS @ series @ POLYNOMIALS.T
    missed_x = abs(values - between)[..., NODES, :NODES].max(axis=2)
    missed_y = abs(values - between)[..., :NODES, NODES].max(axis=2)
    # of the transform, and of the rounded points, where T_j' <= j^2
    rounding_x = 4 + DEGREE + DEGREE**2 * (1 + abs(middle_x) / radius_x)[:, None, None]
    rounding_y = 4 + DEGREE + DEGREE**2 * (1 + abs(middle_y) / radius_y)[:, None, None]
    noise = LEBESGUE**2 * bars + EPS * (
        (by_x * rounding_x).sum(axis=2) + (by_y * rounding_y).sum(axis=2)
    )
    tails = [
        np.maximum(2 * tail(by_x), 4 * (missed_x - noise)),
        np.maximum(2 * tail(by_y), 4 * (missed_y - noise)),
    ]
    return series, np.stack([*tails, noise], axis=2)


def _spans(side, halved, index):
    """Middle and half width, along one side, of blocks halved `halved` times and numbered `index`."""
    part = 0.5**halved
    low, high = side.at(index * part), side.at((index + 1) * part)
    return 0.5 * (low + high), 0.5 * (high - low)


def _gathered(x, y, depth, leaves, points):
    """The Cells: areas, and decided neighbours as one."""
    blocks = leaves[:, :BLOCK].astype(np.int64)
    cells = np.empty((len(leaves), MERGED), np.int64)
    cells[:, VERDICT] = leaves[:, VERDICT]
    for axis in (0, 1):
        halved, index = blocks[:, AXIS * axis + HALVED_X], blocks[:, AXIS * axis + INDEX_X]
        size = 1 << (depth[axis] - halved)
        cells[:, AXIS * axis + LOW_X] = index * size
        cells[:, AXIS * axis + HIGH_X] = (index + 1) * size
    parts = cells[:, :VERDICT] / np.repeat(2.0**depth, 2)
    area = x.length(parts[:, LOW_X], parts[:, HIGH_X]) * y.length(parts[:, LOW_Y], parts[:, HIGH_Y])
    stable, unstable = area @ leaves[:, STABLE_PART : UNSTABLE_PART + 1]
    merged = _merged(cells)
    parts = merged[:, :VERDICT] / np.repeat(2.0**depth, 2)
    sides = ((x, LOW_X), (x, HIGH_X), (y, LOW_Y), (y, HIGH_Y))
    box = np.column_stack([side.at(parts[:, at]) for side, at in sides])
    total = (x.high - x.low) * (y.high - y.low)
    return Cells(
        box, merged[:, VERDICT].astype(np.int8), float(stable), float(unstable), total, points
    )


def _merged(cells):
    """Decided cells (LOW_X to VERDICT) that share a whole side as one, sorted; undecided ones stay."""
    before = len(cells) + 1
    while len(cells) < before:
        before = len(cells)
        for low, high, *across in ((LOW_X, HIGH_X, LOW_Y, HIGH_Y), (LOW_Y, HIGH_Y, LOW_X, HIGH_X)):
            shared = [VERDICT, *across]
            cells = cells[np.lexsort(cells[:, [*shared, low]].T[::-1])]
            new = np.ones(len(cells), np.bool_)
            same = (cells[1:, shared] == cells[:-1, shared]).all(axis=1)
            new[1:] = (
                ~same | (cells[1:, low] != cells[:-1, high]) | (cells[1:, VERDICT] == UNDECIDED)
            )
            ends = cells[np.append(np.flatnonzero(new)[1:], len(cells)) - 1, high]
            cells = cells[new]
            cells[:, high] = ends
    return cells[np.lexsort((cells[:, LOW_Y], cells[:, LOW_X]))]
