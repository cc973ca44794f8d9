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

_HOME = {"run": "survey.api", "evaluate": "survey.api", "open": "survey.api", "hill": "survey.own"}
_HOME |= {
    "SurveyError": "survey.errors",
    "BadInput": "survey.errors",
    "Damaged": "survey.errors",
    "Stopped": "survey.errors",
}
__all__ = sorted([*_HOME, "scenes"])


def __getattr__(name):
    if name == "scenes":  # a folder that can be called
        return import_module("survey.scenes")
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'survey' has no attribute {name!r}")


def __dir__():
    return sorted([*globals(), *_HOME])
