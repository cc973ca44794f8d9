"""The boundaries drawn over a map: edges of tongues and other curves, by class."""

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from survey.file import schema
from survey.file.labels import flag_codes
from survey.show import family
from survey.show.marks import widened
from survey.show.text import spaced

_EDGES = "edges: even dark, odd grey;\nperiodic solid, antiperiodic dashed"
_LIMITS = (-2.0, 2.0)  # of the trace D of Hill's equation: the edges of stability
_RIM = withStroke(linewidth=2.0, foreground="#444444")
_DARK = ("#000000", "#707070")
_PALE = {"color": "#FFFFFF", "lw": 1.2, "path_effects": [_RIM]}
_THIN = {"color": "#000000", "ls": ":", "lw": 0.8}
_POINT = {"ls": "none", "mec": "#000000", "mew": 0.8}
# boundaries by class: label in the legend, and properties of matplotlib's line
CURVES = {
    "even_periodic": (_EDGES, {"color": "#000000", "ls": "-", "lw": 0.8}),
    "odd_periodic": (_EDGES, {"color": "#707070", "ls": "-", "lw": 0.8}),
    "even_antiperiodic": (_EDGES, {"color": "#000000", "ls": (0, (5, 2)), "lw": 0.8}),
    "odd_antiperiodic": (_EDGES, {"color": "#707070", "ls": (0, (5, 2)), "lw": 0.8}),
    "plus_one": ("a multiplier passes 1", {"color": "#000000", "ls": "-", "lw": 1.0}),
    "minus_one": (
        "a multiplier passes \N{MINUS SIGN}1",
        {"color": "#000000", "ls": (0, (5, 2)), "lw": 1.0},
    ),
    "neimark_sacker": (
        "a complex pair passes the circle",
        {"color": "#D40000", "ls": "-", "lw": 1.2},
    ),
    "collision": (
        "multipliers collide on the circle",
        {"color": "#D40000", "ls": (0, (4, 1.5)), "lw": 1.2},
    ),
    "A": ("A: multipliers meet at \N{MINUS SIGN}1", {"color": "#000000", "ls": "-", "lw": 1.2}),
    "B": (
        "B: multipliers meet at \N{MINUS SIGN}1",
        {"color": "#000000", "ls": (0, (5, 2)), "lw": 1.2},
    ),
    "KC": ("KC: two pairs meet on the circle", {"color": "#D40000", "ls": "-", "lw": 1.2}),
    "critical_rate": ("critical rate of the rotation", {"ls": "-"} | _PALE),
    "equal_moments": (
        "equal moments of inertia",
        {"color": "#000000", "ls": (0, (5, 2)), "lw": 1.2},
    ),
    "critical_motion": (
        "the critical motion becomes stable",
        {"color": "#D40000", "ls": "-", "lw": 1.2},
    ),
    "pole_passage": (
        "pole passages",
        {"color": "#FFFFFF", "ls": (0, (4, 2)), "lw": 1.0, "path_effects": [_RIM]},
    ),
    "stable_precession": ("stable regular precessions", {"color": "#000000", "ls": "-", "lw": 1.2}),
    "separatrix": ("separatrices", {"color": "#D55E00", "ls": "-", "lw": 1.4}),
    "stable_manifold": (
        "stable manifolds of saddles\n(to windings 0.3 % of the map apart)",
        {"color": "#000000", "ls": "-", "lw": 0.5},
    ),
    "stable_cycle": ("stable cycles", {"color": "#000000", "ls": "-", "lw": 2.0}),
    "unstable_cycle": ("unstable cycles", {"color": "#000000", "ls": (0, (4, 1.5)), "lw": 2.0}),
    "ends": ("K = 0 (or L = 0): ends", {"color": "#000000", "ls": (0, (1, 1.5)), "lw": 1.6}),
    "homoclinic": ("homoclinic connections", {"color": "#D40000", "ls": "-", "lw": 1.2}),
    "heteroclinic": (
        "heteroclinic connections",
        {"color": "#D40000", "ls": (0, (4, 1.5)), "lw": 1.2},
    ),
    "cycle_fold": ("folds of cycles", {"color": "#0050A0", "ls": "-", "lw": 1.4}),
    "fold": ("folds of equilibria", {"color": "#000000", "ls": "-", "lw": 1.2}),
    "supercritical_hopf": ("supercritical Hopf", {"ls": "-"} | _PALE),
    "subcritical_hopf": (
        "subcritical Hopf",
        {"color": "#FFFFFF", "ls": (0, (4, 2)), "lw": 1.2, "path_effects": [_RIM]},
    ),
    "bogdanov_takens": ("Bogdanov-Takens", {"marker": "s", "ms": 5, "mfc": "#FFFFFF"} | _POINT),
    "generalised_hopf": ("generalised Hopf", {"marker": "^", "ms": 6, "mfc": "#FFFFFF"} | _POINT),
    "saddle": ("saddles", {"marker": "X", "ms": 7, "mfc": "#FFFFFF"} | _POINT),
    "sink": ("attracting equilibria", {"marker": "o", "ms": 6, "mfc": "#000000"} | _POINT),
    "centre": ("centres", {"marker": "o", "ms": 6, "mfc": "#999999"} | _POINT),
    "source": ("repelling equilibria", {"marker": "o", "ms": 6, "mfc": "#FFFFFF"} | _POINT),
    "cusp": ("cusps", {"marker": "D", "ms": 5, "mfc": "#FFFFFF"} | _POINT),
    "stable_upright": (
        "stable upright rotations",
        {"marker": "o", "ms": 5, "mfc": "#000000"} | _POINT,
    ),
    "unstable_upright": (
        "unstable upright rotations",
        {"marker": "o", "ms": 6, "mfc": "#D55E00"} | _POINT,
    ),
}


def limits_of(variable):
    """The values of a variable at which stability ends everywhere: of the trace D of Hill's equation.

    With damping they are 1 + e^(-2cT) and its negative, which differ from point to point.
    """
    is_trace = variable.name == "discriminant" and variable.attrs.get("symbol") == "D"
    return _LIMITS if is_trace and "damp" not in variable.attrs.get("long_name", "") else ()


def planes_of(ds):
    """The pairs of axes in whose planes the curves of the file lie; () where it has none."""
    if "curve_count" not in ds:
        return ()
    if text := ds.attrs.get("boundary_planes"):
        return tuple(tuple(pair.split(", ")) for pair in text.split("; "))
    # an older file, or one of two axes: those of the planes come first
    names = [
        str(key).removeprefix("curve_") for key in ds.data_vars if ds[key].dims == ("curve_point",)
    ]
    pair = tuple(name for name in names if name in ds.coords)[:2]
    return (pair,) if len(pair) == 2 else ()


def plane_of(ds):
    """The two axes that pictures and the viewer draw unless others are asked for; None for the first two.

    Of three or more they are those of curves that the file has, else the first two with several
    values, of Abel solutions other than the angle.
    """
    known = list(ds.status.dims)
    several = [name for name in known if ds.sizes[name] > 1]
    drawn = [list(pair) for pair in planes_of(ds) if set(pair) <= set(several)]
    if len(known) < 3 or any(set(pair) == set(known[:2]) for pair in drawn):
        return None
    if family.over_angles(ds):
        others = [name for name in several if name != family.ANGLE]
        several = [*others, family.ANGLE]
    first = (drawn or [several])[0][:2]
    return first if len(first) == 2 and first != known[:2] else None


def position_of(ds, dim):
    """The index along a further axis at which pictures and the viewer begin: the first, of Abel
    solutions the last angle, up to which they are solved.
    """
    return ds.sizes[dim] - 1 if dim == family.ANGLE and family.over_angles(ds) else 0


def elsewhere(ds, drawn):
    """One line where the curves of the file lie in other planes than that of the axes `drawn`, else ""."""
    planes = planes_of(ds)
    if len(drawn) != 2 or not planes or any(set(pair) == set(drawn) for pair in planes):
        return ""
    known = ", and of ".join(" and ".join(pair) for pair in planes)
    return (
        f"boundaries: the curves in this file lie in planes of {known}, not of {' and '.join(drawn)}; "
        f"run the workflow with plane = {list(drawn)} under [boundaries] for these"
    )


def in_plane(ds, variable):
    """The curves that lie in the plane that is drawn, where a third axis makes a stack of planes.

    Curves found on planes that cross it are left out: they meet it in points.
    """
    fixed = [
        c
        for c in variable.coords.values()
        if c.ndim == 0 and c.name in ds.dims and f"curve_{c.name}" in ds
    ]
    if not fixed:
        return ds
    here = np.repeat(True, ds.sizes["curve_point"])
    for coordinate in fixed:
        here &= ds[f"curve_{coordinate.name}"].values == float(coordinate)
    curve = np.repeat(np.arange(ds.sizes["curve"]), ds.curve_count.values)
    unbroken = np.bincount(curve[~here], minlength=ds.sizes["curve"]) == 0
    return ds.isel(curve_point=unbroken[curve], curve=unbroken)


def curves_of(ds):
    """{class: slices of its curves in `curve_point`}, in the order in which they are drawn; raises
    Damaged.
    """
    schema.curves(ds)
    names = {code: name for name, code in flag_codes(ds.curve_class.attrs).items()}
    kinds = ds.curve_class.values
    ends = np.cumsum(ds.curve_count.values)
    found = {}
    for kind, last, number in zip(kinds, ends, ds.curve_count.values, strict=True):
        found.setdefault(names[kind], []).append(slice(int(last - number), int(last)))
    return {name: found[name] for name in CURVES if name in found}


def draw_edges(axes, ds, x):
    """Draw the boundaries on the axis `x`, where a survey has no other, as lines across the figure,
    with labels.
    """
    if "edge_count" not in ds or ds.edge_count.ndim or ds.attrs.get("boundaries") != x.name:
        return
    names = {code: name for name, code in flag_codes(ds.edge_class.attrs).items()}
    labelled = set()
    for position, code in zip(ds.edge_position.values, ds.edge_class.values, strict=True):
        name = names.get(int(code), "boundary")
        label, properties = CURVES.get(name, (spaced(name), _THIN))
        if "marker" in properties or properties is _THIN:  # lines that look alike bear their names
            axes.axvline(position, zorder=1, **_THIN)
            axes.annotate(f"{label} ", (position, 1.0), xycoords=axes.get_xaxis_transform(), rotation=90, fontsize=7,
                          ha="right", va="top")  # fmt: skip
            continue
        axes.axvline(position, zorder=1, label=None if label in labelled else label, **properties)
        labelled.add(label)


def draw_boundaries(axes, ds, x, y, gaps=None, on_cells=False):
    """Draw the boundaries over the map, points above lines; returns their legend handles.

    `gaps`: the colour between the dashes of edges of tongues, which are lines themselves where they
    are narrow. Dark lines have a white rim on cells, of which the undecided along them are black.
    """
    handles = {}
    for name, parts in curves_of(ds).items():
        label, properties = CURVES[name]
        if on_cells and properties.get("color") in _DARK and "marker" not in properties:
            rim = withStroke(linewidth=properties["lw"] + 1.0, foreground="#FFFFFF")
            properties = properties | {"path_effects": [rim]}
        zorder = 3 if "marker" in properties else 2
        if label is _EDGES and properties["ls"] != "-":
            properties = properties | {"gapcolor": gaps}
        for part in parts:
            points = (ds[f"curve_{axis.name}"].values[part] for axis in (x, y))
            axes.plot(*points, clip_on=zorder < 3, zorder=zorder, **properties)
        handles.setdefault(label, Line2D([], [], label=label, **properties))
    if "cell_verdict" not in ds:
        axes.set(xlim=widened(x.values)[[0, -1]], ylim=widened(y.values)[[0, -1]])
    return list(handles.values())
