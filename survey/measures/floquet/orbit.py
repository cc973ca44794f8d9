"""Periodic orbits of x' = f(t, x, p), and their stability: states at t = 0, periods, multipliers,
verdicts.

Newton's method on x(T) - x(0) = 0, damped, from `start`; the derivative M = dx(T)/dx(0) is the
monodromy matrix. Where f does not depend on t, T is unknown too, and x(0) stays in the plane
through the start that f is normal to there. Where it does not converge, it begins again from the
state RELAXED periods later, on the attracting orbit perhaps. Orbits are shown to exist, and bounds
made of all outputs, by `existence`.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from survey import status
from survey.kernels.floquet.flow import ORDER
from survey.kernels.math.roundoff import EPS
from survey.measures.floquet import existence, monodromy, shooting, stability
from survey.measures.floquet.continuation import ContinuedCurves
from survey.measures.floquet.newton import chosen, located
from survey.measures.floquet.recomputed import recomputed
from survey.scene import Output

NO_ORBIT = status.FIRST_OF_SCENE
SOME = 4  # points at which it is tried which states are angles
CHUNK = 2048  # points that are solved together
SAME = 1e-6  # relative: what one orbit is, found twice
ROWS = 64  # whose curves are followed together
CALL = 200_000  # numbers of a series that are recorded together
FINER = 4.0  # steps, along symmetric orbits that are not shown to exist otherwise, or too coarsely

_of_floquet = {o.name: o for o in stability.OUTPUTS}
OUTPUTS = (
    Output("x0", "state of the periodic orbit at t = 0", "x_0", dims=("state",)),
    replace(_of_floquet["period"], long_name="period of the orbit"),
    *(o for o in stability.OUTPUTS if o.name not in {"period", *stability.SYMPLECTIC}),
)

NUMBER = Output(
    "orbits", "number of periodic orbits that are found and shown to exist", integer=True
)


def solve(equation, points, method, rtol, wanted):
    """The wanted outputs of the points (N, parameters), each with `_error` if it is a float, and `status`."""
    method = monodromy.method_of(method)
    parts = [
        _chunk(equation, points[i : i + CHUNK], method, rtol, wanted)
        for i in range(0, max(len(points), 1), CHUNK)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def solve_branches(equation, points, branch, continued, method, rtol, wanted):
    """As `solve`, for the orbit number `branch` (N) of each point, among those on the curves of
    `continued`.

    They are numbered by the mean squares of their states, and where these are the same, by x0.
    """
    method = monodromy.method_of(method)
    known = np.isfinite(points).all(axis=1) & (branch == np.floor(branch))
    different, row_of = np.unique(points[known], axis=0, return_inverse=True)
    row_of = row_of.reshape(-1)
    parts = []
    of_point = [[] for _ in different]
    count = 0
    for where, x, T in followed(equation, continued, different, _reach(rtol)):
        for i in range(0, len(where), CHUNK):
            own = where[i : i + CHUNK]
            period = T[i : i + CHUNK] if equation.free else equation.periods(different[own])
            found = shown(
                equation, different[own], x[i : i + CHUNK], period, method, rtol, relax=False
            )
            for k in np.flatnonzero(found.good):
                of_point[own[k]].append(KnownOrbit.of(found, k, count + k))
            full = np.ones(len(own), bool)
            parts.append(found.outputs(full, rtol, wanted, callable(equation.period)))
            count += len(own)
    several = [k for k, orbits in enumerate(of_point) if len(orbits) > 1][:SOME]
    angles = None
    if several:
        x, T = (np.array([getattr(of_point[k][0], name) for k in several]) for name in ("x0", "T"))
        angles = equation.angles(different[several], x, T)
    free = equation.free and equation.symmetry is None
    order = [numbered(orbits, free, angles) for orbits in of_point]
    empty = OrbitResults(equation, 1).outputs(
        np.ones(1, bool), rtol, wanted, callable(equation.period)
    )
    out = {name: np.concatenate([*(part[name] for part in parts), empty[name]]) for name in empty}
    pick = np.full(len(points), count)
    for i, k, number in zip(np.flatnonzero(known), row_of, branch[known].astype(int), strict=True):
        if abs(number) <= len(order[k]):
            pick[i] = order[k][number - (number > 0)]
    out = {name: values[pick] for name, values in out.items()}
    out["status"] = np.where(known, out["status"], status.INVALID_PARAMETERS).astype(
        out["status"].dtype
    )
    without = np.flatnonzero([not one for one in order])
    undefined = without[~_defined(equation, different[without])]
    out["status"][np.flatnonzero(known)[np.isin(row_of, undefined)]] = status.INVALID_PARAMETERS
    if NUMBER.name in wanted:
        out[NUMBER.name] = np.full(len(points), NUMBER.fill)
        out[NUMBER.name][known] = np.array([len(one) for one in order], int)[row_of]
    return out


def followed(equation, continued, points, reach):
    """Orbits at `points` (N, parameters), by following them along `continued`: (numbers of the
    points, states, periods) of some of the points at a time. A point may have several, and one of
    them more than once.
    """
    others = points.copy()
    others[:, continued.index] = 0.0
    rows, row = np.unique(others, axis=0, return_inverse=True)
    row = row.reshape(-1)
    for first in range(0, len(rows), ROWS):
        curves = ContinuedCurves(equation, continued, rows[first : first + ROWS], reach)
        where, x, T = [], [], []
        for k in range(len(curves.rows)):
            mine = np.flatnonzero(row == first + k)
            which, *start = curves.starts(k, points[mine, continued.index], folds=True)
            where.append(mine[which])
            x.append(start[0])
            T.append(start[1])
        where, x, T = (np.concatenate(one) for one in (where, x, T))
        yield where, equation.pinned(points[where], x), T  # curves are cubics between their points


class KnownOrbit(NamedTuple):
    """An orbit that was found at a point: the mean square of its states, x0, T, its number, and the
    bars of x0.
    """

    square: float
    x0: tuple
    T: float
    number: int
    bars: tuple

    @classmethod
    def of(cls, found, i, number):
        """Orbit i of OrbitResults."""
        return cls(found.square[i], tuple(found.x[i]), found.T[i], number, tuple(found.dx[i]))


def numbered(orbits, free, angles=None):
    """The numbers of the different ones among KnownOrbits, by the mean squares of their states, then
    x0. States that are `angles` (n) are taken modulo 2 pi.
    """
    kept = []
    for one in sorted(orbits):
        if free:
            same = (
                _near(one.square, other.square) and abs(one.T - other.T) <= SAME * one.T
                for other in kept
            )
        else:
            same = (_is_same(one, other, angles) for other in kept)
        if not any(same):
            kept.append(one)
    for i in range(1, len(kept)):
        for k in range(i, 0, -1):
            before, after = kept[k - 1], kept[k]
            if _near(after.square, before.square) and after.x0 < before.x0:
                kept[k - 1], kept[k] = after, before
    return [one.number for one in kept]


def _is_same(one, other, angles):
    """Do two forced orbits start at the same state, or within each other's bars, as where both are 0?"""
    apart = np.subtract(one.x0, other.x0)
    if angles is not None and angles.any():
        turns = np.where(angles, np.round(apart / (2 * np.pi)), 0.0)
        apart = abs(apart - 2 * np.pi * turns) - 16 * EPS * abs(turns)
        return (apart <= np.add(one.bars, other.bars)).all()
    apart = abs(apart)
    alike = _near(one.square, other.square) and apart.max() <= SAME * one.square**0.5
    return alike or (apart <= np.add(one.bars, other.bars)).all()


def _near(a, b):
    return abs(a - b) <= SAME * (a + b)


def _defined(equation, points):
    """Where (N) f is finite at the start, whose period may be unknown if it is sought."""
    found = np.zeros(len(points), bool)
    guess, period = equation.begin(points)
    if equation.free:
        period = np.where(np.isfinite(period), period, 1.0)  # f does not depend on time
    some = np.flatnonzero(np.isfinite(guess).all(axis=1) & np.isfinite(period))
    found[some] = equation.defined(points[some], guess[some], period[some])
    return found


def _chunk(equation, points, method, rtol, wanted):
    N, n = len(points), equation.n
    known = np.isfinite(points).all(axis=1)
    guess, period = np.full((N, n), np.nan), np.full(N, np.nan)
    guess[known], period[known] = equation.begin(points[known])
    known &= np.isfinite(guess).all(axis=1) & np.isfinite(period) & (period > 0)
    found = shown(equation, points, guess, period, method, rtol)
    without = np.flatnonzero(known & ~found.good)
    known[without] = equation.defined(points[without], guess[without], period[without])
    return found.outputs(known, rtol, wanted, callable(equation.period))


def shown(equation, points, guess, period, method, rtol, relax=True, wide=np.inf):
    """What is found (N) from guesses of the state (N, n) and of the period (N); see `newton.located`.

    Symmetric orbits whose multipliers' matrix has a relative bound above `wide` are shown again with
    FINER steps.
    """
    N = len(points)
    reach = _reach(rtol)
    found = OrbitResults(equation, N)
    orbits, good = located(equation, points, reach, guess, period, relax)
    _show(found, equation, points, orbits, good, method, reach)
    M, E = found.others.M[good], found.others.E[good]
    left = good[~found.good[good] | (E > wide * (1.0 + abs(M))).any(axis=(1, 2))]
    if equation.symmetry is not None and left.size:
        _show(found, equation, points, orbits, left, method, reach / FINER, finer=True)
    return found


def _show(found, equation, points, orbits, good, method, reach, finer=False):
    """Put the orbits, of the points `good`, that are shown to exist into `found`."""
    n = equation.n
    symmetry = equation.symmetry
    certified = (
        existence.certified if symmetry is None else partial(shooting.certified, symmetry=symmetry)
    )
    for inside, programs in equation.traced(points[good], orbits.guess[good]):
        own = good[inside]
        numbers = programs.numbers(points[own])
        if finer:
            span = equation.share * orbits.T[own]
            orbits.steps[own] = programs.flow(numbers, orbits.x[own], span, reach, derived=False)[3]
        ends = np.cumsum(orbits.steps[own]) * n * (ORDER + 1)
        cuts = np.searchsorted(ends, np.arange(CALL, ends[-1], CALL)) if own.size else []
        for some in np.split(np.arange(own.size), cuts):
            if some.size:
                those = own[some]
                plane = (orbits.phase[those], orbits.guess[those]) if equation.free else None
                near = (
                    programs,
                    chosen(numbers, some),
                    orbits.x[those],
                    equation.share * orbits.T[those],
                )
                if hasattr(method, "orbit_motion"):
                    shown = recomputed(*near, plane, orbits.steps[those], method, symmetry)
                else:
                    shown = certified(
                        *near, orbits.guess[those], plane, orbits.steps[those], method, reach
                    )
                found.write_at(those, shown)


def _reach(rtol):
    """The reach of the Taylor series, with which orbits are found for all methods."""
    return monodromy.method_of("auto").floquet_reach(rtol)


class OrbitResults:
    """The results of N points as they come in."""

    def __init__(self, equation, N):
        n, m = equation.n, equation.judged
        self.structure = "none" if equation.symmetry is None else "reversible"
        self.good, self.square = np.zeros(N, bool), np.full(N, np.nan)
        self.x, self.dx, self.T, self.dT = (
            np.full(shape, np.nan) for shape in ((N, n), (N, n), N, N)
        )
        self.M = np.full((N, 2, n, n), np.nan)
        self.others = monodromy.Matrices.empty(N, m)

    def write_at(self, points, shown):
        """Keep the ShownOrbits of these points."""
        to = points[shown.good]
        self.good[to] = True
        for name in ("x", "dx", "T", "dT", "square"):
            getattr(self, name)[to] = getattr(shown, name)[shown.good]
        self.M[to, 0], self.M[to, 1] = shown.M[shown.good], shown.dM[shown.good]
        self.others[to] = shown.others[shown.good]

    def outputs(self, known, rtol, wanted, computed):
        """The wanted outputs; `known`: the points that have a start and a period."""
        N = len(self.good)
        matrices = self.others
        answer = stability.assess(matrices, self.structure, rtol, wanted)
        answer.status[~self.good] = NO_ORBIT
        answer.status[~known] = status.INVALID_PARAMETERS
        answer.verdict[~self.good] = stability.UNDECIDED
        answer.crossing[~self.good] = stability.UNDECIDED
        out = stability.outputs(answer, matrices, self.T, computed, wanted)
        ok = answer.status == status.OK
        if "exponent" in wanted:
            with np.errstate(invalid="ignore"):
                out["exponent_error"] = (
                    out["exponent_error"] + abs(out["exponent"]) * 1.01 * self.dT / self.T
                )
        own = {"x0": self.x, "x0_error": self.dx, "period": self.T, "period_error": self.dT}
        own |= {"monodromy": self.M[:, 0], "monodromy_error": self.M[:, 1]}
        for name, values in own.items():
            if name.removesuffix("_error") in wanted:
                out[name] = np.where(ok.reshape(N, *[1] * (values.ndim - 1)), values, np.nan)
        return out
