"""A user's own equation, surveyed like a built-in scene: from one file, or from functions.

The file of a Hill equation y'' + z(u, p) y = 0 holds

    z(u, p)      a function, plain or numba's, for 0 <= u <= T; p is the float64 array of the parameters, in order
    PARAMETERS   their names, or `survey.scene.Parameter`s, which have a domain, a unit and a default
    PERIOD       T, a number or a function of p
    EVEN         True if z(T - u) = z(u), which halves the work and makes edges certain; False by default
    BREAKS       where z or a derivative jumps, in [0, T]: number(s), or a function of p; none by default
    DAMPING      c of y'' + 2 c y' + z y = 0: a number, or the name of the parameter that is c; 0 by default

that of an Abel equation w w' = f(phi, p) w + g(phi, p), or phi' = w, w' = f(phi, p) w + g(phi, p)
in time,

    f(phi, p), g(phi, p)    functions, plain or numba's; p as above
    PARAMETERS              as above
    PERIOD                  2 pi, if f and g have that period, which is checked; None by default

that of a linear periodic system x' = A(t, p) x, or M q'' + C q' + K q = 0,

    A(t, p, out)    a function that fills the n x n matrix out, which holds zeros, at the time t; p as above
    K(t, p, out)    instead of A: fills the m x m stiffness matrix, and so do M (the identity if not given) and C (0)
    STATES          the names of the n states, or of the m coordinates q, to which their velocities are added
    PARAMETERS      as above
    PERIOD          T, a number or a function of p
    STRUCTURE       "none" by default; "symplectic": J A is symmetric, J = (0 1; -1 0), the states being coordinates,
                    then momenta (with K: M q' + C q / 2); "reversible": R A(-t) R = -A(t) with
                    signs R. It is checked
    BREAKS          times in [0, T] at which A jumps or has a kink: number(s), or a function of p; none by default
    CONSERVED       optional: n numbers w, or a function of p: w x, x the states at t = 0, is the same a period later
                    (checked); its multiplier, 1, is neither given nor judged

that of the periodic orbits of x' = f(t, x, p)

    f(t, x, p, out)    a function that fills the array out, which holds zeros, with x' at the time t in the state x
    STATES, PARAMETERS as above
    PERIOD             T, a number or a function of p; None: f does not depend on t, and T is found
    START              where Newton's method begins: the n states at t = 0, or a function of p that returns them; if
                       PERIOD is None, a guess of the period after them; with CONTINUATION it may be
                       NaN where there is no guess, and orbits are followed from elsewhere
    CONTINUATION       optional: (name, least, greatest value) of a parameter along which orbits are followed
    REVERSED, HELD     optional, if PERIOD is None: the names of the states, half of all, that change their sign when
                       time is reversed (checked), and of one of the others, whose value at t = 0 is
                       that of START: orbits are sought in which the REVERSED are 0 at t = 0 and
                       half a period later
    TRANSVERSE         optional, with these: states that are 0 on all orbits, and do not act on the others there; the
                       stability against motions in these states alone is judged
    jacobian(t, x, p, out)    optional: fills the n x n matrix df/dx, and is compared with that of the record

and all optionally a docstring, TITLE and REFERENCES. It is executed like any Python file: use only
files that you trust. A file that is named only by a survey runs if this user has run it here
before, or allows it (see `trust.py`). Changes in what it imports are not noticed when a run is
resumed. z is continued with period T. [boundaries] and [refine] assume that z is analytic in the
parameters.

z is known from samples. Every point has one at least every T/128 (T/256 if EVEN), stored as
`z_resolved_width`; at the ends and middles of the axes there is one every T/16384 (T/32768), and a
spike that only these show is refused. Features narrower than both may go unseen; near BREAKS the
samples are as dense as necessary. A z without BREAKS that its code shows to have no spikes (see
`survey.measures.hill.bands`) needs no such samples.

A (or M, C, K) is run once, as Python, to record its operations on t and p; the record gives the
power series of A in every step, for all points, and bounds of the rounding. Branches are followed
as the code takes them: points that take others are recorded on their own. What depends on t must be
analytic between BREAKS. A spike is seen if it is T/128 wide at half its height
(`A_resolved_width`); a narrower one may go unseen, unless its position is one of BREAKS.

f(t, x, p, out) is recorded likewise, and its derivatives by x are those of the record; it must be
analytic in t and x: branches may depend on parameters alone. A pulse in t narrower than T/128 at
half its height may go unseen, as may a feature of f in x that an orbit passes in less than T/1000.

f and g are run as Python, once for each path that they take at the parameters, to record their
operations on phi; the record gives their Taylor series, bounds of them and of their rounding. So
what depends on phi must be analytic: + - * / ** and functions of math or numpy (sin to atanh, exp
to log10, sqrt, erf, hypot); what depends on p alone may branch and loop. Numbers in the code are
taken as exact binary64 numbers. Taylor's method checks every step for what its series leave out:
spikes are seen however narrow. With a period, fates, portraits and other methods take steps no
longer than the narrowest piece that shows f and g; a spike of 1e-9 of the largest may go unseen.

Where float64 cannot decide a verdict of a Hill equation, the point is solved again in
double-double, as in built-in scenes: z is run once more, as Python, with mpmath's functions in
place of those of math and numpy. Numbers in the code, PERIOD and BREAKS are taken as exact binary64
numbers (math.pi is not quite pi), and if EVEN, z is used up to T/2 and mirrored. Where z cannot be
run like this, the attribute `z_more_digits` of the file says why, and float64's answer stays.
"""

from __future__ import annotations

import hashlib
import inspect
import os
import re
import stat
from collections.abc import Callable, Iterable
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache, partial
from itertools import zip_longest
from pathlib import Path
from types import CodeType, ModuleType
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np
import numpy.typing as npt

from survey.errors import BadInput, Untrusted
from survey.request import trust
from survey.request.checks import is_number
from survey.request.function_scene import FunctionScene, reason, refusal
from survey.scene import Parameter
from survey.scenes import load
from survey.wording import reason_of, short, shown

# These scenes, and the measures behind them, are imported when one is made: most runs need none.
if TYPE_CHECKING:
    from survey.request.abel_scene import AbelScene
    from survey.request.damped_scene import DampedScene
    from survey.request.floquet_scene import FloquetScene
    from survey.request.hill_scene import HillScene
    from survey.request.orbit_scene import OrbitScene

FORMS = {  # by what the file holds: what else it must name
    "abel": ("f", "g", "PARAMETERS"),
    "floquet": ("STATES", "PERIOD", "PARAMETERS"),
    "orbit": ("STATES", "PERIOD", "PARAMETERS", "START"),
    "hill": ("PERIOD", "PARAMETERS"),
}
OPTIONAL = {  # that change what is computed
    "abel": ("PERIOD",),
    "floquet": ("STRUCTURE", "BREAKS", "CONSERVED"),
    "orbit": ("CONTINUATION", "REVERSED", "HELD", "TRANSVERSE", "jacobian"),
    "hill": ("EVEN", "BREAKS", "DAMPING"),
}
ALIKE = 0.9  # of two names: one is taken for a slip of the other
EXAMPLES = {
    "f": "def f(phi, p): return -p[0]",
    "g": "def g(phi, p): return p[1] - sin(phi)",
    "STATES": 'STATES = ("x", "v"), the names of the states',
    "START": "START = (1.0, 0.0), or def START(p): return 1.0, 0.0",
    "PERIOD": "PERIOD = 2 * pi (its length), or a function of p",
    "PARAMETERS": 'PARAMETERS = ("a", "b"), the names of p[0], p[1]',
}
_made: Any = {}  # by hash: what `hill` has made in this process
MAX_BYTES = 2**20  # of a scene's file
REFERENCES = ("W. Magnus, S. Winkler, Hill's Equation, Interscience 1966",)
ABEL_REFERENCES = (
    "A. D. Polyanin, V. F. Zaitsev, Handbook of Exact Solutions for Ordinary Differential Equations, 2003",
)
FLOQUET_REFERENCES = (
    "V. A. Yakubovich, V. M. Starzhinskii, Linear Differential Equations with Periodic Coefficients, 1975",
)
ORBIT_REFERENCES = (
    "W. Tucker, Validated Numerics, Princeton 2011",
    "A. Jorba, M. Zou, Experimental Mathematics 14 (2005) 99",
)


def hill(
    z: Callable[[float, Any], float],
    *,
    period: float | Callable[[Any], float],
    parameters: str | Parameter | Iterable[str | Parameter],
    even: bool = False,
    breaks: npt.ArrayLike | Callable[[Any], npt.ArrayLike] = (),
    damping: float | str = 0.0,
    title: str | None = None,
) -> HillScene | DampedScene:
    """The scene of y'' + z(u, p) y = 0, or y'' + 2 c y' + z(u, p) y = 0, for `survey.evaluate` and
    `survey.run`.

    Parameters
    ----------
    z : function of u and p, plain Python or numba's: 0 <= u <= T, p the float64 array of the parameters, in order.
    period : T, a number or a function of p.
    parameters : their names, or `survey.scene.Parameter`s.
    even : is z(T - u) = z(u)? It is checked.
    breaks : where z or a derivative jumps, in [0, T]: number(s), or a function of p.
    damping : c, a number, or the name of the parameter that is c (it is added to `parameters`, the last, if it is not
        among them). Then `exponent` and `verdict` are those of the damped motion: stable where all motions decay.

    Raises survey.BadInput with one line that names what is wrong.

    Examples
    --------
    >>> import math, survey
    >>> z = lambda u, p: p[0] - 2 * p[1] * math.cos(2 * u)
    >>> mathieu = survey.hill(z, period=math.pi, parameters=("a", "q"), even=True)
    >>> int(survey.evaluate(mathieu, a=2.0, q=0.1).verdict)
    1
    """
    function = getattr(z, "py_func", z)
    name = f"hill({getattr(function, '__name__', 'z').strip('<>')})"
    try:
        text = inspect.getsource(function)
    except (OSError, TypeError):
        text = ""
    about = inspect.getdoc(function)
    scene = _hill(z, period, parameters, even, breaks, damping, name, text, title, about, ())
    _made[scene.HASH] = scene
    return scene


def abel(
    f: Callable[[Any, Any], Any],
    g: Callable[[Any, Any], Any],
    *,
    parameters: str | Parameter | Iterable[str | Parameter],
    period: float | None = None,
    title: str | None = None,
) -> AbelScene:
    """The scene of Abel's equation w w' = f(phi, p) w + g(phi, p), for `survey.evaluate` and
    `survey.run`.

    In time it is phi' = w, w' = f(phi, p) w + g(phi, p), so that turning points (w = 0) are passed.

    Parameters
    ----------
    f, g : functions of phi and p, plain Python or numba's: p is the float64 array of the parameters, in order. What
        depends on phi must be analytic: + - * / ** and functions such as sin, exp, sqrt of math or numpy.
    parameters : their names, or `survey.scene.Parameter`s; phi0, w0, and t or phi are added to them.
    period : 2 pi if f and g have that period, which is checked, else None.

    Raises survey.BadInput with one line that names what is wrong.

    Examples
    --------
    >>> import survey
    >>> van_der_pol = survey.abel(lambda phi, p: p[0] * (1 - phi**2), lambda phi, p: -phi, parameters="mu")
    >>> ds = survey.evaluate(van_der_pol, mu=1.0, phi0=2.0, t=[0.0, 5.0], question="trajectory")
    >>> float(ds.phi[1].round(6))
    -0.836907
    """
    functions = [getattr(h, "py_func", h) for h in (f, g)]
    names = [getattr(h, "__name__", "f").strip("<>") for h in functions]
    try:
        text = "\n".join(dict.fromkeys(inspect.getsource(h) for h in functions))
    except (OSError, TypeError):
        text = ""
    about = inspect.getdoc(functions[0])
    scene = _abel(f, g, period, parameters, f"abel({', '.join(names)})", text, title, about, ())
    _made[scene.HASH] = scene
    return scene


def floquet(
    A: Callable[[Any, Any, Any], Any] | None = None,
    *,
    period: float | Callable[[Any], float],
    parameters: str | Parameter | Iterable[str | Parameter],
    states: str | Iterable[str],
    structure: str = "none",
    breaks: npt.ArrayLike | Callable[[Any], npt.ArrayLike] = (),
    conserved: npt.ArrayLike | Callable[[Any], npt.ArrayLike] | None = None,
    M: Callable[[Any, Any, Any], Any] | None = None,
    C: Callable[[Any, Any, Any], Any] | None = None,
    K: Callable[[Any, Any, Any], Any] | None = None,
    title: str | None = None,
) -> FloquetScene:
    """The scene of x' = A(t, p) x, or of M q'' + C q' + K q = 0, for `survey.evaluate` and
    `survey.run`.

    Parameters
    ----------
    A : function of t, p and out, plain Python or numba's: fills the n x n matrix out, which holds zeros; p is the
        float64 array of the parameters, in order. What depends on t must be analytic between `breaks`.
    period : T, a number or a function of p.
    parameters : their names, or `survey.scene.Parameter`s.
    states : names of the n states x, or of the coordinates q.
    structure : "none"; "symplectic" if J A is symmetric, the states being coordinates, then momenta; "reversible" if
        R A(-t) R = -A(t) with a diagonal matrix R of signs. It is checked, and allows verdicts on the unit circle.
    breaks : where A or a derivative jumps, in [0, T]: number(s), or a function of p.
    conserved : n numbers w, or a function of p: w x, x the states at t = 0, is the same a period later. It is checked;
        its multiplier, 1, is not among those that are given and judged. For structure "none".
    M, C, K : instead of A, functions that fill the matrices of mass (default: the identity), damping with gyroscopic
        terms (default: 0) and stiffness; the states are then q and q', or, if symplectic, q and M q' + C q / 2.

    Raises survey.BadInput with one line that names what is wrong.

    Examples
    --------
    >>> import math, survey
    >>> def K(t, p, out):
    ...     out[0, 0] = p[0] + p[1] * math.cos(2 * t)
    >>> def C(t, p, out):
    ...     out[0, 0] = 2 * p[2]
    >>> mathieu = survey.floquet(K=K, C=C, period=math.pi, parameters=("delta", "epsilon", "zeta"), states="x")
    >>> int(survey.evaluate(mathieu, delta=1.0, epsilon=0.3, zeta=0.2).verdict)
    1
    """
    given = {
        name: function
        for name, function in (("A", A), ("M", M), ("C", C), ("K", K))
        if function is not None
    }
    first = getattr(given.get("A", given.get("K")), "py_func", given.get("A", given.get("K")))
    name = f"floquet({', '.join(getattr(h, '__name__', name).strip('<>') for name, h in given.items())})"
    try:
        text = "\n".join(
            dict.fromkeys(inspect.getsource(getattr(h, "py_func", h)) for h in given.values())
        )
    except (OSError, TypeError):
        text = ""
    about = inspect.getdoc(first) if first is not None else None
    scene = _floquet(
        given,
        period,
        parameters,
        states,
        structure,
        breaks,
        conserved,
        name,
        text,
        title,
        about,
        (),
    )
    _made[scene.HASH] = scene
    return scene


def orbit(
    f: Callable[[Any, Any, Any, Any], Any],
    *,
    states: str | Iterable[str],
    period: float | Callable[[Any], float] | None,
    parameters: str | Parameter | Iterable[str | Parameter],
    start: npt.ArrayLike | Callable[[Any], npt.ArrayLike],
    jacobian: Callable[[Any, Any, Any, Any], Any] | None = None,
    continuation: tuple[str, float, float] | None = None,
    reversed: str | Iterable[str] | None = None,
    held: str | None = None,
    transverse: str | Iterable[str] = (),
    title: str | None = None,
) -> OrbitScene:
    """The scene of the periodic orbits of x' = f(t, x, p), for `survey.evaluate` and `survey.run`.

    Outputs are the state `x0` at t = 0, the period (the least one, where it is not given), and
    those of `survey.floquet` for motions next to the orbit. Every orbit is shown to exist within its
    error bars; `status` is no_orbit where that fails. Where f does not depend on t, x0 is in the
    plane through the start that f is normal to there, or, where no orbit is found from it, through
    the state that the motion has 32 periods later, and the multipliers do not include the +1 that
    every orbit has then. Where there are several orbits, the start decides.

    Parameters
    ----------
    f : function of t, x, p and out, plain Python or numba's: fills out, n numbers, with x'; x are the n states, p the
        float64 array of the parameters, in order. It must be analytic in t and x: no abs, maximum
        or if on these. A pulse narrower than T/128 at half its height may go unseen, as may a feature
        in x that an orbit passes in less than T/1000.
    states : names of the n states.
    period : T, a number or a function of p; None: f does not depend on t, and T is found.
    parameters : their names, or `survey.scene.Parameter`s.
    start : where Newton's method begins, the n states at t = 0, or a function of p that returns them; if `period` is
        None, a guess of the period follows them.
    jacobian : function that fills the n x n matrix df/dx. It need not be given: the operations of f are recorded and
        differentiated. If it is, it is compared with that.
    continuation : name, least and greatest value of a parameter along which orbits are followed, also round folds, from
        those that are found from the start at 9 values. So points have all orbits of these curves, on any grid:
        the output `orbits` is their number, and the parameter `branch` says which one is meant: 1, 2, ..., by the mean
        square of the states, or -1, -2, ... from the largest; 1 by default.
    reversed, held : for conservative systems without a given period, whose orbits form families: the states, half of
        all, that change their sign when time is reversed (this is checked), and one of the others, whose value at
        t = 0 stays that of the start, and tells the orbits of a family apart. Orbits are sought that are their own
        mirror images, the `reversed` states 0 at t = 0 and half a period later; half of each is computed. The pair of
        multipliers 1 that all such orbits have is not given or judged.
    transverse : states, of these, that are 0 on all orbits, as out of a plane: stability against motions in these
        states alone is judged, and only their multipliers are given.

    Raises survey.BadInput with one line that names what is wrong.

    Examples
    --------
    >>> import survey
    >>> def f(t, x, p, out):
    ...     out[0], out[1] = x[1], p[0] * (1 - x[0] ** 2) * x[1] - x[0]
    >>> van_der_pol = survey.orbit(f, states=("x", "v"), period=None, parameters="mu", start=(2.0, 0.0, 6.5))
    >>> ds = survey.evaluate(van_der_pol, mu=1.0)
    >>> float(ds.period.round(9)), int(ds.verdict)
    (6.663286859, 1)
    """
    function = getattr(f, "py_func", f)
    try:
        text = inspect.getsource(function)
    except (OSError, TypeError):
        text = ""
    name = f"orbit({getattr(function, '__name__', 'f').strip('<>')})"
    about = inspect.getdoc(function)
    mirror = reversed, held, transverse
    scene = _orbit(
        f,
        period,
        parameters,
        states,
        start,
        jacobian,
        continuation,
        mirror,
        name,
        text,
        title,
        about,
        (),
    )
    _made[scene.HASH] = scene
    return scene


def find(scene: Any, near: str | Path | None = None) -> tuple[str, Any]:
    """(name, scene) for a scene's name, a file `*.py` (relative to this folder, or else `near`), or
    an own scene.
    """
    if isinstance(scene, FunctionScene):
        return scene.NAME, scene
    if callable(scene):
        maker = {3: "floquet", 4: "orbit"}.get(_arguments(scene), "hill")
        raise BadInput(
            f"scene = {shown(scene)} is a function; give survey.{maker}({getattr(scene, '__name__', 'z')}, period=...)"
        )
    if not isinstance(scene, (str, os.PathLike)) or not str(scene).endswith(".py"):
        try:
            return scene, load(scene)
        except BadInput:
            files = (
                [Path(at) / f"{scene}.py" for at in (".", near or ".")]
                if isinstance(scene, str)
                else []
            )
            if any(map(os.path.isfile, files)):
                raise BadInput(
                    f"unknown scene {scene!r}; did you mean the file '{scene}.py'?"
                ) from None
            if files and scene in ("hill", "abel", "floquet", "orbit"):
                what = "systems of your own are files, such as 'mine.py', or come from"
                raise BadInput(
                    f"unknown scene {scene!r}: {what} survey.{scene}(...) in Python"
                ) from None
            raise
    path, text = _read(scene, near)
    found = _from_text(str(path), text)
    trust.keep(found.HASH)  # naming the file means allowing it
    return str(path), found


def check(scene: Any, grid: Any = None) -> None:
    """Raise BadInput if `scene` is a user's and is wrong at the ends and middles of the grid's axes."""
    if not isinstance(scene, FunctionScene):
        return
    values, inside = np.empty((0, len(scene.own))), np.empty(0, bool)
    if grid:
        some = grid.ends_and_middles()
        values = np.stack([some[p.name] for p in scene.own], axis=1)
        held = [p.holds(values[:, i]) for i, p in enumerate(scene.own)]
        inside = np.logical_and.reduce(held)
    with np.errstate(all="ignore"):  # values that are not finite are found by the check
        scene.check(values[inside])


def of_dataset(ds: Any) -> Any:
    """The scene of a survey's dataset, as `find` takes it.

    Raises BadInput if it was a user's and has changed, Untrusted if its file has not been allowed
    to run.
    """
    name, digest = ds.attrs["scene"], ds.attrs.get("scene_hash")
    if not isinstance(name, str):
        raise BadInput(
            f"the attribute scene is {str(name)[:60]!r}, which is not the name of a scene"
        )
    if name.endswith(".py"):
        return _from_file(name, digest, Path(ds.encoding.get("source") or "").parent)
    if digest is None:
        return name
    if isinstance(digest, str) and digest in _made:
        return _made[digest]
    raise BadInput(
        f"scene = {name!r} was a function in Python: points cannot be solved again without it; "
        "pass it to survey.hill, survey.abel, survey.floquet or survey.orbit again first"
    )


def _from_file(name: str, digest: Any, near: Path) -> FunctionScene:
    """The scene in the file that a dataset names; none of it runs before its hash is compared and trusted."""
    try:
        path, text = _read(name, near)
    except BadInput:
        raise BadInput(
            f"scene = {name!r}: its file is missing; the attribute scene_text contains its text"
        ) from None
    found = hashlib.sha256(text.encode()).hexdigest()
    if found != digest:
        raise BadInput(
            f"scene = {name!r}: its file has changed since; the attribute scene_text contains the original text"
        )
    if not trust.known(found):
        raise Untrusted(str(path), found, text)
    return _from_text(str(path), text)


def _read(name: str | os.PathLike[str], near: str | Path | None) -> tuple[Path, str]:
    """(path, text) of a scene's file, read once: what is hashed is what runs. Raises BadInput."""
    paths = [Path(name), *([Path(near) / name] if near is not None else [])]
    try:
        path = next((path for path in paths if path.is_file()), None)
    except (OSError, ValueError) as error:  # a name that the system does not allow
        raise BadInput(
            f"scene = {shown(str(name), 120)}: no file can have this name ({reason_of(error)})"
        ) from None
    if path is None:
        tried = " or ".join(dict.fromkeys(short(path, 120) for path in paths))
        raise BadInput(
            f"scene = {shown(str(name), 120)}: there is no file {tried}; name the file of your own equation"
        )
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            regular = stat.S_ISREG(os.fstat(descriptor).st_mode)
            content = b""
            while regular and len(content) <= MAX_BYTES:
                if not (more := os.read(descriptor, MAX_BYTES + 1)):
                    break
                content += more
        finally:
            os.close(descriptor)
        if not regular or len(content) > MAX_BYTES:
            raise BadInput(
                f"{path}: this is not a scene: it is not a regular file, or has more than {MAX_BYTES:,} bytes"
            )
        return path, content.decode("utf-8").replace("\r\n", "\n").replace("\r", "\n")
    except (OSError, UnicodeDecodeError) as error:
        raise BadInput(f"{path}: cannot read this scene ({reason_of(error)})") from None


@lru_cache(maxsize=32)
def _from_text(name: str, text: str) -> FunctionScene:
    """The scene in the text of a file."""
    module = ModuleType(Path(name).stem)
    module.__file__ = name
    try:
        exec(compile(text, name, "exec"), module.__dict__)
    except (Exception, SystemExit) as error:
        raise BadInput(
            f"{name}: the scene file failed to run ({type(error).__name__}: {reason(error)})"
        ) from None
    matrices = {
        name: getattr(module, name) for name in "AMCK" if callable(getattr(module, name, None))
    }
    form = _form(name, module, matrices)
    _check_names(name, module, form)
    title, references = getattr(module, "TITLE", None), getattr(module, "REFERENCES", ())
    if form == "abel":
        about = module.__doc__ or inspect.getdoc(module.f)
        period = getattr(module, "PERIOD", None)
        return _abel(
            module.f, module.g, period, module.PARAMETERS, name, text, title, about, references
        )
    if form == "floquet":
        about = module.__doc__ or inspect.getdoc(matrices.get("A", matrices.get("K")))
        more = (
            getattr(module, "STRUCTURE", "none"),
            getattr(module, "BREAKS", ()),
            getattr(module, "CONSERVED", None),
        )
        given = module.PERIOD, module.PARAMETERS, module.STATES, *more
        return _floquet(matrices, *given, name, text, title, about, references)
    if form == "orbit":
        about = module.__doc__ or inspect.getdoc(getattr(module.f, "py_func", module.f))
        of_orbit = getattr(module, "jacobian", None), getattr(module, "CONTINUATION", None)
        system = module.PERIOD, module.PARAMETERS, module.STATES, module.START
        mirror = tuple(getattr(module, key, None) for key in ("REVERSED", "HELD", "TRANSVERSE"))
        return _orbit(module.f, *system, *of_orbit, mirror, name, text, title, about, references)
    optional = (
        getattr(module, "EVEN", False),
        getattr(module, "BREAKS", ()),
        getattr(module, "DAMPING", 0.0),
    )
    about = module.__doc__ or inspect.getdoc(getattr(module.z, "py_func", module.z))
    return _hill(
        module.z, module.PERIOD, module.PARAMETERS, *optional, name, text, title, about, references
    )


def _form(name: str, module: ModuleType, matrices: dict[str, Any]) -> str:
    """Which of FORMS the file of this name holds; raises BadInput if it is none."""
    if hasattr(module, "z"):
        return "hill"
    if hasattr(module, "f") and hasattr(module, "g"):
        return "abel"
    if matrices.keys() & {"A", "K"}:
        own = next(key for key in "AK" if key in matrices)
        of_orbits = ["f"] if _arguments(getattr(module, "f", None)) == 4 else []
        of_orbits += ["START"] if hasattr(module, "START") else []
        if of_orbits:
            raise BadInput(
                f"{name}: it holds {own}, of a linear periodic system, and {' and '.join(of_orbits)}, of periodic "
                "orbits; leave one of the two out, or give it another name"
            )
        return "floquet"
    if hasattr(module, "f"):
        return "orbit" if hasattr(module, "STATES") or _arguments(module.f) > 2 else "abel"
    raise BadInput(
        f"{name}: z is missing; write def z(u, p) for a Hill equation, or f(phi, p) and g(phi, p) for an Abel "
        "equation, A(t, p, out) or K(t, p, out) for a linear periodic system, f(t, x, p, out) for periodic orbits"
    )


def _check_names(name: str, module: ModuleType, form: str) -> None:
    """Raise BadInput where a name is missing, or another one looks like a slip of it, which would
    be ignored.
    """
    others = [other for other in vars(module) if not other.startswith("_")]
    for key in (*FORMS[form], *OPTIONAL[form]):
        if hasattr(module, key):
            continue
        slips = [other for other in others if other != key and other.lower() == key.lower()]
        slips += get_close_matches(
            key, [other for other in others if other.isupper()], cutoff=ALIKE
        )
        if slips:
            raise BadInput(f"{name}: unknown name {slips[0]}; did you mean {key}?")
        if key in FORMS[form]:
            none = (
                ", or None if f does not depend on t" if (form, key) == ("orbit", "PERIOD") else ""
            )
            raise BadInput(f"{name}: {key} is missing; write {EXAMPLES[key]}{none}")


def _function(
    letter: str,
    function: Any,
    arguments: tuple[str, ...],
    what: str,
    refuse: Callable[[str], NoReturn],
) -> None:
    """Refuse a value that cannot be called with these arguments, or has one of these names in
    another position; further arguments have defaults.
    """
    call = f"{letter}({', '.join(arguments)})"
    count = {2: "two", 3: "three", 4: "four"}[len(arguments)]
    if not callable(function) or not _takes(function, len(arguments)):
        refuse(f"{letter} must be a function of {count} arguments, {call}{what}")
    own = list(inspect.signature(getattr(function, "py_func", function)).parameters)
    if any(mine in arguments and mine != right for mine, right in zip_longest(own, arguments)):
        refuse(f"{letter}({', '.join(own)}): its arguments come in the order {call}; change it")


def _of_parameters(key: str, function: Any, refuse: Callable[[str], NoReturn]) -> None:
    """Refuse a function that cannot be called with the parameters p alone."""
    if callable(function):
        try:
            inspect.signature(getattr(function, "py_func", function)).bind(None)
        except TypeError:
            refuse(
                f"{key} must be a function of one argument, the array p of the parameters, or no function"
            )
        except ValueError:  # its arguments cannot be known
            pass


def _hill(
    z: Any, period: Any, parameters: Any, even: Any, breaks: Any, damping: Any,
    name: str, text: str, title: str | None, about: str | None, references: Iterable[str],
) -> HillScene | DampedScene:  # fmt: skip
    """The checked scene; raises BadInput."""
    from survey.measures.hill import monodromy
    from survey.request.hill_scene import HillScene

    def refuse(message: str) -> NoReturn:
        raise refusal(name, message)

    _function("z", z, ("u", "p"), "; the parameters are p[0], p[1], ...", refuse)
    parameters = _parameters(parameters, monodromy.OUTPUTS, (), refuse)
    names = [p.name for p in parameters]
    if not isinstance(even, (bool, np.bool_)):
        refuse(f"EVEN = {even!r}: it must be True or False")
    if not callable(period) and not (is_number(period) and 0 < period < np.inf):
        refuse(
            f"PERIOD = {period!r}: it must be a positive number, or a function of p that returns one"
        )
    breaks = _checked_breaks(breaks, period, "u", refuse)
    c, named = None, None
    if isinstance(damping, str) or damping != 0:
        from survey.request.damped_scene import DampedScene, checked_damping

        c, named = checked_damping(damping, refuse)
        if named is not None and named not in names:
            parameters = _parameters((*parameters, named), monodromy.OUTPUTS, (), refuse)
            names.append(named)
    damped = c is not None or named is not None
    equation = f"y'' + 2 {named or 'c'} y' + z(u, p) y = 0" if damped else "y'' + z(u, p) y = 0"
    about, title = _titled(name, about, title, equation, parameters)
    known = (z, period, breaks, parameters, even, *([damping] if damped else []))
    shared = dict(
        z=z, period=period, breaks=breaks, own=parameters,
        **_described(name, text, title, about, references or REFERENCES, known),
    )  # fmt: skip
    if damped:
        return DampedScene(
            damping=c, column=names.index(named) if named else None, even=bool(even), **shared
        )
    return HillScene(EVEN=bool(even), **shared)


def _abel(
    f: Any, g: Any, period: Any, parameters: Any,
    name: str, text: str, title: str | None, about: str | None, references: Iterable[str],
) -> AbelScene:  # fmt: skip
    """The checked scene; raises BadInput."""
    from survey.request.abel_scene import AbelScene
    from survey.scenes import gyrostat

    def refuse(message: str) -> NoReturn:
        raise refusal(name, message)

    for letter, function in (("f", f), ("g", g)):
        _function(letter, function, ("phi", "p"), "; the parameters are p[0], p[1], ...", refuse)
    parameters = _parameters(
        parameters, gyrostat.OUTPUTS, ("phi0", "w0", "question", "branch"), refuse
    )
    if period is not None and not (is_number(period) and abs(period - 2 * np.pi) <= 1e-15 * period):
        refuse(f"PERIOD = {period!r}: it must be 2 pi, to which phi can be scaled, or None")
    about, title = _titled(name, about, title, "w w' = f(phi, p) w + g(phi, p)", parameters)
    known = (f, g, period, parameters)
    described = _described(name, text, title, about, references or ABEL_REFERENCES, known)
    return AbelScene(f=f, g=g, period=period, own=parameters, **described)


def _floquet(
    matrices: dict[str, Any], period: Any, parameters: Any, states: Any, structure: Any, breaks: Any,
    conserved: Any, name: str, text: str, title: str | None, about: str | None, references: Iterable[str],
) -> FloquetScene:  # fmt: skip
    """The checked scene; raises BadInput."""
    from survey.measures.floquet import stability
    from survey.request.floquet_scene import LARGEST, FloquetScene

    def refuse(message: str) -> NoReturn:
        raise refusal(name, message)

    if ("A" in matrices) == ("K" in matrices) or (len(matrices) > 1 and "A" in matrices):
        refuse("give either A(t, p, out), or K(t, p, out) with or without M and C")
    for letter, function in matrices.items():
        _function(letter, function, ("t", "p", "out"), ", that fills the matrix out", refuse)
    parameters = _parameters(parameters, stability.OUTPUTS, ("multiplier", "row", "column"), refuse)
    names = _state_names(states, refuse)
    if "K" in matrices:
        names += tuple(f"{'p_' if structure == 'symplectic' else 'd'}{n}" for n in names)
    if len(names) > LARGEST:
        refuse(f"STATES names {len(names)} states; at most {LARGEST} are allowed")
    if structure not in stability.STRUCTURES:
        refuse(
            f"STRUCTURE = {structure!r}: it must be one of {', '.join(map(repr, stability.STRUCTURES))}"
        )
    if structure == "symplectic" and len(names) % 2:
        refuse(
            f"STRUCTURE = 'symplectic', but STATES names {len(names)} states; it must name an even number"
        )
    if not callable(period) and not (is_number(period) and 0 < period < np.inf):
        refuse(
            f"PERIOD = {period!r}: it must be a positive number, or a function of p that returns one"
        )
    breaks = _checked_breaks(breaks, period, "t", refuse)
    _of_parameters("CONSERVED", conserved, refuse)
    if conserved is not None and not callable(conserved):
        given = conserved
        try:
            rows = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            rows = np.zeros(0)
        if sum(length > 1 for length in rows.shape) > 1:
            refuse(
                f"CONSERVED = {shown(given)}: one combination of the states alone can be stated; give "
                f"its coefficients, {len(names)} numbers"
            )
        conserved = tuple(rows.ravel().tolist())
        if len(conserved) != len(names):
            refuse(
                f"CONSERVED = {shown(given)}: there are {len(names)} states, and each needs a number"
            )
    if conserved is not None and (structure != "none" or len(names) < 2):
        refuse("CONSERVED is for STRUCTURE = 'none', and two states at least")
    equation = "x' = A(t, p) x" if "A" in matrices else "M q'' + C q' + K q = 0"
    about, title = _titled(name, about, title, equation, parameters)
    known = (*matrices.items(), period, breaks, parameters, names, structure)
    known += () if conserved is None else (conserved,)
    return FloquetScene(
        matrices=matrices, period=period, breaks=breaks, states=names, structure=structure, conserved=conserved,
        own=parameters, **_described(name, text, title, about, references or FLOQUET_REFERENCES, known),
    )  # fmt: skip


def _orbit(
    f: Any, period: Any, parameters: Any, states: Any, start: Any, jacobian: Any, continuation: Any,
    mirror: tuple[Any, ...], name: str, text: str, title: str | None, about: str | None, references: Iterable[str],
) -> OrbitScene:  # fmt: skip
    """The checked scene; raises BadInput."""
    from survey.measures.floquet import orbit
    from survey.request.orbit_scene import LARGEST, OrbitScene

    def refuse(message: str) -> NoReturn:
        raise refusal(name, message)

    for letter, function in (("f", f), ("jacobian", jacobian)):
        if function is not None or letter == "f":
            _function(letter, function, ("t", "x", "p", "out"), ", that fills out", refuse)
    more = (
        "state",
        "multiplier",
        "row",
        "column",
        *(("orbits", "branch") if continuation is not None else ()),
    )
    parameters = _parameters(parameters, orbit.OUTPUTS, more, refuse)
    continued = None
    if continuation is not None:
        parameters, continued = _continued(continuation, parameters, refuse)
    names = _state_names(states, refuse)
    if len(names) > LARGEST:
        refuse(f"STATES names {len(names)} states; at most {LARGEST} are allowed")
    if period is None and len(names) < 2:
        refuse("STATES names one state: without a PERIOD, orbits need two")
    if (
        period is not None
        and not callable(period)
        and not (is_number(period) and 0 < period < np.inf)
    ):
        refuse(
            f"PERIOD = {period!r}: it must be a positive number, a function of p that returns one, or None"
        )
    for key, function in (("PERIOD", period), ("START", start)):
        _of_parameters(key, function, refuse)
    symmetry = _symmetry(mirror, names, period, refuse)
    needed = len(names) + (period is None)
    if not callable(start):
        try:
            start = tuple(float(x) for x in np.atleast_1d(start).tolist())
        except (TypeError, ValueError):
            start = ()
        if len(start) != needed or not np.isfinite(start).all():
            guess = " and a guess of the period" if period is None else ""
            refuse(
                f"START must be {needed} numbers, the states{guess}, or a function of p that returns them"
            )
        if period is None and start[-1] <= 0.0:
            refuse(
                f"START ends in {start[-1]:g}, the guess of the period, as PERIOD is None; it must be positive"
            )
    equation = "Periodic orbits of x' = f(t, x, p)"
    about, title = _titled(name, about, title, equation, parameters)
    known = (
        f,
        period,
        parameters,
        names,
        start,
        jacobian,
        continued,
        *(() if symmetry is None else (symmetry,)),
    )
    return OrbitScene(
        f=f, period=period, start=start, jacobian=jacobian, states=names, continued=continued, symmetry=symmetry,
        own=parameters,
        **_described(name, text, title, about, references or ORBIT_REFERENCES, known),
    )  # fmt: skip


def _titled(
    name: str, about: str | None, title: str | None, equation: str, parameters: Iterable[Parameter]
) -> tuple[str, str]:
    """(docstring, title): where there is none, the equation, in the title with the name of the file
    or of the functions, if that is more than a letter.
    """
    about = inspect.cleandoc(about or "")
    if about:
        return about, title or about.splitlines()[0].rstrip(".")
    own = Path(name).stem if name.endswith(".py") else name.partition("(")[2].rstrip(")")
    says = any(len(part) > 1 and part != "lambda" for part in own.split(", "))
    names = ", ".join(p.name for p in parameters)
    return f"{equation}, p = ({names}).", title or (f"{own}: {equation}" if says else equation)


def _described(
    name: str, text: str, title: str, about: str, references: Iterable[str], known: Any
) -> dict[str, Any]:
    """The fields that say what a scene is; `known` is what its hash is of, if there is no file."""
    bits = text.encode() if name.endswith(".py") else _bits(known)
    return {
        "NAME": name,
        "TEXT": text,
        "HASH": hashlib.sha256(bits).hexdigest(),
        "TITLE": title,
        "about": about,
        "REFERENCES": tuple(references),
    }


def _continued(
    given: Any, parameters: tuple[Parameter, ...], refuse: Callable[[str], NoReturn]
) -> tuple[tuple[Parameter, ...], Any]:
    """The parameters, one of them within the range of continuation, and that `Range`."""
    from survey.measures.floquet.continuation import Range

    names = [p.name for p in parameters]
    try:
        name, low, high = given[0], float(given[1]), float(given[2])
        good = len(given) == 3 and name in names and np.isfinite([low, high]).all()
    except (TypeError, ValueError, IndexError, KeyError):
        good = False
    if not good:
        refuse(
            f"CONTINUATION = {shown(given)}: give (name, least, greatest value) of one of {', '.join(names)}"
        )
    if not low < high:
        refuse(
            f"CONTINUATION = {shown(given)}: {low:g} is not below {high:g}; give (name, least, greatest value)"
        )
    index = names.index(name)
    own = parameters[index]
    if not own.holds([low, high]).all():
        refuse(f"CONTINUATION = {shown(given)}: the range is not within the domain, {own.domain}")
    own = replace(own, minimum=low, maximum=high, open_minimum=False, open_maximum=False)
    return (*parameters[:index], own, *parameters[index + 1 :]), Range(index, low, high)


def _symmetry(
    mirror: tuple[Any, ...], names: tuple[str, ...], period: Any, refuse: Callable[[str], NoReturn]
) -> Any:
    """The `Symmetry` of the orbits that are sought, from REVERSED, HELD and TRANSVERSE, or None."""
    from survey.measures.floquet.symmetry import Symmetry

    odd, held, transverse = mirror
    given = {"REVERSED": odd, "TRANSVERSE": transverse}
    numbers_of = {}
    for key, value in given.items():
        some = (
            (value,)
            if isinstance(value, str)
            else tuple(value)
            if isinstance(value, Iterable)
            else ()
        )
        for one in some:
            if one not in names or some.count(one) > 1:
                refuse(f"{key} names {one!r}; name states, each once: {', '.join(names)}")
        numbers_of[key] = tuple(sorted(names.index(one) for one in some))
    odd, transverse = numbers_of["REVERSED"], numbers_of["TRANSVERSE"]
    if not odd:
        if held is not None or transverse:
            refuse(
                f"{'TRANSVERSE' if transverse else 'HELD'} is for orbits with REVERSED; name these states too"
            )
        return None
    if period is not None:
        refuse("REVERSED is for orbits whose PERIOD is not known; set PERIOD = None")
    if 2 * len(odd) != len(names):
        refuse(
            f"REVERSED names {len(odd)} of {len(names)} states; half of all must change their sign"
        )
    if transverse and len(transverse) == len(names):
        refuse("TRANSVERSE names all states; some must move on the orbits")
    if held not in names or names.index(held) in (*odd, *transverse):
        others = [one for k, one in enumerate(names) if k not in (*odd, *transverse)]
        refuse(
            f"HELD = {held!r}: name one of {', '.join(others)}, whose value at t = 0 is that of START"
        )
    if 2 * len(set(odd) & set(transverse)) != len(transverse):
        refuse(
            "TRANSVERSE: half of these states must be REVERSED, as a coordinate and its velocity"
        )
    if len(names) < 4 and not transverse:
        refuse(
            "REVERSED: in two states there is no other multiplier to judge; name four states at least"
        )
    return Symmetry(len(names), odd, names.index(held), transverse)


def _state_names(states: Any, refuse: Callable[[str], NoReturn]) -> tuple[str, ...]:
    """The names of the states; a text of several letters is refused, as it may mean one or many."""
    if isinstance(states, str) and len(states) > 1 and states.isidentifier():
        refuse(
            f"STATES = {states!r} may be one name or several; write ({states!r},), or {tuple(states)!r}"
            if len(set(states)) == len(states) and states.isalpha()
            else f"STATES = {states!r} is a text, not a list of names; write ({states!r},)"
        )
    names = (
        (states,)
        if isinstance(states, str)
        else tuple(states)
        if isinstance(states, Iterable)
        else ()
    )
    if not names or any(
        not isinstance(n, str) or not n.isidentifier() or names.count(n) > 1 for n in names
    ):
        refuse(
            f"STATES = {shown(states)}: give the names of the states, each once, as identifiers{_apart(states)}"
        )
    return names


def _checked_breaks(breaks: Any, period: Any, time: str, refuse: Callable[[str], NoReturn]) -> Any:
    """Positions in [0, T] as a tuple, or the function that returns them."""
    from survey.request.hill_scene import SAME

    for key, function in (("PERIOD", period), ("BREAKS", breaks)):
        _of_parameters(key, function, refuse)
    if callable(breaks):
        return breaks
    given = np.atleast_1d(np.asarray(breaks, dtype=object)).tolist()
    if not all(is_number(u) for u in given):
        refuse(
            f"BREAKS = {breaks!r}: it must be number(s) in [0, PERIOD], or a function of p that returns them"
        )
    breaks = tuple(float(u) for u in given)
    outside = [
        b for b in breaks if not 0 <= b <= (np.inf if callable(period) else period * (1 + SAME))
    ]
    if outside:
        length = "" if callable(period) else f" = {period:g}"
        refuse(
            f"BREAKS: {outside[0]:g} lies outside 0 <= {time} <= T{length}; name positions within one period"
        )
    return breaks


def _parameters(
    given: Any, outputs: Iterable[Any], more: Iterable[str], refuse: Callable[[str], NoReturn]
) -> tuple[Parameter, ...]:
    """The parameters; refused where a name is that of an output, a keyword, or one of `more`."""
    if isinstance(given, (str, Parameter)) or not isinstance(given, Iterable):
        given = (given,)
    parameters = tuple(
        p if isinstance(p, Parameter) else Parameter(str(p), str(p), _symbol(str(p))) for p in given
    )
    names = [p.name for p in parameters]
    taken = {o.name for o in outputs} | {"status", "method", "rtol", "variables", "scene", *more}
    wrong = next(
        (n for n in names if not n.isidentifier() or n in taken or names.count(n) > 1), None
    )
    if wrong is not None or not names:
        because = f"; rename {wrong!r}, which is taken" if wrong in taken else _apart(wrong)
        refuse(
            f"PARAMETERS = {shown(names)}: give at least one name, each once, as an identifier that is neither an "
            f"output nor a keyword{because}"
        )
    return parameters


def _apart(names: Any) -> str:
    """How several names in one text are written, if `names` is such a text."""
    parts = re.split(r"[\s,;]+", names.strip()) if isinstance(names, str) else []
    return (
        f"; write {tuple(parts)!r}"
        if len(parts) > 1 and all(part.isidentifier() for part in parts)
        else ""
    )


def _symbol(name: str) -> str:
    """The name in TeX."""
    return name if len(name) == 1 else rf"\mathrm{{{name.replace('_', chr(92) + '_')}}}"


def _arguments(z: Any) -> int:
    """The number of arguments without defaults; 0 if it cannot be known."""
    try:
        given = inspect.signature(getattr(z, "py_func", z)).parameters.values()
    except (TypeError, ValueError):
        return 0
    return sum(one.default is one.empty for one in given)


def _takes(function: Any, number: int) -> bool:
    """Can it be called with so many arguments?"""
    try:
        inspect.signature(getattr(function, "py_func", function)).bind(*[None] * number)
    except (TypeError, ValueError):
        return False
    return True


def _names(code: CodeType) -> list[str]:
    """Global names that the code, or a function inside it, refers to."""
    inner = [const for const in code.co_consts if inspect.iscode(const)]
    return [*code.co_names, *(name for function in inner for name in _names(function))]


def _bits(value: Any, seen: tuple[int, ...] = ()) -> bytes:
    """Bytes that change when a function, what it calls, or any of its numbers changes."""
    value = getattr(value, "py_func", value)
    if id(value) in seen:
        return b""
    seen = (*seen, id(value))
    if isinstance(value, (tuple, list)):
        return b"(" + b",".join(_bits(item, seen) for item in value) + b")"
    code = getattr(value, "__code__", value)
    if inspect.iscode(code):
        parts = [code.co_code, repr(code.co_names).encode(), _bits(code.co_consts, seen)]
        if code is not value:
            names = [value.__globals__.get(name) for name in _names(code)]
            cells = [cell.cell_contents for cell in value.__closure__ or ()]
            own = getattr(getattr(value, "__self__", None), "__dict__", {})  # of a method
            parts += [_bits([*names, *cells, *(value.__defaults__ or ()), *own.items()], seen)]
        return b"<" + b";".join(parts) + b">"
    if isinstance(value, np.ndarray):
        return value.tobytes()
    if isinstance(value, partial):
        return _bits([value.func, value.args, *value.keywords.items()], seen)
    return (value.__name__ if inspect.ismodule(value) else repr(value)).encode()
