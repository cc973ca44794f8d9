"""Taylor series of order 30 in double-double arithmetic, for flows on the cylinder: what float64 leaves open.

About 30 digits, 20 to 40 microseconds a step. The measure asks it for points that miss the asked accuracy, whose
turning points are not told, or whose fate float64 leaves open, as next to separatrices. Compiled when first asked.

Source: see `kernels.cylinder.flow_double`.
"""

from survey.kernels.cylinder import flow_double
from survey.kernels.cylinder.steps import finite

ORDER = 30
SERVES = ()  # a last resort, never a user's choice
FLOW_FINEST = 1.0  # nothing to refine
FLOW_WORK = 1


def flow_trajectories(P, starts, times, tolerance, limit, floats, turnings, status):
    """See `steps.trajectories`; tolerance and limit have no meaning here. One call a row, to be stopped in time."""
    for i in range(len(P)):
        asked = times[i, : finite(times[i])]
        status[i] = flow_double.trajectory(P[i], starts[i, 0], starts[i, 1], asked, floats[i], turnings[i])


def flow_abels(P, starts, targets, tolerance, limit, floats, status):
    """See `steps.abels`; likewise."""
    for i in range(len(P)):
        asked = targets[i, : finite(targets[i])]
        flow_double.abel(P[i], starts[i, 0], starts[i, 1], asked, floats[i], status[i])
