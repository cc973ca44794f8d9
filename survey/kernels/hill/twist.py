"""Normal form of a satellite's planar motion to order 4: twist of the isoenergetic map across the
plane.

H = p_beta^2/2 + p^2/(2 cos^2 beta) - rho p + W cos^2 v cos^2 beta, beta the angle from the plane,
in u; along a planar motion of energy h the solutions beta = c1 y1 + c2 y2 of Hill's equation, z =
p^2 + g, g = c0 - sin^2 x, make

    Q(c1, c2) = integral over a period of [(p^2/3 - g/6) beta^4 - H2 beta^2 dz/dh / 2] - T_h
    H2(T/2)^2 / 2

with H2 = (beta'^2 + z beta^2)/2 and dz/dh = 2 p xi' - sin 2x xi at constant u. By symmetry half a
period suffices. Everything by Taylor series; the integrals by Gauss-Legendre's formula in every
step.

Source: derived in `scenes/satellite.md` ("Nonlinear stability").
"""

import numpy as np

from survey.kernels.jit import kernel
from survey.kernels.math.roundoff import EPS

ORDER, NODES = 20, 10
REACH = 0.4  # steps times 1 + |rho| + k
_X, _WEIGHTS = np.polynomial.legendre.leggauss(NODES)
_PLACES, _SHARES = 0.5 * (_X + 1.0), 0.5 * _WEIGHTS
SINE, COSINE, RATE, ONE, TWO, SHIFT = range(6)  # sin x, cos x, w, y1, y2, xi
SERIES = 8  # and p^2 + g less c0, cos 2x
TWIST, RESONANT, TWIST_BAR, RESONANT_BAR = range(4)


@kernel
def _expand(state, c0, rho, series):
    """Taylor coefficients of the solutions, from the values and slopes `state` (9)."""
    s, c, w, one, two, xi, z, bend = (
        series[0], series[1], series[2], series[3], series[4], series[5], series[6], series[7]
    )  # fmt: skip
    s[0], c[0], w[0] = state[0], state[1], state[2]
    one[0], one[1], two[0], two[1], xi[0], xi[1] = (
        state[3],
        state[4],
        state[5],
        state[6],
        state[7],
        state[8],
    )
    for n in range(ORDER):
        sw = cw = sc = ss = ww = 0.0
        for i in range(n + 1):
            sw += s[i] * w[n - i]
            cw += c[i] * w[n - i]
            sc += s[i] * c[n - i]
            ss += s[i] * s[n - i]
            ww += w[i] * w[n - i]
        s[n + 1], c[n + 1], w[n + 1] = cw / (n + 1), -sw / (n + 1), -sc / (n + 1)
        z[n], bend[n] = ww + 2.0 * rho * w[n] - ss, -2.0 * ss
        if n == 0:
            z[0] += rho * rho + c0
            bend[0] += 1.0
        if n + 2 <= ORDER:
            a = b = d = 0.0
            for i in range(n + 1):
                a += z[i] * one[n - i]
                b += z[i] * two[n - i]
                d += bend[i] * xi[n - i]
            scale = 1.0 / ((n + 1) * (n + 2))
            one[n + 2], two[n + 2], xi[n + 2] = -a * scale, -b * scale, -d * scale


@kernel
def _at(series, h, out):
    """Values and slopes at h: sin x, cos x, w, then y1, y1', y2, y2', xi, xi'."""
    for j in range(3):
        total = 0.0
        for n in range(ORDER, -1, -1):
            total = total * h + series[j, n]
        out[j] = total
    for j in range(3):
        total = slope = 0.0
        for n in range(ORDER, 0, -1):
            total = total * h + series[3 + j, n]
            slope = slope * h + n * series[3 + j, n]
        out[3 + 2 * j], out[4 + 2 * j] = total * h + series[3 + j, 0], slope


@kernel
def _form(at, c0, rho, out):
    """The integrand's coefficients of c1^4, c1^2 c2^2 and c2^4 -> out (3), and those of H2^2 -> out[3:]."""
    s, w, y1, d1, y2, d2, xi, slope = at[0], at[2], at[3], at[4], at[5], at[6], at[7], at[8]
    p = w + rho
    g = c0 - s * s
    z, quartic = p * p + g, p * p / 3.0 - g / 6.0
    moved = 2.0 * p * slope - 2.0 * s * at[1] * xi
    # H2 = e11 c1^2 + 2 e12 c1 c2 + e22 c2^2
    e11, e12, e22 = (
        0.5 * (d1 * d1 + z * y1 * y1),
        0.5 * (d1 * d2 + z * y1 * y2),
        0.5 * (d2 * d2 + z * y2 * y2),
    )
    b11, b12, b22 = y1 * y1, y1 * y2, y2 * y2
    out[0] = quartic * b11 * b11 - 0.5 * moved * e11 * b11
    out[1] = 6.0 * quartic * b11 * b22 - 0.5 * moved * (e11 * b22 + 4.0 * e12 * b12 + e22 * b11)
    out[2] = quartic * b22 * b22 - 0.5 * moved * e22 * b22
    out[3], out[4], out[5] = e11 * e11, 2.0 * e11 * e22 + 4.0 * e12 * e12, e22 * e22


@kernel
def _half(k, half, c0, rho, finer, found):
    """Fill `found` (12): the three coefficients of Q, sizes of their terms, y1, y1', y2, y2' at
    T/2, growth, steps.
    """
    series, at, form = np.zeros((SERIES, ORDER + 1)), np.zeros(9), np.zeros(6)
    size = 1.0 + abs(rho) + k
    count = int(np.ceil(half * size * finer / REACH))
    h = half / count
    state = np.zeros(9)
    state[1], state[2], state[3], state[6], state[8] = 1.0, k, 1.0, 1.0, 1.0 / k
    found[:] = 0.0
    growth = 1.0
    for _ in range(count):
        _expand(state, c0, rho, series)
        for i in range(NODES):
            _at(series, h * _PLACES[i], at)
            _form(at, c0, rho, form)
            for j in range(3):
                found[j] += 2.0 * h * _SHARES[i] * form[j]
                found[3 + j] += 2.0 * h * _SHARES[i] * abs(form[j])
        _at(series, h, state)
        growth = max(growth, k * (abs(state[7]) + abs(state[8])))
    _form(state, c0, rho, form)
    slower = -2.0 * state[7] / state[2]  # dT/dh
    for j in range(3):
        found[j] -= 0.5 * slower * form[3 + j]
        found[3 + j] += abs(0.5 * slower * form[3 + j])
    found[6], found[7], found[8], found[9] = state[3], state[4], state[5], state[6]
    found[10], found[11] = growth, count


@kernel
def _normal(found, out):
    """Twist and resonant coefficient from `found`, -> out (4) with bars of their rounding; NaN
    where not stable.
    """
    y1, d1, y2, d2 = found[6], found[7], found[8], found[9]
    noise = (16.0 + found[11]) * EPS * found[10]
    out[:] = np.nan
    if not (d1 * y2 < 0.0 and y1 * d2 > 0.0):
        return
    square = -(y2 * d2) / (y1 * d1)
    scale = 1.0 + max(abs(y1 * d2), abs(d1 * y2))
    blur = noise * scale * (1.0 / abs(y1 * d2) + 1.0 / abs(d1 * y2))  # of B^2, relative
    first, last = found[0] * square, found[2] / square
    size = 3.0 * (found[3] * square + found[5] / square) + found[4]
    moved = 3.0 * blur * (abs(first) + abs(last))
    out[TWIST], out[RESONANT] = 3.0 * (first + last) + found[1], first - found[1] + last
    out[TWIST_BAR] = out[RESONANT_BAR] = noise * size + moved if blur < 0.1 else np.inf


@kernel
def twists(k, half, c0, rho, out):
    """Fill `out` (n, 4): TWIST to RESONANT_BAR, for n motions k, half periods and rho; NaN where
    linearly unstable.

    The twist is d(angle per period)/dJ at constant energy, J the action across the plane; at the
    resonance of order 4 the Hamiltonian is J^2 (TWIST + RESONANT cos 4 phi)/2.
    """
    found, other = np.zeros(12), np.zeros(4)
    for i in range(len(k)):
        out[i] = np.nan
        if not (k[i] > 0.0 and half[i] < 1e3):
            continue
        _half(k[i], half[i], c0, rho[i], 1.0, found)
        _normal(found, other)
        _half(k[i], half[i], c0, rho[i], 1.4, found)
        _normal(found, out[i])
        out[i, TWIST_BAR] += 2.0 * abs(out[i, TWIST] - other[TWIST])
        out[i, RESONANT_BAR] += 2.0 * abs(out[i, RESONANT] - other[RESONANT])
