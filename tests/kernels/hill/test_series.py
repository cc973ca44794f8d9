"""Error bounds between the nodes of a Chebyshev series, by Lagrange's polynomials: against multiprecision."""

import mpmath
import numpy as np
import pytest

from survey.kernels.hill.series import discriminants, neighbours
from survey.kernels.math import chebyshev
from survey.kernels.math.chebyshev import TERMS


def by_the_kernel(x, n):
    """The magnitudes (n, L) of the n polynomials at x (L): each is the bound of a row known at all
    nodes but one.
    """
    at_nodes = np.zeros((n, -(-n // TERMS) * TERMS))
    at_nodes[:, :n] = np.eye(n)
    size = n * x.size
    values, bars = np.empty(size), np.empty(size)
    verdict, missed = np.empty(size, np.int8), np.empty(size, np.bool_)
    zeros = np.zeros_like(at_nodes)
    given = np.arange(n), zeros, zeros[:, 0].copy(), at_nodes, n, x, 1e-9
    discriminants(*given, values, bars, np.empty(0, np.float32), verdict, missed)
    assert (missed == ~(bars <= 1e-9)).all() and (values == 0).all()
    return bars.reshape(n, x.size)


@pytest.mark.parametrize("magnitudes", [chebyshev.lagrange, by_the_kernel])
@pytest.mark.parametrize("n", [8, 10, 20, 48])
def test_lagranges_polynomials_are_bounded_at_and_beside_their_nodes(magnitudes, n):
    nodes = chebyshev.symmetric_nodes(n)
    beside = [
        np.nextafter(nodes, 2),
        np.nextafter(nodes, -2),
        nodes + 1e-12,
        nodes - 1e-8,
        nodes + 1e-4,
    ]
    x = np.concatenate([nodes, *beside, np.random.default_rng(n).uniform(-1, 1, 100), [-1.0, 1.0]])
    x = np.clip(x, -1, 1)
    found = magnitudes(x, n)
    with mpmath.workdps(40):
        angles = [mpmath.pi * (2 * i + 1) / (2 * n) for i in range(n)]
        t = [mpmath.cos(n * mpmath.acos(mpmath.mpf(float(place)))) for place in x]
        for i, angle in enumerate(angles):
            weight, node = mpmath.sin(angle) / n, mpmath.cos(angle)
            exact = np.array(
                [float(abs(weight * top / (place - node))) for top, place in zip(t, x, strict=True)]
            )
            assert (found[i] >= exact * (1 - 1e-15)).all()
            far = abs(x - nodes[i]) > 1e-5
            assert (found[i][far] <= exact[far] + 1e-9).all() and (found[i] <= 1.4143).all()


@pytest.mark.parametrize("number", [1, 2, 17, 384])
@pytest.mark.parametrize("half", [False, True])
def test_nodes_around_a_point_are_those_by_the_angle(number, half):
    rng = np.random.default_rng(number)
    x = np.concatenate(
        [rng.uniform(-1, 1, 5000), [-1.0, 0.0, 1.0, 1.0 + 2.0**-52, -np.inf, np.inf]]
    )
    kept = (number + 1) // 2 if half else number
    left, right = np.empty((2, x.size), np.int64)
    share = np.empty(x.size)
    neighbours(x, number, kept, left, right, share)
    node, near = np.arccos(np.clip(x, -1.0, 1.0)) * number / np.pi - 0.5, 1e-8 * number
    assert (np.clip(node, 0, kept - 1) - left - share < near).all()
    assert (left - np.clip(node, 0, kept - 1) < near).all()
    assert ((right - left == 1) | ((right == left) & (share == 0))).all()
    assert ((left == 0) | (left - node < near)).all()
    assert ((right == kept - 1) | (node - right < near)).all()
    inside = (node > near) & (node < kept - 1 - near)
    assert abs(left + share - node)[inside].max(initial=0.0) < near
    neighbours(np.array([np.nan]), number, kept, left[:1], right[:1], share[:1])
    assert 0 <= left[0] <= right[0] < kept and 0 <= share[0] < 1
