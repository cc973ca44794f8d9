"""The scene of a user's z(u, p): what a module of `survey.scenes` offers, as an object (see `user_scene`)."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise, product

import numpy as np

from survey import status
from survey.errors import BadInput
from survey.kernels.math import chebyshev
from survey.kernels.math.roundoff import EPS
from survey.measures.answers import NOTHING
from survey.measures.hill import (
    dense,
    dependence,
    monodromy,
    motion,
    multiprecision,
    user_equation,
    user_rows,
    why,
)
from survey.measures.rows import Rows
from survey.proof import formulas
from survey.request.checks import is_number
from survey.request.function_scene import FunctionScene, reason

LONG_NAMES = {
    "y1": "y1(T), where y1(0) = 1, y1'(0) = 0",
    "y2": "y2(T), where y2(0) = 0, y2'(0) = 1",
    "dy1": "derivative of y1 at T",
    "dy2": "derivative of y2 at T",
}
SYMBOLS = {"y1": "y_1(T)", "y2": "y_2(T)", "dy1": "y_1'(T)", "dy2": "y_2'(T)"}
# Breaks closer to each other or to the ends than this fraction of the period count as one.
SAME = 8 * user_equation.SLACK
# Points of an axis from which on rows pay.
LANES = 8
# Of at most so many points at once what is measured is kept, and of so many in all: the corners of a map are
# asked for twice.
FEW, KEPT = 32, 256
# Meaning of two of the common codes here.
STATUS = {
    "invalid_parameters": "outside the domain, or z or T is not finite there, or z is declared even but is not",
    "no_convergence": "z is not smooth between its breaks: name every position where it jumps or has a kink",
}


@dataclass(frozen=True, eq=False, repr=False)
class HillScene(FunctionScene):
    """What a scene's module offers (see `survey.scenes`), for a user's z; `about` is its docstring."""

    z: Callable
    period: float | Callable
    breaks: tuple[float, ...] | Callable
    EVEN: bool
    FAMILY = "hill"
    AUDIT = ("dop853",)
    OPTIONS = ()
    compile_ahead = staticmethod(dense.of_functions)
    STATUS = STATUS

    @property
    def OUTPUTS(self):
        """The outputs for Hill's equation; where z is not even, y1 to dy2 are values at T."""
        return (
            monodromy.OUTPUTS if self.EVEN else tuple(_at_full_period(o) for o in monodromy.OUTPUTS)
        )

    @property
    def _divisor(self):
        """The part of the period that is solved is T over this."""
        return 2 if self.EVEN else 1

    @property
    def _sampling(self):
        return f"samples every T/{self._divisor * user_equation.PROBES}"

    @cached_property
    def NOTES(self):
        """How z is known, as global attributes of a file."""
        checked = (
            f"every T/{self._divisor * user_equation.CHECKED} at the ends and middles of the axes"
        )
        unseen = (
            f"z is known from {self._sampling}, and {checked}; a spike narrower at half its height "
            "may go unseen"
        )
        obstacle = self._obstacle
        digits = (
            f"none: {obstacle}"
            if obstacle
            else "double-double, where float64 cannot decide a verdict"
        )
        return {
            "z_resolved_width": 1 / (self._divisor * user_equation.PROBES),
            "z_resolution": f"{unseen} unless its position is one of the breaks (z_resolved_width is a fraction of T)",
            "z_more_digits": digits,
        }

    def cost(self, options, sizes):
        """Seconds per point, roughly: those of rows share their samples."""
        number = len(self.PARAMETERS)
        of_z, of_ranges = _degrees(self, ((1.0, 1.0),) * number, (None,) * number)
        names = [p.name for p in self.PARAMETERS]
        rows = [
            sizes.get(name, 1) >= LANES and of_z[i] <= 1 and not of_ranges[i]
            for i, name in enumerate(names)
        ]
        return 1e-6 if any(rows) else 1e-5

    def solve(self, point, request):
        """The requested outputs of a block (see `survey.scenes`)."""
        axes = self._axes(point, request) if request.method == "auto" else None
        if axes is not None:
            return self._solve_rows(point, request, axes)
        box = self._box_axes(point, request) if request.method == "auto" else None
        points, shape = self._points(point)
        out = (
            self._solve_points(points, request)
            if box is None
            else self._solve_scattered(points, box, request)
        )
        return {name: values.reshape(shape) for name, values in out.items()}

    def _solve_points(self, points, request):
        """The outputs (N, 1) of points one by one."""
        ranges = self._ranges(points)
        problem, rough = self._called(user_equation.problem, self._equation, points, ranges)
        return self._answers(problem, rough, ranges[0], request)

    @cached_property
    def _equation(self):
        return user_equation.Equation(
            self.z, self.HASH, self.EVEN, self._ranges, self._measured, self._more_digits
        )

    @cached_property
    def _kept(self):
        """{a point and its edges: its Measured}."""
        return {}

    def forget(self):
        """Measure everything anew: what is timed includes it."""
        self._kept.clear()

    def _measured(self, points, ranges):
        """What steps need of z at these points (N, n) with these ranges: see `user_equation.measured`."""
        if len(points) > FEW:
            return self._measured_anew(points, ranges)
        keys = [
            point.tobytes() + own.tobytes() for point, own in zip(points, ranges[1], strict=True)
        ]
        known = [self._kept.get(key) for key in keys]
        if any(one is None for one in known):
            found = self._measured_anew(points, ranges)
            if len(self._kept) + len(keys) > KEPT:
                self._kept.clear()
            self._kept.update(zip(keys, zip(*found, strict=True), strict=True))
            return found
        return user_equation.Measured(*map(np.array, zip(*known, strict=True)))

    def _measured_anew(self, points, ranges, probes=user_equation.PROBES, mirrored=True):
        period, edges, slack = ranges
        period = period if self.EVEN and mirrored else None
        return user_equation.measured(self.z, points, edges, period, slack, probes)

    def _solve_scattered(self, points, axes, request):
        """The outputs (N, 1) of points on their own, from series on the box that holds them."""
        rough = np.zeros(len(points), np.bool_)

        def problem_of(left):
            some = points[left]
            problem, rough[left] = self._called(
                user_equation.problem, self._equation, some, self._ranges(some)
            )
            return problem

        box = user_rows.box(self._equation, axes, points[0])
        position = np.ascontiguousarray(points[:, axes.across])
        p = np.ascontiguousarray(points[:, axes.lane])
        out = self._called(
            monodromy.solve_scattered, box, position, p, problem_of, request.rtol, request.variables,
            {name: array.reshape(-1) for name, array in request.out.items()},
        )  # fmt: skip
        period = np.full(len(points), self._ranges(points[:1])[0][0])
        return self._labelled(out, rough, period, request.variables)

    def _box_axes(self, point, request):
        """The parameters on the axes of a box that holds points on their own, two of which alone
        differ; or None.
        """
        ranges = {
            i: request.ranges[p.name]
            for i, p in enumerate(self.PARAMETERS)
            if p.name in request.ranges
        }
        free = [i for i, p in enumerate(self.PARAMETERS) if p.name not in request.fixed]
        if (
            len(ranges) != 2
            or set(ranges) != set(free)
            or callable(self.period)
            or callable(self.breaks)
        ):
            return None
        number = monodromy.boxed(min(given[0] for given in ranges.values()))
        if number is None or any(not given[2] > given[1] for given in ranges.values()):
            return None
        of_z, _ = self._dependence(point, request)
        for lane, across in (free, free[::-1]):
            if of_z[lane] <= 1 and of_z[across] <= dependence.ENTIRE:
                ends = ((number, *ranges[i][1:]) for i in (lane, across))
                return user_rows.Axes(lane, next(ends), across, next(ends), of_z[across] <= 1)
        return None

    def _dependence(self, point, request):
        """`_degrees` for what is asked: some parameters are single numbers, others have an axis."""
        fixed, spans = [], []
        for p in self.PARAMETERS:
            alone = p.name in request.fixed
            value = float(np.ravel(point[p.name])[0]) if alone else None
            fixed.append(value)
            spans.append((value, value) if alone else (1.0, 1.0))
            if not alone and (callable(self.period) or callable(self.breaks)):
                spans[-1] = (request.line(p.name) or request.ranges[p.name])[1:]
        return _degrees(self, tuple(spans), tuple(fixed))

    def _spans(self, points):
        """The least and the greatest value of each parameter at the points, if they matter."""
        if callable(self.period) or callable(self.breaks):
            return tuple(zip(points.min(axis=0).tolist(), points.max(axis=0).tolist(), strict=True))
        return ((1.0, 1.0),) * points.shape[1]

    def _solve_rows(self, point, request, axes):
        """As `solve`, in rows along an axis of which z is a linear function."""
        names = [p.name for p in self.PARAMETERS]
        block = Rows(
            [point[name] for i, name in enumerate(names) if i != axes.lane], point[names[axes.lane]]
        )
        lanes = block.per_point(point[names[axes.lane]])
        points = np.zeros((block.rows, len(names)))
        for i, name in enumerate(names):
            points[:, i] = axes.line[1] if i == axes.lane else block.per_row(point[name])
        out = {}
        families = self._families(points, axes)
        for rows in families:
            ranges = self._ranges(points[rows])
            problem, rough, bad = self._called(
                user_rows.problem, self._equation, axes, points[rows], lanes[rows], ranges
            )
            bad = np.flatnonzero(bad)
            into = {} if bad.size or len(families) > 1 else block.straight(request.out)
            found = self._answers(problem, rough, ranges[0], request, into)
            if bad.size:  # z may be smooth, or finite, at some of its points
                alone = np.repeat(points[rows[bad]], lanes.shape[1], axis=0)
                alone[:, axes.lane] = lanes[rows[bad]].reshape(-1)
                for name, values in self._solve_points(alone, request).items():
                    found[name][bad] = values.reshape(bad.size, -1)
            if len(families) == 1:  # all rows, as a rule
                out = found
                break
            for name, values in found.items():
                out.setdefault(name, np.empty(lanes.shape, values.dtype))[rows] = values
        return {name: block.back(values) for name, values in out.items()}

    def _families(self, points, axes):
        """The rows that a series across them serves: they differ in one parameter; all of them if
        there is no such.
        """
        if axes.across is None:
            return [np.arange(len(points))]
        others = np.delete(points, [axes.lane, axes.across], axis=1)
        if (others == others[0]).all():
            return [np.arange(len(points))]
        _, family = np.unique(others, axis=0, return_inverse=True)
        return [np.flatnonzero(family.reshape(-1) == i) for i in range(family.max() + 1)]

    def _answers(self, problem, rough, period, request, out=NOTHING):
        out = self._called(
            monodromy.solve, problem, request.method, request.rtol, request.variables, out
        )
        return self._labelled(out, rough, period, request.variables)

    def _labelled(self, out, rough, period, wanted):
        """The outputs with the period, if it is wanted, and the status of points whose z is rough."""
        out["status"][rough] = status.NO_CONVERGENCE
        if "period" in wanted:
            out["period"] = np.where(out["status"] == status.OK, period[:, None], np.nan)
            out["period_error"] = (4 if callable(self.period) else 1) * EPS * out["period"]
        return out

    def _axes(self, point, request):
        """The axes along and across the rows of a map of this request; None where z is linear along none."""
        names = [p.name for p in self.PARAMETERS]
        lines = {i: request.line(name) for i, name in enumerate(names)}
        lines = {
            i: line for i, line in lines.items() if line and line[0] >= LANES and line[2] > line[1]
        }
        if not lines:
            return None
        of_z, of_ranges = self._dependence(point, request)
        lanes = [i for i in lines if of_z[i] <= 1 and not of_ranges[i]]
        if not lanes:
            return None
        # of long ones the last: blocks cut it last, and each has to solve all rows' nodes
        order = list(request.lines)
        most = max(lines[i][0] for i in lanes)
        lane = max(
            (i for i in lanes if 2 * lines[i][0] >= most), key=lambda i: order.index(names[i])
        )
        across = [
            i for i in lines if i != lane and of_z[i] <= dependence.ENTIRE and not of_ranges[i]
        ]
        if not across:
            return user_rows.Axes(lane, lines[lane])
        across = max(across, key=lambda i: lines[i][0])
        return user_rows.Axes(lane, lines[lane], across, lines[across], of_z[across] <= 1)

    def equation(self, names, ends, options):
        """The equation in formulas (see `survey.scenes`); raises BadInput where z has none."""
        values = [ends[p.name][0] for p in self.PARAMETERS]
        if callable(self.period) or callable(self.breaks):
            raise BadInput(
                f"prove: {self.NAME}: PERIOD and BREAKS must be numbers, not functions of p"
            )
        _, edges, _ = self._ranges(np.array([values]))
        written = [names[p.name] for p in self.PARAMETERS]
        try:
            pieces = [
                (formulas.number(float(high)), formulas.formula(self.z, written, (low, high)))
                for low, high in pairwise(edges[0])
            ]
        except multiprecision.Unsupported as error:
            raise BadInput(f"prove: {self.NAME}: z has no formula ({error})") from None
        return "even" if self.EVEN else "periodic", pieces

    def why(self, answer):
        """Why the point has its verdict (see `survey.scenes`)."""
        return why.why(answer, self.EVEN)

    def trajectory(self, point, answer, options, time=None, damping=0.0):
        """Solutions and multipliers of a point (see `survey.scenes`), damped or not."""
        points = np.array([[point[p.name] for p in self.PARAMETERS]])
        problem, _ = self._called(
            user_equation.problem, replace(self._equation, exact=None), points, self._ranges(points)
        )
        return motion.solve(problem, answer, time, "u", damping)

    def _ranges(self, points):
        """Period (N), edges of the pieces (N, P + 1; NaN where there are none) and slack (N; see
        `user_equation`).
        """
        if callable(self.period) or callable(self.breaks):
            period, edges, slack = self._ranges_of(points)
        else:
            same = np.zeros(len(points), int)
            period, edges, slack = (values[same] for values in self._same_ranges)
        finite = np.isfinite(points)
        if not finite.all():
            edges[~finite.all(axis=1)] = np.nan
        return period, edges, slack

    @cached_property
    def _same_ranges(self):
        """As `_ranges_of` any point, where all have the same."""
        return self._ranges_of(np.empty((1, 0)))

    def _ranges_of(self, points):
        period = np.array([self._period(p) for p in points])
        period = np.where(period > 0, period, np.nan)
        breaks = [np.atleast_1d(self._value("BREAKS", self.breaks, p)) for p in points]
        rows = [self._row(some, length) for some, length in zip(breaks, period, strict=True)]
        most = max((len(row) for row in rows), default=2)
        edges = np.array([[*row, *[row[-1]] * (most - len(row))] for row in rows]).reshape(
            len(rows), most
        )
        return (
            period,
            edges,
            np.array([user_equation.SLACK * (some.size > 0) for some in breaks]) * period,
        )

    def _row(self, breaks, period):
        """0, the breaks inside the part that is solved, and its end."""
        near = SAME * period
        if not ((breaks >= -near) & (breaks <= period + near)).all():
            return [np.nan, np.nan]
        end = 0.5 * period if self.EVEN else period
        row = [0.0]
        for position in np.sort(np.concatenate([breaks, period - breaks]) if self.EVEN else breaks):
            if position - row[-1] > near and end - position > near:
                row.append(position)
        return [*row, end]

    @property
    def _more_digits(self):
        return None if self._obstacle else self._exact

    @cached_property
    def _lifted(self):
        """z, PERIOD and BREAKS with more digits; numbers unchanged."""
        given = (self.z, self.period, self.breaks)
        return [multiprecision.lifted(value) if callable(value) else value for value in given]

    @cached_property
    def _obstacle(self):
        """Why z cannot be run with more digits; empty if it can."""
        point = [p.default if p.default is not None else 1.0 for p in self.PARAMETERS]
        try:
            with multiprecision.LOCK:
                z, _ = self._exact(point, np.zeros(1))
                z(multiprecision.context().mpf(0.25))
        except multiprecision.Unsupported as error:
            return str(error)
        return ""

    def _exact(self, point, edges):
        """z(u) at a point, and the edges of its pieces (given as float64), with more digits."""
        mp = multiprecision.context()
        z, period, breaks = self._lifted
        p = [mp.mpf(float(value)) for value in point]
        length = mp.mpf(period(p) if callable(period) else period)
        given = breaks(p) if callable(breaks) else list(breaks)
        given = given if isinstance(given, list) else [given]
        known = [mp.mpf(u) for u in given] + [length - u for u in given if self.EVEN]
        end = length / 2 if self.EVEN else length
        rows = [
            min(known, key=lambda u, edge=edge: abs(u - edge))
            for edge in np.unique(edges)[1:-1].tolist()
        ]
        return lambda u: z(u, p), [mp.mpf(0), *rows, end]

    def check(self, points):
        """Raise BadInput if z cannot be compiled, or contradicts the scene's other entries at these
        points (N, n).
        """
        _checked(self, points.shape, points.tobytes())

    def _check(self, points):
        self._try(points[0] if len(points) else np.ones(len(self.PARAMETERS)))
        if not len(points):
            return
        ranges = period, edges, _ = self._ranges(points)
        if np.isnan(period).all():
            where = self._where(points[0])
            self._refuse(f"PERIOD is {self._period(points[0]):g} at {where}", "make it positive")
        if np.isnan(edges).all():
            where = self._where(points[0])
            self._refuse(
                f"BREAKS lie outside 0 <= u <= T at {where}", "name positions within a period"
            )
        size, _, scale, rough, spikeless = self._called(self._measured, points, ranges)
        finite = np.isfinite(size).all(axis=1)
        if not finite.any():
            self._refuse(
                f"z has no finite value at {self._where(points[0])}",
                "correct it, or the domains of PARAMETERS",
            )
        for i in np.flatnonzero(finite & rough):
            remedy = "name the positions where it jumps or has a kink in BREAKS"
            self._refuse(f"z is not smooth at {self._where(points[i])}", remedy)
        for i in np.flatnonzero(finite & np.isnan(scale)):
            self._refuse(
                f"EVEN = True, but z(T - u) is not z(u) at {self._where(points[i])}, T = {period[i]:g}",
                "set EVEN = False, or correct z or PERIOD",
            )
        hidden = finite & ~spikeless
        if hidden.any():
            hidden &= self._at_ends(points)
            self._check_spikes(points[hidden], [values[hidden] for values in ranges])
        if not self.EVEN:
            self._check_period(points, period, size.max(axis=1))

    def _at_ends(self, points):
        """Which of the points (N, n) lie at the least or greatest value of each parameter that z is
        linear in: a mean of two z has no other spikes than these.
        """
        of_z, of_ranges = _degrees(self, self._spans(points), (None,) * len(self.PARAMETERS))
        linear = [z <= 1 and not ranges for z, ranges in zip(of_z, of_ranges, strict=True)]
        own = points[:, linear]
        return ((own == own.min(axis=0)) | (own == own.max(axis=0))).all(axis=1)

    def _check_spikes(self, points, ranges):
        """Refuse features of z that a much finer sampling shows, but that of a run does not."""
        if not len(points):
            return
        one, fine = (
            self._called(self._measured_anew, points, ranges, probes, False)
            for probes in (user_equation.PROBES, user_equation.CHECKED)
        )
        for i in np.flatnonzero((one.rate != fine.rate).any(axis=1) | (one.rough != fine.rough)):
            u = np.linspace(0, ranges[1][i, -1], user_equation.CHECKED)
            values = self._called(user_equation.at, self.z, points[i : i + 1], u[None])[0]
            position = u[3 + abs(np.diff(values, 6)).argmax()]
            narrow = f"too narrow to be seen by {self._sampling}"
            self._refuse(
                f"z has a spike near u = {position:.6g} at {self._where(points[i])}, {narrow}",
                "name its position in BREAKS",
            )

    def _check_period(self, points, period, size):
        """Refuse z(T) that is not z(0), unless z jumps there."""
        u = np.stack([0 * period, period], axis=1)
        ends = self._called(user_equation.at, self.z, points, u)
        for i in np.flatnonzero(abs(ends[:, 1] - ends[:, 0]) > user_equation.MIRRORED * size):
            breaks = np.atleast_1d(self._value("BREAKS", self.breaks, points[i]))
            if (
                np.minimum(abs(breaks), abs(breaks - period[i])).min(initial=np.inf)
                > SAME * period[i]
            ):
                self._refuse(
                    f"z(T) is not z(0) at {self._where(points[i])}, T = {period[i]:g}",
                    "correct PERIOD, or name 0 in BREAKS if z jumps there",
                )

    def _try(self, point):
        """Raise BadInput unless z(u, p) can be compiled; run as Python, it shows why not, and the
        bounds of p.
        """
        value = failed = None
        try:
            with np.errstate(all="ignore"):
                value = getattr(self.z, "py_func", self.z)(0.25, point)
        except (Exception, SystemExit) as error:
            failed = error
        if isinstance(failed, IndexError):
            self._refuse_index("z(u, p)", failed)
        if isinstance(failed, SystemExit):
            self._refuse(f"z(u, p) fails (SystemExit: {reason(failed)})", "correct it")
        try:
            user_equation.at(self.z, np.empty((0, len(self.PARAMETERS))), np.empty((0, 1)))
        except user_equation.Raised as error:
            if failed is None and not is_number(value):
                self._refuse(f"z(u, p) returns {value!r}", "it must return a real number")
            remedy = "use only numbers and math functions; functions that it calls need numba.njit"
            self._refuse(
                f"numba cannot compile z(u, p) ({reason(failed or error.__cause__)})", remedy
            )

    def _period(self, p):
        value = self._value("PERIOD", self.period, p)
        if np.size(value) != 1:
            self._refuse(f"PERIOD(p) returns {value!r}", "it must return one number")
        return float(np.ravel(value)[0])

    def _value(self, name, given, p):
        """Number(s), or a function's value at p; NaN where that is undefined."""
        if not callable(given):
            return given
        try:
            return np.asarray(given(p), dtype=float)
        except (ArithmeticError, ValueError):
            return np.float64(np.nan)
        except (Exception, SystemExit) as error:
            self._refuse(
                f"{name}(p) fails ({type(error).__name__}: {reason(error)})",
                "it must return numbers",
            )

    def _called(self, function, *arguments):
        try:
            return function(*arguments)
        except user_equation.Raised as error:
            self._refuse(f"z(u, p) raises {error.__cause__!r}", "make it return nan there")


@lru_cache(maxsize=64)
def _checked(scene, shape, values):
    """`check` once for the same points: what it raises is raised again."""
    # kernels would be compiled again for what is read-only
    scene._check(np.frombuffer(values).reshape(shape).copy())


@lru_cache(maxsize=64)
def _degrees(scene, spans, fixed):
    """The degrees of z, and of the period and the breaks, in each parameter but those `fixed`
    numbers; OPAQUE if unknown.

    `spans`: the least and the greatest value of each parameter. Where these change the period or the
    breaks, z is run on the periods of all their corners, as it may branch on u.
    """
    nothing = [dependence.OPAQUE] * len(fixed)
    try:
        ranges = [dependence.degrees(f, fixed) for f in (scene.period, scene.breaks) if callable(f)]
        of_ranges = [max(degrees) for degrees in zip(*ranges, strict=True)] or [0] * len(fixed)
        ends = [span if degree else span[:1] for span, degree in zip(spans, of_ranges, strict=True)]
        _, edges, _ = scene._ranges(np.array(list(product(*ends))))
        low, high = edges[:, :-1].reshape(-1, 1), edges[:, 1:].reshape(-1, 1)
        known = (high > low)[:, 0]
        if not known.any():
            return nothing, nothing
        u = (low + (high - low) * chebyshev.with_ends(user_equation.SIZES[0]))[known]
        return dependence.degrees(scene.z, fixed, u[:, 1:-1].ravel().tolist()), of_ranges
    except dependence.Unknown:
        return nothing, nothing


def _at_full_period(output):
    """The output where there are no factors at T/2: described as a value at T."""
    return (
        replace(output, long_name=LONG_NAMES[output.name], symbol=SYMBOLS[output.name])
        if output.name in LONG_NAMES
        else output
    )
