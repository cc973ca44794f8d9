"""What `survey-check` proves, against mpmath, closed forms and other methods; and what it must refuse."""

import csv
import json
import os
import subprocess
import sys
from decimal import Decimal
from fractions import Fraction
from functools import cache
from math import floor
from pathlib import Path

import mpmath
import numpy as np
import pytest
import xarray as xr

pytest.importorskip("flint")

import danby_exact
from flint import arb, ctx

import survey
from survey.proof import checker, search
from survey.scenes import libration_elliptic, satellite
from survey.sweep import proofs

MATHIEU = ("even", [["pi/2", "a - 2*q*cos(2*u)"]], ["a", "q"])
MEISSNER = ("periodic", [["1", "a + b"], ["5/2", "a - b"]], ["a", "b"])
DANBY = (*(lambda kind, pieces: (kind, [list(piece) for piece in pieces]))(
    *libration_elliptic.equation({"mu": "mu", "e": "e"}, {}, {})), ["mu", "e"])  # fmt: skip
BODIES = [["0.1", "0.3"], ["0.9", "1.1"]]  # of the inertia ratio and the amplitude
SATELLITE = (*(lambda kind, pieces: (kind, [list(piece) for piece in pieces]))(*satellite.equation(
    {name: name for name in ("inertia_ratio", "amplitude")},
    {name: tuple(map(float, side)) for name, side in zip(("inertia_ratio", "amplitude"), BODIES, strict=True)},
    {"direction": 1})), ["inertia_ratio", "amplitude"])  # fmt: skip
SYSTEMS = {"mathieu": MATHIEU, "meissner": MEISSNER, "satellite": SATELLITE, "danby": DANBY}
RECTANGLE = [["1", "4"], ["0.5", "3"]]
STRIP = [["0.033", "0.041"], ["0.1", "0.104"]]  # of mu and e: A and KC cross it
RECTANGLES = {"mathieu": RECTANGLE, "meissner": RECTANGLE, "satellite": BODIES, "danby": STRIP}
SIDES = [tuple(map(Fraction, side)) for side in RECTANGLE]
DEPTH = 5


@pytest.fixture(autouse=True)
def _bits():
    ctx.prec = search.BITS


@cache
def proof(system="mathieu"):
    """The text of a certificate of this map, halved DEPTH times, or of this row."""
    if system == "row":
        kind, pieces, names, rectangle = "even", [["pi/2", "a - 10*cos(2*u)"]], ["a"], [["1", "3"]]
        depth, tolerance = 40, 1e-15
    else:
        kind, pieces, names = SYSTEMS[system]
        rectangle, depth, tolerance = RECTANGLES[system], DEPTH, 1e-6
    across, bits = [1] * len(names), 192 if system == "row" else search.BITS
    prover = proofs.Prover(
        {"kind": kind, "pieces": pieces}, names, rectangle, across, depth, tolerance, bits
    )
    return proofs.certificate("a test", prover, *prover(0)[1])


def signed(data):
    """The data with their digest."""
    return data | {"sha256": checker.digest(data)}


def true_factors(a, q):
    """The factors of Mathieu's equation at pi/2 to 25 digits, by DLMF 28.2's equation and mpmath's
    Taylor series.
    """
    with mpmath.workdps(25):
        solution = mpmath.odefun(
            lambda t, y: [y[1], -(a - 2 * q * mpmath.cos(2 * t)) * y[0], y[3], -(a - 2 * q * mpmath.cos(2 * t)) * y[2]],
            0, [1, 0, 0, 1],
        )  # fmt: skip
        return [+value for value in solution(mpmath.pi / 2)]


def inside(ball, value):
    """Does the ball contain the number of mpmath, which has 20 digits?"""
    return (ball - arb(mpmath.nstr(value, 25)) + arb(0, "1e-20")).contains(0)


def test_node_values_enclose_the_solutions():
    equation = checker.Equation(*MATHIEU)
    for a, q in ((1.5, 2.0), (12.0, -0.375)):
        truth = true_factors(mpmath.mpf(a), mpmath.mpf(q))
        point = {"a": arb(a), "q": arb(q)}
        for order in (12, 24):
            found = equation.factors(equation.steps(point, order), order, point)
            assert all(inside(ball, value) for ball, value in zip(found, truth, strict=True)), (
                a,
                q,
                order,
            )
            sharp = 200 * arb(checker.FAR).exp() * checker.RATIO ** (0.886 * order)
            assert all(ball.rad() < sharp for ball in found)


@pytest.mark.parametrize("mu, e", [("0.03", "0.4"), ("0.01", "0.9")])
def test_node_values_enclose_danbys_factors(mu, e):
    """Against Taylor series in mpmath that share nothing with the checker."""
    equation, point = checker.Equation(*DANBY), {"mu": arb(mu), "e": arb(e)}
    with mpmath.workdps(30):
        truth = danby_exact.factors(mpmath.mpf(mu), mpmath.mpf(e), 16, 50)
        t = truth["t"]
        truth = [+truth[name] for name in "ACDBt"] + [2 - t, truth["KC"]]
    found = equation.factors(equation.steps(point, 32), 32, point)
    assert all(inside(ball, value) for ball, value in zip(found, truth, strict=True))
    assert max(float(ball.rad()) for ball in found) < 1e-8


def test_steps_of_few_terms_say_so():
    """With few terms the sums leave out much: the balls must be wide, and still contain the truth."""
    equation, point = checker.Equation(*MATHIEU), {"a": arb(2), "q": arb(1)}
    found = equation.factors(equation.steps(point, 3), 3, point)
    assert all(inside(ball, value) for ball, value in zip(found, true_factors(2, 1), strict=True))
    assert max(float(ball.rad()) for ball in found) > 1e-4


def errors(number, system="mathieu", nodes=8):
    """(true interpolation error, bound) of the factors at random points of a panel."""
    equation, sides = (
        checker.Equation(*SYSTEMS[system]),
        [tuple(map(Fraction, side)) for side in RECTANGLES[system]],
    )
    plan = search.plan(equation, sides, 1e-6) | {"nodes": [nodes, nodes], "order": 32}
    panel = checker.Panel(equation, sides, plan)
    tables, bounds, _ = zip(*panel.factors, strict=True)
    rng, order = np.random.default_rng(1), 40
    box = {
        name: centre + half * arb(0, 1)
        for name, (centre, half) in zip(equation.names, panel.sides, strict=True)
    }
    steps = equation.steps(box, order)
    for x, y in rng.uniform(-1, 1, (number, 2)):
        place = [
            centre + half * arb(v) for (centre, half), v in zip(panel.sides, (x, y), strict=True)
        ]
        truth = equation.factors(steps, order, dict(zip(equation.names, place, strict=True)))
        rows = [checker.bernstein([arb(v)] + [arb(0)] * (nodes - 1)) for v in (x, y)]
        for table, exact, bound in zip(tables, truth, bounds, strict=True):
            yield abs((rows[0] * table * rows[1].transpose())[0, 0] - exact), bound


@pytest.mark.parametrize("number, system, nodes, least", [
    (40, "mathieu", 8, 1e-6),
    pytest.param(40, "meissner", 8, 1e-6, marks=pytest.mark.slow),
    pytest.param(40, "danby", 3, 1e-7, marks=pytest.mark.slow),
    *(pytest.param(1000, *what, marks=pytest.mark.slow) for what in (
        ("mathieu", 8, 1e-6), ("meissner", 8, 1e-6), ("satellite", 6, 1e-6), ("danby", 3, 1e-7))),
])  # fmt: skip
def test_the_truncation_bound_exceeds_the_true_error(number, system, nodes, least):
    ratios = [float(error / bound) for error, bound in errors(number, system, nodes)]
    assert max(ratios) < 1
    assert max(ratios) > least  # a bound too small by so much would fail above


@pytest.mark.parametrize(
    "arguments, wrong",
    [
        ((40,), 10**6),
        pytest.param((40, "meissner"), 10**6, marks=pytest.mark.slow),
        pytest.param((10, "satellite", 6), 10**6, marks=pytest.mark.slow),
        pytest.param((10, "danby", 6), 10**5, marks=pytest.mark.slow),
    ],
    ids=SYSTEMS,
)
def test_a_wrong_growth_is_found(arguments, wrong, monkeypatch):
    """Danby's factors are bounded by its second and fourth powers."""
    right = checker.growth
    monkeypatch.setattr(
        checker, "growth", lambda arc, w: [bound / wrong for bound in right(arc, w)]
    )
    assert any(error > bound for error, bound in errors(*arguments))


def slopes(nodes=8):
    """(true error of the interpolant's slope, bound) of the four factors at random points of a row."""
    ctx.prec = 256
    equation = checker.Equation("even", [["pi/2", "a - 10*cos(2*u)"]], ["a"])
    plan = search.plan(equation, SIDES[:1], 1e-6) | {"nodes": [nodes], "order": 70}
    panel = checker.Panel(equation, SIDES[:1], plan)
    (centre, half), h = panel.sides[0], arb(2) ** -40
    steps = equation.steps({"a": centre + half * arb(0, 1)}, 70)
    for x in map(arb, np.random.default_rng(1).uniform(-1, 1, 10)):
        ends = [equation.factors(steps, 70, {"a": centre + half * (x + d)}) for d in (-h, h)]
        rows = [checker.bernstein([x + d] + [arb(0)] * (nodes - 1)) for d in (-h, h)]
        for factor, (table, _, bound) in enumerate(panel.factors):
            values = [
                (row * table)[0, 0] - end[factor] for row, end in zip(rows, ends, strict=True)
            ]
            yield abs(values[1] - values[0]) / (2 * h), bound


def test_the_bound_of_slopes_exceeds_their_true_error():
    ratios = [float(error / bound) for error, bound in slopes()]
    assert 1e-6 < max(ratios) < 1


def test_a_row_is_proved():
    """Its edges are the characteristic values a_1(5) and b_2(5) of DLMF 28.6, here from Fourier
    matrices in mpmath.
    """
    statement = checker.check(proof("row"))
    assert "exactly 2 points" in statement and "0 open" in statement
    assert "1.85818754154" in statement and "2.09946044548" in statement


def test_a_certificate_is_proved():
    statement = checker.check(proof())
    assert "0 <= u <= pi/2" in statement and "1 <= a <= 4" in statement
    assert checker.Certificate(proof()).shares["o"] < 0.2


@pytest.mark.slow
def test_danbys_strip_is_proved():
    """Against the package's own kernels; the strip between A and KC, which is thinner than the
    cells, is seen.
    """
    statement = checker.check(proof("danby"))
    assert (
        "k22(u) = 1 - 3*(1 - sqrt(1 - 3*mu*(1 - mu)))/2*(1/(1 + e*cos(u)))" in statement
        and "L likewise" in statement
    )
    verdicts, mu, e = decided(proof("danby"), np.random.default_rng(4))
    ds = survey.evaluate(
        "libration_elliptic", mu=xr.DataArray(mu, dims="point"), e=xr.DataArray(e, dims="point")
    )
    assert (ds.verdict == verdicts).all()


def decided(text, rng):
    """(verdicts, first parameters, second parameters): a random point of each decided cell."""
    found = [
        (letter == "s", *(rng.uniform(float(low), float(high)) for low, high in place))
        for letter, place in checker.Certificate(text).cells
        if letter in "su"
    ]
    verdicts, first, second = (np.array(column) for column in zip(*found, strict=True))
    assert 0 < verdicts.sum() < len(verdicts)
    return verdicts, first, second


def test_no_cell_contradicts_the_map():
    """Against the package's own kernels, in binary64 with error bounds, which share nothing with
    the checker.
    """
    verdicts, a, q = decided(proof(), np.random.default_rng(2))
    ds = survey.evaluate(
        "mathieu", a=xr.DataArray(a, dims="point"), q=xr.DataArray(q, dims="point")
    )
    assert not (ds.verdict == ~verdicts).any()
    assert (ds.verdict == verdicts).mean() > 0.99


def test_a_piecewise_constant_z_that_is_not_even():
    """Against the closed form of Meissner's equation: D is a sum of cosines."""
    checker.check(proof("meissner"))
    verdicts, a, b = decided(proof("meissner"), np.random.default_rng(3))
    p, q = np.emath.sqrt(a + b), np.emath.sqrt(a - b)
    trace = 2 * np.cos(p) * np.cos(1.5 * q) - (p / q + q / p) * np.sin(p) * np.sin(1.5 * q)
    assert ((abs(trace) < 2) == verdicts).all()


RESULTS = Path(__file__).parents[2] / "results"


@pytest.mark.parametrize("name", ["mathieu_proved", "satellite_theorem_proved"])
def test_some_panels_of_the_published_certificates(name):
    certificate = checker.Certificate((RESULTS / f"{name}.cert").read_text())
    assert sum(certificate.shares.values()) == 1
    for number in (
        np.random.default_rng(5).choice(len(certificate.panels), 2, replace=False).tolist()
    ):
        certificate.panels[number].check()


@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(RESULTS.glob("*.cert")), ids=lambda path: path.stem)
def test_the_published_certificates(path):
    checker.check(path.read_text(), processes=2)


def test_the_theorem_that_the_documentation_prints():
    certificate = checker.Certificate((RESULTS / "satellite_theorem_proved.cert").read_text())
    assert certificate.shares["s"] == 1 and certificate.names == ["inertia_ratio", "amplitude"]
    assert certificate.sides == [(0, Fraction(1, 2)), (0, Fraction(4, 5))]


@pytest.mark.parametrize(
    "body, number, end", [("rod", 6, Fraction("1.56")), ("disc", 1, Fraction("1.5"))]
)
def test_the_critical_amplitudes_that_the_documentation_prints(body, number, end):
    """Every digit, in radians and degrees, follows from the certificate; and the table made by
    other methods agrees.
    """
    certificate = checker.Certificate((RESULTS / f"satellite_{body}_proved.cert").read_text())
    found = [(letter, *place[0]) for letter, place in certificate.cells if letter in checker.EDGES]
    assert len(found) == number and checker.OPEN not in certificate.letters
    assert certificate.sides == [(0, end)] and certificate.letters[0] == "s"
    page = (RESULTS.parent / "workflows" / "docs" / "proofs.md").read_text()
    ctx.prec = 128
    listed = csv.DictReader(
        (RESULTS / "satellite_critical_amplitudes.csv").read_text().splitlines()
    )
    listed = [row for row in listed if row["body"].endswith(body) and row["motion"] == "librations"]
    for (letter, low, high), row in zip(found, listed, strict=False):
        ball = checker.exact(low).union(checker.exact(high))
        radians, degrees = (
            nearest(x, digits) for x, digits in ((ball, 12), (ball * 180 / arb.pi(), 10))
        )
        assert (
            f" {radians} | {degrees} | " if body == "rod" else f"{radians} rad $= {degrees}^"
        ) in page
        error = Fraction(row["amplitude_error_rad"])
        assert low - error <= Fraction(row["amplitude_rad"]) <= high + error
        assert row["class"] == proofs.EVEN_CLASSES[checker.EDGES.index(letter)][0]


def nearest(ball, digits):
    """The decimals to which every number of the ball is rounded."""
    ends = {
        floor(Fraction(str(end.fmpq())) * 10**digits + Fraction(1, 2))
        for end in (ball.lower(), ball.upper())
    }
    assert len(ends) == 1
    return f"{Decimal(ends.pop()).scaleb(-digits):.{digits}f}"


def test_the_checker_needs_nothing_but_flint(tmp_path):
    """Copied elsewhere and run in isolation, it proves the same."""
    source = Path(checker.__file__).read_text()
    assert len(source.splitlines()) < 500
    assert "import survey" not in source and "from survey" not in source
    (tmp_path / "alone.py").write_text(source)
    (tmp_path / "map.cert").write_text(proof())
    ran = subprocess.run(
        [sys.executable, "-I", "alone.py", "map.cert", "-j", "2"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert ran.returncode == 0 and ran.stdout.startswith("PROVED\n"), ran


@pytest.mark.skipif(
    sys.platform == "win32", reason="a pipe without a reader is another error there"
)
def test_a_reader_may_leave(tmp_path):
    """As in survey-check OUT.cert | head -1: no traceback, and the certificate is proved."""
    (tmp_path / "map.cert").write_text(proof())
    read, write = os.pipe()
    os.close(read)
    command = [sys.executable, checker.__file__, tmp_path / "map.cert"]
    ran = subprocess.run(command, stdout=write, stderr=subprocess.PIPE, text=True)
    os.close(write)
    assert (ran.returncode, ran.stderr) == (0, "")


def flipped(letter, other, number=0):
    """A mutation: one cell with another letter."""

    def mutate(data):
        panel = max(data["panels"]["list"], key=lambda panel: panel["cells"].count(letter))
        at = [i for i, found in enumerate(panel["cells"]) if found == letter][number]
        panel["cells"] = panel["cells"][:at] + other + panel["cells"][at + 1 :]

    return mutate


def panels(**changes):
    """A mutation: every panel with other keys."""
    return lambda data: [panel.update(changes) for panel in data["panels"]["list"]]


def at(*path, value):
    """A mutation: one value replaced."""

    def mutate(data):
        for key in path[:-1]:
            data = data[key]
        data[path[-1]] = value

    return mutate


def formula(text):
    """A mutation: another z."""
    return at("equation", "pieces", value=[["pi/2", text]])


MUTATIONS = {
    "a stable cell is called unstable": flipped("s", "u"),
    "an unstable cell is called stable": flipped("u", "s"),
    "an open cell is called stable": flipped("o", "s"),
    "an open cell is called unstable": flipped("o", "u", -1),
    "a decided cell is called open": flipped("s", "o"),
    "a cell of an unknown kind": flipped("s", "x"),
    "a cell is missing": flipped("s", ""),
    "a cell too many": flipped("s", "ss"),
    "too few nodes": panels(nodes=[2, 2]),
    "an ellipse that is a segment": panels(ellipses=["1", "1"]),
    "ellipses so large that the factors grow": panels(ellipses=["1000000", "1000000"]),
    "a rate of zero": panels(rates=["0", "1"]),
    "a rate that is far off": panels(rates=["1000", "1000"]),
    "Taylor series of few terms": panels(order=2),
    "an order that is no number": panels(order="24"),
    "another sign of a": formula("-a - 2*q*cos(2*u)"),
    "another excitation": formula("a - 4*q*cos(2*u)"),
    "a singular z": formula("a - 2*q*cos(2*u) + 1/(u - 1)"),
    "a z with code": formula("a - 2*q*cos(2*u) + __import__('os').system('true')"),
    "a z with an attribute": formula("a.real - 2*q*cos(2*u)"),
    "another half period": at("equation", "pieces", value=[["3/2", "a - 2*q*cos(2*u)"]]),
    "a half period that is negative": at(
        "equation", "pieces", value=[["-pi/2", "a - 2*q*cos(2*u)"]]
    ),
    "another kind of z": at("equation", "kind", value="periodic"),
    "another rectangle": at("rectangle", value=[["1", "5"], ["1/2", "3"]]),
    "a rectangle without area": at("rectangle", value=[["1", "1"], ["1/2", "3"]]),
    "too few bits": at("bits", value=8),
    "another statement": at("statement", 0, value="Consider y'' = 0."),
    "no statement": lambda data: data.pop("statement"),
    "shares that are not those of the cells": at("shares", "s", value="1/2"),
    "an edge in a map": flipped("o", "1"),
    "panels that do not cover the rectangle": at("panels", "across", value=[1, 2]),
    "panels across three sides": at("panels", "across", value=[1, 1, 1]),
    "a rectangle with one side": at("rectangle", value=[["1", "4"]]),
    "a layout of another number of panels": at("panels", "layout", value="+...."),
    "a layout that ends early": at("panels", "layout", value="+"),
    "parameters of one name": at("parameters", value=["a", "a"]),
    "a parameter named like a function": at("parameters", value=["cos", "q"]),
    "no parameters": at("parameters", value=None),
    "another format": at("format", value="survey-certificate 9"),
    "no panels": at("panels", value={}),
}
STRIP_MUTATIONS = {
    "a stable cell is called unstable": flipped("s", "u"),
    "an unstable cell is called stable": flipped("u", "s"),
    "an open cell is called stable": flipped("o", "s"),
    "an open cell is called unstable": flipped("o", "u", -1),
    "too few nodes": panels(nodes=[3, 3]),
    "ellipses beyond e = 1": panels(ellipses=["2", "100"]),
    "a rate that is far off": panels(rates=["1000", "1000"]),
    "another entry": at("equation", "pieces", 0, 2, value="1"),
    "an entry is missing": lambda data: data["equation"]["pieces"][0].pop(),
    "a singular entry": at("equation", "pieces", 0, 3, value="1/(1 - cos(u))"),
    "Hill's equation": at("equation", "kind", value="even"),
    "another half period": at("equation", "pieces", 0, 0, value="3"),
}
ROW_MUTATIONS = {
    "an edge is called stable": flipped("1", "s"),
    "an edge is called unstable": flipped("1", "u"),
    "an edge of another factor": flipped("1", "2"),
    "an edge of a factor that there is not": flipped("1", "5"),
    "a stable cell is called an edge": flipped("s", "3"),
    "an unstable cell is called an edge": flipped("u", "1"),
    "an unstable cell is called stable": flipped("u", "s"),
    "an edge is missing": flipped("1", ""),
    "an edge too many": flipped("1", "11"),
    "an edge that is split": flipped("1", "+11"),
    "too few nodes": panels(nodes=[4]),
    "nodes of a map": panels(nodes=[8, 8]),
    "Taylor series of few terms": panels(order=8),
    "bits that are a text": at("bits", value="192"),
    "another excitation": formula("a - 9*cos(2*u)"),
    "another interval": at("rectangle", value=[["1", "4"]]),
    "two parameters": at("parameters", value=["a", "q"]),
    "two sides": at("rectangle", value=[["1", "3"], ["1", "3"]]),
}


OTHERS = (  # of those of Mathieu's equation, for a z of one's own and for satellites
    "a stable cell is called unstable", "an unstable cell is called stable", "an open cell is called stable",
    "an open cell is called unstable", "a decided cell is called open", "a cell is missing", "a cell too many",
    "too few nodes", "an ellipse that is a segment", "ellipses so large that the factors grow", "a rate of zero",
    "a rate that is far off", "Taylor series of few terms", "a half period that is negative", "too few bits",
    "shares that are not those of the cells", "an edge in a map", "panels that do not cover the rectangle",
    "a rectangle with one side", "a layout that ends early", "another format", "no panels",
)  # fmt: skip
ALL_MUTATIONS = {
    "mathieu": MUTATIONS, "danby": STRIP_MUTATIONS, "row": ROW_MUTATIONS,
    "meissner": {what: MUTATIONS[what] for what in OTHERS}, "satellite": {what: MUTATIONS[what] for what in OTHERS},
}  # fmt: skip
QUICK = {  # of those that take long
    "danby": set(),
    "satellite": set(),
    "meissner": {"a stable cell is called unstable", "too few nodes"},
    "mathieu": set(MUTATIONS) - {"ellipses so large that the factors grow"},
}


@pytest.mark.parametrize(
    "system, what",
    [
        pytest.param(system, what, marks=[pytest.mark.slow] * (what not in QUICK.get(system, own)))
        for system, own in ALL_MUTATIONS.items()
        for what in own
    ],
)
def test_a_mutated_certificate_is_refused(system, what, tmp_path, capsys):
    """Each mutation is signed again, so that it is refused for what it states."""
    data = json.loads(proof(system))
    ALL_MUTATIONS[system][what](data)
    path = tmp_path / "mutated.cert"
    path.write_text(json.dumps(signed(data)))
    assert checker.main([str(path)]) == 1
    said = capsys.readouterr()
    assert said.out.startswith("NOT PROVED") and said.out.count("\n") == 1 and not said.err


@pytest.mark.parametrize("cut", [10, 500, -3])
def test_a_truncated_or_changed_file_is_refused(cut, tmp_path, capsys):
    path = tmp_path / "cut.cert"
    path.write_text(proof()[:cut])
    assert checker.main([str(path)]) == 1
    path.write_text(proof().replace("a test", "A test"))
    assert checker.main([str(path)]) == 1
    assert "digest" in capsys.readouterr().out


@pytest.mark.parametrize("text", ["", "a +", "u if u else a", "[a]", "a**0.5", "a**b", "abs(a)", "sin(a, a)", "a @ b",
                                  "a // b", "+a", "~a", "a < b", "lambda: a", "'a'", "True", "1j", "x", "a and b",
                                  "sin(x=a)", "sin", "0x10", "(" * 300 + "a" + ")" * 300])  # fmt: skip
def test_formulas_hold_arithmetic_alone(text):
    with pytest.raises(checker.Failed):
        checker.Formula(text, ["u", "a", "b"])


def test_decimals_are_exact():
    tenth = checker.Formula("0.1 + 0.2 - 3e-1", [])()
    assert tenth.contains(0) and tenth.rad() < 1e-25
