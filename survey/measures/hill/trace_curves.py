"""The curves that [boundaries] draws of Hill's equations without factors at T/2: z is not even, or
there is damping.

Without damping the monodromy matrix over one period T has determinant 1, so that with its trace D

    1 - D^2 / 4 = t^2 - r^2,   t = (y2 - y1') / 2,   r^2 = ((y1 - y2') / 2)^2 + ((y2 + y1') / 2)^2.

Of the edges of tongues, which have D = 2 or -2, one has t = r, the other one t = -r. Where a tongue
is narrow t - r and t + r have simple zeros, as t changes sign inside it, but D lies beyond 2 or -2
by r^2 only; where a band between tongues is narrow D - 2 and D + 2 have them, but t exceeds r only
a little. Taken together, an edge is a simple zero of one of them wherever it is, with a sign given
by the number of edges that have been passed, which follows from verdict and rotation number.

In y'' + 2 c y' + z y = 0 a multiplier is 1 or -1 where the trace is plus or minus 1 + e^(-2 c T).
All these zeros are searched for as those of linear periodic systems are: see
`survey.measures.floquet.curves`, also about what may be missed. There are no edges of rows.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from survey.kernels.hill.answers import STABLE, UNSTABLE
from survey.kernels.math.roundoff import EPS
from survey.measures.floquet import curves
from survey.measures.floquet.curves import ALONG, CLASSES, NUMBER, TITLE, refusal
from survey.measures.floquet.multipliers import MINUS_ONE, PLUS_ONE
from survey.measures.hill.edges import COUNTS, has_factors
from survey.measures.segments import UNKNOWN

ENTRIES = ("y1", "y2", "dy1", "dy2")  # by rows

__all__ = ["ALONG", "CLASSES", "NUMBER", "TITLE", "refusal", "searched", "serves"]


def serves(scene):
    """Are its curves found here?"""
    return not has_factors(scene)


def searched(scene, square, axes, fixed, options):
    """The Curves on the map of `axes`, the unit square `square`; `fixed` holds the other parameters."""
    system = _Damped if getattr(scene, "DAMPED", False) else _Undamped
    return curves.searched(system(scene), square, axes, fixed, options)


class _System:
    """The scene as a linear periodic system."""

    FAMILY = "floquet"

    def __init__(self, scene):
        self.scene, self.PARAMETERS = scene, scene.PARAMETERS

    def solved(self, point, request, *wanted):
        """These outputs of the scene."""
        # `auto` would go on to more digits beside the curves, which are of no use here
        own = replace(request, method="taylor16", variables=frozenset(wanted), out={})
        return self.scene.solve(point, own)


class _Undamped(_System):
    """Time is in units of T / pi."""

    structure = "reversible"

    def functions(self, _n):
        """[(class of the zeros, function of what `solve` gives -> (values, error bounds))]."""
        return [
            (PLUS_ONE if which in (0, 3) else MINUS_ONE, partial(_edge, which))
            for which in range(4)
        ]

    def passed(self, edges, doubt):
        """{class: how many of its edges have been passed (N)}, UNKNOWN where that is not certain."""
        plus = (edges + 3) // 4 + edges // 4
        counts = {PLUS_ONE: plus, MINUS_ONE: edges - plus}
        return {
            kind: np.where(doubt == 0.0, count, UNKNOWN).astype(int)
            for kind, count in counts.items()
        }

    def solve(self, point, request):
        """{"monodromy": (N, 2, 2), "edges": how many edges of tongues have been passed (N), and
        "_error" of both}.
        """
        out = self.solved(point, request, *ENTRIES, *COUNTS, "period")
        M, E = (np.stack([out[name + end] for name in ENTRIES], axis=-1) for end in ("", "_error"))
        unit = (out["period"] / np.pi)[:, None] ** np.array([0.0, -1.0, 1.0, 0.0])
        M, E = ((unit * entries).reshape(-1, 2, 2) for entries in (M, E + 8 * EPS * abs(M)))
        edges, doubt = _passed(M, out)
        return {"monodromy": M, "monodromy_error": E, "edges": edges, "edges_error": doubt}


class _Damped(_System):
    """Of the monodromy matrix the trace and the determinant are known."""

    structure = "none"

    def solve(self, point, request):
        """{"monodromy": (N, 2, 2), "monodromy_error": ...}, a matrix of that trace and determinant."""
        out = self.solved(point, request, "discriminant")
        M, E = np.zeros((2, *out["discriminant"].shape, 2, 2))
        M[..., 0, 0], E[..., 0, 0] = out["discriminant"], out["discriminant_error"]
        product, E[..., 0, 1] = self.scene.product(point, out)
        M[..., 1, 0], M[..., 0, 1] = 1.0, -product
        return {"monodromy": M, "monodromy_error": E}


def _passed(M, out):
    """How many edges have been passed, 2 n in tongue n and 2 n + 1 above it, and by how many this
    may be wrong.
    """
    turns, bar = 2.0 * out["rotation_number"], 2.0 * out["rotation_number_error"]
    nearest = np.rint(turns)
    # t > 0 above even tongues: next to an edge the rotation number alone leaves two bands open
    even = M[:, 0, 1] > M[:, 1, 0]
    band = np.where(
        abs(turns - nearest) > bar, np.floor(turns), nearest - ((nearest % 2 == 0) != even)
    )
    stable, unstable = out["verdict"] == STABLE, out["verdict"] == UNSTABLE
    edges = np.where(stable, 2.0 * band + 1.0, 2.0 * nearest)
    return edges, np.where((stable | unstable) & (bar < 0.5), 0.0, np.inf)


def _edge(which, M, E, edges, doubt):
    """A function that changes sign at edge number `which` of four, 0 being that above tongue 0, and
    at every fourth one from there: the distance from t = r or t = -r and D = 2 or -2, which is 0
    there alone, and its bounds.
    """
    plus = which in (0, 3)
    # the number of the tongue: what moves there is nearly cos(tongue time), and r is small in units
    # of 1 / tongue
    tongue = 2.0 * np.rint(0.5 * (0.5 * edges - (not plus))) + (not plus)
    unit = np.maximum(tongue, 1.0)
    half = 0.5 * (1.0 + 8.0 * EPS)
    y2, dy1 = unit * M[:, 0, 1], M[:, 1, 0] / unit
    t, s, p = 0.5 * (y2 - dy1), 0.5 * (M[:, 0, 0] - M[:, 1, 1]), 0.5 * (y2 + dy1)
    r, D = np.hypot(s, p), M[:, 0, 0] + M[:, 1, 1]
    off, across = half * (E[:, 0, 1] * unit + E[:, 1, 0] / unit), half * (E[:, 0, 0] + E[:, 1, 1])
    value = np.hypot(t - (r if which < 2 else -r), 0.5 * D - (1.0 if plus else -1.0))
    bar = off + across + np.hypot(off, across) + 16.0 * EPS * (1.0 + abs(t) + r)
    # the sign is certain as soon as the number of edges is
    bar = np.where(doubt == 0.0, np.minimum(bar, 0.5 * value), np.maximum(bar, 2.0 * value))
    return np.where((edges + 3 - which) // 4 % 2 == 1, value, -value), bar
