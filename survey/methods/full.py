"""The six equations (1)-(6) of a gyrostat whose invariant set is the scene, in a rotated body
frame: an audit.

Builds A, B, C, s, lambda from the reduced parameters, with generic values for what these leave free
(`kernels/cylinder/gyrostat.py`), and makes no use of the set: its bars include the growth of
deviations from it. Taylor series of order 20. Domain: trajectories whose set is not strongly
unstable.
"""

import math

import numpy as np

from survey.kernels.cylinder import gyrostat
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import LOW, TWO_PI, TWO_PI_LOW, longest_step, reduced
from survey.kernels.cylinder.steps import (
    NO_CONVERGENCE,
    OK,
    OVERFLOW,
    STEP_LIMIT,
    TRUST,
    UNDETERMINED,
    bar,
    finite,
    start_sign,
)
from survey.kernels.jit import kernel
from survey.kernels.math.roundoff import ROUNDOFF_UP

ORDER = gyrostat.ORDER
SERVES = ("cylinder",)
WHEN = {"question": ("trajectory",)}
COST = {"cylinder": 90.0}  # time, relative to the default method
FLOW_FINEST = 1e-17  # useful truncation error of a step
FLOW_WORK = 2  # steps, relative to the Taylor method
# of components, in each of which a step and the initial state err; `bar` counts two for each step
_PAIRS = 3
_FIRST = 4.0 * ROUNDOFF_UP  # rounding of the initial state in the rotated frame


@kernel
def _read(state, squares, n, near, out):
    """out = phi next to `near`, w = phi', and their bars, of a state and its error ellipse after n steps."""
    frame = gyrostat.FRAME
    w = s = c = 0.0
    for i in range(3):
        w += frame[i, 0] * state[i]
        s += frame[i, 1] * state[3 + i]
        c += frame[i, 2] * state[3 + i]
    phi = math.atan2(s, c)
    turns = math.floor((near - phi) / TWO_PI + 0.5)
    a = b = 0.0
    for i in range(3):
        for j in range(3):
            a += (
                (c * frame[i, 1] - s * frame[i, 2])
                * squares[3 + i, 3 + j]
                * (c * frame[j, 1] - s * frame[j, 2])
            )
            b += frame[i, 0] * squares[i, j] * frame[j, 0]
    out[rc.PHI], out[rc.W] = phi + turns * TWO_PI, w
    out[rc.PHI_BAR] = bar(_PAIRS * (n + 1), a) + ROUNDOFF_UP * (4.0 + 4.0 * abs(turns) * TWO_PI)
    out[rc.W_BAR] = bar(_PAIRS * (n + 1), b) + ROUNDOFF_UP * 4.0 * abs(w)


@kernel
def _trajectory(p, phi0, w0, times, tolerance, limit, floats, turnings):
    """As `steps.trajectory`, by the full equations."""
    free = np.empty(8)
    G = np.empty((gyrostat.ROWS, 3))
    squares = np.zeros((6, 6))
    axis = gyrostat.FRAME[:, 0].copy()
    T, V = np.zeros((gyrostat.LAST + 1, 12)), np.zeros((LOW + 1, 6, 12))
    state, new, J, work = np.empty(6), np.empty(6), np.empty((6, 6)), np.empty((6, 6))
    here, there = np.empty(rc.STATE), np.empty((6, 6))
    gyrostat.generic(p, w0, free)
    gyrostat.embed(p, free, G)
    phi, before = reduced(phi0)  # before: turns already in phi0
    gyrostat.start(phi, w0, state)
    for i in range(6):
        squares[i, i] = (_FIRST * (abs(w0) if i < 3 else 2.0)) ** 2
    w, t, t_low, j, size = w0, 0.0, 0.0, 0, len(times)
    sign, unsure, count = start_sign(p, phi, w), 0, 0
    for n in range(1, limit + 1):
        if j == size:
            return OK
        h = gyrostat.shortened(T, gyrostat.begin(G, state, tolerance, T, V), longest_step(p, w))
        if not (h > 0.0 and math.isfinite(h)):
            return OVERFLOW
        while j < size and (times[j] - t) - t_low < h:
            dt = (times[j] - t) - t_low
            gyrostat.at(T, dt, new)
            for i in range(6):  # an assignment of arrays takes seconds to compile
                for k in range(6):
                    there[i, k] = squares[i, k]
            gyrostat.carry(G, T, V, dt, there, J, work)
            _read(new, there, n, phi + gyrostat.angle(T, dt, axis), here)
            if not (here[rc.PHI_BAR] < TRUST and here[rc.W_BAR] < TRUST * (1.0 + abs(here[rc.W]))):
                return NO_CONVERGENCE
            floats[j, rc.PHI], floats[j, rc.W] = (
                (here[rc.PHI] + before * TWO_PI_LOW) + before * TWO_PI,
                here[rc.W],
            )
            floats[j, rc.PHI_BAR], floats[j, rc.W_BAR] = (
                here[rc.PHI_BAR] + 3e-16 * abs(before) * TWO_PI,
                here[rc.W_BAR],
            )
            from_rest = n == 1 and w0 == 0.0
            sure = unsure < 3 and count >= 0 and (abs(here[rc.W]) > here[rc.W_BAR] or from_rest)
            turnings[j] = (
                count + (here[rc.W] * sign < 0.0 and not from_rest) if sure else UNDETERMINED
            )
            j += 1
        gyrostat.at(T, h, new)
        gyrostat.carry(G, T, V, h, squares, J, work)
        _read(new, squares, n, phi + gyrostat.angle(T, h, axis), here)
        state, new = new, state
        phi, w = here[rc.PHI], here[rc.W]
        high = t + h
        t_low += h - (high - t)
        t = high
        if not (here[rc.PHI_BAR] < 1.0 and here[rc.W_BAR] < 1.0 + abs(w)):
            return NO_CONVERGENCE if math.isfinite(w) else OVERFLOW
        if abs(w) <= here[rc.W_BAR]:
            unsure += 1
            continue
        if unsure > 2:
            count = UNDETERMINED - limit  # below zero permanently
        count += w * sign < 0.0
        sign, unsure = (1 if w > 0.0 else -1), 0
    return STEP_LIMIT


@kernel
def flow_trajectories(P, starts, times, tolerance, limit, planes, turnings, status):
    """See `steps.trajectories`."""
    for i in range(len(P)):
        size = finite(times[i])
        status[i] = _trajectory(P[i], starts[i, rc.START_PHI], starts[i, rc.START_W], times[i, :size],
                               tolerance, limit, planes[:, i].T, turnings[i])  # fmt: skip
