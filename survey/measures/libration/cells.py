"""Danby's map everywhere in cells of mu and e: the verdict of whole cells, and the area of each
verdict.

The traces a and b are analytic in mu and e, and with them P = b + 2a + 2, Q = b - 2a + 2, K = a^2 -
4b + 8 and 4 -+ a: stable where all five are positive, unstable where one is negative
(`scenes/libration_elliptic.md`, section 3): see `survey.measures.sign_cells`.
"""

import numpy as np

from survey.kernels.libration.traces import STABLE, UNDECIDED, UNSTABLE
from survey.kernels.math.roundoff import EPS
from survey.measures import sign_cells
from survey.measures.hill import cells
from survey.measures.hill.cells import MOST, POINTS, Side
from survey.measures.tasks import in_turn

OUTPUTS = ("a", "b")
VERDICTS = {"undecided": UNDECIDED, "unstable": UNSTABLE, "stable": STABLE}
CELL_SECONDS = 1.8e-5  # five functions, whose points are solved down to the smallest cells

__all__ = ["CELL_SECONDS", "MOST", "OUTPUTS", "POINTS", "VERDICTS", "Side", "accuracy", "find"]


def accuracy(depth):
    """The rtol with which `find` asks for a and b where cells are halved so often."""
    return cells.accuracy(depth)


def find(solve, x, y, each=in_turn, report=None):
    """The `hill.cells.Cells` of the rectangle of the Sides x and y; arguments as there."""
    return sign_cells.find(solve, x, y, each, report, _values)


def _values(out):
    """The five functions and their bounds (B, 5, n, n) from a, b and theirs."""
    (a, da), (b, db) = ((out[name], out[f"{name}_error"].astype(float)) for name in OUTPUTS)
    size = 4.0 * EPS * (a * a + 4.0 * abs(b) + 8.0)
    values = (b + 2.0 * a + 2.0, b - 2.0 * a + 2.0, a * a - 4.0 * b + 8.0, 4.0 - a, 4.0 + a)
    linear = db + 2.0 * da + size
    bars = (linear, linear, 4.0 * db + 2.0 * abs(a) * da + da * da + size, da + size, da + size)
    return np.stack(values, axis=1), np.stack(bars, axis=1)
