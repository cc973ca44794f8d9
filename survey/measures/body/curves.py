"""The boundaries of Clebsch's case on maps of the scene brun_triaxial: where a rotation, or a
critical motion, becomes stable.

With the moment A1 of the axis, A2 and A3 the others, and s the sign that A1 - A2 and A1 - A3 share,
a rotation about the axis of the least or the largest moment is stable where

    Omega^2 - s epsilon (sin(a + b))^2 > 0,  A1 sin(a + b) = sqrt(s A2 (A1 - A3)) + sqrt(s A3 (A1 - A2))        (7),

and that about the middle one is not: where two moments are equal it changes if (7) holds. Critical
motions are stable where the product in (12) is positive. Equation numbers:
`scenes/brun_triaxial.md`. The curves are searched for on LINES lines of the map each way; every
point is bracketed on its line by certain signs. Along one parameter alone those of rotations are
known in closed form, see `critical_rates`.
"""

import numpy as np

from survey.measures import bounded, contours
from survey.measures.body import clebsch, critical_rates
from survey.measures.sampled import joined

CLASSES = {"critical_rate": 0, "equal_moments": 1, "critical_motion": 2}
TITLE = "where the rotation becomes stable (at its critical rate, or as two moments are equal), or the critical motion"
MOMENTS = critical_rates.MOMENTS
AXES = {
    "rotation": (*MOMENTS, "epsilon", "Omega"),
    "critical": (*MOMENTS, "epsilon", "sigma", "p_psi"),
}
ALONG = ()
LINES = 129


def serves(scene):
    """Are curves known for the scene? For whole gyrostats they are not."""
    return "Omega" in {p.name for p in scene.PARAMETERS}


def refusal(axes, scene, options=None):
    """Why there are no curves on a map of these axes, in words; None if there are."""
    if options and options["question"] not in AXES:
        return (
            f"question = {options['question']} has no verdict (only {' and '.join(AXES)} have one)"
        )
    if len(axes) in (1, 2, 3) and any(set(axes) <= set(own) for own in AXES.values()):
        return None
    known = " or of ".join(
        f"{', '.join(own)} (question {question})" for question, own in AXES.items()
    )
    return f"curves are known on up to three axes of {known}, not on {', '.join(axes) or 'none'}"


def closed(square, axes, fixed, options):
    """The Curves on the map of `axes`, the unit square `square`; `fixed` holds the other parameters."""
    if options["question"] == "rotation" and not set(axes) <= set(AXES["rotation"]):
        return _on_a_line(square, axes[0], fixed, options["axis"])
    sense = {"sense": float(options.get("sense", 1))}
    first = options.get("axis", "A")  # of critical motions it does not matter
    one, other = (name for name in MOMENTS if name != first)
    functions = {
        "rotation": (
            ("critical_rate", rate, one),
            ("equal_moments", equal, one),
            ("equal_moments", equal, other),
        ),
        "critical": (("critical_motion", motion, one),),
    }[options["question"]]
    found = []
    for name, function, second in functions:

        def on_map(x, function=function, second=second):
            here = fixed | dict(zip(axes, square.parameters(x).T, strict=True))
            order = first, second, other if second == one else one
            with np.errstate(all="ignore"):
                value = function(
                    [bounded.of(here[key] + np.zeros(len(x))) for key in order], here | sense
                )
            return value.value, value.bar + np.zeros(len(x))

        lines = contours.lines(on_map, square, LINES)
        found += [(CLASSES[name], square.parameters(x), error, {}) for x, error in lines]
    return joined(found, [])


def _on_a_line(square, name, fixed, axis):
    """The Curves of rotations on the map of the parameter `name` and something on which nothing depends."""
    low, high = float(square.low[0]), float(square.high[0])
    with np.errstate(all="ignore"):
        points, complete = critical_rates.along(name, low, high, fixed, axis)
    curves = joined([
        (CLASSES[kind], np.array([[x, square.low[1]], [x, square.high[1]]]), np.full(2, bar / (high - low)), {})
        for kind, x, bar in points if low <= x <= high
    ], [])  # fmt: skip
    curves.complete = complete
    return curves


def rate(inertia, here):
    """Omega^2 - s epsilon sin^2 of (7), positive where the rotation is stable; NaN about the middle axis."""
    A1, A2, A3 = inertia
    side = np.where((A1 - A2).sign() == (A1 - A3).sign(), (A1 - A2).sign(), 0.0)
    return bounded.where((side != 0.0) & _fits(inertia), _excess(inertia, side, here), np.nan)


def equal(inertia, here):
    """A1 - A2, near a point of its zeros at which the rotation changes; else NaN."""
    A1, A2, A3 = inertia
    excess = _excess(inertia, np.sign((A1 - A3).value), here)
    return bounded.where((excess.value > 0.0) & _fits(inertia), A1 - A2, np.nan)


def motion(inertia, here):
    """The product of (12), positive where the critical motion is stable; NaN where there is none."""
    found = clebsch.critical(inertia, here["epsilon"], here["sigma"], here["p_psi"], here["sense"])
    return bounded.where(found["exists"] & _fits(inertia), found["certificate"], np.nan)


def _excess(inertia, side, here):
    A1, A2, A3 = inertia
    sine = clebsch.roots(A1, A2, A3, side) / A1
    omega = bounded.of(here["Omega"])
    return omega * omega - side * bounded.of(here["epsilon"]) * (sine * sine)


def _fits(inertia):
    """Is no moment larger than the sum of the others?"""
    moments = np.stack([A.value for A in inertia])
    return 2.0 * moments.max(axis=0) <= moments.sum(axis=0) * (1.0 + 4e-16)
