"""TOML -> a checked Workflow. Whatever can be refused is refused here, by name, before any work."""

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from pydantic import ValidationError

from survey import modules, scenes
from survey.errors import BadInput
from survey.grid import Grid
from survey.request import physical, user_scene
from survey.request.axes import as_float, check_domain, check_size, grid_of, values_of
from survey.request.checks import (
    check_options,
    check_parameters,
    check_request,
    is_number,
    unknown_parameter,
)
from survey.request.edges_and_cells import check_boundaries, check_refine, check_surfaces
from survey.request.function_scene import FunctionScene
from survey.request.output_path import check_path
from survey.request.schema import File, complaint
from survey.scene import Request
from survey.wording import plain, reason_of, short, shown

SURFACES = "surfaces"  # a figure that is no variable


@dataclass(frozen=True)
class Workflow:
    """A checked survey: `scene` is the scene's module; `text` is the workflow as it was run.

    `boundaries`: the axis along which edges are searched; `planes`: the pairs of axes in whose
    planes curves lie, rows being along the last of each; `surfaces`: are surfaces searched instead?
    `refine`: for each axis the width of the smallest cells as a fraction of it, and whether it is
    logarithmic.
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
    planes: tuple[tuple[str, str], ...] = ()
    surfaces: bool = False
    refine: Mapping[str, tuple[float, bool]] | None = None
    style: str = "screen"
    proves: bool = False  # the cells of `refine`, or the edges of a row, are theorems


def read(path, overrides=(), output=None, proves=False):
    """The checked Workflow in the TOML file `path`, with `KEY=VALUE` overrides; raises BadInput in
    one line.
    """
    path = Path(path)
    try:
        if path.suffix == ".py" and os.path.isfile(path):
            raise ValueError(
                f"this is a scene's file: survey init {short(path, 120)} writes a workflow for it"
            )
        text = path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise BadInput(
            f"{short(path, 120)}: cannot read this workflow file ({_why(path, error)})"
        ) from None
    data = _parsed(text, short(path, 120))
    for override in overrides:
        _apply(data, override)
    if overrides:
        changes = "".join(f" --set {override}" for override in overrides)
        text = f"# {plain(f'{path.name}{changes}')}\n\n{_as_toml(data)}"
    return check(
        data,
        text,
        output,
        default_path=path.with_suffix(".nc").name,
        near=path.parent,
        proves=proves,
    )


def _parsed(text, path):
    """The table that a TOML text holds; raises BadInput."""
    try:
        return tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, or an integer of more than 4300 digits
        twice = "a key is given twice: " if "overwrite a value" in str(error) else ""
        raise BadInput(f"{path}: this is not TOML ({twice}{short(error, 150)})") from None
    except RecursionError:
        raise BadInput(f"{path}: this TOML is nested too deeply") from None


def _as_toml(data):
    """The text of a mapping; raises BadInput."""
    try:
        return tomli_w.dumps(data)
    except (TypeError, ValueError, RecursionError) as error:
        raise BadInput(
            f"this workflow cannot be written as TOML ({short(error, 150)}); use plain values"
        ) from None


def _why(path, error):
    """Why a file is not a workflow: what it is instead, where its name tells."""
    if path.suffix == ".nc":
        return "a netCDF file holds results: survey info, plot and verify read it"
    if (
        isinstance(error, FileNotFoundError)
        and not path.suffix
        and path.name in modules.names(scenes)
    ):
        return f"this is a scene: survey init {path.name} writes a workflow for it"
    return reason_of(error)


@np.errstate(all="ignore")  # overflow on an axis is found by its values
def check(data, text="", output=None, default_path="survey.nc", near=None, proves=False):
    """The checked Workflow of the mapping `data` (a parsed workflow file); `text` is what it was
    parsed from.

    The path of a scene's file is relative to the current folder, or else to the folder `near`.
    """
    if not isinstance(data, Mapping):
        raise BadInput(
            f"{shown(data)} is neither the path of a workflow file nor a mapping with its tables"
        )
    if isinstance(data.get("axes"), Mapping):
        data = {**data, "axes": {key: _as_toml_axis(axis) for key, axis in data["axes"].items()}}
    given_scene = data.get("scene")
    if isinstance(given_scene, FunctionScene):
        data = {**data, "scene": given_scene.NAME}
    try:
        file = File.model_validate(data)
    except ValidationError as error:
        _check_names(data, given_scene, near)
        raise BadInput(complaint(error)) from None
    except RecursionError:
        raise BadInput(
            "this workflow is nested too deeply, or contains itself; write it as plain tables"
        ) from None
    _check_printable(file, output)
    name, scene = user_scene.find(given_scene, near)
    numbers = {
        p.name for p in scene.PARAMETERS if p.number_option and is_number(file.options.get(p.name))
    }
    file.axes |= {
        key: as_float(f"options.{key}", file.options.pop(key))
        for key in sorted(numbers - set(file.axes))
    }
    check_size(file.axes)
    given = _in_own_terms(scene, file)
    options = check_options(scene, file.options, given, "options.")
    parameters = check_parameters(scene, name, options, given, "axes.")
    solver = file.solver
    request = check_request(
        scene, options, solver.method, solver.rtol, file.output.variables, ("solver.", "output.")
    )
    for key, values in given.items():
        group = parameters[key].instead_of or key
        others = [
            p.name for p in scene.PARAMETERS if group in (p.name, p.instead_of) and p.name != key
        ]
        check_domain(parameters[key], values, request.variables, others, file.axes)
    surfaces = check_surfaces(scene, name, file.boundaries, given, proves)
    for figure in file.output.figures:
        if figure == SURFACES and not surfaces:
            raise BadInput(
                "output.figures: there are no surfaces; write surfaces = true under [boundaries]"
            )
        if figure in {output.name for output in scene.OUTPUTS} - {*request.variables}:
            raise BadInput(
                f"output.figures: {figure} is not among output.variables; add it there too"
            )
        if figure not in (*request.variables, SURFACES):
            raise BadInput(
                f"output.figures: {modules.unknown('variable', figure, sorted(request.variables))}"
            )
    if file.output.figures and not any(np.ndim(values) for values in given.values()):
        raise BadInput(
            "output.figures: a figure needs at least one axis, and every parameter is a single number"
        )
    grid = grid_of(parameters, given)
    boundaries, planes = (
        (None, ())
        if surfaces
        else check_boundaries(scene, name, file.boundaries, given, options, proves)
    )
    user_scene.check(scene, grid)
    return Workflow(
        name=name,
        title=file.title or scene.TITLE,
        scene=scene,
        grid=grid,
        request=request,
        path=check_path(
            next(path for path in (output, file.output.path, default_path) if path is not None)
        ),
        figures=tuple(file.output.figures),
        text=text or _as_toml(data),
        boundaries=boundaries,
        planes=planes,
        surfaces=surfaces,
        refine=check_refine(scene, name, file, given, proves),
        proves=proves,
        style=file.output.style,
    )


def _as_toml_axis(axis):
    """An entry of [axes] from Python, whose numbers may be numpy's and whose lists tuples, as TOML
    would give it.
    """
    if isinstance(axis, dict):
        return {key: _as_toml_value(value) for key, value in axis.items()}
    return _as_toml_value(axis)


def _as_toml_value(value):
    if isinstance(value, tuple):
        return [_as_toml_value(one) for one in value]
    return value.tolist() if _is_numpy(value) else value


def _is_numpy(value):
    return isinstance(value, (np.ndarray, np.generic))


def _in_own_terms(scene, file):
    """The values of all axes by parameter; physical input, such as degrees, in the scene's own terms."""
    given = {key: values_of(f"axes.{key}", axis) for key, axis in file.axes.items()}
    known = {p.name for p in scene.PARAMETERS} | {option.name for option in scene.OPTIONS}
    if "body" in file.options and "mu" in known and "body" not in known:
        if not isinstance(file.options["body"], str):
            raise BadInput(
                "options.body: a workflow takes one pair, as in body = 'Earth-Moon'; evaluate takes several"
            )
        given["body"] = file.options.pop("body")
    if set(given) <= known:
        return given
    found = physical.resolved(scene, given)
    values = {key: np.asarray(getattr(value, "values", value)) for key, value in found.items()}
    return {key: value if value.ndim else np.float64(value) for key, value in values.items()}


def _check_names(data, scene, near):
    """Raise BadInput for an unknown scene or parameter: naming a key that is missing below it would
    not help.
    """
    axes = data.get("axes")
    if (
        not isinstance(data.get("scene"), str)
        or not isinstance(axes, Mapping)
        or set(data) - set(File.model_fields)
    ):
        return
    name, scene = user_scene.find(scene, near)
    known = [p.name for p in scene.PARAMETERS]
    for key in axes:
        if key not in {*known, *(option.name for option in scene.OPTIONS), *physical.words(scene)}:
            raise BadInput(f"axes.{short(key, 40)}: {unknown_parameter(name, key, known)}")


def _check_printable(file, output):
    """Raise BadInput for control characters in what a terminal will show."""
    for key, value in (
        ("title", file.title),
        ("scene", file.scene),
        ("output.path", output or file.output.path or ""),
    ):
        text = str(value).replace("\n", "").replace("\t", "") if key == "title" else str(value)
        if not text.isprintable():
            raise BadInput(
                f"{key} = {shown(str(value))}: it contains characters that cannot be printed; remove them"
            )


def _apply(data, override):
    """Set `KEY=VALUE` in the parsed workflow; VALUE is TOML, or else a string."""
    key, equals, value = override.partition("=")
    if not equals or not key.strip():
        raise BadInput(
            f"--set {shown(override)}: write it as KEY=VALUE, such as --set axes.k.num=40"
        )
    try:
        value = tomllib.loads(f"value = {value}")["value"]
    except (ValueError, RecursionError):
        value = value.strip()
    *tables, last = (part.strip() for part in key.split("."))
    if not all([*tables, last]):
        raise BadInput(
            f"--set {shown(override)}: the key has an empty part; write it as axes.k.num=40"
        )
    for table in tables:
        data = data.setdefault(table, {})
        if not isinstance(data, dict):
            raise BadInput(
                f"--set {shown(override)}: {short(table)} is a value, not a table, so it has no keys"
            )
    data[last] = value
