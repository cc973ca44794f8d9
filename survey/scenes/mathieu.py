"""Mathieu's equation, the yardstick of parametric resonance: y'' + (a - 2 q cos 2t) y = 0, period T
= pi.

Model: a pendulum's equation, linearised about its rest, or one coordinate of an ion in a quadrupole
trap, which is linear as it stands. Not for a pendulum's finite angles, or for several ions.

Parameters, in order: a (characteristic value) and q (parametric excitation), up to 1e12, without
units, in the notation of DLMF 28.2.1.

Known: the edges of the tongues are the characteristic values a_n(q), b_n(q) (DLMF 28.2(v)); D is
even in q (DLMF 28.2.16); at q = 0 every gap is closed and D = 2 cos(pi sqrt a), marginal at a =
n^2; for q != 0 no gap is closed (DLMF 28.2(vi): a_n and b_n are distinct). Tongue n opens as q^n
(DLMF 28.6.15).

Source: DLMF chapter 28, https://dlmf.nist.gov/28; E. Mathieu, J. Math. Pures Appl. 13 (1868) 137.
Conventions, and how it is decided: `mathieu.md` beside this file.
"""

from math import cos, pi

import numpy as np

from survey import status
from survey.kernels.hill import dop853, taylor_double
from survey.kernels.hill.answers import NO_RULE, NO_UNSTABLE_SIDE, ON_EDGE
from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd
from survey.measures.hill import dense, monodromy, motion
from survey.measures.hill import why as hill_why
from survey.measures.rows import Rows
from survey.scene import Parameter

TITLE = "Stability of Mathieu's equation"
FAMILY = "hill"
STATUS = {}
AUDIT = ("dop853",)
REFERENCES = (
    "NIST Digital Library of Mathematical Functions, chapter 28",
    "E. Mathieu, Journal de Mathematiques Pures et Appliquees 13 (1868) 137",
)
PARAMETERS = (
    Parameter("a", "characteristic value", "a", minimum=-1e12, maximum=1e12),
    Parameter("q", "parametric excitation", "q", minimum=-1e12, maximum=1e12),
)
OPTIONS = ()
why = hill_why.why
OUTPUTS = monodromy.OUTPUTS
_HALF_PERIOD = pi / 2


def cost(options, sizes):
    """Seconds per point, roughly."""
    return monodromy.cost(sizes.get("q", 1), sizes.get("a", 1))


def solve(point, request):
    """All outputs of a block that the request wants (see `survey.scenes`)."""
    block, box = Rows((point["q"],), point["a"]), _box(request)
    if box is None:
        problem = _problem(
            block.per_row(point["q"]),
            block.view(point["a"]),
            request.line("a"),
            request.line("q"),
        )
        into = block.straight(request.out)
        out = monodromy.solve(problem, request.method, request.rtol, request.variables, into)
    else:
        block = Rows((point["q"], point["a"]))
        q, a = block.per_row(point["q"]), block.per_row(point["a"])
        position = np.where(q == 0, np.nan, q)  # there exact rules decide
        out = monodromy.solve_scattered(
            box,
            position,
            a,
            lambda points: _problem(q[points], a[points, None]),
            request.rtol,
            request.variables,
            block.straight(request.out),
        )
    known = out["status"] == status.OK
    for name, value in (("period", pi), ("period_error", 1.3e-16)):  # pi is rounded
        out[name] = np.full((1, 1), value) if known.all() else np.where(known, value, np.nan)
    return {name: block.back(values) for name, values in out.items()}


def compile_ahead(variables, options):
    """Compile some of the kernels of a map of these variables (see `survey.scenes`)."""
    return dense.compile_ahead(_sample, np.empty(0), variables)


def trajectory(point, answer, options, time=None):
    """Solutions and multipliers of a point (see `survey.scenes`)."""
    return motion.solve(_problem(np.array([point["q"]]), np.array([[point["a"]]])), answer, time)


def equation(names, ends, options):
    """The equation in formulas (see `survey.scenes`)."""
    return "even", [("pi/2", f"{names['a']} - 2*{names['q']}*cos(2*u)")]


def _problem(q, a, line=None, ends=None):
    rule, constant = _rules(q, a)
    return monodromy.Problem(
        p=a,
        sizes=lambda: _sizes(q),
        c2=0.0,
        **monodromy.of_rows(lambda: q, _sample, _walk_points, _solve_points),
        rule=rule,
        constant=constant,
        line=line,
        row_axis=_row_axis(*ends) if ends else None,
        positions=q,
    )


def _sizes(q):
    return monodromy.RowSizes(
        span=np.where(np.isfinite(q), _HALF_PERIOD, np.nan),
        bound=np.column_stack([2 * abs(q), np.ones(q.size), np.zeros(q.size)]),
        rate=np.full(q.size, 2.0),
        span_low=np.full(q.size, dd.HALF_PI[1]),
    )


def _row_axis(number, low, high):
    return monodromy.RowAxis(
        "mathieu", number, low, high, at=lambda q: _problem(q, np.zeros((q.size, 0)))
    )


def _box(request):
    """Where the points of a survey lie whose a and q share an axis; None if there are few."""
    a, q = request.ranges.get("a"), request.ranges.get("q")
    number = monodromy.boxed(min(a[0], q[0])) if a and q and request.method == "auto" else None
    if number is None or not (a[2] > a[1] and q[2] > q[1]):
        return None
    return monodromy.Box(_row_axis(number, *q[1:]), (number, *a[1:]))


def _rules(q, a):
    """At q = 0, z = a: no unstable side for a > 0, and |D| = 2 at squares."""
    free = np.flatnonzero(q == 0)
    if not free.size:
        return None, None
    z = a[free]
    order = np.rint(np.sqrt(abs(z)))
    rule = np.full(a.shape, NO_RULE, np.int8)
    rule[free] = np.where(z == order * order, ON_EDGE, np.where(z > 0, NO_UNSTABLE_SIDE, NO_RULE))
    return rule, (free, z)


@inline
def _excitation(t, q):
    """-2 q cos 2t."""
    return -2.0 * q * cos(2.0 * t)


@kernel
def _sample(q, nodes, out):
    """c0 = -2 q cos 2t and c1 = 1 at the `nodes` (fractions) of the steps of the half period:
    out[r, step, c, node].
    """
    steps = out.shape[1]
    for n in range(steps):
        for i in range(len(nodes)):
            t = (n + nodes[i]) * _HALF_PERIOD / steps
            for r in range(len(q)):
                out[r, n, 0, i] = _excitation(t, q[r])
                out[r, n, 1, i] = 1.0


@inline
def _potential(t, a, row, table):
    """z at any t and what its rounding is relative to, for the methods that choose their own steps."""
    z = a + _excitation(t, row)
    return z, abs(a) + 2.0 * abs(row)


@kernel
def _walk_points(q, a, tolerance, out, reached):
    """Points of their own, by DOP853."""
    for i in range(len(a)):
        reached[i] = dop853.hill_walk(
            _potential, a[i], q[i], 0.0, _HALF_PERIOD, tolerance[i], out[i]
        )


@inline
def _start(row, clock):
    """cos 2t and sin 2t at t = 0."""
    clock[0, 0, 0], clock[0, 1, 0] = 1.0, 0.0
    clock[1, 0, 0], clock[1, 1, 0] = 0.0, 0.0


@inline
def _circular(row, h, clock):
    """Series of cos 2t and sin 2t in x = t / h."""
    for n in range(clock.shape[2] - 1):
        for c in range(2):
            ahead = dd.times(dd.mul(h, (clock[1 - c, 0, n], clock[1 - c, 1, n])), 4.0 * c - 2.0)
            clock[c, 0, n + 1], clock[c, 1, n + 1] = dd.over(ahead, n + 1.0)


@inline
def _coefficient(side, row, a, clock, z):
    """Series of z = a - 2 q cos 2t."""
    for n in range(clock.shape[2]):
        z[0, n], z[1, n] = dd.times((clock[0, 0, n], clock[0, 1, n]), -2.0 * row)
    z[0, 0], z[1, 0] = dd.add((z[0, 0], z[1, 0]), a)
    return 2.0 * abs(row)


@inline
def _missed(row, clock):
    """cos 2t = -1 and sin 2t = 0 at t = T/2: how far off."""
    return abs(dd.add((clock[0, 0, 0], clock[0, 1, 0]), (1.0, 0.0))[0]) + abs(clock[1, 0, 0])


@kernel
def _solve_points(q, a, low, steps, out):
    """Points of their own, in double-double, in `steps` steps each."""
    work = taylor_double.workspace(2)
    chain = np.empty((steps.max(), taylor_double.STEP))
    for i in range(len(a)):
        taylor_double.hill_walk(
            _start,
            _circular,
            _coefficient,
            _missed,
            q[i],
            (a[i], low[i]),
            dd.HALF_PI,
            0,
            steps[i],
            work,
            chain,
            out[i],
        )
