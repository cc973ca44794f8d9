"""The scene of periodic orbits of a user's x' = f(t, x, p): what a module of `survey.scenes`
offers, as an object.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from survey.errors import BadInput
from survey.measures.floquet import curves, family, orbit, orbit_curves, orbit_motion
from survey.measures.floquet.compile_ahead import of_orbits
from survey.measures.floquet.continuation import Range
from survey.measures.floquet.equation import Equation
from survey.measures.floquet.symmetry import Symmetry
from survey.measures.floquet.system import TRIED
from survey.request.floquet_scene import SAME
from survey.request.function_scene import reason, with_keys
from survey.request.traced_scene import TracedScene
from survey.scene import Parameter, plus_minus

LARGEST = 16  # states
NEARBY = 0.01  # relative to the start: where symmetries are tried
ELSEWHERE = "give a better start, or another point"
BRANCH = Parameter(
    "branch", "number of the orbit at the point, by the mean square of its states; counted from the last if < 0",
    "i", default=1.0, minimum=-99.0, maximum=99.0, excluded=(0.0,), uncut=True,
    whole=True,
)  # fmt: skip
STATUS = {
    "invalid_parameters": "outside the domain, or start, period or f there is not finite, or the period not positive",
    "no_orbit": "Newton's method does not converge from the start, or no orbit is shown to exist near where it ends",
}


@dataclass(frozen=True, eq=False, repr=False)
class OrbitScene(TracedScene):
    """What a scene's module offers (see `survey.scenes`), for a user's f; `about` is its docstring."""

    f: Callable
    period: float | Callable | None
    start: tuple[float, ...] | Callable
    jacobian: Callable | None
    states: tuple[str, ...]
    continued: Range | None
    symmetry: Symmetry | None
    FAMILY = "orbit"
    AUDIT = ("dop853",)
    OPTIONS = ()
    compile_ahead = staticmethod(of_orbits)

    @property
    def STATUS(self):
        """The statuses; that of a point without an orbit says what may help with this f."""
        fewer = "" if self.continued is None else "the point has fewer orbits than `branch`, or "
        better = with_keys(self.NAME, self._better)
        return STATUS | {"no_orbit": f"{fewer}{STATUS['no_orbit']}: {better}"}

    @property
    def _better(self):
        """What may help where no orbit is found, without a semicolon, which ends a sentence in files."""
        better = "give a better start"
        if self.symmetry is not None:
            return better
        if self.period is None:
            n = len(self.states)
            if n < 4 or n % 2:
                family = "unless the system is conservative, as its orbits then form families, and REVERSED and HELD"
                return f"{better}, {family}, which tell these apart, need an even number of states, four at least"
            family = "if the system is conservative, so that its orbits form families"
            return f"{better}, or, {family}, name REVERSED and HELD, which tell these apart"
        uses = self.equation.uses_time
        if uses is None:
            return f"{better}, or PERIOD = None if f does not depend on t"
        if uses:
            return better
        free = "f does not depend on t, so that the period of an orbit that moves is to be found"
        return f"{free}: set PERIOD = None, and give START a guess of the period after the states"

    @property
    def PARAMETERS(self):
        """Those of f, and, where orbits are continued, which of them is meant."""
        if self.continued is None:
            return self.own
        along = self.continued.index
        return (
            *(replace(p, uncut=True) if k == along else p for k, p in enumerate(self.own)),
            BRANCH,
        )

    @property
    def OUTPUTS(self):
        """The outputs, and, where orbits are continued, their number."""
        return orbit.OUTPUTS if self.continued is None else (*orbit.OUTPUTS, orbit.NUMBER)

    @cached_property
    def equation(self):
        return Equation(self.f, len(self.states), self.period, self.start, self.symmetry)

    @property
    def DIMENSIONS(self):
        """Coordinates: the names of the states, numbers of multipliers, of rows and columns."""
        number = np.arange(1, len(self.states) + 1)
        judged = number[: self.equation.judged]
        return {
            "state": np.array(self.states),
            "multiplier": judged,
            "row": number,
            "column": number,
        }

    @property
    def NOTES(self):
        """What the system is, as global attributes of a file."""
        notes = {"states": ", ".join(self.states), "autonomous": str(self.period is None)}
        if self.symmetry is not None:
            notes["reversed"] = ", ".join(self.states[k] for k in self.symmetry.odd)
            notes["held"] = self.states[self.symmetry.held]
            if self.symmetry.transverse:
                notes["transverse"] = ", ".join(self.states[k] for k in self.symmetry.transverse)
        if self.continued is not None:
            index, low, high = self.continued
            notes["continuation"] = f"{self.own[index].name} from {low:g} to {high:g}"
        return notes

    @property
    def curves_seconds(self):
        """Seconds that the curves of a map take, roughly: some thousands of orbits."""
        return (6e3 if self.symmetry is None else 15e3) * self._one

    @property
    def _one(self):
        """Seconds of an orbit."""
        return (5e-4 + 1e-4 * len(self.states) ** 2) * (1.0 if self.symmetry is None else 5.0)

    def cost(self, options, sizes):
        """Seconds per point, roughly: one set of curves serves its row, one set of orbits all branches."""
        one = self._one
        if self.continued is None:
            return one
        return (one + 100 * one / sizes[self.own[self.continued.index].name]) / sizes["branch"]

    def solve(self, point, request):
        """The requested outputs of a block (see `survey.scenes`)."""
        points, shape = self._points(point)
        wanted = set(request.variables) or {o.name for o in self.OUTPUTS}
        if self.continued is None:
            out = self._called(
                orbit.solve, self.equation, points, request.method, request.rtol, wanted
            )
        else:
            branch = np.broadcast_to(point["branch"], shape).reshape(-1)
            given = points, branch, self.continued, request.method, request.rtol, wanted
            out = self._called(orbit.solve_branches, self.equation, *given)
        return {name: values.reshape(*shape, *values.shape[1:]) for name, values in out.items()}

    def curves(self, square, axes, fixed):
        """What `measures.floquet.orbit_curves` finds on the map of `axes`, or on a line; raises BadInput."""
        self._check_curves(axes)
        return self._called(orbit_curves.searched, self, square, axes, fixed)

    def family(self, square, axes, fixed, lines):
        """The `measures.floquet.family.Family` of symmetric orbits on a map; raises BadInput."""
        self._check_curves(axes)
        return self._called(family.Family, self, square, axes, fixed, lines)

    def _check_curves(self, axes):
        refusal = curves.refusal(axes, self)
        if refusal:
            raise BadInput(f"boundaries: {refusal}")

    def why(self, answer):
        """Why a point has its verdict (see `survey.scenes`)."""
        radius = f"spectral radius {plus_minus(answer['spectral_radius'], answer['spectral_radius_error'])}"
        if self.symmetry is not None and str(answer["verdict"]) == "stable":
            return "the multipliers are simple and on the unit circle, within their error bars: f is reversible"
        return radius + {
            "unstable": ": it is certainly above 1",
            "stable": ": it is certainly below 1",
        }.get(
            str(answer["verdict"]),
            ": the error bar allows multipliers outside the unit circle, and inside or on it",
        )

    def trajectory(self, point, answer, options, time=None):
        """The orbit and the multipliers of a point (see `survey.scenes`)."""
        if not np.isfinite(answer["x0"]).all():
            self._refuse(
                f"no orbit is shown to exist at {self._where([point[p.name] for p in self.own])}",
                ELSEWHERE,
            )
        points = np.array([[point[p.name] for p in self.own]])
        return self._called(orbit_motion.solve, self.equation, self.states, points, answer, time)

    def check(self, points):
        """Raise BadInput if f cannot be used, or contradicts the scene's other entries at these
        points (N, n).
        """
        equation = self.equation
        given = points if len(points) else np.ones((1, len(self.own)))
        if self.continued is not None:  # orbits are followed from where there is a start
            begin = given.copy()
            begin[:, self.continued.index] = self.continued.low
            given = np.concatenate([given, begin])
        x0, period = self._called(equation.begin, given)
        known = np.isfinite(x0).all(axis=1) & (period > 0) & np.isfinite(period)
        if not known.any():
            for name, function in (("START", self.start), ("PERIOD", self.period)):
                if callable(function):
                    self._defined(name, function, given[0])
        if len(points) and not known.any():
            ends = (
                "the guess of the period, the last number of START,"
                if self.period is None
                else "PERIOD(p)"
            )
            what = (
                "START(p) has no finite value"
                if not np.isfinite(x0).all()
                else f"{ends} is not positive"
            )
            self._refuse(f"{what} at {self._where(points[0])}", "correct it")
        tried = list(zip(given[known], x0[known], period[known], strict=True))
        defined = not tried
        for point, x, T in tried:
            self._try(point, x)
            self._check_filled(point, x, T)
            for _own, programs in self._called(equation.traced, point[None], x[None]):
                if not len(points):
                    defined = True
                elif self._compare(programs, point, x, T):
                    defined = True
                    if self.symmetry is not None:
                        self._check_symmetry(programs, point, x)
        if not defined:
            point, x, _T = tried[0]
            self._called(equation.recorded, point, x)
            self._refuse(
                f"f has no finite value at the start, {self._where(point)}",
                "correct it, or START, or the domains of PARAMETERS",
            )

    def _check_symmetry(self, programs, point, x):
        """Refuse REVERSED, TRANSVERSE and START where f contradicts them, at states about the start."""
        symmetry = self.symmetry
        n = len(self.states)
        here = self._where(point)
        for key, some in (("REVERSED", symmetry.odd), ("TRANSVERSE", symmetry.transverse)):
            for k in some:
                if x[k] != 0.0:
                    self._refuse(
                        f"START has {self.states[k]} = {x[k]:g} at {here}",
                        f"the states of {key} must begin at 0",
                    )
        spread = np.random.default_rng(1).standard_normal((TRIED.size, n))
        states = x + NEARBY * spread * (abs(x).max() + 1e-300)
        states[:, list(symmetry.transverse)] = 0.0
        numbers = tuple(np.repeat(one, TRIED.size, axis=0) for one in programs.numbers(point[None]))
        f, back = (
            programs.slopes(numbers, np.zeros(TRIED.size), one)[0]
            for one in (states, symmetry.signs * states)
        )
        off = abs(back + symmetry.signs * f).max(axis=0)
        if (off > SAME * abs(f).max()).any():
            k = int(off.argmax())
            self._refuse(
                f"REVERSED: the derivative of {self.states[k]} is not what time reversed would give, at {here}",
                "name the states whose sign changes with the direction of time",
            )
        A = programs.along(
            programs.A,
            numbers,
            np.zeros((TRIED.size, 1)),
            states[:, :, None],
            np.zeros((*f.shape, 1)),
        )
        if symmetry.couples(A[0][:, 0]).any() or f[:, list(symmetry.transverse)].any():
            self._refuse(
                f"TRANSVERSE: where these states are 0, f couples them to the others at {here}",
                "leave TRANSVERSE out, or name all states of a group",
            )

    def _try(self, point, x):
        """Raise BadInput unless f, run as Python, fills its array."""
        n = len(self.states)
        sizes = f"STATES names {n} for x and out, PARAMETERS {self._named} for p"
        self._tried(
            self.f, "f(t, x, p, out)", (0.25, x.copy(), point), (n,), sizes, f"of {n} numbers"
        )

    def _check_filled(self, point, x, T):
        """Refuse f where the derivative of a state is 0 always: orbits are not isolated then."""
        states = x + np.random.default_rng(1).standard_normal((2, TRIED.size, x.size))
        points = np.concatenate([point[None], self._elsewhere(point[None])])
        f = [
            self._of(self.f, (float(t * T), y, p), (x.size,))
            for p, some in zip(points, states, strict=True)
            for t, y in zip(TRIED, some, strict=True)
        ]
        for k in np.flatnonzero(~np.any(f, axis=0)):
            name = self.states[k]
            self._refuse(
                f"f(t, x, p, out) leaves out[{k}] 0: {name} never changes",
                f"fill out[{k}] = d{name}/dt, not out = ...",
            )

    def _at(self, t, x, point):
        """f from the code run on numbers."""
        given = (float(t), x.copy(), point), (len(self.states),)
        return self._again(self.f, "f(t, x, p, out)", *given)

    def _compare(self, programs, point, x, T):
        """Refuse what the recorded operations show: other values than the code's, no period,
        another Jacobian; is f finite at the start?
        """
        n = len(self.states)
        here = self._where(point)
        t = T * TRIED
        numbers = tuple(np.repeat(one, t.size, axis=0) for one in programs.numbers(point[None]))
        states = np.repeat(x[None, :, None], t.size, axis=0)
        f, A = (
            programs.along(program, numbers, t[:, None], states, np.zeros_like(states))[0][:, 0]
            for program in (programs.f, programs.A)
        )
        f = f[:, :, 0]
        size = abs(f).max()
        if not np.isfinite(size):
            return False
        plain = np.array([self._at(time, x, point) for time in t])
        if not (abs(plain - f) <= SAME * size).all():
            self._refuse(
                f"f(t, x, p, out) gives different values when its operations are recorded, at {here}",
                "use only + - * / ** and functions of math or numpy",
            )
        if self.period is not None:
            later = np.array([self._at(time + T, x, point) for time in t])
            off = abs(later - plain).max()
            if not off <= SAME * size:
                self._refuse(
                    f"f(t + T) differs from f(t) by {off:.2g} at {here}, T = {T:g}",
                    "correct PERIOD",
                )
        if self.jacobian is not None:
            sizes = f"STATES names {n} for x, out is {n} x {n}, PARAMETERS {self._named} for p"
            call = "jacobian(t, x, p, out)"
            what = f"{n} x {n}"
            # also away from the start, where what depends on the states may happen to be 0
            away = np.random.default_rng(1).standard_normal((t.size, n))
            tried = np.concatenate(
                [np.tile(x, (t.size, 1)), x + NEARBY * (abs(x).max() or 1.0) * away]
            )
            asked = [
                (self.jacobian, call, (float(time), one.copy(), point), (n, n), sizes, what)
                for time, one in zip(np.tile(t, 2), tried, strict=True)
            ]
            given = np.array([self._tried(*one) for one in asked])
            there = tried[t.size :, :, None]
            A = np.concatenate(
                [
                    A,
                    programs.along(programs.A, numbers, t[:, None], there, np.zeros_like(there))[0][
                        :, 0
                    ],
                ]
            )
            defined = np.isfinite(A).all(axis=(1, 2))
            broken = defined & ~np.isfinite(given).all(axis=(1, 2))
            if broken.any():
                self._refuse_undefined(call, here, asked[np.flatnonzero(broken)[0]])
            off = abs(given - A)[defined]
            if not (off <= SAME * abs(A[defined]).max()).all():
                self._refuse(
                    f"jacobian(t, x, p, out) is not df/dx at {here}", "correct it, or leave it out"
                )
        return True

    def _refuse_undefined(self, call, here, asked):
        """Refuse jacobian, which has no value where f and df/dx have one, with what it raised."""
        function, _call, arguments, shape, *_ = asked
        why = "it fills in inf or nan"
        try:
            with np.errstate(all="ignore"):
                getattr(function, "py_func", function)(*arguments, np.zeros(shape))
        except (ArithmeticError, ValueError) as error:
            why = f"{type(error).__name__}: {reason(error)}"
        self._refuse(f"{call} fails at {here} ({why})", "correct it, or leave it out")
