"""The quartic P4 of the flow without Barnett-London effect, b = 0: (63)-(68), with error bounds.

    u = tan(phi/2),  u'^2 = P4(u) / 4,  P4 = a0 u^4 + 4 a1 u^3 + 6 a2 u^2 + 4 a3 u + a4 = (1 + u^2)^2 w^2

Rows are systems: d, c23, s2, s3 and n, all over A11, or the coefficients a0 to a4.

Source: M. E. Lesina, Ya. V. Zinovyeva (2004), as corrected in `scenes/gyrostat.md`.
"""

from fractions import Fraction

import numpy as np

from survey.kernels.math.roundoff import EPS

BINOMIALS = np.array([1.0, 4.0, 6.0, 4.0, 1.0])


def square_of_w(d, c23, s2, s3, phi):
    """w^2 - n at phi, of (63), and the sum of its terms' sizes."""
    terms = (
        0.5 * d * np.cos(2 * phi),
        -c23 * np.sin(2 * phi),
        2 * s2 * np.sin(phi),
        2 * s3 * np.cos(phi),
    )
    return sum(terms), sum(np.abs(term) for term in terms) + np.abs(phi) * 0.0


def coefficients(d, c23, s2, s3, n, n_bar):
    """a0 to a4 of (65), (rows, 5), and their error bounds; that of n is `n_bar`."""
    half = 0.5 * d
    a = np.column_stack([half + n - 2 * s3, s2 + c23, n / 3 - half, s2 - c23, half + n + 2 * s3])
    size = np.abs(d) + np.abs(n) + 2 * np.abs(s3)
    outer, inner = n_bar + 2 * EPS * size, EPS * (np.abs(s2) + np.abs(c23))
    return a, np.column_stack([outer, inner, n_bar / 3 + EPS * size, inner, outer])


def system(a):
    """d, c23, s2, s3, n of coefficients a (rows, 5) or of five numbers."""
    a0, a1, a2, a3, a4 = a.T if isinstance(a, np.ndarray) else a
    d = (a0 + a4 - 6 * a2) / 4
    return d, (a1 - a3) / 2, (a1 + a3) / 2, (a4 - a0) / 4, 3 * a2 + 3 * d / 2


def invariants(a, bars):
    """((g2, bound), (g3, bound), (G, bound)) of (67), (68)."""
    a0, a1, a2, a3, a4 = a.T
    b0, b1, b2, b3, b4 = bars.T
    sizes = np.abs(a).T
    g2 = a0 * a4 - 4 * a1 * a3 + 3 * a2**2
    g3 = a0 * a2 * a4 + 2 * a1 * a2 * a3 - a2**3 - a4 * a1**2 - a0 * a3**2
    s0, s1, s2, s3, s4 = sizes
    d2 = (
        b0 * s4
        + s0 * b4
        + 4 * (b1 * s3 + s1 * b3)
        + 6 * s2 * b2
        + 4 * EPS * (s0 * s4 + 4 * s1 * s3 + 3 * s2**2)
    )
    d3 = (
        (s2 * s4 + s3**2) * b0
        + 2 * (s2 * s3 + s4 * s1) * b1
        + (s0 * s4 + 2 * s1 * s3 + 3 * s2**2) * b2
    )
    d3 = d3 + 2 * (s1 * s2 + s0 * s3) * b3 + (s0 * s2 + s1**2) * b4
    d3 = d3 + 5 * EPS * (s0 * s2 * s4 + 2 * s1 * s2 * s3 + s2**3 + s4 * s1**2 + s0 * s3**2)
    G = g2**3 - 27 * g3**2
    wide = 3 * (np.abs(g2) + d2) ** 2 * d2 + 54 * (np.abs(g3) + d3) * d3
    return (g2, d2), (g3, d3), (G, wide + 4 * EPS * (np.abs(g2) ** 3 + 27 * g3**2))


def roots(a, bars):
    """Finite roots (rows, 4), real ones first and ascending, NaN where there are fewer, and the
    radii of their discs.

    The discs |z - z_k| <= 4 |P(z_k)| / |a0 prod (z_k - z_j)| hold all roots, each isolated one its own (B. T. Smith,
    Journal of the ACM 17 (1970) 661-674); P(z_k) by its value and what that may be off.
    """
    found, radii = np.full((len(a), 4), complex(np.nan, np.nan)), np.full((len(a), 4), np.nan)
    rows, bars = a * BINOMIALS, bars * BINOMIALS
    some = np.isfinite(rows) & (rows != 0.0)
    leading, trailing = some.argmax(axis=1), some[:, ::-1].argmax(axis=1)
    for first in range(4):
        for last in range(5 - first):
            alike = (
                np.isfinite(rows).all(axis=1)
                & some.any(axis=1)
                & (leading == first)
                & (trailing == last)
            )
            if alike.any():
                own = slice(0, 4 - first)
                found[alike, own], radii[alike, own] = _discs(
                    rows[alike, first:], bars[alike, first:], last
                )
    unknown = ~np.isfinite(radii)
    found[unknown], radii[unknown] = complex(np.nan, np.nan), np.nan
    return found, radii


def _discs(rows, bars, zeros):
    """The roots of polynomials, the highest power's coefficients first and not 0, the last `zeros`
    0; and their radii.

    The bounds of the coefficients are `bars`.
    """
    degree = rows.shape[1] - 1
    one = np.eye(degree)
    companion = np.zeros((len(rows), degree - zeros, degree - zeros))
    companion[:, 1:, :-1] = np.eye(degree - zeros)[1:, 1:]
    companion[:, :1] = -rows[:, None, 1 : degree - zeros + 1] / rows[:, :1, None]
    z = np.zeros((len(rows), degree), complex)
    z[:, : degree - zeros] = np.linalg.eigvals(companion)
    for _ in range(2):  # Weierstrass's simultaneous iteration refines all roots but double ones
        with np.errstate(all="ignore"):
            move = _value(rows, z) / (
                rows[:, :1] * np.prod(z[:, :, None] - z[:, None] + one, axis=2)
            )
        z = np.where(np.isfinite(move) & (np.abs(move) < 0.1 * (1 + np.abs(z))), z - move, z)
    gaps = z[:, :, None] - z[:, None] + one
    blur = _value(np.abs(rows) * 4 * (degree + 1) * EPS + bars, np.abs(z))
    with np.errstate(all="ignore"):
        radius = (
            degree * (np.abs(_value(rows, z)) + blur) / np.abs(rows[:, :1] * np.prod(gaps, axis=2))
        )
    share = np.maximum(1.0 - bars[:, :1] / np.abs(rows[:, :1]), 0.1)
    radius = np.where(np.isfinite(radius), radius * 1.1 / share, np.inf)
    # a disc on the real axis that meets no other holds a real root
    alone = (np.abs(gaps) + 2 * one * 1e300 > radius[:, :, None] + radius[:, None]).all(axis=2)
    real = alone & (np.abs(z.imag) <= radius)
    z, radius = np.where(real, z.real, z), np.where(real, radius + np.abs(z.imag), radius)
    order = np.lexsort((z.imag, z.real, ~real), axis=1)
    return np.take_along_axis(z, order, axis=1), np.take_along_axis(radius, order, axis=1)


def _value(rows, z):
    """The polynomials (rows, coefficients) at z (rows, m)."""
    value = np.zeros_like(z)
    for k in range(rows.shape[1]):
        value = value * z + rows[:, k, None]
    return value


def is_degenerate(a):
    """Is the discriminant of P4 exactly 0? Five exact numbers a0 to a4; the root may lie at infinity."""
    a0, a1, a2, a3, a4 = (Fraction(x) for x in a)
    g2 = a0 * a4 - 4 * a1 * a3 + 3 * a2 * a2
    g3 = a0 * a2 * a4 + 2 * a1 * a2 * a3 - a2**3 - a4 * a1 * a1 - a0 * a3 * a3
    return g2**3 == 27 * g3**2


def at_zero(d, c23, s2, s3, w0):
    """a0 to a4 of the motion through phi0 = 0, w0, of Fractions: no other angle of binary64 has a
    rational sine.
    """
    n = w0 * w0 - d / 2 - 2 * s3
    return d / 2 + n - 2 * s3, s2 + c23, n / 3 - d / 2, s2 - c23, d / 2 + n + 2 * s3
