"""Twist determinants of the frequency map of a nutation, of KAM theory, and how a well's row gives
them.

H is a function of the actions J, p_psi and p_phi. Perturbations that keep p_psi, as A != B does,
leave two degrees of freedom, J and p_phi: there the determinant of the second derivatives of H must
not be zero for most tori to survive (Kolmogorov), or that bordered by the frequencies for most of
those on each level of energy (Arnold). Under others the same is asked of all three.

Source: V. I. Arnold, V. V. Kozlov, A. I. Neishtadt, Mathematical Aspects of Classical and Celestial
Mechanics, 6.3.
"""

import numpy as np

from survey.kernels.nutation import twist
from survey.kernels.nutation import wells as nu

_KEPT, _ALL = "under perturbations that keep p_psi", "under any perturbation"
NAMES = {
    "kam_determinant": (f"Kolmogorov's twist determinant {_KEPT}", r"\det H''", twist.KAM),
    "isoenergetic_determinant": (
        f"isoenergetic twist determinant {_KEPT}",
        r"\det\hat H''",
        twist.ISOENERGETIC,
    ),
    "kam_determinant_3": (f"Kolmogorov's twist determinant {_ALL}", r"\det H''_3", twist.KAM_3),
    "isoenergetic_determinant_3": (
        f"isoenergetic twist determinant {_ALL}",
        r"\det\hat H''_3",
        twist.ISOENERGETIC_3,
    ),
}


def determinants(rows, kinds, sizes, wanted):
    """{name: (values, bars)} (n) of those `wanted`, of wells of these kinds; sizes: A, C and p_phi
    (n) of each.
    """
    wanted = [name for name in NAMES if name in wanted]
    if not wanted:
        return {}
    found = np.full((len(rows), 2, twist.TWISTS), np.nan)
    turning = kinds >= nu.NUTATION
    some = np.empty((np.count_nonzero(turning), 2, twist.TWISTS))
    twist.twists(rows[turning], np.column_stack(sizes)[turning], some)
    found[turning] = np.where(np.isfinite(some).all(axis=1, keepdims=True), some, np.nan)
    return {name: (found[:, 0, NAMES[name][2]], found[:, 1, NAMES[name][2]]) for name in wanted}
