"""Critical mass ratios: against exact enclosures by Sturm's theorem, against formulas, against
verdicts beside them.
"""

import csv
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np

import survey
from survey.measures.libration import critical

KEPT = Path(__file__).parents[3] / "results" / "libration_critical_values.csv"
SYMBOLS = {
    "D4_is_0": "mu_c",
    "resonance_1_to_3": "mu2",
    "a02_is_0": "mu_d",
    "resonance_1_to_2": "mu1",
    "routh": "mu_R",
}


def test_every_bar_holds_and_is_a_rounding():
    with KEPT.open() as file:
        exact = {row["symbol"]: row for row in csv.DictReader(file)}
    names = {code: name for name, code in critical.CLASSES.items()}
    assert len(critical.ratios()) == len(SYMBOLS)
    for code, mu, bar in critical.ratios():
        row = exact[SYMBOLS[names[code]]]
        assert abs(Decimal(mu) - Decimal(row["mu"])) <= Decimal(bar) + Decimal(row["error"])
        assert bar <= 0.51 * np.spacing(mu)


def test_routh():
    """(1 - sqrt(69)/9)/2, as an inequality of rationals: (9 (1 - 2 mu))^2 = 69."""
    mu, bar = next(
        (mu, bar) for code, mu, bar in critical.ratios() if code == critical.CLASSES["routh"]
    )
    low, high = ((9 * (1 - 2 * (Fraction(mu) + side * Fraction(bar)))) ** 2 for side in (1, -1))
    assert low < 69 < high


def test_verdicts_change_there_and_nowhere_else():
    mus = np.array([mu for _, mu, _ in critical.ratios()])
    below, above = np.nextafter(mus, 0.0), np.nextafter(mus, 1.0)
    sides = [
        survey.evaluate("libration", mu=x, variables=["verdict"]).verdict.values
        for x in (below, mus, above)
    ]
    assert sides[0].tolist() == [1, 2, 2, 1, 1] and sides[2].tolist() == [2, 2, 1, 1, 0]
    assert sides[1][[1, 3, 4]].tolist() == [3, 3, 4]
    grid = np.linspace(1e-6, 0.05, 20001)
    verdict = survey.evaluate("libration", mu=grid, variables=["verdict"]).verdict.values
    changes = np.flatnonzero(np.diff(verdict))
    assert [np.searchsorted(mus, grid[i + 1]) - np.searchsorted(mus, grid[i]) for i in changes] == [
        1,
        1,
        1,
    ]


def test_a_line_of_boundaries_in_a_file(tmp_path):
    asked = {
        "scene": "libration",
        "axes": {"mu": {"start": 0.01, "stop": 0.04, "num": 7}},
        "boundaries": {},
    }
    ds = survey.run(asked, output=tmp_path / "o.nc")
    found = survey.edge("libration", along="mu", mu=(0.01, 0.04))
    np.testing.assert_array_equal(ds.edge_position, found.edge)
    assert (
        found.attrs["complete"] == 1
        and ds.survey.boundary(kind="routh").mu.item() == found.edge[-1]
    )
