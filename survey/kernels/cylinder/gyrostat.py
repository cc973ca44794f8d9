"""The gyrostat with Barnett-London effect in full: six equations, Taylor series, variational
equation.

    A w' = (A w + lambda) x w + u x nu,   u = B w - C nu + s,   nu' = nu x w                     (1)-(6)

A system is an array G of ROWS of three: A, its inverse, B and C, three rows each, then lambda and
s. A step keeps its series in T[n, column], columns w, nu, A w + lambda, u of three each, and the
products of the variational equation in V[n, column of the start, row]; a state is (w, nu).

Source: M. E. Lesina, Ya. V. Zinovyeva (2004), whose components (1)-(6) are this vector form.
"""

import math

import numpy as np

from survey.kernels.cylinder.flow import B12, B31, BOUND_F, BOUND_G, C23, LOW, S2, S3, D
from survey.kernels.jit import inline, kernel
from survey.kernels.math.roundoff import ROUNDOFF_UP

ORDER = 20
LAST = ORDER + 1  # T[LAST, 0]: truncation error of the step, relative
_W, _NU, _L, _U = 0, 3, 6, 9
# The rows of G: where the tensors begin, and the vectors.
A, INVERSE, B, C, LAMBDA, S = 0, 3, 6, 9, 12, 13
ROWS = 14
FALL = 1.0 / 50.0  # by more, two terms further on, no series is trusted to fall
FIRST_ORDER = 1e-5  # accuracy of the variational equation, which only carries errors and growth
A11 = 1.5


def _rotation(a, b, c, d):
    """The matrix of the unit quaternion (a, b, c, d) / |.|."""
    n = a * a + b * b + c * c + d * d
    rows = (
        (a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)),
        (2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)),
        (2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d),
    )
    return np.array(rows) / n


# of the body's axes: no component of any tensor is zero in it
FRAME = _rotation(1.0, 2.0, 3.0, 4.0)
# what the reduced motion does not depend on, over A11
A22, A23, A33, B22, B23, B33, C11, LAMBDA1 = range(8)


@kernel
def generic(p, w, free):
    """Fill `free` for the reduced flow p and velocities about w, in its own units of time: of slow
    growth off the set.

    On the set div(w2', w3') = -(B12 cos phi / A22 - B31 sin phi / A33): it repels where the reduced
    flow contracts, the less, the larger A22 and A33 are; the gyrostatic moment along axis 1 holds
    the rest.
    """
    rate = p[BOUND_F] + math.sqrt(p[BOUND_G]) + abs(w)
    free[A22], free[A23], free[A33] = 8.0, 0.1, 8.5
    free[B22], free[B23], free[B33] = 0.04 * rate, 0.03 * rate, -0.03 * rate
    free[C11], free[LAMBDA1] = 0.1 * rate * rate, 8.0 * rate


@kernel
def embed(p, free, G):
    """Fill G with the gyrostat, in the rotated frame, whose set w2 = w3 = nu1 = 0 carries the
    reduced flow p.

    The set's conditions (case B): A12 = A31 = B11 = 0, lambda2 = lambda3 = 0 (53), C12 = C31 = 0
    (54), s1 = 0.
    """
    _turned(G, A, 1.0, 0.0, 0.0, free[A22], free[A23], free[A33])
    _turned(G, B, 0.0, p[B12], p[B31], free[B22], free[B23], free[B33])
    _turned(G, C, free[C11], 0.0, 0.0, 0.75 * p[D], p[C23], -0.25 * p[D])
    for i in range(3):
        G[LAMBDA, i] = A11 * FRAME[i, 0] * free[LAMBDA1]
        G[S, i] = A11 * (FRAME[i, 1] * p[S2] + FRAME[i, 2] * p[S3])
    invert(G)


@inline
def _turned(G, row, m11, m12, m31, m22, m23, m33):
    """Rows of G <- A11 Q M Q^T."""
    for i in range(3):
        x = FRAME[i, 0] * m11 + FRAME[i, 1] * m12 + FRAME[i, 2] * m31
        y = FRAME[i, 0] * m12 + FRAME[i, 1] * m22 + FRAME[i, 2] * m23
        z = FRAME[i, 0] * m31 + FRAME[i, 1] * m23 + FRAME[i, 2] * m33
        for j in range(3):
            G[row + i, j] = A11 * (x * FRAME[j, 0] + y * FRAME[j, 1] + z * FRAME[j, 2])


@kernel
def invert(G):
    """Fill rows 3-5 of G with the inverse of rows 0-2."""
    for i in range(3):
        for j in range(3):
            a, b, c, d = (j + 1) % 3, (j + 2) % 3, (i + 1) % 3, (i + 2) % 3
            G[INVERSE + i, j] = G[A + a, c] * G[A + b, d] - G[A + a, d] * G[A + b, c]
    determinant = (
        G[A, 0] * G[INVERSE, 0] + G[A, 1] * G[INVERSE + 1, 0] + G[A, 2] * G[INVERSE + 2, 0]
    )
    for i in range(3):
        for j in range(3):
            G[INVERSE + i, j] /= determinant


@kernel
def start(phi, w, state):
    """Fill `state` with the set's state (phi, w), in the rotated frame: nu = (0, sin phi, cos phi)."""
    s, c = math.sin(phi), math.cos(phi)
    for i in range(3):
        state[i], state[3 + i] = FRAME[i, 0] * w, FRAME[i, 1] * s + FRAME[i, 2] * c


@kernel
def series(G, state, T, order):
    """Fill T with the series through `state` up to t^order."""
    for i in range(6):
        T[0, i] = state[i]
    for n in range(order + 1):
        for i in range(3):
            k = 1.0 * G[LAMBDA, i] if n == 0 else 0.0
            u = 1.0 * G[S, i] if n == 0 else 0.0
            for j in range(3):
                k += G[A + i, j] * T[n, j]
                u += G[B + i, j] * T[n, j] - G[C + i, j] * T[n, 3 + j]
            T[n, _L + i], T[n, _U + i] = k, u
        if n == order:
            return
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            torque = turn = 0.0
            for k in range(n + 1):
                m = n - k
                torque += T[k, _L + a] * T[m, b] - T[k, _L + b] * T[m, a]
                torque += T[k, _U + a] * T[m, 3 + b] - T[k, _U + b] * T[m, 3 + a]
                turn += T[k, 3 + a] * T[m, b] - T[k, 3 + b] * T[m, a]
            T[n + 1, 3 + i], T[LAST, i] = turn / (n + 1), torque / (n + 1)
        for i in range(3):
            T[n + 1, i] = 0.0
            for j in range(3):
                T[n + 1, i] += G[INVERSE + i, j] * T[LAST, j]


@kernel
def begin(G, state, tolerance, T, V):
    """Expand at `state`; returns the step: the last two terms below `tolerance`, relative; of V
    below FIRST_ORDER.
    """
    series(G, state, T, ORDER)
    variation(G, T, V)
    size, tangent, h = 1.0, 1e-300, math.inf
    for i in range(3):
        size = max(size, abs(state[i]))
    for n in range(ORDER - 3, ORDER + 1):
        # where the last terms happen to vanish, as from rest, the two before them count too, less
        # strictly
        term = 1e-300
        for i in range(6):
            term = max(term, abs(T[n, i]) * (1.0 / size if i < 3 else 1.0))
        h = min(h, (tolerance / (term if n > ORDER - 2 else FALL * term)) ** (1.0 / n))
    for i in range(6):
        for c in range(6):
            tangent = max(
                tangent,
                abs(V[LOW, c, i]) * (1.0 / size if i < 3 else 1.0) * (size if c < 3 else 1.0),
            )
    T[LAST, 0] = tolerance
    return shortened(T, h, (FIRST_ORDER / tangent) ** (1.0 / LOW))


@inline
def shortened(T, h, most):
    """The step h, or `most` if that is shorter; then the truncation error is less too."""
    if most < h:
        T[LAST, 0] *= (most / h) ** (ORDER - 1)
    return min(h, most)


@kernel
def at(T, dt, state):
    """Fill `state` with the solution at dt after the start of the step."""
    for i in range(6):
        value = T[ORDER, i]
        for n in range(ORDER - 1, -1, -1):
            value = value * dt + T[n, i]
        state[i] = value


@kernel
def angle(T, dt, axis):
    """Integral of axis . w from the start of the step to dt."""
    total = 0.0
    for n in range(ORDER, -1, -1):
        total = total * dt + (axis[0] * T[n, 0] + axis[1] * T[n, 1] + axis[2] * T[n, 2]) / (n + 1)
    return total * dt


@kernel
def variation(G, T, V):
    """Fill V up to t^LOW: A dw' = (A dw) x w + (A w + lambda) x dw + (B dw - C dnu) x nu + u x dnu,
    dnu' = ...
    """
    h = np.empty(3)
    for c in range(6):
        for i in range(6):
            V[0, c, i] = 1.0 if i == c else 0.0
        for n in range(LOW + 1):
            for i in range(3):
                k = u = 0.0
                for j in range(3):
                    k += G[A + i, j] * V[n, c, j]
                    u += G[B + i, j] * V[n, c, j] - G[C + i, j] * V[n, c, 3 + j]
                V[n, c, _L + i], V[n, c, _U + i] = k, u
            if n == LOW:
                break
            for i in range(3):
                a, b = (i + 1) % 3, (i + 2) % 3
                torque = turn = 0.0
                for k in range(n + 1):
                    m = n - k
                    torque += V[k, c, _L + a] * T[m, b] - V[k, c, _L + b] * T[m, a]
                    torque += T[m, _L + a] * V[k, c, b] - T[m, _L + b] * V[k, c, a]
                    torque += V[k, c, _U + a] * T[m, 3 + b] - V[k, c, _U + b] * T[m, 3 + a]
                    torque += T[m, _U + a] * V[k, c, 3 + b] - T[m, _U + b] * V[k, c, 3 + a]
                    turn += V[k, c, 3 + a] * T[m, b] - V[k, c, 3 + b] * T[m, a]
                    turn += T[m, 3 + a] * V[k, c, b] - T[m, 3 + b] * V[k, c, a]
                V[n + 1, c, 3 + i], h[i] = turn / (n + 1), torque / (n + 1)
            for i in range(3):
                V[n + 1, c, i] = 0.0
                for j in range(3):
                    V[n + 1, c, i] += G[INVERSE + i, j] * h[j]


@kernel
def jacobian(V, dt, J):
    """Fill J[i, c] = d state_i(dt) / d state_c(0)."""
    for c in range(6):
        for i in range(6):
            value = V[LOW, c, i]
            for n in range(LOW - 1, -1, -1):
                value = value * dt + V[n, c, i]
            J[i, c] = value


@inline
def _norm(G, row):
    """Largest row sum of the matrix in rows row..row + 2 of G."""
    most = 0.0
    for i in range(row, row + 3):
        most = max(most, abs(G[i, 0]) + abs(G[i, 1]) + abs(G[i, 2]))
    return most


@kernel
def local_error(G, T, dt):
    """Error bars of (a component of w, one of nu) that one step adds: truncation, and rounding also of G."""
    w = abs(T[0, 0]) + abs(T[0, 1]) + abs(T[0, 2])
    moment, force = 0.0, 0.0
    for i in range(3):
        moment, force = max(moment, abs(G[LAMBDA, i])), max(force, abs(G[S, i]))
    torque = (_norm(G, A) * w + moment) * w + (_norm(G, B) * w + _norm(G, C) + force) * 2.0
    rate = _norm(G, INVERSE) * torque
    truncation = T[LAST, 0]
    by_w = truncation * (1.0 + w) + ROUNDOFF_UP * (1.5 * w + 4.0 * dt * rate)
    return by_w, truncation + ROUNDOFF_UP * (1.5 + 4.0 * dt * w)


@kernel
def carry(G, T, V, dt, squares, J, work):
    """squares <- J squares J^T + diag(d^2) over dt of the current step, as in `steps`; J and `work`
    are scratch.
    """
    jacobian(V, dt, J)
    for i in range(6):
        for j in range(6):
            work[i, j] = 0.0
            for k in range(6):
                work[i, j] += J[i, k] * squares[k, j]
    dw, dnu = local_error(G, T, dt)
    for i in range(6):
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += work[i, k] * J[j, k]
            squares[i, j] = total
        squares[i, i] += (dw if i < 3 else dnu) ** 2


@kernel
def states(G, first, times, tolerance, limit, out, tangent):
    """States at the ascending times >= 0 in out[j], and in tangent[j] their derivatives by the
    first; steps or -1.
    """
    T, V, J = np.zeros((LAST + 1, 12)), np.zeros((LOW + 1, 6, 12)), np.zeros((6, 6))
    state, propagator = first.copy(), np.eye(6)
    t, j = 0.0, 0
    for step in range(limit):
        h = begin(G, state, tolerance, T, V)
        while j < len(times) and times[j] - t < h:
            at(T, times[j] - t, out[j])
            jacobian(V, times[j] - t, J)
            _product(J, propagator, tangent[j])
            j += 1
        if j == len(times):
            return step + 1
        if not h > 0.0:
            break
        at(T, h, state)
        jacobian(V, h, J)
        work = np.empty((6, 6))
        _product(J, propagator, work)
        propagator = work
        t += h
    return -1


@kernel
def _product(a, b, out):
    for i in range(6):
        for j in range(6):
            out[i, j] = 0.0
            for k in range(6):
                out[i, j] += a[i, k] * b[k, j]
