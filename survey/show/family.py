"""Abel solutions over their angle: a family of curves, coloured by a parameter, that end in their
turning points.
"""

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MultipleLocator

from survey import status
from survey.file.labels import options_of, scene_statuses
from survey.grid import logarithmic
from survey.show.layout import add_legend
from survey.show.palette import greys
from survey.show.text import WIDE, label_of, spaced

ANGLE = "phi"
# what is drawn as curves, and its value at a turning point (None: 0)
AT_TURNING = {"w": None, "t": "t_turning"}
MOST = 200  # curves that are drawn, chosen evenly
LEFT = np.linspace(1, 0, 10)[1:]  # of the way to a turning point, from the last angle before it
VISIBLE = 0.005  # of the height: narrower error bars lie within the lines
_TURNING = {"ls": "none", "marker": "o", "ms": 2.5, "mfc": "black", "mec": "none"}
_RING = {"ls": "none", "marker": "o", "ms": 4, "mec": "#D40000"}
_START = {"color": "#D55E00", "lw": 1.0, "ls": (0, (4, 2)), "zorder": 1}


def over_angles(ds):
    """Does the survey hold Abel solutions of several parameter sets at several angles?"""
    return (
        options_of(ds).get("question") == "abel"
        and ds.sizes.get(ANGLE, 1) > 1
        and len(ds.status.dims) > 1
    )


def draw_family(axes, ds, variable, paper):
    """Draw a variable over the angle, its last dimension, as one curve for each value along its
    first.

    `ds` holds the variable on these dimensions, its error bars, the status, and the turning points
    if asked for.
    """
    parameter, phi = (variable[dim] for dim in variable.dims)
    chosen = np.unique(
        np.linspace(0, parameter.size - 1, min(MOST, parameter.size)).round().astype(int)
    )
    upwards = np.argsort(phi.values)

    part = dict(zip(variable.dims, (chosen, upwards), strict=True))

    def rows(name):
        if name not in ds:  # it was not asked for
            return np.full((chosen.size, phi.size), np.nan)
        return ds[name].isel(part).transpose(*variable.dims).values

    angles = phi.values[upwards]
    values, bars, states, turning = map(
        rows, (variable.name, f"{variable.name}_error", "status", "phi_turning")
    )
    there = rows(AT_TURNING[variable.name]) if AT_TURNING[variable.name] else np.zeros(values.shape)
    ends = [_ends(*row) for row in zip(states, values, strict=True)]
    lines = [_line(angles, *row) for row in zip(values, turning, there, ends, strict=True)]
    colours = parameter.values[chosen].astype(float)
    norm = (LogNorm if logarithmic(parameter.values) else Normalize)(colours.min(), colours.max())
    width = (0.4 if paper else 0.8) if len(lines) > 40 else 1.2
    drawn = LineCollection(lines, cmap="viridis", norm=norm, array=colours, lw=width)
    axes.add_collection(drawn)
    axes.autoscale_view()
    axes.set_xlim(angles[[0, -1]])
    axes.figure.colorbar(drawn, ax=axes, label=label_of(parameter))
    number = (
        f"{len(lines):,} of {parameter.size:,} solutions"
        if len(lines) < parameter.size
        else "solutions"
    )
    handles = [Line2D([], [], color=drawn.cmap(0.4), label=number)]
    handles += _bars(axes, angles, values, bars, drawn.to_rgba(colours))
    handles += _start(axes, variable)
    handles += _turning_points(axes, turning, there, ends)
    handles += _unknown_ends(axes, ds, states, lines, ends, paper)
    add_legend(axes, handles)
    axes.set(xlabel=label_of(phi, WIDE), ylabel=label_of(variable))
    if phi.attrs.get("units") == "rad":
        _ticks(axes, angles)


def _ends(state, value):
    """((last known point, point beyond), ...) at both ends of a curve, as indices; -1 where there is none."""
    known = np.flatnonzero((state == status.OK) & np.isfinite(value))
    if not known.size:
        return (-1, 0), (-1, state.size - 1)
    return (known[0], known[0] - 1), (
        known[-1],
        known[-1] + 1 if known[-1] + 1 < state.size else -1,
    )


def _line(angles, value, turning, there, ends):
    """The points of a curve up to its turning points, where the square of the distance is linear in
    the angle.
    """
    (first, _), (last, _) = ends
    if first < 0:
        return np.empty((0, 2))
    parts = [np.stack([angles, value], axis=-1)[first : last + 1]]
    for known, beyond in ends:
        if beyond >= 0 and np.isfinite(turning[beyond] + there[beyond]):
            angle, end = turning[beyond], there[beyond]
            way = np.stack(
                [angle + (angles[known] - angle) * LEFT**2, end + (value[known] - end) * LEFT],
                axis=-1,
            )
            parts = [way[::-1], *parts] if beyond < known else [*parts, way]
    return np.concatenate(parts)


def _bars(axes, angles, values, bars, colours):
    """Draw the error bars that are wide enough to be seen; returns their legend handle."""
    low, high = axes.get_ylim()
    wide = np.flatnonzero((bars > VISIBLE * (high - low)).any(axis=1))
    for i in wide:
        band = axes.fill_between(
            angles, values[i] - bars[i], values[i] + bars[i], color=colours[i], alpha=0.3, lw=0
        )
        band.set_label("error bars")
    return [band] if wide.size else []


def _start(axes, variable):
    """Mark the angle of the initial state, if all solutions have the same; returns its legend handle."""
    phi0 = variable.coords.get("phi0")
    if phi0 is None or phi0.ndim or not min(axes.get_xlim()) <= float(phi0) <= max(axes.get_xlim()):
        return []
    # at an end of the axis it lies over the frame
    over = {"zorder": 3, "clip_on": False} if float(phi0) in axes.get_xlim() else {}
    axes.axvline(float(phi0), **_START | over)
    return [Line2D([], [], label="initial angle", **_START)]


def _turning_points(axes, turning, there, ends):
    """Mark the turning points of all curves; returns their legend handle."""
    at = [(i, beyond) for i, row in enumerate(ends) for _, beyond in row if beyond >= 0]
    points = np.array([(turning[index], there[index]) for index in at]).reshape(-1, 2)
    points = points[np.isfinite(points).all(axis=1)]
    if not points.size:
        return []
    axes.plot(*points.T, **_TURNING)
    return [Line2D([], [], label="turning points", **(_TURNING | {"ms": 4}))]


def _unknown_ends(axes, ds, states, lines, ends, paper):
    """Ring the ends of curves that stop for another reason than a turning point; returns the legend
    handles.
    """
    codes = scene_statuses(ds)
    kinds = {name: ([codes[name]], grey) for name, grey in greys(ds).items() if name != "turning"}
    kinds |= {
        "failed": (list(status.FAILURES), "white"),
        "outside the domain": ([status.INVALID_PARAMETERS], "white"),
    }
    handles = []
    for name, (codes, colour) in kinds.items():
        found = [(i, side) for i, row in enumerate(ends) for side, (_, beyond) in enumerate(row)
                 if beyond >= 0 and states[i, beyond] in codes]  # fmt: skip
        tips = np.array([lines[i][-side] for i, side in found if len(lines[i])]).reshape(-1, 2)
        axes.plot(*tips.T, mfc=colour, **_RING)
        label = spaced(name) if paper else f"{spaced(name)} ({len({i for i, _ in found}):,})"
        handles += [Line2D([], [], mfc=colour, label=label, **_RING)] if found else []
    return handles


def _ticks(axes, angles):
    """Ticks at multiples of pi, where the angles span more than that."""
    if not np.pi < np.ptp(angles) <= 20 * np.pi:
        return
    halves = next(step for step in (1, 2, 4, 8) if np.ptp(angles) <= 5 * step * np.pi)
    axes.xaxis.set_major_locator(MultipleLocator(halves * np.pi / 2))
    axes.xaxis.set_major_formatter(
        FuncFormatter(lambda angle, _: _multiple_of_pi(round(angle / (np.pi / 2))))
    )


def _multiple_of_pi(halves):
    """The formula of halves pi / 2."""
    number, below = (halves // 2, "") if halves % 2 == 0 else (halves, "/2")
    factor = {0: "0", 1: r"\pi", -1: r"-\pi"}.get(number, rf"{number}\pi")
    return f"${factor}{below}$"
