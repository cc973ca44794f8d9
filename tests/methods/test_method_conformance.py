"""What every method promises, for each one found in its folder: its order, and bars that hold the error.

Family "hill": Mathieu's equation with q = 5, whose z varies strongly in time, over four periods, on fixed steps.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from hill_problems import mathieu

import survey.methods
from survey import modules
from survey.kernels.jit import inline, kernel
from survey.kernels.lanes import chain
from survey.measures import hill_effort
from survey.methods import dop853, rk4, taylor16

HILL = [n for n in modules.names(survey.methods) if "hill" in modules.load(survey.methods, n, "method").SERVES]
PROBLEM = mathieu([np.linspace(8.0, 16.0, 8)], [5.0], half_periods=8)


def fixed(method, steps):
    """Results of a chain of `steps` equal steps of the method (DOP853's step too, outside its step control)."""
    if getattr(method, "ADAPTIVE", False):
        return dop853_chain(steps)
    return hill_effort._call(PROBLEM, method, np.zeros(8, int), PROBLEM.p[0], steps)


def dop853_chain(steps):
    h, slopes = PROBLEM.span[0] / steps, np.empty((4, 12))
    samples = PROBLEM.sample(np.array([0]), np.array(dop853.NODES), steps)[0]
    out = np.full((8, 10), np.nan)
    for i, a in enumerate(PROBLEM.p[0]):
        whole = np.eye(2)
        for n in range(steps):
            p11, p12, p21, p22, *_ = dop853.hill_step(samples[n, 0] + a, h, slopes)
            whole = np.array([[p11, p12], [p21, p22]]) @ whole
        out[i, :4] = whole.T.ravel()
    return out


EXACT = fixed(taylor16, 512)


def errors(method, steps):
    return abs(fixed(method, steps)[:, :4] - EXACT[:, :4]).max()


def measured_order(method):
    """Slope of log error where the error lies between rounding and the realm of higher terms."""
    steps = np.unique(np.geomspace(20, 6000, 90).astype(int) // 2 * 2)
    error = np.array([errors(method, n) for n in steps])
    scale = abs(EXACT[:, :4]).max()
    window = (error < 1e-6 * scale) & (error > 1e-11 * scale)
    assert window.sum() >= 4
    return -np.polyfit(np.log(steps[window]), np.log(error[window]), 1)[0]


@pytest.mark.parametrize("name", HILL)
def test_hill_order(name):
    method = modules.load(survey.methods, name, "method")
    # Above order 8 the window of double precision holds less than a factor of 3 in the step: see test_taylor16.
    assert abs(measured_order(method) - method.ORDER) < (0.15 if method.ORDER <= 8 else 1.0)


def bars_hold(method):
    """At every effort, each true error lies within its bar, and no bar is 1000 times the median error's ratio."""
    held = []
    for steps in hill_effort.LADDER[3:17]:
        if (PROBLEM.frequency * PROBLEM.span[:, None] / steps > hill_effort.LONGEST).any():
            continue
        out = fixed(method, int(steps))
        held.append(np.all(abs(out[:, :4] - EXACT[:, :4]) <= out[:, 4:8] + EXACT[:, 4:8]))
    return all(held) and len(held) > 5


@pytest.mark.parametrize("name", [n for n in HILL if n != "dop853"])
def test_hill_bars(name):
    assert bars_hold(modules.load(survey.methods, name, "method"))


@inline
def wrong_step(f, c2, p, h):
    a, b, c, d, d11, d12, d21 = rk4.hill_step(f, c2, p, h)
    return a, b + 1e-3 * h * h * h, c, d, d11, d12, d21


@kernel
def wrong_chain(samples, c2, h, p, ends, out):
    chain(rk4.samples_only, wrong_step, rk4.WIDTH, samples, c2, h, p, ends, out)


def test_the_checks_see_a_broken_method():
    """A Runge-Kutta step with an error of h^3 in one entry claims order 4 and bars that do not hold."""
    broken = SimpleNamespace(NODES=rk4.NODES, ORDER=4, hill_chain=wrong_chain)
    assert not bars_hold(broken)
    assert abs(measured_order(broken) - 4) > 0.15
