"""The bar on a terminal; the lines of a log are seen in test_cli and test_promises."""

import io
import time
import types

from numba.core import event
from rich.console import Console

from survey.sweep import announce, progress


def test_the_bar_tells_more_than_a_day(monkeypatch):
    monkeypatch.setattr(progress, "BAR_SECONDS", -1.0)
    console = Console(file=io.StringIO(), force_terminal=True, width=120, highlight=False)
    workflow = types.SimpleNamespace(name="gyrostat", grid=types.SimpleNamespace(points=1))
    with progress.Progress(console, workflow) as bar:
        bar(0, 10, 0, left=lambda: 0.0)
        for seconds, text in ((65.2, "0:01:05"), (90_000.0, "1 day, 1:00:00")):
            bar(1, 10, 0, left=lambda seconds=seconds: seconds)
            assert bar.bar.tasks[0].fields["eta"] == text
    assert "gyrostat: 1 point in 10 blocks, 0 already done" in console.file.getvalue()


def test_compiling_is_named_once_it_takes_a_moment(monkeypatch):
    import numba

    monkeypatch.setattr(announce, "PATIENCE", 0.0)
    said = []
    scene = types.SimpleNamespace(FAMILY="cylinder")
    with announce.compiling("gyrostat", scene, said.append):
        function_of_own = numba.njit(lambda x: x + 1.0)
        assert function_of_own(1.0) == 2.0
        time.sleep(0.2)
    assert said == ["compiling gyrostat, once on this machine, about 9 s"]
    said.clear()
    with announce.compiling("gyrostat", scene, said.append):
        function_of_own(2.0)  # compiled already
        time.sleep(0.1)
    assert said == []


def test_what_is_compiled_in_a_moment_is_not_named_later(monkeypatch):
    monkeypatch.setattr(announce, "PATIENCE", 1.0)
    said = []
    with announce.compiling("gyrostat", types.SimpleNamespace(FAMILY="cylinder"), said.append):
        for _ in range(2):
            with event.trigger_event("numba:compile"):
                pass
        time.sleep(1.2)
        assert said == []
        with event.trigger_event("numba:compile"):
            time.sleep(1.2)
        assert len(said) == 1


def test_a_notebook_and_a_terminal_see_a_bar_and_a_script_nothing(monkeypatch):
    console = Console(
        file=io.StringIO(), force_jupyter=False, force_terminal=True, width=120, highlight=False
    )
    monkeypatch.setattr(announce, "console", lambda: console)
    monkeypatch.setattr(progress, "LONG", 0.0)
    scene = types.SimpleNamespace(FAMILY="hill")
    with progress.watched("mathieu", scene, 10, lambda: 1.0) as bar:
        assert bar is None
    monkeypatch.setattr(announce, "is_watched", lambda: True)
    with progress.watched("mathieu", scene, 10, lambda: 1.0) as bar:
        bar(0, 2)
        bar(1, 2)
        bar(2, 2)
    assert "mathieu: 10 points in 2 blocks" in console.file.getvalue()
