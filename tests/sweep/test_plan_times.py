"""What `survey plan` says of workflows, and what they take: within a factor of 2 on a usual machine."""

import time
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

from survey import measures
from survey.measures.tasks import in_turn
from survey.request import workflow
from survey.sweep import boundaries, dispatch, engine, measured, plan

WORKFLOWS = Path(__file__).parents[2] / "workflows"
LONGEST = 6.0  # seconds of the processor that are planned for the reduced workflow
ROUNDING = 1.0  # seconds, which tell nothing of a rate


def reduced(name, output):
    """The workflow on so few points that its plan is short; curves of a map take what they take."""
    table = tomllib.loads((WORKFLOWS / f"{name}.toml").read_text(encoding="utf-8"))
    table["output"] = {
        key: value for key, value in table.get("output", {}).items() if key == "variables"
    }
    for _ in range(20):
        checked = workflow.check(table, output=output, near=WORKFLOWS)
        if sum(plan.estimates(checked, threads=1)[0].values()) < LONGEST:
            break
        for axis in table["axes"].values():
            if isinstance(axis, dict) and "num" in axis:
                axis["num"] = max(3, round(0.75 * axis["num"]))
    return checked


NAMES = (
    "brun_monodromy brun_periods brun_states brun_triaxial coupled_mathieu gyrostat_body gyrostat_fate ion_trap "
    "josephson kapitza libration_coefficients libration_elliptic satellite_prolate satellite_separatrix "
    "satellite_tongues satellite_twist"
).split()


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_plans_are_within_a_factor_of_2(name, tmp_path, monkeypatch):
    """In seconds of the processor, whatever else the machine does, with what has been compiled by a
    first run.
    """
    noted = []
    monkeypatch.setattr(measured, "note", lambda *about: noted.append(about))
    checked = reduced(name, tmp_path / "map.nc")
    engine.run(checked, fresh=True)
    monkeypatch.setattr(engine, "time", SimpleNamespace(perf_counter=time.process_time))
    engine.run(checked, fresh=True)
    _workflow, _usual, taken, compiling, *_ = noted[-1]
    assert compiling < 1.0
    for part, expected in plan.estimates(checked, threads=1)[0].items():
        assert expected / 2 - ROUNDING < taken[part] < 2 * expected + ROUNDING, (
            part,
            expected,
            taken[part],
        )


CURVES = {  # seconds of the processor that curves of the triaxial satellite have taken
    "window": ({"yaw_ratio": (0.3, 0.32), "roll_ratio": (0.6, 0.62)}, 4.5),
    "tenth": ({"yaw_ratio": (0.1, 0.3), "roll_ratio": (0.4, 0.6)}, 17.9),
    "quarter": ({"yaw_ratio": (-0.25, 0.25), "roll_ratio": (0.3, 0.8)}, 22.2),
    "amplitudes": ({"yaw_ratio": (-0.1, 0.74), "amplitude": (0.0, 1.45)}, 144.0),
    "line": ({"yaw_ratio": (-0.99, 0.59)}, 5.3),
}


@pytest.mark.parametrize("name", CURVES)
def test_curves_of_a_part_of_a_map_are_planned_as_such(name, tmp_path):
    ends, taken = CURVES[name]
    axes = {key: {"start": a, "stop": b, "num": 5} for key, (a, b) in ends.items()}
    fixed = {"yaw_ratio": 0.3, "roll_ratio": 0.6, "amplitude": 0.5236}
    table = {"scene": "satellite_triaxial", "axes": fixed | axes, "boundaries": {}}
    checked = workflow.check(table, output=tmp_path / "map.nc")
    expected = plan.estimates(checked, threads=1)[0]["further"]
    assert taken / 2 < expected < 2 * taken


@pytest.mark.parametrize(
    ("stacked", "threads", "rounds"), [(1, 1, 1), (1, 8, 1), (5, 1, 5), (5, 2, 3), (5, 8, 1)]
)
def test_the_curves_of_one_map_are_planned_on_one_thread(stacked, threads, rounds, tmp_path):
    """As they are found: each map is one task."""
    axis = {"start": 0.4, "stop": 1.2, "num": 5}
    axes = {"p_psi": axis, "p_theta0": axis, "theta0": 0.8 if stacked == 1 else axis}
    axes |= {"A": 1.3, "C": 0.6, "epsilon": 2.0, "p_phi": 0.3}
    table = {"scene": "brun", "axes": axes, "boundaries": {"plane": ["p_psi", "p_theta0"]}}
    checked = workflow.check(table, output=tmp_path / "map.nc")
    lone = boundaries._seconds_of_map(
        checked, measures.curves(checked.scene), ["p_psi", "p_theta0"], 0.0
    )
    assert plan.estimates(checked, threads)[0]["further"] == pytest.approx(rounds * lone)
    tasks = []

    def each(task, items, _what):
        tasks.append(len(items))
        return in_turn(task, items[:1]) * len(items)

    boundaries.find(checked, each)
    assert tasks == [stacked]


@pytest.mark.parametrize(
    ("name", "taken"), [("libration_elliptic_proved", 6.2), ("libration_elliptic", 2.2)]
)
def test_cells_of_danbys_map_are_planned_as_they_were_measured(name, taken, tmp_path):
    """In seconds of the processor, the second with the curves of the map."""
    checked = workflow.check(
        tomllib.loads((WORKFLOWS / f"{name}.toml").read_text(encoding="utf-8")),
        output=tmp_path / "map.nc",
        near=WORKFLOWS,
    )
    expected = plan.estimates(checked, threads=1)[0]["further"]
    assert taken / 2 < expected < 2 * taken


LINE = {"start": 0.01, "stop": 0.03, "num": 9}


@pytest.mark.parametrize(
    ("scene", "axes", "more", "taken"),
    [
        ("mathieu", {"q": 1.0, "a": LINE}, {}, 4.3),
        ("mathieu", {"q": LINE, "a": LINE}, {}, 6.8),
        ("mathieu", {"q": LINE, "a": LINE}, {"refine": {"width": 0.01}}, 13.0),
        ("gyrostat", {"w0": LINE, "t": 3.0}, {"options": {"question": "trajectory"}}, 5.2),
        ("gyrostat", {"w0": LINE}, {"options": {"question": "fate"}}, 11.7),
        ("gyrostat", {"w0": LINE, "phi": LINE}, {"options": {"question": "abel"}}, 11.3),
        ("libration", {"mu": LINE}, {}, 4.1),
        ("libration", {"mu": LINE}, {"options": {"order": "8"}}, 10.6),
        ("libration_elliptic", {"mu": LINE, "e": 0.1}, {"boundaries": {}}, 3.3),
        ("libration_elliptic", {"mu": LINE, "e": LINE}, {"refine": {"width": 0.01}}, 13.7),
    ],
)
def test_compiling_on_one_processor_is_planned_as_it_was_measured(
    scene, axes, more, taken, tmp_path, monkeypatch
):
    monkeypatch.setattr(dispatch, "cpus", lambda: 1)
    monkeypatch.setattr(measured, "_records", list)
    checked = workflow.check({"scene": scene, "axes": axes} | more, output=tmp_path / "map.nc")
    said = float(plan.plan(checked)["compiling"].split()[1])
    assert taken / 2 < said < 2 * taken
