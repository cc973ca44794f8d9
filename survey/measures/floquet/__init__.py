"""Linear periodic systems x' = A(t) x of n states: monodromy, multipliers, verdict.

METHODS lists what a method that serves the family "floquet", or "orbit" (periodic orbits of x' =
f(t, x)), offers. A step is taken over by its propagator F; steps of all points are tasks, in no
particular order. A and t have the units of the user's functions.
"""

from survey.contract import Function

METHODS = {
    "floquet": {
        "floquet_reach": Function(
            "how far the maximum norm of A times half the length of a step may go at first, for accuracy rtol",
            ("rtol",),
            needed=True,
        ),
        "floquet_factors": Function(
            "fill F (tasks, n, n), bounds `error` (tasks) of the sums of its errors in a row and `doubt` (tasks), how "
            "large these are relative to F; task k is the step of length 2 half[k] about middle[k] of point point[k]. "
            "The first six say how A is computed from numbers (N, count), see `kernels.floquet.program`; A_ij is taken "
            "times scale_j / scale_i, from scale (N, n), and `noise` (N) bounds the rounding of its rows. The default "
            "method is also asked for those of the steps backwards, which follow: then F has room for twice as many",
            ("operations", "signs", "inside", "order", "used", "terms", "numbers", "scale", "noise", "n", "point",
             "middle", "half", "F", "error", "doubt"),
            needed=True,
        ),
    }
}  # fmt: skip
# for the linear system along an orbit, whose series begin with its states
METHODS["orbit"] = METHODS["floquet"] | {
    "orbit_motion": Function(
        "instead of proofs: fill X (N, n), the states at span (N) from x0 (N, n) at 0, and M (N, n, n), their "
        "derivatives by x0, in `steps` (N) equal steps; the other arguments are as in `kernels.floquet.flow.flow`",
        (
            "operations",
            "signs",
            "inside",
            "order",
            "terms",
            "numbers",
            "states_at",
            "x0",
            "span",
            "steps",
            "X",
            "M",
        ),
    ),
}
