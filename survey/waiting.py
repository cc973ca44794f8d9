"""What the first use of a scene waits for: another process compiles some of its kernels meanwhile.

The run hands over a function that waits for that process (see `sweep.compile_ahead`); measures and
methods call it before they need those kernels.
"""

import time

import numpy as np

from survey.kernels import jit
from survey.kernels.math.rounding import rounded_up

# at a first use, waits for the next of what is compiled elsewhere, and names it; empty at the end
other_compiler = None
_done = set()  # names; what is compiled stays so
_waited = 0.0


def wait(name):
    """Wait for what has this name, or else for all that is compiled elsewhere: it is done sooner than
    if this process began now. Meanwhile it compiles what stores error bars.
    """
    global _waited
    function = other_compiler
    if function is not None and name not in _done:
        rounded_up(np.empty(0))
        began = time.perf_counter()
        while name not in _done and (line := function()):
            _done.add(line.strip())
        _waited = max(_waited, time.perf_counter() - began)  # threads wait side by side


def compile_seconds():
    """Seconds in which this process has compiled kernels so far, or waited for another that does."""
    return _waited + jit.compile_seconds()
