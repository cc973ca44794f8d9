"""A trajectory -> its picture: panels side by side, each of a kind that the scene names.

Kinds: `lines t y1 y2`, values against time; `multipliers`, on the unit circle; `cylinder phi w`, an orbit on the
cylinder among its neighbours; `plane x y`, a path; `sphere x y z`, a path on the unit sphere.
"""

import numpy as np

from survey.show.layout import wrap
from survey.show.palette import COLOURS
from survey.show.text import label_of, literal

LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
GREY = "#999999"


def draw(ds, figure):
    """Draw the panels of a trajectory into a matplotlib Figure or SubFigure."""
    panels = [panel.split() for panel in ds.attrs["panels"].split("; ")]
    for i, (kind, *names) in enumerate(panels):
        settings = {"projection": "3d"} if kind == "sphere" else {}
        KINDS[kind](figure.add_subplot(1, len(panels), i + 1, **settings), ds, *names)
    title = figure.suptitle(
        "\n".join(part for part in (literal(ds.attrs["title"]), ds.attrs["where"]) if part), fontsize=10
    )
    wrap(title, figure.bbox.width)


def _lines(axes, ds, x, *names):
    for name, colour in zip(names, LINES, strict=False):
        value, bar = ds[name], ds[f"{name}_error"]
        axes.plot(ds[x], value, lw=1.2, color=colour, label=f"${value.attrs.get('symbol', name)}$")
        axes.fill_between(ds[x], value - bar, value + bar, color=colour, alpha=0.3, lw=0)
    if min(axes.get_ylim()) < 0 < max(axes.get_ylim()):
        axes.axhline(0.0, color=GREY, lw=0.6, zorder=0)
    axes.set(xlabel=label_of(ds[x]), ylabel=label_of(ds[names[0]]) if len(names) == 1 else "")
    if len(names) > 1:
        axes.legend(fontsize=8, frameon=False)


def _multipliers(axes, ds):
    """The multipliers on the unit circle, with a disc for each error bound."""
    from matplotlib.patches import Circle

    axes.add_patch(Circle((0, 0), 1.0, fill=False, color="black", lw=0.8))
    x, y, bar = ds.multiplier_real.values, ds.multiplier_imag.values, ds.multiplier_error.values
    inside = np.hypot(x, y) - bar <= 1.0
    for px, py, r in zip(x, y, bar, strict=True):
        axes.add_patch(Circle((px, py), r, color=LINES[0], alpha=0.3, lw=0))
    for where, marker, colour in ((inside, "o", COLOURS[1]), (~inside, "D", COLOURS[0])):
        axes.plot(x[where], y[where], marker, ms=6, mfc=colour, mec="black")
    axes.axhline(0.0, color=GREY, lw=0.6, zorder=0)
    axes.axvline(0.0, color=GREY, lw=0.6, zorder=0)
    axes.set(xlabel=r"$\mathrm{Re}\,\lambda$", ylabel=r"$\mathrm{Im}\,\lambda$")
    axes.set_aspect("equal", adjustable="datalim")
    far = np.abs([x, y]).max()
    axes.set_title(f"multipliers, error bars up to {bar.max():.1g}", fontsize=9)
    if far > 30:  # one multiplier is so large that the circle would not be seen
        axes.set(xlim=(-2, 2), ylim=(-2, 2))
        axes.set_title(f"multipliers (one at {x[np.abs(x).argmax()]:.4g}, not shown)", fontsize=9)


def _cylinder(axes, ds, x, y):
    """An orbit on the cylinder, its start marked, among its neighbours."""
    part = {"t": slice(0, ds.sizes["t"] * 2 // 5)}  # longer spirals would fill the plane
    nearby = ds[[f"{x}_nearby", f"{y}_nearby"]].isel(part)
    for orbit, speed in zip(*(v.values for v in nearby.data_vars.values()), strict=True):
        axes.plot(*_wrapped(orbit, speed), lw=0.6, color=GREY)
    axes.plot(*_wrapped(ds[x].values, ds[y].values), lw=1.8, color=LINES[0])
    axes.plot(np.mod(ds[x].values[0], 2 * np.pi), ds[y].values[0], "o", color=LINES[1], mec="black", ms=6)
    axes.set_xlim(0, 2 * np.pi)
    size = 1.3 * max(1.0, np.nanmax(np.abs(ds[y].values), initial=0))
    axes.set_ylim(-min(size, 50), min(size, 50))
    axes.set_xticks(np.arange(5) * np.pi / 2, ["0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$"])
    axes.set(xlabel=f"${ds[x].attrs['symbol']}$ mod $2\\pi$ (rad)", ylabel=label_of(ds[y]))


def _wrapped(angle, value):
    """The angle modulo 2 pi, with a gap wherever it jumps."""
    turns = np.floor(angle / (2 * np.pi))
    jumps = np.flatnonzero(np.diff(turns) != 0) + 1
    return np.insert(angle - 2 * np.pi * turns, jumps, np.nan), np.insert(value, jumps, np.nan)


def _plane(axes, ds, x, y):
    """A path in the plane, its start marked."""
    axes.plot(ds[x], ds[y], lw=0.8, color=LINES[0])
    axes.plot(ds[x].values[0], ds[y].values[0], "o", color=LINES[1], mec="black", ms=6)
    axes.plot(0, 0, "+", color="black", ms=8)
    axes.set(xlabel=f"${ds[x].attrs['symbol']}$", ylabel=f"${ds[y].attrs['symbol']}$")
    axes.set_aspect("equal", adjustable="datalim")


def _sphere(axes, ds, x, y, z):
    """A path on the unit sphere, its start marked; parallels and meridians in grey."""
    angle = np.linspace(0, 2 * np.pi, 73)
    for height in np.sin(np.radians([-60, -30, 0, 30, 60])):
        ring = np.sqrt(1 - height**2)
        axes.plot(ring * np.cos(angle), ring * np.sin(angle), height, lw=0.4, color=GREY)
    for turn in np.radians(np.arange(0, 180, 30)):
        axes.plot(np.cos(turn) * np.sin(angle), np.sin(turn) * np.sin(angle), np.cos(angle), lw=0.4, color=GREY)
    axes.plot(ds[x], ds[y], ds[z], lw=1.2, color=LINES[0])
    axes.plot(*([float(ds[name][0])] for name in (x, y, z)), "o", color=LINES[1], mec="black", ms=6)
    axes.set_box_aspect((1, 1, 1), zoom=1.4)
    axes.set(title="path of the axis on the unit sphere", xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    axes.set_axis_off()


KINDS = {"lines": _lines, "multipliers": _multipliers, "cylinder": _cylinder, "plane": _plane, "sphere": _sphere}
