"""The methods: one integrator or quadrature per file; its docstring names order, domain and source.

A method offers what CONTRACT lists, and for each family in its SERVES what that family's measure calls, which is
listed in METHODS of `survey/measures/FAMILY/__init__.py`. Both tables are checked when the method is loaded.
"""

from survey.contract import Value

CONTRACT = {
    "ORDER": Value("order of convergence; 0: a closed form", int, needed=True),
    "SERVES": Value("names of the families that it serves, such as ('hill', 'cylinder')", tuple, needed=True),
    "COST": Value("{family: how many times the scene's rough cost of a point it takes}; 1 if not given", dict),
    "WHEN": Value("{option: values} for which it answers, as in a scene's outputs; always if not given", dict),
    "ADAPTIVE": Value("does it choose its own steps, from a tolerance? False if not given", bool),
}
