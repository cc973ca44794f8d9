"""Half or a quarter of a period: which symmetries in t are found, and what follows from them,
against exact answers.
"""

import math

import mpmath
import numpy as np
import pytest
from floquet_truth import evaluated, multipliers
from scipy.optimize import linear_sum_assignment

import survey
from survey.measures.floquet import monodromy
from survey.measures.floquet.system import System

AUTO = monodromy.method_of("auto")


def oscillators(modulation, damping=0.0, coupling=lambda t, p: 0.0):
    """Two of them, with a modulated stiffness and a modulated coupling; p is their size."""

    def A(t, p, out):
        out[0, 2] = out[1, 3] = 1.0
        out[2, 0], out[3, 1] = -1.0 - p[0] * modulation(t, p), -0.4 - p[0] * modulation(t, p)
        out[2, 1] = out[3, 0] = -p[0] * coupling(t, p)
        out[2, 2] = out[3, 3] = -damping * p[1]

    return A


def points_of(A, period, p=(0.3, 0.1), n=4, breaks=()):
    return monodromy.SystemPoints(
        System({"A": A}, n, period, breaks, False), np.atleast_2d(np.array(p, float)), halves=True
    )


def parts(points):
    return [images.parts for group in points.groups for images in group.images]


def spike(t, p):
    return math.exp(-(((t - 1.0) / 0.02) ** 2))


T = 2 * math.pi
KNOWN = {
    "even": (oscillators(lambda t, p: math.cos(t)), T, 2),
    "even, of higher harmonics and a quotient": (
        oscillators(lambda t, p: math.cos(3 * t) + 1 / (1 + 0.3 * math.cos(t)) + math.exp(math.sin(t) ** 2)), T, 2),
    "even, by a product of odd ones": (oscillators(lambda t, p: math.sin(t) * math.sin(3 * t) * math.cos(t)), T, 2),
    "an even frequency of the parameters": (oscillators(lambda t, p: math.cos(p[0] * t)), lambda p: T / p[0], 2),
    "coupled by what changes its sign": (
        oscillators(lambda t, p: math.cos(2 * t), coupling=lambda t, p: math.cos(t)), T, 4),
    "the period is twice what is needed": (oscillators(lambda t, p: math.cos(2 * t + 0.3), 1.0), T, 2),
    "even about a phase that is pi": (oscillators(lambda t, p: math.cos(t + math.pi)), T, 2),
    "damped": (oscillators(lambda t, p: math.cos(t), 1.0), T, 1),
    "neither even nor odd": (oscillators(lambda t, p: math.cos(t) + math.sin(2 * t)), T, 1),
    "nearly even": (oscillators(lambda t, p: math.cos(t) + 1e-14 * math.sin(t)), T, 1),
    "a phase": (oscillators(lambda t, p: math.cos(t + p[0])), T, 1),
    "nearly a period": (oscillators(lambda t, p: math.cos(t)), T * (1 + 1e-13), 1),
    "a spike in one half": (oscillators(lambda t, p: math.cos(t) + spike(t, p)), T, 1),
    "a phase that a few samples would not show": (
        oscillators(lambda t, p: math.cos(t + p[1] * 1e-12)), T, 1),
}  # fmt: skip


@pytest.mark.parametrize("name", KNOWN)
def test_symmetries_are_found_where_they_are_and_nowhere_else(name):
    A, period, expected = KNOWN[name]
    assert parts(points_of(A, period)) == [expected]


@pytest.mark.parametrize("name", [name for name, known in KNOWN.items() if known[2] > 1])
def test_what_follows_from_a_part_agrees_with_the_whole_period_and_has_no_wider_bars(name):
    A, period, _ = KNOWN[name]
    p = np.random.default_rng(1).uniform(0.2, 1.5, (30, 2))
    system, those, factor = System({"A": A}, 4, period, (), False), np.arange(30), np.full(30, 2.0)
    part, whole = (
        monodromy.solve(
            monodromy.SystemPoints(system, p, halves=each), AUTO, 1e-13, factor, those, sharp=False
        )
        for each in (True, False)
    )
    assert (part.M != whole.M).any()
    assert (abs(part.M - whole.M) <= part.E + whole.E).all() and part.E.max() < 1e-9
    assert np.median(part.E.max(axis=(1, 2)) / whole.E.max(axis=(1, 2))) < 1.05


def test_what_a_phase_lacks_to_a_multiple_of_pi_counts_as_an_error_of_A():
    A = oscillators(lambda t, p: math.cos(t))
    near, exact = (points_of(A, period, p=(0.9, 0.0)) for period in (T * (1 + 1.6e-15), T))
    lacks = float(near.period[0]) - 2 * mpmath.mp.pi
    assert parts(near) == [2] and near.noise[0, 0] - exact.noise[0, 0] > 0.9 * float(lacks)
    part, whole = (
        monodromy.solve(each, AUTO, 1e-14, np.ones(1), np.zeros(1, int), sharp=False)
        for each in (near, monodromy.SystemPoints(near.system, near.points))
    )
    assert (abs(part.M - whole.M) <= part.E + whole.E).all()


def test_points_without_damping_are_distinguished_from_those_with_it():
    A = oscillators(lambda t, p: math.cos(t), 1.0)
    p = np.array([[0.3, 0.1], [0.3, 0.0], [0.2, 0.2], [0.4, 0.0]])
    points = points_of(A, T, p)
    found = {tuple(group.own): [images.parts for images in group.images] for group in points.groups}
    assert found == {(0, 2): [1], (1, 3): [2]}
    together = monodromy.solve(points, AUTO, 1e-10, np.ones(4), np.arange(4), sharp=True)
    for k in range(4):
        alone = monodromy.solve(
            points_of(A, T, p[k]), AUTO, 1e-10, np.ones(1), np.zeros(1, int), sharp=True
        )
        assert (alone.M[0] == together.M[k]).all() and (alone.E[0] == together.E[k]).all()


def test_each_piece_between_breaks_has_a_symmetry_of_its_own():
    def A(t, p, out):
        out[0, 1], out[1, 0] = (
            1.0,
            -1.0 - (p[0] * math.cos(4 * t) if t < math.pi else p[0] * math.cos(t + p[1])),
        )

    points = points_of(A, T, n=2, breaks=(math.pi,))
    assert parts(points) == [4, 1]
    found, whole = (
        monodromy.solve(each, AUTO, 1e-12, np.ones(1), np.zeros(1, int), sharp=False)
        for each in (points, monodromy.SystemPoints(points.system, points.points))
    )
    assert (abs(found.M - whole.M) <= found.E + whole.E).all() and found.E.max() < 1e-11


def test_another_method_integrates_the_whole_period():
    """So that `survey verify` does not take a symmetry for granted."""
    A, period, _ = KNOWN["coupled by what changes its sign"]
    scene = survey.floquet(A, period=period, parameters=("p", "c"), states=("x", "y", "u", "v"))
    given = {"p": np.linspace(0.1, 0.9, 5), "c": 0.0, "variables": ["monodromy"]}
    one, two = (survey.evaluate(scene, **given, method=method) for method in ("auto", "dop853"))
    assert (abs(one.monodromy - two.monodromy) <= one.monodromy_error + two.monodromy_error).all()


def reversible(n, number, seed):
    """Matrices B (number, n, n) with R B R = -B, R = (1, -1, 1, -1, ...): oscillating, growing,
    nearly defective.
    """
    rng = np.random.default_rng(seed)
    B = np.zeros((number, n, n))
    for k in range(number):
        size = 10.0 ** rng.uniform(-1.5, 0.5)
        one, two = size * rng.normal(size=(2, n // 2, n // 2))
        if k % 3 == 0:  # squares of frequencies that nearly meet
            one, two = (
                size * np.eye(n // 2),
                -size * (np.eye(n // 2) + np.triu(np.ones((n // 2, n // 2)), 1)),
            )
            two -= size * np.diag(10.0 ** rng.uniform(-12, -6, n // 2))
        B[k, ::2, 1::2], B[k, 1::2, ::2] = one, two
    return B


@pytest.mark.parametrize(
    "n, number", [(2, 60), (4, 40), pytest.param(6, 20, marks=pytest.mark.slow)]
)
def test_reversible_systems_in_turning_coordinates(n, number):
    check_reversible(n, number, seed=n)


@pytest.mark.slow
@pytest.mark.parametrize("n, number", [(2, 10_000), (4, 5_000), (6, 2_000)])
def test_very_many_reversible_systems(n, number):
    check_reversible(n, number, seed=100 + n)


def check_reversible(n, number, seed):
    """The period is that of the coordinates, in which A repeats itself after half of it."""
    B = reversible(n, number, seed)
    for k, exact in enumerate(map(multipliers, B)):
        B[k] /= max(1.0, math.log10(float(max(abs(x) for x in exact))) / 8)
    ds = evaluated(n, B)
    found, bars = (
        ds.multiplier_re.values + 1j * ds.multiplier_im.values,
        ds.multiplier_re_error.values,
    )
    decided = 0
    for k, exact in enumerate(map(multipliers, B)):
        radius = max(abs(value) for value in exact)
        # stable is never certain without a structure; marginal is where all are on the circle
        assert int(ds.status[k]) == 0 and int(ds.verdict[k]) in (-1, 0, 2)
        assert int(ds.verdict[k]) != 2 or abs(radius - 1) < 1e-20
        assert abs(radius - float(ds.spectral_radius[k])) <= float(ds.spectral_radius_error[k])
        off = np.array(
            [[float(abs(mpmath.mpmathify(complex(x)) - y)) for y in exact] for x in found[k]]
        )
        beyond = ~(off <= bars[k][:, None])
        assert not beyond[linear_sum_assignment(beyond)].any()
        assert not (radius - 1 > 1e-3 and k % 3 and int(ds.verdict[k]) < 0)
        decided += int(ds.verdict[k]) == 0
    assert decided > number / 8
