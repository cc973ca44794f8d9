"""The scenes: one physical system per file. See `survey/scene.py` for the words they use.

A scene module holds what CONTRACT lists, and no other public name; the table is checked when the scene is loaded.
Where a scene gives a status of its own, the verdict is -1, and maps and counts name the status. `compile_ahead` runs in
a process of its own beside a map, which waits for it (`kernels.jit.wait_for_ahead`) when it needs what is compiled.

In `why` and `trajectory`, `point` maps each parameter to a number, and `answer` holds everything that is known of one
point, {name: array}, flags as words.

`point` of `solve` maps each parameter that exists to a float64 array; all have the same number of dimensions and
broadcast to the block's shape (an axis of the block is long in one array and 1 in the others, so what depends on
one axis is computed once). A parameter outside its domain arrives as NaN: such points get the status
`invalid_parameters`. `solve` returns, in the block's shape (plus an output's extra dimensions), every output in
`request.variables` or all of them, `X_error` (float64) for each float output `X`, and `status` (int8). It is pure,
thread-safe, and gives a point the same bits in any block.
"""

import sys
from functools import cache
from types import ModuleType

from survey import contract, modules
from survey.contract import Function, Value

CONTRACT = {
    "TITLE": Value("one line", str, needed=True),
    "PARAMETERS": Value("survey.scene.Parameter, in the order in which they are told", tuple, needed=True),
    "OPTIONS": Value("survey.scene.Option", tuple, needed=True),
    "OUTPUTS": Value("survey.scene.Output", tuple, needed=True),
    "FAMILY": Value("the methods that serve it are those whose SERVES names this family", str, needed=True),
    "AUDIT": Value("methods by which `survey verify` solves points again", tuple, needed=True),
    "REFERENCES": Value("sources, one string each", tuple, needed=True),
    "STATUS": Value(
        "{name: sentence}: its own reasons why a point has no answer; its own words for a common one", dict
    ),
    "DIMENSIONS": Value("{name: coordinates} of the extra dimensions of its outputs", dict),
    "EVEN": Value("is the coefficient of its Hill equation even about the half period? True if not given", bool),
    "cost": Function(
        "seconds per point, roughly; `sizes` is {parameter: number of values}", ("options", "sizes"), needed=True
    ),
    "solve": Function("{output: array} of a block, see above", ("point", "request"), needed=True),
    "why": Function("a sentence: what decided the verdict, by which margin against which error bar", ("answer",)),
    "trajectory": Function(
        "survey.scene.Trajectory: the motion at one point up to `time` (None: what suits)",
        ("point", "answer", "options", "time"),
    ),
    "compile_ahead": Function(
        "compile some kernels of a map of these variables, in a process of its own", ("variables",)
    ),
}


class _Folder(ModuleType):
    """`survey.scenes` is this folder; called, it gives {name: title} of the scenes."""

    def __call__(self):
        return {name: load(name).TITLE for name in modules.names(self)}


def load(name):
    """The scene `name`, a module. Raises BadInput if there is none, or if it does not keep to CONTRACT."""
    module = modules.load(sys.modules[__name__], name, "scene")
    _check(module)
    return module


@cache
def _check(module):
    contract.check(module, CONTRACT, "survey/scenes/__init__.py")


sys.modules[__name__].__class__ = _Folder
