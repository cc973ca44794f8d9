"""Formal stability of the triangular libration points of the spatial circular restricted three-body
problem.

    H = L + N + M + ...,  L = omega1 r1 - omega2 r2 + r3,  N = sum c_ijk r1^i r2^j r3^k (i+j+k = 2),  M likewise (3.13)

is the normal form at L4 (or L5: the same numbers) to order 6 in the coordinates; r1, r2 are the
actions of the motions in the plane of the primaries, r3 that across it.

Model: the spatial restricted three-body problem, six-dimensional, as a formal series in three
actions. Not where its remainder counts (`workflows/libration_effective.py`), and not a proof of
Lyapunov stability.

Parameter: mu (mass of the smaller primary over that of both, 1e-100 <= mu <= 1/2), taken as the
float64 it is. Unit of time: the primaries turn by one radian.

What is known. Linearly stable for mu < mu_R = (1 - sqrt(23/27))/2 = 0.0385208965... The c_ijk have
closed forms, singular only at mu_R, at omega1 = 2 omega2 (mu1 = 0.0242938971...) and, for two of
order 6, at omega1 = 3 omega2 (mu2 = 0.0135160160...); at mu1 and mu2 L4 is unstable. By order 4 it
is formally stable outside mu_c <= mu <= mu_d = 0.0109136676..., 0.0163767553...; there M decides on
the one ray of L = N = 0 with r >= 0, and M is not 0 on it.

What is proved, and what is not. Verdict 1 is proved for every such mu: L and H - L are formal integrals whatever the
frequencies, and L^4 + (H - L)^2 is definite. Verdict 2 is proved where omega1, omega2, 1 satisfy at most one
independent relation k . omega = 0 over the integers. Where they satisfy two (omega1 and omega2 both rational: a
countable, dense set of mu, the rank-2 resonances), only L and H are sure to be formal integrals, no function of them is
definite, and "M is not 0" does not settle the point. No float64 is such a mu (`libration.md`), so verdict 2
is proved for the very number given, and not for all real mu beside it.
The closed forms of order 6 were found by exact rational reconstruction and hold at 110 rational points and against
Lie series to 90 digits; they are not derived symbolically. Formal stability is not Lyapunov stability.

The discriminant of (3.11) is positive and Arnold's bordered determinant not 0 for every mu < mu_R:
by KAM theory most motions near L4 stay on tori, on every level of energy. In three degrees of
freedom tori do not separate the others, so this does not prove Lyapunov stability. With the
option `order` = 8 or 10 the coefficients go further (Lie series), and `effective_radius` says
within which distance motions stay for `periods` periods of the primaries.

Verdict 3 means that the half-ulp interval of mu contains mu1 or mu2, 4 that it contains mu_R.

Source: A. P. Markeev, Libration Points in Celestial Mechanics and Cosmodynamics (1978), chapter 8,
section 3, checked and corrected in `libration.md` beside this file, whose equation numbers are
used; planar coefficients: A. Deprit, A. Deprit-Bartholome, Astronomical Journal 72 (1967) 173; K.
R. Meyer, D. S. Schmidt, J. Differential Equations 62 (1986).

`auto` takes closed forms in float64, and in double-double where `rtol` is missed or the verdict is
left open; orders 8 and 10 by Lie series in float64, and in double-double where `rtol` is missed.
"""

import numpy as np

from survey import status
from survey.kernels.libration.coefficients import LABELS
from survey.measures.libration import higher, motion, normal_form
from survey.scene import Option, Output, Parameter, Trajectory, named

TITLE = "Formal stability of the triangular libration points"
FAMILY = "normal_form"
AUDIT = ("rational_double", "lie")
OPTIONS = (
    Option(
        "order",
        ("6", "8", "10"),
        "order of the normal form; beyond 6 by Lie series, with effective stability",
    ),
)
STATUS = {
    "overflow": "no digit is certain so close to a resonance or to an end of the interval: try the "
    "method rational_double",
}
REFERENCES = (
    "A. P. Markeev (1978): Libration Points in Celestial Mechanics and Cosmodynamics (Nauka), chapter 8",
    "A. Deprit, A. Deprit-Bartholome, Astronomical Journal 72 (1967) 173",
    "K. R. Meyer, D. S. Schmidt, Journal of Differential Equations 62 (1986) 222",
)
_HIGHER = {"order": ("8", "10")}
PARAMETERS = (
    Parameter("mu", "mass of the smaller primary over the sum of both", r"\mu", minimum=1e-100, maximum=0.5),
    Parameter("periods", "time for which motions must stay, in periods of the primaries", r"T/2\pi", default=1e9,
              minimum=1.0, maximum=1e100, when=_HIGHER),
)  # fmt: skip
DIMENSIONS = {"monomial": np.array(LABELS), "ray": np.array([1, 2]), "component": np.array(["k1", "k2", "k3"]),
              "monomial8": np.array(higher.labels(8)), "monomial10": np.array(higher.labels(10))}  # fmt: skip
_VERDICTS = {
    "undecided": normal_form.UNDECIDED,
    "linearly_unstable": normal_form.UNSTABLE,
    "formally_stable_by_order_4": normal_form.ORDER_4,
    "formally_stable_by_order_6": normal_form.ORDER_6,
    "unstable_by_resonance": normal_form.RESONANT,
    "boundary": normal_form.BOUNDARY,
}
_BELOW = "at mu < mu_R = 0.0385208965..."
_SERIES = (
    _BELOW
    + ", where the series keep digits: not at mu -> 0, next to mu_R, or with a divisor below 1e-20"
)
STARTER = {"mu": (0.001, 0.05)}
OUTPUTS = (
    Output("omega1", "greater frequency in the plane", r"\omega_1", applies=_BELOW),
    Output("omega2", "smaller frequency in the plane (of negative energy)", r"\omega_2", applies=_BELOW),
    Output("c", "coefficient of r1^i r2^j r3^k, monomial ijk, in the normal form", "c_{ijk}", dims=("monomial",),
           applies=_BELOW + "; analytic in mu except for poles: not the whole normal form at a resonance"),
    Output("a20", "coefficient of r1^2 in N where L = 0", "a_{20}", applies=_BELOW),
    Output("a11", "coefficient of r1 r2 in N where L = 0", "a_{11}", applies=_BELOW),
    Output("a02", "coefficient of r2^2 in N where L = 0", "a_{02}", applies=_BELOW),
    Output("D4", "N at r = (omega2, omega1, 0)", "D_4", applies=_BELOW),
    Output("D6", "M at r = (omega2, omega1, 0)", "D_6", applies=_BELOW),
    Output("M_ray", "M on the ray r = (alpha2, 1, beta2) of L = N = 0", r"M(\alpha_2, 1, \beta_2)",
           applies="where that ray lies in the octant r >= 0: a02 > 0 > D4"),
    Output("resonance_order", "order |k1| + |k2| + |k3| of the nearest resonance with even k3, up to order 8",
           integer=True, applies=_BELOW),
    Output("resonance_distance", "distance |k1 omega1 - k2 omega2 + k3| of that resonance", r"|k \cdot \omega|",
           applies=_BELOW + "; (2, 0, -2) and (1, 1, 0), met at mu = 0 and mu_R, count too"),
    Output("resonance", "k of that resonance, k1 omega1 - k2 omega2 + k3", "k", integer=True, fill=normal_form.FILL,
           dims=("component",), applies=_BELOW),
    Output("discriminant", "a11^2 - 4 a20 a02 of (3.11): positive, so that N = 0 has two rays on L = 0",
           r"a_{11}^2 - 4 a_{20} a_{02}", applies=_BELOW),
    Output("alpha", "r1 / r2 on the rays of L = N = 0 (3.11)", r"\alpha_j", dims=("ray",),
           applies=_BELOW + "; on ray 1 not where a20 may be 0 (mu** = 0.0027834757...)"),
    Output("beta", "r3 / r2 on these rays", r"\beta_j", dims=("ray",), applies=_BELOW + ", as alpha"),
    Output("det_N", "determinant of N'', the second derivatives by the actions", r"\det N''",
           applies=_BELOW + "; not 0 except at mu = 0.0215391147..."),
    Output("det_bordered", "determinant of N'' bordered by the frequencies (Arnold)",
           r"\det N''_\omega",
           applies=_BELOW + "; never 0: by KAM theory most motions near L4 stay on tori on every level of energy, "
           "which for three degrees of freedom do not keep the others in: this is not Lyapunov stability"),
    Output("c8", "coefficient of r1^i r2^j r3^k, monomial ijk of four actions", "c_{ijk}", dims=("monomial8",),
           when=_HIGHER, applies=_SERIES),
    Output("c10", "coefficient of r1^i r2^j r3^k, monomial ijk of five actions", "c_{ijk}", dims=("monomial10",),
           when={"order": ("10",)}, applies=_SERIES),
    Output("effective_radius", "radius of effective stability: motions that begin with |z_j| below it stay within "
           "sqrt 2 times it for `periods`; an estimate by truncated series, not a proof", r"\rho", when=_HIGHER,
           applies=_SERIES),
    Output("effective_order", "degree to which the Hamiltonian was normalised for it", "r", integer=True,
           when=_HIGHER, applies=_SERIES),
    Output("verdict", "formal stability", flags=_VERDICTS,
           applies="by order 6 is proved unless omega1 and omega2 are both rational (rank-2 resonances: countable, "
           "dense, but no float64 mu is one), where M != 0 settles nothing; formal is not Lyapunov stability"),
)  # fmt: skip


def cost(options, sizes):
    """Seconds per point, roughly."""
    return {"6": 6e-6, "8": 2e-3, "10": 1e-2}[options["order"]]


def solve(point, request):
    """All outputs of a block (see `survey.scenes`)."""
    shape = np.broadcast_shapes(*(np.shape(values) for values in point.values()))
    mu = np.broadcast_to(point["mu"], shape).astype(float).ravel()
    answer = normal_form.solve(mu, request.method, request.rtol)
    order = int(request.options["order"])
    if order in higher.ORDERS:
        periods = np.broadcast_to(point["periods"], shape).ravel()
        more = higher.solve(
            mu, np.where(periods >= 1.0, periods, 1.0), order, request.method, request.rtol
        )
        good = (answer["status"] == status.OK) & np.isfinite(periods)
        for name, values in more.items():
            none = -1 if values.dtype.kind == "i" else np.nan
            answer[name] = np.where(
                good.reshape(-1, *[1] * (values.ndim - 1)), values, none
            ).astype(values.dtype)
    return {name: values.reshape(shape + values.shape[1:]) for name, values in answer.items()}


def trajectory(point, answer, options, time=None):
    """A planar orbit of the linear equations, from rest beside L4 (see `survey.scenes`)."""
    slow = float(answer["omega2"])
    suits = 3 * 2 * np.pi / slow if np.isfinite(slow) else 4 * np.pi
    data = motion.orbit(point["mu"], 0.0, min(suits, 100 * np.pi) if time is None else time)
    return Trajectory(data, (("plane", "eta", "xi"), ("lines", "f", "xi", "eta")))


def why(answer):
    """Why a point has its verdict, in a sentence (see `survey.scenes`)."""
    verdict = answer["verdict"]
    if verdict == "linearly_unstable":
        return "mu > mu_R = 0.0385208965...: the frequencies omega1 and omega2 are not real"
    if verdict in ("boundary", "unstable_by_resonance"):
        return "the half-ulp interval of mu contains " + (
            "mu_R" if verdict == "boundary" else "mu1 or mu2"
        )
    if verdict == "formally_stable_by_order_6":
        return (
            f"{named(answer, 'D4')} < 0 < {named(answer, 'a02')}: N vanishes on one ray of L = 0, where "
            + (f"{named(answer, 'M_ray')} is not 0")
        )
    if verdict == "formally_stable_by_order_4":
        return f"{named(answer, 'D4')} and {named(answer, 'a02')} have the same sign: N is definite where L = 0, r >= 0"
    return "an error bar reaches across 0: " + ", ".join(
        named(answer, name) for name in ("D4", "a02")
    )
