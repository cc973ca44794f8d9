"""A window of a map -> the pixels of a screen, reading no more than it must: maps of 10^8 points and more.

A pixel that holds many points tells of all of them: of a flagged variable, the set of the flags that occur, so that
one undecided point among thousands is seen; of numbers, the largest magnitude. A pixel that holds none shows the
nearest point.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from matplotlib import colormaps

from survey import status
from survey.dataset import fill_of, flag_codes, unanswered
from survey.figures import colours_of, greys_of, limits
from survey.grid import logarithmic

DIRECT = 2**22  # points: a smaller window is read from the file, a larger one from the overview
OVERVIEW = 4096  # cells along an axis of the overview, at most
LIMITS = 512  # cells along an axis from which the colours' limits are taken
WHITE, UNKNOWN, NOT_APPLY, LINE = "#FFFFFF", "#444444", "#DDDDDD", "#777777"
NO_ANSWER = ("outside the domain", "failed")
HATCH = 6  # pixels from line to line
UNIONS = np.bitwise_or, np.maximum  # of masks, of ranks
viridis = colormaps["viridis"]


class Axis:
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
    def told(self):
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

    axis: Axis
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


class Layer:
    """One variable of a survey over two of its axes, for drawing; `place` is {other dimension: place in it}.

    `kinds` is {name: colour} of what a point may be: its flags, if it has any, and last why it has no answer, by nature
    (grey) or not. Bit i of a mask says that the i-th of them occurs in a pixel.
    """

    def __init__(self, ds, name, dims, place):
        own, state = ({dim: at for dim, at in place.items() if dim in ds[key].dims} for key in (name, "status"))
        self.variable = ds[name].isel(own).transpose(*dims)
        self.status = ds.status.isel(state).transpose(*dims)
        self.flagged = "flag_values" in self.variable.attrs
        self.fill = np.nan if self.flagged or fill_of(self.variable) is None else fill_of(self.variable)
        flags = flag_codes(self.variable.attrs) if self.flagged else {}
        palette = colours_of(flags)
        self.grey = greys_of(ds, flags)
        self.kinds = {flag: palette.get(flag, UNKNOWN) for flag in flags} | self.grey | dict.fromkeys(NO_ANSWER, WHITE)
        self.dtype = np.uint16 if len(self.kinds) <= 16 else np.uint32
        self.bits = {kind: self.dtype(1 << i) for i, kind in enumerate(self.kinds)}
        self._of_code, self._of_status, self._of_open = np.zeros((3, 256), self.dtype)
        for flag, code in flags.items():
            self._of_code[np.int8(code).view(np.uint8)] = self.bits[flag]
        for code in status.FAILURES:
            self._of_status[code] = self.bits["failed"]
        self._of_status[status.INVALID_PARAMETERS] = self.bits["outside the domain"]
        self._of_open[:] = self.bits.get("undecided", 0)  # of points without a verdict, by status
        for name in self.grey:
            self._of_open[unanswered(ds)[name]] = self.bits[name]

    def pixels(self, xs, ys):
        """(mask, value), each (len(ys), len(xs)): kinds that occur in each pixel; value None for a flagged variable."""
        x, y, fx, fy = xs.span, ys.span, 1, 1
        if (x.stop - x.start) * (y.stop - y.start) <= DIRECT:
            parts = self._read(x, y)
        else:
            parts, fx, fy = self._overview
            own = slice(x.start // fx, -(-x.stop // fx)), slice(y.start // fy, -(-y.stop // fy))
            parts = [part if part is None else part[own] for part in parts]
        starts = (pixels.starts // f - pixels.span.start // f for pixels, f in ((xs, fx), (ys, fy)))
        mask, rank = _reduced(parts, *starts)
        return mask.T, rank if rank is None else _unranked(rank.T)

    def _read(self, rows, columns):
        """(mask, rank) of points; the rank, which stands for a value, is None for a flagged variable."""
        state, array = self.status[rows, columns].values, self.variable[rows, columns].values
        mask = self._of_status[state.view(np.uint8)]
        if self.flagged:
            flags = self._of_code[array.astype(np.int8, copy=False).view(np.uint8)]
            if self.grey:
                flags = np.where(flags == self._of_open[0], self._of_open[state.view(np.uint8)], flags)
            return np.where(mask == 0, flags, mask), None
        value = array.astype(np.float32)
        value[(mask != 0) | (array == self.fill) | ~np.isfinite(value)] = np.nan
        return mask, _ranked(value)

    @property
    def ready(self):
        """Is the whole map read, or small?"""
        return self.variable.size <= DIRECT or "_overview" in self.__dict__

    @cached_property
    def limits(self):
        """The values between which the whole map is coloured."""
        rank = self._overview[0][1]
        starts = (np.arange(0, size, -(-size // LIMITS)) for size in rank.shape)
        shown = np.ma.masked_invalid(_unranked(_blocks(np.maximum, rank, *starts)))
        found = limits(shown) or {"vmin": shown.min(), "vmax": shown.max()}
        return (0.0, 1.0) if shown.mask.all() else (float(found["vmin"]), float(found["vmax"]))

    @cached_property
    def _overview(self):
        """((mask, rank), fx, fy): the whole map reduced by whole factors; read once, by rows of the file's tiles."""
        shape = self.variable.shape
        fx, fy = (-(-size // OVERVIEW) for size in shape)
        small, columns = (-(-shape[0] // fx), -(-shape[1] // fy)), np.arange(0, shape[1], fy)
        whole = np.zeros(small, self.dtype), None if self.flagged else np.zeros(small, np.uint32)
        step = (self.variable.encoding.get("chunksizes") or (256,))[0]
        for first in range(0, shape[0], step):
            stop = min(first + step, shape[0])
            groups = np.arange(first, stop) // fx  # the first of them may have begun in the rows before
            parts = _reduced(
                self._read(slice(first, stop), slice(None)), np.flatnonzero(np.diff(groups, prepend=-1)), columns
            )
            for union, into, part in zip(UNIONS, whole, parts, strict=True):
                if part is not None:
                    own = into[groups[0] : groups[-1] + 1]
                    union(own, part, out=own)
        return whole, fx, fy


class CellLayer(Layer):
    """The verdicts of a refined map: of its cells, each of which is decided as a whole, and not of its points."""

    def __init__(self, ds, name, dims, place):
        super().__init__(ds, name, dims, place)
        axes = [Axis(ds[dim].values) for dim in dims]
        self.ends = [
            [axis.scaled(ds[f"cell_{dim}_{end}"].values) for end in ("low", "high")]
            for axis, dim in zip(axes, dims, strict=True)
        ]
        self.codes = ds.cell_verdict.values
        self.flags = flag_codes(ds.cell_verdict.attrs)

    def pixels(self, xs, ys):
        """(mask, None): the kinds of the cells that reach into each pixel; points count where they failed."""
        mask = super().pixels(xs, ys)[0] & sum(self.bits[kind] for kind in NO_ANSWER)
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


def rarest(mask, layer):
    """{kind: number of pixels that hold it}, the rarest last, but undecided, outside and failed after all others."""
    number = {kind: int(np.count_nonzero(mask & bit)) for kind, bit in layer.bits.items()}
    late = ("undecided", *NO_ANSWER)
    order = sorted(number, key=lambda kind: (late.index(kind) + 1 if kind in late else 0, -number[kind]))
    return {kind: number[kind] for kind in order if number[kind]}


def paint(mask, value, layer):
    """The pixels' colours, (rows, columns) of uint32 RGBA: each pixel's rarest kind, or its value."""
    image = np.zeros((*mask.shape, 4), np.uint8)  # where nothing is known, nothing is drawn
    if value is not None:
        low, high = layer.limits
        image[...] = viridis((value - low) / ((high - low) or 1.0), bytes=True)
        image[np.isnan(value)] = _rgba(NOT_APPLY)
    for kind in rarest(mask, layer):
        where = (mask & layer.bits[kind]) != 0
        image[where] = _rgba(layer.kinds[kind])
        if kind in NO_ANSWER:
            y, x = np.nonzero(where)
            lines = ((x + y) % HATCH == 0) | ((kind == "failed") & ((x - y) % HATCH == 0))
            image[y[lines], x[lines]] = _rgba(LINE)
    return image.view(np.uint32)[..., 0]


def _rgba(colour):
    return [*bytes.fromhex(colour[1:]), 255]


def _reduced(parts, x, y):
    """The mask and the rank (or None) over the blocks of points that begin at rows x and columns y."""
    return [part if part is None else _blocks(union, part, x, y) for union, part in zip(UNIONS, parts, strict=True)]


def _blocks(union, part, x, y):
    for axis, starts in enumerate((x, y)):
        if not (starts.size == part.shape[axis] == starts[-1] + 1):  # else one point each
            part = union.reduceat(part, starts, axis=axis)
    return part


def _ranked(value):
    """float32 -> uint32 in the order of magnitude, one-to-one, NaN -> 0: the largest is found without its sign."""
    bits = value.view(np.uint32)
    return np.where(np.isnan(value), np.uint32(0), (bits << 1 | bits >> 31) + np.uint32(1))


def _unranked(rank):
    """The inverse of `_ranked`."""
    bits = rank - np.uint32(1)
    value = (bits >> 1 | bits << 31).view(np.float32)
    return np.where(rank == 0, np.float32(np.nan), value)
