"""The real program is killed, or meets an error, at each call that reaches its output's folder; and
a read-only disk.

A small library (faults.c) preloaded into it counts its calls of write, fsync, rename, unlink, open
and their like, those of its worker processes too, and makes the n-th of them the last one or fail.
"""

import ctypes
import json
import mmap
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import xarray as xr

from survey.file import reading

SWEEP = """
scene = "mathieu"
[axes]
a = { start = 0.5, stop = 3.0, num = 4 }
q = { start = 0.1, stop = 2.0, num = 4 }
[output]
variables = ["verdict"]
"""
BESIDE = """
[boundaries]
axis = "a"
[refine]
width = 0.2
"""
# The program with two blocks, again and again, each time in a process of its own: a copy of this
# one, which has imported and compiled what it needs, but opened no file and started no thread.
SERVER = """
import json, os, sys
import dask.multiprocessing, dask.threaded, psutil
from survey import cli
from survey.file import labels, lock, netcdf, tiles
from survey.request import workflow
from survey.sweep import boundaries, cost, dispatch, edges_and_cells, engine, progress, refine, solve
cost.BLOCK_POINTS = 8
labels.provenance()
on_threads = dispatch.on_threads
dispatch.on_threads = lambda task, numbers, finished=lambda *_: None, threads=None: list(map(task, numbers))
for path in sys.argv[2:]:
    read = workflow.read(path)
    solve.compute(read.grid, read.scene, read.request)
    edges_and_cells.find(read, lambda name, make: make())
dispatch.on_threads = on_threads
for line in sys.stdin:
    given = json.loads(line)
    process = os.fork()
    if not process:
        break
    print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)
else:
    sys.exit()
for number, name in enumerate((os.devnull, "stdout", "stderr")):
    os.dup2(os.open(name, os.O_RDWR | os.O_CREAT | os.O_TRUNC), number)
sys.argv[1:] = given["words"]
with open(os.environ["FAULTS_TABLE"], "r+b") as table:
    table.seek(given["place"])
    table.write(os.getpid().to_bytes(4, sys.byteorder))
cli.main()
"""
ERRORS = {"kill": 0, "EIO": 5, "ENOSPC": 28}


class Table(ctypes.Structure):
    """As in faults.c."""

    _fields_ = [(name, ctypes.c_int) for name in ("calls", "at", "met", "error", "ever", "killed")]


class Faults:
    """Runs of the program in an empty folder; the library counts what reaches the folder `out`."""

    def __init__(self, folder, library):
        self.folder, self.out, self.log = folder, folder / "out", folder / "log"
        (folder / "plain.toml").write_text(SWEEP)
        (folder / "beside.toml").write_text(SWEEP + BESIDE)
        (folder / "table").write_bytes(bytes(ctypes.sizeof(Table)))
        with open(folder / "table", "r+b") as file:
            self.table = Table.from_buffer(mmap.mmap(file.fileno(), 0))
        settings = {"TABLE": folder / "table", "FOLDER": self.out, "LOG": self.log}
        environment = {key: value for key, value in os.environ.items() if not key.startswith("COV")}
        environment |= {f"FAULTS_{key}": str(value) for key, value in settings.items()} | {
            "LD_PRELOAD": str(library)
        }
        words = [sys.executable, "-c", SERVER, "", "plain.toml", "beside.toml"]
        self.server = subprocess.Popen(
            words,
            cwd=folder,
            env=environment,
            text=True,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        self.known = {}

    def run(self, words, at=0, error=0, ever=False):
        """(exit code, stderr, what the at-th call was) of the command."""
        for name, value in (("calls", 0), ("at", at), ("met", 0), ("error", error), ("ever", ever)):
            setattr(self.table, name, value)
        self.log.write_bytes(b"")
        given = {
            "words": ["run", *words, "-o", "out/sweep.nc", "--quiet"],
            "place": Table.killed.offset,
        }
        print(json.dumps(given), file=self.server.stdin, flush=True)
        code = int(self.server.stdout.readline())
        calls = self.log.read_text().splitlines()
        call = next((line for line in calls if line.startswith(f"{at} ")), "")
        return code, (self.folder / "stderr").read_text(), call

    def whole(self, words):
        """(dataset, calls) of a run that nothing disturbs."""
        if words not in self.known:
            self.empty()
            code, stderr, _ = self.run(words)
            assert code == 0, stderr
            self.known[words] = self.sound(), self.log.read_text().splitlines()
        return self.known[words]

    def empty(self):
        shutil.rmtree(self.out, ignore_errors=True)
        self.out.mkdir()

    def sound(self):
        """The dataset of the output, which has no complaints and nothing beside it but its digest."""
        assert {file.name for file in self.out.iterdir()} == {"sweep.nc", "sweep.nc.sha256"}
        assert reading.check(self.out / "sweep.nc") == []
        lines = (self.out / "sweep.nc.sha256").read_text().splitlines()
        assert len(lines) == 1 and lines[0].endswith("  sweep.nc")
        return xr.load_dataset(self.out / "sweep.nc").drop_attrs()

    def meet(self, words, at, what, ever=False):
        """A fault at the at-th call, and one resume, on threads."""
        unbroken, _ = self.whole(words)
        self.empty()
        code, stderr, call = self.run(words, at, ERRORS[what], ever)
        where = f"{what} at {call or at}: {stderr}"
        path = self.out / "sweep.nc"
        assert self.table.met or self.table.calls < at, where
        if not self.table.met:  # threads take turns: this time there were fewer calls
            assert code == 0, where
        elif what == "kill":
            assert code == -9, where
        elif code == 0:  # what cannot be read is read or worked out again
            assert " read " in call and not stderr, where
        else:
            assert code == 4 and re.fullmatch(r"survey: .*out/sweep\.nc.*\n", stderr), where
            assert os.strerror(ERRORS[what]) in stderr, where
        if code == 0:
            xr.testing.assert_equal(self.sound(), unbroken)
        elif path.exists():
            assert reading.check(path) == [], where
        code, stderr, _ = self.run(words[:1])
        assert code == 0, f"{where}; then {stderr}"
        xr.testing.assert_equal(self.sound(), unbroken)


@pytest.fixture(scope="module")
def faults(tmp_path_factory):
    compiler, folder = shutil.which("cc"), tmp_path_factory.mktemp("faults")
    if compiler is None or sys.platform != "linux":
        pytest.skip("needs a C compiler and Linux")
    library, source = folder / "faults.so", Path(__file__).with_name("faults.c")
    subprocess.run([compiler, "-O1", "-shared", "-fPIC", "-o", library, source, "-ldl"], check=True)
    faults = Faults(folder, library)
    yield faults
    faults.server.stdin.close()
    assert faults.server.wait(20) == 0
    faults.server.stdout.close()


def _published(calls):
    """The number of the call that publishes the output."""
    return next(
        number for number, line in enumerate(calls, 1) if "rename" in line and "output.nc" in line
    )


@pytest.mark.slow
def test_a_kill_at_any_call_from_the_publication_on_leaves_what_the_next_run_removes(faults):
    words = ("plain.toml",)
    calls = faults.whole(words)[1]
    for at in range(_published(calls), len(calls) + 1):
        faults.meet(words, at, "kill")


@pytest.mark.slow
def test_an_error_at_a_call_of_each_kind_is_one_line(faults):
    """Of several calls that do the same with files of the same use, one from the middle."""
    words, kinds = ("plain.toml",), {}
    for number, line in enumerate(faults.whole(words)[1], 1):
        _, call, path = line.split(" ")
        kinds.setdefault((call, re.sub(r"\d+|\.[a-z0-9.]+(?=\.part)", "", path)), []).append(number)
    for some in kinds.values():
        faults.meet(words, some[len(some) // 2], "EIO")


@pytest.mark.slow
@pytest.mark.parametrize("what", ERRORS)
@pytest.mark.parametrize("workers", [(), ("--workers", "2")], ids=["threads", "processes"])
@pytest.mark.parametrize("name", ["plain.toml", "beside.toml"])
def test_a_fault_at_any_call_loses_nothing(faults, name, workers, what):
    """ENOSPC: at all later calls too."""
    words = (name, *workers)
    for at in range(1, len(faults.whole(words)[1]) + 3):
        faults.meet(words, at, what, ever=what == "ENOSPC")


def test_a_disk_that_is_read_only_stops_the_run_before_any_work(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=20m", "none", disk], capture_output=True
    ).returncode:
        pytest.skip("needs the right to mount a small tmpfs")
    try:
        (disk / "plain.toml").write_text(SWEEP)
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        command = [sys.executable, "-m", "survey", "run", "plain.toml", "--quiet"]
        refused = subprocess.run(command, cwd=disk, capture_output=True, text=True, timeout=120)
        assert refused.returncode == 4 and refused.stderr.count("\n") == 1, refused.stderr
        assert "is read-only" in refused.stderr and list(disk.iterdir()) == [disk / "plain.toml"]
        subprocess.run(["mount", "-o", "remount,rw", disk], check=True)
        subprocess.run(command, cwd=disk, check=True, timeout=120)
    finally:
        subprocess.run(["umount", disk], check=True)
