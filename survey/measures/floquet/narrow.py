"""Curves that no function of `bifurcations` shows, from numbers that are counted: of tongues that a
lattice does not see, and of closed ones, from the Maslov index; where two multipliers, or two
pairs, pass the unit circle together, as those of two equal oscillators do, from the number outside.

On both sides of a tongue that is narrower than the cells of the lattice a function of
`bifurcations` has the same sign, and no curve is found; but where its two edges count the same way,
the index has changed by 2. Segments between points of the lattice along which curves do not explain
how it changes are halved, by the index in between, until each of them is short. A closed tongue, or
one that is narrower still, keeps both edges in one segment, and is drawn by two curves at the same
position. Points on neighbouring lines of the lattice belong to one curve where the index takes the
same step. Where two multipliers pass together, a function touches zero without a change of sign,
and the number outside the circle changes by twice as many.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from survey.measures.floquet import row_count
from survey.measures.floquet.multipliers import UNDECIDED
from survey.measures.segments import UNKNOWN, cut, halves, segments

SHORT = 1e-9  # of the map: segments that are not cut any more
SURE = 1e-6  # half the longest one that is drawn
ZERO = 1e-3  # the largest value, of at most 1, of a function that is 0 there
CUTS = 40
ASIDE = 2.0  # cells: how far a curve may go from line to line


@dataclass
class _Segments:
    """Parts, between `ends` (S, 2), of the lattice's lines `line` (S), at whose ends the index is
    `index` (S, 2).
    """

    line: np.ndarray
    ends: np.ndarray
    index: np.ndarray

    def __getitem__(self, some):
        return _Segments(self.line[some], self.ends[some], self.index[some])

    def joined(self, others):
        """These and the others."""
        parts = (
            (getattr(one, name) for one in (self, *others)) for name in ("line", "ends", "index")
        )
        return _Segments(*(np.concatenate(list(part)) for part in parts))

    def cut(self, at, index):
        """Those of both halves along which the index changes."""
        return [
            _Segments(self.line[some], ends, values)
            for ends, values, some in halves(self.ends, self.index, at, index)
        ]


def curves(index, function, passed, kind, drawn):
    """[(positions (m, 2), errors (m))] of curves of `kind` that are missing among those `drawn`
    [(kind, positions)].

    `index(positions (N, 2))` is the index, `passed` (n, n) its values on the lattice, and
    `function(positions)` that of `bifurcations` with its bounds, which is 0 on the curves.
    """

    def passes(x):  # the index of a system that jumps does so without a passage
        return abs(function(x)[0]) <= ZERO

    own = [one for one in drawn if one[0] == kind]
    pieces = _missing(index, passes, passed, own, {}, lambda x: np.full(len(x), kind))
    return [piece[:2] for piece in pieces]


def counted(outside, kinds_of, counts, drawn):
    """[(kind, positions (m, 2), errors (m), how many may pass together)] of all curves that are
    missing among those `drawn` [(kind, positions)].

    `outside(positions (N, 2))` is the number of multipliers outside the unit circle, `counts`
    (n, n) its values on the lattice, both UNKNOWN where it is not certain, and `kinds_of(positions)`
    the kinds (N) of curves there, or UNDECIDED, where there are none. A curve that several
    multipliers pass together is found once.
    """
    weights = row_count.WEIGHTS
    found = _missing(outside, None, counts, list(drawn), weights, kinds_of, together=True)
    return [(kind, x, error, number) for x, error, kind, number in found]


def _missing(index, passes, passed, own, weights, kinds_of, together=False):
    """[(positions (m, 2), errors (m), kind, number)] of curves that are missing among its `own`
    [(kind, positions)], to which they are added `number` times, once for each step of the index if
    all are one curve, `together`.
    """
    found = []
    ticks = np.linspace(0.0, 1.0, len(passed))
    lost = _unexplained(passed, own, weights)
    for axis, _number in Counter(axis for axis, *_ in lost).most_common():
        lines = passed if axis == 1 else passed.T
        if found:  # along the one axis, which explains most of the other
            lost = _unexplained(passed, own, weights)
        where = np.array([segment[1:] for segment in lost if segment[0] == axis], int).reshape(
            -1, 3
        )
        segments = _Segments(where[:, 0], ticks[where[:, 1:]], lines[where[:, :1], where[:, 1:]])
        segments = _shortened(index, segments, axis, ticks)
        if not segments.line.size:
            continue
        if passes:
            segments = segments[passes(_positions(segments, axis, ticks))]
        segments = segments[np.diff(segments.ends)[:, 0] <= 2 * SURE]
        if not segments.line.size:
            continue
        kinds = kinds_of(_positions(segments, axis, ticks))
        segments, kinds = segments[kinds != UNDECIDED], kinds[kinds != UNDECIDED]
        for x, error, kind, number in _linked(segments, kinds, axis, ticks, together):
            found.append((x, error, kind, number))
            own += [(kind, x)] * number
    return found


def _unexplained(passed, own, weights):
    """The segments along which the index changes otherwise; the border's too, where no curve counts
    that ends there.
    """
    return [
        segment
        for segment, explained in segments(passed, own, weights, border=0).items()
        if not explained
    ]


def _shortened(index, segments, axis, ticks):
    """The segments, cut until they are short, or as far as the index is known in them."""
    done = []
    for _ in range(CUTS):
        long = segments.ends[:, 1] - segments.ends[:, 0] > SHORT
        done.append(segments[~long])
        segments = segments[long]
        if not segments.line.size:
            break

        def index_at(some, at, line=segments.line):
            x = np.stack([at, ticks[line[some]]], axis=1)
            return index(x if axis == 0 else x[:, ::-1])

        at, value = cut(index_at, segments.ends)
        known = value != UNKNOWN
        done.append(segments[~known])
        near, far = segments[known].cut(at[known], value[known])
        segments = near.joined([far])
    return segments.joined(done)


def _positions(segments, axis, ticks):
    """The middles (S, 2) of the segments."""
    x = np.stack([segments.ends.mean(axis=1), ticks[segments.line]], axis=1)
    return x if axis == 0 else x[:, ::-1]


def _linked(segments, kinds, axis, ticks, together):
    """[(positions (m, 2), errors (m), kind, number)] of points of one of the `kinds` (S) on
    neighbouring lines at which the index takes the same step, or all its steps `together`.
    """
    middle = segments.ends.mean(axis=1)
    error = 0.5 * np.diff(segments.ends)[:, 0]
    low = segments.index.min(axis=1)
    number = abs(np.diff(segments.index))[:, 0]
    if together:
        line, step = segments.line, np.zeros_like(number)
    else:
        k = np.repeat(np.arange(len(number)), number)
        step = low[k] + np.arange(k.size) - np.repeat(np.cumsum(number) - number, number)
        line, middle, error, kinds = segments.line[k], middle[k], error[k], kinds[k]
        number = np.ones_like(k)
    pieces = []
    for i in np.lexsort((middle, line)):
        lasts = [(piece, piece[-1]) for piece in pieces]
        near = [piece for piece, last in lasts if line[last] == line[i] - 1 and step[last] == step[i]
                and kinds[last] == kinds[i] and abs(middle[last] - middle[i]) <= ASIDE * ticks[1]]  # fmt: skip
        if near:
            min(near, key=lambda piece: abs(middle[piece[-1]] - middle[i])).append(i)
        else:
            pieces.append([i])
    pieces = [piece for piece in pieces if len(piece) > 1]
    points_of = [np.stack([middle[piece], ticks[line[piece]]], axis=1) for piece in pieces]
    return [
        (
            x if axis == 0 else x[:, ::-1].copy(),
            error[piece],
            int(kinds[piece[0]]),
            int(number[piece].max()),
        )
        for x, piece in zip(points_of, pieces, strict=True)
    ]
