"""A window of a map -> the pixels of a screen, reading only what is needed: maps of 10^8 points and
more.

A pixel with many points represents all of them, as in `survey.file.overview`; one without any shows
the nearest.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from matplotlib import colormaps

from survey.file.labels import flag_codes, scene_statuses
from survey.file.overview import NO_ANSWER, UNIONS, UNREAD, Overview, VariablePoints, over, unranked
from survey.grid import logarithmic
from survey.show.maps import colour_limits
from survey.show.palette import colours_of, greys_of

DIRECT = 2**22  # points: a smaller window is read from the file, a larger one from the overview
OVERVIEW = 4096  # cells along an axis of the overview, at most
LIMITS = 512  # cells along an axis from which the colour limits are computed
WHITE, UNKNOWN, NOT_APPLY, LINE = "#FFFFFF", "#444444", "#DDDDDD", "#777777"
BACKGROUND = "#F4F4F4"
HATCH = 6  # pixels from line to line
viridis = colormaps["viridis"]


class MapAxis:
    """One axis of the map: its increasing coordinates, on the scale on which they are drawn.

    `values` (n,); `log`: is the scale logarithmic; `cells` (n + 1,): ends of the points' cells, on
    the scale.
    """

    def __init__(self, values):
        self.values = np.asarray(values, dtype=float)
        self.log = logarithmic(self.values)
        self.centres = self.scaled(self.values)
        middles = 0.5 * (self.centres[1:] + self.centres[:-1])
        half = 0.5 * np.diff(self.centres)[[0, -1]] if middles.size else np.full(2, 0.5)
        self.cells = np.concatenate(
            [[self.centres[0] - half[0]], middles, [self.centres[-1] + half[1]]]
        )

    def scaled(self, values):
        """Coordinates on the scale."""
        return np.log(values) if self.log else np.asarray(values, dtype=float)

    def unscaled(self, values):
        """The inverse of `scaled`."""
        return np.exp(values) if self.log else values

    @property
    def ends(self):
        """The map's two ends, half a cell beyond its outermost points."""
        return tuple(float(end) for end in self.unscaled(self.cells[[0, -1]]))

    @property
    def range(self):
        """Its range as text."""
        return f"{self.values[0]:g} to {self.values[-1]:g}"

    def inner(self, low, high):
        """The part of the window [low, high] between the outermost points, beyond which a domain may end."""
        return max(low, float(self.values[0])), min(high, float(self.values[-1]))

    def nearest(self, value):
        """Index of the point in whose cell `value` lies; None outside the map."""
        if self.log and value <= 0:
            return None
        index = int(np.searchsorted(self.cells, self.scaled(value), side="right")) - 1
        return index if 0 <= index < self.values.size else None

    def pixels(self, low, high, number):
        """The part of the window [low, high] on the map as `Pixels`, the window having `number`;
        None if outside.
        """
        if self.log:
            low, high = max(low, self.ends[0]), max(high, self.ends[0])
        low, high = self.scaled(low), self.scaled(high)
        seen = max(low, self.cells[0]), min(high, self.cells[-1])
        if not seen[0] < seen[1]:
            return None
        number = int(np.clip(round(number * (seen[1] - seen[0]) / (high - low)), 1, number))
        edges = np.linspace(*seen, number + 1)
        inside = np.searchsorted(self.centres, edges)
        middles = 0.5 * (edges[1:] + edges[:-1])
        near = np.clip(
            np.searchsorted(self.cells, middles, side="right") - 1, 0, self.values.size - 1
        )
        starts = np.where(inside[1:] > inside[:-1], inside[:-1], near)
        return Pixels(self, edges, starts, max(int(inside[-1]), int(starts[-1]) + 1))


@dataclass(frozen=True)
class Pixels:
    """Pixels along an axis: pixel i, from edges[i] to edges[i + 1] on the scale, shows the points
    from starts[i].

    Its points end before the next start, those of the last pixel before `stop`.
    """

    axis: MapAxis
    edges: np.ndarray
    starts: np.ndarray
    stop: int

    @property
    def span(self):
        """The points that are shown."""
        return slice(int(self.starts[0]), self.stop)

    @property
    def ends(self):
        """The coordinates at which the pixels begin and end."""
        return tuple(self.axis.unscaled(self.edges[[0, -1]]).tolist())

    @property
    def middles(self):
        """The coordinates of their centres."""
        return self.axis.unscaled(0.5 * (self.edges[1:] + self.edges[:-1]))

    @property
    def points(self):
        """The largest number of points that a pixel shows."""
        return int(np.diff(self.starts, append=self.stop).max())


class Layer(VariablePoints):
    """One variable of a survey over two of its axes, for drawing; `others` is {other dimension:
    index}.

    `colours` is {kind: colour} of what a point may be.
    """

    def __init__(self, ds, name, dims, others):
        values, states = (
            ds[key]
            .isel({dim: at for dim, at in others.items() if dim in ds[key].dims})
            .transpose(*dims)
            for key in (name, "status")
        )
        super().__init__(values, states, scene_statuses(ds))
        palette = colours_of(self.flags) | greys_of(ds, self.flags)
        self.colours = {kind: palette.get(kind, UNKNOWN) for kind in (*self.flags, *self.statuses)}
        self.colours |= dict.fromkeys(NO_ANSWER, WHITE) | {UNREAD: BACKGROUND}
        self._limits = lru_cache(maxsize=1)(self._limits)

    @cached_property
    def overview(self):
        """The reduced map; that of a large one is complete only after calls of its `read`."""
        overview = Overview(self, (OVERVIEW, OVERVIEW))
        return overview if self.variable.size > DIRECT else overview.complete

    def waits(self, xs, ys):
        """Does this window, or do its colours, need more of the overview than has been read?"""
        return (_large(xs, ys) or not self.flagged) and self.overview.share < 1

    def pixels(self, xs, ys):
        """(mask, value), each (len(ys), len(xs)): the kinds that occur in each pixel; value None
        for flags.
        """
        if _large(xs, ys):
            fx, fy = self.overview.factors
            window = (
                slice(xs.span.start // fx, -(-xs.stop // fx)),
                slice(ys.span.start // fy, -(-ys.stop // fy)),
            )
            parts = [
                part if part is None else part[window]
                for part in (self.overview.mask, self.overview.rank)
            ]
        else:
            fx, fy, parts = 1, 1, self.read(xs.span, ys.span)
        starts = [pixels.starts // f - pixels.span.start // f for pixels, f in ((xs, fx), (ys, fy))]
        mask, rank = (
            part if part is None else over(union, part, *starts).T
            for union, part in zip(UNIONS, parts, strict=True)
        )
        return mask, rank if rank is None else unranked(rank)

    @property
    def limits(self):
        """The colour limits of the map, as far as it has been read."""
        return self._limits(self.overview.share)

    def _limits(self, share):
        rank = self.overview.rank
        starts = (np.arange(0, size, -(-size // LIMITS)) for size in rank.shape)
        shown = np.ma.masked_invalid(unranked(over(np.maximum, rank, *starts)))
        if shown.mask.all():
            return 0.0, 1.0
        found = colour_limits(shown) or {"vmin": shown.min(), "vmax": shown.max()}
        low, high = (float(found[key]) for key in ("vmin", "vmax"))
        margin = 0.0 if high > low else 0.5 * abs(low) or 0.5  # a single value: in the middle
        return low - margin, high + margin


def _large(xs, ys):
    """Is the window too large to be read from the file?"""
    return (xs.stop - xs.span.start) * (ys.stop - ys.span.start) > DIRECT


class CellLayer(Layer):
    """The verdicts of a refined map: those of its cells, each decided as a whole, not of its points."""

    def __init__(self, ds, name, dims, others):
        super().__init__(ds, name, dims, others)
        axes = [MapAxis(ds[dim].values) for dim in dims]
        self.ends = [
            [axis.scaled(ds[f"cell_{dim}_{end}"].values) for end in ("low", "high")]
            for axis, dim in zip(axes, dims, strict=True)
        ]
        self.codes = ds.cell_verdict.values
        self.flags = flag_codes(ds.cell_verdict.attrs)

    def pixels(self, xs, ys):
        """(mask, None): the kinds of the cells that overlap each pixel; of points only where they failed."""
        mask = super().pixels(xs, ys)[0] & sum(self.bits[kind] for kind in (*NO_ANSWER, UNREAD))
        x, y = (
            _covered(*ends, pixels.edges) for ends, pixels in zip(self.ends, (xs, ys), strict=True)
        )
        seen = (x[0] < x[1]) & (y[0] < y[1])
        for flag, code in self.flags.items():
            here = seen & (self.codes == code)
            # each cell adds 1 to its rectangle of pixels: by differences at the corners, summed
            # along both axes
            corners = np.zeros((ys.starts.size + 1, xs.starts.size + 1), np.int32)
            for i, j, sign in ((0, 0, 1), (0, 1, -1), (1, 0, -1), (1, 1, 1)):
                np.add.at(corners, (y[i][here], x[j][here]), sign)
            mask[corners.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0] |= self.bits[flag]
        return mask, None


def _covered(low, high, edges):
    """The pixels that the intervals overlap: the first, and the one after the last (equal if there
    is none).
    """
    position = [(end - edges[0]) / (edges[1] - edges[0]) for end in (low, high)]
    first, stop = np.floor(position[0]), np.ceil(position[1])
    return tuple(np.clip(end, 0, edges.size - 1).astype(int) for end in (first, stop))


def paint(mask, value, layer, limits=None):
    """(colours, {kind: number of pixels with it}): uint32 RGBA (rows, columns) of each pixel's kind
    or value.

    `limits` of the colours: by default the layer's own.
    """
    image = np.zeros((*mask.shape, 4), np.uint8)  # transparent where nothing is known
    if value is not None:
        low, high = layer.limits if limits is None else limits
        image[...] = viridis((value - low) / (high - low), bytes=True)
        image[np.isnan(value)] = _rgba(NOT_APPLY)
    kind, number = layer.shown(mask)
    for name in number:
        where = kind == layer.kinds.index(name)
        image[where] = _rgba(layer.colours[name])
        if name in NO_ANSWER:
            y, x = np.nonzero(where)
            lines = ((x + y) % HATCH == 0) | ((name == "failed") & ((x - y) % HATCH == 0))
            image[y[lines], x[lines]] = _rgba(LINE)
    return image.view(np.uint32)[..., 0], number


def _rgba(colour):
    return [*bytes.fromhex(colour[1:]), 255]
