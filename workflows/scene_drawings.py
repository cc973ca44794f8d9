"""The drawings of the scenes' pages: each system with its axes and angles.

python workflows/scene_drawings.py -o results
"""

import argparse
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("agg")
import matplotlib.pyplot as plt
from matplotlib.patches import Arc, Circle, Ellipse, FancyArrowPatch, Polygon

INK, BODY, PALE, MARK = "#222222", "#b9cfe4", "#999999", "#c04010"


def main():
    words = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    words.add_argument(
        "-o", "--output", type=Path, default=Path("results"), help="folder of the drawings"
    )
    folder = words.parse_args().output
    for scene, draw in DRAWINGS.items():
        name = f"drawing_{scene}.png"
        draw().savefig(folder / name, dpi=110)
        plt.close("all")


def satellite():
    figure, (orbit, side) = _panels(2, "in the plane of the orbit", "the tilt out of it")
    _ball(orbit, (0, 0), 0.28, "centre")
    orbit.add_patch(Arc((0, 0), 4, 4, theta1=-25, theta2=105, color=PALE, linestyle="--"))
    at = 2 * _unit(40)
    _line(orbit, 0.35 * _unit(40), 1.65 * at, PALE, "--")
    orbit.text(*(1.66 * at), "local vertical", color=PALE, va="top", ha="left")
    axis = _unit(75)
    _rod(orbit, at, axis, 0.75)
    _arrow(orbit, at, at + 1.35 * axis, INK)
    orbit.text(*(at + 1.4 * axis), "axis of symmetry", ha="center", va="bottom")
    _angle(orbit, at, 2.0, 40, 75, r"$\psi_v$")
    _arrow(orbit, 2 * _unit(2), 2 * _unit(16), PALE, bend=0.06)
    orbit.text(2.1, 0.2, r"$\omega_0$", color=PALE)
    _limits(orbit, (-0.5, 3.6), (-0.9, 3.3))
    _line(side, (-1.5, 0), (1.9, 0), PALE, "--")
    side.text(1.9, -0.06, "plane of the orbit", color=PALE, ha="right", va="top")
    _arrow(side, (0, 0), (0, 1.7), PALE)
    side.text(0.06, 1.7, "normal", color=PALE)
    axis = _unit(24)
    _rod(side, np.zeros(2), axis, 0.9)
    _arrow(side, (0, 0), 1.6 * axis, INK)
    _angle(side, (0, 0), 2.3, 0, 24, r"$y$", MARK)
    side.text(*(1.65 * axis), "axis", va="bottom")
    _limits(side, (-1.6, 2.1), (-1.2, 2.0))
    return figure


def satellite_triaxial():
    figure, (orbit, side) = _panels(2, "in the plane of the orbit", "the tilts out of it")
    _ball(orbit, (0, 0), 0.28, "centre")
    orbit.add_patch(Arc((0, 0), 4, 4, theta1=-25, theta2=105, color=PALE, linestyle="--"))
    at = 2 * _unit(40)
    _line(orbit, 0.35 * _unit(40), 1.75 * at, PALE, "--")
    orbit.text(*(1.78 * at), "local vertical", color=PALE, va="top", ha="left")
    first, second = _unit(62), _unit(152)
    corners = [
        at + 0.75 * i * first + 0.3 * j * second for i, j in ((1, 1), (1, -1), (-1, -1), (-1, 1))
    ]
    orbit.add_patch(Polygon(corners, facecolor=BODY, edgecolor=INK))
    _arrow(orbit, at, at + 1.3 * first, INK)
    orbit.text(*(at + 1.38 * first), "A", ha="center", va="bottom")
    _arrow(orbit, at, at + 1.1 * second, INK)
    orbit.text(*(at + 1.2 * second), "B", ha="right", va="center")
    _angle(orbit, at, 1.9, 40, 62, "$x$", MARK)
    _arrow(orbit, 2 * _unit(2), 2 * _unit(16), PALE, bend=0.06)
    orbit.text(2.1, 0.2, r"$\omega_0$", color=PALE)
    _limits(orbit, (-0.5, 3.9), (-0.9, 3.5))
    _arrow(side, (0, 0), (0, 1.7), PALE)
    side.text(0.06, 1.7, "normal of the orbit", color=PALE)
    _line(side, (-1.5, 0), (1.9, 0), PALE, "--")
    side.text(1.9, -0.06, "plane of the orbit", color=PALE, ha="right", va="top")
    axis, across = _unit(70), _unit(-20)
    corners = [0.9 * i * across + 0.3 * j * axis for i, j in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    side.add_patch(Polygon(corners, facecolor=BODY, edgecolor=INK))
    _arrow(side, (0, 0), 1.5 * axis, INK)
    side.text(*(1.55 * axis), "C", va="bottom", ha="center")
    _angle(side, (0, 0), 2.2, 70, 90, r"$\varepsilon$", MARK)
    _limits(side, (-1.6, 2.1), (-1.2, 2.1))
    return figure


def mathieu():
    figure, (pendulum, trap) = _panels(
        2, "a pendulum on a vibrating pivot", "an ion in a quadrupole (Paul) trap"
    )
    _arrow(pendulum, (0, -0.35), (0, 0.35), MARK, "<->")
    pendulum.text(0.12, 0.2, r"$\propto\cos 2t$", color=MARK)
    bob = 1.7 * _unit(-65)
    _line(pendulum, (0, 0), (0, -1.9), PALE, "--")
    _line(pendulum, (0, 0), bob, INK)
    _ball(pendulum, bob, 0.14)
    _ball(pendulum, (0, 0), 0.05)
    _angle(pendulum, (0, 0), 1.5, -90, -65, "$y$")
    _limits(pendulum, (-1.4, 1.7), (-2.1, 0.7))
    bent = np.linspace(-1.1, 1.1, 50)
    for sign in (1, -1):
        for x, y in ((bent, sign * np.sqrt(0.6 + bent**2)), (sign * np.sqrt(0.6 + bent**2), bent)):
            trap.plot(x, y, color=INK, linewidth=2)
    _ball(trap, (0.25, 0.12), 0.07)
    for at, words in (((0, 1.05), r"$-\Phi/2$"), ((0.83, 0), r"$+\Phi/2$")):
        trap.text(*at, words, color=MARK, ha="center" if at[0] == 0 else "left", va="center")
    _arrow(trap, (0, 0), (0.6, 0), PALE)
    _arrow(trap, (0, 0), (0, 0.6), PALE)
    trap.text(0.5, -0.2, "$x$", color=PALE)
    trap.text(-0.16, 0.48, "$y$", color=PALE)
    _limits(trap, (-1.5, 2.2), (-1.5, 1.5))
    return figure


def gyrostat():
    figure, (body, turn) = _panels(
        2, "the body turns about its axis 1", r"the angle $\varphi$, seen along axis 1"
    )
    body.add_patch(Ellipse((0, 0), 2.2, 1.3, facecolor=BODY, edgecolor=INK))
    body.add_patch(Ellipse((-0.45, 0), 0.28, 0.8, facecolor="white", edgecolor=INK))
    body.text(-0.45, -0.74, r"rotor, $\lambda$", ha="center", va="top")
    _arrow(body, (-1.7, 0), (2.1, 0), INK)
    body.text(2.1, 0.08, r"axis 1, $\omega=\dot\varphi$", ha="right", va="bottom")
    _arrow(body, (0, 0), 1.7 * _unit(60), MARK)
    body.text(*(1.75 * _unit(60)), r"$\nu$, the vertical", color=MARK, va="bottom")
    _angle(body, (0, 0), 1.1, 0, 60, r"$\theta$")
    _limits(body, (-1.8, 2.3), (-1.2, 2.0))
    _axes_with(turn, 90 - 35)
    return figure


def _axes_with(axes, degrees):
    axes.add_patch(Circle((0, 0), 1, facecolor=BODY, edgecolor=INK))
    _arrow(axes, (0, 0), (1.6, 0), INK)
    _arrow(axes, (0, 0), (0, 1.6), INK)
    axes.text(1.6, 0.08, "axis 2", ha="right", va="bottom")
    axes.text(-0.08, 1.6, "axis 3", ha="right", va="top")
    _arrow(axes, (0, 0), 1.45 * _unit(degrees), MARK)
    axes.text(*(1.5 * _unit(degrees)), r"$\nu$, its part across axis 1", color=MARK, va="bottom")
    _angle(axes, (0, 0), 1.0, degrees, 90, r"$\varphi$")
    _limits(axes, (-1.4, 2.6), (-1.3, 1.9))


def gyrostat_body():
    figure, (body, beside) = _panels(
        2, "the axis of rotation in the body", "motions beside the set"
    )
    body.add_patch(Ellipse((0, 0), 2.6, 1.4, angle=20, facecolor=BODY, edgecolor=INK))
    for degrees, words in ((20, "x"), (110, "y")):
        _arrow(body, (0, 0), 1.8 * _unit(degrees), PALE)
        body.text(*(1.88 * _unit(degrees)), f"axis {words} of the body", color=PALE, ha="center")
    _arrow(body, (0, 0), 1.9 * _unit(55), INK)
    body.text(*(1.95 * _unit(55)), r"axis 1, along $\omega$", ha="left")
    _limits(body, (-1.9, 2.6), (-1.1, 2.1))
    x = np.linspace(0, 6.5, 200)
    y = 0.25 * np.sin(x)
    beside.fill_between(x, y - 0.03, y + 0.03, color=BODY, edgecolor=INK)
    beside.text(0, -0.45, "the set: rotation about axis 1")
    beside.plot(x, y + 0.06 * np.exp(0.45 * x) * np.cos(2 * x), color=MARK)
    beside.text(
        3.4, 1.2, r"$\omega_2,\ \omega_3,\ \eta$ grow: not observable", color=MARK, ha="center"
    )
    beside.set(xlim=(-0.2, 6.8), ylim=(-1.1, 1.6))
    return figure


def brun():
    figure, (space, well) = _panels(2, "Euler's angles", r"the motion of $u=\cos\theta$")
    _arrow(space, (0, 0), (0, 1.9), PALE)
    space.text(-0.08, 1.9, r"$\gamma$, to the attracting centre", ha="right", va="top", color=PALE)
    axis = _unit(55)
    space.add_patch(
        Polygon(
            [(0, 0) + 0.95 * axis + 0.45 * _unit(55 + d) for d in (90, -90)] + [(0, 0)], color=BODY
        )
    )
    space.add_patch(
        Ellipse(tuple(0.95 * axis), 0.9, 0.34, angle=55 - 90, facecolor="white", edgecolor=INK)
    )
    _arrow(space, (0, 0), 1.9 * axis, INK)
    space.text(*(1.95 * axis), "axis of symmetry", ha="center", va="bottom")
    _angle(space, (0, 0), 1.1, 55, 90, r"$\theta$")
    _arrow(space, (-0.45, 1.35), (0.42, 1.35), MARK, bend=0.35)
    space.text(-0.5, 1.3, r"$\psi$", color=MARK, ha="right")
    _arrow(space, 1.55 * axis + 0.3 * _unit(-35), 1.55 * axis + 0.3 * _unit(145), MARK, bend=0.4)
    space.text(*(1.5 * axis + 0.38 * _unit(-35)), r"$\varphi$", color=MARK, va="top")
    _line(space, (-1.4, 0), (1.6, 0), PALE, "--")
    _limits(space, (-1.9, 2.1), (-0.4, 2.2))
    u = np.linspace(-1, 1, 400)
    # (S2): k = 1, L = 0.8, a = 0.3, b = 0.5
    p = (1 - u**2) * (0.8 + u**2) - (0.3**2 + 0.5**2 - 2 * 0.3 * 0.5 * u)
    well.plot(u, p, color=INK)
    well.axhline(0, color=PALE, linewidth=0.8)
    well.fill_between(u, 0, p, where=p > 0, color=BODY)
    zeros = u[:-1][np.diff(np.sign(p)) != 0]
    for zero, words in zip(zeros[[0, -1]], ("$u_l$", "$u_h$"), strict=True):
        well.plot(zero, 0, "o", color=MARK)
        well.text(zero, -0.08, words, ha="center", va="top", color=MARK)
    well.text(0.1, 0.2, "$P(u) > 0$", ha="center")
    well.set(xlim=(-1.25, 1.25), ylim=(-0.9, 1.0))
    return figure


def brun_triaxial():
    figure, space = _panels(1, "the body, and the way to the attracting centre")
    _arrow(space, (0, 0), (0, 2.1), PALE)
    space.text(0.08, 2.1, r"$\nu$, to the attracting centre", ha="left", va="top", color=PALE)
    first, second, third = 1.5 * _unit(62), 1.25 * _unit(-14), 0.9 * _unit(215)
    corners = [0.62 * first * i + 0.5 * second * j for i, j in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    back = [corner - 0.35 * third for corner in corners]
    space.add_patch(Polygon(back, facecolor="white", edgecolor=PALE))
    for one, other in zip(corners, back, strict=True):
        _line(space, one, other, PALE)
    space.add_patch(Polygon(corners, facecolor=BODY, edgecolor=INK, alpha=0.9))
    for axis, name in ((first, "C"), (second, "B"), (third, "A")):
        _arrow(space, (0, 0), axis, INK)
        space.text(*(1.12 * axis), name, ha="center", va="center")
    _arrow(space, (-0.35, 1.75), (0.38, 1.75), MARK, bend=0.35)
    space.text(-0.4, 1.7, r"$\Omega$", color=MARK, ha="right")
    _limits(space, (-1.9, 2.3), (-1.2, 2.3))
    return figure


def libration():
    figure, axes = _panels(1, "seen from above, in axes that turn with the primaries")
    _triangle(axes)
    _arrow(axes, (0.46, 0.866), (1.0, 0.866), PALE)
    _arrow(axes, (0.46, 0.866), (0.46, 1.4), PALE)
    axes.text(1.0, 0.89, r"$\xi$", color=PALE)
    axes.text(0.49, 1.36, r"$\eta$", color=PALE)
    axes.text(0.75, 1.15, r"$\zeta$: towards the reader", color=PALE, va="top")
    _limits(axes, (-1.0, 1.9), (-1.15, 1.5))
    return figure


def libration_elliptic():
    figure, (orbits, axes) = _panels(
        2, "the primaries' orbits", "in pulsating axes, their distance the unit"
    )
    e, mu = 0.4, 0.25
    for size, side in ((mu, -1), (1 - mu, 1)):
        orbits.add_patch(
            Ellipse(
                (-side * size * e, 0),
                2 * size,
                2 * size * np.sqrt(1 - e**2),
                fill=False,
                color=PALE,
            )
        )
    f = np.radians(65)
    r = (1 - e**2) / (1 + e * np.cos(f)) * np.array([np.cos(f), np.sin(f)])
    _ball(orbits, -mu * r, 0.09, r"$1-\mu$")
    _ball(orbits, (1 - mu) * r, 0.05, r"$\mu$")
    _line(orbits, -mu * r, (1 - mu) * r, PALE)
    _line(orbits, (0, 0), (0.62, 0), PALE, "--")
    orbits.text(0.68, 0, "pericentre", color=PALE, va="center")
    _angle(orbits, (0, 0), 0.4, 0, 65, "$f$")
    apex = -mu * r + np.array([[0.5, -np.sqrt(3) / 2], [np.sqrt(3) / 2, 0.5]]) @ r
    orbits.add_patch(Polygon([-mu * r, (1 - mu) * r, apex], fill=False, color=PALE, linestyle=":"))
    _ball(orbits, apex, 0.03, "$L_4$", MARK)
    _limits(orbits, (-1.3, 1.0), (-0.95, 0.95))
    _triangle(axes)
    centre = np.array([0.46, 0.866])
    for degrees, words in ((61, r"$\xi$"), (151, r"$\eta$")):
        _arrow(axes, centre, centre + 0.6 * _unit(degrees), INK)
        axes.text(*(centre + 0.66 * _unit(degrees)), words)
    _limits(axes, (-1.0, 1.7), (-1.15, 1.6))
    return figure


def _triangle(axes):
    left, right = (-0.04, 0), (0.96, 0)
    for side in (1, -1):
        axes.add_patch(
            Polygon([left, right, (0.46, side * 0.866)], fill=False, color=PALE, linestyle=":")
        )
        _ball(axes, (0.46, side * 0.866), 0.035, "$L_4$" if side > 0 else "$L_5$", MARK)
    _ball(axes, left, 0.13, r"$1-\mu$")
    _ball(axes, right, 0.06, r"$\mu$")
    axes.plot(0, 0, "+", color=INK)


DRAWINGS = {
    draw.__name__: draw
    for draw in (
        satellite, satellite_triaxial, mathieu, gyrostat, gyrostat_body, brun, brun_triaxial, libration,
        libration_elliptic,
    )
}  # fmt: skip


def _panels(count, *titles):
    figure, panels = plt.subplots(
        1, count, figsize=(4.2 * count, 3.4), squeeze=False, layout="constrained"
    )
    for axes, title in zip(panels[0], titles, strict=True):
        axes.set_axis_off()
        axes.set_title(title, fontsize=10)
    return figure, panels[0] if count > 1 else panels[0, 0]


def _limits(axes, x, y):
    axes.set(xlim=x, ylim=y, aspect="equal")


def _unit(degrees):
    return np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])


def _line(axes, start, end, color, style="-"):
    axes.plot(*zip(start, end, strict=True), color=color, linestyle=style, linewidth=1.1)


def _arrow(axes, start, end, color, style="-|>", bend=0.0):
    kind = f"arc3,rad={bend}"
    axes.add_patch(
        FancyArrowPatch(start, end, arrowstyle=style, mutation_scale=11, color=color, shrinkA=0, shrinkB=0,
                        connectionstyle=kind)
    )  # fmt: skip


def _ball(axes, at, radius, words="", color=BODY):
    axes.add_patch(Circle(at, radius, facecolor=color, edgecolor=INK, zorder=3))
    axes.text(at[0], at[1] - 1.25 * radius, words, ha="center", va="top")


def _rod(axes, at, along, half):
    across = 0.13 * np.array([-along[1], along[0]])
    corners = [at + s * half * along + t * across for s, t in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    axes.add_patch(Polygon(corners, facecolor=BODY, edgecolor=INK, zorder=3))


def _angle(axes, at, size, start, end, words, color=MARK):
    axes.add_patch(
        Arc(at, size, size, theta1=start, theta2=end, color=color, linewidth=1.5, zorder=4)
    )
    axes.text(
        *(np.array(at) + 0.62 * size * _unit((start + end) / 2)),
        words,
        color=color,
        ha="center",
        va="center",
    )


if __name__ == "__main__":
    main()
