"""The methods: one integrator or quadrature per file; its docstring names order, domain and source.

A method offers what CONTRACT lists, and for each family in its SERVES what the measures of that
family call. This is listed in METHODS of `survey/measures/FOLDER/__init__.py`: the families "body",
"hill", "cylinder", "nutation" and "floquet" have folders of these names, "abel" is in `cylinder/`,
"orbit" in `floquet/`, "danby" and "normal_form" are in `libration/`. Its functions are kernels (see
`survey.kernels.jit`) that fill arrays which the measure brings. Both tables are checked when the
method is loaded, and any other public name is refused. A new method is done when `tests/methods`,
which finds it by its file, passes.
"""

from survey.contract import Value

CONTRACT = {
    "ORDER": Value("order of convergence; 0: a closed form", int, needed=True),
    "SERVES": Value(
        "names of the families that it serves, such as ('hill', 'cylinder')", tuple, needed=True
    ),
    "COST": Value(
        "{family: how many times the scene's rough cost of a point it takes}; 1 if not given", dict
    ),
    "ABOUT": Value(
        "{family: what it does for that family, in a line}; the docstring's first if not given",
        dict,
    ),
    "WHEN": Value(
        "{option: values} for which it answers, as in a scene's outputs; always if not given", dict
    ),
    "ADAPTIVE": Value("does it choose its own steps, from a tolerance? False if not given", bool),
}


def adaptive(method):
    """Does the method choose its own steps?"""
    return getattr(method, "ADAPTIVE", False)


def fixed(method):
    """Does the method take the steps that it is given?"""
    return not adaptive(method)
