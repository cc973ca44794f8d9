"""Points of Hill's equation: the satellite in all ways of naming it, Mathieu's equation, and equations of one's own."""

from functools import lru_cache
from math import cos, pi, sin

import numpy as np
from mpmath import mp, mpf

import survey
from attack import hill_truth
from attack.compare import Batch
from attack.hill_truth import AMPLITUDE, BENT, COSINE, HARMONICS, INERTIA, LORENTZ, ONE_MINUS_K, RHO, TWO_PI, K

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
            chosen = random.choice(names[way].size * 150, 60, replace=False)
            method = "auto" if method in ("rk4", "dop853") else str(method)
            true = _true_satellite(way, False, 1, oblate)
            yield Batch("satellite", f"{kind}, map", names, true, None, options, method, rtol, "", (way, "rho"), chosen)
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
        with np.errstate(invalid="ignore"):
            # its Runge-Kutta steps add up to an error of about 1e-4, which D feels times the squares of the factors
            known = ok & (np.abs(out[:, :8:2]).max(axis=1) ** 2 < LOUD)
            off = np.abs(np.abs(answer["rotation_number"]) - rough_rotation(k, short, rho, body, known))
            wrong["rotation number"] = known & (off > 0.08 + answer["rotation_number_error"])
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
    quarter = np.tile([pi / 2, 6.123233995736766e-17], (len(points), 1))
    hill_truth.own_points(COSINE, points, np.full(len(points), np.inf), quarter, TOLERANCE, out)
    return out


def _true_mathieu(given, answer):
    out = _mathieu_truth(given["a"], given["q"])
    found = hill_outputs(out, answer, True)
    found.pop("unstable")
    return found


# Equations of one's own


def harmonics(u, p):
    x = TWO_PI * u / p[9]
    even = p[1] * cos(x) + p[2] * cos(2 * x) + p[3] * cos(3 * x) + p[4] * cos(4 * x)
    return p[0] + even + p[5] * sin(x) + p[6] * sin(2 * x) + p[7] * sin(3 * x) + p[8] * sin(4 * x)


def meissner(u, p):
    return p[0] if u < p[2] else p[1]


def meissner_even(u, p):
    return p[0] if u < p[2] or 1 - u < p[2] else p[1]


def bent(u, p):
    return p[0] + p[1] * u if u < p[4] else p[2] + p[3] * cos(6 * u)


def lorentz(u, p):
    x = (u - p[2]) / p[3]
    return p[0] + p[1] / (1 + x * x)


SHORT = ("a", "b", "c", "d")
LONG_NAMES = ("a", "c1", "c2", "c3", "c4", "s1", "s2", "s3", "s4", "T")
# z, parameters, kind of its truth, and the rest that survey.hill is given; z is not that of a smooth period but for
# the harmonics, so 0 is a break
OWN = {
    "harmonics": (harmonics, LONG_NAMES, HARMONICS, dict(period=lambda p: p[9])),
    "harmonics even": (harmonics, LONG_NAMES, HARMONICS, dict(period=lambda p: p[9], even=True)),
    "meissner": (meissner, SHORT[:3], None, dict(period=1.0, breaks=lambda p: [0.0, p[2]])),
    "meissner even": (meissner_even, SHORT[:3], None, dict(period=1.0, breaks=lambda p: p[2], even=True)),
    "bent": (bent, (*SHORT, "place"), BENT, dict(period=1.0, breaks=lambda p: [0.0, p[4]])),
    "spike": (lorentz, SHORT, LORENTZ, dict(period=1.0, breaks=0.0)),
    "spike named": (lorentz, SHORT, LORENTZ, dict(
        period=1.0, breaks=lambda p: [0.0, p[2] - 4 * p[3], p[2], p[2] + 4 * p[3]])),
}  # fmt: skip
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
        method = str(random.choice(["auto", "auto", "auto", "auto", "taylor16", "magnus6", "dop853"]))
        number = min(number, 4) if method == "dop853" else number
        draw = _draw_harmonics if name.startswith("harmonics") else _draw_spikes if "spike" in name else _draw_pieces
        region, p, low, high = draw(random, name, number)
        if random.random() < 0.2 and not region.startswith("narrow"):
            row = p[0].copy()
            x = _edge(random, lambda x, row=row, name=name: _own_margin(name, x, row), low, high, 20)
            if x is not None:
                region, p[:] = "beside an edge", row
                p[:, 0] = beside(random, x, number)
        given = dict(zip(OWN[name][1], p.T, strict=True))
        yield Batch(f"own {name}", region, given, _true_own(name), own_scene(name), {}, method, rtol,
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
    p[:, 1 : 1 + number] = random.uniform(-1, 1, (size, number)) * np.reshape(strength, (-1, 1)) / number
    if name == "harmonics":
        p[:, 5 : 5 + number] = random.uniform(-1, 1, (size, number)) * np.reshape(strength, (-1, 1)) / number
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
        kind, p[:, :-1] = "special", random.choice([0.0, 1e-300, -1e-30, pi * pi, 4 * pi * pi, 1e4], p[:, :-1].shape)
    return kind, p, -5.0, 60.0


def _draw_spikes(random, name, size):
    narrow = name == "spike" and random.random() < NARROW
    width = 10 ** (random.uniform(-4, -2.5) if narrow else random.uniform(-4 if "named" in name else -1.5, -0.5))
    p = np.empty((size, 4))
    p[:, 0] = random.uniform(0, 60, size)
    p[:, 1] = random.normal(size=size) / width * 10 ** random.uniform(-1, 1)
    p[:, 2], p[:, 3] = random.uniform(0.1, 0.9, size), width
    if "named" in name:
        p[:, 3] = np.minimum(p[:, 3], 0.24 * np.minimum(p[:, 2], 1 - p[:, 2]))
    return "narrow spike" if narrow else "spike", p, -5.0, 60.0


def _own_truth(name, p):
    p = np.ascontiguousarray(p)
    _, _, kind, more = OWN[name]
    if kind is None:
        return np.array([_steps_truth(row, more.get("even", False)) for row in p]).reshape(-1, 12)
    ends = p[:, 4].copy() if kind == BENT else np.full(len(p), np.inf)
    length = p[:, 9] if kind == HARMONICS else np.ones(len(p))
    if more.get("even"):
        length = length / 2
    out = np.empty((len(p), 12))
    hill_truth.own_points(kind, p, ends, np.column_stack([length, 0 * length]), TOLERANCE, out)
    return out


def _steps_truth(row, even):
    """As `hill_truth.own_points` for z = a before the break and b behind it: the closed form, 50 digits."""
    with mp.workdps(50):
        a, b, place = (mpf(float(x)) for x in row)
        end = mpf(0.5 if even else 1)
        flow = mp.eye(2)
        for z, length in ((a, min(place, end)), (b, end - min(place, end))):
            root = mp.sqrt(abs(z))
            x = root * length
            if z > 0:
                c, s = mp.cos_sin(x)
            else:
                c, s = mp.cosh(x), mp.sinh(x)
            # sin(x) / root loses nothing but where z is 0
            step = mp.matrix([[c, s / root if root else length], [-s * root if z > 0 else s * root, c]])
            flow = step * flow
        out = []
        for value in (flow[0, 0], flow[0, 1], flow[1, 0], flow[1, 1]):
            high = float(value)
            out += [high, float(value - high)]
        biggest = max(1.0, *(abs(x) for x in out))
    return [*out, float(end), 0.0, 1e-31 * biggest, 2.0]


def _own_margin(name, x, row):
    p = np.tile(row, (len(x), 1))
    p[:, 0] = x
    out = _own_truth(name, p)
    if OWN[name][3].get("even"):
        return _factors(out)
    trace = out[:, 0] + out[:, 6]
    return np.column_stack([trace - 2, trace + 2])


def _true_own(name):
    def truth(given, answer):
        p = np.column_stack([given[x] for x in OWN[name][1]])
        out = np.full((len(p), 12), np.nan)
        ok = answer["status"] == 0
        out[ok] = _own_truth(name, p[ok])
        found = hill_outputs(out, answer, OWN[name][3].get("even", False))
        found.pop("unstable")
        return found

    return truth
