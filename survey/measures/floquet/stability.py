"""Floquet's question: is x' = A(t) x stable? Multipliers, spectral radius, verdict, and how stability is lost.

stable      asymptotically: every multiplier is certainly inside the unit circle; for symplectic and reversible systems
            strongly: they are simple and on the circle, and stay there when the system is changed a little within
            its kind
unstable    one is certainly outside
undecided   the error bounds allow either
"""

import numpy as np

from survey import status
from survey.kernels.math.roundoff import EPS
from survey.measures import answers
from survey.measures.floquet import monodromy, multipliers
from survey.measures.floquet.multipliers import (
    COLLISION,
    MARGINAL,
    MINUS_ONE,
    NEIMARK_SACKER,
    NONE,
    PLUS_ONE,
    STABLE,
    UNDECIDED,
    UNSTABLE,
)
from survey.scene import Output

VERDICTS = {"undecided": UNDECIDED, "unstable": UNSTABLE, "stable": STABLE, "marginal": MARGINAL}
CROSSINGS = {
    "undecided": UNDECIDED, "none": NONE, "plus_one": PLUS_ONE, "minus_one": MINUS_ONE,
    "neimark_sacker": NEIMARK_SACKER, "collision": COLLISION,
}  # fmt: skip
SIGNS = {"negative": -1, "none": 0, "positive": 1}
STRUCTURES = ("none", "symplectic", "reversible")
OUTPUTS = (
    Output("multiplier_re", "real part of the Floquet multiplier, by descending modulus, then angle", r"\Re\lambda",
           dims=("multiplier",)),
    Output("multiplier_im", "imaginary part of the Floquet multiplier", r"\Im\lambda", dims=("multiplier",)),
    Output("spectral_radius", "largest modulus of the multipliers", r"\rho"),
    Output("exponent", "largest real part of the characteristic exponents", r"\mu",
           applies="where the spectral radius is certainly positive"),
    Output("monodromy", "monodromy matrix: the states after one period, from the columns of the identity", "M",
           dims=("row", "column"), on_request=True),
    Output("period", "period of the coefficients", "T"),
    Output("krein", "Krein sign of a multiplier on the unit circle: that of i v* J v, v its eigenvector", flags=SIGNS,
           dims=("multiplier",)),
    Output("crossing", "where multipliers leave, or have left, the unit circle first", flags=CROSSINGS),
    Output("verdict", "stability of the linear motion", flags=VERDICTS),
)  # fmt: skip
# Factors of the number of steps; from the second on, errors are carried sharply.
LADDER = answers.Ladder(1.5 ** np.arange(16), np.arange(16) + 1, None, most=16)
CHUNK = 65536  # points n^2 that are solved together: bounds the memory


class Answers(answers.Answers):
    """`floats`: re, im, bars of n multipliers, the spectral radius and its bar; `codes`; the Krein `signs` (n, N)."""

    def __init__(self, size, n):
        super().__init__(size, 3 * n + 2, ("verdict", "crossing"))
        self.n, self.signs = n, np.zeros((n, size), np.int8)

    def replace(self, points, other, those=slice(None)):
        """See `measures.answers`."""
        super().replace(points, other, those)
        self.signs[:, points] = other.signs[:, those]


def assess(matrices, structure, rtol, asked):
    """The Answers of points from their Matrices; `asked` holds the names of the outputs that are wanted."""
    M, E = matrices.M, matrices.E
    N, n = M.shape[:2]
    found, paired = Answers(N, n), structure != "none"
    discs = multipliers.Discs(matrices)
    found.verdict = multipliers.verdicts(discs, M, E, paired)
    signs = multipliers.krein(discs) if structure == "symplectic" else None
    found.crossing = multipliers.crossing(discs, found.verdict, paired, signs)
    if signs is not None:
        found.signs[:] = signs.T
    centre, bars = multipliers.symmetric(discs) if paired else (discs.centre, discs.bars)
    value, bar = multipliers.radius(discs)
    if paired:  # all multipliers are on the circle, exactly
        strong = found.verdict == STABLE
        value, bar = np.where(strong, 1.0, value), np.where(strong, 0.0, bar)
    found.floats[:n], found.floats[n : 2 * n], found.floats[2 * n : 3 * n] = centre.real.T, centre.imag.T, bars.T
    found.floats[3 * n], found.floats[3 * n + 1] = value, bar
    lost = ~np.isfinite(found.floats).all(axis=0)
    with np.errstate(invalid="ignore"):
        wide = ~(bars <= rtol * (1 + abs(centre))).all(axis=1)
        far = ~(bar <= rtol * (1 + value))
        rough = ~(E <= rtol * (1 + abs(M))).all(axis=(1, 2))
    found.missed = lost | ((found.verdict == UNDECIDED) & ("verdict" in asked))
    found.missed |= (wide & ("multiplier_re" in asked)) | (far & ("spectral_radius" in asked))
    found.missed |= rough & ("monodromy" in asked)
    found.status[:] = np.where(lost, status.OVERFLOW, status.OK)
    found.verdict[lost], found.crossing[lost] = UNDECIDED, UNDECIDED
    return found


def solve(system, structure, points, method, rtol, wanted):
    """The wanted outputs of the points (N, parameters), each with `_error` if it is a float, and `status`."""
    n = system.n
    method = monodromy.method_of(method)
    chunk = max(1, CHUNK // (n * n))
    parts = [
        _chunk(system, structure, points[i : i + chunk], method, rtol, wanted) for i in range(0, len(points), chunk)
    ]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def _chunk(system, structure, given, method, rtol, wanted):
    n = system.n
    points = monodromy.Points(system, given)
    answer, results = Answers(len(given), n), monodromy.Matrices.empty(len(given), n)
    where = np.flatnonzero(points.valid)
    asked = wanted | ({"multiplier_re"} if wanted & {"multiplier_im", "krein"} else set())
    asked |= {"spectral_radius"} if "exponent" in wanted else set()
    asked |= {"verdict"} if wanted & {"crossing", "verdict"} else set()

    def solved(those, rung):
        sharp = bool(rung.size and rung.min() > 0)  # all are on the first rung, or none is
        return monodromy.solve(points, method, rtol, LADDER.rungs[rung], where[those], sharp)

    def assessed(_those, found):
        return assess(found, structure, rtol, asked)

    if where.size:
        rung = np.zeros(where.size, dtype=np.int64)
        own = solved(np.arange(where.size), rung)
        best = assessed(None, own)
        LADDER.climb(rung, own, best, solved, assessed)
        answer.replace(where, best)
        results[where] = own
    answer.status[~points.valid] = np.where(
        points.rough[~points.valid], status.NO_CONVERGENCE, status.INVALID_PARAMETERS
    )
    return outputs(answer, results, points.period, callable(system.period), wanted)


def outputs(answer, results, period, computed, wanted):
    """The wanted outputs from the Answers and the Matrices."""
    n = answer.n
    ok = answer.status == status.OK
    answer.floats[:, ~ok] = np.nan
    re, im, bars = (answer.floats[k * n : (k + 1) * n].T for k in range(3))
    value, bar = answer.floats[3 * n], answer.floats[3 * n + 1]
    with np.errstate(all="ignore"):
        positive = value > bar
        exponent = np.where(positive, np.log(value) / period, np.nan)
        exponent_bar = np.where(positive, -np.log1p(-bar / value) / period, np.nan) * (1 + 4 * EPS)
        exponent_bar += 4 * EPS * abs(exponent)
    M, E = (np.where(ok[:, None, None], matrix, np.nan) for matrix in (results.M, results.E))
    period = np.where(ok, period, np.nan)
    out = {
        "multiplier_re": re, "multiplier_re_error": bars, "multiplier_im": im, "multiplier_im_error": bars,
        "spectral_radius": value, "spectral_radius_error": bar, "exponent": exponent, "exponent_error": exponent_bar,
        "monodromy": M, "monodromy_error": E,
        "period": period, "period_error": (4 if computed else 1) * EPS * period,
        "krein": np.where(ok, answer.signs, 0).T.astype(np.int8), "crossing": answer.crossing,
        "verdict": answer.verdict,
    }  # fmt: skip
    kept = {name: values for name, values in out.items() if name.removesuffix("_error") in wanted}
    return kept | {"status": answer.status}
