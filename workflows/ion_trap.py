r"""Ions in a quadrupole with a buffer gas: two Mathieu equations with damping.

$$\ddot x + 2 k \dot x + (a - 2 q \cos 2t)\, x = 0, \qquad
\ddot y + 2 k \dot y - (a - 2 q \cos 2t)\, y = 0.$$

Without the gas (k = 0) ions are kept where both equations are stable: the first region reaches q = 0.908046 at a = 0, and
its apex is (a, q) = (0.236994, 0.705996). With $y = e^{-kt} v$ the damped equation is Mathieu's again, at
$a - k^2$, and multipliers are smaller by $e^{-k\pi}$: the gas widens the region.
"""

from math import cos, pi

from survey.scene import Parameter

TITLE = "Ions in a quadrupole with a buffer gas"
REFERENCES = (
    "R. E. March, J. F. J. Todd, Quadrupole Ion Trap Mass Spectrometry, Wiley 2005, chapter 2",
    "N. W. McLachlan, Theory and Application of Mathieu Functions, Oxford 1947",
)
PARAMETERS = (
    Parameter("q", "amplitude of the alternating voltage", "q"),
    Parameter("a", "direct voltage", "a"),
    Parameter("k", "damping", "k", default=0.05, minimum=0.0),
)
STATES = ("x", "y")
PERIOD = pi


def K(t, p, out):
    out[0, 0] = p[1] - 2 * p[0] * cos(2 * t)
    out[1, 1] = -out[0, 0]


def C(t, p, out):
    out[0, 0] = out[1, 1] = 2 * p[2]
