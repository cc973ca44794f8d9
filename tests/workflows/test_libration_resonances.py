"""The resonances of Danby's map: the map of a revolution, its normal form, and what the resonances do."""

from pathlib import Path

import libration_resonances as command
import numpy as np
import pytest
from scipy.integrate import solve_ivp


def images(mu, e, starts, turns=1):
    """States (n, 4) after each of some revolutions (turns, n, 4), by integration of the full equations."""
    x0, y0 = 0.5 - mu, np.sqrt(3.0) / 2.0

    def slope(f, state):
        u, v, p, q = state.reshape(4, -1)
        x, y = x0 + u, y0 + v
        one, two = np.hypot(x + mu, y) ** 3, np.hypot(x - 1.0 + mu, y) ** 3
        r = 1.0 / (1.0 + e * np.cos(f))
        pull = x - (1.0 - mu) * (x + mu) / one - mu * (x - 1.0 + mu) / two
        across = y - (1.0 - mu) * y / one - mu * y / two
        return np.concatenate([p + v, q - u, q - u + r * pull, -p - v + r * across])

    states, out = starts.T.ravel(), []
    for _ in range(turns):
        states = solve_ivp(
            slope, (0.0, 2 * np.pi), states, method="DOP853", rtol=1e-12, atol=1e-14
        ).y[:, -1]
        out.append(states.reshape(4, -1).T)
    return np.array(out)


@pytest.mark.parametrize(("mu", "e"), [(0.01, 0.3), (0.035, 0.1)])
def test_the_polynomials_are_those_of_the_full_motion(mu, e):
    found = command.revolution(mu, e)
    direction, off = np.array([0.3, -0.5, 0.4, 0.2]), []
    for size in (2e-3, 1e-3):
        start = size * direction
        value = found @ np.array([np.prod(start**p) for p in command.POWERS])
        off.append(abs(value - images(mu, e, start[None])[0, 0]).max())
    assert 12.0 < off[0] / off[1] < 20.0 and off[1] < 1e-7  # of order 4


def test_on_circles_the_normal_form_is_that_of_deprit_and_deprit_bartholome():
    for mu in (0.005, 0.01, 0.02, 0.03, 0.036):
        one, two = np.sqrt(0.5 * (1 + np.array([1, -1]) * np.sqrt(1 - 27 * mu * (1 - mu))))
        a = (
            two**2
            * (81 - 696 * one**2 + 124 * one**4)
            / (144 * (1 - 2 * one**2) ** 2 * (1 - 5 * one**2))
        )
        b = (
            -one
            * two
            * (43 + 64 * (one * two) ** 2)
            / (6 * (4 * (one * two) ** 2 - 1) * (25 * (one * two) ** 2 - 4))
        )
        c = (
            one**2
            * (81 - 696 * two**2 + 124 * two**4)
            / (144 * (1 - 2 * two**2) ** 2 * (1 - 5 * two**2))
        )
        theta, _, cubic = command.normal_form(mu, 0.0)
        assert np.allclose(command.twist(theta, cubic) / (2 * np.pi), [a, b, c], rtol=1e-7)
        assert np.allclose(
            np.exp(1j * theta), np.exp(2j * np.pi * np.array([one, -two])), atol=1e-9
        )


@pytest.mark.slow
def test_on_ellipses_the_angles_grow_as_the_normal_form_says():
    mu, e, turns = 0.01, 0.2, 240
    theta, _F, cubic = command.normal_form(mu, e)
    a = command.twist(theta, cubic)
    linear = command.revolution(mu, e)[:, command.LINEAR]
    _, V = command.diagonal(linear)
    sizes = np.array([0.001, -0.001, 0.003, -0.003])  # what is odd in the size cancels
    starts = np.array([(V @ np.array([q, 0.0, q, 0.0])).real for q in sizes])
    paths = images(mu, e, starts, turns)
    x = np.arange(1, turns) / turns
    weights, rates = np.exp(-1.0 / (x * (1 - x))), []
    for i in range(4):
        q = (np.linalg.inv(V) @ paths[:, i].T)[0]
        steps = np.angle(q[1:] / q[:-1] * np.exp(-1j * theta[0]))
        rates.append((weights * steps).sum() / weights.sum())
    grown = (rates[2] + rates[3] - rates[0] - rates[1]) / 2 / (sizes[2] ** 2 - sizes[0] ** 2)
    # what is left is of the square of the size
    assert abs(grown - 2 * a[0]) < 0.05 * abs(2 * a[0]), (grown, 2 * a[0])


def test_the_resonances_of_the_circular_problem_are_where_and_what_is_known():
    found = {(k, round(mu, 9)): command.effect(k, *command.normal_form(mu, 0.0))[0]
             for k, mu, _ in command.places(0.0) if k in ((1, 2), (1, 3), (2, 2))}  # fmt: skip
    assert found[(1, 2), 0.024293897] == found[(1, 3), 0.013516016] == command.UNSTABLE
    assert {what for (k, mu), what in found.items() if k == (2, 2)} == {command.STABLE}


@pytest.mark.slow
def test_at_a_resonance_of_order_3_motions_leave_and_beside_it_they_stay():
    ((_, mu, _),) = [place for place in command.places(0.2) if place[0] == (1, 2)]
    away = []
    for at in (mu, mu - 0.004):
        linear = command.revolution(at, 0.2)[:, command.LINEAR]
        _, V = command.diagonal(linear)
        phases = np.exp(1j * np.linspace(0.0, 2 * np.pi, 3, endpoint=False))
        q = 0.0015 * np.stack([phases, np.sqrt(2.0) * np.ones(3)], axis=1)
        paths = images(
            at, 0.2, np.array([(V @ np.concatenate([x, x.conj()])).real for x in q]), 100
        )
        sizes = abs(np.linalg.inv(V) @ paths.transpose(0, 2, 1))[:, 0]
        away.append(sizes.max() / 0.0015)
    assert away[0] > 10.0 > 2.0 > away[1], away


def test_the_table_is_the_committed_one():
    results = Path(command.__file__).parent.parent / "results"
    lines = (results / "libration_resonances.csv").read_text().splitlines()
    own = [line.split(",") for line in lines if line.split(",")[2] == "0.3"]
    found = command.table([0.3])
    assert len(own) == len(found)
    for (k1, k2, _, mu, what, *_), (k, _, here, effect, *_) in zip(own, found, strict=True):
        assert (int(k1), int(k2), what) == (*k, effect) and abs(float(mu) - here) < 1e-9
