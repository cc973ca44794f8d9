"""User-defined equations y'' + z y = 0 whose truth is known: series in double-double, or pieces in
closed form.
"""

from math import cos, sin

import numpy as np
from mpmath import mp, mpf

from survey.truth import hill_flow, remembered
from survey.truth.hill import FACTOR_COLUMNS, TOLERANCE, hill_outputs
from survey.truth.hill_flow import BENT, COLUMNS, DOUBT, END, HARMONICS, LORENTZ, STEPS, TWO_PI


def harmonics(u, p):
    x = TWO_PI * u / p[9]
    even = p[1] * cos(x) + p[2] * cos(2 * x) + p[3] * cos(3 * x) + p[4] * cos(4 * x)
    return p[0] + even + p[5] * sin(x) + p[6] * sin(2 * x) + p[7] * sin(3 * x) + p[8] * sin(4 * x)


def meissner(u, p):
    return p[0] if u < p[2] else p[1]


def meissner_even(u, p):
    return p[0] if u < p[2] or 1 - u < p[2] else p[1]


def bent(u, p):
    return p[0] + p[1] * u if u < p[4] else p[2] + p[3] * cos(6 * u)


def lorentz(u, p):
    x = (u - p[2]) / p[3]
    return p[0] + p[1] / (1 + x * x)


SHORT = ("a", "b", "c", "d")
LONG_NAMES = ("a", "c1", "c2", "c3", "c4", "s1", "s2", "s3", "s4", "T")
# z, parameters, kind of its truth, and the rest that survey.hill is given; z is not that of a
# smooth period but for the harmonics, so 0 is a break
OWN = {
    "harmonics": (harmonics, LONG_NAMES, HARMONICS, dict(period=lambda p: p[9])),
    "harmonics even": (harmonics, LONG_NAMES, HARMONICS, dict(period=lambda p: p[9], even=True)),
    "meissner": (meissner, SHORT[:3], None, dict(period=1.0, breaks=lambda p: [0.0, p[2]])),
    "meissner even": (meissner_even, SHORT[:3], None, dict(period=1.0, breaks=lambda p: p[2], even=True)),
    "bent": (bent, (*SHORT, "jump"), BENT, dict(period=1.0, breaks=lambda p: [0.0, p[4]])),
    "spike": (lorentz, SHORT, LORENTZ, dict(period=1.0, breaks=0.0)),
    "spike named": (lorentz, SHORT, LORENTZ, dict(
        period=1.0, breaks=lambda p: [0.0, p[2] - 4 * p[3], p[2], p[2] + 4 * p[3]])),
}  # fmt: skip


def solved(name, p):
    """Factors at T/2 (where z is even) or T of points (N, n), as `hill_flow.own_points`."""
    return remembered(name, lambda points, out: _solve(name, points, out), p, COLUMNS)


def _solve(name, p, out):
    _, names, kind, more = OWN[name]
    if kind is None:
        out[:] = np.array([_steps(row, more.get("even", False)) for row in p]).reshape(-1, COLUMNS)
        return
    ends = p[:, names.index("jump")].copy() if kind == BENT else np.full(len(p), np.inf)
    length = p[:, names.index("T")] if kind == HARMONICS else np.ones(len(p))
    if more.get("even"):
        length = length / 2
    hill_flow.own_points(kind, p, ends, np.column_stack([length, 0 * length]), TOLERANCE, out)


def _steps(row, even):
    """As `hill_flow.own_points` for z = a before the break and b behind it: the closed form, 50 digits."""
    with mp.workdps(50):
        a, b, jump = (mpf(float(x)) for x in row)
        end = mpf(0.5 if even else 1)
        flow = mp.eye(2)
        for z, length in ((a, min(jump, end)), (b, end - min(jump, end))):
            root = mp.sqrt(abs(z))
            x = root * length
            if z > 0:
                c, s = mp.cos_sin(x)
            else:
                c, s = mp.cosh(x), mp.sinh(x)
            # sin(x) / root loses nothing but where z is 0
            step = mp.matrix(
                [[c, s / root if root else length], [-s * root if z > 0 else s * root, c]]
            )
            flow = step * flow
        out = np.zeros(COLUMNS)
        factors = flow[0, 0], flow[0, 1], flow[1, 0], flow[1, 1]
        for column, value in zip(FACTOR_COLUMNS.values(), factors, strict=True):
            out[column] = float(value)
            out[column + 1] = float(value - float(value))
    out[DOUBT] = 1e-31 * max(1.0, *abs(out[list(FACTOR_COLUMNS.values())]).tolist())
    out[END], out[STEPS] = end, 2.0
    return out


def true(name):
    """The truth of OWN[name]."""

    def truth(given, answer):
        p = np.column_stack([given[x] for x in OWN[name][1]])
        out = np.full((len(p), COLUMNS), np.nan)
        ok = answer["status"] == 0
        out[ok] = solved(name, p[ok])
        found = hill_outputs(out, answer, OWN[name][3].get("even", False))
        found.pop("unstable")
        return found

    return truth
