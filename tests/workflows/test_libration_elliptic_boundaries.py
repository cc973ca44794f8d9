"""The kept curves of Danby's map: within their errors by multiprecision, and to 1e-12."""

import csv
import json
import re
from importlib import resources
from itertools import pairwise
from pathlib import Path

import libration_elliptic_boundaries as boundaries
import pytest
from danby_exact import factors
from mpmath import mp, mpf

ROOT = Path(__file__).parents[2]
REFERENCE = json.loads(
    resources.files("survey.reference").joinpath("libration_elliptic.json").read_text()
)

with (ROOT / "results/libration_elliptic_boundaries.csv").open() as file:
    ROWS = {(row["curve"], row["e"]): row for row in csv.DictReader(file)}


@pytest.mark.parametrize("row", REFERENCE["boundary"], ids=lambda row: f"{row['curve']}-{row['e']}")
def test_known_points_of_the_curves(row):
    found = ROWS[row["curve"], row["e"]]
    with mp.workdps(30):
        # e is stored as the nearest binary64 number: mu moves by less than 0.06 times its rounding
        off = abs(mpf(float(found["mu"])) - mpf(row["mu"]))
        assert off <= mpf(found["mu_error"]) + mpf(2) ** -54
    assert float(found["mu_error"]) < 1e-12


@pytest.mark.parametrize(
    "name",
    [("B", "0.5"), ("B", "0.9"), ("A", "0.2"), ("KC", "0.31"), ("A", "0.3145")],
    ids="-".join,
)
def test_the_curve_lies_within_its_error(name):
    row = ROWS[name]
    with mp.workdps(28):
        mu, error, e = mpf(float(row["mu"])), mpf(row["mu_error"]), mpf(float(row["e"]))
        low, high = (
            factors(mu + side * error, e, 40 if e > 0.6 else 16)[name[0]] for side in (-1, 1)
        )
    assert low * high < 0


def test_the_tip():
    page = (ROOT / "results/libration_elliptic_boundaries.md").read_text()
    (mu, e), (mu_error, e_error) = boundaries.tip()
    for name, value, error in (("mu", mu, mu_error), ("e", e, e_error)):
        with mp.workdps(30):
            assert abs(mpf(float(value)) - mpf(REFERENCE["tip"][name])) <= error < 1e-12
        kept = re.search(rf"\b{name} = (\S+) \+- (\S+)", page)
        assert abs(float(kept[1]) - value) <= float(kept[2])


def test_a_row_of_the_table_is_found_again():
    for curve, e in (("B", "0.2"), ("A", "0.314"), ("KC", "0.314")):
        [point] = boundaries.trace(curve, boundaries.np.array([float(e)]))
        assert abs(point.mu - float(ROWS[curve, e]["mu"])) <= point.error + float(
            ROWS[curve, e]["mu_error"]
        )


def test_the_strip_narrows_to_nothing():
    rows = sorted({float(e) for curve, e in ROWS if curve == "KC"})
    widths = [float(ROWS["KC", f"{e:g}"]["mu"]) - float(ROWS["A", f"{e:g}"]["mu"]) for e in rows]
    assert all(wide > narrow > 0 for wide, narrow in pairwise(widths))
    assert widths[-1] < 1e-11
