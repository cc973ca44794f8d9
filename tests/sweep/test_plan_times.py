"""What `survey plan` says of workflows, and what they take: within a factor of 2 on a usual machine."""

import time
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

from survey.request import workflow
from survey.sweep import dispatch, engine, measured, plan
from survey.sweep.dispatch import cpus

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
        if sum(plan.estimates(checked)[0].values()) * cpus() < LONGEST:
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
    _workflow, estimated, taken, compiling = noted[-1]
    assert compiling < 1.0
    for part, seconds in estimated.items():
        expected = seconds * cpus()
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
    expected = plan.estimates(checked)[0]["further"] * cpus()
    assert taken / 2 < expected < 2 * taken


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
    expected = plan.estimates(checked)[0]["further"] * cpus()
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
