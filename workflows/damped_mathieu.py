r"""Mathieu's equation with damping: how much of it keeps a parametric oscillator at rest?

$$\ddot x + 2 \zeta \dot x + (\delta + \epsilon \cos 2t)\, x = 0.$$

With $x = e^{-\zeta t} y$ this is Mathieu's equation for y, at $\delta - \zeta^2$, and multipliers are those of y times
$e^{-\pi\zeta}$. To lowest order the tongue near $\delta = 1$, where a multiplier passes -1, begins at
$\epsilon = 4 \zeta$, and that near $\delta = 4$, where one passes 1, at $\epsilon = 8 \sqrt{\zeta}$.
"""

from math import cos, pi

from survey.scene import Parameter

TITLE = "Mathieu's equation with damping"
REFERENCES = (
    "N. W. McLachlan, Theory and Application of Mathieu Functions, Oxford 1947",
    "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, Wiley 1979, chapter 5",
)
PARAMETERS = (
    Parameter("delta", "mean stiffness", r"\delta"),
    Parameter("epsilon", "amplitude of its modulation", r"\epsilon"),
    Parameter("zeta", "damping", r"\zeta", default=0.1, minimum=0.0),
)
STATES = ("x", "v")
PERIOD = pi


def A(t, p, out):
    out[0, 1] = 1.0
    out[1, 0] = -(p[0] + p[1] * cos(2 * t))
    out[1, 1] = -2 * p[2]
