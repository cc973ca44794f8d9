"""Dataset -> figure: the stability map, a variable with its colour bar, a curve with its error
band, or many curves.

Pictures are for the screen (`style` "screen") or for papers ("paper": column widths, no title, and
hatching, so that verdicts can be told apart in grey print too).
"""

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text

from survey import modules
from survey.errors import BadInput
from survey.file.labels import masked
from survey.show import family, surfaces
from survey.show.boundaries import elsewhere, plane_of, position_of
from survey.show.ensemble import draw_ensemble, is_ensemble, over_parameters, points_of
from survey.show.layout import alone, fit
from survey.show.maps import draw_map
from survey.show.profiles import draw_profile
from survey.show.style import figure_size, style_named
from survey.show.text import literal, title_of
from survey.wording import shown

MOST_LABELS = 30  # on an axis


def save(ds, path, name=None, style=None, width="single"):
    """Draw variable `name` (the verdict, or the first output) of `ds` to `path` (PNG, PDF or SVG);
    returns what `onto` does.
    """
    # of ticks, near the largest number
    with matplotlib.rc_context(style_named(style).rc), np.errstate(over="ignore"):
        try:
            figure, left_out = _drawn(ds, name, style, width)
            figure.savefig(path, dpi=style_named(style).dpi)
        except OverflowError:  # of ticks, before Matplotlib 3.11
            raise BadInput(
                f"{path}: Matplotlib {matplotlib.__version__} draws no numbers near the largest; use 3.11 or newer"
            ) from None
    return left_out


def draw(ds, name=None, style=None, width="single"):
    """The figure of one variable over the survey's axes; not a figure of pyplot, which would show
    it in notebooks.
    """
    with matplotlib.rc_context(style_named(style).rc):
        return _drawn(ds, name, style, width)[0]


def _drawn(ds, name, style, width):
    """(the figure, what `onto` returns)."""
    figure = Figure(figsize=figure_size(style, width), layout="constrained")
    axes = figure.subplots(subplot_kw={"projection": projection_of(name)})
    return figure, onto(axes, ds, name, style=style)


def projection_of(name):
    """The projection of the axes on which this is drawn, as matplotlib names it."""
    return "3d" if isinstance(name, str) and name == surfaces.NAME else None


def onto(axes, ds, name=None, boundaries=True, style=None, across=(None, None), colours=None):
    """Draw one variable (the verdict, or the first output) onto matplotlib axes; raises BadInput
    for an unknown one.

    `across`: the axes that are drawn, or None; `colours`: cmap, vmin, vmax, robust of a variable of
    numbers, or None. Returns one line about curves of other planes that the file has in place of those
    of this one, "" otherwise.
    """
    paper = style_named(style).paper
    _check_colours(colours or {})
    drawable = [key for key in ds.data_vars if not key.endswith("_error") and set(ds[key].dims) >= set(ds.status.dims)
                and ds[key].dtype.kind in "iuf"]  # fmt: skip
    name = name or ("verdict" if "verdict" in ds else drawable[0])
    bars = [f"{key}_error" for key in drawable if f"{key}_error" in ds]
    if projection_of(name) == "3d":
        surfaces.draw_surfaces(axes, ds)
        if not paper:
            axes.set_title(title_of(ds, ds.surface_class), fontsize=10 if alone(axes) else 8)
        return ""
    if name not in drawable and name not in bars:
        raise BadInput(modules.unknown("variable", name, drawable))
    of_numbers = [key for key, value in (colours or {}).items() if value is not None]
    if of_numbers and "flag_values" in ds[name].attrs:
        raise BadInput(
            f"{of_numbers[0]} does not apply to {name}, whose values are names; leave it out"
        )
    for text in axes.findobj(Text):  # perhaps made while the user had LaTeX on
        text.set_usetex(False)
    ds, sampled = over_parameters(ds)
    ds = _without_single(ds, across)
    if across == (None, None) and ds.status.ndim > 1 and sampled & set(ds.status.dims[:2]):
        ds = points_of(ds)
    if is_ensemble(ds):
        ds = ds.isel({dim: 0 for dim in ds[name].dims if dim not in ds.status.dims})
        draw_ensemble(axes, ds, name, paper, colours or {})
        if not paper:
            axes.set_title(title_of(ds, ds[name]), fontsize=10 if alone(axes) else 8)
        fit(axes)
        return ""
    chosen = _chosen(ds, across)
    drawn = chosen or ds.status.dims[:2]
    labels = {dim: [str(label) for label in ds[dim].values] for dim in drawn
              if dim in ds.coords and ds[dim].dtype.kind not in "iuf"}  # fmt: skip
    for dim in drawn:
        if dim in labels or dim not in ds.coords:
            ds = ds.drop_vars(dim, errors="ignore").assign_coords({dim: np.arange(ds.sizes[dim])})
    part, variable, state = _flat(ds, name, chosen)
    if variable.ndim == 2 and variable.dims[-1] == family.ANGLE and family.over_angles(ds):
        family.draw_family(axes, part, variable, paper)
    elif variable.ndim == 2:
        draw_map(axes, ds, variable, state, boundaries, paper, colours or {})
    elif variable.ndim == 1:
        draw_profile(axes, part, variable, state, paper, variable.dims[0] in labels)
        if "flag_values" not in variable.attrs:
            axes.set_ylim(*((colours or {}).get(key) for key in ("vmin", "vmax")))
    else:
        raise BadInput(f"{name} is a single number; a figure needs at least one axis")
    for dim, setting in zip(variable.dims, (axes.set_xticks, axes.set_yticks), strict=False):
        if dim in labels:
            words = [literal(text, 40) for text in labels[dim][:MOST_LABELS]]
            setting(range(len(words)), words)
    if not paper:
        axes.set_title(title_of(ds, variable), fontsize=10 if alone(axes) else 8)
    fit(axes)
    return elsewhere(ds, variable.dims) if boundaries else ""


def _check_colours(asked):
    """Raise BadInput unless the limits are numbers, the lower one first, and the colour map is one
    of matplotlib's.
    """
    limits = {key: asked[key] for key in ("vmin", "vmax") if asked.get(key) is not None}
    for key, value in limits.items():
        if np.ndim(value) or np.asarray(value).dtype.kind not in "iuf" or not np.isfinite(value):
            raise BadInput(f"{key} = {shown(value)}: it must be a finite number")
    if len(limits) == 2 and not limits["vmin"] < limits["vmax"]:
        raise BadInput(f"vmin = {limits['vmin']:g} is not below vmax = {limits['vmax']:g}")
    robust = asked.get("robust")
    if not (robust is None or isinstance(robust, (bool, np.bool_))):
        raise BadInput(f"robust = {shown(robust)}: it must be True or False")
    name = asked.get("cmap")
    if isinstance(name, str) and name not in matplotlib.colormaps:
        raise BadInput(f"cmap: {modules.unknown('colour map', name, list(matplotlib.colormaps))}")
    if not (name is None or isinstance(name, (str, matplotlib.colors.Colormap))):
        raise BadInput(
            f"cmap = {shown(name)}: give the name of a colour map, such as 'viridis', or one of matplotlib's"
        )


def _without_single(ds, across):
    """The survey without those axes of a single value, fixed parameters then, that would be drawn
    without being asked for.
    """
    single = [dim for dim in ds.status.dims[:2] if ds.sizes[dim] == 1 and dim not in across]
    kept = len(single) == ds.status.ndim or family.over_angles(ds)
    return ds if kept else ds.isel(dict.fromkeys(single, 0))


def _chosen(ds, across):
    """The one or two axes to be drawn, or None; raises BadInput for an unknown one."""
    known = list(ds.status.dims)
    for key, name in zip("xy", across, strict=True):
        if name is not None and name not in known:
            raise BadInput(f"{key}: {modules.unknown('axis', name, known)}")
    x, y = across
    if x is not None and x == y:
        raise BadInput(f"x and y are both {x!r}; give two axes")
    if y is not None:
        x = next((name for name in known if name != y), None) if x is None else x
        return [x, y] if x is not None else None
    if x is None:
        # of Abel solutions it depends on what is drawn
        return None if family.over_angles(ds) else plane_of(ds)
    return [x, *[name for name in known if name != x][:1]]


def _flat(ds, name, chosen=None):
    """The survey, the variable and the status on at most two of the survey's dimensions; along any
    other at `position_of`. Of Abel solutions w and t are curves over the angle.
    """
    keep = list(ds.status.dims)[:2]
    if family.over_angles(ds):
        others = [dim for dim in ds.status.dims if dim != family.ANGLE]
        keep = [others[0], family.ANGLE] if name in family.AT_TURNING else others[:2]
    keep = chosen or keep
    part = ds.isel(
        {dim: position_of(ds, dim) for dim in (*ds.status.dims, *ds[name].dims) if dim not in keep}
    )
    unsorted = [dim for dim in keep if not _is_monotonic(part[dim].values)]
    part = part.sortby(unsorted) if unsorted else part
    return part, masked(part[name].transpose(*keep)), part.status.transpose(*keep)


def _is_monotonic(values):
    steps = np.diff(values.astype(float))
    return bool((steps >= 0).all() or (steps <= 0).all())
