"""Progress and ETA on stderr: a bar on a terminal or in a notebook, occasional lines in a log."""

import contextlib
import time
from datetime import timedelta
from importlib.util import find_spec
from types import SimpleNamespace

from survey.sweep import announce
from survey.wording import counted

# between two lines, in a log and in a notebook without ipywidgets
LOG_SECONDS, NOTEBOOK_SECONDS = 60, 5
BAR_SECONDS = 0.2
LONG = 2.0  # seconds of work, estimated, for which a call from Python has a bar


class Progress:
    """A context manager, called with (done, total, reused, what); for each `what` first with done =
    reused.
    """

    def __init__(self, console, workflow, silent=False):
        self.console, self.workflow, self.silent = console, workflow, silent
        self.started = self.logged = time.monotonic()
        self.bar = self.task = None

    def __enter__(self):
        if self.silent:
            return self
        self.naming = announce.compiling(
            self.workflow.name,
            getattr(self.workflow, "scene", None),
            self._say,
            getattr(self.workflow, "request", None),
        )
        if getattr(self.workflow, "scene", None) is not None:
            self.naming.__enter__()
        if self.console.is_terminal or (self.console.is_jupyter and find_spec("ipywidgets")):
            from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
            from rich.progress import Progress as Bar

            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[what]}"),
            )
            self.bar = Bar(
                *columns,
                TimeElapsedColumn(),
                TextColumn("ETA {task.fields[eta]}"),
                console=self.console,
            )
            self.bar.start()
        return self

    def __exit__(self, *_):
        if self.bar:
            self.bar.stop()
        if not self.silent and getattr(self.workflow, "scene", None) is not None:
            self.naming.__exit__(None, None, None)

    def __call__(self, done, total, reused, what="blocks", left=None):
        """`left()` estimates the seconds left; without it they are extrapolated from what is done."""
        if self.silent:
            return
        if done == reused:
            self._begin(total, reused, what)
        elapsed = time.monotonic() - self.started
        if self.bar:
            if time.monotonic() - self.logged > BAR_SECONDS or done == total:
                self.logged = time.monotonic()
                eta = _clock(_left(done, total, reused, elapsed, left))
                self.bar.update(self.task, completed=done, eta=eta)
        elif done != reused and (done == total or time.monotonic() - self.logged > self._pause):
            self.logged = time.monotonic()
            eta = _left(done, total, reused, elapsed, left)
            self._line(
                f"{done:,} of {_counted(total, what)}, {elapsed:.0f} s elapsed, ETA {eta:.0f} s"
            )
        if done == total and what == "blocks":
            self._line(
                f"computed {done - reused:,}, reused {reused:,} of {counted(total, 'block')}"
            )

    def _begin(self, total, reused, what):
        self.started = self.logged = time.monotonic()
        if self.bar:
            self.task = self.bar.add_task(
                self.workflow.name, total=total, completed=reused, what=what, eta="-"
            )
        if what == "blocks":
            points = counted(self.workflow.grid.points, "point")
            self._line(f"{points} in {counted(total, 'block')}, {reused:,} already done")
        elif total and not self.bar:
            self._line(f"searching: {_counted(total, what)}")

    @property
    def _pause(self):
        return NOTEBOOK_SECONDS if self.console.is_jupyter else LOG_SECONDS

    def refining(self, settled, points, left):
        """Called as cells are refined, with the fraction of the map that is settled, the points
        solved, and seconds.

        `left`: seconds for the cells known to be open; those may leave further ones open, so more
        may be needed.
        """
        if self.silent:
            return
        text = f"cells: {settled:.2%} of the map settled, {counted(points, 'point')} solved"
        if self.bar and settled < 1:
            eta = f"{_clock(left)} or more"
            self.bar.update(
                self.task, description=f"{self.workflow.name}: {text}", what="cells", eta=eta
            )
        elif settled == 1:
            self._line(
                f"cells: all decided or at the requested width, {counted(points, 'point')} solved"
            )
        elif time.monotonic() - self.logged > LOG_SECONDS:
            self.logged = time.monotonic()
            self._line(f"{text}, ETA {left:.0f} s or more")

    def _say(self, text):
        self.console.print(text, markup=False)

    def _line(self, text):
        self.console.print(f"{self.workflow.name}: {text}", markup=False)


def _counted(total, what):
    """`3 maps of the curves`, from `maps of the curves`."""
    first, space, rest = what.partition(" ")
    return counted(total, first.removesuffix("s")) + space + rest


def _clock(seconds):
    """'0:01:05', '1 day, 1:00:00'."""
    return str(timedelta(seconds=round(seconds)))


def _left(done, total, reused, elapsed, left):
    return left() if left else elapsed / max(done - reused, 1) * (total - done)


@contextlib.contextmanager
def watched(name, scene, points, seconds, what="blocks", request=None):
    """For a call from Python: names compiling; yields what to call with (done, total), or None if
    nothing is shown.

    `seconds()` estimates how long it takes; `what` is counted.
    """
    if not announce.is_watched():
        yield None
        return
    shown, quick = announce.console(), seconds() < LONG
    workflow = SimpleNamespace(name=name, grid=SimpleNamespace(points=points))
    with (
        announce.compiling(name, scene, lambda text: shown.print(text, markup=False), request),
        Progress(shown, workflow, silent=quick) as progress,
    ):
        yield None if quick else lambda done, total: progress(done, total, 0, what)
