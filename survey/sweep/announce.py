"""What a run or a call from Python says while it works, on a terminal and in a notebook: compiling,
then a bar.

Elsewhere (scripts, pipes) nothing is said.
"""

import contextlib
import sys
import threading
import time

from survey.sweep import dispatch

PATIENCE = 0.5  # seconds of compiling that pass without a word
# measured, 2 cores, by family; of scenes of which less is compiled, on one, and what cells need besides
SECONDS = {
    "hill": 6,
    "cylinder": 9,
    "abel": 13,
    "nutation": 7,
    "danby": 6,
    "normal_form": 7,
    "floquet": 10,
}
OF_SCENES = {"mathieu": (6, 7), "libration_elliptic": (6, 8)}
OF_QUESTIONS = {("cylinder", "trajectory"): 6}  # of which nothing is compiled beside
USUAL = 10


def is_watched():
    """Is someone watching stderr, on a terminal or in a notebook?"""
    return "ipykernel" in sys.modules or (sys.stderr is not None and sys.stderr.isatty())


def console():
    """Where progress is shown from Python."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, soft_wrap=True, emoji=False)


def always_compiled(scene):
    """Is it compiled again in each process, as the code of a user's own Hill equation is?"""
    return hasattr(scene, "HASH") and scene.FAMILY == "hill"


def seconds(name, scene, cells=False, request=None):
    """How long compiling a scene's kernels for a request usually takes here; with those of `cells`."""
    asked = scene.FAMILY, request and request.options.get("question")
    if asked in OF_QUESTIONS:
        return OF_QUESTIONS[asked]
    kernels, more = OF_SCENES.get(name, (SECONDS.get(scene.FAMILY, USUAL), 0))
    further = getattr(scene, "COMPILING", {})
    wanted = request.variables if request else ()
    kernels += max((further.get(o, 0) for o in wanted), default=0)
    divided = hasattr(scene, "compile_ahead") and name not in OF_SCENES
    # measured: on one processor, what another compiles meanwhile comes after it
    return (kernels + more * cells) * (2 if divided and dispatch.cpus() == 1 else 1)


def sentence(name, scene, request=None):
    """`compiling gyrostat, once on this machine, about 9 s`."""
    when = "in each process that solves it" if always_compiled(scene) else "on this machine"
    return f"compiling {name}, once {when}, about {seconds(name, scene, request=request)} s"


@contextlib.contextmanager
def compiling(name, scene, say, request=None):
    """Name the compiling of the scene's kernels, by `say`, once it has taken a moment."""
    from numba.core import event

    class Listener(event.Listener):
        timer, depth, spent, said = None, 0, 0.0, False

        def on_start(self, _):
            self.depth += 1
            if self.depth == 1 and not self.said:
                self.began = time.perf_counter()
                self.timer = threading.Timer(max(PATIENCE - self.spent, 0.0), self.tell)
                self.timer.daemon = True
                self.timer.start()

        def on_end(self, _):
            self.depth -= 1
            if self.depth == 0 and not self.said:
                self.timer.cancel()
                self.spent += time.perf_counter() - self.began

        def tell(self):
            self.said = True
            say(sentence(name, scene, request))

    listener = Listener()
    event.register("numba:compile", listener)
    try:
        yield
    finally:
        event.unregister("numba:compile", listener)
        if listener.timer:
            listener.timer.cancel()
