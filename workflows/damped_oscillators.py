r"""Two coupled oscillators whose stiffness is modulated, with damping: thresholds of parametric
resonance.

$$\ddot x + 2 c \dot x + (\omega_1^2 + \epsilon \cos\Omega t)\, x + \epsilon\, y \cos\Omega t = 0, \qquad
\ddot y + 2 c \dot y + (\omega_2^2 + \epsilon \cos\Omega t)\, y + \epsilon\, x \cos\Omega t = 0,$$

$\omega_1 = 1$, $\omega_2 = 0.62$. Beside $\Omega = 2 \omega_i$ a multiplier passes -1, beside $\Omega = \omega_i$ 1,
and beside $\omega_1 + \omega_2$ and half of it a complex pair leaves the unit circle. To first order, the resonance at
$2 \omega_i$ sets in at $\epsilon = 4 c\, \omega_i$, and that at $\omega_1 + \omega_2$ at
$\epsilon = 4 c \sqrt{\omega_1 \omega_2}$, as both oscillators are damped alike.
"""

from math import cos, pi

from survey.scene import Parameter

TITLE = "Two damped oscillators with modulated stiffness"
REFERENCES = (
    "V. A. Yakubovich, V. M. Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975), VI",
)
PARAMETERS = (
    Parameter("Omega", "frequency", r"\Omega", minimum=0.0, open_minimum=True),
    Parameter("epsilon", "strength of the modulation", r"\epsilon"),
    Parameter("c", "damping", "c"),
)
STATES = ("x", "y")
FREQUENCIES = (1.0, 0.62)


def PERIOD(p):
    return 2 * pi / p[0]


def K(t, p, out):
    modulation = p[1] * cos(p[0] * t)
    for i in (0, 1):
        out[i, i] = FREQUENCIES[i] ** 2 + modulation
    out[0, 1] = out[1, 0] = modulation


def C(t, p, out):
    out[0, 0] = out[1, 1] = 2 * p[2]
