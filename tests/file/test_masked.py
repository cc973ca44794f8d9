"""Integers that do not apply: `_FillValue` in the file, NaN once it is open, with survey or
without; words for -1.
"""

import netCDF4
import numpy as np
import pytest
import xarray as xr

import survey
from survey.analysis import join
from survey.file import labels

WORKFLOW = {
    "scene": "gyrostat",
    "options": {"question": "fate"},
    "axes": {
        "b12": 0.7, "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": 0.5, "s3": -0.2,
        "phi0": {"start": -3.0, "stop": 3.0, "num": 9}, "w0": {"start": -4.0, "stop": 4.0, "num": 9},
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("masked") / "fates.nc"
    survey.run(WORKFLOW, output=path)
    return path


def evaluated(ds, **starts):
    fixed = {name: float(ds[name]) for name in ("b12", "b31", "d", "c23", "s2", "s3")}
    return survey.evaluate(
        "gyrostat", question="fate", **{"phi0": ds.phi0, "w0": ds.w0} | starts, **fixed
    )


def test_the_file_holds_integers_with_a_fill_value(path):
    with netCDF4.Dataset(path) as file:
        turns = file["net_turns"]
        assert turns.dtype == np.int32 and turns._FillValue == labels.fill_of(
            xr.open_dataset(path).net_turns
        )
        # spun up: no number of turns
        assert np.ma.count_masked(turns[:]) == (file["verdict"][:] > 4).sum() > 0
        assert "_FillValue" not in file["verdict"].ncattrs()  # -1 is undecided there


def test_opened_without_survey_they_are_no_numbers(path):
    bare, ours = xr.open_dataset(path), survey.open(path)
    assert bare.net_turns.dtype == ours.net_turns.dtype == np.float64
    np.testing.assert_array_equal(np.isnan(bare.net_turns), bare.verdict > 4)
    assert abs(bare.net_turns).max() < 1000 and bare.identical(ours.assign_attrs(bare.attrs))


def test_what_is_evaluated_is_what_is_read_and_can_be_written_again(path, tmp_path):
    ours = survey.open(path)
    made = evaluated(ours)
    for name in ours.data_vars:
        assert made[name].dtype == ours[name].dtype and made[name].equals(ours[name]), name
    made.to_netcdf(tmp_path / "again.nc")
    again = xr.open_dataset(tmp_path / "again.nc", mask_and_scale=False)
    np.testing.assert_array_equal(
        again.net_turns, xr.open_dataset(path, mask_and_scale=False).net_turns
    )
    assert again.net_turns.dtype == np.int32


def test_a_lazy_answer_is_masked_too(path):
    ours = survey.open(path)
    lazy = evaluated(ours, w0=xr.DataArray(ours.w0.values, dims="w0").chunk(5))
    assert lazy.net_turns.chunks and lazy.net_turns.dtype == np.float64
    np.testing.assert_array_equal(lazy.net_turns, ours.net_turns)


def test_what_was_joined_and_what_was_reused_is_stored_as_integers(path, tmp_path):
    ours = survey.open(path)
    halves = [tmp_path / "low.nc", tmp_path / "high.nc"]
    for half, part in zip(halves, (slice(0, 5), slice(5, 9)), strict=True):
        table = WORKFLOW | {
            "axes": WORKFLOW["axes"] | {"w0": {"values": ours.w0.values[part].tolist()}}
        }
        survey.run(table, output=half, reuse=path)
    join.merge(halves, tmp_path / "whole.nc")
    for name in ("net_turns", "turnings"):
        raw = [
            xr.open_dataset(p, mask_and_scale=False)[name] for p in (path, tmp_path / "whole.nc")
        ]
        assert raw[1].dtype == np.int32 and raw[1].attrs["_FillValue"] == raw[0].attrs["_FillValue"]
        np.testing.assert_array_equal(*raw)


def test_infinitely_many_is_said_in_words(path):
    ours = survey.open(path)
    rests = np.argwhere((ours.turnings == -1).values)[0]
    at = {name: float(ours[name][i]) for name, i in zip(("phi0", "w0"), rests, strict=True)}
    assert "turnings = infinitely many" in str(ours.survey.point(**at))
    axes = ours.survey.map("turnings")
    legend = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert f"infinitely many ({int((ours.turnings == -1).sum())})" in legend
    assert "does not apply" not in legend and axes.collections[0].get_array().min() >= 0


def test_a_file_written_before_integers_were_masked_is_read_as_it_was(path, tmp_path):
    """Its numbers stay integers, and pictures, points and verification know which of them do not apply."""
    old = xr.open_dataset(path, mask_and_scale=False)
    old["net_turns"].attrs.pop("_FillValue")
    masked = labels.masked(old.net_turns)
    np.testing.assert_array_equal(masked, survey.open(path).net_turns)
    np.testing.assert_array_equal(labels.as_stored(old.net_turns), labels.as_stored(masked))
