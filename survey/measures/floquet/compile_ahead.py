"""What a process of its own compiles at the first use of linear systems (see
`survey.sweep.compile_ahead`).
"""

from types import SimpleNamespace

import numpy as np

from survey.kernels.floquet import characteristic, steps
from survey.measures.floquet import dense, monodromy, stability
from survey.measures.floquet.answers import Answers

N = 2  # states: any number is served by the same kernels


def compile_ahead(variables, options):
    """Compile what answers from monodromy matrices, and then maps, while the other process compiles what
    makes them; then what carries errors sharply.
    """
    asked = {"verdict"}
    plain = monodromy.Matrices.plain(0.5 * np.eye(N)[None], np.zeros((1, N, N)))
    stability.by_coefficients(plain, "none", 1e-10, asked)
    yield "matrices"
    _compile_series(asked)
    yield "series"
    characteristic.roots(np.ones((1, N)))
    found = monodromy.Matrices.empty(1, N)
    found.make_room()
    found.V[:] = found.W[:] = np.eye(N)
    each, first = (np.zeros((1, N, N)), np.zeros(1), np.zeros(1)), np.array([0, 1])
    steps.carried(*each, first, np.zeros(1, np.int64), N, found.V, found.W, found.extra)


def _compile_series(asked):
    """Compile what answers maps, by a series that is 0."""
    terms = 4
    key = dense.SeriesMap(SimpleNamespace(n=N), "none", 1e-10, dense.flags(asked), (), ())
    doubts, starts = np.zeros((N, dense.PARTS, dense.PARTS * terms)), np.zeros((1, terms, N, 2))
    panel = dense.RootPanel((0.0,), (1.0,), np.zeros((1, N * terms)), doubts, starts)
    dense._answer(key, panel, np.zeros(1), np.zeros(1), np.zeros((1, 1), np.int64), Answers(1, N))
