"""Nutations between turning points: period, advances and action of each well, as arrays.

A method fills, for each well (a row of `kernels.nutation.wells`), the periods' columns of
`kernels.nutation.records`, and from these, at given times, those of a motion.
"""

import numpy as np

from survey import waiting
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import brun, brun_lanes
from survey.kernels.nutation import records as rc
from survey.kernels.nutation import wells as nu
from survey.kernels.nutation.lanes import NAMES, OUTPUTS

TRUST = 0.03  # relative errors beyond are no errors of first order
UNDECIDED = -1
NO_MOTION = 16  # the status of integrals without a motion
HARMLESS = (1.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0)  # a state, in the place of those outside the domain
FAR = 1e38  # distances in units of |k| beyond this only say that there is next to no field


def of_states(points):
    """rows (n, SIZE), kinds (n), numbers of wells (n), heights (n, HEIGHT), starts (n, START) of
    states (n, STATE).
    """
    n = len(points)
    rows = np.zeros((n, nu.SIZE))
    kinds = np.zeros(n, np.int64)
    count = np.full(n, -1)
    heights = np.full((n, rc.HEIGHT), np.nan)
    starts = np.zeros((n, rc.START))
    brun.of_states(np.ascontiguousarray(points), rows, kinds, count, heights, starts)
    return rows, kinds, count, heights, starts


def of_integrals(points, sign):
    """The same but starts for scaled integrals (n, INTEGRALS): rows (n, 2, SIZE), kinds (n, 2)."""
    n = len(points)
    rows = np.zeros((n, 2, nu.SIZE))
    kinds = np.zeros((n, 2), np.int64)
    heights = np.full((n, rc.HEIGHT), np.nan)
    brun.of_integrals(np.ascontiguousarray(points), float(sign), rows, kinds, heights)
    count = np.where((kinds == nu.SEPARATRIX).any(axis=1), -1, (kinds >= nu.NUTATION).sum(axis=1))
    return rows, kinds, count, heights


def in_lanes(kernel, points, names):
    """Values and bounds (OUTPUTS, n) of `points`, a tuple of STATE arrays (n), numbers of wells
    (n), who is answered (n): see `brun_lanes`.

    names: what is wanted, those of NAMES among it; other rows hold anything.
    """
    n = len(points[0])
    out, wells, done = np.empty((OUTPUTS, n)), np.empty(n), np.empty(n)
    if waiting.other_compiler:
        brun_lanes.compile_some(kernel)
        waiting.wait("lanes")
    kept = np.array([name in names for name in NAMES] * 2)
    kernel(points, "action" in names, kept, out, wells, done)
    return out, wells, done == brun_lanes.DONE


def named(values, names):
    """{name: values, name_error: error bounds} of the answers of `in_lanes`."""
    rows = zip((*NAMES, *(f"{name}_error" for name in NAMES)), values, strict=True)
    return {name: row for name, row in rows if name.removesuffix("_error") in names}


def compile_periods(method):
    """Compile what `periods` calls, while another process compiles what finds the wells."""
    if waiting.other_compiler:
        periods(method, np.empty((0, nu.SIZE)), np.empty(0, np.int64), 1e-6)
        waiting.wait("wells")


def periods(method, rows, kinds, rtol):
    """Periods (n, PERIODS) of the wells, NaN where there is no nutation, and the kinds, LOST where
    there should be one.

    An error is trusted as one of first order only where it is small.
    """
    rows, kinds = np.ascontiguousarray(rows), np.ascontiguousarray(kinds)
    out = np.full((len(rows), rc.PERIODS), np.nan)
    method.nutation_periods(rows, kinds, rtol, out)
    turning = kinds >= nu.NUTATION
    good = (
        turning & np.isfinite(out).all(axis=1) & (out[:, rc.PERIOD_BAR] < TRUST * out[:, rc.PERIOD])
    )
    out[~good] = np.nan
    return out, np.where(turning & ~good, nu.LOST, kinds)


def outputs(rows, out, inertia, drift):
    """{name: values, name_error: bounds} of wells from `periods`; inertia is A, drift a (1/C - 1/A)
    to 8 roundings.
    """
    good = np.isfinite(out[:, rc.PERIOD])
    period = inertia * out[:, rc.PERIOD]
    bar = inertia * out[:, rc.PERIOD_BAR] + 2.0 * ROUNDOFF * period
    spin = out[:, rc.SPIN] + drift * period
    spin_bar = (
        out[:, rc.SPIN_BAR]
        + np.abs(drift) * (bar + 8.0 * ROUNDOFF * period)
        + ROUNDOFF * np.abs(spin)
    )
    found = {
        "u_min": (rows[:, nu.LOW], rows[:, nu.BAR_LOW]),
        "u_max": (rows[:, nu.HIGH], rows[:, nu.BAR_HIGH]),
        "period": (period, bar),
        "precession": (out[:, rc.PRECESSION], out[:, rc.PRECESSION_BAR]),
        "spin": (spin, spin_bar),
        "action": (out[:, rc.ACTION], out[:, rc.ACTION_BAR] + _smallest(rows)),
    }
    return _named(found, good)


def _smallest(rows):
    """What the action of a regular precession may be, by the error bounds of its turning points; 0
    of other wells.
    """
    wide = np.where(rows[:, nu.WIDTH] == 0.0, rows[:, nu.BAR_LOW] + rows[:, nu.BAR_HIGH], 0.0)
    near = np.minimum(rows[:, nu.HIGH_PLUS], rows[:, nu.LOW_MINUS])
    steep = np.sqrt(np.maximum(np.maximum(rows[:, nu.Q_LOW], rows[:, nu.Q_HIGH]), 0.0))
    return steep * wide * np.minimum(1.0, wide / np.maximum(near, nu.TINY))


def _named(found, good):
    result = {}
    for name, (value, error) in found.items():
        result[name] = np.where(good, value, np.nan)
        result[f"{name}_error"] = np.where(good, error, np.nan)
    return result


def motions(method, rows, kinds, starts, out, times, inertia, drift):
    """{name: values, name_error: error bounds} of u, psi and phi at `times` (n, m)."""
    here = np.full((*times.shape, rc.MOTION), np.nan)
    rows, kinds = np.ascontiguousarray(rows), np.ascontiguousarray(kinds)
    method.nutation_motions(rows, kinds, starts, out, times / inertia[:, None], here)
    turned = drift[:, None] * times
    phi = here[..., rc.PHI] + turned
    bar = here[..., rc.PHI_BAR] + 12.0 * ROUNDOFF * np.abs(turned) + ROUNDOFF * np.abs(phi)
    found = {
        "u": (here[..., rc.U], here[..., rc.U_BAR]),
        "psi": (here[..., rc.PSI], here[..., rc.PSI_BAR]),
        "phi": (phi, bar),
    }
    good = np.isfinite(here).all(axis=-1)
    return _named(found, good)


def verdicts(rows, kinds):
    """The verdict of each well: its kind, and a regular precession also where the well's width is
    within its bound.
    """
    one = (kinds == nu.NUTATION) & (rows[..., nu.NOISE_WIDTH] >= 1.0)
    return np.where(one, nu.PRECESSION, np.maximum(kinds, UNDECIDED))


def heights(kernel, points):
    """Heights (n, HEIGHT) of points (STATE, n), columns of `kernels.nutation.records`."""
    found = np.empty((points.shape[1], rc.HEIGHT))
    kernel(points, found)
    return found


def distance(heights):
    """The output of that name: (L - L of the separatrix)/|k|, and its bound; NaN where there is none, or FAR away.

    An infinite error bound is left beside NaN where it is in doubt whether there is one.
    """
    with np.errstate(divide="ignore", invalid="ignore"):  # k = 0 has no separatrix
        value = heights[:, rc.ABOVE] / heights[:, rc.FIELD]
        bar = heights[:, rc.ABOVE_BAR] / heights[:, rc.FIELD] + 4.0 * ROUNDOFF * np.abs(value)
    near = np.abs(value) < FAR
    return {
        "separatrix_distance": np.where(near, value, np.nan),
        "separatrix_distance_error": np.where(
            near, bar, np.where(np.isinf(heights[:, rc.ABOVE_BAR]), np.inf, np.nan)
        ),
    }
