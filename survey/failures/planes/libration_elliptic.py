"""Danby's map: e to 1, the tip where its curves touch, and the ends of mu."""

import numpy as np

from survey.failures.plane import Plane, few, logarithmic, plain, two_sided
from survey.truth.danby import truth

ABOUT = """The monodromy matrix grows as a power of 1 / (1 - e); at the tip (mu = 0.0469908, e = 0.3145072) two
curves touch, where all multipliers are -1 and both invariants' first differences vanish; as mu goes to 0 two
multipliers go to 1. `auto` takes panels of series in both parameters, and double-double where these miss rtol or
leave a verdict open; the other methods take steps over half a period."""
SOURCE = (
    "Truth: Taylor series of order 32 in double-double, in the eccentric anomaly; M multiplied out."
)
TIP = 0.04699080701821065, 0.31450715975493514
SLOW = ("rk4",)


def planes(share):
    return [_plain(share), _to_one(share), _tip(share), _small(share)]


def _plain(share):
    mu, e = np.linspace(0.0005, 0.06, few(share, 24)), np.linspace(0.0, 0.9, few(share, 16))
    return Plane("the plane", plain(r"$\mu$", mu), plain("$e$", e), "libration_elliptic",
                 {"mu": mu[None], "e": e[:, None]}, truth, SOURCE, slow=SLOW)  # fmt: skip


def _to_one(share):
    mu = np.linspace(-12.0, np.log10(0.5), few(share, 20))
    short = np.linspace(-14.0, -0.1, few(share, 16))
    return Plane("e to 1", logarithmic(r"$\mu$", mu), logarithmic("$1 - e$", short), "libration_elliptic",
                 {"mu": 10.0 ** mu[None], "e": 1.0 - 10.0 ** short[:, None]}, truth, SOURCE, slow=SLOW)  # fmt: skip


def _tip(share):
    x, dm = two_sided(r"$\mu - \mu_{\mathrm{tip}}$", np.linspace(-16.0, -2.0, few(share, 10)))
    y, de = two_sided(r"$e - e_{\mathrm{tip}}$", np.linspace(-15.0, -1.0, few(share, 8)))
    return Plane("about the tip", x, y, "libration_elliptic",
                 {"mu": TIP[0] + dm[None], "e": TIP[1] + de[:, None]}, truth, SOURCE, slow=SLOW)  # fmt: skip


def _small(share):
    mu, e = np.linspace(-300.0, -3.0, few(share, 18)), np.linspace(-300.0, -1.0, few(share, 12))
    return Plane(r"mu and e to 0", logarithmic(r"$\mu$", mu), logarithmic("$e$", e), "libration_elliptic",
                 {"mu": 10.0 ** mu[None], "e": 10.0 ** e[:, None]}, truth, SOURCE, slow=SLOW)  # fmt: skip
