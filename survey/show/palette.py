"""Colours, greys and hatchings of what a point may be: its verdict or flag, or why it has no answer."""

import numpy as np

from survey import status
from survey.file.labels import flag_codes, scene_statuses

# after Okabe and Ito, safe for the colour-blind, the first two far apart in grey print too;
# black is kept for undecided, white with hatching for failed
COLOURS = ("#D55E00", "#A6D8F5", "#E69F00", "#F0E442", "#009E73", "#CC79A7", "#0072B2", "#999999", "#B8E0D2", "#5D3A9B",
           "#8C564B", "#D9B38C", "#BCBD22", "#C49CDE")  # fmt: skip
UNSTABLE, STABLE = (COLOURS[0], COLOURS[10]), (COLOURS[1], COLOURS[6])  # there may be two of each
MARGINAL = COLOURS[2]
OTHERS = tuple(COLOURS[i] for i in (11, 4, 5, 3, 9, 8, 10, 12, 6, 13, 7))
UNDECIDED = "#000000"
NOTHING = "#EDEDED"  # the flag "none"
# where the outputs are undefined, by the scene's own statuses: in print between unstable, stable
# and black
GREYS = ("#808080", "#B3B3B3", "#5E5E5E")
LIGHT_GREYS = ("#C6C6C6", "#A6A6A6", "#868686")  # the same in a map with a colour bar
# of the COLOURS, in papers
HATCHES = ("//////", "", "....", "\\\\\\\\", "xxxx", "----", "||||", "++++", "oo", "**")


def kinds_of(ds, variable, state):
    """(codes, {kind: code}, {kind: colour}) of a flag variable; masked where the point failed or
    lies outside.

    The kinds are its flags, followed by the scene's own statuses, under which points are undefined,
    not undecided.
    """
    table = flag_codes(variable.attrs)
    shown = variable.values.astype(np.int32)
    colours = dict.fromkeys(table, "#444444") | colours_of(table) | greys_of(ds, table)
    for name, code in ((name, scene_statuses(ds)[name]) for name in greys_of(ds, table)):
        table[name] = max(table.values()) + 1
        shown[(variable.values == table["undecided"]) & (state.values == code)] = table[name]
    return np.ma.masked_array(shown, np.isin(state.values, list(status.UNANSWERED))), table, colours


def colours_of(table):
    """A colour per meaning: orange is unstable and nothing else, light blue stable or "ok"; "none"
    stays pale.
    """
    found = {"undecided": UNDECIDED, "ok": COLOURS[1], "none": NOTHING, "marginal": MARGINAL}
    meant = [name for name in table if name not in found]
    unstable = [name for name in meant if "unstable" in name]
    stable = [name for name in meant if "stab" in name and name not in unstable]
    for names, colours in ((unstable, UNSTABLE), (stable, STABLE)):
        found |= dict(zip(names, colours, strict=False))
    rest = [name for name in meant if name not in found]
    return found | dict(zip(rest, (c for c in OTHERS if c not in found.values()), strict=False))


def greys_of(ds, table):
    """{status: grey} of the scene's own statuses, where the flag variable can be undecided."""
    return greys(ds, GREYS) if "undecided" in table else {}


def greys(ds, shades=LIGHT_GREYS):
    """{status: grey} of the scene's own statuses."""
    return {name: shades[i % len(shades)] for i, name in enumerate(scene_statuses(ds))}


def hatch_of(table, name):
    """The hatching of a meaning in papers; none for undecided, which is black, nor for undefined,
    which is grey.
    """
    meant = [other for other in table if other != "undecided"]
    return HATCHES[meant.index(name) % len(HATCHES)] if name in meant and "ok" not in table else ""
