"""A gyrostat with Barnett-London effect turning about axis 1: phi' = w, w' = f(phi) w + g(phi), on
the cylinder.

    f = b12 cos phi - b31 sin phi,
    g = -d cos phi sin phi - c23 cos 2phi + s2 cos phi - s3 sin phi                              (57)

Model: the six equations of `gyrostat_body`, on a set that is invariant under conditions necessary
and sufficient for it. Not for motions beside the set, which may leave it: see `gyrostat_body`.

Parameters, in order: b12, b31 (components of B over A11), d = c22 - c33 and c23 (of C), s2, s3 (of
s), up to 1e12; phi0 (rad) and w0, the initial angle and velocity. In (57) phi is the independent
variable and w w_phi = f w + g; here the system is solved in time, so turning points (w = 0) are
passed.

What is known. H = w^2/2 + V, V' = -g: dH/dt = f w^2. K = b12 s3 - b31 s2 decides the ends w ->
+-inf: both attract for K > 0 (spin-up, w^2 ~ K t), both repel for K < 0; at K = 0 L = (pi/2)(c23
(b12^2 - b31^2) - d b12 b31) decides. Integrable strata: I0 (g = 0), I1 (b = 0, H conserved), I2 (K
= L = 0). Symmetries: (b, w, t) -> -(b, w, t); (phi, w, b31, c23, s2) -> -(...); phi -> phi + pi,
(b, s) -> -(b, s); rotations of axes 2 and 3.

Source: M. E. Lesina, Ya. V. Zinovyeva, "The gyrostat with Barnett-London effect" (2004), checked
and corrected in `gyrostat.md` beside this file (with the classification that the fates follow).

A fate is decided by the monotone return maps and by proven regions of attraction, never by a limit
of steps; the cycles are those that a lattice of return maps shows, with dips followed down to
folds. b = 0 and g = 0 are taken exactly, K = 0 and L = 0 within the rounding of the parameters;
where K is larger than that, but the return maps do not show their change beside rounding, verdicts
are -1. `multiplier` and cycles carry error bars; verdicts near a stable separatrix are -1 (status
`separatrix`), also those of starts at rest beside a saddle: `equilibrium_start` is given only to
exact equilibria, and phi0 = 0, where s2 = c23, is the only binary64 angle that is one (if g is not
0 throughout).

On a map of a thousand or more initial states of one system the curves between basins are found
once: stable branches of saddles, those by which motions enter a node fastest, unstable cycles. A
start takes the fate of the region it lies in, which is that of two starts in it; a start nearer
to a curve than its error bar, or between windings too close to be told apart, is followed on its
own. Fates are the same, except that some are decided which could not be otherwise.

A motion is one curve through (phi0, w0), in time. As a solution w(phi) of (57) it has, where w0 = 0
and g(phi0) != 0, two branches, w ~ +-sqrt(2 g (phi - phi0)), both on the side of phi0 to which g
points. An Abel solution is the branch that the motion takes at t > 0, on which w has the sign of
g(phi0); `branch = "before"` takes the other, along which the motion came: there w has the other sign
and t < 0. Where w0 != 0 there is one branch, and the option changes nothing.

With `saddle` instead of w0 the solution lies on a separatrix, exactly: on a branch of the saddle of
that number (by angle in [0, 2 pi)), one that leaves it (`separatrix = "unstable"`) or runs into it
("stable"), on the `side` where phi0 is; of the saddle's copies, one per turn, the one next to phi0.
t = 0 where the branch, followed from the saddle, first passes phi0, before it turns; `w_start` is w
there. Where there is no such saddle, or the branch turns before phi0, the status is
`invalid_parameters`. For b = 0 these are closed forms at any t, also into a second saddle of the
same energy; so are motions whose phi0 = 0 and w0 give exactly the energy of a saddle (at no other
phi0 can binary64 do that). Degenerate equilibria count as saddles: they have branches here where b
= 0 and the root of g is exactly multiple. On a stable branch the fate is the saddle; on an unstable
one it is where that branch ends.

An Abel solution has status `ok` where it certainly reaches phi, `turning` where it turns before phi
or so near to it that phi lies within `phi_turning_error` of `phi_turning`.

`auto` takes trajectories and Abel solutions in closed form where one applies and keeps its digits
(method `closed`), else by Taylor series. Where these miss `rtol`, trajectories are computed again by
series of 23 digits, at ten times the cost; what is still open, and fates next to separatrices, are
solved in double-double arithmetic (some 1e-3 s each). `survey failures gyrostat` maps where each method fails.

`turnings` counts the zeros of w between 0 and t, its ends not among them; it is unknown where a
zero lies so near to t that the error bar of w leaves it open on which side.

The method `full` solves the six equations (1)-(6) of a gyrostat whose invariant set is this motion;
`survey verify` holds trajectories against it, and `workflows/gyrostat_deviation.py` measures how
deviations from the set grow.

A portrait is what the fates of a system share: ends, equilibria, cycles, and whether small changes of the parameters
keep them all. It is structurally stable where, by the error bars, K is off zero (L, where K = 0 exactly), no
equilibrium is degenerate or a Hopf point, no multiplier is 1, the signs of the return maps fit together (so the parity
law holds), and every branch of a saddle has an end that is known, unstable ones elsewhere than in a saddle; near
saddle connections it is -1.
Where an equilibrium is degenerate or a Hopf point within the rounding of binary64, the verdict is 0 and the status is
`degenerate_equilibrium`: ends and equilibria are given, numbers of cycles are not. The roots of g are then found in
double-double arithmetic, in disjoint discs that are proven to hold them; an equilibrium of the type `degenerate` stands
for the two or three roots within its error bar, a pair of which may be complex.

[boundaries] draws, over phi0 and w0, the stable manifolds of the saddles, cycles and equilibria;
over two parameters of the system, where portraits change: folds and Hopf curves of equilibria, K =
0, saddle connections, folds of cycles (see `measures/cylinder/curves.py`).

Questions: `trajectory` (phi and w at t), `abel` (w and t at phi), `fate` (where the solution ends)
and `portrait` (of the system, without an initial state).
"""

import numpy as np

from survey import methods
from survey.measures.cylinder import (
    auto,
    basins,
    blocks,
    destinations,
    fate,
    motion,
    portrait,
    separatrix,
    separatrix_fate,
    solution,
)
from survey.measures.cylinder.compile_ahead import compile_ahead as compile_ahead
from survey.measures.cylinder.fate import NO_TURNS
from survey.modules import load
from survey.scene import Option, Output, Parameter, Request, named, plus_minus
from survey.status import INVALID_PARAMETERS

TITLE = "Gyrostat with Barnett-London effect, rotation about axis 1"
FAMILY = "cylinder"
AUDIT = ("dop853", "full")
RATIOS = ("saddle",)
REFERENCES = (
    "M. E. Lesina, Ya. V. Zinovyeva (2004): Integration of the equations of a gyrostat with Barnett-London effect",
)

# beyond, binary64 has no digits left
_LARGE = {"minimum": -1e12, "maximum": 1e12}
_FAR = {"minimum": -1e9, "maximum": 1e9}
_SYSTEM = ("b12", "b31", "d", "c23", "s2", "s3")
_QUESTIONS = ("fate", "trajectory", "abel", "portrait")
_FATE, _TIME, _ABEL, _PORTRAIT = ({"question": (name,)} for name in _QUESTIONS)
_BRANCH = {"separatrix": ("unstable", "stable")}
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
    Parameter("saddle", "number, by angle in [0, 2 pi), of the saddle on whose separatrix the solution lies", "n_S",
              instead_of="w0", minimum=1.0, maximum=4.0, when=_STARTS),
    Parameter("t", "time from the initial state (negative: before it)", "t", when=_TIME, uncut=True, **_LARGE),
    Parameter("phi", "angle of rotation at which w and t are requested, unwrapped", r"\varphi", units="rad", when=_ABEL,
              uncut=True, **_FAR),
)  # fmt: skip
OPTIONS = (
    Option("question", _QUESTIONS, "what is asked of the solution, or of the system"),
    Option("branch", ("after", "before"), "where w0 = 0, the branch w(phi) that the motion takes at t > 0 or at t < 0",
           only_with="phi"),
    Option("separatrix", ("unstable", "stable"), "the branches that leave the saddle, or those that run into it",
           only_with="saddle"),
    Option("side", ("right", "left"), "the side of the saddle on which phi0 is", only_with="saddle"),
)  # fmt: skip
STATUS = {
    "turning": "the solution turns back before it reaches phi, or within phi_turning_error of it: phi_turning and "
    "t_turning say where and when",
    "equilibrium": "the solution runs into an equilibrium, in infinite time, before it reaches phi",
    "separatrix": "the error bar leaves it open on which side of a separatrix the solution passes",
    "no_closed_form": "no closed form applies (they need b = 0, g = 0 or (61)): try another method",
    "too_many_cycles": "there are more cycles than the file has room for: only the first are given",
    "degenerate_equilibrium": "within rounding g = g' = 0 at an angle, or f = g = 0 at an equilibrium that is "
    "not a saddle: the numbers of cycles are unknown; K, L, the stratum, the ends and the equilibria are given",
}
_FATES = {
    "undecided": -1, "focus_or_node": 0, "saddle": 1, "rotation_plus": 2, "rotation_minus": 3, "libration": 4,
    "spin_up_plus": 5, "spin_up_minus": 6, "periodic_rotation": 7, "periodic_libration": 8, "equilibrium_start": 9,
}  # fmt: skip
_BRANCH_ENDS = {"undecided": -1, "none": 0, "equilibrium": 1, "rotation_plus": 2, "rotation_minus": 3, "libration": 4,
                "plus_infinity": 5, "minus_infinity": 6}  # fmt: skip
_ENDS = {"repelling": 0, "neutral": 1, "attracting": 2}
_TYPES = ("none", "saddle", "attracting_node", "weak_node", "repelling_node", "attracting_focus", "weak_focus",
          "repelling_focus", "degenerate")  # fmt: skip
DIMENSIONS = {
    "equilibrium": np.arange(1, portrait.EQUILIBRIA + 1),
    "cycle": np.arange(1, portrait.CYCLES + 1),
    "branch": np.array(destinations.BRANCHES),
}

STARTER = {
    "phi0": (-3.14, 3.14),
    "w0": (-4.0, 4.0),
    "b12": 0.7,
    "b31": -0.4,
    "d": 1.1,
    "c23": 0.3,
    "s2": 0.5,
    "s3": -0.2,
}
OUTPUTS = (
    Output("phi", "angle of rotation at t, unwrapped", r"\varphi", units="rad", when=_TIME),
    Output("w", "angular velocity", "w", when={"question": ("trajectory", "abel")},
           applies="at an angle that the solution reaches"),
    Output("turnings", "number of turning points (sign changes of w)", "n_T", integer=True, fill=-2,
           applies="where the error bar leaves one number, if less than 2,147,483,648; -1 means infinitely many",
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
    Output("phi_saddle", "angle of the saddle, in [0, 2 pi)", r"\varphi_S", units="rad", when=_BRANCH,
           applies="where the branch passes phi0 before it turns"),
    Output("w_start", "angular velocity at phi0 on the separatrix", r"w(\varphi_0)", when=_BRANCH,
           applies="where the branch passes phi0 before it turns"),
    Output("K", "K = b12 s3 - b31 s2, which decides the ends", "K", when=_PORTRAIT),
    Output("L", "L = (pi/2)(c23 (b12^2 - b31^2) - d b12 b31), which decides them where K = 0", "L", when=_PORTRAIT),
    Output("stratum", "g = 0 (I0), b = 0 (I1), K = L = 0 (I2), or none of them (G)", when=_PORTRAIT,
           flags={"I0": 0, "I1": 1, "I2": 2, "G": 3}),
    Output("end_plus", "does w -> +inf attract?", flags=_ENDS, when=_PORTRAIT),
    Output("end_minus", "does w -> -inf attract?", flags=_ENDS, when=_PORTRAIT),
    Output("equilibria", "number of equilibria on the circle", integer=True, when=_PORTRAIT,
           applies="except in stratum I0, where every angle is an equilibrium"),
    Output("saddles", "number of saddles", integer=True, when=_PORTRAIT, applies="except in stratum I0"),
    Output("rotations_plus", "number of isolated rotation cycles with w > 0", integer=True, when=_PORTRAIT,
           applies="except beside a degenerate equilibrium or a Hopf point"),
    Output("rotations_minus", "number of isolated rotation cycles with w < 0", integer=True, when=_PORTRAIT,
           applies="except beside a degenerate equilibrium or a Hopf point"),
    Output("librations", "number of isolated libration cycles", integer=True, when=_PORTRAIT,
           applies="except beside a degenerate equilibrium or a Hopf point"),
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
    Output("cycle_inside", "number of equilibria that the cycle surrounds", integer=True, when=_PORTRAIT,
           dims=("cycle",), applies="to librations"),
    Output("branch_end", "where the branch of the saddle goes: the unstable ones for t -> +inf, the stable ones for "
           "t -> -inf", flags=_BRANCH_ENDS, when=_PORTRAIT, dims=("equilibrium", "branch"), fill=0,
           applies="to saddles, among as many entries as there are equilibria; infinity means w"),
    Output("branch_limit", "number of the equilibrium, or of the cycle, to which the branch goes", integer=True, fill=0,
           when=_PORTRAIT, dims=("equilibrium", "branch"), applies="where the branch goes to one of the two"),
    Output("verdict", "is the portrait structurally stable?", when=_PORTRAIT,
           flags={"undecided": -1, "degenerate": 0, "structurally_stable": 1}),
)  # fmt: skip


def cost(options, sizes):
    """Seconds per point, rough: one solution serves its dense outputs, one set of cycles all fates
    of a system.
    """
    if options["question"] == "portrait":
        return 3e-3
    if "separatrix" in options and options["question"] == "fate":
        return 5e-3
    if "separatrix" in options:  # in double-double arithmetic, but where b = 0
        return 2e-3 / sizes.get("t", sizes.get("phi")) + 4e-6
    if options["question"] == "trajectory":
        return 6.5e-6 / sizes["t"] + 2e-7
    if options["question"] == "abel":
        return 3e-6 / sizes["phi"] + 3e-7
    return basins.cost(sizes["phi0"] * sizes["w0"], 1.3e-4, 1.5e-3)


def solve(point, request):
    """Every output at every point of the block."""
    method = load(methods, "taylor" if request.method == "auto" else request.method, "method")
    question = request.options.get("question", "fate")
    if question == "fate" and "separatrix" in request.options:
        return _fates_on_separatrices(point, request, method)
    if question in ("fate", "portrait"):
        answers = blocks.fates if question == "fate" else blocks.portraits
        return answers(point, _SYSTEM, np.asarray, method, request)
    if "separatrix" in request.options:
        return _separatrix(point, request, question)
    measure, start = auto if request.method == "auto" else solution, (*_SYSTEM, "phi0", "w0")
    measure = (
        separatrix.SeparatrixAware(measure) if request.method in ("auto", "closed") else measure
    )
    if question == "trajectory":
        return blocks.trajectories(*blocks.dense(point, start, "t"), measure, method, request)
    return blocks.abel(*blocks.dense(point, start, "phi"), measure, method, request)


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
    if verdict == "saddle":
        return f"it is on a stable branch of the saddle {named(answer, 'limit_phi')}"
    return f"its end is inside the region of attraction of the equilibrium {named(answer, 'limit_phi')}"


def _why_portrait(answer):
    margins = [named(answer, "K")]
    off = np.abs(answer["cycle_multiplier"] - 1.0)
    if np.isfinite(off).any():
        nearest = np.nanargmin(off)
        near = plus_minus(
            answer["cycle_multiplier"][nearest], answer["cycle_multiplier_error"][nearest]
        )
        margins.append(f"the multiplier nearest to 1 is {near}")
    words = {
        "structurally_stable": "no margin is within its error bar",
        "degenerate": "one of the margins is within its error bar of 0",
    }
    return f"stratum {answer['stratum']}, {', '.join(margins)}: " + words.get(
        answer["verdict"],
        "near a saddle connection, or a fold of equilibria or cycles, the bars leave it open",
    )


def trajectory(point, answer, options, time=None):
    """The orbit on the cylinder and some of its neighbours, from `phi0`, `w0` (see `survey.scenes`)."""

    def motions(asked):
        out = solve(asked, Request({"question": "trajectory"}, rtol=1e-9))
        if "saddle" in point:  # its own orbit follows the separatrix exactly
            alone = {name: asked[name] for name in (*_SYSTEM, "t")}
            alone |= {"phi0": asked["phi0"][:1], "saddle": np.full((1, 1), point["saddle"])}
            branch = solve(alone, Request({**options, "question": "trajectory"}))
            for name in ("phi", "w", "phi_error", "w_error"):
                out[name][0] = branch[name][0]
        return out

    start = {"w0": answer["w_start"]} if "saddle" in point else {}
    flow = [point[name] for name in _SYSTEM]
    return motion.solve(motions, OUTPUTS, _SYSTEM, {**point, **start}, time, flow=flow)


def _separatrix(point, request, question):
    """The questions `trajectory` and `abel`, of solutions that start on a separatrix."""
    in_time = question == "trajectory"
    rows, columns, back = blocks.dense(
        point, (*_SYSTEM, "phi0", "saddle"), "t" if in_time else "phi"
    )
    rows, columns, good = blocks.valid(rows, columns)
    method = None if request.method == "auto" else load(methods, request.method, "method")
    stable, left = request.options["separatrix"] == "stable", request.options["side"] == "left"
    measure = separatrix.trajectories if in_time else separatrix.abel
    *results, heads = measure(method, rows, columns, request.rtol, stable, left)
    results = (blocks.at_times if in_time else blocks.at_angles)(results, good, back)
    return results | _heads(
        heads, lambda column: back(np.broadcast_to(column[:, None], columns.shape))
    )


def _heads(heads, back):
    """The saddle and the velocity at phi0, from the HEADS of `separatrix`."""
    results = {}
    for name, value, bar in (("phi_saddle", separatrix.SADDLE, separatrix.SADDLE_BAR),
                             ("w_start", separatrix.START, separatrix.START_BAR)):  # fmt: skip
        for key, at in ((name, value), (f"{name}_error", bar)):
            results[key] = back(heads[:, at])
    return results


def _fates_on_separatrices(point, request, method):
    """The question `fate`, of solutions that start on a separatrix."""
    given = np.broadcast_arrays(
        *(np.asarray(point[name], dtype=float) for name in (*_SYSTEM, "phi0", "saddle"))
    )
    rows = np.stack([array.ravel() for array in given], axis=-1)
    shape = given[0].shape
    good = np.isfinite(rows).all(axis=1)
    stable, left = request.options["separatrix"] == "stable", request.options["side"] == "left"
    found, heads = separatrix_fate.solve(method, rows[good], request.rtol, stable, left)
    found |= _heads(heads, lambda column: column)
    results = fate.empty(len(rows), INVALID_PARAMETERS)
    for name, values in found.items():
        results.setdefault(name, np.full(len(rows), np.nan))[good] = values
    return {name: values.reshape(shape) for name, values in results.items()}
