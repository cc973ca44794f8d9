"""The surfaces that [boundaries] draws in a box of three parameters of Hill's equation: the edges
of its tongues.

They are zeros of the four factors at half a period, as the edges on rows are (see `edges`).
"""

import numpy as np

from survey.measures.hill.edges import CLASSES, FACTORS
from survey.scene import Request

__all__ = ["ALONG", "CLASSES", "TITLE", "Functions"]
TITLE = "kind of the periodic solution at the edge"
ALONG = ()
# of the factors at corners of triangles, and to see where the surfaces are
RTOL, ROUGH = 1e-11, 1e-9


class Functions:
    """The factors at positions in the box (N, 3) of `axes`; `fixed` holds the other parameters."""

    def __init__(self, scene, box, axes, fixed, options, method="auto", rtol=RTOL):
        self.scene, self.box, self.axes, self.fixed = scene, box, axes, fixed
        self.options, self.method, self.rtol = options, method, rtol

    def on_lattice(self, x):
        """{class: (values, error bounds)}, to see where surfaces are; nothing else is counted."""
        return self._factors(x, ROUGH, FACTORS), None

    def sharp(self, x, kind):
        """(values, error bounds) of one class."""
        return self._factors(x, self.rtol, [FACTORS[kind]])[kind]

    def passing(self, x, kind):
        """All zeros are edges, and nothing else is known of them."""
        return np.ones(len(x), bool), {}

    def _factors(self, x, rtol, names):
        values = self.box.parameters(x)
        point = self.fixed | {name: values[:, k] for k, name in enumerate(self.axes)}
        with np.errstate(all="ignore"):
            out = self.scene.solve(
                point, Request(self.options, self.method, rtol, frozenset(names))
            )
        return {FACTORS.index(name): (out[name], out[f"{name}_error"]) for name in names}
