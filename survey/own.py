"""A user's own Hill equation y'' + z(u, p) y = 0, surveyed like a built-in scene: from one file, or one function.

The file holds

    z(u, p)      a function, plain or numba's, for 0 <= u <= T; p is the float64 array of the parameters, in order
    PARAMETERS   their names, or `survey.scene.Parameter`s, which have a domain, a unit, a default
    PERIOD       T, a number or a function of p
    EVEN         True where z(T - u) = z(u), which halves the work and makes edges certain; False by default
    BREAKS       where z or a derivative jumps, in [0, T]: number(s), or a function of p; none by default

and, as it likes, a docstring, TITLE and REFERENCES. It is run, as any Python file is: use files that you trust.
"""

import hashlib
import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from itertools import product
from pathlib import Path
from types import ModuleType

import numpy as np

import survey.scenes
from survey import modules, status
from survey.errors import BadInput
from survey.kernels.hill import EPS
from survey.measures import hill as measure
from survey.measures import hill_own
from survey.scene import Parameter

WORDS = {
    "y1": "y1(T), where y1(0) = 1, y1'(0) = 0",
    "y2": "y2(T), where y2(0) = 0, y2'(0) = 1",
    "dy1": "derivative of y1 at T",
    "dy2": "derivative of y2 at T",
}
SYMBOLS = {"y1": "y_1(T)", "y2": "y_2(T)", "dy1": "y_1'(T)", "dy2": "y_2'(T)"}
# Breaks closer than this share of the period to one another or to its ends are one.
SAME = 8 * hill_own.SLACK
_known = {}  # by hash: a worker process compiles a scene once, however many blocks it gets


# What two of the common codes mean here.
STATUS = {
    "invalid_parameters": "outside the domain, or z or T has no finite value there, or z is not even as EVEN says",
    "no_convergence": "z is not smooth between its BREAKS: name every place where it jumps or bends",
}


@dataclass(frozen=True, eq=False)
class Hill:
    """What a scene's module holds (see `survey.scenes`), for a user's z; `about` is its docstring."""

    z: Callable
    period: float | Callable
    breaks: tuple[float, ...] | Callable
    PARAMETERS: tuple[Parameter, ...]
    EVEN: bool
    NAME: str
    TEXT: str
    HASH: str
    TITLE: str
    about: str
    REFERENCES: tuple[str, ...]
    FAMILY = "hill"
    AUDIT = "dop853"
    OPTIONS = ()
    STATUS = STATUS

    def __post_init__(self):
        object.__setattr__(self, "__doc__", self.about)

    def __reduce__(self):
        """In another process: read from the text of its file, or else the same object for the same hash."""
        if self.NAME.endswith(".py"):
            return _from_text, (self.NAME, self.TEXT)
        return _again, (self.HASH, [getattr(self, field.name) for field in fields(self)])

    @property
    def OUTPUTS(self):
        """Those of Hill's question; where z is not even, y1 to dy2 are values at T."""
        return measure.OUTPUTS if self.EVEN else tuple(_of_whole_period(o) for o in measure.OUTPUTS)

    def cost(self, options, sizes):
        """Seconds per point, roughly."""
        return 2e-5 if self.EVEN else 3e-5

    def solve(self, point, request):
        """All outputs of a block that the request wants (see `survey.scenes`)."""
        shape = np.broadcast_shapes(*(np.shape(values) for values in point.values()))
        columns = [np.broadcast_to(point[p.name], shape).reshape(-1) for p in self.PARAMETERS]
        points = np.stack(columns, axis=1).astype(float)
        period, edges, slack = self.ranges(points)
        problem, rough = hill_own.problem(self.z, points, edges, period, slack, self.EVEN)
        out = measure.solve(problem, request.method, request.rtol, request.variables)
        out["status"] = np.where(rough[:, None], status.NO_CONVERGENCE, out["status"]).astype(np.int8)
        out["period"] = np.where(out["status"] == status.OK, period[:, None], np.nan)
        out["period_error"] = (4 if callable(self.period) else 1) * EPS * out["period"]
        return {name: values.reshape(shape) for name, values in out.items()}

    def ranges(self, points):
        """Period (N), edges of the pieces (N, P + 1; NaN where there are none) and slack (N; see `hill_own`)."""
        each = points if callable(self.period) or callable(self.breaks) else points[:1]
        period = np.array([_number(self.period, p) for p in each])
        period = np.where(period > 0, period, np.nan)
        breaks = [np.atleast_1d(_numbers(self.breaks, p)) for p in each]
        rows = [self._row(own, length) for own, length in zip(breaks, period, strict=True)]
        most = max((len(row) for row in rows), default=2)
        edges = np.array([[*row, *[row[-1]] * (most - len(row))] for row in rows]).reshape(len(rows), most)
        slack = np.array([hill_own.SLACK * (own.size > 0) for own in breaks]) * period
        number = (len(points), 1)
        if each is points:
            return period, edges, slack
        return np.full(number[0], period[0]), np.tile(edges, number), np.full(number[0], slack[0])

    def _row(self, breaks, period):
        """0, the breaks inside the part that is solved, and its end."""
        near = SAME * period
        if not ((breaks >= -near) & (breaks <= period + near)).all():
            return [np.nan, np.nan]
        end = 0.5 * period if self.EVEN else period
        row = [0.0]
        for place in np.sort(np.concatenate([breaks, period - breaks]) if self.EVEN else breaks):
            if place - row[-1] > near and end - place > near:
                row.append(place)
        return [*row, end]

    def check(self, points):
        """Raise BadInput if z cannot be compiled, or is not what the scene says at these points."""
        self._compile()
        if not len(points):
            return
        period, edges, slack = self.ranges(points)
        if np.isnan(period).all():
            self._refuse(
                f"PERIOD is {_number(self.period, points[0]):g} at {self._where(points[0])}", "make it positive"
            )
        if np.isnan(edges).all():
            self._refuse(f"BREAKS lie outside 0 <= u <= T at {self._where(points[0])}", "name places within a period")
        self._index(points[0])
        with np.errstate(all="ignore"):
            size, _, scale, rough = hill_own.measured(self.z, points, edges, period if self.EVEN else None, slack)
        finite = np.isfinite(size).all(axis=1)
        if not finite.any():
            self._refuse(f"z has no finite value at {self._where(points[0])}", "mend it, or PARAMETERS' domains")
        for i in np.flatnonzero(finite & rough):
            self._refuse(
                f"z is not smooth at {self._where(points[i])}", "name the places where it jumps or bends in BREAKS"
            )
        for i in np.flatnonzero(finite & np.isnan(scale)):
            self._refuse(
                f"EVEN = True, but z(T - u) is not z(u) at {self._where(points[i])}, T = {period[i]:g}",
                "set EVEN = False, or mend z or PERIOD",
            )
        if not self.EVEN:
            self._check_period(points, period, size.max(axis=1))

    def _check_period(self, points, period, size):
        ends = hill_own.at(self.z, points, np.stack([0 * period, period], axis=1))
        for i in np.flatnonzero(abs(ends[:, 1] - ends[:, 0]) > hill_own.MIRRORED * size):
            breaks = np.atleast_1d(_numbers(self.breaks, points[i]))
            if np.minimum(abs(breaks), abs(breaks - period[i])).min(initial=np.inf) > SAME * period[i]:
                self._refuse(
                    f"z(T) is not z(0) at {self._where(points[i])}, T = {period[i]:g}",
                    "mend PERIOD, or name 0 in BREAKS if z jumps there",
                )

    def _compile(self):
        """Raise BadInput unless z(u, p) can be compiled and gives a number."""
        try:
            hill_own.at(self.z, np.empty((0, len(self.PARAMETERS))), np.empty((0, 1)))
        except Exception as error:
            self._refuse(f"numba cannot compile z(u, p) ({_reason(error)})", "write it with numbers and math functions")

    def _index(self, point):
        """Compiled code does not check the bounds of p, so plain Python does."""
        try:
            getattr(self.z, "py_func", self.z)(0.25, point)
        except IndexError:
            n = len(self.PARAMETERS)
            self._refuse(f"z(u, p) asks for more than p[{n - 1}]", f"PARAMETERS names {n}: name them all")
        except Exception:
            return  # what compiled code makes of it is checked by its values

    def _where(self, point):
        return ", ".join(f"{p.name} = {value:g}" for p, value in zip(self.PARAMETERS, point, strict=True))

    def _refuse(self, what, remedy):
        raise BadInput(f"{self.NAME}: {what}; {remedy}")


def hill(z, *, period, parameters, even=False, breaks=(), title=None):
    """The scene of y'' + z(u, p) y = 0, for `survey.evaluate` and `survey.run`.

    Parameters
    ----------
    z : function of u and p, plain Python or numba's: 0 <= u <= T, p the float64 array of the parameters, in order.
    period : T, a number or a function of p.
    parameters : their names, or `survey.scene.Parameter`s.
    even : is z(T - u) = z(u)? It is checked.
    breaks : where z or a derivative jumps, in [0, T]: number(s), or a function of p.

    Raises survey.BadInput in one line that names what is wrong.

    Examples
    --------
    >>> import math, survey
    >>> z = lambda u, p: p[0] - 2 * p[1] * math.cos(2 * u)
    >>> mathieu = survey.hill(z, period=math.pi, parameters=("a", "q"), even=True)
    >>> int(survey.evaluate(mathieu, a=2.0, q=0.1).verdict)
    1
    """
    function = getattr(z, "py_func", z)
    name = f"hill({getattr(function, '__name__', 'z')})"
    try:
        text = inspect.getsource(function)
    except (OSError, TypeError):
        text = ""
    return _hill(z, period, parameters, even, breaks, name, text, title, inspect.getdoc(function), ())


def find(scene, near=None):
    """(name, scene) of a scene's name, of a file `*.py` (relative to this folder, or else to `near`), or of `hill`."""
    if isinstance(scene, Hill):
        return scene.NAME, scene
    if callable(scene):
        raise BadInput(
            f"scene = {scene!r} is a function; give survey.hill({getattr(scene, '__name__', 'z')}, period=...)"
        )
    if not str(scene).endswith(".py"):
        return scene, modules.load(survey.scenes, scene, "scene")
    paths = [Path(scene), *([Path(near) / scene] if near is not None else [])]
    path = next((path for path in paths if path.is_file()), None)
    if path is None:
        looked = " or ".join(dict.fromkeys(str(path) for path in paths))
        raise BadInput(f"scene = {str(scene)!r}: there is no file {looked}; name the file of your own Hill equation")
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: cannot read this scene ({getattr(error, 'strerror', None) or error})") from None
    return str(path), _from_text(str(path), text)


def check(scene, grid=None):
    """Raise BadInput if `scene` is a user's and wrong at the ends and middles of the grid's axes."""
    if not isinstance(scene, Hill):
        return
    places = [sorted({0, size // 2, size - 1}) for size in grid.sizes.values()] if grid else []
    points = [grid.point(tuple(slice(i, i + 1) for i in place)) for place in product(*places)] if grid else []
    names = [p.name for p in scene.PARAMETERS]
    values = np.array([[float(np.ravel(point[name])[0]) for name in names] for point in points])
    inside = [all(p.holds(v) for p, v in zip(scene.PARAMETERS, row, strict=True)) for row in values]
    scene.check(values.reshape(-1, len(names))[np.array(inside, bool)])


def of_dataset(ds):
    """The scene's name, as `find` takes it, of a survey's dataset; BadInput if it was a user's and is not as it was."""
    name = ds.attrs["scene"]
    if "scene_hash" not in ds.attrs:
        return name
    if not name.endswith(".py"):
        raise BadInput(f"scene = {name!r} was a function given from Python: points cannot be solved again without it")
    try:
        name, scene = find(name, Path(ds.encoding.get("source", "")).parent)
    except BadInput:
        raise BadInput(f"scene = {name!r}: its file has gone; the attribute scene_text holds what it said") from None
    if scene.HASH != ds.attrs["scene_hash"]:
        raise BadInput(f"scene = {name!r}: its file has changed since; the attribute scene_text holds what it said")
    return name


@lru_cache(maxsize=32)
def _from_text(name, text):
    """The scene in the text of a file."""
    module = ModuleType(Path(name).stem)
    module.__file__ = name
    try:
        exec(compile(text, name, "exec"), module.__dict__)
    except Exception as error:
        raise BadInput(f"{name}: this is no scene that runs ({type(error).__name__}: {_reason(error)})") from None
    for needed in ("z", "PERIOD", "PARAMETERS"):
        if not hasattr(module, needed):
            raise BadInput(f"{name}: {needed} is missing; write {_EXAMPLES[needed]}")
    title, references = getattr(module, "TITLE", None), getattr(module, "REFERENCES", ())
    optional = getattr(module, "EVEN", False), getattr(module, "BREAKS", ())
    about = module.__doc__ or inspect.getdoc(getattr(module.z, "py_func", module.z))
    return _hill(module.z, module.PERIOD, module.PARAMETERS, *optional, name, text, title, about, references)


_EXAMPLES = {
    "z": "def z(u, p): return p[0] + p[1] * cos(2 * u)",
    "PERIOD": "PERIOD = 3.14 (its length in u), or a function of p",
    "PARAMETERS": 'PARAMETERS = ("a", "b"), the names of p[0], p[1]',
}


def _hill(z, period, parameters, even, breaks, name, text, title, about, references):
    """The checked scene; raises BadInput."""

    def refuse(words):
        raise BadInput(f"{name}: {words}")

    if not callable(z) or _arguments(z) != 2:
        refuse("z must be a function of two arguments, z(u, p); the parameters are p[0], p[1], ...")
    parameters = (parameters,) if isinstance(parameters, (str, Parameter)) else tuple(parameters)
    parameters = tuple(p if isinstance(p, Parameter) else Parameter(str(p), str(p), _symbol(str(p))) for p in parameters)
    names = [p.name for p in parameters]
    taken = {o.name for o in measure.OUTPUTS} | {"status", "method", "rtol", "variables", "scene"}
    bad = [n for n in names if not n.isidentifier() or n in taken or names.count(n) > 1]
    if not names or bad:
        refuse(f"PARAMETERS = {names!r}: name at least one, each once, by a word that is no output's and no keyword's")
    if not isinstance(even, (bool, np.bool_)):
        refuse(f"EVEN = {even!r}: it is True or False")
    if not callable(period) and not (_is_number(period) and 0 < period < np.inf):
        refuse(f"PERIOD = {period!r}: it must be a positive number, or a function of p that returns one")
    if not callable(breaks):
        try:
            breaks = tuple(float(place) for place in np.atleast_1d(breaks))
        except (TypeError, ValueError):
            refuse(f"BREAKS = {breaks!r}: number(s) between 0 and the period, or a function of p that returns them")
        outside = [b for b in breaks if not 0 <= b <= (np.inf if callable(period) else period * (1 + SAME))]
        if outside:
            refuse(f"BREAKS: {outside[0]:g} lies outside 0 <= u <= T; name the places within one period")
    about = inspect.cleandoc(about or f"y'' + z(u, p) y = 0, p = ({', '.join(names)}).")
    bits = text.encode() if name.endswith(".py") else _bits((z, period, breaks, parameters, even))
    return Hill(
        z=z, period=period, breaks=breaks, PARAMETERS=parameters, EVEN=bool(even), NAME=name, TEXT=text,
        HASH=hashlib.sha256(bits).hexdigest(), TITLE=title or about.splitlines()[0].rstrip("."), about=about,
        REFERENCES=tuple(references) or REFERENCES,
    )  # fmt: skip


REFERENCES = ("W. Magnus, S. Winkler, Hill's Equation, Interscience 1966",)


def _again(digest, values):
    """The scene with these values, the same object for the same hash: its kernels are compiled once."""
    return _known.setdefault(digest, Hill(*values))


def _symbol(name):
    """The name in TeX."""
    return name if len(name) == 1 else rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"


def _of_whole_period(output):
    """The output where there are no factors at T/2: its values at T."""
    return (
        replace(output, long_name=WORDS[output.name], symbol=SYMBOLS[output.name]) if output.name in WORDS else output
    )


def _arguments(z):
    try:
        return len(inspect.signature(getattr(z, "py_func", z)).parameters)
    except (TypeError, ValueError):
        return 0


def _is_number(value):
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)


def _number(given, p):
    """A number, or a function's value; NaN where it has none."""
    return float(_numbers(given, p))


def _numbers(given, p):
    if not callable(given):
        return given
    try:
        return np.asarray(given(p), dtype=float)
    except (ArithmeticError, ValueError):
        return np.float64(np.nan)


def _reason(error):
    """The line of a many-line message that says what is wrong."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return next((line for line in lines if not line.startswith(_CHATTER)), type(error).__name__)


_CHATTER = ("Failed in", "During", "This error", "There are", "- Of which", "Overload", "File ", "Unknown", "^", "[1]")


def _bits(value, seen=()):
    """Bytes that change when a function, what it calls, or any of its numbers changes."""
    value = getattr(value, "py_func", value)
    if id(value) in seen:
        return b""
    seen = (*seen, id(value))
    if isinstance(value, (tuple, list)):
        return b"(" + b",".join(_bits(item, seen) for item in value) + b")"
    code = getattr(value, "__code__", value)
    if inspect.iscode(code):
        own = [code.co_code, repr(code.co_names).encode(), _bits(code.co_consts, seen)]
        if code is not value:
            names = [value.__globals__.get(name) for name in code.co_names]
            cells = [cell.cell_contents for cell in value.__closure__ or ()]
            own += [_bits([*names, *cells, *(value.__defaults__ or ())], seen)]
        return b"<" + b";".join(own) + b">"
    if isinstance(value, np.ndarray):
        return value.tobytes()
    return (value.__name__ if inspect.ismodule(value) else repr(value)).encode()
