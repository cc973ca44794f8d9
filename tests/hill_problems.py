"""Problems and references that the tests of Hill's equation share."""

import json
from importlib import resources

import numpy as np
from mpmath import mp, mpf

from survey.kernels.hill import taylor_double
from survey.kernels.hill.answers import NO_RULE, ON_EDGE
from survey.measures.hill import monodromy
from survey.scene import Request
from survey.scenes import satellite

BODY = {"PL": "prolate", "PR": "prolate", "OL": "oblate", "OR": "oblate"}
REFERENCE = json.loads(resources.files("survey.reference").joinpath("satellite.json").read_text())


def cases(*groups):
    return [case for group in groups for case in REFERENCE[group]]


def solve(body="prolate", method="auto", rtol=1e-10, **point):
    point = {name: np.atleast_1d(np.asarray(values, dtype=float)) for name, values in point.items()}
    names = frozenset(output.name for output in satellite.OUTPUTS)
    return satellite.solve(point, Request({"body": body}, method, rtol, names))


def factors(body, rho, low=0.0, **modulus):
    """The ten results of one point of the satellite, by the double-double kernel itself (held
    against mpmath).
    """
    shared = satellite.moduli({name: np.array([[value]]) for name, value in modulus.items()})
    row = satellite.Motion(*(np.ravel(values) for values in shared), body == "oblate")
    problem = satellite._problem(row, np.array([[rho]]))
    phase, distance = taylor_double.hill_density()
    steps = 2 * np.ceil(
        0.5 * row.period / 2 * np.maximum(phase * (abs(rho) + row.k + 1), distance * row.rate)
    )
    return problem.exact(
        np.zeros(1, int), np.array([rho]), np.array([low]), steps.astype(np.int64)
    )[0]


def truth(case):
    """The outputs of a reference case, as mpf."""
    names = {
        "y1": "y1_half",
        "y2": "y2_half",
        "dy1": "dy1_half",
        "dy2": "dy2_half",
        "period": "T",
        "discriminant": "Delta",
    }
    with mp.workdps(40):
        known = {name: mpf(case[key]) for name, key in names.items()}
        known["exponent"] = mpf(0) if case["stable"] else mp.acosh(abs(known["discriminant"]) / 2)
        known["rotation_number"] = rotation(
            known["discriminant"], case["zeros_y1_half"] + case["zeros_y2_half"]
        )
    return known


def rotation(discriminant, zeros):
    """theta_total / 2 pi from the discriminant and the zeros of y1 and y2 in T / 2 (see satellite.md)."""
    if abs(discriminant) >= 2:
        return mpf(zeros + ((zeros % 2 == 1) != (discriminant < 0))) / 2
    theta = mp.acos(discriminant / 2)
    return (zeros * mp.pi + (mp.pi - theta if zeros % 2 else theta)) / (2 * mp.pi)


def mathieu(a, q, half_periods=1):
    """y'' + (a - 2 q cos 2t) y = 0 as a Hill problem: rows of q, lanes of a."""
    half = half_periods * np.pi / 2
    a, q = np.atleast_2d(np.asarray(a, dtype=float)), np.asarray(q, dtype=float)
    a = np.broadcast_to(a, (q.size, a.shape[1]))

    def sample(rows, nodes, steps):
        t = (np.arange(steps)[:, None] + nodes) * (half / steps)
        out = np.ones((rows.size, steps, 2, nodes.size))
        out[:, :, 0] = -2 * q[rows][:, None, None] * np.cos(2 * t)
        return out

    rule = np.where(
        (q[:, None] == 0) & (np.sqrt(abs(a)) == np.rint(np.sqrt(abs(a)))) & (a >= 0),
        ON_EDGE,
        NO_RULE,
    )
    rule = np.where(
        (q[:, None] == 0) & (np.sqrt(abs(a)) == np.rint(np.sqrt(abs(a)))) & (a >= 0),
        ON_EDGE,
        NO_RULE,
    )
    sizes = monodromy.RowSizes(
        span=np.full(len(a), half),
        bound=np.column_stack([2 * abs(q), np.ones(len(a)), np.zeros(len(a))]),
        rate=np.full(len(a), 2.0),
    )
    return monodromy.Problem(
        p=a.copy(), sizes=lambda: sizes, c2=0.0, sample=sample, rule=rule.astype(np.int8)
    )


def mp_factors(family, k, rho, digits=30):
    """y1, y1', y2, y2' at T/2 and the zeros of y1, y2 inside, by Taylor series with mpmath: nothing
    shared with survey.

    sn, cn, dn and both solutions are carried by their own differential equations, to an order of
    one for each digit.
    """
    with mp.workdps(digits):
        k, rho, order = mpf(k), mpf(rho), digits
        rotates = family in ("PR", "OR")
        m, scale = (1 / k**2, k) if rotates else (k**2, mpf(1))
        c = 1 - k**2 if family in ("PL", "PR") else -(k**2)
        span = mp.ellipk(m) / k if rotates else 2 * mp.ellipk(m)
        steps = int(mp.ceil(span * (1 + k + abs(rho)) / mpf("0.3")))
        h = span / steps
        state = [mpf(v) for v in (0, 1, 1, 1, 0, 0, 1)]
        zeros = [0, 0]
        for _ in range(steps):
            new = _mp_step(state, h, scale, m, k, rho, c, rotates, order)
            zeros = [
                n + ((new[i] < 0) != (state[i] < 0)) for n, i in zip(zeros, (3, 5), strict=True)
            ]
            state = new
        return (*state[3:], *zeros)


def _mp_step(state, h, scale, m, k, rho, c, rotates, order):
    sn, cn, dn = ([v] for v in state[:3])
    y = [[state[3], state[4]], [state[5], state[6]]]
    z = []
    for n in range(order):

        def product(a, b, n=n):
            return mp.fdot(a[: n + 1], b[n::-1])

        w = [k * v for v in (dn if rotates else cn)]
        z.append(2 * product(w, w) + 2 * rho * w[n] + (rho**2 + c if n == 0 else 0))
        cd, sd, sc = product(cn, dn), product(sn, dn), product(sn, cn)
        sn.append(scale * cd / (n + 1))
        cn.append(-scale * sd / (n + 1))
        dn.append(-scale * m * sc / (n + 1))
        for series in y:
            series.append(-product(z, series) / ((n + 1) * (n + 2)))
    ends = [_value(series, h) for series in (sn, cn, dn)]
    for series in y:
        slope = [j * v for j, v in enumerate(series)][1:]
        ends += [_value(series, h), _value(slope, h)]
    return ends


def _value(series, h):
    total = mpf(0)
    for coefficient in reversed(series):
        total = total * h + coefficient
    return total
