"""The area of each verdict in a map: from the cells of [refine] if there are any, else from its points."""

from itertools import product

import numpy as np
import xarray as xr

from survey import measures, status
from survey.errors import BadInput
from survey.file import schema
from survey.file.labels import flag_codes, percent, undecided_share
from survey.grid import positions
from survey.request import user_scene

NO_ANSWER = -2
SLAB = 2**20  # points read at once
COMMENT = ("the area between neighbouring points of one verdict is counted for that verdict; the error bar covers all "
           "area between neighbours that differ; anything between points of one verdict is not seen")  # fmt: skip


def of_map(ds):
    """Area and fraction of each verdict, with error bars, along `area_verdict` (see `ds.survey.areas`)."""
    if "area" in ds:
        return _of_cells(ds)
    if "verdict" not in ds:
        raise BadInput("this survey has no verdict, so there are no areas of it")
    refuse_members(ds, "areas")
    refuse_names(ds, "areas")
    if not ds.status.dims or min(ds.status.shape) < 2:
        raise BadInput("areas: every axis needs two values or more; remove the others with slice")
    for dim in ds.status.dims:
        if dim in ds.coords and ds[dim].dtype.kind in "iuf" and not _is_monotonic(ds[dim].values):
            raise BadInput(
                f"areas: the values of {dim} must increase, or decrease, without repetition; "
                "use ds.sortby"
            )
    codes = flag_codes(ds.verdict.attrs)
    codes["no_answer"] = NO_ANSWER
    area, least, most = _counted(ds, list(codes.values()))
    total = area.sum()
    kept = [i for i, name in enumerate(codes) if most[i] > 0 or name == "undecided"]
    bar = np.where(most > 0, np.maximum(most - area, area - least) + 1e-13 * total, 0.0)
    units = (
        " ".join(u for u in (ds[dim].attrs.get("units", "1") for dim in ds.status.dims) if u != "1")
        or "1"
    )
    found = _described([list(codes)[i] for i in kept], area[kept], bar[kept], total, units, COMMENT)
    found.attrs["areas"] += "; from points: features narrower than their spacing are not seen"
    if len(ds.status.dims) == 2 and _can_be_refined(ds):
        found.attrs["areas"] += " ([refine] bounds it)"
    return found


def refuse_members(ds, what, remedy="use counts()"):
    """Raise BadInput where points lie along a dimension that is not a parameter, such as that of an
    ensemble.
    """
    for dim in ds.status.dims:
        along = [name for name, c in ds.coords.items() if dim in c.dims]
        if dim not in ds.coords and along:
            raise BadInput(
                f"{what}: {dim} only counts points, of {', '.join(map(str, along))}: "
                f"they do not lie on a grid; {remedy}"
            )


def refuse_names(ds, what):
    """Raise BadInput where an axis is one of names, such as those of bodies."""
    for dim in ds.status.dims:
        if dim in ds.coords and ds[dim].dtype.kind in "UO":
            raise BadInput(
                f"{what}: {dim} is an axis of names, and nothing lies between them; choose one of them with "
                f"ds.sel({dim}=...), or use counts()"
            )


def _is_monotonic(values):
    steps = np.diff(values.astype(float))
    return bool((steps > 0).all() or (steps < 0).all())


def _can_be_refined(ds):
    """Does the scene's family support [refine]? That of a user's own scene does, which is known
    without running it.
    """
    if "scene_hash" in ds.attrs:
        return True
    try:
        scene = user_scene.find(user_scene.of_dataset(ds))[1]
    except BadInput:
        return False
    return measures.cells(scene) is not None


def _of_cells(ds):
    """The areas of decided cells; the rest is undecided and may belong to either verdict."""
    schema.areas(ds)
    names = list(flag_codes(ds.area_verdict.attrs))
    share = ds.area_fraction.values
    total = float(ds.area.values[share.argmax()] / share.max())
    bar = ds.area_error.values.astype(float)
    values, bars = [*ds.area.values, total * undecided_share(ds)], [*bar, 1e-13 * total]
    comment = (
        "from cells that are decided as a whole; the error bars are the area of the undecided cells"
    )
    units = ds.area.attrs.get("units", "1")
    return _described(
        [*names, "undecided"], np.array(values), np.array(bars), total, units, comment
    )


def _counted(ds, codes):
    """Area of each verdict code (each cell between neighbours is divided among its corners), and
    its least and most.
    """
    dims = ds.status.dims
    widths = [abs(np.diff(positions(ds[dim].values))) for dim in dims]
    rest = int(np.prod(ds.status.shape[1:]))
    step = max(1, SLAB // rest)
    area, least, most = np.zeros((3, len(codes)))
    for first in range(0, len(widths[0]), step):
        slab = {dims[0]: slice(first, first + step + 1)}
        verdict = ds.verdict.transpose(*dims).isel(slab).values
        state = ds.status.isel(slab).values
        verdict = np.where(
            np.isin(state, list(status.UNANSWERED)) | ((state != status.OK) & (verdict < 0)),
            NO_ANSWER,
            verdict,
        )
        cell = np.ones(())
        for width in [widths[0][first : first + step], *widths[1:]]:
            cell = cell[..., None] * width
        corners = [
            verdict[cut] for cut in product(*[(slice(None, -1), slice(1, None))] * len(dims))
        ]
        for i, code in enumerate(codes):
            number = sum((corner == code).astype(np.int8) for corner in corners)
            area[i] += (cell * number).sum() / len(corners)
            least[i] += cell[number == len(corners)].sum()
            most[i] += cell[number > 0].sum()
    return area, least, most


def _described(names, area, bar, total, units, comment):
    line = ", ".join(
        f"{n}: {percent(a / total, b / total)}" for n, a, b in zip(names, area, bar, strict=True)
    )
    found = {}
    for name, scale, unit, long_name in (
        ("area", 1.0, units, "area of the map with this verdict"),
        ("area_fraction", total, "1", "fraction of the map's area with this verdict"),
    ):
        found[name] = ("area_verdict", area / scale, {"long_name": long_name, "units": unit})
        found[f"{name}_error"] = (
            "area_verdict",
            bar / scale,
            {"long_name": f"error bound of {name}", "units": unit},
        )
    return xr.Dataset(found, {"area_verdict": names}, {"comment": comment, "areas": line})
