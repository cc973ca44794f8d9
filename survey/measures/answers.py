"""The answers at points as their results come in, and the ladder that a point climbs if it misses
the requested accuracy.

A rung of a ladder is an amount of work: a number of steps, or for an adaptive method the tolerance
of one step. A point begins on the rung that its method asks for; where its error bounds miss the
accuracy, or leave the verdict open, it is solved again on a higher one, as long as that halves its
bounds. So the work on a point depends on that point, the method and rtol, never on its neighbours,
and its bits are the same in any block.
"""

from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from survey import status

UNDECIDED = -1
NOTHING = MappingProxyType({})


class Answers:
    """Answers at N points: `codes` (int8 each, N), `status`, and which points have `missed` the
    requested accuracy; and `floats`, arrays (N each), which each family makes.

    Codes and status that are in `out`, by name, are kept there.
    """

    def __init__(self, size, codes, out=NOTHING):
        self.codes = codes
        for name, first in (*dict.fromkeys(codes, UNDECIDED).items(), ("status", status.OK)):
            array = out[name] if name in out else np.empty(size, np.int8)
            array[:] = first
            setattr(self, name, array)
        self.missed = np.zeros(size, np.bool_)

    def replace(self, points, other, those=slice(None)):
        """The answers of `points` become those of `other`: of all its points, or of `those`, in
        that order.
        """
        self._replace_floats(points, other, those)
        for name in (*self.codes, "status", "missed"):
            getattr(self, name)[points] = getattr(other, name)[those]

    def _replace_floats(self, points, other, those):
        for own, others in zip(self.floats, other.floats, strict=True):
            own[points] = others[those]


@dataclass(frozen=True)
class Ladder:
    """`rungs`, ascending in work; a point of rung i climbs to rung `above[i]` (beyond the last: it
    stays as it is).

    `bounds` are the columns of the results that hold error bounds, None if results have it as their
    property `bound`; a point climbs at most `most` times.
    """

    rungs: np.ndarray
    above: np.ndarray
    bounds: slice | None
    most: int

    @property
    def top(self):
        """The highest rung."""
        return len(self.rungs) - 1

    def climb(self, rung, results, answers, solve, assess):
        """Solve again, on higher rungs, the points that missed the requested accuracy; the better
        results are kept.

        `rung` (N), `results` (N, columns) and `answers` are changed. `solve(points, rung)` gives
        the results of points on their rungs, `assess(points, results)` their Answers.
        """
        left = np.flatnonzero(answers.missed & (rung <= self.top))
        for _ in range(self.most):
            if not left.size:
                break
            rung[left] = self.above[rung[left]]
            left = left[rung[left] <= self.top]
            before, new = results[left], solve(left, rung[left])
            bound, new_bound = self._bound(before), self._bound(new)
            better = new_bound < bound
            results[left[better]] = new[better]
            assessed = assess(left, results[left])
            answers.replace(left, assessed)
            # truncation falls by far more than 2 from rung to rung: where the bound does not halve,
            # rounding rules
            useful = (new_bound < 0.5 * bound) | (assessed.status == status.OVERFLOW)
            left = left[assessed.missed & useful]

    def _bound(self, results):
        """The widest bound of each point; infinite where one is not finite."""
        if self.bounds is None:
            return results.bound
        widest = results[:, self.bounds].max(axis=1)
        return np.where(np.isfinite(widest), widest, np.inf)
