"""On a new machine, a separate process compiles some of the kernels that a run will need later."""

import contextlib
import subprocess
import sys

from survey.kernels import jit
from survey.sweep.dispatch import cpus


def program(scene, variables):
    """The Python program that calls the scene's `compile_ahead` for a map of these variables."""
    return f"import gc; gc.disable(); from {scene.__name__} import compile_ahead; compile_ahead({list(variables)})"


@contextlib.contextmanager
def compiling_ahead(scene, request):
    """Where kernels are not compiled yet, compile some in another process while this one compiles the longest."""
    if not (hasattr(scene, "compile_ahead") and request.method == "auto" and jit.is_new() and cpus() > 1):
        yield
        return
    command = [sys.executable, "-c", program(scene, request.variables)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    jit.other_compiler = process.wait
    try:
        yield
    finally:
        jit.other_compiler = None
        process.kill()
        process.wait()
