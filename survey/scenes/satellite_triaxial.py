"""Out-of-plane stability of the planar motions of a satellite with three unequal moments on a
circular orbit.

Principal moments A < B in the orbital plane (A about the axis that hangs down at rest: yaw; B about
the one along the flight: roll) and C across it (pitch). The satellite librates in the plane of the
orbit by x, sin x = k sn(u, k), k < 1, or rotates, k > 1: u = omega_p t, omega_p^2 = 3 omega_0^2 (B
- A) / C, rho = omega_0 / omega_p, w = dx/du, q = rho + w. Small tilts e1, e2 about the axes of A
and B, with their momenta P1, P2, obey, a = A/C, b = B/C,

    e1' = P1 / a + (1 - 1/2a) q e2,     P1' =  (1 - 1/2b) q P2 - (q^2/4b + (1-b)/(b-a) sin^2 x) e1 - g sin x cos x e2
    e2' = P2 / b - (1 - 1/2b) q e1,     P2' = -(1 - 1/2a) q P1 - (q^2/4a + (1-a)/(b-a) cos^2 x) e2 - g sin x cos x e1
    g = (1 - (a + b)/2) / (b - a)

a canonical system of period T = 4 K(k), or 2 K(1/k) / k for rotations.

Model: a rigid body, gravity to the order of the torque, a circular orbit. Linear motion across the
plane of an exact motion in it. Not for large tilts, eccentric orbits, flexible or damped
satellites.

Parameters, in order: A, B, C, of any one unit, A < B, none larger than the sum of the others;
instead of A roll_ratio = (C - A)/B, instead of B yaw_ratio = (C - B)/A, both from -1 to 1. k >= 0,
k != 1; or one_minus_k = 1 - k where that is small (negative: rotations); or amplitude = asin k
(rad), a libration's. Option `direction`: their sense.

Known: at k = 0 s^4 + (1 + 3 r + r y) s^2 + 4 r y = 0 with r, y = roll_ratio, yaw_ratio, s in
orbital rates; B = C and A = C are bodies with an axis of symmetry: two multipliers 1 and those of
the scene `satellite` (`marginal` if these are on the circle). At A = B nothing turns the satellite
back, and k = 1 takes for ever: neither has a verdict.

Source: derived, and checked against the body in three dimensions, in `satellite_triaxial.md` beside
this file.
"""

from functools import cache
from math import cos, pi, sin, sqrt

import numpy as np
from scipy.special import ellipkinc

from survey import status
from survey.kernels.hill.satellite import half_periods
from survey.kernels.math.roundoff import EPS
from survey.measures import linear_motion
from survey.measures.floquet import motion, stability
from survey.measures.floquet.compile_ahead import compile_ahead as compile_ahead
from survey.measures.floquet.multipliers import MARGINAL, UNDECIDED
from survey.measures.floquet.system import System
from survey.measures.hill.satellite import moduli
from survey.scene import Option, Output, Parameter, Trajectory, named

TITLE = "Out-of-plane stability of planar motions of a satellite with three unequal moments"
FAMILY = "floquet"
STATUS = {
    "invalid_parameters": "the parameters lie outside the domain: A must be less than B "
    "(roll_ratio > yaw_ratio), and no moment of inertia may exceed the sum of the others",
}
AUDIT = ("dop853",)
RATIOS = ("roll_ratio", "yaw_ratio", "k", "one_minus_k")
REFERENCES = (
    "I. S. Astakhova, Transformation of satellite equations to Hill's equation (errata: survey/scenes/satellite.md)",
    "P. C. Hughes, Spacecraft Attitude Dynamics (1986), chapter 9: the relative equilibrium",
    "V. A. Yakubovich, V. M. Starzhinskii, Linear Differential Equations with Periodic Coefficients (1975)",
)
PARAMETERS = (
    Parameter("A", "moment of inertia about the axis along the vertical (yaw)", "A",
              minimum=0.0, maximum=1e12, open_minimum=True),
    Parameter("roll_ratio", "(C - A) / B", "k_R", minimum=-1.0, maximum=1.0, instead_of="A"),
    Parameter("B", "moment of inertia about the axis along the flight (roll)", "B",
              minimum=0.0, maximum=1e12, open_minimum=True),
    Parameter("yaw_ratio", "(C - B) / A", "k_Y", minimum=-1.0, maximum=1.0, instead_of="B"),
    Parameter("C", "moment of inertia about the axis across the orbit (pitch)", "C", default=1.0,
              minimum=0.0, maximum=1e12, open_minimum=True),
    Parameter("k", "modulus of the planar motion", "k", minimum=0.0, maximum=1e6, excluded=(1.0,)),
    Parameter("one_minus_k", "1 - k, where k is close to 1", "1-k",
              minimum=-1e6, maximum=1.0, excluded=(0.0,), instead_of="k"),
    Parameter("amplitude", "amplitude of the libration, asin k", r"\beta", "rad",
              minimum=0.0, maximum=pi / 2, open_maximum=True, instead_of="k"),
)  # fmt: skip
OPTIONS = (Option("direction", ("1", "-1"), "sense of a rotation: 1 as the orbit, -1 against it"),)
_GIVEN = (("A", "roll_ratio"), ("B", "yaw_ratio"), ("C",), ("k", "one_minus_k", "amplitude"))
_SHARED = tuple(o for o in stability.OUTPUTS if o.name not in ("exponent", "period", "monodromy"))
_MULTIPLIERS = {"multiplier_re", "multiplier_im"}
_MATRIX = next(o for o in stability.OUTPUTS if o.name == "monodromy")
STARTER = {"A": (0.05, 0.7), "B": (0.75, 1.0)}
OUTPUTS = (
    *_SHARED,
    Output("exponent", "growth of the logarithm of the amplitude per period", r"\mu T"),
    Output(
        "exponent_per_orbit",
        "growth of the logarithm of the amplitude per orbital revolution",
        r"\mu",
    ),
    Output("period", "period of the coefficients, in u", "T"),
    _MATRIX,
)
DIMENSIONS = {name: np.arange(1, 5) for name in ("multiplier", "row", "column")}
states = ("e1", "e2", "P1", "P2")
structure = "symplectic"
_ULPS = 8  # of T and of the exponents' other factors


# measured, on one thread: 42 to 144 on maps of moments, their ratios, and amplitudes, as most points
# lie in tongues that are narrow
curves_seconds = 115.0


def cost(options, sizes):
    """Seconds per point, roughly."""
    return 1e-4


def solve(point, request):
    """All outputs of a block that the request wants (see `survey.scenes`)."""
    names = tuple(next(name for name in one if name in point) for one in _GIVEN)
    columns = np.broadcast_arrays(*(np.asarray(point[name], float) for name in names))
    wanted = set(request.variables) or {o.name for o in OUTPUTS if not o.on_request}
    asked = {o.name for o in (*_SHARED, _MATRIX)} & wanted
    asked |= {"spectral_radius"} if wanted & {"exponent", "exponent_per_orbit"} else set()
    k, kc, _, _ = moduli({names[3]: columns[3]})
    lines, turning = _lines(names, columns, request)
    if lines:
        found = _answers(names, turning, columns, request, asked, lines)
    else:
        found = _one_by_one(names, columns, k > 1, request, asked)
    if "verdict" in wanted:
        verdict = found["verdict"] = found["verdict"].astype(np.int8)
        symmetric = (found["status"] == status.OK) & (verdict == UNDECIDED) & _axial(names, columns)
        if symmetric.any():
            some = [values[symmetric] for values in columns]
            verdict[symmetric] = _by_symmetry(
                _one_by_one(names, some, k[symmetric] > 1, request, _MULTIPLIERS)
            )
    return _derived(found, wanted, names, columns, k, kc)


def why(answer):
    """Why a point has its verdict (see `survey.scenes`)."""
    radius = named(answer, "spectral_radius")
    if answer["verdict"] == "unstable":
        return f"{radius}: it is certainly above 1"
    if answer["verdict"] == "stable":
        return "all multipliers are on the unit circle, simple or, where error bars meet, of one Krein sign"
    if answer["verdict"] == "marginal":
        return (
            "the body has an axis of symmetry: two multipliers are 1, "
            "the other two are simple and on the unit circle"
        )
    return f"{radius}: the error bar allows multipliers outside the unit circle, and on it"


def trajectory(point, answer, options, time=None):
    """A motion across the plane and the multipliers of a point (see `survey.scenes`); `time` in orbits."""
    names = tuple(next(name for name in one if name in point) for one in _GIVEN)
    columns = [np.array([point[name]], float) for name in names]
    k, kc, _, _ = moduli({names[3]: columns[3]})
    rotates, direction = bool(k[0] > 1), float(options["direction"])
    rate = np.sqrt(3.0 * _ratios(names, columns)[2])[0]
    orbits = 2 * half_periods(k, kc)[0][0] / (2 * pi * rate)  # in a period
    system = _system(names, rotates, direction)
    turns = None if time is None else system.period * np.ceil(time / orbits)
    found = motion.solve(system, states, np.stack(columns, axis=-1), answer, turns)
    theta, small = found.data["t"][1], min(k[0], 1 / k[0])
    # cot am = sqrt k' cot theta, without jumps
    am = theta + np.arctan2((1 - np.sqrt(kc)) * np.tan(theta), np.sqrt(kc) + np.tan(theta) ** 2)
    t = ellipkinc(am, small * small) / (max(k[0], 1.0) * rate * 2 * pi)
    pitch = direction * am if rotates else np.arcsin(np.clip(k * np.sin(am), -1, 1))
    data = dict(found.data)
    data["t"] = ("t", t, {"long_name": "time, in orbital revolutions", "symbol": "t", "units": "1"})
    off = 64 * EPS / kc * (1.0 + abs(am))  # mostly that of t
    data |= linear_motion.value(
        "t", "x", "x", "angle of pitch from the vertical, in radians", pitch, off
    )
    if time is not None:
        kept = t <= time * (1 + 1e-12)
        data = {name: (dims, values[kept], *rest) if dims == "t" else (dims, values, *rest)
                for name, (dims, values, *rest) in data.items()}  # fmt: skip
    return Trajectory(data, (("lines", "t", "x"), ("lines", "t", "e1", "e2"), ("multipliers",)))


def _answers(names, turning, columns, request, asked, lines=None):
    """The family's outputs for motions of one kind."""
    system = _system(names, bool(turning), float(request.options["direction"]))
    points = np.stack(columns, axis=-1)
    return stability.solve(system, structure, points, request.method, request.rtol, asked, lines)


def _one_by_one(names, columns, rotates, request, asked):
    """As `_answers`, of motions of both kinds; those that are not possible get their status."""
    valid = _possible(names, columns)
    out = {}
    for turning in np.unique(rotates):
        own = rotates == turning
        some = [np.where(own & valid, values, np.nan) for values in columns]
        for name, values in _answers(names, turning, some, request, asked).items():
            mine = own.reshape(own.shape + (1,) * (values.ndim - own.ndim))
            out[name] = np.where(mine, values, out.get(name, values))
    return out


def _lines(names, columns, request):
    """(the axes of a map on which series may serve as all its points are motions of one kind, do
    these rotate?).
    """
    lines = {i: request.line(name) for i, name in enumerate(names) if request.line(name)}
    if not lines or any(
        name not in request.fixed and i not in lines for i, name in enumerate(names)
    ):
        return {}, False
    ends = (lines[i][1:] if i in lines else values.flat[:1] for i, values in enumerate(columns))
    corners = np.meshgrid(*(np.array(one, float) for one in ends), indexing="ij")
    k = moduli({names[3]: corners[3]})[0]
    # what is possible follows from inequalities that are linear in each parameter: corners suffice
    one_kind = (k > 1).all() or (k < 1).all()
    return (
        (lines, bool((k > 1).all()))
        if one_kind and _possible(names, corners).all()
        else ({}, False)
    )


def _ratios(names, p):
    """A / C, B / C and (B - A) / C, of numbers or of symbols."""
    roll, yaw = names[0] == "roll_ratio", names[1] == "yaw_ratio"
    if roll and yaw:
        rest = 1.0 - p[0] * p[1]
        return (1.0 - p[0]) / rest, (1.0 - p[1]) / rest, (p[0] - p[1]) / rest
    if roll:
        return 1.0 - p[0] * (p[1] / p[2]), p[1] / p[2], ((1.0 + p[0]) * p[1] - p[2]) / p[2]
    if yaw:
        return p[0] / p[2], 1.0 - p[1] * (p[0] / p[2]), (p[2] - (1.0 + p[1]) * p[0]) / p[2]
    return p[0] / p[2], p[1] / p[2], (p[1] - p[0]) / p[2]


def _possible(names, columns):
    """Which points are bodies A < B with a planar motion? Flat ones are, within rounding."""
    with np.errstate(all="ignore"):
        a, b, off = _ratios(names, columns)
        flat = 1.0 + 4 * EPS
        body = (a > 0) & (b > 0) & (off > 0) & (off <= flat) & (1.0 <= (a + b) * flat)
    return body & np.isfinite(moduli({names[3]: columns[3]})[0])


def _axial(names, columns):
    """Which bodies have an axis of symmetry, B = C or A = C, as they are given?"""
    first = columns[0] == 0.0 if names[0] == "roll_ratio" else columns[0] == columns[2]
    second = columns[1] == 0.0 if names[1] == "yaw_ratio" else columns[1] == columns[2]
    return first | second


@cache
def _system(names, rotates, direction):
    """The canonical system in the angle theta, with these parameters; `direction` of rotations.

    tan am = tan theta / sqrt k': in theta the singularities of a libration are sqrt k' away, not
    k'.
    """

    def modulus(p):
        """k, of rotations 1/k, and k'."""
        if names[3] == "amplitude":
            return sin(p[3]), cos(p[3])
        short = p[3] if names[3] == "one_minus_k" else 1.0 - p[3]
        k = 1.0 - p[3] if names[3] == "one_minus_k" else p[3]
        return (1.0 / k, sqrt(-short * (1.0 + k)) / k) if rotates else (k, sqrt(short * (1.0 + k)))

    def fill(t, p, out):
        a, b, off = _ratios(names, p)
        k, kc = modulus(p)
        rho = 1.0 / sqrt(3.0 * off)
        x, y = cos(t), sin(t)
        D, E = kc * x * x + y * y, x * x + kc * y * y
        turn = 1.0 / sqrt(D * E)  # du / d theta; of rotations k du / d theta
        if rotates:
            sine, cosine, both = y * y / D, kc * x * x / D, direction * sqrt(kc) * x * y / D
            speed, rate = rho + direction * sqrt(kc * E / D) / k, k * turn
        else:
            sine, cosine = k * k * y * y / D, kc * E / D
            both = k * y * sqrt(kc * E) / D
            speed, rate = rho + k * sqrt(kc) * x / sqrt(D), turn
        one, two = (1.0 - 0.5 / a) * rate * speed, (1.0 - 0.5 / b) * rate * speed
        both = -(1.0 - 0.5 * (a + b)) / off * rate * both
        out[0, 1], out[1, 0], out[2, 3], out[3, 2] = one, -two, two, -one
        out[0, 2], out[1, 3] = rate / a, rate / b
        out[2, 0] = -rate * (speed * speed * (0.25 / b) + (1.0 - b) / off * sine)
        out[3, 1] = -rate * (speed * speed * (0.25 / a) + (1.0 - a) / off * cosine)
        out[2, 1] = out[3, 0] = both

    return System({"A": fill}, len(states), pi if rotates else 2 * pi, (), symplectic=True)


def _derived(out, wanted, names, columns, k, kc):
    """The wanted outputs, with those that follow from the family's."""
    ok = out["status"] == status.OK
    with np.errstate(all="ignore"):
        rows = np.stack([k.ravel(), kc.ravel()])
        period = np.where(ok, 2 * half_periods(*rows)[0].reshape(k.shape), np.nan)
        orbits = period / (2 * pi * np.sqrt(3.0 * _ratios(names, columns)[2]))
        noise = 4 * EPS / np.where(ok, abs(_ratios(names, columns)[2]), 1.0)  # of B - A, relative
        value, bar = (
            out.get(name, np.nan) for name in ("spectral_radius", "spectral_radius_error")
        )
        growth = np.log(value)
        off = np.where(bar < value, -np.log1p(-bar / value), np.inf) + 4 * EPS * abs(growth)
    out["exponent"], out["exponent_error"] = growth, off
    out["exponent_per_orbit"] = growth / orbits
    out["exponent_per_orbit_error"] = off / orbits + (_ULPS * EPS + noise) * abs(growth / orbits)
    out["period"], out["period_error"] = period, _ULPS * EPS * period
    kept = {name: values for name, values in out.items() if name.removesuffix("_error") in wanted}
    return kept | {"status": out["status"]}


def _by_symmetry(out):
    """Verdicts of undecided bodies with an axis of symmetry: two multipliers are 1, the others decide."""
    value = out["multiplier_re"] + 1j * out["multiplier_im"]
    clear = abs(value - 1.0) > out["multiplier_re_error"] + out["multiplier_im_error"]
    pair = clear.sum(axis=-1) == 2
    # a pair off the real line, and alone, is on the circle
    upper = clear & (value.imag > out["multiplier_im_error"])
    return np.where(pair & (upper.sum(axis=-1) == 1), MARGINAL, UNDECIDED)
