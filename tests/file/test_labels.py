"""The file's contract: CF and ACDD attributes, flags, error variables, provenance, checksummed
compression.
"""

import subprocess
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from survey import status
from survey.file import labels, reading


@pytest.fixture
def ds(surveyed):
    return xr.open_dataset(surveyed)


def test_it_passes_the_cf_checker(surveyed):
    checker = [Path(sys.executable).with_name("compliance-checker")]
    checked = subprocess.run(
        [*checker, "--test=cf:1.11", "--criteria=strict", surveyed], capture_output=True, text=True
    )
    assert checked.returncode == 0, checked.stdout
    assert "All tests passed" in checked.stdout


def test_every_variable_says_what_it_is(ds):
    for name, variable in ds.variables.items():
        assert variable.attrs["long_name"], name
        assert variable.attrs["units"] and variable.attrs["symbol"], name
        assert not np.iscomplexobj(variable), name
    assert set(labels.error_bars(ds)) == {
        name
        for name in ds.data_vars
        if ds[name].dtype == np.float64 and labels.fill_of(ds[name]) is None
    }


def test_every_float_has_its_error_bar_in_float32(ds):
    for name in labels.error_bars(ds):
        assert ds[name].attrs["ancillary_variables"] == f"{name}_error"
        assert ds[f"{name}_error"].dtype == np.float32


def test_status_carries_its_sentences(ds):
    meanings = ds.status.attrs["flag_meanings"].split()
    assert ds.status.dtype == np.int8 and len(meanings) == len(ds.status.attrs["flag_values"])
    assert all(f"{name}: " in ds.status.attrs["comment"] for name in meanings)
    assert meanings[: len(status.CODES)] == list(status.CODES)


def test_the_globals_tell_where_it_comes_from(ds):
    attributes = ds.attrs
    for key in ("title", "summary", "source", "history", "references", "workflow", "options", "method", "rtol",
                "version_survey", "version_numba", "version_llvmlite", "version_numpy", "version_python", "commit",
                "dirty", "kernel_hash", "cpu", "wall_time_s", "status_counts"):  # fmt: skip
        assert key in attributes, key
    assert attributes["Conventions"] == "CF-1.11, ACDD-1.3"
    assert attributes["complete"] == 1 and list(attributes)[-1] == "complete"
    assert attributes["status_counts"] == f"ok: {ds.status.size}"
    assert 'title  = "A small survey"' in attributes["workflow"]


def test_defaults_are_written_as_scalar_coordinates(ds):
    assert float(ds.c23) == 0 and float(ds.phi0) == 1.5 and ds.b12.ndim == 0


def test_data_are_compressed_with_checksums_and_integers_are_exact(surveyed):
    with netCDF4.Dataset(surveyed) as file:
        for name in ("w", "w_error", "status", "turnings"):
            filters = file[name].filters()
            assert filters["zlib"] and filters["shuffle"] and filters["fletcher32"]
        assert file["turnings"].dtype == np.int32 and file["status"].dtype == np.int8


def test_it_opens_lazily(surveyed):
    with xr.open_dataset(surveyed, chunks={}) as lazy:
        assert lazy.w.chunks and lazy.status.dtype == np.int8
        assert int(lazy.status.sum()) == 0


@given(arrays(np.float64, 5, elements=st.floats(0, 1e30)))
def test_error_bars_are_rounded_up(errors):
    stored = labels.round_up(errors)
    assert stored.dtype == np.float32
    assert (stored.astype(float) >= errors).all()
    assert (stored.astype(float) <= errors * (1 + 2e-7) + 1.5e-45).all()


def test_counts_and_missed_accuracy_come_from_the_data(ds):
    again = labels.count(ds.copy())
    assert again.attrs["accuracy_missed"] == ds.attrs["accuracy_missed"] == 0
    wide = ds.load().copy(deep=True)
    wide["w_error"][2, 1] = 1.0
    assert labels.count(wide).attrs["accuracy_missed"] == 1


def test_status_ok_means_finite(surveyed):
    assert reading.check(surveyed) == []
