"""The answers of points of Floquet's question."""

import numpy as np

from survey.measures import answers


class Answers(answers.Answers):
    """`floats`: re, im of n multipliers, bars of each, spectral radius and its bar; `codes`; Krein
    `signs` (n, N).
    """

    def __init__(self, size, n):
        super().__init__(size, ("verdict", "crossing"))
        self.floats = np.empty((4 * n + 2, size))
        self.n, self.signs = n, np.zeros((n, size), np.int8)

    def replace(self, points, other, those=slice(None)):
        """See `measures.answers`."""
        super().replace(points, other, those)
        self.signs[:, points] = other.signs[:, those]
