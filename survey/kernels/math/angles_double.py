"""Angles in double-double arithmetic: turns, and their sines and cosines."""

import math

from survey.kernels.jit import inline, kernel
from survey.kernels.math.double import (
    HALF_PI,
    HALF_PI_REST,
    add,
    mul,
    neg,
    over,
    shifted,
    square,
    two_prod,
)

TERMS = 15  # of the sine and of the cosine of an eighth of a turn at most


@inline
def radians(turns):
    """2 pi turns."""
    high, low = two_prod(4.0 * turns, HALF_PI[0])
    return add(
        add((high, low), two_prod(4.0 * turns, HALF_PI[1])), (4.0 * turns * HALF_PI_REST, 0.0)
    )


@inline
def centred(phi):
    """phi in about [-pi, pi], and the turns taken out of it."""
    turns = math.floor(phi[0] / (4.0 * HALF_PI[0]) + 0.5)
    return add(phi, neg(radians(turns))), turns


@kernel
def sine_cosine(phi):
    """sin and cos of |phi| < 4, to a few units of double-double."""
    quarter = math.floor(phi[0] / HALF_PI[0] + 0.5)
    x = add(phi, neg(radians(0.25 * quarter)))
    z = square(x)
    s, c = (1.0, 0.0), (1.0, 0.0)
    for n in range(TERMS, 0, -1):
        s = shifted(neg(over(mul(z, s), 2.0 * n * (2.0 * n + 1.0))), 1.0)
        c = shifted(neg(over(mul(z, c), 2.0 * n * (2.0 * n - 1.0))), 1.0)
    s = mul(s, x)
    for _ in range(int(quarter) % 4):
        s, c = c, neg(s)
    return s, c
