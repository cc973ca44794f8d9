"""What `survey plan` says of workflows, and what they take: within a factor of 2 on a usual machine."""

import time
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pytest

from survey.request import workflow
from survey.sweep import engine, measured, plan
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
