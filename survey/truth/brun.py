"""Brun's problem: trapezoidal sums in double-double, and elliptic integrals to DIGITS digits beside
separatrices.
"""

from math import pi

import numpy as np
from mpmath import mp

from survey.truth import brun_digits, brun_sums, remembered

NAMES = ("A", "C", "epsilon", "theta0", "p_theta0", "p_psi", "p_phi")
OUTPUTS = ("u_min", "u_max", "period", "precession", "spin", "action")
SURE = 1e-20
NODES = 2048
DIGITS = 120
LOST = 0.1  # a truth with a larger doubt than this of itself knows no side of the separatrix


def _rows(out, answer):
    found = {}
    with np.errstate(all="ignore"):
        beside = out[..., 13]
        delay = beside * out[..., 4]
        turned = (
            2 * pi * beside
            + (np.abs(out[..., 6]) + np.abs(out[..., 8])) * beside
            + delay * out[..., 16]
        )
    more = {
        "u_min": out[..., 14],
        "u_max": out[..., 15],
        "period": delay,
        "precession": turned,
        "spin": turned,
    }
    for i, name in enumerate(OUTPUTS):
        value, low = out[..., 2 * i], out[..., 2 * i + 1]
        scale = np.abs(value)
        if name in ("u_min", "u_max"):
            scale = scale + 1
        if name in ("precession", "spin"):
            scale = scale + 2 * pi * (1 + np.abs(out[..., 6]))
        if name == "action":  # of a narrow well
            half = (out[..., 2] - out[..., 0]) / 2
            scale = scale * (
                1 + (1e-11 if out.ndim == 3 else 1e-21) / half / np.where(out.ndim == 3, half, 1)
            )
        with np.errstate(invalid="ignore"):
            trusted = (
                np.abs(out[..., 12]) < 1e-18 if name not in ("u_min", "u_max", "period") else True
            )
        trusted = trusted & (beside < LOST)
        found[name] = np.where(trusted, value, np.nan), low, SURE * scale + more.get(name, 0.0)
    return found


def _in_full(point, ends):
    """The outputs at a state with DIGITS digits, from elliptic integrals, as `brun_sums.states`: it
    takes 0.1 s.

    `ends` are the turning points of double-double, u_min (high, low), u_max (high, low), where
    Newton's method begins.
    """
    row = np.zeros(brun_sums.COLUMNS)
    with mp.workdps(DIGITS):
        state = [mp.mpf(float(x)) for x in point]
        integrals = brun_digits.integrals(state)
        turning = brun_digits.polished(
            integrals, [mp.mpf(ends[0]) + mp.mpf(ends[1]), mp.mpf(ends[2]) + mp.mpf(ends[3])]
        )
        for i, true in enumerate(brun_digits.outputs(integrals, turning)):
            row[2 * i] = float(true)
            row[2 * i + 1] = float(true - row[2 * i])
    return row


def states(given, answer):
    points = np.ascontiguousarray(np.column_stack([given[name] for name in NAMES]))
    ok = answer["status"] == 0
    out = np.full((len(points), brun_sums.COLUMNS), np.nan)
    out[ok] = remembered(
        "states", lambda p, rows: brun_sums.states(p, NODES, rows), points[ok], brun_sums.COLUMNS
    )
    with np.errstate(invalid="ignore"):
        vague = ok & (out[:, 13] * out[:, 4] > answer["period_error"]) & (out[:, 13] < LOST)
        vague = np.flatnonzero(vague & (given["p_theta0"] != 0))
    if len(vague):  # one of a batch in full
        out[vague[0]] = _in_full(points[vague[0]], out[vague[0], :4])
    width = answer["u_max"] - answer["u_min"]
    with np.errstate(invalid="ignore"):
        sure = out[:, 13] < LOST
        apart = sure & (
            (out[:, 2] - out[:, 0]) > 2 * (answer["u_max_error"] + answer["u_min_error"]) + 1e-12
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
        out = np.full((len(points), 2, brun_sums.COLUMNS), np.nan)
        brun_sums.integrals(
            points[ok], float(sign), float(np.ravel(given["ratio"])[0]), NODES, part := out[ok]
        )
        out[ok] = part
        wells = np.isfinite(out[..., 0]).sum(axis=1)
        # a well at a point, or a separatrix
        out[wells != np.isfinite(answer["u_min"]).sum(axis=1)] = np.nan
        with np.errstate(invalid="ignore"):
            wide = (out[..., 2] - out[..., 0]).min(axis=1) > 1e-6
            wrong = wide & (wells > 0) & (answer["wells"] >= 0) & (answer["wells"] < wells)
        return _rows(out, answer) | {"wrong": {"wells": wrong}}

    return truth
