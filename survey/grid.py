"""Axes -> exact coordinates -> blocks. A scene receives a block as its axes, not as a list of points."""

from collections import Counter
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, product
from math import ceil, isinf, prod

import numpy as np

from survey.errors import BadInput


@dataclass(frozen=True)
class Grid:
    """Parameters on named dimensions: {name: (its dimensions, float64 values)}; a fixed number has
    no dimension.

    `sizes` holds the dimensions in order. Dimensions in `uncut` are never cut.
    """

    sizes: Mapping[Hashable, int]
    parameters: Mapping[str, tuple[tuple[Hashable, ...], np.ndarray]]
    uncut: frozenset[Hashable] = frozenset()

    @property
    def shape(self):
        return tuple(self.sizes.values())

    @property
    def points(self):
        return prod(self.shape)

    @cached_property
    def lines(self):
        """`lines` of its parameters."""
        return lines(self.parameters, self._alone)

    @cached_property
    def ranges(self):
        """`ranges` of its parameters."""
        return ranges(self.parameters, self._alone)

    @cached_property
    def _alone(self):
        return _alone(self.parameters)

    @cached_property
    def fixed(self):
        """The names of the parameters that are single numbers."""
        return fixed(self.parameters)

    def blocks(self, points_per_block):
        """Blocks, slices per dimension, of at most `points_per_block` points: the first dimensions
        are cut first.
        """
        whole = tuple(slice(0, size) for size in self.shape)
        return [whole] if self.points <= points_per_block else self._within(whole, points_per_block)

    def tiled(self, points_per_block, points_per_region, points_per_tile):
        """(lengths of a tile, [(region, its blocks)]): no tile or block belongs to two regions.

        Regions and blocks are slices per dimension, of at most these numbers of points, as far as
        `uncut` dimensions allow.
        """
        region = self._lengths(points_per_region)
        tile = halved(region, points_per_tile)
        cuts = []
        for size, piece, length in zip(self.shape, region, tile, strict=True):
            step = piece if piece == size else piece // length * length
            cuts.append([slice(first, min(first + step, size)) for first in range(0, size, step)])
        return tile, [(region, self._within(region, points_per_block)) for region in product(*cuts)]

    def _within(self, region, points_per_block):
        """The blocks of a region."""
        spans = [range(cut.start, cut.stop) for cut in region]
        lengths = replace(self, sizes=dict(zip(self.sizes, map(len, spans), strict=True)))._lengths(
            points_per_block
        )
        return list(product(*map(_even_cuts, spans, lengths)))

    def _lengths(self, points):
        """The length of a piece along each dimension."""
        lengths, size = dict(self.sizes), self.points
        for name, length in self.sizes.items():
            if size <= points:
                break
            if name not in self.uncut:
                rest = size // length
                lengths[name] = max(1, points // rest)
                size = rest * lengths[name]
        return tuple(lengths.values())

    def point(self, block):
        """{name: array, to read alone} for `block` (a tuple of slices): every array has one axis per dimension
        (some of length 1).
        """
        where = dict(zip(self.sizes, block, strict=True))
        aligned = {}
        for name, (dims, values) in self.parameters.items():
            part = values[tuple(where[dim] for dim in dims)]
            order = [dims.index(dim) for dim in self.sizes if dim in dims]
            part = part.transpose(order)
            part = part.reshape(
                [part.shape[order.index(dims.index(dim))] if dim in dims else 1 for dim in where]
            )
            aligned[name] = np.asarray(part, order="C")
        return aligned

    def ends_and_middles(self):
        """{name: values (N)} of the points at the ends and middles of all dimensions."""
        some = [sorted({0, size // 2, size - 1}) for size in self.shape]
        index = dict(zip(self.sizes, np.ix_(*some), strict=True))
        shape = tuple(map(len, some))
        return {
            name: np.broadcast_to(values[tuple(index[dim] for dim in dims)], shape).ravel()
            for name, (dims, values) in self.parameters.items()
        }


def lines(parameters, alone=None):
    """{name: (number, least, greatest)} of each parameter that has an axis which no other shares.

    `parameters` is {name: (its dimensions, its values)}; least and greatest are those of the finite
    values. `alone`: the names of these parameters, if they are known.
    """
    alone = _alone(parameters) if alone is None else alone
    return {name: (np.size(parameters[name][1]), *_ends(parameters[name][1])) for name in alone}


def ranges(parameters, alone=None):
    """{name: (number, least, greatest)} of each parameter that shares an axis with another, as `lines`;
    each is found when it is asked for: few scenes ask.
    """
    alone = _alone(parameters) if alone is None else alone
    return _Ranges({n: of for n, (dims, of) in parameters.items() if dims and n not in alone})


class _Ranges(Mapping):
    def __init__(self, values):
        self._values, self._found = values, {}

    def __getitem__(self, name):
        if name not in self._found:
            values = self._values[name]
            self._found[name] = (np.size(values), *_ends(values))
        return self._found[name]

    def __contains__(self, name):
        return name in self._values

    def __iter__(self):
        return iter(self._values)

    def __len__(self):
        return len(self._values)


def _alone(parameters):
    """The names of the parameters that have an axis which no other shares."""
    number = Counter([dim for dims, _ in parameters.values() for dim in dims])
    return [
        name for name, (dims, _) in parameters.items() if len(dims) == 1 and number[dims[0]] == 1
    ]


def _ends(values):
    """The least and the greatest of the finite values."""
    values = np.asarray(values)
    low, high = values.min(initial=np.inf), values.max(initial=-np.inf)
    if not np.isfinite(high - low):
        finite = values[np.isfinite(values)]
        low, high = finite.min(initial=np.inf), finite.max(initial=-np.inf)
    return float(low), float(high)


def fixed(parameters):
    """The names of those of the `parameters` {name: (its dimensions, its values)} that are single numbers."""
    return frozenset(name for name, (dims, _) in parameters.items() if not dims)


def halved(lengths, most):
    """The lengths of a tile: the longest is halved until there are at most `most` points."""
    lengths = list(lengths)
    while prod(lengths) > most:
        longest = lengths.index(max(lengths))
        lengths[longest] = ceil(lengths[longest] / 2)
    return tuple(lengths)


def _even_cuts(span, piece):
    """Slices of nearly equal length, none longer than `piece`, that cover a range."""
    pieces = max(1, ceil(len(span) / piece))
    edges = [span.start + len(span) * i // pieces for i in range(pieces + 1)]
    return [slice(a, b) for a, b in pairwise(edges)]


def coordinates(start, stop, num, spacing="linear"):
    """`num` float64 coordinates from `start` to `stop`, both ends exact; `spacing` is "linear" or "log"."""
    if num == 1 and start != stop:
        raise BadInput(f"num = 1 cannot reach stop = {stop:g}; give num >= 2, or a single number")
    if num > 1 and start == stop:
        raise BadInput(
            f"start and stop are both {start:g}, with num = {num}; give a single number, or another stop"
        )
    if isinf(float(stop) - float(start)):
        raise BadInput(
            f"start = {start:g}, stop = {stop:g}: they differ by more than the largest number, 1.8e308"
        )
    if spacing == "log":
        if not (start > 0 and stop > 0):
            raise BadInput(
                f"start = {start:g}, stop = {stop:g} with spacing = 'log': both must be positive"
            )
        return np.geomspace(start, stop, num)
    return np.linspace(start, stop, num)


def positions(values):
    """Coordinates as floats; labels by their number, counted from 0."""
    values = np.asarray(values)
    return (
        values.astype(float) if values.dtype.kind in "iufb" else np.arange(values.size, dtype=float)
    )


def logarithmic(values):
    """Are the coordinates spaced evenly in the logarithm, and not evenly?"""
    if values.size < 3 or values.min() <= 0:
        return False
    ratio, step = values[1:] / values[:-1], np.diff(values)
    return np.allclose(ratio, ratio[0]) and not np.allclose(step, step[0])


def check_axis(key, values):
    """Raise BadInput, naming `key`, unless `values` is non-empty, finite and strictly monotonic."""
    if values.size == 0:
        raise BadInput(f"{key}: an axis needs at least one value; give values or num >= 1")
    bad = np.flatnonzero(~np.isfinite(values))
    if bad.size:
        raise BadInput(
            f"{key}: value {bad[0] + 1} is {values[bad[0]]:g}; every value must be a finite number"
        )
    steps = np.diff(values)
    same = np.flatnonzero(steps == 0)
    if same.size:
        raise BadInput(f"{key}: {float(values[same[0]])!r} occurs twice; give each value once")
    if steps.size and not (np.all(steps > 0) or np.all(steps < 0)):
        raise BadInput(f"{key}: the values are not monotonic; sort them")
