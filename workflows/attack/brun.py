"""Points of Brun's problem: states and scaled integrals, about poles, separatrices, precessions,
without field.
"""

from math import pi

import numpy as np

from attack.compare import Batch
from attack.hill import accuracy
from survey.truth import brun as true

METHODS = ("auto", "auto", "auto", "agm", "carlson", "chebyshev")
STATES = ("any", "pole +1", "pole -1", "passing closely", "pole passage", "tiny field", "no field", "fast spin",
          "no spin", "regular precession", "saddle", "upright", "special", "large")  # fmt: skip


def chunk(random, size):
    used = 0
    while used < size:
        method, rtol = str(random.choice(METHODS)), accuracy(random)
        number = int(random.choice([1, 16 if method == "chebyshev" else 64]))
        if random.random() < 0.6:
            kind, points = _states(random, number)
            yield Batch(
                "brun states",
                kind,
                dict(zip(true.NAMES, points.T, strict=True)),
                true.states,
                "brun",
                {},
                method,
                rtol,
            )
        else:
            kind, sign, points = _integrals(random, number)
            ratio = float(random.choice([0.5, 1.0, 2.0, 1e-3, random.uniform(0.01, 2)]))
            given = dict(zip(("l", "alpha", "beta"), points.T, strict=True)) | {"ratio": ratio}
            yield Batch(
                "brun integrals",
                kind,
                given,
                true.integrals(sign),
                "brun",
                {"sign": str(sign)},
                method,
                rtol,
            )
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
        u = (
            random.uniform(-0.33, 0.33, number)
            if kind == "saddle"
            else random.uniform(-0.99, 0.99, number)
        )
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
        theta, p, b = (
            10 ** -random.uniform(2, 9, number),
            10 ** -random.uniform(2, 9, number),
            a * close,
        )
    elif kind == "special":
        theta = random.choice([pi / 2, pi / 3, 1.0, 0.5, 3.0, 2.0], number)
        p, b, a = (random.choice([0.0, 1.0, -1.0, 0.5, 2.0], number) for _ in range(3))
        A, C, epsilon = (
            random.choice(x, number)
            for x in ([1.0, 2.0, 0.5], [0.5, 1.0, 2.0, 0.25], [1.0, -1.0, 0.5, 0.0])
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
            wide = (
                wide * 10 ** -random.uniform(3, 16, number)
                + 0.5 * np.sqrt((1 - u * u) * (1 - 9 * u * u)) * side[1]
            )
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
        return (
            kind,
            sign,
            np.column_stack(
                [alpha * alpha - sign + random.uniform(0, 100, number) * close, alpha, beta]
            ),
        )
    elif kind == "fast spin":
        alpha = alpha * 10 ** random.uniform(1, 8, number)
    elif kind == "tiny field":
        large = 10 ** random.uniform(2, 9, number)
        alpha, beta = large * alpha, large * beta
    elif kind == "special":
        alpha, beta = (random.choice([0.0, 1.0, -1.0, 0.5, 2.0], number) for _ in range(2))
        return (
            kind,
            sign,
            np.column_stack(
                [random.choice([0.0, 1.0, 2.0, 3.0, 0.5, 4.0, -0.25], number), alpha, beta]
            ),
        )
    level = np.maximum(alpha * alpha, beta * beta) * (
        1 + 10 ** random.uniform(-3, 1, number)
    ) + random.uniform(-1, 1, number)
    return kind, sign, np.column_stack([level, alpha, beta])
