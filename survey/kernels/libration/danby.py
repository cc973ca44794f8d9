"""Danby's problem in lanes: the monodromy of the elliptic triangular points over half a period, and
its factors.

In the true anomaly f, with r(f) = 1 / (1 + e cos f), rotated axes and the state (x, q, p, m) = (xi,
eta' + xi, xi' - eta, -eta) (`scenes/libration_elliptic.md`):

    x' = p - m      m' = x - q      q' = -x' - d2 r m      p' = -m' + d1 r x

X = (x, q), Y = (p, m) are canonical, so that the inverse of a propagator (P, S; Q, T) is (T', -S'; -Q', P'). A step's
propagator is forward @ inverse(backward), two matrices whose columns a method gives with a bound of each column's
errors. Beside the product goes the matrix V of its error ellipse, V <- G V G' + diag(d^2) with d the
largest local error of a column; |error| <= sqrt((4 n - 3) V_ii) after n steps, to first order (as in `kernels.lanes`).
"""

from itertools import combinations_with_replacement

import numpy as np

from survey.kernels.jit import inline, splice
from survey.kernels.libration.traces import A_BAR, B_BAR, C_BAR, D_BAR, T_BAR, A, B, C, D, T
from survey.kernels.math.roundoff import EPS, ROUNDOFF
from survey.kernels.unroll import largest, unroll

TILE = 64
VECTOR = 8
ROUNDING = 4.0 * ROUNDOFF  # of an entry of one step, about four roundings
WORST = 300.0
# Rows of the working table, lanes innermost: the propagator so far (4 x 4), V (upper triangle), the
# sum of local errors; of each lane d1, d2, e; of each column forward (4), backward (4) and the
# error of each; a method's own.
V, SUM, D1, D2, E, COLUMNS, OWN = 16, 26, 27, 28, 29, 30, 70
COLUMN = 10


@splice
def chain(columns, own, v, h, e, d1, d2, out):
    """Fill `out` (N, RESULTS) for points (e, d1, d2) (N each), all with the same steps of lengths
    `h` (steps).

    `columns(v, h, work, count)` fills the rows COLUMNS.. of one step for `count` lanes, with `own`
    rows from OWN on for itself; v = 1 + cos f at the nodes of each step (steps, nodes).
    """
    steps, size = len(h), len(e)
    work = np.empty((OWN + own, TILE))
    for first in range(0, size, TILE):
        count = min(TILE, size - first)
        # lanes that fill the machine's vectors; those beyond `count` repeat the last
        padded = (count + VECTOR - 1) // VECTOR * VECTOR
        start(work, padded)
        for i in range(padded):
            at = first + min(i, count - 1)
            work[D1, i], work[D2, i], work[E, i] = d1[at], d2[at], e[at]
        for n in range(steps):
            columns(v[n], h[n], work, padded)
            for i in range(padded):
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
    """Column `column` of the step from rows first.. : forward (4) and its error, backward being the
    identity.
    """
    to = COLUMNS + COLUMN * column
    for i in range(count):
        for j in range(4):
            work[to + j, i] = work[first + j, i]
            work[to + 4 + j, i] = 1.0 * (j == column)
        work[to + 8, i], work[to + 9, i] = work[first + 4, i], 0.0


@unroll
def advance(work, i):
    """One step of lane i."""
    # forward and backward by rows: their columns 0, 1 start in X, 2, 3 in Y
    step = [[work[COLUMNS + COLUMN * c + k, i] for c in range(4)] for k in range(COLUMN)]
    forward, backward, (forward_error, backward_error) = step[:4], step[4:8], step[8:]
    g = [_by_inverse(row, backward) for row in forward]
    # |error of G|_ij <= y_j + x_i: through F, and through the inverse of B
    y = [_dot(forward_error, _magnitudes(_exchanged(row))) for row in _exchanged(backward)]
    x = [_dot(_exchanged(backward_error), _magnitudes(row)) for row in forward]
    by_y = by_x = 0.0
    rounding = [0.0, 0.0, 0.0, 0.0]
    for j in range(4):
        column = [work[4 * k + j, i] for k in range(4)]
        for k in range(4):
            work[4 * k + j, i] = _dot(g[k], column)
        sizes = _magnitudes(column)
        by_y = largest(by_y, _dot(y, sizes))
        by_x = largest(by_x, sum(sizes[1:], sizes[0]))
        rounding = [largest(rounding[k], _dot(_magnitudes(g[k]), sizes)) for k in range(4)]
    local = [by_y + by_x * x[k] + ROUNDING * rounding[k] for k in range(4)]
    work[SUM, i] = work[SUM, i] + largest(largest(y[0], y[1]), largest(y[2], y[3]))
    rows = {(j, k): at for at, (j, k) in enumerate(combinations_with_replacement(range(4), 2), V)}
    v = [[work[rows[min(j, k), max(j, k)], i] for k in range(4)] for j in range(4)]
    for j in range(4):
        row = [_dot(g[j], v[k]) for k in range(4)]
        for k in range(j, 4):
            propagated = _dot(row, g[k])
            work[rows[j, k], i] = propagated + local[j] * local[j] if j == k else propagated


def _dot(a, b):
    terms = [p * q for p, q in zip(a, b, strict=True)]
    return sum(terms[1:], terms[0])


def _magnitudes(numbers):
    return [abs(x) for x in numbers]


def _exchanged(items):
    """Those of Y before those of X."""
    return [*items[2:], *items[:2]]


def _by_inverse(f, b):
    """A row of F times B^-1 = (b22, b32, -b02, -b12; b23, b33, -b03, -b13; -b20, -b30, b00, b10;
    -b21, ...).
    """
    through_x = [_dot(f[:2], row[2:]) for row in b]
    through_y = [_dot(f[2:], row[:2]) for row in b]
    return [through_x[k] - through_y[k] for k in (2, 3)] + [
        through_y[k] - through_x[k] for k in (0, 1)
    ]


@splice
def finish(work, i, steps, out):
    """Columns of `traces`, A to T_BAR, of lane i after `steps` steps."""
    e0, e1, e2, e3 = bars(work, i, steps)
    out[A], out[A_BAR] = _determinant(work[0, i], work[1, i], work[4, i], work[5, i], e0, e1)
    out[B], out[B_BAR] = _determinant(work[10, i], work[11, i], work[14, i], work[15, i], e2, e3)
    out[C], out[C_BAR] = _determinant(work[8, i], work[9, i], work[12, i], work[13, i], e2, e3)
    out[D], out[D_BAR] = _determinant(work[2, i], work[3, i], work[6, i], work[7, i], e0, e1)
    t, bar = 0.0, 0.0
    for j in range(2):
        a, b, c, d = work[j, i], work[4 + j, i], work[10 + j, i], work[14 + j, i]
        t += a * c + b * d
        bar += e0 * abs(c) + e2 * abs(a) + e0 * e2 + e1 * abs(d) + e3 * abs(b) + e1 * e3
        bar += EPS * 3.0 * (abs(a * c) + abs(b * d))
    out[T], out[T_BAR] = t, bar


@inline
def bars(work, i, steps):
    """Error bounds of the entries of each row of the propagator of lane i."""
    # Cauchy and Schwarz: V_ii sums the squares of 4 n - 3 terms, four of each step but one of the
    # last
    doubt, terms = np.exp(min(work[SUM, i], WORST)), 4.0 * steps - 3.0
    v00, v11, v22, v33 = V, V + 4, V + 7, V + 9  # in the upper triangle
    e0, e1 = doubt * np.sqrt(terms * work[v00, i]), doubt * np.sqrt(terms * work[v11, i])
    e2, e3 = doubt * np.sqrt(terms * work[v22, i]), doubt * np.sqrt(terms * work[v33, i])
    return e0, e1, e2, e3


@inline
def _determinant(a, b, c, d, upper, lower):
    """a d - b c and its error bound, where those of its rows are `upper` and `lower`."""
    bar = upper * (abs(c) + abs(d)) + lower * (abs(a) + abs(b)) + 2.0 * upper * lower
    return a * d - b * c, bar + EPS * (abs(a * d) + abs(b * c))
