"""What a process of its own compiles at the first use of a question (see
`survey.sweep.compile_ahead`).

The kernels are called on no rows, and `crept` on a program of zeros. They are those that come with
and after the cycles of fates and portraits, one of the two of Abel's equation, or the trajectories
of a user's f and g.
"""

import numpy as np

from survey.kernels.cylinder import creeping
from survey.kernels.cylinder import fate as kf
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.equilibria import EQUILIBRIUM_SIZE
from survey.kernels.cylinder.flow import coefficients
from survey.kernels.cylinder.program import OPERATIONS, WIDTH
from survey.kernels.cylinder.returns import CYCLE_SIZE
from survey.methods import taylor


def compile_ahead(variables, options):
    """For the gyrostat's questions but those on separatrices."""
    yield from _compile(coefficients(*np.zeros(rc.SIX)), options, own=False)


def of_functions(variables, options):
    """For a user's f and g."""
    yield from _compile(np.zeros(OPERATIONS + WIDTH), options, own=True)


def _compile(p, options, own):
    question = options.get("question")
    if question == "trajectory" and "separatrix" not in options:
        taylor.flow_trajectories_ahead(own)
    if question == "abel" and "separatrix" not in options:
        taylor.flow_abels_ahead(own)
    none = np.empty((0, rc.EXACT_START))
    eqs = np.empty((0, EQUILIBRIUM_SIZE))
    fates = question in ("fate", "portrait") and "separatrix" not in options
    if fates and own:
        # first, as the main process needs it for cycles as well
        creeping.crept(p, eqs, 0, 0.0, 0.0, 0.0, 0.0, True, 0.0, np.empty(creeping.PASSAGE))
    if question == "portrait":
        planes, status = np.empty((rc.STATE, 0, 2)), np.empty((0, 2), np.int8)
        taylor.flow_abels_by_row(p[None][:0], none, none, 0.0, 0, planes, status)
    if fates:
        tables = eqs, *[np.empty((0, CYCLE_SIZE)) for _ in range(3)]
        sizes = np.zeros(kf.SIZES, np.int64)
        starts = np.empty((0, rc.START)), 0.0, 0, np.empty((0, rc.FATE))
        taylor.flow_fates(p, 0.0, np.zeros(2), sizes, *tables, *starts)
        yield "fates"
