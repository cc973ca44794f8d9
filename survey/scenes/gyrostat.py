"""A gyrostat with Barnett-London effect turning about axis 1: phi' = w, w' = f(phi) w + g(phi), on the cylinder.

    f = b12 cos phi - b31 sin phi,
    g = -d cos phi sin phi - c23 cos 2phi + s2 cos phi - s3 sin phi                              (57)

Parameters, in order: b12, b31 (components of B over A11), d = c22 - c33 and c23 (of C), s2, s3 (of s), up to
1e12; phi0 (rad) and w0, the initial angle and velocity. In (57) phi is the independent variable and
w w_phi = f w + g; here the system is solved in time, so turning points (w = 0) are passed.

What is known. H = w^2/2 + V, V' = -g: dH/dt = f w^2. K = b12 s3 - b31 s2 decides the ends w -> +-inf: both attract
for K > 0 (spin-up, w^2 ~ K t), both repel for K < 0; at K = 0 L = (pi/2)(c23 (b12^2 - b31^2) - d b12 b31) decides.
Integrable strata: I0 (g = 0), I1 (b = 0, H conserved), I2 (K = L = 0). Symmetries: (b, w, t) -> -(b, w, t);
(phi, w, b31, c23, s2) -> -(...); phi -> phi + pi, (b, s) -> -(b, s); rotations of axes 2 and 3.

Source: M. E. Lesina, Ya. V. Zinovyeva, "The gyrostat with Barnett-London effect" (2004), checked and corrected in
`gyrostat.md` beside this file (whose section 5 is the classification that the fates follow).

A fate is decided by the monotone return maps and by proven regions of attraction, never by a limit of steps; the
cycles are those that a lattice of return maps shows, with dips followed down to folds. b = 0 and g = 0 are taken
exactly, K = 0 and L = 0 within the rounding of the parameters; where K is larger than that, but the return maps do not
show their change beside rounding, verdicts are -1. `multiplier` and cycles carry error bars; verdicts near a stable
separatrix are -1 (status `separatrix`), also those of starts at rest beside a saddle: `equilibrium_start` is given to
exact equilibria only, and of binary64 angles none but phi0 = 0, where s2 = c23, is one (if g is not 0 throughout).

A motion is one curve through (phi0, w0), in time. As a solution w(phi) of (57) it has, where w0 = 0 and g(phi0) != 0,
two branches, w ~ +-sqrt(2 g (phi - phi0)), both on the side of phi0 to which g points. An Abel solution is the branch
that the motion takes at t > 0, on which w has the sign of g(phi0); `branch = "before"` takes the other, by which the
motion came: there w has the other sign and t < 0. Where w0 != 0 there is one branch, and the option changes nothing.

An Abel solution has status `ok` where it certainly reaches phi, `turning` where it turns before phi or so near to it
that phi lies within `phi_turning_error` of `phi_turning`.

`auto` takes trajectories and Abel solutions in closed form where one applies and keeps its digits (method `closed`),
else by Taylor series, and in double-double arithmetic (some 1e-3 s each) where these miss `rtol`; fates next to
separatrices are followed in it, too. `workflows/gyrostat_methods.py` maps where each method fails.

`turnings` counts the zeros of w between 0 and t, its ends not among them; it is unknown where a zero lies so near to t
that the error bar of w leaves it open on which side.

The method `full` solves the six equations (1)-(6) of a gyrostat whose invariant set is this motion; `survey verify`
holds trajectories against it, and `workflows/gyrostat_deviation.py` measures how deviations from the set grow.

A portrait is what the fates of a system share: ends, equilibria, cycles, and whether small changes of the parameters
keep them all. It is structurally stable where, by the error bars, K is off zero (L, where K = 0 exactly), no
equilibrium is degenerate or a Hopf point, no multiplier is 1, the signs of the return maps fit together (so the parity
law holds), and every unstable branch of a saddle ends elsewhere than in a saddle; near saddle connections it is -1.
Where an equilibrium is degenerate or a Hopf point within the rounding of binary64, the verdict is 0 and the status is
`degenerate_equilibrium`: ends and equilibria are given, numbers of cycles are not. The roots of g are then found in
double-double arithmetic, in disjoint discs that are proven to hold them; an equilibrium of the type `degenerate` stands
for the two or three roots within its error bar, a pair of which may be complex.

Questions: `trajectory` (phi and w at t), `abel` (w and t at phi), `fate` (where the solution ends) and `portrait` (of
the system, without an initial state).
"""

import numpy as np

from survey import methods
from survey.kernels.cylinder import records as rc
from survey.measures.cylinder import auto, fate, portrait, solution
from survey.measures.cylinder.fate import NO_TURNS
from survey.modules import load
from survey.scene import Option, Output, Parameter, Request, Trajectory, named, plus_minus
from survey.status import INVALID_PARAMETERS, OK

TITLE = "Gyrostat with Barnett-London effect, rotation about axis 1"
FAMILY = "cylinder"
AUDIT = ("dop853", "full")
REFERENCES = (
    "M. E. Lesina, Ya. V. Zinovyeva (2004): Integration of the equations of a gyrostat with Barnett-London effect",
)

_LARGE, _FAR = (
    {"minimum": -1e12, "maximum": 1e12},
    {"minimum": -1e9, "maximum": 1e9},
)  # beyond, binary64 has no digits left
_SYSTEM = ("b12", "b31", "d", "c23", "s2", "s3")
_QUESTIONS = ("fate", "trajectory", "abel", "portrait")
_FATE, _TIME, _ABEL, _PORTRAIT = ({"question": (name,)} for name in _QUESTIONS)
_STARTS = {"question": _QUESTIONS[:3]}

PARAMETERS = (
    Parameter("b12", "Barnett-London coefficient B12 / A11", "b_{12}", default=0.0, **_LARGE),
    Parameter("b31", "Barnett-London coefficient B31 / A11", "b_{31}", default=0.0, **_LARGE),
    Parameter("d", "difference (C22 - C33) / A11 of the potential matrix", "d", default=0.0, **_LARGE),
    Parameter("c23", "potential matrix element C23 / A11", "c_{23}", default=0.0, **_LARGE),
    Parameter("s2", "component s2 / A11 of the centre of mass vector", "s_2", default=0.0, **_LARGE),
    Parameter("s3", "component s3 / A11 of the centre of mass vector", "s_3", default=0.0, **_LARGE),
    Parameter("phi0", "initial angle of rotation", r"\varphi_0", units="rad", default=0.0, when=_STARTS,
              **_FAR),
    Parameter("w0", "initial angular velocity", "w_0", default=0.0, when=_STARTS, **_LARGE),
    Parameter("t", "time from the initial state (negative: before it)", "t", when=_TIME, uncut=True, **_LARGE),
    Parameter("phi", "angle of rotation at which w and t are asked, unwrapped", r"\varphi", units="rad", when=_ABEL,
              uncut=True, **_FAR),
)  # fmt: skip
OPTIONS = (
    Option("question", _QUESTIONS, "what is asked of the solution, or of the system"),
    Option("branch", ("after", "before"), "where w0 = 0, the branch w(phi) that the motion takes at t > 0 or at t < 0",
           only_with="phi"),
)  # fmt: skip
STATUS = {
    "turning": "the solution turns back before it reaches phi, or within phi_turning_error of it: phi_turning and "
    "t_turning say where and when",
    "equilibrium": "the solution runs into an equilibrium, in infinite time, before it reaches phi",
    "separatrix": "the error bar leaves it open on which side of a separatrix the solution passes",
    "no_closed_form": "no closed form applies (they need b = 0, g = 0 or (61)): try another method",
    "too_many_cycles": "there are more cycles than the file has room for: the first are given",
    "degenerate_equilibrium": "within rounding g = g' = 0 at an angle, or f = g = 0 at an equilibrium that is no "
    "saddle: the numbers of cycles are unknown; K, L, the stratum, the ends and the equilibria are given",
}
_TURNING = 16
_MOST_TURNINGS = 2**31 - 1  # are kept as int32
_FATES = {
    "undecided": -1, "focus_or_node": 0, "saddle": 1, "rotation_plus": 2, "rotation_minus": 3, "libration": 4,
    "spin_up_plus": 5, "spin_up_minus": 6, "periodic_rotation": 7, "periodic_libration": 8, "equilibrium_start": 9,
}  # fmt: skip
_ENDS = {"repelling": 0, "neutral": 1, "attracting": 2}
_TYPES = ("none", "saddle", "attracting_node", "weak_node", "repelling_node", "attracting_focus", "weak_focus",
          "repelling_focus", "degenerate")  # fmt: skip
_AROUND, _ORBIT_POINTS = np.arange(0, 2 * np.pi, np.pi / 3), 2001  # of the phase portrait
DIMENSIONS = {
    "equilibrium": np.arange(1, portrait.EQUILIBRIA + 1),
    "cycle": np.arange(1, portrait.CYCLES + 1),
}

OUTPUTS = (
    Output("phi", "angle of rotation at t, unwrapped", r"\varphi", units="rad", when=_TIME),
    Output("w", "angular velocity", "w", when={"question": ("trajectory", "abel")},
           applies="at an angle that the solution reaches"),
    Output("turnings", "number of turning points (sign changes of w)", "n_T", integer=True, fill=-2,
           applies="where the error bar leaves one number, if less than 2^31; -1 means infinitely many",
           when={"question": ("trajectory", "fate")}),
    Output("verdict", "where the solution ends as t -> +inf", flags=_FATES, when=_FATE),
    Output("limit_phi", "equilibrium that is reached, in [0, 2 pi), or right turning point of the libration cycle",
           r"\varphi_\infty", units="rad", when=_FATE,
           applies="at verdicts 0, 1, 4 and 9; a turning point is counted on from the equilibrium to its left"),
    Output("limit_w", "velocity of the rotation cycle where it passes the saddle of highest V (phi = 0 if no saddle)",
           r"w_\infty", when=_FATE, applies="at verdicts 2 and 3"),
    Output("multiplier", "Floquet multiplier of the limit cycle", "m", when=_FATE, applies="at verdicts 2, 3 and 4"),
    Output("net_turns", "full turns made by the limit (towards zero; a libration counts by the middle of its cycle)",
           "n", integer=True, fill=NO_TURNS, when=_FATE,
           applies="at verdicts 0, 1, 4, 8 and 9; the number is infinite at the others"),
    Output("t", "time at which the solution reaches phi", "t", when=_ABEL,
           applies="at an angle that the solution reaches"),
    Output("phi_turning", "turning point on the way to phi, unwrapped", r"\varphi_T", units="rad", when=_ABEL,
           applies="where the solution turns before it reaches phi"),
    Output("t_turning", "time of the turning point", "t_T", when=_ABEL,
           applies="where the solution turns before it reaches phi"),
    Output("K", "K = b12 s3 - b31 s2, which decides the ends", "K", when=_PORTRAIT),
    Output("L", "L = (pi/2)(c23 (b12^2 - b31^2) - d b12 b31), which decides them where K = 0", "L", when=_PORTRAIT),
    Output("stratum", "g = 0 (I0), b = 0 (I1), K = L = 0 (I2), or none of them (G)", when=_PORTRAIT,
           flags={"I0": 0, "I1": 1, "I2": 2, "G": 3}),
    Output("end_plus", "does w -> +inf attract?", flags=_ENDS, when=_PORTRAIT),
    Output("end_minus", "does w -> -inf attract?", flags=_ENDS, when=_PORTRAIT),
    Output("equilibria", "number of equilibria on the circle", integer=True, when=_PORTRAIT,
           applies="but in stratum I0, where every angle is one"),
    Output("saddles", "number of saddles", integer=True, when=_PORTRAIT, applies="but in stratum I0"),
    Output("rotations_plus", "number of isolated rotation cycles with w > 0", integer=True, when=_PORTRAIT,
           applies="but beside a degenerate equilibrium or a Hopf point"),
    Output("rotations_minus", "number of isolated rotation cycles with w < 0", integer=True, when=_PORTRAIT,
           applies="but beside a degenerate equilibrium or a Hopf point"),
    Output("librations", "number of isolated libration cycles", integer=True, when=_PORTRAIT,
           applies="but beside a degenerate equilibrium or a Hopf point"),
    Output("equilibrium_phi", "angle of the equilibrium, ascending in [0, 2 pi)", r"\varphi_e", units="rad",
           when=_PORTRAIT, dims=("equilibrium",), applies="for as many entries as there are equilibria"),
    Output("equilibrium_type", "type of the equilibrium", flags={name: i for i, name in enumerate(_TYPES)},
           when=_PORTRAIT, dims=("equilibrium",), fill=0, applies="for as many entries as there are equilibria"),
    Output("cycle_kind", "kind of the cycle", when=_PORTRAIT, dims=("cycle",), fill=0,
           flags={"none": 0, "rotation_plus": 1, "rotation_minus": 2, "libration": 3},
           applies="rotations by |w|, then librations by their right turning points"),
    Output("cycle_w", "velocity of the cycle on its section", "w", when=_PORTRAIT, dims=("cycle",),
           applies="rotations: at the saddle of highest V (phi = 0 if no saddle); librations: the w > 0 at the "
           "equilibrium next to the left of their right turning point"),
    Output("cycle_multiplier", "Floquet multiplier of the cycle", "m", when=_PORTRAIT, dims=("cycle",),
           applies="for as many entries as there are cycles"),
    Output("cycle_period", "period of the cycle", "T", when=_PORTRAIT, dims=("cycle",),
           applies="for as many entries as there are cycles"),
    Output("verdict", "is the portrait structurally stable?", when=_PORTRAIT,
           flags={"undecided": -1, "degenerate": 0, "structurally_stable": 1}),
)  # fmt: skip


def cost(options, sizes):
    """Seconds per point, rough: one solution serves its dense outputs, one set of cycles all fates of a system."""
    if options["question"] == "portrait":
        return 8e-3
    if options["question"] != "fate":
        return 7e-6 / sizes.get("t", sizes.get("phi", 1)) + 2e-7
    return 1.3e-4 + 6e-3 / (sizes["phi0"] * sizes["w0"])


def solve(point, request):
    """Every output at every point of the block."""
    method = load(methods, "taylor" if request.method == "auto" else request.method, "method")
    question = request.options.get("question", "fate")
    if question in ("fate", "portrait"):
        return {"fate": _fate, "portrait": _portrait}[question](point, method, request.rtol)
    measure = auto if request.method == "auto" else solution
    if question == "trajectory":
        return _trajectory(point, measure, method, request.rtol)
    return _abel(point, measure, method, request.rtol, request.options.get("branch") == "before")


def why(answer):
    """Why a point has its verdict, in a sentence (see `survey.scenes`)."""
    verdict = answer["verdict"]
    if "stratum" in answer:
        return _why_portrait(answer)
    if verdict == "undecided":
        return "the error bar reaches across a separatrix, or the return maps leave a cycle open"
    if verdict.startswith("spin_up"):
        k = answer["b12"] * answer["s3"] - answer["b31"] * answer["s2"]
        return f"the return maps leave no cycle or equilibrium on the way, and w grows: K = b12 s3 - b31 s2 = {k:.6g}"
    if verdict in ("rotation_plus", "rotation_minus", "libration"):
        section = named(answer, "limit_phi" if verdict == "libration" else "limit_w")
        return f"the return map of its side tends to the cycle with {section}, {named(answer, 'multiplier')} < 1"
    if verdict.startswith("periodic"):
        return "the stratum is integrable, and the level of its integral is closed"
    return f"its end is inside the region of attraction of the equilibrium {named(answer, 'limit_phi')}"


def _why_portrait(answer):
    margins = [named(answer, "K")]
    off = np.abs(answer["cycle_multiplier"] - 1.0)
    if np.isfinite(off).any():
        nearest = np.nanargmin(off)
        near = plus_minus(answer["cycle_multiplier"][nearest], answer["cycle_multiplier_error"][nearest])
        margins.append(f"the multiplier nearest to 1 is {near}")
    words = {
        "structurally_stable": "no margin is within its error bar",
        "degenerate": "one of the margins is within its error bar of 0",
    }
    return f"stratum {answer['stratum']}, {', '.join(margins)}: " + words.get(
        answer["verdict"], "near a saddle connection or a fold of cycles, the bars leave it open"
    )


def trajectory(point, answer, options, time=None):
    """The orbit on the cylinder and some of its neighbours, from `phi0`, `w0` (see `survey.scenes`)."""
    time = 40.0 if time is None else float(time)
    own = point.get("phi0", 0.0), point.get("w0", 1.0)
    starts = np.array([own, *[(phi, w) for phi in _AROUND for w in (-1.5, -0.5, 0.0, 0.5, 1.5)]])
    t = np.linspace(0.0, time, _ORBIT_POINTS)
    asked = {name: np.full((1, 1), point[name]) for name in _SYSTEM} | {"t": t[None]}
    asked |= {
        "phi0": starts[:, :1],
        "w0": starts[:, 1:] * np.where(np.arange(len(starts)) > 0, max(1.0, abs(own[1])), 1)[:, None],
    }
    out = solve(asked, Request({"question": "trajectory"}, rtol=1e-9))
    named = {o.name: {"long_name": o.long_name, "symbol": o.symbol, "units": o.units} for o in OUTPUTS if o.name in out}
    data = {"t": ("t", t, {"long_name": "time", "symbol": "t", "units": "1"})}
    for name in ("phi", "w"):
        data[name], data[f"{name}_error"] = (
            ("t", out[name][0], named[name]),
            ("t", out[f"{name}_error"][0], named[name] | {"long_name": f"error bound of {name}"}),
        )
        data[f"{name}_nearby"] = (("start", "t"), out[name][1:], named[name])
    return Trajectory(data, (("cylinder", "phi", "w"), ("lines", "t", "w")))


def _dense(point, name):
    """(rows of eight numbers, values of `name`, function that brings results back into the block's shape).

    The dimensions along which only `name` varies become columns: one solution serves them all.
    """
    arrays = [np.asarray(point[key], dtype=float) for key in (*_SYSTEM, "phi0", "w0", name)]
    shape = np.broadcast_shapes(*(array.shape for array in arrays))
    dense = [i for i in range(len(shape)) if all(array.shape[i] == 1 for array in arrays[:-1])]
    points = [i for i in range(len(shape)) if i not in dense]
    order = points + dense
    columns = int(np.prod([shape[i] for i in dense], dtype=int))
    last = np.broadcast_to(arrays[-1], shape).transpose(order).reshape(-1, columns)
    small = [shape[i] if i in points else 1 for i in range(len(shape))]
    rows = np.stack([np.broadcast_to(array, small).ravel() for array in arrays[:-1]], axis=-1)

    def back(values):
        return values.reshape([shape[i] for i in order]).transpose(np.argsort(order))

    return rows, last, back


def _valid(rows, columns):
    """Rows and columns with NaN made harmless, and where all are numbers."""
    numbers, fine = np.isfinite(rows), np.isfinite(columns)
    if numbers.all() and fine.all():
        return rows, columns, fine
    numbers = numbers.all(axis=1)[:, None]
    good = numbers & fine
    return np.where(numbers, rows, 0.0), np.where(good, columns, 0.0), good


def _trajectory(point, measure, method, rtol):
    rows, times, back = _dense(point, "t")
    rows, times, good = _valid(rows, times)
    floats, turnings, status = measure.trajectories(method, rows, times, rtol)
    status = np.where(good, status, INVALID_PARAMETERS)
    lost = status != OK
    floats[lost], turnings[lost | (turnings > _MOST_TURNINGS)] = np.nan, -2
    columns = {"phi": rc.PHI, "w": rc.W, "phi_error": rc.PHI_BAR, "w_error": rc.W_BAR}
    results = {name: back(floats[..., at]) for name, at in columns.items()}
    return results | {"turnings": back(turnings), "status": back(status)}


def _abel(point, measure, method, rtol, before):
    rows, targets, back = _dense(point, "phi")
    rows, targets, good = _valid(rows, targets)
    floats, status = measure.abel(method, rows, targets, rtol, before)
    status = np.where(good, status, INVALID_PARAMETERS)
    results = {"status": back(status)}
    for names, code in ((("w", "t"), OK), (("phi_turning", "t_turning"), _TURNING)):
        here = np.where((status == code)[..., None], floats, np.nan)
        for name, value, bar in zip(names, (rc.VALUE, rc.TIME), (rc.VALUE_BAR, rc.TIME_BAR), strict=True):
            results[name], results[f"{name}_error"] = back(here[..., value]), back(here[..., bar])
    return results


def _fate(point, method, rtol):
    """One skeleton for each set of the six parameters, then its initial states."""
    arrays = [np.asarray(point[key], dtype=float) for key in (*_SYSTEM, "phi0", "w0")]
    shape = np.broadcast_shapes(*(array.shape for array in arrays))
    systems = np.stack(np.broadcast_arrays(*arrays[:6]), axis=-1)
    group = np.arange(systems[..., 0].size).reshape(systems.shape[:-1])
    group = np.broadcast_to(group, shape).ravel()
    starts = np.stack([np.broadcast_to(array, shape).ravel() for array in arrays[6:]], axis=-1)
    result = fate.empty(len(starts), INVALID_PARAMETERS)
    order = np.argsort(group, kind="stable")
    cuts = np.flatnonzero(np.diff(group[order])) + 1
    for members in np.split(order, cuts):
        six = systems.reshape(-1, 6)[group[members[0]]]
        good = members[np.isfinite(starts[members]).all(axis=1)]
        if np.isfinite(six).all() and len(good):
            fate.solve(method, six, starts[good], rtol, result, good)
    return {name: values.reshape(shape) for name, values in result.items()}


def _portrait(point, method, rtol):
    """One portrait for each set of the six parameters."""
    systems = np.stack(np.broadcast_arrays(*(np.asarray(point[key], dtype=float) for key in _SYSTEM)), axis=-1)
    rows = systems.reshape(-1, 6)
    good = np.isfinite(rows).all(axis=1)
    result = portrait.empty(len(rows), INVALID_PARAMETERS)
    for name, values in portrait.solve(method, rows[good], rtol).items():
        result[name][good] = values
    return {name: values.reshape(systems.shape[:-1] + values.shape[1:]) for name, values in result.items()}
