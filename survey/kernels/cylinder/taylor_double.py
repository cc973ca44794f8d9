"""Taylor series of order 30 in double-double arithmetic, for flows on the cylinder: what float64
leaves open.

About 30 digits, 20 to 40 microseconds a step. The measure uses it for points that miss the
requested accuracy, whose turning points stay uncounted, or whose fate float64 leaves open, as next
to separatrices. Compiled on first use.

Source: see `kernels.cylinder.flow_double`.
"""

import numpy as np

from survey.kernels.cylinder import flow_double
from survey.kernels.cylinder import records as rc

ORDER = 30
SERVES = ()  # a last resort, never a user's choice
FLOW_FINEST = 1.0  # nothing to refine
FLOW_WORK = 1


def flow_trajectories(P, starts, times, tolerance, limit, planes, turnings, status):
    """See `steps.trajectories`; tolerance and limit have no meaning here.

    One call per row, so that a run can be interrupted.
    """
    for i in range(len(P)):
        asked, floats = _asked(times[i]), np.full((planes.shape[2], len(planes)), np.nan)
        status[i] = flow_double.trajectory(
            P[i], starts[i, rc.START_PHI], starts[i, rc.START_W], asked, floats, turnings[i]
        )
        planes[:, i] = floats.T


def flow_abels(P, starts, targets, tolerance, limit, planes, status):
    """See `steps.abels`, and `flow_trajectories`."""
    for i in range(len(P)):
        floats = np.full((planes.shape[2], len(planes)), np.nan)
        flow_double.abel(
            P[i],
            starts[i, rc.START_PHI],
            starts[i, rc.START_W],
            _asked(targets[min(i, len(targets) - 1)]),
            floats,
            status[i],
        )
        planes[:, i] = floats.T


def _asked(row):
    """The numbers before the first infinity or NaN; not `steps.finite`, which would be compiled in
    each process.
    """
    return row[: np.argmin(np.append(np.isfinite(row), False))]
