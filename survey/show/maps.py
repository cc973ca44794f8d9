"""A variable over two axes: a colour per verdict or flag, or a colour bar."""

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import BoundaryNorm, ListedColormap, LogNorm
from matplotlib.patches import Patch
from matplotlib.ticker import MaxNLocator

from survey import status
from survey.file.labels import fill_of, flag_codes, scene_statuses, words_of
from survey.file.overview import Overview, VariablePoints
from survey.grid import logarithmic
from survey.show.boundaries import draw_boundaries, in_plane, limits_of
from survey.show.cells import draw_cells
from survey.show.layout import add_legend
from survey.show.marks import hatched, marks, marks_without_answer
from survey.show.palette import UNDECIDED, colours_of, greys, hatch_of, kinds_of
from survey.show.style import style_named
from survey.show.surfaces import section
from survey.show.text import WIDE, label_of, spaced

# points along an axis: in a picture of a larger map a cell stands for several points
MAX_DRAWN = 2000
MOST_COUNTS = 10  # that have a colour each
MAX_CELLS = 1000  # along an axis of such a picture: each costs a hundred bytes
SEQUENTIAL, DIVERGING = "viridis", "RdBu_r"  # of values of one sign, and about 0
IN_WORDS = "#CC79A7"  # numbers that stand for words, such as infinitely many
CELLS_PER_PIXEL = 0.8  # of the axes, before legend and labels take their share


def draw_map(axes, ds, variable, state, boundaries, paper, asked):
    """Draw a variable over its two axes, `state` being the status; with colour bar, boundaries and
    legend.

    `asked`: cmap, vmin, vmax, robust of its colours, None where they are not given.
    """
    scales = ["log" if logarithmic(variable[dim].values) else "linear" for dim in variable.dims]
    words = words_of(variable)
    whole = fill_of(variable) is not None
    variable, state, number = _shown(
        axes, ds, variable, state, style_named("paper" if paper else None).dpi
    )
    x, y = (variable[dim] for dim in variable.dims)
    plane = _plane(ds, variable) if boundaries else None
    failed = np.isin(state.values, list(status.FAILURES))
    outside = state.values == status.INVALID_PARAMETERS
    on_cells = variable.name == "verdict" and "cell_verdict" in ds
    if on_cells:
        handles = draw_cells(axes, ds, x, y, failed, number, paper)
    elif "flag_values" in variable.attrs:
        handles = _verdicts(axes, x, y, ds, variable, state, number, paper)
        handles += marks_without_answer(axes, x, y, failed, outside, number, paper)
    else:
        values = variable.values.astype(float)
        worded = {text: (values == code) & ~(failed | outside) for code, text in words.items()}
        shown = np.ma.masked_invalid(
            np.where(failed | outside | np.isin(values, list(words)), np.nan, values)
        )
        colours = colours_of_numbers(shown, variable, asked, whole)
        drawn = axes.pcolormesh(x, y, shown.T, shading="nearest", rasterized=True, **colours)
        if not shown.mask.all():
            few = isinstance(colours.get("norm"), BoundaryNorm)
            ticks = ticks_of(shown, colours, whole)
            extend = "neither" if few else clipped(shown, *drawn.get_clim())
            axes.figure.colorbar(
                drawn, ax=axes, label=label_of(variable, WIDE), ticks=ticks, extend=extend
            )
        exact = plane is not None and plane.sizes["curve"] > 0
        if limits_of(variable) and not exact and min(shown.shape) > 1 and shown.count():
            axes.contour(x, y, shown.T, levels=limits_of(variable), colors="black", linewidths=0.6)
        axes.set_facecolor("#dddddd")
        missing = np.isnan(values) & ~(failed | outside)
        handles = []
        for text, here in worded.items():
            handles += _area(axes, x, y, here, IN_WORDS, text, number, paper)
        handles += _undefined(axes, x, y, ds, state, missing, number, paper)
        handles += marks_without_answer(axes, x, y, failed, outside, number, paper)
        missing &= ~np.isin(state.values, list(scene_statuses(ds).values()))
        handles += [Patch(color="#dddddd", label="does not apply")] if missing.any() else []
    if plane is not None:
        gaps = (
            colours_of(flag_codes(variable.attrs)).get("unstable")
            if "flag_values" in variable.attrs
            else None
        )
        handles += draw_boundaries(axes, plane, x, y, gaps, on_cells)
    if handles:
        add_legend(axes, handles)
    axes.set(xlabel=label_of(x, WIDE), ylabel=label_of(y, WIDE))
    for setting, scale in zip((axes.set_xscale, axes.set_yscale), scales, strict=True):
        if scale == "log":
            setting(scale)


def _plane(ds, variable):
    """The survey with the exact curves that lie in the plane of the map, or None if it has none."""
    if "curve_count" in ds:
        return in_plane(ds, variable)
    return section(ds, variable) if "surface_vertices" in ds else None


def _shown(axes, ds, variable, state, dpi):
    """(variable, status, {}) in memory; for a large map those of the picture's cells, and {kind:
    number of points}.
    """
    if max(variable.shape) <= MAX_DRAWN:
        return variable.compute(), state.compute(), {}
    box = axes.get_window_extent()
    points = VariablePoints(variable, state, scene_statuses(ds), with_statuses=True)
    pixels = np.array([box.width, box.height]) * dpi / axes.figure.dpi
    overview = Overview(
        points, np.clip(CELLS_PER_PIXEL * pixels, 1, MAX_CELLS).astype(int)
    ).complete
    values, states = points.cells(overview)
    for dim, starts in zip(variable.dims, overview.starts, strict=True):
        ends = np.append(starts[1:], variable.sizes[dim]) - 1
        middles = 0.5 * (variable[dim].values[starts] + variable[dim].values[ends])
        variable, state = (
            v.isel({dim: starts}).assign_coords({dim: (dim, middles, v[dim].attrs)})
            for v in (variable, state)
        )
    return variable.copy(data=values), state.copy(data=states), overview.number


def _verdicts(axes, x, y, ds, variable, state, number, paper):
    """Draw a colour per kind, rare points ringed; what failed or lies outside stays white. Returns
    legend handles.
    """
    shown, table, palette = kinds_of(ds, variable, state)
    flags = flag_codes(variable.attrs)
    codes = sorted(table.values())
    names = {code: name for name, code in table.items()}
    cmap = ListedColormap([palette[names[code]] for code in codes])
    edges = np.append(np.array(codes) - 0.5, codes[-1] + 0.5)
    settings = {
        "cmap": cmap,
        "norm": BoundaryNorm(edges, cmap.N),
        "shading": "nearest",
        "rasterized": True,
    }
    axes.pcolormesh(x, y, shown.T, **settings)
    number = number or {
        name: int((shown == code).filled(False).sum()) for name, code in table.items()
    }
    handles = [
        Patch(
            facecolor=palette[names[code]],
            edgecolor="black",
            linewidth=0.5,
            hatch=hatch_of(flags, names[code]) if paper else None,
            label=spaced(names[code]) if paper else _counted(names[code], number),
        )
        for code in codes
        if number[names[code]] and names[code] != "undecided"
    ]
    if paper:
        for code in codes:
            if number[names[code]] and hatch_of(flags, names[code]):
                hatched(axes, x, y, (shown == code).filled(False), hatch_of(flags, names[code]))
    undecided = (shown == table.get("undecided", -1)).filled(False)
    return handles + marks(axes, x, y, undecided, "undecided", number, paper, UNDECIDED)


def _undefined(axes, x, y, ds, state, missing, number, paper):
    """Draw the points without a value in the grey of their status, where the scene names one;
    returns handles.
    """
    handles = []
    codes = scene_statuses(ds)
    for name, grey in greys(ds).items():
        handles += _area(
            axes, x, y, missing & (state.values == codes[name]), grey, spaced(name), number, paper
        )
    return handles


def _area(axes, x, y, here, colour, label, number, paper):
    """Draw the cells `here` in a colour; returns their legend handles, none where there is no such cell."""
    if not here.any():
        return []
    cells = np.ma.masked_array(here, ~here)
    axes.pcolormesh(
        x, y, cells.T, cmap=ListedColormap([colour]), shading="nearest", rasterized=True
    )
    return marks(axes, x, y, here, label, number, paper, colour)


def counts(shown):
    """A colour for each count, where they are few; else None."""
    values = shown.compressed()
    if values.size == 0 or np.ptp(values) >= MOST_COUNTS:
        return None
    edges = np.arange(values.min() - 0.5, values.max() + 1.0)
    return {
        "cmap": colormaps["viridis"].resampled(len(edges) - 1),
        "norm": BoundaryNorm(edges, len(edges) - 1),
    }


def colours_of_numbers(shown, variable, asked, integers):
    """Colour map and limits: as asked; else a colour for each of a few counts; else by the values.

    Quantities of both signs have a diverging map about 0.
    """
    if str(variable.name).endswith("_error") and not any(
        asked.get(key) is not None for key in ("vmin", "vmax")
    ):
        low, high = _positive(shown)
        if high > 100.0 * low > 0.0:
            return {"cmap": asked.get("cmap") or SEQUENTIAL, "norm": LogNorm(low, high)}
    given = {key: asked[key] for key in ("vmin", "vmax") if asked.get(key) is not None}
    if integers and not given and asked.get("cmap") is None:
        few = counts(shown)
        if few:
            return few
    limits = (_full(shown) if asked.get("robust") is False else colour_limits(shown)) | given
    low, high = limits.get("vmin"), limits.get("vmax")
    signed = low is not None and high is not None and low < 0.0 < high and not integers
    if signed and not given:
        most = max(-low, high)
        limits = {"vmin": -most, "vmax": most}
    return {"cmap": asked.get("cmap") or (DIVERGING if signed else SEQUENTIAL)} | limits


def ticks_of(shown, colours, whole):
    """The ticks of a colour bar: those of counts are whole numbers, of a few counts these."""
    if isinstance(colours.get("norm"), BoundaryNorm):
        return np.unique(shown.compressed())
    return MaxNLocator(integer=True) if whole else None


def clipped(shown, low, high):
    """Which end of the colour bar has an arrow: values lie beyond it."""
    below, above = bool((shown < low).any()), bool((shown > high).any())
    return "both" if below and above else "min" if below else "max" if above else "neither"


def _positive(shown):
    """The ends of the positive values, except 1 % at either end."""
    values = shown.compressed()
    values = values[values > 0.0]
    return np.percentile(values, [1, 99]) if values.size else (0.0, 0.0)


def _full(shown):
    values = shown.compressed()
    return (
        {"vmin": float(values.min()), "vmax": float(values.max())}
        if values.size and np.ptp(values) > 0
        else {}
    )


def colour_limits(shown):
    """Colour limits that a few outliers, or many zeros, do not spoil."""
    values = shown.compressed()
    values = values[values != 0] if (values == 0).any() and (values >= 0).all() else values
    if values.size == 0:
        return {}
    low, high = np.percentile(values, [1, 99])
    low = 0.0 if shown.min() == 0 else low
    return {"vmin": low, "vmax": high} if high > low else {}


def _counted(name, number):
    return f"{spaced(name)} ({number[name]:,})"
