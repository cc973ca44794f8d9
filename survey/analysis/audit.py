"""The spot audit of `survey verify`: random points solved again by the scene's independent methods
(its AUDIT).

What is the same for all methods is evaluated again by the same formula: K, L and the equilibria of
a gyrostat's portrait, the turning points of nutations, the frequencies and resonances at L4, exact
rules for marginal points.
"""

from functools import partial

import numpy as np
import xarray as xr
from scipy.optimize import linear_sum_assignment

from survey import measures, status
from survey.analysis.given import options_at
from survey.api import evaluate
from survey.errors import Damaged
from survey.file import schema
from survey.file.labels import as_stored, outputs_of
from survey.measures.hill.edges import FACTORS
from survey.request import user_scene
from survey.request.checks import methods_of
from survey.scene import Request, existing_outputs
from survey.sweep import boundaries


def audit(ds, points, seed=0):
    """Solve random points of `ds` again by other methods at higher accuracy; floats, codes and
    counts must agree.

    So must random edges and vertices of surfaces, and cells at random positions. Returns {"points":
    number that some method answered, "silent": number that none did, "edges", "cells", "vertices":
    numbers checked, "method", "complaints"}.
    """
    report = {
        "points": 0,
        "silent": 0,
        "edges": 0,
        "cells": 0,
        "vertices": 0,
        "method": "",
        "complaints": [],
    }
    if not points:
        return report
    name = user_scene.of_dataset(ds)
    _, module = user_scene.find(name)
    options = options_at(ds, module)
    others = [m for m in methods_of(module, options) if m != ds.attrs["method"]]
    used = [m for m in module.AUDIT if m in others] or others[:1]
    report["method"] = " and ".join(used)
    random = np.random.default_rng(seed)
    flat, given = _chosen(ds, module, points, random)
    arrays = {key: xr.DataArray(values, dims="_point") for key, values in given.items()}
    outputs = outputs_of(module, Request(options, variables=frozenset(flat.data_vars)))
    outputs, report["complaints"] = _stored_as_declared(flat, outputs, module)
    answered = np.zeros(flat.status.size, bool)
    decided = any(o.name == "verdict" for o in existing_outputs(module, options))
    rtol = max(ds.attrs["rtol"] / 100, 1e-13)
    wanted = [o.name for o in outputs]
    for method in used:
        solved = evaluate(name, method=method, rtol=rtol, variables=wanted, **options, **arrays)
        solved = _in_order(flat, solved.transpose("_point", ...), wanted)
        answered |= (solved.status == status.OK).values | (solved.status == flat.status).values
        for output, wrong, describe in _differences(flat, solved, outputs, decided):
            for i in np.flatnonzero(wrong.reshape(len(wrong), -1).any(axis=1)):
                report["complaints"].append(
                    f"{output} at {_position(given, i)}: {describe(i)}, by {method}"
                )
    vertices = partial(_vertices, module, options, used[:1], rtol)
    # whose edges are zeros of those of Hill's question
    with_factors = not hasattr(measures.curves(module), "refusal")
    for what, dim, check in (("edges", "edge", _edges), ("cells", "cell", _cells),
                             ("vertices", "surface_vertex", vertices)):  # fmt: skip
        if ds.sizes.get(dim) and used and (what != "edges" or with_factors):
            chosen = np.sort(
                random.choice(ds.sizes[dim], min(points, ds.sizes[dim]), replace=False)
            )
            solve = partial(_solve, name, used[0], options, rtol, ds, module)
            report["complaints"] += [
                f"{line}, by {used[0]}" for line in check(ds, chosen, solve, random)
            ]
            report[what] = chosen.size
    return report | {"points": int(answered.sum()), "silent": int((~answered).sum())}


def _stored_as_declared(flat, outputs, module):
    """(outputs that are stored as the scene declares them, complaints about the others)."""
    sizes = {o.name: tuple(len(module.DIMENSIONS[dim]) for dim in o.dims) for o in outputs}
    good = [
        o
        for o in outputs
        if as_stored(flat[o.name]).dtype.kind == o.dtype.kind
        and flat[o.name].dims == ("_point", *o.dims)
        and flat[o.name].shape[1:] == sizes[o.name]
        and (o.dtype.kind != "f" or f"{o.name}_error" in flat)
    ]
    return good, [f"{o.name}: it is not stored as the scene {flat.attrs['scene']} declares it" for o in outputs
                  if o not in good]  # fmt: skip


def _position(given, i):
    return ", ".join(f"{key} = {values[i].item()!r}" for key, values in given.items())


def _solve(name, method, options, rtol, ds, module, variables, positions):
    """The variables at positions {axis: values (n)}, other parameters as in `ds`; arrays (n)."""
    fixed = {
        p.name: float(ds[p.name])
        for p in module.PARAMETERS
        if p.name in ds.coords and not ds[p.name].dims
    }
    arrays = {key: xr.DataArray(values, dims="_point") for key, values in positions.items()}
    return evaluate(
        name, method=method, rtol=rtol, variables=variables, **options, **(fixed | arrays)
    )


def _edges(ds, chosen, solve, _):
    """Complaints about edges where the factor of their class certainly has the same sign on both sides."""
    schema.edges(ds)
    if not np.isin(ds.edge_class.values, range(len(FACTORS))).all():
        raise Damaged("edge_class contains codes that belong to no factor at T/2")
    axis, count = ds.attrs["boundaries"], ds.edge_count.values
    rows = np.repeat(np.arange(count.size), count.ravel())[chosen]
    indices_of = zip(
        ds.edge_count.dims, np.unravel_index(rows, count.shape) if count.ndim else (), strict=True
    )
    point = {dim: ds[dim].values[at_point] for dim, at_point in indices_of}
    x, width = ds.edge_position.values[chosen], ds.edge_position_error.values[chosen]
    of = np.array(FACTORS)[ds.edge_class.values[chosen]]
    signs = []
    for side in (x - width, x + width):
        out = solve(list(FACTORS), point | {axis: side})
        values, bars = (
            np.array([float(out[f"{f}{end}"][i]) for i, f in enumerate(of)])
            for end in ("", "_error")
        )
        signs.append(np.where(abs(values) > bars, np.sign(values), 0.0))
    for i in np.flatnonzero(signs[0] * signs[1] > 0):
        yield f"edge_position at {_position(point | {axis: x}, i)}: {of[i]} has no zero within its error bar"


def _vertices(module, options, methods, rtol, ds, chosen, _solve, _random):
    """Complaints about vertices of surfaces where the function of their class certainly has the
    same sign on both sides."""
    schema.surfaces(ds)
    measure = measures.question(module.FAMILY, "surfaces")
    names = list(ds.status.dims)
    if (
        measure is None
        or not np.isin(ds.surface_class.values, list(measure.CLASSES.values())).all()
    ):
        raise Damaged(
            f"surface_class contains codes that are not boundaries of {ds.attrs['scene']}"
        )
    box = boundaries.square_over([ds[name].values for name in names])
    fixed = {
        p.name: float(ds[p.name])
        for p in module.PARAMETERS
        if p.name in ds.coords and not ds[p.name].dims
    }
    functions = measure.Functions(module, box, names, fixed, options, *methods, rtol)
    numbers = np.searchsorted(np.cumsum(ds.surface_vertices.values), chosen, side="right")
    kinds = ds.surface_class.values[numbers]
    axis = ds.surface_axis.values[chosen].astype(int)
    point = {name: ds[f"surface_{name}"].values[chosen] for name in names}
    middle = box.positions(np.stack([*point.values()], axis=1))
    off = np.zeros_like(middle)
    off[np.arange(chosen.size), axis] = ds.surface_position_error.values[chosen]
    words = {code: word for word, code in measure.CLASSES.items()}
    for kind in np.unique(kinds):
        own = np.flatnonzero(kinds == kind)
        signs = []
        for side in (-1.0, 1.0):
            values, bars = functions.sharp(middle[own] + side * off[own], int(kind))
            signs.append(np.where(abs(values) > bars, np.sign(values), 0.0))
        for i in own[signs[0] * signs[1] > 0]:
            yield f"surface_position_error at {_position(point, i)}: no {words[kind]} within it"


def _cells(ds, chosen, solve, random):
    """Complaints about decided cells that contain a point of the other verdict."""
    schema.cells(ds)
    names = ds.attrs["refine"].split(", ")
    part = random.uniform(0.0, 1.0, (2, chosen.size))
    ends = [[ds[f"cell_{name}_{end}"].values[chosen] for end in ("low", "high")] for name in names]
    point = {
        name: low + (high - low) * p for name, (low, high), p in zip(names, ends, part, strict=True)
    }
    verdict, other = ds.cell_verdict.values[chosen], solve(["verdict"], point).verdict.values
    for i in np.flatnonzero((verdict != -1) & np.isin(other, (0, 1)) & (verdict != other)):
        yield f"cell_verdict at {_position(point, i)}: {verdict[i]}, not {other[i]}"


def _chosen(ds, module, points, random):
    """Random points of `ds` along the dimension `_point`, in memory, and their parameters {name: array}."""
    ds = ds if ds.status.dims else ds.expand_dims("_one")
    size = min(points, ds.status.size)
    chosen = np.sort(random.choice(ds.status.size, size, replace=False, shuffle=False))
    indices = np.unravel_index(chosen, ds.status.shape)
    ds = ds[[name for name in ds.data_vars if set(ds.status.dims) <= set(ds[name].dims)]]
    flat = ds.isel(
        {dim: ("_point", index) for dim, index in zip(ds.status.dims, indices, strict=True)}
    ).load()
    names = [p.name for p in module.PARAMETERS if p.name in ds.coords]
    given = {key: np.broadcast_to(flat[key].values, size).copy() for key in names}
    return flat.transpose("_point", ...), given


def _in_order(flat, solved, names):
    """`solved` with its multipliers, if they are among the outputs `names`, in the order of those of `flat`: which of
    two moduli is larger may be beyond the bars of one answer, and within those of the other.
    """
    parts = [f"multiplier_{part}" for part in ("re", "im")]
    if not set(parts) <= set(names):
        return solved
    apart = False
    for name in parts:
        (one, bar), (other, other_bar) = (
            (ds[name].values, ds[f"{name}_error"].values.astype(float)) for ds in (flat, solved)
        )
        with np.errstate(invalid="ignore"):
            apart |= ~(
                abs(one[:, :, None] - other[:, None, :]) <= bar[:, :, None] + other_bar[:, None, :]
            )
    order = np.tile(np.arange(apart.shape[1]), (len(apart), 1))
    for i in np.flatnonzero(np.diagonal(apart, axis1=1, axis2=2).any(axis=1)):
        order[i] = linear_sum_assignment(apart[i])[1]  # as few of them apart as possible
    ordered = {
        name: v.copy(data=np.take_along_axis(v.values, order, axis=1))
        for name, v in solved.data_vars.items()
        if v.dims == ("_point", "multiplier")
    }
    return solved.assign(ordered)


def _differences(flat, solved, outputs, decided):
    """Yield (output, where it is wrong: (points, ...), description of point i) for everything in
    both answers.

    `decided`: the scene gives verdicts. Counts, and what applies, must agree where both give the
    same verdict.
    """
    invalid = (flat.status == status.INVALID_PARAMETERS).values != (
        solved.status == status.INVALID_PARAMETERS
    ).values
    yield "status", invalid, lambda i: "the parameters are invalid in one answer only"
    both = (flat.status == solved.status).values
    same = both & (_same_verdict(flat, solved) if "verdict" in flat else not decided)
    for o in outputs:
        one, other = as_stored(flat[o.name]), as_stored(solved[o.name])
        wide = (slice(None),) + (None,) * (one.ndim - 1)
        if o.dtype.kind == "f":
            bar = flat[f"{o.name}_error"].values.astype(float) + solved[f"{o.name}_error"].values
            off = abs(one - other)
            yield (
                o.name,
                off > bar,
                lambda i, off=off, bar=bar: (
                    f"off by {np.nanmax(off[i]):.3g}, error bars {np.nanmax(bar[i]):.3g}"
                ),
            )
            yield (
                o.name,
                (np.isnan(one) != np.isnan(other)) & same[wide],
                lambda i: "only one answer gives a value",
            )
            continue
        unknown = o.flags.get("undecided") if o.flags is not None else o.fill
        sure = both if o.name == "verdict" else same
        wrong = (one != other) & (one != unknown) & (other != unknown) & sure[wide]
        yield o.name, wrong, lambda i, one=one, other=other: f"{one[i]}, not {other[i]}"


def _same_verdict(flat, solved):
    """Where both verdicts are the same, and decided if the status is ok."""
    return (
        (flat.verdict == solved.verdict) & ((flat.verdict != -1) | (flat.status != status.OK))
    ).values
