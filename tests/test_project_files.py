"""What stands about the program in its own files agrees with the program."""

import re
import tomllib
from pathlib import Path

import yaml

import survey

ROOT = Path(__file__).parent.parent
ABOUT = ROOT / ".github"
VERSION = survey.__version__
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def test_the_citation_names_this_version():
    citation = yaml.safe_load((ABOUT / "CITATION.cff").read_text())
    assert citation["version"] == VERSION and citation["authors"] == [
        {"name": "the survey founders"}
    ]
    assert {"cff-version", "message", "title"} <= set(citation)


def test_the_changelog_tells_of_this_version():
    headings = re.findall(r"^## \[(.*)\]", (ABOUT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert headings[0] == "Unreleased" and headings[1] == VERSION


def test_contributors_and_ci_run_the_same_checks():
    guide, ci = (ABOUT / "CONTRIBUTING.md").read_text(), (ROOT / ".ci/run").read_text()
    for program in ("ruff check .", "lint-imports", "mypy"):
        assert program in guide and program in ci


def test_links_of_the_readme_and_the_guide_lead_somewhere():
    for path in (ROOT / "README.md", *ABOUT.glob("*.md"), ROOT / "results/README.md"):
        for target in re.findall(r"\]\((?!https?:)([^)#]+)", path.read_text()):
            assert (path.parent / target).exists(), f"{path.name}: {target}"


def test_the_typed_view_names_what_the_package_has():
    view = (ROOT / "survey/__init__.pyi").read_text()
    assert sorted(re.findall(r"^from .* import (\w+) as \1$", view, re.MULTILINE)) == survey.__all__


def test_the_distribution_is_described_and_its_version_is_the_packages():
    assert PROJECT["name"] != "survey" and "version" in PROJECT["dynamic"]
    assert "Typing :: Typed" in PROJECT["classifiers"]
    tested = yaml.safe_load((ABOUT / "workflows" / "ci.yml").read_text())["jobs"]["check"][
        "strategy"
    ]["matrix"]
    named = [
        c.rpartition(" ")[2] for c in PROJECT["classifiers"] if re.search(r"Python :: 3\.\d+$", c)
    ]
    assert sorted(tested["python"]) == sorted(named) and len(tested["os"]) == 3


def test_the_files_that_others_expect_are_there():
    for name in (
        "CODE_OF_CONDUCT.md",
        "ISSUE_TEMPLATE/bug.yml",
        "ISSUE_TEMPLATE/scene.yml",
        "CONTRIBUTING.md",
    ):
        assert (ABOUT / name).stat().st_size > 200, name
    hooks = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text())
    assert {hook["id"] for repo in hooks["repos"] for hook in repo["hooks"]} >= {
        "ruff-check",
        "ruff-format",
    }
    for name in ("bug.yml", "scene.yml"):
        form = yaml.safe_load((ABOUT / "ISSUE_TEMPLATE" / name).read_text())
        assert {"name", "description", "body"} <= set(form)


def test_a_tag_publishes_what_it_names():
    release = yaml.safe_load((ABOUT / "workflows" / "release.yml").read_text())
    assert release[True]["push"]["tags"] == ["v*"]  # YAML 1.1 reads the key `on` as true
    assert release["jobs"]["publish"]["needs"] == "build"
    steps = " ".join(step.get("run", "") for step in release["jobs"]["build"]["steps"])
    assert f"dist/{PROJECT['name'].replace('-', '_')}-${{GITHUB_REF_NAME#v}}" in steps
    assert PROJECT["urls"]["Package index"].endswith(f"/project/{PROJECT['name']}/")


def test_the_lowest_xdist_knows_the_options_of_pytest():
    """--no-loadscope-reorder came with 3.8; without it pytest does not start."""
    table = tomllib.loads((ROOT / "pyproject.toml").read_text())
    options = table["tool"]["pytest"]["ini_options"]["addopts"]
    for extra, needs in PROJECT["optional-dependencies"].items():
        for need in needs:
            if need.startswith("pytest-xdist") and "--no-loadscope-reorder" in options:
                lowest = tuple(int(part) for part in need.partition(">=")[2].split("."))
                assert lowest >= (3, 8), extra
