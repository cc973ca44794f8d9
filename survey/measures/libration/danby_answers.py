"""The answers of points of Danby's map as they come in."""

import numpy as np

from survey import status
from survey.kernels.libration import traces
from survey.kernels.libration.traces import UNDECIDED


class Answers:
    """a, b and their bars (4, N), `verdict`, `collision`, `status`, and who is `late`: undecided, or bars too wide."""

    def __init__(self, size):
        self.floats = np.empty((4, size))
        self.verdict, self.collision = (np.full(size, UNDECIDED, np.int8) for _ in range(2))
        self.status, self.late = np.zeros(size, np.int8), np.zeros(size, np.bool_)

    @property
    def all(self):
        """What the kernels fill, in their order."""
        return self.floats, self.verdict, self.collision, self.late, self.status

    def judge(self, results, rtol):
        """Answer every point whose status is ok from its results (N, 10)."""
        traces.measure(results, rtol, status.OVERFLOW, *self.all)

    def missed(self, rtol):
        """Whose bars are wider than asked, or who has no answer (N)."""
        a, a_bar, b, b_bar = self.floats
        return ~((a_bar <= rtol * (1 + abs(a))) & (b_bar <= rtol * (1 + abs(b)))) | (self.status != status.OK)

    @property
    def unsettled(self):
        """Who is late, has no answer, or whose collision is undecided (N)."""
        return self.late | (self.collision == UNDECIDED) | (self.status != status.OK)

    def put(self, places, other, of_those=slice(None)):
        """The answers of the points `places` are those of `other`, or `of_those` among them, in that order."""
        self.floats[:, places] = other.floats[:, of_those]
        for name in ("verdict", "collision", "status", "late"):
            getattr(self, name)[places] = getattr(other, name)[of_those]
