"""Positions and line breaks of texts and the legend, so that nothing is clipped."""

import re
import textwrap
from math import inf

from matplotlib.transforms import ScaledTranslation

SAFE_PART = 0.95  # of the space for a text: fonts are a little wider at other resolutions
OVERHANG = 1.2  # of the width of axes that have neighbours: texts may reach into the gap


LAST = r"(?<=,) \$[^$]*\$( \([^)]*\))?$"  # the symbol and the unit of a label


def fit(axes):
    """Wrap the title and the labels that would not fit, as the figure is laid out now."""
    axes.figure.figure.draw_without_rendering()
    for panel in [
        axes,
        *(other for other in axes.figure.axes if other.get_label() == "<colorbar>"),
    ]:
        width, height = _space(panel, inf if alone(axes) else OVERHANG)
        for text, space in (
            (panel.title, width),
            (panel.xaxis.label, width),
            (panel.yaxis.label, height),
        ):
            wrap(text, space)


def _space(axes, most):
    """Width and height for a text centred on a side of the axes: within the figure, and `most`
    times the axes' own.
    """
    own, figure = axes.get_window_extent(), axes.figure.bbox
    x, y = 0.5 * (own.x0 + own.x1), 0.5 * (own.y0 + own.y1)
    width, height = 2 * min(x - figure.x0, figure.x1 - x), 2 * min(y - figure.y0, figure.y1 - y)
    return min(width, most * own.width), min(height, most * own.height)


def wrap(text, space):
    """Break the lines of a matplotlib Text that are longer than `space` pixels.

    A formula stays whole, and at the end of a label beside its name and unit.
    """
    original = text.get_text()
    for length in range(max(map(len, original.split("\n"))), 9, -3):
        box = text.get_window_extent()
        if (box.height if text.get_rotation() else box.width) <= SAFE_PART * space:
            return
        joined = re.sub(LAST, lambda end: end[0].replace(" ", "\0"), original)
        joined = re.sub(r"\$[^$]*\$", lambda formula: formula[0].replace(" ", "\0"), joined)
        lines = joined.split("\n")
        wrapped = [
            textwrap.fill(line, length, break_long_words=False, break_on_hyphens=False)
            for line in lines
        ]
        text.set_text("\n".join(wrapped).replace("\0", " "))


def alone(axes):
    """Are these the only axes of the figure, apart from colour bars?"""
    return [other for other in axes.figure.axes if other.get_label() != "<colorbar>"] == [axes]


def add_legend(axes, handles):
    """Put the legend below the figure if the axes fill it, else below the axes, in as many columns as fit."""
    fills = alone(axes) and axes.figure.get_constrained_layout()
    space = 0.98 * axes.figure.bbox.width if fills else OVERHANG * axes.get_window_extent().width
    settings = {"handles": handles, "frameon": False, "fontsize": 8}
    # inches: ticks and label
    below = axes.transAxes + ScaledTranslation(0, -0.5, axes.figure.dpi_scale_trans)
    for columns in range(min(4, len(handles)), 0, -1):
        if fills:
            legend = axes.figure.legend(loc="outside lower center", ncols=columns, **settings)
        else:
            position = {"loc": "upper center", "bbox_to_anchor": (0.5, 0), "bbox_transform": below}
            legend = axes.legend(**position, ncols=columns, **settings)
        if columns == 1 or legend.get_window_extent().width <= space:
            return
        legend.remove()
