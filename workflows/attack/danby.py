"""Points of `libration_elliptic`: Danby's map, about its curves, its tip and its ends."""

import numpy as np

from attack.compare import Batch
from attack.hill import accuracy, beside
from survey.truth.danby import margins, solved, truth

TIP = 0.04699080701821065, 0.31450715975493514
POINT = 0.028595479208968317, 0.0  # where the curves A and B begin
ROUTH = 0.03852089650455140
METHODS = ("auto", "auto", "auto", "taylor16", "dop853", "rk4")
NUMBERS = {"dop853": 8, "rk4": 4}


def chunk(random, size):
    used = 0
    while used < size:
        method, rtol = str(random.choice(METHODS)), accuracy(random)
        number = int(random.choice([1, NUMBERS.get(method, 48)]))
        kind = str(
            random.choice(
                [
                    "generic",
                    "tip",
                    "curve",
                    "e to 1",
                    "e to 0",
                    "mu to 0",
                    "mu to 1/2",
                    "special",
                    "dense row",
                ]
            )
        )
        mu, e = random.uniform(0, 0.06, number), random.uniform(0, 0.9, number)
        small = 10 ** -random.uniform(1, 17, number)
        signs = random.choice([-1.0, 1.0], (2, number))
        if kind == "tip":
            mu, e = (
                TIP[0] + signs[0] * small * TIP[0],
                TIP[1] + signs[1] * small * 10 ** random.uniform(-1, 1, number),
            )
        elif kind == "e to 1":
            e = np.minimum(1 - 10 ** -random.uniform(1, 14, number), np.nextafter(1, 0))
            mu = 10 ** random.uniform(-13, -0.302, number)
        elif kind == "e to 0":
            e = 10 ** -random.uniform(1, 300, number)
            mu = random.choice([ROUTH, POINT[0], 0.01, 0.03, 0.5], number) * (1 - small)
        elif kind == "mu to 0":
            mu = 10 ** -random.uniform(2, 300, number)
        elif kind == "mu to 1/2":
            mu = np.where(
                random.random(number) < 0.3,
                0.5 - random.integers(0, 9, number) * 2.0**-54,
                0.5 - small * 0.5,
            )
            mu = np.minimum(mu, 0.5)
            if random.random() < 0.5:
                e = random.choice([1 - small * 0.99, small, e])
        elif kind == "special":
            mu = random.choice(
                [0.0, 0.5, 5e-324, 1e-300, POINT[0], ROUTH, np.nextafter(0.5, 0), 0.25, 0.125],
                number,
            )
            e = random.choice([0.0, 5e-324, 1e-300, 0.5, 0.9, np.nextafter(1, 0), TIP[1]], number)
        elif kind == "curve":
            fixed = float(
                random.uniform(0.0, 0.8)
                if random.random() < 0.6
                else TIP[1] * (1 - 10 ** -random.uniform(0.3, 7))
            )
            x = _curve(random, fixed)
            if x is None:
                continue
            mu, e = beside(random, x, number), np.full(number, fixed)
        elif kind == "dense row":
            e = float(random.uniform(0, 0.97))
            mu = random.uniform(0, 0.5 if random.random() < 0.3 else 0.06, 150)
            mu[:4] = 0.5 - np.arange(4) * 2.0**-54  # (two of them are 1/2)
            mu = np.unique(mu)
            chosen = np.append(
                random.choice(mu.size - 3, 27, replace=False), mu.size - 1 - np.arange(3)
            )
            method = "taylor16" if method == "taylor16" else "auto"
            given = {"mu": mu, "e": np.array([e])}
            yield Batch(
                "libration_elliptic",
                kind,
                given,
                truth,
                None,
                {},
                method,
                rtol,
                "",
                ("mu", "e"),
                chosen,
            )
            used += 30
            continue
        yield Batch("libration_elliptic", kind, {"mu": mu, "e": e}, truth, None, {}, method, rtol)
        used += number


def _curve(random, e):
    """A mass ratio next to a curve where a factor vanishes."""
    which = random.integers(0, 3)

    def f(mu):
        return margins(solved(mu, e, 1e-30))[which][0].astype(float)

    mu = np.sort(random.uniform(0.001, 0.06, 16))
    values = f(mu)
    at = np.flatnonzero(np.signbit(values[1:]) != np.signbit(values[:-1]))
    if not len(at):
        return None
    i = random.choice(at)
    a, b, fa, fb = mu[i], mu[i + 1], values[i], values[i + 1]
    for n in range(60):
        c = (a * fb - b * fa) / (fb - fa) if n % 4 < 3 else 0.5 * (a + b)
        if not a < c < b:
            c = 0.5 * (a + b)
            if not a < c < b:
                break
        fc = f(np.array([c]))[0]
        if (fc < 0) == (fa < 0):
            a, fa, fb = c, fc, fb / 2
        else:
            b, fb, fa = c, fc, fa / 2
    return a
