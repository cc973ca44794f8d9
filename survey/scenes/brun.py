"""Rotation of an axisymmetric body (A = B) about its fixed centre of mass in a Newtonian field
(Brun, Clebsch).

With theta the angle between the axis and the direction of the attracting centre, u = cos theta,
p_psi and p_phi conserved, k = epsilon A (A - C) and L = 2 A h - (A/C) p_phi^2 - epsilon A^2 +
p_phi^2 (h the energy):

    A^2 u'^2 = (1 - u^2)(L + k u^2) - (p_phi^2 + p_psi^2 - 2 p_psi p_phi u)                            (S2)
    psi' = [(p_psi - p_phi)/(1 - u) + (p_psi + p_phi)/(1 + u)] / (2 A)                                 (S4)

Model: Euler's and Poisson's equations, reduced to one quadrature by three integrals, exactly, for
any A = B. Not for A != B, or a centre that moves; the potential is that of the gravity gradient,
with errors of order 1/R.

Parameters, in order: A > 0 and C (0 < C <= 2 A), moments of inertia; epsilon = 3 mu / R^3, any sign; an initial state:
theta0 in [0, pi] (0 only if p_psi = p_phi), p_theta0, p_psi, p_phi; and, if wanted, t (psi = phi = 0 at t = 0). Or,
instead of all these, the scaled integrals l = L/|k|, alpha = p_phi/sqrt|k|, beta = p_psi/sqrt|k| with the option `sign`
(of k) and ratio = C/A, which only the spin needs; then every well of the effective potential has an index, lower u
first, and time is in units of A/sqrt|k|, action in units of sqrt|k|.

Per period of the nutation psi advances by `precession` and phi by `spin`; these are not reduced
modulo 2 pi, nor are the rotation numbers, which are 1/(2 pi) of them. They jump by 2 pi (by 1)
where p_psi -+ p_phi changes its sign on motions that pass a pole, u = +-1; on such a motion they
have the mean of both limits. [boundaries] gives these lines, the separatrices and the regular
precessions on maps of two of l, alpha, beta, or of two parameters of initial states.

Known: T, precession and reduced spin are symmetric in p_psi <-> p_phi; both wells have the same T;
without a field (epsilon = 0, or A = C) the advances are multiples of pi; T = 2 pi / omega_n at
regular precessions; near a separatrix T grows as the logarithm of the distance.

Source: Bekov, Shinibaev et al., on quadratures of Kobb's type, checked and corrected in `brun.md`
beside this file.
"""

from functools import partial
from math import pi

import numpy as np

from survey import methods
from survey.errors import BadInput
from survey.kernels.nutation import brun, brun_lanes
from survey.kernels.nutation import records as rc
from survey.kernels.nutation import wells as nu
from survey.measures.nutation import (
    derived,
    multiprecision,
    on_request,
    resting,
    rotation,
    separatrix,
    twist,
    unsettled,
)
from survey.measures.nutation import wells as nutation
from survey.measures.rows import Rows
from survey.modules import load
from survey.scene import Option, Output, Parameter, Request, Trajectory, named, plus_minus
from survey.status import INVALID_PARAMETERS, NO_CONVERGENCE, OK, OVERFLOW

TITLE = "Rotation of an axisymmetric body in a Newtonian field (Brun's problem)"
FAMILY = "nutation"
AUDIT = ("chebyshev", "carlson")  # the second where the first needs too many nodes
RATIOS = ("l", "alpha", "beta", "ratio")
REFERENCES = (
    "Bekov, Shinibaev et al.: quadratures of Kobb's type, a body in a Newtonian field (errata: survey/scenes/brun.md)",
)
STATUS = {
    "invalid_parameters": "the parameters lie outside the domain: C must be at most 2 A, and p_psi "
    "must equal p_phi at theta0 = 0; all conditions: `survey scenes brun`",
    "no_motion": "no motion has these integrals: l lies below the least effective potential",
    "overflow": "a value leaves the range of binary64: theta0 is too near to 0 or pi for these momenta",
    "no_convergence": "the iteration did not converge: try another method or a larger rtol. With the method auto, "
    "the point is exactly a cusp, where a well begins and the motion has no period, as at l = 1, (alpha, beta) = "
    "(0, 1), where the axis rests at u = 0; T grows as 5.2441 (l - 1)^(-1/4) towards it: take a point beside it",
}
_STATE, _SCALED, _MOTION = {"sign": ("",)}, {"sign": ("1", "-1")}, {"motion": ("at_t",)}
_LARGEST = 1e290
# relative bars of actions of wells so narrow that turning points lose digits: see `brun.measure`
_BLURRED = 4e-13
# products of four such numbers, and of their inverses, are floats
_LARGE = {"minimum": -1e25, "maximum": 1e25}
_MOTION_PERIODS, _MOTION_POINTS = 6, 3001  # of a trajectory
DIMENSIONS = {"well": np.array([1, 2])}

PARAMETERS = (
    Parameter("A", "equatorial moment of inertia A = B", "A", minimum=1e-25, maximum=1e25,
              when=_STATE),
    Parameter("C", "axial moment of inertia, at most 2 A", "C", minimum=1e-25, maximum=2e25,
              when=_STATE),
    Parameter("epsilon", "strength of the field, 3 mu / R^3", r"\varepsilon", when=_STATE, **_LARGE),
    Parameter("theta0", "initial angle between the axis and the vertical", r"\theta_0", units="rad", minimum=0.0,
              maximum=pi, when=_STATE),
    Parameter("p_theta0", "initial momentum conjugate to theta", r"p_{\theta 0}", when=_STATE, **_LARGE),
    Parameter("p_psi", "momentum of the precession angle", r"p_\psi", when=_STATE, **_LARGE),
    Parameter("p_phi", "momentum of the spin angle", r"p_\varphi", when=_STATE, **_LARGE),
    Parameter("t", "time since the initial state", "t", when=_MOTION | _STATE, uncut=True, **_LARGE),
    Parameter("l", "scaled energy L / |k|", "l", when=_SCALED, **_LARGE),
    Parameter("alpha", "scaled momentum p_phi / sqrt|k|", r"\alpha", when=_SCALED, **_LARGE),
    Parameter("beta", "scaled momentum p_psi / sqrt|k|", r"\beta", when=_SCALED, **_LARGE),
    Parameter("ratio", "inertia ratio C / A", "C/A", default=0.5, minimum=1e-25, maximum=2.0,
              when=_SCALED, number_option=True),
)  # fmt: skip
OPTIONS = (
    Option("sign", ("1", "-1"), "sign of k = epsilon A (A - C)", only_with="l"),
    Option("motion", ("at_t",), "with t: u, psi and phi at t, too", only_with="t"),
)

_TURNS = derived.FINITE
_RESTS = "and at rest on an unstable precession, until the bar of u has grown too large"
_MOVES = f"{_TURNS}; {_RESTS}"
_SETTLED = f"{_TURNS}, and where double-double tells the turning points apart"


def _outputs(when, dims):
    given = {"when": when, "dims": dims}
    turns, by_turn = ({"applies": words} | given for words in (_TURNS, derived.branch("2 pi")))
    return (
        Output("u_min", "lower turning point of u = cos theta", r"u_{\min}", **turns),
        Output("u_max", "upper turning point of u = cos theta", r"u_{\max}", **turns),
        Output("period", "period of the nutation", "T", **turns),
        Output("precession", "advance of psi in a period", r"\Delta\psi", units="rad", **by_turn),
        Output("spin", "advance of phi in a period", r"\Delta\varphi", units="rad", **by_turn),
        Output("action", "action of the nutation, 1 / 2 pi times the integral of p_theta d theta over a period", "J_u",
               **turns),
        *(Output(d.name, d.long_name, d.symbol, d.units, applies=d.applies, **given) for d in derived.DERIVED),
        *(Output(name, words, symbol, applies=_SETTLED, on_request=True, **given)
          for name, (words, symbol, _column) in twist.NAMES.items()),
    )  # fmt: skip


def _extra(name, long_name, symbol, when, applies):
    return Output(name, long_name, symbol, when=when, applies=applies, on_request=True)


_PHASED = dict.fromkeys(("beta1", "beta2"), "p_phi is not 0 and A is not C") | {
    "beta3": "without jumps at poles"
}
_VERDICTS = {
    "undecided": -1,
    "separatrix": 0,
    "regular_nutation": 1,
    "regular_precession": 2,
    "pole_passage": 3,
}
_ANGLE = {
    "units": "rad",
    "when": _MOTION,
    "applies": f"{_MOVES}; without the jumps of pi in passing a pole",
}
STARTER = {
    "p_psi": (-0.99, 0.99), "p_phi": (0.05, 0.95), "A": 1.0, "C": 0.6, "epsilon": 1.0, "theta0": 1.0, "p_theta0": 0.2,
    "figures": "precession",
}  # fmt: skip
OUTPUTS = (
    Output("u", "u = cos theta at t", "u", when=_MOTION, applies=_MOVES),
    Output("psi", "angle of precession at t, 0 at first, unwrapped", r"\psi", **_ANGLE),
    Output("phi", "angle of spin at t, 0 at first, unwrapped", r"\varphi", **_ANGLE),
    *(_extra(name, *words, _MOTION, f"{_SETTLED}; {_RESTS}") for name, words in rotation.AT_T.items()),
    *_outputs(_STATE, ()),
    *(_extra(name, *words, _STATE, _SETTLED) for name, words in rotation.ENERGIES.items()),
    *(_extra(name, *words, _STATE, f"{_SETTLED}; {_PHASED[name]}") for name, words in rotation.PHASES.items()),
    *_outputs(_SCALED, ("well",)),
    Output("separatrix_distance", "L less its value on the separatrix at the same p_psi, p_phi, over |k|", r"\Delta l",
           applies="where these momenta have a separatrix (nearer than 1e38): negative in a well, positive outside"),
    Output("saddle_growth", "growth rate of the unstable regular precession with the same p_psi, p_phi", r"\Lambda",
           applies="where there is one that float64 tells from a stable one beside it", on_request=True),
    Output("wells", "number of wells of motion at these integrals", integer=True, applies="off separatrices"),
    Output("verdict", "what the motion is", flags=_VERDICTS, when=_STATE),
    Output("verdict", "what the motion is; with several wells, the last of these kinds that one of them holds",
           flags=_VERDICTS, when=_SCALED),
)  # fmt: skip


def cost(options, sizes):
    """Seconds per point, rough."""
    return 1e-6


def solve(point, request):
    """All outputs of a block (see `survey.scenes`); `auto`: in lanes, and by agm what these leave."""
    auto = request.method == "auto" and "t" not in point
    method = load(methods, "agm" if request.method == "auto" else request.method, "method")
    shared = {p.name: point[p.name] for p in PARAMETERS if p.name in point and p.name != "t"}
    block = Rows(tuple(shared.values()), *([point["t"]] if "t" in point else []))
    given = {name: block.seen(values) for name, values in shared.items()}
    points = tuple(given.values())
    wanted = derived.needed(request.variables or {*nutation.NAMES, "separatrix_distance"})
    times = block.per_point(point["t"]) if "t" in point else None
    if "l" in given:
        valid = np.isfinite(points).all(axis=0)
        sign = int(request.options["sign"])
        solver = partial(multiprecision.of_integrals, sign=sign)
        slowly = partial(_scaled, sign=sign, method=method, rtol=request.rtol)
        out = _scaled_in_lanes(given, valid, sign, slowly, wanted) if auto else slowly(given, valid)
    else:
        valid = np.empty(block.rows, bool)
        brun.possible(points, valid)
        solver = multiprecision.of_state
        slowly = partial(_state, method=method, request=request, times=times)
        out = (
            _state_in_lanes(given, points, valid, slowly, wanted) if auto else slowly(given, valid)
        )
    if "t" not in point:
        unsettled.settle(out, points, solver, valid, request)
    out |= derived.solve(out, request.variables)
    out |= on_request.solve(given, valid, times, out, request)
    return {name: _back(block, values) for name, values in out.items()}


def compile_ahead(variables, options):
    """Compile some of the kernels that periods need (see `survey.scenes`)."""
    if "motion" not in options:
        brun_lanes.compile_others()
        yield "lanes"
    if "sign" in options:
        nutation.of_integrals(np.empty((0, rc.INTEGRALS)), 1)
    else:
        nutation.of_states(np.empty((0, rc.STATE)))


def _ordered(given):
    """The parameters (m, n) of a state or of scaled integrals, in the order of PARAMETERS."""
    return np.array([given[p.name] for p in PARAMETERS if p.name in given])


def _back(block, values):
    """Values per row, per row and time, or (rows, 1, wells), in the block's shape."""
    if values.ndim == 3:
        return np.stack([block.back(values[..., i]) for i in range(values.shape[-1])], axis=-1)
    return block.back(values.reshape(block.rows, -1))


def _state_in_lanes(given, points, valid, slowly, wanted):
    values, wells, done = nutation.in_lanes(brun_lanes.of_states, points, wanted)
    out = nutation.named(values, wanted) | {"wells": wells.astype(np.int64)}
    if "separatrix_distance" in wanted:
        out |= nutation.distance(nutation.heights(brun.heights_of_states, np.array(points)))
    out = _completed(out, given, valid, done, slowly)
    blurred = (
        np.flatnonzero(out["action_error"] > _BLURRED * np.abs(out["action"]))
        if "action" in wanted
        else []
    )
    if len(blurred):
        part = slowly({name: values[blurred] for name, values in given.items()}, valid[blurred])
        for name in ("action", "action_error"):
            out[name][blurred] = part[name]
    return out


def _scaled_in_lanes(given, valid, sign, slowly, wanted):
    """Both wells, where there are two, one after the other."""
    columns = np.zeros((rc.STATE, valid.size))
    columns[rc.LEVEL], columns[rc.SIGN], columns[rc.WELL] = given["l"], sign, -1.0
    columns[rc.RATIO] = given["ratio"]
    columns[rc.P_PSI], columns[rc.P_PHI] = given["beta"], given["alpha"]
    values, wells, done = nutation.in_lanes(brun_lanes.of_integrals, tuple(columns), wanted)
    both = np.full((*values.shape, 2), np.nan)
    both[..., 0] = values
    two = np.flatnonzero(done & (wells == 2))
    upper = columns[:, two]
    upper[rc.WELL] = 1.0
    both[:, two, 1], _wells, done[two] = nutation.in_lanes(
        brun_lanes.of_integrals, tuple(upper), wanted
    )
    out = nutation.named(both[:, :, None, :], wanted) | {"wells": wells.astype(np.int64)}
    if "separatrix_distance" in wanted:
        out |= nutation.distance(nutation.heights(brun.heights_of_integrals, columns))
    return _completed(out, given, valid, done, slowly)


def _completed(out, given, valid, done, slowly):
    """`out` of nutations, with what the lanes have left."""
    out |= {
        name: np.full(valid.size, code, np.int8)
        for name, code in (("verdict", nu.NUTATION), ("status", OK))
    }
    left = np.flatnonzero(valid & ~done)
    if left.size:
        part = slowly({name: values[left] for name, values in given.items()}, valid[left])
        for name, values in out.items():
            values[left] = part[name]
    out["status"][~valid] = INVALID_PARAMETERS
    return _emptied(out, ~valid)


def _state(given, valid, method, request, times):
    points = _ordered(given).T.copy()
    points[~valid] = nutation.HARMLESS
    nutation.compile_periods(method)
    rows, kinds, count, heights, starts = nutation.of_states(points)
    a, c = points[:, rc.SIZE_A], points[:, rc.SIZE_C]
    drift = points[:, rc.P_PHI] * ((a - c) / (a * c))
    periods, kinds = nutation.periods(method, rows, kinds, request.rtol)
    out = nutation.outputs(rows, periods, a, drift)
    out["verdict"] = nutation.verdicts(rows, kinds)
    status = np.where(kinds == nu.LOST, np.where(_too_large(points), OVERFLOW, NO_CONVERGENCE), OK)
    out = _finished(out, status, valid, count, heights)
    if times is not None:
        unsettled.settle(out, tuple(points.T), multiprecision.of_state, valid, request, known=True)
    if times is None:
        return out

    def motions(at):
        found = nutation.motions(method, rows, kinds, starts, periods, at, a, drift)
        return resting.at_times(found, kinds == nu.SEPARATRIX, points, at, drift)

    return _with_motion(out, valid, kinds, times, motions)


def _too_large(points):
    """Where the kinetic energy of the precession, next to a pole, leaves the range of double-double."""
    theta, b, a = points[:, rc.THETA], points[:, rc.P_PSI], points[:, rc.P_PHI]
    with np.errstate(all="ignore"):
        return ~((b - a * np.cos(theta)) ** 2 < _LARGEST * np.sin(theta) ** 2) & (theta > 0.0)


def _with_motion(out, valid, kinds, times, motions):
    """`out` at each of the times, with u, psi and phi there."""
    good = np.isfinite(times)
    at_t = motions(np.where(good, times, 0.0))
    lost = (kinds >= nu.NUTATION)[:, None] & np.isnan(at_t["u"])
    out = {
        name: np.repeat(values[:, None], times.shape[1], axis=1) for name, values in out.items()
    } | at_t
    out["status"] = np.where(
        good, np.where(valid[:, None] & lost, NO_CONVERGENCE, out["status"]), INVALID_PARAMETERS
    )
    return _emptied(out, out["status"] == INVALID_PARAMETERS)


def _scaled(given, valid, sign, method, rtol):
    points = np.column_stack([given["l"], given["alpha"], given["beta"]])
    points[~valid] = 1.0
    nutation.compile_periods(method)
    rows, kinds, count, heights = nutation.of_integrals(points, sign)
    ratio = np.where(valid, given["ratio"], 1.0)
    drift = np.repeat(points[:, rc.ALPHA] * ((1.0 - ratio) / ratio), 2)
    flat = np.ascontiguousarray(rows.reshape(-1, nu.SIZE))
    periods, known = nutation.periods(method, flat, kinds.ravel(), rtol)
    out = nutation.outputs(flat, periods, 1.0, drift)
    out, known = (
        {name: values.reshape(-1, 1, 2) for name, values in out.items()},
        known.reshape(-1, 2),
    )
    lost = (known == nu.LOST).any(axis=1)
    out["verdict"] = nutation.verdicts(rows, known).max(axis=1)
    status = np.where(
        lost, NO_CONVERGENCE, np.where((known == nu.NONE).all(axis=1), nutation.NO_MOTION, OK)
    )
    return _finished(out, status, valid, count, heights)


def _finished(out, status, valid, count, heights):
    """`out` with what is one per point, and nothing where the parameters are not valid."""
    out |= nutation.distance(heights) | {"wells": count}
    out["status"] = np.where(valid, status, INVALID_PARAMETERS)
    return _emptied(out, ~valid)


def _emptied(out, where):
    """`out` with nothing at the points `where`, and a verdict only where the status is ok."""
    if where.any():
        for values in out.values():
            if values.dtype.kind == "f":
                values[where] = np.nan
        out["wells"] = np.where(where, -1, out["wells"])
    lost = out["status"] != OK
    if lost.any():
        out["verdict"] = np.where(lost, nutation.UNDECIDED, out["verdict"])
    return out


def trajectory(point, answer, options, time=None):
    """u, psi and phi, and the path of the axis on the sphere (see `survey.scenes`).

    Of scaled integrals: of the lowest well, from its lower turning point, for A = 1 and |k| = 1.
    """
    well = int(np.argmax(np.isfinite(np.ravel(answer["period"]))))
    period = float(np.ravel(answer["period"])[well])
    if not np.isfinite(period) and "l" in point and answer["verdict"] == "separatrix":
        return _homoclinic(point, int(options["sign"]), time)
    if not np.isfinite(period):
        raise BadInput(
            "this motion has no period (a separatrix, or no motion at all): take a point beside it"
        )
    state = {p.name: point[p.name] for p in PARAMETERS[: rc.STATE] if p.name in point}
    if "l" in point:
        state = _state_of(point, float(np.ravel(answer["u_min"])[well]), int(options["sign"]))
    t = np.linspace(0.0, _MOTION_PERIODS * period if time is None else time, _MOTION_POINTS)
    asked = {name: np.full((1, 1), value) for name, value in state.items()} | {"t": t[None]}
    out = {
        name: values[0]
        for name, values in solve(asked, Request({"motion": "at_t"}, rtol=1e-9)).items()
    }
    return _drawn(t, out, "l" in point, _sides(out["u"], state))


def _homoclinic(point, sign, time):
    """The Trajectory of the motion that leaves an unstable precession and returns, furthest from it
    at t = 0.
    """
    drift = point["alpha"] * (1.0 - point["ratio"]) / point["ratio"]
    loop = separatrix.loop(point["alpha"], point["beta"], sign, drift)
    if loop is None:
        raise BadInput("this separatrix is next to a cusp: take a point beside it")
    end = 12.0 / loop.rate if time is None else time
    t = np.linspace(0.0 if time is not None else -end, end, _MOTION_POINTS)
    found = loop.motion(t)
    return _drawn(
        t, found, True, _sides(found["u"], {"p_psi": point["beta"], "p_phi": point["alpha"]})
    )


def _drawn(t, out, scaled, sides):
    """The Trajectory of u, psi and phi at times t."""
    words = "time, over A / sqrt|k|" if scaled else "time"
    data = {"t": ("t", t, {"long_name": words, "symbol": "t", "units": "1"})}
    for o in OUTPUTS[:3]:
        meaning = {"long_name": o.long_name, "symbol": o.symbol, "units": o.units}
        data[o.name] = ("t", out[o.name], meaning)
        data[f"{o.name}_error"] = (
            "t",
            out[f"{o.name}_error"],
            meaning | {"long_name": f"error bound of {o.name}"},
        )
    side = np.sqrt((1.0 - out["u"]) * (1.0 + out["u"])) * sides
    for name, values in {
        "x": side * np.cos(out["psi"]),
        "y": side * np.sin(out["psi"]),
        "z": out["u"],
    }.items():
        data[f"axis_{name}"] = (
            "t",
            values,
            {"long_name": f"component {name} of the body's axis", "units": "1"},
        )
    return Trajectory(
        data,
        (
            ("lines", "t", "u"),
            ("lines", "t", "psi", "phi"),
            ("sphere", "axis_x", "axis_y", "axis_z"),
        ),
    )


def _state_of(point, u, sign):
    """The initial state at rest in theta at u, for scaled integrals: sqrt|k| = A = 1."""
    ratio = point["ratio"]
    if ratio == 1.0:
        raise BadInput(
            "ratio = 1: a sphere feels no field, so no motion has these integrals; take another ratio"
        )
    return {"A": 1.0, "C": ratio, "epsilon": sign / (1.0 - ratio), "theta0": float(np.arccos(u)), "p_theta0": 0.0,
            "p_psi": point["beta"], "p_phi": point["alpha"]}  # fmt: skip


def _sides(u, state):
    """Which side of a pole that it passes the axis is on, -1 or 1: psi is given without its jumps
    of pi there.
    """
    pole = 1 if state["p_psi"] == state["p_phi"] else -1 if state["p_psi"] == -state["p_phi"] else 0
    near = pole * u
    before, here, after = near[:-2], near[1:-1], near[2:]
    top = 1 + np.flatnonzero((here > before) & (here >= after) & (here > 0.9))
    # the parabola through three points has its top beyond the middle one
    later = near[top + 1] > near[top - 1]
    passed = np.zeros(u.size, int)
    passed[top + later] = 1
    return 1 - 2 * (np.cumsum(passed) % 2)


def why(answer):
    """Why a point has its verdict, in a sentence (see `survey.scenes`)."""
    distance = answer.get("separatrix_distance", np.nan)
    apart = (
        named(answer, "separatrix_distance")
        if np.isfinite(distance)
        else "these momenta have no separatrix"
    )
    if answer["verdict"] in ("separatrix", "undecided"):
        return (
            f"{apart}: the error bar reaches across 0"
            if np.isfinite(distance)
            else "the error bars leave it open"
        )
    if answer["verdict"] == "pole_passage":
        return f"p_psi = +-p_phi exactly, so that the axis passes a pole; {apart}"
    width = np.nanmax(answer["u_max"] - answer["u_min"])
    bar = np.nanmax(answer["u_max_error"] + answer["u_min_error"])
    if width <= bar and answer["verdict"] == "regular_nutation":
        return f"0 < u_max - u_min < {bar:.1g}, which takes more digits than float64 has; {apart}"
    across = "beyond" if width > bar else "within"
    return f"u_max - u_min = {plus_minus(width, bar)}, {across} the error bars of the turning points; {apart}"
