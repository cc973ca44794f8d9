r"""Planar Lyapunov orbits about the collinear point L1, and whether they are stable against leaving the plane.

The circular restricted problem of three bodies, in the rotating frame: polar coordinates about L1, at the distance
$\gamma$ from the smaller body, of which $\mu$ follows (Szebehely). On a level of the Jacobi integral the speed v is known:
$v^2 = 2\Omega - C$, $2\Omega - C = 2\Omega(L_1) - C + \dots$, with $C = C_{L1} - \gamma^2 s^2$. So the angle $\tau$, which
these orbits run through clockwise, takes the place of time, and the distance r and the direction of motion $\psi$, from
the circle's tangent, are the states, with height z and $w = \dot z$:

$$\frac{\mathrm{d}r}{\mathrm{d}\tau} = r \tan\psi, \qquad
\frac{\mathrm{d}\psi}{\mathrm{d}\tau} = 1 + \dot\varphi\, t', \qquad
\frac{\mathrm{d}z}{\mathrm{d}\tau} = w\, t', \qquad
\frac{\mathrm{d}w}{\mathrm{d}\tau} = -\Big(\frac{1-\mu}{r_1^3} + \frac{\mu}{r_2^3}\Big) z\, t',$$

$t' = r / (v \cos\psi)$, $\dot\varphi = -2 + (\Omega_y \cos\varphi - \Omega_x \sin\varphi)/v$,
$\varphi = \psi - \tau - \pi/2$. The first and the last multiplier are those within the plane, the other two those of the
height, whose product is 1: they lie on the unit circle where the orbit is stable against leaving the plane, and where
they leave it at +1 halo orbits branch off (Farquhar; Henon). Orbits are followed from small s, where
linear theory is the start.
"""

from math import cos, pi, sin, sqrt, tan

from survey.scene import Parameter

TITLE = "Planar Lyapunov orbits about L1"
REFERENCES = (
    "V. Szebehely, Theory of Orbits, Academic Press 1967, 4.4",
    "R. W. Farquhar, A. A. Kamel, Celestial Mechanics 7 (1973) 458",
    "M. Henon, Astronomy and Astrophysics 28 (1973) 415",
)
PARAMETERS = (
    Parameter("gamma", "distance of L1 from the smaller body over that of the two bodies", r"\gamma",
              minimum=0.0, maximum=0.5, open_minimum=True),
    Parameter("s", "size: C = C_L1 - gamma^2 s^2, C the Jacobi integral", "s"),
)  # fmt: skip
STATES = ("r", "psi", "z", "w")
PERIOD = 2 * pi
CONTINUATION = ("s", 0.0005, 1.0)  # linear theory must be good enough at its beginning


def mass(gamma):
    """mu, from the equilibrium of the forces at L1."""
    g = 1 - gamma
    return (g - 1 / g**2) / (1 - 1 / g**2 - 1 / gamma**2)


def START(p):
    gamma, s = p
    mu = mass(gamma)
    c = mu / gamma**3 + (1 - mu) / (1 - gamma) ** 3
    speed = sqrt((2 - c + sqrt(9 * c * c - 8 * c)) / 2)
    ratio = (speed * speed + 1 + 2 * c) / (2 * speed)
    return s / sqrt(ratio**2 * speed**2 - 1 - 2 * c), 0.0, 0.0, 0.0


def f(t, x, p, out):
    gamma, s = p
    r, psi, z, w = x
    mu = mass(gamma)
    xi, y = gamma * r * cos(t), -gamma * r * sin(t)
    X = 1 - mu - gamma + xi
    one, two = (1 - gamma + xi) ** 2 + y * y, (xi - gamma) ** 2 + y * y  # squares of the distances from the bodies
    r1, r2 = sqrt(one), sqrt(two)
    # differences from L1, without cancellation
    near, far = 1 - gamma, xi * xi + y * y
    by_r1 = -(2 * near * xi + far) / (r1 * near * (r1 + near))
    by_r2 = (2 * gamma * xi - far) / (r2 * gamma * (r2 + gamma))
    v = sqrt(2 * (near - mu) * xi + far + 2 * (1 - mu) * by_r1 + 2 * mu * by_r2 + (gamma * s) ** 2)
    pull = (1 - mu) / (one * r1) + mu / (two * r2)
    by_x = X - (1 - mu) * (1 - gamma + xi) / (one * r1) - mu * (xi - gamma) / (two * r2)
    by_y = y * (1 - pull)
    phi = psi - t - pi / 2
    slow = gamma * r / (v * cos(psi))
    out[0] = r * tan(psi)
    out[1] = 1 + slow * (-2 + (by_y * cos(phi) - by_x * sin(phi)) / v)
    out[2] = w * slow
    out[3] = -pull * z * slow
