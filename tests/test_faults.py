"""The real program meets an error, or a kill, at each call that writes, in turn; and a read-only disk."""

import subprocess
import sys

import pytest
import xarray as xr

from survey import store

SWEEP = """
scene = "gyrostat"
[options]
question = "trajectory"
[axes]
w0   = { start = 0.5, stop = 2.0, num = 20 }
phi0 = { start = 0.5, stop = 2.0, num = 20 }
t    = 2
b12  = 0.7
d    = 1.1
[output]
path = "sweep.nc"
"""
# the program with several blocks; its AT-th call that writes fails, or is its last; it tells the number of calls
PROGRAM = """
import builtins, os, signal, sys
at, what = int(sys.argv.pop(1)), sys.argv.pop(1)
from survey import engine, store
engine.BLOCK_POINTS = 100
calls = 0
def failing(real, writes=lambda *given: True):
    def call(*given, **named):
        global calls
        calls += writes(*given)
        if calls == at and writes(*given):
            if what == "kill":
                os.kill(os.getpid(), signal.SIGKILL)
            raise OSError(28, "No space left on device")
        return real(*given, **named)
    return call
for where, name in ((os, "fsync"), (os, "replace"), (store, "pack"), (store.Output, "put"), (store, "define")):
    setattr(where, name, failing(getattr(where, name)))
store.open = failing(builtins.open, lambda path, how="r": "b" in how and how != "rb")
from survey.cli import main
try:
    main()
finally:
    print(calls)
"""


def run(folder, at=0, what="none", *words):
    command = [sys.executable, "-c", PROGRAM, str(at), what, "run", "sweep.toml", "--quiet", *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=120)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """(the dataset of a run that nothing disturbed, its number of calls that write)."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "sweep.toml").write_text(SWEEP)
    for _ in range(2):  # the first may compile, and writes the kernels too
        done = run(folder)
        assert done.returncode == 0, done.stderr
    return xr.load_dataset(folder / "sweep.nc").drop_attrs(), int(done.stdout)


@pytest.mark.parametrize("what", ["error", "kill"])
@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_fault_at_a_call_that_writes_loses_nothing(whole, tmp_path, what, every):
    """Short: in the middle, and at the last ones, which publish; long: at each."""
    unbroken, calls = whole
    assert calls > 40
    some = {"error": [calls // 2, calls], "kill": [calls - 4, calls - 1]}[what]
    for at in range(1, calls + 1) if every else some:
        folder = tmp_path / str(at)
        folder.mkdir()
        (folder / "sweep.toml").write_text(SWEEP)
        path = folder / "sweep.nc"
        broken = run(folder, at, what)
        assert broken.returncode == {"error": 4, "kill": -9}[what], (at, broken.stderr)
        assert what == "kill" or (broken.stderr.count("\n") == 1 and "No space left" in broken.stderr), broken.stderr
        assert not path.exists() or store.check(path) == []
        left = set(folder.rglob("*"))
        assert what == "kill" or not [file for file in left if file.name.endswith((".part", "output.nc"))], left
        done = run(folder)
        assert done.returncode == 0 and store.check(path) == [], (at, done.stderr)
        xr.testing.assert_equal(xr.load_dataset(path).drop_attrs(), unbroken)
        assert {file.name for file in folder.iterdir()} == {"sweep.toml", "sweep.nc", "sweep.nc.sha256"}, at


def test_a_disk_that_is_read_only_stops_the_run_before_any_work(tmp_path):
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=20m", "none", disk], capture_output=True).returncode:
        pytest.skip("needs the right to mount a small tmpfs")
    try:
        (disk / "sweep.toml").write_text(SWEEP)
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        refused = run(disk)
        assert refused.returncode == 4 and refused.stderr.count("\n") == 1, refused.stderr
        assert "is read-only" in refused.stderr and list(disk.iterdir()) == [disk / "sweep.toml"]
        subprocess.run(["mount", "-o", "remount,rw", disk], check=True)
        assert run(disk).returncode == 0
    finally:
        subprocess.run(["umount", disk], check=True)
