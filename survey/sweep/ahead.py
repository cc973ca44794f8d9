"""On a new machine a process of its own compiles some of the kernels ahead."""

import contextlib
import subprocess
import sys

from survey.kernels import jit
from survey.sweep.dispatch import cpus


def program_ahead(scene, variables):
    """The program that compiles what the scene names for a map of these variables."""
    return f"import gc; gc.disable(); from {scene.__name__} import compile_ahead; compile_ahead({list(variables)})"


@contextlib.contextmanager
def compiling_ahead(scene, request):
    """On a new machine, a process compiles some of the kernels while this one compiles the longest."""
    if not (hasattr(scene, "compile_ahead") and request.method == "auto" and jit.is_new() and cpus() > 1):
        yield
        return
    words = [sys.executable, "-c", program_ahead(scene, request.variables)]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    jit.ahead = process.wait
    try:
        yield
    finally:
        jit.ahead = None
        process.kill()
        process.wait()
