"""Every snippet of the documentation runs; every figure has its command; the page on adding files adds working ones."""

import inspect
import json
import re
import shlex
import sys
import tomllib

import matplotlib.pyplot as plt
import pytest
import snippets
from snippets import ROOT, fenced

import survey.methods
import survey.scenes
from survey import cli, modules, status
from survey.request import workflow

DOCS = ROOT / "workflows/docs"
PAGES = sorted(DOCS.glob("*.md"))
NOTEBOOKS = sorted((ROOT / "workflows/notebooks").glob("*.ipynb"))
each_page = pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty folder to work in, with small copies of the workflows."""
    snippets.copy_workflows(tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    yield tmp_path
    plt.close("all")


@pytest.fixture
def tool(monkeypatch):
    """Import a module of the documentation's own tools by its name."""
    monkeypatch.syspath_prepend(str(DOCS))
    return lambda name: __import__(name)


@each_page
def test_the_python_of_a_page_runs(page, folder):
    scope = {"__name__": "__main__"}
    for code in fenced(page.read_text(), "python"):
        if not code.startswith("# file: "):
            exec(compile(code, page.name, "exec"), scope)


def commands(page):
    lines = "".join(fenced(page.read_text(), "sh")).replace("\\\n", " ").splitlines()
    return [line for line in lines if line.startswith("survey ")]


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda path: path.stem)
def test_the_commands_of_a_page_run(page, folder, monkeypatch):
    monkeypatch.setattr(cli, "_stop_on_sigterm", lambda: None)
    for line in commands(page):
        words = re.sub(r"\.num=\d+", f".num={snippets.FEWEST}", line)
        with pytest.raises(SystemExit) as ended:
            cli.main(shlex.split(words, comments=True)[1:])
        assert ended.value.code == 0, line


@each_page
def test_the_workflows_of_a_page_are_accepted(page, folder):
    for text in fenced(page.read_text(), "toml"):
        assert workflow.check(tomllib.loads(text)).scene


def test_every_key_of_a_workflow_is_told():
    page = (DOCS / "workflow_file.md").read_text()
    tables = [workflow.File, workflow.Spread, workflow.Listed, workflow.Solver, workflow.OutputTable]
    keys = {key for table in [*tables, workflow.Boundaries, workflow.Refine] for key in table.model_fields}
    told = "".join(re.findall(r"^\| `(.*?)` \|", page, re.MULTILINE))
    assert [key for key in keys if key not in told] == []


@pytest.fixture
def added(tmp_path, monkeypatch):
    """The module of a file on the page `extend`, in its folder for the time of the test: added(folder, name)."""

    def add(package, name):
        kind = package.__name__.rpartition(".")[2]
        (code,) = re.findall(rf"```python\n# file: survey/{kind}/{name}\.py\n(.*?)```", page, re.DOTALL)
        (tmp_path / f"{name}.py").write_text(code)
        monkeypatch.setattr(package, "__path__", [*package.__path__, str(tmp_path)])
        monkeypatch.setitem(sys.modules, f"{package.__name__}.{name}", None)
        del sys.modules[f"{package.__name__}.{name}"]
        return modules.load(package, name, kind)

    page = (DOCS / "extend.md").read_text()
    return add


def test_the_scene_of_the_page_passes_what_every_scene_passes(added, monkeypatch):
    import test_scenes

    scene, ran = added(survey.scenes, "vertical"), 0
    for name, check in vars(test_scenes).items():
        needs = inspect.signature(check).parameters if name.startswith("test_") else {}
        if "scene" in needs:
            with monkeypatch.context() as own:
                check(
                    **{k: v for k, v in {"seed": 1, "monkeypatch": own}.items() if k in needs}, scene=scene, options={}
                )
            ran += 1
    assert ran >= 6


def test_what_is_known_of_the_scene_of_the_page(added):
    """At e = 0 the frequency is sqrt K; against DOP853 of scipy at e = 0.6."""
    import numpy as np
    from scipy.integrate import solve_ivp

    added(survey.scenes, "vertical")
    ds = survey.evaluate("vertical", K=[0.3, 8.0], e=[0.0, 0.6])
    assert (abs(ds.discriminant[:, 0] - 2 * np.cos(2 * np.pi * np.sqrt(ds.K))) <= ds.discriminant_error[:, 0]).all()
    slope = lambda f, y: [y[1], -(1 + 7.0 / (1 + 0.6 * np.cos(f))) * y[0]]  # noqa: E731
    ends = [solve_ivp(slope, [0, np.pi], y, "DOP853", rtol=1e-12, atol=1e-12).y[:, -1] for y in ([1, 0], [0, 1])]
    assert float(ds.y1[1, 1]) == pytest.approx(ends[0][0], abs=1e-9)
    assert float(ds.dy2[1, 1]) == pytest.approx(ends[1][1], abs=1e-9)
    motion = ds.survey.trajectory(K=8.0, e=0.6, figure=False)
    half = motion.sel(f=np.pi, method="nearest")
    assert float(half.y1) == pytest.approx(ends[0][0], abs=1e-6) and "stable" in str(ds.survey.point(K=8.0, e=0.6))


def test_the_method_of_the_page_passes_what_every_method_passes(added, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tests/methods"))
    import test_method_conformance as conformance

    method = added(survey.methods, "magnus4")
    assert abs(conformance.measured_order(method) - method.ORDER) < 0.15
    assert conformance.bars_hold(method)


def test_every_figure_has_its_words_and_one_command(tool):
    figures = tool("figures")
    for path in (ROOT / "results").glob("*.png"):
        assert figures.caption(path.name) and figures.maker(path.name) in figures.commands()
    assert figures.maker("precision_satellite.png").startswith("survey precision satellite ")
    assert figures.maker("libration_elliptic_collision.png") == "survey run workflows/libration_elliptic.toml"
    assert figures.maker("libration_verdict.png") == "python workflows/libration_coefficients.py -o results"
    with pytest.raises(ValueError, match="no command"):
        figures.maker("drawn_by_hand.png")


@pytest.mark.parametrize("page", [ROOT / "README.md", *PAGES, *(ROOT / "results").glob("*.md")], ids=lambda p: p.stem)
def test_every_picture_of_a_page_lies_in_the_results(page):
    for target in re.findall(r"!\[[^]]*\]\(([^)]*)\)", page.read_text()):
        name = target.removeprefix("results/")
        assert (ROOT / "results" / name).is_file() and "/" not in name, target


def test_the_comparison_is_what_was_measured(tool):
    comparisons = tool("comparisons")
    records = json.loads((ROOT / "results/precision_satellite.json").read_text())["records"]
    rows = [r for r in records if r["work"] == "row" and r["method"] == "auto" and r["error"] <= 1e-10]
    quickest = min(row["seconds_per_point"] for row in rows)
    of_row = comparisons.page().partition("## satellite")[2].partition("### row")[2].partition("###")[0]
    (auto,) = re.findall(r"^\| auto \|.*", of_row, re.MULTILINE)
    assert float(re.findall(r"([\d.]+) ns", auto)[-1]) == pytest.approx(quickest * 1e9, rel=0.01)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_kept_without_outputs(path):
    cells = json.loads(path.read_text())["cells"]
    assert cells[0]["cell_type"] == "markdown" and "?" in "".join(cells[0]["source"])  # the question
    assert all(not cell["outputs"] and cell["execution_count"] is None for cell in cells if cell["cell_type"] == "code")


def test_every_scene_has_its_notebook():
    assert set(modules.names(survey.scenes)) | {"own_hill", "overnight"} <= {path.stem for path in NOTEBOOKS}


def test_every_scene_has_its_mathematics_and_its_page_shows_it(tool):
    pages = tool("scene_pages").pages()
    for name in modules.names(survey.scenes):
        title = (ROOT / f"survey/scenes/{name}.md").read_text().partition("\n")[0].removeprefix("# ")
        assert tool("scene_pages").escaped(title) in pages[f"scenes/{name}.md"], name


def test_an_item_of_a_list_keeps_its_lines(tool):
    """And an indented formula that stands alone is shown as it is."""
    notes = tool("scene_pages").notes
    shown = notes("* one,\n  and on\n* two:\n  (1) x = y\n")
    assert shown.strip() == "* one,\n  and on\n* two:\\\n  (1) x = y"
    assert "```text\n  x_1 = y_1\n```" in notes("so\n\n  x_1 = y_1\n\nthen")


@pytest.mark.parametrize("page", [ROOT / "README.md", DOCS / "overnight.md"], ids=lambda path: path.stem)
def test_the_statuses_that_count_as_failed_are_told(page):
    (told,) = re.findall(r"Failed.*? are points with the status\s([^.]*)\.", page.read_text())
    failures = {name for name, code in status.CODES.items() if code in status.FAILURES and name != "pending"}
    assert set(re.findall(r"`(\w+)`", told)) == failures


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "results/README.md", *PAGES], ids=lambda p: p.stem)
def test_what_the_shell_would_change_is_quoted(page):
    for word in re.findall(r"--set (\S+)", page.read_text()):
        assert word.startswith("'") or not set(word) & set("[]{}*"), word
