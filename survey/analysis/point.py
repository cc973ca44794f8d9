"""One point of a survey: finding it, and everything known about it in readable form."""

import html
from dataclasses import dataclass
from itertools import islice

import numpy as np
import xarray as xr

from survey import modules, status
from survey.analysis import edge
from survey.analysis.given import parameters
from survey.errors import BadInput, Damaged, Untrusted
from survey.file.labels import (
    UNDECIDED,
    as_stored,
    error_bars,
    fill_of,
    flag_codes,
    options_of,
    words_of,
)
from survey.request import user_scene
from survey.wording import NO_FORMULAS, plain

MAX_ROWS = 1000  # of one output
# Attributes that concern the file, not a point.
OF_FILE = (
    "points", "accuracy_missed", "status_counts", "verdict_counts", "areas", "boundaries", "refine", "refine_points",
    "surfaces", "surfaces_left_out", "surfaces_unexplained", "edge_left_out", "edge_incomplete_rows", "curves_lost",
    "curves_unexplained", "boundary_planes", "complete",
)  # fmt: skip


def nearest(ds, coords):
    """The dataset at the point nearest to `coords` (numbers by axis; axes of one value may be left out)."""
    indices = nearest_indices(ds, coords)
    missing = [dim for dim in ds.status.dims if dim not in indices and ds.sizes[dim] > 1]
    if missing:
        raise BadInput(
            f"{missing[0]} is missing: a point needs one value of each of {', '.join(ds.status.dims)}"
        )
    indices |= {dim: 0 for dim in ds.status.dims if dim not in indices}
    return of_points(ds).isel(indices)


def unknown_axis(ds, name, axes):
    """One line for a name that is not an axis of the survey; a fixed parameter is named as such."""
    if name in ds.coords and ds[name].ndim == 0 and ds[name].dtype.kind in "iuf":
        return f"{name} is {float(ds[name]):g} at all points of this survey, so it is not an axis; leave it out"
    return modules.unknown("axis", name, axes)


def of_points(ds):
    """The variables that have a value per point: no edges, no cells, no counts of the whole map."""
    names = [name for name, v in ds.data_vars.items() if set(ds.status.dims) <= set(v.dims)]
    part = ds[names]
    part.attrs = {key: value for key, value in ds.attrs.items() if key not in OF_FILE}
    return part


def section(ds, coords):
    """The survey at the values of some axes nearest to `coords`; a plane with its curves."""
    indices = nearest_indices(ds, coords)
    part = of_points(ds).isel(indices)
    if part.status.ndim < 2 or "curve_count" not in ds:
        return part
    from survey.show.boundaries import in_plane  # loads matplotlib

    curves = in_plane(ds, ds.status.isel(indices))
    if "boundary_planes" in ds.attrs:
        part.attrs["boundary_planes"] = ds.attrs["boundary_planes"]
    return part.assign(
        {name: v for name, v in curves.data_vars.items() if name.startswith("curve_")}
    )


def nearest_indices(ds, coords):
    """{dimension: index of the nearest value} for numbers by axis; raises BadInput for an unknown
    axis or one outside.

    A number may lie beyond an end by up to half a step.
    """
    axes = list(ds.status.dims)
    indices = {}
    for name, value in coords.items():
        if name not in axes:
            raise BadInput(unknown_axis(ds, name, axes))
        if name not in ds.coords or ds[name].dtype.kind not in "iuf":
            indices[name] = _position(ds, name, value)
            continue
        values = ds[name].values
        if not np.isfinite(values).all():
            raise Damaged(f"the axis {name} contains values that are not finite")
        if np.ndim(value) or np.asarray(value).dtype.kind not in "iuf" or not np.isfinite(value):
            raise BadInput(
                f"{name} = {value!r}: give one number, from {values.min():g} to {values.max():g}"
            )
        i = int(np.abs(values - float(value)).argmin())
        step = np.abs(np.diff(values)).max(initial=0)
        if (
            abs(values[i] - value) > 0.5 * step * (1 + 1e-9)
            and not values.min() <= value <= values.max()
        ):
            raise BadInput(f"{name} = {value:g} lies outside the map: give a number from {values.min():g} to "
                           f"{values.max():g}")  # fmt: skip
        indices[name] = i
    return indices


def _position(ds, name, value):
    """The index of a label, or of a number counted from 0, along a dimension whose coordinate is
    not numeric.
    """
    labels = [str(label) for label in ds[name].values] if name in ds.coords else []
    if str(value) in labels:
        return labels.index(str(value))
    if (
        isinstance(value, (int, np.integer))
        and not isinstance(value, bool)
        and 0 <= value < ds.sizes[name]
    ):
        return int(value)
    if labels:
        raise BadInput(f"{name}: {modules.unknown('label', str(value), labels)}")
    raise BadInput(
        f"{name} = {value!r}: it has no coordinate; give a number from 0 to {ds.sizes[name] - 1}"
    )


def plane(ds, at):
    """The survey at the axis values nearest to `at`, and at these labels of other dimensions.

    `at` maps names to text. A dimension beyond the two that are drawn is kept, with length one.
    """
    alone = len([dim for dim in ds.status.dims if dim not in at]) < 2  # then a row is drawn
    for name, text in at.items():
        if name in ds.status.dims:
            labelled = name not in ds.coords or ds[name].dtype.kind not in "iuf"
            i = nearest_indices(ds, {name: text if labelled else _number(name, text)})[name]
            drawn = name in ds.status.dims[:2]
            if alone or (drawn and "curve_count" not in ds):
                ds = of_points(ds).isel({name: i})
                continue
            ds = ds.isel({name: [i]})
            if drawn:  # the last dimension is not; curves of its planes are kept
                ds = ds.assign(status=ds.status.transpose(..., name))
            continue
        others = [dim for dim in ds.dims if dim in ds.coords and dim not in ds.status.dims]
        if name not in others:
            raise BadInput(modules.unknown("axis", name, [*ds.status.dims, *others]))
        known = [str(value) for value in ds[name].values]
        if text not in known:
            raise BadInput(modules.unknown(name, text, known))
        ds = ds.isel({name: [known.index(text)]})
    return ds


def _number(name, text):
    try:
        return float(text)
    except ValueError:
        raise BadInput(f"{name} = {text!r}: give one number, as in --at {name}=0.5") from None


def meaning(variable):
    """The meaning of a single value of a flag variable."""
    words = {code: word for word, code in flag_codes(variable.attrs).items()}
    return words.get(int(variable), str(int(variable)))


@dataclass(frozen=True, repr=False)
class Point:
    """Everything known about one point; print it, or show it in a notebook.

    `dataset` is the point as in the file: every output, its error bar `X_error`, `status`, and
    `verdict`.
    """

    dataset: xr.Dataset

    @property
    def parameters(self):
        """{name: value} of all parameters, including fixed ones."""
        return parameters(self.dataset)

    @property
    def verdict(self):
        """The verdict as a word; None if the scene has none."""
        return meaning(self.dataset.verdict) if "verdict" in self.dataset else None

    @property
    def status(self):
        """The status as a word."""
        return meaning(self.dataset.status)

    @property
    def why(self):
        """What decided the verdict, by what margin and error bar; or why there is no answer."""
        ds = self.dataset
        if int(ds.status) != status.OK:
            return sentence(ds)
        if "verdict" not in ds:
            return sentence(ds)
        try:
            explain = getattr(user_scene.find(user_scene.of_dataset(ds))[1], "why", None)
        except Untrusted as untrusted:
            return str(untrusted)
        except BadInput:
            explain = None
        try:
            return explain(values(ds)) if explain else sentence(ds)
        except KeyError as missing:
            return f"the file does not contain {missing.args[0]}, which decides; add it to output.variables"
        except (ArithmeticError, LookupError, TypeError, ValueError):
            return "the values in the file do not belong to this scene"

    @property
    def python(self):
        """The Python that solves this point again."""
        ds = self.dataset
        given = {
            n: x
            for n, x in self.parameters.items()
            if "domain: " in str(ds[n].attrs.get("comment"))
        }
        given |= options_of(ds)
        given |= {"method": ds.attrs["method"]} if ds.attrs.get("method", "auto") != "auto" else {}
        given |= {"rtol": float(ds.attrs["rtol"])} if "rtol" in ds.attrs else {}
        words = "".join(
            f", {name}={value!r}" for name, value in given.items() if name.isidentifier()
        )
        # by survey.hill and its kin
        made = "scene_hash" in ds.attrs and not str(ds.attrs["scene"]).endswith(".py")
        scene = "scene" if made else repr(ds.attrs["scene"])
        return f"import survey\n\npoint = survey.evaluate({scene}{words}).survey.point()\nprint(point)\n"

    @property
    def margin(self):
        """The nearest boundary in each parameter, in words; "" where none is known, or finding it
        takes seconds.
        """
        try:
            found = edge.margin(self.dataset) if edge.is_quick(self.dataset) else None
        except BadInput:
            return ""
        return edge.in_words(found) if found is not None else ""

    def __repr__(self):
        rows = [tuple(map(plain, row)) for row in self._rows()]
        width = max((len(f"{name} = {value}") for name, value, about in rows if about), default=0)
        lines = (f"{name} = {value}".ljust(width) + f"  {about}" if about else f"{name}: {value}"
                 for name, value, about in rows)  # fmt: skip
        return "\n".join(
            [plain(self.dataset.attrs.get("title", self.dataset.attrs["scene"])), *lines]
        )

    def _repr_html_(self):
        rows = "".join(
            "<tr>"
            + _cell(name)
            + (_cell(value) + _cell(about) if about else _cell(value, 2))
            + "</tr>"
            for name, value, about in self._rows()
        )
        title = html.escape(plain(self.dataset.attrs.get("title", self.dataset.attrs["scene"])))
        return f"<div class='{NO_FORMULAS}'><table><caption>{title}</caption>{rows}</table></div>"

    def _rows(self):
        """Yield (name, value, description) of everything; for text the description is empty."""
        ds = self.dataset
        if self.verdict and has_verdict(ds):
            yield "verdict", self.verdict, ""
        yield "why", self.why, ""
        if int(ds.status) == status.OK:
            yield "status", "ok", ""
            if self.margin:
                yield "nearest boundaries", self.margin, ""
            elif edge.is_slow(ds):
                yield (
                    "nearest boundaries",
                    "by ds.survey.margin() of this point, in some seconds",
                    "",
                )
        settings = [f"{key} = {value}" for key, value in options_of(ds).items()]
        settings += [
            f"method {ds.attrs.get('method', 'auto')}",
            f"rtol {ds.attrs.get('rtol', float('nan')):g}",
        ]
        yield "solved with", ", ".join(settings), ""
        for name, value in self.parameters.items():
            yield name, f"{value!r}", _about(ds[name])
        bars = error_bars(ds)
        for name, variable in ds.data_vars.items():
            if not name.endswith("_error") and name not in ("verdict", "status"):
                yield from _outputs(ds, name, variable, name in bars)


def _cell(text, columns=1):
    return f"<td colspan='{columns}' style='text-align:left;vertical-align:top'>{html.escape(plain(text))}</td>"


def values(ds):
    """{name: value} of everything known about a point, numpy arrays; `verdict` and other flags as words."""
    return {
        name: meaning(v) if "flag_values" in v.attrs and v.ndim == 0 else as_stored(v)
        for name, v in ds.variables.items()
        if set(v.dims) <= set(ds.dims)
    }


def has_verdict(ds):
    """Does the point have a verdict, possibly undecided? If not, its status says why there is no answer."""
    return int(ds.status) == status.OK or int(ds.verdict) != UNDECIDED


def sentence(ds):
    """What the status says of the point."""
    sentences = dict(
        part.split(": ", 1)
        for part in ds.status.attrs.get("comment", "").split("; ")
        if ": " in part
    )
    word = meaning(ds.status)
    return f"{word}: {sentences[word]}" if word in sentences else word


def _outputs(ds, name, variable, has_bar):
    """Yield the rows of an output: one, or one for each position along its own dimensions that has
    a value.
    """
    about = _about(variable)
    if not variable.ndim:
        yield name, reading(ds, name, has_bar), about
        return
    for index in islice(np.ndindex(variable.shape), MAX_ROWS):
        where = dict(zip(variable.dims, index, strict=True))
        value = reading(ds.isel(where), name, has_bar)
        if value not in ("does not apply", "none"):
            yield (
                f"{name}[{', '.join(str(ds[dim].values[i]) for dim, i in where.items())}]",
                value,
                about,
            )


def reading(ds, name, has_bar):
    """A value with as many digits as its error bar justifies."""
    variable = ds[name]
    if "flag_values" in variable.attrs:
        return "no answer" if int(ds.status) in status.UNANSWERED else meaning(variable)
    value = float(variable)
    if not np.isfinite(value):
        return "does not apply"
    if not has_bar:
        number = as_stored(variable)[()]
        return (
            "does not apply"
            if number == fill_of(variable)
            else words_of(variable).get(number, str(number))
        )
    bar = float(ds[f"{name}_error"])
    if not 0 <= bar < np.inf:
        return f"{value!r}, its error bar is {bar}"
    known = (
        2
        if bar == 0 or value == 0
        else np.floor(np.log10(abs(value))) - np.floor(np.log10(bar)) + 2
    )
    return f"{value:#.{int(np.clip(known, 2, 17))}g} +- {bar:.2g}" if bar else f"{value!r} +- 0"


def _about(variable):
    units = variable.attrs.get("units", "1")
    return f"{variable.attrs.get('long_name', variable.name)}{'' if units in ('1', '') else f' ({units})'}"
