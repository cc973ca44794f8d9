"""The fate of an initial state: followed event by event until the monotone return maps decide it.

Every step ends at the next turning point (w = 0) or passage of the section; there the error ellipse
is projected along the flow, since an error along an orbit does not change its fate. Nothing is
decided by a limit of steps.
"""

import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.creeping import (
    PASSAGE,
    after_passage,
    crept,
    narrowed,
    trapped,
    turnings_ahead,
)
from survey.kernels.cylinder.equilibria import (
    ANGLE,
    BAR,
    DG,
    FOCUS,
    KIND,
    NODE,
    STABLE,
    F,
    captured,
    offset,
    resting,
    settled,
)
from survey.kernels.cylinder.flow import PHI, TWO_PI, reduced, table, values
from survey.kernels.cylinder.returns import (
    ABOVE,
    BELOW,
    CYCLE_BAR,
    CYCLE_CLASS,
    CYCLE_X,
    INTERVAL,
    between,
)
from survey.kernels.cylinder.steps import (
    NO_CONVERGENCE,
    OK,
    SEPARATRIX,
    STEP_LIMIT,
    bar,
    carried,
    clean_turning,
    expand,
    passage,
    start_sign,
    time_of_turning,
    wrapped,
)
from survey.kernels.jit import inline, kernel, splice
from survey.kernels.math.roundoff import ROUNDOFF_UP

UNDECIDED, EQUILIBRIUM, SADDLE, ROTATION_PLUS, ROTATION_MINUS, LIBRATION = -1, 0, 1, 2, 3, 4
SPIN_UP_PLUS, SPIN_UP_MINUS, PERIODIC_ROTATION, PERIODIC_LIBRATION, EQUILIBRIUM_START = (
    5,
    6,
    7,
    8,
    9,
)
INFINITE, UNDETERMINED, NO_TURNS = -1, -2, -(2**31)
# LIMIT of an undecided fate whose cycles are not known: the table that would decide it.
NEEDS_PLUS, NEEDS_MINUS, NEEDS_LIBRATIONS = -2, -3, -4
# sizes of the tables that decide: rows of the equilibria and of the cycles of each kind; then the
# stratum, and 1 where weak foci attract
EQUILIBRIA, ROTATIONS_PLUS, ROTATIONS_MINUS, LIBRATIONS, STRATUM, ATTRACTING = range(6)
SIZES = 6
NOT_KNOWN = -1  # instead of the number of rows of a table of cycles
# steps that a motion without its cycles is followed, in case an equilibrium captures it
PATIENT = 500
TRUST = 1e-4
GENERIC, REVERSIBLE = 0, 3  # strata that are followed; REVERSIBLE is I2, K = L = 0


@inline
def cycle_at(cycles, size, x, error):
    """(index of the cycle that x lies on within the bars, or -1; number of cycles below x)."""
    below = 0
    for i in range(size):
        if abs(x - cycles[i, CYCLE_X]) <= error + cycles[i, CYCLE_BAR]:
            return i, below
        if cycles[i, CYCLE_X] < x:
            below = i + 1
    return -1, below


@inline
def attracts(cycle):
    """Does the cycle certainly attract on both sides?"""
    return cycle[CYCLE_CLASS] >= 0.0 and cycle[BELOW] > 0.0 and cycle[ABOVE] < 0.0


@kernel
def rotation_decides(cycles, size, end, w, error, before, before_error):
    """(decided, index of the cycle or -1 for spin-up) at a passage with |w|; before = |w| one turn ago or -1.

    decided: 1 yes, 0 not yet, -1 the error bound leaves it open.
    """
    on, below = cycle_at(cycles, size, w, error)
    if on >= 0:
        return (1, on) if attracts(cycles[on]) else (-1, -1)
    if below == size and size > 0:
        up = end > 0.0
    elif below > 0:
        up = cycles[below - 1, ABOVE] > 0.0
    elif before < 0.0 or abs(w - before) <= error + before_error:
        return 0, -1
    else:
        up = w > before
    if up and below == size:
        return (1, -1) if end > 0.0 else (0, -1)
    if not up and below == 0:
        return 0, -1
    reached = below if up else below - 1
    if cycles[reached, CYCLE_CLASS] < 0.0 or (
        cycles[reached, BELOW] < 0.0 if up else cycles[reached, ABOVE] > 0.0
    ):
        return -1, -1
    return 1, reached


@kernel
def libration_decides(cycles, size, interval, inside, x, error, before, before_error):
    """(decided, index of the cycle, or -1 for what lies inside) from two right turning points x and
    `before`.
    """
    if abs(x - before) <= error + before_error:
        for i in range(size):
            if (
                cycles[i, INTERVAL] == interval
                and abs(x - cycles[i, CYCLE_X]) <= error + cycles[i, CYCLE_BAR]
            ):
                return (1, i) if attracts(cycles[i]) else (-1, -1)
        return 0, -1
    inward = x < before
    best = -1
    for i in range(size):
        row = cycles[i]
        if row[INTERVAL] != interval or abs(row[CYCLE_CLASS]) != inside:
            continue
        if abs(x - row[CYCLE_X]) <= error + row[CYCLE_BAR]:
            return (1, i) if attracts(row) else (-1, -1)
        if inward and row[CYCLE_X] < before and (best < 0 or row[CYCLE_X] > cycles[best, CYCLE_X]):
            best = i
        if (
            not inward
            and row[CYCLE_X] > before
            and (best < 0 or row[CYCLE_X] < cycles[best, CYCLE_X])
        ):
            best = i
    if best < 0:
        return (1, -1) if inward else (0, -1)
    row = cycles[best]
    beyond = row[CYCLE_X] > x if inward else row[CYCLE_X] < x
    wrong = row[ABOVE] > 0.0 if inward else row[BELOW] < 0.0
    if beyond or wrong or row[CYCLE_CLASS] < 0.0:
        return -1, -1
    return 1, best


@kernel
def interval_of(eqs, count, x):
    """The equilibrium next below the angle x (any real), and x brought to the turn that starts there."""
    best, least = 0, 1e9
    for i in range(count):
        gap = x - eqs[i, ANGLE]
        gap -= math.floor(gap / TWO_PI) * TWO_PI
        if gap < least:
            best, least = i, gap
    return best, eqs[best, ANGLE] + least


@kernel
def section_ahead(phi, w, section, spacing):
    """The next section (section + a multiple of spacing) in the direction of w, strictly ahead of phi."""
    k = (phi - section) / spacing
    if w > 0.0:
        target = section + (math.floor(k + 1e-12) + 1.0) * spacing
    else:
        target = section + (math.ceil(k - 1e-12) - 1.0) * spacing
    return target


@inline
def fate(
    setting, begin, at, p, section, ends, sizes, eqs, plus, minus, lib, start, tolerance, limit, out
):
    """Fill out (VERDICT to STATUS of `records`) for `start` (START_PHI to START_W_BAR).

    LIMIT is a row of eqs (verdicts 0, 9), of plus or minus (2, 3) or of lib (4).
    sizes: EQUILIBRIA to ATTRACTING. Where a table of cycles is NOT_KNOWN, equilibria alone decide.
    """
    count = sizes[EQUILIBRIA]
    n_plus = sizes[ROTATIONS_PLUS]
    n_minus = sizes[ROTATIONS_MINUS]
    n_lib = sizes[LIBRATIONS]
    stratum = sizes[STRATUM]
    weak = sizes[ATTRACTING] > 0
    out[rc.VERDICT], out[rc.LIMIT] = UNDECIDED, -1
    out[rc.TURNINGS], out[rc.NET_TURNS], out[rc.STATUS] = UNDETERMINED, NO_TURNS, OK
    phi0, w0 = start[rc.START_PHI], start[rc.START_W]
    phi, turns = reduced(phi0)
    w, slip = w0, start[rc.START_PHI_BAR] + 4.0 * ROUNDOFF_UP * (turns != 0.0)
    sign = start_sign(p, phi, w)
    if w == 0.0:
        row = resting(p, eqs, count, phi0)
        if row >= 0:
            out[rc.VERDICT], out[rc.LIMIT] = EQUILIBRIUM_START, row
            out[rc.TURNINGS], out[rc.NET_TURNS] = 0, offset(phi, eqs[row, ANGLE])[1]
            return
        if sign == 0:  # beside an equilibrium, within rounding
            row = captured(eqs, count, phi, w, slip + 16.0 * ROUNDOFF_UP)
            if row < 0:
                out[rc.STATUS] = SEPARATRIX
                return
            out[rc.VERDICT], out[rc.LIMIT] = EQUILIBRIUM, row
            out[rc.NET_TURNS] = turns + offset(phi, eqs[row, ANGLE])[1]
            out[rc.TURNINGS] = INFINITE if eqs[row, KIND] == FOCUS else UNDETERMINED
            return
    T, far, slow = table(), np.empty(PASSAGE), False
    how = setting(p, w0, tolerance)
    saa = slip * slip
    sab = 0.0
    sbb = start[rc.START_W_BAR] * start[rc.START_W_BAR]
    n = 0
    turnings = 0
    before, before_bar = -1.0, 0.0  # last passage of the section without a turning since
    # last turning points, unwrapped from `turns` = base
    right, right_bar, left = math.nan, 0.0, math.nan
    spacing = TWO_PI if stratum == GENERIC else math.pi
    axis = math.nan
    held, target = -1, section_ahead(phi, float(sign), section, spacing)
    while n < limit:
        h = expand(begin, p, phi, w, how, T)
        n += 1
        x1, w1, _e, _y = at(p, T, h)
        if not (h > 0.0 and math.isfinite(w1)):
            out[rc.STATUS] = NO_CONVERGENCE
            return
        turned = w1 * sign <= 0.0
        if turned:
            h = time_of_turning(at, p, T, h)
            x1, w1, _e, _y = at(p, T, h)
        passed = (x1 - target) * sign >= 0.0
        if passed:
            turned = False
            h = passage(at, p, T, target, x1 > T[0, PHI], h)
            x1, w1, _e, _y = at(p, T, h)
        saa, sab, sbb = carried(p, T, h, w1, saa, sab, sbb)
        phi, w = (target if passed else x1), (0.0 if turned else w1)
        f, g, _dg = values(p, phi)
        slow = slow and not turned
        if slow:
            slow, saa, sab, sbb = narrowed(f, g, w, saa, sab, sbb)
        # the initial phi and w err as those of a step do
        bar_phi, bar_w = bar(n + 1, saa), bar(n + 1, sbb)
        if not (bar_phi < TRUST and bar_w < TRUST * (1.0 + abs(w))):
            out[rc.STATUS] = SEPARATRIX
            return
        if turned:
            if not clean_turning(p, phi, bar_phi, bar_w):
                out[rc.STATUS] = SEPARATRIX
                return
            turnings += 1
            sbb, sab, before = 0.0, 0.0, -1.0
            unwrapped = phi + turns * TWO_PI
            sign = -sign
            target = section_ahead(phi, float(sign), section, spacing)
            if sign > 0:
                left = unwrapped
            else:
                row, at_home = interval_of(eqs, count, phi)
                shift = at_home - phi
                same = not math.isnan(right) and not math.isnan(left) and stratum == GENERIC
                same = (
                    same and between(eqs, count, min(right, unwrapped), max(right, unwrapped)) == 0
                )
                if same and n_lib == NOT_KNOWN:
                    out[rc.LIMIT] = NEEDS_LIBRATIONS
                    if n > PATIENT:
                        return
                elif same:
                    inside = between(eqs, count, left, unwrapped)
                    decided, which = libration_decides(lib, n_lib, row, inside, at_home, bar_phi,
                                                       right + (at_home - unwrapped), right_bar)  # fmt: skip
                    if decided < 0:
                        out[rc.STATUS] = SEPARATRIX
                        return
                    if decided > 0 and which >= 0:
                        out[rc.VERDICT], out[rc.LIMIT], out[rc.TURNINGS] = (
                            LIBRATION,
                            which,
                            INFINITE,
                        )
                        out[rc.NET_TURNS] = turns - round(shift / TWO_PI)
                        return
                    focus = eqs[row, KIND] == FOCUS and (eqs[row, STABLE] < 0.0 or weak)
                    if decided > 0 and inside == 1 and focus:
                        out[rc.VERDICT], out[rc.LIMIT], out[rc.TURNINGS] = (
                            EQUILIBRIUM,
                            row,
                            INFINITE,
                        )
                        out[rc.NET_TURNS] = turns - round(shift / TWO_PI)
                        return
                right, right_bar, left = unwrapped, bar_phi, math.nan
        elif passed:
            slope = f + g / w
            own = bar(n + 1, max(sbb - 2.0 * slope * sab + slope * slope * saa, 0.0))
            if not own < 0.1 * abs(w):
                out[rc.STATUS] = SEPARATRIX
                return
            saa, sab, sbb = 0.0, 0.0, max(sbb - 2.0 * slope * sab + slope * slope * saa, 0.0)
            target += sign * spacing
            if stratum != GENERIC:
                here = phi + turns * TWO_PI
                if not math.isnan(axis):
                    away = round((here - axis) / math.pi)
                    rotating = away % 2 != 0
                    out[rc.VERDICT] = PERIODIC_ROTATION if rotating else PERIODIC_LIBRATION
                    out[rc.TURNINGS], out[rc.NET_TURNS] = (
                        (0, NO_TURNS) if rotating else (INFINITE, 0)
                    )
                    return
                axis = here
            else:
                cycles, size, end = (
                    (plus, n_plus, ends[0]) if sign > 0 else (minus, n_minus, ends[1])
                )
                decided, which = 0, -1
                if size == NOT_KNOWN:
                    out[rc.LIMIT] = NEEDS_PLUS if sign > 0 else NEEDS_MINUS
                    rising = before > 0.0 and abs(w) - before > own + before_bar
                    if rising:  # no equilibrium will capture it
                        out[rc.RISING_FROM] = abs(w)
                    if rising or n > PATIENT:
                        return
                else:
                    decided, which = rotation_decides(
                        cycles, size, end, abs(w), own, before, before_bar
                    )
                if decided < 0:
                    out[rc.STATUS] = SEPARATRIX
                    return
                if decided > 0:
                    cycle, spin = (
                        (ROTATION_PLUS, SPIN_UP_PLUS)
                        if sign > 0
                        else (ROTATION_MINUS, SPIN_UP_MINUS)
                    )
                    out[rc.VERDICT], out[rc.LIMIT], out[rc.TURNINGS] = (
                        (cycle if which >= 0 else spin),
                        which,
                        turnings,
                    )
                    return
                before, before_bar = abs(w), own
        elif abs(w) <= 2.0 * bar_w and n > 1 and held < 0:
            out[rc.STATUS] = SEPARATRIX
            return
        phi, k = wrapped(phi)
        target -= k * TWO_PI
        turns += k
        if held < 0:
            held = captured(eqs, count, phi, w, bar_phi + bar_w)
        if held < 0 and n % 4 == 0:
            held = trapped(p, eqs, count, phi, w, bar_phi + bar_w, True)
        if held >= 0:
            x, k = offset(phi, eqs[held, ANGLE])
            out[rc.VERDICT], out[rc.LIMIT], out[rc.NET_TURNS] = EQUILIBRIUM, held, turns + k
            if eqs[held, KIND] != NODE:
                out[rc.TURNINGS] = INFINITE
                return
            if settled(p, eqs[held, F], eqs[held, DG], x, w):
                out[rc.TURNINGS] = turnings
                return
            more = turnings_ahead(p, eqs, count, held, phi, w, bar_phi + bar_w)
            if more >= 0:
                out[rc.TURNINGS] = turnings + more
                return
            if abs(x) + abs(w) < 1e3 * (bar_phi + bar_w + eqs[held, BAR]):
                return
        elif n % 4 == 0 and crept(
            p, eqs, count, phi, w, bar_phi, bar_w, True, abs(target - phi), far
        ):
            phi, w, _t, _e, sbb, _doubt = after_passage(far, n, 0.0, 0.0, 0.0)
            saa, sab, slow = 0.0, 0.0, True
    out[rc.STATUS] = STEP_LIMIT if held < 0 else OK


@splice
def fates(
    setting,
    begin,
    at,
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
):
    """`fate` for each row of starts."""
    for i in range(len(starts)):
        fate(
            setting,
            begin,
            at,
            p,
            section,
            ends,
            sizes,
            eqs,
            plus,
            minus,
            lib,
            starts[i],
            tolerance,
            limit,
            out[i],
        )
        if out[i, rc.VERDICT] != UNDECIDED:
            out[i, rc.STATUS] = OK
