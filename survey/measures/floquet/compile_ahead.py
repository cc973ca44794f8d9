"""What a process of its own compiles at the first use of linear systems (see
`survey.sweep.compile_ahead`).
"""

import numpy as np

from survey.measures.floquet import monodromy, stability


def compile_ahead(variables, options):
    """Compile what answers from monodromy matrices, while the other process compiles what makes them."""
    matrices = monodromy.Matrices.plain(0.5 * np.eye(2)[None], np.zeros((1, 2, 2)))
    stability.by_coefficients(matrices, "none", 1e-10, {"verdict"})
