"""Progress and ETA on stderr: a bar on a terminal, a line now and then in a log."""

import time

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

LOG_SECONDS = 60


class Progress:
    """Called with (done, in all, reused, what of), once with nothing done for each `what`; a context manager."""

    def __init__(self, console, workflow, silent=False):
        self.console, self.workflow, self.silent = console, workflow, silent
        self.started = self.logged = time.monotonic()
        self.bar = self.task = None

    def __enter__(self):
        if self.console.is_terminal and not self.silent:
            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                MofNCompleteColumn(),
                TextColumn("{task.fields[what]}"),
            )
            self.bar = Bar(
                *columns, TimeElapsedColumn(), TextColumn("ETA"), TimeRemainingColumn(), console=self.console
            )
            self.bar.start()
        return self

    def __exit__(self, *_):
        if self.bar:
            self.bar.stop()

    def __call__(self, done, total, reused, what="blocks"):
        if self.silent:
            return
        if done == reused:
            self._begin(total, reused, what)
        if self.bar:
            self.bar.update(self.task, completed=done)
        elif done != reused and (done == total or time.monotonic() - self.logged > LOG_SECONDS):
            self.logged = time.monotonic()
            elapsed = self.logged - self.started
            left = elapsed / (done - reused) * (total - done)
            self._line(f"{done} of {total} {what}, {elapsed:.0f} s elapsed, ETA {left:.0f} s")
        if done == total and what == "blocks":
            self._line(f"computed {done - reused}, reused {reused} of {total} blocks")

    def _begin(self, total, reused, what):
        self.started = self.logged = time.monotonic()
        if self.bar:
            self.task = self.bar.add_task(self.workflow.name, total=total, what=what)
        if what == "blocks":
            self._line(f"{self.workflow.grid.points:,} points in {total} blocks, {reused} already done")

    def refining(self, settled, points):
        """Told as cells are refined: which part of the map is settled, and how many points were solved for it."""
        if self.silent:
            return
        text = f"cells: {settled:.2%} of the map settled, {points:,} points solved"
        if self.bar and settled < 1:
            self.bar.update(self.task, description=f"{self.workflow.name}: {text}")
        elif settled == 1 or time.monotonic() - self.logged > LOG_SECONDS:
            self.logged = time.monotonic()
            self._line(text)

    def _line(self, text):
        self.console.print(f"{self.workflow.name}: {text}", markup=False)
