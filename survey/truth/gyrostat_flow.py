"""phi' = w, w' = f w + g in the double-double arithmetic of this folder: Taylor series in time, of
order 26.

`flow` goes to a time and counts the turning points on its way; `along` goes to an angle, or to the
turning point before it. Parameters are scaled by powers of two, exactly (symmetry S5), so that no
series overflows.
"""

import numpy as np

from survey.truth.compiled import inline, kernel
from survey.truth.double import (
    add,
    conv,
    div,
    get,
    horner,
    neg,
    reach,
    sine_cosine,
    slope,
    store,
    sub,
    times,
)

TERMS = 27
TINY = 1e-32
MOST = 20_000
PHI, W, SIN, COS, F, SC, CC = range(7)


@inline
def expand(p, y, phi, w):
    """Series of everything at a state."""
    sin, cos = sine_cosine(phi)
    store(y[PHI], 0, phi)
    store(y[W], 0, w)
    store(y[SIN], 0, sin)
    store(y[COS], 0, cos)
    for n in range(TERMS - 1):
        s, c = get(y[SIN], n), get(y[COS], n)
        store(y[F], n, sub(times(c, p[0]), times(s, p[1])))
        store(y[CC], n, conv(y[COS], y[COS], n))
        g = neg(times(conv(y[SIN], y[COS], n), p[2]))
        g = sub(g, times(get(y[CC], n), 2.0 * p[3]))
        if n == 0:
            g = add(g, (p[3], 0.0))
        g = add(g, sub(times(c, p[4]), times(s, p[5])))
        by = (n + 1.0, 0.0)
        store(y[PHI], n + 1, div(get(y[W], n), by))
        store(y[W], n + 1, div(add(conv(y[F], y[W], n), g), by))
        store(y[SIN], n + 1, div(conv(y[COS], y[W], n), by))
        store(y[COS], n + 1, div(neg(conv(y[SIN], y[W], n)), by))


@inline
def sizes(p, w):
    """A power of two near the largest rate."""
    g = max(abs(p[2]), abs(p[3]), abs(p[4]), abs(p[5]))
    rate = max(abs(p[0]), abs(p[1]), np.sqrt(g), abs(w), 1e-290)
    return 2.0 ** np.floor(np.log2(rate))


@inline
def scaled(given, row, k):
    row[0], row[1] = given[0] / k, given[1] / k
    for j in range(2, 6):
        row[j] = given[j] / k / k


@inline
def pace(y, tolerance):
    """The next step."""
    h = reach(y[SIN], 1.0, tolerance)
    h = min(h, reach(y[COS], 1.0, tolerance))
    return min(h, reach(y[W], 1.0 + abs(y[W, 0, 0]), tolerance))


@kernel
def flow(points, tolerance, out):
    """points (N, 9): b12 .. s3, phi0, w0, t. out (N, 6): phi, w (high, low), turnings or -1 in
    doubt, steps.
    """
    y, p = np.zeros((7, 2, TERMS)), np.zeros(6)
    for i in range(len(points)):
        row, o = points[i], out[i]
        k = sizes(row, row[7])
        scaled(row, p, k)
        phi, w = (row[6], 0.0), (row[7] / k, 0.0)
        left = (row[8] * k, 0.0)
        back = left[0] < 0.0
        if back:  # S1
            p[0], p[1] = -p[0], -p[1]
            left, w = neg(left), neg(w)
        steps, turns, doubtful = 0, 0, False
        sign = 0.0 if w[0] == 0.0 else np.sign(w[0])
        while left[0] > 0.0 and steps < MOST:
            steps += 1
            expand(p, y, phi, w)
            h = pace(y, tolerance)
            last = h >= left[0]
            step = left if last else (h, 0.0)
            before = w[0]
            for j in range(1, 5):
                here = horner(y[W], times(step, 0.25 * j))[0]
                if here != 0.0 and sign == 0.0:
                    sign = np.sign(here)
                elif here * sign < 0.0:
                    turns += 1
                    sign = -sign
                elif here == 0.0 or abs(here) < 1e-9 * max(abs(before), 1e-9):
                    doubtful = True
                before = here
            phi, w = horner(y[PHI], step), horner(y[W], step)
            left = (0.0, 0.0) if last else sub(left, (h, 0.0))
        w = times(w, -k if back else k)
        o[0], o[1] = phi
        o[2], o[3] = w
        o[4] = -1.0 if doubtful else float(turns)
        o[5] = float(steps)
        if steps >= MOST:
            o[:] = np.nan


@inline
def zero(series, goal, low, high):
    """Where a series takes a value between low and high (floats): bisection, then Newton in double-double."""
    at_low = sub(horner(series, (low, 0.0)), goal)[0]
    for _ in range(40):
        mid = 0.5 * (low + high)
        here = sub(horner(series, (mid, 0.0)), goal)[0]
        if here * at_low > 0.0 or (at_low == 0.0 and here != 0.0):
            low = mid
        else:
            high = mid
    x = (0.5 * (low + high), 0.0)
    for _ in range(4):
        x = sub(x, div(sub(horner(series, x), goal), slope(series, x)))
    return x


@kernel
def along(points, tolerance, out):
    """points (N, 9): b12 .. s3, phi0, w0, phi. out (N, 6): w, t (high, low), 0, or phi, t of
    turning, 1; steps.
    """
    y, p = np.zeros((7, 2, TERMS)), np.zeros(6)
    for i in range(len(points)):
        row, o = points[i], out[i]
        o[:] = np.nan
        k = sizes(row, row[7])
        scaled(row, p, k)
        phi, w, goal = (row[6], 0.0), (row[7] / k, 0.0), (row[8], 0.0)
        if w[0] == 0.0 or row[8] == row[6]:
            continue
        ahead = 1.0 if row[8] > row[6] else -1.0
        back = ahead * w[0] < 0.0
        if back:  # S1
            p[0], p[1] = -p[0], -p[1]
            w = neg(w)
        t = (0.0, 0.0)
        for steps in range(3000):
            expand(p, y, phi, w)
            h = pace(y, tolerance)
            end, turned = h, False
            for j in range(1, 5):
                if horner(y[W], (0.25 * j * h, 0.0))[0] * ahead <= 0.0:
                    end, turned = 0.25 * j * h, True
                    break
            stop = (end, 0.0)
            if turned:
                stop = zero(y[W], (0.0, 0.0), 0.25 * (j - 1) * h, end)
            there = horner(y[PHI], stop)
            if sub(there, goal)[0] * ahead >= 0.0:
                x = zero(y[PHI], goal, 0.0, stop[0])
                value, t = horner(y[W], x), add(t, x)
                o[4] = 0.0
            elif turned:
                value, t = there, add(t, stop)
                o[4] = 1.0
            else:
                phi, w, t = there, horner(y[W], stop), add(t, (h, 0.0))
                if abs(w[0]) < 1e-10:  # at rest, or nearly: an equilibrium lies ahead
                    break
                continue
            scale = k if o[4] == 0.0 else 1.0
            if back and o[4] == 0.0:
                scale = -scale
            o[0], o[1] = times(value, scale)
            o[2], o[3] = div(times(t, -1.0 if back else 1.0), (k, 0.0))
            o[5] = float(steps)
            break


@kernel
def settle(points, section, span, tolerance, out):
    """points (N, 8) without a time, for `span` in units of the fastest rate; velocities are over
    that rate.

    out (N, 8): phi, w at the end, w at the last two passages of `section`, phi at the last two
    right turning points, the rate, and 1 if all was done.
    """
    y, p = np.zeros((7, 2, TERMS)), np.zeros(6)
    for i in range(len(points)):
        row, o = points[i], out[i]
        o[:] = np.nan
        k = sizes(row, row[7])
        scaled(row, p, k)
        phi, w = (row[6], 0.0), (row[7] / k, 0.0)
        t = 0.0
        for _ in range(4000):
            expand(p, y, phi, w)
            h = pace(y, tolerance)
            there = horner(y[PHI], (h, 0.0))
            speed = horner(y[W], (h, 0.0))
            a, b = (phi[0] - section[i]) / (2 * np.pi), (there[0] - section[i]) / (2 * np.pi)
            if np.floor(a) != np.floor(b) and w[0] * speed[0] > 0.0:
                goal = section[i] + 2 * np.pi * (np.floor(b) if b > a else np.floor(a))
                x = zero(y[PHI], (goal, 0.0), 0.0, h)
                o[3], o[2] = o[2], horner(y[W], x)[0]
            if w[0] > 0.0 and speed[0] <= 0.0:
                x = zero(y[W], (0.0, 0.0), 0.0, h)
                o[5], o[4] = o[4], horner(y[PHI], x)[0]
            phi, w = there, speed
            t += h
            if t > span or abs(w[0]) > 1e6 or (abs(w[0]) < 1e-14 and h > span):
                o[7] = 1.0
                break
        o[0], o[1], o[6] = phi[0], w[0], k
