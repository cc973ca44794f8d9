"""A variable along one axis: its curve with the error band, or its flags."""

import numpy as np
from matplotlib.ticker import MaxNLocator

from survey import status
from survey.file.labels import fill_of, flag_codes, words_of
from survey.grid import logarithmic
from survey.show.boundaries import draw_edges, limits_of
from survey.show.layout import add_legend
from survey.show.maps import IN_WORDS
from survey.show.palette import kinds_of
from survey.show.text import WIDE, formula, label_of, spaced

RING = "#D40000"
# isolated points that are ringed; points from which on one among them is hard to see
MOST_RINGS, RARE = 12, 50
# at a pole, not a zero, the neighbours exceed the median this many times, and their own neighbours
# by this factor: 1 / x at least doubles from one step to the last one before 0
STEEP, RISE = 5.0, 1.5
# of a quantity with poles from which on its axis is linear about 0 and logarithmic beyond
WIDE_RANGE = 30.0


def draw_profile(axes, ds, variable, state, paper, named=False):
    """Draw a variable along its one axis, `state` being the status, with the boundaries on it;
    points alone where the axis is one of names.
    """
    x = variable[variable.dims[0]]
    if "flag_values" in variable.attrs:
        shown, table, palette = kinds_of(ds, variable, state)
        # all flags, but only those statuses that occur
        names = [
            name
            for name, code in table.items()
            if name in flag_codes(variable.attrs) or (shown == code).any()
        ]
        for height, name in enumerate(names):
            where = (shown == table[name]).filled(False)
            here = x.values[where]
            axes.plot(here, np.full(here.size, height), "s", markersize=4, color=palette[name])
            # as at a resonance that is one value: nobody would see it
            alone = x.values[_isolated(where)]
            if 0 < alone.size <= MOST_RINGS and shown.size > RARE:
                ring = {
                    "marker": "o",
                    "ms": 9,
                    "mfc": "none",
                    "mec": RING,
                    "mew": 1.4,
                    "ls": "none",
                }
                axes.plot(alone, np.full(alone.size, height), **ring)
                for value in alone:
                    axes.annotate(f"{value:.9g}", (value, height), xytext=(0, 8), textcoords="offset points",
                                  ha="center", fontsize=7, color=RING)  # fmt: skip
        axes.set_yticks(range(len(names)), [spaced(name) for name in names], fontsize=8)
    else:
        label = formula(variable.attrs.get("symbol") or variable.name, variable.name)
        words = words_of(variable)
        shown = variable.where(~variable.isin(list(words))).values
        after, linear = _poles(shown.astype(float))
        poles = [0.5 * (x.values[i - 1] + x.values[i]) for i in after]
        positions, shown = _gapped(x, after, poles), _gapped(shown, after, np.nan)
        counts = fill_of(variable) is not None
        style = {"drawstyle": "steps-mid" if counts else "default", "lw": 1.2, "color": "#0072B2"}
        axes.plot(positions, shown, "o" if named else "-", ms=5, label=label, **style)
        if counts:
            axes.yaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
        if linear:
            axes.set_yscale("symlog", linthresh=linear)
        for i, pole in enumerate(poles):
            axes.axvline(pole, color="grey", lw=0.8, ls="--", label=None if i else "pole")
        for code, text in words.items():
            here = x.values[variable.values == code]
            if here.size:
                axes.plot(
                    here,
                    np.full(here.size, axes.get_ylim()[1]),
                    "^",
                    color=IN_WORDS,
                    ms=4,
                    label=text,
                )
        for limit in limits_of(variable):
            axes.axhline(limit, color="black", lw=0.6, ls=(0, (5, 2)))
    if f"{variable.name}_error" in ds:
        bar = ds[f"{variable.name}_error"].isel(
            {d: 0 for d in ds[variable.name].dims if d not in variable.dims}
        )
        if named:
            axes.errorbar(
                x, variable, bar, fmt="none", color="#56B4E9", capsize=4, label="error bar"
            )
        else:
            bar = _gapped(bar, after, np.nan)
            axes.fill_between(
                positions,
                shown - bar,
                shown + bar,
                color="#56B4E9",
                alpha=0.5,
                lw=0,
                label="error bar",
            )
    draw_edges(axes, ds, x)
    bad = np.isin(state.values, list(status.UNANSWERED))
    if bad.any():
        axes.plot(
            x.values[bad],
            np.full(bad.sum(), axes.get_ylim()[0]),
            "x",
            color="#D55E00",
            label="no answer",
        )
    axes.set(xlabel=label_of(x, WIDE), ylabel=label_of(variable))
    handles = axes.get_legend_handles_labels()[0]
    if handles and paper:
        add_legend(axes, handles)
    elif handles:
        axes.legend(fontsize=8)
    if logarithmic(x.values):
        axes.set_xscale("log")


def _isolated(where):
    """Points whose neighbours are of another kind."""
    padded = np.pad(where, 1)
    return where & ~padded[:-2] & ~padded[2:]


def _gapped(values, after, gap):
    """The values as floats, with these more before the indices `after`."""
    return np.insert(np.asarray(values, float), after, gap)


def _poles(values):
    """(the indices i of poles between i - 1 and i, where the values' axis is linear, or None).

    A pole is a change of sign between neighbours that are large, and larger than theirs of their
    sign.
    """
    size = np.abs(values)
    some = size[np.isfinite(size) & (size > 0.0)]
    if values.size < 8 or not some.size:
        return np.zeros(0, int), None
    middle = float(np.median(some))
    big, sign = size > STEEP * middle, np.sign(values)
    same = sign[1:] == sign[:-1]
    rises, falls = size[1:] > RISE * size[:-1], size[:-1] > RISE * size[1:]
    crosses = (sign[2:-1] == -sign[1:-2]) & big[2:-1] & big[1:-2]
    poles = 2 + np.flatnonzero((same & rises)[:-2] & crosses & (same & falls)[2:])
    wide = len(poles) and some.max() > WIDE_RANGE * middle
    return poles, 0.1 * middle if wide else None
