"""A window of a map -> the pixels of a screen, reading no more than it must: maps of 10^8 points and more.

A pixel that holds many points tells of all of them, as in `survey.file.overview`; one that holds none shows the
nearest.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from matplotlib import colormaps

from survey.file.labels import flag_codes, unanswered
from survey.file.overview import NO_ANSWER, UNIONS, UNREAD, Overview, Points, over, unranked
from survey.grid import logarithmic
from survey.show.figures import colours_of, greys_of, limits

DIRECT = 2**22  # points: a smaller window is read from the file, a larger one from the overview
OVERVIEW = 4096  # cells along an axis of the overview, at most
LIMITS = 512  # cells along an axis from which the colours' limits are taken
WHITE, UNKNOWN, NOT_APPLY, LINE = "#FFFFFF", "#444444", "#DDDDDD", "#777777"
BACKGROUND = "#F4F4F4"
HATCH = 6  # pixels from line to line
viridis = colormaps["viridis"]


class MapAxis:
    """One axis of the map: its increasing coordinates, on the scale in which they are drawn.

    `values` (n,), `log`: is the scale logarithmic; `cells` (n + 1,): where each point's cell ends, on the scale.
    """

    def __init__(self, values):
        self.values = np.asarray(values, dtype=float)
        self.log = logarithmic(self.values)
        self.centres = self.scaled(self.values)
        middles = 0.5 * (self.centres[1:] + self.centres[:-1])
        half = 0.5 * np.diff(self.centres)[[0, -1]] if middles.size else np.full(2, 0.5)
        self.cells = np.concatenate([[self.centres[0] - half[0]], middles, [self.centres[-1] + half[1]]])

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
    def range_text(self):
        """Its range, for a message."""
        return f"{self.values[0]:g} to {self.values[-1]:g}"

    def nearest(self, value):
        """Place of the point in whose cell `value` lies; None outside the map."""
        if self.log and value <= 0:
            return None
        place = int(np.searchsorted(self.cells, self.scaled(value), side="right")) - 1
        return place if 0 <= place < self.values.size else None

    def pixels(self, low, high, number):
        """The window [low, high] within the map as `Pixels` of a screen with `number` in it; None if all is outside."""
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
        near = np.clip(np.searchsorted(self.cells, middles, side="right") - 1, 0, self.values.size - 1)
        starts = np.where(inside[1:] > inside[:-1], inside[:-1], near)
        return Pixels(self, edges, starts, max(int(inside[-1]), int(starts[-1]) + 1))


@dataclass(frozen=True)
class Pixels:
    """Pixels along an axis: pixel i, from edges[i] to edges[i + 1] on the scale, shows the points from starts[i].

    They go to the next start, or the last to `stop`.
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
        """The coordinates of their middles."""
        return self.axis.unscaled(0.5 * (self.edges[1:] + self.edges[:-1]))

    @property
    def points(self):
        """How many points a pixel shows, at most."""
        return int(np.diff(self.starts, append=self.stop).max())


class Layer(Points):
    """One variable of a survey over two of its axes, for drawing; `place` is {other dimension: place in it}.

    `colours` is {kind: colour} of what a point may be.
    """

    def __init__(self, ds, name, dims, place):
        own, state = ({dim: at for dim, at in place.items() if dim in ds[key].dims} for key in (name, "status"))
        values, states = ds[name].isel(own).transpose(*dims), ds.status.isel(state).transpose(*dims)
        super().__init__(values, states, unanswered(ds))
        palette = colours_of(self.flags) | greys_of(ds, self.flags)
        self.colours = {kind: palette.get(kind, UNKNOWN) for kind in (*self.flags, *self.own)}
        self.colours |= dict.fromkeys(NO_ANSWER, WHITE) | {UNREAD: BACKGROUND}
        self._limits = lru_cache(maxsize=1)(self._limits)

    @cached_property
    def overview(self):
        """The whole map, reduced: a large one as far as `read` was called of it."""
        overview = Overview(self, (OVERVIEW, OVERVIEW))
        return overview if self.variable.size > DIRECT else overview.complete

    def waits(self, xs, ys):
        """Does this window, or its colours, need more of the overview than is read?"""
        return (_large(xs, ys) or not self.flagged) and self.overview.share < 1

    def pixels(self, xs, ys):
        """(mask, value), each (len(ys), len(xs)): kinds that occur in each pixel; value None for a flagged variable."""
        if _large(xs, ys):
            fx, fy = self.overview.factors
            own = slice(xs.span.start // fx, -(-xs.stop // fx)), slice(ys.span.start // fy, -(-ys.stop // fy))
            parts = [part if part is None else part[own] for part in (self.overview.mask, self.overview.rank)]
        else:
            fx, fy, parts = 1, 1, self.read(xs.span, ys.span)
        starts = [pixels.starts // f - pixels.span.start // f for pixels, f in ((xs, fx), (ys, fy))]
        mask, rank = (
            part if part is None else over(union, part, *starts).T for union, part in zip(UNIONS, parts, strict=True)
        )
        return mask, rank if rank is None else unranked(rank)

    @property
    def limits(self):
        """The values between which the whole map, as far as it is read, is coloured."""
        return self._limits(self.overview.share)

    def _limits(self, share):
        rank = self.overview.rank
        starts = (np.arange(0, size, -(-size // LIMITS)) for size in rank.shape)
        shown = np.ma.masked_invalid(unranked(over(np.maximum, rank, *starts)))
        if shown.mask.all():
            return 0.0, 1.0
        found = limits(shown) or {"vmin": shown.min(), "vmax": shown.max()}
        low, high = (float(found[key]) for key in ("vmin", "vmax"))
        spare = 0.0 if high > low else 0.5 * abs(low) or 0.5  # one value: in the middle
        return low - spare, high + spare


def _large(xs, ys):
    """Is the window too large to be read from the file?"""
    return (xs.stop - xs.span.start) * (ys.stop - ys.span.start) > DIRECT


class CellLayer(Layer):
    """The verdicts of a refined map: of its cells, each of which is decided as a whole, and not of its points."""

    def __init__(self, ds, name, dims, place):
        super().__init__(ds, name, dims, place)
        axes = [MapAxis(ds[dim].values) for dim in dims]
        self.ends = [
            [axis.scaled(ds[f"cell_{dim}_{end}"].values) for end in ("low", "high")]
            for axis, dim in zip(axes, dims, strict=True)
        ]
        self.codes = ds.cell_verdict.values
        self.flags = flag_codes(ds.cell_verdict.attrs)

    def pixels(self, xs, ys):
        """(mask, None): the kinds of the cells that reach into each pixel; points count where they failed."""
        mask = super().pixels(xs, ys)[0] & sum(self.bits[kind] for kind in (*NO_ANSWER, UNREAD))
        x, y = (_covered(*ends, pixels.edges) for ends, pixels in zip(self.ends, (xs, ys), strict=True))
        seen = (x[0] < x[1]) & (y[0] < y[1])
        for flag, code in self.flags.items():
            own = seen & (self.codes == code)
            # each cell adds 1 to its rectangle of pixels: differences at the corners, summed along both axes
            corners = np.zeros((ys.starts.size + 1, xs.starts.size + 1), np.int32)
            for i, j, sign in ((0, 0, 1), (0, 1, -1), (1, 0, -1), (1, 1, 1)):
                np.add.at(corners, (y[i][own], x[j][own]), sign)
            mask[corners.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0] |= self.bits[flag]
        return mask, None


def _covered(low, high, edges):
    """The pixels that the intervals reach into: the first, and the one after the last (the same if there is none)."""
    place = [(end - edges[0]) / (edges[1] - edges[0]) for end in (low, high)]
    first, stop = np.floor(place[0]), np.ceil(place[1])
    return tuple(np.clip(end, 0, edges.size - 1).astype(int) for end in (first, stop))


def paint(mask, value, layer):
    """(colours, {kind: number of pixels that hold it}): (rows, columns) of uint32 RGBA, each pixel's kind or value."""
    image = np.zeros((*mask.shape, 4), np.uint8)  # where nothing is known, nothing is drawn
    if value is not None:
        low, high = layer.limits
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
