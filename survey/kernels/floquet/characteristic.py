"""Multipliers, and what follows from them, of points where the coefficients of a polynomial are
series.

The polynomial is monic: the characteristic one of M, whose roots are the multipliers l, or, of
symplectic and reversible systems ("paired": with l, 1 / l is a multiplier), that whose roots are
the s = l + 1 / l. Weierstrass's iteration finds its roots z_i in lanes, from those at the nearest
node; its corrections W_i at the end bound their errors, since the roots are the eigenvalues of
diag(z_i) - W 1^T: Gershgorin's discs of it, in units that make one of them narrow, hold one root
each. Of coefficients known to within `doubts` W_i is known to within a bound.

A point whose discs meet, or whose answer misses what is asked, is `missed`: its own monodromy has
to tell.

Sources: B. T. Smith, J. ACM 17 (1970) 661; V. A. Yakubovich, V. M. Starzhinskii, Linear
Differential Equations with Periodic Coefficients (1975), III.
"""

import math

import numpy as np

from survey.kernels.jit import inline, kernel, part
from survey.kernels.math.chebyshev import restrict
from survey.kernels.math.roundoff import EPS, ROUNDOFF_UP

LANES = 32
PARTS = 4  # of what is nearest to a node, along each side
ITERATIONS = 5  # from roots near by
MOST = 60  # from a circle
CLOSE = 1e-4  # a correction, relative to the largest root, from which they converge as from nearby
UNDECIDED, UNSTABLE, STABLE = -1, 0, 1  # as in measures.floquet.multipliers, and so are those below
PLUS_ONE, MINUS_ONE, NEIMARK_SACKER, COLLISION = 1, 2, 3, 4
MULTIPLIERS, RADIUS, VERDICT, CROSSING, KREIN = range(5)  # columns of `asked`
TIE = 1e-9  # moduli that differ by a smaller share are not told apart when multipliers are sorted


def blocks(number, K, d):
    """Room for c, bars, z, y and points of so many blocks, as `answer` takes them."""
    shapes = (K, LANES), (K, LANES), (d, LANES), (d, LANES)
    return *(np.empty((number, *shape)) for shape in shapes), np.empty((number, LANES), np.int64)


@kernel
def answer(
    c, bars, z, y, points, begun, n, paired, asked, rtol, floats, signs, verdict, crossing, missed
):
    """Answer blocks of LANES points from their coefficients c, known to within `bars` (blocks, K,
    LANES), and the roots z + i y at the nearest nodes (blocks, d, LANES), which are used up.

    points (blocks, LANES): their columns of `floats`, `signs`, ... as in `stability.Answers`; -1 where a block ends
    earlier. Of K = 2 d coefficients the last d are those of the Krein form. Points whose roots are not found from those
    of the node, as where real ones have become complex, begin at a circle once all others are answered; unless
    `begun`, where no roots are known, all do.
    """
    blocks, K, d = len(c), c.shape[1], z.shape[1]
    own_c, own_bars = np.empty((K, LANES)), np.empty((K, LANES))
    own_points, found = np.empty(LANES, np.int64), np.empty(LANES, np.bool_)
    left, number, done, b = np.empty(blocks * LANES, np.int64), 0, 0, 0
    if d > 2 and not begun:
        b = blocks
        for k in range(blocks * LANES):
            if points[k // LANES, k % LANES] >= 0:
                left[number] = k
                number += 1
    while b < blocks or done < number:
        later, own = b == blocks, min(b, blocks - 1)
        count = min(LANES, number - done) if later else 0
        if later:
            for lane in range(LANES):
                block, place = divmod(left[done + min(lane, count - 1)], LANES)
                own_points[lane] = points[block, place]
                for k in range(K):
                    own_c[k, lane], own_bars[k, lane] = c[block, k, place], bars[block, k, place]
            from_circle(own_c, d, z[own], y[own])
        while not later and count < LANES and points[b, count] >= 0:
            count += 1
        answer_lanes(  # called once, and so compiled once
            own_c if later else c[b], own_bars if later else bars[b], z[own], y[own],
            own_points if later else points[b], count, n, paired, asked, rtol, floats, signs, verdict, crossing, missed,
            found,
        )  # fmt: skip
        if later:
            done += LANES
            continue
        for lane in range(count if d > 2 else 0):
            if not found[lane]:
                left[number] = b * LANES + lane
                number += 1
        b += 1


@kernel
def fill_rows(series, doubts, x, places, near, starts, outputs, needed, c, bars, z, y, points):
    """Fill c, bars, z, y and `points` of `answer` for the points `outputs` (R, L) of rows at x (R),
    columns at `places` (L); each row has blocks of its own.

    series (n1, K m), of K coefficients, of which the first are `needed`, m terms along the row each. near (R + L): the
    part of each row, then of each column, of which each node has PARTS; doubts (K, parts, parts):
    how well the coefficients are known there; starts (n1, m, d, 2): the roots at the nodes.
    """
    K, m, R, L = len(doubts), starts.shape[1], len(x), outputs.shape[1]
    rows, table = np.empty((R, K * m)), np.empty((m, LANES))
    restrict(series, x, rows)
    of_row = (L + LANES - 1) // LANES
    for first in range(0, L, LANES):
        count = min(LANES, L - first)
        for lane in range(LANES):
            table[0, lane] = 1.0
            if m > 1:
                table[1, lane] = places[first + min(lane, count - 1)]
        _polynomials(table)
        for r in range(R):
            b = r * of_row + first // LANES
            for k in range(needed):
                _sum(rows[r, k * m : (k + 1) * m], table, c[b, k])
            for lane in range(LANES):
                column = first + min(lane, count - 1)
                points[b, lane] = outputs[r, column] if lane < count else -1
                one, two = near[r], near[R + column]
                _nearest(doubts, starts, one, two, needed, bars[b], z[b], y[b], lane)


@inline
def _nearest(doubts, starts, one, two, needed, bars, z, y, lane):
    """Set the bounds, and the roots where they are of use, of a point in the parts `one` and `two`."""
    for k in range(needed):
        bars[k, lane] = doubts[k, one, two]
    for i in range(len(z) if len(z) > 2 else 0):
        z[i, lane] = starts[one // PARTS, two // PARTS, i, 0]
        y[i, lane] = starts[one // PARTS, two // PARTS, i, 1]


@kernel
def is_short(n, asked):
    """Is all that is asked answered by `_of_two`?"""
    return n == 2 and not (asked[MULTIPLIERS] or asked[CROSSING] or asked[KREIN])


@inline
def _sum(weights, table, sums):
    """Fill `sums` with those of the weights times the rows of `table`."""
    sums[:] = 0.0
    fours = len(weights) - len(weights) % 4
    for j in range(len(weights) - 1, fours - 1, -1):
        w, t = weights[j], table[j]
        for lane in range(LANES):
            sums[lane] += w * t[lane]
    for j in range(fours - 4, -1, -4):  # four at once: sums are read and written less often
        w0, w1, w2, w3 = weights[j], weights[j + 1], weights[j + 2], weights[j + 3]
        t0, t1, t2, t3 = table[j], table[j + 1], table[j + 2], table[j + 3]
        for lane in range(LANES):
            sums[lane] += (w0 * t0[lane] + w1 * t1[lane]) + (w2 * t2[lane] + w3 * t3[lane])


@kernel
def fill_points(series, terms, doubts, x, near, starts, outputs, needed, c, bars, z, y, points):
    """As `fill_rows`, for points at x (2, N), each with coordinates of its own; near (2, N).

    terms (K, m): how many across the rows count of each series along them.
    """
    m, n1, N = starts.shape[1], len(series), x.shape[1]
    across, along, part = np.empty((n1, LANES)), np.empty((m, LANES)), np.empty(LANES)
    for first in range(0, N, LANES):
        b, count = first // LANES, min(LANES, N - first)
        for lane in range(LANES):
            p = first + min(lane, count - 1)
            points[b, lane] = outputs[p] if lane < count else -1
            across[0, lane], along[0, lane] = 1.0, 1.0
            if n1 > 1:
                across[1, lane] = x[0, p]
            if m > 1:
                along[1, lane] = x[1, p]
            _nearest(doubts, starts, near[0, p], near[1, p], needed, bars[b], z[b], y[b], lane)
        _polynomials(across)
        _polynomials(along)
        for k in range(needed):
            sums = c[b, k]
            sums[:] = 0.0
            for j in range(m - 1, -1, -1):
                _sum(series[: terms[k, j], k * m + j], across, part)
                one = along[j]
                for lane in range(LANES):
                    sums[lane] += part[lane] * one[lane]


@kernel
def _polynomials(table):
    """Fill rows 2, 3, ... of `table` with T_k, by its recurrence from rows 0 and 1."""
    for k in range(2, len(table)):
        one, two, own, x = table[k - 1], table[k - 2], table[k], table[1]
        for lane in range(len(x)):
            own[lane] = 2.0 * x[lane] * one[lane] - two[lane]


@inline
def answer_lanes(
    c, bars, z, y, outputs, count, n, paired, asked, rtol, floats, signs, verdict, crossing, missed, found
):  # fmt: skip
    """Answer the first `count` of LANES points from their coefficients c (K, LANES), known to
    within `bars`, and roots z + i y (d, LANES), nearly (of no use where d < 3). `found`
    (LANES): has each root a disc of its own, which no step more would narrow much?
    """
    K, d = len(c), len(z)
    if is_short(n, asked):
        _of_two(c, bars, outputs, count, paired, asked, rtol, floats, verdict, crossing, missed)
        return
    w, gap, parts = np.empty((d, LANES)), np.empty((d, LANES)), np.empty((6, LANES))
    rho, lane_z = np.empty(d), np.empty((d, 2))
    re, im, bar, sign = np.empty(n), np.empty(n), np.empty(n), np.zeros(n, np.int8)
    size, angle, order = np.empty(n), np.empty(n), np.empty(n, np.int64)
    form = np.empty((2, d))
    _roots(c, d, z, y, parts)
    _corrections(c, d, bars, z, y, w, gap, parts, found)
    if not (paired or asked[MULTIPLIERS] or asked[CROSSING] or asked[KREIN]):
        _radii(
            z, y, w, gap, outputs, count, n, asked, rtol, floats, verdict, crossing, missed, found, parts
        )  # fmt: skip
        return
    for lane in range(count):
        p = outputs[lane]
        widest = 0.0
        for i in range(d):
            widest = max(widest, w[i, lane]) if w[i, lane] >= 0.0 else math.inf
        clear = widest < math.inf
        for i in range(d):
            clear = clear and gap[i, lane] > 2.0 * d * (w[i, lane] + widest)
            rho[i] = w[i, lane] * (1.0 + (d - 1) * min(1.0, 2.0 * widest / gap[i, lane]))
            lane_z[i, 0], lane_z[i, 1] = z[i, lane], y[i, lane]
        verdict[p], crossing[p], missed[p] = UNDECIDED, UNDECIDED, True
        found[lane] = found[lane] and clear
        if not clear:
            continue
        open_signs = False
        if paired:
            if K > d:
                for i in range(d):
                    form[0, i], form[1, i] = c[d + i, lane], bars[d + i, lane]
            decided, open_signs = _paired(lane_z, rho, form, K > d, re, im, bar, sign)
        else:
            for i in range(d):
                re[i], im[i], bar[i] = lane_z[i, 0], lane_z[i, 1], rho[i]
                if abs(im[i]) <= bar[i]:
                    im[i] = 0.0  # its mirror image would be in the same disc
            decided = UNDECIDED
        wide = _write(re, im, bar, size, decided, paired, asked, rtol, p, floats, verdict, missed)
        if not missed[p] and (asked[MULTIPLIERS] or asked[CROSSING] or asked[KREIN]):
            _sort(re, im, bar, size, sign, p, floats, signs, angle, order)
            crossing[p] = _crossing(re, im, bar, size, angle, sign, verdict[p], paired, K > d)
            # two of one modulus, as in systems of equal damping, stay so at any accuracy
            missed[p] = (wide and asked[CROSSING] and crossing[p] == UNDECIDED) or (
                open_signs and (asked[KREIN] or asked[CROSSING])
            )


@part
def _radii(
    z, y, w, gap, outputs, count, n, asked, rtol, floats, verdict, crossing, missed, found, parts
):
    """Write the spectral radius and the verdict alone, as `_write` does, from roots z + i y in lanes."""
    widest, free, value, top, least = parts[0], parts[1], parts[2], parts[3], parts[4]
    d, lanes = len(z), len(widest)
    widest[:], value[:], top[:], least[:] = 0.0, 0.0, 0.0, 0.0
    free[:] = math.inf
    for i in range(d):
        own = w[i]
        for lane in range(lanes):
            widest[lane] = max(widest[lane], own[lane]) if own[lane] >= 0.0 else math.inf
    for i in range(d):
        x, t, own, near = z[i], y[i], w[i], gap[i]
        for lane in range(lanes):
            free[lane] = min(free[lane], near[lane] - 2.0 * d * (own[lane] + widest[lane]))
            bar = own[lane] * (1.0 + (d - 1) * min(1.0, 2.0 * widest[lane] / near[lane]))
            # 0 where its mirror image would be in the same disc
            im = t[lane] if abs(t[lane]) > bar else 0.0
            size = math.sqrt(x[lane] * x[lane] + im * im)
            value[lane], top[lane] = max(value[lane], size), max(top[lane], size + bar)
            least[lane] = max(least[lane], size - bar)
    for lane in range(count):
        p, decided = outputs[lane], UNDECIDED
        clear = widest[lane] < math.inf and free[lane] > 0.0
        found[lane] = found[lane] and clear
        most, fewest = top[lane] * (1.0 + 4.0 * EPS), least[lane] * (1.0 - 4.0 * EPS)
        off = max(most - value[lane], value[lane] - fewest)
        if clear:
            decided = STABLE if most < 1.0 else UNSTABLE if fewest > 1.0 else UNDECIDED
            floats[4 * n, p], floats[4 * n + 1, p] = value[lane], off
        verdict[p], crossing[p] = decided, UNDECIDED
        missed[p] = (
            not clear
            or (asked[VERDICT] and decided == UNDECIDED)
            or (asked[RADIUS] and not off <= rtol * (1.0 + value[lane]))
        )


@part
def _of_two(c, bars, outputs, count, paired, asked, rtol, floats, verdict, crossing, missed):
    """The spectral radius and the verdict of systems of two states, in closed form."""
    for lane in range(count):
        p, decided = outputs[lane], UNDECIDED
        if paired:
            value, off = _radius_of_pair(c[0, lane], bars[0, lane])
            decided = STABLE if value == 1.0 else UNSTABLE if off < math.inf else UNDECIDED
        else:
            value, off = _radius_of_two(c[0, lane], c[1, lane], bars[0, lane], bars[1, lane])
            if (value + off) * (1.0 + 4.0 * EPS) < 1.0:
                decided = STABLE
            elif (value - off) * (1.0 - 4.0 * EPS) > 1.0:
                decided = UNSTABLE
        floats[8, p], floats[9, p], verdict[p], crossing[p] = value, off, decided, UNDECIDED
        missed[p] = (asked[VERDICT] and decided == UNDECIDED) or (
            asked[RADIUS] and not off <= rtol * (1.0 + value)
        )


@inline
def _radius_of_pair(c, bar):
    """The larger modulus of the multipliers l and 1 / l, l + 1 / l = -c, and its error bound: 1 and 0
    on the circle, NaN and infinity where that is open.
    """
    size = abs(c)
    off = bar + 2.0 * EPS * size
    if size + off < 2.0:
        return 1.0, 0.0
    near = size - off
    if not near > 2.0:
        return math.nan, math.inf
    value = 0.5 * (size + math.sqrt((size - 2.0) * (size + 2.0)))
    steep = 1.0 + near / math.sqrt((near - 2.0) * (near + 2.0))
    return value, 0.5 * off * steep * (1.0 + 8.0 * EPS) + 8.0 * EPS * value


@inline
def _radius_of_two(trace, det, trace_bar, det_bar):
    """The larger modulus of the roots of l^2 + trace l + det, and its error bound."""
    half = 0.5 * abs(trace)
    off, wide = 0.5 * trace_bar + EPS * half, det_bar + EPS * abs(det)
    inner = half * half - det  # of the square root
    doubt = ((2.0 * half + off) * off + wide + 2.0 * EPS * (half * half + abs(det))) * (
        1.0 + 8.0 * EPS
    )
    if inner + doubt < 0.0:
        value = math.sqrt(det)
        off = wide / value if wide < det else math.inf  # |sqrt(x + e) - sqrt(x)| <= |e| / sqrt(x)
    else:
        root = math.sqrt(max(inner, 0.0))
        value = half + root
        off += doubt / root if inner > doubt else 2.0 * math.sqrt(2.0 * doubt)
    return value, off * (1.0 + 8.0 * EPS) + 4.0 * EPS * value


@part
def _roots(c, d, z, y, parts):
    """The roots z + i y in lanes: in closed form, or by Weierstrass's iteration from those given."""
    if d == 1:
        for lane in range(LANES):
            z[0, lane], y[0, lane] = -c[0, lane], 0.0
        return
    if d == 2:
        for lane in range(LANES):
            half = -0.5 * c[0, lane]
            inner = half * half - c[1, lane]
            root = math.sqrt(abs(inner))
            if inner < 0.0:
                z[0, lane], y[0, lane], z[1, lane], y[1, lane] = half, root, half, -root
            else:
                far = half + (root if half >= 0.0 else -root)
                z[0, lane], y[0, lane], y[1, lane] = far, 0.0, 0.0
                z[1, lane] = c[1, lane] / far if far != 0.0 else 0.0
    for _ in range(1 if d == 2 else ITERATIONS):
        improve(c, d, z, y, parts)


@part
def improve(c, d, z, y, parts):
    """One step of Weierstrass's iteration from z + i y, in lanes."""
    pr, pi, qr, qi = parts[0], parts[1], parts[2], parts[3]
    lanes = len(pr)
    for i in range(d):
        _value(c, d, z[i], y[i], pr, pi)
        _product(z, y, i, d, qr, qi)
        x, t = z[i], y[i]
        for lane in range(lanes):
            size = 1.0 / (qr[lane] * qr[lane] + qi[lane] * qi[lane])
            x[lane] -= (pr[lane] * qr[lane] + pi[lane] * qi[lane]) * size
            t[lane] -= (pi[lane] * qr[lane] - pr[lane] * qi[lane]) * size


@part
def from_circle(c, d, z, y):
    """Weierstrass's iteration from points of a circle until it converges as from near by, and two
    steps more.
    """
    before, parts = np.empty((2, d, LANES)), np.empty((6, LANES))
    for lane in range(LANES):
        radius = 1e-3
        for k in range(d):
            radius = max(radius, abs(c[k, lane]) ** (1.0 / (k + 1)))
        for i in range(d):
            angle = (2.0 * math.pi * i + 1.0) / d  # no mirror images
            z[i, lane], y[i, lane] = radius * math.cos(angle), radius * math.sin(angle)
    converged = np.zeros(LANES, np.bool_)
    for _ in range(MOST):
        for i in range(d):
            for lane in range(LANES):
                before[0, i, lane], before[1, i, lane] = z[i, lane], y[i, lane]
        improve(c, d, z, y, parts)
        left = False
        for lane in range(LANES):
            moved = largest = 0.0
            for i in range(d):
                if converged[lane]:  # what follows depends on no neighbour
                    z[i, lane], y[i, lane] = before[0, i, lane], before[1, i, lane]
                moved = max(moved, abs(z[i, lane] - before[0, i, lane]))
                moved = max(moved, abs(y[i, lane] - before[1, i, lane]))
                largest = max(largest, abs(z[i, lane]), abs(y[i, lane]))
            converged[lane] = moved < CLOSE * largest
            left = left or not converged[lane]
        if not left:
            break
    for _ in range(2):
        improve(c, d, z, y, parts)


@kernel
def roots(c):
    """The roots (N, d, 2), nearly, of the polynomials with coefficients c (N, d); 0 where d < 3, as
    they are of no use there.
    """
    N, d = c.shape
    out = np.zeros((N, d, 2))
    own, z, y = np.empty((d, LANES)), np.empty((d, LANES)), np.empty((d, LANES))
    for first in range(0, N if d > 2 else 0, LANES):
        count = min(LANES, N - first)
        for lane in range(LANES):
            for k in range(d):
                own[k, lane] = c[first + min(lane, count - 1), k]
        from_circle(own, d, z, y)
        for lane in range(count):
            for i in range(d):
                out[first + lane, i, 0], out[first + lane, i, 1] = z[i, lane], y[i, lane]
    return out


@part
def _value(c, d, x, t, pr, pi):
    """The polynomial at x + i t."""
    lanes, first = len(x), c[0]
    for lane in range(lanes):
        pr[lane], pi[lane] = x[lane] + first[lane], t[lane]
    for k in range(1, d - 1, 2):  # two at once: half as many values are read and written
        a, b = c[k], c[k + 1]
        for lane in range(lanes):
            real = pr[lane] * x[lane] - pi[lane] * t[lane] + a[lane]
            imag = pr[lane] * t[lane] + pi[lane] * x[lane]
            pr[lane] = real * x[lane] - imag * t[lane] + b[lane]
            pi[lane] = real * t[lane] + imag * x[lane]
    for k in range(d - 1 + d % 2, d):
        a = c[k]
        for lane in range(lanes):
            real = pr[lane] * x[lane] - pi[lane] * t[lane] + a[lane]
            pi[lane] = pr[lane] * t[lane] + pi[lane] * x[lane]
            pr[lane] = real


@part
def _product(z, y, i, d, qr, qi):
    """The product over j of z_i - z_j."""
    x, t = z[i], y[i]
    lanes, first = len(x), 0 if i > 0 else 1
    if d == 1:
        qr[:], qi[:] = 1.0, 0.0
        return
    u, v = z[first], y[first]
    for lane in range(lanes):
        qr[lane], qi[lane] = x[lane] - u[lane], t[lane] - v[lane]
    for j in range(first + 1, d):
        if j == i:
            continue
        u, v = z[j], y[j]
        for lane in range(lanes):
            a, b = x[lane] - u[lane], t[lane] - v[lane]
            real = qr[lane] * a - qi[lane] * b
            qi[lane] = qr[lane] * b + qi[lane] * a
            qr[lane] = real


@part
def _corrections(c, d, bars, z, y, w, gap, parts, found):
    """Fill w with bounds of the corrections |W_i|, `gap` with the distance of each root to the nearest
    other, and `found` (lanes) where the corrections are no larger than what they are known to.
    """
    pr, pi, qr, qi, size, bound = parts[0], parts[1], parts[2], parts[3], parts[4], parts[5]
    lanes = len(size)
    found[:] = True
    for i in range(d):
        x, t, own, near = z[i], y[i], w[i], gap[i]
        _value(c, d, x, t, pr, pi)
        _product(z, y, i, d, qr, qi)
        for lane in range(lanes):
            size[lane] = math.sqrt(x[lane] * x[lane] + t[lane] * t[lane])
            bound[lane], near[lane] = 8.0 * d * ROUNDOFF_UP, math.inf
        for k in range(d):
            a, doubt = c[k], bars[k]
            for lane in range(lanes):
                bound[lane] = (
                    bound[lane] * size[lane] + doubt[lane] + 8.0 * d * ROUNDOFF_UP * abs(a[lane])
                )
        for lane in range(lanes):
            size[lane] = math.sqrt(pr[lane] * pr[lane] + pi[lane] * pi[lane])
            own[lane] = (
                (size[lane] + bound[lane])
                / math.sqrt(qr[lane] * qr[lane] + qi[lane] * qi[lane])
                * (1.0 + 8.0 * d * EPS)
            )
        for lane in range(lanes):
            found[lane] = found[lane] and size[lane] <= bound[lane]
        for j in range(d):
            if j == i:
                continue
            u, v = z[j], y[j]
            for lane in range(lanes):
                a, b = x[lane] - u[lane], t[lane] - v[lane]
                near[lane] = min(near[lane], a * a + b * b)
        for lane in range(lanes):
            near[lane] = math.sqrt(near[lane])


@part
def _paired(z, rho, form, of_forms, re, im, bar, sign):
    """The multipliers of the s = z; returns the verdict, and is a Krein sign open?

    The sign of the multiplier exp(i a), 0 < a < pi, is that of form / q' at s = 2 cos a, q the
    polynomial of the s.
    """
    d, on, off, open_ = len(rho), 0, False, False
    for i in range(d):
        s, t, r = z[i, 0], z[i, 1], rho[i]
        a, b = 2 * i, 2 * i + 1
        sign[a] = sign[b] = 0
        if abs(t) > r:  # not real: neither is its multiplier on the circle
            off = True
            # l = (s + v) / 2 with v = sqrt(s^2 - 4), and |delta v| <= |delta v^2| / |v|
            v = np.sqrt(complex(s * s - t * t - 4.0, 2.0 * s * t))
            if v.real * s + v.imag * t < 0.0:
                v = -v
            one = 0.5 * (complex(s, t) + v)
            spread = (2.0 * math.hypot(s, t) + r) * r
            wide = 0.5 * (r + spread / abs(v)) if spread < 0.5 * abs(v) ** 2 else math.inf
            wide += 8.0 * EPS * abs(one)
            two, size = 1.0 / one, abs(one)
            re[a], im[a], bar[a] = one.real, one.imag, wide
            re[b], im[b] = two.real, two.imag
            bar[b] = (
                wide / (size * (size - wide)) + 4.0 * EPS / size if size > 2.0 * wide else math.inf
            )
        elif abs(s) + r < 2.0:
            on += 1
            height = math.sqrt((2.0 - s) * (2.0 + s))
            re[a] = re[b] = 0.5 * s
            im[a], im[b] = 0.5 * height, -0.5 * height
            far = abs(s) + r
            bar[a] = bar[b] = r / math.sqrt((2.0 - far) * (2.0 + far)) + 4.0 * EPS
            if of_forms:
                value, wide, side = 0.0, 0.0, 1.0
                for k in range(d):
                    value = value * s + form[0, k]
                    wide = wide * 2.0 + form[1, k] + 4.0 * d * EPS * abs(form[0, k])
                    if k != i and s < z[k, 0] and abs(z[k, 1]) <= rho[k]:
                        # of the slope of the polynomial; pairs of conjugates do not change it
                        side = -side
                if abs(value) > wide + _slope(form, d) * r:
                    sign[a] = 1 if value * side > 0.0 else -1
                    sign[b] = -sign[a]
                else:
                    open_ = True
        elif abs(s) - r > 2.0:
            off = True
            size, near = abs(s), abs(s) - r
            one = 0.5 * (size + math.sqrt((size - 2.0) * (size + 2.0)))
            wide = 0.5 * r * (1.0 + near / math.sqrt((near - 2.0) * (near + 2.0))) + 4.0 * EPS * one
            two = 1.0 / one
            re[a], im[a], bar[a] = math.copysign(one, s), 0.0, wide
            re[b], im[b] = math.copysign(two, s), 0.0
            bar[b] = wide / (one * (one - wide)) + 2.0 * EPS * two if one > 2.0 * wide else math.inf
        else:
            re[a] = re[b] = math.copysign(1.0, s)
            im[a] = im[b] = math.nan  # real or not
            bar[a] = bar[b] = math.inf
    return (UNSTABLE if off else STABLE if on == d else UNDECIDED), open_


@part
def _slope(form, d):
    """A bound of the form's slope where |s| <= 2."""
    total, power = 0.0, 1.0
    for k in range(1, d):
        total += k * power * abs(form[0, d - 1 - k])
        power *= 2.0
    return total


@part
def _write(re, im, bar, size, decided, paired, asked, rtol, p, floats, verdict, missed):
    """Write the spectral radius and the verdict of the point p, and whether it has missed what is
    asked; fill `size` with the moduli. Returns whether a multiplier is known less well than to rtol.
    """
    n, value, top, least, wide = len(re), 0.0, 0.0, 0.0, False
    for i in range(n):
        size[i] = own = math.sqrt(re[i] * re[i] + im[i] * im[i])
        value, top, least = max(value, own), max(top, own + bar[i]), max(least, own - bar[i])
        least_part = abs(re[i]) if im[i] == 0.0 else min(abs(re[i]), abs(im[i]))
        wide = wide or not bar[i] <= rtol * (1.0 + least_part)
    top, least = top * (1.0 + 4.0 * EPS), least * (1.0 - 4.0 * EPS)
    if paired and decided == STABLE:
        value = top = least = 1.0
    elif not paired:
        decided = STABLE if top < 1.0 else UNSTABLE if least > 1.0 else UNDECIDED
    off = max(top - value, value - least)
    floats[4 * n, p], floats[4 * n + 1, p], verdict[p] = value, off, decided
    missed[p] = (
        (asked[VERDICT] and decided == UNDECIDED)
        or (wide and (asked[MULTIPLIERS] or asked[KREIN]))
        or (asked[RADIUS] and not off <= rtol * (1.0 + value))
    )
    return wide


@part
def _sort(re, im, bar, size, sign, p, floats, signs, angle, order):
    """Write the multipliers of the point p in order, as `measures.floquet.multipliers.order` does, and fill
    `angle` with their arguments.
    """
    n = len(re)
    for i in range(n):
        order[i] = i
        if i > 0 and im[i] != 0.0 and im[i] == -im[i - 1] and re[i] == re[i - 1]:
            angle[i] = -angle[i - 1]
        else:
            angle[i] = math.atan2(im[i], re[i])
    for i in range(1, n):
        own, k = order[i], i
        while k > 0 and size[own] > size[order[k - 1]]:
            order[k] = order[k - 1]
            k -= 1
        order[k] = own
    least, first = math.inf, 0  # of those whose moduli cannot be told apart
    for i in range(n):
        own, k = order[i], i
        if size[own] + bar[own] < least:
            least, first = math.inf, i
        least = min(least, (size[own] - bar[own]) * (1.0 - TIE))
        while k > first and angle[own] < angle[order[k - 1]]:
            order[k] = order[k - 1]
            k -= 1
        order[k] = own
    for i in range(n):
        k = order[i]
        floats[i, p], floats[n + i, p], floats[2 * n + i, p] = re[k], im[k], bar[k]
        floats[3 * n + i, p] = bar[k] if im[k] != 0.0 else 0.0
        signs[i, p] = sign[k]


@part
def _crossing(re, im, bar, size, angle, sign, decided, paired, of_signs):
    """See `measures.floquet.multipliers.crossing`."""
    n, lead = len(re), 0
    if paired and decided == STABLE:
        to_plus = to_minus = between = math.inf
        doubt = wide = 0.0
        for i in range(n):
            to_plus, to_minus = (
                min(to_plus, 2.0 * abs(angle[i])),
                min(to_minus, 2.0 * (math.pi - abs(angle[i]))),
            )
            doubt = max(doubt, 4.0 * bar[i])
            for j in range(n):
                if (
                    j != i
                    and angle[i] > 0.0
                    and angle[j] > 0.0
                    and (not of_signs or sign[i] * sign[j] < 0)
                ):
                    between = min(between, abs(angle[i] - angle[j]))
                    wide = max(wide, 2.0 * (bar[i] + bar[j]))
        doubt = max(doubt, wide)
        if to_plus + doubt < min(to_minus, between):
            return PLUS_ONE
        if to_minus + doubt < min(to_plus, between):
            return MINUS_ONE
        return COLLISION if between + doubt < min(to_plus, to_minus) else UNDECIDED
    for i in range(n):
        if size[i] > size[lead]:
            lead = i
    least = size[lead] - bar[lead]
    for i in range(n):
        if i == lead or math.hypot(re[i] - re[lead], im[i] + im[lead]) <= bar[i] + bar[lead]:
            continue
        if size[i] + bar[i] >= least:
            return UNDECIDED
    if abs(im[lead]) > bar[lead]:
        return COLLISION if paired else NEIMARK_SACKER
    return PLUS_ONE if re[lead] > 0.0 else MINUS_ONE
