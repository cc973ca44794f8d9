"""TOML -> a checked Workflow. Everything that can be refused is refused here, by name, before any work."""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from math import prod
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tomli_w
from pydantic import BaseModel, ConfigDict, Discriminator, Field, Tag, ValidationError

import survey.methods
from survey import measures, modules
from survey.errors import BadInput, Stopped
from survey.grid import Grid, check_axis, coordinates
from survey.request import user_scene
from survey.scene import Request, condition, exists
from survey.wording import plain, short, shown

MOST = 10**7  # coordinates on one axis
MOST_POINTS = 10**11  # of a map
SUFFIXES = 40  # bytes that the names of files beside the output are longer by
FINEST = 1e-6  # width of a cell as a fraction of its axis
Number = Annotated[float, Field(allow_inf_nan=False)]


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class Spread(Table):
    start: Number
    stop: Number
    num: Annotated[int, Field(ge=1, le=MOST)]
    spacing: Literal["linear", "log"] = "linear"


class Listed(Table):
    values: list[Number]


def _axis_kind(value):
    if isinstance(value, dict):
        return "values" if set(value) == {"values"} else "spread"
    return "number"


AxisValue = Annotated[
    Annotated[Number, Tag("number")] | Annotated[Spread, Tag("spread")] | Annotated[Listed, Tag("values")],
    Discriminator(_axis_kind),
]


class Solver(Table):
    method: str = "auto"
    rtol: Annotated[float, Field(gt=0, lt=1, allow_inf_nan=False)] = 1e-10


class OutputTable(Table):
    path: str | None = None
    figures: list[str] = []
    variables: list[str] | None = None
    style: Literal["screen", "paper"] = "screen"


class Boundaries(Table):
    axis: str | None = None


class Refine(Table):
    width: Annotated[
        Annotated[Number, Tag("number")] | Annotated[dict[str, Number], Tag("table")],
        Discriminator(lambda value: "table" if isinstance(value, dict) else "number"),
    ]


class File(Table):
    title: str = ""
    scene: str
    options: dict[str, Any] = {}
    axes: dict[str, AxisValue]
    solver: Solver = Solver()
    output: OutputTable = OutputTable()
    boundaries: Boundaries | None = None
    refine: Refine | None = None


@dataclass(frozen=True)
class Workflow:
    """A checked survey: `scene` is the scene's module; `text` is the workflow as it was run.

    `refine`: for each axis how wide cells may be, as a fraction of it, and whether it is logarithmic.
    """

    name: str
    title: str
    scene: Any
    grid: Grid
    request: Request
    path: Path
    figures: tuple[str, ...]
    text: str
    boundaries: str | None = None
    refine: Mapping[str, tuple[float, bool]] | None = None
    style: str = "screen"


def read(path, overrides=(), output=None):
    """The checked Workflow in the TOML file `path`, with `KEY=VALUE` overrides; raises BadInput in one line."""
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise BadInput(f"{short(path, 120)}: cannot read this workflow file ({_reason(error)})") from None
    data = _parsed(text, f"{short(path, 120)}: this is not TOML")
    for override in overrides:
        _apply(data, override)
    if overrides:
        changes = "".join(f" --set {override}" for override in overrides)
        text = f"# {plain(f'{path.name}{changes}')}\n\n{_as_toml(data)}"
    return check(data, text, output, default_path=path.with_suffix(".nc").name, near=path.parent)


def _parsed(text, complaint):
    """The table that a TOML text holds; raises BadInput."""
    try:
        return tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, or an integer of more than 4300 digits
        raise BadInput(f"{complaint} ({short(error, 150)})") from None
    except RecursionError:
        raise BadInput(f"{complaint} that can be read (it is nested too deeply)") from None


def _as_toml(data):
    """The text of a mapping; raises BadInput."""
    try:
        return tomli_w.dumps(data)
    except (TypeError, ValueError, RecursionError) as error:
        raise BadInput(f"this workflow cannot be written as TOML ({short(error, 150)}); use plain values") from None


@np.errstate(all="ignore")  # axes beyond floats are found by their values
def check(data, text="", output=None, default_path="survey.nc", near=None):
    """The checked Workflow of the mapping `data` (a parsed workflow file); `text` is what it was parsed from.

    A scene that is a file lies relative to the current folder, or else to the folder `near`.
    """
    if not isinstance(data, Mapping):
        raise BadInput(f"{shown(data)} is neither the path of a workflow file nor a mapping with its tables")
    given_scene = data.get("scene")
    if isinstance(given_scene, user_scene.HillScene):
        data = {**data, "scene": given_scene.NAME}
    try:
        file = File.model_validate(data)
    except ValidationError as error:
        _check_names(data, given_scene, near)
        raise BadInput(_one_line(error)) from None
    except RecursionError:
        raise BadInput("this workflow is nested too deeply, or holds itself; write it as plain tables") from None
    _check_text(file, output)
    name, scene = user_scene.find(given_scene, near)
    numbers = {p.name for p in scene.PARAMETERS if p.number_option and _is_number(file.options.get(p.name))}
    file.axes |= {key: _float(f"options.{key}", file.options.pop(key)) for key in sorted(numbers - set(file.axes))}
    options = check_options(scene, file.options, file.axes, "options.")
    _check_size(file.axes)
    given = {key: _values(f"axes.{key}", axis) for key, axis in file.axes.items()}
    parameters = check_parameters(scene, name, options, given, "axes.")
    for key, values in given.items():
        _check_domain(parameters[key], values)
    solver = file.solver
    request = check_request(scene, options, solver.method, solver.rtol, file.output.variables, ("solver.", "output."))
    for figure in file.output.figures:
        if figure not in request.variables:
            raise BadInput(f"output.figures: {modules.unknown('variable', figure, sorted(request.variables))}")
    if file.output.figures and not any(np.ndim(values) for values in given.values()):
        raise BadInput("output.figures: a figure needs at least one axis, and every parameter is a single number")
    grid = _grid(parameters, given)
    user_scene.check(scene, grid)
    return Workflow(
        name=name,
        title=file.title or scene.TITLE,
        scene=scene,
        grid=grid,
        request=request,
        path=check_path(next(path for path in (output, file.output.path, default_path) if path is not None)),
        figures=tuple(file.output.figures),
        text=text or _as_toml(data),
        boundaries=_check_boundaries(scene, name, file.boundaries, given),
        refine=_check_refine(scene, name, file, given),
        style=file.output.style,
    )


def _check_names(data, scene, near):
    """Raise BadInput for an unknown scene or parameter: what is missing below a wrong name is no help."""
    axes = data.get("axes")
    if not isinstance(data.get("scene"), str) or not isinstance(axes, Mapping) or set(data) - set(File.model_fields):
        return
    name, scene = user_scene.find(scene, near)
    known = [p.name for p in scene.PARAMETERS]
    for key in axes:
        if key not in known and key not in {option.name for option in scene.OPTIONS}:
            raise BadInput(f"axes.{short(key, 40)}: {_unknown_parameter(name, key, known)}")


def _not_beside(scene, when, key, given, table):
    """Why a parameter that exists `when` does not go with the `given` ones, in words: it names the one in its way."""
    options = {option.name: option.only_with for option in scene.OPTIONS}
    for name, allowed in when.items():
        if not any(allowed) and options[name] in given:
            return f"does not go with {table}{options[name]}, which is given too; leave out one of them"
    return f"does not go with the rest{condition(scene, when, key)}"


def _unknown_parameter(scene, key, known):
    return modules.unknown(f"parameter of scene {scene}", key, known)


def _check_text(file, output):
    """Raise BadInput for characters that a terminal would obey, in what is shown there."""
    for key, value in (("title", file.title), ("scene", file.scene), ("output.path", output or file.output.path or "")):
        text = str(value).replace("\n", "").replace("\t", "") if key == "title" else str(value)
        if not text.isprintable():
            raise BadInput(f"{key} = {shown(str(value))}: it holds characters that cannot be printed; leave them out")


def _check_size(axes):
    """Raise BadInput for a map of too many points, before any is made."""
    points = prod(axis.num if isinstance(axis, Spread) else 1 for axis in axes.values())
    if points > MOST_POINTS:
        raise BadInput(f"the axes make {points:.3g} points; a map holds at most {MOST_POINTS:.0e}; take fewer")


def _float(key, number):
    """The number as a float; raises BadInput for an integer beyond all floats."""
    try:
        return float(number)
    except OverflowError:
        raise BadInput(f"{key} = {shown(number)}: it is beyond the largest number, 1.8e308") from None


def _is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _check_boundaries(scene, name, asked, given):
    """The axis along which edges are sought, the last one by default; None if no boundaries are asked for."""
    if asked is None:
        return None
    axes = [key for key, values in given.items() if np.ndim(values)]
    measure = measures.question(scene.FAMILY, "curves")
    if measure is None:
        raise BadInput(f"boundaries: of the scene {name} no boundary curves are known; leave the table out")
    if hasattr(measure, "closed"):
        return _check_closed(measure, name, asked, {key: given[key].size for key in axes})
    _check_even(scene, name, "boundaries")
    if not 1 <= len(axes) <= 2:
        raise BadInput(f"boundaries: they are drawn on one axis or two, and there are {len(axes)}; fix the others")
    if asked.axis is not None and asked.axis not in axes:
        raise BadInput(f"boundaries.axis: {modules.unknown('axis', asked.axis, axes)}")
    axis = asked.axis or axes[-1]
    if given[axis].size < 2:
        raise BadInput(f"boundaries: the axis {axis} has one value, and edges need a range; give two or more")
    return axis


def _check_closed(measure, name, asked, sizes):
    """The last of the axes {name: number of values}; raises BadInput where the measure knows no curves on these."""
    axes = list(sizes)
    refusal = measure.refusal(axes)
    if refusal:
        raise BadInput(f"boundaries: of {name} {refusal}; change the axes, or leave the table out")
    if asked.axis is not None:
        raise BadInput(f"boundaries.axis: the curves of {name} are of the whole map: no axis is searched; leave it out")
    for key in axes[:2]:
        if sizes[key] < 2:
            raise BadInput(f"boundaries: the axis {key} has one value, and curves need a range; give two or more")
    return axes[-1]


def _check_even(scene, name, table):
    """Raise BadInput where there are no factors at T/2, whose zeros are the edges."""
    if not getattr(scene, "EVEN", True):
        raise BadInput(f"{table}: the z of {name} is not even, so it has no half-period factors; leave the table out")


def _check_refine(scene, name, file, given):
    """{axis: (width of the smallest cells as a fraction of the axis, is it logarithmic?)}; None if not asked for.

    Of a logarithmic axis the fraction is one of its logarithm, and a width of its own is one of the ratio less 1.
    """
    if file.refine is None:
        return None
    axes = {key: values for key, values in given.items() if np.ndim(values)}
    if measures.question(scene.FAMILY, "cells") is None:
        raise BadInput(f"[refine] is not supported for {name}; leave the table out")
    _check_even(scene, name, "refine")
    if len(axes) != 2 or min(values.size for values in axes.values()) < 2:
        raise BadInput("refine: cells need exactly two axes of two values or more; fix the other parameters")
    widths = _check_width_table(file.refine.width, axes)
    return {key: _fraction(widths, key, values, file.axes[key]) for key, values in axes.items()}


def _check_width_table(widths, axes):
    """The widths as they are; raises BadInput unless a table of them names each axis and nothing else."""
    if isinstance(widths, dict):
        for key in widths:
            if key not in axes:
                raise BadInput(f"refine.width.{short(key, 40)}: {modules.unknown('axis', key, list(axes))}")
        for key in axes:
            if key not in widths:
                raise BadInput(f"refine.width.{key} is missing; give a width for each axis, or one number for both")
    return widths


def _fraction(widths, key, values, axis):
    """(width as a fraction of the axis, is that logarithmic?) from one fraction or from widths in the axes' units."""
    log = isinstance(axis, Spread) and axis.spacing == "log"
    where, width, most = "refine.width", widths, 1.0
    if isinstance(widths, dict):
        most = values.max() / values.min() - 1 if log else np.ptp(values)
        where, width = f"{where}.{key}", widths[key]
    if not 0 < width < most:
        raise BadInput(f"{where} = {width:g}: it must lie between 0 and {most:g}, such as {1e-3 * most:.1g}")
    fraction = np.log1p(width) / np.log1p(most) if log and isinstance(widths, dict) else width / most
    if fraction < FINEST:
        raise BadInput(f"{where} = {width:g}: such cells are too many; take at least a millionth of the axis")
    return float(fraction), log


def check_options(scene, given, parameters=(), table=""):
    """Every option that exists beside the given `parameters`, with its value; raises BadInput for an unknown one."""
    known = {option.name: option for option in scene.OPTIONS}
    for key, value in given.items():
        if key not in known:
            if key in {p.name for p in scene.PARAMETERS}:
                raise BadInput(f"{table}{key} is a parameter, not an option; put it under [axes]")
            raise BadInput(f"{table}{short(key, 40)}: {modules.unknown('option', key, sorted(known))}")
        told = value if isinstance(value, str) else shown(value)
        if told not in known[key].choices:
            raise BadInput(f"{table}{key}: {modules.unknown('value', told, list(known[key].choices))}")
        if known[key].implied_by in parameters:
            raise BadInput(f"{table}{key} and {known[key].implied_by} say the same thing; give only one of them")
        if known[key].only_with and known[key].only_with not in parameters:
            raise BadInput(
                f"{table}{key} goes only with the parameter {known[key].only_with}; give that, or leave it out"
            )
    exist = [o for o in known.values() if o.implied_by not in parameters and o.only_with in ("", *parameters)]
    return {option.name: str(given.get(option.name, option.default)) for option in exist}


def check_parameters(scene, name, options, given, table=""):
    """{name: Parameter} in use, given ones first; raises BadInput for one that is unknown, missing or said twice."""
    all_of = {p.name: p for p in scene.PARAMETERS}
    known = {key: p for key, p in all_of.items() if exists(p, options)}
    replaced = {}
    for key in given:
        if key not in known:
            if key in {option.name for option in scene.OPTIONS}:
                raise BadInput(f"{table}{key} is an option of {name}, not a parameter; put it under [options]")
            if key in all_of:
                raise BadInput(f"{table}{key} {_not_beside(scene, all_of[key].when, key, given, table)}")
            raise BadInput(f"{table}{short(key, 40)}: {_unknown_parameter(name, key, list(known))}")
        original = known[key].instead_of or key
        if original in replaced:
            raise BadInput(f"{table}{replaced[original]} and {table}{key} say the same thing; give only one of them")
        replaced[original] = key
    used = {key: known[key] for key in given}
    for key, parameter in known.items():
        if key in replaced or parameter.instead_of:
            continue
        if parameter.default is None:
            others = [p.name for p in known.values() if p.instead_of == key]
            instead = f" (or {', '.join(others)} instead)" if others else ""
            raise BadInput(
                f"{table}{key} is missing: {name} needs {parameter.long_name}{instead}; add an axis or a number"
            )
        used[key] = parameter
    return used


def check_request(scene, options, method, rtol, variables, tables=("", "")):
    """The Request; raises BadInput for an unknown method or variable, or an rtol outside (0, 1)."""
    _check_method(scene, options, method, tables[0])
    if isinstance(rtol, bool) or not isinstance(rtol, Real) or not 0 < rtol < 1:
        raise BadInput(f"{tables[0]}rtol = {shown(rtol)}: it must lie between 0 and 1, such as 1e-10")
    outputs = [output.name for output in scene.OUTPUTS if exists(output, options)]
    for variable in variables or ():
        if not isinstance(variable, str) or variable not in outputs:
            raise BadInput(f"{tables[1]}variables: {modules.unknown('variable', variable, outputs)}")
    return Request(options, method, float(rtol), frozenset(outputs if variables is None else variables))


def _check_method(scene, options, method, table):
    """Raises BadInput for a method that is unknown or does not serve these options."""
    if not isinstance(method, str):
        raise BadInput(f"{table}method: {modules.unknown('method', method, ['auto', *methods_of(scene, options)])}")
    if method == "auto":
        return  # the methods' modules need not be imported
    serving = methods_of(scene, options)
    if method in serving:
        return
    if method not in methods_of(scene):
        raise BadInput(f"{table}method: {modules.unknown('method', method, ['auto', *serving])}")
    given = ", ".join(f"{name} = {value}" for name, value in options.items())
    raise BadInput(f"{table}method: {method!r} does not serve {given} (allowed: {', '.join(['auto', *serving])})")


def methods_of(scene, options=None):
    """Names of the methods that serve the scene's family (and these option values), found by walking their folder."""
    found = {name: measures.method(name) for name in modules.names(survey.methods)}
    return [name for name, m in found.items() if scene.FAMILY in m.SERVES and (options is None or _fits(m, options))]


def _fits(method, options):
    return all(options.get(name, "") in allowed for name, allowed in getattr(method, "WHEN", {}).items())


def check_path(path):
    """The output path; raises BadInput unless a file can be made there, Stopped where the disk is read-only."""
    if not str(path):
        raise BadInput("output.path is empty; name a file, such as 'map.nc'")
    try:
        return _checked_path(Path(path))
    except (OSError, ValueError) as error:
        if isinstance(error, BadInput):
            raise
        raise BadInput(f"output.path = {shown(str(path), 120)}: no file can be made there ({_reason(error)})") from None


def _is_netcdf(path):
    with path.open("rb") as file:
        return file.read(4) == b"\x89HDF"


def _checked_path(path):
    folder = path.parent
    told, where = f"output.path = {shown(str(path), 120)}", shown(str(folder), 120)
    if path.suffix.lower() in (".png", ".pdf", ".svg", ".toml"):
        raise BadInput(f"{told} is to be a netCDF file; name one, such as {shown(path.stem + '.nc')}")
    if path.is_file() and not _is_netcdf(path):
        raise BadInput(f"{told} is there and is no netCDF file; move it away, or use -o OUT.nc")
    if path.is_dir():
        raise BadInput(f"{told} is a folder; name a file, such as {shown(str(path / 'map.nc'), 120)}")
    if not folder.is_dir():
        raise BadInput(f"{told}: there is no folder {where}; make it first, or use -o OUT.nc")
    if os.statvfs(folder).f_flag & os.ST_RDONLY:
        raise Stopped(
            f"{told}: the disk of the folder {where} is read-only; make it writable and "
            "run the command again, or use -o OUT.nc"
        )
    if len(os.fsencode(path.name)) > os.pathconf(folder, "PC_NAME_MAX") - SUFFIXES:
        raise BadInput(f"{told}: this name is too long for the files beside it; shorten it")
    if not os.access(folder, os.W_OK | os.X_OK) or str(folder.resolve()).startswith(("/proc", "/sys")):
        raise BadInput(f"{told}: the folder {where} cannot be written to; use -o OUT.nc")
    return path


def _grid(parameters, given):
    """The grid of the workflow's axes (their order is that of the dimensions), fixed numbers and defaults."""
    axes = {key: values for key, values in given.items() if np.ndim(values)}
    fixed = {key: given.get(key, parameter.default) for key, parameter in parameters.items() if key not in axes}
    return Grid(
        sizes={key: values.size for key, values in axes.items()},
        parameters={key: ((key,), values) for key, values in axes.items()}
        | {key: ((), np.float64(value)) for key, value in fixed.items()},
        uncut=frozenset(key for key in axes if parameters[key].uncut),
    )


def _values(key, axis):
    """The coordinates of an axis, or the bare number."""
    if isinstance(axis, Spread):
        try:
            values = coordinates(axis.start, axis.stop, axis.num, axis.spacing)
        except BadInput as error:
            raise BadInput(f"{key}: {error}") from None
    elif isinstance(axis, Listed):
        values = np.array(axis.values, dtype=float)
    else:
        return np.float64(axis)
    check_axis(key, values)
    return values


def _check_domain(parameter, values):
    """Raise BadInput if a lone value or an end of an axis lies outside the parameter's domain."""
    ends = np.atleast_1d(values)[[0, -1]]
    for value in ends[~parameter.holds(ends)]:
        what = "is" if np.ndim(values) == 0 else "has an end"
        raise BadInput(f"axes.{parameter.name} {what} {value:g}, outside its domain; allowed: {parameter.domain}")


def _apply(data, override):
    """Set `KEY=VALUE` in the parsed workflow; VALUE is TOML, or else a string."""
    key, equals, value = override.partition("=")
    if not equals or not key.strip():
        raise BadInput(f"--set {shown(override)}: write it as KEY=VALUE, such as --set axes.k.num=40")
    try:
        value = tomllib.loads(f"value = {value}")["value"]
    except (ValueError, RecursionError):
        value = value.strip()
    *tables, last = (part.strip() for part in key.split("."))
    if not all([*tables, last]):
        raise BadInput(f"--set {shown(override)}: the key has an empty part; write it as axes.k.num=40")
    for table in tables:
        data = data.setdefault(table, {})
        if not isinstance(data, dict):
            raise BadInput(
                f"--set {shown(override)}: {short(table)} is a value, not a table, so it has no key below it"
            )
    data[last] = value


def _one_line(error):
    """The first complaint of pydantic (an unknown key before a missing one) as one line: key, value, allowed."""
    extra = "extra_forbidden"
    first = min(
        error.errors(), key=lambda one: (one["type"] != extra, one["type"] == extra and one["loc"][-1] == "values")
    )
    tag = 2 if first["loc"][0] in ("axes", "refine") else None  # pydantic names the kind of axis after the axis
    key = ".".join(short(part, 40) for i, part in enumerate(first["loc"]) if i != tag)
    more = "" if error.error_count() == 1 else f" (and {error.error_count() - 1} more)"
    if first["type"] == "extra_forbidden" and first["loc"][-1] == "values":
        return f"{key} stands beside other keys; give values alone, or start, stop and num"
    if first["type"] == "extra_forbidden":
        return f"unknown key {key}{_nearest(first['loc'])}{more}"
    if first["type"] == "missing":
        return f"{key} is missing; add it to the workflow{more}"
    if key.startswith("axes.") and isinstance(first["input"], list):
        return f"{key} is a list; write {key.removeprefix('axes.')} = {{ values = [...] }}{more}"
    if first["type"] == "list_type":
        such = "[0.1, 0.2]" if key.startswith("axes.") else '["NAME"]'
        return f"{key} = {shown(first['input'])}: it must be a list, such as --set '{key}={such}' (quoted so){more}"
    said = first["msg"].partition(" or instance of")[0].replace("dictionary", "table")
    return f"{key} = {shown(first['input'])}: {said[0].lower()}{said[1:]}{more}"


def _nearest(loc):
    """The keys that are allowed beside an unknown one, the nearest first named."""
    table = (
        {"solver": Solver, "output": OutputTable, "axes": Spread, "boundaries": Boundaries, "refine": Refine}.get(
            loc[0], File
        )
        if len(loc) > 1
        else File
    )
    known = list(table.model_fields) + (["values"] if table is Spread else [])
    return modules.unknown("", str(loc[-1]), known).removeprefix(f"unknown  {shown(str(loc[-1]))}")


def _reason(error):
    if isinstance(error, UnicodeDecodeError):
        return "it is not UTF-8 text"
    return getattr(error, "strerror", None) or short(error, 150)
