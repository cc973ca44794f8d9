"""Taylor series of order 34 in double-double arithmetic, for points whose verdict float64 leaves
open: 30 digits.

z(t) is a polynomial in a "clock", functions with their own differential equations (cos 2t; sin x,
cos x and x' of a pendulum), whose series give that of z. The clock starts where it is known exactly
and its errors do not grow, and runs from there to one or both ends of the half period; where it
ends its values are known too, and what they miss is its error. Both solutions are expanded from the
identity in every step. All errors travel as in `survey.kernels.lanes`. Domain: z analytic, with
such a clock. Fixed steps; 0.2 to 1 ms for a point of moderate z.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, I.8.
"""

import numpy as np

from survey.kernels.jit import inline
from survey.kernels.lanes import (
    DY1,
    DY1_BAR,
    DY2,
    Y1,
    Y1_BAR,
    Y1_ZEROS,
    Y2,
    Y2_BAR,
    Y2_ZEROS,
    bars,
    column,
    relative,
)
from survey.kernels.math.double import add, convolved, div, mul, over, slope, total
from survey.kernels.math.roundoff import PAIR_ROUNDOFF, ROUNDOFF_UP

ORDER = 34
SERVES = ()  # a last resort, never a user's choice
PHASE, DISTANCE = 1.4, 0.1
STEP_LIMIT = 100_000
# A step: its propagator, each entry in two columns, high and low; local bounds of truncation and
# rounding, D11 = D22, D12 and D21; what the clock's error moves.
P11, P12, P21, P22 = range(0, 8, 2)
D11, D12, D21, MOVED = range(8, 12)
STEP = 12
SOLUTIONS = 3
# Of a step, relative to its size in the largest norm: sums of products, the reciprocal steps, h.
ROUNDING = 4.0


def hill_density():
    """Steps per radian of the fastest phase, and per distance to the nearest singularity of z."""
    return 1 / PHASE, 1 / DISTANCE


@inline
def workspace(clock):
    """Series (functions, 2, orders): z, the even and the odd solution, then the functions of the clock."""
    return np.zeros((SOLUTIONS + clock, 2, ORDER + 1))


@inline
def solutions(z, even, odd, square):
    """Series in x = t / h of both solutions from the identity; multiplies z by `square` = h^2 and
    returns its size.
    """
    size = 0.0
    for n in range(ORDER + 1):
        z[0, n], z[1, n] = mul((z[0, n], z[1, n]), square)
        size += abs(z[0, n])
    for n in range(2):
        even[0, n], even[1, n] = 1.0 - n, 0.0
        odd[0, n], odd[1, n] = 0.0 + n, 0.0
    for n in range(ORDER - 1):
        scale = -(n + 1.0) * (n + 2.0)
        even[0, n + 2], even[1, n + 2] = over(convolved(z, even, n), scale)
        odd[0, n + 2], odd[1, n + 2] = over(convolved(z, odd, n), scale)
    return size


@inline
def step(z, even, odd, square, reverse, out):
    """Propagator of (y, h y') and local bounds over one step; of the step mirrored in time where
    `reverse`.
    """
    size = solutions(z, even, odd, square)
    p11, p12, p21, p22 = total(even), total(odd), slope(even), slope(odd)
    if reverse:
        p11, p22 = p22, p11
    out[P11], out[P11 + 1] = p11
    out[P12], out[P12 + 1] = p12
    out[P21], out[P21 + 1] = p21
    out[P22], out[P22 + 1] = p22
    a, b = tail(even), tail(odd)
    rounding = ROUNDING * PAIR_ROUNDOFF
    out[D11] = a + ORDER * b + rounding * (1.0 + size)
    out[D12] = b + rounding * (1.0 + size)
    out[D21] = ORDER * a + rounding * size


@inline
def tail(series):
    """What follows the last coefficient, from the rate at which the last four fall, as in `taylor16`."""
    last = abs(series[0, ORDER]) + abs(series[0, ORDER - 1])
    before = abs(series[0, ORDER - 2]) + abs(series[0, ORDER - 3])
    return 3.0 * last * (last / (before + 1e-300) + 0.02)


@inline
def hill_walk(start, expand, potential, miss, row, p, span, before, after, work, chain, out):
    """y'' + z y = 0 over the half period `span` (a double-double), in `before` + `after` steps.

    The clock's origin lies `before` steps after the start. `start(row, clock)` sets its values, coefficients 0;
    `expand(row, h, clock)` the others, in x = t / h; `potential(side, row, p, clock, z)` fills the series of z at the
    distance of the clock from the origin, after it (side 1) or before it (-1), `p` a double-double, and returns the
    most by which |z| can move per unit of the clock's error; `miss(row, clock)` is that error at the clock's end.

    Fills `out` as `survey.kernels.lanes.chain` does; `work` from `workspace`, `chain` (steps, STEP)
    is scratch.
    """
    steps = before + after
    h = over(span, float(steps))
    square = mul(h, h)
    z, even, odd, clock = work[0], work[1], work[2], work[SOLUTIONS:]
    start(row, clock)
    for j in range(max(before, after)):
        expand(row, h, clock)
        for side in (1.0, -1.0):
            if j < (after if side > 0.0 else before):
                index = before + j if side > 0.0 else before - 1 - j
                chain[index, MOVED] = potential(side, row, p, clock, z) * square[0]
                step(z, even, odd, square, side < 0.0, chain[index])
        for c in range(len(clock)):
            clock[c, 0, 0], clock[c, 1, 0] = total(clock[c])
    compose(chain[:steps], h, miss(row, clock) + steps * PAIR_ROUNDOFF, out)


@inline
def compose(chain, h, doubt, out):
    """The results from the propagators of all steps and the clock's error `doubt`."""
    y1, v1, y2, v2 = composed(chain, doubt, out)
    rounded(y1, v1, y2, v2, h, out)


@inline
def composed(chain, doubt, out):
    """y1, h y1', y2 / h, y2' as double-doubles; their bars and zeros go into `out`."""
    y1, v1, s1, t1, w1 = (1.0, 0.0), (0.0, 0.0), 0.0, 0.0, 0.0
    y2, v2, s2, t2, w2 = (0.0, 0.0), (1.0, 0.0), 0.0, 0.0, 0.0
    zeros1, zeros2, sum_ = 0.0, 0.0, 0.0
    for n in range(len(chain)):
        c = chain[n]
        moved = doubt * c[MOVED]
        matrix = (
            c[P11], c[P12], c[P21], c[P22], c[D11] + moved, c[D12] + moved, c[D21] + 2.0 * moved
        )  # fmt: skip
        old1, old2 = y1[0], y2[0]
        _, _, s1, t1, w1 = column(matrix, y1[0], v1[0], s1, t1, w1)
        _, _, s2, t2, w2 = column(matrix, y2[0], v2[0], s2, t2, w2)
        y1, v1 = applied(c, y1, v1)
        y2, v2 = applied(c, y2, v2)
        zeros1 += 1.0 if (y1[0] < 0.0) != (old1 < 0.0) else 0.0
        zeros2 += 1.0 if (y2[0] < 0.0) != (old2 < 0.0) else 0.0
        sum_ += relative(matrix, 1.0)
    bars(s1, w1, s2, w2, len(chain), sum_, out)
    out[Y1_ZEROS], out[Y2_ZEROS] = zeros1, zeros2
    return y1, v1, y2, v2


@inline
def rounded(y1, v1, y2, v2, h, out):
    """Keep y1, y1', y2, y2' as float64, and their bars with that rounding."""
    out[Y1], out[DY1], out[Y2], out[DY2] = y1[0], div(v1, h)[0], mul(y2, h)[0], v2[0]
    out[DY1_BAR], out[Y2_BAR] = out[DY1_BAR] / h[0], out[Y2_BAR] * h[0]
    for i in range(4):
        out[Y1_BAR + i] += ROUNDOFF_UP * abs(out[Y1 + i])


@inline
def entry(step, at):
    """An entry of a step's propagator."""
    return step[at], step[at + 1]


@inline
def applied(c, y, v):
    """A step's propagator times (y, v)."""
    p11, p12, p21, p22 = entry(c, P11), entry(c, P12), entry(c, P21), entry(c, P22)
    return add(mul(p11, y), mul(p12, v)), add(mul(p21, y), mul(p22, v))
