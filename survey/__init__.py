"""Parameter surveys of mechanical systems whose stability decides everything.

    import survey
    ds = survey.run("workflows/satellite_prolate.toml")          # a workflow file -> netCDF file and dataset
    ds = survey.evaluate("satellite", k=0.5, rho=1.2)            # some points -> dataset
    survey.evaluate(survey.hill(z, ...), a=1.0)                  # your own Hill equation y'' + z(u, p) y = 0
    survey.scenes()                                              # the scenes and what they answer
    ds = survey.open("results/satellite_prolate.nc")             # open and check a file

Importing this package compiles nothing and loads nothing heavy.
"""

from importlib import import_module
from typing import TYPE_CHECKING

_HOME = {"run": "survey.api", "evaluate": "survey.api", "open": "survey.api", "hill": "survey.own"}
_HOME |= {
    "SurveyError": "survey.errors",
    "BadInput": "survey.errors",
    "Damaged": "survey.errors",
    "Stopped": "survey.errors",
}
__all__ = sorted([*_HOME, "scenes"])

if TYPE_CHECKING:  # what a type checker sees; the same names as in _HOME
    from survey.api import evaluate as evaluate
    from survey.api import open as open
    from survey.api import run as run
    from survey.api import scenes as scenes
    from survey.errors import BadInput as BadInput
    from survey.errors import Damaged as Damaged
    from survey.errors import Stopped as Stopped
    from survey.errors import SurveyError as SurveyError
    from survey.own import hill as hill
else:

    def __getattr__(name):
        if name == "scenes":  # a folder that can be called
            return import_module("survey.scenes")
        if name in _HOME:
            return getattr(import_module(_HOME[name]), name)
        raise AttributeError(f"module 'survey' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOME])
