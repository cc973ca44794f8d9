"""Cells decided by the signs of a few functions: stable where all are positive, unstable where one
is negative; and stable where a symmetric matrix is definite, whose leading minors are further ones.

On a block each function is its tensor Chebyshev series to within a bound, as in
`survey.measures.hill.cells`, whose series and cells these are; the cells of a block are halved on
the series alone, all of one size together.
"""

from functools import partial

import numpy as np

from survey.kernels.hill.answers import STABLE, UNDECIDED, UNSTABLE
from survey.kernels.hill.cells import (
    AXIS,
    BLOCK,
    ENOUGH,
    HALVED_X,
    HALVED_Y,
    INDEX_X,
    LEAF,
    OTHER,
    STABLE_PART,
    TAIL_X,
    TAIL_Y,
    UNSOLVED,
    UNSTABLE_PART,
    VERDICT,
)
from survey.kernels.math.roundoff import EPS
from survey.measures.hill import cells


def find(solve, x, y, each, report, values, minors=0):
    """The `hill.cells.Cells` of the rectangle of the Sides x and y.

    `values(out)` makes the functions and their bounds (B, F, n, n) of what `solve` gives, of which
    the last `minors` are the leading minors of a matrix; other arguments as there.
    """
    return cells.find(solve, x, y, each, report, values, partial(_descend, minors=minors))


def _descend(series, doubts, blocks, depth, halves, minors):
    """As `kernels.hill.cells.descend`: leaves (M, LEAF) of blocks, cells of one size halved together."""
    leaves = []
    slack = doubts.sum(axis=2)
    own = series
    where = blocks.astype(np.int64)
    of = np.arange(len(blocks))
    while len(where):
        verdict = decided(own, slack[of], minors)
        # a block whose own series is too loose is solved again, if it can be halved; not where a
        # function is 0 but for the errors of its values
        tails, other = doubts[of][:, :, [TAIL_X, TAIL_Y]].sum(axis=2), doubts[of][:, :, OTHER]
        loose = (verdict == UNDECIDED) & (tails > np.maximum(ENOUGH * _sizes(own), other)).any(
            axis=1
        )
        to_split = (
            (where == blocks[of]).all(axis=1)
            & loose
            & (where[:, [HALVED_X, HALVED_Y]] < depth).any(axis=1)
        )
        left = np.maximum(depth[0] - where[:, HALVED_X], depth[1] - where[:, HALVED_Y])
        done = ~to_split & ((verdict != UNDECIDED) | (left == 0))
        leaves += [_leaves(where[done], verdict[done]), _split(where[to_split], depth)]
        go = ~done & ~to_split
        own, where, of = own[go], where[go], of[go]
        along = np.where(depth[0] - where[:, HALVED_X] == left[go], 0, 1)
        own, where, of = _halved(own, where, of, along, halves)
    return np.concatenate(leaves), sum(map(len, leaves))


def _sizes(series):
    """How large each function is on its cell, at least its mean (M, F)."""
    return abs(series).sum(axis=(2, 3))


def decided(series, slack, minors=0):
    """The verdicts of cells (M), from the mean of each function and the sum of its other coefficients."""
    middle = series[:, :, 0, 0]
    swing = (_sizes(series) - abs(middle) + slack) * (1.0 + 256.0 * EPS)
    signs = np.where(middle > swing, 1, np.where(middle < -swing, -1, 0))
    signs, of_minors = np.split(signs, [signs.shape[1] - minors], axis=1)
    unstable, stable = (signs < 0).any(axis=1), (signs > 0).all(axis=1)
    if minors:
        negative = (-1) ** np.arange(1, minors + 1)  # those of a negative definite matrix
        stable |= (of_minors > 0).all(axis=1) | (of_minors * negative > 0).all(axis=1)
    return np.where(unstable, UNSTABLE, np.where(stable, STABLE, UNDECIDED))


def _leaves(where, verdict):
    """Leaves of these blocks, wholly stable or unstable where they are not UNDECIDED or UNSOLVED."""
    leaves = np.empty((len(where), LEAF))
    leaves[:, :VERDICT], leaves[:, VERDICT] = where, verdict
    leaves[:, STABLE_PART], leaves[:, UNSTABLE_PART] = verdict == STABLE, verdict == UNSTABLE
    return leaves


def _split(where, depth):
    """The halves, unsolved, of blocks along the side that can be halved more often."""
    rows = []
    for block in where:
        axis = 0 if depth[0] - block[HALVED_X] >= depth[1] - block[HALVED_Y] else 1
        rows += [_half(block, axis, side) for side in (0, 1)]
    return _leaves(np.array(rows, dtype=float).reshape(-1, BLOCK), np.full(len(rows), UNSOLVED))


def _half(blocks, axis, side):
    """The lower (0) or the upper (1) half of a block, or of each of some."""
    half = blocks.copy()
    halved, index = AXIS * axis + HALVED_X, AXIS * axis + INDEX_X
    half[..., halved] += 1
    half[..., index] = 2 * half[..., index] + side
    return half


def _halved(own, where, of, along, halves):
    """Both halves of every cell: their series, blocks and the numbers of their first blocks."""
    parts = []
    for axis in (0, 1):
        here = along == axis
        for side in (0, 1):
            level = where[here, AXIS * axis + HALVED_X]
            step = halves[axis, level, side][:, None]
            new = step @ own[here] if axis == 0 else own[here] @ step.swapaxes(2, 3)
            parts.append((new, _half(where[here], axis, side), of[here]))
    return tuple(np.concatenate(column) for column in zip(*parts, strict=True))
