"""The measures: one family a folder, one question a file, shared by the scenes that ask it.

The same question has the same name in every family: `curves` (what [boundaries] draws), `edges`, `cells` ([refine]).
METHODS in a folder's `__init__` says what methods offer its families, and is checked when a method is loaded.
"""

import sys
from functools import cache

from survey import contract, methods, modules


def method(name):
    """The method `name`. Raises BadInput if there is none, or if it does not keep to its families' tables."""
    module = modules.load(methods, name, "method")
    check(module)
    return module


def curves_of(family):
    """The module `curves` of this family; None where no boundary curves are known."""
    folder = _folder(family)
    return modules.load(folder, "curves", "measure") if folder and "curves" in modules.names(folder) else None


@cache
def check(module):
    """Raise BadInput if the method does not keep to the tables of the families that it serves."""
    where, table = ["survey/methods/__init__.py"], dict(methods.CONTRACT)
    if not hasattr(module, "SERVES"):
        contract.refuse(module, f"SERVES is missing: {table['SERVES'].meaning}", where[0])
    for family in module.SERVES:
        folder = _folder(family)
        if folder is None:
            contract.refuse(module, f"SERVES names no family {family!r}", where[0])
        table |= folder.METHODS[family]
        where.append(f"survey/measures/{folder.__name__.rpartition('.')[2]}/__init__.py")
    contract.check(module, table, " and ".join(where))


@cache
def _folder(family):
    """The package whose METHODS name this family; None if there is none."""
    here = sys.modules[__name__]
    folders = (modules.load(here, name, "family") for name in modules.names(here))
    return next((folder for folder in folders if family in getattr(folder, "METHODS", ())), None)
