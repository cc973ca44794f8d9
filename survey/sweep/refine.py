"""The map in cells, as small as needed where the verdict changes, and the area of each verdict.

Cells are halved until they are decided or have the width of [refine]; they are variables along the
dimension `cell`.
"""

import math
import threading
import time
from itertools import count, pairwise

import numpy as np
import xarray as xr

from survey import measures
from survey.errors import BadInput
from survey.file.labels import flag_attributes, percent, round_up
from survey.measures.tasks import in_turn
from survey.scene import Request

LABELS = ("unstable", "stable")
CELL_SECONDS = 3e-6  # of a measure that names none
ROUNDING = 1e-13  # of the sum of areas, relative to the total


def find(workflow, each=in_turn, once=lambda name, make: make(), report=None):
    """The dataset of the workflow's cells and areas.

    `each`: see `survey.measures.tasks`; `once(name, make)` gives the arrays of `make()`, or those
    that an earlier run has kept under this name. `report(settled, points, left)` is called with the
    part of the map that is settled, the points solved for it, and the seconds that the parts known
    to be open will take.
    """
    measure, panels = _measure(workflow), _panels(workflow)
    points = 0
    found = []
    total = _area(panels)
    more = measure.keywords(workflow.scene) if hasattr(measure, "keywords") else {}
    for x, y in panels:
        share, done = _area([(x, y)]) / total, _area(panels[: len(found)]) / total
        known = [done, points]

        def settled(part, solved, share=share, done=done, before=points, known=known):
            known[:] = done + share * part, before + solved

        name = f"cells-{len(found)}-{x.depth}-{y.depth}"
        parts = _in_parts(
            name, each, once, lambda left, known=known: report and report(*known, left)
        )
        try:
            cells = measure.find(_solver(workflow, x, y), x, y, parts, settled, **more)
        except OverflowError as error:
            raise BadInput(
                f"refine.width: the map has {error}; use a larger width, or a smaller map"
            ) from None
        found.append(cells)
        points += cells.points
    if report:
        report(1.0, points, 0.0)
    return _describe(workflow, found, points)


def plan(workflow, cost, threads):
    """({number of cells: at most, and on most maps}, estimated seconds on so many threads).

    `cost` is the scene's estimate for a point, in seconds.
    """
    measure, panels = _measure(workflow), _panels(workflow)
    most = min(sum(1 << x.depth + y.depth for x, y in panels), measure.MOST)
    # measured: some twenty curves' widths of cells; along a value that a parameter excludes, blocks down
    # to a few cells are solved
    usual = min(sum(20 << max(x.depth, y.depth) for x, y in panels), most)
    blocks = sum(16 + ((1 << y.depth) * _cut(workflow, 0, x) + (1 << x.depth) * _cut(workflow, 1, y)) // 2
                 for x, y in panels)  # fmt: skip
    seconds = (
        getattr(measure, "CELL_SECONDS", CELL_SECONDS) * usual
        + blocks * measure.POINTS.size**2 * 20 * cost
    )
    return {"most": most, "bytes_at_most": 33 * most, "usually": usual}, seconds / threads


def _measure(workflow):
    """The module that knows the scene's cells."""
    return measures.cells(workflow.scene)


def _cut(workflow, at, axis):
    """How many ends of a panel's side are excluded values of its parameter."""
    name = list(workflow.refine)[at]
    return len(
        {axis.low, axis.high}
        & set(next(p.excluded for p in workflow.scene.PARAMETERS if p.name == name))
    )


def _in_parts(name, each, once, report):
    """`each`, which `cells.find` calls once for every halving: what a part finds is kept as soon as
    it is there.
    """
    halvings, lock = count(), threading.Lock()

    def parts(task, items, what):
        halving = next(halvings)
        began = time.perf_counter()
        done = count(1)

        def part(number):
            leaves = once(f"{name}-{halving}-{number}", lambda: {"leaves": task(items[number])})[
                "leaves"
            ]
            with lock:
                solved = next(done)
                report((time.perf_counter() - began) / solved * (len(items) - solved))
            return leaves

        return each(part, range(len(items)), what)

    return parts


def _area(panels):
    return sum((x.high - x.low) * (y.high - y.low) for x, y in panels)


def _panels(workflow):
    """The rectangles (x, y) of the map between the values that a parameter excludes: nothing is
    analytic across.
    """
    sides = [_sides(workflow, name, *asked) for name, asked in workflow.refine.items()]
    return [(x, y) for x in sides[0] for y in sides[1]]


def _sides(workflow, name, width, log):
    """The Side between each two neighbours of the ends and the excluded values."""
    values = workflow.grid.parameters[name][1]
    low, high = float(values.min()), float(values.max())
    excluded = next(p.excluded for p in workflow.scene.PARAMETERS if p.name == name)
    cuts = [low, *sorted(value for value in excluded if low < value < high), high]

    def length(a, b):
        return math.log(b / a) if log else b - a

    return [
        _measure(workflow).Side(
            a,
            b,
            max(0, math.ceil(math.log2(length(a, b) / (width * length(low, high))) - 1e-9)),
            log,
        )
        for a, b in pairwise(cuts)
    ]


def _solver(workflow, x, y):
    """What `cells.find` asks of the scene; NaN outside the parameters' domains."""
    rtol = _measure(workflow).accuracy(max(x.depth, y.depth))
    request = Request(workflow.request.options, "auto", rtol, frozenset(_measure(workflow).OUTPUTS))
    fixed = {
        name: np.full((1, 1, 1), values)
        for name, (dims, values) in workflow.grid.parameters.items()
        if not dims
    }
    axes = [
        next(p for p in workflow.scene.PARAMETERS if p.name == name) for name in workflow.refine
    ]

    def solve(*values):
        point = {p.name: np.where(p.holds(v), v, np.nan) for p, v in zip(axes, values, strict=True)}
        with np.errstate(all="ignore"):
            return workflow.scene.solve(fixed | point, request)

    return solve


def _describe(workflow, found, points):
    """Variables and attributes."""
    names = list(workflow.refine)
    parameters = [next(p for p in workflow.scene.PARAMETERS if p.name == name) for name in names]
    box = np.concatenate([panel.box for panel in found])
    verdict = np.concatenate([panel.verdict for panel in found])
    variables = {}
    for at, p in enumerate(parameters):
        for side, end in enumerate(("low", "high")):
            meaning = {
                "long_name": f"{end} end of the cell in {p.long_name}",
                "units": p.units,
                "symbol": p.symbol,
            }
            variables[f"cell_{p.name}_{end}"] = ("cell", box[:, 2 * at + side], meaning)
    flags = {key: code for key, code in _measure(workflow).VERDICTS.items()}
    variables["cell_verdict"] = ("cell", verdict, {
        "long_name": "stability everywhere in the cell", "units": "1",
        "comment": "undecided: an edge of a tongue may lie in it, or the verdict could not be proved",
        **flag_attributes(flags)})  # fmt: skip
    total = sum(panel.total for panel in found)
    least = np.array([sum(getattr(panel, name) for panel in found) for name in LABELS])
    bar = 0.5 * max(0.0, total - least.sum())
    area, error = least + bar, bar + ROUNDING * total
    units = " ".join(p.units for p in parameters if p.units != "1") or "1"
    for name, scale, unit, words in (
        ("area", 1.0, units, "area of the map with this verdict"),
        ("area_fraction", total, "1", "share of the map's area with this verdict"),
    ):
        variables[name] = ("area_verdict", area / scale, {
            "long_name": words, "units": unit, "ancillary_variables": f"{name}_error"})  # fmt: skip
        variables[f"{name}_error"] = ("area_verdict", round_up(np.full(len(LABELS), error / scale)), {
            "long_name": f"error bound of {name}", "units": unit})  # fmt: skip
    codes = np.array([flags[label] for label in LABELS], np.int8)
    coords = {"area_verdict": ("area_verdict", codes, {
        "long_name": "verdict of the area", "units": "1",
        "flag_values": codes, "flag_meanings": " ".join(LABELS)})}  # fmt: skip
    words = (
        f"{label}: {percent(value / total, error / total)}"
        for label, value in zip(LABELS, area, strict=True)
    )
    about = {"refine": ", ".join(names), "refine_points": points, "areas": ", ".join(words)}
    return xr.Dataset(variables, coords, about)
