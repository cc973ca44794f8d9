"""Curves of a user's flow: against the gyrostat's closed forms, and the Josephson junction's traced
with mpmath.
"""

from math import cos, pi, sin

import mpmath as mp
import numpy as np
import pytest

import survey
from survey.measures.cylinder import (
    bifurcations,
    connections,
    curves,
    cycle_counts,
    cycle_folds,
    own_bifurcations,
)
from survey.measures.square import Square

EVEN = np.array([False, False])
NAMES = list(curves.CLASSES)


def gyrostat():
    def f(phi, p):
        return 0.7 * cos(phi) + 0.4 * sin(phi)

    def g(phi, p):
        return -p[1] * cos(phi) * sin(phi) - 0.3 * cos(2 * phi) + p[0] * cos(phi) + 0.2 * sin(phi)

    return survey.abel(f, g, parameters=["s2", "d"], period=2 * pi)


def junction():
    def f(phi, p):
        return -p[0]

    def g(phi, p):
        return p[1] - sin(phi)

    return survey.abel(f, g, parameters=["a", "I"], period=2 * pi)


def points(scene, square):
    """{class: (parameters (m, 2), errors (m))} of the curves."""
    axes = [p.name for p in scene.own]
    found = curves.searched(scene, square, axes, {}, {})
    kinds = np.repeat(found.kind, found.count)
    return {
        NAMES[kind]: (found.parameters[kinds == kind], found.error[kinds == kind])
        for kind in set(kinds)
    }


@pytest.fixture(autouse=True)
def uncounted(monkeypatch):
    monkeypatch.setattr(cycle_counts, "LINES", 2)


@pytest.mark.slow
def test_an_equation_written_out_has_the_gyrostats_curves(monkeypatch):
    monkeypatch.setattr(connections, "found", lambda plane: [])
    monkeypatch.setattr(cycle_folds, "found", lambda plane, segments=None: [])
    monkeypatch.setattr(bifurcations, "COUNTED", 0)
    monkeypatch.setattr(own_bifurcations, "LINES", 9)
    square = Square(np.array([-9.0, -9.0]), np.array([9.0, 9.0]), EVEN)
    own = points(gyrostat(), square)
    fixed = {"b12": 0.7, "b31": -0.4, "c23": 0.3, "s3": -0.2}
    plane, known = bifurcations.ParameterPlane(square, ("s2", "d"), fixed), {}
    for kind, xy, error, _ in bifurcations.found(plane):
        known.setdefault(kind, []).append((xy, error))
    assert set(own) == set(known)
    for kind, (xy, error) in own.items():
        marks = all(len(part) == 1 for part, _ in known[kind])
        for x, bar in zip(xy, error, strict=True):
            off = min(distance(plane, kind, x, part) for part, _ in known[kind])
            # chords of the closed forms are 3e-5 off
            assert off <= (bar + 1e-13 if marks else bar + 1e-4), kind
        assert (error < 1e-9).all()
        if marks:
            assert len(xy) == len(known[kind])
    # on a fold and on a Hopf curve the equations themselves hold within the errors
    for x, bar in zip(*own["fold"], strict=True):
        assert discriminant_changes(x, 1.5 * bar * 18.0)


def distance(plane, kind, x, part):
    """From a position to a polyline, in units of the map."""
    x, part = plane.square.positions(x), plane.square.positions(part)
    if len(part) == 1:
        return np.hypot(*(part[0] - x))
    low, chord = part[:-1], np.diff(part, axis=0)
    share = np.clip(
        ((x - low) * chord).sum(axis=1) / np.maximum((chord**2).sum(axis=1), 1e-300), 0.0, 1.0
    )
    return np.hypot(*(low + share[:, None] * chord - x).T).min()


def discriminant_changes(x, step):
    """Does the discriminant of g, a quartic in tan(phi/2), change its sign within the step?"""
    with mp.workdps(40):

        def value(s2, d):
            c23, s3 = mp.mpf(0.3), mp.mpf(-0.2)
            a4, a3, a2, a1, a0 = -c23 - s2, 2 * d - 2 * s3, 6 * c23, -2 * d - 2 * s3, -c23 + s2
            rows = [[0] * i + [a4, a3, a2, a1, a0] + [0] * (2 - i) for i in range(3)]
            rows += [[0] * i + [4 * a4, 3 * a3, 2 * a2, a1] + [0] * (3 - i) for i in range(4)]
            return mp.det(mp.matrix(rows)) / a4

        s2, d, step = map(mp.mpf, (*x, step))
        return any(value(s2 + step * k, d + step * m) * value(s2 - step * k, d - step * m) <= 0
                   for k, m in ((1, 0), (0, 1)))  # fmt: skip


def outcome(a, current):
    """+1 where the branch to the right of the junction's saddle passes its next copy, -1 where it
    turns before.
    """
    saddle, order = mp.pi - mp.asin(current), 30
    x, a1 = mp.mpf(10) ** -9, (-a + mp.sqrt(a * a - 4 * mp.cos(mp.pi - mp.asin(current)))) / 2
    a2 = mp.sin(saddle) / 2 / (3 * a1 + a)
    phi, w = saddle + x, a1 * x + a2 * x * x
    while True:
        p, v, s, c = [phi], [w], [mp.sin(phi)], [mp.cos(phi)]
        for n in range(order):
            sw, cw = (mp.fdot(row, v[::-1]) for row in (s, c))
            p.append(v[n] / (n + 1))
            v.append((-a * v[n] - s[n] + (current if n == 0 else 0)) / (n + 1))
            s.append(cw / (n + 1))
            c.append(-sw / (n + 1))
        step = 1 / (8 * max(abs(row[-1]) ** (mp.mpf(1) / order) for row in (p, v)))
        phi, w = (mp.polyval(row, step, asc=True) for row in (p, v))
        if w <= 0:
            return -1
        if phi >= saddle + 2 * mp.pi:
            return 1


def test_the_junctions_homoclinic_curve(monkeypatch):
    monkeypatch.setattr(connections, "LINES", 25)
    monkeypatch.setattr(own_bifurcations, "LINES", 9)
    monkeypatch.setattr(cycle_folds, "LINES", 3)
    monkeypatch.setattr(bifurcations, "COUNTED", 0)
    found = points(junction(), Square(np.array([0.01, 0.005]), np.array([1.5, 1.495]), EVEN))
    assert set(found) == {"homoclinic", "fold"}
    xy, error = found["fold"]
    assert (abs(xy[:, 1] - 1.0) <= error * 1.49).all()
    xy, error = found["homoclinic"]
    assert (error < 1e-11).all()
    small = xy[:, 0] < 0.1
    assert small.sum() > 1
    assert (abs(xy[small, 1] - 4 * xy[small, 0] / pi) < 0.4 * xy[small, 0] ** 3).all()
    with mp.workdps(30):
        for i in (len(xy) // 4, len(xy) // 2):
            a, current = map(mp.mpf, xy[i])
            step = mp.mpf(error[i]) * 1.49 + mp.mpf(10) ** -15
            assert [outcome(a, current + side * step) for side in (-1, 1)] == [-1, 1]


def test_on_a_line_there_are_none():
    scene = survey.abel(lambda phi, p: -p[0], lambda phi, p: p[1] - phi, parameters=["a", "b"])
    assert "period" in curves.refusal(["a", "b"], scene)
    assert "s2" in curves.refusal(["phi0", "d"], gyrostat())
    assert curves.refusal(["phi0", "w0"], gyrostat()) is None
    assert curves.refusal(["d", "s2"], gyrostat()) is None


@pytest.mark.parametrize(("f1", "kind"), [(-1.0, "supercritical_hopf"), (1.0, "subcritical_hopf")])
def test_hopf_points_are_classified_by_the_cycle_beside_them(f1, kind, monkeypatch):
    """phi'' = (a + f1 sin^2 phi) phi' - sin phi: with f1 < 0 an attracting libration is born where a > 0."""
    monkeypatch.setattr(connections, "found", lambda plane: [])
    monkeypatch.setattr(cycle_folds, "found", lambda plane, segments=None: [])
    monkeypatch.setattr(own_bifurcations, "LINES", 9)

    def f(phi, p):
        return p[0] + f1 * sin(phi) ** 2

    def g(phi, p):
        return -p[1] * sin(phi)

    scene = survey.abel(f, g, parameters=["a", "k"], period=2 * pi)
    square = Square(np.array([-0.2, 0.5]), np.array([0.3, 2.0]), EVEN)
    found = curves.searched(scene, square, ["a", "k"], {}, {})
    kinds = [NAMES[k] for k in found.kind]
    assert kind in kinds
    side = survey.evaluate(scene, question="portrait", a=-0.01 * f1, k=1.0)
    other = survey.evaluate(scene, question="portrait", a=0.01 * f1, k=1.0)
    assert (int(side.librations), int(other.librations)) == (1, 0)
    assert (side.cycle_multiplier.values[0] < 1.0) == (f1 < 0.0)


def on_line(scene, along, ends, kinds, **fixed):
    """[(position, error)] of the edges of these kinds."""
    found = survey.edge(scene, along=along, question="portrait", **{along: ends}, **fixed)
    some = np.isin(found.edge_class, [NAMES.index(kind) for kind in kinds])
    return list(zip(found.edge.values[some], found.edge_error.values[some], strict=True))


@pytest.mark.parametrize("wave", [sin, cos])
@pytest.mark.parametrize("ends", [(0.9, 1.1), pytest.param((0.9, 1.13), marks=pytest.mark.slow)])
def test_a_line_meets_the_fold_at_1_wherever_its_angle_and_its_nodes_are(wave, ends):
    """g = I - sin phi, or I - cos phi, whose slope is 0 exactly at a node; 1 is the middle of a line."""
    scene = survey.abel(
        lambda phi, p: -p[0],
        lambda phi, p: p[1] - wave(phi),
        parameters=("a", "I"),
        period=2 * pi,
    )
    ((at, bar),) = on_line(scene, "I", ends, ["fold"], a=2.0)
    assert abs(at - 1.0) <= bar and bar < 1e-10


@pytest.mark.parametrize("bias", [0.0, 0.3, pytest.param(0.7, marks=pytest.mark.slow)])
def test_a_line_meets_hopf_points(bias):
    """f = a - cos phi, g = I - sin phi: at the rest where cos phi = sqrt(1 - I^2) = a, beyond which
    it repels.
    """
    scene = survey.abel(
        lambda phi, p: p[0] - cos(phi),
        lambda phi, p: p[1] - sin(phi),
        parameters=("a", "I"),
        period=2 * pi,
    )
    kinds = "supercritical_hopf", "subcritical_hopf"
    ((at, bar),) = on_line(scene, "a", (0.6, 1.4), kinds, I=bias)
    assert abs(at - np.sqrt(1.0 - bias * bias)) <= bar + 1e-15 and bar < 1e-10
    beside = survey.evaluate(scene, question="portrait", a=[at - 1e-3, at + 1e-3], I=bias)
    types = beside.equilibrium_type.attrs["flag_meanings"].split()
    first = [types[k] for k in beside.equilibrium_type.values[:, 0]]
    assert first == ["attracting_focus", "repelling_focus"]
