"""Nutations between turning points: period, advances and action of each well, as arrays.

A method fills, for each well (a row of `kernels/nutation.py`), eight numbers: T/A, the precession, the spin less
a (1/C - 1/A) T, the action, and their bars.
"""

import numpy as np

from survey.kernels import nutation as nu

PERIOD, PRECESSION, SPIN, ACTION = range(4)
TRUST = 1e-3  # relative errors beyond are no errors of first order
UNDECIDED = -1
NAMES = ("u_min", "u_max", "period", "precession", "spin", "action")


def of_states(points):
    """rows (n, SIZE), kinds (n), numbers of wells (n) and heights (n, 3) of initial states (n, 7)."""
    n = len(points)
    rows, kinds, count = np.zeros((n, nu.SIZE)), np.zeros(n, np.int64), np.full(n, -1)
    heights = np.full((n, 3), np.nan)
    nu.of_states(np.ascontiguousarray(points), rows, kinds, count, heights)
    return rows, kinds, count, heights


def of_integrals(points, sign):
    """The same for (l, alpha, beta) (n, 3): rows (n, 2, SIZE), kinds (n, 2)."""
    n = len(points)
    rows, kinds, heights = np.zeros((n, 2, nu.SIZE)), np.zeros((n, 2), np.int64), np.full((n, 3), np.nan)
    nu.of_integrals(np.ascontiguousarray(points), float(sign), rows, kinds, heights)
    count = np.where((kinds == nu.SEPARATRIX).any(axis=1), -1, (kinds >= nu.NUTATION).sum(axis=1))
    return rows, kinds, count, heights


def solve(method, rows, kinds, inertia, drift, rtol):
    """{name: values, with bars} of wells (n, SIZE), NaN where there is no nutation, and their kinds as now known.

    `inertia` is A, and `drift` a (1/C - 1/A) with its relative error of a few roundings, for each well.
    """
    rows, kinds = np.ascontiguousarray(rows), np.ascontiguousarray(kinds)
    out = np.full((len(rows), 8), np.nan)
    method.nutation_periods(rows, kinds, rtol, out)
    turning = kinds >= nu.NUTATION
    values, bars = out[:, :4], out[:, 4:]
    period, bar = inertia * values[:, PERIOD], inertia * bars[:, PERIOD]
    bar = bar + 2.0 * nu.EPS * period
    spin = values[:, SPIN] + drift * period
    spin_bar = bars[:, SPIN] + np.abs(drift) * (bar + 8.0 * nu.EPS * period) + nu.EPS * np.abs(spin)
    found = {
        "u_min": (np.where(turning, rows[:, nu.LOW], np.nan), rows[:, nu.BAR_LOW]),
        "u_max": (np.where(turning, rows[:, nu.HIGH], np.nan), rows[:, nu.BAR_HIGH]),
        "period": (period, bar),
        "precession": (values[:, PRECESSION], bars[:, PRECESSION]),
        "spin": (spin, spin_bar),
        "action": (values[:, ACTION], bars[:, ACTION]),
    }
    good = turning & np.isfinite(out).all(axis=1) & (bar < TRUST * period)
    result = {}
    for name, (value, error) in found.items():
        result[name], result[f"{name}_error"] = np.where(good, value, np.nan), np.where(good, error, np.nan)
    return result, np.where(turning & ~good, nu.LOST, kinds)


def verdicts(rows, kinds):
    """The verdict of each well: its kind, and a regular precession also where the turning points' bars overlap."""
    one = (kinds == nu.NUTATION) & (rows[..., nu.WIDTH] <= rows[..., nu.BAR_LOW] + rows[..., nu.BAR_HIGH])
    return np.where(one, nu.PRECESSION, np.maximum(kinds, UNDECIDED))


def distance(heights):
    """(L - L of the separatrix)/|k| and its bar; NaN where there is no separatrix."""
    value = heights[:, 0] / heights[:, 2]
    bar = np.where(np.isfinite(value), heights[:, 1] / heights[:, 2] + 4.0 * nu.EPS * np.abs(value), np.nan)
    return np.where(np.isfinite(value), value, np.nan), bar
