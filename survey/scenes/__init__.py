"""The scenes: one physical system per file. `survey/scene.py` holds the words in which a scene
describes itself.

A scene module holds what CONTRACT lists, and no other public name; the table is checked when the
scene is loaded. Another package brings scenes by entry points of the group "survey.scenes": `NAME =
"package.module"`.

`solve(point, request)` answers one block. `point` maps each parameter that exists to a float64
array; all have the same number of dimensions and broadcast to the block's shape: an axis of the
block is long in the arrays that vary along it and 1 in the others, so that what depends on one axis
is computed once (`survey.measures.rows` helps). A value outside the domain of its parameter arrives
as NaN: such points get the status `invalid_parameters`. `request` is a survey.scene.Request;
`request.line(name)` describes the full axis of a parameter, of which the block may be a part.

`solve` returns, in the block's shape (plus an output's extra dimensions), every output in
`request.variables` (all of them if that is empty), `X_error` (float64), an absolute error bound,
for each float output `X`, and `status` (int8: the codes of `survey.status`, from 16 on the scene's
own in the order of STATUS). Where an output does not apply a float is NaN, an integer its `fill`.
Where a scene gives a status of its own, the verdict is -1, and maps and counts name the status. A
scene may fill arrays of `request.out`, in which outputs are stored, and return these, error bounds
(float32) rounded up and finite.
`solve` is pure and thread-safe, and gives a point the same bits in any block: the arrays of `point`
are the dataset's coordinates, to read alone.

In `why` and `trajectory`, `point` maps each parameter to a number, and `answer` holds everything
that is known of one point, {name: array}, flags as words. `compile_ahead` runs in a process of its
own at the first use of a question, and the solver waits for its end, or for its next `yield` or that
of a name, where it needs what is compiled there (see `survey.waiting`).
"""

import ast
import sys
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from survey import contract, measures, methods, modules
from survey.contract import Function, Value
from survey.errors import BadInput
from survey.scene import Option, Output, Parameter
from survey.wording import html_table, short

GROUP = "survey.scenes"  # of entry points

CONTRACT = {
    "TITLE": Value("one line", str, needed=True),
    "PARAMETERS": Value(
        "survey.scene.Parameter, in the order in which they are listed",
        tuple,
        needed=True,
        each=Parameter,
    ),
    "OPTIONS": Value(
        "survey.scene.Option: switches with a few values each", tuple, needed=True, each=Option
    ),
    "OUTPUTS": Value(
        "survey.scene.Output: what `solve` gives, except `status`", tuple, needed=True, each=Output
    ),
    "FAMILY": Value(
        "the methods whose SERVES names this family can solve the scene", str, needed=True
    ),
    "AUDIT": Value(
        "methods by which `survey verify` solves points again, the first choice first",
        tuple,
        needed=True,
    ),
    "REFERENCES": Value("sources, one string each", tuple, needed=True),
    "STATUS": Value(
        "{name: sentence}: its own reasons why a point has no answer; its own sentence for a common one",
        dict,
    ),
    "RATIOS": Value(
        "parameters without a unit, in a scene whose others are in any consistent units", tuple
    ),
    "DIMENSIONS": Value(
        "{name: coordinates} of the extra dimensions that its outputs name in `dims`", dict
    ),
    "EVEN": Value(
        "is the coefficient of its Hill equation even about the half period? True if not given",
        bool,
    ),
    "STARTER": Value(
        "what `survey init` asks: {parameter: number, or (start, stop) of an axis}, besides what must be given; and "
        '"figures": the output that is drawn',
        dict,
    ),
    "states": Value(
        "names of the states of its linear periodic system; coordinates, then momenta if symplectic",
        tuple,
    ),
    "structure": Value(
        "of that system, as in `survey.floquet`: none, symplectic or reversible", str
    ),
    "cost": Function(
        "rough seconds per point with the default method; `sizes` is {parameter: number of values}, 1 if it is fixed",
        ("options", "sizes"),
        needed=True,
    ),
    "SECONDS": Value(
        "{output: seconds that a point takes besides where it is named}, of outputs on request",
        dict,
    ),
    "COMPILING": Value(
        "{output: seconds that compiling takes besides where it is named}, of outputs on request",
        dict,
    ),
    "curves_seconds": Value(
        "seconds that the curves of [boundaries] take on a map of the whole domain, where they are searched",
        float,
    ),
    "remark": Value("a sentence that `survey plan` adds, on what makes the scene slow", str),
    "solve": Function("{output: array} of a block, see above", ("point", "request"), needed=True),
    "why": Function(
        "a sentence: what decided the verdict, by which margin against which error bar", ("answer",)
    ),
    "trajectory": Function(
        "survey.scene.Trajectory: the motion at one point up to `time`, or as long as suits if that is None; None if "
        "these options have no motion",
        ("point", "answer", "options", "time"),
    ),
    "equation": Function(
        "for `survey prove`: (kind, [(end, formulas ...), ...]), the equation for `survey/proof/checker.py`; "
        "`names`: for each parameter its name, or its value as a text; `ends`: {parameter: (least, largest value)}",
        ("names", "ends", "options"),
    ),
    "compile_ahead": Function(
        "compile some kernels of a map of these variables, by calls on next to nothing; see above",
        ("variables", "options"),
    ),
}


class _Folder(ModuleType):
    """`survey.scenes` is this folder; called, it gives the Titles of the scenes."""

    def __call__(self):
        others = {name: _title_brought(point) for name, point in brought().items()}
        return Titles({name: _title(name) for name in modules.names(self)} | others)


class Titles(dict):
    """{name: title} of the scenes, shown as a table."""

    def __repr__(self):
        width = max(map(len, self), default=0)
        return "\n".join(f"{name:<{width}}  {title}" for name, title in self.items())

    def _repr_html_(self):
        return html_table("scenes", self.items())


def load(name):
    """The scene `name`, a module. Raises BadInput if there is none, or if it does not keep to CONTRACT."""
    others = brought()
    if isinstance(name, str) and name in others:
        module = _loaded(name, others[name])
    else:
        module = modules.load(sys.modules[__name__], name, "scene", others)
    _check(module)
    return module


def _title(name):
    """TITLE of a scene, from its source: importing all scenes would take seconds."""
    source = next((Path(folder) / f"{name}.py" for folder in sys.modules[__name__].__path__), None)
    if f"{__name__}.{name}" not in sys.modules and source and source.is_file():
        title = _constant(source, "TITLE")
        return title if title is not None else load(name).TITLE
    return load(name).TITLE


def _title_brought(point):
    """TITLE of a scene of another package, or why it has none: a broken one must not hide the others."""
    try:
        module = point.load()
        _check(module)
    except Exception as error:
        return f"cannot be loaded: {_reason(error)}"
    return module.TITLE


def _constant(source, name):
    """The constant `name` in the file `source`, read without an import; None if it is computed."""
    set_by = [
        node
        for node in ast.parse(source.read_bytes()).body
        for to in (getattr(node, "targets", None) or [getattr(node, "target", None)])
        if getattr(to, "id", "") == name
    ]
    if len(set_by) != 1 or not isinstance(set_by[0], ast.Assign):
        return None
    try:
        return ast.literal_eval(set_by[0].value)
    except ValueError:
        return None


def _serves(method):
    """The families that the method serves; None if they are computed."""
    loaded = sys.modules.get(f"{methods.__name__}.{method}")
    if loaded is not None:
        return loaded.SERVES
    return _constant(Path(methods.__path__[0]) / f"{method}.py", "SERVES")


@cache
def brought():
    """{name: entry point} of the scenes of other packages; those of this package come first."""
    own = modules.names(sys.modules[__name__])
    return {point.name: point for point in entry_points(group=GROUP) if point.name not in own}


def _loaded(name, point):
    """The module of an entry point; raises BadInput if it cannot be imported."""
    try:
        return point.load()
    except Exception as error:
        raise BadInput(
            f"the scene {name} of the package {point.dist.name if point.dist else point.value} cannot be loaded "
            f"({_reason(error)})"
        ) from None


def _reason(error):
    return f"{type(error).__name__}: {short(error, 150)}"


@cache
def _check(module):
    where = "survey/scenes/__init__.py"
    contract.check(module, CONTRACT, where)
    if not measures.is_family(module.FAMILY):
        contract.refuse(module, f"FAMILY names no family {module.FAMILY!r}", where)
    for name in module.AUDIT:
        if name not in modules.names(methods):
            contract.refuse(
                module, f"AUDIT: {modules.unknown('method', name, modules.names(methods))}", where
            )
        serves = _serves(name)
        if serves is not None and module.FAMILY not in serves:
            words = f"AUDIT names {name!r}, which does not serve the family {module.FAMILY!r}"
            contract.refuse(module, words, where)


sys.modules[__name__].__class__ = _Folder
