"""Every peer that is installed integrates the scenes' equations to the accuracy asked of it."""

import numpy as np
import pytest

import survey.precision.peers
from survey import modules
from survey.precision.cases import gyrostat_abel, satellite
from survey.precision.peers import PeerSystem, batches


# the others compile longer
@pytest.fixture(
    params=[
        pytest.param(name, marks=[pytest.mark.slow] * (name != "heyoka"))
        for name in modules.names(survey.precision.peers)
    ]
)
def peer(request):
    pytest.importorskip(request.param)
    return modules.load(survey.precision.peers, request.param, "peer")


@pytest.mark.parametrize("place", [2, 5, 10, 11])  # a libration and a rotation of each body
def test_a_peer_finds_the_references(peer, place):
    point, options, exact, verdict = satellite.references()[place]
    found = satellite.outcome(peer.integrate(satellite.system(point, options), 1e-11))
    # a tolerance holds per step: two digits for their sum
    np.testing.assert_allclose(found["discriminant"], exact["discriminant"], rtol=1e-9, atol=1e-9)
    assert found["verdict"] == verdict


def test_points_keep_their_places(peer):
    point = {
        "k": np.linspace(0.1, 0.9, 3)[:, None],
        "rho": np.array([[3.0, 0.7, 2.0, 1.0, 1.5, 0.6, 0.9, 2.5]]),
    }
    together = satellite.outcome(peer.integrate(satellite.system(point, {}), 1e-9))["discriminant"]
    assert together.shape == (24,)
    for place in (0, 1, 23):
        alone = {
            name: np.broadcast_to(values, (3, 8)).flat[place] for name, values in point.items()
        }
        (value,) = satellite.outcome(peer.integrate(satellite.system(alone, {}), 1e-9))[
            "discriminant"
        ]
        assert abs(together[place] - value) < 1e-6


def test_batches_hold_every_point_and_like_numbers_of_steps():
    steps = np.array([5.0, 1.0, 4.0, 2.0, 3.0])
    system = PeerSystem(None, np.zeros((5, 1)), np.zeros((5, 1)), steps, steps)
    assert batches(system, 2).tolist() == [[1, 3], [4, 2], [0, 0]]
    assert batches(system, 8).tolist() == [[1, 3, 4, 2, 0, 0, 0, 0]]


def test_a_peer_s_dense_output_holds_the_references(peer):
    for point, options, exact, _verdict in gyrostat_abel.references("121 angles of a turn")[:8]:
        if point["phi"] > 0.0:
            dense = {name: np.full((1, 1), value) for name, value in point.items()}
            dense |= {"phi": np.linspace(0.0, point["phi"], 4)[None]}
            found = gyrostat_abel.outcome(
                peer.integrate(gyrostat_abel.system(dense, options), 1e-11)
            )["w"]
            assert found.shape == (4,) and abs(found[0] - point["w0"]) < 1e-12
            np.testing.assert_allclose(found[3], exact["w"], rtol=1e-9)
