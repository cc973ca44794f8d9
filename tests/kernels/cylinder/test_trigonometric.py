"""Trajectories with g = 0 and on (61) in lanes: 40 digits, Taylor series of 34 digits, bits in any lane."""

import mpmath as mp
import numpy as np
import pytest

from survey.kernels.cylinder import taylor_double, trigonometric
from survey.kernels.cylinder.steps import OK
from survey.kernels.jit import fresh
from survey.measures.cylinder import solution
from survey.methods import closed, taylor


@fresh
def exponentials(y, out):
    for i in range(y.size):
        out[0, i], out[1, i] = trigonometric.falling(y[i])


def test_falling_exponential_to_two_ulp():
    random = np.random.default_rng(1)
    y = np.concatenate(
        [
            random.uniform(0, 700, 500),
            10.0 ** random.uniform(-18, 0, 300),
            [0.0, 700.0, np.log(2.0)],
        ]
    )
    out = np.empty((2, y.size))
    exponentials(y, out)
    with mp.workdps(40):
        for at, *found in zip(y, *out, strict=True):
            for value, exact in zip(
                found, (mp.exp(-mp.mpf(at)), -mp.expm1(-mp.mpf(at))), strict=True
            ):
                assert abs(mp.mpf(float(value)) - exact) <= 2 * np.spacing(float(exact))


def solved(rows, times, method=closed, rtol=1e-13):
    rows = np.asarray(rows, float)
    return solution.trajectories(
        method, rows, np.tile(np.asarray(times, float), (len(rows), 1)), rtol
    )


def free(count, seed, b=1.0, phi0=3.0, w0=1.0, gap=None):
    """Rows with g = 0; n = b (1 + gap) where a gap is given."""
    rows = np.random.default_rng(seed).normal(size=(count, 8)) * [b, b, 0, 0, 0, 0, phi0, w0]
    if gap is not None:
        F = rows[:, 0] * np.sin(rows[:, 6]) + rows[:, 1] * np.cos(rows[:, 6])
        rows[:, 7] = F + np.hypot(rows[:, 0], rows[:, 1]) * (1.0 + gap)
    return rows


def curved(count, seed, mu, gap=None):
    """Rows that meet (61) but for their rounding; n = |mu| b (1 + gap) where a gap is given."""
    random = np.random.default_rng(seed)
    rows, n = random.normal(size=(count, 8)) * [1, 1, 1, 1, 1, 1, 3, 1], random.normal(size=count)
    b12, b31, phi0 = rows[:, 0], rows[:, 1], rows[:, 6]
    n = n if gap is None else abs(mu) * np.hypot(b12, b31) * (1.0 + gap)
    delta, sigma = mu * (1.0 - mu), (mu - 1.0) * n
    rows[:, 2:6] = np.transpose(
        [delta * (b12**2 - b31**2), delta * b12 * b31, sigma * b12, sigma * b31]
    )
    rows[:, 7] = mu * (b12 * np.sin(phi0) + b31 * np.cos(phi0)) + n
    return rows


def exact(row, t):
    """phi and w of g = 0 at t: phi' = F + n, u = tan(x/2) = w0 tanh z/(D - f0 tanh z), z = D t/2,
    D^2 = b^2 - n^2.
    """
    b12, b31, *_rest, phi0, w0 = map(mp.mpf, map(float, row))
    F, f = b12 * mp.sin(phi0) + b31 * mp.cos(phi0), b12 * mp.cos(phi0) - b31 * mp.sin(phi0)
    square = w0 * (w0 - 2 * F) - f * f
    D, turns = mp.sqrt(abs(square)), 0
    if square > 0:
        turns = mp.nint(D * t / (2 * mp.pi))
        z = D * t / 2 - turns * mp.pi
        y1, y2 = w0 * mp.sin(z) / D, mp.cos(z) - f * mp.sin(z) / D
    else:
        y1, y2 = w0 * mp.sinh(D * t / 2) / D, mp.cosh(D * t / 2) - f * mp.sinh(D * t / 2) / D
    x = 2 * (mp.atan2(y1, y2) + turns * (mp.pi if w0 > 0 else -mp.pi))
    return phi0 + x, w0 / (y1 * y1 + y2 * y2)


@pytest.mark.parametrize(
    "scale",
    [
        {},
        {"phi0": 1e6},
        {"w0": 1e-3},
        {"w0": 1e-12},  # next to an equilibrium
        {"w0": 100.0},
        {"b": 30.0},  # stiff
        {"b": 1e-9},
        # Delta^2 changes sign
        *({"gap": gap} for gap in (1e-3, 1e-8, 1e-13, 0.0, -1e-13, -1e-8, -1e-3)),
    ],
    ids=str,
)
def test_bars_hold_and_are_narrow_where_g_is_0(scale):
    rows, times = free(12, 7, **scale), [0.3, 20.0, 3000.0]
    floats, turnings, status = solved(rows, times)
    assert (status == OK).mean() > 0.9 and (turnings[status == OK] == 0).all()
    shares = []
    with mp.workdps(60):
        for row, *found in zip(rows, *np.swapaxes(floats, 0, 1), strict=True):
            for t, (phi, w, bar_phi, bar_w) in zip(times, found, strict=True):
                if np.isfinite(phi):
                    wanted = exact(row, t)
                    assert (
                        abs(float(phi) - wanted[0]) <= bar_phi
                        and abs(float(w) - wanted[1]) <= bar_w
                    )
                    shares.append(float(abs(float(phi) - wanted[0]) / bar_phi))
    assert np.median(shares) > 1e-3


def test_bars_hold_about_the_largest_w_of_a_motion_that_starts_slowly():
    """There y1^2 + y2^2 has lost the digits of w, and w hardly depends on phi."""
    rows = free(20, 3)
    rows[:, 7] = np.logspace(-10, -3, 20) * np.where(np.arange(20) % 2, 1.0, -1.0)
    times = np.tile(np.linspace(0.1, 40.0, 200), (20, 1))
    for width in (0.2, 1e-3):
        found, _turnings, _status = solution.trajectories(closed, rows, times, 1e-13)
        largest = times[np.arange(20), np.nanargmax(np.abs(found[..., 1]), axis=1), None]
        times = largest + np.linspace(0.0, width, 200)
    times = largest + np.array([0.0, 1e-6, 1e-3])
    floats, _turnings, status = solution.trajectories(closed, rows, times, 1e-13)
    risen = np.abs(floats[:, 0, 1]) > 100 * np.abs(rows[:, 7])
    assert (risen & (status[:, 0] == OK)).sum() > 10
    with mp.workdps(60):
        for i, j in zip(*np.nonzero(status == OK), strict=True):
            phi, w, bar_phi, bar_w = floats[i, j]
            wanted = exact(rows[i], times[i, j])
            assert abs(float(phi) - wanted[0]) <= bar_phi and abs(float(w) - wanted[1]) <= bar_w


@pytest.mark.parametrize("mu", [-1.0, 0.25, 0.5, 2.0])
def test_bars_hold_where_a_motion_on_61_leaves_one_rest_for_another(mu):
    """Between both w is large, and what leads away from the curve grows as a power of it (mu = 1/4: the third)."""
    rows, random = curved(150, 6, mu), np.random.default_rng(7)
    b12, b31 = rows.T[:2]
    b, angle = np.hypot(b12, b31), np.arctan2(b31, b12)
    n = mu * b * random.uniform(-0.95, 0.95, 150)
    rows[:, 4], rows[:, 5] = (mu - 1.0) * n * b12, (mu - 1.0) * n * b31
    rest = np.arcsin(-n / (mu * b))
    rest = np.where(random.random(150) < 0.5, rest, np.pi - rest) - angle
    rows[:, 6] = rest + random.choice([-1, 1], 150) * 10.0 ** random.uniform(-14, -1, 150)
    rows[:, 7] = mu * b * np.sin(rows[:, 6] + angle) + n
    floats, _turnings, status = solved(rows, np.linspace(0.5, 30.0, 8) / abs(mu), rtol=1e-8)
    wanted, _turnings, known = solved(rows, np.linspace(0.5, 30.0, 8) / abs(mu), taylor_double)
    both = (status == OK) & (known == OK)
    assert both.mean() > 0.6
    assert (np.abs(floats - wanted)[both][:, :2] <= (floats + wanted)[both][:, 2:]).all()
    angles = rows[:, 6:7] + np.linspace(-6.0, 6.0, 12)
    floats, status = solution.abel(closed, rows, angles, 1e-8)
    wanted, known = solution.abel(taylor_double, rows, angles, 1e-8)
    both = (status == OK) & (known == OK)
    assert both.mean() > 0.02 and (known[status == OK] == OK).all()
    assert (np.abs(floats - wanted)[both][:, :2] <= (floats + wanted)[both][:, 2:]).all()


def test_what_leads_away_from_a_uniform_rotation_is_in_the_bar():
    """mu = 0: w = n = 3/4 rotates uniformly, and what w0 is off by grows by up to e^(2 b / n) on the way."""
    rows = np.array([[-0.5, 1.0, 0.0, 0.0, 0.375, -0.75, 3.25, w0]
                     for w0 in 0.75 + np.arange(-4, 5) * 2.0**-53 for _ in range(3)])  # fmt: skip
    rows[:, 6] += np.linspace(0, 6, len(rows))
    angles = rows[:, 6:7] + np.array([-11.0, -4.0, 3.0, 14.0])
    floats, status = solution.abel(closed, rows, angles, 1e-12)
    exact, _status = solution.abel(taylor_double, rows, angles, 1e-12)
    assert (status == OK).all()
    assert (np.abs(floats - exact)[..., :2] <= (floats + exact)[..., 2:]).all()
    times = np.abs(exact[..., 1])
    floats, _turnings, status = solution.trajectories(closed, rows, np.sort(times), 1e-12)
    exact, _turnings, _status = solution.trajectories(taylor_double, rows, np.sort(times), 1e-12)
    assert (status == OK).all()
    assert (np.abs(floats - exact)[..., :2] <= (floats + exact)[..., 2:]).all()


@pytest.mark.parametrize(("b", "n"), [(1.0, 0.3), (1.0, 0.25), (3.0, 1.0)])
def test_what_leads_away_from_a_nearly_uniform_rotation_is_in_the_bar(b, n):
    """mu of some roundings: w varies by mu b, less than six square roots of a ratio can tell from 1."""
    k = np.array([0.5, 1, 2, 3, 5, 10, 20, 30, 45, 60, 70, 100, 1000, 1e5])
    mu = k * 2.0**-52 * n / (2 * b)
    zero = np.zeros_like(mu)
    # g = (mu - 1) f (mu F + n), f = b cos phi, F = b sin phi
    rows = np.transpose([zero + b, zero, mu * (1 - mu) * b * b, zero, (mu - 1) * n * b, zero,
                         zero + 0.4, mu * b * np.sin(0.4) + n])  # fmt: skip
    angles = rows[:, 6:7] + np.array([0.5, 2.0, 5.0, 20.0])
    floats, status = solution.abel(closed, rows, angles, 1e-8)
    exact, known = solution.abel(taylor_double, rows, angles, 1e-8)
    both = (status == OK) & (known == OK)
    assert both.all() and (np.abs(floats - exact)[..., :2] <= (floats + exact)[..., 2:]).all()
    times = exact[..., 1]
    floats, _turnings, status = solution.trajectories(closed, rows, times, 1e-8)
    exact, _turnings, known = solution.trajectories(taylor_double, rows, times, 1e-8)
    assert ((status == OK) & (known == OK)).all()
    assert (np.abs(floats - exact)[..., :2] <= (floats + exact)[..., 2:]).all()


def series(row, t):
    """phi and w of (57) at t by Taylor series of order 30 with 34 digits."""
    b12, b31, d, c23, s2, s3, phi, w = map(mp.mpf, map(float, row))
    rest = mp.mpf(t)
    while rest > 0:
        S, C, W = [mp.sin(phi)], [mp.cos(phi)], [w]
        for n in range(30):
            double = [sum(a * b for a, b in zip(S, reversed(B), strict=True)) for B in (C, S)]
            turn = [
                sum(a * b for a, b in zip(W, reversed(B), strict=True)) / (n + 1) for B in (C, S)
            ]
            g = s2 * C[n] - s3 * S[n] - d * double[0] - c23 * ((1 if n == 0 else 0) - 2 * double[1])
            S.append(turn[0])
            C.append(-turn[1])
            W.append(b12 * S[-1] + b31 * C[-1] + g / (n + 1))
        h = min(
            rest,
            (mp.mpf(10) ** -34 / max(abs(W[-1]), abs(W[-2]), mp.mpf(10) ** -60))
            ** (mp.mpf(1) / 30),
        )
        phi += sum(a * h ** (k + 1) / (k + 1) for k, a in enumerate(W))
        w, rest = sum(a * h**k for k, a in enumerate(W)), rest - h
    return phi, w


@pytest.mark.parametrize("mu", [pytest.param(1.5, marks=pytest.mark.slow), -0.7, 0.5, 0.1, 0.0])
def test_bars_hold_where_61_is_met_within_rounding(mu):
    rows = np.concatenate([curved(2, 3, mu), curved(2, 4, mu, 0.2)])
    floats, _turnings, status = solved(rows, [3.0])
    assert (status == OK).all()
    with mp.workdps(34):
        for row, (phi, w, bar_phi, bar_w) in zip(rows, floats[:, 0], strict=True):
            wanted = series(row, 3.0)
            assert abs(float(phi) - wanted[0]) <= bar_phi and abs(float(w) - wanted[1]) <= bar_w


@pytest.mark.parametrize("gap", [None, 0.3, -0.2, 0.01])
@pytest.mark.parametrize("mu", [3.0, 0.52, 0.5, 0.03])
def test_on_61_hundreds_agree_with_taylor_series_within_both_bars(mu, gap):
    rows, times = curved(200, 5, mu, gap), [0.5, 4.0, 20.0]
    mine, turns, status = solved(rows, times)
    other, counted, fine = solved(rows, times, taylor)
    both = (status == OK) & (fine == OK)
    assert both.mean() > 0.5
    assert (np.abs(mine - other)[both][:, :2] <= mine[both][:, 2:] + other[both][:, 2:]).all()
    both &= (turns >= 0) & (counted >= 0)
    assert np.array_equal(turns[both], counted[both])


def test_numbers_that_meet_61_exactly_have_no_part_in_the_bar():
    """b12, b31, n multiples of 1/64, mu = 3/2, phi0 = 0: only what is evaluated is rounded."""
    b12, b31 = np.random.default_rng(2).integers(1, 65, (2, 50)) / 64.0
    n = np.ceil(64.0 * 2.0 * np.hypot(b12, b31)) / 64.0
    zero = np.zeros(50)
    exactly = [b12, b31, -0.75 * (b12**2 - b31**2), -0.75 * b12 * b31, 0.5 * n * b12, 0.5 * n * b31]
    rows = np.transpose([*exactly, zero, 1.5 * b31 + n])
    moved = rows * (1.0 + 4e-15 * (np.arange(8) == 3))
    phi, _w, narrow, _bar = solved(rows, [20.0])[0][:, 0].T
    assert (narrow < 2e-13 * phi).all() and np.median(
        solved(moved, [20.0])[0][:, 0, 2] / narrow
    ) > 1.5


def test_the_same_bits_in_any_lane_beside_any_neighbour():
    rows = np.concatenate([free(40, 1), curved(30, 2, 1.5), free(10, 3) * [0, 0, 1, 1, 1, 1, 1, 1]])
    rows[70:, 2:6] = np.random.default_rng(4).normal(size=(10, 4))  # b = 0
    times = [0.0, 1.0, 7.0, 20.0]
    order = np.random.default_rng(6).permutation(len(rows))
    whole = solved(rows, times)
    assert (whole[2] == OK).mean() > 0.9
    for pick in (order, order[:9], order[:1]):
        for part, all_of_them in zip(solved(rows[pick], times), whole, strict=True):
            assert np.array_equal(part, all_of_them[pick], equal_nan=True)
    for part, all_of_them in zip(solved(rows, times[1:2]), whole, strict=True):
        assert np.array_equal(part[:, 0], all_of_them[:, 1], equal_nan=True)


@pytest.mark.parametrize("place", [0, 1, 6, 7])
def test_a_row_of_nan_costs_itself_alone(place):
    rows = free(9, 7)
    good = solved(rows, [5.0])
    rows[3, place] = np.nan
    bad = solved(rows, [5.0])
    assert np.isnan(bad[0][3]).all() and bad[2][3] != OK
    for one, other in zip(good, bad, strict=True):
        assert np.array_equal(np.delete(one, 3, axis=0), np.delete(other, 3, axis=0))


def test_no_answer_where_the_range_of_numbers_ends():
    rows = free(9, 8) * 1e-120
    assert (solved(rows, [1e120])[2] != OK).all()
