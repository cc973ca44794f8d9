"""The graph of imports: read from the code, checked against the layers in `pyproject.toml`, and
drawn.

A box is a package, or a module directly in `survey/`; an arrow from one to another says that the
first imports the second.
"""

import ast
import graphlib
import re
import textwrap
import tomllib
from itertools import combinations, permutations
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
INTRODUCTION = """\
# How it is built

The figure is drawn from the code when this page is built: an arrow from one box to another means
that the first imports the second. All arrows point downwards and there is no cycle; otherwise the
build fails. Dark arrows show who depends on whom. Grey ones repeat what a path of dark arrows
already says, or lead to the small modules at the bottom, which everything may use.

![The packages of survey in layers, with an arrow for every import between them; all arrows point down](imports.svg)

A survey runs down the figure. A command (`cli`) or a call from Python (`api`) has its workflow
checked (`request`); the grid is cut into blocks, and each block is solved (`sweep`; a package named
`run` would hide the function `survey.run`). For that a
*scene*, the physical system, hands its equations to a *measure*, the question; the measure calls a
*method*, an integrator or a quadrature, whose inner loops are *kernels*. The results are labelled
and stored (`file`) and drawn (`show`); what is asked of a finished survey is `analysis`.

Blue boxes work on arrays of numbers only: they know no labels, files or processes. Scenes, measures
and methods are found by their file names, so [adding one](extend.md) means adding a file, and no
list has to be edited.
"""
WIDTH, HEIGHT, GAP = 2.2, 0.78, 0.36  # of a box, and between layers, in inches
COLUMNS, MARGIN = 5, 0.25
LETTERS = 32  # in a line of a box


def rules():
    """What `pyproject.toml` says to import-linter: {name of the rule: rule}."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return {rule["name"]: rule for rule in project["tool"]["importlinter"]["contracts"]}


def layers():
    """The names in each layer, from the commands down to what imports nothing."""
    (rule,) = (rule for rule in rules().values() if rule["type"] == "layers")
    return [[name.strip() for name in layer.split("|")] for layer in rule["layers"]]


def of_arrays():
    """The packages that know no labels, files or processes."""
    (rule,) = (
        rule
        for rule in rules().values()
        if {"dask", "xarray"} <= set(rule.get("forbidden_modules", ()))
    )
    return {name.removeprefix("survey.") for name in rule["source_modules"]}


def modules():
    """{module: the modules that it imports}, all of survey's."""
    import grimp

    graph = grimp.build_graph("survey", cache_dir=None)
    return {name: graph.find_modules_directly_imported_by(name) for name in graph.modules}


def packages(imports):
    """{package: the packages that it imports} of {module: the modules that it imports}."""
    found = {name: set() for layer in layers() for name in layer}
    for name, others in imports.items():
        pairs = {(_package(name), _package(other)) for other in others}
        for one, other in pairs:
            if one and other and one != other:
                found.setdefault(one, set()).add(other)
    return found


def _package(module):
    return module.split(".")[1] if "." in module else ""


def check(imports):
    """Raise ValueError for a cycle of modules, or an import between packages that does not go down."""
    try:
        list(graphlib.TopologicalSorter(imports).static_order())
    except graphlib.CycleError as error:
        raise ValueError(
            f"these modules import each other in a cycle: {' -> '.join(error.args[1])}"
        ) from None
    depth = {name: number for number, layer in enumerate(layers()) for name in layer}
    for one, others in packages(imports).items():
        for other in others:
            if one not in depth or other not in depth:
                raise ValueError(
                    f"pyproject.toml has no layer for {one if one not in depth else other}"
                )
            if depth[one] >= depth[other]:
                raise ValueError(
                    f"{one} imports {other}, which is not below it in pyproject.toml's layers"
                )


def meaning(package):
    """The first sentence of its docstring, without its name and what is in brackets."""
    path = ROOT / "survey" / package
    text = (path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text(
        encoding="utf-8"
    )
    line = ast.get_docstring(ast.parse(text)).partition("\n")[0]
    line = re.sub(r" \([^)]*\)", "", line.removeprefix(f"The {package}: "))
    words = re.split(r"\.(?: |$)|; ", line)[0]
    return words[0].upper() + words[1:]


def page(imports):
    """The page: the figure, and a table of the same."""
    names = [name for layer in layers() for name in layer]
    arrows = packages(imports)
    rows = [
        f"| `{name}` | {meaning(name)} | {', '.join(other for other in names if other in arrows[name])} |"
        for name in names
    ]
    return "\n".join([INTRODUCTION, "| | holds | imports |", "|---|---|---|", *rows, ""])


def implied(arrows):
    """The arrows that a path of other arrows implies."""
    below = {}
    for name in graphlib.TopologicalSorter(arrows).static_order():
        below[name] = arrows.get(name, set()).union(
            *(below[other] for other in arrows.get(name, ()))
        )
    return {
        (a, b) for a in arrows for b in arrows[a] if any(b in below[c] for c in arrows[a] - {b})
    }


def draw(imports, path):
    """Draw the graph to `path`."""
    import matplotlib

    matplotlib.use("agg")
    import matplotlib.pyplot as plt

    rows, arrows, blue = layers(), packages(imports), of_arrays()
    foot = set().union(*rows[1 + max(i for i, row in enumerate(rows) if set(row) & blue) :])
    main = {
        a: {b for b in others if b not in foot} for a, others in arrows.items() if a not in foot
    }
    positions = _positions(rows, main)
    figure = plt.figure(figsize=(COLUMNS * (WIDTH + MARGIN), len(rows) * (HEIGHT + GAP)))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, figure.get_figwidth()), ylim=(-figure.get_figheight(), 0))
    axes.axis("off")
    pale = implied(main)
    for a, others in arrows.items():
        for b in others:
            light = (a, b) in pale or b in foot
            _arrow(axes, positions[a], positions[b], light, b in foot)
    for name, (x, y) in positions.items():
        fill = "#dcebf7" if name in blue else "#efefef" if name in foot else "#fff4dc"
        _box(axes, x, y, name, meaning(name).replace("`", ""), fill)
    figure.savefig(path)
    plt.close(figure)


def _box(axes, x, y, name, words, fill):
    from matplotlib.patches import FancyBboxPatch

    corner = (x - WIDTH / 2, y - HEIGHT / 2)
    axes.add_patch(
        FancyBboxPatch(
            corner,
            WIDTH,
            HEIGHT,
            "round,pad=0,rounding_size=0.06",
            fc=fill,
            ec="#555",
            lw=0.8,
            zorder=3,
        )
    )
    lines = textwrap.wrap(words, LETTERS)
    axes.text(
        x, y + HEIGHT / 2 - 0.13, name, ha="center", va="center", size=11, weight="bold", zorder=4
    )
    axes.text(
        x,
        y - 0.11,
        "\n".join(lines[:4]),
        ha="center",
        va="center",
        size=8.5,
        linespacing=1.05,
        zorder=4,
    )


def _arrow(axes, start, end, light, foot):
    from matplotlib.patches import FancyArrowPatch

    (x0, y0), (x1, y1) = start, end
    pale = {"color": "#dddddd" if foot else "#b5b5b5", "lw": 0.5, "zorder": 1}
    style = pale if light else {"color": "#222222", "lw": 1.3, "zorder": 2}
    ends = (x0, y0 - HEIGHT / 2), (x1, y1 + HEIGHT / 2)
    axes.add_patch(
        FancyArrowPatch(*ends, arrowstyle="-|>", shrinkA=0, shrinkB=0, mutation_scale=8, **style)
    )


def _positions(rows, arrows):
    """{name: (x, y)}: layer after layer, the columns on which dark arrows are short and miss other boxes."""
    column = {name: 0.5 * (COLUMNS - len(row)) + i for row in rows for i, name in enumerate(row)}
    depth = {name: number for number, row in enumerate(rows) for name in row}
    dark = [(a, b) for a in arrows for b in arrows[a] if (a, b) not in implied(arrows)]

    def cost():
        total = 0.0
        for a, b in dark:
            (x0, y0), (x1, y1) = (column[a], depth[a]), (column[b], depth[b])
            total += abs(x1 - x0)
            for name in column:
                if y0 < depth[name] < y1:
                    off = abs(x0 + (x1 - x0) * (depth[name] - y0) / (y1 - y0) - column[name])
                    total += 5.0 * max(0.0, 0.75 - off)
        return total

    for _ in range(6):
        for row in rows:
            free = [0.5 * i for i in range(2 * COLUMNS - 1)]
            orders = (
                p
                for p in permutations(free, len(row))
                if all(abs(x - y) >= 1 for x, y in combinations(p, 2))
            )

            def tried(order, row=row):
                column.update(zip(row, order, strict=True))
                return cost()

            column.update(zip(row, min(orders, key=tried), strict=True))
    pitch = WIDTH + MARGIN
    return {
        name: (pitch * (column[name] + 0.5), -(depth[name] + 0.5) * (HEIGHT + GAP))
        for name in column
    }
