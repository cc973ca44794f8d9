"""A map reduced to the cells of a picture without losing a point: maps of 10^8 points and more,
read piece by piece.

A cell represents all of its points: for a flag variable by the set of the flags that occur, so that
one undecided point among thousands is seen; for numbers by the value largest in magnitude.
"""

from functools import cached_property

import numpy as np

from survey import status
from survey.errors import Damaged
from survey.file.labels import fill_of, flag_codes

NO_ANSWER = ("outside the domain", "failed")
UNREAD = "not read yet"
# kinds shown in preference to all others, the last above all
PRECEDENCE = ("undecided", *NO_ANSWER, UNREAD)
MASKS = np.uint8, np.uint16, np.uint32
UNIONS = np.bitwise_or, np.maximum  # of masks, of ranks
PIECE = 2**22  # points that are read at once, at most
STRIDE = 8  # rounds in which pieces are read; each round spans the map


class VariablePoints:
    """One variable of a survey over two of its axes, and its status `state`: DataArrays, possibly
    lazy.

    `kinds` names what a point may be: the variable's flags, if it has any, the scene's own statuses
    (`statuses`, {name: code}), then the other reasons why it has no value. Bit i of a mask means
    that the i-th of them occurs. Of numbers, statuses are told apart only `with_statuses`: they
    hide the values in their cell.
    """

    def __init__(self, variable, state, statuses, with_statuses=False):
        self.variable, self.status, self.shape = variable, state, variable.shape
        self.flagged = "flag_values" in variable.attrs
        self.flags = flag_codes(variable.attrs) if self.flagged else {}
        self.fill = np.nan if self.flagged or fill_of(variable) is None else fill_of(variable)
        wanted = "undecided" in self.flags or (with_statuses and not self.flagged)
        self.statuses = statuses if wanted else {}
        self.kinds = [*self.flags, *self.statuses, *NO_ANSWER, UNREAD]
        self.dtype = next(
            (dtype for dtype in MASKS if len(self.kinds) <= np.iinfo(dtype).bits), None
        )
        if self.dtype is None:
            raise Damaged(
                f"{variable.name}: there are {len(self.kinds)} kinds of points, more than a map can show"
            )
        self.bits = {kind: self.dtype(1 << i) for i, kind in enumerate(self.kinds)}
        self._of_code, self._of_status, self._of_open = np.zeros((3, 256), self.dtype)
        for flag, code in self.flags.items():
            self._of_code[np.int8(code).view(np.uint8)] = self.bits[flag]
        for code in status.FAILURES:
            self._of_status[code] = self.bits["failed"]
        self._of_status[status.INVALID_PARAMETERS] = self.bits["outside the domain"]
        self._of_open[:] = self.bits.get("undecided", 0)  # for points without a verdict, by status
        for name, code in self.statuses.items():
            self._of_open[code] = self.bits[name]

    def read(self, rows, columns):
        """(mask, rank) of points; the rank, which encodes a value, is None for a flag variable."""
        state, array = self.status[rows, columns].values, self.variable[rows, columns].values
        mask = (
            self._of_status[state.view(np.uint8)]
            if state.any()
            else np.zeros(state.shape, self.dtype)
        )
        if self.flagged:
            flags = self._of_code[array.astype(np.int8, copy=False).view(np.uint8)]
            if self.statuses and state.any():
                flags = np.where(
                    flags == self._of_open[0], self._of_open[state.view(np.uint8)], flags
                )
            return np.where(mask == 0, flags, mask) if state.any() else flags, None
        value = array.astype(np.float32)
        if self.statuses and state.any():
            without = (mask == 0) & ((array == self.fill) | ~np.isfinite(value))
            mask = np.where(without, self._of_open[state.view(np.uint8)], mask)
        value[(mask != 0) | (array == self.fill) | ~np.isfinite(value)] = np.nan
        return mask, _ranked(value)

    def shown(self, mask):
        """The kind that each cell shows, as its index in `kinds` (-1: none), and {kind: number of
        cells with it}.

        A cell shows the rarest kind that it contains, but undecided, outside and failed in
        preference to all others. The numbers are in the order in which each kind hides those before
        it.
        """
        number = {kind: int(np.count_nonzero(mask & bit)) for kind, bit in self.bits.items()}
        order = sorted(
            number,
            key=lambda kind: (
                PRECEDENCE.index(kind) + 1 if kind in PRECEDENCE else 0,
                -number[kind],
            ),
        )
        number = {kind: number[kind] for kind in order if number[kind]}
        kind = np.full(mask.shape, -1, np.int8)
        for name in number:
            kind[(mask & self.bits[name]) != 0] = self.kinds.index(name)
        return kind, number

    def cells(self, overview):
        """(values, statuses) of the cells, as if each were one point with the kind or the value
        that it shows.
        """
        kind, _ = self.shown(overview.mask)
        codes = [*[status.OK] * len(self.flags), *self.statuses.values()]
        state = np.array(
            [*codes, status.INVALID_PARAMETERS, status.NO_CONVERGENCE, status.OK], np.int8
        )[kind]
        if not self.flagged:
            return unranked(overview.rank), state
        other = self.flags.get("undecided", min(self.flags.values()))
        codes = np.array(
            [*self.flags.values(), *[other] * (len(self.kinds) - len(self.flags))], np.int8
        )
        return codes[kind], state


class Overview:
    """All of `points`, reduced by integer factors to at most `cells` (number along each axis).

    It is complete after some calls of `read`; until then the kinds of an incomplete cell include
    UNREAD. `number` counts the points of each kind that have been read.
    """

    def __init__(self, points, cells):
        self.points, shape = points, points.shape
        self.factors = tuple(-(-size // most) for size, most in zip(shape, cells, strict=True))
        self.starts = [
            np.arange(0, size, factor) for size, factor in zip(shape, self.factors, strict=True)
        ]
        size = tuple(starts.size for starts in self.starts)
        self.mask = np.full(size, points.bits[UNREAD])
        self.rank = None if points.flagged else np.zeros(size, np.uint32)
        self.number = dict.fromkeys(points.kinds, 0)
        self._left = np.diff(self.starts[0], append=shape[0])  # rows of points of each row of cells
        rows = (points.variable.encoding.get("chunksizes") or (256,))[0]
        rows = min(rows, max(1, PIECE // shape[1]))
        pieces = [slice(first, min(first + rows, shape[0])) for first in range(0, shape[0], rows)]
        self._pieces = [piece for i in range(STRIDE) for piece in pieces[i::STRIDE]][::-1]
        self._total = len(pieces)

    @property
    def share(self):
        """The fraction of the map that has been read."""
        return 1.0 - len(self._pieces) / self._total

    def read(self):
        """Read one more piece, some rows of the file's tiles; False if none was left."""
        if not self._pieces:
            return False
        rows = self._pieces.pop()
        mask, rank = self.points.read(rows, slice(None))
        # the first may have begun in earlier rows
        groups = np.arange(rows.start, rows.stop) // self.factors[0]
        at = np.flatnonzero(np.diff(groups, prepend=-1))
        here = slice(groups[0], groups[-1] + 1)
        for union, into, part in zip(UNIONS, (self.mask, self.rank), (mask, rank), strict=True):
            if part is not None:
                union(into[here], over(union, part, at, self.starts[1]), out=into[here])
        self._left[here] -= np.diff(at, append=groups.size)
        self.mask[here][self._left[here] == 0] &= ~self.points.bits[UNREAD]
        for kind, bit in self.points.bits.items():
            if np.bitwise_or.reduce(self.mask[here], axis=None) & bit:
                self.number[kind] += int(np.count_nonzero(mask & bit))
        return True

    @cached_property
    def complete(self):
        """This overview, after reading all of the map."""
        while self.read():
            pass
        return self


def over(union, part, x, y):
    """The union over each block that begins at one of the rows x and columns y."""
    for axis, starts in enumerate((x, y)):
        if not (starts.size == part.shape[axis] == starts[-1] + 1):  # else one point each
            part = union.reduceat(part, starts, axis=axis)
    return part


def _ranked(value):
    """float32 -> uint32 in the order of magnitude, one-to-one, NaN -> 0: so the maximum ignores the sign."""
    bits = value.view(np.uint32)
    return np.where(np.isnan(value), np.uint32(0), (bits << 1 | bits >> 31) + np.uint32(1))


def unranked(rank):
    """The values that ranks stand for."""
    bits = rank - np.uint32(1)
    value = (bits >> 1 | bits << 31).view(np.float32)
    return np.where(rank == 0, np.float32(np.nan), value)
