"""DOP853, order 8, adaptive: chooses its own steps at every point, from z at any t. The independent
check.

A step propagates the identity, so the embedded estimate bounds the entries of the propagator, and
errors travel as in `survey.kernels.lanes`. Domain: piecewise smooth z, hard points; slower than the
fixed steps, and its rounding (stage sums that cancel) leaves about 1e-12.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.5 and
dop853.f.
"""

import math

import numpy as np

from survey.kernels.body import motion
from survey.kernels.cylinder import borders, fate, returns, steps
from survey.kernels.cylinder.flow import (
    BOUND_DG,
    BOUND_F,
    LAST,
    LOW,
    PHI,
    STEP,
    TRUNC_PHI,
    TRUNC_W,
    WEIGHT,
    W,
    series,
    values,
)
from survey.kernels.floquet import runge_kutta
from survey.kernels.hill import dop853 as hill
from survey.kernels.hill.dop853 import DOUBT
from survey.kernels.jit import inline, kernel, part
from survey.kernels.math.dop853 import E3, E5, STAGES, A, B, C, combined

ORDER = 8
SERVES = ("abel", "body", "cylinder", "danby", "floquet", "hill", "orbit")
# time, relative to the default of each family
COST = {
    "abel": 20.0,
    "body": 60.0,
    "cylinder": 60.0,
    "danby": 4000.0,
    "floquet": 10.0,
    "hill": 80.0,
    "orbit": 20.0,
}
_ABOUT = "DOP853, order 8, adaptive: "
_CHECK = "steps of its own at every point. The independent check."
ABOUT = {
    "abel": _ABOUT + "phi' = w, w' = f w + g in time, " + _CHECK,
    "body": _ABOUT + "the six equations (1)-(6) in time, " + _CHECK,
    "cylinder": _ABOUT + "phi' = w, w' = f w + g in time, " + _CHECK,
    "danby": _ABOUT + "the four linear equations about L4 over half a period, " + _CHECK,
    "floquet": _ABOUT + "x' = A(t) x, " + _CHECK,
    "hill": _ABOUT + "y'' + z y = 0, " + _CHECK,
    "orbit": _ABOUT + "x' = f(t, x) and its variational equation, " + _CHECK,
}
FLOW_FINEST = 1e-16  # useful tolerance for flows on the cylinder
FLOW_WORK = 4  # steps, relative to the Taylor method
_FIRST = LOW + 1  # stages lie in the lines of the table after the low series
ADAPTIVE = True
NODES = tuple(C[:STAGES])
_WEIGHT = float(np.abs(B).sum())  # 12.9: some of B are negative
_OTHER = 0.3


floquet_factors = runge_kutta.factors
hill_step = hill.hill_step
hill_walk = hill.hill_walk
hill_walk_pieces = hill.hill_walk_pieces
orbit_motion = runge_kutta.motion


def floquet_reach(rtol):
    """How far the norm of A times half a step may go for accuracy rtol."""
    return 0.5 * (1e4 * max(rtol, 1e-13)) ** (1 / (ORDER + 1))


@inline
def flow_setting(p, w, tolerance):
    """What controls the steps: the tolerance of one step."""
    return tolerance


@kernel
def flow_at(p, T, dt):
    """(phi, w, integral of f, integral of g) at dt after the start of the step: one step of size dt."""
    phi, w = T[0, PHI], T[0, W]
    # changes: each sum is added to phi or w once, whose rounding is the one that bars count
    x = v = e = y = 0.0
    for i in range(STAGES):
        dx = dv = 0.0
        for k in range(i):
            dx += A[i, k] * T[_FIRST + k, PHI]
            dv += A[i, k] * T[_FIRST + k, W]
        wi = w + dt * dv
        f, g, _dg = values(p, phi + dt * dx)
        ai = f * wi + g
        T[_FIRST + i, PHI], T[_FIRST + i, W] = wi, ai
        x += dt * B[i] * wi
        v += dt * B[i] * ai
        e += dt * B[i] * f
        y += dt * B[i] * g
    return phi + x, w + v, e, y


@inline
def _flow_estimate(T, h, row, doubt):
    """The error estimate of dop853.f for one component, from the stages in T; it must not vanish by
    chance.
    """
    e5 = e3 = 0.0
    for i in range(STAGES):
        e5 += E5[i] * T[_FIRST + i, row]
        e3 += E3[i] * T[_FIRST + i, row]
    return abs(h) * (combined(e5, e3) + doubt * abs(e5))


@kernel
def flow_begin(p, phi, w, tolerance, T):
    """Start a step at (phi, w) and find its size, from that of the step before."""
    series(p, phi, w, T, LOW)
    rate = p[BOUND_F] + math.sqrt(p[BOUND_DG]) + abs(w) + 1e-300
    h = T[LAST, STEP] if T[LAST, STEP] > 0.0 else 0.1 / rate
    for _ in range(50):
        _x, w1, _e, _y = flow_at(p, T, h)
        doubt, speed = 8.0 * DOUBT * (h * rate) ** 3, max(rate, 1.0 / h)
        dphi, dw = _flow_estimate(T, h, PHI, doubt), _flow_estimate(T, h, W, doubt)
        # where the motion starts at rest, one of them may vanish by symmetry: each bounds the
        # other, with less weight
        dphi, dw = max(dphi, _OTHER * dw / speed), max(dw, _OTHER * dphi * speed)
        error = max(dphi, dw / (1.0 + abs(w))) / tolerance
        factor = min(max(0.9 * (error + 1e-30) ** -0.125, 0.2), 4.0)
        if error <= 1.0:
            break
        h *= factor
    T[LAST, STEP] = h * factor
    T[LAST, TRUNC_PHI], T[LAST, TRUNC_W], T[LAST, WEIGHT] = dphi, dw, _WEIGHT
    return h if math.isfinite(w1) else math.nan


@kernel
def flow_trajectories(P, starts, times, tolerance, limit, planes, turnings, status):
    """See `steps.trajectories`."""
    steps.trajectories(
        flow_setting,
        flow_begin,
        flow_at,
        P,
        starts,
        times,
        tolerance,
        limit,
        planes,
        turnings,
        status,
    )


@kernel
def flow_abels(P, starts, targets, tolerance, limit, planes, status):
    """See `steps.abels`."""
    steps.abels(
        flow_setting, flow_begin, flow_at, P, starts, targets, tolerance, limit, planes, status
    )


@part
def _image(kind, p, eqs, count, anchor, x, tolerance, node):
    returns.image(
        flow_setting, flow_begin, flow_at, kind, p, eqs, count, anchor, x, tolerance, node
    )


@kernel
def flow_image(kind, p, eqs, count, anchor, x, tolerance, node):
    """See `returns.image`."""
    _image(kind, p, eqs, count, anchor, x, tolerance, node)


@kernel
def flow_borders(kind, p, eqs, count, section, tolerance, out):
    """See `borders.borders`."""
    return borders.borders(
        flow_setting, flow_begin, flow_at, kind, p, eqs, count, section, tolerance, out
    )


_fixed_points = returns.fixed_points_of(_image)


@kernel
def flow_cycles(
    kind, p, eqs, count, anchor, interval, xs, guesses, tolerance, cycles, found, edges
):
    """See `fixed_points` in `returns`."""
    return _fixed_points(
        kind, p, eqs, count, anchor, interval, xs, guesses, tolerance, cycles, found, edges
    )


@kernel
def flow_fates(p, section, ends, sizes, eqs, plus, minus, lib, starts, tolerance, limit, out):
    """See `fate.fates`."""
    fate.fates(
        flow_setting,
        flow_begin,
        flow_at,
        p,
        section,
        ends,
        sizes,
        eqs,
        plus,
        minus,
        lib,
        starts,
        tolerance,
        limit,
        out,
    )


@kernel
def _body_at(G, T, dt, state):
    """The state at dt after the start of the step: one step of size dt."""
    start = motion.state_of(T[0])
    for i in range(STAGES):
        motion.store(state, start)
        for j in range(i):
            for k in range(motion.STATE):
                state[k] += dt * A[i, j] * T[motion.STAGE + j, k]
        motion.store(T[motion.STAGE + i], motion.slope(G, 0.0, motion.state_of(state)))
    for k in range(motion.STATE):
        change = 0.0
        for i in range(STAGES):
            change += B[i] * T[motion.STAGE + i, k]
        state[k] = T[0, k] + dt * change


@kernel
def _body_begin(G, state, tolerance, T, V):
    """Start a step at `state` and find its size, from that of the step before."""
    longest, new = motion.expanded(G, state, T, V), np.empty(motion.STATE)
    h = min(T[LAST, motion.STEP] if T[LAST, motion.STEP] > 0.0 else 0.1 * longest, longest)
    for _ in range(50):
        _body_at(G, T, h, new)
        doubt, error = 8.0 * DOUBT * (h / longest) ** 3, 0.0
        for k in range(motion.STATE):
            share = motion.size_of(state) if k < 3 else 1.0
            error = max(error, _flow_estimate(T, h, k, doubt) / share)
        factor = min(max(0.9 * (error / tolerance + 1e-30) ** -0.125, 0.2), 4.0)
        if error <= tolerance:
            break
        h *= factor
    # the stages pass through sums that cancel
    T[LAST, motion.STEP], T[LAST, motion.ERROR] = h * factor, error + 4e-16 * _WEIGHT * h / longest
    return h if math.isfinite(new[0] + new[1] + new[2]) else math.nan


@kernel
def body_trajectories(G, starts, times, tolerance, limit, floats, status):
    """See `kernels.body.motion.trajectories`."""
    motion.trajectories(_body_begin, _body_at, G, starts, times, tolerance, limit, floats, status)
