"""Abel equations of one's own with narrow features, held against closed forms.

F(phi) = c h(phi) + A k(u / s) is a wave h and a step k of width s at phi = a: erf, tanh or arctan; on the circle
u = sin(phi - a) and h = sin phi, on a line u = phi - a and h = phi.

shear       f = F', g = 0:  w = w0 + F(phi) - F(phi0)
energy      f = 0, g = F':  w^2 = w0^2 + 2 (F(phi) - F(phi0)), where no motion turns

In time w is held against the closed form at the phi of the answer, within the bar of that.
"""

from functools import lru_cache

import numpy as np
from mpmath import mp, mpf

import survey
from attack.compare import Batch
from attack.hill import accuracy
from survey.truth.hill_flow import TWO_PI

DIGITS = 40
NAMES = ("c", "A", "a", "s")
ERF = 1.1283791670955126  # 2 / sqrt(pi) as the code of the scene has it
METHODS = ("auto",) * 8 + ("taylor", "dop853")
NUMBERS = {"dop853": 4}


def _step(kind, x):
    """The step k and its slope, in mpmath."""
    if kind == "erf":
        return mp.erf(x) * mpf(ERF) * mp.sqrt(mp.pi) / 2, mpf(ERF) * mp.exp(-x * x)
    if kind == "tanh":
        return mp.tanh(x), mp.sech(x) ** 2
    return mp.atan(x), 1 / (1 + x * x)


@lru_cache(maxsize=16)
def scene(kind, system, on_circle):
    def slope(phi, p):
        c, A, a, s = p
        x = (np.sin(phi - a) if on_circle else phi - a) / s
        if kind == "erf":
            k = ERF * np.exp(-x * x)
        elif kind == "tanh":
            k = 1 - np.tanh(x) ** 2
        else:
            k = 1 / (1 + x * x)
        if on_circle:
            return c * np.cos(phi) + A / s * k * np.cos(phi - a)
        return c + A / s * k

    def nothing(phi, p):
        return 0.0 * phi

    f, g = (slope, nothing) if system == "shear" else (nothing, slope)
    return survey.abel(f, g, parameters=NAMES, period=TWO_PI if on_circle else None)


def _level(kind, on_circle, row, phi):
    """(F, F') at phi, in mpmath."""
    c, A, a, s = (mpf(float(x)) for x in row)
    u, du = (mp.sin(phi - a), mp.cos(phi - a)) if on_circle else (phi - a, mpf(1))
    k, dk = _step(kind, u / s)
    h, dh = (mp.sin(phi), mp.cos(phi)) if on_circle else (phi, mpf(1))
    return c * h + A * k, c * dh + A / s * dk * du


def _velocity(system, w0, rise):
    w0 = mpf(float(w0))
    return w0 + rise if system == "shear" else mp.sign(w0) * mp.sqrt(w0 * w0 + 2 * rise)


def _truth(kind, system, on_circle, given, answer):
    """w at the phi that is asked for, or that the answer has."""
    asked = "phi" in given
    goal = np.asarray(given["phi"] if asked else answer["phi"], float)
    off = np.zeros_like(goal) if asked else np.asarray(answer["phi_error"], float)
    high, low, doubt = (np.full(goal.shape, np.nan) for _ in range(3))
    rows = np.column_stack([given[name] for name in NAMES])
    with mp.workdps(DIGITS):
        for i in np.flatnonzero(np.isfinite(goal) & np.isfinite(off)):
            start = _level(kind, on_circle, rows[i], mpf(float(given["phi0"][i])))[0]
            level, steep = _level(kind, on_circle, rows[i], mpf(float(goal[i])))
            w = _velocity(system, given["w0"][i], level - start)
            for side in (-off[i], off[i]):
                there = _level(kind, on_circle, rows[i], mpf(float(goal[i])) + mpf(float(side)))[1]
                steep = max(abs(steep), abs(there))
            change = steep if system == "shear" else steep / abs(w)
            high[i] = float(w)
            low[i], doubt[i] = float(w - mpf(high[i])), float(1.5 * change * off[i])
    return {"w": (high, low, doubt)}


def chunk(random, size):
    used = 0
    while used < size:
        kind, system = (
            str(random.choice(["erf", "tanh", "arctan"])),
            str(random.choice(["shear", "energy"])),
        )
        on_circle, question = (
            bool(random.random() < 0.6),
            str(random.choice(["abel", "trajectory"])),
        )
        method, rtol = str(random.choice(METHODS)), accuracy(random)
        number = int(random.choice([1, NUMBERS.get(method, 48)]))
        narrow = bool(random.random() < 0.5)
        s = 10 ** random.uniform(*((-5.0, -2.0) if narrow else (-2.0, 0.3)), number)
        A = random.choice([-1, 1], number) * 10 ** random.uniform(-12.0, 0.5, number)
        c = random.choice([-1, 1], number) * 10 ** random.uniform(-3.0, 0.3, number)
        if random.random() < 0.5:  # mostly flatter than the wave, which hides its tail
            A *= abs(c) * s
        phi0 = random.uniform(-3, 3, number)
        reach = random.choice([-1, 1], number) * random.uniform(0.1, 8.0, number)
        # beside what is asked for, near it, or in between
        a = phi0 + reach * random.uniform(-0.1, 1.1, number)
        least = 4 * abs(A) + abs(c) * (2 if on_circle else 9)
        w0 = 1.1 * (least if system == "shear" else np.sqrt(2 * least)) + 10 ** random.uniform(
            -2, 1, number
        )
        w0 *= random.choice([-1, 1], number)
        given = {"c": c, "A": A, "a": a, "s": s, "phi0": phi0, "w0": w0}
        given |= (
            {"phi": phi0 + reach}
            if question == "abel"
            else {"t": reach / w0 * random.choice([-1, 1], number)}
        )
        how = f"scene({kind!r}, {system!r}, {on_circle})"

        def truth(given, answer, of=(kind, system, on_circle)):
            return _truth(*of, given, answer)

        region = f"{kind}, {'narrow' if narrow else 'wide'}, {'circle' if on_circle else 'line'}"
        yield Batch(f"own {question}", region, given, truth, scene(kind, system, on_circle), {"question": question},
                    method, rtol, how)  # fmt: skip
        used += number
