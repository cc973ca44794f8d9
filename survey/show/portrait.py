"""A trajectory -> its picture: panels side by side, each of a kind that the scene names.

Kinds: `lines t y1 y2`, values against time; `multipliers`, on the unit circle; `cylinder phi w`, an
orbit on the cylinder among its neighbours, with equilibria, cycles and separatrices if the data
hold them; `plane x y`, a path; `sphere x y z`, a path on the unit sphere.
"""

import numpy as np
from matplotlib.lines import Line2D

from survey.show.layout import wrap
from survey.show.palette import COLOURS
from survey.show.text import label_of, literal

LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7")
GREY = "#999999"
# what parts the motions on a cylinder: properties of matplotlib's line
PARTING = {
    "unstable_branch": {"color": LINES[1], "lw": 1.0},
    "stable_branch": {"color": "black", "lw": 1.0},
    "unstable_cycle": {"color": LINES[2], "lw": 2.0, "ls": (0, (4, 1.5))},
    "stable_cycle": {"color": LINES[2], "lw": 2.0},
}
RESTS = {
    "saddle": {"marker": "X", "mfc": "white"},
    "attracting equilibrium": {"marker": "o", "mfc": "black"},
    "other equilibrium": {"marker": "o", "mfc": "white"},
}


def draw(ds, figure):
    """Draw the panels of a trajectory into a matplotlib Figure or SubFigure."""
    panels = [panel.split() for panel in ds.attrs["panels"].split("; ")]
    for i, (kind, *names) in enumerate(panels):
        settings = {"projection": "3d"} if kind == "sphere" else {}
        KINDS[kind](figure.add_subplot(1, len(panels), i + 1, **settings), ds, *names)
    title = figure.suptitle(
        "\n".join(part for part in (literal(ds.attrs["title"]), ds.attrs["where"]) if part),
        fontsize=10,
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
    axes.set_title(f"multipliers,\nerror bars up to {bar.max():.1g}", fontsize=9)
    if far > 30:  # one multiplier is so large that the circle would not be seen
        axes.set(xlim=(-2, 2), ylim=(-2, 2))
        axes.set_title(f"multipliers\n(one at {x[np.abs(x).argmax()]:.4g}, not shown)", fontsize=9)


def _cylinder(axes, ds, x, y):
    """An orbit on the cylinder, its start marked, among its neighbours."""
    part = {"t": slice(0, ds.sizes["t"] * 2 // 5)}  # longer spirals would fill the plane
    nearby = ds[[f"{x}_nearby", f"{y}_nearby"]].isel(part)
    for orbit, speed in zip(*(v.values for v in nearby.data_vars.values()), strict=True):
        axes.plot(*_wrapped(orbit, speed), lw=0.6, color=GREY)
    handles = _parting(axes, ds, x, y)
    axes.plot(*_wrapped(ds[x].values, ds[y].values), lw=1.8, color=LINES[0], zorder=2.5)
    axes.plot(
        np.mod(ds[x].values[0], 2 * np.pi), ds[y].values[0], "o", color=LINES[1], mec="black", ms=6
    )
    axes.set_xlim(0, 2 * np.pi)
    size = 1.3 * max(1.0, np.nanmax(np.abs(ds[y].values), initial=0))
    if "line_kind" in ds:  # cycles are shown too, unless they are far
        cycles = np.abs(ds[f"{y}_line"].transpose("line", "place").values[ds.line_kind.values > 1])
        size = max(size, min(1.1 * np.nanmax(cycles, initial=0), 4.0 * size))
    axes.set_ylim(-min(size, 50), min(size, 50))
    axes.set_xticks(np.arange(5) * np.pi / 2, ["0", r"$\pi/2$", r"$\pi$", r"$3\pi/2$", r"$2\pi$"])
    axes.set(xlabel=f"${ds[x].attrs['symbol']}$ mod $2\\pi$ (rad)", ylabel=label_of(ds[y]))
    if handles:
        axes.legend(handles=list(handles.values()), fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.13),
                    ncols=3, frameon=False)  # fmt: skip


def _parting(axes, ds, x, y):
    """What parts the motions on a cylinder, where it is known: branches of the saddles, cycles and
    equilibria.
    """
    handles = {}
    if "line_kind" in ds:
        names = ds.line_kind.attrs["flag_meanings"].split()
        lines = ds[["line_kind", f"{x}_line", f"{y}_line"]].transpose("line", "place")
        for kind, orbit, speed in zip(*(v.values for v in lines.data_vars.values()), strict=True):
            style = PARTING[names[kind]]
            axes.plot(*_wrapped(orbit, speed), **style)
            handles[names[kind]] = Line2D([], [], label=names[kind].replace("_", " "), **style)
    if f"equilibrium_{x}" in ds:
        rests = (
            ds[name].values
            for name in (f"equilibrium_{x}", "equilibrium_saddle", "equilibrium_stable")
        )
        for angle, saddle, stable in zip(*rests, strict=True):
            name = (
                "saddle" if saddle else "attracting equilibrium" if stable else "other equilibrium"
            )
            style = RESTS[name] | {"ls": "none", "mec": "black", "ms": 6, "zorder": 3}
            axes.plot(angle, 0.0, clip_on=False, **style)
            handles[name] = Line2D([], [], label=name, **style)
    return handles


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
        axes.plot(
            np.cos(turn) * np.sin(angle),
            np.sin(turn) * np.sin(angle),
            np.cos(angle),
            lw=0.4,
            color=GREY,
        )
    axes.plot(ds[x], ds[y], ds[z], lw=1.2, color=LINES[0])
    axes.plot(*([float(ds[name][0])] for name in (x, y, z)), "o", color=LINES[1], mec="black", ms=6)
    axes.set_box_aspect((1, 1, 1), zoom=1.4)
    axes.set(title="path of the axis on the unit sphere", xlim=(-1, 1), ylim=(-1, 1), zlim=(-1, 1))
    axes.set_axis_off()


KINDS = {
    "lines": _lines,
    "multipliers": _multipliers,
    "cylinder": _cylinder,
    "plane": _plane,
    "sphere": _sphere,
}
