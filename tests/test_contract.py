"""A scene or method that does not keep to its table is refused in one line that names the file and
the table.
"""

import importlib.util
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import survey.methods
import survey.scenes
from survey import BadInput, contract, measures, modules
from survey.scene import Request
from survey.scenes import mathieu
from survey.sweep import solve

SCENE = Path(survey.scenes.__file__).with_name("mathieu.py")
METHOD = Path(survey.methods.__file__).with_name("magnus6.py")
FAMILIES = [family for folder in measures._folders() for family in folder.METHODS]
CELLS = Path(survey.measures.__file__).parent / "hill" / "cells.py"


def changed(path, tmp_path, old, new):
    """The module of a copy of the file in which `old` stands as `new`."""
    text = path.read_text()
    assert text.count(old) >= 1
    copy = tmp_path / path.name
    copy.write_text(text.replace(old, new))
    spec = importlib.util.spec_from_file_location(f"changed_{path.stem}", copy)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "def trajectory(",
            "def trajectry(",
            "trajectry is not in the table; did you mean 'trajectory'",
        ),
        ("TITLE = ", "TITEL = ", "TITEL is not in the table; did you mean 'TITLE'"),
        ("AUDIT = ", "_AUDIT = ", "AUDIT is missing: methods by which"),
        (
            "def cost(options, sizes)",
            "def cost(options)",
            r"cost\(options\) must be cost\(options, sizes\)",
        ),
        ('FAMILY = "hill"', 'FAMILY = "hil"', "FAMILY names no family 'hil'"),
        ('"dop853"', '"dop85"', "AUDIT: unknown method 'dop85'; did you mean 'dop853'"),
        ('"dop853"', '"agm"', "AUDIT names 'agm', which does not serve the family 'hill'"),
        ("OPTIONS = ()", "OPTIONS = []", r"OPTIONS = \[\] must be of type tuple"),
        ("OPTIONS = ()", 'OPTIONS = ("body",)', "OPTIONS has 'body', which must be of type Option"),
        ("OPTIONS = ()", "OPTIONS = ()\nif True:\n    MORE = 1", "MORE is not in the table"),
        (
            "def cost(options, sizes):",
            "cost = 1e-6\n\n\ndef _cost(options, sizes):",
            "cost must be a function",
        ),
    ],
)
def test_a_typo_in_a_scene_is_one_line(tmp_path, old, new, words):
    scene = changed(SCENE, tmp_path, old, new)
    with pytest.raises(BadInput, match=words) as refused:
        survey.scenes._check(scene)
    line = str(refused.value)
    assert line.startswith(str(tmp_path / "mathieu.py")) and line.endswith(
        "the table is in survey/scenes/__init__.py"
    )
    assert "\n" not in line


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "def hill_scatter(",
            "def hill_scater(",
            "hill_scater is not in the table; did you mean 'hill_scatter'",
        ),
        ('SERVES = ("hill",)', 'SERVES = ("hil",)', "SERVES names no family 'hil'"),
        ("ORDER = 6", "ORDER = 6.0", "ORDER = 6.0 must be of type int"),
        ("def hill_density(rtol)", "def hill_density(tolerance)", r"must be hill_density\(rtol\)"),
        ("SERVES = ", "_SERVES = ", "SERVES is missing"),
        ("def hill_scatter(", "def _hill_scatter(", "hill_scatter is missing: as hill_chain"),
        ("ORDER = 6", "ADAPTIVE = True\nORDER = 6", "hill_walk is missing: fill out"),
        ('COST = {"hill"', 'COST = {"hil"', "COST has 'hil', which SERVES does not name"),
        (
            'SERVES = ("hill",)',
            'SERVES = ("danby",)',
            "it is a name of the family 'hill', which SERVES must then name",
        ),
        ('SERVES = ("hill",)', 'SERVES = ("hill", "floquet")', "floquet_reach is missing: how far"),
    ],
)
def test_a_typo_in_a_method_is_one_line(tmp_path, old, new, words):
    method = changed(METHOD, tmp_path, old, new)
    with pytest.raises(BadInput, match=words) as refused:
        measures.check(method)
    line, own = str(refused.value), "survey/methods/__init__.py"
    assert line.startswith(str(tmp_path / "magnus6.py")) and "\n" not in line
    family = re.search("(hill|floquet)_", words)  # whose table has what is meant
    if family is None:
        assert own in line
    else:
        assert line.endswith(f"survey/measures/{family[1]}/__init__.py")
        assert (own in line) == ("is not in the table" in words)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("def find(", "def fined(", "fined is not in the table, but 'find' is"),
        (
            "def find(solve, x, y,",
            "def find(solve, y, x,",
            r"must be find\(solve, x, y, each, report\)",
        ),
        ("def find(", "def _find(", "find is missing: the Cells of a rectangle"),
        ("MOST = 10_000_000", "MOST = 1e7", "MOST = 10000000.0 must be of type int"),
        (
            "MOST = 10_000_000",
            "MOST = 10_000_000\nrefusl = None",
            "refusl is not in the table, but 'refusal' is",
        ),
    ],
)
def test_a_typo_in_what_is_asked_of_a_family_is_one_line(tmp_path, old, new, words):
    cells = changed(CELLS, tmp_path, old, new)
    with pytest.raises(BadInput, match=words) as refused:
        contract.check_offered(cells, measures.QUESTIONS["cells"], "survey/measures/__init__.py")
    assert str(tmp_path / "cells.py") in str(refused.value) and "\n" not in str(refused.value)


def test_questions_are_found_by_the_folder_of_their_family():
    found = {
        family: [q for q in measures.QUESTIONS if measures.question(family, q)]
        for family in FAMILIES
    }
    assert found["hill"] == [
        "curves",
        "surfaces",
        "edges",
        "folds",
        "cells",
        "trace_curves",
        "trace_cells",
    ]
    assert found["nutation"] == ["curves"]
    assert measures.question("no family", "curves") is None


def test_all_scenes_and_methods_keep_to_their_tables():
    for name in modules.names(survey.scenes):
        survey.scenes.load(name)
    for name in modules.names(survey.methods):
        measures.method(name)


def test_a_new_file_is_checked_when_it_is_loaded(tmp_path, monkeypatch):
    folder = tmp_path / "more"
    folder.mkdir()
    shutil.copy(SCENE, folder / "mathew.py")
    (folder / "mathew.py").write_text(
        SCENE.read_text().replace("def trajectory(", "def trajectry(")
    )
    monkeypatch.setattr(survey.scenes, "__path__", [*survey.scenes.__path__, str(folder)])
    with pytest.raises(BadInput, match="did you mean 'trajectory'"):
        survey.evaluate("mathew", a=1.0, q=0.1)


def test_an_output_that_a_scene_forgets_is_one_line():
    request = Request({}, "auto", 1e-8, frozenset({"discriminant"}))
    with pytest.raises(BadInput, match=r"solve returns no discriminant.*, which OUTPUTS declare"):
        solve.stored(mathieu, request, {"status": np.zeros(1)}, (1,))
