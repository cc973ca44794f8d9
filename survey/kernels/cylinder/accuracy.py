"""Do all solutions meet the requested accuracy? One pass where numpy takes several."""

import numpy as np

from survey.kernels.cylinder.records import PHI, PHI_BAR, W_BAR, W
from survey.kernels.cylinder.steps import OK, TURNING
from survey.kernels.jit import inline, kernel

CHUNK = 512  # points: all of them are compared, several at a time, before any is asked for


@inline
def _within(bar, value, rtol):
    return bar <= rtol * (1.0 + abs(value))


@kernel
def all_within(planes, status, rtol):
    """Has every point, a column of `planes` (4, n; see `records`), the status OK or TURNING, and bars
    of at most rtol (1 + |value|)?
    """
    for first in range(0, len(status), CHUNK):
        last = min(first + CHUNK, len(status))
        # slices whose beginnings are known: else no vector code
        codes, one, two = status[first:last], planes[PHI, first:last], planes[W, first:last]
        bars, others = planes[PHI_BAR, first:last], planes[W_BAR, first:last]
        met = 0
        for i in range(last - first):
            good = _within(bars[i], one[i], rtol) & _within(others[i], two[i], rtol)
            met += np.int64(good & ((codes[i] == OK) | (codes[i] == TURNING)))
        if met < last - first:
            return False
    return True
