"""Basins: the cylinder cut into cells along phi, and in each the pieces of the curves that part
fates, in order.

The curves are the stable branches of saddles, the strong stable ones of attracting nodes, and unstable cycles. They are
followed in the flow that S1, (b, w, t) -> -(b, w, t), makes of the system, so that neighbours come nearer to them. All
equilibria are edges of cells: so g has one sign in a cell, a curve turns (w = 0) only with its tip towards the edge
where it does not arrive from, and on one side of w = 0 the pieces in a cell are ordered by |w| at the edge that all of
them touch, the `reference` edge. u = |w|.

A piece is a cubic of Hermite, of u over phi, or of phi over u where u changes by much. Its bar is
what its error ellipse leaves across it, and three times what the cubic misses at points between its
ends.
"""

import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.equilibria import ANGLE, DG, KIND, NODE, F, captured, offset, settled
from survey.kernels.cylinder.flow import BOUND_G, TWO_PI, TWO_PI_LOW, table, values
from survey.kernels.cylinder.steps import bar, carried, expand, to_target, until_turning
from survey.kernels.jit import inline, kernel
from survey.kernels.math.newton import bracketed

# A piece: its cell, side (0: w > 0), u at the reference edge and at the other (NaN: it turns), how
# its s-end is, and its cubic: over phi or over u, from X0 to X1, values and slopes there, is u
# greater to the left; bars of Y and of u.
CELL, SIDE, REFERENCE, OTHER, ENDING, OVER_U, X0, X1, Y0, Y1, D0, D1, FALLS, BAR, BAR_U = range(15)
PIECE = 15
# Where a curve starts: START_PHI to START_W_BAR of `records`, and of a BRANCH the angle and the bar
# of its equilibrium and its slope dw/dphi there.
REST, REST_BAR, SLOPE = range(4, 7)
# A point of a curve in a cell: phi, u, du/dphi, dphi/du, the error of u at this phi and of phi at
# this u. Of a sample the first two.
_PHI, _U, _RISE, _RUN, _U_BAR, _PHI_BAR = range(6)
_POINT, _SAMPLE = 6, 2
# Of a piece, where serial numbers are those of pieces along their curves: the first one of its
# curve, and of the next curve.
CURVE_FIRST, CURVE_NEXT = range(2)
# A link of two gaps: the gap, the one before it in time, the turns by which limits of starts there
# lie further, the turning points more.
LATER, EARLIER, TURNS, TURNINGS = range(4)
LINK = 4
# Do turns, do turning points depend on how one goes to the root of a region?
BY_TURNS, BY_TURNINGS = range(2)
LOOPS = 2
# into the next piece; cut off; at an equilibrium; into the first piece
GOES_ON, CUT, ARRIVES, CLOSES = range(4)
BRANCH, ROTATION, LIBRATION = range(3)  # what is followed
LIMIT = 40_000  # steps
# windings nearer to one another are not told apart, relative to 1 rad and to the velocities
CLOSE = 2e-6
ARRIVED = 1e-6  # rad from a node
RATIO = 0.6  # of u at the ends of a piece: below it is written over u
WORST = 1e-5  # bar at which a curve is cut
SAMPLES = 16
NEAR_REST = 1e-12  # |g| over its bound, at w = 0: nearer to rest the side is not told from it
HIDDEN = 1e300


@inline
def _hermite(piece, x):
    size = piece[X1] - piece[X0]
    t = (x - piece[X0]) / size
    r = 1.0 - t
    a = piece[Y0] * (1.0 + 2.0 * t) + size * piece[D0] * t
    b = piece[Y1] * (1.0 + 2.0 * r) - size * piece[D1] * r
    return a * r * r + b * t * t


@kernel
def side_of(piece, phi, u):
    """1 where (phi, u) is certainly above the piece (at greater u), -1 below, 0 open."""
    if piece[OVER_U] == 0.0:
        away = u - _hermite(piece, phi)
        return 0 if not abs(away) > piece[BAR] else (1 if away > 0.0 else -1)
    if u > piece[X1] + piece[BAR_U]:
        return 1
    if u < piece[X0] - piece[BAR_U]:
        return -1
    away = phi - _hermite(piece, min(max(u, piece[X0]), piece[X1]))
    if not abs(away) > piece[BAR]:
        return 0
    return 1 if (away > 0.0) == (piece[FALLS] > 0.0) else -1


@inline
def _end_of(p, phi, w, sign, n, saa, sab, sbb, end):
    """Note a point of the curve."""
    f, g, _dg = values(p, phi)
    accel = f * w + g
    across = bar(n, max(accel * accel * saa - 2.0 * accel * w * sab + w * w * sbb, 0.0))
    end[_PHI], end[_U] = phi, abs(w)
    end[_RISE], end[_RUN] = sign * accel / w, sign * w / accel
    end[_U_BAR], end[_PHI_BAR] = across / abs(w), across / abs(accel)


@kernel
def _write(cell, sign, falling, entry, end, turns, samples, count, scale, piece):
    """Fill `piece` between the points where the curve enters the cell and where it ends there;
    returns its relative error.

    `turns`: does it turn in this cell? `falling`: g < 0 there, so that the reference edge is the
    left one.
    """
    left, right = (entry, end) if entry[_PHI] < end[_PHI] else (end, entry)
    low, high = (entry, end) if entry[_U] < end[_U] else (end, entry)
    piece[CELL], piece[SIDE], piece[ENDING] = cell, 1.0 if sign > 0 else 0.0, GOES_ON
    piece[REFERENCE] = left[_U] if falling else right[_U]
    piece[OTHER] = math.nan if turns else (right[_U] if falling else left[_U])
    piece[FALLS] = 1.0 if left[_U] > right[_U] else 0.0
    unit, best = scale + high[_U], math.inf
    for over in range(2):
        if (over and low[_U] >= RATIO * high[_U]) or (not over and low[_U] == 0.0):
            continue
        error = _cubic(left, right, low, high, over, samples, count, unit, piece)
        if not error < best and best < math.inf:  # back to the first
            _cubic(left, right, low, high, 0, samples, count, unit, piece)
        best = min(best, error)
    return (low[_PHI_BAR] if piece[OVER_U] else low[_U_BAR] / unit) + (
        high[_PHI_BAR] if piece[OVER_U] else high[_U_BAR] / unit
    )


@kernel
def _cubic(left, right, low, high, over, samples, count, unit, piece):
    """Fill the cubic and its bars, over u if `over`; returns the error, relative."""
    piece[OVER_U] = over
    if over:
        piece[X0], piece[X1], piece[Y0], piece[Y1] = low[_U], high[_U], low[_PHI], high[_PHI]
        piece[D0], piece[D1] = low[_RUN], high[_RUN]
        across = max(low[_PHI_BAR], high[_PHI_BAR])
    else:
        piece[X0], piece[X1], piece[Y0], piece[Y1] = left[_PHI], right[_PHI], left[_U], right[_U]
        piece[D0], piece[D1] = left[_RISE], right[_RISE]
        across = max(left[_U_BAR], right[_U_BAR])
    missed, highest = 0.0, high[_U]
    for i in range(count):
        phi, u = samples[i, _PHI], samples[i, _U]
        highest = max(highest, u)
        x, y = (u, phi) if over else (phi, u)
        if x < piece[X0] or x > piece[X1]:  # u is not monotone, or a sample is the end itself
            missed = max(
                missed, 0.0 if abs(y - piece[Y0]) < 1e-13 or abs(y - piece[Y1]) < 1e-13 else HIDDEN
            )
        else:
            missed = max(missed, abs(y - _hermite(piece, x)))
    size = 1.0 if over else unit
    piece[BAR] = 2.0 * across + 3.0 * missed + 1e-12 * size
    # u, whose samples stand at thirds of times, exceeds them by half at most where it is concave
    piece[BAR_U] = (
        min(2.0 * piece[BAR] / max(abs(high[_RUN]), 1e-300), 2.0 * highest) + 1e-12 * unit
        if over
        else 0.0
    )
    return piece[BAR] / size


@inline
def _crossing(at, p, T, target, up, guess, low, high):
    """dt in [low, high] where phi = target."""
    return bracketed(
        to_target, at, (p, T, target, up), guess, (low, high), (1e-16 * high, 0.0), 60
    )[1]


@inline
def pieces(
    setting,
    begin,
    at,
    p,
    start,
    edges,
    falls,
    eqs,
    count,
    kind,
    cell,
    top,
    scale,
    tolerance,
    most,
    out,
):
    """Fill `out` (rows, PIECE) with the pieces of a curve of the flow p, which S1 has made of the
    system; their number.

    start: START_PHI to SLOPE; phi is in the cell number `cell` of those between the edges. falls: is g <
    0 in the cell? eqs: equilibria of p. A branch is cut off a turn after u has passed `top`, or
    where its windings come too near to one another.
    """
    T, samples = table(), np.zeros((SAMPLES, _SAMPLE))
    entry, end = np.zeros(_POINT), np.zeros(_POINT)
    how = setting(p, start[rc.START_W], tolerance)
    cells = len(edges) - 1
    phi, w, n, size, kept = start[rc.START_PHI], start[rc.START_W], 0, 0, 0
    off, wide = start[rc.START_PHI_BAR], start[rc.START_W_BAR]
    saa, sab, sbb = off * off, 0.0, wide * wide
    sign = 1 if w > 0.0 or (w == 0.0 and values(p, phi)[1] > 0.0) else -1
    sampled, from_axis, turnings = 0, False, 0
    if kind == BRANCH:
        slope = start[SLOPE]
        entry[_PHI], entry[_U] = start[REST], 0.0
        entry[_RISE], entry[_RUN] = sign * slope, sign / slope
        entry[_U_BAR], entry[_PHI_BAR] = start[REST_BAR] * abs(slope), start[REST_BAR]
        samples[0, _PHI], samples[0, _U] = phi, abs(w)
        sampled = 1
    elif kind == ROTATION:
        _end_of(p, phi, w, sign, 1, saa, sab, sbb, entry)
        cell = (cell if sign > 0 else cell - 1) % cells
        if sign < 0 and cell == cells - 1:
            phi += TWO_PI
            entry[_PHI] = phi
    else:
        _end_of(p, phi, 0.0, sign, 1, saa, sab, sbb, entry)
        from_axis = True
    first, before, right, ending, fast = cell, math.nan, math.nan, CUT, 0
    while n < LIMIT and size + 2 < most:
        h = expand(begin, p, phi, w, how, T)
        n += 1
        h, x1, w1, turned = until_turning(at, p, T, h, sign)
        if not (h > 0.0 and math.isfinite(w1) and math.isfinite(x1)):
            break
        dt, shift, done = 0.0, 0.0, False
        while True:
            target = (edges[cell + 1] if sign > 0 else edges[cell]) + shift
            reached = (x1 - target) * sign >= 0.0
            to = h
            if reached:
                guess = (
                    min(dt + (target - at(p, T, dt)[0]) / (w if w != 0.0 else w1), h)
                    if w * w1 != 0.0
                    else h
                )
                to = _crossing(at, p, T, target, sign > 0, max(guess, dt), dt, h)
            for k in range(1, 3):
                x, v, _e, _y = at(p, T, dt + (to - dt) * (k / 3.0))
                if sampled < SAMPLES:
                    samples[sampled, _PHI], samples[sampled, _U] = x - shift, abs(v)
                    sampled += 1
            if not reached:
                break
            _x, v, _e, _y = at(p, T, to)
            a, b, c = carried(p, T, to, v, saa, sab, sbb)
            edge = edges[cell + 1] if sign > 0 else edges[cell]
            _end_of(p, edge, v, sign, n + 1, a, b, c, end)
            wide = _write(
                cell, sign, falls[cell], entry, end, from_axis, samples, sampled, scale, out[size]
            )
            size, sampled, from_axis, dt = size + 1, 0, False, to
            kept = size
            fast = 0 if abs(v) < top else fast + 1
            if not wide < WORST or fast > cells:
                done = True
                break
            cell += sign
            if cell == cells or cell < 0:
                cell, shift = cell - sign * cells, shift + sign * TWO_PI
                if kind == BRANCH:
                    done = done or abs(abs(v) - before) < CLOSE * (scale + abs(v))
                    before = abs(v)
            for i in range(_POINT):
                entry[i] = end[i]
            entry[_PHI] = edges[cell] if sign > 0 else edges[cell + 1]
            if kind == ROTATION and cell == first:
                ending, done = CLOSES, True
            if done or size + 2 >= most:
                done = True
                break
        if done:
            break
        saa, sab, sbb = carried(p, T, h, w1, saa, sab, sbb)
        phi, w = x1 - shift, (0.0 if turned else w1)
        if shift != 0.0:
            phi -= (1.0 if shift > 0.0 else -1.0) * TWO_PI_LOW
        if turned:
            _end_of(p, phi, 0.0, sign, n + 1, saa, sab, sbb, end)
            wide = _write(
                cell, sign, falls[cell], entry, end, True, samples, sampled, scale, out[size]
            )
            size, sampled, from_axis, before = size + 1, 0, True, math.nan
            turnings += 1
            for i in range(_POINT):
                entry[i] = end[i]
            sbb, sab = 0.0, 0.0
            sign = -sign
            if kind == LIBRATION and turnings == 2:
                ending, kept = CLOSES, size
                break
            if not wide < WORST:
                break
            if sign < 0:
                gone = abs(offset(phi, right)[0]) < CLOSE if not math.isnan(right) else False
                right = phi
                if gone:
                    break
        elif kind == BRANCH:
            held = captured(eqs, count, phi, w, 0.0)
            if held >= 0 and eqs[held, KIND] == NODE:
                x, _turns = offset(phi, eqs[held, ANGLE])
                if abs(x) < ARRIVED and settled(p, eqs[held, F], eqs[held, DG], x, w):
                    where = edges[cell + 1] if sign > 0 else edges[cell]
                    slope = 0.5 * (
                        eqs[held, F] + math.sqrt(eqs[held, F] ** 2 + 4.0 * eqs[held, DG])
                    )
                    end[_PHI], end[_U] = where, 0.0
                    end[_RISE], end[_RUN] = sign * slope, sign / slope
                    end[_U_BAR], end[_PHI_BAR] = 4.0 * ARRIVED * abs(slope), 4.0 * ARRIVED
                    _write(
                        cell,
                        sign,
                        falls[cell],
                        entry,
                        end,
                        from_axis,
                        samples,
                        sampled,
                        scale,
                        out[size],
                    )
                    if from_axis:
                        break
                    size, ending = size + 1, ARRIVES
                    kept = size
                    break
    size = kept
    if size > 0:
        out[size - 1, ENDING] = ending
    return size


@kernel
def numbers(found, falls, first, turning, resting):
    """Where the pieces, sorted by cell, side and u, of each cell and side begin, how many of them
    turn there, and how many begin or end at an equilibrium that is their reference edge; False if
    their order contradicts itself.
    """
    for i in range(len(found)):
        first[int(2 * found[i, CELL] + found[i, SIDE]) + 1] += 1
    for key in range(len(first) - 1):
        first[key + 1] += first[key]
        at, far = 0, -1.0
        for i in range(first[key], first[key + 1]):
            if math.isnan(found[i, OTHER]):
                turning[key] += 1
                if at == 1 or found[i, REFERENCE] == 0.0:
                    return False
                continue
            at = 1
            resting[key] += found[i, REFERENCE] == 0.0
            if not found[i, OTHER] > far:
                return False
            far = found[i, OTHER]
        if turning[key] > 0 and resting[key] > 0:
            return False
    for cell in range((len(first) - 1) // 2):
        if turning[2 * cell] != turning[2 * cell + 1]:
            return False
    return True


@kernel
def _root(parent, turns, counts, i):
    """The root of the region i belongs to, and what turns and turning points differ by from there."""
    t, c = 0, 0
    while parent[i] != i:
        t, c, i = t + turns[i], c + counts[i], parent[i]
    return i, t, c


@kernel
def _join(parent, turns, counts, loops, a, b, turn, count):
    """Limits of a lie `turn` turns further than those of b, and from a there are `count` more
    turning points.
    """
    root_a, turns_a, counts_a = _root(parent, turns, counts, a)
    root_b, turns_b, counts_b = _root(parent, turns, counts, b)
    if root_a == root_b:
        if turns_a != turns_b + turn:
            loops[root_a, BY_TURNS] = 1
        if counts_a != counts_b + count:
            loops[root_a, BY_TURNINGS] = 1
        return
    parent[root_a] = root_b
    turns[root_a] = turns_b + turn - turns_a
    counts[root_a] = counts_b + count - counts_a
    for i in range(LOOPS):
        loops[root_b, i] = max(loops[root_b, i], loops[root_a, i])


@inline
def _link(link, later, earlier, turns, turnings):
    link[LATER], link[EARLIER], link[TURNS], link[TURNINGS] = later, earlier, turns, turnings


@kernel
def neighbours(found, serial, curve, falls, first, turning, links, seeds):
    """Fill `links` (n, LINK) and `seeds`, gaps into which, against time, a curve goes on that was
    cut off; returns their numbers, or (-1, -1) if the order of pieces contradicts itself.

    A gap lies below a piece, or above the last: gap number first[key] + key + j, key = 2 cell +
    side. serial: the number of a piece on its curve; curve: CURVE_FIRST, CURVE_NEXT.
    """
    cells, size, cuts = len(falls), 0, 0
    for edge in range(cells):  # between the cells edge - 1 and edge
        left = edge - 1 if edge > 0 else cells - 1
        for side in range(2):
            key_left, key_right = 2 * left + side, 2 * edge + side
            # g > 0: it is the reference edge
            i = first[key_left] if falls[left] == 0 else first[key_left] + turning[key_left]
            j = first[key_right] if falls[edge] != 0 else first[key_right] + turning[key_right]
            while True:
                more_left, more_right = i < first[key_left + 1], j < first[key_right + 1]
                same, rest_left, rest_right = False, False, False
                if more_left:
                    rest_left = (
                        found[i, REFERENCE] if falls[left] == 0 else found[i, OTHER]
                    ) == 0.0
                if more_right:
                    rest_right = (
                        found[j, REFERENCE] if falls[edge] != 0 else found[j, OTHER]
                    ) == 0.0
                if (
                    more_left
                    and more_right
                    and not rest_left
                    and not rest_right
                    and curve[i, CURVE_FIRST] == curve[j, CURVE_FIRST]
                ):
                    before, after = (serial[i], serial[j]) if side == 1 else (serial[j], serial[i])
                    # the curve goes on to the left where w > 0, against time
                    same = after == before + 1 or (
                        before == curve[i, CURVE_NEXT] - 1 and after == curve[i, CURVE_FIRST]
                    )
                if not rest_left and not rest_right:
                    # L(left) = L(right) + 1 beyond the first edge
                    a, b = i + key_left, j + key_right
                    beyond = 1 if edge == 0 else 0
                    if side == 0:
                        _link(links[size], b, a, beyond, 0)
                    else:
                        _link(links[size], a, b, -beyond, 0)
                    size += 1
                if same:
                    i, j = i + 1, j + 1
                elif not more_left and not more_right:
                    break
                elif more_left and (rest_left or (side == 1 and found[i, ENDING] == CUT)):
                    if not rest_left:
                        seeds[cuts] = j + key_right
                        cuts += 1
                    i += 1
                elif more_right and (rest_right or (side == 0 and found[j, ENDING] == CUT)):
                    if not rest_right:
                        seeds[cuts] = i + key_left
                        cuts += 1
                    j += 1
                else:
                    return -1, -1
    for cell in range(cells):
        for k in range(turning[2 * cell] + 1):
            plus, minus = first[2 * cell] + 2 * cell + k, first[2 * cell + 1] + 2 * cell + 1 + k
            # g < 0: from w > 0 to w < 0 in time
            later, earlier = (minus, plus) if falls[cell] != 0 else (plus, minus)
            _link(links[size], later, earlier, 0, 1)
            size += 1
    return size, cuts


@kernel
def regions(links, size, seeds, cuts, gaps, parent, turns, counts, loops, open_):
    """Join the gaps that no curve parts; open_[gap]: a curve that was cut off may part it, as all
    that came from there.

    loops[root]: BY_TURNS, BY_TURNINGS.
    """
    head = np.full(gaps, -1)
    after = np.empty(size, dtype=np.int64)
    queue = np.empty(gaps, dtype=np.int64)
    for k in range(size):
        later = links[k, LATER]
        after[k], head[later] = head[later], k
    top = 0
    for k in range(cuts):
        if not open_[seeds[k]]:
            open_[seeds[k]], queue[top], top = True, seeds[k], top + 1
    while top > 0:
        top -= 1
        k = head[queue[top]]
        while k >= 0:
            gap = links[k, EARLIER]
            if not open_[gap]:
                open_[gap], queue[top], top = True, gap, top + 1
            k = after[k]
    for i in range(gaps):
        parent[i] = i
    for k in range(size):
        later, earlier = links[k, LATER], links[k, EARLIER]
        if open_[later] or open_[earlier]:
            continue
        _join(parent, turns, counts, loops, earlier, later, links[k, TURNS], links[k, TURNINGS])
    for i in range(gaps):
        root, t, c = _root(parent, turns, counts, i)
        if parent[i] != i:
            parent[i], turns[i], counts[i] = root, t, c


@kernel
def located(p, starts, breaks, numbers_of, edges, found, first, limits, gaps, turned):
    """Fill gaps (N) with the gap of each start (phi, w), -1 where it is nearer to a piece than that
    one's bar, and turned (N) with the whole turns from the cells to it.

    breaks: equilibria, ascending over a turn; numbers_of: the number of the first cell after each. limits: the |w| up
    to which the curves are complete, for w > 0 and w < 0.
    """
    base, most = edges[0], len(breaks) - 1
    for i in range(len(starts)):
        phi, w = starts[i, rc.START_PHI], starts[i, rc.START_W]
        m = math.floor((phi - base) / TWO_PI)
        x = (phi - m * TWO_PI) - m * TWO_PI_LOW
        gaps[i], turned[i] = -1, m
        if not base <= x < edges[-1]:
            continue
        k = 0
        while k < most - 1 and x >= breaks[k + 1]:
            k += 1
        cells = numbers_of[k + 1] - numbers_of[k]
        cell = numbers_of[k] + min(
            int((x - breaks[k]) / (breaks[k + 1] - breaks[k]) * cells), cells - 1
        )
        if x < edges[cell]:
            cell -= 1
        elif x > edges[cell + 1]:
            cell += 1
        sign = w
        if w == 0.0:
            g = values(p, x)[1]
            sign = g if abs(g) > NEAR_REST * p[BOUND_G] else 0.0
        u, side = abs(w), 0 if sign > 0.0 else 1
        if sign == 0.0 or not u < limits[side]:
            continue
        key = 2 * cell + side
        low, high, sure = first[key], first[key + 1], True
        while low < high:
            middle = (low + high) // 2
            where = side_of(found[middle], x, u)
            if where == 0:
                sure = False
                break
            if where > 0:
                low = middle + 1
            else:
                high = middle
        if sure:
            gaps[i] = low + key
