"""DOP853 for Hill's equation: adaptive steps of y'' + z y = 0 from z at any t, with bounds of their
local errors.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.5 and
dop853.f.
"""

import numpy as np

from survey.kernels import lanes
from survey.kernels.hill.matrix import rounding
from survey.kernels.jit import inline
from survey.kernels.lanes import column, relative
from survey.kernels.math.dop853 import E3, E5, STAGES, A, B, C, combined
from survey.kernels.unroll import summed, unroll

SMALLEST, LARGEST = 0.2, 5.0  # ratios of a step to the one before
# Zeros are counted by signs at the ends of steps: a step stays below this many radians of the
# fastest phase.
_LONGEST = 2.0
STEP_LIMIT = 200_000
DOUBT = 0.01


@inline
def hill_step(z, h):
    """P and its local truncation bounds over one step, from z at the nodes."""
    sums = _sums(z, h)
    size = 0.0
    for i in range(STAGES):
        size = max(size, abs(z[i]))
    # an error of order h^9 is (h sqrt z)^3 of the estimate of order h^6
    doubt = DOUBT * (h * np.sqrt(size)) ** 3
    p11, d11 = _ended(1.0, h, sums[0:3], doubt)
    p21, d21 = _ended(0.0, h, sums[3:6], doubt)
    p12, d12 = _ended(0.0, h, sums[6:9], doubt)
    p22, d22 = _ended(1.0, h, sums[9:12], doubt)
    # one entry's estimate may vanish by symmetry (constant z): each takes the largest of all, in
    # the scale of the phase
    rate = max(np.sqrt(size), 1.0 / h)
    estimate = max(max(d11, d22), max(d12 * rate, d21 / rate))
    return p11, p12, p21, p22, estimate, estimate / rate, estimate * rate


@unroll
def _sums(z, h):
    """Of y and v of both columns: the slopes' sums with the weights B, E5 and E3, 12 numbers."""
    sums = []
    steps = [[h * float(a) for a in row[:STAGES]] for row in A]
    for start in ((1.0, 0.0), (0.0, 1.0)):
        slopes = []
        for i in range(STAGES):
            y, v = start
            for j in range(i):
                if A[i, j] != 0.0:
                    y, v = y + steps[i][j] * slopes[j][0], v + steps[i][j] * slopes[j][1]
            slopes.append((v, -z[i] * y))
        for k in range(2):
            for weights in (B, E5, E3):
                sums.append(
                    summed(weights[j] * slopes[j][k] for j in range(STAGES) if weights[j] != 0.0)
                )
    return tuple(sums)


@inline
def _ended(start, h, sums, doubt):
    """The new value, and dop853.f's combination of the estimates of order 5 and 3, which must not
    vanish by chance.
    """
    value, fifth, third = sums
    return start + h * value, abs(h) * (combined(fifth, third) + doubt * abs(fifth))


@inline
def hill_walk(potential, p, row, table, span, tolerance, out):
    """Integrate y'' + z y = 0 from 0 to `span`, local errors below `tolerance`.

    (z, size of the terms whose sum z is) = potential(t, p, row, table).

    Fills `out` as `survey.kernels.lanes.chain` does. False when STEP_LIMIT steps did not reach the
    end.
    """
    return hill_walk_pieces(
        potential, p, row, table, np.array([0.0, span]), 0.0, span, tolerance, out
    )


@inline
def hill_walk_pieces(potential, p, row, table, edges, slack, longest, tolerance, out):
    """As `hill_walk`, from the first to the last of `edges`; z may jump at those between, where a
    step ends.

    No step is longer than `longest`. `potential` is evaluated no nearer to an edge than `slack`, so
    on the right side.
    """
    z = np.empty(STAGES)
    # else a coefficient whose average rules escapes the estimate
    longest = min(longest, 0.25 * (edges[-1] - edges[0]))
    piece, t, steps, h = 1, edges[0], 0, min(longest, 0.1)
    y1, v1, s1, t1, w1 = 1.0, 0.0, 0.0, 0.0, 0.0
    y2, v2, s2, t2, w2 = 0.0, 1.0, 0.0, 0.0, 0.0
    zeros1, zeros2, total = 0.0, 0.0, 0.0
    for _ in range(STEP_LIMIT):
        final = t + 1.01 * h >= edges[piece]
        if final:
            h = edges[piece] - t
        size, terms = 0.0, 0.0
        for i in range(STAGES):
            inside = min(max(t + C[i] * h, edges[piece - 1] + slack), edges[piece] - slack)
            z[i], scale = potential(inside, p, row, table)
            size, terms = max(size, abs(z[i])), max(terms, scale)
        wave = np.sqrt(size) + 1e-3
        p11, p12, p21, p22, d11, d12, d21 = hill_step(z, h)
        error = d11  # the largest of all four entries
        if error <= tolerance and h * wave <= 1.01 * _LONGEST:
            # The stages pass through sums of size 60 that cancel; t itself is rounded.
            r11, r12, r21 = rounding(terms, h)
            matrix = (p11, p12, p21, p22, d11 + 2.0 * r11, d12 + 8.0 * r12, d21 + 4.0 * r21)
            old1, old2 = y1, y2
            y1, v1, s1, t1, w1 = column(matrix, y1, v1, s1, t1, w1)
            y2, v2, s2, t2, w2 = column(matrix, y2, v2, s2, t2, w2)
            zeros1 += 1.0 if (y1 < 0.0) != (old1 < 0.0) else 0.0
            zeros2 += 1.0 if (y2 < 0.0) != (old2 < 0.0) else 0.0
            total += relative(matrix, h)
            steps += 1
            t = edges[piece] if final else t + h
            piece += 1 if final else 0
            if piece == len(edges):
                out[lanes.Y1], out[lanes.DY1], out[lanes.Y2], out[lanes.DY2] = y1, v1, y2, v2
                lanes.bars(s1, w1, s2, w2, steps, total, out)
                out[lanes.Y1_ZEROS], out[lanes.Y2_ZEROS] = zeros1, zeros2
                return True
        elif not error >= 0.0:
            return False
        h *= min(LARGEST, max(SMALLEST, 0.9 * (tolerance / (error + 1e-300)) ** 0.125))
        h = min(h, longest, _LONGEST / wave)
    return False
