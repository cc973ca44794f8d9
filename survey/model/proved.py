"""What is proved of a map (`survey prove`), as models and pages carry it: the statement, its
bounds, and the cells.
"""

import numpy as np

from survey.errors import BadInput, Damaged

FINEST = 2**20  # cells along a side
LETTERS = {-1: "o", 0: "u", 1: "s"}  # open, unstable, stable


def of(ds):
    """What the dataset of a proved map says, for JSON; None where nothing is proved.

    `cells`: one text, "x0 x1 y0 y1 letter" for each cell, its ends in units of 1 / `parts` of the
    rectangle. Raises Damaged where the file says that something is proved, but not what.
    """
    if "proof_statement" not in ds.attrs or "cell_verdict" not in ds:
        return None
    try:
        return _said(ds)
    except (ArithmeticError, AttributeError, IndexError, KeyError, TypeError, ValueError) as error:
        raise Damaged(
            f"what the file says of its proof is incomplete ({error!r}); run survey prove again"
        ) from None


def _said(ds):
    names = [name.strip() for name in str(ds.attrs["refine"]).split(",")]
    ends, parts = [], []
    for name in names:
        low, high = (ds[f"cell_{name}_{end}"].values for end in ("low", "high"))
        first, last = float(low.min()), float(high.max())
        number = round((last - first) / float((high - low).min()))
        if not (0 < number <= FINEST and (low < high).all()):
            raise ValueError(f"cells along {name}")
        parts.append(number)
        ends += [
            np.rint((side - first) * (number / (last - first))).astype(int) for side in (low, high)
        ]
    areas = np.array([ds.area_low.values, ds.area_high.values], float)
    if len(names) != 2 or not np.isfinite(areas).all():
        raise ValueError("two axes and finite areas")
    letters = [LETTERS[int(code)] for code in ds.cell_verdict.values]
    rows = zip(*ends, letters, strict=True)
    return {
        "statement": str(ds.attrs["proof_statement"]),
        "certificate": str(ds.attrs["proof_certificate"]), "sha256": str(ds.attrs["proof_sha256"]),
        "names": names, "parts": parts, "cells": ";".join(" ".join(map(str, row)) for row in rows),
        "areas": {
            word: areas[:, i].tolist() for i, word in enumerate(str(ds.area_verdict.attrs["flag_meanings"]).split())
        },
    }  # fmt: skip


def matching(ds, workflow):
    """As `of`, for the map of a workflow; raises BadInput if another map was proved, or nothing."""
    found = of(ds)
    if found is None:
        raise BadInput(
            "--proof: this file contains no proof; name the OUT.nc that survey prove wrote"
        )
    options = ", ".join(f"{key}={value}" for key, value in workflow.request.options.items())
    same = ds.attrs["scene"] == workflow.name and ds.attrs.get("options", "") == options
    for name, (_, values) in workflow.grid.parameters.items():
        own = np.asarray(values)
        other = ds[name].values if name in ds.coords else None
        same &= other is not None and own.min() >= other.min() and own.max() <= other.max()
    if not same:
        raise BadInput(
            "--proof: this file proves another map; its scene, options and axes must be the workflow's"
        )
    return found
