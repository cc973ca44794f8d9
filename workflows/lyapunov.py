r"""Planar Lyapunov orbits about L1 of the restricted problem of three bodies: are they stable out
of the plane?

In the rotating frame, the primaries of masses $1 - \mu$ and $\mu$ at $x = -\mu$ and $1 - \mu$,

$$\ddot x - 2\dot y = \Omega_x,\quad \ddot y + 2\dot x = \Omega_y,\quad \ddot z = \Omega_z,\qquad
\Omega = \tfrac12 (x^2 + y^2) + \frac{1 - \mu}{r_1} + \frac{\mu}{r_2}.$$

The orbits cross the x axis at right angles, on the side of the smaller primary at $x = x_{L1} +
a\gamma$, $\gamma$ its distance from L1: $a$ goes from 0 to a collision at 1. In the plane all of
them near L1 are unstable, by multipliers of thousands. Out of it the first loss of stability, by a
multiplier 1, is where halo orbits branch off.
"""

from math import nan, pi, sqrt

from survey.scene import Parameter

TITLE = "Lyapunov orbits about L1, out of the plane"
REFERENCES = (
    "V. Szebehely, Theory of Orbits, Academic Press 1967, chapters 5 and 9",
    "M. Henon, Astronomy and Astrophysics 28 (1973) 415",
    "K. C. Howell, Celestial Mechanics 32 (1984) 53",
)
PARAMETERS = (
    Parameter("mu", "mass of the smaller primary, relative to both", r"\mu", minimum=0.0, maximum=0.5,
              open_minimum=True),
    Parameter("a", "amplitude towards the smaller primary, in distances of it from L1", "a", minimum=0.0, maximum=1.0,
              open_minimum=True, open_maximum=True),
)  # fmt: skip
STATES = ("x", "y", "z", "vx", "vy", "vz")
PERIOD = None
REVERSED = ("y", "vx", "vz")
HELD = "x"
TRANSVERSE = ("z", "vz")
CONTINUATION = ("a", 0.01, 0.85)
LINEAR = 0.1  # amplitudes


def distance(mu):
    """That of L1 from the smaller primary: Euler's equation of the fifth degree."""
    g = (mu / 3) ** (1 / 3)
    for _ in range(60):
        pull = mu / g**2 - (1 - mu) / (1 - g) ** 2 + 1 - mu - g
        g += pull / (2 * mu / g**3 + 2 * (1 - mu) / (1 - g) ** 3 + 1)
    return g


def START(p):
    """The linear motion about L1; where it is no guess of the period, NaN: orbits are followed from
    small ones.
    """
    mu, a = p
    g = distance(mu)
    c = (1 - mu) / (1 - g) ** 3 + mu / g**3
    rate = sqrt((2 - c + sqrt(c * (9 * c - 8))) / 2)
    ratio = (rate**2 + 1 + 2 * c) / (2 * rate)
    period = 2 * pi / rate if a <= LINEAR else nan
    return 1 - mu - g + a * g, 0.0, 0.0, 0.0, -ratio * rate * a * g, 0.0, period


def f(t, x, p, out):
    mu = p[0]
    one, two = x[0] + mu, x[0] + mu - 1
    far = x[1] ** 2 + x[2] ** 2
    first, second = (1 - mu) / (one**2 + far) ** 1.5, mu / (two**2 + far) ** 1.5
    out[0], out[1], out[2] = x[3], x[4], x[5]
    out[3] = 2 * x[4] + x[0] - first * one - second * two
    out[4] = -2 * x[3] + x[1] - (first + second) * x[1]
    out[5] = -(first + second) * x[2]
