"""The normal form at L4: mu to 0, to every resonance, to mu_R, and to the ends of the interval of order 6."""

import numpy as np

from survey.failures.plane import Plane, few, logarithmic, named, two_sided
from survey.truth.libration import truth

ABOUT = """The coefficients have poles at mu1 (omega1 = 2 omega2), mu2 (omega1 = 3 omega2) and mu_R, where sums of
Lie series lose digits that the closed forms keep; the verdict depends on a zero at mu_c, mu_d and mu** (a20 = 0).
`auto` takes closed forms in float64, and in double-double where rtol is missed or a verdict is left open."""
SOURCE = (
    "Truth: 60 digits of the closed forms (checked against Lie series of 90 digits in the tests)."
)
CRITICAL = {
    r"$\mu^{**}$": 0.00278347576233486111776847984938,
    r"$\mu_c$": 0.0109136676772006628897436975729,
    r"$\mu_2$": 0.0135160160224525267555750091159,
    r"$\mu_d$": 0.0163767553558164932157833667016,
    "(1,-3,-2)": 0.016596908779335201,
    r"$\mu_1$": 0.0242938971420523216662227326885,
    "(0,4,2)": 0.0285954792089683170661037585968,
    "(3,1,-2)": 0.031231748493428953,
    "(2,3,0)": 0.032622406831841425,
    "(1,-2,-2)": 0.035385464425975297,
    "(0,3,2)": 0.038025747109440545,
    r"$\mu_R$": 0.0385208965045513970786520697274,
}


def planes(share):
    x, away = two_sided(r"distance $\mu - \mu_*$", np.linspace(-17.5, -2.6, few(share, 30)))
    special = np.array(list(CRITICAL.values()))
    mu = np.linspace(-100.0, np.log10(0.038), few(share, 60))
    return [
        Plane("beside critical values\nand resonances", x, named(r"$\mu_*$", list(CRITICAL)), "libration",
              {"mu": special[:, None] + away[None]}, truth, SOURCE),
        Plane("mu to 0", logarithmic(r"$\mu$", mu), named("", [""]), "libration", {"mu": 10.0 ** mu[None]}, truth,
              SOURCE),
    ]  # fmt: skip
