"""Error bars as they are stored: float32, rounded up."""

import numpy as np

from survey.kernels.jit import kernel

TILE = 1024


@kernel
def round_up(bars, out):
    """Fill `out` (N, float32) with the bars (N, not negative), rounded up; returns whether one is infinite."""
    bits = out.view(np.int32)
    infinite = False
    for start in range(0, len(bars), TILE):
        own, kept = bars[start : start + TILE], out[start : start + TILE]
        up = bits[start : start + TILE]
        for i in range(len(own)):
            kept[i] = np.float32(own[i])
        for i in range(len(own)):
            # the next float32 up: consecutive floats are consecutive integers
            up[i] += np.int32(1) if kept[i] < own[i] else np.int32(0)
        for i in range(len(own)):
            infinite |= kept[i] == np.inf
    return infinite
