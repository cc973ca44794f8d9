"""The boundaries of portraits along one axis: all, by how many cycles there are beside each."""

import numpy as np
import pytest

import survey
from survey.measures.cylinder import curves

CYCLES = ("rotations_plus", "rotations_minus", "librations")
# fixed parameters of lines along which a search at the spacing of a whole map misses a curve
LINES = [
    ("s2", {"b12": -1.119, "b31": 0.394, "d": 0.942, "c23": 0.227, "s3": -1.003}),
    ("s3", {"b12": -0.875, "b31": 0.412, "d": -0.841, "c23": -0.304, "s2": -0.348}),
]


@pytest.mark.parametrize(("along", "given"), LINES)
def test_along_one_axis_the_boundaries_explain_how_many_cycles_there_are(along, given, tmp_path):
    axis = {"start": -4.0, "stop": 4.0, "num": 5}
    ds = survey.run(
        {
            "scene": "gyrostat",
            "options": {"question": "portrait"},
            "axes": {along: axis, **given},
            "boundaries": {},
        },
        output=tmp_path / "line.nc",
    )
    assert "edge_incomplete_rows" not in ds.attrs
    edges, kind = ds.edge_position.values, ds.edge_class.values
    apart = 0.3 * np.minimum(np.diff(edges, prepend=-4.0), np.diff(edges, append=4.0))
    left, right = (
        survey.evaluate("gyrostat", question="portrait", **{along: x}, **given)
        for x in (edges - apart, edges + apart)
    )
    change = np.array([right[name].values - left[name].values for name in CYCLES])
    folds = kind == curves.CLASSES["cycle_fold"]
    assert (abs(change).sum(axis=0)[folds] == 2).all() and (abs(change[:, ~folds]) <= 1).all()
    # between two boundaries nothing changes
    for name in (*CYCLES, "equilibria"):
        np.testing.assert_array_equal(right[name].values[:-1], left[name].values[1:])


def test_a_fold_of_cycles_between_other_curves_is_found():
    """Four other curves are within 1/32 of the line; rotations go from 2 to 0 at s3 = 0.11603."""
    system = {"b12": -0.515, "b31": -0.036, "d": 0.039, "c23": 0.714, "s2": 0.711}
    found = survey.edge("gyrostat", question="portrait", along="s3", s3=(-4.0, 4.0), **system)
    folds = found.edge.values[found.edge_class.values == curves.CLASSES["cycle_fold"]]
    beside = (folds[:, None] + [-1e-4, 1e-4]).ravel()
    cycles = survey.evaluate("gyrostat", question="portrait", s3=beside, **system).rotations_plus
    np.testing.assert_array_equal(cycles, [2, 0])
