"""Carlson's R_F and R_J, whose second and third argument y, z may be conjugate: m = (y + z)/2, g =
sqrt(y z).

By duplication, in real arithmetic; R_J for p > 0, without cancellation as p -> 0.

Source: B. C. Carlson, Numer. Algorithms 10 (1995) 13-26; DLMF 19.36(i).
"""

from math import atan, log1p, sqrt

from survey.kernels.jit import inline

STEPS = 60
CLOSE = 3e-3  # the series leaves 1e-17 of it


@inline
def rf(x, m, g):
    """R_F(x, y, z)."""
    for _ in range(STEPS):
        mean = (x + m + m) / 3.0
        if abs(x - mean) < CLOSE * mean and abs(m - g) * (m + g) < (CLOSE * mean) ** 2:
            break
        shift = sqrt(x) * sqrt(2.0 * (m + g)) + g
        x, m, g = (
            0.25 * (x + shift),
            0.25 * (m + shift),
            0.25 * sqrt(g * g + shift * (2.0 * m + shift)),
        )
    mean = (x + m + m) / 3.0
    a, b = 1.0 - x / mean, 1.0 - m / mean
    bc = b * b - (m - g) * (m + g) / (mean * mean)
    e2, e3 = bc - a * a, a * bc
    fourth = (
        e2 * e2 / 24.0
        - 3.0 * e2 * e3 / 44.0
        - 5.0 * e2**3 / 208.0
        + 3.0 * e3 * e3 / 104.0
        + e2 * e2 * e3 / 16.0
    )
    return (1.0 - e2 / 10.0 + e3 / 14.0 + fourth) / sqrt(mean)


@inline
def rf_complete(above, g):
    """R_F(0, y, z), from above = m + g, which may be all that is left of them: the first duplication."""
    return 2.0 * rf(g, above, sqrt(2.0 * g) * sqrt(above))


@inline
def rc_of_one(s):
    """R_C(1, s), s > 0 (DLMF 19.2.18, 19.2.19)."""
    e = s - 1.0
    if abs(e) < 1e-3:
        return 1.0 - e * (1 / 3 - e * (1 / 5 - e * (1 / 7 - e * (1 / 9 - e * (1 / 11 - e / 13)))))
    root = sqrt(abs(e))
    if e > 0.0:
        return atan(root) / root
    return 0.5 * (2.0 * log1p(root) - _log(s)) / root


@inline
def _log(s):
    return log1p(s - 1.0) if s > 0.5 else -log1p((1.0 - s) / s)


@inline
def rj(x, m, g, p):
    """R_J(x, y, z, p), p > 0."""
    total, factor = 0.0, 1.0
    for _ in range(STEPS):
        mean = (x + m + m + p + p) / 5.0
        if (
            max(abs(x - mean), abs(p - mean)) < CLOSE * mean
            and abs(m - g) * (m + g) < (CLOSE * mean) ** 2
        ):
            break
        first, pair, fourth = sqrt(x), sqrt(2.0 * (m + g)), sqrt(p)
        shift = first * pair + g
        product = (fourth + first) * (p + fourth * pair + g)
        total += factor / product * rc_of_one(2.0 * fourth * (p + shift) / product)
        factor *= 0.25
        g = 0.25 * sqrt(g * g + shift * (2.0 * m + shift))
        x, m, p = 0.25 * (x + shift), 0.25 * (m + shift), 0.25 * (p + shift)
    mean = (x + m + m + p + p) / 5.0
    a, b = 1.0 - x / mean, 1.0 - m / mean
    c = -0.5 * (a + b + b)
    bc = b * b - (m - g) * (m + g) / (mean * mean)
    xyz = a * bc
    e2 = 2.0 * a * b + bc - 3.0 * c * c
    e3, e4, e5 = xyz + 2.0 * e2 * c + 4.0 * c**3, (2.0 * xyz + e2 * c + 3.0 * c**3) * c, xyz * c * c
    series = (
        1.0
        - 3.0 * e2 / 14.0
        + e3 / 6.0
        + 9.0 * e2 * e2 / 88.0
        - 3.0 * e4 / 22.0
        - 9.0 * e2 * e3 / 52.0
    )
    series += 3.0 * e5 / 26.0 - e2**3 / 16.0 + 3.0 * e3 * e3 / 40.0 + 3.0 * e2 * e4 / 20.0
    return factor * series / (mean * sqrt(mean)) + 6.0 * total


@inline
def rj_spread(x, m, g, spread, p):
    """As `rj`, from spread = g^2 - m^2, too: where m < 0, y and z are conjugate, and m + g may
    nearly cancel.
    """
    above = m + g if m >= 0.0 else spread / (g - m)
    first, pair, fourth = sqrt(x), sqrt(2.0 * above), sqrt(p)
    shift, high = first * pair + g, above + first * pair
    root = sqrt(g * g + shift * (2.0 * m + shift)) if m >= 0.0 else sqrt(high * high + spread)
    product = (fourth + first) * (p + fourth * pair + g)
    # the first duplication by hand; without its quarters R_J is an eighth of what it would be, and
    # counts a quarter
    rest = rj(x + shift, high, root, p + shift)
    return 6.0 / product * rc_of_one(2.0 * fourth * (p + shift) / product) + 2.0 * rest
