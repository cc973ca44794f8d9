"""Points of the circular problem's normal form, held against 60 digits of the closed forms."""

from itertools import product

import numpy as np
from mpmath import mp, mpf

from attack.compare import Batch
from attack.hill import LONG, ULP, accuracy, beside

METHODS = ("auto", "auto", "rational", "rational_double", "lie")
CRITICAL = (0.0385208965045513970786520697274, 0.0242938971420523216662227326885, 0.0135160160224525267555750091159,
            0.0109136676772006628897436975729, 0.0163767553558164932157833667016, 0.00278347576233486111776847984938,
            0.0285954792089683170661037585968)  # fmt: skip
DIGITS = 60
VECTORS = np.array([k for k in product(range(-8, 9), range(-8, 9), range(-8, 9, 2)) if 0 < sum(map(abs, k)) <= 8])


def chunk(random, size):
    used = 0
    while used < size:
        method, rtol = str(random.choice(METHODS)), accuracy(random)
        number = int(random.choice([1, 64]))
        kind = str(random.choice(["generic", "critical", "to 0", "to 1/2", "special", "beside"]))
        mu = random.uniform(0, 0.0386, number)
        if kind == "critical":
            mu = np.array([beside(random, random.choice(CRITICAL), 1)[0] for _ in range(number)])
        elif kind == "beside":
            mu = random.choice(CRITICAL, number) * (
                1 + random.choice([-1, 1], number) * 10 ** -random.uniform(1, 15.5, number)
            )
        elif kind == "to 0":
            mu = 10 ** -random.uniform(2, 99, number)
        elif kind == "to 1/2":
            mu = 0.5 - 10 ** -random.uniform(0.4, 16, number)
        elif kind == "special":
            mu = random.choice([1e-100, 0.5, 0.25, 2.0**-10, 2.0**-53, 0.01, 0.0385, 0.03852089650455140], number)
        yield Batch("libration", kind, {"mu": np.clip(mu, 1e-100, 0.5)}, truth, None, {}, method, rtol)
        used += number


def _forms(w1, w2):
    """The closed forms (their integers), in the arithmetic of w1 and w2."""
    from survey.kernels.libration.coefficients import FORMS, LABELS

    u, v = w1 * w1, w2 * w2
    factors = (w1, w2, u, v, u - v, 1 - 5 * u, 1 - 5 * v, 1 - 10 * u, 1 - 10 * v, 4 - u, 4 - v, 9 - 4 * u * v)
    found = {}
    for name in LABELS:
        common, powers, numerator = FORMS[name]
        value = mpf(0)
        for coefficient in reversed(numerator):
            value = value * v + coefficient
        above, below = mpf(1), mpf(common)
        for factor, power in zip(factors, powers, strict=True):
            if power > 0:
                above *= factor**power
            elif power < 0:
                below *= factor**-power
        found[name] = value * above / below
    return found


def _split(x):
    high = float(x)
    return high, float(x - high) if np.isfinite(high) else 0.0


def truth(given, answer):
    from survey.kernels.libration.coefficients import LABELS

    mu = np.asarray(given["mu"], float)
    names = ("omega1", "omega2", "a20", "a11", "a02", "D4", "D6", "M_ray")
    pairs = {name: np.full((2, mu.size), np.nan) for name in names}
    c = np.full((2, mu.size, len(LABELS)), np.nan)
    near, wrong = np.full(mu.size, np.nan, LONG), np.zeros(mu.size, bool)
    with mp.workdps(DIGITS):
        limit = (1 - mp.sqrt(mpf(23) / 27)) / 2
        for i in range(mu.size):
            said = answer["verdict"][i]
            m = mpf(mu[i])
            if m >= limit:
                wrong[i] = said not in ((-1, 0) if m > limit + mpf(2) ** -57 else (-1, 0, 4))
                continue
            if answer["status"][i] != 0:
                continue
            x = mpf(27) / 4 * m * (1 - m)
            s = mp.sqrt(1 - 4 * x)
            u = (1 + s) / 2
            w1, w2 = mp.sqrt(u), mp.sqrt(x / u)
            f = _forms(w1, w2)
            a20 = f["200"] - f["101"] * w1 + f["002"] * w1 * w1
            a11 = f["110"] + f["101"] * w2 - f["011"] * w1 - 2 * f["002"] * w1 * w2
            a02 = f["020"] + f["011"] * w2 + f["002"] * w2 * w2
            D4 = f["200"] * w2 * w2 + f["110"] * w1 * w2 + f["020"] * w1 * w1
            D6 = f["300"] * w2**3 + f["210"] * w2 * w2 * w1 + f["120"] * w2 * w1 * w1 + f["030"] * w1**3
            values = dict(omega1=w1, omega2=w2, a20=a20, a11=a11, a02=a02, D4=D4, D6=D6)
            if a02 > 0 > D4:
                # the root of the quadratic in the sector, however small a20 is
                root = mp.sqrt(a11 * a11 - 4 * a20 * a02)
                alpha = [2 * a02 / (-a11 + side * root) for side in (1, -1)]
                alpha = [t for t in alpha if 0 <= t <= w2 / w1]
                if alpha:
                    beta = w2 - alpha[0] * w1
                    values["M_ray"] = sum(f[n] * alpha[0] ** int(n[0]) * beta ** int(n[2]) for n in LABELS[6:])
            for name, value in values.items():
                pairs[name][:, i] = _split(value)
            for j, name in enumerate(LABELS):
                c[:, i, j] = _split(f[name])
            combination = VECTORS[:, 0] * LONG(1) * _long(w1) - VECTORS[:, 1] * _long(w2) + VECTORS[:, 2]
            near[i] = np.abs(combination).min()
            expected = 1 if (a02 > 0) == (D4 > 0) else 2
            wrong[i] = (said in (1, 2) and said != expected) or (said in (0, 4) and m < limit - mpf(2) ** -56)
            if said == 3:
                wrong[i] = (
                    min(
                        abs(m - mpf(x))
                        for x in ("0.0242938971420523216662227326885", "0.0135160160224525267555750091159")
                    )
                    > mpf(2) ** -58
                )
    found = {name: (high, low, 1e-30 * np.abs(high)) for name, (high, low) in pairs.items()}
    found["c"] = c[0], c[1], 1e-30 * np.abs(c[0])
    found["resonance_distance"] = near, 0.0, np.full(mu.size, 16 * ULP)
    return found | {"wrong": {"verdict": wrong}, "checked": mu > 0.03852089650455141}


def _long(x):
    high, low = _split(x)
    return LONG(high) + LONG(low)
