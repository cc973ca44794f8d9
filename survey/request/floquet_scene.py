"""The scene of a user's A(t, p), or M, C, K: what a module of `survey.scenes` offers, as an object."""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from survey.errors import BadInput
from survey.measures.floquet import dense, monodromy, motion, probing, stability
from survey.measures.floquet.compile_ahead import compile_ahead
from survey.measures.floquet.halves import alike_or_opposite
from survey.measures.floquet.system import TRIED, System
from survey.request.function_scene import refusal
from survey.request.traced_scene import TracedScene, rebinds
from survey.scene import plus_minus

LARGEST = 64  # states
NODES = 1500  # that a map asks for, roughly
SOME = 4  # points at which a structure is tried
SAME = 1e-9  # relative to the largest entry: what counts as periodic, as symplectic, as the same
# As shares of the period: how closely a pole is sought, and where A is compared beside it; by how much
# it must grow from each of these to the next, 100 times if the pole is simple. A logarithm grows less.
NEAREST, BESIDE, POLE = 1e-14, (1e-6, 1e-8, 1e-10), 30.0
STATUS = {
    "invalid_parameters": "outside the domain, or A or T is not finite there, or A does not have the stated structure",
    "no_convergence": "a branch of the code changes between BREAKS: name every time at which A jumps or has a kink",
}


@dataclass(frozen=True, eq=False, repr=False)
class FloquetScene(TracedScene):
    """What a scene's module offers (see `survey.scenes`), for a user's A, or M, C, K; `about` is
    its docstring.
    """

    matrices: dict[str, Callable]
    period: float | Callable
    breaks: tuple[float, ...] | Callable
    states: tuple[str, ...]
    structure: str
    conserved: tuple[float, ...] | Callable | None
    # by the last check, for the cost
    _known: dict[str, float] = field(default_factory=dict, repr=False)
    FAMILY = "floquet"
    AUDIT = ("dop853",)
    OPTIONS = ()
    STATUS = STATUS
    compile_ahead = staticmethod(compile_ahead)

    @cached_property
    def _system(self):
        return System(
            self.matrices,
            len(self.states),
            self.period,
            self.breaks,
            self.structure == "symplectic",
            self.conserved,
        )

    @property
    def OUTPUTS(self):
        """The outputs; Krein signs and indices where the system is symplectic."""
        symplectic = self.structure == "symplectic"
        return tuple(
            o for o in stability.OUTPUTS if symplectic or o.name not in stability.SYMPLECTIC
        )

    @property
    def DIMENSIONS(self):
        """Coordinates: numbers of multipliers, and the names of the states for rows and columns."""
        number = np.arange(1, len(self.states) + 1)
        return {"multiplier": number[: self._system.judged], "row": number, "column": number}

    @property
    def NOTES(self):
        """What the system is, and how A is known, as global attributes of a file."""
        known = f"a spike of A narrower at half its height than T/{round(1 / probing.WIDTH)} may go unseen"
        return {
            "states": ", ".join(self.states),
            "structure": self.structure,
            "A_resolved_width": probing.WIDTH,
            "A_resolution": f"{known} unless its position is one of the breaks (A_resolved_width is a fraction of T)",
        }

    def cost(self, options, sizes):
        """Seconds per point, roughly: measured on the examples in `workflows`."""
        n = len(self.states)
        alone = self._alone
        longest = sorted(sizes.values())[-2:]
        if np.prod(longest) < 4 * NODES or n > dense.LARGEST:
            return alone
        # what series do not answer: by more multipliers inside the circle the radius is lost sooner
        # than by pairs on it
        left = 0.05 if self.structure != "none" else min(0.05 + 0.1 * (n - 1), 1.0)
        return 1e-7 * n + (left + NODES / np.prod(longest)) * alone

    @property
    def remark(self):
        """A sentence for `survey plan` where the number of states costs series, or None."""
        if len(self.states) <= dense.LARGEST:
            return None
        return (
            f"{len(self.states)} states: series serve at most {dense.LARGEST}, so each point is solved on its own, "
            f"which takes about {1e3 * self._alone:.2g} ms"
        )

    @property
    def curves_seconds(self):
        """Seconds that the curves of a map take, roughly: a lattice, and points of curves, most of
        them in narrow tongues, which damped systems do not have; measured on the examples in
        `workflows`."""
        return 2.5e4 * self._alone + 0.03 * len(self.states) ** 3 * (
            1.0 if self.structure == "none" else 7.0
        )

    @property
    def _alone(self):
        """Seconds of a point on its own."""
        n = len(self.states)
        further = max(self._known.get("series", 2.0) - 2.0, 0.0)  # besides 1 and a function of time
        return (
            6e-6
            + further * (3.6e-6 + 5.4e-7 * self._known.get("steps", 6.0))
            + 4e-7 * n**2
            + 6e-8 * n**3
        )

    def solve(self, point, request):
        """The requested outputs of a block (see `survey.scenes`)."""
        points, shape = self._points(point)
        points = points.reshape(*shape, -1)
        wanted = set(request.variables) or {o.name for o in self.OUTPUTS}
        lines = {
            k: request.line(p.name) for k, p in enumerate(self.PARAMETERS) if request.line(p.name)
        }
        ranges = {
            k: request.ranges[p.name]
            for k, p in enumerate(self.PARAMETERS)
            if p.name in request.ranges
        }
        free = {k for k, p in enumerate(self.PARAMETERS) if p.name not in request.fixed}
        given = (
            points,
            request.method,
            request.rtol,
            wanted,
            lines,
            ranges if set(ranges) == free else {},
        )
        return self._called(stability.solve, self._system, self.structure, *given)

    def is_analytic(self, point):
        """Does no branch of the code depend on the parameters about the point, {parameter: value}?"""
        given = np.array([[float(point[p.name]) for p in self.PARAMETERS]])
        return self._called(dense.is_analytic, self._system, given)

    def judged(self, values, axes, fixed, M, E):
        """M and E (N, n, n) without the multiplier of what is conserved, at `values` (N, len(axes))
        of the axes.
        """
        if self.conserved is None:
            return M, E
        given = fixed | {name: values[:, k] for k, name in enumerate(axes)}
        points = np.stack([np.broadcast_to(given[p.name], len(M)) for p in self.PARAMETERS], axis=1)
        found = stability.judged(self._system, points, monodromy.Matrices.plain(M, E))
        return found.M, found.E

    def why(self, answer):
        """Why a point has its verdict (see `survey.scenes`)."""
        value, bar = float(answer["spectral_radius"]), float(answer["spectral_radius_error"])
        radius = f"spectral radius {plus_minus(value, bar)}"
        if answer["verdict"] == "unstable":
            return f"{radius}: it is certainly above 1"
        if answer["verdict"] == "marginal":
            words = "spectral radius 1, by what is exact in A here: no motion grows, not all decay"
            return f"{words}{self._why_never(answer)}"
        if answer["verdict"] == "undecided":
            words = f"{radius}: the error bar allows multipliers outside the unit circle, and inside or on it"
            return f"{words}{self._why_never(answer)}"
        if self.structure == "none":
            return f"{radius}: it is certainly below 1"
        kind = "symplectic" if self.structure == "symplectic" else "reversible"
        if self.structure == "symplectic" and self._met(answer):
            return "all multipliers are on the unit circle: where error bars meet, Krein signs are the same"
        return f"all multipliers are simple and on the unit circle, within their error bars: the system is {kind}"

    def _why_never(self, answer):
        """What to state of a system whose multipliers have the product 1, so that none is stable without,
        or may meet on the unit circle.
        """
        if self.structure == "reversible" and self._met(answer, upper=True):
            words = "multipliers meet on the unit circle, where only Krein signs tell"
            return f'; {words}: state "symplectic" if the system is Hamiltonian'
        if (
            self.structure != "none"
            or self.conserved is not None
            or "multiplier_re_error" not in answer
        ):
            return ""
        product = np.prod(
            np.asarray(answer["multiplier_re"]) + 1j * np.asarray(answer["multiplier_im"])
        )
        if not abs(product - 1.0) < 1e-6:
            return ""
        return '; their product is 1: state the structure if the system is Hamiltonian ("symplectic") or "reversible"'

    def _met(self, answer, upper=False):
        """Do the error bars of two multipliers meet, or of two in the upper half-plane?"""
        if "multiplier_re_error" not in answer:
            return False
        value = np.asarray(answer["multiplier_re"]) + 1j * np.asarray(answer["multiplier_im"])
        bar = np.asarray(answer["multiplier_re_error"])
        if upper:
            value, bar = value[value.imag > bar], bar[value.imag > bar]
        one = np.eye(value.size, dtype=bool)
        return bool((~one & (abs(value[:, None] - value) <= bar[:, None] + bar)).any())

    def trajectory(self, point, answer, options, time=None):
        """A motion and the multipliers of a point (see `survey.scenes`)."""
        points = np.array([[point[p.name] for p in self.PARAMETERS]])
        return self._called(motion.solve, self._system, self.states, points, answer, time)

    def check(self, points):
        """Raise BadInput if A cannot be used, or contradicts the scene's other entries at these
        points (N, n).
        """
        given = points if len(points) else np.ones((1, len(self.PARAMETERS)))
        for point in given:
            self._try(point)
        system = self._system
        period, edges = self._called(system.ranges, given)
        self._check_filled(given, period)
        if not np.isfinite(edges).all(axis=1).any():
            for name, value in (("PERIOD", self.period), ("BREAKS", self.breaks)):
                if callable(value):
                    self._defined(name, value, given[0])
        if not len(points):
            if np.isfinite(edges).all():
                self._called(system.traced, given, edges)
            return
        if np.isnan(period).all():
            self._refuse(
                f"PERIOD is not a positive number at {self._where(points[0])}", "make it positive"
            )
        known = np.flatnonzero(np.isfinite(edges).all(axis=1))
        if not known.size:
            self._refuse(f"BREAKS has no finite value at {self._where(given[0])}", "correct it")
        groups = self._called(system.traced, given[known], edges[known])
        followed = np.concatenate([[], *(own for own, _ in groups)]).astype(int)
        rough = np.setdiff1d(np.arange(known.size), followed)
        for i in rough[[self._is_finite(given[known[i]], period[known[i]]) for i in rough]]:
            self._refuse(
                f"a branch of the code changes within a period at {self._where(given[known[i]])}",
                "name the times in BREAKS",
            )
        compared = [
            self._compare(programs, given[i], period[i], edges[i])
            for own, programs in groups
            if programs is not None
            for i in known[own]
        ]
        if all(one is None for one in compared):
            self._refuse_undefined(given, edges, known)
        traceless = all(one is not False for one in compared)
        if self.conserved is not None:
            self._check_conserved(given[known])
        known = self._called(monodromy.SystemPoints, system, given)
        self._known.update(_effort(known))
        spikes = self._called(probing.spikes, known)
        for i in np.flatnonzero(np.isfinite(spikes)):
            self._refuse_infinite(known, i, spikes[i])
            self._refuse(
                f"A has a spike near t = {spikes[i]:.6g} at {self._where(given[i])}, too narrow to be seen in a run",
                "name its position in BREAKS",
            )
        if traceless:
            self._suggest_structure(given[:SOME])

    def _is_finite(self, point, period):
        """Are the matrices finite at TRIED times at the point?"""
        return all(
            np.isfinite(self._plain(name, time, point)).all()
            for name in self.matrices
            for time in TRIED * period
        )

    def _refuse_undefined(self, given, edges, known):
        """Refuse A, which has no finite value at the points `given`, of which `known` have edges."""
        first, here = known[0], self._where(given[known[0]])
        try:
            self._called(self._system.recorded, given[first], edges[first])
        except BadInput as error:
            what, _, remedy = str(error).partition("; ")
            raise BadInput(f"{what} at {here}; {remedy}") from None
        self._refuse(
            f"A has no finite value at {self._where(given[0])}",
            "correct it, or the domains of PARAMETERS",
        )

    def _refuse_infinite(self, points, i, t):
        """Refuse A if what seems a spike near t, at the i-th of these SystemPoints, is a pole."""
        point, edges = points.points[i], points.edges[i]
        programs = next(group.programs for group in points.groups if i in group.own)
        period = edges[-1]

        def size(t):
            own = abs(self._at(programs, point, edges, t)).max(axis=(1, 2))
            return np.where(np.isnan(own), np.inf, own)

        half = 8 * period / probing.CHECKED
        while half > NEAREST * period:
            some = t + half * np.linspace(-1.0, 1.0, 33)
            t = some[size(some).argmax()]
            half /= 8
        grown = [size(t + d * period * np.array([-1.0, 1.0])).max() for d in BESIDE]
        if not all(near > POLE * far for far, near in pairwise(grown)):
            return
        what = "A seems to be infinite"
        if "M" in self.matrices:
            singular = np.linalg.svd(self._plain("M", t, point), compute_uv=False)
            if singular[-1] <= SAME * singular[0] or singular.size == 1:
                what = "M seems to be singular"
        self._refuse(
            f"{what} near t = {t:.6g} at {self._where(point)}, where the system has no solution",
            "correct it, or the domains of PARAMETERS",
        )

    def _suggest_structure(self, points):
        """Say, once, which structure fits a system without one whose trace is 0: none of its points
        is found stable.
        """
        if self.structure != "none" or self.conserved is not None or "suggested" in self._known:
            return
        self._known["suggested"] = 1.0
        others = [name for name in stability.STRUCTURES if name != self.structure]
        fitting = [name for name in others if self._fits(name, points)]
        if fitting:
            what = "the trace of A is 0: the multipliers have the product 1, and no point can be found stable"
            which = " or ".join(f"'{name}'" for name in fitting)
            remedy = f"set STRUCTURE = {which}, which the system is at the points tried"
            logging.getLogger("survey").warning(str(refusal(self.NAME, f"{what}; {remedy}")))

    def _fits(self, structure, points):
        """Does A have this structure at these points (N, n)?"""
        if structure == "symplectic" and len(self.states) % 2:
            return False
        try:
            replace(self, structure=structure, _known={}).check(points)
        except BadInput:
            return False
        return True

    def _compare(self, programs, point, period, edges):
        """Refuse what the recorded operations show: another value than the code's, no period, no
        structure; is the trace of A 0 throughout? None where A is not finite.
        """
        n = len(self.states)
        size = 0.0
        plain = []
        recorded = []
        bars = []
        for k, program in enumerate(programs):
            t = edges[k] + (edges[k + 1] - edges[k]) * (0.01 + 0.98 * TRIED)
            A, E = program.at(point[None], t[None], n)
            recorded.append(A[0])
            bars.append(E[0])
            plain.append(
                None if "A" not in self.matrices else [self._plain("A", time, point) for time in t]
            )
        size = np.max([abs(A).max() for A in recorded])
        if not np.isfinite(size):
            return None
        for own, bar, other in zip(recorded, bars, plain, strict=True):
            if other is not None and not (abs(own - np.array(other)) <= SAME * size + bar).all():
                self._refuse(
                    f"A(t, p, out) gives different values when its operations are recorded, at {self._where(point)}",
                    "use only + - * / ** and functions of math or numpy",
                )
        self._check_structure(np.concatenate(recorded), size, point)
        if self.structure == "reversible":
            self._check_reversible(programs, point, edges, size)
        if len(programs) == 1:
            self._check_period(point, period, size)
        trace = np.trace(np.concatenate(recorded), axis1=1, axis2=2)
        return bool((abs(trace) <= SAME * size).all())

    def _check_filled(self, given, period):
        """Refuse matrices that stay 0, and states of which nothing depends and that depend on nothing."""
        points = np.concatenate([given[:1], self._elsewhere(given[:1])])
        times = TRIED * (period[0] if np.isfinite(period[0]) else 1.0)
        some = {}
        for name, function in self.matrices.items():
            shape = 2 * (self._size_of(name),)
            some[name] = np.abs(
                [self._of(function, (float(t), p), shape) for p in points for t in times]
            ).max(axis=0)
        for name, size in some.items():
            # no damping may be said by a C
            if not size.any() and (name != "C" or rebinds(self.matrices[name])):
                self._refuse(
                    f"{name}(t, p, out) leaves out all 0",
                    "fill its entries: out[0, 0] = ..., not out = ...",
                )
        used = sum(
            size - np.diag(np.diag(size)) if name == "M" else size for name, size in some.items()
        )
        for k in np.flatnonzero(~(used.any(axis=0) | used.any(axis=1))):
            added = ", to which velocities are added" if "A" not in some else ""
            self._refuse(
                f"STATES names {self.states[k]}, but its row and column of {' and '.join(sorted(some))} are all 0",
                f"fill them, or leave it out of STATES{added}",
            )

    def _check_conserved(self, given):
        """Refuse CONSERVED where w x is not the same a period later."""
        system, some = self._system, np.arange(len(given))
        w = self._called(system.weights, given)
        points = self._called(monodromy.SystemPoints, system, given)
        usable = np.isfinite(w).all(axis=1)
        if not usable.any() and callable(self.conserved):
            self._defined("CONSERVED", self.conserved, given[0])
        if not (usable.any() and (w != 0.0).any(axis=1).all()):
            self._refuse(
                "CONSERVED must be numbers, not all 0", "name the coefficients of the states"
            )
        found = monodromy.solve(
            points, monodromy.method_of("auto"), 1e-10, np.ones(len(given)), some, sharp=False
        )
        for i in np.flatnonzero(points.valid):
            off, bar = abs(w[i] @ found.M[i] - w[i]), abs(w[i]) @ found.E[i]
            if not (off <= bar + SAME * abs(w[i]).max() * (1.0 + abs(found.M[i]).max())).all():
                self._refuse(
                    f"CONSERVED: this combination of the states changes by {off.max():.2g} in a period at "
                    f"{self._where(given[i])}",
                    "correct its coefficients at t = 0, or leave it out",
                )

    def _check_structure(self, A, size, point):
        n = len(self.states)
        if self.structure == "symplectic":
            JA = np.concatenate([A[:, n // 2 :], -A[:, : n // 2]], axis=1)
            if not (abs(JA - np.swapaxes(JA, 1, 2)) <= SAME * size).all():
                self._refuse(
                    f"STRUCTURE = 'symplectic', but J A is not symmetric at {self._where(point)}",
                    "order the states as coordinates, then their momenta, or set STRUCTURE = 'none'",
                )

    def _check_reversible(self, programs, point, edges, size):
        """Refuse A unless signs r of the states exist with r_i r_j A_ij(-t) = -A_ij(t)."""
        times = edges[-1] * (0.013 + 0.97 * TRIED)
        there, back = self._at(
            programs, point, edges, np.concatenate([times, edges[-1] - times])
        ).reshape(2, times.size, len(self.states), -1)
        odd, even = (abs(back + sign * there).max(axis=0) <= SAME * size for sign in (1, -1))
        if alike_or_opposite(odd, even) is None:
            self._refuse(
                f"STRUCTURE = 'reversible', but no signs R give R A(-t) R = -A(t) at {self._where(point)}",
                "move t = 0 to a centre of symmetry, or set STRUCTURE = 'none'",
            )

    def _at(self, programs, point, edges, t):
        """A (m, n, n) at times t (m) of the point, from the recorded operations."""
        n = len(self.states)
        piece = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, len(programs) - 1)
        A = np.empty((t.size, n, n))
        for k in np.unique(piece):
            own = piece == k
            A[own] = programs[k].at(point[None], t[None, own], n)[0][0]
        return A

    def _check_period(self, point, period, size):
        for name in self.matrices:
            one, two = (
                [self._plain(name, t + shift, point) for t in TRIED * period]
                for shift in (0.0, period)
            )
            off = abs(np.array(one) - np.array(two)).max()
            largest = max(size, abs(np.array(one)).max())
            if not off <= SAME * largest:
                self._refuse(
                    f"{name}(t + T) differs from {name}(t) by {off:.2g} at {self._where(point)}, T = {period:g}",
                    "correct PERIOD, or name 0 in BREAKS if it jumps there",
                )

    def _size_of(self, name):
        return len(self.states) if name == "A" else len(self.states) // 2

    def _plain(self, name, time, point):
        """The matrix of this name, from the code run on numbers."""
        m = self._size_of(name)
        given = (float(time), point), (m, m)
        return self._again(self.matrices[name], f"{name}(t, p, out)", *given)

    def _try(self, point):
        """Raise BadInput unless the functions, run as Python, fill their matrices."""
        for name, function in self.matrices.items():
            m = self._size_of(name)
            sizes = f"PARAMETERS names {self._named} and out is {m} x {m}"
            self._tried(function, f"{name}(t, p, out)", (0.25, point), (m, m), sizes, f"{m} x {m}")


def _effort(points):
    """{"series": functions of time in A, "steps": in a period}: the means over some SystemPoints, on
    which a point's cost depends."""
    reach = monodromy.method_of("auto").floquet_reach(1e-10)
    valid = np.flatnonzero(points.valid)
    if not valid.size:
        return {}
    steps = points.steps(reach, np.ones(valid.size), valid).sum(axis=1).mean()
    series = [len(program.used) for group in points.groups for program in group.programs]
    return {"series": float(np.mean(series)), "steps": float(steps)}
