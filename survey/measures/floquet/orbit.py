"""Periodic orbits of x' = f(t, x, p), and their stability: states at t = 0, periods, multipliers, verdicts.

Newton's method on x(T) - x(0) = 0, damped, from `start`; the derivative M = dx(T)/dx(0) is the monodromy matrix. Where
f does not depend on t, T is unknown too, and x(0) stays in the plane through the start that f is normal to there.
Where it does not converge, it begins again from the state RELAXED periods later, on the attracting orbit perhaps.

Existence. Let X(t) be the Taylor series of all steps, off from the solution by its defect X' - f(t, X), which is
sampled at NODES, and by the jumps from step to step; y = x(0), or (x(0), T); G(y) = x(T) - x(0) and the plane's
equation; B nearly the inverse of G'. If |1 - B G'| <= q < 1 for all y of a ball of radius r about the computed y, and
|B G(y)| <= (1 - q) r, there is one periodic orbit in the ball (Banach; Krawczyk), and it is within |B G(y)| / (1 - q).
All solutions that begin in the ball are in a tube about X, WIDER than the linear equation says, which is checked with
the second-order terms. A = df/dx changes within the tube by no more than `noise`: its operations are evaluated with
the tube's width as the error of the states. So the bounds of M, which include `noise`, hold for all of them, and for
the orbit: verdicts need nothing else.

What is no strict bound: samples at NODES stand for all times (taken SAMPLED times), widths of the tube enter to first
order (taken WIDER), and the series of A is cut off as in `kernels.floquet.steps`.

The autonomous system's multiplier +1 is not given or judged: the others are those of M in the coordinates
x_i - (f_i / f_k) x_k, i not k, of the space in which f counts as 0.

Sources: R. Krawczyk, Computing 4 (1969) 187; W. Tucker, Validated Numerics (2011), 5 and 6.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace

import numpy as np

from survey import status
from survey.kernels.floquet.discs import couplings
from survey.kernels.floquet.flow import ORDER, flow, spread
from survey.kernels.floquet.steps import carried, products
from survey.kernels.math.roundoff import EPS, ROUNDOFF_UP
from survey.measures.floquet import monodromy, stability, trace
from survey.measures.floquet.system import KEPT, Raised
from survey.measures.floquet.trace import Graph, Unsupported
from survey.scene import Output

NO_ORBIT = status.FIRST_OF_SCENE
NODES = np.array([0.0, 0.25, 0.5, 0.75, 0.875, 1.0])  # of a step; sums with the ends of steps are exact
MIDDLE = 2  # of NODES
SAMPLED = 1.25  # samples within a step, whose length is a small part of the radius of convergence
WIDER = 1.1  # the tube than the linear equation says, and bounds to first order in its width
RADII = (1.1, 2.1)  # of the ball, relative to |B G|: the first that serves
WIDEST = 1e-3  # of the tube, relative to the largest state
CHUNK = 2048  # points that are solved together
CALL = 200_000  # numbers of a series that are recorded together
MOST_STEPS, MOST_RELAXED = 2_000, 10_000  # of an orbit, of the long time before it
TRIALS, LEAST_DAMPING = 40, 1e-4  # of Newton's method
CONVERGED = 1e-8  # relative: the last step, whose square is beyond float64
FARTHEST = 0.2  # a step of it, relative to the orbit and the period
ACROSS = 0.1  # how fast the plane is passed, relative to the start: equilibria are no orbits
RELAXED, RETURN, NEAR = 32.0, 3.0, 0.2  # periods; the time in which an orbit comes back; how near, relative to it
LOCK = threading.Lock()

_of_floquet = {o.name: o for o in stability.OUTPUTS}
OUTPUTS = (
    Output("x0", "state of the periodic orbit at t = 0", "x_0", dims=("state",)),
    replace(_of_floquet["period"], long_name="period of the orbit"),
    *(o for o in stability.OUTPUTS if o.name not in ("period", "krein")),
)


@dataclass(frozen=True, eq=False)
class Equation:
    """x' = f(t, x, p) of n states. `period` is a value, a function of p, or None; `start` a value or a function of p,
    the n states, and a guess of the period after them if `period` is None.
    """

    f: Callable
    n: int
    period: float | Callable | None
    start: tuple | Callable
    _traces: list = field(default_factory=list, repr=False)

    @property
    def free(self):
        """Is the period unknown?"""
        return self.period is None

    def begin(self, points):
        """Guesses of the state (N, n) and of the period (N), which is what it is where it is known."""
        guess = np.array([self._row("START(p)", self.start, p, self.n + self.free) for p in points])
        if self.free:
            return guess[:, :-1], guess[:, -1]
        period = np.array([self._row("PERIOD(p)", self.period, p, 1)[0] for p in points])
        return guess, period

    def _row(self, name, value, p, size):
        try:
            row = np.atleast_1d(np.asarray(value(p) if callable(value) else value, dtype=float))
        except Exception as error:
            raise Raised(name) from error
        if row.shape != (size,):
            what = "the states and a guess of the period" if size > self.n else "the states" if size > 1 else "a number"
            raise Unsupported(f"{name} returns {row.shape} numbers, not {size}: {what}")
        return row

    def traced(self, points, x0):
        """[(indices, Programs)] of the points; raises Unsupported or Raised."""
        left, found = np.arange(len(points)), []
        with LOCK:
            known = list(self._traces)
        zero = np.zeros(len(points))
        while left.size:
            for programs in known:
                inside = programs.A.holds(points[left], zero[left], zero[left] + 1.0) == 1
                if inside.any():
                    found.append((left[inside], programs))
                    left = left[~inside]
            if not left.size:
                break
            known = [self._trace(points[left[0]], x0[left[0]])]
            with LOCK:
                self._traces.extend(known)
                del self._traces[:-KEPT]
            if known[0].A.holds(points[left[:1]], zero[:1], zero[:1] + 1.0)[0] != 1:  # on the very edge of a branch
                found.append((left[:1], known[0]))
                left = left[1:]
        return found

    def _trace(self, point, x0):
        graph, n = Graph([float(x) for x in point], 0.25), self.n
        x, out = np.empty(n, dtype=object), np.zeros(n, dtype=object)
        for k in range(n):
            x[k] = graph.state(graph.number("parameter", len(point) + k), float(x0[k]))
        states = [graph.single(x[k]) for k in range(n)]
        try:
            value = trace.lifted(self.f)(graph.time, x, graph.parameters, out)
            out = out if value is None else np.array(value, dtype=object)
        except Unsupported as error:
            raise Unsupported(f"f(t, x, p, out): {error}") from None
        except ArithmeticError as error:
            raise Unsupported(f"f(t, x, p, out): {error}, while its operations are recorded") from None
        except Exception as error:
            raise Raised("f(t, x, p, out)") from error
        if out.shape != (n,):
            raise Unsupported(f"f(t, x, p, out) returns an array of shape {out.shape}, not {(n,)}")
        if not all(symbol.is_number for symbol, _yes in (*graph.guards, *graph.equalities)):
            raise Unsupported("f(t, x, p, out): a branch depends on t or on a state (abs and maximum are branches)")
        rows = [graph.lift(out[i]) for i in range(n)]
        graph.flow.update(zip(states, rows, strict=True))
        slopes = {(i, j): graph.slope(rows[i], state) for i in range(n) for j, state in enumerate(states)}
        places = [graph.series[state][1] for state in states]
        A = graph.compiled({at: symbol for at, symbol in slopes.items() if symbol is not None})
        if self.free and trace.TIME in A.order:
            raise Unsupported("f(t, x, p, out) depends on t, so that PERIOD must be given")
        f = graph.compiled({(i, 0): row for i, row in enumerate(rows)})
        return Programs(A, f, np.array(places))


@dataclass(frozen=True, eq=False)
class Programs:
    """A = df/dx and f (in column 0) as `trace.Program`s; `places` of the states among the numbers."""

    A: trace.Program
    f: trace.Program
    places: np.ndarray

    def numbers(self, points):
        """Values and error bounds of the numbers at the points; those of the states are 0."""
        values, errors = self.A.numbers(np.concatenate([points, np.zeros((len(points), len(self.places)))], axis=1))
        errors[:, self.places] = 0.0
        return values, errors

    def flow(self, numbers, x0, span, reach, derived=True, first=None, most=MOST_STEPS):
        """States at `span`, dX/dx0, largest states and numbers of steps; if `first` is given, steps and series."""
        N, n = x0.shape
        X, M, size, steps = np.full((N, n), np.nan), np.zeros((N * derived, n, n)), np.empty((N, n)), np.zeros(N, int)
        total = 0 if first is None else first[-1]
        recorded = np.empty(total), np.empty(total), np.empty((total, n, ORDER + 1))
        A = self.A
        flow(
            A.operations, A.signs, A.inside, A.order, A.used, A.terms, np.ascontiguousarray(numbers[0]), self.places,
            np.ascontiguousarray(x0), np.ascontiguousarray(span), reach, most,
            np.zeros(0, int) if first is None else first, X, M, size, steps, *recorded,
        )  # fmt: skip
        return (X, M, size, steps) if first is None else (X, *recorded)

    def slopes(self, numbers, t, x, width=0.0):
        """f (N, n) at states x (N, n), known to within `width`, and its bounds."""
        out = self.along(self.f, numbers, t[:, None], x[:, :, None], np.broadcast_to(width, x.shape)[:, :, None])
        return tuple(one[:, 0, :, 0] for one in out)

    def along(self, program, numbers, t, x, width):
        """A program's values (N, m, n, n) at times t (N, m), states x (N, n, m) known to within `width`, and bounds."""
        return program.at(t, t, x.shape[1], numbers, (x.swapaxes(0, 1), width.swapaxes(0, 1)))


def solve(equation, points, method, rtol, wanted):
    """The wanted outputs of the points (N, parameters), each with `_error` if it is a float, and `status`."""
    method = monodromy.method_of(method)
    parts = [
        _chunk(equation, points[i : i + CHUNK], method, rtol, wanted) for i in range(0, max(len(points), 1), CHUNK)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _chunk(equation, points, method, rtol, wanted):
    n, N = equation.n, len(points)
    free = equation.free
    known = np.isfinite(points).all(axis=1)
    guess, period = np.full((N, n), np.nan), np.full(N, np.nan)
    guess[known], period[known] = equation.begin(points[known])
    known &= np.isfinite(guess).all(axis=1) & np.isfinite(period) & (period > 0)
    where = np.flatnonzero(known)
    found = Found(N, n, free)
    for inside, programs in equation.traced(points[where], guess[where]):
        own = where[inside]
        numbers = programs.numbers(points[own])
        reach = method.floquet_reach(rtol)
        orbits = Newton(programs, numbers, reach, guess[own], period[own], free)
        good = orbits.solve()
        good = np.sort(np.concatenate([good, orbits.again(np.setdiff1d(np.arange(own.size), good))]))
        step_counts = programs.flow(
            _of(numbers, good), orbits.x[good], orbits.T[good], reach, derived=False
        )[3]  # fmt: skip
        ends = np.cumsum(step_counts) * n * (ORDER + 1)
        cuts = np.searchsorted(ends, np.arange(CALL, ends[-1], CALL)) if good.size else []
        for some in np.split(np.arange(good.size), cuts):
            if some.size:
                those = good[some]
                shown = _certified(
                    programs, _of(numbers, those), orbits.x[those], orbits.T[those],
                    orbits.guess[those], orbits.plane(those), step_counts[some], method, reach,
                )  # fmt: skip
                found.put(own[those], shown)
    return found.outputs(known, rtol, wanted, callable(equation.period))


def _of(numbers, those):
    return tuple(np.ascontiguousarray(one[those]) for one in numbers)


class Newton:
    """Newton's method for N points, from states x (N, n) and periods T (N), which are unknown too if `free`."""

    def __init__(self, programs, numbers, reach, x, T, free):
        self.programs, self.numbers, self.reach = programs, numbers, reach
        self.x, self.T, self.guess, self.period = x.copy(), T.copy(), x.copy(), T
        self.phase = programs.slopes(numbers, np.zeros(len(x)), x)[0] if free else None

    def plane(self, those):
        """Normals and points of the planes in which x of these points stays; None if T is known."""
        return None if self.phase is None else (self.phase[those], self.guess[those])

    def again(self, those):
        """As `solve`, for some points, from the state after a long time."""
        numbers, free = _of(self.numbers, those), self.phase is not None
        span = RELAXED * self.period[those]
        x = self.programs.flow(numbers, self.guess[those], span, self.reach, derived=False, most=MOST_RELAXED)[0]
        T = self.period[those].copy()
        there = np.flatnonzero(np.isfinite(x).all(axis=1))
        if free and there.size:
            T[there] = self._return(_of(numbers, there), x[there], T[there])
            there = there[np.isfinite(T[there])]
        if not there.size:
            return those[:0]
        other = Newton(self.programs, _of(numbers, there), self.reach, x[there], T[there], free)
        found, to = other.solve(), those[there]
        for name in ("x", "T", "guess", *(("phase",) if free else ())):
            getattr(self, name)[to[found]] = getattr(other, name)[found]
        return to[found]

    def _return(self, numbers, x, T):
        """When the motions from x (N, n) first come back near x, from behind; NaN: not in RETURN T."""
        steps = self.programs.flow(numbers, x, RETURN * T, self.reach, derived=False)[3]
        first = np.concatenate([[0], np.cumsum(steps)])
        _X, begin, _length, series = self.programs.flow(numbers, x, RETURN * T, self.reach, False, first)
        f, found = self.programs.slopes(numbers, np.zeros(len(x)), x)[0], np.full(len(x), np.nan)
        for i in range(len(x)):
            t, states = begin[first[i] : first[i + 1]], series[first[i] : first[i + 1], :, 0]
            along = ((states - x[i]) * f[i]).sum(axis=1)
            for k in np.flatnonzero((along[:-1] < 0) & (along[1:] >= 0)):
                share = along[k] / (along[k] - along[k + 1])
                off = abs(states[k] + share * (states[k + 1] - states[k]) - x[i])
                if (off <= NEAR * np.ptp(states, axis=0)).all():
                    found[i] = t[k] + share * (t[k + 1] - t[k])
                    break
        return found

    def solve(self):
        """The points where it converges; their x and T are the orbit's, nearly."""
        N = len(self.x)
        damping, found, live = np.ones(N), np.zeros(N, bool), np.arange(N)
        value, inverse, size = self._linearised(live, self.x, self.T)
        step = -_applied(inverse, value)
        live = live[np.isfinite(step).all(axis=1)]
        for _ in range(TRIALS):
            done = self._norm(step[live], size[live], live) <= CONVERGED
            if done.any():
                last = live[done]
                x, T = self._moved(last, step[last])
                self.x[last], self.T[last], found[last] = x, T, True
                live = live[~done]
            if not live.size:
                break
            damping[live] = np.minimum(damping[live], FARTHEST / self._norm(step[live], size[live], live))
            x, T = self._moved(live, damping[live, None] * step[live])
            new, new_inverse, new_size = self._linearised(live, x, T)
            with np.errstate(all="ignore"):
                simplified = -_applied(inverse[live], new)
                ratio = self._norm(simplified, size[live], live) / self._norm(step[live], size[live], live)
                better = (ratio <= 1.0 - 0.5 * damping[live]) & np.isfinite(new_inverse).all(axis=(1, 2))
            took = live[better]
            self.x[took], self.T[took] = x[better], T[better]
            inverse[took], size[took] = new_inverse[better], new_size[better]
            step[took] = -_applied(new_inverse[better], new[better])
            damping[took] = np.minimum(1.0, 4.0 * damping[took])
            damping[live[~better]] *= 0.25
            live = live[damping[live] >= LEAST_DAMPING]
        return np.flatnonzero(found)

    def _moved(self, those, step):
        x = self.x[those] + step[:, : self.x.shape[1]]
        if self.phase is None:
            return x, self.T[those]
        T = self.T[those]
        return x, T + step[:, -1]

    def _linearised(self, those, x, T):
        """G, the inverse of its derivative, and the sizes of the unknowns."""
        numbers, n = _of(self.numbers, those), x.shape[1]
        X, M, size, _steps = self.programs.flow(numbers, x, T, self.reach)
        value, slope = X - x, M - np.eye(n)
        if self.phase is not None:
            f, c = self.programs.slopes(numbers, T, X)[0], self.phase[those]
            plane = (c * (x - self.guess[those])).sum(axis=1)
            value, slope = np.concatenate([value, plane[:, None]], axis=1), _bordered(slope, f, c)
            size = np.concatenate([size, T[:, None]], axis=1)
            across = (c * self.programs.slopes(numbers, T, x)[0]).sum(axis=1)
            slope[~(across >= ACROSS * (c * c).sum(axis=1))] = np.nan
        slope[~np.isfinite(value).all(axis=1)] = np.nan
        return value, _inverse(slope), size

    def _norm(self, step, size, those):
        with np.errstate(all="ignore"):
            # a state that is 0 all the time has no size
            own = np.concatenate([size[:, : self.x.shape[1]], abs(self.guess[those])], axis=1)
            least = 1e-3 * own.max(axis=1, keepdims=True) + 1e-300
            return (abs(step) / np.maximum(size, least)).max(axis=1)


def _bordered(slope, column, row):
    """(slope column; row 0)."""
    top = np.concatenate([slope, column[:, :, None]], axis=2)
    bottom = np.concatenate([row, np.zeros((len(row), 1))], axis=1)
    return np.concatenate([top, bottom[:, None]], axis=1)


def _inverse(matrices):
    """The inverses (N, n, n); NaN where there is none."""
    good = np.isfinite(matrices).all(axis=(1, 2))
    out = np.full(matrices.shape, np.nan)
    for i in np.flatnonzero(good):
        try:
            out[i] = np.linalg.inv(matrices[i])
        except np.linalg.LinAlgError:
            continue
    return out


def _applied(matrices, vectors):
    """The products (N, n), with sums in the same order in any block."""
    with np.errstate(all="ignore"):
        return (matrices * vectors[:, None, :]).sum(axis=2)


@dataclass
class Shown:
    """Orbits that exist: states, periods, M and what their multipliers follow from, each with bounds."""

    good: np.ndarray
    x: np.ndarray
    dx: np.ndarray
    T: np.ndarray
    dT: np.ndarray
    M: np.ndarray
    dM: np.ndarray
    others: monodromy.Matrices

    def improve(self, other):
        """Take those over that only `other` shows."""
        those = ~self.good & other.good
        for one in fields(self):
            getattr(self, one.name)[those] = getattr(other, one.name)[those]


def _certified(programs, numbers, x, T, guess, plane, counts, method, reach):
    """Shown, of orbits near (x, T); see the head of the module. All is in the units that balance A, but the results."""
    with np.errstate(all="ignore"):
        path = Path(programs, numbers, x, T, counts, reach)
        path.enough = WIDEST * np.maximum(path.extent, (abs(guess) / path.scale).max(axis=1))
        path.propagate(method)
        shown = path.certify(x, T, plane, RADII[0])
        for factor in RADII[1:]:
            if not shown.good.all():
                shown.improve(path.certify(x, T, plane, factor))
        return shown


class Path:
    """The Taylor series of the steps along N orbits, whose bounds follow."""

    def __init__(self, programs, numbers, x, T, counts, reach):
        N, n = x.shape
        self.programs, self.n = programs, n
        self.first = np.concatenate([[0], np.cumsum(counts)])
        self.point = np.repeat(np.arange(N), counts)
        self.last = self.first[1:] - 1
        self.own = numbers
        self.numbers = _of(numbers, self.point)
        X, begin, self.h, series = programs.flow(numbers, x, T, reach, derived=False, first=self.first)
        self.begin, self.t = begin, begin[:, None] + self.h[:, None] * NODES
        k = np.arange(ORDER + 1.0)
        moduli = abs(series)
        self.X, self.noise_X = _sum(series), ROUNDOFF_UP * _sum(moduli * (2 * k + 2))
        dX = _sum((series * k)[:, :, 1:]) / self.h[:, None, None]
        noise = ROUNDOFF_UP * _sum((moduli * k * (2 * k + 2))[:, :, 1:]) / self.h[:, None, None]
        f, df = (one[..., 0].swapaxes(1, 2) for one in self._along(programs.f, self.noise_X))
        self.defect = SAMPLED * self.h[:, None] * (abs(dX - f) + df + noise).max(axis=2)
        # a series begins where the one before it ends, as it is summed
        end, begins = self.X[:-1, :, -1], series[1:, :, 0]
        self.defect[:-1] += np.where((self.point[1:] == self.point[:-1])[:, None], abs(end - begins), 0.0)
        self.defect += self.noise_X[:, :, -1]
        self.f_end = f[self.last, :, -1]
        A, dA = self._along(programs.A, self.noise_X)
        largest = np.maximum.reduceat(abs(A).max(axis=1), self.first[:-1], axis=0)
        self.scale = monodromy.balanced(largest)
        self.ratio = (self.scale[:, None, :] / self.scale[:, :, None])[self.point]
        self.norm = SAMPLED * (abs(A).max(axis=1) * self.ratio).sum(axis=2).max(axis=1)
        self.noise = SAMPLED * self._rows(dA)
        size = (abs(self.X).max(axis=2) / self.scale[self.point]).max(axis=1)
        self.extent = np.maximum.reduceat(size, self.first[:-1])
        self.end = X

    def _along(self, program, width):
        return self.programs.along(program, self.numbers, self.t, self.X, width)

    def _rows(self, errors):
        """The maximum norm of errors of A (tasks, m, n, n), the largest at NODES, in balanced units."""
        return (errors * self.ratio[:, None]).sum(axis=3).max(axis=(1, 2))

    def propagate(self, method):
        """The propagators F of the steps, with bounds of their errors in each entry."""
        tasks, n, A = len(self.point), self.n, self.programs.A
        values = self.numbers[0].copy()
        values[:, self.programs.places] = self.X[:, :, MIDDLE]
        self.F, self.error, self.doubt = np.empty((tasks, n, n)), np.empty(tasks), np.empty(tasks)
        method.floquet_factors(
            A.operations, A.signs, A.inside, A.order, A.used, A.terms, values, self.scale[self.point], self.noise, n,
            np.arange(tasks), self.begin + 0.5 * self.h, 0.5 * self.h, self.F, self.error, self.doubt,
        )  # fmt: skip

    def _spread(self, delta):
        wide, off = np.empty((2, len(self.point), self.n))
        spread(self.F, np.ascontiguousarray(delta), self.first, wide, off)
        return wide, off

    def certify(self, x, T, plane, factor):
        """Shown of the orbits near x (N, n), T (N), within `factor` |B G|."""
        n, N, point, last, s = self.n, len(x), self.point, self.last, self.scale
        delta = self.defect / s[point]
        wide, off = self._spread(delta)
        M, E = np.empty((2, N, n, n))
        products(self.F, self.error, self.doubt, self.first, n, M, E, np.empty_like(E))
        f_end, a_end = self.f_end / s, self.norm[last]
        fastest = abs(f_end).max(axis=1)
        dT = 4 * EPS * T
        off_G = abs(self.end - x) / s * (1 + EPS) + off[last] + (dT * fastest)[:, None]
        slope = M - np.eye(n)
        if plane is not None:
            unit = 1.0 / fastest  # of T
            row = plane[0] * s
            row /= abs(row).max(axis=1, keepdims=True)
            planar = plane[0] * s / abs(plane[0] * s).max(axis=1, keepdims=True) * ((x - plane[1]) / s)
            phase = abs(planar.sum(axis=1)) + (n + 4) * EPS * abs(planar).sum(axis=1)
            off_G = np.concatenate([off_G, phase[:, None]], axis=1)
            slope = _bordered(slope, f_end * unit[:, None], row)
        B = _inverse(slope)
        size = abs(B)
        near = (size * off_G[:, None, :]).sum(axis=2).max(axis=1)
        radius = factor * near
        # the tube, in the maximum norm of balanced units
        begins = np.concatenate([[0.0], (wide[:-1] * radius[point[:-1], None] + off[:-1]).max(axis=1)])
        begins[self.first[:-1]] = radius
        tube = WIDER * (np.exp(self.h * self.norm) * begins + delta.max(axis=1))
        width = self.noise_X + (tube[:, None] * s[point])[:, :, None]
        noise = WIDER * SAMPLED * self._rows(self._along(self.programs.A, width)[1])
        error = self.error + self.h * noise * np.exp(self.h * (self.norm + noise))
        doubt = self.doubt * (error / self.error)
        second = self._spread(np.repeat((n * error * WIDER * begins)[:, None], n, axis=1))[1].max(axis=1)
        first_order = (wide * radius[point, None] + off).max(axis=1)
        stays = (second <= (WIDER - 1.0) * first_order) & (tube <= self.enough[point])
        stays = np.logical_and.reduceat(stays, self.first[:-1])
        R = np.empty_like(E)
        products(self.F, error, doubt, self.first, n, M, E, R)
        shift = dT if plane is None else dT + radius * unit
        E = E + (WIDER * shift * a_end)[:, None, None] * (abs(M) + E).max(axis=1, keepdims=True)
        bounds = E
        if plane is not None:
            moved = a_end * (WIDER * first_order[last] + shift * fastest) + 4 * EPS * fastest
            bounds = _bordered(E, np.repeat((WIDER * unit * moved)[:, None], n, axis=1), 4 * EPS * abs(row))
        m = n if plane is None else n + 1
        residual = abs(_product(B, slope) - np.eye(m)) + (m + 4) * EPS * _product(size, abs(slope))
        q = (residual + _product(size, bounds)).sum(axis=2).max(axis=1)
        off_G[:, :n] += second[last, None]
        near = (size * off_G[:, None, :]).sum(axis=2).max(axis=1)
        shown = stays & (q < 1) & (near <= (1 - q) * radius) & np.isfinite(E).all(axis=(1, 2))
        final = np.minimum(near / (1 - q), radius) * (1 + 8 * EPS)
        dx = final[:, None] * s
        f = df = None
        if plane is not None:
            dT = final * unit * (1 + 4 * EPS) + EPS * T
            f, df = self.programs.slopes(self.own, np.zeros(N), x, dx)
            f, df = f / s, (WIDER * df + 8 * EPS * abs(f)) / s
        others = self._sharp(M, E, R, error, doubt, WIDER * shift * a_end, np.flatnonzero(shown), f, df)
        back = s[:, :, None] / s[:, None, :]
        return Shown(shown, x, dx + EPS * abs(x), T, dT, M * back, E * back, others)

    def _sharp(self, M, E, R, error, doubt, late, which, f, df):
        """The Matrices of the multipliers that are judged: those of M, or, if f is given, those but for its +1.

        Errors are carried in the coordinates of eigenvectors; `late` bounds what the end's shift adds, relative to M.
        """
        N, n = M.shape[:2]
        judged, bounds = (M, E) if f is None else deflated(M, E, f, df)
        found = monodromy.Matrices.plain(judged, bounds)
        values, vectors = np.ones((N, n), complex), np.full((N, n, n), np.nan, complex)
        own, directions = np.linalg.eig(judged[which])
        if f is None:
            values[which], vectors[which] = own, directions
        else:
            values[which, 1:] = own
            vectors[which] = completed(M[which], f[which], own, directions)
        inverses = np.full_like(vectors, np.nan)
        inverses[which] = monodromy.inverse(vectors[which])
        extra = np.full((N, n, n), np.nan)
        carried(self.F, error, doubt, self.first, which, n, vectors, inverses, extra)
        tall = _product(abs(M) + E, abs(vectors))
        extra += late[:, None, None] * abs(inverses).sum(axis=2)[:, :, None] * tall.max(axis=1, keepdims=True)
        if f is None:
            found.R, found.extra, found.V, found.W, found.centre = R, extra, vectors, inverses, values
        else:
            # V^-1 M V, V including f, is near diag(1, centre); f itself is V (1, off)
            known = np.full((N, n, n), np.inf)
            couplings(M, R, extra, values, vectors, inverses, known)
            off = 1.01 * _applied(abs(inverses), df)
            share = np.where(off[:, :1] < 0.01, 1.02 * off, np.inf)
            found.extra = (known[:, 1:, 1:] + share[:, 1:, None] * known[:, :1, 1:]) * (1 + 8 * EPS)
            found.R = np.zeros_like(judged)
            found.centre[which], found.V[which] = own, directions
            found.W[which] = monodromy.inverse(directions)
        found.sharp[which] = np.isfinite(found.extra[which]).all(axis=(1, 2))
        return found


def _sum(series):
    """The series (N, n, K) at NODES (N, n, m), by Horner's rule."""
    total = np.zeros((*series.shape[:2], NODES.size))
    for k in range(series.shape[2] - 1, -1, -1):
        total = total * NODES + series[:, :, k, None]
    return total


def _product(A, B):
    """Products of matrices (N, n, n), with sums in the same order in any block."""
    return (A[:, :, :, None] * B[:, None, :, :]).sum(axis=2)


def deflated(M, E, f, df):
    """M without its multiplier +1, whose eigenvector is f to within df (N, n): (N, n - 1, n - 1), and bounds.

    In the coordinates x_i - (f_i / f_k) x_k, i not k, f is 0.
    """
    N, n = f.shape
    out, bounds = np.empty((2, N, n - 1, n - 1))
    rows, (k, rest) = np.arange(N), _pivots(f)
    pivot = f[rows, k]
    q = f / pivot[:, None]
    dq = (df + abs(q) * df[rows, k, None]) / (abs(pivot) - df[rows, k])[:, None] + 2 * EPS * abs(q)
    dq = np.where((abs(pivot) > df[rows, k])[:, None], dq, np.inf)
    line, d_line = M[rows, k], E[rows, k]
    for i in range(n - 1):
        a = rest[:, i]
        for j in range(n - 1):
            b = rest[:, j]
            own, from_k, d_k = M[rows, a, b], line[rows, b], d_line[rows, b]
            share, d_share = q[rows, a], dq[rows, a]
            out[:, i, j] = own - share * from_k
            bounds[:, i, j] = E[rows, a, b] + abs(share) * d_k + d_share * (abs(from_k) + d_k)
            bounds[:, i, j] += 2 * EPS * (abs(own) + abs(share * from_k))
    return out, bounds


def completed(M, f, values, directions):
    """Eigenvectors of M (N, n, n): f, that of +1, and those that the eigenvectors of `deflated` M stand for."""
    N, n = f.shape
    rows, (k, rest) = np.arange(N), _pivots(f)
    out = np.zeros((N, n, n), complex)
    out[:, :, 0] = f
    out[rows[:, None], rest, 1:] = directions
    along = (M[rows, k][:, :, None] * out[:, :, 1:]).sum(axis=1) / f[rows, k, None]
    with np.errstate(all="ignore"):
        out[:, :, 1:] += f[:, :, None] * (along / (values - 1.0))[:, None, :]
    return np.where(np.isfinite(out), out, np.nan)


def _pivots(f):
    """The place of the largest component of f (N, n), and the others."""
    n = f.shape[1]
    k = abs(f).argmax(axis=1)
    return k, np.array([[j for j in range(n) if j != i] for i in range(n)])[k]


class Found:
    """The results of N points as they come in."""

    def __init__(self, N, n, free):
        m = n - free
        self.n, self.m, self.free = n, m, free
        self.good = np.zeros(N, bool)
        self.x, self.dx, self.T, self.dT = (np.full(shape, np.nan) for shape in ((N, n), (N, n), N, N))
        self.M, self.others = np.full((N, 2, n, n), np.nan), monodromy.Matrices.empty(N, m)

    def put(self, points, shown):
        """Keep what is Shown of these points."""
        to = points[shown.good]
        self.good[to] = True
        for name in ("x", "dx", "T", "dT"):
            getattr(self, name)[to] = getattr(shown, name)[shown.good]
        self.M[to, 0], self.M[to, 1] = shown.M[shown.good], shown.dM[shown.good]
        self.others[to] = shown.others[shown.good]

    def outputs(self, known, rtol, wanted, computed):
        """The wanted outputs; `known`: the points that have a start and a period."""
        N = len(self.good)
        matrices = self.others
        answer = stability.assess(matrices, "none", rtol, wanted)
        answer.status[~self.good] = NO_ORBIT
        answer.status[~known] = status.INVALID_PARAMETERS
        answer.verdict[~self.good], answer.crossing[~self.good] = stability.UNDECIDED, stability.UNDECIDED
        out = stability.outputs(answer, matrices, self.T, computed, wanted)
        ok = answer.status == status.OK
        if "exponent" in wanted:
            with np.errstate(invalid="ignore"):
                out["exponent_error"] = out["exponent_error"] + abs(out["exponent"]) * 1.01 * self.dT / self.T
        own = {"x0": self.x, "x0_error": self.dx, "period": self.T, "period_error": self.dT}
        own |= {"monodromy": self.M[:, 0], "monodromy_error": self.M[:, 1]}
        for name, values in own.items():
            if name.removesuffix("_error") in wanted:
                out[name] = np.where(ok.reshape(N, *[1] * (values.ndim - 1)), values, np.nan)
        return out
