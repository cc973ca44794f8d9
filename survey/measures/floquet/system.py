"""A user's linear periodic system x' = A(t, p) x, or M q'' + C q' + K q = 0, as programs of its
pieces.

With M, C, K the states are (q, q'), or, if the system is symplectic, (q, M q' + C q / 2), M and C
constant in t: then J A is symmetric where M and K are, C is antisymmetric.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from survey.measures.floquet import trace
from survey.measures.floquet.trace import ONE, Graph, Symbol, Unsupported

KEPT = 256  # traces
SMALL = 0.1  # a pivot, relative to the largest entry of its row
RECORDED = 64  # points from which on it pays to record PERIOD
# of a period: where functions are tried as Python, and must be finite
TRIED = np.array([0.0, 0.11, 0.29, 0.47, 0.62, 0.83])
LOCK = threading.Lock()


class Raised(Exception):
    """The function `name` raised its cause."""

    def __init__(self, name):
        super().__init__(name)
        self.name = name


def is_undefined(error):
    """Does an Unsupported or Raised tell of the one point, at which the function has no value?"""
    return isinstance(error.__cause__, (ArithmeticError, ValueError))


@dataclass(frozen=True, eq=False)
class System:
    """n states; `matrices` {"A"} or {"M", "C", "K"} (M, C optional): functions of t, p and out, the
    matrix to fill.

    `period` and `breaks` are values, or functions of p; so is `conserved`, if given: w (n), where w
    x is the same a period later. Its multiplier, 1, is not judged.
    """

    matrices: dict
    n: int
    period: float | Callable
    breaks: tuple | Callable
    symplectic: bool
    conserved: tuple | Callable | None = None
    _traces: list = field(default_factory=list, repr=False)

    @cached_property
    def _lifted(self):
        return {name: trace.lifted(function) for name, function in self.matrices.items()}

    @property
    def judged(self):
        """The number of multipliers that are judged."""
        return self.n - (self.conserved is not None)

    def weights(self, points):
        """What is `conserved` at the points: w (N, n), NaN where it is undefined."""
        rows = [self._value("CONSERVED", self.conserved, p) for p in points]
        rows = [np.full(self.n, np.nan) if row is np.nan else row for row in rows]
        try:
            rows = [np.ravel(np.asarray(row, dtype=float)) for row in rows]
        except (TypeError, ValueError) as error:
            raise Raised("CONSERVED(p)") from error
        wrong = next((row.size for row in rows if row.size != self.n), None)
        if wrong is not None:
            what = (
                f"CONSERVED(p) returns {wrong} numbers, not {self.n}: one combination of the states"
            )
            raise Unsupported(f"{what} alone can be stated", "return its coefficients")
        return np.array(rows).reshape(len(points), self.n)

    @property
    def same_ranges(self):
        """Are the period and the breaks those of all points?"""
        return not callable(self.period) and not callable(self.breaks)

    def ranges(self, points):
        """Period (N) and the edges of the pieces (N, P + 1), the last one repeated where a point
        has fewer; NaN where one of them is undefined.
        """
        each = points[:1] if self.same_ranges else points
        period = self.periods(each)
        if not callable(self.breaks) and not np.size(self.breaks):
            period = np.broadcast_to(period, len(points)).copy()
            return period, np.stack([0.0 * period, period], axis=1)
        rows = []
        for p, length in zip(each, period, strict=True):
            inside = np.atleast_1d(self._value("BREAKS", self.breaks, p)).astype(float)
            last = np.nan if np.isnan(inside).any() else length
            inside = np.unique(inside[(inside > 0) & (inside < last)])
            rows.append([0.0, *inside, last])
        most = max(map(len, rows), default=2)
        edges = np.array([[*row, *[row[-1]] * (most - len(row))] for row in rows]).reshape(
            len(rows), most
        )
        return np.broadcast_to(period, len(points)).copy(), np.broadcast_to(
            edges, (len(points), most)
        ).copy()

    def periods(self, points):
        """The period of each point (N); NaN where it is not positive."""
        if not callable(self.period):
            return np.full(len(points), self._number("PERIOD", self.period, None))
        period = self._recorded(points) if len(points) > RECORDED else None
        if period is None:
            period = np.array([self._number("PERIOD", self.period, p) for p in points])
        return np.where(period > 0, period, np.nan)

    def _recorded(self, points):
        """PERIOD at the points from its operations, recorded; None where branches decide."""
        graph = Graph([float(x) for x in points[0]], 0.25)
        try:
            found = graph.lift(trace.lifted(self.period)(graph.parameters))
        except (Exception, SystemExit):
            return None
        if graph.guards or graph.equalities or not found.is_number:
            return None
        return graph.compiled({}).numbers(points)[0][:, found.terms[ONE]]

    def smooth(self, point):
        """Are PERIOD and BREAKS analytic in the parameters, as no branch of theirs depends on these?"""
        graph = Graph([float(x) for x in point], 0.25)
        try:
            for value in (self.period, self.breaks):
                if callable(value):
                    trace.lifted(value)(graph.parameters)
        except (Exception, SystemExit):
            return False
        return not graph.guards and not graph.equalities

    def _value(self, name, value, p):
        try:
            return value(p) if callable(value) else value
        except (ArithmeticError, ValueError):
            return np.nan
        except (Exception, SystemExit) as error:
            raise Raised(f"{name}(p)") from error

    def _number(self, name, value, p):
        found = self._value(name, value, p)
        try:
            return float(found)
        except (TypeError, ValueError) as error:
            raise Raised(f"{name}(p)") from error

    def traced(self, points, edges):
        """[(indices, [program of each piece])] of the points (N, parameters); raises Unsupported or
        Raised.

        Points in no group, whose branches change within a piece, are rough; those where A is
        undefined have None for the programs.
        """
        left = np.arange(len(points))
        found = []
        with LOCK:
            known = list(self._traces)
        while left.size:
            for programs in known:
                if len(programs) != edges.shape[1] - 1 or not left.size:
                    continue
                inside = self._holds(programs, points[left], edges[left])
                if (inside == 1).any():
                    found.append((left[inside == 1], programs))
                    left = left[inside != 1]
            if not left.size:
                break
            try:
                programs = self.recorded(points[left[0]], edges[left[0]])
            except (Unsupported, Raised) as error:
                if not is_undefined(error):
                    raise
                found.append((left[:1], None))
                left, known = left[1:], []
                continue
            with LOCK:
                self._traces.append(programs)
                del self._traces[:-KEPT]
            own = self._holds(programs, points[left[:1]], edges[left[:1]])[0]
            if own != 1:  # rough, or on the very edge of a branch
                if own == 0:
                    found.append((left[:1], programs))
                left = left[1:]
            known = [programs]
        return found

    def _holds(self, programs, points, edges):
        out = np.ones(len(points), dtype=np.int8)
        for k, program in enumerate(programs):
            out = np.minimum(out, program.holds(points, edges[:, k], edges[:, k + 1]))
        return out

    def recorded(self, point, edges):
        """The program of each piece, as the code runs in its middle at this point; raises
        Unsupported or Raised.
        """
        return [self._program(point, 0.5 * (low + high)) for low, high in pairwise(edges)]

    def _program(self, point, time):
        graph = Graph([float(x) for x in point], time)
        if "A" in self.matrices:
            entries = self._filled(graph, "A", self.n)
        else:
            entries = self._of_second_order(graph)
        return graph.compiled({key: graph.lift(x) for key, x in entries.items()})

    def _filled(self, graph, name, size):
        """{(i, j): value} of the entries that are not 0."""
        out = np.zeros((size, size), dtype=object)
        try:
            value = self._lifted[name](graph.time, graph.parameters, out)
            if value is not None:
                out = np.array(value, dtype=object)
        except Unsupported as error:
            raise Unsupported(f"{name}(t, p, out): {error}", error.remedy) from None
        except ArithmeticError as error:
            raise Unsupported(
                f"{name}(t, p, out): {error}, while its operations are recorded"
            ) from error
        except (Exception, SystemExit) as error:
            raise Raised(f"{name}(t, p, out)") from error
        if out.shape != (size, size):
            what = f"{name}(t, p, out) returns an array of shape {out.shape}, not {(size, size)}"
            raise Unsupported(what, "fill the entries of out, and return nothing")
        entries = {
            (i, j): graph.entry(out[i, j], f"{name}(t, p, out)")
            for i in range(size)
            for j in range(size)
        }
        return {
            at: out[at]
            for at, x in entries.items()
            if isinstance(out[at], Symbol) or x.value != 0.0
        }

    def _of_second_order(self, graph):
        """The entries of A from those of M, C and K."""
        m = self.n // 2
        given = {name: self._filled(graph, name, m) for name in self.matrices}
        K, C = (dense(given.get(name, {}), m) for name in "KC")
        entries = {}
        if not self.symplectic:
            entries = {(i, m + i): 1.0 for i in range(m)}
            sides = [[*K[i], *C[i]] for i in range(m)]
            sides = solved(dense(given["M"], m), sides, graph) if "M" in given else sides
            filled = {
                (m + i, j): -x
                for i, row in enumerate(sides)
                for j, x in enumerate(row)
                if not _is_zero(x)
            }
            return entries | filled
        inverse = solved(dense(given["M"], m), identity(m), graph) if "M" in given else identity(m)
        for name in "MC":
            if any(isinstance(x, Symbol) and not x.is_number for x in given.get(name, {}).values()):
                what = f"{name}(t, p, out) depends on t, so that the momenta are not M q' + C q / 2"
                raise Unsupported(
                    what, "give A(t, p, out) in place of the matrices, or set STRUCTURE = 'none'"
                )
        half = [[0.5 * x for x in row] for row in C]
        velocity = times(inverse, half, m)  # q' = M^-1 (p - C q / 2)
        for (i, j), value in velocity.items():
            entries[i, j] = -value
        for i in range(m):
            for j in range(m):
                entries[i, m + j] = inverse[i][j]
        for (i, j), value in times(half, dense(velocity, m), m).items():
            entries[m + i, j] = value
        for i in range(m):
            for j in range(m):
                entries[m + i, j] = entries.get((m + i, j), 0.0) - K[i][j]
        for (i, j), value in times(half, inverse, m).items():
            entries[m + i, m + j] = -value
        return entries


def dense(entries, m):
    """The rows of an m x m matrix with these entries."""
    return [[entries.get((i, j), 0.0) for j in range(m)] for i in range(m)]


def identity(m):
    """The rows of the identity."""
    return [[1.0 * (i == j) for j in range(m)] for i in range(m)]


def _is_zero(x):
    return not isinstance(x, Symbol) and x == 0.0


def times(left, right, m):
    """{(i, j): value} of the product of two matrices of rows, entries that vanish left out."""
    found = {}
    for i in range(m):
        for j in range(m):
            terms = [
                left[i][k] * right[k][j]
                for k in range(m)
                if not (_is_zero(left[i][k]) or _is_zero(right[k][j]))
            ]
            if terms:
                total = terms[0]
                for term in terms[1:]:
                    total = total + term
                found[i, j] = total
    return found


def solved(rows, sides, graph):
    """The rows of X where M X = sides, by elimination; M is given by its rows.

    Pivots are not small at the example, constants rather than functions of t, and of those that
    fill in least: what is eliminated is made of series, and each product costs.
    """
    m = len(rows)
    work, sides = [list(row) for row in rows], [list(row) for row in sides]
    left = list(range(m))
    columns = list(range(m))
    order = []
    while left:
        i, j = _pivot(work, left, columns, graph)
        left.remove(i)
        columns.remove(j)
        order.append((i, j))
        for k in left:
            if not _is_zero(work[k][j]):
                factor = work[k][j] / work[i][j]
                work[k] = _less(work[k], factor, work[i], columns)
                sides[k] = _less(sides[k], factor, sides[i], range(len(sides[i])))
    out = [None] * m
    for i, j in reversed(order):
        row = sides[i]
        for other in range(m):
            if out[other] is not None and not _is_zero(work[i][other]):
                row = _less(row, work[i][other], out[other], range(len(row)))
        pivot = work[i][j]
        plain = not isinstance(pivot, Symbol) and pivot == 1.0
        out[j] = row if plain else [x if _is_zero(x) else x / pivot for x in row]
    return out


def _less(row, factor, other, columns):
    """The row less the factor times the other one, in some columns."""
    found = list(row)
    for c in columns:
        if not _is_zero(other[c]):
            product = factor * other[c]
            found[c] = -product if _is_zero(row[c]) else row[c] - product
    return found


def _pivot(work, left, columns, graph):
    """The row and the column of the next pivot."""
    found = []
    size = {(i, j): abs(graph.lift(work[i][j]).value) for i in left for j in columns}
    in_row = {i: sum(not _is_zero(work[i][j]) for j in columns) for i in left}
    in_column = {j: sum(not _is_zero(work[i][j]) for i in left) for j in columns}
    for i, j in size:
        if size[i, j] > 0.0 and size[i, j] >= SMALL * max(size[i, k] for k in columns):
            varies = isinstance(work[i][j], Symbol) and not work[i][j].is_number
            found.append((varies, (in_row[i] - 1) * (in_column[j] - 1), -size[i, j], i, j))
    if not found:
        raise Unsupported(
            "M(t, p, out) is singular",
            "give every coordinate a mass, or leave M out: it is the identity",
        ) from np.linalg.LinAlgError("singular matrix")
    return min(found)[3:]
