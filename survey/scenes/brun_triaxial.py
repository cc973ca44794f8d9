"""Rotation of a body with three unequal moments about its fixed centre of mass in a Newtonian field
(Clebsch's case).

    M' = M x w + epsilon nu x (I nu),  nu' = nu x w,  M = I w,  I = diag(A, B, C),  |nu| = 1               (1)
    H = (M.w + epsilon nu.I nu) / 2,  F2 = |M|^2 - epsilon nu.adj(I) nu,  F3 = M.nu                        (2)

w is the angular velocity and nu the vertical, the direction of the attracting centre, in the body's
principal axes. H, F2 and F3 are conserved.

Model: Euler's and Poisson's equations, exact for any A, B, C (with A = B: scene `brun`, which has
all motions in closed form). Not for a centre that moves; the potential is that of the gravity
gradient, with errors of order 1/R.

Parameters, in order: A, B, C > 0, principal moments of inertia, none larger than the sum of the
others; epsilon = 3 mu / R^3, any sign. For the question `trajectory` an initial state, omega1,
omega2, omega3 (w) and gamma1, gamma2, gamma3 (nu, of which only the direction counts), and t. For
`rotation` the rate Omega of a permanent rotation about a principal axis that is vertical: option
`axis`. For `critical` sigma and p_psi, the value of F3: the motions on which H + sigma F2 / 2 is
stationary among all with this F3; option `sense` is the sign of their rate of turn.

Known. The rotation about the middle axis is unstable (except, perhaps, at Omega^2 = epsilon, where
a rotation about any vertical axis is permanent). With epsilon > 0 that about the axis of the least
moment is stable, and that about the axis of the largest moment, A, if and only if |Omega| >
sqrt(epsilon) sin(a + b), sin^2 a = B/A, sin^2 b = C/A; with epsilon < 0 the same holds with the
least and the largest moment exchanged (7). Stable means Lyapunov's stability of the full motion: a
combination of H, F2 and F3 has a strict extremum. Critical motions turn nu as a free body turns its
angular momentum, w = turn_rate (1 + sigma I)^-1 nu (9); unstable ones, and unstable rotations,
carry separatrices: the motions with the same H, F2 and F3.

Source: V. Brun; A. Clebsch, Math. Ann. 3 (1871) 238; Bekov, Shinibaev et al., whose integrals (7)
are F1 to F3 as corrected in `brun.md`. Stability and critical motions: derived in
`brun_triaxial.md` beside this file.

Questions: `rotation` (is the rotation about a principal axis stable?), `critical` (the bifurcation
diagram of the integrals, its motions and their stability), `trajectory` (w and nu at t, and how far
H, F2 and F3 are from their first values).
"""

import numpy as np

from survey import methods
from survey.kernels.body.motion import STATE
from survey.kernels.cylinder import gyrostat
from survey.measures import bounded
from survey.measures.body import clebsch, motion
from survey.measures.bounded import Bounded
from survey.measures.rows import Rows
from survey.modules import load
from survey.scene import Option, Output, Parameter, Request, Trajectory, named
from survey.status import INVALID_PARAMETERS, NO_CONVERGENCE, OK, OVERFLOW

TITLE = (
    "Rotation of a body with three unequal moments of inertia in a Newtonian field (Clebsch's case)"
)
FAMILY = "body"
AUDIT = ("dop853",)
RATIOS = ("gamma1", "gamma2", "gamma3")
REFERENCES = (
    "A. Clebsch, Ueber die Bewegung eines Koerpers in einer Fluessigkeit, Math. Ann. 3 (1871) 238",
    "Bekov, Shinibaev et al.: quadratures of Kobb's type, a body in a Newtonian field (errata: survey/scenes/brun.md)",
)
STATUS = {
    "invalid_parameters": "the parameters lie outside the domain: no moment of inertia may exceed "
    "the sum of the others, and gamma must not be 0",
    "no_motion": "there is no such motion: epsilon (1 + sigma A)(1 + sigma B)(1 + sigma C) is not positive, or p_psi "
    "over turn_rate lies outside the range of nu.I (1 + sigma I)^-1 nu",
}
_NO_MOTION = 16
_QUESTIONS = ("rotation", "critical", "trajectory")
_ROTATION, _CRITICAL, _TIME = ({"question": (name,)} for name in _QUESTIONS)
_LARGE = {"minimum": -1e12, "maximum": 1e12}
_MOMENT = {"minimum": 1e-12, "maximum": 1e12}
_MOMENTS = ("A", "B", "C")
_STATE = tuple(f"{kind}{i}" for kind in ("omega", "gamma") for i in (1, 2, 3))

PARAMETERS = (
    *(Parameter(name, "principal moment of inertia", name, **_MOMENT) for name in _MOMENTS),
    Parameter("epsilon", "strength of the field, 3 mu / R^3", r"\varepsilon", default=1.0, **_LARGE),
    Parameter("Omega", "rate of the permanent rotation", r"\Omega", when=_ROTATION, **_LARGE),
    Parameter("sigma", "multiplier of F2 / 2", r"\sigma", when=_CRITICAL, **_LARGE),
    Parameter("p_psi", "value of F3, the momentum of the precession angle", r"p_\psi", when=_CRITICAL, **_LARGE),
    *(Parameter(f"omega{i}", f"initial angular velocity, component {i}", rf"\omega_{i}", default=0.0, when=_TIME,
                **_LARGE) for i in (1, 2, 3)),
    *(Parameter(f"gamma{i}", f"initial vertical, component {i}", rf"\gamma_{i}", default=float(i == 3), when=_TIME,
                **_LARGE) for i in (1, 2, 3)),
    Parameter("t", "time from the initial state (negative: before it)", "t", when=_TIME, uncut=True, **_LARGE),
)  # fmt: skip
OPTIONS = (
    Option("question", _QUESTIONS, "what is asked"),
    Option("axis", _MOMENTS, "the moment about whose axis the body rotates", when=_ROTATION),
    Option("sense", ("1", "-1"), "sign of turn_rate", when=_CRITICAL),
)
_VERDICT = {"undecided": clebsch.UNDECIDED, "unstable": clebsch.UNSTABLE, "stable": clebsch.STABLE}
_KEPT = {"H": ("energy", "H"), "F2": ("integral F2", "F_2"), "F3": ("integral F3", "F_3")}
_HAS_RATE = "where the moment is the least and epsilon < 0, or the largest and epsilon > 0"
STARTER = {"B": (0.01, 0.99), "C": (0.01, 0.99), "A": 1.0, "Omega": 0.8}
OUTPUTS = (
    Output("verdict", "is the rotation stable?", flags=_VERDICT, when=_ROTATION),
    Output("verdict", "is the critical motion stable?", flags=_VERDICT, when=_CRITICAL),
    Output("growth", "largest growth rate beside the rotation", r"\Lambda", when=_ROTATION),
    *(Output(f"frequency_{which}", f"frequency of the {which} mode beside the rotation, 0 for real exponents",
             rf"\omega_\mathrm{{{which}}}", when=_ROTATION) for which in ("slow", "fast")),
    Output("critical_rate", "rate above which the rotation is stable", r"\Omega_*", when=_ROTATION, applies=_HAS_RATE),
    Output("place", "which of the three moments belongs to the axis", when=_ROTATION,
           flags={"shared": -2, "least": clebsch.LEAST, "middle": clebsch.MIDDLE, "largest": clebsch.LARGEST}, fill=-2),
    *(Output(name, words, symbol) for name, (words, symbol) in _KEPT.items() if name != "F3"),
    *(Output("F3", "integral F3, the momentum of the precession angle", "F_3", when=when)
      for when in (_ROTATION, _TIME)),
    Output("turn_rate", "factor between w and (1 + sigma I)^-1 nu", r"\alpha", when=_CRITICAL),
    Output("period", "period of nu", "T", when=_CRITICAL,
           applies="where nu turns: sigma is not 0, and nu does not tend to a permanent rotation"),
    *(Output(f"w{i}", f"angular velocity at t, component {i}", f"w_{i}", when=_TIME) for i in (1, 2, 3)),
    *(Output(f"nu{i}", f"vertical at t, component {i} in the body's axes", rf"\nu_{i}", when=_TIME) for i in (1, 2, 3)),
    *(Output(f"{name}_drift", f"{words} at t less its first value: 0 within its error bar", rf"\Delta {symbol}",
             when=_TIME) for name, (words, symbol) in _KEPT.items()),
)  # fmt: skip


def cost(options, sizes):
    """Seconds per point, roughly."""
    return 6e-4 / sizes.get("t", 1) + 4e-6 if options["question"] == "trajectory" else 2e-6


def solve(point, request):
    """Every output at every point of the block (see `survey.scenes`)."""
    with np.errstate(all="ignore"):
        if request.options["question"] == "trajectory":
            return _trajectories(point, request)
        names = [p.name for p in PARAMETERS if p.name in point]
        arrays = np.broadcast_arrays(*(np.asarray(point[name], dtype=float) for name in names))
        given = dict(zip(names, arrays, strict=True))
        answer = _rotations if request.options["question"] == "rotation" else _critical
        status = np.where(_admissible(given), OK, INVALID_PARAMETERS)
        return _written(*answer(given, request.options, status))


def _admissible(given):
    """Are all numbers given, and no moment larger than the sum of the others but for rounding?"""
    moments = np.stack([given[name] for name in _MOMENTS])
    fits = 2.0 * moments.max(axis=0) <= moments.sum(axis=0) * (1.0 + 4e-16)
    return fits & np.isfinite(sum(given.values()))


def _rotations(given, options, status):
    order = [options["axis"], *(name for name in _MOMENTS if name != options["axis"])]
    found = clebsch.rotation([given[name] for name in order], given["epsilon"], given["Omega"])
    codes = {"verdict": found.pop("verdict"), "place": found.pop("place")}
    return found, codes, status


def _critical(given, options, status):
    moments = [given[name] for name in _MOMENTS]
    found = clebsch.critical(
        moments, given["epsilon"], given["sigma"], given["p_psi"], float(options["sense"])
    )
    exists, _certificate = found.pop("exists"), found.pop("certificate")
    return (
        found,
        {"verdict": found.pop("verdict")},
        np.where((status == OK) & ~exists, _NO_MOTION, status),
    )


def _written(found, codes, status):
    """The outputs, from Bounded and codes: NaN, or what codes have for it, where the status is not ok."""
    lost = (status == OK) & ~np.isfinite(found["H"].value + found["H"].bar)
    status = np.where(lost, OVERFLOW, status)
    out = {"status": status}
    good = status == OK
    for name, number in found.items():
        fine = good & np.isfinite(number.bar) & np.isfinite(number.value)
        out[name], out[f"{name}_error"] = (
            np.where(fine, x, np.nan) for x in (number.value, number.bar)
        )
    for name, values in codes.items():
        out[name] = np.where(good, values, -1 if name == "verdict" else -2)
    return out


def _trajectories(point, request):
    method = load(methods, "taylor" if request.method == "auto" else request.method, "method")
    names = (*_MOMENTS, "epsilon", *_STATE)
    shared = [point[name] for name in names]
    block = Rows(tuple(shared), point["t"])
    rows = dict(zip(names, block.columns(shared), strict=True))
    times = block.per_point(point["t"])
    moments, w, nu = (
        np.stack([rows[name] for name in part], axis=1)
        for part in (_MOMENTS, _STATE[:3], _STATE[3:])
    )
    scale = abs(nu).max(axis=1)
    nu = nu / np.where(scale > 0.0, scale, 1.0)[:, None]
    length = np.sqrt((nu * nu).sum(axis=1))
    good = _admissible(rows) & (length > 0.0) & np.isfinite(length)
    moments, w = (np.where(good[:, None], x, 1.0) for x in (moments, w))
    nu = np.where(good[:, None], nu / length[:, None], np.array([0.0, 0.0, 1.0]))
    epsilon = np.where(good, rows["epsilon"], 0.0)
    fine = good[:, None] & np.isfinite(times)
    G = np.zeros((len(w), gyrostat.ROWS, 3))
    for i in range(3):
        G[:, gyrostat.A + i, i] = moments[:, i]
        G[:, gyrostat.INVERSE + i, i] = 1.0 / moments[:, i]
        G[:, gyrostat.C + i, i] = epsilon * moments[:, i]
    floats, status = motion.trajectories(
        method, G, np.hstack([w, nu]), np.where(fine, times, 0.0), request.rtol
    )
    lost = (status == OK) & ~np.isfinite(floats).all(axis=-1)
    status = np.where(fine, np.where(lost, NO_CONVERGENCE, status), INVALID_PARAMETERS)
    floats[status != OK] = np.nan
    columns = {f"{kind}{i}": 3 * k + i - 1 for k, kind in enumerate(("w", "nu")) for i in (1, 2, 3)}
    found = {
        name: Bounded(floats[..., at], floats[..., STATE + at]) for name, at in columns.items()
    }
    inertia = [bounded.of(moments[:, i, None]) for i in range(3)]
    field = bounded.of(epsilon[:, None])
    first = [
        Bounded(x[:, i, None], width) for x, width in ((w, 0.0), (nu, 4e-16)) for i in range(3)
    ]
    kept = clebsch.integrals(inertia, field, first[:3], first[3:])
    later = clebsch.integrals(inertia, field, *(
        [found[f"{kind}{i}"] for i in (1, 2, 3)] for kind in ("w", "nu")))  # fmt: skip
    for name, number in kept.items():
        found[name], found[f"{name}_drift"] = number, later[name] - number
    out = {"status": block.back(status)}
    for name, number in found.items():
        for key, values in ((name, number.value), (f"{name}_error", number.bar)):
            out[key] = block.back(
                np.where(status == OK, np.broadcast_to(values, status.shape), np.nan)
            )
    return out


def why(answer):
    """Why a point has its verdict, in a sentence (see `survey.scenes`)."""
    if "turn_rate" in answer:
        return "the second variation of H + sigma F2 / 2 across the motion is " + {
            "stable": "definite", "unstable": "indefinite", "undecided": "not decided by its error bar"
        }[str(answer["verdict"])]  # fmt: skip
    if np.isfinite(answer["critical_rate"]):
        return f"the rate is compared with {named(answer, 'critical_rate')}"
    return {
        "stable": f"the moment is the {answer['place']} one: a combination of H and F3 has a strict extremum",
        "unstable": f"{'the moment is the middle one: ' * (answer['place'] == 'middle')}{named(answer, 'growth')}",
        "undecided": "two moments are equal, or nothing turns the body back, and deviations need not grow",
    }[str(answer["verdict"])]


def trajectory(point, answer, options, time=None):
    """w at times, and the path of the vertical on the sphere in the body's axes (see
    `survey.scenes`).

    Of a permanent rotation: the motion of a body that is turned from it by 1e-3. Of a critical
    motion: the motion.
    """
    t = np.linspace(0.0, 40.0 if time is None else float(time), 2001)
    body = {name: np.full((1, 1), float(point[name])) for name in (*_MOMENTS, "epsilon")}
    asked = body | dict(zip(_STATE, _start(point, answer, options), strict=True)) | {"t": t[None]}
    out = solve(asked, Request({"question": "trajectory"}, rtol=1e-9))
    data = {"t": ("t", t, {"long_name": "time", "symbol": "t", "units": "1"})}
    for o in OUTPUTS:
        if o.when == _TIME and o.name[-1] in "123" and o.name in out and o.name != "F3":
            meaning = {"long_name": o.long_name, "symbol": o.symbol, "units": o.units}
            data[o.name] = ("t", out[o.name][0], meaning)
            data[f"{o.name}_error"] = (
                "t",
                out[f"{o.name}_error"][0],
                meaning | {"long_name": f"error bound of {o.name}"},
            )
    return Trajectory(data, (("lines", "t", "w1", "w2", "w3"), ("sphere", "nu1", "nu2", "nu3")))


def _start(point, answer, options):
    """The state, six arrays (1, 1), from which the motion at a point is drawn."""
    if options["question"] == "trajectory":
        return [np.full((1, 1), float(point[name])) for name in _STATE]
    moments = np.array([float(point[name]) for name in _MOMENTS])
    if options["question"] == "rotation":
        nu, axis = np.full(3, 1e-3), _MOMENTS.index(options["axis"])
        nu[axis] = 1.0
        w = np.where(np.arange(3) == axis, float(point["Omega"]), 0.0)
    else:
        factors = 1.0 + float(point["sigma"]) * moments
        nu = _on_level(moments / factors, float(point["p_psi"]) / float(answer["turn_rate"]))
        w = float(answer["turn_rate"]) * nu / factors
    return [np.full((1, 1), x) for x in (*w, *nu)]


def _on_level(D, y):
    """A unit vector nu with nu.D nu = y, between the least and the largest of D."""
    low, middle, high = np.argsort(D)
    nu = np.zeros(3)
    pair = (low, middle) if y < D[middle] else (middle, high)
    share = np.clip((y - D[pair[0]]) / (D[pair[1]] - D[pair[0]]), 0.0, 1.0)
    nu[list(pair)] = np.sqrt(1.0 - share), np.sqrt(share)
    return nu
