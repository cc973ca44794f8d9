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
    keep,
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
# A point: the six parameters, where the motion starts, and t or phi to go to.
B12, B31, D, C23, S2, S3, PHI0, W0, GOAL = range(9)
SIX = 6
# The series.
PHI, W, SIN, COS, F, SC, CC = range(7)
SERIES = 7
# At a time: phi and w, each in two columns, high and low; turning points, or -1 in doubt; steps.
END_PHI, END_W = 0, 2
TURNINGS, STEPS = 4, 5
# At an angle: w and t, or where TURNED is 1 phi and t of the turning point before it, each in two
# columns; then steps.
VALUE, TIME = 0, 2
TURNED = 4
COLUMNS = 6
# After a long time: phi and w; w at the last passage of the section and at the one before; phi at
# the last right turning point and at the one before; the fastest rate; 1 if all was done.
LAST_PHI, LAST_W, PASSAGE, PASSAGE_BEFORE, RIGHT, RIGHT_BEFORE, RATE, DONE = range(8)
SETTLED = 8


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
        store(y[F], n, sub(times(c, p[B12]), times(s, p[B31])))
        store(y[CC], n, conv(y[COS], y[COS], n))
        g = neg(times(conv(y[SIN], y[COS], n), p[D]))
        g = sub(g, times(get(y[CC], n), 2.0 * p[C23]))
        if n == 0:
            g = add(g, (p[C23], 0.0))
        g = add(g, sub(times(c, p[S2]), times(s, p[S3])))
        by = (n + 1.0, 0.0)
        store(y[PHI], n + 1, div(get(y[W], n), by))
        store(y[W], n + 1, div(add(conv(y[F], y[W], n), g), by))
        store(y[SIN], n + 1, div(conv(y[COS], y[W], n), by))
        store(y[COS], n + 1, div(neg(conv(y[SIN], y[W], n)), by))


@inline
def sizes(p, w):
    """A power of two near the largest rate."""
    g = max(abs(p[D]), abs(p[C23]), abs(p[S2]), abs(p[S3]))
    rate = max(abs(p[B12]), abs(p[B31]), np.sqrt(g), abs(w), 1e-290)
    return 2.0 ** np.floor(np.log2(rate))


@inline
def scaled(given, row, k):
    row[B12], row[B31] = given[B12] / k, given[B31] / k
    for j in range(D, SIX):
        row[j] = given[j] / k / k


@inline
def pace(y, tolerance):
    """The next step."""
    h = reach(y[SIN], 1.0, tolerance)
    h = min(h, reach(y[COS], 1.0, tolerance))
    return min(h, reach(y[W], 1.0 + abs(y[W, 0, 0]), tolerance))


@kernel
def flow(points, tolerance, out):
    """points (N, 9): B12 to GOAL, a time; out (N, COLUMNS): END_PHI to STEPS."""
    y, p = np.zeros((SERIES, 2, TERMS)), np.zeros(SIX)
    for i in range(len(points)):
        row, o = points[i], out[i]
        k = sizes(row, row[W0])
        scaled(row, p, k)
        phi, w = (row[PHI0], 0.0), (row[W0] / k, 0.0)
        left = (row[GOAL] * k, 0.0)
        back = left[0] < 0.0
        if back:  # S1
            p[B12], p[B31] = -p[B12], -p[B31]
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
        keep(o, END_PHI, phi)
        keep(o, END_W, w)
        o[TURNINGS] = -1.0 if doubtful else float(turns)
        o[STEPS] = float(steps)
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
    """points (N, 9): B12 to GOAL, an angle; out (N, COLUMNS): VALUE to STEPS."""
    y, p = np.zeros((SERIES, 2, TERMS)), np.zeros(SIX)
    for i in range(len(points)):
        row, o = points[i], out[i]
        o[:] = np.nan
        k = sizes(row, row[W0])
        scaled(row, p, k)
        phi, w, goal = (row[PHI0], 0.0), (row[W0] / k, 0.0), (row[GOAL], 0.0)
        if w[0] == 0.0 or row[GOAL] == row[PHI0]:
            continue
        ahead = 1.0 if row[GOAL] > row[PHI0] else -1.0
        back = ahead * w[0] < 0.0
        if back:  # S1
            p[B12], p[B31] = -p[B12], -p[B31]
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
                o[TURNED] = 0.0
            elif turned:
                value, t = there, add(t, stop)
                o[TURNED] = 1.0
            else:
                phi, w, t = there, horner(y[W], stop), add(t, (h, 0.0))
                if abs(w[0]) < 1e-10:  # at rest, or nearly: an equilibrium lies ahead
                    break
                continue
            scale = k if o[TURNED] == 0.0 else 1.0
            if back and o[TURNED] == 0.0:
                scale = -scale
            keep(o, VALUE, times(value, scale))
            keep(o, TIME, div(times(t, -1.0 if back else 1.0), (k, 0.0)))
            o[STEPS] = float(steps)
            break


@kernel
def settle(points, section, span, tolerance, out):
    """points (N, 8): B12 to W0, for `span` in units of the fastest rate; out (N, SETTLED), with
    velocities over that rate.
    """
    y, p = np.zeros((SERIES, 2, TERMS)), np.zeros(SIX)
    for i in range(len(points)):
        row, o = points[i], out[i]
        o[:] = np.nan
        k = sizes(row, row[W0])
        scaled(row, p, k)
        phi, w = (row[PHI0], 0.0), (row[W0] / k, 0.0)
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
                o[PASSAGE_BEFORE], o[PASSAGE] = o[PASSAGE], horner(y[W], x)[0]
            if w[0] > 0.0 and speed[0] <= 0.0:
                x = zero(y[W], (0.0, 0.0), 0.0, h)
                o[RIGHT_BEFORE], o[RIGHT] = o[RIGHT], horner(y[PHI], x)[0]
            phi, w = there, speed
            t += h
            if t > span or abs(w[0]) > 1e6 or (abs(w[0]) < 1e-14 and h > span):
                o[DONE] = 1.0
                break
        o[LAST_PHI], o[LAST_W], o[RATE] = phi[0], w[0], k
