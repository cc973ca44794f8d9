"""`survey prove`: the file, the certificate, and what is refused."""

import csv
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import mpmath
import numpy as np
import pytest
import xarray as xr

pytest.importorskip("flint")

import survey
from survey import cli
from survey.proof import checker
from survey.request.workflow import check
from survey.scenes import libration_elliptic
from survey.sweep import dispatch, proofs

MATHIEU = """
title = "a test"
scene = "mathieu"
[axes]
a = { start = 1.0, stop = 4.0, num = 24 }
q = { start = 0.5, stop = 3.0, num = 20 }
[output]
figures = ["verdict"]
[refine]
width = 0.05
"""
BODIES = {
    "prolate, librations": (
        "satellite",
        {"inertia_ratio": [0.1, 0.3], "amplitude": [0.9, 1.1]},
        {},
    ),
    "oblate, librations": ("satellite", {"inertia_ratio": [1.9, 2.0], "amplitude": [0.1, 0.4]}, {}),
    "rotations": ("satellite", {"inertia_ratio": [0.0, 0.1], "k": [1.2, 1.5]}, {"direction": "-1"}),
    "oblate, rotations": ("satellite", {"k": [1.2, 1.5], "rho": [0.6, 0.9]}, {"body": "oblate"}),
    "near k = 1, small": ("satellite", {"one_minus_k": [0.5, 0.7], "rho": [1.2, 1.6]}, {}),
}


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "map.toml").write_text(MATHIEU)
    return tmp_path


def run(*arguments):
    with pytest.raises(SystemExit) as ended:
        cli.main(list(arguments))
    return ended.value.code


def test_a_map_is_proved(here, capfd):
    assert run("prove", "map.toml", "-o", "map.nc") == 0
    assert "survey-check map.cert" in capfd.readouterr().err
    statement = checker.check((here / "map.cert").read_text())
    assert (
        run("info", "map.nc") == 0 and run("verify", "map.nc") == 0 and (here / "map.png").exists()
    )
    ds = xr.open_dataset("map.nc")
    assert ds.attrs["proof_statement"] == statement and ds.attrs["proof_certificate"] == "map.cert"
    widths = ds.cell_a_high - ds.cell_a_low, ds.cell_q_high - ds.cell_q_low
    area = widths[0] * widths[1]
    assert abs(float(area.sum()) - 7.5) < 1e-12
    shares = checker.Certificate((here / "map.cert").read_text()).shares
    for code, (letter, word) in enumerate((("u", "unstable"), ("s", "stable"))):
        exact = shares[letter] * Fraction(15, 2)
        assert abs(float(area[ds.cell_verdict == code].sum()) - float(exact)) < 1e-12
        own = ds.isel(area_verdict=code)
        assert Fraction(float(own.area_low)) <= exact
        assert Fraction(float(own.area_high)) >= exact + shares["o"] * Fraction(15, 2)
        assert f"The {word} points have an area of" in statement


OWN = (
    "from math import cos, exp\nPARAMETERS = ('a', 'q')\nPERIOD = 2.0\nEVEN = True\n"
    "def z(u, p):\n    return p[0] + p[1] * exp(cos(3.141592653589793 * u))\n"
)
MAPS = {  # scene: its axes
    "mathieu": {"a": (1.0, 4.0), "q": (0.5, 3.0)},
    "own.py": {"a": (1.0, 4.0), "q": (0.5, 3.0)},
    "satellite": {"inertia_ratio": (0.1, 0.3), "amplitude": (0.9, 1.1)},
    "libration_elliptic": {"mu": (0.0, 0.05), "e": (0.0, 0.2)},
}


@pytest.mark.slow
@pytest.mark.parametrize("scene", MAPS)
def test_refine_agrees(scene, here):
    """The cells of `survey run` have no other verdict, and its areas lie within the proved bounds."""
    axes = "".join(
        f"{name} = {{ start = {low}, stop = {high}, num = 20 }}\n"
        for name, (low, high) in MAPS[scene].items()
    )
    (here / "map.toml").write_text(f'scene = "{scene}"\n[axes]\n{axes}[refine]\nwidth = 0.05\n')
    (here / "own.py").write_text(OWN)
    assert run("prove", "map.toml", "-o", "proved.nc", "--quiet") == 0
    assert run("run", "map.toml", "-o", "map.nc", "--quiet") == 0
    proved, ds = xr.open_dataset("proved.nc"), xr.open_dataset("map.nc")
    assert {0, 1} <= set(proved.cell_verdict.values.tolist())
    slack = ds.area_error.values
    assert (ds.area.values + slack >= proved.area_low.values).all()
    assert (ds.area.values - slack <= proved.area_high.values).all()
    names = proved.attrs["refine"].split(", ")
    middle = [
        0.5 * (proved[f"cell_{name}_low"] + proved[f"cell_{name}_high"]).values for name in names
    ]
    ends = [ds[f"cell_{name}_{end}"].values for name in names for end in ("low", "high")]
    for low_x, high_x, low_y, high_y, verdict in zip(*ends, ds.cell_verdict.values, strict=True):
        inside = (
            (low_x < middle[0]) & (middle[0] < high_x) & (low_y < middle[1]) & (middle[1] < high_y)
        )
        assert not (proved.cell_verdict.values[inside] == 1 - verdict).any() or verdict == -1


def prover(scene, axes, options):
    """The Prover of a map of two axes, in one part."""
    table = {
        "scene": scene, "options": options, "refine": {"width": 0.0625},
        "axes": {name: {"start": ends[0], "stop": ends[1], "num": 5} for name, ends in axes.items()},
    }  # fmt: skip
    made = proofs.prover_of(check(table, proves=True))
    made.across, made.depth = [1, 1], 4
    return made


def row(scene, axis, ends, fixed=(), options=(), parts=1):
    """The certificate of the edges along an axis, in so many parts."""
    table = {
        "scene": scene, "options": dict(options), "boundaries": {},
        "axes": {axis: {"start": ends[0], "stop": ends[1], "num": 5}} | dict(fixed),
    }  # fmt: skip
    made = proofs.prover_of(check(table, proves=True))
    made.depth += 3
    made.across, made.depth = [parts], made.depth - int(np.log2(parts))
    layouts, lists = zip(*(made(number)[1] for number in made.numbers), strict=True)
    return proofs.certificate(
        "a test", made, "".join(layouts), [panel for some in lists for panel in some]
    )


def edges_of(text):
    """[(low, high, letter)] of the edges that are proved; no cell may be open."""
    certificate = checker.Certificate(text)
    assert (
        checker.OPEN not in certificate.letters and checker.check(text) == certificate.statement()
    )
    return [(*place[0], letter) for letter, place in certificate.cells if letter in checker.EDGES]


@pytest.mark.parametrize(
    "body",
    [
        pytest.param(body, marks=[pytest.mark.slow] * (body != "oblate, librations"))
        for body in BODIES
    ],
)
def test_satellites_agree_with_the_map(body):
    """The elementary form of the equation gives the verdicts of the elliptic one, in decided cells."""
    scene, axes, options = BODIES[body]
    made = prover(scene, axes, options)
    _, (layout, panels) = made(0)
    sides = [[Fraction(end) for end in side] for side in made.rectangle]
    found = []
    for place, panel in zip(
        checker.regions(sides, {"across": [1, 1], "layout": layout}), panels, strict=True
    ):
        cells = checker.walk(panel["cells"], [place], checker.halved)
        found += [
            (*(float(sum(side) / 2) for side in part), letter)
            for letter, part in cells
            if letter != "o"
        ]
    first, second, letters = zip(*found, strict=True)
    points = {
        name: xr.DataArray(np.array(x), dims="cell")
        for name, x in zip(axes, (first, second), strict=True)
    }
    ds = survey.evaluate(scene, **points, **options)
    assert (ds.verdict.values == np.where(np.array(letters) == "s", 1, 0)).all()


def test_an_own_equation_in_pieces_is_proved(here):
    (here / "own.py").write_text(
        "from math import cos\nPARAMETERS = ('a', 'b')\nPERIOD = 2.0\nEVEN = False\nBREAKS = (0.0, 0.75)\n"
        "def z(u, p):\n    return p[0] + p[1] * cos(3 * u) if u < 0.75 else p[0] - p[1]\n"
    )
    made = prover("own.py", {"a": [0.5, 3.0], "b": [0.1, 2.0]}, {})
    assert [end for end, _ in made.equation["pieces"]] == ["0.75", "2.0"] and made.equation[
        "kind"
    ] == "periodic"
    _, (_, panels) = made(0)
    assert {letter for panel in panels for letter in panel["cells"]} >= {"s", "u"}


def mathieu_edges(q, order=40):
    """Edges of Mathieu's equation by letter, to 30 digits: eigenvalues of Fourier matrices (DLMF 28.4)."""
    found = {}
    with mpmath.workdps(40):
        for letter, first, start in (("2", 0, 0), ("1", 1, 1), ("4", 1, -1), ("3", 2, 0)):
            diagonal = [mpmath.mpf(first + 2 * k) ** 2 for k in range(order)]
            diagonal[0] += start * q
            table = mpmath.diag(diagonal)
            for k in range(order - 1):
                table[k, k + 1] = table[k + 1, k] = q * (
                    mpmath.sqrt(2) if (letter, k) == ("2", 0) else 1
                )
            for value in mpmath.eigsy(table, eigvals_only=True)[: order // 2]:
                found[Fraction(mpmath.nstr(value, 30))] = letter
    return found


def test_the_edges_of_a_row_are_those_of_mathieu():
    proved = edges_of(row("mathieu", "a", [-6.5, 8.5], {"q": 5.0}, parts=2))
    truth = sorted(item for item in mathieu_edges(5).items() if -6.5 < item[0] < 8.5)
    assert len(proved) == len(truth) == 5
    for (low, high, letter), (value, expected) in zip(proved, truth, strict=True):
        assert low < value < high and high - low <= 1e-13 and letter == expected


def test_the_edges_of_a_row_are_those_of_meissner(here):
    """Not even, in pieces, with a third parameter that is fixed; against the zeros of the closed
    form of D.
    """
    (here / "own.py").write_text(
        "PARAMETERS = ('a', 'b', 'c')\nPERIOD = 2.5\nEVEN = False\nBREAKS = (0.0, 1.0)\n"
        "def z(u, p):\n    return p[0] + p[1] if u < 1.0 else p[0] - p[2]\n"
    )
    proved = edges_of(row("own.py", "a", [1.5, 7.0], {"b": 1.25, "c": 0.75}))

    def trace(a):
        p, q = mpmath.sqrt(a + 1.25), mpmath.sqrt(a - 0.75)
        return 2 * mpmath.cos(p) * mpmath.cos(1.5 * q) - (p / q + q / p) * mpmath.sin(
            p
        ) * mpmath.sin(1.5 * q)

    with mpmath.workdps(30):
        grid = [mpmath.mpf(1.5) + mpmath.mpf(k) / 64 for k in range(353)]
        truth = sorted(
            (
                Fraction(
                    mpmath.nstr(
                        mpmath.findroot(lambda a, v=v: trace(a) - v, pair, solver="anderson"), 25
                    )
                ),
                letter,
            )
            for letter, v in (("1", 2), ("2", -2))
            for pair in pairwise(grid)
            if (trace(pair[0]) - v) * (trace(pair[1]) - v) < 0
        )
    assert len(proved) == len(truth) > 1
    for (low, high, letter), (value, expected) in zip(proved, truth, strict=True):
        assert low < value < high and high - low <= 1e-13 and letter == expected


@pytest.mark.parametrize("axis, ends, fixed, options, number", [
    pytest.param("amplitude", [0.5, 0.9], {"inertia_ratio": 0.6}, {}, 2, marks=pytest.mark.slow),
    pytest.param("k", [1.3, 1.36], {"rho": 1.0}, {}, 2, marks=pytest.mark.slow),
    pytest.param("k", [1.2, 1.25], {"inertia_ratio": 0.2}, {"direction": "-1"}, 1, marks=pytest.mark.slow),
    # one at rho = 0, where the body is a sphere
    pytest.param("rho", [-0.4, 0.45], {"k": 1.3}, {"body": "oblate"}, 3, marks=pytest.mark.slow),
], ids=["libration", "rotation", "backward", "oblate"])  # fmt: skip
def test_the_edges_of_a_row_of_satellites(axis, ends, fixed, options, number):
    """Against the Fourier series of `survey.edge`, which knows nothing of formulas in the angle."""
    proved = edges_of(row("satellite", axis, ends, fixed, options))
    assert len(proved) == number
    for low, high, _ in proved:
        ds = survey.edge("satellite", along=axis, near=float(low + high) / 2, **fixed, **options)
        found = zip(ds.edge.values.tolist(), ds.edge_error.values.tolist(), strict=True)
        reach = [
            (Fraction(edge) - Fraction(error), Fraction(edge) + Fraction(error))
            for edge, error in found
        ]
        assert sum(first <= high and low <= last for first, last in reach) == 1
        assert all(
            any(a <= y and x <= b for a, b, _ in proved)
            for x, y in reach
            if ends[0] < x and y < ends[1]
        )


@pytest.mark.slow
def test_the_edges_of_a_row_of_danbys_map():
    """B, A and KC at e = 0.2, against the table made by another method."""
    table = Path(__file__).parents[2] / "results" / "libration_elliptic_boundaries.csv"
    listed = [row for row in csv.DictReader(table.read_text().splitlines()) if row["e"] == "0.2"]
    text = row("libration_elliptic", "mu", [0.015, 0.0425], {"e": 0.2})
    proved, statement = edges_of(text), checker.check(text)
    assert (
        "exactly 3 points" in statement and "det Y2 at pi is 0 once, unstable after it" in statement
    )
    assert [proofs.REVERSIBLE_CLASSES[checker.EDGES.index(letter)][0] for *_, letter in proved] == [
        "B",
        "A",
        "KC",
    ]
    for (low, high, _), name in zip(proved, ("B", "A", "KC"), strict=True):
        [own] = [row for row in listed if row["curve"] == name]
        mu, error = Fraction(own["mu"]), Fraction(own["mu_error"])
        assert low - error <= mu <= high + error and high - low <= 1e-13


def test_the_edges_of_a_row_by_command(here, capfd):
    (here / "row.toml").write_text(
        'scene = "mathieu"\n[axes]\na = { start = 1.0, stop = 4.5, num = 8 }\nq = 1.5\n[boundaries]\n'
    )
    assert (
        run("prove", "row.toml", "-o", "row.nc") == 0
        and "survey-check row.cert" in capfd.readouterr().err
    )
    assert run("verify", "row.nc") == 0 and run("info", "row.nc") == 0
    ds = xr.open_dataset("row.nc")
    statement = checker.check((here / "row.cert").read_text())
    assert ds.attrs["proof_statement"] == statement and "exactly 2 points" in statement
    truth = sorted(value for value in mathieu_edges(mpmath.mpf(1.5)) if 1 < value < 4.5)
    assert ds.edge_complete == 1 and ds.edge_count == ds.edge.size == len(truth)
    for edge, error, value in zip(
        ds.edge_position.values, ds.edge_position_error.values, truth, strict=True
    ):
        assert abs(Fraction(float(edge)) - value) <= Fraction(float(error)) and error < 1e-13
    assert run("run", "row.toml", "-o", "run.nc", "--quiet") == 0
    found = xr.open_dataset("run.nc")
    names = [
        dict(zip(x.edge_class.flag_values, x.edge_class.flag_meanings.split(), strict=True))
        for x in (ds, found)
    ]
    classes = [
        [own[c] for c in x.edge_class.values] for own, x in zip(names, (ds, found), strict=True)
    ]
    assert classes[0] == classes[1]


def test_what_a_row_does_not_prove_is_open():
    """At q = 0 all gaps are closed: two factors vanish in one point, which no sign shows."""
    text = row("mathieu", "a", [0.5, 1.5], {"q": 0.0})
    assert "at least 0 points" in checker.check(text)
    with pytest.raises(AssertionError):
        edges_of(text)


def test_cells_on_a_logarithmic_axis_are_as_narrow_as_requested():
    """A width of 0.1 is a tenth of the value; at q = 0.5, the least, 0.05."""
    axes = {
        "a": {"start": 1.0, "stop": 2.0, "num": 3},
        "q": {"start": 0.5, "stop": 8.0, "num": 3, "spacing": "log"},
    }
    made = proofs.prover_of(
        check({"scene": "mathieu", "axes": axes, "refine": {"width": {"a": 0.5, "q": 0.1}}})
    )
    # 7.5 / 0.05 = 150
    assert made.across[1] * 2**made.depth == 256 and made.across[0] * 2**made.depth == 2


@pytest.mark.parametrize("change, words", [
    ({"refine": None}, "add [refine]"),
    ({"refine": None, "boundaries": {}}, "give all but one as bare numbers"),
    ({"scene": "satellite", "axes": {"k": [0.5, 1.5], "rho": [1.0, 2.0]}}, "separatrix"),
    ({"scene": "satellite", "axes": {"amplitude": [0.5, 1.5], "inertia_ratio": [0.5, 1.5]}}, "contains 1"),
    ({"scene": "satellite_triaxial", "axes": {"yaw_ratio": [-0.5, 0.5], "roll_ratio": [-0.5, 0.5], "amplitude": [0.5]}},
     "satellite_triaxial has no formulas to prove; choose mathieu"),
])  # fmt: skip
def test_what_cannot_be_proved_is_refused_in_one_line(change, words):
    table = {
        "scene": "mathieu",
        "axes": {"a": [0.0, 1.0], "q": [0.0, 1.0]},
        "refine": {"width": 0.1},
    } | change
    table["axes"] = {
        name: {"values": ends} if ends[1:] else ends[0] for name, ends in table["axes"].items()
    }
    with pytest.raises(survey.BadInput) as error:
        proofs.equation_of(
            check({key: value for key, value in table.items() if value is not None}, proves=True)
        )
    assert words in str(error.value) and "\n" not in str(error.value)


def test_a_scene_without_formulas_is_refused_in_one_line(monkeypatch):
    monkeypatch.delattr(libration_elliptic, "equation")
    with pytest.raises(survey.BadInput, match="no formulas to prove; choose mathieu"):
        prover("libration_elliptic", {"mu": [0.01, 0.02], "e": [0.0, 0.1]}, {})


def test_without_flint_one_line_says_what_to_install(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "flint", None)
    with pytest.raises(survey.BadInput, match="pip install"):
        proofs.equation_of(check({"scene": "mathieu", "axes": {"a": 1.0, "q": 1.0}}))


def test_parts_that_are_kept_are_not_proved_again(monkeypatch):
    made = prover("mathieu", {"a": [1.0, 4.0], "q": [0.5, 3.0]}, {})
    kept, calls = {}, []

    def once(name, make):
        if name not in kept:
            kept[name] = make()
        return kept[name]

    def on_processes(task, numbers, finished, died, workers, patience):
        calls.append(list(numbers))
        for done, number in enumerate(numbers, 1):
            finished(done, task(number))

    monkeypatch.setattr(dispatch, "on_processes", on_processes)
    assert proofs.solved(made, once) == proofs.solved(made, once)
    assert calls == [[0]]


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["mathieu_proved", "satellite_proved", "libration_elliptic_proved"]
)
def test_the_areas_of_refine_lie_within_the_published_bounds(name, tmp_path):
    root = Path(__file__).parents[2]
    shares = checker.Certificate((root / "results" / f"{name}.cert").read_text()).shares
    ds = survey.run(root / "workflows" / f"{name}.toml", output=tmp_path / "map.nc")
    for code, letter in enumerate("us"):
        share, error = (float(x.values[code]) for x in (ds.area_fraction, ds.area_fraction_error))
        assert shares[letter] <= share + error and share - error <= shares[letter] + shares["o"]
