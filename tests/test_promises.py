"""What a sweep promises, on the real program: kills, faults, several processes. The long forms are
marked slow.

Where each promise is tested, here if no file is named; (slow): its long form, (beside): parts in
one process.

 1 atomic                test_kills_at_random_times_lose_and_corrupt_nothing: 4 kills, 200 (slow); test_faults: a kill
                         at each call that reaches the disk (slow), at all that publish and clean up
 2 nothing is lost       the same; test_cells_go_on_where_a_kill_left_them
 3 resume is invisible   the same; test_engine: test_any_cut_gives_the_same_file (beside)
 4 one bad point         test_a_bad_point_costs_itself_alone; test_evaluate (beside)
 5 no silent NaN         test_a_bad_point_costs_itself_alone; test_cli: test_failed_points_exit_1
 6 drift is refused      test_drift_and_a_second_writer_are_refused; test_blocks (beside)
 7 one writer            test_drift_and_a_second_writer_are_refused; test_blocks: a killed holder; test_lock
 8 damage is found       test_a_flipped_bit_of_a_block_is_mended; test_cli: test_verify_finds_...; test_blocks:
                         every bit of a block (beside); test_audit: wrong values under sound sums
                         (beside)
 9 bounded memory        test_memory_is_bounded_by_blocks_not_by_the_map: 10^6 points, 10^8 (slow)
10 prompt stop           test_workers_stop_promptly_with_the_run; test_an_interrupt_from_the_terminal_...;
                         test_dispatch: an interruption (beside); test_cli:
                         test_an_interrupted_run_can_be_resumed; test_cluster:
                         test_the_batch_script_stops_before_the_walltime_and_is_queued_again
11 disk faults           test_a_full_disk_..., test_a_file_size_limit_...; test_faults: an error at each call that
                         reaches the disk (slow), at one of each kind, a read-only disk;
                         test_blocks: each (beside)
12 dying workers         test_a_killed_worker_is_replaced; test_dispatch: tasks that kill (beside); test_cluster: a lost
                         scheduler, workers on another disk, a worker with other code
13 no stale code         test_an_edit_of_what_a_kernel_calls_takes_effect_in_the_next_process;
                         test_two_processes_fill_one_empty_kernel_cache;
                         test_a_home_that_cannot_be_written_is_fine
14 an honest plan        test_the_plan_counts_what_the_run_does; test_cli: no kernel is called
15 old files open        test_files_that_are_kept_open_and_verify; test_golden: of every scene
16 the same answer       test_the_same_bits_on_one_processor_and_on_all; test_scenes (beside)
"""

import json
import os
import random
import re
import resource
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pytest
import xarray as xr

import survey
from survey.file import reading

SWEEP = """
title  = "A sweep to be killed"
scene  = "gyrostat"
[options]
question = "trajectory"
[axes]
w0   = { start = 0.5, stop = 2.0, num = 90 }
phi0 = { start = 0.5, stop = 2.0, num = 50 }
t    = 20
b12  = 0.7
b31  = -0.4
d    = 1.1
s2   = 0.5
[solver]
rtol   = 1e-10
method = "dop853"
[output]
path = "sweep.nc"
"""
# the program with small blocks: many of them, each soon done
PROGRAM = "import survey.sweep.engine; survey.sweep.cost.BLOCK_POINTS = 100; from survey.cli import main; main()"


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory):
    """The sweep's dataset, of a run that nothing disturbed."""
    folder = tmp_path_factory.mktemp("unbroken")
    (folder / "sweep.toml").write_text(SWEEP)
    done = start(folder).wait()
    assert done == 0
    return xr.load_dataset(folder / "sweep.nc")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sweep.toml").write_text(SWEEP)
    return tmp_path


def start(folder, *words, **keywords):
    """The running program."""
    command = [sys.executable, "-c", PROGRAM, "run", "sweep.toml", *words]
    keywords = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL} | keywords
    return subprocess.Popen(command, cwd=folder, text=True, **keywords)


def resume(folder, *words):
    """(exit code, stderr) of the program run to its end."""
    running = start(folder, *words, stderr=subprocess.PIPE)
    stderr = running.communicate(timeout=120)[1]
    return running.returncode, stderr


def same(folder, unbroken):
    """The output is there, sound, and has the bits of the unbroken run."""
    path = folder / "sweep.nc"
    assert reading.check(path) == []
    xr.testing.assert_equal(xr.load_dataset(path).drop_attrs(), unbroken.drop_attrs())
    assert not path.with_name("sweep.nc.blocks").exists()


def blocks(folder):
    return list((folder / "sweep.nc.blocks").glob("*.block"))


def wait_for(what, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.002)


@pytest.mark.parametrize("kills", [4, pytest.param(200, marks=pytest.mark.slow)])
@pytest.mark.parametrize("words", [(), pytest.param(("--workers", "2"), marks=pytest.mark.slow)])
def test_kills_at_random_times_lose_and_corrupt_nothing(folder, unbroken, kills, words):
    dice = random.Random(kills)
    killed = 0
    while killed < kills:
        before = len(blocks(folder))
        running = start(folder, *words)
        begun = psutil.Process(running.pid)
        time.sleep(dice.uniform(0.0, 2.5))
        children = begun.children(recursive=True) if running.poll() is None else []
        if running.poll() is not None:
            assert running.returncode == 0
            same(folder, unbroken)
            (folder / "sweep.nc").unlink()
            continue
        workers = [child for child in children if _is_worker(child)]
        # a worker first: the run goes on, until it is killed too
        if workers and dice.random() < 0.5:
            dice.choice(workers).kill()
            killed += 1
            time.sleep(dice.uniform(0.0, 1.0))
            children = begun.children(recursive=True) if running.poll() is None else []
        running.kill()
        running.wait()
        killed += 1
        wait_for(
            lambda gone=children: not any(child.is_running() and _works(child) for child in gone),
            20,
        )
        assert len(blocks(folder)) >= before or (folder / "sweep.nc").exists()
        if (folder / "sweep.nc").exists():
            assert reading.check(folder / "sweep.nc") == []
    reused = len(blocks(folder))
    code, stderr = resume(folder)
    counted = f"computed {45 - reused}, reused {reused} of 45 blocks"
    assert code == 0 and (counted in stderr or "already complete" in stderr), stderr
    same(folder, unbroken)


def _is_worker(process):
    try:
        return "spawn_main" in " ".join(process.cmdline())
    except psutil.NoSuchProcess:
        return False


def _works(process):
    try:
        return process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def test_a_killed_worker_is_replaced(folder, unbroken):
    running = start(folder, "--workers", "2")
    wait_for(lambda: len(blocks(folder)) > 3)
    next(child for child in psutil.Process(running.pid).children() if _is_worker(child)).kill()
    assert running.wait(120) == 0
    same(folder, unbroken)


CELLS = """
title = "Cells to be killed"
scene = "mathieu"
[axes]
a = { start = 0.5, stop = 800.0, num = 5 }
q = { start = 0.1, stop = 200.0, num = 5 }
[output]
path = "cells.nc"
variables = ["verdict"]
[refine]
width = 0.001
"""
# the program with many small parts of cells, which prints those that it computes
PARTS = """
import os
from survey.file import blocks
from survey.measures.hill import cells
cells.BATCH = 1
once = blocks.Blocks.once
def reporting(kept, name, make):
    def make_and_report():
        os.write(1, name.encode() + b" ")
        return make()
    return once(kept, name, make_and_report)
blocks.Blocks.once = reporting
from survey.cli import main
main()
"""


@pytest.mark.slow
def test_cells_go_on_where_a_kill_left_them(tmp_path):
    (tmp_path / "cells.toml").write_text(CELLS)
    command = [sys.executable, "-c", PARTS, "run", "cells.toml"]
    keywords = {"cwd": tmp_path, "text": True, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    whole = subprocess.run([*command, "-o", "whole.nc"], **keywords, timeout=120)
    assert (
        whole.returncode == 0 and "cells: all decided or at the requested width" in whole.stderr
    ), whole.stderr
    parts, known = whole.stdout.split(), set()
    for share in (0.3, 0.7):
        running = subprocess.Popen(command, **keywords)
        wait_for(lambda: len(_parts_of_cells(tmp_path)) > share * len(parts))  # noqa: B023
        running.kill()
        assert not known & set(running.communicate()[0].split())
        known = _parts_of_cells(tmp_path)
    done = subprocess.run(command, **keywords, timeout=120)
    assert done.returncode == 0 and sorted([*known, *done.stdout.split()]) == sorted(parts), (
        done.stderr
    )
    assert reading.check(tmp_path / "cells.nc") == []
    xr.testing.assert_equal(
        *(xr.load_dataset(tmp_path / name).drop_attrs() for name in ("whole.nc", "cells.nc"))
    )


def _parts_of_cells(folder):
    return {file.stem for file in (folder / "cells.nc.blocks").glob("cells-*.extra")}


@pytest.mark.parametrize(
    ("name", "code"), [pytest.param("SIGINT", 130, marks=pytest.mark.slow), ("SIGTERM", 143)]
)
def test_workers_stop_promptly_with_the_run(folder, name, code):
    heeding = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731  (a background job ignores it)
    running = start(folder, "--workers", "2", stderr=subprocess.PIPE, preexec_fn=heeding)
    wait_for(lambda: len(blocks(folder)) > 3)
    children = psutil.Process(running.pid).children(recursive=True)
    running.send_signal(getattr(signal, name))
    stderr = running.communicate(timeout=10)[1]
    assert running.returncode == code and "resume with: survey run sweep.toml --workers 2" in stderr
    wait_for(lambda: not any(_works(child) for child in children), 5)


def test_an_interrupt_from_the_terminal_is_one_line_while_workers_start(folder):
    """The terminal sends it to every process of the group."""
    heeding = lambda: (os.setsid(), signal.signal(signal.SIGINT, signal.SIG_DFL))  # noqa: E731
    running = start(folder, "--workers", "2", "--quiet", stderr=subprocess.PIPE, preexec_fn=heeding)
    wait_for(lambda: any(_is_worker(child) for child in psutil.Process(running.pid).children()))
    os.killpg(running.pid, signal.SIGINT)
    stderr = running.communicate(timeout=60)[1]
    assert (
        running.returncode == 130
        and stderr.count("\n") == 1
        and "interrupted; no block was finished yet; resume" in stderr
    )


def test_drift_and_a_second_writer_are_refused(folder, unbroken):
    running = start(folder)
    wait_for(lambda: len(blocks(folder)) > 3)
    running.send_signal(signal.SIGSTOP)
    code, stderr = resume(folder, "--quiet")
    assert (
        code == 2
        and stderr.count("\n") == 1
        and f"another run is writing it (host {socket.gethostname()}, " in stderr
    )
    assert f"pid {running.pid}" in stderr
    running.kill()
    running.wait()
    kept = len(blocks(folder))
    code, stderr = resume(folder, "--quiet", "--set", "solver.rtol=1e-9")
    assert (
        code == 2
        and stderr.count("\n") == 1
        and "from another workflow (solver.rtol 1e-10 -> 1e-09); go back" in stderr
    )
    assert f"--fresh, which deletes {kept} finished blocks" in stderr
    assert len(blocks(folder)) == kept
    code, stderr = resume(folder, "--fresh")
    assert (
        code == 0
        and "reused 0 of" in stderr
        and "--fresh" in xr.load_dataset(folder / "sweep.nc").attrs["history"]
    )
    same(folder, unbroken)


def test_a_flipped_bit_of_a_block_is_mended(folder, unbroken):
    running = start(folder)
    wait_for(lambda: len(blocks(folder)) > 5)
    running.kill()
    running.wait()
    kept = sorted(blocks(folder))
    bits = bytearray(kept[2].read_bytes())
    bits[len(bits) // 3] ^= 8
    kept[2].write_bytes(bits)
    kept[3].write_bytes(kept[3].read_bytes()[:-5])
    code, stderr = resume(folder)
    assert code == 0 and f"reused {len(kept) - 2} of 45 blocks" in stderr, stderr
    same(folder, unbroken)


def test_a_bad_point_costs_itself_alone(tmp_path):
    """k = 1 is no parameter: its row has a status, and all others the bits of a map without it."""
    axes = {"with": "[0.5, 0.9, 1.0, 1.1]", "without": "[0.5, 0.9, 1.1]"}
    for name, values in axes.items():
        text = f'scene = "satellite"\n[axes]\nk = {{ values = {values} }}\nrho = {{ values = [0.7, 1.9] }}\n'
        (tmp_path / f"{name}.toml").write_text(text)
        command = [sys.executable, "-m", "survey", "run", f"{name}.toml", "-o", f"{name}.nc"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr
        assert name == "without" or "status: ok: 6, invalid_parameters: 2" in done.stderr, (
            done.stderr
        )
    bad, good = (xr.load_dataset(tmp_path / f"{name}.nc") for name in axes)
    xr.testing.assert_equal(bad.sel(k=good.k).drop_attrs(), good.drop_attrs())
    assert reading.check(tmp_path / "with.nc") == [] and bad.discriminant.sel(k=1.0).isnull().all()


@pytest.mark.slow
def test_a_log_gets_a_line_now_and_then(folder):
    """Without a terminal, as under nohup; a minute is shortened to a twentieth of a second."""
    program = "import survey.sweep.progress; survey.sweep.progress.LOG_SECONDS = 0.05; " + PROGRAM
    done = subprocess.run(
        [sys.executable, "-c", program, "run", "sweep.toml"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    lines = [
        line
        for line in done.stderr.splitlines()
        if re.search(r": \d+ of 45 blocks, \d+ s elapsed, ETA \d+ s$", line)
    ]
    assert done.returncode == 0 and 2 <= len(lines) <= 45 and "\r" not in done.stderr, done.stderr
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, "run", "sweep.toml", "--fresh"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    assert done.stderr.count("elapsed") == 1, done.stderr  # the last


def test_the_plan_counts_what_the_run_does(folder, unbroken):
    command = [sys.executable, "-c", PROGRAM, "plan", "sweep.toml", "--json"]
    planned = json.loads(
        subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True).stdout
    )
    assert planned["points"] == unbroken.status.size == 4500 and planned["blocks"] == 45
    kinds = [
        np.dtype(variable.encoding.get("dtype", variable.dtype))
        for variable in unbroken.data_vars.values()
    ]
    # masked integers are floats once open
    assert planned["bytes"] == sum(4500 * kind.itemsize for kind in kinds)
    assert not (folder / "sweep.nc").exists()


def test_a_file_size_limit_is_one_line_and_the_run_can_go_on(folder, unbroken):
    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(
            resource.RLIMIT_FSIZE, (20_000, resource.getrlimit(resource.RLIMIT_FSIZE)[1])
        )

    # it writes files too
    environment = {key: value for key, value in os.environ.items() if not key.startswith("COV")}
    running = start(folder, "--quiet", stderr=subprocess.PIPE, preexec_fn=limit, env=environment)
    stderr = running.communicate(timeout=60)[1]
    assert (
        running.returncode == 4 and stderr.count("\n") == 1 and "sweep.nc: writing failed" in stderr
    ), stderr
    assert not (folder / "sweep.nc").exists()
    assert resume(folder)[0] == 0
    same(folder, unbroken)


@pytest.mark.slow
def test_a_full_disk_is_one_line_and_the_run_can_go_on(folder, unbroken):
    disk = folder / "disk"
    disk.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=200k", "none", disk], capture_output=True
    ).returncode:
        pytest.skip("needs the right to mount a small tmpfs")
    try:
        (disk / "sweep.toml").write_text(SWEEP)
        code, stderr = resume(disk, "--quiet")
        assert code == 2 and "the disk of" in stderr and stderr.count("\n") == 1, stderr
        (disk / "filler").write_bytes(bytes(60_000))
        program = PROGRAM.replace(
            "from", "survey.sweep.engine.refuse_too_large = lambda _: None; from"
        )
        command = [sys.executable, "-c", program, "run", "sweep.toml", "--quiet"]
        done = subprocess.run(command, cwd=disk, capture_output=True, text=True, timeout=60)
        assert (
            done.returncode == 4 and "bytes free" in done.stderr and done.stderr.count("\n") == 1
        ), done.stderr
        kept = len(blocks(disk))
        subprocess.run(["mount", "-o", "remount,size=20m", disk], check=True)
        code, stderr = resume(disk)
        assert code == 0 and f"reused {kept} of" in stderr and kept > 0
        same(disk, unbroken)
    finally:
        subprocess.run(["umount", disk], check=True)


def test_a_home_that_cannot_be_written_is_fine(folder):
    environment = os.environ | {"HOME": "/proc", "XDG_CACHE_HOME": "/proc/none"}
    environment.pop("NUMBA_CACHE_DIR", None)
    small = ["--set", "axes.w0.num=2", "--set", "axes.phi0.num=2"]
    running = start(folder, *small, env=environment, stderr=subprocess.PIPE)
    stderr = running.communicate(timeout=120)[1]
    assert running.returncode == 0 and "status: ok: 4" in stderr, stderr


@pytest.mark.slow
def test_a_user_without_a_home_is_fine(folder):
    """As in a container that runs under a number which no table of users knows."""
    homeless = "import pwd\ndef unknown(_):\n    raise KeyError\npwd.getpwuid = unknown\n" + PROGRAM
    places = ("HOME", "NUMBA_CACHE_DIR", "XDG_")
    environment = {key: value for key, value in os.environ.items() if not key.startswith(places)}
    words = ["run", "sweep.toml", "--set", "axes.w0.num=2", "--set", "axes.phi0.num=2"]
    command = [sys.executable, "-c", homeless, *words]
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0 and "status: ok: 4" in done.stderr, done.stderr


@pytest.mark.slow
def test_two_processes_fill_one_empty_kernel_cache(folder):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")}
    small = ["--set", "axes.w0.num=2", "--set", "axes.phi0.num=2"]
    both = [start(folder, *small, "-o", f"{name}.nc", env=environment) for name in "ab"]
    assert [running.wait(180) for running in both] == [0, 0]
    one, other = (xr.load_dataset(folder / f"{name}.nc") for name in "ab")
    xr.testing.assert_equal(one.drop_attrs(), other.drop_attrs())


def test_an_edit_of_what_a_kernel_calls_takes_effect_in_the_next_process(tmp_path):
    shutil.copytree(Path(survey.__file__).parent, tmp_path / "survey")
    words = (
        "import numpy as np; from survey.kernels.hill.satellite import sample; out = np.empty((1, 2, 2, 2));"
        "sample(np.array([[0.5, 0.75**0.5, 1.6, 0.0, 0.5, 0.0]]), np.array([0.2, 0.8]), out); print(out)"
    )
    environment = os.environ | {
        "PYTHONPATH": str(tmp_path),
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
    }

    def printed():
        command = [sys.executable, "-c", words]
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
        )
        return done.stdout

    first = printed()
    source = tmp_path / "survey" / "kernels" / "math" / "elliptic.py"
    text = source.read_text()
    edited = text.replace("mean = 0.5 * (pairs", "mean = 0.6 * (pairs")
    assert edited != text
    source.write_text(edited)
    assert printed() != first
    source.write_text(text)
    assert printed() == first


KEPT = sorted((Path(__file__).parent.parent / "results").glob("*_small.nc"))


@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, marks=pytest.mark.slow if "fate" in path.name else (), id=path.name)
        for path in KEPT
    ],
)
def test_files_that_are_kept_open_and_verify(path, tmp_path):
    for file in (path, Path(f"{path}.sha256")):
        shutil.copy(file, tmp_path)
    assert reading.check(tmp_path / path.name) == []
    done = subprocess.run(
        [sys.executable, "-m", "survey", "verify", path.name],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0 and "all within the error bars" in done.stdout, done.stderr


def test_the_same_bits_on_one_processor_and_on_all(folder, unbroken):
    code = start(
        folder, preexec_fn=lambda: os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    ).wait(120)
    assert code == 0
    same(folder, unbroken)
    assert np.isfinite(unbroken.w).all()


# runs a command and tells its peak memory: a process counts as its own what the one that started it
# had
PEAK = """
import os, subprocess, sys
_, ended, usage = os.wait4(subprocess.Popen(sys.argv[1:]).pid, 0)
print(usage.ru_maxrss)
sys.exit(os.waitstatus_to_exitcode(ended))
"""


@pytest.mark.parametrize("side", [1000, pytest.param(10_000, marks=pytest.mark.slow)])
def test_memory_is_bounded_by_blocks_not_by_the_map(tmp_path, side):
    """10^5 points against 10^6, or 10^8; asked: below 1 GiB, assembly included."""
    text = (Path(__file__).parent.parent / "workflows" / "satellite_prolate.toml").read_text()
    workflow = tmp_path / "points.toml"
    workflow.write_text(text.partition("[boundaries]")[0])
    peaks = []
    for k, rho in ((100, 1000), (side, side)):
        command = [
            sys.executable,
            "-m",
            "survey",
            "run",
            str(workflow),
            "-o",
            "map.nc",
            "--quiet",
            "--fresh",
        ]
        asked = [
            f"axes.k.num={k}",
            f"axes.rho.num={rho}",
            "output.variables=['discriminant']",
            "output.figures=[]",
        ]
        command += [word for text in asked for word in ("--set", text)]
        ran = subprocess.run(
            [sys.executable, "-c", PEAK, *command], cwd=tmp_path, capture_output=True, text=True
        )
        assert ran.returncode == 0, ran.stderr
        peaks.append(int(ran.stdout.split()[-1]) / 1024)
    assert peaks[1] < 1024 and peaks[1] - peaks[0] < 256, peaks
