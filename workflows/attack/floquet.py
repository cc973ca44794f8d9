"""Points of linear periodic systems of one's own, held against systems whose monodromy matrix is
known exactly.

scaled      x' = (1 + c cos wt) B x, B = S L S^-1: M = S exp(G L) S^-1, G = T + c sin(wT) / w. S is a unimodular matrix
            of integers and L has blocks of few bits, so that float64 holds B exactly; constant
            systems have c = 0; blocks of two may be Jordan's, or nearly
damped      y'' + 2 c y' + z(t) y = 0: exp(-cT) times the solutions of v'' + (z - c^2) v = 0, in double-double
coupled     M q'' + K(t) q = 0, M = U'U, K = U' diag(z_i(t)) U: Hill equations that do not know of each other
"""

from functools import lru_cache
from math import cos, pi

import numpy as np
from mpmath import mp, mpc, mpf
from scipy.optimize import linear_sum_assignment

import survey
from attack.compare import Batch
from attack.hill import accuracy
from survey.truth import hill_flow
from survey.truth.hill import FACTOR_COLUMNS, TOLERANCE
from survey.truth.hill_flow import COLUMNS, HARMONICS, TWO_PI

DIGITS = 45
EXACT = mpf("1e-18")  # what a growth of 0 may be, by a trace of 30 digits
DOUBT = 1e-20  # multipliers that nearly meet follow from a trace of 30 digits
VARIABLES = [
    "multiplier_re",
    "multiplier_im",
    "spectral_radius",
    "exponent",
    "monodromy",
    "period",
    "verdict",
]
METHODS = ("auto", "auto", "auto", "auto", "taylor16", "dop853")
NAMES = ("a", "q", "s", "c", "T")


def chunk(random, size):
    return mixed(random, size, [_scaled, _scaled, _damped, _coupled], [1, 16, 40, 200])


def mixed(random, size, kinds, numbers):
    """Batches of these kinds, functions of (random, number, method, rtol), and numbers of points;
    `size` in all.
    """
    used = 0
    while used < size:
        kind = kinds[random.choice(len(kinds))]
        number, rtol, method = (
            int(random.choice(numbers)),
            accuracy(random),
            str(random.choice(METHODS)),
        )
        number = min(number, 4) if method == "dop853" else number
        yield kind(random, number, method, rtol)
        used += number


def _batch(kind, region, names, p, truth, scene, method, rtol, n):
    given = dict(zip(names, p.T, strict=True))
    variables = (
        VARIABLES if kind != "coupled" else [name for name in VARIABLES if name != "monodromy"]
    )
    how = f"{kind}_scene({n})"
    return Batch(
        f"floquet {kind}", region, given, truth, scene, {"variables": variables}, method, rtol, how
    )


# Scaled


@lru_cache(maxsize=8)
def scaled_scene(n):
    def A(t, p, out):
        for i in range(n):
            for j in range(n):
                out[i, j] = (1.0 + p[n * n] * cos(p[n * n + 1] * t)) * p[n * i + j]

    names = _names(n)
    return survey.floquet(
        A, period=lambda p: p[-1], parameters=names, states=[f"x{i}" for i in range(n)]
    )


def _names(n):
    return (*(f"b{i}_{j}" for i in range(n) for j in range(n)), "c", "w", "T")


def _unimodular(random, n, largest):
    """S and its inverse, of integers."""
    S, R = np.eye(n, dtype=object), np.eye(n, dtype=object)
    for _ in range(n):
        i, j = random.choice(n, 2, replace=False)
        k = int(random.integers(-largest, largest + 1))
        S[i] = S[i] + k * S[j]  # a shear E on the left; the inverse takes E^-1 on the right
        R[:, j] = R[:, j] - k * R[:, i]
    return S, R


def _blocks(random, n, region, period):
    """L in units of 2^-40, and the kinds of its blocks: [(first, kind)]."""
    unit, L, kinds, i = 2.0**40, np.zeros((n, n), dtype=object), [], 0
    while i < n:
        kind = str(
            random.choice(
                ["real", "turning", "defective", "near"] if region == "generic" else ["turning"]
            )
        )
        kind = kind if i + 1 < n else "real"
        growth = (
            random.uniform(-3, 1)
            if region != "edge"
            else random.normal() * 10 ** random.uniform(-12, -2)
        )
        growth = (
            int(np.rint(growth / period * 2.0**16)) << 24
            if region != "edge"
            else int(growth / period * unit)
        )
        turn = int(np.rint(random.uniform(-8, 8) / period * 2.0**16)) << 24
        L[i, i] = growth
        if kind != "real":
            L[i + 1, i + 1] = growth
            L[i, i + 1], L[i + 1, i] = (turn, -turn) if kind == "turning" else (int(unit), 0)
        if kind == "near":
            L[i + 1, i + 1] += int(2.0 ** random.uniform(0, 30)) * int(random.choice([-1, 1]))
        kinds.append((i, kind))
        i += 1 if kind == "real" else 2
    return L, kinds


def _entries(S, L, R):
    """Those of B = S L R, L in units of 2^-40; None if float64 does not hold them."""
    B = S.dot(L).dot(R).ravel()
    return None if any(int(float(x)) != x for x in B) else [float(x) * 2.0**-40 for x in B]


def _scaled(random, number, method, rtol):
    # 9 and 12 take long
    n = int(random.choice([2, 3, 4, 6, 9, 12], p=[0.3, 0.22, 0.26, 0.2, 0.01, 0.01]))
    region = str(random.choice(["generic", "generic", "edge", "constant"]))
    rows, known = [], {}
    while len(rows) < number:
        period = float(random.choice([1.0, 2 * pi, 0.3, 10.0]))
        S, R = _unimodular(
            random,
            n,
            int(random.choice([1, 3, 20], p=[0.4, 0.4, 0.2] if n < 6 else [0.6, 0.39, 0.01])),
        )
        L, kinds = _blocks(random, n, "edge" if region == "edge" else "generic", period)
        B = _entries(S, L, R)
        if B is None:
            continue
        c = 0.0 if region == "constant" else float(random.uniform(-3, 3))
        w = 2 * pi * int(random.integers(1, 5)) / period
        row = [*B, c, w, period]
        known[tuple(row)] = S, R, L, kinds
        rows.append(row)

    def truth(given, answer):
        p = np.column_stack([given[name] for name in _names(n)])
        return _compared(answer, [_flow(n, row, known[tuple(row)]) for row in p], p[:, -1])

    return _batch(
        "scaled",
        f"{region} {n}",
        _names(n),
        np.array(rows),
        truth,
        scaled_scene(n),
        method,
        rtol,
        n,
    )


def _flow(n, row, parts):
    """(multipliers, their largest logarithm of modulus, M, are multipliers known when M is off a little?)."""
    S, R, L, kinds = parts
    with mp.workdps(DIGITS):
        c, w, period = (mpf(x) for x in row[-3:])
        G, unit = period + c * mp.sin(w * period) / w, mpf(2) ** -40
        E, found, growths = mp.zeros(n), [], []
        for i, kind in kinds:
            grown = mp.exp(int(L[i, i]) * unit * G)
            growths.append(int(L[i, i]) * unit * G)
            turn = int(L[i, i + 1]) * unit * G if kind != "real" else mpf(0)
            if kind == "real":
                E[i, i] = grown
                found.append(mpc(grown))
            elif kind == "near":
                other = mp.exp(int(L[i + 1, i + 1]) * unit * G)
                growths.append(int(L[i + 1, i + 1]) * unit * G)
                E[i, i], E[i + 1, i + 1] = grown, other
                E[i, i + 1] = (other - grown) * turn / (growths[-1] - growths[-2])
                found += [mpc(grown), mpc(other)]
            elif kind == "defective":
                E[i, i] = E[i + 1, i + 1] = grown
                E[i, i + 1] = grown * turn
                found += [mpc(grown)] * 2
            else:
                E[i, i] = E[i + 1, i + 1] = grown * mp.cos(turn)
                E[i, i + 1] = grown * mp.sin(turn)
                E[i + 1, i] = -E[i, i + 1]
                found += [grown * mp.expj(turn), grown * mp.expj(-turn)]
        whole = [[sum(int(S[i, k]) * E[k, m] * int(R[m, j]) for k in range(n) for m in range(n) if E[k, m])
                  for j in range(n)] for i in range(n)]  # fmt: skip
        return found, max(growths), whole


# Hill's equations with damping, and coupled


@lru_cache(maxsize=1)
def damped_scene(_n=2):
    def A(t, p, out):
        x = TWO_PI * t / p[4]
        out[0, 1], out[1, 1] = 1.0, -2.0 * p[3]
        out[1, 0] = -(p[0] + p[1] * cos(x) + p[2] * cos(2.0 * x))

    return survey.floquet(A, period=lambda p: p[4], parameters=NAMES, states=("y", "v"))


def _waves(random, number, period):
    """a, q, s of z = a + q cos x + s cos 2x, with so few bits that a - c^2 is exact."""
    unit = (pi / period) ** 2
    a = random.uniform(-1, 12, number) * unit
    q = (
        random.uniform(-1, 1, number)
        * np.minimum(50.0, 300 * unit)
        * 10 ** -random.uniform(0, 6, number)
    )
    s = q * random.uniform(-1, 1, number) * (random.random(number) < 0.5)
    return np.round(a * 2.0**20) / 2.0**20, q, s


def _solutions(a, q, s, period):
    """M of v'' + z v = 0 as [[y1, y2], [y1', y2']], and its doubt, of each point."""
    p = np.zeros((len(a), 10))
    p[:, 0], p[:, 1], p[:, 2], p[:, 9] = a, q, s, period
    out = np.empty((len(a), COLUMNS))
    ends = np.full(len(a), np.inf)
    hill_flow.own_points(HARMONICS, p, ends, np.column_stack([p[:, 9], 0 * a]), TOLERANCE, out)
    with mp.workdps(DIGITS):  # the two halves of a double-double
        flows = [
            tuple(mpf(row[c]) + mpf(row[c + 1]) for c in FACTOR_COLUMNS.values()) for row in out
        ]
    return flows, out[:, hill_flow.DOUBT]


def _of_trace(trace):
    """The two multipliers whose product is 1."""
    root = mp.sqrt(mpc(trace * trace - 4))
    one = (trace + root) / 2 if trace > 0 else (trace - root) / 2
    return [one, 1 / one]


def _damped(random, number, method, rtol):
    period = float(random.choice([pi, 1.0, 5.0]))
    a, q, s = _waves(random, number, period)
    c = np.round(random.uniform(-0.2, 1.5, number) / period * 2.0**10) / 2.0**10
    c[random.random(number) < 0.2] = 0.0
    p = np.column_stack([a + c * c, q, s, c, np.full(number, period)])

    def truth(given, answer):
        p = np.column_stack([given[name] for name in NAMES])
        flows, _doubts = _solutions(p[:, 0] - p[:, 3] ** 2, p[:, 1], p[:, 2], p[:, 4])
        found = []
        with mp.workdps(DIGITS):
            for (y1, y2, d1, d2), row in zip(flows, p, strict=True):
                c, T = mpf(row[3]), mpf(row[4])
                loss = mp.exp(-c * T)
                pair = [loss * x for x in _of_trace(y1 + d2)]
                M = [[y1 + c * y2, y2], [d1 - c * y1 + c * (d2 - c * y2), d2 - c * y2]]
                M = [[loss * x for x in line] for line in M]
                found.append((pair, max(mp.log(abs(x)) for x in pair), M))
        return _compared(answer, found, p[:, 4])

    return _batch("damped", "generic", NAMES, p, truth, damped_scene(2), method, rtol, 2)


@lru_cache(maxsize=2)
def coupled_scene(m):
    """Parameters: a, q, s of each, the entries of U below its diagonal of ones, T."""

    def U(p):
        entries = iter(p[3 * m : -1])
        return [
            [1.0 if i == j else next(entries) if j < i else 0.0 for j in range(m)] for i in range(m)
        ]

    def between(u, i, j, d):
        return sum(u[k][i] * u[k][j] * d[k] for k in range(max(i, j), m))

    def M(t, p, out):
        u = U(p)
        for i in range(m):
            for j in range(m):
                out[i, j] = between(u, i, j, [1.0] * m)

    def K(t, p, out):
        u, x = U(p), TWO_PI * t / p[-1]
        z = [p[3 * k] + p[3 * k + 1] * cos(x) + p[3 * k + 2] * cos(2.0 * x) for k in range(m)]
        for i in range(m):
            for j in range(m):
                out[i, j] = between(u, i, j, z)

    given = {"period": lambda p: p[-1], "parameters": _coupled_names(m), "structure": "symplectic"}
    return survey.floquet(M=M, K=K, states=[f"q{i}" for i in range(m)], **given)


def _coupled_names(m):
    return (
        *(f"{name}{k}" for k in range(m) for name in "aqs"),
        *(f"u{k}" for k in range(m * (m - 1) // 2)),
        "T",
    )


def _coupled(random, number, method, rtol):
    m, period = (
        int(random.choice([2, 3, 6], p=[0.6, 0.39, 0.01])),
        float(random.choice([pi, 1.0, 5.0])),
    )
    waves = [np.column_stack(_waves(random, number, period)) for _ in range(m)]
    if random.random() < 0.2:
        waves[1][:, 0] = waves[0][:, 0]  # multipliers that meet, or nearly
    u = random.integers(-3, 4, (number, m * (m - 1) // 2)).astype(float)
    p = np.column_stack([*waves, u, np.full(number, period)])

    def truth(given, answer):
        p = np.column_stack([given[name] for name in _coupled_names(m)])
        parts = [_solutions(*p[:, 3 * k : 3 * k + 3].T, p[:, -1])[0] for k in range(m)]
        found = []
        with mp.workdps(DIGITS):
            for flows in zip(*parts, strict=True):
                all_of = [x for y1, _y2, _d1, d2 in flows for x in _of_trace(y1 + d2)]
                growth = max(mp.log(abs(x)) for x in all_of)
                found.append((all_of, growth if growth > mpf(10) ** -20 else mpf(0), None))
        return _compared(answer, found, p[:, -1], strict=False)

    return _batch(
        "coupled", str(2 * m), _coupled_names(m), p, truth, coupled_scene(m), method, rtol, m
    )


# What is compared


def _compared(answer, found, period, strict=True):
    """The truth of all outputs; the multipliers are matched to those of the answer."""
    n, size = answer["multiplier_re"].shape[1], len(found)
    re, im = np.full((2, size, n), np.nan), np.full((2, size, n), np.nan)
    radius, exponent = np.full((2, size), np.nan), np.full((2, size), np.nan)
    M = np.full((2, size, n, n), np.nan)
    wrong = np.zeros(size, bool)
    with mp.workdps(DIGITS):
        for i, (true, growth, matrix) in enumerate(found):
            said, ok = answer["verdict"][i], answer["status"][i] == 0
            wrong[i] = (said == 1 and (growth >= 0 if strict else growth > 0)) or (
                said == 0 and growth <= 0
            )
            wrong[i] |= said == 2 and abs(growth) > EXACT
            if not ok:
                continue
            theirs = answer["multiplier_re"][i] + 1j * answer["multiplier_im"][i]
            off = np.array([[float(abs(mpc(x) - y)) for y in true] for x in theirs.tolist()])
            bars = np.maximum(answer["multiplier_re_error"][i].astype(float), 1e-300)
            rows, columns = linear_sum_assignment(np.minimum(off / bars[:, None], 1e9))
            for k, j in zip(rows, columns, strict=True):
                re[:, i, k], im[:, i, k] = _pair(true[j].real), _pair(true[j].imag)
            radius[:, i], exponent[:, i] = _pair(mp.exp(growth)), _pair(growth / mpf(period[i]))
            if matrix is not None:
                for a in range(n):
                    for b in range(n):
                        M[:, i, a, b] = _pair(mpf(matrix[a][b]))
    out = {
        "multiplier_re": re,
        "multiplier_im": im,
        "spectral_radius": radius,
        "exponent": exponent,
    }
    out |= {"monodromy": M} if "monodromy" in answer else {}
    doubted = {name: (high, low, DOUBT * (1 + abs(high))) for name, (high, low) in out.items()}
    return doubted | {"wrong": {"verdict": wrong}}


def _pair(x):
    high = float(x)
    return high, float(x - high) if np.isfinite(high) else 0.0
