"""Nutations of an axisymmetric body: periods and advances, and their bifurcation set.

METHODS lists what a method that serves the family "nutation" offers. A well is a row (SIZE) of
`survey.kernels.nutation.wells`, of a kind from NUTATION on; rows of other kinds are left alone.
What is filled has the columns of `survey.kernels.nutation.records`. Times are in units of the
moment of inertia A, angles in radians.
"""

from survey.contract import Function

METHODS = {
    "nutation": {
        "nutation_periods": Function(
            "fill out (n, PERIODS) for wells `rows` (n, SIZE) of `kinds` (n): period, precession, spin less its drift, "
            "action, then their error bounds; `tolerance` is relative",
            ("rows", "kinds", "tolerance", "out"),
            needed=True,
        ),
        "nutation_motions": Function(
            "fill out (n, m, MOTION) at `times` (n, m): u, psi, phi less its drift, then their error bounds; `starts` "
            "(n, START) says where each motion starts, `periods` (n, PERIODS) is what `nutation_periods` gave",
            ("rows", "kinds", "starts", "periods", "times", "out"),
            needed=True,
        ),
    }
}
