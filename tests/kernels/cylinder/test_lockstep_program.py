"""Programs in lock step against SciPy's DOP853 and our own one by one; bits whatever the lane."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from survey.kernels.cylinder import lockstep
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.steps import OK, SEPARATRIX, TURNING
from survey.measures.cylinder import equation, solution
from survey.methods import dop853, taylor


def van_der_pol(x, p):
    return p[0] * (1.0 - x * x)


def spring(x, p):
    return -x


def damping(x, p):
    return -p[0] * math.exp(math.cos(x))


def torque(x, p):
    """Another program where p1 < 0."""
    drive = p[1] if p[1] > 0 else p[1] * math.cos(x)
    return drive - math.sin(x) / math.sqrt(1.5 + math.cos(x))


FLOWS = {"line": (van_der_pol, spring, False), "circle": (damping, torque, True)}


def drawn(kind, count, seed):
    f, g, on_circle = FLOWS[kind]
    random = np.random.default_rng(seed)
    points = np.stack([random.uniform(0.1, 1.5, count), random.uniform(-1, 2, count)], axis=-1)
    starts = random.uniform(-2.0, 0.0, count), random.uniform(0.3, 5.0, count)
    return points, solution.rows(equation.flows(f, g, points, on_circle), *starts)


def by_dop853(kind, p, start, end, right):
    return solve_ivp(right, (start[0], end), start[1:], method="DOP853", rtol=1e-13, atol=1e-14)


@pytest.mark.parametrize("kind", FLOWS)
def test_times_and_angles_hold_dop853s(kind):
    f, g, _on_circle = FLOWS[kind]
    points, rows = drawn(kind, 60, 1)
    floats, _turnings, status = solution.trajectories(taylor, rows, np.full((60, 1), 6.0), 1e-9)
    assert (status == OK).all()
    for p, row, found in zip(points, rows, floats[:, 0], strict=True):
        start = (0.0, row[rc.PHI0], row[rc.W0])
        path = by_dop853(
            kind, p, start, 6.0, lambda t, y, p=p: [y[1], f(y[0], p) * y[1] + g(y[0], p)]
        )
        assert (abs(found[:2] - path.y[:, -1]) <= found[2:] + 1e-10 * (1 + abs(found[:2]))).all()
        assert (found[2:] <= 1e-9 * (1 + abs(found[:2]))).all()
    target = np.full((60, 1), 1.0)
    floats, status = solution.abel(taylor, rows, target, 1e-9)
    assert (status == OK).sum() > 20
    for p, row, found, code in zip(points, rows, floats[:, 0], status[:, 0], strict=True):
        if code == OK:
            start = (row[rc.PHI0], row[rc.W0], 0.0)
            path = by_dop853(
                kind, p, start, 1.0, lambda x, y, p=p: [f(x, p) + g(x, p) / y[0], 1.0 / y[0]]
            )
            doubt = 1e-10 * (1 + abs(found[:2])) / min(path.y[0].min(), 1.0) ** 2
            assert (abs(found[:2] - path.y[:, -1]) <= found[2:] + doubt).all()


@pytest.mark.parametrize("kind", FLOWS)
def test_angles_end_as_one_by_one_by_dop853(kind):
    _points, rows = drawn(kind, 400, 2)
    rows[::9, rc.W0] = 0.0
    targets = rows[:, rc.PHI0, None] + np.linspace(0.0, 4.0, 23)
    mine, codes = solution.abel(taylor, rows, targets, 1e-9)
    best, others = solution.abel(dop853, rows, targets, 1e-9)
    assert np.array_equal(codes, others) and (codes == TURNING).any() and (codes == OK).any()
    known = (codes == OK) | (codes == TURNING)
    gap, bars = abs(mine - best)[known][:, :2], (mine + best)[known][:, 2:]
    assert (gap <= bars).all() and (codes != SEPARATRIX).mean() > 0.9


@pytest.mark.parametrize("kind", FLOWS)
def test_the_same_bits_in_any_lane_beside_any_neighbour(kind):
    count = lockstep.LANES + 9
    _points, rows = drawn(kind, count, 3)
    times, targets = np.array([0.5, 3.0]), np.array([0.2, 1.5])
    order = np.random.default_rng(4).permutation(count)
    for solve, columns in ((solution.trajectories, times), (solution.abel, targets)):
        whole = solve(taylor, rows, np.tile(columns, (count, 1)), 1e-9)
        for pick in (order, order[:5], order[:1]):
            part = solve(taylor, rows[pick], np.tile(columns, (len(pick), 1)), 1e-9)
            for one, all_of_them in zip(part, whole, strict=True):
                assert np.array_equal(one, all_of_them[pick], equal_nan=True)


def test_rounding_far_out_on_a_line_is_counted():
    """phi = 1000 + t, w = 1 is a solution of any f (w - 1) with g = -f: its bar covers the rounding of phi."""
    row = equation.program(lambda x, p: -p[0], lambda x, p: p[0], (0.3,), False)
    rows = solution.rows(row[None], [1000.1], [1.0])
    (found,), _turnings, _status = solution.trajectories(taylor, rows, np.array([[500.0]]), 1e-9)
    assert abs(found[0, 0] - (1000.1 + 500.0)) <= found[0, 2] and found[0, 2] > 1e-13


def test_bounds_take_the_exponent_of_their_own_row():
    def power(x, p):
        return -x * (2.0 + 0.5 * x * x) ** p[0]

    def answers(exponents):
        points = np.stack([exponents, np.ones_like(exponents)], axis=1)
        starts = np.full(len(points), -1.0), np.full(len(points), 2.0)
        rows = solution.rows(equation.flows(lambda x, p: -0.1, power, points, False), *starts)
        floats, _turnings, status = solution.trajectories(
            taylor, rows, np.full((len(points), 1), 3.0), 1e-9
        )
        assert (status == OK).all()
        return floats

    exponents = np.array([-3.7, 4.7, 0.37, 2.3])
    together = answers(exponents)
    for i in range(len(exponents)):
        assert (together[i] == answers(exponents[i : i + 1])[0]).all()
