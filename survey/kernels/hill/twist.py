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
# The series: sin x, cos x, w, y1, y2, xi, z, cos 2x.
_SINE, _COSINE, _RATE, _FIRST, _SECOND, _SHIFT, _Z, _BEND = range(8)
_SERIES = 8
# A state: sin x, cos x, w; y1, y2 and xi, each before its slope.
_SIN_X, _COS_X, _W, _Y1, _DY1, _Y2, _DY2, _XI, _DXI = range(9)
_STATE = 9
# Coefficients of c1^4, c1^2 c2^2 and c2^4, of a form; of the integrand, then of H2^2.
_C1_4, _C1_2_C2_2, _C2_4 = range(3)
_COEFFICIENTS = 3
_OF_SQUARE = 3
# What half a period gives: the coefficients of Q; from _SIZES on the sizes of their terms; y1, y1',
# y2, y2' at T/2; growth, steps.
_SIZES = 3
_END_Y1, _END_DY1, _END_Y2, _END_DY2, _GROWTH, _STEPS = range(6, 12)
_HALF = 12
# What is filled of a motion.
TWIST, RESONANT, TWIST_BAR, RESONANT_BAR = range(4)
COLUMNS = 4


@kernel
def _expand(state, c0, rho, series):
    """Taylor coefficients of the solutions, from the values and slopes of a state."""
    s, c, w, one, two, xi, z, bend = (
        series[_SINE], series[_COSINE], series[_RATE], series[_FIRST], series[_SECOND], series[_SHIFT],
        series[_Z], series[_BEND],
    )  # fmt: skip
    s[0], c[0], w[0] = state[_SIN_X], state[_COS_X], state[_W]
    one[0], one[1] = state[_Y1], state[_DY1]
    two[0], two[1] = state[_Y2], state[_DY2]
    xi[0], xi[1] = state[_XI], state[_DXI]
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
    """The state at h."""
    for j in (_SINE, _COSINE, _RATE):
        total = 0.0
        for n in range(ORDER, -1, -1):
            total = total * h + series[j, n]
        out[j] = total
    for j, at in ((_FIRST, _Y1), (_SECOND, _Y2), (_SHIFT, _XI)):
        total = slope = 0.0
        for n in range(ORDER, 0, -1):
            total = total * h + series[j, n]
            slope = slope * h + n * series[j, n]
        out[at], out[at + 1] = total * h + series[j, 0], slope


@kernel
def _form(at, c0, rho, out):
    """The coefficients of the integrand, and from _OF_SQUARE on those of H2^2."""
    s, w, xi, slope = at[_SIN_X], at[_W], at[_XI], at[_DXI]
    y1, d1, y2, d2 = at[_Y1], at[_DY1], at[_Y2], at[_DY2]
    p = w + rho
    g = c0 - s * s
    z = p * p + g
    quartic = p * p / 3.0 - g / 6.0
    moved = 2.0 * p * slope - 2.0 * s * at[_COS_X] * xi
    # H2 = e11 c1^2 + 2 e12 c1 c2 + e22 c2^2
    e11 = 0.5 * (d1 * d1 + z * y1 * y1)
    e12 = 0.5 * (d1 * d2 + z * y1 * y2)
    e22 = 0.5 * (d2 * d2 + z * y2 * y2)
    b11, b12, b22 = y1 * y1, y1 * y2, y2 * y2
    out[_C1_4] = quartic * b11 * b11 - 0.5 * moved * e11 * b11
    out[_C1_2_C2_2] = 6.0 * quartic * b11 * b22 - 0.5 * moved * (
        e11 * b22 + 4.0 * e12 * b12 + e22 * b11
    )
    out[_C2_4] = quartic * b22 * b22 - 0.5 * moved * e22 * b22
    out[_OF_SQUARE + _C1_4] = e11 * e11
    out[_OF_SQUARE + _C1_2_C2_2] = 2.0 * e11 * e22 + 4.0 * e12 * e12
    out[_OF_SQUARE + _C2_4] = e22 * e22


@kernel
def _half(k, half, c0, rho, finer, found):
    """Fill `found` (_HALF)."""
    series, at = np.zeros((_SERIES, ORDER + 1)), np.zeros(_STATE)
    form = np.zeros(2 * _COEFFICIENTS)
    size = 1.0 + abs(rho) + k
    count = int(np.ceil(half * size * finer / REACH))
    h = half / count
    state = np.zeros(_STATE)
    state[_COS_X], state[_W] = 1.0, k
    state[_Y1], state[_DY2], state[_DXI] = 1.0, 1.0, 1.0 / k
    found[:] = 0.0
    growth = 1.0
    for _ in range(count):
        _expand(state, c0, rho, series)
        for i in range(NODES):
            _at(series, h * _PLACES[i], at)
            _form(at, c0, rho, form)
            for j in range(_COEFFICIENTS):
                found[j] += 2.0 * h * _SHARES[i] * form[j]
                found[_SIZES + j] += 2.0 * h * _SHARES[i] * abs(form[j])
        _at(series, h, state)
        growth = max(growth, k * (abs(state[_XI]) + abs(state[_DXI])))
    _form(state, c0, rho, form)
    slower = -2.0 * state[_XI] / state[_W]  # dT/dh
    for j in range(_COEFFICIENTS):
        found[j] -= 0.5 * slower * form[_OF_SQUARE + j]
        found[_SIZES + j] += abs(0.5 * slower * form[_OF_SQUARE + j])
    found[_END_Y1], found[_END_DY1] = state[_Y1], state[_DY1]
    found[_END_Y2], found[_END_DY2] = state[_Y2], state[_DY2]
    found[_GROWTH], found[_STEPS] = growth, count


@kernel
def _normal(found, out):
    """Twist and resonant coefficient from `found`, with bars of their rounding, into `out`
    (COLUMNS); NaN where not stable.
    """
    y1, d1, y2, d2 = found[_END_Y1], found[_END_DY1], found[_END_Y2], found[_END_DY2]
    noise = (16.0 + found[_STEPS]) * EPS * found[_GROWTH]
    out[:] = np.nan
    if not (d1 * y2 < 0.0 and y1 * d2 > 0.0):
        return
    square = -(y2 * d2) / (y1 * d1)
    scale = 1.0 + max(abs(y1 * d2), abs(d1 * y2))
    blur = noise * scale * (1.0 / abs(y1 * d2) + 1.0 / abs(d1 * y2))  # of B^2, relative
    first, last = found[_C1_4] * square, found[_C2_4] / square
    size = 3.0 * (found[_SIZES + _C1_4] * square + found[_SIZES + _C2_4] / square)
    size += found[_SIZES + _C1_2_C2_2]
    moved = 3.0 * blur * (abs(first) + abs(last))
    out[TWIST] = 3.0 * (first + last) + found[_C1_2_C2_2]
    out[RESONANT] = first - found[_C1_2_C2_2] + last
    out[TWIST_BAR] = out[RESONANT_BAR] = noise * size + moved if blur < 0.1 else np.inf


@kernel
def twists(k, half, c0, rho, out):
    """Fill `out` (n, COLUMNS) for n motions k, half periods and rho; NaN where
    linearly unstable.

    The twist is d(angle per period)/dJ at constant energy, J the action across the plane; at the
    resonance of order 4 the Hamiltonian is J^2 (TWIST + RESONANT cos 4 phi)/2.
    """
    found, other = np.zeros(_HALF), np.zeros(COLUMNS)
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
