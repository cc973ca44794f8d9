"""What is asked of the points of a Hill problem, and their answers as they come in."""

from dataclasses import dataclass

import numpy as np

from survey import status
from survey.kernels.hill import answers as kernels
from survey.kernels.jit import wait_for_ahead

NONE = np.zeros(0, np.int8)
NO_SQUARES = np.zeros((0, 4))


@dataclass(frozen=True)
class Asked:
    """The accuracy asked for, |error| <= rtol (1 + |value|), of the columns `wanted` of `kernels.hill.answers.FLOATS`.

    Points of a row that come `together` share the steps of the one that needs most, and so the row's samples. With
    `whole` the results are those of the whole period, where z is not even.
    """

    rtol: float
    wanted: np.ndarray
    together: bool = False
    whole: bool = False


class Answers:
    """`floats` (14, N; the wanted columns), `verdict`, `status`, and who is `late`: bars too wide."""

    def __init__(self, size, asked):
        self.asked, self.columns = asked, np.flatnonzero(np.repeat(asked.wanted, 2))
        self.floats = np.empty((2 * len(kernels.FLOATS), size))
        self.verdict = np.full(size, kernels.UNDECIDED, np.int8)
        self.status = np.zeros(size, np.int8)
        self.late = np.zeros(size, np.bool_)

    def judge(self, results, rule, squares=NO_SQUARES):
        """Answer every point whose status is ok from its results (N, 10) and `squares` (see `measure`)."""
        asked, own = self.asked, (self.floats, self.verdict, self.late, self.status)
        rule = NONE if rule is None else rule
        kernels.measure(results, squares, rule, asked.wanted, asked.rtol, asked.whole, status.OVERFLOW, *own)
        if asked.wanted[kernels.EXPONENT // 2 :].any():
            wait_for_ahead()
            kernels.transcendental(results, squares, asked.wanted, asked.rtol, asked.whole, *own)

    def put(self, places, other, at=slice(None)):
        """The answers of the points `places` are those of `other` at `at` (all of them by default, in that order)."""
        for column in self.columns:
            self.floats[column, places] = other.floats[column, at]
        self.verdict[places], self.late[places] = other.verdict[at], other.late[at]
        self.status[places] = other.status[at]
