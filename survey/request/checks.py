"""What is asked, checked against the scene: options, parameters, method, accuracy, outputs.

`table` is what stands before a key in a message, such as "options."; it is empty where Python asks.
"""

from numbers import Real

import numpy as np

import survey.methods
from survey import measures, modules
from survey.errors import BadInput
from survey.scene import Request, condition, existing_outputs, exists
from survey.wording import short, shown


def check_options(scene, given, parameters=(), table=""):
    """Every option that exists beside the given `parameters`, with its value; raises BadInput for
    an unknown one.
    """
    known = {option.name: option for option in scene.OPTIONS}
    for key, value in given.items():
        if key not in known:
            if key in {p.name for p in scene.PARAMETERS}:
                raise BadInput(f"{table}{key} is a parameter, not an option; put it under [axes]")
            raise BadInput(
                f"{table}{short(key, 40)}: {modules.unknown('option', key, sorted(known))}"
            )
        option, text = known[key], value if isinstance(value, str) else shown(value)
        if text not in option.choices:
            raise BadInput(f"{table}{key}: {modules.unknown('value', text, list(option.choices))}")
        if option.replaced_by in parameters:
            raise BadInput(
                f"{table}{key} and {option.replaced_by} specify the same thing; give only one of them"
            )
        if option.only_with and option.only_with not in parameters:
            raise BadInput(
                f"{table}{key} requires the parameter {option.only_with}; give that too, or leave this out"
            )
    exist = [
        o
        for o in known.values()
        if o.replaced_by not in parameters and o.only_with in ("", *parameters)
    ]
    values = {option.name: str(given.get(option.name, option.default)) for option in exist}
    for option in exist:
        if not exists(option, values):
            if option.name in given:
                allowed = ", ".join(
                    f"{key} = {' | '.join(them)}" for key, them in option.when.items()
                )
                raise BadInput(
                    f"{table}{option.name} exists only with {allowed}; change that, or leave this out"
                )
            del values[option.name]
    return values


def check_parameters(scene, name, options, given, table=""):
    """{name: Parameter} in use, given ones first; raises BadInput for an unknown, missing or repeated one."""
    all_of = {p.name: p for p in scene.PARAMETERS}
    known = {key: p for key, p in all_of.items() if exists(p, options)}
    replaced = {}
    for key in given:
        if key not in known:
            if key in {option.name for option in scene.OPTIONS}:
                raise BadInput(
                    f"{table}{key} is an option of {name}, not a parameter; put it under [options]"
                )
            if key in all_of:
                raise BadInput(
                    f"{table}{key} {_why_excluded(scene, all_of[key].when, key, given, table)}"
                )
            damped = "; survey.hill(damping=...) solves damped equations"
            hint = damped if key == "damping" and scene.FAMILY == "hill" else ""
            unknown = unknown_parameter(name, key, list(known))
            raise BadInput(f"{table}{short(key, 40)}: {unknown}{hint}")
        original = known[key].instead_of or key
        if original in replaced:
            raise BadInput(
                f"{table}{replaced[original]} and {table}{key} specify the same thing; give only one of them"
            )
        replaced[original] = key
    used = {key: known[key] for key in given}
    for key, parameter in known.items():
        if key in replaced or parameter.instead_of:
            continue
        if parameter.default is None:
            others = [p.name for p in known.values() if p.instead_of == key]
            instead = f" (or {', '.join(others)} instead)" if others else ""
            raise BadInput(
                f"{table}{key} is missing: {name} needs {parameter.long_name}{instead}; add an axis or a number"
            )
        used[key] = parameter
    return used


def _why_excluded(scene, when, key, given, table):
    """Why a parameter that exists `when` cannot be combined with the `given` ones, naming the one
    in its way.
    """
    options = {option.name: option.only_with for option in scene.OPTIONS}
    for name, allowed in when.items():
        if not any(allowed) and options[name] in given:
            return f"cannot be combined with {table}{options[name]}, which is also given; leave out one of them"
    return f"does not apply here{condition(scene, when, key)}"


def unknown_parameter(scene, key, known):
    """One line for a parameter that the scene of this name does not have."""
    return modules.unknown(
        f"parameter of scene {scene}", key, known, more=("rtol", "method", "variables")
    )


def check_request(scene, options, method, rtol, variables, tables=("", "")):
    """The Request; raises BadInput for an unknown method or variable, or an rtol outside (0, 1)."""
    _check_method(scene, options, method, tables[0])
    if isinstance(rtol, bool) or not isinstance(rtol, Real) or not 0 < rtol < 1:
        raise BadInput(
            f"{tables[0]}rtol = {shown(rtol)}: it must lie between 0 and 1, such as 1e-10"
        )
    existing = existing_outputs(scene, options)
    outputs = [output.name for output in existing]
    for variable in variables or ():
        if not isinstance(variable, str) or variable not in outputs:
            raise BadInput(
                f"{tables[1]}variables: {modules.unknown('variable', variable, outputs)}"
            )
    wanted = (
        [output.name for output in existing if not output.on_request]
        if variables is None
        else variables
    )
    return Request(options, method, float(rtol), frozenset(wanted))


def _check_method(scene, options, method, table):
    """Raise BadInput for a method that is unknown or does not support these options."""
    if not isinstance(method, str):
        raise BadInput(
            f"{table}method: {modules.unknown('method', method, ['auto', *methods_of(scene, options)])}"
        )
    if method == "auto":
        return  # the methods' modules need not be imported
    applicable = methods_of(scene, options)
    if method in applicable:
        return
    if method not in methods_of(scene):
        raise BadInput(f"{table}method: {modules.unknown('method', method, ['auto', *applicable])}")
    given = ", ".join(f"{name} = {value}" for name, value in options.items())
    raise BadInput(
        f"{table}method: {method!r} does not support {given} (allowed: {', '.join(['auto', *applicable])})"
    )


def methods_of(scene, options=None):
    """Names of the methods that serve the scene's family (and these option values), found by
    walking their folder.
    """
    found = {name: measures.method(name) for name in modules.names(survey.methods)}
    return [
        name for name, m in found.items() if scene.FAMILY in m.SERVES and _fits(scene, m, options)
    ]


def _fits(scene, method, options):
    when = getattr(method, "WHEN", {})
    own = {option.name for option in scene.OPTIONS}
    if options is None:
        return all(name in own or "" in allowed for name, allowed in when.items())
    return all(options.get(name, "") in allowed for name, allowed in when.items())


def is_number(value):
    """Is it a real number, and not a truth value?"""
    return isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
