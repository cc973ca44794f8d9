"""Jacobi's elliptic functions and the complete integrals, from the modulus and its complement.

The complement k' = sqrt(1 - k^2) is an argument of its own, so nothing is lost as k -> 1: give it as
sqrt((1 - k)(1 + k)), or from 1 - k where that is what is known. All by the arithmetic-geometric mean.

Sources: DLMF 19.8(i) and 22.20(ii); R. Bulirsch, Numer. Math. 7 (1965) 78-90 (sn, cn, dn).
"""

from math import cos, pi, sin, sqrt

from survey.kernels.jit import inline

# Convergence is quadratic: a relative gap of 1e-8 leaves 1e-17, and k' = 1e-150 gets there in eleven steps.
GAP = 1e-8
MEANS = 14


@inline
def means(kc, pairs):
    """Fill `pairs` (2, MEANS) with the means a_n, b_n of 1 and k'; returns the last n."""
    a, b = 1.0, kc
    last = 0
    for n in range(MEANS):
        pairs[0, n], pairs[1, n] = a, b
        last = n
        if abs(a - b) <= GAP * a:
            break
        a, b = 0.5 * (a + b), sqrt(a * b)
    return last


@inline
def complete(k, kc):
    """K(k) and E(k) (DLMF 19.8.5, 19.8.6): K to a few ulp, E to a few ulp of K."""
    a, b, weight, total = 1.0, kc, 0.5, 0.5 * k * k
    for _ in range(MEANS):
        if abs(a - b) <= GAP * a:
            break
        c = 0.5 * (a - b)
        a, b = 0.5 * (a + b), sqrt(a * b)
        weight *= 2.0
        total += weight * c * c
    first = pi / (a + b)
    return first, first * (1.0 - total)


@inline
def jacobi(u, pairs, last):
    """sn, cn, dn of u from the means of the row (Bulirsch); best for |u| <= K."""
    c = 0.5 * (pairs[0, last] + pairs[1, last])
    phase = c * u
    side = sin(phase)
    if side == 0.0:
        return 0.0, 1.0, 1.0
    dn = 1.0
    ratio = cos(phase) / side
    c *= ratio
    for n in range(last, -1, -1):
        ratio *= c
        c *= dn
        dn = (pairs[1, n] + ratio) / (pairs[0, n] + ratio)
        ratio = c / pairs[0, n]
    sn = 1.0 / sqrt(c * c + 1.0)
    if side < 0.0:
        sn = -sn
    return sn, c * sn, dn
