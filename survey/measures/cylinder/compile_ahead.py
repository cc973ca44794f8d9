"""What a process of its own compiles at the first use of a question (see
`survey.sweep.compile_ahead`).

The kernels are called on no rows, and some on a program of zeros. They are those that come before
and after the cycles of fates and portraits, one of the two of Abel's equation, or the trajectories
of a user's f and g.
"""

import numpy as np

from survey.kernels.cylinder import creeping, returns
from survey.kernels.cylinder import fate as kf
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.borders import BORDER
from survey.kernels.cylinder.equilibria import EQUILIBRIUM_SIZE
from survey.kernels.cylinder.flow import coefficients
from survey.kernels.cylinder.program import OPERATIONS, WIDTH
from survey.methods import taylor


def compile_ahead(variables, options):
    """For the gyrostat's questions but those on separatrices."""
    yield from _compile(coefficients(*np.zeros(rc.SIX)), options, own=False)


def of_functions(variables, options):
    """For a user's f and g."""
    yield from _compile(np.zeros(OPERATIONS + WIDTH), options, own=True)


def _compile(p, options, own):
    question = options.get("question")
    if "separatrix" in options:
        return
    if question == "trajectory":
        taylor.flow_trajectories_ahead(own)
    if question == "abel":
        taylor.flow_abels_ahead(own)
    if question not in ("fate", "portrait"):
        return
    eqs = np.empty((0, EQUILIBRIUM_SIZE))
    if own or question == "portrait":
        # first what the main process needs soon, for cycles as well
        creeping.crept(p, eqs, 0, 0.0, 0.0, 0.0, 0.0, True, 0.0, np.empty(creeping.PASSAGE))
        returns.runs_in(p, eqs, 0, 0.0, 0.0, 0.0)
    for name in ("borders", "fates") if question == "portrait" else ("fates", "borders"):
        if name == "borders":
            taylor.flow_borders(returns.ROTATION, p, eqs, 0, 0.0, 0.0, np.empty((0, BORDER)))
        else:
            tables = eqs, *[np.empty((0, returns.CYCLE_SIZE)) for _ in range(3)]
            sizes = np.zeros(kf.SIZES, np.int64)
            starts = np.empty((0, rc.START)), 0.0, 0, np.empty((0, rc.FATE))
            taylor.flow_fates(p, 0.0, np.zeros(2), sizes, *tables, *starts)
        yield name
