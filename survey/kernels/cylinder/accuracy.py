"""Do all solutions meet the requested accuracy? One pass where numpy takes several."""

from survey.kernels.cylinder.records import PHI, PHI_BAR, W_BAR, W
from survey.kernels.cylinder.steps import OK, TURNING
from survey.kernels.jit import inline, kernel


@inline
def _within(bar, value, rtol):
    return bar <= rtol or bar <= rtol * (1.0 + abs(value))


@kernel
def all_within(points, status, rtol):
    """Has every point, a row of `points` (n, 4; see `records`), the status OK or TURNING, and bars
    of at most rtol (1 + |value|)?
    """
    for i in range(len(points)):
        if not (
            _within(points[i, PHI_BAR], points[i, PHI], rtol)
            and _within(points[i, W_BAR], points[i, W], rtol)
            and (status[i] == OK or status[i] == TURNING)
        ):
            return False
    return True
