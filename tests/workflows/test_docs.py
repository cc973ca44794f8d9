"""Every snippet of the documentation runs; every figure has its command; the page on adding files
adds working ones.
"""

import doctest
import importlib
import inspect
import json
import re
import shlex
import sys
import tomllib
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pytest
import snippets
import xarray as xr
from mpmath import mp
from snippets import ROOT, fenced

import survey.methods
import survey.scenes
from survey import cli, measures, modules, status
from survey.accessor import Survey
from survey.methods import agm, carlson
from survey.request import schema, workflow

DOCS = ROOT / "workflows/docs"
PAGES = sorted(DOCS.glob("*.md"))
NOTEBOOKS = sorted((ROOT / "workflows/notebooks").glob("*.ipynb"))
LONG = {"own_equation", "damping", "analysis"}  # pages whose examples take long
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


@pytest.mark.parametrize(
    "page",
    [pytest.param(p, id=p.stem, marks=[pytest.mark.slow] * (p.stem in LONG)) for p in PAGES],
)
def test_the_python_of_a_page_runs(page, folder):
    scope = {"__name__": "__main__"}
    for code in fenced(page.read_text(), "python"):
        if not code.startswith(("# file: ", "# added to: ")):
            exec(compile(code, page.name, "exec"), scope)


def commands(page):
    lines = "".join(fenced(page.read_text(), "sh")).replace("\\\n", " ").splitlines()
    return [line for line in lines if line.startswith("survey ")]


@pytest.mark.slow
@pytest.mark.parametrize(
    "page", [page for page in PAGES if commands(page)], ids=lambda path: path.stem
)
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


def test_every_key_of_a_workflow_is_documented():
    page = (DOCS / "workflow_file.md").read_text()
    tables = [schema.File, schema.Spread, schema.Listed, schema.SolverTable, schema.OutputTable]
    keys = {
        key
        for table in [*tables, schema.BoundariesTable, schema.RefineTable]
        for key in table.model_fields
    }
    documented = "".join(re.findall(r"^\| `(.*?)` \|", page, re.MULTILINE))
    assert [key for key in keys if key not in documented] == []


@pytest.fixture
def added(tmp_path, monkeypatch):
    """Put a file of the page `extend` in its package for the time of the test: added(path) gives
    its module.
    """
    blocks = dict(
        re.findall(
            r"```python\n# file: (\S+)\n(.*?)```", (DOCS / "extend.md").read_text(), re.DOTALL
        )
    )

    def add(path):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(blocks[path])
        name = path.removesuffix(".py").removesuffix("/__init__").replace("/", ".")
        package = importlib.import_module(name.rpartition(".")[0])
        if str(tmp_path) not in package.__path__[0]:
            monkeypatch.setattr(
                package,
                "__path__",
                [*package.__path__, str(tmp_path / package.__name__.replace(".", "/"))],
            )
        monkeypatch.setitem(sys.modules, name, None)
        del sys.modules[name]
        return importlib.import_module(name)

    yield add
    _forget()


def _forget():
    """Forget which families and methods there were."""
    measures._folder.cache_clear()
    measures.check.cache_clear()


@pytest.fixture
def extended(tmp_path, monkeypatch):
    """Give a method what the page `extend` adds to its file: extended(method)."""
    blocks = dict(
        re.findall(
            r"```python\n# added to: (\S+)\n(.*?)```", (DOCS / "extend.md").read_text(), re.DOTALL
        )
    )

    def extend(method):
        name = Path(method.__file__).name
        (tmp_path / name).write_text(blocks[f"survey/methods/{name}"])
        scope = dict(vars(method))
        exec(compile((tmp_path / name).read_text(), tmp_path / name, "exec"), scope)
        monkeypatch.setattr(method, "gauss_periods", scope["gauss_periods"], raising=False)
        monkeypatch.setattr(method, "SERVES", (*method.SERVES, "oscillation"))

    yield extend
    _forget()


def passes_what_every_scene_passes(scene, monkeypatch):
    import test_scenes

    ran = 0
    for name, check in vars(test_scenes).items():
        needs = inspect.signature(check).parameters if name.startswith("test_") else {}
        if "scene" in needs:
            with monkeypatch.context() as own:
                others = {k: v for k, v in {"seed": 1, "monkeypatch": own}.items() if k in needs}
                check(scene=scene, options={}, **others)
            ran += 1
    return ran >= 6


def test_the_scene_of_the_page_passes_what_every_scene_passes(added, monkeypatch):
    assert passes_what_every_scene_passes(added("survey/scenes/vertical.py"), monkeypatch)


def test_what_is_known_of_the_scene_of_the_page(added):
    """At e = 0 the frequency is sqrt K; against DOP853 of scipy at e = 0.6."""
    from scipy.integrate import solve_ivp

    added("survey/scenes/vertical.py")
    ds = survey.evaluate("vertical", K=[0.3, 8.0], e=[0.0, 0.6])
    assert (
        abs(ds.discriminant[:, 0] - 2 * np.cos(2 * np.pi * np.sqrt(ds.K)))
        <= ds.discriminant_error[:, 0]
    ).all()
    slope = lambda f, y: [y[1], -(1 + 7.0 / (1 + 0.6 * np.cos(f))) * y[0]]  # noqa: E731
    ends = [
        solve_ivp(slope, [0, np.pi], y, "DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
        for y in ([1, 0], [0, 1])
    ]
    assert float(ds.y1[1, 1]) == pytest.approx(ends[0][0], abs=1e-9)
    assert float(ds.dy2[1, 1]) == pytest.approx(ends[1][1], abs=1e-9)
    motion = ds.survey.trajectory(K=8.0, e=0.6, figure=False)
    half = motion.sel(f=np.pi, method="nearest")
    assert float(half.y1) == pytest.approx(ends[0][0], abs=1e-6) and "stable" in str(
        ds.survey.point(K=8.0, e=0.6)
    )


def test_the_method_of_the_page_passes_what_every_method_passes(added, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tests/methods"))
    import test_hill_conformance as conformance

    method = added("survey/methods/magnus4.py")
    assert abs(conformance.measured_order(method) - method.ORDER) < 0.15
    assert conformance.bars_hold(method)


def test_the_question_of_the_page(added, extended, monkeypatch):
    """Its scene passes what every scene passes, and its period is a complete elliptic integral."""
    for name in ("__init__", "period"):
        added(f"survey/measures/oscillation/{name}.py")
    added("survey/methods/trapezoid.py")
    extended(agm)
    extended(carlson)
    _forget()
    assert passes_what_every_scene_passes(added("survey/scenes/duffing.py"), monkeypatch)
    points = [(1.0, 1.0, 1.5), (2.0, -0.3, 1.5), (0.5, 40.0, 1.5), (1.0, -1.0, 1 - 1e-9)]
    a, b, amplitude = (xr.DataArray(list(column), dims="n") for column in zip(*points, strict=True))
    with mp.workdps(40):
        exact = [
            4 * mp.ellipk(y * z**2 / (2 * u)) / mp.sqrt(u)
            for x, y, z in points
            for u in [x + y * mp.mpf(z) ** 2]
        ]
        for method in ("auto", "carlson", "trapezoid"):
            ds = survey.evaluate("duffing", a=a, b=b, A=amplitude, method=method)
            off = [abs(x - y) for x, y in zip(exact, ds.period.values.tolist(), strict=True)]
            assert (np.array(off, float) <= ds.period_error).all() and (ds.verdict == 1).all(), (
                method
            )
            assert (ds.period_error[:3] < 1e-10).all() and ds.period_error[3] < 1e-4, method
    assert survey.evaluate("duffing", a=1.0, b=-1.0, A=[1.0, 1.1]).verdict.values.tolist() == [
        -1,
        0,
    ]


def test_the_graph_of_imports_is_drawn_and_every_arrow_points_down(tool, tmp_path):
    architecture = tool("architecture")
    imports = architecture.modules()
    architecture.check(imports)
    architecture.draw(imports, tmp_path / "imports.svg")
    assert (tmp_path / "imports.svg").read_text().rstrip().endswith("</svg>")
    page = architecture.page(imports)
    for path in (ROOT / "survey").iterdir():
        if path.suffix == ".py" or (path / "__init__.py").exists():
            assert path.stem == "__init__" or f"| `{path.stem}` |" in page, path.stem


@pytest.mark.parametrize(
    ("importer", "imported", "words"),
    [
        ("survey.kernels.jit", "survey.kernels.lanes", "in a cycle"),
        ("survey.kernels.jit", "survey.sweep.plan", "in a cycle|not below"),
        ("survey.errors", "survey.scene", "errors imports scene, which is not below it"),
        ("survey.errors", "survey.unheard_of", "no layer for unheard_of"),
    ],
)
def test_an_import_upwards_or_in_a_cycle_is_refused(tool, importer, imported, words):
    imports = tool("architecture").modules()
    imports[importer] = {*imports[importer], imported}
    with pytest.raises(ValueError, match=words):
        tool("architecture").check(imports)


def test_every_figure_has_its_words_and_one_command(tool):
    figures = tool("figures")
    for path in (ROOT / "results").glob("*.png"):
        assert figures.caption(path.name) and figures.maker(path.name) in figures.commands()
    assert figures.maker("precision_satellite.png").startswith("survey precision satellite ")
    assert (
        figures.maker("libration_elliptic_collision.png")
        == "survey run workflows/libration_elliptic.toml"
    )
    assert (
        figures.maker("libration_verdict.png")
        == "python workflows/libration_coefficients.py -o results"
    )
    with pytest.raises(ValueError, match="no command"):
        figures.maker("drawn_by_hand.png")


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", *PAGES, *(ROOT / "results").glob("*.md")], ids=lambda p: p.stem
)
def test_every_picture_of_a_page_lies_in_the_results(page):
    for target in re.findall(r"!\[[^]]*\]\(([^)]*)\)", page.read_text()):
        name = target.removeprefix("results/")
        assert (ROOT / "results" / name).is_file() and "/" not in name, target


@pytest.mark.slow
def test_maps_of_the_documentation_are_pages_that_zoom(tool, tmp_path, monkeypatch):
    live = tool("live_maps")
    monkeypatch.setattr(
        live, "MAPS", {name: live.MAPS[name] for name in ("mathieu_proved", "brun_states")}
    )
    found = live.pages(tmp_path / "maps")
    pictures = ["brun_states.png", "brun_states_precession.png", "mathieu_proved.png"]
    assert sorted(found) == pictures
    made = ["brun_states.html", "mathieu_proved.html", *pictures]
    assert sorted(path.name for path in (tmp_path / "maps").iterdir()) == sorted(made)
    proved = tmp_path / "maps/mathieu_proved.html"
    assert proved.stat().st_size < 500_000 and "<strong>Proved</strong>" in proved.read_text()
    text = live.replaced(
        f"before ![a map](../results/{pictures[2]}) after", "scenes/mathieu.md", found
    )
    assert (
        'src="../_static/maps/mathieu_proved.html#show=verdict" title="a map"' in text
        and "results/" not in text
    )
    assert f'<noscript><img src="../_static/maps/{pictures[2]}" alt="a map"></noscript>' in text


def test_the_comparison_is_what_was_measured(tool):
    comparisons = tool("comparisons")
    records = json.loads((ROOT / "results/precision_satellite.json").read_text())["records"]
    rows = [
        r for r in records if r["work"] == "row" and r["method"] == "auto" and r["error"] <= 1e-10
    ]
    quickest = min(row["seconds_per_point"] for row in rows)
    of_row = (
        comparisons.page().partition("## satellite")[2].partition("### row")[2].partition("###")[0]
    )
    (auto,) = re.findall(r"^\| auto \|.*", of_row, re.MULTILINE)
    assert float(re.findall(r"([\d.]+) ns", auto)[-1]) == pytest.approx(quickest * 1e9, rel=0.01)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_are_kept_without_outputs(path):
    cells = json.loads(path.read_text())["cells"]
    # the question
    assert cells[0]["cell_type"] == "markdown" and "?" in "".join(cells[0]["source"])
    assert all(
        not cell["outputs"] and cell["execution_count"] is None
        for cell in cells
        if cell["cell_type"] == "code"
    )


def test_a_scene_with_its_mathematics_has_its_notebook_and_its_kept_file():
    """A scene is whole in its own file; published ones have NAME.md, a notebook and a golden file besides."""
    named = {path.stem for path in (ROOT / "survey/scenes").glob("*.md")}
    assert named <= set(modules.names(survey.scenes))
    # it is in the notebook of `gyrostat`, whose values it has in closed form
    named -= {"gyrostat_integrable"}
    assert {path.stem for path in NOTEBOOKS} == named | {
        "abel",
        "own_examples",
        "own_hill",
        "own_system",
        "overnight",
    }
    assert {path.stem for path in (ROOT / "tests/golden").glob("*.toml")} == named


def test_every_scene_has_its_page_with_its_mathematics(tool):
    pages = tool("scene_pages").pages()  # takes seconds
    for name in modules.names(survey.scenes):
        path = ROOT / f"survey/scenes/{name}.md"
        assert path.exists() == (f"{name}.md" in survey.scenes.load(name).__doc__), name
        if path.exists():
            errata = path.read_text().partition("\n## Errata\n")[2]
            page, errata = (
                pages[f"scenes/{name}.md"],
                errata.replace("../../results/", "../results/"),
            )
            assert errata.strip() and errata.strip() in page, name


@pytest.mark.parametrize("name", modules.names(survey.scenes))
def test_the_examples_of_a_scene_give_what_they_show(name):
    path = ROOT / f"survey/scenes/{name}.md"
    shown = "\n".join(fenced(path.read_text(), "pycon")) if path.exists() else ""
    assert path.exists() == bool(shown)
    test = doctest.DocTestParser().get_doctest(shown, {}, name, str(path), 0)
    assert doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(test).failed == 0


@pytest.mark.parametrize(
    ("words", "page"),
    [
        ("Damping", "damping"),
        ("Zarr", "formats"),
        ("colorbar", "pictures"),
        ("Margins", "margins"),
        ("Units", "units"),
    ],
)
def test_what_people_search_for_is_a_title(words, page):
    """Titles come first in the search of the site."""
    assert words in (DOCS / f"{page}.md").read_text().splitlines()[0]
    assert "Paul trap" in (DOCS / "choose.md").read_text()


def test_formulas_in_tables_of_scenes_are_typeset(tool):
    """No relation, Greek letter or power is left in words, and what is no formula is."""
    formulas = tool("formulas")

    def shown(text, **symbols):
        return "".join(piece for _, piece in formulas.in_words(text, symbols))

    assert shown("strength, 3 mu / R^3 (no unit); 0 <= amplitude < 1.5", amplitude=r"\beta") == (
        r"strength, $3 \mu / R^{3}$ (no unit); $0 \le \beta < 1.5$"
    )
    assert shown("at b = 0 (61), a thing of K = 1; only when question = trajectory | fate") == (
        "at $b = 0$ (61), a thing of $K = 1$; only when question = trajectory | fate"
    )
    assert shown("where |rho| > 1e+12, sqrt|k| != 0") == (
        r"where $\lvert \rho\rvert > 10^{12}$, $\sqrt{\lvert k\rvert} \ne 0$"
    )
    assert shown("y'' + z y = 0 in (0, 1), A or B") == "$y'' + z y = 0$ in (0, 1), A or B"
    for name, page in tool("scene_pages").pages().items():
        table = re.sub(
            r"(?<!\\)\$[^$]+\$|`[^`]*`",
            "",
            page.partition("## Reference")[2].partition("Sources:")[0],
        )
        greek = r"(?<![\w_])(?:alpha|beta|gamma|theta|mu|nu|rho|sigma|phi|psi|omega|pi)(?![\w_])"
        assert re.findall(rf"{greek}|<=|!=|\w\^|\|\w+\|(?! )", table.replace("\\", "")) == [], name


def test_formulas_of_docstrings_are_typeset(tool):
    """All of them, and none that no docstring holds any more."""
    formulas = tool("formulas")
    public = [
        getattr(survey, name) for name in dir(survey) if inspect.isfunction(getattr(survey, name))
    ]
    public += [member for _, member in inspect.getmembers(Survey, inspect.isfunction)]
    text = "\n".join(inspect.getdoc(one) or "" for one in public)
    assert [formula for formula in formulas.TYPESET if formula not in text] == []
    for line in text.splitlines():
        if not line.startswith((">>>", "...")):
            left = re.sub(r":math:`[^`]*`|`[^`]*`", "", formulas.typeset(line))
            assert not re.search(r"(?<!\w)[xyzqw]'(?!s)|<=|\bphi\(|\^", left), line
    assert formulas.typeset("`x'` is x'") == "`x'` is :math:`x'`"


def test_every_page_is_in_the_table_of_contents():
    listed = re.findall(r"^[\w/]+$", (DOCS / "index.md").read_text(), re.MULTILINE)
    assert {page.stem for page in PAGES} - {"index"} <= set(listed)


@pytest.mark.parametrize("name", modules.names(survey.scenes))
def test_every_scene_tells_its_model_and_the_page_of_models_lists_it(name):
    """What was reduced from what: a paragraph of `survey scenes NAME`, and a row of the page."""
    text = survey.scenes.load(name).__doc__
    (lines,) = re.findall(r"^Model: .*\n(?:.+\n){1,2}\n", text, re.MULTILINE)
    assert "Not for" in lines or "Not where" in lines or "Without" in lines
    assert f"| [`{name}`](scenes/{name}.md) |" in (DOCS / "models.md").read_text()


@pytest.mark.parametrize(
    "path", sorted((ROOT / "survey/scenes").glob("*.md")), ids=lambda path: path.stem
)
def test_the_explanation_of_a_scene_is_what_a_page_needs(path):
    """Its title is the scene's, it shows a drawing, and formulas stand in $, with their brackets closed."""
    text = path.read_text()
    assert text.startswith(f"# {survey.scenes.load(path.stem).TITLE}\n")
    assert "(../../results/drawing_" in text and "\n## Errata" in text
    prose = re.sub(r"```.*?```|`[^`\n]*`", "", text, flags=re.DOTALL)
    formulas = re.findall(r"\$\$(.+?)\$\$", prose, re.DOTALL)
    rest = re.sub(r"\$\$.+?\$\$", "", prose, flags=re.DOTALL)
    formulas += re.findall(r"\$([^$]+)\$", rest)
    assert formulas and "$" not in re.sub(r"\$[^$]+\$", "", rest)
    for formula in formulas:
        assert formula.count("{") == formula.count("}") and len(
            re.findall(r"\\left\b", formula)
        ) == len(re.findall(r"\\right\b", formula)), formula
        assert "\n\n" not in formula, formula


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", DOCS / "overnight.md"], ids=lambda path: path.stem
)
def test_the_statuses_that_count_as_failed_are_reported(page):
    (listed,) = re.findall(r"Failed.*? are points with the status\s([^.]*)\.", page.read_text())
    failures = {
        name for name, code in status.CODES.items() if code in status.FAILURES and name != "pending"
    }
    assert set(re.findall(r"`(\w+)`", listed)) == failures


@pytest.mark.parametrize(
    "page", [ROOT / "README.md", ROOT / "results/README.md", *PAGES], ids=lambda p: p.stem
)
def test_what_the_shell_would_change_is_quoted(page):
    for word in re.findall(r"--set (\S+)", page.read_text()):
        assert word.startswith("'") or not set(word) & set("[]{}*"), word
