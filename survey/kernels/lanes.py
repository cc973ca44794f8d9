"""Many points in lock step: the propagators of a linear second-order equation composed over the
half period.

A row shares everything that does not depend on the lane variable p: its equation is y'' + z y = 0
with z(t) = c0(t) + p c1(t) + p^2 c2, c2 a number. Lanes are innermost in memory, so that LLVM turns
the loop over them into vector code; a lane's operations do not depend on its neighbours, nor its
bits on the number of lanes.

Beside the two columns of the fundamental matrix goes, for each, the 2x2 matrix S of its error ellipse:
S <- P S P^T + diag(d^2) with d = D |column| the step's local error bound. To first order the error after n steps
is a sum of n propagated local errors, each of two components: 2 n terms, the squares of whose bounds S_ii sums, hence
|error_i| <= sqrt(2 n S_ii) (Cauchy-Schwarz), whatever their signs. The first order is trusted as far as the local
errors are small: with M their sum, relative to the step's own matrix, the bounds are multiplied by exp(M), else a step
so long that the method damps would damp its errors too.

S is kept in units of 1 / SCALE^2, and LEAST is added to it in every step: no bar underflows, nor
falls below what the step itself loses where z is so small that its products underflow.
"""

import numpy as np

from survey.kernels.jit import splice
from survey.kernels.unroll import changes_sign, fma, unroll

# The columns of a point's results: both solutions and their derivatives at the end, their error
# bounds, and the numbers of zeros of y1 and of y2 on the way.
Y1, DY1, Y2, DY2, Y1_BAR, DY1_BAR, Y2_BAR, DY2_BAR, Y1_ZEROS, Y2_ZEROS = range(10)
RESULTS = 10
# The state of a lane: Y1 to DY2 so far, S of either column (three numbers), the zeros of y1 and of y2,
# and M.
_ELLIPSE_1, _ELLIPSE_2, _ZEROS_1, _ZEROS_2, _SUM = 4, 7, 10, 11, 12
STATE = 13
TILE = 64
VECTOR = 8
WORST = 300.0
ROUNDING = 1.8e-15  # of the products that carry an error ellipse, relative
SCALE = 2.0**350  # bars of 1e-259 to 1e48 have squares within the range of float64
LEAST = 2.3e-308


@splice
def chain(row, step, width, samples, c2, h, p, order, starts, ends, out):
    """Compose `step` over all rows; row r owns the points order[starts[r] : ends[r]] of `p` and of
    `out`.

    `h` (rows, steps) holds the lengths of the steps.

    `row(samples, h, coefficients)` reduces samples (2, nodes, L) of L steps of lengths h (L) to
    coefficients (2 width, L); `step(coefficients, c2, p, h)` gives P11, P12, P21, P22 and the
    bounds D11 = D22, D12, D21.
    """
    steps, nodes = samples.shape[1], samples.shape[3]
    state, lanes = np.empty((STATE, TILE)), np.empty(TILE)
    by_step, lengths = np.empty((2, nodes, steps)), np.empty(steps)
    together, coefficients = np.empty((2 * width, steps)), np.empty((steps, 2 * width))
    for r in range(len(ends)):
        for n in range(steps):
            lengths[n] = h[r, n]
            for c in range(2):
                for i in range(nodes):
                    by_step[c, i, n] = samples[r, n, c, i]
        row(by_step, lengths, together)
        for n in range(steps):
            for i in range(2 * width):
                coefficients[n, i] = together[i, n]
        for first in range(starts[r], ends[r], TILE):
            count = min(TILE, ends[r] - first)
            padded = _padded(count)
            for i in range(padded):
                lanes[i] = p[order[first + min(i, count - 1)]]
            _start(state, padded)
            for n in range(steps):
                for i in range(padded):
                    _advance(step(coefficients[n], c2, lanes[i], h[r, n]), h[r, n], state, i)
            for i in range(count):
                _finish(state, i, steps, out[order[first + i]])


@splice
def scatter(row, step, width, samples, c2, h, p, order, starts, out):
    """As `chain` where each row owns one point, order[starts[r]]: lanes are rows. The same
    operations, so bits.
    """
    steps, nodes = samples.shape[1], samples.shape[3]
    # in one array, so that LLVM sees that they do not overlap
    work = np.empty((STATE + 2 + 2 * width, TILE))
    state, lanes, lengths = work[:STATE], work[STATE], work[STATE + 1]
    coefficients, by_lane = work[STATE + 2 :], np.empty((2, nodes, TILE))
    for first in range(0, len(starts), TILE):
        count = min(TILE, len(starts) - first)
        padded = _padded(count)
        for i in range(TILE):
            r = first + min(i, count - 1)
            lanes[i] = p[order[starts[r]]]
        _start(state, padded)
        for n in range(steps):
            for i in range(TILE):
                r = first + min(i, count - 1)
                lengths[i] = h[r, n]
                for c in range(2):
                    for k in range(nodes):
                        by_lane[c, k, i] = samples[r, n, c, k]
            row(by_lane, lengths, coefficients)
            for i in range(padded):
                _advance(step(coefficients[:, i], c2, lanes[i], lengths[i]), lengths[i], state, i)
        for i in range(count):
            _finish(state, i, steps, out[order[starts[first + i]]])


@splice
def _padded(count):
    """The number of lanes that fills the machine's vectors; those beyond `count` repeat the last."""
    return (count + VECTOR - 1) // VECTOR * VECTOR


@splice
def _start(state, count):
    for k in range(STATE):
        for i in range(count):
            state[k, i] = 0.0
    for i in range(count):
        state[Y1, i] = 1.0
        state[DY2, i] = 1.0


@unroll
def _advance(matrix, h, state, i):
    """One step of lane i."""
    for at, ellipse, zeros in ((Y1, _ELLIPSE_1, _ZEROS_1), (Y2, _ELLIPSE_2, _ZEROS_2)):
        before = state[at, i]
        ends = column(matrix, before, state[at + 1, i], *(state[ellipse + k, i] for k in range(3)))
        state[zeros, i] = state[zeros, i] + changes_sign(before, ends[0])
        state[at, i], state[at + 1, i] = ends[:2]
        for k in range(3):
            state[ellipse + k, i] = ends[2 + k]
    state[_SUM, i] = state[_SUM, i] + relative(matrix, h)


@unroll
def relative(matrix, h):
    """The local error bounds of a step as one number without units."""
    _a, _b, _c, _d, diagonal, upper, lower = matrix
    return diagonal + (upper / h + lower * h)


@unroll
def column(matrix, y, v, s, t, w):
    """(y, v) and its error ellipse (s, t; t, w) after the step with propagator and bounds `matrix`."""
    a, b, c, d, diagonal, upper, lower = matrix
    error_y = SCALE * fma(diagonal, abs(y), upper * abs(v))
    error_v = SCALE * fma(lower, abs(y), diagonal * abs(v))
    left, right = fma(a, s, b * t), fma(a, t, b * w)
    low, high = fma(c, s, d * t), fma(c, t, d * w)
    # rounding: where one solution outgrows the other by 1e16 in square, a thin ellipse would lose
    # its positive sign
    round_y = ROUNDING * fma(a, a * s, b * (b * w))
    round_v = ROUNDING * fma(c, c * s, d * (d * w))
    s = fma(left, a, fma(right, b, fma(error_y, error_y, LEAST + round_y)))
    t = fma(left, c, right * d)
    w = fma(low, c, fma(high, d, fma(error_v, error_v, LEAST + round_v)))
    return fma(a, y, b * v), fma(c, y, d * v), s, t, w


@splice
def _finish(state, i, steps, out):
    for k in range(4):
        out[Y1 + k] = state[k, i]
    s1, w1 = state[_ELLIPSE_1, i], state[_ELLIPSE_1 + 2, i]
    s2, w2 = state[_ELLIPSE_2, i], state[_ELLIPSE_2 + 2, i]
    bars(s1, w1, s2, w2, steps, state[_SUM, i], out)
    out[Y1_ZEROS], out[Y2_ZEROS] = state[_ZEROS_1, i], state[_ZEROS_2, i]


@splice
def bars(s1, w1, s2, w2, steps, total, out):
    """The four error bounds from the diagonals of the ellipses, the number of steps and M."""
    doubt, terms = np.exp(min(total, WORST)) / SCALE, 2.0 * steps
    out[Y1_BAR], out[DY1_BAR] = doubt * np.sqrt(terms * s1), doubt * np.sqrt(terms * w1)
    out[Y2_BAR], out[DY2_BAR] = doubt * np.sqrt(terms * s2), doubt * np.sqrt(terms * w2)
