"""Values that an earlier file holds: they have the same bits, so that only the points between them
are solved.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from math import prod

import numpy as np

from survey.file import reading
from survey.file.labels import as_stored, layout
from survey.sweep import solve


@dataclass(frozen=True)
class Earlier:
    """The points of a file that belong to a grid too.

    `where` holds for each dimension of the grid the position of its values in the file (-1: not in
    it); `dims` those dimensions that the file has, too; `fixed` the position along those that the
    grid does not have. `version` tells the file from one that replaces it.
    """

    path: str
    version: int
    where: Mapping[str, np.ndarray]
    dims: tuple[str, ...]
    fixed: Mapping[str, int]

    @property
    def points(self):
        """The number of points that need not be solved."""
        return prod(int((source >= 0).sum()) for source in self.where.values())

    def values(self, name, cuts):
        """A variable at the held points of a block: its dimensions are those of the grid, then its own."""
        at = {
            dim: source[cut][source[cut] >= 0]
            for (dim, source), cut in zip(self.where.items(), cuts, strict=True)
        }
        held = (
            _dataset(self.path, self.version)[name]
            .isel(self.fixed)
            .isel({dim: at[dim] for dim in self.dims})
        )
        held = as_stored(held.transpose(*self.dims, ...))
        missing = [i for i, dim in enumerate(at) if dim not in self.dims]
        return np.expand_dims(held, tuple(missing))


@lru_cache(1)
def _dataset(path, version):
    """The file as a dataset, opened once in each process."""
    return reading.load(path)


def solve_block(scene, request, grid, block, earlier=None):
    """`solve.solve_block`, of whose points those in the file are taken from it."""
    held = (
        [earlier.where[dim][cut] >= 0 for dim, cut in zip(grid.sizes, block, strict=True)]
        if earlier
        else []
    )
    if not held or not all(some.any() for some in held):
        return solve.solve_block(scene, request, grid, block)
    shape = tuple(some.size for some in held)
    point = grid.point(block)
    request = replace(request, lines=grid.lines, fixed=grid.fixed, ranges=grid.ranges)
    out = {
        name: np.empty(shape + extra, kind)
        for name, (kind, _, extra) in layout(scene, request).items()
    }
    for name, values in out.items():
        values[np.ix_(*held)] = earlier.values(name, block)
    for rectangle in _rest(held):
        part = {name: _at(values, rectangle) for name, values in point.items()}
        solved = solve.solve_point(scene, request, part, tuple(index.size for index in rectangle))
        for name, values in solved.items():
            out[name][np.ix_(*rectangle)] = values
    return out


def _rest(held):
    """Rectangles, an index array for each dimension, that together hold the points that are not in
    the file.
    """
    for d, some in enumerate(held):
        inside = [np.flatnonzero(other) for other in held[:d]]
        rectangle = [
            *inside,
            np.flatnonzero(~some),
            *(np.arange(other.size) for other in held[d + 1 :]),
        ]
        if all(index.size for index in rectangle):
            yield rectangle


def _at(values, rectangle):
    for d, index in enumerate(rectangle):
        if values.shape[d] > 1:
            values = np.take(values, index, axis=d)
    return values


def obstacle(scene, request, grid, earlier, old, points=3):
    """Why the values in the file are not those that this grid would get, or "".

    Some of them are solved again: the bits must be the same, and so must each axis that the scene
    looks at as a whole. `old`: the file's own grid.
    """
    seen = [(_Seen(grid.lines), old.lines), (_Seen(grid.ranges), old.ranges)]
    request = replace(request, lines=seen[0][0], fixed=grid.fixed, ranges=seen[1][0])
    sources = [np.flatnonzero(source >= 0) for source in earlier.where.values()]
    for k in range(points):
        here = [source[k * (source.size - 1) // (points - 1)] for source in sources]
        cuts = tuple(
            slice(0, size) if dim in grid.uncut else slice(i, i + 1)
            for i, (dim, size) in zip(here, grid.sizes.items(), strict=True)
        )
        shape = tuple(cut.stop - cut.start for cut in cuts)
        for name, values in solve.solve_point(scene, request, grid.point(cuts), shape).items():
            if not np.array_equal(
                values, earlier.values(name, cuts), equal_nan=values.dtype.kind == "f"
            ):
                return f"{name} would have different bits on this map"
    other = sorted(
        name for now, then in seen for name in now.names if dict.get(now, name) != then.get(name)
    )
    return (
        f"on a map, its values depend on all of the axis {other[0]}, which differs" if other else ""
    )


class _Seen(dict):
    """The lines or ranges of a grid, and the names of those that a scene has looked at."""

    def __init__(self, lines):
        super().__init__(lines)
        self.names = set()

    def __contains__(self, name):
        self.names.add(name)
        return super().__contains__(name)

    def get(self, name, default=None):
        self.names.add(name)
        return super().get(name, default)
