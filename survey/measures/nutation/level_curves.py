"""The bifurcation set of nutations on a map of two parameters of initial states, as level curves.

On such a map there is no closed form. Its curves are zeros of functions that are known everywhere:

    separatrix          L - L at the saddle with the same p_psi, p_phi (see `kernels.nutation.brun`)
    regular precession  (b - a u)(a - b u) + k u (1 - u^2)^2, u = cos theta0, where p_theta0 = 0 is given (F of brun.md)
    pole passage        p_psi -+ p_phi, where the motion reaches the pole u = +-1

with b = p_psi, a = p_phi. They are searched for on LINES lines of the map each way by marching
squares, and every point is bracketed on its line by certain signs. A closed curve narrower than a
LINES-th of the map may be missed. A separatrix ends some 1e-5 of the map before the cusp at which
its saddle ends: there the function leaves rounding with the third power of the distance. No curve
shows where a well begins in which the motion is not. A precession is stable where its squared
frequency (S18) is positive, else it is the saddle itself.

Positions are those of `survey.measures.square`.
"""

import numpy as np

from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import brun
from survey.kernels.nutation import records as rc
from survey.kernels.nutation.wells import HIGH, LOW, PASSAGE
from survey.measures import contours
from survey.measures.nutation import wells

# the parameters of a state, in the order of its columns in `records`
STATE = ("A", "C", "epsilon", "theta0", "p_theta0", "p_psi", "p_phi")
LINES = 513


def traced(square, axes, fixed):
    """[(function, positions (m, 2) in the square, errors (m), columns (STATE, m) of states)] of every
    curve on the map.

    The function is one of those below.
    """
    functions = [
        separatrix,
        *([precession] if fixed.get("p_theta0") == 0.0 else []),
        upper_pole,
        lower_pole,
    ]
    found = []
    for function in functions:

        def on_map(x, function=function):
            return function(states(square, axes, fixed, x))

        values = None if square.across is not None else contours.continued(on_map, LINES)
        for line in contours.lines(on_map, square, LINES, values):
            x, error = contours.to_the_end(on_map, square.grain, line, LINES)
            found.append((function, x, error, states(square, axes, fixed, x)))
    return [(function, *part) for function, *rest in found for part in _reaching(function, *rest)]


def states(square, axes, fixed, x):
    """Columns (STATE, m) of the initial states at positions x (m, 2)."""
    here = dict(zip(axes, square.parameters(x).T, strict=True))
    return np.stack(
        [np.broadcast_to(here.get(name, fixed.get(name)), len(x)).astype(float) for name in STATE]
    )


def separatrix(columns):
    """L above the separatrix over |k|, and its error bound; NaN where there is none."""
    out = wells.distance(wells.heights(brun.heights_of_states, columns))
    a, c, _, theta, _, b, spin = columns
    outside = (c > 2.0 * a) | ((theta == 0.0) & (b != spin))
    return np.where(outside, np.nan, out["separatrix_distance"]), out["separatrix_distance_error"]


def precession(columns):
    """(b - a u)(a - b u) + k u (1 - u^2)^2, and its error bound; NaN at the poles, where it has
    other zeros.
    """
    size, c, epsilon, theta, _, b, a = columns
    u, sine = np.cos(theta), np.sin(theta)
    k, square = epsilon * size * (size - c), sine * sine
    one, two, three = b - a * u, a - b * u, k * u * square * square
    bar = (
        8.0
        * ROUNDOFF
        * (
            (abs(b) + abs(a * u)) * abs(two)
            + (abs(a) + abs(b * u)) * abs(one)
            + abs(k) * square * square
        )
    )
    return np.where((square > 0.0) & (c <= 2.0 * size) & (k != 0.0), one * two + three, np.nan), bar


def upper_pole(columns):
    """p_psi - p_phi."""
    value = columns[rc.P_PSI] - columns[rc.P_PHI]
    return value, ROUNDOFF * abs(value)


def lower_pole(columns):
    """p_psi + p_phi."""
    value = columns[rc.P_PSI] + columns[rc.P_PHI]
    return value, ROUNDOFF * abs(value)


def _reaching(function, x, error, columns):
    """The curve's runs that count: of p_psi = +-p_phi those on which the motion passes that pole."""
    good = np.ones(len(x), bool)
    if function in (upper_pole, lower_pole):
        side = 1.0 if function is upper_pole else -1.0
        columns = columns.copy()
        columns[rc.P_PSI] = side * columns[rc.P_PHI]
        rows, kinds, *_ = wells.of_states(columns.T)
        reached = rows[:, HIGH] if side > 0.0 else -rows[:, LOW]
        good = (kinds == PASSAGE) & (reached == 1.0)
    return [(x[part], error[part], columns[:, part]) for part in contours.runs(good)]


def along(function, columns):
    """{name: (values, bounds)} of the precession to which each state (STATE, m) of a curve belongs;
    none at poles.
    """
    if function in (upper_pole, lower_pole):
        return {}
    size, c, epsilon, theta, _, b, a = columns
    k = epsilon * size * (size - c)
    u, off = np.cos(theta), ROUNDOFF * np.ones(theta.size)
    if function is separatrix:
        u, off = np.empty((2, theta.size))
        brun.saddles_of_states(np.ascontiguousarray(columns), u, off)
    v, root = (1.0 - u) * (1.0 + u), np.sqrt(abs(k))
    y, y_bar = _rate(b, a, u, off, v, root)
    z, z_bar = _rate(a, b, u, off, v, root)
    square = y * y + z * z - np.sign(k) * (1.0 - 3.0 * u * u)
    bar = (
        2.0 * (abs(y) * y_bar + abs(z) * z_bar)
        + 6.0 * abs(u) * off
        + 8.0 * ROUNDOFF * (y * y + z * z + 4.0)
    )
    return {
        "u": (u, off), "precession_rate": (y, y_bar), "reduced_spin_rate": (z, z_bar), "nutation_square": (square, bar),
    }  # fmt: skip


def _rate(own, other, u, off, v, root):
    """(own - other u) / ((1 - u^2) sqrt|k|) and its error bound: psi' or the reduced phi', times A
    / sqrt|k|.
    """
    rate = (own - other * u) / (v * root)
    bar = (4.0 * ROUNDOFF * (abs(own) + abs(other * u)) + abs(other) * off) / (v * root)
    return rate, bar + abs(rate) * (2.0 * abs(u) * off / v + 8.0 * ROUNDOFF)
