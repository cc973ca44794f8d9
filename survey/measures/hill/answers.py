"""What is asked of the points of a Hill problem, and their answers as they come in."""

from dataclasses import dataclass

import numpy as np

from survey import status, waiting
from survey.kernels.hill import answers as kernels
from survey.kernels.math.rounding import rounded_up
from survey.measures import answers

NONE = np.zeros(0, np.int8)
# A discriminant with a wider bar, relative to 1 + |D|, is ill conditioned.
ILL = 1e-11
NO_FLOATS, NO_BARS = np.zeros(0), np.zeros(0, np.float32)
NO_SQUARES = np.zeros((0, kernels.SQUARES))


@dataclass(frozen=True)
class Asked:
    """The accuracy asked for, |error| <= rtol (1 + |value|), of the columns `wanted` of `kernels.hill.answers.FLOATS`.

    Points of a row that come `together` share the steps of the one that needs most, and so the
    row's samples. Steps are chosen for `aim`, by default rtol. With `full_period` the results are
    those of the period, where z is not even. An open verdict misses the accuracy, unless none is
    asked for (`decides`).
    """

    rtol: float
    wanted: np.ndarray
    together: bool = False
    full_period: bool = False
    decides: bool = True
    aim: float | None = None


class Answers(answers.Answers):
    """`floats`, an array (N) for each of `kernels.hill.answers.FLOATS` (D, and what is wanted; else
    empty), and their error `bars`; and the `verdict`.

    Arrays that are in `out`, by name, are filled, with bounds rounded up; but bounds of D from which
    more follows are kept in float64.

    `results` (N, RESULTS) is what they follow from, where all points were solved one by one.
    """

    results = None

    def __init__(self, size, asked, out=answers.NOTHING):
        super().__init__(size, ("verdict",), out)
        self.asked = asked
        floats, bars, rounded = [], [], []
        wanted = asked.wanted.tolist()
        for row, name in enumerate(kernels.FLOATS):
            # a verdict alone may follow from D; an exponent from D and its bounds, and whether more
            # digits are asked for
            needed = wanted[row] or row == kernels.DISCRIMINANT
            kept = row == kernels.DISCRIMINANT and (wanted[kernels.EXPONENT] or asked.rtol < ILL)
            own, up = out.get(name), None if kept else out.get(f"{name}_error")
            floats.append(own if own is not None else np.empty(size) if needed else NO_FLOATS)
            bars.append(np.empty(size) if needed and up is None else NO_FLOATS)
            rounded.append(NO_BARS if up is None else up)
        self.floats, self._bars, self._rounded = tuple(floats), tuple(bars), tuple(rounded)

    def bars(self, row):
        """The error bounds of one of the floats, as they are kept."""
        return self._rounded[row] if self._rounded[row].size else self._bars[row]

    def _replace_floats(self, points, other, those):
        for row in np.flatnonzero(self.asked.wanted):
            self.floats[row][points] = other.floats[row][those]
            own, bars = self.bars(row), other.bars(row)[those]
            own[points] = bars if own.dtype == bars.dtype else rounded_up(bars)

    @property
    def found(self):
        """What kernels fill: values, bars, rounded ones, verdicts, and who has missed."""
        return self.floats, self._bars, self._rounded, self.verdict, self.missed

    def of(self, row):
        """What of this a kernel fills that answers one question alone."""
        return self.floats[row], self._bars[row], self._rounded[row], self.verdict, self.missed

    def assess(self, results, rule, squares=NO_SQUARES, first=0):
        """Answer the points from the `first` on, if their status is ok, from their results (n,
        RESULTS) and `squares` (see `measure`).
        """
        asked, own = self.asked, (*self.found, self.status)
        rule = NONE if rule is None else rule
        columns = np.ascontiguousarray(results.T)
        waiting.wait("measure")
        kernels.measure(
            first,
            columns,
            squares,
            rule,
            asked.wanted,
            asked.decides,
            asked.rtol,
            asked.full_period,
            status.OVERFLOW,
            *own,
        )
        if asked.wanted[kernels.EXPONENT :].any():
            waiting.wait("answers")
            kernels.transcendental(
                first, columns, squares, asked.wanted, asked.rtol, asked.full_period, *own
            )
