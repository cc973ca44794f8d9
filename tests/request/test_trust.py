"""A scene's file that a stranger's survey names runs when this user has run it here before, or says
so; else never.
"""

import os
import pty
import re
import select
import stat
import subprocess
import sys
import time

import hostile
import netCDF4
import numpy as np
import pytest

import survey
from survey.errors import BadInput, Untrusted
from survey.request import earlier, trust, user_scene, workflow

AT = {"a": 1.0, "q": 0.5}


@pytest.fixture
def strange(tmp_path, monkeypatch):
    """A stranger's survey with its scene beside it, for a user who has run nothing yet; `ran`: did
    its scene?
    """
    (tmp_path / "files").mkdir()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr(trust, "_allowed", set())
    monkeypatch.setattr(trust, "_kept", set())
    user_scene._from_text.cache_clear()  # what has run in this process need not run again
    sentinel = hostile.base(tmp_path / "files")

    class Strange:
        path, file, state = (
            tmp_path / "files/base.nc",
            tmp_path / "files/evil.py",
            tmp_path / "state/survey/scenes",
        )

        @property
        def ran(self):
            return sentinel.exists()

    return Strange()


def verify(strange, *words, **given):
    words = [sys.executable, "-m", "survey", "verify", strange.path, "--points", "1", *words]
    return subprocess.run(words, capture_output=True, text=True, stdin=subprocess.DEVNULL, **given)


def test_nothing_of_a_strange_survey_runs(strange):
    ds = survey.open(strange.path)
    assert "a Python file that you have not run here before" in repr(ds.survey.point(**AT))
    (
        ds.survey.areas(),
        ds.survey.boundary(),
        ds.survey.map(),
        ds.survey.compare(ds),
        repr(ds.survey),
        ds._repr_html_(),
    )
    for ask in (lambda: ds.survey.trajectory(**AT), lambda: ds.survey.zoom(a=(0.0, 1.0), num=2)):
        with pytest.raises(
            Untrusted, match=r"--trust-scene, or in Python survey\.open\(path, trust_scene=True\)"
        ) as refused:
            ask()
        assert "\n" not in str(refused.value)
    hostile.page(strange.path)
    assert not strange.ran


def test_a_strange_survey_whose_points_are_taken_over_runs_nothing(strange, monkeypatch):
    """Its workflow names the file too, and ours another scene, or its text with a change."""
    monkeypatch.chdir(strange.path.parent)
    with netCDF4.Dataset(strange.path, "a") as file:
        file.workflow = file.workflow.replace('"mathieu"', '"evil.py"')
        assert "evil.py" in file.workflow
    hostile.digest(strange.path)
    axes = {"a": {"start": 0.5, "stop": 9.5, "num": 4}, "q": {"start": 0.0, "stop": 5.0, "num": 3}}
    ours = workflow.check({"scene": "mathieu", "axes": axes}, output="new.nc")
    held, told = earlier.find(ours, strange.path)
    assert held is None and "another scene ('evil.py', not 'mathieu')" in told and not strange.ran
    text = strange.file.read_text()
    strange.file.write_text(text.replace("\nopen(", "\n# open("))
    own = workflow.check({"scene": "evil.py", "axes": axes}, output="new.nc")
    strange.file.write_text(text)
    held, told = earlier.find(own, strange.path)
    assert held is None and "a different text of your own scene" in told and not strange.ran


def test_verify_checks_what_needs_no_scene_and_says_how_to_go_on(strange):
    done = verify(strange)
    assert done.returncode == 2 and done.stdout.endswith(
        "base.nc: sound; no points were solved again\n"
    ), done.stderr
    assert "--trust-scene" in done.stderr and done.stderr.count("\n") == 1 and not strange.ran
    allowed = verify(strange, "--trust-scene")
    assert (
        allowed.returncode == 0 and "1 point" in allowed.stdout and "solved again" in allowed.stdout
    ), allowed.stderr
    assert strange.ran
    assert verify(strange).returncode == 2, "it was allowed once, not for good"


def test_a_survey_that_is_opened_in_trust_is_solved(strange):
    ds = survey.open(strange.path, trust_scene=True)
    assert not strange.ran
    assert ds.survey.trajectory(figure=False, **AT).sizes["u"] > 10 and strange.ran
    with pytest.warns(UserWarning, match="beyond the map's"):
        assert ds.survey.zoom(a=(0.0, 1.0), q=(0.1, 0.5), num=2).verdict.shape == (2, 2)
    assert not strange.state.exists(), "what was allowed once is not kept"


def test_who_has_run_the_text_before_is_not_asked(strange):
    survey.evaluate(strange.file, **AT)
    (kept,) = strange.state.iterdir()
    assert (
        stat.S_IMODE(strange.state.stat().st_mode) == 0o700
        and stat.S_IMODE(kept.stat().st_mode) == 0o600
    )
    code = "import sys, survey; from survey.request.user_scene import of_dataset; "
    code += "print(of_dataset(survey.open(sys.argv[1])).NAME)"
    done = subprocess.run(
        [sys.executable, "-c", code, strange.path], capture_output=True, text=True
    )
    assert done.stdout == f"{strange.file}\n", done.stderr  # another process
    text = strange.file.read_text()
    strange.file.write_text(text + "\n")
    with pytest.raises(BadInput, match="has changed since"):
        user_scene.of_dataset(survey.open(strange.path))
    strange.file.write_text(text.replace("\n", "\r\n"))  # an end of line is no other text
    assert survey.open(strange.path).survey.trajectory(figure=False, **AT)


def test_a_state_folder_that_others_can_write_is_not_believed(strange):
    digest = survey.open(strange.path).attrs["scene_hash"]
    strange.state.mkdir(parents=True, mode=0o700)
    (strange.state / digest).touch(mode=0o600)
    assert trust.known(digest)
    for path, mode in ((strange.state, 0o777), (strange.state, 0o720)):
        path.chmod(mode)
        assert not trust.known(digest)
    strange.state.chmod(0o700)
    (strange.state / digest).chmod(0o666)
    assert not trust.known(digest)
    (strange.state / digest).unlink()
    (strange.state / digest).symlink_to(strange.file)
    assert not trust.known(digest) and not trust.known("../../x") and not trust.known("")


@pytest.mark.parametrize("home", ["relative", "/proc/none", "/dev/null/x"])
def test_without_a_home_to_write_a_run_goes_on_and_a_stranger_is_not_trusted(
    strange, home, monkeypatch, tmp_path
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", home)
    # where platformdirs looks instead of a relative folder
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    digest = survey.open(strange.path).attrs["scene_hash"]
    (tmp_path / "relative/survey/scenes").mkdir(parents=True)
    # a stranger's folder, as it may be unpacked
    (tmp_path / "relative/survey/scenes" / digest).touch()
    assert not trust.known(digest)
    trust.keep(digest)
    assert trust.known(digest)


def test_many_processes_keep_hashes_at_once(strange):
    code = (
        "import sys; from survey.request import trust; [trust.keep(f'{i:064x}') for i in range(50)]"
    )
    for process in [subprocess.Popen([sys.executable, "-c", code]) for _ in range(3)]:
        assert process.wait(60) == 0
    assert len(list(strange.state.iterdir())) == 50 and trust.known(f"{49:064x}")


def test_what_is_hashed_is_what_runs(strange, monkeypatch):
    """A file that changes between two readings: there is only one."""
    digest = survey.open(strange.path, trust_scene=True).attrs["scene_hash"]
    read, texts = user_scene._read, []

    def counted(*given):
        texts.append(read(*given))
        strange.file.write_text("raise SystemExit")
        return texts[-1]

    monkeypatch.setattr(user_scene, "_read", counted)
    assert user_scene.of_dataset(survey.open(strange.path)).HASH == digest and len(texts) == 1
    strange.file.write_text(texts[0][1])


@pytest.mark.parametrize("make", ["fifo", "device", "folder", "large", "link"])
def test_a_scene_that_is_no_small_file_is_not_read(strange, make):
    text = strange.file.read_text()
    strange.file.unlink()
    if make == "fifo":
        os.mkfifo(strange.file)
    elif make == "device":
        strange.file.symlink_to("/dev/zero")
    elif make == "folder":
        strange.file.mkdir()
    elif make == "large":
        with open(strange.file, "wb") as file:
            file.truncate(10**12)
    else:
        (strange.file.parent.parent / "elsewhere.py").write_text(text)
        strange.file.symlink_to(strange.file.parent.parent / "elsewhere.py")
    ds = survey.open(strange.path)
    began = time.monotonic()
    with pytest.raises(
        BadInput, match="not run here before" if make == "link" else "its file is missing"
    ):
        ds.survey.trajectory(**AT)
    assert time.monotonic() - began < 10 and not strange.ran


def in_terminal(words, answers):
    """(exit code, what was shown) of the program in a terminal of its own, where `answers` are typed."""
    pid, terminal = pty.fork()
    if pid == 0:
        os.execv(sys.executable, [sys.executable, "-m", "survey", *map(str, words)])
    shown, deadline = b"", time.monotonic() + 120
    while time.monotonic() < deadline:
        if not select.select([terminal], [], [], 1)[0]:
            continue
        try:
            shown += os.read(terminal, 4096)
        except OSError:  # the program has ended
            break
        if answers and b"[y/N]" in shown:
            os.write(terminal, answers.encode())
            answers = ""
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), shown.decode().replace("\r\n", "\n")


@pytest.mark.parametrize(
    ("answer", "code"), [("\n", 2), pytest.param("y\n", 0, marks=pytest.mark.slow)]
)
def test_in_a_terminal_the_user_is_asked(strange, answer, code):
    ended, shown = in_terminal(["verify", strange.path, "--points", "1"], answer)
    assert ended == code and strange.ran == (code == 0), shown
    digest = survey.open(strange.path).attrs["scene_hash"]
    assert str(strange.file) in shown and digest in shown and f"cat -v -- {strange.file}" in shown


def test_the_viewer_shows_the_text_before_it_runs(strange):
    from types import SimpleNamespace

    from bokeh.document import Document

    from survey.viewer.page import Page
    from survey.viewer.shown import ShownMap

    text = strange.file.read_text()
    document = Document()
    context = SimpleNamespace(request=SimpleNamespace(arguments={}))
    document._session_context = lambda: context
    page = Page(ShownMap(strange.path), document)
    page.choose((1, 1))
    page.trust()  # nothing was shown yet
    page.solve()
    assert (
        "Read it first" in page.motion.text
        and page.read.visible
        and not page.run.visible
        and not strange.ran
    )
    page.show_source()
    shown = re.sub(r"<[^>]*>", "", page.source.text).replace("&#x27;", "'").replace("&quot;", '"')
    assert text.strip() in shown and page.run.visible and not strange.ran
    strange.file.write_text("raise SystemExit")  # what was shown is what is allowed
    page.trust()
    page.solve()
    assert "has changed since" in page.motion.text and not strange.ran
    strange.file.write_text(text)
    page.choose((1, 1))
    page.solve()
    assert "<img class='motion'" in page.motion.text and strange.ran and not page.run.visible


def test_a_scene_made_of_a_function_needs_no_trust(strange):
    scene = survey.hill(
        lambda u, p: p[0] - 2 * p[1] * np.cos(2 * u), period=np.pi, parameters=("a", "q"), even=True
    )
    ds = survey.evaluate(scene, a=[0.5, 1.0], q=0.3)
    assert "T/2" in ds.survey.point(a=1.0).why and not strange.state.exists()


def test_modules_in_the_folder_of_a_strange_survey_are_not_imported(strange):
    for name in ("numpy", "bokeh", "yaml", "sitecustomize"):
        (strange.path.parent / f"{name}.py").write_text(strange.file.read_text())
    words = [sys.executable, "-m", "survey", "info", "base.nc"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=strange.path.parent)
    assert done.returncode == 0 and not strange.ran, done.stderr
