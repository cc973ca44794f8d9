"""Extending a survey: points that an earlier file holds are taken from it, with the bits of a run
without it.
"""

import re

import numpy as np
import pytest
import xarray as xr

import survey
from survey.analysis import join
from survey.errors import BadInput
from survey.request import earlier, workflow
from survey.sweep import cost, engine, solve

BRUN = """
scene = "brun"
[options]
sign = "1"
[axes]
l = { values = [0.5, 0.7, 0.9, 1.2] }
alpha = { start = -0.5, stop = 0.5, num = 5 }
beta = 0.1
ratio = 1.3
[solver]
rtol = 1e-9
"""


@pytest.fixture
def brun(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "brun.toml").write_text(BRUN)
    survey.run("brun.toml", output="old.nc")
    return tmp_path / "brun.toml"


@pytest.mark.parametrize(
    ("overrides", "points"),
    [
        (["axes.alpha={ start = -0.5, stop = 0.5, num = 9 }"], 20),  # finer
        (["axes.alpha={ start = -0.5, stop = 1.0, num = 7 }"], 20),  # longer
        (["axes.alpha=0.25"], 4),  # a row
        (["axes.beta={ values = [0.0, 0.1, 0.3] }"], 20),  # one dimension more
        (["axes.l={ values = [1.2, 1.0, 0.7] }"], 10),  # the other way round
        (["output.variables=['period', 'verdict']"], 20),  # fewer variables
    ],
)
@pytest.mark.parametrize("block", [7, pytest.param(10**6, marks=pytest.mark.slow)])
def test_what_is_held_is_not_solved_and_the_bits_are_the_same(
    brun, monkeypatch, overrides, points, block
):
    monkeypatch.setattr(cost, "BLOCK_POINTS", block)
    sizes, solved = [], solve.solve_point

    def counting(*given):
        sizes.append(int(np.prod(given[3])))
        return solved(*given)

    checked = workflow.read(brun, overrides, "new.nc")
    held, told = earlier.find(checked, "old.nc")
    with monkeypatch.context() as patch:
        patch.setattr(solve, "solve_point", counting)
        engine.run(checked, earlier=held)
    assert f"{points} of {checked.grid.points} points are taken from this file" in told
    assert sum(sizes) == checked.grid.points - points and held.points == points
    engine.run(workflow.read(brun, overrides, "own.nc"))
    new, own = survey.open("new.nc"), survey.open("own.nc")
    assert (
        new.attrs["points_reused"] == points
        and new.attrs["fingerprint"] == own.attrs["fingerprint"]
    )
    xr.testing.assert_equal(new.drop_attrs(), own.drop_attrs())


@pytest.mark.parametrize(
    ("override", "why"),
    [
        ("solver.rtol=1e-6", "its rtol is 1e-09, not 1e-06"),
        ("options.sign='-1'", "its option sign is 1, not -1"),
        ("axes.alpha=0.3", "no value of alpha that is needed here"),
    ],
)
def test_the_reason_is_given_where_nothing_is_taken(brun, override, why):
    held, told = earlier.find(workflow.read(brun, [override], "new.nc"), "old.nc")
    assert held is None and re.search(why, told)
    over_it = workflow.read(brun, [override], "old.nc")
    with pytest.raises(
        BadInput, match=f"{why}.*; write to another file with -o, or replace it with --fresh"
    ):
        earlier.find(over_it, "old.nc")
    assert earlier.find(over_it, "old.nc", fresh=True) == (None, told)


def test_files_of_no_one_run_say_so(brun):
    base = {"scene": "brun", "options": {"sign": 1, "ratio": 0.5}}
    axes = {"l": 1.0, "beta": 0.1, "alpha": {"values": [0.1, 0.2]}}
    for name, beta in (("one", 0.1), ("other", 0.2)):
        survey.run(base | {"axes": axes | {"beta": beta}}, output=f"{name}.nc")
    join.merge(["one.nc", "other.nc"], "both.nc")
    again = workflow.check(base | {"axes": axes}, output="new.nc")
    assert "several surveys were joined in it" in earlier.find(again, "both.nc")[1]
    points = [
        survey.evaluate("brun", l=1.0, beta=b, alpha=[0.1], sign="1", ratio=0.5) for b in (0.1, 0.2)
    ]
    for ds in (points[0], survey.concat(points)):
        ds.to_netcdf("points.nc")
        assert "it holds no workflow" in earlier.find(again, "points.nc")[1]


def test_a_map_whose_series_take_the_whole_axis_is_solved_anew(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    axes = {
        "k": {"start": 0.1, "stop": 0.9, "num": 30},
        "rho": {"start": 1.0, "stop": 3.0, "num": 40},
    }
    survey.run({"scene": "satellite", "axes": axes}, output="old.nc")
    axes["rho"] = {"start": 1.0, "stop": 4.0, "num": 60}
    longer = workflow.check({"scene": "satellite", "axes": axes}, output="new.nc")
    held, told = earlier.find(longer, "old.nc")
    assert held is None and "nothing is taken from this file: " in told
    assert (
        "on a map, its values depend on all of the axis rho" in told
        or "would have different bits on this map" in told
    )


@pytest.mark.slow
def test_fates_of_few_systems_are_not_taken_for_a_map_of_many(tmp_path, monkeypatch):
    """Maps of 1,000 starts find the curves between basins for as many as 8 systems: 9 have other bits."""
    monkeypatch.chdir(tmp_path)
    axes = {
        name: {"start": -3.0, "stop": 3.0, "num": number}
        for name, number in (("phi0", 40), ("w0", 25))
    }
    axes |= {
        "b12": {"start": 0.3, "stop": 0.7, "num": 2},
        "b31": -0.4,
        "d": 1.1,
        "c23": 0.3,
        "s2": 0.5,
        "s3": -0.2,
    }
    table = {
        "scene": "gyrostat",
        "options": {"question": "fate"},
        "axes": axes,
        "output": {"path": "old.nc"},
    }
    survey.run(table)
    wider = table | {"axes": axes | {"b12": {"start": 0.3, "stop": 0.7, "num": 9}}}
    held, told = earlier.find(workflow.check(wider, output="new.nc"), "old.nc")
    assert held is None and "depend on all of the axis b12, which differs" in told
    assert earlier.find(workflow.check(table, output="new.nc"), "old.nc")[0].points == 2000


def test_points_of_your_own_equation_are_taken_over_until_its_text_changes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = "PARAMETERS, PERIOD, EVEN = ('a', 'q'), 3.141592653589793, False\n"
    text += "from math import cos, sin\ndef z(u, p):\n    return p[0] - p[1] * (cos(2 * u) + sin(4 * u))\n"
    (tmp_path / "own.py").write_text(text)
    given = {"scene": "own.py", "axes": {"a": {"values": [0.5, 1.5]}, "q": {"values": [0.1, 0.4]}}}
    survey.run(given, output="old.nc")
    given["output"] = {"variables": ["verdict"]}
    held, told = earlier.find(workflow.check(given, output="new.nc"), "old.nc")
    assert held.points == 4, told
    (tmp_path / "own.py").write_text(text.replace("sin(4", "sin(6"))
    held, told = earlier.find(workflow.check(given, output="new.nc"), "old.nc")
    assert held is None and "a different text of your own scene" in told


def test_a_trajectory_needs_the_same_times(ran, small, monkeypatch):
    monkeypatch.chdir(ran.parent)
    more = workflow.read(small, ["axes.w0.num=11"], "new.nc")
    held, told = earlier.find(more, ran)
    assert held.points == 24 and "24 of 44 points" in told
    engine.run(more, workers=2, earlier=held)
    engine.run(workflow.read(small, ["axes.w0.num=11"], "own.nc"))
    xr.testing.assert_equal(survey.open("new.nc").drop_attrs(), survey.open("own.nc").drop_attrs())
    held, told = earlier.find(workflow.read(small, ["axes.t.num=7"], "new.nc"), ran)
    assert held is None and "one solution serves the whole axis t" in told


def test_the_command_extends_a_file_in_place(ran, small, program):
    words = ("run", small, "--set", "axes.w0.num=11")
    refused = program(*words)
    assert refused.returncode == 2 and "or extend it with --reuse small.nc" in refused.stderr
    done = program(*words, "--reuse", "small.nc")
    assert (
        done.returncode == 0 and "small.nc: 24 of 44 points are taken from this file" in done.stderr
    )
    assert survey.open(ran).attrs["points_reused"] == 24 and survey.open(ran).status.size == 44
    with pytest.raises(BadInput, match="no such file"):
        survey.run(small, output="x.nc", reuse="none.nc")
