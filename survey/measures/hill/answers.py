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
    """`floats` (14, N): each of `kernels.hill.answers.FLOATS` and its error bound, if wanted; and
    the `verdict`.

    `results` (N, RESULTS) is what they follow from, where all points were solved one by one.
    """

    results = None

    def __init__(self, size, asked):
        super().__init__(
            size, 2 * len(kernels.FLOATS), ("verdict",), np.flatnonzero(np.repeat(asked.wanted, 2))
        )
        self.asked = asked

    def assess(self, results, rule, squares=NO_SQUARES, first=0):
        """Answer the points from the `first` on, if their status is ok, from their results (n,
        RESULTS) and `squares` (see `measure`).
        """
        asked, own = self.asked, (self.floats, self.verdict, self.missed, self.status)
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
        if asked.wanted[kernels.EXPONENT // 2 :].any():
            waiting.wait("answers")
            kernels.transcendental(
                first, columns, squares, asked.wanted, asked.rtol, asked.full_period, *own
            )
