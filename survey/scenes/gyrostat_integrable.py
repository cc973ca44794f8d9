"""The integrable cases of the gyrostat with Barnett-London effect, each by the paper's own
constants.

Option case:

inclined       (43)-(50): A11 phi' = (B12 sin phi + B31 cos phi) sin theta0 + n
trigonometric  (58)-(61): A11 phi' = mu (B12 sin phi + B31 cos phi - S2 B31 / C23), mu^2 - mu = -A11 C23 / (B12 B31)
elliptic       (62)-(68): A11 phi'^2 = n + (C22 - C33) cos 2phi / 2 - C23 sin 2phi + 2 S2 sin phi + 2 S3 cos phi
quartic        (64)-(68): u'^2 = P4(u) / 4 of u = tan(phi / 2), P4 = a0 u^4 + 4 a1 u^3 + 6 a2 u^2 + 4 a3 u + a4

Model: the flow of the scene `gyrostat`, itself a reduction of the whole body, where further
conditions on the constants give closed forms. Without these conditions: `gyrostat`.

Parameters, in order: A11; B12, B31; theta0, the angle between the axis of rotation and the
vertical; n, or instead of it k, the constant of (7), which with lambda1 gives n = k / cos theta0 -
lambda1; C22, C33, C23; S2, S3; the quartic's a0, a1, a2, a3, a4; phi0; w0, where the energy leaves
it free; t. At phi0 the constants give phi', but only up to its sign where its square is given (a0
to a4): option direction.

Of the two solutions (61), `root` takes mu >= 1/2 (upper) or mu <= 1/2 (lower). It exists where A11
C23 / (B12 B31) <= 1/4, and it demands C22 - C33 = C23 (B12^2 - B31^2) / (B12 B31) and S3 = S2 B31 /
B12, which are outputs here.

What is known. In the first two cases phi' depends on phi alone: with Delta^2 = n^2 - P^2 - Q^2 > 0
the body turns with the period 2 pi A11 / Delta; otherwise it comes to rest at an angle. In the
others phi is an elliptic function of t with the invariants g2, g3; the discriminant of P4 is 256 G.
G < 0: two real roots; G > 0: none (rotation) or four; G = 0 is a separatrix, or a degenerate rest.
Where the constants make G exactly 0 (all a0 to a4, or the others at phi0 = 0) the solution is that
on the separatrix, (66), exactly.

Source: M. E. Lesina, Ya. V. Zinovyeva, "The gyrostat with Barnett-London effect" (2004), corrected in `gyrostat.md`;
`gyrostat_integrable.md` beside this file.
The conditions under which a body moves like this are checked by the scene `gyrostat_body`; the
scene `gyrostat` takes the outputs reduced_NAME. All error bars cover the rounding of the reduction.
"""

import math
from fractions import Fraction

import numpy as np

from survey import methods
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import OF_G
from survey.kernels.cylinder.steps import NO_CONVERGENCE, OK, TRUST, TURNING, UNDETERMINED
from survey.kernels.math.roundoff import EPS
from survey.measures.cylinder import auto, blocks, quartic, separatrix, solution
from survey.modules import load
from survey.scene import Option, Output, Parameter, named
from survey.scenes import gyrostat

TITLE = "Gyrostat with Barnett-London effect, the integrable cases"
FAMILY = "cylinder"
AUDIT = ("dop853",)
RATIOS = ()
REFERENCES = gyrostat.REFERENCES
_LARGE = {"minimum": -1e9, "maximum": 1e9}
_CASES = ("inclined", "trigonometric", "elliptic", "quartic")
_INCLINED, _TRIGONOMETRIC, _ELLIPTIC, _QUARTIC = ({"case": (name,)} for name in _CASES)
_LINEAR, _OF_ENERGY, _OF_BODY = {"case": _CASES[:2]}, {"case": _CASES[2:]}, {"case": _CASES[:3]}
_POTENTIAL = {"case": _CASES[1:3]}
_QUARTIC_NAMES = ("a0", "a1", "a2", "a3", "a4")
_REDUCED = ("b12", "b31", "d", "c23", "s2", "s3")

PARAMETERS = (
    Parameter("A11", "moment of inertia about the axis of rotation", "A_{11}", default=1.0, minimum=0.0,
              open_minimum=True, maximum=1e9, when=_OF_BODY),
    Parameter("B12", "Barnett-London coefficient", "B_{12}", when=_LINEAR, **_LARGE),
    Parameter("B31", "Barnett-London coefficient", "B_{31}", when=_LINEAR, **_LARGE),
    Parameter("theta0", "angle between the axis of rotation and the vertical", r"\theta_0", units="rad", minimum=0.0,
              maximum=math.pi, open_minimum=True, open_maximum=True, excluded=(0.5 * math.pi,), when=_INCLINED),
    Parameter("n", "constant of (49)", "n", when=_INCLINED, **_LARGE),
    Parameter("k", "constant of the integral (7)", "k", instead_of="n", when=_INCLINED, **_LARGE),
    Parameter("lambda1", "gyrostatic moment about the axis, which counts with k", r"\lambda_1", default=0.0,
              when=_INCLINED, **_LARGE),
    Parameter("C22", "element of the potential matrix", "C_{22}", default=0.0, when=_ELLIPTIC, **_LARGE),
    Parameter("C33", "element of the potential matrix", "C_{33}", default=0.0, when=_ELLIPTIC, **_LARGE),
    Parameter("C23", "element of the potential matrix", "C_{23}", default=0.0, when=_POTENTIAL, **_LARGE),
    Parameter("S2", "component of the centre of mass vector", "s_2", default=0.0, when=_POTENTIAL, **_LARGE),
    Parameter("S3", "component of the centre of mass vector", "s_3", default=0.0, when=_ELLIPTIC, **_LARGE),
    *(Parameter(name, f"coefficient of the quartic P4, number {i}", f"a_{i}", when=_QUARTIC, **_LARGE)
      for i, name in enumerate(_QUARTIC_NAMES)),
    Parameter("phi0", "initial angle of rotation", r"\varphi_0", units="rad", default=0.0, minimum=-1e6, maximum=1e6),
    Parameter("w0", "initial angular velocity", "w_0", when=_ELLIPTIC, **_LARGE),
    Parameter("t", "time (negative: before the initial state)", "t", default=0.0, uncut=True, **_LARGE),
)  # fmt: skip
OPTIONS = (
    Option("case", _CASES, "which of the integrable cases"),
    Option("root", ("upper", "lower"), "which of the two roots mu of (61)", when=_TRIGONOMETRIC),
    Option("direction", ("1", "-1"), "sign of the initial angular velocity", only_with="a0"),
)  # fmt: skip
STATUS = {
    "invalid_parameters": "the parameters lie outside the domain; (61) needs B12, B31 and C23 other than 0 and "
    "A11 C23 / (B12 B31) <= 1/4, a quartic P4 >= 0 at phi0",
    **{name: gyrostat.STATUS[name] for name in ("turning", "equilibrium", "separatrix")},
}
DIMENSIONS = {"coefficient": np.arange(5), "root": np.arange(1, 5)}
_MOTIONS = {"undecided": -1, "comes_to_rest": 0, "rotation": 1, "libration": 2}
OUTPUTS = (
    Output("phi", "angle of rotation at t, unwrapped", r"\varphi", units="rad"),
    Output("w", "angular velocity at t", "w"),
    Output("turnings", "number of turning points (sign changes of w)", "n_T", integer=True, fill=-2,
           applies="where the error bar leaves one number"),
    Output("w_start", "angular velocity at phi0", r"w(\varphi_0)"),
    Output("verdict", "what the motion is", flags=_MOTIONS),
    Output("period", "time of a full turn, or of a libration to and fro", "T", applies="to rotations and librations"),
    Output("delta2", "Delta^2 = n^2 - P^2 - Q^2 of (50), over A11^2", r"\Delta^2", when=_LINEAR),
    Output("phi_limit", "angle at which the body comes to rest, in [0, 2 pi)", r"\varphi_\infty", units="rad",
           when=_LINEAR, applies="where it comes to rest"),
    Output("mu", "mu of (61)", r"\mu", when=_TRIGONOMETRIC),
    Output("n_star", "constant n* of (58), over A11", "n_*", when=_TRIGONOMETRIC),
    Output("C22_minus_C33", "the difference that (60) demands", "C_{22} - C_{33}", when=_TRIGONOMETRIC),
    Output("S3", "the component of the centre of mass vector that (60) demands", "s_3", when=_TRIGONOMETRIC),
    Output("energy", "constant n of (63), over A11", r"\tilde n", when=_OF_ENERGY),
    Output("a", "coefficients a0 to a4 of P4 (65), over A11", "a", when=_OF_ENERGY, dims=("coefficient",)),
    *(Output(f"root_{end}", f"{words} part of the roots of P4, real ones first", when=_OF_ENERGY, dims=("root",),
             applies="to finite roots: where P4 is of lower degree the others are at phi = pi; bars of multiple roots "
             "are wide, or there are none")
      for end, words in (("re", "real"), ("im", "imaginary"))),
    Output("g2", "invariant g2 of (67)", "g_2", when=_OF_ENERGY),
    Output("g3", "invariant g3 of (67)", "g_3", when=_OF_ENERGY),
    Output("G", "G = g2^3 - 27 g3^2 of (68)", "G", when=_OF_ENERGY),
)  # fmt: skip
_SAME = 1e-14  # how far 1/4 - A11 C23 / (B12 B31) may be below 0: mu = 1/2 within its root
_BESIDE = 8.0  # times what inputs may be off: how far beside them the motion is solved again


def cost(options, sizes):
    """Seconds per point, roughly: heads in Python, and closed forms at each time."""
    return 1.5e-4 / sizes["t"] + 6e-6


def solve(point, request):
    """Every output at every point of the block (see `survey.scenes`)."""
    case = request.options["case"]
    names = [p.name for p in PARAMETERS if p.name in point and p.name != "t"]
    rows, times, back = blocks.dense(point, names, "t")
    rows, times, good = blocks.valid(rows, times)
    given = dict(zip(names, rows.T, strict=True))
    with np.errstate(all="ignore"):
        heads, flows, slack = _REDUCTIONS[case](given, request.options)
        real = (
            np.isfinite(flows).all(axis=1)
            & (np.abs(flows[:, : rc.SIX]) <= 1e12).all(axis=1)
            & good.any(axis=1)
        )
        flows, slack = np.where(real[:, None], flows, 0.0), np.where(real[:, None], slack, 0.0)
        motions = _Motions(case, given, flows, slack, request)
        found = _carried(lambda rows: motions.at(rows, times), flows, slack)
        results = blocks.at_times(found, good & real[:, None], back)
        heads["w_start"] = flows[:, rc.W0], slack[:, rc.W0]
        motions.known(heads, slack)
    solved = (results["status"] == OK).astype(bool)
    for name, (value, bar) in heads.items():
        for key, column in ((name, value), (f"{name}_error", bar)):
            column = np.where(real.reshape(-1, *[1] * (column.ndim - 1)), column, np.nan)
            stacked = [
                back(np.broadcast_to(c[:, None], times.shape)) for c in np.atleast_2d(column.T)
            ]
            results[key] = np.stack(stacked, axis=-1) if column.ndim > 1 else stacked[0]
    verdict = back(np.broadcast_to(motions.verdict[:, None], times.shape))
    results["verdict"] = np.where(solved, verdict, _MOTIONS["undecided"])
    return results


def why(answer):
    """Why a point has its verdict, in a sentence (see `survey.scenes`)."""
    decides = named(answer, "delta2" if "delta2" in answer else "G")
    return {
        "undecided": f"the error bar leaves it open: {decides}",
        "comes_to_rest": f"it tends to an angle where phi' = 0: {decides}",
    }.get(answer["verdict"], f"{decides}, period {named(answer, 'period')}")


def trajectory(point, answer, options, time=None):
    """The motion among those of its flow, from `phi0` (see `survey.scenes`)."""
    given = {name: np.array([float(value)]) for name, value in point.items() if name != "t"}
    _heads, flows, _slack = _REDUCTIONS[options["case"]](given, options)
    start = dict(zip((*_REDUCED, "phi0", "w0"), flows[0].tolist(), strict=True))
    return gyrostat.trajectory(start, answer, {"question": "trajectory"}, time)


def _inclined(given, _options):
    """Heads, rows of the reduced flow and what these may be off: g = 0, b = (P, Q) / A11."""
    A11, theta0 = given["A11"], given["theta0"]
    n = given.get("n")
    size = 0.0
    if n is None:
        n = given["k"] / np.cos(theta0) - given["lambda1"]
        size = 4.0 * np.abs(n + given["lambda1"]) + np.abs(given["lambda1"])
    sine = np.sin(theta0)
    b12, b31, free = given["B12"] * sine / A11, given["B31"] * sine / A11, n / A11
    return _of_first_order(given["phi0"], b12, b31, free, 4 * EPS * (np.abs(b12) + np.abs(b31)),
                           EPS * (2.0 * np.abs(free) + size / A11))  # fmt: skip


def _trigonometric(given, options):
    A11, B12, B31, C23, S2 = (given[name] for name in ("A11", "B12", "B31", "C23", "S2"))
    product = A11 * C23 / (B12 * B31)
    inner = np.array(
        [_under_root(*constants) for constants in zip(A11, C23, B12, B31, strict=True)]
    )
    upper = 0.5 + np.sqrt(np.where((inner < 0.0) & (inner >= -_SAME), 0.0, inner))
    mu = upper if options.get("root", "upper") == "upper" else product / upper
    d_mu = 8 * EPS * np.abs(mu) + np.sqrt(np.maximum(-inner, 0.0))
    n_star, share = -mu * (S2 * B31 / (C23 * A11)), d_mu / np.abs(mu) + 5 * EPS
    b12, b31 = mu * B12 / A11, mu * B31 / A11
    heads, rows, slack = _of_first_order(
        given["phi0"], b12, b31, n_star, share * (np.abs(b12) + np.abs(b31)), share * np.abs(n_star)
    )
    difference, S3 = C23 * (B12 / B31 - B31 / B12), S2 * B31 / B12
    d_difference = 5 * EPS * np.abs(C23) * (np.abs(B12 / B31) + np.abs(B31 / B12))
    heads |= {
        "mu": (mu, d_mu),
        "n_star": (n_star, share * np.abs(n_star)),
        "S3": (S3, 3 * EPS * np.abs(S3)),
    }
    heads["C22_minus_C33"] = difference, d_difference
    return heads, rows, slack


def _under_root(A11, C23, B12, B31):
    """1/4 - A11 C23 / (B12 B31), rounded once; NaN where there is no solution (61)."""
    if B12 * B31 * C23 == 0.0:
        return np.nan
    return float(Fraction(1, 4) - Fraction(A11) * Fraction(C23) / (Fraction(B12) * Fraction(B31)))


def _of_first_order(phi0, b12, b31, n, d_b, d_n):
    """phi' = b12 sin phi + b31 cos phi + n, b12 and b31 known within d_b, n within d_n."""
    b = np.hypot(b12, b31)
    terms = b12 * np.sin(phi0), b31 * np.cos(phi0), n
    w0 = sum(terms)
    d_w = d_n + d_b + 3 * EPS * sum(np.abs(term) for term in terms)
    delta2 = (n - b) * (n + b)
    d_delta2 = 2 * (np.abs(n) * d_n + b * (d_b + 3 * EPS * b)) + 4 * EPS * np.abs(delta2)
    half = np.arccos(np.clip(-n / b, -1.0, 1.0))
    slip = (d_n + d_b + 4 * EPS * (np.abs(n) + b)) / (b * np.sin(half)) + 4 * EPS
    zero = np.zeros_like(w0)
    rows = np.column_stack([b12, b31, zero, zero, zero, zero, phi0, w0])
    slack = np.column_stack([zero + d_b, zero + d_b, zero, zero, zero, zero, zero, d_w])
    stops = delta2 < -d_delta2
    limit = (np.arctan2(b12, b31) + half) % (2 * np.pi)
    turn = 2 * np.pi / np.sqrt(np.where(delta2 > d_delta2, delta2, np.nan))
    heads = {"delta2": (delta2, d_delta2), "period": (turn, turn * (d_delta2 / delta2 + 4 * EPS)),
             "phi_limit": (np.where(stops, limit, np.nan), np.where(stops, slip, np.nan))}  # fmt: skip
    return heads, rows, slack


def _elliptic(given, _options):
    A11, phi0, w0 = given["A11"], given["phi0"], given["w0"]
    potential = [
        (given["C22"] - given["C33"]) / A11,
        *(given[name] / A11 for name in ("C23", "S2", "S3")),
    ]
    moved, size = quartic.square_of_w(*potential, phi0)
    n, d_n = w0 * w0 - moved, 6 * EPS * (size + w0 * w0)
    a, bars = quartic.coefficients(*potential, n, d_n)
    zero = np.zeros_like(w0)
    slack = np.column_stack([zero, zero, *(2 * EPS * np.abs(x) for x in potential), zero, zero])
    rows = np.column_stack([zero, zero, *potential, phi0, w0])
    return _heads_of_quartic(n, d_n, a, bars + 2 * EPS * np.abs(a)), rows, slack


def _of_quartic(given, options):
    a = np.column_stack([given[name] for name in _QUARTIC_NAMES])
    phi0, sizes = given["phi0"], np.abs(a)
    *potential, n = quartic.system(a)
    moved, _size = quartic.square_of_w(*potential, phi0)
    outer, inner = sizes[:, 0] + sizes[:, 4] + 6 * sizes[:, 2], sizes[:, 1] + sizes[:, 3]
    square, d_square = n + moved, 6 * EPS * (2 * outer + 4 * inner)
    w0 = np.sqrt(np.where(square < -d_square, np.nan, np.maximum(square, 0.0)))
    w0 = np.where(np.abs(square) <= d_square, 0.0, w0) * float(options.get("direction", "1"))
    zero = np.zeros_like(w0)
    slack = [
        EPS * outer,
        EPS * inner,
        EPS * inner,
        EPS * outer,
        zero,
        d_square / np.maximum(np.abs(w0), 1e-300),
    ]
    slack[-1] = np.where(w0 == 0.0, 0.0, slack[-1])
    heads = _heads_of_quartic(n, 2 * EPS * outer, a, 0.0 * a)
    return (
        heads,
        np.column_stack([zero, zero, *potential, phi0, w0]),
        np.column_stack([zero, zero, *slack]),
    )


def _heads_of_quartic(n, d_n, a, bars):
    g2, g3, G = quartic.invariants(a, bars)
    roots, radii = quartic.roots(a, bars)
    return {"energy": (n, d_n), "a": (a, bars), "g2": g2, "g3": g3, "G": G, "root_re": (roots.real, radii),
            "root_im": (roots.imag, np.where(roots.imag == 0.0, 0.0, radii))}  # fmt: skip


_REDUCTIONS = {
    "inclined": _inclined,
    "trigonometric": _trigonometric,
    "elliptic": _elliptic,
    "quartic": _of_quartic,
}


class _Motions:
    """The motions of a block, on separatrices where the constants are exactly those of one; verdict
    and period.
    """

    def __init__(self, case, given, flows, slack, request):
        self.case, self.flows, self.slack, self.rtol = case, flows, slack, request.rtol
        self.method = load(
            methods, "taylor" if request.method == "auto" else request.method, "method"
        )
        self.measure = auto if request.method == "auto" else solution
        self.verdict = np.full(len(flows), _MOTIONS["undecided"])
        self.branches = [self._branch(i, given) for i in range(len(flows))]

    def _branch(self, i, given):
        row = self.flows[i]
        if (
            self.case in _CASES[:2]
            or row[rc.W0] == 0.0
            or (self.case == "elliptic" and given["phi0"][i] != 0.0)
        ):
            return None
        exact = {name: Fraction(float(values[i])) for name, values in given.items()}
        if self.case == "quartic":
            a = [exact[name] for name in _QUARTIC_NAMES]
        else:
            potential = [exact["C22"] - exact["C33"], exact["C23"], exact["S2"], exact["S3"]]
            a = quartic.at_zero(*(x / exact["A11"] for x in potential), exact["w0"])
        if not quartic.is_degenerate(a):
            return None
        if [Fraction(float(x)) for x in row[OF_G]] == list(quartic.system(a)[:4]):
            self.slack[i] = 0.0  # no rounding at all
        return separatrix.branch_of(row)

    def at(self, rows, times):
        """floats, turnings and status of `rows` at the times."""
        results = self.measure.trajectories(self.method, rows, times, self.rtol)
        own = [i for i, branch in enumerate(self.branches) if branch]
        if own:
            found = separatrix.through(
                rows[own], times[own], self.rtol, [self.branches[i] for i in own]
            )
            for result, new in zip(results, found, strict=True):
                result[own] = new
        return results

    def known(self, heads, slack):
        """Verdict and, where energy decides it, the period."""
        if self.case in _CASES[:2]:
            delta2, bar = heads["delta2"]
            moves = np.abs(self.flows[:, rc.W0]) > slack[:, rc.W0]
            self.verdict[moves & (delta2 > bar)] = _MOTIONS["rotation"]
            self.verdict[moves & (delta2 < -bar)] = _MOTIONS["comes_to_rest"]
            return
        floats, kinds, _ = _carried(self._turn, self.flows, slack)
        (period, _, bar, _) = floats[:, 0].T
        on = np.array([branch is not None for branch in self.branches])
        found = (bar < TRUST * (1.0 + period)) & ~on
        heads["period"] = np.where(found, period, np.nan), np.where(found, bar, np.nan)
        self.verdict[found], self.verdict[on] = kinds[found], _MOTIONS["comes_to_rest"]

    def _turn(self, rows):
        """The period as `solution.trajectories` gives phi, and what the motion is."""
        ends = rows[:, rc.PHI0, None] + 2 * np.pi * np.array([1.0, -1.0])
        floats, status = self.measure.abel(self.method, rows, ends, self.rtol)
        t, bars = floats[..., rc.TIME], floats[..., rc.TIME_BAR]
        swings, rotates = (status == TURNING).all(axis=1), (status == OK).all(axis=1)
        back = rows[:, rc.W0] < 0.0
        turn, bar = (np.where(back, x[:, 1], x[:, 0]) for x in (t, bars))
        period = np.where(swings, 2 * np.abs(t[:, 0] - t[:, 1]), np.where(rotates, turn, np.nan))
        bar = np.where(swings, 2 * bars.sum(axis=1), bar + np.abs(4 * EPS / rows[:, rc.W0]))
        both = np.stack([period, period, bar + 4 * EPS * period, bar], axis=-1)[:, None]
        return both, np.where(swings, _MOTIONS["libration"], _MOTIONS["rotation"]), None


def _carried(solve, rows, slack):
    """`solve(rows)`, its bars widened by what rows that are off by `slack` change, as solutions
    beside them show.
    """
    floats, turnings, status = solve(rows)
    for column in np.flatnonzero(slack.any(axis=0)):
        beside = rows.copy()
        beside[:, column] += _BESIDE * slack[:, column]
        others, counts, codes = solve(beside)
        floats[..., 2:] += 1.2 / _BESIDE * np.abs(others - floats)[..., :2]
        if codes is not None:
            turnings[counts != turnings] = UNDETERMINED
            status[(status == OK) & (codes != OK)] = NO_CONVERGENCE
    if status is not None:
        lost = ~(floats[..., 2:] < TRUST * (1.0 + np.abs(floats[..., :2]))).all(axis=-1) & (
            status == OK
        )
        floats[lost], status[lost] = np.nan, NO_CONVERGENCE
    return floats, turnings, status
