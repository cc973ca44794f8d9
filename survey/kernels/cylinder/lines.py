"""Lines on the cylinder as points in a window of (phi, w): branches of the saddles, and cycles.

A line is followed forward in time, with the error ellipse of `steps`, and cut where it crosses the
window's borders. Of the ellipse only what lies across the line counts: an error along it leaves a
point on the line.

A branch ends where it reaches an attracting equilibrium, or its windings come closer to one another than NEAREST of
the window, or it has left the window for good: an orbit that has once made a full turn beyond the window, and gains
|w| on the section, does so again with every turn, since the return map increases.

A window may be a line of constant phi or of constant w; then the points are where the line that is followed crosses it.
"""

import math

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.equilibria import ANGLE, KIND, SADDLE, offset
from survey.kernels.cylinder.flow import TWO_PI, table, values
from survey.kernels.cylinder.steps import (
    bar,
    carried,
    expand,
    passage,
    start_sign,
    until_turning,
    wrapped,
)
from survey.kernels.jit import inline, kernel

# a window; sizes of logarithms if LOG; the distance, of the window, of windings that still part
PHI_LOW, PHI_HIGH, W_LOW, W_HIGH, PHI_SIZE, W_SIZE, PHI_LOG, W_LOG, NEAREST = range(9)
# a point: phi in [-pi, pi], w, turns taken out of phi
ANGLE_AT, VELOCITY, TURNS, BORDER, ERROR = range(5)
POINT = 5
INSIDE, AT_PHI_LOW, AT_PHI_HIGH, AT_W_LOW, AT_W_HIGH = range(5)
BRANCH, ROTATION, LIBRATION = range(3)  # what is followed: cycles once round
MOST_POINTS = 30_000
LIMIT = 50_000  # steps

# chords, in units of the window, and the angle (rad) between two of them
LONG, SHORT, BEND = 0.01, 2e-4, 0.04
FINEST, COARSEST = 32, 4096  # samples of a step
WORST = 1e-6  # position error, in units of the window, at which a line ends


@kernel
def scales(window, phi, w):
    """Units of the window per unit of phi and of w there."""
    a, c = 1.0 / window[PHI_SIZE], 1.0 / window[W_SIZE]
    if window[PHI_LOG] > 0.0:
        a /= window[PHI_LOW]
    if window[W_LOG] > 0.0:
        c /= max(abs(w), min(abs(window[W_LOW]), abs(window[W_HIGH])))
    return a, c


@kernel
def copies(window, phi):
    """The least and the greatest k with phi + 2 pi k in the window."""
    return math.ceil((window[PHI_LOW] - phi) / TWO_PI), math.floor(
        (window[PHI_HIGH] - phi) / TWO_PI
    )


@kernel
def within(window, phi, w):
    """Is (phi, w) in the window? Nothing is in one without area."""
    first, last = copies(window, phi)
    return first <= last and window[W_LOW] <= w <= window[W_HIGH] and has_area(window)


@kernel
def has_area(window):
    """Is the window no line?"""
    return window[PHI_LOW] < window[PHI_HIGH] and window[W_LOW] < window[W_HIGH]


@kernel
def write(p, window, n, phi, w, turns, border, ellipse, row):
    """Fill `row` with a point; returns its position error."""
    f, g, _dg = values(p, phi)
    accel = f * w + g
    a, c = scales(window, phi, w)
    aa, ab, bb = ellipse
    across = bar(n, max(accel * accel * aa - 2.0 * accel * w * ab + w * w * bb, 0.0))
    if border == AT_PHI_LOW or border == AT_PHI_HIGH:
        error = c * across / max(abs(w), 1e-300)
    elif border != INSIDE:
        error = a * across / max(abs(accel), 1e-300)
    else:
        error = a * c * across / max(math.hypot(a * w, c * accel), 1e-300)
    row[ANGLE_AT], row[VELOCITY], row[TURNS], row[BORDER], row[ERROR] = phi, w, turns, border, error
    return error


@kernel
def beyond(window, border, phi, w):
    """A number that changes where the border is crossed."""
    if border == AT_PHI_LOW:
        return float(math.floor((phi - window[PHI_LOW]) / TWO_PI))
    if border == AT_PHI_HIGH:
        return float(math.ceil((phi - window[PHI_HIGH]) / TWO_PI))
    return 1.0 * (w < window[W_LOW]) if border == AT_W_LOW else 1.0 * (w > window[W_HIGH])


@inline
def crossing(at, p, T, window, border, low, high):
    """dt between low and high, between which the border is crossed once."""
    x, w, _e, _y = at(p, T, low)
    side = beyond(window, border, x, w)
    for _ in range(60):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        x, w, _e, _y = at(p, T, middle)
        if beyond(window, border, x, w) == side:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@inline
def vertex(at, p, T, low, high):
    """dt between low and high where w is extreme, once."""
    x, w, _e, _y = at(p, T, low)
    f, g, _dg = values(p, x)
    rises = f * w + g > 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        x, w, _e, _y = at(p, T, middle)
        f, g, _dg = values(p, x)
        if (f * w + g > 0.0) == rises:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@inline
def line(setting, begin, at, p, start, window, eqs, count, section, kind, tolerance, out):
    """Fill `out` (m, POINT) with the points of a line from `start` (START_PHI to START_W_BAR).

    Returns their number, and whether the line was followed to its end: not where its windings come
    closer than NEAREST to one another or to an equilibrium on the window, a line, or where its error
    or its length ends it. Rows of NaN part what lies in the window.
    `section`: an angle that rotations pass.
    """
    T = table()
    how = setting(p, start[rc.START_W], tolerance)
    phi, turns = wrapped(start[rc.START_PHI])
    w, n, size = start[rc.START_W], 0, 0
    saa, sab, sbb = start[rc.START_PHI_BAR] ** 2, 0.0, start[rc.START_W_BAR] ** 2
    sign = start_sign(p, phi, w)
    target = phi + sign * TWO_PI
    inside, drawn = within(window, phi, w), False
    # the last point that is kept, in units of the window, and its direction
    old_x, old_y, old_turn = 0.0, 0.0, 0.0
    # |w| on the section; is all beyond the window since; turning point
    before, far, right = math.nan, True, math.nan
    done, to_its_end, lost = False, False, False
    if inside:
        write(p, window, 1, phi, w, turns, INSIDE, (saa, sab, sbb), out[0])
        size, drawn = 1, True
    while n < LIMIT and not done:
        h = expand(begin, p, phi, w, how, T)
        n += 1
        h, x1, w1, turned = until_turning(at, p, T, h, sign)
        if not (h > 0.0 and math.isfinite(w1) and math.isfinite(x1)):
            break
        done = to_its_end = turned and kind == LIBRATION and sign > 0
        if kind == ROTATION and (x1 - target) * sign >= 0.0:
            h = passage(at, p, T, target, sign > 0, h)
            x1, w1, _e, _y = at(p, T, h)
            done = to_its_end = True
        a, c = scales(window, phi, w)
        length = a * abs(x1 - phi) + c * abs(w1 - w)
        pieces = int(min(max(length / (0.4 * LONG), FINEST), COARSEST))
        dt, x, v, k, cut = 0.0, phi, w, 1, False
        f, g, _dg = values(p, x)
        accel = f * v + g
        while k <= pieces:
            to = h * k / pieces if k < pieces else h
            x2, w2, _e, _y = at(p, T, to)
            f, g, _dg = values(p, x2)
            if accel * (f * w2 + g) < 0.0 and not cut:  # w goes up and down in between
                to, cut = vertex(at, p, T, dt, to), True
                x2, w2, _e, _y = at(p, T, to)
                f, g, _dg = values(p, x2)
            else:
                k, cut = k + 1, False
            accel = f * w2 + g
            far = far and (w2 > window[W_HIGH] if sign > 0 else w2 < window[W_LOW])
            crossed = False
            for border in range(AT_PHI_LOW, AT_W_HIGH + 1):
                if beyond(window, border, x, v) != beyond(
                    window, border, x2, w2
                ) and size + 3 < len(out):
                    when = crossing(at, p, T, window, border, dt, to)
                    xb, wb, _e, _y = at(p, T, when)
                    loose = 1e-12 * (1.0 + abs(xb))
                    first, last = copies(window, xb + loose)[0], copies(window, xb - loose)[1]
                    level = border == AT_W_LOW or border == AT_W_HIGH
                    if first <= last and (level or window[W_LOW] <= wb <= window[W_HIGH]):
                        ellipse = carried(p, T, when, wb, saa, sab, sbb)
                        error = write(p, window, n, xb, wb, turns, border, ellipse, out[size])
                        if not error < WORST:
                            lost, done = True, done or has_area(window)
                            continue
                        size, crossed, drawn = size + 1, True, True
            inside = within(window, x2, w2)
            a, c = scales(window, x2, w2)
            turn = math.atan2(c * accel, a * w2)
            away = math.hypot(a * (x2 - old_x), c * (w2 - old_y))
            bent = abs(offset(turn, old_turn)[0]) > BEND and away > SHORT
            if inside and (bent or away > LONG or (done and k > pieces)) and size + 3 < len(out):
                ellipse = carried(p, T, to, w2, saa, sab, sbb)
                if not write(p, window, n, x2, w2, turns, INSIDE, ellipse, out[size]) < WORST:
                    lost = done = True
                    break
                size, old_x, old_y, old_turn, drawn = size + 1, x2, w2, turn, True
            if not inside and drawn and size + 3 < len(out):
                for i in range(POINT):
                    out[size, i] = math.nan
                size, drawn = size + 1, False
            dt, x, v = to, x2, w2
            if crossed:
                old_x = math.inf
        saa, sab, sbb = carried(p, T, h, w1, saa, sab, sbb)
        if done or size + 3 >= len(out):
            break
        ahead = math.floor((phi - section) / TWO_PI) != math.floor((x1 - section) / TWO_PI)
        if ahead and kind == BRANCH:
            level = section + TWO_PI * max(
                math.floor((phi - section) / TWO_PI), math.floor((x1 - section) / TWO_PI)
            )
            _x, here, _e, _y = at(p, T, passage(at, p, T, level, sign > 0, h))
            here = abs(here)
            c = scales(window, phi, w)[1]
            if not math.isnan(before):
                to_its_end = far and here > before
                if to_its_end or c * abs(here - before) < window[NEAREST]:
                    break
            before, far = here, True
        if turned:
            before, far = math.nan, True
            if sign > 0 and kind == BRANCH:
                a = scales(window, x1, 0.0)[0]
                if a * abs(x1 + turns * TWO_PI - right) < window[NEAREST]:
                    break
                right = x1 + turns * TWO_PI
            sign = -sign
        phi, w = x1, (0.0 if turned else w1)
        phi, k = wrapped(phi)
        turns += k
        target -= k * TWO_PI
        old_x -= k * TWO_PI
        if kind == BRANCH:
            settled, to_its_end = settled_beside(p, window, eqs, count, phi, w)
            if settled:
                break
    return size, to_its_end and not lost


@kernel
def settled_beside(p, window, eqs, count, phi, w):
    """Is (phi, w) closer than NEAREST to an attracting equilibrium? And is the window met no more
    from there, if it is a line?
    """
    a, c = scales(window, phi, w)
    for i in range(count):
        x, _turns = offset(phi, eqs[i, ANGLE])
        f, _g, dg = values(p, phi)
        if eqs[i, KIND] != SADDLE and math.hypot(a * x, c * w) < window[NEAREST] and f < 0.0:
            return True, has_area(window) or passes(window, eqs[i, ANGLE], x, w, f, dg)
    return False, False


@kernel
def passes(window, angle, x, w, f, dg):
    """Does the window, a line, pass all that is left of an orbit of w' = f w + dg x, x' = w, from x and
    w on, about that angle?
    """
    if window[W_LOW] < window[W_HIGH]:
        off = abs(offset(window[PHI_LOW], angle)[0])
        size = math.sqrt(max(x * x - w * w / dg, 0.0))
    else:
        off, size = abs(window[W_LOW]), math.sqrt(max(w * w - dg * x * x, 0.0))
    if off > 2.0 * size:  # w^2 - dg x^2 does not grow
        return True
    # a node is reached without a turn from between w = 0 and its steeper direction
    square = f * f + 4.0 * dg
    steep = 0.5 * (math.sqrt(max(square, 0.0)) - f)
    return off == 0.0 and square > 0.0 and x * w <= 0.0 and abs(w) <= steep * abs(x)
