"""x' = f(t, x, p) of a user: its operations and those of df/dx, recorded once, and its flow."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from survey.kernels.floquet.flow import ORDER, flow
from survey.kernels.math.roundoff import ROUNDOFF
from survey.measures.floquet import probing, trace
from survey.measures.floquet.symmetry import SHARE, Symmetry
from survey.measures.floquet.system import KEPT, TRIED, Raised, is_undefined
from survey.measures.floquet.trace import Graph, Unsupported

MOST_STEPS = 2_000  # of an orbit
ALIKE = 1e-9  # relative: what counts as the same f
LOCK = threading.Lock()


@dataclass(frozen=True, eq=False)
class Equation:
    """x' = f(t, x, p) of n states. `period` is a value, a function of p, or None; `start` a value
    or a function of p, the n states, and a guess of the period after them if `period` is None.
    `symmetry`: of orbits that are sought.
    """

    f: Callable
    n: int
    period: float | Callable | None
    start: tuple | Callable
    symmetry: Symmetry | None = None
    _traces: list = field(default_factory=list, repr=False)
    BRANCHES = "t or on a state"

    @property
    def free(self):
        """Is the period unknown?"""
        return self.period is None

    @property
    def uses_time(self):
        """Does f depend on t where it was recorded? None where it has not been."""
        with LOCK:
            known = list(self._traces)
        return any(trace.TIME in programs.f.order for programs in known) if known else None

    @property
    def share(self):
        """The share of the period that is integrated."""
        return 1.0 if self.symmetry is None else SHARE

    @property
    def judged(self):
        """The number of multipliers that are judged."""
        return self.n - self.free if self.symmetry is None else self.symmetry.judged

    def begin(self, points):
        """Guesses of the state (N, n) and of the period (N), which is what it is where it is known;
        NaN where they are undefined.
        """
        guess = np.array([self._row("START(p)", self.start, p, self.n + self.free) for p in points])
        guess = guess.reshape(len(points), self.n + self.free)
        if self.free:
            return guess[:, :-1], guess[:, -1]
        return guess, self.periods(points)

    def pinned(self, points, x):
        """The states x (N, n), with the one that is held on a family of symmetric orbits as `start`
        gives it.
        """
        if self.symmetry is None or not len(x):
            return x
        x, held = x.copy(), self.symmetry.held
        x[:, held] = self.begin(points)[0][:, held]
        return x

    def periods(self, points):
        """The periods (N) of a system that depends on t."""
        return np.array([self._row("PERIOD(p)", self.period, p, 1)[0] for p in points])

    def _row(self, name, value, p, size):
        try:
            row = value(p) if callable(value) else value
        except (ArithmeticError, ValueError):
            return np.full(size, np.nan)
        except (Exception, SystemExit) as error:
            raise Raised(name) from error
        try:
            row = np.atleast_1d(np.asarray(row, dtype=float))
        except (Exception, SystemExit) as error:
            raise Raised(name) from error
        if row.shape != (size,):
            what = (
                "the states and a guess of the period"
                if size > self.n
                else "the states"
                if size > 1
                else "a number"
            )
            raise Unsupported(
                f"{name} returns {row.shape} numbers, not {size}: {what}", "correct it"
            )
        return row

    def traced(self, points, x0):
        """[(indices, Programs)] of the points, but for those where f is undefined; raises Unsupported
        or Raised.
        """
        left = np.arange(len(points))
        found = []
        with LOCK:
            known = list(self._traces)
        while left.size:
            for programs in known:
                inside = programs.holds(points[left])
                if inside.any():
                    found.append((left[inside], programs))
                    left = left[~inside]
            if not left.size:
                break
            try:
                known = [self.recorded(points[left[0]], x0[left[0]])]
            except (Unsupported, Raised) as error:
                if not is_undefined(error):
                    raise
                left, known = left[1:], []
                continue
            with LOCK:
                self._traces.extend(known)
                del self._traces[:-KEPT]
            if not known[0].holds(points[left[:1]])[0]:  # on the very edge of a branch
                found.append((left[:1], known[0]))
                left = left[1:]
        return found

    def defined(self, points, x, T):
        """Where (N) f at the states x (N, n) is finite at TRIED shares of the periods T (N)."""
        found = np.zeros(len(points), bool)
        for inside, programs in self.traced(points, x):
            numbers = programs.numbers(points[inside])
            every = [programs.slopes(numbers, s * T[inside], x[inside])[0] for s in TRIED]
            found[inside] = np.isfinite(every).all(axis=(0, 2))
        return found

    def angles(self, points, x, T):
        """Which states (n) are angles: is f the same, within rounding, where they are 2 pi more? Tried at
        the states x (N, n) and at TRIED shares of the periods T (N).
        """
        found = np.ones(self.n, bool)
        for inside, programs in self.traced(points, x):
            numbers = programs.numbers(points[inside])
            for share in TRIED:
                t, here = share * T[inside], x[inside]
                f = programs.slopes(numbers, t, here)[0]
                for k in np.flatnonzero(found):
                    on = here + 2 * np.pi * (np.arange(self.n) == k)
                    off = abs(programs.slopes(numbers, t, on)[0] - f)
                    found[k] &= (off <= ALIKE * (1.0 + abs(f))).all()
        return found

    def recorded(self, point, x0):
        """The Programs, as the code runs at this point and state; raises Unsupported or Raised."""
        graph = Graph([float(x) for x in point], 0.25)
        x = self._symbols(graph, len(point), x0)
        rows = self._called(graph, graph.time, x.copy(), graph.parameters)
        programs = compiled(graph, x, rows)
        if self.free and trace.TIME in programs.A.order:
            raise Unsupported(
                "f(t, x, p, out) depends on t, so PERIOD must be given",
                "give the period of f in t",
            )
        return programs

    @staticmethod
    def _symbols(graph, parameters, x0):
        """The states as symbols; where their series begin are the numbers after those of the parameters."""
        x = np.empty(len(x0), dtype=object)
        for k in range(len(x0)):
            x[k] = graph.state(graph.number("parameter", parameters + k), float(x0[k]))
        return x

    def _called(self, graph, time, x, p):
        """f as symbols (n), called with symbols."""
        n = self.n
        out = np.zeros(self.n, dtype=object)
        try:
            value = trace.lifted(self.f)(time, x, p, out)
            out = out if value is None else np.array(value, dtype=object)
        except Unsupported as error:
            raise Unsupported(f"f(t, x, p, out): {error}", error.remedy) from None
        except ArithmeticError as error:
            raise Unsupported(
                f"f(t, x, p, out): {error}, while its operations are recorded"
            ) from error
        except (Exception, SystemExit) as error:
            raise Raised("f(t, x, p, out)") from error
        if out.shape != (n,):
            what = f"f(t, x, p, out) returns an array of shape {out.shape}, not {(n,)}"
            raise Unsupported(what, "fill the entries of out, and return nothing")
        if not all(symbol.is_number for symbol, _yes in (*graph.guards, *graph.equalities)):
            raise Unsupported(
                f"f(t, x, p, out): a branch depends on {self.BRANCHES} (abs and maximum are branches)"
            )
        return [graph.entry(out[i], "f(t, x, p, out)") for i in range(n)]


def compiled(graph, x, rows):
    """The Programs of x' = rows, both symbols."""
    states = [graph.single(one) for one in x]
    graph.flow.update(zip(states, rows, strict=True))
    slopes = {
        (i, j): graph.slope(row, state)
        for i, row in enumerate(rows)
        for j, state in enumerate(states)
    }
    states_at = [graph.series[state][1] for state in states]
    A = graph.compiled({at: symbol for at, symbol in slopes.items() if symbol is not None})
    f = graph.compiled({(i, 0): row for i, row in enumerate(rows)})
    return Programs(A, f, np.array(states_at))


@dataclass(frozen=True, eq=False)
class Programs:
    """A = df/dx and f (in column 0) as `trace.Program`s; `states_at` of the states among the numbers."""

    A: trace.Program
    f: trace.Program
    states_at: np.ndarray

    def _with_states(self, points):
        return np.concatenate([points, np.zeros((len(points), len(self.states_at)))], axis=1)

    def holds(self, points):
        """Do the branches of the code go at the points (N, parameters) as they did where it was recorded?"""
        zero = np.zeros(len(points))
        return self.A.holds(self._with_states(points), zero, zero + 1.0) == 1

    def numbers(self, points):
        """Values and error bounds of the numbers at the points; those of the states are 0."""
        values, errors = self.A.numbers(self._with_states(points))
        errors[:, self.states_at] = 0.0
        return values, errors

    def flow(
        self,
        numbers,
        x0,
        span,
        reach,
        derived=True,
        first=None,
        most=MOST_STEPS,
        tolerance=ROUNDOFF,
    ):
        """States at `span`, dX/dx0, largest states and numbers of steps; if `first` is given, steps
        and series.
        """
        N, n = x0.shape
        X = np.full((N, n), np.nan)
        M = np.zeros((N * derived, n, n))
        size = np.empty((N, n))
        steps = np.zeros(N, int)
        total = 0 if first is None else first[-1]
        recorded = np.empty(total), np.empty(total), np.empty((total, n, ORDER + 1))
        A = self.A
        flow(
            A.operations, A.signs, A.inside, A.order, A.used, A.terms, np.ascontiguousarray(numbers[0]), self.states_at,
            np.ascontiguousarray(x0), np.ascontiguousarray(span), reach,
            probing.longest_steps(self.f, numbers, span, reach), tolerance, most,
            np.zeros(0, int) if first is None else first, X, M, size, steps, *recorded,
        )  # fmt: skip
        return (X, M, size, steps) if first is None else (X, *recorded)

    def slopes(self, numbers, t, x, width=0.0):
        """f (N, n) at states x (N, n), known to within `width`, and its bounds."""
        out = self.along(
            self.f, numbers, t[:, None], x[:, :, None], np.broadcast_to(width, x.shape)[:, :, None]
        )
        return tuple(one[:, 0, :, 0] for one in out)

    def along(self, program, numbers, t, x, width):
        """A program's values (N, m, n, n) at times t (N, m), states x (N, n, m) known to within
        `width`, and bounds.
        """
        return program.at(t, t, x.shape[1], numbers, (x.swapaxes(0, 1), width.swapaxes(0, 1)))
