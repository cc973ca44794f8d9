"""The shared Runge-Kutta steps: order on a nonlinear system that depends on t, and a matrix exponential."""

from math import cos

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from survey.kernels.jit import fresh, inline
from survey.kernels.math.dop853 import STAGES, A, B
from survey.kernels.math.runge_kutta import classical, fundamental

MATRIX = np.array([[0.1, 1.3, 0.0], [-0.7, 0.2, 0.4], [0.5, -0.6, -0.3]])


@inline
def pendulum(damping, t, state):
    return state[1], -state[0] * state[0] - damping * state[1] + cos(t)


@inline
def linear(matrix, i, state, out):
    for row in range(3):
        for column in range(3):
            out[3 * column + row] = 0.0
            for k in range(3):
                out[3 * column + row] += matrix[row, k] * state[3 * column + k]


@fresh
def steps(number, span):
    h, y = span / number, (0.3, -0.2)
    for n in range(number):
        y = classical(pendulum, 0.1, (n * h, (n + 0.5) * h, (n + 1) * h), y, h)
    return y


@fresh
def slopes_of(matrix, h, state, slopes):
    fundamental(A, STAGES, linear, matrix, 3, h, state, slopes)


def test_the_classical_step_is_of_order_4():
    def slope(t, y):
        return [y[1], -(y[0] ** 2) - 0.1 * y[1] + np.cos(t)]

    exact = solve_ivp(slope, (0.0, 2.0), [0.3, -0.2], method="DOP853", rtol=1e-13, atol=1e-15).y[
        :, -1
    ]
    errors = [np.linalg.norm(np.array(steps(n, 2.0)) - exact) for n in (20, 40, 80)]
    assert np.diff(-np.log2(errors)) == pytest.approx([4.0, 4.0], abs=0.15)


def test_the_stages_give_the_matrix_exponential():
    slopes = np.empty((STAGES, 9))
    slopes_of(MATRIX, 0.2, np.empty(9), slopes)
    found = np.eye(3) + 0.2 * (B[:STAGES] @ slopes).reshape(3, 3).T
    assert abs(found - expm(0.2 * MATRIX)).max() < 1e-13
