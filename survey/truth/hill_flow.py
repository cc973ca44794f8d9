"""Hill's equation in the double-double arithmetic of this folder, in another form than the
package's.

Satellites: w = k cn u (or k dn k u) solves Duffing's equation w'' = (2 k^2 - 1) w - 2 w^3. It is
solved from the place where w is least, so that its relative error does not grow however near k is
to 1, and both solutions with it; the rest of the half period follows from rho -> -rho there. Taylor
series of order 30, in steps of their own length.
"""

import numpy as np

from survey.truth.compiled import inline, kernel
from survey.truth.double import (
    HALF_PI_PARTS,
    add,
    conv,
    div,
    get,
    horner,
    keep,
    mean,
    mul,
    neg,
    pair,
    reach,
    root,
    sine_cosine,
    slope,
    store,
    sub,
    times,
)  # fmt: skip

TERMS = 31
TINY = 1e-34
MOST = 60_000  # steps

# What is filled: at the end y1, y2, y1', y2' and its place, each in two columns, high and low; the
# doubt of the four, and steps.
Y1, Y2, DY1, DY2, END = range(0, 10, 2)
DOUBT, STEPS = 10, 11
COLUMNS = 12
# A solution, each in two columns: its value and slope.
_VALUE, _SLOPE = 0, 2

K, ONE_MINUS_K, AMPLITUDE = 0, 1, 2
RHO, INERTIA = 0, 1


@inline
def modulus(which, given):
    """k and |1 - k^2| as double-doubles."""
    if which == AMPLITUDE:
        k, kc = sine_cosine((given, 0.0))
        if given > 1.0:  # cos = sin(pi/2 - given), so that none of its digits is lost
            left = sub(
                sub((HALF_PI_PARTS[0] - given, 0.0), (-HALF_PI_PARTS[1], 0.0)),
                (-HALF_PI_PARTS[2], 0.0),
            )
            kc, k = sine_cosine(left)
        return k, mul(kc, kc)
    short = (given, 0.0) if which == ONE_MINUS_K else sub((1.0, 0.0), (given, 0.0))
    k = sub((1.0, 0.0), short)
    square = mul(short, add((1.0, 0.0), k))
    return k, square if square[0] > 0 else neg(square)


@inline
def rate(which, given, direction):
    """rho as a double-double, and whether the body is oblate."""
    if which == RHO:
        return (given, 0.0), False
    short = sub((1.0, 0.0), (given, 0.0))
    size = short if short[0] > 0 else neg(short)
    rho = div((direction, 0.0), root(times(size, 3.0)))
    return rho, given > 1.0


@kernel
def satellites(which, given, rhowhich, rhogiven, direction, oblate, tolerance, out):
    """Half-period factors of points, and T/2: out (N, COLUMNS)."""
    w = np.zeros((2, TERMS))
    w2 = np.zeros((2, TERMS))
    w3 = np.zeros((2, TERMS))
    z = np.zeros((2, TERMS))
    y = np.zeros((4, 2, TERMS))
    state = np.zeros((4, 4))
    for i in range(len(given)):
        k, kc2 = modulus(which, given[i])
        rho, ob = rate(rhowhich, rhogiven[i], direction)
        if rhowhich == RHO:
            ob = oblate
        rotates = (
            (given[i] < 0.0) if which == ONE_MINUS_K else (given[i] > 1.0 if which == K else False)
        )
        scale = k[0] if k[0] > 1.0 else 1.0
        # everything in units of `scale` (a float: its division is exact to double-double)
        kk, ro = div(k, (scale, 0.0)), div(rho, (scale, 0.0))
        kk2 = mul(kk, kk)
        kc2s = div(div(kc2, (scale, 0.0)), (scale, 0.0))
        if rotates:
            c = neg(kc2s)
            least, dleast = root(kc2s), (0.0, 0.0)
            alpha = add(kk2, kc2s)  # 2 k^2 - 1 = k^2 + (k^2 - 1)
            # T/2 = K(1/k)/k = pi / 2 / agm(k, sqrt(k^2 - 1))
            length = div(div((HALF_PI_PARTS[0], HALF_PI_PARTS[1]), mean(kk, least)), (1.0, 0.0))
        else:
            c = kc2s
            least, dleast = (0.0, 0.0), mul(kk, root(kc2s))
            alpha = sub(kk2, kc2s)
            length = div((HALF_PI_PARTS[0], HALF_PI_PARTS[1]), mean((1.0, 0.0), root(kc2s)))
        if ob:
            c = neg(kk2)
        constant = add(mul(ro, ro), c)
        signs = 1 if rotates else 2
        for n in range(4):
            for m in range(4):
                state[n, m] = 0.0
        state[0, _VALUE] = state[1, _SLOPE] = state[2, _VALUE] = state[3, _SLOPE] = 1.0
        w0, v0 = least, dleast
        left = length
        steps = 0
        biggest = 1.0
        while left[0] > 0.0 and steps < MOST:
            steps += 1
            store(w, 0, w0)
            store(w, 1, v0)
            for n in range(TERMS):
                store(w2, n, conv(w, w, n))
                store(w3, n, conv(w2, w, n))
                if n + 2 < TERMS:
                    store(
                        w,
                        n + 2,
                        div(
                            sub(mul(alpha, get(w, n)), times(get(w3, n), 2.0)),
                            ((n + 1.0) * (n + 2.0), 0.0),
                        ),
                    )
            h = reach(w, abs(w0[0]) + 0.3 * abs(v0[0]), tolerance) if kk[0] > 1e-30 else 1e30
            for side in range(signs):
                both = times(ro, 2.0 if side == 0 else -2.0)
                for n in range(TERMS):
                    store(z, n, add(times(get(w2, n), 2.0), mul(both, get(w, n))))
                store(z, 0, add(get(z, 0), constant))
                for s in range(2):
                    q = y[2 * side + s]
                    x = state[2 * side + s]
                    store(q, 0, pair(x, _VALUE))
                    store(q, 1, pair(x, _SLOPE))
                    for n in range(TERMS - 2):
                        store(q, n + 2, div(neg(conv(z, q, n)), ((n + 1.0) * (n + 2.0), 0.0)))
                    size = abs(x[_VALUE]) + abs(x[_SLOPE]) / (1.0 + abs(ro[0]))
                    h = min(h, reach(q, size, tolerance))
            last = h >= left[0]
            step = left if last else (h, 0.0)
            for s in range(2 * signs):
                x = state[s]
                a, b = horner(y[s], step), slope(y[s], step)
                keep(x, _VALUE, a)
                keep(x, _SLOPE, b)
                biggest = max(biggest, abs(a[0]), abs(b[0]))
            w0, v0 = horner(w, step), slope(w, step)
            left = (0.0, 0.0) if last else sub(left, (h, 0.0))
        o = out[i]
        # Phi(0 -> quarter) from the solutions s forward: (y1, y2; y1', y2') = (s22, s12; s21, s11)
        p, r = pair(state[0], _VALUE), pair(state[0], _SLOPE)
        q, s = pair(state[1], _VALUE), pair(state[1], _SLOPE)
        y1, y2, d1, d2 = s, q, r, p
        if not rotates:
            a, e = pair(state[2], _VALUE), pair(state[2], _SLOPE)
            b, f = pair(state[3], _VALUE), pair(state[3], _SLOPE)
            y1, y2, d1, d2 = (
                add(mul(a, y1), mul(b, d1)), add(mul(a, y2), mul(b, d2)),
                add(mul(e, y1), mul(f, d1)), add(mul(e, y2), mul(f, d2)),
            )  # fmt: skip
            length = times(length, 2.0)
        keep(o, Y1, y1)
        keep(o, Y2, div(y2, (scale, 0.0)))
        keep(o, DY1, times(d1, scale))
        keep(o, DY2, d2)
        keep(o, END, div(length, (scale, 0.0)))
        # rounding of all steps, of T and of w: what the flow makes of it is bounded by its largest
        # entries
        o[DOUBT] = 1e-29 * (1.0 + steps) * biggest * biggest * (1.0 + abs(ro[0]) * length[0])
        o[STEPS] = float(steps)
        if steps >= MOST:
            o[:] = np.nan


COSINE, HARMONICS, BENT, LORENTZ = 0, 1, 2, 3
TWO_PI = 6.283185307179586  # as it stands in a user's z
# Where a point of HARMONICS holds its four cosines, its four sines and the period.
_COSINES, _SINES, _PERIOD = 1, 5, 9


@inline
def wave(z, sin, cos, rate, a, b):
    """Add a cos(rate u) + b sin(rate u) to the series z about a place where their sine and cosine
    are these.
    """
    f = add(times(cos, a), times(sin, b))
    g = sub(times(cos, b), times(sin, a))
    for n in range(TERMS):
        store(z, n, add(get(z, n), f))
        f, g = div(mul(g, rate), (n + 1.0, 0.0)), div(mul(f, neg(rate)), (n + 1.0, 0.0))


@inline
def own_series(kind, p, u, z, piece):
    """Series of z about u (a double-double); `piece` is 1 behind the break."""
    for n in range(TERMS):
        store(z, n, (0.0, 0.0))
    if kind == COSINE:  # a + b cos 2u + c cos 4u
        for n in range(2):
            if p[1 + n] != 0.0:
                sin, cos = sine_cosine(times(u, 2.0 * (n + 1)))
                wave(z, sin, cos, (2.0 * (n + 1), 0.0), p[1 + n], 0.0)
        store(z, 0, add(get(z, 0), (p[0], 0.0)))
    elif kind == HARMONICS:  # a + sum of c_n cos n x + s_n sin n x, x = 2 pi u / T
        base = div((TWO_PI, 0.0), (p[_PERIOD], 0.0))
        for n in range(4):
            if p[_COSINES + n] != 0.0 or p[_SINES + n] != 0.0:
                rate = times(base, n + 1.0)
                sin, cos = sine_cosine(mul(rate, u))
                wave(z, sin, cos, rate, p[_COSINES + n], p[_SINES + n])
        store(z, 0, add(get(z, 0), (p[0], 0.0)))
    elif kind == BENT:  # a + b u before the break, c + d cos 6u behind it
        if piece == 0:
            store(z, 0, add((p[0], 0.0), times(u, p[1])))
            store(z, 1, (p[1], 0.0))
        else:
            sin, cos = sine_cosine(times(u, 6.0))
            wave(z, sin, cos, (6.0, 0.0), p[3], 0.0)
            store(z, 0, add(get(z, 0), (p[2], 0.0)))
    else:
        # p[0] + p[1] / (1 + x^2), x = (u - p[2]) / p[3]
        x = div(sub(u, (p[2], 0.0)), (p[3], 0.0))
        inverse = div((1.0, 0.0), (p[3], 0.0))
        ahead = times(mul(x, inverse), 2.0)
        square = mul(inverse, inverse)
        squared = add(mul(x, x), (1.0, 0.0))
        store(z, 0, div((p[1], 0.0), squared))
        for n in range(1, TERMS):
            s = mul(ahead, get(z, n - 1))
            if n > 1:
                s = add(s, mul(square, get(z, n - 2)))
            store(z, n, div(neg(s), squared))
        store(z, 0, add(get(z, 0), (p[0], 0.0)))


@kernel
def own_points(kind, points, ends, lengths, tolerance, out):
    """y1, y2, y1', y2' at the end of [0, length] of points (N, n): out (N, COLUMNS); `ends` (N) are
    breaks.

    `lengths` (N, 2) are double-doubles.
    """
    z, q = np.zeros((2, TERMS)), np.zeros((2, 2, TERMS))
    x = np.zeros((2, 4))
    for i in range(len(points)):
        p, o = points[i], out[i]
        length = lengths[i, 0], lengths[i, 1]
        size = abs(p[0]) + abs(p[1])
        for n in range(
            2, 4 if kind == BENT else (9 if kind == HARMONICS else (3 if kind == COSINE else 2))
        ):
            size += abs(p[n])
        x[:] = 0.0
        x[0, _VALUE] = x[1, _SLOPE] = 1.0
        u = (0.0, 0.0)
        steps, biggest = 0, 1.0
        for piece in range(2):
            end = length
            if piece == 0 and ends[i] < length[0]:
                end = (ends[i], 0.0)
            left = sub(end, u)
            while left[0] > 0.0 and steps < MOST:
                steps += 1
                own_series(kind, p, u, z, piece)
                h = reach(z, 1e-25 + size, tolerance)
                for s in range(2):
                    store(q[s], 0, pair(x[s], _VALUE))
                    store(q[s], 1, pair(x[s], _SLOPE))
                    for n in range(TERMS - 2):
                        store(q[s], n + 2, div(neg(conv(z, q[s], n)), ((n + 1.0) * (n + 2.0), 0.0)))
                    near = abs(x[s, _VALUE]) + abs(x[s, _SLOPE]) / (1.0 + np.sqrt(size))
                    h = min(h, reach(q[s], near, tolerance))
                last = h >= left[0]
                step = left if last else (h, 0.0)
                for s in range(2):
                    a, b = horner(q[s], step), slope(q[s], step)
                    keep(x[s], _VALUE, a)
                    keep(x[s], _SLOPE, b)
                    biggest = max(biggest, abs(a[0]), abs(b[0]))
                u = end if last else add(u, (h, 0.0))
                left = (0.0, 0.0) if last else sub(left, (h, 0.0))
        keep(o, Y1, pair(x[0], _VALUE))
        keep(o, Y2, pair(x[1], _VALUE))
        keep(o, DY1, pair(x[0], _SLOPE))
        keep(o, DY2, pair(x[1], _SLOPE))
        keep(o, END, length)
        o[DOUBT] = 1e-29 * (1.0 + steps) * biggest * biggest * (1.0 + np.sqrt(size) * length[0])
        o[STEPS] = float(steps)
        if steps >= MOST:
            o[:] = np.nan


@kernel
def rough(k, short, rho, oblate, use, out):
    """Zeros of a solution in PERIODS periods, over twice their number."""
    for i in range(len(k)):
        if not use[i]:
            out[i] = np.nan
            continue
        kk = k[i]
        kc = np.sqrt(abs(short[i]) * (1.0 + kk))
        rotates = short[i] < 0.0
        a, b = (kk if rotates else 1.0), kc
        for _ in range(40):
            a, b = 0.5 * (a + b), np.sqrt(a * b)
        quarter = np.pi / 2 / a
        n = int(16 + 10 * quarter * (abs(rho[i]) + kk + 1.0))
        if n > 20000:
            out[i] = np.nan
            continue
        h = quarter / (2 * n)
        w = np.empty(2 * n + 1)
        x, v = (kc, 0.0) if rotates else (0.0, kk * kc)
        alpha = 2 * kk * kk - 1.0
        w[0] = x
        for j in range(2 * n):  # Runge-Kutta
            a1, b1 = v, alpha * x - 2 * x * x * x
            y = x + h / 2 * a1
            a2, b2 = v + h / 2 * b1, alpha * y - 2 * y * y * y
            y = x + h / 2 * a2
            a3, b3 = v + h / 2 * b2, alpha * y - 2 * y * y * y
            y = x + h * a3
            a4, b4 = v + h * b3, alpha * y - 2 * y * y * y
            x += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
            v += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
            w[j + 1] = x
        c = -kk * kk if oblate[i] else short[i] * (1.0 + kk)
        pieces = 2 if rotates else 4
        m = np.empty((pieces * n, 4))
        step = 2 * h
        for j in range(pieces * n):
            z = np.empty(3)
            for s in range(3):
                at = 2 * j + s
                piece = min(at // (2 * n), pieces - 1)
                inner = at - piece * 2 * n
                back = piece % 2 == 0  # from the greatest |w| to the least
                value = w[2 * n - inner] if back else w[inner]
                if not rotates and piece in (1, 2):
                    value = -value
                z[s] = 2 * value * value + 2 * rho[i] * value + rho[i] * rho[i] + c
            for col in range(2):
                y, d = (1.0, 0.0) if col == 0 else (0.0, 1.0)
                a1, b1 = d, -z[0] * y
                a2, b2 = d + step / 2 * b1, -z[1] * (y + step / 2 * a1)
                a3, b3 = d + step / 2 * b2, -z[1] * (y + step / 2 * a2)
                a4, b4 = d + step * b3, -z[2] * (y + step * a3)
                m[j, 2 * col] = y + step / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
                m[j, 2 * col + 1] = d + step / 6 * (b1 + 2 * b2 + 2 * b3 + b4)
        y, d, zeros = 1.0, 0.1, 0
        for _ in range(20):
            for j in range(pieces * n):
                new = m[j, 0] * y + m[j, 2] * d
                d = m[j, 1] * y + m[j, 3] * d
                zeros += 1 if (new < 0) != (y < 0) else 0
                y = new
            size = abs(y) + abs(d)
            y, d = y / size, d / size
        out[i] = zeros / 40.0
