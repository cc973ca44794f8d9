"""The scenes: one physical system per file. See `survey/scene.py` for the words they use.

A scene module holds TITLE (one line), PARAMETERS, OPTIONS, OUTPUTS (tuples), STATUS (its own status names and
sentences: why a point has no answer by nature; its verdict is -1, and maps and counts name the status), FAMILY (the
methods that serve it: those whose SERVES names that family), AUDIT (the methods by which `survey verify` solves points
again), REFERENCES (tuple of strings), and two functions:

    cost(options, sizes) -> seconds per point, a rough figure for cutting blocks and for the plan; `sizes` holds the
        number of values of each parameter
    solve(point, request) -> {output: array}

and, for `ds.survey.point` and `ds.survey.trajectory`, if it likes, two more:

    why(answer) -> a sentence: what decided the verdict, by which margin against which error bar
    trajectory(point, answer, options, time) -> survey.scene.Trajectory: the motion at one point, up to `time` (None:
        what suits); `point` maps each parameter to a number

and, if its maps compile for long on a new machine:

    compile_ahead(variables) -> None: compiles some kernels of a map of these variables, in a process of its own beside
        that of the map, which waits for it (`kernels.jit.wait_for_ahead`) where it comes to need them

where `answer` holds everything that is known of one point, {name: array}, flags as words.

`point` of `solve` maps each parameter that exists to a float64 array; all have the same number of dimensions and
broadcast to the block's shape (an axis of the block is long in one array and 1 in the others, so what depends on
one axis is computed once). A parameter outside its domain arrives as NaN: such points get the status
`invalid_parameters`. `solve` returns, in the block's shape (plus an output's extra dimensions), every output in
`request.variables` or all of them, `X_error` (float64) for each float output `X`, and `status` (int8). It is pure,
thread-safe, and gives a point the same bits in any block.
"""

import sys
from types import ModuleType

from survey import modules


class _Folder(ModuleType):
    """`survey.scenes` is this folder; called, it gives {name: title} of the scenes."""

    def __call__(self):
        return {name: modules.load(self, name, "scene").TITLE for name in modules.names(self)}


sys.modules[__name__].__class__ = _Folder
