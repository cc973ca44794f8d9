"""What every method in the folder promises of Hill's equation: its order, and bars that hold the
error.

The equation is Mathieu's, whose z varies strongly in time.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from hill_problems import mathieu
from numpy.linalg import norm

import survey.methods
from survey import modules
from survey.kernels.jit import inline, kernel
from survey.kernels.lanes import chain
from survey.measures.hill import pointwise
from survey.methods import magnus6, rk4, taylor16

HILL = [
    n
    for n in modules.names(survey.methods)
    if "hill" in modules.load(survey.methods, n, "method").SERVES
]
ZERO = np.zeros(1, np.int64)
PROBLEM = mathieu([np.linspace(8.0, 16.0, 8)], [5.0], half_periods=8)


def fixed(method, steps):
    """Results of a chain of `steps` equal steps of the method."""
    out = np.empty((8, 10))
    samples = PROBLEM.sample(np.zeros(1, int), np.array(method.NODES), steps)
    method.hill_chain(
        samples, 0.0, PROBLEM.lengths(ZERO, steps), PROBLEM.p[0], np.arange(8), ZERO, ZERO + 8, out
    )
    return out


EXACT = fixed(taylor16, 512)


def step(method, start, h, parts=1):
    """Y(h) of Mathieu's equation with a = q = 1 from t = `start`, in `parts` steps."""
    samples = np.ones((1, parts, 2, len(method.NODES)))
    times = start + (np.arange(parts)[:, None] + np.array(method.NODES)) * (h / parts)
    samples[0, :, 0] = -2 * np.cos(2 * times)
    if getattr(method, "ADAPTIVE", False):
        a, b, c, d, *_ = method.hill_step(samples[0, 0, 0] + 1.0, h)
        return np.array([a, c, b, d])
    out = np.empty((1, 10))
    method.hill_chain(
        samples, 0.0, np.full((1, parts), h / parts), np.ones(1), ZERO, ZERO, ZERO + 1, out
    )
    return out[0, :4]


def measured_order(method):
    """Slope of the logarithm of one step's error, less 1, over 16 places, where rounding does not
    reach.

    One step, because it leaves high orders a range of 3 in h between rounding and the realm of
    higher terms.
    """
    sizes, places = np.geomspace(0.02, 4.0, 80), np.linspace(0.0, 3.0, 16)
    error = np.array(
        [sum(norm(step(method, t, h) - step(taylor16, t, h, 24)) for t in places) for h in sizes]
    )
    window = (error < 1e-3) & (error > 3e-13)
    assert window.sum() >= 10
    return np.polyfit(np.log(sizes[window]), np.log(error[window]), 1)[0] - 1


@pytest.mark.parametrize("name", HILL)
def test_hill_order(name):
    method = modules.load(survey.methods, name, "method")
    assert abs(measured_order(method) - method.ORDER) < 0.15


def test_the_reference_of_the_order_is_right():
    for h in (0.1, 1.0, 4.0):
        assert norm(step(magnus6, 0.3, h, 600) - step(taylor16, 0.3, h, 24)) < 3e-14


def bars_hold(method):
    """With q = 5, over four periods: on every rung, each true error lies within its bar."""
    held = []
    frequency = np.sqrt(np.max(PROBLEM.bound[0, 0] + PROBLEM.p))
    for steps in pointwise.STEP_COUNTS.rungs[4:33]:
        if frequency * PROBLEM.span[0] / steps > pointwise.LONGEST:
            continue
        out = fixed(method, int(steps))
        held.append(np.all(abs(out[:, :4] - EXACT[:, :4]) <= out[:, 4:8] + EXACT[:, 4:8]))
    return all(held) and len(held) > 10


CHAINS = [
    n for n in HILL if not getattr(modules.load(survey.methods, n, "method"), "ADAPTIVE", False)
]


@pytest.mark.parametrize("name", CHAINS)
def test_hill_bars(name):
    assert bars_hold(modules.load(survey.methods, name, "method"))


@inline
def wrong_step(f, c2, p, h):
    a, b, c, d, d11, d12, d21 = rk4.hill_step(f, c2, p, h)
    return a, b + 1e-3 * h * h * h, c, d, d11, d12, d21


@kernel
def wrong_chain(samples, c2, h, p, order, starts, ends, out):
    chain(rk4.samples_only, wrong_step, rk4.WIDTH, samples, c2, h, p, order, starts, ends, out)


@pytest.mark.slow
def test_the_checks_see_a_broken_method():
    """A Runge-Kutta step with an error of h^3 in one entry claims order 4 and bars that do not hold."""
    broken = SimpleNamespace(NODES=rk4.NODES, ORDER=4, hill_chain=wrong_chain)
    assert not bars_hold(broken)
    assert abs(measured_order(broken) - 4) > 0.15
