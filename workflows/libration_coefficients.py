"""Figures 8 to 10 of the source regenerated, with the order 4 that it leaves out, and the verdict
with the resonances.

    python workflows/libration_coefficients.py [-o results]

Runs `libration_coefficients.toml` beside this file, and draws libration_coefficients.png and
libration_verdict.png.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from libration_critical import boundaries, resonances
from matplotlib.colors import ListedColormap
from matplotlib.patches import Patch
from script import parser

import survey
from survey.show.palette import COLOURS

SURVEY = Path(__file__).with_suffix(".toml")
LINES = [COLOURS[i] for i in (6, 0, 4, 5, 2, 9)]
PANELS = (
    ("order 4 (not drawn in the text)", ("200", "110", "020", "101", "011", "002"), 1e-2),
    ("figure 8: $N$ where $L = 0$, and $D_4$", ("a20", "a11", "a02", "D4"), 1e-2),
    ("figure 9: order 6 in the plane, and $D_6$", ("300", "210", "120", "030", "D6"), 1e-1),
    ("figure 10: order 6 across the plane", ("201", "111", "021", "102", "012", "003"), 1e-3),
)
VERDICTS = {0: COLOURS[0], 1: COLOURS[1], 2: COLOURS[2]}  # the others take one float64 each
MARKED = ("mu_c", "mu2", "mu_d", "mu1", "mu_R")


def symbol(name):
    """TeX of a coefficient."""
    return f"$c_{{{name}}}$" if name.isdigit() else f"${name[0]}_{{{name[1:]}}}$"


def column(ds, name):
    """A coefficient over mu, with a gap where a pole separates neighbours."""
    values = (ds.c.sel(monomial=name) if name.isdigit() else ds[name]).values.copy()
    big = np.abs(values) > 30 * np.nanmedian(np.abs(values))
    jumps = np.flatnonzero((np.diff(np.sign(values)) != 0) & big[1:] & big[:-1])
    values[jumps] = np.nan
    return values


def _letter(name):
    """TeX of a critical mass ratio."""
    return f"$\\mu_{name.removeprefix('mu').removeprefix('_')}$"


def draw_coefficients(ds, path):
    """A panel for each of the figures; the scale is linear around 0 and logarithmic beyond."""
    figure, panels = plt.subplots(
        len(PANELS), 1, figsize=(8.0, 12.5), sharex=True, layout="constrained"
    )
    marks = {value.symbol: float(value.mu) for value in boundaries()}
    for axes, (title, names, width) in zip(panels, PANELS, strict=True):
        for name, colour in zip(names, LINES, strict=False):
            axes.plot(ds.mu, column(ds, name), lw=1.3, color=colour, label=symbol(name))
        axes.set_yscale("symlog", linthresh=width)
        axes.axhline(0.0, color="black", lw=0.5)
        for name in ("mu2", "mu1", "mu_R"):
            axes.axvline(marks[name], color="grey", lw=0.8, ls="--")
        axes.axvspan(marks["mu_c"], marks["mu_d"], color=COLOURS[2], alpha=0.15, lw=0)
        axes.legend(
            fontsize=9, frameon=False, ncols=1, loc="center left", bbox_to_anchor=(1.0, 0.5)
        )
        axes.grid(alpha=0.25)
        axes.set_xlim(0.0, 0.0395)
        critical = axes.secondary_xaxis("top")
        critical.set_xticks(
            [marks[name] for name in MARKED], [_letter(name) for name in MARKED], fontsize=8
        )
        critical.tick_params(length=3, pad=1)
        axes.set_title(title, fontsize=10, pad=16)
    panels[-1].set(xlabel=r"$\mu$")
    figure.suptitle(
        "Normal form at $L_4$: dashed $\\mu_2$, $\\mu_1$, $\\mu_R$; shaded where order 6 decides",
        fontsize=11,
    )
    figure.savefig(path, dpi=150)
    plt.close(figure)


def draw_verdict(ds, path):
    """Above, the verdict; in the middle, the resonances by order; below, the distance from the nearest."""
    figure, (strip, marks, below) = plt.subplots(
        3, 1, figsize=(10.5, 7.2), sharex=True, height_ratios=[0.7, 2.2, 2.2], layout="constrained"
    )
    mu, verdict = ds.mu.values, ds.verdict.values
    names = dict(zip(ds.verdict.flag_values, ds.verdict.flag_meanings.split(), strict=True))
    style = {
        "cmap": ListedColormap(list(VERDICTS.values())),
        "vmin": -0.5,
        "vmax": 2.5,
        "shading": "nearest",
    }
    strip.pcolormesh(mu, [0.0, 1.0], np.vstack([verdict, verdict]), rasterized=True, **style)
    strip.set(
        yticks=[],
        ylim=(0, 1),
        title="Formal stability of $L_4$ and $L_5$ in the spatial circular problem",
    )
    critical = {value.symbol: float(value.mu) for value in boundaries()}
    for name in MARKED:
        letter = name.removeprefix("mu").removeprefix("_")
        unstable = name in ("mu1", "mu2")
        strip.axvline(
            critical[name], color="black", lw=1.6 if unstable else 0.8, ls="-" if unstable else ":"
        )
        strip.annotate(f"$\\mu_{letter}$", (critical[name], 0), xytext=(0, -3), textcoords="offset points",
                       ha="center", va="top", fontsize=9)  # fmt: skip
    handles = [
        Patch(color=colour, label=names[code].replace("_", " "))
        for code, colour in VERDICTS.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False, fontsize=9)
    for value in resonances():
        definite = value.what.endswith(" definite")
        colour = "black" if definite else "grey"
        marks.vlines(
            float(value.mu),
            value.order,
            9.4,
            color=colour,
            lw=0.6,
            alpha=0.5,
            ls="-" if definite else ":",
        )
        marks.plot(
            float(value.mu),
            value.order,
            "o",
            ms=5,
            color=colour,
            mfc=colour if definite else "white",
        )
        # no room to the right; and in order 7 none above, where (3, 4, 0) stands
        left = value.mu > 0.0375
        above = definite and not (left and value.order == 7)
        place = {
            "xytext": (-4 if left else 4, 4 if above else -10),
            "ha": "right" if left else "left",
        }
        marks.annotate(value.symbol, (float(value.mu), value.order), textcoords="offset points", fontsize=7.5,
                       color=colour, **place)  # fmt: skip
    marks.set(ylabel="order", ylim=(9.4, 2.4), yticks=range(3, 9))
    marks.set_title(
        "resonances $k_1\\omega_1 - k_2\\omega_2 + k_3 = 0$, $k_3$ even: full if all $k_i \\geq 0$, else hollow",
        fontsize=9,
    )
    shades = plt.get_cmap("viridis_r")
    for order in range(2, 9):
        here = ds.resonance_order.values == order
        below.plot(
            mu,
            np.where(here, ds.resonance_distance.values, np.nan),
            lw=1.4,
            color=shades(order / 9 + 0.1),
        )
        if here.any():
            below.plot([], [], color=shades(order / 9 + 0.1), lw=3, label=f"{order}")
    below.set(
        xlabel=r"$\mu$",
        ylabel=r"$|k \cdot \omega|$",
        yscale="log",
        ylim=(1e-5, 0.1),
        xlim=(0.0, 0.04),
    )
    below.set_title(
        "distance from the nearest of them (and of those at the ends), by order", fontsize=9
    )
    below.legend(
        fontsize=8, frameon=False, title="order", loc="center left", bbox_to_anchor=(1.0, 0.5)
    )
    below.grid(alpha=0.25)
    figure.savefig(path, dpi=150)
    plt.close(figure)


def main():
    folder = parser(__doc__, "the map and its pictures").parse_args().output
    ds = survey.run(SURVEY, output=folder / SURVEY.with_suffix(".nc").name)
    paths = [folder / f"libration_{name}.png" for name in ("coefficients", "verdict")]
    draw_coefficients(ds, paths[0])
    draw_verdict(ds, paths[1])
    print(*paths, sep="\n")


if __name__ == "__main__":
    main()
