"""Branches of the saddles in double-double arithmetic, for any b: a power series at the saddle,
then the flow.

w(x) = a1 x + a2 x^2 + ..., x = phi - phi_s, solves w w' = f w + g (57), a1 = (f + sqrt(f^2 + 4
g'))/2 for the unstable branches. It is taken to x1, where its last terms are below 1e-32, and from
there on `flow_double` follows the branch. Nearer to the saddle the time is that of x' = w(x): a1 t
= ln x + r1 x + r2 x^2/2 + ..., 1/w = (1 + r1 x + ...)/(a1 x).

All here is the branch that leaves the saddle to the right, w > 0; the caller mirrors.
"""

import math

import numpy as np

from survey.kernels.cylinder import flow_double
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import (
    B12,
    B31,
    BOUND_DDG,
    BOUND_DG,
    BOUND_F,
    C23,
    S2,
    S3,
    TWO_PI,
    D,
    values,
)
from survey.kernels.cylinder.separatrix import ANGLE, ANGLE_LOW, SLIP, past_saddle
from survey.kernels.cylinder.steps import EQUILIBRIUM, OK
from survey.kernels.jit import inline, kernel
from survey.kernels.math.angles_double import centred, sine_cosine
from survey.kernels.math.double import (
    add,
    div,
    mul,
    neg,
    over,
    scaled,
    shifted,
    sqrt,
    square,
    sub,
    times,
)
from survey.kernels.math.roundoff import PAIR_SUM_ROUNDOFF, ROUNDOFF_UP

ORDER = 30
TRUNCATION = 1e-32  # of the series, relative
FURTHEST = 0.1  # rad from the saddle
_HI, _LO, _LAW = range(3)  # rows of the series: a_n as double-doubles, and r_n/n
_REACH, _TURNS, _TIME, _TIME_BAR, _SLIP, _W_SLIP, _X0 = range(7)  # of a branch
SIZE = 7
_SAFE = 1.5


@inline
def scratch():
    """The series, and what is known of the branch."""
    return np.zeros((3, ORDER + 1)), np.zeros(SIZE)


@kernel
def expand(p, saddle, a):
    """Fill `a` (3, ORDER + 1) with the series at the saddle; returns how far it may be taken."""
    f, g = np.zeros((2, ORDER + 1)), np.zeros((2, ORDER + 1))
    s, c = sine_cosine((saddle[ANGLE], saddle[ANGLE_LOW]))
    s2, c2 = scaled(mul(s, c), 2.0), shifted(scaled(square(s), -2.0), 1.0)
    factorial, power = 1.0, 1.0
    for n in range(ORDER + 1):
        f[0, n], f[1, n] = over(add(times(c, p[B12]), times(s, -p[B31])), factorial)
        one = add(times(c, p[S2]), times(s, -p[S3]))
        two = add(times(s2, 0.5 * p[D]), times(c2, p[C23]))
        g[0, n], g[1, n] = over(sub(one, scaled(two, power)), factorial)
        s, c, s2, c2 = c, neg(s), c2, neg(s2)
        factorial, power = factorial * (n + 1.0), 2.0 * power
    f0, dg = (f[0, 0], f[1, 0]), (g[0, 1], g[1, 1])
    spread = sqrt(add(square(f0), scaled(dg, 4.0)))
    first = scaled(add(f0, spread), 0.5) if f0[0] > 0.0 else div(scaled(dg, 2.0), sub(spread, f0))
    a[_HI, 1], a[_LO, 1] = first
    reach = FURTHEST
    for n in range(2, ORDER + 1):
        known = (g[0, n], g[1, n])
        for j in range(1, n):
            known = add(known, mul((f[0, n - j], f[1, n - j]), (a[_HI, j], a[_LO, j])))
        for j in range(2, n):
            k = n + 1 - j
            known = sub(known, times(mul((a[_HI, j], a[_LO, j]), (a[_HI, k], a[_LO, k])), float(k)))
        a[_HI, n], a[_LO, n] = div(known, sub(times(first, n + 1.0), f0))
        if n > ORDER - 4:
            reach = min(
                reach, (TRUNCATION * first[0] / (abs(a[_HI, n]) + 1e-300)) ** (1.0 / (n - 1))
            )
    law = np.zeros(ORDER)
    law[0] = 1.0
    for n in range(1, ORDER):
        for k in range(1, n + 1):
            law[n] -= a[_HI, k + 1] / first[0] * law[n - k]
        a[_LAW, n] = law[n] / n
    return reach


@kernel
def velocity(a, x):
    """w at x (a double-double) from the saddle, within the reach of the series."""
    w = (0.0, 0.0)
    for n in range(ORDER, 0, -1):
        w = mul(add(w, (a[_HI, n], a[_LO, n])), x)
    return w


@inline
def _law(a, x):
    """r1 x + r2 x^2/2 + ..., and its derivative times x."""
    value, slope = 0.0, 0.0
    for n in range(ORDER - 1, 0, -1):
        value = value * x + a[_LAW, n]
        slope = slope * x + n * a[_LAW, n]
    return value * x, slope * x


@inline
def _between(a, x, y):
    """The time from x to y on the series, and its error."""
    one, two, log = _law(a, x)[0], _law(a, y)[0], math.log(y / x)
    t = (log + (two - one)) / a[_HI, 1]
    return t, 8.0 * ROUNDOFF_UP * (1.0 + abs(log) + abs(one) + abs(two)) / a[_HI, 1]


@inline
def _begin(p, saddle, branch, a):
    """The start of the flow: phi, w and their error ellipse, where the series ends."""
    x = (branch[_REACH], 0.0)
    phi, _k = centred(shifted((saddle[ANGLE], saddle[ANGLE_LOW]), branch[_REACH]))
    e, f = branch[_SLIP], branch[_W_SLIP]
    return phi, velocity(a, x), (e * e, 0.0, f * f)


@kernel
def enter(p, saddle, phi0, a, branch, out):
    """Follow the branch to phi0: fill `out` with w there and its bar, and return the status.

    At other statuses than OK the branch turns (TURNING) or is lost before it passes phi0.
    """
    x0 = past_saddle(saddle, phi0)
    reach = expand(p, saddle, a)
    f0, _g, _dg = values(p, saddle[ANGLE])
    slip, first = saddle[SLIP] + PAIR_SUM_ROUNDOFF, a[_HI, 1]
    slope = slip * (p[BOUND_F] * first + p[BOUND_DDG]) + PAIR_SUM_ROUNDOFF * (
        p[BOUND_F] * first + p[BOUND_DG]
    )
    spread = 2.0 * first - f0
    branch[_REACH], branch[_SLIP] = reach, 3.0 * slip
    branch[_W_SLIP] = 3.0 * (
        PAIR_SUM_ROUNDOFF * first * reach + 2.0 * reach * slope / spread + 2.0 * first * slip
    )
    start = centred(shifted((saddle[ANGLE], saddle[ANGLE_LOW]), reach))[0]
    branch[_TURNS] = math.floor((sub(shifted(neg(x0), phi0), start)[0] + reach) / TWO_PI + 0.5)
    branch[_X0] = x0[0]
    if x0[0] <= 1e3 * slip:
        return EQUILIBRIUM
    if x0[0] <= reach:
        w = velocity(a, x0)[0]
        branch[_TIME], branch[_TIME_BAR] = _between(a, x0[0], reach)
        branch[_TIME_BAR] += slip / w
        out[0], out[1] = w, 2.0 * ROUNDOFF_UP * w + branch[_W_SLIP] * x0[0] / reach
        return OK
    floats, status, targets = np.zeros((1, rc.STATE)), np.zeros(1, np.int64), np.empty(1)
    targets[0] = phi0
    flow_double.passed(
        p, _begin(p, saddle, branch, a), branch[_TURNS], 0.0, 0, targets, floats, status
    )
    if status[0] == OK:
        branch[_TIME], branch[_TIME_BAR] = -floats[0, rc.TIME], floats[0, rc.TIME_BAR]
        out[0], out[1] = floats[0, rc.VALUE], floats[0, rc.VALUE_BAR]
    return status[0]


@kernel
def trajectory(p, saddle, a, branch, phi0, asked, floats, turnings):
    """As `steps.trajectory` at the ascending times `asked`, of either sign, after phi0."""
    first, j = a[_HI, 1], 0
    while j < len(asked) and asked[j] <= branch[_TIME]:
        reach, t = branch[_REACH], asked[j] - branch[_TIME]
        end, goal = _law(a, reach)[0], first * t
        y = goal  # ln(x/reach)
        for _ in range(60):
            value, slope = _law(a, reach * math.exp(y))
            move = (y + value - end - goal) / (1.0 + slope)
            y -= move
            if abs(move) <= 4.0 * ROUNDOFF_UP * (1.0 + abs(y)):
                break
        x = reach * math.exp(y)
        w = velocity(a, (x, 0.0))[0]
        share = 16.0 * ROUNDOFF_UP * (1.0 + abs(y) + abs(end)) + first * branch[_TIME_BAR]
        steep = abs(_steepness(a, x))
        phi = phi0 + (x - branch[_X0])
        floats[j, rc.PHI], floats[j, rc.W], turnings[j] = phi, w, 0
        floats[j, rc.PHI_BAR] = (
            _SAFE * (share * x + 2.0 * ROUNDOFF_UP * (abs(phi) + branch[_X0])) + branch[_SLIP]
        )
        floats[j, rc.W_BAR] = (
            _SAFE * (share * x * steep + 2.0 * ROUNDOFF_UP * w)
            + branch[_W_SLIP] * x / reach
            + 1e-300
        )
        j += 1
    if j == len(asked):
        return OK
    origin = branch[_TIME], branch[_TIME_BAR]
    return flow_double.followed(p, _begin(p, saddle, branch, a), branch[_TURNS], origin, 1, False, asked[j:],
                                floats[j:], turnings[j:])  # fmt: skip


@inline
def _steepness(a, x):
    """dw/dx."""
    slope = 0.0
    for n in range(ORDER, 0, -1):
        slope = slope * x + n * a[_HI, n]
    return slope


@kernel
def abel(p, saddle, a, branch, phi0, targets, floats, status):
    """As `steps.abel` at the ascending targets, on either side of phi0."""
    j, x0 = 0, past_saddle(saddle, phi0)
    while j < len(targets):
        x = add(sub((targets[j], 0.0), (phi0, 0.0)), x0)
        if x[0] > branch[_REACH]:
            break
        status[j] = EQUILIBRIUM
        if x[0] > 1e3 * branch[_SLIP]:
            w = velocity(a, x)[0]
            t, bar = _between(a, x[0], branch[_REACH])
            floats[j, rc.VALUE], floats[j, rc.TIME], status[j] = w, branch[_TIME] - t, OK
            floats[j, rc.VALUE_BAR] = (
                2.0 * ROUNDOFF_UP * w + branch[_W_SLIP] * x[0] / branch[_REACH]
            )
            floats[j, rc.TIME_BAR] = (
                _SAFE * (bar + ROUNDOFF_UP * abs(branch[_TIME])) + branch[_SLIP] / w
            )
        j += 1
    if j < len(targets):
        start = _begin(p, saddle, branch, a)
        flow_double.passed(p, start, branch[_TURNS], branch[_TIME], j, targets, floats, status)
    for i in range(len(targets)):
        floats[i, rc.TIME_BAR] += branch[_TIME_BAR]
