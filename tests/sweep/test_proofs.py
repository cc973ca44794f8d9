"""`survey prove`: the file, the certificate, and what is refused."""

import json
from fractions import Fraction

import numpy as np
import pytest
import xarray as xr

pytest.importorskip("flint")

import survey
from survey import cli
from survey.proof import checker
from survey.request.workflow import check
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
    "prolate, librations": ("satellite", {"inertia_ratio": [0.1, 0.3], "amplitude": [0.9, 1.1]}, {}),
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
    assert run("info", "map.nc") == 0 and run("verify", "map.nc") == 0 and (here / "map.png").exists()
    ds = xr.open_dataset("map.nc")
    assert ds.attrs["proof_statement"] == statement and ds.attrs["proof_certificate"] == "map.cert"
    widths = ds.cell_a_high - ds.cell_a_low, ds.cell_q_high - ds.cell_q_low
    area = widths[0] * widths[1]
    assert abs(float(area.sum()) - 7.5) < 1e-12
    shares = json.loads((here / "map.cert").read_text())["shares"]
    for code, (letter, word) in enumerate((("u", "unstable"), ("s", "stable"))):
        exact = Fraction(shares[letter]) * Fraction(15, 2)
        assert abs(float(area[ds.cell_verdict == code].sum()) - float(exact)) < 1e-12
        own = ds.isel(area_verdict=code)
        assert Fraction(float(own.area_low)) <= exact
        assert Fraction(float(own.area_high)) >= exact + Fraction(shares["o"]) * Fraction(15, 2)
        assert f"The {word} points have an area of" in statement


def test_refine_agrees(here):
    """The cells of `survey run` have no other verdict, and its areas lie within the proved bounds."""
    assert run("prove", "map.toml", "-o", "proved.nc", "--quiet") == 0
    assert run("run", "map.toml", "-o", "map.nc", "--quiet") == 0
    proved, ds = xr.open_dataset("proved.nc"), xr.open_dataset("map.nc")
    slack = ds.area_error.values
    assert (ds.area.values + slack >= proved.area_low.values).all()
    assert (ds.area.values - slack <= proved.area_high.values).all()
    middle = [0.5 * (proved[f"cell_{name}_low"] + proved[f"cell_{name}_high"]).values for name in "aq"]
    ends = [ds[f"cell_{name}_{end}"].values for name in "aq" for end in ("low", "high")]
    for low_a, high_a, low_q, high_q, verdict in zip(*ends, ds.cell_verdict.values, strict=True):
        inside = (low_a < middle[0]) & (middle[0] < high_a) & (low_q < middle[1]) & (middle[1] < high_q)
        assert not (proved.cell_verdict.values[inside] == 1 - verdict).any() or verdict == -1


def prover(scene, axes, options, width=0.125):
    """The Prover of a map of two axes."""
    table = {
        "scene": scene, "options": options, "refine": {"width": width},
        "axes": {name: {"start": ends[0], "stop": ends[1], "num": 5} for name, ends in axes.items()},
    }  # fmt: skip
    workflow = check(table, proves=True)
    kind, pieces, names, rectangle = proofs.equation_of(workflow)
    return proofs.Prover({"kind": kind, "pieces": pieces}, names, rectangle, [1, 1], 4, 1e-4)


@pytest.mark.parametrize("body", BODIES)
def test_satellites_agree_with_the_map(body):
    """The elementary form of the equation gives the verdicts of the elliptic one, in decided cells."""
    scene, axes, options = BODIES[body]
    made = prover(scene, axes, options)
    _, (layout, panels) = made(0)
    sides = [[Fraction(end) for end in side] for side in made.rectangle]
    found = []
    for place, panel in zip(checker.places([1, 1], layout), panels, strict=True):
        boxes, letters = proofs.boxes(checker.within(sides, place), panel)
        centres = zip(0.5 * (boxes[:, 0] + boxes[:, 1]), 0.5 * (boxes[:, 2] + boxes[:, 3]), letters, strict=True)
        found += [centre for centre in centres if centre[2] != "o"]
    first, second, letters = zip(*found, strict=True)
    points = {name: xr.DataArray(np.array(x), dims="cell") for name, x in zip(axes, (first, second), strict=True)}
    ds = survey.evaluate(scene, **points, **options)
    assert (ds.verdict.values == np.where(np.array(letters) == "s", 1, 0)).all()


def test_an_own_equation_in_pieces_is_proved(here):
    (here / "own.py").write_text(
        "from math import cos\nPARAMETERS = ('a', 'b')\nPERIOD = 2.0\nEVEN = False\nBREAKS = (0.0, 0.75)\n"
        "def z(u, p):\n    return p[0] + p[1] * cos(3 * u) if u < 0.75 else p[0] - p[1]\n"
    )
    made = prover("own.py", {"a": [0.5, 3.0], "b": [0.1, 2.0]}, {})
    assert [end for end, _ in made.equation["pieces"]] == ["0.75", "2.0"] and made.equation["kind"] == "periodic"
    _, (_, panels) = made(0)
    assert {letter for panel in panels for letter in panel["cells"]} >= {"s", "u"}


@pytest.mark.parametrize("change, words", [
    ({"refine": None}, "add [refine]"),
    ({"scene": "libration_elliptic", "axes": {"mu": [0.01, 0.02], "e": [0.0, 0.1]}}, "no formulas to prove"),
    ({"scene": "satellite", "axes": {"k": [0.5, 1.5], "rho": [1.0, 2.0]}}, "separatrix"),
    ({"scene": "satellite", "axes": {"amplitude": [0.5, 1.5], "inertia_ratio": [0.5, 1.5]}}, "contains 1"),
])  # fmt: skip
def test_what_cannot_be_proved_is_refused_in_one_line(change, words):
    table = {"scene": "mathieu", "axes": {"a": [0.0, 1.0], "q": [0.0, 1.0]}, "refine": {"width": 0.1}} | change
    table["axes"] = {name: {"values": ends} for name, ends in table["axes"].items()}
    with pytest.raises(survey.BadInput) as error:
        proofs.equation_of(check({key: value for key, value in table.items() if value is not None}, proves=True))
    assert words in str(error.value) and "\n" not in str(error.value)


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
