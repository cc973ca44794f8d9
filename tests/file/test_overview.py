"""Large maps are drawn as cells, each of which tells of all its points; small ones point by point."""

import dask.array as da
import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import survey  # noqa: F401 (registers the accessor)
from survey import status

matplotlib.use("Agg")
LONG = 2300  # more points along an axis than are drawn one by one


@pytest.fixture(scope="module")
def large():
    """Half stable, half unstable, three points marginal, five undecided, four failed, and a block outside."""
    rng = np.random.default_rng(4)
    verdict, state = np.ones((LONG, 70), np.int8), np.zeros((LONG, 70), np.int8)
    verdict[: LONG // 2] = 0
    rare = rng.choice(verdict[: LONG - 40].size, 12, replace=False)
    verdict.flat[rare] = [2] * 3 + [-1] * 9
    state.flat[rare[8:]] = status.STEP_LIMIT
    state[-30:], verdict[-30:] = status.INVALID_PARAMETERS, -1
    exponent = np.where(state == 0, rng.standard_normal(verdict.shape), np.nan)
    flags = {
        "flag_values": np.array([-1, 0, 1, 2], np.int8),
        "flag_meanings": "undecided unstable stable marginal",
    }
    data = {"verdict": (("k", "rho"), verdict, flags), "exponent": (("k", "rho"), exponent),
            "status": (("k", "rho"), state)}  # fmt: skip
    coords = {"k": np.geomspace(1e-2, 1e2, LONG), "rho": np.linspace(0, 1, 70)}
    return xr.Dataset(data, coords, {"scene": "satellite", "options": "", "title": "A large map"})


def drawn(ds, name):
    """(cells that are drawn (columns, rows), x, y of their edges, legend entries, marks by colour)."""
    axes = ds.survey.map(name, ax=Figure(dpi=150).subplots())
    mesh = axes.collections[0]
    edges = mesh.get_coordinates()
    legend = (
        {text.get_text() for text in axes.get_legend().get_texts()} if axes.get_legend() else set()
    )
    marks = {str(line.get_markerfacecolor()): line.get_xydata() for line in axes.lines}
    return mesh.get_array().T, edges[0, :, 0], edges[:, 0, 1], legend, marks


def places(ds, where):
    """Coordinates (x, y) of the points."""
    i, j = np.nonzero(np.asarray(where))
    return ds.k.values[i], ds.rho.values[j]


@pytest.mark.parametrize("lazy", [False, True])
def test_no_point_of_a_large_map_is_lost(large, lazy):
    ds = (
        large.copy(
            data={name: da.from_array(v.values, chunks=(300, 40)) for name, v in large.items()}
        )
        if lazy
        else large
    )
    cells, x, y, legend, marks = drawn(ds, "verdict")
    assert cells.shape[0] < LONG / 2 and legend == {
        f"unstable ({int((large.verdict == 0).sum()):,})", f"stable ({int(((large.verdict == 1)).sum()):,})",
        "marginal (3)", "undecided (5)", "failed (4)", "outside the domain (2,100)",
    }  # fmt: skip
    for colour, where in (
        ("#000000", (large.verdict == -1) & (large.status == 0)), ("white", large.status == status.STEP_LIMIT)
    ):  # fmt: skip
        for px, py in zip(*places(large, where), strict=True):
            near = np.hypot(
                np.log(marks[colour][:, 0] / px) / np.log(1e4), marks[colour][:, 1] - py
            )
            assert near.min() < 0.01
    for px, py in zip(*places(large, large.verdict == 2), strict=True):
        i, j = np.searchsorted(x, px) - 1, np.searchsorted(y, py) - 1
        assert (cells[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2] == 2).any()
    inside = cells[: np.searchsorted(x, large.k.values[-60])]
    assert (inside == 1).any() and (inside == 0).any() and cells.mask[-2:].all()


def test_a_cell_of_numbers_shows_the_largest_of_its_points(large):
    cells, *_, legend, _ = drawn(large, "exponent")
    assert legend == {"failed (4)", "outside the domain (2,100)"}
    factor = -(-LONG // cells.shape[0])
    assert factor == 4 and cells.shape[1] == 70
    points = np.pad(
        large.exponent.values, ((0, cells.shape[0] * factor - LONG), (0, 0)), constant_values=np.nan
    )
    points = points.reshape(-1, factor, 70)
    largest = np.nan_to_num(abs(points), nan=-1).argmax(axis=1, keepdims=True)
    expected = np.take_along_axis(points, largest, axis=1)[:, 0]
    np.testing.assert_array_equal(cells[~cells.mask], expected[~cells.mask].astype(np.float32))
    failed = np.isnan(points[: LONG // factor]).any(axis=1)
    np.testing.assert_array_equal(cells.mask[: len(failed)], failed)


def test_a_small_map_is_drawn_point_by_point(large):
    small = large.isel(k=slice(1000, 1300))
    cells, *_, legend, _ = drawn(small, "verdict")
    np.testing.assert_array_equal(cells[~cells.mask], small.verdict.values[~cells.mask])
    np.testing.assert_array_equal(cells.mask, small.status.values != 0)
    assert f"unstable ({int((small.verdict == 0).sum()):,})" in legend
