"""What a process of its own compiles at the first use of linear systems (see
`survey.sweep.compile_ahead`).
"""

from types import SimpleNamespace

import numpy as np

from survey.kernels.floquet import characteristic, steps
from survey.kernels.floquet.program import OPERATION, TERM
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
    _compile_carried()


def of_orbits(variables, options):
    """For periodic orbits, whose flow takes as long to compile: steps, and what bounds multipliers by them."""
    operations, inside, terms = (np.zeros((0, size), np.int64) for size in (OPERATION, 2, TERM))
    points, none, numbers = np.zeros(0, np.int64), np.zeros(0), np.zeros((1, 0))
    steps.factors(
        operations, none, inside, points, points, terms, numbers, np.ones((1, N)), np.zeros(1), N,
        points, none, none, np.zeros((0, N, N)), none, none,
    )  # fmt: skip
    yield "steps"
    _compile_carried()
    yield "carried"
    yield from _compile_answers()


def _compile_answers():
    """Compile what answers from monodromy matrices."""
    plain = monodromy.Matrices.plain(0.5 * np.eye(N)[None], np.zeros((1, N, N)))
    stability.by_coefficients(plain, "none", 1e-10, ASKED)
    yield "matrices"


def _compile_carried():
    """Compile what carries errors sharply."""
    found = monodromy.Matrices.empty(1, N)
    found.make_room()
    found.V[:] = found.W[:] = np.eye(N)
    each, first = (np.zeros((1, N, N)), np.zeros(1), np.zeros(1)), np.array([0, 1])
    steps.carried(*each, first, np.zeros(1, np.int64), N, found.V, found.W, found.extra)


def _compile_series():
    """Compile what answers maps, by a series that is 0."""
    terms = 4
    key = dense.SeriesMap(SimpleNamespace(n=N), "none", 1e-10, dense.flags(ASKED), (), ())
    doubts, starts = np.zeros((N, dense.PARTS, dense.PARTS * terms)), np.zeros((1, terms, N, 2))
    panel = dense.RootPanel((0.0,), (1.0,), np.zeros((1, N * terms)), doubts, starts)
    dense._answer(key, panel, np.zeros(1), np.zeros(1), np.zeros((1, 1), np.int64), Answers(1, N))
