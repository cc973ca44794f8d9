"""Nutations of an axisymmetric body: periods and advances, and their bifurcation set.

METHODS lists what a method that serves the family "nutation" offers. A well is a row of `kernels.nutation.wells`; times
are in units of the moment of inertia A, angles in radians.
"""

from survey.contract import Function

METHODS = {
    "nutation": {
        "nutation_periods": Function(
            "fill out (n, 8) for wells (n, SIZE) that are nutations: period, precession, spin, action, then their bars",
            ("rows", "kinds", "tolerance", "out"),
            needed=True,
        ),
        "nutation_motions": Function(
            "fill out (n, m, 6) at times (n, m): u, psi, phi less its drift, then their bars",
            ("rows", "kinds", "starts", "periods", "times", "out"),
            needed=True,
        ),
    }
}
