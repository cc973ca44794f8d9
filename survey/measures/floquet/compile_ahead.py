"""What a process of its own compiles at the first use of linear systems (see
`survey.sweep.compile_ahead`).
"""

import numpy as np

from survey.kernels.floquet import discs, steps


def compile_ahead(variables, options):
    """Compile kernels of the steps, then what follows them, by calls on next to nothing."""
    steps.compile_others()
    yield
    steps.compile_further()
    real = np.zeros((1, 1, 1))
    vectors = np.ones((1, 1, 1), np.complex128)
    discs.couplings(real, real, real, vectors[0], vectors, vectors, real.copy())
