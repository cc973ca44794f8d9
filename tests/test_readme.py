"""Every command and snippet in the README is run as it stands."""

import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import snippets
from snippets import ROOT

import survey
from survey.request import workflow
from survey.sweep import engine

README = (ROOT / "README.md").read_text()
BIN = Path(sys.executable).parent


def fenced(language):
    return snippets.fenced(README, language)


def small(code):
    """The same snippet on a small map in another folder."""
    return code.replace("workflows/satellite_prolate.toml", "small.toml")


@pytest.fixture
def folder(tmp_path):
    """An empty folder with a small copy of the main workflow in it."""
    text = (ROOT / "workflows/satellite_prolate.toml").read_text()
    text = (
        text.replace("num = 400", "num = 8").replace("num = 600", "num = 9").replace("results/", "")
    )
    (tmp_path / "small.toml").write_text(text)
    return tmp_path


def run(command, folder):
    return subprocess.run(
        command, cwd=folder, shell=True, capture_output=True, text=True, executable="/bin/bash"
    )


def test_the_main_command_is_the_documented_job():
    (main, test) = fenced("sh")
    assert (
        main.startswith("python3 -m venv .venv && .venv/bin/pip install -e . && ")
        and main.count("&&") == 2
    )
    assert test.endswith("&& .venv/bin/python -m pytest\n")
    assert "README.md" in (ROOT / ".ci/run").read_text()


def test_the_first_picture_shows_whole_tongues():
    """That of the main command, with the edges of tongues that are narrower than its grid."""
    (first, *_) = re.findall(r"!\[[^]]*\]\((results/\S+)\)", (ROOT / "README.md").read_text())
    asked = tomllib.loads((ROOT / "workflows" / f"{Path(first).stem}.toml").read_text())
    assert "axis" in asked["boundaries"] and asked["output"]["figures"][0] == "verdict"
    assert f"workflows/{Path(first).stem}.toml" in fenced("sh")[0]


def test_the_main_command_runs(folder):
    command = small(fenced("sh")[0].split("&&")[-1]).replace(
        ".venv/bin/", f"{shlex.quote(str(BIN))}/"
    )
    done = run(command, folder)
    assert done.returncode == 0, done.stderr
    assert (folder / "satellite_prolate.nc").exists() and (
        folder / "satellite_prolate.png"
    ).exists()


def test_the_notebook_example_runs(folder):
    code, *_ = fenced("python")
    done = subprocess.run(
        [sys.executable, "-c", small(code)], cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("undecided unstable stable marginal\n") and "+-" in done.stdout


def test_the_example_of_abels_equation_runs(capsys, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    scope = {}
    exec(fenced("python")[1], scope)
    assert capsys.readouterr().out.startswith("turning\n")
    states = np.unique(scope["abel"].status)
    assert list(states) == [0, 16]  # some turn, some do not
    plt.close("all")


def test_the_scene_of_ones_own_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (call,) = re.findall(r'`survey.evaluate\("two_harmonics.py",\s(.*?)\)`', README)
    (tmp_path / "two_harmonics.py").write_text(fenced("python")[2])
    ds = survey.evaluate("two_harmonics.py", **eval(f"dict({call})"))
    assert int(ds.verdict) == 1 and ds.attrs["title"].startswith(
        "Mathieu's equation with a second harmonic"
    )


@pytest.mark.slow
def test_the_abel_equations_of_ones_own_run(capsys):
    scope = {}
    exec(fenced("python")[3], scope)
    assert capsys.readouterr().out == "[0. 1.]\n" and (scope["ds"].status == 0).all()


@pytest.mark.slow
def test_the_example_of_the_josephson_junction_runs(tmp_path):
    small = ["axes.a={values=[0.1, 0.5]}", "axes.I={values=[0.1, 0.3, 0.9]}", "output.figures=[]"]
    checked = workflow.read(ROOT / "workflows/josephson.toml", small, tmp_path / "small.nc")
    engine.run(checked)
    ds = survey.open(checked.path)
    assert ds.rotations_plus.values.tolist() == [[0, 1, 1], [0, 0, 1]] and (ds.verdict == 1).all()


@pytest.mark.parametrize("name", ["whittaker_hill", "meissner"])
def test_the_examples_of_own_scenes_run(name, tmp_path):
    axes = {"whittaker_hill": "m", "meissner": "q"}
    small = [f"axes.{axes[name]}.num=3", "axes.a.num=8"]
    checked = workflow.read(ROOT / f"workflows/{name}.toml", small, tmp_path / "small.nc")
    engine.run(checked)
    ds = survey.open(checked.path)
    assert (ds.status == 0).all() and ds.edge_complete.values.all()


def test_every_command_in_the_table_runs(folder):
    commands = re.findall(r"^\| `(survey [^`]*)`", README, re.MULTILINE)
    assert len(commands) >= 13
    names = {
        "WORKFLOW.toml": "small.toml",
        "OUT.nc": "satellite_prolate.nc",
        "[NAME]": "satellite",
        "SCENE": "satellite",
    }
    for command in commands:
        for word, name in names.items():
            command = command.replace(word, name)
        if any(word in command for word in ("precision", "failures", "view", "merge")):
            continue  # takes minutes, serves until it is stopped, needs two: see their own tests
        done = run(f"{shlex.quote(str(BIN))}/{command}", folder)
        assert done.returncode == 0, (command, done.stderr)


def test_the_override_on_the_command_line_runs(folder):
    (command,) = re.findall(r"`(survey run [^`]*--set[^`]*)`", README)
    done = run(f"{shlex.quote(str(BIN))}/{small(command)}".replace("num=40", "num=4"), folder)
    assert done.returncode == 0 and (folder / "quick.nc").exists(), done.stderr


def test_the_map_of_the_folders_is_the_tree():
    (tree,) = re.findall(r"^```\nsurvey/\n(.*?)^```", README, re.DOTALL | re.MULTILINE)
    rows = re.findall(r"^  ([a-z_]+(?:\.py|/)(?:  [a-z_]+\.py)*)(?= )", tree, re.MULTILINE)
    listed = sorted(name for row in rows for name in row.split())
    apart = {"__init__.py", "__main__.py", "__pycache__"}
    there = [path for path in (ROOT / "survey").iterdir() if path.is_dir() or path.suffix == ".py"]
    assert listed == sorted(
        path.name + "/" * path.is_dir() for path in there if path.name not in apart
    )
    for name in re.findall(r"^([a-z]+)/ ", tree, re.MULTILINE):
        assert (ROOT / name).is_dir(), name
