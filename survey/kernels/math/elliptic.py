"""Jacobi's elliptic functions and the complete integrals, from the modulus and its complement.

The complement k' = sqrt(1 - k^2) is an argument of its own, so nothing is lost as k -> 1: give it
as sqrt((1 - k)(1 + k)), or from 1 - k where that is what is known. All by the arithmetic-geometric
mean.

Sources: DLMF 19.8(i) and 22.20(ii); R. Bulirsch, Numer. Math. 7 (1965) 78-90 (sn, cn, dn).
"""

from math import cos, pi, sin, sqrt

from survey.kernels.jit import inline, splice
from survey.kernels.unroll import unroll

# Convergence is quadratic: a relative gap of 1e-8 leaves 1e-17, and k' = 1e-150 gets there in
# eleven steps.
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


# Scratch rows of `jacobi_lanes`.
LANES = 5


@splice
def jacobi_lanes(lanes, count, pairs, last):
    """As `jacobi`, for `count` values u in 0..K: u in lanes[0]; sn, cn, dn in lanes[1..3]; lanes[4]
    is scratch.
    """
    mean = 0.5 * (pairs[0, last] + pairs[1, last])
    for i in range(count):
        sine, cosine = _sine_cosine(mean * lanes[0, i])
        lanes[4, i] = cosine / sine if sine > 0.0 else HUGE
        lanes[2, i] = mean * lanes[4, i]
        lanes[3, i] = 1.0
    for n in range(last, -1, -1):
        a, b = pairs[0, n], pairs[1, n]
        for i in range(count):
            ratio = lanes[4, i] * lanes[2, i]
            lanes[2, i] *= lanes[3, i]
            lanes[3, i] = (b + ratio) / (a + ratio)
            lanes[4, i] = lanes[2, i] / a
    for i in range(count):
        sn = 1.0 / sqrt(lanes[2, i] * lanes[2, i] + 1.0)
        lanes[1, i] = sn
        lanes[2, i] *= sn


# cot u where u = 0: its square is finite.
HUGE = 1e140


@unroll
def _sine_cosine(x):
    """sin and cos in 0..pi/2, to 3e-16, as the double angles of their series to x^17 at x/2; branch-free."""
    half = 0.5 * x
    y = -half * half
    s = 1 + y * (1 / 110) * (1 + y * (1 / 156) * (1 + y * (1 / 210) * (1 + y * (1 / 272))))
    s = half * (1 + y * (1 / 6) * (1 + y * (1 / 20) * (1 + y * (1 / 42) * (1 + y * (1 / 72) * s))))
    c = 1 + y * (1 / 90) * (1 + y * (1 / 132) * (1 + y * (1 / 182) * (1 + y * (1 / 240))))
    c = 1 + y * (1 / 2) * (1 + y * (1 / 12) * (1 + y * (1 / 30) * (1 + y * (1 / 56) * c)))
    return 2.0 * s * c, 1.0 - 2.0 * s * s
