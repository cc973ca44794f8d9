"""The flow of nonlinear systems x' = f(t, x) and its derivative by the initial state, by Taylor
series about the beginnings of steps; many points at once, each with steps of its own.

A step goes as far as the last two coefficients allow for `tolerance`, relative to the states (Jorba & Zou), and no
farther than `reach` / |A|, A = df/dx, or than is given. No bounds are made here: `measures.floquet.existence` has
them of the defect of the series.

Source: A. Jorba, M. Zou, Experimental Mathematics 14 (2005) 99.
"""

import math

import numpy as np

from survey.kernels.floquet.program import BASIS, COLUMN, NUMBER, extend
from survey.kernels.floquet.steps import lanes_of, next_term, norm_of, times_step
from survey.kernels.jit import kernel

ORDER = 20
DIGITS = 2.0**48  # of the ends of steps, so that sums and differences of them are exact
WIDEST = 16.0  # a step, relative to that for which its series was made
LEAST = 1e-250  # of a coefficient: a smaller one, as of a force that has nearly underflowed, is 0
# where a series is not finite; of the span: steps as short end at a singularity
SHORTER, SHORTEST = 0.1, 1e-9


@kernel
def flow(
    operations, signs, inside, order, used, terms, numbers, states_at, x0, span, reach, longest, tolerance, most, first,
    X, M, size, steps, begin, length, series,
):  # fmt: skip
    """Fill X (N, n), the states at t = span (N) from x0 (N, n) at 0, and the numbers of `steps`
    (N); NaN: it fails.

    numbers (N, count), states_at (n): where the states stand among them; no step is longer than
    `longest` (N), and there are `most` at most. M (N, n, n), if
    N > 0: dX/dx0, and size (N, n): the largest moduli of the states at the ends of steps. If first
    (N + 1) is not empty, step k of point i is recorded at first[i] + k: `begin`, `length`, `series`
    (n, ORDER + 1) in units of the step.
    """
    n, lanes = x0.shape[1], 2
    while lanes < lanes_of(n) and lanes < len(x0):  # bits do not depend on it
        lanes *= 2
    derived, recorded = len(M) > 0, len(first) > 0
    S, V = np.zeros((len(operations), ORDER + 1, lanes)), np.zeros((numbers.shape[1], lanes))
    B = np.zeros((len(operations), ORDER + 1, n * lanes))
    C = np.zeros((len(operations), n, n * lanes))
    P, W = np.zeros((ORDER + 1, n, n * lanes)), np.zeros((len(terms), n * lanes))
    U = np.zeros((len(terms), lanes))
    sums, a = np.zeros(lanes), np.zeros(lanes)
    needed = np.zeros((len(operations), n), np.bool_)
    for k in range(len(terms)):
        needed[terms[k, BASIS], terms[k, COLUMN]] = True
    x, D, F = np.zeros((n, lanes)), np.zeros((n * n, lanes)), np.zeros((n * n, lanes))
    t, s, shares = np.zeros(lanes), np.zeros(lanes), np.zeros(lanes)
    busy, held = np.zeros(lanes, np.bool_), order[:n]
    for start in range(0, len(x0), lanes):
        count = min(lanes, len(x0) - start)
        for lane in range(lanes):
            i = start + min(lane, count - 1)
            busy[lane], t[lane], s[lane] = lane < count, 0.0, span[i] / 32.0
            for k in range(numbers.shape[1]):
                V[k, lane] = numbers[i, k]
            for k in range(len(terms)):
                U[k, lane] = numbers[i, terms[k, NUMBER]]
            for c in range(n):
                x[c, lane] = x0[i, c]
                D[c * n : (c + 1) * n, lane] = 0.0
                D[c * n + c, lane] = 1.0
            if lane < count:
                steps[i] = 0
                for c in range(n):
                    size[i, c] = abs(x0[i, c])
        left = count
        while left > 0:
            for c in range(n):
                for lane in range(lanes):
                    V[states_at[c], lane] = x[c, lane]
            if derived:
                times_step(U, s, n, W)
                P[0] = 0.0
                for c in range(n):
                    P[0, c, c * lanes : (c + 1) * lanes] = 1.0
            for k in range(ORDER + 1):  # one call of each kernel: it is compiled once
                extend(operations, signs, inside, order, V, t, s, S, k)
                if k == 0:
                    norm_of(S, U, terms, k, sums, a)
                if derived and k < ORDER:
                    next_term(S, W, terms, used, needed, k, n, B, C, P)
            for lane in range(count):
                if not busy[lane]:
                    continue
                i = start + lane
                share = _share(S, held, lane, tolerance)
                lost = steps[i] >= most or min(share, 1.0) * s[lane] < SHORTEST * span[i]
                if lost or not math.isfinite(share):
                    s[lane] *= SHORTER
                    if lost or s[lane] < SHORTEST * span[i]:
                        busy[lane], X[i] = False, math.nan
                        left -= 1
                    shares[lane] = 0.0
                    continue
                h = min(share * s[lane], reach / a[lane]) if a[lane] > 0.0 else share * s[lane]
                h = min(h, longest[i])
                rest = span[i] - t[lane]
                if h >= rest:
                    end = span[i]
                else:
                    h = 0.5 * rest if h > 0.5 * rest else h
                    # numba 0.61 knows no exp2
                    unit = math.ldexp(1.0 / DIGITS, math.ceil(math.log2(span[i])))
                    end = t[lane] + max(math.floor(h / unit), 1.0) * unit
                before, own = t[lane], s[lane]
                taken = end - before
                shares[lane], t[lane], s[lane] = taken / own, end, h
                if recorded:
                    k = first[i] + steps[i]
                    begin[k], length[k] = before, taken
                for c in range(n):
                    total, power = 0.0, 1.0
                    for m in range(ORDER, -1, -1):
                        total = total * shares[lane] + S[held[c], m, lane]
                    if recorded:
                        for m in range(ORDER + 1):
                            series[k, c, m] = S[held[c], m, lane] * power
                            power *= shares[lane]
                    x[c, lane] = total
                    size[i, c] = max(size[i, c], abs(total))
                steps[i] += 1
                if not end < span[i]:
                    busy[lane] = False
                    left -= 1
                    for c in range(n):
                        X[i, c] = x[c, lane]
            if derived:
                _advance(P, shares, n, F, D)
                for lane in range(count):
                    if not busy[lane] and shares[lane] > 0.0:
                        for c in range(n * n):
                            M[start + lane, c // n, c % n] = D[c, lane]
            for lane in range(lanes):
                if not busy[lane]:
                    shares[lane] = 0.0


@kernel
def _share(S, held, lane, tolerance):
    """How far the series of the states serve, relative to the step for which they were made; NaN:
    not at all.
    """
    share = WIDEST
    for c in range(len(held)):
        own = held[c]
        size = abs(S[own, 0, lane]) + abs(S[own, 1, lane]) + abs(S[own, 2, lane])
        for m in range(3, ORDER - 1):  # a state that is at rest, and has no acceleration
            size = abs(S[own, m, lane]) if size == 0.0 else size
        if not math.isfinite(size):
            return math.nan
        for m in range(ORDER - 1, ORDER + 1):
            last = abs(S[own, m, lane])
            if not math.isfinite(last):
                return math.nan
            if last > LEAST:
                share = min(share, (tolerance * size / last) ** (1.0 / m))
    return share


@kernel
def _advance(P, shares, n, F, D):
    """D becomes the product of the step's matrix, the series P at `shares`, and D."""
    lanes = len(shares)
    for q in range(n * n):
        own = F[q]
        at = (q % n) * lanes
        own[:] = 0.0
        for m in range(ORDER, -1, -1):
            one = P[m, q // n, at : at + lanes]
            for lane in range(lanes):
                own[lane] = own[lane] * shares[lane] + one[lane]
        for lane in range(lanes):
            if shares[lane] == 0.0:  # the lane waits
                own[lane] = 1.0 if q % (n + 1) == 0 else 0.0
    for c in range(n):
        for lane in range(lanes):
            for r in range(n):
                total = 0.0
                for k in range(n):
                    total += F[r * n + k, lane] * D[k * n + c, lane]
                P[0, 0, r * lanes + lane] = total
            for r in range(n):
                D[r * n + c, lane] = P[0, 0, r * lanes + lane]


@kernel
def spread(F, delta, first, wide, off):
    """Fill wide (steps, n), sums of the rows of |F_k ... F_1|, and off (steps, n), what local errors delta become.

    off_k = sum over l <= k of |F_k ... F_l+1| delta_l; point i has the steps first[i] to first[i + 1].
    """
    n = F.shape[1]
    A, B = np.empty((n, n)), np.empty((n, n))
    off[:] = 0.0
    for i in range(len(first) - 1):
        for begin in range(first[i] - 1, first[i + 1]):
            # begin: the step whose local error is followed; the first of all is the initial state
            A[:] = 0.0
            for r in range(n):
                A[r, r] = 1.0
            for k in range(max(begin, first[i]), first[i + 1]):
                if k > begin:
                    for r in range(n):
                        for c in range(n):
                            total = 0.0
                            for m in range(n):
                                total += F[k, r, m] * A[m, c]
                            B[r, c] = total
                    A, B = B, A
                for r in range(n):
                    total = 0.0
                    for c in range(n):
                        total += abs(A[r, c]) * (delta[begin, c] if begin >= first[i] else 1.0)
                    if begin < first[i]:
                        wide[k, r] = total
                    else:
                        off[k, r] += total
