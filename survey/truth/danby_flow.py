"""Danby's linear equations in the double-double arithmetic of this folder, in the eccentric anomaly
E.

With s = sqrt(1 - e^2), g = s / (1 - e cos E): (x, q, p, m)_E of equations (3) of the scene's notes
times df/dE = g, and r df/dE = 1/s. Four solutions over half a period, from which the monodromy M =
R Phi^-1 R Phi is multiplied out; its trace and the sum of its principal minors of order two are a
and b, by no other formula.
"""

import numpy as np

from survey.truth.compiled import kernel
from survey.truth.double import (
    PI,
    add,
    conv,
    div,
    get,
    horner,
    keep,
    mul,
    neg,
    reach,
    root,
    sine_cosine,
    store,
    sub,
    times,
)

TERMS = 33
TINY = 1e-31
MOST = 4000
# What is filled: the invariants a and b, each in two columns, high and low; their doubts, and steps.
A, B = 0, 2
A_DOUBT, B_DOUBT, STEPS = range(4, 7)
COLUMNS = 7


@kernel
def points(mu, e, tolerance, out):
    """Fill `out` (N, COLUMNS)."""
    c, g = np.zeros((2, TERMS)), np.zeros((2, TERMS))
    y = np.zeros((4, 4, 2, TERMS))
    u, v = np.zeros((2, TERMS)), np.zeros((2, TERMS))
    x = np.zeros((4, 4, 2))
    for i in range(len(mu)):
        m, ee = (mu[i], 0.0), (e[i], 0.0)
        product = mul(m, sub((1.0, 0.0), m))
        big = times(add((1.0, 0.0), root(sub((1.0, 0.0), times(product, 3.0)))), 1.5)
        small = div(times(product, 6.75), big)
        s = root(mul(sub((1.0, 0.0), ee), add((1.0, 0.0), ee)))
        d1, d2 = div(big, s), div(small, s)
        x[:] = 0.0
        for n in range(4):
            x[n, n, 0] = 1.0
        at = (0.0, 0.0)
        steps, largest = 0, 1.0
        left = PI
        while left[0] > 0.0 and steps < MOST:
            steps += 1
            sin, cos = sine_cosine(at)
            # 1 - e cos E without loss near pericentre: (1 - e) + 2 e sin^2(E/2)
            half, _ = sine_cosine(times(at, 0.5))
            a, b = times(cos, -e[i]), times(sin, e[i])
            store(c, 0, add(sub((1.0, 0.0), ee), times(mul(half, half), 2.0 * e[i])))
            for n in range(1, TERMS):
                a, b = div(b, (float(n), 0.0)), div(neg(a), (float(n), 0.0))
                store(c, n, a)
            store(g, 0, div(s, get(c, 0)))
            first = get(c, 0)
            store(c, 0, (0.0, 0.0))
            for n in range(1, TERMS):
                store(g, n, div(neg(conv(c, g, n)), first))
            h = reach(g, abs(g[0, 0]), tolerance)
            for k in range(4):
                q = y[k]
                size = 0.0
                for j in range(4):
                    store(q[j], 0, (x[k, j, 0], x[k, j, 1]))
                    size += abs(x[k, j, 0])
                for n in range(TERMS - 1):
                    store(u, n, sub(get(q[2], n), get(q[3], n)))
                    store(v, n, sub(get(q[0], n), get(q[1], n)))
                    gu, gv = conv(g, u, n), conv(g, v, n)
                    by = (n + 1.0, 0.0)
                    store(q[0], n + 1, div(gu, by))
                    store(q[1], n + 1, div(neg(add(gu, mul(d2, get(q[3], n)))), by))
                    store(q[2], n + 1, div(sub(mul(d1, get(q[0], n)), gv), by))
                    store(q[3], n + 1, div(gv, by))
                for j in range(4):
                    h = min(h, reach(q[j], size, tolerance))
            last = h >= left[0]
            step = left if last else (h, 0.0)
            for k in range(4):
                for j in range(4):
                    x[k, j, 0], x[k, j, 1] = horner(y[k, j], step)
                    largest = max(largest, abs(x[k, j, 0]))
            at = add(at, step)
            left = (0.0, 0.0) if last else sub(left, (h, 0.0))
        # columns x[k] of Phi; with J = (0 1; -1 0) in (x, q | p, m): Phi^-1 = (T', -S'; -Q', P')
        o = out[i]
        _invariants(x, o)
        # ten ulp of a step: errors are a tenth of it at most, against mpmath (tests/truth)
        o[A_DOUBT] = 1e-31 * steps * largest * largest
        o[B_DOUBT] = 1e-31 * steps * largest**4
        o[STEPS] = float(steps)
        if steps >= MOST:
            o[:] = np.nan


@kernel
def _invariants(x, o):
    m = np.zeros((4, 4, 2))
    for i in range(4):
        for j in range(4):
            total = (0.0, 0.0)
            for k in range(4):
                # entry (i, k) of R Phi^-1 R, R = diag(1, 1, -1, -1): the signs of the off-diagonal
                # blocks turn
                r, c = (k + 2) % 4, (i + 2) % 4  # Phi^-1 = J^-1 Phi' J
                total = add(total, mul((x[c, r, 0], x[c, r, 1]), (x[j, k, 0], x[j, k, 1])))
            m[i, j, 0], m[i, j, 1] = total
    a, b = (0.0, 0.0), (0.0, 0.0)
    for i in range(4):
        a = add(a, (m[i, i, 0], m[i, i, 1]))
        for j in range(i):
            b = add(b, mul((m[i, i, 0], m[i, i, 1]), (m[j, j, 0], m[j, j, 1])))
            b = sub(b, mul((m[i, j, 0], m[i, j, 1]), (m[j, i, 0], m[j, i, 1])))
    keep(o, A, a)
    keep(o, B, b)
