"""Hill's question: is y'' + z(t) y = 0, z of period T, stable?

METHODS lists what a method that serves the family "hill" offers. A method of fixed steps gives
`hill_density`, NODES, `hill_chain` and `hill_scatter`; an adaptive one gives `hill_walk` and
`hill_walk_pieces`, from which the scenes make their own kernels.

z = c0(t) + p c1(t) + p^2 c2, c2 a number; a row of points shares c0 and c1, and p varies along it.
What a method gives of a point are the columns RESULTS of `survey.kernels.lanes`: both solutions and
their derivatives at the end of the half period, their error bounds, and the zeros of y1 and y2 on
the way. t is in the unit of the period, z in its inverse square. `survey.kernels.lanes.chain` and
`scatter` make `hill_chain` and `hill_scatter` of one step.
"""

from survey import methods
from survey.contract import Function, Value

METHODS = {
    "hill": {
        "NODES": Value(
            "where in a step z is sampled: fractions of the step", tuple, needed=methods.fixed
        ),
        "hill_density": Function(
            "(steps per radian of the fastest phase, steps per distance to the nearest singularity of z): so many are "
            "tried first for accuracy rtol",
            ("rtol",),
            needed=methods.fixed,
        ),
        "hill_chain": Function(
            "fill out (N, RESULTS) at the points p (N) of rows of equal numbers of steps; row r owns the points "
            "order[starts[r] : ends[r]], samples (rows, steps, 2, NODES) holds its c0 and c1, h (rows, steps) the "
            "lengths of its steps",
            ("samples", "c2", "h", "p", "order", "starts", "ends", "out"),
            needed=methods.fixed,
        ),
        "hill_scatter": Function(
            "as hill_chain, where row r owns the one point order[starts[r]]; the same bits",
            ("samples", "c2", "h", "p", "order", "starts", "out"),
            needed=methods.fixed,
        ),
        "hill_walk": Function(
            "fill out (RESULTS) of one point from 0 to `span` with local errors below `tolerance`; returns False at "
            "the step limit; potential(t, p, row, table) gives (z, size of the terms whose sum z is)",
            ("potential", "p", "row", "table", "span", "tolerance", "out"),
            needed=methods.adaptive,
        ),
        "hill_walk_pieces": Function(
            "as hill_walk, from the first to the last of `edges`, between which z may jump: a step ends at each, z is "
            "asked for no nearer to one than `slack`, and no step is longer than `longest`",
            ("potential", "p", "row", "table", "edges", "slack", "longest", "tolerance", "out"),
            needed=methods.adaptive,
        ),
        "WIDTH": Value("for the charts: numbers that each of c0, c1 is reduced to per step", int),
        "hill_step": Function(
            "for the charts: the propagator (4 numbers) of one step and its local error bounds (3), of which "
            "`hill_chain` is composed",
            None,
        ),
    }
}
