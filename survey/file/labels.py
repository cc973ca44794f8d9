"""Labels for arrays: CF attributes, flags, error bars, counts and provenance; as a dataset, or for a file."""

import datetime
import platform
import re
import subprocess
import sys
from functools import cache, lru_cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

from survey import __version__, status
from survey.errors import Damaged
from survey.file import schema
from survey.scene import existing_outputs
from survey.wording import summary

CONVENTIONS = "CF-1.11, ACDD-1.3"
UNDECIDED = -1  # of every verdict
FILL = "_FillValue"  # CF's attribute: the integer that stands where none applies
CHUNK = 2**16  # values whose temporaries fit in the cache


def outputs_of(scene, request):
    """The requested Outputs, in the scene's order."""
    return _outputs_of(scene, request.variables, tuple(request.options.items()))


@lru_cache(maxsize=64)
def _outputs_of(scene, names, options):
    return [o for o in existing_outputs(scene, dict(options)) if o.name in names]


def layout(scene, request):
    """What is stored per point, {variable: (dtype, fill, extra shape)}: outputs, their errors, and
    `status`.
    """
    return _layout(scene, request.variables, tuple(request.options.items()))


@lru_cache(maxsize=64)
def _layout(scene, names, options):
    table = {}
    for output in _outputs_of(scene, names, options):
        extra = tuple(len(scene.DIMENSIONS[dim]) for dim in output.dims)
        fill = np.nan if output.dtype.kind == "f" else output.fill
        table[output.name] = (output.dtype, fill, extra)
        if output.dtype.kind == "f":
            table[f"{output.name}_error"] = (np.dtype("float32"), np.nan, extra)
    table["status"] = (np.dtype("int8"), status.PENDING, ())
    return table


def round_up(errors):
    """float64 error bars (not negative) as float32, rounded up."""
    from survey.kernels.math.rounding import rounded_up  # numba: reading files needs none

    return rounded_up(errors)


def percent(fraction, bar):
    """`34.97 +- 0.58 %`, to two digits of the error bar."""
    digits = int(np.clip(1 - np.floor(np.log10(100 * bar)), 0, 12)) if bar > 0 else 2
    return f"{100 * fraction:.{digits}f} +- {100 * bar:.{digits}f} %"


def describe(grid, scene, name, request, arrays):
    """The dataset of a survey: `arrays` holds the variables of `layout` in the grid's shape."""
    given = tuple((key, dims, values.shape) for key, (dims, values) in grid.parameters.items())
    asked = request.variables, tuple(request.options.items()), request.method, request.rtol
    kept = _kept(scene, name, tuple(grid.sizes.items()), given, *asked)
    if not kept.asked:  # most are asked for once
        kept.asked = True
        return _dataset(grid, scene, name, request, arrays)
    if kept.blank is None:
        kept.blank = _without_values(_dataset(grid, scene, name, request, arrays))
    blank, fills, names = kept.blank
    ds = blank.copy(
        data={
            key: _bare(blank.variables[key].dims, _masked(arrays[key], fill))
            for key, fill in fills.items()
        }
    )
    for of in ds.variables.values():
        if "flag_values" in of.attrs:
            of.attrs["flag_values"] = of.attrs["flag_values"].copy()
    for key in names:
        dims, values = grid.parameters.get(key) or ((key,), np.array(scene.DIMENSIONS[key]))
        ds.variables[key].data = _bare(dims, values)
        if dims == (key,):
            ds = ds.set_xindex(key)
    return ds


class _Kept:
    """Whether datasets of one kind were `asked` for, and what `_without_values` gives of them: to
    copy that and to index its axes takes a third of the time of making a dataset.
    """

    asked, blank = False, None


@lru_cache(maxsize=64)
def _kept(*_kind):
    return _Kept()


def _without_values(ds):
    """(the dataset with zeros that take no memory, however large, and without indexes; the integers
    of `_masked` by output; its coordinates).
    """

    def zeros(of):
        return _bare(of.dims, np.broadcast_to(np.zeros((), of.dtype), of.shape))

    fills = {key: ds.variables[key].encoding.get(FILL) for key in ds.data_vars}
    blank = ds.copy(data={key: zeros(ds.variables[key]) for key in fills})
    blank = blank.drop_indexes([*ds.xindexes])
    for key in ds.coords:
        blank.variables[key].data = zeros(ds.variables[key])
    return blank, fills, [*ds.coords]


def _bare(dims, values):
    """The values as xarray takes them at once: of plain arrays it asks whether dask made them, and
    would load dask.array for that.
    """
    import xarray as xr

    return xr.Variable(dims, values, fastpath=True)


def _dataset(grid, scene, name, request, arrays):
    import xarray as xr

    # made here, as xarray takes longer to find out what they are
    data = {
        key: variable(dims, arrays[key], attrs)
        for key, (dims, attrs) in variables(grid, scene, request).items()
    }
    coords = {
        key: xr.Variable(*of, fastpath=True)
        for key, of in coordinates(grid, scene, request).items()
    }
    return xr.Dataset(data, coords, attributes(scene, name, request))


def variable(dims, values, attributes):
    """An xarray.Variable; integers that do not apply are masked."""
    import xarray as xr

    encoding = {}
    fill = attributes.get(FILL)
    if fill is not None:
        encoding = {"dtype": values.dtype, FILL: fill}
        attributes = {key: value for key, value in attributes.items() if key != FILL}
    return xr.Variable(dims, _masked(values, fill), attributes, encoding, fastpath=True)


def _masked(values, fill):
    """Integers where they do not apply masked, as xarray decodes them: floats, NaN there; others
    unchanged.
    """
    return values if fill is None else np.where(values == fill, np.nan, values.astype(float))


def coordinates(grid, scene, request):
    """{name: (dimensions, values, attributes)}: the parameters, then the extra dimensions of the outputs."""
    used = {p.name: p for p in scene.PARAMETERS}
    coords = {
        key: (dims, values, _parameter_attributes(used[key]))
        for key, (dims, values) in grid.parameters.items()
    }
    extra = dict.fromkeys(dim for output in outputs_of(scene, request) for dim in output.dims)
    return coords | {dim: _index(dim, np.asarray(scene.DIMENSIONS[dim])) for dim in extra}


def _index(dim, values):
    """The coordinate of an extra dimension: names, or numbers, which have a unit."""
    unit = {"units": "1"} if values.dtype.kind in "if" else {}
    return (dim,), values, {"long_name": dim, "symbol": rf"\mathrm{{{dim}}}"} | unit


def variables(grid, scene, request):
    """{name: (dimensions, attributes)} of the variables of `layout`."""
    dims = tuple(grid.sizes)
    table = {}
    for output in outputs_of(scene, request):
        masked = {FILL: output.dtype.type(output.fill)} if output.integer else {}
        table[output.name] = (dims + output.dims, masked | meaning(output))
        if output.dtype.kind == "f":
            bar = {"long_name": f"error bound of {output.name}", "units": output.units}
            bar |= {
                "coverage_content_type": "qualityInformation",
                "symbol": rf"\delta {output.symbol or output.name}",
            }
            table[f"{output.name}_error"] = (dims + output.dims, bar)
    return table | {"status": (dims, _status_attributes(scene))}


def attributes(scene, name, request):
    """The global attributes: what was asked, of which scene, and which code answered."""
    return {
        "Conventions": CONVENTIONS,
        "title": scene.TITLE,
        "summary": summary(scene.__doc__ or scene.TITLE),
        "keywords": f"stability, parameter survey, {name}",
        "scene": name,
        "options": ", ".join(f"{key}={value}" for key, value in request.options.items()),
        "method": request.method,
        "rtol": request.rtol,
        "references": "; ".join(scene.REFERENCES),
        "source": f"survey {provenance()['version_survey']}: scene {name}, method {request.method}",
        **provenance(),
        **({"scene_text": scene.TEXT, "scene_hash": scene.HASH} if hasattr(scene, "TEXT") else {}),
        **getattr(scene, "NOTES", {}),
    }


class Tally:
    """Counts, over pieces of a map, by status and verdict and of points whose error bar exceeds the
    requested accuracy.

    `flags` is {"status": its attributes, "verdict": its attributes (if there is one)}. `unanswered`
    counts, by status, the points whose verdict is -1 because there is no answer.
    """

    def __init__(self, flags, rtol):
        self.codes = {name: flag_codes(attrs) for name, attrs in flags.items()}
        self.counts = {name: dict.fromkeys(codes, 0) for name, codes in self.codes.items()}
        self.unanswered = {
            name: 0 for name, code in self.codes["status"].items() if code != status.OK
        }
        self.rtol = rtol
        self.points = self.missed = 0

    def add(self, arrays):
        """Count the points of a piece: {variable: array}."""
        size = np.size(arrays["status"])
        missed = None
        for name in arrays:
            if f"{name}_error" not in arrays:
                continue
            error = np.asarray(arrays[f"{name}_error"])
            if not error.size or error.max() <= self.rtol:  # none is missed
                continue
            missed = np.zeros(size, bool) if missed is None else missed
            value, error = (np.asarray(of).reshape(size, -1).T for of in (arrays[name], error))
            for first in range(0, size, CHUNK):
                for one, bar in zip(value, error, strict=True):
                    some = first + np.flatnonzero(bar[first : first + CHUNK] > self.rtol)
                    missed[some] |= _exceeds(one[some], bar[some], self.rtol)
        self.missed += 0 if missed is None else int(np.count_nonzero(missed))
        self.points += size
        for name, codes in self.codes.items():
            for key, number in zip(codes, _numbers(arrays[name], codes.values()), strict=True):
                self.counts[name][key] += number
        if "verdict" in self.codes and np.any(arrays["status"]):
            other = arrays["status"] != status.OK
            why = arrays["status"][(arrays["verdict"] == UNDECIDED) & other]
            for key in self.unanswered if why.size else ():
                self.unanswered[key] += int(np.count_nonzero(why == self.codes["status"][key]))

    @property
    def kinds(self):
        """{"status", "verdict": {kind: points}}; a point without an answer counts by its status,
        not as undecided.
        """
        kinds = {name: dict(number) for name, number in self.counts.items()}
        if "undecided" in kinds.get("verdict", ()):
            kinds["verdict"]["undecided"] -= sum(self.unanswered.values())
            kinds["verdict"] |= {name: n for name, n in self.unanswered.items() if n}
        return kinds

    @property
    def attributes(self):
        """The counts as global attributes."""
        return {"points": self.points, "accuracy_missed": self.missed} | _counts(self.kinds)

    @property
    def old_attributes(self):
        """The counts as older files hold them, where points without an answer count as undecided."""
        return _counts(self.counts)


def _numbers(array, codes):
    """How often each of the codes is in an array."""
    flat, numbers = np.ravel(array), [0] * len(codes)
    for first in range(0, flat.size, CHUNK):
        some = flat[first : first + CHUNK]
        left = some.size
        for i, code in enumerate(codes):
            number = int(np.count_nonzero(some == code)) if left else 0
            numbers[i] += number
            left -= number
    return numbers


def _counts(table):
    return {
        f"{name}_counts": ", ".join(f"{k}: {n}" for k, n in number.items() if n)
        for name, number in table.items()
    }


def counts_in(attributes):
    """{"status", "verdict": {kind: points}} from a file's attributes, as `Tally.attributes` wrote
    them.

    Raises Damaged where they say anything else."""
    found = {}
    for name in ("status", "verdict"):
        if (text := attributes.get(f"{name}_counts")) is not None:
            parts = [part.rpartition(": ") for part in str(text).split(", ") if part]
            if not all(number.isdecimal() for _, _, number in parts):
                raise Damaged(f"the attribute {name}_counts holds no counts")
            found[name] = {kind: int(number) for kind, _, number in parts}
    return found


def _exceeds(value, bar, rtol):
    """Where the error bar exceeds rtol (1 + |value|)."""
    limit = np.abs(value)
    limit += 1
    limit *= rtol
    with np.errstate(invalid="ignore"):
        return bar > limit


def tally(ds):
    """An empty Tally for a survey's dataset."""
    return Tally(
        {name: ds[name].attrs for name in ("status", "verdict") if name in ds}, ds.attrs["rtol"]
    )


def count(ds, arrays=None):
    """Add the counts of `Tally` over the `arrays` of `ds` (see `describe`; its variables) to its
    attributes.
    """
    arrays = {name: ds[name].values for name in ds.data_vars} if arrays is None else arrays
    total = Tally(
        {name: ds.variables[name].attrs for name in ("status", "verdict") if name in arrays},
        ds.attrs["rtol"],
    )
    total.add(arrays)
    ds.attrs |= total.attributes
    return ds


def counts(ds):
    """{"verdict" (if there is one), "status": {kind: number of points}}, as `Tally.kinds`."""
    total = tally(ds)
    total.add({name: ds[name].transpose(*ds.status.dims).values for name in total.codes})
    return {name: total.kinds[name] for name in ("verdict", "status") if name in total.codes}


def repeated(ds):
    """One line where an axis has values more than once, or none at all, so that points count as often
    as they are there; else "".
    """
    for dim in ds.status.dims:
        if dim not in ds.coords:
            # samples have their parameters along such a dimension; what xr.concat has stacked has none
            if ds.status.ndim > 1 and not any(dim in c.dims for c in ds.coords.values()):
                return (
                    f"the axis {dim} has no values, so that the same points may count {ds.sizes[dim]} times: "
                    "survey.concat joins surveys, and keeps points that several contain once"
                )
            continue
        again = ds.sizes[dim] - np.unique(ds[dim].values).size
        if again:
            return (
                f"{again} of the {ds.sizes[dim]} values of {dim} repeat others, and their points count each time: "
                "survey.concat, in place of xr.concat, joins surveys and keeps common points once"
            )
    return ""


def scene_statuses(ds):
    """{name: code} of the scene's own statuses: why the outputs are undefined at a point."""
    codes = flag_codes(ds.status.attrs) if "flag_values" in ds.status.attrs else {}
    return {name: code for name, code in codes.items() if code >= status.FIRST_OF_SCENE}


def undecided_share(ds):
    """The fraction of a refined map whose verdict is not known: less than undecided cells cover, of
    which parts may be known.
    """
    return max(1.0 - float((ds.area_fraction - ds.area_fraction_error).sum()), 0.0)


def flag_codes(attributes):
    """{flag meaning: code} from the attributes of a CF flag variable; raises Damaged if they are
    not valid.
    """
    return schema.flags(attributes)


def options_of(ds):
    """{name: value} of the scene's options; raises Damaged where the attribute is not valid."""
    return schema.options(ds.attrs)


def error_bars(ds):
    """Names of the float outputs of `ds`, which have an error bar, with one value or more per point."""
    point = set(ds.status.dims)
    return [
        name
        for name in ds.data_vars
        if f"{name}_error" in ds.data_vars and point <= set(ds[name].dims)
    ]


@cache
def provenance():
    """Versions, commit and dirty flag of the source, kernel hash and processor."""
    from survey.kernels.jit import HAS_FMA, KERNEL_HASH

    commit, dirty = _commit()
    return {
        "version_survey": __version__,
        "version_numba": version("numba"),
        "version_llvmlite": version("llvmlite"),
        "version_numpy": version("numpy"),
        "version_python": platform.python_version(),
        "commit": commit,
        "dirty": dirty,
        "kernel_hash": KERNEL_HASH,
        "cpu": f"{_cpu()}, {'with' if HAS_FMA else 'without'} fused multiply-adds",
    }


def now():
    """The time in UTC, ISO 8601."""
    return datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def command():
    """The command line of this process, as the history records it."""
    return " ".join([Path(sys.argv[0]).name, *sys.argv[1:]])


def _commit():
    """(commit, "yes" or "no") of the repository that holds this package, or ("unknown", "unknown")."""
    root = Path(__file__).parents[2]

    def git(*arguments):
        return subprocess.run(
            ["git", "-C", root, *arguments], capture_output=True, encoding="utf-8", check=True
        ).stdout.strip()

    try:
        tracked = git("ls-files", "survey/file/labels.py")
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
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        return next(
            line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")
        )
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def _parameter_attributes(parameter):
    return {
        "long_name": parameter.long_name,
        "units": parameter.units,
        "symbol": parameter.symbol,
        "comment": f"domain: {parameter.domain}",
    }


def meaning(output):
    """The attributes of an Output."""
    attributes = {"long_name": output.long_name, "coverage_content_type": "modelResult"}
    attributes |= {"units": output.units, "symbol": output.symbol or output.name}
    if output.flags is not None:
        attributes |= flag_attributes(output.flags)
    if output.dtype.kind == "f":
        attributes["ancillary_variables"] = f"{output.name}_error"
    comment = [output.applies] if output.applies else []
    comment += [f"{output.fill} where it does not apply"] if output.integer else []
    if output.flags is not None and output.fill not in output.flags.values():
        comment.append(f"{output.fill} where there is no answer")
    if comment:
        attributes["comment"] = "; ".join(comment)
    return attributes


def fill_of(variable):
    """The integer that a file holds where an integer output does not apply; None for other outputs."""
    found = re.search(r"(-?\d{1,10}) where it does not apply", variable.attrs.get("comment", ""))
    return int(found[1]) if found else None


def masked(variable):
    """The DataArray with NaN where an integer output does not apply, also of a file in which it is
    not masked.
    """
    fill = fill_of(variable)
    return (
        variable
        if fill is None or variable.dtype.kind == "f"
        else variable.astype(float).where(variable != fill)
    )


def as_stored(variable):
    """The values of a variable as a file holds them: those of an integer output as integers."""
    fill, values = fill_of(variable), variable.values
    if fill is None or values.dtype.kind != "f":
        return values
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(values), values, fill).astype(np.int32)


def words_of(variable):
    """{integer: what it means}, of an integer output whose `comment` says so: `-1 means infinitely many`."""
    found = re.findall(r"(-?\d{1,10}) means ([a-z ]+)", variable.attrs.get("comment", ""))
    return {int(number): words for number, words in found} if fill_of(variable) is not None else {}


def flag_attributes(codes):
    """The attributes of a CF flag variable, from {flag meaning: code}."""
    return {
        "flag_values": np.array(list(codes.values()), np.int8),
        "flag_meanings": " ".join(codes),
    }


def _status_attributes(scene):
    table = status.table(scene)
    return {
        "long_name": "does the point have an answer, and if not, why",
        "coverage_content_type": "qualityInformation",
        "units": "1",
        "symbol": "status",
        **flag_attributes({name: code for name, (code, _) in table.items()}),
        "comment": "; ".join(f"{name}: {sentence}" for name, (_, sentence) in table.items()),
    }
