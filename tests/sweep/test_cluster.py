"""A sweep on a dask cluster: dask's own commands, with a shared folder and without, workers and
schedulers that die.
"""

import dataclasses
import os
import pickle
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
import xarray as xr

import survey
from survey.errors import Stopped
from survey.file import reading
from survey.file.blocks import Blocks
from survey.kernels.jit import HAS_FMA
from survey.request import workflow
from survey.sweep import cost, engine, fingerprint

pytest.importorskip("distributed")
PROGRAM = """
from survey.sweep import cost, dispatch
cost.BLOCK_POINTS = 2
dispatch.COMPILE_SECONDS = 60.0
from survey.cli import main
main()
"""


def dask(*words, cwd, before=(), **more):
    command = [*before, sys.executable, "-m", "dask", *map(str, words)]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(command, cwd=cwd, env=os.environ | more, **quiet)


def worker(file, *words, **more):
    """A worker that lives in another folder."""
    away = file.parent / "away"
    away.mkdir(exist_ok=True)
    return dask(
        "worker",
        "--scheduler-file",
        file,
        "--nthreads",
        1,
        "--no-dashboard",
        *words,
        cwd=away,
        **more,
    )


@pytest.fixture
def scheduler(tmp_path):
    """(path of the scheduler's file, [its process]), to which a test adds the workers; all are
    killed at the end.
    """
    file = tmp_path / "scheduler.json"
    processes = [
        dask("scheduler", "--scheduler-file", file, "--port", 0, "--no-dashboard", cwd=tmp_path)
    ]
    wait_for(file.exists)
    yield file, processes
    for process in reversed(processes):
        process.kill()
        process.wait()


@pytest.fixture
def cluster(scheduler):
    """The same with two workers."""
    file, processes = scheduler
    processes += [worker(file), worker(file)]
    return scheduler


def wait_for(what, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < deadline, "waited too long"
        time.sleep(0.01)


def start(folder, file, *words, **more):
    command = [sys.executable, "-c", PROGRAM, "run", "small.toml", "--scheduler", str(file), *words]
    return subprocess.Popen(
        command, cwd=folder, env=os.environ | more, stderr=subprocess.PIPE, text=True
    )


@pytest.mark.slow
def test_a_cluster_gives_the_same_file(cluster, small, surveyed):
    running = start(small.parent, cluster[0])
    stderr = running.communicate(timeout=180)[1]
    assert running.returncode == 0 and "computed 6, reused 0 of 6 blocks" in stderr, stderr
    assert reading.check(small.with_suffix(".nc")) == []
    xr.testing.assert_equal(
        *(xr.load_dataset(path).drop_attrs() for path in (surveyed, small.with_suffix(".nc")))
    )


@pytest.mark.slow
def test_a_lost_scheduler_is_reported_and_the_run_can_go_on(cluster, small):
    many = ("--set", "axes.w0.num=1000", "--set", "solver.method='dop853'")
    running = start(small.parent, cluster[0], *many)
    blocks = small.parent / "small.nc.blocks"
    wait_for(lambda: len(list(blocks.glob("*.block"))) > 5)
    cluster[1][0].kill()
    stderr = running.communicate(timeout=120)[1]
    assert running.returncode == 4 and stderr.splitlines()[-1].startswith(
        "survey: the dask cluster at tcp://"
    ), stderr
    assert len(list(blocks.glob("*.block"))) > 5


@pytest.mark.slow
def test_workers_with_too_little_memory_end_the_run_which_can_go_on(scheduler, small, surveyed):
    """The limit kills every worker as it imports or compiles; a nanny that is late, on a busy
    machine, gives up.
    """
    file, processes = scheduler
    processes += [worker(file, "--memory-limit", "120MB") for _ in range(2)]
    running = start(small.parent, file, "--quiet", "--block-timeout", "60")
    stderr = running.communicate(timeout=300)[1]
    assert running.returncode == 4, stderr
    reasons = "keep dying, or pausing .* without finishing a block|lost its last worker"
    assert re.fullmatch(
        rf"survey: .* ({reasons}).* run the command again to resume", stderr.splitlines()[-1]
    ), stderr
    for process in processes[1:]:
        process.kill()
    processes.append(worker(file))
    running = start(small.parent, file)
    stderr = running.communicate(timeout=180)[1]
    assert running.returncode == 0, stderr
    assert reading.check(small.with_suffix(".nc")) == []
    xr.testing.assert_equal(
        *(xr.load_dataset(path).drop_attrs() for path in (surveyed, small.with_suffix(".nc")))
    )


@pytest.mark.slow
def test_a_worker_that_freezes_does_not_hold_up_the_run(cluster, small, surveyed):
    """Its nanny goes on, and starts another; one that has finished no block yet may take
    COMPILE_SECONDS more.
    """
    many = ("--set", "axes.w0.num=100", "--set", "solver.method='dop853'")
    whole = start(small.parent, cluster[0], *many, "-o", "whole.nc")
    assert whole.wait(300) == 0
    running = start(small.parent, cluster[0], *many, "--block-timeout", "3")
    blocks = small.parent / "small.nc.blocks"
    wait_for(lambda: len(list(blocks.glob("*.block"))) > 30)
    children = psutil.Process(cluster[1][1].pid).children()
    (frozen,) = (process for process in children if "--multiprocessing-fork" in process.cmdline())
    frozen.suspend()
    stderr = running.communicate(timeout=300)[1]
    assert running.returncode == 0, stderr
    assert "finished no block for more than 3 s; their blocks go to others" in stderr, stderr
    assert not frozen.is_running()
    xr.testing.assert_equal(
        *(xr.load_dataset(small.parent / name).drop_attrs() for name in ("whole.nc", "small.nc"))
    )


def certificate(folder, name, days=2):
    """Settings of dask for all roles: a certificate that is its own authority, by openssl."""
    key, asked, cert = (folder / f"{name}.{suffix}" for suffix in ("key", "csr", "pem"))
    new = [
        "req",
        "-new",
        "-newkey",
        "ec",
        "-pkeyopt",
        "ec_paramgen_curve:P-256",
        "-nodes",
        "-subj",
        f"/CN={name}",
    ]
    signed = ["x509", "-req", "-in", asked, "-signkey", key, "-days", str(days), "-out", cert]
    for words in ([*new, "-keyout", key, "-out", asked], signed):
        subprocess.run(["openssl", *words], check=True, capture_output=True)
    files = {
        f"{role}__{what}": file
        for role in ("SCHEDULER", "WORKER", "CLIENT")
        for what, file in (("CERT", cert), ("KEY", key))
    }
    return {
        f"DASK_DISTRIBUTED__COMM__TLS__{what}": str(file)
        for what, file in {"CA_FILE": cert, **files}.items()
    }


@pytest.mark.slow
def test_a_cluster_with_tls(small, tmp_path, surveyed):
    if not shutil.which("openssl"):
        pytest.skip("needs openssl")
    file, tls, other = (
        tmp_path / "scheduler.json",
        certificate(tmp_path, "survey"),
        certificate(tmp_path, "other"),
    )
    scheduler = (
        "scheduler",
        "--protocol",
        "tls",
        "--scheduler-file",
        file,
        "--port",
        0,
        "--no-dashboard",
    )
    processes = [dask(*scheduler, cwd=tmp_path, **tls)]
    try:
        wait_for(file.exists)
        processes.append(worker(file, **tls))
        ca = "DASK_DISTRIBUTED__COMM__TLS__CA_FILE"
        for more, code, words in (
            (
                {},
                2,
                "requires TLS; set distributed.comm.tls: ca-file, client.cert and client.key in dask's configuration",
            ),
            ({ca: tls[ca]}, 2, "requires TLS; set"),
            (
                tls | {ca: str(tmp_path / "absent.pem")},
                2,
                "cannot be used (No such file or directory)",
            ),
            (tls | {ca: str(small)}, 2, "cannot be used ("),
            (
                tls | {ca: other[ca]},
                4,
                "reject each other's TLS certificates (certificate verify failed",
            ),
            (other | {ca: tls[ca]}, 4, "reject each other's TLS certificates ("),
        ):
            running = start(small.parent, file, "--quiet", **more)
            stderr = running.communicate(timeout=60)[1]
            assert running.returncode == code and stderr.count("\n") == 1 and words in stderr, (
                stderr
            )
        running = start(small.parent, file, **tls)
        stderr = running.communicate(timeout=180)[1]
        assert running.returncode == 0 and "computed 6, reused 0 of 6 blocks" in stderr, stderr
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()
    xr.testing.assert_equal(
        *(xr.load_dataset(path).drop_attrs() for path in (surveyed, small.with_suffix(".nc")))
    )


@pytest.mark.slow
def test_an_expired_certificate_is_reported_in_one_line(small, tmp_path):
    if not shutil.which("openssl"):
        pytest.skip("needs openssl")
    expired = certificate(tmp_path, "old", days=-1)
    file = tmp_path / "scheduler.json"
    scheduler = (
        "scheduler",
        "--protocol",
        "tls",
        "--scheduler-file",
        file,
        "--port",
        0,
        "--no-dashboard",
    )
    process = dask(*scheduler, cwd=tmp_path, **expired)
    try:
        wait_for(file.exists)
        running = start(small.parent, file, "--quiet", **expired)
        stderr = running.communicate(timeout=60)[1]
    finally:
        process.kill()
        process.wait()
    assert running.returncode == 4 and stderr.count("\n") == 1, stderr
    assert "renew the one that has expired" in stderr, stderr


def test_blocks_travel_where_no_folder_is_shared(small, tmp_path):
    checked = workflow.read(small, output=tmp_path / "o.nc")
    with Blocks(checked.path, fingerprint.fingerprint(checked)) as kept:
        blocks = cost.blocks_of(checked)
        job = engine.Job(
            checked.scene, checked.request, checked.grid, kept, fingerprint.code_version()
        )
        first = engine.numbered(0, blocks[0])
        far = pickle.loads(pickle.dumps(kept))
        assert far.folder.is_absolute()
        assert job(first).content is None and kept.done() == {0}
        os.rename(kept.folder, tmp_path / "elsewhere")  # as a worker sees it that has another disk
        content = dataclasses.replace(job, kept=far)(first).content
        os.rename(tmp_path / "elsewhere", kept.folder)
        whole = (kept.folder / "00000000.block").read_bytes()
        assert content == whole
        kept.save_packed(0, content)
        assert kept.intact() == {0}


@pytest.mark.slow
def test_workers_that_see_another_disk_send_their_blocks(scheduler, small, surveyed):
    """Their own empty disk hides the folder of the run."""
    file, processes = scheduler
    away = file.parent / "work"
    away.mkdir()
    (away / small.name).write_text(small.read_text())
    if subprocess.run(
        ["unshare", "-m", "mount", "-t", "tmpfs", "none", away], capture_output=True
    ).returncode:
        pytest.skip("needs the right to mount a small tmpfs")
    hidden = ("unshare", "-m", "sh", "-c", f'mount -t tmpfs none "{away}" && exec "$0" "$@"')
    processes += [worker(file, before=hidden) for _ in range(2)]
    stderr = start(away, file).communicate(timeout=180)[1]
    assert "computed 6, reused 0 of 6 blocks" in stderr, stderr
    assert reading.check(away / "small.nc") == []
    xr.testing.assert_equal(
        *(xr.load_dataset(path).drop_attrs() for path in (surveyed, away / "small.nc"))
    )


@pytest.mark.slow
def test_a_cluster_with_an_edited_survey_is_refused(scheduler, small):
    file, processes = scheduler
    shutil.copytree(Path(survey.__file__).parent, file.parent / "other" / "survey")
    with open(file.parent / "other" / "survey" / "kernels" / "sines.py", "a") as source:
        source.write("\n# edited\n")
    processes.append(worker(file, PYTHONPATH=str(file.parent / "other")))
    running = start(small.parent, file, "--quiet")
    stderr = running.communicate(timeout=180)[1]
    assert (
        running.returncode == 4
        and stderr.count("\n") == 1
        and "runs different code (sources: " in stderr
    ), stderr


@pytest.mark.parametrize(
    "other, words",
    [
        (
            {"sources": "other"},
            r"runs different code \(sources: \w+, this run: other\); install the same survey",
        ),
        ({fingerprint.FUSED: not HAS_FMA}, "fused multiply-adds, .* resume without this worker"),
    ],
)
def test_a_worker_with_other_code_is_refused(small, tmp_path, other, words):
    checked = workflow.read(small, output=tmp_path / "o.nc")
    job = engine.Job(
        checked.scene,
        checked.request,
        checked.grid,
        None,
        fingerprint.code_version() | other,
    )
    with pytest.raises(Stopped, match=words):
        job(engine.numbered(0, cost.blocks_of(checked)[0]))


def queue(folder, *words, **more):
    """The batch script as a queue would start it on one machine, with stand-ins for the queue's own
    commands.
    """
    commands = folder / "bin"
    commands.mkdir(exist_ok=True)
    for name, text in {"srun": 'exec "$@"', "scontrol": 'echo "$@" > requeued'}.items():
        (commands / name).write_text(f"#!/bin/sh\n{text}\n")
        (commands / name).chmod(0o755)
    path = os.pathsep.join([str(commands), os.path.dirname(sys.executable), os.environ["PATH"]])
    script = Path(__file__).parents[2] / "workflows" / "slurm.sh"
    environment = os.environ | {"PATH": path, "SLURM_JOB_ID": "17"} | more
    command = ["bash", str(script), "small.toml", *words]
    return subprocess.Popen(command, cwd=folder, env=environment, stderr=subprocess.PIPE, text=True)


def test_the_batch_script_says_what_is_missing_instead_of_waiting(small):
    running = queue(small.parent, PATH="/usr/bin:/bin")
    stderr = running.communicate(timeout=60)[1]
    assert running.returncode == 3 and "is not on PATH: activate the environment" in stderr


@pytest.mark.slow
def test_the_batch_script_runs_a_sweep(small, surveyed):
    running = queue(small.parent)
    stderr = running.communicate(timeout=180)[1]
    assert running.returncode == 0, stderr
    xr.testing.assert_equal(
        *(xr.load_dataset(path).drop_attrs() for path in (surveyed, small.with_suffix(".nc")))
    )
    assert not list(small.parent.glob("scheduler-*")) and not (small.parent / "requeued").exists()


@pytest.mark.slow
def test_the_batch_script_takes_the_settings_of_tls(small, tmp_path, surveyed):
    if not shutil.which("openssl"):
        pytest.skip("needs openssl")
    running = queue(
        small.parent,
        **certificate(tmp_path, "survey"),
        DASK_DISTRIBUTED__COMM__DEFAULT_SCHEME="tls",
    )
    file = small.parent / "scheduler-17.json"
    wait_for(lambda: file.exists() and "tls://" in file.read_text())
    stderr = running.communicate(timeout=180)[1]
    assert running.returncode == 0, stderr
    xr.testing.assert_equal(
        *(xr.load_dataset(path).drop_attrs() for path in (surveyed, small.with_suffix(".nc")))
    )


@pytest.mark.slow
def test_the_batch_script_stops_before_the_walltime_and_is_queued_again(small):
    many = ("--set", "axes.w0.num=10000", "--set", "solver.method='dop853'")
    running = queue(small.parent, *many)
    blocks = small.parent / "small.nc.blocks"
    wait_for(lambda: list(blocks.glob("*.block")))
    running.terminate()
    stderr = running.communicate(timeout=60)[1]
    assert running.returncode == 143 and "finished blocks are safe" in stderr, stderr
    assert (small.parent / "requeued").read_text() == "requeue 17\n" and list(
        blocks.glob("*.block")
    )
