"""Points singled out on a map: hatched where they fill an area, ringed where they are rare."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

MAX_HATCHED = 500  # cells along an axis: hatching is drawn as outlines
RARE = 0.002  # a fraction of the map: rarer points are ringed, or nobody would see them


def marks(axes, x, y, where, label, number, paper=False, colour="white"):
    """Mark the cells `where`; returns their legend handle.

    `number` holds how many points of each kind there are, where a cell stands for several.
    """
    total = int(where.sum())
    label = label if paper else f"{label} ({number.get(label, total):,})"
    if total == 0:
        return []
    if total <= RARE * where.size:
        i, j = np.nonzero(where)
        ring = {
            "marker": "o",
            "markeredgecolor": "#D40000",
            "markerfacecolor": colour,
            "linestyle": "none",
        }
        axes.plot(x.values[i], y.values[j], markersize=4, **ring)
        return [Line2D([], [], markersize=6, label=label, **ring)]
    if colour == "white":
        # one more cell all round, or the hatching would end at the centres of the outermost cells
        wide = np.pad(where.T.astype(float), 1, mode="edge")
        axes.contourf(
            widened(x.values),
            widened(y.values),
            wide,
            levels=[0.5, 1.5],
            colors="none",
            hatches=["xxx"],
        )
        return [Patch(facecolor="white", edgecolor="grey", hatch="xxx", label=label)]
    return [Patch(facecolor=colour, label=label)]


def marks_without_answer(axes, x, y, failed, outside, number, paper):
    """Mark the points that failed and those outside the domain; returns their legend handles."""
    handles = marks(axes, x, y, failed, "failed", number, paper)
    return handles + marks(axes, x, y, outside, "outside the domain", number, paper)


def hatched(axes, x, y, where, hatch):
    """Hatch the cells of the points `where`, along the edges of the cells."""
    every = tuple(slice(None, None, -(-length // MAX_HATCHED)) for length in where.shape)
    x, y, where = _cornered(x.values[every[0]]), _cornered(y.values[every[1]]), where[every]
    doubled = np.repeat(np.repeat(where.T.astype(float), 2, axis=0), 2, axis=1)
    axes.contourf(x, y, doubled, levels=[0.5, 1.5], colors="none", hatches=[hatch])


def _cornered(values):
    """Each cell's two edges, cell after cell."""
    middles = 0.5 * (values[1:] + values[:-1])
    outer = widened(values)[[0, -1]]
    return np.concatenate([outer[:1], np.repeat(middles, 2), outer[1:]])


def widened(values):
    """The coordinates with the outer edges of the first and the last cell."""
    low, high = (0.5 * np.diff(values)[[0, -1]]) if values.size > 1 else (0.5, 0.5)
    return np.concatenate([[values[0] - low], values, [values[-1] + high]])
