"""The triangular libration points: Danby's map of the elliptic problem, normal forms of the circular one, motions.

METHODS lists what a method offers that serves the family "danby" (the linear equations of the elliptic problem over
half a period; an adaptive one gives `danby_walk`, any other `danby_steps`, NODES and `danby_chain`) or "normal_form".
"""

from survey.contract import Function, Value

METHODS = {
    "danby": {
        "NODES": Value("fractions of a step at which 1 / (1 + e cos f) is sampled", tuple),
        "WIDTH": Value("number of rows of the coefficients of a step, for the charts", int),
        "danby_steps": Function(
            "number of steps of half a period for accuracy rtol, at eccentricities e", ("e", "rtol")
        ),
        "danby_chain": Function(
            "fill out (n, 10) for points of one mesh, see `kernels.libration.danby.chain`",
            ("v", "h", "e", "d1", "d2", "out"),
        ),
        "danby_columns": Function("the columns of one step: what `danby_chain` composes", None),
        "danby_walk": Function(
            "fill out (n, 10) for points with a tolerance each", ("e", "d1", "d2", "tolerance", "out")
        ),
    },
    "normal_form": {
        "coefficients": Function(
            "values and bars (rows, N) of the coefficients of orders 4 to `order` at mu (N)",
            ("mu", "order"),
            needed=True,
        ),
        "combined": Function("all coefficients, then a20, a11, a02, D4, D6, each with its bar, at mu (N)", ("mu",)),
        "labels": Function("the exponents of the coefficients up to `order`", ("order",)),
        "remainders": Function("norms of what normalisation leaves, by degree", ("mu", "order")),
    },
}
