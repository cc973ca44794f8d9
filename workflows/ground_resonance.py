r"""Ground resonance of a helicopter: a rotor of four blades, hinged in lag, on a hub that can move
in its plane.

The hub moves by x, y, blade k lags by $\zeta_k$ at the azimuth $\psi_k = \Omega t + k \pi / 2$; S
and J are the first and second moment of a blade's mass about its hinge, at the distance e from the
centre:

$$J \ddot\zeta_k + c_k \dot\zeta_k + e S \Omega^2 \zeta_k + S (\ddot y \cos\psi_k - \ddot x \sin\psi_k) = 0,$$
$$m_x \ddot x + c_x \dot x + k_x x
- S \sum (\ddot\zeta_k - \Omega^2 \zeta_k) \sin\psi_k + 2 \Omega \dot\zeta_k \cos\psi_k = 0,$$
$$m_y \ddot y + c_y \dot y + k_y y
+ S \sum (\ddot\zeta_k - \Omega^2 \zeta_k) \cos\psi_k - 2 \Omega \dot\zeta_k \sin\psi_k = 0.$$

The period is that of a turn. With equal dampers Coleman's coordinates make the coefficients
constant; with one damper out (`lost` = 1) nothing does: twelve states, periodic. Numbers are those
of Hammond's rotor, in SI units.
"""

from math import cos, pi, sin

from survey.scene import Parameter

TITLE = "Ground resonance of a helicopter with a lost damper"
REFERENCES = (
    "R. P. Coleman, A. M. Feingold, NACA Report 1351 (1958)",
    "C. E. Hammond, Journal of the American Helicopter Society 19 (1974) 4, 14",
)
PARAMETERS = (
    Parameter("omega", "rotor speed", r"\Omega", units="rad s-1", minimum=0.0, open_minimum=True),
    Parameter("damping", "damping of a blade's lag", "c_k", units="N m s", minimum=0.0),
    Parameter(
        "lost", "share of its damping that one blade has lost", r"\ell", minimum=0.0, maximum=1.0
    ),
)
STATES = ("x", "y", "zeta1", "zeta2", "zeta3", "zeta4")
BLADES = 4
HINGE, S, J = 0.3048, 289.1, 1084.7  # m, kg m, kg m^2
HUB = (8026.6, 3283.6)  # kg: its mass in x and y
BLADE = 94.9  # kg
STIFFNESS = (1240481.8, 1240481.8)  # N / m
HUB_DAMPING = (51078.7, 25539.3)  # N s / m


def PERIOD(p):
    return 2 * pi / p[0]


def M(t, p, out):
    for i in (0, 1):
        out[i, i] = HUB[i] + BLADES * BLADE
    for k in range(BLADES):
        psi = p[0] * t + k * pi / 2
        out[2 + k, 2 + k] = J
        out[0, 2 + k] = out[2 + k, 0] = -S * sin(psi)
        out[1, 2 + k] = out[2 + k, 1] = S * cos(psi)


def C(t, p, out):
    out[0, 0], out[1, 1] = HUB_DAMPING
    for k in range(BLADES):
        psi = p[0] * t + k * pi / 2
        out[2 + k, 2 + k] = p[1] * (1 - p[2] if k == 0 else 1.0)
        out[0, 2 + k] = -2 * p[0] * S * cos(psi)
        out[1, 2 + k] = -2 * p[0] * S * sin(psi)


def K(t, p, out):
    out[0, 0], out[1, 1] = STIFFNESS
    for k in range(BLADES):
        psi = p[0] * t + k * pi / 2
        out[2 + k, 2 + k] = HINGE * S * p[0] ** 2
        out[0, 2 + k] = p[0] ** 2 * S * sin(psi)
        out[1, 2 + k] = -(p[0] ** 2) * S * cos(psi)
