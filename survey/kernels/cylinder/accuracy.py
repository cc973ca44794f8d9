"""Do all solutions meet the requested accuracy? One pass where numpy takes several."""

import numpy as np

from survey.kernels.cylinder.steps import OK, TURNING
from survey.kernels.jit import kernel

CHUNK = 512  # points: all of them are compared, several at a time, before any is asked for


@kernel
def all_within(values, bars, status, rtol):
    """Has every point (n each) the status OK or TURNING, and a bar of at most rtol (1 + |value|)?"""
    for first in range(0, len(status), CHUNK):
        last = min(first + CHUNK, len(status))
        # slices whose beginnings are known: else no vector code
        codes, some, own = status[first:last], values[first:last], bars[first:last]
        met = 0
        for i in range(last - first):
            good = own[i] <= rtol * (1.0 + abs(some[i]))
            met += np.int64(good & ((codes[i] == OK) | (codes[i] == TURNING)))
        if met < last - first:
            return False
    return True
