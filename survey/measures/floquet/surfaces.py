"""The surfaces that [boundaries] draws in a box of three parameters: where multipliers reach or
leave the unit circle.

They are zeros of the functions of `bifurcations`, as the curves on maps of two parameters are (see
`curves`).
"""

from survey.measures.floquet import bifurcations, curves, row_count
from survey.measures.floquet.curves import ALONG, CLASSES, TITLE

__all__ = ["ALONG", "CLASSES", "TITLE", "Functions", "refusal"]
RTOL, ROUGH = 1e-11, 1e-9  # of M for corners of triangles, and to see where the surfaces are


def refusal(scene):
    """Why there are no surfaces, in words; None if there are."""
    if scene.FAMILY == "orbit":
        return "has periodic orbits, and surfaces are available only for linear systems"
    return None


class Functions:
    """The functions at positions in the box (N, 3) of `axes`; `fixed` holds the other parameters."""

    def __init__(self, scene, box, axes, fixed, options, method="auto", rtol=RTOL):
        self.structure, self.rtol = scene.structure, rtol
        self.matrices = curves.matrices_of(scene, box, axes, fixed, options, method)

    def on_lattice(self, x):
        """{class: (values, error bounds)}, to see where surfaces are, and the numbers (N) of
        multipliers outside the unit circle, -1 where they are not certain.
        """
        M, E = self.matrices(x, ROUGH)
        counts = row_count.outside(M, E, self.structure)
        return {kind: function(M, E) for kind, function in self._of(M).items()}, counts

    def sharp(self, x, kind):
        """(values, error bounds) of one class."""
        M, E = self.matrices(x, self.rtol)
        return self._of(M)[kind](M, E)

    def passing(self, x, kind):
        """(is it this that passes?, {name of ALONG: (values, error bounds)}) at zeros of a class."""
        sure, angle, bar, outside = bifurcations.passing(
            *self.matrices(x, self.rtol), kind, self.structure
        )
        return sure, {"angle": (angle, bar), "outside": (outside, 0.0 * bar)}

    def _of(self, M):
        return bifurcations.functions(M.shape[1], self.structure)
