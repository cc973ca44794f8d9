"""Files as strangers might write them: mutations of a small sound survey, and every question that
is asked of one.

python tests/hostile.py 1000 3      # mutations 1000, 1001, 1002: what each is, and what was found
"""

import hashlib
import html
import io
import shutil
import sys
import tempfile
import unicodedata
import warnings
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from types import SimpleNamespace

import h5py
import matplotlib
import netCDF4
import numpy as np
import xarray as xr

import survey
from survey.errors import SurveyError
from survey.request import earlier, workflow

matplotlib.use("Agg")
GOLDEN = Path(__file__).parent / "golden/mathieu.nc"  # it has edges, curves and cells
# Run, it leaves a file; it is a sound scene besides.
EVIL = '''"""Mathieu's equation of a stranger."""
from math import cos, pi
open({sentinel!r}, "w").close()
PARAMETERS, PERIOD, EVEN = ("a", "q"), pi, True
def z(u, p):
    return p[0] - 2 * p[1] * cos(2 * u)
'''
TEXTS = (
    "", " ", "\x1b]0;owned\x07\x1b[2J", "\x9b31m", "a\nb\rc\x08", "\u202egpj.exe", "\ud7ff\u0000"[:1],
    "<script>alert(1)</script><img src=x onerror=alert(1)>", "{0.__class__.__mro__}{}%s%n%(x)d",
    r"$\frac{", r"\frac{" * 400, r"$$\href{javascript:alert(1)}{x}$$", r"\(\def\x{\x\x}\x\)", r"\input{/etc/passwd}",
    "$", "../../evil.py", "/etc/passwd", "/dev/zero", "evil.py", "os", "../evil", "__init__", "..", "mathieu",
    "satellite",
    "a=b=c", "= , =", "question=fate", "method=x", "scene=x, rtol=y", "-1: 3, x: y", "[output]\npath = 'owned.nc'",
    "x" * 200_000, "days since 1970-01-01", "undecided unstable", "nan", "1e999", "q", "a, q", ":smile:",
    "[bold red]x[/]",
)  # fmt: skip
VALUES = (
    0, -1, 7, 10**18, 0.5, np.nan, np.inf, -0.0, np.empty(0), np.arange(5), np.array([1e300, -1e300]), np.zeros((3, 3)),
    np.array([b"\xff\xfe", b"x"]), b"\xff\xfe\x00", np.array([np.nan] * 4), np.int8(1), np.bool_(True), h5py.Empty("f"),
)  # fmt: skip
NAMES = (
    "<b>x</b>",
    "a b",
    "$x$",
    "\u202ex",
    "x" * 250,
    "status",
    "verdict_error",
    "__class__",
    "point",
    "k=1",
    "é",
    "_x",
)
OF_HDF5 = (
    "CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates", "_NCProperties",
)  # fmt: skip
MORE = [
    "_FillValue",
    "scale_factor",
    "_Encoding",
    "units",
    "calendar",
    "missing_value",
    "coordinates",
    "symbol",
]
NUMBERS = (np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, 0.0, -1.0, 99.0)
# What Matplotlib 3.8 calls in a newer pyparsing; Python shows users none of these.
OLDER = {"category": DeprecationWarning, "message": r"'\w+' (argument is )?deprecated"}


def base(folder, scene="evil.py"):
    """A sound file in the folder that names this scene, and the file `evil.py` beside it; the
    sentinel's path.
    """
    sentinel = folder.parent / "owned"
    text = EVIL.format(sentinel=str(sentinel))
    (folder / "evil.py").write_text(text)
    shutil.copy(GOLDEN, folder / "base.nc")
    if scene != "mathieu":
        with netCDF4.Dataset(folder / "base.nc", "a") as file:
            attributes = {
                "scene": scene,
                "scene_text": text,
                "scene_hash": hashlib.sha256(text.encode()).hexdigest(),
            }
            file.setncatts(attributes)
    digest(folder / "base.nc")
    return sentinel


def digest(path):
    """Write the digest beside the file, as an attacker would."""
    beside = Path(f"{path}.sha256")
    beside.write_text(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n")


def mutate(source, path, seed):
    """Write a mutation of the sound file `source` to `path`; returns what it is."""
    rng = np.random.default_rng(seed)
    kinds = [attribute, attribute, attribute, lost, lost, variable, variable, axis, dimension]
    changed = []
    # HDF5 knows an open file by its inode, and would go on showing the one before
    path.unlink(missing_ok=True)
    shutil.copy(source, path)
    for _ in range(1 + int(rng.integers(5) == 0)):
        changed.append(kinds[rng.integers(len(kinds))](path, rng))
    digest(path)
    return "; ".join(changed)


def _pick(rng, items):
    items = list(items)
    return items[rng.integers(len(items))]


def _places(file, rng):
    """The file itself, as often as one of its variables."""
    return file if rng.integers(2) else file[_pick(rng, file)]


def attribute(path, rng):
    """An attribute with a hostile value."""
    with h5py.File(path, "r+", locking=False) as file:
        place = _places(file, rng)
        names = [name for name in place.attrs if name not in OF_HDF5]
        name = _pick(rng, names + MORE * (not names or not rng.integers(4)))
        value = _pick(rng, TEXTS if rng.integers(3) else VALUES)
        value = (
            np.array([value] * 2, h5py.string_dtype())
            if isinstance(value, str) and not rng.integers(8)
            else value
        )
        try:
            place.attrs[name] = value
        except (ValueError, TypeError, OSError, RuntimeError):
            place.attrs[name] = "x"
        return f"{place.name}.{name} = {str(value)[:60]!r}"


def lost(path, rng):
    """An attribute that is missing."""
    with h5py.File(path, "r+", locking=False) as file:
        place = _places(file, rng)
        names = [name for name in place.attrs if name.islower()]
        if not names:
            return "nothing"
        name = _pick(rng, names)
        del place.attrs[name]
        return f"{place.name}.{name} is missing"


def _again(path, change):
    """Write the file again after `change(dataset)`; as it was where that cannot be written."""
    try:
        with xr.open_dataset(path, decode_cf=False) as opened:
            ds = opened.load()
        changed = change(ds)
        changed.to_netcdf(path.with_suffix(".part"))
    except Exception as error:
        path.with_suffix(".part").unlink(missing_ok=True)
        return f"not written ({type(error).__name__})"
    path.with_suffix(".part").replace(path)
    return ""


def variable(path, rng):
    """A variable that is missing, of another type, shape or name, or has other values."""
    how = _pick(
        rng, ["drop", "float", "text", "wide", "transpose", "rename", "values", "codes", "more"]
    )
    changed = []

    def change(ds):
        name = _pick(rng, ds.variables)
        changed.append(name)
        if how == "drop":
            return ds.drop_vars(name)
        if how == "rename":
            return ds.rename_vars({name: _pick(rng, NAMES)})
        if how == "more":
            return ds.assign({_pick(rng, NAMES): ds[name]})
        if how == "transpose":
            return ds.assign({name: ds[name].transpose()})
        if how == "wide":
            return ds.assign({name: ds[name].expand_dims("wide", -1)})
        if how in ("float", "text"):
            return ds.assign(
                {
                    name: ds[name]
                    .astype(float if how == "float" else str)
                    .assign_attrs(ds[name].attrs)
                }
            )
        values = np.array(ds[name].values)
        some = rng.random(values.shape) < 0.3
        values[some] = (
            _pick(rng, NUMBERS)
            if values.dtype.kind == "f"
            else int(_pick(rng, [-128, -1, 9, 99, 127]))
        )
        return ds.assign({name: (ds[name].dims, values, ds[name].attrs)})

    return f"{how} " + (_again(path, change) or " ".join(map(str, changed)))


def axis(path, rng):
    """Coordinates that are no axis."""
    how = _pick(rng, ["nan", "inf", "same", "shuffled", "falling", "huge", "zero"])

    def change(ds):
        dim = _pick(rng, ("a", "q"))
        values = np.array(ds[dim].values)
        values = {
            "nan": np.where(np.arange(values.size) == 1, np.nan, values), "inf": np.full(values.shape, np.inf),
            "zero": 0 * values, "same": 0 * values + 1, "shuffled": rng.permutation(values), "falling": values[::-1],
            "huge": values * 1e307,
        }[how]  # fmt: skip
        return ds.assign({dim: (dim, values, ds[dim].attrs)})

    return f"axis {how} " + _again(path, change)


def dimension(path, rng):
    """A dimension that is renamed, cut to nothing or one, or stretched."""
    how = _pick(rng, ["rename", "none", "one", "twice"])
    changed = []

    def change(ds):
        dim = _pick(rng, ds.sizes)
        changed.append(dim)
        if how == "rename":
            return ds.rename({dim: _pick(rng, NAMES)})
        if how == "twice":
            return xr.concat(
                [ds, ds], dim, data_vars="minimal", coords="minimal", compat="override"
            )
        return ds.isel({dim: slice(0, int(how == "one"))})

    return f"{how} " + (_again(path, change) or " ".join(map(str, changed)))


def ask(path, sentinel, points=0, solve=False, draw=True):
    """What the commands and `ds.survey` say of the file: [(question, what is wrong with the
    answer)].

    `solve`: those that solve points, too. `draw`: those that draw, which take longest, too.
    """
    before = set(path.parent.iterdir())
    picture = path.parent / "picture.png"
    at = str(path)
    opened = []
    found = [("open", wrong) for wrong in answered(lambda: opened.append(survey.open(path)))]
    commands = [["verify", at, "--points", str(points)]]
    if opened:
        commands += [["info", at], ["info", at, "--json"]]
    if opened and draw:
        commands += [
            ["plot", at, "-o", str(picture)],
            ["plot", at, "--var", "exponent", "-o", str(picture)],
        ]
    for words in commands:
        found += [(" ".join(words), wrong) for wrong in command(words)]
    for ds in opened:
        for what, call in questions(ds, path, solve, draw).items():
            found += [(what, wrong) for wrong in answered(call, what in ("point's HTML", "page"))]
    picture.unlink(missing_ok=True)
    left = {file.name for file in set(path.parent.iterdir()) ^ before}
    found += [("all", f"wrote {left}")] * bool(left) + [
        ("all", "ran the scene")
    ] * sentinel.exists()
    return found


def command(words):
    """What is wrong with the program's end, in words: none of these is."""
    from survey import cli

    out, err = io.StringIO(), io.StringIO()
    code = None
    with redirect_stdout(out), redirect_stderr(err), warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        warnings.filterwarnings("ignore", **OLDER)
        try:
            cli.main(words)
        except SystemExit as end:
            code = end.code
        except BaseException as error:
            yield f"{type(error).__name__}: {error}"
    if code not in (0, 2, 3):
        yield f"exit code {code}"
    lines = err.getvalue().splitlines()
    if any(not line.startswith("survey: ") for line in lines) or (code == 2 and len(lines) != 1):
        yield f"stderr: {err.getvalue()[:500]}"
    yield from (f"warned: {one.message}" for one in warned[:1])
    yield from unseen(out.getvalue() + err.getvalue())


def unseen(text):
    """Characters that a terminal obeys, or nobody sees."""
    bad = {c for c in text if unicodedata.category(c) in ("Cc", "Cf", "Cs") and c not in "\n"}
    return [f"raw {sorted(bad)!r}"] if bad else []


def answered(call, markup=False):
    """What is wrong with an answer from Python: a refusal in one line is none, nor is text that is seen."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", "zoom:|concat:|counts:")
            warnings.filterwarnings("ignore", **OLDER)
            text = call()
    except SurveyError as refusal:
        return unseen(str(refusal)) + ["two lines"] * ("\n" in str(refusal))
    except Exception as error:
        return [f"{type(error).__name__}: {error}"]
    raw = markup and any(tag in text for tag in ("<script", "<img src=x"))
    return unseen(text or "") + ["raw <"] * raw


def questions(ds, path, solve, draw):
    """{what is asked: a call that returns text}."""
    from matplotlib.figure import Figure

    from survey.viewer.shown import ShownMap

    def middle():
        return {dim: float(ds[dim].values[ds.sizes[dim] // 2]) for dim in ds.status.dims}

    def drawn():
        figure = Figure()
        ds.survey.map(ax=figure.subplots())
        figure.draw_without_rendering()

    def zoom():
        dim = ds.status.dims[0]
        ds.survey.zoom(num=2, **{dim: (float(ds[dim].min()), float(ds[dim].max()))})

    def under():
        shown = ShownMap(path)
        return "\n".join(shown.under(shown.read(""), (0, 0))).replace("\n", " ")

    def reused():
        axes = {
            "a": {"start": 0.5, "stop": 9.5, "num": 4},
            "q": {"start": 0.0, "stop": 5.0, "num": 3},
        }
        ours = workflow.check(
            {"scene": "mathieu", "axes": axes}, output=path.parent.parent / "reused.nc"
        )
        return earlier.find(ours, path)[1]

    asked = {
        "repr": lambda: repr(ds.survey),
        "counts": lambda: repr(ds.survey.counts()),
        "where": lambda: str(ds.survey.where("stable").sizes),
        "names": lambda: str(np.unique(ds.survey.names())),
        "joined": lambda: str(survey.concat([path, GOLDEN]).sizes),
        "reused": reused,
        "point": lambda: repr(ds.survey.point(**middle())),
        "point's HTML": lambda: ds.survey.point(**middle())._repr_html_(),
        "slice": lambda: str(ds.survey.slice(**dict([next(iter(middle().items()))])).sizes),
        "boundary": lambda: str(ds.survey.boundary().sizes),
        "areas": lambda: str(ds.survey.areas().sizes),
        "compare": lambda: str(ds.survey.compare(ds).sizes),
        "margin": lambda: str(ds.survey.margin(**middle()).sizes),
        "trajectory": lambda: str(ds.survey.trajectory(figure=False, **middle()).sizes),
        "zoom": zoom,
        "under the pointer": under,
    }
    if not solve and "evil" not in ds.attrs["scene"]:
        del asked["margin"], asked["trajectory"], asked["zoom"]
    return asked | ({"map": drawn, "page": lambda: page(path)} if draw else {})


def page(path):
    """The HTML of the viewer's page, its parts drawn and its first point chosen, without a browser."""
    from bokeh.document import Document
    from bokeh.models import Div

    from survey.viewer.page import Page
    from survey.viewer.shown import ShownMap

    document = Document()
    context = SimpleNamespace(request=SimpleNamespace(arguments={}))
    document._session_context = lambda: context
    shown = Page(ShownMap(path), document)
    shown.pointer = shown.map.position((0, 0))
    for dim in ("inner_width", "inner_height"):
        shown.plot.set_from_json(dim, 200)
    shown.draw()
    shown.describe()
    shown.choose((0, 0))
    shown.solve()
    shown.show_source()
    shown_text = "".join(part.text for part in document.select({"type": Div})).replace("\n", " ")
    return shown_text + html.escape(document.title)  # as bokeh's page escapes it


def main():
    first, number = map(int, sys.argv[1:3])
    scene, points, solve = ("mathieu", 3, True) if "--solve" in sys.argv else ("evil.py", 3, False)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "files"
        folder.mkdir()
        sentinel = base(folder, scene)
        draw = "--draw" in sys.argv
        for seed in range(first, first + number):
            mutation = mutate(folder / "base.nc", folder / "file.nc", seed)
            found = ask(folder / "file.nc", sentinel, points, solve, draw)
            for what, wrong in found:
                print(f"{seed} [{mutation}] {what}: {wrong}"[:1500], flush=True)
            print(f"{seed + 1 - first} of {number}", end="\r", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
