"""Symmetries in t of a linear periodic system, by which a half or a quarter of a piece of the
period is enough.

Of a piece from a to b, R and S diagonal matrices of signs:

    time reversal   R A(a + b - t) R = -A(t): the step over [a + b - t, a + b - s] has the propagator R F^-1 R, F that
                    of the step over [s, t]
    repetition      A(t + (b - a) / 2) = S A(t) S: the step half a piece later has S F S

Neither is tried on samples: both are read off the recorded operations (`trace`). A wave, the sine
or cosine of a line c t + d, keeps or changes its sign where c (a + b) + 2 d, or c (b - a) / 2, is a
multiple of pi; parity then passes on through sums, products, quotients and functions, and each term
of an entry says whether two signs are equal. The digits show a multiple of pi to within their
rounding alone; `phase_bars` bound how far off it may be, which counts as an error of A. What these rules
do not see, as waves whose sum alone is even, is integrated as it is.

Source: J. S. W. Lamb, J. A. G. Roberts, Physica D 112 (1998) 1.
"""

from dataclasses import dataclass

import numpy as np

from survey.kernels.floquet import program as pg
from survey.kernels.math.double import PI, split_error
from survey.kernels.math.roundoff import EPS

NEAR = 8 * EPS  # a multiple of pi, relative to 1 + the phase
ODD = frozenset({"sin", "tan", "asin", "atan", "sinh", "tanh", "asinh", "atanh", "erf"})
EVEN = frozenset({"cos", "cosh"})


@dataclass(frozen=True)
class Images:
    """How a piece follows from its beginning: the signs of the states in a reversal of time, and in
    a repetition, as bytes of -1 and 1, or None where there is none.
    """

    reversal: bytes | None = None
    repetition: bytes | None = None

    @property
    def parts(self):
        """The number of parts of equal length, the first of which is integrated."""
        return (1 if self.reversal is None else 2) * (1 if self.repetition is None else 2)

    def complete(self, F, error, doubt, first, count):
        """Fill the steps of the other parts of points, the first of whose first parts (count steps)
        are given.

        F (steps, n, n), error and doubt (steps) begin at `first` (N) for each point. Where time is
        reversed, the steps backwards are in the place of those of the next part, in the same order.
        """
        tasks = np.repeat(np.arange(len(count)), count)
        index = np.arange(tasks.size) - np.repeat(np.cumsum(count) - count, count)
        done = 1
        here = first[tasks] + index
        if self.reversal is not None:
            signs = _signs(self.reversal)
            if self.repetition is not None:  # about the middle of the first half
                signs = signs * _signs(self.repetition)
            back = first[tasks] + 2 * count[tasks] - 1 - index
            own = here + count[tasks]
            F[back] = F[own] * np.outer(signs, signs)
            error[back] = error[own]
            doubt[back] = doubt[own]
            done = 2
            here = np.concatenate([here, back])
            tasks = np.concatenate([tasks, tasks])
        if self.repetition is not None:
            signs = _signs(self.repetition)
            later = here + done * count[tasks]
            F[later] = F[here] * np.outer(signs, signs)
            error[later] = error[here]
            doubt[later] = doubt[here]


def _signs(given):
    return np.frombuffer(given, dtype=np.int8).astype(float)


class Waves:
    """The sines and cosines of lines c t + d among the basis functions of a Program, and what
    follows from them.

    `nodes` of the waves, `lines`: those of c and d among the numbers, or None for 1 and 0;
    `cosine`, or sine?
    """

    def __init__(self, program):
        self.program, series = program, program.graph.series
        self.nodes, self.lines, self.cosine, self.known = [], [], [], {}
        self.needed = program.needed(program.used)
        for node in self.needed:
            operation, *operands = series[node]
            if operation in ("sin", "cos") and program.is_line(operands[0]):
                line, *inside = series[operands[0]]
                terms = dict(inside[0]) if line == "combination" else {}
                self.nodes.append(node)
                self.lines.append((terms.get(pg.TIME), terms.get(pg.ONE)))
                self.cosine.append(operation == "cos")

    def found(self, n, numbers, low, high):
        """[(indices, Images, phase_bars)] of points, from values and error bounds of their numbers and
        the ends (N) of the piece; `phase_bars`: see `trace.Program.series`.
        """
        (values, errors), terms = numbers, self.program.terms[:, pg.NUMBER]
        given = np.zeros((2, 2, len(self.nodes), len(low)))  # c and d, values and error bounds
        given[0, 0] = 1.0
        for w, line in enumerate(self.lines):
            for which, number in enumerate(line):
                if number is not None:
                    given[which, :, w] = values[:, number], errors[:, number]
        with np.errstate(all="ignore"):
            turns, off = _multiples(*given, low, high)
            present = (values[:, terms] != 0.0) | (errors[:, terms] != 0.0)
        rows = np.concatenate([turns[0].T, turns[1].T, present], axis=1, dtype=np.int8)
        different = (rows != rows[:1]).any(axis=1)
        kinds = [(rows[0], np.flatnonzero(~different))]
        if different.any():
            others, which = np.unique(rows[different], axis=0, return_inverse=True)
            at = np.flatnonzero(different)
            kinds += [(row, at[which.ravel() == k]) for k, row in enumerate(others)]
        out = {}
        for row, own in kinds:
            out.setdefault(self._images(n, row), []).append(own)
        some = [(np.sort(np.concatenate(parts)), images) for images, parts in out.items()]
        return [(own, images, self._phase_bars(images, off[:, :, own])) for own, images in some]

    def _phase_bars(self, images, off):
        total = off[0] * (images.reversal is not None) + off[1] * (images.repetition is not None)
        # most often of all points: then what depends on t alone is still sampled once
        alike = (total == total[:, :1]).all(axis=1)
        return {node: total[w, : 1 if alike[w] else None, None] for w, node in enumerate(self.nodes)
                if images.parts > 1}  # fmt: skip

    def _images(self, n, row):
        """The Images where the waves' multiples of pi and the terms that are not 0 are those of the row."""
        key = n, row.tobytes()
        if key not in self.known:
            waves = len(self.nodes)
            back, later, present = row[:waves], row[waves : 2 * waves], row[2 * waves :]
            # sin(k pi - x) = -(-1)^k sin x
            back = [
                turn if cosine else -turn for turn, cosine in zip(back, self.cosine, strict=True)
            ]
            signs = [
                self._signs(n, turns, present, sign) for turns, sign in ((back, -1), (later, 1))
            ]
            self.known[key] = Images(*(None if one is None else one.tobytes() for one in signs))
        return self.known[key]

    def _signs(self, n, turns, present, sign):
        """Signs r (n) with r_i r_j A_ij(image of t) = `sign` A_ij(t), or None."""
        parity = self._parities(turns)
        allowed = np.ones((2, n, n), bool)
        for (basis, i, j, _number), counts in zip(
            self.program.terms.tolist(), present, strict=True
        ):
            if counts:
                allowed[0, i, j] &= parity[basis] == sign
                allowed[1, i, j] &= parity[basis] == -sign
        return alike_or_opposite(*allowed)

    def _parities(self, turns):
        """{node: 1, -1, or 0 where it is neither}: what the basis functions are times at the image of t."""
        known = dict(zip(self.nodes, (int(turn) for turn in turns), strict=True))
        for node in self.needed:
            if node in known:
                continue
            operation, *o = self.program.graph.series[node]
            if operation == "one":
                known[node] = 1
            elif operation == "combination":
                parts = {known[b] for b, _c in o[0]}
                known[node] = parts.pop() if len(parts) == 1 else 0
            elif operation in ("product", "quotient"):
                known[node] = known[o[0]] * known[o[1]]
            elif operation in ("time", "state"):
                known[node] = 0
            else:
                own = known[o[0]]
                known[node] = (
                    own if own >= 0 else -1 if operation in ODD else int(operation in EVEN)
                )
        return known


def _multiples(c, d, low, high):
    """(sign, off) (2, waves, N): (-1)^k and bounds of c (low + high) + 2 d - k pi, then of c (high
    - low) / 2 - k pi; 0 where it is not a multiple of pi.

    c and d (2, waves, N) are values and error bounds. Products and sums are taken in two parts,
    which is nearly exact.
    """
    ends = np.array([[high, 0.5 * high], [low, -0.5 * low]])[:, :, None]
    products = c[0] * ends
    lower = split_error(c[0], ends, products)
    twice = np.stack([2.0 * d[0], 0.0 * d[0]])
    k = np.rint((products[0] + products[1] + twice) / PI[0])
    turn = k * PI[0]
    total, rest = -turn, lower[0] + lower[1] - split_error(k, PI[0], turn) - k * PI[1]
    for part in (*products, twice):
        before, total = total, total + part
        taken = total - before
        rest = rest + ((before - (total - taken)) + (part - taken))
    size = abs(products[0]) + abs(products[1]) + abs(twice)
    given = c[1] * (abs(ends[0]) + abs(ends[1])) + np.stack([2.0 * d[1], 0.0 * d[1]])
    off = (abs(total + rest) + given) * (1 + 8 * EPS) + EPS * EPS * size
    good = off <= NEAR * (1.0 + size)
    return np.where(good, 1 - 2 * (k % 2), 0).astype(np.int8), np.where(good, off, 0.0)


def alike_or_opposite(alike, opposite):
    """Signs r (n) with r_i = r_j only where `alike` (n, n) is true, r_i = -r_j only where
    `opposite` is; or None.
    """
    n = len(alike)
    signs = np.zeros(n, np.int8)
    if not (alike | opposite).all():
        return None
    for first in range(n):
        waiting = [first] if not signs[first] else []
        signs[first] = signs[first] or 1
        while waiting:
            i = waiting.pop()
            for j in range(n):
                for same, other in ((alike[i, j], opposite[i, j]), (alike[j, i], opposite[j, i])):
                    if same and other:
                        continue
                    wanted = signs[i] if same else -signs[i]
                    if not signs[j]:
                        signs[j] = wanted
                        waiting.append(j)
                    if signs[j] != wanted:
                        return None
    return signs
