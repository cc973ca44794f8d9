"""What a run or a call from Python says while it works, on a terminal and in a notebook: compiling, then a bar.

Elsewhere (scripts, pipes) nothing is said.
"""

import contextlib
import sys
import threading
from types import SimpleNamespace

PATIENCE = 0.5  # seconds of compiling that pass without a word
LONG = 2.0  # seconds of work, estimated, for which there is a bar
SECONDS = {"hill": 20, "cylinder": 40, "abel": 40, "nutation": 20, "danby": 10, "normal_form": 10}  # measured, 2 cores
USUAL = 30


def is_watched():
    """Does someone look at stderr: a terminal, or a notebook?"""
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())


def console():
    """Where progress is shown from Python."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)


def sentence(name, scene):
    """`compiling gyrostat, once on this machine, about 40 s`."""
    when = "in each process that solves it" if hasattr(scene, "HASH") else "on this machine"
    return f"compiling {name}, once {when}, about {SECONDS.get(scene.FAMILY, USUAL)} s"


@contextlib.contextmanager
def compiling(name, scene, say):
    """Name the compiling of the scene's kernels, by `say`, once it has taken a moment."""
    from numba.core import event

    class Listener(event.Listener):
        timer = None

        def on_start(self, _):
            if self.timer is None:
                self.timer = threading.Timer(PATIENCE, say, [sentence(name, scene)])
                self.timer.daemon = True
                self.timer.start()

        def on_end(self, _):
            pass

    listener = Listener()
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)
        if listener.timer:
            listener.timer.cancel()


@contextlib.contextmanager
def watched(name, scene, points, seconds):
    """For a call from Python: names compiling; yields what to call with (done, total), or None if nothing is shown.

    `seconds()` estimates how long it takes.
    """
    if not is_watched():
        yield None
        return
    from survey.sweep.progress import Progress

    shown, quick = console(), seconds() < LONG
    workflow = SimpleNamespace(name=name, grid=SimpleNamespace(points=points))
    with (
        compiling(name, scene, lambda text: shown.print(text, markup=False)),
        Progress(shown, workflow, silent=quick) as progress,
    ):
        yield None if quick else lambda done, total: progress(done, total, 0)
