"""Hill's equation: what the flow of `hill_flow` makes of the outputs of satellites and of Mathieu's
equation.

A truth is a function (given, answer) -> {output: (value, low, doubt), "wrong": {what: mask}}: see
`survey.truth`.
"""

from math import pi

import numpy as np

from survey.truth import hill_flow, remembered
from survey.truth.hill_flow import (
    AMPLITUDE,
    COLUMNS,
    COSINE,
    DOUBT,
    DY1,
    DY2,
    END,
    INERTIA,
    ONE_MINUS_K,
    RHO,
    Y1,
    Y2,
    K,
)

FACTOR_COLUMNS = {"y1": Y1, "y2": Y2, "dy1": DY1, "dy2": DY2}  # their columns

LONG = np.longdouble
ULP = float(np.finfo(LONG).eps)
WAYS = {"k": K, "one_minus_k": ONE_MINUS_K, "amplitude": AMPLITUDE}
TOLERANCE = 1e-33


def solved(way, given, rates, rho, direction=1.0, oblate=False, tolerance=TOLERANCE):
    """Truth (N, COLUMNS): see `hill_flow.satellites`."""
    given, rho = np.broadcast_arrays(np.asarray(given, float), np.asarray(rho, float))

    def kernel(points, out):
        given, rho = (np.ascontiguousarray(x) for x in points.T)
        hill_flow.satellites(way, given, rates, rho, direction, oblate, tolerance, out)

    points = np.column_stack([given.ravel(), rho.ravel()])
    return remembered(
        ("satellites", way, rates, direction, oblate, tolerance), kernel, points, COLUMNS
    )


def satellite(way, inertia, direction, oblate, most=3e3):
    """The truth of satellites named by `way` and rho or inertia ratio, where |rho| <= `most` max(k,
    1): it is dear.
    """
    name = "inertia_ratio" if inertia else "rho"

    def truth(given, answer):
        rates = INERTIA if inertia else RHO
        ok = _tractable(given, way, name, most) & (answer["status"] == 0)
        values, other = (np.broadcast_to(given[x], ok.shape) for x in (way, name))
        out = np.full((ok.size, COLUMNS), np.nan)
        out[ok] = solved(WAYS[way], values[ok], rates, other[ok], float(direction), oblate)
        k = {"k": values, "one_minus_k": 1 - values, "amplitude": np.sin(values)}[way]
        rho = direction / np.sqrt(3 * np.abs(1 - other)) if inertia else other
        body = other > 1 if inertia else np.full(ok.shape, oblate)
        short = {
            "k": 1 - values,
            "one_minus_k": values,
            "amplitude": 2 * np.sin((pi / 2 - values + 6.123233995736766e-17) / 2) ** 2,
        }[way]
        found = hill_outputs(out, answer, True)
        found["period"] = 2 * out[:, END], 2 * out[:, END + 1], 1e-29 * out[:, END]
        grows, _low, doubt = found["exponent"]
        with np.errstate(all="ignore"):
            turns = _long(out, END) * 2 / (2 * LONG_PI) * _rho_long(rho, other, inertia)
            found["exponent_per_orbit"] = (
                grows / turns,
                0.0,
                doubt / turns + 8 * ULP * np.abs(grows / turns),
            )
        wrong = found["wrong"]
        wrong["lyapunov certifies what is not stable"] = (answer["lyapunov"] == 1) & found.pop(
            "unstable"
        )
        with np.errstate(invalid="ignore"):
            # its Runge-Kutta steps add up to an error of about 1e-4, which D feels times the
            # squares of the factors
            largest = np.abs(out[:, list(FACTOR_COLUMNS.values())]).max(axis=1)
            known = ok & (largest**2 < LOUD)
            off = np.abs(
                np.abs(answer["rotation_number"]) - rough_rotation(k, short, rho, body, known)
            )
            wrong["rotation number"] = known & (off > 0.08 + answer["rotation_number_error"])
        return found

    return truth


LOUD = 1e3  # squares of factors from which on a rough D says nothing
LONG_PI = LONG(3.141592653589793) + LONG(1.2246467991473532e-16)


def _rho_long(rho, alpha, inertia):
    if not inertia:
        return np.abs(rho).astype(LONG)
    return 1 / np.sqrt(3 * np.abs(1 - alpha.astype(LONG)))


def _tractable(given, way, name, most):
    """Points that are cheap enough to hold against the truth."""
    values, other = np.broadcast_arrays(
        np.asarray(given[way], float), np.asarray(given[name], float)
    )
    k = {"k": values, "one_minus_k": 1 - values, "amplitude": np.sin(values)}[way]
    with np.errstate(all="ignore"):
        rho = other if name == "rho" else 1 / np.sqrt(3 * np.abs(1 - other))
    return (
        np.isfinite(rho)
        & (np.abs(rho) / np.maximum(k, 1) <= most)
        & (values != {"k": 1.0, "one_minus_k": 0.0, "amplitude": 9.0}[way])
    )


def _long(out, column):
    """The number in this column and the next, high and low."""
    return out[:, column].astype(LONG) + out[:, column + 1]


def hill_outputs(out, answer, half):
    """What follows from the factors of `half` a period or of the whole, and which verdicts are wrong."""
    doubt = out[:, DOUBT]
    y1, y2, d1, d2 = (_long(out, column) for column in FACTOR_COLUMNS.values())
    found = {
        name: (out[:, column], out[:, column + 1], doubt) for name, column in FACTOR_COLUMNS.items()
    }
    with np.errstate(all="ignore"):
        if half:
            minus, plus = d1 * y2, y1 * d2  # (D - 2) / 4 and (D + 2) / 4
            dminus = doubt * (np.abs(d1) + np.abs(y2)) + 4 * ULP * np.abs(minus)
            dplus = doubt * (np.abs(y1) + np.abs(d2)) + 4 * ULP * np.abs(plus)
            trace = np.where(np.abs(minus) < np.abs(plus), 2 + 4 * minus, 4 * plus - 2)
            dtrace = 4 * np.minimum(dminus, dplus) + 4 * ULP * np.abs(trace)
        else:
            # the trace, and its distance from 2 and -2, in double-double
            high, low = _two(out[:, Y1], out[:, DY2])
            low = low + out[:, Y1 + 1] + out[:, DY2 + 1]
            trace = high.astype(LONG) + low
            minus, plus = ((high - 2).astype(LONG) + low) / 4, ((high + 2).astype(LONG) + low) / 4
            dminus = dplus = doubt
            dtrace = 2 * doubt + 2 * ULP * np.abs(trace)
        unstable = (minus > dminus) | (plus < -dplus)
        stable = (minus < -dminus) & (plus > dplus)
        growth = np.where(minus > 0, minus, np.where(plus < 0, -plus, 0))
        slack = np.where(minus > 0, dminus, np.where(plus < 0, dplus, np.minimum(dminus, dplus)))
        exponent = 2 * np.arcsinh(np.sqrt(growth))
        about = 2 * np.arcsinh(np.sqrt(growth + slack)) - 2 * np.arcsinh(
            np.sqrt(np.maximum(growth - slack, 0))
        )
        found["exponent"] = exponent, 0.0, about.astype(float) + 8 * ULP * exponent.astype(float)
        found["discriminant"] = trace, 0.0, dtrace.astype(float)
        theta = np.where(
            minus > 0,
            0,
            np.where(plus < 0, LONG_PI / 2, np.arctan2(np.sqrt(-minus), np.sqrt(plus))),
        )
        dtheta = _angle_doubt(minus, plus, dminus, dplus)
        fraction = theta / LONG_PI  # of theta / 2 pi, theta in [0, pi]
        said = answer["rotation_number"]
        whole_turns = (
            np.rint(np.asarray(said, LONG) - fraction),
            np.rint(np.asarray(said, LONG) + fraction),
        )
        near, other = whole_turns[0] + fraction, whole_turns[1] - fraction
        true = np.where(np.abs(near - said) < np.abs(other - said), near, other)
        found["rotation_number"] = true, 0.0, dtheta + 8 * ULP * (1 + np.abs(true).astype(float))
    verdict = answer["verdict"]
    found["wrong"] = {
        "verdict": ((verdict == 1) & unstable) | ((verdict == 0) & stable),
        "marginal": (verdict == 2)
        & ((minus < -dminus) | (minus > dminus))
        & ((plus < -dplus) | (plus > dplus)),
    }
    found["unstable"] = unstable
    return found


def _two(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _angle_doubt(minus, plus, dminus, dplus):
    """What the doubts make of theta / 2 pi."""
    with np.errstate(all="ignore"):
        ends = [
            np.arctan2(
                np.sqrt(np.maximum(-minus + s * dminus, 0)),
                np.sqrt(np.maximum(plus - s * dplus, 0)),
            )
            for s in (-1, 1)
        ]
        return (np.abs(ends[1] - ends[0]) / LONG_PI).astype(float)


def rough_rotation(k, short, rho, oblate, use):
    """The rotation number to about 0.05, by counting zeros of a solution in 20 periods."""
    out = np.empty(len(k))
    hill_flow.rough(*(np.ascontiguousarray(x, float) for x in (k, short, rho)), np.ascontiguousarray(oblate, bool),
           np.ascontiguousarray(use & (np.abs(short) > 1e-200) & (k < 1e6), bool), out)  # fmt: skip
    return out


def mathieu_solved(a, q):
    a, q = np.broadcast_arrays(np.asarray(a, float), np.asarray(q, float))
    points = np.column_stack([a, -2 * q, 0 * q, 0 * q])

    def kernel(points, out):
        quarter = np.tile([pi / 2, 6.123233995736766e-17], (len(points), 1))
        hill_flow.own_points(COSINE, points, np.full(len(points), np.inf), quarter, TOLERANCE, out)

    return remembered("mathieu", kernel, points, COLUMNS)


def mathieu(given, answer):
    out = mathieu_solved(given["a"], given["q"])
    found = hill_outputs(out, answer, True)
    found.pop("unstable")
    return found
