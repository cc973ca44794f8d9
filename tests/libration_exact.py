"""The normal form at L4 to all digits, that the tests of the libration scene share."""

import json
from importlib import resources

import numpy as np
from mpmath import mp, mpf

from survey.kernels.libration.coefficients import FORMS, LABELS, NAMES

REFERENCE = json.loads(resources.files("survey.reference").joinpath("libration.json").read_text())
CONSTANTS = REFERENCE["constants"]
CRITICAL = [mpf(CONSTANTS[name]) for name in ("mu1_w1=2w2", "mu2_w1=3w2", "mu_R")]
DIGITS = 80


def factors(w1, w2):
    """The FORM_FACTORS from frequencies of any type; exchanging w1 and -w2 exchanges the two modes."""
    u, v = w1 * w1, w2 * w2
    return (
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


def form(name, w1, w2):
    """A closed form, in the arithmetic of w1 and w2."""
    common, powers, numerator = FORMS[name]
    value = 0 * w1
    for coefficient in reversed(numerator):
        value = value * w2 * w2 + coefficient
    value /= common
    for factor, power in zip(factors(w1, w2), powers, strict=True):
        value *= factor**power
    return value


def frequencies(mu):
    """omega1, omega2 as mpf; `mu` is a float or an mpf."""
    with mp.workdps(DIGITS):
        x = mpf(27) / 4 * mpf(mu) * (1 - mpf(mu))
        u = (1 + mp.sqrt(1 - 4 * x)) / 2
        return mp.sqrt(u), mp.sqrt(x / u)


def forms(mu):
    """All closed forms as mpf, {name: value}."""
    with mp.workdps(DIGITS):
        w1, w2 = frequencies(mu)
        return {name: form(name, w1, w2) for name in NAMES}


def on_ray(mu, ray=2):
    """M on the ray (alpha, 1, beta) of (3.11), straight from the coefficients."""
    with mp.workdps(DIGITS):
        w1, w2 = frequencies(mu)
        c = forms(mu)
        a20, a11, a02 = c["a20"], c["a11"], c["a02"]
        root = mp.sqrt(a11 * a11 - 4 * a20 * a02) * (1 if ray == 1 else -1)
        alpha = (root - a11) / (2 * a20)
        beta = w2 - alpha * w1
        return sum(
            c[label] * alpha ** int(label[0]) * beta ** int(label[2]) for label in LABELS[6:]
        )


def masses(number, seed=0):
    """Random mass ratios below mu_R: uniform, logarithmic from 1e-9, and ever nearer to mu1, mu2 and mu_R."""
    random = np.random.default_rng(seed)
    parts = [random.uniform(0, 0.0385, number), 10 ** random.uniform(-9, -1.42, number)]
    for critical in map(float, CRITICAL):
        parts += [
            critical * (1 + side * 10 ** -random.uniform(1, 15.5, number)) for side in (-1, 1)
        ]
        parts.append([critical])
    mu = np.concatenate([*parts, [1e-9, 1e-100]])
    return mu[mu < float(CRITICAL[2])]
