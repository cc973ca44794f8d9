"""The triangular libration points: Danby's map of the elliptic problem, normal forms of the
circular one, motions.

METHODS lists what a method offers that serves the family "danby" (the linear equations of the
elliptic problem, as a member of the family "floquet") or "normal_form".

mu (N) is the mass ratio. Results (N, RESULTS) have the columns A to T_BAR of
`survey.kernels.libration.traces`. Angles are in radians, all else has no unit.
"""

from survey.contract import Function
from survey.measures import floquet

METHODS = {
    "danby": floquet.METHODS["floquet"],
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
