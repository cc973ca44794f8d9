r"""Two parametrically coupled oscillators: combination resonances of sum and of difference type.

$$\ddot x + \omega_1^2 x + \epsilon\, y \cos\Omega t = 0, \qquad
\ddot y + \omega_2^2 y + \epsilon\, x \cos\Omega t = 0,$$

$\omega_1 = 1$, $\omega_2 = 0.62$. The coupling is symmetric, so that the system is Hamiltonian in (x, y, x', y'), and
stability is lost only where multipliers of opposite Krein sign meet: next to sums of two frequencies,
$\omega_i + \omega_j = k\,\Omega$, never next to their difference. The tongue at $\Omega = \omega_1 + \omega_2$ begins
with the half width $\epsilon / (2 \sqrt{\omega_1 \omega_2})$ (Yakubovich and Starzhinskii, VI); those of
$2 \omega_i$ open at $k = 2$ and are of second order, for the coupling is of the two.
"""

from math import cos, pi

from survey.scene import Parameter

TITLE = "Two parametrically coupled oscillators"
REFERENCES = (
    "V. A. Yakubovich, V. M. Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975), VI",
)
PARAMETERS = (
    Parameter("Omega", "frequency of the coupling", r"\Omega", minimum=0.0, open_minimum=True),
    Parameter("epsilon", "strength of the coupling", r"\epsilon"),
)
STATES = ("x", "y")
STRUCTURE = "symplectic"
FREQUENCIES = (1.0, 0.62)


def PERIOD(p):
    return 2 * pi / p[0]


def K(t, p, out):
    for i in (0, 1):
        out[i, i] = FREQUENCIES[i] ** 2
    out[0, 1] = out[1, 0] = p[1] * cos(p[0] * t)
