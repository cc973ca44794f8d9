"""Brun's problem in the double-double arithmetic of this folder: periods by sums, not by elliptic
integrals.

The polynomial P of (S2) is expanded about the start (or u = 0); its roots are bisected between its
stationary points and polished, those near a pole as roots in 1 -+ u. With u between its turning
points as a cosine of x, P = (u - ul)(uh - u) Q and

    T = 2 A int dx / sqrt Q,
    advance at the pole u = 1: sgn(d) (pi + int sqrt(vl vh) k (1 + u + S) / (sqrt Q (sqrt Q + sqrt Q1)) dx),

d = b - a, v = 1 - u, S = ul + uh, Q1 = Q(1), and likewise at -1. The integrands are periodic and
smooth: sums converge like exp(-n).
"""

import numpy as np

from survey.kernels.nutation import records as nu
from survey.truth.compiled import inline, kernel
from survey.truth.double import (
    PI,
    add,
    div,
    keep,
    mean,
    mul,
    neg,
    pair,
    root,
    sine_cosine,
    sub,
    times,
)

MOST = 4096
# What is filled of a well, each of these in two columns, high and low: u_min, u_max, T, precession, spin, action.
U_MIN, U_MAX, PERIOD, PRECESSION, SPIN, ACTION = range(0, 12, 2)
# T by sums less T by the mean, relative; the doubt of T beside a separatrix, relative to T, those of
# u_min and u_max; the fastest precession at a saddle.
APART, PERIOD_DOUBT, U_MIN_DOUBT, U_MAX_DOUBT, FASTEST = range(12, 17)
COLUMNS = 17
# A turning point, each of these in two columns: u, 1 - u, 1 + u. Of two the lower one comes first.
U, TO_PLUS, TO_MINUS = range(0, 6, 2)
TURNING = 6
LOWER, UPPER = range(2)
# What `well` fills, each of these in two columns: T by the mean, T by sums, what the pole u = 1 adds
# to the precession, what u = -1 adds, the action.
_MEAN, _SUM, _AT_PLUS, _AT_MINUS, _ACTION = range(0, 10, 2)
_WELL = 10
# The sums: of 1 / sqrt Q, of the advance at either pole, and of the action.
_PERIODS, _ADVANCES_PLUS, _ADVANCES_MINUS, _ACTIONS = range(4)
_SUMS = 4
ROUNDS = 1e-31  # of double-double, relative to the terms of L


@inline
def add_to(sums, n, x):
    """Add a double-double to row n."""
    sums[n, 0], sums[n, 1] = add((sums[n, 0], sums[n, 1]), x)


@inline
def value(c, x):
    """A polynomial (n, 2), lowest term first."""
    s = (0.0, 0.0)
    for i in range(len(c) - 1, -1, -1):
        s = add(mul(s, x), (c[i, 0], c[i, 1]))
    return s


@inline
def derived(c, out):
    for i in range(1, len(c)):
        out[i - 1, 0], out[i - 1, 1] = times((c[i, 0], c[i, 1]), float(i))


@inline
def between(c, d, a, b):
    """The root of a polynomial in [a, b] (double-doubles), where its sign changes once; `d` is its
    derivative.
    """
    fa = value(c, a)[0]
    low, high = a, b
    for _ in range(52):
        mid = times(add(low, high), 0.5)
        here = value(c, mid)[0]
        if (here > 0.0) == (fa > 0.0):
            low = mid
        else:
            high = mid
    x = times(add(low, high), 0.5)
    width = abs(sub(b, a)[0])
    for _ in range(4):
        s = value(d, x)
        if s[0] == 0.0:
            break
        step = div(value(c, x), s)
        if abs(step[0]) > 1e-10 * width:
            break
        x = sub(x, step)
    return x


@inline
def stationary(c, low, high, work, found):
    """Roots of a polynomial of degree <= 4 in [low, high], ascending, into `found`; returns their number."""
    # derivatives: cubic, quadratic, linear
    d1, d2, d3 = work[0][:4], work[1][:3], work[2][:2]
    derived(c, d1)
    derived(d1, d2)
    derived(d2, d3)
    marks = np.empty((10, 2))
    number = 0
    # roots of the linear, then between them those of the quadratic, ...
    marks[0], marks[1] = low, high
    size = 2
    if d3[1, 0] != 0.0:
        x = neg(div((d3[0, 0], d3[0, 1]), (d3[1, 0], d3[1, 1])))
        if sub(x, low)[0] > 0.0 and sub(high, x)[0] > 0.0:
            marks[1] = x
            marks[2] = high
            size = 3
    for level in range(3):
        f, g = (d2, d3) if level == 0 else ((d1, d2) if level == 1 else (c, d1))
        new = np.empty((10, 2))
        new[0] = low
        count = 1
        for j in range(size - 1):
            a, b = (marks[j, 0], marks[j, 1]), (marks[j + 1, 0], marks[j + 1, 1])
            fa, fb = value(f, a)[0], value(f, b)[0]
            if (fa > 0.0) != (fb > 0.0):
                new[count] = between(f, g, a, b)
                count += 1
        new[count] = high
        marks, size = new, count + 1
    for j in range(1, size - 1):
        found[number] = marks[j]
        number += 1
    return number


@inline
def at_pole(v, d2, c1, c2, c3, c4):
    """The root v near 0 of -d2 + c1 v + c2 v^2 + c3 v^3 + c4 v^4, from a guess."""
    for _ in range(5):
        p = add(mul(add(mul(add(mul(add(mul(c4, v), c3), v), c2), v), c1), v), neg(d2))
        s = add(
            mul(add(mul(add(times(mul(c4, v), 4.0), times(c3, 3.0)), v), times(c2, 2.0)), v), c1
        )
        if s[0] == 0.0:
            break
        v = sub(v, div(p, s))
    return v


@inline
def beside_pole(side, k, L, slope, end):
    """Where the motion turns just before the pole that is itself a root, into `end` (TURNING)."""
    five = add(times(k, 5.0), L)
    if five[0] < 0.0:
        zero = (0.0, 0.0)
        short = at_pole(
            div(times(slope, 2.0), five), zero, times(slope, 2.0), neg(five), times(k, 4.0), neg(k)
        )
        far, u = sub((2.0, 0.0), short), sub((1.0, 0.0), short)
        keep(end, U, u if side == UPPER else neg(u))
        keep(end, TO_PLUS, short if side == UPPER else far)
        keep(end, TO_MINUS, far if side == UPPER else short)


@inline
def well(A, k, L, a, b, level, below, ul, uh, vl, vh, wl, wh, out, most):
    """T, advances at the poles, action of a well; `level` is L + k - a b, `below` L + k + a b; v =
    1 - u, w = 1 + u.
    """
    delta, sigma = sub(b, a), add(b, a)
    S, p = add(ul, uh), mul(ul, uh)
    half = times(sub(vl, vh), 0.5)
    if vl[0] > wh[0]:
        half = times(sub(wh, wl), 0.5)
    kS = mul(k, S)
    q0 = add(sub(L, k), mul(k, sub(mul(S, S), p)))

    # by the mean (S5), in another arithmetic
    Ql = add(mul(add(mul(k, ul), kS), ul), q0)
    Qh = add(mul(add(mul(k, uh), kS), uh), q0)
    g = root(mul(Ql, Qh))
    s = add(sub(L, k), times(mul(kS, S), 1.5))
    keep(out, _MEAN, div(mul(PI, times(A, 2.0)), mean(root(times(add(s, g), 0.5)), root(g))))
    r1, r2 = root(mul(vl, vh)), root(mul(wl, wh))
    Q1, Q2 = (0.0, 0.0), (0.0, 0.0)
    if r1[0] > 0.0:
        Q1 = div(delta, r1)
        if Q1[0] < 0.0:
            Q1 = neg(Q1)
    else:
        Q1 = root(add(add(k, kS), q0))
    if r2[0] > 0.0:
        Q2 = div(sigma, r2)
        if Q2[0] < 0.0:
            Q2 = neg(Q2)
    else:
        Q2 = root(add(sub(k, kS), q0))
    narrow = half[0] < 0.02 * min(vh[0], wl[0])
    total = np.zeros((_SUMS, 2))
    old = np.zeros((_SUMS, 2))
    n, good = 8, False
    first = True
    while n <= most:
        # midpoint nodes of n; doubling keeps the old ones by using odd multiples
        part = np.zeros((_SUMS, 2))
        count = n if first else n // 2
        # nodes (j + 1/2) pi / n0 at first; then those half way
        for j in range(count):
            x = (
                times(PI, (2 * j + 1.0) / (2.0 * n))
                if first
                else times(PI, (2 * j + 1.0) / (1.0 * n))
            )
            sin, cos = sine_cosine(times(x, 0.5))
            # u = uh - 2 half sin^2(x/2); 1 - u = vh + ..., 1 + u = wl + 2 half cos^2(x/2)
            down, up = times(mul(half, mul(sin, sin)), 2.0), times(mul(half, mul(cos, cos)), 2.0)
            u = sub(uh, down) if abs(uh[0]) < abs(ul[0]) else add(ul, up)
            v, w = add(vh, down), add(wl, up)
            Q = add(mul(add(mul(k, u), kS), u), q0)
            q = root(Q)
            inverse = div((1.0, 0.0), q)
            add_to(part, _PERIODS, inverse)
            f1, f2 = mul(k, add(add((1.0, 0.0), u), S)), mul(k, sub(sub((1.0, 0.0), u), S))
            e1, e2 = div(f1, add(q, Q1)), div(f2, add(q, Q2))
            add_to(part, _ADVANCES_PLUS, mul(e1, inverse))
            add_to(part, _ADVANCES_MINUS, mul(e2, inverse))
            if narrow:
                term = div(mul(mul(down, up), q), mul(v, w))
            else:
                term = add(q, times(add(mul(mul(vl, vh), e1), mul(mul(wl, wh), e2)), 0.5))
            add_to(part, _ACTIONS, term)
        good = True
        for m in range(_SUMS):
            s = (part[m, 0], part[m, 1])
            if not first:
                s = add(s, (old[m, 0], old[m, 1]))
            old[m, 0], old[m, 1] = s
            s = times(s, 1.0 / n)
            advance = m in (_ADVANCES_PLUS, _ADVANCES_MINUS)
            scale = max(abs(s[0]), abs(total[_PERIODS, 0]) * 1e-3 if advance else 0.0)
            if first or abs(sub(s, (total[m, 0], total[m, 1]))[0]) > 1e-25 * scale + 1e-300:
                good = False
            total[m, 0], total[m, 1] = s
        if good:
            break
        if first:
            # the first nodes are those of the shifted rule; restart with the rule at multiples of
            # pi / n
            first = False
            ends = np.zeros((_SUMS, 2))
            for e in range(2):
                u = uh if e == 0 else ul
                v, w = (vh, wh) if e == 0 else (vl, wl)
                Q = Qh if e == 0 else Ql
                q = root(Q)
                inverse = div((1.0, 0.0), q)
                f1, f2 = mul(k, add(add((1.0, 0.0), u), S)), mul(k, sub(sub((1.0, 0.0), u), S))
                e1, e2 = div(f1, add(q, Q1)), div(f2, add(q, Q2))
                if narrow:
                    term = (0.0, 0.0)
                else:
                    term = add(q, times(add(mul(mul(vl, vh), e1), mul(mul(wl, wh), e2)), 0.5))
                add_to(ends, _PERIODS, times(inverse, 0.5))
                add_to(ends, _ADVANCES_PLUS, times(mul(e1, inverse), 0.5))
                add_to(ends, _ADVANCES_MINUS, times(mul(e2, inverse), 0.5))
                add_to(ends, _ACTIONS, times(term, 0.5))
            # shifted nodes with n are the odd multiples of pi / 2n: with the even ones the rule of
            # 2n
            for m in range(_SUMS):
                add_to(old, m, (ends[m, 0], ends[m, 1]))
            # still wanted: multiples of pi / n inside
            for j in range(1, n):
                sin, cos = sine_cosine(times(PI, j / (2.0 * n)))
                down = times(mul(half, mul(sin, sin)), 2.0)
                up = times(mul(half, mul(cos, cos)), 2.0)
                u = sub(uh, down) if abs(uh[0]) < abs(ul[0]) else add(ul, up)
                v, w = add(vh, down), add(wl, up)
                q = root(add(mul(add(mul(k, u), kS), u), q0))
                inverse = div((1.0, 0.0), q)
                f1, f2 = mul(k, add(add((1.0, 0.0), u), S)), mul(k, sub(sub((1.0, 0.0), u), S))
                e1, e2 = div(f1, add(q, Q1)), div(f2, add(q, Q2))
                if narrow:
                    term = div(mul(mul(down, up), q), mul(v, w))
                else:
                    term = add(q, times(add(mul(mul(vl, vh), e1), mul(mul(wl, wh), e2)), 0.5))
                add_to(old, _PERIODS, inverse)
                add_to(old, _ADVANCES_PLUS, mul(e1, inverse))
                add_to(old, _ADVANCES_MINUS, mul(e2, inverse))
                add_to(old, _ACTIONS, term)
            for m in range(_SUMS):
                total[m, 0], total[m, 1] = times((old[m, 0], old[m, 1]), 1.0 / (2 * n))
            n *= 4
        else:
            n *= 2
    up, down = (0.0, 0.0), (0.0, 0.0)
    if delta[0] != 0.0:
        up = mul(PI, add((1.0, 0.0), mul(r1, pair(total[_ADVANCES_PLUS], 0))))
        if delta[0] < 0.0:
            up = neg(up)
    if sigma[0] != 0.0:
        down = mul(PI, add((1.0, 0.0), mul(r2, pair(total[_ADVANCES_MINUS], 0))))
        if sigma[0] < 0.0:
            down = neg(down)
    keep(out, _SUM, mul(mul(PI, times(A, 2.0)), pair(total[_PERIODS], 0)))
    keep(out, _AT_PLUS, up)
    keep(out, _AT_MINUS, down)
    action = pair(total[_ACTIONS], 0)
    if not narrow:
        # - sqrt(vl vh) |delta| / 2 and likewise below: what the poles take
        x, y = (delta if delta[0] > 0 else neg(delta)), (sigma if sigma[0] > 0 else neg(sigma))
        action = sub(action, times(add(x, y), 0.5))
    keep(out, _ACTION, action)
    if not good:
        out[_SUM:_WELL] = np.nan


@inline
def between_ends(A, k, L, a, b, level, below, e, one, most):
    """As `well`, of the turning points (2, TURNING)."""
    ul, uh = pair(e[LOWER], U), pair(e[UPPER], U)
    vl, vh = pair(e[LOWER], TO_PLUS), pair(e[UPPER], TO_PLUS)
    wl, wh = pair(e[LOWER], TO_MINUS), pair(e[UPPER], TO_MINUS)
    well(A, k, L, a, b, level, below, ul, uh, vl, vh, wl, wh, one, most)


@inline
def prepared(k, L, a, b, level, below, c, low, high, u0, v0, w0, work, found, ends):
    """Roots of P (expanded about u0, whose 1 -+ u0 are v0, w0), into `ends` (n, TURNING); returns
    their number.
    """
    number = stationary(c, low, high, work, found)
    d, s = sub(b, a), add(b, a)
    for j in range(number):
        x = (found[j, 0], found[j, 1])
        u, v, w = add(u0, x), sub(v0, x), add(w0, x)
        # far nearer to a pole than the start: a root in v of P(1 - v) = -d^2 + 2 level v - (L + 5
        # k) v^2 ...
        if v[0] < 0.01 * v0[0]:
            v = at_pole(
                v, mul(d, d), times(level, 2.0), sub(neg(times(k, 5.0)), L), times(k, 4.0), neg(k)
            )
            w = sub((2.0, 0.0), v)
            u = sub((1.0, 0.0), v)
        elif w[0] < 0.01 * w0[0]:
            w = at_pole(
                w, mul(s, s), times(below, 2.0), sub(neg(times(k, 5.0)), L), times(k, 4.0), neg(k)
            )
            v = sub((2.0, 0.0), w)
            u = sub(w, (1.0, 0.0))
        keep(ends[j], U, u)
        keep(ends[j], TO_PLUS, v)
        keep(ends[j], TO_MINUS, w)
    return number


@inline
def doubts(A, k, L, a, b, c, low, high, u0, e, work, found, o):
    """What rounds of L of ROUNDS times the size of its terms do beside a separatrix (floats
    suffice), into columns PERIOD_DOUBT to FASTEST.

    A saddle is a minimum of P (as c, expanded about u0) with P = (1 - u^2) (L - L_sep)
    there.
    """
    rounds = ROUNDS * (abs(L) + 2.0 * abs(k) + a * a + b * b)
    slopes, square = np.zeros((5, 2)), np.zeros((4, 2))
    derived(c, slopes[:4])
    derived(slopes[:4], square)
    o[PERIOD_DOUBT] = o[FASTEST] = 0.0
    number = stationary(slopes, low, high, work, found)
    for j in range(number):
        x = (found[j, 0], found[j, 1])
        u = add(u0, x)[0]
        if value(square, x)[0] > 0.0 and abs(u) < 1.0:
            height = abs(value(c, x)[0]) + 1e-300
            size = 0.0
            for n in range(4, -1, -1):
                size = size * abs(x[0]) + abs(c[n, 0])
            o[PERIOD_DOUBT] = max(
                o[PERIOD_DOUBT], rounds * (1.0 - u * u) / height, 10.0 * ROUNDS * size / height
            )
            o[FASTEST] = max(o[FASTEST], (abs(b - a * u) + abs(a - b * u)) / (1.0 - u * u) / A)
    for side in (LOWER, UPPER):
        u = e[side, U]
        x = sub(pair(e[side], U), u0)
        o[U_MIN_DOUBT if side == LOWER else U_MAX_DOUBT] = (
            rounds * (1.0 - u * u) / abs(value(slopes[:4], x)[0])
        )


@kernel
def states(points, most, out):
    """points (N, STATE): SIZE_A to P_PHI of `records`; out (N, COLUMNS)."""
    work = (np.empty((5, 2)), np.empty((5, 2)), np.empty((5, 2)))
    found = np.empty((8, 2))
    ends = np.empty((8, TURNING))
    c = np.empty((5, 2))
    one = np.empty(_WELL)
    for i in range(len(points)):
        q, o = points[i], out[i]
        o[:] = np.nan
        A, C, eps = (q[nu.SIZE_A], 0.0), (q[nu.SIZE_C], 0.0), (q[nu.EPSILON], 0.0)
        theta = q[nu.THETA]
        p, b, a = (q[nu.P_THETA], 0.0), (q[nu.P_PSI], 0.0), (q[nu.P_PHI], 0.0)
        k = mul(mul(eps, A), sub(A, C))
        sin, cos = sine_cosine((theta, 0.0))
        hs, hc = sine_cosine((0.5 * theta, 0.0))
        v0, w0 = times(mul(hs, hs), 2.0), times(mul(hc, hc), 2.0)
        if theta < 1.5:
            num = add(sub(b, a), mul(a, v0))
        else:
            num = sub(add(b, a), mul(a, w0))
        X = (0.0, 0.0)
        if sin[0] != 0.0:
            X = div(num, sin)
        if theta == 0.0:
            X = (0.0, 0.0)
        energy = add(mul(p, p), mul(X, X))
        sin2 = mul(sin, sin)
        L = add(sub(energy, mul(k, mul(cos, cos))), mul(a, a))
        level = add(add(energy, mul(k, sin2)), mul(a, sub(a, b)))
        below = add(add(energy, mul(k, sin2)), mul(a, add(a, b)))
        c[0] = mul(mul(p, p), sin2)
        c[1] = add(
            sub(times(mul(a, mul(X, sin)), 2.0), times(mul(cos, energy), 2.0)),
            times(mul(mul(k, cos), sin2), 2.0),
        )
        c[2] = sub(sub(k, L), times(mul(k, mul(cos, cos)), 6.0))
        c[3] = times(mul(k, cos), -4.0)
        c[4] = neg(k)
        low, high = neg(w0), v0
        number = prepared(k, L, a, b, level, below, c, low, high, cos, v0, w0, work, found, ends)
        # the roots next to the start: below and above
        lower, upper = -1, -1
        for j in range(number):
            x = found[j, 0]
            here = abs(x) < 1e-26
            if x < 0.0 and not here:
                lower = j
            elif not here and upper < 0:
                upper = j
            if here:
                if c[1, 0] > 0.0:
                    lower = j
                elif upper < 0:
                    upper = j
        if (
            number < 1
            or (lower < 0 and b[0] != -a[0])
            or (upper < 0 and b[0] != a[0])
            or (p[0] == 0.0)
        ):
            size = abs(energy[0]) + abs(k[0]) + a[0] * a[0] + b[0] * b[0]
            if p[0] != 0.0 or abs(c[1, 0]) <= 1e-30 * size:
                continue
            slope = level[0] if b[0] == a[0] else below[0]
            # two roots beside a pole look like one
            if abs(b[0]) == abs(a[0]) and abs(slope) <= 1e-12 * size:
                continue
            # at rest: the start is a root itself, exactly
            if c[1, 0] > 0.0:
                lower = -2
                for j in range(number - 1, -1, -1):
                    if found[j, 0] > 1e-26:
                        upper = j
            else:
                upper = -2
                for j in range(number):
                    if found[j, 0] < -1e-26:
                        lower = j
        e = np.empty((2, TURNING))
        for side in (LOWER, UPPER):
            j = lower if side == LOWER else upper
            if j == -2:
                keep(e[side], U, cos)
                keep(e[side], TO_PLUS, v0)
                keep(e[side], TO_MINUS, w0)
            elif j == -1:  # the pole itself
                keep(e[side], U, (-1.0, 0.0) if side == LOWER else (1.0, 0.0))
                keep(e[side], TO_PLUS, (2.0, 0.0) if side == LOWER else (0.0, 0.0))
                keep(e[side], TO_MINUS, (0.0, 0.0) if side == LOWER else (2.0, 0.0))
                # P < 0 next to it: the motion turns before
                if (below[0] if side == LOWER else level[0]) < 0.0:
                    beside_pole(side, k, L, below if side == LOWER else level, e[side])
            else:
                e[side] = ends[j]
        if e[UPPER, U] - e[LOWER, U] <= 1e-12:
            continue
        one[:] = np.nan
        between_ends(A, k, L, a, b, level, below, e, one, most)
        drift = mul(a, div(sub(A, C), mul(A, C)))
        fill(o, e, one, drift)
        doubts(A[0], k[0], L[0] + energy[0], a[0], b[0], c, low, high, cos, e, work, found, o)


@inline
def fill(o, e, one, drift):
    """Columns U_MIN to APART."""
    keep(o, U_MIN, pair(e[LOWER], U))
    keep(o, U_MAX, pair(e[UPPER], U))
    T, up, down = pair(one, _MEAN), pair(one, _AT_PLUS), pair(one, _AT_MINUS)
    keep(o, PERIOD, T)
    keep(o, PRECESSION, add(up, down))
    keep(o, SPIN, add(mul(drift, T), sub(down, up)))
    keep(o, ACTION, pair(one, _ACTION))
    o[APART] = sub(pair(one, _SUM), T)[0] / T[0]


@kernel
def integrals(points, sign, ratio, most, out):
    """points (N, INTEGRALS): ENERGY, ALPHA, BETA of `records`; out (N, 2, COLUMNS): of each well, lower u first."""
    work = (np.empty((5, 2)), np.empty((5, 2)), np.empty((5, 2)))
    marks = np.empty((8, 2))
    found = np.empty((8, 2))
    ends = np.empty((8, TURNING))
    c = np.empty((5, 2))
    one = np.empty(_WELL)
    for i in range(len(points)):
        q, o = points[i], out[i]
        o[:] = np.nan
        k, L = (sign, 0.0), (q[nu.ENERGY], 0.0)
        a, b = (q[nu.ALPHA], 0.0), (q[nu.BETA], 0.0)
        level, below = sub(add(L, k), mul(a, b)), add(add(L, k), mul(a, b))
        c[0] = sub(sub(L, mul(a, a)), mul(b, b))
        c[1] = times(mul(a, b), 2.0)
        c[2], c[3], c[4] = sub(k, L), (0.0, 0.0), neg(k)
        number = prepared(
            k,
            L,
            a,
            b,
            level,
            below,
            c,
            (-1.0, 0.0),
            (1.0, 0.0),
            (0.0, 0.0),
            (1.0, 0.0),
            (1.0, 0.0),
            work,
            found,
            ends,
        )
        if abs(q[nu.ALPHA]) == abs(q[nu.BETA]):
            continue
        drift = times(mul(a, sub((1.0, 0.0), (ratio, 0.0))), 1.0)
        drift = div(drift, (ratio, 0.0))
        at = 0
        for j in range(number - 1):
            mid = times(add((found[j, 0], found[j, 1]), (found[j + 1, 0], found[j + 1, 1])), 0.5)
            if value(c, mid)[0] > 0.0 and at < 2:
                e = ends[j : j + 2]
                one[:] = np.nan
                if e[UPPER, U] - e[LOWER, U] > 1e-12:
                    between_ends((1.0, 0.0), k, L, a, b, level, below, e, one, most)
                    fill(o[at], e, one, drift)
                    zero = (0.0, 0.0)
                    doubts(
                        1.0,
                        k[0],
                        L[0],
                        a[0],
                        b[0],
                        c,
                        (-1.0, 0.0),
                        (1.0, 0.0),
                        zero,
                        e,
                        work,
                        marks,
                        o[at],
                    )
                at += 1
