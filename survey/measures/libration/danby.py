"""Danby's question: are the triangular points of the elliptic problem stable? Trace invariants,
verdict, collision.

The monodromy's characteristic polynomial is l^4 - a l^3 + b l^2 - a l + 1. By the reversibility
half a period gives all (`traces`; `scenes/libration_elliptic.md`): stable <=> A B > 0, C D > 0, K >
0 and 0 < t < 2, decided by the error bounds of these; A B = 0 means multipliers -1, K = 0 two pairs
that meet.

Its factors are Chebyshev series in s = sqrt(1 - 3 mu (1 - mu)) and artanh e (`panels`): rows (one e,
many mu) are series in s made of these. e = 0 and mu = 0 have closed forms. What they leave open, or
not as accurate as asked, is solved in double-double. Other methods solve the canonical equations as
a member of the family "floquet", over half a period, by a ladder of steps.
"""

from math import cos, pi, sqrt

import numpy as np

from survey import status
from survey.kernels.libration import traces
from survey.kernels.libration.traces import (
    INVARIANTS,
    KREIN,
    MINUS_ONE,
    NODES,
    NONE,
    RESULTS,
    STABLE,
    UNDECIDED,
    UNSTABLE,
)
from survey.kernels.math.roundoff import EPS
from survey.measures.answers import Ladder
from survey.measures.floquet import monodromy
from survey.measures.floquet.system import System
from survey.measures.libration import danby_double, panels
from survey.measures.libration.answers import Answers
from survey.scene import Output

VERDICTS = {"undecided": UNDECIDED, "unstable": UNSTABLE, "stable": STABLE}
COLLISIONS = {"undecided": UNDECIDED, "none": NONE, "minus_one": MINUS_ONE, "krein": KREIN}
OUTPUTS = (
    Output("a", "trace of the monodromy matrix over one period, the sum of its multipliers", "a"),
    Output("b", "sum of the products of two multipliers", "b"),
    Output("verdict", "stability of the linear motion", flags=VERDICTS),
    Output("collision", "how stability is lost, or would be lost first: multipliers meet at -1, or two pairs meet",
           flags=COLLISIONS),
)  # fmt: skip
# Factors of the numbers of steps that other methods ask for at first, of which there are at most FIRST.
LADDER = Ladder(2.0 ** np.arange(7), np.arange(7) + 1, slice(INVARIANTS, RESULTS), most=6)
FIRST = 5000
DENSE = 3 * NODES  # the least number of points in a row for which a series of its own pays
CHUNK = 4096  # points that are solved together: bounds the memory


def solve(e, mu, method="auto", rtol=1e-10, dense=False):
    """The outputs for rows e (R) of points mu (R, L), all (R, L): a, b, their bounds, verdict,
    collision, status.

    `dense`: the rows are long enough for series of their own (see DENSE), wherever they are cut.
    """
    answers = Answers(mu.size)
    valid = np.isfinite(e)[:, None] & np.isfinite(mu)
    left = valid & ((e > 0)[:, None] & (mu > 0) | (method != "auto"))
    closed = valid & ~left
    if closed.any():
        answers.replace(np.flatnonzero(closed), closed_form(mu[closed], rtol))
    if method == "auto" and dense:
        _by_series(e, mu, rtol, answers, left)
    elif left.any():
        points = np.flatnonzero(left)
        own, at = Answers(points.size), (e[points // mu.shape[1]], mu[left])
        if method == "auto":
            _by_panels(*at, rtol, own)
        else:
            _by_steps(*at, method, rtol, own)
        answers.replace(points, own)
    if method == "auto":
        points = np.flatnonzero((valid & (mu > 0)).reshape(-1) & answers.unsettled)
        if points.size:
            danby_double.solve(e, mu, rtol, answers, points, dense)
    if not valid.all():
        answers.status[~valid.reshape(-1)] = status.INVALID_PARAMETERS
    if answers.status.any():  # not all are OK
        answers.floats[:, answers.status != status.OK] = np.nan
    names = ("a", "a_error", "b", "b_error")
    out = dict(zip(names, answers.floats.reshape(4, *mu.shape), strict=True))
    return out | {
        name: getattr(answers, name).reshape(mu.shape)
        for name in ("verdict", "collision", "status")
    }


def canonical(v, p, out):
    """The equations (3) of `scenes/libration_elliptic.md` in the angle v, tan(f/2) = tan(v/2) / k, k^4 =
    (1 - e) / (1 + e): half-way to the eccentric anomaly, where steps can be longest. p = (mu, e).
    """
    mu, e = p
    square = sqrt((1.0 - e) / (1.0 + e))  # k^2
    cosine, sine = 0.5 + 0.5 * cos(v), 0.5 - 0.5 * cos(v)  # squares, of v / 2
    turn = sqrt(square) / (square * cosine + sine)  # df / dv
    pull = sqrt(square) / (sqrt((1.0 - e) * (1.0 + e)) * (cosine + square * sine))  # r df / dv
    d1 = 1.5 + 1.5 * sqrt(1.0 - 3.0 * mu * (1.0 - mu))
    d2 = 6.75 * mu * (1.0 - mu) / d1
    out[0, 2] = out[2, 1] = out[3, 0] = turn
    out[0, 3] = out[1, 2] = out[3, 1] = -turn
    out[1, 3], out[2, 0] = turn - d2 * pull, d1 * pull - turn


SYSTEM, HALF = (System({"A": canonical}, 4, period, (), symplectic=True) for period in (2 * pi, pi))


def rates(mu):
    """d1, d2 = (3 / 2)(1 +- s); the smaller from the product, which loses no digits."""
    x = 6.75 * mu * (1.0 - mu)
    d1 = 1.5 * (1.0 + np.sqrt(1.0 - 3.0 * mu * (1.0 - mu)))
    return d1, x / d1


def factors(e, mu):
    """A, B, C, D, t (N, 5) and their error bounds (N, 5), from series."""
    return np.split(panels.points(e, mu), 2, axis=1)


def _by_panels(e, mu, rtol, answers):
    """Answers of points (N each); those that miss `rtol` are solved again as rows of one point, whose
    bounds are narrower.
    """
    answers.assess(panels.points(e, mu), rtol)
    missed = np.flatnonzero(answers.missed)
    for first in range(0, missed.size, CHUNK):
        some = missed[first : first + CHUNK]
        own = Answers(some.size)
        _by_series(e[some], mu[some, None], rtol, own, np.ones((some.size, 1), bool))
        answers.replace(some, own)


def _by_series(e, mu, rtol, answers, left):
    """Answer the points `left` (R, L) from their rows' series; those that miss `rtol` remain `missed`."""
    some = np.flatnonzero(left.any(axis=1))
    series, bars = panels.rows(e[some])
    answers.missed |= left.reshape(-1)
    answers.of_rows(series, bars, some, mu, rtol)


def _by_steps(e, mu, method, rtol, answers):
    """Answers of points (N each), each on a rung of its own."""
    method = monodromy.method_of(method)
    for first in range(0, e.size, CHUNK):
        some = slice(first, first + CHUNK)
        points = monodromy.SystemPoints(HALF, np.stack([mu[some], e[some]], axis=1))
        own = Answers(len(points.points))
        every, one = np.arange(own.status.size), np.ones(own.status.size)
        short = points.steps(method.floquet_reach(rtol), one, every)[:, 0] <= FIRST
        own.status[:] = np.where(short, status.NO_CONVERGENCE, status.STEP_LIMIT)
        where = np.flatnonzero(points.valid & short)

        def solved(those, rung, points=points, where=where):
            found = monodromy.solve(
                points, method, rtol, LADDER.rungs[rung], where[those], sharp=False
            )
            with np.errstate(over="ignore", invalid="ignore"):
                return _of_propagator(found.M, found.E)

        def assessed(those, results):
            found = Answers(len(results))
            found.assess(results, rtol)
            return found

        rung = np.zeros(where.size, dtype=np.int64)
        results = solved(np.arange(where.size), rung)
        best = assessed(slice(None), results)
        LADDER.climb(rung, results, best, solved, assessed)
        own.replace(where, best)
        answers.replace(np.arange(e.size)[some], own)


def _of_propagator(M, E):
    """Results (N, RESULTS) from the propagators over half a period and bounds of their entries (N, 4, 4)."""
    results = np.empty((len(M), RESULTS))
    halves = slice(2), slice(2, 4)
    # A of P, B of T, C of Q, D of S
    for j, (row, column) in enumerate(((0, 0), (1, 1), (1, 0), (0, 1))):
        (a, b), (c, d) = (M[:, halves[row], halves[column]][:, i].T for i in range(2))
        (ea, eb), (ec, ed) = (E[:, halves[row], halves[column]][:, i].T for i in range(2))
        results[:, j] = a * d - b * c
        bar = ea * abs(d) + ed * abs(a) + ea * ed + eb * abs(c) + ec * abs(b) + eb * ec
        results[:, INVARIANTS + j] = bar + EPS * 2.0 * (abs(a * d) + abs(b * c))
    P, T, EP, ET = M[:, :2, :2], M[:, 2:, 2:], E[:, :2, :2], E[:, 2:, 2:]
    results[:, traces.T] = (P * T).sum(axis=(1, 2))
    bar = EP * abs(T) + ET * abs(P) + EP * ET + 4.0 * EPS * abs(P * T)
    results[:, traces.T_BAR] = bar.sum(axis=(1, 2))
    return results


def closed_form(mu, rtol):
    """Answers where mu = 0 (all multipliers 1, and a secular term) or e = 0 (frequencies of the
    circular problem).
    """
    answers = Answers(mu.size)
    x = 6.75 * mu * (1.0 - mu)
    s = np.sqrt((1.0 - 4.0 * x).astype(complex))  # w1^2 - w2^2, imaginary beyond Routh's value
    u = 0.5 * (1.0 + s)
    v = x / u
    (f, df), (g, dg) = _cosine(u), _cosine(v)
    near = np.where(abs(s) < 1e-6, 1e-6, s)  # the differences below vanish with s
    a, b = 2.0 * (f + g).real, 2.0 + (4.0 * f * g).real
    moved = 4.0 * EPS * np.maximum(x, 1.0)
    bars = 2.0 * abs((df - dg) / near) * moved, 4.0 * abs((df * g - f * dg) / near) * moved
    size = 8.0 * EPS * (4.0 + abs(f) + abs(g))
    answers.floats[:] = a, bars[0] + size, b, bars[1] + size * (2.0 + abs(f) + abs(g))
    margin = 1.0 - 4.0 * x
    stable, unstable = margin > 8 * EPS, margin < -8 * EPS
    answers.verdict[:] = np.where(stable, STABLE, np.where(unstable, UNSTABLE, UNDECIDED))
    answers.collision[:] = np.where(unstable, KREIN, UNDECIDED)
    w1, w2 = np.sqrt(u.real), np.sqrt(v.real)
    # beyond w2 = 1/2 the pairs are of unlike kind: arcs 2 pi (w1 - w2) and 2 pi (2 w2 - 1)
    arcs = (w1 - w2) - (2.0 * w2 - 1.0)
    nearer = np.where(arcs > 1e-7, MINUS_ONE, np.where(arcs < -1e-7, KREIN, UNDECIDED))
    answers.collision[stable] = np.where(w2 <= 0.5, MINUS_ONE, nearer)[stable]
    rest = mu == 0
    answers.floats[:, rest] = np.array([4.0, 0.0, 6.0, 0.0])[:, None]
    answers.verdict[rest], answers.collision[rest] = UNSTABLE, NONE
    answers.missed[:] = answers.inaccurate(rtol) | (answers.verdict == UNDECIDED)
    return answers


def _cosine(u):
    """cos(2 pi sqrt u) and its derivative with respect to u."""
    root = np.sqrt(u)
    x = 2.0 * np.pi * root
    return np.cos(x), -np.pi * np.sin(x) / np.where(root == 0, 1.0, root)
