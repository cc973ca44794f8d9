"""Branches of the saddles up to their first turning points, from there back to the angle of their
saddle, and those that wind round another saddle behind further turning points: what shows whether
one saddle is connected with another.

Each branch is followed as an unstable one that leaves to the right, w > 0, in one of four systems:
the system itself; that of S1, (b, w, t) -> -(b, w, t), where branches are stable; that of S2, (phi,
w, b31, c23, s2) -> -(...), where they leave to the left; that of both.
"""

import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.branches import FURTHEST, unstable
from survey.kernels.cylinder.equilibria import (
    ANGLE,
    BAR,
    EQUILIBRIUM_SIZE,
    KIND,
    MOST,
    SADDLE,
    equilibria_inside,
)
from survey.kernels.cylinder.flow import (
    B12,
    B31,
    BOUND_DG,
    BOUND_F,
    BOUND_G,
    C23,
    S2,
    TWO_PI,
    potential,
    table,
    values,
)
from survey.kernels.cylinder.program import COLUMNS as GYROSTAT
from survey.kernels.cylinder.steps import (
    bar,
    carried,
    expand,
    passage,
    time_of_turning,
    until_turning,
)
from survey.kernels.jit import constant, for_constants, inline, kernel

ITSELF, REVERSED, MIRRORED, BOTH = range(4)
# w and its error bound at the next equilibria to the right, the last of them the saddle itself, a
# turn further; then the turning point, its bound, the number of those equilibria before it, the
# angle of the saddle, its bound, their number, -w where a branch that turned behind one equilibrium
# passes the angle of its saddle on its way back, or minus the distance by which it turns before,
# its bound, and how far to the right of the saddle the equilibria are; then |w| and its bound where
# a branch that winds round the equilibria between the saddle and its copy next passes one, behind
# each turning point from the second on.
TURN, TURN_BAR, PASSED, FROM, FROM_BAR, COLUMNS, BACK, BACK_BAR, OFFSETS = range(
    2 * MOST, 2 * MOST + 9
)
WINDING = OFFSETS + MOST
TURNINGS = 6  # turning points behind which a branch is followed at most
ROW = WINDING + 2 * (TURNINGS - 1)
LIMIT = 600  # steps
# difference of V, in units of its own, up to which the first of two saddles counts as the higher
SAME = 1e-12
SAMPLES = 256  # of the circle, for the V of a program
NEAR = 1e-10  # velocities, in those of the system, at which a branch counts as stopped


@inline
def passed(at, p, T, angle, right, h, n, saa, sab, sbb):
    """(w, its bound at that angle, dw/dphi) where a step, behind n others, passes an angle; saa, sab,
    sbb: the error ellipse at its start.
    """
    dt = passage(at, p, T, angle, right, h)
    x, v, _e, _y = at(p, T, dt)
    aa, ab, bb = carried(p, T, dt, v, saa, sab, sbb)
    f, g, _dg = values(p, x)
    slope = (f * v + g) / v
    return v, bar(n + 1, max(bb - 2.0 * slope * ab + slope * slope * aa, 0.0)), slope


@inline
def first_turn(setting, begin, at, p, start, tolerance, turnings, row):
    """Fill w, TURN, PASSED, BACK and, behind so many `turnings`, WINDING of `row`, whose other
    columns are filled.
    """
    T = table()
    how = setting(p, start[rc.START_W], tolerance)
    phi, w, n, k = start[rc.START_PHI], start[rc.START_W], 0, 0
    saa, sab, sbb = start[rc.START_PHI_BAR] ** 2, 0.0, start[rc.START_W_BAR] ** 2
    least = NEAR * (p[BOUND_F] + math.sqrt(p[BOUND_DG]))
    while n < LIMIT and k < row[COLUMNS]:
        h = expand(begin, p, phi, w, how, T)
        n += 1
        x1, w1, _e, _y = at(p, T, h)
        if not (h > 0.0 and math.isfinite(w1)):
            return
        turned = w1 <= 0.0
        if turned:
            h = time_of_turning(at, p, T, h)
            x1, w1, _e, _y = at(p, T, h)
        while k < row[COLUMNS] and row[FROM] + row[OFFSETS + k] <= x1:
            target = row[FROM] + row[OFFSETS + k]
            v, wide, slope = passed(at, p, T, target, True, h, n, saa, sab, sbb)
            row[2 * k], row[2 * k + 1] = v, wide + 4e-16 * abs(slope)
            k += 1
        saa, sab, sbb = carried(p, T, h, w1, saa, sab, sbb)
        phi, w = x1, w1
        if turned:
            row[TURN], row[TURN_BAR], row[PASSED] = x1 - row[FROM], bar(n, saa) + 1e-15, k
            if k == 1 and row[COLUMNS] == 4.0:
                way_back(setting, begin, at, p, x1, (n, saa, sab, sbb), tolerance, row)
            if k == 3 and row[COLUMNS] == 4.0:
                winding(setting, begin, at, p, x1, (n, saa, sab, sbb), tolerance, turnings, row)
            return
        if w < least:
            return


@inline
def way_back(setting, begin, at, p, phi, error, tolerance, row):
    """Fill BACK of `row`, from the turning point phi on; `error`: the number of steps before, and
    the error ellipse.
    """
    T = table()
    how = setting(p, 0.0, tolerance)
    n, saa, sab, sbb = error
    w, last = 0.0, n + LIMIT
    least = NEAR * (p[BOUND_F] + math.sqrt(p[BOUND_DG]))
    while n < last:
        h = expand(begin, p, phi, w, how, T)
        n += 1
        h, x1, w1, turned = until_turning(at, p, T, h, -1.0)
        if not (h > 0.0 and math.isfinite(w1)):
            return
        if x1 <= row[FROM]:
            v, wide, slope = passed(at, p, T, row[FROM], False, h, n, saa, sab, sbb)
            row[BACK], row[BACK_BAR] = -v, wide + abs(slope) * (4e-16 + row[FROM_BAR])
            return
        saa, sab, sbb = carried(p, T, h, w1, saa, sab, sbb)
        phi, w = x1, w1
        if turned:
            row[BACK], row[BACK_BAR] = row[FROM] - x1, bar(n, saa) + 1e-15
            return
        if abs(w) < least:
            return


@inline
def winding(setting, begin, at, p, phi, error, tolerance, turnings, row):
    """Fill WINDING of `row`, from the first turning point phi on, which is behind the third of four
    equilibria, until the branch turns without having passed all three, or leaves them; `error` as
    in `way_back`.
    """
    T = table()
    how = setting(p, 0.0, tolerance)
    n, saa, sab, sbb = error
    w, last, turned, met = 0.0, n + turnings * LIMIT, 1, False
    least = NEAR * (p[BOUND_F] + math.sqrt(p[BOUND_DG]))
    middle = row[FROM] + row[OFFSETS + 1]
    while n < last and turned <= turnings:
        right = turned % 2 == 0
        sign = 1.0 if right else -1.0
        next_one = row[FROM] + row[OFFSETS if right else OFFSETS + 2]
        h = expand(begin, p, phi, w, how, T)
        n += 1
        h, x1, w1, turns = until_turning(at, p, T, h, sign)
        if not (h > 0.0 and math.isfinite(w1)) or x1 <= row[FROM]:
            return
        if turned > 1 and not met and sign * (x1 - next_one) >= 0.0:
            met = True
            v, wide, slope = passed(at, p, T, next_one, right, h, n, saa, sab, sbb)
            column = WINDING + 2 * (turned - 2)
            row[column], row[column + 1] = abs(v), wide + abs(slope) * 4e-15
            if turned == turnings:
                return
        saa, sab, sbb = carried(p, T, h, w1, saa, sab, sbb)
        phi, w = x1, w1
        if turns:
            if sign * (phi - middle) < 0.0:
                return
            w, turned, met = 0.0, turned + 1, False
        elif abs(w) < least:
            return


@kernel
def changed(p, system, q):
    """Fill q with the coefficients of one of the four systems."""
    for i in range(len(p)):
        q[i] = p[i]
    if system == REVERSED or system == BOTH:
        q[B12], q[B31] = -q[B12], -q[B31]
    if system == MIRRORED or system == BOTH:
        q[B31], q[C23], q[S2] = -q[B31], -q[C23], -q[S2]


@kernel
def height(p, phi):
    """V at phi; for a program -int_0^phi (g - mean g), to a few digits."""
    if len(p) == GYROSTAT:
        return potential(p, phi)
    total, mean = 0.0, 0.0
    for i in range(SAMPLES):
        at = (i + 0.5) * TWO_PI / SAMPLES
        g = values(p, at)[1]
        mean += g / SAMPLES
        total += g * min(max(phi - i * TWO_PI / SAMPLES, 0.0), TWO_PI / SAMPLES)
    return mean * phi - total


def _constant(p, q):
    return constant(q)


@for_constants(_constant)
def like(p, q):
    """The row q, a read-only array if p is one."""
    return q


@inline
def connections(setting, begin, at, P, wanted, tolerance, cut, out):
    """Fill out (rows, 4, 2, ROW) for the four systems and the saddles of higher and of lower V; for
    the next one to the right of the angle `cut` and the other, if it is not NaN.

    Branches are followed behind so many turning points as are `wanted` (4, 2), 0 not at all. Rows
    are NaN where there are none, or an equilibrium is degenerate.
    """
    eqs = np.zeros((MOST, EQUILIBRIUM_SIZE))
    turned = np.zeros((MOST, EQUILIBRIUM_SIZE))
    starts = np.zeros((2, rc.START))
    q = np.zeros(P.shape[1])
    for i in range(len(P)):
        for system in range(4):
            for label in range(2):
                for k in range(ROW):
                    out[i, system, label, k] = math.nan
        count, hidden = equilibria_inside(P[i], eqs)
        saddles, high, level = 0, -1, 0.0
        for k in range(count):
            if eqs[k, KIND] == SADDLE:
                saddles += 1
                if math.isnan(cut):
                    own = height(P[i], eqs[k, ANGLE])
                else:
                    own = -P[i, BOUND_G] * ((eqs[k, ANGLE] - cut) % TWO_PI)
                if high < 0 or own - level > SAME * P[i, BOUND_G]:
                    high, level = k, own
        if hidden or count == 0 or 2 * saddles != count:
            continue
        for system in range(4):
            mirrored = system == MIRRORED or system == BOTH
            changed(P[i], system, q)
            for k in range(count):
                for j in range(EQUILIBRIUM_SIZE):
                    turned[k, j] = eqs[k, j]
                if mirrored:
                    turned[k, ANGLE] = TWO_PI - eqs[k, ANGLE]
            for k in range(count):
                if eqs[k, KIND] != SADDLE:
                    continue
                label = 0 if k == high else 1
                row = out[i, system, label]
                row[FROM], row[FROM_BAR], row[COLUMNS] = turned[k, ANGLE], turned[k, BAR], count
                for j in range(count):
                    other = (k - 1 - j if mirrored else k + 1 + j) % count
                    away = turned[other, ANGLE] - turned[k, ANGLE]
                    away = away if away > 0.0 else away + TWO_PI
                    row[OFFSETS + j] = away if j < count - 1 else TWO_PI
                if wanted[system, label] > 0.0:
                    # a start behind the next equilibrium would be taken for the passage of it
                    reach = min(FURTHEST, 0.5 * row[OFFSETS])
                    unstable(like(P[i], q), turned[k : k + 1], 1, starts, reach, SADDLE)
                    first_turn(
                        setting,
                        begin,
                        at,
                        like(P[i], q),
                        starts[1],
                        tolerance,
                        wanted[system, label],
                        row,
                    )
