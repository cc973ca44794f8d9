"""Arithmetic of Hill's question, point by point: how many steps, and what follows from the
half-period factors.

The results of a point at T/2 are the columns of `kernels.lanes`. Formulas:
`survey.measures.hill.monodromy`.
"""

from math import asinh, atan2, isfinite, pi, sqrt

import numpy as np

from survey.kernels import lanes
from survey.kernels.jit import inline, kernel, splice
from survey.kernels.math.roundoff import EPS
from survey.kernels.unroll import unroll

LEAST = 2e-323  # what a few products lose where they underflow
LARGEST = float(np.finfo(np.float32).max)  # bars are kept as float32
UNDECIDED, UNSTABLE, STABLE, MARGINAL = -1, 0, 1, 2
# What an exact rule says of a point.
NO_RULE, NO_UNSTABLE_SIDE, ON_EDGE = 0, 1, 2
# Columns of `measure`, each followed by that of its error bound.
FLOATS = ("discriminant", "y1", "y2", "dy1", "dy2", "exponent", "rotation_number")
DISCRIMINANT, Y1, Y2, DY1, DY2, EXPONENT, ROTATION = range(0, 14, 2)
FACTOR_ROWS = np.array([Y1, DY1, Y2, DY2])  # in the order of the results
UNTRIED = -1
# Of half the angle of a point, where more digits are known: sin^2 and cos^2.
SINE, SINE_BAR, COSINE, COSINE_BAR = range(4)
SQUARES = 4


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
    floats,
    verdict,
    missed,
    status,
):
    """What follows from `results` (n, RESULTS) of n of N points, from the `first` on, by
    arithmetic: `floats` (14, N), `verdict`, who has `missed` `rtol`.

    Points whose `status` is not 0 are skipped; those that leave the range of floats get the status
    `overflow`. `rule` (N, or empty) holds what exact rules say, `wanted` (7) which columns count
    for `missed`, and `decides` whether an open verdict does; `full_period` as in `_squares`;
    `squares` (n, SQUARES, or empty) holds what it finds, where more digits of it are known.
    """
    for row in range(len(results)):
        i = first + row
        missed[i] = False
        verdict[i] = UNDECIDED
        if status[i] != 0:
            for c in range(len(floats)):
                floats[c, i] = np.nan
            continue
        sine, sine_bar, cosine, cosine_bar = _squares(results[row], squares, row, full_period)
        decided = decide(sine, sine_bar, cosine, cosine_bar, rule[i] if len(rule) > 0 else NO_RULE)
        # D from 2 - 4 sin^2 or 4 cos^2 - 2, whichever has the smaller bar.
        by_sine = sine_bar <= cosine_bar
        d = 2.0 - 4.0 * sine if by_sine else 4.0 * cosine - 2.0
        bar = 4.0 * (sine_bar if by_sine else cosine_bar) + 2.0 * EPS * (2.0 + abs(d))
        if decided == MARGINAL and abs(d) > bar:  # on an edge |D| = 2
            d, bar = 2.0 if d > 0.0 else -2.0, 0.0
        within = isfinite(d) and bar < LARGEST
        for c in range(4):
            within &= results[row, lanes.Y1_BAR + c] < LARGEST
        if not within:
            status[i] = overflow
            for c in range(len(floats)):
                floats[c, i] = np.nan
            continue
        verdict[i] = decided
        wide = decides and decided == UNDECIDED
        if wanted[0]:
            floats[DISCRIMINANT, i], floats[DISCRIMINANT + 1, i] = d, bar
            wide |= not bar <= rtol * (1.0 + abs(d))
        for c in range(4):
            at, value, bar = (
                FACTOR_ROWS[c],
                results[row, lanes.Y1 + c],
                results[row, lanes.Y1_BAR + c],
            )
            if wanted[at // 2]:
                floats[at, i], floats[at + 1, i] = value, bar
                wide |= not bar <= rtol * (1.0 + abs(value))
        missed[i] = wide


@kernel
def transcendental(
    first, results, squares, wanted, rtol, full_period, floats, verdict, missed, status
):
    """The columns of `measure` that are no arithmetic: exponent and rotation number, if wanted, and
    who misses.
    """
    for row in range(len(results)):
        i = first + row
        if status[i] != 0:
            continue
        sine, sine_bar, cosine, cosine_bar = _squares(results[row], squares, row, full_period)
        if wanted[EXPONENT // 2]:
            by_sine = sine < cosine
            growth, bar = -sine if by_sine else -cosine, sine_bar if by_sine else cosine_bar
            missed[i] |= _grows(growth, bar, rtol, floats[:, i], verdict[i])
        if wanted[ROTATION // 2]:
            zeros, doubt = results[row, lanes.Y1_ZEROS] + results[row, lanes.Y2_ZEROS], 0.0
            # where y2's last zero may lie on either side of T: sin^2 of the angle is at most -y1'
            # y2
            if full_period:
                zeros, bar = results[row, lanes.Y2_ZEROS], results[row, lanes.Y2_BAR]
                if abs(results[row, lanes.Y2]) <= bar:
                    doubt = min(
                        bar * (abs(results[row, lanes.DY1]) + results[row, lanes.DY1_BAR]), 1.0
                    )
            x, bar = _rotation(sine, sine_bar, cosine, cosine_bar, verdict[i], zeros)
            bar += sqrt(doubt) if verdict[i] != UNSTABLE else 0.0
            # a zero next to T/2 may be miscounted where the other product's sign leaves it open
            if not full_period:
                lost1 = (
                    abs(results[row, lanes.Y1]) <= results[row, lanes.Y1_BAR]
                    and not sine > sine_bar
                )
                lost2 = (
                    abs(results[row, lanes.Y2]) <= results[row, lanes.Y2_BAR]
                    and not cosine > cosine_bar
                )
                bar += 0.5 * lost1 + 0.5 * lost2
            floats[ROTATION, i], floats[ROTATION + 1, i] = x, bar
            missed[i] |= not bar <= rtol * (1.0 + x)


@kernel
def exponents(first, count, rtol, floats, verdict, missed):
    """The exponents of `count` points from each of `first` on, whose D and bar are known, and who
    misses `rtol`.
    """
    for start in first:
        for i in range(start, start + count):
            # |D| - 2 = 4 sinh^2(exponent / 2)
            growth = 0.25 * (abs(floats[DISCRIMINANT, i]) - 2.0)
            missed[i] |= _grows(
                growth, 0.25 * floats[DISCRIMINANT + 1, i], rtol, floats[:, i], verdict[i]
            )


@splice
def _squares(result, squares, i, full_period):
    """sin^2 and cos^2 of half the angle, each with its bar: -y1' y2 and y1 y2', or row i of
    `squares` if it has rows.

    With `full_period` the results are those at T: then (2 - D) / 4 and (2 + D) / 4, D = y1 + y2',
    the smaller one from their product, and the zeros of y2 in (0, T) give the band (that solution's
    angle advances from 0 to between d pi and (d + 1) pi).
    """
    y1, dy1, y2, dy2 = result[lanes.Y1], result[lanes.DY1], result[lanes.Y2], result[lanes.DY2]
    y1_bar, dy2_bar = result[lanes.Y1_BAR], result[lanes.DY2_BAR]
    sine, sine_bar = _product(-dy1, y2, result[lanes.DY1_BAR], result[lanes.Y2_BAR])
    cosine, cosine_bar = _product(y1, dy2, y1_bar, dy2_bar)
    if full_period:
        trace, size = y1 + dy2, abs(y1) + abs(dy2) + 2.0
        bar = 0.25 * (y1_bar + dy2_bar + 2.0 * EPS * size)
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


@inline
def _grows(growth, bar, rtol, floats, verdict):
    """Keep a point's exponent and its bar; does it miss `rtol`?"""
    x, bar = exponent(growth, bar, verdict)
    floats[EXPONENT], floats[EXPONENT + 1] = x, bar
    return not bar <= rtol * (1.0 + x)


@unroll
def _product(a, b, ea, eb):
    """a b and its error bound, the rounding of the product included."""
    return a * b, ea * abs(b) + eb * abs(a) + ea * eb + EPS * abs(a * b) + LEAST


@inline
def decide(sine, sine_bar, cosine, cosine_bar, rule):
    """The verdict: certain only when the bars exclude the other answer, or by an exact rule."""
    if rule == ON_EDGE:
        return MARGINAL
    if sine < -sine_bar or cosine < -cosine_bar:
        return UNSTABLE
    if (sine > sine_bar and cosine > cosine_bar) or rule == NO_UNSTABLE_SIDE:
        return STABLE
    return UNDECIDED


@inline
def exponent(growth, bar, verdict):
    """2 asinh sqrt(growth), growth = -sin^2 or -cos^2 of half the angle, and how far the bar can move it."""
    if verdict == STABLE or verdict == MARGINAL:
        return 0.0, 0.0
    middle = _asinh(growth)
    return middle, max(
        _asinh(growth + bar) - middle, middle - _asinh(growth - bar)
    ) + 8.0 * EPS * middle


@inline
def _asinh(growth):
    return 2.0 * asinh(sqrt(max(growth, 0.0)))


@inline
def _rotation(sine, sine_bar, cosine, cosine_bar, verdict, zeros):
    """theta_total / (2 pi): `zeros` of y1, y2 in (0, T/2) give the band; n / 2 exactly in gaps."""
    odd = zeros % 2.0 == 1.0
    if sine < 0.0 or cosine < 0.0:
        value = 0.5 * (zeros + (1.0 if odd != (cosine < sine) else 0.0))
    else:
        half = atan2(sqrt(sine), sqrt(cosine)) / pi
        value = 0.5 * (zeros + (1.0 - 2.0 * half if odd else 2.0 * half))
    if verdict == MARGINAL:
        return 0.5 * np.rint(2.0 * value), 0.0
    if verdict == UNSTABLE:
        return value, 0.0
    # arctan2 of both is no worse than either
    bar = max(_spread(sine, sine_bar), _spread(cosine, cosine_bar)) / pi
    return value, max(bar, 4.0 * EPS * (1.0 + value))


@inline
def _spread(square, bar):
    """How far arcsin sqrt(square) moves within the bar: by its steepest slope there, at most by
    arcsin sqrt(bar).
    """
    slope = 2.0 * sqrt(max(square - bar, 0.0) * max(1.0 - square - bar, 0.0))
    most = 0.5 * pi * sqrt(min(bar, 1.0))
    return min(bar / slope, most) if slope > 0.0 else most
