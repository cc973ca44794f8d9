"""The rays of L = N = 0 (3.11), and the determinants of N that KAM theory asks for, each with its
error bound.

r3 = omega2 r2 - omega1 r1 on L = 0; N = 0 there is a20 r1^2 + a11 r1 r2 + a02 r2^2 = 0, whose roots
are alpha_1, alpha_2 = (-a11 +- sqrt(a11^2 - 4 a20 a02)) / (2 a20) (3.11): rays r = (alpha_j, 1,
beta_j), beta_j = omega2 - alpha_j omega1. The discriminant is the determinant of N'' bordered by
the frequencies (Arnold's).

A quantity is a pair (value, bound), arrays.
"""

import numpy as np

from survey.kernels.libration.closed_forms import MARGIN
from survey.kernels.libration.coefficients import LABELS
from survey.kernels.math.roundoff import ROUNDOFF

RAYS = ("alpha", "beta")  # (N, 2)
FLOATS = ("discriminant", "det_N", "det_bordered")


def answers(c, combined, omega):
    """{output and its `_error`: values} from the coefficients (2, 16, N), COMBINED (2, 5, N) and
    frequencies (2, N).
    """
    a20, a11, a02 = ((combined[0, i], combined[1, i]) for i in range(3))
    w1, w2 = ((w, ROUNDOFF * w) for w in omega)
    with np.errstate(all="ignore"):
        square = _plus(_times(a11, a11), _scaled(-4.0, _times(a20, a02)))
        alpha = _roots(a20, a11, a02, square)
        beta = [_plus(w2, _scaled(-1.0, _times(x, w1))) for x in alpha]
        found = {"discriminant": square, "det_N": _determinant(c), "det_bordered": square}
    out = {}
    for name, (value, bar) in found.items():
        out[name], out[f"{name}_error"] = value, MARGIN * bar
    for name, both in zip(RAYS, (alpha, beta), strict=True):
        value, bar = (np.stack(part, axis=-1) for part in zip(*both, strict=True))
        known = np.isfinite(value) & np.isfinite(bar)
        out[name] = np.where(known, value, np.nan)
        out[f"{name}_error"] = np.where(known, MARGIN * bar, np.nan)
    return out


def _roots(a20, a11, a02, square):
    """alpha_1 and alpha_2, by the formula of each in which nothing cancels; no number where its
    divisor may be 0.
    """
    root = np.sqrt(square[0])
    root = root, 0.5 * square[1] / root + ROUNDOFF * root
    falling = a11[0] <= 0.0
    size = _plus(tuple(np.where(falling, -1.0, 1.0) * part for part in (a11[0], a11[1])), root)
    size = size[0], abs(size[1])  # |a11| + root
    outer, inner = _over(size, _scaled(2.0, a20)), _over(_scaled(2.0, a02), size)
    sign = np.where(falling, 1.0, -1.0)
    outer, inner = (sign * outer[0], outer[1]), (sign * inner[0], inner[1])
    return [
        tuple(np.where(falling, a, b) for a, b in zip(*both, strict=True))
        for both in ((outer, inner), (inner, outer))
    ]  # fmt: skip


def _determinant(c):
    """det N'' of the 3 x 3 matrix of second derivatives by the actions."""
    n = {name: (c[0, i], c[1, i]) for i, name in enumerate(LABELS[:6])}
    aa, bb, cc = (_scaled(2.0, n[name]) for name in ("200", "020", "002"))
    ab, ac, bc = n["110"], n["101"], n["011"]
    minors = (
        _times(aa, _minus(_times(bb, cc), _times(bc, bc))),
        _scaled(-1.0, _times(ab, _minus(_times(ab, cc), _times(bc, ac)))),
        _times(ac, _minus(_times(ab, bc), _times(bb, ac))),
    )
    return _plus(_plus(minors[0], minors[1]), minors[2])


def _times(x, y):
    value = x[0] * y[0]
    return value, abs(x[0]) * y[1] + abs(y[0]) * x[1] + x[1] * y[1] + ROUNDOFF * abs(value)


def _plus(x, y):
    value = x[0] + y[0]
    return value, abs(x[1]) + abs(y[1]) + ROUNDOFF * abs(value)


def _minus(x, y):
    return _plus(x, _scaled(-1.0, y))


def _scaled(factor, x):
    """By a power of two or its negative: exact."""
    return factor * x[0], abs(factor) * x[1]


def _over(x, y):
    value, room = x[0] / y[0], abs(y[0]) - y[1]
    bar = np.where(room > 0.0, (x[1] + abs(value) * y[1]) / room + ROUNDOFF * abs(value), np.nan)
    return value, bar
