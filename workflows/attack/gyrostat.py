"""Points of the gyrostat: trajectories, Abel solutions, fates, portraits."""

import numpy as np

from attack.compare import Batch
from attack.hill import accuracy
from survey.truth.gyrostat import SYSTEM, along, flow

METHODS = {
    "trajectory": ("auto",) * 7
    + ("taylor", "taylor", "dop853", "dop853", "closed", "closed", "full", "full", "rk4"),
    "abel": ("auto",) * 7 + ("taylor", "taylor", "dop853", "dop853", "closed", "closed", "rk4"),
}
NUMBERS = {"dop853": 16, "full": 8, "rk4": 2}


def system(random, number):
    """(region, {name: values}) of `number` systems alike."""
    p = {name: random.normal(size=number) for name in SYSTEM}
    kind = str(
        random.choice(
            [
                "any",
                "b = 0",
                "g = 0",
                "(61)",
                "K near 0",
                "stiff",
                "tiny b",
                "pendulum",
                "whole numbers",
                "scaled",
            ]
        )
    )
    if kind in ("b = 0", "pendulum"):
        p["b12"], p["b31"] = np.zeros(number), np.zeros(number)
    if kind == "pendulum":
        for name in random.choice(
            ["d", "c23", "s2", "s3"], 3 if random.random() < 0.5 else 2, replace=False
        ):
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
        p["b12"], p["b31"] = (
            p[name] * 10 ** -random.uniform(2, 300, number) for name in ("b12", "b31")
        )
    if kind == "whole numbers":
        p = {name: random.integers(-2, 3, number).astype(float) for name in SYSTEM}
    if kind == "scaled":
        k = 10 ** random.uniform(-6, 6, number)
        p = {name: values * (k if name[0] == "b" else k * k) for name, values in p.items()}
        p["k"] = k
    return kind, p


def _starts(random, p, number, curved):
    """(region, phi0, w0)."""
    k = p.pop("k", np.ones(number))
    kinds = [
        "",
        "slow",
        "fast",
        "turning",
        "saddle",
        "far",
        *(["curve", "curve"] if curved else []),
    ]
    kind = str(random.choice(kinds))
    phi, w = random.uniform(-7, 7, number), random.normal(size=number) * 2
    if kind == "slow":
        w = random.choice([-1, 1], number) * 10 ** -random.uniform(1, 17, number)
    elif kind == "fast":
        w = random.choice([-1, 1], number) * 10 ** random.uniform(1, 5, number)
    elif kind == "turning":
        w = np.zeros(number)
    elif kind == "far":
        phi = random.choice([-1, 1], number) * 10 ** random.uniform(1, 8, number)
    elif kind == "curve":
        for i in range(number):
            phi[i], w[i] = _next_to_rest({name: values[i] for name, values in p.items()}, random)
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
    f, slope = (
        p["b12"] * np.cos(a) - p["b31"] * np.sin(a),
        (force(p, a + 1e-6) - force(p, a - 1e-6)) / 2e-6,
    )
    away = 10 ** -random.uniform(1, 15)
    rate = (f - np.sqrt(f * f + 4 * max(slope, 0))) / 2
    if p["b12"] == 0 == p["b31"] and random.random() < 0.7:
        phi = a + random.uniform(0.1, 3)
        level = 2 * (potential(p, a) - potential(p, phi))
        return (phi, np.sqrt(level) * (1 + random.choice([-1, 0, 1]) * away)) if level > 0 else None
    side = random.choice([-1, 1]) * 10 ** -random.uniform(0.5, 3)
    return a + side, rate * side * (1 + random.choice([-1, 1]) * away)


def _next_to_rest(p, random):
    """A point of an invariant curve w = mu F + n of (61), or of g = 0, as a rule next to where it rests."""
    b12, b31 = p["b12"], p["b31"]
    b = np.hypot(b12, b31)
    if b == 0.0:
        return random.uniform(-7, 7), random.normal()
    # along b
    delta = (p["d"] * (b12**2 - b31**2) + 4 * p["c23"] * b12 * b31) / b**4
    mu = 0.5 + random.choice([-1, 1]) * np.sqrt(max(0.25 - delta, 0.0))
    n = (p["s2"] * b12 + p["s3"] * b31) / b**2 / (mu - 1.0) if mu != 1.0 else random.uniform(-b, b)
    share, angle = -n / (mu * b) if mu else np.inf, np.arctan2(b31, b12)
    phi = random.uniform(-7, 7)
    if abs(share) < 1:
        rest = random.choice([np.arcsin(share), np.pi - np.arcsin(share)]) - angle
        phi = rest + random.choice([-1, 1]) * 10 ** -random.uniform(0, 12)
    return phi, mu * (b12 * np.sin(phi) + b31 * np.cos(phi)) + n


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
        start, phi0, w0, k = _starts(random, p, number, kind in ("(61)", "g = 0"))
        region = f"{kind}{', ' + start if start else ''}"
        if question == "trajectory":
            long = random.random() < 0.08
            t = random.choice([-1, 1, 1], number) * 10 ** random.uniform(
                -3, 3 if long else 1.3, number
            )
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
                    random.random(number) < 0.5,
                    10 ** -random.uniform(0, 12, number),
                    random.uniform(0, 12, number),
                )
            }
        given = p | {"phi0": phi0, "w0": w0} | more
        yield Batch("gyrostat " + question, region, given, {"trajectory": flow, "abel": along}[question], "gyrostat",
                    {"question": question}, method, rtol)  # fmt: skip
        used += number
