"""Meissner's equation, a square wave: y'' + (a + q sgn(cos 2u)) y = 0, with its share `duty` of the
period at a + q.

Parameters, in order: a (mean value where duty is one half), q (half the jump), duty (0 < duty < 1,
by default 1/2).

Known: with s = sqrt(a + q) duty pi, r = sqrt(a - q) (1 - duty) pi, the discriminant is D = 2 cos s
cos r - (sqrt((a + q) / (a - q)) + sqrt((a - q) / (a + q))) sin s sin r. Gaps close, and all
solutions coexist, where sin s = sin r = 0.
"""

from math import pi

from survey.scene import Parameter

TITLE = "Stability of Meissner's equation"
REFERENCES = (
    "E. Meissner, Schweizerische Bauzeitung 72 (1918) 95",
    "W. Magnus, S. Winkler, Hill's Equation, Interscience 1966, chapter 8",
)
PARAMETERS = (
    Parameter("a", "mean value", "a"),
    Parameter("q", "half the jump", "q"),
    Parameter("duty", "share of the period at a + q", "d", default=0.5, minimum=0.0, maximum=1.0),
)
PERIOD = pi
EVEN = True


def BREAKS(p):
    """z jumps at the ends of the low part, which lies about T/2."""
    return 0.5 * p[2] * pi, pi - 0.5 * p[2] * pi


def z(u, p):
    high = u < 0.5 * p[2] * pi or u > pi - 0.5 * p[2] * pi
    return p[0] + p[1] if high else p[0] - p[1]
