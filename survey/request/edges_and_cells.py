"""The tables [boundaries] and [refine], checked against the scene and the axes."""

from itertools import combinations

import numpy as np

from survey import measures, modules
from survey.errors import BadInput
from survey.request.schema import Spread
from survey.sweep.line import second_axis
from survey.wording import short, shown

# variables surface_NAME
OF_SURFACES = ("vertices", "triangles", "class", "corners", "position_error", "axis")
MIN_FRACTION = 1e-6  # width of a cell as a fraction of its axis


def check_boundaries(scene, name, table, given, options, proves=False):
    """(the axis along which edges are searched, the last one by default; the pairs of axes in whose
    planes curves lie, of which rows follow the last); (None, ()) where no boundaries are requested.
    """
    if table is None:
        return None, ()
    axes = {key: values for key, values in given.items() if np.ndim(values)}
    measure = measures.curves(scene)
    if measure is None:
        raise BadInput(
            f"boundaries: no boundary curves are known for the scene {name}; leave the table out"
        )
    by_rows = measures.question(scene.FAMILY, "edges") is not None  # and so proofs are made
    # folds must keep to their table before anything is solved
    measures.question(scene.FAMILY, "folds")
    if hasattr(measure, "refusal") and not (proves and by_rows):
        return _check_closed(measure, scene, name, table, axes, given, options)
    if not axes:
        raise BadInput("boundaries: they are drawn along an axis, and there is none; add one")
    if table.axis is not None and table.axis not in axes:
        raise BadInput(f"boundaries.axis: {modules.unknown('axis', table.axis, list(axes))}")
    planes = _planes(table.plane, axes)
    if planes and table.axis not in (None, *table.plane):
        raise BadInput(
            f"boundaries.axis = {shown(table.axis)}: it must be one of the axes of boundaries.plane, "
            f"{', '.join(table.plane)}; leave one of the two out"
        )
    axis = table.axis or (table.plane or list(axes))[-1]
    if axes[axis].size < 2:
        raise BadInput(
            f"boundaries: the axis {axis} has one value, but edges need a range; give two or more"
        )
    if planes:
        return axis, tuple(pair[::-1] if pair[0] == axis else pair for pair in planes)
    across = next((key for key in axes if key != axis and axes[key].size > 1), None)
    return axis, ((across, axis),) if across else ()


def _planes(names, axes):
    """The pairs of these axes, of {name: values}; none where none are named. Raises BadInput for
    names that span no plane.
    """
    where = "boundaries.plane"
    for key in names or ():
        if key not in axes:
            raise BadInput(f"{where}: {modules.unknown('axis', key, list(axes))}")
        if axes[key].size < 2:
            raise BadInput(
                f"{where}: the axis {key} has one value, but curves need a range; give two or more"
            )
    if names is not None and len(set(names)) != max(len(names), 2):
        raise BadInput(
            f"{where} = {shown(names)}: give two different axes, or more for the planes of every two of them, "
            f"such as {shown(list(axes)[:2])}"
        )
    return tuple(combinations(names or (), 2))


def _check_closed(measure, scene, name, table, axes, given, options):
    """As `check_boundaries`, of axes {name: values}; raises BadInput where the measure knows no
    curves on these.
    """
    names = list(axes)
    planes = _planes(table.plane, axes)
    refusal = None
    if len(names) == 1 and hasattr(measure, "closed"):
        fixed = {
            p.name: p.default if p.default is not None else np.nan for p in scene.PARAMETERS
        } | {key: float(value) for key, value in given.items() if not np.ndim(value)}
        second_axis(measure, scene, names[0], fixed, options)
    else:
        default = (tuple(names[:2]),)
        refusal = _refusal(measure, scene, options, names, planes or default)
    if refusal:
        others = [
            pair
            for pair in combinations(names, 2)
            if not _refusal(measure, scene, options, names, (pair,))
        ]
        remedy = (
            f"set plane = {shown(list(others[0]))} under [boundaries]" if others else "change that"
        )
        raise BadInput(f"boundaries: {name}: {refusal}; {remedy}, or leave the table out")
    if table.axis is not None:
        raise BadInput(
            f"boundaries.axis: the curves of {name} are found without rows, and no axis is searched; leave it out"
            + ("; plane names the axes of their planes" if len(names) > 2 else "")
        )
    for key in names[:2] if not planes else ():
        if axes[key].size < 2:
            raise BadInput(
                f"boundaries: the axis {key} has one value, but curves need a range; give two or more"
            )
    return names[-1], planes or (tuple(names[:2]),) * (len(names) > 1)


def _refusal(measure, scene, options, names, planes):
    """Why there are no curves in these planes, in words; None if there are.

    Further axes make a stack of maps.
    """
    for pair in planes:
        further = [key for key in names if key not in pair]
        for stack in [[*pair, third] for third in further] or [list(pair)]:
            if refusal := measure.refusal(stack, scene, options):
                return refusal
    return None


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
    if table.plane is not None:
        raise BadInput("boundaries.plane: surfaces lie in no plane; leave it, or surfaces, out")
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
