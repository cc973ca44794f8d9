"""Every chart in a quick form: each method's error is within what it was asked, on a few points of
every work.
"""

import json

import body_truth
import mpmath as mp
import numpy as np
import pytest
from snippets import ROOT

import survey.precision.cases as folder
from survey import BadInput, modules, precision
from survey.precision import chart
from survey.precision.known import references as known
from survey.truth.hill import mathieu

QUICK = ("mathieu", "libration")
LONG = (
    "libration_orders",
    "libration_elliptic_near_1",
    "satellite_families",
    "brun_motion",
    "gyrostat_body",
    "brun_triaxial",
    "satellite_triaxial",
    "gyrostat_integrable",
)
SLOW = (pytest.param(name, marks=pytest.mark.slow) for name in LONG)
SETTING = 1e-8


def few(point, number=4):
    """A few rows and columns of a work."""
    return {
        name: values[tuple(slice(number) for _ in np.shape(values))]
        for name, values in point.items()
    }


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(precision, "SETTINGS", (SETTING,))
    monkeypatch.setattr(precision, "REPEATS", 1)
    monkeypatch.setattr(precision, "_cold", lambda *_: 0.0)


@pytest.mark.parametrize("name", [*QUICK, *SLOW])
def test_the_errors_of_a_chart_are_what_was_asked(name, quick, monkeypatch, tmp_path):
    case = modules.load(folder, name, "chart")
    works = {work: (few(point), options) for work, (point, options) in case.works().items()}
    monkeypatch.setattr(case, "works", lambda: works)
    references = {work: case.references(work)[:6] for work in works}
    monkeypatch.setattr(case, "references", lambda work: references[work])
    records = precision.measure(name, case)
    assert {r.work for r in records if r.method == "auto"} == set(works)
    # they lose digits towards mu = 0 and poles, and say so in their bars
    series = {"lie", "lie_double"} if name == "libration" else set()
    for r in records:
        if name == "libration_orders" and r.method == "lie":
            assert r.error < 1e-6  # what the series' cancellation leaves, in float64
        elif r.method not in series:
            assert r.error <= SETTING and r.wrong_verdicts == 0, r
    machine = {
        "least": [],
        "missing_peers": [],
        "cpu": "a core",
        "load": (1.0, 1.0, 1.0),
        "entry": "scene.solve",
    }
    machine |= {"outputs": precision.outputs(case), "works": precision.described(case)}
    json.dumps(machine)
    chart.draw(records, machine, name, case.ERROR, tmp_path / "chart.png")
    assert (tmp_path / "chart.png").stat().st_size > 20_000


def test_all_outputs_cost_more(quick):
    case = modules.load(folder, "mathieu", "chart")
    assert set(precision.outputs(case).values()) == {"all", "discriminant, verdict"}


def test_a_reference_is_the_truth():
    ((point, options, exact, _verdict),) = known(
        mathieu, {"a": np.array([2.0]), "q": np.array([0.0])}, {}, "discriminant"
    )
    assert point == {"a": 2.0, "q": 0.0} and options == {}
    assert float(exact["discriminant"]) == pytest.approx(
        2 * np.cos(np.pi * np.sqrt(2.0)), abs=1e-15
    )


@pytest.mark.slow
def test_the_bodies_of_the_chart_by_another_series():
    """`body_truth` sums its own Taylor series, not mpmath's."""
    with mp.workdps(30):
        for body, _, exact, _ in modules.load(folder, "gyrostat_body", "chart").references():
            state = [mp.mpf(body[f"{name}{i}"]) for name in ("omega", "gamma") for i in (1, 2, 3)]
            size = mp.norm(state[3:])
            end = body_truth.motion(
                body, [*state[:3], *(x / size for x in state[3:])], body["t"], digits=30
            )
            assert abs(end[0] - mp.mpf(exact["w1"])) < 1e-16


@pytest.mark.slow
def test_a_chart_of_ones_own(quick, tmp_path):
    paths = precision.write(ROOT / "workflows/whittaker_hill.py", tmp_path)
    written = json.loads(paths[0].read_text())
    assert (
        paths[0].name == "precision_whittaker_hill.json"
        and written["machine"]["entry"] == "scene.solve"
    )
    assert {r["work"] for r in written["records"]} == {"row", "scattered", "map 60x80"}
    assert all(r["error"] <= SETTING and r["wrong_verdicts"] == 0 for r in written["records"])
    with pytest.raises(BadInput, match="name your own file"):
        precision.write("own_file", tmp_path)
