"""The machine's limit: what counts as an operation, and rates that a core can have."""

import numpy as np

from survey.kernels.cylinder.lockstep import ORDER
from survey.precision import flops
from survey.precision.cases import gyrostat, satellite


def test_operations_on_the_number_are_counted_and_no_others():
    assert flops.operations(lambda x: x) == 0
    assert flops.operations(lambda x: abs(-x)) == 0
    assert flops.operations(lambda x: (2 * 3.0) * x + x * x - 1 / x) == 5
    assert flops.operations(lambda x: np.float64(2.0) * x + np.float64(1.0)) == 2


def test_a_step_of_midpoint_taylor_is_some_hundred_operations():
    # the two series alone: each product of coefficients with its sum, for z to degree 9
    assert (
        2 * 2 * sum(min(n - 1, 10) for n in range(2, 16))
        < flops.operations(satellite._one_step)
        < 1000
    )


def test_a_step_of_a_trajectory_is_a_thousand_operations():
    # three products of series of sin, cos and w, with their sums, alone
    assert 2 * 3 * ORDER * (ORDER + 1) / 2 < gyrostat._one_step() < 2000


def test_the_rates_are_those_of_a_core(monkeypatch):
    monkeypatch.setattr(flops, "ROUNDS", 300)
    rates = flops.rates()
    assert set(rates) == {"multiply_add_per_ns", "fused_multiply_add_per_ns"}
    assert all(0.1 < rate < 500 for rate in rates.values())
