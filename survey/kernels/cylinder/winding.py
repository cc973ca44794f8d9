"""Turning points of a solution, counted to any time, also where it winds into a focus and w falls
below its bound.

About an attracting focus x' = w, w' = f w + g' x + r, |r| <= BOUND_F |x w| + BOUND_DDG x^2 / 2. With a = f/2, Omega =
sqrt(-g' - a^2) and y = (w - a x)/Omega, the angle obeys theta' = -Omega + e, |e| <= rho C, C = (BOUND_F (|a| + Omega) +
BOUND_DDG / 2)/Omega, and rho falls at least as exp(-|a| t/2) where rho C <= |a|/2: so for all time theta misses
its straight line by 2 rho C/|a| at most, and the zeros of w, half a turn apart, are counted without following them.
"""

import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.equilibria import (
    ANGLE,
    BAR,
    DG,
    EQUILIBRIUM_SIZE,
    FOCUS,
    KIND,
    MOST,
    NODE,
    STABLE,
    F,
    equilibria_inside,
    offset,
)
from survey.kernels.cylinder.equilibria import settled as node_settled
from survey.kernels.cylinder.flow import BOUND_DDG, BOUND_DG, BOUND_F, BOUND_G, reduced, table
from survey.kernels.cylinder.steps import (
    UNDETERMINED,
    bar,
    carried,
    expand,
    finite,
    later,
    rests,
    start_sign,
    wrapped,
)
from survey.kernels.jit import inline, kernel
from survey.kernels.math.roundoff import ROUNDOFF_UP

# of an end: no turning follows; angle, rate and their doubts
NEVER, START, RATE, DOUBT, DRIFT = range(5)
STRAIGHT = 1e-7  # rad: so near to its line the angle is kept, or nearer than the error bounds are


@kernel
def ends(p, eqs, count, phi, w, bar_phi, bar_w, end):
    """Is it certain how the solution turns from (phi, w) on? Then fill `end` with it."""
    for i in range(count):
        row = eqs[i]
        if not (row[STABLE] < 0.0 and (row[KIND] == NODE or row[KIND] == FOCUS)):
            continue
        x, _turns = offset(phi, row[ANGLE])
        slip = bar_phi + row[BAR]
        if row[KIND] == NODE:
            if abs(x) + abs(w) > 1e3 * (slip + bar_w) and node_settled(p, row[F], row[DG], x, w):
                end[NEVER] = 1.0
                return True
            continue
        a = 0.5 * row[F]
        square = -row[DG] - a * a
        doubt = 16.0 * ROUNDOFF_UP * p[BOUND_F] + p[BOUND_F] * row[BAR]
        doubt = 16.0 * ROUNDOFF_UP * p[BOUND_DG] + p[BOUND_DDG] * row[BAR] + abs(row[F]) * doubt
        if not square > 100.0 * doubt:
            continue
        omega = math.sqrt(square)
        y = (w - a * x) / omega
        rho = math.hypot(x, y)
        bend = rho * (p[BOUND_F] * (abs(a) + omega) + 0.5 * p[BOUND_DDG]) / omega
        blur = (slip + (bar_w + abs(a) * slip) / omega) / max(rho, 1e-300)
        off = 2.2 * bend / abs(a)
        if bend < 0.25 * abs(a) and blur < 0.1 and off <= max(STRAIGHT, blur):
            end[NEVER] = 0.0
            # w = 0 where tan theta = -a/Omega
            end[START], end[RATE] = math.atan2(y, x) - math.atan2(-a, omega), omega
            end[DOUBT] = off + 1.1 * blur + doubt / square + 8.0 * ROUNDOFF_UP
            end[DRIFT] = doubt / omega + 4.0 * ROUNDOFF_UP * omega
            return True
    return False


@kernel
def zeros(end, dt):
    """How often w changes sign within dt from where `end` was noted, or UNDETERMINED."""
    if end[NEVER] > 0.0:
        return 0
    doubt = (end[DOUBT] + end[DRIFT] * dt + 4.0 * ROUNDOFF_UP * end[RATE] * dt) / math.pi
    first, last = end[START] / math.pi, (end[START] - end[RATE] * dt) / math.pi
    doubt += 4.0 * ROUNDOFF_UP * abs(last)
    if math.floor(first - doubt) != math.floor(first + doubt) or math.floor(
        last - doubt
    ) != math.floor(last + doubt):
        return UNDETERMINED
    return int(math.floor(first) - math.floor(last))


@inline
def counts(setting, begin, at, p, phi0, w0, times, tolerance, limit, out):
    """Fill out[j] with the number of turning points before the ascending times[j] >= 0 where it is
    UNDETERMINED.
    """
    eqs, end, T = np.zeros((MOST, EQUILIBRIUM_SIZE)), np.zeros(5), table()
    count, _hidden = equilibria_inside(p, eqs)
    if p[BOUND_G] == 0.0 or rests(p, phi0, w0):
        out[: len(times)] = 0
        return
    how = setting(p, w0, tolerance)
    phi, turns = reduced(phi0)
    w, t, t_low, n, j, turned, unsure = w0, 0.0, 0.0, 0, 0, 0, 0
    slip = ROUNDOFF_UP * 4.0 * (turns != 0.0)
    saa, sab, sbb = slip * slip, 0.0, 0.0
    sign = start_sign(p, phi, w)
    while j < len(times) and sign != 0 and n < limit:
        h = expand(begin, p, phi, w, how, T)
        n += 1
        if not (h > 0.0 and math.isfinite(h)):
            return
        while j < len(times) and (times[j] - t) - t_low < h:
            dt = (times[j] - t) - t_low
            _x, v, _e, _y = at(p, T, dt)
            _a, _b, c = carried(p, T, dt, v, saa, sab, sbb)
            sure = abs(v) > bar(n, c) or (n == 1 and w0 == 0.0)
            if out[j] == UNDETERMINED and sure and unsure < 3:
                out[j] = turned + (n > 1 or w0 != 0.0) * (v * sign < 0.0)
            j += 1
        phi, w, _e, _y = at(p, T, h)
        saa, sab, sbb = carried(p, T, h, w, saa, sab, sbb)
        t, t_low = later(t, t_low, h)
        phi, _k = wrapped(phi)
        bar_phi, bar_w = bar(n, saa), bar(n, sbb)
        if not (bar_phi < 1e-3 and bar_w < 1e-3 * (1.0 + abs(w))):
            return
        if abs(w) <= bar_w:
            unsure += 1
            continue
        if unsure > 2:
            return
        if w * sign < 0.0:
            turned += 1
        sign, unsure = (1 if w > 0.0 else -1), 0
        if ends(p, eqs, count, phi, w, bar_phi, bar_w, end):
            for i in range(j, len(times)):
                more = zeros(end, (times[i] - t) - t_low)
                if out[i] == UNDETERMINED and more >= 0:
                    out[i] = turned + more
            return


@inline
def turnings(setting, begin, at, P, starts, times, tolerance, limit, out):
    """`counts` for each row of P; a row of times ends at its first infinity."""
    for i in range(len(P)):
        size = finite(times[i])
        counts(
            setting,
            begin,
            at,
            P[i],
            starts[i, rc.START_PHI],
            starts[i, rc.START_W],
            times[i, :size],
            tolerance,
            limit,
            out[i],
        )
