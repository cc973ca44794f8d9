"""The cells of a map, each verdict a theorem: found in ball arithmetic, with the certificate for `survey-check`.

What `survey prove` puts into the file of a map instead of the cells of `survey.sweep.refine`, under the same names. The
rectangle is proved in parts, side by side in processes, as the arithmetic holds Python's lock; finished parts are kept.
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
START = 2  # of them, to make the parts that are proved one by one
FRACTION = 1e-3  # of the width of a cell: what the polynomials may leave out, in units of the factors


def equation_of(workflow):
    """(kind, pieces, parameters, rectangle) as a certificate states them; raises BadInput."""
    try:
        import flint  # noqa: F401
    except ImportError:
        raise BadInput("prove: python-flint is missing; install it with pip install python-flint") from None
    scene = workflow.scene
    if not hasattr(scene, "equation"):
        raise BadInput(f"prove: the scene {workflow.name} has no formulas to prove; choose mathieu or satellite")
    if workflow.refine is None:
        raise BadInput("prove: the workflow does not say how small cells may become; add [refine] with a width")
    names, ends, rectangle = {}, {}, []
    for key, (_, values) in workflow.grid.parameters.items():
        names[key] = key
        if key in workflow.refine:
            ends[key] = float(values.min()), float(values.max())
        else:
            names[key] = f"({_decimal(float(values))})"
    for key in workflow.refine:
        rectangle.append([_decimal(end) for end in ends[key]])
    kind, pieces = scene.equation(names, ends, dict(workflow.request.options))
    return kind, [list(piece) for piece in pieces], list(workflow.refine), rectangle


def _decimal(value):
    """The shortest decimals that denote this float, which are taken as exact."""
    return str(int(value)) if value == int(value) and abs(value) < 2**53 else repr(value)


def find(workflow, once, progress=None):
    """The dataset of the proved cells and areas; writes the certificate beside the output.

    `once` as in `survey.file.blocks.Blocks`; `progress` is called as parts are finished.
    """
    kind, pieces, names, rectangle = equation_of(workflow)
    depths = [min(DEEPEST, max(0, math.ceil(math.log2(1 / width) - 1e-9))) for width, _ in workflow.refine.values()]
    depth = max(0, min(depths) - START)
    across, tolerance = [2 ** (halvings - depth) for halvings in depths], FRACTION * 0.5 ** max(depths)
    prover = Prover({"kind": kind, "pieces": pieces}, names, rectangle, across, depth, tolerance)
    text = _certificate(workflow.title, prover, *solved(prover, once, progress))
    path = workflow.path.with_suffix(".cert")
    write_atomically(path, text.encode())
    return _describe(workflow, path, text)


class Prover:
    """All that a worker needs to prove a part of the map; called with its number, gives (number, (layout, panels)).

    The rectangle has `across` parts along its sides, whose cells are halved at most `depth` times.
    """

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
    """A part has not been proved yet."""


def solved(prover, once, progress=None):
    """(layout, panels) of the whole map; those of each part are kept as it is finished."""
    from survey.proof import search

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
        workers, patience = min(dispatch.cpus(), len(todo)), dispatch.Patience(math.inf)  # a part may take minutes
        dispatch.on_processes(prover, todo, finished, died, workers, patience)
    layouts, lists = zip(*(parts[number] for number in prover.numbers), strict=True)
    return "".join(layouts), [panel for some in lists for panel in some]


def _packed(part):
    return {"part": np.frombuffer(json.dumps(part).encode(), np.uint8)}


def _unpacked(arrays):
    return json.loads(arrays["part"].tobytes())


def _certificate(title, prover, layout, panels):
    """The text of the certificate."""
    from survey.proof import checker, search

    found = [checker.shares_of(panel["cells"]) for panel in panels]
    shares = checker.weighed(checker.places(prover.across, layout), found)
    table = {
        "format": checker.FORMAT, "title": title, "bits": search.BITS, "equation": prover.equation,
        "parameters": prover.names, "rectangle": prover.rectangle,
        "panels": {"across": prover.across, "layout": layout, "list": panels},
        "shares": {letter: str(part) for letter, part in shares.items()},
    }  # fmt: skip
    return json.dumps(table | {"sha256": checker.digest(table)}, indent=1) + "\n"


def _describe(workflow, path, text):
    """Variables and attributes."""
    from survey.proof import checker

    certificate, names = checker.Certificate(text), list(workflow.refine)
    parameters = [next(p for p in workflow.scene.PARAMETERS if p.name == name) for name in names]
    pairs = zip(certificate.places, certificate.panels, strict=True)
    found = [boxes(checker.within(certificate.sides, place), panel) for place, panel in pairs]
    box, letters = (np.concatenate(parts) for parts in zip(*found, strict=True))
    variables = {}
    for at, p in enumerate(parameters):
        for side, end in enumerate(("low", "high")):
            meaning = {"long_name": f"{end} end of the cell in {p.long_name}", "units": p.units, "symbol": p.symbol}
            variables[f"cell_{p.name}_{end}"] = ("cell", box[:, 2 * at + side], meaning)
    codes = {checker.OPEN: -1, checker.UNSTABLE: 0, checker.STABLE: 1}
    variables["cell_verdict"] = ("cell", np.array([codes[letter] for letter in letters], np.int8), {
        "long_name": "proved stability everywhere in the cell", "units": "1",
        "comment": f"undecided: nothing is proved; the others follow from the certificate {path.name}",
        **flag_attributes(CODES)})  # fmt: skip
    units = " ".join(p.units for p in parameters if p.units != "1") or "1"
    least = [certificate.shares[letter] for letter in (checker.UNSTABLE, checker.STABLE)]
    left = certificate.shares[checker.OPEN]
    variables |= _areas(certificate.sides, least, left, units)
    flags = np.array([CODES[label] for label in LABELS], np.int8)
    coords = {"area_verdict": ("area_verdict", flags, {
        "long_name": "verdict of the area", "units": "1", "flag_values": flags,
        "flag_meanings": " ".join(LABELS)})}  # fmt: skip
    words = (
        f"{label}: {checker.decimal(100 * part, 4, False)} % to {checker.decimal(100 * (part + left), 4, True)} %"
        for label, part in zip(LABELS, least, strict=True)
    )
    about = {
        "refine": ", ".join(names), "areas": ", ".join(words),
        "proof": "each decided cell is proved in ball arithmetic", "proof_certificate": path.name,
        "proof_sha256": hashlib.sha256(text.encode()).hexdigest(),
        "proof_statement": certificate.statement(certificate.shares),
    }  # fmt: skip
    return xr.Dataset(variables, coords, about)


def _areas(sides, least, left, units):
    """The proved bounds of the area of each verdict, rounded outwards, and the values halfway between them."""
    variables, total = {}, math.prod(high - low for low, high in sides)
    for name, scale, unit, words in (
        ("area", total, units, "area of the map with this verdict"),
        ("area_fraction", Fraction(1), "1", "share of the map's area with this verdict"),
    ):
        low = np.array([_rounded(scale * part, -math.inf) for part in least])
        high = np.array([_rounded(scale * (part + left), math.inf) for part in least])
        bar = round_up(0.5 * (high - low) + 2**-51 * high)
        about = {"units": unit, "ancillary_variables": f"{name}_error"}
        variables[name] = ("area_verdict", 0.5 * (low + high), {"long_name": words, **about})
        variables[f"{name}_error"] = ("area_verdict", bar, {"long_name": f"error bound of {name}", "units": unit})
        for end, values, bound in (("low", low, "lower"), ("high", high, "upper")):
            meaning = {"long_name": f"proved {bound} bound of the {words}", "units": unit}
            variables[f"{name}_{end}"] = ("area_verdict", values, meaning)
    return variables


def _rounded(number, towards):
    """A rational number as a float on this side of it."""
    value = float(number)
    return value if Fraction(value) == number else math.nextafter(value, towards)


def boxes(sides, panel):
    """The cells of a panel: (their ends along both axes (M, 4), their letters (M))."""
    from survey.proof import checker

    found, letters, waiting = [], [], [((0.0, 1.0), (0.0, 1.0))]
    for letter in panel["cells"]:
        place = waiting.pop()
        if letter == checker.SPLIT:
            waiting += checker.quarters(place)
        else:
            found.append([*place[0], *place[1]])
            letters.append(letter)
    low = np.array([float(side[0]) for side in sides])
    length = np.array([float(side[1] - side[0]) for side in sides])
    return low.repeat(2) + length.repeat(2) * np.array(found), np.array(letters)
