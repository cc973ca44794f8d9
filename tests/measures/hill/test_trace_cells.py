"""Cells of Hill's equations that are not even: against those of Mathieu's equation, which is the
same, and points.
"""

import math

import numpy as np
import pytest
import xarray as xr

import survey
from survey.errors import BadInput
from survey.request.workflow import check
from survey.sweep import refine

AXES = {"q": {"start": 0.0, "stop": 3.0, "num": 3}, "a": {"start": -2.0, "stop": 6.0, "num": 3}}
# Mathieu's equation, begun an eighth of its period later
SHIFTED = survey.hill(
    lambda u, p: p[0] - 2 * p[1] * math.sin(2 * u), period=math.pi, parameters=("a", "q")
)


def cells(scene, width):
    return refine.find(check({"scene": scene, "axes": AXES, "refine": {"width": width}}))


def test_areas_are_those_of_mathieus_equation():
    own, sharp = cells(SHIFTED, 0.01), cells("mathieu", 0.001)
    off = abs(own.area - sharp.area)
    assert (off <= own.area_error + sharp.area_error).all() and (own.area_error < 0.1 * 24).all()


def test_points_inside_cells_have_their_verdicts():
    ds, rng = cells(SHIFTED, 0.02), np.random.default_rng(4)
    share = rng.uniform(size=(2, ds.sizes["cell"]))
    point = {
        name: xr.DataArray(
            ds[f"cell_{name}_low"].values * (1 - part) + ds[f"cell_{name}_high"].values * part,
            dims="p",
        )
        for name, part in zip(("q", "a"), share, strict=True)
    }
    verdict, decided = survey.evaluate(SHIFTED, **point).verdict.values, ds.cell_verdict.values
    assert (verdict == decided)[decided >= 0].all() and {0, 1} <= set(decided)


def test_surfaces_need_factors():
    axes = AXES | {"r": {"start": 0.0, "stop": 1.0, "num": 3}}
    scene = survey.hill(
        lambda u, p: p[0] + p[1] * math.sin(u) + p[2], period=6.0, parameters=("a", "q", "r")
    )
    with pytest.raises(BadInput, match="is not even"):
        check({"scene": scene, "axes": axes, "boundaries": {"surfaces": True}})
