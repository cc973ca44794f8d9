"""A block as rows and lanes: what depends on some axes alone is computed once for each position
along those.
"""

from math import prod

import numpy as np


class Rows:
    """Axes along which any of `shared` is long make the rows, the others the lanes; `shape` is the
    block's.
    """

    def __init__(self, shared, *others):
        self.shape = np.broadcast_shapes(*(np.shape(a) for a in (*shared, *others)))
        of_rows = [
            axis for axis in range(len(self.shape)) if any(self._size(a, axis) > 1 for a in shared)
        ]
        of_lanes = [axis for axis in range(len(self.shape)) if axis not in of_rows]
        self.order, self.row_shape = of_rows + of_lanes, tuple(self.shape[axis] for axis in of_rows)
        self.at_first = tuple(
            slice(None) if axis in of_rows else 0 for axis in range(len(self.shape))
        )
        self.rows = prod(self.shape[axis] for axis in of_rows)
        self.lanes = prod(self.shape[axis] for axis in of_lanes)
        self.sorted_shape = [self.shape[axis] for axis in self.order]
        self.back_order = sorted(range(len(self.order)), key=self.order.__getitem__)

    def _size(self, array, axis):
        """Length of `array` along an axis of the block (arrays with fewer dimensions broadcast from
        the right).
        """
        axis -= len(self.shape) - np.ndim(array)
        return np.shape(array)[axis] if axis >= 0 else 1

    def columns(self, arrays):
        """`per_row` of several arrays, (arrays, rows)."""
        found = np.empty((len(arrays), self.rows))
        for column, array in zip(found, arrays, strict=True):
            first = self._first(array)
            column.reshape(first.shape)[...] = first
        return found

    def per_row(self, array):
        """One value per row, of an array that is constant along the lanes."""
        return np.array(self._first(array), order="C").reshape(self.rows)

    def seen(self, array):
        """As `per_row`, to read alone: no copy of what is an array per row already."""
        return np.require(self._first(array).reshape(self.rows), requirements=["C", "W"])

    def _first(self, array):
        """The array at the first of the lanes, in the shape of the rows."""
        array = np.asarray(array, dtype=float)
        array = array.reshape((1,) * (len(self.shape) - array.ndim) + array.shape)
        first = array[self.at_first]
        return first if first.shape == self.row_shape else np.broadcast_to(first, self.row_shape)

    def per_point(self, array):
        """All values (rows, lanes), contiguous float64; a copy, as for read-only views kernels
        would compile again.
        """
        return np.array(self.view(array), order="C")

    def view(self, array):
        """All values (rows, lanes), to read alone."""
        return self._full(array).reshape(self.rows, self.lanes)

    def _full(self, array):
        """All values, a read-only view with the axes in order."""
        return np.broadcast_to(np.asarray(array, dtype=float), self.shape).transpose(self.order)

    def straight(self, out):
        """The arrays `out`, in the block's shape, as flat ones (rows times lanes); none of them where
        they are not contiguous, or the points are in another order.
        """
        if self.order != sorted(self.order) or not all(a.flags.c_contiguous for a in out.values()):
            return {}
        return {name: array.reshape(-1) for name, array in out.items()}

    def back(self, array):
        """An array (rows, lanes) in the block's shape; one that is broadcast to that, as (rows, 1), as a
        view to read alone.
        """
        full = array.shape == (self.rows, self.lanes)
        wide = array if full else np.broadcast_to(array, (self.rows, self.lanes))
        moved = wide.reshape(self.sorted_shape).transpose(self.back_order)
        return np.ascontiguousarray(moved) if full else moved
