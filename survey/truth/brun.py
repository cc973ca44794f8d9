"""Brun's problem: trapezoidal sums in double-double, and elliptic integrals to DIGITS digits beside
separatrices.
"""

from math import pi

import numpy as np
from mpmath import mp

from survey.truth import brun_digits, remembered
from survey.truth import brun_sums as bs
from survey.truth.brun_digits import NAMES, OUTPUTS

SURE = 1e-20
NODES = 2048
DIGITS = 120
COLUMNS = (bs.U_MIN, bs.U_MAX, bs.PERIOD, bs.PRECESSION, bs.SPIN, bs.ACTION)  # of OUTPUTS
LOST = 0.1  # a truth with a larger doubt than this of itself knows no side of the separatrix


def _rows(out, answer):
    found = {}
    with np.errstate(all="ignore"):
        beside = out[..., bs.PERIOD_DOUBT]
        delay = beside * out[..., bs.PERIOD]
        turned = (
            2 * pi * beside
            + (np.abs(out[..., bs.PRECESSION]) + np.abs(out[..., bs.SPIN])) * beside
            + delay * out[..., bs.FASTEST]
        )
    more = {
        "u_min": out[..., bs.U_MIN_DOUBT],
        "u_max": out[..., bs.U_MAX_DOUBT],
        "period": delay,
        "precession": turned,
        "spin": turned,
    }
    for name, column in zip(OUTPUTS, COLUMNS, strict=True):
        value, low = out[..., column], out[..., column + 1]
        scale = np.abs(value)
        if name in ("u_min", "u_max"):
            scale = scale + 1
        if name in ("precession", "spin"):
            scale = scale + 2 * pi * (1 + np.abs(out[..., bs.PRECESSION]))
        if name == "action":  # of a narrow well
            half = (out[..., bs.U_MAX] - out[..., bs.U_MIN]) / 2
            scale = scale * (
                1 + (1e-11 if out.ndim == 3 else 1e-21) / half / np.where(out.ndim == 3, half, 1)
            )
        with np.errstate(invalid="ignore"):
            trusted = (
                np.abs(out[..., bs.APART]) < 1e-18
                if name not in ("u_min", "u_max", "period")
                else True
            )
        trusted = trusted & (beside < LOST)
        found[name] = np.where(trusted, value, np.nan), low, SURE * scale + more.get(name, 0.0)
    return found


def _in_full(point, ends):
    """The outputs at a state with DIGITS digits, from elliptic integrals, as `brun_sums.states`: it
    takes 0.1 s.

    `ends` are columns U_MIN and U_MAX of double-double, where Newton's method begins.
    """
    row = np.zeros(bs.COLUMNS)
    with mp.workdps(DIGITS):
        state = [mp.mpf(float(x)) for x in point]
        integrals = brun_digits.integrals(state)
        begin = [mp.mpf(ends[column]) + mp.mpf(ends[column + 1]) for column in (bs.U_MIN, bs.U_MAX)]
        turning = brun_digits.polished(integrals, begin)
        for column, true in zip(COLUMNS, brun_digits.outputs(integrals, turning), strict=True):
            row[column] = float(true)
            row[column + 1] = float(true - row[column])
    return row


def states(given, answer):
    points = np.ascontiguousarray(np.column_stack([given[name] for name in NAMES]))
    ok = answer["status"] == 0
    out = np.full((len(points), bs.COLUMNS), np.nan)
    out[ok] = remembered(
        "states", lambda p, rows: bs.states(p, NODES, rows), points[ok], bs.COLUMNS
    )
    with np.errstate(invalid="ignore"):
        beside = out[:, bs.PERIOD_DOUBT]
        vague = ok & (beside * out[:, bs.PERIOD] > answer["period_error"]) & (beside < LOST)
        vague = np.flatnonzero(vague & (given["p_theta0"] != 0))
    if len(vague):  # one of a batch in full
        out[vague[0]] = _in_full(points[vague[0]], out[vague[0]])
    width = answer["u_max"] - answer["u_min"]
    with np.errstate(invalid="ignore"):
        sure = out[:, bs.PERIOD_DOUBT] < LOST
        apart = sure & (
            (out[:, bs.U_MAX] - out[:, bs.U_MIN])
            > 2 * (answer["u_max_error"] + answer["u_min_error"]) + 1e-12
        )
        said = answer["verdict"]
        passes = (given["p_psi"] == given["p_phi"]) | (given["p_psi"] == -given["p_phi"])
        wrong = ((said == 2) & apart) | ((said == 3) & ~passes) | (ok & (width < 0))
    return _rows(out, answer) | {"wrong": {"verdict": wrong}}


def integrals(sign):
    def truth(given, answer):
        points = np.ascontiguousarray(
            np.column_stack([given[name] for name in ("l", "alpha", "beta")])
        )
        ok = answer["status"] == 0
        out = np.full((len(points), 2, bs.COLUMNS), np.nan)
        bs.integrals(
            points[ok], float(sign), float(np.ravel(given["ratio"])[0]), NODES, part := out[ok]
        )
        out[ok] = part
        wells = np.isfinite(out[..., bs.U_MIN]).sum(axis=1)
        # a well at a point, or a separatrix
        out[wells != np.isfinite(answer["u_min"]).sum(axis=1)] = np.nan
        with np.errstate(invalid="ignore"):
            wide = (out[..., bs.U_MAX] - out[..., bs.U_MIN]).min(axis=1) > 1e-6
            wrong = wide & (wells > 0) & (answer["wells"] >= 0) & (answer["wells"] < wells)
        return _rows(out, answer) | {"wrong": {"wells": wrong}}

    return truth
