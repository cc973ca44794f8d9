"""Return maps of the flow and their fixed points, the cycles.

Rotations (kind 0): w > 0 on the section phi = phi_s to w one turn later; an orbit that turns first
has no image. Librations (kind 1): a right turning point x in an interval {w = 0, g < 0} to the next
one; the class of an orbit is the number of equilibria between its turning points, and only orbits
that stay in the interval have an image. Both maps increase. D = map - identity; map' = exp(int f
dt) times w/w1, or g/g1.
"""

import math

import numpy as np

from survey.kernels.cylinder.creeping import (
    LEAST_EXPONENT,
    PASSAGE,
    after_passage,
    crept,
    narrowed,
    stands_still,
    trapped,
)
from survey.kernels.cylinder.equilibria import ANGLE, BAR, FOCUS, KIND, F, captured
from survey.kernels.cylinder.flow import BOUND_DG, BOUND_F, BOUND_G, TWO_PI, table, values
from survey.kernels.cylinder.program import COLUMNS, MEAN
from survey.kernels.cylinder.steps import (
    bar,
    carried,
    expand,
    local_error,
    passage,
    time_of_turning,
)
from survey.kernels.jit import inline, kernel, part, splice
from survey.kernels.math.roundoff import ROUNDOFF_UP

ROTATION, LIBRATION = 0, 1
NO_IMAGE, UNKNOWN = 0, -1  # classes without an image
# a node of a scan: x, class, D, map' (of a libration without an image, as it goes beyond the end of its
# interval, minus the number of equilibria that it has passed), bar of D, time and its bar, and of librations
# the left turning point and w > 0 at the equilibrium to the left of x, with its bar
X, CLASS, CHANGE, SLOPE, ERROR, TIME, TIME_ERROR, LEFT, SPEED, SPEED_ERROR = range(10)
NODE_SIZE = 10
(
    CYCLE_X,
    MULTIPLIER,
    PERIOD,
    CYCLE_BAR,
    MULTIPLIER_BAR,
    CYCLE_LEFT,
    CYCLE_CLASS,
    INTERVAL,
    BELOW,
    ABOVE,
    PERIOD_BAR,
    CYCLE_SPEED,
    SPEED_BAR,
) = range(13)
CYCLE_SIZE = 13
# edges of a scan: w_c and w_d of a rotation and the bar of that, D and its bar at the last node and at the first, how
# often it stays open whether there is a cycle
(
    BORDER,
    IMAGE,
    IMAGE_ERROR,
    LAST_CHANGE,
    LAST_ERROR,
    FIRST_CHANGE,
    FIRST_ERROR,
    UNANSWERED,
) = range(8)
EDGES = 8
MOST_CYCLES = 16
MOST_NODES = 400
STRIDE = 4  # places of a scan of which three are left out where D is plain,
BENT = 1.0  # log|D| bends by less than that between them,
GAP = 0.05  # and places between a motion that is caught by a focus and one that is not, of those of the lattice
LIMIT = 40_000
APART = 1e4  # times its bar, the distance from a cycle at which its slope, its period and its speed are compared
# error up to which a motion beside a saddle that creeps counts as on the side where it is: borders of
# classes are found no more exactly than that
SIDES = 1e-10
TINY = 1e-9  # rad: beside the angle of an equilibrium
TURN_ROUNDING = 2e-15  # rad: of angles up to two turns


@inline
def rotation(setting, begin, at, p, eqs, count, section, w0, tolerance, node):
    """One turn from (section, w0 > 0)."""
    T = table()
    how = setting(p, w0, tolerance)
    phi, w, saa, sab, sbb, e, y, y_error, t = section, w0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    node[X], node[CLASS], node[TIME_ERROR] = w0, UNKNOWN, math.inf
    target, far, slow = section + TWO_PI, np.empty(PASSAGE), False
    doubt, late = 0.0, 0.0
    balanced = len(p) == COLUMNS or p[MEAN] == 0.0  # then w - F is periodic, and y its change
    for n in range(1, LIMIT):
        h = expand(begin, p, phi, w, how, T)
        x1, w1, de, dy = at(p, T, h)
        if not math.isfinite(w1):
            return
        if w1 <= 0.0:
            reach = time_of_turning(at, p, T, h)
            if at(p, T, reach)[0] < target:
                node[CLASS] = NO_IMAGE
                return
        elif x1 < target:
            reach = h
        if x1 >= target or w1 <= 0.0:
            reach = passage(at, p, T, target, True, reach if w1 <= 0.0 else h)
            x1, w1, de, dy = at(p, T, reach)
        saa, sab, sbb = carried(p, T, reach, w1, saa, sab, sbb)
        y_error += local_error(p, T, 0.0, reach)[1]
        phi, w, e, y, t = x1, w1, e + de, y + dy, t + reach
        if reach < h or x1 >= target:
            f, g, _dg = values(p, section)
            slope = f + g / w
            own = bar(n, max(sbb - 2.0 * slope * sab + slope * slope * saa, 0.0))
            change = y
            if not balanced:
                change = w - w0
                own += 2.0 * ROUNDOFF_UP * (w + w0)
            fast = balanced and w0 / (p[BOUND_F] + math.sqrt(p[BOUND_DG]) + 1e-300) > 10.0
            other = y_error + 7.0 * (own * p[BOUND_G] / w0 + bar(n, saa) * p[BOUND_DG]) / w0
            node[CLASS], node[CHANGE], node[SLOPE], node[TIME] = (
                1.0,
                change,
                math.exp(max(e, LEAST_EXPONENT)) * w0 / (w0 + change),
                t,
            )
            node[ERROR] = (min(own, other) if fast else own) + doubt
            node[TIME_ERROR] = late + 1.2 * bar(n, saa) / w + ROUNDOFF_UP * n * t
            return
        if slow:
            f, g, _dg = values(p, phi)
            slow, saa, sab, sbb = narrowed(f, g, w, saa, sab, sbb)
        if n % 4 == 0:
            bar_phi, bar_w = bar(n, saa), bar(n, sbb)
            if runs_in(p, eqs, count, phi, w, bar_phi + bar_w):
                node[CLASS] = NO_IMAGE
                return
            certain = bar_phi + bar_w >= SIDES
            if crept(p, eqs, count, phi, w, bar_phi, bar_w, certain, target - phi, far):
                phi, w, t, e, sbb, doubt = after_passage(far, n, t, e, doubt)
                saa, sab, slow, balanced, late = 0.0, 0.0, True, False, math.inf


@inline
def libration(setting, begin, at, p, eqs, count, high, x0, tolerance, node):
    """From the right turning point x0 to the next, which must lie below `high`, the next equilibrium.

    Where the motion is certain to run into the focus before x0, its angle stands for the image, which
    lies between it and x0; then SLOPE is 0.
    """
    T = table()
    how = setting(p, 0.0, tolerance)
    phi, w, saa, sab, sbb, e, t, right = x0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False
    far, slow = np.empty(PASSAGE), False
    doubt, late = 0.0, 0.0
    node[X], node[CLASS], node[SLOPE] = x0, UNKNOWN, 0.0
    node[TIME_ERROR], node[SPEED], node[SPEED_ERROR] = math.inf, math.nan, math.inf
    before, rest = equilibrium_before(eqs, count, x0)
    focus = before if before >= 0 and eqs[before, KIND] == FOCUS else -1
    for n in range(1, LIMIT):
        h = expand(begin, p, phi, w, how, T)
        x1, w1, de, _dy = at(p, T, h)
        if not math.isfinite(w1):
            return
        turned = w1 >= 0.0 if not right else w1 <= 0.0
        if turned:
            h = time_of_turning(at, p, T, h)
            x1, w1, de, _dy = at(p, T, h)
            w1 = 0.0
        if right and phi < rest <= x1:
            up = passage(at, p, T, rest, True, h)
            v = at(p, T, up)[1]
            aa, ab, bb = carried(p, T, up, v, saa, sab, sbb)
            f = eqs[before, F]  # dw/dphi, where g = 0
            own = bar(n, max(bb - 2.0 * f * ab + f * f * aa, 0.0))
            node[SPEED], node[SPEED_ERROR] = (
                v,
                own + 1.2 * abs(f) * (eqs[before, BAR] + TURN_ROUNDING),
            )
        saa, sab, sbb = carried(p, T, h, w1, saa, sab, sbb)
        phi, w, e, t = x1, w1, e + de, t + h
        if phi < x0 - TWO_PI or phi > high:
            node[CLASS] = NO_IMAGE
            node[SLOPE] = -float(between(eqs, count, node[LEFT], x0)) if phi > high else 0.0
            return
        if slow:
            f, g, _dg = values(p, phi)
            slow, saa, sab, sbb = narrowed(f, g, w, saa, sab, sbb)
        if n % 4 == 0:
            bar_phi, bar_w = bar(n, saa), bar(n, sbb)
            beside = focus >= 0 and abs(phi - rest) < math.pi
            if beside and captured(eqs[focus : focus + 1], 1, phi, w, bar_phi + bar_w) >= 0:
                low = node[LEFT] if right else rest - TINY
                node[CLASS] = between(eqs, count, low, rest + TINY)
                node[CHANGE], node[TIME], node[ERROR] = rest - x0, t, 0.0
                return
            if runs_in(p, eqs, count, phi, w, bar_phi + bar_w):
                node[CLASS] = NO_IMAGE
                return
            certain = bar_phi + bar_w >= SIDES
            if crept(p, eqs, count, phi, w, bar_phi, bar_w, certain, TWO_PI, far):
                phi, w, t, e, sbb, doubt = after_passage(far, n, t, e, doubt)
                saa, sab, slow, late = 0.0, 0.0, True, math.inf
        if turned and right:
            inside = between(eqs, count, node[LEFT], phi)
            node[CHANGE], node[TIME], node[ERROR] = phi - x0, t, bar(n, saa) + doubt
            g = values(p, phi)[1]
            node[SLOPE] = math.exp(max(e, LEAST_EXPONENT)) * values(p, x0)[1] / g
            node[TIME_ERROR] = late + 1.2 * bar(n, sbb) / abs(g) + ROUNDOFF_UP * n * t
            node[CLASS] = (
                inside if between(eqs, count, min(phi, x0), max(phi, x0)) == 0 else NO_IMAGE
            )
            return
        if turned:
            node[LEFT], right = phi, True


@kernel
def runs_in(p, eqs, count, phi, w, bar):
    """Does every state within `bar` of (phi, w) run into an equilibrium? See SIDES."""
    if captured(eqs, count, phi, w, bar) >= 0:
        return True
    if bar >= SIDES:
        return trapped(p, eqs, count, phi, w, bar, True) >= 0
    return trapped(p, eqs, count, phi, w, 0.0, False) >= 0 or stands_still(p, eqs, count, phi, w)


@part
def equilibrium_before(eqs, count, x):
    """The number of the next equilibrium to the left of the angle x, or -1, and its angle."""
    at, least = -1, math.inf
    for i in range(count):
        gap = x - eqs[i, ANGLE]
        gap -= TWO_PI * math.floor(gap / TWO_PI)
        if gap < least:
            at, least = i, gap
    return at, x - least


@part
def between(eqs, count, low, high):
    """How many equilibria lie between the unwrapped angles low and high."""
    inside = 0
    for i in range(count):
        inside += int(
            math.floor((high - eqs[i, ANGLE]) / TWO_PI) - math.floor((low - eqs[i, ANGLE]) / TWO_PI)
        )
    return inside


@splice
def image(setting, begin, at, kind, p, eqs, count, anchor, x, tolerance, node):
    """The map of `kind` at x: anchor is the section (rotations) or the right end of the interval
    (librations).
    """
    if kind == ROTATION:
        rotation(setting, begin, at, p, eqs, count, anchor, x, tolerance, node)
    else:
        libration(setting, begin, at, p, eqs, count, anchor, x, tolerance, node)


@part
def copy(target, source):
    """Copy a node (an element-wise loop compiles ten times faster than an assignment of slices)."""
    for i in range(len(source)):
        target[i] = source[i]


@part
def ahead(xs, x, step, i, guess):
    """(n, x, i, step) of the next places of a scan, STRIDE at most and before the guess: how many they are, the
    last of them, and the scan's index and its geometric step from there on.
    """
    n, at = 0, x
    while n < STRIDE and i < len(xs):
        near = step > 0.0 and x + step < xs[i]
        new = x + step if near else xs[i]
        if not new < guess:
            break
        n, at, step, i = n + 1, new, step * 10.0, i + (not near)
    return n, at, i, step


@inline
def is_open(a):
    """Has the node an image, but may D have either sign?"""
    return a[CLASS] > 0.0 and not abs(a[CHANGE]) > a[ERROR]


@inline
def rises_from(a, b):
    """Is D > 0 from the node a to behind b? Maps increase, so D falls no faster than x rises."""
    return a[CLASS] == b[CLASS] and a[CHANGE] - a[ERROR] > 1.01 * (b[X] - a[X])


@inline
def falls_to(a, b):
    """Is D < 0 from before the node a to b, which is further from a border?"""
    return a[CLASS] == b[CLASS] and b[CHANGE] + b[ERROR] < -1.01 * (b[X] - a[X])


@inline
def is_plain(kind, a, b, low, high):
    """Do two nodes suggest that D keeps its sign between them: is D' monotone, as far as the chord tells, has
    |D| no minimum, and is it nearly a power of the distance from `low` (and `high`: see `logarithm`)?
    """
    if a[CLASS] != b[CLASS] or caught(a) != caught(b):
        return False
    if caught(a):  # motions that run into a focus, as all do in between
        return True
    if is_open(a) or is_open(b) or differ(a, b):
        return False
    chord = (b[CHANGE] - a[CHANGE]) / (b[X] - a[X])
    first, second = a[SLOPE] - 1.0, b[SLOPE] - 1.0
    dips = first < 0.0 < second if a[CHANGE] > 0.0 else second < 0.0 < first
    if dips or not min(first, second) < chord < max(first, second):
        return False
    from_a, rate_a = logarithm(kind, a[X], low, high)
    from_b, rate_b = logarithm(kind, b[X], low, high)
    length, grown = from_b - from_a, math.log(b[CHANGE] / a[CHANGE])
    bent = abs(first / (a[CHANGE] * rate_a) * length - grown)
    return bent + abs(second / (b[CHANGE] * rate_b) * length - grown) < BENT


@inline
def logarithm(kind, x, low, high):
    """What the lattice of a map is even in, log w or the log of the ratio of the distances of the angle x
    from two equilibria, and its derivative.
    """
    if kind == ROTATION:
        return math.log(x), 1.0 / x
    return math.log((x - low) / (high - x)), 1.0 / (x - low) + 1.0 / (high - x)


@inline
def caught(a):
    """Is the node's motion certain to run into the focus before it? See `libration`."""
    return a[CLASS] > 0.0 and a[SLOPE] == 0.0


@part
def last_before(xs, place):
    """The index of the last of xs before a place, 0 if that is NaN."""
    i = 0
    while i + 1 < len(xs) and xs[i + 1] < place:
        i += 1
    return i


@part
def first_beyond(x, guesses):
    """The first of the guesses beyond x, or infinity."""
    for guess in guesses:
        if guess > x:
            return guess
    return math.inf


@part
def next_place(low, high, guess, reach):
    """Where to look for a border between low and high: `reach` to either side of the guess, then ever
    further on the side where it is, or else in the middle.
    """
    middle = 0.5 * (low + high)
    if low < guess < high:
        if low < guess - reach:
            return guess - reach
        return guess + reach if guess + reach < high else middle
    ahead = high - 15.0 * (guess - high) if guess >= high else low + 15.0 * (low - guess)
    return ahead if low < ahead < high else middle


@inline
def jumps(a, b):
    """Does D, negative at the node a, become positive before b? As librations begin to go beyond the
    end of their interval, the image becomes that end.
    """
    return a[CLASS] > 0.0 and a[CHANGE] < 0.0 and b[CLASS] == NO_IMAGE and b[SLOPE] == -a[CLASS]


@inline
def differ(a, b):
    """Does D change sign between two nodes of one class?"""
    return (a[CHANGE] > 0.0) != (b[CHANGE] > 0.0)


@inline
def steepness(kind, p, x):
    """Relative change of map' per unit of D: of its factor w/w1, or g/g1."""
    return 1.0 / x if kind == ROTATION else p[BOUND_DG] / (abs(values(p, x)[1]) + 1e-300)


@inline
def cycle_bar(m):
    """The error bound of a cycle's place, from that of D at the node m."""
    change = abs(m[CHANGE]) + m[ERROR]
    return 1.2 * change / max(abs(m[SLOPE] - 1.0), 1e-12) + 4e-16 * abs(m[X])


@inline
def bar_of(left, m, right, column, bar):
    """The error bound of a number at a cycle, whose own is in the next column, from nodes about that one."""
    change = max(abs(left[column] - m[column]), abs(right[column] - m[column]))
    reach = min(m[X] - left[X], right[X] - m[X])
    return 1.2 * change / reach * bar + 2.0 * m[column + 1]


@part
def write_cycle(a, b, m, interval, steep, row):
    """Note the cycle at node m between a and b; its bar from those of D and of the slope."""
    away = abs((b[CHANGE] - a[CHANGE]) / (b[X] - a[X]))
    row[CYCLE_X], row[MULTIPLIER], row[PERIOD], row[CYCLE_LEFT] = m[X], m[SLOPE], m[TIME], m[LEFT]
    row[CYCLE_BAR] = cycle_bar(m)
    bend = (abs(a[SLOPE] - m[SLOPE]) + abs(b[SLOPE] - m[SLOPE])) / max(b[X] - a[X], 1e-300) + away
    row[MULTIPLIER_BAR] = 1e-14 * (1.0 + m[SLOPE]) + 20.0 * m[ERROR] + 3.0 * bend * row[CYCLE_BAR]
    row[MULTIPLIER_BAR] += 2.0 * m[SLOPE] * steep * (abs(m[CHANGE]) + m[ERROR])
    row[CYCLE_CLASS], row[INTERVAL] = m[CLASS], interval
    row[PERIOD_BAR] = row[CYCLE_SPEED] = row[SPEED_BAR] = math.inf
    row[BELOW] = 1.0 if a[CHANGE] > 0.0 else -1.0
    row[ABOVE] = 1.0 if b[CHANGE] > 0.0 else -1.0


def fixed_points_of(image_of):
    """What finds the fixed points of the return maps that `image_of` computes (see `image`)."""

    @part
    def scan(kind, p, eqs, count, anchor, xs, guesses, tolerance, nodes):
        """Fill `nodes` with the images of xs, and more beside every border of a class; returns their number.

        Places of the lattice are left out where D is plain (`is_plain`) or there is no image: below the border of
        rotations, and between two borders of librations if there is none behind the first.
        """
        a, c, d = np.zeros(NODE_SIZE), np.zeros(NODE_SIZE), np.zeros(NODE_SIZE)
        further = np.zeros(NODE_SIZE)
        grain = 1e-15 * (xs[-1] - xs[0])
        last = len(guesses) - 1
        i = last_before(xs, guesses[last]) if kind == ROTATION and last >= 0 else 0
        image_of(kind, p, eqs, count, anchor, xs[i], tolerance, nodes[0])
        if i > 0 and nodes[0, CLASS] != NO_IMAGE:
            i = 0
            image_of(kind, p, eqs, count, anchor, xs[i], tolerance, nodes[0])
        size, x, step, places = 1, xs[i], 0.0, 0
        i += 1
        low = equilibrium_before(eqs, count, xs[0])[1] if kind == LIBRATION else 0.0
        skips = kind == LIBRATION and not (last >= 0 and math.isnan(guesses[last]))
        while i < len(xs):
            copy(a, nodes[size - 1])
            guess = first_beyond(a[X], guesses)
            if places == 0 and a[CLASS] > 0.0:
                places, at, to, wide = ahead(xs, x, step, i, guess)
                if places < 2:
                    places = 0
                else:
                    image_of(kind, p, eqs, count, anchor, at, tolerance, further)
                    if is_plain(kind, a, further, low, anchor) and size < len(nodes):
                        copy(nodes[size], further)
                        size, step, i, places = size + 1, wide, to, 0
                        continue
            near = step > 0.0 and x + step < xs[i]  # geometric steps away from a border
            if places == 1:
                copy(c, further)
            else:
                image_of(kind, p, eqs, count, anchor, x + step if near else xs[i], tolerance, c)
            places = max(places - 1, 0)
            crossed, reach = c[CLASS] != a[CLASS], 0.45 * (2e-15 * abs(a[X]) + grain)
            gap, before, parted = GAP * (c[X] - a[X]), caught(a), caught(c) != caught(a)
            while parted and not crossed and c[X] - a[X] > gap:
                image_of(kind, p, eqs, count, anchor, 0.5 * (a[X] + c[X]), tolerance, d)
                if caught(d) == before:
                    copy(a, d)
                else:
                    copy(c, d)
                crossed = c[CLASS] != a[CLASS]
            if parted and not crossed and size + 1 < len(nodes):
                copy(nodes[size], a)
                copy(nodes[size + 1], c)
                size, places = size + 2, 0
                i += c[X] >= xs[i]
                continue
            while crossed and c[X] - a[X] > 2e-15 * abs(c[X]) + grain:
                middle = next_place(a[X], c[X], guess, reach)
                if not a[X] < middle < c[X]:
                    break
                image_of(kind, p, eqs, count, anchor, middle, tolerance, d)
                if d[CLASS] == nodes[size - 1, CLASS]:
                    copy(a, d)
                else:
                    copy(c, d)
            if crossed and size + 3 < len(nodes):
                beside = a[X] - 1e5 * reach  # see `rises_from`
                if kind == LIBRATION and is_open(a) and beside > nodes[size - 1, X]:
                    image_of(kind, p, eqs, count, anchor, beside, tolerance, nodes[size])
                    size += nodes[size, CLASS] == a[CLASS]
                copy(nodes[size], a)
                copy(nodes[size + 1], c)
                size, x, step, places = size + 2, c[X], 16.0 * (2e-15 * abs(c[X]) + grain), 0
                if c[X] >= xs[i]:
                    i += 1
            else:
                if size < len(nodes):
                    copy(nodes[size], c)
                    size += 1
                step *= 10.0
                i += not near
                if skips and c[CLASS] == NO_IMAGE:
                    i, step = max(i, last_before(xs, first_beyond(c[X], guesses))), 0.0
        return size

    @part
    def followed_down(kind, p, eqs, count, anchor, a, b, tolerance, m):
        """Follow a dip of |D| between a and b; True when D crosses 0 or touches it at the node m."""
        left, right = np.empty(NODE_SIZE), np.empty(NODE_SIZE)
        copy(left, a)
        copy(right, b)
        sign = 1.0 if a[CHANGE] > 0.0 else -1.0
        for _ in range(40):
            da, db = sign * (left[SLOPE] - 1.0), sign * (right[SLOPE] - 1.0)
            if not (da < 0.0 < db):
                return False
            # tangents meet below a convex D: nothing to find while they meet above 0
            low = (
                sign * left[CHANGE] * db
                - sign * right[CHANGE] * da
                + da * db * (right[X] - left[X])
            ) / (db - da)
            if low > 0.0:
                return False
            image_of(kind, p, eqs, count, anchor, 0.5 * (left[X] + right[X]), tolerance, m)
            if m[CLASS] != a[CLASS]:
                return False
            if sign * m[CHANGE] <= 0.0 or right[X] - left[X] < 1e-9 * abs(right[X]):
                return sign * m[CHANGE] <= 2.0 * m[ERROR]
            if sign * (m[SLOPE] - 1.0) < 0.0:
                copy(left, m)
            else:
                copy(right, m)
        return False

    @part
    def solved(kind, p, eqs, count, anchor, interval, a, b, tolerance, row):
        """The fixed point between a and b, where D changes sign: Newton's method kept inside a bracket."""
        low, high, m = a[X], b[X], np.zeros(NODE_SIZE)
        left, right = np.empty(NODE_SIZE), np.empty(NODE_SIZE)
        rising = b[CHANGE] > 0.0
        # is the sign of D certain?
        below, above = abs(a[CHANGE]) > a[ERROR], abs(b[CHANGE]) > b[ERROR]
        share = a[CHANGE] / (a[CHANGE] - b[CHANGE])
        x = low + min(max(share, 0.02), 0.98) * (high - low)
        for _ in range(60):
            image_of(kind, p, eqs, count, anchor, x, tolerance, m)
            if m[CLASS] != a[CLASS]:
                break
            slope, certain = m[SLOPE] - 1.0, abs(m[CHANGE]) > m[ERROR]
            if (m[CHANGE] > 0.0) == rising:
                high, above = x, above or certain
            else:
                low, below = x, below or certain
            new = x - m[CHANGE] / slope if slope != 0.0 else low
            if abs(new - x) <= 1e-15 * abs(x) or abs(m[CHANGE]) <= 0.02 * m[ERROR]:
                break
            x = new if low < new < high else 0.5 * (low + high)
        # how much the slope changes within the bar shows the map at so many times the bar
        bar = cycle_bar(m)
        apart = min(APART * bar, 0.1 * (m[X] - a[X]), 0.1 * (b[X] - m[X]))
        image_of(kind, p, eqs, count, anchor, m[X] - apart, tolerance, left)
        image_of(kind, p, eqs, count, anchor, m[X] + apart, tolerance, right)
        lonely = not (left[CLASS] == right[CLASS] == m[CLASS] == a[CLASS]) or apart < bar
        if lonely:
            copy(left, a)
            copy(right, b)
        write_cycle(left, right, m, interval, steepness(kind, p, m[X]), row)
        if not lonely:
            row[PERIOD_BAR] = bar_of(left, m, right, TIME, bar)
            row[CYCLE_SPEED] = m[SPEED] if kind == LIBRATION else m[X]
            row[SPEED_BAR] = bar_of(left, m, right, SPEED, bar) if kind == LIBRATION else bar
        if not (below and above):  # D may change sign by its rounding alone
            row[CYCLE_CLASS], row[BELOW], row[ABOVE] = (
                -m[CLASS],
                row[BELOW] * below,
                row[ABOVE] * above,
            )

    @part
    def fixed_points(
        kind, p, eqs, count, anchor, interval, xs, guesses, tolerance, cycles, found, edges
    ):
        """The fixed points that the lattice xs (ascending) shows, appended to `cycles`; returns their number.

        Borders of a class, which are looked for at the `guesses` (ascending, see `borders`) first, are
        bisected, so that a fixed point beside one is not lost; where D has no change of sign but dips
        towards 0, the dip is followed down (a pair of cycles near its fold). edges: those of the scan.
        """
        if len(xs) == 0:
            return found
        nodes = np.zeros((MOST_NODES, NODE_SIZE))
        size = scan(kind, p, eqs, count, anchor, xs, guesses, tolerance, nodes)
        edges[BORDER], edges[IMAGE], edges[LAST_CHANGE], edges[LAST_ERROR] = (
            math.nan,
            math.nan,
            nodes[size - 1, CHANGE],
            nodes[size - 1, ERROR],
        )
        edges[FIRST_CHANGE], edges[FIRST_ERROR], edges[UNANSWERED] = (
            nodes[0, CHANGE],
            nodes[0, ERROR],
            1.0 * (nodes[0, CLASS] == UNKNOWN) + (size + 4 > len(nodes)),
        )
        m, grain = np.zeros(NODE_SIZE), 4e-15 * (xs[-1] - xs[0])
        for i in range(1, size):
            a, b = nodes[i - 1], nodes[i]
            # the scan has found both ends of what is unknown: at a border alone nothing is lost
            wide = b[X] - a[X] > 8e-15 * abs(b[X]) + grain
            edges[UNANSWERED] += a[CLASS] == UNKNOWN and b[CLASS] == UNKNOWN and wide
            if kind == LIBRATION and a[CLASS] != b[CLASS]:  # does a cycle hide beside the border?
                below, above = nodes[max(i - 2, 0)], nodes[min(i + 1, size - 1)]
                hidden = is_open(a) and not rises_from(below, a)
                edges[UNANSWERED] += hidden or (is_open(b) and not falls_to(b, above))
            if b[CLASS] == 1.0 and a[CLASS] != 1.0:
                edges[BORDER], edges[IMAGE], edges[IMAGE_ERROR] = b[X], b[X] + b[CHANGE], b[ERROR]
            if found + 2 > len(cycles) or b[X] <= a[X]:
                continue
            if jumps(a, b) or jumps(b, a):  # of the cycle there its place is known, and no more
                inner, side = (a, 1.0) if a[CLASS] > 0.0 else (b, -1.0)
                write_cycle(a, b, inner, interval, 0.0, cycles[found])
                cycles[found, CYCLE_BAR] = b[X] - a[X] + 4e-16 * abs(b[X])
                cycles[found, MULTIPLIER_BAR] = math.inf
                cycles[found, CYCLE_CLASS] = -inner[CLASS]
                cycles[found, BELOW], cycles[found, ABOVE] = -side, side
                found += 1
            if a[CLASS] <= 0.0 or a[CLASS] != b[CLASS]:
                continue
            copy(m, b)
            if differ(a, b) or followed_down(kind, p, eqs, count, anchor, a, b, tolerance, m):
                touching = not differ(a, b) and not differ(a, m)
                if touching:  # touches 0 within the error bound: one cycle or two or none
                    write_cycle(a, b, m, interval, steepness(kind, p, m[X]), cycles[found])
                    cycles[found, CYCLE_BAR] = max(cycles[found, CYCLE_BAR], 0.1 * (b[X] - a[X]))
                    cycles[found, CYCLE_CLASS] = -m[CLASS]
                    found += 1
                    continue
                for half in range(2):
                    low, high = (a, m) if half == 0 else (m, b)
                    if high[X] > low[X] and differ(low, high):
                        solved(
                            kind,
                            p,
                            eqs,
                            count,
                            anchor,
                            interval,
                            low,
                            high,
                            tolerance,
                            cycles[found],
                        )
                        found += 1
        return found

    return fixed_points
