"""Traces of monodromy matrices of Hill's equations with spikes, by a formula of order 8 in many
even steps.
"""

import numpy as np

from survey.kernels.math.dop853 import STAGES, A, B, C


def traces(z, points, period, steps):
    """Of y'' + z(u, points) y = 0, all points at once: the trace (N), and the size of its terms."""
    y, h = np.tile([1.0, 0.0, 0.0, 1.0], (len(points), 1)).T, period / steps
    slopes = np.empty((STAGES, *y.shape))
    for k in range(steps):
        for i in range(STAGES):
            state = y + h * np.tensordot(A[i, :i], slopes[:i], 1) if i else y
            slopes[i, ::2] = state[1::2]
            slopes[i, 1::2] = -z((k + C[i]) * h, points) * state[::2]
        y = y + h * np.tensordot(B[:STAGES], slopes, 1)
    return y[0] + y[3], abs(y).sum(axis=0)


def beyond(z, points, period, found, bar):
    """Which of the traces `found` (N) are off by more than their bars and what the truth itself may
    be off (N).
    """
    (trace, _), (finer, size) = (traces(z, points, period, steps) for steps in (512, 1024))
    doubt = abs(trace - finer) + 1e-12 * (1 + size)
    assert np.median(doubt / (1 + size)) < 1e-9
    return abs(found - finer) > bar + doubt
