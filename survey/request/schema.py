"""What a workflow file may hold: its tables and keys as pydantic models, and what is wrong with one
in a line.
"""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag

from survey import modules
from survey.wording import short, shown

MAX_VALUES = 10**7  # on one axis
Number = Annotated[float, Field(allow_inf_nan=False)]


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class Spread(Table):
    start: Number
    stop: Number
    num: Annotated[int, Field(ge=1, le=MAX_VALUES)]
    spacing: Literal["linear", "log"] = "linear"


class Listed(Table):
    values: list[Number]


def _axis_kind(value):
    if isinstance(value, dict):
        return "values" if set(value) == {"values"} else "spread"
    return "list" if isinstance(value, list) else "number"


AxisEntry = Annotated[
    Annotated[Number, Tag("number")]
    | Annotated[Spread, Tag("spread")]
    | Annotated[Listed, Tag("values")]
    | Annotated[list[Number], Tag("list")],  # short for values
    Discriminator(_axis_kind),
]


class SolverTable(Table):
    method: str = "auto"
    rtol: Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False)] = 1e-10


class OutputTable(Table):
    path: str | None = None
    figures: list[str] = []
    variables: list[str] | None = None
    style: Literal["screen", "paper"] = "screen"


class BoundariesTable(Table):
    axis: str | None = None
    plane: list[str] | None = None
    surfaces: bool = False


class RefineTable(Table):
    width: Annotated[
        Annotated[Number, Tag("number")] | Annotated[dict[str, Number], Tag("table")],
        Discriminator(lambda value: "table" if isinstance(value, dict) else "number"),
    ]


class File(Table):
    title: str = ""
    scene: str
    options: dict[str, Any] = {}
    axes: dict[str, AxisEntry]
    solver: SolverTable = SolverTable()
    output: OutputTable = OutputTable()
    boundaries: BoundariesTable | None = None
    refine: RefineTable | None = None


REMEDIES = {"step": "; give num, the number of values from start to stop, both included"}
EXAMPLES = {"plane": '["NAME", "OTHER"]'}  # of lists
TABLES = {
    "solver": SolverTable,
    "output": OutputTable,
    "axes": Spread,
    "boundaries": BoundariesTable,
    "refine": RefineTable,
}


def complaint(error):
    """The first complaint of a pydantic ValidationError as one line: key, value, what is allowed.

    An unknown key comes before a missing one.
    """
    extra = "extra_forbidden"
    first = min(
        error.errors(),
        key=lambda one: (one["type"] != extra, one["type"] == extra and one["loc"][-1] == "values"),
    )
    # pydantic names the kind of axis after the axis
    tag = 2 if first["loc"][0] in ("axes", "refine") else None
    key = ".".join(short(part, 40) for i, part in enumerate(first["loc"]) if i != tag)
    left = error.error_count() - 1
    more = f" (and {left} more {'mistake' if left == 1 else 'mistakes'})" if left else ""
    if first["type"] == extra and first["loc"][-1] == "values":
        return f"{key} cannot be combined with other keys; give either values alone, or start, stop and num"
    if first["type"] == extra:
        remedy = REMEDIES.get(first["loc"][-1], "") if len(first["loc"]) > 1 else ""
        return f"unknown key {key}{remedy or _nearest(first['loc'], first['input'])}{more}"
    if first["type"] == "missing":
        return f"{key} is missing; add it to the workflow{more}"
    if key.startswith("axes.body") and isinstance(first["input"], str):
        return f"{key}: bodies are named under [options], as in body = {shown(first['input'])}; several, in Python"
    if first["type"] in ("float_type", "int_type") and _is_number(first["input"]):
        return f"{key} = {shown(first['input'])}: it must be a number, without quotes{more}"
    if first["loc"] == ("boundaries", "axis"):
        return (
            f"{key} = {shown(first['input'])}: it must be the name of one axis; "
            f"plane names the two axes of a plane{more}"
        )
    if first["type"] == "list_type":
        example = EXAMPLES.get(first["loc"][-1], '["NAME"]')
        example = "[0.1, 0.2]" if key.startswith("axes.") else example
        return (
            f"{key} = {shown(first['input'])}: it must be a list, "
            f"such as --set '{key}={example}' (with quotes){more}"
        )
    if first["type"] in ("model_type", "model_attributes_type", "dict_type"):
        return f"{key} = {shown(first['input'])}: it must be a valid table, [{key}] on a line of its own{more}"
    if first["type"].startswith("bool_"):
        return f"{key} = {shown(first['input'])}: it must be true or false, without quotes{more}"
    message = first["msg"].partition(" or instance of")[0].replace("dictionary", "table")
    return f"{key} = {shown(first['input'])}: {message[0].lower()}{message[1:]}{more}"


def _is_number(given):
    """Is it a text that reads as a number?"""
    if not isinstance(given, str):
        return False
    try:
        float(given)
    except ValueError:
        return False
    return True


def _nearest(location, given):
    """The keys that are allowed beside an unknown one, the nearest first; where one without a table belongs."""
    meant = modules.OTHER_WORDS.get(location[-1], location[-1])
    alone = len(location) == 1 and not isinstance(given, dict)
    for name in ("solver", "output") if alone else ():
        if meant in TABLES[name].model_fields:
            return f"; put {meant} under [{name}]"
    table = TABLES.get(location[0], File) if len(location) > 1 else File
    known = list(table.model_fields) + (["values"] if table is Spread else [])
    words = modules.unknown("", str(location[-1]), known).removeprefix(
        f"unknown  {shown(str(location[-1]))}"
    )
    if alone and "did you mean" not in words:
        return f"; parameters stand under [axes], options under [options]{words}"
    return words
