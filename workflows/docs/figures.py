"""Which command of the repository makes each figure: read from the commands in `results/README.md`,
never typed.
"""

import re
import shlex
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "results"
INTRODUCTION = """\
# Figures, and the commands that make them

Every figure of the README and of this documentation is made by one command, run in the root of the repository;
those of the notebooks are made by the notebooks.
"""


def commands():
    """The commands that made the results, in order."""
    return re.findall(
        r"^(?:survey|python) .+$", (RESULTS / "README.md").read_text(encoding="utf-8"), re.MULTILINE
    )


def shown():
    """{file: what it shows}, as the table of the results says; a name may stand for several files."""
    rows = re.findall(
        r"^\| (`[^|]*`) \| (.*) \|$",
        (RESULTS / "README.md").read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    return {name: words for names, words in rows for name in re.findall(r"`([^`]*)`", names)}


def caption(figure):
    """What a figure shows."""
    for pattern, words in sorted(shown().items(), key=lambda row: -len(row[0])):
        if re.fullmatch(re.escape(pattern).replace(r"\*", ".*").replace("SCENE", ".+"), figure):
            return words
    raise ValueError(f"{figure}: results/README.md does not say what it shows")


def maker(figure):
    """The one command that makes the figure; raises ValueError if there is none, or more than one."""
    fits = {command: _fit(command, figure) for command in commands()}
    best = [command for command, fit in fits.items() if fit == max(fits.values()) > 0]
    if len(best) != 1:
        raise ValueError(
            f"{figure}: made by {best or 'no command in results/README.md'}; exactly one must make it"
        )
    return best[0]


def _fit(command, figure):
    """How many letters of the figure's name the command, its workflow or its script says; 0: it
    does not make it.
    """
    words = shlex.split(command)
    if words[:2] in (["survey", "precision"], ["survey", "failures"]):
        names = [f"{words[1]}_{words[2]}.png"]
    elif words[:2] == ["survey", "run"]:
        names = [] if "output.figures=[]" in words else of_workflow(ROOT / words[2])
    elif words[:2] == ["survey", "prove"]:
        names = of_workflow(ROOT / words[2], "_proved")
    elif words[0] == "survey":
        names = []
    else:  # {...} in a name may be anything; a script may be a folder
        script = ROOT / words[1]
        texts = [
            path.read_text(encoding="utf-8")
            for path in (script.glob("*.py") if script.is_dir() else [script])
        ]
        names = re.findall(r'"((?:\w|\{\w+\})+\.(?:png|\{\w+\}))"', "\n".join(texts))
    fixed = [re.sub(r"\{\w+\}", "", name) for name in names]
    patterns = [re.sub(r"\\\{\w+\\\}", r"\\w+", re.escape(name)) for name in names]
    return max(
        (len(f) for f, p in zip(fixed, patterns, strict=True) if re.fullmatch(p, figure)), default=0
    )


def of_workflow(path, ending=""):
    """The figures that a workflow draws beside its output: OUT.png, and OUT_NAME.png from the second on."""
    output = tomllib.loads(path.read_text(encoding="utf-8"))["output"]
    stem = Path(output["path"]).stem + ending
    return [
        f"{stem}.png" if i == 0 else f"{stem}_{name}.png"
        for i, name in enumerate(output.get("figures", []))
    ]


def page():
    """The page of all figures."""
    figures = sorted(path.name for path in RESULTS.glob("*.png"))
    rows = [
        f"| [`{name}`](results/{name}) | {caption(name)} | `{maker(name)}` |" for name in figures
    ]
    return "\n".join([INTRODUCTION, "| figure | shows | made by |", "|---|---|---|", *rows, ""])
