"""Branches of the saddles against 40 digits: the variants of (66), general b, all four branches; in
narrow bars.
"""

import mpmath as mp
import numpy as np
import pytest
import separatrix_truth as truth
from flow_truth import exact

import survey
from survey.kernels.cylinder.steps import EQUILIBRIUM, NO_CONVERGENCE, OK, SEPARATRIX, TURNING
from survey.measures.cylinder import separatrix
from survey.methods import closed, dop853, taylor
from survey.status import INVALID_PARAMETERS

GENERIC = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)  # saddles at 0.89997 and 4.65095
CASES = {  # six, number of the saddle, phi0, stable, left
    "around the cylinder": ((0, 0, 0, 0, 0, 1.0), 1, -3.0, False, False),
    "around it, stable, to the left": ((0, 0, 0, 0, 0, 1.0), 1, 0.5, True, True),
    "a loop that turns": ((0, 0, 1.1, 0.3, 0.5, -0.2), 1, 1.5, False, False),
    "a loop, stable": ((0, 0, 1.1, 0.3, 0.5, -0.2), 1, 1.5, True, False),
    "to a second saddle": ((0, 0, 1.1, 0.3, 0.0, 0.0), 1, 2.0, False, False),
    "to a second saddle at another height": ((0, 0, -3.0, 0.0, 1.0, 0.0), 2, 0.5, False, False),
    "to a second saddle, backwards": ((0, 0, -3.0, 0.0, 1.0, 0.0), 2, 4.5, True, True),
    "beside the saddle": ((0, 0, 1.1, 0.3, 0.5, -0.2), 2, 4.650949, False, False),
    "next to a second saddle of its height": ((0, 0, -3.0, 1e-9, 1.0, 0.0), 2, 0.5, False, False),
    "b, unstable to the right": (GENERIC, 2, 5.2, False, False),
    "b, unstable to the left": (GENERIC, 2, 4.0, False, True),
    "b, stable to the right": (GENERIC, 1, 1.2, True, False),
    "b, stable to the left": (GENERIC, 2, 3.5, True, True),
    "b, beside the saddle, three turns on": (GENERIC, 2, 4.66 + 6 * np.pi, False, False),
    "(61)": ((1.0, 0.0, -2.0, 0.0, 0.5, 0.0), 1, 4.0, False, False),
}
# of which the others are variations
TELLING = (
    "a loop that turns",
    "b, beside the saddle, three turns on",
    "(61)",
)
TIMES = np.array([[-5.0, -0.3, 0.0, 0.2, 2.0, 7.0]])


def start(case):
    six, number, phi0, stable, left = case
    return np.array([[*six, phi0, number]], float), {"stable": stable, "left": left}


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name not in TELLING)) for name in CASES]
)
def test_trajectories_lie_within_narrow_bars(name):
    case = CASES[name]
    rows, how = start(case)
    floats, turnings, status, heads = separatrix.trajectories(None, rows, TIMES, 1e-10, **how)
    angle, w, begin = truth.branch(*case)
    assert (status == OK).all() and abs(heads[0, 0] - angle) <= heads[0, 1] < 1e-14
    assert abs(heads[0, 2] - w) <= heads[0, 3] < 1e-15 * (1 + abs(w))
    for t, found, count in zip(TIMES[0], floats[0], turnings[0], strict=True):
        wanted = truth.at(case[0], begin, t)
        assert all(abs(found[i] - wanted[i]) <= found[2 + i] + 1e-32 for i in (0, 1)), (
            t,
            found,
            wanted,
        )
        assert (found[2:] <= 1e-12 * (1 + np.abs(found[:2]))).all(), t
        assert (
            count == ("loop" in name and t == 7.0 and not case[3])
            or case[0][0]
            or (case[3] and t == -5.0)
        )


@pytest.mark.parametrize("name", CASES)
def test_times_and_velocities_at_angles(name):
    case = CASES[name]
    rows, how = start(case)
    times = np.array([[-1.1, 0.0, 0.4]])
    floats, _n, _s, heads = separatrix.trajectories(None, rows, times, 1e-10, **how)
    targets = floats[..., 0]
    found, status, _heads = separatrix.abel(None, rows, targets, 1e-10, **how)
    for j in np.flatnonzero(status[0] == OK):
        slack = 4e-15 + 20 * (floats[0, j, 2] + 1e-15) / abs(floats[0, j, 1])
        assert abs(found[0, j, 1] - times[0, j]) <= found[0, j, 3] + slack
        assert (
            abs(found[0, j, 0] - floats[0, j, 1])
            <= found[0, j, 2] + floats[0, j, 3] + 20 * floats[0, j, 2]
        )
        assert found[0, j, 2] < 1e-14 * (1 + abs(found[0, j, 0])) and found[0, j, 3] < 1e-13
    assert (status[0, :2] == OK).all() and np.isin(status[0, 2], (OK, TURNING))
    beyond = targets[0, 1] + (-20.0 if how["left"] else 20.0)
    found, status, _heads = separatrix.abel(
        None, rows, np.array([[heads[0, 0], beyond]]), 1e-10, **how
    )
    assert np.isin(status, (EQUILIBRIUM, TURNING, OK, SEPARATRIX)).all()


def test_an_abel_solution_ends_where_its_branch_turns():
    """The pendulum with a second harmonic: w^2 = 2 (V(phi_s) - V(phi)), turning where that is 0 again."""
    six = (0, 0, 1.1, 0.3, 0.5, -0.2)
    rows = np.array([[*six, 1.5, 1]], float)
    floats, status, _heads = separatrix.abel(
        None, rows, np.array([[1.0, 3.9, 0.5]]), 1e-10, stable=False, left=False
    )
    assert status[0].tolist() == [OK, TURNING, EQUILIBRIUM]
    with mp.workdps(40):
        d, c23, s2, s3 = map(mp.mpf, six[2:])

        def V(x):
            return (
                d / 2 * mp.sin(x) ** 2 + c23 / 2 * mp.sin(2 * x) - s2 * mp.sin(x) - s3 * mp.cos(x)
            )

        angle = truth.saddles(six)[0]
        end = mp.findroot(lambda x: V(x) - V(angle), floats[0, 1, 0])
        middle = (mp.mpf(1.5) + end) / 2
        t = mp.quad(
            lambda x: 1 / mp.sqrt(2 * (V(angle) - V(x))),
            [mp.mpf(1.5), middle, (middle + end) / 2, end],
        )
    assert abs(floats[0, 1, 0] - end) <= floats[0, 1, 2] < 1e-14
    assert abs(floats[0, 1, 1] - t) <= floats[0, 1, 3] < 1e-13


DEGENERATE = {  # g has a double or a triple root at the "saddle"; six, phi0, left
    "triple, at 0": ((0, 0, 1.0, 0.25, 0.25, -1.0), 0.5, None),
    "triple, at atan(3/4)": ((0, 0, 0.0, 125 / 128, 172 / 128, 171 / 128), 1.0, None),
    "quadruple": ((0, 0, 1.0, 0.0, 0.0, -1.0), 0.5, False),
    "quadruple, to the left": ((0, 0, 1.0, 0.0, 0.0, -1.0), -0.5, True),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] * ("0" in name or "left" in name))
        for name in DEGENERATE
    ],
)
def test_degenerate_saddles(name):
    """w^2 ~ x^3 and x^4: z = 16 z0/(16 - ...), 1/z = 1/z0 - ... of `scenes/gyrostat.md`, against
    the energy.
    """
    six, phi0, left = DEGENERATE[name]
    found = []
    for side in (False, True) if left is None else (left,):
        for number in (1, 2):
            rows = np.array([[*six, phi0, number]], float)
            times = np.array([[-90.0, -2.0, 0.0, 0.1, 20.0]])
            floats, turnings, status, heads = separatrix.trajectories(
                None, rows, times, 1e-10, False, side
            )
            if (status == OK).all() and abs(truth.slope(six, mp.mpf(heads[0, 0]))) < 1e-12:
                found.append((rows, times, floats, turnings, heads))
    assert len(found) == 1
    rows, times, floats, turnings, heads = found[0]
    with mp.workdps(60):
        d, c23, s2, s3 = map(mp.mpf, six[2:])

        def V(x):
            return (
                d / 2 * mp.sin(x) ** 2 + c23 / 2 * mp.sin(2 * x) - s2 * mp.sin(x) - s3 * mp.cos(x)
            )

        angle = (
            mp.mpf(0)
            if "atan" not in name
            else mp.findroot(lambda x: mp.diff(V, x, 2), heads[0, 0])
        )
        w = mp.sign(heads[0, 2]) * mp.sqrt(2 * (V(angle) - V(mp.mpf(phi0))))
        assert abs(heads[0, 2] - w) <= heads[0, 3]
        for t, row in zip(times[0], floats[0], strict=True):
            wanted = exact(six, mp.mpf(phi0), w, t, 60, float_out=False)
            assert all(abs(row[i] - wanted[i]) <= row[2 + i] + 1e-32 < 1e-12 for i in (0, 1)), (
                t,
                row,
                wanted,
            )


def test_what_is_no_separatrix():
    rows = np.array(
        [[*GENERIC, 3.5, 3], [*GENERIC, 3.5, 1.5], [*GENERIC, 3.5, 1], [0.7, 0, 0, 0, 0, 0, 1, 1]],
        float,
    )
    _f, _n, status, heads = separatrix.trajectories(None, rows, np.ones((4, 1)), 1e-10, True, True)
    assert (status == INVALID_PARAMETERS).all() and np.isnan(heads).all()
    fold = np.array([[0.7, -0.4, 1.1, 0.3, 0.3, -1.1, 0.5, 1]])  # g = g' = 0 at 0, and b is not 0
    status = separatrix.trajectories(None, fold, np.ones((1, 1)), 1e-10, False, False)[2]
    assert status[0, 0] == separatrix.DEGENERATE
    assert (
        separatrix.trajectories(
            closed, rows[:1] * 0 + start(CASES["(61)"])[0], np.ones((1, 1)), 1e-10, False, False
        )[2]
        == 19
    )


@pytest.mark.parametrize("method", [dop853, taylor])
@pytest.mark.parametrize("name", ["a loop that turns", "b, stable to the left"])
def test_other_methods_agree_within_both_bars(method, name):
    rows, how = start(CASES[name])
    mine, _n, _ok, _heads = separatrix.trajectories(None, rows, TIMES, 1e-10, **how)
    other, _n, fine, _heads = separatrix.trajectories(method, rows, TIMES, 1e-10, **how)
    good = fine == OK
    assert good.sum() > 3 and (good | (fine == NO_CONVERGENCE)).all()
    assert (
        np.abs(mine - other)[good][:, :2] <= mine[good][:, 2:] + other[good][:, 2:] + 1e-15
    ).all()


def test_through_evaluate():
    ds = survey.evaluate("gyrostat", question="abel", saddle=2, separatrix="stable", side="left", phi0=3.5,
                         phi=np.array([2.0, 3.5, 4.0]), b12=0.7, b31=-0.4, d=1.1, c23=0.3, s2=0.5, s3=-0.2)  # fmt: skip
    assert (
        (ds.status == 0).all()
        and float(ds.w[1]) == float(ds.w_start[0])
        and abs(float(ds.t[1])) < 1e-15
    )
    assert float(ds.phi_saddle[0]) == pytest.approx(4.65095, abs=1e-5) and "w0" not in ds
    with pytest.raises(survey.errors.BadInput, match="saddle"):
        survey.evaluate("gyrostat", question="trajectory", t=1.0, side="left")
