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
START = 2  # of them make the parts that are proved one by one
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
        key: key if key in axes else _decimal(float(values)) for key, (_, values) in workflow.grid.parameters.items()
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
    depths = [min(DEEPEST, max(0, math.ceil(math.log2(1 / width) - 1e-9))) for width, _ in workflow.refine.values()]
    depth = max(0, min(depths) - START)
    across, tolerance = [2 ** (whole - depth) for whole in depths], FRACTION * 0.5 ** max(depths)
    prover = Prover(given, names, rectangle, across, depth, tolerance)
    layout, panels = _solved(prover, once, progress)
    text = _certificate(workflow.title, given, names, rectangle, across, layout, panels)
    path = workflow.path.with_suffix(".cert")
    write_atomically(path, text.encode())
    return _describe(workflow, path, text)


class Prover:
    """All that a worker needs to prove a part of the map; called with its number, gives (number, (layout, panels))."""

    def __init__(self, equation, names, rectangle, across, depth, tolerance):
        self.equation, self.names, self.rectangle = equation, names, rectangle
        self.across, self.depth, self.tolerance = across, depth, tolerance

    @property
    def numbers(self):
        """Of the parts."""
        return range(self.across[0] * self.across[1])

    def __call__(self, number):
        from survey.proof import checker, search

        checker.ctx.prec = search.BITS
        equation = checker.Equation(self.equation["kind"], self.equation["pieces"], self.names)
        sides = [[Fraction(end) for end in side] for side in self.rectangle]
        part = checker.within(sides, checker.places(self.across, search.PANEL * len(self.numbers))[number])
        return number, search.panels(equation, part, self.depth, self.tolerance)


class _Missing(Exception):
    """A panel has not been proved yet."""


def _solved(prover, once, progress):
    """(the layout, the panels) of the whole map; those of each part are kept as it is finished."""
    from survey.proof import checker, search

    parts = {}

    def name(number):
        return f"proof-{prover.depth}-{prover.across[0]}-{prover.across[1]}-{number}"

    def missing():
        raise _Missing

    for number in prover.numbers:
        with contextlib.suppress(_Missing):
            parts[number] = _unpacked(once(name(number), missing))
    todo, reused = [number for number in prover.numbers if number not in parts], len(parts)

    def finished(done, result=None):
        if result:
            number, part = result
            parts[number] = _unpacked(once(name(number), lambda: _packed(part)))
        if progress:
            progress(reused + done, len(prover.numbers), reused, "parts proved")

    def died(number):
        return number, (search.PANEL, [search.open_panel()])

    if todo:
        dispatch.on_processes(prover, todo, finished, died, min(dispatch.cpus(), len(todo)))
    layouts, lists = zip(*(parts[number] for number in prover.numbers), strict=True)
    return "".join(layouts), [panel for some in lists for panel in some]


def _packed(part):
    return {"part": np.frombuffer(json.dumps(part).encode(), np.uint8)}


def _unpacked(arrays):
    return json.loads(arrays["part"].tobytes())


def _certificate(title, equation, names, rectangle, across, layout, panels):
    """The text of the certificate."""
    from survey.proof import checker, search

    found = [checker.shares_of(panel["cells"]) for panel in panels]
    shares = checker.weighed(checker.places(across, layout), found)
    table = {
        "format": checker.FORMAT, "title": title, "bits": search.BITS, "equation": equation, "parameters": names,
        "rectangle": rectangle, "panels": {"across": across, "layout": layout, "list": panels},
        "shares": {letter: str(part) for letter, part in shares.items()},
    }  # fmt: skip
    return json.dumps(table | {"sha256": checker.digest(table)}, indent=1) + "\n"


def _describe(workflow, path, text):
    """Variables and attributes."""
    from survey.proof import checker

    certificate, names = checker.Certificate(text), list(workflow.refine)
    sides, shares = certificate.sides, certificate.shares
    parameters = [next(p for p in workflow.scene.PARAMETERS if p.name == name) for name in names]
    found = [
        _boxes(checker.within(sides, place), panel)
        for place, panel in zip(certificate.places, certificate.panels, strict=True)
    ]
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
        "proof_statement": certificate.statement(shares),
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


def _boxes(sides, panel):
    """The cells of a panel: (their ends along both axes (M, 4), their letters)."""
    from survey.proof import checker

    boxes, letters, waiting = [], [], [((0.0, 1.0), (0.0, 1.0))]
    for letter in panel["cells"]:
        place = waiting.pop()
        if letter == checker.SPLIT:
            waiting += checker.quarters(place)
        else:
            boxes.append([*place[0], *place[1]])
            letters.append(letter)
    low = np.array([float(side[0]) for side in sides])
    length = np.array([float(side[1] - side[0]) for side in sides])
    return low.repeat(2) + length.repeat(2) * np.array(boxes), np.array(letters)
