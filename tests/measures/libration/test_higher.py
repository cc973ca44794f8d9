"""Orders 8 and 10 as outputs of the scene: Deprit's triangle, and the radius of effective stability
by its measure.
"""

import json
from importlib.resources import files

import numpy as np
import pytest

import survey
from survey.measures.libration import effective_stability, higher
from survey.methods import lie

DATA = json.loads((files("survey.reference") / "libration_order_8.json").read_text())


def test_coefficients_of_order_8_by_name():
    for row in DATA["points"]:
        ds = survey.evaluate("libration", mu=row["mu"], order="8")
        assert set(ds.monomial8.values) == set(row["c8"])
        for name, digits in row["c8"].items():
            value, bar = (float(ds[key].sel(monomial8=name)) for key in ("c8", "c8_error"))
            assert abs(value - float(digits)) <= bar + 1e-16 * abs(value)


def test_the_radius_is_that_of_the_measure_and_falls_with_time():
    mu, periods = np.array([0.003, 0.01, 0.02]), np.array([1e3, 1e6, 1e9])
    ds = survey.evaluate("libration", mu=mu, periods=periods, order="10")
    norms = lie.remainders(mu, 10)
    for j, number in enumerate(periods):
        radius, _bar, r = effective_stability.radius(norms, 2 * np.pi * number)
        np.testing.assert_allclose(ds.effective_radius[:, j], radius, rtol=1e-12)
        np.testing.assert_array_equal(ds.effective_order[:, j], r)
    assert (ds.effective_radius.diff("periods") < 0).all()
    lower = survey.evaluate("libration", mu=mu, periods=periods, order="8")
    assert (ds.effective_radius >= 0.999 * lower.effective_radius).all() and ds.sizes[
        "monomial10"
    ] == 21


def test_order_6_is_what_it_was():
    mu = np.linspace(1e-3, 0.045, 30)
    ds, more = survey.evaluate("libration", mu=mu), survey.evaluate("libration", mu=mu, order="8")
    assert "c8" not in ds and "periods" not in ds.coords and more.attrs["options"] == "order=8"
    for name in ("c", "D6", "M_ray", "verdict", "status"):
        np.testing.assert_array_equal(ds[name], more[name])
    assert (
        np.isnan(more.effective_radius[mu > 0.0386]).all()
        and np.isnan(more.effective_order[mu > 0.0386]).all()
    )


def test_what_is_not_known_is_refused():
    with pytest.raises(survey.BadInput, match="periods"):
        survey.evaluate("libration", mu=0.01, periods=1e6)
    with pytest.raises(survey.BadInput, match="unknown value '12'"):
        survey.evaluate("libration", mu=0.01, order="12")
    assert higher.labels(8)[0] == "400" and len(higher.labels(10)) == 21
