"""Deviations z from the set w2 = w3 = 0, nu1 = cos theta of a gyrostat, to first order, over one
period of its motion.

    z' = (M0 + w Mw + sin phi Ms + cos phi Mc) z,   phi' = w,  w' = f w + g

Taylor series in t of order 20 for both. Errors travel as in `measures.linear_motion`: beside each
column of the fundamental matrix goes its error ellipse; what the motion is off, within the bars of
`steps`, errs in the matrix.
"""

import math

import numpy as np

from survey.kernels.cylinder.flow import (
    COS,
    LAST,
    ORDER,
    PHI,
    SIN,
    TRUNC_PHI,
    TRUNC_W,
    TWO_PI,
    W,
    inside,
    longest_step,
    series,
    table,
    values,
    variation,
)
from survey.kernels.cylinder.steps import bar, carried, passage, time_of_turning, trusted
from survey.kernels.jit import inline, kernel
from survey.kernels.math.roundoff import EPS

SIZE = 3  # of z
BY_NOTHING, BY_W, BY_SIN, BY_COS = range(4)  # matrices of M
PERIOD, PERIOD_BAR, LOG_DET, LOG_DET_BAR, MATRIX_BAR = range(5)  # of what `monodromy` notes
TOLERANCE = 1e-17  # truncation of a step
LIMIT = 20_000
_FALL = 1.0 / 50.0  # by more, two terms further on, no series is trusted to fall
_SUMS = 12.0  # roundings of a sum of products, as in `measures.linear_motion`


@kernel
def _at(p, T, dt):
    """As a method's `flow_at`."""
    return inside(T, dt)


@kernel
def _begin(p, M, phi, w, T, Z):
    """Expand the motion into T and the propagator into Z (ORDER + 1, SIZE, SIZE); returns the step."""
    series(p, phi, w, T, ORDER)
    variation(p, T)
    for i in range(SIZE):
        for c in range(SIZE):
            Z[0, i, c] = 1.0 if i == c else 0.0
    for n in range(ORDER):
        for i in range(SIZE):
            for c in range(SIZE):
                Z[n + 1, i, c] = 0.0
        for k in range(n + 1):
            for i in range(SIZE):
                for j in range(SIZE):
                    m = (
                        M[BY_W, i, j] * T[k, W]
                        + M[BY_SIN, i, j] * T[k, SIN]
                        + M[BY_COS, i, j] * T[k, COS]
                    )
                    if k == 0:
                        m += M[BY_NOTHING, i, j]
                    for c in range(SIZE):
                        Z[n + 1, i, c] += m * Z[n - k, j, c] / (n + 1)
    h, scale = longest_step(p, w), 1.0 / (1.0 + abs(w))
    for n in range(ORDER - 3, ORDER + 1):
        term = max(abs(T[n, PHI]), scale * abs(T[n, W]))
        for i in range(SIZE):
            for c in range(SIZE):
                term = max(term, abs(Z[n, i, c]))
        # where the last terms happen to vanish, the two before them count too, less strictly
        h = min(h, (TOLERANCE / ((term if n > ORDER - 2 else _FALL * term) + 1e-300)) ** (1.0 / n))
    T[LAST, TRUNC_PHI], T[LAST, TRUNC_W] = TOLERANCE, TOLERANCE / scale
    return h


@inline
def _integral(M, T, dt):
    """Integral of the trace of the matrix over dt, and of the magnitudes of its terms at the start."""
    total, size = 0.0, 0.0
    for i in range(SIZE):
        s = 0.0
        for n in range(ORDER, -1, -1):
            m = M[BY_W, i, i] * T[n, W] + M[BY_SIN, i, i] * T[n, SIN] + M[BY_COS, i, i] * T[n, COS]
            s = s * dt + (m + (M[BY_NOTHING, i, i] if n == 0 else 0.0)) / (n + 1)
        total += s * dt
        size += (
            abs(M[BY_NOTHING, i, i])
            + abs(M[BY_W, i, i] * T[0, W])
            + abs(M[BY_SIN, i, i])
            + abs(M[BY_COS, i, i])
        )
    return total, size * dt


@inline
def _norm(matrix):
    """Largest row sum of magnitudes."""
    most = 0.0
    for i in range(SIZE):
        total = 0.0
        for j in range(SIZE):
            total += abs(matrix[i, j])
        most = max(most, total)
    return most


@kernel
def _advance(Z, dt, local, P, fundamental, ellipses, work):
    """Carry the fundamental matrix and its columns' error ellipses over dt; `local` is the error of
    a step over |P|.
    """
    for i in range(SIZE):
        for c in range(SIZE):
            value = Z[ORDER, i, c]
            for n in range(ORDER - 1, -1, -1):
                value = value * dt + Z[n, i, c]
            P[i, c] = value
    error = local * max(_norm(P), 1.0)
    for c in range(SIZE):
        size = 0.0
        for i in range(SIZE):
            size = max(size, abs(fundamental[i, c]))
        for i in range(SIZE):
            for j in range(SIZE):
                work[i, j] = 0.0
                for k in range(SIZE):
                    work[i, j] += P[i, k] * ellipses[c, k, j]
        for i in range(SIZE):
            for j in range(SIZE):
                total = (error * size) ** 2 if i == j else 0.0
                for k in range(SIZE):
                    total += work[i, k] * P[j, k]
                ellipses[c, i, j] = total
    for i in range(SIZE):
        for c in range(SIZE):
            work[i, c] = 0.0
            for k in range(SIZE):
                work[i, c] += P[i, k] * fundamental[k, c]
    for i in range(SIZE):
        for c in range(SIZE):
            fundamental[i, c] = work[i, c]


@kernel
def monodromy(p, M, slip, start, rotates, fundamental, notes):
    """Fill the fundamental matrix over one period from `start` (phi, w), and `notes`; True if it
    closed.

    `rotates`: the period ends a turn later, else (a libration) where the start is passed again
    after two turning points. `slip` bounds what the matrices M (4, SIZE, SIZE) are off, in norm
    over that of M.
    """
    T = table()
    Z = np.empty((ORDER + 1, SIZE, SIZE))
    P = np.empty((SIZE, SIZE))
    work = np.empty((SIZE, SIZE))
    ellipses, turnings = np.zeros((SIZE, SIZE, SIZE)), 0
    phi, w, t, log_det, log_bar = start[0], start[1], 0.0, 0.0, 0.0
    saa, sab, sbb = 0.0, 0.0, 0.0
    constant = _norm(M[BY_NOTHING])
    by_w = _norm(M[BY_W])
    by_angle = _norm(M[BY_SIN]) + _norm(M[BY_COS])
    for i in range(SIZE):
        for c in range(SIZE):
            fundamental[i, c] = 1.0 if i == c else 0.0
    up = w > 0.0
    target = start[0] + (0.0 if not rotates else (TWO_PI if up else -TWO_PI))
    for n in range(1, LIMIT):
        h = _begin(p, M, phi, w, T, Z)
        if not (h > 0.0 and math.isfinite(h)):
            return False
        x1, w1, _e, _y = _at(p, T, h)
        reach, turned, ends = h, False, False
        if w1 * (w if w != 0.0 else T[1, W]) < 0.0:
            reach = time_of_turning(_at, p, T, h)
            turned = True
            x1, w1, _e, _y = _at(p, T, reach)
        if rotates:
            if turned:
                return False
            ends = x1 >= target if up else x1 <= target
        elif start[1] == 0.0:
            ends = turned and turnings == 1
        else:
            ends = turnings == 2 and (x1 >= target if up else x1 <= target)
        if ends and not (turned and start[1] == 0.0):
            reach = passage(_at, p, T, target, up, reach)
            x1, w1, _e, _y = _at(p, T, reach)
        elif turned:
            turnings += 1
            if turnings > 2:
                return False
        saa, sab, sbb = carried(p, T, reach, w1, saa, sab, sbb)
        if not trusted(saa, sbb, w1):
            return False
        bar_phi, bar_w = bar(n + 1, saa), bar(n + 1, sbb)
        rate = constant + by_w * max(abs(w), abs(w1)) + by_angle
        off = by_angle * bar_phi + by_w * bar_w + slip * rate
        local = 3.0 * TOLERANCE + EPS * (2.0 + _SUMS * reach * rate) + 1.1 * reach * off
        _advance(Z, reach, local, P, fundamental, ellipses, work)
        part, size = _integral(M, T, reach)
        log_det += part
        log_bar += SIZE * (reach * off + TOLERANCE) + EPS * (_SUMS * size + abs(log_det))
        phi, w, t = x1, 0.0 if turned and not ends else w1, t + reach
        if ends:
            speed = abs(w1) if start[1] != 0.0 else abs(values(p, x1)[1])
            delay = 1.2 * (bar_phi if start[1] != 0.0 else bar_w) / max(speed, 1e-300) + 4e-16 * t
            worst = largest = 0.0
            for c in range(SIZE):
                for i in range(SIZE):
                    worst, largest = (
                        max(worst, ellipses[c, i, i]),
                        max(largest, abs(fundamental[i, c])),
                    )
            notes[PERIOD], notes[PERIOD_BAR] = t, delay
            notes[LOG_DET], notes[LOG_DET_BAR] = log_det, log_bar + SIZE * rate * delay
            notes[MATRIX_BAR] = 1.01 * math.sqrt(SIZE * n * worst) + rate * SIZE * largest * delay
            return True
    return False
