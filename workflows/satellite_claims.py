"""Astakhova's printed formulas, tested: a page and a map for a reader of the paper.

    python workflows/satellite_claims.py [-o results]

Needs scipy: pip install -e ".[test]". The corrections are derived in survey/scenes/satellite.md;
here they and the printed ones are checked against the rigid body itself: Euler's equations with
direction cosines and gravity gradient.
"""

# ruff: noqa: E501  (the rows of the page's tables)

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from scipy.integrate import solve_ivp
from scipy.special import ellipe, ellipj, ellipk
from script import parser, say

import survey
from survey.show.palette import COLOURS

BODIES = ("prolate", "oblate")
LEAST_RHO = 3**-0.5  # the thin rod and the flat disc; every other body has a larger |rho|
CASES = (
    ("prolate", 0.5, 0.8), ("prolate", 0.85, 0.69), ("prolate", 0.95, 1.4),
    ("oblate", 0.3, 0.9), ("oblate", 0.6, 1.1), ("oblate", 0.9, 0.65),
    ("prolate", 1.2, 0.69), ("prolate", 1.2, -0.69), ("oblate", 1.6, 0.8), ("oblate", 1.6, -0.8),
)  # fmt: skip
# a body, its orbital rate and its spin; none is 1, or a missing factor would hide
IT, IZ, W0, WZ = 1.3, 0.5, 0.7, 0.6
START = (0.4, 0.3, 0.5, -0.4)  # x, y and their derivatives by tau
STEP = 1e-25  # of complex-step derivatives: exact to rounding


def rigid_body(t, state, inertia, w0):
    """Euler's equations with the gravity-gradient torque; the body's axes, resolved in space;
    motions side by side.
    """
    axes, (p, q, r) = np.split(state.reshape(12, -1), [9])
    axes = axes.reshape(3, 3, -1)
    a, b, c = np.cos(w0 * t) * axes[:, 0] + np.sin(w0 * t) * axes[:, 1]
    first, second, third = inertia
    pull = 3 * w0 * w0
    turned = np.stack(
        [r * axes[1] - q * axes[2], p * axes[2] - r * axes[0], q * axes[0] - p * axes[1]]
    )
    spun = np.stack([
        (second - third) * (q * r - pull * b * c) / first,
        (third - first) * (r * p - pull * c * a) / second,
        (first - second) * (p * q - pull * a * b) / third,
    ])  # fmt: skip
    return np.concatenate([turned.ravel(), spun.ravel()])


def body_trace(body, k, rho, tolerance=1e-13):
    """Trace of the out-of-plane monodromy of the rigid body, by complex steps off its planar motion."""
    alpha = 1 + (1 if body == "oblate" else -1) / (3 * rho * rho)
    # at u = 0 the axis is on the vertical, or (oblate) on the tangent; the first axis is the
    # orbit's normal
    third = np.array([1.0, 0, 0]) if body == "prolate" else np.array([0, 1.0, 0])
    axes = np.array([[0, 0, 1.0], np.cross(third, [0, 0, 1.0]), third])
    # the change of the axes in a turn about the second
    tilt = np.array([-axes[2], 0 * third, axes[0]])
    state = np.zeros((12, 2), complex)
    state[:9, 0], state[:9, 1] = (axes + 1j * STEP * tilt).ravel(), axes.ravel()
    state[9], state[10, 1] = 1 + k / rho, 1j * STEP
    solved = solve_ivp(rigid_body, (0, abs(rho) * period(k)), state.ravel(), "DOP853", args=((1, 1, alpha), 1.0),
                       rtol=tolerance, atol=tolerance)  # fmt: skip
    end = solved.y[:, -1].reshape(12, 2)
    tilted, tilting = end[8, 0], (end[10] * end[2] - end[9] * end[5])[1]
    return (tilted + tilting).imag / STEP


def period(k):
    """T = 4 K(k), or 2 K(1/k) / k of rotations."""
    return 4 * ellipk(k * k) if k < 1 else 2 * ellipk(1 / k**2) / k


def rate(u, k):
    """w = dx/du of the planar motion."""
    _, cn, dn, _ = ellipj(u, k * k) if k < 1 else ellipj(k * u, 1 / k**2)
    return k * (cn if k < 1 else dn)


def constant(body, k):
    """c of the corrected z = 2 w^2 + 2 rho w + rho^2 + c; printed: k^2."""
    return 1 - k * k if body == "prolate" else -k * k


def hill_trace(k, rho, c, tolerance=1e-12):
    """Trace of the monodromy of y'' + (2 w^2 + 2 rho w + rho^2 + c) y = 0."""

    def equations(u, state):
        w = rate(u, k)
        return [state[2], state[3], *(-(2 * w * w + 2 * rho * w + rho * rho + c) * state[:2])]

    end = solve_ivp(
        equations, (0, period(k)), [1, 0, 0, 1], "DOP853", rtol=tolerance, atol=tolerance
    ).y[:, -1]
    return end[0] + end[3]


def traces():
    """The cases' traces: rigid body, survey, the printed z, and the printed z with only its
    constant corrected.
    """
    rows = []
    for body, k, rho in CASES:
        known = float(
            survey.evaluate("satellite", k=k, rho=rho, body=body, rtol=1e-13).discriminant
        )
        wrong = hill_trace(k, -rho, k * k), hill_trace(k, -rho, constant(body, k))
        rows.append((body, k, rho, body_trace(body, k, rho), known, *wrong))
    return rows


def samples(count=1000, seed=1):
    """Random bodies, orbits, spins and states: a dictionary of columns; x, y as in the paper, and
    their rates.
    """
    random = np.random.default_rng(seed)
    low = dict(I=0.5, Iz=0.2, w0=0.3, wz=-1, x=-np.pi, y=-1.5, dx=-1.5, dy=-1.5, phi=-np.pi)
    high = dict(I=2, Iz=2, w0=1.5, wz=1, x=np.pi, y=1.5, dx=1.5, dy=1.5, phi=np.pi)
    return {name: random.uniform(low[name], high[name], count) for name in low}


def euler(s, branch):
    """theta, its rate and phi's from x, y and the spin, where cos theta = branch th y."""
    theta = np.arccos(branch * np.tanh(s["y"]))
    return theta, -branch * s["dy"] / np.cosh(s["y"]), s["wz"] - (s["dx"] + s["w0"]) * np.cos(theta)


def lagrangian(s, branch=1):
    """T - U of the rigid body from its rotation matrix (no formula of the paper), and the spin momentum."""
    theta, dtheta, dphi = euler(s, branch)
    step = 1j * STEP
    attitude = [turn(*pair) for pair in (
        (s["x"] + step * (s["dx"] + s["w0"]), 2), (theta + step * dtheta, 0), (s["phi"] + step * dphi, 2))]  # fmt: skip
    matrix = attitude[0] @ attitude[1] @ attitude[2]
    spin = np.swapaxes(matrix.real, -1, -2) @ matrix.imag / STEP
    omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]])
    inertia = np.stack([s["I"], s["I"], s["Iz"]])
    along = matrix.real[:, 0]  # the vertical, in the body
    potential = 1.5 * s["w0"] ** 2 * (np.sum(inertia * along.T**2, axis=0) - s["I"])
    return 0.5 * np.sum(inertia * omega**2, axis=0) - potential, inertia[2] * omega[2]


def turn(angle, axis):
    """Rotation matrices about a coordinate axis."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = np.zeros((angle.size, 3, 3), complex)
    matrix[:, axis, axis] = 1
    matrix[:, i, i] = matrix[:, j, j] = np.cos(angle)
    matrix[:, j, i], matrix[:, i, j] = np.sin(angle), -np.sin(angle)
    return matrix


def printed_lagrangian(s, corrected):
    """L in Euler's angles: as printed (T read as I, theta^2 as theta'^2), or with its brackets corrected."""
    theta, dtheta, dphi = euler(s, 1)
    total = s["dx"] + s["w0"]
    flat, spun = (
        dtheta**2 + (total * np.sin(theta)) ** 2,
        2 * dphi * total * np.cos(theta) + dphi**2,
    )
    up = (total * np.cos(theta)) ** 2
    energy = (
        s["I"] / 2 * flat + s["Iz"] / 2 * (up + spun)
        if corrected
        else s["I"] / 2 * (flat + s["Iz"] / 2 * up + spun)
    )
    return (
        energy - 1.5 * s["w0"] ** 2 * (s["Iz"] - s["I"]) * np.sin(s["x"]) ** 2 * np.sin(theta) ** 2
    )


def routhian(s, branch, first=None, gravity=None):
    """R in x and y, cos theta = branch th y; `first` and `gravity` replace its first and its sin^2 term."""
    ch2, th = np.cosh(s["y"]) ** 2, branch * np.tanh(s["y"])
    first = -s["Iz"] / 2 * s["wz"] ** 2 if first is None else first
    gravity = 1.5 * s["w0"] ** 2 * (s["Iz"] - s["I"]) if gravity is None else gravity
    spin = s["Iz"] * s["wz"] * th
    return (
        first + s["I"] * s["w0"] ** 2 / (2 * ch2) + s["w0"] * spin - gravity * np.sin(s["x"]) ** 2 / ch2
        + s["dx"] * (s["I"] * s["w0"] / ch2 + spin) + s["I"] / 2 * (s["dx"] ** 2 + s["dy"] ** 2) / ch2
    )  # fmt: skip


def off(values, truth):
    """Root mean square of the error over that of the truth."""
    return float(np.sqrt(np.mean((values - truth) ** 2) / np.mean(truth**2)))


def formula_errors():
    """{printed thing: relative error} at random states; "... corrected" are zero to rounding."""
    s = samples()
    energy, momentum = lagrangian(s)
    theta, _, dphi = euler(s, 1)
    routh = {branch: lagrangian(s, branch) for branch in (1, -1)}
    routh = {b: value - spin * euler(s, b)[2] for b, (value, spin) in routh.items()}
    return {
        "L": off(printed_lagrangian(s, False), energy),
        "L corrected": off(printed_lagrangian(s, True), energy),
        "cyclic": off(s["Iz"] * (dphi + (s["dx"] + s["w0"]) * np.cos(theta)), momentum),
        "R first": off(routhian(s, -1, first=-s["Iz"] / s["I"] * s["wz"]), routh[-1]),
        "R gravity": off(routhian(s, -1, gravity=s["I"] * s["wz"] / 2), routh[-1]),
        "R branch": off(routhian(s, -1), routh[1]),
        "R corrected": max(off(routhian(s, b), routh[b]) for b in (1, -1)),
    }


def point(t, state, misprint, h):
    """Equations (2) of the point in the plane, by time t (d tau = ch^2 y dt)."""
    x, y, dx, dy = state
    _, slope_x, slope_y = potential(x, y, misprint, h)
    sech2 = np.cosh(y) ** -2
    gyro = -2 * W0 * np.tanh(y) * sech2 + IZ / IT * WZ * sech2
    gyro = -gyro if misprint == "Phi" else gyro
    return np.array([dx, dy, slope_x - dy * gyro, slope_y + dx * gyro]) / sech2


def potential(x, y, misprint, h):
    """V of equation (1) and its derivatives; misprints: "w0", "cos^2"."""

    def value(x, y):
        ch2 = np.cosh(y) ** 2
        wave = np.cos(x) if misprint == "cos^2" else np.sin(x)
        spin = IZ * WZ * (1 if misprint == "w0" else W0)
        inside = (
            h
            + spin * np.tanh(y)
            - IZ * WZ**2 / 2
            + (IT / 2 + 1.5 * (IT - IZ) * wave**2) * W0**2 / ch2
        )
        return inside / (IT * ch2)

    return value(x, y), value(x + 1j * STEP, y).imag / STEP, value(x, y + 1j * STEP).imag / STEP


def axis(x, y):
    """Direction of the axis in the orbital frame: vertical, tangent, normal."""
    return np.array([np.sin(x), -np.cos(x), np.sinh(y)]) / np.cosh(y)


def trajectory(misprint=None, orbits=1.0, tolerance=1e-12):
    """Largest angle in degrees between the rigid body's axis and (2)'s, and Jacobi's residual, over
    an orbit.
    """
    x, y, dx, dy = START
    end = orbits * 2 * np.pi / W0
    times = np.linspace(0, end, 200)
    ch = np.cosh(y)
    axes = (turn(np.array([x]), 2) @ turn(np.array([np.arccos(np.tanh(y))]), 0))[0].real.T
    spin = [-ch * dy, (ch * ch * dx + W0) / ch, WZ]
    how = {"method": "DOP853", "rtol": tolerance, "atol": tolerance, "t_eval": times}
    body = solve_ivp(rigid_body, (0, end), [*axes.ravel(), *spin], args=((IT, IT, IZ), W0), **how)
    east, north, height = body.y[6:9]
    c, s = np.cos(W0 * times), np.sin(W0 * times)
    true = np.array([c * east + s * north, c * north - s * east, height])
    # the Jacobi integral (1) at the start fixes h, unless the misprint is that there is none
    level, slope = (potential(x, y, misprint, h)[0] for h in (0.0, 1.0))
    h = 0.0 if misprint == "h" else ((dx * dx + dy * dy) / 2 - level) / (slope - level)
    solved = solve_ivp(point, (0, end), START, args=(misprint, h), **how).y
    chord = np.linalg.norm(axis(*solved[:2]) - true, axis=0)
    square = (solved[2] ** 2 + solved[3] ** 2) - 2 * potential(*solved[:2], misprint, h)[0]
    return float(np.degrees(2 * np.arcsin(np.minimum(chord / 2, 1))).max()), float(
        abs(square).max()
    )


def lyapunov(body, k, rho):
    """T int z dv, the least z, T, and the printed z's T int z (all over one period; arrays)."""
    rotates = k > 1
    m = np.where(rotates, 1 / np.maximum(k, 1) ** 2, k * k)
    first, second = ellipk(m), ellipe(m)
    length = np.where(rotates, 2 * first / np.maximum(k, 1), 4 * first)
    squares = np.where(rotates, 2 * k * second, 8 * (second - (1 - m) * first))  # integral of w^2
    drift = np.where(rotates, np.pi * rho, 0)  # integral of rho w
    c = constant(body, k)
    low = np.where(rotates, np.sqrt(abs(k * k - 1)), -k)
    w = np.clip(-rho / 2, low, k)
    least = 2 * w * w + 2 * rho * w + rho * rho + c
    total = length * (2 * squares + 2 * drift + (rho * rho + c) * length)
    literal = length * (2 * squares - 2 * drift + (rho * rho + k * k) * length)
    return total, least, length, literal


def librations(body, size=300):
    """The map of librations, with what the printed and the corrected criterion say of each point."""
    k, rho = (np.arange(size) + 0.5) / size, np.linspace(LEAST_RHO, 3, size)
    ds = survey.evaluate("satellite", k=k, rho=rho, body=body, variables=["verdict", "lyapunov"])
    return classified(ds, body)


def rotations(body, size=300):
    """The map of rotations over 1/k and r = rho / k."""
    inverse = xr.DataArray((np.arange(size) + 0.5) / size, dims="inverse")
    ratio = xr.DataArray(np.linspace(-2.2, 0.4, size), dims="r")
    ds = survey.evaluate(
        "satellite",
        k=1 / inverse,
        rho=ratio / inverse,
        body=body,
        variables=["verdict", "lyapunov"],
    )
    return classified(ds.assign_coords(inverse=inverse, r=ratio), body)


def classified(ds, body):
    """Add T int z, the least z, and the points that the printed criterion, and the corrected one,
    call stable.
    """
    k, rho = xr.broadcast(ds.k, ds.rho)
    total, least, length, literal = (
        xr.DataArray(v, dims=k.dims).transpose(*ds.verdict.dims)
        for v in lyapunov(body, k.values, rho.values)
    )
    ds["total"], ds["least"] = total, least
    ds["printed"] = (least >= 0) & (total <= 4 * length**2)
    ds["literal"] = literal <= 4 * length**2
    ds["without_sign"] = total <= 4
    ds["certified"] = ds.lyapunov == 1
    ds["physical"] = abs(rho).transpose(*ds.verdict.dims) >= LEAST_RHO
    ds["unstable"] = ds.verdict == 0
    return ds


PAGE = """# Astakhova's printed formulas, tested

Made by `python workflows/satellite_claims.py`. Source: I. S. Astakhova, *Transformation of satellite equations to Hill's
equation*. Each printed formula is checked against the rigid body itself (Euler's equations with direction cosines and
gravity gradient), never against another formula; the corrections are derived in `survey/scenes/satellite.md`.

## Formulas, at 1000 random states (rms of the error over rms of the value)

| formula | as printed | corrected |
|---|---|---|
| L (T read as I, theta^2 as theta'^2; brackets) | {L:.0%} | {L_corrected:.0e} |
| cyclic integral | {cyclic:.0e} (right) | |
| Routhian, first term -(Iz/I) wz0; a constant, so the motion is unharmed | {R_first:.0%} | -(Iz/2) wz0^2: {R_corrected:.0e} |
| Routhian, sin^2 term I wz0 / 2 | {R_gravity:.0%} | I wp^2 / 2: {R_corrected:.0e} |
| Routhian with cos theta = -th y, where V has + | {R_branch:.0%} | one branch: {R_corrected:.0e} |

## Equations (1), (2): the axis over one orbit, with spin

| version | largest angle to the rigid body's axis |
|---|---|
| corrected | {corrected[0]:.0e} deg |
| Phi with the printed sign | {Phi[0]:.0f} deg |
| V without the energy h | {h[0]:.1f} deg |
| V with Iz wz0 th y, without w0 | {w0[0]:.1f} deg |
| V with cos^2 x, x as in L | {cos2[0]:.0f} deg |

## Equation (3): y'' + z y = 0, trace of the monodromy

Printed: z = 2 w^2 - 2 rho w + rho^2 + k^2. True: z = 2 w^2 + 2 rho w + rho^2 + c, c = 1 - k^2 (prolate), -k^2 (oblate).
The sign of rho is immaterial for librations; with it as printed, rotations with the orbit and against it change places.

| body, k, rho | rigid body | survey, off by | printed z | with c corrected alone |
|---|---|---|---|---|
{traces}

## Lyapunov's criterion

Printed: stable if z >= 0, "always", and int_0^T z <= 4 T. True: T int_0^T z <= 4; and z < 0 somewhere at {negative:,} of
{points:,} points of the oblate map. **The corrected criterion certifies no libration of any body**, so the paper's conclusion
(planar motions are stable by it) does not follow. For every amplitude and every body, with rho^2 >= 1/3:

- prolate: T int z = 16 K^2 (rho^2 - k'^2) + 32 K E >= 4 pi^2 (1 + rho^2) > 4, as K E >= pi^2 / 4, K >= pi / 2, k' K <= pi / 2;
- oblate: T int z = 16 K^2 (rho^2 - k^2) + 32 K (E - k'^2 K) >= 2 pi^2 rho^2 > 4 wherever z >= 0, that is k^2 <= rho^2 / 2.

| librations, {side} x {side} points, rho from 1/sqrt(3) to 3 | prolate | oblate |
|---|---|---|
| unstable points | {unstable} |
| certified by the corrected criterion | {certified} |
| "certified" by the printed inequality, with the true z | {printed} |
| of these unstable | {wrong} |
| least T int z on the map where z >= 0 (certifies below 4) | {least} |

Rotations against the orbit are another matter: the corrected criterion certifies {turned} points of the maps below, and
{contradicted} of them are unstable.

![where the printed criterion is wrong, and where the corrected one certifies](satellite_claims.png)
"""


def main():
    folder = parser(__doc__, "the page and its map").parse_args().output
    say("rigid body against equation (3)")
    rows = [
        f"| {body}, {k:g}, {rho:g} | {true:.4f} | {abs(true - known):.0e} | {printed:.4f} | {sign:.4f} |"
        for body, k, rho, true, known, printed, sign in traces()
    ]
    say("rigid body against equations (1), (2)")
    paths = {
        (name or "corrected").replace("^", ""): trajectory(name)
        for name in (None, "Phi", "h", "w0", "cos^2")
    }
    say("Lyapunov's criterion")
    maps, turns = [librations(body) for body in BODIES], [rotations(body) for body in BODIES]
    errors = {name.replace(" ", "_"): value for name, value in formula_errors().items()}
    number = [
        [
            int(ds.unstable.sum()),
            int(ds.certified.sum()),
            int(ds.printed.sum()),
            int((ds.printed & ds.unstable).sum()),
        ]
        for ds in maps
    ]
    cells = [" | ".join(f"{values[i]:,}" for values in number) for i in range(4)]
    page = PAGE.format(
        **errors, **paths, traces="\n".join(rows), side=maps[0].sizes["k"], points=maps[0].verdict.size,
        negative=int((maps[1].least < 0).sum()),
        unstable=cells[0], certified=cells[1], printed=cells[2], wrong=cells[3],
        least=" | ".join(f"{float(ds.total.where(ds.least >= 0).min()):.2f}" for ds in maps),
        turned=f"{sum(int(ds.certified.sum()) for ds in turns):,}",
        contradicted=sum(int((ds.certified & ds.unstable).sum()) for ds in turns),
    )  # fmt: skip
    (folder / "satellite_claims.md").write_text(page, encoding="utf-8")
    draw(maps, turns, folder / "satellite_claims.png")
    print(folder / "satellite_claims.md", folder / "satellite_claims.png", sep="\n")


def draw(maps, turns, path):
    """Where the printed criterion is wrong (librations), and where the corrected one certifies
    (rotations).
    """
    figure, panels = plt.subplots(2, 2, figsize=(10, 8.4), layout="constrained")
    colours = ListedColormap(COLOURS[:2])
    for axes, ds, body in zip(panels[0], maps, BODIES, strict=True):
        axes.pcolormesh(ds.k, ds.rho, ds.verdict.T, cmap=colours, vmin=0, vmax=1, rasterized=True)
        hatch(axes, ds.k, ds.rho, (ds.printed & ds.unstable).T, "///")
        axes.set(
            title=f"librations, {body}",
            xlabel="modulus, $k$",
            ylabel=r"orbital rate over libration rate, $\rho$",
        )
    for axes, ds, body in zip(panels[1], turns, BODIES, strict=True):
        shown = ds.verdict.transpose("r", "inverse")
        axes.pcolormesh(ds.inverse, ds.r, shown, cmap=colours, vmin=0, vmax=1, rasterized=True)
        hatch(axes, ds.inverse, ds.r, ds.certified.transpose("r", "inverse"), "...")
        axes.set(
            title=f"rotations, {body}",
            xlabel="$1/k$",
            ylabel=r"$r = \rho / k$ (negative: against the orbit)",
        )
    handles = [
        Patch(facecolor=colour, label=name)
        for colour, name in zip(COLOURS, ("unstable", "stable"), strict=False)
    ]
    for pattern, name in (
        ("///", "unstable, printed criterion says stable"),
        ("...", "certified by the corrected criterion"),
    ):
        handles.append(Patch(facecolor="none", edgecolor="black", hatch=pattern, label=name))
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    figure.suptitle("Lyapunov's criterion on a satellite's planar motions")
    figure.savefig(path, dpi=150)
    plt.close(figure)


def hatch(axes, x, y, where, pattern):
    if where.any():
        axes.contourf(
            x, y, where.astype(float), levels=[0.5, 1.5], colors="none", hatches=[pattern]
        )


if __name__ == "__main__":
    main()
