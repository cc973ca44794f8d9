"""CyRK's C++ solver with a compiled right-hand side (`cyjit`), called from a compiled loop over the
points.

This is `cysolve_ivp` by its way in from Numba, `nbsolve2_ivp`; through Python, `pysolve_ivp` costs
a call per stage. Measured: DOP853 and its newer Vern8 take the same time, Vern7 and Tsit5 more.
"""

from functools import cache
from math import cos, sin

import numba
import numpy as np
from CyRK import cyjit, nbsolve2_ivp

POINTS = 600


def integrate(system, rtol):
    address = _compiled(system.slope).address
    parameters = np.ascontiguousarray(system.parameters)
    if system.samples is None:
        ends = np.empty_like(system.start)
        _loop(address, system.start, parameters, system.span, rtol, ends)
        return ends
    states = np.full((len(system.span), system.samples.size, system.start.shape[1]), np.nan)
    _sampled(address, system.start, parameters, system.span, system.samples, rtol, states)
    return states


@cache
def _compiled(slope):
    slope = numba.njit(error_model="numpy")(slope)  # a division by zero is a step to be refused

    @cyjit
    def fill(out, t, state, parameters):
        slopes = slope(state, parameters, sin, cos)
        for i in range(len(slopes)):
            out[i] = slopes[i]

    return fill


@numba.njit(error_model="numpy")
def _loop(address, start, parameters, span, rtol, ends):
    for i in range(len(span)):
        solved = nbsolve2_ivp(address, (0.0, span[i]), start[i], method="DOP853", args=parameters[i],
                              rtol=rtol, atol=rtol, force_retain_solver=False)  # fmt: skip
        ends[i] = solved.y[:, -1]
        solved.free()


@numba.njit(error_model="numpy")
def _sampled(address, start, parameters, span, samples, rtol, states):
    for i in range(len(span)):
        solved = nbsolve2_ivp(address, (0.0, span[i]), start[i], method="DOP853", t_eval=samples * span[i],
                              args=parameters[i], rtol=rtol, atol=rtol, force_retain_solver=False)  # fmt: skip
        values = solved.y
        states[i, : values.shape[1]] = values.T
        solved.free()
