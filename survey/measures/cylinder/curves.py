"""The curves that [boundaries] draws on maps of the flow phi' = w, w' = f w + g on the cylinder.

On a map of initial states they part the fates: see `separatrices`. On a map of two parameters they
part the portraits: see `bifurcations`.
"""

import math

import numpy as np

from survey.measures.cylinder import (
    bifurcations,
    cycle_counts,
    cycle_folds,
    own_bifurcations,
    separatrices,
)
from survey.measures.cylinder.separatrices import SYSTEM
from survey.measures.sampled import joined
from survey.measures.tracks import Track
from survey.scene import Output

CLASSES = {
    "stable_manifold": 0, "unstable_cycle": 1, "stable_cycle": 2, "saddle": 3, "sink": 4, "centre": 5, "source": 6,
    "fold": 7, "cusp": 8, "supercritical_hopf": 9, "subcritical_hopf": 10, "bogdanov_takens": 11,
    "generalised_hopf": 12, "ends": 13, "homoclinic": 14, "heteroclinic": 15,
    "cycle_fold": 16,
}  # fmt: skip
TITLE = "what the curve is"
_COUNTED = (
    "to some points of each curve on a map of two parameters, where the return maps are conclusive"
)
STATE = ("phi0", "w0")
SEARCHES = 3  # of parts of a line
ALONG = (
    Output("equilibrium_phi", "angle of the equilibrium, or of the saddle of a stable manifold", r"\varphi_e",
           units="rad",
           applies="to stable manifolds, equilibria and their bifurcations"),
    Output("multiplier", "Floquet multiplier of the cycle", "m", applies="to cycles, and at folds of cycles"),
    Output("cycle_phi", "angle of a state on the semi-stable cycle: phi = 0, or the right turning point of a libration",
           r"\varphi_c", units="rad", applies="at folds of cycles"),
    Output("cycle_w", "velocity of a state on the semi-stable cycle", "w_c", applies="at folds of cycles"),
    Output("cycles_left", "number of cycles beside the curve, to the left of the order of its points (the first axis "
           "pointing to the right, the second upward)", applies=_COUNTED),
    Output("cycles_right", "number of cycles beside the curve, to the right of the order of its points",
           applies=_COUNTED),
)  # fmt: skip


def refusal(axes, scene, options=None):
    """Why there are no curves on a map of these axes, in words; None if there are."""
    if scene.FAMILY == "abel":
        return _refusal_of_own(axes, scene)
    if not {p.name for p in scene.PARAMETERS}.issuperset(SYSTEM):
        return (
            "curves are available for the scene gyrostat; its parameters are the outputs "
            "reduced_NAME: use that scene"
        )
    own = set(axes[:2])
    if (
        len(axes) in (2, 3)
        and (own == set(STATE) or own <= set(SYSTEM))
        and set(axes[2:]) <= set(SYSTEM)
    ):
        return None
    return (
        f"curves are known on two axes of {', '.join(SYSTEM)}, or on {', '.join(STATE)}, in either case with at most "
        f"one more axis of the former after them, not on {', '.join(axes) or 'none'}"
    )


def _refusal_of_own(axes, scene):
    """As `refusal`, for a user's f and g."""
    own = [p.name for p in scene.own]
    if scene.period is None:
        return "no curves are known: they are where f and g have the period 2 pi (PERIOD)"
    if len(axes) in (2, 3) and (
        set(axes) <= set(own) or (set(axes[:2]) == set(STATE) and set(axes[2:]) <= set(own))
    ):
        return None
    return (
        f"curves are known on two axes of {', '.join(own)}, or three, or on {', '.join(STATE)} with at most one more "
        f"after them, not on {', '.join(axes) or 'none'}"
    )


def searched(scene, square, axes, fixed, options):
    """The Curves on the map of `axes`, the unit square `square`; `fixed` holds the other parameters."""
    if scene.FAMILY == "cylinder":
        return closed(square, axes, fixed, {})
    if set(axes) == set(STATE):
        (flow,) = scene.flows(np.array([[fixed[p.name] for p in scene.own]]))
        return _of_states(square, axes, flow)
    plane = own_bifurcations.ScenePlane(square, tuple(axes), fixed, scene)
    return _of_parameters(plane, own_bifurcations.found)


def closed(square, axes, fixed, options):
    """The Curves on the map of `axes`, the unit square `square`; `fixed` holds the other parameters."""
    if set(axes) != set(STATE):
        plane = bifurcations.ParameterPlane(square, tuple(axes), fixed)
        return _of_parameters(plane, bifurcations.found)
    return _of_states(square, axes, [fixed[k] for k in SYSTEM])


def _of_states(square, axes, flow):
    """The Curves on a map of initial states."""
    found, lacking = separatrices.found(square, axes, flow)
    curves = joined(
        [(CLASSES[kind], *rest) for kind, *rest in found], [output.name for output in ALONG]
    )
    curves.complete = False if lacking and square.across is not None else None
    return curves


def _of_parameters(plane, find):
    """The Curves that `find` finds on a map of parameters, with the numbers of cycles beside them
    and those that are unexplained.
    """
    with np.errstate(all="ignore"):
        rows = [bifurcations.counted(plane, *row) for row in find(plane)]
        if plane.square.across is None:
            counts = cycle_counts.on_lattice(plane)
            lost = cycle_counts.lost(plane, rows, counts)
            folds = [
                bifurcations.counted(plane, *fold)
                for fold in cycle_folds.found(plane, lost)
                if not _is_there(plane, fold, rows)
            ]
            if folds and len(left := cycle_counts.lost(plane, rows + folds, counts)) < len(lost):
                rows, lost = rows + folds, left
            missed = len(lost)
        else:
            rows, missed = _on_border(plane, find, rows)
    curves = joined(
        [(CLASSES[kind], *rest) for kind, *rest in rows], [output.name for output in ALONG]
    )
    curves.unexplained = missed
    curves.complete = False if missed and plane.square.across is not None else None
    return curves


def _is_there(plane, fold, rows):
    """Does the fold (a row) lie on one of the rows? Drawn twice it could count as often or not, and
    so explain a segment that it does not.
    """
    own, *others = (
        Track(x, *np.zeros((4, len(x))))
        for x in (plane.square.positions(xy) for kind, xy, *_ in (fold, *rows) if kind == fold[0])
    )
    return any(own.within(other, math.inf) for other in others)


def _on_border(plane, find, rows):
    """The rows, and along how many parts of the border that is asked for alone they do not explain
    the numbers of cycles; such parts are searched again, each as a map of its own.
    """
    parts = cycle_counts.lost_on_border(plane, rows)
    for _ in range(SEARCHES):
        before = len(rows)
        for low, high in parts:
            part = plane.part(low, high)
            recounted = (bifurcations.counted(part, *row) for row in find(part))
            rows += [
                (kind, xy, error * (high - low), known) for kind, xy, error, known in recounted
            ]
        if len(rows) == before:
            break
        parts = cycle_counts.lost_on_border(plane, rows)
    return rows, len(parts)


def seconds(axes):
    """Estimated seconds on one thread of the curves on one map, measured; or along one axis alone."""
    own = set(axes[:2])
    if own <= set(STATE):
        return 0.1
    return 1.4 if len(axes) == 1 else 20.0 if own <= set(SYSTEM) else 30.0
