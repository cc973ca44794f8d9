"""A run's file grows region by region: the same bits, labels and counts for any cut, and no tile
packed twice.
"""

import netCDF4
import numpy as np
import pytest
import xarray as xr

import survey
from survey.file import labels, reading
from survey.file.map_file import MapFile
from survey.request import workflow
from survey.sweep import cost, engine, solve, time_left

CUTS = [(1, 2**20, 2**16), (5, 2**20, 2**16), (4, 8, 4), (3, 6, 2), (24, 1, 1)]


@pytest.mark.parametrize(
    ("block", "region", "tile"),
    [pytest.param(*cut, marks=[pytest.mark.slow] * (cut not in CUTS[-2:])) for cut in CUTS],
)
def test_any_cut_gives_the_same_file(small, surveyed, tmp_path, monkeypatch, block, region, tile):
    monkeypatch.setattr(cost, "BLOCK_POINTS", block)
    monkeypatch.setattr(cost, "REGION_POINTS", region)
    monkeypatch.setattr(cost, "TILE_POINTS", tile)
    survey.run(small, output=tmp_path / "cut.nc")
    whole, cut = (xr.load_dataset(path) for path in (surveyed, tmp_path / "cut.nc"))
    for ds in (whole, cut):
        for key in ("date_created", "history", "wall_time_s", "compile_time_s"):
            del ds.attrs[key]
    xr.testing.assert_identical(whole, cut)
    assert np.prod(cut.w.encoding["chunksizes"]) <= tile
    assert reading.check(tmp_path / "cut.nc") == []


def test_the_file_says_what_xarray_would_have_written(small, surveyed, tmp_path):
    checked = workflow.read(small)
    arrays = solve.compute(checked.grid, checked.scene, checked.request)
    ds = labels.describe(checked.grid, checked.scene, checked.name, checked.request, arrays)
    ds.to_netcdf(tmp_path / "other.nc", encoding={name: {"_FillValue": None} for name in ds.coords})
    with netCDF4.Dataset(surveyed) as ours, netCDF4.Dataset(tmp_path / "other.nc") as other:
        assert set(ours.variables) == set(other.variables) and set(ours.dimensions) == set(
            other.dimensions
        )
        for name, variable in other.variables.items():
            own = ours[name]
            assert (own.dtype, own.dimensions) == (variable.dtype, variable.dimensions)
            assert set(own.ncattrs()) == set(variable.ncattrs()), name
            for key in own.ncattrs():
                np.testing.assert_array_equal(own.getncattr(key), variable.getncattr(key))
            np.testing.assert_array_equal(own[:], variable[:])
        for key in other.ncattrs():
            if key != "title":
                assert ours.getncattr(key) == other.getncattr(key)


def test_labels_of_an_extra_dimension_are_kept(tmp_path):
    labels, values = np.array(["200", "110"]), np.array([[1.0, np.nan]] * 3)
    coordinates = {
        "x": (("x",), np.arange(3.0), {"units": "1"}),
        "order": (("order",), labels, {"long_name": "order"}),
    }
    layout = {"c": (np.dtype(float), np.nan, (2,)), "status": (np.dtype("int8"), 0, ())}
    variables = {"c": (("x", "order"), {"units": "1"}), "status": (("x",), {"units": "1"})}
    output = MapFile(tmp_path / "o.nc", tmp_path, coordinates, variables, layout, (3,), (2,))
    for part in (slice(0, 2), slice(2, 3)):
        output.write("c", values[part], (part,))
    output.write("status", np.zeros(3, np.int8))
    with pytest.raises(OSError, match="absent"):  # as where HDF5 cannot read what it wrote
        output.write("absent", values)
    output.publish({})
    ds = xr.load_dataset(tmp_path / "o.nc")
    assert ds.order.values.tolist() == ["200", "110"] and ds.c.dims == ("x", "order")
    np.testing.assert_array_equal(ds.c, values)


def test_counts_are_those_of_the_whole(small, tmp_path, monkeypatch):
    monkeypatch.setattr(cost, "BLOCK_POINTS", 4)
    monkeypatch.setattr(labels, "CHUNK", 3)
    checked = workflow.read(small, ["solver.rtol=1e-17", "axes.t.stop=300.0"], tmp_path / "o.nc")
    finished = engine.run(checked)
    ds = survey.open(checked.path)
    missed = (ds.w_error > 1e-17 * (1 + abs(ds.w))) | (ds.phi_error > 1e-17 * (1 + abs(ds.phi)))
    assert ds.attrs["accuracy_missed"] == int(missed.sum()) > 0
    assert finished.counts["status"] == {
        name: int((ds.status == code).sum()) for name, code in _codes(ds).items()
    }


def _codes(ds):
    return dict(
        zip(ds.status.attrs["flag_meanings"].split(), ds.status.attrs["flag_values"], strict=True)
    )


def test_a_large_file_is_opened_lazily_and_checked_piece_by_piece(small, tmp_path, monkeypatch):
    monkeypatch.setattr(cost, "REGION_POINTS", 8)
    monkeypatch.setattr(reading, "IN_MEMORY", 0)
    ds = survey.run(small, output=tmp_path / "o.nc")
    assert ds.w.chunks and len(list(reading.pieces(ds))) == 3
    assert reading.check(tmp_path / "o.nc") == []
    again = survey.run(small, output=tmp_path / "o.nc")  # an open file does not stand in the way
    xr.testing.assert_equal(ds.drop_attrs(), again.drop_attrs())


def test_what_compiling_kernels_and_file_took_is_reported_apart(surveyed, small, tmp_path):
    finished = engine.run(workflow.read(small, output=tmp_path / "o.nc"))
    assert (
        min(finished.compiling, finished.computing, finished.edges_and_cells, finished.writing) >= 0
    )
    assert (
        0
        <= xr.load_dataset(surveyed).attrs["compile_time_s"]
        <= xr.load_dataset(surveyed).attrs["wall_time_s"]
    )


def test_what_is_left_follows_the_cost_of_each_region(monkeypatch):
    """Blocks of the left half take 1 s, those of the right 9 s: known once one of each is done."""
    blocks = [(slice(0, 4), slice(10 * i, 10 * i + 10)) for i in range(10)]
    left = time_left.TimeLeft((4, 100), blocks, reused={9})
    assert left() == 0.0
    clock = iter([41.0, 49.0, 49.0, 49.0])  # the first 40 s were spent on compiling
    monkeypatch.setattr(time_left.time, "perf_counter", lambda: next(clock))
    left.took(0, 1.0)
    left.took(7, 9.0)
    left.took(8, 8.0)  # 18 seconds of work in nine: two workers
    left.took(1, None)  # its worker died: its time says nothing
    # open: 2, 3 nearer to block 0, and 4, 5, 6 nearer to block 7
    assert left() == pytest.approx((2 * 1.0 + 3 * 9.0) / 2)


def test_blocks_from_all_over_the_map_come_first():
    numbers = list(range(3, 1003))
    spread = engine._spread(numbers)
    assert sorted(spread) == numbers and np.diff(sorted(spread[:16])).max() <= 63
    rest = [number for number in spread if number not in spread[: 1000 // 62 + 1]]
    assert rest == sorted(rest) and engine._spread([4, 2, 9]) == [2, 4, 9]
