"""Taylor series in t with variable steps and dense output, for flows on the cylinder: the default.

Order 20; the coefficients come from recurrences (`kernels/cylinder/flow.py`). Step size after A. Jorba and M. Zou, "A
software package for the numerical integration of ODEs by means of high-order Taylor methods", Experimental
Mathematics 14 (2005) 99-117. Domain: every parameter value; explicit, so steps shrink as 1/|b| on stiff systems.
"""

import math

from survey.kernels.cylinder import fate, lockstep, returns, steps, winding
from survey.kernels.cylinder.flow import LAST, PHI, TRUNC_PHI, TRUNC_W, E, W, Y, longest_step, series
from survey.kernels.cylinder.flow import ORDER as _ORDER
from survey.kernels.jit import inline, kernel

ORDER = 20
SERVES = ("cylinder",)
_FALL = 1.0 / 50.0  # by more, two terms further on, no series is trusted to fall
FLOW_FINEST = 1e-17  # useful truncation error of a step
FLOW_WORK = 1  # steps, relative to this method


@inline
def flow_setting(p, w, tolerance):
    """What steers the steps: the tolerance of one step."""
    return tolerance


@kernel
def flow_begin(p, phi, w, tolerance, T):
    """Expand at (phi, w); returns the step that keeps the last two terms below the tolerance."""
    series(p, phi, w, T, _ORDER)
    scale = 1.0 / (1.0 + abs(w))
    h = math.inf
    for n in range(_ORDER - 3, _ORDER + 1):
        # a last term that happens to vanish tells nothing, so those two before it are asked, less strictly
        share = 1.0 if n > _ORDER - 2 else _FALL
        term = share * max(abs(T[n, PHI]), scale * abs(T[n, W])) + 1e-300
        h = min(h, (tolerance / term) ** (1.0 / n))
    shorter = min(1.0, longest_step(p, w) / h)  # the last terms, and what follows them, at the step that is taken
    fourth = (shorter * shorter) ** 2
    error = tolerance * (fourth * fourth) ** 2 * shorter * shorter * shorter
    T[LAST, TRUNC_PHI], T[LAST, TRUNC_W] = error, error / scale
    return h


@kernel
def flow_at(p, T, dt):
    """(phi, w, integral of f, integral of g) at dt after the start of the step."""
    phi, w, e, y = T[_ORDER, PHI], T[_ORDER, W], T[_ORDER, E], T[_ORDER, Y]
    for n in range(_ORDER - 1, -1, -1):
        phi, w, e, y = phi * dt + T[n, PHI], w * dt + T[n, W], e * dt + T[n, E], y * dt + T[n, Y]
    return phi, w, e, y


@kernel
def flow_trajectories(P, starts, times, tolerance, limit, floats, turnings, status):
    """See `lockstep.trajectories`."""
    return lockstep.trajectories(P, starts, times, tolerance, limit, floats, turnings, status)


@kernel
def flow_turnings(P, starts, times, tolerance, limit, turnings):
    """See `winding.turnings`."""
    winding.turnings(flow_setting, flow_begin, flow_at, P, starts, times, tolerance, limit, turnings)


@kernel
def flow_abels(P, starts, targets, tolerance, limit, floats, status):
    """See `steps.abels`."""
    steps.abels(flow_setting, flow_begin, flow_at, P, starts, targets, tolerance, limit, floats, status)


@kernel
def flow_image(kind, p, eqs, count, place, x, tolerance, node):
    """See `returns.image`."""
    returns.image(flow_setting, flow_begin, flow_at, kind, p, eqs, count, place, x, tolerance, node)


@kernel
def flow_cycles(kind, p, eqs, count, place, interval, xs, tolerance, cycles, found, edges):
    """See `returns.fixed_points`."""
    return returns.fixed_points(flow_image, kind, p, eqs, count, place, interval, xs, tolerance, cycles, found, edges)


@kernel
def flow_fates(p, section, ends, sizes, eqs, plus, minus, lib, starts, tolerance, limit, out):
    """See `fate.fates`."""
    fate.fates(
        flow_setting, flow_begin, flow_at, p, section, ends, sizes, eqs, plus, minus, lib, starts, tolerance, limit, out
    )
