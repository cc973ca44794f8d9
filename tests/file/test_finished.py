"""A finished file is never lost without being asked: the same workflow computes nothing, another
one is refused.
"""

import netCDF4
import numpy as np
import pytest
import xarray as xr

import survey
from survey.errors import BadInput
from survey.file import finished, reading
from survey.file.blocks import of_output
from survey.file.unfinished import FUSED
from survey.kernels.jit import HAS_FMA
from survey.request import earlier, workflow
from survey.sweep import engine
from survey.sweep.fingerprint import fingerprint


def test_the_same_workflow_computes_nothing_and_draws_again(ran, small, monkeypatch):
    before, picture = ran.read_bytes(), ran.with_suffix(".png")
    monkeypatch.chdir(ran.parent)
    monkeypatch.setattr(engine, "solve_block", None)  # it would be called
    ds = survey.run(small)
    assert ran.read_bytes() == before and picture.exists() and ds.attrs["complete"] == 1
    picture.unlink()
    small.write_text("# a comment\n" + small.read_text().replace('"w"', '"w", "phi"'))
    survey.run(small)  # comments, paths and figures change no value of the file
    assert (
        ran.read_bytes() == before and picture.exists() and ran.with_name("small_phi.png").exists()
    )
    assert {file.name for file in ran.parent.glob("small.nc*")} == {"small.nc", "small.nc.sha256"}


def test_the_command_says_so_and_exits_with_0(ran, small, program):
    done = program("run", small)
    assert (
        done.returncode == 0 and "small.nc: already complete; nothing was computed" in done.stderr
    )
    assert "wrote small.png" in done.stderr and "kernels" not in done.stderr


@pytest.mark.parametrize(
    ("override", "told", "serves"),
    [
        ("solver.rtol=1e-6", "solver.rtol 1e-09 -> 1e-06", False),
        ("axes.w0.num=3", "axes.w0.num 6 -> 3", True),
        ("axes.w0=0.7", "axes.w0 {START} -> 0.7", False),
        ("output.variables=['w']", "output.variables not given -> ['w']", True),
    ],
)
def test_another_workflow_is_refused_and_nothing_is_lost(
    ran, small, monkeypatch, override, told, serves
):
    """--reuse is offered only where it can take values."""
    told = told.replace("{START}", "{'start': 0.5, 'stop': 2.0, 'num': 6}")
    before = ran.read_bytes()
    monkeypatch.chdir(ran.parent)
    with pytest.raises(BadInput) as refused:
        engine.run(workflow.read(small, [override]))
    assert str(refused.value) == (
        f"small.nc is a finished survey of 24 points of another workflow ({told}); write to another file with -o, "
        + (
            "replace it with --fresh, or extend it with --reuse small.nc, which says if values can be taken "
            "(in Python output=, fresh=True, reuse=)"
            if serves
            else "or replace it with --fresh (in Python output=, fresh=True)"
        )
    )
    assert ran.read_bytes() == before and not ran.with_name("small.nc.lock").exists()
    engine.run(workflow.read(small, [override]), fresh=True)
    assert ran.read_bytes() != before and reading.check(ran) == []


def test_a_run_that_was_to_replace_it_is_resumed_without_asking_again(ran, small, monkeypatch):
    monkeypatch.chdir(ran.parent)
    other = workflow.read(small, ["solver.rtol=1e-6"])

    def stop(job, blocks, _finished):
        job(blocks[0])
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(engine.dispatch, "on_threads", stop)
        engine.run(other, fresh=True)
    engine.run(other)
    assert (
        survey.open("small.nc").attrs["rtol"] == 1e-6
        and survey.open("small.nc").attrs["blocks_reused"] == 1
    )


def test_other_code_is_reported(ran, small, monkeypatch):
    monkeypatch.chdir(ran.parent)
    _change(ran, fingerprint="old", version_numba="0.1")
    with pytest.raises(
        BadInput, match=r"24 points from another version of the code \(numba 0\.1 -> \d"
    ):
        engine.run(workflow.read(small))


def test_a_processor_of_other_arithmetic_is_reported(ran, small, monkeypatch):
    monkeypatch.chdir(ran.parent)
    other = "without" if HAS_FMA else "with"
    there = fingerprint(workflow.read(small)) | {FUSED: not HAS_FMA}
    _change(ran, fingerprint=of_output(there))
    with pytest.raises(
        BadInput, match=rf"24 points from a processor {other} fused multiply-adds, "
    ):
        engine.run(workflow.read(small))
    told = earlier.find(workflow.read(small, output="new.nc"), "small.nc")[1]
    assert f"taken from this file: it is from a processor {other} fused multiply-adds" in told


def test_files_of_other_programs_are_not_lost(small, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    xr.Dataset({"x": ("t", np.arange(3.0))}).to_netcdf("small.nc")
    with pytest.raises(
        BadInput,
        match=r"small\.nc: this netCDF file was not written by survey; write to another with -o",
    ):
        survey.run(small)
    assert list(xr.load_dataset("small.nc")) == ["x"]


def test_what_is_damaged_or_lost_its_workers_is_computed_again(ran, small, monkeypatch):
    monkeypatch.chdir(ran.parent)
    created = survey.open(ran).attrs["date_created"]
    _change(ran, status_counts="ok: 20, worker_died: 4", date_created="before")
    assert survey.run(small).attrs["date_created"] >= created
    ran.write_bytes(ran.read_bytes()[:-100])
    assert finished.attributes(ran) == {}
    survey.run(small)
    assert reading.check(ran) == []


def _change(path, **attributes):
    with netCDF4.Dataset(path, "a") as file:
        file.setncatts(attributes)
    path.with_name(f"{path.name}.sha256").unlink()
