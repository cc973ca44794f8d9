"""Frequencies and rotation numbers of nutations: within their bars of multiprecision, and their
branches as stated.
"""

import numpy as np
import pytest
from mpmath import mp

import survey
from survey.truth.brun_digits import NAMES, draw, truth

DERIVED = {
    "nutation_frequency": lambda T, psi, phi: 2 * mp.pi / T,
    "precession_rate": lambda T, psi, phi: psi / T,
    "spin_rate": lambda T, psi, phi: phi / T,
    "precession_number": lambda T, psi, phi: psi / (2 * mp.pi),
    "spin_number": lambda T, psi, phi: phi / (2 * mp.pi),
}


def test_they_are_right_within_their_bars():
    random, checked = np.random.default_rng(8), 0
    with mp.workdps(60):
        for _ in range(25):
            _kind, point = draw(random)
            ds = survey.evaluate("brun", **dict(zip(NAMES, point, strict=True)))
            if int(ds.status) or not np.isfinite(float(ds.period)):
                continue
            exact, _floor = truth(point)
            for name, of in DERIVED.items():
                off = abs(of(*exact[2:5]) - float(ds[name]))
                assert off <= float(ds[f"{name}_error"]), (name, point)
                checked += 1
    assert checked > 80


@pytest.mark.parametrize(
    ("sign", "names"), [(1, ("precession", "spin")), (-1, ("precession", "spin"))]
)
def test_the_branch_is_the_one_that_is_stated(sign, names):
    """Rotation numbers jump by 1 at a passage of the pole u = 1, up and down, and are the mean of
    both limits there.
    """
    ds = survey.evaluate(
        "brun", l=1.7, alpha=0.5, beta=0.5 + np.array([-1e-12, 0.0, 1e-12]), sign=sign, ratio=1.0
    )
    for name, jump in zip(names, (1.0, -1.0), strict=True):
        low, middle, high = ds[f"{name}_number"].isel(well=0).values
        assert abs(high - low - jump) < 1e-10 and abs(middle - (low + high) / 2) < 1e-10
        assert (
            "jumps by 1 where" in ds[f"{name}_number"].comment
            and "jumps by 2 pi where" in ds[name].comment
        )
