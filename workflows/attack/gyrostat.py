"""Points of the gyrostat: trajectories, Abel solutions, fates, portraits."""

import numpy as np

from attack import gyrostat_truth
from attack.compare import Batch
from attack.hill import accuracy

SYSTEM = ("b12", "b31", "d", "c23", "s2", "s3")
METHODS = {
    "trajectory": ("auto",) * 7 + ("taylor", "taylor", "dop853", "dop853", "closed", "closed", "full", "full", "rk4"),
    "abel": ("auto",) * 7 + ("taylor", "taylor", "dop853", "dop853", "closed", "closed", "rk4"),
}
NUMBERS = {"dop853": 16, "full": 8, "rk4": 2}
SURE = 1e-26  # of the truth, relative, where nothing grows


def system(random, number):
    """(region, {name: values}) of `number` systems alike."""
    p = {name: random.normal(size=number) for name in SYSTEM}
    kind = str(
        random.choice(
            ["any", "b = 0", "g = 0", "(61)", "K near 0", "stiff", "tiny b", "pendulum", "whole numbers", "scaled"]
        )
    )
    if kind in ("b = 0", "pendulum"):
        p["b12"], p["b31"] = np.zeros(number), np.zeros(number)
    if kind == "pendulum":
        for name in random.choice(["d", "c23", "s2", "s3"], 3 if random.random() < 0.5 else 2, replace=False):
            p[name] = np.zeros(number)
    if kind == "g = 0":
        p |= {name: np.zeros(number) for name in SYSTEM[2:]}
    if kind == "(61)":  # exactly: powers of two and small whole numbers
        b12, b31, delta = (random.integers(-4, 5, number) * 0.5 for _ in range(3))
        sigma = random.integers(-4, 5, number) * 0.25
        p = {
            "b12": b12,
            "b31": b31,
            "d": delta * (b12**2 - b31**2),
            "c23": delta * b12 * b31,
            "s2": sigma * b12,
            "s3": sigma * b31,
        }
    if kind == "K near 0":
        p["s3"] = (
            p["b31"]
            * p["s2"]
            / p["b12"]
            * (1 + random.choice([-1, 0, 1], number) * 10 ** -random.uniform(1, 17, number))
        )
    if kind == "stiff":
        p["b12"], p["b31"] = p["b12"] * 30, p["b31"] * 30
    if kind == "tiny b":
        p["b12"], p["b31"] = (p[name] * 10 ** -random.uniform(2, 300, number) for name in ("b12", "b31"))
    if kind == "whole numbers":
        p = {name: random.integers(-2, 3, number).astype(float) for name in SYSTEM}
    if kind == "scaled":
        k = 10 ** random.uniform(-6, 6, number)
        p = {name: values * (k if name[0] == "b" else k * k) for name, values in p.items()}
        p["k"] = k
    return kind, p


def _starts(random, p, number):
    """(region, phi0, w0)."""
    k = p.pop("k", np.ones(number))
    kind = str(random.choice(["", "slow", "fast", "turning", "saddle", "far"]))
    phi, w = random.uniform(-7, 7, number), random.normal(size=number) * 2
    if kind == "slow":
        w = random.choice([-1, 1], number) * 10 ** -random.uniform(1, 17, number)
    elif kind == "fast":
        w = random.choice([-1, 1], number) * 10 ** random.uniform(1, 5, number)
    elif kind == "turning":
        w = np.zeros(number)
    elif kind == "far":
        phi = random.choice([-1, 1], number) * 10 ** random.uniform(1, 8, number)
    elif kind == "saddle":
        for i in range(number):
            found = _separatrix({name: values[i] for name, values in p.items()}, random)
            if found is not None:
                phi[i], w[i] = found
                k[i] = 1
    return kind, phi, w * k, k


def _separatrix(p, random):
    """A point next to a saddle's stable branch (linear), or next to a level of b = 0 through the saddle."""
    x = np.linspace(0, 2 * np.pi, 721)
    g = force(p, x)
    at = np.flatnonzero((g[:-1] < 0) & (g[1:] >= 0))
    if not len(at):
        return None
    i = random.choice(at)
    a, b = x[i], x[i + 1]
    for _ in range(60):
        c = 0.5 * (a + b)
        a, b = (c, b) if force(p, c) < 0 else (a, c)
    f, slope = p["b12"] * np.cos(a) - p["b31"] * np.sin(a), (force(p, a + 1e-6) - force(p, a - 1e-6)) / 2e-6
    away = 10 ** -random.uniform(1, 15)
    rate = (f - np.sqrt(f * f + 4 * max(slope, 0))) / 2
    if p["b12"] == 0 == p["b31"] and random.random() < 0.7:
        phi = a + random.uniform(0.1, 3)
        level = 2 * (potential(p, a) - potential(p, phi))
        return (phi, np.sqrt(level) * (1 + random.choice([-1, 0, 1]) * away)) if level > 0 else None
    side = random.choice([-1, 1]) * 10 ** -random.uniform(0.5, 3)
    return a + side, rate * side * (1 + random.choice([-1, 1]) * away)


def force(p, x):
    c, s = np.cos(x), np.sin(x)
    return -p["d"] * c * s - p["c23"] * (c * c - s * s) + p["s2"] * c - p["s3"] * s


def potential(p, x):
    c, s = np.cos(x), np.sin(x)
    return p["d"] / 2 * s * s + p["c23"] * s * c - p["s2"] * s - p["s3"] * c


def chunk(random, size):
    used = 0
    while used < size:
        question = str(random.choice(["trajectory", "trajectory", "abel"]))
        method, rtol = str(random.choice(METHODS[question])), accuracy(random)
        number = int(random.choice([1, NUMBERS.get(method, 32)]))
        kind, p = system(random, number)
        start, phi0, w0, k = _starts(random, p, number)
        region = f"{kind}{', ' + start if start else ''}"
        if question == "trajectory":
            long = random.random() < 0.08
            t = random.choice([-1, 1, 1], number) * 10 ** random.uniform(-3, 3 if long else 1.3, number)
            t = np.clip(t / np.maximum(k, 1e-300) / np.maximum(1, np.abs(w0) / k / 10), -1e12, 1e12)
            if random.random() < 0.1:
                t = np.zeros(number)
            region += ", long" if long else ""
            more = {"t": t}
        else:
            more = {
                "phi": phi0
                + random.choice([-1, 1], number)
                * np.where(
                    random.random(number) < 0.5, 10 ** -random.uniform(0, 12, number), random.uniform(0, 12, number)
                )
            }
        given = p | {"phi0": phi0, "w0": w0} | more
        yield Batch("gyrostat " + question, region, given, {"trajectory": _flow, "abel": _along}[question], "gyrostat",
                    {"question": question}, method, rtol)  # fmt: skip
        used += number


def _points(given, last, ok):
    return np.ascontiguousarray(np.column_stack([given[name] for name in (*SYSTEM, "phi0", "w0", last)])[ok])


def _twice(kernel, points, said, bars, columns):
    """The truth, and where a bar seems to miss it, what another tolerance makes of it: (out, doubt per column)."""
    out = np.full((len(points), 6), np.nan)
    kernel(points, gyrostat_truth.TINY, out)
    doubt = np.full((len(points), len(columns)), 0.0)
    for j, c in enumerate(columns):
        doubt[:, j] = SURE * (1 + np.abs(out[:, c]))
    with np.errstate(invalid="ignore"):
        suspicious = np.zeros(len(points), bool)
        for j, c in enumerate(columns):
            suspicious |= np.abs((said[j] - out[:, c]) - out[:, c + 1]) > 0.5 * bars[j]
    if suspicious.any():
        again = np.full((suspicious.sum(), 6), np.nan)
        kernel(points[suspicious], 1e-30, again)
        for j, c in enumerate(columns):
            off = np.abs((again[:, c] - out[suspicious, c]) + (again[:, c + 1] - out[suspicious, c + 1]))
            doubt[suspicious, j] += 100 * off
    return out, doubt


def _spread(ok, values):
    wide = np.full(len(ok), np.nan)
    wide[ok] = values
    return wide


def _flow(given, answer):
    ok = answer["status"] == 0
    points = _points(given, "t", ok)
    said, bars = ([answer[f"{name}{end}"][ok] for name in ("phi", "w")] for end in ("", "_error"))
    out, doubt = _twice(gyrostat_truth.flow, points, said, bars, (0, 2))
    turns = answer["turnings"][ok]
    with np.errstate(invalid="ignore"):
        clear = (out[:, 4] >= 0) & (np.abs(out[:, 2]) > 2 * np.maximum(bars[1], 1e-25)) & (points[:, 7] != 0)
        wrong = np.zeros(len(ok), bool)
        wrong[ok] = clear & (turns >= 0) & (turns != out[:, 4])
    spread = lambda x: _spread(ok, x)  # noqa: E731
    return {"phi": (spread(out[:, 0]), spread(out[:, 1]), spread(doubt[:, 0])),
            "w": (spread(out[:, 2]), spread(out[:, 3]), spread(doubt[:, 1])), "wrong": {"turnings": wrong}}  # fmt: skip


def _along(given, answer):
    status = answer["status"]
    turned = np.isfinite(answer["phi_turning"])
    ok = (status == 0) | turned
    points = _points(given, "phi", ok)
    pick = [np.where(turned, answer[a], answer[b])[ok] for a, b in (("phi_turning", "w"), ("t_turning", "t"))]
    bars = [
        np.where(turned, answer[a + "_error"], answer[b + "_error"])[ok]
        for a, b in (("phi_turning", "w"), ("t_turning", "t"))
    ]
    out, doubt = _twice(gyrostat_truth.along, points, pick, bars, (0, 2))
    true = _spread(ok, out[:, 4])
    with np.errstate(invalid="ignore"):
        apart = np.abs(given["phi"] - answer["phi_turning"]) > answer["phi_turning_error"]
        wrong = ((status == 0) & (true == 1)) | (turned & (true == 0) & apart)
    found = {"wrong": {"turning": wrong}}
    for names, here in ((("w", "t"), true == 0), (("phi_turning", "t_turning"), true == 1)):
        for name, c, j in zip(names, (0, 2), (0, 1), strict=True):
            value, low, d = _spread(ok, out[:, c]), _spread(ok, out[:, c + 1]), _spread(ok, doubt[:, j])
            said = np.isfinite(answer[name])
            found[name] = np.where(here & said, value, np.nan), low, d
    return found
