"""Flows on the cylinder, phi' = w, w' = f(phi) w + g(phi): solutions, fates, portraits.

METHODS lists what a method that serves the family "cylinder" (the gyrostat) or "abel" (a user's f
and g) offers; one that answers only some questions says so in WHEN, and leaves out what the others
need. A method that has one step is made complete by `survey.kernels.cylinder`: `steps`, `returns`
and `fate` take its `flow_setting`, `flow_begin` and `flow_at`.

P (rows, 10) holds the columns B12 to BOUND_DDG of `survey.kernels.cylinder.flow`, p is one row of it; `starts`
(rows, 2) holds phi0 and w0. `tolerance` bounds the truncation error of one step (of phi, and of w relative to 1 + |w|),
`limit` is a budget of steps. The columns of `floats`, of starts with error bounds and of fates are those of `records`
in `survey.kernels.cylinder`; the tables of equilibria and of cycles are described in `equilibria` and `returns` there,
the codes of `status` in `steps`. phi is in radians; t and w are in the units of the parameters.
"""

from survey.contract import Function, Value

METHODS = {
    "cylinder": {
        "FLOW_FINEST": Value("the least tolerance of one step that is of use", float, needed=True),
        "FLOW_BOUNDS": Value(
            "do `flow_trajectories` and `flow_abels` bound a user's f and g as they go, so that no step passes a "
            "spike? False if not given",
            bool,
        ),
        "FLOW_UNCOUNTED": Value(
            "may `turnings` of `flow_trajectories` have no columns if they are not wanted? False if not given",
            bool,
        ),
        "FLOW_WORK": Value(
            "how many steps it takes where Taylor's method of order 20 takes one", int, needed=True
        ),
        "flow_trajectories": Function(
            "fill planes (STATE: PHI to W_BAR, rows, n), turnings (rows, n; UNDETERMINED if unknown) and status (rows) "
            "at ascending times (rows, n) >= 0, a row of which may end in infinities",
            ("P", "starts", "times", "tolerance", "limit", "planes", "turnings", "status"),
            needed=True,
        ),
        "flow_turnings": Function(
            "fill turnings (rows, n) where they are UNDETERMINED, also far into a focus",
            ("P", "starts", "times", "tolerance", "limit", "turnings"),
        ),
        "flow_abels": Function(
            "fill planes (STATE: VALUE to TIME_BAR, rows, n, NaN where nothing is known) and status (rows, n; zeros "
            "when called) at ascending targets (rows or 1, n), phi >= phi0, for w0 >= 0",
            ("P", "starts", "targets", "tolerance", "limit", "planes", "status"),
        ),
        "flow_abels_untimed": Function(
            "the same without times, whose planes may hold anything where that saves time",
            ("P", "starts", "targets", "tolerance", "limit", "planes", "status"),
        ),
        "flow_trajectories_ahead": Function(
            "compile `flow_trajectories` for `own` functions, while another process compiles what they need besides",
            ("own",),
        ),
        "flow_abels_ahead": Function(
            "compile some of what `flow_abels` calls, for `own` functions or for the gyrostat, while another process "
            "compiles the rest",
            ("own",),
        ),
        "flow_image": Function(
            "fill `node` with the image of x under one return map, see `kernels.cylinder.returns.image`",
            ("kind", "p", "eqs", "count", "anchor", "x", "tolerance", "node"),
        ),
        "flow_borders": Function(
            "fill `out` with places where a return map ends, see `kernels.cylinder.borders.borders`",
            ("kind", "p", "eqs", "count", "section", "tolerance", "out"),
        ),
        "flow_cycles": Function(
            "append the fixed points of a return map to `cycles`, see `fixed_points_of` in `kernels.cylinder.returns`",
            (
                "kind",
                "p",
                "eqs",
                "count",
                "anchor",
                "interval",
                "xs",
                "guesses",
                "tolerance",
                "cycles",
                "found",
                "edges",
            ),
        ),
        "flow_fates": Function(
            "fill out (rows, FATE) for initial states, see `kernels.cylinder.fate.fates`",
            (
                "p",
                "section",
                "ends",
                "sizes",
                "eqs",
                "plus",
                "minus",
                "lib",
                "starts",
                "tolerance",
                "limit",
                "out",
            ),
        ),
        "flow_line": Function(
            "fill out (m, POINT) with the points of a branch or a cycle in a window, see `kernels.cylinder.lines.line`",
            ("p", "start", "window", "eqs", "count", "section", "kind", "tolerance", "out"),
        ),
        "flow_pieces": Function(
            "fill out (m, PIECE) with the pieces of a branch or a cycle, see `kernels.cylinder.basins.pieces`",
            (
                "p",
                "start",
                "edges",
                "falls",
                "eqs",
                "count",
                "kind",
                "cell",
                "top",
                "scale",
                "tolerance",
                "most",
                "out",
            ),
        ),
        "flow_connections": Function(
            "fill out (rows, 4, 2, ROW) with branches of the saddles, see `kernels.cylinder.connections.connections`",
            ("P", "wanted", "tolerance", "cut", "out"),
        ),
        "flow_setting": Function(
            "what controls the steps of one solution", ("p", "w", "tolerance")
        ),
        "flow_begin": Function(
            "expand at (phi, w) into the table T of `kernels.cylinder.flow`, controlled by `flow_setting`; returns the "
            "length of the step",
            None,
        ),
        "flow_at": Function(
            "(phi, w, integral of f, integral of g) at dt after the start of the step in T",
            ("p", "T", "dt"),
        ),
    }
}
# Flows of one's own, whose rows of P go on (see `survey.kernels.cylinder.program`), take the same
# from a method.
METHODS["abel"] = METHODS["cylinder"]
