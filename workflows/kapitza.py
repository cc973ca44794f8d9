r"""Kapitza's pendulum: upside down on a pivot that shakes up and down.

$$\ddot\vartheta + 2 \zeta \dot\vartheta - (\kappa + \beta \cos t) \sin\vartheta = 0, \qquad
\kappa = \frac{g}{l\, \Omega^2}, \quad \beta = \frac{A}{l},$$

$\vartheta$ from the upright position, t the phase of a pivot that moves by $A \cos\Omega t$. The upright position is
stable for $v^2 > 2 g l$, $v = A \Omega$ being the largest velocity of the pivot, that is, $\beta^2 > 2\kappa$, in the
limit of fast and small shaking (Stephenson 1908, Kapitza 1951), and loses stability again by a period doubling near
$\beta = 0.45$. Here the equation is linear in $\vartheta$.
"""

from math import cos, pi

from survey.scene import Parameter

TITLE = "Kapitza's pendulum, upside down"
REFERENCES = (
    "P. L. Kapitza, Usp. Fiz. Nauk 44 (1951) 7",
    "L. D. Landau, E. M. Lifshitz, Mechanics, section 30",
    "E. I. Butikov, American Journal of Physics 69 (2001) 755",
)
PARAMETERS = (
    Parameter("kappa", "gravity, g / (l Omega^2)", r"\kappa"),
    Parameter("beta", "amplitude of the pivot over the pendulum's length", r"\beta", minimum=0.0),
    Parameter("zeta", "damping", r"\zeta", default=0.01, minimum=0.0),
)
STATES = ("theta",)
PERIOD = 2 * pi


def K(t, p, out):
    out[0, 0] = -(p[0] + p[1] * cos(t))


def C(t, p, out):
    out[0, 0] = 2 * p[2]
