"""Nothing finished is lost, nothing partial is published, and every flipped bit is found."""

import io
import multiprocessing
import os

import numpy as np
import pytest
import xarray as xr

import survey
from survey import status
from survey.errors import BadInput, Damaged, Stopped
from survey.file import blocks, labels, map_file, netcdf, reading
from survey.request import workflow
from survey.sweep import cost, engine, fingerprint, solve


@pytest.fixture
def copy(surveyed, tmp_path):
    """A copy of the small survey with its digest."""
    path = tmp_path / "copy.nc"
    path.write_bytes(surveyed.read_bytes())
    digest = surveyed.with_name(f"{surveyed.name}.sha256").read_text()
    (tmp_path / "copy.nc.sha256").write_text(digest)
    return path


def test_a_sound_file_has_no_complaints(copy):
    assert reading.check(copy) == []


@pytest.mark.parametrize(
    "place", [10, *(pytest.param(place, marks=pytest.mark.slow) for place in (0, 40))]
)
def test_a_flipped_bit_of_the_digest_is_found_and_mended(copy, small, place):
    beside = copy.with_name("copy.nc.sha256")
    bits = bytearray(beside.read_bytes())
    bits[place] ^= 128  # no text any more
    beside.write_bytes(bits)
    with pytest.raises(Damaged, match="differ from the digest"):
        reading.check(copy)
    survey.run(small, output=copy)
    assert reading.check(copy) == []


def test_a_file_of_another_kind_is_distinguished_from_a_damaged_one(copy, tmp_path):
    (tmp_path / "picture.nc").write_bytes(b"\x89PNG\r\n")
    with pytest.raises(BadInput, match=r"picture\.nc: this is not a netCDF file of survey"):
        survey.open(tmp_path / "picture.nc")
    copy.write_bytes(b"\x89PNG" + copy.read_bytes()[4:])  # its digest says that it was one of ours
    with pytest.raises(Damaged, match="digest"):
        survey.open(copy)


@pytest.mark.parametrize("where", [0.01, 0.3, 0.5, 0.8, 0.99])
def test_a_flipped_bit_is_found_anywhere(copy, where):
    bits = bytearray(copy.read_bytes())
    bits[int(len(bits) * where)] ^= 4
    copy.write_bytes(bits)
    for read in (reading.check, survey.open):
        with pytest.raises(Damaged, match="digest"):
            read(copy)


def test_a_cut_tail_is_found_without_the_digest_too(copy):
    copy.write_bytes(copy.read_bytes()[:-2000])
    os.remove(f"{copy}.sha256")
    with pytest.raises(Damaged):
        reading.check(copy)


def test_counts_that_do_not_match_the_data_are_found(copy):
    os.remove(f"{copy}.sha256")
    ds = xr.load_dataset(copy)
    ds.attrs["status_counts"] = "ok: 23, overflow: 1"
    ds.to_netcdf(copy)
    assert any("status_counts" in complaint for complaint in reading.check(copy))


def test_a_point_without_an_answer_is_counted_by_its_status(copy):
    """Older files tell it as undecided: they are sound as well."""
    os.remove(f"{copy}.sha256")
    ds = xr.load_dataset(copy)
    flags = {"flag_values": np.array([-1, 1], np.int8), "flag_meanings": "undecided stable"}
    ds["verdict"] = xr.ones_like(ds.status).assign_attrs(flags)
    ds["verdict"][0], ds["status"][0, :2] = -1, status.STEP_LIMIT
    bare = ds.sizes[ds.status.dims[1]]
    ds = labels.count(ds)
    assert (
        ds.attrs["verdict_counts"]
        == f"undecided: {bare - 2}, stable: {ds.status.size - bare}, step_limit: 2"
    )
    for counts in (
        ds.attrs["verdict_counts"],
        f"undecided: {bare}, stable: {ds.status.size - bare}",
    ):
        ds.assign_attrs(verdict_counts=counts).to_netcdf(copy)
        assert not [complaint for complaint in reading.check(copy) if "verdict_counts" in complaint]
    ds.assign_attrs(verdict_counts=f"stable: {ds.status.size}").to_netcdf(copy)
    assert any("verdict_counts" in complaint for complaint in reading.check(copy))


def test_an_incomplete_or_foreign_file_is_refused(copy, tmp_path):
    ds = xr.load_dataset(copy)
    ds.attrs["complete"] = 0
    ds.to_netcdf(copy)
    os.remove(f"{copy}.sha256")
    with pytest.raises(Damaged, match="incomplete"):
        survey.open(copy)
    xr.Dataset({"x": 1}).to_netcdf(tmp_path / "foreign.nc")
    with pytest.raises(BadInput, match="not written by survey"):
        survey.open(tmp_path / "foreign.nc")
    with pytest.raises(BadInput, match="no such file"):
        survey.open(tmp_path / "absent.nc")


def test_finished_blocks_are_used_again_and_give_the_same_bits(small, tmp_path, monkeypatch):
    monkeypatch.setattr(cost, "BLOCK_POINTS", 4)
    whole = survey.run(small, output=tmp_path / "whole.nc")
    checked = workflow.read(small, output=tmp_path / "again.nc")
    cuts = cost.blocks_of(checked)
    assert len(cuts) == 6
    with blocks.Blocks(checked.path, fingerprint.fingerprint(checked)) as kept:
        for number in (1, 3, 4):
            kept.save(
                number,
                solve.solve_block(checked.scene, checked.request, checked.grid, cuts[number]),
            )
        _flip(kept._file(3))
    seen = []
    engine.run(
        checked, progress=lambda done, total, reused, **_: seen.append((done, total, reused))
    )
    assert seen[0] == (2, 6, 2) and seen[-1] == (6, 6, 2)  # the damaged block was computed again
    xr.testing.assert_equal(whole.drop_attrs(), survey.open(checked.path).drop_attrs())
    assert not checked.path.with_name("again.nc.blocks").exists()


def _flip(file):
    bits = bytearray(file.read_bytes())
    bits[len(bits) // 2] ^= 1
    file.write_bytes(bits)


def test_a_damaged_block_is_found_and_dropped(small, tmp_path):
    checked = workflow.read(small, output=tmp_path / "o.nc")
    with blocks.Blocks(checked.path, fingerprint.fingerprint(checked)) as kept:
        kept.save(0, {"w": np.arange(100.0)})
        _flip(kept._file(0))
        with pytest.raises(Damaged, match="run the command again"):
            kept.load(0)
        assert kept.done() == set()


def _hold(path, ready, leave):
    with blocks.Blocks(path, {}):
        ready.set()
        leave.wait(30)


def test_a_second_writer_learns_who_holds_the_output_and_a_killed_holder_frees_it(tmp_path):
    context = multiprocessing.get_context("spawn")
    ready, leave = context.Event(), context.Event()
    holder = context.Process(target=_hold, args=(tmp_path / "o.nc", ready, leave))
    holder.start()
    assert ready.wait(60)
    with pytest.raises(BadInput, match=f"pid {holder.pid}"), blocks.Blocks(tmp_path / "o.nc", {}):
        pass
    holder.kill()
    holder.join()
    with blocks.Blocks(tmp_path / "o.nc", {}):
        pass


def test_a_complete_output_wins_over_what_its_run_has_left(small, tmp_path):
    """The manifest is gone, blocks and lock are not; both digests stand."""
    path = tmp_path / "o.nc"
    first = survey.run(small, output=path).attrs["date_created"]
    checked = workflow.read(small, output=path)
    with blocks.Blocks(path, fingerprint.fingerprint(checked)) as kept:
        kept.save(0, {"status": np.zeros(2, np.int8)})
    (kept.folder / "manifest.json").unlink()
    (tmp_path / "o.nc.lock").write_text('{"host": "gone", "pid"')
    beside = tmp_path / "o.nc.sha256"
    beside.write_text("0" * 64 + "  o.nc\n" + beside.read_text())
    assert survey.run(small, output=path).attrs["date_created"] == first
    assert {file.name for file in tmp_path.glob("o.nc*")} == {"o.nc", "o.nc.sha256"}
    assert beside.read_text().count("\n") == 1 and reading.check(path) == []
    with blocks.Blocks(path, fingerprint.fingerprint(checked)) as kept:
        kept.save(0, {"status": np.zeros(2, np.int8)})
    survey.run(small, output=path, fresh=True)
    assert survey.open(path).attrs["date_created"] >= first and not kept.folder.exists()


def test_a_complete_output_of_another_workflow_does_not(small, tmp_path, monkeypatch):
    monkeypatch.setattr(cost, "BLOCK_POINTS", 4)
    path = tmp_path / "o.nc"
    survey.run(small, output=path)
    checked = workflow.read(small, ["title='other'"], path)
    with blocks.Blocks(path, fingerprint.fingerprint(checked)) as kept:
        kept.save(
            0,
            solve.solve_block(
                checked.scene, checked.request, checked.grid, cost.blocks_of(checked)[0]
            ),
        )
    engine.run(checked)
    assert (
        survey.open(path).attrs["title"] == "other"
        and survey.open(path).attrs["blocks_reused"] == 1
    )


def test_a_block_under_another_number_or_of_another_survey_is_not_taken(tmp_path):
    with blocks.Blocks(tmp_path / "o.nc", {"rtol": 1}) as kept:
        kept.save(0, {"w": np.arange(3.0)})
        (kept.folder / "00000001.block").write_bytes(kept._file(0).read_bytes())
        with blocks.Blocks(tmp_path / "other.nc", {"rtol": 2}) as other:
            other.save(2, {"w": np.arange(3.0)})
        (kept.folder / "00000002.block").write_bytes(other._file(2).read_bytes())
        (kept.folder / "notes.block").write_text("of the user")
        assert kept.intact() == {0}


def test_a_clean_up_that_fails_is_reported_and_done_by_the_next_run(small, tmp_path, monkeypatch):
    path, rmdir = tmp_path / "o.nc", os.rmdir

    def refuse(folder, **_):
        raise OSError(5, "Input/output error", str(folder))

    monkeypatch.setattr(os, "rmdir", refuse)
    with pytest.raises(
        Stopped,
        match=r"o\.nc is complete, but .* \(Input/output error: .*o\.nc\.blocks\); fix this",
    ):
        survey.run(small, output=path)
    monkeypatch.setattr(os, "rmdir", rmdir)
    assert not (tmp_path / "o.nc.lock").exists()
    survey.run(small, output=path)
    assert {file.name for file in tmp_path.glob("o.nc*")} == {"o.nc", "o.nc.sha256"}


ARRAYS = {
    "w": np.linspace(0, 1, 12).reshape(3, 4),
    "w_error": np.full((3, 4), 1e-9, np.float32),
    "status": np.arange(12, dtype=np.int8).reshape(3, 4),
    "none": np.zeros((0, 4)),
    "one": np.float64(2.5),
}


def test_a_block_comes_back_bit_for_bit():
    file = io.BytesIO()
    blocks.pack(ARRAYS, file)
    again = blocks.unpack(file.getvalue())
    assert list(again) == list(ARRAYS)
    for name, array in ARRAYS.items():
        np.testing.assert_array_equal(again[name], array, strict=True)


def test_every_flipped_bit_and_every_cut_of_a_block_is_found():
    file = io.BytesIO()
    blocks.pack(ARRAYS, file)
    content = file.getvalue()
    for place in range(len(content)):
        flipped = bytearray(content)
        flipped[place] ^= 1 << place % 8
        for bad in (bytes(flipped), content[:place]):
            with pytest.raises(ValueError, match="checksum"):
                blocks.unpack(bad)


@pytest.mark.parametrize(
    ("where", "name", "error"),
    [
        (os, "fsync", OSError(28, "No space left on device")),
        (netcdf.NewFile, "write", OSError("HDF5: an error of its own")),
        pytest.param(os, "write", OSError(5, "Input/output error"), marks=pytest.mark.slow),
    ],
)
def test_a_disk_that_refuses_leaves_the_old_file(copy, small, monkeypatch, where, name, error):
    before = copy.read_bytes()

    def refuse(*_, **__):
        raise error

    with monkeypatch.context() as patch:
        patch.setattr(where, name, refuse)
        with pytest.raises(Stopped, match=r"copy\.nc.*(No space left|HDF5: an|Input/output)"):
            survey.run(small, output=copy, fresh=True)
    assert copy.read_bytes() == before and reading.check(copy) == []
    assert [
        file.name for file in copy.parent.rglob("*") if file.name.endswith((".part", "output.nc"))
    ] == []
    # the lock is free, and what is there is of use
    assert survey.run(small, output=copy).status.size == 24


CALLS = [
    (os, "fsync"),
    (os, "replace"),
    (blocks, "pack"),
    (map_file.MapFile, "write"),
    (netcdf.NewFile, "define"),
]


@pytest.mark.parametrize(
    ("where", "name"),
    [
        pytest.param(
            *call, marks=[pytest.mark.slow] * (call[1] in ("fsync", "write", "define", "pack"))
        )
        for call in CALLS
    ],
    ids=lambda value: getattr(value, "__name__", value),
)
def test_an_error_at_each_write_call_in_turn_loses_nothing(
    copy, small, surveyed, monkeypatch, where, name
):
    """The k-th call fails, k = 1, 2, ...: the old file stands, or the new one does; the next run goes on."""
    monkeypatch.setattr(cost, "BLOCK_POINTS", 8)
    call, real, fail = 0, getattr(where, name), 0

    def failing(*given, **named):
        nonlocal call
        call += 1
        if call == fail:
            raise OSError(5, "Input/output error")
        return real(*given, **named)

    monkeypatch.setattr(where, name, failing)
    for fail in range(1, 100):
        call = 0
        try:
            survey.run(small, output=copy, fresh=True)
        except Stopped as error:
            assert "Input/output error" in str(error) and "\n" not in str(error)
            assert reading.check(copy) == []
        if call < fail:
            break
    assert 2 < fail < 99
    assert reading.check(copy) == []
    xr.testing.assert_equal(survey.open(copy).drop_attrs(), survey.open(surveyed).drop_attrs())
