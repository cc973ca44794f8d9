"""Hill's question: is y'' + z(t) y = 0, z even and of period T, stable? Half-period factors,
verdict, Floquet data.

With y1, y2 the solutions with y1(0) = y2'(0) = 1, y1'(0) = y2(0) = 0, and everything at T/2:

    discriminant D = trace of the monodromy;  D - 2 = 4 y1' y2,  D + 2 = 4 y1 y2'
    unstable  <=>  y1' y2 > 0  or  y1 y2' < 0          (signs of four numbers: nothing cancels)
    sinh^2(exponent / 2) = y1' y2 or -y1 y2';  sin^2(theta / 2) = -y1' y2,  cos^2(theta / 2) = y1 y2'

det M = 1 does not check the numbers: it fails by 1e3 where |D| is 1e19. A verdict is given only where
the error bounds exclude the others.
Source: W. Magnus, S. Winkler, Hill's Equation (1966), 1.3 and 2.1; symmetric z: theorem 1.1 there.
"""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from survey import measures, status
from survey.kernels.hill.answers import FLOATS, MARGINAL, STABLE, UNDECIDED, UNSTABLE, spread
from survey.kernels.lanes import RESULTS
from survey.kernels.math.double import split_error
from survey.measures.answers import NOTHING
from survey.measures.hill import auto, pointwise
from survey.measures.hill.answers import Answers, Asked
from survey.scene import Output

# Outputs that follow from the verdict, or are sharper with it.
DECIDED = frozenset({"verdict", "exponent", "rotation_number", "discriminant"})
# Points on their own from which on series pay.
FEWEST = 4096
# Seconds per point: points one by one, rows by series of their own, and maps by series.
SECONDS = (1.5e-6, 6e-7, 2e-7)
DENSE = 100
VERDICTS = {"undecided": UNDECIDED, "unstable": UNSTABLE, "stable": STABLE, "marginal": MARGINAL}
OUTPUTS = (
    Output("discriminant", "trace of the monodromy matrix over one period T", "D"),
    Output("y1", "y1(T/2), where y1(0) = 1, y1'(0) = 0", "y_1(T/2)"),
    Output("y2", "y2(T/2), where y2(0) = 0, y2'(0) = 1", "y_2(T/2)"),
    Output("dy1", "derivative of y1 at T/2", "y_1'(T/2)"),
    Output("dy2", "derivative of y2 at T/2", "y_2'(T/2)"),
    Output("exponent", "growth exponent of the amplitude per period", r"\mu T"),
    Output("rotation_number", "rotation number per period", r"\theta / 2\pi"),
    Output("period", "period of the coefficient", "T"),
    Output("verdict", "stability of the linear motion", flags=VERDICTS),
)


@dataclass(frozen=True)
class RowAxis:
    """An axis of `number` rows from position `low` to `high`; equal keys, and so equal axes, mean
    the same equations.

    The factors are analytic in the position; `at(positions)` is the Problem of rows there, without
    points of its own. Where p -> -p exchanges y1 and y2', y1 - y2' is analytic when divided by
    `odd(positions)`, if that is given.
    """

    key: Hashable
    number: int
    low: float
    high: float
    at: Callable = field(compare=False)
    odd: Callable | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Box:
    """Where points on their own lie: between the ends of `row_axis`, and of `line` (number, least,
    greatest) of p; `number`s that stand for as many points on a map. `even` and `full_period` as of
    a Problem.
    """

    row_axis: RowAxis
    line: tuple[int, float, float]
    even: bool = False
    full_period: bool = False


def boxed(points):
    """The number of rows, and of points in each, that stand for so many `points` on their own; None
    if they are few.
    """
    return int(1.5 * points**0.5) if points >= FEWEST else None


@dataclass(frozen=True)
class RowSizes:
    """What the steps of R rows are chosen by: half periods `span`, with `span_low` what float64 took
    from them (None where nothing is known of it, or where it is 0); |z| <= bound[r, 0] + |p| bound[r, 1]
    + p^2 bound[r, 2]; `rate` is 1 / distance to z's nearest singularity.
    """

    span: np.ndarray
    bound: np.ndarray
    rate: np.ndarray
    span_low: np.ndarray | None = None

    def at(self, rows):
        """Those of some rows."""
        span_low = None if self.span_low is None else self.span_low[rows]
        return RowSizes(self.span[rows], self.bound[rows], self.rate[rows], span_low)


@dataclass(frozen=True)
class Problem:
    """R rows of L points: y'' + (c0(t) + p c1(t) + p^2 c2) y = 0 on half a period, p varying along
    the row.

    `sample(rows, nodes, steps)` gives c0, c1 of the rows at `nodes` (fractions) of each step as an array
    (rows, steps, 2, nodes); `walk(rows, p, tolerance)`, for adaptive methods, gives the results of a chain for
    points p of those rows, and which of them reached the end; `exact(rows, p, low, steps)` gives them in double-double,
    for p + low, each in its even number of steps. `sizes()` gives the RowSizes, which rows that a series across them
    answers do not need. p (R, L) may be a read-only view. `rule` (R, L) holds what exact rules say (`answers`), and
    `constant` the rows where z does not depend on t, with z there (rows, L); None where there are none.
    `line` is the full axis of p, when every row has the same points: (number, least, greatest). `even` (R) says
    where p -> -p exchanges y1 and y2' at T/2, and leaves y2 and y1'. `row_axis` is the axis of the rows, if
    there is one, and `positions` (R) where they lie on it, known to 4 + |position| ulp.
    `cut(rows, steps)` gives the lengths of the steps (rows, steps) where they differ. With `full_period`, where z is
    not even, the period stands for the half. `p_low` is what float64 took from p: None where nothing is known of it,
    or where it is 0.
    """

    p: np.ndarray
    sizes: Callable[[], RowSizes]
    c2: float
    sample: Callable
    walk: Callable | None = None
    exact: Callable | None = None
    rule: np.ndarray | None = None
    constant: tuple[np.ndarray, np.ndarray] | None = None
    line: tuple[int, float, float] | None = None
    even: np.ndarray | None = None
    row_axis: RowAxis | None = None
    positions: np.ndarray | None = None
    cut: Callable | None = None
    full_period: bool = False
    p_low: np.ndarray | None = None

    @cached_property
    def row_sizes(self):
        """The RowSizes."""
        return self.sizes()

    @property
    def span(self):
        return self.row_sizes.span

    @property
    def bound(self):
        return self.row_sizes.bound

    @property
    def rate(self):
        return self.row_sizes.rate

    def points(self, those):
        """p of some of the R L points."""
        return self.p[those // self.p.shape[1], those % self.p.shape[1]]

    def lengths(self, rows, steps):
        """Lengths of the steps (rows, steps), some an ulp longer or shorter, evenly spread, to fill
        the half period.
        """
        if self.cut:
            return self.cut(rows, steps)
        span = self.span[rows]
        h = span / steps
        left = (span - steps * h) - split_error(float(steps), h, steps * h)
        if self.row_sizes.span_low is not None:
            left += self.row_sizes.span_low[rows]
        ulp = np.spacing(h)
        lengths = np.empty((rows.size, steps))
        spread(h, ulp, np.rint(left / ulp), lengths)
        return lengths

    def at(self, rows, p, rule=None):
        """Points `p` (one row for each of `rows`) on their own, no axis, with what exact rules say
        of them.
        """
        return replace(
            self, p=p, sizes=lambda: self.row_sizes.at(rows), rule=rule, constant=None,
            p_low=None, line=None, row_axis=None, exact=None,
            sample=lambda used, nodes, steps: self.sample(rows[used], nodes, steps),
            walk=self.walk and (lambda used, p, tolerance: self.walk(rows[used], p, tolerance)),
            cut=self.cut and (lambda used, steps: self.cut(rows[used], steps)),
        )  # fmt: skip


def of_rows(rows, sample, walk, exact=None):
    """The functions of a Problem from a scene's kernels, which take some of what `rows()` gives (R,
    ...) and fill `out`.

    `sample(rows, nodes, out)`; `walk(rows, p, tolerance, out, reached)`; `exact(rows, p, low,
    steps, out)` or None.
    """

    def samples(used, nodes, steps):
        out = np.empty((used.size, steps, 2, nodes.size))
        sample(rows()[used], nodes, out)
        return out

    def walked(used, p, tolerance):
        out = np.full((used.size, RESULTS), np.nan)
        reached = np.zeros(used.size, np.bool_)
        walk(rows()[used], p, tolerance, out, reached)
        return out, reached

    def solved(used, p, low, steps):
        out = np.empty((used.size, RESULTS))
        exact(rows()[used], p, low, steps, out)
        return out

    return {"sample": samples, "walk": walked, "exact": solved if exact else None}


def solve(problem, method, rtol, wanted=(), out=NOTHING):
    """The wanted outputs (R, L; all by default) with `_error` each, `verdict`, `status`; in
    the arrays `out` (R L), by name, as far as these are given (see `Answers`).

    `method` is the name of a method, or "auto" (see `auto`); points climb its ladder until
    `rtol` is met or more work is of no use.
    """
    asked = _asked(rtol, wanted, problem.full_period)
    answers = Answers(problem.p.size, asked, out)
    if method == "auto":
        auto.solve(problem, asked, answers)
    else:
        pointwise.solve(problem, measures.method(method), asked, answers)
    return _outputs(answers, asked, problem.p.shape)


def _asked(rtol, wanted, full_period):
    """What is asked for; factors alone need no verdict."""
    columns = np.array([name in wanted or not wanted for name in FLOATS])
    decides = not wanted or not DECIDED.isdisjoint(wanted)
    return Asked(rtol, columns, full_period=full_period, decides=decides)


def _outputs(answers, asked, shape):
    out = {"verdict": answers.verdict.reshape(shape), "status": answers.status.reshape(shape)}
    for i in np.flatnonzero(asked.wanted):
        out[FLOATS[i]] = answers.floats[i].reshape(shape)
        out[f"{FLOATS[i]}_error"] = answers.bars(i).reshape(shape)
    return out


def cost(rows, points):
    """Seconds per point of `rows` rows of `points` each, all outputs; measured on one thread of a
    Xeon of 2023.
    """
    return SECONDS[bool(points >= DENSE) + bool(rows >= DENSE and points >= DENSE)]


def solve_scattered(box, position, p, problem_of, rtol, wanted=(), out=NOTHING):
    """As `solve` by "auto", (N, 1), of points on their own at `position` and `p` (N each; NaN where
    no series serves): from series on their `box`; `problem_of(points)` is the Problem of those that
    are left.
    """
    asked = _asked(rtol, wanted, box.full_period)
    answers = Answers(p.size, asked, out)
    left = np.flatnonzero(auto.scattered(box, asked, answers, position, p))
    if left.size:
        own = Answers(left.size, asked)
        auto.solve(problem_of(left), asked, own)
        answers.replace(left, own)
    return _outputs(answers, asked, (p.size, 1))


def overflow(out, where):
    """Take back the answers of the points `where` a value or bound lies beyond the range of floats;
    changes `out`.
    """
    if where.any():
        failed = (out["status"] == status.OK) & where
        out["status"] = np.where(failed, status.OVERFLOW, out["status"]).astype(np.int8)
        out["verdict"] = np.where(failed, UNDECIDED, out["verdict"]).astype(np.int8)
        for name, values in out.items():
            if values.dtype.kind == "f":
                out[name] = np.where(failed, np.nan, values)
