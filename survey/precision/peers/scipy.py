"""scipy's solve_ivp with DOP853, its method for high accuracy, one point after the other."""

from math import cos, sin

import numpy as np
from scipy.integrate import solve_ivp

POINTS = 30


def integrate(system, rtol):
    ends = np.empty_like(system.start)
    for i, (start, parameters, span) in enumerate(zip(system.start, system.parameters, system.span, strict=True)):
        solved = solve_ivp(_slope, (0.0, span), start, "DOP853", args=(system.slope, parameters), rtol=rtol, atol=rtol)
        ends[i] = solved.y[:, -1]
    return ends


def _slope(_, state, slope, parameters):
    return slope(state, parameters, sin, cos)
