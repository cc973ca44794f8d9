"""The propagators of linear systems x' = A(t) x over many steps, by Taylor series about their
middles.

U(tau), U = 1 at the middle of a step, takes the state from there; F = U(1) U(-1)^-1 takes it over
the step: so a series serves twice its reach. Each (point, step) is a task, and LANES of them are
solved at once.

The bound of |F - exact| counts, in the maximum norm of rows: the terms beyond the last, whose recurrence is continued
with norms for the coefficients; the rounding of every operation, carried along by the same recurrence; that of A's
values, `noise` (N) in the same norm; and what the inverse leaves.
"""

import math

import numpy as np

from survey.kernels.floquet.program import BASIS, COLUMN, NUMBER, ONE, ROW, extend
from survey.kernels.jit import inline, kernel, part
from survey.kernels.math.roundoff import ROUNDOFF_UP

ORDER = 16
BEYOND = 3  # terms of the bound of what is cut off


@inline
def lanes_of(n):
    """How many steps are solved at once: what fits into the cache."""
    return 32 if n <= 4 else 16 if n <= 6 else 8


@kernel
def factors(
    operations,
    signs,
    inside,
    order,
    used,
    terms,
    numbers,
    scale,
    noise,
    n,
    point,
    middle,
    half,
    F,
    error,
    doubt,
):
    """Fill F (tasks, n, n), bounds `error` (tasks) of its rows' errors and `doubt` (tasks) of their
    relative size.

    Task k is the step of `point[k]` from middle[k] - half[k] to middle[k] + half[k]. numbers (N,
    count), scale (N, n): A_ij is taken times scale_j / scale_i, powers of 2. If there is room for
    twice as many, the propagators F^-1 of the steps backwards follow.
    """
    lanes, ways = lanes_of(n), 2 if len(F) > len(point) else 1
    size = len(operations)
    S, X = np.zeros((size, ORDER + 1, lanes)), np.empty((ORDER + 1, n, n * lanes))
    B, C = np.zeros((size, ORDER + 1, n * lanes)), np.zeros((size, n, n * lanes))
    V, U = np.empty((numbers.shape[1], lanes)), np.empty((len(terms), lanes))
    W = np.empty((len(terms), n * lanes))
    a = np.zeros((ORDER + 1, lanes))
    w = np.empty((ORDER + 1 + BEYOND, lanes))
    e = np.empty((ORDER + 1, lanes))
    sums, t, s, own = np.empty(lanes), np.empty(lanes), np.empty(lanes), np.empty(lanes)
    even = np.empty((n, n * lanes))
    odd = np.empty((n, n * lanes))
    work = np.empty((4, n, n * lanes))
    total = np.empty(lanes)
    of_both = np.empty(lanes)
    of_odd = np.empty(lanes)
    found = np.empty(lanes)
    per_row, needed = np.zeros(n), np.zeros((size, n), np.bool_)
    most = 0.0
    for k in range(len(terms)):
        row = terms[k, ROW]
        per_row[row] += 1.0
        most = max(most, per_row[row])
        needed[terms[k, BASIS], terms[k, COLUMN]] = True
    for start in range(0, len(point), lanes):
        for lane in range(lanes):
            task = min(start + lane, len(point) - 1)
            i = point[task]
            t[lane], s[lane], own[lane] = middle[task], half[task], noise[i]
            for k in range(numbers.shape[1]):
                V[k, lane] = numbers[i, k]
            for k in range(len(terms)):
                U[k, lane] = numbers[i, terms[k, NUMBER]] * (
                    scale[i, terms[k, COLUMN]] / scale[i, terms[k, ROW]]
                )
        times_step(U, s, n, W)
        X[0] = 0.0
        for i in range(n):
            X[0, i, i * lanes : (i + 1) * lanes] = 1.0
        w[0], e[0] = 1.0, 0.0
        for k in range(ORDER + 1):  # one call of each kernel: it is compiled once
            extend(operations, signs, inside, order, V, t, s, S, k)
            norm_of(S, U, terms, k, sums, a[k])
            if k < ORDER:
                next_term(S, W, terms, used, needed, k, n, B, C, X)
                _row_norms(X[k + 1], lanes, sums, w[k + 1])
                _rounded(a, w, e, own, s, k, most)
        _missing(a, w, e, s, total, of_both, of_odd)
        for way in range(ways):
            _halves(X, even, odd)
            if way > 0:  # U(1) and U(-1) change places
                for i in range(n):
                    one = odd[i]
                    for q in range(n * lanes):
                        one[q] = -one[q]
            _over(even, odd, of_both, of_odd, work, found)
            first = start + way * len(point)
            for lane in range(min(lanes, len(point) - start)):
                step = F[first + lane]
                for i in range(n):
                    for j in range(n):
                        step[i, j] = odd[i, j * lanes + lane] + (1.0 if i == j else 0.0)
                error[first + lane] = found[lane]
                doubt[first + lane] = found[lane] * total[lane] * total[lane]


@inline
def norm_of(S, U, terms, k, sums, out):
    """The maximum norm of A's coefficient of order k, by rows; U (terms, lanes): the terms' numbers."""
    q = 0
    out[:] = 0.0
    while q < len(terms):
        row, known = terms[q, ROW], False
        while q < len(terms) and terms[q, ROW] == row:
            if terms[q, BASIS] != ONE or k == 0:
                basis, weight = S[terms[q, BASIS], k], U[q]
                if not known:
                    sums[:] = 0.0
                    known = True
                for lane in range(len(out)):
                    sums[lane] += abs(basis[lane] * weight[lane])
            q += 1
        if known:
            for lane in range(len(out)):
                out[lane] = max(out[lane], sums[lane])


@inline
def times_step(U, s, n, W):
    """Fill W (terms, n lanes) with the numbers U (terms, lanes) times half the steps, s, for every column."""
    lanes = len(s)
    for q in range(len(U)):
        one, own = U[q], W[q]
        for c in range(n):
            for lane in range(lanes):
                own[c * lanes + lane] = one[lane] * s[lane]


@inline
def next_term(S, W, terms, used, needed, k, n, B, C, X):
    """Fill X[k + 1] = half / (k + 1) * sum over j of A_j X[k - j], W from `times_step`; `needed` (basis,
    row) rows of X are multiplied.

    Each row of X, C and B[basis, order] holds `lanes` numbers for every column, as one long vector.
    """
    lanes = S.shape[2]
    for at in range(len(used)):
        m = used[at]
        if m == ONE:
            continue
        for c in range(n):
            for lane in range(lanes):
                B[m, k, c * lanes + lane] = S[m, k, lane]
        for row in range(n):
            if needed[m, row]:
                sums = C[m, row]
                first = (k + 1) % 4
                sums[:] = 0.0
                for j in range(first):
                    basis, before = B[m, j], X[k - j, row]
                    for q in range(n * lanes):
                        sums[q] += basis[q] * before[q]
                # four at once: sums are read and written less often
                for j in range(first, k + 1, 4):
                    b0, b1, b2, b3 = B[m, j], B[m, j + 1], B[m, j + 2], B[m, j + 3]
                    x0, x1, x2, x3 = (
                        X[k - j, row],
                        X[k - j - 1, row],
                        X[k - j - 2, row],
                        X[k - j - 3, row],
                    )
                    for q in range(n * lanes):
                        sums[q] += (b0[q] * x0[q] + b1[q] * x1[q]) + (b2[q] * x2[q] + b3[q] * x3[q])
    q, share = 0, 1.0 / (k + 1)
    for row in range(n):
        one, end = X[k + 1, row], q
        while end < len(terms) and terms[end, ROW] == row:
            end += 1
        # two at once, so that the sum is read and written less often, and the first without it
        if end == q:
            one[:] = 0.0
        elif (end - q) % 2 == 1:
            w0, x0 = W[q], _behind(terms[q], k, C, X)
            for i in range(n * lanes):
                one[i] = (w0[i] * x0[i]) * share
        else:
            w0, w1 = W[q], W[q + 1]
            x0, x1 = _behind(terms[q], k, C, X), _behind(terms[q + 1], k, C, X)
            for i in range(n * lanes):
                one[i] = (w0[i] * x0[i] + w1[i] * x1[i]) * share
        for at in range(q + 2 - (end - q) % 2, end, 2):
            w0, w1 = W[at], W[at + 1]
            x0, x1 = _behind(terms[at], k, C, X), _behind(terms[at + 1], k, C, X)
            for i in range(n * lanes):
                one[i] += (w0[i] * x0[i] + w1[i] * x1[i]) * share
        q = end


@inline
def _behind(term, k, C, X):
    """What the number of a term multiplies at order k."""
    return X[k, term[COLUMN]] if term[BASIS] == ONE else C[term[BASIS], term[COLUMN]]


@part
def _rounded(a, w, e, own, s, k, most):
    """Fill e[k + 1], a bound of the rounding of X[k + 1], from the norms a of A's and w of X's
    coefficients.
    """
    new = e[k + 1]
    for lane in range(len(new)):
        new[lane] = own[lane] * w[k, lane]
    # a basis function's coefficient j, products, k - j sums, a row
    least = k + 8.0 + most
    for j in range((k + 1) % 2):
        one, two, before = a[j], w[k - j], e[k - j]
        for lane in range(len(new)):
            new[lane] += one[lane] * (before[lane] + ROUNDOFF_UP * least * two[lane])
    for j in range((k + 1) % 2, k + 1, 2):  # two at once, as in `next_term`
        one, two, before = a[j], w[k - j], e[k - j]
        one1, two1, before1 = a[j + 1], w[k - j - 1], e[k - j - 1]
        count, count1 = ROUNDOFF_UP * (least + j), ROUNDOFF_UP * (least + j + 1)
        for lane in range(len(new)):
            new[lane] += one[lane] * (before[lane] + count * two[lane]) + one1[lane] * (
                before1[lane] + count1 * two1[lane]
            )
    for lane in range(len(new)):
        new[lane] *= s[lane] / (k + 1)


@inline
def _halves(X, even, odd):
    """Fill the sums of the terms of even and of odd order of the series at tau = 1, like X[0]."""
    for i in range(X.shape[1]):
        one, two = even[i], odd[i]
        one[:], two[:] = 0.0, 0.0
        for k in range(ORDER, -1, -2):
            term = X[k, i]
            for q in range(len(one)):
                one[q] += term[q]
            if k > 0:
                term = X[k - 1, i]
                for q in range(len(one)):
                    two[q] += term[q]


@inline
def _missing(a, w, e, s, total, of_both, of_odd):
    """Fill bounds (lanes) of the errors of a series at tau = 1 and of the sum of its odd terms, and
    `total`, the sum of its terms' norms: what it lacks beyond its last term, and its rounding.
    """
    lanes = len(s)
    for lane in range(lanes):
        total[lane] = of_both[lane] = of_odd[lane] = 0.0
    for k in range(ORDER + 1):
        one, two = w[k], e[k]
        for lane in range(lanes):
            total[lane] += one[lane]
            of_both[lane] += two[lane] + 2.0 * ROUNDOFF_UP * one[lane]
        if k % 2 == 1:
            for lane in range(lanes):
                of_odd[lane] += two[lane] + 2.0 * ROUNDOFF_UP * one[lane]
    for k in range(ORDER, ORDER + BEYOND):
        new = w[k + 1]
        new[:] = 0.0
        for j in range(min(k, ORDER) + 1):
            one, two = a[j], w[k - j]
            for lane in range(lanes):
                new[lane] += one[lane] * two[lane]
        for lane in range(lanes):
            new[lane] *= s[lane] / (k + 1)
    for lane in range(lanes):
        largest = cut = 0.0
        for k in range(ORDER + 1):
            largest = max(largest, a[k, lane])
        for k in range(ORDER, ORDER + BEYOND):
            cut += w[k + 1, lane]
        # A's own coefficients beyond the last known are taken to fall as the last four did
        last, before = a[ORDER, lane] + a[ORDER - 1, lane], a[ORDER - 2, lane] + a[ORDER - 3, lane]
        fall = math.sqrt(last / before) if before > 0.0 else 0.0
        if last <= ROUNDOFF_UP * largest:  # beside zeros of coefficients the fall is an accident
            fall = min(fall, 0.94)
        rest = (
            2.0 * last * fall / (1.0 - fall) if fall < 0.95 else (0.0 if last == 0.0 else math.inf)
        )
        # over two orders, as even and odd ones may differ
        end = w[ORDER + BEYOND, lane] + w[ORDER + BEYOND - 1, lane]
        earlier = w[ORDER + BEYOND - 2, lane]
        ratio = w[ORDER + BEYOND, lane] / earlier if earlier > 0.0 else 0.0
        cut = cut + end * ratio / (1.0 - ratio) if ratio < 0.9 else math.inf
        cut += s[lane] * rest * total[lane] / (ORDER + 1)
        of_both[lane] += cut
        of_odd[lane] += cut


@inline
def _over(even, odd, of_both, of_odd, work, error):
    """Make `odd` G = F - 1, F the propagator over the steps, from the halves of U; fill the bounds
    `error` of its rows.

    G = D U(-1)^-1 with D = U(1) - U(-1), twice the odd terms: exact to what is small where the step
    is. `work` (4, n, n lanes) and `even` are used up. Of the computed V = U(-1)^-1, G V^-1 = D is
    off by G (1 - U(-1) V) V^-1.
    """
    n, lanes = len(even), len(error)
    U, left, inverse, G = work[0], work[1], work[2], work[3]
    for i in range(n):
        one, two, copied, own, identity = even[i], odd[i], left[i], U[i], inverse[i]
        for q in range(n * lanes):
            own[q] = one[q] - two[q]
            copied[q] = own[q]
            two[q] *= 2.0
            identity[q] = 0.0
        for lane in range(lanes):
            identity[i * lanes + lane] = 1.0
    _invert(left, inverse, n, lanes)
    _product(odd, inverse, lanes, G)
    _product(U, inverse, lanes, left)
    for i in range(n):
        for lane in range(lanes):
            left[i, i * lanes + lane] -= 1.0
    norms = np.empty((5, lanes))
    for k, matrix in enumerate((odd, U, inverse, G, left)):
        _row_norms(matrix, lanes, even[0], norms[k])
    across, down, broad, tall, rest = norms[0], norms[1], norms[2], norms[3], norms[4]
    for lane in range(lanes):
        rounding = (n + 2.0) * ROUNDOFF_UP * (across[lane] + tall[lane] * down[lane])
        given = 2.0 * of_odd[lane] + tall[lane] * of_both[lane]
        own = (
            broad[lane] * (given + rounding)
            + tall[lane] * rest[lane]
            + ROUNDOFF_UP * (1.0 + tall[lane])
        )
        error[lane] = own if own < math.inf else math.inf
    for i in range(n):
        one, two = odd[i], G[i]
        for q in range(n * lanes):
            one[q] = two[q]


@part
def _row_norms(A, lanes, work, out):
    """Fill out (lanes) with the largest sums of moduli in a row of A (n, n lanes)."""
    n = len(A)
    fours = n - n % 4
    out[:] = 0.0
    for i in range(n):
        one = A[i]
        work[:] = 0.0
        for c in range(0, fours, 4):
            c0, c1 = one[c * lanes : (c + 1) * lanes], one[(c + 1) * lanes : (c + 2) * lanes]
            c2, c3 = one[(c + 2) * lanes : (c + 3) * lanes], one[(c + 3) * lanes : (c + 4) * lanes]
            for lane in range(lanes):
                work[lane] += (abs(c0[lane]) + abs(c1[lane])) + (abs(c2[lane]) + abs(c3[lane]))
        for c in range(fours, n):
            for lane in range(lanes):
                work[lane] += abs(one[c * lanes + lane])
        for lane in range(lanes):
            out[lane] = max(out[lane], work[lane]) if work[lane] < math.inf else math.inf


@part
def _product(A, B, lanes, out):
    """Fill out with A B, each (n, n lanes)."""
    n = len(A)
    for i in range(n):
        sums, row = out[i], A[i]
        sums[:] = 0.0
        for k in range(n):
            other = B[k]
            for c in range(n):
                for lane in range(lanes):
                    sums[c * lanes + lane] += row[k * lanes + lane] * other[c * lanes + lane]


@part
def _invert(work, inverse, n, lanes):
    """Gauss-Jordan elimination of `work`, which is near 1, on `inverse`; no pivots are chosen:
    residuals tell.
    """
    factor = np.empty(lanes)
    for k in range(n):
        pivot, other = work[k], inverse[k]
        for lane in range(lanes):
            factor[lane] = 1.0 / pivot[k * lanes + lane]
        for j in range(n):
            for lane in range(lanes):
                pivot[j * lanes + lane] *= factor[lane]
                other[j * lanes + lane] *= factor[lane]
        for i in range(n):
            if i == k:
                continue
            row, right = work[i], inverse[i]
            for lane in range(lanes):
                factor[lane] = row[k * lanes + lane]
            for j in range(n):
                for lane in range(lanes):
                    row[j * lanes + lane] -= factor[lane] * pivot[j * lanes + lane]
                    right[j * lanes + lane] -= factor[lane] * other[j * lanes + lane]


@part
def column_tops(A, out):
    """Fill out (n) with the largest moduli in the columns of A (n, n)."""
    for c in range(len(A)):
        top = 0.0
        for j in range(len(A)):
            top = max(top, abs(A[j, c]))
        out[c] = top


@part
def row_norm(A):
    """The largest sum of the moduli in a row of A (n, n)."""
    norm = 0.0
    for j in range(len(A)):
        total = 0.0
        for c in range(len(A)):
            total += abs(A[j, c])
        norm = max(norm, total)
    return norm


@part
def multiply(left, right, zero, out):
    """Fill out with the product of two matrices (n, n); `zero` is that of its type."""
    for j in range(len(out)):
        for c in range(len(out)):
            total = zero
            for m in range(len(out)):
                total += left[j, m] * right[m, c]
            out[j, c] = total


@part
def add_outer(A, by, before, out):
    """Add `by` times the sum of the moduli in each row of A, times `before` (n) of each column, to
    out (n, n).
    """
    for j in range(len(A)):
        total = 0.0
        for m in range(len(A)):
            total += abs(A[j, m])
        for c in range(len(A)):
            out[j, c] += by * total * before[c]


@part
def set_identity(A):
    """Fill A (n, n) with the identity."""
    A[:] = 0.0
    for j in range(len(A)):
        A[j, j] = 1.0


@kernel
def add_times(weight, A, out):
    """Add weight times the matrix A to out."""
    for j in range(len(A)):
        for c in range(A.shape[1]):
            out[j, c] += weight * A[j, c]


@kernel
def copy(A, out):
    """Fill the matrix out; out[:] = A would take 2 s to compile, for the words of an error."""
    for j in range(len(out)):
        for c in range(out.shape[1]):
            out[j, c] = A[j, c]


@kernel
def products(F, error, doubt, first, n, M, E, R):
    """Fill M (N, n, n), the product of the steps first[i] to first[i + 1] of each point, and bounds
    E of its entries.

    To first order the error is the sum over the steps of (F_last ... F_k+1) d_k (F_k-1 ... F_1), the sums of |d_k| in
    a row being error[k] at most; `doubt` bounds the relative size of what is left out. R is the part of E that
    multiplying leaves.
    """
    longest = 0
    for i in range(len(M)):
        longest = max(longest, first[i + 1] - first[i])
    # the largest in columns of |F_k-1 ... F_1|
    before, rounding = np.empty((longest + 1, n)), np.empty(longest + 1)
    A, B = np.empty((n, n)), np.empty((n, n))
    for i in range(len(M)):
        steps = first[i + 1] - first[i]
        set_identity(A)
        more = 0.0
        for k in range(steps):
            step = F[first[i] + k]
            column_tops(A, before[k])
            multiply(step, A, 0.0, B)
            A, B = B, A
            rounding[k] = n * ROUNDOFF_UP * row_norm(step)
            more += doubt[first[i] + k]
        copy(A, M[i])
        E[i] = 0.0
        R[i] = 0.0
        set_identity(A)
        for k in range(steps - 1, -1, -1):
            add_outer(A, error[first[i] + k] + rounding[k], before[k], E[i])
            add_outer(A, rounding[k], before[k], R[i])
            multiply(A, F[first[i] + k], 0.0, B)
            A, B = B, A
        factor = math.exp(min(2.0 * more, 700.0))
        for j in range(n):
            for c in range(n):
                E[i, j, c] *= factor
                R[i, j, c] *= factor


@kernel
def carried(F, error, doubt, first, which, n, V, W, B):
    """Fill B (N, n, n) of the points `which`: bounds of |W e V|, e the error of the product but for multiplying.

    As in `products`, but the errors are carried in the coordinates V, W (complex, N, n, n): where
    these are nearly the eigenvectors, what grows on the way and shrinks again counts as little as
    it matters.
    """
    longest = 0
    for i in which:
        longest = max(longest, first[i + 1] - first[i])
    before = np.empty((longest + 1, n))
    A, Z = np.empty((n, n), np.complex128), np.empty((n, n), np.complex128)
    for i in which:
        copy(V[i], A)
        more = 0.0
        for k in range(first[i + 1] - first[i]):
            column_tops(A, before[k])
            multiply(F[first[i] + k], A, 0.0j, Z)
            A, Z = Z, A
            more += doubt[first[i] + k]
        copy(W[i], A)
        B[i] = 0.0
        for k in range(first[i + 1] - first[i] - 1, -1, -1):
            add_outer(A, error[first[i] + k], before[k], B[i])
            multiply(A, F[first[i] + k], 0.0j, Z)
            A, Z = Z, A
        factor = math.exp(min(2.0 * more, 700.0))
        for j in range(n):
            for c in range(n):
                B[i, j, c] *= factor * (1.0 + 1e-9)  # the last covers the rounding of A here


@kernel
def gradients(F, error, doubt, first, B, out):
    """Fill out (N, K) with bounds of the errors of the K sums over i, j of B_ji M_ij; B is (N, K,
    n, n).

    As in `products`, but what errors of different entries do to a sum is bounded together: the
    error d of a step adds sum of d_ij (X B L)_ji, X the product of the steps before it and L that
    of those behind it.
    """
    n, K, N = F.shape[1], B.shape[1], len(B)
    lanes, longest = min(32 if n <= 4 else 8, N), 0  # bits do not depend on it
    for i in range(N):
        longest = max(longest, first[i + 1] - first[i])
    # of points side by side: steps, products of those before them, largest moduli in their columns
    L, before = np.zeros((longest, n, n, lanes)), np.zeros((longest + 1, n, n, lanes))
    tops, weight, rounding = (
        np.zeros((longest, n, lanes)),
        np.zeros((longest, lanes)),
        np.zeros((longest, lanes)),
    )
    A, Z, W = np.zeros((n, n, lanes)), np.zeros((n, n, lanes)), np.zeros((n, n, lanes))
    more, sums = np.zeros(lanes), np.zeros(lanes)
    largest, total, rounded = np.zeros(lanes), np.zeros(lanes), np.zeros(lanes)
    for start in range(0, N, lanes):
        most = 0
        for lane in range(lanes):
            i = min(start + lane, N - 1)
            steps, more[lane] = first[i + 1] - first[i], 0.0
            most = max(most, steps)
            for k in range(longest):
                there = k < steps  # behind the last step are steps that do nothing, without errors
                weight[k, lane] = error[first[i] + k] if there else 0.0
                more[lane] += doubt[first[i] + k] if there else 0.0
                rounding[k, lane] = n * ROUNDOFF_UP * row_norm(F[first[i] + k]) if there else 0.0
                for r in range(n):
                    for c in range(n):
                        L[k, r, c, lane] = F[first[i] + k, r, c] if there else 1.0 * (r == c)
        for r in range(n):
            before[0, r, r] = 1.0
        for k in range(most):
            _multiply_lanes(L[k], before[k], before[k + 1])
            for r in range(n):
                for c in range(n):
                    own, one = tops[k, c], before[k, r, c]
                    for lane in range(lanes):
                        own[lane] = max(own[lane] if r > 0 else 0.0, abs(one[lane]))
        for q in range(K):
            sums[:] = 0.0
            for lane in range(lanes):
                for r in range(n):
                    for c in range(n):
                        A[r, c, lane] = B[min(start + lane, N - 1), q, r, c]
            for k in range(most - 1, -1, -1):
                # A is B L
                _multiply_lanes(before[k], A, Z)
                total[:] = 0.0
                rounded[:] = 0.0
                for c in range(n):
                    largest[:] = 0.0
                    for r in range(n):
                        one, two, top = Z[r, c], A[r, c], tops[k, r]
                        for lane in range(lanes):
                            largest[lane] = max(largest[lane], abs(one[lane]))
                            rounded[lane] += abs(two[lane]) * top[lane]
                    for lane in range(lanes):
                        total[lane] += largest[lane]
                one, two = weight[k], rounding[k]
                for lane in range(lanes):
                    sums[lane] += one[lane] * total[lane] + two[lane] * rounded[lane]
                _multiply_lanes(A, L[k], W)
                A, W = W, A
            for lane in range(min(lanes, N - start)):
                factor = math.exp(min(2.0 * more[lane], 700.0)) * (1.0 + 1e-9)
                out[start + lane, q] = sums[lane] * factor


@kernel
def _multiply_lanes(left, right, out):
    """Fill out with the products of matrices (n, n, lanes)."""
    n, lanes = len(out), out.shape[2]
    fours = n - n % 4
    for r in range(n):
        for c in range(n):
            own = out[r, c]
            own[:] = 0.0
            for m in range(0, fours, 4):
                a0, a1, a2, a3 = left[r, m], left[r, m + 1], left[r, m + 2], left[r, m + 3]
                b0, b1, b2, b3 = right[m, c], right[m + 1, c], right[m + 2, c], right[m + 3, c]
                for q in range(lanes):
                    own[q] += (a0[q] * b0[q] + a1[q] * b1[q]) + (a2[q] * b2[q] + a3[q] * b3[q])
            for m in range(fours, n):
                one, two = left[r, m], right[m, c]
                for q in range(lanes):
                    own[q] += one[q] * two[q]
