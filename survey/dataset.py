"""Arrays -> a labelled dataset: CF attributes, flags, error bars, counts and provenance."""

import datetime
import platform
import subprocess
import sys
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np
import xarray as xr

from survey import status
from survey.scene import exists

CONVENTIONS = "CF-1.11, ACDD-1.3"


def outputs_of(scene, request):
    """The Outputs that the request asks for, in the scene's order."""
    return [o for o in scene.OUTPUTS if o.name in request.variables and exists(o, request.options)]


def layout(scene, request):
    """What is stored per point: {variable: (dtype, fill, extra shape)}: outputs, their errors, and `status`."""
    table = {}
    for output in outputs_of(scene, request):
        extra = tuple(len(scene.DIMENSIONS[dim]) for dim in output.dims)
        fill = np.nan if output.dtype.kind == "f" else output.fill
        table[output.name] = (output.dtype, fill, extra)
        if output.dtype.kind == "f":
            table[f"{output.name}_error"] = (np.dtype("float32"), np.nan, extra)
    table["status"] = (np.dtype("int8"), status.PENDING, ())
    return table


def round_up(errors):
    """float64 error bars as float32, never smaller than before."""
    with np.errstate(over="ignore"):
        small = np.asarray(errors).astype(np.float32)
    return np.where(small < errors, np.nextafter(small, np.float32(np.inf)), small)


def percent(share, bar):
    """`34.97 +- 0.58 %`: to two digits of the bar."""
    digits = int(np.clip(1 - np.floor(np.log10(100 * bar)), 0, 12)) if bar > 0 else 2
    return f"{100 * share:.{digits}f} +- {100 * bar:.{digits}f} %"


def describe(grid, scene, name, request, arrays):
    """The dataset of a survey: `arrays` holds the variables of `layout` in the grid's shape."""
    used = {p.name: p for p in scene.PARAMETERS}
    coords = {key: (dims, values, _meaning(used[key])) for key, (dims, values) in grid.parameters.items()}
    dims = tuple(grid.sizes)
    outputs = outputs_of(scene, request)
    for dim in {dim for output in outputs for dim in output.dims}:
        coords[dim] = (dim, np.asarray(scene.DIMENSIONS[dim]), {"long_name": dim})
    variables = {}
    for output in outputs:
        own = dims + output.dims
        variables[output.name] = (own, arrays[output.name], _attributes(output))
        if output.dtype.kind == "f":
            bar = {"long_name": f"error bound of {output.name}", "units": output.units}
            bar |= {"coverage_content_type": "qualityInformation", "symbol": rf"\delta {output.symbol or output.name}"}
            variables[f"{output.name}_error"] = (own, arrays[f"{output.name}_error"], bar)
    variables["status"] = (dims, arrays["status"], _status_attributes(scene))
    ds = xr.Dataset(variables, coords)
    ds.attrs = {
        "Conventions": CONVENTIONS,
        "title": scene.TITLE,
        "summary": (scene.__doc__ or scene.TITLE).strip().split("\n\n")[0].replace("\n", " "),
        "keywords": f"stability, parameter survey, {name}",
        "scene": name,
        "options": ", ".join(f"{key}={value}" for key, value in request.options.items()),
        "method": request.method,
        "rtol": request.rtol,
        "references": "; ".join(scene.REFERENCES),
        "source": f"survey {version('survey')}: scene {name}, method {request.method}",
        **provenance(),
    }
    return ds


def count(ds):
    """Add the counts by status and by verdict, and of points whose bar exceeds the asked accuracy, to `ds.attrs`."""
    missed = np.zeros(ds.status.shape, bool)
    for name in error_bars(ds):
        value, bar = ds[name].values, ds[f"{name}_error"].values
        with np.errstate(invalid="ignore"):
            above = bar > ds.attrs["rtol"] * (1 + np.abs(value))
        missed |= above.reshape(*missed.shape, -1).any(axis=-1)
    ds.attrs["points"] = int(ds.status.size)
    ds.attrs["accuracy_missed"] = int(missed.sum())
    for name in ("status", "verdict"):
        if name in ds:
            ds.attrs[f"{name}_counts"] = ", ".join(f"{key}: {n}" for key, n in counts(ds[name]).items() if n)
    return ds


def counts(variable):
    """{flag meaning: number of points} of a CF flag variable."""
    codes = np.atleast_1d(variable.attrs["flag_values"])
    return {
        name: int((variable.values == code).sum())
        for name, code in zip(variable.attrs["flag_meanings"].split(), codes, strict=True)
    }


def error_bars(ds):
    """Names of the float outputs of `ds`, one value or more per point (those that have an error bar)."""
    point = set(ds.status.dims)
    return [name for name in ds.data_vars if f"{name}_error" in ds.data_vars and point <= set(ds[name].dims)]


def encoding(ds):
    """Checksummed compression in tiles: readable everywhere, and every flipped bit is found."""
    packed = {"zlib": True, "complevel": 4, "shuffle": True, "fletcher32": True}
    settings = {}
    for name, variable in ds.variables.items():
        settings[name] = {"_FillValue": np.nan} if name in error_bars(ds) or name.endswith("_error") else {}
        if variable.dtype.kind in "iu" or name in ds.coords:
            settings[name]["_FillValue"] = None
        if name in ds.data_vars and variable.ndim:
            tile = [
                max(1, min(size, 65536 if variable.ndim == 1 else 256) if axis >= variable.ndim - 2 else min(size, 16))
                for axis, size in enumerate(variable.shape)
            ]
            settings[name] |= packed | {"chunksizes": tile}
    return settings


@cache
def provenance():
    """Versions, commit and dirty flag of the source, kernel hash and processor."""
    from survey.kernels.jit import KERNEL_HASH

    commit, dirty = _commit()
    return {
        "version_survey": version("survey"),
        "version_numba": version("numba"),
        "version_llvmlite": version("llvmlite"),
        "version_numpy": version("numpy"),
        "version_python": platform.python_version(),
        "commit": commit,
        "dirty": dirty,
        "kernel_hash": KERNEL_HASH,
        "cpu": _cpu(),
    }


def now():
    """The time in UTC, ISO 8601."""
    return datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def command():
    """The command line of this process, as the history records it."""
    return " ".join([Path(sys.argv[0]).name, *sys.argv[1:]])


def _commit():
    """(commit, "yes" or "no") of the repository that holds this package, or ("unknown", "unknown")."""
    root = Path(__file__).parent.parent

    def git(*words):
        return subprocess.run(["git", "-C", root, *words], capture_output=True, text=True, check=True).stdout.strip()

    try:
        tracked = git("ls-files", "survey/dataset.py")
        return (
            (git("rev-parse", "HEAD"), "yes" if git("status", "--porcelain", "survey") else "no")
            if tracked
            else ("unknown",) * 2
        )
    except (OSError, subprocess.CalledProcessError):
        return "unknown", "unknown"


def _cpu():
    """The processor's name."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":", 1)[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _meaning(parameter):
    return {
        "long_name": parameter.long_name,
        "units": parameter.units,
        "symbol": parameter.symbol,
        "comment": f"domain: {parameter.domain}",
    }


def _attributes(output):
    attributes = {"long_name": output.long_name, "coverage_content_type": "modelResult"}
    attributes |= {"units": output.units, "symbol": output.symbol or output.name}
    if output.flags is not None:
        attributes |= _flags(output.flags)
    if output.dtype.kind == "f":
        attributes["ancillary_variables"] = f"{output.name}_error"
    comment = [output.applies] if output.applies else []
    comment += [f"{output.fill} where it does not apply"] if output.integer else []
    if comment:
        attributes["comment"] = "; ".join(comment)
    return attributes


def _flags(codes):
    return {"flag_values": np.array(list(codes.values()), np.int8), "flag_meanings": " ".join(codes)}


def _status_attributes(scene):
    table = status.table(scene)
    return {
        "long_name": "why the point has or has not an answer",
        "coverage_content_type": "qualityInformation",
        "units": "1",
        "symbol": "status",
        **_flags({name: code for name, (code, _) in table.items()}),
        "comment": "; ".join(f"{name}: {sentence}" for name, (_, sentence) in table.items()),
    }
