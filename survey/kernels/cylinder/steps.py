"""Steps along a solution, which carry their error: its values at given times, and at given angles
(Abel equation (57)).

A method gives three functions: `setting` (what controls its steps), `begin` (start a step: its
size, its truncation error noted in T) and `at` (the solution inside the step). The rest is common.

The error of (phi, w) after n steps is, to first order, the sum of J_nk delta_k over the steps, |delta_k| <= d_k
componentwise. S <- J S J^T + diag(d^2) holds the sum of squares, and by Cauchy and Schwarz |error_i| <=
sqrt(2 n S_ii), for any correlation of the delta_k: an error of the initial phi is one term more, but of the last step
only delta_i counts. Steps never depend on the requested times or angles.
"""

import math

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.equilibria import settled
from survey.kernels.cylinder.flow import (
    BOUND_DDG,
    BOUND_DG,
    BOUND_F,
    BOUND_G,
    C23,
    LAST,
    PHI,
    S2,
    TRUNC_PHI,
    TRUNC_W,
    TWO_PI,
    TWO_PI_LOW,
    WEIGHT,
    W,
    bound_start,
    jacobian,
    longest_step,
    on_circle,
    reduced,
    table,
    values,
    variation,
)
from survey.kernels.cylinder.program import RADIUS
from survey.kernels.jit import inline, part, splice
from survey.kernels.math.newton import bracketed
from survey.kernels.math.roundoff import ROUNDOFF_UP

OK, OVERFLOW, NO_CONVERGENCE, STEP_LIMIT = 0, 2, 3, 4  # as in survey/status.py
TURNING, EQUILIBRIUM, SEPARATRIX = 16, 17, 18  # as in the STATUS of scenes/gyrostat.py
# error bounds above this share of the scale of the system no longer hold to first order
TRUST = 0.02
CANCELLED = 2e-15  # rounding of sums of squares, relative to their largest terms
UNDETERMINED = -2  # a count that the error bound leaves open


@part
def local_error(p, T, w, dt):
    """Error bars (phi, w) that one step adds: truncation as the method notes it, and rounding.

    The slope w' of each stage is rounded by 4 roundoffs of the rate, and by |dw'/dphi| ulp(phi)/2 since phi is rounded
    there. Stage i has a share b_i in w, and b_i (1 - c_i) in phi, as simplifying assumption D(1) has it: so signed sums
    of b_i a_ij count, and the weight is that of the b_i.
    """
    weight = T[LAST, WEIGHT]
    many, phi_in_step = max(1.0, weight), abs(T[0, PHI]) + dt * abs(w)
    rate = many * (p[BOUND_F] * abs(w) + p[BOUND_G])
    rate += 0.25 * weight * (p[BOUND_F] * abs(w) + p[BOUND_DG]) * phi_in_step
    size = 4.0 if on_circle(p) else max(4.0, 2.0 * phi_in_step)
    phi = T[LAST, TRUNC_PHI] + ROUNDOFF_UP * (size + 3.0 * dt * (many * abs(w) + dt * rate))
    return phi, T[LAST, TRUNC_W] + ROUNDOFF_UP * (1.5 * abs(w) + 4.0 * dt * rate)


@part
def carried(p, T, dt, w, saa, sab, sbb):
    """The error ellipse S after dt of the current step."""
    a, b, c, d = jacobian(T, dt)
    e, f = local_error(p, T, w, dt)
    wide, tall = a * a * saa + b * b * sbb, c * c * saa + d * d * sbb
    return (  # as at a turning point beside a saddle, terms of opposite sign may leave their rounding alone
        max(wide + 2.0 * a * b * sab, 0.0) + CANCELLED * wide + e * e,
        a * c * saa + (a * d + b * c) * sab + b * d * sbb,
        max(tall + 2.0 * c * d * sab, 0.0) + CANCELLED * tall + f * f,
    )


@inline
def bar(n, square):
    """Error bar from the sum of squares of n steps."""
    return 1.01 * math.sqrt(2.0 * n * square)


@inline
def expand(begin, p, phi, w, how, T):
    """Start a step at (phi, w): the method's part and the variational equation; returns the step's size."""
    h = begin(p, phi, w, how, T)
    variation(p, T)
    return min(h, longest_step(p, w))


@inline
def later(t, t_low, h):
    """The time t + t_low after a step h, summed with the error of each addition."""
    high = t + h
    return high, t_low + (h - (high - t))


@inline
def wrapped(phi):
    """phi, at most a turn outside [-pi, pi], brought back to it, and the turns taken out of it."""
    if not abs(phi) > math.pi:
        return phi, 0.0
    k = 1.0 if phi > 0.0 else -1.0
    return (phi - k * TWO_PI) - k * TWO_PI_LOW, k


@inline
def unturned(target, turns):
    """The unwrapped angle `target`, less the turns taken out of the current one."""
    return (target - turns * TWO_PI) - turns * TWO_PI_LOW


@inline
def trusted(saa, sbb, w):
    """Is the error ellipse so small that it may be carried on to first order?"""
    return saa < TRUST and sbb < (1.0 + abs(w)) ** 2


@inline
def trajectory(setting, begin, at, p, phi0, w0, times, tolerance, limit, floats, turnings):
    """Fill floats[j] (PHI to W_BAR) and turnings[j] at the ascending times[j] >= 0; returns a status."""
    T = table()
    bound_start(p, phi0, w0)
    how = setting(p, w0, tolerance)
    phi, turns = reduced(phi0) if on_circle(p) else (phi0, 0.0)
    w, t, t_low, n = w0, 0.0, 0.0, 0
    slip = ROUNDOFF_UP * 4.0 * (turns != 0.0)
    saa, sab, sbb = slip * slip, 0.0, 0.0
    sign, unsure, count = start_sign(p, phi, w), 0, 0
    j, size = 0, len(times)
    while j < size:
        if n >= limit:
            return STEP_LIMIT
        h = expand(begin, p, phi, w, how, T)
        n += 1
        if not (h > 0.0 and math.isfinite(h)):
            return OVERFLOW
        while j < size and (times[j] - t) - t_low < h:
            dt = (times[j] - t) - t_low
            x, v, _e, _y = at(p, T, dt)
            a, _b, c = carried(p, T, dt, v, saa, sab, sbb)
            bar_phi, bar_w = bar(n, a), bar(n, c)
            floats[j, rc.PHI], floats[j, rc.W] = x + turns * TWO_PI, v
            floats[j, rc.PHI_BAR], floats[j, rc.W_BAR] = (
                bar_phi + 3e-16 * abs(turns) * TWO_PI,
                bar_w,
            )
            from_rest = n == 1 and w0 == 0.0  # then w is 0 at the start and nowhere else
            sure = unsure < 3 and count >= 0 and (abs(v) > bar_w or from_rest)
            turnings[j] = count + (v * sign < 0.0 and not from_rest) if sure else UNDETERMINED
            if not (bar_phi < TRUST and bar_w < TRUST * (1.0 + abs(v))):
                floats[j, rc.PHI] = floats[j, rc.W] = floats[j, rc.PHI_BAR] = floats[
                    j, rc.W_BAR
                ] = math.nan
                turnings[j] = UNDETERMINED
                return NO_CONVERGENCE
            j += 1
        if j == size:
            break
        x, v, _e, _y = at(p, T, h)
        saa, sab, sbb = carried(p, T, h, v, saa, sab, sbb)
        phi, w = x, v
        t, t_low = later(t, t_low, h)
        if on_circle(p):
            phi, k = wrapped(phi)
            turns += k
        if not trusted(saa, sbb, w):
            return NO_CONVERGENCE if math.isfinite(w) else OVERFLOW
        if abs(w) <= bar(n, sbb):
            unsure += 1
        else:
            if unsure > 2:
                count = UNDETERMINED - limit  # below zero permanently
            if w * sign < 0.0:
                count += 1
            sign, unsure = (1 if w > 0.0 else -1), 0
    return OK


@splice
def trajectories(setting, begin, at, P, starts, times, tolerance, limit, planes, turnings, status):
    """`trajectory` for each row of P; a row of times ends at its first infinity; planes (STATE, rows, n)
    are filled.
    """
    for i in range(len(P)):
        size = finite(times[i])
        phi0, w0 = starts[i, rc.START_PHI], starts[i, rc.START_W]
        status[i] = trajectory(setting, begin, at, P[i], phi0, w0, times[i, :size],
                               tolerance, limit, planes[:, i].T, turnings[i])  # fmt: skip


@splice
def abels(setting, begin, at, P, starts, targets, tolerance, limit, planes, status):
    """`abel` for each row of P; a row of targets ends at its first infinity, and one may serve all;
    planes (STATE, rows, n) are filled.
    """
    planes[:] = math.nan
    for i in range(len(P)):
        size = finite(row_of(targets, i))
        phi0, w0 = starts[i, rc.START_PHI], starts[i, rc.START_W]
        abel(setting, begin, at, P[i], phi0, w0, row_of(targets, i)[:size],
             tolerance, limit, planes[:, i].T, status[i])  # fmt: skip


@inline
def row_of(targets, i):
    """The targets of row i: its own, or the one row that serves all."""
    return targets[min(i, len(targets) - 1)]


@inline
def finite(row):
    """How many finite numbers stand before the first infinity or NaN."""
    size = 0
    while size < len(row) and math.isfinite(row[size]):
        size += 1
    return size


@inline
def start_sign(p, phi, w):
    """Sign of w just after the start: that of g where w = 0, and 0 at an equilibrium."""
    if w != 0.0:
        return 1 if w > 0.0 else -1
    g = values(p, phi)[1]
    if abs(g) <= 8.0 * ROUNDOFF_UP * p[BOUND_G]:
        return 0
    return 1 if g > 0.0 else -1


@inline
def rests(p, phi, w):
    """Is the state exactly an equilibrium? Of binary64 angles only 0 can be one (see
    `equilibria.resting`).
    """
    return w == 0.0 and (p[BOUND_G] == 0.0 or (phi == 0.0 and p[S2] == p[C23]))


@inline
def passage(at, p, T, target, up, h):
    """dt in [0, h] where phi = target, w without a zero inside the step; `up`: phi increases there."""
    return bracketed(
        to_target, at, (p, T, target, up), 0.5 * h, (0.0, h), (1e-17 + 1e-16 * h, 0.0), 60
    )[1]


@inline
def to_target(at, given, dt):
    """The residual of `passage`."""
    p, T, target, up = given
    phi, w, _e, _y = at(p, T, dt)
    return phi - target, w, (phi < target) == up


@inline
def time_of_turning(at, p, T, h):
    """dt in [0, h] where w, which changes sign on the step, is 0."""
    first = T[0, W] > 0.0 or (T[0, W] == 0.0 and T[1, W] > 0.0)
    return bracketed(to_rest, at, (p, T, first), 0.5 * h, (0.0, h), (1e-17 + 1e-16 * h, 0.0), 60)[1]


@inline
def until_turning(at, p, T, h, sign):
    """(time, phi, w, is it a turning point?) at the end of a step h with w of this sign, or where w
    becomes 0.
    """
    x, w, _e, _y = at(p, T, h)
    turned = w * sign <= 0.0
    if turned:
        h = time_of_turning(at, p, T, h)
        x, w, _e, _y = at(p, T, h)
    return h, x, w, turned


@inline
def to_rest(at, given, dt):
    """The residual of `time_of_turning`."""
    p, T, first = given
    phi, w, _e, _y = at(p, T, dt)
    f, g, _dg = values(p, phi)
    return w, f * w + g, (w > 0.0) == first


@part
def clean_turning(p, phi, bar_phi, bar_w):
    """Is a zero of w certain at phi: does g keep its sign over the error bounds?"""
    g = abs(values(p, phi)[1])
    return g > 0.0 and 10.0 * (p[BOUND_DG] * bar_phi + p[BOUND_F] * bar_w) < g


@inline
def node_possible(f, g, dg, bend):
    """Is what f, g and g' have to be where `node_ahead` finds a node true here? bend: a bound of
    |f'| + |g''|, or less.

    With the node at a distance x < 0.3, `settled` has bend x < |g'|/8 there, and less than 0.1 |f|: so up to it f, g
    and g' keep their signs, g' changes by 1/8 and g/|g'| is x to a fifth.
    """
    return (f < 0.0) & (dg < 0.0) & (g > 0.0) & (g < -0.4 * dg) & (g * bend < 0.2 * dg * dg)


@part
def node_ahead(p, phi, w, moved):
    """Distance to a stable node ahead that the solution at (phi, w > 0) certainly runs into without
    turning, or -1. It has `moved` so far since bounds were found that hold within p[RADIUS].
    """
    f, g, dg = values(p, phi)
    if not node_possible(f, g, dg, p[BOUND_F] + p[BOUND_DDG]):
        return -1.0
    x = phi
    for _ in range(40):
        _f, g, dg = values(p, x)
        if dg >= 0.0:
            return -1.0
        x -= g / dg
        if abs(g / dg) < 1e-15:
            break
    f, g, dg = values(p, x)
    gap = x - phi
    if not (dg < 0.0 and f < 0.0 and abs(g) < 1e-13 * p[BOUND_G] and 1e-11 < gap < 0.3):
        return -1.0
    if not on_circle(p) and gap > p[RADIUS] - moved:
        return -1.0
    return gap if settled(p, f, dg, -gap, w) else -1.0


@inline
def runs_into_node(p, phi, w, target, moved):
    """Does the solution at (phi, w > 0) certainly end in a stable node that it meets before the target?
    `moved` as in `node_ahead`.
    """
    if not w < 0.3 * p[BOUND_G] / (p[BOUND_F] + 1e-300):
        return False
    gap = node_ahead(p, phi, w, moved)
    return gap > 0.0 and target >= phi + gap


@inline
def conclude(ending, doubt, j, floats, status):
    """Note how the solution ends: at the targets from the j-th on, and those in doubt, from `doubt`
    on (-1: none).
    """
    for i in range(doubt if doubt >= 0 else j, len(status)):
        if i >= j or not certain(floats[i]):
            status[i] = ending


@inline
def at_rest(p, phi, phi0, w0, targets, floats, status):
    """Has a solution that starts at w0 = 0 turned there, or does it stay? Then all its targets are filled."""
    if w0 != 0.0 or start_sign(p, phi, w0) > 0:
        return False
    # within rounding of an equilibrium the side on which the solution leaves it is open
    ending = (
        TURNING
        if start_sign(p, phi, w0) < 0
        else (EQUILIBRIUM if rests(p, phi0, w0) else SEPARATRIX)
    )
    for i in range(len(targets)):
        here = targets[i] == phi0
        status[i] = OK if here else ending
        floats[i, rc.VALUE] = 0.0 if here else phi0
        floats[i, rc.TIME] = floats[i, rc.VALUE_BAR] = floats[i, rc.TIME_BAR] = 0.0
    return True


@inline
def abel(setting, begin, at, p, phi0, w0, targets, tolerance, limit, floats, status):
    """The solution from (phi0, w0 >= 0) at ascending targets >= phi0, forward in time.

    Fills floats[j] (VALUE to TIME_BAR) at targets[j] with status OK, or those of the turning point
    before it, or within whose bar it lies, with TURNING; EQUILIBRIUM where the solution runs into
    one first, SEPARATRIX where the error bound leaves open whether it turns. OK is certain: a
    target that is reached with no certain w is in doubt until the solution has left it behind.
    """
    T = table()
    bound_start(p, phi0, w0)
    how = setting(p, w0, tolerance)
    phi, turns = reduced(phi0) if on_circle(p) else (phi0, 0.0)
    w, t, t_low, n, started = w0, 0.0, 0.0, 0, w0 > 0.0
    slip = ROUNDOFF_UP * 4.0 * (turns != 0.0)
    saa, sab, sbb = slip * slip, 0.0, 0.0
    j, size, doubt = 0, len(targets), -1  # doubt: the first target in doubt
    ending = OK  # of no targets
    if at_rest(p, phi, phi0, w0, targets, floats, status):
        return
    while j < size or doubt >= 0:
        if n >= limit:
            ending = STEP_LIMIT
            break
        h = expand(begin, p, phi, w, how, T)
        n += 1
        if not (h > 0.0 and math.isfinite(h)):
            ending = OVERFLOW
            break
        x1, v1, _e, _y = at(p, T, h)
        turned = v1 <= 0.0
        reach = h
        if turned:
            reach = time_of_turning(at, p, T, h)
            x1, v1, _e, _y = at(p, T, reach)
        while j < size:
            target = unturned(targets[j], turns)
            if target > x1:
                break
            dt = passage(at, p, T, target, True, reach)
            x, v, _e, _y = at(p, T, dt)
            a, b, c = carried(p, T, dt, v, saa, sab, sbb)
            a += (3e-16 * abs(targets[j])) ** 2 + (2e-16 * h * v) ** 2
            f, g, _dg = values(p, x)
            fill_crossing(floats, j, n, v, t + (dt + t_low), a, b, c, f, g)
            usable = bar(n, a) < TRUST and floats[j, rc.VALUE_BAR] < TRUST * (1.0 + abs(v))
            usable = usable and floats[j, rc.TIME_BAR] < TRUST * (1.0 + floats[j, rc.TIME])
            status[j] = OK if usable else NO_CONVERGENCE
            if doubt < 0 and not certain(floats[j]):
                doubt = j
            j += 1
        saa, sab, sbb = carried(p, T, reach, v1, saa, sab, sbb)
        bar_phi, bar_w = bar(n, saa), bar(n, sbb)
        edge = bar_phi * 1.1 + 4e-16 * abs(x1 + turns * TWO_PI)
        # from here on a turning point lies beyond x1
        while doubt >= 0 and doubt < j and x1 - unturned(targets[doubt], turns) > edge:
            doubt += 1
        if doubt == j:
            doubt = -1
        if turned:
            ending = TURNING if clean_turning(p, x1, bar_phi, bar_w) else SEPARATRIX
            bar_t = bar_w / abs(values(p, x1)[1]) + 3e-16 * t if ending == TURNING else 0.0
            for i in range(doubt if doubt >= 0 else j, size):
                if i >= j or not certain(floats[i]):
                    status[i] = ending
                    floats[i, rc.VALUE], floats[i, rc.TIME] = (
                        x1 + turns * TWO_PI,
                        t + (reach + t_low),
                    )
                    floats[i, rc.VALUE_BAR] = edge + 4e-16 * abs(floats[i, rc.VALUE])
                    floats[i, rc.TIME_BAR] = bar_t * 1.2
            return
        moved, phi, w = x1 - phi, x1, v1
        t, t_low = later(t, t_low, h)
        if on_circle(p):
            phi, k = wrapped(phi)
            turns += k
        if not trusted(saa, sbb, w):
            ending = NO_CONVERGENCE if math.isfinite(w) else OVERFLOW
            break
        started = started or w > 2.0 * bar_w
        if started and not w > 2.0 * bar_w:
            ending = SEPARATRIX
            break
        if j < size and runs_into_node(p, phi, w, unturned(targets[j], turns), moved):
            ending = EQUILIBRIUM
            break
    conclude(ending, doubt, j, floats, status)


@inline
def certain(row):
    """Is w so certain, at a target, that a turning point is further away than the bar of phi?"""
    return row[rc.VALUE_BAR] < 0.1 * row[rc.VALUE]


@inline
def fill_crossing(floats, j, n, v, t, a, b, c, f, g):
    """See `crossing`."""
    floats[j, rc.VALUE], floats[j, rc.TIME], floats[j, rc.VALUE_BAR], floats[j, rc.TIME_BAR] = (
        crossing(n, v, t, a, b, c, f, g)
    )


@inline
def crossing(n, v, t, a, b, c, f, g):
    """w, t and their bars where phi passes a target: the error of phi along the flow goes into w
    and t.

    Near a turning point w^2 is smooth in phi while w is not; there the bar is that of w^2.
    """
    # the initial phi, the target and the time at which it is reached have errors too: at most four
    # terms
    n += 2
    moving = v > 0.0
    safe = v if moving else 1.0
    slope = (f * v + g) / safe
    bar_phi, bar_w = bar(n, a), bar(n, c)
    spread = bar(n, c - 2.0 * slope * b + slope * slope * a)
    beside = 2.0 * (bar_w + math.sqrt(abs(2.0 * (abs(g) + abs(f) * bar_w) * bar_phi))) + v
    spread = spread if moving and spread < 0.1 * v else beside
    accel = max(abs(f * v + g), 1e-300)
    gone = bar_phi / safe if moving else math.inf
    return max(v, 0.0), t, spread, min(gone, spread / accel + bar_w / accel) * 1.2 + 4e-16 * abs(t)
