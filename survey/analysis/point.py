"""One point of a survey: finding it, and everything known of it in a form that can be read."""

import html
from dataclasses import dataclass

import numpy as np
import xarray as xr

from survey import modules, own, status
from survey.dataset import error_bars
from survey.errors import BadInput


def nearest(ds, coords):
    """The dataset at the point next to `coords` (numbers by axis; axes of one value may be left out)."""
    point = place(ds, coords)
    missing = [dim for dim in ds.status.dims if dim not in point and ds.sizes[dim] > 1]
    if missing:
        raise BadInput(f"{missing[0]} is missing: a point needs a number for each of {', '.join(ds.status.dims)}")
    point |= {dim: 0 for dim in ds.status.dims if dim not in point}
    own_dims = set(ds.status.dims)
    names = [name for name, v in ds.variables.items() if own_dims <= set(v.dims) or name in ds.coords]
    return ds[names].isel(point)


def place(ds, coords):
    """{dimension: place of the nearest value} of numbers by axis; raises BadInput for one that is no axis or too far.

    A number may lie beyond an end by half a step, not more.
    """
    axes = [dim for dim in ds.status.dims if dim in ds.coords]
    places = {}
    for name, value in coords.items():
        if name not in axes:
            raise BadInput(modules.unknown("axis", name, axes))
        values = ds[name].values
        if np.ndim(value) or np.asarray(value).dtype.kind not in "iuf" or not np.isfinite(value):
            raise BadInput(f"{name} = {value!r}: give one number, from {values.min():g} to {values.max():g}")
        i = int(np.abs(values - float(value)).argmin())
        step = np.abs(np.diff(values)).max(initial=0)
        if abs(values[i] - value) > 0.5 * step * (1 + 1e-9) and not values.min() <= value <= values.max():
            raise BadInput(f"{name} = {value:g} lies outside the map: give a number from {values.min():g} to "
                           f"{values.max():g}")  # fmt: skip
        places[name] = i
    return places


def meaning(variable):
    """The word of a flag's code, of a single value."""
    codes = np.atleast_1d(variable.attrs["flag_values"]).tolist()
    words = variable.attrs["flag_meanings"].split()
    return dict(zip(codes, words, strict=True)).get(int(variable), str(int(variable)))


def parameters(ds):
    """{name: value} of a point's parameters."""
    return {name: float(c) for name, c in ds.coords.items() if c.ndim == 0 and c.dtype.kind in "fi"}


def options(ds):
    """{name: value} of the scene's options."""
    return dict(pair.split("=") for pair in ds.attrs["options"].split(", ") if pair)


@dataclass(frozen=True, repr=False)
class Point:
    """Everything known of one point; print it, or let a notebook show it.

    `dataset` holds it as it is in the file: every output, its error bar `X_error`, `status`, and `verdict`.
    """

    dataset: xr.Dataset

    @property
    def parameters(self):
        """{name: value} of all parameters, fixed ones too."""
        return parameters(self.dataset)

    @property
    def verdict(self):
        """The verdict in a word; None where the scene has none."""
        return meaning(self.dataset.verdict) if "verdict" in self.dataset else None

    @property
    def status(self):
        """The status in a word."""
        return meaning(self.dataset.status)

    @property
    def why(self):
        """What decided the verdict, by which margin against which error bar; or why there is no answer."""
        ds = self.dataset
        if int(ds.status) != status.OK:
            return _sentence(ds)
        judge = getattr(_scene(ds), "why", None)
        return judge(values(ds)) if judge and "verdict" in ds else _sentence(ds)

    def __repr__(self):
        return "\n".join(f"{head + ':':<12}{line}".rstrip() for head, line in self._lines())

    def _repr_html_(self):
        rows = "".join(
            f"<tr><th style='text-align:left;vertical-align:top'>{html.escape(head)}</th>"
            f"<td style='text-align:left'>{html.escape(line)}</td></tr>"
            for head, line in self._lines()
        )
        return f"<table>{rows}</table>"

    def _lines(self):
        ds = self.dataset
        yield "point", ds.attrs.get("title", ds.attrs["scene"])
        for name in self.parameters:
            yield "parameter", f"{name} = {_number(ds[name])}  {_about(ds[name])}"
        for key, value in options(ds).items():
            yield "option", f"{key} = {value}"
        yield "method", f"{ds.attrs.get('method', 'auto')}, rtol {ds.attrs.get('rtol', float('nan')):g}"
        if self.verdict:
            yield "verdict", self.verdict
        yield "why", self.why
        yield "status", self.status
        bars = error_bars(ds)
        for name, variable in ds.data_vars.items():
            if name.endswith("_error") or name in ("verdict", "status"):
                continue
            yield "output", f"{name} = {_value(ds, name, name in bars)}  {_about(variable)}"

    def __str__(self):
        return repr(self)


def values(ds):
    """{name: value} of everything known of a point, numpy arrays; `verdict` and other flags as words."""
    return {
        name: meaning(v) if "flag_values" in v.attrs and v.ndim == 0 else v.values
        for name, v in ds.variables.items()
        if set(v.dims) <= set(ds.dims)
    }


def _scene(ds):
    """The scene's module, or None where it is a user's that is gone."""
    try:
        return own.find(own.of_dataset(ds))[1]
    except BadInput:
        return None


def _sentence(ds):
    """What the status says of the point."""
    said = dict(part.split(": ", 1) for part in ds.status.attrs.get("comment", "").split("; ") if ": " in part)
    word = meaning(ds.status)
    return f"{word}: {said[word]}" if word in said else word


def _value(ds, name, has_bar):
    variable = ds[name]
    if variable.ndim:
        label = variable.dims[0]
        parts = [_one(ds, name, has_bar, {label: i}) for i in range(ds.sizes[label])]
        return ", ".join(f"{ds[label].values[i]}: {p}" for i, p in enumerate(parts) if p != "does not apply") or "none"
    return _one(ds, name, has_bar, {})


def _one(ds, name, has_bar, where):
    variable = ds[name].isel(where)
    if "flag_values" in variable.attrs:
        return meaning(variable)
    if not np.isfinite(variable.values):
        return "does not apply"
    return f"{_number(variable)} +- {float(ds[f'{name}_error'].isel(where)):.2g}" if has_bar else str(variable.values)


def _number(variable):
    return repr(float(variable))


def _about(variable):
    units = variable.attrs.get("units", "1")
    return f"({variable.attrs.get('long_name', variable.name)}{'' if units in ('1', '') else f', {units}'})"
