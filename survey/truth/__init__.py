"""Truths: the outputs of every family to some 30 digits, by formulas and arithmetic that the
kernels do not use.

The attack on error bars, the failure maps and the tests hold answers against them. A truth is a
function of the parameters {name: array (N)} and of the answer {output: array (N, ...)}:

    truth(given, answer)    {output: (value, low, doubt)}, arrays that broadcast to the output: the truth is value + low
                            to within `doubt`, NaN where nothing is known; and "wrong": {what: mask
                            (N)}, what the answer says that cannot be (optional)

    hill, own       Taylor series in double-double (Duffing's equation for satellites); closed forms of pieces
    danby           the same, in the eccentric anomaly
    gyrostat        the same, in time, with exact scaling
    brun            trapezoidal sums in double-double; elliptic integrals to 120 digits beside separatrices
    libration       closed forms to 60 digits (their integers are the package's)
    digits          a user's own file: its z with mpmath's numbers, by extrapolation
"""

from contextlib import contextmanager

import numpy as np

_KEPT = []


@contextmanager
def kept():
    """Within it no point is solved twice: several methods are held against the same truth."""
    _KEPT.append({})
    try:
        yield
    finally:
        _KEPT.pop()


def distance(said, value, low, doubt):
    """(how far an answer lies from a truth, whether that is known, what of it exceeds the truth's doubt)."""
    off = np.abs((said - value) - low).astype(float)
    known = np.isfinite(off) & np.isfinite(np.broadcast_to(np.asarray(doubt, float), off.shape))
    return off, known, np.where(known, np.maximum(off - doubt, 0.0), 0.0)


def remembered(name, kernel, points, columns):
    """The rows (N, columns) that kernel(points, out) fills for points (N, n); `name` tells kernels apart."""
    points = np.ascontiguousarray(points, float)
    rows = _KEPT[-1] if _KEPT else {}
    keys = [(name, point.tobytes()) for point in points]
    new = [i for i, key in enumerate(keys) if key not in rows]
    out = np.full((len(new), columns), np.nan)
    if new:
        kernel(points[new], out)
    rows |= {keys[i]: row for i, row in zip(new, out, strict=True)}
    return np.array([rows[key] for key in keys]).reshape(len(points), columns)
