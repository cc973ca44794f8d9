"""The boundaries on a map: the edges of tongues, row by row and as curves, or curves found without
rows -> variables.

Contiguous ragged arrays (CF 9.3.3): `edge_count` edges of each row lie one after another along
`edge`, and `curve_count` points of each curve along `curve_point`.

A scene has boundaries where its family has a module `curves` (see QUESTIONS of `survey.measures`).
One that finds its curves without the map's rows has `closed` or `searched`; of the others `edges`
finds the edges of each row, `curves` follows them over the map, and `folds` finds where they turn
back.
"""

import heapq
from dataclasses import replace
from functools import partial
from itertools import pairwise, product
from math import prod
from types import SimpleNamespace

import numpy as np
import xarray as xr

from survey import measures
from survey.file.labels import FILL, flag_attributes, meaning
from survey.grid import Grid, logarithmic
from survey.measures.segments import UNKNOWN
from survey.measures.square import Square
from survey.measures.tasks import in_turn
from survey.scene import Request
from survey.sweep.line import OnLine, on_line, together

# of the time of a map, measured: of one axis, of which most are short or have few boundaries; and
# the exponent with which the time of a part of a map grows with the part
ALONE, ALONE_OWN, GROWTH = 1 / 28, 1 / 15, 0.7
PARTS = 10.0  # width of a domain of which a map is a part
ROWS = 128  # solved together
COLUMNS = 9  # searched for curves that meet no row
RTOL = 1e-13
MARGIN = 1e-3  # of an axis: how close curves come to an excluded value, such as k = 1


def find(workflow, each=in_turn, once=lambda name, make: make()):
    """The dataset of the workflow's curves; of its edges, and of their curves where there are two
    axes.

    `each`: see `survey.measures.tasks`; `once(name, make)` gives the arrays of `make()`, or those
    that an earlier run has kept under this name.
    """
    measure = measures.curves(workflow.scene)
    if hasattr(measure, "refusal"):
        about = _about(workflow)
        if len(workflow.grid.sizes) < 2:
            variables, complete = _on_a_line(workflow, measure)
            lost = {"edge_incomplete_rows": 1} if complete is False else {}
            return xr.Dataset(variables, attrs=about | lost)
        variables, unexplained = _closed(workflow, measure, each)
        return xr.Dataset(
            variables, attrs=about | ({"curves_unexplained": unexplained} if unexplained else {})
        )
    grid, axis = workflow.grid, workflow.boundaries
    along = {
        name: _edges(workflow, name, each, once)
        for name in dict.fromkeys([axis, *(rows for _, rows in workflow.planes)])
    }
    edges = along[axis]
    found = _rows(workflow, axis, [dim for dim in grid.sizes if dim != axis], edges)
    about = _about(workflow) | {"edge_incomplete_rows": int((edges.complete == 0).sum())}
    if workflow.planes:
        found |= _curves(workflow, along, each)
        about["curves_lost"] = int((found["curve_complete"][1] == 0).sum())
    left_out = [
        f"{name} from {a:.12g} to {b:.12g}"
        for name in dict.fromkeys(
            [axis, *(name for pair in workflow.planes for name in pair[::-1])]
        )
        for (_, a), (b, _) in pairwise(_parts(workflow, name))
    ]
    if left_out:
        about["edge_left_out"] = ", ".join(left_out)
    return xr.Dataset(found, attrs=about)


def _about(workflow):
    """The attributes that say along which axis, and in which planes where there are several."""
    about = {"boundaries": workflow.boundaries}
    if len(workflow.grid.sizes) > 2 and workflow.planes:
        about["boundary_planes"] = "; ".join(", ".join(pair) for pair in workflow.planes)
    return about


def along(scene, options, name, ends, fixed):
    """The OnLine between `ends` of the parameter `name`; `fixed`: all others."""
    others = Grid({}, {key: ((), np.float64(value)) for key, value in fixed.items()})
    found = on_rows(scene, options, name, ends, others)[1]
    return replace(found, complete=None if found.complete is None else bool(found.complete[0]))


def on_rows(scene, options, name, ends, others, each=in_turn):
    """The boundaries between `ends` of the parameter `name` on each row of the Grid of all `others`:
    (the row of each, in the grid's order; the OnLine of all, whose `complete` says it of each row).
    """
    rows = range(others.points)
    if not hasattr(measures.curves(scene), "refusal"):
        parameters = {name: ((name,), np.array(ends)), **others.parameters}
        grid = Grid({**others.sizes, name: 2}, parameters)
        line = SimpleNamespace(scene=scene, grid=grid, request=Request(options))
        edges = _edges(line, name, each)
        found = edges.position, edges.error, edges.kind, edges.complete.astype(bool), edges.index
        return edges.row, OnLine(*found)

    def task(row):
        values = _at(others.parameters, _indices(others, list(others.sizes), row))
        fixed = {key: float(value) for key, value in values.items()}
        return on_line(scene, options, name, ends, fixed)

    parts = each(task, rows, "rows")
    complete = [part.complete for part in parts]
    found = together(parts, None if None in complete else np.array(complete))
    return np.repeat(rows, [part.position.size for part in parts]), found


def plan(workflow, cost, threads):
    """({rows, bytes per edge, if known beforehand}, estimated seconds on so many threads).

    `cost` is the scene's estimate for a point, in seconds.
    """
    measure = measures.curves(workflow.scene)
    sizes = workflow.grid.sizes
    if hasattr(measure, "refusal"):
        size = 8 * (1 + len(sizes) + 2 * len(measure.ALONG))
        maps = [pair for pair, _ in _maps(workflow)] or [tuple(sizes)]  # or an axis alone
        busy = [0.0] * threads  # the curves of one map are found on one thread
        for pair in maps:
            longer = busy[0] + _seconds_of_map(workflow, measure, list(pair), cost)
            heapq.heapreplace(busy, longer)
        return {"bytes_per_curve_point": size}, max(busy)
    # measured: ten to twenty edges per row; about five hundred points of curves
    rows = {
        axis: prod(size for dim, size in sizes.items() if dim != axis)
        for axis in dict.fromkeys([workflow.boundaries, *(pair[1] for pair in workflow.planes)])
    }
    seconds = sum(rows.values()) * (2e-3 + 250 * cost)
    seconds += len(_maps(workflow)) * (0.2 + 1e4 * cost)
    return {
        "rows": sum(rows.values()),
        "bytes_per_edge": 25,
        "bytes_per_curve_point": 8 * (1 + len(sizes)) if workflow.planes else 0,
    }, seconds / threads


def _seconds_of_map(workflow, measure, axes, cost):
    """Estimated seconds on one thread of the curves on one map, or along one axis."""
    if hasattr(measure, "seconds"):
        return measure.seconds(axes)  # measured
    if hasattr(measure, "searched"):
        # measured: some ten points solved for each point of a curve, and a lattice
        seconds = getattr(workflow.scene, "curves_seconds", 1e5 * cost)
        own = hasattr(workflow.scene, "HASH")  # whose time is that of maps as users draw them
        seconds *= 1.0 if own else _part(workflow, axes) ** GROWTH
        return seconds * (1.0 if len(axes) > 1 else ALONE_OWN if own else ALONE)
    return 0.1


def _part(workflow, axes):
    """The part of the domain that a map spans: the geometric mean over its axes, 1 for an unbounded
    parameter.
    """
    widths = {p.name: p.maximum - p.minimum for p in workflow.scene.PARAMETERS}
    spans = {name: np.ptp(workflow.grid.parameters[name][1]) for name in axes}
    return prod(
        min(spans[name] / widths[name], 1.0) if widths[name] <= PARTS else 1.0 for name in axes
    ) ** (1.0 / len(axes))


def _measure(workflow, question):
    """The module of the scene's family that answers this question."""
    return measures.question(workflow.scene.FAMILY, question)


def _closed(workflow, measure, each):
    """The variables of curves found without rows, on one map, or on each map of the stacks along
    further axes; and along how many segments of lines across these a curve is missing.
    """
    names = list(workflow.grid.sizes)
    fixed = fixed_of(workflow)
    maps = _maps(workflow)
    squares = {pair: square_of(workflow, *pair) for pair in workflow.planes}
    task = (
        partial(measure.searched, workflow.scene)
        if hasattr(measure, "searched")
        else measure.closed
    )
    found = each(
        lambda one: task(squares[one[0]], list(one[0]), fixed | one[1], workflow.request.options),
        maps,
        "maps of the curves",
    )
    count, kind, error = (
        np.concatenate([getattr(curves, name) for curves in found])
        for name in ("count", "kind", "error")
    )
    values = np.concatenate(
        [
            _all_values(names, pair, curves.parameters, plane)
            for (pair, plane), curves in zip(maps, found, strict=True)
        ]
    )
    kind = flagged(measure.TITLE, measure.CLASSES, kind)
    variables = _of_curves(workflow, names, count, kind, values, error, "on the curve")
    if any(curves.index is not None for curves in found):
        numbers = [np.full(len(c.count), UNKNOWN) if c.index is None else c.index for c in found]
        variables["curve_index"] = ("curve", *numbered(np.concatenate(numbers), measure.NUMBER))
    for output in measure.ALONG:
        along, errors = (
            np.concatenate([curves.along[output.name][i] for curves in found]) for i in (0, 1)
        )
        about = meaning(output) | {"ancillary_variables": f"curve_{output.name}_error"}
        variables[f"curve_{output.name}"] = ("curve_point", along, about)
        variables[f"curve_{output.name}_error"] = ("curve_point", errors, {
            "long_name": f"error bound of curve_{output.name}", "units": output.units})  # fmt: skip
    return variables, sum(getattr(curves, "unexplained", None) or 0 for curves in found)


def _maps(workflow):
    """[(pair of axes, {name: value} of the others)] of all maps on which curves are found, the last
    of the other axes running fastest.
    """
    found = []
    for pair in workflow.planes:
        further = [name for name in workflow.grid.sizes if name not in pair]
        axes = [np.asarray(workflow.grid.parameters[name][1], float) for name in further]
        found += [
            (pair, dict(zip(further, map(float, values), strict=True))) for values in product(*axes)
        ]
    return found


def _all_values(names, pair, on_map, plane):
    """(m, names) of points whose parameters `pair` are `on_map` (m, 2), the others those of the plane."""
    columns = dict(zip(pair, np.asarray(on_map).T, strict=True))
    return np.column_stack(
        [columns[name] if name in columns else np.full(len(on_map), plane[name]) for name in names]
    )


def fixed_of(workflow):
    return {
        name: float(values) for name, (dims, values) in workflow.grid.parameters.items() if not dims
    }


def _on_a_line(workflow, measure):
    """The variables of the points at which an axis alone meets the curves; are these all?"""
    (axis,) = workflow.grid.sizes
    values = np.asarray(workflow.grid.parameters[axis][1])
    ends = float(values.min()), float(values.max())
    found = on_line(workflow.scene, workflow.request.options, axis, ends, fixed_of(workflow))
    parameter, named = parameter_of(workflow, axis)
    position = named | {"long_name": f"{parameter.long_name} at the boundary"}
    return {
        "edge_count": ((), np.int32(found.position.size), {
            "long_name": "number of boundaries", "units": "1", "sample_dimension": "edge"}),
        "edge_position": ("edge", found.position, position | {"ancillary_variables": "edge_position_error"}),
        "edge_position_error": ("edge", found.error, named | {"long_name": "error bound of edge_position"}),
        "edge_class": ("edge", *flagged(measure.TITLE, measure.CLASSES, found.kind)),
    }, found.complete  # fmt: skip


def _of_curves(workflow, names, count, kind, values, error, where):
    """The variables that all curves have; `values` (m, names): the parameters at their points."""
    variables = {
        "curve_count": ("curve", count.astype(np.int32), {
            "long_name": "number of points of the curve", "units": "1", "sample_dimension": "curve_point"}),
        "curve_class": ("curve", *kind),
        "curve_position_error": ("curve_point", error, {
            "long_name": "error bound of a point's distance from the curve", "units": "1",
            "comment": "along the normal, or along the map's border for points on it; unit: the range of each axis, "
                       "of its logarithm if the axis is logarithmic"}),
    }  # fmt: skip
    for i, name in enumerate(names):
        parameter, named = parameter_of(workflow, name)
        variables[f"curve_{name}"] = ("curve_point", values[:, i], named | {
            "long_name": f"{parameter.long_name} {where}", "ancillary_variables": "curve_position_error"})  # fmt: skip
    return variables


def _edges(workflow, axis, each=in_turn, once=lambda name, make: make()):
    """The Edges of all rows, found a few rows at a time."""
    measure = _measure(workflow, "edges")
    between = _parts(workflow, axis)
    rows = prod(size for dim, size in workflow.grid.sizes.items() if dim != axis)

    def make(some):
        solve = _row_solver(workflow, axis, some)
        own = measure.joined([measure.find(solve, some.size, *ends) for ends in between])
        own.row += some[0]
        return vars(own)

    def task(number):
        some = np.arange(number * ROWS, min((number + 1) * ROWS, rows))
        name = f"edges-{axis}-{some[0]}-{some.size}"
        return once(name, lambda: make(some))

    parts = [
        measure.Edges(**part) for part in each(task, range(-(-rows // ROWS)), "parts of the edges")
    ]
    names = ("row", "position", "error", "kind", "index", "complete")
    return measure.Edges(
        *(np.concatenate([getattr(part, name) for part in parts]) for name in names)
    )


def _row_solver(workflow, axis, rows):
    """What `edges.find` asks of the scene, for these rows."""
    grid = workflow.grid
    at = _indices(grid, [dim for dim in grid.sizes if dim != axis], rows)
    others = _at({name: grid.parameters[name] for name in grid.parameters if name != axis}, at)

    def solve(row, x, wanted):
        point = {
            name: values[row][:, None] if np.ndim(values) else values
            for name, values in others.items()
        }
        return _solve(workflow, point | {axis: x}, wanted)

    return solve


def _solve(workflow, point, wanted):
    with np.errstate(all="ignore"):
        return workflow.scene.solve(
            point, Request(workflow.request.options, "auto", RTOL, frozenset(wanted))
        )


def _rows(workflow, axis, other, edges):
    """The variables of the rows."""
    rows = edges.complete.size
    dims, shape = tuple(other), tuple(workflow.grid.sizes[dim] for dim in other)
    count = np.bincount(edges.row, minlength=rows).astype(np.int32).reshape(shape)
    parameter, named = parameter_of(workflow, axis)
    position = named | {"long_name": f"{parameter.long_name} at the edge of a tongue"}
    return {
        "edge_count": (dims, count, {
            "long_name": "number of edges of tongues", "units": "1", "sample_dimension": "edge"}),
        "edge_complete": (dims, edges.complete.astype(np.int8).reshape(shape),
                          _yes_or_no("are all edges of the row found", "not_shown complete")),
        "edge_position": ("edge", edges.position, position | {"ancillary_variables": "edge_position_error"}),
        "edge_position_error": ("edge", edges.error, named | {"long_name": "error bound of edge_position"}),
        "edge_class": ("edge", *_class(workflow, edges.kind)),
        "edge_index": ("edge", *numbered(edges.index)),
    }  # fmt: skip


def _curves(workflow, along, each):
    """The variables of the curves on each map of two axes (its rows are along the second), and of
    their folds; `along`: {axis: the Edges of all rows along it}.
    """
    grid = workflow.grid
    axis = workflow.boundaries
    maps = _maps(workflow)
    indices = {
        name: _indices(grid, [dim for dim in grid.sizes if dim != name], edges.row)
        for name, edges in along.items()
    }
    squares = {pair: square_of(workflow, *pair) for pair in workflow.planes}
    first = next((pair for pair in workflow.planes if pair[1] == axis), None)
    curve_of, curves_before = np.full(along[axis].row.size, -1), 0

    def on_map(one, each=in_turn):
        pair, plane = one
        edges = along[pair[1]]
        at = indices[pair[1]]
        own = np.ones(edges.row.size, bool)
        for dim, value in plane.items():
            own &= np.asarray(grid.parameters[dim][1])[at[dim]] == value
        of_rows = np.asarray(grid.parameters[pair[0]][1])[at[pair[0]][own]]
        seeds = np.stack([of_rows, edges.position[own]], axis=1), edges.kind[own], edges.index[own]
        return own, *_on_plane(workflow, squares[pair], *pair, seeds, plane, each)

    # progress is told of one map by its parts, of several by the maps
    solved = each(on_map, maps, "maps of the curves") if len(maps) > 1 else [on_map(maps[0], each)]
    found = []  # (pair, its plane, the curves, their folds, number of curves before these)
    for (pair, plane), (own, curves, folds) in zip(maps, solved, strict=True):
        found.append((pair, plane, curves, folds, curves_before))
        if pair == first:
            of_seed = curves.of_seed[: own.sum()]
            curve_of[own] = np.where(of_seed >= 0, of_seed + curves_before, of_seed)
        curves_before += curves.count.size

    def all_of(name):
        return np.concatenate([getattr(curves, name) for _, _, curves, _, _ in found])

    names = list(grid.sizes)
    if len(workflow.planes) == 1:
        names = [*workflow.planes[0], *(name for name in names if name not in workflow.planes[0])]
    on_curves = np.concatenate(
        [
            _all_values(names, pair, squares[pair].parameters(curves.x), plane)
            for pair, plane, curves, _, _ in found
        ]
    )
    kind = _class(workflow, all_of("kind"))
    where = "on the edge of a tongue"
    variables = _of_curves(
        workflow, names, all_of("count"), kind, on_curves, all_of("error"), where
    )
    seen = f", in the plane of {' and '.join(first)}" if first and len(workflow.planes) > 1 else ""
    variables |= {
        "edge_curve": ("edge", curve_of.astype(np.int32), {
            "long_name": f"curve through the edge{seen}, counted from 0", "units": "1"}),
        "curve_index": ("curve", *numbered(all_of("index"))),
        "curve_complete": ("curve", all_of("complete").astype(np.int8),
                           _yes_or_no("is the curve closed, or ended by the map or edge_left_out", "lost complete")),
    }  # fmt: skip
    return variables | _of_folds(workflow, names, squares, found)


def _indices(grid, dims, rows):
    """{name: indices} along these dimensions of the rows with these numbers."""
    shape = [grid.sizes[dim] for dim in dims]
    return dict(zip(dims, np.unravel_index(rows, shape) if dims else (), strict=True))


def _at(parameters, indices):
    """{name: its values} at these indices, {dimension: of each row}; a number where it has no dimension."""
    return {
        name: values[tuple(indices[dim] for dim in dims)] if dims else values
        for name, (dims, values) in parameters.items()
    }


def _on_plane(workflow, square, across, axis, of_rows, plane, each):
    """(the curves, their folds) on one map, in positions; `of_rows`: positions, kinds and indices
    of edges on rows.
    """
    fixed = {
        name: values for name, (dims, values) in workflow.grid.parameters.items() if not dims
    } | plane

    def solve(q, p, wanted):
        return _solve(workflow, fixed | {across: q, axis: p}, wanted)

    pieces = [_pieces(workflow, name) for name in (across, axis)]
    searched = _measure(workflow, "edges"), solve, square, _columns(pieces[1])
    found = [
        (square.positions(of_rows[0]), *of_rows[1:]),
        *(_of_columns(*searched, *piece) for piece in pieces[0]),
    ]
    measure = measures.curves(workflow.scene)
    seeds = measure.Seeds(
        *_with_rectangles(*(np.concatenate(v) for v in zip(*found, strict=True)), pieces)
    )
    curves = measure.trace(solve, square, seeds, each)
    return curves, _measure(workflow, "folds").find(solve, square, curves)


def _of_folds(workflow, names, squares, found):
    """The variables of the folds of all maps."""
    curve = np.concatenate([folds.curve + before for *_, folds, before in found])
    at_folds = np.concatenate(
        [
            _all_values(names, pair, squares[pair].parameters(folds.x), plane)
            for pair, plane, _, folds, _ in found
        ]
    )
    across = " or ".join(dict.fromkeys(pair[0] for pair in workflow.planes))
    variables = {"fold_curve": ("fold", curve.astype(np.int32), {
        "long_name": f"curve that turns back in {across}, counted from 0", "units": "1",
        "instance_dimension": "curve"})}  # fmt: skip
    spanning = {name for pair in workflow.planes for name in pair}
    for i, name in enumerate(names):
        parameter, named = parameter_of(workflow, name)
        if name not in spanning:
            about = named | {"long_name": parameter.long_name}
            variables[f"fold_{name}"] = ("fold", at_folds[:, i], about)
            continue
        variables[f"fold_{name}"] = ("fold", at_folds[:, i], named | {
            "long_name": f"{parameter.long_name} at the fold of an edge",
            "ancillary_variables": f"fold_{name}_error"})  # fmt: skip
        bars = []
        for pair, _, _, folds, _ in found:
            if name not in pair:
                bars.append(np.zeros(len(folds.curve)))
                continue
            k = pair.index(name)
            square = squares[pair]
            ends = square.parameters(np.stack([folds.x - folds.error, folds.x + folds.error]))[
                ..., k
            ]
            bars.append(abs(ends - square.parameters(folds.x)[..., k]).max(axis=0))
        variables[f"fold_{name}_error"] = ("fold", np.concatenate(bars), named | {
            "long_name": f"error bound of fold_{name}"})  # fmt: skip
    return variables


def square_of(workflow, *names):
    return square_over([np.asarray(workflow.grid.parameters[name][1]) for name in names])


def square_over(values):
    """The Square, or box, that axes with these values span."""
    low, high = (np.array([end(v) for v in values]) for end in (np.min, np.max))
    return Square(low, high, np.array([logarithmic(v) for v in values]))


def _pieces(workflow, name):
    """Parts (low, high) of an axis, in units of its range, between the values that the parameter
    excludes.

    Tongues accumulate at these singular values: the parts end half way to the map's nearest value,
    or MARGIN before.
    """
    line = square_of(workflow, name)
    excluded = np.array(next(p for p in workflow.scene.PARAMETERS if p.name == name).excluded)
    known = np.asarray(workflow.grid.parameters[name][1])
    inner = excluded[(excluded > line.low) & (excluded < line.high)]
    units = [line.positions(v[:, None])[:, 0] for v in (inner, known[~np.isin(known, excluded)])]
    apart = np.array(
        [max(4 * line.grain, min(MARGIN, 0.5 * abs(units[1] - cut).min())) for cut in units[0]]
    )
    return list(zip([0.0, *(units[0] + apart)], [*(units[0] - apart), 1.0], strict=True))


def _parts(workflow, name):
    """The same parts, in values of the parameter."""
    return (
        square_of(workflow, name)
        .parameters(np.array(_pieces(workflow, name))[..., None])[..., 0]
        .tolist()
    )


def _columns(pieces):
    """The columns that are searched: evenly over the axis, but not between its pieces."""
    columns = np.linspace(0, 1, COLUMNS)
    for (_, a), (b, _) in pairwise(pieces):
        columns[(columns > a) & (columns < b)] = a
    return columns


def _of_columns(measure, solve, square, columns, low, high):
    """(positions, kind, index) of the edges along the columns, from low to high in the square."""

    def along(column, x, wanted):
        here = square.parameters(
            np.stack(np.broadcast_arrays(x, columns[column][:, None]), axis=-1)
        )
        out = solve(here[..., 0].reshape(-1, 1), here[..., 1].reshape(-1, 1), wanted)
        return {name: values.reshape(x.shape) for name, values in out.items()}

    edges = measure.find(along, columns.size, low, high)
    return np.stack([edges.position, columns[edges.row]], axis=1), edges.kind, edges.index


def _with_rectangles(x, kind, index, pieces):
    """(x, kind, index, low, high): each position x with the ends of the rectangle of pieces that holds it."""
    low, high = np.zeros_like(x), np.ones_like(x)
    for dim, own in enumerate(pieces):
        lows, highs = np.array(own).T
        piece = np.clip(np.searchsorted(lows, x[:, dim], "right") - 1, 0, None)
        low[:, dim], high[:, dim] = lows[piece], highs[piece]
    return x, kind, index, low, high


def parameter_of(workflow, name):
    """A parameter, with the attributes of its values."""
    parameter = next(p for p in workflow.scene.PARAMETERS if p.name == name)
    return parameter, {"units": parameter.units, "symbol": parameter.symbol}


def _class(workflow, kind):
    return flagged(
        "kind of the periodic solution at the edge", _measure(workflow, "edges").CLASSES, kind
    )


def flagged(title, classes, kind):
    return kind.astype(np.int8), flag_attributes(classes) | {"long_name": title, "units": "1"}


def numbered(index, title=None):
    """Numbers of edges or curves and their attributes: of tongues, all known, or what `title` says, masked
    where they are UNKNOWN.
    """
    masked = {} if title is None else {FILL: np.int32(UNKNOWN)}
    title = title or "number of the tongue, twice its rotation number"
    return index.astype(np.int32), masked | {"long_name": title, "units": "1", "symbol": "n"}


def _yes_or_no(question, answers):
    return {
        "long_name": question,
        "units": "1",
        "flag_values": np.array([0, 1], np.int8),
        "flag_meanings": answers,
    }
