r"""van der Pol's oscillator with a force: where is it entrained?

$$\ddot x - \mu (1 - x^2) \dot x + x = \mu F \cos\omega t.$$

An orbit of the force's period always exists; where it is stable the oscillator follows the force. It loses stability
at a fold, next to weak forces, or as two multipliers leave the unit circle (Neimark and Sacker), with strong ones. For
small $\mu$ (Cartwright, Holmes and Rand) $\rho = A^2/4$ obeys
$\rho((1 - \rho)^2 + \sigma^2) = F^2/4$ with $\sigma = (1 - \omega^2)/(\mu\omega)$; the orbit is stable where
$\rho > 1/2$ and $(1 - \rho)(1 - 3\rho) + \sigma^2 > 0$. Orbits are followed along F; branch -1 is the largest, which is
the stable one where one is.
"""

from math import cos, pi

from survey.scene import Parameter

TITLE = "Entrainment of van der Pol's oscillator"
REFERENCES = (
    "B. van der Pol, Philosophical Magazine 3 (1927) 65",
    "P. Holmes, D. Rand, Quarterly of Applied Mathematics 35 (1978) 495",
)
PARAMETERS = (
    Parameter("omega", "frequency of the force", r"\omega", minimum=0.0, open_minimum=True),
    Parameter("F", "amplitude of the force", "F"),
    Parameter("mu", "nonlinearity", r"\mu", default=1.0, minimum=0.0, open_minimum=True),
)
STATES = ("x", "v")
START = (2.0, 0.0)
CONTINUATION = ("F", 0.01, 2.0)


def PERIOD(p):
    return 2 * pi / p[0]


def f(t, x, p, out):
    omega, F, mu = p
    out[0] = x[1]
    out[1] = mu * (1 - x[0] ** 2) * x[1] - x[0] + mu * F * cos(omega * t)
