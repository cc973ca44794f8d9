"""Roots of g beside degenerate ones, against polynomial roots with 60 digits: numbers, angles,
multiplicities.
"""

import math

import mpmath as mp
import numpy as np
import pytest
from flow_truth import is_real, roots

from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder.flow import BOUND_DDG, coefficients

ANGLES = (0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi)


def fold(angle, d, c23):
    """A system with g = g' = 0 at an angle, up to rounding."""
    s, c, double_s, double_c = (
        math.sin(angle),
        math.cos(angle),
        math.sin(2 * angle),
        math.cos(2 * angle),
    )
    g, slope = 0.5 * d * double_s + c23 * double_c, d * double_c - 2.0 * c23 * double_s
    return [0.0, 0.0, d, c23, g * c - slope * s, -g * s - slope * c]


def cusp(angle, size):
    """The same with g'' = 0: a triple root."""
    return fold(angle, 2.0 * size * math.cos(2 * angle), -size * math.sin(2 * angle))


def exact(random, triple):
    """A fold or a cusp at a multiple of pi/2 without any rounding."""
    quarter = int(random.integers(4))
    s, c = ((0, 1), (1, 0), (0, -1), (-1, 0))[quarter]
    d, c23 = (int(n) / 8.0 for n in random.integers(-16, 17, 2))
    g, slope = c23 * (c * c - s * s) * (not triple), (d or 0.5) * (c * c - s * s)
    return [0.0, 0.0, d or 0.5, 0.0 if triple else c23, g * c - slope * s, -g * s - slope * c]


def systems(seed, folds, specials, triples):
    """Random folds and cusps, up to rounding, beside each other or exact; every other one off by
    1e-16 to 1e-4.
    """
    random = np.random.default_rng(seed)
    rows = [exact(random, False) for _ in range(specials)] + [
        exact(random, True) for _ in range(triples)
    ]
    for i in range(folds):
        angle = random.uniform(-math.pi, math.pi) if i % 5 else ANGLES[i // 5 % 4]
        d, c23 = random.normal(size=2) * 10.0 ** random.uniform(-3, 3, 2)
        row = cusp(angle, d) if i % 3 == 0 else fold(angle, d, c23)
        if i % 2:
            size = max(map(abs, row))
            row[2 + i // 2 % 4] += size * random.choice([-1, 1]) * 10.0 ** random.uniform(-16, -4)
        rows.append(row)
    scales = 2.0 ** random.integers(-60, 30, len(rows))
    return np.array(rows) * scales[:, None]


@mp.workdps(60)
def checked(six):
    """Are the roots where `clustered` says, as many as it says? Returns the number of rows, and of
    degenerate ones.
    """
    p, table = coefficients(*six), np.zeros((eq.MOST, 10))
    rows = table[: eq.clustered(p, table)[0]]
    assert (np.diff(rows[:, eq.ANGLE]) > 0).all() and (rows[:, eq.ANGLE] < 2 * math.pi).all()
    inside, angles = np.zeros(len(rows), int), roots(six)
    for angle in angles:
        slips = [(angle - row[eq.ANGLE] + mp.pi) for row in rows]
        slips = [abs(mp.mpc(slip.real % (2 * mp.pi) - mp.pi, slip.imag)) for slip in slips]
        home = [i for i, slip in enumerate(slips) if slip <= rows[i, eq.BAR]]
        assert len(home) == 1 or (not home and not is_real(angle)), (list(six), angle)
        inside[home] += 1
        for i in home:
            if rows[i, eq.KIND] != eq.DEGENERATE:
                d, c23, s2, s3 = map(mp.mpf, six[2:])
                x = angle.real
                slope = (
                    -d * mp.cos(2 * x) + 2 * c23 * mp.sin(2 * x) - s2 * mp.sin(x) - s3 * mp.cos(x)
                )
                assert (rows[i, eq.KIND] == eq.SADDLE) == (slope > 0)
                assert abs(rows[i, eq.DG] - slope) <= p[BOUND_DDG] * rows[i, eq.BAR]
    degenerate = rows[:, eq.KIND] == eq.DEGENERATE
    assert (inside[~degenerate] == 1).all() and np.isin(inside[degenerate], (2, 3)).all(), (
        list(six),
        inside,
    )
    assert (rows[~degenerate, eq.BAR] < 1e-10).all()
    return len(rows), int(degenerate.sum())


def test_clusters_hold_the_roots_that_they_say():
    rows = systems(1, 80, 8, 2)
    counts = np.array([checked(six) for six in rows])
    assert (counts[:10, 1] == 1).all() and (counts[10:, 1] == 0).mean() > 0.8


@pytest.mark.slow
def test_clusters_of_many_systems():
    for six in systems(2, 9000, 960, 40):
        checked(six)


def test_clusters_are_the_roots_that_bisection_finds():
    random = np.random.default_rng(3)
    one, two, tried = np.zeros((eq.MOST, 10)), np.zeros((eq.MOST, 10)), 0
    for six in random.normal(size=(200, 6)) * 10.0 ** random.uniform(-3, 3, (200, 6)):
        p = coefficients(*six)
        count = eq.bisected(p, one)
        found, hidden = eq.clustered(p, two)
        if count >= 0:
            assert found == count and not hidden
            assert (one[:count, eq.KIND] == two[:count, eq.KIND]).all()
            bars = one[:count, eq.BAR] + two[:count, eq.BAR]
            assert (np.abs(one[:count, eq.ANGLE] - two[:count, eq.ANGLE]) <= bars).all()
            tried += 1
    assert tried > 190


@pytest.mark.parametrize(
    "six", [(0.7, -0.4, 1.1, 0.3, 0.3, -1.1), (0, 0, 1, 0.5, 1, 0.5), (0, 0, 0, 1, -1, 0)]
)
def test_a_double_root_is_one_degenerate_row(six):
    p, table = coefficients(*map(float, six)), np.zeros((eq.MOST, 10))
    count, hidden = eq.equilibria(p, table)
    assert hidden and count == 3 and np.count_nonzero(table[:count, eq.KIND] == eq.DEGENERATE) == 1


def test_without_g_there_are_no_rows():
    assert eq.clustered(coefficients(1.0, 2.0, 0.0, 0.0, 0.0, 0.0), np.zeros((eq.MOST, 10))) == (
        0,
        False,
    )
