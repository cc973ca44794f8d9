"""Where the verdict changes: edges, curves, surfaces or cells of the file, or neighbouring points,
as one table.
"""

import numpy as np
import xarray as xr

from survey import modules
from survey.analysis.areas import refuse_members, refuse_names
from survey.errors import BadInput
from survey.file import schema
from survey.file.labels import flag_codes
from survey.grid import positions


def find(ds, kind=None, index=None):
    """Positions on the boundary along the dimension `place` (see `ds.survey.boundary`)."""
    if "curve_count" in ds:
        found = _curves(ds)
    elif "surface_vertices" in ds:
        found = _surfaces(ds)
    elif "edge_count" in ds:
        found = _edges(ds)
    elif "cell_verdict" in ds:
        found = _undecided_cells(ds)
    else:
        refuse_members(ds, "boundary")
        refuse_names(ds, "boundary")
        found = _between_points(ds)
    for name, value in (("kind", kind), ("index", index)):
        if value is not None and name not in found:
            raise BadInput(
                f"boundary: this survey does not record the {name} of its boundaries; run its "
                "workflow with [boundaries]"
            )
    if kind is not None:
        classes = flag_codes(found.kind.attrs)
        if kind not in classes:
            raise BadInput(modules.unknown("kind", kind, list(classes)))
        found = found.isel(place=np.flatnonzero(found.kind.values == classes[kind]))
    return (
        found if index is None else found.isel(place=np.flatnonzero(found["index"].values == index))
    )


def _curves(ds):
    """Every point of every curve."""
    schema.curves(ds)
    number = ds.curve_count.values
    which = np.repeat(np.arange(number.size), number)
    along = [name for name, v in ds.data_vars.items() if v.dims == ("curve_point",)]
    found = {
        name.removeprefix("curve_"): ("place", ds[name].values, ds[name].attrs) for name in along
    }
    found["curve"] = ("place", which, {"long_name": "curve, counted from 0", "units": "1"})
    for name, source in (("kind", "curve_class"), ("index", "curve_index")):
        if source in ds:
            found[name] = ("place", ds[source].values[which], ds[source].attrs)
    return _table(ds, found, "curves from the file")


def _surfaces(ds):
    """Every vertex of every surface."""
    schema.surfaces(ds)
    number = ds.surface_vertices.values
    which = np.repeat(np.arange(number.size), number)
    along = [name for name, v in ds.data_vars.items() if v.dims == ("surface_vertex",)]
    found = {
        name.removeprefix("surface_"): ("place", ds[name].values, ds[name].attrs) for name in along
    }
    found["surface"] = ("place", which, {"long_name": "surface, counted from 0", "units": "1"})
    found["kind"] = ("place", ds.surface_class.values[which], ds.surface_class.attrs)
    return _table(ds, found, "vertices of surfaces from the file")


def _edges(ds):
    """Every edge of every row."""
    schema.edges(ds)
    count = ds.edge_count
    axis = ds.attrs.get("boundaries", ds.status.dims[-1])
    found = {}
    for dim, values in zip(
        count.dims, np.meshgrid(*(ds[dim].values for dim in count.dims), indexing="ij"), strict=True
    ):
        found[dim] = ("place", np.repeat(values.ravel(), count.values.ravel()), ds[dim].attrs)
    found[axis] = ("place", ds.edge_position.values, ds.edge_position.attrs)
    found["position_error"] = ("place", ds.edge_position_error.values, ds.edge_position_error.attrs)
    for name, source in (("kind", "edge_class"), ("index", "edge_index")):
        if source in ds:
            found[name] = ("place", ds[source].values, ds[source].attrs)
    return _table(ds, found, f"boundaries along {axis}, from the file")


def _undecided_cells(ds):
    """The centres of the cells that [refine] left undecided: every boundary lies in one of them."""
    schema.cells(ds)
    left = np.flatnonzero(ds.cell_verdict.values == flag_codes(ds.cell_verdict.attrs)["undecided"])
    found = {}
    for dim in ds.attrs["refine"].split(", "):
        low, high = (ds[f"cell_{dim}_{end}"].values[left] for end in ("low", "high"))
        label = {"long_name": f"error bound of {dim}: half the width of the cell"}
        found[dim] = ("place", 0.5 * (low + high), ds[dim].attrs)
        found[f"{dim}_error"] = ("place", 0.5 * (high - low), ds[dim].attrs | label)
    return _table(
        ds,
        found,
        "centres of the undecided cells, in which every boundary lies; not all of them contain one",
    )


def _between_points(ds):
    """Midpoints between neighbours of different verdict; the boundary between two lies within half
    their distance.
    """
    if "verdict" not in ds:
        raise BadInput(
            "this survey has no verdict, so it has no boundary; draw one of its outputs with map"
        )
    verdict = ds.verdict.values
    axes = ds.verdict.dims
    parts = [_along(ds, verdict, i) for i in range(len(axes)) if verdict.shape[i] > 1]
    if not parts:
        raise BadInput("a single point has no boundary; give the survey an axis")
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    found = {}
    for name, values in joined.items():
        dim = name.removesuffix("_error")
        attributes = ds[dim].attrs if dim in axes else ds.verdict.attrs
        labels = {
            dim: attributes.get("long_name", dim),
            f"{dim}_error": f"error bound of {dim}: half the distance between the two neighbours",
            "below": "verdict of the preceding neighbour on the axis",
            "above": "verdict of the following neighbour on the axis",
        }
        found[name] = ("place", values, attributes | {"long_name": labels[name]})
    return _table(ds, found, "midpoints between neighbouring points of different verdict; what lies between points of "
                             "one verdict is not seen")  # fmt: skip


def _along(ds, verdict, i):
    """The midpoints along one axis: {axis: value, axis_error: value, below, above}."""
    low, high = (np.moveaxis(verdict, i, 0)[cut] for cut in (slice(None, -1), slice(1, None)))
    indices = list(np.nonzero(low != high))
    found = {"below": low[tuple(indices)], "above": high[tuple(indices)]}
    indices.insert(i, indices.pop(0))
    for at, dim in enumerate(ds.verdict.dims):
        values = positions(ds[dim].values)
        here = values[indices[at]]
        after = values[indices[at] + 1] if at == i else here
        found[dim], found[f"{dim}_error"] = 0.5 * (here + after), 0.5 * abs(after - here)
    return found


def _table(ds, found, comment):
    return xr.Dataset(
        found,
        attrs={"title": ds.attrs.get("title", ""), "scene": ds.attrs["scene"], "comment": comment},
    )
