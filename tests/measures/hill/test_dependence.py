"""How a function depends on its parameters: known cases, and that a polynomial of the found degree
is what it is.
"""

from math import cos, exp, pi, sqrt

import numpy as np
import pytest

from survey.measures.hill.dependence import ENTIRE, OPAQUE, Unknown, degrees


def helper(x):
    return x * x


CASES = [
    (lambda u, p: p[0] + p[1] * cos(2 * u), (1, 1, 0)),
    (lambda u, p: (p[0] + 4 * p[1] * p[2] * cos(2 * u) + 2 * p[2] ** 2) / 3, (1, 1, 2)),
    (lambda u, p: helper(p[0] + u) * p[1] - p[0] ** 3, (3, 1, 0)),
    (lambda u, p: np.cos(p[0] * u) + np.exp(p[1]) * p[2], (ENTIRE, ENTIRE, 1)),
    (lambda u, p: p[1] / (1 + p[0]) + sqrt(p[2]), (OPAQUE, 1, OPAQUE)),
    (lambda u, p: (p[0] if u < 1 else -(p[0] ** 2)) + 2 ** p[1], (2, ENTIRE, 0)),
    (lambda u, p: abs(p[0]) - 3 * -p[1] / 2 + 1.5 - p[2], (OPAQUE, 1, 1)),
    (lambda u, p: sum(x for x in p) * u + p[2] * p[2] * exp(u), (1, 1, 2)),
    (lambda u, p: p[0] ** p[1] + p[2] ** 0.5, (OPAQUE, OPAQUE, OPAQUE)),
]


@pytest.mark.parametrize(("z", "known"), CASES)
def test_degrees_are_found(z, known):
    assert tuple(degrees(z, [None] * 3, np.linspace(0, 2, 9).tolist())) == known


@pytest.mark.parametrize(("z", "known"), CASES)
def test_differences_beyond_the_degree_vanish(z, known):
    """Independent of the code: the (d + 1)-th difference of z in each parameter of finite degree d."""
    for k, degree in enumerate(known):
        if degree < ENTIRE:
            for u in (0.3, 1.4):
                values = []
                for i in range(degree + 2):
                    p = np.array([0.7, 1.3, 0.9])
                    p[k] = 0.5 + 0.25 * i
                    values.append(z(u, p))
                assert abs(np.diff(values, degree + 1)).max() < 1e-12
                assert degree == 0 or abs(np.diff(values, degree)).max() > 1e-3 or u == 0.3


@pytest.mark.parametrize(
    "z",
    [
        lambda u, p: p[0] if p[1] > 0 else 2 * p[0],
        lambda u, p: p[0] if u < p[1] * pi else -p[0],
        lambda u, p: max(p[0], 1.0),
        lambda u, p: p[0] * int(p[1]),
        lambda u, p: p[0] % 2,
        lambda u, p: np.floor(p[0]),
        lambda u, p: np.where(p[0] > 0, 1.0, u),
    ],
)
def test_what_decides_by_a_parameter_is_unknown(z):
    with pytest.raises(Unknown):
        degrees(z, [None, None], [0.1, 2.0])


def test_a_fixed_parameter_may_decide():
    def z(u, p):
        return p[0] + p[1] if u < p[2] * pi else p[0] - p[1] * p[2]

    assert degrees(z, [None, None, 0.5], [0.1, 2.0]) == [1, 1, 0]
    with pytest.raises(Unknown):
        degrees(z, [None, None, None], [0.1, 2.0])


def test_a_function_of_parameters_alone():
    assert degrees(lambda p: (p[0] * pi, 2.0), [None, None]) == [1, 0]
