"""Points of Hill's equation: the satellite in all ways of naming it, Mathieu's equation, and
equations of one's own.
"""

from functools import lru_cache
from math import pi

import numpy as np

import survey
from attack.compare import Batch
from survey.truth import user_equations
from survey.truth.hill import FACTOR_COLUMNS, WAYS, mathieu_solved, satellite, solved
from survey.truth.hill import mathieu as true_mathieu
from survey.truth.hill_flow import DY2, INERTIA, RHO, Y1
from survey.truth.user_equations import OWN

METHODS = ("auto", "auto", "auto", "taylor16", "magnus6", "rk4", "dop853")
SPECIAL_K = (
    0.0,
    5e-324,
    1e-300,
    1e-16,
    0.5,
    np.sqrt(0.5),
    np.nextafter(1, 0),
    np.nextafter(1, 2),
    2.0,
    3.0,
    1e3,
)
SPECIAL_RHO = (
    0.0,
    5e-324,
    1e-300,
    1e-8,
    0.5,
    1.0,
    1.5,
    2.0,
    np.sqrt(1.25),
    np.sqrt(3.0),
    1 / np.sqrt(3.0),
    10.0,
    -1.0,
)
SPECIAL_ALPHA = (0.0, 2.0, 0.5, 1.5, 11 / 15, 8 / 9, 59 / 63, 4 / 3, 31 / 27, 13 / 12, 1.25, 1e-300)


def accuracy(random):
    """An asked accuracy, 1e-6 to 1e-13."""
    return (
        float(10.0 ** -random.uniform(6, 13))
        if random.random() < 0.7
        else float(10.0 ** -random.integers(6, 14))
    )


def beside(random, x, size):
    """`size` doubles about x: itself, its next neighbours, and ever farther ones."""
    ulps = np.where(random.random(size) < 0.4, random.integers(-4, 5, size),
                    np.rint(random.choice([-1.0, 1.0], size) * 2.0 ** random.uniform(0, 44, size)))  # fmt: skip
    return x + ulps * np.spacing(x)


# Satellites


def _edge(random, f, low, high, points=14):
    """A zero of one of four functions of x in [low, high], f(x) (N) -> (N, 4): the double next to
    it, or None.
    """
    x = np.sort(random.uniform(low, high, points))
    values = f(x)
    rows, columns = np.nonzero(np.signbit(values[1:]) != np.signbit(values[:-1]))
    if not len(rows):
        return None
    pick = random.integers(len(rows))
    i, j = rows[pick], columns[pick]
    a, b, fa, fb = x[i], x[i + 1], values[i, j], values[i + 1, j]
    for n in range(60):  # regula falsi with halved ends (Illinois), and bisection
        c = (a * fb - b * fa) / (fb - fa) if n % 4 < 3 else 0.5 * (a + b)
        if not a < c < b:
            c = 0.5 * (a + b)
            if not a < c < b:
                break
        fc = f(np.array([c]))[0, j]
        if fc == 0.0:
            return c
        if (fc < 0) == (fa < 0):
            a, fa, fb = c, fc, fb / 2
        else:
            b, fb, fa = c, fc, fa / 2
    return a


def _factors(out):
    return out[:, list(FACTOR_COLUMNS.values())]


def _draw_modulus(random, size):
    """(region, way, values) of librations or rotations."""
    kind = random.choice(
        ["generic", "separatrix", "small k", "rotation", "special", "fast rotation"]
    )
    way = random.choice(["k", "k", "one_minus_k", "amplitude"])
    if kind == "rotation":
        values = 1 + 10 ** random.uniform(-3, 1, size)
        return kind, *(("one_minus_k", 1 - values) if way == "one_minus_k" else ("k", values))
    if kind == "fast rotation":
        return kind, "k", 10 ** random.uniform(1, 12, size)
    if kind == "special":
        return kind, "k", random.choice(SPECIAL_K, size)
    if kind == "small k":
        values = 10 ** -random.uniform(1, 18, size)
        return kind, *((way, values) if way != "one_minus_k" else (way, 1 - values))
    if kind == "separatrix":
        short = 10 ** -random.uniform(1, random.choice([8, 16, 60, 300]), size)
        if way == "k":
            return (
                kind,
                way,
                np.where(
                    1 + random.choice([-1, 1]) * short == 1,
                    np.nextafter(1, 0),
                    1 + random.choice([-1, 1]) * short,
                ),
            )
        if way == "one_minus_k":
            return kind, way, random.choice([-1, 1], size) * short
        return kind, way, np.minimum(pi / 2 - np.maximum(short, 1e-17), np.nextafter(pi / 2, 0))
    values = random.uniform(0, 0.99, size)
    return (
        kind,
        way,
        np.arcsin(values) if way == "amplitude" else 1 - values if way == "one_minus_k" else values,
    )


def _off_one(k):
    return np.where(k == 1, np.nextafter(1, 0), k)


def _draw_rate(random, kind, k, size):
    """(suffix of the region, rho)."""
    sub = random.choice(["", "special rho", "large rho", "beside a tip"], p=[0.6, 0.15, 0.05, 0.2])
    if sub == "special rho":
        return sub, random.choice(SPECIAL_RHO, size)
    if sub == "large rho":
        return sub, random.choice([-1, 1], size) * 10 ** random.uniform(
            1, random.choice([2, 3]), size
        )
    if "rotation" in kind:
        ratio = (
            random.choice([-4.0, -3, -2, -1, 0, 1, 2, 3], size)
            if sub
            else random.uniform(-5, 4, size)
        )
        return sub, k * (
            ratio + (sub != "") * random.choice([-1, 1], size) * 10 ** -random.uniform(1, 17, size)
        )
    if sub:
        n = random.integers(1, 9, size)
        tips = np.where(
            (n >= 3) & (random.random(size) < 0.5), np.sqrt(np.maximum(n * n / 4 - 1, 0)), n / 2
        )
        return sub, tips * (1 + random.choice([-1, 1], size) * 10 ** -random.uniform(1, 17, size))
    return sub, random.uniform(-4, 4, size)


def satellites(random, size):
    used = 0
    while used < size:
        method, rtol = random.choice(METHODS), accuracy(random)
        number = int(random.choice([1, 3, 16, 64]))
        oblate = bool(random.random() < 0.5)
        kind, way, given = _draw_modulus(random, number)
        given = given.copy()
        near = {"k": given, "one_minus_k": 1 - given, "amplitude": np.sin(given)}[way]
        inertia = random.random() < 0.25
        if inertia:
            sub, rho = _draw_inertia(random, number)
        else:
            sub, rho = _draw_rate(random, kind, near, number)
        if random.random() < 0.5 and kind != "special" and sub != "large rho":
            found = _beside_edge(random, way, given[0], inertia, oblate, number)
            if found is not None:
                given, rho, sub = *found, "beside an edge"
        direction = int(random.choice([1, -1]))
        names = {way: given, "inertia_ratio" if inertia else "rho": rho}
        options = (
            {"direction": str(direction)}
            if inertia
            else {"body": "oblate" if oblate else "prolate"}
        )
        if not inertia and number > 1 and random.random() < 0.1:
            names = {way: np.unique(given[:4]), "rho": np.unique(random.uniform(0, 4, 150))}
            chosen = random.choice(names[way].size * 150, 60, replace=False)
            method = "auto" if method in ("rk4", "dop853") else str(method)
            true = satellite(way, False, 1, oblate)
            yield Batch(
                "satellite",
                f"{kind}, map",
                names,
                true,
                None,
                options,
                method,
                rtol,
                "",
                (way, "rho"),
                chosen,
            )
            used += 60
            continue
        region = f"{kind}{', ' + sub if sub else ''}{', inertia ratio' if inertia else ''}"
        yield Batch("satellite", region, names, satellite(way, inertia, direction, oblate), None, options,
                    str(method), rtol)  # fmt: skip
        used += number


def _draw_inertia(random, size):
    sub = random.choice(["", "special", "near 1"])
    if sub == "special":
        return sub, random.choice(
            [0.0, 2.0, 0.5, 1.5, 11 / 15, 8 / 9, 59 / 63, 4 / 3, 31 / 27, 13 / 12, 1.25, 1e-300],
            size,
        )
    if sub == "near 1":
        return sub, 1 + random.choice([-1, 1], size) * 10 ** -random.uniform(1, 5, size)
    return sub, np.where(
        random.random(size) < 0.5, random.uniform(0, 0.98, size), random.uniform(1.02, 2, size)
    )


def _beside_edge(random, way, given, inertia, oblate, size):
    """(given, rho or inertia ratio) beside an edge of a tongue."""
    if inertia:
        low, high = random.choice([(0.0, 0.95), (1.05, 2.0)])
    else:
        scale = max(1.0, {"k": given, "one_minus_k": 1 - given, "amplitude": 0.0}[way])
        low, high = -3.0 * scale, 3.0 * scale
    if way == "one_minus_k" and abs(given) < 1e-20:
        return None
    rates = INERTIA if inertia else RHO
    x = _edge(
        random,
        lambda x: _factors(solved(WAYS[way], given, rates, x, 1.0, oblate, 1e-31)),
        low,
        high,
    )
    if x is None:
        return None
    return np.full(size, given), beside(random, x, size)


# Mathieu's equation


def mathieu(random, size):
    used = 0
    while used < size:
        method, rtol = str(random.choice(METHODS)), accuracy(random)
        number = int(random.choice([1, 16, 64]))
        kind = random.choice(["generic", "beside an edge", "small q", "special", "large"])
        a, q = random.uniform(-10, 40, number), random.uniform(-12, 12, number)
        if kind == "small q":
            q = random.choice([-1, 1], number) * 10 ** -random.uniform(1, 300, number)
            a = random.integers(0, 7, number) ** 2.0 * (
                1 + random.choice([-1, 0, 1], number) * 10 ** -random.uniform(1, 17, number)
            )
        elif kind == "special":
            a = random.choice([0.0, 1.0, 4.0, 9.0, 2.0, -1.0, 1e-300, 100.0, 625.0], number)
            q = random.choice([0.0, 1e-300, 1.0, -1.0, 0.5, 5e-324, 10.0], number)
        elif kind == "large":
            q = random.choice([-1, 1], number) * 10 ** random.uniform(1, 3, number)
            a = random.uniform(-3, 3, number) * np.abs(q)
        elif kind == "beside an edge":
            scale = 10 ** random.uniform(-3, 1.5)
            fixed = scale * random.choice([-1, 1])
            x = _edge(
                random,
                lambda x, fixed=fixed: _factors(mathieu_solved(x, fixed)),
                -2 * scale - 1,
                20.0,
                24,
            )
            if x is None:
                continue
            a, q = beside(random, x, number), np.full(number, fixed)
        yield Batch("mathieu", kind, {"a": a, "q": q}, true_mathieu, None, {}, method, rtol)
        used += number


# Equations of one's own


OWN_SHARES = (0.28, 0.24, 0.12, 0.1, 0.1, 0.1, 0.06)
NARROW = 0.2  # of the spikes that are not named


@lru_cache(maxsize=8)
def own_scene(name):
    """An equation of one's own."""
    z, parameters, _, more = OWN[name]
    return survey.hill(z, parameters=parameters, **more)


def own(random, size):
    used = 0
    while used < size:
        name, rtol = str(random.choice(list(OWN), p=OWN_SHARES)), accuracy(random)
        number = int(random.choice([1, 16, 48]))
        method = str(
            random.choice(["auto", "auto", "auto", "auto", "taylor16", "magnus6", "dop853"])
        )
        number = min(number, 4) if method == "dop853" else number
        draw = (
            _draw_harmonics
            if name.startswith("harmonics")
            else _draw_spikes
            if "spike" in name
            else _draw_pieces
        )
        region, p, low, high = draw(random, name, number)
        if random.random() < 0.2 and not region.startswith("narrow"):
            row = p[0].copy()
            x = _edge(
                random, lambda x, row=row, name=name: _own_margin(name, x, row), low, high, 20
            )
            if x is not None:
                region, p[:] = "beside an edge", row
                p[:, 0] = beside(random, x, number)
        given = dict(zip(OWN[name][1], p.T, strict=True))
        yield Batch(f"own {name}", region, given, user_equations.true(name), own_scene(name), {}, method, rtol,
                    f"own_scene({name!r})")  # fmt: skip
        used += number


def _draw_harmonics(random, name, size):
    """(region, (N, 10), range of a in which edges are searched for)."""
    p = np.zeros((size, 10))
    period = 10 ** random.uniform(-1, 2, size if random.random() < 0.5 else 1)
    unit = (pi / period) ** 2  # the edges of z = a lie at its multiples by squares
    kind = str(random.choice(["generic", "generic", "generic", "constant", "tiny", "large"]))
    number = random.integers(2, 5)
    p[:, 0] = random.uniform(-1, 12, size) * unit
    strength = np.minimum(50.0, 300 * unit) * 10 ** -random.uniform(0, random.choice([1, 8]), size)
    if kind == "constant":
        strength = 0.0
        p[:, 0] = random.choice([0.0, 1.0, 4.0, 9.0, 2.0, -1.0, 100.0], size) * unit
    elif kind == "tiny":
        strength = 10 ** -random.uniform(8, 300, size)
        p[:, 0] = random.choice([0.0, 1.0, 4.0, 9.0, 1e-200, 1e-30, -1e-12], size) * unit
    elif kind == "large":
        p[:, 0] = 10 ** random.uniform(2, 5, size) * unit
        strength = p[:, 0] * random.uniform(0, 0.9)
    p[:, 1 : 1 + number] = (
        random.uniform(-1, 1, (size, number)) * np.reshape(strength, (-1, 1)) / number
    )
    if name == "harmonics":
        p[:, 5 : 5 + number] = (
            random.uniform(-1, 1, (size, number)) * np.reshape(strength, (-1, 1)) / number
        )
    p[:, 9] = period
    return kind, p, -unit[0], 12 * unit[0]


def _draw_pieces(random, name, size):
    p = np.zeros((size, len(OWN[name][1])))
    p[:, : p.shape[1] - 1] = random.uniform(-30, 200, (size, p.shape[1] - 1))
    end = 0.5 if name == "meissner even" else 1.0
    p[:, -1] = random.uniform(1e-6, end - 1e-6, size)
    kind = "generic"
    if random.random() < 0.3:
        kind, p[:, -1] = "break at an end", random.choice([0.0, end, 1e-12, end - 1e-12])
    elif random.random() < 0.4:
        kind, p[:, :-1] = (
            "special",
            random.choice([0.0, 1e-300, -1e-30, pi * pi, 4 * pi * pi, 1e4], p[:, :-1].shape),
        )
    return kind, p, -5.0, 60.0


def _draw_spikes(random, name, size):
    narrow = name == "spike" and random.random() < NARROW
    width = 10 ** (
        random.uniform(-4, -2.5)
        if narrow
        else random.uniform(-4 if "named" in name else -1.5, -0.5)
    )
    p = np.empty((size, 4))
    p[:, 0] = random.uniform(0, 60, size)
    p[:, 1] = random.normal(size=size) / width * 10 ** random.uniform(-1, 1)
    p[:, 2], p[:, 3] = random.uniform(0.1, 0.9, size), width
    if "named" in name:
        p[:, 3] = np.minimum(p[:, 3], 0.24 * np.minimum(p[:, 2], 1 - p[:, 2]))
    return "narrow spike" if narrow else "spike", p, -5.0, 60.0


def _own_margin(name, x, row):
    p = np.tile(row, (len(x), 1))
    p[:, 0] = x
    out = user_equations.solved(name, p)
    if OWN[name][3].get("even"):
        return _factors(out)
    trace = out[:, Y1] + out[:, DY2]
    return np.column_stack([trace - 2, trace + 2])
