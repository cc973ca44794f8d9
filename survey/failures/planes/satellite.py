"""The satellite: modulus to 1, rho to 1e4, narrow tongues, rotations ever faster and ever nearer
the separatrix.
"""

import numpy as np

from survey.analysis.edge import edge
from survey.failures.plane import Plane, few, logarithmic, plain, two_sided
from survey.truth.hill import satellite

ABOUT = """The discriminant is the trace of a product of matrices whose entries grow with rho and with the period,
so that digits are lost where rho is large, and beside the separatrix (k = 1); in a tongue the verdict depends on a
difference that is as small as the tongue is wide. `auto` takes 16th-order Taylor steps (series over dense rows),
and double-double where float64 leaves a verdict open."""
SOURCE = (
    "Truth: Duffing's equation for the motion and both solutions of Hill's equation, Taylor series of order 30 in "
    "double-double."
)
SLOW = ("rk4",)


def planes(share):
    return [_librations(share), _long(share), _tongues(share, "prolate"), _tongues(share, "oblate"),
            _rotations(share), _beside(share)]  # fmt: skip


def _librations(share):
    rho, short = np.linspace(-1.0, 1.5, few(share, 24)), np.linspace(-16.0, -0.05, few(share, 20))
    return Plane(
        "prolate librations,\nk to 1", logarithmic(r"$\rho$", rho), logarithmic("$1 - k$", short), "satellite",
        {"one_minus_k": 10.0 ** short[:, None], "rho": 10.0 ** rho[None]},
        satellite("one_minus_k", False, 1, False), SOURCE, {"body": "prolate"},
    )  # fmt: skip


def _long(share):
    rho, short = np.linspace(1.5, 4.0, few(share, 11)), np.linspace(-12.0, -0.2, few(share, 8))
    return Plane(
        "oblate librations,\nrho to 1e4", logarithmic(r"$\rho$", rho), logarithmic("$1 - k$", short), "satellite",
        {"one_minus_k": 10.0 ** short[:, None], "rho": 10.0 ** rho[None]},
        satellite("one_minus_k", False, 1, True, 1e4), SOURCE, {"body": "oblate"}, slow=SLOW,
    )  # fmt: skip


def _tongues(share, body):
    """The third tongue, whose width is about k^3 / 8."""
    k = 10.0 ** np.linspace(-4.0, -0.7, few(share, 18))
    position = np.linspace(-1.5, 1.5, few(share, 25))
    centre = np.sqrt(1.25) if body == "prolate" else 1.5
    ends = [
        edge("satellite", along="rho", rho=(centre - 4 * m * m, centre), k=m, body=body).edge.values
        for m in k
    ]
    low, high = np.array([[x[0], x[-1]] for x in ends]).T
    rho = 0.5 * (low + high)[:, None] + position[None] * (high - low)[:, None]
    return Plane(
        f"{body} librations, the tongue\nn = 3, width 1e-13 to 1e-3",
        plain("position in the tongue, over its width", position),
        logarithmic("width of the tongue", np.log10(high - low)), "satellite", {"k": k[:, None], "rho": rho},
        satellite("k", False, 1, body == "oblate"), SOURCE, {"body": body},
    )  # fmt: skip


def _rotations(share):
    k, ratio = np.linspace(0.02, 6.0, few(share, 20)), np.linspace(-3.0, 2.0, few(share, 26))
    rho = 10.0 ** k[:, None] * ratio[None]
    return Plane(
        "prolate rotations,\nk to 1e6", plain(r"$\rho / k$", ratio), logarithmic("$k$", k), "satellite",
        {"k": 10.0 ** k[:, None], "rho": rho}, satellite("k", False, 1, False), SOURCE, {"body": "prolate"},
    )  # fmt: skip


def _beside(share):
    y, offsets = two_sided("$1 - k$: below 0 rotations", np.linspace(-15.0, -1.0, few(share, 10)))
    rho = np.linspace(-3.0, 3.0, few(share, 24))
    return Plane(
        "oblate, both sides of\nthe separatrix", plain(r"$\rho$", rho), y, "satellite",
        {"one_minus_k": offsets[:, None], "rho": rho[None]}, satellite("one_minus_k", False, 1, True), SOURCE,
        {"body": "oblate"},
    )  # fmt: skip
