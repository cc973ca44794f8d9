"""Clebsch's case: closed forms of the permanent rotations and of the critical motions, with error
bars.

M' = M x w + epsilon nu x (I nu), nu' = nu x w, M = I w, I = diag(A1, A2, A3), |nu| = 1, with the integrals

    H = M.w / 2 + epsilon nu.I nu / 2,    F2 = |M|^2 - epsilon nu.adj(I) nu,    F3 = M.nu

Equation numbers, and the proofs: `scenes/brun_triaxial.md`.
"""

import numpy as np

from survey.measures import bounded
from survey.measures.bounded import Bounded

UNDECIDED, UNSTABLE, STABLE = -1, 0, 1
LEAST, MIDDLE, LARGEST = -1, 0, 1


def integrals(inertia, epsilon, w, nu):
    """H, F2, F3 (Bounded) from three Bounded each."""
    M = [A * p for A, p in zip(inertia, w, strict=True)]
    squares, momenta = [x * x for x in nu], [m * m for m in M]
    H = 0.5 * (
        _sum(m * p for m, p in zip(M, w, strict=True))
        + epsilon * _sum(map(_times, inertia, squares))
    )
    F2 = _sum(momenta) - epsilon * _sum(map(_times, _adjugate(inertia), squares))
    return {"H": H, "F2": F2, "F3": _sum(map(_times, M, nu))}


def rotation(inertia, epsilon, rate):
    """For the rotation by `rate` about the vertical axis of the first moment: {name: Bounded or
    codes}, (4)-(7).
    """
    A1, A2, A3 = (bounded.of(A) for A in inertia)
    e = bounded.of(epsilon)
    square = bounded.of(rate) * bounded.of(rate)
    over, other = A1 - A2, A1 - A3
    kappa = square - e
    two, three, free = over * kappa, other * kappa, A2 + A3 - A1
    b = A2 * two + A3 * three + square * (free * free)
    shared_sign = np.where(over.sign() == other.sign(), over.sign(), 0.0)
    middle = over.sign() * other.sign() < 0.0
    # (6): the rotation about the least axis with epsilon < 0, or the largest with epsilon > 0, must
    # be fast enough
    needs = shared_sign * e.value > 0.0
    least = Bounded(abs(e.value)).sqrt() * roots(A1, A2, A3, shared_sign) / A1
    beyond = (bounded.of(abs(np.asarray(rate, dtype=float))) - least).sign()
    free_top = (e.value == 0.0) & (square.value == 0.0)
    verdict = np.where(middle, np.where(kappa.sign() != 0.0, UNSTABLE, UNDECIDED), UNDECIDED)
    verdict = np.where((shared_sign != 0.0) & ~needs & ~free_top, STABLE, verdict)
    verdict = np.where(
        (shared_sign != 0.0) & needs,
        np.select([beyond > 0.0, beyond < 0.0], [STABLE, UNSTABLE], -1),
        verdict,
    )
    growth, slow, fast = _modes(
        A2 * A3, b, two * three, _discriminant(A1, A2, A3, e, square, free), verdict
    )
    # two equal moments
    verdict = np.where((verdict == UNDECIDED) & (growth.value > growth.bar), UNSTABLE, verdict)
    zero, one = np.zeros_like(A1.value), np.ones_like(A1.value)
    known = integrals((A1, A2, A3), e, [bounded.of(x) for x in (np.asarray(rate, float) + zero, zero, zero)],
                      [bounded.of(x) for x in (one, zero, zero)])  # fmt: skip
    nothing = Bounded(np.full(np.shape(needs), np.nan), np.nan)
    return known | {
        "verdict": verdict,
        "place": np.where(
            middle, MIDDLE + 0.0, np.where(shared_sign != 0.0, shared_sign, -2)
        ).astype(np.int64),
        "critical_rate": bounded.where(needs, least, nothing),
        "growth": growth,
        "frequency_slow": slow,
        "frequency_fast": fast,
    }


def roots(A1, A2, A3, side):
    """sqrt(s A2 (A1 - A3)) + sqrt(s A3 (A1 - A2)) of (7), s the `side`."""
    return (A2 * clipped(side * (A1 - A3))).sqrt() + (A3 * clipped(side * (A1 - A2))).sqrt()


def clipped(number):
    """The number, or 0 where it is negative."""
    return Bounded(
        np.maximum(number.value, 0.0), np.clip(number.value + number.bar, 0.0, number.bar)
    )


def _discriminant(A1, A2, A3, e, square, free):
    """b^2 - 4 a c of (4), as the product that shows its sign (5)."""
    pairs = A1 * (A2 + A3) - 2.0 * (A2 * A3)
    turn, gap = A1 * square, (A2 - A3) * e
    return free * free * (turn * turn - 2.0 * (e * square * pairs) + gap * gap)


def _modes(a, b, c, d, verdict):
    """Largest real part, least and largest imaginary part of the roots of a x^4 + b x^2 + c, d =
    b^2 - 4 a c.
    """
    meets = abs(d.value) <= d.bar  # then the squares x may be equal, or a complex pair
    spread = np.where(meets, np.sqrt(abs(d.value) + d.bar), 0.0) / (2.0 * a.value)
    # |sqrt(x + y) - sqrt(x)| <= sqrt|y|
    real, doubt = meets | (d.value > 0.0), np.sqrt(spread * bounded.UP)
    root = bounded.where(real & ~meets, d, 0.0).sqrt()
    outer = (b + np.where(b.value < 0.0, -1.0, 1.0) * root) / (-2.0 * a)  # without cancellation
    none = abs(outer.value) <= outer.bar
    inner = bounded.where(
        none, Bounded(0.0 * outer.value, abs(outer.value) + outer.bar), c / (a * outer)
    )
    size = bounded.where(real, 1.0, c / a).sqrt()
    half = b / (-2.0 * a)
    # sqrt(x) = p + i q of complex x: 2 p^2 = |x| + Re x, 2 q^2 = |x| - Re x
    p, q = ((0.5 * clipped(size + side * half)).sqrt() for side in (1.0, -1.0))
    rises = [clipped(x).sqrt() for x in (inner, outer)]
    turns = [clipped(-x).sqrt() for x in (inner, outer)]
    growth = bounded.where(real, _larger(*rises), p)
    slow, fast = (bounded.where(real, pick(*turns), q) for pick in (_smaller, _larger))
    growth, slow, fast = (Bounded(x.value, x.bar + doubt) for x in (growth, slow, fast))
    return bounded.where(verdict == STABLE, 0.0, growth), slow, fast


def _larger(a, b):
    return Bounded(np.maximum(a.value, b.value), np.maximum(a.bar, b.bar))


def _smaller(a, b):
    return Bounded(np.minimum(a.value, b.value), np.maximum(a.bar, b.bar))


def critical(inertia, epsilon, sigma, area, sign):
    """For the critical motions with F3 = `area` on which H + sigma F2 / 2 is stationary, (8)-(12)."""
    inertia = [bounded.of(A) for A in inertia]
    e, s, p = (bounded.of(x) for x in (epsilon, sigma, area))
    factors = [1.0 + s * A for A in inertia]
    alpha = (e * factors[0] * factors[1] * factors[2]).sqrt()
    alpha = Bounded(sign * alpha.value, alpha.bar)
    D = [A / f for A, f in zip(inertia, factors, strict=True)]
    y = p / alpha
    low, middle, high, ranks = _sorted(D)
    # differences without cancellation: D_i - D_j = (A_i - A_j) / ((1 + sigma A_i)(1 + sigma A_j))
    gap = {
        (i, j): (inertia[i] - inertia[j]) / (factors[i] * factors[j])
        for i in range(3)
        for j in range(3)
        if i != j
    }
    upper, lower, all_ = (_picked(gap, ranks, *pair) for pair in ((2, 1), (1, 0), (2, 0)))
    above = (y - middle).sign()
    fast = bounded.where(above > 0.0, upper * (y - low), lower * (high - y))
    slow = bounded.where(above > 0.0, all_ * (y - middle), all_ * (middle - y))
    turn = alpha * s
    period = (
        2.0 * np.pi / (Bounded(abs(turn.value), turn.bar) * bounded.mean(fast.sqrt(), slow.sqrt()))
    )
    period = Bounded(period.value, period.bar + 1.3e-16 * abs(period.value))  # of 2 pi
    rests = (above == 0.0) | (abs(turn.value) <= turn.bar)
    half = 0.5 * (D[0] + D[1] + D[2])
    second, third = D[0] * D[1] + D[0] * D[2] + D[1] * D[2], D[0] * D[1] * D[2]
    bracket = (half * half - second) * y + third
    kind = np.where(rests, 0.0, third.sign() * bracket.sign())
    pairs = inertia[0] * inertia[1] + inertia[0] * inertia[2] + inertia[1] * inertia[2]
    product = inertia[0] * inertia[1] * inertia[2]
    beta, slope = s * e * (pairs + s * product), e * (pairs + 2.0 * (s * product))
    W = alpha * p - 0.5 * beta
    F2 = alpha * half * (2.0 * p) - slope
    inside = ((y - low).value >= -(y - low).bar) & ((high - y).value >= -(high - y).bar)
    exists = inside & (alpha.value != 0.0) & np.isfinite(alpha.bar)
    return {
        "exists": exists,
        "certificate": third * bracket,
        "H": W - 0.5 * (s * F2),
        "F2": F2,
        "period": bounded.where(rests, np.nan, period),
        "turn_rate": alpha,
        "verdict": np.select([kind > 0.0, kind < 0.0], [STABLE, UNSTABLE], UNDECIDED),
    }


def _sorted(numbers):
    """Least, middle and largest of three Bounded, and their indices (3, ...)."""
    shape = np.broadcast_shapes(*(x.value.shape for x in numbers))
    values = np.stack([np.broadcast_to(x.value, shape) for x in numbers])
    bars = np.stack([np.broadcast_to(x.bar, shape) for x in numbers])
    ranks = np.argsort(values, axis=0, kind="stable")
    take = [np.take_along_axis(a, ranks, axis=0) for a in (values, bars)]
    return (*(Bounded(take[0][i], take[1][i]) for i in range(3)), ranks)


def _picked(gap, ranks, i, j):
    """D of rank i less D of rank j."""
    found = bounded.of(np.full(ranks.shape[1:], np.nan))
    for (k, m), value in gap.items():
        found = bounded.where((ranks[i] == k) & (ranks[j] == m), value, found)
    return found


def _adjugate(inertia):
    A1, A2, A3 = inertia
    return A2 * A3, A1 * A3, A1 * A2


def _times(a, b):
    return a * b


def _sum(terms):
    total = bounded.of(0.0)
    for term in terms:
        total = total + term
    return total
