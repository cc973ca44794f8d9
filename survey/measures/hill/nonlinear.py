"""Nonlinear stability of a satellite's planar motions where linear motion across the plane is
stable.

With the spin's integral the body has two degrees of freedom, so that Arnold's and Moser's theorem
holds on every level of energy: where the twist of the isoenergetic map is not 0, closed curves
about the motion bound all that starts near it. The map is odd in the angle from the plane: it has
no terms of order 2, and third-order resonance no effect; at that of order 4 the twist must outweigh
the resonant term.

Source: C. L. Siegel, J. K. Moser, Lectures on Celestial Mechanics (1971), 32, 34;
`scenes/satellite.md`.
"""

import numpy as np

from survey.kernels.hill import twist
from survey.kernels.hill.answers import STABLE, UNSTABLE
from survey.scene import Output

LARGEST = 1e3  # of |rho| and k: motions are followed, step by step
FLAGS = {"undecided": -1, "unstable": 0, "orbitally_stable": 1, "resonance": 2}
_APPLIES = "where the verdict is stable, k > 0, |rho| and k are at most 1000, and float64 leaves some digits certain"
OUTPUTS = (
    Output("twist", "twist at constant energy: angle per period by action", r"\tau", on_request=True,
           applies=f"{_APPLIES}: the action is that across the plane, over I omega_p"),
    Output("twist_resonant", "resonant term of order 4, to compare with the twist", r"\sigma", on_request=True,
           applies=f"{_APPLIES}; it has an effect only next to D = 0"),
    Output("verdict_nonlinear", "orbital stability by the normal form of order 4", flags=FLAGS, on_request=True,
           applies="resonance: D = 0 within its error bar, with a resonant term that may outweigh the twist"),
)  # fmt: skip
NAMES = {output.name for output in OUTPUTS}


def solve(row, rho, found):
    """{name: values, name_error: bars} of all OUTPUTS at rho (n, m); `found` has `verdict`,
    `discriminant` and bars.
    """
    c0 = 0.0 if row.oblate else 1.0
    k = np.broadcast_to(row.k[:, None], rho.shape)
    half = np.broadcast_to(row.half[0][:, None], rho.shape)
    those = (found["verdict"] == STABLE) & (k > 0) & (k <= LARGEST) & (np.abs(rho) <= LARGEST)
    out = np.full((*rho.shape, twist.COLUMNS), np.nan)
    some = np.empty((np.count_nonzero(those), twist.COLUMNS))
    twist.twists(k[those], half[those], c0, rho[those], some)
    some[~np.isfinite(some).all(axis=1)] = np.nan
    out[those] = some
    turning, bar = out[..., twist.TWIST], out[..., twist.TWIST_BAR]
    resonant, other = out[..., twist.RESONANT], out[..., twist.RESONANT_BAR]
    with np.errstate(invalid="ignore"):
        twisted = np.abs(turning) > bar
        outweighs = np.abs(turning) - bar > np.abs(resonant) + other
        apart = np.abs(found["discriminant"]) > found["discriminant_error"]
    verdict = np.where(twisted & (apart | outweighs), FLAGS["orbitally_stable"], FLAGS["undecided"])
    verdict = np.where(~apart & ~outweighs & np.isfinite(turning), FLAGS["resonance"], verdict)
    verdict = np.where(found["verdict"] == UNSTABLE, FLAGS["unstable"], verdict)
    return {
        "twist": turning,
        "twist_error": bar,
        "twist_resonant": resonant,
        "twist_resonant_error": other,
        "verdict_nonlinear": verdict.astype(np.int8),
    }
