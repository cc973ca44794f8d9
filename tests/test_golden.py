"""Small files of every scene, kept: an accidental change of the layout, of a code, or of a value
beyond its bar shows.

After an intended change, regenerate them (`survey run NAME.toml --fresh` in `tests/golden`) and
document the change. Every scene with its own page of mathematics has one
(`tests/workflows/test_docs.py`).
"""

import subprocess
import sys
from pathlib import Path

import netCDF4
import numpy as np
import pytest

from survey.file import reading

FOLDER = Path(__file__).parent / "golden"
CHANGING = {
    "date_created",
    "history",
    "wall_time_s",
    "compile_time_s",
    "commit",
    "dirty",
    "kernel_hash",
    "cpu",
}
CHANGING |= {"fingerprint"}  # of the sources
# words, and what other processors round otherwise
CHANGING |= {"summary", "references", "areas", "refine_points"}
WORDS = {"_FillValue", "comment", "long_name"}  # a fill value may be NaN, and words may be bettered
COMPILERS = ("version_numba", "version_llvmlite", "version_numpy", "cpu")


KEPT = "mathieu", "satellite", "brun", "gyrostat", "libration_elliptic"  # by default


@pytest.fixture(
    scope="module",
    params=[
        pytest.param(path.stem, marks=[pytest.mark.slow] * (path.stem not in KEPT))
        for path in sorted(FOLDER.glob("*.toml"))
    ],
)
def both(request, tmp_path_factory):
    """The kept file and one of today, open."""
    folder = tmp_path_factory.mktemp(request.param)
    command = [
        sys.executable,
        "-m",
        "survey",
        "run",
        str(FOLDER / f"{request.param}.toml"),
        "-o",
        "now.nc",
    ]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    kept = FOLDER / f"{request.param}.nc"
    assert reading.check(kept) == [] and reading.check(folder / "now.nc") == []
    with netCDF4.Dataset(kept) as old, netCDF4.Dataset(folder / "now.nc") as new:
        for file in (old, new):
            file.set_auto_maskandscale(False)
        yield old, new


def test_the_layout_is_the_same(both):
    """What was there is there as it was; there may be more."""
    old, new = both
    assert set(old.variables) <= set(new.variables) and set(old.ncattrs()) <= set(new.ncattrs())
    for key in old.ncattrs():
        if key not in CHANGING and not key.startswith("version_"):
            assert np.array_equal(old.getncattr(key), new.getncattr(key)), key
    for name, one in old.variables.items():
        other = new[name]
        for read in (lambda v: v.dimensions, lambda v: v.dtype, lambda v: v.filters()):
            assert read(one) == read(other), name
        for key in set(one.ncattrs()) - WORDS:
            assert np.array_equal(one.getncattr(key), other.getncattr(key)), (name, key)
        assert one.shape != other.shape or one.chunking() == other.chunking(), name


def test_codes_are_the_same_and_values_within_the_bars(both):
    old, new = (_arrays(file) for file in both)
    for name, one in old.items():
        other = new[name]
        if one.dtype.kind != "f" or (f"{name}_error" not in old and not name.endswith("_error")):
            np.testing.assert_array_equal(one, other, err_msg=name)
            continue
        np.testing.assert_array_equal(np.isnan(one), np.isnan(other), err_msg=name)
        if f"{name}_error" in old:
            bar = old[f"{name}_error"].astype(float) + new[f"{name}_error"]
            assert not (abs(one - other) > bar).any(), name


@pytest.mark.slow
def test_the_bits_are_the_same_on_the_same_machine(both):
    if any(both[0].getncattr(key) != both[1].getncattr(key) for key in COMPILERS):
        pytest.skip("another processor or compiler")
    old, new = (_arrays(file) for file in both)
    assert [name for name in old if old[name].tobytes() != new[name].tobytes()] == []


def _arrays(file):
    """The variables, but those of curves and cells, whose places are steps and halvings and have no bars."""
    beside = ("curve_", "cell_", "fold_")
    return {
        name: np.asarray(v[:]) for name, v in file.variables.items() if not name.startswith(beside)
    }
