"""The kept table of critical amplitudes: every edge within its error by multiprecision, all of
them, to 12 digits.
"""

import csv
from pathlib import Path

import numpy as np
import pytest
import satellite_critical_amplitudes as critical
from hill_problems import REFERENCE, mp_factors
from mpmath import mp, mpf

ROOT = Path(__file__).parents[2]

with (ROOT / "results/satellite_critical_amplitudes.csv").open() as file:
    ROWS = list(csv.DictReader(file))
# in mp_factors
PLACE = {"even_antiperiodic": 0, "even_periodic": 1, "odd_periodic": 2, "odd_antiperiodic": 3}
CASES = {(case.body, case.motion): case for case in critical.CASES}


def case_of(row):
    return CASES[row["body"], row["motion"]]


def exactly(case, one_minus_k, digits=40):
    """y1, y1', y2, y2' at T/2 for rho = 1/sqrt(3) to all digits."""
    family = ("P" if case.alpha < 1 else "O") + ("L" if case.side > 0 else "R")
    with mp.workdps(digits):
        return mp_factors(family, 1 - one_minus_k, case.direction / mp.sqrt(3), digits)


def assert_within(row, digits=40):
    """The factor of the row's class changes its sign within the error, in mpmath."""
    with mp.workdps(digits):
        place, error = mpf(float(row["one_minus_k"])), mpf(float(row["one_minus_k_error"]))
        low, high = (
            exactly(case_of(row), place + side * error, digits)[PLACE[row["class"]]]
            for side in (-1, 1)
        )
        assert low * high < 0
        if row["rest_rad"]:  # a libration: the angles as exactly as 1 - k
            angle = 2 * mp.asin(mp.sqrt(place / 2))
            assert abs(mpf(float(row["rest_rad"])) - angle) < float(row["rest_error_rad"])
            assert abs(mpf(float(row["amplitude_rad"])) - mp.pi / 2 + angle) < float(
                row["amplitude_error_rad"]
            )
            assert abs(mpf(float(row["amplitude_deg"])) - mp.degrees(mp.pi / 2 - angle)) < 1e-13


@pytest.mark.parametrize(
    "row",
    [
        *(ROWS[i] for i in (0, 1, 2, 68, -3, -2, -1)),
        *(pytest.param(ROWS[i], marks=pytest.mark.slow) for i in (5, 45, 67)),
    ],
    ids=lambda row: row["class"],
)
def test_edges_lie_within_their_errors(row):
    assert_within(row, 30)


@pytest.mark.slow
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["one_minus_k"])
def test_every_edge_lies_within_its_error(row):
    assert_within(row)


def test_twelve_digits():
    for row in ROWS:
        assert float(row["one_minus_k_error"]) < 5e-13 * abs(float(row["one_minus_k"]))
        assert float(row["k_error"]) < 5e-13
        if row["rest_rad"]:
            assert float(row["amplitude_error_rad"]) < 5e-13 * float(row["amplitude_rad"])
            assert float(row["rest_error_rad"]) < 5e-13 * float(row["rest_rad"])
    assert min(float(row["rest_rad"]) for row in ROWS if row["rest_rad"]) < 3e-11


def test_the_reference_to_thirty_digits():
    """Rod, with the orbit: the end of tongue n = 2."""
    [reference] = REFERENCE["rotation_boundaries"]
    known = mpf(reference["k_star"])
    near = min(ROWS, key=lambda row: abs(float(row["k"]) - float(known)))
    assert near["class"] == "even_periodic" and near["motion"] == "rotations with the orbit"
    assert abs(mpf(float(near["k"])) - known) < float(near["k_error"]) < 1e-14


@pytest.mark.parametrize(
    "case", [critical.CASES[i] for i in (0, 2, 3)], ids=lambda case: case.motion
)
def test_the_command_finds_the_kept_edges_again(case):
    rows = [row for row in ROWS if case_of(row) == case]
    found = critical.edges(case, panels=11)
    assert [(edge.kind, edge.index) for edge in found] == [
        (row["class"], int(row["tongue"])) for row in rows
    ]
    for edge, row in zip(found, rows, strict=True):
        short, error = abs(float(row["one_minus_k"])), float(row["one_minus_k_error"])
        assert abs(edge.short - short) <= error + edge.error * edge.short


def test_the_largest_growth_of_the_rod():
    """Tongue n = 3, e^0.987 at 67.6 degrees (satellite.md: What is known): by mpmath there and beside it."""
    case = critical.CASES[0]
    x, value = critical.largest(case, *(edge.x for edge in critical.edges(case)[:2]))
    assert 90 - np.degrees(critical.rest(np.exp(-x))) == pytest.approx(67.6, abs=0.05)
    with mp.workdps(30):
        there, *beside = (
            exact_growth(case, mp.exp(-mpf(x) + step)) for step in (0, mpf("-1e-3"), mpf("1e-3"))
        )
    assert abs(there - value) < 1e-12 and max(beside) < there


def exact_growth(case, one_minus_k):
    y1, _, _, dy2, *_ = exactly(case, one_minus_k, 30)
    orbits = 4 * mp.ellipk((1 - one_minus_k) ** 2) / mp.sqrt(3) / (2 * mp.pi)
    return mp.acosh(abs(2 * y1 * dy2 - 1)) / orbits
