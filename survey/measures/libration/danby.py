"""Danby's question: are the triangular points of the elliptic problem stable? Trace invariants,
verdict, collision.

The monodromy's characteristic polynomial is l^4 - a l^3 + b l^2 - a l + 1. By the reversibility
half a period gives all (`traces`; `scenes/libration_elliptic.md`): stable <=> A B > 0, C D > 0, K >
0 and 0 < t < 2, decided by the error bounds of these; A B = 0 means multipliers -1, K = 0 two pairs
that meet.

Points climb a ladder of steps (`survey.measures.answers`). Dense rows (one e, many mu) are five
Chebyshev series in s = sqrt(1 - 3 mu (1 - mu)), which come from series in both parameters
(`panels`), as do very many points. e = 0 and mu = 0 have closed forms. What these leave open, or
not as accurate as asked, is solved in double-double.
"""

from functools import lru_cache

import numpy as np

from survey import measures, methods, status
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
from survey.measures.libration import danby_double, panels
from survey.measures.libration.answers import Answers
from survey.methods import taylor16
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
# Numbers of steps; a point climbs to 1.7 times as many. Of adaptive methods: tolerances of a step.
_NUMBERS = np.array([2, 3, 4, 5, 6, 7, 8, *((5 + i % 4) << (i // 4 + 1) for i in range(49))])
STEP_COUNTS = Ladder(_NUMBERS, np.arange(_NUMBERS.size) + 3, slice(INVARIANTS, RESULTS), most=5)
TOLERANCES = Ladder(
    10.0 ** -np.arange(4.0, 16.0), np.arange(12) + 1, slice(INVARIANTS, RESULTS), most=5
)
FINEST = 1e-14
# The least number of points in a row for which a series pays, and of points on their own: a panel
# costs 30,000 of them.
DENSE = 3 * NODES
MANY = 30_000
# Keep a kernel call below about a second: steps, or points of an adaptive method.
CALL_WORK, WALKS = 3_000_000, 500


def solve(e, mu, method="auto", rtol=1e-10, dense=False, many=False):
    """The outputs for rows e (R) of points mu (R, L), all (R, L): a, b, their bounds, verdict,
    collision, status.

    `dense`: the rows are long enough for series (see DENSE), `many`: the points are enough,
    wherever they are cut.
    """
    answers = Answers(mu.size)
    valid = np.isfinite(e)[:, None] & np.isfinite(mu)
    left = valid & ((e > 0)[:, None] & (mu > 0) | (method != "auto"))
    closed = valid & ~left
    if closed.any():
        answers.replace(np.flatnonzero(closed), closed_form(mu[closed], rtol))
    if method == "auto" and dense:
        _by_series(e, mu, rtol, answers, left)
    elif method == "auto" and many:
        points = np.flatnonzero(left)
        own = Answers(points.size)
        own.assess(panels.points(e[points // mu.shape[1]], mu[left]), rtol)
        answers.replace(points, own)
    elif left.any():
        used = taylor16 if method == "auto" else measures.method(method)
        points = np.flatnonzero(left)
        answers.replace(
            points, _point_by_point(e[points // mu.shape[1]], *rates(mu[left]), used, rtol)
        )
    if method == "auto":
        points = np.flatnonzero((valid & (mu > 0)).reshape(-1) & answers.unsettled)
        if points.size:
            danby_double.solve(e, mu, rtol, answers, points, dense)
    answers.status[~valid.reshape(-1)] = status.INVALID_PARAMETERS
    answers.floats[:, answers.status != status.OK] = np.nan
    names = ("a", "a_error", "b", "b_error")
    out = dict(zip(names, answers.floats.reshape(4, *mu.shape), strict=True))
    return out | {
        name: getattr(answers, name).reshape(mu.shape)
        for name in ("verdict", "collision", "status")
    }


def rates(mu):
    """d1, d2 = (3 / 2)(1 +- s); the smaller from the product, which loses no digits."""
    x = 6.75 * mu * (1.0 - mu)
    d1 = 1.5 * (1.0 + np.sqrt(1.0 - 3.0 * mu * (1.0 - mu)))
    return d1, x / d1


def factors(e, mu, rtol=1e-13):
    """A, B, C, D, t (N, 5) and their error bounds (N, 5), to what midpoint Taylor can."""
    results = np.empty((e.size, RESULTS))
    _point_by_point(e, *rates(mu), taylor16, rtol, results)
    return results[:, :INVARIANTS], results[:, INVARIANTS:]


def _by_series(e, mu, rtol, answers, left):
    """Answer the points `left` (R, L) from their rows' series; those that miss `rtol` remain `missed`."""
    some = np.flatnonzero(left.any(axis=1))
    series, bars = panels.rows(e[some])
    answers.missed |= left.reshape(-1)
    traces.dense(series, bars, some, mu, rtol, status.OVERFLOW, *answers.all)


def _point_by_point(e, d1, d2, method, rtol, results=None):
    """Answers of points (N each), each on a rung of its own; fills `results` (N, RESULTS) if they
    are given.
    """
    results = np.empty((e.size, RESULTS)) if results is None else results
    adaptive = methods.adaptive(method)
    run, ladder = (_walk, TOLERANCES) if adaptive else (_chain, STEP_COUNTS)
    asked = max(rtol, FINEST)
    if adaptive:
        rung = np.full(e.size, np.searchsorted(-ladder.rungs, -0.01 * asked))
    else:
        rung = np.searchsorted(ladder.rungs, method.danby_steps(e, asked))

    def solve_at(points, rung):
        return run(method, e[points], d1[points], d2[points], ladder.rungs[rung])

    def assess(points, results):
        found = Answers(points.size)
        found.assess(results, rtol)
        return found

    answers = Answers(e.size)
    answers.status[rung > ladder.top] = status.STEP_LIMIT
    first = np.flatnonzero(rung <= ladder.top)
    results[first] = solve_at(first, rung[first])
    answers.assess(results, rtol)
    ladder.climb(rung, results, answers, solve_at, assess)
    return answers


def _chain(method, e, d1, d2, number):
    """Results (N, RESULTS) by `number` (N) fixed steps; points of one mesh together, in calls of
    bounded work.
    """
    results = np.empty((e.size, RESULTS))
    key = number * 1000 + grading(e)
    order = np.argsort(key, kind="stable")
    nodes = tuple(method.NODES)
    for same in np.split(order, np.flatnonzero(np.diff(key[order])) + 1):
        if not same.size:
            continue
        steps = int(number[same[0]])
        v, h = mesh(steps, int(grading(e[same[:1]])[0]), nodes)
        most = max(64, CALL_WORK // steps)
        for first in range(0, same.size, most):
            some = same[first : first + most]
            out = np.empty((some.size, RESULTS))
            method.danby_chain(v, h, e[some], d1[some], d2[some], out)
            results[some] = out
    return results


def _walk(method, e, d1, d2, tolerance):
    """Results (N, RESULTS) of points one by one, each with its tolerance (N)."""
    results = np.empty((e.size, RESULTS))
    for first in range(0, e.size, WALKS):
        some = slice(first, first + WALKS)
        method.danby_walk(e[some], d1[some], d2[some], tolerance[some], results[some])
    return results


def grading(e):
    """How far the steps crowd towards f = pi, where r is singular at pi +- i arccosh(1 / e): see `mesh`."""
    return np.rint(0.25 * np.log2((1.0 + e) / (1.0 - e))).astype(int)


@lru_cache(maxsize=256)
def mesh(steps, grade, nodes):
    """1 + cos f at the nodes of each step (steps, nodes), and the steps' lengths (steps).

    They are even in psi, tan((pi - f) / 2) = 2^-grade tan(psi / 2): between true (0) and eccentric
    anomaly, so that the singularities of the equation and of this map lie about as far away.
    """
    psi = np.pi * np.arange(steps, -1, -1) / steps
    y = 2.0 * np.arctan(2.0**-grade * np.tan(0.5 * psi))
    y[0] = np.pi
    h = y[:-1] - y[1:]
    return 2.0 * np.sin(0.5 * (y[:-1, None] - h[:, None] * np.array(nodes))) ** 2, h


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
