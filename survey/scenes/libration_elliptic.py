"""Triangular libration points of the elliptic restricted three-body problem: Danby's map of linear
stability.

    xi'' - 2 eta' = d1 r xi,   eta'' + 2 xi' = d2 r eta,   r = 1 / (1 + e cos f),
    d1, d2 = (3/2)(1 +- s),   s = sqrt(1 - 3 mu (1 - mu))

in the true anomaly f, period 2 pi, in pulsating axes along the principal directions of the
potential; out of the plane zeta'' + zeta = 0, which is stable.

Model: the elliptic restricted problem, six-dimensional, linearised about the point, which is at
rest in these axes; half a period suffices, by symmetry. Not for displacements that are not small.

Parameters, in order: mu (mass ratio of the smaller primary, 0 to 1/2) and e (eccentricity, 0 <= e <
1), without units.

Outputs: a and b, the coefficients of the monodromy's characteristic polynomial l^4 - a l^3 + b l^2
- a l + 1; the verdict; and `collision`. The motion is stable below the curve B(e) and, for e <
0.31450715975493514, between the curves A(e) and KC(e), a strip that narrows to nothing at the tip
mu = 0.04699080701821065, where A and KC are tangent. On A and B two multipliers meet at -1, on KC
two pairs of unlike Krein sign meet on the circle.

`collision` says how stability is lost, or would be lost first. Where it is lost: 1 if a pair of
multipliers is real and negative, 2 if the four are complex and off the circle, 0 (neither of the
two) if only real positive ones are off it, or at mu = 0. At a stable point the multipliers exp(+-i
theta1), exp(+-i theta2), theta1 < theta2, lose it by the meeting whose arc is the shorter: 2 (pi -
theta2), at -1, or theta2 - theta1, between the pairs; pairs of like Krein sign (B D > 0) may meet
without harm, so there it is 1. It is -1 where the error bars leave it open.

On request, the outputs of `survey.floquet` for the canonical system in x = xi, q = eta' + xi, p =
xi' - eta, m = -eta: `multiplier_re`, `multiplier_im`, `spectral_radius`, `exponent` (per radian of
f), `krein`, `crossing`, `monodromy`. They are in float64: beyond 1 - e = 1e-7 a point has no value
(`overflow`) where they are named. `crossing` is by the nearest place on the circle, 1 too, although
multipliers meet there at mu = 0 alone; which loss can happen says `collision`.

What is known. e = 0 is the circular problem: a = 2 cos 2 pi w1 + 2 cos 2 pi w2, stable for 27 mu (1
- mu) < 1 (Routh). mu = 0 is Kepler's problem: a = 4, b = 6, unstable by a secular term. a and b are
even in e, and the same at 1 - mu. As e -> 1 the multipliers grow like (1 - e)^-5 and more: values
are given, as accurate as requested, to about 1 - e = 1e-13 (then `overflow`, as their bars leave
the range of float32). For mu below about 1e-26, e > 0, all is too near Kepler's problem for a
verdict.

`auto` takes Chebyshev series in both parameters and, where these leave the verdict or `collision` open
or miss `rtol`, Taylor series in double-double; the other methods take steps in float64 alone.

Source: J. M. A. Danby, Astron. J. 69 (1964) 165; checked and completed in `libration_elliptic.md`
beside this file.
"""

from dataclasses import replace

import numpy as np

from survey import status
from survey.measures import linear_motion
from survey.measures.floquet import stability
from survey.measures.floquet.compile_ahead import compile_ahead as _family_ahead
from survey.measures.libration import danby, motion
from survey.measures.libration.danby_double import compile_ahead as _double_ahead
from survey.measures.rows import Rows
from survey.scene import Parameter, Trajectory, plus_minus

TITLE = "Stability of the triangular libration points of the elliptic problem"
FAMILY = "danby"
STATUS = {}
AUDIT = ("taylor16",)
REFERENCES = (
    "J. M. A. Danby, Astronomical Journal 69 (1964) 165",
    "A. P. Markeev, Libration points in celestial mechanics and cosmodynamics (1978)",
)
PARAMETERS = (
    Parameter("mu", "mass ratio of the smaller primary", r"\mu", minimum=0.0, maximum=0.5),
    Parameter(
        "e",
        "eccentricity of the primaries' orbits",
        "e",
        minimum=0.0,
        maximum=1.0,
        open_maximum=True,
    ),
)
OPTIONS = ()
STARTER = {"mu": (0.0005, 0.06), "e": (0.0, 0.7)}
_NAMES = (
    "multiplier_re",
    "multiplier_im",
    "spectral_radius",
    "exponent",
    "monodromy",
    "krein",
    "crossing",
)
_FAMILY = tuple(replace(o, on_request=True) for o in stability.OUTPUTS if o.name in _NAMES)
OUTPUTS = (*danby.OUTPUTS, *_FAMILY)
SECONDS = dict.fromkeys(_NAMES, 1e-6)  # on maps, by series
COMPILING = dict.fromkeys(_NAMES, 11)  # measured, 2 cores
DIMENSIONS = {name: np.arange(1, 5) for name in ("multiplier", "row", "column")}
states = ("x", "q", "p", "m")
structure = "symplectic"


def cost(options, sizes):
    """Seconds per point, roughly: a series for every row of one e, its values and their verdicts."""
    return 4e-5 / sizes["mu"] + 1e-7 if sizes["mu"] >= danby.DENSE else 8e-7


def solve(point, request):
    """All outputs of a block (see `survey.scenes`)."""
    block = Rows((point["e"],), point["mu"])
    line = request.line("mu")
    dense = line is not None and line[0] >= danby.DENSE
    e, mu = block.per_row(point["e"]), block.per_point(point["mu"])
    out = danby.solve(e, mu, request.method, request.rtol, dense)
    wanted = {*request.variables, "status"} if request.variables else {*out}
    # to turn a map about takes as long as a tenth of it
    out = {
        name: block.back(values)
        for name, values in out.items()
        if name.removesuffix("_error") in wanted
    }
    asked = {o.name for o in _FAMILY} & set(request.variables)
    return _with_family(out, point, request, asked) if asked else out


def compile_ahead(variables, options):
    """Compile what double-double arithmetic needs, then what the family "floquet" needs (see
    `survey.scenes`).
    """
    yield from _double_ahead(variables, options)
    if not {o.name for o in _FAMILY}.isdisjoint(variables):
        yield from _family_ahead(variables, options)


def _with_family(out, point, request, asked):
    """The outputs with those that are asked of the family "floquet"."""
    mu, e = np.broadcast_arrays(point["mu"], point["e"])
    lines = {i: request.line(name) for i, name in enumerate(("mu", "e")) if request.line(name)}
    given = np.stack([mu, e], axis=-1), request.method, request.rtol, asked, lines
    found = stability.solve(danby.SYSTEM, structure, *given)
    own, theirs = out["status"], found.pop("status")
    known = (own == status.OK) & (theirs == status.OK)
    for name, values in (out | found).items():
        nothing = np.nan if values.dtype.kind == "f" else 0 if name == "krein" else -1
        here = known.reshape(known.shape + (1,) * (values.ndim - known.ndim))
        out[name] = np.where(here, values, nothing).astype(values.dtype)
    return out | {"status": np.where(own == status.OK, theirs, own)}


def equation(names, ends, options):
    """The equation (3) of `libration_elliptic.md` in formulas (see `survey.scenes`)."""
    mu, e = names["mu"], names["e"]
    s, r = f"sqrt(1 - 3*{mu}*(1 - {mu}))", f"(1/(1 + {e}*cos(u)))"
    return "reversible", [
        ("pi", "1", "-1", f"1 - 3*(1 - {s})/2*{r}", f"3*(1 + {s})/2*{r} - 1", "1", "-1")
    ]


def trajectory(point, answer, options, time=None):
    """A planar orbit of the linear equations, from rest beside L4, and the multipliers (see
    `survey.scenes`).
    """
    found, bars = motion.multipliers(
        *(float(answer[name]) for name in ("a", "a_error", "b", "b_error"))
    )
    growth = np.log(abs(found).max())
    turns = np.clip(motion.GROWTH / growth if growth > 1e-6 else 6, 1, 6) // 1
    data = motion.orbit(point["mu"], point["e"], 2 * np.pi * turns if time is None else time)
    data |= linear_motion.described(found, bars)
    return Trajectory(data, (("plane", "eta", "xi"), ("multipliers",)))


def why(answer):
    """Why a point has its verdict, in a sentence (see `survey.scenes`)."""
    a, da, b, db = (float(answer[name]) for name in ("a", "a_error", "b", "b_error"))
    margins = {
        "2 + 2 a + b": (2 + 2 * a + b, 2 * da + db, "multipliers meet at -1"),
        "2 - 2 a + b": (2 - 2 * a + b, 2 * da + db, "multipliers meet at 1"),
        "a^2/4 - b + 2": (a * a / 4 - b + 2, abs(a) * da / 2 + db, "two pairs meet"),
        "4 - |a|": (4 - abs(a), da, "multipliers are real"),
    }
    least = min(margins, key=lambda name: margins[name][0])
    value, bar, meeting = margins[least]
    sign = {"stable": "> 0, and so are the other margins", "unstable": "is not positive"}.get(
        answer["verdict"], "is open"
    )
    margin = f"{least} = {plus_minus(value, bar)} {sign} (at 0 {meeting})"
    return f"{margin}; decided by half-period factors, whose bars are sharper"
