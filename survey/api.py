"""What users call from Python: run, evaluate, open, scenes."""

import inspect
import os
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

import survey.scenes
from survey import measures, status
from survey.errors import BadInput
from survey.file import disk, reading
from survey.file.labels import count, layout
from survey.file.labels import describe as labelled
from survey.grid import Grid, fixed, lines
from survey.request import arrays, physical, trust, user_scene
from survey.request.checks import (
    check_options,
    check_parameters,
    check_request,
    is_number,
    methods_of,
)
from survey.request.function_scene import FunctionScene
from survey.scene import Option, Output, Parameter, Request, condition, existing_outputs
from survey.sweep import announce, solve
from survey.sweep.compile_ahead import compiling_ahead
from survey.sweep.progress import Progress, watched
from survey.wording import counted, html_table, shown, summary


def run(
    workflow: str | os.PathLike[str] | Mapping[str, Any],
    output: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    scheduler: Any = None,
    fresh: bool = False,
    block_timeout: float | None = None,
    reuse: str | os.PathLike[str] | None = None,
) -> xr.Dataset:
    """Run, or resume, the survey in the TOML file `workflow`: the same as the command `survey run`.

    Parameters
    ----------
    workflow : path of a workflow file, or a mapping with the same tables (its scene may be what `survey.hill`,
        `survey.abel`, `survey.floquet` or `survey.orbit` returns).
    output : path of the netCDF file, instead of the workflow's.
    workers : number of worker processes; by default threads of this process.
    scheduler : address or scheduler file of a dask.distributed cluster, or a Client of it.
    fresh : replace the results of earlier runs at the output: a finished file, or the blocks of an interrupted run.
        Otherwise a finished file of the same workflow is returned as it is (nothing is computed, pictures are drawn
        again), and one of another workflow is refused.
    block_timeout : seconds after which a worker process that has not finished its block is replaced (five minutes more
        for its first, to compile); by default 20 times the longest block so far, and at least five minutes.
    reuse : a file of an earlier run: points that it also holds are taken from it where the bits would be the same
        (the attribute `points_reused` of the result is their number). With longer or finer axes only the rest is
        solved.

    Returns
    -------
    xarray.Dataset, after the file and its figures are written: in memory and the file closed, or, if it takes more than
    256 MiB of memory, lazy (dask arrays) and the file open.

    Raises
    ------
    survey.BadInput, survey.Damaged, survey.Stopped (resumable): one line each.
    """
    from survey.request import earlier  # evaluate needs none of these, which take long to load
    from survey.request.workflow import check, read
    from survey.sweep import engine

    if isinstance(workflow, (xr.Dataset, xr.DataArray)):
        raise BadInput("run: this is a dataset, not a workflow; give the path of a workflow file, or a mapping; "
                       "ds.survey.zoom() and survey.evaluate solve further points")  # fmt: skip
    checked = (read if isinstance(workflow, (str, os.PathLike)) else check)(workflow, output=output)
    number: Any = workers
    if number is not None and (not isinstance(number, int) or number < 1):
        raise BadInput(
            f"workers = {shown(workers)}: it must be a positive integer, or None for threads"
        )
    if block_timeout is not None and not (is_number(block_timeout) and 0 < block_timeout < np.inf):
        raise BadInput(
            f"block_timeout = {shown(block_timeout)}: it must be a positive number of seconds, or None"
        )
    held = earlier.find(checked, reuse, fresh)[0] if reuse is not None else None
    silent = not announce.is_watched()
    with Progress(announce.console(), checked, silent) as progress:
        engine.run(
            checked,
            workers,
            scheduler,
            fresh,
            None if silent else progress,
            block_timeout=block_timeout,
            earlier=held,
        )
    ds = reading.load(checked.path)
    draw(ds, checked)
    return ds


def draw(ds: xr.Dataset, workflow: Any) -> list[Path]:
    """Draw the workflow's figures beside its output; returns their paths: `OUT.png`, further ones
    `OUT_NAME.png`.

    In the style "paper" they are PDF files.
    """
    if not workflow.figures:
        return []
    from survey.show import figures

    first, suffix = workflow.figures[0], ".pdf" if workflow.style == "paper" else ".png"
    paths = {
        name: workflow.path.with_name(
            f"{workflow.path.stem}{'' if name == first else f'_{name}'}{suffix}"
        )
        for name in workflow.figures
    }
    for name, path in paths.items():
        with disk.refused(path):
            figures.save(ds, path, name, workflow.style)
    return list(paths.values())


def evaluate(
    scene: str | os.PathLike[str] | FunctionScene,
    *,
    method: str = "auto",
    rtol: float = 1e-10,
    variables: str | Iterable[str] | None = None,
    **parameters: npt.ArrayLike,
) -> xr.Dataset:
    """Solve a scene at the given parameters.

    Parameters
    ----------
    scene : name of a scene, such as "satellite" (`survey.scenes()` lists them, `survey scenes NAME` explains one); the
        path of a file with your own equation (see `survey/request/user_scene.py`); or what `survey.hill`,
        `survey.abel`, `survey.floquet` or `survey.orbit` returns.
    method : "auto" or the name of a method.
    rtol : requested accuracy, |error| <= rtol (1 + |value|); the `X_error` variables hold the error bounds reached.
    variables : names of the requested outputs; by default all but those that are computed on request (`describe` says
        which). Errors and status are always included.
    **parameters : the scene's parameters (numbers, sequences, numpy 1-D arrays, DataArrays) and options (strings).
        A number becomes a scalar coordinate, a 1-D array a dimension named after its parameter; DataArrays keep
        their dimensions, so those that share one are paired point by point and others span a grid.

    Returns
    -------
    xarray.Dataset with every output, its error bar `X_error`, `status` and (where the scene decides stability)
    `verdict`; lazy if an input is dask-backed, else loaded. Values are the same bits as those of `survey run`.

    Raises
    ------
    survey.BadInput (a ValueError) for an unknown name, a missing parameter, or a lone value outside its domain. A point
    outside the domain within an array gets `status = invalid_parameters`, which affects only that point.

    Examples
    --------
    >>> import survey
    >>> ds = survey.evaluate("satellite", k=[0.3, 0.5], rho=1.0, body="prolate")
    >>> ds.verdict.dims
    ('k',)
    """
    if isinstance(scene, (xr.Dataset, xr.DataArray)):
        raise BadInput(
            "evaluate: this is a dataset, not a scene; give a scene's name first, such as 'satellite'"
        )
    scene, module = user_scene.find(scene)
    names = {option.name for option in module.OPTIONS}
    named = {key: value for key, value in parameters.items() if key not in names}
    known = {p.name for p in module.PARAMETERS}
    resolved = physical.resolved(module, named)
    given = {
        key: arrays.as_labelled(key, value) if key in known else value
        for key, value in resolved.items()
    }
    options = check_options(
        module, {key: parameters[key] for key in parameters if key in names}, given
    )
    used = check_parameters(module, scene, options, given)
    if variables is not None:
        variables = _as_list(variables)
    request = check_request(module, options, method, rtol, variables)
    given |= {
        key: arrays.as_labelled(key, float(p.default))
        for key, p in used.items()
        if key not in given
    }
    arrays.check_domains(used, given, request, named)
    arrays.check_dimensions(module, given)
    if any(map(arrays.is_lazy, given.values())):
        user_scene.check(module)
        return _lazy(module, scene, request, given)
    grid = arrays.grid_of(used, given)
    try:
        with compiling_ahead(module, request):
            user_scene.check(module, grid)
            seconds = partial(_seconds, module, request, grid)
            with watched(scene, module, grid.points, seconds, request=request) as progress:
                found = solve.compute(grid, module, request, progress=progress)
        ds = count(labelled(grid, module, scene, request, found), found)
        ds.attrs["complete"] = 1  # also when it is saved
    except MemoryError:
        raise BadInput(
            f"evaluate: {counted(grid.points, 'point')} do not fit in memory; use survey.run, which writes a file, or "
            "dask arrays (DataArray.chunk), or fewer points or variables"
        ) from None
    own = arrays.own_coordinates(given)
    return ds.assign_coords(own) if own else ds


def open(path: str | os.PathLike[str], *, trust_scene: bool = False) -> xr.Dataset:
    """The dataset in the netCDF file `path`: in memory and the file closed; or lazy, if it takes
    more than 256 MiB.

    Opening a file runs no code from it. A survey of your own equation names a Python file, which
    has to run where points are solved (`ds.survey.trajectory`, `zoom`, the reason for a verdict):
    it does if you have run the same text here before; `trust_scene=True` allows it in this process.

    Raises survey.BadInput if there is no such file or survey did not write it, survey.Damaged if it
    is incomplete or its contents are not valid.
    """
    ds = reading.load(path)
    if trust_scene:
        trust.allow(ds.attrs.get("scene_hash", ""))
    return ds


def scenes() -> dict[str, str]:
    """{name: title} of the scenes: a mapping, shown as a table."""
    return survey.scenes()  # a callable package


def _as_list(variables: Any) -> list[Any]:
    """The names of outputs as a list, even of a single one."""
    try:
        return [variables] if isinstance(variables, str) else list(variables)
    except TypeError:
        return [variables]


def _seconds(module: Any, request: Request, grid: Grid) -> float:
    """Rough seconds on one thread."""
    sizes = {name: values.size for name, (_, values) in grid.parameters.items()}
    return float(module.cost(request.options, sizes) * grid.points)


def _lazy(
    module: Any, scene: str, request: Request, arrays_given: Mapping[str, arrays.Labelled]
) -> xr.Dataset:
    """The same dataset, its values computed block by block when they are asked for."""
    given = {key: arrays.as_data_array(array) for key, array in arrays_given.items()}
    table = layout(module, request)
    names = list(given)
    axes = {name: (array.dims, array) for name, array in given.items()}
    request = replace(request, lines=lines(axes), fixed=fixed(axes))

    def solve_arrays(*parts: Any) -> tuple[Any, ...]:
        shape = np.broadcast_shapes(*(part.shape for part in parts))
        wide = [part.reshape((1,) * (len(shape) - part.ndim) + part.shape) for part in parts]
        solved = solve.solve_point(module, request, dict(zip(names, wide, strict=True)), shape)
        return tuple(solved[name] for name in table)

    outputs = {o.name: o for o in existing_outputs(module, request.options)}
    extra = [outputs.get(name.removesuffix("_error")) for name in table]
    results = xr.apply_ufunc(
        solve_arrays,
        *given.values(),
        dask="parallelized",
        output_dtypes=[dtype for dtype, _, _ in table.values()],
        output_core_dims=[o.dims if o else () for o in extra],
        dask_gufunc_kwargs={
            "output_sizes": {d: len(module.DIMENSIONS[d]) for o in extra if o for d in o.dims}
        },
    )
    lazy = dict(zip(table, results, strict=True))
    sizes = dict(zip(results[-1].dims, results[-1].shape, strict=True))
    values = {key: (array.dims, array.data) for key, array in given.items()}
    data = {name: array.data for name, array in lazy.items()}
    return labelled(Grid(sizes, values), module, scene, request, data).assign_coords(
        arrays.own_coordinates(given)
    )


def scene(name: Any) -> dict[str, Any]:
    """Everything a user needs of one scene: equations, parameters, options, outputs, status,
    methods, sources.
    """
    name, module = user_scene.find(name)
    return {
        "name": name,
        "title": module.TITLE,
        "about": inspect.cleandoc(module.__doc__),
        "parameters": {p.name: _parameter_line(module, p) for p in module.PARAMETERS}
        | physical.described(module),
        "options": {
            o.name: f"{o.long_name}: {' | '.join(o.choices)} (default {o.default}){_option_condition(o)}"
            for o in module.OPTIONS
        },
        "outputs": {
            o.name: _outputs_line(
                module, [other for other in module.OUTPUTS if other.name == o.name]
            )
            for o in module.OUTPUTS
        },
        "status": {key: sentence for key, (_, sentence) in status.table(module).items()},
        "methods": {"auto": "the best method for each region (default)"}
        | {m: _method_line(module, m) for m in methods_of(module)},
        "references": list(module.REFERENCES),
    }


class Description(dict[str, Any]):
    """What `describe` returns: a mapping, shown as a table."""

    def __repr__(self) -> str:
        lines = [f"{self['name']}: {self['title']}"]
        for heading in ("parameters", "options", "outputs", "status", "methods"):
            rows = self[heading]
            width = max(map(len, rows), default=0)
            lines += (
                ["", f"{heading}:", *(f"  {key:<{width}}  {text}" for key, text in rows.items())]
                if rows
                else []
            )
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        rows = [(heading, key, text) for heading in ("parameters", "options", "outputs", "status", "methods")
                for key, text in self[heading].items()]  # fmt: skip
        return html_table(f"{self['name']}: {self['title']}", rows)


def describe(scene: Any) -> Description:
    """A scene's parameters, options, outputs, statuses and methods, shown as a table:
    `survey.describe("satellite")`.

    `scene` is what `survey.evaluate` takes, or the dataset of a survey. The result is a mapping,
    with the equations under "about".
    """
    if isinstance(scene, (xr.Dataset, xr.DataArray)):
        if "scene" not in scene.attrs:
            raise BadInput(
                "describe: this dataset was not written by survey: it has no attribute scene"
            )
        scene = user_scene.of_dataset(scene)
    return Description(globals()["scene"](scene))


def _option_condition(option: Option) -> str:
    text = f"; only with {option.only_with}" if option.only_with else ""
    text += "".join(
        f"; only when {name} = {' | '.join(allowed)}" for name, allowed in option.when.items()
    )
    return text + (
        f"; not with {option.replaced_by}, which replaces it" if option.replaced_by else ""
    )


def _parameter_line(module: Any, p: Parameter) -> str:
    unit = _unit(p.units, module, p.name in getattr(module, "RATIOS", ()))
    need = (
        f"default {p.default:g}"
        if p.default is not None
        else f"instead of {p.instead_of}"
        if p.instead_of
        else "optional"
        if p.name in {option.only_with for option in module.OPTIONS}
        else "required"
    )
    return f"{p.long_name}{unit}; {p.domain}; {need}{condition(module, p.when, p.name)}"


def _outputs_line(module: Any, same: list[Output]) -> str:
    """One line for the outputs of a name; those that differ only in their dimensions are listed once."""
    texts = list(dict.fromkeys(_output_text(module, o) for o in same))
    if len(texts) < len(same):
        return texts[0]
    return " | ".join(_output_text(module, o) + condition(module, o.when) for o in same)


def _output_text(module: Any, o: Output) -> str:
    what = (
        ", ".join(f"{name} {code}" for name, code in o.flags.items()) if o.flags is not None else ""
    )
    untold = o.flags is not None or o.integer or (o.units == "1" and hasattr(module, "RATIOS"))
    unit = "" if untold else _unit(o.units, module)
    asked = "on request" if o.on_request else ""
    return "; ".join(part for part in (f"{o.long_name}{unit}", what, o.applies, asked) if part)


def _unit(units: str, module: Any, ratio: bool = False) -> str:
    """The unit of a parameter or an output, in parentheses; a user's own scene has none unless it
    names one.
    """
    if units != "1":
        return f" ({units})"
    if isinstance(module, FunctionScene):
        return ""
    return " (any consistent units)" if hasattr(module, "RATIOS") and not ratio else " (no unit)"


def _method_line(module: Any, name: str) -> str:
    method = measures.method(name)
    docstring = inspect.cleandoc(method.__doc__)
    when = condition(module, getattr(method, "WHEN", {}))
    first = getattr(method, "ABOUT", {}).get(module.FAMILY, summary(docstring))
    return first.removesuffix(".") + when if when else first
