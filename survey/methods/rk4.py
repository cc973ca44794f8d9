"""The classical Runge-Kutta method, order 4, for comparison. Each step is two half steps, checked
by one full step.

Domain: any continuous z; thousands of steps for 1e-10. The error of the two half steps is estimated
as their difference from the full step divided by 2^4 - 1 (Richardson).

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.1 and
II.4.
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
    TRUNC_PHI,
    TRUNC_W,
    WEIGHT,
    W,
    series,
    values,
)
from survey.kernels.floquet import classical as floquet
from survey.kernels.hill.matrix import doubled, samples_only
from survey.kernels.jit import inline, kernel, part
from survey.kernels.lanes import chain, scatter
from survey.kernels.math.runge_kutta import classical

ORDER = 4
SERVES = ("body", "cylinder", "danby", "floquet", "hill")
COST = {
    "body": 3000.0,
    "cylinder": 3000.0,
    "danby": 30000.0,
    "floquet": 100.0,
    "hill": 13.0,
}  # time, relative to the default of each family
_ABOUT = "The classical Runge-Kutta method, order 4, each step two halves checked by a whole, for comparison: "
ABOUT = {
    "body": _ABOUT + "the six equations (1)-(6) in time.",
    "cylinder": _ABOUT + "phi' = w, w' = f w + g in time.",
    "danby": _ABOUT + "the four linear equations about L4 over half a period.",
    "floquet": _ABOUT + "x' = A(t) x.",
    "hill": _ABOUT + "y'' + z y = 0.",
}
FLOW_FINEST = 1e-13  # useful tolerance for flows on the cylinder
FLOW_WORK = 50  # steps, relative to the Taylor method
NODES = (0.0, 0.25, 0.5, 0.75, 1.0)
WIDTH = len(NODES) + 1


def hill_density(rtol):
    """Steps per radian of the fastest phase, and per distance to the nearest singularity of z, for
    accuracy rtol.
    """
    scale = max(rtol, 1e-13) ** (-1 / ORDER)
    return 0.4 * scale, 1.0 * scale


@inline
def _column(z0, z1, z2, h, y, v):
    """One classical step of y' = v, v' = -z y."""
    half = 0.5 * h
    y2, v2 = y + half * v, v - half * z0 * y
    y3, v3 = y + half * v2, v - half * z1 * y2
    y4, v4 = y + h * v3, v - h * z1 * y3
    sixth = h / 6.0
    return y + sixth * (v + 2.0 * (v2 + v3) + v4), v - sixth * (
        z0 * y + 2.0 * z1 * (y2 + y3) + z2 * y4
    )


@inline
def _matrix(z0, z1, z2, h):
    a, c = _column(z0, z1, z2, h, 1.0, 0.0)
    b, d = _column(z0, z1, z2, h, 0.0, 1.0)
    return a, b, c, d


@inline
def hill_step(f, c2, p, h):
    """P over two half steps, and its local error bounds."""
    base = p * p * c2
    z0 = f[0] + p * f[WIDTH + 0] + base
    z1 = f[1] + p * f[WIDTH + 1] + base
    z2 = f[2] + p * f[WIDTH + 2] + base
    z3 = f[3] + p * f[WIDTH + 3] + base
    z4 = f[4] + p * f[WIDTH + 4] + base
    size = f[5] + abs(p) * f[WIDTH + 5] + abs(base)
    half = 0.5 * h
    return doubled(
        _matrix(z0, z1, z2, half), _matrix(z2, z3, z4, half), _matrix(z0, z2, z4, h), ORDER, size, h
    )


@kernel
def hill_chain(samples, c2, h, p, order, starts, ends, out):
    chain(samples_only, hill_step, WIDTH, samples, c2, h, p, order, starts, ends, out)


@kernel
def hill_scatter(samples, c2, h, p, order, starts, out):
    scatter(samples_only, hill_step, WIDTH, samples, c2, h, p, order, starts, out)


floquet_factors = floquet.factors


def floquet_reach(rtol):
    """How far the norm of A times half a step may go for accuracy rtol."""
    return 0.5 * (10.0 * max(rtol, 1e-13)) ** (1 / (ORDER + 1))


@inline
def flow_setting(p, w, tolerance):
    """The step, kept along the whole solution: its fourth power follows the tolerance."""
    return (100.0 * tolerance) ** 0.25 / (p[BOUND_F] + math.sqrt(p[BOUND_DG]) + abs(w) + 1e-300)


@kernel
def _flow_classical(p, phi, w, h):
    """One classical step of phi' = w, w' = f w + g, and the integrals of f and g over it."""
    return classical(_flow_slope, p, (0.0, 0.0, 0.0), (phi, w, 0.0, 0.0), h)


@inline
def _flow_slope(p, t, state):
    f, g, _dg = values(p, state[0])
    return state[1], f * state[1] + g, f, g


@kernel
def flow_at(p, T, dt):
    """(phi, w, integral of f, integral of g) at dt after the start of the step: two half steps."""
    x, w, e, y = _flow_classical(p, T[0, PHI], T[0, W], 0.5 * dt)
    x, w, de, dy = _flow_classical(p, x, w, 0.5 * dt)
    return x, w, e + de, y + dy


@kernel
def flow_begin(p, phi, w, h, T):
    """Start a step; its error is that of two half steps, by Richardson, with a margin of 2."""
    series(p, phi, w, T, LOW)
    x1, w1, _e, _y = _flow_classical(p, phi, w, h)
    x2, w2, _e, _y = flow_at(p, T, h)
    T[LAST, TRUNC_PHI], T[LAST, TRUNC_W], T[LAST, WEIGHT] = (
        abs(x2 - x1) / 7.5,
        abs(w2 - w1) / 7.5,
        1.0,
    )
    return h


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
    """The state at dt after the start of the step: two half steps."""
    middle = classical(motion.slope, G, (0.0, 0.0, 0.0), motion.state_of(T[0]), 0.5 * dt)
    motion.store(state, classical(motion.slope, G, (0.0, 0.0, 0.0), middle, 0.5 * dt))


@kernel
def _body_begin(G, state, tolerance, T, V):
    """Start a step; its error is that of two half steps, by Richardson, with a margin of 2."""
    h = motion.expanded(G, state, T, V) * min(1.0, (100.0 * tolerance) ** 0.25)
    one, two, error = np.empty(motion.STATE), np.empty(motion.STATE), 0.0
    motion.store(one, classical(motion.slope, G, (0.0, 0.0, 0.0), motion.state_of(state), h))
    _body_at(G, T, h, two)
    for k in range(motion.STATE):
        error = max(error, abs(two[k] - one[k]) / (motion.size_of(state) if k < 3 else 1.0))
    T[LAST, motion.ERROR] = error / 7.5
    return h


@kernel
def body_trajectories(G, starts, times, tolerance, limit, floats, status):
    """See `kernels.body.motion.trajectories`."""
    motion.trajectories(_body_begin, _body_at, G, starts, times, tolerance, limit, floats, status)
