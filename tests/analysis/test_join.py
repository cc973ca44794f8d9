"""Surveys joined along an axis: the same values as one run of all points, and what does not fit is
refused.
"""

import numpy as np
import pytest
import xarray as xr

import survey
from survey.analysis import join
from survey.errors import BadInput
from survey.file import reading
from survey.file.summary import summary


@pytest.fixture
def parts(small, tmp_path, monkeypatch):
    """(the whole file, two files of its parts): w0 in two halves with a common value."""
    monkeypatch.chdir(tmp_path)
    base = small.read_text().replace('figures = ["w"]', "")
    values = np.linspace(0.5, 2.0, 6)
    paths = []
    for name, chosen in (("whole", values), ("high", values[2:]), ("low", values[:3])):
        text = base.replace(
            "w0  = { start = 0.5, stop = 2.0, num = 6 }", f"w0 = {{ values = {chosen.tolist()} }}"
        )
        (tmp_path / f"{name}.toml").write_text(text)
        survey.run(f"{name}.toml", output=f"{name}.nc")
        paths.append(tmp_path / f"{name}.nc")
    return paths


def test_the_whole_is_what_one_run_gives(parts):
    whole, high, low = map(survey.open, parts)
    joined = survey.concat([high, low])
    xr.testing.assert_identical(joined.drop_attrs(), whole.drop_attrs())
    for key in ("points", "status_counts", "accuracy_missed", "scene", "options", "rtol"):
        assert joined.attrs[key] == whole.attrs[key]
    assert joined.attrs["wall_time_s"] == pytest.approx(
        high.attrs["wall_time_s"] + low.attrs["wall_time_s"]
    )
    again = survey.run({**_parsed(joined.attrs["workflow"]), "output": {"path": "again.nc"}})
    xr.testing.assert_equal(again.drop_attrs(), whole.drop_attrs())


def _parsed(text):
    import tomllib

    return tomllib.loads(text)


@pytest.mark.slow
def test_the_command_writes_a_sound_file_and_replaces_none(parts, program):
    whole, high, low = parts
    done = program("merge", low, high, "-o", "joined.nc")
    assert (
        done.returncode == 0
        and done.stdout == "joined.nc\n"
        and "24 points of 2 files" in done.stderr
    )
    assert reading.check("joined.nc") == []
    xr.testing.assert_equal(survey.open("joined.nc").drop_attrs(), survey.open(whole).drop_attrs())
    assert survey.open("joined.nc").w.attrs == survey.open(whole).w.attrs
    assert program("verify", "joined.nc", "--points", "3").returncode == 0
    again = program("merge", low, high, "-o", "joined.nc")
    assert again.returncode == 2 and "joined.nc exists" in again.stderr
    assert {file.name for file in program.folder.glob("*joined*")} == {
        "joined.nc",
        "joined.nc.sha256",
    }


def test_what_belongs_to_the_parts_is_left_out_with_a_word(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, start in (("low", 0.0), ("high", 2.0)):
        axes = {"q": {"values": [0.3, 0.5]}, "a": {"start": start, "stop": start + 1.5, "num": 4}}
        survey.run({"scene": "mathieu", "axes": axes, "boundaries": {}}, output=f"{name}.nc")
    with pytest.warns(
        UserWarning,
        match=r"concat: the results of \[boundaries\] belong to the parts, and are left out",
    ):
        joined = survey.concat(["low.nc", "high.nc"])
    assert "curve_count" not in joined and joined.sizes["a"] == 8
    counts = {"boundaries", "edge_incomplete_rows", "curves_lost"}
    assert counts <= survey.open("low.nc").attrs.keys()
    assert not (counts | {"fingerprint"}) & joined.attrs.keys()
    assert join.merge(["low.nc", "high.nc"], "both.nc")[1].startswith("the results of [boundaries]")
    with pytest.raises(BadInput, match="merge: surveys are joined along one axis"):
        join.merge(["low.nc", "low.nc"], "x.nc")


def test_a_fixed_number_becomes_an_axis():
    rows = [survey.evaluate("mathieu", a=[0.2, 1.5, 2.0], q=q) for q in (0.4, 0.1, 0.2)]
    joined = survey.concat(rows)
    assert joined.verdict.dims == ("q", "a") and joined.q.values.tolist() == [0.1, 0.2, 0.4]
    assert joined.q.attrs == rows[0].q.attrs
    for row in rows:
        np.testing.assert_array_equal(joined.discriminant.sel(q=float(row.q)), row.discriminant)
    assert joined.attrs["points"] == 9 and joined.survey.map() is not None


def test_what_does_not_fit_is_refused():
    one = survey.evaluate("mathieu", a=[0.2, 1.5], q=0.4)

    def refused(match, *others):
        with pytest.raises(BadInput, match=match):
            survey.concat([one, *others])

    refused("two or more")
    refused("of different scenes: mathieu and libration$", survey.evaluate("libration", mu=0.01))
    refused("differ in rtol", survey.evaluate("mathieu", a=[0.2, 1.5], q=0.5, rtol=1e-6))
    refused(
        "only one of the surveys has",
        survey.evaluate("mathieu", a=[0.2, 1.5], q=0.5, variables=["verdict"]),
    )
    refused("these differ in a, q", survey.evaluate("mathieu", a=[0.3, 1.5], q=0.5))
    refused("in none: they have the same points", one)
    other = survey.evaluate("mathieu", a=[1.5, 1.6], q=0.4)
    refused(
        "different values at common points, such as a = 1.5",
        other.assign(discriminant=other.discriminant + 1),
    )
    unstable = other.assign(verdict=other.verdict.where(other.a > 1.5, 1 - other.verdict))
    refused("verdict is (un)?stable and (un)?stable; leave", unstable)
    refused("was not written by survey", xr.Dataset())
    other = survey.evaluate("mathieu", a=[0.2, 1.5], q=[0.5, 0.6])
    refused(r"stacked along p: restore its axes with \.unstack", other.stack(p=("a", "q")))
    with pytest.raises(BadInput, match="give a list of surveys"):
        survey.concat(one)


def test_what_was_joined_can_be_saved_and_opened(tmp_path):
    joined = survey.concat([survey.evaluate("mathieu", a=[0.2, 1.5], q=q) for q in (0.4, 0.5)])
    joined.to_netcdf(tmp_path / "joined.nc")
    xr.testing.assert_equal(survey.open(tmp_path / "joined.nc"), joined)


def test_bodies_are_joined_with_their_parameters():
    bodies = ["Sun-Jupiter", "Earth-Moon", "Sun-Earth"]
    whole = survey.evaluate("libration_elliptic", body=bodies, variables=["verdict", "a"])
    for parts in (
        [whole.isel(body=[k]) for k in (2, 0, 1)],
        [whole.isel(body=[2, 0]), whole.isel(body=1)],
    ):
        joined = survey.concat(parts)
        assert (
            joined.body.values.tolist() == [bodies[k] for k in (2, 0, 1)]
            and joined.attrs["points"] == 3
        )
        xr.testing.assert_equal(joined.isel(body=[1, 2, 0]), whole)


def test_dense_maps_join_within_their_error_bars(tmp_path):
    """Each is solved as a whole, by series on its own box: shared points differ in their last digits."""
    k = np.linspace(0.0, 0.9, 100)
    low, high = (
        survey.evaluate("satellite", k=k, rho=np.round(np.linspace(a, a + 0.9, 91), 6), body="oblate")
        for a in (0.6, 1.4)
    )  # fmt: skip
    with pytest.warns(
        UserWarning, match="11 common values of rho, 1.4 to 1.5, the values of survey 1"
    ):
        joined = survey.concat([low, high])
    assert joined.sizes["rho"] == 171 and "survey 2 of the list differ" in joined.attrs["history"]
    one, other = (ds.sel(rho=joined.rho[80:91]) for ds in (low, high))
    assert (one.discriminant != other.discriminant).any()  # or nothing is tested
    xr.testing.assert_equal(joined.sel(rho=one.rho), one)
    xr.testing.assert_equal(joined.sel(rho=high.rho[11:]), high.isel(rho=slice(11, None)))
    low.to_netcdf(tmp_path / "low.nc")
    high.to_netcdf(tmp_path / "high.nc")
    _, said = join.merge([tmp_path / "high.nc", tmp_path / "low.nc"], tmp_path / "both.nc")
    assert said.count("high.nc are kept") == 1
    xr.testing.assert_equal(survey.open(tmp_path / "both.nc").sel(rho=other.rho), other)
    beyond = high.assign(discriminant=high.discriminant + 3 * high.discriminant_error + 1e-13)
    with pytest.raises(
        BadInput, match=r"such as rho = 1.4, where discriminant is .* beyond the error bars"
    ):
        survey.concat([low, beyond])
    flipped = high.assign(verdict=high.verdict.copy(data=1 - high.verdict.values))
    with pytest.raises(BadInput, match="where verdict is"):
        survey.concat([low, flipped])


def test_points_that_xarray_has_joined_twice_are_counted_with_a_word(recwarn):
    parts = (np.linspace(start, start + 1.25, 11) for start in (0.0, 0.5))
    one, other = (survey.evaluate("mathieu", a=a, q=[0.1, 0.2]) for a in parts)
    assert sum(one.survey.counts()["status"].values()) == 22 and not recwarn.list
    both = xr.concat([one, other], dim="a")
    with pytest.warns(
        UserWarning, match=r"counts: 7 of the 22 values of a repeat others.*survey.concat"
    ):
        both.survey.counts()
    assert "7 of the 22" in summary(both)["counts"]["note"]
    with pytest.warns(UserWarning, match=r"the axis run has no values.* may count 2 times"):
        xr.concat([one, one], dim="run").survey.counts()
    samples = survey.evaluate(
        "mathieu", a=xr.DataArray([0.1, 0.1, 0.3], dims="p"), q=xr.DataArray([0.1] * 3, dims="p")
    )
    recwarn.clear()
    samples.survey.counts()
    assert not recwarn.list and "note" not in summary(samples)["counts"]
