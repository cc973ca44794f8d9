"""Closed forms where they apply: g = 0 (50), w = mu F + n (61), b = 0 (elliptic functions). No
steps, cost free of t.

Domain: trajectory and abel; b = 0 and g = 0 exactly, (61) within 64 roundings (which go into the
bar); status `no_closed_form` elsewhere. Near multiple roots, where digits are lost,
`no_convergence`. Uniform rotation is b = g = 0.

Source: M. E. Lesina, Ya. V. Zinovyeva (2004), (50), (61)-(68), as corrected in
`scenes/gyrostat.md`.
"""

import math

import numpy as np

from survey.kernels.cylinder import closed, trigonometric, weierstrass
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.steps import (
    EQUILIBRIUM,
    NO_CONVERGENCE,
    OK,
    TRUST,
    TURNING,
    finite,
    row_of,
)
from survey.kernels.cylinder.weierstrass import BAR_W, BAR_X, COUNT, LANES, W, X
from survey.kernels.jit import inline, kernel
from survey.kernels.math.roundoff import ROUNDOFF_UP

ORDER = 0  # no steps
SERVES = ("cylinder",)
WHEN = {"question": ("trajectory", "abel")}
COST = {"cylinder": 0.2}  # time, relative to the default method
FLOW_FINEST = 1.0  # nothing to refine
FLOW_WORK = 1
_NO_FORM = 19  # as in the STATUS of scenes/gyrostat.py


def flow_trajectories(P, starts, times, tolerance, limit, planes, turnings, status):
    """See `steps.trajectories`; tolerance and limit have no meaning here. Only the forms that apply
    are compiled.
    """
    forms, curves = np.zeros(times.shape, np.int8), np.empty((len(P), 2))
    _sort(P, starts, times, forms, curves, planes, turnings, status)
    for form, solve in ((closed.LIBRATION, _elliptics), (closed.TRIGONOMETRIC, _trigonometrics)):
        indices = np.flatnonzero(forms == form)
        if indices.size > 0:
            solve(indices, P, starts, curves, times, planes, turnings)


@kernel
def _sort(P, starts, times, forms, curves, planes, turnings, status):
    """Fill `forms` (as times) with the closed form to evaluate there, curves with its mu and 1 - mu."""
    for i in range(len(P)):
        kind, curves[i, 0], curves[i, 1] = closed.applies(
            P[i], starts[i, rc.START_PHI], starts[i, rc.START_W]
        )
        status[i] = _NO_FORM if kind == closed.NONE else NO_CONVERGENCE
        for j in range(finite(times[i]) if kind != closed.NONE else 0):
            if times[i, j] != 0.0:
                forms[i, j] = kind
                continue
            _store(planes[:, i, j], starts[i, rc.START_PHI], 0.0, starts[i, rc.START_W], 0.0, 0.0)
            turnings[i, j] = 0


@kernel
def _elliptics(indices, P, starts, curves, times, planes, turnings):
    """b = 0."""
    T = weierstrass.lanes()
    _solve(
        weierstrass.enter, weierstrass.solve, T, indices, P, starts, curves, times, planes, turnings
    )


@kernel
def _trigonometrics(indices, P, starts, curves, times, planes, turnings):
    """g = 0 and (61)."""
    T = trigonometric.lanes()
    _solve(
        trigonometric.enter,
        trigonometric.solve,
        T,
        indices,
        P,
        starts,
        curves,
        times,
        planes,
        turnings,
    )


@inline
def _solve(enter, solve, T, indices, P, starts, curves, times, planes, turnings):
    """The solutions at `indices` of the flattened `times`, as many at once as there are lanes."""
    columns = times.shape[1]
    for first in range(0, len(indices), LANES):
        some = indices[first : first + LANES]
        for k in range(len(some)):
            i, j = some[k] // columns, some[k] % columns
            enter(
                T, k, P[i], starts[i, rc.START_PHI], starts[i, rc.START_W], times[i, j], curves[i]
            )
        solve(T)
        for k in range(len(some)):
            i, j = some[k] // columns, some[k] % columns
            if _store(
                planes[:, i, j], starts[i, rc.START_PHI], T[X, k], T[W, k], T[BAR_X, k], T[BAR_W, k]
            ):
                turnings[i, j] = int(T[COUNT, k])


@inline
def _store(out, phi0, x, w, bar_x, bar_w):
    """Store one solution at one time; False where the bars are too wide to be bounds."""
    if not (bar_x < TRUST and bar_w < TRUST * (1.0 + abs(w))):
        return False
    out[rc.PHI], out[rc.W], out[rc.PHI_BAR], out[rc.W_BAR] = (
        phi0 + x,
        w,
        bar_x + 2.0 * ROUNDOFF_UP * abs(phi0 + x),
        bar_w,
    )
    return True


@kernel
def flow_abels(P, starts, targets, tolerance, limit, planes, status):
    """See `steps.abels`; tolerance and limit have no meaning here."""
    data = closed.scratch()
    planes[:] = math.nan
    for i in range(len(P)):
        phi0, w0 = starts[i, rc.START_PHI], starts[i, rc.START_W]
        kind, side = closed.start(P[i], phi0, w0, data)
        own = row_of(targets, i)
        for j in range(finite(own)):
            out, x = planes[:, i, j], own[j] - phi0
            if kind == closed.NONE or kind == closed.LOST:
                status[i, j] = _NO_FORM if kind == closed.NONE else NO_CONVERGENCE
            elif x == 0.0:
                out[rc.VALUE], out[rc.TIME], out[rc.VALUE_BAR], out[rc.TIME_BAR], status[i, j] = (
                    w0,
                    0.0,
                    0.0,
                    0.0,
                    OK,
                )
            elif kind == closed.TRIGONOMETRIC:
                status[i, j] = _trigonometric(data, w0, x, out)
            else:
                status[i, j] = _elliptic(kind, side, data, phi0, x, out)


@kernel
def _trigonometric(data, w0, x, out):
    """w and t where phi0 + x is passed, on w = mu F + n."""
    if w0 == 0.0:
        return EQUILIBRIUM if data[closed.OTHER] == 0.0 else NO_CONVERGENCE
    t, bar_t = closed.trigonometric_reach(data, x)
    if t == math.inf:
        return EQUILIBRIUM if data[closed.OTHER] == 0.0 else NO_CONVERGENCE
    s = math.sin(0.5 * x)
    F, f = data[closed.F0], data[closed.SLOPE]
    w = w0 - 2.0 * s * (F * s - f * math.cos(0.5 * x))
    moved = closed.deviating(data, x, t, w)
    bar = closed.MARGIN * (
        2.0 * data[closed.NOISE] + moved + 4.0 * ROUNDOFF_UP * (w0 + abs(x) * math.hypot(F, f))
    )
    return _kept(out, w, t, bar, bar_t)


@kernel
def _kept(out, w, t, bar_w, bar_t):
    """OK and the values, or NO_CONVERGENCE where the bars are too wide to be bounds."""
    if not (bar_w < 0.1 * w and bar_w < TRUST * (1.0 + w) and bar_t < TRUST * (1.0 + t)):
        return NO_CONVERGENCE
    out[rc.VALUE], out[rc.TIME], out[rc.VALUE_BAR], out[rc.TIME_BAR] = w, t, bar_w, bar_t
    return OK


@kernel
def _elliptic(kind, side, data, phi0, x, out):
    """w and t where phi0 + x is passed, or the turning point before it, for b = 0."""
    if side < 0.0:  # starts at rest and goes away from the target
        out[rc.VALUE], out[rc.TIME], out[rc.VALUE_BAR], out[rc.TIME_BAR] = phi0, 0.0, 0.0, 0.0
        return TURNING
    if kind == closed.LIBRATION:
        edge = data[closed.BAR_RIGHT] + 4.0 * ROUNDOFF_UP * (abs(phi0) + abs(x))
        right = data[closed.RIGHT]
        if x >= right - edge:
            t, bar = closed.flight(data, math.pi, 0.0)
            if not bar < math.inf:
                return NO_CONVERGENCE
            out[rc.VALUE], out[rc.TIME], out[rc.VALUE_BAR] = (
                phi0 + right,
                t,
                edge + 4.0 * ROUNDOFF_UP * (abs(phi0) + right),
            )
            out[rc.TIME_BAR] = bar + 2.0 * ROUNDOFF_UP * t
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
    blur = 2.0 * ROUNDOFF_UP * (abs(phi0) + abs(x))
    return _kept(
        out,
        w,
        t,
        closed.MARGIN * (0.5 * (noise + abs(slope) * blur) / w + 2.0 * ROUNDOFF_UP * w),
        bar_t + blur / w,
    )
