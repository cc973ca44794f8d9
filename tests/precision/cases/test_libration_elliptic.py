"""The chart of Danby's map: what the peers integrate is the scene's problem."""

import numpy as np

from survey.precision.cases import libration_elliptic as chart
from survey.precision.peers import scipy


def test_a_peer_gives_the_references():
    references = chart.references()[::6]
    point = {name: np.array([given[name] for given, *_ in references]) for name in ("mu", "e")}
    found = chart.outcome(scipy.integrate(chart.system(point, {}), 1e-10))
    exact = np.array([values[chart.ERROR] for _, _, values, _ in references])
    assert (abs(found[chart.ERROR] - exact) < 1e-8 * (1 + abs(exact))).all()
    assert found["verdict"].tolist() == [verdict for *_, verdict in references]
