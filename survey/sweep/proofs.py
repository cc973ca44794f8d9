"""The cells of a map, each verdict a theorem: panels in ball arithmetic, and the certificate for `survey-check`.

What `survey prove` puts into the file of a map instead of the cells of `survey.sweep.refine`, under the same names.
"""

import contextlib
import hashlib
import json
import math
from fractions import Fraction

import numpy as np
import xarray as xr

from survey.errors import BadInput
from survey.file.disk import write_atomically
from survey.file.labels import flag_attributes, round_up
from survey.sweep import dispatch

CODES = {"undecided": -1, "unstable": 0, "stable": 1}
LABELS = ("unstable", "stable")
DEEPEST = 20  # halvings of the rectangle
FRACTION = 1e-3  # of the width of a cell: what a panel's series may leave out, of the largest factor


def missing():
    """Why nothing can be proved here; None if it can."""
    try:
        import flint  # noqa: F401
    except ImportError:
        return "prove: python-flint is missing; install it with pip install 'survey[prove]'"
    return None


def equation_of(workflow):
    """(kind, pieces, parameters, rectangle) as a certificate states them; raises BadInput."""
    name, scene = workflow.name, workflow.scene
    if missing():
        raise BadInput(missing())
    if not hasattr(scene, "equation"):
        raise BadInput(f"prove: nothing can be proved yet about the scene {name}")
    if workflow.refine is None:
        raise BadInput("prove: the workflow must say how small the cells are: add [refine] with a width")
    axes = list(workflow.refine)
    written = {
        key: key if key in axes else _decimal(float(values))
        for key, (_, values) in workflow.grid.parameters.items()
    }
    rectangle = []
    for key in axes:
        values = workflow.grid.parameters[key][1]
        rectangle.append([_decimal(float(values.min())), _decimal(float(values.max()))])
    ends = {key: tuple(map(float, side)) for key, side in zip(axes, rectangle, strict=True)}
    kind, pieces = scene.equation(written, ends, dict(workflow.request.options))
    return kind, [list(piece) for piece in pieces], axes, rectangle


def _decimal(value):
    """The decimals that Python prints for a number, which are taken as exact."""
    return str(Fraction(repr(value))) if value == int(value) and abs(value) < 2**53 else repr(value)


def find(workflow, once, progress=None):
    """The dataset of the proved cells and areas; writes the certificate beside the output.

    `once` as in `Blocks`; `progress` is called as panels are finished.
    """
    from survey.proof import checker, search

    kind, pieces, names, rectangle = equation_of(workflow)
    checker.ctx.prec = search.BITS
    given = {"kind": kind, "pieces": pieces}
    sides = [[Fraction(end) for end in side] for side in rectangle]
    depths = [min(DEEPEST, max(0, math.ceil(math.log2(1 / width) - 1e-9))) for width, _ in workflow.refine.values()]
    try:
        across, depth, tolerance = _division(checker.Equation(kind, pieces, names), sides, depths)
    except checker.Failed as failed:
        raise BadInput(f"prove: nothing can be proved here: {failed}") from None
    prover = Prover(given, names, rectangle, across, depth, tolerance)
    panels, shares = _solved(prover, once, progress)
    text = certificate(workflow.title, given, names, rectangle, across, panels, shares)
    path = workflow.path.with_suffix(".cert")
    write_atomically(path, text.encode())
    return _describe(workflow, path, text, sides, across, panels, shares)


def _division(equation, sides, depths):
    """(numbers of panels across, halvings of each, tolerance): the division with the least work, by four panels of it."""
    from survey.proof import checker, search

    best, why = None, None
    tolerance = FRACTION * 0.5 ** max(depths)
    for depth in range(min(depths), -1, -1):
        across = [2 ** (whole - depth) for whole in depths]
        if across[0] * across[1] > 4096:
            break
        tried = {(i * (n - 1), j * (m - 1)) for n, m in [across] for i in (0, 1) for j in (0, 1)}
        work = []
        for at in sorted(tried):
            try:
                plan = search.plan(equation, panel_sides(sides, across, at), tolerance)
            except checker.Failed as failed:
                why = failed
                continue
            nodes = plan.nodes[0] * plan.nodes[1]
            work.append(nodes * plan.steps + 30 * nodes)
        if len(work) < len(tried):  # where it fails nothing is proved: smaller panels may do
            continue
        total = across[0] * across[1] * sum(work) / len(work)
        if best and total > best[0]:
            break
        if best is None or total < best[0]:
            best = total, across, depth
    if best is None:
        raise why or checker.Failed("too many panels are needed")
    return *best[1:], tolerance


def panel_sides(sides, across, at):
    """The sides of the panel at this position of the division."""
    return [
        [low + (high - low) * Fraction(i + end, n) for end in (0, 1)]
        for (low, high), n, i in zip(sides, across, at, strict=True)
    ]


class Prover:
    """All that a worker needs to prove one panel; called with its number, gives (number, panel of the certificate)."""

    def __init__(self, equation, names, rectangle, across, depth, tolerance):
        self.equation, self.names, self.rectangle = equation, names, rectangle
        self.across, self.depth, self.tolerance = across, depth, tolerance

    @property
    def numbers(self):
        """The panels' numbers."""
        return range(self.across[0] * self.across[1])

    def __call__(self, number):
        from survey.proof import checker, search

        checker.ctx.prec = search.BITS
        equation = checker.Equation(self.equation["kind"], self.equation["pieces"], self.names)
        sides = [[Fraction(end) for end in side] for side in self.rectangle]
        sides = panel_sides(sides, self.across, divmod(number, self.across[1]))
        try:
            plan = search.plan(equation, sides, self.tolerance)
            cells = search.cells(checker.Panel(equation, sides, plan.table(checker.OPEN)), self.depth)
        except checker.Failed:
            return number, checker.open_panel()
        return number, plan.table(cells)


class _Missing(Exception):
    """A panel has not been proved yet."""


def _solved(prover, once, progress):
    """(the panels of the certificate, {verdict: its share of the rectangle}); kept as they are finished."""
    from survey.proof import checker

    panels = {}

    def name(number):
        return f"panel-{prover.depth}-{prover.across[0]}-{prover.across[1]}-{number}"

    def missing():
        raise _Missing

    for number in prover.numbers:
        with contextlib.suppress(_Missing):
            panels[number] = _unpacked(once(name(number), missing))
    todo, reused = [number for number in prover.numbers if number not in panels], len(panels)

    def finished(done, result=None):
        if result:
            number, panel = result
            panels[number] = _unpacked(once(name(number), lambda: _packed(panel)))
        if progress:
            progress(reused + done, len(prover.numbers), reused, "panels proved")

    if todo:
        died = lambda number: (number, checker.open_panel())  # noqa: E731
        dispatch.on_processes(prover, todo, finished, died, min(dispatch.cpus(), len(todo)))
    shares = dict.fromkeys(checker.VERDICTS, Fraction(0))
    for panel in panels.values():
        shares = {key: shares[key] + part / len(panels) for key, part in checker.shares_of(panel["cells"]).items()}
    return [panels[number] for number in prover.numbers], shares


def _packed(panel):
    return {"panel": np.frombuffer(json.dumps(panel).encode(), np.uint8)}


def _unpacked(arrays):
    return json.loads(arrays["panel"].tobytes())


def certificate(title, equation, names, rectangle, across, panels, shares):
    """The text of the certificate."""
    from survey.proof import checker, search

    table = {
        "format": checker.FORMAT, "title": title, "bits": search.BITS, "equation": equation, "parameters": names,
        "rectangle": rectangle, "panels": {"across": across, "list": panels},
        "shares": {key: str(part) for key, part in shares.items()},
    }  # fmt: skip
    return json.dumps(table | {"sha256": checker.digest(table)}, indent=1) + "\n"


def _describe(workflow, path, text, sides, across, panels, shares):
    """Variables and attributes."""
    from survey.proof import checker

    names = list(workflow.refine)
    parameters = [next(p for p in workflow.scene.PARAMETERS if p.name == name) for name in names]
    found = [_boxes(sides, across, divmod(number, across[1]), panel) for number, panel in enumerate(panels)]
    box, letters = (np.concatenate(parts) for parts in zip(*found, strict=True))
    codes = {checker.OPEN: -1, checker.UNSTABLE: 0, checker.STABLE: 1}
    variables = {}
    for at, p in enumerate(parameters):
        for side, end in enumerate(("low", "high")):
            meaning = {"long_name": f"{end} end of the cell in {p.long_name}", "units": p.units, "symbol": p.symbol}
            variables[f"cell_{p.name}_{end}"] = ("cell", box[:, 2 * at + side], meaning)
    variables["cell_verdict"] = ("cell", np.array([codes[letter] for letter in letters], np.int8), {
        "long_name": "proved stability everywhere in the cell", "units": "1",
        "comment": f"undecided: nothing is proved; the others follow from the certificate {path.name}",
        **flag_attributes(CODES)})  # fmt: skip
    variables |= _areas(sides, shares, " ".join(p.units for p in parameters if p.units != "1") or "1")
    flags = np.array([CODES[label] for label in LABELS], np.int8)
    coords = {"area_verdict": ("area_verdict", flags, {
        "long_name": "verdict of the area", "units": "1", "flag_values": flags,
        "flag_meanings": " ".join(LABELS)})}  # fmt: skip
    open_part = shares[checker.OPEN]
    words = (f"{label}: {float(100 * shares[letter]):.4f} % to {float(100 * (shares[letter] + open_part)):.4f} %"
             for label, letter in zip(LABELS, (checker.UNSTABLE, checker.STABLE), strict=True))  # fmt: skip
    about = {
        "refine": ", ".join(names), "areas": ", ".join(words), "proof": "each decided cell is proved in ball arithmetic",
        "proof_certificate": path.name, "proof_sha256": hashlib.sha256(text.encode()).hexdigest(),
        "proof_statement": checker.Certificate(text).statement(shares),
    }  # fmt: skip
    return xr.Dataset(variables, coords, about)


def _areas(sides, shares, units):
    """The bounds of the area of each verdict, rounded outwards."""
    from survey.proof import checker

    total = math.prod(high - low for low, high in sides)
    variables = {}
    for name, scale, unit, words in (
        ("area", total, units, "area of the map with this verdict"),
        ("area_fraction", Fraction(1), "1", "share of the map's area with this verdict"),
    ):
        least = [scale * shares[letter] for letter in (checker.UNSTABLE, checker.STABLE)]
        low = np.array([_rounded(part, -math.inf) for part in least])
        high = np.array([_rounded(part + scale * shares[checker.OPEN], math.inf) for part in least])
        middle = 0.5 * (low + high)
        variables[name] = ("area_verdict", middle, {
            "long_name": words, "units": unit, "ancillary_variables": f"{name}_error"})  # fmt: skip
        variables[f"{name}_error"] = ("area_verdict", round_up(np.nextafter(high - low, math.inf) * 0.5 + 1e-15 * high), {
            "long_name": f"error bound of {name}", "units": unit})  # fmt: skip
        for end, values in (("low", low), ("high", high)):
            variables[f"{name}_{end}"] = ("area_verdict", values, {
                "long_name": f"proved {'lower' if end == 'low' else 'upper'} bound of the {words}", "units": unit})  # fmt: skip
    return variables


def _rounded(number, towards):
    """A rational number as a float on this side of it."""
    value = float(number)
    return value if Fraction(value) == number else math.nextafter(value, towards)


def _boxes(sides, across, at, panel):
    """The cells of a panel: (their ends along both axes (M, 4), their letters)."""
    from survey.proof import checker

    (x0, x1), (y0, y1) = panel_sides(sides, across, at)
    boxes, letters, waiting = [], [], [(0, 0, 0)]
    for letter in panel["cells"]:
        depth, i, j = waiting.pop()
        if letter == checker.SPLIT:
            waiting += [(depth + 1, 2 * i + right, 2 * j + upper) for upper, right in checker.QUARTERS]
            continue
        part = 0.5**depth
        boxes.append((i * part, (i + 1) * part, j * part, (j + 1) * part))
        letters.append(letter)
    share = np.array(boxes)
    low, length = np.array([x0, x0, y0, y0], float), np.array([x1 - x0, x1 - x0, y1 - y0, y1 - y0], float)
    return low + length * share, np.array(letters)
