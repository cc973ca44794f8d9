"""Stability maps of mechanical systems: every point with an error bar, and a verdict that respects
it.

    import survey
    ds = survey.run("workflows/satellite_prolate.toml")          # a workflow file -> netCDF file and dataset
    ds = survey.evaluate("satellite", k=0.5, rho=1.2)            # some points -> dataset
    survey.evaluate(survey.hill(z, ...), a=1.0)                  # your own Hill equation y'' + z(u, p) y = 0
    survey.evaluate(survey.abel(f, g, ...), t=1.0)               # your own Abel equation w w' = f(phi, p) w + g(phi, p)
    survey.evaluate(survey.floquet(A, ...), p=1.0)               # your own linear periodic system x' = A(t, p) x
    survey.evaluate(survey.orbit(f, ...), p=1.0)                 # periodic orbits of your own system x' = f(t, x, p)
    survey.edge("satellite", along="rho", near=1.2, k=0.5)       # the boundaries of stability along a parameter
    survey.Model("map.model")(k=0.5, rho=1.2)                    # a map's series, which answer anywhere: numpy alone
    survey.describe("satellite")                                 # its parameters, outputs and methods, as a table
    survey.scenes()                                              # the scenes and what they answer
    ds = survey.open("results/satellite_prolate.nc")             # open and check a file

    ds.survey.map()                                              # xarray datasets get an accessor: survey/accessor.py

Importing this package compiles nothing and imports nothing heavy.
"""

import sys
from importlib import import_module

__version__ = "0.1.0"

_HOME = {name: "survey.api" for name in ("run", "evaluate", "open", "describe")}
_HOME |= {name: "survey.request.user_scene" for name in ("hill", "abel", "floquet", "orbit")}
_HOME |= {
    "concat": "survey.analysis.join",
    "edge": "survey.analysis.edge",
    "Model": "survey.model.reader",
}
_HOME |= {
    "SurveyError": "survey.errors",
    "BadInput": "survey.errors",
    "Damaged": "survey.errors",
    "Stopped": "survey.errors",
}
__all__ = sorted([*_HOME, "scenes"])


class _AfterXarray:
    """Registers `ds.survey` as soon as anyone imports xarray: importing it here would take half a second."""

    def find_spec(self, name, path=None, target=None):
        if name != "xarray":
            return None
        specs = (
            finder.find_spec(name, path, target) for finder in sys.meta_path if finder is not self
        )
        spec = next(filter(None, specs), None)
        if spec is not None:
            spec.loader.exec_module = self._registering(spec.loader.exec_module)
        return spec

    def _registering(self, execute):
        def execute_and_register(module):
            execute(module)
            if self in sys.meta_path:
                sys.meta_path.remove(self)
                import_module("survey.accessor")

        return execute_and_register


if "xarray" in sys.modules:
    import_module("survey.accessor")
else:
    sys.meta_path.insert(0, _AfterXarray())


def __getattr__(name):
    if name == "scenes":  # a callable package
        return import_module("survey.scenes")
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'survey' has no attribute {name!r}")


def __dir__():
    return [*__all__, "__version__"]
