"""A user's own file: its first two parameters over their domains, or over the axes of a workflow."""

from survey.failures.plane import Plane, few, plain
from survey.truth import digits

ABOUT = """`auto` takes 16th-order Taylor steps, and double-double (z run once more with mpmath's functions) where
float64 leaves a verdict open."""
SOURCE = "Truth: z with mpmath's numbers of 38 digits, by extrapolated leapfrog steps of order 20."


def planes(path, share):
    """One plane; raises BadInput for a scene whose truth is not known."""
    found, truth = digits.of_file(path)
    values = [found.values(name, few(share, 16)) for name in found.axes]
    names = list(found.axes)
    given = dict(found.fixed) | {
        names[0]: values[0][:, None] if len(names) > 1 else values[0][None]
    }
    if len(names) > 1:
        given[names[1]] = values[1][None]
    y = plain(names[0], values[0]) if len(names) > 1 else plain("", [0.0])
    title = f"{found.name}" + "".join(
        f", {name} = {value:g}" for name, value in found.fixed.items()
    )
    return [Plane(title, plain(names[-1], values[-1]), y, found.scene, given, truth, SOURCE)]
