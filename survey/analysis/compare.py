"""Two surveys at their common points: where verdicts differ, and differences relative to the sum of
the error bars.
"""

import numpy as np
import xarray as xr

from survey.analysis.point import of_points
from survey.errors import BadInput
from survey.file.labels import error_bars, flag_attributes
from survey.wording import counted

VERDICTS = {"same": 0, "one_undecided": 1, "differ": 2}


def find(one, other):
    """The Dataset that `ds.survey.compare` describes; raises BadInput if they have nothing in common."""
    if not isinstance(other, xr.Dataset) or "status" not in other or "scene" not in other.attrs:
        raise BadInput(
            "compare: give the dataset of another survey, such as survey.open('other.nc')"
        )
    if one.attrs["scene"] != other.attrs["scene"]:
        raise BadInput(
            f"compare: the scenes differ, {one.attrs['scene']} and {other.attrs['scene']}; give surveys of one scene"
        )
    unlike = _unlike(one, other)
    one, other = _common(of_points(one), of_points(other))
    found = _outputs(one, other)
    if "verdict" in one and "verdict" in other:
        found["verdict_differs"] = _verdicts(one.verdict, other.verdict)
    if not found:
        raise BadInput("compare: the two have no output in common")
    ds = xr.Dataset(
        found,
        attrs={"title": f"{one.attrs.get('title', '')}: two surveys", "scene": one.attrs["scene"]},
    )
    return ds.assign_attrs(
        unlike=unlike or "nothing but the points", summary=_summary(ds, one.status.size)
    )


def _common(one, other):
    """Both at exactly common values: a value that is only close belongs to another point."""
    for name in dict.fromkeys([*one.coords, *other.coords]):
        first, second = one.coords.get(name), other.coords.get(name)
        if first is None or second is None or first.dtype.kind not in "fi":
            continue
        if first.ndim > 1 or second.ndim > 1 or not {*first.dims, *second.dims} <= {name}:
            continue
        if not first.ndim and not second.ndim:
            continue
        values, at, there = np.intersect1d(np.ravel(first), np.ravel(second), return_indices=True)
        if not values.size:
            raise BadInput(
                f"compare: no value of {name} is common to both ({_range(first)} and {_range(second)}); solve one at "
                f"the other's points, such as survey.evaluate(..., {name}=other.{name})"
            )
        order = np.argsort(at)
        one = one.isel({name: at[order]}) if first.ndim else one
        other = other.isel({name: there[order]}) if second.ndim else other
        scalars = [ds for ds in (first, second) if not ds.ndim]
        if scalars:
            one = one.isel({name: 0}) if first.ndim else one
            other = other.isel({name: 0}) if second.ndim else other
    if set(one.status.dims) != set(other.status.dims):
        raise BadInput(
            f"compare: the axes differ, {', '.join(one.status.dims)} and {', '.join(other.status.dims)}"
        )
    return one, other.transpose(*one.status.dims, ...)


def _range(coord):
    return (
        f"{float(coord.min()):g} to {float(coord.max()):g}" if coord.ndim else f"{float(coord):g}"
    )


def _outputs(one, other):
    """For each output with error bars in both, the difference, and its size over the sum of the
    error bars.
    """
    found = {}
    for name in error_bars(one):
        if f"{name}_error" not in other:
            continue
        difference = one[name] - other[name]
        bar = one[f"{name}_error"].astype(float) + other[f"{name}_error"].astype(float)
        attributes = {
            "long_name": f"difference in {name}",
            "units": one[name].attrs.get("units", "1"),
        }
        found[f"{name}_difference"] = difference.assign_attrs(attributes)
        excess = abs(difference) / xr.where(difference == 0, 1.0, bar)
        attributes = {
            "long_name": f"difference in {name} over the sum of both error bars",
            "units": "1",
        }
        found[f"{name}_excess"] = excess.assign_attrs(
            attributes | {"comment": "above 1 the two contradict each other"}
        )
    return found


def _verdicts(one, other):
    undecided = (one == -1) | (other == -1)
    code = xr.where(
        one == other,
        VERDICTS["same"],
        xr.where(undecided, VERDICTS["one_undecided"], VERDICTS["differ"]),
    )
    attributes = {"long_name": "do the verdicts differ", "units": "1"} | flag_attributes(VERDICTS)
    return code.astype(np.int8).assign_attrs(attributes)


def _unlike(one, other):
    """What else the two differ in: options, method, accuracy, code, fixed parameters."""
    keys = ("options", "method", "rtol", "version_survey", "kernel_hash", "scene_hash")
    differences = [f"{key}: {one.attrs.get(key)} and {other.attrs.get(key)}" for key in keys
                   if not np.array_equal(one.attrs.get(key), other.attrs.get(key))]  # fmt: skip
    for name, value in one.coords.items():
        numbers = name in other.coords and all(
            c.ndim == 0 and c.dtype.kind in "iuf" for c in (value, other[name])
        )
        if numbers and value.item() != other[name].item():
            differences.append(f"{name}: {value.item():g} and {other[name].item():g}")
    return "; ".join(differences)


def _summary(ds, points):
    """One line: the number of points, of verdicts that differ, and of outputs beyond their error bars."""
    reductions = {}
    if "verdict_differs" in ds:
        reductions |= {
            key: (ds.verdict_differs == VERDICTS[key]).sum() for key in ("differ", "one_undecided")
        }
    for name in ds.data_vars:
        if name.endswith("_excess"):
            reductions[name], reductions[f"{name}_most"] = (ds[name] > 1).sum(), ds[name].max()
    found = {key: value.item() for key, value in xr.Dataset(reductions).compute().data_vars.items()}
    parts = [f"{counted(points, 'point')} in common"]
    if "verdict_differs" in ds:
        parts.append(
            f"verdicts differ at {found['differ']:,}, one is undecided at {found['one_undecided']:,}"
        )
    for name in (key for key in found if key.endswith("_excess")):
        if found[name]:
            parts.append(f"{name.removesuffix('_excess')} is beyond its error bars at {found[name]:,}, at most "
                         f"{found[f'{name}_most']:.3g} times")  # fmt: skip
    beyond = any(found[key] for key in found if key.endswith("_excess"))
    return "; ".join(
        parts if beyond else [*parts, "all differences of outputs are within their error bars"]
    )
