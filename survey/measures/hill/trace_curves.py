"""The curves that [boundaries] draws of Hill's equations without factors at T/2: z is not even, or there is damping.

A multiplier is 1 or -1 where the trace of the monodromy matrix is plus or minus 1 + their product, which is 1, or
e^(-2 c T) of y'' + 2 c y' + z y = 0. These zeros are searched for as those of linear periodic systems are: see
`survey.measures.floquet.curves`, also about what may be missed. There are no edges of rows.
"""

from dataclasses import replace

import numpy as np

from survey.measures.floquet import curves
from survey.measures.floquet.curves import ALONG, CLASSES, TITLE, refusal

__all__ = ["ALONG", "CLASSES", "TITLE", "refusal", "searched", "serves"]


def serves(scene):
    """Are its curves found here?"""
    return getattr(scene, "DAMPED", False) or not getattr(scene, "EVEN", True)


def searched(scene, square, axes, fixed, options):
    """The Curves on the map of `axes`, the unit square `square`; `fixed` holds the other parameters."""
    return curves.searched(_System(scene), square, axes, fixed, options)


class _System:
    """The scene as a linear periodic system, of whose monodromy matrix the trace and the determinant are known."""

    FAMILY = "floquet"

    def __init__(self, scene):
        self.scene, self.PARAMETERS = scene, scene.PARAMETERS
        self.damped = getattr(scene, "DAMPED", False)
        self.structure = "none" if self.damped else "reversible"

    def solve(self, point, request):
        """{"monodromy": (N, 2, 2), "monodromy_error": ...}, a matrix of that trace and determinant."""
        # `auto` would go on to more digits beside the curves, which are of no use here
        out = self.scene.solve(point, replace(request, method="taylor16", variables=frozenset({"discriminant"})))
        trace, bar = out["discriminant"], out["discriminant_error"]
        M, E = np.zeros((2, *trace.shape, 2, 2))
        M[..., 0, 0], E[..., 0, 0], M[..., 1, 0], M[..., 0, 1] = trace, bar, 1.0, -1.0
        if self.damped:
            product, E[..., 0, 1] = self.scene.product(point, out)
            M[..., 0, 1] = -product
        return {"monodromy": M, "monodromy_error": E}
