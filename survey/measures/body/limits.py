"""The limits of motions and the portraits on the invariant set of a whole body, and whether they
can be observed there.

A limit of the reduced flow is stable on the set where the flow attracts (or, in an integrable
stratum, keeps neighbouring motions); it is observable where deviations from the set do not grow
along it either.
"""

import math
from dataclasses import replace

import numpy as np

from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import fate as kf
from survey.kernels.cylinder import returns as rt
from survey.measures.body import rests, transversal
from survey.measures.body.system import CASE_B, VERTICAL
from survey.measures.body.transversal import NOTHING, STABLE, UNDECIDED, UNSTABLE
from survey.measures.cylinder import fate, portrait
from survey.status import OK

# of (reduced, observable); a limit unstable on the set: 0
VERDICT = {(STABLE, STABLE): 2, (STABLE, UNSTABLE): 1}
# the fate of a steady rotation about the vertical, beside those of `kernels.cylinder.fate`
UNIFORM = 10
_KEPT = (kf.PERIODIC_ROTATION, kf.PERIODIC_LIBRATION)


def verdict(reduced, beside):
    """-1 undecided, 0 unstable on the set, 1 stable there but not observable, 2 observable."""
    return 0 if reduced == UNSTABLE else VERDICT.get((reduced, beside), UNDECIDED)


def of_fate(method, placed, rtol):
    """The fate of the reduced motion of a PlacedBody (not OFF), as in `measures.cylinder.fate`; its
    transversal stability.

    (result {name: array (1)}, reduced stability, TransversalStability).
    """
    result = fate.empty(1, OK)
    if placed.case == VERTICAL:
        b = placed.system
        result["verdict"][0], result["turnings"][0] = UNIFORM, 0
        return result, STABLE, transversal.steady(b, b.w, b.nu)
    start = np.array([[placed.phi0, placed.w0]])
    fate.solve(method, placed.six, start, rtol, result, np.array([0]))
    for name in ("limit_phi", "limit_w", "multiplier"):
        result[f"{name}_error"] *= placed.widening
    code = int(result["verdict"][0])
    s = fate.remembered(method, placed.six)
    if code in (kf.EQUILIBRIUM, kf.EQUILIBRIUM_START, kf.SADDLE):
        phi, bar = result["limit_phi"][0], result["limit_phi_error"][0]
        return result, _rest_of(s, phi, bar), transversal.at_rest(placed, phi, bar)
    if code in (kf.SPIN_UP_PLUS, kf.SPIN_UP_MINUS):
        return result, STABLE, replace(NOTHING, stable=transversal.fast(placed))
    if code in _KEPT:
        return (
            result,
            STABLE,
            transversal.along(placed, (*start[0], 0.0, 0.0), code == kf.PERIODIC_ROTATION),
        )
    if code == kf.LIBRATION:
        row = _row(s.librations, result["limit_phi"][0])
    elif code in (kf.ROTATION_PLUS, kf.ROTATION_MINUS):
        row = _row(s.plus if code == kf.ROTATION_PLUS else s.minus, abs(result["limit_w"][0]))
    else:
        return result, UNDECIDED, NOTHING
    return result, _of_cycle(row), _along(placed, s, row, code)


def _row(table, x):
    """The cycle at x."""
    return table[np.argmin(np.abs(table[:, rt.CYCLE_X] - x))]


def _of_cycle(row):
    """Is a cycle stable on the set?"""
    if abs(row[rt.MULTIPLIER] - 1.0) <= row[rt.MULTIPLIER_BAR] or row[rt.CYCLE_CLASS] < 0.0:
        return UNDECIDED
    return STABLE if row[rt.MULTIPLIER] < 1.0 else UNSTABLE


def _along(placed, s, row, code):
    """Beside a cycle; `code` is that of the fate that leads to it."""
    x, bar = row[rt.CYCLE_X], row[rt.CYCLE_BAR] * placed.widening
    if code == kf.LIBRATION:
        return transversal.along(placed, (x, 0.0, bar, 0.0), False)
    return transversal.along(
        placed, (s.section, x if code == kf.ROTATION_PLUS else -x, 0.0, bar), True
    )


def _rest_of(s, phi, bar):
    """Is the equilibrium at phi stable on the set?"""
    b12, b31, *_rest = s.p
    if s.stratum == fate.I0:  # one of a line of them
        f, width = b12 * math.cos(phi) - b31 * math.sin(phi), math.hypot(b12, b31) * (bar + 1e-15)
        return UNDECIDED if abs(f) <= width else STABLE if f < 0.0 else UNSTABLE
    away = np.abs((s.equilibria[:, eq.ANGLE] - phi + math.pi) % (2.0 * math.pi) - math.pi)
    return _of_row(s, s.equilibria[np.argmin(away)])


def _of_row(s, row):
    """Is the equilibrium of a row stable on the set? Where b = 0 a centre is, by its energy."""
    if row[eq.KIND] == eq.DEGENERATE:
        return UNDECIDED
    if row[eq.KIND] == eq.SADDLE:
        return UNSTABLE
    if s.stratum == fate.I1:
        return STABLE
    return {-1.0: STABLE, 0.0: UNDECIDED, 1.0: UNSTABLE}[float(np.sign(row[eq.STABLE]))]


def reduced_exponents(row):
    """Both exponents of an equilibrium of the reduced flow, x^2 - f x - g' = 0, and their bars."""
    f, dg, bar = row[eq.F], row[eq.DG], row[eq.BAR]
    size = 1.0 + abs(f) + math.sqrt(abs(dg))
    return transversal.quadratic(f, -dg, size * (bar + 4e-16), size * size * 4.0 * (bar + 4e-16))


def of_portrait(method, placed, rtol):
    """({name: array} of `measures.cylinder.portrait` for one system, equilibria and cycles with
    what is beside them).

    Equilibria and cycles are lists of (reduced stability, TransversalStability), in the order of the portrait's;
    for an equilibrium its reduced exponents and their bars come before.
    """
    result = portrait.solve(method, placed.six[None], rtol)
    for name in ("equilibrium_phi", "cycle_w", "cycle_multiplier", "cycle_period"):
        result[f"{name}_error"] *= placed.widening
    outline = fate.outline(placed.six)
    at_rest = [
        (*reduced_exponents(row), _of_row(outline, row),
         transversal.at_rest(placed, row[eq.ANGLE], (row[eq.BAR] + 1e-15) * placed.widening))
        for row in outline.equilibria
    ]  # fmt: skip
    cycles = []
    if (result["cycle_kind"] != portrait.NONE).any():
        s = fate.remembered(method, placed.six)
        tables = (
            (kf.ROTATION_PLUS, s.plus),
            (kf.ROTATION_MINUS, s.minus),
            (kf.LIBRATION, s.librations),
        )
        cycles = [
            (_of_cycle(row), _along(placed, s, row, code))
            for code, table in tables
            for row in table
        ]
    return result, at_rest, cycles[: portrait.CYCLES]


def at_rests(placed):
    """[(nu, bar, TransversalStability)] of the positions of rest, in the frame of `placed`; None if they cannot
    be found.
    """
    found = rests.find(placed.system)
    if found is None:
        return None
    rows = zip(*found, strict=True)
    return [
        (nu, bar, transversal.steady(placed.system, np.zeros(3), nu, 20.0 * bar))
        for nu, bar in rows
    ]


def has_portrait(placed):
    """Only in case B are there isolated equilibria and cycles."""
    return placed.case == CASE_B
