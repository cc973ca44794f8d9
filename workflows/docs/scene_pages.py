"""A page for each scene that is found in its folder: what it answers, its pictures, its mathematics with the errata."""

import re
from pathlib import Path

import figures

import survey.api
import survey.scenes

ROOT = Path(__file__).resolve().parents[2]
RESULTS = ROOT / "results"
LISTS = ("parameters", "options", "outputs", "status", "methods")


def pages():
    """{path: text} of the scenes' pages and of their list."""
    titles = survey.api.scenes()
    index = [
        "# The scenes",
        "",
        "A scene is a physical system and the questions asked of it.",
        "",
        "| scene | answers |",
    ]
    index += ["|---|---|", *(f"| [`{name}`]({name}.md) | {title} |" for name, title in titles.items()), ""]
    toctree = ["```{toctree}", ":hidden:", "", *titles, "```", ""]
    return {"scenes/index.md": "\n".join(index + toctree)} | {f"scenes/{name}.md": _page(name) for name in titles}


def _page(name):
    scene = survey.api.scene(name)
    parts = [f"# {name}", scene["title"] + ".", f"```text\n{scene['about']}\n```"]
    parts += [*_results(name, survey.api.scenes()), "## In words", f"The output of `survey scenes {name}`."]
    for heading in LISTS:
        rows = [f"| `{key}` | {escaped(words).replace('|', chr(92) + '|')} |" for key, words in scene[heading].items()]
        parts += ["\n".join([f"| {heading} | |", "|---|---|", *rows])] if rows else []
    parts += ["Sources:", "\n".join(f"- {escaped(line)}" for line in scene["references"])]
    return "\n\n".join(parts + _mathematics(name)) + "\n"


def _results(name, names):
    """Pictures and pages of the results whose names begin with the scene's."""
    longer = [other for other in names if other.startswith(name) and other != name]

    def own(path):
        stem = path.stem.removeprefix("precision_")
        return stem.startswith(name) and not any(stem.startswith(other) for other in longer)

    read = [path for path in sorted(RESULTS.glob("*.md")) if own(path)]
    seen = [path for path in sorted(RESULTS.glob("*.png")) if own(path)]
    parts = ["## Results"] if read or seen else []
    if read:
        parts.append("\n".join(f"- [{_title(path)}](../results/{path.name})" for path in read))
    for path in seen:
        words = figures.caption(path.name)
        parts.append(
            f"![{words}](../results/{path.name})\n\n{words[0].upper() + words[1:]}: `{figures.maker(path.name)}`."
        )
    return parts


def _title(path):
    return path.read_text().splitlines()[0].removeprefix("# ")


def _mathematics(name):
    path = ROOT / f"survey/scenes/{name}.md"
    if not path.exists():
        return []
    title, text = path.read_text().split("\n", 1)
    return [f"## Mathematics and errata\n\n*{escaped(title.removeprefix('# '))}*", notes(text)]


def escaped(text):
    """Plain text as Markdown: stars, underscores, angles and brackets outside of code are themselves."""
    parts = re.split(r"(`[^`]*`|\*\*[^*\n]+\*\*)", text)
    return "".join(part if i % 2 else re.sub(r"([*_<\[\]\\~])", r"\\\1", part) for i, part in enumerate(parts))


def notes(text):
    """The mathematics as Markdown: headings one lower, indented lines as they stand, numbered equations apart.

    Indented lines that continue an item of a list stay in it; a formula there begins a line.
    """
    out, before = [], "blank"
    for line in text.splitlines():
        kind = _kind(line)
        if kind == "indented" and before == "item":
            kind, out[-1] = "item", out[-1] + "\\" * line.lstrip().startswith("(")
        if before == "indented" and kind == "blank":
            continue
        if kind != before and "indented" in (kind, before):
            out.append("\n```text" if kind == "indented" else "```\n")
        elif kind == "numbered" or (before == "row" and kind != "row"):
            out.append("")
        out.append(_shown(kind, line))
        before = kind
    return "\n".join([*out, "```" if before == "indented" else ""])


def _shown(kind, line):
    if kind == "heading":
        return f"\n#{line}\n"
    if kind == "indented":
        return line.replace("**", "")
    if kind == "item":
        return re.sub("^[*-] ", "* ", line[:2]) + escaped(line[2:])
    return re.sub(r"^([>+])", r"\\\1", escaped(line))


def _kind(line):
    if not line.strip():
        return "blank"
    if line.startswith("#"):
        return "heading"
    if line.startswith("|") and line.endswith("|"):
        return "row"
    if re.match(r"[*-] ", line):
        return "item"
    if line.startswith("  "):
        return "indented"
    return "numbered" if re.match(r"\*?\*?\(S?\d", line) else "text"
