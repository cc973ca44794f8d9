r"""Duffing's oscillator with a hardening spring and a force: periodic orbits, round their folds.

$$\ddot x + 2 \zeta \dot x + x + x^3 = F \cos\omega t.$$

Above $\omega = 1$ the response has up to three periodic orbits, two of them stable: the resonance
curve is bent over. With one harmonic, $x = A \cos(\omega t - \varphi)$, $A^2 ((1 - \omega^2 +
3A^2/4)^2 + 4\zeta^2\omega^2) = F^2$, and the folds are where $d\omega/dA = 0$. Orbits are followed
along $\omega$; branch 1 is the smallest.
"""

from math import cos, pi

from survey.scene import Parameter

TITLE = "Duffing's oscillator with a force"
REFERENCES = (
    "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, Wiley 1979, chapter 4",
    "I. Kovacic, M. J. Brennan, The Duffing Equation, Wiley 2011",
)
PARAMETERS = (
    Parameter("omega", "frequency of the force", r"\omega", minimum=0.0, open_minimum=True),
    Parameter("F", "amplitude of the force", "F"),
    Parameter("zeta", "damping", r"\zeta", default=0.05, minimum=0.0, open_minimum=True),
)
STATES = ("x", "v")
START = (0.0, 0.0)
CONTINUATION = ("omega", 0.9, 3.0)


def PERIOD(p):
    return 2 * pi / p[0]


def f(t, x, p, out):
    omega, F, zeta = p
    out[0] = x[1]
    out[1] = F * cos(omega * t) - 2 * zeta * x[1] - x[0] - x[0] ** 3
