"""Abel solutions in lock step against order 20 one by one, closed forms and mpmath; bits whatever
the lane.
"""

import mpmath as mp
import numpy as np
import pytest

from survey.kernels.cylinder import flow, lockstep, lockstep_abel, lockstep_phi, steps
from survey.kernels.jit import fresh
from survey.measures.cylinder import solution
from survey.methods import closed, taylor

MANY = lockstep.LANES + 3  # more rows than lanes


@fresh
def one_by_one(P, starts, targets, tolerance, limit, planes, status):
    steps.abels(taylor.flow_setting, taylor.flow_begin, taylor.flow_at, P, starts, targets, tolerance, limit,
                planes, status)  # fmt: skip


def solved(rows, over, tolerance=1e-13, run=taylor.flow_abels, limit=solution.STEPS):
    """floats and status of `run` at the same angles beyond phi0 for every row."""
    rows = np.asarray(rows, float)
    P, starts = solution.split(rows)
    targets = rows[:, 6:7] + np.asarray(over, float)
    planes, status = np.empty((4, *targets.shape)), np.full(targets.shape, 99, np.int8)
    run(P, starts, targets, tolerance, limit, planes, status)
    return np.moveaxis(planes, 0, 2), status


def drawn(count, seed, scale=(1, 1, 1, 1, 1, 1, 3, 1)):
    rows = np.random.default_rng(seed).normal(size=(count, 8)) * scale
    rows[:, 7] = np.abs(rows[:, 7])
    return rows


def agree(rows, over, tolerance=1e-13):
    """Where both solve them, values agree within both bars; returns the share of answers, theirs
    and both's.
    """
    mine, status = solved(rows, over, tolerance)
    best, other = solved(rows, over, 1e-17, one_by_one)
    good, theirs = ((codes == steps.OK) | (codes == steps.TURNING) for codes in (status, other))
    same = good & theirs & (status == other)
    # where one says that it turns and the other does not, the target lies within the bar of the
    # turning point
    differ = good & theirs & (status != other)
    edge = np.where(status == steps.TURNING, mine[..., 2], best[..., 2])
    turn = np.where(status == steps.TURNING, mine[..., 0], best[..., 0])
    assert (np.abs(turn - (rows[:, 6:7] + np.asarray(over)))[differ] <= edge[differ]).all()
    assert (np.abs(mine - best)[same][:, :2] <= mine[same][:, 2:] + best[same][:, 2:]).all()
    return theirs.mean(), same.mean()


@pytest.mark.parametrize("tolerance", [pytest.param(1e-11, marks=pytest.mark.slow), 1e-13, 1e-16])
def test_bars_hold_on_random_systems(tolerance):
    theirs, both = agree(drawn(2000, 3), np.linspace(0.0, 9.0, 40), tolerance)
    assert theirs > 0.9 and both > theirs - 0.01


@pytest.mark.parametrize(
    "scale",
    [
        (40, 40, 1, 1, 1, 1, 3, 1),  # stiff
        (1, 1, 1, 1, 1, 1, 3, 300),  # fast
        (1, 1, 1, 1, 1, 1, 3, 6),  # slow and fast in turn
        (0, 0, 9, 9, 9, 9, 3, 3),  # conserves H
        pytest.param((1, 1, 0, 0, 0, 0, 3, 1), marks=pytest.mark.slow),  # g = 0
        (1, 1, 1, 1, 1, 1, 1e6, 1),  # many turns from 0
        (1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 3, 1),
        (1, 1, 1, 1, 1, 1, 3, 0),  # from rest
        (0, 0, 0, 0, 0, 0, 3, 1),
    ],
)
def test_bars_hold_on_hard_systems(scale):
    theirs, both = agree(drawn(100, 4, scale), [0.0, 1e-9, 0.01, 1.0, 5.0, 30.0])
    assert both > theirs - 0.02


def test_bars_hold_and_stay_narrow_over_many_turns():
    """100 turns; with b = 0 by the energy, w^2 = w0^2 + 2 (G(phi) - G(phi0)), where errors do not grow."""
    turns = np.linspace(0.0, 200.0 * np.pi, 41)
    rows = drawn(200, 5, (0.3, 0.3, 1, 1, 1, 1, 3, 6))
    theirs, both = agree(rows, turns)
    assert theirs > 0.6 and both > theirs - 0.01
    rows[:, :2], rows[:, 7] = 0.0, np.abs(rows[:, 7]) + 4.0
    found, status = solved(rows, turns)

    def potential(phi):
        d, c23, s2, s3 = rows.T[2:6, :, None]
        return (
            0.25 * d * np.cos(2 * phi)
            - 0.5 * c23 * np.sin(2 * phi)
            + s2 * np.sin(phi)
            + s3 * np.cos(phi)
        )

    start = rows[:, 6:7]
    square = rows[:, 7:] ** 2 + 2.0 * (potential(start + turns) - potential(start))
    w = np.sqrt(np.maximum(square, 0.0))
    clear = (square > 1.0).all(axis=1)
    assert clear.sum() > 100 and (status[clear] == steps.OK).all()
    error, bar = np.abs(found[clear, :, 0] - w[clear]), found[clear, :, 2]
    assert (error <= bar + 1e-13 * w[clear]).all() and (bar < 1e-8 * w[clear]).all()


@pytest.mark.slow
def test_what_an_error_has_been_multiplied_by_is_bounded_at_every_step():
    """With b = 0, w dw is constant: an error of w changes as 1 / w."""
    rows = drawn(lockstep.LANES * 50, 8, (0, 0, 1, 1, 1, 1, 3, 1))
    rows[:, 2:6] *= 10.0 ** np.random.default_rng(1).uniform(-2, 1, (len(rows), 1))
    P, starts = solution.split(rows)
    starts[:, 1] += 1.5 * np.sqrt(P[:, flow.BOUND_G])
    for tolerance in (1e-11, 1e-13, 1e-16):
        factors = np.empty((len(rows), 2))
        one_step(P, starts, tolerance, factors)
        exact, bound = factors.T
        excess = bound / exact - 1.0
        assert (excess >= -1e-14).all() and (excess < 1e-3).all()
        assert (abs(exact - 1.0) > 1e-3).sum() > 100  # something to bound
        assert np.median(excess) < 1e-4


@fresh
def one_step(P, starts, tolerance, factors):
    """What an error of w is multiplied by in the first step: w before over w after, and its bound."""
    work = np.zeros((lockstep_phi.ROWS, lockstep.LANES))
    T, state, before = (
        work[: lockstep_phi.AFTER],
        work[lockstep_phi.AFTER : lockstep_phi.BEFORE],
        work[lockstep_phi.BEFORE : lockstep_phi.OF_STEP],
    )
    step = work[lockstep_phi.OF_STEP : lockstep_phi.WHAT_STAYS]
    fixed = work[lockstep_phi.WHAT_STAYS :]
    for first in range(0, len(P), lockstep.LANES):
        for i in range(lockstep.LANES):
            p, (phi, w) = P[first + i], starts[first + i]
            for k in range(lockstep_phi.FIXED):
                fixed[k, i] = p[k]
            for k in range(lockstep_phi.STATE):
                state[k, i] = 0.0
            state[lockstep_phi.AT, i], state[lockstep_phi.W, i] = phi, w
            state[lockstep_phi.RATE, i] = 2.0 + p[flow.BOUND_G] / (w * w)
        lockstep_phi._series(T, state, fixed)
        lockstep_phi._advance(T, state, before, step, fixed, tolerance)
        for i in range(lockstep.LANES):
            h = state[lockstep_phi.AT, i] - before[lockstep_phi.AT, i]
            low_q, r = lockstep_phi._low_q(T, i), lockstep_phi._low_r(T, i)
            contracted, doubt = lockstep_phi._contracted(low_q, r, h)
            factors[first + i, 0] = before[lockstep_phi.W, i] / state[lockstep_phi.W, i]
            factors[first + i, 1] = contracted * (1.0 + doubt)


@pytest.mark.slow
def test_phi_is_the_variable_far_from_turning_points():
    """No solution is left to steps in time, and values of three are within their bars of mpmath's."""
    rows = drawn(lockstep.LANES, 9, (0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 3, 0))
    rows[:, 7] = np.linspace(3.0, 30.0, len(rows))
    over = np.linspace(0.0, 2 * np.pi, 25)
    floats, status = solved(rows, over)
    ahead = np.zeros((len(rows), lockstep_phi.STATE))
    P, starts = solution.split(rows)
    again, codes = np.empty((4, *status.shape)), np.empty_like(status)
    lockstep_phi.abels(
        P,
        starts,
        np.pad(rows[:, 6:7] + over, ((0, 0), (0, lockstep_phi.BLOCK)), constant_values=np.inf),
        1e-13,
        solution.STEPS,
        ahead,
        again,
        codes,
        True,
    )
    assert (ahead[:, lockstep_phi.COLUMN] == len(over)).all() and (status == steps.OK).all()
    np.testing.assert_array_equal(np.moveaxis(again, 0, 2), floats)
    assert floats[..., 2].max() < 1e-10 and floats[..., 3].max() < 1e-10
    for i in (0, 7, 31):
        b12, b31, d, c23, s2, s3 = map(mp.mpf, rows[i, :6])

        def slope(x, y, b12=b12, b31=b31, d=d, c23=c23, s2=s2, s3=s3):
            c, s = mp.cos(x), mp.sin(x)
            return [
                b12 * c - b31 * s + (s2 * c - s3 * s - d * c * s - c23 * (c * c - s * s)) / y[0],
                1 / y[0],
            ]

        with mp.workdps(20):
            true = mp.odefun(slope, mp.mpf(rows[i, 6]), [mp.mpf(rows[i, 7]), mp.mpf(0)])
            for j in (3, 12, 24):
                off = [
                    abs(mp.mpf(a) - b)
                    for a, b in zip(
                        floats[i, j, :2], true(mp.mpf(rows[i, 6] + over[j])), strict=True
                    )
                ]
                assert off[0] < floats[i, j, 2] and off[1] < floats[i, j, 3], (i, j, off)


def test_every_angle_beside_a_turning_point():
    """w^2 = 2 (cos phi - cos 1) for a pendulum: near phi = 1, w is a square root, and where it ends
    is known.
    """
    row = [[0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 2.0 * np.sin(0.5)]]
    places = np.concatenate([np.linspace(0.0, 1.0, 300), 1.0 + np.linspace(-1e-9, 1e-9, 201)])
    places.sort()
    floats, status = solved(row, places)
    assert set(status[0]) == {steps.OK, steps.TURNING}
    assert (status[0] == steps.OK)[places < 1.0 - 1e-11].all()
    assert (status[0] == steps.TURNING)[places > 1.0 + 1e-11].all()
    with mp.workdps(30):
        # what the rounding of w0 moves: w^2 by 2 w0 dw
        start = mp.mpf(row[0][7]) ** 2
        for place, (value, _time, bar, _), code in zip(places, floats[0], status[0], strict=True):
            square = start - 4 * mp.sin(mp.mpf(place) / 2) ** 2
            if code == steps.OK:
                assert abs(mp.sqrt(max(square, 0)) - mp.mpf(value)) <= bar
            else:
                assert abs(2 * mp.asin(mp.sqrt(start) / 2) - mp.mpf(value)) <= bar


def test_closed_forms_of_g_0_lie_within_the_bars():
    rows = drawn(300, 11, (1, 1, 0, 0, 0, 0, 3, 1))
    over = np.linspace(0.0, 7.0, 50)
    (mine, status), (exact, known) = solved(rows, over), solved(rows, over, run=closed.flow_abels)
    both = (status == steps.OK) & (known == steps.OK)
    assert both.mean() > 0.5
    assert (np.abs(mine - exact)[both][:, :2] <= mine[both][:, 2:] + exact[both][:, 2:]).all()


def test_the_same_bits_in_any_lane_beside_any_neighbour():
    rows, over = drawn(3 * MANY, 5), np.linspace(0.0, 7.0, 30)
    whole = solved(rows, over)
    order = np.random.default_rng(6).permutation(len(rows))
    for pick in (order, order[: MANY // 2], order[:1]):
        for part, all_of_them in zip(solved(rows[pick], over), whole, strict=True):
            assert np.array_equal(part, all_of_them[pick], equal_nan=True)


def test_an_angle_is_served_alike_alone_and_among_others():
    """Blocks hold the targets of a step: another target in the block changes no bit of this one."""
    rows, over = drawn(MANY, 5, (1, 1, 1, 1, 1, 1, 3, 9)), np.linspace(0.0, 7.0, 400)
    floats, status = solved(rows, over)
    for k in (0, 1, 7, 123, 399):
        alone = solved(rows, over[k : k + 1])
        sure = status[:, k] == steps.OK
        assert (
            np.array_equal(alone[0][sure, 0], floats[sure, k])
            and (alone[1][sure, 0] == steps.OK).all()
        )


@pytest.mark.parametrize("column", range(8))
def test_a_row_of_nan_affects_itself_alone(column):
    rows = drawn(MANY, 7)
    good = solved(rows, [5.0])
    rows[3, column] = np.nan
    bad = solved(rows, [5.0])
    assert bad[1][3, 0] not in (steps.OK, steps.TURNING)
    for one, other in zip(good, bad, strict=True):
        assert np.array_equal(
            np.delete(one, 3, axis=0), np.delete(other, 3, axis=0), equal_nan=True
        )


def test_a_row_ends_at_its_first_infinity_and_a_budget_ends_it():
    rows = drawn(MANY, 8, (1, 1, 1, 1, 1, 1, 3, 9))
    rows[:, 7] += 5.0
    floats, status = solved(rows, [2.0, np.inf, np.inf])
    assert (
        np.isfinite(floats[:, 0]).all()
        and np.isnan(floats[:, 1:]).all()
        and (status[:, 0] == steps.OK).all()
    )
    assert (solved(rows, [np.inf])[1] == 99).all()
    assert (solved(rows, [1e5], limit=5)[1] == steps.STEP_LIMIT).all()


def test_a_block_serves_more_angles_than_it_holds():
    assert lockstep_abel.BLOCK < 1000
    rows = drawn(3, 9, (0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 3, 1))
    rows[:, 7] = 30.0
    floats, status = solved(rows, np.linspace(0.0, 0.1, 1000))
    assert (status == steps.OK).all() and (np.diff(floats[..., 1], axis=1) > 0).all()
