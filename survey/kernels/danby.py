"""Danby's problem in lanes: the monodromy of the elliptic triangular points over half a period, and its factors.

In the true anomaly f, with r(f) = 1 / (1 + e cos f), rotated axes and the state (x, q, p, m) = (xi, eta' + xi,
xi' - eta, -eta) (the scene's notes, section 2):

    x' = p - m      m' = x - q      q' = -x' - d2 r m      p' = -m' + d1 r x

X = (x, q), Y = (p, m) are canonical, so that the inverse of a propagator (P, S; Q, T) is (T', -S'; -Q', P'). A step's
propagator is forward @ inverse(backward), two matrices whose columns a method gives with a bound of each column's
errors. Beside the product goes the matrix V of its error ellipse, V <- G V G' + diag(d^2) with d the
largest local error of a column; |error| <= sqrt(n V_ii) after n steps, to first order (as in `kernels.lanes`).
"""

import numpy as np

from survey.kernels.jit import inline, splice

TILE = 64
VECTOR = 8
EPS = 2.3e-16
ROUNDING = 4.4e-16
WORST = 300.0
# Rows of the working table, lanes innermost: the propagator so far (4 x 4), V (upper triangle), the sum of local
# errors; of each lane d1, d2, e; of each column forward (4), backward (4) and the error of each; a method's own.
V, SUM, D1, D2, E, COLUMNS, OWN = 16, 26, 27, 28, 29, 30, 70
COLUMN = 10
# What a chain gives of each point: A, B, C, D, t and the bound of each.
RESULTS = 10


@splice
def chain(columns, own, v, h, e, d1, d2, out):
    """Fill `out` (N, 10) for points (e, d1, d2) (N each), all with the same steps of lengths `h` (steps).

    `columns(v, h, work, count)` fills the rows COLUMNS.. of one step for `count` lanes, with `own` rows from OWN on
    for itself; v = 1 + cos f at the nodes of each step (steps, nodes).
    """
    steps, size = len(h), len(e)
    work = np.empty((OWN + own, TILE))
    for first in range(0, size, TILE):
        count = min(TILE, size - first)
        # so many lanes fill the machine's vectors; those beyond `count` repeat the last
        whole = (count + VECTOR - 1) // VECTOR * VECTOR
        start(work, whole)
        for i in range(whole):
            at = first + min(i, count - 1)
            work[D1, i], work[D2, i], work[E, i] = d1[at], d2[at], e[at]
        for n in range(steps):
            columns(v[n], h[n], work, whole)
            for i in range(whole):
                advance(work, i)
        for i in range(count):
            finish(work, i, steps, out[first + i])


@splice
def start(work, count):
    """The identity, without errors."""
    for k in range(D1):
        for i in range(count):
            work[k, i] = 0.0
    for k in range(4):
        for i in range(count):
            work[5 * k, i] = 1.0


@splice
def copy(work, first, column, count):
    """Column `column` of the step from rows first.. : forward (4) and its error, backward being the identity."""
    to = COLUMNS + COLUMN * column
    for i in range(count):
        for j in range(4):
            work[to + j, i] = work[first + j, i]
            work[to + 4 + j, i] = 1.0 * (j == column)
        work[to + 8, i], work[to + 9, i] = work[first + 4, i], 0.0


@inline
def advance(work, i):
    """One step of lane i."""
    # fmt: off
    # forward F, backward B: columns 0, 1 start in X, 2, 3 in Y
    f00, f10, f20, f30 = work[30, i], work[31, i], work[32, i], work[33, i]
    b00, b10, b20, b30 = work[34, i], work[35, i], work[36, i], work[37, i]
    t0, s0 = work[38, i], work[39, i]
    f01, f11, f21, f31 = work[40, i], work[41, i], work[42, i], work[43, i]
    b01, b11, b21, b31 = work[44, i], work[45, i], work[46, i], work[47, i]
    t1, s1 = work[48, i], work[49, i]
    f02, f12, f22, f32 = work[50, i], work[51, i], work[52, i], work[53, i]
    b02, b12, b22, b32 = work[54, i], work[55, i], work[56, i], work[57, i]
    t2, s2 = work[58, i], work[59, i]
    f03, f13, f23, f33 = work[60, i], work[61, i], work[62, i], work[63, i]
    b03, b13, b23, b33 = work[64, i], work[65, i], work[66, i], work[67, i]
    t3, s3 = work[68, i], work[69, i]
    # G = F B^-1, by rows; B^-1 = (b22, b32, -b02, -b12; b23, b33, -b03, -b13; -b20, -b30, b00, b10; -b21, ...)
    g00, g01, g02, g03 = _row(f00, f01, f02, f03, b00, b10, b20, b30, b01, b11, b21, b31,
                              b02, b12, b22, b32, b03, b13, b23, b33)
    g10, g11, g12, g13 = _row(f10, f11, f12, f13, b00, b10, b20, b30, b01, b11, b21, b31,
                              b02, b12, b22, b32, b03, b13, b23, b33)
    g20, g21, g22, g23 = _row(f20, f21, f22, f23, b00, b10, b20, b30, b01, b11, b21, b31,
                              b02, b12, b22, b32, b03, b13, b23, b33)
    g30, g31, g32, g33 = _row(f30, f31, f32, f33, b00, b10, b20, b30, b01, b11, b21, b31,
                              b02, b12, b22, b32, b03, b13, b23, b33)
    # |error of G|_ij <= y_j + x_i: through F, and through the inverse of B
    y0 = t0 * abs(b22) + t1 * abs(b23) + t2 * abs(b20) + t3 * abs(b21)
    y1 = t0 * abs(b32) + t1 * abs(b33) + t2 * abs(b30) + t3 * abs(b31)
    y2 = t0 * abs(b02) + t1 * abs(b03) + t2 * abs(b00) + t3 * abs(b01)
    y3 = t0 * abs(b12) + t1 * abs(b13) + t2 * abs(b10) + t3 * abs(b11)
    x0 = s2 * abs(f00) + s3 * abs(f01) + s0 * abs(f02) + s1 * abs(f03)
    x1 = s2 * abs(f10) + s3 * abs(f11) + s0 * abs(f12) + s1 * abs(f13)
    x2 = s2 * abs(f20) + s3 * abs(f21) + s0 * abs(f22) + s1 * abs(f23)
    x3 = s2 * abs(f30) + s3 * abs(f31) + s0 * abs(f32) + s1 * abs(f33)
    # fmt: on
    by_y, by_x, r0, r1, r2, r3 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(4):
        a, b, c, d = work[j, i], work[4 + j, i], work[8 + j, i], work[12 + j, i]
        work[j, i] = g00 * a + g01 * b + g02 * c + g03 * d
        work[4 + j, i] = g10 * a + g11 * b + g12 * c + g13 * d
        work[8 + j, i] = g20 * a + g21 * b + g22 * c + g23 * d
        work[12 + j, i] = g30 * a + g31 * b + g32 * c + g33 * d
        a, b, c, d = abs(a), abs(b), abs(c), abs(d)
        by_y = max(by_y, y0 * a + y1 * b + y2 * c + y3 * d)
        by_x = max(by_x, a + b + c + d)
        r0 = max(r0, abs(g00) * a + abs(g01) * b + abs(g02) * c + abs(g03) * d)
        r1 = max(r1, abs(g10) * a + abs(g11) * b + abs(g12) * c + abs(g13) * d)
        r2 = max(r2, abs(g20) * a + abs(g21) * b + abs(g22) * c + abs(g23) * d)
        r3 = max(r3, abs(g30) * a + abs(g31) * b + abs(g32) * c + abs(g33) * d)
    x0, x1 = by_y + by_x * x0 + ROUNDING * r0, by_y + by_x * x1 + ROUNDING * r1
    x2, x3 = by_y + by_x * x2 + ROUNDING * r2, by_y + by_x * x3 + ROUNDING * r3
    work[SUM, i] += max(max(y0, y1), max(y2, y3))
    v00, v01, v02, v03, v11 = work[16, i], work[17, i], work[18, i], work[19, i], work[20, i]
    v12, v13, v22, v23, v33 = work[21, i], work[22, i], work[23, i], work[24, i], work[25, i]
    a0, a1, a2, a3 = _times(g00, g01, g02, g03, v00, v01, v02, v03, v11, v12, v13, v22, v23, v33)
    work[16, i] = a0 * g00 + a1 * g01 + a2 * g02 + a3 * g03 + x0 * x0
    work[17, i] = a0 * g10 + a1 * g11 + a2 * g12 + a3 * g13
    work[18, i] = a0 * g20 + a1 * g21 + a2 * g22 + a3 * g23
    work[19, i] = a0 * g30 + a1 * g31 + a2 * g32 + a3 * g33
    a0, a1, a2, a3 = _times(g10, g11, g12, g13, v00, v01, v02, v03, v11, v12, v13, v22, v23, v33)
    work[20, i] = a0 * g10 + a1 * g11 + a2 * g12 + a3 * g13 + x1 * x1
    work[21, i] = a0 * g20 + a1 * g21 + a2 * g22 + a3 * g23
    work[22, i] = a0 * g30 + a1 * g31 + a2 * g32 + a3 * g33
    a0, a1, a2, a3 = _times(g20, g21, g22, g23, v00, v01, v02, v03, v11, v12, v13, v22, v23, v33)
    work[23, i] = a0 * g20 + a1 * g21 + a2 * g22 + a3 * g23 + x2 * x2
    work[24, i] = a0 * g30 + a1 * g31 + a2 * g32 + a3 * g33
    a0, a1, a2, a3 = _times(g30, g31, g32, g33, v00, v01, v02, v03, v11, v12, v13, v22, v23, v33)
    work[25, i] = a0 * g30 + a1 * g31 + a2 * g32 + a3 * g33 + x3 * x3


@inline
def _row(f0, f1, f2, f3, b00, b10, b20, b30, b01, b11, b21, b31, b02, b12, b22, b32, b03, b13, b23, b33):
    """A row of F times the inverse of B."""
    return (
        (f0 * b22 + f1 * b23) - (f2 * b20 + f3 * b21),
        (f0 * b32 + f1 * b33) - (f2 * b30 + f3 * b31),
        (f2 * b00 + f3 * b01) - (f0 * b02 + f1 * b03),
        (f2 * b10 + f3 * b11) - (f0 * b12 + f1 * b13),
    )


@inline
def _times(g0, g1, g2, g3, v00, v01, v02, v03, v11, v12, v13, v22, v23, v33):
    """A row of G times the symmetric V."""
    return (
        g0 * v00 + g1 * v01 + g2 * v02 + g3 * v03,
        g0 * v01 + g1 * v11 + g2 * v12 + g3 * v13,
        g0 * v02 + g1 * v12 + g2 * v22 + g3 * v23,
        g0 * v03 + g1 * v13 + g2 * v23 + g3 * v33,
    )


@splice
def finish(work, i, steps, out):
    """A, B, C, D, t of lane i after `steps` steps, and their error bounds."""
    doubt = np.exp(min(work[SUM, i], WORST))
    e0, e1 = doubt * np.sqrt(steps * work[16, i]), doubt * np.sqrt(steps * work[20, i])
    e2, e3 = doubt * np.sqrt(steps * work[23, i]), doubt * np.sqrt(steps * work[25, i])
    out[0], out[5] = _determinant(work[0, i], work[1, i], work[4, i], work[5, i], e0, e1)
    out[1], out[6] = _determinant(work[10, i], work[11, i], work[14, i], work[15, i], e2, e3)
    out[2], out[7] = _determinant(work[8, i], work[9, i], work[12, i], work[13, i], e2, e3)
    out[3], out[8] = _determinant(work[2, i], work[3, i], work[6, i], work[7, i], e0, e1)
    t, bar = 0.0, 0.0
    for j in range(2):
        a, b, c, d = work[j, i], work[4 + j, i], work[10 + j, i], work[14 + j, i]
        t += a * c + b * d
        bar += e0 * abs(c) + e2 * abs(a) + e0 * e2 + e1 * abs(d) + e3 * abs(b) + e1 * e3
        bar += EPS * 3.0 * (abs(a * c) + abs(b * d))
    out[4], out[9] = t, bar


@inline
def _determinant(a, b, c, d, upper, lower):
    """a d - b c and its error bound, where those of its rows are `upper` and `lower`."""
    bar = upper * (abs(c) + abs(d)) + lower * (abs(a) + abs(b)) + 2.0 * upper * lower
    return a * d - b * c, bar + EPS * (abs(a * d) + abs(b * c))
