"""Where permanent rotations of Clebsch's case lose stability, along one parameter.

A rotation about the vertical axis of the first moment is stable where both others are larger, or
both smaller, and

    Q = A1^2 Omega^2 - s epsilon (sqrt(A2 |A1 - A3|) + sqrt(A3 |A1 - A2|))^2 > 0,  s = sign(A1 - A2),

(7) of `scenes/brun_triaxial.md`. Along Omega and epsilon the zeros of Q are closed forms. With the
  largest moment
first, sqrt(1 - Q / (A1 Omega)^2) is sin(a + b), sin^2 a = A2 / A1, sin^2 b = A3 / A1, and a + b >=
pi / 2 as no moment is larger than the sum of the others; with the least first it is sinh(a + b):
either way Q is monotonic in each moment between values at which two moments are equal, so that it
has one zero there, or none.
"""

from itertools import pairwise

import numpy as np

from survey.measures import bounded
from survey.measures.body import clebsch

# it is too slow, or its moment becomes the middle one
RATE, EQUAL = "critical_rate", "equal_moments"
MOMENTS = ("A", "B", "C")
HALVINGS = 80


def along(name, low, high, fixed, axis):
    """([(RATE or EQUAL, value, bar)], are these all?) along the parameter `name`, the others `fixed`."""
    others = [other for other in MOMENTS if other != axis]
    if name in MOMENTS:
        return _along_moment(name, low, high, fixed, axis, others)
    A1, A2, A3 = (fixed[moment] for moment in (axis, *others))
    if 2.0 * max(A1, A2, A3) > (A1 + A2 + A3) * (1.0 + 4e-16):  # no body has such moments
        return [], True
    side = _side(A1, A2, A3)
    if side == 0:
        return [], True if (A1 - A2) * (A1 - A3) < 0.0 else None
    roots = clebsch.roots(*map(bounded.of, (A1, A2, A3)), side)
    if name == "epsilon":
        turn = bounded.of(A1) * fixed["Omega"] / roots
        return [(RATE, side * float((turn * turn).value), float((turn * turn).bar))], True
    if side * fixed["epsilon"] <= 0.0:
        return [], True
    rate = bounded.of(abs(fixed["epsilon"])).sqrt() * roots / A1
    return [(RATE, sign * float(rate.value), float(rate.bar)) for sign in (-1.0, 1.0)], True


def _along_moment(name, low, high, fixed, axis, others):
    """As `along`; pieces of the line end where the moment of the axis equals another one."""

    def moments(x):
        return [x if moment == name else fixed[moment] for moment in (axis, *others)]

    y, z = (fixed[moment] for moment in MOMENTS if moment != name)
    low, high = max(low, abs(y - z)), min(high, y + z)
    equal = {y, z} if name == axis else {fixed[axis]}
    cuts = sorted(x for x in equal if low < x < high)
    points = []
    complete = True
    for first, last in pairwise([low, *cuts, high]):
        if not first < last:
            continue
        side = _side(*moments(0.5 * (first + last)))
        if side * fixed["epsilon"] > 0.0:
            root = _root(lambda x, side=side: _excess(*moments(x), side, fixed), first, last)
            points += [(RATE, *root)] if root else []
            complete &= root is not None
    for cut in cuts:
        if name == axis and y == z:  # from the largest to the least moment
            points += [(EQUAL, cut, 0.0)] if fixed["Omega"] == 0.0 != fixed["epsilon"] else []
            continue
        A1, *rest = moments(cut)
        side = np.sign(2.0 * A1 - sum(rest))  # where it is not the middle one
        sign = float(_excess(A1, *rest, side, fixed).sign())
        points += [(EQUAL, cut, 0.0)] if sign > 0.0 else []
        complete = complete and sign != 0.0
    return points, complete or None


def _side(A1, A2, A3):
    """1 where the first is the largest, -1 the least, 0 neither."""
    return float(np.sign(A1 - A2)) if np.sign(A1 - A2) == np.sign(A1 - A3) else 0.0


def _excess(A1, A2, A3, side, fixed):
    """Q (Bounded): positive where the rotation is fast enough."""
    roots = clebsch.roots(*map(bounded.of, (A1, A2, A3)), side)
    turn = bounded.of(A1) * fixed["Omega"]
    return turn * turn - side * fixed["epsilon"] * (roots * roots)


def _root(function, low, high):
    """(zero, bar) of a monotonic function between low and high; () if there is none, None if that
    is not certain.
    """
    signs = [float(function(x).sign()) for x in (low, high)]
    if signs[0] * signs[1] > 0.0:
        return ()
    if signs[0] * signs[1] == 0.0:
        return None
    a, b = low, high
    for _ in range(HALVINGS):
        middle = 0.5 * (a + b)
        a, b = (middle, b) if np.sign(function(middle).value) == signs[0] else (a, middle)
    x, width = 0.5 * (a + b), 2.0 * np.spacing(max(abs(a), abs(b)))
    while low < x - width and x + width < high:
        if (
            float(function(x - width).sign()) == signs[0]
            and float(function(x + width).sign()) == signs[1]
        ):
            return x, width
        width *= 2.0
    return x, high - low
