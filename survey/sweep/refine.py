"""The map as cells that are decided as a whole, small where the verdict changes, and the area of each verdict.

Cells are halved until they are decided or have the width of [refine]; they are variables along the dimension `cell`.
"""

import math
import time
from itertools import count, pairwise

import numpy as np
import xarray as xr

from survey.errors import BadInput
from survey.file.labels import flag_attributes, percent, round_up
from survey.measures.hill import cells, monodromy
from survey.measures.hill.edges import FACTORS
from survey.scene import Request

LABELS = ("unstable", "stable")
ROUNDING = 1e-13  # of the sum of areas, relative to the map's


def find(workflow, each, once=lambda name, make: make(), report=None):
    """The dataset of the workflow's cells and areas.

    `each(task, numbers, finished)` as `dispatch.on_threads`; `once(name, make)` returns the arrays of `make()`, or
    those that an earlier run has kept under this name. `report(settled, points, left)` is called with the settled
    fraction of the map, the number of points solved, and the seconds that the parts known to be open will take.
    """
    panels = _panels(workflow)
    points, found, total = 0, [], _area(panels)
    for x, y in panels:
        share, done = _area([(x, y)]) / total, _area(panels[: len(found)]) / total
        state = [done, points]

        def settled(part, solved, share=share, done=done, before=points, state=state):
            state[:] = done + share * part, before + solved

        name = f"cells-{len(found)}-{x.depth}-{y.depth}"
        parts = _in_parts(name, each, once, lambda left, state=state: report and report(*state, left))
        try:
            panel = cells.find(_solver(workflow, x, y), x, y, parts, settled)
        except OverflowError as error:
            raise BadInput(f"refine.width: the map has {error}; use a greater width, or a smaller map") from None
        found.append(panel)
        points += panel.points
    if report:
        report(1.0, points, 0.0)
    return _describe(workflow, found, points)


def plan(workflow, cost):
    """({number of cells: at most, and on most maps}, estimated seconds on one thread).

    `cost` is the scene's estimate for a point, in seconds.
    """
    panels = _panels(workflow)
    most = min(sum(1 << x.depth + y.depth for x, y in panels), cells.MOST)
    # measured: cells along some twenty curves; along a value that a parameter excludes, each cell is solved
    usual = min(sum(20 << max(x.depth, y.depth) for x, y in panels), most)
    blocks = sum(16 + 2 * ((1 << y.depth) * _cut(workflow, 0, x) + (1 << x.depth) * _cut(workflow, 1, y))
                 for x, y in panels)  # fmt: skip
    seconds = 3e-6 * usual + blocks * cells.PLACES.size**2 * 20 * cost
    return {"most": most, "bytes_at_most": 33 * most, "usually": usual}, seconds


def _cut(workflow, at, axis):
    """How many ends of a panel's side are excluded values of its parameter."""
    name = list(workflow.refine)[at]
    return len({axis.low, axis.high} & set(next(p.excluded for p in workflow.scene.PARAMETERS if p.name == name)))


def _in_parts(name, each, once, report):
    """`each` of `cells.find`, called once per level: the result of a part is kept as soon as it is found."""
    levels = count()

    def parts(task, items):
        level, began, leaves = next(levels), time.perf_counter(), [None] * len(items)

        def part(number):
            arrays = once(f"{name}-{level}-{number}", lambda: {"leaves": task(items[number])})
            leaves[number] = arrays["leaves"]

        def finished(done, _=None):
            if done:
                report((time.perf_counter() - began) / done * (len(items) - done))

        each(part, range(len(items)), finished)
        return leaves

    return parts


def _area(panels):
    return sum((x.high - x.low) * (y.high - y.low) for x, y in panels)


def _panels(workflow):
    """The rectangles (x, y) of the map between the values that a parameter excludes: nothing is analytic across."""
    sides = [_sides(workflow, name, *asked) for name, asked in workflow.refine.items()]
    return [(x, y) for x in sides[0] for y in sides[1]]


def _sides(workflow, name, width, log):
    """An Axis between every two neighbours among the ends and the excluded values."""
    values = workflow.grid.parameters[name][1]
    low, high = float(values.min()), float(values.max())
    excluded = next(p.excluded for p in workflow.scene.PARAMETERS if p.name == name)
    cuts = [low, *sorted(value for value in excluded if low < value < high), high]

    def length(a, b):
        return math.log(b / a) if log else b - a

    return [
        cells.Axis(a, b, max(0, math.ceil(math.log2(length(a, b) / (width * length(low, high))) - 1e-9)), log)
        for a, b in pairwise(cuts)
    ]


def _solver(workflow, x, y):
    """What `cells.find` asks of the scene; NaN outside the parameters' domains."""
    rtol = cells.accuracy(max(x.depth, y.depth))
    request = Request(workflow.request.options, "auto", rtol, frozenset(FACTORS))
    fixed = {name: np.full((1, 1, 1), values) for name, (dims, values) in workflow.grid.parameters.items() if not dims}
    axes = [next(p for p in workflow.scene.PARAMETERS if p.name == name) for name in workflow.refine]

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
            attributes = {"long_name": f"{end} end of the cell in {p.long_name}", "units": p.units, "symbol": p.symbol}
            variables[f"cell_{p.name}_{end}"] = ("cell", box[:, 2 * at + side], attributes)
    flags = {key: code for key, code in monodromy.VERDICTS.items() if key != "marginal"}
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
    words = (f"{label}: {percent(value / total, error / total)}" for label, value in zip(LABELS, area, strict=True))
    about = {"refine": ", ".join(names), "refine_points": points, "areas": ", ".join(words)}
    return xr.Dataset(variables, coords, about)
