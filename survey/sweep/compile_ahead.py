"""At the first use of a scene on a machine, a separate process compiles some of the kernels that
are needed later.
"""

import contextlib
import subprocess
import sys
from pathlib import Path

import survey
from survey import waiting
from survey.kernels import jit
from survey.sweep.dispatch import cpus


def command(ahead, request):
    """The command that calls a scene's `compile_ahead` for what is asked; what that yields, it prints."""
    call = f"({list(request.variables)}, {dict(request.options)})"
    # at once: a wait to the end would last 0.7 s longer, in which Python tidies up
    steps = f"for name in ahead{call} or (): print(name, flush=True)\nos._exit(0)"
    package = str(Path(survey.__file__).parents[1])
    path = f"import gc, os, sys; gc.disable(); sys.path.append({package!r})"
    program = f"{path}; from {ahead.__module__} import {ahead.__name__} as ahead\n{steps}"
    # -P: not the modules of the user's folder, where struct.py would take the place of Python's
    return [sys.executable, "-P", "-c", program]


@contextlib.contextmanager
def compiling_ahead(scene, request):
    """Where kernels are not compiled yet, compile some in another process while this one compiles
    the longest: what a scene of the user's own has in `compile_first` before all others.
    """
    ahead = getattr(scene, "compile_ahead", None)
    if not (
        ahead
        and request.method == "auto"
        and jit.is_first(_work(ahead, request.options))
        and cpus() > 1
    ):
        yield
        return
    with subprocess.Popen(
        command(ahead, request), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    ) as process:
        waiting.other_compiler = process.stdout.readline  # a line, or the end
        try:
            if first := getattr(scene, "compile_first", None):
                first(request.variables, request.options)
            yield
        finally:
            waiting.other_compiler = None
            process.kill()


def _work(ahead, options):
    """A name for what is compiled: other scenes, other questions and other kinds of options need
    other kernels.
    """
    return "-".join(
        [ahead.__module__, ahead.__name__, str(options.get("question")), *sorted(options)]
    )
