"""The action of a nutation, 1/pi times the integral of sqrt P/(1 - u^2), as a sum of positive
terms: nothing cancels.

Small wells off poles and other roots of P by Gauss-Chebyshev quadrature (S15), all others by the
trapezoidal rule in a variable that keeps every singularity pi away from the real line, wherever
roots and poles are (S22).

Source: DLMF 3.5(i), (v); L. N. Trefethen, J. A. C. Weideman, SIAM Review 56 (2014) 385;
`scenes/brun.md`.
"""

from math import pi, sqrt

import numpy as np

from survey.kernels.jit import kernel
from survey.kernels.math.chebyshev import nodes
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import lanes as nl
from survey.kernels.nutation import wells as nu

ROUGH = 2e-13  # bars of (S14), relative, beyond which the action is a sum
NODES = 16
_COSINES = nodes(NODES)
# (S22): nodes w = STEP n, DOWN <= n <= UP; there c, 1 - c^2, (1 + c)/2, (1 - c)/2, and the weight c
# s^3
STEP, DOWN, UP = 0.3125, -256, 320
NEGLIGIBLE = 1e-19
_RISE = np.exp(STEP * np.arange(DOWN, UP + 1))
_SQUARE = 1.0 / (1.0 + _RISE)
_C = np.sqrt(_RISE * _SQUARE)
_NEAR = 0.5 * (1.0 + _C)
_FAR = 0.25 * _SQUARE / _NEAR
_WEIGHT = _C * _SQUARE * np.sqrt(_SQUARE)


@kernel
def small(row, root_low, root_high):
    """The action by (S15), or -1 where singularities are too near for its few nodes."""
    k, width, total, bend = row[nu.K], row[nu.WIDTH], row[nu.SUM], row[nu.BEND]
    if width == 0.0:
        return 0.0
    if min(row[nu.HIGH_PLUS], row[nu.LOW_MINUS]) < 0.5 * width:
        return -1.0
    if k * bend < 0.0:
        far = abs(sqrt(-0.25 * bend / k) - abs(total))
    else:
        far = sqrt(total * total + 0.25 * bend / k) if k != 0.0 else 2.0
    if far < 1.1 * width:
        return -1.0
    low, high, result = root_low * root_low, root_high * root_high, 0.0
    for i in range(NODES):
        up, down = 0.5 * (1.0 + _COSINES[i]), 0.5 * (1.0 - _COSINES[i])
        q = low * down + high * up - k * width * width * up * down
        rest = (row[nu.LOW_PLUS] * down + row[nu.HIGH_PLUS] * up) * (
            row[nu.LOW_MINUS] * down + row[nu.HIGH_MINUS] * up
        )
        result += up * down * sqrt(q) / rest
    return width * width * result / NODES


@kernel
def positive(width, roots, square, at_plus, at_minus, noise):
    """The action by (S22), and what relative errors `noise` of Q at both turning points and of
    `square` change.

    roots: of Q at ul, uh; square = (s + g)/2; at_plus, at_minus: 1 - u and 1 + u of ul, uh.
    """
    g, steep, noisy = roots[0] * roots[1], roots[0] / roots[1], noise[0] + noise[1] + noise[2] > 0.0
    low, high = sqrt(steep), sqrt(1.0 / steep)
    steep = max(steep, 1.0 / steep)
    total = rest = moved = 0.0
    for side in (-1, 1):
        i = -DOWN - (side < 0)
        while 0 <= i <= UP - DOWN:
            c, s, near, far = _C[i], square * _SQUARE[i], _NEAR[i], _FAR[i]
            level = g * c * c + s
            wl, wh, vl, vh = high * near, low * far, high * far, low * near
            one, other = wl + wh, vl + vh
            one *= one * (at_plus[0] * wl + at_plus[1] * wh) * (at_minus[0] * wl + at_minus[1] * wh)
            other *= (
                other * (at_plus[0] * vl + at_plus[1] * vh) * (at_minus[0] * vl + at_minus[1] * vh)
            )
            part = _WEIGHT[i] * sqrt(level) / (one * other)
            term = part * (one + other)
            if noisy:
                by_low, by_high = near * other + far * one, far * other + near * one
                by_ends = (noise[0] * by_low + noise[1] * by_high) * g * c
                moved += part * (by_ends + noise[2] * s * (one + other)) / level
            before = total
            total += term
            rest += term - (total - before) if before >= term else before - (total - term)
            if term <= NEGLIGIBLE * total and (side < 0 or far * steep < 0.01):
                break
            i += side
    scale = width * width * STEP / (8.0 * pi)
    return scale * (total + rest), 0.5 * scale * moved


@kernel
def action(row):
    """(the action, its bar) of a well, a row of `kernels/nutation/wells.py`."""
    width, low, high = row[nu.WIDTH], sqrt(row[nu.Q_LOW]), sqrt(row[nu.Q_HIGH])
    noise = row[nu.NOISE_LOW] + row[nu.NOISE_HIGH]
    value = small(row, low, high)
    if value >= 0.0:
        return value, (64.0 * ROUNDOFF + noise + 2.5 * row[nu.NOISE_WIDTH]) * value
    at_plus = (row[nu.LOW_PLUS], row[nu.HIGH_PLUS])
    at_minus = (row[nu.LOW_MINUS], row[nu.HIGH_MINUS])
    square = 0.5 * nu.above(row, low * high)
    noise = row[nu.NOISE_LOW], row[nu.NOISE_HIGH], row[nu.NOISE_ABOVE]
    value, moved = positive(width, (low, high), square, at_plus, at_minus, noise)
    return value, 64.0 * ROUNDOFF * value + moved + 2.0 * (
        row[nu.NOISE_WIDTH] + row[nu.NOISE_ENDS]
    ) * value


@kernel
def mend(work, answers):
    """In a tile of `lanes`: (S22) for those actions among `answers` whose terms cancel, small
    wells' apart.
    """
    for i in range(nl.TILE):
        value, bar, width = answers[nl.ACTION + i], answers[nl.ACTION_BAR + i], work[nl.WIDTH + i]
        if work[nl.GOOD + i] != 2.0 or work[nl.SMALL_ACTION + i] > 0.0 or bar <= ROUGH * abs(value):
            continue
        blur = (work[nl.BAR_V + i] + work[nl.BAR_W + i]) / width
        roots = (sqrt(work[nl.Q_LOW + i]), sqrt(work[nl.Q_HIGH + i]))
        at_plus = (work[nl.V_LOW + i], work[nl.V_HIGH + i])
        at_minus = (work[nl.W_LOW + i], work[nl.W_HIGH + i])
        value, _moved = positive(
            width, roots, 0.5 * work[nl.ABOVE + i], at_plus, at_minus, (0.0, 0.0, 0.0)
        )
        answers[nl.ACTION + i], answers[nl.ACTION_BAR + i] = (
            value,
            (66.0 * ROUNDOFF + 4.0 * blur) * value,
        )
