"""Starter workflows run as they are; the schema accepts the kept workflows; other packages bring scenes."""

import json
import sys
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

import numpy as np
import pytest

import survey
import survey.scenes as scenes
from survey.errors import BadInput
from survey.request import starter, workflow

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", survey.scenes())
def test_a_starter_is_a_sound_workflow_that_names_what_can_be_changed(name, tmp_path):
    text = starter.workflow(name)
    path = tmp_path / "start.toml"
    path.write_text(text)
    checked = workflow.read(path, output=tmp_path / "o.nc")
    assert len(checked.grid.sizes) in (1, 2) and checked.grid.points > 40
    for p in checked.scene.PARAMETERS:
        assert p.when or f"{p.name} " in text, p.name


@pytest.mark.slow
@pytest.mark.parametrize("name", survey.scenes())
def test_a_starter_draws_something_that_changes(name, tmp_path):
    text = starter.workflow(name)
    (tmp_path / "start.toml").write_text(text)
    (drawn,) = tomllib.loads(text)["output"]["figures"]
    found = survey.run(tmp_path / "start.toml", output=tmp_path / "o.nc")
    assert (found.status == 0).mean() >= 0.5
    assert np.unique(found[drawn].values[found.status.values == 0]).size > 1


def test_the_command_writes_one_that_runs(program):
    done = program("init", "mathieu")
    assert done.returncode == 0 and done.stdout == "mathieu.toml\n"
    ran = program("run", "mathieu.toml", "--set", "axes.a.num=5", "--set", "axes.q.num=4")
    assert ran.returncode == 0 and (program.folder / "mathieu.png").exists(), ran.stderr
    again = program("init", "mathieu")
    assert again.returncode == 2 and "mathieu.toml exists" in again.stderr


def test_the_schema_accepts_the_kept_workflows_and_no_others():
    jsonschema = pytest.importorskip("jsonschema")
    schema = starter.schema()
    json.dumps(schema)
    validator = jsonschema.Draft202012Validator(schema)
    for path in sorted((ROOT / "workflows").glob("*.toml")):
        assert list(validator.iter_errors(tomllib.loads(path.read_text()))) == [], path
    base = {"scene": "mathieu", "axes": {"a": 1.0}}
    assert validator.is_valid(base | {"axes": {"a": [1.0, 2.0]}})
    for wrong in (
        {"axis": {}},
        {"solver": {"tol": 1}},
        {"axes": {"a": {"start": 1}}},
        {"output": {"style": "x"}},
    ):
        assert list(validator.iter_errors(base | wrong)), wrong
    printed = schema["properties"]
    assert set(printed) == {
        "title",
        "scene",
        "options",
        "axes",
        "solver",
        "output",
        "boundaries",
        "refine",
    }


def test_starters_of_hill_equations_have_the_edges_of_their_tongues():
    for scene, on in (("satellite", True), ("mathieu", True), ("libration_elliptic", False)):
        text = starter.workflow(scene)
        assert ("boundaries" in tomllib.loads(text)) == on and "[boundaries]" in text


def test_completion_offers_scenes_and_workflows(program):
    asked = {"_SURVEY_COMPLETE": "bash_complete"}
    (program.folder / "one.toml").write_text("")
    (program.folder / "two.txt").write_text("")
    done = program(env=asked | {"COMP_WORDS": "survey scenes lib", "COMP_CWORD": "2"})
    assert done.stdout.split() == ["plain,libration", "plain,libration_elliptic"], done.stderr
    done = program(env=asked | {"COMP_WORDS": "survey run ", "COMP_CWORD": "2"})
    assert done.stdout.split() == ["plain,one.toml"], done.stderr


PLUGIN = '''"""Mathieu's equation, brought by another package."""
from survey.scenes.mathieu import AUDIT, FAMILY, OPTIONS, OUTPUTS, PARAMETERS, REFERENCES, STATUS
from survey.scenes.mathieu import cost, solve, trajectory, why

TITLE = "Brought along"
'''


def test_another_package_brings_a_scene(tmp_path, monkeypatch):
    (tmp_path / "brought_scene.py").write_text(PLUGIN)
    monkeypatch.syspath_prepend(str(tmp_path))
    points = [
        EntryPoint("brought", "brought_scene", scenes.GROUP),
        EntryPoint("broken", "nowhere_at_all", scenes.GROUP),
    ]
    monkeypatch.setattr(scenes, "entry_points", lambda group: points)
    scenes.brought.cache_clear()
    try:
        ds = survey.evaluate("brought", a=1.0, q=0.1)
        assert int(ds.verdict) == int(survey.evaluate("mathieu", a=1.0, q=0.1).verdict)
        with pytest.raises(BadInput, match=r"the scene broken of the package .* cannot be loaded"):
            survey.evaluate("broken", a=1.0)
        with pytest.raises(BadInput, match="did you mean 'brought'"):
            survey.evaluate("brougt", a=1.0)
        titles = survey.scenes()
        assert titles["brought"] == "Brought along" and "mathieu" in titles
        assert titles["broken"].startswith("cannot be loaded: ModuleNotFoundError: No module named")
    finally:
        scenes.brought.cache_clear()
        sys.modules.pop("brought_scene", None)
