"""The tables [boundaries] and [refine], checked against the scene and the axes."""

import numpy as np

from survey import measures, modules
from survey.errors import BadInput
from survey.request.schema import Spread
from survey.sweep.line import second_axis
from survey.wording import short

# variables surface_NAME
OF_SURFACES = ("vertices", "triangles", "class", "corners", "position_error", "axis")
MIN_FRACTION = 1e-6  # width of a cell as a fraction of its axis


def check_boundaries(scene, name, table, given, options, proves=False):
    """The axis along which edges are searched, the last one by default; None where no boundaries
    are requested.
    """
    if table is None:
        return None
    axes = [key for key, values in given.items() if np.ndim(values)]
    measure = measures.curves(scene)
    if measure is None:
        raise BadInput(
            f"boundaries: no boundary curves are known for the scene {name}; leave the table out"
        )
    by_rows = measures.question(scene.FAMILY, "edges") is not None  # and so proofs are made
    if hasattr(measure, "refusal") and not (proves and by_rows):
        return _check_closed(
            measure, scene, name, table, {key: given[key] for key in axes}, given, options
        )
    if not axes:
        raise BadInput("boundaries: they are drawn along an axis, and there is none; add one")
    if table.axis is not None and table.axis not in axes:
        raise BadInput(f"boundaries.axis: {modules.unknown('axis', table.axis, axes)}")
    axis = table.axis or axes[-1]
    if given[axis].size < 2:
        raise BadInput(
            f"boundaries: the axis {axis} has one value, but edges need a range; give two or more"
        )
    return axis


def _check_closed(measure, scene, name, table, axes, given, options):
    """The last of the axes {name: values}; raises BadInput where the measure knows no curves on these."""
    names = list(axes)
    refusal = None
    if len(names) == 1 and hasattr(measure, "closed"):
        fixed = {
            p.name: p.default if p.default is not None else np.nan for p in scene.PARAMETERS
        } | {key: float(value) for key, value in given.items() if not np.ndim(value)}
        second_axis(measure, scene, names[0], fixed, options)
    else:
        # further axes make a stack of maps
        stacks = [[*names[:2], third] for third in names[2:]] or [names]
        refusal = next(
            filter(None, (measure.refusal(stack, scene, options) for stack in stacks)), None
        )
    if refusal:
        raise BadInput(f"boundaries: {name}: {refusal}; change that, or leave the table out")
    if table.axis is not None:
        raise BadInput(
            f"boundaries.axis: the curves of {name} are found without rows, and no axis is searched; leave it out"
        )
    for key in names[:2]:
        if axes[key].size < 2:
            raise BadInput(
                f"boundaries: the axis {key} has one value, but curves need a range; give two or more"
            )
    return names[-1]


def check_surfaces(scene, name, table, given, proves=False):
    """Are surfaces requested? Raises BadInput where there can be none."""
    if table is None or not table.surfaces:
        return False
    what, remedy = "boundaries.surfaces", "change the axes, or leave it out"
    measure = measures.question(scene.FAMILY, "surfaces")
    if measure is None:
        raise BadInput(f"{what}: no boundary surfaces are known for the scene {name}; leave it out")
    refusal = measure.refusal(scene) if hasattr(measure, "refusal") else None
    if refusal:
        raise BadInput(f"{what}: {name} {refusal}; leave it out")
    _check_even(scene, name, what)
    if proves:
        raise BadInput(f"{what}: surfaces cannot be proved; leave it out")
    if table.axis is not None:
        raise BadInput(
            "boundaries.axis: surfaces are searched for along all three axes; leave it out"
        )
    axes = {key: values for key, values in given.items() if np.ndim(values)}
    if len(axes) != 3 or min(values.size for values in axes.values()) < 2:
        shape = ", ".join(f"{key} ({values.size})" for key, values in axes.items())
        raise BadInput(
            f"{what}: they need exactly three axes of two values or more, not {shape or 'none'}; {remedy}"
        )
    taken = set(OF_SURFACES) | {output.name for output in measure.ALONG}
    for key in sorted(taken & set(axes)):
        raise BadInput(
            f"{what}: an axis named {key} would hide surface_{key} in the file; rename the parameter"
        )
    return True


def _check_undamped(scene, name, table):
    """Raise BadInput where Hill's equation is damped."""
    if getattr(scene, "DAMPED", False):
        raise BadInput(
            f"{table}: available only for undamped equations, and {name} is damped; "
            "leave the table out"
        )


def _check_even(scene, name, table):
    """Raise BadInput where there are no factors at T/2, whose zeros are the edges."""
    _check_undamped(scene, name, table)
    if not getattr(scene, "EVEN", True):
        raise BadInput(
            f"{table}: the z of {name} is not even, so it has no half-period factors; leave the table out"
        )


def check_refine(scene, name, file, given, proves=False):
    """{axis: (width of the smallest cells as a fraction of the axis, is it logarithmic?)}; None if
    not requested.

    On a logarithmic axis the fraction is of its logarithm, and a width per axis is a ratio less 1.
    """
    if file.refine is None:
        return None
    axes = {key: values for key, values in given.items() if np.ndim(values)}
    _check_undamped(scene, name, "refine")
    measure = measures.cells(scene)
    if measure is None:
        raise BadInput(
            f"refine: [refine] is not supported for the scene {name}; leave the table out"
        )
    if len(axes) != 2 or min(values.size for values in axes.values()) < 2:
        raise BadInput(
            "refine: cells need exactly two axes of two values or more; fix the other parameters"
        )
    if not proves:  # `survey.sweep.proofs` says what cannot be proved
        _check_cells(measure, scene, name, given)
    widths = _check_width_table(file.refine.width, axes)
    return {key: _fraction(widths, key, values, file.axes.get(key)) for key, values in axes.items()}


def _check_cells(measure, scene, name, given):
    """Raise BadInput where the measure knows no cells on maps of the scene."""
    if not hasattr(measure, "refusal"):
        return
    point = {p.name: p.default for p in scene.PARAMETERS} | {
        key: np.median(values) for key, values in given.items()
    }
    refusal = measure.refusal(scene, point)
    if refusal:
        raise BadInput(f"refine: {name}: {refusal}; leave the table out")


def _check_width_table(widths, axes):
    """The widths as they are; raises BadInput unless a table of them names each axis and nothing else."""
    if isinstance(widths, dict):
        for key in widths:
            if key not in axes:
                raise BadInput(
                    f"refine.width.{short(key, 40)}: {modules.unknown('axis', key, list(axes))}"
                )
        for key in axes:
            if key not in widths:
                raise BadInput(
                    f"refine.width.{key} is missing; give a width for each axis, or one number for both"
                )
    return widths


def _fraction(widths, key, values, axis):
    """(width as a fraction of the axis, is that logarithmic?) from one fraction or from widths in
    the axes' units.
    """
    log = isinstance(axis, Spread) and axis.spacing == "log"
    where, width, most = "refine.width", widths, 1.0
    if isinstance(widths, dict):
        most = values.max() / values.min() - 1 if log else np.ptp(values)
        where, width = f"{where}.{key}", widths[key]
    if not 0 < width < most:
        raise BadInput(
            f"{where} = {width:g}: it must lie between 0 and {most:g}, such as {1e-3 * most:.1g}"
        )
    fraction = (
        np.log1p(width) / np.log1p(most) if log and isinstance(widths, dict) else width / most
    )
    if fraction < MIN_FRACTION:
        raise BadInput(
            f"{where} = {width:g}: there would be too many cells; use at least a millionth of the axis"
        )
    return float(fraction), log
