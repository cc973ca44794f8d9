"""Single solutions of a flow on the cylinder phi' = w, w' = f(phi) w + g(phi): in time, and w and t
over phi (57).

Arrays in, arrays out; a row is one solution, its columns are the times or angles asked for. A row
that misses the requested accuracy is solved again with smaller steps, and the better answer is kept.
"""

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.accuracy import note_missed
from survey.kernels.cylinder.flow import BOUND_F, BOUND_G, spread, spread_programs
from survey.kernels.cylinder.program import COLUMNS, ON_CIRCLE
from survey.kernels.cylinder.steps import OK, TURNING, UNDETERMINED
from survey.measures.cylinder import equation

LEAST_BAR = 1e-150  # bars are carried on by their squares, which underflow below
STEPS = 200_000  # budget of one solution; about 0.1 s with the Taylor method
SHARE = 1e-3  # of the requested accuracy, for the truncation error of one step
ABEL_SHARE = 1e-4  # the same over phi: errors grow as 1 / w before a turning point
# the same for trajectories: most of what misses the accuracy misses it by little
ATTEMPTS = (3e-4, 1e-5, 1e-7)
LONG = 30.0  # from about twice this time on (see `_decades`) trajectories take finer steps
FINEST = 2e-16  # of a step: below, the truncation is lost in the rounding


def reverse(rows):
    """S1: (b, w, t) -> -(b, w, t); rows of GIVEN numbers (see `records`), and a program after them
    or none.
    """
    return _signed(rows, [-1, -1, 1, 1, 1, 1, 1, -1.0])


def mirror(rows):
    """S2: (phi, w, b31, c23, s2) -> -(phi, w, b31, c23, s2)."""
    return _signed(rows, [1, -1, 1, -1, -1, 1, -1, -1.0])


def _signed(rows, signs):
    return rows * np.pad(signs, (0, rows.shape[1] - rc.GIVEN), constant_values=1.0)


def rows(flows, phi0, w0):
    """Solutions from six parameters, or programs (N, n) of `equation.flows`, and their initial states (N)."""
    return np.column_stack([flows[:, : rc.SIX], phi0, w0, flows[:, rc.SIX :]])


def tolerances(method, rtol, share=SHARE):
    """Truncation per step, for the first attempt and for the second."""
    first = min(max(share * rtol, method.FLOW_FINEST), 1e-6)
    return first, min(max(1e-7 * rtol, method.FLOW_FINEST), 1e-10)


def attempts(method, rtol, decades=0):
    """Truncation per step of trajectories, ever finer; `decades` finer still, from `_decades`."""
    asked, least = rtol * 10.0**-decades, max(FINEST, method.FLOW_FINEST)
    tolerances = [min(max(share * asked, least), 1e-6) for share in ATTEMPTS]
    return [
        first
        for first, finer in zip(tolerances, [*tolerances[1:], 0.0], strict=True)
        if finer < 0.5 * first
    ]


def split(rows):
    """Rows of GIVEN numbers (see `records`) as the kernels take them: coefficients and initial states."""
    own = rows.shape[1] > rc.GIVEN
    P = np.empty((len(rows), rows.shape[1] - (rc.GIVEN - rc.SIX) if own else COLUMNS))
    starts = np.empty((len(rows), rc.EXACT_START))
    (spread_programs if own else spread)(np.ascontiguousarray(rows, dtype=float), P, starts)
    P.flags.writeable = own
    return P, starts


def trajectories(method, rows, times, rtol, counted=True):
    """PHI to W_BAR of `records` (last axis), turnings and status at `times` (rows, columns), of
    either sign.

    turnings counts the sign changes of w between 0 and t; it is UNDETERMINED where the error bound
    leaves it open, and, unless `counted`, everywhere.
    """
    return trajectories_and_met(method, rows, times, rtol, counted)[0]


def trajectories_and_met(method, rows, times, rtol, counted=True):
    """As `trajectories`, and whether every point is known to meet the requested accuracy."""
    past = times < 0
    if not past.any():
        return _in_time(method, rows, times, rtol, counted)
    results, met = _nothing(times.shape), True
    for mine, back in ((~past, False), (past, True)):
        picked = mine.any(axis=1)
        if not picked.any():
            continue
        elapsed = np.where(mine, np.abs(times), np.inf)[picked]
        own = reverse(rows[picked]) if back else rows[picked]
        parts, fine = _in_time(method, own, elapsed, rtol, counted)
        met &= fine
        if back:
            parts[0][..., rc.W] *= -1.0
        take = mine[picked]
        for result, part in zip(results, parts, strict=True):
            held = result[picked]
            held[take] = part[take]
            result[picked] = held
    return results, met


def _nothing(shape, counted=True):
    """floats, turnings and status before anything is known; turnings have no columns unless `counted`."""
    return (
        np.full((rc.STATE, *shape), np.nan).transpose(1, 2, 0),  # planes, as each is read by itself
        np.full(shape if counted else (shape[0], 0), UNDETERMINED, dtype=np.int64),
        np.zeros(shape, dtype=np.int8),
    )


def _in_time(method, rows, times, rtol, counted):
    times, back = _sorted(times)
    decades = _decades(rows, times)
    kinds = np.unique(decades)
    if len(kinds) < 2:
        results, met = _in_order(method, rows, times, rtol, counted, decades.max(initial=0))
        return back(results), met
    results, met = _nothing(times.shape), True
    for kind in kinds:
        mine = decades == kind
        parts, fine = _in_order(method, rows[mine], times[mine], rtol, counted, kind)
        met &= fine
        for result, part in zip(results, parts, strict=True):
            result[mine] = part
    return back(results), met


def _decades(rows, times):
    """How many decades finer than for short ones the steps of each motion are: error bars grow as the
    square of the time, and a second attempt costs more than finer steps.

    The unit of time is 1 / (|f| + sqrt |g|), from bounds of f and g; on a line these are known only as
    the motion proceeds.
    """
    if rows.shape[1] > rc.GIVEN and not rows[0, ON_CIRCLE] > 0.0:
        return np.zeros(len(rows), dtype=int)
    last = times.max(axis=1, initial=0.0)
    if not np.isfinite(last).all():
        last = np.where(np.isfinite(times), times, 0.0).max(axis=1, initial=0.0)
    P, _starts = split(rows)
    with np.errstate(over="ignore"):
        turned = last * (P[:, BOUND_F] + np.sqrt(P[:, BOUND_G]))
    return np.rint(2.0 * np.log10(np.clip(np.nan_to_num(turned) / LONG, 1.0, 1e15))).astype(int)


def _in_order(method, rows, times, rtol, counted, decades):
    budget = STEPS * min(method.FLOW_WORK, 10)
    ladder = attempts(method, rtol, decades)
    skips = getattr(method, "FLOW_UNCOUNTED", False)

    def run(pick, tolerance):
        P, starts = split(rows[pick])
        at = np.array(times[pick], order="C")  # never read-only, as a broadcast array is
        floats, turnings, status = _nothing(at.shape, counted or not skips)
        ends = np.zeros(len(P), dtype=np.int64)
        planes = floats.transpose(2, 0, 1)
        method.flow_trajectories(P, starts, at, tolerance, budget, planes, turnings, ends)
        if ends.any():
            left = ~np.isfinite(floats[..., rc.PHI])
            np.copyto(status, ends[:, None], where=left, casting="unsafe")
        if not planes[rc.W_BAR].min(initial=np.inf) >= LEAST_BAR:  # or NaN
            lost = (floats[..., rc.W_BAR] < LEAST_BAR) & (floats[..., rc.W] != 0)
            floats[..., rc.W_BAR][lost] = LEAST_BAR
        return (floats, turnings, status) if counted else (floats, status)

    asked = np.broadcast_to(np.isfinite(distinct(times)), times.shape)
    results, met = _repeated(run, lambda: asked, ladder, rtol)
    if not counted:
        floats, status = results
        return (floats, np.full(status.shape, UNDETERMINED, dtype=np.int8), status), met
    turning = rows.shape[1] == rc.GIVEN or rows[0, ON_CIRCLE] > 0
    if hasattr(method, "flow_turnings") and turning:
        _count(method, rows, times, ladder[-1], asked, results)
    return results, met


def _count(method, rows, times, tolerance, asked, results):
    """Count the turnings that the steps left UNDETERMINED, as beside a focus, where w is less than
    its error bound.
    """
    _floats, turnings, status = results
    pick = (asked & (turnings == UNDETERMINED) & (status == OK)).any(axis=1)
    if pick.any():
        P, starts = split(rows[pick])
        if P.shape[1] > COLUMNS:
            equation.limit(P)
        counted = turnings[pick]
        method.flow_turnings(
            P, starts, np.ascontiguousarray(times[pick]), tolerance, STEPS, counted
        )
        turnings[pick] = np.where(status[pick] == OK, counted, turnings[pick])


def abel(method, rows, targets, rtol, before=False, timed=True):
    """VALUE to TIME_BAR of `records` (last axis) and status at phi = `targets` (rows, columns).

    Where w0 = 0 and g != 0 the solution starts at its turning point; it is followed forward in
    time, or backward if `before`; both branches lie to the side of g, and at targets on the other
    side it has turned at t = 0.

    Unless `timed`, TIME and TIME_BAR need not be known, and say nothing.
    """
    return abel_and_met(method, rows, targets, rtol, before, timed)[0]


def abel_and_met(method, rows, targets, rtol, before=False, timed=True):
    """As `abel`, and whether every point is known to meet the requested accuracy."""
    back = rows[:, rc.W0] == 0.0 if before else np.zeros(len(rows), bool)
    phi0, past = rows[:, rc.PHI0, None], back | (rows[:, rc.W0] < 0)
    least = distinct(targets).min(axis=1, keepdims=True, initial=np.inf)
    if targets.size and (past == past[0]).all() and (least >= phi0).all():  # as a rule
        return _branch(method, rows, targets, rtol, 1.0, past[0], timed)
    planes = np.full((rc.STATE, *targets.shape), np.nan)
    status = np.zeros(targets.shape, dtype=np.int8)
    good = not np.isnan(least).any()
    for side in (1.0, -1.0):
        onward = targets >= phi0 if side > 0 else targets < phi0
        for past in (False, True):
            picked = onward.any(axis=1) & (((rows[:, rc.W0] * side < 0) | back) == past)
            if not picked.any():
                continue
            some = slice(None) if picked.all() else np.flatnonzero(picked)
            mine = onward[some]
            same = np.flatnonzero(mine[0])
            if (mine == mine[0]).all() and same[-1] - same[0] < same.size:
                mine, columns = True, slice(same[0], same[-1] + 1)
                at = targets[some, columns]
            else:  # the start stands for the angles on the other side
                columns, at = slice(None), np.where(mine, targets[some], phi0[some])
            found, met = _branch(method, rows[some], at, rtol, side, past, timed)
            good &= met
            for result, new in zip(
                (*planes, status), (*found[0].transpose(2, 0, 1), found[1]), strict=True
            ):
                held = result[some, columns]  # a copy where rows are picked
                np.copyto(held, new, where=mine)
                result[some, columns] = held
    return (planes.transpose(1, 2, 0), status), good


def _branch(method, rows, targets, rtol, side, past, timed):
    """As `abel_and_met`, for targets on one side of phi0 (1 or -1), which the motion reaches at t < 0 if `past`."""
    rows = reverse(rows) if past else rows
    rows = mirror(rows) if side < 0 else rows
    (floats, status), met = _in_phi(
        method, rows, side * targets if side < 0 else targets, rtol, timed
    )
    if side < 0 or past:
        floats[..., rc.VALUE] *= np.where(status == TURNING, side, side * (-1.0 if past else 1.0))
        if timed and past:
            floats[..., rc.TIME] *= -1.0
        for value in (rc.VALUE, rc.TIME)[: 1 + timed]:
            floats[..., value] += 0.0  # no negative zeros
    return (floats, status), met


def _in_phi(method, rows, targets, rtol, timed):
    targets, back = _sorted(targets)
    solve = method.flow_abels
    if not timed:
        solve = getattr(method, "flow_abels_untimed", solve)
    budget = STEPS * min(method.FLOW_WORK, 10)

    def run(pick, tolerance):
        P, starts = split(rows[pick])
        starts[:, rc.START_W] = np.abs(starts[:, rc.START_W])
        starts += 0.0  # no negative zeros
        shape = len(P), targets.shape[1]
        planes, status = np.empty((rc.STATE, *shape)), np.zeros(shape, dtype=np.int8)
        own = distinct(targets)
        at = np.array(own if len(own) < len(targets) else own[pick], order="C")
        solve(P, starts, at, tolerance, budget, planes, status)
        return planes.transpose(1, 2, 0), status

    def asked():
        return np.isfinite(targets) & (targets != rows[:, rc.PHI0, None])  # the start is known

    results, done = _repeated(run, asked, tolerances(method, rtol, ABEL_SHARE), rtol, timed)
    return back(results), done


def _repeated(run, asked, ladder, rtol, timed=True):
    """Solve all rows, then again, finer, those that miss the requested accuracy where they are `asked()`;
    keep the better of two. With whether every point is known to meet it.
    """
    first, *others = ladder
    own = results = run(slice(None), first)
    rows, met = np.arange(len(results[-1])), True
    for tolerance in others:
        row, column = _missed_at(own, rtol, timed)
        if not row.size:
            return results, met
        if not timed:
            own[0][..., rc.TIME :: 2] = 0.0  # they hold anything: no choice may depend on them
        again = np.zeros(len(rows), np.bool_)
        again[row[asked()[rows[row], column]]] = True
        if not again.any() or tolerance >= first:
            return results, False
        met &= bool(again[row].all())
        rows, own = rows[again], [result[again] for result in own]
        finer = run(rows, tolerance)
        if not timed:
            finer[0][..., rc.TIME :: 2] = 0.0
        better = badness(finer) <= badness(own)
        for result, old, new in zip(results, own, finer, strict=True):
            old[better] = new[better]
            result[rows] = old
    return results, met and not _missed_at(own, rtol, timed)[0].size


def _missed_at(results, rtol, timed=True):
    """The rows and columns of the points that miss the accuracy (see `missed`)."""
    return np.divmod(np.flatnonzero(missed(results, rtol, timed)), results[-1].shape[1])


def missed(results, rtol, timed=True):
    """Where the answer misses the requested accuracy, or there is none; unless `timed`, times are not looked at."""
    floats, status = results[0], results[-1]
    planes, out = np.ascontiguousarray(floats.transpose(2, 0, 1)), np.zeros(status.shape, np.bool_)
    planes, flat = planes.reshape(len(planes), -1), out.reshape(-1)
    pairs = (rc.VALUE, rc.VALUE_BAR), (rc.TIME, rc.TIME_BAR)  # PHI and W likewise
    for value, bar in pairs[: 1 + timed]:
        note_missed(planes[value], planes[bar], status.reshape(-1), rtol, flat)
    return out


def badness(results):
    floats, status = results[0], results[-1]
    bars = floats[..., rc.PHI_BAR :]
    worst = np.where(np.isnan(bars[..., 0]), 0.0, np.nanmax(bars, axis=-1, initial=0.0))
    return worst + np.where((status == OK) | (status == TURNING), 0.0, 1e300)


def distinct(columns):
    """The one row of an array whose rows are the same by broadcasting, else all."""
    return columns[:1] if columns.strides[0] == 0 else columns


def _sorted(columns):
    """`columns` (rows, n) in ascending order, and the function that brings results back into their order."""
    own = distinct(columns)
    if (own[:, 1:] >= own[:, :-1]).all():
        return columns, lambda results: results
    if (own[:, 1:] <= own[:, :-1]).all():
        return columns[:, ::-1], lambda results: tuple(result[:, ::-1] for result in results)
    order = np.argsort(columns, axis=1, kind="stable")
    back = np.argsort(order, axis=1)

    def undone(results):
        return tuple(
            np.take_along_axis(result, back[..., None] if result.ndim == 3 else back, axis=1)
            for result in results
        )

    return np.take_along_axis(columns, order, axis=1), undone
