"""The circular problem's normal form: 60 digits of the closed forms, whose integers are the package's."""

from functools import lru_cache
from itertools import product

import numpy as np
from mpmath import mp, mpf

from survey.kernels.libration.coefficients import FORMS, LABELS

DIGITS = 60
SINGLE = (
    "omega1",
    "omega2",
    "a20",
    "a11",
    "a02",
    "D4",
    "D6",
    "M_ray",
    "discriminant",
    "det_N",
    "det_bordered",
)
RESONANT = ("0.0242938971420523216662227326885", "0.0135160160224525267555750091159")  # mu1, mu2
LONG = np.longdouble
ULP = float(np.finfo(LONG).eps)
VECTORS = np.array(
    [k for k in product(range(-8, 9), range(-8, 9), range(-8, 9, 2)) if 0 < sum(map(abs, k)) <= 8]
)


def _forms(w1, w2):
    """The closed forms (their integers), in the arithmetic of w1 and w2."""
    u, v = w1 * w1, w2 * w2
    factors = (
        w1,
        w2,
        u,
        v,
        u - v,
        1 - 5 * u,
        1 - 5 * v,
        1 - 10 * u,
        1 - 10 * v,
        4 - u,
        4 - v,
        9 - 4 * u * v,
    )
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


@lru_cache(maxsize=20_000)
def _known(mu):
    """{output: (high, low)} at mu < mu_R, "c" as rows; the distance of the nearest resonance; the verdict."""
    with mp.workdps(DIGITS):
        m = mpf(mu)
        x = mpf(27) / 4 * m * (1 - m)
        u = (1 + mp.sqrt(1 - 4 * x)) / 2
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
                values["M_ray"] = sum(
                    f[n] * alpha[0] ** int(n[0]) * beta ** int(n[2]) for n in LABELS[6:]
                )
        values["discriminant"] = a11 * a11 - 4 * a20 * a02
        hessian = mp.matrix(4)
        for i, j, name in ((0, 1, "110"), (0, 2, "101"), (1, 2, "011")):
            hessian[i, j] = hessian[j, i] = f[name]
        for i, (name, w) in enumerate(zip(("200", "020", "002"), (w1, -w2, mpf(1)), strict=True)):
            hessian[i, i], hessian[i, 3], hessian[3, i] = 2 * f[name], w, w
        values["det_N"], values["det_bordered"] = mp.det(hessian[:3, :3]), mp.det(hessian)
        pairs = {name: _split(value) for name, value in values.items()}
        root = mp.sqrt(values["discriminant"])
        rays = [(-a11 + side * root) / (2 * a20) if a20 else mpf("nan") for side in (1, -1)]
        pairs["alpha"] = np.array([_split(x) for x in rays]).T
        pairs["beta"] = np.array([_split(w2 - x * w1) for x in rays]).T
        pairs["c"] = np.array([_split(f[name]) for name in LABELS]).T
        combination = (
            VECTORS[:, 0] * LONG(1) * _long(w1) - VECTORS[:, 1] * _long(w2) + VECTORS[:, 2]
        )
        return pairs, np.abs(combination).min(), 1 if (a02 > 0) == (D4 > 0) else 2


def truth(given, answer):
    mu = np.asarray(given["mu"], float)
    pairs = {name: np.full((2, mu.size), np.nan) for name in SINGLE}
    pairs["c"] = np.full((2, mu.size, len(LABELS)), np.nan)
    pairs |= {name: np.full((2, mu.size, 2), np.nan) for name in ("alpha", "beta")}
    near, wrong = np.full(mu.size, np.nan, LONG), np.zeros(mu.size, bool)
    with mp.workdps(DIGITS):
        limit = (1 - mp.sqrt(mpf(23) / 27)) / 2
        for i, said in enumerate(answer["verdict"]):
            m = mpf(mu[i])
            if m >= limit:
                wrong[i] = said not in ((-1, 0) if m > limit + mpf(2) ** -57 else (-1, 0, 4))
                continue
            if answer["status"][i] != 0:
                continue
            found, near[i], expected = _known(float(mu[i]))
            for name, (high, low) in found.items():
                pairs[name][0][i], pairs[name][1][i] = high, low
            wrong[i] = (said in (1, 2) and said != expected) or (
                said in (0, 4) and m < limit - mpf(2) ** -56
            )
            if said == 3:
                wrong[i] = min(abs(m - mpf(x)) for x in RESONANT) > mpf(2) ** -58
    found = {name: (high, low, 1e-30 * np.abs(high)) for name, (high, low) in pairs.items()}
    found["resonance_distance"] = near, 0.0, np.full(mu.size, 16 * ULP)
    return found | {"wrong": {"verdict": wrong}, "checked": mu > 0.03852089650455141}


def _long(x):
    high, low = _split(x)
    return LONG(high) + LONG(low)
