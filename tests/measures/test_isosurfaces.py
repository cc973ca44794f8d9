"""Triangulated surfaces in a box: closed where they should be, every corner certain, nothing where
nothing is.
"""

import numpy as np
import pytest

from survey.measures import isosurfaces

GRAIN = 2e-16


class Functions:
    """One function of positions (N, 3), known within a bar; in `passes` it counts."""

    def __init__(self, function, bar=1e-13, passes=lambda x: np.ones(len(x), bool)):
        self.function, self.bar, self.passes, self.points = function, bar, passes, 0

    def on_lattice(self, x):
        return {7: self.sharp(x, 7)}, None

    def sharp(self, x, kind):
        assert kind == 7
        self.points += len(x)
        return self.function(x), np.full(len(x), self.bar)

    def passing(self, x, kind):
        return self.passes(x), {"height": (x[:, 2], 0.0 * x[:, 2])}


@pytest.fixture(autouse=True)
def coarse(monkeypatch):
    monkeypatch.setattr(isosurfaces, "LINES", 17)


def find(*given, **more):
    return isosurfaces.find(Functions(*given, **more), GRAIN, ["height"])


def sides(corners):
    """The directed sides of triangles."""
    return np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])


def test_all_cubes_are_cut_alike_from_both_sides():
    """Of any signs a closed surface with one orientation: each side is there once in either direction."""
    values = np.random.default_rng(1).normal(size=(14, 15, 16))
    for cut in np.ndindex(3, 2):
        values[(slice(None),) * cut[0] + (-cut[1],)] = 1.0
    _edges, corners = isosurfaces.marched(values)
    forth = sides(corners)
    back = forth[:, ::-1]
    assert len(corners) > 5000
    assert np.array_equal(np.unique(forth, axis=0), np.unique(back, axis=0))
    assert np.unique(forth, axis=0).shape == forth.shape  # no side belongs to three triangles
    codes = {len(isosurfaces.polygons(code)) for code in range(256)}
    assert min(codes) == 0 and max(codes) == 5


def test_a_sphere():
    centre, radius = np.array([0.52, 0.47, 0.5]), 0.37
    found = find(lambda x: ((x - centre) ** 2).sum(axis=1) - radius**2)
    assert found.kind.tolist() == [7] and found.left_out == 0
    assert found.vertices.tolist() == [len(found.x)] and found.triangles.tolist() == [
        len(found.corners)
    ]
    assert len(found.x) - len(sides(found.corners)) // 2 + len(found.corners) == 2  # Euler
    off = np.hypot(*(found.x - centre).T[:2])
    off = abs(np.hypot(off, found.x[:, 2] - centre[2]) - radius)
    assert (off <= found.error + 1e-16).all() and np.median(found.error) < 1e-12
    for k in (0, 1, 2):  # on the line along its axis, too
        own = found.axis == k
        along = np.zeros((own.sum(), 3))
        along[:, k] = found.error[own]
        signs = [
            np.sign(((found.x[own] + s * along - centre) ** 2).sum(axis=1) - radius**2)
            for s in (-1, 1)
        ]
        assert own.any() and (signs[0] * signs[1] <= 0).all()
    one, two, three = found.x[found.corners].transpose(1, 0, 2)
    volume = (np.cross(one - centre, two - centre) * (three - centre)).sum() / 6
    assert abs(abs(volume) / (4 / 3 * np.pi * radius**3) - 1) < 0.02  # triangles all face one way
    assert np.array_equal(found.along["height"][0], found.x[:, 2])


def test_two_pieces_one_on_a_plane_of_the_lattice():
    """A plane on which the lattice's own points lie is whole; where a second function says so it ends."""
    found = find(
        lambda x: (x[:, 0] - 0.5) * (x[:, 0] - 0.81),
        passes=lambda x: (x[:, 0] < 0.6) | (x[:, 1] > 0.5),
    )
    assert found.triangles.tolist() == [2 * 16 * 16, 2 * 16 * 7] and found.left_out == 0
    whole = np.arange(len(found.x)) < found.vertices[0]
    assert (abs(found.x[:, 0] - np.where(whole, 0.5, 0.81)) <= found.error).all()
    assert found.x[~whole, 1].min() > 0.5
    assert (
        found.corners[: found.triangles[0]].max()
        < found.vertices[0]
        <= found.corners[found.triangles[0] :].min()
    )


@pytest.mark.parametrize(
    "function",
    [
        lambda x: 0.0 * x[:, 0],  # nothing but noise
        lambda x: 1e-14 * np.sin(1e4 * x.sum(axis=1)),
        lambda x: (x[:, 1] - 0.25) ** 2,  # touched on a plane of the lattice
        lambda x: x[:, 2] + 0.0,  # on the border
        lambda x: np.full(len(x), np.nan),
        lambda x: x[:, 0] + 1.0,
    ],
)
def test_nothing(function):
    found = find(function)
    assert found.kind.size == found.x.size == found.corners.size == found.left_out == 0
    assert found.x.shape == found.corners.shape == (0, 3) and found.along["height"][0].shape == (0,)


def test_what_is_not_certain_is_left_out_and_counted():
    """A zero that is known to within more than SURE; where there is no value no cube is cut."""

    def function(x):
        steep = np.where(x[:, 1] < 0.5, 1e-9, 1.0) * (x[:, 0] - 0.3)
        return np.where(x[:, 2] > 0.8, np.nan, steep)

    found = find(function, bar=2e-11)  # half of the plane to within 0.02 alone
    assert found.x[:, 1].min() >= 0.5 and found.x[:, 2].max() <= 0.8
    assert found.left_out == 2 * 8 * 12
    assert (abs(found.x[:, 0] - 0.3) <= found.error).all()


def test_the_bits_do_not_depend_on_who_works_and_what_is_kept():
    def function(x):
        return np.sin(9 * x[:, 0]) * np.cos(7 * x[:, 1]) + x[:, 2] - 0.4

    kept = {}

    def once(name, make):
        kept[name] = kept.get(name) or make()
        return kept[name]

    def backwards(task, items, what):
        return [task(item) for item in list(items)[::-1]][::-1]

    plain = find(function)
    again = isosurfaces.find(Functions(function), GRAIN, ["height"], backwards, once)
    silent = Functions(None)
    third = isosurfaces.find(silent, GRAIN, ["height"], once=once)
    assert silent.points == 0  # all was kept
    for other in (again, third):
        for name in ("x", "error", "corners", "axis", "vertices"):
            np.testing.assert_array_equal(getattr(plain, name), getattr(other, name))
    assert len(kept) == 17 + -(-len(plain.x) // isosurfaces.TOGETHER) + (
        len(plain.x) % isosurfaces.TOGETHER == 0
    )
