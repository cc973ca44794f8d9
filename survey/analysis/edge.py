"""Boundaries without a file: along one parameter, and the nearest one to a point in each of its
parameters.
"""

import os
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from survey import api, measures, modules, status
from survey.analysis.given import check_names, options_at, parameters
from survey.errors import BadInput
from survey.file.labels import flag_attributes, variable
from survey.request import physical, user_scene
from survey.request.arrays import (
    as_data_array,
    as_labelled,
    check_dimensions,
    grid_of,
    own_coordinates,
)
from survey.request.checks import check_options, check_parameters, is_number
from survey.request.function_scene import FunctionScene
from survey.scene import plus_minus
from survey.sweep import boundaries
from survey.sweep.edges_and_cells import on_threads
from survey.sweep.line import second_axis, together
from survey.sweep.progress import watched
from survey.wording import shown

# half the first range around a value, relative to 1 + |value|; how it is widened
FIRST, WIDER, MOST = 0.05, 8.0, 5
INSIDE = 1e-3  # of a range: how far from an end that does not belong to the domain
WIDEST = 1e4  # of a domain that is searched as a whole
_UNKNOWN = "no boundaries are known for the scene"
_ONE_VALUE = "it must be one value of {0}; give a range as {0}=(low, high)"
_INSTEAD = "run a line of points and see where the verdict changes: ds.survey.boundary()"


def edge(
    scene: str | os.PathLike[str] | FunctionScene,
    *,
    along: str,
    near: float | None = None,
    **parameters: Any,
) -> xr.Dataset:
    """The boundaries of stability along one parameter, exact as [boundaries] in a workflow are,
    without a file.

    Parameters
    ----------
    scene : as in `survey.evaluate`.
    along : the name of the parameter along which boundaries are searched for.
    near : a value of it: only the nearest boundary on each side of it is returned, at most two.
    **parameters : the scene's other parameters, and options. Parameters are numbers, or arrays as in `evaluate`, which
        give rows: their boundaries are found together. `along=(low, high)`, under that parameter's name, is the range
        that is searched; by default its whole domain, if that is bounded, less a thousandth at an end that does not
        belong to it, or what is `near`. Physical input, such as moments of inertia, as in `evaluate`.

    Returns
    -------
    xarray.Dataset along the dimension `place`, ascending: `edge` (in the unit of the parameter), `edge_error`, a bound,
    `edge_class`, and `edge_index` where boundaries have numbers (of tongues; the Maslov index above an edge of a
    symplectic system, masked where another is too near). The attribute `searched` is the range (low, high) that was
    searched, parts included where parameters are invalid; `complete` is 1 where it is shown that there are no others in
    it, 0 where not, and absent where this is not known. A closed gap is two boundaries at one place; where a motion
    is marginal at a single value between two sides of the same verdict, such as `rho` = 0 of an oblate satellite's
    librations, there is none.

    With arrays one row follows the other along `place`, where coordinates give the parameters of each boundary. The
    attribute `rows` is the number of rows, those without a boundary included; `complete` is 1 where it is for every
    row, and `incomplete_rows` counts those for which it is not.

    Raises
    ------
    survey.BadInput where the scene has no boundaries along the parameter, or it has no bounded range.

    Examples
    --------
    >>> import survey
    >>> survey.edge("satellite", along="rho", near=1.2, k=0.5).edge.values.round(6)
    array([1.026056, 1.604051])
    >>> tongues = survey.edge("satellite", along="rho", k=[0.4, 0.5], rho=(1, 2))
    >>> tongues.to_dataframe()[["k", "edge"]].round(4).values.tolist()
    [[0.4, 1.0151], [0.4, 1.4131], [0.5, 1.0261], [0.5, 1.6041]]
    """
    return _edge(scene, along, near, parameters)


def _edge(scene, along, near, parameters, alone=False):
    """As `edge`; with `alone`, it is searched until the nearest boundary on either side is found."""
    name, module = user_scene.find(scene)
    measure = measures.curves(module)
    if measure is None:
        raise BadInput(f"edge: {_UNKNOWN} {name}; {_INSTEAD}")
    if not isinstance(along, str):
        raise BadInput(f"along = {shown(along)}: give the name of one parameter")
    for key in parameters.keys() & {"rtol", "method", "variables"}:
        raise BadInput(
            f"{key} does not apply here: edges are as exact as their error bounds say; leave it out"
        )
    names = {option.name for option in module.OPTIONS}
    given = {key: value for key, value in parameters.items() if key not in names}
    ends = given.pop(along, None)
    known = [p.name for p in module.PARAMETERS]
    if along not in known:
        raise BadInput(f"along: {_not_searched(module, measure, along, known)}")
    # named bodies then give what is left
    named = physical.resolved(module, given | {along: np.nan})
    given = {key: _plain(value) for key, value in named.items() if key != along}
    chosen = {key: value for key, value in parameters.items() if key in names}
    options = check_options(module, chosen, [*given, along])
    used = check_parameters(module, name, options, dict.fromkeys([along, *given]))
    if any(np.ndim(value) for value in given.values()):
        return _of_rows(name, module, measure, options, used, along, ends, near, given)
    fixed = {
        key: _number(key, given.get(key, p.default), p, " or an array of them")
        for key, p in used.items()
        if key != along
    }
    if near is not None:
        if np.ndim(near):
            raise BadInput(f"near = {shown(near)}: {_ONE_VALUE.format(along)}")
        near = _number("near", near, used[along])
    ends = _range(used[along], ends, near)
    user_scene.check(module)
    found, searched = _find(module, options, used[along], ends, near, fixed, alone)
    if not (found.position.size or alone):
        _check_inside(
            scene, module, {along: near if ends is None else sum(ends) / 2} | fixed, options
        )
    return _described(module, measure, used, along, fixed, found, searched)


def _of_rows(name, module, measure, options, used, along, ends, near, given):
    """As `edge`, where some of the other parameters, `given`, are arrays."""
    if near is not None:
        raise BadInput(
            f"near = {shown(near)}: it applies to a single row; leave it out, or give numbers instead of arrays"
        )
    ends = _range(used[along], ends, None, rows=True)
    others = {key: p for key, p in used.items() if key != along}
    arrays = {key: as_labelled(key, given.get(key, p.default)) for key, p in others.items()}
    for key, array in arrays.items():
        outside = ~others[key].holds(array.values)
        if along in array.dims:
            raise BadInput(
                f"{key}: its dimension {along!r} is the parameter along which is searched; rename it"
            )
        if outside.any():
            value = float(array.values[outside].flat[0])
            raise BadInput(
                f"{key} = {value:g} is outside its domain; allowed: {_domain(others[key])}"
            )
    check_dimensions(module, arrays)
    grid = grid_of(others, arrays)
    user_scene.check(module)
    with watched(name, module, grid.points, lambda: np.inf, "rows") as progress:
        report = progress and (lambda done, total, *_: progress(done, total))
        row, found = boundaries.on_rows(module, options, along, ends, grid, on_threads(report))
    fixed = {key: float(array) for key, array in arrays.items() if not array.ndim}
    ds = _described(module, measure, used, along, fixed, replace(found, complete=None), ends)
    about = {key: {"long_name": p.long_name, "units": p.units} for key, p in others.items()}
    named = {key: as_data_array(array).variable for key, array in arrays.items() if array.ndim}
    for key, values in (named | own_coordinates(arrays)).items():
        every = values.set_dims(dict(grid.sizes)).values.ravel()
        ds.coords[key] = "place", every[row], about.get(key, values.attrs)
    ds.attrs["rows"] = grid.points
    if found.complete is not None:
        lost = int((~found.complete).sum())
        ds.attrs |= {"complete": int(not lost), "incomplete_rows": lost}
    return ds


def _not_searched(module, measure, along, known):
    """One line for a name that is no parameter: physical input, or unknown."""
    if physical.meant(module, along):
        names = " or ".join(
            f"{p.name} ({'no unit' if p.units == '1' else p.units})"
            for p in physical.meant(module, along)
        )
        return f"{along} is physical input, along which nothing is searched; search along {names}"

    def are_known(name):
        pairs = ([name, other] for other in known if other != name)
        return any(measure.refusal(axes, module) is None for axes in ([name], *pairs))

    searched = [name for name in known if not hasattr(measure, "refusal") or are_known(name)]
    return modules.unknown("parameter", along, searched or known)


def _plain(value):
    """The number in a DataArray without dimensions; other values as they are."""
    return value.item() if isinstance(value, xr.DataArray) and not value.ndim else value


def _check_inside(scene, module, point, options):
    """Raise BadInput where nothing was found since the parameters contradict each other."""
    point = {key: value for key, value in point.items() if np.isfinite(value)}
    try:
        invalid = api.evaluate(scene, **point, **options).status == status.INVALID_PARAMETERS
    except BadInput:  # the middle of a range may be excluded from the domain
        return
    if invalid:
        where = ", ".join(f"{key} = {value:g}" for key, value in point.items())
        raise BadInput(
            f"edge: there is none at {where}: {status.table(module)['invalid_parameters'][1]}"
        )


def _number(key, value, parameter, or_else=""):
    if not is_number(value) or not parameter.holds([value]).all():
        raise BadInput(
            f"{key} = {shown(value)}: it must be one number in its domain{or_else}; allowed: {_domain(parameter)}"
        )
    return float(value)


def _domain(parameter):
    return parameter.domain + ("" if parameter.units == "1" else f" ({parameter.units})")


def _range(parameter, ends, near, rows=False):
    """(low, high) of the part of the domain that is searched; None for a range around `near`."""
    name = parameter.name
    if ends is None and near is not None:
        return None
    low, high = parameter.minimum, parameter.maximum
    if ends is None:
        if high - low > WIDEST:
            near = "" if rows else f"near= a value of {name}, or "
            raise BadInput(f"edge: give {near}a range as {name}=(low, high)")
        return low + INSIDE * (high - low) * parameter.open_minimum, high - INSIDE * (
            high - low
        ) * parameter.open_maximum
    try:
        first, last = map(float, ends)
    except (TypeError, ValueError):
        first = last = np.nan
    if not (low <= first < last <= high and np.isfinite([first, last]).all()):
        raise BadInput(
            f"{name} = {shown(ends)}: boundaries are searched for along it, so give a range "
            f"(low, high) in its domain; allowed: {_domain(parameter)}"
        )
    return first, last


def _find(scene, options, parameter, ends, near, fixed, alone):
    """(OnLine, (low, high) that was searched) between `ends`, or the nearest on each side of `near`."""
    if ends is not None:
        found = boundaries.along(scene, options, parameter.name, ends, fixed)
        return (found if near is None else _nearest(found, near)), ends

    def between(first, last):
        return boundaries.along(scene, options, parameter.name, (first, last), fixed)

    low, high = _piece(parameter, near)
    width = FIRST * (1.0 + abs(near))
    first, last = max(low, near - width), min(high, near + width)
    parts = [between(first, last)]
    ends = {-1.0: (first, low), 1.0: (last, high)}
    for _ in range(MOST - 1):
        width *= WIDER
        position = np.concatenate([part.position for part in parts])
        for side, (end, furthest) in ends.items():
            if end != furthest and not (
                position.size if alone else (side * (position - near) >= 0.0).any()
            ):
                further = side * min(side * furthest, side * near + width)
                parts.append(between(min(end, further), max(end, further)))
                ends[side] = further, furthest
    return _nearest(_together(parts), near), (ends[-1.0][0], ends[1.0][0])


def _together(parts):
    """The OnLine of pieces of a line."""
    complete = [one.complete for one in parts]
    found = together(parts, None if None in complete else all(complete))
    return found[np.argsort(found.position, kind="stable")]


def _piece(parameter, near):
    """The part of the domain around `near` that does not contain an excluded value."""
    low, high = parameter.minimum, parameter.maximum
    below = [x for x in parameter.excluded if x < near]
    above = [x for x in parameter.excluded if x > near]
    if below or parameter.open_minimum:
        low = max([low, *below])
        low += INSIDE * (near - low)
    if above or parameter.open_maximum:
        high = min([high, *above])
        high -= INSIDE * (high - near)
    return low, high


def _nearest(found, near):
    """Only the last boundary below `near`, and the first above."""
    below = np.flatnonzero(found.position <= near)[-1:]
    above = np.flatnonzero(found.position > near)[:1]
    return found[np.concatenate([below, above])]


def _described(module, measure, used, along, fixed, found, searched):
    parameter = used[along]
    about = {"units": parameter.units, "symbol": parameter.symbol}
    hill = hasattr(measure, "trace")
    classes = measures.question(module.FAMILY, "edges").CLASSES if hill else measure.CLASSES
    title = "kind of the periodic solution on the boundary" if hill else measure.TITLE
    data = {
        "edge": ("place", found.position, about | {
            "long_name": f"{parameter.long_name} at the boundary", "ancillary_variables": "edge_error"}),
        "edge_error": ("place", found.error, about | {"long_name": "error bound of edge"}),
        "edge_class": ("place", found.kind.astype(np.int8), flag_attributes(classes) | {"long_name": title}),
    }  # fmt: skip
    if found.index is not None:
        title = None if hill else measure.NUMBER
        data["edge_index"] = variable(("place",), *boundaries.numbered(found.index, title))
    coordinates = {key: ((), value, {"long_name": used[key].long_name, "units": used[key].units})
                   for key, value in fixed.items() if np.isfinite(value)}  # fmt: skip
    attributes = {
        "title": f"{module.TITLE}: boundaries along {along}",
        "along": along,
        "searched": searched,
    }
    complete = {} if found.complete is None else {"complete": int(found.complete)}
    return xr.Dataset(data, coordinates, attributes | complete)


def margin(ds):
    """The Dataset that `ds.survey.margin` describes, of one point (a dataset without axes)."""
    scene = user_scene.of_dataset(ds)
    module = user_scene.find(scene)[1]
    measure = measures.curves(module)
    if measure is None:
        raise BadInput(f"margin: {_UNKNOWN} {ds.attrs['scene']}; {_INSTEAD}")
    if "status" in ds and int(ds.status) == status.INVALID_PARAMETERS:
        raise BadInput(
            f"margin: there is none at this point: {status.table(module)['invalid_parameters'][1]}"
        )
    check_names(ds, module)
    here, options = parameters(ds), options_at(ds, module)
    rows, reasons = [], []
    with watched(
        ds.attrs["scene"], module, 1, lambda: _seconds(measure, here), "parameters"
    ) as progress:
        for done, name in enumerate(here):
            if progress:
                progress(done, len(here))
            try:
                rows.append((name, *_margin(scene, options, name, here)))
            # no boundaries are known along this parameter, or it cannot vary
            except BadInput as refused:
                reasons.append(str(refused))
        if progress:
            progress(len(here), len(here))
    if not rows:
        raise BadInput(
            f"margin: {ds.attrs['scene']}: {reasons[0].removeprefix('boundaries: ')}"
            if reasons
            else f"margin: {_UNKNOWN} {ds.attrs['scene']}"
        )
    names, values, edges, errors, words = map(np.array, zip(*rows, strict=True))
    about = {"long_name": "of the parameter, in its unit"}
    return xr.Dataset(
        {
            "value": ("parameter", values, about),
            "edge": (
                "parameter",
                edges,
                {"long_name": "the nearest boundary; NaN: none was found"},
            ),
            "edge_error": (
                "parameter",
                errors,
                {"long_name": "error bound of edge, and of distance"},
            ),
            "distance": ("parameter", edges - values, {"long_name": "edge less value"}),
            "edge_class": ("parameter", words, {"long_name": "what the boundary is"}),
        },
        {"parameter": names},
        {"title": f"{ds.attrs.get('title', '')}: margins of a point", "scene": ds.attrs["scene"]},
    )


def _margin(scene, options, name, here):
    """(value, nearest boundary, its error bound, its class) along one parameter of a point."""
    value = here[name]
    others = {key: other for key, other in here.items() if key != name}
    found = _edge(scene, name, value, others | options, alone=True)
    if not found.edge.size:
        return value, np.nan, np.nan, ""
    nearest = int(abs(found.edge.values - value).argmin())
    names = dict(
        zip(
            found.edge_class.attrs["flag_values"],
            found.edge_class.attrs["flag_meanings"].split(),
            strict=True,
        )
    )
    return (
        value,
        float(found.edge[nearest]),
        float(found.edge_error[nearest]),
        names[int(found.edge_class[nearest])],
    )


def is_quick(ds):
    """Are the margins of a point found within about a second?"""
    module = user_scene.find(user_scene.of_dataset(ds))[1]
    measure = measures.curves(module)
    return measure is not None and _seconds(measure, parameters(ds)) < 1.0


def is_slow(ds):
    """Are there margins of a point that take more than about a second? Not where its scene may not
    run.
    """
    try:
        module = user_scene.find(user_scene.of_dataset(ds))[1]
        if (measure := measures.curves(module)) is None or is_quick(ds):
            return False
        return any(_is_searched(measure, module, ds, name) for name in parameters(ds))
    except BadInput:
        return False


def _is_searched(measure, module, ds, name):
    """Are boundaries known along this parameter of a point?"""
    if not hasattr(measure, "closed"):
        return True
    fixed = {key: value for key, value in parameters(ds).items() if np.isfinite(value)}
    try:
        second_axis(measure, module, name, fixed, options_at(ds, module))
    except BadInput:
        return False
    return name in fixed


def _seconds(measure, names):
    """An estimate of how long boundaries along each of these parameters take; infinite where they
    are searched for.
    """
    if hasattr(measure, "searched"):
        return np.inf
    return sum(measure.seconds([name]) for name in names) if hasattr(measure, "seconds") else 0.0


def in_words(found):
    """`k = 0.861772 +- 8e-15 (even_periodic), ...` of what `margin` has found; "" if that is nothing."""
    rows = zip(
        *(found[name].values for name in ("parameter", "edge", "edge_error", "edge_class")),
        strict=True,
    )
    return ", ".join(
        f"{name} = {plus_minus(at, bar)} ({kind})"
        for name, at, bar, kind in rows
        if np.isfinite(at)
    )
