"""Points of Brun's problem: states and scaled integrals, about poles, separatrices, precessions, without field."""

import importlib
import sys
from math import pi
from pathlib import Path

import numpy as np
from mpmath import mp

from attack import brun_truth
from attack.compare import Batch
from attack.hill import accuracy

NAMES = ("A", "C", "epsilon", "theta0", "p_theta0", "p_psi", "p_phi")
METHODS = ("auto", "auto", "auto", "agm", "carlson", "chebyshev")
OUTPUTS = ("u_min", "u_max", "period", "precession", "spin", "action")
STATES = ("any", "pole +1", "pole -1", "passing closely", "pole passage", "tiny field", "no field", "fast spin",
          "no spin", "regular precession", "saddle", "upright", "special", "large")  # fmt: skip
SURE = 1e-20
NODES = 2048
DIGITS = 120
LOST = 0.1  # a truth with a larger doubt than this of itself knows no side of the separatrix


def chunk(random, size):
    used = 0
    while used < size:
        method, rtol = str(random.choice(METHODS)), accuracy(random)
        number = int(random.choice([1, 16 if method == "chebyshev" else 64]))
        if random.random() < 0.6:
            kind, points = _states(random, number)
            yield Batch(
                "brun states", kind, dict(zip(NAMES, points.T, strict=True)), _of_states, "brun", {}, method, rtol
            )
        else:
            kind, sign, points = _integrals(random, number)
            ratio = float(random.choice([0.5, 1.0, 2.0, 1e-3, random.uniform(0.01, 2)]))
            given = dict(zip(("l", "alpha", "beta"), points.T, strict=True)) | {"ratio": ratio}
            yield Batch("brun integrals", kind, given, _of_integrals(sign), "brun", {"sign": str(sign)}, method, rtol)
        used += number


def _states(random, number):
    """(region, (N, 7))."""
    kind = str(random.choice(STATES))
    signs = random.choice([-1.0, 1.0], (4, number))
    A, C = 10 ** random.uniform(-0.5, 0.5, number), random.uniform(0.02, 1.999, number)
    epsilon = signs[0] * 10 ** random.uniform(-6, 1, number)
    theta = random.uniform(0.01, 3.13, number)
    p, b, a = random.normal(size=(3, number))
    k = epsilon * A * A * (1 - C)
    close = 1 + signs[1] * 10 ** -random.uniform(2, 16, number)
    if kind == "pole +1":
        theta, b = 10 ** -random.uniform(1, 12, number), a * close
    elif kind == "pole -1":
        theta, b = pi - 10 ** -random.uniform(1, 12, number), -a * close
    elif kind == "passing closely":
        b = signs[2] * a * close
    elif kind == "pole passage":
        b = signs[2] * a
        theta = np.where((random.random(number) < 0.3) & (signs[2] > 0), 0.0, theta)
    elif kind == "tiny field":
        epsilon = signs[0] * 10 ** -random.uniform(5, 24, number)
    elif kind == "no field":
        epsilon, C = (np.zeros(number), C) if random.random() < 0.5 else (epsilon, np.ones(number))
    elif kind == "fast spin":
        a = a * 10 ** random.uniform(1, 8, number)
    elif kind == "no spin":
        a, b = np.where(signs[1] > 0, 0.0, a), np.where(signs[1] > 0, b, 0.0)
    elif kind in ("regular precession", "saddle"):
        k = np.abs(k) if kind == "saddle" else k
        u = random.uniform(-0.33, 0.33, number) if kind == "saddle" else random.uniform(-0.99, 0.99, number)
        y = signs[1] * np.sqrt(np.abs(k)) * 10 ** random.uniform(-0.4, 0.7, number)
        if kind == "saddle":
            wide = k / 2 * np.sqrt((1 - u * u) * (1 - 9 * u * u))
            y = signs[1] * np.sqrt(k / 2 * (1 - 3 * u * u) + wide * random.uniform(-1, 1, number))
        a, b, theta = u * (y - k / y), y - k * u * u / y, np.arccos(u)
        p = 10 ** -random.uniform(1, 15, number) * np.where(random.random(number) < 0.05, 0.0, 1.0)
        epsilon = k / (A * A * (1 - C))
    elif kind == "upright":
        k = -np.abs(k)
        a, epsilon = random.uniform(-2.5, 2.5, number) * np.sqrt(-k), k / (A * A * (1 - C))
        theta, p, b = 10 ** -random.uniform(2, 9, number), 10 ** -random.uniform(2, 9, number), a * close
    elif kind == "special":
        theta = random.choice([pi / 2, pi / 3, 1.0, 0.5, 3.0, 2.0], number)
        p, b, a = (random.choice([0.0, 1.0, -1.0, 0.5, 2.0], number) for _ in range(3))
        A, C, epsilon = (
            random.choice(x, number) for x in ([1.0, 2.0, 0.5], [0.5, 1.0, 2.0, 0.25], [1.0, -1.0, 0.5, 0.0])
        )
    elif kind == "large":
        scale = 10 ** random.uniform(-10, 10, number)
        p, b, a, epsilon = p * scale, b * scale, a * scale, epsilon * scale * scale
    return kind, np.column_stack([A, A * C, epsilon, theta, p, b, a])


def _integrals(random, number):
    """(region, sign, (N, 3))."""
    kind = str(
        random.choice(
            [
                "any",
                "passing closely",
                "regular precession",
                "saddle",
                "upright",
                "fast spin",
                "tiny field",
                "cusp",
                "special",
            ]
        )
    )
    sign = int(random.choice([-1, 1]))
    side = random.choice([-1.0, 1.0], (2, number))
    alpha, beta = random.normal(size=(2, number))
    close = 10 ** -random.uniform(2, 15, number)
    u, y = random.uniform(-0.99, 0.99, number), side[0] * 10 ** random.uniform(-0.4, 0.7, number)
    if kind in ("saddle", "cusp"):
        sign, u = 1, random.uniform(-0.33, 0.33, number)
        wide = 0.5 * np.sqrt((1 - u * u) * (1 - 9 * u * u)) * random.uniform(-1, 1, number)
        if kind == "cusp":
            wide = wide * 10 ** -random.uniform(3, 16, number) + 0.5 * np.sqrt((1 - u * u) * (1 - 9 * u * u)) * side[1]
        y = side[0] * np.sqrt(np.maximum(0.5 * (1 - 3 * u * u) + wide, 1e-6))
    if kind in ("saddle", "cusp", "regular precession"):
        alpha, beta = u * (y - sign / y), y - sign * u * u / y
        level = y * y * (1 - u * u) - sign * u * u + alpha * alpha
        level = level + close * side[1] * np.maximum(1.0, np.abs(level))
        return kind, sign, np.column_stack([level, alpha, beta])
    if kind == "passing closely":
        beta = side[0] * alpha * (1 + close * side[1])
    elif kind == "upright":
        beta = side[0] * alpha * (1 + close)
        return kind, sign, np.column_stack([alpha * alpha - sign + random.uniform(0, 100, number) * close, alpha, beta])
    elif kind == "fast spin":
        alpha = alpha * 10 ** random.uniform(1, 8, number)
    elif kind == "tiny field":
        large = 10 ** random.uniform(2, 9, number)
        alpha, beta = large * alpha, large * beta
    elif kind == "special":
        alpha, beta = (random.choice([0.0, 1.0, -1.0, 0.5, 2.0], number) for _ in range(2))
        return kind, sign, np.column_stack([random.choice([0.0, 1.0, 2.0, 3.0, 0.5, 4.0, -0.25], number), alpha, beta])
    level = np.maximum(alpha * alpha, beta * beta) * (1 + 10 ** random.uniform(-3, 1, number)) + random.uniform(
        -1, 1, number
    )
    return kind, sign, np.column_stack([level, alpha, beta])


def _rows(out, answer):
    found = {}
    with np.errstate(all="ignore"):
        beside = out[..., 13]
        delay = beside * out[..., 4]
        turned = 2 * pi * beside + (np.abs(out[..., 6]) + np.abs(out[..., 8])) * beside + delay * out[..., 16]
    more = {"u_min": out[..., 14], "u_max": out[..., 15], "period": delay, "precession": turned, "spin": turned}
    for i, name in enumerate(OUTPUTS):
        value, low = out[..., 2 * i], out[..., 2 * i + 1]
        scale = np.abs(value)
        if name in ("u_min", "u_max"):
            scale = scale + 1
        if name in ("precession", "spin"):
            scale = scale + 2 * pi * (1 + np.abs(out[..., 6]))
        if name == "action":  # of a narrow well
            half = (out[..., 2] - out[..., 0]) / 2
            scale = scale * (1 + (1e-11 if out.ndim == 3 else 1e-21) / half / np.where(out.ndim == 3, half, 1))
        with np.errstate(invalid="ignore"):
            trusted = np.abs(out[..., 12]) < 1e-18 if name not in ("u_min", "u_max", "period") else True
        trusted = trusted & (beside < LOST)
        found[name] = np.where(trusted, value, np.nan), low, SURE * scale + more.get(name, 0.0)
    return found


def _in_full(point, ends):
    """The outputs at a state with DIGITS digits, from elliptic integrals, as `brun_truth.states`: it takes 0.1 s.

    `ends` are the turning points of double-double, u_min (high, low), u_max (high, low), where Newton's method begins.
    """
    tests = str(Path(__file__).parents[2] / "tests")
    if tests not in sys.path:
        sys.path.append(tests)
    full = importlib.import_module("brun_truth")
    row = np.zeros(brun_truth.COLUMNS)
    with mp.workdps(DIGITS):
        state = [mp.mpf(float(x)) for x in point]
        integrals = full.integrals(state)
        turning = full.polished(integrals, [mp.mpf(ends[0]) + mp.mpf(ends[1]), mp.mpf(ends[2]) + mp.mpf(ends[3])])
        for i, true in enumerate(full.outputs(integrals, turning)):
            row[2 * i] = float(true)
            row[2 * i + 1] = float(true - row[2 * i])
    return row


def _of_states(given, answer):
    points = np.ascontiguousarray(np.column_stack([given[name] for name in NAMES]))
    ok = answer["status"] == 0
    out = np.full((len(points), brun_truth.COLUMNS), np.nan)
    brun_truth.states(points[ok], NODES, part := out[ok])
    out[ok] = part
    with np.errstate(invalid="ignore"):
        vague = ok & (out[:, 13] * out[:, 4] > answer["period_error"]) & (out[:, 13] < LOST)
        vague = np.flatnonzero(vague & (given["p_theta0"] != 0))
    if len(vague):  # one of a batch in full
        out[vague[0]] = _in_full(points[vague[0]], out[vague[0], :4])
    width = answer["u_max"] - answer["u_min"]
    with np.errstate(invalid="ignore"):
        sure = out[:, 13] < LOST
        apart = sure & ((out[:, 2] - out[:, 0]) > 2 * (answer["u_max_error"] + answer["u_min_error"]) + 1e-12)
        said = answer["verdict"]
        passes = (given["p_psi"] == given["p_phi"]) | (given["p_psi"] == -given["p_phi"])
        wrong = ((said == 2) & apart) | ((said == 3) & ~passes) | (ok & (width < 0))
    return _rows(out, answer) | {"wrong": {"verdict": wrong}}


def _of_integrals(sign):
    def truth(given, answer):
        points = np.ascontiguousarray(np.column_stack([given[name] for name in ("l", "alpha", "beta")]))
        ok = answer["status"] == 0
        out = np.full((len(points), 2, brun_truth.COLUMNS), np.nan)
        brun_truth.integrals(points[ok], float(sign), float(given["ratio"]), NODES, part := out[ok])
        out[ok] = part
        wells = np.isfinite(out[..., 0]).sum(axis=1)
        out[wells != np.isfinite(answer["u_min"]).sum(axis=1)] = np.nan  # a well at a point, or a separatrix
        with np.errstate(invalid="ignore"):
            wide = (out[..., 2] - out[..., 0]).min(axis=1) > 1e-6
            wrong = wide & (wells > 0) & (answer["wells"] >= 0) & (answer["wells"] < wells)
        return _rows(out, answer) | {"wrong": {"wells": wrong}}

    return truth
