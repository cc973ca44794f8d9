"""Where the orbits that have a return map (`returns`) end: at the stable branches of the saddles.

Rotations: an orbit above one that completes its turn completes it too, since orbits do not cross and there is
no equilibrium at w > 0. So the map is defined from a velocity w_c on, whose orbit tends to a saddle, or for all w > 0.
Librations: orbits of one class pass round the same equilibria. The orbits between two of a class form a strip
without an equilibrium, so they belong to it as well. One at the border of a class tends to a saddle, or to a
node along its steeper direction: on one side of that orbits run into the node, on the other they pass it.

These orbits are followed back in time, as unstable ones of the system that S1, (b, w, t) -> -(b, w, t),
makes of it, to where they first meet the section. As branches attract orbits beside them in that direction, the
places are about as exact as the saddles; the return maps have the last word.
"""

import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.branches import FURTHEST, unstable
from survey.kernels.cylinder.equilibria import ANGLE, DEGENERATE, KIND, NODE, SADDLE, offset
from survey.kernels.cylinder.flow import BOUND_DG, BOUND_F, TWO_PI, longest_step, table
from survey.kernels.cylinder.returns import ROTATION
from survey.kernels.cylinder.steps import passage, until_turning
from survey.kernels.jit import inline

# a place: w > 0 on the section and the number of the saddle among the saddles, or a right turning point and
# that of its interval
PLACE, OF = range(2)
BORDER = 2
LIMIT = 400  # steps
NEAR = 1e-6  # rad
STOPPED = 1e-10  # velocity, in those of the system, from which on a branch is not followed


@inline
def borders(setting, begin, at, kind, p, eqs, count, section, tolerance, out):
    """Fill `out` (3 count, BORDER) with the places on the section of a kind's return map where stable branches
    meet it; returns their number. Where one is lost, or an equilibrium is degenerate, a place is NaN.

    p, eqs: of the flow reversed in time; section: the angle that rotations pass.
    """
    starts = np.zeros((2 * count, rc.START))
    size, found, T = unstable(p, eqs, count, starts, FURTHEST, SADDLE), 0, table()
    if kind != ROTATION:
        size += unstable(p, eqs, count, starts[size:], FURTHEST, NODE)
    least = STOPPED * (p[BOUND_F] + math.sqrt(p[BOUND_DG]))
    for i in range(count):
        if eqs[i, KIND] == DEGENERATE:
            out[found, PLACE], out[found, OF] = math.nan, -1.0
            found += 1
    for k in range(size):
        phi, w = starts[k, rc.START_PHI], starts[k, rc.START_W]
        sign = 1.0 if w > 0.0 else -1.0
        if kind == ROTATION:
            if sign > 0.0:
                continue
            phi -= TWO_PI * math.floor((phi - section) / TWO_PI)
        how, first, place, lost = setting(p, w, tolerance), phi, math.nan, True
        for _ in range(LIMIT):
            h = begin(p, phi, w, how, T)
            h, x1, w1, turned = until_turning(at, p, T, min(h, longest_step(p, w)), sign)
            if not (h > 0.0 and math.isfinite(w1)):
                break
            if kind == ROTATION and x1 <= section:
                place, lost = -at(p, T, passage(at, p, T, section, False, h))[1], False
                break
            if turned and (kind == ROTATION or sign > 0.0):
                place, lost = x1 if kind != ROTATION else place, False
                break
            if abs(x1 - first) > 2.0 * TWO_PI:  # winds round the cylinder, as motions beside it do
                lost = False
                break
            if not turned and abs(w1) < least:
                lost = beside_saddle(eqs, count, x1)
                break
            phi, w = x1, 0.0 if turned else w1
            sign = -sign if turned else sign
        if lost or not math.isnan(place):
            out[found, PLACE], out[found, OF] = place, k // 2
            if kind != ROTATION and not lost:
                write(eqs, count, out[found])
            found += 1
    return found


@inline
def beside_saddle(eqs, count, phi):
    """Is phi that of a saddle, about?"""
    for i in range(count):
        if eqs[i, KIND] == SADDLE and abs(offset(phi, eqs[i, ANGLE])[0]) < NEAR:
            return True
    return False


@inline
def write(eqs, count, row):
    """Bring a right turning point into the interval between equilibria where it lies, and note that one."""
    row[PLACE] -= TWO_PI * math.floor((row[PLACE] - eqs[0, ANGLE]) / TWO_PI)
    i = 0
    while i + 1 < count and eqs[i + 1, ANGLE] <= row[PLACE]:
        i += 1
    row[OF] = i
