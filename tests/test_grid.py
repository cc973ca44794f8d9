"""Axes -> coordinates -> blocks: every point once, in any cut, with its own parameters."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from survey.errors import BadInput
from survey.grid import Grid, check_axis, coordinates

sizes = st.lists(st.integers(1, 7), min_size=0, max_size=4)


def grid_of(lengths, whole=()):
    dims = [f"x{i}" for i in range(len(lengths))]
    parameters = {
        dim: ((dim,), np.arange(length) * 10.0**i)
        for i, (dim, length) in enumerate(zip(dims, lengths, strict=True))
    }
    return Grid(
        dict(zip(dims, lengths, strict=True)),
        parameters | {"fixed": ((), np.float64(7))},
        frozenset(whole),
    )


@given(sizes, st.integers(1, 400))
def test_blocks_cover_every_point_once(lengths, points_per_block):
    grid = grid_of(lengths)
    seen = np.zeros(grid.shape, int)
    for block in grid.blocks(points_per_block):
        assert seen[block].size <= points_per_block
        seen[block] += 1
    assert (seen == 1).all()


@given(sizes, st.integers(1, 60), st.integers(1, 200), st.integers(1, 60), st.booleans())
def test_regions_hold_whole_tiles_and_whole_blocks(lengths, block, region, tile, whole):
    grid = grid_of(lengths, whole={"x0"} if whole and lengths else ())
    of_tile, regions = grid.tiled(block, region, tile)
    assert np.prod(of_tile) <= tile
    seen = np.zeros(grid.shape, int)
    for place, blocks in regions:
        for cut, length, size in zip(place, of_tile, grid.shape, strict=True):
            assert cut.start % length == 0 and (cut.stop % length == 0 or cut.stop == size)
        seen[place] += 1
        for part in blocks:
            assert all(
                a.start <= b.start <= b.stop <= a.stop for a, b in zip(place, part, strict=True)
            )
            assert whole or seen[part].size <= block
            seen[part] += 1
        assert whole or seen[place].size <= region
    assert (seen == 2).all()


@given(sizes.filter(len), st.integers(1, 400))
def test_a_whole_dimension_is_never_cut(lengths, points_per_block):
    grid = grid_of(lengths, whole={"x0"})
    assert all(block[0] == slice(0, lengths[0]) for block in grid.blocks(points_per_block))


@given(sizes, st.integers(1, 400))
def test_a_block_holds_its_points_parameters(lengths, points_per_block):
    grid = grid_of(lengths)
    everywhere = np.full(lengths, 7.0) + sum(
        np.ix_(*(np.arange(n) * 10.0**i for i, n in enumerate(lengths)))
    )
    for block in grid.blocks(points_per_block):
        point = grid.point(block)
        assert all(values.ndim == len(lengths) for values in point.values())
        np.testing.assert_array_equal(sum(point.values()), everywhere[block])


def test_shared_and_reordered_dimensions_are_aligned():
    a = np.arange(6.0).reshape(3, 2)
    grid = Grid({"x": 2, "y": 3}, {"a": (("y", "x"), a), "b": (("x",), np.array([10.0, 20.0]))})
    point = grid.point((slice(0, 2), slice(1, 3)))
    np.testing.assert_array_equal(point["a"], a.T[:, 1:])
    assert point["b"].shape == (2, 1)


@given(
    st.floats(1e-3, 1e3),
    st.floats(1e-3, 1e3),
    st.integers(2, 50),
    st.sampled_from(["linear", "log"]),
)
def test_coordinates_have_exact_ends_and_the_right_number(start, stop, num, spacing):
    assume(start != stop)
    values = coordinates(start, stop, num, spacing)
    assert (values[0], values[-1], values.size) == (start, stop, num)


def test_one_value_has_no_room_for_two_ends_nor_two_for_one():
    with pytest.raises(BadInput, match="num = 1"):
        coordinates(0.0, 1.0, 1)
    with pytest.raises(BadInput, match="start and stop are both"):
        coordinates(0.5, 0.5, 3)
    assert coordinates(0.5, 0.5, 1) == [0.5]


def test_ends_that_differ_by_more_than_a_float_holds_are_refused():
    with pytest.raises(BadInput, match="differ by more than the largest number"):
        coordinates(-1.1e308, 1.7e308, 3)


def test_log_coordinates_need_positive_ends():
    with pytest.raises(BadInput, match="positive"):
        coordinates(0.0, 1.0, 5, "log")


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ([], "at least one value"),
        ([1, np.nan], "value 2 is nan"),
        ([1, 1], "occurs twice"),
        ([1, 3, 2], "sort them"),
    ],
)
def test_bad_axes_are_refused_by_name(values, complaint):
    with pytest.raises(BadInput, match=f"axes.k: .*{complaint}"):
        check_axis("axes.k", np.array(values, float))


def test_ends_and_middles_are_those_points_of_the_whole_grid():
    a, b, pairs = np.arange(5.0), 10 + np.arange(2.0), 100 + np.arange(10.0).reshape(2, 5)
    grid = Grid({"a": 5, "b": 2}, {"a": (("a",), a), "b": (("b",), b), "c": (("b", "a"), pairs)})
    found = grid.ends_and_middles()
    assert found["a"].tolist() == [0, 0, 2, 2, 4, 4]
    assert found["b"].tolist() == [10, 11, 10, 11, 10, 11]
    assert found["c"].tolist() == [100, 105, 102, 107, 104, 109]
    alone = Grid({}, {"a": ((), np.array(3.0))}).ends_and_middles()
    assert alone["a"].tolist() == [3]
