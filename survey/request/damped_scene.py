"""The scene of y'' + 2 c y' + z(u, p) y = 0, with y = e^(-c u) x: x'' + (z - c^2) x = 0 is Hill's
equation.

The multipliers are those of x times e^(-c T), so that the damped motion grows by the exponent of x
less c T.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from survey import status
from survey.kernels.jit import inline
from survey.kernels.math.roundoff import EPS
from survey.measures.hill import dense, monodromy
from survey.request.function_scene import FunctionScene
from survey.request.hill_scene import HillScene
from survey.scene import Output, named

KEPT = ("discriminant", "rotation_number", "period", "verdict")
WORDS = {
    "discriminant": "trace of the damped monodromy matrix over one period T",
    "rotation_number": "rotation number per period",
    "verdict": "stability of the damped motion; stable with c > 0: all motions decay",
}
ROUNDING = 8.0 * EPS  # of c T and of e^(-c T), relative


@dataclass(frozen=True, eq=False, repr=False)
class DampedScene(FunctionScene):
    """What a scene's module offers (see `survey.scenes`); `damping` is c, or the column of the
    parameter that is c.
    """

    z: Callable
    damping: float | None
    column: int | None
    period: float | Callable
    breaks: tuple[float, ...] | Callable
    even: bool
    FAMILY = "hill"
    AUDIT = ("dop853",)
    OPTIONS = ()
    compile_ahead = staticmethod(dense.of_damped)
    DAMPED = True

    @property
    def STATUS(self):
        return self._inner.STATUS

    @property
    def NOTES(self):
        return self._inner.NOTES

    @property
    def OUTPUTS(self):
        """Those of Hill's equation that have a meaning here, and the exponent of the damped motion."""
        kept = (
            replace(o, long_name=WORDS.get(o.name, o.long_name))
            for o in monodromy.OUTPUTS
            if o.name in KEPT
        )
        grows = "growth exponent of the amplitude per period, negative where all motions decay"
        return (*kept, Output("exponent", grows, r"\mu T"))

    @cached_property
    def _inner(self):
        """The scene of x, over the same parameters."""
        return self._undamped(_less_square(self.z, self.damping, self.column))

    def _undamped(self, z):
        shared = ("period", "breaks", "own", "NAME", "TEXT", "HASH", "TITLE", "about", "REFERENCES")
        return HillScene(z=z, EVEN=self.even, **{name: getattr(self, name) for name in shared})

    def cost(self, options, sizes):
        """Seconds per point, roughly."""
        return self._inner.cost(options, sizes)

    def forget(self):
        """As of the undamped equation."""
        self._inner.forget()

    def check(self, points):
        """Raise BadInput if z cannot be used at these points (N, n)."""
        self._inner.check(points)

    def solve(self, point, request):
        """The requested outputs of a block (see `survey.scenes`)."""
        out = self._inner.solve(point, replace(request, variables=dense.DAMPED, out={}))
        c, turn, bar = self._loss(point, out)
        exponent = out["exponent"] - turn
        off = out["exponent_error"] + bar + EPS * abs(out["exponent"])
        certain = np.where(exponent + off < 0.0, 1, np.where(exponent - off > 0.0, 0, -1))
        verdict = np.where(
            c == 0.0, out["verdict"], np.where(out["status"] == status.OK, certain, -1)
        )
        with np.errstate(over="ignore", invalid="ignore"):
            factor = np.exp(-turn)
            trace = out["discriminant"] * factor
            error = factor * out["discriminant_error"] + abs(trace) * (
                np.expm1(2.0 * bar) + ROUNDING
            )
        known = {
            "discriminant": trace,
            "discriminant_error": error,
            "exponent": exponent,
            "exponent_error": off,
        }
        return {**out, **known, "verdict": verdict.astype(np.int8)}

    def _loss(self, point, out):
        """c, c T and a bound of its error, in the shape of the outputs `out`."""
        given = self.damping if self.column is None else point[self.PARAMETERS[self.column].name]
        c = np.broadcast_to(np.asarray(given, float), out["status"].shape)
        turn = c * out["period"]
        return c, turn, abs(turn) * (ROUNDING + out["period_error"] / out["period"])

    def product(self, point, out):
        """The product of the multipliers, e^(-2 c T), and its error bound, where the outputs are `out`."""
        _c, turn, bar = self._loss(point, out)
        with np.errstate(over="ignore"):
            value = np.exp(-2.0 * turn)
            return value, value * (np.expm1(4.0 * bar) + ROUNDING)

    def trajectory(self, point, answer, options, time=None):
        """Solutions and multipliers of a point (see `survey.scenes`)."""
        damping = self.damping if self.column is None else point[self.PARAMETERS[self.column].name]
        return self._undamped(self.z).trajectory(point, answer, options, time, float(damping))

    def why(self, answer):
        """Why the point has its verdict (see `survey.scenes`)."""
        sign = {"stable": "< 0: all motions decay", "unstable": "> 0: one grows"}.get(
            answer["verdict"], "is open"
        )
        return f"{named(answer, 'exponent')} per period {sign}"


def _less_square(z, damping, column):
    """z - c^2, as numba and Python run it."""
    inner = inline(getattr(z, "py_func", z))
    if column is None:
        square = damping * damping
        return lambda u, p: inner(u, p) - square
    return lambda u, p: inner(u, p) - p[column] * p[column]


def checked_damping(damping, refuse):
    """(number or None, name of a parameter or None); raises BadInput."""
    if isinstance(damping, str):
        if not damping.isidentifier():
            refuse(f"damping = {damping!r}: it must be a number or the name of a parameter")
        return None, damping
    if (
        isinstance(damping, bool)
        or not isinstance(damping, (int, float, np.number))
        or not np.isfinite(damping)
    ):
        refuse(f"damping = {damping!r}: it must be a finite number, or the name of a parameter")
    return float(damping), None
