"""The gyrostat's motions in time and over the angle: what the flow of `gyrostat_flow` makes of
their outputs.
"""

import numpy as np

from survey.truth import gyrostat_flow, remembered
from survey.truth.gyrostat_flow import (
    COLUMNS,
    END_PHI,
    END_W,
    GOAL,
    PHI0,
    TIME,
    TURNED,
    TURNINGS,
    VALUE,
    W0,
)

SYSTEM = ("b12", "b31", "d", "c23", "s2", "s3")
SURE = 1e-26  # of the truth, relative, where nothing grows


def _points(given, last, ok):
    return np.ascontiguousarray(
        np.column_stack([given[name] for name in (*SYSTEM, "phi0", "w0", last)])[ok]
    )


def _twice(kernel, points, said, bars, columns):
    """The truth, and where a bar seems to miss it, what another tolerance makes of it: (out, doubt
    per column).
    """
    out = _solved(kernel, points, gyrostat_flow.TINY)
    doubt = np.full((len(points), len(columns)), 0.0)
    for j, c in enumerate(columns):
        doubt[:, j] = SURE * (1 + np.abs(out[:, c]))
    with np.errstate(invalid="ignore"):
        suspicious = np.zeros(len(points), bool)
        for j, c in enumerate(columns):
            suspicious |= np.abs((said[j] - out[:, c]) - out[:, c + 1]) > 0.5 * bars[j]
    if suspicious.any():
        sharper = _solved(kernel, points[suspicious], 1e-30)
        for j, c in enumerate(columns):
            off = np.abs(
                (sharper[:, c] - out[suspicious, c]) + (sharper[:, c + 1] - out[suspicious, c + 1])
            )
            doubt[suspicious, j] += 100 * off
    return out, doubt


def _solved(kernel, points, tolerance):
    return remembered(
        (kernel.__name__, tolerance), lambda p, out: kernel(p, tolerance, out), points, COLUMNS
    )


def _spread(ok, values):
    wide = np.full(len(ok), np.nan)
    wide[ok] = values
    return wide


def flow(given, answer):
    ok = answer["status"] == 0
    points = _points(given, "t", ok)
    said, bars = ([answer[f"{name}{end}"][ok] for name in ("phi", "w")] for end in ("", "_error"))
    out, doubt = _twice(gyrostat_flow.flow, points, said, bars, (END_PHI, END_W))
    turns = answer["turnings"][ok]
    with np.errstate(invalid="ignore"):
        clear = (
            (out[:, TURNINGS] >= 0)
            & (np.abs(out[:, END_W]) > 2 * np.maximum(bars[1], 1e-25))
            & (points[:, W0] != 0)
        )
        wrong = np.zeros(len(ok), bool)
        wrong[ok] = clear & (turns >= 0) & (turns != out[:, TURNINGS])
    found = {"wrong": {"turnings": wrong}}
    for name, c, j in (("phi", END_PHI, 0), ("w", END_W, 1)):
        found[name] = tuple(_spread(ok, x) for x in (out[:, c], out[:, c + 1], doubt[:, j]))
    return found


def along(given, answer):
    status = answer["status"]
    turned = np.isfinite(answer["phi_turning"])
    ok = (status == 0) | turned
    points = _points(given, "phi", ok)
    pick = [
        np.where(turned, answer[a], answer[b])[ok]
        for a, b in (("phi_turning", "w"), ("t_turning", "t"))
    ]
    bars = [
        np.where(turned, answer[a + "_error"], answer[b + "_error"])[ok]
        for a, b in (("phi_turning", "w"), ("t_turning", "t"))
    ]
    out, doubt = _twice(gyrostat_flow.along, points, pick, bars, (VALUE, TIME))
    with np.errstate(invalid="ignore"):
        apart = np.abs(given["phi"] - answer["phi_turning"]) > answer["phi_turning_error"]
    early = turned[ok] & (out[:, TURNED] == 0) & ~apart[ok]
    if early.any():  # within its bar: held against the turning point beyond
        further = points[early]
        further[:, GOAL] += np.sign(further[:, GOAL] - further[:, PHI0])
        found = [part[early] for part in (*pick, *bars)]
        out[early], doubt[early] = _twice(
            gyrostat_flow.along, further, found[:2], found[2:], (VALUE, TIME)
        )
    true = _spread(ok, out[:, TURNED])
    wrong = ((status == 0) & (true == 1)) | (turned & (true == 0))
    found = {"wrong": {"turning": wrong}}
    for names, here in ((("w", "t"), true == 0), (("phi_turning", "t_turning"), true == 1)):
        for name, c, j in zip(names, (VALUE, TIME), (0, 1), strict=True):
            value = _spread(ok, out[:, c])
            low = _spread(ok, out[:, c + 1])
            d = _spread(ok, doubt[:, j])
            said = np.isfinite(answer[name])
            found[name] = np.where(here & said, value, np.nan), low, d
    return found
