"""Arithmetic of Hill's question, point by point: how many steps, and what follows from the
half-period factors.

The results of a point at T/2 are the columns of `kernels.lanes`. Formulas:
`survey.measures.hill.monodromy`.
"""

from math import isfinite, pi, sqrt

import numpy as np

from survey.kernels import lanes
from survey.kernels.jit import inline, kernel, splice
from survey.kernels.math.inverses import arcsinh_roots, arctan_root
from survey.kernels.math.rounding import fill_up
from survey.kernels.math.roundoff import EPS
from survey.kernels.unroll import unroll

LEAST = 2e-323  # what a few products lose where they underflow
LEAST_ROOT = 1e-200  # less than any that is not 0
LARGEST = float(np.finfo(np.float32).max)  # bars are kept as float32
UNDECIDED, UNSTABLE, STABLE, MARGINAL = -1, 0, 1, 2
# What an exact rule says of a point.
NO_RULE, NO_UNSTABLE_SIDE, ON_EDGE = 0, 1, 2
# Rows of `values`, and of their bars, of `measure`.
FLOATS = ("discriminant", "y1", "y2", "dy1", "dy2", "exponent", "rotation_number")
DISCRIMINANT, Y1, Y2, DY1, DY2, EXPONENT, ROTATION = range(7)
FACTOR_ROWS = np.array([Y1, DY1, Y2, DY2])  # in the order of the results
UNTRIED = -1
# Of half the angle of a point, where more digits are known: sin^2 and cos^2.
SINE, SINE_BAR, COSINE, COSINE_BAR = range(4)
SQUARES = 4
# Rows of a tile of points, after these: of an exponent or a rotation number, and the number of zeros;
# then the points' results.
VALUE, DOUBT, ZEROS, WORK = range(SQUARES, SQUARES + 4)
OWN = SQUARES + 4
ROWS = OWN + lanes.RESULTS
TILE = 128


@kernel
def first_rungs(p, bound, span, rate, phase, distance, ladder, out):
    """The first rung of the ladder, of numbers of steps, with `phase` steps per radian and
    `distance` times `rate`.

    |z| <= bound[r, 0] + |p| bound[r, 1] + p^2 bound[r, 2] in row r of `p` and of `out`, which holds rungs:
    the length of the ladder where no number is enough, UNTRIED where the point or its row is not finite.
    """
    top = len(ladder)
    for r in range(p.shape[0]):
        least = distance * rate[r] * span[r]
        rung = 0
        for i in range(p.shape[1]):
            size = abs(p[r, i])
            frequency = sqrt(bound[r, 0] + size * (bound[r, 1] + size * bound[r, 2]))
            steps = phase * frequency * span[r]
            if not isfinite(steps + least):
                out[r, i] = UNTRIED
                continue
            steps = max(steps, least)
            while rung < top and ladder[rung] < steps:
                rung += 1
            while rung > 0 and ladder[rung - 1] >= steps:
                rung -= 1
            out[r, i] = rung


@kernel
def spread(h, ulp, ulps, out):
    """Lengths of steps, out[r, i] near h[r], of which ulps[r] `ulp`[r] more or less, evenly spread over the
    row, make the whole.
    """
    steps = out.shape[1]
    for r in range(len(h)):
        each, before = ulps[r] / steps, 0.0
        for i in range(steps):
            after = np.floor(each * (i + 1) + 0.5)
            out[r, i] = h[r] + ulp[r] * (after - before)
            before = after


@kernel
def segments(rung, top, order, rows, on_rung, starts):
    """Points with a rung in 0..top by row and rung: their flat indices in `order`; returns the
    number of segments.

    Segment i is order[starts[i] : starts[i + 1]], all in row rows[i] and on rung on_rung[i].
    """
    counts = np.empty(top + 2, np.int64)
    for at in range(top + 2):
        counts[at] = 0
    count = position = 0
    for r in range(rung.shape[0]):
        low, high = top + 1, -1
        for i in range(rung.shape[1]):
            at = rung[r, i]
            if 0 <= at <= top:
                counts[at] += 1
                low, high = min(low, at), max(high, at)
        for at in range(low, high + 1):
            if counts[at] > 0:
                rows[count], on_rung[count], starts[count] = r, at, position
                position, counts[at] = position + counts[at], position
                count += 1
        for i in range(rung.shape[1]):
            at = rung[r, i]
            if 0 <= at <= top:
                order[counts[at]] = r * rung.shape[1] + i
                counts[at] += 1
        for at in range(low, high + 1):
            counts[at] = 0
    starts[count] = position
    return count


@kernel
def measure(
    first,
    results,
    squares,
    rule,
    wanted,
    decides,
    rtol,
    full_period,
    overflow,
    values,
    bars,
    rounded,
    verdict,
    missed,
    status,
):
    """What follows from `results` (RESULTS, n) of n of N points, from the `first` on, by
    arithmetic: `values`, 7 arrays (N), if wanted, their `bars`, or these `rounded` up to float32 where
    those arrays are not empty, `verdict`, who has `missed` `rtol`.

    Points whose `status` is not 0 are skipped; those that leave the range of floats get the status
    `overflow`. `rule` (N, or empty) holds what exact rules say, `wanted` (7) which columns count
    for `missed`, and `decides` whether an open verdict does; `full_period` as in `_squares`;
    `squares` (n, SQUARES, or empty) holds what it finds, where more digits of it are known.
    """
    tile = np.empty((ROWS, TILE))
    for start in range(0, results.shape[1], TILE):
        count = min(TILE, results.shape[1] - start)
        begin, end = first + start, first + start + count
        decided, left_out, misses = verdict[begin:end], status[begin:end], missed[begin:end]
        _half_angles(results, squares, start, count, full_period, tile)
        for i in range(count):
            sine, sine_bar, cosine, cosine_bar = _of_half(tile, i)
            # D from 2 - 4 sin^2 or 4 cos^2 - 2, whichever has the smaller bar.
            by_sine = sine_bar <= cosine_bar
            d = 2.0 - 4.0 * sine if by_sine else 4.0 * cosine - 2.0
            bar = 4.0 * (sine_bar if by_sine else cosine_bar) + 2.0 * EPS * (2.0 + abs(d))
            tile[VALUE, i], tile[DOUBT, i] = d, bar
        for i in range(count):
            decided[i] = np.int8(decide(*_of_half(tile, i)))
        if len(rule) > 0:
            _obey(rule[begin:end], decided, tile)
        for i in range(count):
            within = (abs(tile[VALUE, i]) < np.inf) & (tile[DOUBT, i] < LARGEST)
            within &= (tile[OWN + lanes.Y1_BAR, i] < LARGEST) & (
                tile[OWN + lanes.DY1_BAR, i] < LARGEST
            )
            within &= (tile[OWN + lanes.Y2_BAR, i] < LARGEST) & (
                tile[OWN + lanes.DY2_BAR, i] < LARGEST
            )
            tile[WORK, i] = 0.0 if within else 1.0
        for i in range(count):
            beyond = (left_out[i] == 0) & (tile[WORK, i] > 0.0)
            left_out[i] = overflow if beyond else left_out[i]
        for i in range(count):
            decided[i] = decided[i] if left_out[i] == 0 else np.int8(UNDECIDED)
        for i in range(count):
            misses[i] = decides & (left_out[i] == 0) & (decided[i] == UNDECIDED)
        if wanted[0]:
            _keep(tile[VALUE], tile[DOUBT], rtol, values[DISCRIMINANT][begin:end],
                  bars[DISCRIMINANT][begin:end], rounded[DISCRIMINANT][begin:end], misses, left_out)  # fmt: skip
        for c in range(4):
            at = FACTOR_ROWS[c]
            if wanted[at]:
                _keep(tile[OWN + lanes.Y1 + c], tile[OWN + lanes.Y1_BAR + c], rtol,
                      values[at][begin:end], bars[at][begin:end], rounded[at][begin:end], misses, left_out)  # fmt: skip


@kernel
def _obey(rule, decided, tile):
    """What an exact rule says of neighbouring points, in place of the verdict `decided`, and of D, where
    it is sharper.
    """
    for i in range(len(rule)):
        if rule[i] == NO_UNSTABLE_SIDE and decided[i] == UNDECIDED:
            decided[i] = STABLE
        if rule[i] == ON_EDGE:
            decided[i] = MARGINAL
            if abs(tile[VALUE, i]) > tile[DOUBT, i]:  # on an edge |D| = 2
                tile[VALUE, i], tile[DOUBT, i] = 2.0 if tile[VALUE, i] > 0.0 else -2.0, 0.0


@kernel
def transcendental(
    first,
    results,
    squares,
    wanted,
    rtol,
    full_period,
    values,
    bars,
    rounded,
    verdict,
    missed,
    status,
):
    """The columns of `measure` that are no arithmetic: exponent and rotation number, if wanted, and
    who misses.
    """
    tile = np.empty((ROWS, TILE))
    for start in range(0, results.shape[1], TILE):
        count = min(TILE, results.shape[1] - start)
        begin, end = first + start, first + start + count
        decided, left_out = verdict[begin:end], status[begin:end]
        _half_angles(results, squares, start, count, full_period, tile)
        if wanted[EXPONENT]:
            for i in range(count):
                sine, sine_bar, cosine, cosine_bar = _of_half(tile, i)
                tile[VALUE, i] = -min(sine, cosine)
                tile[DOUBT, i] = sine_bar if sine < cosine else cosine_bar
            _growths(
                tile, rtol, values[EXPONENT][begin:end], bars[EXPONENT][begin:end], rounded[EXPONENT][begin:end],
                decided, missed[begin:end], left_out,
            )  # fmt: skip
        if wanted[ROTATION]:
            _lost(full_period, decided, tile)
            _turns(
                tile, rtol, values[ROTATION][begin:end], bars[ROTATION][begin:end], rounded[ROTATION][begin:end],
                decided, missed[begin:end], left_out,
            )  # fmt: skip


@kernel
def exponents(first, count, rtol, values, bars, rounded, verdict, missed):
    """The exponents of `count` points from each of `first` on, whose D and bar are known, and who
    misses `rtol`.
    """
    tile, none = np.empty((ROWS, TILE)), np.zeros(TILE, np.int8)
    for of in first:
        for start in range(of, of + count, TILE):
            end = min(start + TILE, of + count)
            for i in range(start, end):
                # |D| - 2 = 4 sinh^2(exponent / 2)
                tile[VALUE, i - start] = 0.25 * (abs(values[DISCRIMINANT][i]) - 2.0)
                tile[DOUBT, i - start] = 0.25 * bars[DISCRIMINANT][i]
            _growths(
                tile, rtol, values[EXPONENT][start:end], bars[EXPONENT][start:end], rounded[EXPONENT][start:end],
                verdict[start:end], missed[start:end], none[: end - start],
            )  # fmt: skip


@inline
def _of_half(tile, i):
    """The `_squares` of a point in a tile, all of them: a loop that loads what it has chosen is no vector code."""
    return tile[SINE, i], tile[SINE_BAR, i], tile[COSINE, i], tile[COSINE_BAR, i]


@splice
def _half_angles(results, squares, first, count, full_period, tile):
    """The results of `count` points from the `first` on into the last rows of `tile`, and their
    `_squares` into its first rows.
    """
    for c in range(lanes.RESULTS):
        of = results[c, first : first + count]
        for i in range(count):
            tile[OWN + c, i] = of[i]
    if full_period or len(squares) > 0:
        _other_half_angles(squares, first, count, full_period, tile)
    else:
        for i in range(count):
            sine, sine_bar, cosine, cosine_bar = _of_factors(tile[OWN:, i])
            tile[SINE, i], tile[SINE_BAR, i] = sine, sine_bar
            tile[COSINE, i], tile[COSINE_BAR, i] = cosine, cosine_bar


@kernel
def _other_half_angles(squares, first, count, full_period, tile):
    """As `_half_angles` at T, or where `squares` are known, those of these points from row `first` on."""
    for i in range(count):
        found = _squares(tile[OWN:, i], squares, first + i, full_period)
        for row in range(SQUARES):
            tile[row, i] = found[row]


@inline
def _of_factors(result):
    """-y1' y2 and y1 y2', each with its bar."""
    sine = _product(
        -result[lanes.DY1], result[lanes.Y2], result[lanes.DY1_BAR], result[lanes.Y2_BAR]
    )
    cosine = _product(
        result[lanes.Y1], result[lanes.DY2], result[lanes.Y1_BAR], result[lanes.DY2_BAR]
    )
    return sine[0], sine[1], cosine[0], cosine[1]


@splice
def _squares(result, squares, i, full_period):
    """sin^2 and cos^2 of half the angle, each with its bar: -y1' y2 and y1 y2', or row i of
    `squares` if it has rows.

    With `full_period` the results are those at T: then (2 - D) / 4 and (2 + D) / 4, D = y1 + y2',
    the smaller one from their product, and the zeros of y2 in (0, T) give the band (that solution's
    angle advances from 0 to between d pi and (d + 1) pi).
    """
    sine, sine_bar, cosine, cosine_bar = _of_factors(result)
    if full_period:
        y1, dy2 = result[lanes.Y1], result[lanes.DY2]
        trace, size = y1 + dy2, abs(y1) + abs(dy2) + 2.0
        bar = 0.25 * (result[lanes.Y1_BAR] + result[lanes.DY2_BAR] + 2.0 * EPS * size)
        sine, cosine, sine_bar, cosine_bar = 0.25 * (2.0 - trace), 0.25 * (2.0 + trace), bar, bar
    if len(squares) > 0:
        sine, sine_bar = squares[i, SINE], squares[i, SINE_BAR]
        cosine, cosine_bar = squares[i, COSINE], squares[i, COSINE_BAR]
    elif full_period:
        both, both_bar = _both(result)
        if abs(sine) < abs(cosine):
            sine, sine_bar = _sharper(sine, sine_bar, both, both_bar, cosine, cosine_bar)
        else:
            cosine, cosine_bar = _sharper(cosine, cosine_bar, both, both_bar, sine, sine_bar)
    return sine, sine_bar, cosine, cosine_bar


@inline
def _both(result):
    """sin^2 cos^2 of half the angle and its bar, from the results at T: (t^2 - s^2 - p^2) / 4,
    where t is half the difference of y2 and y1', p half their sum, and s half the difference of y1
    and y2', as det M = 1.

    Next to an edge t is nearly the root of s^2 + p^2, which is 0 where both solutions are periodic:
    it is known to the bars of the results where the trace is known to their root. Times in units
    that balance the bars of y2 and y1'.
    """
    unit = sqrt(result[lanes.DY1_BAR] / result[lanes.Y2_BAR]) if result[lanes.Y2_BAR] > 0.0 else 1.0
    unit = unit if 0.0 < unit < np.inf else 1.0
    b, c = result[lanes.Y2] * unit, result[lanes.DY1] / unit
    b_bar = result[lanes.Y2_BAR] * unit + EPS * abs(b)
    c_bar = result[lanes.DY1_BAR] / unit + EPS * abs(c)
    t, p, s = 0.5 * abs(b - c), 0.5 * (b + c), 0.5 * (result[lanes.Y1] - result[lanes.DY2])
    bar = 0.5 * (b_bar + c_bar)
    s_bar = 0.5 * (result[lanes.Y1_BAR] + result[lanes.DY2_BAR]) + EPS * abs(s)
    radius = sqrt(s * s + p * p)
    t_bar, radius_bar = bar + EPS * t, sqrt(s_bar * s_bar + bar * bar) + 4.0 * EPS * radius + LEAST
    low, high = t - radius, t + radius
    wide = (t_bar + radius_bar) * (1.0 + 8.0 * EPS)
    product, product_bar = _product(low, high, wide + EPS * abs(low), wide + EPS * high)
    return 0.25 * product, 0.25 * product_bar * (1.0 + 8.0 * EPS)


@inline
def _sharper(value, bar, product, product_bar, other, other_bar):
    """The value and its bar, or `product` / `other` if that is known better."""
    least = abs(other) - other_bar
    if not least > 0.0:
        return value, bar
    quotient = product / other
    found = (product_bar + abs(quotient) * other_bar) / least * (1.0 + 4.0 * EPS) + 2.0 * EPS * abs(
        quotient
    )
    return (quotient, found) if found < bar else (value, bar)


@unroll
def _product(a, b, ea, eb):
    """a b and its error bound, the rounding of the product included."""
    return a * b, ea * abs(b) + eb * abs(a) + ea * eb + EPS * abs(a * b) + LEAST


@inline
def decide(sine, sine_bar, cosine, cosine_bar):
    """The verdict, certain only where the bars exclude the other answer."""
    unstable = (sine < -sine_bar) | (cosine < -cosine_bar)
    stable = (sine > sine_bar) & (cosine > cosine_bar)
    return UNSTABLE if unstable else STABLE if stable else UNDECIDED


@kernel
def _growths(tile, rtol, values, bars, rounded, verdict, missed, left_out):
    """The exponents 2 asinh sqrt(growth) of neighbouring points, -sin^2 or -cos^2 of half the angle in
    row VALUE of `tile`, its bar in row DOUBT; their bars, and who misses. Not of who is `left_out`.
    """
    grow = False
    for i in range(len(values)):
        grow |= verdict[i] < STABLE
    if grow:
        for i in range(len(values)):
            tile[DOUBT, i] = _move(tile[VALUE, i], tile[DOUBT, i])
        arcsinh_roots(tile[VALUE, : len(values)], tile[WORK])
    for i in range(len(values)):
        still, x, bar = verdict[i] >= STABLE, 2.0 * tile[VALUE, i], tile[DOUBT, i]
        bar += 8.0 * EPS * x
        tile[VALUE, i], tile[DOUBT, i] = 0.0 if still else x, 0.0 if still else bar
    _keep(tile[VALUE], tile[DOUBT], rtol, values, bars, rounded, missed, left_out)


@kernel
def _keep(found, doubts, rtol, values, bars, rounded, missed, left_out):
    """Keep the numbers `found` of neighbouring points and their `doubts` as in `measure`, NaN of
    who is `left_out`; and who misses.
    """
    for i in range(len(values)):
        values[i] = found[i] if left_out[i] == 0 else np.nan
    fill_up(doubts, rounded)
    for i in range(len(rounded)):
        rounded[i] = rounded[i] if left_out[i] == 0 else np.float32(np.nan)
    for i in range(len(bars)):
        bars[i] = doubts[i] if left_out[i] == 0 else np.nan
    for i in range(len(values)):
        wide = not doubts[i] <= rtol * (1.0 + abs(found[i]))
        missed[i] |= wide & (left_out[i] == 0)


@inline
def _move(growth, bar):
    """How far 2 asinh sqrt(growth) moves within the bar, at most: its slope is 1 / sqrt(growth (1 + growth)),
    of which the second factor counts as it is at the lower end.
    """
    x, low, high = max(growth, 0.0), max(growth - bar, 0.0), max(growth + bar, 0.0)
    root = sqrt(x)
    # where both are 0 there is no difference
    down = (x - low) / max((root + sqrt(low)) * sqrt(1.0 + low), LEAST_ROOT)
    up = (high - x) / max((root + sqrt(high)) * sqrt(1.0 + x), LEAST_ROOT)
    return 2.0 * max(down, up) * (1.0 + 8.0 * EPS)


@splice
def _lost(full_period, verdict, tile):
    """The zeros of y1, y2 of neighbouring points into row ZEROS of `tile`, what the rotation number
    is off where they may be miscounted into row DOUBT.
    """
    for i in range(len(verdict)):
        own = tile[OWN:, i]
        zeros = own[lanes.Y1_ZEROS] + own[lanes.Y2_ZEROS]
        lost_1, lost_2 = (
            abs(own[lanes.Y1]) <= own[lanes.Y1_BAR],
            abs(own[lanes.Y2]) <= own[lanes.Y2_BAR],
        )
        if full_period:
            # where y2's last zero may lie on either side of T: sin^2 of the angle is at most -y1'
            # y2
            zeros = own[lanes.Y2_ZEROS]
            most = own[lanes.Y2_BAR] * (abs(own[lanes.DY1]) + own[lanes.DY1_BAR])
            doubt = sqrt(min(most, 1.0)) if lost_2 and verdict[i] != UNSTABLE else 0.0
        else:
            # next to T/2, where the other product's sign leaves it open
            lost_1 &= not tile[SINE, i] > tile[SINE_BAR, i]
            lost_2 &= not tile[COSINE, i] > tile[COSINE_BAR, i]
            doubt = 0.5 * lost_1 + 0.5 * lost_2
        tile[ZEROS, i], tile[DOUBT, i] = zeros, doubt


@splice
def _turns(tile, rtol, values, bars, rounded, verdict, missed, left_out):
    """theta_total / (2 pi) of neighbouring points: `ZEROS` of y1, y2 in (0, T/2) give the band; n / 2
    exactly in gaps. Their bars, and who misses. Not of who is `left_out`.
    """
    far = False
    for i in range(len(values)):
        tile[VALUE, i] = arctan_root(tile[SINE, i], tile[COSINE, i]) * (2.0 / pi)
        tile[WORK, i] = _steepest(*_of_half(tile, i))
        far |= not _is_near(tile[WORK, i], *_of_half(tile, i))
    if far:
        for i in range(len(values)):
            most = _farthest(*_of_half(tile, i))
            tile[WORK, i] = tile[WORK, i] if tile[WORK, i] < most else most
    for i in range(len(values)):
        sine, cosine, zeros, further = (
            tile[SINE, i],
            tile[COSINE, i],
            tile[ZEROS, i],
            tile[VALUE, i],
        )
        odd = zeros - 2.0 * np.floor(0.5 * zeros)
        lower = 1.0 if cosine < sine else 0.0
        further = lower if (sine < 0.0) | (cosine < 0.0) else further
        x = 0.5 * (zeros + (1.0 - further if odd == 1.0 else further))
        bar = tile[WORK, i] / pi + 4.0 * EPS * (1.0 + x)
        on_edge = verdict[i] == MARGINAL
        bar = 0.0 if on_edge | (verdict[i] == UNSTABLE) else bar
        tile[VALUE, i] = 0.5 * np.rint(2.0 * x) if on_edge else x
        tile[DOUBT, i] = bar + tile[DOUBT, i]
    _keep(tile[VALUE], tile[DOUBT], rtol, values, bars, rounded, missed, left_out)


@inline
def _steepest(sine, sine_bar, cosine, cosine_bar):
    """How far atan sqrt(sine / cosine) moves within the bars at most, by its steepest slopes there:
    sqrt(cosine / sine) / 2 (sine + cosine) times the bar of sine is one, and so forth, with
    sqrt((cosine + bar) (cosine - bar)) <= cosine.
    """
    low_sine, low_cosine = max(sine - sine_bar, 0.0), max(cosine - cosine_bar, 0.0)
    moved = 0.5 * (sine_bar * abs(cosine) + cosine_bar * abs(sine))
    return moved / (sqrt(low_sine * low_cosine) * (low_sine + low_cosine)) * (1.0 + 16.0 * EPS)


@inline
def _is_near(steep, sine, sine_bar, cosine, cosine_bar):
    """Is the point in a gap, or `steep` surely less than `_farthest`?"""
    low_sine, low_cosine = max(sine - sine_bar, 0.0), max(cosine - cosine_bar, 0.0)
    square = steep * steep
    less = (square * low_cosine <= sine) & (square * low_sine <= cosine) & (steep <= 1.0)
    return less | (sine < -sine_bar) | (cosine < -cosine_bar)


@inline
def _farthest(sine, sine_bar, cosine, cosine_bar):
    """How far atan sqrt(sine / cosine) moves within the bars at most: by all of it, or by all that it
    lacks to pi/2.

    Next to an edge one of the two is small, and the bar of the other counts for as little.
    """
    low_sine, low_cosine = max(sine - sine_bar, 0.0), max(cosine - cosine_bar, 0.0)
    ratio = sqrt(max(sine + sine_bar, 0.0) / low_cosine)
    inverse = sqrt(max(cosine + cosine_bar, 0.0) / low_sine)
    return min(0.5 * pi, ratio if ratio < inverse else inverse) * (1.0 + 16.0 * EPS)
