"""The Whittaker-Hill equation, whose gaps coexist: y'' + (a + b cos 2u + c cos 4u) y = 0.

Parameters, in order: a (eigenvalue), m and alpha, with b = 4 m alpha, c = 2 alpha^2 (Magnus and
Winkler, chapter 7).

Known: for odd m all gaps with periodic edges are closed but the first (m - 1) / 2, for even m all
with antiperiodic edges but the first m / 2: there both classes of edges coincide, and every
solution is (anti)periodic. For m = 1 the lowest edge is a = -2 alpha^2, with y = exp(alpha cos 2u).
"""

from math import cos, pi

from survey.scene import Parameter

TITLE = "Stability and coexistence in the Whittaker-Hill equation"
REFERENCES = (
    "NIST Digital Library of Mathematical Functions, 28.31",
    "W. Magnus, S. Winkler, Hill's Equation, Interscience 1966, chapter 7 (Ince's equation, coexistence)",
)
PARAMETERS = (
    Parameter("a", "eigenvalue", "a"),
    Parameter("m", "parameter of the first harmonic", "m"),
    Parameter("alpha", "amplitude of the excitation", r"\alpha"),
)
PERIOD = pi
EVEN = True


def z(u, p):
    a, m, alpha = p[0], p[1], p[2]
    return a + 4 * m * alpha * cos(2 * u) + 2 * alpha * alpha * cos(4 * u)
