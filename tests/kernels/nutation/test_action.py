"""The action as a positive sum (S22): against multiprecision, and what errors of its ingredients change."""

import json
from importlib.resources import files

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf

import survey
from survey.kernels.nutation import action
from survey.truth.brun_digits import NAMES, truth

ROWS = json.loads((files("survey.reference") / "brun_distances.json").read_text())
ROWS = [row for family in ("separatrix", "pole", "precession") for row in ROWS[family][1::3]]
STATES = np.array([[float.fromhex(x) for x in row["state_hex"]] for row in ROWS])
# width; roots of Q at ul, uh; (s + g)/2; 1 - u and 1 + u of ul, uh
WELLS = (
    (0.8, (1.1, 0.4), 0.3, (1.3, 0.5), (0.7, 1.5)),
    (1.2, (1e-7, 0.9), 0.5, (1.9, 0.7), (0.1, 1.3)),  # beside a separatrix, within
    (1.9, (0.8, 1.1), 1e-25, (1.95, 0.05), (0.05, 1.95)),  # outside
    (1.5, (2.0, 1e-6), 3.0, (1.5, 1e-20), (0.5, 2.0)),  # passing a pole closely, too
    (1.0, (1.0, 3.0), 2.0, (1.0, 0.0), (1.0, 2.0)),  # through it
)


def exactly(width, roots, square, at_plus, at_minus):
    """1/pi times the integral of sqrt P/(1 - u^2), u = ul + D r, by tanh-sinh quadrature; Q as
    under (S22).
    """
    low, high = mpf(roots[0]), mpf(roots[1])

    def integrand(r, rest):
        q = (low * rest - high * r) ** 2 + 4 * mpf(square) * r * rest
        away = (at_plus[0] * rest + at_plus[1] * r) * (at_minus[0] * rest + at_minus[1] * r)
        return mp.sqrt(r * rest * q) / away

    nearest = low / (low + high)
    scale = mpf(width) ** 2 / mp.pi
    places = [mpf(10) ** -n for n in range(30, 0, -2)]
    first = sum(mp.quad(lambda r: integrand(r, 1 - r), ends) for ends in _between(places, nearest))
    return scale * (
        first
        + sum(
            mp.quad(lambda r: integrand(1 - r, r), ends) for ends in _between(places, 1 - nearest)
        )
    )


def _between(places, end):
    """Pieces of [0, end] that grow from both of its ends."""
    half = end / 2
    inside = [half * x for x in places]
    marks = [mpf(0), *inside, half, *(end - x for x in reversed(inside)), end]
    return [marks[i : i + 2] for i in range(len(marks) - 1)]


@pytest.mark.parametrize("well", WELLS)
def test_sum(well):
    value, moved = action.positive(*well, (0.0, 0.0, 0.0))
    with mp.workdps(34):
        assert moved == 0.0 and abs(mpf(value) / exactly(*well) - 1) < 20 * 2.0**-53


@pytest.mark.parametrize("well", WELLS)
@pytest.mark.parametrize("place", range(3))
def test_what_errors_change(well, place):
    """By no more than the bound, and near separatrices by next to nothing."""
    noise, factor = np.zeros(3), 1.0 + 1e-4
    noise[place] = 1e-4
    width, (low, high), square, *ends = well
    if place < 2:
        roots = (low * factor**0.5, high) if place == 0 else (low, high * factor**0.5)
        other = (width, roots, square, *ends)
    else:
        other = (width, (low, high), square * factor, *ends)
    value, moved = action.positive(*well, tuple(noise))
    change = abs(action.positive(*other, (0.0, 0.0, 0.0))[0] - value)
    assert change <= 1.01 * moved + 1e-15 * value and moved <= 1e-4 * value
    if (
        (place == 0 and low < 1e-5)
        or (place == 1 and high < 1e-5)
        or (place == 2 and square < 1e-5)
    ):
        assert moved < 1e-8 * value


@pytest.fixture(scope="module")
def exact():
    """(action, what half an ulp of the state changes) of STATES."""
    with mp.workdps(60):
        found = [truth(state) for state in STATES]
        return [
            (values[-1], max(floors[-1], abs(values[-1]) * mpf(2) ** -53))
            for values, floors in found
        ]


@pytest.mark.parametrize("method", ["auto", "agm", "carlson"])
def test_near_separatrices_poles_and_double_roots(method, exact):
    """Every method shares the sum where the terms of (S14) cancel: within the bar, and both near
    the floor.
    """
    arrays = {
        name: xr.DataArray(column, dims="point")
        for name, column in zip(NAMES, STATES.T, strict=True)
    }
    ds = survey.evaluate("brun", method=method, variables=["action"], **arrays)
    with mp.workdps(60):
        for (value, floor), found, bar in zip(
            exact, ds.action.values, ds.action_error.values, strict=True
        ):
            assert abs(mpf(float(found)) - value) <= min(bar, 100 * floor) and bar <= 500 * floor
