"""Danby's map: the trace invariants a, b of the flow of `danby_flow`, and what its factors say of
verdicts.
"""

import numpy as np

from survey.truth import danby_flow, remembered
from survey.truth.danby_flow import A_DOUBT, B_DOUBT, COLUMNS, A, B

LONG = np.longdouble
ULP = float(np.finfo(LONG).eps)


def solved(mu, e, tolerance=danby_flow.TINY):
    mu, e = (np.ascontiguousarray(x, float) for x in np.broadcast_arrays(mu, e))

    def kernel(points, out):
        danby_flow.points(*(np.ascontiguousarray(x) for x in points.T), tolerance, out)

    points = np.column_stack([mu.ravel(), e.ravel()])
    return remembered(("danby", tolerance), kernel, points, COLUMNS)


def margins(out):
    """(A B, C D, K) times 16 and t, from the truth, with their doubts (long doubles)."""
    a, b = (out[:, column].astype(LONG) + out[:, column + 1] for column in (A, B))
    da, db = out[:, A_DOUBT], out[:, B_DOUBT]
    t, dt = (a + 4) / 4, da / 4
    ab = b + 2 * a + 2
    cd = b - 2 * a + 2
    k = a * a - 4 * b + 8
    size = np.abs(a) + np.abs(b) + 8
    return (
        (ab, db + 2 * da + 4 * ULP * size), (cd, db + 2 * da + 4 * ULP * size),
        (k, 4 * db + 2 * np.abs(a) * da + 16 * ULP * (size + a * a)), (t, dt + 4 * ULP * size),
    )  # fmt: skip


def truth(given, answer):
    ok = answer["status"] == 0
    mu, e = np.broadcast_arrays(given["mu"], given["e"])
    out = np.full((ok.size, COLUMNS), np.nan)
    out[ok] = solved(mu[ok], e[ok])
    (ab, dab), (cd, dcd), (k, dk), (t, dt) = margins(out)
    with np.errstate(invalid="ignore"):
        stable = (ab > dab) & (cd > dcd) & (k > dk) & (t > dt) & (t < 2 - dt)
        unstable = (ab < -dab) | (cd < -dcd) | (k < -dk) | (t < -dt) | (t > 2 + dt)
        unstable |= mu == 0
        stable &= mu > 0
        said, meeting = answer["verdict"], answer["collision"]
        off = k < -dk
        negative = (k > dk) & ((ab < -dab) | (t < -dt))
        expected = np.where(off, 2, np.where(negative, 1, -1))
        neither = (ab > dab) & (k > dk) & (t > dt)
    other = (expected >= 0) & (meeting >= 0) & (meeting != expected) | neither & unstable & (
        meeting > 0
    )
    wrong = {
        "verdict": ((said == 1) & unstable) | ((said == 0) & stable),
        "collision": (said == 0) & (mu > 0) & other,
    }
    return {
        "a": (out[:, A], out[:, A + 1], out[:, A_DOUBT]),
        "b": (out[:, B], out[:, B + 1], out[:, B_DOUBT]),
        "wrong": wrong,
    }
