"""Brun's problem in multiprecision: (S1)-(S6) of `scenes/brun.md`, and what half an ulp of the
inputs changes.
"""

import warnings
from itertools import pairwise

import numpy as np
from mpmath import mp, mpf

NAMES = ("A", "C", "epsilon", "theta0", "p_theta0", "p_psi", "p_phi")
OUTPUTS = ("u_min", "u_max", "period", "precession", "spin", "action")
HALF_ULP = mpf(2) ** -53


def integrals(state):
    """A, C, k, L, a, b and u0 of (A, C, epsilon, theta0, p_theta0, p_psi, p_phi) (S1)."""
    A, C, epsilon, theta, p_theta, b, a = state
    sine, u = mp.sin(theta), mp.cos(theta)
    x = (b - a * u) / sine if sine else mpf(0)
    k = epsilon * A * (A - C)
    return A, C, k, p_theta**2 + x**2 - k * u * u + a * a, a, b, u


def scaled(sign):
    """The same of (l, alpha, beta), for A = C = 1; u0 is not known."""
    return lambda state: (mpf(1), mpf(1), mpf(sign), state[0], state[1], state[2], None)


def quartic(k, L, a, b):
    """Coefficients of P, highest first (S2)."""
    return [-k, mpf(0), k - L, 2 * a * b, L - a * a - b * b]


def real_roots(k, L, a, b):
    c = quartic(k, L, a, b)
    while c[0] == 0:
        c = c[1:]
    # mpmath 1.4 asks for another order of coefficients, which 1.3 does not know
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = mp.polyroots(c, maxsteps=400, extraprec=300)
    return sorted(r.real for r in found if abs(r.imag) < mpf(10) ** -35), c


def turning_points(state):
    """The real roots of P next to u0 on both sides: the nearest is the lower one where P rises."""
    _A, _C, k, L, a, b, u = integrals(state)
    roots, c = real_roots(k, L, a, b)
    near = min(roots, key=lambda r: abs(r - u))
    at = roots.index(near)
    slope = sum(n * x * near ** (n - 1) for n, x in enumerate(reversed(c)) if n)
    return (near, roots[at + 1]) if slope > 0 else (roots[at - 1], near)


def wells(sign, state):
    """The pairs of real roots within [-1, 1] between which P > 0, lower u first."""
    roots, c = real_roots(mpf(sign), *state)
    inside = [r for r in roots if abs(r) <= 1]
    return [(x, y) for x, y in pairwise(inside) if mp.polyval(c, (x + y) / 2) > 0]


def polished(given, ends):
    """The roots of P near `ends`, by Newton's method."""
    _A, _C, k, L, a, b, _u = given
    c = quartic(k, L, a, b)
    found = []
    for u in ends:
        for _ in range(12):
            value = slope = mpf(0)
            for x in c:
                value, slope = value * u + x, slope * u + value
            u -= value / slope
        found.append(u)
    return found


def third(x, y, p):
    """R_J(0, X, Y, p) for x^2 = X, y^2 = Y, by the mean (DLMF 19.22); to the working precision but
    for p -> 0.
    """
    total, weight, root, mean = mpf(0), mpf(1), mp.sqrt(p), mp.agm(x, y).real
    while abs(weight) > mpf(10) ** -mp.dps:
        total += weight
        xy = (x * y).real
        weight *= (root * root - xy) / (root * root + xy) / 2
        root = (root * root + xy) / (2 * root)
        x, y = (x + y) / 2, mp.sqrt(x * y)
    return 3 * mp.pi * total / (4 * mean * p)


def outputs(given, ends, library=True):
    """u_min, u_max, T, Delta_psi, Delta_phi, J by (S5), (S6), (S14), with mpmath's R_J or, faster,
    the mean.
    """
    A, C, k, L, a, b, _u = given
    low, high = ends
    S = low + high

    def q(u):
        return k * u * u + k * S * u + L - k + k * (S * S - low * high)

    g = mp.sqrt(q(low) * q(high))
    s = L - k + 3 * k * S * S / 2
    period = 2 * mp.pi * A / mp.agm(mp.sqrt((s + g) / 2), mp.sqrt(g))
    spread = mp.sqrt(mp.mpc(s * s - g * g))
    X, Y = s + spread, s - spread

    def half(near, far, square):
        p = square * near / far
        rj = mp.elliprj(0, X, Y, p).real if library else third(mp.sqrt(X), mp.sqrt(Y), p)
        return period / (2 * far) + 2 * A * (high - low) * square / (3 * far * far) * rj

    up = (b - a) * half(1 - high, 1 - low, q(low)) / A if b != a else mpf(0)
    down = (b + a) * half(1 + low, 1 + high, q(high)) / A if b != -a else mpf(0)
    level = L - (k * low * high + L - k + k * (S * S - low * high)) / 2
    action = (period / A * level + 4 * mp.elliprg(0, X, Y).real - (b - a) * up - (b + a) * down) / (
        2 * mp.pi
    )
    return [low, high, period, up + down, a * (1 / C - 1 / A) * period + down - up, action]


def truth(point, given=integrals, ends=None):
    """The exact outputs at a point of float64 numbers, and what half-ulp changes of its numbers add up to."""
    state = [mpf(float(x)) for x in point]
    ends = ends or turning_points(state)
    exact = outputs(given(state), ends)
    here = outputs(given(state), ends, library=False)
    floor, step = [mpf(0)] * len(exact), mpf(10) ** -22
    for i, x in enumerate(state):
        if x:
            moved = given([*state[:i], x * (1 + step), *state[i + 1 :]])
            there = outputs(moved, polished(moved, ends), library=False)
            floor = [
                f + abs(t - h) / step * HALF_ULP for f, t, h in zip(floor, there, here, strict=True)
            ]
    return exact, floor


def draw(random):
    """(kind, point): hard cases of every kind that is known."""
    A, C = 10 ** random.uniform(-0.5, 0.5), random.uniform(0.05, 1.999)
    sign = random.choice([-1.0, 1.0], size=3)
    epsilon = sign[0] * 10 ** random.uniform(-6, 1)
    theta = random.uniform(0.01, 3.13)
    p, b, a = random.normal(size=3)
    kind = random.choice(KINDS)
    k = epsilon * A * A * (1 - C)
    close = 1 + sign[1] * 10 ** random.uniform(-13, -2)
    if kind == "near the pole +1":
        theta, b = 10 ** random.uniform(-8, -1), a * close
    elif kind == "near the pole -1":
        theta, b = np.pi - 10 ** random.uniform(-8, -1), -a * close
    elif kind == "passing a pole closely":
        b = sign[2] * a * close
    elif kind == "tiny field":
        epsilon = sign[0] * 10 ** random.uniform(-18, -5)
    elif kind == "fast spin":
        a *= 10 ** random.uniform(1, 8)
    elif kind in ("near a regular precession", "near a saddle"):
        saddle = kind == "near a saddle"
        k = abs(k) if saddle else k
        u = random.uniform(-0.33, 0.33) if saddle else random.uniform(-0.99, 0.99)
        y = sign[1] * np.sqrt(abs(k)) * 10 ** random.uniform(-0.4, 0.7)
        if saddle:
            wide = k / 2 * np.sqrt((1 - u * u) * (1 - 9 * u * u))
            y = sign[1] * np.sqrt(k / 2 * (1 - 3 * u * u) + wide * random.uniform(-1, 1))
        # (S8)
        a = u * (y - k / y)
        b = y - k * u * u / y
        theta = np.arccos(u)
        p = 10 ** random.uniform(-12, -1)
        epsilon = k / (A * A * (1 - C))
    elif kind == "near the upright rotation":
        k = -abs(k)
        a, epsilon = random.uniform(-2.5, 2.5) * np.sqrt(-k), k / (A * A * (1 - C))
        theta, p, b = 10 ** random.uniform(-9, -2), 10 ** random.uniform(-9, -2), a * close
    elif kind == "no spin":
        a, b = (0.0, b) if sign[1] > 0 else (a, 0.0)
    return kind, np.array([A, A * C, epsilon, theta, p, b, a])


KINDS = ("any", "near the pole +1", "near the pole -1", "passing a pole closely", "tiny field", "fast spin", "no spin",
         "near a regular precession", "near a saddle", "near the upright rotation")  # fmt: skip


def draw_scaled(random):
    """(kind, sign, (l, alpha, beta)): hard cases."""
    sign, side = random.choice([-1, 1]), random.choice([-1.0, 1.0])
    kind = random.choice(SCALED)
    alpha, beta = random.normal(size=2)
    close = 10 ** random.uniform(-13, -2)
    u, y = random.uniform(-0.99, 0.99), side * 10 ** random.uniform(-0.4, 0.7)
    if kind == "near a saddle":
        sign, u = 1, random.uniform(-0.33, 0.33)
        wide = 0.5 * np.sqrt((1 - u * u) * (1 - 9 * u * u)) * random.uniform(-1, 1)
        y = side * np.sqrt(0.5 * (1 - 3 * u * u) + wide)
    if kind in ("near a saddle", "near a regular precession"):
        alpha, beta = u * (y - sign / y), y - sign * u * u / y  # (S8)
        level = y * y * (1 - u * u) - sign * u * u + alpha * alpha
        return (
            kind,
            sign,
            (level + close * random.choice([-1.0, 1.0]) * max(1.0, abs(level)), alpha, beta),
        )
    if kind == "passing a pole closely":
        beta = side * alpha * (1 + close * random.choice([-1.0, 1.0]))
    elif kind == "near the upright rotation":
        beta = side * alpha * (1 + close)
        return kind, sign, (alpha * alpha - sign + random.uniform(0, 100) * close, alpha, beta)
    elif kind == "fast spin":
        alpha *= 10 ** random.uniform(1, 8)
    elif kind == "tiny field":
        large = 10 ** random.uniform(2, 9)
        alpha, beta = large * alpha, large * beta
    level = max(alpha * alpha, beta * beta) * (1 + 10 ** random.uniform(-3, 1)) + random.uniform(
        -1, 1
    )
    return kind, sign, (level, alpha, beta)


SCALED = ("any", "passing a pole closely", "near a regular precession", "near a saddle", "near the upright rotation",
          "fast spin", "tiny field")  # fmt: skip
