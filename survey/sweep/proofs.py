"""The cells of a map, or the edges of a row, each a theorem in ball arithmetic, with a certificate
for `survey-check`.

What `survey prove` puts into the file instead of the cells of `survey.sweep.refine` and the edges
of `survey.sweep.boundaries`, under the same names. The rectangle or interval is proved in parts,
side by side in processes, as the arithmetic holds Python's lock; finished parts are kept.
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
# of the solution on an edge, or of the curve through it, by the factor of `checker.KINDS` that is
# zero there
EVEN_CLASSES = (
    ("even_antiperiodic", 0),
    ("even_periodic", 2),
    ("odd_periodic", 3),
    ("odd_antiperiodic", 1),
)
REVERSIBLE_CLASSES = (
    ("A", 0),
    ("C", 3),
    ("D", 4),
    ("B", 1),
    ("t", 5),
    ("two_minus_t", 6),
    ("KC", 2),
)
CLASSES = {
    "even": EVEN_CLASSES,
    "periodic": (("periodic", 0), ("antiperiodic", 1)),
    "reversible": REVERSIBLE_CLASSES,
}
DEEPEST = 20  # halvings of the rectangle
# of them, at least, to make the parts that are proved in turn
START = {"even": 2, "periodic": 2, "reversible": 0}
# of the width of a cell: what the polynomials may leave out, in units of the factors
FRACTION = 1e-3
ROW_PARTS = 8
# of the intervals that enclose edges; the latter at the larger end
EDGE_WIDTH, EDGE_ULPS = 1e-13, 4
ROW_BITS = 192


def equation_of(workflow):
    """(kind, pieces, parameters, rectangle) as a certificate states them; raises BadInput."""
    try:
        import flint  # noqa: F401
    except ImportError:
        raise BadInput(
            "prove: python-flint is missing; install it with pip install python-flint"
        ) from None
    scene = workflow.scene
    if not hasattr(scene, "equation"):
        raise BadInput(
            f"prove: {workflow.name} has no formulas to prove; choose mathieu, satellite, libration_elliptic, or "
            "a Hill equation of your own"
        )
    names, ends = {}, {}
    for key, (_, values) in workflow.grid.parameters.items():
        ends[key] = float(np.min(values)), float(np.max(values))
        names[key] = key if np.ndim(values) else f"({_decimal(float(values))})"
    axes = _axes(workflow)
    kind, pieces = scene.equation(names, ends, dict(workflow.request.options))
    return (
        kind,
        [list(piece) for piece in pieces],
        axes,
        [[_decimal(end) for end in ends[key]] for key in axes],
    )


def _axes(workflow):
    """The parameters of the map, or of the row, that is to be proved; raises BadInput."""
    if workflow.refine is not None:
        return list(workflow.refine)
    axes = list(workflow.grid.sizes)
    if workflow.boundaries is None:
        raise BadInput(
            "prove: nothing is requested: to prove the cells of a map, add [refine] with a width; to prove the edges "
            "along one axis, add [boundaries]"
        )
    if len(axes) != 1:
        raise BadInput(
            f"prove: [boundaries] are proved along one axis, and there are {', '.join(axes)}; give all but one as "
            "bare numbers, or add [refine] with a width to prove the cells of a map"
        )
    return axes


def _decimal(value):
    """The shortest decimals that denote this float, which are taken as exact."""
    return str(int(value)) if value == int(value) and abs(value) < 2**53 else repr(value)


def find(workflow, once, progress=None):
    """The dataset of the proved cells and areas, or edges; writes the certificate beside the
    output.

    `once` as in `survey.file.blocks.Blocks`; `progress` is called as parts are finished.
    """
    prover = prover_of(workflow)
    text = certificate(workflow.title, prover, *solved(prover, once, progress))
    path = workflow.path.with_suffix(".cert")
    write_atomically(path, text.encode())
    return described(workflow, path, text)


def described(workflow, path, text):
    """The dataset of what the text of a certificate at `path` states of the workflow's map or row;
    not checked.
    """
    return (_describe if workflow.refine else _describe_row)(workflow, path, text)


def prover_of(workflow):
    """The Prover of the workflow's map or row; raises BadInput."""
    kind, pieces, names, rectangle = equation_of(workflow)
    from survey.proof import search

    if len(names) == 1:
        low, high = (Fraction(end) for end in rectangle[0])
        width = max(EDGE_WIDTH, EDGE_ULPS * math.ulp(max(abs(low), abs(high))))
        across = [ROW_PARTS]
        depth = max(0, math.ceil(math.log2((high - low) / (ROW_PARTS * Fraction(width)))))
        bits, tolerance = ROW_BITS, FRACTION * width
    else:
        ends = [[float(end) for end in side] for side in rectangle]
        widths = [
            _linear(*width, *side)
            for width, side in zip(workflow.refine.values(), ends, strict=True)
        ]
        depths = [min(DEEPEST, max(0, math.ceil(math.log2(1 / x) - 1e-9))) for x in widths]
        depth = max(0, min(depths) - START[kind])
        across = [2 ** (halvings - depth) for halvings in depths]
        tolerance = FRACTION * 0.5 ** max(depths)
        bits = search.BITS
    return Prover(
        {"kind": kind, "pieces": pieces}, names, rectangle, across, depth, tolerance, bits
    )


def _linear(width, log, low, high):
    """A width as a fraction of an axis; on a logarithmic one, whose fraction is of the logarithm,
    that of the least.
    """
    low, high = sorted((abs(low), abs(high)))
    return math.expm1(width * math.log(high / low)) / (high / low - 1) if log else width


class Prover:
    """All that a worker needs to prove a part of the map; called with its number, gives (number,
    (layout, panels)).

    The rectangle has `across` parts along its sides, whose cells are halved at most `depth` times.
    """

    def __init__(self, equation, names, rectangle, across, depth, tolerance, bits):
        self.equation, self.names, self.rectangle = equation, names, rectangle
        self.across, self.depth, self.tolerance, self.bits = across, depth, tolerance, bits

    @property
    def numbers(self):
        """The numbers of the parts."""
        return range(math.prod(self.across))

    def __call__(self, number):
        from survey.proof import checker, search

        checker.ctx.prec = self.bits
        equation = checker.Equation(self.equation["kind"], self.equation["pieces"], self.names)
        sides = [[Fraction(end) for end in side] for side in self.rectangle]
        part = checker.regions(
            sides, {"across": self.across, "layout": search.PANEL * len(self.numbers)}
        )[number]
        return number, search.panels(equation, part, self.depth, self.tolerance)


class _Missing(Exception):
    """A part has not been proved yet."""


def solved(prover, once, progress=None):
    """(layout, panels) of the whole map; those of each part are kept as it is finished."""
    from survey.proof import search

    parts = {}

    def name(number):
        return "-".join(map(str, ("proof", prover.depth, *prover.across, number)))

    def missing():
        raise _Missing

    for number in prover.numbers:
        with contextlib.suppress(_Missing):
            parts[number] = _unpacked(once(name(number), missing))
    todo = [number for number in prover.numbers if number not in parts]
    reused = len(parts)

    def finished(done, result=None):
        if result:
            number, part = result
            parts[number] = _unpacked(once(name(number), lambda: _packed(part)))
        if progress:
            progress(reused + done, len(prover.numbers), reused, "parts proved")

    def died(number):
        return number, (search.PANEL, [search.open_panel(len(prover.names))])

    if todo:
        # a part may take minutes
        workers = min(dispatch.cpus(), len(todo))
        patience = dispatch.Patience(math.inf)
        # large parameters take longest
        dispatch.on_processes(prover, todo[::-1], finished, died, workers, patience)
    layouts, lists = zip(*(parts[number] for number in prover.numbers), strict=True)
    return "".join(layouts), [panel for some in lists for panel in some]


def _packed(part):
    return {"part": np.frombuffer(json.dumps(part).encode(), np.uint8)}


def _unpacked(arrays):
    return json.loads(arrays["part"].tobytes())


def certificate(title, prover, layout, panels):
    """The text of the certificate."""
    from survey.proof import checker

    sides = [tuple(Fraction(end) for end in side) for side in prover.rectangle]
    regions = checker.regions(sides, {"across": prover.across, "layout": layout})
    shares = dict.fromkeys(checker.VERDICTS, Fraction(0))
    for region, panel in zip(regions, panels, strict=True):
        for letter, part in checker.walk(panel["cells"], [region], checker.halved):
            shares[letter if letter in shares else checker.OPEN] += checker.size(
                part
            ) / checker.size(sides)
    table = {
        "format": checker.FORMAT, "title": title, "statement": [], "bits": prover.bits, "equation": prover.equation,
        "parameters": prover.names, "rectangle": prover.rectangle,
        "panels": {"across": prover.across, "layout": layout, "list": panels},
        "shares": {letter: str(share) for letter, share in shares.items()},
    }  # fmt: skip
    table["statement"] = checker.Certificate(_signed(table)).statement().split("\n")
    return _signed(table)


def _signed(table):
    from survey.proof import checker

    return json.dumps(table | {"sha256": checker.digest(table)}, indent=1) + "\n"


def _describe(workflow, path, text):
    """Variables and attributes."""
    from survey.proof import checker

    certificate = checker.Certificate(text)
    names = list(workflow.refine)
    parameters = [next(p for p in workflow.scene.PARAMETERS if p.name == name) for name in names]
    box = np.array(
        [[float(end) for side in region for end in side] for _, region in certificate.cells]
    )
    letters = certificate.letters
    variables = {}
    for at, p in enumerate(parameters):
        for side, end in enumerate(("low", "high")):
            meaning = {
                "long_name": f"{end} end of the cell in {p.long_name}",
                "units": p.units,
                "symbol": p.symbol,
            }
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
        f"{label}: {checker.between(100 * part, 100 * (part + left), 4).replace(' to ', ' % to ')} %"
        for label, part in zip(LABELS, least, strict=True)
    )
    about = {"refine": ", ".join(names), "areas": ", ".join(words)}
    return xr.Dataset(
        variables, coords, about | _about(certificate, path, text, "each decided cell")
    )


def _about(certificate, path, text, what):
    """The attributes of a proof."""
    return {
        "proof": f"{what} is proved in ball arithmetic", "proof_certificate": path.name,
        "proof_sha256": hashlib.sha256(text.encode()).hexdigest(), "proof_statement": certificate.statement(),
    }  # fmt: skip


def _describe_row(workflow, path, text):
    """Variables and attributes of the edges of a row."""
    from survey.proof import checker

    certificate = checker.Certificate(text)
    axis = workflow.boundaries
    cells = [
        (letter, *region[0]) for letter, region in certificate.cells if letter in checker.EDGES
    ]
    position = np.array([float((low + high) / 2) for _, low, high in cells])
    reach = [
        max(high - Fraction(x), Fraction(x) - low)
        for x, (_, low, high) in zip(position, cells, strict=True)
    ]
    error = round_up(np.array([float(x) for x in reach]) * (1 + 2**-50))
    classes = CLASSES[certificate.equation.kind]
    kind = np.array([classes[checker.EDGES.index(letter)][1] for letter, *_ in cells], np.int8)
    parameter = next(p for p in workflow.scene.PARAMETERS if p.name == axis)
    named = {"units": parameter.units, "symbol": parameter.symbol}
    complete = checker.OPEN not in certificate.letters
    variables = {
        "edge_count": ((), np.int32(len(cells)), {
            "long_name": "number of proved edges of tongues", "units": "1", "sample_dimension": "edge"}),
        "edge_complete": ((), np.int8(complete), {
            "long_name": "is it proved that these are all edges", "units": "1",
            **flag_attributes({"not_shown": 0, "complete": 1})}),
        "edge_position": ("edge", position, named | {
            "long_name": f"{parameter.long_name} at the edge of a tongue",
            "ancillary_variables": "edge_position_error"}),
        "edge_position_error": ("edge", error, named | {"long_name": "proved error bound of edge_position"}),
        "edge_class": ("edge", kind, {
            "long_name": "kind of the solution on the edge", "units": "1", **flag_attributes(dict(classes))}),
    }  # fmt: skip
    about = {"boundaries": axis, "edge_incomplete_rows": int(not complete)} | _about(
        certificate, path, text, "each edge, and that it is the only one there,"
    )
    return xr.Dataset(variables, attrs=about)


def _areas(sides, least, left, units):
    """The proved bounds of the area of each verdict, rounded outwards, and the values halfway
    between them.
    """
    variables = {}
    total = math.prod(high - low for low, high in sides)
    for name, scale, unit, words in (
        ("area", total, units, "area of the map with this verdict"),
        ("area_fraction", Fraction(1), "1", "share of the map's area with this verdict"),
    ):
        low = np.array([_rounded(scale * part, -math.inf) for part in least])
        high = np.array([_rounded(scale * (part + left), math.inf) for part in least])
        bar = round_up(0.5 * (high - low) + 2**-51 * high)
        about = {"units": unit, "ancillary_variables": f"{name}_error"}
        variables[name] = ("area_verdict", 0.5 * (low + high), {"long_name": words, **about})
        variables[f"{name}_error"] = (
            "area_verdict",
            bar,
            {"long_name": f"error bound of {name}", "units": unit},
        )
        for end, values, bound in (("low", low, "lower"), ("high", high, "upper")):
            meaning = {"long_name": f"proved {bound} bound of the {words}", "units": unit}
            variables[f"{name}_{end}"] = ("area_verdict", values, meaning)
    return variables


def _rounded(number, towards):
    """A rational number as a float on this side of it."""
    value = float(number)
    return value if Fraction(value) == number else math.nextafter(value, towards)
