"""Trajectories to 23 digits in lock step against double-double arithmetic, mpmath, and bits whatever the lane."""

from functools import partial

import mpmath as mp
import numpy as np
import pytest

from survey.kernels.cylinder import lockstep, lockstep_pairs, taylor_double
from survey.kernels.cylinder.flow import BOUND_G
from survey.kernels.cylinder.lockstep import LANES, PSI, SAA, SBB, STATE, TURNS, V
from survey.kernels.cylinder.steps import NO_CONVERGENCE, OK, STEP_LIMIT, UNDETERMINED
from survey.kernels.jit import fresh
from survey.measures.cylinder import auto, solution


def solved(rows, times, method=lockstep_pairs):
    rows = np.asarray(rows, float)
    times = np.broadcast_to(np.asarray(times, float), (len(rows), np.shape(times)[-1]))
    return solution.trajectories(method, rows, times, 1e-14)


def drawn(count, seed, scale=(1, 1, 1, 1, 1, 1, 5, 2)):
    return np.random.default_rng(seed).normal(size=(count, 8)) * scale


def beside_saddles(count, seed):
    """Pendulums next to their separatrix, in turned axes, with damping of 1e-14 to 0.01."""
    random = np.random.default_rng(seed)
    c, angle = 10.0 ** random.uniform(-0.5, 0.5, count), random.uniform(-3, 3, count)
    # g = -c sin(phi - angle); the saddle at angle + pi
    rows = np.zeros((count, 8))
    rows[:, 4], rows[:, 5] = c * np.sin(angle), c * np.cos(angle)
    rows[:, :2] = random.normal(size=(count, 2)) * 10.0 ** random.uniform(-14, -2, (count, 1))
    away = random.choice([-1, 1], count) * 10.0 ** random.uniform(-9, -2, count)
    rows[:, 6] = angle + np.pi + away
    rows[:, 7] = (
        np.sqrt(c)
        * away
        * (1.0 + random.choice([-1, 1], count) * 10.0 ** random.uniform(-12, -1, count))
    )
    return rows, c


@fresh
def begun(phi, state, low, S, C, W, sums):
    for i in range(LANES):
        state[PSI, i] = phi[i]
    lockstep_pairs._begin(S, C, W, state, low, sums, LANES)


def test_sines_to_26_digits():
    random, size = np.random.default_rng(1), lockstep_pairs.LOWER + lockstep_pairs.PAIRS
    quarters = np.arange(-4, 5) * (np.pi / 2)
    for phi in (
        random.uniform(-3.2, 3.2, LANES),
        np.resize([*quarters, 1e-9, -0.785, 2.356], LANES),
    ):
        (S, C, W), state = np.zeros((3, size, LANES)), np.zeros((STATE, LANES))
        low, sums = random.uniform(-1e-17, 1e-17, (2, LANES)), np.zeros((9, LANES))
        exact_low = low[0].copy()
        state[V] = 1.5
        begun(phi, state, low, S, C, W, sums)
        with mp.workdps(40):
            for i in range(LANES):
                x = mp.mpf(float(phi[i])) + mp.mpf(float(exact_low[i]))
                for table, exact in ((S, mp.sin(x)), (C, mp.cos(x))):
                    found = mp.mpf(float(table[0, i])) + mp.mpf(
                        float(table[lockstep_pairs.LOWER, i])
                    )
                    assert abs(found - exact) < 1e-26
                psi = mp.mpf(float(state[PSI, i])) + mp.mpf(float(low[0, i]))
                assert abs(psi + 2 * mp.pi * int(state[TURNS, i]) - x) < 1e-28


@pytest.mark.parametrize(("scale", "t"), [(1.0, 30.0), (10.0, 5.0), (0.1, 300.0)])
def test_agrees_with_double_double_to_the_last_digit_of_float64(scale, t):
    rows = drawn(LANES + 5, 3, (*(scale,) * 6, 5, 2))
    times = t * np.array([0.0, 0.01, 0.3, 1.0])
    floats, turnings, status = solved(rows, times)
    exact, counted, _status = solved(rows, times, taylor_double)
    assert (status == OK).all()
    assert (np.abs(floats - exact)[..., :2] <= floats[..., 2:] + exact[..., 2:]).all()
    assert (floats[..., 2:] < 1e-14 * (1.0 + np.abs(floats[..., :2]))).mean() > 0.95
    known = (turnings != UNDETERMINED) & (counted != UNDETERMINED)
    assert known.mean() > 0.5 and np.array_equal(turnings[known], counted[known])


def test_bars_hold_where_errors_grow_by_many_orders():
    """Elsewhere the bars are only float64's rounding, and do not test the method's own error."""
    rows, c = beside_saddles(120, 7)
    times = np.linspace(2.0, 80.0, 8) / np.sqrt(c)[:, None]
    floats, turnings, status = solved(rows, times)
    exact, counted, known = solved(rows, times, taylor_double)
    both = (status == OK) & (known == OK)
    assert both.mean() > 0.9
    off, bars = np.abs(floats - exact)[..., :2], floats[..., 2:] + exact[..., 2:]
    assert (off <= bars)[both].all()
    assert (bars[both] > 1e-13).sum() > 50
    sure = both & (turnings != UNDETERMINED) & (counted != UNDETERMINED)
    assert np.array_equal(turnings[sure], counted[sure])


@fresh
def stepped(P, starts, steps, state, low):
    work = np.zeros((lockstep.ROWS, LANES))
    T, own, before, fixed, taken, fate = lockstep.split(work)
    size = lockstep_pairs.LOWER + lockstep_pairs.PAIRS
    S, C, W = np.zeros((size, LANES)), np.zeros((size, LANES)), np.zeros((size, LANES))
    here, there = np.zeros((2, LANES)), np.zeros((2, LANES))
    six, sums = np.zeros((6, LANES)), np.zeros((9, LANES))
    row, column, sizes = np.full(LANES, -1), np.zeros(LANES, np.int64), np.zeros(LANES, np.int64)
    times, status = np.full((len(P), 1), 1e9), np.zeros(len(P), dtype=np.int64)
    lockstep_pairs._refill(P, starts, times, 0, own, here, fixed, six, row, column, sizes, status)
    for _ in range(steps):
        lockstep_pairs._begin(S, C, W, own, here, sums, LANES)
        lockstep_pairs._expand(S, C, W, T, six, sums, LANES)
        for i in range(LANES):
            lockstep.vary_lane(T, i)
        lockstep_pairs._advance(
            W, T, own, before, here, there, fixed, taken[lockstep.DT], fate, sums, LANES
        )
    state[:], low[:] = own, here


@pytest.mark.parametrize("steps", [1, 20])
@pytest.mark.slow
def test_a_step_of_a_fast_motion_keeps_the_energy_within_its_bound(steps):
    """b = 0: w^2 / 2 + V(phi) is constant; there the error is seen to the last of the 23 digits."""
    rows = drawn(LANES, 11, (0, 0, 1, 1, 1, 1, 3, 1))
    rows[:, 7] = np.sign(rows[:, 7]) * np.logspace(0, 4, LANES)
    P, starts = solution.split(rows)
    state, low = np.zeros((STATE, LANES)), np.zeros((2, LANES))
    stepped(P, starts, steps, state, low)
    off = []
    with mp.workdps(50):
        for i, (_b, _c, d, c23, s2, s3, phi, w) in enumerate(rows):

            def energy(x, v, d=d, c23=c23, s2=s2, s3=s3):
                return (
                    v * v / 2
                    + d / 2 * mp.sin(x) ** 2
                    + c23 * mp.sin(2 * x) / 2
                    - s2 * mp.sin(x)
                    - s3 * mp.cos(x)
                )

            x = mp.mpf(float(state[PSI, i])) + mp.mpf(float(low[0, i]))
            v = mp.mpf(float(state[V, i])) + mp.mpf(float(low[1, i]))
            change = abs(energy(x, v) - energy(mp.mpf(float(phi)), mp.mpf(float(w))))
            bars = [np.sqrt(2.0 * steps * state[k, i]) for k in (SAA, SBB)]
            bound = P[i, BOUND_G] * bars[0] + abs(float(v)) * bars[1] + 1e-29 * w * w
            assert change <= bound
            off.append(float(change / bound))
    assert max(off) > 1e-4


def test_the_same_bits_in_any_lane_beside_any_neighbour():
    rows = drawn(LANES + 9, 5)
    many = solved(rows, [3.0, 40.0])
    for i in (0, 1, LANES - 1, LANES, LANES + 8):
        for one, all_ in zip(solved(rows[i : i + 1], [3.0, 40.0]), many, strict=True):
            np.testing.assert_array_equal(one[0], all_[i])


def test_a_row_of_nan_costs_itself_alone():
    rows = drawn(12, 6)
    whole, *_rest = solved(rows, [10.0])
    rows[3, 4] = np.nan
    floats, _turnings, status = solved(rows, [10.0])
    assert status[3, 0] != OK and np.isnan(floats[3]).all()
    np.testing.assert_array_equal(np.delete(floats, 3, 0), np.delete(whole, 3, 0))


def test_a_budget_ends_it_and_what_cannot_be_followed_is_not_answered():
    P, starts = solution.split(drawn(3, 2))
    planes, turnings = np.full((4, 3, 1), np.nan), np.full((3, 1), UNDETERMINED)
    ends = np.zeros(3, dtype=np.int64)
    lockstep_pairs.flow_trajectories(
        P, starts, np.full((3, 1), 1e3), 0.0, 10, planes, turnings, ends
    )
    assert (ends == STEP_LIMIT).all() and np.isnan(planes).all()
    rows, c = beside_saddles(20, 3)
    rows[:, :2] = 0.0
    _floats, _turnings, status = solved(rows, 3000.0 / np.sqrt(c.max()) * np.ones(1))
    assert (status != OK).any() and set(np.unique(status)) <= {OK, NO_CONVERGENCE}


def test_what_it_cannot_follow_is_left_to_double_double():
    """At w = 1e11 its coefficients overflow."""
    row, times = np.array([[0.3, 0.2, 0.4, 0.1, 0.2, 0.1, 0.5, 1e11]]), np.array([[2e-10]])
    _floats, _turnings, status = solved(row, times)
    assert status[0, 0] != OK
    results = [
        np.full((1, 1, 4), np.nan),
        np.full((1, 1), UNDETERMINED),
        np.full((1, 1), NO_CONVERGENCE),
    ]
    solve = partial(solution.trajectories, rtol=1e-12)
    floats, _turnings, status = auto._with_more_digits(
        results, solve, auto.IN_TIME, 1e-12, row, times
    )
    assert status[0, 0] == OK and floats[0, 0, 0] == pytest.approx(20.5, abs=1e-6)
