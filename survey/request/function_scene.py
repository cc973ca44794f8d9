"""What the scenes of a user's functions share: how they travel to other processes, and how they refuse."""

from collections.abc import Callable
from dataclasses import fields

import numpy as np

from survey.errors import BadInput

_known = {}  # by hash: a worker process compiles a scene once, for all of its blocks


class FunctionScene:
    """Base of `HillScene`, `AbelScene` and `TracedScene`; `own`: parameters of the functions."""

    NAME: str
    HASH: str
    about: str
    own: tuple
    check: Callable[..., None]  # refuses functions that are wrong at these points

    def __post_init__(self):
        object.__setattr__(self, "__doc__", self.about)

    def __reduce__(self):
        return _restored, (type(self), self.HASH, [getattr(self, field.name) for field in fields(self)])

    def _points(self, point):
        """The parameters of the functions at the points of a block (N, n), and the block's shape."""
        shape = np.broadcast_shapes(*(np.shape(values) for values in point.values()))
        columns = [np.broadcast_to(point[p.name], shape).reshape(-1) for p in self.own]
        return np.stack(columns, axis=1).astype(float), shape

    def _where(self, point):
        return ", ".join(f"{p.name} = {value:g}" for p, value in zip(self.own, point, strict=True))

    def _refuse(self, what, remedy):
        raise BadInput(f"{self.NAME}: {what}; {remedy}")

    def _refuse_index(self, call, error):
        """Refuse a function that raised this IndexError, as `call` is written."""
        n = len(self.own)
        if "only integers" in str(error):
            self._refuse(f"{call} accesses a parameter by name, but p is an array", "write p[0], p[1], ...")
        self._refuse(f"{call} indexes beyond an array ({error})", f"PARAMETERS names {n}: p[0] to p[{n - 1}]")


def _restored(kind, digest, values):
    """The scene with these values; the same object for the same hash, so that its kernels are compiled once."""
    return _known.setdefault(digest, kind(*values))
