"""Many points in lock step: the propagators of a linear second-order equation composed over the half period.

A row shares everything that does not depend on the lane variable p: its equation is y'' + z y = 0 with
z(t) = c0(t) + p c1(t) + p^2 c2, c2 a number. Lanes are innermost in memory, so that LLVM turns the loop over them
into vector code; a lane's operations do not depend on its neighbours, nor its bits on the number of lanes.

Beside the two columns of the fundamental matrix goes, for each, the 2x2 matrix S of its error ellipse:
S <- P S P^T + diag(d^2) with d = D |column| the step's local error bound. To first order the error after n steps
is a sum of n propagated local errors, hence |error_i| <= sqrt(n S_ii) (Cauchy-Schwarz), whatever their signs. The
first order is trusted as far as the local errors are small: with M their sum, relative to the step's own matrix,
the bounds are multiplied by exp(M), else a step so long that the method damps would damp its errors too.
"""

import numpy as np

from survey.kernels.jit import inline

TILE = 64
STATE = 13
WORST = 300.0


@inline
def chain(row, step, width, samples, c2, h, p, order, starts, ends, out):
    """Compose `step` over all rows; row r owns the points order[starts[r] : ends[r]] of `p` and of `out`.

    `row(samples, coefficients)` reduces the samples (2, nodes) of a step to (2, width) coefficients, once per row;
    `step(coefficients, c2, p, h)` gives P11, P12, P21, P22 and the bounds D11 = D22, D12, D21.
    """
    state, lanes = np.empty((STATE, TILE)), np.empty(TILE)
    coefficients = np.empty((samples.shape[1], 2, width))
    for r in range(len(ends)):
        for n in range(samples.shape[1]):
            row(samples[r, n], coefficients[n])
        for first in range(starts[r], ends[r], TILE):
            count = min(TILE, ends[r] - first)
            for i in range(count):
                lanes[i] = p[order[first + i]]
            _start(state, count)
            for n in range(samples.shape[1]):
                _advance(step, coefficients[n], c2, lanes, h[r], state, count)
            _finish(state, count, samples.shape[1], order[first : first + count], out)


@inline
def _start(state, count):
    for k in range(STATE):
        for i in range(count):
            state[k, i] = 0.0
    for i in range(count):
        state[0, i] = 1.0
        state[3, i] = 1.0


@inline
def _advance(step, coefficients, c2, p, h, state, count):
    """One step of all lanes. State: y1, y1', y2, y2', S of column 1 (3), S of column 2 (3), zeros of y1, y2, M."""
    for i in range(count):
        matrix = step(coefficients, c2, p[i], h)
        y, v, s, t, w = column(matrix, state[0, i], state[1, i], state[4, i], state[5, i], state[6, i])
        state[10, i] += 1.0 if (y < 0.0) != (state[0, i] < 0.0) else 0.0
        state[0, i], state[1, i] = y, v
        state[4, i], state[5, i], state[6, i] = s, t, w
        y, v, s, t, w = column(matrix, state[2, i], state[3, i], state[7, i], state[8, i], state[9, i])
        state[11, i] += 1.0 if (y < 0.0) != (state[2, i] < 0.0) else 0.0
        state[2, i], state[3, i] = y, v
        state[7, i], state[8, i], state[9, i] = s, t, w
        state[12, i] += relative(matrix, h)


@inline
def relative(matrix, h):
    """The local error bounds of a step as one number without units."""
    return matrix[4] + (matrix[5] / h + matrix[6] * h)


@inline
def column(matrix, y, v, s, t, w):
    """(y, v) and its error ellipse (s, t; t, w) after the step with propagator and bounds `matrix`."""
    a, b, c, d, diagonal, upper, lower = matrix
    error_y = diagonal * abs(y) + upper * abs(v)
    error_v = lower * abs(y) + diagonal * abs(v)
    left, right = a * s + b * t, a * t + b * w
    low, high = c * s + d * t, c * t + d * w
    s = left * a + right * b + error_y * error_y
    t = left * c + right * d
    w = low * c + high * d + error_v * error_v
    return a * y + b * v, c * y + d * v, s, t, w


@inline
def _finish(state, count, steps, places, out):
    for i in range(count):
        own = out[places[i]]
        own[0], own[1], own[2], own[3] = state[0, i], state[1, i], state[2, i], state[3, i]
        bars(state[4, i], state[6, i], state[7, i], state[9, i], steps, state[12, i], own)
        own[8], own[9] = state[10, i], state[11, i]


@inline
def bars(s1, w1, s2, w2, steps, total, out):
    """The four error bounds from the diagonals of the ellipses, the number of steps and M."""
    doubt = np.exp(min(total, WORST))
    out[4], out[5] = doubt * np.sqrt(steps * s1), doubt * np.sqrt(steps * w1)
    out[6], out[7] = doubt * np.sqrt(steps * s2), doubt * np.sqrt(steps * w2)
