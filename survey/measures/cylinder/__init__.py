"""Flows on the cylinder, phi' = w, w' = f(phi) w + g(phi): solutions, fates, portraits.

METHODS lists what a method that serves the family "cylinder" offers; one that answers some questions only says so in
WHEN. P (rows, 10) holds the coefficients of `kernels.cylinder.flow`; `starts` (rows, 2) holds phi0 and w0; `tolerance`
bounds the truncation of one step; `limit` is a budget of steps. phi is in radians; t and w are in the parameters'
units.
"""

from survey.contract import Function, Value

METHODS = {
    "cylinder": {
        "FLOW_FINEST": Value("the least tolerance of one step that is of use", float, needed=True),
        "FLOW_WORK": Value("how many steps it takes where Taylor's method of order 20 takes one", int, needed=True),
        "flow_trajectories": Function(
            "fill floats (rows, n, 4: phi, w, bars), turnings (rows, n) and status (rows) at ascending times >= 0",
            ("P", "starts", "times", "tolerance", "limit", "floats", "turnings", "status"),
            needed=True,
        ),
        "flow_turnings": Function(
            "fill turnings (rows, n) where they are untold, also far into a focus",
            ("P", "starts", "times", "tolerance", "limit", "turnings"),
        ),
        "flow_abels": Function(
            "fill floats (rows, n, 4: w, t, bars) and status (rows, n) at ascending targets phi >= phi0, for w0 >= 0",
            ("P", "starts", "targets", "tolerance", "limit", "floats", "status"),
        ),
        "flow_image": Function(
            "one return map at x, see `kernels.cylinder.returns.image`",
            ("kind", "p", "eqs", "count", "anchor", "x", "tolerance", "node"),
        ),
        "flow_cycles": Function(
            "fixed points of a return map, see `kernels.cylinder.returns.fixed_points`",
            ("kind", "p", "eqs", "count", "anchor", "interval", "xs", "tolerance", "cycles", "found", "edges"),
        ),
        "flow_fates": Function(
            "fates of initial states, see `kernels.cylinder.fate.fates`",
            ("p", "section", "ends", "sizes", "eqs", "plus", "minus", "lib", "starts", "tolerance", "limit", "out"),
        ),
        "flow_setting": Function("what controls the steps of one solution", None),
        "flow_begin": Function("expand at (phi, w); returns the step", None),
        "flow_at": Function("(phi, w, integral of f, integral of g) at dt after the start of the step", None),
    }
}
