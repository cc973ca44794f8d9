"""The surfaces of a survey of three parameters that [boundaries] with `surfaces = true` asks for ->
variables.

Contiguous ragged arrays: `surface_vertices` vertices of each connected piece lie one after another
along `surface_vertex`, and `surface_triangles` triangles along `surface_triangle`, whose
`surface_corners` are numbers of vertices.
"""

import numpy as np
import xarray as xr

from survey import measures
from survey.file.labels import meaning
from survey.measures.tasks import in_turn
from survey.sweep import boundaries

VERTICES = 3e4  # of the surfaces of a box, roughly
EVALUATIONS = 20  # that sharpen a vertex
BYTES_PER_TRIANGLE = 12


def find(workflow, each=in_turn, once=lambda name, make: make()):
    """The dataset of the surfaces; `each` and `once` as in `survey.sweep.boundaries.find`."""
    # it imports much of SciPy, which other runs need not wait for
    from survey.measures import isosurfaces

    measure = measures.question(workflow.scene.FAMILY, "surfaces")
    names = list(workflow.grid.sizes)
    box = boundaries.square_of(workflow, *workflow.grid.sizes)
    functions = measure.Functions(
        workflow.scene, box, names, boundaries.fixed_of(workflow), workflow.request.options
    )
    found = isosurfaces.find(
        functions, box.grain, [output.name for output in measure.ALONG], each, once
    )
    about = {"surfaces": ", ".join(names), "surfaces_left_out": found.left_out}
    if found.unexplained:
        about["surfaces_unexplained"] = found.unexplained
    return xr.Dataset(
        _variables(workflow, measure, names, box.parameters(found.x), found), attrs=about
    )


def plan(workflow, cost, threads):
    """({what is known beforehand: bytes}, estimated seconds on so many threads), as in
    `survey.sweep.boundaries.plan`.
    """
    from survey.measures import isosurfaces

    measure = measures.question(workflow.scene.FAMILY, "surfaces")
    lines, numbers = isosurfaces.LINES, 3 + 1 + 2 * len(measure.ALONG)
    known = {"lattice": f"{lines} x {lines} x {lines}", "bytes_per_vertex": 8 * numbers + 1,
             "bytes_per_triangle": BYTES_PER_TRIANGLE}  # fmt: skip
    return known, (lines**3 + EVALUATIONS * VERTICES) * cost / threads


def _variables(workflow, measure, names, values, found):
    """The variables of the file; `values` (m, names) are the parameters at the vertices."""
    variables = {
        "surface_vertices": ("surface", found.vertices.astype(np.int32), {
            "long_name": "number of vertices of the surface", "units": "1", "sample_dimension": "surface_vertex"}),
        "surface_triangles": ("surface", found.triangles.astype(np.int32), {
            "long_name": "number of triangles of the surface", "units": "1", "sample_dimension": "surface_triangle"}),
        "surface_class": ("surface", *boundaries.flagged(measure.TITLE, measure.CLASSES, found.kind)),
        "surface_corners": (("surface_triangle", "corner"), found.corners.astype(np.int32), {
            "long_name": "vertices at the corners of the triangle, counted from 0 over all surfaces", "units": "1",
            "start_index": np.int32(0),
            "comment": "vertices are on the surface within their error bounds, triangles are flat"}),
        "surface_position_error": ("surface_vertex", found.error, {
            "long_name": "error bound of a vertex's distance from the surface", "units": "1",
            "comment": "along the axis surface_axis; unit: the range of this axis, of its logarithm if it is "
                       "logarithmic"}),
        "surface_axis": ("surface_vertex", *boundaries.flagged(
            "axis along which the surface lies within the error bound of the vertex",
            {name: k for k, name in enumerate(names)}, found.axis)),
    }  # fmt: skip
    for k, name in enumerate(names):
        parameter, named = boundaries.parameter_of(workflow, name)
        about = named | {"long_name": f"{parameter.long_name} at the vertex"}
        about |= {"ancillary_variables": "surface_position_error"}
        variables[f"surface_{name}"] = ("surface_vertex", values[:, k], about)
    for output in measure.ALONG:
        along, errors = found.along[output.name]
        about = meaning(output) | {"ancillary_variables": f"surface_{output.name}_error"}
        variables[f"surface_{output.name}"] = ("surface_vertex", along, about)
        variables[f"surface_{output.name}_error"] = ("surface_vertex", errors, {
            "long_name": f"error bound of surface_{output.name}", "units": output.units})  # fmt: skip
    return variables
