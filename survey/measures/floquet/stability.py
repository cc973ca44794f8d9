"""Floquet's question: is x' = A(t) x stable? Multipliers, spectral radius, verdict, and how
stability is lost.

stable      asymptotically: every multiplier is certainly inside the unit circle; for symplectic and reversible systems
            strongly: they are on the circle, and simple or, where they meet, of one Krein sign, and
            stay there when the system is changed a little within its kind
unstable    one is certainly outside
marginal    in systems without a stated structure: no solution grows, and some do not decay (see `marginal`)
undecided   the error bounds allow either
"""

import numpy as np

from survey import status, waiting
from survey.kernels.floquet import characteristic, leverrier
from survey.kernels.math.roundoff import EPS
from survey.measures import answers
from survey.measures.floquet import dense, marginal, maslov, monodromy, multipliers
from survey.measures.floquet.answers import Answers
from survey.measures.floquet.existence import deflated
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
    Output("crossing", "where multipliers would first leave, or have first left, the unit circle", flags=CROSSINGS),
    Output("verdict", "stability of the linear motion", flags=VERDICTS),
    *maslov.OUTPUTS,
)  # fmt: skip
# outputs of symplectic systems alone
SYMPLECTIC = frozenset(["krein", *(o.name for o in maslov.OUTPUTS)])
# Factors of the number of steps; from the second on, errors are carried sharply.
LADDER = answers.Ladder(1.5 ** np.arange(16), np.arange(16) + 1, None, most=16)
FEW = 6  # states at most whose characteristic polynomial is looked at first
CHUNK = 65536  # points n^2 that are solved together: bounds the memory


def assess(matrices, structure, rtol, asked, period=None, growth=None):
    """The Answers of points from their Matrices; `asked` holds the names of the outputs that are
    wanted.

    `period` (N) is needed for the accuracy of the exponent; `growth` (2, N), if given, is that of
    `monodromy.SystemPoints`.
    """
    n = matrices.M.shape[1]
    few = 2 <= n <= FEW and (structure == "none" or n % 2 == 0)
    unknown = not np.isfinite(matrices.bound).any()
    if not few or unknown or asked == {"monodromy"} or matrices.sharp.any():
        return by_discs(matrices, structure, rtol, asked, period, growth)
    found = by_coefficients(matrices, structure, rtol, asked, period, growth)
    left = np.flatnonzero(found.missed)
    if left.size:
        growth = growth if growth is None else growth[:, left]
        period = period if period is None else period[left]
        found.replace(left, by_discs(matrices[left], structure, rtol, asked, period, growth))
    return found


def by_coefficients(matrices, structure, rtol, asked, period=None, growth=None):
    """As `assess`, by characteristic polynomials."""
    M, E = (np.ascontiguousarray(values) for values in (matrices.M, matrices.E))
    N, n = M.shape[:2]
    found, paired = Answers(N, n), structure != "none"
    change = dense.sums_of_powers(n // 2)
    forms = dense.sums_of_powers(n // 2 - 1) if structure == "symplectic" else np.zeros((0, 0))
    det = np.zeros((2, 0))
    # Liouville: beside huge multipliers this tells more of small ones than M
    if growth is not None:
        with np.errstate(over="ignore", invalid="ignore"):
            det = np.exp(growth[0]) * np.stack([np.ones(N), np.expm1(growth[1]) + 8 * EPS])
    found.floats[:] = np.nan
    waiting.wait("matrices")
    d = n // 2 if paired else n
    blocks = -(-N // characteristic.LANES)
    c, bars, z, y, places = characteristic.blocks(blocks, 2 * d if len(forms) else d, d)
    leverrier.fill_matrices(M, E, det, change, forms, paired, c, bars, places)
    characteristic.answer(
        c, bars, z, y, places, False, n, paired, np.array(dense.flags(asked)), rtol, found.floats, found.signs,
        found.verdict, found.crossing, found.missed,
    )  # fmt: skip
    _note_missed(found, matrices, rtol, asked, period)
    return found


def _note_missed(found, matrices, rtol, asked, period):
    """Note which points miss the accuracy of M, or of the exponent, where these are asked."""
    if "monodromy" in asked:
        found.missed |= _rough(matrices, rtol)
    if period is not None and "exponent" in asked:
        found.missed |= wide_exponents(found, period, rtol)


def _rough(matrices, rtol):
    with np.errstate(invalid="ignore"):
        return ~(matrices.E <= rtol * (1 + abs(matrices.M))).all(axis=(1, 2))


def by_discs(matrices, structure, rtol, asked, period=None, growth=None):
    """As `assess`, by discs that hold the multipliers."""
    M, E = matrices.M, matrices.E
    N, n = M.shape[:2]
    found, paired = Answers(N, n), structure != "none"
    if asked == {"monodromy"}:  # as for boundaries: nothing of multipliers is computed
        found.floats[:] = np.nan
        known = np.isfinite(M).all(axis=(1, 2)) & np.isfinite(E).all(axis=(1, 2))
        found.missed, found.status[:] = (
            _rough(matrices, rtol),
            np.where(known, status.OK, status.OVERFLOW),
        )
        return found
    discs = multipliers.Discs(matrices)
    found.verdict = multipliers.verdicts(discs, M, E, paired)
    signs = multipliers.krein(discs) if structure == "symplectic" else None
    if signs is not None:
        together = multipliers.clusters(discs, np.flatnonzero(found.verdict == UNDECIDED))
        found.verdict[(together.any(axis=1)) & (discs.on_circle | (together != 0)).all(axis=1)] = (
            STABLE
        )
        signs = np.where(together != 0, together, signs).astype(np.int8)
    found.crossing = multipliers.crossing(discs, found.verdict, paired, signs)
    centre, bars = multipliers.symmetric(discs) if paired else (discs.centre, discs.bars)
    if not paired and growth is not None:
        centre, bars = multipliers.by_determinant(discs, centre, bars, growth)
    value, bar = multipliers.radius(discs)
    if paired:  # all multipliers are on the circle, exactly
        strong = found.verdict == STABLE
        value, bar = np.where(strong, 1.0, value), np.where(strong, 0.0, bar)
    real = discs.isolated & (centre.imag == 0)  # its conjugate would be in the same disc
    # again: `symmetric` and `by_determinant` know small ones better
    order = multipliers.order(centre, bars)
    centre, bars, real = (np.take_along_axis(of, order, axis=1) for of in (centre, bars, real))
    if signs is not None:
        found.signs[:] = np.take_along_axis(signs, order, axis=1).T
    for k, part in enumerate((centre.real, centre.imag, bars, np.where(real, 0.0, bars))):
        found.floats[k * n : (k + 1) * n] = part.T
    found.floats[4 * n], found.floats[4 * n + 1] = value, bar
    lost = ~np.isfinite(found.floats).all(axis=0)
    with np.errstate(invalid="ignore"):
        least = np.where(real, abs(centre.real), np.minimum(abs(centre.real), abs(centre.imag)))
        wide = ~(bars <= rtol * (1 + least)).all(axis=1)
        far = ~(bar <= rtol * (1 + value))
    found.missed = lost | ((found.verdict == UNDECIDED) & ("verdict" in asked))
    found.missed |= (wide & ("multiplier_re" in asked)) | (far & ("spectral_radius" in asked))
    _note_missed(found, matrices, rtol, asked, period)
    found.status[:] = np.where(lost, status.OVERFLOW, status.OK)
    found.verdict[lost], found.crossing[lost] = UNDECIDED, UNDECIDED
    return found


def exponents(answer, period):
    """The largest characteristic exponents (N) and their error bounds, NaN where the radius may be 0."""
    value, bar = answer.floats[-2], answer.floats[-1]
    with np.errstate(all="ignore"):
        positive = value > bar
        found = np.where(positive, np.log(value) / period, np.nan)
        off = np.where(positive, -np.log1p(-bar / value) / period, np.nan) * (1 + 4 * EPS)
        return found, off + 4 * EPS * abs(found)


def wide_exponents(answer, period, rtol):
    """Where (N) the exponent, if there is one, is not known to the requested accuracy."""
    found, off = exponents(answer, period)
    with np.errstate(invalid="ignore"):
        return off > rtol * (1 + abs(found))


def solve(system, structure, points, method, rtol, wanted, lines=None, ranges=None):
    """The wanted outputs of the points (..., parameters), each with `_error` if it is a float, and
    `status`.

    `lines`: of parameters that have an axis of a map of their own, {number of the parameter:
    (points of the axis, least, greatest)}; `ranges`: where no parameter has one, of those that vary
    from point to point.
    """
    n, shape = system.n, points.shape[:-1]
    flat = points.reshape(-1, points.shape[-1])
    counted, wanted = (
        [o.name for o in maslov.OUTPUTS if o.name in wanted],
        wanted - {o.name for o in maslov.OUTPUTS},
    )
    answer = Answers(len(flat), system.judged)
    left = np.arange(len(flat))
    results = monodromy.Matrices.empty(len(flat) if "monodromy" in wanted else 0, n)
    period = system.periods(flat) if wanted & {"period", "exponent"} else None
    if method == "auto" and dense.serves(system, structure, wanted, lines or {}):
        open_ = dense.solve(system, structure, points, rtol, wanted, lines, answer)
        if "exponent" in wanted:
            open_ |= wide_exponents(answer, period, rtol)
        left = np.flatnonzero(open_)
    elif method == "auto" and dense.serves_scattered(system, structure, wanted, ranges or {}):
        open_ = dense.scattered(system, structure, flat, rtol, wanted, ranges, answer)
        if "exponent" in wanted:
            open_ |= wide_exponents(answer, period, rtol)
        left = np.flatnonzero(open_)
    method, chunk = monodromy.method_of(method), max(1, CHUNK // (n * n))
    for i in range(0, left.size, chunk):
        some = left[i : i + chunk]
        _solve_some(system, structure, flat[some], method, rtol, wanted, some, answer, results)
    out = outputs(answer, results, period, callable(system.period), wanted)
    if counted:
        parts = [
            maslov.indices(system, flat[i : i + chunk]) for i in range(0, max(len(flat), 1), chunk)
        ]
        indices = zip((o.name for o in maslov.OUTPUTS), np.concatenate(parts, axis=1), strict=True)
        ok = answer.status == status.OK
        out |= {
            name: np.where(ok, values, maslov.UNKNOWN)
            for name, values in indices
            if name in counted
        }
    return {name: values.reshape(*shape, *values.shape[1:]) for name, values in out.items()}


def judged(system, points, matrices):
    """The Matrices of the multipliers that are judged: all, or those without the 1 of what is conserved."""
    if system.conserved is None:
        return matrices
    w = system.weights(points)
    # w is an eigenvector of the transposed matrix
    M, E = deflated(
        np.swapaxes(matrices.M, 1, 2), np.swapaxes(matrices.E, 1, 2), w, np.zeros_like(w)
    )
    return monodromy.Matrices.plain(*(np.ascontiguousarray(np.swapaxes(X, 1, 2)) for X in (M, E)))


def _solve_some(system, structure, given, method, rtol, wanted, rows, answer, results):
    """Answer points (N, parameters), each from its own monodromy matrix, at their `rows`."""
    # another method is asked to answer a second way: without what symmetries tell
    paired = structure != "none"
    points = monodromy.SystemPoints(
        system, given, halves=method is monodromy.method_of("auto"), paired=paired
    )
    where = np.flatnonzero(points.valid)
    asked = wanted | ({"multiplier_re"} if wanted & {"multiplier_im", "krein"} else set())
    asked |= {"spectral_radius"} if "exponent" in wanted else set()
    asked |= {"verdict"} if wanted & {"crossing", "verdict"} else set()
    # multipliers are known less well than M
    fine = rtol if asked <= {"verdict", "crossing"} else 0.1 * rtol

    def solved(those, rung):
        sharp = bool(rung.size and rung.min() > 0)  # all are on the first rung, or none is
        return monodromy.solve(points, method, fine, LADDER.rungs[rung], where[those], sharp)

    def assessed(those, found):
        own = where[those]
        broken = structure == "symplectic" and multipliers.not_symplectic(found.M, found.E)
        if system.conserved is not None:
            broken = broken | multipliers.not_conserved(
                system.weights(given[own]), found.M, found.E
            )
        found = judged(system, given[own], found)
        out = assess(found, structure, rtol, asked, points.period[own], points.growth[:, own])
        if structure == "none" and system.conserved is None and "verdict" in asked:
            _by_what_is_exact(points, own, found, rtol, asked, out)
        if np.any(broken):  # what is said of A is not true here: nothing follows from it
            out.status[broken], out.missed[broken] = status.INVALID_PARAMETERS, False
            out.verdict[broken] = UNDECIDED
            out.crossing[broken] = UNDECIDED
            out.signs[:, broken] = 0
        return out

    if where.size:
        rung = np.zeros(where.size, dtype=np.int64)
        own = solved(np.arange(where.size), rung)
        best = assessed(slice(None), own)
        LADDER.climb(rung, own, best, solved, assessed)
        answer.replace(rows[where], best)
        if len(results.M):
            results[rows[where]] = own
    lost = ~points.valid
    answer.status[rows[lost]] = np.where(
        points.rough[lost], status.NO_CONVERGENCE, status.INVALID_PARAMETERS
    )
    for name in ("verdict", "crossing"):
        getattr(answer, name)[rows[lost]] = UNDECIDED
    answer.signs[:, rows[lost]] = 0


def _by_what_is_exact(points, those, matrices, rtol, asked, answer):
    """Decide undecided points `those`, of which `answer` is the Answers, by what is exact in A."""
    open_ = np.flatnonzero((answer.verdict == UNDECIDED) & (answer.status == status.OK))
    if not open_.size:
        return

    def judge(matrices, structure):
        return assess(matrices, structure, rtol, {"verdict"}).verdict

    found = marginal.verdicts(points, those[open_], matrices[open_], judge)
    known = found != UNDECIDED
    own = open_[known]
    if not own.size:
        return
    answer.verdict[own] = found[known]
    bounded = own[found[known] == MARGINAL]
    answer.floats[-2, bounded], answer.floats[-1, bounded] = 1.0, 0.0
    # what of the accuracy asked for is missed besides
    rest = asked - {"verdict", "spectral_radius", "exponent"}
    answer.missed[bounded] = assess(matrices[bounded], "none", rtol, rest).missed if rest else False


def outputs(answer, results, period, computed, wanted):
    """The wanted outputs from the Answers and the Matrices; `period` (N), `computed` from
    parameters or not.
    """
    n = answer.n
    ok = answer.status == status.OK
    answer.floats[:, ~ok] = np.nan
    re, im, bar_re, bar_im = (answer.floats[k * n : (k + 1) * n].T for k in range(4))
    value, bar = answer.floats[4 * n], answer.floats[4 * n + 1]
    out = {
        "multiplier_re": re, "multiplier_re_error": bar_re, "multiplier_im": im, "multiplier_im_error": bar_im,
        "spectral_radius": value, "spectral_radius_error": bar, "crossing": answer.crossing, "verdict": answer.verdict,
    }  # fmt: skip
    if "krein" in wanted:
        out["krein"] = np.where(ok, answer.signs, 0).T.astype(np.int8)
    if "exponent" in wanted:
        out["exponent"], out["exponent_error"] = exponents(answer, period)
    if "period" in wanted:
        period = np.where(ok, period, np.nan)
        out |= {"period": period, "period_error": (4 if computed else 1) * EPS * period}
    if "monodromy" in wanted:
        M, E = (np.where(ok[:, None, None], matrix, np.nan) for matrix in (results.M, results.E))
        out |= {"monodromy": M, "monodromy_error": E}
    kept = {name: values for name, values in out.items() if name.removesuffix("_error") in wanted}
    return kept | {"status": answer.status}
