"""Portraits of the flow phi' = w, w' = f w + g on the cylinder: what does not depend on the initial
state, in numbers.

Ends, equilibria and cycles are those of the skeleton that decides the fates (`fate`), with periods and speeds from
the return maps. Here the branches of the saddles are followed to their ends
(`destinations`): where no unstable one ends in a saddle there is no saddle connection.
"""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder import returns as rt
from survey.kernels.cylinder.flow import BOUND_DG, BOUND_F, OF_F
from survey.kernels.cylinder.program import COLUMNS, MEAN
from survey.kernels.cylinder.steps import TURNING
from survey.measures.cylinder import destinations, ends, solution
from survey.measures.cylinder.fate import (
    EXACT,
    I0,
    KINDS,
    MOST_OF_PROGRAM,
    NO_ENDS,
    G,
    outline,
    remembered,
    sizes,
)
from survey.status import NO_CONVERGENCE, OK

# Numbers that are kept: surveys of random points found at most 4 cycles, and g has at most 4 roots.
CYCLES = 8
EQUILIBRIA = eq.MOST
NONE, ROTATION_PLUS, ROTATION_MINUS, LIBRATION = range(4)
TOO_MANY, UNKNOWN_CYCLES = 20, 21  # as in the STATUS of scenes/gyrostat.py
UNDECIDED, DEGENERATE, STABLE = -1, 0, 1
COUNTS = ("equilibria", "saddles", "rotations_plus", "rotations_minus", "librations")
MEANS = ("mean_f", "mean_g")
ROUNDING = 4e-16  # of K and L, relative to the sizes of their terms
TINY = 1e-300


class ListedCycle(NamedTuple):
    """A cycle: number `at` of point `i`, of a kind, its row of `returns`, and its system."""

    i: int
    at: int
    kind: int
    row: np.ndarray
    skeleton: object
    system: np.ndarray


def empty(count, status, columns=0):
    """The outputs of `solve` for `count` rows of so many columns, filled with what does not apply."""
    own = columns > COLUMNS
    equilibria = MOST_OF_PROGRAM if own else EQUILIBRIA
    branches = equilibria, len(destinations.BRANCHES)
    floats = {"K": (), "L": (), "equilibrium_phi": (equilibria,)} | (
        dict.fromkeys(MEANS, ()) if own else {}
    )
    floats |= {f"cycle_{name}": (CYCLES,) for name in ("w", "multiplier", "period")}
    result = {
        name + end: np.full((count, *extra), np.nan)
        for name, extra in floats.items()
        for end in ("", "_error")
    }
    for name in ("stratum", "end_plus", "end_minus", *COUNTS, "verdict"):
        result[name] = np.full(count, -1, dtype=np.int64)
    for name, size in (("equilibrium_type", (equilibria,)), ("cycle_kind", (CYCLES,)), ("branch_end", branches),
                       ("branch_limit", branches)):  # fmt: skip
        result[name] = np.full((count, *size), NONE, dtype=np.int64)
    result["cycle_inside"] = np.full((count, CYCLES), -1, dtype=np.int64)
    return result | {"status": np.full(count, status, dtype=np.int64)}


def solve(method, systems, rtol, beside=None):
    """Every output for rows of six finite parameters, or of programs, for which K and L are those
    of `ends`.

    beside(i): the program of the same functions at parameters next to those of row i.
    """
    own = systems.shape[1] > COLUMNS
    result = empty(len(systems), OK, systems.shape[1])
    listed = []
    for i, six in enumerate(systems):
        s = outline(six)
        (_ends_of_program if own else _ends)(s, six, result, i)
        if not s.unknown:
            _rests(s, result, i)
        if own and s.stratum != G:
            result["verdict"][i], result["status"][i] = DEGENERATE, NO_ENDS
            continue
        if s.folded or any(_is_hopf(s, row) for row in s.equilibria):
            # then the error bounds leave open how many cycles there are
            result["verdict"][i], result["status"][i] = DEGENERATE, UNKNOWN_CYCLES
            continue
        s = remembered(method, six)
        for kind in KINDS:  # branches end in them; at a first use fates are compiled meanwhile
            s.cycles(kind)
        end, limit = destinations.table(method, s, rtol)
        result["branch_end"][i, : len(end)], result["branch_limit"][i, : len(end)] = end, limit
        neutral = _changes(s.p, beside(i)) if own else s.K == 0.0 and not _is_exact(s.p)
        result["verdict"][i] = _verdict(s, end, neutral)
        for name, table in zip(COUNTS[2:], (s.plus, s.minus, s.librations), strict=True):
            result[name][i] = len(table)
        cycles = [
            (kind, row)
            for kind, table in enumerate((s.plus, s.minus, s.librations), 1)
            for row in table
        ]
        if len(cycles) > CYCLES:
            result["verdict"][i], result["status"][i] = UNDECIDED, TOO_MANY
        listed += [ListedCycle(i, at, *cycle, s, six) for at, cycle in enumerate(cycles[:CYCLES])]
    for kinds, followed in (
        ((ROTATION_PLUS, ROTATION_MINUS), _rotations),
        ((LIBRATION,), _librations),
    ):
        some = [cycle for cycle in listed if cycle.kind in kinds]
        columns = np.array([_of_map(cycle) for cycle in some])
        for at in np.flatnonzero([not np.isfinite(row).all() for row in columns]):
            columns[at] = followed(method, [some[at]], rtol)
        _write(some, columns, result)
    return result


def _ends(s, six, result, i):
    """K, L, stratum and ends of point i."""
    for name, value, size in zip(("K", "L"), (s.K, s.L), sizes(*six), strict=True):
        bar = (ROUNDING + EXACT * (value == 0.0)) * size
        result[name][i], result[f"{name}_error"][i] = value, bar + TINY * (size > 0.0)
    result["stratum"][i] = s.stratum
    result["end_plus"][i], result["end_minus"][i] = s.ends + 1


def _ends_of_program(s, p, result, i):
    """As `_ends`, and the means of f and g."""
    known = ends.of(p)
    for name, value, bar in zip(
        (*MEANS, "K", "L"), (known.mean_f, known.mean_g, known.K, known.L), known.bars, strict=True
    ):
        result[name][i], result[f"{name}_error"][i] = value, bar
    result["stratum"][i] = s.stratum
    result["end_plus"][i], result["end_minus"][i] = s.ends + 1


def _rests(s, result, i):
    """Equilibria with their types, and their numbers, of point i; in the stratum I0 every angle is one."""
    kinds = s.equilibria[:, eq.KIND]
    if s.stratum != I0:
        result["equilibria"][i] = len(kinds)
        result["saddles"][i] = np.count_nonzero(kinds == eq.SADDLE)
    for at, row in enumerate(s.equilibria):
        result["equilibrium_phi"][i, at] = row[eq.ANGLE]
        result["equilibrium_phi_error"][i, at] = row[eq.BAR] + 1e-15
        result["equilibrium_type"][i, at] = _type(row)


def _type(row):
    """1 saddle, 2 to 7 node or focus: attracting, weak (f = 0 within the error bound), repelling; 8
    degenerate.
    """
    kind = int(row[eq.KIND])
    if kind in (eq.NODE, eq.FOCUS):
        return 3 + int(row[eq.STABLE]) + 3 * (kind == eq.FOCUS)
    return 1 if kind == eq.SADDLE else 8


def _changes(p, beside):
    """Is a number that does not decide the ends of the program p, since it is 0, another one beside it?

    A number that is 0 at all parameters, as the mean of cos phi, stays 0 when these change.
    """
    if p[MEAN] != 0.0:
        return False
    return not np.isfinite(beside).all() or ends.of(beside).decides < ends.of(p).decides


def _verdict(s, ends_of_branches, neutral):
    """Is the point structurally stable, by the error bounds? `neutral`: does a small change change what
    decides the ends?
    """
    scale = s.p[BOUND_F] + math.sqrt(s.p[BOUND_DG])
    doubtful = [row for row in s.librations if not _hyperbolic(row)]
    for cycles in (s.plus, s.minus):
        doubtful += [row for row in cycles if not (_hyperbolic(row) or _far(row, s.K, scale))]
    if (
        s.stratum != G
        or neutral
        or any(abs(row[rt.MULTIPLIER] - 1.0) <= row[rt.MULTIPLIER_BAR] for row in doubtful)
    ):
        return DEGENERATE
    saddles = np.count_nonzero(s.equilibria[:, eq.KIND] == eq.SADDLE)
    if doubtful or not s.conclusive or 2 * saddles != len(s.equilibria):
        return UNDECIDED
    # where a branch's end is open, a cycle beside it may have been lost: a stable one's in reversed
    # time
    return UNDECIDED if (ends_of_branches == destinations.UNDECIDED).any() else STABLE


def _is_exact(p):
    """Is K = b12 s3 - b31 s2 zero, and not only within its rounding?"""
    b12, b31, _d, _c23, s2, s3 = map(Fraction, p[: rc.SIX])
    return b12 * s3 == b31 * s2


def _is_hopf(s, row):
    """In stratum G, is f = g = 0 within its bound at an equilibrium that is not a saddle?"""
    return s.stratum == G and row[eq.KIND] != eq.SADDLE and row[eq.STABLE] == 0.0


def _hyperbolic(row):
    """Does the error bound of a cycle's multiplier keep off 1?"""
    return row[rt.CYCLE_CLASS] >= 0.0 and abs(row[rt.MULTIPLIER] - 1.0) > row[rt.MULTIPLIER_BAR]


def _far(row, K, scale):
    """Is a rotation so fast that D = pi K/w^2 + C3/w^3 + C4/w^4 shows it to be hyperbolic: D' = pi
    K/w^3?

    On 600 random systems |C4| < 0.21 scale^5.
    """
    w = row[rt.CYCLE_X]
    return (
        row[rt.CYCLE_CLASS] >= 0.0
        and w > 30.0 * scale
        and math.pi * abs(K) * w * w > 10.0 * scale**5
    )


def _of_map(cycle):
    """w, its bound, period, its bound of a cycle, as the return map gives them; infinite or NaN
    where it does not.
    """
    row, side = cycle.row, -1.0 if cycle.kind == ROTATION_MINUS else 1.0
    return side * row[rt.CYCLE_SPEED], *row[[rt.SPEED_BAR, rt.PERIOD, rt.PERIOD_BAR]]


def _rotations(method, cycles, rtol):
    """|w|, its bound, period, its bound of rotation cycles, in columns: w on the section, the
    period by one turn.
    """
    w, bar = np.array([[row[rt.CYCLE_X], row[rt.CYCLE_BAR]] for _, _, _, row, _, _ in cycles]).T
    side = np.array([1.0 if kind == ROTATION_PLUS else -1.0 for _, _, kind, _, _, _ in cycles])
    section = np.array([s.section for _, _, _, _, s, _ in cycles])
    six = np.array([six for *_, six in cycles])

    def period(x):
        rows = solution.rows(six, section, side * np.maximum(x, 0.0))
        floats, status = solution.abel(
            method, rows, (section + 2.0 * math.pi * side)[:, None], rtol
        )
        return np.where(status[:, 0] == OK, floats[:, 0, rc.TIME], np.nan), floats[
            :, 0, rc.TIME_BAR
        ]

    return np.column_stack([side * w, bar, *_within(period, w, bar)])


def _librations(method, cycles, rtol):
    """w > 0 at the equilibrium to the left of the right turning point, error bound, period, error
    bound, in columns.

    From the right turning point the cycle is followed to the left one forward in time, and backward
    (S1: b -> -b).
    """
    x, bar = np.array([[row[rt.CYCLE_X], row[rt.CYCLE_BAR]] for _, _, _, row, _, _ in cycles]).T
    rests = np.array([s.equilibria[int(row[rt.INTERVAL])] for _, _, _, row, s, _ in cycles])
    six = np.array([six for *_, six in cycles])
    angle = rests[:, eq.ANGLE]

    def half(x, b):
        rows = solution.rows(six, x, np.zeros(len(x)))
        rows[:, OF_F] *= b
        floats, status = solution.abel(
            method, rows, np.column_stack([angle, angle - 2.0 * math.pi]), rtol
        )
        met = (status[:, 0] == OK) & (status[:, 1] == TURNING)
        return np.where(met[:, None, None], floats, np.nan)

    def period(x):
        one, two = half(x, 1.0), half(x, -1.0)
        return one[:, 1, rc.TIME] + two[:, 1, rc.TIME], one[:, 1, rc.TIME_BAR] + two[
            :, 1, rc.TIME_BAR
        ]

    def passage(x):
        back = half(x, -1.0)
        return -back[:, 0, rc.VALUE], back[:, 0, rc.VALUE_BAR] + np.abs(rests[:, eq.F]) * rests[
            :, eq.BAR
        ]

    return np.column_stack([*_within(passage, x, bar), *_within(period, x, bar)])


def _within(function, x, bar):
    """Value and error bound of `function` (x -> value, error bound) at x known within `bar`."""
    (value, own), low, high = function(x), function(x - bar)[0], function(x + bar)[0]
    return value, 1.2 * np.maximum(np.abs(low - value), np.abs(high - value)) + 2.0 * own


def _write(cycles, columns, result):
    """Write |w|, period and multiplier of cycles; a cycle that could not be followed has no answer."""
    for (i, at, kind, row, _s, _six), (w, w_bar, period, period_bar) in zip(
        cycles, columns, strict=True
    ):
        result["cycle_kind"][i, at] = kind
        if kind == LIBRATION:
            result["cycle_inside"][i, at] = abs(row[rt.CYCLE_CLASS])
        values = (w, w_bar), (row[rt.MULTIPLIER], row[rt.MULTIPLIER_BAR]), (period, period_bar)
        for name, (value, bar) in zip(("w", "multiplier", "period"), values, strict=True):
            if math.isfinite(value) and math.isfinite(bar):
                result[f"cycle_{name}"][i, at], result[f"cycle_{name}_error"][i, at] = value, bar
            else:
                result["status"][i], result["verdict"][i] = NO_CONVERGENCE, UNDECIDED
