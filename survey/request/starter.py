"""A commented starter workflow of a scene, and the JSON schema of workflow files."""

from survey import measures
from survey.request.checks import check_options, check_parameters
from survey.request.schema import File
from survey.request.user_scene import find
from survey.scene import existing_outputs, exists

NUMBERS = (41, 61)  # of values along the two axes
FAR = 4.0  # where an axis ends whose parameter has no such bound
LEAST, TINY = 0.1, 1e-3  # where an axis begins whose least value is tiny
SCHEMA = "https://json-schema.org/draft/2020-12/schema"


def schema():
    """The JSON schema of a workflow file, from the models that check it."""
    table = File.model_json_schema()
    return {
        "$schema": SCHEMA,
        "title": "survey workflow",
        **{k: v for k, v in table.items() if k != "title"},
    }


def workflow(scene):
    """The text of a workflow that runs as it is, each key with a comment."""
    name, module = find(scene)
    options = check_options(module, {}, ())
    given = getattr(module, "STARTER", {})
    existing = [p for p in module.PARAMETERS if exists(p, options) and not p.instead_of]
    axes = sorted(
        existing, key=lambda p: (not isinstance(given.get(p.name), tuple), p.default is not None)
    )[:2]
    used = check_parameters(module, name, options, {p.name: 0.0 for p in axes} | _missing(existing))
    lines = [
        f'title = "{module.TITLE}"',
        f'scene = "{name}"',
        *_options(module, options),
        "",
        "[axes]",
    ]
    lines += [
        '# the dimensions, in this order: { start, stop, num, spacing = "log" }, { values = [...] }, or a number'
    ]
    for p, number in zip(axes, NUMBERS, strict=False):
        low, high = given.get(p.name) or ends(p)
        lines += [
            f"{p.name} = {{ start = {low:g}, stop = {high:g}, num = {number} }}  # {_about(p)}"
        ]
    for i, p in enumerate(p for p in existing if p not in axes):
        value = given.get(p.name, inside(p, i) if p.default is None else p.default)
        line = f"{p.name} = {value:g}  # {_about(p)}"
        lines += [line if p.default is None or p.name in given else f"# {line}"]
    lines += [f"# {p.name} instead of {p.instead_of}: {_about(p)}" for p in module.PARAMETERS
              if p.instead_of in used]  # fmt: skip
    lines += ["", "[solver]", 'method = "auto"  # or one that `survey scenes` lists for this scene',
              "rtol = 1e-10  # the requested accuracy: |error| <= rtol (1 + |value|)", "", "[output]",
              f'path = "{name.removesuffix(".py").replace("/", "_")}.nc"']  # fmt: skip
    drawn = [o.name for o in existing_outputs(module, options) if not o.dims]
    figure = given.get("figures", "verdict" if "verdict" in drawn else drawn[0])
    lines += [f'figures = ["{figure}"]  # pictures beside the file; of {", ".join(dict.fromkeys(drawn))}',
              "# variables = [...]  # which outputs are stored; by default all but those on request"]  # fmt: skip
    curves = measures.curves(module)
    if curves and not (
        hasattr(curves, "refusal") and curves.refusal([p.name for p in axes], module, options)
    ):
        # tongues are narrower than cells, and their edges take no longer than the points
        quick = "" if not hasattr(curves, "refusal") else "# "
        lines += [
            "",
            f"{quick}[boundaries]  # the curves between verdicts, exact, in the file and its pictures",
        ]
    if measures.cells(module) is not None:
        lines += ["", "# [refine]  # cells as small as needed where the verdict changes, and the area of each verdict",
                  "# width = 0.001  # of the smallest cells, as a fraction of the axes"]  # fmt: skip
    return "\n".join(lines) + "\n"


def _missing(existing):
    return {p.name: 0.0 for p in existing if p.default is None}


def _options(module, options):
    if not options:
        return []
    described = {option.name: option for option in module.OPTIONS}
    return ["", "[options]"] + [
        f'{key} = "{value}"  # {described[key].long_name}: {" | ".join(described[key].choices)}'
        for key, value in options.items()
    ]


def _about(p):
    unit = "" if p.units == "1" else f" ({p.units})"
    return f"{p.long_name}{unit}; {p.domain}"


def ends(p):
    """(start, stop) of an axis inside the parameter's domain, between the values that it excludes."""
    low = p.minimum if abs(p.minimum) <= 10 * FAR else (0.0 if p.minimum >= 0 else -FAR)
    low = LEAST if 0.0 < low < TINY else low
    high = min(p.maximum, low + 2 * FAR)
    cuts = [x for x in p.excluded if low < x < high]
    high = min([high, *cuts])
    inside = 0.02 * (high - low)
    low = low + inside if not p.holds([low]).all() else low
    high = high - inside if not p.holds([high]).all() else high
    return float(f"{low:.3g}"), float(f"{high:.3g}")


def inside(p, number=0):
    """A value of the parameter, another one for each `number`: where two are equal, motions are special."""
    low, high = ends(p)
    some = (0.5 + 0.1 * number, 0.5, 1.0)
    return next(
        (x for x in some if low < x < high and p.holds([x]).all()),
        round(low + 0.3 * (high - low), 3),
    )
