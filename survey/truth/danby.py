"""Danby's map: the trace invariants a, b of the flow of `danby_flow`, and what its factors say of
verdicts.
"""

import numpy as np

from survey.truth import danby_flow, remembered

LONG = np.longdouble
ULP = float(np.finfo(LONG).eps)


def solved(mu, e, tolerance=danby_flow.TINY):
    mu, e = (np.ascontiguousarray(x, float) for x in np.broadcast_arrays(mu, e))

    def kernel(points, out):
        danby_flow.points(*(np.ascontiguousarray(x) for x in points.T), tolerance, out)

    return remembered(("danby", tolerance), kernel, np.column_stack([mu.ravel(), e.ravel()]), 7)


def margins(out):
    """(A B, C D, K) times 16 and t, from the truth, with their doubts (long doubles)."""
    a, b = out[:, 0].astype(LONG) + out[:, 1], out[:, 2].astype(LONG) + out[:, 3]
    da, db = out[:, 4], out[:, 5]
    t, dt = (a + 4) / 4, da / 4
    ab, cd, k = b + 2 * a + 2, b - 2 * a + 2, a * a - 4 * b + 8
    size = np.abs(a) + np.abs(b) + 8
    return (
        (ab, db + 2 * da + 4 * ULP * size), (cd, db + 2 * da + 4 * ULP * size),
        (k, 4 * db + 2 * np.abs(a) * da + 16 * ULP * (size + a * a)), (t, dt + 4 * ULP * size),
    )  # fmt: skip


def truth(given, answer):
    ok = answer["status"] == 0
    mu, e = np.broadcast_arrays(given["mu"], given["e"])
    out = np.full((ok.size, 7), np.nan)
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
        "a": (out[:, 0], out[:, 1], out[:, 4]),
        "b": (out[:, 2], out[:, 3], out[:, 5]),
        "wrong": wrong,
    }
