"""Points of Hill's equation: the satellite in all ways of naming it, Mathieu's equation, and equations of one's own."""

from functools import lru_cache
from math import pi

import numpy as np

import survey
from attack import hill_truth
from attack.hill_truth import AMPLITUDE, COSINE, INERTIA, LORENTZ, NOT_EVEN, ONE_MINUS_K, RHO, STAIRS, K
from attack.judge import Batch

LONG = np.longdouble
ULP = float(np.finfo(LONG).eps)
WAYS = {"k": K, "one_minus_k": ONE_MINUS_K, "amplitude": AMPLITUDE}
METHODS = ("auto", "auto", "auto", "taylor16", "magnus6", "rk4", "dop853")
SPECIAL_K = (0.0, 5e-324, 1e-300, 1e-16, 0.5, np.sqrt(0.5), np.nextafter(1, 0), np.nextafter(1, 2), 2.0, 3.0, 1e3)
SPECIAL_RHO = (0.0, 5e-324, 1e-300, 1e-8, 0.5, 1.0, 1.5, 2.0, np.sqrt(1.25), np.sqrt(3.0), 1 / np.sqrt(3.0), 10.0, -1.0)
SPECIAL_ALPHA = (0.0, 2.0, 0.5, 1.5, 11 / 15, 8 / 9, 59 / 63, 4 / 3, 31 / 27, 13 / 12, 1.25, 1e-300)
TOLERANCE = 1e-33


def accuracy(random):
    """An asked accuracy, 1e-6 to 1e-13."""
    return float(10.0 ** -random.uniform(6, 13)) if random.random() < 0.7 else float(10.0 ** -random.integers(6, 14))


def beside(random, x, size):
    """`size` doubles about x: itself, its next neighbours, and ever farther ones."""
    ulps = np.where(random.random(size) < 0.4, random.integers(-4, 5, size),
                    np.rint(random.choice([-1.0, 1.0], size) * 2.0 ** random.uniform(0, 44, size)))  # fmt: skip
    return x + ulps * np.spacing(x)


# Satellites


def solved(way, given, rates, rho, direction=1.0, oblate=False, tolerance=TOLERANCE):
    """Truth (N, 12): see `hill_truth.satellites`."""
    given, rho = np.broadcast_arrays(np.asarray(given, float), np.asarray(rho, float))
    out = np.empty((given.size, 12))
    hill_truth.satellites(way, given.ravel().copy(), rates, rho.ravel().copy(), direction, oblate, tolerance, out)
    return out


def _edge(random, f, low, high, points=14):
    """A zero of one of four functions of x in [low, high], f(x) (N) -> (N, 4): the double next to it, or None."""
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
    return out[:, [0, 2, 4, 6]]


def _draw_modulus(random, size):
    """(region, way, values) of librations or rotations."""
    kind = random.choice(["generic", "separatrix", "small k", "rotation", "special", "fast rotation"])
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
                    1 + random.choice([-1, 1]) * short == 1, np.nextafter(1, 0), 1 + random.choice([-1, 1]) * short
                ),
            )
        if way == "one_minus_k":
            return kind, way, random.choice([-1, 1], size) * short
        return kind, way, np.minimum(pi / 2 - np.maximum(short, 1e-17), np.nextafter(pi / 2, 0))
    values = random.uniform(0, 0.99, size)
    return kind, way, np.arcsin(values) if way == "amplitude" else 1 - values if way == "one_minus_k" else values


def _off_one(k):
    return np.where(k == 1, np.nextafter(1, 0), k)


def _draw_rate(random, kind, k, size):
    """(suffix of the region, rho)."""
    sub = random.choice(["", "special rho", "large rho", "beside a tip"], p=[0.6, 0.15, 0.05, 0.2])
    if sub == "special rho":
        return sub, random.choice(SPECIAL_RHO, size)
    if sub == "large rho":
        return sub, random.choice([-1, 1], size) * 10 ** random.uniform(1, random.choice([2, 3]), size)
    if "rotation" in kind:
        ratio = random.choice([-4.0, -3, -2, -1, 0, 1, 2, 3], size) if sub else random.uniform(-5, 4, size)
        return sub, k * (ratio + (sub != "") * random.choice([-1, 1], size) * 10 ** -random.uniform(1, 17, size))
    if sub:
        n = random.integers(1, 9, size)
        tips = np.where((n >= 3) & (random.random(size) < 0.5), np.sqrt(np.maximum(n * n / 4 - 1, 0)), n / 2)
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
        options = {"direction": str(direction)} if inertia else {"body": "oblate" if oblate else "prolate"}
        if not inertia and number > 1 and random.random() < 0.1:
            names = {way: np.unique(given[:4]), "rho": np.unique(random.uniform(0, 4, 150))}
            places = random.choice(names[way].size * 150, 60, replace=False)
            method = "auto" if method in ("rk4", "dop853") else str(method)
            true = _true_satellite(way, False, 1, oblate)
            yield Batch("satellite", f"{kind}, map", names, true, None, options, method, rtol, "", (way, "rho"), places)
            used += 60
            continue
        region = f"{kind}{', ' + sub if sub else ''}{', inertia ratio' if inertia else ''}"
        yield Batch("satellite", region, names, _true_satellite(way, inertia, direction, oblate), None, options,
                    str(method), rtol)  # fmt: skip
        used += number


def _draw_inertia(random, size):
    sub = random.choice(["", "special", "near 1"])
    if sub == "special":
        return sub, random.choice(
            [0.0, 2.0, 0.5, 1.5, 11 / 15, 8 / 9, 59 / 63, 4 / 3, 31 / 27, 13 / 12, 1.25, 1e-300], size
        )
    if sub == "near 1":
        return sub, 1 + random.choice([-1, 1], size) * 10 ** -random.uniform(1, 5, size)
    return sub, np.where(random.random(size) < 0.5, random.uniform(0, 0.98, size), random.uniform(1.02, 2, size))


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
    x = _edge(random, lambda x: _factors(solved(WAYS[way], given, rates, x, 1.0, oblate, 1e-31)), low, high)
    if x is None:
        return None
    return np.full(size, given), beside(random, x, size)


def _true_satellite(way, inertia, direction, oblate):
    name = "inertia_ratio" if inertia else "rho"

    def truth(given, answer):
        rates = INERTIA if inertia else RHO
        ok = _tractable(given, way, name) & (answer["status"] == 0)
        values, other = (np.broadcast_to(given[x], ok.shape) for x in (way, name))
        out = np.full((ok.size, 12), np.nan)
        out[ok] = solved(WAYS[way], values[ok], rates, other[ok], float(direction), oblate)
        k = {"k": values, "one_minus_k": 1 - values, "amplitude": np.sin(values)}[way]
        rho = direction / np.sqrt(3 * np.abs(1 - other)) if inertia else other
        body = other > 1 if inertia else np.full(ok.shape, oblate)
        short = {
            "k": 1 - values,
            "one_minus_k": values,
            "amplitude": 2 * np.sin((pi / 2 - values + 6.123233995736766e-17) / 2) ** 2,
        }[way]
        found = hill_outputs(out, answer, True)
        found["period"] = 2 * out[:, 8], 2 * out[:, 9], 1e-29 * out[:, 8]
        grows, _low, doubt = found["exponent"]
        with np.errstate(all="ignore"):
            turns = _long(out, 8) * 2 / (2 * LONG_PI) * _rho_long(rho, other, inertia)
            found["exponent_per_orbit"] = grows / turns, 0.0, doubt / turns + 8 * ULP * np.abs(grows / turns)
        wrong = found["wrong"]
        wrong["lyapunov certifies what is not stable"] = (answer["lyapunov"] == 1) & found.pop("unstable")
        with np.errstate(invalid="ignore"):  # float64 counts zeros over 20 periods only where it knows D in one
            known = ok & (answer["discriminant_error"] < 1e-3 * np.maximum(1.0, np.abs(answer["discriminant"])))
        rough = rough_rotation(k, short, rho, body, known)
        with np.errstate(invalid="ignore"):
            # its Runge-Kutta steps add up to an error of about 1e-4, which D feels times the squares of the factors
            told = np.abs(out[:, :8:2]).max(axis=1) ** 2 < LOUD
            wrong["rotation number"] = told & (np.abs(np.abs(answer["rotation_number"]) - rough) > 0.08)
        return found

    return truth


LOUD = 1e3  # squares of factors from which on a rough D says nothing
LONG_PI = LONG(3.141592653589793) + LONG(1.2246467991473532e-16)


def _rho_long(rho, alpha, inertia):
    if not inertia:
        return np.abs(rho).astype(LONG)
    return 1 / np.sqrt(3 * np.abs(1 - alpha.astype(LONG)))


def _tractable(given, way, name):
    """Points that are cheap enough to hold against the truth."""
    values, other = np.broadcast_arrays(np.asarray(given[way], float), np.asarray(given[name], float))
    k = {"k": values, "one_minus_k": 1 - values, "amplitude": np.sin(values)}[way]
    with np.errstate(all="ignore"):
        rho = other if name == "rho" else 1 / np.sqrt(3 * np.abs(1 - other))
    return (
        np.isfinite(rho)
        & (np.abs(rho) / np.maximum(k, 1) < 3e3)
        & (values != {"k": 1.0, "one_minus_k": 0.0, "amplitude": 9.0}[way])
    )


def _long(out, i):
    return out[:, i].astype(LONG) + out[:, i + 1]


def hill_outputs(out, answer, half):
    """What follows from the factors of `half` a period or of the whole, and which verdicts are wrong."""
    doubt = out[:, 10]
    y1, y2, d1, d2 = (_long(out, i) for i in (0, 2, 4, 6))
    found = {name: (out[:, 2 * i], out[:, 2 * i + 1], doubt) for i, name in enumerate(("y1", "y2", "dy1", "dy2"))}
    with np.errstate(all="ignore"):
        if half:
            minus, plus = d1 * y2, y1 * d2  # (D - 2) / 4 and (D + 2) / 4
            dminus = doubt * (np.abs(d1) + np.abs(y2)) + 4 * ULP * np.abs(minus)
            dplus = doubt * (np.abs(y1) + np.abs(d2)) + 4 * ULP * np.abs(plus)
            trace = np.where(np.abs(minus) < np.abs(plus), 2 + 4 * minus, 4 * plus - 2)
            dtrace = 4 * np.minimum(dminus, dplus) + 4 * ULP * np.abs(trace)
        else:
            # the trace, and its distance from 2 and -2, in double-double
            high, low = _two(out[:, 0], out[:, 6])
            low = low + out[:, 1] + out[:, 7]
            trace = high.astype(LONG) + low
            minus, plus = ((high - 2).astype(LONG) + low) / 4, ((high + 2).astype(LONG) + low) / 4
            dminus = dplus = doubt
            dtrace = 2 * doubt + 2 * ULP * np.abs(trace)
        unstable = (minus > dminus) | (plus < -dplus)
        stable = (minus < -dminus) & (plus > dplus)
        growth = np.where(minus > 0, minus, np.where(plus < 0, -plus, 0))
        slack = np.where(minus > 0, dminus, np.where(plus < 0, dplus, np.minimum(dminus, dplus)))
        exponent = 2 * np.arcsinh(np.sqrt(growth))
        about = 2 * np.arcsinh(np.sqrt(growth + slack)) - 2 * np.arcsinh(np.sqrt(np.maximum(growth - slack, 0)))
        found["exponent"] = exponent, 0.0, about.astype(float) + 8 * ULP * exponent.astype(float)
        found["discriminant"] = trace, 0.0, dtrace.astype(float)
        theta = np.where(minus > 0, 0, np.where(plus < 0, LONG_PI / 2, np.arctan2(np.sqrt(-minus), np.sqrt(plus))))
        dtheta = _angle_doubt(minus, plus, dminus, dplus)
        fraction = theta / LONG_PI  # of theta / 2 pi, theta in [0, pi]
        said = answer["rotation_number"]
        whole = np.rint(np.asarray(said, LONG) - fraction), np.rint(np.asarray(said, LONG) + fraction)
        near, other = whole[0] + fraction, whole[1] - fraction
        true = np.where(np.abs(near - said) < np.abs(other - said), near, other)
        found["rotation_number"] = true, 0.0, dtheta + 8 * ULP * (1 + np.abs(true).astype(float))
    verdict = answer["verdict"]
    found["wrong"] = {
        "verdict": ((verdict == 1) & unstable) | ((verdict == 0) & stable),
        "marginal": (verdict == 2) & ((minus < -dminus) | (minus > dminus)) & ((plus < -dplus) | (plus > dplus)),
    }
    found["unstable"] = unstable
    return found


def _two(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _angle_doubt(minus, plus, dminus, dplus):
    """What the doubts make of theta / 2 pi."""
    with np.errstate(all="ignore"):
        ends = [
            np.arctan2(np.sqrt(np.maximum(-minus + s * dminus, 0)), np.sqrt(np.maximum(plus - s * dplus, 0)))
            for s in (-1, 1)
        ]
        return (np.abs(ends[1] - ends[0]) / LONG_PI).astype(float)


def rough_rotation(k, short, rho, oblate, use):
    """The rotation number to about 0.05, by counting zeros of a solution in 20 periods."""
    out = np.empty(len(k))
    hill_truth.rough(*(np.ascontiguousarray(x, float) for x in (k, short, rho)), np.ascontiguousarray(oblate, bool),
           np.ascontiguousarray(use & (np.abs(short) > 1e-200) & (k < 1e6), bool), out)  # fmt: skip
    return out


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
            x = _edge(random, lambda x, fixed=fixed: _factors(_mathieu_truth(x, fixed)), -2 * scale - 1, 20.0, 24)
            if x is None:
                continue
            a, q = beside(random, x, number), np.full(number, fixed)
        yield Batch("mathieu", kind, {"a": a, "q": q}, _true_mathieu, None, {}, method, rtol)
        used += number


def _mathieu_truth(a, q):
    a, q = np.broadcast_arrays(np.asarray(a, float), np.asarray(q, float))
    points = np.column_stack([a, -2 * q, 0 * q, 0 * q])
    out = np.empty((len(points), 12))
    hill_truth.own_points(COSINE, points, np.full(len(points), 9e9), (pi / 2, 6.123233995736766e-17), TOLERANCE, out)
    return out


def _true_mathieu(given, answer):
    out = _mathieu_truth(given["a"], given["q"])
    found = hill_outputs(out, answer, True)
    found.pop("unstable")
    return found


# Equations of one's own

PERIOD = 1.0


@lru_cache(maxsize=8)
def own_scene(name):
    """An equation of one's own, p = (a, b, c, d)."""
    from math import cos, sin

    def two_harmonics(u, p):
        return p[0] + p[1] * cos(2 * u) + p[2] * cos(4 * u)

    def not_even(u, p):
        return p[0] + p[1] * cos(2 * u) + p[2] * sin(4 * u)

    def stairs(u, p):
        return p[0] if u < p[2] else p[1]

    def lorentz(u, p):
        x = (u - p[2]) / p[3]
        return p[0] + p[1] / (1 + x * x)

    names = ("a", "b", "c", "d")
    made = {
        "two_harmonics": dict(z=two_harmonics, period=pi, even=True),
        "not_even": dict(z=not_even, period=pi),
        "stairs": dict(z=stairs, period=PERIOD, breaks=lambda p: p[2]),
        "lorentz": dict(z=lorentz, period=PERIOD),
    }[name]
    return survey.hill(made.pop("z"), parameters=names, **made)


KINDS = {"two_harmonics": COSINE, "not_even": NOT_EVEN, "stairs": STAIRS, "lorentz": LORENTZ}


def own(random, size):
    name = str(random.choice(list(KINDS)))
    used = 0
    while used < size:
        number, rtol = int(random.choice([1, 16, 48])), accuracy(random)
        method = str(random.choice(["auto", "auto", "taylor16", "magnus6", "dop853"]))
        number = min(number, 4) if method == "dop853" else number
        p = np.zeros((number, 4))
        region = "generic"
        if name in ("two_harmonics", "not_even"):
            p[:, 0], p[:, 1:3] = (
                random.uniform(-5, 30, number),
                random.normal(size=(number, 2)) * 10 ** random.uniform(-8, 1),
            )
            if random.random() < 0.4:
                row = p[0].copy()
                x = _edge(random, lambda x, row=row: _own_margin(name, x, row), -5, 30, 20)
                if x is not None:
                    region, p[:] = "beside an edge", row
                    p[:, 0] = beside(random, x, number)
        elif name == "stairs":
            p[:, :2] = random.uniform(-30, 200, (number, 2))
            p[:, 2] = random.uniform(1e-6, 1 - 1e-6, number)
            if random.random() < 0.4:
                p[:, 2] = random.choice([0.0, 1.0, 0.5, 1e-12, 1 - 1e-12])
            if random.random() < 0.4:
                row = p[0].copy()
                x = _edge(random, lambda x, row=row: _own_margin(name, x, row), -5, 60, 20)
                if x is not None:
                    region, p[:] = "beside an edge", row
                    p[:, 0] = beside(random, x, number)
        else:
            width = 10 ** random.uniform(-4, -0.5)
            region = "spike narrower than 0.0033 T" if width < 0.0033 else "spike"
            p[:, 0], p[:, 1] = (
                random.uniform(0, 60, number),
                random.normal(size=number) / width * 10 ** random.uniform(-1, 1),
            )
            p[:, 2], p[:, 3] = random.uniform(0.1, 0.9, number), width
        given = dict(zip(("a", "b", "c", "d"), p.T, strict=True))
        yield Batch(f"own {name}", region, given, _true_own(name), own_scene(name), {}, method, rtol,
                    f"own_scene({name!r})")  # fmt: skip
        used += number


def _own_truth(name, p):
    out = np.empty((len(p), 12))
    p = np.ascontiguousarray(p)
    ends = p[:, 2].copy() if name == "stairs" else np.full(len(p), 9e9)
    length = {"two_harmonics": (pi / 2, 6.123233995736766e-17), "not_even": (pi, 1.2246467991473532e-16)}.get(
        name, (PERIOD, 0.0)
    )
    hill_truth.own_points(KINDS[name], p, ends, length, TOLERANCE, out)
    return out


def _own_margin(name, x, row):
    p = np.tile(row, (len(x), 1))
    p[:, 0] = x
    out = _own_truth(name, p)
    if name == "two_harmonics":
        return _factors(out)
    trace = out[:, 0] + out[:, 6]
    return np.column_stack([trace - 2, trace + 2])


def _true_own(name):
    def truth(given, answer):
        p = np.column_stack([given[x] for x in ("a", "b", "c", "d")])
        out = np.full((len(p), 12), np.nan)
        ok = answer["status"] == 0
        out[ok] = _own_truth(name, p[ok])
        found = hill_outputs(out, answer, name == "two_harmonics")
        found.pop("unstable")
        return found

    return truth
