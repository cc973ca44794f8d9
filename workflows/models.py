"""Which model, and why it suffices: the full models, integrated without any reduction, beside the
scenes.

    python workflows/models.py [-o results] [--points 2000]

Needs scipy: pip install -e ".[test]". The full models are integrated by DOP853 with fixed steps,
many points side by side; what a small deviation does is their derivative, by a complex step (no
difference is taken, nothing cancels).
"""

import time

import numpy as np
import xarray as xr
from scipy.integrate._ivp import dop853_coefficients as tableau
from scipy.special import ellipk
from script import parser, say

import survey

TINY = 1e-200  # of a complex step
STAGES = tableau.N_STAGES


def main():
    words = parser(__doc__, "the page")
    words.add_argument("--points", type=int, default=2000, help="random points of each check")
    given = words.parse_args()
    rng = np.random.default_rng(23)
    rows = [check(given.points, rng) for check in CHECKS]
    path = given.output / "models.md"
    table = "\n".join("| " + " | ".join(row) + " |" for row in rows)
    path.write_text(PAGE.format(points=given.points, rows=table), encoding="utf-8")
    say(path)


def integrate(slope, state, span, steps):
    """The state (components first) after the time `span`, an array of one for each point."""
    h = span / steps
    for i in range(steps):
        slopes = []
        for j in range(STAGES):
            at = state + h * sum(
                (a * k for a, k in zip(tableau.A[j, :j], slopes, strict=True) if a), 0.0 * state
            )
            slopes.append(slope((i + tableau.C[j]) * h, at))
        state = state + h * sum(b * k for b, k in zip(tableau.B, slopes, strict=True) if b)
    return state


def satellite(number, rng):
    """The axis e on the sphere, e'' = -|e'|^2 e + 3 (Iz - I)/I (r.e) ((r.e) e - r), r the vertical,
    in orbital time.
    """
    alpha = np.where(
        rng.random(number) < 0.5, rng.uniform(0.0, 0.95, number), rng.uniform(1.05, 2.0, number)
    )
    k = np.where(
        rng.random(number) < 0.5, rng.uniform(0.05, 0.95, number), rng.uniform(1.05, 4.0, number)
    )
    sense = np.where((k > 1) & (rng.random(number) < 0.5), -1.0, 1.0)
    rho = 1 / np.sqrt(3 * abs(1 - alpha))
    rate = 1 + sense * k / rho  # of the axis at x = 0, in space
    turn = np.where(
        k < 1, 4 * ellipk(np.minimum(k, 1) ** 2), 2 * ellipk(1 / np.maximum(k, 1) ** 2) / k
    )
    # x = 0: the axis on the vertical, or on the tangent of the orbit
    at = np.where(alpha < 1, 0.0, 1.0)
    start = np.array([1 - at, at, 0 * at, -at * rate, (1 - at) * rate, 0 * at])

    def slope(t, y):
        e, v = y[:3], y[3:]
        r = np.array([np.cos(t), np.sin(t), 0 * t])
        c = (r * e).sum(0)
        return np.concatenate([v, -(v * v).sum(0) * e + 3 * (alpha - 1) * c * (c * e - r)])

    clock = time.process_time()
    trace = 0.0
    for across in (2, 5):
        y = start.astype(complex)
        y[across] += 1j * TINY
        trace = trace + integrate(slope, y, turn * rho, 1600)[across].imag / TINY
    full = time.process_time() - clock
    ds, reduced = timed(
        "satellite", k=along(k), rho=along(sense * rho), variables=["discriminant"], body="prolate"
    )
    oblate, more = timed(
        "satellite", k=along(k), rho=along(sense * rho), variables=["discriminant"], body="oblate"
    )
    found = np.where(alpha < 1, ds.discriminant.values, oblate.discriminant.values)
    return row(
        "`satellite`", "the axis on the sphere, two deviations across the plane", "trace over a period", number,
        abs(trace - found) / (1 + abs(found)), full, 0.5 * (reduced + more),
    )  # fmt: skip


def gyrostat(number, rng):
    """The six equations in a body that the reduced motion leaves free: the scene's method `full`."""
    number = max(number // 20, 20)
    system = {
        name: along(rng.uniform(-1, 1, number)) for name in ("b12", "b31", "d", "c23", "s2", "s3")
    }
    system |= {
        "phi0": along(rng.uniform(0, 6, number)),
        "w0": along(rng.uniform(-2, 2, number)),
        "t": 5.0,
    }
    asked = {"question": "trajectory", "variables": ["phi", "w"], **system}
    ds, reduced = timed("gyrostat", **asked)
    reference, full = timed("gyrostat", method="full", **asked)
    off = np.maximum(abs(ds.phi - reference.phi), abs(ds.w - reference.w)).values
    return row(
        "`gyrostat`", "equations (1)-(6)", "angle and rate at t = 5", number, off, full, reduced
    )


def brun(number, rng):
    """Euler and Poisson: M' = M x w + eps g x I g, g' = g x w, x' = x x w with a fixed horizontal axis x."""
    number = max(number // 10, 50)
    a, c = rng.uniform(1, 3, number), rng.uniform(0.3, 1.7, number)
    state = {
        "A": a, "C": c, "epsilon": rng.uniform(-1, 1, number), "theta0": rng.uniform(0.5, 2.5, number),
        "p_theta0": rng.uniform(0.2, 1.0, number), "p_psi": rng.uniform(0.6, 2, number),
        "p_phi": rng.uniform(-0.5, 0.5, number),
    }  # fmt: skip
    ds, reduced = timed(
        "brun", **{n: along(v) for n, v in state.items()}, variables=["period", "precession"]
    )
    tensor = np.array([a, a, c])
    sin, cos = np.sin(state["theta0"]), np.cos(state["theta0"])
    # phi = psi = 0: nodes along body axis 1; the fixed horizontal axis is that of the nodes
    momentum = np.array(
        [state["p_theta0"], (state["p_psi"] - state["p_phi"] * cos) / sin, state["p_phi"]]
    )
    start = np.concatenate([momentum, [0 * sin, sin, cos], [1 + 0 * sin, 0 * sin, 0 * sin]])

    def slope(t, y):
        m, g, x = y[:3], y[3:6], y[6:]
        w = m / tensor
        turned = [np.cross(v, w, axis=0) for v in (m, g, x)]
        turned[0] = turned[0] + state["epsilon"] * np.cross(g, tensor * g, axis=0)
        return np.concatenate(turned)

    clock = time.process_time()
    end = integrate(slope, start, ds.period.values, 600)
    full = time.process_time() - clock
    g, x = end[3:6], end[6:]
    # from the fixed axis x by psi about g
    nodes = np.array([g[1], -g[0], 0 * g[0]]) / np.hypot(g[0], g[1])
    psi = np.arctan2((np.cross(x, nodes, axis=0) * g).sum(0), (x * nodes).sum(0))
    off = abs(np.angle(np.exp(1j * (psi - ds.precession.values)))) + abs(g[2] - cos)
    return row(
        "`brun`",
        "Euler and Poisson, 9 equations",
        "precession and theta after a period",
        number,
        off,
        full,
        reduced,
    )


def libration_elliptic(number, rng):
    """The elliptic problem in pulsating axes: x'' - 2 y' = r Om_x, y'' + 2 x' = r Om_y, z'' + z = r
    Om_z, about L4.
    """
    number = max(number // 10, 50)
    mu, e = rng.uniform(1e-3, 0.05, number), rng.uniform(0.0, 0.8, number)
    ds, reduced = timed("libration_elliptic", mu=along(mu), e=along(e), variables=["a", "b"])
    point = np.array([0.5 - mu, np.full(number, np.sqrt(0.75)), 0 * mu])

    def slope(f, y):
        x, v = y[:3], y[3:]
        pull = 0.0
        for mass, at in ((1 - mu, -mu), (mu, 1 - mu)):
            apart = np.array([x[0] - at, x[1], x[2]])
            pull = pull - mass * apart / (apart * apart).sum(0) ** 1.5
        force = (x + pull) / (1 + e * np.cos(f))
        return np.concatenate([v, [force[0] + 2 * v[1], force[1] - 2 * v[0], force[2] - x[2]]])

    clock = time.process_time()
    planar, matrix = (0, 1, 3, 4), np.empty((4, 4, number))
    for j, column in enumerate(planar):
        y = np.concatenate([point, 0 * point]).astype(complex)
        y[column] += 1j * TINY
        matrix[:, j] = (
            integrate(slope, y, np.full(number, 2 * np.pi), 1500)[list(planar)].imag / TINY
        )
    full = time.process_time() - clock
    trace = np.trace(matrix)
    second = 0.5 * (trace**2 - np.einsum("ijn,jin->n", matrix, matrix))
    size = 1 + abs(matrix).max((0, 1)) ** 2  # what the sums are made of
    off = np.maximum(abs(trace - ds.a.values), abs(second - ds.b.values)) / size
    return row(
        "`libration_elliptic`", "the elliptic problem about L4", "a and b, over their largest term", number,
        off, full, reduced,
    )  # fmt: skip


def gyrostat_body(number, rng):
    """A w' = (A w + lambda) x w + (B w) x nu + nu x (C nu) + s x nu, nu' = nu x w (1)-(6), of any body."""
    number = max(number // 20, 20)
    tensors = {}
    for name in "ABC":
        half = rng.uniform(-0.4, 0.4, (3, 3, number))
        tensors[name] = half + half.swapaxes(0, 1)
    tensors["A"] = (
        0.2 * tensors["A"] + np.array([1.0, 1.5, 2.0])[:, None, None] * np.eye(3)[:, :, None]
    )
    moment, s, w, nu = rng.uniform(-0.5, 0.5, (4, 3, number))
    nu = nu / np.sqrt((nu * nu).sum(0))
    body = {
        f"{name}{key}": along(of[int(key[0]) - 1, int(key[1]) - 1])
        for name, of in tensors.items()
        for key in KEYS
    }
    for name, vector in (("lambda", moment), ("s", s), ("omega", w), ("gamma", nu)):
        body |= {f"{name}{i + 1}": along(vector[i]) for i in range(3)}
    ds, reduced = timed("gyrostat_body", question="trajectory", t=5.0, **body)
    inverse = np.linalg.inv(tensors["A"].transpose(2, 0, 1)).transpose(1, 2, 0)

    def by(matrix, vector):
        return np.einsum("ijn,jn->in", matrix, vector)

    def slope(t, y):
        w, nu = y[:3], y[3:]
        torque = np.cross(by(tensors["A"], w) + moment, w, axis=0) + np.cross(
            by(tensors["B"], w), nu, axis=0
        )
        torque = torque + np.cross(nu, by(tensors["C"], nu), axis=0) + np.cross(s, nu, axis=0)
        return np.concatenate([by(inverse, torque), np.cross(nu, w, axis=0)])

    clock = time.process_time()
    end = integrate(slope, np.concatenate([w, nu]), np.full(number, 5.0), 400)
    full = time.process_time() - clock
    off = np.max([abs(ds[name].values - x) for name, x in zip(BODY, end, strict=True)], axis=0)
    return row(
        "`gyrostat_body`",
        "equations (1)-(6), by another program",
        "w and nu at t = 5",
        number,
        off,
        full,
        reduced,
    )


def gyrostat_integrable(number, rng):
    """The flow on the cylinder where b = 0: A11 phi'' = (C33 - C22) sin 2 phi / 2 - C23 cos 2 phi +
    S2 cos - S3 sin.
    """
    number = max(number // 10, 50)
    a11 = rng.uniform(0.5, 2.0, number)
    c22, c33, c23, s2, s3 = rng.uniform(-1.0, 1.0, (5, number))
    phi0, w0 = rng.uniform(0.0, 6.0, number), rng.uniform(3.0, 5.0, number)  # it turns for ever
    given = {
        "A11": a11,
        "C22": c22,
        "C33": c33,
        "C23": c23,
        "S2": s2,
        "S3": s3,
        "phi0": phi0,
        "w0": w0,
    }
    asked = {"case": "elliptic", "t": 5.0, "variables": ["phi", "w"]} | {
        name: along(v) for name, v in given.items()
    }
    ds, reduced = timed("gyrostat_integrable", **asked)

    def slope(t, y):
        sin, cos = np.sin(y[0]), np.cos(y[0])
        bend = (c33 - c22) * sin * cos - c23 * (cos * cos - sin * sin) + s2 * cos - s3 * sin
        return np.array([y[1], bend / a11])

    clock = time.process_time()
    end = integrate(slope, np.array([phi0, w0]), np.full(number, 5.0), 400)
    full = time.process_time() - clock
    off = np.maximum(abs(ds.phi.values - end[0]), abs(ds.w.values - end[1]))
    return row(
        "`gyrostat_integrable`",
        "the flow on the cylinder",
        "angle and rate at t = 5",
        number,
        off,
        full,
        reduced,
    )


def mathieu(number, rng):
    """A pendulum whose support moves up and down: x'' + (a - 2 q cos 2t) sin x = 0, about its rest."""
    number = max(number // 10, 50)
    a, q = rng.uniform(0.0, 20.0, number), rng.uniform(0.0, 8.0, number)
    ds, reduced = timed("mathieu", a=along(a), q=along(q), variables=["discriminant"])

    def slope(t, y):
        return np.array([y[1], -(a - 2 * q * np.cos(2 * t)) * np.sin(y[0])])

    clock = time.process_time()
    trace = 0.0
    for i in (0, 1):
        y = np.zeros((2, number), complex)
        y[i] += 1j * TINY
        trace = trace + integrate(slope, y, np.full(number, np.pi), 600)[i].imag / TINY
    full = time.process_time() - clock
    off = abs(trace - ds.discriminant.values) / (1 + abs(trace))
    return row(
        "`mathieu`",
        "a pendulum on a moving support",
        "trace over a period",
        number,
        off,
        full,
        reduced,
    )


def libration(number, rng):
    """The spatial circular problem about L4: the frequencies of what is small, from the flow over a
    unit of time.
    """
    number = max(number // 10, 50)
    mu = rng.uniform(1e-3, 0.038, number)
    ds, reduced = timed("libration", mu=along(mu))
    point = np.array([0.5 - mu, np.full(number, np.sqrt(0.75)), 0 * mu])

    def slope(t, y):
        x, v = y[:3], y[3:]
        pull = 0.0
        for mass, at in ((1 - mu, -mu), (mu, 1 - mu)):
            apart = np.array([x[0] - at, x[1], x[2]])
            pull = pull - mass * apart / (apart * apart).sum(0) ** 1.5
        return np.concatenate([v, [x[0] + pull[0] + 2 * v[1], x[1] + pull[1] - 2 * v[0], pull[2]]])

    clock = time.process_time()
    matrix = np.empty((number, 6, 6))
    for j in range(6):
        y = np.concatenate([point, 0 * point]).astype(complex)
        y[j] += 1j * TINY
        matrix[:, :, j] = (integrate(slope, y, np.ones(number), 200).imag / TINY).T
    angles = np.sort(np.angle(np.linalg.eigvals(matrix)), axis=1)[:, 3:]
    full = time.process_time() - clock
    said = np.sort([ds.omega2.values, ds.omega1.values, np.ones(number)], axis=0).T
    return row(
        "`libration`", "the spatial circular problem about L4", "omega1, omega2, 1 (order 2)", number,
        abs(angles - said).max(axis=1), full, reduced,
    )  # fmt: skip


KEYS = ("11", "22", "33", "12", "23", "31")
BODY = ("w1", "w2", "w3", "nu1", "nu2", "nu3")
CHECKS = (
    satellite,
    mathieu,
    gyrostat,
    gyrostat_body,
    gyrostat_integrable,
    brun,
    libration,
    libration_elliptic,
)


def along(values):
    """A value for each point: DataArrays that share a dimension are taken point by point."""
    return xr.DataArray(np.asarray(values), dims="n")


def timed(scene, **asked):
    """A survey, and the processor time of the second run of it."""
    survey.evaluate(scene, **asked)
    clock = time.process_time()
    return survey.evaluate(scene, **asked), time.process_time() - clock


def row(scene, full, compared, number, off, seconds, reduced):
    ratio = seconds / max(reduced, 1e-6)
    return (
        scene, full, compared, f"{number:,}", f"{np.median(off):.0e}", f"{off.max():.0e}",
        f"{seconds / number * 1e6:,.0f}", f"{reduced / number * 1e6:,.1f}", f"{ratio:,.0f}",
    )  # fmt: skip


PAGE = """# Reduced and full models, measured

Made by `python workflows/models.py --points {points}`. Random points of each scene's domain; the full model is
integrated without the reduction, small deviations by a complex step. "off": their difference, most of which is the
error of the integration, whose steps are fixed. Times are processor time for a point, of this integration (numpy, many
points side by side, no attempt at speed) and of the scene with all its error bars, overhead of the call included.

| scene | full model | compared | points | off, median | off, largest | full, us | scene, us | ratio |
|---|---|---|---|---|---|---|---|---|
{rows}
"""

if __name__ == "__main__":
    main()
