"""The bar on a terminal; the lines of a log are seen in test_cli and test_promises."""

import io
import types

from rich.console import Console

from survey.sweep import progress


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
