"""The solutions y1, y2 of Hill's equation over some periods, and its multipliers: the trajectory of
a point.
"""

from math import ceil

import numpy as np

from survey.kernels.math.roundoff import EPS
from survey.measures import linear_motion
from survey.scene import Trajectory

PERIODS, GROWTH = 6, 7.0  # number of periods, unless the solution grows beyond e^7
# radians per step; steps per period, and half of them, are even
PHASE, LEAST, MOST = 0.05, 240, 20_000


def solve(problem, answer, time, name="t", damping=0.0):
    """The Trajectory of a Problem of one point, of which `answer` is known, up to the time `time`
    (or what suits).

    With `damping` c that of y'' + 2 c y' + z y = 0, whose multipliers are e^(-c T) times a pair l,
    1 / l.
    """
    period = float(answer["period"])
    periods = _number(float(answer["exponent"])) if time is None else max(1, ceil(time / period))
    fastest = np.sqrt(float(problem.bound[0] @ abs(problem.p[0, 0]) ** np.arange(3)))
    steps = int(np.clip(fastest * period / PHASE, LEAST, MOST)) // 4 * 4
    z, size, lengths = _sampled(problem, steps if problem.full_period else steps // 2)
    matrices = np.zeros((*z.shape, 2, 2))
    matrices[..., 0, 1], matrices[..., 1, 0], matrices[..., 1, 1] = 1.0, -z, -2.0 * damping
    terms = abs(matrices[:, 0])
    terms[:, 1, 0] = size
    t, y, bars = linear_motion.fundamental(
        matrices, lengths, periods, np.array([1.0, max(fastest, 1.0)]), terms
    )
    if time is not None:
        kept = t <= time * (1 + 1e-12)
        t, y, bars = t[kept], y[kept], bars[kept]
    loss = np.exp(-damping * period)
    trace = np.array([answer["discriminant"], answer["discriminant_error"]], float)
    pair, off = linear_motion.of_trace(*trace / loss)
    slack = 16 * EPS * abs(damping * period)  # of e^(-c T), relative, and so of both
    pair, off = loss * pair, loss * (off * (1 + 2 * slack) + 2 * slack * abs(pair) * bool(damping))
    data = {
        name: (name, t, {"long_name": "time", "symbol": name, "units": "1"}),
        "multiplier": ("multiplier", np.array([1, 2]), {"long_name": "number of the multiplier"}),
        **linear_motion.described(pair, off),
    }
    for i in range(2):
        words = f"solution with y(0) = {1 - i}, y'(0) = {i}"
        data |= linear_motion.value(
            name, f"y{i + 1}", f"y_{i + 1}", words, y[:, 0, i], bars[:, 0, i]
        )
    return Trajectory(data, (("lines", name, "y1", "y2"), ("multipliers",)))


def _number(exponent):
    """The number of periods that suits a solution with this growth exponent per period."""
    return int(np.clip(GROWTH / exponent if exponent > 0 else PERIODS, 1, PERIODS))


def _sampled(problem, steps):
    """z at the nodes of all steps of a period (steps, 9), the size of the terms whose sum it is,
    and their lengths.
    """
    c0, c1 = problem.sample(np.array([0]), linear_motion.NODES, steps)[0].transpose(1, 0, 2)
    p, lengths = problem.p[0, 0], problem.lengths(np.array([0]), steps)[0]
    z = c0 + p * c1 + p * p * problem.c2
    size = (abs(c0) + abs(p * c1) + p * p * problem.c2).max(axis=1)
    if problem.full_period:
        return z, size, lengths
    z = np.concatenate([z, linear_motion.mirrored(z)])  # z(T - t) = z(t)
    return z, np.concatenate([size, size[::-1]]), np.concatenate([lengths, lengths[::-1]])
