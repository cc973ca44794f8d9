"""Build the documentation, notebooks executed, warnings as errors, without network: `python
workflows/docs/build.py`.

Needs `pip install -e ".[docs]"`. The site is build/docs/html/index.html; the executed notebooks lie
in build/docs/source/notebooks.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import architecture
import comparisons
import figures
import live_maps
import scene_pages

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
OUT = ROOT / "build/docs"
NBMAKE = [
    "-o",
    "addopts=",
    "-p",
    "no:cacheprovider",
    "-q",
    "--nbmake",
    "--overwrite",
    "--nbmake-timeout=300",
]


def assemble(source):
    """Fill the folder `source` with the pages: those beside this file, those made from the repository."""
    shutil.rmtree(source, ignore_errors=True)
    shutil.copytree(HERE, source, ignore=shutil.ignore_patterns("build.py", "__pycache__"))
    shutil.copytree(ROOT / "results", source / "results", ignore=shutil.ignore_patterns("*.nc*"))
    (source / "notebooks").mkdir()
    for path in sorted((ROOT / "workflows/notebooks").glob("*.ipynb")):
        shutil.copy(path, source / "notebooks")
    imports = architecture.modules()
    architecture.check(imports)
    architecture.draw(imports, source / "imports.svg")
    made = scene_pages.pages() | {"figures.md": figures.page(), "peers.md": comparisons.page()}
    made["architecture.md"] = architecture.page(imports)
    made["changelog.md"] = (ROOT / ".github/CHANGELOG.md").read_text(encoding="utf-8")
    made["contributing.md"] = (ROOT / ".github/CONTRIBUTING.md").read_text(encoding="utf-8")
    made["notebooks/index.md"] = _notebooks(source / "notebooks")
    made = {path.name: path.read_text(encoding="utf-8") for path in source.glob("*.md")} | made
    live = live_maps.pages(source / "static/maps")
    for name, text in made.items():
        (source / name).parent.mkdir(exist_ok=True)
        (source / name).write_text(live_maps.replaced(text, name, live), encoding="utf-8")


def _notebooks(folder):
    names = sorted(path.stem for path in folder.glob("*.ipynb"))
    words = "Each starts from a physical question and ends with the figure that answers it (`workflows/notebooks/`)."
    return "\n".join(
        ["# Notebooks", "", words, "", "```{toctree}", ":maxdepth: 1", "", *names, "```", ""]
    )


def check(folder):
    """Every executed notebook ends with the figure that answers its question."""
    for path in sorted(folder.glob("*.ipynb")):
        *_, last = (
            cell
            for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]
            if cell["cell_type"] == "code"
        )
        if not any("image/png" in output.get("data", {}) for output in last["outputs"]):
            sys.exit(f"{path}: its last cell shows no figure")


def main():
    words = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    words.add_argument(
        "--no-notebooks",
        action="store_true",
        help="leave the notebooks as they are, without outputs",
    )
    given = words.parse_args()
    source = OUT / "source"
    assemble(source)
    if not given.no_notebooks:
        print("running the notebooks, a dot for each", flush=True)
        run("pytest", *NBMAKE, "-n", "2", str(source / "notebooks"))
        check(source / "notebooks")
    print("making the pages", flush=True)
    run(
        "sphinx",
        "-q",
        "-W",
        "--keep-going",
        "-E",
        "-d",
        str(OUT / "doctrees"),
        str(source),
        str(OUT / "html"),
    )
    print(OUT / "html/index.html")


def run(module, *arguments):
    # `!survey` in a notebook is that of this environment, active or not
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments], cwd=ROOT, env=os.environ | {"PATH": path}
    )
    if done.returncode:
        sys.exit(done.returncode)


if __name__ == "__main__":
    main()
