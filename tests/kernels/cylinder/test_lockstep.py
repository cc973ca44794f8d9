"""Trajectories in lock step against order 20 one by one, references of 30 digits and mpmath; bits
whatever the lane.
"""

import json
from importlib.resources import files

import mpmath as mp
import numpy as np
import pytest

from survey.kernels.cylinder import lockstep, steps
from survey.kernels.jit import fresh
from survey.measures.cylinder import solution
from survey.methods import closed, dop853, taylor
from survey.precision.cases import gyrostat

TURN = lockstep.LANES + 3  # more rows than lanes


@fresh
def one_by_one(P, starts, times, tolerance, limit, planes, turnings, status):
    steps.trajectories(taylor.flow_setting, taylor.flow_begin, taylor.flow_at, P, starts, times, tolerance, limit,
                       planes, turnings, status)  # fmt: skip


@fresh
def sines(x, out):
    for i in range(x.size):
        out[0, i], out[1, i] = lockstep.sine_cosine(x[i])


def solved(rows, times, tolerance=1e-13, run=taylor.flow_trajectories, limit=solution.STEPS):
    """floats, turnings and status of `run` at the same times for every row."""
    P, starts = solution.split(np.asarray(rows, float))
    times = np.tile(np.asarray(times, float), (len(P), 1))
    planes, turnings = np.full((4, *times.shape), np.nan), np.full(times.shape, steps.UNDETERMINED)
    status = np.full(len(P), 99)
    run(P, starts, times, tolerance, limit, planes, turnings, status)
    return planes.transpose(1, 2, 0), turnings, status


def drawn(count, seed, scale=(1, 1, 1, 1, 1, 1, 3, 1)):
    return np.random.default_rng(seed).normal(size=(count, 8)) * scale


def agree(rows, times, tolerance=1e-13):
    """Where both solve them, values agree within both bars, and turnings where they are known;
    returns that share.
    """
    mine, turns, status = solved(rows, times, tolerance)
    best, counted, _ = solved(rows, times, 1e-17, one_by_one)
    both = np.isfinite(mine[..., 0]) & np.isfinite(best[..., 0])
    assert (np.abs(mine - best)[both][:, :2] <= mine[both][:, 2:] + best[both][:, 2:]).all()
    both &= (turns != steps.UNDETERMINED) & (counted != steps.UNDETERMINED)
    assert np.array_equal(turns[both], counted[both])
    assert ((status == steps.OK) == np.isfinite(mine[:, -1, 0])).all()
    return both.mean()


def test_sine_and_cosine_to_one_ulp():
    random = np.random.default_rng(1)
    near = np.outer(np.arange(-4, 5) * (np.pi / 4), np.ones(40)) + random.normal(
        size=(9, 40)
    ) * 10.0 ** random.uniform(-17, -1, (9, 40))
    x = np.concatenate(
        [random.uniform(-np.pi, np.pi, 3000), near.ravel(), [0.0, 1e-300, np.pi, -np.pi]]
    )
    out = np.empty((2, x.size))
    sines(x, out)
    with mp.workdps(40):
        for function, found in ((mp.sin, out[0]), (mp.cos, out[1])):
            exact = [function(mp.mpf(float(value))) for value in x]
            ulp = np.spacing(np.abs(np.array(exact, float)))
            assert (
                max(
                    abs(mp.mpf(float(f)) - e) / u for f, e, u in zip(found, exact, ulp, strict=True)
                )
                <= 1
            )


@pytest.mark.parametrize("last", [0.05, 2.0, 40.0])
def test_times_of_a_step_do_not_depend_on_those_of_neighbours(last):
    """Rows of none to 30 times, of which a step has up to all, against each row alone, and each time alone."""
    rows, number = drawn(TURN, 31), np.arange(TURN) % 31
    times = np.full((TURN, 30), np.inf)
    for row, size in zip(times, number, strict=True):
        row[:size] = np.sort(np.random.default_rng(size).uniform(0, last, size))
    P, starts = solution.split(rows)

    def run(mine, at):
        planes = np.full((4, *at.shape), np.nan)
        turnings, status = np.full(at.shape, steps.UNDETERMINED), np.full(len(at), 99)
        limit = solution.STEPS
        taylor.flow_trajectories(P[mine], starts[mine], at, 1e-13, limit, planes, turnings, status)
        return planes, turnings, status

    planes, turnings, status = run(slice(None), times)
    assert (status == steps.OK).all() and (np.isfinite(planes) == np.isfinite(times)).all()
    for i in range(TURN):
        alone = run(slice(i, i + 1), times[i : i + 1])
        for mine, other in zip(
            (planes[:, i], turnings[i]), (alone[0][:, 0], alone[1][0]), strict=True
        ):
            np.testing.assert_array_equal(mine, other)
    i = 30
    for j in range(number[i]):
        single = run(slice(i, i + 1), times[i : i + 1, j : j + 1].copy())[0]
        np.testing.assert_array_equal(planes[:, i, j], single[:, 0, 0])


def test_a_motion_is_lost_at_the_first_time_in_a_step_at_which_its_bars_are_too_wide():
    rows = np.array([[0, 0, 9.0, 0, 0, 0, np.pi / 2, 1e-12]])  # from an unstable state of rest
    times = np.linspace(0.0, 60.0, 6001)
    floats, _turnings, status = solved(rows, times, 1e-13)
    known = np.isfinite(floats[0, :, 0])
    size = known.sum()
    assert status[0] == steps.NO_CONVERGENCE and 8 < size < times.size
    assert known[:size].all() and not np.isfinite(floats[0, size:]).any()
    some = solved(rows, times[:size:7], 1e-13)[0]
    np.testing.assert_array_equal(floats[0, :size:7], some[0])


@pytest.mark.parametrize("rtol", [1e-8, 1e-10, 1e-12])
def test_references_to_t_20_lie_within_their_bars(rtol):
    data = json.loads((files("survey.reference") / "gyrostat_trajectories.json").read_text())[
        "trajectories"
    ]
    rows = np.array(
        [[point[n] for n in gyrostat._NAMES] for point, *_ in gyrostat.references("trajectory")]
    )
    floats, _turnings, status = solution.trajectories(
        taylor, rows, np.full((len(rows), 1), 20.0), rtol
    )
    assert (status == steps.OK).all()
    for found, case in zip(floats[:, 0], data, strict=True):
        for value, bar, name in zip(found[:2], found[2:], ("phi", "w"), strict=True):
            error = abs(mp.mpf(float(value)) - mp.mpf(case[name]))
            assert error <= bar and error <= rtol * (1 + abs(value))


@pytest.mark.parametrize("tolerance", [1e-11, 1e-13, 1e-16])
def test_bars_hold_on_random_systems(tolerance):
    assert agree(drawn(2000, 3), [0.3, 20.0], tolerance) > 0.9


@pytest.mark.parametrize(
    "scale",
    [
        (40, 40, 1, 1, 1, 1, 3, 1),  # stiff
        (1, 1, 1, 1, 1, 1, 3, 300),  # fast
        (0, 0, 9, 9, 9, 9, 3, 3),  # conserves H
        (1, 1, 0, 0, 0, 0, 3, 1),  # g = 0
        (1, 1, 1, 1, 1, 1, 1e6, 1),  # many turns from 0
        (1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 3, 1),
        (0, 0, 0, 0, 0, 0, 3, 1),
    ],
)
def test_bars_hold_on_hard_systems(scale):
    assert agree(drawn(100, 4, scale), [1.0, 5.0]) > 0.8


def test_the_same_bits_in_any_lane_beside_any_neighbour():
    rows, times = drawn(3 * TURN, 5), [1.0, 7.0, 20.0]
    whole = solved(rows, times)
    order = np.random.default_rng(6).permutation(len(rows))
    for pick in (order, order[: TURN // 2], order[:1]):
        for part, all_of_them in zip(solved(rows[pick], times), whole, strict=True):
            assert np.array_equal(part, all_of_them[pick], equal_nan=True)
    alone = solved(rows, times[1:2])
    assert np.array_equal(alone[0][:, 0], whole[0][:, 1], equal_nan=True) and np.array_equal(
        alone[1][:, 0], whole[1][:, 1]
    )


@pytest.mark.parametrize("place", range(8))
def test_a_row_of_nan_costs_itself_alone(place):
    rows = drawn(TURN, 7)
    good = solved(rows, [5.0])
    rows[3, place] = np.nan
    bad = solved(rows, [5.0])
    assert np.isnan(bad[0][3]).all() and bad[2][3] != steps.OK
    for one, other in zip(good, bad, strict=True):
        assert np.array_equal(
            np.delete(one, 3, axis=0), np.delete(other, 3, axis=0), equal_nan=True
        )


def test_a_row_of_times_ends_at_its_first_infinity_and_a_budget_ends_a_row():
    rows = drawn(TURN, 8)
    fewer_than_a_block, more = [2.0, np.inf, 3.0], [0.01, np.inf, 0.02, 0.03, 0.04]
    for times in (fewer_than_a_block, more):
        floats, _turnings, status = solved(rows, times)
        assert (
            np.isfinite(floats[:, 0]).all()
            and np.isnan(floats[:, 1:]).all()
            and (status == steps.OK).all()
        )
    assert (solved(rows, [np.inf])[2] == steps.OK).all()
    assert (solved(rows, [1e9], limit=5)[2] == steps.STEP_LIMIT).all()


def test_exact_equilibria_stay():
    """g = 0 exactly at phi = 0, for either sign of d."""
    rows = [[-0.5, 0.2, d, 0.0, 0.0, 1.0, 0.0, 0.0] for d in (2.0, -0.9, 0.0)]
    assert np.array_equal(solved(rows, [1e3])[0][:, 0, :2], np.zeros((3, 2)))


def test_a_negative_zero_is_a_zero():
    rows = drawn(4, 9)
    rows[:, 2] = 0.0
    other = rows * [1, 1, -1, 1, 1, 1, 1, 1]
    for one, two in zip(solved(rows, [2.0]), solved(other, [2.0]), strict=True):
        assert np.array_equal(one, two)


def test_bars_hold_where_every_second_coefficient_vanishes():
    """At rest with b = 0, w is odd in t; where one more coefficient is small by chance, the last
    two tell nothing.
    """
    rows = drawn(3000, 9, (0, 0, 1, 1, 1, 1, 1, 0))
    times = np.tile([0.2, 0.5, 1.0], (len(rows), 1))
    exact, _, known = solution.trajectories(closed, rows, times, 1e-10)
    for method in (taylor, dop853):
        found, _, status = solution.trajectories(method, rows, times, 1e-8)
        good = (known == steps.OK) & (status == steps.OK)
        assert good.mean() > 0.95
        bars = found[..., 2:] + exact[..., 2:]
        assert (abs(found[..., :2] - exact[..., :2]) <= bars)[good].all(), method
    targets = rows[:, 6:7] + np.sign(exact[:, :1, 0] - rows[:, 6:7]) * [[1e-3, 1e-2]]
    exact, known = solution.abel(closed, rows, targets, 1e-10)
    found, status = solution.abel(taylor, rows, targets, 1e-8)
    good = (known == steps.OK) & (status == steps.OK)
    assert good.mean() > 0.5
    assert (abs(found - exact)[..., :2] <= (found + exact)[..., 2:])[good].all()


def test_bars_inside_a_step_are_not_those_of_its_end():
    """Pendulums from rest, also slow ones, whose steps last long: early in the first step no more than rounding is
    lost.
    """
    rows = np.zeros((6, 8))
    rows[:, 5], rows[:, 6] = 10.0 ** -np.arange(0.0, 12.0, 2.0), 1.0
    unit = rows[:, 5] ** -0.5
    for share in (0.01, 0.1, 0.3, 1.0):
        P, starts = solution.split(rows)
        times = (share * unit)[:, None]
        planes, turnings = np.full((4, 6, 1), np.nan), np.zeros((6, 1), np.int64)
        status = np.full(6, 99)
        taylor.flow_trajectories(P, starts, times, 1e-11, 1000, planes, turnings, status)
        assert not status.any()
        (phi, w), (bar, bar_w) = planes[:2, :, 0], planes[2:, :, 0]
        exact = [
            _pendulum(1.0, float(t) * float(s) ** 0.5, s)
            for t, s in zip(times[:, 0], rows[:, 5], strict=True)
        ]
        assert (abs(phi - [float(e[0]) for e in exact]) <= bar).all()
        assert (abs(w - [float(e[1]) for e in exact]) <= bar_w).all()
        if share < 0.2:
            assert (bar < 2e-15).all() and (bar_w < 2e-15).all()


def _pendulum(phi0, t, s3):
    """phi, w of phi'' = -s3 sin phi from rest, after the time t / sqrt(s3) (DLMF 22.19.3)."""
    with mp.workdps(30):
        k = mp.sin(mp.mpf(phi0) / 2)
        at = mp.mpf(t) + mp.ellipk(k * k)
        sn, cn = (mp.ellipfun(kind, at, k=k) for kind in ("sn", "cn"))
        return 2 * mp.asin(k * sn), 2 * k * mp.sqrt(mp.mpf(s3)) * cn


def test_huge_angles_are_answered_within_what_they_round():
    rows = [[0, 0, 0, 0, 0, 1, phi0, 0.3] for phi0 in (6e13, 7e13, 1e15, -1e15)]
    floats, _, status = solved(rows, [0.0, 1.0])
    assert not status.any()
    assert (floats[..., 3] < 1e-10).all() and (floats[..., 2] < 1e-15 * abs(floats[..., 0])).all()
