"""Every file that a page, a docstring or a comment names exists, and so does every module of survey."""

import re

import pytest
from snippets import ROOT

TOPS = "survey|tests|workflows|results"
FOLDERS = ("", ".github/", "results/", "survey/**/", "tests/**/", "workflows/**/")
PAGES = sorted(
    {
        path
        for folder in FOLDERS
        for end in ("md", "py", "toml", "ipynb")
        for path in ROOT.glob(f"{folder}*.{end}")
    }
)
EXTENDED = set(
    re.findall(
        r"^# (?:file|added to): (\S+)$",
        (ROOT / "workflows/docs/extend.md").read_text(),
        re.MULTILINE,
    )
)
# what a reader of that page would add
EXTENDED |= {"survey/scenes/vertical.md", "tests/scenes/test_vertical.py"}
# by commands; wrong on purpose
MADE = re.compile(r"results/[\w/]*\.nc|results/(attack\.md|x\.png|map\.nc/)")


def named(text):
    """The paths that a text names, but patterns such as survey/scenes/NAME.py, and modules as paths."""
    paths = re.findall(rf"(?<![\w/.~-])((?:{TOPS})/[\w./*{{}}-]*[\w/}}*])", text)
    modules = re.findall(r"(?<![\w.])`(survey(?:\.[a-z_0-9]+)+)`", text)
    return {path for path in paths if not re.search(r"[A-Z]{3,}|[*{}]", path)}, set(modules)


def exists(module):
    """Is this a module, or a name in one?"""
    path = ROOT / module.replace(".", "/")
    if any(one.startswith(module.replace(".", "/")) for one in EXTENDED):
        return True
    return (
        path.is_dir()
        or path.with_suffix(".py").exists()
        or path.parent.with_suffix(".py").exists()
        or _public(path)
    )


def _public(path):
    """Does the package define the name, or do users call it `survey.NAME`?"""
    text = "".join(one.read_text() for one in path.parent.glob("__init__.py*"))
    return re.search(rf"\b{path.name}\b", text) is not None


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_what_is_named_exists(page):
    paths, modules = named(page.read_text())
    gone = [
        p for p in paths if not (ROOT / p).exists() and p not in EXTENDED and not MADE.fullmatch(p)
    ]
    assert gone == [] and [module for module in modules if not exists(module)] == []


def test_the_tests_mirror_the_packages():
    """Tests of a package lie in a folder of its name."""
    folders = {
        path.parent.relative_to(ROOT / "tests") for path in (ROOT / "tests").rglob("test_*.py")
    }
    assert [
        f for f in sorted(folders) if not ((ROOT / "survey" / f).is_dir() or str(f) == "workflows")
    ] == []
