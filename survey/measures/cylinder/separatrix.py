"""Solutions on a separatrix: the stable and unstable branches of the saddles, as exactly as their
parameters are given.

A start is a row of GIVEN numbers: the six parameters, phi0, and the NUMBER of the saddle, by its
angle in [0, 2 pi). The branch is that of the saddle next to phi0: on its right side phi0 - 2 pi <
phi_s < phi0, on its left phi0 < phi_s < phi0 + 2 pi, and phi0 lies between the saddle and the first
turning point of the branch, if it turns. There t = 0.

Where b = 0 in closed form (`kernels.cylinder.separatrix`), else by the power series at the saddle
and Taylor series in double-double arithmetic (`kernels.cylinder.branch_double`); by any other
method from the state on the branch at phi0.
"""

from fractions import Fraction

import numpy as np

from survey.kernels.cylinder import branch_double, separatrix
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import B12, B31, OF_F, OF_G
from survey.kernels.cylinder.separatrix import ANGLE, ANGLE_LOW, MULTIPLICITY, SLIP
from survey.kernels.cylinder.steps import (
    EQUILIBRIUM,
    NO_CONVERGENCE,
    OK,
    TRUST,
    TURNING,
    UNDETERMINED,
)
from survey.kernels.math.roundoff import EPS
from survey.measures.cylinder import quartic, solution
from survey.methods import closed
from survey.status import INVALID_PARAMETERS

HEADS = 4  # of a row: the angle of the saddle, w at phi0, and their bars
SADDLE, SADDLE_BAR, START, START_BAR = range(HEADS)
NO_FORM, DEGENERATE = 19, 21  # as in the STATUS of scenes/gyrostat.py


def trajectories(method, rows, times, rtol, stable, left):
    """As `solution.trajectories`, and the HEADS of each row; with None the best method is chosen."""
    floats, turnings, status = solution._nothing(times.shape)
    starts = Starts(method, rows, stable, left)
    sign_w, sign_t = (-1.0 if stable != left else 1.0), (-1.0 if stable else 1.0)
    order = np.argsort(sign_t * times, axis=1, kind="stable")
    for i in range(len(rows)):
        status[i] = starts.status[i]
        if starts.status[i] != OK:
            continue
        at = sign_t * times[i, order[i]]
        at, asked_at = np.ascontiguousarray(at[np.isfinite(at)]), order[i][np.isfinite(at)]
        found, counts, ending = starts.at(i, at)
        found[:, rc.PHI] *= -1.0 if left else 1.0
        found[:, rc.W] *= sign_w
        found += 0.0  # no negative zeros
        floats[i, asked_at], turnings[i, asked_at] = found, counts
        status[i, asked_at] = np.where(np.isfinite(found[:, rc.PHI]), OK, ending)
    if method in (None, closed):
        return floats, turnings, status, starts.heads
    results = _by_steps(starts, rows, lambda some: solution.trajectories(method, some, times, rtol))
    return *results, starts.heads


def abel(method, rows, targets, rtol, stable, left):
    """As `solution.abel`, and the HEADS of each row; with None the best method is chosen."""
    floats = np.full((*targets.shape, rc.STATE), np.nan)
    status = np.zeros(targets.shape, np.int8)
    starts = Starts(method, rows, stable, left)
    side, sign_w = (-1.0 if left else 1.0), (-1.0 if stable != left else 1.0)
    order = np.argsort(side * targets, axis=1, kind="stable")
    for i in range(len(rows)):
        status[i] = starts.status[i]
        if starts.status[i] != OK:
            continue
        asked_at = order[i][np.isfinite(targets[i, order[i]])]
        found, codes = starts.passing(i, np.ascontiguousarray(side * targets[i, asked_at]))
        found[:, rc.VALUE] *= np.where(codes == TURNING, side, sign_w)
        found[:, rc.TIME] *= -1.0 if stable else 1.0
        floats[i, asked_at], status[i, asked_at] = found + 0.0, codes
    if method in (None, closed):
        return floats, status, starts.heads
    results = _by_steps(starts, rows, lambda some: solution.abel(method, some, targets, rtol))
    return *results, starts.heads


class Starts:
    """The branches on which rows start, as branches that leave a saddle to the right; their status
    and HEADS.
    """

    def __init__(self, method, rows, stable, left):
        self.heads = np.full((len(rows), HEADS), np.nan)
        self.status = np.full(len(rows), INVALID_PARAMETERS)
        plain, _starts = solution.split(rows)
        turned = solution.reverse(rows) if stable else rows
        turned = solution.mirror(turned) if left else turned
        self.P, starts = solution.split(turned)
        self.phi0 = starts[:, rc.START_PHI].copy()
        self.branches = [None] * len(rows)
        for i in range(len(rows)):
            at_saddle = np.zeros(separatrix.SADDLE)
            if not separatrix.saddle(plain[i], rows[i, rc.NUMBER], at_saddle):
                continue
            angle, many = at_saddle[ANGLE] % (2 * np.pi), at_saddle[MULTIPLICITY]
            self.heads[i, SADDLE] = angle
            self.heads[i, SADDLE_BAR] = EPS * (1.0 + angle) + at_saddle[SLIP]
            if left:
                at_saddle[ANGLE], at_saddle[ANGLE_LOW] = -at_saddle[ANGLE], -at_saddle[ANGLE_LOW]
            free = not rows[i, OF_F].any()
            if many > separatrix.ONE and not (free and _multiple(rows[i], many)):
                self.status[i] = DEGENERATE
            elif free:
                self.heads[i, SADDLE_BAR] = EPS * (1.0 + angle)
                self._elliptic(i, at_saddle, many > separatrix.ONE or symmetric(rows[i]))
            elif method is closed:
                self.status[i] = NO_FORM
            else:
                self._series(i, at_saddle)
        self.heads[self.status == INVALID_PARAMETERS] = np.nan
        if stable != left:
            self.heads[:, START] *= -1.0

    def _elliptic(self, i, at_saddle, exact):
        data = np.zeros((separatrix.SIZE, 2))
        status = separatrix.enter(self.P[i], at_saddle, exact, self.phi0[i], data)
        if status >= 0:
            self.status[i] = status
        if status == OK:
            self.heads[i, START], self.heads[i, START_BAR] = separatrix.start(data)
            self.branches[i] = data, None, None

    def _series(self, i, at_saddle):
        (a, branch), out = branch_double.scratch(), np.zeros(2)
        status = branch_double.enter(self.P[i], at_saddle, self.phi0[i], a, branch, out)
        self.status[i] = INVALID_PARAMETERS if status in (TURNING, EQUILIBRIUM) else status
        if status == OK:
            self.heads[i, START], self.heads[i, START_BAR] = out
            self.branches[i] = at_saddle, a, branch

    def at(self, i, times):
        """floats, turnings, and the status where there are none, at ascending times of row i."""
        floats = np.full((len(times), rc.STATE), np.nan)
        turnings = np.full(len(times), UNDETERMINED)
        first, a, branch = self.branches[i]
        if a is not None:
            status = branch_double.trajectory(
                self.P[i], first, a, branch, self.phi0[i], times, floats, turnings
            )
            return floats, turnings, status
        for j, t in enumerate(times):
            turnings[j] = separatrix.at(self.P[i], first, self.phi0[i], t, floats[j])
        lost = ~(
            (floats[:, rc.PHI_BAR] < TRUST)
            & (floats[:, rc.W_BAR] < TRUST * (1.0 + np.abs(floats[:, rc.W])))
        )
        floats[lost] = np.nan
        return floats, turnings, NO_CONVERGENCE

    def passing(self, i, targets):
        """floats and status at ascending targets of row i."""
        floats = np.full((len(targets), rc.STATE), np.nan)
        status = np.zeros(len(targets), np.int64)
        first, a, branch = self.branches[i]
        if a is not None:
            branch_double.abel(self.P[i], first, a, branch, self.phi0[i], targets, floats, status)
        else:
            for j, target in enumerate(targets):
                status[j] = separatrix.passing(first, self.phi0[i], target, floats[j])
        return floats, status


def _by_steps(starts, rows, solve):
    """The results of `solve` from the states at phi0, whose rounding two states next to each add to
    the bars.
    """
    good = starts.status == OK
    given = rows.copy()
    given[:, rc.W0] = np.where(good, starts.heads[:, START], 0.0)
    results, beside = solve(given), given.copy()
    beside[:, rc.W0] += np.where(
        good, starts.heads[:, START_BAR] + EPS * np.abs(given[:, rc.W0]), 0.0
    )
    others, bars = solve(beside), rc.STATE // 2
    floats = results[0]
    with np.errstate(invalid="ignore"):
        floats[..., bars:] += 2.0 * np.abs(floats - others[0])[..., :bars]
        lost = ~(floats[..., bars:] < TRUST * (1.0 + np.abs(floats[..., :bars]))).all(axis=-1)
    lost &= (results[-1] == OK) | (results[-1] == TURNING)
    floats[lost], results[-1][lost] = np.nan, NO_CONVERGENCE
    if len(results) == 3:
        results[1][
            (results[1] != others[1]) | (np.abs(floats[..., rc.W]) <= floats[..., rc.W_BAR])
        ] = UNDETERMINED
    results[-1][~good] = starts.status[~good, None]
    floats[~good] = np.nan
    return results


def numbered(row, number):
    """The row, alone, of the start on a branch of the saddle of that number."""
    return np.array([[*row[: rc.NUMBER], number]])


def symmetric(row):
    """Is V exactly even about the direction of s, or s = 0? Then saddles on both sides of it have
    the same energy.
    """
    d, c23, s2, s3 = (Fraction(float(x)) for x in row[OF_G])
    return d * s2 * s3 + c23 * (s3 * s3 - s2 * s2) == 0


def _multiple(row, many):
    """Has g exactly a root of this multiplicity? By the invariants of its quartic in tan(phi/2):
    I^3 = 27 J^2.
    """
    d, c23, s2, s3 = (Fraction(float(x)) for x in row[OF_G])
    a, b, c, e, f = -c23 - s2, (d - s3) / 2, c23, -(d + s3) / 2, s2 - c23
    first = a * f - 4 * b * e + 3 * c * c
    second = a * c * f + 2 * b * c * e - a * e * e - b * b * f - c * c * c
    if many > separatrix.TWO:
        return first == 0 and second == 0
    return first**3 == 27 * second**2


def branch_of(row):
    """(number of the saddle, stable?, left?) of the branch on which a motion without Barnett-London
    effect starts.

    `row` holds six parameters, phi0 and w0 != 0, of which it is known that H(phi0, w0) is exactly
    that of a saddle. None if that saddle is not found, or phi0 is not reached from it.
    """
    p = solution.split(np.array([row]))[0][0]
    at_saddle = np.zeros(separatrix.SADDLE)
    (d, c23, s2, s3), phi0, w0 = row[OF_G], row[rc.PHI0], row[rc.W0]
    level = w0 * w0 - quartic.square_of_w(d, c23, s2, s3, phi0)[0]
    missed = []
    for number in range(1, 5):
        if separatrix.saddle(p, float(number), at_saddle):
            missed.append(
                (abs(level + quartic.square_of_w(d, c23, s2, s3, at_saddle[ANGLE])[0]), number)
            )
    size = w0 * w0 + abs(d) + abs(c23) + abs(s2) + abs(s3)
    for off, number in sorted(missed):
        for stable in (False, True):
            left = (w0 < 0.0) != stable
            if (
                off < 1e-9 * size
                and Starts(closed, numbered(row, number), stable, left).status[0] == OK
            ):
                return number, stable, left
    return None


def through(rows, columns, rtol, branches, measure=trajectories):
    """As `solution.trajectories` (or `abel`) of rows that start on the `branches` (of `branch_of`)
    of saddles.
    """
    found = []
    for i, (number, stable, left) in enumerate(branches):
        given = numbered(rows[i], number)
        found.append(measure(closed, given, columns[i : i + 1], rtol, stable, left)[:-1])
    return tuple(np.concatenate(parts) for parts in zip(*found, strict=True))


def exact_starts(rows):
    """{row: its branch, of `branch_of`} of those that start exactly on a separatrix, b = 0.

    phi0 is 0 there: of any other angle of binary64 sine and cosine are transcendental, but the
    energies of saddles are algebraic.
    """
    at = np.flatnonzero((rows[:, rc.PHI0] == 0.0) & (rows[:, B12] == 0.0))  # as a rule, none
    some = rows[at, : rc.GIVEN]
    found = {}
    for i in at[(some[:, B31] == 0.0) & (some[:, rc.W0] != 0.0) & np.isfinite(some).all(axis=1)]:
        exact = [Fraction(float(x)) for x in (*rows[i, OF_G], rows[i, rc.W0])]
        if quartic.is_degenerate(quartic.at_zero(*exact)):
            branch = branch_of(rows[i])
            found |= {int(i): branch} if branch else {}
    return found


class SeparatrixAware:
    """A measure of single solutions, as `solution` is, but for those that start exactly on a
    separatrix, which are solved as in this file.
    """

    def __init__(self, measure):
        self.measure = measure

    def trajectories(self, method, rows, times, rtol, counted=True):
        return self._replaced(
            self.measure.trajectories(method, rows, times, rtol, counted=counted),
            rows,
            times,
            rtol,
            trajectories,
        )

    def abel(self, method, rows, targets, rtol, before=False, timed=True):
        return self._replaced(
            self.measure.abel(method, rows, targets, rtol, before, timed=timed),
            rows,
            targets,
            rtol,
            abel,
        )

    def _replaced(self, results, rows, columns, rtol, measure):
        own = exact_starts(rows)
        if own:
            at = list(own)
            for result, new in zip(
                results, through(rows[at], columns[at], rtol, own.values(), measure), strict=True
            ):
                result[at] = new
        return results
