"""Points that lie on no grid, such as samples: scattered over the first two parameters that vary
along them.
"""

import numpy as np
from matplotlib.patches import Patch

from survey import status
from survey.file.labels import fill_of, masked, words_of
from survey.show.layout import add_legend
from survey.show.maps import IN_WORDS, colours_of_numbers, ticks_of
from survey.show.palette import kinds_of
from survey.show.text import WIDE, label_of, spaced

SIZE = 14.0  # of a mark, in points^2
NUMBER = "point"  # the dimension of points of two axes


def over_parameters(ds):
    """(the survey, names): the only parameter that varies along points without a coordinate is
    their axis, one of the names; two parameters or more are no axis.
    """
    along = {dim: _parameters(ds, dim) for dim in ds.status.dims if dim not in ds.coords}
    axes = {dim: names[0] for dim, names in along.items() if len(names) == 1}
    return ds.swap_dims(axes), set(axes.values())


def points_of(ds):
    """The survey on its first two axes, others at their first value, as points along one dimension."""
    ds = ds.isel(dict.fromkeys(ds.status.dims[2:], 0))
    return ds.stack({NUMBER: ds.status.dims}, create_index=False)


def is_ensemble(ds):
    """Are these points along one dimension without a coordinate, along which two parameters or more vary?"""
    dims = ds.status.dims
    return len(dims) == 1 and dims[0] not in ds.coords and len(_parameters(ds, dims[0])) > 1


def _parameters(ds, dim):
    """The names of the coordinates of numbers along the points."""
    return [c.name for c in ds.coords.values() if c.dims == (dim,) and c.dtype.kind in "iuf"]


def draw_ensemble(axes, ds, name, paper, asked):
    """Scatter a variable over two parameters: a colour for each verdict, or a colour bar; `asked`
    as in `draw_map`.
    """
    x, y = (ds[key] for key in _parameters(ds, ds.status.dims[0])[:2])
    variable, state = masked(ds[name].load()), ds.status.load()
    if "flag_values" in variable.attrs:
        shown, table, palette = kinds_of(ds, variable, state)
        handles = []
        for kind, code in table.items():
            here = (shown == code).filled(False)
            if here.any():
                axes.scatter(
                    x.values[here],
                    y.values[here],
                    SIZE,
                    palette[kind],
                    edgecolors="black",
                    linewidths=0.3,
                )
                label = spaced(kind) if paper else f"{spaced(kind)} ({int(here.sum()):,})"
                handles.append(
                    Patch(facecolor=palette[kind], edgecolor="black", lw=0.5, label=label)
                )
    else:
        lost = np.isin(state.values, list(status.UNANSWERED))
        words = words_of(variable)
        values = variable.values.astype(float)
        shown = np.ma.masked_invalid(np.where(lost | np.isin(values, list(words)), np.nan, values))
        whole = fill_of(variable) is not None
        colours = colours_of_numbers(shown, variable, asked, whole)
        drawn = axes.scatter(x.values, y.values, SIZE, shown, **colours)
        ticks = ticks_of(shown, colours, whole) if shown.count() else None
        axes.figure.colorbar(drawn, ax=axes, label=label_of(variable, WIDE), ticks=ticks)
        handles = []
        for code, text in words.items():
            here = (values == code) & ~lost
            axes.scatter(
                x.values[here], y.values[here], SIZE, IN_WORDS, edgecolors="black", linewidths=0.3
            )
            handles += (
                [Patch(color=IN_WORDS, label=f"{text} ({int(here.sum()):,})")] if here.any() else []
            )
    bad = np.isin(state.values, list(status.UNANSWERED))
    if bad.any():
        axes.plot(x.values[bad], y.values[bad], "x", color="#999999", ms=4)
        handles.append(Patch(color="#999999", label=f"no answer ({int(bad.sum()):,})"))
    axes.set(xlabel=label_of(x, WIDE), ylabel=label_of(y, WIDE))
    if handles:
        add_legend(axes, handles)
