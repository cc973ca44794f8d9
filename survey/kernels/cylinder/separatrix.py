"""Separatrices of the flow without Barnett-London effect, b = 0, in closed form: (66), and what it
lacks.

At a saddle phi_s, where V is greatest, w^2 = 2 (V(phi_s) - V(phi_s + x)) = 4 sin^2(x/2) Q(x), and v
= cot(x/2) obeys

    v'^2 = P(v) = A v^2 + 2 a v + b,   v(t) = v0 cosh Lt + a (cosh Lt - 1)/A - r0 sinh(Lt)/L,

A = L^2 = g'(phi_s), g(phi_s + x) = a (cos x - cos 2x) + b sin x + (A - b)/2 sin 2x, r0^2 = P(v0):
one formula without cases. P has real roots (a loop that turns back), complex ones (a loop around
the cylinder), or a double one (the solution runs into a second saddle of the same energy); A = 0
where g has a double root at phi_s (the quartic of (66) a triple one), A = a = 0 where it has a
triple one (quadruple). The saddle lies at v = infinity, phi = pi is no exception. Between v0 and v,
tanh(Lt/2) = L (v0 - v)/(r0 + r).

All here is the branch that leaves the saddle to the right, w > 0; the caller mirrors. What is lost
where terms cancel is computed in double-double arithmetic: the discriminant a^2 - A b, and m = A v0
+ a -+ L r0, their product.

Source: M. E. Lesina, Ya. V. Zinovyeva (2004), (66), as corrected in `scenes/gyrostat.md`.
"""

import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import BOUND_DDG, BOUND_DG, C23, S2, S3, TWO_PI, D
from survey.kernels.cylinder.roots import (
    CENTRE,
    CENTRE_LOW,
    MOST_DISCS,
    RADIUS,
    ROOTS,
    SLOPE,
    discs,
)
from survey.kernels.cylinder.steps import (
    EQUILIBRIUM,
    NO_CONVERGENCE,
    OK,
    SEPARATRIX,
    TURNING,
    UNDETERMINED,
)
from survey.kernels.jit import inline, kernel
from survey.kernels.math.angles_double import centred, radians, sine_cosine
from survey.kernels.math.double import add, div, mul, neg, scaled, shifted, sqrt, square, sub, times
from survey.kernels.math.roundoff import PAIR_SUM_ROUNDOFF, ROUNDOFF_UP

# A saddle: its angle in about [-pi, pi] as a double-double, the bar of that, and the roots of g
# that it stands for.
ANGLE, ANGLE_LOW, SLIP, MULTIPLICITY = range(4)
SADDLE = 4
# A branch, in rows of pairs: a double-double, or a number and its error.
_X0, _STEEP, _TILT, _LEVEL, _V0, _PRODUCT = range(6)  # x0, A, a, b, v0, a^2 - A b: double-doubles
# L, r0 (errors relative), m, w0; time and noise of Q
_RATE, _R0, _AWAY, _BACK, _START, _SHIFT = range(6, 12)
_AHEAD, _BEHIND, _DOUBT = 12, 13, 14  # v0 -+ r0/L; the error of a^2 - A b
SIZE = 15
ONE, TWO = 1.0, 2.0  # roots
_LEAST = 1e-300
_SHORT = 0.7  # Lt: longer, v0 and r0/L cancel
_SAFE = 1.5  # what the bars leave out: second order


@kernel
def saddle(p, index, out):
    """Fill `out` with saddle number `index` (1, 2, ... by angle in [0, 2 pi)), or return False:
    there is no such one.

    Degenerate equilibria, multiple roots of g within what double-doubles can tell apart, are
    counted as saddles.
    """
    found = np.empty((MOST_DISCS, 5))
    order = np.empty(MOST_DISCS, np.int64)
    keys = np.empty(MOST_DISCS)
    count = 0
    for i in range(discs(p, found)):
        if not (found[i, ROOTS] > ONE or (found[i, ROOTS] == ONE and found[i, SLOPE] > 0.0)):
            continue
        key = found[i, CENTRE] + (TWO_PI if found[i, CENTRE] < 0.0 else 0.0)
        key, k = (0.0 if key >= TWO_PI else key), count
        while k > 0 and keys[k - 1] > key:
            keys[k], order[k], k = keys[k - 1], order[k - 1], k - 1
        keys[k], order[k], count = key, i, count + 1
    for i in range(count):
        if i + 1.0 == index:
            disc = found[order[i]]
            out[ANGLE], out[ANGLE_LOW], out[SLIP] = disc[CENTRE], disc[CENTRE_LOW], disc[RADIUS]
            out[MULTIPLICITY] = disc[ROOTS]
            return True
    return False


@inline
def past_saddle(at_saddle, phi0):
    """phi0 less the angle of the saddle next to its left, in [0, 2 pi)."""
    x = sub(centred((phi0, 0.0))[0], (at_saddle[ANGLE], at_saddle[ANGLE_LOW]))
    if x[0] < 0.0:
        x = add(x, radians(1.0))
    elif x[0] >= TWO_PI:
        x = sub(x, radians(1.0))
    return x


@inline
def _put(data, at, high, low):
    data[at, 0], data[at, 1] = high, low


@inline
def _pair(data, at):
    return data[at, 0], data[at, 1]


@kernel
def enter(p, at_saddle, exact, phi0, data):
    """Fill data (SIZE, 2) for the branch to the right of the saddle that passes phi0: OK;
    SEPARATRIX; or -1: none does.

    `exact`: the parameters give two saddles of the same energy, or the degenerate one that the
    saddle is taken for.
    """
    x0 = past_saddle(at_saddle, phi0)
    slip = PAIR_SUM_ROUNDOFF + (at_saddle[SLIP] if at_saddle[MULTIPLICITY] == ONE else 0.0)
    s, c = sine_cosine((at_saddle[ANGLE], at_saddle[ANGLE_LOW]))
    a, b = add(times(c, p[S2]), times(s, -p[S3])), neg(add(times(s, p[S2]), times(c, p[S3])))
    turned = shifted(scaled(square(s), -2.0), 1.0)
    A = add(b, add(times(turned, -p[D]), scaled(times(mul(s, c), p[C23]), 4.0)))
    A = A if at_saddle[MULTIPLICITY] == ONE else (0.0, 0.0)
    a = a if at_saddle[MULTIPLICITY] <= TWO else (0.0, 0.0)
    noise = slip * p[BOUND_DDG]
    product, doubt = sub(square(a), mul(A, b)), 4.0 * noise * (2.0 * abs(a[0]) + abs(b[0]) + A[0])
    if exact and abs(product[0]) <= doubt:
        product, doubt = (0.0, 0.0), 0.0
    if A[0] < 0.0 or (A[0] == 0.0 and (a[0] < 0.0 or (a[0] == 0.0 and b[0] <= 0.0))):
        return -1
    s, c = sine_cosine(scaled(x0, 0.5))
    inner = add(add(mul(A, square(c)), scaled(mul(a, mul(s, c)), 2.0)), mul(b, square(s)))
    if not (x0[0] > 1e3 * slip and inner[0] > 4.0 * noise):
        return -1
    v0, speed, L = div(c, s), sqrt(inner), sqrt(A)
    r0 = div(speed, s)
    u, pull = add(mul(A, v0), a), mul(L, r0)
    if u[0] <= 0.0 and product[0] >= -doubt and (A[0] > 0.0 or a[0] > 0.0):
        return SEPARATRIX if doubt > abs(product[0]) else -1
    away, back, d_away, d_back = sub(u, pull), add(u, pull), 0.0, 0.0
    if u[0] > 0.0 and L[0] > 0.0:
        away, d_away = div(product, back), doubt / back[0]
    elif L[0] > 0.0:
        back, d_back = div(product, away), doubt / -away[0]
    for row, pair in (
        (_X0, x0),
        (_STEEP, A),
        (_TILT, a),
        (_LEVEL, b),
        (_V0, v0),
        (_PRODUCT, product),
    ):
        _put(data, row, pair[0], pair[1])
    blur, w0 = noise / inner[0], 2.0 * mul(s, speed)[0]
    _put(data, _RATE, L[0], ROUNDOFF_UP + (noise / A[0] if A[0] > 0.0 else 0.0))
    _put(data, _R0, r0[0], ROUNDOFF_UP + blur)
    _put(data, _AWAY, away[0], d_away + 2.0 * ROUNDOFF_UP * abs(away[0]))
    _put(data, _BACK, back[0], d_back + 2.0 * ROUNDOFF_UP * abs(back[0]))
    if L[0] > 0.0:
        core = div(r0, L)
        d_core = abs(core[0]) * (2.0 * blur + noise / A[0])
        for row, value in ((_AHEAD, sub(v0, core)[0]), (_BEHIND, add(v0, core)[0])):
            _put(data, row, value, d_core + ROUNDOFF_UP * abs(value))
    _put(data, _START, w0, w0 * (2.0 * ROUNDOFF_UP + blur))
    _put(data, _SHIFT, slip / w0, noise)
    data[_DOUBT, 0] = doubt
    return OK


@inline
def start(data):
    """w at phi0, and its bar."""
    return data[_START, 0], data[_START, 1]


@kernel
def at(p, data, phi0, t, floats):
    """Fill floats (PHI to W_BAR) at the time t, of either sign, after phi0; returns the turnings between."""
    if t == 0.0:
        floats[rc.PHI], floats[rc.PHI_BAR] = phi0, 0.0
        floats[rc.W], floats[rc.W_BAR] = data[_START, 0], data[_START, 1]
        return 0
    L, e_L, v0, r0, e_r = data[_RATE, 0], data[_RATE, 1], data[_V0, 0], data[_R0, 0], data[_R0, 1]
    side, tau, way = (1.0, t, _AWAY) if t > 0.0 else (-1.0, -t, _BACK)
    m, d_m = data[way, 0], data[way, 1]
    z = L * tau
    e, gone = math.exp(-z), -math.expm1(-z) / L if L > 0.0 else tau
    e_e, e_gone = z * (e_L + 2.0 * ROUNDOFF_UP) + 2.0 * ROUNDOFF_UP, 2.0 * e_L + 6.0 * ROUNDOFF_UP
    scale, e_scale = (e, e_e) if d_m > 0.0 and L > 0.0 else (1.0, 0.0)
    # (sin x/2, cos x/2), up to a factor
    if z < _SHORT:
        one, two = v0, -side * r0 * gone
        d_rise = 3.0 * ROUNDOFF_UP * abs(one) + (e_gone + e_r + 3.0 * ROUNDOFF_UP) * abs(two)
    else:
        one, two = data[_AHEAD if t > 0.0 else _BEHIND, 0], side * r0 / L * e
        d_rise = data[_AHEAD if t > 0.0 else _BEHIND, 1] + (
            e_e + e_r + e_L + 4.0 * ROUNDOFF_UP
        ) * abs(two)
    rise, bend = one + two, 0.5 * m * gone * gone
    d_rise += (e_scale + 2.0 * ROUNDOFF_UP) * abs(rise)
    y1, y2 = scale, scale * rise + bend
    norm = y1 * y1 + y2 * y2
    d1 = y1 * e_scale
    d2 = (
        scale * d_rise
        + abs(bend) * (2.0 * e_gone + 4.0 * ROUNDOFF_UP)
        + 0.5 * d_m * gone * gone
        + ROUNDOFF_UP * abs(y2)
    )
    x = 2.0 * math.atan2(y1, y2)
    d_x = 2.0 * (y1 * d2 + abs(y2) * d1) / norm + 4.0 * ROUNDOFF_UP * x
    sink, lift = -side * r0 * e * scale, 0.5 * m * gone * (1.0 + e)
    rate = sink + lift
    w = -2.0 * side * rate * scale / norm
    d_rate = abs(sink) * (e_r + e_e + e_scale + 4.0 * ROUNDOFF_UP) + d_m * gone
    d_rate += abs(lift) * (e_gone + min(e_e, 1.0) * e + 4.0 * ROUNDOFF_UP)
    d_w = 2.0 * d_rate * scale / norm + abs(w) * (e_scale + 6.0 * ROUNDOFF_UP)
    d_w += 4.0 * abs(w) * (y1 * d1 + abs(y2) * d2) / norm
    phi, moved = phi0 + (x - data[_X0, 0]), abs(x - data[_X0, 0])
    d_x += abs(w) * data[_SHIFT, 0] + ROUNDOFF_UP * (abs(phi) + moved + data[_X0, 0])
    d_w += 4.0 * p[BOUND_DG] * abs(math.sin(0.5 * x)) * data[_SHIFT, 0] + _LEAST
    floats[rc.PHI], floats[rc.W], floats[rc.PHI_BAR], floats[rc.W_BAR] = (
        phi,
        w,
        _SAFE * d_x,
        _SAFE * d_w,
    )
    if t < 0.0 or rate < -d_rate or (m == 0.0 and d_m == 0.0):
        return 0
    return 1 if rate > d_rate else UNDETERMINED


@kernel
def passing(data, phi0, phi, out):
    """w and t where phi is passed, or the turning point before it: fill out (VALUE to TIME_BAR),
    return the status.
    """
    x0 = _pair(data, _X0)
    A = _pair(data, _STEEP)
    a = _pair(data, _TILT)
    b = _pair(data, _LEVEL)
    v0 = _pair(data, _V0)
    product, doubt = _pair(data, _PRODUCT), data[_DOUBT, 0]
    L, r0, early, noise = data[_RATE, 0], data[_R0, 0], data[_SHIFT, 0], data[_SHIFT, 1]
    sharp = data[_RATE, 1] + data[_R0, 1] + 12.0 * ROUNDOFF_UP
    x = add(sub((phi, 0.0), (phi0, 0.0)), x0)
    if x[0] <= 0.0 or (x[0] >= TWO_PI and product[0] <= doubt):
        return EQUILIBRIUM
    top = data[_BACK, 0]  # A v0 + a + L r0
    if product[0] > doubt:
        root = sqrt(product)
        v = neg(div(b, add(a, root))) if a[0] > 0.0 else div(sub(root, a), A)
        far, e_root = 2.0 * math.atan2(1.0, v[0]), 0.5 * doubt / product[0]
        end = phi0 + (far - x0[0])
        d_v = (4.0 * noise * (1.0 + v[0] * v[0])) / root[0] + ROUNDOFF_UP * abs(v[0])
        edge = 2.0 * d_v / (1.0 + v[0] * v[0]) + ROUNDOFF_UP * (4.0 * far + 2.0 * abs(end) + x0[0])
        if x[0] >= far - edge:
            t, bar = _flight(L, sub(v0, v)[0] / r0, top / root[0], sharp + e_root)
            out[rc.VALUE], out[rc.TIME], out[rc.VALUE_BAR], out[rc.TIME_BAR] = (
                end,
                t,
                _SAFE * edge,
                _SAFE * (bar + early),
            )
            return TURNING
    s, c = sine_cosine(scaled(x, 0.5))
    u = add(mul(A, div(c, s)), a)[0]
    if u <= 0.0 and abs(product[0]) <= doubt and A[0] > 0.0:
        return SEPARATRIX if doubt > 0.0 else EQUILIBRIUM
    inner = add(add(mul(A, square(c)), scaled(mul(a, mul(s, c)), 2.0)), mul(b, square(s)))[0]
    if not inner > 16.0 * noise:
        return NO_CONVERGENCE
    r = math.sqrt(inner) / s[0]
    s0, _c = sine_cosine(scaled(x0, 0.5))
    gap, _c = sine_cosine(scaled(sub(x, x0), 0.5))
    foot = u + L * r if u >= 0.0 else -product[0] / (L * r - u)
    blur = noise / inner
    t, bar = _flight(L, div(gap, mul(s0, s))[0] / (r0 + r), top / foot, sharp + blur)
    w = 2.0 * s[0] * math.sqrt(inner)
    out[rc.VALUE], out[rc.TIME] = w, t
    out[rc.VALUE_BAR], out[rc.TIME_BAR] = (
        _SAFE * w * (8.0 * ROUNDOFF_UP + blur),
        _SAFE * (bar + early),
    )
    return OK


@inline
def _flight(L, q, ratio, sharp):
    """The time and its bar, from tanh(Lt/2) = L q or exp(Lt) = ratio, all to `sharp`, relative."""
    z = L * q
    if abs(z) >= 0.7:
        t = math.log(ratio) / L
        return t, (4.0 * sharp + 4.0 * ROUNDOFF_UP * abs(L * t)) / L
    t = (
        2.0 * q * (1.0 + z * z * (1.0 / 3.0 + z * z * 0.2))
        if abs(z) < 1e-4
        else 2.0 * math.atanh(z) / L
    )
    return t, 8.0 * sharp * abs(t)
