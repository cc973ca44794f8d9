"""Motions of linear equations Y' = A(t) Y between their known multipliers: for pictures, with an error bar each.

Gauss collocation with three nodes, order 6; each step is taken whole and in two halves, and the bar of the halves is
four times the largest difference so far (of order 6, truncation alone would be a 63rd of the difference).

Source: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.7, table 7.4.
"""

import numpy as np

EPS = 2.3e-16
_ROOT = np.sqrt(15.0)
GAUSS = 0.5 + np.array([-0.1, 0.0, 0.1]) * _ROOT
_WEIGHTS = np.array([5.0, 8.0, 5.0]) / 18
_INNER = np.array([
    [5 / 36, 2 / 9 - _ROOT / 15, 5 / 36 - _ROOT / 30],
    [5 / 36 + _ROOT / 24, 2 / 9, 5 / 36 - _ROOT / 24],
    [5 / 36 + _ROOT / 30, 2 / 9 + _ROOT / 15, 5 / 36],
])  # fmt: skip
# Where in each step the coefficients are asked for: in its two halves, and as a whole.
NODES = np.concatenate([0.5 * GAUSS, 0.5 + 0.5 * GAUSS, GAUSS])


def fundamental(matrices, lengths, periods):
    """Y at the ends of all steps of so many periods, and its bars (steps * periods + 1, n, n); Y = 1 at first.

    `matrices` (steps, 9, n, n) holds A at the NODES of each step of one period, `lengths` (steps) how long they are.
    """
    h = lengths[:, None, None]
    halves = [_step(matrices[:, 3 * i : 3 * i + 3], 0.5 * h) for i in range(2)]
    fine, coarse = _chain(halves[1] @ halves[0], periods), _chain(_step(matrices[:, 6:], h), periods)
    rounding = EPS * np.arange(1, len(fine) + 1)[:, None, None] * abs(fine).max(axis=(1, 2), keepdims=True)
    # the two are rounded differently, too: the largest difference so far tells of rounding where truncation is small
    return fine, 4 * np.maximum.accumulate(abs(fine - coarse), axis=0) + rounding


def _step(a, h):
    """Y of each step (steps, n, n) from A at its nodes (steps, 3, n, n): K_i = A_i (1 + h sum a_ij K_j)."""
    steps, _, n, _ = a.shape
    left = -h[:, None, None] * _INNER[None, :, :, None, None] * a[:, :, None]
    left = left.transpose(0, 1, 3, 2, 4).reshape(steps, 3 * n, 3 * n) + np.eye(3 * n)
    slopes = np.linalg.solve(left, a.reshape(steps, 3 * n, n)).reshape(steps, 3, n, n)
    return np.eye(n) + h * np.einsum("i,sijk->sjk", _WEIGHTS, slopes)


def _chain(steps, periods):
    """Products of the steps from the first on, period after period."""
    out = np.empty((len(steps) * periods + 1, *steps.shape[1:]))
    out[0] = np.eye(steps.shape[1])
    with np.errstate(all="ignore"):
        for i in range(len(out) - 1):
            out[i + 1] = steps[i % len(steps)] @ out[i]
    return out


def of_trace(trace, bar):
    """The pair of multipliers l, 1/l with l + 1/l = `trace` (complex, known to `bar`), |l| >= 1, and their bars.

    |sqrt(x + d) - sqrt(x)| <= min(sqrt |d|, |d / sqrt x|), x = trace^2 / 4 - 1 (to first order where x is complex).
    """
    x, d = 0.25 * complex(trace) ** 2 - 1, 0.5 * abs(trace) * bar + 0.25 * bar * bar
    root = np.sqrt(x)
    first = 0.5 * trace + root
    first = first if abs(first) >= 1 else 0.5 * trace - root
    off = 0.5 * bar + min(np.sqrt(d), d / abs(root) if root else np.inf) + 4 * EPS * abs(first)
    return np.array([first, 1 / first]), np.array([off, off / (abs(first) * max(abs(first) - off, 0.5))])


def mirrored(nodes):
    """What is known at the NODES of the steps of half a period (steps, 9, ...), run through backwards."""
    return nodes[::-1][:, [5, 4, 3, 2, 1, 0, 8, 7, 6]]


def value(dim, name, symbol, words, values, bars):
    """A variable along the time `dim`, and its error bar, as `Trajectory.data` holds them."""
    return {
        name: (dim, values, {"long_name": words, "symbol": symbol, "units": "1"}),
        f"{name}_error": (dim, bars, {"long_name": f"error bar of {name}", "units": "1"}),
    }


def described(multipliers, bars):
    """The variables of multipliers and their bars, along the dimension `multiplier`."""
    parts = {"real": np.real(multipliers), "imag": np.imag(multipliers), "error": bars}
    words = {"real": "real part of the multiplier", "imag": "imaginary part of the multiplier",
             "error": "error bound of the multiplier, the radius of a disc"}  # fmt: skip
    return {
        f"multiplier_{key}": ("multiplier", values, {"long_name": words[key], "units": "1"})
        for key, values in parts.items()
    }
