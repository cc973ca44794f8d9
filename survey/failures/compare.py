"""One method on one plane, held against the truth."""

from dataclasses import dataclass
from functools import partial

import numpy as np
import xarray as xr

from survey import status
from survey.api import evaluate
from survey.errors import BadInput
from survey.failures.plane import MAP
from survey.request import user_scene
from survey.scene import exists
from survey.truth import distance


@dataclass(frozen=True)
class Comparison:
    """Arrays of the picture's shape (y, x)."""

    # the largest of the outputs' true errors over 1 + |value|; NaN where none is known
    error: np.ndarray
    ratio: np.ndarray  # the largest true error over its bar, less the truth's own doubt
    answered: np.ndarray
    missed: np.ndarray  # answered, but a bar exceeds rtol (1 + |value|)
    undecided: np.ndarray
    unchecked: np.ndarray  # answered, but the truth's doubt exceeds every bar
    lie: np.ndarray  # a true error beyond its bar, or a verdict that the truth contradicts


def compared(plane, method, rtol):
    """The Comparison of a method; None if the plane's question is not one of its."""
    answer = asked(plane, method, rtol)
    return None if answer is None else judged(plane, answer, rtol)


def asked(plane, method, rtol):
    """What `survey.evaluate` answers, {variable: array (points, ...)}; None where it refuses all of it."""
    solve = partial(
        evaluate,
        plane.scene,
        method="auto" if method == MAP else method,
        rtol=rtol,
        **plane.options,
    )
    if method != MAP and not plane.shared:
        ds = _points(solve, plane.flat(), plane.size)
        return (
            None
            if ds is None
            else {name: ds[name].transpose("point", ...).values for name in ds.data_vars}
        )
    try:
        ds = solve(**{name: _axis(plane, values) for name, values in plane.given.items()})
    except BadInput:
        return None
    sizes = {
        dim: size for dim, size in zip(("y", "x"), plane.shape, strict=True) if dim not in ds.dims
    }
    ds = ds.expand_dims(sizes).stack(point=("y", "x")).transpose("point", ...)
    return {name: ds[name].values for name in ds.data_vars}


def _points(solve, given, size):
    """The answers of points one by one: a call that is refused (as for a spike) is halved until one
    point is.
    """
    try:
        ds = solve(**{name: xr.DataArray(values, dims="point") for name, values in given.items()})
        return ds.reset_coords(drop=True)
    except BadInput:
        if size == 1:
            return None
    half = size // 2
    parts = [_points(solve, {name: values[part] for name, values in given.items()}, number)
             for part, number in ((slice(half), half), (slice(half, None), size - half))]  # fmt: skip
    if all(part is None for part in parts):
        return None
    like = next(part for part in parts if part is not None)
    for i, number in enumerate((half, size - half)):
        if parts[i] is None:
            parts[i] = like.isel(point=np.zeros(number, int)).copy(deep=True)
            parts[i]["status"][:] = status.INVALID_PARAMETERS
    return xr.concat(parts, "point")


def _axis(plane, values):
    """An axis of a map, or of what one solution serves."""
    values = np.asarray(values, float)
    if not values.ndim:
        return float(values)
    kept = [(dim, size) for dim, size in zip(("y", "x"), values.shape, strict=True) if size > 1]
    return xr.DataArray(values.reshape([size for _, size in kept]), dims=[dim for dim, _ in kept])


def judged(plane, answer, rtol):
    """The answer held against the truth."""
    truth = plane.truth(plane.flat(), answer)
    answered = _answered(answer)
    lie = np.zeros(answered.shape, bool)
    for mask in truth.pop("wrong", {}).values():
        lie |= mask
    checked = np.zeros(answered.shape, bool) | truth.pop("checked", False)
    error = np.full(answered.shape, np.nan)
    ratio = np.zeros(answered.shape)
    for name, (value, low, doubt) in truth.items():
        said, bar = answer[name], answer[f"{name}_error"].astype(float)
        with np.errstate(all="ignore"):
            off, known, over = distance(said, value, low, doubt)
            sharp = known & ((doubt <= bar) | (off == 0) | (off > doubt))
            relative = np.where(sharp, off / (1.0 + np.abs(np.asarray(value, float))), np.nan)
            checked |= _any(sharp)
            ratio = np.maximum(ratio, _most(np.where(over > 0.0, over / bar, 0.0)))
            error = np.fmax(error, _most(relative))
    lie |= ratio > 1.0
    missed = answered & _missed(plane, answer, rtol)
    undecided = (
        answered & (answer["verdict"] == -1)
        if "verdict" in answer
        else np.zeros(answered.shape, bool)
    )
    shown = (
        np.where(answered, error, np.nan),
        ratio,
        answered,
        missed,
        undecided,
        answered & ~checked,
        lie & answered,
    )
    return Comparison(*(values.reshape(plane.shape) for values in shown))


def _answered(answer):
    """Status ok, or a word of the scene's own beside values (turned before an angle)."""
    some = np.zeros(answer["status"].shape, bool)
    for name in answer:
        if f"{name}_error" in answer:
            some |= _any(np.isfinite(answer[name]))
    return (answer["status"] == status.OK) | (
        some & ~np.isin(answer["status"], list(status.UNANSWERED))
    )


def _missed(plane, answer, rtol):
    """Where a bar exceeds the requested accuracy."""
    _, module = user_scene.find(plane.scene)
    missed = np.zeros(answer["status"].shape, bool)
    for output in module.OUTPUTS:
        if (
            output.name in answer
            and f"{output.name}_error" in answer
            and exists(output, _options(module, plane))
        ):
            bar = answer[f"{output.name}_error"]
            with np.errstate(invalid="ignore"):
                missed |= _any(bar > rtol * (1.0 + np.abs(answer[output.name])))
    return missed


def _options(module, plane):
    return {
        option.name: option.default for option in module.OPTIONS if not option.only_with
    } | dict(plane.options)


def _any(mask):
    return mask.reshape(len(mask), -1).any(axis=1)


def _most(values):
    with np.errstate(invalid="ignore"):
        return np.fmax.reduce(values.reshape(len(values), -1), axis=1)
