"""[boundaries] in a workflow: edges in the netCDF file as ragged arrays, drawn over the map."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import survey
from survey import figures, store

WORKFLOW = {
    "scene": "satellite",
    "options": {"body": "oblate"},
    "axes": {"k": {"start": 0.1, "stop": 0.8, "num": 5}, "rho": {"start": 0.3, "stop": 2.2, "num": 60}},
    "output": {"variables": ["verdict"]},
    "boundaries": {},
}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("boundaries") / "map.nc"
    survey.run(WORKFLOW, output=path)
    return path


def test_the_edges_lie_where_the_verdict_changes(path):
    ds = xr.load_dataset(path)
    assert store.check(path) == [] and ds.edge_count.attrs["sample_dimension"] == "edge"
    assert ds.edge_complete.values.tolist() == [1] * 5 and int(ds.edge_count.sum()) == ds.sizes["edge"]
    ends = np.cumsum(ds.edge_count.values)
    for row, (last, number) in enumerate(zip(ends, ds.edge_count.values, strict=True)):
        own = ds.edge_position.values[last - number : last]
        assert (np.diff(own) >= 0).all()
        # an odd number of edges between neighbours of the map is a change of the verdict
        inside = np.histogram(own, ds.rho.values)[0]
        np.testing.assert_array_equal(inside % 2 == 1, np.diff(ds.verdict.values[row]) != 0)
    assert (ds.edge_position_error < 1e-12).all()


def test_the_tongue_n_2_opens_with_half_the_square(path):
    """Oblate tongue n = 2: k^2 / 2 wide about 1 + k^2 / 12 (notes, section 4)."""
    ds = xr.load_dataset(path)
    first = slice(0, int(ds.edge_count[0]))
    own = ds.edge_position.values[first][ds.edge_index.values[first] == 2]
    assert own.size == 2
    np.testing.assert_allclose([np.ptp(own), own.mean() - 1], [0.01 / 2, 0.01 / 12], rtol=0.03)


def test_they_are_drawn_over_the_map(path):
    ds = survey.open(path)
    figure = figures.draw(ds)
    drawn = sum(line.get_xydata().shape[0] for line in figure.axes[0].lines)
    assert drawn >= ds.sizes["edge"] > 20
    plt.close(figure)


def test_a_row_of_its_own(tmp_path):
    axes = {"a": {"start": -1.0, "stop": 10.0, "num": 4}, "q": 1.0}
    ds = survey.run({"scene": "mathieu", "axes": axes, "boundaries": {"axis": "a"}}, output=tmp_path / "row.nc")
    assert ds.edge_index.values.tolist() == [0, 1, 1, 2, 2, 3, 3] and int(ds.edge_complete) == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"boundaries": {"axis": "rhoo"}}, r"boundaries.axis: unknown axis 'rhoo'; did you mean 'rho'"),
        ({"boundaries": {"axes": "rho"}}, r"unknown key boundaries.axes; did you mean 'axis'"),
        ({"axes": {"k": 0.5, "rho": 1.0}}, r"boundaries: they are drawn on one axis or two"),
        ({"scene": "gyrostat", "axes": {"w0": {"values": [1.0, 2.0]}}, "options": {}}, r"gyrostat has no tongues"),
    ],
)
def test_what_cannot_be_is_refused(changes, words):
    with pytest.raises(survey.BadInput, match=words):
        survey.run(WORKFLOW | {"output": {}} | changes)
