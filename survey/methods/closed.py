"""Closed forms where they apply: g = 0 (50), w = mu F + n (61), b = 0 (elliptic functions). No steps, cost free of t.

Domain: trajectory and abel; b = 0 and g = 0 exactly, (61) within 64 roundings (which go into the bar); status
`no_closed_form` elsewhere. Near multiple roots, where digits are lost, `no_convergence`. Uniform rotation is b = g = 0.

Source: M. E. Lesina, Ya. V. Zinovyeva (2004), (50), (61)-(68), as corrected in `scenes/gyrostat.md`, section 2.
"""

import math

import numpy as np

from survey.kernels import closed, weierstrass
from survey.kernels.along import EQUILIBRIUM, NO_CONVERGENCE, OK, TRUST, TURNING, UNTOLD, finite
from survey.kernels.flow import UNIT
from survey.kernels.jit import inline, kernel
from survey.kernels.weierstrass import LANES

ORDER = 0  # no steps
SERVES = ("cylinder",)
WHEN = {"question": ("trajectory", "abel")}
COST = {"cylinder": 0.2}  # time, relative to the default method
FLOW_FINEST = 1.0  # nothing to refine
FLOW_WORK = 1
NO_FORM = 19  # as in the STATUS of scenes/gyrostat.py


@kernel
def flow_trajectories(P, starts, times, tolerance, limit, floats, turnings, status):
    """See `along.trajectories`; tolerance and limit have no meaning here."""
    T, row, column = weierstrass.lanes(), np.empty(LANES, np.int64), np.empty(LANES, np.int64)
    place, waiting = np.zeros(2, np.int64), LANES
    while waiting == LANES:
        waiting = _fill(P, starts, times, place, T, row, column, floats, turnings, status)
        weierstrass.solve(T)
        _collect(T, waiting, row, column, starts, floats, turnings)


@kernel
def _fill(P, starts, times, place, T, row, column, floats, turnings, status):
    """From `place` (row, column) on: lanes for solutions with b = 0 until all are taken, the others at once.

    Returns the number of lanes that are taken.
    """
    data, waiting, first = closed.scratch(), 0, place[1]
    for i in range(place[0], len(P)):
        p, phi0, w0 = P[i], starts[i, 0], starts[i, 1]
        kind, mu, miss = closed.applies(p, phi0, w0)
        status[i] = NO_FORM if kind == closed.NONE else NO_CONVERGENCE
        side = 1.0 if w0 >= 0.0 else -1.0
        if kind == closed.TRIGONOMETRIC:
            closed.start_trigonometric(p, phi0, w0, side, mu, miss, data)
        for j in range(first, finite(times[i]) if kind != closed.NONE else 0):
            t = times[i, j]
            if t == 0.0:
                _tell(floats[i, j], phi0, 0.0, w0, 0.0, 0.0)
                turnings[i, j] = 0
            elif kind == closed.TRIGONOMETRIC:
                x, w, bar_x, bar_w = closed.trigonometric_at(data, t)
                if _tell(floats[i, j], phi0, side * x, side * w, bar_x, bar_w):
                    # where (61) is met exactly w keeps its sign
                    turnings[i, j] = UNTOLD if miss > 0.0 and w != 0.0 and w <= bar_w else 0
            elif waiting == LANES:
                place[0], place[1] = i, j
                return waiting
            else:
                row[waiting], column[waiting] = i, j
                weierstrass.enter(T, waiting, p, phi0, w0, t)
                waiting += 1
        first = 0
    place[0] = len(P)
    return waiting


@inline
def _tell(out, phi0, x, w, bar_x, bar_w):
    """Write down one solution at one time; False where the bars are too wide to be bounds."""
    if not (bar_x < TRUST and bar_w < TRUST * (1.0 + abs(w))):
        return False
    out[0], out[1], out[2], out[3] = phi0 + x, w, bar_x + 2.0 * UNIT * abs(phi0 + x), bar_w
    return True


@kernel
def _collect(T, count, row, column, starts, floats, turnings):
    """Write down what the first `count` lanes have found."""
    for k in range(count):
        i, j, w, bar_w = row[k], column[k], T[weierstrass.W, k], T[weierstrass.BAR_W, k]
        if _tell(floats[i, j], starts[i, 0], T[weierstrass.X, k], w, T[weierstrass.BAR_X, k], bar_w):
            turnings[i, j] = int(T[weierstrass.COUNT, k]) if abs(w) > bar_w else UNTOLD


@kernel
def flow_abels(P, starts, targets, tolerance, limit, floats, status):
    """See `along.abels`; tolerance and limit have no meaning here."""
    data = closed.scratch()
    for i in range(len(P)):
        phi0, w0 = starts[i, 0], starts[i, 1]
        kind, side = closed.start(P[i], phi0, w0, data)
        for j in range(finite(targets[i])):
            out, x = floats[i, j], targets[i, j] - phi0
            if kind == closed.NONE or kind == closed.LOST:
                status[i, j] = NO_FORM if kind == closed.NONE else NO_CONVERGENCE
            elif x == 0.0:
                out[0], out[1], out[2], out[3], status[i, j] = w0, 0.0, 0.0, 0.0, OK
            elif kind == closed.TRIGONOMETRIC:
                status[i, j] = _trigonometric(data, w0, x, out)
            else:
                status[i, j] = _elliptic(kind, side, data, phi0, x, out)


@kernel
def _trigonometric(data, w0, x, out):
    """w and t where phi0 + x is passed, on w = mu F + n."""
    if w0 == 0.0:
        return EQUILIBRIUM if data[closed.MISS] == 0.0 else NO_CONVERGENCE
    t, bar_t = closed.trigonometric_reach(data, x)
    if t == math.inf:
        return EQUILIBRIUM if data[closed.MISS] == 0.0 else NO_CONVERGENCE
    s = math.sin(0.5 * x)
    F, f = data[closed.F0], data[closed.SLOPE]
    w = w0 - 2.0 * s * (F * s - f * math.cos(0.5 * x))
    moved = closed.misfit(data, t, w)
    bar = closed.MARGIN * (2.0 * data[closed.NOISE] + moved + 4.0 * UNIT * (w0 + abs(x) * math.hypot(F, f)))
    return _kept(out, w, t, bar, bar_t)


@kernel
def _kept(out, w, t, bar_w, bar_t):
    """OK and the values, or NO_CONVERGENCE where the bars are too wide to be bounds."""
    if not (bar_w < 0.1 * w and bar_w < TRUST * (1.0 + w) and bar_t < TRUST * (1.0 + t)):
        return NO_CONVERGENCE
    out[0], out[1], out[2], out[3] = w, t, bar_w, bar_t
    return OK


@kernel
def _elliptic(kind, side, data, phi0, x, out):
    """w and t where phi0 + x is passed, or the turning point before it, for b = 0."""
    if side < 0.0:  # starts at rest and goes away from the target
        out[0], out[1], out[2], out[3] = phi0, 0.0, 0.0, 0.0
        return TURNING
    if kind == closed.LIBRATION:
        edge, right = data[closed.BAR_RIGHT] + 4.0 * UNIT * (abs(phi0) + abs(x)), data[closed.RIGHT]
        if x >= right - edge:
            t, bar = closed.flight(data, math.pi, 0.0)
            out[0], out[1], out[2] = phi0 + right, t, edge + 4.0 * UNIT * (abs(phi0) + right)
            out[3] = bar + 2.0 * UNIT * t
            return TURNING
        if x > right - 4.0 * edge:
            return NO_CONVERGENCE
        t, bar_t = closed.libration_reach(data, x)
    else:
        t, bar_t = closed.rotation_reach(data, x)
    square, slope, noise = closed.square_of_w(data, x)
    if not square > 4.0 * noise:
        return NO_CONVERGENCE
    w = math.sqrt(square)
    blur = 2.0 * UNIT * (abs(phi0) + abs(x))
    return _kept(out, w, t, closed.MARGIN * (0.5 * (noise + abs(slope) * blur) / w + 2.0 * UNIT * w), bar_t + blur / w)
