"""Danby's map in cells: every point of a decided cell has its verdict; areas lie within their
bounds, ever narrower.
"""

import numpy as np
import pytest
import xarray as xr

import survey
from survey.measures import sign_cells
from survey.measures.libration import cells
from survey.truth import danby

WORKFLOW = {
    "scene": "libration_elliptic",
    "axes": {
        "mu": {"start": 0.0, "stop": 0.055, "num": 3},
        "e": {"start": 0.0, "stop": 0.6, "num": 3},
    },
}


def ran(tmp_path, width):
    path = tmp_path / f"{width}.nc"
    return survey.run(
        WORKFLOW | {"refine": {"width": width}, "output": {"figures": []}}, output=path
    ).load()


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    return ran(tmp_path_factory.mktemp("cells"), 0.03)


def test_points_of_decided_cells_have_their_verdict(coarse):
    """By the truth in double-double, at three random points of every cell."""
    random = np.random.default_rng(2)
    decided = coarse.cell_verdict.values >= 0
    assert {0, 1} <= set(coarse.cell_verdict.values[decided]) and decided.mean() > 0.2
    for _ in range(3):
        part = random.uniform(0.0, 1.0, (2, decided.sum()))
        mu, e = (
            coarse[f"cell_{name}_low"].values[decided] * (1 - p)
            + coarse[f"cell_{name}_high"].values[decided] * p
            for name, p in zip(("mu", "e"), part, strict=True)
        )
        out = danby.solved(mu, e, 1e-28)
        (ab, _), (cd, _), (k, _), (t, _) = danby.margins(out)
        stable = (ab > 0) & (cd > 0) & (k > 0) & (t > 0) & (t < 2)
        np.testing.assert_array_equal(stable, coarse.cell_verdict.values[decided] == 1)


def test_the_area_has_a_bound_that_narrows(coarse, tmp_path):
    fine = ran(tmp_path, 0.004)
    for ds in (coarse, fine):
        total = float(ds.area.sum())
        assert total == pytest.approx(0.055 * 0.6, abs=2 * float(ds.area_error.max()))
    assert (abs(fine.area - coarse.area) <= fine.area_error + coarse.area_error).all()
    assert (fine.area_error < 0.4 * coarse.area_error).all()
    grid = survey.evaluate(
        "libration_elliptic", mu=np.linspace(0, 0.055, 402)[1::2], e=np.linspace(0, 0.6, 402)[1::2]
    )
    share = float((grid.verdict == 1).mean())
    assert share == pytest.approx(
        float(fine.area_fraction[1]), abs=float(fine.area_fraction_error.max()) + 0.005
    )


def test_where_the_functions_are_not_sure_nothing_is_decided():
    """A series whose slack reaches across 0 decides nothing; where one function is negative, the
    cell is unstable.
    """
    series = np.zeros((2, 5, 4, 4))
    series[:, :, 0, 0], series[1, 2, 0, 0] = 1.0, -1.0
    assert sign_cells.decided(series, np.full((2, 5), 0.5)).tolist() == [
        sign_cells.STABLE,
        sign_cells.UNSTABLE,
    ]
    assert sign_cells.decided(series, np.full((2, 5), 1.5)).tolist() == [cells.UNDECIDED] * 2


def test_the_functions_are_those_of_the_digest():
    a, b = xr.DataArray([-4.0, 0.5]), xr.DataArray([6.0, 0.3])
    bars = {"a_error": np.zeros(2), "b_error": np.zeros(2)}
    values, _ = cells._values({"a": a.values, "b": b.values, **bars})
    assert values[0].tolist() == [0.0, 16.0, 0.0, 8.0, 0.0]  # the tip: a = -4, b = 6
    assert (values[1] > 0).all()
