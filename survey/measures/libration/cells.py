"""Danby's map everywhere in cells of mu and e: the verdict of whole cells, and the area of each verdict.

The traces a and b are analytic in mu and e, and with them P = b + 2a + 2, Q = b - 2a + 2, K = a^2 - 4b + 8 and 4 -+ a:
stable where all five are positive, unstable where one is negative (`scenes/libration_elliptic.md`, section 3). On a
block each is its tensor Chebyshev series to within a bound, as in `survey.measures.hill.cells`, whose series and cells
these are; the cells of a block are halved on the series alone, all of one size together.
"""

import numpy as np

from survey.kernels.hill.cells import ENOUGH, UNSOLVED
from survey.kernels.libration.traces import STABLE, UNDECIDED, UNSTABLE
from survey.kernels.math.roundoff import EPS
from survey.measures.hill import cells
from survey.measures.hill.cells import MOST, POINTS, Side
from survey.measures.tasks import in_turn

OUTPUTS = ("a", "b")
VERDICTS = {"undecided": UNDECIDED, "unstable": UNSTABLE, "stable": STABLE}

__all__ = ["MOST", "OUTPUTS", "POINTS", "VERDICTS", "Side", "accuracy", "find"]


def accuracy(depth):
    """The rtol with which `find` asks for a and b where cells are halved so often."""
    return cells.accuracy(depth)


def find(solve, x, y, each=in_turn, report=None):
    """The `hill.cells.Cells` of the rectangle of the Sides x and y; arguments as there."""
    return cells.find(solve, x, y, each, report, _values, _descend)


def _values(out):
    """The five functions and their bounds (B, 5, n, n) from a, b and theirs."""
    (a, da), (b, db) = ((out[name], out[f"{name}_error"].astype(float)) for name in OUTPUTS)
    size = 4.0 * EPS * (a * a + 4.0 * abs(b) + 8.0)
    values = (b + 2.0 * a + 2.0, b - 2.0 * a + 2.0, a * a - 4.0 * b + 8.0, 4.0 - a, 4.0 + a)
    linear = db + 2.0 * da + size
    bars = (linear, linear, 4.0 * db + 2.0 * abs(a) * da + da * da + size, da + size, da + size)
    return np.stack(values, axis=1), np.stack(bars, axis=1)


def _descend(series, doubts, blocks, depth, halves):
    """As `kernels.hill.cells.descend`: leaves (M, 7) of blocks, cells of one size halved together."""
    leaves, slack = [], doubts.sum(axis=2)
    own, where, of = series, blocks.astype(np.int64), np.arange(len(blocks))
    while len(where):
        verdict = _decided(own, slack[of])
        # a block whose own series is too loose is solved again, if it can be halved
        loose = (verdict == UNDECIDED) & (doubts[of][:, :, :2].sum(axis=2) > ENOUGH * _sizes(own)).any(axis=1)
        whole = (where == blocks[of]).all(axis=1) & loose & (where[:, [0, 2]] < depth).any(axis=1)
        left = np.maximum(depth[0] - where[:, 0], depth[1] - where[:, 2])
        done = ~whole & ((verdict != UNDECIDED) | (left == 0))
        leaves += [_leaves(where[done], verdict[done]), _split(where[whole], depth)]
        go = ~done & ~whole
        own, where, of = own[go], where[go], of[go]
        along = np.where(depth[0] - where[:, 0] == left[go], 0, 1)
        own, where, of = _halved(own, where, of, along, halves)
    return np.concatenate(leaves), sum(map(len, leaves))


def _sizes(series):
    """How large each function is on its cell, at least its mean (M, 5)."""
    return abs(series).sum(axis=(2, 3))


def _decided(series, slack):
    """The verdicts of cells (M), from the mean of each function and the sum of its other coefficients."""
    middle = series[:, :, 0, 0]
    swing = (_sizes(series) - abs(middle) + slack) * (1.0 + 256.0 * EPS)
    unstable, stable = (middle < -swing).any(axis=1), (middle > swing).all(axis=1)
    return np.where(unstable, UNSTABLE, np.where(stable, STABLE, UNDECIDED))


def _leaves(where, verdict):
    """Rows of `descend`: the block, its verdict, and its parts that are stable and unstable at least."""
    return np.column_stack([where, verdict, verdict == STABLE, verdict == UNSTABLE]).astype(float)


def _split(where, depth):
    """The halves, unsolved, of blocks along the side that can be halved more often."""
    rows = []
    for block in where:
        at = 0 if depth[0] - block[0] >= depth[1] - block[2] else 2
        for side in (0, 1):
            child = block.copy()
            child[at], child[at + 1] = block[at] + 1, 2 * block[at + 1] + side
            rows.append([*child, UNSOLVED, 0, 0])
    return np.array(rows, dtype=float).reshape(-1, 7)


def _halved(own, where, of, along, halves):
    """Both halves of every cell: their series, blocks and the numbers of their first blocks."""
    parts = []
    for axis in (0, 1):
        here = along == axis
        for side in (0, 1):
            level, place = where[here, 2 * axis], where[here].copy()
            place[:, 2 * axis], place[:, 2 * axis + 1] = level + 1, 2 * place[:, 2 * axis + 1] + side
            step = halves[axis, level, side][:, None]
            new = step @ own[here] if axis == 0 else own[here] @ step.swapaxes(2, 3)
            parts.append((new, place, of[here]))
    return tuple(np.concatenate(column) for column in zip(*parts, strict=True))
