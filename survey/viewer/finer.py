"""A window of a map solved afresh, where the map's grid is coarser than the screen; and a point anywhere."""

import numpy as np

from survey.analysis.zoom import workflow_of
from survey.errors import BadInput
from survey.file.labels import count, describe
from survey.request import workflow
from survey.sweep import solve
from survey.sweep.cost import seconds_per_point

COARSE = (120, 80)  # points along the axes of a window: with fewer of them it is solved afresh
FINE = (240, 160)  # points along the axes of the fresh grid
SECONDS = 4.0  # estimated, on one thread: a grid that takes longer has fewer points
LEAST = (24, 16)  # with fewer points nothing would be seen


def wanted(shown, view):
    """Is the view a window of the map (a `ShownMap`) that holds few of its points along some axis?"""
    seen = []
    for axis, window in zip(shown.axes, view.window, strict=True):
        low, high = axis.inner(*window)
        if not low < high:
            return False
        seen.append(np.count_nonzero((axis.values >= low) & (axis.values <= high)))
    all_shown = all(
        number == axis.values.size for number, axis in zip(seen, shown.axes, strict=True)
    )
    return not all_shown and any(number < few for number, few in zip(seen, COARSE, strict=True))


def of_window(shown, view):
    """The dataset of the view's window, at the centres of equal cells; raises BadInput where it
    would take too long.
    """
    ends = [axis.inner(*window) for axis, window in zip(shown.axes, view.window, strict=True)]
    sizes = np.array(FINE, float)
    checked = _checked(shown, view, ends, sizes.astype(int))
    seconds = seconds_per_point(checked.scene, checked.request, checked.grid) * checked.grid.points
    if seconds > SECONDS:
        sizes = np.floor(sizes * np.sqrt(SECONDS / seconds)).astype(int)
        if (sizes < LEAST).any():
            raise BadInput(
                f"in {SECONDS:g} s only {sizes.prod():,} points can be solved, too few to show more "
                "than the map does"
            )
        checked = _checked(shown, view, ends, sizes)
    return _solved(checked)


def of_point(shown, view):
    """The dataset of the one point that is chosen, anywhere in the map, with all outputs of the file."""
    return _solved(
        _workflow(shown, view, dict(zip(shown.dims, view.point, strict=True)), shown.names)
    )


def _checked(shown, view, ends, sizes):
    axes = {}
    for dim, axis, (low, high), size in zip(shown.dims, shown.axes, ends, sizes, strict=True):
        half = 0.5 * (axis.scaled(high) - axis.scaled(low)) / size
        first, last = (
            float(axis.unscaled(axis.scaled(end) + side))
            for end, side in ((low, half), (high, -half))
        )
        spacing = "log" if axis.log else "linear"
        axes[dim] = {"start": first, "stop": last, "num": int(size), "spacing": spacing}
    return _workflow(
        shown, view, axes, [name for name in (view.name, "verdict") if name in shown.names]
    )


def _workflow(shown, view, axes, names):
    """The survey's workflow with these tables of axes, its other axes at the numbers of the view."""
    data = workflow_of(shown.ds)
    fixed = {
        dim: float(shown.ds[dim].values[at])
        for dim, at in view.others.items()
        if dim in shown.ds.status.dims
    }
    data["axes"] |= fixed | axes
    data["output"] = {"variables": [name for name in names if name != "status"]}
    return workflow.check(data, default_path="window.nc")


def _solved(checked):
    found = solve.compute(checked.grid, checked.scene, checked.request)
    ds = count(describe(checked.grid, checked.scene, checked.name, checked.request, found), found)
    return ds.assign_attrs(title=checked.title, workflow=checked.text)
