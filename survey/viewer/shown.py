"""A survey's file and a view of it: the link to a view, and what is known about a point in a few lines."""

import re
import textwrap
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import isfinite
from urllib.parse import parse_qsl, urlencode

import numpy as np

from survey import modules, status
from survey.analysis.point import has_verdict, meaning, reading, sentence
from survey.errors import BadInput, Damaged
from survey.file import schema
from survey.file.labels import flag_codes, percent
from survey.file.reading import load
from survey.show.boundaries import plane_of, position_of
from survey.show.text import options_in_words
from survey.viewer import raster
from survey.wording import plain

FAR = 1e300  # below this, no sum or difference of coordinates overflows
LINES = 6  # outputs shown for the point under the pointer


@dataclass
class View:
    """A variable, the window [(x low, high), (y low, high)], indices along other dimensions, the
    chosen position.
    """

    name: str
    boundaries: bool = True
    window: list = field(default_factory=list)
    others: dict = field(default_factory=dict)
    point: tuple | None = None


class ShownMap:
    """A survey's file, lazy if it is large, and its two axes; raises BadInput or Damaged for a file
    without a map.

    Or a survey `ds` in memory.
    """

    def __init__(self, path, ds=None):
        ds = load(path, chunks=None) if ds is None else ds
        _check(path, ds)
        if len(ds.status.dims) < 2:
            raise BadInput(
                f"{path}: this survey has fewer than two axes, so there is no map to view; draw it with survey plot"
            )
        self.dims = tuple(plane_of(ds) or ds.status.dims[:2])
        down = [dim for dim in self.dims if ds[dim].values[0] > ds[dim].values[-1]]
        self.ds = ds.isel({dim: slice(None, None, -1) for dim in down})
        self.axes = [raster.MapAxis(self.ds[dim].values) for dim in self.dims]
        dims = set(ds.status.dims)
        self.names = [
            name
            for name, v in ds.data_vars.items()
            if dims <= set(v.dims) and not name.endswith("_error")
        ]
        self.title = plain(ds.attrs.get("title", ""))
        self.options = options_in_words(ds)
        # further dimensions: of the survey, and of some outputs
        self.others = list(
            dict.fromkeys(
                dim for name in self.names for dim in ds[name].dims if dim not in self.dims
            )
        )
        self._layers = lru_cache(maxsize=8)(self._layer)

    def layer(self, view):
        """The view's variable, ready to be drawn; the last few are cached."""
        return self._layers(
            view.name, tuple((dim, view.others[dim]) for dim in self.further_dims(view.name))
        )

    def like(self, view):
        """The View of this map that shows what the view of another does."""
        return replace(
            view, others={dim: at for dim, at in view.others.items() if dim in self.others}
        )

    def further_dims(self, name):
        """The dimensions of a variable other than the map's two."""
        return [dim for dim in self.others if dim in self.ds[name].dims]

    def _layer(self, name, others):
        cells = name == "verdict" and "cell_verdict" in self.ds
        return (raster.CellLayer if cells else raster.Layer)(self.ds, name, self.dims, dict(others))

    def read(self, query):
        """The View of a link's query; raises BadInput if it is not one of this map."""
        given = dict(parse_qsl(query))
        allowed = ["var", "boundaries", "x", "y", "point", *(f"at_{dim}" for dim in self.others)]
        for key in given:
            if key not in allowed:
                raise BadInput(modules.unknown("key of the link", key, allowed))
        view = View(given.get("var", "verdict" if "verdict" in self.names else self.names[0]))
        if view.name not in self.names:
            raise BadInput(modules.unknown("variable", view.name, self.names))
        view.boundaries = given.get("boundaries") != "0"
        for at, axis in zip("xy", self.axes, strict=True):
            view.window.append(_numbers(at, given[at], 2) if at in given else axis.ends)
            if (
                not view.window[-1][0] < view.window[-1][1]
                or axis.pixels(*view.window[-1], 1) is None
            ):
                raise BadInput(
                    f"{at} = {given[at]}: give low,high of a range that overlaps the map's, {axis.range}"
                )
        if "point" in given:
            numbers = _numbers("point", given["point"], 2)
            view.point = numbers
            if None in [
                axis.nearest(value) for axis, value in zip(self.axes, numbers, strict=True)
            ]:
                raise BadInput(
                    f"point = {given['point']}: it lies outside the map, {' by '.join(a.range for a in self.axes)}"
                )
        for dim in self.others:
            usual = str(position_of(self.ds, dim))
            (value,) = _numbers(f"at_{dim}", given.get(f"at_{dim}", usual), 1)
            if value not in range(self.ds.sizes[dim]):
                raise BadInput(
                    f"at_{dim} = {value:g}: it must be an index of that axis, 0 to {self.ds.sizes[dim] - 1}"
                )
            view.others[dim] = int(value)
        return view

    def link(self, view):
        """The query that `read` reads."""
        query = {"var": view.name}
        query |= {
            at: ",".join(repr(float(end)) for end in ends)
            for at, ends in zip("xy", view.window, strict=True)
        }
        query |= {} if view.boundaries else {"boundaries": 0}
        query |= {
            f"at_{dim}": at for dim, at in view.others.items() if at != position_of(self.ds, dim)
        }
        if view.point is not None:
            query["point"] = ",".join(repr(value) for value in view.point)
        return urlencode(query, safe=",")

    def shares(self, name):
        """{flag: its share of the map, as text}."""
        ds = self.ds
        if name == "verdict" and "area_fraction" in ds:
            schema.areas(ds)
            shares = zip(
                flag_codes(ds.area_verdict.attrs),
                ds.area_fraction.values,
                ds.area_fraction_error.values,
                strict=True,
            )
            return {
                flag: f" ({percent(share, bar)})".replace("+-", "±") for flag, share, bar in shares
            }
        texts = [str(ds.attrs.get(f"{key}_counts", "")) for key in ("status", name)]
        counts = (part.rpartition(": ") for part in ", ".join(texts).split(", "))
        return {
            flag: f" ({int(number):,} in all)"
            for flag, _, number in counts
            if re.fullmatch("[0-9]{1,18}", number)
        }

    def position(self, point):
        """The coordinates (x, y) of a point's indices."""
        return tuple(float(axis.values[at]) for axis, at in zip(self.axes, point, strict=True))

    def coords(self, view):
        """{axis: value} of the map's point at the chosen position, for the survey's accessor; None
        if there is none.
        """
        point = [axis.nearest(at) for axis, at in zip(self.axes, view.point, strict=True)]
        if None in point or self.position(point) != tuple(view.point):
            return None
        indices = dict(zip(self.dims, point, strict=True)) | view.others
        return {dim: float(self.ds[dim].values[indices[dim]]) for dim in self.ds.status.dims}

    def under(self, view, point):
        """Lines of plain text about the point at these two indices, the view's variable first."""
        return map(plain, self._under(view, point))

    def _under(self, view, point):
        ds = self.ds
        names = dict.fromkeys([view.name, *(["verdict"] if "verdict" in ds else []), *self.names])
        names = [name for name in names if name != "status"][:LINES]
        bars = [f"{name}_error" for name in names if f"{name}_error" in ds]
        # a window solved afresh has fewer
        others = {dim: at for dim, at in view.others.items() if dim in ds.dims}
        here = (
            ds[[*names, *bars, "status"]]
            .isel(dict(zip(self.dims, point, strict=True)) | others)
            .load()
        )
        yield ", ".join(f"{dim} = {short(here[dim].values)}" for dim in ds.status.dims)
        if view.name == "verdict" and "cell_verdict" in ds:
            yield from self._cell(*self.position(point))
        if here.status != status.OK:
            yield from textwrap.wrap(sentence(here), 60)
        for name in names:
            if name == "verdict" and not has_verdict(here):
                continue
            value = reading(here, name, f"{name}_error" in bars).replace("+-", "±")
            yield (
                f"{name}: {value.replace('_', ' ')}"
                if "flag_values" in here[name].attrs
                else f"{name} = {value}"
            )

    def _cell(self, *position):
        """Yield the verdict of the cell of a refined map that contains the point."""
        inside, ds = True, self.ds
        for dim, value in zip(self.dims, position, strict=True):
            inside &= (ds[f"cell_{dim}_low"].values <= value) & (
                value <= ds[f"cell_{dim}_high"].values
            )
        yield from (f"cell: {meaning(found)}" for found in ds.cell_verdict[inside][:1])


def _check(path, ds):
    """Raise BadInput or Damaged unless the axes have values, the first two monotonic, and the cells
    are consistent.
    """
    for dim in ds.status.dims:
        if dim not in ds.coords:
            raise BadInput(f"{path}: the axis {dim} has no values, so there is no map to view")
    if "cell_verdict" in ds:
        schema.cells(ds)
    for dim in plane_of(ds) or ds.status.dims[:2]:
        if ds[dim].dtype.kind not in "iuf":
            raise BadInput(
                f"{path}: the axis {dim} holds names, and a viewer shows axes of numbers; use survey plot"
            )
        values = ds[dim].values.astype(float)
        if abs(values).max() > FAR:
            raise Damaged(
                f"{path}: the axis {dim} extends beyond {FAR:g}, so there is no map to view"
            )
        steps = np.diff(values)
        if not ((steps > 0).all() or (steps < 0).all()):
            raise Damaged(
                f"{path}: the values of the axis {dim} are not monotonic, so there is no map to view"
            )


def short(value):
    """A coordinate, number or label, as short text."""
    return f"{value:.8g}" if value.dtype.kind == "f" else plain(str(value), 80)


def _numbers(key, text, number):
    """The finite numbers in `text`, separated by commas."""
    try:
        found = tuple(float(word) for word in text.split(","))
    except ValueError:
        found = ()
    if len(found) != number or not all(map(isfinite, found)):
        raise BadInput(
            f"{key} = {text}: it must be {number} number{'s, separated by a comma' * (number > 1)}"
        )
    return found
