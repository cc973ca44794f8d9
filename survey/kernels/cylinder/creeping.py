"""Slow motions beside folds of equilibria: a trap about a node, and the passage along a slow manifold.

At a distance k from a fold motions creep for a time ~ 1/sqrt(|k|) along w = -g/f, and steps that
follow them are no longer than about 1/|f|. Where f < 0 inequalities tell how that ends. Of motions
to the left they are those of the mirrored flow, phi -> -phi, w -> -w, g -> -g.

Trap: x = phi - node, where |x| <= r let 0 < low <= -f, |g| <= G |x|, G <= low^2/5, and let there be no other
equilibrium. No motion leaves 0 <= -w <= m x, m = low/2, as dw/dphi = f + g/w turns it inward on w = -m x (m^2 - low m
+ G < 0) and on w = 0 (g < 0). What has w >= 0, x >= 0 turns before x + w/low, and what has w > -m x, x < 0 comes to x =
0 with a smaller w, if it comes there: so all of these run into the node.

Passage: for z = -w f/g and r = (-g/f)'/|f|, dz/dphi = -(f^2/g)(1 - 1/z + r z), which on each of many
short pieces tends to a zero of its bracket between two that bound it.
"""

import math

from survey.kernels.cylinder.equilibria import (
    ANGLE,
    BAR,
    DG,
    KIND,
    NODE,
    SADDLE,
    STABLE,
    F,
    offset,
)
from survey.kernels.cylinder.flow import (
    BOUND_DDG,
    BOUND_DG,
    BOUND_F,
    BOUND_G,
    C23,
    S2,
    S3,
    TWO_PI,
    D,
    values,
)
from survey.kernels.cylinder.program import COLUMNS
from survey.kernels.jit import inline, kernel
from survey.kernels.math.roundoff import ROUNDOFF_UP

WIDEST = 0.5  # rad from the node to the end of a trap
# of |f| at the node, by which it may fall in the trap, and the largest G / f^2
_FALL, _STEEPEST = 0.3, 0.097
# where a passage ends: r, from where on errors fall by exp(-2/r); how far from r = 0; and twenty times
# the bar of w
_END, _FURTHEST, _WIDEST_BAR = 0.05, 0.25, 6e-4
_SOON = 0.03  # rad: with a node so near ahead the motion tends to it, as a rule
_NEAR = 1e-3  # rad, for a difference of g'
_MOST_R = 0.15
_NARROW = 0.05  # half the width of z at the end
_MOST_Z = 4.0  # up to which 1 - 1/z - 0.15 z is positive
_PIECES = 64
WORTH = 60.0  # integral of -f dt over a passage: about the steps that it saves
LEAST_EXPONENT = -300.0  # of a multiplier, whose bar is 1e-14, so that 1/multiplier^2 is finite
# of a passage: phi, w and its bar at its end, integral of f dt (an upper bound), time (roughly), 1 if the
# bars leave open on which side of a saddle it begins
END_PHI, END_W, END_BAR, EXPONENT, TIME, DOUBT = range(6)
PASSAGE = 6


@inline
def _bend(p, phi):
    """g'' of the gyrostat."""
    s, c = math.sin(phi), math.cos(phi)
    return 4.0 * p[D] * s * c + 4.0 * p[C23] * (c - s) * (c + s) - p[S2] * c + p[S3] * s


@inline
def _largest_bend(p, phi, radius):
    """A bound of |g"| within so much of phi; the third derivative of the gyrostat's g is less than
    twice that of the second.
    """
    if len(p) > COLUMNS:
        return p[BOUND_DDG]
    return min(p[BOUND_DDG], abs(_bend(p, phi)) + 2.0 * p[BOUND_DDG] * radius)


@inline
def _trap(p, table, count, i, certain):
    """(low, to the left, to the right): the least |f|, and how far the trap about the node i reaches,
    at most to the next equilibria, less their bars if that shall be `certain`.
    """
    f, bar, radius = -table[i, F], table[i, BAR], 0.0
    steep = 1.001 * abs(table[i, DG]) + p[BOUND_DDG] * bar + 16.0 * ROUNDOFF_UP * p[BOUND_DG]
    room = _STEEPEST * f * f - steep
    if room <= 0.0:
        return 0.0, 0.0, 0.0
    if len(p) == COLUMNS:  # see `_largest_bend`
        half = 0.5 * abs(_bend(p, table[i, ANGLE])) + p[BOUND_DDG] * bar
        radius = 2.0 * room / (half + math.sqrt(half * half + 4.0 / 3.0 * p[BOUND_DDG] * room))
    else:
        radius = 2.0 * room / p[BOUND_DDG]
    radius = min(0.999 * radius, _FALL * f / p[BOUND_F], WIDEST) - bar
    left, right = radius, radius
    for j in range(count):
        if j != i:
            gap = table[j, ANGLE] - table[i, ANGLE]
            gap -= math.floor(gap / TWO_PI) * TWO_PI
            near = 1.0001 * (bar + table[j, BAR]) if certain else 0.0
            right = min(right, gap - near)
            left = min(left, TWO_PI - gap - near)
    return (1.0 - 1.01 * _FALL) * f, left, right


@inline
def _inside(low, behind, ahead, x0, x1, w0, w1):
    """Does the trap hold x0 <= x <= x1, w0 <= w <= w1, x0 >= 0? `ahead`: where x > 0."""
    if x1 > ahead or (w1 > 0.0 and x1 + w1 / low > ahead):
        return False
    return w0 >= 0.0 or -w0 <= 0.5 * low * x0 or -w0 <= low * behind


@kernel
def trapped(p, table, count, phi, w, bar, certain):
    """The row of a node into which every state within `bar` of (phi, w) runs, or -1; see `crept`."""
    for i in range(count):
        if table[i, KIND] != NODE or table[i, STABLE] >= 0.0:
            continue
        x, _turns = offset(phi, table[i, ANGLE])
        if not abs(x) < WIDEST:
            continue
        low, left, right = _trap(p, table, count, i, certain)
        off = 1.0001 * (bar + table[i, BAR]) if certain else 0.0
        if not min(left, right) > off:
            continue
        held = True
        if x + off > 0.0:
            held = _inside(low, left, right, max(x - off, 0.0), x + off, w - bar, w + bar)
        if held and x - off < 0.0:
            held = _inside(low, right, left, max(-x - off, 0.0), off - x, -w - bar, bar - w)
        if held:
            return i
    return -1


@kernel
def turnings_ahead(p, table, count, i, phi, w, bar):
    """How often a state within `bar` of (phi, w), which runs into the node i, turns before; -1 where
    that is open.
    """
    x, _turns = offset(phi, table[i, ANGLE])
    low, left, right = _trap(p, table, count, i, True)
    off = 1.0001 * (bar + table[i, BAR])
    if x < 0.0:
        x, w, left, right = -x, -w, right, left
    if not (x > off and x + off < right and abs(w) > bar):
        return -1
    if w > 0.0:
        return 1 if x + off + (w + bar) / low < right else -1
    return 0 if bar - w <= 0.5 * low * (x - off) else -1


@kernel
def stands_still(p, table, count, phi, w):
    """Is (phi, w) so near a saddle that rounding alone moves it, which takes too long if g' is small?"""
    for i in range(count):
        f, bar = table[i, F], table[i, BAR]
        if table[i, KIND] == SADDLE and f < 0.0 and table[i, DG] < _MOST_R * f * f:
            x, _turns = offset(phi, table[i, ANGLE])
            if abs(x) <= 2.0 * bar and abs(w * f) <= 8.0 * ROUNDOFF_UP * p[BOUND_G]:
                return True
    return False


@inline
def _end(p, phi, side, f, dg):
    """How far ahead of phi, where f < 0, r is about as large as a passage lets it be, or -1."""
    _f, _g, slope = values(p, phi + side * _NEAR)
    bend = (slope - dg) / _NEAR
    if not bend > 0.0:
        return -1.0
    # -g/f is about r^2 |f|^3 / (2 g"), and its bar about a tenth of r times that
    r = min(_END, _FURTHEST * bend / (f * f), (_WIDEST_BAR * bend / -(f * f * f)) ** (1.0 / 3.0))
    for _ in range(3):  # beside a cusp g' is never so large
        aim = r * f * f - dg
        x = aim / bend
        for _ in range(5):
            if not 0.0 < x < WIDEST:
                break
            ahead, _g, slope = values(p, phi + side * x)
            missed = r * ahead * ahead - slope
            if abs(missed) <= 0.1 * r * ahead * ahead:
                return x
            if not aim > 1.0001 * missed:
                break
            x *= aim / (aim - missed)  # the secant through phi
        r *= 0.5
    return -1.0


@kernel
def crept(p, table, count, phi, w, bar_phi, bar_w, certain, most, out):
    """Follow the motion through (phi, w) along the slow manifold to where it creeps no more, by less
    than `most`; fill `out` (PASSAGE). False where that is not certain, or not worth it.

    Not `certain`: (phi, w) and the equilibria are taken as they are, without their bars.
    """
    doubt = w * w <= bar_w * bar_w
    own_bar, bar_phi, bar_w = bar_phi, bar_phi * certain, bar_w * certain
    side = 1.0 if w > 0.0 else -1.0
    f, g, dg = values(p, phi)
    g, w = side * g, abs(w)
    if not (f < 0.0 and g > -8.0 * ROUNDOFF_UP * p[BOUND_G] and abs(dg) < _MOST_R * f * f):
        return False
    if not (dg < _END * f * f and w > bar_w):
        return False
    for i in range(count):
        gap = (table[i, ANGLE] - phi) * side
        if table[i, KIND] == NODE and gap - math.floor(gap / TWO_PI) * TWO_PI < _SOON:
            return False
    length = _end(p, phi, side, f, dg)
    if not 0.0 < length < most:
        return False
    h, start, from_rest, behind = length / _PIECES, phi, False, TWO_PI
    for i in range(count):
        gap = (phi - table[i, ANGLE]) * side
        gap -= math.floor(gap / TWO_PI) * TWO_PI
        near = 1.0001 * table[i, BAR] + 1e-15
        doubt = doubt or gap < own_bar + near
        near *= certain
        if gap < bar_phi + near or gap > TWO_PI - length - near:
            return False
        if gap < min(0.5 * h, behind):
            behind = gap
            from_rest = table[i, KIND] == SADDLE and table[i, BAR] < 0.001 * h
    if from_rest:
        start, length = phi - side * behind, length + behind
    low = -f - p[BOUND_F] * (h if from_rest else bar_phi)
    if not low > 0.0:
        return False
    below, above = 0.0, 2.0
    if from_rest:
        # then w falls by low/2 and more per radian while it is larger than twice -g/f
        if not w + bar_w < 0.25 * low * h:
            return False
    else:
        blur = (abs(dg) + p[BOUND_DDG] * bar_phi) * bar_phi + 8.0 * ROUNDOFF_UP * p[BOUND_G]
        if not 2.0 * blur < g:
            return False
        below, above = (w - bar_w) * low / (g + blur), (w + bar_w) * (2.0 * -f - low) / (g - blur)
        if not above < _MOST_Z:
            return False
        below, above = min(below, 0.8), max(above, 1.25)
    h = length / _PIECES
    half, exponent, time, before = 0.5 * h, 0.0, 0.0, dg
    for k in range(_PIECES):
        f, g, dg = values(p, start + side * (k + 0.5) * h)
        g = max(side * g, 0.0)
        low, high = -f - 1.001 * p[BOUND_F] * half, 1.001 * p[BOUND_F] * half - f
        bend = 1.001 * _largest_bend(p, start + side * (k + 0.5) * h, half)
        least, largest = dg - bend * half, dg + bend * half
        if not low > 0.5 * high:
            return False
        top = g + (abs(dg) + 0.5 * bend * half) * half + 8.0 * ROUNDOFF_UP * p[BOUND_G]
        turn = top * p[BOUND_F] / (low * low * low)
        least = least / (low * low if least < 0.0 else high * high) - turn
        largest = largest / (low * low if largest > 0.0 else high * high) + turn
        if not (least > -_MOST_R and largest < _MOST_R):
            return False
        if from_rest and k == 0:
            _f, g, _dg = values(p, start + side * h)
            g = side * g - 8.0 * ROUNDOFF_UP * p[BOUND_G]
            if not 2.0 * top * high < _MOST_Z * low * g:
                return False
            above, before = max(2.0 * top * high / (low * g), 1.25), dg
            continue
        rate = low * low * h / top
        exponent -= rate / max(above, 1.25)  # z is less than 1.23, or falls
        end = 2.0 / (1.0 + math.sqrt(1.0 + 4.0 * least))
        if above > end * (1.0 + 1e-12):  # the bracket is concave, so above its chord
            chord = (1.0 - 1.0 / above + least * above) / (above - end)
            above = end + (above - end) * math.exp(-rate * chord)
        else:
            above = end
        end = 2.0 / (1.0 + math.sqrt(1.0 + 4.0 * largest))
        if below < end:  # and convex where it is negative, so above its tangent
            tangent = 1.0 / (end * end) + largest
            below = end - (end - below) * math.exp(-rate * tangent)
        else:
            below = end
        bend = (dg - before) / h
        time += h * -f / (g + 1e-300)
        before = dg
        if abs(dg) < 0.6 * bend * h:  # about its minimum g is a parabola
            to = -dg / bend
            _f, least, tilt = values(p, start + side * ((k + 0.5) * h + to))
            least = max(side * least - 0.5 * tilt * tilt / bend, 1e-300)
            root = math.sqrt(0.5 * bend / least)
            arc = math.atan(root * (half - to)) + math.atan(root * (half + to))
            time += -f * (arc / math.sqrt(0.5 * bend * least) - h / (g + 1e-300))
    spread = 0.5 * (above - below)
    if not (exponent < -WORTH and spread < _NARROW):
        return False
    out[END_PHI] = start + side * length
    f, g, _dg = values(p, out[END_PHI])
    speed = side * g / -f
    out[END_W] = side * speed * 0.5 * (above + below)
    # carried on to first order: two solutions part by dw' = -g dw/(w1 w2), within exp(spread) of that
    out[END_BAR] = 1.1 * speed * spread + 16.0 * ROUNDOFF_UP * p[BOUND_G] / -f
    out[EXPONENT], out[TIME], out[DOUBT] = exponent, time, 1.0 * doubt
    return True


@inline
def after_passage(far, n, t, e, doubt):
    """phi, w, the time and the integral of f at the end of the passage `far`, the square of the error of
    w after n steps, for which (a + b_1 + ... + b_m)^2 <= (n + m) (a^2/n + b_1^2 + ... + b_m^2), and doubts.
    """
    square = far[END_BAR] * far[END_BAR] / n
    e = max(e + far[EXPONENT], LEAST_EXPONENT)
    return far[END_PHI], far[END_W], t + far[TIME], e, square, doubt + far[DOUBT]


@inline
def narrowed(f, g, w, saa, sab, sbb):
    """(does w follow the slow manifold still, so that errors fall?, the error ellipse): there phi counts
    as exact, as an error along the motion counts no more.
    """
    slope = f + g / w
    if not abs(slope) < -0.5 * f:
        return False, saa, sab, sbb
    return True, 0.0, 0.0, max(sbb - 2.0 * slope * sab + slope * slope * saa, 0.0)
