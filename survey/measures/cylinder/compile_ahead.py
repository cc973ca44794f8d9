"""What a process of its own compiles at the first use of a question, and what the process that
waits for it compiles first (see `survey.sweep.compile_ahead`).

The kernels are called on no rows, and some on a program of zeros. They are those that come before
and after the cycles of fates and portraits, one of the two of Abel's equation, or the trajectories
of a user's f and g.
"""

import numpy as np

from survey.kernels.cylinder import (
    balls,
    creeping,
    lockstep,
    lockstep_abel,
    lockstep_program,
    returns,
)
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


def first_of_functions(variables, options):
    """For a user's f and g: what the process that waits compiles first, as the other has more to do,
    and needs `balls` as well.
    """
    question, p = options.get("question"), np.zeros(OPERATIONS + WIDTH)
    nothing, known = np.empty(0), np.zeros(0, np.bool_)
    work = np.zeros((lockstep.ROWS, lockstep.LANES))
    if question in ("trajectory", "abel"):
        balls.balls(p, nothing, known, nothing, nothing, nothing)
    if question == "trajectory":
        times, planes = np.empty((0, 0)), np.empty((rc.STATE, 0, 0))
        rows, turnings = np.full(lockstep.LANES, -1), np.empty((0, 0), np.int64)
        lockstep.record(work.reshape(-1), times, rows, rows, rows, planes, turnings)
    if question == "abel":
        block = np.zeros(8 * lockstep_abel.BLOCK)
        lockstep_program.cross(*lockstep.split(work)[:4], 0, 0.0, 0.0, 0.0, block, 0)
    if question == "fate" and "separatrix" not in options:
        balls.balls_of_one(p, nothing, known, 0.0, 0.0, nothing)
        _of_cycles(p)


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
    if question == "portrait":
        _of_cycles(p)  # the main process needs it soon
    for name in ("borders", "fates") if question == "portrait" else ("fates", "borders"):
        if name == "borders":
            taylor.flow_borders(returns.ROTATION, p, eqs, 0, 0.0, 0.0, np.empty((0, BORDER)))
        else:
            tables = eqs, *[np.empty((0, returns.CYCLE_SIZE)) for _ in range(3)]
            sizes = np.zeros(kf.SIZES, np.int64)
            starts = np.empty((0, rc.START)), 0.0, 0, np.empty((0, rc.FATE))
            taylor.flow_fates(p, 0.0, np.zeros(2), sizes, *tables, *starts)
        yield name


def _of_cycles(p):
    """What cycles need, and fates too."""
    eqs = np.empty((0, EQUILIBRIUM_SIZE))
    creeping.crept(p, eqs, 0, 0.0, 0.0, 0.0, 0.0, True, 0.0, np.empty(creeping.PASSAGE))
    returns.runs_in(p, eqs, 0, 0.0, 0.0, 0.0)
