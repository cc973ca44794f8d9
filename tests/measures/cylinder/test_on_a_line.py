"""The boundaries of portraits along one axis: all, by how many cycles there are beside each."""

import numpy as np
import pytest

import survey
from survey.measures.cylinder import curves

CYCLES = ("rotations_plus", "rotations_minus", "librations")
# (axis, fixed parameters) of lines along which a search at the spacing of a whole map misses a curve,
# and of one that meets a loop with two turning points
LINES = [
    ("s2", {"b12": -1.119, "b31": 0.394, "d": 0.942, "c23": 0.227, "s3": -1.003}),
    ("s3", {"b12": -0.875, "b31": 0.412, "d": -0.841, "c23": -0.304, "s2": -0.348}),
    ("s3", {"b12": -0.515, "b31": -0.036, "d": 0.039, "c23": 0.714, "s2": 0.711}),
]


@pytest.mark.parametrize(("along", "system"), LINES, ids=["s2", "s3", "two_turns"])
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
        ("s3", (-2.0, 2.0), (-0.3275, -0.3265), "cycle_fold",
         {"b12": 0.340652, "b31": -0.114761, "d": 1.093108, "c23": -1.878616, "s2": 0.82786}),
        ("s2", (-2.0, 2.0), (1.8235, 1.8245), "homoclinic",
         {"b12": -1.49298, "b31": -0.812969, "d": -0.028612, "c23": 1.397842, "s3": 1.860926}),
        ("s3", (-4.0, 4.0), (0.1155, 0.1165), "cycle_fold",
         {"b12": -0.515, "b31": -0.036, "d": 0.039, "c23": 0.714, "s2": 0.711}),
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
