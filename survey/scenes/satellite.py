"""Out-of-plane stability of the planar motions of an axisymmetric satellite on a circular orbit.

The axis librates in the orbital plane (k < 1, amplitude asin k) or rotates (k > 1). Small motions out of the plane
obey Hill's equation, in u = omega_p t, omega_p^2 = 3 omega_0^2 |I - Iz| / I, with rho = omega_0 / omega_p:

    y'' + z y = 0,    z = 2 w^2 + 2 rho w + rho^2 + c,    w = dx/du = k cn(u, k)   (k < 1)
                                                                   = k dn(k u, 1/k)  (k > 1)
    c = 1 - k^2   prolate, alpha = Iz/I < 1   (printed + k^2 in Astakhova's eq. 3: see the errata in satellite.md)
    c = -k^2      oblate,  alpha > 1;         T = 4 K(k), or 2 K(1/k) / k for rotations

Model: the body's rotation in three dimensions. Without spin the plane of the orbit is invariant,
and linear motion across it is this equation, exactly. Not for spin, finite tilts, eccentric orbits,
bodies without an axis of symmetry.

Parameters, in order: k >= 0, where k = 1 has only the outputs separatrix_*; or one_minus_k = 1 - k <= 1 where that is
small (negative: rotations); or amplitude = asin k (rad), a libration's. rho, any sign: rho^2 = 1 / (3 |1 - alpha|), so
rho >= 1/sqrt(3) is a body; rho < 0 is a retrograde rotation. Or, instead of rho and the body, inertia_ratio = alpha:
0 a thin rod, 2 a disc.

Known: at k = 0 every gap is closed and D = 2 cos(2 pi sqrt(1 + rho^2)) (prolate), 2 cos(2 pi rho) (oblate); rho = 0 is
an edge of Lame's equation, |D| = 2; D is even in rho for librations; tongue n opens as k^n; k = 1 is a scattering
problem that has no verdict, and tongues accumulate there.
"""

from math import pi

import numpy as np

from survey import status
from survey.errors import BadInput
from survey.kernels.hill import dop853, taylor_double
from survey.kernels.hill import satellite as motion
from survey.kernels.hill.answers import LARGEST, NO_RULE, NO_UNSTABLE_SIDE, ON_EDGE
from survey.kernels.hill.satellite import potential, sample, tabulate
from survey.kernels.jit import kernel
from survey.kernels.math.elliptic import MEANS
from survey.kernels.math.roundoff import EPS
from survey.measures import linear_motion
from survey.measures.hill import dense, monodromy, nonlinear, scattering
from survey.measures.hill import motion as hill_motion
from survey.measures.hill import why as hill_why
from survey.measures.hill.satellite import Motion, moduli, planar_angle, rates
from survey.measures.rows import Rows
from survey.scene import Option, Output, Parameter, Trajectory

TITLE = "Out-of-plane stability of a satellite's planar librations and rotations"
FAMILY = "hill"
STATUS = {}
AUDIT = ("dop853",)
REFERENCES = (
    "I. S. Astakhova, Transformation of satellite equations to Hill's equation (errata: survey/scenes/satellite.md)",
    "H. M. Yehia, S. Z. Nabih (2013), AJIS 2(6), 127: the same problem, a chart by inertia ratio and amplitude",
    "W. Magnus, S. Winkler, Hill's Equation, Interscience 1966",
)

PARAMETERS = (
    Parameter("k", "modulus of the planar motion", "k",
              minimum=0.0, maximum=1e12, excluded=(1.0,), but_for="separatrix_"),
    Parameter("one_minus_k", "1 - k, where k is close to 1", "1-k",
              minimum=-1e12, maximum=1.0, excluded=(0.0,), but_for="separatrix_", instead_of="k"),
    Parameter("amplitude", "amplitude of the libration, asin k", r"\beta", "rad",
              minimum=0.0, maximum=pi / 2, open_maximum=True, instead_of="k"),
    Parameter("rho", "orbital rate over libration rate", r"\rho", minimum=-1e12, maximum=1e12),
    Parameter("inertia_ratio", "inertia ratio Iz / I", r"\alpha",
              minimum=0.0, maximum=2.0, excluded=(1.0,), instead_of="rho"),
)  # fmt: skip
OPTIONS = (
    Option(
        "body",
        ("prolate", "oblate"),
        "shape of the body: Iz < I or Iz > I",
        replaced_by="inertia_ratio",
    ),
    Option(
        "direction",
        ("1", "-1"),
        "sense of a rotation: 1 as the orbit, -1 against it",
        only_with="inertia_ratio",
    ),
)
why = hill_why.why
_CRITERION = {"silent": 0, "certifies_stability": 1}
STARTER = {"k": (0.0, 0.98), "rho": (0.0, 4.0)}
OUTPUTS = (
    *monodromy.OUTPUTS,
    Output("exponent_per_orbit", "growth of the logarithm of the amplitude per orbital revolution", r"\mu",
           applies="where rho is not 0"),
    Output("lyapunov", "Lyapunov's criterion: z >= 0 and T times the integral of z over T <= 4",
           flags=_CRITERION),
    Output("lyapunov_integral", "T times the integral of z over T, which Lyapunov's criterion compares with 4",
           r"T\int_0^T z\,du", on_request=True),
    Output("least_z", "least z along the motion", r"\min z", on_request=True),
    Output("zhukovskii", "Zhukovskii's criterion: n^2 pi^2 / T^2 <= z <= (n + 1)^2 pi^2 / T^2 for one n = 0, 1, ...",
           flags=_CRITERION, on_request=True),
    *(Output(name, words, symbol, applies=where, on_request=True)
      for name, (words, symbol, where) in scattering.NAMES.items()),
    *nonlinear.OUTPUTS,
)  # fmt: skip

_OF_PERIOD = {"period", "exponent_per_orbit", "lyapunov", "lyapunov_integral", "zhukovskii"}

# K by the arithmetic-geometric mean, as it is where a machine has no longer floats than float64,
# and k' from k.
_PERIOD_ULPS = 6


# measured: a motion along the separatrix, or a normal form, for each point
SECONDS = dict.fromkeys(scattering.NAMES, 1.2e-4) | {o.name: 9e-5 for o in nonlinear.OUTPUTS}


def cost(options, sizes):
    """Seconds per point, roughly."""
    rows = max(sizes.get(name, 1) for name in ("k", "one_minus_k", "amplitude"))
    return monodromy.cost(rows, max(sizes.get(name, 1) for name in ("rho", "inertia_ratio")))


def _separatrix_alone(variables):
    """Whether only outputs of the motion on the separatrix are requested; none named means all outputs."""
    return bool(variables) and set(variables) <= scattering.NAMES.keys()


def solve(point, request):
    """All outputs of a block that the request wants (see `survey.scenes`)."""
    if _separatrix_alone(request.variables):
        return _passages(point, request)
    shared = moduli(point)
    if "rho" in point:
        oblate = request.options["body"] == "oblate"
        return _solve(
            shared, point["rho"], oblate, request, line=request.line("rho"), ends=_ends(request)
        )
    alpha = np.asarray(point["inertia_ratio"], dtype=float)
    rho, low = rates(alpha, request.options["direction"])
    line, ends = _line_of_rho(request), _ends(request)
    bodies = [
        _solve(
            shared, np.where((alpha > 1) == oblate, rho, np.nan), oblate, request, low, line, ends
        )
        for oblate in np.unique(alpha > 1)
    ]
    if len(bodies) == 1:
        return bodies[0]
    return {name: np.where(alpha > 1, bodies[1][name], bodies[0][name]) for name in bodies[0]}


def equation(names, ends, options):
    """The equation in formulas (see `survey.scenes`), in the angle u = am of a libration, u = x of
    a rotation.

    As a function of u, y has an equation with a first derivative, which y = A^(-1/4) v removes; at
    u = 0 and at the half period A > 0 and A' = 0, so that the factors of v have the signs of those
    of y.
    """
    k = next(
        text.format(names[name])
        for name, text in (("k", "{}"), ("one_minus_k", "(1 - {})"), ("amplitude", "sin({})"))
        if name in names
    )
    rho, oblate = _body(names, ends, options)
    rest = f"cos({names['amplitude']})**2" if "amplitude" in names else f"(1 - {k}**2)"
    c = f"(-{k}**2)" if oblate else rest
    if _rotates(names, ends):
        a = f"(cos(u)**2 - {rest})"
        z = f"2 + (2*{rho}*sqrt({a}) + {rho}**2 + {c})/{a} + cos(2*u)/(2*{a}) + 3*sin(2*u)**2/(16*{a}**2)"
        return "even", [("pi/2", z)]
    a = f"(cos(u)**2 + {rest}*sin(u)**2)"
    w = f"{k}*cos(u)"
    z = f"(2*({w})**2 + 2*{rho}*{w} + {rho}**2 + {c})/{a} + {k}**2*cos(2*u)/(2*{a})"
    return "even", [("pi", f"{z} + 3*({k}**2*sin(2*u)/{a})**2/16")]


def _body(names, ends, options):
    """(rho as a formula, is the body oblate?); raises BadInput if the map contains bodies without a
    preferred axis.
    """
    if "rho" in names:
        return names["rho"], options["body"] == "oblate"
    alpha = names["inertia_ratio"]
    low, high = ends["inertia_ratio"]
    if low <= 1 <= high:
        raise BadInput(
            "prove: the axis inertia_ratio contains 1, where rho is infinite; end it before, or begin after"
        )
    rho = f"sqrt(3*({alpha} - 1))" if low > 1 else f"sqrt(3*(1 - {alpha}))"
    return f"({'-' if str(options['direction']) == '-1' else ''}1/{rho})", low > 1


def _rotates(names, ends):
    """Are the motions rotations? Raises BadInput if the map contains the separatrix."""
    name = next(name for name in ("k", "one_minus_k", "amplitude") if name in names)
    edge = {"k": 1.0, "one_minus_k": 0.0, "amplitude": pi / 2}[name]
    low, high = ends[name]
    if low <= edge <= high:
        raise BadInput(
            f"prove: the axis {name} contains {edge:g}, the separatrix; end it before, or begin after"
        )
    return low < edge if name == "one_minus_k" else low > edge


def compile_ahead(variables, options):
    """Compile some of the kernels of a map of these variables (see `survey.scenes`)."""
    if not _separatrix_alone(variables):
        yield from dense.compile_ahead(sample, np.empty((0, motion.ROW)), variables)


def trajectory(point, answer, options, time=None):
    """Solutions and multipliers of a point (see `survey.scenes`)."""
    rho, oblate = point.get("rho"), options.get("body") == "oblate"
    if rho is None:
        rho, _ = rates(point["inertia_ratio"], options["direction"])
        oblate = point["inertia_ratio"] > 1
    shared = moduli({name: np.array([value]) for name, value in point.items()})
    found = hill_motion.solve(
        _problem(Motion(*shared, bool(oblate)), np.array([[rho]])), answer, time, "u"
    )
    (k,), (kc,) = shared[:2]
    x, off = planar_angle(found.data["u"][1], float(k), float(kc))
    words = "angle of the planar motion in radians"
    data = found.data | linear_motion.value("u", "x", "x", words, x, off)
    return Trajectory(data, (("lines", "u", "x"), *found.panels))


def _solve(shared, rho, oblate, request, low=None, line=None, ends=None):
    """The outputs for one kind of body; points not of it have rho = NaN. `low` is what float64 took
    from rho.
    """
    box = None if low is not None else _box(request, oblate)
    if box is not None:
        return _solve_scattered(box, shared, rho, oblate, request)
    block = Rows(shared, rho)
    row = Motion(*(block.per_row(values) for values in shared), bool(oblate))
    problem = _problem(
        row, block.view(rho), None if low is None else block.per_point(low), line, ends
    )
    into = _own_outputs(block, request) if low is None else {}
    out = monodromy.solve(problem, request.method, request.rtol, _wanted(request), into)
    period = None if _wanted(request).isdisjoint(_OF_PERIOD) else row.period
    return _derived(out, row, problem.p, block, request, period)


def _own_outputs(block, request):
    """The arrays of `request.out`, but for error bounds from which other outputs follow."""
    derived = _wanted(request) & ({"exponent_per_orbit"} | nonlinear.NAMES)
    used = {"exponent_error", "discriminant_error"} if derived else set()
    return {name: a for name, a in block.straight(request.out).items() if name not in used}


def _passages(point, request):
    """The outputs of a passage along the separatrix alone, which exist at k = 1 too."""
    if "rho" in point:
        rho = point["rho"]
        oblate = np.array(request.options["body"] == "oblate")
    else:
        rho, _ = rates(point["inertia_ratio"], request.options["direction"])
        oblate = point["inertia_ratio"] > 1
    name = next(name for name in ("k", "one_minus_k", "amplitude") if name in point)
    rotates = {"k": point[name] > 1, "one_minus_k": point[name] < 0}.get(name, np.array(False))
    known, rho, oblate, rotates = np.broadcast_arrays(
        np.isfinite(point[name]) & np.isfinite(rho), rho, oblate, rotates
    )
    out = {"status": np.where(known, status.OK, status.INVALID_PARAMETERS)}
    for which in np.unique(oblate):
        found = scattering.solve(
            np.where(known & (oblate == which), rho, np.nan), rotates, which, request.variables
        )
        for key, pair in found.items():
            for output, values in zip((key, f"{key}_error"), pair, strict=True):
                out[output] = np.where(oblate == which, values, out.get(output, np.nan))
    return out


def _wanted(request):
    wanted = set(request.variables)
    if not wanted.isdisjoint(nonlinear.NAMES):
        wanted |= {"verdict", "discriminant"}
    return wanted | ({"exponent"} if "exponent_per_orbit" in wanted else set())


def _derived(out, row, rho, block, request, period):
    """The outputs in the block's shape, with those that follow from the others, the rows' motions
    and `rho`.
    """
    wanted, ok = _wanted(request), out["status"] == status.OK
    rho = _of_one_row(rho)
    if "period" in wanted:
        for name, values in (("period", period), ("period_error", _PERIOD_ULPS * EPS * period)):
            column = values[:, None]
            out[name] = column if ok.all() else np.where(ok, column, np.nan)
    if "exponent_per_orbit" in wanted:
        _per_orbit(out, abs(rho) * (period[:, None] / (2 * pi)))
    if "lyapunov" in wanted:
        out["lyapunov"] = (row.lyapunov(rho, period) & ok).astype(np.int8)
    _criteria(out, row, rho, period, wanted, ok)
    return {name: block.back(values) for name, values in out.items()}


def _criteria(out, row, rho, period, wanted, ok):
    """Add what the criteria of Lyapunov and Zhukovskii compare."""
    found = {}
    if "lyapunov_integral" in wanted:
        found["lyapunov_integral"] = row.lyapunov_integral(rho, period)
    if "least_z" in wanted:
        least, _, bar = row.range_of_z(rho)
        found["least_z"] = least, bar
    if not wanted.isdisjoint(scattering.NAMES):
        found |= scattering.solve(
            np.broadcast_to(rho, ok.shape), row.rotates[:, None], row.oblate, wanted
        )
    for name, (values, bars) in found.items():
        out[name], out[f"{name}_error"] = np.where(ok, values, np.nan), np.where(ok, bars, np.nan)
    if not wanted.isdisjoint(nonlinear.NAMES):
        out |= nonlinear.solve(row, np.broadcast_to(rho, ok.shape), out)
    if "zhukovskii" in wanted:
        out["zhukovskii"] = (row.zhukovskii(rho, period) & ok).astype(np.int8)


def _solve_scattered(box, shared, rho, oblate, request):
    """As `_solve`, of points on their own that a `box` holds."""
    block = Rows((*shared, rho))
    columns, rho = [block.per_row(values) for values in shared], block.per_row(rho)
    row = Motion(*columns, bool(oblate))
    # exact rules decide at k = 0 and rho = 0
    position = np.where((row.k == 0) | (rho == 0), np.nan, -2 * np.log(row.kc))

    def problem_of(points):
        return _problem(
            Motion(*(values[points] for values in columns), bool(oblate)), rho[points, None]
        )

    into = _own_outputs(block, request)
    out = monodromy.solve_scattered(
        box, position, rho, problem_of, request.rtol, _wanted(request), into
    )
    period = None
    if not _wanted(request).isdisjoint(_OF_PERIOD):
        integral = row.integrals[0]
        period = np.where(row.rotates, 2 * integral / np.maximum(row.k, 1), 4 * integral)
    return _derived(out, row, rho[:, None], block, request, period)


def _box(request, oblate):
    """Where the points of a survey lie whose rho shares an axis with k; None if there are few, or
    of both kinds.
    """
    rho = request.ranges.get("rho")
    for name in ("k", "one_minus_k", "amplitude"):
        given = request.ranges.get(name)
        if given is None or rho is None or request.method != "auto":
            continue
        number = monodromy.boxed(min(given[0], rho[0]))
        ends = _ends_of(name, number, *given[1:]) if number else None
        if ends and ends[2] > ends[1] and rho[2] > rho[1]:
            librates = bool((moduli({name: np.array(given[1:])})[0] < 1).all())
            return monodromy.Box(
                _row_axis(oblate, not librates, ends), (number, *rho[1:]), even=librates
            )
    return None


def _per_orbit(out, orbits):
    """Add the exponent per orbital revolution, `orbits` of which make a period; it does not apply
    where none do.
    """
    orbits[~(orbits > 0)] = np.nan
    growth, bar = out["exponent"] / orbits, out["exponent_error"] / orbits
    bar += np.multiply((_PERIOD_ULPS + 4) * EPS, growth, out=orbits)
    out["exponent_per_orbit"], out["exponent_per_orbit_error"] = growth, bar
    monodromy.overflow(out, bar > LARGEST)


def _line_of_rho(request):
    """The axis of rho that an axis of inertia ratios gives, if it has bodies of one kind."""
    line = request.line("inertia_ratio")
    if line is None or line[1] <= 1 <= line[2]:
        return None
    rho, _ = rates(np.array(line[1:]), request.options["direction"])
    return line[0], float(rho.min()), float(rho.max())


def _ends(request):
    """(number, least and greatest s = -log |1 - k^2| or -log(1 - 1/k^2)) of an axis of one family
    of motions.
    """
    for name in ("k", "one_minus_k", "amplitude"):
        line = request.line(name)
        if line is not None:
            return _ends_of(name, *line)
    return None


def _ends_of(name, number, low, high):
    k, kc, _, _ = moduli({name: np.array([low, high])})
    return (number, *np.sort(-2 * np.log(kc))) if (k > 1).all() or (k < 1).all() else None


def _at(s, oblate, rotates):
    """The rows at positions s of the axis: nodes of series, never solved in double-double, as k is
    not exact.
    """
    k, kc = np.sqrt(-np.expm1(-s)), np.exp(-s / 2)
    k = 1 / k if rotates else k
    return _problem(Motion(k, kc, k, np.full_like(k, motion.K), oblate), np.zeros((s.size, 0)))


def _row_axis(oblate, rotates, ends):
    key = "satellite", oblate, rotates
    # y1 - y2' of a libration is odd in k
    odd = None if rotates else lambda s: np.sqrt(-np.expm1(-s))
    return monodromy.RowAxis(key, *ends, at=lambda s: _at(s, oblate, rotates), odd=odd)


def _problem(row, rho, low=None, line=None, ends=None):
    rule, constant = _rules(row, rho, low)
    return monodromy.Problem(
        p=rho,
        p_low=low,
        sizes=lambda: _sizes(row),
        c2=1.0,
        **monodromy.of_rows(lambda: row.columns, sample, _walk_points, _solve_points),
        rule=rule,
        constant=constant,
        line=line,
        even=~row.rotates,
        row_axis=_row_axis(row.oblate, bool(row.rotates.any()), ends) if ends else None,
        positions=-2 * np.log(row.kc) if ends else None,
    )


def _of_one_row(rho):
    """rho (R, L), or (1, L) where all rows have the same."""
    return rho if rho.strides[0] else rho[:1]


def _sizes(row):
    half, half_low = row.half
    bound = np.ones((row.k.size, 3))  # (|rho| + k)^2 + 1
    bound[:, 0], bound[:, 1] = row.k**2 + 1, 2 * row.k
    return monodromy.RowSizes(half, bound, row.rate, half_low)


def _rules(row, rho, low=None):
    """What exact rules say of the points: no unstable side at k = 0, |D| = 2 at rho = 0; and z at k = 0.

    At k = 0 also |D| = 2 where 2 rho is an integer (oblate). For the prolate body 2 sqrt(1 + rho^2) = n asks for
    (2 rho)^2 = n^2 - 4, two squares of integers (a binary fraction whose square is an integer is one) that differ by
    4: only rho = 0.
    """
    at_rest, balanced = np.flatnonzero(row.k == 0), _of_one_row(rho) == 0
    if not at_rest.size and not balanced.any():
        return None, None
    rule = np.where(np.broadcast_to(balanced, rho.shape), np.int8(ON_EDGE), np.int8(NO_RULE))
    if not at_rest.size:
        return rule, None
    still = rho[at_rest]
    on_edge = (still == 0) | ((2 * still == np.rint(2 * still)) if row.oblate else False)
    on_edge &= True if low is None else low[at_rest] == 0  # of rho exactly, as no rounded one says
    rule[at_rest] = np.where(on_edge, ON_EDGE, NO_UNSTABLE_SIDE)
    return rule, (at_rest, still * still + (0.0 if row.oblate else 1.0))


@kernel
def _walk_points(rows, rho, tolerance, out, reached):
    """Points of their own, by DOP853."""
    table = np.empty((2, MEANS + 1))
    for i in range(len(rho)):
        tabulate(rows[i], table)
        reached[i] = dop853.hill_walk(
            potential, rho[i], rows[i], table, rows[i, motion.HALF], tolerance[i], out[i]
        )


@kernel
def _solve_points(rows, rho, low, steps, out):
    """Points of their own, in double-double, in `steps` (even) steps each."""
    work = taylor_double.workspace(motion.CLOCK)
    chain = np.empty((steps.max(), taylor_double.STEP))
    row = np.empty(motion.EXACTLY)
    for i in range(len(rho)):
        motion.exactly(rows[i], row)
        before = steps[i] if rows[i, motion.MODULUS] > 1.0 else steps[i] // 2
        taylor_double.hill_walk(
            motion.slowest, motion.pendulum, motion.coefficient, motion.missed, row, (rho[i], low[i]),
            motion.half_period(row), before, steps[i] - before, work, chain, out[i],
        )  # fmt: skip
