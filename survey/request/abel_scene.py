"""The scene of a user's f(phi, p), g(phi, p): what a module of `survey.scenes` offers, as an object."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from survey import methods
from survey.measures.cylinder import basins, blocks, equation, motion, solution
from survey.measures.cylinder.compile_ahead import first_of_functions, of_functions
from survey.measures.cylinder.fate import MOST_OF_PROGRAM
from survey.measures.hill.multiprecision import Unsupported
from survey.modules import load
from survey.request.checks import is_number
from survey.request.function_scene import FunctionScene, reason
from survey.scene import Option, Output, Request, named
from survey.scenes import gyrostat

ON_A_LINE = ("trajectory", "abel")  # the questions without a period
ON_A_CIRCLE = ("fate", "trajectory", "abel", "portrait")
_PORTRAIT = {"question": ("portrait",)}
# What these outputs of the gyrostat mean for any f and g: see `measures/cylinder/ends.py`.
LONG_NAMES = {
    "K": "K = -(1/pi) int g F dphi, F' = f, which decides the ends where f and g have mean 0",
    "L": "L = int g F^2 dphi, which decides them where K = 0, too",
    "stratum": "g = 0 (I0), f = 0 (I1), ends that are not decided (I2), or none of them (G)",
}
OUTPUTS = (
    *(replace(o, long_name=LONG_NAMES.get(o.name, o.long_name)) for o in gyrostat.OUTPUTS),
    Output("mean_f", "mean of f, whose sign decides both ends", r"\bar f", when=_PORTRAIT),
    Output("mean_g", "mean of g, which decides them where f has mean 0", r"\bar g", when=_PORTRAIT),
)
_BRANCH = next(option for option in gyrostat.OPTIONS if option.name == "branch")
STATUS = gyrostat.STATUS | {
    "invalid_parameters": "outside the domain, or f or g is undefined there, or does not have the period 2 pi that "
    "PERIOD promises",
    "degenerate_equilibrium": "within rounding g = g' = 0 at an angle, or f = g = 0 at an equilibrium that is not a "
    "saddle, or there are more than 16 equilibria: the numbers of cycles, and perhaps of equilibria, are unknown",
    "neutral_ends": "f or g is identically 0, or mean(f), mean(g), K and L all vanish within rounding: it "
    "is not decided whether the ends attract, so no fate is decided either",
}
TRIED = (0.25, -1.5, 2.5)  # angles at which f and g are tried as Python


@dataclass(frozen=True, eq=False, repr=False)
class AbelScene(FunctionScene):
    """What a scene's module offers (see `survey.scenes`), for a user's f and g; `about` is its docstring."""

    f: Callable
    g: Callable
    period: float | None
    FAMILY = "abel"
    AUDIT = ("dop853",)
    STATUS = STATUS
    compile_ahead, compile_first = staticmethod(of_functions), staticmethod(first_of_functions)
    DIMENSIONS = gyrostat.DIMENSIONS | {"equilibrium": np.arange(1, MOST_OF_PROGRAM + 1)}

    @property
    def _questions(self):
        return ON_A_LINE if self.period is None else ON_A_CIRCLE

    @property
    def OPTIONS(self):
        return (Option("question", self._questions, "what is asked of the solution"), _BRANCH)

    @property
    def PARAMETERS(self):
        starts = [p for p in gyrostat.PARAMETERS if p.name in ("phi0", "w0", "t", "phi")]
        return (*self.own, *starts)

    @property
    def OUTPUTS(self):
        return tuple(o for o in OUTPUTS if set(o.when.get("question", ())) & set(self._questions))

    def cost(self, options, sizes):
        """Seconds per point, roughly: one solution serves its dense outputs, one set of cycles all fates."""
        if options["question"] == "portrait":
            return 4e-3
        if options["question"] == "fate":
            return basins.cost(sizes["phi0"] * sizes["w0"], 3e-4, 4e-3)
        if options["question"] == "trajectory":
            return 8e-5 / sizes["t"] + 2e-7
        return 1.5e-5 / sizes["phi"] + 2e-7

    def solve(self, point, request):
        """The requested outputs of a block (see `survey.scenes`)."""
        method = load(methods, "taylor" if request.method == "auto" else request.method, "method")
        question = request.options["question"]
        names = tuple(p.name for p in self.own)
        bounded = getattr(method, "FLOW_BOUNDS", False)
        limited = self.flows if bounded else partial(self.flows, pieces=equation.FEW_PIECES)
        if question in ("fate", "portrait"):
            measure = blocks.fates if question == "fate" else blocks.portraits
            return measure(point, names, limited, method, request)
        names = (*names, "phi0", "w0")
        given, last, back = blocks.dense(point, names, {"trajectory": "t", "abel": "phi"}[question])
        flows = (self._flows if bounded else limited)(given[:, :-2])
        rows = solution.rows(flows, given[:, -2], given[:, -1])
        if question == "trajectory":
            return blocks.trajectories(rows, last, back, solution, method, request)
        return blocks.abel(rows, last, back, solution, method, request)

    def why(self, answer):
        """Why a point has its verdict (see `survey.scenes`)."""
        if "mean_f" not in answer and not answer["verdict"].startswith("spin_up"):
            return gyrostat.why(answer)
        if "mean_f" not in answer:
            return "the return maps show no cycle or equilibrium on the way, and w grows: that end is attracting"
        numbers = ("mean_f", "mean_g", "K", "L")
        last = next((i for i, name in enumerate(numbers) if answer[name]), 0)
        # numbers that are 0 for all parameters decide nothing
        first = last if answer["verdict"] == "structurally_stable" else 0
        margins = ", ".join(named(answer, name) for name in numbers[first : last + 1])
        return gyrostat.why(answer).replace(named(answer, "K"), margins)

    def trajectory(self, point, answer, options, time=None):
        """The motion from `phi0`, `w0`, and some of its neighbours (see `survey.scenes`)."""
        panels = motion.ON_PLANE if self.period is None else motion.ON_CYLINDER
        request = Request({"question": "trajectory"}, rtol=1e-9)
        names = [p.name for p in self.own]
        flow = (
            None
            if self.period is None
            else self.flows(np.array([[point[name] for name in names]]))[0]
        )
        return motion.solve(
            lambda asked: self.solve(asked, request), self.OUTPUTS, names, point, time, panels, flow
        )

    def flows(self, points, pieces=equation.PIECES):
        """The programs of the parameters (N, n); see `equation.limit` for `pieces`."""
        flows = self._flows(points)
        if self.period is not None:
            equation.limit(flows, pieces)
        return flows

    def _flows(self, points):
        try:
            return equation.flows(self.f, self.g, points, self.period is not None)
        except Unsupported as error:
            self._refuse(
                str(error),
                "f and g must be analytic in phi: + - * / ** and functions such as sin, exp, sqrt",
            )
        except equation.Raised as error:
            self._refuse(f"{error}(phi, p) raises {error.__cause__!r}", "make it return nan there")

    def check(self, points):
        """Raise BadInput if f or g cannot be used, or contradicts PERIOD at these points (N, n)."""
        for point in points if len(points) else np.ones((1, len(self.own))):
            self._try(point)
        if not len(points):
            self._flows(np.ones((1, len(self.own))))
            return
        flows = self._flows(points)
        lost = np.flatnonzero(np.isnan(flows[:, 0]))
        if lost.size and self.period is not None and self._finite(points[lost[0]]):
            self._refuse(
                f"f or g does not have the period 2 pi at {self._where(points[lost[0]])}, or has a pole",
                "correct it, or set PERIOD = None",
            )
        if lost.size == len(points):
            self._refuse(
                f"f or g is undefined at {self._where(points[0])}",
                "correct it, or the domains of PARAMETERS",
            )

    def _finite(self, point):
        """Have f and g values at these parameters?"""
        try:
            with np.errstate(all="ignore"):
                return all(np.isfinite(float(h(phi, point))) for h in self._plain for phi in TRIED)
        except (ArithmeticError, ValueError):  # as in `_try`
            return False

    @property
    def _plain(self):
        return [getattr(h, "py_func", h) for h in (self.f, self.g)]

    def _try(self, point):
        """Raise BadInput unless f and g, run as Python, return a real number."""
        for name, function in zip("fg", self._plain, strict=True):
            try:
                with np.errstate(all="ignore"):
                    value = function(TRIED[0], point)
            except (ArithmeticError, ValueError):
                continue
            except IndexError as error:
                self._refuse_index(f"{name}(phi, p)", error)
            except (Exception, SystemExit) as error:
                self._refuse(
                    f"{name}(phi, p) fails ({type(error).__name__}: {reason(error)})", "correct it"
                )
            if not is_number(value):
                self._refuse(f"{name}(phi, p) returns {value!r}", "it must return a real number")
