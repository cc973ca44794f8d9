"""The picture of `survey failures`: a row per plane, a column per method, the true error by colour."""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch

from survey.failures.plane import RTOL

GREY = "#c8c8c8"
WIDE, HIGH = 1.75, 1.95  # inches of a panel


def draw(planes, results, path):
    """Draw log10 of the true errors."""
    methods = list(dict.fromkeys(method for of in results for method, _ in of))
    methods.sort(key=lambda method: method.startswith("auto"))
    size = (WIDE * len(methods) + 2.6, HIGH * len(planes) + 1.2)
    figure, axes = plt.subplots(
        len(planes), len(methods), figsize=size, squeeze=False, layout="constrained"
    )
    norm = BoundaryNorm(np.arange(-17, -3), 256, extend="both")
    shown = None
    for ax, method in zip(axes[0], methods, strict=True):
        ax.set_title(method, fontsize=9)
    for line, plane, of in zip(axes, planes, results, strict=True):
        found = dict(of)
        for i, (ax, method) in enumerate(zip(line, methods, strict=True)):
            shown = _panel(ax, found, method, norm) or shown
            ax.set_xticks(list(plane.x.ticks), list(plane.x.ticks.values()), fontsize=6)
            ax.set_yticks(
                list(plane.y.ticks), [] if i else list(plane.y.ticks.values()), fontsize=6
            )
            ax.set(xlim=(-0.5, plane.x.size - 0.5), ylim=(-0.5, plane.y.size - 0.5))
        line[0].set_ylabel(f"{plane.title}\n\n{plane.y.label}", fontsize=7)
        line[len(methods) // 2].set_xlabel(plane.x.label, fontsize=7)
    if shown is not None:
        label = r"true error over $1 + |\mathrm{value}|$, $\log_{10}$"
        figure.colorbar(
            shown, ax=axes, label=label, location="right", aspect=40, fraction=0.03, pad=0.01
        )
    handles = [
        Patch(facecolor=GREY, label="no answer"),
        Patch(
            facecolor="white",
            edgecolor="black",
            hatch="////",
            label=f"its error bar misses rtol = {RTOL:g}",
        ),
        Patch(facecolor="black", label="a lie: beyond its error bar"),
    ]
    if any(j is not None and j.unchecked.any() for of in results for _, j in of):
        handles.append(Patch(facecolor="white", edgecolor="black", label="the truth is no sharper"))
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def _panel(ax, found, method, norm):
    """One method on one plane; returns what a colour bar needs."""
    ax.set_facecolor(GREY)
    j = found.get(method)
    if j is None or not j.answered.any():
        words = (
            "not asked"
            if method not in found
            else "refused as\na whole"
            if j is None
            else "no answer"
        )
        ax.text(0.5, 0.5, words, transform=ax.transAxes, ha="center", va="center", fontsize=7)
        return None
    style = {"origin": "lower", "aspect": "auto", "interpolation": "nearest"}
    # flags alone, which are right
    error = np.where(j.answered & np.isnan(j.error) & ~j.unchecked, 1e-17, j.error)
    shown = ax.imshow(np.log10(np.maximum(error, 1e-30)), norm=norm, cmap="viridis", **style)
    if j.unchecked.any():
        ax.imshow(np.where(j.unchecked, 1.0, np.nan), cmap=ListedColormap(["white"]), **style)
    if j.missed.any():
        wide = np.pad(j.missed.astype(float), 1, mode="edge")
        at = [np.arange(-1, size + 1) for size in (j.missed.shape[1], j.missed.shape[0])]
        ax.contourf(*at, wide, levels=[0.5, 1.5], colors="none", hatches=["////"])
    if j.lie.any():
        ax.imshow(np.where(j.lie, 1.0, np.nan), cmap=ListedColormap(["black"]), **style)
    return shown
