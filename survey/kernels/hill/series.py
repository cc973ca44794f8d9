"""Discriminants, or factors, of many rows from their Chebyshev series: rows share nothing, lanes of
a row share their coefficients.

Sources: J. C. Mason, D. C. Handscomb, Chebyshev Polynomials (2003), 1.2.1; M. Abramowitz, I. A.
Stegun, Handbook of Mathematical Functions (1964), 4.4.46.
"""

import math

import numpy as np

from survey.kernels import lanes
from survey.kernels.hill.answers import LARGEST, STABLE, UNDECIDED, UNSTABLE
from survey.kernels.jit import kernel, splice
from survey.kernels.math.chebyshev import WIDTH, next_term, sum_turns
from survey.kernels.math.rounding import fill_up
from survey.kernels.math.roundoff import EPS
from survey.kernels.unroll import consecutive, put, unroll

TILE = 64
ROOT_2 = math.sqrt(2.0)
ROWS = 8
# Of a series of factors, in the order of `lanes`: y1, y1', y2, y2'.
FACTOR_COUNT = 4
# At a node: the rotation number, the least and the largest number of zeros of y1, and of y2.
NEAR, Y1_LEAST, Y1_MOST, Y2_LEAST, Y2_MOST = range(5)
TURNS = 5
# Rows of a tile of points, after the factors: see `_count`.
TURNED, MIRRORED, BEYOND, Y1_SIZE, M, D = range(FACTOR_COUNT, FACTOR_COUNT + 6)
TILE_ROWS = FACTOR_COUNT + 6
# Of a row, between neighbouring nodes: the rotation number at the first, how far it is to the second's, and the
# numbers of zeros as `_either` gives them.
FIRST, RISE, Y1_EITHER, Y2_EITHER = range(4)
BETWEEN = 4
# Around a point of a panel: the two nodes across the rows, and the two along them.
ACROSS, ALONG = range(2)
LOW_ACROSS, HIGH_ACROSS, LOW_ALONG, HIGH_ALONG = range(4)
# arccos x / sqrt(1 - x) on [0, 1], to 2e-8: A&S 4.4.46.
ARCCOS = (1.5707963050, -0.2145988016, 0.0889789874, -0.0501743046,
          0.0308918810, -0.0170881256, 0.0066700901, -0.0012624911)  # fmt: skip


@splice
def _table(x, even, odd, tile):
    """T_k at x (or of y = 2 x^2 - 1 if `even`; T_{2k + 1} if `odd`) in the first lanes of the rows
    of `tile`, and in those up to a multiple of WIDTH numbers that are finite; its last row is used meanwhile.
    """
    end = (len(x) + WIDTH - 1) // WIDTH * WIDTH
    last = len(tile) - 1
    for i in range(end):
        at = x[i] if i < len(x) else 0.0
        y = 2.0 * at * at - 1.0 if even or odd else at
        tile[0, i] = at if odd else 1.0
        tile[1, i] = (2.0 * y - 1.0) * at if odd else y
        tile[last, i] = 2.0 * y
    for k in range(2, len(tile)):
        for i in range(0, end, WIDTH):
            _next_terms(tile, last, k, i)


@unroll
def _next_terms(tile, twice, k, i):
    """T_k from the two before and 2 y, in the row `twice`, in WIDTH lanes from i on."""
    y, last, before = (consecutive(tile, (row, i), WIDTH) for row in (twice, k + (-1), k + (-2)))
    put(tile, (k, i), next_term(y, last, before))


@kernel
def neighbours(x, number, kept, left, right, share):
    """Which of the `kept` first of `number` nodes are on both sides of x (N; `left` and `right`, the same
    where there is none beyond), and the `share` of the way from one to the other.

    A point nearer to a node than 1e-8 `number` may be given the nodes on that one's other side.
    """
    for i in range(len(x)):
        at = min(max(-1.0, x[i]), 1.0)  # -1 where x is NaN
        size = abs(at)
        total = 0.0
        for k in range(len(ARCCOS) - 1, -1, -1):
            total = total * size + ARCCOS[k]
        angle = math.sqrt(1.0 - size) * total
        angle = math.pi - angle if at < 0.0 else angle
        node = angle * (number / math.pi) - 0.5
        first = min(max(math.floor(node), 0.0), kept - 1.0)
        last = min(math.floor(node) + 1.0, kept - 1.0)
        left[i], right[i] = np.int64(first), np.int64(last)
        share[i] = node - first if last > first else 0.0


@kernel
def _lagrange(n, x, tile, top, weights):
    """Magnitudes of the Lagrange polynomials of the n nodes at x in the first lanes of the first n
    rows of `weights`, finite numbers in others, from T_k in the rows of `tile`; see
    `chebyshev.lagrange`. `top` keeps T_n, whose recurrence errs by less than n^2 EPS.
    """
    for i in range(len(x)):
        top[i] = abs(2.0 * x[i] * tile[n - 1, i] - tile[n - 2, i]) + n * n * EPS
    for k in range(len(weights)):
        angle = math.pi * (k + 0.5) / n
        node, share = math.cos(angle), math.sin(angle) / n if k < n else 0.0
        for i in range(len(x)):
            weights[k, i] = min((share * top[i] + 2.0 * EPS) / abs(x[i] - node), ROOT_2)
    for k in range(len(weights)):
        for i in range(len(x), (len(x) + WIDTH - 1) // WIDTH * WIDTH):
            weights[k, i] = 0.0


@kernel
def discriminants(
    rows, coefficients, doubts, at_nodes, n, x, rtol, values, bars, rounded, verdict, missed
):
    """D of the `rows` from its series at x (L): D, its bar and the verdict; `missed` where not
    enough.

    Row rows[j]: D = sum_k coefficients[j, k] T_k(x) within doubts[j], to which is added, if n > 0,
    what is `at_nodes` (R, K), of which n count, times the magnitudes of Lagrange's polynomials; K
    and terms are multiples of TERMS. `values`, `bars` and `rounded` are those of D in
    `kernels.hill.answers.measure`: one of the latter two is empty.
    """
    terms, tiles = coefficients.shape[1], (len(x) + TILE - 1) // TILE
    kept = tiles if len(rows) > ROWS else 1  # of the tables: of no more than what is read again
    table, weights = np.empty((kept, terms, TILE)), np.empty((kept, at_nodes.shape[1], TILE))
    sums, bounds = np.empty(TILE), np.empty(TILE)
    # A tile of the table stays in the first cache for some rows, and what is written within some
    # pages.
    for turn in range((len(rows) + ROWS - 1) // ROWS * tiles):
        start, t = turn // tiles * ROWS, turn % tiles
        count, slot = len(x) - t * TILE if t == tiles - 1 else TILE, t if kept > 1 else 0
        if start == 0:
            own = x[t * TILE : t * TILE + count]
            _table(own, False, False, table[slot])
            if n > 0:
                _lagrange(n, own, table[slot], sums, weights[slot])
        for j in range(start, len(rows) if start + ROWS > len(rows) else start + ROWS):
            sum_turns(coefficients[j], table[slot], sums, count)
            first = rows[j] * len(x) + t * TILE
            end = first + count
            if n > 0:
                sum_turns(at_nodes[j], weights[slot], bounds, count)
                for i in range(count):
                    bounds[i] += doubts[j]
                _decide_each(sums, bounds, values[first:end], bars[first:end], rounded[first:end], rtol,
                             verdict[first:end], missed[first:end])  # fmt: skip
            else:
                _decide(sums, doubts[j], values[first:end], bars[first:end], rounded[first:end], rtol,
                        verdict[first:end], missed[first:end])  # fmt: skip


@splice
def _decide(d, bar, values, bars, rounded, rtol, verdict, missed):
    """D, their common bar and the verdict of neighbouring points, and who missed. Views: an offset
    index is not vector code.
    """
    low, high = 2.0 - bar, 2.0 + bar
    for i in range(len(bars)):
        bars[i] = bar
    up = np.float32(bar)
    up = np.nextafter(up, np.float32(np.inf)) if up < bar else up
    for i in range(len(rounded)):
        rounded[i] = up
    for i in range(len(verdict)):
        size = abs(d[i])
        values[i] = d[i]
        verdict[i] = (
            np.int8(STABLE)
            if size < low
            else np.int8(UNSTABLE)
            if size > high
            else np.int8(UNDECIDED)
        )
    for i in range(len(verdict)):
        missed[i] = verdict[i] == UNDECIDED
    if not bar <= rtol:
        for i in range(len(verdict)):
            missed[i] |= not bar <= min(rtol * (1.0 + abs(d[i])), LARGEST)


@splice
def _decide_each(d, bar, values, bars, rounded, rtol, verdict, missed):
    """As `_decide`, with a bar of each point."""
    fill_up(bar, rounded)
    for i in range(len(bars)):
        bars[i] = bar[i]
    for i in range(len(verdict)):
        values[i] = d[i]
        stable, unstable = abs(d[i]) < 2.0 - bar[i], abs(d[i]) > 2.0 + bar[i]
        verdict[i] = (
            np.int8(STABLE) if stable else np.int8(UNSTABLE) if unstable else np.int8(UNDECIDED)
        )
    for i in range(len(verdict)):
        wide = not bar[i] <= min(rtol * (1.0 + abs(d[i])), LARGEST)
        missed[i] = wide | (verdict[i] == UNDECIDED)


@splice
def _fill(values, out):
    """The first of the `values`."""
    for i in range(len(out)):
        out[i] = values[i]


@kernel
def factors(coefficients, bars, x, even, turns, place, share, full_period, results):
    """The results (RESULTS, R x) of R rows at x: y1, y1', y2, y2' from their series `coefficients`
    (4, R, terms) within `bars` (4, R); if `even`, from those of (y1 + y2') / 2, y1', y2 and, odd,
    (y1 - y2') / 2.

    The numbers of zeros follow from `turns` (TURNS, R, nodes) at the nodes around x, of which `place` is the sum
    of the numbers, `share` of the way between; NaN where they do not tell.
    """
    _, rows, terms = coefficients.shape
    table, odd = np.empty((terms, TILE)), np.empty((terms, TILE))
    tile, around = np.empty((TILE_ROWS, TILE)), np.empty((rows, BETWEEN, 2 * turns.shape[2] - 1))
    for j in range(rows):
        _between_nodes(turns[:, j], around[j])
    for start in range(0, len(x), TILE):
        count = min(TILE, len(x) - start)
        _table(x[start : start + count], even, False, table)
        if even:
            _table(x[start : start + count], even, True, odd)
        places, shares = place[start : start + count], share[start : start + count]
        for i in range(count):
            tile[MIRRORED, i] = 1.0 if even and x[start + i] < 0.0 else 0.0
            tile[BEYOND, i] = 1.0 if places[i] % 2 == 0 else 0.0
        for j in range(rows):
            for f in range(FACTOR_COUNT):
                sum_turns(
                    coefficients[f, j], odd if even and f == lanes.DY2 else table, tile[f], count
                )
            y1_bar = bars[lanes.Y1, j]
            if even:
                y1_bar += bars[lanes.DY2, j]
                for i in range(count):
                    tile[lanes.Y1, i], tile[lanes.DY2, i] = (
                        tile[lanes.Y1, i] + tile[lanes.DY2, i],
                        tile[lanes.Y1, i] - tile[lanes.DY2, i],
                    )
            first, rise, y1_either, y2_either = (
                around[j, FIRST],
                around[j, RISE],
                around[j, Y1_EITHER],
                around[j, Y2_EITHER],
            )
            for i in range(count):
                at = np.uint64(places[i])  # with a sign, it might count from the end
                tile[TURNED, i] = first[at] + shares[i] * rise[at]
                tile[M, i], tile[D, i] = y1_either[at], y2_either[at]
                tile[Y1_SIZE, i] = y1_bar
            _count(tile, full_period, count)
            begin = j * len(x) + start
            end = begin + count
            for f in range(FACTOR_COUNT):
                mixed = even and (f == lanes.Y1 or f == lanes.DY2)
                _fill(tile[f], results[lanes.Y1 + f, begin:end])
                results[lanes.Y1_BAR + f, begin:end] = y1_bar if mixed else bars[f, j]
            _fill(tile[M], results[lanes.Y1_ZEROS, begin:end])
            _fill(tile[D], results[lanes.Y2_ZEROS, begin:end])


@kernel
def points(coefficients, number, bars, x, even, scale, turns, nodes, share, full_period, results):
    """As `factors` at points on their own, x (2, N) across and along the rows, from series
    `coefficients` (4, terms along, terms across) of a panel within `bars` (4); the last of the four
    is multiplied by `scale` (N). Only the first `number` (4, terms along) of the terms across
    count.

    `nodes` (4, N) are LOW_ACROSS to HIGH_ALONG, `share` (2, N) of the way between, and `turns` (TURNS,
    nodes across, nodes along).
    """
    _, terms, across = coefficients.shape
    table, odd, rows = np.empty((terms, TILE)), np.empty((terms, TILE)), np.empty((across, TILE))
    tile, part = np.empty((TILE_ROWS, TILE)), np.empty(TILE)
    for start in range(0, x.shape[1], TILE):
        count = min(TILE, x.shape[1] - start)
        _table(x[ACROSS, start : start + count], False, False, rows)
        _table(x[ALONG, start : start + count], even, False, table)
        if even:
            _table(x[ALONG, start : start + count], even, True, odd)
        for f in range(FACTOR_COUNT):
            for i in range(count):
                tile[f, i] = 0.0
            for k in range(terms):
                if number[f, k] == 0:
                    continue
                sum_turns(coefficients[f, k, : number[f, k]], rows, part, count)
                along = odd[k] if even and f == lanes.DY2 else table[k]
                for i in range(count):
                    tile[f, i] += along[i] * part[i]
        for i in range(count):
            at, bar = start + i, bars[lanes.Y1]
            if even:
                odd_part = tile[lanes.DY2, i] * scale[at]
                tile[lanes.Y1, i], tile[lanes.DY2, i] = (
                    tile[lanes.Y1, i] + odd_part,
                    tile[lanes.Y1, i] - odd_part,
                )
                bar += bars[lanes.DY2] * scale[at]
            a, b, c, d = (
                nodes[LOW_ACROSS, at],
                nodes[HIGH_ACROSS, at],
                nodes[LOW_ALONG, at],
                nodes[HIGH_ALONG, at],
            )
            low = turns[NEAR, a, c] + share[ACROSS, at] * (turns[NEAR, b, c] - turns[NEAR, a, c])
            high = turns[NEAR, a, d] + share[ACROSS, at] * (turns[NEAR, b, d] - turns[NEAR, a, d])
            tile[TURNED, i], tile[Y1_SIZE, i] = low + share[ALONG, at] * (high - low), bar
            tile[MIRRORED, i] = 1.0 if even and x[ALONG, at] < 0.0 else 0.0
            tile[BEYOND, i] = 1.0 if c == d else 0.0
            y1_least, y1_most = turns[Y1_LEAST], turns[Y1_MOST]
            y2_least, y2_most = turns[Y2_LEAST], turns[Y2_MOST]
            low = min(min(y1_least[a, c], y1_least[b, c]), min(y1_least[a, d], y1_least[b, d]))
            high = max(max(y1_most[a, c], y1_most[b, c]), max(y1_most[a, d], y1_most[b, d]))
            tile[M, i] = _either(low, high)
            low = min(min(y2_least[a, c], y2_least[b, c]), min(y2_least[a, d], y2_least[b, d]))
            high = max(max(y2_most[a, c], y2_most[b, c]), max(y2_most[a, d], y2_most[b, d]))
            tile[D, i] = _either(low, high)
        _count(tile, full_period, count)
        end = start + count
        for f in range(FACTOR_COUNT):
            _fill(tile[f], results[lanes.Y1 + f, start:end])
            results[lanes.Y1_BAR + f, start:end] = bars[f]
        _fill(tile[Y1_SIZE], results[lanes.Y1_BAR, start:end])
        if even:
            _fill(tile[Y1_SIZE], results[lanes.DY2_BAR, start:end])
        _fill(tile[M], results[lanes.Y1_ZEROS, start:end])
        _fill(tile[D], results[lanes.Y2_ZEROS, start:end])


@kernel
def discriminants_at(
    first, coefficients, number, bar, x, even, rtol, values, bars, rounded, verdict, missed
):
    """As `discriminants` at points on their own, from the `first` on: series and x as in `points`,
    of one function, D, within `bar`.
    """
    terms, across = coefficients.shape
    table, rows = np.empty((terms, TILE)), np.empty((across, TILE))
    sums, part = np.empty(TILE), np.empty(TILE)
    for start in range(0, x.shape[1], TILE):
        count = min(TILE, x.shape[1] - start)
        end = start + count
        _table(x[ACROSS, start:end], False, False, rows)
        _table(x[ALONG, start:end], even, False, table)
        for i in range(count):
            sums[i] = 0.0
        for k in range(terms):
            if number[k] == 0:
                continue
            sum_turns(coefficients[k, : number[k]], rows, part, count)
            for i in range(count):
                sums[i] += table[k, i] * part[i]
        begin, end = first + start, first + end
        _decide(
            sums,
            bar,
            values[begin:end],
            bars[begin:end],
            rounded[begin:end],
            rtol,
            verdict[begin:end],
            missed[begin:end],
        )


@splice
def _between_nodes(turns, out):
    """FIRST to Y2_EITHER of a row (BETWEEN, 2 n - 1), from its `turns` at n nodes: of nodes i and k in
    column i + k, neighbours or the same.
    """
    for at in range(out.shape[1]):
        one, other = at // 2, (at + 1) // 2
        out[FIRST, at], out[RISE, at] = turns[NEAR, one], turns[NEAR, other] - turns[NEAR, one]
        for row, least, most in ((Y1_EITHER, Y1_LEAST, Y1_MOST), (Y2_EITHER, Y2_LEAST, Y2_MOST)):
            out[row, at] = _either(
                min(turns[least, one], turns[least, other]),
                max(turns[most, one], turns[most, other]),
            )


@splice
def _count(tile, full_period, count):
    """Numbers of zeros of neighbouring points into rows M and D, NaN where they are not known, from
    those which nodes around a point allow for y1 and y2, there (see `_either`), unless it lies BEYOND
    the last. `TURNED` is the rotation number between those of nodes.

    A point -p, `MIRRORED`, has the rotation number of p, whose y1 is the y2' of -p.
    """
    for i in range(count):
        mirrored, near = tile[MIRRORED, i] > 0.0, tile[TURNED, i]
        y1, y2, dy2 = tile[lanes.Y1, i], tile[lanes.Y2, i], tile[lanes.DY2, i]
        y1 = dy2 if mirrored else y1  # loaded before: vector code has no branches
        m = 0.0 if full_period else _zeros(tile[M, i], y1 < 0.0)
        d = _zeros(tile[D, i], y2 < 0.0)
        # one of the two may have changed
        loose = (tile[BEYOND, i] > 0.0) & (not full_period)
        lost_m, lost_d = loose & (m != m), loose & (m == m) & (d != d)
        other_m, other_d = (
            _nearest(2.0 * near - 0.5 - d, y1 < 0.0),
            _nearest(2.0 * near - 0.5 - m, y2 < 0.0),
        )
        m, d = other_m if lost_m else m, other_d if lost_d else d
        known = (abs(m + d + 0.5 - 2.0 * near) <= 1.0) & (
            (not mirrored) | (abs(y1) > tile[Y1_SIZE, i])
        )
        tile[M, i], tile[D, i] = m if known else np.nan, d if known else np.nan


@splice
def _nearest(x, odd):
    """The odd, or even, number nearest to x."""
    parity = 1.0 if odd else 0.0
    return parity + 2.0 * np.floor(0.5 * (x - parity) + 0.5)


@splice
def _either(low, high):
    """What stands for the numbers from `low` to `high`: `low` if they are the same, `low` + 1/2 if they
    are neighbours, else NaN.
    """
    return low + 0.5 * (high - low) if high - low <= 1.0 else np.nan


@splice
def _zeros(either, odd):
    """That of the numbers (see `_either`) which is odd, or even; NaN if there is none."""
    low = np.floor(either)
    is_odd = low - 2.0 * np.floor(0.5 * low) == 1.0
    value = low if is_odd == odd else low + 1.0
    return value if (value == low) | (either > low) else np.nan
