"""The triangular libration points: Danby's map of the elliptic problem, normal forms of the
circular one, motions.

METHODS lists what a method offers that serves the family "danby" (the linear equations of the
elliptic problem over half a period) or "normal_form". For "danby" a method of fixed steps gives
`danby_steps`, NODES and `danby_chain`, an adaptive one `danby_walk`.

e (N) is the eccentricity, d1 and d2 (N) are the rates (3 / 2)(1 +- s) of the equations, mu (N) the
mass ratio. Results (N, RESULTS) have the columns A to T_BAR of `survey.kernels.libration.traces`.
Angles are in radians, all else has no unit.
"""

from survey import methods
from survey.contract import Function, Value

METHODS = {
    "danby": {
        "NODES": Value(
            "where in a step 1 / (1 + e cos f) is sampled: fractions of the step",
            tuple,
            needed=methods.fixed,
        ),
        "WIDTH": Value("for the charts: number of rows of the coefficients of a step", int),
        "danby_steps": Function(
            "numbers of steps (N) of half a period that are tried first for accuracy rtol",
            ("e", "rtol"),
            needed=methods.fixed,
        ),
        "danby_chain": Function(
            "fill out (N, RESULTS) for points of one mesh: h (steps) are the lengths of its steps, v (steps, NODES) is "
            "1 + cos f there; `kernels.libration.danby.chain` makes it of `danby_columns`",
            ("v", "h", "e", "d1", "d2", "out"),
            needed=methods.fixed,
        ),
        "danby_columns": Function(
            "for the charts: the columns of one step, of which `danby_chain` is composed",
            ("v", "h", "work", "count"),
        ),
        "danby_walk": Function(
            "fill out (N, RESULTS) with local errors below tolerance (N); NaN where the end is not reached",
            ("e", "d1", "d2", "tolerance", "out"),
            needed=methods.adaptive,
        ),
    },
    "normal_form": {
        "coefficients": Function(
            "(values, error bounds), both (rows, N): of the coefficients of orders 4 to `order` at mu, in the order of "
            "LABELS of `kernels.libration.coefficients`, or of its own `labels`",
            ("mu", "order"),
            needed=True,
        ),
        "combined": Function(
            "(values, error bounds), both (rows, N): all coefficients to order 6, then a20, a11, a02, D4, D6",
            ("mu",),
        ),
        "labels": Function(
            "[(i, j, k)] of the coefficients r1^i r2^j r3^k up to `order`, in their order",
            ("order",),
        ),
        "remainders": Function(
            "{(r, d): (values, error bounds) (2, 3, N)}: norms of what normalisation to degree r leaves in degree d",
            ("mu", "order"),
        ),
    },
}
