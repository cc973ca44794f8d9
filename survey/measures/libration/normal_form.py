"""Formal stability of an equilibrium with frequencies omega1, -omega2, 1 by its normal form of
orders 4 and 6.

H = L + N + M + ..., L = omega1 r1 - omega2 r2 + r3, N and M the terms of orders 4 and 6: equation
numbers as in `scenes/libration.md`. A method serves by `coefficients(mu, order)`, values and error
bounds (16, N) of the coefficients in the order of LABELS; by `combined(mu)` also, if it knows their
combinations better than their sums do.

Formally stable by order 4: L = N = 0 has no solution r >= 0 but 0, so L^4 + (H - L)^2 is definite.
Else, by order 6: M is not 0 on the one ray of L = N = 0 in the octant r >= 0, and no resonance of
order 6 or less is met. A verdict is given only where the error bounds leave no other.
"""

from itertools import product
from math import gcd

import numpy as np

from survey import measures
from survey.kernels.libration.closed_forms import MARGIN, MU_1, MU_2, MU_R, linear
from survey.kernels.libration.coefficients import LABELS
from survey.kernels.math.roundoff import ROUNDOFF
from survey.measures.libration import rays
from survey.methods import rational, rational_double
from survey.status import INVALID_PARAMETERS, OK, OVERFLOW

AUTO = (rational, rational_double)  # the second where the first leaves something open
UNDECIDED, UNSTABLE, ORDER_4, ORDER_6, RESONANT, BOUNDARY = range(-1, 5)
COMBINED = ("a20", "a11", "a02", "D4", "D6")
FLOATS = ("omega1", "omega2", *COMBINED, "M_ray", "resonance_distance")
HIGHEST = 8  # the greatest order of the resonances considered
ROUNDINGS = 16  # in a sum of products here
FILL = -99  # of a resonance where there is none


def vectors(highest):
    """Integer vectors k != 0 with k3 even and |k1| + |k2| + |k3| <= highest, by order: k and -k
    once, no multiples.
    """
    numbers = range(-highest, highest + 1)
    found = [
        k
        for k in product(numbers, numbers, numbers)
        if k[2] % 2 == 0 and 0 < sum(map(abs, k)) <= highest
    ]
    found = [k for k in found if next(filter(None, k)) > 0 and gcd(k[0], k[1], k[2] // 2) == 1]
    return np.array(sorted(found, key=lambda k: (sum(map(abs, k)), k)), dtype=float)


VECTORS = vectors(HIGHEST)


def solve(mu, method, rtol):
    """Every output, its error bound, `verdict` and `status` at mu (N); `c` and its error bound are
    (N, 16).

    `method` is the name of a method, or "auto": closed forms in float64, and in double-double where
    `rtol` is missed or the verdict is left open.
    """
    first, *finer = AUTO if method == "auto" else (measures.method(method),)
    answer = answers(mu, first)
    for other in finer:
        open_ = missed(answer, rtol) | (
            (answer["verdict"] == UNDECIDED) & (answer["status"] != INVALID_PARAMETERS)
        )
        if open_.any():
            for name, values in answers(mu[open_], other).items():
                answer[name][open_] = values
    return answer


def answers(mu, method):
    """All outputs at mu (N), by one method."""
    omega = np.empty((2, mu.size))
    nearest = np.empty(mu.size, dtype=np.int64)
    distance = np.empty((2, mu.size))
    linear(mu, VECTORS, omega, nearest, distance)
    c, combined = forms(method, mu, omega)
    ray = on_ray(c, combined, omega)
    values = np.vstack([omega, combined[0], ray[0], distance[0]])
    bars = np.vstack([ROUNDOFF * omega, combined[1], ray[1], distance[1]])
    stable = np.isfinite(omega[0])
    lost = stable & ~(np.isfinite(c).all(axis=(0, 1)) & np.isfinite(combined).all(axis=(0, 1)))
    values[:, lost], bars[:, lost] = np.nan, np.nan
    out = {
        "status": np.where(np.isnan(mu), INVALID_PARAMETERS, np.where(lost, OVERFLOW, OK)).astype(
            np.int8
        )
    }
    out["verdict"] = np.where(out["status"] == OK, verdict(mu, combined, ray), UNDECIDED).astype(
        np.int8
    )
    orders = abs(VECTORS).sum(axis=1).astype(np.int32)
    out["resonance_order"] = np.where(stable & ~lost, orders[nearest], -1).astype(np.int32)
    for name, value, bar in zip(FLOATS, values, bars, strict=True):
        out[name], out[f"{name}_error"] = value, bar
    out["c"], out["c_error"] = (np.where(lost, np.nan, part).T.copy() for part in c)
    for name, value in rays.answers(c, combined, omega).items():
        out[name] = np.where(lost[:, None] if value.ndim == 2 else lost, np.nan, value)
    out["resonance"] = np.where((stable & ~lost)[:, None], VECTORS[nearest], FILL).astype(np.int32)
    return out


def missed(answer, rtol):
    """Points where an error bound exceeds rtol (1 + |value|)."""
    wide = [
        answer[f"{name}_error"] > rtol * (1 + abs(answer[name])) for name in (*FLOATS, *rays.FLOATS)
    ]
    several = [
        (answer[f"{name}_error"] > rtol * (1 + abs(answer[name]))).any(axis=1)
        for name in ("c", *rays.RAYS)
    ]
    return np.any([*wide, *several], axis=0)


def forms(method, mu, omega):
    """Coefficients (2, 16, N) and their COMBINED forms (2, 5, N): values, then error bounds."""
    number = len(LABELS)
    if hasattr(method, "combined"):
        both = np.stack(method.combined(mu))
        return both[:, :number], both[:, number:]
    c = np.stack(method.coefficients(mu, 6))
    return c, np.stack(combine(*c, *omega), axis=1)


def combine(c, bars, w1, w2):
    """a20, a11, a02 (3.10), D4 and D6 from the coefficients (16, N), each with its error bound."""
    sums = (
        {"200": 1.0, "101": -w1, "002": w1 * w1},
        {"110": 1.0, "101": w2, "011": -w1, "002": -2.0 * w1 * w2},
        {"020": 1.0, "011": w2, "002": w2 * w2},
        {"200": w2 * w2, "110": w1 * w2, "020": w1 * w1},
        {"300": w2**3, "210": w2 * w2 * w1, "120": w2 * w1 * w1, "030": w1**3},
    )
    return [
        _sum({LABELS.index(label): weight for label, weight in terms.items()}, c, bars)
        for terms in sums
    ]


def _sum(terms, c, bars):
    """The sum of weight * coefficient, and its error bound."""
    size = sum(abs(weight * c[row]) for row, weight in terms.items())
    bar = sum(abs(weight) * bars[row] for row, weight in terms.items())
    return np.stack(
        [
            sum(weight * c[row] for row, weight in terms.items()),
            MARGIN * (bar + ROUNDINGS * ROUNDOFF * size),
        ]
    )


def on_ray(c, combined, omega):
    """M on the ray (alpha2, 1, beta2) of L = N = 0 (3.11) and its bound, where the ray lies in the
    octant; else NaN.
    """
    ray = np.full(omega.shape, np.nan)
    (_, _, a02, D4, _), (_, _, da02, dD4, _) = combined
    inside = (a02 > da02) & (-D4 > dD4)
    if inside.any():
        ray[:, inside] = _inside(c[..., inside], combined[..., inside], *omega[:, inside])
    return ray


def _inside(c, combined, w1, w2):
    """M on the ray and its error bound, where a02 > 0 > D4."""
    (a20, a11, a02, _, _), (da20, da11, da02, _, _) = combined
    # the root of a20 alpha^2 + a11 alpha + a02 that is 0 at mu_d; a11 < 0 < a20 here, so nothing
    # cancels
    square = a11 * a11 - 4.0 * a20 * a02
    dsquare = 2.0 * abs(a11) * da11 + 4.0 * (abs(a20) * da02 + abs(a02) * da20)
    root = np.sqrt(square)
    divisor = root - a11
    droot = 0.5 * (dsquare + 8.0 * ROUNDOFF * (a11 * a11 + abs(4.0 * a20 * a02))) / root
    alpha = 2.0 * a02 / divisor
    dalpha = alpha * (da02 / a02 + (droot + da11) / divisor + 8.0 * ROUNDOFF)
    beta = w2 - alpha * w1
    dbeta = w1 * dalpha + 4.0 * ROUNDOFF * (w2 + alpha * w1)
    return _cubic(*c, alpha, beta, dalpha, dbeta)


def _cubic(c, bars, alpha, beta, dalpha, dbeta):
    """M (3.14) at (alpha, 1, beta), and its error bound."""
    value = bar = size = along_alpha = along_beta = 0.0
    for row, label in enumerate(LABELS):
        i, j, k = map(int, label)
        if i + j + k != 3:
            continue
        power = alpha**i * beta**k
        value = value + c[row] * power
        bar = bar + bars[row] * abs(power)
        size = size + abs(c[row] * power)
        along_alpha = along_alpha + (i * c[row] * alpha ** (i - 1) * beta**k if i else 0.0)
        along_beta = along_beta + (k * c[row] * alpha**i * beta ** (k - 1) if k else 0.0)
    bar = bar + abs(along_alpha) * dalpha + abs(along_beta) * dbeta + ROUNDINGS * ROUNDOFF * size
    return np.stack([value, MARGIN * bar])


def verdict(mu, combined, ray):
    """The code of every mu that is a number."""
    (_, _, a02, D4, _), (_, _, da02, dD4, _) = combined
    certain = (abs(a02) > da02) & (abs(D4) > dD4)
    code = np.full(mu.size, UNDECIDED)
    code[certain & ((a02 > 0.0) == (D4 > 0.0))] = ORDER_4
    code[abs(ray[0]) > ray[1]] = ORDER_6
    code[mu > MU_R[0]] = UNSTABLE
    code[(mu == MU_1[0]) | (mu == MU_2[0])] = RESONANT  # the float64 nearest to mu1, mu2
    code[mu == MU_R[0]] = BOUNDARY
    return code
