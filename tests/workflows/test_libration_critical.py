"""Critical mass ratios: the exact algebra against the published digits, the kept table, and a
polynomial by hand.
"""

import csv
from fractions import Fraction
from pathlib import Path

import libration_critical as critical
import libration_exact as exact
import pytest
from mpmath import mp, mpf

ROOT = Path(__file__).parents[2]

with (ROOT / "results/libration_critical_values.csv").open() as file:
    ROWS = list(csv.DictReader(file))


def known():
    """{symbol: values ascending} of the reference."""
    names = {"mu**": "mu_starstar_a20=0", "mu_c": "mu_c_D4=0", "mu_d": "mu_d_a02=0", "mu_R": "mu_R",
             "det3": "mu_det3=0", "mu1": "mu1_w1=2w2", "mu2": "mu2_w1=3w2", "D6": "D6_zeros"}  # fmt: skip
    found = {symbol: exact.CONSTANTS[name] for symbol, name in names.items()}
    found |= {f"c{label}": zeros for label, zeros in exact.CONSTANTS["coeff_zeros"].items()}
    found["M"] = exact.CONSTANTS["M_zeros_on_lines"]["lines of L = N = 0, any sign"]
    return {
        symbol: sorted([value] if isinstance(value, str) else value)
        for symbol, value in found.items()
    }


def test_the_kept_values_have_the_known_digits_and_none_is_missing():
    kept = {}
    with mp.workdps(40):
        for row in ROWS:
            if not row["symbol"].startswith("("):
                kept.setdefault("M" if row["symbol"] in ("M1", "M2") else row["symbol"], []).append(
                    mpf(row["mu"])
                )
        assert kept.keys() == known().keys()
        for symbol, values in known().items():
            assert len(kept[symbol]) == len(values), symbol
            for value, found in zip(values, sorted(kept[symbol]), strict=True):
                digits = len(value.lstrip("0."))
                assert abs(found / mpf(value) - 1) < mpf(10) ** (2 - digits), symbol


def test_the_command_finds_the_kept_values_again():
    found = (
        critical.boundaries()
        + critical.determinants()
        + critical.coefficients()
        + critical.resonances()
    )
    assert [(v.symbol, str(v.mu)) for v in found] == [(row["symbol"], row["mu"]) for row in ROWS]
    assert all(float(row["error"]) < 1e-15 * float(row["mu"]) for row in ROWS)


def test_signs_change_within_the_error():
    """Of the closed forms in mpmath, and of M on its lines from the coefficients."""
    for row in ROWS:
        name = row["symbol"].removeprefix("c")
        name = {"mu**": "a20", "mu_c": "D4", "mu_d": "a02"}.get(name, name)
        with mp.workdps(exact.DIGITS):
            sides = [mpf(row["mu"]) + side * mpf(row["error"]) for side in (-1, 1)]
            if name in exact.NAMES:
                low, high = (exact.forms(mu)[name] for mu in sides)
            elif name in ("M1", "M2"):
                low, high = (exact.on_ray(mu, int(name[1])) for mu in sides)
            elif name.startswith("("):
                k1, k2, k3 = map(int, name.strip("()").split(","))
                low, high = (k1 * w1 - k2 * w2 + k3 for w1, w2 in map(exact.frequencies, sides))
            else:
                continue
            assert low * high < 0, row


def test_resonances_are_those_of_the_reference():
    table = exact.REFERENCE["resonances_order_le_8_k3_even"]
    rows = [row for row in ROWS if row["symbol"].startswith("(")]
    assert len(rows) == len(table)
    for row, entry in zip(rows, table, strict=True):
        assert row["symbol"] == str(tuple(entry["k"])) and int(row["order"]) == entry["order"]
        assert float(row["mu"]) == pytest.approx(float(entry["mu"]), rel=1e-15)
        assert row["what"].endswith(" definite") == entry["same_sign"]


def test_every_claim_holds():
    assert [holds for _, holds in critical.claims()] == [True] * 4


def test_sturm_counts_by_hand():
    """(5v - 1)^2 (4v - 1) (v - 2) has two different zeros below 1/2; resultants vanish where zeros
    are shared.
    """
    a = critical.times([-1, 5], [-1, 5], [-1, 4], [-2, 1])
    assert critical.count(critical.sturm(a), Fraction(0), Fraction(1, 2)) == 2
    assert critical.zeros(critical.times([-1, 4], [-2, 1])) == [(Fraction(1, 4), Fraction(1, 4))]
    assert critical.always([1, 0, 1]) and not critical.always([-1, 3])
    # the zero v of x - v is a zero of x^2 - 1/4 times 4 at v = +-1/2
    assert critical.primitive(critical.resultant([[0, -1], [1]], [[-1], [], [4]])) in (
        [-1, 0, 4],
        [1, 0, -4],
    )
