"""Dataset -> figure: the stability map, a variable with its colour bar, or a curve with its error band.

Pictures are for the screen (`style` "screen") or for papers ("paper": column widths, no title, and hatching, so that
verdicts differ in grey print too).
"""

import re
import textwrap
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from math import inf

import matplotlib
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.mathtext import MathTextParser
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import ScaledTranslation

from survey import modules, status
from survey.errors import BadInput
from survey.file import schema
from survey.file.labels import flag_codes, percent, unanswered, undecided_share
from survey.file.overview import Overview, Points
from survey.grid import logarithmic
from survey.wording import plain

# after Okabe and Ito, safe for the colour-blind, the first two far apart in grey print too;
# black is kept for undecided, white with hatching for failed
COLOURS = ("#D55E00", "#A6D8F5", "#E69F00", "#F0E442", "#009E73", "#CC79A7", "#0072B2", "#999999", "#B8E0D2", "#5D3A9B")
UNDECIDED = "#000000"
# of points that have no answer by nature, by the scene's own statuses: in print between unstable, stable and black
GREYS = ("#808080", "#B3B3B3", "#5E5E5E")
HATCHES = ("//////", "", "....", "\\\\\\\\", "xxxx", "----", "||||", "++++", "oo", "**")  # of the COLOURS, in papers
HATCHED = 500  # cells along an axis: hatching is drawn as outlines
WHOLE = 2000  # points along an axis: of larger maps a cell of the picture stands for several points
CELLS = 1000  # along an axis then, at most: each costs a hundred bytes
FINE = 0.8  # cells for each pixel of the axes, before legend and labels take their share
SPARE = 0.95  # of the room for a text: fonts are a little wider at other resolutions
BESIDE = 1.2  # of the width of axes that have neighbours: texts may reach into the gap
MARK_BELOW = 0.002  # a share of the map: rarer points are also marked with a ring, or nobody would see them
SAID, SYMBOL = 300, 120  # characters of a text, and of a formula, of a file
DEPTH = 6  # of nested braces in a formula
SIZED = ("\\hspace", "\\genfrac")  # TeX that takes lengths, which may be of miles
_EDGES = "edges: even dark, odd grey;\nperiodic solid, antiperiodic dashed"
_RIM = withStroke(linewidth=2.0, foreground="#444444")
_POINT = {"ls": "none", "mec": "#000000", "mew": 0.8}
# boundaries by class: what the legend says, and how they are drawn
CURVES = {
    "even_periodic": (_EDGES, {"color": "#000000", "ls": "-", "lw": 0.8}),
    "odd_periodic": (_EDGES, {"color": "#707070", "ls": "-", "lw": 0.8}),
    "even_antiperiodic": (_EDGES, {"color": "#000000", "ls": (0, (5, 2)), "lw": 0.8}),
    "odd_antiperiodic": (_EDGES, {"color": "#707070", "ls": (0, (5, 2)), "lw": 0.8}),
    "pole_passage": ("pole passages", {"color": "#FFFFFF", "ls": (0, (4, 2)), "lw": 1.0, "path_effects": [_RIM]}),
    "stable_precession": ("stable regular precessions", {"color": "#000000", "ls": "-", "lw": 1.2}),
    "separatrix": ("separatrices", {"color": "#D55E00", "ls": "-", "lw": 1.4}),
    "cusp": ("cusps", {"marker": "D", "ms": 5, "mfc": "#FFFFFF"} | _POINT),
    "stable_upright": ("stable upright rotations", {"marker": "o", "ms": 5, "mfc": "#000000"} | _POINT),
    "unstable_upright": ("unstable upright rotations", {"marker": "o", "ms": 6, "mfc": "#D55E00"} | _POINT),
}


@dataclass(frozen=True)
class Look:
    """A style: figure sizes in inches by width, and what matplotlib is told."""

    sizes: Mapping[str, tuple[float, float]]
    dpi: int
    paper: bool = False
    rc: Mapping[str, object] = field(default_factory=dict)


_WIDE = (7.2, 5.2)
_RC = {"text.usetex": False}  # a stranger's file must not reach LaTeX, which reads and writes files
STYLES = {
    "screen": Look({"single": _WIDE, "double": _WIDE}, 150, rc=_RC),
    # columns of 85 and 175 mm; fonts are embedded as TrueType (42), as journals ask
    "paper": Look({"single": (3.35, 2.9), "double": (6.89, 4.4)}, 600, True, _RC | {
        "font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 9, "axes.labelsize": 9,
        "xtick.labelsize": 8, "ytick.labelsize": 8, "axes.linewidth": 0.6, "xtick.major.width": 0.6,
        "ytick.major.width": 0.6, "hatch.linewidth": 0.35, "pdf.fonttype": 42, "ps.fonttype": 42,
        "svg.fonttype": "none",
    }),
}  # fmt: skip
WIDTHS = ("single", "double")


def look(style):
    """The Look of a style's name (None: for the screen); raises BadInput for an unknown one."""
    if style is not None and style not in STYLES:
        raise BadInput(modules.unknown("style", style, list(STYLES)))
    return STYLES[style or "screen"]


def size(style, width):
    """(width, height) in inches; raises BadInput for an unknown width."""
    if width not in WIDTHS:
        raise BadInput(modules.unknown("width", width, list(WIDTHS)))
    return look(style).sizes[width]


def save(ds, path, name=None, style=None, width="single"):
    """Draw variable `name` (the verdict, or the first output) of `ds` to `path` (PNG, PDF or SVG)."""
    with matplotlib.rc_context(look(style).rc):
        draw(ds, name, style, width).savefig(path, dpi=look(style).dpi)


def draw(ds, name=None, style=None, width="single"):
    """The figure of one variable over the survey's axes, unknown to pyplot, which shows what it knows in notebooks."""
    with matplotlib.rc_context(look(style).rc):
        figure = Figure(figsize=size(style, width), layout="constrained")
        onto(figure.subplots(), ds, name, style=style)
    return figure


def onto(axes, ds, name=None, boundaries=True, style=None):
    """Draw one variable (the verdict, or the first output) onto matplotlib axes; BadInput for an unknown one."""
    paper = look(style).paper
    drawable = [key for key in ds.data_vars if not key.endswith("_error") and set(ds[key].dims) >= set(ds.status.dims)
                and ds[key].dtype.kind in "iuf"]  # fmt: skip
    name = name or ("verdict" if "verdict" in ds else drawable[0])
    if name not in drawable:
        raise BadInput(modules.unknown("variable", name, drawable))
    variable, state = _flat(ds, name)
    for text in axes.findobj(Text):  # made, perhaps, while the user had LaTeX on
        text.set_usetex(False)
    if variable.ndim == 2:
        _map(axes, ds, variable, state, boundaries, paper)
    elif variable.ndim == 1:
        _curve(axes, ds, variable, state, paper)
    else:
        raise BadInput(f"{name} is a single number; a figure needs at least one axis")
    if not paper:
        axes.set_title(_title(ds, variable), fontsize=10 if _alone(axes) else 8)
    _fit(axes)


def _fit(axes):
    """Wrap the title and the labels that would not fit, as the figure is laid out now."""
    axes.figure.figure.draw_without_rendering()
    for own in [axes, *(other for other in axes.figure.axes if other.get_label() == "<colorbar>")]:
        x, y = _room(own, inf if _alone(axes) else BESIDE)
        for text, room in ((own.title, x), (own.xaxis.label, x), (own.yaxis.label, y)):
            wrap(text, room)


def words(text, most=SAID):
    """A file's text for matplotlib: nothing in it is a formula, nothing invisible, and no end of it."""
    return plain(str(text), most).replace("$", r"\$")


def formula(symbol, name):
    """`symbol` as a formula, if it is TeX that matplotlib can draw; else the name as text."""
    return f"${symbol}$" if _is_formula(symbol) else words(name)


@lru_cache(maxsize=512)
def _is_formula(symbol):
    if not 0 < len(symbol) <= SYMBOL or "$" in symbol or not symbol.isprintable() or _depth(symbol) > DEPTH:
        return False
    if any(command in symbol for command in SIZED):
        return False
    try:
        MathTextParser("path").parse(f"${symbol}$")
    except (ValueError, RecursionError):
        return False
    return True


def _depth(symbol):
    """How deep braces are nested."""
    level = np.cumsum([(c == "{") - (c == "}") for c in symbol])
    return int(level.max(initial=0))


def _flat(ds, name):
    """The variable and the status on at most two of the survey's dimensions (the first place of any other)."""
    keep = list(ds.status.dims)[:2]
    first = {dim: 0 for dim in ds[name].dims if dim not in keep}
    state = ds.status.isel({dim: 0 for dim in ds.status.dims if dim not in keep})
    variable = ds[name].isel(first).transpose(*state.dims)
    unsorted = [dim for dim in keep if not _goes_one_way(variable[dim].values)]
    return (variable.sortby(unsorted), state.sortby(unsorted)) if unsorted else (variable, state)


def _goes_one_way(values):
    steps = np.diff(values.astype(float))
    return bool((steps >= 0).all() or (steps <= 0).all())


def _map(axes, ds, variable, state, boundaries, paper):
    scales = ["log" if logarithmic(variable[dim].values) else "linear" for dim in variable.dims]
    whole = MaxNLocator(integer=True) if variable.dtype.kind == "i" else None
    variable, state, number = _shown(axes, ds, variable, state, look("paper" if paper else None).dpi)
    x, y = (variable[dim] for dim in variable.dims)
    failed = np.isin(state.values, list(status.FAILURES))
    outside = state.values == status.INVALID_PARAMETERS
    if variable.name == "verdict" and "cell_verdict" in ds:
        handles = _cells(axes, ds, x, y, failed, number, paper)
    elif "flag_values" in variable.attrs:
        handles = _verdicts(axes, x, y, ds, variable, state, number, paper)
        handles += _no_answer(axes, x, y, failed, outside, number, paper)
    else:
        shown = np.ma.masked_invalid(np.where(failed | outside, np.nan, variable.values.astype(float)))
        drawn = axes.pcolormesh(x, y, shown.T, cmap="viridis", shading="nearest", rasterized=True, **limits(shown))
        if not shown.mask.all():
            axes.figure.colorbar(drawn, ax=axes, label=label_of(variable), ticks=whole)
        axes.set_facecolor("#dddddd")
        handles = _no_answer(axes, x, y, failed, outside, number, paper)
        handles += [Patch(color="#dddddd", label="does not apply")] if (shown.mask & ~(failed | outside)).any() else []
    if boundaries and "curve_count" in ds:
        handles += _curves(axes, in_plane(ds, variable), x, y)
    if handles:
        _legend(axes, handles)
    axes.set(xlabel=label_of(x), ylabel=label_of(y))
    for setting, scale in zip((axes.set_xscale, axes.set_yscale), scales, strict=True):
        if scale == "log":
            setting(scale)


def _shown(axes, ds, variable, state, dpi):
    """(variable, status, {}) in memory; of a large map for the cells of the picture, and {kind: number of points}."""
    if max(variable.shape) <= WHOLE:
        return variable.compute(), state.compute(), {}
    box, points = axes.get_window_extent(), Points(variable, state, unanswered(ds))
    pixels = np.array([box.width, box.height]) * dpi / axes.figure.dpi
    whole = Overview(points, np.clip(FINE * pixels, 1, CELLS).astype(int)).complete
    values, states = points.cells(whole)
    for dim, starts in zip(variable.dims, whole.starts, strict=True):
        ends = np.append(starts[1:], variable.sizes[dim]) - 1
        middles = 0.5 * (variable[dim].values[starts] + variable[dim].values[ends])
        variable, state = (
            v.isel({dim: starts}).assign_coords({dim: (dim, middles, v[dim].attrs)}) for v in (variable, state)
        )
    return variable.copy(data=values), state.copy(data=states), whole.number


def in_plane(ds, variable):
    """The curves of the plane that is drawn, where a third axis makes a stack of planes."""
    deeper = [c for c in variable.coords.values() if c.ndim == 0 and c.name in ds.dims and f"curve_{c.name}" in ds]
    if not deeper:
        return ds
    here = np.repeat(True, ds.sizes["curve_point"])
    for coordinate in deeper:
        here &= ds[f"curve_{coordinate.name}"].values == float(coordinate)
    firsts = np.cumsum(ds.curve_count.values) - ds.curve_count.values
    return ds.isel(curve_point=here, curve=here[firsts])


def curves_of(ds):
    """{class: slices of its curves in `curve_point`}, in the order in which they are drawn; raises Damaged."""
    schema.curves(ds)
    names = {code: name for name, code in flag_codes(ds.curve_class.attrs).items()}
    kinds, ends = ds.curve_class.values, np.cumsum(ds.curve_count.values)
    found = {}
    for kind, last, number in zip(kinds, ends, ds.curve_count.values, strict=True):
        found.setdefault(names[kind], []).append(slice(int(last - number), int(last)))
    return {name: found[name] for name in CURVES if name in found}


def _curves(axes, ds, x, y):
    """The boundaries over the map, points above lines, and their legend handles."""
    handles = {}
    for name, parts in curves_of(ds).items():
        label, look = CURVES[name]
        over = 3 if "marker" in look else 2
        for own in parts:
            axes.plot(
                ds[f"curve_{x.name}"].values[own], ds[f"curve_{y.name}"].values[own], clip_on=over < 3, **look,
                zorder=over,
            )  # fmt: skip
        handles.setdefault(label, Line2D([], [], label=label, **look))
    if "cell_verdict" not in ds:
        axes.set(xlim=_widened(x.values)[[0, -1]], ylim=_widened(y.values)[[0, -1]])
    return list(handles.values())


def _cells(axes, ds, x, y, failed, number, paper):
    """The map's cells instead of its points, with the area of each verdict. Returns the handles."""
    schema.cells(ds)
    left, right, low, high = (ds[f"cell_{axis.name}_{end}"].values for axis in (x, y) for end in ("low", "high"))
    corners = np.stack([left, low, left, high, right, high, right, low], axis=1).reshape(-1, 4, 2)
    table = flag_codes(ds.cell_verdict.attrs)
    shares = dict(zip(flag_codes(ds.area_verdict.attrs), ds.area_fraction.values, strict=True))
    handles = []
    for name, code in reversed(table.items()):
        own, colour = ds.cell_verdict.values == code, colours_of(table)[name]
        # without smoothing there are no seams between neighbours; a hairline keeps small undecided cells in sight
        line = {"edgecolors": "none", "antialiased": False}
        line = {"edgecolors": colour, "lw": 0.4, "snap": False} if name == "undecided" else line
        hatch = _hatch(table, name) if paper else None
        axes.add_collection(PolyCollection(corners[own], facecolors=colour, rasterized=True, **line))
        if hatch:
            axes.add_collection(PolyCollection(corners[own], facecolors="none", lw=0, hatch=hatch, rasterized=True))
        bar = float(ds.area_fraction_error[0])
        part = percent(shares[name], bar) if name in shares else f"{100 * undecided_share(ds):.2g} %"
        part = part.replace("+-", "±")
        patch = Patch(facecolor=colour, edgecolor="black", lw=0.5, hatch=hatch, label=f"{words(name)} ({part})")
        handles += [patch] if own.any() else []
    axes.set(xlim=(left.min(), right.max()), ylim=(low.min(), high.max()))
    return handles + _marks(axes, x, y, failed, "failed", number, paper)


def _kinds(ds, variable, state):
    """(codes, {kind: code}, {kind: colour}) of a flag variable; masked where the point failed or lies outside.

    The kinds are its flags, and after them why points have no answer by nature, whose code is not that of undecided.
    """
    table, shown = flag_codes(variable.attrs), variable.values.astype(np.int32)
    colours = dict.fromkeys(table, "#444444") | colours_of(table) | greys_of(ds, table)
    for name, code in ((name, unanswered(ds)[name]) for name in greys_of(ds, table)):
        table[name] = max(table.values()) + 1
        shown[(variable.values == table["undecided"]) & (state.values == code)] = table[name]
    return np.ma.masked_array(shown, np.isin(state.values, list(status.UNANSWERED))), table, colours


def _verdicts(axes, x, y, ds, variable, state, number, paper):
    """A colour per kind, rare points ringed; what failed or lies outside stays white. Returns the handles."""
    shown, table, palette = _kinds(ds, variable, state)
    flags = flag_codes(variable.attrs)
    codes = sorted(table.values())
    names = {code: name for name, code in table.items()}
    cmap = ListedColormap([palette[names[code]] for code in codes])
    edges = np.append(np.array(codes) - 0.5, codes[-1] + 0.5)
    look = {"cmap": cmap, "norm": BoundaryNorm(edges, cmap.N), "shading": "nearest", "rasterized": True}
    axes.pcolormesh(x, y, shown.T, **look)
    number = number or {name: int((shown == code).filled(False).sum()) for name, code in table.items()}
    handles = [
        Patch(
            facecolor=palette[names[code]],
            edgecolor="black",
            linewidth=0.5,
            hatch=_hatch(flags, names[code]) if paper else None,
            label=_spaced(names[code]) if paper else _counted(names[code], number),
        )
        for code in codes
        if number[names[code]] and names[code] != "undecided"
    ]
    if paper:
        for code in codes:
            if number[names[code]] and _hatch(flags, names[code]):
                _hatched(axes, x, y, (shown == code).filled(False), _hatch(flags, names[code]))
    undecided = (shown == table.get("undecided", -1)).filled(False)
    return handles + _marks(axes, x, y, undecided, "undecided", number, paper, UNDECIDED)


def _no_answer(axes, x, y, failed, outside, number, paper):
    handles = _marks(axes, x, y, failed, "failed", number, paper)
    return handles + _marks(axes, x, y, outside, "outside the domain", number, paper)


def _hatch(table, name):
    """The hatching of a meaning in papers; none of undecided, which is black, and of no answer, which is grey."""
    meant = [other for other in table if other != "undecided"]
    return HATCHES[meant.index(name) % len(HATCHES)] if name in meant and "ok" not in table else ""


def _hatched(axes, x, y, where, hatch):
    """Hatch the cells of the points `where`, along the edges of the cells."""
    some = tuple(slice(None, None, -(-length // HATCHED)) for length in where.shape)
    x, y, where = _cornered(x.values[some[0]]), _cornered(y.values[some[1]]), where[some]
    doubled = np.repeat(np.repeat(where.T.astype(float), 2, axis=0), 2, axis=1)
    axes.contourf(x, y, doubled, levels=[0.5, 1.5], colors="none", hatches=[hatch])


def _cornered(values):
    """Each cell's two edges, cell after cell."""
    middles = 0.5 * (values[1:] + values[:-1])
    outer = _widened(values)[[0, -1]]
    return np.concatenate([outer[:1], np.repeat(middles, 2), outer[1:]])


def colours_of(table):
    """A colour per meaning; "ok" takes that of stable."""
    meant = [name for name in table if name not in ("undecided", "ok")]
    first = [c for c in COLOURS if "ok" not in table or c != COLOURS[1]]
    return {"undecided": UNDECIDED, "ok": COLOURS[1]} | dict(zip(meant, first, strict=False))


def greys_of(ds, table):
    """{status: grey} of the scene's own statuses, for a flag variable that may be undecided."""
    names = [name for name in unanswered(ds) if "undecided" in table]
    return {name: GREYS[i % len(GREYS)] for i, name in enumerate(names)}


def _marks(axes, x, y, where, label, number, paper=False, colour="white"):
    """Show the cells `where`: hatched where they fill an area, ringed where they are rare; their legend handle.

    `number` holds how many points they stand for, where that is not one each.
    """
    total = int(where.sum())
    label = label if paper else f"{label} ({number.get(label, total):,})"
    if total == 0:
        return []
    if total <= MARK_BELOW * where.size:
        i, j = np.nonzero(where)
        ring = {"marker": "o", "markeredgecolor": "#D40000", "markerfacecolor": colour, "linestyle": "none"}
        axes.plot(x.values[i], y.values[j], markersize=4, **ring)
        return [Line2D([], [], markersize=6, label=label, **ring)]
    if colour == "white":
        # one more cell all round, or the hatching would end at the centres of the outermost cells
        wide = np.pad(where.T.astype(float), 1, mode="edge")
        axes.contourf(_widened(x.values), _widened(y.values), wide, levels=[0.5, 1.5], colors="none", hatches=["xxx"])
        return [Patch(facecolor="white", edgecolor="grey", hatch="xxx", label=label)]
    return [Patch(facecolor=colour, label=label)]


def _widened(values):
    """The coordinates with the outer edges of the first and the last cell."""
    low, high = (0.5 * np.diff(values)[[0, -1]]) if values.size > 1 else (0.5, 0.5)
    return np.concatenate([[values[0] - low], values, [values[-1] + high]])


def _curve(axes, ds, variable, state, paper):
    x = variable[variable.dims[0]]
    if "flag_values" in variable.attrs:
        shown, table, palette = _kinds(ds, variable, state)
        # all flags, of the other kinds those that occur
        names = [name for name, code in table.items() if name in flag_codes(variable.attrs) or (shown == code).any()]
        for height, name in enumerate(names):
            here = x.values[(shown == table[name]).filled(False)]
            axes.plot(here, np.full(here.size, height), "s", markersize=4, color=palette[name])
        axes.set_yticks(range(len(names)), [_spaced(name) for name in names], fontsize=8)
    else:
        label = textwrap.fill(words(variable.attrs.get("long_name", variable.name)), 60)
        label = formula(variable.attrs.get("symbol") or variable.name, variable.name) if paper else label
        axes.plot(x, variable, lw=1.2, color="#0072B2", label=label)
    if f"{variable.name}_error" in ds:
        bar = ds[f"{variable.name}_error"].isel({d: 0 for d in ds[variable.name].dims if d not in variable.dims})
        axes.fill_between(x, variable - bar, variable + bar, color="#56B4E9", alpha=0.5, lw=0, label="error bar")
    bad = np.isin(state.values, list(status.UNANSWERED))
    if bad.any():
        axes.plot(x.values[bad], np.full(bad.sum(), axes.get_ylim()[0]), "x", color="#D55E00", label="no answer")
    axes.set(xlabel=label_of(x), ylabel=label_of(variable))
    handles = axes.get_legend_handles_labels()[0]
    if handles and paper:
        _legend(axes, handles)
    elif handles:
        axes.legend(fontsize=8)
    if logarithmic(x.values):
        axes.set_xscale("log")


def _room(axes, most):
    """Width and height for what stands in the middle of the axes' sides: in the figure, `most` times the axes' own."""
    own, whole = axes.get_window_extent(), axes.figure.bbox
    x, y = 0.5 * (own.x0 + own.x1), 0.5 * (own.y0 + own.y1)
    width, height = 2 * min(x - whole.x0, whole.x1 - x), 2 * min(y - whole.y0, whole.y1 - y)
    return min(width, most * own.width), min(height, most * own.height)


def wrap(text, room):
    """Break the lines of a matplotlib Text, laid out, that are longer than `room` pixels; formulas stay whole."""
    said = text.get_text()
    for number in range(max(map(len, said.split("\n"))), 9, -3):
        box = text.get_window_extent()
        if (box.height if text.get_rotation() else box.width) <= SPARE * room:
            return
        lines = [re.sub(r"\$[^$]*\$", lambda formula: formula[0].replace(" ", "\0"), line) for line in said.split("\n")]
        wrapped = [textwrap.fill(line, number, break_long_words=False, break_on_hyphens=False) for line in lines]
        text.set_text("\n".join(wrapped).replace("\0", " "))


def _alone(axes):
    """Has the figure no other axes, but for colour bars?"""
    return [other for other in axes.figure.axes if other.get_label() != "<colorbar>"] == [axes]


def _legend(axes, handles):
    """Below: of the figure where the axes fill it, else of the axes; in as many columns as there is room for."""
    own = _alone(axes) and axes.figure.get_constrained_layout()
    # of its own, a legend's frame, which is not seen, may reach beyond the figure
    room = 1.02 * axes.figure.bbox.width if own else BESIDE * axes.get_window_extent().width
    look = {"handles": handles, "frameon": False, "fontsize": 8}
    below = axes.transAxes + ScaledTranslation(0, -0.5, axes.figure.dpi_scale_trans)  # inches: ticks and label
    for columns in range(min(4, len(handles)), 0, -1):
        if own:
            legend = axes.figure.legend(loc="outside lower center", ncols=columns, **look)
        else:
            place = {"loc": "upper center", "bbox_to_anchor": (0.5, 0), "bbox_transform": below}
            legend = axes.legend(**place, ncols=columns, **look)
        if columns == 1 or legend.get_window_extent().width <= room:
            return
        legend.remove()


def limits(shown):
    """Colour limits that a few far values, or a plain of zeros, do not spoil."""
    values = shown.compressed()
    values = values[values != 0] if (values == 0).any() and (values >= 0).all() else values
    if values.size == 0:
        return {}
    low, high = np.percentile(values, [1, 99])
    low = 0.0 if shown.min() == 0 else low
    return {"vmin": low, "vmax": high} if high > low else {}


def label_of(variable):
    """`long name, symbol (unit)`."""
    symbol, units = variable.attrs.get("symbol", ""), variable.attrs.get("units", "1")
    text = words(variable.attrs.get("long_name", variable.name))
    shown = _is_formula(symbol) and "flag_values" not in variable.attrs
    text = "$$" if text == symbol else f"{text}, $$" if shown else text  # TeX is wider than what it shows: put in last
    text += "" if units in ("1", "") else f" ({words(units)})"
    wrapped = textwrap.fill(text, 40, break_long_words=False)
    return wrapped.replace("$$", f"${symbol}$") if shown else wrapped


def _title(ds, variable):
    """The survey's title, what is drawn, and the numbers that are fixed and not zero."""
    lines = [words(ds.attrs.get("title", "")), words(variable.attrs.get("long_name", variable.name))]
    fixed = [c for c in variable.coords.values() if c.ndim == 0 and c.dtype.kind in "fi"]
    fixed = [c for c in fixed if c.name in ds.dims or float(c) != 0]
    of = {name: f" (1 of {ds.sizes[name]})" for name in variable.coords if ds.sizes.get(name, 1) > 1}
    numbers = [f"{_equal(c)}{of.get(c.name, '')}" for c in fixed]
    labels = [c for c in variable.coords.values() if c.ndim == 0 and c.dtype.kind in "UO"]
    numbers = ", ".join(numbers + [f"{words(c.name)} {words(c.item())}{of.get(c.name, '')}" for c in labels])
    lines[1] += f" ({words(ds.attrs['options'])})" if ds.attrs.get("options") else ""
    return "\n".join([*lines, numbers] if numbers else lines)


def _equal(coordinate):
    """`symbol = number` of a fixed parameter."""
    symbol, number = coordinate.attrs.get("symbol") or coordinate.name, f"{float(coordinate):.6g}"
    return f"${symbol} = {number}$" if _is_formula(symbol) else f"{words(coordinate.name)} = {number}"


def _spaced(name):
    return words(name.replace("_", " ").strip())


def _counted(name, number):
    return f"{_spaced(name)} ({number[name]:,})"
