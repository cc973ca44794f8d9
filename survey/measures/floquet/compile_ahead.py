"""What a process of its own compiles at the first use of linear systems (see
`survey.sweep.compile_ahead`).
"""

from types import SimpleNamespace

import numpy as np

from survey.kernels.floquet import characteristic, discs, steps
from survey.kernels.floquet.flow import spread
from survey.measures.floquet import dense, monodromy, stability
from survey.measures.floquet.answers import Answers

N = 2  # states: any number is served by the same kernels
ASKED = {"verdict"}


def compile_ahead(variables, options):
    """Compile what answers from monodromy matrices, and then maps, while the other process compiles what
    makes them; then what carries errors sharply.
    """
    yield from _compile_answers()
    _compile_series()
    yield "series"
    characteristic.roots(np.ones((1, N)))
    _compile_carried(*_one_step())


def of_orbits(variables, options):
    """For periodic orbits: what answers from monodromy matrices, then what is made of steps."""
    yield from _compile_answers()
    found, each, first = _one_step()
    F, bars = each[0], np.zeros((1, N))
    spread(F, bars, first, bars, bars)
    steps.products(*each, first, N, found.M, found.E, found.R)
    _compile_carried(found, each, first)
    discs.couplings(found.M, found.E, found.extra, found.centre, found.V, found.W, found.R)


def _compile_answers():
    """Compile what answers from monodromy matrices."""
    plain = monodromy.Matrices.plain(0.5 * np.eye(N)[None], np.zeros((1, N, N)))
    stability.by_coefficients(plain, "none", 1e-10, ASKED)
    yield "matrices"


def _one_step():
    """Matrices of a point, its only step (F, its bounds), and where its steps begin and end."""
    found = monodromy.Matrices.empty(1, N)
    found.make_room()
    found.V[:] = found.W[:] = np.eye(N)
    return found, (np.zeros((1, N, N)), np.zeros(1), np.zeros(1)), np.array([0, 1])


def _compile_carried(found, each, first):
    """Compile what carries errors sharply."""
    steps.carried(*each, first, np.zeros(1, np.int64), N, found.V, found.W, found.extra)


def _compile_series():
    """Compile what answers maps, by a series that is 0."""
    terms = 4
    key = dense.SeriesMap(SimpleNamespace(n=N), "none", 1e-10, dense.flags(ASKED), (), ())
    doubts, starts = np.zeros((N, dense.PARTS, dense.PARTS * terms)), np.zeros((1, terms, N, 2))
    panel = dense.RootPanel((0.0,), (1.0,), np.zeros((1, N * terms)), doubts, starts)
    dense._answer(key, panel, np.zeros(1), np.zeros(1), np.zeros((1, 1), np.int64), Answers(1, N))
