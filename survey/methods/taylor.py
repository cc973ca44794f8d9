"""Taylor series in t with variable steps and dense output, for flows on the cylinder: the default.

Order 20; the coefficients come from recurrences (`kernels/cylinder/flow.py`). Step size after A. Jorba and M. Zou, "A
software package for the numerical integration of ODEs by means of high-order Taylor methods", Experimental
Mathematics 14 (2005) 99-117. Domain: every parameter value; explicit, so steps shrink as 1/|b| on stiff systems.
"""

import math

import numpy as np

from survey import waiting
from survey.kernels.body import motion
from survey.kernels.cylinder import (
    basins,
    borders,
    connections,
    fate,
    gyrostat,
    lines,
    lockstep,
    lockstep_abel,
    lockstep_phi,
    lockstep_program,
    returns,
    winding,
)
from survey.kernels.cylinder.flow import (
    LAST,
    PHI,
    TRUNC_PHI,
    TRUNC_W,
    W,
    inside,
    longest_step,
    series,
)
from survey.kernels.cylinder.flow import ORDER as _ORDER
from survey.kernels.cylinder.program import COLUMNS
from survey.kernels.cylinder.records import EXACT_START, STATE
from survey.kernels.jit import inline, kernel, part
from survey.kernels.math.roots import exp2, log2

ORDER = 20
SERVES = ("abel", "body", "cylinder")
_ABOUT = "Taylor series in time, order 20, variable steps: "
ABOUT = {
    "abel": _ABOUT + "phi' = w, w' = f w + g, from the record of the functions; the default.",
    "body": _ABOUT + "the six equations (1)-(6); the default.",
    "cylinder": _ABOUT + "phi' = w, w' = f w + g; the default.",
}
_FALL = 1.0 / 50.0  # by more, two terms further on, no series is trusted to fall
FLOW_FINEST = 1e-17  # useful truncation error of a step
FLOW_WORK = 1  # steps, relative to this method
FLOW_BOUNDS = FLOW_UNCOUNTED = True


@inline
def flow_setting(p, w, tolerance):
    """What controls the steps: the tolerance of one step."""
    return tolerance


@part
def flow_begin(p, phi, w, tolerance, T):
    """Expand at (phi, w); returns the step that keeps the last two terms below the tolerance, 0 where they overflow."""
    series(p, phi, w, T, _ORDER)
    scale = 1.0 / (1.0 + abs(w))
    allowed, longest = log2(tolerance), math.inf
    for n in range(_ORDER - 3, _ORDER + 1):
        # a last term that happens to vanish proves nothing, so the two before it count too, less
        # strictly
        share = 1.0 if n > _ORDER - 2 else _FALL
        term = share * max(abs(T[n, PHI]), scale * abs(T[n, W])) + 1e-300
        if not term < 1e300:
            return 0.0
        longest = min(longest, (allowed - log2(term)) / n)
    h = 0.999 * exp2(longest)  # rounded down
    # the last terms, and what follows them, at the step that is taken
    shorter = min(1.0, longest_step(p, w) / h)
    fourth = (shorter * shorter) ** 2
    error = tolerance * (fourth * fourth) ** 2 * shorter * shorter * shorter
    T[LAST, TRUNC_PHI], T[LAST, TRUNC_W] = error, error / scale
    return h


@kernel
def flow_at(p, T, dt):
    """(phi, w, integral of f, integral of g) at dt after the start of the step."""
    return inside(T, dt)


def flow_trajectories(P, starts, times, tolerance, limit, planes, turnings, status):
    """See `lockstep.trajectories`, and for programs `lockstep_program.trajectories`: each is compiled
    when it is needed.
    """
    rest = starts, times, tolerance, limit, planes, turnings, status
    if P.shape[1] == COLUMNS:
        return _in_lockstep(P, *rest)
    leads = lockstep_program.grouped(P)
    waiting.wait("trajectories")
    for lead in np.unique(leads):
        lockstep_program.trajectories(P, leads, lead, *rest)
    return None


def flow_trajectories_ahead(own):
    """Compile what `flow_trajectories` waits for, of `own` functions: what else these need takes half as long."""
    if own:
        P, none = np.empty((0, COLUMNS + 1)), np.empty((0, EXACT_START))
        planes, lead = np.empty((STATE, 0, 2)), np.zeros(1, np.int64)
        turnings, ends = np.empty((0, 2), np.int64), np.empty(0, np.int64)
        rest = 0.0, 0, planes, turnings, ends
        lockstep_program.trajectories(P, lead, lead[0], none, none, *rest)


@kernel
def _in_lockstep(P, starts, times, tolerance, limit, planes, turnings, status):
    return lockstep.trajectories(P, starts, times, tolerance, limit, planes, turnings, status)


@kernel
def flow_turnings(P, starts, times, tolerance, limit, turnings):
    """See `winding.turnings`."""
    winding.turnings(
        flow_setting, flow_begin, flow_at, P, starts, times, tolerance, limit, turnings
    )


def flow_abels(P, starts, targets, tolerance, limit, planes, status):
    """See `_abels`."""
    _abels(P, starts, targets, tolerance, limit, planes, status, True)


def flow_abels_untimed(P, starts, targets, tolerance, limit, planes, status):
    """See `_abels`."""
    _abels(P, starts, targets, tolerance, limit, planes, status, False)


def _abels(P, starts, targets, tolerance, limit, planes, status, timed):
    """See `lockstep_phi.abels` and `lockstep_abel.abels`, and for programs `abels` and
    `abels_near` of `lockstep_program`.
    """
    ahead = np.zeros((len(P), lockstep_phi.STATE))
    # the first of both reads a block beyond the last
    far = np.full((len(targets), targets.shape[1] + lockstep_phi.BLOCK), np.inf)
    far[:, : targets.shape[1]] = targets
    if P.shape[1] != COLUMNS:
        leads, rest = lockstep_program.grouped(P), (tolerance, limit, ahead, planes, status)
        for lead in np.unique(leads):
            lockstep_program.abels(P, leads, lead, starts, far, *rest, timed)
            waiting.wait("near")
            lockstep_program.abels_near(P, leads, lead, starts, targets, *rest)
        return
    # compile the longer one, by a call on nothing, while that process compiles the other
    if waiting.other_compiler:
        _abels_in_time(
            P[:0], starts[:0], targets[:0], tolerance, limit, ahead[:0], planes[:, :0], status[:0]
        )
        waiting.wait("in angle")
    _abels_in_angle(P, starts, far, tolerance, limit, ahead, planes, status, timed)
    _abels_in_time(P, starts, targets, tolerance, limit, ahead, planes, status)


def flow_abels_ahead(own):
    """Compile what `flow_abels` waits for: of `own` functions, or of the gyrostat."""
    P, none = np.empty((0, COLUMNS + own)), np.empty((0, EXACT_START))
    P.flags.writeable = own
    planes, status = np.empty((STATE, 0, 2)), np.empty((0, 2), np.int8)
    ahead = np.empty((0, lockstep_phi.STATE))
    if own:
        lead = np.zeros(1, np.int64)
        lockstep_program.abels_near(P, lead, lead[0], none, none, 0.0, 0, ahead, planes, status)
        return
    _abels_in_angle(P, none, none, 0.0, 0, ahead, planes, status, True)


@kernel
def _abels_in_angle(P, starts, targets, tolerance, limit, ahead, planes, status, timed):
    lockstep_phi.abels(P, starts, targets, tolerance, limit, ahead, planes, status, timed)


@kernel
def _abels_in_time(P, starts, targets, tolerance, limit, ahead, planes, status):
    lockstep_abel.abels(P, starts, targets, tolerance, limit, ahead, planes, status)


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
def flow_line(p, start, window, eqs, count, section, kind, tolerance, out):
    """See `lines.line`."""
    return lines.line(
        flow_setting,
        flow_begin,
        flow_at,
        p,
        start,
        window,
        eqs,
        count,
        section,
        kind,
        tolerance,
        out,
    )


@kernel
def flow_pieces(p, start, edges, falls, eqs, count, kind, cell, top, scale, tolerance, most, out):
    """See `basins.pieces`."""
    return basins.pieces(flow_setting, flow_begin, flow_at, p, start, edges, falls, eqs, count, kind, cell, top, scale,
                         tolerance, most, out)  # fmt: skip


@kernel
def flow_connections(P, wanted, tolerance, cut, out):
    """See `connections.connections`."""
    connections.connections(flow_setting, flow_begin, flow_at, P, wanted, tolerance, cut, out)


@kernel
def _body_at(G, T, dt, state):
    gyrostat.at(T, dt, state)


@kernel
def body_trajectories(G, starts, times, tolerance, limit, floats, status):
    """See `kernels.body.motion.trajectories`."""
    motion.trajectories(
        gyrostat.begin, _body_at, G, starts, times, tolerance, limit, floats, status
    )
