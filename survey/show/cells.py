"""A refined map: its cells, each decided as a whole, with the area of each verdict."""

import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.patches import Patch

from survey.file import schema
from survey.file.labels import flag_codes, percent
from survey.show.marks import marks
from survey.show.palette import colours_of, hatch_of
from survey.show.text import literal


def draw_cells(axes, ds, x, y, failed, number, paper):
    """Draw the map's cells instead of its points; returns the legend handles, which give the area
    of each verdict.
    """
    schema.cells(ds)
    left, right, low, high = (
        ds[f"cell_{axis.name}_{end}"].values for axis in (x, y) for end in ("low", "high")
    )
    corners = np.stack([left, low, left, high, right, high, right, low], axis=1).reshape(-1, 4, 2)
    table, sizes = flag_codes(ds.cell_verdict.attrs), (right - left) * (high - low)
    shares = dict(zip(flag_codes(ds.area_verdict.attrs), ds.area_fraction.values, strict=True))
    handles = []
    for name, code in reversed(table.items()):
        here, colour = ds.cell_verdict.values == code, colours_of(table)[name]
        # without antialiasing there are no seams between neighbours; a hairline keeps small
        # undecided cells visible
        line = {"edgecolors": "none", "antialiased": False}
        line = {"edgecolors": colour, "lw": 0.4, "snap": False} if name == "undecided" else line
        hatch = hatch_of(table, name) if paper else None
        axes.add_collection(
            PolyCollection(corners[here], facecolors=colour, rasterized=True, **line)
        )
        if hatch:
            axes.add_collection(
                PolyCollection(corners[here], facecolors="none", lw=0, hatch=hatch, rasterized=True)
            )
        if name in shares:
            part = percent(shares[name], float(ds.area_fraction_error[0])).replace("+-", "±")
            label = f"{literal(name)} ({part})"
        else:  # the areas in such cells may be known, so this is no share beside the others
            part = 100.0 * sizes[here].sum() / sizes.sum()
            label = f"{literal(name)} cells ({part:.2g} % of the map)"
        patch = Patch(
            facecolor=colour,
            edgecolor="black",
            lw=0.5,
            hatch=hatch,
            label=label,
        )
        handles += [patch] if here.any() else []
    axes.set(xlim=(left.min(), right.max()), ylim=(low.min(), high.max()))
    return handles + marks(axes, x, y, failed, "failed", number, paper)
