"""Motions of a whole body: (w, nu) at given times with error bars, by the steps of a method.

A row that misses the requested accuracy is solved again with smaller steps, and the better answer is
kept. Motions into the past are those of the reversed body: (B, lambda, w, t) -> -(B, lambda, w, t).
"""

import numpy as np

from survey.kernels.body.motion import FLOATS, STATE
from survey.kernels.cylinder.gyrostat import LAMBDA, ROWS, B
from survey.kernels.cylinder.steps import OK
from survey.measures.cylinder.solution import STEPS, attempts

_REVERSED = np.ones((ROWS, 1))
_REVERSED[B : B + 3] = _REVERSED[LAMBDA] = -1.0


def trajectories(method, G, starts, times, rtol):
    """floats (rows, n, FLOATS) and status (rows, n) at `times` (rows, n), of either sign."""
    floats = np.full((*times.shape, FLOATS), np.nan)
    status = np.zeros(times.shape, np.int64)
    for back in (False, True):
        mine = times < 0.0 if back else times >= 0.0
        picked = mine.any(axis=1)
        if not picked.any():
            continue
        systems, first = G[picked], starts[picked]
        if back:
            systems, first = systems * _REVERSED, first * np.repeat([-1.0, 1.0], 3)
        part, ends = _ahead(
            method, systems, first, np.where(mine, np.abs(times), np.inf)[picked], rtol
        )
        if back:
            part[..., :3] *= -1.0
        for result, new in ((floats, part), (status, ends)):
            held = result[picked]
            held[mine[picked]] = new[mine[picked]]
            result[picked] = held
    return floats, status


def _ahead(method, G, starts, times, rtol):
    order = np.argsort(times, axis=1, kind="stable")
    ascending = np.take_along_axis(times, order, axis=1)
    back = np.argsort(order, axis=1)
    floats, status = np.full((*times.shape, FLOATS), np.nan), np.full(times.shape, -1)
    left = np.arange(len(G))
    for tolerance in attempts(method, rtol):
        new = np.full((len(left), times.shape[1], FLOATS), np.nan)
        ends = np.zeros(len(left), np.int64)
        method.body_trajectories(
            np.ascontiguousarray(G[left]), np.ascontiguousarray(starts[left]), np.ascontiguousarray(ascending[left]),
            tolerance, STEPS * min(method.FLOW_WORK, 10), new, ends,
        )  # fmt: skip
        new_status = np.where(np.isfinite(new[..., 0]), OK, ends[:, None])
        held, held_status = floats[left], status[left]
        better = ~(_worst(new) >= _worst(held)) | (held_status < 0)
        held[better], held_status[better] = new[better], new_status[better]
        floats[left], status[left] = held, held_status
        missed = _missed(floats[left], rtol) & np.isfinite(ascending[left])
        left = left[missed.any(axis=1)]
        if not left.size:
            break
    take = back[..., None]
    return np.take_along_axis(floats, take, axis=1), np.take_along_axis(status, back, axis=1)


def _worst(floats):
    """The widest bar of each state; infinite where there is none."""
    bars = floats[..., STATE:].max(axis=-1)
    return np.where(np.isfinite(bars), bars, np.inf)


def _missed(floats, rtol):
    """Where the answer misses the requested accuracy, or there is none."""
    return ~(floats[..., STATE:] <= rtol * (1.0 + np.abs(floats[..., :STATE]))).all(axis=-1)
