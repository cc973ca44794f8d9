"""Folds of cycles: return maps traced with mpmath touch the identity there; two cycles are lost
from side to side.
"""

import mpmath as mp
import numpy as np
import pytest
from flow_truth import series

import survey
from survey.measures.cylinder import bifurcations, connections, curves, cycle_folds
from survey.measures.square import Square

SQUARE = Square(np.array([-3.0, -3.1]), np.array([3.1, 3.0]), np.array([False, False]))
AXES, FIXED = ("s3", "d"), {"b12": -0.8, "b31": -1.32, "c23": 0.42, "s2": 1.14}


def change(six, phi, w):
    """The change of log |w| over a turn from phi = 0, or of the right turning point phi over a libration."""
    start, turned = (mp.mpf(phi), mp.mpf(w)), 0
    x, v, side = *start, mp.sign(w)
    while True:
        rows = series(six, x, v, 30)
        step = 1 / (8 * max(abs(row[-1]) ** (mp.mpf(1) / 30) for row in rows))
        at = [lambda t, row=row: mp.polyval(row, t, asc=True) for row in rows]
        if side:
            if at[1](step) * side <= 0:
                return None
            if at[0](step) * side >= 2 * mp.pi:
                t = mp.findroot(
                    lambda t, at=at: at[0](t) - side * 2 * mp.pi,
                    (0, step),
                    solver="anderson",
                    tol=1e-50,
                )
                return mp.log(at[1](t) / start[1])
        elif v and at[1](step) * v <= 0:
            t = mp.findroot(at[1], (0, step), solver="anderson", tol=1e-50)
            turned += 1
            if turned == 2:
                return at[0](t) - start[0]
            x, v = at[0](t), mp.mpf(0)
            continue
        x, v = at[0](step), at[1](step)


def extremal(six, phi, w):
    """The extremal change next to the state: the top of the parabola through three values."""
    h = mp.mpf(10) ** -7
    sides = [(phi, w * (1 + k * h)) if w else (phi + k * h, w) for k in (-1, 0, 1)]
    low, middle, high = (change(six, *state) for state in sides)
    top = (low - high) / (2 * (low - 2 * middle + high))
    assert abs(top) < 1e3, "the extremum is not there"
    return middle - (high - low) ** 2 / (8 * (low - 2 * middle + high))


@pytest.fixture(scope="module")
def found():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(connections, "found", lambda plane: [])
        patch.setattr(cycle_folds, "LINES", 15)
        return curves.closed(SQUARE, list(AXES), FIXED, {})


def folds(found):
    """Which points are on folds of cycles?"""
    return np.repeat(found.kind == curves.CLASSES["cycle_fold"], found.count)


@pytest.mark.slow
@pytest.mark.parametrize("rotating", [True, False], ids=["rotation", "libration"])
def test_return_maps_touch_the_identity_within_the_error(found, rotating):
    w = found.along["cycle_w"][0]
    some = np.flatnonzero(folds(found) & ((w != 0.0) == rotating))
    i = some[len(some) // 2]
    tangent = (found.parameters[i + 1] - found.parameters[i - 1]) / (SQUARE.high - SQUARE.low)
    across = np.array([-tangent[1], tangent[0]]) / np.hypot(*tangent)
    with mp.workdps(32):
        state, signs = [mp.mpf(found.along[name][0][i]) for name in ("cycle_phi", "cycle_w")], []
        for side in (1, -1):
            step = side * found.error[i] * across * (SQUARE.high - SQUARE.low)
            there = [mp.mpf(v) + mp.mpf(s) for v, s in zip(found.parameters[i], step, strict=True)]
            system = FIXED | dict(zip(AXES, there, strict=True))
            six = [mp.mpf(system[name]) for name in bifurcations.SYSTEM]
            signs.append(mp.sign(extremal(six, *state)))
    assert found.error[i] < 1e-10
    assert sorted(signs) == [-1, 1]


@pytest.mark.slow
def test_two_cycles_are_lost(found):
    on_folds = folds(found)
    left, right = (found.along[name][0][on_folds] for name in ("cycles_left", "cycles_right"))
    known = np.isfinite(left) & np.isfinite(right)
    assert known.sum() > 5
    # else there is another curve within ASIDE
    assert np.mean(abs(left - right)[known] == 2.0) > 0.7
    assert (found.along["multiplier"][0][on_folds] == 1.0).all()
    assert (found.error[on_folds] < 1e-8).all()


def test_two_cycles_are_lost_at_a_fold_on_a_line():
    """Portraits, which know nothing of folds, have two rotations more on one side."""
    system = {"b31": 1.192, "d": 0.827, "c23": -0.824, "s2": -0.6, "s3": 1.121}
    line = survey.edge("gyrostat", along="b12", b12=(-0.5, 0.0), question="portrait", **system)
    own = line.edge_class.values == curves.CLASSES["cycle_fold"]
    assert own.sum() == 2 and (line.edge_error.values[own] < 1e-9).all()
    sides = line.edge.values[own][:, None] + [-1e-5, 1e-5]
    beside = survey.evaluate("gyrostat", question="portrait", b12=sides.ravel(), **system)
    names = "rotations_plus", "rotations_minus", "librations"
    change = [np.diff(beside[name].values.reshape(sides.shape))[:, 0] for name in names]
    assert (abs(np.array(change)).sum(axis=0) == 2).all()


def test_a_fold_between_a_connection_and_the_ends_is_found_from_a_segment():
    """K = 0 and a homoclinic connection are 0.005 of the map apart here: no node of the lattice lies
    between, but the number of cycles does not add up beside them.
    """
    system = {"b12": -0.45190322, "c23": 0.43981877, "s2": 0.67113843, "s3": -0.43624435}
    square = Square(np.full(2, -1.2), np.full(2, 1.2), np.array([False, False]))
    plane = bifurcations.ParameterPlane(square, ("b31", "d"), system)
    segment = np.array([[20.0, 17.0], [21.0, 17.0]]) / 32
    ((kind, xy, error, _),) = cycle_folds.found(plane, [segment])
    assert kind == "cycle_fold" and len(xy) > 20 and error.max() < 1e-9
    for b31, d in xy[5:-5:10]:
        beside = survey.evaluate(
            "gyrostat", question="portrait", b31=[b31 - 1e-4, b31 + 1e-4], d=d, **system
        )
        assert abs(np.diff(beside.rotations_plus.values)).item() == 2
