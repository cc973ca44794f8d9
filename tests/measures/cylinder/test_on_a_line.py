"""The boundaries of portraits along one axis: all, by how many cycles there are beside each."""

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import survey
from survey.measures.cylinder import curves, own_bifurcations
from survey.measures.square import Square
from survey.request import user_scene

JUNCTION = str(Path(__file__).parents[3] / "workflows" / "josephson.py")
CYCLES = ("rotations_plus", "rotations_minus", "librations")
# (axis, fixed parameters) of lines along which a search at the spacing of a whole map misses a curve,
# and of one that meets a loop with two turning points
LINES = [
    ("s2", {"b12": -1.119, "b31": 0.394, "d": 0.942, "c23": 0.227, "s3": -1.003}),
    ("s3", {"b12": -0.875, "b31": 0.412, "d": -0.841, "c23": -0.304, "s2": -0.348}),
    ("s3", {"b12": -0.515, "b31": -0.036, "d": 0.039, "c23": 0.714, "s2": 0.711}),
]


@pytest.mark.parametrize(
    ("along", "system"),
    [LINES[0], *(pytest.param(*line, marks=pytest.mark.slow) for line in LINES[1:])],
    ids=["s2", "s3", "two_turns"],
)
def test_along_one_axis_the_boundaries_explain_how_many_cycles_there_are(along, system, tmp_path):
    axis = {"start": -4.0, "stop": 4.0, "num": 5}
    ds = survey.run(
        {
            "scene": "gyrostat",
            "options": {"question": "portrait"},
            "axes": {along: axis, **system},
            "boundaries": {},
        },
        output=tmp_path / "line.nc",
    )
    assert "edge_incomplete_rows" not in ds.attrs
    edges, kind = ds.edge_position.values, ds.edge_class.values
    apart = 0.3 * np.minimum(np.diff(edges, prepend=-4.0), np.diff(edges, append=4.0))
    left, right = (
        survey.evaluate("gyrostat", question="portrait", **{along: x}, **system)
        for x in (edges - apart, edges + apart)
    )
    change = np.array([right[name].values - left[name].values for name in CYCLES])
    folds = kind == curves.CLASSES["cycle_fold"]
    assert (abs(change).sum(axis=0)[folds] == 2).all() and (abs(change[:, ~folds]) <= 1).all()
    # between two boundaries nothing changes
    for name in (*CYCLES, "equilibria"):
        np.testing.assert_array_equal(right[name].values[:-1], left[name].values[1:])


def test_boundaries_that_are_not_found_show_in_the_counts(monkeypatch):
    system = {"b12": -0.515, "b31": -0.036, "d": 0.039, "c23": 0.714, "s2": 0.711}
    monkeypatch.setattr(curves.bifurcations, "found", lambda plane: [])
    found = survey.edge("gyrostat", question="portrait", along="s3", s3=(-1.0, 0.2), **system)
    assert found.attrs["complete"] == 0


@pytest.mark.parametrize(
    ("along", "ends", "near", "kind", "system"),
    [
        ("b12", (-2.0, 2.0), (0.8602, 0.8605), "cycle_fold",
         {"b31": -1.657403, "d": -1.052758, "c23": 1.205098, "s2": 0.328648, "s3": -1.623485}),
        pytest.param(
            "s3", (-2.0, 2.0), (-0.3275, -0.3265), "cycle_fold",
            {"b12": 0.340652, "b31": -0.114761, "d": 1.093108, "c23": -1.878616, "s2": 0.82786},
            marks=pytest.mark.slow,
        ),
        ("s2", (-2.0, 2.0), (1.8235, 1.8245), "homoclinic",
         {"b12": -1.49298, "b31": -0.812969, "d": -0.028612, "c23": 1.397842, "s3": 1.860926}),
        pytest.param(
            "s3", (-4.0, 4.0), (0.1155, 0.1165), "cycle_fold",
            {"b12": -0.515, "b31": -0.036, "d": 0.039, "c23": 0.714, "s2": 0.711},
            marks=pytest.mark.slow,
        ),
    ],
)  # fmt: skip
def test_no_boundary_hides_another_beside_it(along, ends, near, kind, system):
    """Numbers of cycles in portraits, which know nothing of boundaries, change between `near`."""
    ds = survey.edge("gyrostat", question="portrait", along=along, **{along: ends}, **system)
    own = (near[0] < ds.edge.values) & (ds.edge.values < near[1])
    assert ds.edge_class.values[own].tolist() == [curves.CLASSES[kind]]
    edge, error = ds.edge.values[own].item(), ds.edge_error.values[own].item()
    sides = [edge - 1e-6, edge + 1e-6]
    beside = survey.evaluate("gyrostat", question="portrait", **{along: sides}, **system)
    change = sum(abs(np.diff(beside[name].values)).item() for name in CYCLES)
    assert change == (2 if kind == "cycle_fold" else 1) and error < 1e-10


def _junction(a, current):
    """w of the unstable less that of the stable branch of the saddle, at the other equilibrium, by
    SciPy: below 0 where the junction's branch does not come back to its saddle.
    """
    saddle, rest = np.pi - np.arcsin(current), np.arcsin(current)
    steep = np.cos(rest)  # g' at the saddle
    rates = 0.5 * (-a + np.array([1.0, -1.0]) * np.sqrt(a * a + 4.0 * steep))
    found = []
    for rate, start, end in (
        (rates[0], saddle - 2.0 * np.pi, rest),
        (rates[1], saddle, rest),
    ):
        x = 0.01 * (end - start)
        bend = 0.5 * current / (3.0 * rate + a)
        third = (-steep / 6.0 - 2.0 * bend * bend) / (4.0 * rate + a)
        w = ((third * x + bend) * x + rate) * x
        solved = solve_ivp(
            lambda phi, w: (current - np.sin(phi)) / w - a,
            (start + x, end),
            [w],
            method="DOP853",
            rtol=1e-12,
            atol=1e-15,
        )
        found.append(solved.y[0, -1] if solved.success else 0.0)
    return found[0] - found[1]


@pytest.mark.parametrize(
    "a", [0.2, *(pytest.param(a, marks=pytest.mark.slow) for a in (1.15, 1.167, 1.18)), 1.19]
)
def test_the_homoclinic_point_of_a_junction_next_to_its_fold(a):
    """The curve ends in the fold at a = 1.193: the branches miss each other to either side of the
    point, a rotation is born in it, and there is no other.
    """
    found = survey.edge(JUNCTION, question="portrait", along="I", a=a, I=(0.02, 1.3))
    kinds = [curves.CLASSES["homoclinic"], curves.CLASSES["fold"]]
    assert found.edge_class.values.tolist() == kinds
    edge, error = found.edge.values[0].item(), found.edge_error.values[0].item()
    assert error < 1e-11 and "complete" not in found.attrs
    assert _junction(a, edge - 1e-9) < 0.0 < _junction(a, edge + 1e-9)
    apart = 0.3 * (1.0 - edge)
    beside = survey.evaluate(JUNCTION, question="portrait", a=a, I=[edge - apart, edge + apart])
    assert beside.rotations_plus.values.tolist() == [0, 1]


@pytest.mark.parametrize(
    ("a", "complete"), [pytest.param(1.1930459, 0, marks=pytest.mark.slow), (1.2, None)]
)
def test_a_homoclinic_point_that_cannot_be_told_from_the_fold_is_not_denied(a, complete):
    """They meet at a = 1.1930459: (a* - a)^2 is how far apart they are, to a few percent. Beyond, the
    rotation is born in the fold.
    """
    found = survey.edge(JUNCTION, question="portrait", along="I", a=a, I=(0.02, 1.3))
    assert found.edge_class.values.tolist() == [curves.CLASSES["fold"]]
    assert found.attrs.get("complete") == complete


@pytest.mark.slow
def test_a_fold_that_a_branch_passes_explains_no_rotation(monkeypatch):
    """Without the connection 9e-6 from the fold, no rotation is said to be born in the fold."""
    monkeypatch.setattr(own_bifurcations.connections, "found", lambda plane: [])
    found = survey.edge(JUNCTION, question="portrait", along="I", a=1.19, I=(0.02, 1.3))
    assert found.edge_class.values.tolist() == [curves.CLASSES["fold"]]
    assert found.attrs["complete"] == 0


def test_on_a_map_the_homoclinic_curve_of_a_junction_ends_in_the_fold(monkeypatch):
    monkeypatch.setattr(own_bifurcations.connections, "LINES", 25)
    square = Square(np.array([1.1, 0.99]), np.array([1.25, 1.01]), np.array([False, False]))
    scene = user_scene.find(JUNCTION)[1]
    plane = own_bifurcations.ScenePlane(square, ("a", "I"), {}, scene)
    ((_connection, x, _error),) = own_bifurcations.connections.curves(plane)
    points = square.parameters(x)
    assert points[:, 0].min() == 1.1 and abs(points[:, 0].max() - 1.193) < 0.005
    for a, current in points[:: len(points) // 4]:
        apart = 1e-3 * (1.0 - current)
        assert _junction(a, current - apart) < 0.0 < _junction(a, current + apart)
