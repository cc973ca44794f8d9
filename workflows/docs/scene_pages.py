"""A page for each scene that is found in its folder: its explanation, pictures, parameters, outputs
and methods.
"""

import re
from pathlib import Path

import figures
from formulas import in_words

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
        "A scene is a physical system and the questions asked of it. [Which one fits](../choose.md)?",
        "",
        "| scene | answers |",
    ]
    index += [
        "|---|---|",
        *(f"| [`{name}`]({name}.md) | {title} |" for name, title in titles.items()),
        "",
    ]
    toctree = ["```{toctree}", ":hidden:", "", *titles, "```", ""]
    return {"scenes/index.md": "\n".join(index + toctree)} | {
        f"scenes/{name}.md": _page(name) for name in titles
    }


def _page(name):
    scene = survey.api.scene(name)
    parts = [
        f"# {name}",
        f"**{escaped(scene['title'])}.**",
        _explanation(name) or f"```text\n{scene['about']}\n```",
    ]
    symbols = _symbols(name)
    parts += [
        *_results(name, survey.api.scenes(), symbols),
        "## Reference",
        f"What `survey scenes {name}` prints.",
    ]
    for heading in LISTS:
        rows = [f"| `{key}` | {_cell(words, symbols)} |" for key, words in scene[heading].items()]
        parts += ["\n".join([f"| {heading} | |", "|---|---|", *rows])] if rows else []
    parts += ["Sources:", "\n".join(f"- {escaped(line)}" for line in scene["references"])]
    return "\n\n".join(parts) + "\n"


def _symbols(name):
    """{name: TeX} of the scene's parameters and outputs."""
    module = survey.scenes.load(name)
    return {part.name: part.symbol for part in (*module.PARAMETERS, *module.OUTPUTS) if part.symbol}


def _cell(words, symbols):
    """Words in a cell of a table, their formulas typeset."""
    return "".join(
        piece if is_formula else escaped(piece).replace("|", r"\|")
        for is_formula, piece in in_words(words, symbols)
    )


def _explanation(name):
    """NAME.md, without its title, as it stands beside the scene; "" if there is none."""
    path = ROOT / f"survey/scenes/{name}.md"
    text = path.read_text(encoding="utf-8").partition("\n")[2].strip() if path.exists() else ""
    return text.replace("](../../results/", "](../results/").replace(
        "](../../workflows/docs/", "](../"
    )


def _results(name, names, symbols):
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
        shown = _cell(words[0].upper() + words[1:], symbols)
        parts.append(
            f"![{words}](../results/{path.name})\n\n{shown}: `{figures.maker(path.name)}`."
        )
    return parts


def _title(path):
    return path.read_text(encoding="utf-8").splitlines()[0].removeprefix("# ")


def escaped(text):
    """Plain text as Markdown: stars, underscores, angles, dollars and brackets outside of code are
    themselves.
    """
    parts = re.split(r"(`[^`]*`|\*\*[^*\n]+\*\*)", text)
    return "".join(
        part if i % 2 else re.sub(r"([*_<$\[\]\\~])", r"\\\1", part) for i, part in enumerate(parts)
    )
