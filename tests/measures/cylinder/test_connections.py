"""Saddle connections: branches traced with mpmath, or by SciPy, miss each other to either side;
cycles appear at homoclinic ones; they explain where branches go.
"""

from itertools import pairwise

import mpmath as mp
import numpy as np
import pytest
from flow_truth import series
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import survey
from survey.kernels.cylinder import connections as cn
from survey.measures.cylinder import bifurcations, connections, curves, cycle_counts
from survey.measures.square import Square

FIXED = {"b12": 0.7, "b31": -0.4, "c23": 0.3, "s3": -0.2}
SQUARE = Square(np.array([-2.0, -4.0]), np.array([2.0, 4.0]), np.array([False, False]))
PLANE = bifurcations.ParameterPlane(SQUARE, ("s2", "d"), FIXED)


def of_system(six, system):
    b12, b31, d, c23, s2, s3 = six
    if system in (cn.REVERSED, cn.BOTH):
        b12, b31 = -b12, -b31
    if system in (cn.MIRRORED, cn.BOTH):
        b31, c23, s2 = -b31, -c23, -s2
    return b12, b31, d, c23, s2, s3


def forces(six, x):
    """f, g and their derivatives, at x."""
    b12, b31, d, c23, s2, s3 = six
    s, c, ds, dc = mp.sin(x), mp.cos(x), mp.sin(2 * x), mp.cos(2 * x)
    f, df = b12 * c - b31 * s, -b12 * s - b31 * c
    return f, df, -d * ds / 2 - c23 * dc + s2 * c - s3 * s, -d * dc + 2 * c23 * ds - s2 * s - s3 * c, (
        2 * d * ds + 4 * c23 * dc - s2 * c + s3 * s
    )  # fmt: skip


def first_turn(six, row, turnings):
    """The row of a branch as the kernel describes it, traced with mpmath; the kernel's row has the angles."""
    new = row.copy()
    new[: cn.PASSED + 1] = new[cn.BACK] = new[cn.WINDING :] = np.nan
    saddle = mp.findroot(lambda x: forces(six, x)[2], mp.mpf(row[cn.FROM]))
    columns = [mp.findroot(lambda x: forces(six, x)[2], mp.mpf(row[cn.FROM] + away)) for away in
               row[cn.OFFSETS : cn.OFFSETS + int(row[cn.COLUMNS])]]  # fmt: skip
    f, df, _, dg, ddg = forces(six, saddle)
    a, x = (f + mp.sqrt(f * f + 4 * dg)) / 2, mp.mpf(10) ** -12
    phi, w, k = saddle + x, a * x + (ddg / 2 + df * a) / (3 * a - f) * x * x, 0
    while k < len(columns):
        rows = series(six, phi, w, 30)
        step = 1 / (10 * max(abs(r[-1]) ** (mp.mpf(1) / 30) for r in rows))
        at = [lambda t, r=r: mp.polyval(r, t, asc=True) for r in rows]
        turned = at[1](step) <= 0
        if turned:
            step = mp.findroot(at[1], (0, step), solver="anderson", tol=1e-60)
        end = at[0](step)
        while k < len(columns) and columns[k] <= end:
            t = mp.findroot(
                lambda t, k=k, at=at: at[0](t) - columns[k], (0, step), solver="anderson", tol=1e-60
            )
            new[2 * k], k = float(at[1](t)), k + 1
        phi, w = end, at[1](step)
        if turned:
            new[cn.TURN], new[cn.PASSED] = float(end - saddle), k
            if k == 1 and len(columns) == 4:
                new[cn.BACK] = way_back(six, end, saddle)
            if k == 3 and len(columns) == 4 and turnings > 1:
                w = wound(six, end, columns, turnings)
                new[cn.WINDING + 2 * (turnings - 2)] = w
            break
    return new


def way_back(six, phi, saddle):
    """-w at the saddle's angle, to the left of the turning point phi, or the distance to it, negative."""
    w = mp.mpf(0)
    while True:
        rows = series(six, phi, w, 30)
        step = 1 / (10 * max(abs(r[-1]) ** (mp.mpf(1) / 30) for r in rows))
        at = [lambda t, r=r: mp.polyval(r, t, asc=True) for r in rows]
        if at[0](step) <= saddle:
            t = mp.findroot(
                lambda t, at=at: at[0](t) - saddle, (0, step), solver="anderson", tol=1e-60
            )
            return float(-at[1](t))
        if at[1](step) >= 0:
            return float(saddle - at[0](mp.findroot(at[1], step, tol=1e-60)))
        phi, w = (f(step) for f in at)


def wound(six, phi, columns, turnings):
    """|w| at the first or third of the equilibria `columns`, whichever is ahead, behind so many
    turning points, of which phi is the first; NaN if one lies between the two.
    """
    w, turned = mp.mpf(0), 1
    while True:
        sign = -1 if turned % 2 else 1
        focus = columns[2 if turned % 2 else 0]
        rows = series(six, phi, w, 30)
        step = 1 / (10 * max(abs(r[-1]) ** (mp.mpf(1) / 30) for r in rows))
        at = [lambda t, r=r: mp.polyval(r, t, asc=True) for r in rows]
        if turned == turnings and sign * (at[0](step) - focus) >= 0:
            t = mp.findroot(
                lambda t, at=at, focus=focus: at[0](t) - focus,
                (0, step),
                solver="anderson",
                tol=1e-60,
            )
            return float(abs(at[1](t)))
        if sign * at[1](step) <= 0:
            phi, w = at[0](mp.findroot(at[1], step, tol=1e-60)), mp.mpf(0)
            if sign * (phi - columns[1]) < 0:
                return np.nan
            turned += 1
        else:
            phi, w = (f(step) for f in at)


def miss(connection, x):
    out = connections._traced(PLANE, x[None], np.ones((4, 2)), connection.cut)[0]
    s2, d = SQUARE.parameters(x)
    six = [mp.mpf(v) for v in (0.7, -0.4, float(d), 0.3, float(s2), -0.2)]
    rows = [
        first_turn(of_system(six, branch[0]), out[branch], turnings)[None]
        for branch, turnings in zip(connection.branches, connection.turnings, strict=True)
    ]
    return connection.miss(*rows)[0][0]


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(connections, "LINES", 41)
    monkeypatch.setattr(bifurcations.cycle_folds, "found", lambda plane, segments=None: [])
    monkeypatch.setattr(bifurcations, "COUNTED", 2)
    monkeypatch.setattr(cycle_counts, "LINES", 2)


@pytest.mark.parametrize("shares", [(0.5,), (0.04, 0.25, 0.5, 0.96)], ids=["short", "long"])
@pytest.mark.slow
def test_branches_miss_each_other_to_either_side(shares):
    """In the middle of curves, and near ends that are followed where the lattice has lost them."""
    kinds = set()
    with mp.workdps(35):
        for connection, x, error in connections.curves(PLANE):
            turnings = max(connection.turnings)
            sort = getattr(connection.miss, "func", connection.miss), connection.kind, turnings
            if len(x) < 8 or sort in kinds or turnings > 3:
                continue
            kinds.add(sort)
            for i in (int(len(x) * share) for share in shares):
                assert error[i] < 1e-11
                sides = [
                    [miss(connection, x[i] + side * 1.01 * error[i] * axis) for side in (1, -1)]
                    for axis in np.eye(2)
                ]
                assert any(one * two < 0 for one, two in sides)
    assert len(kinds) == 7


def torque(six, x):
    """g, in floating point."""
    _b12, _b31, d, c23, s2, s3 = six
    return -0.5 * d * np.sin(2 * x) - c23 * np.cos(2 * x) + s2 * np.cos(x) - s3 * np.sin(x)


def equilibria(six):
    """Angles in [0, 2 pi), ascending, and whether they are saddles."""
    at = np.linspace(0.0, 2.0 * np.pi, 2001)
    signs = torque(six, at) > 0.0
    cells = np.flatnonzero(signs[1:] != signs[:-1])
    found = [brentq(lambda x: torque(six, x), at[i], at[i + 1], xtol=1e-15) for i in cells]
    return np.array(found), signs[cells + 1]


def at_focus(own, system, saddle, turnings):
    """|w| where the branch that leaves a saddle, of `own` parameters, to the right in this system
    passes the equilibrium ahead next to the other saddle, behind so many turning points, by DOP853.
    """
    six = of_system([float(v) for v in own], system)
    start = -saddle if system in (cn.MIRRORED, cn.BOTH) else saddle
    angles = start + np.sort((equilibria(six)[0] - start) % (2.0 * np.pi))
    angles = angles[abs(angles - start) % (2.0 * np.pi) > 1e-6][:3]
    f, df, _, dg, ddg = (float(v) for v in forces(six, start))
    a, x = 0.5 * (f + np.sqrt(f * f + 4.0 * dg)), 1e-5
    state = [start + x, a * x + (0.5 * ddg + df * a) / (3.0 * a - f) * x * x]

    def rates(t, y):
        f = six[0] * np.cos(y[0]) - six[1] * np.sin(y[0])
        return [y[1], f * y[1] + torque(six, y[0])]

    for turned in range(turnings + 1):
        stop = (
            (lambda t, y: y[1])
            if turned < turnings
            else (lambda t, y: y[0] - angles[2 if turnings % 2 else 0])
        )
        stop.terminal, stop.direction = True, (1.0 if turned % 2 else -1.0)
        if turned == turnings:
            stop.direction = -stop.direction
        run = solve_ivp(rates, (0.0, 500.0), state, "DOP853", events=stop, rtol=1e-13, atol=1e-15)
        assert run.status == 1
        state = [run.y_events[0][0][0], 0.0 if turned < turnings else run.y_events[0][0][1]]
    return abs(state[1])


def test_a_branch_that_winds_reaches_the_other_saddle_by_scipy(monkeypatch):
    every = [one for one in connections._every() if max(one.turnings) in (2, 3, 4)]
    monkeypatch.setattr(connections, "_every", lambda: every)
    seen = []
    for connection, x, error in connections.curves(PLANE):
        if len(x) < 8 or connection.turnings in seen:
            continue
        seen.append(connection.turnings)
        at = len(x) // 2
        sides = []
        for axis in np.eye(2):
            for side in (1.0, -1.0):
                s2, d = SQUARE.parameters(x[at] + side * (error[at] + 1e-10) * axis)
                six = [0.7, -0.4, d, 0.3, s2, -0.2]
                angles, saddles = equilibria(six)
                own = angles[saddles]
                own = own[np.argsort((own - connection.cut) % (2.0 * np.pi))]
                sides.append(
                    np.subtract(
                        *(
                            at_focus(six, system, own[saddle], turns if turns > 1 else 0)
                            for (system, saddle), turns in zip(
                                connection.branches, connection.turnings, strict=True
                            )
                        )
                    )
                )
        assert error[at] < 1e-10
        assert max(abs(np.array(sides))) < 1e-7
        assert sides[0] * sides[1] < 0.0 or sides[2] * sides[3] < 0.0
    assert {max(turnings) for turnings in seen} == {2, 3, 4} and len(seen) > 3


def test_connections_explain_where_branches_go():
    """Where a branch of a saddle goes changes at nothing else but what is drawn: five times here on
    ways with two turning points or more.
    """
    system = {"b12": 0.0627, "b31": 0.00606, "c23": -0.7365, "s2": -0.114, "s3": -0.3375}
    low, high = -1.7, 0.3
    d = np.linspace(low, high, 41)
    found = survey.evaluate("gyrostat", question="portrait", d=d, **system)
    edges = survey.edge("gyrostat", question="portrait", along="d", d=(low, high), **system)
    ends = np.stack([found.branch_end, found.branch_limit.fillna(0)])
    changed = (ends[:, 1:] != ends[:, :-1]).any(axis=(0, 2, 3))
    inside = [((edges.edge > one) & (edges.edge < two)).sum() for one, two in pairwise(d)]
    assert (found.verdict == 1).all()
    assert changed.sum() == 5
    assert np.array_equal(changed, np.array(inside) > 0)


@pytest.mark.slow
def test_a_way_next_to_where_saddles_have_the_same_height_is_found():
    """Both saddles have the same V between the same two points of the lattice, on one line; there
    a change of labels hid the zero.
    """
    system = {"b12": 0.00685, "b31": -0.0975, "d": 0.89, "s2": 0.225, "s3": -0.573}
    range_of = (-1.609, 3.391)
    edges = survey.edge("gyrostat", question="portrait", along="c23", c23=range_of, **system).edge
    near = edges.values[abs(edges.values - 0.39) < 0.03]
    assert near.size == 1
    sides = survey.evaluate(
        "gyrostat", question="portrait", c23=near + np.array([-1e-7, 1e-7]), **system
    )
    assert (sides.verdict == 1).all()
    one, two = sides.branch_end.values
    assert (one != two).sum() == 1


@pytest.mark.slow
def test_a_cycle_is_born_in_a_homoclinic_connection():
    square = Square(np.array([-2.0, -4.0]), np.array([0.2, 4.0]), np.array([False, False]))
    found = curves.closed(square, ["s2", "d"], FIXED, {})
    kinds = np.repeat(found.kind, found.count)
    left, right = (found.along[name][0] for name in ("cycles_left", "cycles_right"))
    names = "homoclinic", "supercritical_hopf", "subcritical_hopf"
    known = (
        np.isin(kinds, [curves.CLASSES[name] for name in names])
        & np.isfinite(left)
        & np.isfinite(right)
    )
    assert known.sum() > 8
    assert np.mean(abs(left - right)[known] == 1) > 0.9


@pytest.mark.slow
def test_curves_run_into_each_other_and_explain_the_numbers_of_cycles(monkeypatch):
    """Connections end at points of codimension two or in one another; without one of them segments
    are missed.
    """
    monkeypatch.setattr(cycle_counts, "LINES", 15)
    rows = bifurcations.found(PLANE)
    counts = cycle_counts.on_lattice(PLANE)
    assert not cycle_counts.lost(PLANE, rows, counts)
    long = [i for i, (kind, xy, *_) in enumerate(rows) if kind == "homoclinic" and len(xy) > 30]
    without = [len(cycle_counts.lost(PLANE, rows[:i] + rows[i + 1 :], counts)) for i in long]
    assert len(long) > 4 and sum(number > 3 for number in without) > 2
    short = [len(xy) for kind, xy, *_ in rows if kind.endswith("clinic") and len(xy) < 6]
    assert len(short) < 4


def test_without_friction_there_are_no_curves_of_connections():
    plane = bifurcations.ParameterPlane(SQUARE, ("s2", "d"), FIXED | {"b12": 0.0, "b31": 0.0})
    assert not list(connections.curves(plane))
