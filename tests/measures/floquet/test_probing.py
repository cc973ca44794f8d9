"""Spikes of a user's A as wide as the file says are resolved: none goes unseen."""

import math

import numpy as np
import pytest
from fine_steps import beyond

import survey
from survey.measures.floquet import monodromy, probing
from survey.measures.floquet.system import System
from survey.scene import Request

NAMES = ("mean", "swing", "waves", "height", "at", "width", "power")


def gauss(t, p, out):
    x = math.sin(math.pi * (t - p[4])) / p[5]
    out[0, 1] = 1.0
    out[1, 0] = -(p[0] + p[1] * math.cos(2 * math.pi * p[2] * t) + p[3] * math.exp(-x * x))


def power(t, p, out):
    spike = math.cos(math.pi * (t - p[4]))
    for _ in range(12):
        spike = spike * spike
    out[0, 1] = 1.0
    out[1, 0] = -(p[0] + p[1] * math.cos(2 * math.pi * p[2] * t) + p[3] * spike)


SPIKES = {
    gauss: lambda u, p: np.exp(-((np.sin(np.pi * (u - p[:, 4])) / p[:, 5]) ** 2)),
    power: lambda u, p: np.cos(np.pi * (u - p[:, 4])) ** 4096,  # 0.0117 wide
}


def random_points(seed, number):
    """Spikes of one to two times the width, on waves."""
    random = np.random.default_rng(seed)
    wide = probing.WIDTH * 10 ** random.uniform(0, 0.3, number)
    return np.stack(
        [
            random.uniform(-20, 60, number),
            np.where(random.random(number) < 0.3, 0, 10 ** random.uniform(-1, 2, number)),
            random.integers(1, 6, number),
            10 ** random.uniform(-3, 2, number) * random.choice([-1, 1], number),
            random.random(number),
            np.sin(0.5 * np.pi * wide) / np.sqrt(np.log(2)),
            np.zeros(number),
        ],
        axis=1,
    )


def unseen(A, points):
    scene = survey.floquet(A, period=1.0, parameters=NAMES, states=("y", "v"))
    assert (
        scene.NOTES["A_resolved_width"] == probing.WIDTH and "breaks" in scene.NOTES["A_resolution"]
    )
    request = Request({}, "auto", 1e-9, frozenset(["monodromy"]))
    out = scene.solve(dict(zip(NAMES, points.T, strict=True)), request)
    found, bar = (
        np.trace(out["monodromy"], axis1=1, axis2=2),
        np.trace(out["monodromy_error"], axis1=1, axis2=2),
    )
    assert (out["status"] == 0).all()

    def z(u, p):
        return p[:, 0] + p[:, 1] * np.cos(2 * np.pi * p[:, 2] * u) + p[:, 3] * SPIKES[A](u, p)

    return int(beyond(z, points, 1.0, found, bar).sum())


@pytest.mark.parametrize("A", SPIKES)
def test_no_spike_as_wide_as_the_file_says_goes_unseen(A):
    """Of these Gaussians 1 in 40 did, and left no trace in the bars."""
    assert unseen(A, random_points(3, 300)) == 0


@pytest.mark.slow
def test_no_spike_next_to_the_ends_of_the_period_goes_unseen():
    """Chebyshev coefficients alone missed 4 of these, and an error was 4e7 times its bar."""
    points = random_points(501, 2000)
    points[:, NAMES.index("at")] = np.random.default_rng(1).uniform(-0.03, 0.03, 2000) % 1.0
    assert unseen(gauss, points) == 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("A", SPIKES)
def test_no_spike_of_very_many_goes_unseen(A, seed):
    assert unseen(A, random_points(100 + seed, 2000)) == 0


def test_a_spike_that_a_run_would_miss_is_refused_with_its_place_and_resolved_with_a_break_there():
    def narrow(t, p, out):
        x = (t - p[0]) / p[1]
        out[0, 1], out[1, 0] = 1.0, -4.0 - math.exp(-x * x) / (math.sqrt(math.pi) * p[1])

    given = {"period": 1.0, "parameters": ("at", "width"), "states": ("y", "v")}
    with pytest.raises(
        survey.BadInput, match=r"A has a spike near t = 0\.304.*name its position in breaks"
    ):
        survey.evaluate(survey.floquet(narrow, **given), at=0.3045, width=5e-4)
    near = {"breaks": lambda p: [p[0] - 8 * p[1], p[0], p[0] + 8 * p[1]]}
    named = survey.evaluate(
        survey.floquet(narrow, **given, **near), at=0.3045, width=5e-4, variables=["monodromy"]
    )
    # as narrow as this it makes y' jump by its area times y, to the order of its width
    trace = 2 * math.cos(2.0) - 0.5 * math.sin(2.0)
    assert (
        abs(float(np.trace(named.monodromy)) - trace) < 2e-2
        and float(named.monodromy_error.max()) < 1e-7
    )


def test_smooth_systems_cost_nothing_more():
    """Sums and products of few sines and cosines are not probed; what a few samples resolve keeps
    its steps.
    """

    def coupled(t, p, out):
        out[0, 1], out[1, 0] = (
            1.0,
            -1.0 - p[0] * math.cos(t) * math.sin(2 * t) - p[1] * math.cos(t) ** 3,
        )

    def smooth(t, p, out):
        out[0, 1], out[1, 0] = 1.0, -p[0] * math.exp(math.cos(t))

    point = np.array([[0.3, 0.2]])
    for A, suspected in ((coupled, 0), (smooth, 1)):
        system = System({"A": A}, 2, 2 * math.pi, (), symplectic=False)
        points = monodromy.SystemPoints(system, point)
        program = points.groups[0].programs[0]
        assert len(probing.suspects(program)) == suspected
        values, low = program.at(point, 2 * math.pi * monodromy.TIMES[None], 2)[0], np.zeros((1, 1))
        ratio = points.scale[:, None, :] / points.scale[:, :, None]
        one = (values * ratio[:, None] * monodromy.WEIGHTS[:4].reshape(2, 2)).sum(axis=(2, 3))[0]
        c = abs(monodromy.TRANSFORM @ one)
        few = 2.0 * max(
            k / (1.0 - math.log(c[k] / c.max())) for k in np.flatnonzero(c > 1e-12 * c.max())
        )
        assert points.rate[0, 0] == pytest.approx(few / (2 * math.pi), rel=1e-9)
        many = probing.rates(program, program.numbers(point), low, low + 2 * math.pi, points.scale)
        assert (many <= probing.SEEN * few).all()
