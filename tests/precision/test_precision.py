"""The work-precision chart: real measurements, errors against the references, the same records in
all three files.
"""

import csv
import importlib.util
import json

import numba
import numpy as np
import pytest
import xarray as xr

import survey.precision.cases as folder
from survey import evaluate, modules, precision, scenes
from survey.errors import BadInput

FIELDS = [
    "work",
    "method",
    "peer",
    "setting",
    "error",
    "seconds_per_point",
    "wrong_verdicts",
    "compile_seconds",
]


@pytest.fixture
def quick(monkeypatch):
    """Two settings and tiny works instead of ten and the real ones, and no new process for each method."""
    case = modules.load(folder, "satellite", "scene")
    monkeypatch.setattr(precision, "SETTINGS", (1e-4, 1e-8))
    monkeypatch.setattr(precision, "REPEATS", 1)
    monkeypatch.setattr(precision, "_cold", lambda _scene, method, _work: float(len(method)))
    row = {"k": np.array([[0.5]]), "rho": np.linspace(0.6, 4.0, 8)[None, :]}
    monkeypatch.setattr(case, "works", lambda: {"row": (row, {})})
    return case


def test_records_hold_what_was_measured_and_the_asked_accuracy_is_reached(
    quick, tmp_path, monkeypatch
):
    said = []
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: name == "scipy" or None)
    paths = precision.write("satellite", tmp_path, peers=True, say=said.append)
    assert [path.name for path in paths] == [
        f"precision_satellite.{kind}" for kind in ("json", "csv", "png")
    ]
    written = json.loads(paths[0].read_text())
    records = written["records"]
    assert list(records[0]) == FIELDS and written["machine"]["cpu"]
    times = {(r["method"], r["work"], r["setting"]): r["seconds_per_point"] for r in records}
    for least in written["machine"]["least"]:
        assert (
            0 < least["seconds_per_point"] < times[least["method"], least["work"], least["setting"]]
        )
    methods = {record["method"] for record in records if not record["peer"]}
    assert {"auto", "rk4", "magnus6", "taylor16"} <= methods
    assert {record["peer"] for record in records} == {"", "scipy"}
    assert any(line.startswith("heyoka is not installed and is missing") for line in said)
    own = [record for record in records if not record["peer"]]
    assert all(record["compile_seconds"] == len(record["method"]) for record in own)
    assert all(record["error"] <= record["setting"] for record in own)
    assert all(record["seconds_per_point"] > 0 and record["error"] >= 0 for record in records)
    assert sum(record["wrong_verdicts"] for record in records if not record["peer"]) == 0
    with open(paths[1], newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["error"]) for row in rows] == [record["error"] for record in records]
    assert paths[2].read_bytes()[:4] == b"\x89PNG"
    assert any("measured" in line for line in said)


def test_a_method_that_takes_long_at_one_setting_gets_no_finer_ones(quick, monkeypatch):
    said = []
    monkeypatch.setattr(precision, "LONG", 0.0)
    records = precision.measure("satellite", quick, say=said.append)
    assert {record.setting for record in records} == {1e-4}
    assert any(
        "rk4 is slow for row: nothing finer than 0.0001 is measured" in line for line in said
    )


@pytest.mark.slow
def test_a_first_call_compiles_in_a_process_of_its_own():
    assert (
        precision._cold("satellite", "rk4", ({"k": np.array([0.5]), "rho": np.array([1.0])}, {}))
        > 0
    )


def test_a_peer_is_judged_by_its_discriminant(quick):
    def constant(value):
        system = type(
            "Constant", (), {"integrate": lambda self, system, rtol: np.full((1, 6), value)}
        )()
        return precision._against(
            precision._peer(quick, system), quick.references(), "discriminant", 1e-8
        )[1]

    verdicts = [verdict for *_, verdict in quick.references()]
    assert constant(0.1) == verdicts.count(0) and constant(10.0) == verdicts.count(1)


def test_a_sample_is_points_of_the_work(quick):
    (point, _) = quick.works()["row"]
    assert precision._sample(point, None) is point and precision._sample(point, 8) is point
    sample = precision._sample(point, 3)
    assert sample["k"].shape == sample["rho"].shape == (3,) and set(sample["rho"]) < set(
        point["rho"][0]
    )


def test_a_wrong_value_or_verdict_shows_in_the_chart(quick):
    def broken(point, options, rtol):
        return {"discriminant": np.array([0.0]), "verdict": np.array([1])}

    error, wrong = precision._against(broken, quick.references(), "discriminant", 1e-8)
    assert error > 0.9 and wrong >= 4


def test_a_folder_that_cannot_be_or_a_missing_chart_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(BadInput, match="cannot make this folder"):
        precision.write("satellite", tmp_path / "file" / "below")
    with pytest.raises(BadInput, match="unknown precision chart 'satelite'"):
        precision.write("satelite", tmp_path)


@pytest.mark.slow
def test_what_a_method_does_not_answer_is_not_in_the_chart(monkeypatch):
    case = modules.load(folder, "gyrostat", "scene")
    works = {
        name: ({key: v[:20] for key, v in point.items()}, o)
        for name, (point, o) in case.works().items()
    }
    monkeypatch.setattr(precision, "SETTINGS", (1e-8,))
    monkeypatch.setattr(precision, "REPEATS", 1)
    monkeypatch.setattr(precision, "_cold", lambda *_: 0.0)
    monkeypatch.setattr(case, "works", lambda: works)
    records = precision.measure("gyrostat", case)
    found = {(record.method, record.work) for record in records}
    methods = {method for method, _ in found}
    assert {"auto", "taylor", "dop853", "rk4", "closed", "full"} <= methods
    assert found == {(method, work) for method in methods for work in works} - {
        ("closed", "trajectory")
    }
    assert all(record.error <= record.setting for record in records)


def test_a_scene_has_several_charts_and_samples_keep_the_rows_that_one_solution_serves(monkeypatch):
    case = modules.load(folder, "gyrostat_abel", "chart")
    works = case.works()
    dense, _options = works["121 angles of a turn"]
    sample = precision._sample(dense, 500, {"phi", "t"})
    assert (
        sample["phi"].shape == (1, 121)
        and sample["w0"].shape == (4, 1)
        and sample["phi0"].shape == (1, 1)
    )
    chosen = [np.flatnonzero(dense["w0"][:, 0] == w) for w in sample["w0"][:, 0]]
    assert all(
        np.array_equal(dense["d"][at], sample["d"][i : i + 1]) for i, at in enumerate(chosen)
    )
    some = {
        name: (precision._sample(point, 242, {"phi", "t"}), options)
        for name, (point, options) in works.items()
    }
    monkeypatch.setattr(precision, "SETTINGS", (1e-8,))
    monkeypatch.setattr(precision, "REPEATS", 1)
    monkeypatch.setattr(precision, "_cold", lambda *_: 0.0)
    monkeypatch.setattr(case, "works", lambda: some)
    records = precision.measure("gyrostat_abel", case)
    assert {(r.method, r.work) for r in records} == {
        (m, w) for m in ("auto", "taylor", "dop853", "rk4") for w in works
    }
    assert all(record.error <= record.setting for record in records)


def test_no_call_that_compiles_is_timed(monkeypatch):
    """As one whose first points need double-double arithmetic at this accuracy, and at none before."""

    def solve(point, options, rtol):
        calls.append(rtol)
        function = numba.njit(lambda x: x + np.sin(x)) if len(calls) == 1 else np.sin
        function(rtol)

    calls = []
    # one call is enough, if it does not compile
    monkeypatch.setattr(precision, "ENOUGH_SECONDS", 0.0)
    seconds = precision._per_point(solve, {"a": np.zeros(1)}, {}, 0.5)
    assert len(calls) == 2 and seconds < 0.01


def test_scattered_points_are_measured_as_users_get_them_and_references_among_them():
    """From 4,096 points on they share series: times per point and errors are those of such points."""
    random = np.random.default_rng(1)
    point = {"a": random.uniform(0.0, 5.0, 6_000), "q": random.uniform(0.0, 1.0, 6_000)}
    exact = {"discriminant": 2 * np.cos(np.pi * np.sqrt(2.0))}
    inside = precision._within(
        ({"a": 2.0, "q": 0.0}, {}, exact, 1), point | {"q": point["q"] - 0.5}
    )
    assert {name: (values.size, values[0]) for name, values in inside[0].items()} == {
        "a": (5_001, 2.0),
        "q": (5_001, 0.0),
    }
    outside = ({"a": 9.0, "q": 0.0}, {}, exact, 1)
    assert precision._within(outside, point) is outside
    solve = precision._solver(modules.load(scenes, "mathieu", "scene"), "auto", "discriminant")
    grid = xr.DataArray(inside[0]["a"], dims="p"), xr.DataArray(inside[0]["q"], dims="p")
    ds = evaluate("mathieu", a=grid[0], q=grid[1], variables=["discriminant", "verdict"], rtol=1e-8)
    # the same way, the same bits
    assert (solve(inside[0], {}, 1e-8)["discriminant"] == ds.discriminant.values).all()
    error, wrong = precision._against(solve, [inside], "discriminant", 1e-8)
    assert error < 1e-8 and not wrong
