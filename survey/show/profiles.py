"""A variable along one axis: its curve with the error band, or its flags."""

import textwrap

import numpy as np

from survey import status
from survey.file.labels import flag_codes, words_of
from survey.grid import logarithmic
from survey.show.layout import add_legend
from survey.show.maps import IN_WORDS
from survey.show.palette import kinds_of
from survey.show.text import WIDE, formula, label_of, literal, spaced


def draw_profile(axes, ds, variable, state, paper):
    """Draw a variable along its one axis, `state` being the status."""
    x = variable[variable.dims[0]]
    if "flag_values" in variable.attrs:
        shown, table, palette = kinds_of(ds, variable, state)
        # all flags, but only those statuses that occur
        names = [name for name, code in table.items() if name in flag_codes(variable.attrs) or (shown == code).any()]
        for height, name in enumerate(names):
            here = x.values[(shown == table[name]).filled(False)]
            axes.plot(here, np.full(here.size, height), "s", markersize=4, color=palette[name])
        axes.set_yticks(range(len(names)), [spaced(name) for name in names], fontsize=8)
    else:
        label = textwrap.fill(literal(variable.attrs.get("long_name", variable.name)), 60)
        label = formula(variable.attrs.get("symbol") or variable.name, variable.name) if paper else label
        words = words_of(variable)
        axes.plot(x, variable.where(~variable.isin(list(words))), lw=1.2, color="#0072B2", label=label)
        for code, text in words.items():
            here = x.values[variable.values == code]
            if here.size:
                axes.plot(here, np.full(here.size, axes.get_ylim()[1]), "^", color=IN_WORDS, ms=4, label=text)
        if variable.name == "discriminant":
            for edge in (-2.0, 2.0):
                axes.axhline(edge, color="black", lw=0.6, ls=(0, (5, 2)))
    if f"{variable.name}_error" in ds:
        bar = ds[f"{variable.name}_error"].isel({d: 0 for d in ds[variable.name].dims if d not in variable.dims})
        axes.fill_between(x, variable - bar, variable + bar, color="#56B4E9", alpha=0.5, lw=0, label="error bar")
    bad = np.isin(state.values, list(status.UNANSWERED))
    if bad.any():
        axes.plot(x.values[bad], np.full(bad.sum(), axes.get_ylim()[0]), "x", color="#D55E00", label="no answer")
    axes.set(xlabel=label_of(x, WIDE), ylabel=label_of(variable))
    handles = axes.get_legend_handles_labels()[0]
    if handles and paper:
        add_legend(axes, handles)
    elif handles:
        axes.legend(fontsize=8)
    if logarithmic(x.values):
        axes.set_xscale("log")
