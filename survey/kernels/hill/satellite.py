"""Planar motions of a satellite along one row of the map: w = dx/du and z = c0 + rho c1 + rho^2 at
given u.

A row holds the columns MODULUS to WHICH: k, k', the half period, oblate, given, which. For rotations
k > 1 and k' is the complement of 1/k; `given` is the parameter of this row that is known exactly,
and `which` says which one it is. `scenes/satellite.md`: The equation: z = (rho + w)^2 + g with g = dn^2 (PL), -k^2
sn^2 (OL), cn^2 (PR), -sn^2 (OR): no cancelling constant.
"""

from math import sqrt

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd
from survey.kernels.math.elliptic import GAP, LANES, MEANS, jacobi, jacobi_lanes, means
from survey.kernels.math.sines import sin_cos

# A relative gap of the means whose square is below the rounding of extended floats.
CLOSE = 1e-10
FEW = 4  # rows for which numpy costs more than loops
MODULUS, COMPLEMENT, HALF, OBLATE, GIVEN, WHICH = range(6)
ROW = 6


def complete_integrals(k, kc):
    """K and E of arrays of moduli and complements, as `elliptic.complete`, with nothing to compile: in
    numpy, or number by number where there are few.
    """
    if kc.size <= FEW:
        found = [_complete_one(*given) for given in zip(k.tolist(), kc.tolist(), strict=True)]
        return tuple(np.array(found).reshape(-1, 2).T.copy())
    a, b, weight, total = np.ones_like(kc), kc, 0.5, 0.5 * k * k
    for _ in range(MEANS):
        gap = a - b
        wide = abs(gap) > GAP * a
        number = np.count_nonzero(wide)
        if not number:
            break
        c, mean, other = 0.5 * gap, 0.5 * (a + b), np.sqrt(a * b)
        if number < wide.size:
            c, mean, other = (
                np.where(wide, c, 0.0),
                np.where(wide, mean, a),
                np.where(wide, other, b),
            )
        a, b = mean, other
        weight *= 2.0
        total = total + weight * c * c
    first = np.pi / (a + b)
    return first, first * (1.0 - total)


def _complete_one(k, kc):
    """The same of one modulus, by the same operations."""
    a, b, weight, total = 1.0, kc, 0.5, 0.5 * k * k
    for _ in range(MEANS):
        gap = a - b
        if not abs(gap) > GAP * a:
            break
        c, a, b = 0.5 * gap, 0.5 * (a + b), sqrt(a * b)
        weight *= 2.0
        total += weight * c * c
    first = np.pi / (a + b)
    return first, first * (1.0 - total)


def half_periods(k, kc):
    """2 K(k), or K(1/k) / k for rotations, rounded, and the rest, as phases are rho times as long
    (DLMF 19.8.5).

    In the machine's extended floats (on some machines float64) and numpy, which has nothing to
    compile.
    """
    a, b = np.ones_like(kc, dtype=np.longdouble), kc.astype(np.longdouble)
    if kc.size <= FEW:
        a[:] = b[:] = [_mean(*given) for given in zip(a, b, strict=True)]
    wide = np.flatnonzero(b < a)
    while wide.size:  # each row goes its own way, so that its bits do not depend on others
        one, other = a[wide], b[wide]
        a[wide], b[wide] = (one + other) / 2, np.sqrt(one * other)
        wide = wide[one - other > CLOSE * one]
    two = (np.longdouble(dd.PI[0]) + np.longdouble(dd.PI[1])) / a
    half = np.where(k > 1, two / (2 * np.maximum(k, 1)), two)
    return half.astype(float), (half - half.astype(float)).astype(float)


def _mean(a, b):
    """The arithmetic-geometric mean of two numbers, by the same operations as in `half_periods`."""
    if b < a:
        wide = True
        while wide:
            wide = a - b > CLOSE * a
            a, b = (a + b) / 2, np.sqrt(a * b)
    return a


@inline
def motion(u, k, oblate, pairs, last):
    """w and g at u: w = k cn(u, k) for librations, k dn(k u, 1/k) for rotations."""
    if k <= 1.0:
        sn, cn, dn = jacobi(u, pairs, last)
        return k * cn, -(k * k) * sn * sn if oblate else dn * dn
    sn, cn, dn = jacobi(k * u, pairs, last)
    return k * dn, -sn * sn if oblate else cn * cn


@kernel
def sample(rows, nodes, out):
    """c0 = w^2 + g and c1 = 2 w at the `nodes` (fractions) of the steps of the half period: out[r,
    step, c, node].

    Steps are even in number, and `nodes` symmetric: cn(2K - u) = -cn(u) gives the second half of a
    libration from the first, where u has a smaller rounding error.
    """
    pairs = np.empty((2, MEANS))
    steps, width = out.shape[1], len(nodes)
    lanes, partner = np.empty((LANES, steps * width)), np.empty(width, np.int64)
    for i in range(width):
        partner[i] = 0
        for j in range(width):  # by hand: argmin takes 0.15 s to compile
            if abs(nodes[i] + nodes[j] - 1.0) < abs(nodes[i] + nodes[partner[i]] - 1.0):
                partner[i] = j
    for r in range(rows.shape[0]):
        k, kc, span = rows[r, MODULUS], rows[r, COMPLEMENT], rows[r, HALF]
        oblate = rows[r, OBLATE] > 0.0
        last = means(kc, pairs)
        librates = k <= 1.0
        scale = span / steps if librates else k * (span / steps)
        own = steps // 2 if librates else steps
        for n in range(own):
            for i in range(width):
                lanes[0, n * width + i] = (n + nodes[i]) * scale
        jacobi_lanes(lanes, own * width, pairs, last)
        # w = k cn and g = dn^2 or -k^2 sn^2 for librations, k dn and cn^2 or -sn^2 for rotations
        squared = -k * k if oblate and librates else -1.0 if oblate else 1.0
        shape = 1 if oblate else 3 if librates else 2
        velocity = 2 if librates else 3
        for i in range(own * width):
            w = k * lanes[velocity, i]
            lanes[0, i], lanes[4, i] = (
                w * w + squared * (lanes[shape, i] * lanes[shape, i]),
                2.0 * w,
            )
        for n in range(own):
            for i in range(width):
                out[r, n, 0, i], out[r, n, 1, i] = lanes[0, n * width + i], lanes[4, n * width + i]
        for n in range(steps - own):
            for i in range(width):
                out[r, steps - 1 - n, 0, partner[i]] = lanes[0, n * width + i]
                out[r, steps - 1 - n, 1, partner[i]] = -lanes[4, n * width + i]


@inline
def potential(u, rho, row, table):
    """z at any u in [0, half period] and what its rounding is relative to; `table` from `tabulate`."""
    k, half = row[MODULUS], row[HALF]
    mirror = k <= 1.0 and 2.0 * u > half
    w, g = motion(half - u if mirror else u, k, row[OBLATE] > 0.0, table, int(table[0, MEANS]))
    shifted = rho - w if mirror else rho + w
    return shifted * shifted + g, (abs(rho) + abs(w)) * abs(shifted) + abs(g)


@inline
def tabulate(row, table):
    """What `potential` needs of a row, once: the means of 1 and k', and as the last entry their number."""
    table[0, MEANS] = means(row[COMPLEMENT], table)


# In double-double the clock is the pendulum itself, x'' = -sin x cos x: sin x, cos x, w = x', and
# w^2 for z. dn = cos x and k sn = sin x for librations; cn and sn for rotations.
SIN, COS, W, SQUARE = range(4)
CLOCK = 4
# What a row is given by: k, 1 - k or asin k.
K, ONE_MINUS_K, AMPLITUDE = 0.0, 1.0, 2.0
# A row in double-double: k and sqrt(|1 - k^2|), each as two numbers, rotates, oblate.
EXACT_K, EXACT_K_LOW, EXACT_SHORT, EXACT_SHORT_LOW, EXACT_ROTATES, EXACT_OBLATE = range(6)
EXACTLY = 6


@inline
def exactly(row, exact):
    """Fill `exact` (EXACTLY) from what the row is given by."""
    given, which = (row[GIVEN], 0.0), row[WHICH]
    rotates = False
    if which == AMPLITUDE:
        rest = dd.add(dd.two_sum(dd.HALF_PI[0], -row[GIVEN]), (dd.HALF_PI[1], dd.HALF_PI_REST))
        k, _ = sin_cos(row[GIVEN])
        sine, cosine = sin_cos(rest[0])
        complement = dd.shifted(sine, rest[1] * cosine[0])
    else:
        other = dd.two_sum(1.0, -row[GIVEN])
        k, short = (given, other) if which == K else (other, given)
        rotates = short[0] < 0.0
        short = dd.neg(short) if rotates else short
        complement = dd.sqrt(dd.mul(short, dd.add((1.0, 0.0), k)))
    exact[EXACT_K], exact[EXACT_K_LOW] = k
    exact[EXACT_SHORT], exact[EXACT_SHORT_LOW] = complement
    exact[EXACT_ROTATES], exact[EXACT_OBLATE] = 1.0 if rotates else 0.0, row[OBLATE]


@inline
def half_period(exact):
    """2 K(k), or K(1/k) / k for rotations, as a double-double."""
    k = exact[EXACT_K], exact[EXACT_K_LOW]
    complement = exact[EXACT_SHORT], exact[EXACT_SHORT_LOW]
    if exact[EXACT_ROTATES] > 0.0:
        return dd.div(dd.HALF_PI, dd.mean(k, complement))
    return dd.div(dd.PI, dd.mean((1.0, 0.0), complement))


@inline
def slowest(exact, clock):
    """The clock where w is least, from where errors do not grow: u = K for librations, K(1/k) / k
    for rotations.
    """
    for n in range(CLOCK):
        clock[n, 0, 0], clock[n, 1, 0] = 0.0, 0.0
    if exact[EXACT_ROTATES] > 0.0:
        clock[SIN, 0, 0] = 1.0
        clock[W, 0, 0], clock[W, 1, 0] = exact[EXACT_SHORT], exact[EXACT_SHORT_LOW]
    else:
        clock[SIN, 0, 0], clock[SIN, 1, 0] = exact[EXACT_K], exact[EXACT_K_LOW]
        clock[COS, 0, 0], clock[COS, 1, 0] = exact[EXACT_SHORT], exact[EXACT_SHORT_LOW]


@inline
def pendulum(exact, h, clock):
    """Series of the clock in x = u / h: (sin x)' = w cos x, (cos x)' = -w sin x, w' = -sin x cos x."""
    sine, cosine, w = clock[SIN], clock[COS], clock[W]
    for n in range(clock.shape[2] - 1):
        scale = n + 1.0
        sine[0, n + 1], sine[1, n + 1] = dd.over(dd.mul(h, dd.convolved(cosine, w, n)), scale)
        cosine[0, n + 1], cosine[1, n + 1] = dd.over(dd.mul(h, dd.convolved(sine, w, n)), -scale)
        w[0, n + 1], w[1, n + 1] = dd.over(dd.mul(h, dd.convolved(sine, cosine, n)), -scale)
    for n in range(clock.shape[2]):
        clock[SQUARE, 0, n], clock[SQUARE, 1, n] = dd.convolved(w, w, n)


@inline
def coefficient(side, exact, rho, clock, z):
    """Series of z = (rho + w)^2 + g; w is odd about u = K for librations, even about K(1/k) / k for
    rotations.
    """
    sign, oblate = 1.0 if exact[EXACT_ROTATES] > 0.0 else side, exact[EXACT_OBLATE] > 0.0
    twice = dd.scaled(rho, 2.0 * sign)
    for n in range(1, clock.shape[2]):
        shift = dd.mul((clock[W, 0, n], clock[W, 1, n]), twice)
        # w^2 + sin^2 x is constant, so g' = (w^2)'
        z[0, n], z[1, n] = dd.add(shift, (2.0 * clock[SQUARE, 0, n], 2.0 * clock[SQUARE, 1, n]))
    shifted = dd.add(rho, (sign * clock[W, 0, 0], sign * clock[W, 1, 0]))
    row = SIN if oblate else COS
    g = (clock[row, 0, 0], clock[row, 1, 0])
    g = dd.mul(g, g)
    z[0, 0], z[1, 0] = dd.add(dd.mul(shifted, shifted), dd.neg(g) if oblate else g)
    return 2.0 * (abs(rho[0]) + exact[EXACT_K]) * exact[EXACT_K] + 2.0


@inline
def missed(exact, clock):
    """Where w is largest sin x = 0, |cos x| = 1, |w| = k: how far off, sin x and w relative to
    their amplitudes.
    """
    k = exact[EXACT_K], exact[EXACT_K_LOW]
    sine = abs(clock[SIN, 0, 0]) / min(1.0, k[0])
    cosine, w = (clock[COS, 0, 0], clock[COS, 1, 0]), (clock[W, 0, 0], clock[W, 1, 0])
    cosine = dd.sub(dd.neg(cosine) if cosine[0] < 0.0 else cosine, (1.0, 0.0))
    w = dd.sub(dd.neg(w) if w[0] < 0.0 else w, k)
    return max(sine, max(abs(cosine[0]), abs(w[0]) / k[0]))
