"""The cells of [refine] of Hill's equations that are not even, from the trace D of the monodromy
matrix.

Stable where 2 - D and 2 + D are both positive, unstable where one is negative; both are analytic in the parameters (see
`survey.measures.sign_cells`). A tongue in which |D| exceeds 2 by less than what the series leave out stays undecided.
"""

import numpy as np

from survey.measures import sign_cells
from survey.measures.hill.cells import MOST, POINTS, VERDICTS, Side, accuracy
from survey.measures.hill.edges import has_factors
from survey.measures.tasks import in_turn

OUTPUTS = ("discriminant",)

__all__ = ["MOST", "OUTPUTS", "POINTS", "VERDICTS", "Side", "accuracy", "find", "serves"]


def serves(scene):
    """Are its cells found here?"""
    return not has_factors(scene) and not getattr(scene, "DAMPED", False)


def find(solve, x, y, each=in_turn, report=None):
    """The `hill.cells.Cells` of the Sides x and y; arguments as there."""
    return sign_cells.find(solve, x, y, each, report, _values)


def _values(out):
    """2 - D and 2 + D and their bounds (B, 2, m, m)."""
    D, bar = out["discriminant"], out["discriminant_error"]
    return np.stack([2.0 - D, 2.0 + D], axis=1), np.stack([bar, bar], axis=1)
