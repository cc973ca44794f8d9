"""Hill's question: is y'' + z(t) y = 0, z of period T, stable?

METHODS lists what a method that serves the family "hill" offers. One that is adaptive gives the scene's own kernels
`hill_walk`; any other gives `hill_density`, NODES, `hill_chain` and `hill_scatter`.

The results of a point are the columns of `kernels.hill.answers`: the half-period factors, their bars, and the zeros of
y1 and y2. t is in the units of the period.
"""

from survey.contract import Function, Value

METHODS = {
    "hill": {
        "NODES": Value("fractions of a step at which z is sampled", tuple),
        "hill_density": Function(
            "steps per radian of the fastest phase and per distance to the nearest singularity, for accuracy rtol",
            ("rtol",),
        ),
        "hill_chain": Function(
            "fill out (points, 10): samples (rows, steps, 2, nodes), lengths h (rows, steps) of the steps, points "
            "order[starts[r]:ends[r]] of row r at p",
            ("samples", "c2", "h", "p", "order", "starts", "ends", "out"),
        ),
        "hill_scatter": Function(
            "as hill_chain, one point a row", ("samples", "c2", "h", "p", "order", "starts", "out")
        ),
        "hill_walk": Function(
            "integrate a point over `span` to `tolerance`; (z, size) = potential(t, p, row, table); False: step limit",
            ("potential", "p", "row", "table", "span", "tolerance", "out"),
        ),
        "hill_walk_pieces": Function(
            "as hill_walk, a step ending at each of `edges`, where z may jump; no step is longer than `longest`",
            ("potential", "p", "row", "table", "edges", "slack", "longest", "tolerance", "out"),
        ),
        "WIDTH": Value("number of rows of z's coefficients a step, for the charts", int),
        "hill_step": Function("P of one step and its local error bounds: what `hill_chain` composes", None),
    }
}
