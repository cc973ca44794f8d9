"""The surfaces of [boundaries] of a survey of three parameters: in perspective, and where they meet
a plane.
"""

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from survey.errors import BadInput
from survey.file import schema
from survey.file.labels import flag_codes
from survey.grid import logarithmic
from survey.show.boundaries import CURVES
from survey.show.layout import add_legend
from survey.show.text import formula, label_of, spaced

NAME = "surfaces"  # of the figure
# light enough to be shaded, and apart for the colour-blind (Okabe and Ito)
COLOURS = {
    "plus_one": "#56B4E9", "minus_one": "#E69F00", "neimark_sacker": "#D9598C", "collision": "#3FB58F",
    "even_periodic": "#56B4E9", "odd_periodic": "#3FB58F", "even_antiperiodic": "#E69F00",
    "odd_antiperiodic": "#D9598C",
}  # fmt: skip
OTHERS = ("#F0E442", "#999999", "#8DA0CB", "#B3DE69")
NARROW = 5.0  # inches: of a figure in which names of axes do not fit
VIEW = {"elev": 24.0, "azim": -58.0}
LIGHT = np.array([0.76, -0.42, 0.5])  # of length 1, nearly: from the right of the viewer


def draw_surfaces(axes, ds):
    """Draw the surfaces onto three-dimensional axes, those alone that may bound stability where
    there are any.

    Raises BadInput where the file has none, or the axes are flat.
    """
    if "surface_vertices" not in ds:
        raise BadInput(
            f"{NAME}: the file contains none; run the workflow with surfaces = true under [boundaries]"
        )
    flat = [dim for dim in ds.status.dims if ds.sizes[dim] < 2]
    if flat:
        raise BadInput(
            f"{NAME}: {flat[0]} has one value here; they are drawn in all three axes, so leave --at out"
        )
    if axes.name != "3d":
        raise BadInput(
            f"{NAME}: they are drawn onto axes made with projection='3d'; leave ax out for new ones"
        )
    schema.surfaces(ds)
    dims = list(ds.status.dims)
    logs = [logarithmic(ds[dim].values) for dim in dims]
    vertices = np.stack(
        [_scaled(ds[f"surface_{dim}"].values, log) for dim, log in zip(dims, logs, strict=True)],
        axis=1,
    )
    ends = np.array([_scaled(np.sort(ds[dim].values.astype(float))[[0, -1]], log)
                     for dim, log in zip(dims, logs, strict=True)])  # fmt: skip
    corners = ds.surface_corners.values
    kinds = _kinds(ds)
    shown = _bounds_stability(ds)
    shown = shown if shown.any() else ~shown
    corners, kinds = corners[shown], kinds[shown]
    names = {code: name for name, code in flag_codes(ds.surface_class.attrs).items()}
    colours = _colours(names)
    faces = np.array([colours[code] for code in kinds]).reshape(-1, 3)
    faces *= _shade((vertices[corners] - ends[:, 0]) / (ends[:, 1] - ends[:, 0]))[:, None]
    # edges of the faces' colours: else the background shows between them
    drawn = Poly3DCollection(
        vertices[corners], facecolors=faces, edgecolors=faces, linewidths=0.2, zsort="average"
    )
    drawn.set_rasterized(True)
    axes.add_collection(drawn, autolim=False)  # that of 3d takes no autolim before Matplotlib 3.10
    axes.set(xlim=ends[0], ylim=ends[1], zlim=ends[2])
    axes.view_init(**VIEW)
    axes.set_box_aspect((1.0, 1.0, 0.8))
    narrow = axes.figure.get_figwidth() < NARROW
    for axis, dim, log in zip((axes.xaxis, axes.yaxis, axes.zaxis), dims, logs, strict=True):
        axis.set_major_locator(
            MaxNLocator(5, integer=log and np.ptp(_scaled(ds[dim].values, log)) > 2)
        )
        text = label_of(ds[dim], 44 if axis is axes.zaxis else 26)  # the vertical one has more room
        axis.set_label_text(formula(ds[dim].attrs.get("symbol", ""), dim) if narrow else text)
        axis.pane.set_facecolor("#F7F7F7")
        axis.labelpad = -4.0 if narrow else 8.0
        axis.set_tick_params(pad=-2.0 if narrow else 3.0)
        if log:
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{10.0**value:.3g}"))
    handles = [
        Patch(color=colours[code], label=_label(name))
        for code, name in names.items()
        if (kinds == code).any()
    ]
    if handles:
        add_legend(axes, handles)
    if not len(corners):
        axes.text2D(
            0.5, 0.5, "there are no surfaces in this box", transform=axes.transAxes, ha="center"
        )


def section(ds, variable):
    """The survey with curves: where the surfaces meet the plane of a map, between vertices along
    triangles.
    """
    schema.surfaces(ds)
    dims = ds.status.dims
    fixed = [c for c in variable.coords.values() if c.ndim == 0 and c.name in dims]
    values, plane = ds[f"surface_{fixed[0].name}"].values, float(fixed[0])
    # of a triangle that touches the plane with an edge, as on the border of the box, this edge is
    # drawn
    lower = plane < 0.5 * (values.min(initial=plane) + values.max(initial=plane))
    above = values > plane if lower else values >= plane
    corners, kinds = ds.surface_corners.values, _kinds(ds)
    met = above[corners].any(axis=1) & ~above[corners].all(axis=1)
    corners, kinds = corners[met], kinds[met]
    sides = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
    sides = sides[above[sides[..., 0]] != above[sides[..., 1]]]  # two of each triangle's
    sides, ends = np.unique(sides, axis=0, return_inverse=True)
    chains = _chains(ends.reshape(-1, 2).tolist())
    low, high = values[sides].T
    with np.errstate(all="ignore"):
        part = np.clip((plane - low) / (high - low), 0.0, 1.0)
    order = np.concatenate([np.zeros(0, int), *(vertices for _, vertices in chains)]).astype(int)
    first = np.array([triangle for triangle, _ in chains], int)
    points = {}
    for dim in dims:
        low, high = ds[f"surface_{dim}"].values[sides].T
        points[f"curve_{dim}"] = ("curve_point", ((1 - part) * low + part * high)[order])
    points["curve_count"] = ("curve", np.array([len(vertices) for _, vertices in chains], np.int32))
    points["curve_class"] = ("curve", kinds[first].astype(np.int8), ds.surface_class.attrs)
    return ds.assign(points)


def _chains(links):
    """[(number of a link, nodes)] of the chains, open or closed, into which links between two nodes join."""
    at = {}
    for number, pair in enumerate(links):
        for node in pair:
            at.setdefault(node, []).append(number)
    left = set(range(len(links)))
    found = []
    for number in range(len(links)):
        if number not in left:
            continue
        left.discard(number)
        nodes = list(links[number])
        for _ in range(2):  # on from its last node, then from its first one
            while following := next((link for link in at[nodes[-1]] if link in left), None):
                left.discard(following)
                one, other = links[following]
                nodes.append(other if one == nodes[-1] else one)
            nodes.reverse()
        found.append((number, nodes))
    return found


def _kinds(ds):
    """The code of the class of each triangle."""
    return np.repeat(ds.surface_class.values, ds.surface_triangles.values)


def _bounds_stability(ds):
    """Which triangles may bound stability: not those at all of whose corners another multiplier is
    outside.
    """
    if "surface_outside" not in ds or ds.surface_outside.dims != ("surface_vertex",):
        return np.ones(ds.sizes["surface_triangle"], bool)
    return ~(ds.surface_outside.values[ds.surface_corners.values] > 0).all(axis=1)


def _colours(names):
    """{code: colour (3)}."""
    others = (name for name in names.values() if name not in COLOURS)
    more = {name: OTHERS[i % len(OTHERS)] for i, name in enumerate(others)}
    return {code: np.array(to_rgb((COLOURS | more)[name])) for code, name in names.items()}


def _label(name):
    return CURVES[name][0] if name in CURVES and not name.endswith("periodic") else spaced(name)


def _shade(triangles):
    """The brightness of triangles (t, 3, 3) in the unit box, lit from either side."""
    with np.errstate(all="ignore"):
        normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return 0.6 + 0.4 * np.nan_to_num(abs(normal @ LIGHT), nan=1.0)


def _scaled(values, log):
    return np.log10(values) if log else values.astype(float)
