"""A whole gyrostat with Barnett-London effect: is its rotation about an axis a motion of the
paper's, and observable?

    A w' = (A w + lambda) x w + (B w) x nu + nu x (C nu) + s x nu,   nu' = nu x w                     (1)-(6)

Parameters, in order, in axes fixed in the body: A11, A22, A33, A12, A23, A31, the inertia tensor A
(positive definite); B11, B22, B33, B12, B23, B31, the tensor B; C11, C22, C33, C12, C23, C31, the
tensor C; lambda1, lambda2, lambda3, the gyrostatic moment; s1, s2, s3, the centre of mass vector;
the initial state omega1, omega2, omega3 (w) and gamma1, gamma2, gamma3 (nu, of which only the
direction counts); and t.

Under the conditions (26)-(36) rotation about one axis, w = (phi', 0, 0) with nu = (cos theta, sin
theta sin phi, sin theta cos phi) at a constant theta, fills an invariant set, which carries the
flow of the scene `gyrostat`. The axis may have any direction in the body: it is that of omega, or
where omega = 0 that of omega', or at rest a principal axis of A. In the frame of that axis
`residual` lists how far each condition is from being met, over A11, and `case` which of the paper's
cases it is: about the vertical (sin theta = 0), A (B11 = A12 = A31 = 0, (44)-(48)) or B (theta =
pi/2, (53), (54)). Conditions count as met within the rounding of a tensor that was turned into
other axes (8e-15 of its largest entry). Off the set there is no reduced flow, and the status is
`off_set`.

A fate of the reduced flow can be seen in the whole body only if deviations from the set do not grow. `reduced_stable`
says whether the limit is stable on the set, `observable` whether it is beside it: by the
eigenvalues of the linearised equations at an equilibrium, by the multipliers along a cycle. Those
that belong to the integrals k (7) and |nu| (8) are trivial and taken out; two remain in case B,
three in case A, where k varies along the set, four about the vertical.

Model: all six equations; fates on the invariant set by its flow on the cylinder, and beside it by
the linear equations of deviations, exact to first order. Not for finite deviations, except by
the question `trajectory`.

What is known. In case B the divergence of deviations is (B12, B31) S^-1 (-cos phi, sin phi), S =
(A22 A23; A23 A33), whatever the other parameters. If S = a 1 it is -(A11 / a) f, f that of the
scene `gyrostat`: where the reduced flow contracts, deviations from the set grow, so that no
attracting equilibrium or cycle of a body with A22 = A33, A23 = 0 is observable. Where B12 = B31 = 0
it is 0, and deviations that do not grow do not decay either: such limits count as observable where
the exponents are purely imaginary. A spin-up is not observable if axis 1 is that of the middle
moment of inertia; else it is left open.

Source: M. E. Lesina, Ya. V. Zinovyeva, "The gyrostat with Barnett-London effect" (2004), corrected
in `gyrostat.md`; `gyrostat_body.md` beside this file derives the conditions again, and the
equations of the deviations.

Questions: `fate` (where the motion on the set ends, and what is beside that), `portrait`
(equilibria and cycles on the set, and the positions of rest of the whole body, whether it is on the
set or not), `trajectory` (w and nu of any body at t).
"""

import numpy as np

from survey import methods
from survey.kernels.body.motion import FLOATS, STATE
from survey.measures.body import limits, motion, transversal
from survey.measures.body import rests as of_rest
from survey.measures.body.system import CONDITIONS, NAMES, OFF, nearest, read
from survey.measures.cylinder import portrait as reduced_portrait
from survey.measures.cylinder.compile_ahead import compile_ahead as compile_ahead
from survey.measures.rows import Rows
from survey.modules import load
from survey.scene import Option, Output, Parameter, Request, Trajectory, named
from survey.scenes import gyrostat
from survey.status import INVALID_PARAMETERS, NO_CONVERGENCE, OK, OVERFLOW

TITLE = "Gyrostat with Barnett-London effect, the whole body"
FAMILY = "body"
AUDIT = ("dop853",)
RATIOS = ("gamma1", "gamma2", "gamma3")
REFERENCES = gyrostat.REFERENCES
_LARGE = {"minimum": -1e12, "maximum": 1e12}
_MOST = 1e12  # of reduced parameters, as in the scene gyrostat
_QUESTIONS = ("fate", "portrait", "trajectory")
_FATE, _PORTRAIT, _TIME = ({"question": (name,)} for name in _QUESTIONS)
_ON_SET = {"question": _QUESTIONS[:2]}

_WORDS = {
    "A": "inertia tensor",
    "B": "Barnett-London tensor",
    "C": "tensor of the potential",
    "lambda": "gyrostatic moment",
    "s": "centre of mass vector",
    "omega": "initial angular velocity",
    "gamma": "initial vertical",
}
_SYMBOLS = {"lambda": r"\lambda", "omega": r"\omega", "gamma": r"\gamma"}


def _parameter(name):
    kind = name.rstrip("123")
    index = name.removeprefix(kind)
    given = dict(_LARGE)
    if name in ("A11", "A22", "A33"):
        given |= {"minimum": 0.0, "open_minimum": True}
    default = 1.0 if name in ("A11", "A22", "A33", "gamma3") else 0.0
    symbol = f"{_SYMBOLS.get(kind, kind)}_{{{index}}}"
    return Parameter(name, f"{_WORDS[kind]}, component {index}", symbol, default=default, **given)


PARAMETERS = (
    *(_parameter(name) for name in NAMES),
    Parameter(
        "t",
        "time from the initial state (negative: before it)",
        "t",
        when=_TIME,
        uncut=True,
        **_LARGE,
    ),
)
OPTIONS = (Option("question", _QUESTIONS, "what is asked of the body"),)
STATUS = {
    "invalid_parameters": "the parameters lie outside the domain: A must be positive definite, and "
    "gamma must not be 0; all conditions: `survey scenes gyrostat_body`",
    "off_set": "the body does not rotate about a fixed axis on the invariant set of the paper: residual says which "
    "conditions it misses, and by how much",
    **{
        name: gyrostat.STATUS[name]
        for name in ("separatrix", "too_many_cycles", "degenerate_equilibrium")
    },
}
_OFF_SET = 16
# the reduced flow's own codes, in the order of the STATUS of the scene gyrostat, in that of this
# one
_CODES = {
    16 + list(gyrostat.STATUS).index(name): 16 + i for i, name in enumerate([*STATUS][1:]) if i
}
DIMENSIONS = {
    "condition": np.array(CONDITIONS),
    "component": np.array([1, 2, 3]),
    "transversal": np.arange(1, transversal.MOST + 1),
    "exponent": np.arange(1, 5),
    "rest": np.arange(1, of_rest.MOST + 1),
    "equilibrium": gyrostat.DIMENSIONS["equilibrium"],
    "cycle": gyrostat.DIMENSIONS["cycle"],
}
_REDUCED = ("b12", "b31", "d", "c23", "s2", "s3")
_THREE = {"undecided": -1, "no": 0, "yes": 1}
_OF_LIMIT = {"undecided": -1, "unstable": 0, "unobservable": 1, "observable": 2}
_FATES = {o.name: o for o in gyrostat.OUTPUTS if o.when == {"question": ("fate",)}}
_CYCLES = {o.name: o for o in gyrostat.OUTPUTS if "portrait" in o.when.get("question", ())}
_SET, _HELD = "on the invariant set", "on the invariant set, in case B"


def _as_reduced(name, as_name=None, applies=None):
    """An output of the scene gyrostat."""
    o = next(o for o in gyrostat.OUTPUTS if o.name == name and o.when != {"question": ("abel",)})
    when = _PORTRAIT if name in _CYCLES and name not in _FATES else _FATE
    return Output(as_name or name, o.long_name, o.symbol, o.units, o.flags, o.integer, o.fill,
                  applies or f"{_SET}; {o.applies}", when, o.dims)  # fmt: skip


STARTER = {
    "lambda1": (-8.0, 8.0), "A22": (0.2, 2.6), "A33": 0.7, "B12": 0.5, "B31": -0.9, "C11": 0.1, "C22": -1.2, "C23": 0.3,
    "s2": -0.4, "s3": 0.4, "omega1": -2.0, "gamma2": 1.0, "gamma3": 0.3,
}  # fmt: skip
OUTPUTS = (
    Output("case", "the paper's case: off the set, about the vertical, A or B", when=_ON_SET,
           flags={"off": 0, "vertical": 1, "A": 2, "B": 3}, fill=-1),
    Output("residual", "how far each condition of the set is from being met, over A11", when=_ON_SET,
           dims=("condition",)),
    Output("miss", "the largest residual, by magnitude", when=_ON_SET),
    Output("theta", "angle between the axis of rotation and the vertical, which is constant on the set", r"\theta",
           units="rad", when=_ON_SET),
    Output("axis", "the axis of rotation in the body's axes, its largest component positive", when=_ON_SET,
           dims=("component",)),
    *(Output(f"reduced_{name}", f"parameter {name} of the reduced flow, for the scene gyrostat", when=_ON_SET,
             applies=_SET) for name in _REDUCED),
    Output("reduced_phi0", "initial angle of rotation", r"\varphi_0", units="rad", when=_ON_SET, applies=_SET),
    Output("reduced_w0", "initial angular velocity about the axis", "w_0", when=_ON_SET, applies=_SET),
    Output("fate", "where the motion on the set ends as t -> +inf", when=_FATE,
           flags=_FATES["verdict"].flags | {"steady_rotation": limits.UNIFORM}, applies=_SET),
    *(_as_reduced(name) for name in ("limit_phi", "limit_w", "multiplier")),
    Output("period", "period of the limit", "T", when=_FATE, applies="at cycles and periodic motions"),
    Output("reduced_stable", "is the limit stable on the set?", flags=_THREE, when=_FATE, applies=_SET),
    Output("observable", "do deviations from the set not grow beside the limit?", flags=_THREE, when=_FATE,
           applies=_SET),
    Output("growth", "rate of growth of deviations from the set, the largest", r"\sigma",
           when=_FATE, applies="at equilibria, cycles and periodic motions"),
    *(Output(f"transversal_{end}", f"{words} part of the exponents beside an equilibrium or a steady rotation",
             when=_FATE, dims=("transversal",), applies="by decreasing real part; two in case B, three in A, four "
             "about the vertical") for end, words in (("re", "real"), ("im", "imaginary"))),
    *(Output(f"transversal_multiplier_{end}", f"{words} part of the multipliers beside a cycle or a periodic motion",
             when=_FATE, dims=("transversal",), applies="by decreasing modulus; two in case B, three in A")
      for end, words in (("re", "real"), ("im", "imaginary"))),
    Output("verdict", "is the limit stable on the set, and observable?", flags=_OF_LIMIT, when=_FATE),
    Output("rests", "number of positions of rest of the whole body (w = 0), at any k", integer=True, when=_PORTRAIT,
           applies="where they do not fill a curve, and rounding leaves one number"),
    Output("rest_nu", "the vertical at rest, in the body's axes", r"\nu", when=_PORTRAIT, dims=("rest", "component"),
           applies="for as many entries as there are positions of rest"),
    *(Output(f"rest_exponent_{end}", f"{words} part of the exponents at rest: the two of k and |nu|, 0, are left out",
             when=_PORTRAIT, dims=("rest", "exponent"), applies="for as many entries as there are positions of rest")
      for end, words in (("re", "real"), ("im", "imaginary"))),
    Output("rest_stable", "do deviations from the position of rest decay?", flags=_THREE, when=_PORTRAIT,
           dims=("rest",), applies="for as many entries as there are positions of rest"),
    *(_as_reduced(name, applies=f"{_HELD}; {_CYCLES[name].applies}") for name in (
        "equilibria", "rotations_plus", "rotations_minus", "librations", "equilibrium_phi", "equilibrium_type")),
    *(Output(f"equilibrium_exponent_{end}", f"{words} part of the exponents of an equilibrium: two on the set, two "
             "beside it; those of k and |nu| are 0", when=_PORTRAIT, dims=("equilibrium", "exponent"),
             applies=f"{_HELD}; for as many entries as there are equilibria")
      for end, words in (("re", "real"), ("im", "imaginary"))),
    Output("equilibrium_verdict", "is the equilibrium stable on the set, and observable?", flags=_OF_LIMIT,
           when=_PORTRAIT, dims=("equilibrium",), applies="for as many entries as there are equilibria"),
    *(_as_reduced(name, applies=f"{_HELD}; {_CYCLES[name].applies}") for name in (
        "cycle_kind", "cycle_w", "cycle_multiplier", "cycle_period")),
    *(Output(f"cycle_transversal_{end}", f"{words} part of the multipliers of a cycle beside the set", when=_PORTRAIT,
             dims=("cycle", "transversal"), applies="for as many entries as there are cycles, two each, by decreasing "
             "modulus; not where a cycle is too uncertain to be followed")
      for end, words in (("re", "real"), ("im", "imaginary"))),
    Output("cycle_verdict", "is the cycle stable on the set, and observable?", flags=_OF_LIMIT, when=_PORTRAIT,
           dims=("cycle",), applies="for as many entries as there are cycles"),
    Output("verdict", "is any equilibrium or cycle stable on the set, and observable?", when=_PORTRAIT,
           flags={"undecided": -1, "none_observable": 0, "some_observable": 1}),
    *(Output(f"w{i}", f"angular velocity at t, component {i}", f"w_{i}", when=_TIME) for i in (1, 2, 3)),
    *(Output(f"nu{i}", f"vertical at t, component {i} in the body's axes", rf"\nu_{i}", when=_TIME) for i in (1, 2, 3)),
)  # fmt: skip


def cost(options, sizes):
    """Seconds per point, rough: bodies with the same reduced flow share its cycles."""
    if options["question"] == "trajectory":
        return 6e-4 / sizes.get("t", 1) + 4e-6
    flows = any(
        sizes.get(name, 1) > 1 for name in ("A11", "B12", "B31", "C22", "C33", "C23", "s2", "s3")
    )
    return (8e-3 if flows else 0.0) + (6e-3 if options["question"] == "portrait" else 2e-3)


def solve(point, request):
    """Every output at every point of the block (see `survey.scenes`)."""
    method = load(methods, "taylor" if request.method == "auto" else request.method, "method")
    question = request.options.get("question", "fate")
    if question == "trajectory":
        return _trajectories(point, method, request.rtol)
    arrays = [np.asarray(point[name], dtype=float) for name in NAMES]
    shape = np.broadcast_shapes(*(array.shape for array in arrays))
    rows = np.stack([np.broadcast_to(array, shape).ravel() for array in arrays], axis=-1)
    out = _empty(question, len(rows))
    for i, row in enumerate(rows):
        body = read(row) if np.isfinite(row).all() else None
        if body is None:
            out["status"][i] = INVALID_PARAMETERS
            continue
        placed = nearest(body)
        _write_nearest(placed, out, i)
        if question == "portrait":
            _write_rests(placed, out, i)
        if placed.case == OFF:
            out["status"][i] = _OFF_SET
        elif not np.abs(placed.six).max() <= _MOST or not abs(placed.w0) <= _MOST:
            out["status"][i] = OVERFLOW
        else:
            {"fate": _write_fate, "portrait": _write_portrait}[question](
                method, placed, request.rtol, out, i
            )
            out["status"][i] = _CODES.get(int(out["status"][i]), out["status"][i])
        if out["status"][i] != OK:
            out["verdict"][i] = -1
    return {name: values.reshape(*shape, *values.shape[1:]) for name, values in out.items()}


def _empty(question, size):
    """The outputs of a question, filled with what does not apply."""
    out = {"status": np.full(size, OK, np.int64)}
    for o in OUTPUTS:
        if question in o.when["question"]:
            shape = (size, *(len(DIMENSIONS[dim]) for dim in o.dims))
            if o.dtype.kind == "f":
                out[o.name], out[f"{o.name}_error"] = np.full(shape, np.nan), np.full(shape, np.nan)
            else:
                fill = o.fill if "none" not in (o.flags or ()) else o.flags["none"]
                out[o.name] = np.full(shape, fill, np.int64)
    return out


def _put(out, name, where, value, bar):
    out[name][where], out[f"{name}_error"][where] = value, bar


def _put_complex(out, name, where, values, bars):
    for end, part in (("re", values.real), ("im", values.imag)):
        _put(out, f"{name}_{end}", where, part, bars)


def _write_nearest(placed, out, i):
    """Where the body is by the paper's conditions."""
    out["case"][i] = placed.case
    _put(out, "residual", i, placed.residuals + 0.0, placed.bars)
    worst = int(np.argmax(np.abs(placed.residuals)))
    _put(out, "miss", i, abs(placed.residuals[worst]), placed.bars.max())
    _put(out, "theta", i, placed.theta, 8e-15)
    _put(out, "axis", i, placed.axis, 8e-15)
    if placed.case == OFF:
        return
    for name, value, bar in zip(_REDUCED, placed.six, placed.six_bars, strict=True):
        _put(out, f"reduced_{name}", i, value, bar)
    _put(out, "reduced_phi0", i, placed.phi0, 8e-15)
    _put(out, "reduced_w0", i, placed.w0, 8e-15 * abs(placed.w0))


def _write_fate(method, placed, rtol, out, i):
    result, reduced, beside = limits.of_fate(method, placed, rtol)
    out["status"][i], out["fate"][i] = result["status"][0], result["verdict"][0]
    for name in ("limit_phi", "limit_w", "multiplier"):
        _put(out, name, i, result[name][0], result[f"{name}_error"][0])
    out["reduced_stable"][i], out["observable"][i] = reduced, beside.stable
    out["verdict"][i] = limits.verdict(reduced, beside.stable)
    periodic = np.isfinite(beside.period)
    if periodic:
        _put(out, "period", i, beside.period, beside.period_bar)
    if np.isfinite(beside.growth) and np.isfinite(beside.growth_bar):
        _put(out, "growth", i, beside.growth, beside.growth_bar)
    where = (i, slice(0, len(beside.values)))
    _put_complex(
        out,
        "transversal_multiplier" if periodic else "transversal",
        where,
        beside.values,
        beside.bars,
    )


def _write_portrait(method, placed, rtol, out, i):
    if not limits.has_portrait(placed):
        return
    result, at_rest, cycles = limits.of_portrait(method, placed, rtol)
    out["status"][i] = result["status"][0]
    for name in (
        "equilibria",
        "rotations_plus",
        "rotations_minus",
        "librations",
        "equilibrium_type",
        "cycle_kind",
    ):
        out[name][i] = result[name][0]
    for name in ("equilibrium_phi", "cycle_w", "cycle_multiplier", "cycle_period"):
        _put(out, name, i, result[name][0], result[f"{name}_error"][0])
    verdicts = []
    for j, (roots, bars, reduced, beside) in enumerate(at_rest):
        verdicts.append(limits.verdict(reduced, beside.stable))
        out["equilibrium_verdict"][i, j] = verdicts[-1]
        values, widths = np.concatenate([roots, beside.values]), np.concatenate([bars, beside.bars])
        _put_complex(out, "equilibrium_exponent", (i, j, slice(0, len(values))), values, widths)
    for j, (reduced, beside) in enumerate(cycles):
        verdicts.append(limits.verdict(reduced, beside.stable))
        out["cycle_verdict"][i, j] = verdicts[-1]
        _put_complex(
            out,
            "cycle_transversal",
            (i, j, slice(0, len(beside.values))),
            beside.values,
            beside.bars,
        )
    known = result["verdict"][0] == reduced_portrait.STABLE and -1 not in verdicts
    out["verdict"][i] = 1 if 2 in verdicts else 0 if known else -1


def _write_rests(placed, out, i):
    found = limits.at_rests(placed)
    if found is None:
        return
    out["rests"][i] = len(found)
    for j, (nu, bar, beside) in enumerate(found):
        _put(out, "rest_nu", (i, j), placed.turn @ nu, bar + 8e-15)
        out["rest_stable"][i, j] = beside.stable
        _put_complex(
            out, "rest_exponent", (i, j, slice(0, len(beside.values))), beside.values, beside.bars
        )


def _trajectories(point, method, rtol):
    shared = [point[name] for name in NAMES]
    block = Rows(tuple(shared), point["t"])
    rows = block.columns(shared).T
    times = block.per_point(point["t"])
    bodies = [read(row) if np.isfinite(row).all() else None for row in rows]
    fine = np.array([body is not None for body in bodies])
    good = fine[:, None] & np.isfinite(times)
    floats = np.full((*times.shape, FLOATS), np.nan)
    status = np.full(times.shape, INVALID_PARAMETERS)
    if fine.any():
        some = [body for body in bodies if body is not None]
        G = np.array([body.table for body in some])
        starts = np.array([np.concatenate([body.w, body.nu]) for body in some])
        at = np.where(good[fine], times[fine], 0.0)
        floats[fine], status[fine] = motion.trajectories(method, G, starts, at, rtol)
    floats[~good], status[~good] = np.nan, INVALID_PARAMETERS
    lost = (status == OK) & ~np.isfinite(floats).all(axis=-1)
    status[lost] = NO_CONVERGENCE
    floats[status != OK] = np.nan
    out = {"status": block.back(status)}
    for k, name in enumerate(("w1", "w2", "w3", "nu1", "nu2", "nu3")):
        out[name] = block.back(floats[..., k])
        out[f"{name}_error"] = block.back(floats[..., STATE + k])
    return out


def why(answer):
    """Why a point has its verdict, in a sentence (see `survey.scenes`)."""
    if answer["case"] == "off":
        return f"the body is not on the invariant set: {named(answer, 'miss')} (over A11)"
    if "rests" in answer:
        return f"case {answer['case']}: the verdicts of the equilibria and cycles on the set"
    beside = f"largest rate of growth beside the set {named(answer, 'growth')}" if np.isfinite(answer["growth"]) else (
        "the motion beside the set is not known to first order")  # fmt: skip
    return f"case {answer['case']}, fate {answer['fate']}: stable on the set: {answer['reduced_stable']}; {beside}"


def trajectory(point, answer, options, time=None):
    """w, and the path of the vertical on the sphere in the body's axes (see `survey.scenes`)."""
    t = np.linspace(0.0, 40.0 if time is None else float(time), 2001)
    asked = {name: np.full((1, 1), point[name]) for name in NAMES} | {"t": t[None]}
    out = solve(asked, Request({"question": "trajectory"}, rtol=1e-9))
    data = {"t": ("t", t, {"long_name": "time", "symbol": "t", "units": "1"})}
    for o in OUTPUTS[-6:]:
        meaning = {"long_name": o.long_name, "symbol": o.symbol, "units": o.units}
        data[o.name] = ("t", out[o.name][0], meaning)
        data[f"{o.name}_error"] = (
            "t",
            out[f"{o.name}_error"][0],
            meaning | {"long_name": f"error bound of {o.name}"},
        )
    return Trajectory(data, (("lines", "t", "w1", "w2", "w3"), ("sphere", "nu1", "nu2", "nu3")))
