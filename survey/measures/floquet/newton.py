"""Newton's method for x(T) = x(0), damped, or for half an orbit (`symmetry`); see
`measures.floquet.orbit`.

Source: P. Deuflhard, Newton Methods for Nonlinear Problems (2004), 3.3.
"""

from dataclasses import dataclass

import numpy as np

from survey.measures.floquet import monodromy

# steps of the long time before an orbit, and their accuracy
MOST_RELAXED, RELAXED_RTOL = 10_000, 1e-10
TRIALS, LEAST_DAMPING = 40, 1e-4
CONVERGED = 1e-8  # relative: the last step, whose square is beyond float64
# until the last step is so small, the flow needs less accuracy
ROUGH_REACH, ROUGH, ROUGHLY = 2.0, 1e-9, 1e-5
FARTHEST = 0.2  # a step of it, relative to the orbit and the period
ACROSS = 0.1  # how fast the plane is passed, relative to the start: equilibria are no orbits
# periods; the time in which an orbit comes back; how near, relative to it
RELAXED, RETURN, NEAR = 32.0, 3.0, 0.2
# by what a period that is found may be a multiple of the least; how near the state is then, relative
MULTIPLES, CLOSED = (2, 3, 5), 1e-7


def chosen(numbers, those):
    """The numbers of some points."""
    return tuple(np.ascontiguousarray(one[those]) for one in numbers)


@dataclass
class LocatedOrbits:
    """Orbits by Newton's method: states and periods, the points and normals of their planes
    (normals only where T is unknown), the largest moduli of the states, and numbers of steps.
    """

    x: np.ndarray
    T: np.ndarray
    guess: np.ndarray
    phase: np.ndarray
    size: np.ndarray
    steps: np.ndarray


def located(equation, points, reach, x, T, relax=True):
    """The LocatedOrbits at the points (N, parameters), and the numbers of those that are found,
    beginning at x (N, n), T.

    With `relax`, those that are not found are looked for again from the state after a long time,
    unless these orbits are symmetric, as those of conservative systems, which attract nothing.
    Periods that are unknown are the least ones: an orbit passed twice is no other orbit.
    """
    found = LocatedOrbits(
        *(np.full(np.shape(a), np.nan) for a in (x, T, x, x, x)), np.zeros(len(x), int)
    )
    good = [np.zeros(0, int)]
    usable = np.flatnonzero(
        np.isfinite(points).all(axis=1) & np.isfinite(x).all(axis=1) & (T > 0) & np.isfinite(T)
    )
    for inside, programs in equation.traced(points[usable], x[usable]):
        own = usable[inside]
        orbits = Newton(programs, programs.numbers(points[own]), reach, x[own], T[own], equation)
        those = orbits.solve()
        if relax and equation.symmetry is None:
            those = np.sort(
                np.concatenate([those, orbits.restarted(np.setdiff1d(np.arange(own.size), those))])
            )
        if equation.free:
            orbits.shorten(those)
            found.phase[own] = orbits.phase
        found.x[own], found.T[own], found.guess[own] = orbits.x, orbits.T, orbits.guess
        numbers = chosen(orbits.numbers, those)
        span = equation.share * orbits.T[those]
        X, _M, size, steps = programs.flow(numbers, orbits.x[those], span, reach, derived=False)
        there = np.isfinite(X).all(axis=1)
        found.size[own[those]], found.steps[own[those]] = size, steps
        good.append(own[those[there]])
    return found, np.sort(np.concatenate(good))


class Newton:
    """Newton's method for N points, from states x (N, n) and periods T (N), which may be unknown too."""

    def __init__(self, programs, numbers, reach, x, T, equation):
        self.programs, self.numbers, self.reach, self.equation = programs, numbers, reach, equation
        self.x = x.copy()
        self.T = T.copy()
        self.guess = x.copy()
        self.period = T
        self.phase = programs.slopes(numbers, np.zeros(len(x)), x)[0] if equation.free else None

    def restarted(self, those):
        """As `solve`, for some points, from the state after a long time."""
        numbers = chosen(self.numbers, those)
        free = self.phase is not None
        span = RELAXED * self.period[those]
        # the same whatever accuracy is asked: the plane in which an orbit begins rests on it
        reach = monodromy.method_of("auto").floquet_reach(RELAXED_RTOL)
        x = self.programs.flow(
            numbers, self.guess[those], span, reach, derived=False, most=MOST_RELAXED
        )[0]
        T = self.period[those].copy()
        there = np.flatnonzero(np.isfinite(x).all(axis=1))
        if free and there.size:
            T[there] = self._return(chosen(numbers, there), x[there], T[there])
            there = there[np.isfinite(T[there])]
        if not there.size:
            return those[:0]
        other = Newton(
            self.programs, chosen(numbers, there), self.reach, x[there], T[there], self.equation
        )
        found, to = other.solve(), those[there]
        for name in ("x", "T", "guess", *(("phase",) if free else ())):
            getattr(self, name)[to[found]] = getattr(other, name)[found]
        return to[found]

    def shorten(self, those):
        """Make the periods of the orbits at these points the least ones."""
        symmetry = self.equation.symmetry
        ends = slice(None) if symmetry is None else symmetry.ends
        for factor in MULTIPLES:
            left = those
            while left.size:
                numbers, x, T = chosen(self.numbers, left), self.x[left], self.T[left]
                span = self.equation.share * T / factor
                X = self.programs.flow(numbers, x, span, self.reach, derived=False)[0]
                off = (X - x if symmetry is None else X)[:, ends]
                f = self.programs.slopes(numbers, np.zeros(left.size), x)[0]
                # a small orbit far from 0 is small beside its states, but not beside its path
                left = left[abs(off).max(axis=1) <= CLOSED * T * abs(f).max(axis=1)]
                self.T[left] /= factor

    def _return(self, numbers, x, T):
        """When the motions from x (N, n) first come back near x, from behind; NaN: not in RETURN T."""
        steps = self.programs.flow(numbers, x, RETURN * T, self.reach, derived=False)[3]
        first = np.concatenate([[0], np.cumsum(steps)])
        _X, begin, _length, series = self.programs.flow(
            numbers, x, RETURN * T, self.reach, False, first
        )
        f = self.programs.slopes(numbers, np.zeros(len(x)), x)[0]
        found = np.full(len(x), np.nan)
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
        near = self._solve(
            np.arange(len(self.x)), {"reach": ROUGH_REACH, "tolerance": ROUGH}, ROUGHLY
        )
        return self._solve(near, {"reach": self.reach}, CONVERGED)

    def _solve(self, those, how, converged):
        """Those of some points where the last step is below `converged`; `how` the flow is computed."""
        N = len(self.x)
        damping, found, live = np.ones(N), np.zeros(N, bool), those
        m = self.x.shape[1] + (self.phase is not None)
        step = np.full((N, m), np.nan)
        inverse = np.full((N, m, m), np.nan)
        size = np.ones((N, m))
        value, inverse[live], size[live] = self._linearised(live, self.x[live], self.T[live], how)
        step[live] = -applied(inverse[live], value)
        live = live[np.isfinite(step[live]).all(axis=1)]
        for _ in range(TRIALS):
            done = self._norm(step[live], size[live], live) <= converged
            if done.any():
                last = live[done]
                x, T = self._moved(last, step[last])
                self.x[last], self.T[last], found[last] = x, T, True
                live = live[~done]
            if not live.size:
                break
            damping[live] = np.minimum(
                damping[live], FARTHEST / self._norm(step[live], size[live], live)
            )
            x, T = self._moved(live, damping[live, None] * step[live])
            new, new_inverse, new_size = self._linearised(live, x, T, how)
            with np.errstate(all="ignore"):
                simplified = -applied(inverse[live], new)
                ratio = self._norm(simplified, size[live], live) / self._norm(
                    step[live], size[live], live
                )
                better = (ratio <= 1.0 - 0.5 * damping[live]) & np.isfinite(new_inverse).all(
                    axis=(1, 2)
                )
            took = live[better]
            self.x[took], self.T[took] = x[better], T[better]
            inverse[took], size[took] = new_inverse[better], new_size[better]
            step[took] = -applied(new_inverse[better], new[better])
            damping[took] = np.minimum(1.0, 4.0 * damping[took])
            damping[live[~better]] *= 0.25
            live = live[damping[live] >= LEAST_DAMPING]
        return np.flatnonzero(found)

    def _moved(self, those, step):
        x = self.x[those] + step[:, : self.x.shape[1]]
        if self.equation.symmetry is not None:
            x = self.equation.symmetry.started(x, self.guess[those])
        if self.phase is None:
            return x, self.T[those]
        T = self.T[those]
        return x, T + step[:, -1]

    def _linearised(self, those, x, T, how):
        """G, the inverse of its derivative, and the sizes of the unknowns."""
        numbers = chosen(self.numbers, those)
        n = x.shape[1]
        X, M, size, _steps = self.programs.flow(numbers, x, self.equation.share * T, **how)
        value, slope = X - x, M - np.eye(n)
        if self.phase is not None:
            f, c, guess = (
                self.programs.slopes(numbers, T, X)[0],
                self.phase[those],
                self.guess[those],
            )
            if self.equation.symmetry is None:
                plane = (c * (x - guess)).sum(axis=1)
                value, slope = (
                    np.concatenate([value, plane[:, None]], axis=1),
                    bordered(slope, f, c),
                )
            else:
                value, slope = self.equation.symmetry.linearised(X, M, f, x, guess)
            size = np.concatenate([size, T[:, None]], axis=1)
            across = (c * self.programs.slopes(numbers, T, x)[0]).sum(axis=1)
            slope[~(across >= ACROSS * (c * c).sum(axis=1))] = np.nan
        slope[~np.isfinite(value).all(axis=1)] = np.nan
        return value, inverse(slope), size

    def _norm(self, step, size, those):
        with np.errstate(all="ignore"):
            # a state that is 0 all the time has no size
            own = np.concatenate([size[:, : self.x.shape[1]], abs(self.guess[those])], axis=1)
            least = 1e-3 * own.max(axis=1, keepdims=True) + 1e-300
            return (abs(step) / np.maximum(size, least)).max(axis=1)


def bordered(slope, column, row):
    """(slope column; row 0)."""
    top = np.concatenate([slope, column[:, :, None]], axis=2)
    bottom = np.concatenate([row, np.zeros((len(row), 1))], axis=1)
    return np.concatenate([top, bottom[:, None]], axis=1)


def inverse(matrices):
    """The inverses (N, n, n); NaN where there is none."""
    good = np.isfinite(matrices).all(axis=(1, 2))
    out = np.full(matrices.shape, np.nan)
    for i in np.flatnonzero(good):
        try:
            out[i] = np.linalg.inv(matrices[i])
        except np.linalg.LinAlgError:
            continue
    return out


def applied(matrices, vectors):
    """The products (N, n), with sums in the same order in any block."""
    with np.errstate(all="ignore"):
        return (matrices * vectors[:, None, :]).sum(axis=2)
