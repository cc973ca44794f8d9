"""The program runs where Python has not what only POSIX has: Windows, as nearly as a POSIX system
can play it.

There are no such modules and functions; folders are not opened, files that are open neither removed
nor replaced; pipes and texts know few characters.
"""

import json
import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(
    not os.path.isdir("/proc/self/fd"), reason="what is open is looked up in /proc"
)

LACKING = """
import errno, os, shutil, signal, sys, tempfile, warnings

import filelock, platformdirs  # these know both kinds of systems, and look once which they are on

platformdirs.user_cache_dir("survey")
for name in ("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty"):
    sys.modules[name] = None
free, statvfs = shutil.disk_usage, os.statvfs
shutil.disk_usage = lambda path: shutil._ntuple_diskusage(*(
    found.f_frsize * blocks for found in [statvfs(path)]
    for blocks in (found.f_blocks, found.f_blocks - found.f_bfree, found.f_bavail)))
for name in (
    "O_CLOEXEC", "O_DIRECTORY", "O_NOFOLLOW", "chown", "fchmod", "fchown", "fork", "forkpty", "fpathconf",
    "fstatvfs", "getegid", "geteuid", "getgid", "getloadavg", "getpgid", "getuid", "killpg", "lchown", "mkfifo",
    "pathconf", "posix_fallocate", "pread", "preadv", "pwrite", "pwritev", "readv", "sched_getaffinity", "setsid",
    "statvfs", "sync", "writev",
):
    vars(os).pop(name, None)
os.process_cpu_count = os.cpu_count  # from Python 3.13 on; elsewhere it asks for no affinity
for name in ("SIGHUP", "SIGUSR1", "alarm", "pthread_kill", "pthread_sigmask", "setitimer", "sigwait"):
    vars(signal).pop(name, None)
os.supports_fd.clear()
os.supports_dir_fd.clear()
shutil._use_fd_functions = False
tempfile.TemporaryFile = tempfile.NamedTemporaryFile


def is_open(path):
    for number in os.listdir("/proc/self/fd"):
        try:
            if os.path.samestat(os.stat(f"/proc/self/fd/{number}"), os.stat(path)):
                return True
        except OSError:
            pass
    return False


def strict(call, paths):
    def called(*given, **named):
        for path in given[:paths]:
            if not isinstance(path, int) and os.path.isfile(path) and is_open(path):
                raise PermissionError(errno.EACCES, "The process cannot access the file", os.fspath(path))
        return call(*given, **named)

    return called


os.unlink = os.remove = strict(os.unlink, 1)
os.replace, os.rename = strict(os.replace, 2), strict(os.rename, 2)
opened = os.open


def open_file(path, flags, *given, **named):
    if os.path.isdir(path):
        raise PermissionError(errno.EACCES, "Permission denied", path)
    return opened(path, flags, *given, **named)


os.open = open_file
utime = os.utime


def utime_of_path(path, *given, **named):
    if isinstance(path, int):
        raise TypeError("utime: path should be string, not int")
    return utime(path, *given, **named)


os.utime = utime_of_path
warnings.filterwarnings("ignore", category=EncodingWarning)
warnings.filterwarnings("error", category=EncodingWarning, module="survey")
"""

WORKFLOW = """
scene = "mathieu"
[axes]
a = { start = 0.5, stop = 3.0, num = 6 }
q = { start = 0.1, stop = 2.0, num = 5 }
[output]
path = "map.nc"
figures = ["verdict"]
"""

PROGRAM = """
import sys
from survey import cli
codes = []
def call(*words):
    try:
        cli.main(list(words))
    except SystemExit as ended:
        codes.append(ended.code)
call("plan", "map.toml")
call("run", "map.toml")
call("run", "map.toml")
call("run", "map.toml", "--set", "axes.a.num=7", "--fresh")
call("verify", "map.nc", "--points", "5")
call("info", "map.nc")
call("plot", "map.nc", "--var", "exponent", "-o", "exponent.png")
call("bundle", "map.nc", "-o", "map.zip")
call("scenes", "gyrostat")
import survey
ds = survey.evaluate("satellite", k=[0.1, 0.5], rho=1.0)
codes.append(int((ds.status != 0).sum()))
print("codes:", codes)
"""


@pytest.fixture
def start(tmp_path):
    """Starts Python on such a system, in a folder with a workflow."""
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "sitecustomize.py").write_text(LACKING)
    (tmp_path / "map.toml").write_text(WORKFLOW)
    search = os.pathsep.join([str(tmp_path / "site"), *(path for path in sys.path if path)])
    own = {"PYTHONPATH": search, "PYTHONIOENCODING": "cp1252:strict", "PYTHONWARNDEFAULTENCODING": "1", "NO_COLOR": "1",
           "MPLBACKEND": "agg"}  # fmt: skip

    def start(*words):
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        command = [sys.executable, *words]
        return subprocess.Popen(
            command, cwd=tmp_path, env=os.environ | own, text=True, encoding="cp1252", **pipes
        )

    return start


def test_the_commands_do_what_they_do_elsewhere(start, tmp_path):
    said = start("-c", PROGRAM).communicate(timeout=300)[0]
    assert "codes: [0, 0, 0, 0, 0, 0, 0, 0, 0, 0]" in said, said
    assert "Traceback" not in said and "already complete" in said
    assert {file.name for file in tmp_path.glob("map.*")} >= {
        "map.nc",
        "map.nc.sha256",
        "map.png",
        "map.zip",
    }
    assert not (tmp_path / "map.nc.blocks").exists() and not (tmp_path / "map.nc.lock").exists()


HOLDER = """
import json, os, socket, time
from survey.file import lock
held = lock.Lock("map.nc.lock", {"host": socket.gethostname(), "pid": os.getpid()})
held.acquire()
print("held", flush=True)
time.sleep(60)
"""


@pytest.mark.slow
def test_a_second_run_learns_whose_the_lock_is_and_a_killed_one_frees_it(start, tmp_path):
    holder = start("-c", HOLDER)
    assert holder.stdout.readline() == "held\n"
    said = start("-m", "survey", "run", "map.toml").communicate(timeout=120)[0]
    assert (
        "another run is writing it (host" in said
        and f"pid {holder.pid})" in said
        and said.count("\n") == 1
    )
    holder.kill()
    holder.communicate()
    assert json.loads((tmp_path / "map.nc.lock").read_text())["pid"] == holder.pid
    again = start("-m", "survey", "run", "map.toml", "--workers", "2")
    said = again.communicate(timeout=300)[0]
    assert again.returncode == 0 and not (tmp_path / "map.nc.lock").exists(), said
