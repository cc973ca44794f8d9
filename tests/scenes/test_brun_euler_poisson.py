"""Brun's problem by the Euler-Poisson equations in Cartesian components; wells in lanes and one by
one.

M' = M x w + epsilon gamma x I gamma, e' = e x w for the fixed axes e = gamma (vertical), xi, eta in
the body, w = I^-1 M: no angle, no polynomial and no elliptic function.
"""

import numpy as np
import pytest
import xarray as xr

import survey
from survey.kernels.math.dop853 import STAGES, A, B
from survey.truth.brun_digits import NAMES, draw, draw_scaled

STEPS = 300


def euler_angles_to_axes(theta):
    """gamma, xi, eta in the body at psi = phi = 0: the rows of Rx(theta), as (3, 3, n)."""
    one, zero, s, c = np.ones_like(theta), np.zeros_like(theta), np.sin(theta), np.cos(theta)
    return np.array([[zero, s, c], [one, zero, zero], [zero, c, -s]])


def slope(state, inertia, epsilon):
    """Of M and of the axes, state (4, 3, n), at `inertia` (3, n)."""
    momentum, axes = state[0], state[1:]
    rate = momentum / inertia
    torque = np.cross(momentum, rate, axis=0) + epsilon * np.cross(
        axes[0], inertia * axes[0], axis=0
    )
    return np.concatenate([torque[None], np.cross(axes, rate[None], axis=1)])


def integrated(point, times, steps):
    """u, psi and phi modulo 2 pi at `times` (n), by `steps` of DOP853's method of order 8."""
    size_a, size_c, epsilon, theta, p_theta, b, a = point
    inertia = np.stack([size_a, size_a, size_c])
    momentum = np.stack([p_theta, (b - a * np.cos(theta)) / np.sin(theta), a])
    state, h = np.concatenate([momentum[None], euler_angles_to_axes(theta)]), times / steps
    for _ in range(steps):
        slopes = []
        for i in range(STAGES):
            slopes.append(
                slope(state + h * sum(A[i, j] * slopes[j] for j in range(i)), inertia, epsilon)
            )
        state = state + h * sum(B[i] * slopes[i] for i in range(STAGES))
    gamma, xi, eta = state[1:]
    return gamma[2], np.arctan2(xi[2], -eta[2]), np.arctan2(gamma[0], gamma[1])


def states(number, seed):
    """Bodies and states of both signs of k, which pass no pole closely."""
    random = np.random.default_rng(seed)
    size = random.uniform(0.5, 2.0, number)
    p, b, a = random.normal(size=(3, number))
    return np.array([size, size * random.uniform(0.1, 1.9, number), random.uniform(-2.0, 2.0, number),
                     random.uniform(0.5, 2.6, number), p, b, a])  # fmt: skip


def evaluated(point, method="auto", **more):
    arrays = {
        name: xr.DataArray(values.copy(), dims="point")
        for name, values in zip(NAMES, point, strict=True)
    }
    return survey.evaluate("brun", method=method, **arrays, **more)


def turned(difference):
    """Angles as numbers in [-pi, pi]."""
    return np.remainder(difference + np.pi, 2 * np.pi) - np.pi


def test_euler_poisson():
    """One period later u is back and the angles have advanced; at t = 2, u, psi and phi are the
    integrated ones.
    """
    point = states(60, 5)
    ds = evaluated(point)
    assert ds.wells.values.min() == 1 and (ds.verdict == 1).all()
    after, half = (integrated(point, ds.period.values, n) for n in (STEPS, STEPS // 2))
    # short enough steps
    good = np.all([abs(turned(x - y)) < 1e-9 for x, y in zip(after, half, strict=True)], axis=0)
    assert good.sum() > 40
    exact = (np.cos(point[3]), ds.precession.values, ds.spin.values)
    for found, value in zip(after, exact, strict=True):
        assert abs(turned(found - value))[good].max() < 1e-10
    at = evaluated(point, t=2.0)
    for name, found in zip(
        ("u", "psi", "phi"), integrated(point, np.full(60, 2.0), STEPS), strict=True
    ):
        assert np.quantile(abs(turned(found - at[name].values)), 0.7) < 1e-11, name


def agree(one, other, names):
    """Both know the same, within their bars."""
    for name in ("wells", "status", "verdict"):
        assert (one[name] == other[name]).all(), name
    for name in names:
        off = abs(one[name] - other[name])
        assert (
            (off <= one[f"{name}_error"] + other[f"{name}_error"])
            .where(one[name].notnull(), True)
            .all()
        ), name
        assert (one[name].notnull() == other[name].notnull()).all(), name
        wider = (one[f"{name}_error"] / other[f"{name}_error"]).where(other[f"{name}_error"] > 0)
        assert not float(wider.median()) > 1.5, name


VALUES = ("u_min", "u_max", "period", "precession", "spin", "action", "separatrix_distance")


def test_lanes():
    """What is solved in lanes is what agm gives one well at a time; a point's bits do not depend on
    others.
    """
    random = np.random.default_rng(11)
    hard = np.array([draw(random)[1] for _ in range(1000)]).T
    both = np.concatenate([states(1000, 6), hard], axis=1)
    whole = evaluated(both)
    agree(whole, evaluated(both, "agm"), VALUES)
    part = evaluated(both[:, 777:1300])
    for name in VALUES:
        np.testing.assert_array_equal(part[name].values, whole[name].values[777:1300])
    some = survey.evaluate("brun", variables=["precession"], **{n: whole[n] for n in NAMES})
    np.testing.assert_array_equal(some.precession.values, whole.precession.values)


@pytest.mark.parametrize("sign", [1, -1])
def test_lanes_of_scaled_integrals(sign):
    random = np.random.default_rng(12)
    hard = [point for _, s, point in (draw_scaled(random) for _ in range(1500)) if s == sign]
    l, alpha, beta = np.concatenate(  # noqa: E741
        [np.array(hard), random.normal(size=(1500, 3)) * [1.0, 0.4, 0.4]]
    ).T
    arrays = {
        name: xr.DataArray(v.copy(), dims="point")
        for name, v in (("l", l), ("alpha", alpha), ("beta", beta))
    }
    one, other = (
        survey.evaluate("brun", sign=str(sign), method=m, **arrays) for m in ("auto", "agm")
    )
    assert sign == -1 or int((one.wells == 2).sum()) > 50
    agree(one, other, VALUES)
