"""Which solutions miss the requested accuracy? One pass where numpy takes several."""

from survey.kernels.cylinder.steps import OK, TURNING
from survey.kernels.jit import kernel

CHUNK = 512  # points at a time: vector code is made only of slices whose beginnings are known


@kernel
def note_missed(values, bars, status, rtol, out):
    """Set `out` (n) to True at the points (n each) whose status is not OK or TURNING, or whose bar is not at
    most rtol (1 + |value|); elsewhere it stays.
    """
    for first in range(0, len(status), CHUNK):
        last = min(first + CHUNK, len(status))
        codes, some, own = status[first:last], values[first:last], bars[first:last]
        missed = out[first:last]
        for i in range(last - first):
            good = own[i] <= rtol * (1.0 + abs(some[i]))
            missed[i] |= not (good & ((codes[i] == OK) | (codes[i] == TURNING)))
