"""The wells of A^2 u'^2 = P(u) = (1 - u^2)(L + k u^2) - (a^2 + b^2 - 2 a b u), |u| <= 1: their turning points.

Everything that may cancel is done in double-double: the polynomial about u = 0 and about the poles,
v = 1 - u and w = 1 + u, its roots, and its factor Q where P = (u - ul)(uh - u) Q, Q = k u^2 + k S u
+ q0, S = ul + uh. A well's row then holds float64 numbers that are right to the last digits.
Equation numbers: `scenes/brun.md`.
"""

from math import copysign, inf, nan, sqrt

from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd
from survey.kernels.math.quartic import ROUGH, root, roughly, slope, slopes, value
from survey.kernels.math.roundoff import PAIR_SUM_ROUNDOFF, ROUNDOFF

# columns of a row: turning points (1 - u and 1 + u of each), Q there and at the poles, b - a and b
# + a, the rest of P
LOW, HIGH, LOW_PLUS, LOW_MINUS, HIGH_PLUS, HIGH_MINUS, WIDTH, SUM = range(8)
Q_LOW, Q_HIGH, Q_PLUS, Q_MINUS, BEND, MIDDLE = range(8, 14)  # BEND: 4 q0 - k S^2; MIDDLE: s of (S5)
K, L, MINUS, PLUS, LEVEL = range(14, 19)  # k, L, b - a, b + a, L - (k ul uh + q0)/2
# of the turning points and, relative, of Q, s + g of (S5), WIDTH and the distances from the poles;
# of SUM
BAR_LOW, BAR_HIGH, NOISE_LOW, NOISE_HIGH, NOISE_ABOVE, NOISE_WIDTH, NOISE_ENDS = range(19, 26)
BAR_SUM = 26
REST = 27  # from here on what float64 leaves of each number
SIZE = 2 * REST
# kinds of wells
NONE, LOST, SEPARATRIX, NUTATION, PRECESSION, PASSAGE = -2, -1, 0, 1, 2, 3
NEWTON = 60
LOST_DIGITS = 1e-18
TINY = 1e-300


@inline
def about_pole(square, at, level, k):
    """P in the distance from a pole: `square` = (b -+ a)^2, `at` = L + k -+ a b."""
    c2 = dd.neg(dd.add(level, dd.times(k, 5.0)))
    return dd.neg(square), dd.times(at, 2.0), c2, dd.times(k, 4.0), dd.neg(k)


@inline
def about_equator(a, b, level, k):
    """P in u (S2)."""
    c0 = dd.sub(level, dd.add(dd.two_prod(a, a), dd.two_prod(b, b)))
    return c0, dd.times(dd.two_prod(a, b), 2.0), dd.sub(k, level), (0.0, 0.0), dd.neg(k)


@inline
def torque(u, a, b, k):
    """F = (a - b u)(b - a u) + k u (1 - u^2)^2, which has the sign of -W', and F'. W is the
    effective potential.
    """
    rest = (1.0 - u) * (1.0 + u)
    value = (a - b * u) * (b - a * u) + k * u * rest * rest
    return value, -b * (b - a * u) - a * (a - b * u) + k * rest * (1.0 - 5.0 * u * u)


@kernel
def saddle(a, b, k):
    """(u, F' there, in doubt?) of the greatest W between two least ones; F' = 0 where there is none. k > 0, |u| < 1/3.

    In doubt: so near a cusp that the rounding of F may hide a saddle, or make one.
    """
    if k <= 0.0:
        return 0.0, 0.0, False
    u, bend = 0.0, a * b / k
    for _ in range(NEWTON):  # the greatest F', where 10 u^3 - 6 u + a b / k = 0
        move = (u * (10.0 * u * u - 6.0) + bend) / (30.0 * u * u - 6.0)
        u = min(max(u - move, -0.4), 0.4)
        if abs(move) < 1e-12:
            break
    level, rise = torque(u, a, b, k)
    if not rise > 0.0:
        return 0.0, 0.0, abs(u) < 0.4 and rise > -32.0 * ROUNDOFF * (a * a + b * b + k)
    before, least = u, abs(level)
    for _ in range(NEWTON):  # from there F is convex towards its zero, if it has one
        # beyond the least |F|, which is more than half of that at the step before
        if not rise > 0.0:
            return 0.0, 0.0, abs(before) < 0.4 and least <= 4.0 * roughness(before, a, b, k)
        move, before, least = level / rise, u, abs(level)
        u -= move
        level, rise = torque(u, a, b, k)
        if abs(move) <= 4.0 * ROUNDOFF * abs(u):
            break
    if abs(u) >= 0.4:
        return 0.0, 0.0, False
    # F is a parabola about its extremum, rise / F'' away, where it is rise^2 / 2 F''
    bend = 2.0 * abs(a * b) + 12.0 * k * abs(u)
    doubtful = rise * rise <= 16.0 * roughness(u, a, b, k) * bend
    return (0.0, 0.0, True) if doubtful else (u, rise, False)


@inline
def roughness(u, a, b, k):
    """The rounding of F at a saddle."""
    return 8.0 * ROUNDOFF * ((abs(a) + abs(b * u)) * (abs(b) + abs(a * u)) + k * abs(u))


@kernel
def lowest(square, product, k, most):
    """The distance from the pole of the least W, between the pole and `most`: v^2 B(v) = (b - a)^2
    (1 - v).

    B = a b + k (1 - v)(2 - v)^2; 0 where W is least at the pole itself.
    """
    start = product + 4.0 * k
    if square == 0.0 and start >= 0.0:
        return 0.0
    low, high = 0.0, most
    v = min(sqrt(square / start), 0.5 * most) if start > 0.0 else 0.5 * most
    for _ in range(2 * NEWTON):
        rest, other = 1.0 - v, 2.0 - v
        b, slope = product + k * rest * other * other, -k * other * (other + 2.0 * rest)
        # (b - a)^2 = 0 is divided by v^2
        level = v * v * b - square * rest if square > 0.0 else b
        rise = v * (2.0 * b + v * slope) + square if square > 0.0 else slope
        if level == 0.0:
            break
        low, high = (low, v) if level > 0.0 else (v, high)
        move = level / rise
        new = v - move
        if not low < new < high:
            new = 0.5 * (low + high)
        if abs(new - v) <= 2.0 * ROUNDOFF * v:
            return new
        v = new
    return v


@kernel
def peak(c, y, at):
    """(point, P, bound of its error) of the greatest P near y, which matters where it is next to
    nothing.

    At a pole (y = 0) that the motion may reach P is 0, and half its slope `at` is used instead.
    """
    if y == 0.0:
        return y, at, 4.0 * PAIR_SUM_ROUNDOFF * (abs(c[4][0]) + abs(c[2][0]))
    height, size = roughly(c, y)
    _first, second = slopes(c, y)
    if height < ROUGH * size and second < 0.0:
        move = slope(c, (y, 0.0))[0] / second
        if abs(move) < 1e-3 * y:
            y -= move
            height, size = roughly(c, y)
    return y, height, 4.0 * PAIR_SUM_ROUNDOFF * size


@kernel
def beyond(gap, at, inside, inside_far, near, far, equator):
    """(distance from the pole, from the other pole, bar) of the turning point on that side of
    `inside`.

    `near` and `far` are P about the pole and about the other one (`inside_far` from there), `gap` =
    b -+ a, `equator` = P(0): the turning point is found from the pole of its own hemisphere.
    """
    two = (2.0, 0.0)
    if inside > 1.0 and equator <= 0.0:
        y, bar = root(far, inside_far, 1.0)
        return dd.sub(two, y), y, bar
    if gap == 0.0 and at > 0.0:
        return (0.0, 0.0), two, 0.0  # through the pole
    y, bar = root(near, min(inside, 1.0), 0.0)
    return y, dd.sub(two, y), bar


@inline
def inner(equatorial, loose, inside, outside):
    """As `beyond`, the turning point beside a saddle: its distances from the poles +1 and -1, and its bar."""
    u, bar = root(equatorial, inside, outside)
    first, _second = slopes(equatorial, u[0])
    return dd.sub((1.0, 0.0), u), dd.add((1.0, 0.0), u), bar + loose / max(abs(first), TINY)


@inline
def looseness(a, b, rough):
    """The rounding of P(0) = L - a^2 - b^2, which may nearly cancel; `rough` times 2^-100 is that
    of L's terms.
    """
    return 0.25 * PAIR_SUM_ROUNDOFF * (a * a + b * b + rough)


@inline
def hill_at_pole(gap, product, k, at):
    """L above W at a pole that the motion may reach (b -+ a = 0) and where W is greatest, and its
    bar; or NaN.
    """
    if gap == 0.0 and product + 4.0 * k < 0.0:
        return at, 4.0 * PAIR_SUM_ROUNDOFF * (abs(product) + abs(k) + abs(at))
    return nan, 0.0


@inline
def store(row, column, pair):
    row[column], row[column + REST] = pair


@inline
def pair(row, column):
    """A number of the row with all its digits."""
    return row[column], row[column + REST]


@kernel
def fill(gaps, k, level, at_poles, equatorial, loose, right, left, row):
    """A row from the turning points, each (distance from its pole, from the other pole, bar)."""
    minus, plus = gaps
    v, wh, bar_v = right
    w, vl, bar_w = left
    one, two = (1.0, 0.0), (2.0, 0.0)
    uh = dd.sub(one, v) if v[0] < 1.0 else dd.sub(wh, one)
    ul = dd.sub(w, one) if w[0] < 1.0 else dd.sub(one, vl)
    total = dd.add(ul, uh)
    product, square = dd.mul(ul, uh), dd.mul(total, total)
    q0 = dd.add(dd.sub(level, k), dd.mul(k, dd.sub(square, product)))
    width = dd.sub(vl, v)[0] if vl[0] < 1.0 else dd.sub(wh, w)[0]
    row[LOW], row[HIGH], row[WIDTH] = ul[0], uh[0], max(width, 0.0)
    store(row, SUM, total)
    store(row, LOW_PLUS, vl)
    store(row, LOW_MINUS, w)
    store(row, HIGH_PLUS, v)
    store(row, HIGH_MINUS, wh)
    row[BAR_HIGH], row[BAR_LOW] = bar_v + ROUNDOFF * abs(uh[0]), bar_w + ROUNDOFF * abs(ul[0])
    row[BAR_SUM] = bar_v + bar_w
    row[NOISE_WIDTH] = row[BAR_SUM] / max(width, TINY)
    store(row, K, k)
    store(row, L, level)
    store(row, MINUS, minus)
    store(row, PLUS, plus)
    bow = dd.mul(k, square)
    store(row, MIDDLE, dd.add(dd.sub(level, k), dd.times(bow, 1.5)))
    store(row, BEND, dd.sub(dd.times(q0, 4.0), bow))
    row[LEVEL] = dd.sub(level, dd.times(dd.add(dd.mul(k, product), q0), 0.5))[0]
    # Q about the poles: P's slope there is 2 (L + k -+ a b)
    tilt_plus = dd.neg(dd.mul(k, dd.add(two, total)))
    tilt_minus = dd.mul(k, dd.sub(total, two))
    at_pole = dd.add(k, q0)  # a double root at a pole
    q_plus, q_minus = dd.add(at_pole, dd.mul(k, total)), dd.sub(at_pole, dd.mul(k, total))
    from_plus, from_minus = dd.add(v, vl), dd.add(w, wh)
    if from_plus[0] > 0.0:
        q_plus = dd.div(
            dd.add(dd.times(at_poles[0], 2.0), dd.mul(dd.mul(v, vl), tilt_plus)), from_plus
        )
    if from_minus[0] > 0.0:
        q_minus = dd.div(
            dd.add(dd.times(at_poles[1], 2.0), dd.mul(dd.mul(w, wh), tilt_minus)), from_minus
        )
    store(
        row,
        Q_HIGH,
        beside(q_plus, tilt_plus, k, v) if uh[0] >= 0.0 else beside(q_minus, tilt_minus, k, wh),
    )
    store(
        row,
        Q_LOW,
        beside(q_plus, tilt_plus, k, vl) if ul[0] >= 0.0 else beside(q_minus, tilt_minus, k, w),
    )
    row[Q_PLUS] = q_plus[0] if minus[0] == 0.0 else minus[0] * minus[0] / (v[0] * vl[0])
    row[Q_MINUS] = q_minus[0] if plus[0] == 0.0 else plus[0] * plus[0] / (w[0] * wh[0])
    # errors: of Q, what the pole's slope and the turning points leave
    bar = bar_v + bar_w
    moved = abs(k[0]) * (bar + 16.0 * PAIR_SUM_ROUNDOFF)
    near, far = from_plus[0], from_minus[0]
    plus_side = (
        8.0 * PAIR_SUM_ROUNDOFF * abs(at_poles[0][0]) + (abs(row[Q_PLUS]) + 4.0 * abs(k[0])) * bar
    ) / max(near, TINY)
    minus_side = (
        8.0 * PAIR_SUM_ROUNDOFF * abs(at_poles[1][0]) + (abs(row[Q_MINUS]) + 4.0 * abs(k[0])) * bar
    ) / max(far, TINY)
    plus_side, minus_side = plus_side + 8.0 * moved * near, minus_side + 8.0 * moved * far
    row[NOISE_HIGH] = (plus_side if uh[0] >= 0.0 else minus_side) / max(row[Q_HIGH], TINY)
    row[NOISE_LOW] = (plus_side if ul[0] >= 0.0 else minus_side) / max(row[Q_LOW], TINY)
    direct(k, dd.sub(level, k), square, uh, bar, row, Q_HIGH, NOISE_HIGH)
    direct(k, dd.sub(level, k), square, ul, bar, row, Q_LOW, NOISE_LOW)
    beside_saddle(equatorial, uh, bar_v, -1.0, row, Q_HIGH, NOISE_HIGH)
    beside_saddle(equatorial, ul, bar_w, 1.0, row, Q_LOW, NOISE_LOW)
    row[NOISE_ENDS] = max(
        bar_v / max(v[0], TINY), bar_w / max(w[0], TINY), bar_v / wh[0], bar_w / vl[0]
    )
    rough = 8.0 * (moved + PAIR_SUM_ROUNDOFF * (abs(level[0]) + abs(k[0])))
    row[NOISE_ABOVE] = noise_above(
        row, rough, at_lowest(equatorial, loose, k, total, ul, uh, bar_w, bar_v, rough, row)
    )


@inline
def direct(k, rest, square, u, bar, row, column, error):
    """Q at a turning point as L - k + k (S^2 + 2 u^2), where that is better known than from the pole."""
    value = dd.add(rest, dd.mul(k, dd.add(square, dd.times(dd.mul(u, u), 2.0))))
    noise = 8.0 * (abs(k[0]) * bar + PAIR_SUM_ROUNDOFF * (abs(rest[0]) + 8.0 * abs(k[0])))
    if noise < row[error] * value[0]:
        store(row, column, value)
        row[error] = noise / value[0]


@inline
def beside(q, tilt, k, y):
    """Q at y from a pole, from its value and slope there."""
    return dd.add(q, dd.mul(y, dd.add(tilt, dd.mul(k, y))))


@kernel
def beside_saddle(equatorial, u, bar, side, row, column, error):
    """Q where digits of it were lost: P'/(uh - ul) at a turning point beside a saddle, from P about
    the equator.
    """
    if row[error] < LOST_DIGITS or abs(u[0]) > 0.5 or row[WIDTH] < 1e-3:
        return
    steep = slope(equatorial, u)
    _first, second = slopes(equatorial, u[0])
    terms = abs(equatorial[1][0]) + abs(u[0]) * (
        2.0 * abs(equatorial[2][0]) + 4.0 * abs(equatorial[4][0]) * u[0] ** 2
    )
    if side * steep[0] > 0.0:
        store(row, column, dd.over(steep, side * row[WIDTH]))
        row[error] = (4.0 * PAIR_SUM_ROUNDOFF * terms + abs(second) * bar) / abs(
            steep[0]
        ) + 2.0 * ROUNDOFF


@kernel
def still(gaps, k, level, at_poles, equatorial, loose, y, bar_height, chart, plus, row):
    """A row of a regular precession at the distance y from the pole +1 (`plus`) or -1.

    bar_height: the bar of P there, and chart: P about that pole. The well may be as high, and so wide,
    which changes all else by its square.
    """
    _first, second = slopes(chart, y)
    square = max(-second, TINY)
    bar, wide = (
        ROUNDOFF * y,
        2.0 * sqrt(bar_height / square) if y > 0.0 else 8.0 * bar_height / square,
    )
    near, far = ((y, 0.0), dd.two_sum(2.0, -y), bar), (dd.two_sum(2.0, -y), (y, 0.0), bar)
    if plus:
        fill(gaps, k, level, at_poles, equatorial, loose, near, far, row)
    else:
        fill(gaps, k, level, at_poles, equatorial, loose, far, near, row)
    row[WIDTH] = 0.0
    row[BAR_LOW] += wide
    row[BAR_HIGH] += wide


@inline
def spread(row):
    """g^2 - s^2 of (S10)."""
    return 0.25 * row[K] * row[WIDTH] ** 2 * row[BEND]


@inline
def above(row, g):
    """s + g of (S5), whose terms cancel where the motion nearly stops between its turning points."""
    s = row[MIDDLE]
    return s + g if s >= 0.0 else spread(row) / (g - s)


@kernel
def at_lowest(equatorial, loose, k, total, ul, uh, bar_w, bar_v, bar, row):
    """The error of BEND, `bar` or, where Q is least, better: there Q = P/((u - ul)(uh - u)) is next
    to BEND/4.
    """
    u = -0.5 * total[0]
    left, right = dd.add((u, 0.0), dd.neg(ul)), dd.add(uh, (-u, 0.0))
    if k[0] <= 0.0 or bar < LOST_DIGITS * abs(row[BEND]) or min(left[0], right[0]) <= 0.0:
        return bar
    height, size = value(equatorial, (u, 0.0))
    product, off = dd.mul(left, right), dd.add((u, 0.0), dd.times(total, 0.5))
    q = dd.div(height, product)
    better = dd.times(dd.sub(q, dd.mul(k, dd.mul(off, off))), 4.0)
    noise = bar_w / left[0] + bar_v / right[0] + 2.0 * ROUNDOFF
    error = 4.0 * (
        (PAIR_SUM_ROUNDOFF * size + loose) / product[0]
        + abs(q[0]) * noise
        + k[0] * abs(off[0]) * (bar_w + bar_v)
    )
    if error < bar:
        store(row, BEND, better)
    return min(error, bar)


@inline
def noise_above(row, bar, bar_bend):
    """The relative error of `above`, `bar` that of s, `bar_bend` of BEND, besides 8 roundings."""
    s, g = row[MIDDLE], sqrt(row[Q_LOW]) * sqrt(row[Q_HIGH])
    noise = (bar + 0.5 * (row[NOISE_LOW] + row[NOISE_HIGH]) * g) / max(abs(s) + g, TINY)
    return (
        noise if s >= 0.0 else noise + bar_bend / max(abs(row[BEND]), TINY) + 2.0 * row[NOISE_WIDTH]
    )


@kernel
def barrier(a, b, k, equatorial, loose, at_plus, at_minus):
    """(L above the separatrix, its bar; u of the saddle and F' there); NaN where there is none at
    these a and b.

    The bar is infinite where that is in doubt.
    """
    size_k = k[0]
    between, rise, doubtful = saddle(a, b, size_k)
    if doubtful:
        return nan, inf, 0.0, 0.0
    if rise > 0.0:
        height, size = value(equatorial, (between, 0.0))
        rough = roughness(between, a, b, size_k)
        # the saddle's u is as good as F there
        bar = 4.0 * (PAIR_SUM_ROUNDOFF * size + loose) + rough**2 / rise
        return height[0] / ((1.0 - between) * (1.0 + between)), bar, between, rise
    distance, bar = nan, 0.0
    if size_k < 0.0:
        distance, bar = hill_at_pole(b - a, a * b, size_k, at_plus)
        if bar == 0.0:
            distance, bar = hill_at_pole(b + a, -a * b, size_k, at_minus)
    return distance, bar, between, rise


@kernel
def in_small_well(equatorial, a, b, k):
    """Next to a cusp: is L so near to W there that a motion may be in the small well beside the saddle?"""
    u = cusp(a, b, k)
    height, _size = value(equatorial, (u, 0.0))
    return abs(height[0]) <= roughness(u, a, b, k)


@inline
def cusp(a, b, k):
    """u of a cusp at these momenta, where a b = -4 k u^3."""
    return -copysign((abs(a * b) / (4.0 * k)) ** (1.0 / 3.0), a * b)


@kernel
def find(a, b, k, level, at_plus, at_minus, rough, rows, kinds):
    """Fill `rows` (2, SIZE) and `kinds` (2) with the wells, lower u first; returns (L above the
    separatrix, its bar).

    NaN where there is no separatrix at these a and b. Kinds: NUTATION, PRECESSION (the turning
    points coincide), PASSAGE (through a pole), SEPARATRIX (within the error), NONE. rough: see
    `looseness`.
    """
    kinds[0] = kinds[1] = NONE
    gaps, at_poles = (dd.two_sum(b, -a), dd.two_sum(b, a)), (at_plus, at_minus)
    minus, plus, product, size_k = gaps[0][0], gaps[1][0], a * b, k[0]
    polar = about_pole(dd.mul(gaps[0], gaps[0]), at_plus, level, k)
    antipolar = about_pole(dd.mul(gaps[1], gaps[1]), at_minus, level, k)
    equatorial, loose = about_equator(a, b, level, k), looseness(a, b, rough)
    distance, bar, between, rise = barrier(a, b, k, equatorial, loose, at_plus[0], at_minus[0])
    if abs(distance) <= bar:
        kinds[0] = SEPARATRIX
        return distance, bar
    if bar == inf and in_small_well(equatorial, a, b, size_k):
        kinds[0] = LOST
        return distance, bar
    v = w = top = bottom = -1.0
    bar_top = bar_bottom = 0.0
    if rise > 0.0 or product >= 0.0:
        v = lowest(minus * minus, product, size_k, 1.0 - max(between, 0.0))
        v, top, bar_top = peak(polar, v, at_plus[0])
    if rise > 0.0 or product < 0.0:
        w = lowest(plus * plus, -product, size_k, 1.0 + min(between, 0.0))
        w, bottom, bar_bottom = peak(antipolar, w, at_minus[0])
    if rise > 0.0 and distance < 0.0:
        n = 0
        if bottom > bar_bottom:
            left = beyond(plus, at_minus[0], w, 2.0 - w, antipolar, polar, -1.0)
            right = inner(equatorial, loose, w - 1.0, between)
            fill(gaps, k, level, at_poles, equatorial, loose, right, left, rows[0])
            kinds[0] = PASSAGE if left[0][0] == 0.0 else NUTATION
            n = 1
        elif bottom >= -bar_bottom:
            still(
                gaps,
                k,
                level,
                at_poles,
                equatorial,
                loose,
                w,
                bar_bottom,
                antipolar,
                False,
                rows[0],
            )
            kinds[0], n = PRECESSION, 1
        if top > bar_top:
            right = beyond(minus, at_plus[0], v, 2.0 - v, polar, antipolar, -1.0)
            from_plus, from_minus, bar_u = inner(equatorial, loose, 1.0 - v, between)
            left = from_minus, from_plus, bar_u
            fill(gaps, k, level, at_poles, equatorial, loose, right, left, rows[n])
            kinds[n] = PASSAGE if right[0][0] == 0.0 else NUTATION
        elif top >= -bar_top:
            still(gaps, k, level, at_poles, equatorial, loose, v, bar_top, polar, True, rows[n])
            kinds[n] = PRECESSION
    elif max(top - bar_top, bottom - bar_bottom) > 0.0:
        equator = equatorial[0][0]
        v, w = (v if v >= 0.0 else 2.0 - w), (w if w >= 0.0 else 2.0 - v)
        right = beyond(minus, at_plus[0], v, w, polar, antipolar, equator)
        left = beyond(plus, at_minus[0], w, v, antipolar, polar, equator)
        fill(gaps, k, level, at_poles, equatorial, loose, right, left, rows[0])
        kinds[0] = PASSAGE if right[0][0] == 0.0 or left[0][0] == 0.0 else NUTATION
    elif v >= 0.0 and top >= -bar_top:
        still(gaps, k, level, at_poles, equatorial, loose, v, bar_top, polar, True, rows[0])
        kinds[0] = PRECESSION
    elif w >= 0.0 and bottom >= -bar_bottom:
        still(gaps, k, level, at_poles, equatorial, loose, w, bar_bottom, antipolar, False, rows[0])
        kinds[0] = PRECESSION
    return distance, bar
