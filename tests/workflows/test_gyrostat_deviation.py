"""The workflow that measures how deviations from the gyrostat's invariant set grow."""

import gyrostat_deviation as workflow
import numpy as np
import pytest

TIMES = np.linspace(0.0, 5.0, 26)
LARGEST, *_ = workflow.BODIES.values()


@pytest.mark.parametrize("name", [*workflow.CONDITIONS, *workflow.START_CONDITIONS])
def test_each_condition_is_needed(name):
    """A deviation is of first order in the break, and nothing else moves w2, w3, nu1."""
    small, smaller = (
        workflow.deviation(workflow.motion(*workflow.broken(LARGEST, name, size), TIMES)[0])
        for size in (1e-5, 1e-6)
    )
    assert smaller[-1] > 1e-8
    np.testing.assert_allclose(small[5:], 10 * smaller[5:], rtol=2e-2, atol=1e-9)


def test_what_is_free_does_not_matter():
    for shift in np.eye(8):
        states, _ = workflow.motion(*workflow.body(np.array(LARGEST) + 0.1 * shift), TIMES)
        assert workflow.off_reduced(states, TIMES).max() < 1e-12


def test_the_growth_is_that_of_a_kick():
    G, state = workflow.body(LARGEST)
    states, tangent = workflow.motion(G, state, TIMES)
    kick = np.linalg.svd(tangent[-1, 1:4, 1:4])[2][0]
    moved = state + 1e-7 * np.kron(np.eye(2), workflow.Q)[:, 1:4] @ kick
    other, _ = workflow.motion(G, moved, TIMES)
    grown = np.linalg.norm((other - states)[-1, 1:4]) / 1e-7
    # the tangent map is good to 1e-5 a step
    assert grown == pytest.approx(workflow.growth(tangent)[-1], rel=1e-3)


def test_the_picture(tmp_path):
    values = np.geomspace(1e-6, 1.0, workflow.TIMES.size)
    kept = {name: (values, values) for name in workflow.BODIES}
    workflow.draw(kept, {name: values for name in workflow.CONDITIONS}, tmp_path / "out.png")
    assert (tmp_path / "out.png").stat().st_size > 10_000
