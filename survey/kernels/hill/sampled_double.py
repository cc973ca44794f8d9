"""Taylor series of order 34 in double-double arithmetic, of z known in every step by its
interpolant.

On a step z is the polynomial through its values at NODES Chebyshev points of the first kind, given
as a power series from the step's start; the rest is `taylor_double`. What that polynomial misses
follows from its last Chebyshev coefficients, and counts as an error of z all over the step. Domain:
z smooth on the scale of a step, known to 32 digits; steps of any lengths.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 3 and 8.
"""

import numpy as np

from survey.kernels.hill.answers import COSINE, COSINE_BAR, SINE, SINE_BAR
from survey.kernels.hill.taylor_double import (
    D11,
    D12,
    D21,
    MOVED,
    P12,
    P21,
    STEP,
    composed,
    entry,
    rounded,
    step,
    workspace,
)
from survey.kernels.jit import kernel
from survey.kernels.lanes import DY2_BAR, RESULTS, Y1_BAR
from survey.kernels.math.double import add, div, mul
from survey.kernels.math.roundoff import PAIR_ROUNDOFF, ROUNDOFF_UP

ORDER = 34
SERVES = ()  # a last resort, never a user's choice
NODES = 20
# From RESULTS on, of a full period: SINE to COSINE_BAR of `answers`, (2 - D) / 4 and (2 + D) / 4.


def missing(before, last, size):
    """What an interpolant misses, from the sizes of its last four Chebyshev coefficients, pair by
    pair, and of z.
    """
    # rounding may cancel two coefficients altogether, and then only their rounding is known
    return 3 * last * (last / (before + PAIR_ROUNDOFF * size + 1e-300) + 0.02)


@kernel
def solve(series, misses, lengths, full_period, out):
    """y'' + z y = 0 over all steps, from z's series in x = t / h (steps, NODES, 2), lengths (steps,
    2), `missing` of z.

    Fills `out` as `survey.kernels.lanes.chain` does; with `full_period` also its columns SINE to
    COSINE_BAR, where D = y1 + y2'.
    """
    steps, work = len(series), workspace(0)
    z, even, odd = work[0], work[1], work[2]
    chain, unit = np.empty((steps, STEP)), (lengths[0, 0], lengths[0, 1])
    for n in range(steps):
        h, c = (lengths[n, 0], lengths[n, 1]), chain[n]
        z[:, :] = 0.0
        for i in range(NODES):
            z[0, i], z[1, i] = series[n, i, 0], series[n, i, 1]
        square = mul(h, h)
        step(z, even, odd, square, False, c)
        # Variation of constants: an error of z moves the propagator by at most that error times
        # both solutions.
        size = np.abs(even[0]).sum() + np.abs(odd[0]).sum()
        miss = square[0] * misses[n] * size * size
        longer, shorter = div(h, unit), div(unit, h)
        c[P12], c[P12 + 1] = mul(entry(c, P12), longer)
        c[P21], c[P21 + 1] = mul(entry(c, P21), shorter)
        c[D11] = c[D11] + miss
        c[D12] = (c[D12] + miss) * longer[0]
        c[D21] = (c[D21] + 2.0 * miss) * shorter[0]
        c[MOVED] = 0.0
    y1, v1, y2, v2 = composed(chain, 0.0, out)
    if full_period:
        bar = out[Y1_BAR] + out[DY2_BAR] + PAIR_ROUNDOFF * (abs(y1[0]) + abs(v2[0]) + 2.0)
        trace = add(y1, v2)
        out[RESULTS + SINE] = 0.25 * add((2.0, 0.0), (-trace[0], -trace[1]))[0]
        out[RESULTS + COSINE] = 0.25 * add((2.0, 0.0), trace)[0]
        out[RESULTS + SINE_BAR] = 0.25 * bar + ROUNDOFF_UP * abs(out[RESULTS + SINE])
        out[RESULTS + COSINE_BAR] = 0.25 * bar + ROUNDOFF_UP * abs(out[RESULTS + COSINE])
    rounded(y1, v1, y2, v2, unit, out)
