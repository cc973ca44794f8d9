"""Motions of linear equations Y' = A(t) Y between their known multipliers: for pictures, with an
error bar each.

Gauss collocation with three nodes, order 6; each step is taken at once and in two halves, whose difference estimates
the local error d. It is carried to the end by the linearised flow: beside each column of Y goes the matrix V of its
error ellipse, as in `survey.kernels.lanes`: V <- P V P' + diag(d^2), |error_i| <= sqrt(m n V_ii) after n steps of m
equations.

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.7, table
7.4.
"""

import numpy as np

from survey.errors import BadInput
from survey.kernels.math.roundoff import EPS

MOST = 4e6  # numbers in the matrices of a motion
SAFETY = 4 / 63  # of the difference, of order 6, between a step and its halves
_ROOT = np.sqrt(15.0)
GAUSS = 0.5 + np.array([-0.1, 0.0, 0.1]) * _ROOT
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18
_INNER = np.array([
    [5 / 36, 2 / 9 - _ROOT / 15, 5 / 36 - _ROOT / 30],
    [5 / 36 + _ROOT / 24, 2 / 9, 5 / 36 - _ROOT / 24],
    [5 / 36 + _ROOT / 30, 2 / 9 + _ROOT / 15, 5 / 36],
])  # fmt: skip
# Where in each step the coefficients are asked for: in its two halves, then in the full step.
NODES = np.concatenate([0.5 * GAUSS, 0.5 + 0.5 * GAUSS, GAUSS])


def fundamental(matrices, lengths, periods, scale=1.0, terms=None):
    """t, Y at the ends of all steps of `periods` periods, and its bounds (steps * periods + 1, n,
    n); Y = 1 at t = 0.

    `matrices` (steps, 9, n, n) holds A at the NODES of each step of one period, `lengths` (steps) how long they are.
    `scale` (n) holds the sizes of Y's components, `terms` (steps, n, n) what the rounding of A is relative to (or |A|).
    """
    h = lengths[:, None, None]
    n = matrices.shape[-1]
    if len(lengths) * periods * n * n > MOST:
        most = max(1, int(MOST / (len(lengths) * n * n))) * float(lengths.sum())
        raise BadInput(
            f"time: a motion of {periods:,} periods is too long to be drawn; give at most {most:.3g}"
        )
    terms = abs(matrices).max(axis=1) if terms is None else terms
    halves = [_step(matrices[:, 3 * i : 3 * i + 3], 0.5 * h) for i in range(2)]
    steps = halves[1] @ halves[0]
    units = np.divide.outer(scale * np.ones(n), scale * np.ones(n))
    off = abs(steps - _step(matrices[:, 6:], h)) / units
    # an entry's difference may vanish by symmetry: the largest stands for all
    local = SAFETY * off.max(axis=(1, 2), keepdims=True) * units + EPS * (
        4 * np.eye(n) + 12 * h * terms
    )
    y, bars = _chain(steps, local, units, periods)
    ends = np.cumsum(lengths.astype(np.longdouble))
    t = np.concatenate([[0.0], (ends + ends[-1] * np.arange(periods)[:, None]).ravel()]).astype(
        float
    )
    with np.errstate(all="ignore"):
        # t is rounded
        return t, y, bars + 4 * EPS * t[:, None, None] * (terms.max(axis=0) @ abs(y))


def _step(a, h):
    """Y of each step (steps, n, n) from A at its nodes (steps, 3, n, n): K_i = A_i (1 + h sum a_ij K_j)."""
    steps, _, n, _ = a.shape
    left = -h[:, None, None] * _INNER[None, :, :, None, None] * a[:, :, None]
    left = left.transpose(0, 1, 3, 2, 4).reshape(steps, 3 * n, 3 * n) + np.eye(3 * n)
    slopes = np.linalg.solve(left, a.reshape(steps, 3 * n, n)).reshape(steps, 3, n, n)
    return np.eye(n) + h * np.einsum("i,sijk->sjk", _WEIGHTS, slopes)


def _chain(steps, local, units, periods):
    """Products of the steps from the first on, period after period, and their error bounds, from
    the `local` ones.
    """
    number = len(steps) * periods
    n = steps.shape[-1]
    y, squares = np.empty((2, number + 1, n, n))
    y[0], squares[0], ellipses = np.eye(n), 0.0, np.zeros((n, n, n))  # an ellipse for each column
    diagonal = np.arange(n)
    with np.errstate(all="ignore"):
        for i in range(number):
            p = steps[i % len(steps)]
            ellipses = p @ ellipses @ p.T
            ellipses[:, diagonal, diagonal] += (local[i % len(steps)] @ abs(y[i])).T ** 2
            y[i + 1], squares[i + 1] = p @ y[i], ellipses[:, diagonal, diagonal].T
        # Cauchy and Schwarz: n components of each step's error add up, and V sums the squares of
        # all
        count = n * np.arange(number + 1)[:, None, None]
        relative = np.tile((local / units).sum(axis=(1, 2)), periods)
        # of the first order
        doubt = np.exp(np.concatenate([[0.0], np.cumsum(relative)]))[:, None, None]
        return y, doubt * np.sqrt(count * squares)


def of_trace(trace, bar):
    """The pair of multipliers l, 1/l with l + 1/l = `trace` (complex, known to `bar`), |l| >= 1, and their bounds.

    |sqrt(x + d) - sqrt(x)| <= min(sqrt |d|, |d / sqrt x|), x = trace^2 / 4 - 1 (to first order where x is complex).
    """
    x, d = 0.25 * complex(trace) ** 2 - 1, 0.5 * abs(trace) * bar + 0.25 * bar * bar
    root = np.sqrt(x)
    first = 0.5 * trace + root
    first = first if abs(first) >= 1 else 0.5 * trace - root
    off = 0.5 * bar + min(np.sqrt(d), d / abs(root) if root else np.inf) + 4 * EPS * abs(first)
    return np.array([first, 1 / first]), np.array(
        [off, off / (abs(first) * max(abs(first) - off, 0.5))]
    )


def mirrored(nodes):
    """What is known at the NODES of the steps of half a period (steps, 9, ...), run through backwards."""
    return nodes[::-1][:, [5, 4, 3, 2, 1, 0, 8, 7, 6]]


def value(dim, name, symbol, words, values, bars):
    """A variable along the time `dim`, and its error bound, as `Trajectory.data` holds them."""
    return {
        name: (dim, values, {"long_name": words, "symbol": symbol, "units": "1"}),
        f"{name}_error": (dim, bars, {"long_name": f"error bound of {name}", "units": "1"}),
    }


def described(multipliers, bars):
    """The variables of multipliers and their error bounds, along the dimension `multiplier`."""
    parts = {"real": np.real(multipliers), "imag": np.imag(multipliers), "error": bars}
    words = {"real": "real part of the multiplier", "imag": "imaginary part of the multiplier",
             "error": "error bound of the multiplier, the radius of a disc"}  # fmt: skip
    return {
        f"multiplier_{key}": ("multiplier", values, {"long_name": words[key], "units": "1"})
        for key, values in parts.items()
    }
