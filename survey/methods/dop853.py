"""DOP853, order 8, adaptive: chooses its own steps at every point, from z at any t. The independent check.

A step propagates the identity, so the embedded estimate bounds the entries of the propagator, and errors travel as
in `survey.kernels.lanes`. Domain: piecewise smooth z, hard points; slower than the fixed steps, and its rounding
(stage sums that cancel) leaves about 1e-12.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.5 and dop853.f.
"""

import numpy as np

from survey.kernels.dop853 import E3, E5, STAGES, A, B, C
from survey.kernels.jit import inline
from survey.kernels.lanes import column
from survey.kernels.matrix import rounding

ORDER = 8
SERVES = ("hill",)
ADAPTIVE = True
NODES = tuple(C[:STAGES])
SMALLEST, LARGEST = 0.2, 5.0
# Zeros are counted by signs at the ends of steps: a step stays below this many radians of the fastest phase.
LONGEST = 2.0
STEP_LIMIT = 200_000


@inline
def hill_step(z, h, slopes):
    """P and its local truncation bounds over one step, from z at the nodes; `slopes` (4, STAGES) is scratch."""
    for i in range(STAGES):
        for c in range(2):
            y, v = 1.0 - c, 0.0 + c
            for j in range(i):
                y += h * A[i, j] * slopes[2 * c, j]
                v += h * A[i, j] * slopes[2 * c + 1, j]
            slopes[2 * c, i] = v
            slopes[2 * c + 1, i] = -z[i] * y
    p11, d11 = _sums(1.0, h, slopes[0])
    p21, d21 = _sums(0.0, h, slopes[1])
    p12, d12 = _sums(0.0, h, slopes[2])
    p22, d22 = _sums(1.0, h, slopes[3])
    return p11, p12, p21, p22, d11 + d22, d12, d21


@inline
def _sums(start, h, slopes):
    """The new value, and dop853.f's combination of the estimates of order 5 and 3."""
    value, fifth, third = 0.0, 0.0, 0.0
    for j in range(STAGES):
        value += B[j] * slopes[j]
        fifth += E5[j] * slopes[j]
        third += E3[j] * slopes[j]
    scale = np.sqrt(fifth * fifth + 0.01 * third * third)
    return start + h * value, abs(h) * fifth * fifth / (scale + 1e-300)


@inline
def hill_walk(potential, p, row, table, span, tolerance, out):
    """Integrate y'' + z y = 0 from 0 to `span`, z = potential(t, p, row, table), local errors below `tolerance`.

    Fills `out` as `survey.kernels.lanes.chain` does. False when STEP_LIMIT steps did not reach the end.
    """
    z, slopes = np.empty(STAGES), np.empty((4, STAGES))
    t, steps, h = 0.0, 0, min(span, 0.1)
    y1, v1, s1, t1, w1 = 1.0, 0.0, 0.0, 0.0, 0.0
    y2, v2, s2, t2, w2 = 0.0, 1.0, 0.0, 0.0, 0.0
    zeros1, zeros2 = 0.0, 0.0
    for _ in range(STEP_LIMIT):
        final = t + 1.01 * h >= span
        if final:
            h = span - t
        size = 0.0
        for i in range(STAGES):
            z[i] = potential(t + C[i] * h, p, row, table)
            size = max(size, abs(z[i]))
        wave = np.sqrt(size) + 1e-3
        p11, p12, p21, p22, d11, d12, d21 = hill_step(z, h, slopes)
        error = d11 + d12 * wave + d21 / wave
        if error <= tolerance and h * wave <= 1.01 * LONGEST:
            # The stages pass through sums of size 60 that cancel; t itself is rounded.
            r11, r12, r21 = rounding(4.0 * size, 4.0 * h)
            matrix = (p11, p12, p21, p22, d11 + 4.0 * r11, d12 + r12, d21 + r21)
            old1, old2 = y1, y2
            y1, v1, s1, t1, w1 = column(matrix, y1, v1, s1, t1, w1)
            y2, v2, s2, t2, w2 = column(matrix, y2, v2, s2, t2, w2)
            zeros1 += 1.0 if (y1 < 0.0) != (old1 < 0.0) else 0.0
            zeros2 += 1.0 if (y2 < 0.0) != (old2 < 0.0) else 0.0
            steps += 1
            t += h
            if final:
                out[0], out[1], out[2], out[3] = y1, v1, y2, v2
                out[4], out[5] = np.sqrt(steps * s1), np.sqrt(steps * w1)
                out[6], out[7] = np.sqrt(steps * s2), np.sqrt(steps * w2)
                out[8], out[9] = zeros1, zeros2
                return True
        elif not error >= 0.0:
            return False
        h *= min(LARGEST, max(SMALLEST, 0.9 * (tolerance / (error + 1e-300)) ** 0.125))
        h = min(h, LONGEST / wave)
    return False
