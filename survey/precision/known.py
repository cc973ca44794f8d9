"""References of the charts from `survey.truth`: points with the exact value of an output, and the verdict."""

from collections import defaultdict

import numpy as np


def references(truth, points, options, name):
    """[(parameters, options, {name: exact value}, None), ...] of points {parameter: (N)}, as a case
    gives them.
    """
    size = max(np.size(values) for values in points.values())
    given = {
        key: np.broadcast_to(np.asarray(values, float), size) for key, values in points.items()
    }
    found = truth(given, _Silent(size))
    value, low, _doubt = found[name]
    exact = np.asarray(value + np.asarray(low), dtype=float)
    known = np.isfinite(exact.reshape(size, -1)).all(axis=1)
    return [
        ({key: float(values[i]) for key, values in given.items()}, options, {name: exact[i]}, None)
        for i in np.flatnonzero(known)
    ]


class _Silent(defaultdict):
    """An answer that says nothing: every code is 0, every number too."""

    def __init__(self, size):
        super().__init__()
        self._size = size

    def __missing__(self, name):
        return np.zeros(self._size)
