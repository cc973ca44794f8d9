"""A small real survey that several tests look at, and the program as a user runs it."""

import gc
import os
import re
import shutil
import subprocess
import sys

import hypothesis
import pytest
from numba.core.dispatcher import Dispatcher

SMALL = """
title  = "A small survey"
scene  = "gyrostat"
[options]
question = "trajectory"
[axes]
w0  = { start = 0.5, stop = 2.0, num = 6 }
t   = { start = 0.0, stop = 3.0, num = 4 }
phi0 = 1.5
b12 = 0.7
b31 = -0.4
d   = 1.1
s2  = 0.5
[solver]
rtol = 1e-9
[output]
path    = "small.nc"
figures = ["w"]
"""

# what they try is signals, links, pipes, modes, shells and mounts of POSIX
if sys.platform == "win32":
    collect_ignore = [
        "test_files_from_others.py",
        "test_promises.py",
        "test_readme.py",
        "request/test_trust.py",
        "sweep/test_cluster.py",
        "sweep/test_faults.py",
    ]

# Tests of one family run in one worker, before all others, so that two workers seldom compile the
# same kernels. (xdist's groups by marks do not work with pytest 9.)
FAMILIES = {
    "cylinder": "cylinder|gyrostat|(?<!l)abel|(?<!work)(?<!over)flow|junction",
    "hill": "hill|satellite|mathieu|taylor16|user_scene|damped|test_lie",
    "nutation": "nutation|brun",
    "libration": "libration|danby",
    "floquet": "floquet|orbit|own_systems",
}


def _group(nodeid):
    """The family of a test, or its file."""
    name = nodeid.removeprefix("tests/").lower()
    return next(
        (family for family, words in FAMILIES.items() if re.search(words, name)),
        name.partition("::")[0],
    )


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    from xdist.scheduler import LoadScopeScheduling

    class ByFamily(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            return _group(nodeid)

    return ByFamily(config, log)


def pytest_collection_modifyitems(items):
    """Families first, then the largest files."""
    groups = {}
    for item in items:
        groups.setdefault(_group(item.nodeid), []).append(item)
    order = [
        *FAMILIES,
        *sorted(groups.keys() - FAMILIES, key=lambda name: (-len(groups[name]), name)),
    ]
    items[:] = [item for name in order for item in groups.get(name, [])]


hypothesis.settings.register_profile("untimed", deadline=None)
hypothesis.settings.load_profile("untimed")
gc.set_threshold(100_000)  # as the program does: a tenth of the time in which kernels are compiled
# Coverage's tracer would look at each line of numba's compiler: a kernel takes half as long again
# with it.
_compile = Dispatcher.compile


def _compile_untraced(self, sig):
    tracer = sys.gettrace()
    sys.settrace(None)
    try:
        return _compile(self, sig)
    finally:
        sys.settrace(tracer)


Dispatcher.compile = _compile_untraced


@pytest.fixture(autouse=True, scope="session")
def state(tmp_path_factory):
    """A state folder of the tests' own, in processes that they start too: no test learns what the
    user has run.
    """
    folder = tmp_path_factory.mktemp("state")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(folder))
        yield folder


@pytest.fixture
def program(tmp_path):
    """Run `survey` in an empty folder; returns the finished process with its output as text."""

    def run(*arguments, **keywords):
        command = [sys.executable, "-m", "survey", *map(str, arguments)]
        environment = os.environ | keywords.pop("env", {})
        return subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, env=environment, **keywords
        )

    run.folder = tmp_path
    return run


@pytest.fixture
def small(tmp_path):
    """The path of a small workflow."""
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    return path


@pytest.fixture(scope="session")
def surveyed(tmp_path_factory):
    """The path of the small survey's netCDF file, run once."""
    import survey

    folder = tmp_path_factory.mktemp("surveyed")
    (folder / "small.toml").write_text(SMALL)
    survey.run(folder / "small.toml", output=folder / "small.nc")
    return folder / "small.nc"


@pytest.fixture
def ran(small, surveyed):
    """The path of the small workflow's netCDF file, as if it had been run in that folder."""
    for name in ("small.nc", "small.nc.sha256"):
        shutil.copy(surveyed.with_name(name), small.parent)
    return small.with_suffix(".nc")


@pytest.fixture(autouse=True)
def closed_figures():
    """Close the figures that a test has left open, as the end of a notebook's cell does."""
    yield
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close("all")
