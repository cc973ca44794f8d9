"""The edges of the tongues along one axis, for every place on the other: arrays -> variables of the dataset.

Contiguous ragged arrays (CF 9.3.3): `edge_count` edges of each row lie one after another along `edge`.
"""

import numpy as np
import xarray as xr

from survey.measures import hill_edges
from survey.scene import Request

ROWS = 8  # solved together
RTOL = 1e-13


def find(workflow):
    """The dataset of the workflow's edges: positions with their errors, class, index, and which rows are complete."""
    grid, axis = workflow.grid, workflow.boundaries
    other = [dim for dim in grid.sizes if dim != axis]
    rows = grid.sizes[other[0]] if other else 1
    ends = np.asarray(grid.parameters[axis][1])[[0, -1]]
    parts = []
    for first in range(0, rows, ROWS):
        some = np.arange(first, min(first + ROWS, rows))
        parts.append(hill_edges.find(_solver(workflow, axis, some), some.size, *sorted(ends)))
    count = np.concatenate([np.bincount(p.row, minlength=p.complete.size) for p in parts]).astype(np.int32)
    complete = np.concatenate([part.complete for part in parts]).astype(np.int8)
    whole = {name: np.concatenate([getattr(p, name) for p in parts]) for name in ("position", "error", "kind", "index")}
    parameter = next(p for p in workflow.scene.PARAMETERS if p.name == axis)
    named = {"units": parameter.units, "symbol": parameter.symbol}
    codes = np.array(list(hill_edges.CLASSES.values()), np.int8)
    flags = {"flag_values": codes, "flag_meanings": " ".join(hill_edges.CLASSES)}
    position = named | {"long_name": f"{parameter.long_name} at the edge of a tongue"}
    dims, shape = (tuple(other), (rows,)) if other else ((), ())
    return xr.Dataset(
        {
            "edge_count": (dims, count.reshape(shape), {
                "long_name": "number of edges of tongues", "units": "1", "sample_dimension": "edge"}),
            "edge_complete": (dims, complete.reshape(shape), {
                "long_name": "are all edges of the row found", "units": "1",
                "flag_values": np.array([0, 1], np.int8), "flag_meanings": "not_shown complete"}),
            "edge_position": ("edge", whole["position"], position | {"ancillary_variables": "edge_position_error"}),
            "edge_position_error": ("edge", whole["error"], named | {"long_name": "error bound of edge_position"}),
            "edge_class": ("edge", whole["kind"].astype(np.int8), flags | {
                "long_name": "kind of the periodic solution at the edge", "units": "1"}),
            "edge_index": ("edge", whole["index"].astype(np.int32), {
                "long_name": "number of the tongue, twice its rotation number", "units": "1", "symbol": "n"}),
        },
        attrs={"boundaries": axis},
    )  # fmt: skip


def _solver(workflow, axis, rows):
    """What `hill_edges.find` asks of the scene, for these rows."""
    others = {name: values for name, (_, values) in workflow.grid.parameters.items() if name != axis}

    def solve(row, x, wanted):
        request = Request(workflow.request.options, "auto", RTOL, frozenset(wanted))
        point = {name: values[rows[row]][:, None] if np.ndim(values) else values for name, values in others.items()}
        with np.errstate(all="ignore"):
            return workflow.scene.solve(point | {axis: x}, request)

    return solve
