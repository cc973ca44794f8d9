"""What a module of a folder must offer: a table of its public names, checked when the module is
loaded.

A module's public names are those at its top level, imports and names with a leading underscore
apart.
"""

import ast
import inspect
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from pathlib import Path

from survey.errors import BadInput


@dataclass(frozen=True)
class Value:
    """A public constant: its type (or types), what it means, and whether every module must have it,
    or those modules for which `needed(module)` is true; `each` is the type of its elements.
    """

    meaning: str
    kind: type | tuple[type, ...] = object
    needed: bool | Callable = False
    each: type = object


@dataclass(frozen=True)
class Function:
    """A public function: what it does, the names of its first arguments (None: any), and whether
    every module must have it, as in `Value`. Further arguments need defaults.
    """

    meaning: str
    arguments: tuple[str, ...] | None = ()
    needed: bool | Callable = False


def check(module, table, where, elsewhere=lambda name: ""):
    """Raise BadInput, in one line, if the module does not keep to the table.

    `table` is {name: Value | Function}; `where` is the file in which it stands, or {name: file};
    `elsewhere` says of a name where else it has a meaning.
    """
    files = where if isinstance(where, str) else _as_list(list(dict.fromkeys(where.values())))
    for name in public(module.__file__):
        if name not in table:
            near = get_close_matches(name, table, n=1, cutoff=0.6)
            hint = elsewhere(name) or (f"; did you mean {near[0]!r}?" if near else "")
            refuse(
                module,
                f"{name} is not in the table{hint} (a helper's name begins with an underscore)",
                files,
            )
    check_offered(module, table, where)


def check_offered(module, table, where):
    """As `check`, but the module may have other public names besides, which are not nearly those of
    entries that it lacks.
    """
    files = dict.fromkeys(table, where) if isinstance(where, str) else where
    lacking = [name for name in table if not hasattr(module, name)]
    for name in public(module.__file__):
        if name not in table and (near := get_close_matches(name, lacking, n=1, cutoff=0.8)):
            refuse(module, f"{name} is not in the table, but {near[0]!r} is", files[near[0]])
    for name, entry in table.items():
        where = files[name]
        if not hasattr(module, name):
            if entry.needed(module) if callable(entry.needed) else entry.needed:
                refuse(module, f"{name} is missing: {entry.meaning}", where)
        elif isinstance(entry, Function):
            _check_function(module, name, getattr(module, name), entry, where)
        elif not isinstance(getattr(module, name), entry.kind):
            refuse(
                module,
                f"{name} = {getattr(module, name)!r:.60} must be of type {_named(entry.kind)}",
                where,
            )
        elif entry.each is not object:
            for one in getattr(module, name):
                if not isinstance(one, entry.each):
                    words = f"{name} has {one!r:.60}, which must be of type {entry.each.__name__}"
                    refuse(module, words, where)


@lru_cache(maxsize=256)
def public(path):
    """The public names of the module in the file `path`, in their order."""
    names = []
    nodes = ast.parse(Path(path).read_text(encoding="utf-8")).body
    while nodes:
        node, *nodes = nodes
        if isinstance(node, (ast.If, ast.Try, ast.With)):
            blocks = ("body", "handlers", "orelse", "finalbody")
            nodes = [inner for block in blocks for inner in getattr(node, block, [])] + nodes
        elif isinstance(node, ast.ExceptHandler):
            nodes = node.body + nodes
        elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            names.append(node.name)
        elif isinstance(node, (ast.Assign, ast.AnnAssign)):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names += [
                name.id
                for target in targets
                for name in ast.walk(target)
                if isinstance(name, ast.Name)
            ]
    return tuple(dict.fromkeys(name for name in names if not name.startswith("_")))


def _check_function(module, name, function, entry, where):
    function = getattr(function, "py_func", function)  # what numba has compiled
    if not callable(function):
        refuse(module, f"{name} must be a function", where)
    parameters = inspect.signature(function).parameters.values()
    given = tuple(p.name for p in parameters)
    # callers give none
    more = [p for p in list(parameters)[len(entry.arguments or ()) :] if p.default is p.empty]
    if entry.arguments is not None and (given[: len(entry.arguments)] != entry.arguments or more):
        words = f"{name}({', '.join(given)}) must be {name}({', '.join(entry.arguments)})"
        refuse(module, words, where)


def _as_list(files):
    """`a`, `a and b`, `a, b and c`."""
    return " and ".join(part for part in (", ".join(files[:-1]), files[-1]) if part)


def _named(kind):
    return " or ".join(one.__name__ for one in (kind if isinstance(kind, tuple) else (kind,)))


def refuse(module, words, where):
    """Raise BadInput: the module does not keep to the table in `where`."""
    verb = "tables are" if " and " in where else "table is"
    raise BadInput(f"{module.__file__}: {words}; the {verb} in {where}")
