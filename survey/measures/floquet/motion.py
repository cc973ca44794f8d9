"""A motion of a linear periodic system over some periods, and its multipliers: the trajectory of a point."""

from math import ceil

import numpy as np

from survey.kernels.math.roundoff import ROUNDOFF_UP
from survey.measures import linear_motion
from survey.measures.floquet import monodromy
from survey.scene import Trajectory

PERIODS, GROWTH = 6, 7.0  # number of periods, unless the motion grows or decays by e^7
REACH, LEAST, MOST = 0.1, 120, 20_000  # norm of A times half a step; steps per period


def solve(system, states, point, answer, time):
    """The Trajectory of one point (1, parameters) from the real part of the leading multiplier's
    eigenvector.
    """
    points = monodromy.SystemPoints(system, point)
    period = float(points.period[0])
    n = system.n
    rate = abs(np.log(max(float(answer["spectral_radius"]), 1e-300)))
    periods = (
        ceil(time / period)
        if time is not None
        else int(np.clip(GROWTH / max(rate, 1e-3), 1, PERIODS))
    )
    matrices, errors, lengths = _sampled(points, n)
    scale = points.scale[0]
    terms = abs(matrices).max(axis=1) + errors.max(axis=1) / ROUNDOFF_UP
    t, Y, bars = linear_motion.fundamental(matrices, lengths, max(1, periods), scale, terms)
    if time is not None:
        kept = t <= time * (1 + 1e-12)
        t, Y, bars = t[kept], Y[kept], bars[kept]
    start = _leading(points)
    motion, off = Y @ start, bars @ abs(start) + 2 * n * ROUNDOFF_UP * (abs(Y) @ abs(start))
    re, im, bar = (
        np.asarray(answer[name])
        for name in ("multiplier_re", "multiplier_im", "multiplier_re_error")
    )
    data = {
        "t": ("t", t, {"long_name": "time", "symbol": "t", "units": "1"}),
        "multiplier": (
            "multiplier",
            np.arange(1, re.size + 1),
            {"long_name": "number of the multiplier"},
        ),
        **linear_motion.described(re + 1j * im, bar),
    }
    names = [name if name not in data else f"{name}_state" for name in states]
    for i, name in enumerate(names):
        words = f"{states[i]}, from {start[i]:.6g} at t = 0"
        data |= linear_motion.value(
            "t", name, rf"\mathrm{{{states[i]}}}", words, motion[:, i], off[:, i]
        )
    shown = names if n <= 4 else names[: n // 2][:4]
    return Trajectory(data, (("lines", "t", *shown), ("multipliers",)))


def _leading(points):
    """The real part of the eigenvector of the leading multiplier, its largest component 1."""
    first = np.zeros(1, dtype=np.int64)
    M = monodromy.solve(
        points, monodromy.method_of("auto"), 1e-10, np.ones(1), first, sharp=False
    ).M
    values, vectors = np.linalg.eig(M[0])
    vector = vectors[:, abs(values).argmax()]
    vector = (vector / vector[abs(vector).argmax()]).real
    return np.where(abs(vector) < 1e-12, 0.0, vector)


def _sampled(points, n):
    """A at the nodes of all steps of a period (steps, 9, n, n), bounds of its rounding, and the
    steps' lengths.
    """
    found = []
    for group in points.groups:
        for k, program in enumerate(group.programs):
            low, high = points.edges[group.own[0], k : k + 2]
            count = (
                int(np.clip(points.size[0, k] * (high - low) / (2 * REACH), LEAST, MOST))
                if high > low
                else 0
            )
            if not count:
                continue
            h = (high - low) / count
            t = low + h * (np.arange(count)[:, None] + linear_motion.NODES)
            A, E = program.at(points.points, np.minimum(t, high).reshape(1, -1), n)
            shape = (count, linear_motion.NODES.size, n, n)
            found.append((A.reshape(shape), E.reshape(shape), np.full(count, h)))
    return (np.concatenate(parts) for parts in zip(*found, strict=True))
