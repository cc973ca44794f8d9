"""The answers of points of Danby's map as they come in."""

import numpy as np

from survey import status
from survey.kernels.libration import traces
from survey.kernels.libration.traces import PAIRS, PAIRS_BAR, SUM, SUM_BAR, UNDECIDED
from survey.measures import answers

_NO_RESULTS = np.empty((0, traces.RESULTS))
_NO_ROWS = (
    np.empty((0, traces.INVARIANTS, traces.NODES)),
    np.empty((0, traces.INVARIANTS)),
    np.empty(0, np.int64),
    np.empty((0, 0)),
)


class Answers(answers.Answers):
    """`floats` (4, N): a, b, each followed by its error bound; `verdict` and `collision`."""

    def __init__(self, size):
        super().__init__(size, ("verdict", "collision"))
        self.floats = np.empty((4, size))

    @property
    def all(self):
        """What the kernels fill, in their order."""
        return self.floats, self.verdict, self.collision, self.missed, self.status

    def assess(self, results, rtol):
        """Answer every point whose status is ok from its results (N, RESULTS)."""
        traces.answer(results, *_NO_ROWS, rtol, status.OVERFLOW, *self.all)

    def of_rows(self, series, bars, rows, mu, rtol):
        """Answer the `missed` points of `rows` of mu (R, L) from the rows' series and their bars."""
        traces.answer(_NO_RESULTS, series, bars, rows, mu, rtol, status.OVERFLOW, *self.all)

    def inaccurate(self, rtol):
        """Which points have error bounds above rtol (1 + |value|), or no answer (N)."""
        a, a_bar, b, b_bar = self.floats[[SUM, SUM_BAR, PAIRS, PAIRS_BAR]]
        return ~((a_bar <= rtol * (1 + abs(a))) & (b_bar <= rtol * (1 + abs(b)))) | (
            self.status != status.OK
        )

    @property
    def unsettled(self):
        """Who has missed what was asked, has no answer, or whose collision is undecided (N)."""
        return self.missed | (self.collision == UNDECIDED) | (self.status != status.OK)
