"""The bifurcation set of Brun's problem as surfaces over the scaled integrals l, alpha, beta: a
picture.

    python workflows/brun_bifurcations.py [-o results]

The surface (S18) of regular precessions in closed form (survey/scenes/brun.md), for both signs of
k: stable and unstable sheets, the cusp curve where they meet, and the threads of upright rotations.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from script import parser

from survey.measures.nutation.regular_precessions import surface

ALONG, ACROSS = 161, 31
HIGHEST = {1: 1.6, -1: 5.5}  # l
COLOURS = {
    "stable": "#7FBCE0",
    "unstable": "#D55E00",
    "cusp": "#000000",
    "upright": "#009E73",
    "thread": "#CC2288",
}


def coordinates(y, z, s):
    """alpha, beta, l at (y, z)."""
    here = surface(y, z, 0.0, 0.0, s)
    return here["alpha"][0], here["beta"][0], here["l"][0]


def greater(total, u):
    """The greater of two numbers with this sum and the product u^2: y^2 or z^2."""
    return 0.5 * (total + np.sqrt(np.maximum(total**2 - 4.0 * u**2, 0.0)))


def cusps(u):
    """The greater of y^2 and z^2 where y^2 + z^2 = 1 - 3 u^2."""
    return greater(np.maximum(1.0 - 3.0 * u**2, 2.0 * abs(u)), u)


def patch(s, furthest, inner, outer):
    """Four meshes, the last one in front: |u| <= furthest, the greater of y^2, z^2 from inner(u) to
    outer(u).
    """
    u = furthest * np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, ALONG))[:, None]
    low, high = inner(u), outer(u)
    great = np.sqrt(low + (high - low) * np.linspace(0.0, 1.0, ACROSS) ** 2)
    small = -s * u / np.where(great > 0.0, great, 1.0)
    yield coordinates(great, small, s)
    yield coordinates(small, great, s)
    yield coordinates(-small, -great, s)
    yield coordinates(-great, -small, s)


def shaded(mesh, s, name):
    """Colours of a mesh: darker downwards, and towards large alpha."""
    alpha, _beta, l = mesh  # noqa: E741
    bright = 0.6 + 0.35 * (l + s) / (HIGHEST[s] + s) - 0.2 * alpha / np.sqrt(HIGHEST[s] + s)
    return np.clip(bright[..., None] * np.array(to_rgb(COLOURS[name])), 0.0, 1.0)


def draw_sheets(axes, s):
    """The stable sheet without its front, which would hide the others."""
    style = {
        "linewidth": 0.0,
        "antialiased": False,
        "rcount": ALONG,
        "ccount": ACROSS,
        "shade": False,
    }
    start = cusps if s > 0 else abs
    for mesh in list(patch(s, 1.0, start, lambda u: greater(HIGHEST[s] + 3.0 * s * u**2, u)))[:3]:
        axes.plot_surface(*mesh, facecolors=shaded(mesh, s, "stable"), **style)
    if s > 0:
        for mesh in patch(s, 1.0 / 3.0, abs, cusps):
            axes.plot_surface(*mesh, facecolors=shaded(mesh, s, "unstable"), **style)


def draw_lines(axes, s):
    if s > 0:
        u = np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, 401)) / 3.0
        great = np.sqrt(cusps(u))
        for side in (1.0, -1.0):
            for y, z in ((great, -u / great), (-u / great, great)):
                axes.plot(
                    *coordinates(side * y, side * z, s), color=COLOURS["cusp"], lw=1.6, zorder=10
                )
    furthest = np.sqrt(HIGHEST[s] + s)
    p = np.linspace(-furthest, furthest, 401)
    for side in (1.0, -1.0):
        axes.plot(p, side * p, p * p - s, color=COLOURS["upright"], lw=1.8, zorder=11)
        if s < 0:
            slow = np.linspace(-2.0, 2.0, 201)
            axes.plot(
                slow, side * slow, slow * slow - s, color=COLOURS["thread"], lw=1.8, zorder=12
            )


def panel(figure, position, s, title):
    axes = figure.add_subplot(1, 2, position, projection="3d", computed_zorder=False)
    draw_sheets(axes, s)
    draw_lines(axes, s)
    axes.set(xlabel=r"$\alpha$", ylabel=r"$\beta$", zlabel=r"$l$")
    axes.set_title(title, y=0.94, fontsize=11)
    axes.view_init(elev=24, azim=-75)
    axes.set_box_aspect((1, 1, 0.95), zoom=1.02)
    axes.tick_params(labelsize=8)


def draw():
    figure = plt.figure(figsize=(9.6, 5.2))
    panel(figure, 1, 1, r"$k > 0$")
    panel(figure, 2, -1, r"$k < 0$")
    figure.suptitle(
        "Regular precessions of an axisymmetric body in a Newtonian field, the front cut away",
        fontsize=11,
    )
    handles = [
        Patch(color=COLOURS["stable"], label="stable: a well begins"),
        Patch(color=COLOURS["unstable"], label="unstable: separatrices"),
        Line2D([], [], color=COLOURS["cusp"], label="cusps"),
        Line2D([], [], color=COLOURS["upright"], label="stable upright rotations"),
        Line2D([], [], color=COLOURS["thread"], label="unstable ones: threads"),
    ]
    figure.legend(handles=handles, loc="lower center", ncols=5, frameon=False, fontsize=8.5)
    figure.subplots_adjust(left=0.01, right=0.96, bottom=0.12, top=0.93, wspace=0.06)
    return figure


def main():
    path = parser(__doc__, "the picture").parse_args().output / "brun_bifurcations.png"
    draw().savefig(path, dpi=130)
    print(path)


if __name__ == "__main__":
    main()
