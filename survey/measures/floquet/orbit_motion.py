"""A periodic orbit over one period or longer, and its multipliers: the trajectory of a point."""

import numpy as np

from survey.kernels.math.roundoff import EPS
from survey.measures import linear_motion
from survey.measures.floquet import existence, monodromy
from survey.scene import Trajectory

MOST_PERIODS = 200
RTOL = 1e-10


def solve(equation, states, point, answer, time):
    """The Trajectory of one point (1, parameters), from the orbit's state at t = 0 and its period
    in `answer`.
    """
    x, dx, T = (
        np.atleast_1d(np.asarray(answer[name], dtype=float))[None]
        for name in ("x0", "x0_error", "period")
    )
    T = T[:, 0]
    method = monodromy.method_of("auto")
    [(_own, programs)] = equation.traced(point, x)
    numbers = programs.numbers(point)
    reach = method.floquet_reach(RTOL)
    steps = programs.flow(numbers, x, T, reach, derived=False)[3]
    path = existence.OrbitSteps(programs, numbers, x, T, steps, reach)
    path.propagate(method)
    bars = path.bars(dx)
    kept = slice(0, -1)  # of the nodes of a step: the last is the next one's first
    t = np.append(path.t[:, kept].ravel(), T)
    X, off = (
        np.concatenate(
            [one[:, :, kept].transpose(0, 2, 1).reshape(-1, x.shape[1]), one[-1:, :, -1]]
        )
        for one in (path.X, bars)
    )
    if time is not None:
        periods = int(min(np.ceil(time / T[0]), MOST_PERIODS))
        t = np.concatenate([t[:-1] + k * T for k in range(periods)] + [t[-1:] + (periods - 1) * T])
        X, off = (np.concatenate([one[:-1]] * periods + [one[-1:]]) for one in (X, off))
        shown = t <= time * (1 + 4 * EPS)
        t, X, off = t[shown], X[shown], off[shown]
    re, im, bar = (
        np.asarray(answer[name])
        for name in ("multiplier_re", "multiplier_im", "multiplier_re_error")
    )
    data = {
        "t": ("t", t, {"long_name": "time", "symbol": "t", "units": "1"}),
        "multiplier": (
            "multiplier",
            np.arange(1, len(re) + 1),
            {"long_name": "number of the multiplier"},
        ),
        **linear_motion.described(re + 1j * im, bar),
    }
    names = [name if name not in data else f"{name}_state" for name in states]
    for i, name in enumerate(names):
        words = f"{states[i]} on the orbit, from {x[0, i]:.6g} at t = 0"
        data |= linear_motion.value(
            "t", name, rf"\mathrm{{{states[i]}}}", words, X[:, i], off[:, i]
        )
    plane = (("plane", *names[:2]),) if len(names) > 1 else ()
    return Trajectory(data, (*plane, ("lines", "t", *names[:4]), ("multipliers",)))
