"""Positions and line breaks of texts and the legend, so that nothing is clipped."""

import re
import textwrap
from math import inf

from matplotlib.transforms import ScaledTranslation

SAFE_PART = 0.95  # of the space for a text: fonts are a little wider at other resolutions
SHORTEST = 10  # characters of a line
OVERHANG = 1.2  # of the width of axes that have neighbours: texts may reach into the gap


MOST_LINES = 3  # of the label of a colour bar, before its letters shrink
SMALLEST = 6.0  # to which they do
LAST = r"(?<=,) \$[^$]*\$( \([^)]*\))?$"  # the symbol and the unit of a label
FORMULA, INTERVAL = r"\$[^$]*\$", r"\[[^][()]{1,12}[])]"  # stay whole, such as [0, 2 pi)


def fit(axes):
    """Wrap the title and the labels that would not fit, as the figure is laid out now; a colour
    bar's label is no longer than the bar.
    """
    axes.figure.figure.draw_without_rendering()
    width, height = _space(axes, inf if alone(axes) else OVERHANG)
    wrap(axes.title, width)
    wrap(axes.xaxis.label, width, joined=True)
    wrap(axes.yaxis.label, height, joined=True)
    for bar in axes.figure.axes:
        if bar.get_label() == "<colorbar>":
            _fit_beside(bar.yaxis.label, bar.get_window_extent().height)


def _fit_beside(label, height):
    """Wrap the label of a colour bar; where it takes many lines, in smaller letters."""
    original = label.get_text()
    wrap(label, height, joined=True)
    while label.get_text().count("\n") >= MOST_LINES and label.get_fontsize() > SMALLEST:
        label.set(text=original, fontsize=label.get_fontsize() - 0.5)
        wrap(label, height, joined=True)


def _space(axes, most):
    """Width and height for a text centred on a side of the axes: within the figure, and `most`
    times the axes' own.
    """
    own, figure = axes.get_window_extent(), axes.figure.bbox
    x, y = 0.5 * (own.x0 + own.x1), 0.5 * (own.y0 + own.y1)
    width, height = 2 * min(x - figure.x0, figure.x1 - x), 2 * min(y - figure.y0, figure.y1 - y)
    return min(width, most * own.width), min(height, most * own.height)


def wrap(text, space, joined=False):
    """Break the lines of a matplotlib Text that are longer than `space` pixels, as evenly as their
    number allows; `joined`: as one line.

    A formula stays whole, and at the end of a label beside its name and unit.
    """
    original = text.get_text()
    if _fits(text, space):
        return
    lines = [" ".join(original.split("\n"))] if joined else original.split("\n")
    length = max(map(len, lines))
    while length > SHORTEST and not _fits(text, space):
        length -= 1
        text.set_text(_broken(lines, length))
    while length > SHORTEST:
        length, last = length - 1, text.get_text()
        text.set_text(_broken(lines, length))
        if text.get_text().count("\n") > last.count("\n") or not _fits(text, space):
            text.set_text(last)
            return


def _fits(text, space):
    box = text.get_window_extent()
    return (box.height if text.get_rotation() else box.width) <= SAFE_PART * space


def _broken(lines, length):
    """The text of lines of at most so many characters."""
    short = {"break_long_words": False, "break_on_hyphens": False}
    for part in (LAST, FORMULA, INTERVAL):
        lines = [re.sub(part, lambda found: found[0].replace(" ", "\0"), line) for line in lines]
    return "\n".join(textwrap.fill(line, length, **short) for line in lines).replace("\0", " ")


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
