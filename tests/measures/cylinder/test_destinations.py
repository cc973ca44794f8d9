"""Where the branches of the saddles go: long integration by SciPy from the eigenvectors, exact
cases, time reversal.
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import survey
from survey.measures.cylinder import destinations as ds
from survey.measures.cylinder import fate as cf
from survey.measures.cylinder import portrait as cp
from survey.methods import taylor

TWO_PI = 2.0 * math.pi


def rates(six):
    b12, b31, d, c23, s2, s3 = six

    def right(_t, y):
        s, c = math.sin(y[0]), math.cos(y[0])
        return [
            y[1],
            (b12 * c - b31 * s) * y[1] - d * c * s - c23 * (c * c - s * s) + s2 * c - s3 * s,
        ]

    return right


def long_run(six, found, angle, branch, section):
    """(end, limit) of a branch by DOP853 from its eigenvector, or None where it is not clear at the
    end of time.
    """
    b12, b31, d, c23, s2, s3 = six
    s, c = math.sin(angle), math.cos(angle)
    f, dg = b12 * c - b31 * s, -d * (c * c - s * s) + 4 * c23 * s * c - s2 * s - s3 * c
    sign = 1 if branch.startswith("unstable") else -1
    x = 1e-7 * (1 if branch.endswith("right") else -1)
    w = 0.5 * (f + sign * math.sqrt(f * f + 4 * dg)) * x
    far = lambda _t, y: abs(y[1]) - 30.0  # noqa: E731
    far.terminal = True
    passing = lambda _t, y: math.sin(0.5 * (y[0] - section))  # noqa: E731
    run = solve_ivp(
        rates(six),
        (0, sign * 250),
        [angle + x, w],
        "DOP853",
        events=(far, passing),
        rtol=1e-9,
        atol=1e-11,
    )
    phi, w = run.y[:, -1]
    if len(run.t_events[0]):
        return (ds.PLUS_INFINITY if w > 0 else ds.MINUS_INFINITY), 0
    gaps = np.abs(np.sin(0.5 * (found["equilibrium_phi"] - phi)))
    if np.nanmin(gaps) + abs(w) < 1e-3:
        return ds.EQUILIBRIUM, 1 + int(np.nanargmin(gaps))
    passages = (
        run.y_events[1][-20:, 1]
        if len(run.t_events[1]) and abs(run.t_events[1][-1] - run.t[-1]) < 50
        else ()
    )
    for i, (kind, own) in enumerate(zip(found["cycle_kind"], found["cycle_w"], strict=True)):
        off = np.abs(passages - own)
        if (
            kind in (1, 2)
            and len(off) > 5
            and off[-1] < max(0.05 * abs(own) * (off[-1] < off[0]), 1e-5)
        ):
            return (ds.ROTATION_PLUS if kind == 1 else ds.ROTATION_MINUS), i + 1
    tail = run.y[:, abs(run.t) > 200]
    own = np.flatnonzero(found["cycle_kind"] == 3)
    if len(own) == 1 and np.ptp(tail[0]) < TWO_PI and np.ptp(tail[1]) > 1e-2:
        return ds.LIBRATION, 1 + int(own[0])
    return None


def systems(seed, count):
    random = np.random.default_rng(seed)
    rows = random.normal(size=(count, 6)) * [1, 1, 2, 2, 3, 3]
    rows[1::2, 2:] = 0.3 * rows[::2, 2:][: len(rows[1::2])]
    return rows


def against_long_runs(rows):
    found, checked = cp.solve(taylor, rows, 1e-10), {}
    for i, six in enumerate(rows):
        one = {name: values[i] for name, values in found.items()}
        assert (one["branch_end"][one["equilibrium_type"] != 1] == ds.NONE).all()
        for row in np.flatnonzero(one["equilibrium_type"] == 1):
            for at, branch in enumerate(ds.BRANCHES):
                true = long_run(
                    six,
                    one,
                    one["equilibrium_phi"][row],
                    branch,
                    cf.remembered(taylor, six).section,
                )
                said = int(one["branch_end"][row, at]), int(one["branch_limit"][row, at])
                if true is not None and said[0] != ds.UNDECIDED:
                    assert said == true, (six, row, branch)
                    checked[said[0]] = checked.get(said[0], 0) + 1
    return checked


@pytest.mark.slow
def test_branches_go_where_long_integration_takes_them():
    checked = against_long_runs(systems(3, 4))
    assert sum(checked.values()) > 8 and len(checked) == 5


@pytest.mark.slow
def test_many_branches_go_where_long_integration_takes_them():
    checked = against_long_runs(systems(2, 60))
    assert sum(checked.values()) > 150 and len(checked) == 6


@pytest.mark.parametrize("six", systems(3, 6))
def test_the_reversed_skeleton_is_that_of_the_reversed_flow(six):
    turned = ds.backward(cf.remembered(taylor, six))
    own = cf.skeleton(taylor, [-six[0], -six[1], *six[2:]])
    np.testing.assert_array_equal(turned.equilibria, own.equilibria)
    assert (turned.ends == own.ends).all() and turned.section == own.section
    for name in ("plus", "minus", "librations"):
        one, two = getattr(turned, name), getattr(own, name)
        assert len(one) == len(two)
        np.testing.assert_allclose(one[:, :2], two[:, :2], rtol=1e-9)
        # class, interval and the signs beside it
        np.testing.assert_array_equal(one[:, 6:10], two[:, 6:10])


def ends(**six):
    found = survey.evaluate("gyrostat", question="portrait", **six)
    return found.branch_end.values, found.branch_limit.values


def test_of_a_pendulum_all_come_back():
    end, limit = ends(s3=1.0)
    assert (
        (end[1] == ds.EQUILIBRIUM).all()
        and (limit[1] == 2).all()
        and (end[[0, 2, 3]] == ds.NONE).all()
    )


def test_of_two_saddles_of_one_energy_each_goes_to_the_other():
    end, limit = ends(d=1.0)  # g = -sin 2phi / 2
    assert (end[[1, 3]] == ds.EQUILIBRIUM).all() and (limit[1] == 4).all() and (limit[3] == 2).all()


def test_a_lower_saddle_has_a_loop_of_its_own():
    end, limit = ends(d=1.0, s2=0.1, s3=0.2)
    for row in np.flatnonzero(end[:, 0] != ds.NONE):
        assert (end[row] == ds.EQUILIBRIUM).all() and (limit[row] == row + 1).all()


@pytest.mark.parametrize(
    ("current", "to_the_right"),
    [pytest.param(0.1, ds.EQUILIBRIUM, marks=pytest.mark.slow), (0.2, ds.ROTATION_PLUS)],
)
def test_of_a_junction_the_branch_changes_its_end_at_the_homoclinic_curve(current, to_the_right):
    """Its damping is 0.1: I = 0.4 / pi = 0.127."""

    def g(phi, p):
        return p[1] - np.sin(phi)

    scene = survey.abel(lambda phi, p: -p[0], g, parameters=("a", "I"), period=TWO_PI)
    found = survey.evaluate(scene, question="portrait", a=0.1, I=current)
    saddle = int(np.flatnonzero(found.equilibrium_type == 1)[0])
    assert found.branch_end[saddle].sel(branch="unstable_right") == to_the_right
    assert found.branch_end[saddle].sel(branch="unstable_left") == ds.EQUILIBRIUM
    assert found.branch_end[saddle].sel(branch="stable_left") == (
        ds.PLUS_INFINITY if to_the_right == ds.EQUILIBRIUM else ds.MINUS_INFINITY
    )
