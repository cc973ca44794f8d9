"""A step of Danby's equations by DOP853 rounds within what its bar counts: against the same tableau
in wider floats.
"""

import numpy as np
import pytest

from survey.kernels.libration import danby
from survey.kernels.math.dop853 import STAGES, A, B, C
from survey.measures.libration.danby import rates
from survey.methods import dop853

# far below the rounding of a step, so that the column's bar is that of its rounding
TOLERANCE = 1e-15
WIDE = np.longdouble


def taken(e, d1, d2):
    """The steps of a point in float64: their angles, lengths, columns (4, 4) and bars (4)."""
    work, slopes, state = np.empty((danby.OWN, 1)), np.empty((STAGES, 16)), np.empty(16)
    angle, h, found = 0.0, 0.1 * np.sqrt(1 - e), []
    while angle + 1.01 * h < np.pi:
        error = dop853._danby_step(e, d1, d2, angle, h, slopes, state, work)
        if error <= TOLERANCE:
            columns = work[danby.COLUMNS : danby.COLUMNS + 4 * danby.COLUMN, 0].reshape(
                4, danby.COLUMN
            )
            found.append((angle, h, columns[:, :4].copy(), columns[:, 8].copy()))
            angle += h
        h *= min(5.0, max(0.2, 0.9 * (TOLERANCE / (error + 1e-300)) ** 0.125))
    return found


def exactly(e, d1, d2, angle, h):
    """The columns (4, 4) of the same step in wide floats."""
    e, d1, d2, angle, h = map(WIDE, (e, d1, d2, angle, h))
    slopes, scale = np.zeros((STAGES, 4, 4), WIDE), np.sqrt((1 - e) * (1 + e))
    for i in range(STAGES):
        state = np.eye(4, dtype=WIDE) + sum(
            (h * WIDE(A[i, j]) * slopes[j] for j in range(i)), WIDE(0)
        )
        small = np.sin((angle + WIDE(C[i]) * h) / 2)
        turn = scale / ((1 - e) + 2 * e * small * small)
        x, q, p, m = state.T
        slopes[i] = np.array([turn * (p - m), -turn * (p - m) - d2 / scale * m,
                              d1 / scale * x - turn * (x - q), turn * (x - q)]).T  # fmt: skip
    return np.eye(4, dtype=WIDE) + h * sum(
        WIDE(b) * slope for b, slope in zip(B[:STAGES], slopes, strict=True)
    )


@pytest.mark.skipif(np.finfo(WIDE).eps > 1e-18, reason="long double is float64 here")
@pytest.mark.parametrize("e", [0.0, 0.5, 0.99, 1 - 1e-6])
def test_roundings_of_a_step_lie_within_its_bar(e):
    """Near e = 1 the slopes are large: a bar of four roundings of the columns alone was up to nine
    times too small.
    """
    d1, d2 = (float(d[0]) for d in rates(np.array([0.4])))
    worst = 0.0
    for angle, h, columns, bars in taken(e, d1, d2)[::3]:
        off = abs(columns - exactly(e, d1, d2, angle, h)).max(axis=1)
        worst = max(worst, float((off / bars).max()))
    assert 0.02 < worst <= 1
