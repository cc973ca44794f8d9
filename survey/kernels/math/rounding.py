"""Error bars as they are stored: float32, rounded up."""

import numpy as np

from survey.kernels.jit import kernel, splice

TILE = 1024


@kernel
def round_up(bars, out):
    """Fill `out` (N, float32) with the bars (N, not negative), rounded up; returns whether one is infinite."""
    infinite = False
    for start in range(0, len(bars), TILE):
        kept = out[start : start + TILE]
        fill_up(bars[start : start + TILE], kept)
        for i in range(len(kept)):
            infinite |= kept[i] == np.inf
    return infinite


def rounded_up(bars):
    """The bars (any shape, not negative) as float32, rounded up."""
    bars = np.asarray(bars, dtype=float, order="C")
    out = np.empty(bars.shape, np.float32)
    round_up(bars.reshape(-1), out.reshape(-1))
    return out


@splice
def fill_up(bars, out):
    """Fill `out` (N, float32) with as many of the bars, rounded up."""
    bits = out.view(np.int32)
    for i in range(len(out)):
        out[i] = np.float32(bars[i])
    for i in range(len(out)):
        # the next float32 up: consecutive floats are consecutive integers
        bits[i] += np.int32(1) if out[i] < bars[i] else np.int32(0)
