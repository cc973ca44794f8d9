"""Cells of a plane on which the signs of the four half-period factors are shown, halved on their
series alone.

A cell holds the four factors y1, y2', y1', y2 at T/2 as sum_jk c_jk T_j(X) T_k(Y), X and Y from -1 to 1 across it, each
within a slack. A factor has one sign where |c_00| > sum of the other |c_jk| + slack (|T_j| <= 1), whatever lies
between points. The series of half a cell follows from the cell's own, by a matrix.

Sources: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 3 and 8
(series, tails); I. E. Sutherland, G. W. Hodgman, Comm. ACM 17 (1974) 32 (polygons).
"""

import numpy as np

from survey.kernels.hill.answers import STABLE, UNDECIDED, UNSTABLE
from survey.kernels.jit import inline, kernel
from survey.kernels.math.roundoff import EPS

UNSOLVED = 3  # no verdict: a cell whose factors must be solved first
# A series serves a block if its tail, at the last cells, is at most this share of what a factor
# varies there.
ENOUGH = 1e-4
# It serves a cell no more where its tail is more than this share.
BLURRED = 0.1
# Of a block's slack, for each degree that its cells drop.
DROPPED = 0.02
CORNERS = 12  # of a square cut by four lines, at most 8
# A block, or a cell: along each axis how often it is halved, and the number of the part; along axis
# 0 or 1 these are the columns AXIS * axis + HALVED_X and + INDEX_X.
HALVED_X, INDEX_X, HALVED_Y, INDEX_Y = range(4)
AXIS, BLOCK = 2, 4
# A leaf: its block, its verdict, or UNSOLVED, and which parts of it are stable and unstable at least.
VERDICT, STABLE_PART, UNSTABLE_PART = range(4, 7)
LEAF = 7
# What a factor of a block is off by: its series' tail in X, in Y, and all else.
TAIL_X, TAIL_Y, OTHER = range(3)
# Of a factor on a cell: c_00, and the sum of the other |c_jk|.
CONSTANT, REST = range(2)


@kernel
def descend(series, doubts, blocks, depth, halves, fewest):
    """Halve B blocks until a cell is decided or `depth` halvings small: leaves (>= M, LEAF), and M.

    `series` (B, 4, n, n); `doubts` (B, 4, 3): of each factor TAIL_X to OTHER; `blocks` (B, BLOCK);
    `halves` (2, depth, 2, n, n): per axis and number of halvings the matrices to the lower and to
    the upper half. No block of fewer than 2^fewest cells is to be solved, but where factors are undefined.
    """
    n, most = series.shape[2], depth[0] + depth[1] + 2
    stack, slack = np.empty((most, 4, n, n)), np.empty((most, 4))
    where, size = np.empty((most, BLOCK), np.int64), np.empty((most, 2), np.int64)
    sums, polygons = np.empty((4, 2)), np.empty((2, CORNERS, 2))
    leaves, count = np.empty((1024, LEAF)), 0
    for b in range(len(series)):
        _begin(series[b], doubts[b], blocks[b], stack[0], slack[0], where[0], size[0])
        top = 0
        while top >= 0:
            if count + 4 > len(leaves):
                leaves = _more(leaves, count)
            here, own, bars = where[top], stack[top], slack[top]
            _add_up(own, size[top], sums)
            verdict = decide(sums, bars)
            left = max(depth[0] - here[HALVED_X], depth[1] - here[HALVED_Y])
            short_x, short_y = False, False
            if verdict == UNDECIDED:
                short_x, short_y = _too_short(sums, bars, doubts[b], here, blocks[b], depth, fewest)
            if short_x or short_y:
                count, top = _children(here, blocks[b], short_x, short_y, leaves, count), top - 1
            elif verdict != UNDECIDED or left == 0:
                stable, unstable = 1.0 * (verdict == STABLE), 1.0 * (verdict == UNSTABLE)
                if verdict == UNDECIDED:
                    stable, unstable = _cut(own, sums, bars, polygons)
                _write(here, verdict, stable, unstable, leaves[count])
                count, top = count + 1, top - 1
            else:
                axis = 0 if depth[0] - here[HALVED_X] == left else 1
                level = here[AXIS * axis + HALVED_X]
                _halve(stack, slack, where, size, top, axis, halves[axis, level], sums)
                _shorten(stack[top], slack[top], size[top], doubts[b])
                _shorten(stack[top + 1], slack[top + 1], size[top + 1], doubts[b])
                top += 1
    return leaves, count


@inline
def _more(leaves, count):
    """Twice the rows."""
    out = np.empty((2 * len(leaves), LEAF))
    for i in range(count):
        for c in range(LEAF):
            out[i, c] = leaves[i, c]
    return out


@inline
def _begin(series, doubt, block, own, slack, where, size):
    """The block as the first cell."""
    for i in range(BLOCK):
        where[i] = block[i]
    for f in range(4):
        slack[f] = doubt[f, TAIL_X] + doubt[f, TAIL_Y] + doubt[f, OTHER]
        for j in range(series.shape[1]):
            for k in range(series.shape[2]):
                own[f, j, k] = series[f, j, k]
    size[0], size[1] = series.shape[1], series.shape[2]


@inline
def _write(here, verdict, stable, unstable, leaf):
    for i in range(BLOCK):
        leaf[i] = here[i]
    leaf[VERDICT], leaf[STABLE_PART], leaf[UNSTABLE_PART] = verdict, stable, unstable


@inline
def _add_up(own, size, sums):
    """Fill `sums` (4, 2): of each factor CONSTANT and REST."""
    for f in range(4):
        total = 0.0
        for j in range(size[0]):
            for k in range(1 if j == 0 else 0, size[1]):
                total += abs(own[f, j, k])
        sums[f, CONSTANT], sums[f, REST] = own[f, 0, 0], total


@inline
def _sure(sums, bars, f):
    """Has factor f one sign? Not where anything is NaN."""
    return abs(sums[f, CONSTANT]) > (sums[f, REST] + bars[f]) * (1.0 + 256.0 * EPS)


@inline
def decide(sums, bars):
    """The verdict of the cell: unstable <=> y1 y2' < 0 or y1' y2 > 0."""
    first = _sure(sums, bars, 0) and _sure(sums, bars, 1)
    second = _sure(sums, bars, 2) and _sure(sums, bars, 3)
    cosine = (sums[0, CONSTANT] > 0.0) == (sums[1, CONSTANT] > 0.0)
    sine = (sums[2, CONSTANT] > 0.0) != (sums[3, CONSTANT] > 0.0)
    if (first and not cosine) or (second and not sine):
        return UNSTABLE
    return STABLE if first and second else UNDECIDED


@inline
def _too_short(sums, bars, doubt, here, block, depth, fewest):
    """Along which axes is the series too short for the unsure factors of this cell, so that solving
    its halves helps?

    The tail must be small beside what a factor varies: on the block itself, whose halves are solved
    otherwise, beside what it varies on the last cells; on a smaller cell, which is solved itself
    otherwise, beside what it varies there. Below the other slack it does not matter. An axis whose
    tail hides a factor is halved before the other; where it is halved to the end already, nothing
    helps. Few cells are not worth it, unless factors are undefined on a part of the block.
    """
    x = y = hidden_x = hidden_y = undefined = False
    full = here[HALVED_X] == block[HALVED_X] and here[HALVED_Y] == block[HALVED_Y]
    left_x, left_y = depth[0] - here[HALVED_X], depth[1] - here[HALVED_Y]
    share = ENOUGH * 0.5 ** max(left_x, left_y) if full else BLURRED
    for f in range(4):
        if not _sure(sums, bars, f):
            most = max(share * sums[f, REST], doubt[f, OTHER])
            size = abs(sums[f, CONSTANT]) + sums[f, REST]
            x |= not doubt[f, TAIL_X] <= most
            y |= not doubt[f, TAIL_Y] <= most
            hidden_x |= not doubt[f, TAIL_X] <= size
            hidden_y |= not doubt[f, TAIL_Y] <= size
            undefined |= bars[f] != bars[f]  # at some of its points
    fewest = 0 if undefined else fewest
    left = left_x + left_y  # halvings of what would be solved
    if not full:
        x &= here[HALVED_X] > block[HALVED_X]
        y &= here[HALVED_Y] > block[HALVED_Y]
    elif (hidden_x and left_x == 0) or (hidden_y and left_y == 0):
        return False, False
    else:
        x &= left_x > 0 and hidden_x >= hidden_y
        y &= left_y > 0 and hidden_y >= hidden_x
        left -= x + y
    return x and left >= fewest, y and left >= fewest


@inline
def _children(here, block, along_x, along_y, leaves, count):
    """What must be solved next: halves or quarters of the block, or this cell of it; returns the
    new count.
    """
    full = here[HALVED_X] == block[HALVED_X] and here[HALVED_Y] == block[HALVED_Y]
    for i in range(2 if full and along_x else 1):
        for j in range(2 if full and along_y else 1):
            _write(here, UNSOLVED, 0.0, 0.0, leaves[count])
            if full and along_x:
                leaves[count, HALVED_X] = here[HALVED_X] + 1
                leaves[count, INDEX_X] = 2 * here[INDEX_X] + i
            if full and along_y:
                leaves[count, HALVED_Y] = here[HALVED_Y] + 1
                leaves[count, INDEX_Y] = 2 * here[INDEX_Y] + j
            count += 1
    return count


@inline
def _halve(stack, slack, where, size, top, axis, matrices, sums):
    """Put the lower half of the cell at `top` above it, and the upper half in its place."""
    for i in range(BLOCK):
        where[top + 1, i] = where[top, i]
    for i in range(4):
        slack[top, i] += (
            EPS * (4.0 + 2.0 * size[top, axis]) * (abs(sums[i, CONSTANT]) + sums[i, REST])
        )
        slack[top + 1, i] = slack[top, i]
    size[top + 1, 0], size[top + 1, 1] = size[top, 0], size[top, 1]
    halved, index = AXIS * axis + HALVED_X, AXIS * axis + INDEX_X
    for at in (top, top + 1):
        where[at, halved] += 1
        where[at, index] = 2 * where[at, index] + (1 if at == top else 0)
    _times(matrices[0], stack[top], size[top], axis, stack[top + 1])
    _times(matrices[1], stack[top], size[top], axis, stack[top])


@inline
def _times(matrix, series, size, axis, out):
    """The (upper triangular) matrix along one axis of the series; `out` may be `series`, as sums
    run upwards.
    """
    for f in range(4):
        for j in range(size[0]):
            for k in range(size[1]):
                total = 0.0
                if axis == 0:
                    for i in range(j, size[0]):
                        total += matrix[j, i] * series[f, i, k]
                else:
                    for i in range(k, size[1]):
                        total += matrix[k, i] * series[f, j, i]
                out[f, j, k] = total


@inline
def _shorten(own, slack, size, doubt):
    """Drop the highest degrees, as long as they are small beside the block's slack, and add them to
    the cell's.
    """
    for axis in range(2):
        while size[axis] > 2:
            last, small = size[axis] - 1, True
            for f in range(4):
                small &= _layer(own[f], size, axis, last) <= DROPPED * (
                    doubt[f, TAIL_X] + doubt[f, TAIL_Y] + doubt[f, OTHER]
                )
            if not small:
                break
            for f in range(4):
                slack[f] += _layer(own[f], size, axis, last)
            size[axis] = last


@inline
def _layer(own, size, axis, last):
    """Sum of the |c_jk| of one degree along the axis."""
    total = 0.0
    for i in range(size[1 - axis]):
        total += abs(own[last, i]) if axis == 0 else abs(own[i, last])
    return total


@inline
def _cut(own, sums, bars, polygons):
    """The least parts of the cell that are stable and unstable: where the linear parts exceed all
    else in size.
    """
    stable = unstable = 0.0
    for signs in range(16):
        for i in range(4):  # the square
            polygons[0, i, 0] = 1.0 if i == 1 or i == 2 else -1.0
            polygons[0, i, 1] = 1.0 if i >= 2 else -1.0
        corners = 4
        for f in range(4):
            x, y = own[f, 1, 0], own[f, 0, 1]
            rest = (
                sums[f, REST]
                - abs(x)
                - abs(y)
                + bars[f]
                + 8.0 * EPS * (abs(sums[f, CONSTANT]) + sums[f, REST])
            )
            sign = 1.0 if (signs >> f) & 1 == 1 else -1.0
            corners = _clip(
                polygons[f % 2],
                corners,
                sign * sums[f, CONSTANT] - rest,
                sign * x,
                sign * y,
                polygons[1 - f % 2],
            )
        part = _area(polygons[0], corners)
        cosine, sine = (signs & 1) == ((signs >> 1) & 1), ((signs >> 2) & 1) != ((signs >> 3) & 1)
        if cosine and sine:
            stable += part
        else:
            unstable += part
    return stable, unstable


@inline
def _clip(old, corners, constant, slope_x, slope_y, new):
    """Cut the polygon to where constant + slope_x X + slope_y Y > 0; returns the number of corners
    of the new one.
    """
    count = 0
    for i in range(corners):
        after = i + 1 if i + 1 < corners else 0
        here = constant + slope_x * old[i, 0] + slope_y * old[i, 1]
        there = constant + slope_x * old[after, 0] + slope_y * old[after, 1]
        if here > 0.0:
            new[count, 0], new[count, 1] = old[i, 0], old[i, 1]
            count += 1
        if (here > 0.0 and there < 0.0) or (here < 0.0 and there > 0.0):
            t = here / (here - there)
            for c in range(2):
                new[count, c] = old[i, c] + t * (old[after, c] - old[i, c])
            count += 1
    return count


@inline
def _area(polygon, corners):
    """As a part of the square from -1 to 1."""
    total = 0.0
    for i in range(corners):
        after = i + 1 if i + 1 < corners else 0
        total += polygon[i, 0] * polygon[after, 1] - polygon[after, 0] * polygon[i, 1]
    return 0.125 * abs(total)
