"""The driven Josephson junction, or a synchronous machine: phi'' = I - sin phi - a phi'.

On the cylinder f = -a, g = I - sin phi. Parameters, in order: a (damping) and I (bias current, or
torque).

Known: for a > 0 both ends repel. For I > 1 there is one rotation cycle, w > 0, and no equilibrium;
for I < 1 a saddle and an attracting equilibrium, and beside them the cycle above the homoclinic
curve I(a) = 4 a / pi + O(a^3), which ends in I = 1 at a = 1.193.

Source: J. Guckenheimer, P. Holmes, Nonlinear Oscillations, Dynamical Systems, and Bifurcations of
Vector Fields (1983), 4.6; M. Levi, F. C. Hoppensteadt, W. L. Miranker, Quarterly of Applied
Mathematics 36 (1978) 167-198.
"""

from math import pi, sin

from survey.scene import Parameter

TITLE = "The driven Josephson junction"
REFERENCES = (
    "M. Levi, F. C. Hoppensteadt, W. L. Miranker, Dynamics of the Josephson junction, Q. Appl. Math. 36 (1978) 167-198",
)
PARAMETERS = (
    Parameter("a", "damping", "a"),
    Parameter("I", "bias current over the critical current", "I"),
)
PERIOD = 2 * pi


def f(phi, p):
    return -p[0]


def g(phi, p):
    return p[1] - sin(phi)
