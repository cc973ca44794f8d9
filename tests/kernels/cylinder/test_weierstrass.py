"""Trajectories with b = 0 by Weierstrass's functions: references of 30 digits, Taylor series, bits
in any lane.
"""

import json
from importlib.resources import files

import mpmath as mp
import numpy as np
import pytest

from survey.kernels.cylinder import weierstrass
from survey.kernels.cylinder.steps import OK, UNDETERMINED
from survey.kernels.jit import fresh
from survey.measures.cylinder import solution
from survey.methods import closed, taylor


@fresh
def angles(y, x, out):
    for i in range(x.size):
        out[i] = weierstrass.arctangent(y[i], x[i])


def solved(rows, times, method=closed, rtol=1e-13):
    rows = np.asarray(rows, float)
    return solution.trajectories(
        method, rows, np.tile(np.asarray(times, float), (len(rows), 1)), rtol
    )


def drawn(count, seed, scale=(1, 1, 1, 1, 3, 1)):
    """Rows with b = 0; `scale` of d, c23, s2, s3, phi0, w0."""
    return np.random.default_rng(seed).normal(size=(count, 8)) * [0, 0, *scale]


def test_arctangent_to_two_ulp():
    random = np.random.default_rng(1)
    turn = random.uniform(-np.pi, np.pi, 2000)
    y, x = np.sin(turn), np.cos(turn)
    near = np.tile([0.0, 1.0, -1.0, np.tan(np.pi / 8), 1.0], 60)
    y = np.concatenate(
        [
            y,
            near + random.normal(size=300) * 10.0 ** random.uniform(-17, -1, 300),
            [0.0, 1e-300, 1.0, 1.0],
        ]
    )
    x = np.concatenate([x, random.choice([-1.0, 1.0, 1e-9], 300), [1.0, 1.0, 0.0, -1e-300]])
    out = np.empty(x.size)
    angles(y, x, out)
    with mp.workdps(40):
        exact = [mp.atan2(mp.mpf(float(a)), mp.mpf(float(b))) for a, b in zip(y, x, strict=True)]
        for found, wanted in zip(out, exact, strict=True):
            assert abs(mp.mpf(float(found)) - wanted) <= 2 * np.spacing(abs(float(wanted)))


def series(row, t):
    """phi and w at t by Taylor series of order 30 with 34 digits."""
    d, c23, s2, s3, phi, w = (mp.mpf(float(value)) for value in row[2:])
    rest = mp.mpf(t)
    while rest > 0:
        S, C, W = [mp.sin(phi)], [mp.cos(phi)], [w]
        for n in range(30):
            double = [sum(a * b for a, b in zip(S, reversed(B), strict=True)) for B in (C, S)]
            cosine = (1 if n == 0 else 0) - 2 * double[1]
            turn = [
                sum(a * b for a, b in zip(W, reversed(B), strict=True)) / (n + 1) for B in (C, S)
            ]
            W.append((s2 * C[n] - s3 * S[n] - d * double[0] - c23 * cosine) / (n + 1))
            S.append(turn[0])
            C.append(-turn[1])
        h = min(rest, (mp.mpf(10) ** -34 / max(map(abs, W[-2:]))) ** (mp.mpf(1) / 30))
        phi += sum(a * h ** (k + 1) / (k + 1) for k, a in enumerate(W))
        w, rest = sum(a * h**k for k, a in enumerate(W)), rest - h
    return phi, w


def within(found, exact):
    return all(abs(mp.mpf(float(found[i])) - exact[i]) <= found[2 + i] for i in (0, 1))


def test_references_to_t_20_lie_within_narrow_bars():
    data = json.loads((files("survey.reference") / "gyrostat_trajectories.json").read_text())[
        "still"
    ]
    rows = [
        [float.fromhex(x) for x in (*case["p_hex"], case["phi0_hex"], case["w0_hex"])]
        for case in data
    ]
    floats, _turnings, status = solved(rows, [20.0])
    assert (status == OK).all() and (
        floats[..., 2:] < 1e-12 * (1 + np.abs(floats[..., :2]))
    ).mean() > 0.9
    for found, case in zip(floats[:, 0], data, strict=True):
        assert within(found, [mp.mpf(case["phi"]), mp.mpf(case["w"])])


@pytest.mark.parametrize(
    "scale",
    [
        (1, 1, 1, 1, 3, 1),
        pytest.param((1, 1, 1, 1, 3, 0), marks=pytest.mark.slow),  # from rest
        (1, 1, 1, 1, 1, 1e-7),  # nearly so
        (0, 0, 0, 1, 3, 1),  # pendulum
        (1, 0, 0, 0, 3, 1),  # two wells alike
        (-1, 0, 0, 1, 0, 1),  # g = 0 at the start
        pytest.param((1, 1, 1, 1, 1e5, 1), marks=pytest.mark.slow),
        pytest.param((1, 1, 1, 1, 3, 20), marks=pytest.mark.slow),
    ],
)
def test_bars_hold_against_multiprecision(scale):
    rows = drawn(5, 11, scale)
    floats, _turnings, status = solved(rows, [0.4, 3.0])
    assert (status == OK).all()
    with mp.workdps(34):
        for row, found in zip(rows, floats, strict=True):
            assert within(found[0], series(row, 0.4)) and within(found[1], series(row, 3.0))


@pytest.mark.parametrize(
    ("scale", "unit"),
    [
        ((1, 1, 1, 1, 3, 1), 1.0),
        ((9, 9, 9, 9, 3, 3), 1.0),
        ((3, 1, 0.01, 0.01, 3, 1), 1.0),  # two wells
        ((1, 1, 1, 1, 3, 0.01), 1.0),
        pytest.param((1, 1, 1, 1, 3, 1), 100.0, marks=pytest.mark.slow),  # long
        ((1e-9, 1e-9, 1e-9, 1e-9, 3, 1e-5), 1e4),
    ],
)
def test_thousands_agree_with_taylor_series_within_both_bars(scale, unit):
    rows, times = drawn(1000, 3, scale), unit * np.array([0.01, 0.5, 3.0, 20.0])
    mine, turns, status = solved(rows, times)
    other, counted, fine = solved(rows, times, taylor)
    both = (status == OK) & (fine == OK)
    assert both.mean() > 0.99
    assert (np.abs(mine - other)[both][:, :2] <= mine[both][:, 2:] + other[both][:, 2:]).all()
    both &= (turns != UNDETERMINED) & (counted != UNDETERMINED)
    assert both.mean() > 0.99 and np.array_equal(turns[both], counted[both])


def test_the_same_bits_in_any_lane_beside_any_neighbour():
    rows, times = drawn(2 * weierstrass.LANES + 5, 5), [1.0, 7.0, 20.0]
    whole = solved(rows, times)
    order = np.random.default_rng(6).permutation(len(rows))
    for pick in (order, order[:9], order[:1]):
        for part, all_of_them in zip(solved(rows[pick], times), whole, strict=True):
            assert np.array_equal(part, all_of_them[pick])
    for part, all_of_them in zip(solved(rows, times[1:2]), whole, strict=True):
        assert np.array_equal(part[:, 0], all_of_them[:, 1])


@pytest.mark.parametrize("place", range(2, 8))
def test_a_row_of_nan_costs_itself_alone(place):
    rows = drawn(9, 7)
    good = solved(rows, [5.0])
    rows[3, place] = np.nan
    bad = solved(rows, [5.0])
    assert np.isnan(bad[0][3]).all() and bad[2][3] != OK
    for one, other in zip(good, bad, strict=True):
        assert np.array_equal(np.delete(one, 3, axis=0), np.delete(other, 3, axis=0))


def test_no_answer_where_the_range_of_numbers_ends():
    rows = drawn(9, 8)
    rows[:, 2:6] *= 1e-80
    rows[:, 7] *= 1e-40
    assert (solved(rows, [1e40])[2] != OK).all()
