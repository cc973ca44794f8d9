"""Hill's question: is y'' + z(t) y = 0, z even and of period T, stable? Half-period factors, verdict, Floquet data.

With y1, y2 the solutions with y1(0) = y2'(0) = 1, y1'(0) = y2(0) = 0, and everything at T/2 (notes, section 5):

    discriminant D = trace of the monodromy;  D - 2 = 4 y1' y2,  D + 2 = 4 y1 y2'
    unstable  <=>  y1' y2 > 0  or  y1 y2' < 0          (signs of four numbers: nothing cancels)
    sinh^2(exponent / 2) = y1' y2 or -y1 y2';  sin^2(theta / 2) = -y1' y2,  cos^2(theta / 2) = y1 y2'

det M = 1 is no check: it fails by 1e3 where |D| is 1e19. A verdict is given only where the bars leave no other.
Source: W. Magnus, S. Winkler, Hill's Equation (1966), 1.3 and 2.1; symmetric z: theorem 1.1 there.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from survey import methods, modules, status
from survey.measures import hill_auto, hill_effort
from survey.scene import Output

UNDECIDED, UNSTABLE, STABLE, MARGINAL = -1, 0, 1, 2
VERDICTS = {"undecided": UNDECIDED, "unstable": UNSTABLE, "stable": STABLE, "marginal": MARGINAL}
FLOATS = ("discriminant", "y1", "y2", "dy1", "dy2", "exponent", "rotation_number")
OUTPUTS = (
    Output("discriminant", "trace of the monodromy matrix over one period T", "D"),
    Output("y1", "y1(T/2), where y1(0) = 1, y1'(0) = 0", "y_1(T/2)"),
    Output("y2", "y2(T/2), where y2(0) = 0, y2'(0) = 1", "y_2(T/2)"),
    Output("dy1", "derivative of y1 at T/2", "y_1'(T/2)"),
    Output("dy2", "derivative of y2 at T/2", "y_2'(T/2)"),
    Output("exponent", "growth exponent of the amplitude per period", r"\mu T"),
    Output("rotation_number", "rotation number per period", r"\theta / 2\pi"),
    Output("period", "period of the coefficient", "T"),
    Output("verdict", "stability of the linear motion", flags=VERDICTS),
)
EPS = 2.3e-16
LARGEST = np.finfo(np.float32).max  # bars are kept as float32


@dataclass(frozen=True)
class Problem:
    """R rows of L points: y'' + (c0(t) + p c1(t) + p^2 c2) y = 0 on half a period, p varying along the row.

    `sample(rows, nodes, steps)` gives c0, c1 of the rows at `nodes` (fractions) of each step as an array
    (rows, steps, 2, nodes); `walk(rows, points, tolerance)`, for adaptive methods, gives the results of a chain for
    points p[rows[i], points[i]]. `frequency` bounds sqrt(|z|); `rate` is 1 / distance to z's nearest singularity.
    Points that are `closed` have no unstable side, those `marginal` have |D| = 2, both by exact rules. `constant` is
    z where it does not depend on t, NaN elsewhere.
    """

    p: np.ndarray
    span: np.ndarray
    frequency: np.ndarray
    rate: np.ndarray
    c2: float
    sample: Callable
    closed: np.ndarray
    marginal: np.ndarray
    constant: np.ndarray
    walk: Callable | None = None


def solve(problem, method, rtol, wanted=()):
    """All outputs (R, L) with `_error` each, `verdict`, `status`; effort grows until `rtol` is met or useless.

    `method` is the name of a method, or "auto" (see `hill_auto`).
    """
    wanted = [name for name in FLOATS if name in wanted or not wanted]

    def judge(points, results):
        """All outputs of these points, and which of the points miss what was asked."""
        out = measure(results, problem.closed[points], problem.marginal[points])
        late = out["verdict"] == UNDECIDED
        for name in wanted:
            late |= ~(out[f"{name}_error"] <= rtol * (1 + abs(out[name])))
        return out, late

    if method == "auto":
        out, code = hill_auto.solve(problem, rtol, judge)
    else:
        out, code = hill_effort.solve(problem, modules.load(methods, method, "method"), rtol, judge)
    out["status"] = code.astype(np.int8)
    overflow(out, ~np.all([np.isfinite(out[name]) & (out[f"{name}_error"] < LARGEST) for name in FLOATS], axis=0))
    return out


def overflow(out, where):
    """Take back the answers of the points that have a value or bar beyond the range of floats; changes `out`."""
    out["status"] = np.where((out["status"] == status.OK) & where, status.OVERFLOW, out["status"]).astype(np.int8)
    failed = out["status"] != status.OK
    for name, values in out.items():
        if values.dtype.kind == "f":
            out[name] = np.where(failed, np.nan, values)
    out["verdict"] = np.where(failed, UNDECIDED, out["verdict"]).astype(np.int8)


def measure(results, closed, marginal):
    """Everything from the results of a chain (..., 10): y1, y1', y2, y2', their bars, and the zeros of y1, y2."""
    y1, dy1, y2, dy2, e1, de1, e2, de2, m, d = np.moveaxis(results, -1, 0)
    with np.errstate(all="ignore"):
        sine, sine_error = _product(-dy1, y2, de1, e2)
        cosine, cosine_error = _product(y1, dy2, e1, de2)
        verdict = _verdict(sine, sine_error, cosine, cosine_error, closed, marginal)
        discriminant, discriminant_error = _discriminant(sine, sine_error, cosine, cosine_error)
        exponent = _exponent(sine, sine_error, cosine, cosine_error, verdict)
        rotation = _rotation(sine, sine_error, cosine, cosine_error, verdict, m + d)
    return {
        "discriminant": discriminant, "discriminant_error": discriminant_error,
        "y1": y1, "y1_error": e1, "y2": y2, "y2_error": e2,
        "dy1": dy1, "dy1_error": de1, "dy2": dy2, "dy2_error": de2,
        "exponent": exponent[0], "exponent_error": exponent[1],
        "rotation_number": rotation[0], "rotation_number_error": rotation[1],
        "verdict": verdict,
    }  # fmt: skip


def _product(a, b, ea, eb):
    """a b and its error bound, the rounding of the product included."""
    return a * b, ea * abs(b) + eb * abs(a) + ea * eb + EPS * abs(a * b)


def _discriminant(sine, sine_error, cosine, cosine_error):
    """D from 2 - 4 sin^2 or 4 cos^2 - 2, whichever has the smaller bar."""
    by_sine = sine_error <= cosine_error
    value = np.where(by_sine, 2 - 4 * sine, 4 * cosine - 2)
    return value, 4 * np.minimum(sine_error, cosine_error) + 2 * EPS * (2 + abs(value))


def _verdict(sine, sine_error, cosine, cosine_error, closed, marginal):
    """Certain only when the bars exclude the other answer."""
    unstable = (sine < -sine_error) | (cosine < -cosine_error)
    stable = (sine > sine_error) & (cosine > cosine_error)
    verdict = np.where(unstable, UNSTABLE, np.where(stable | closed, STABLE, UNDECIDED))
    return np.where(marginal, MARGINAL, verdict).astype(np.int8)


def _exponent(sine, sine_error, cosine, cosine_error, verdict):
    """2 asinh sqrt(g), g = -sin^2 or -cos^2 of half the angle, and how far the bar of g can move it."""
    value, error = np.zeros_like(sine), np.zeros_like(sine)
    grows = (verdict == UNSTABLE) | (verdict == UNDECIDED)
    sine, sine_error, cosine, cosine_error = (a[grows] for a in (sine, sine_error, cosine, cosine_error))
    by_sine = sine < cosine
    growth = -np.where(by_sine, sine, cosine)
    bar = np.where(by_sine, sine_error, cosine_error)
    middle = _asinh(growth)
    value[grows] = middle
    error[grows] = np.maximum(_asinh(growth + bar) - middle, middle - _asinh(growth - bar)) + 8 * EPS * middle
    return value, error


def _asinh(growth):
    return 2 * np.arcsinh(np.sqrt(np.maximum(growth, 0.0)))


def _rotation(sine, sine_error, cosine, cosine_error, verdict, zeros):
    """theta_total / (2 pi): `zeros` of y1, y2 in (0, T/2) give the band (notes, section 5); n / 2 exactly in gaps."""
    odd = zeros % 2 == 1
    gap = (sine < 0) | (cosine < 0)
    negative = cosine < sine
    half = np.arctan2(np.sqrt(np.maximum(sine, 0)), np.sqrt(np.maximum(cosine, 0))) / np.pi
    inside = 0.5 * (zeros + np.where(odd, 1 - 2 * half, 2 * half))
    value = np.where(gap, 0.5 * (zeros + (odd != negative)), inside)
    error = np.maximum(_angle(sine, sine_error, cosine, cosine_error), 4 * EPS * (1 + value))
    certain_gap = (verdict == UNSTABLE) | (verdict == MARGINAL)
    return np.where(verdict == MARGINAL, 0.5 * np.rint(2 * value), value), np.where(certain_gap, 0.0, error)


def _angle(sine, sine_error, cosine, cosine_error):
    """How far the bars can move theta / (2 pi): arctan2 of both is no worse than either of them."""
    return np.maximum(_spread(sine, sine_error), _spread(cosine, cosine_error)) / np.pi


def _spread(square, bar):
    """How far arcsin sqrt(square) moves within the bar: by its steepest slope there, at most by arcsin sqrt(bar)."""
    slope = 2 * np.sqrt(np.maximum(square - bar, 0) * np.maximum(1 - square - bar, 0))
    return np.fmin(bar / slope, 0.5 * np.pi * np.sqrt(np.minimum(bar, 1)))  # 0 / 0: no bar, no spread
