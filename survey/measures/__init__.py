"""The measures: one family a folder, one question a file, shared by the scenes that ask it.

The same question has the same name in every family, so that it is found by its folder: QUESTIONS
lists those that the layers above ask by name. METHODS in a folder's `__init__` lists what methods
offer its families. Both are checked when a module is loaded.
"""

import sys
from functools import cache
from pkgutil import iter_modules

from survey import contract, methods, modules
from survey.contract import Function, Value

# {question: what `measures/FAMILY/QUESTION.py` must offer}; a family that has no such file does not
# answer it.
QUESTIONS = {
    # The curves that [boundaries] draws on a map: `closed` where they are known without a search,
    # `searched` where the scene's outputs at any points of the map tell, else `trace`.
    "curves": {
        "closed": Function(
            "the Curves on the map of two `axes`, a Square, where `fixed` holds the other parameters "
            "(comes with `refusal`, CLASSES, TITLE and ALONG)",
            ("square", "axes", "fixed", "options"),
        ),
        "searched": Function(
            "the same from the outputs of the `scene`",
            ("scene", "square", "axes", "fixed", "options"),
        ),
        "serves": Function("are curves known for the scene? Yes if it is missing", ("scene",)),
        "refusal": Function(
            "why there are no curves on a map of these axes, in words; None if there are; `options` may be missing",
            ("axes", "scene", "options"),
        ),
        "seconds": Function(
            "estimated seconds of `closed` on one thread; a tenth of a second if missing", ("axes",)
        ),
        "CLASSES": Value("{name: code} of the curves' classes", dict),
        "TITLE": Value("what a class is, one line", str),
        "NUMBER": Value(
            "what the number of a curve is, one line, if the Curves have an `index`", str
        ),
        "ALONG": Value("survey.scene.Output of what is known at each point of a curve", tuple),
        "trace": Function(
            "the FollowedCurves through `seeds`, edges in the Square; solve(q, p, wanted) gives outputs of the scene",
            ("solve", "square", "seeds", "each"),
        ),
        "Seeds": Value(
            "x, kind, index, low, high: edges to begin from, see `measures.hill.curves`", type
        ),
    },
    # The surfaces that [boundaries] draws in a box of three parameters, see `measures.isosurfaces`.
    "surfaces": {
        "refusal": Function("why the scene has no surfaces, in words; None if it has", ("scene",)),
        "Functions": Value(
            "the functions, {class: function} in a box of three `axes`, whose zeros are the surfaces: "
            "Functions(scene, box, axes, fixed, options, method, rtol) has on_lattice(x) -> ({class: (values, "
            "bounds)}, numbers that change on surfaces alone, -1 where they are not known, or None), "
            "sharp(x, class) -> (values, bounds) and passing(x, class) -> (does it?, {name: (values, bounds)})",
            type,
            needed=True,
        ),
        "CLASSES": Value("{name: code} of the surfaces' classes", dict, needed=True),
        "TITLE": Value("what a class is, one line", str, needed=True),
        "ALONG": Value("survey.scene.Output of what is known at each vertex", tuple, needed=True),
    },
    # The edges of tongues on each row of a map, between which verdicts do not change.
    "edges": {
        "find": Function(
            "the Edges between `low` and `high` on so many `rows`; solve(row, x, wanted) gives outputs of the scene",
            ("solve", "rows", "low", "high"),
            needed=True,
        ),
        "joined": Function("the Edges of all parts of the same rows", ("parts",), needed=True),
        "Edges": Value(
            "row, position, error, kind, index, complete: see `measures.hill.edges`",
            type,
            needed=True,
        ),
        "CLASSES": Value("{name: code} of the edges' kinds", dict, needed=True),
    },
    # Where the curves of `trace` turn back.
    "folds": {
        "find": Function(
            "the Folds of the FollowedCurves", ("solve", "square", "curves"), needed=True
        ),
    },
    # The cells of [refine], decided everywhere in them.
    "cells": {
        "find": Function(
            "the Cells of a rectangle of two Sides; solve(x, y) gives OUTPUTS and their error bounds",
            ("solve", "x", "y", "each", "report"),
            needed=True,
        ),
        "refusal": Function(
            "why there are no cells on maps of the scene about a point {parameter: value}, in words; None if there are",
            ("scene", "point"),
        ),
        "serves": Function("are cells known for the scene? Yes if it is missing", ("scene",)),
        "keywords": Function(
            "further arguments of `find` for this scene, {name: value}", ("scene",)
        ),
        "Side": Value(
            "low, high, depth, log: a side of a rectangle and how often it may be halved",
            type,
            needed=True,
        ),
        "accuracy": Function(
            "the rtol that `find` needs of OUTPUTS where sides are halved `depth` times",
            ("depth",),
            needed=True,
        ),
        "OUTPUTS": Value("the scene's outputs that `find` asks for", tuple, needed=True),
        "VERDICTS": Value(
            "{name: code} of the cells' verdicts, -1 undecided among them", dict, needed=True
        ),
        "POINTS": Value(
            "the points that are solved along each side of a block", object, needed=True
        ),
        "MOST": Value("the largest number of cells", int, needed=True),
        "CELL_SECONDS": Value(
            "seconds of a cell on one thread, measured, for `survey plan`", float
        ),
    },
}


# of scenes that `curves` and `cells` do not serve
QUESTIONS |= {"trace_curves": QUESTIONS["curves"], "trace_cells": QUESTIONS["cells"]}


def method(name):
    """The method `name`. Raises BadInput if there is none, or if it does not keep to its families' tables."""
    module = modules.load(methods, name, "method")
    check(module)
    return module


@cache
def question(family, name):
    """The module that answers the question `name` (of QUESTIONS) for this family; None if it has
    none.

    Raises BadInput if the module does not keep to QUESTIONS.
    """
    folder = _folder(family)
    if folder is None or name not in modules.names(folder):
        return None
    module = modules.load(folder, name, "measure")
    contract.check_offered(module, QUESTIONS[name], "survey/measures/__init__.py")
    return module


def curves(scene):
    """The module that knows the scene's curves; None if there is none."""
    return _serving(scene, "curves")


def cells(scene):
    """The module that knows the scene's cells; None if there is none."""
    return _serving(scene, "cells")


def _serving(scene, name):
    found = (question(scene.FAMILY, name) for name in (name, f"trace_{name}"))
    return next(
        (one for one in found if one and (not hasattr(one, "serves") or one.serves(scene))), None
    )


@cache
def check(module):
    """Raise BadInput if the method does not keep to the tables of the families that it serves."""
    own = "survey/methods/__init__.py"
    table = dict(methods.CONTRACT)
    where = dict.fromkeys(table, own)
    if not hasattr(module, "SERVES"):
        contract.refuse(module, f"SERVES is missing: {table['SERVES'].meaning}", own)
    for family in module.SERVES:
        folder = _folder(family)
        if folder is None:
            contract.refuse(module, f"SERVES names no family {family!r}", own)
        table |= folder.METHODS[family]
        file = f"survey/measures/{folder.__name__.rpartition('.')[2]}/__init__.py"
        where |= dict.fromkeys(folder.METHODS[family], file)
    contract.check(module, table, where, _of_another_family)
    for name in ("COST", "ABOUT"):
        if unknown := [
            family for family in getattr(module, name, ()) if family not in module.SERVES
        ]:
            contract.refuse(module, f"{name} has {unknown[0]!r}, which SERVES does not name", own)


def _of_another_family(name):
    """What to do about a method's public name that a family knows which the method does not serve."""
    families = [
        family for folder in _folders() for family, table in folder.METHODS.items() if name in table
    ]
    words = " or ".join(map(repr, families))
    return f"; it is a name of the family {words}, which SERVES must then name" if families else ""


def is_family(name):
    """Is there a family of this name, which the METHODS of a package here describe?"""
    return _folder(name) is not None


@cache
def _folder(family):
    """The package whose METHODS name this family; None if there is none."""
    return next((folder for folder in _folders() if family in folder.METHODS), None)


def _folders():
    """The packages that have METHODS, loaded one after the other."""
    here = sys.modules[__name__]
    # others import much
    names = (module.name for module in iter_modules(here.__path__) if module.ispkg)
    return (
        folder
        for folder in (modules.load(here, name, "family") for name in names)
        if hasattr(folder, "METHODS")
    )
