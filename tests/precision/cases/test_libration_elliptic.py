"""The chart of Danby's map: what the peers integrate is the scene's problem, and operations are counted."""

import numpy as np

from survey.precision.cases import libration_elliptic as chart
from survey.precision.peers import scipy
from survey.scene import Request
from survey.scenes import libration_elliptic


def test_a_peer_gives_the_references():
    references = chart.references()[::6]
    point = {name: np.array([given[name] for given, *_ in references]) for name in ("mu", "e")}
    found = chart.outcome(scipy.integrate(chart.system(point, {}), 1e-10))
    exact = np.array([values[chart.ERROR] for _, _, values, _ in references])
    assert (abs(found[chart.ERROR] - exact) < 1e-8 * (1 + abs(exact))).all()
    assert found["verdict"].tolist() == [verdict for *_, verdict in references]


def test_operations_are_those_of_the_steps():
    point = {"mu": np.full((40, 1), 0.01), "e": np.full((40, 1), 0.3)}
    counted = {
        rtol: chart.operations_of(
            lambda rtol=rtol: libration_elliptic.solve(point, Request({}, "taylor16", rtol))
        )
        for rtol in (1e-3, 1e-8)
    }
    assert 40 * 2000 < counted[1e-3] < counted[1e-8] < 40 * 100_000
