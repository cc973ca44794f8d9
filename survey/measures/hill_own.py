"""A user's z(u, p) as a Hill problem: every point a row of its own, and what its steps need measured from z itself.

z is sampled at Chebyshev points on each piece between its breaks. From the coefficients c_k on a piece of length 2 L:

    rate    max over k of (k / L) / (1 + ln(max |c| / |c_k|)): 1 / distance of the nearest singularity where c_k falls
            geometrically, the highest frequency that matters where z is entire
    noise   what does not fall: the rounding of z and of u, and what is too fine to be resolved

The noise enters the bars: z is handed on as (z - B) + B, so that its rounding counts relative to B >= max |z|, and
B is as large as the noise asks. All depends on the point alone.

Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013), chapters 3, 7 and 8.
"""

from functools import cache, lru_cache
from types import SimpleNamespace

import numpy as np

from survey.kernels.hill import RESULTS
from survey.kernels.jit import fresh, inline
from survey.measures import hill, hill_effort
from survey.methods import dop853

SIZES = (65, 513, 4097)
# Relative to max |z|: z is resolved where its last coefficients are below the first, rough where above the second.
RESOLVED, ROUGH = 1e-14, 1e-8
# An even z may differ from its mirror image by so much, which then counts as noise.
MIRRORED = 1e-8
# What the bars of every method allow at least for the rounding of z, relative to B.
ROUNDING = 8.8e-16
# z is asked for no nearer to a break than this share of the period: rounding decides there on which side.
SLACK = 2.0**-50
# Steps are dealt out by rate, and by frequency at this share of it.
BY_PHASE = 0.15
CALL_SAMPLES = 4_000_000


@lru_cache(maxsize=32)
def kernels(z):
    """Kernels of the function z(u, p): `look(points, u, out)`, z at u (N, M); `walk`, DOP853 point by point."""
    z = inline(getattr(z, "py_func", z))

    @fresh
    def look(points, u, out):
        for i in range(u.shape[0]):
            for j in range(u.shape[1]):
                out[i, j] = z(u[i, j], points[i])

    @inline
    def potential(u, p, point, scale):
        return z(u, point), scale

    @fresh
    def walk(points, edges, pieces, slack, scale, tolerance, out, reached):
        for i in range(len(points)):
            own = edges[i, : pieces[i] + 1]
            reached[i] = dop853.hill_walk_pieces(
                potential, 0.0, points[i], scale[i], own, slack[i], tolerance[i], out[i]
            )

    return SimpleNamespace(look=look, walk=walk)


class Raised(Exception):
    """z raised its cause, or cannot be compiled."""


def at(z, points, u):
    """z at the places u (N, M) of the points (N, n)."""
    out = np.empty(u.shape)
    try:
        kernels(z).look(np.ascontiguousarray(points), np.ascontiguousarray(u), out)
    except Exception as error:
        raise Raised from error
    return out


def problem(z, points, edges, period, slack, even):
    """The Hill problem of z at the points (N, n), and where z is `rough`, not smooth between its breaks.

    `edges` (N, P + 1): 0, the breaks, and the end of the part that is solved, T/2 if `even`, else T; where a point has
    fewer, its last one repeated. Points whose z is rough, not finite, or not even where it should be, have span NaN.
    """
    size, rate, scale, rough = measured(z, points, edges, period if even else None, slack)
    length, end = np.diff(edges, axis=1), edges[:, -1]
    pieces = np.count_nonzero(length > 0, axis=1)
    frequency, more = np.sqrt(size), np.where(pieces > 1, pieces, 0) / end
    # Each piece gets steps by its weight: so many in all that each has what it needs, and one more.
    weight = length * np.maximum(np.maximum(BY_PHASE * frequency, rate), 1 / end[:, None])
    total = np.cumsum(weight, axis=1)[:, -1:]
    need = length * total / (np.where(weight > 0, weight, 1) * end[:, None])
    frequency = (need * frequency).max(axis=1) + hill_effort.LONGEST * more

    def steps(rows, number):
        """Starts and lengths of the steps (rows, number), and the places between which z may be asked for in each."""
        i = np.arange(rows.size)[:, None]
        count = np.floor((number - pieces[rows, None]) * (weight[rows] / total[rows])).astype(int) + (length[rows] > 0)
        count[i[:, 0], weight[rows].argmax(axis=1)] += number - count.sum(axis=1)
        last, k = np.cumsum(count, axis=1), np.arange(number)
        piece = (k[:, None] >= last[:, None]).sum(axis=2)
        low, high = edges[rows[:, None], piece], edges[rows[:, None], piece + 1]
        h = (high - low) / count[i, piece]
        return low + (k - (last - count)[i, piece]) * h, h, low + slack[rows, None], high - slack[rows, None]

    def sample(rows, nodes, number):
        start, h, low, high = (values[:, :, None] for values in steps(rows, number))
        u = np.clip(start + h * nodes, low, high)
        out = np.empty((rows.size, number, 2, nodes.size))
        out[:, :, 1] = scale[rows, None, None]
        out[:, :, 0] = at(z, points[rows], u.reshape(rows.size, -1)).reshape(u.shape) - out[:, :, 1]
        return out

    def walk(rows, p, tolerance):
        out, reached = np.full((rows.size, RESULTS), np.nan), np.zeros(rows.size, np.bool_)
        kernels(z).walk(points[rows], edges[rows], pieces[rows], slack[rows], scale[rows], tolerance, out, reached)
        return out, reached

    own = hill.Problem(
        p=np.ones((len(points), 1)), span=np.where(rough | np.isnan(scale), np.nan, end), c2=0.0,
        bound=np.column_stack([frequency**2, 0 * end, 0 * end]), rate=(need * rate).max(axis=1) + 2 * more,
        sample=sample, walk=walk, cut=lambda rows, number: steps(rows, number)[1], whole=not even,
    )  # fmt: skip
    return own, rough


def measured(z, points, edges, period, slack):
    """Of each piece `size` = max |z| and `rate` (N, P); of each point `scale` = B, NaN if z is not finite, and `rough`.

    With a `period` (N), z is compared with its mirror image, and scale is NaN where they differ.
    """
    shape, owner = (len(points), edges.shape[1] - 1), np.repeat(np.arange(len(points)), edges.shape[1] - 1)
    left, right = edges[:, :-1].reshape(-1, 1), edges[:, 1:].reshape(-1, 1)

    def values(pieces, number, mirrored=False):
        own, ends = owner[pieces], slack[owner[pieces], None]
        u = left[pieces] + (right - left)[pieces] * chebyshev_points(number)
        u = np.clip(u, left[pieces] + ends, right[pieces] - ends)
        return at(z, points[own], period[own, None] - u if mirrored else u)

    size, rate, noise, last = np.empty((4, owner.size))
    unresolved = np.arange(owner.size)
    for number in SIZES:
        for some in np.array_split(unresolved, unresolved.size * number // CALL_SAMPLES + 1):
            size[some], rate[some], noise[some], last[some] = spectrum(values(some, number))
        unresolved = unresolved[last[unresolved] > RESOLVED * size[unresolved]]
    length = (right - left)[:, 0]
    rate = np.where(length > 0, 2 * rate / np.where(length > 0, length, 1), 0)
    off = 0 * size
    if period is not None:
        everywhere = np.arange(owner.size)
        off = abs(values(everywhere, SIZES[0]) - values(everywhere, SIZES[0], mirrored=True)).max(axis=1)
    size, rate, noise, last, off = (a.reshape(shape) for a in (size, rate, noise, last, off))
    scale, off = size.max(axis=1), off.max(axis=1)
    known = np.maximum(scale, np.maximum(noise.max(axis=1), off) / ROUNDING)
    return size, rate, np.where(off <= MIRRORED * scale, known, np.nan), (last > ROUGH * size).any(axis=1)


def spectrum(values):
    """max |z|, rate (on [-1, 1]), noise and the largest of the last coefficients, from z at Chebyshev points (n, M)."""
    n = values.shape[1] - 1
    size = abs(values).max(axis=1)
    series = abs(np.fft.rfft(np.concatenate([values, values[:, -2:0:-1]], axis=1), axis=1).real) / n
    tail = series[:, -(n // 4) :]
    last, noise = tail.max(axis=1), 3 * np.sqrt(0.5 * n * (tail**2).mean(axis=1))
    least = np.maximum(RESOLVED * size, 2 * last)[:, None]
    fall = np.log(series.max(axis=1, keepdims=True) / np.maximum(np.maximum(series, least), 1e-300))
    rate = np.where(series > least, np.arange(n + 1) / (1 + fall), 0).max(axis=1)
    return size, rate, noise, last


@cache
def chebyshev_points(number):
    """Chebyshev points of the second kind on [0, 1], both ends among them."""
    return 0.5 - 0.5 * np.cos(np.pi * np.arange(number) / (number - 1))
