"""What `survey plan` learns from runs on this machine."""

import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import survey
from survey.kernels import jit
from survey.request import workflow
from survey.sweep import announce, dispatch, engine, measured, plan

ROOT = Path(__file__).parents[2]
TABLE = {
    "scene": "satellite",
    "axes": {
        "k": {"start": 0.0, "stop": 0.9, "num": 200},
        "rho": {"start": 0.6, "stop": 4.0, "num": 300},
    },
}


@pytest.fixture
def mapped(tmp_path, monkeypatch):
    """A workflow, on a machine on which nothing has run yet."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return workflow.check(TABLE, output=tmp_path / "map.nc")


def with_axes(mapped, **numbers):
    axes = {
        name: axis | {"num": numbers.get(name, axis["num"])} for name, axis in TABLE["axes"].items()
    }
    return workflow.check(TABLE | {"axes": axes}, output=mapped.path)


@pytest.mark.parametrize("slower", [0.2, 7.0])
def test_the_next_plan_is_what_the_last_run_took(mapped, slower):
    """Within a factor of 2, for a map four times as large, too: on a machine 5 times as fast or 7
    times as slow.
    """
    mapped = with_axes(mapped, k=4000, rho=3000)
    usual, _ = plan.estimates(mapped)
    mapped_larger = with_axes(mapped, k=20000, rho=12000)
    larger, _ = plan.estimates(mapped_larger)
    before = plan.plan(mapped_larger)["estimated_seconds"]
    took = max(usual["kernels"] * slower, 1.2)
    measured.note(mapped, usual, {"kernels": took}, 3.0)
    expected = larger["kernels"] * took / usual["kernels"]
    found = plan.plan(mapped_larger)["estimated_seconds"]
    assert measured.factor(mapped_larger, "kernels", larger["kernels"]) == pytest.approx(
        took / usual["kernels"], rel=0.01
    )
    digit = 10.0 ** np.floor(np.log10(max(found, before)) - 1)  # the second, the last that is given
    assert found - before == pytest.approx(expected - larger["kernels"], abs=digit)


def test_a_run_without_answers_tells_nothing(mapped):
    usual, _ = plan.estimates(mapped)
    measured.note(mapped, usual, {"kernels": 100.0}, 3.0, unanswered=0.9)
    assert not measured.knows(mapped)
    measured.note(mapped, usual, {"kernels": 100.0}, 3.0, unanswered=0.1)
    assert measured.knows(mapped)


def test_a_short_run_tells_nothing_of_a_long_one(mapped):
    """A first try of 30 points takes some tenths of a second to begin, which are no measure of a point."""
    tried, larger = with_axes(mapped, k=5, rho=6), with_axes(mapped, k=20000, rho=12000)
    before = plan.plan(larger)["estimated_seconds"]
    measured.note(tried, plan.estimates(tried)[0], {"kernels": 0.4}, 0.0)
    assert plan.plan(larger)["estimated_seconds"] == before


def test_a_plan_says_what_it_knows_the_time_from(mapped):
    assert plan.plan(mapped)["time_from"] == plan.GUESSED
    measured.note(mapped, {"kernels": 1.0}, {"kernels": 2.0}, 0.0)
    assert plan.plan(mapped)["time_from"] == plan.LEARNT


def test_compiling_is_reported_apart(mapped, monkeypatch):
    monkeypatch.setattr(dispatch, "cpus", lambda: 1)  # which compiles one kernel after another
    alone = plan.plan(mapped)["compiling"]
    assert alone == f"about {2 * announce.SECONDS['hill']} s besides, once on this machine"
    told = announce.sentence(mapped.name, mapped.scene)
    assert told.endswith(f"about {2 * announce.SECONDS['hill']} s")
    monkeypatch.setattr(dispatch, "cpus", lambda: 2)
    assert (
        plan.plan(mapped)["compiling"]
        == f"about {announce.SECONDS['hill']} s besides, once on this machine"
    )
    measured.note(mapped, {"kernels": 1.0}, {"kernels": 2.0}, 13.0)
    assert plan.plan(mapped)["compiling"] == "done already"
    path = measured._path()
    path.write_text(path.read_text().replace(jit.KERNEL_HASH, "other kernels"))
    assert plan.plan(mapped)["compiling"] == "about 13 s besides, once on this machine"


def test_what_other_tables_and_options_have_compiled_is_done(mapped):
    def asked(**more):
        return workflow.check({**TABLE, **more}, output=mapped.path)

    both = asked(options={"body": "oblate"}, boundaries={}, refine={"width": 0.01})
    measured.note(both, {"kernels": 1.0}, {"kernels": 2.0}, 13.0)
    for one in (
        mapped,
        asked(boundaries={}),
        asked(options={"body": "prolate"}, refine={"width": 0.1}),
    ):
        assert plan.plan(one)["compiling"] == "done already"
    path = measured._path()
    path.write_text(path.read_text().replace("boundaries,refine", "boundaries"))
    assert plan.plan(asked(boundaries={}))["compiling"] == "done already"
    assert plan.plan(both)["compiling"] != "done already"
    axes = {"w0": [0.1, 0.2]}
    fate, abel = (
        workflow.check(
            {"scene": "gyrostat", "axes": axes | more, "options": {"question": question}},
            output=mapped.path,
        )
        for question, more in (("fate", {}), ("abel", {"phi": [0.1, 0.2]}))
    )
    measured.note(fate, {"kernels": 1.0}, {"kernels": 2.0}, 13.0)
    assert plan.plan(fate)["compiling"] == "done already" != plan.plan(abel)["compiling"]


def test_a_small_window_tells_a_larger_map_no_multiple_of_its_beginning(mapped):
    """As the strip of Danby's map, 0.056 s by the estimate and 2.6 by the clock, most of them its
    beginning, told other maps to take 46 times as long.
    """
    small, larger = with_axes(mapped, k=100, rho=80), with_axes(mapped, k=20000, rho=12000)
    before, usual = plan.plan(larger)["estimated_seconds"], plan.estimates(larger)[0]["kernels"]
    assert usual > 25.0 * 0.056
    measured.note(small, {"kernels": 0.056}, {"kernels": 2.6}, 0.0)
    assert plan.plan(larger)["estimated_seconds"] == before
    measured.note(small, {"kernels": 0.1}, {"kernels": 2.6}, 0.0)
    assert measured.factor(mapped, "kernels", 2.0) == 10.0
    measured.note(small, {"kernels": 2.0}, {"kernels": 90.0}, 0.0)
    assert measured.factor(mapped, "kernels", 2.0) == pytest.approx(0.5 * (10.0 + 45.0))


def test_recorded_equations_share_the_kernels_of_their_family(mapped, tmp_path):
    def asked(rate):
        path = tmp_path / f"rate{rate}.py"
        path.write_text(
            f'STATES, PARAMETERS, PERIOD = "x", "q", 1.0\ndef A(t, p, out): out[0, 0] = -{rate} * p[0]\n'
        )
        table = {"scene": str(path), "axes": {"q": [0.1, 0.2]}}
        return workflow.check(table, output=mapped.path)

    one, other = asked(1), asked(2)
    assert one.scene.HASH != other.scene.HASH
    measured.note(one, {"kernels": 1.0}, {"kernels": 2.0}, 21.0)
    assert plan.plan(other)["compiling"] == "done already"
    assert plan.plan(other)["time_from"] == plan.GUESSED
    assert plan.plan(mapped)["compiling"] != "done already"


def test_edges_tell_nothing_of_cells(mapped):
    """As 0.07 s of edges by the estimate and 1.6 by the clock told cells to take 10 times as long."""
    edges, cells = (
        workflow.check(TABLE | table, output=mapped.path)
        for table in ({"boundaries": {}}, {"refine": {"width": 0.01}})
    )
    measured.note(edges, {"further": 1.0}, {"further": 9.0}, 0.0)
    assert measured.factor(edges, "further", 2.0) == 9.0
    assert measured.factor(cells, "further", 2.0) == 1.0


def test_the_runs_most_alike_decide(mapped):
    other = workflow.check({**TABLE, "options": {"body": "oblate"}}, output=mapped.path)
    measured.note(other, {"kernels": 1.0}, {"kernels": 8.0}, 0.0)
    assert measured.factor(mapped, "kernels", 1.0) == 8.0  # the same scene
    for seconds, taken in ((0.5, 1.0), (1.0, 2.0), (4.0, 8.0), (500.0, 500.0)):
        measured.note(mapped, {"kernels": seconds}, {"kernels": taken}, 0.0)
    assert (
        measured.factor(mapped, "kernels", 1.0) == 2.0
        and measured.factor(mapped, "further", 1.0) == 1.0
    )


@pytest.mark.parametrize(
    "text",
    ["", "[", "{}", "[1, null]", '[{"hash": 3, "kernels": [0, "a"], "compiling": 0}]', "[" * 9**5],
)
def test_a_file_that_is_none_of_ours_is_as_good_as_none(mapped, text):
    path = measured._path()
    path.parent.mkdir(parents=True)
    path.write_text(text)
    assert (
        measured.factor(mapped, "kernels", 1.0) == 1.0
        and plan.plan(mapped)["estimated_seconds"] > 0
    )
    measured.note(mapped, {"kernels": 1.0}, {"kernels": 2.0}, 0.0)
    assert [one["kernels"] for one in json.loads(path.read_text())] == [[1.0, 2.0]]


def test_a_run_of_almost_nothing_tells_nothing(mapped):
    # on a slow machine it took seconds to begin
    measured.note(mapped, {"kernels": 1e-3}, {"kernels": 3.0}, 0.0)
    assert measured.factor(mapped, "kernels", 10.0) == 1.0


def test_a_run_is_noted_and_a_resumed_one_is_not(mapped, monkeypatch):
    monkeypatch.setattr(measured, "SHORT", 0.0)
    monkeypatch.setattr(measured, "LITTLE", 0.0)
    small = with_axes(mapped, k=4, rho=5)
    engine.run(small, fresh=True)
    (noted,) = measured._records()
    assert noted["scene"] == "satellite" and noted["axes"] == "k,rho" and len(noted["kernels"]) == 2
    engine.run(small)  # complete already
    assert measured._records() == [noted]


def test_a_cache_that_cannot_be_written_is_no_error(mapped, monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    measured.note(mapped, {"kernels": 1.0}, {"kernels": 2.0}, 0.0)
    assert measured._records() == [] and replace(mapped) == mapped


@pytest.mark.slow
@pytest.mark.parametrize("name", ["coupled_mathieu", "ion_trap", "kapitza", "ground_resonance"])
def test_what_a_point_of_an_own_system_costs_is_known_before_it_is_solved(name):
    """Two states or twelve, two functions of time or 135: within a factor of 3 of the processor's time."""
    checked = workflow.read(ROOT / f"workflows/{name}.toml", output="never.nc")
    scene, grid = checked.scene, checked.grid
    random = np.random.default_rng(1)
    many = 1000 if len(scene.states) < 8 else 40
    some = {key: random.choice(np.ravel(own), many) for key, (_, own) in grid.parameters.items()}

    def spent(number):
        points = {key: xr.DataArray(own[:number], dims="sample") for key, own in some.items()}
        began = time.process_time()
        survey.evaluate(scene, **points)
        return time.process_time() - began

    spent(many)  # compiles
    most, half = (min(spent(number) for _ in range(3)) for number in (many, many // 2))
    taken, expected = (most - half) / (many / 2), scene.cost({}, dict.fromkeys(some, 1))
    assert expected / 3 < taken < 3 * expected, (taken, expected)


def test_an_own_system_costs_by_its_states_and_its_functions_of_time():
    costs = {}
    for name in ("kapitza", "coupled_mathieu", "ground_resonance"):  # 2, 4 and 12 states
        checked = workflow.read(ROOT / f"workflows/{name}.toml", output="never.nc")
        costs[len(checked.scene.states)] = checked.scene.cost({}, {"p": 1})
    assert 1e-6 < costs[2] < costs[4] < costs[12] < 1e-1
