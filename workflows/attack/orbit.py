"""Periodic orbits of one's own, held against orbits that are known, with multipliers that are known
to 45 digits.

forced      y = x - h(t), h_i = c cos(2 pi t / T + i):  y' = B y + s (y_i y_{i+1} + y_i^3).  The orbit is h, and its
            multipliers are those of the constant matrix B (see `attack.floquet`). Where B has an
            eigenvalue near 0 other orbits may be as near, so that s is 0 there
rotating    y1 and y2 rotate: r' = r (m - r^2), with the angular velocity v (1 + k r^2); further ones follow them,
            y_i' = g_i y_i + (r^2 - m) y_1.  The orbit is r^2 = m, with multipliers exp(-2 m T) and exp(g_i T). All is
            seen in curved coordinates: x_i = y_i + e y_1 y_{i-1} + e sin y_{i-1}, x_1 = y_1

Newton's method begins beside the orbit. An answer about another orbit, farther from it than NEAR,
is not compared.
"""

from functools import lru_cache

import numpy as np
from mpmath import mp, mpf

import survey
from attack.compare import Batch
from attack.floquet import DIGITS, _blocks, _compared, _entries, _flow, _pair, _unimodular, mixed
from survey.truth.hill_flow import TWO_PI

NEAR = 1e-3
LEAST = 0.02  # growth per time of an eigenvalue beside which there may be other orbits
DOUBT = 1e-15  # of x0: the period of float64 is not quite that of h
VARIABLES = [
    "multiplier_re",
    "multiplier_im",
    "spectral_radius",
    "exponent",
    "x0",
    "period",
    "verdict",
]


def chunk(random, size):
    return mixed(random, size, [_forced, _rotating], [1, 4, 16, 40])


def _batch(kind, region, names, p, truth, scene, method, rtol, n):
    given = dict(zip(names, np.array(p).T, strict=True))
    how = f"{kind}_scene({n})"
    return Batch(
        f"orbit {kind}", region, given, truth, scene, {"variables": VARIABLES}, method, rtol, how
    )


# Forced


@lru_cache(maxsize=4)
def forced_scene(n):
    def f(t, x, p, out):
        c, s, w = p[n * n], p[n * n + 1], TWO_PI / p[n * n + 3]
        y = [x[i] - c * np.cos(w * t + i) for i in range(n)]
        for i in range(n):
            total = -c * w * np.sin(w * t + i) + s * (y[i] * y[(i + 1) % n] + y[i] * y[i] * y[i])
            for j in range(n):
                total = total + p[n * i + j] * y[j]
            out[i] = total

    def start(p):
        return p[n * n] * np.cos(np.arange(n)) + p[n * n + 2]

    states = [f"x{i}" for i in range(n)]
    return survey.orbit(f, period=lambda p: p[-1], parameters=_names(n), states=states, start=start)


def _names(n):
    return (*(f"b{i}_{j}" for i in range(n) for j in range(n)), "c", "s", "off", "T")


def _forced(random, number, method, rtol):
    n, region = int(random.choice([2, 3, 4])), str(random.choice(["generic", "edge"]))
    rows, known = [], {}
    while len(rows) < number:
        period = float(random.choice([1.0, TWO_PI, 0.3]))
        S, R = _unimodular(random, n, int(random.choice([1, 3])))
        L, kinds = _blocks(random, n, region, period)
        B = _entries(S, L, R)
        if B is None:
            continue
        alone = region == "edge" or min(abs(float(L[i, i])) * 2.0**-40 for i in range(n)) < LEAST
        c, s = random.uniform(-2, 2), 0.0 if alone else random.uniform(-1, 1)
        row = [*B, c, s, 10 ** random.uniform(-9, -4), period]
        known[tuple(row)] = S, R, L, kinds
        rows.append(row)

    def truth(given, answer):
        p = np.column_stack([given[name] for name in _names(n)])
        found = [
            (*_flow(n, [*row[: n * n], 0.0, 1.0, row[-1]], known[tuple(row)])[:2], None)
            for row in p
        ]
        with mp.workdps(DIGITS):
            at = [[mpf(row[n * n]) * mp.cos(i) for i in range(n)] for row in p]
        return _near(answer, found, p[:, -1], at)

    return _batch(
        "forced", f"{region} {n}", _names(n), rows, truth, forced_scene(n), method, rtol, n
    )


# Rotating


@lru_cache(maxsize=4)
def rotating_scene(n):
    def f(t, x, p, out):
        m, v, k, e = p[0], p[1], p[2], p[3]
        y = [x[0]]
        for i in range(1, n):
            y.append(x[i] - e * (y[0] * y[i - 1] + np.sin(y[i - 1])))
        r = y[0] * y[0] + y[1] * y[1]
        turn = v * (1.0 + k * r)
        slope = [y[0] * (m - r) - turn * y[1], y[1] * (m - r) + turn * y[0]]
        for i in range(2, n):
            slope.append(p[3 + i] * y[i] + (r - m) * y[0])
        out[0] = slope[0]
        for i in range(1, n):
            curved = slope[0] * y[i - 1] + y[0] * slope[i - 1] + np.cos(y[i - 1]) * slope[i - 1]
            out[i] = slope[i] + e * curved

    def start(p):
        y = np.zeros(n)
        y[0] = np.sqrt(p[0]) * (1.0 + p[4])
        x = y.copy()
        for i in range(1, n):
            x[i] += p[3] * (y[0] * y[i - 1] + np.sin(y[i - 1]))
        return np.append(x, TWO_PI / (p[1] * (1.0 + p[2] * p[0])))

    return survey.orbit(
        f,
        period=None,
        parameters=_rotating_names(n),
        states=[f"x{i}" for i in range(n)],
        start=start,
    )


def _rotating_names(n):
    return ("m", "v", "k", "e", "off", *(f"g{i}" for i in range(2, n)))


def _rotating(random, number, method, rtol):
    n, region = int(random.choice([2, 3, 4])), str(random.choice(["generic", "edge"]))
    names, rows = _rotating_names(n), []
    # their powers of ten
    growths, sizes = ((-3, -0.3), (-2, 0.2)) if region == "generic" else ((-13, -3), (-4, -2))
    for _ in range(number):
        growth = random.choice([-1, 1], n - 2) * 10 ** random.uniform(*growths, n - 2)
        m = 10 ** random.uniform(*sizes)
        rows.append([m, random.uniform(0.5, 2), random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3),
                     random.choice([-1, 1]) * 10 ** random.uniform(-9, -3), *growth])  # fmt: skip

    def truth(given, answer):
        found, periods = [], []
        with mp.workdps(DIGITS):
            for row in np.column_stack([given[name] for name in names]):
                m, v, k = (mpf(x) for x in row[:3])
                T = 2 * mp.pi / (v * (1 + k * m))
                rates = [-2 * m, *(mpf(g) for g in row[5:])]
                found.append(([mp.mpc(mp.exp(rate * T)) for rate in rates], max(rates) * T, None))
                periods.append(T)
        out = _near(answer, found, periods, None)
        high, low = np.array([_pair(T) for T in periods]).T
        return out | {"period": (high, low, 1e-20 * high)}

    return _batch(
        "rotating", f"{region} {n}", names, rows, truth, rotating_scene(n), method, rtol, n
    )


# What is compared


def _near(answer, found, periods, at):
    """The truth of all outputs, NaN where another orbit was found; `at` (N, n): x0, if it is known."""
    out = _compared(answer, found, periods)
    if at is None:
        return out
    high, low = (np.array([[_pair(x)[k] for x in row] for row in at]) for k in (0, 1))
    with np.errstate(invalid="ignore"):
        far = ~(abs(answer["x0"] - high).max(axis=1) < NEAR)
    for name in out.keys() - {"wrong"}:
        out[name][0][far] = np.nan
    out["wrong"]["verdict"] &= ~far
    high[far] = np.nan
    return out | {"x0": (high, low, DOUBT * (1.0 + abs(high)))}
