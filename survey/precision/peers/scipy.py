"""scipy's solve_ivp with DOP853, its method for high accuracy, one point after the other."""

from math import cos, sin

import numpy as np
from scipy.integrate import solve_ivp

POINTS = 30


def integrate(system, rtol):
    shares = np.ones(1) if system.samples is None else system.samples
    states = np.full((len(system.span), shares.size, system.start.shape[1]), np.nan)
    for i, (start, parameters, span) in enumerate(
        zip(system.start, system.parameters, system.span, strict=True)
    ):
        solved = solve_ivp(_slope, (0.0, span), start, "DOP853", shares * span, args=(system.slope, parameters),
                           rtol=rtol, atol=rtol)  # fmt: skip
        if span == 0.0:  # no step, and no value either
            states[i] = start
        elif solved.success:
            states[i] = np.transpose(solved.y)
    return states[:, 0] if system.samples is None else states


def _slope(_, state, slope, parameters):
    return slope(state, parameters, sin, cos)
