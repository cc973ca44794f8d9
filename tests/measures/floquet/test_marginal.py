"""Systems without a structure that are marginal by what is exact in A: against closed forms and
scenes of their own.
"""

import math

import numpy as np
import pytest

import survey

UNDECIDED, UNSTABLE, STABLE, MARGINAL = -1, 0, 1, 2
T = 2 * math.pi


def evaluated(A, states, **axes):
    scene = survey.floquet(A, period=T, parameters=tuple(axes), states=states)
    return survey.evaluate(scene, **axes)


@pytest.mark.parametrize("method", ["auto", "dop853"])
def test_without_damping_the_map_is_mathieus(method):
    def A(t, p, out):
        out[0, 1] = 1.0
        out[1, 0] = -(p[0] - 2 * p[1] * math.cos(2 * t))
        out[1, 1] = -2 * p[2]

    axes = {"a": np.linspace(-0.507, 6.03, 23), "q": np.linspace(0.013, 4.1, 9)}
    names = {"parameters": ("a", "q", "c"), "states": ("x", "v")}
    scene = survey.floquet(A, period=math.pi, **names)
    ours = survey.evaluate(scene, **axes, c=[0.0, 1e-3], method=method)
    known = survey.evaluate("mathieu", **axes).verdict.values
    undamped = ours.isel(c=0)
    assert np.array_equal(undamped.verdict.values, np.where(known == STABLE, MARGINAL, known))
    marginal = undamped.verdict == MARGINAL
    assert (undamped.spectral_radius.where(marginal, 1.0) == 1.0).all()
    assert (undamped.spectral_radius_error.where(marginal, 0.0) == 0.0).all()
    assert (undamped.exponent.where(marginal, 0.0) == 0.0).all()
    assert (undamped.status == 0).all()
    # any damping decides the others
    assert (ours.verdict.isel(c=1).values[known == STABLE] == STABLE).all()


def test_rotations_are_marginal_unless_they_are_so_by_rounding_alone():
    """x' = w x: |x| is constant where the matrix w is antisymmetric."""

    def rotating(factor):
        def A(t, p, out):
            wave = p[1] * (math.sin(2 * t) + math.cos(t))
            one, two, three = p[0], p[1] * math.cos(t), wave
            out[0, 1], out[1, 0] = one, -one * factor
            out[1, 2], out[2, 1] = two, -two
            out[0, 2], out[2, 0] = three, -three

        return evaluated(A, ("x", "y", "z"), w=[0.3, 1.0], h=[0.5, 4.0]).verdict

    assert (rotating(1.0) == MARGINAL).all()
    assert (rotating(1.0 + 1e-15) != MARGINAL).all()

    def B(t, p, out):
        out[0, 1], out[1, 0] = p[0] + 0.1, -(p[1] + 0.3)
        out[0, 0], out[1, 1] = 0.1 * math.cos(t), 0.2 * math.cos(t)

    # 0.2 + 0.1 is not 0.3, but for rounding: their sum is 0.30000000000000004
    assert evaluated(B, ("x", "y"), a=0.2, b=0.0).verdict != MARGINAL


def free(t, p, out):
    """A rotor whose angle has no effect, and an oscillator that it drives."""
    out[0, 1] = 1.0
    out[1, 1] = -p[0] * (1 + 0.5 * math.cos(t))
    out[2, 3], out[3, 3] = 1.0, -0.2
    out[3, 2] = -1.2 - p[1] * math.cos(t)
    out[3, 1] = 0.3


def test_a_free_angle_beside_decaying_states_is_marginal():
    e = np.linspace(0.0, 3.0, 31)
    ds = evaluated(free, ("angle", "rate", "x", "v"), c=[0.1, 0.0, -0.1], e=e)

    def oscillator(t, p, out):
        out[0, 1], out[1, 1], out[1, 0] = 1.0, -0.2, -1.2 - p[0] * math.cos(t)

    alone = evaluated(oscillator, ("x", "v"), e=e).verdict.values
    assert {UNSTABLE, STABLE} <= set(alone)
    assert np.array_equal(ds.verdict.values[0], np.where(alone == STABLE, MARGINAL, alone))
    # without friction the angle grows with t: nothing is claimed
    assert np.array_equal(ds.verdict.values[1], np.where(alone == STABLE, UNDECIDED, alone))
    assert (ds.verdict.values[2] == UNSTABLE).all()
    point = ds.isel(c=[0], e=[0]).survey.point(c=0.1, e=0.0)
    assert point.why.startswith("spectral radius 1")


def test_a_conserved_state_beside_decaying_ones_is_marginal():
    def A(t, p, out):
        out[0, 0], out[0, 1] = -p[0] + math.cos(t), 1.0 + math.sin(t)

    found = evaluated(A, ("x", "c"), a=[0.3, 0.0, -0.3]).verdict.values
    assert found.tolist() == [MARGINAL, UNDECIDED, UNSTABLE]


def test_what_time_reverses_is_marginal_where_its_multipliers_are_simple_and_on_the_circle():
    """Oscillators with coupling of no symmetric matrix: no Hamiltonian system."""

    def A(t, p, out):
        wave = p[1] * math.cos(t)
        out[0, 1] = out[2, 3] = 1.0
        out[1, 0], out[1, 2] = -p[0] - wave, 0.3 * wave
        out[3, 2], out[3, 0] = -2.7 * p[0] - wave, 0.7 * wave
        out[1, 1], out[3, 3] = -p[2], -2 * p[2]

    axes = {"a": np.linspace(0.3, 0.95, 12), "b": [0.1, 0.3]}
    names = {"parameters": ("a", "b", "c"), "states": ("x", "v", "y", "w")}
    given = [
        survey.floquet(A, period=T, structure=structure, **names)
        for structure in ("none", "reversible")
    ]
    plain, reversible = (survey.evaluate(scene, **axes, c=0.0).verdict.values for scene in given)
    assert {UNSTABLE, STABLE} <= set(np.unique(reversible))
    assert np.array_equal(plain, np.where(reversible == STABLE, MARGINAL, reversible))
    assert (survey.evaluate(given[0], **axes, c=1e-3).verdict != MARGINAL).all()


def test_another_method_agrees():
    e = np.linspace(0.0, 3.0, 6)
    ds = evaluated(free, ("angle", "rate", "x", "v"), c=[0.1, 0.5], e=e)
    assert (ds.verdict == MARGINAL).any()
    again = survey.evaluate(
        survey.floquet(free, period=T, parameters=("c", "e"), states=("angle", "rate", "x", "v")),
        c=ds.c.values,
        e=e,
        method="dop853",
    )
    assert np.array_equal(ds.verdict.values, again.verdict.values)
