"""Physical input against the scenes' own parameters."""

import numpy as np
import pytest

import survey
from survey.errors import BadInput
from survey.request import physical


def test_degrees():
    ds = survey.evaluate("satellite", amplitude_deg=[10.0, 30.0], rho=1.2)
    own = survey.evaluate("satellite", amplitude=np.radians([10.0, 30.0]), rho=1.2)
    np.testing.assert_array_equal(ds.discriminant, own.discriminant)
    np.testing.assert_array_equal(ds.amplitude, np.radians([10.0, 30.0]))
    with pytest.raises(
        BadInput, match=r"amplitude = 30 is outside .* if it is in degrees, give amplitude_deg = 30"
    ):
        survey.evaluate("satellite", amplitude=30.0, rho=1.2)
    assert ds.amplitude_deg.attrs["units"] == "degree"
    with pytest.raises(BadInput, match=r"amplitude = 2.0944 is outside .*; amplitude_deg is 120$"):
        survey.evaluate("satellite", amplitude_deg=120.0, rho=1.2)
    with pytest.warns(
        UserWarning,
        match="amplitude has 2 values outside the domain, such as 30 .*amplitude_deg = 30",
    ):
        survey.evaluate("satellite", amplitude=[1.0, 30.0, 60.0], rho=1.2)
    with pytest.raises(BadInput, match="amplitude is given twice"):
        survey.evaluate("satellite", amplitude=0.3, amplitude_deg=30.0, rho=1.2)


def test_moments_of_inertia():
    ds = survey.evaluate("satellite", k=0.5, A=1520.0, B=1520.0, C=288.8)
    assert float(ds.inertia_ratio) == pytest.approx(0.19, abs=1e-15)
    assert float(
        survey.evaluate("satellite", k=0.5, A=288.8, B=1520.0, C=1520.0).inertia_ratio
    ) == float(ds.inertia_ratio)
    with pytest.raises(BadInput, match="two moments of inertia must be equal"):
        survey.evaluate("satellite", k=0.5, A=1.0, B=2.0, C=2.5)
    with pytest.raises(BadInput, match="C is missing: give all of A, B, C"):
        survey.evaluate("satellite", k=0.5, A=1.0, B=2.0)


def test_masses_and_bodies():
    """1 / mu of the Earth and the Moon is 82.30057 (DE440: Earth / Moon = 81.30057)."""
    ds = survey.evaluate("libration", body="Earth-Moon")
    assert (
        1.0 / float(ds.mu) == pytest.approx(82.300568, abs=1e-6) and ds.body.item() == "Earth-Moon"
    )
    by_mass = survey.evaluate("libration", m1=81.300568, m2=1.0)
    assert float(by_mass.mu) == pytest.approx(float(ds.mu), rel=1e-8)
    several = survey.evaluate("libration_elliptic", body=["Sun-Jupiter", "Earth-Moon"])
    assert several.verdict.dims == ("body",) and several.body.values.tolist() == [
        "Sun-Jupiter",
        "Earth-Moon",
    ]
    assert several.e.values.tolist() == [0.04838624, 0.0549] and (several.verdict == 1).all()
    assert 1.0 / float(several.mu[0]) == pytest.approx(1048.35, abs=0.01)
    for refused in (
        several.survey.areas,
        several.survey.boundary,
        several.survey.zoom,
        lambda: several.survey.zoom(body=(0.0, 1.0)),
    ):
        with pytest.raises(BadInput, match=r"body.* an axis of names, and nothing lies between"):
            refused()
    assert float(survey.evaluate("libration_elliptic", body="Earth-Moon", e=0.1).e) == 0.1
    with pytest.raises(BadInput, match="unknown pair 'Earth-Mon'; did you mean 'Earth-Moon'"):
        survey.evaluate("libration", body="Earth-Mon")


def test_a_workflow_takes_it_too(tmp_path):
    axes = {"amplitude_deg": {"start": 10.0, "stop": 60.0, "num": 6}, "rho": 1.2}
    ds = survey.run({"scene": "satellite", "axes": axes}, output=tmp_path / "s.nc")
    np.testing.assert_array_equal(ds.amplitude, np.radians(np.linspace(10.0, 60.0, 6)))
    with pytest.raises(
        BadInput, match=r"axes.amplitude is 2.0944, outside .*; amplitude_deg is 120"
    ):
        survey.run(
            {"scene": "satellite", "axes": {"amplitude_deg": 120.0, "rho": 1.2}},
            output=tmp_path / "x.nc",
        )
    asked = {
        "scene": "libration_elliptic",
        "options": {"body": "Earth-Moon"},
        "axes": {"e": {"start": 0.0, "stop": 0.1, "num": 3}},
    }
    several = asked | {"options": {"body": ["Earth-Moon", "Sun-Jupiter"]}}
    with pytest.raises(BadInput, match=r"options\.body: a workflow takes one pair"):
        survey.run(several, output=tmp_path / "x.nc")
    ds = survey.run(asked, output=tmp_path / "l.nc")
    assert 1.0 / float(ds.mu) == pytest.approx(82.300568, abs=1e-6) and ds.sizes["e"] == 3


def test_a_scene_says_what_it_takes():
    told = survey.describe("satellite")["parameters"]
    assert "in degrees" in told["amplitude_deg"] and "any unit" in told["A, B, C"]
    assert "Sun-Jupiter" in survey.describe("libration_elliptic")["parameters"]["body"]
    brun = survey.describe("brun")
    assert (
        "any consistent units" in brun["parameters"]["A"]
        and "no unit" in brun["parameters"]["ratio"]
    )
    assert "no unit" not in brun["outputs"]["period"] and "(rad)" in brun["outputs"]["precession"]
    assert "modulus of the planar motion (no unit)" in told["k"]


def test_moments_that_no_body_has_are_refused():
    with pytest.raises(survey.BadInput, match="none may exceed the sum of the two others"):
        survey.evaluate("satellite", amplitude=0.1, A=1.0, B=1.0, C=3.0)
    # a disc: equality is allowed
    flat = survey.evaluate("satellite", amplitude=0.1, A=0.7, B=1.4, C=0.7)
    assert float(flat.inertia_ratio) == 2.0


# NAIF's kernel of constants gm_de440.tpc, in full: BODY10 the Sun, BODY1 to BODY8 the planets'
# systems, 399 and 301
KERNEL = {
    "Sun": 1.3271244004127942e11, "Mercury": 2.2031868551400003e04, "Venus": 3.2485859200000000e05,
    "Earth": 3.9860043550702266e05, "Moon": 4.9028001184575496e03, "Mars": 4.2828375815756102e04,
    "Jupiter": 1.2671276409999998e08, "Saturn": 3.7940584841799997e07, "Uranus": 5.7945563999999985e06,
    "Neptune": 6.8365271005803989e06,
}  # fmt: skip


def test_masses_are_those_of_the_ephemeris():
    """The paper's table has fewer digits than the kernel."""
    assert physical.GM.keys() == KERNEL.keys()
    for body, value in physical.GM.items():
        assert value == pytest.approx(KERNEL[body], rel=2e-9), body
    with_moon = 4.0350323562548019e05  # BODY3, the Earth and the Moon
    assert physical.GM["Earth"] + physical.GM["Moon"] == pytest.approx(with_moon, rel=1e-9)


def test_names_of_bodies_and_masses_are_those_of_this_packages_scenes():
    scene = survey.hill(lambda u, p: p[0] + 0.0 * p[1], parameters=("mu", "body"), period=1.0)
    ds = survey.evaluate(scene, mu=1.0, body=2.0)
    assert float(ds.mu) == 1.0 and float(ds.body) == 2.0
    assert list(survey.describe(scene)["parameters"]) == ["mu", "body"]
    with pytest.raises(survey.BadInput, match="m1"):
        survey.evaluate(scene, m1=1.0, m2=2.0, body=1.0)
