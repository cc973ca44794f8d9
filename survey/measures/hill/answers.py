"""What is asked of the points of a Hill problem, and their answers as they come in."""

from dataclasses import dataclass

import numpy as np

from survey import status, waiting
from survey.kernels.hill import answers as kernels
from survey.measures import answers

NONE = np.zeros(0, np.int8)
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
    """`floats`, an array (N) for each of `kernels.hill.answers.FLOATS`, if wanted, and `bars` (float32),
    their error bounds, rounded up; and the `verdict`. Those that are in `out`, by name, are filled.

    `results` (N, RESULTS) is what they follow from, where all points were solved one by one.
    """

    results = None

    def __init__(self, size, asked, out=answers.NOTHING):
        super().__init__(size, ("verdict",), out)
        self.asked = asked
        sizes = [size if wanted else 0 for wanted in asked.wanted]
        self.floats, self.bars = (
            tuple(
                out[name + end] if name + end in out else np.empty(n, kind)
                for name, n in zip(kernels.FLOATS, sizes, strict=True)
            )
            for end, kind in (("", np.float64), ("_error", np.float32))
        )

    @property
    def rows(self):
        """See there."""
        kept = np.flatnonzero(self.asked.wanted)
        return [of[row] for of in (self.floats, self.bars) for row in kept]

    @property
    def found(self):
        """What kernels fill: values, bars, verdicts, and who has missed."""
        return self.floats, self.bars, self.verdict, self.missed

    def of(self, row):
        """What of this a kernel fills that answers one question alone."""
        return self.floats[row], self.bars[row], self.verdict, self.missed

    def assess(self, results, rule, squares=NO_SQUARES, first=0):
        """Answer the points from the `first` on, if their status is ok, from their results (n,
        RESULTS) and `squares` (see `measure`).
        """
        asked, own = self.asked, (*self.found, self.status)
        rule = NONE if rule is None else rule
        columns = np.ascontiguousarray(results.T)
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
