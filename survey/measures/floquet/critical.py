"""Periodic orbits with a multiplier on the unit circle: the equation that has them as isolated
solutions.

Time is counted in periods, and everything is a state: y = (x, v, w, angle, drift, T, p), of which T
and the varied parameters p are constant. With A = df/dx,

    x' = T f(T t, x, p)
    v' = T A v + angle w        v and w: the real and the imaginary part of the multiplier's eigenvector, turned back
    w' = T A w - angle v        by its argument, `angle`

Of real multipliers there is no w and no angle. Where T is unknown, the orbit at a fold is one whose
derivative by (x(0), T) is singular: v' = T A v + drift f. Every state is 1-periodic, but v(1) =
-v(0) where the multiplier is -1. Where f(t + T/2, S x) = S f(t, x), S a diagonal matrix of signs,
orbits may be their own mirror images, x(T/2) = S x(0). Their multipliers are the squares of those
of S dx(T/2)/dx(0), which are 1 or -1 where theirs is 1: at a fold, or where two others branch off,
which are each other's mirror images. There time is counted in half periods, and y(1) is S y(0), but
for a sign of v.

Besides, y obeys linear conditions: v (and w) have a given size along themselves, x stays in a plane
across the motion where T is unknown (v too, at a fold), and a condition is imposed on p.

The derivatives of these equations, which Newton's method and proofs need, are those of the recorded
operations.

Source: W. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (2000), 4; Yu. A.
Kuznetsov, Elements of Applied Bifurcation Theory (2004), 10.3.
"""

from dataclasses import dataclass

import numpy as np

from survey.measures.floquet import trace
from survey.measures.floquet.equation import Equation, compiled
from survey.measures.floquet.multipliers import MINUS_ONE, NEIMARK_SACKER, PLUS_ONE
from survey.measures.floquet.trace import Graph


@dataclass(frozen=True, eq=False)
class Critical(Equation):
    """The equation of orbits of `Equation` with a multiplier of this `kind`; `varied`: numbers of
    parameters.

    `mirror`: the signs S, of orbits that are their own mirror images; `branching`: others branch
    off from these.
    """

    kind: int = PLUS_ONE
    varied: tuple = ()
    mirror: tuple | None = None
    branching: bool = False
    BRANCHES = "t, a state or an axis of the map"

    @classmethod
    def of(cls, equation, varied, kind, mirror=None, branching=False):
        """The Critical equation of the orbits of an Equation."""
        own = equation.f, equation.n, equation.period, equation.start
        return cls(*own, kind=kind, varied=tuple(varied), mirror=mirror, branching=branching)

    @property
    def moving(self):
        """The number of states that are not constant: x, v and w."""
        return (3 if self.kind == NEIMARK_SACKER else 2) * self.n

    @property
    def size(self):
        """The number of states."""
        return self.parameters_at + len(self.varied)

    @property
    def angle_at(self):
        """The index of the angle, or of the drift."""
        return self.moving

    @property
    def drifts(self):
        """Is there a drift?"""
        return self.free and self.kind == PLUS_ONE and not self.branching

    @property
    def period_at(self):
        """The index of T, if it is unknown."""
        return self.moving + (self.kind == NEIMARK_SACKER or self.drifts)

    @property
    def parameters_at(self):
        """The index of the first of the varied parameters."""
        return self.period_at + self.free

    @property
    def signs(self):
        """What states that are not constant are multiplied by after a period, to be the same."""
        signs = np.ones(self.n) if self.mirror is None else np.array(self.mirror)
        turned = -1.0 if self.kind == MINUS_ONE or self.branching else 1.0
        return np.concatenate([signs, *[turned * signs] * (self.moving // self.n - 1)])

    def points(self, given, y):
        """The parameters (N, parameters) at y (N, size), the others as they are given."""
        points = np.array(given, dtype=float)
        points[:, list(self.varied)] = y[:, self.parameters_at :]
        return points

    def recorded(self, point, x0):
        n = self.n
        graph = Graph([float(x) for x in point], 0.25)
        y = self._symbols(graph, len(point), x0)
        p = list(graph.parameters)
        for k, at in enumerate(self.varied):
            p[at] = y[self.parameters_at + k]
        T = y[self.period_at] if self.free else self._period(graph, p)
        T = T if self.mirror is None else 0.5 * T
        x = y[:n].copy()
        f = self._called(graph, T * graph.time, x, p)
        states = [graph.single(one) for one in y[:n]]
        A = [[graph.slope(one, state) for state in states] for one in f]
        v = [self._linear(graph, A, T, y[k * n : (k + 1) * n]) for k in range(1, self.moving // n)]
        if self.kind == NEIMARK_SACKER:
            angle = y[self.angle_at]
            v[0] = [one + angle * other for one, other in zip(v[0], y[2 * n : 3 * n], strict=True)]
            v[1] = [one - angle * other for one, other in zip(v[1], y[n : 2 * n], strict=True)]
        elif self.drifts:
            v[0] = [one + y[self.angle_at] * slope for one, slope in zip(v[0], f, strict=True)]
        rows = [graph.lift(T) * one for one in f] + [one for part in v for one in part]
        return compiled(graph, y, [*rows, *[graph.lift(0.0)] * (self.size - self.moving)])

    def _period(self, graph, p):
        """The period as a symbol of the parameters."""
        if not callable(self.period):
            return graph.lift(float(self.period))
        try:
            return graph.lift(np.asarray(trace.lifted(self.period)(p), dtype=object).reshape(-1)[0])
        except trace.Unsupported as error:
            raise trace.Unsupported(f"PERIOD(p): {error}", error.remedy) from None

    @staticmethod
    def _linear(graph, A, T, v):
        """T A v."""
        rows = []
        for own in A:
            total = graph.lift(0.0)
            for slope, one in zip(own, v, strict=True):
                total = total if slope is None else total + slope * one
            rows.append(T * total)
        return rows
