"""A whole gyrostat, six equations: its motions, and what the invariant set of its rotation about an
axis holds.

The reduced flow on the set is one on the cylinder, so a method of the family "body" offers what one
of "cylinder" does, and the motions of the whole body besides. G (rows, ROWS, 3) holds the systems as
in `kernels.cylinder.gyrostat`, in the body's own axes; the columns of `floats` are w, nu and their
error bounds.
"""

from survey.contract import Function
from survey.measures import cylinder

METHODS = {
    "body": cylinder.METHODS["cylinder"]
    | {
        "body_trajectories": Function(
            "fill floats (rows, n, 12) and status (rows) at ascending times (rows, n) >= 0, a row of which may end in "
            "infinities, from `starts` (rows, 6)",
            ("G", "starts", "times", "tolerance", "limit", "floats", "status"),
            needed=True,
        )
    }
}
