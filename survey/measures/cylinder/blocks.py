"""Blocks as rows for the measures of this folder, and their results as outputs of a scene in the
block's shape.
"""

from math import prod

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.steps import TURNING, UNDETERMINED
from survey.measures.cylinder import basins, fate, portrait
from survey.measures.cylinder.solution import distinct
from survey.status import INVALID_PARAMETERS, OK

MOST_TURNINGS = 2**31 - 1  # are kept as int32
TIMES = {"t", "t_turning"}
# how far beside parameters others are tried: a number that vanishes there too is taken for 0 throughout
BESIDE = 1e-3


def dense(point, names, name):
    """(rows of the numbers `names`, values of `name`, function that brings results back into the
    block's shape).

    The dimensions along which only `name` varies become columns: one solution serves them all.
    """
    arrays = [np.asarray(point[key], dtype=float) for key in (*names, name)]
    own = list(zip(*(array.shape for array in arrays[:-1]), strict=True))  # by dimension
    shape = np.broadcast_shapes(*(array.shape for array in arrays))
    dense = [i for i in range(len(shape)) if set(own[i]) == {1}]
    points = [i for i in range(len(shape)) if i not in dense]
    order = points + dense
    columns = prod(shape[i] for i in dense)
    last = np.broadcast_to(arrays[-1], shape).transpose(order)
    if not any(last.strides[: len(points)]):  # the same for all rows: not copied
        number = prod(shape[i] for i in points)
        first = last[(slice(1),) * len(points)].reshape(-1, columns)
        last = np.broadcast_to(first, (number, columns))
    else:
        last = last.reshape(-1, columns)
    small = [shape[i] if i in points else 1 for i in range(len(shape))]
    rows = np.empty((*small, len(names)))
    for i, array in enumerate(arrays[:-1]):
        rows[..., i] = array
    rows = rows.reshape(-1, len(names))

    whole, axes = [shape[i] for i in order], np.argsort(order)

    def back(values):
        return values.reshape(whole).transpose(axes)

    return rows, last, back


def valid(rows, columns):
    """Rows and columns with NaN replaced by numbers, and where none was replaced."""
    numbers, fine = np.isfinite(rows), np.isfinite(distinct(columns))
    if numbers.all() and fine.all():
        return rows, columns, fine
    numbers = numbers.all(axis=1)[:, None]
    good = numbers & fine
    return np.where(numbers, rows, 0.0), np.where(good, columns, 0.0), good


def trajectories(rows, times, back, measure, method, request):
    """phi, w, turnings and status at the times; `measure` is `solution` or `auto`."""
    rows, times, good = valid(rows, times)
    counted = not request.variables or "turnings" in request.variables
    results = measure.trajectories(method, rows, times, request.rtol, counted)
    return at_times(results, good, back, counted)


def at_times(results, good, back, counted=True):
    """The outputs of the question `trajectory`, turnings among them if they are `counted`, from floats,
    turnings and status where the input is `good`.
    """
    floats, turnings, status = results
    if not good.all():
        status = np.where(good, status, INVALID_PARAMETERS)
    lost = None
    if status.any():
        lost = status != OK
        floats[lost] = np.nan
    columns = {"phi": rc.PHI, "w": rc.W, "phi_error": rc.PHI_BAR, "w_error": rc.W_BAR}
    results = {name: back(floats[..., at]) for name, at in columns.items()}
    if counted:
        turnings[turnings > MOST_TURNINGS] = UNDETERMINED
        if lost is not None:
            turnings[lost] = UNDETERMINED
        results["turnings"] = back(turnings)
    return results | {"status": back(status)}


def abel(rows, targets, back, measure, method, request):
    """w, t if it is wanted, the turning point and status at the angles; `measure` is `solution` or
    `auto`.
    """
    before = request.options.get("branch") == "before"
    timed = not request.variables or not TIMES.isdisjoint(request.variables)
    rows, targets, good = valid(rows, targets)
    results = measure.abel(method, rows, targets, request.rtol, before, timed=timed)
    return at_angles(results, good, back, timed)


def at_angles(results, good, back, timed=True):
    """The outputs of the question `abel`, from floats and status where the input is `good`."""
    floats, status = results
    if not good.all():
        status = np.where(good, status, INVALID_PARAMETERS)
    results = {"status": back(status)}
    nothing = np.broadcast_to(np.nan, results["status"].shape)
    all_reached = not status.any()  # as a rule
    for names, code in ((("w", "t"), OK), (("phi_turning", "t_turning"), TURNING)):
        here = None if all_reached else status == code
        some = code == OK if all_reached else here.any()
        every = some and (all_reached or here.all())
        for name, value, bar in zip(
            names[: 1 + timed], (rc.VALUE, rc.TIME), (rc.VALUE_BAR, rc.TIME_BAR), strict=False
        ):
            for key, at in ((name, value), (f"{name}_error", bar)):
                values = floats[..., at]
                if some and not every:
                    values = np.where(here, values, np.nan)
                results[key] = back(values) if some else nothing
    return results


def _systems(point, names):
    """The parameters `names` as rows, and their shape in the block."""
    given = np.stack(
        np.broadcast_arrays(*(np.asarray(point[key], dtype=float) for key in names)), axis=-1
    )
    return given.reshape(-1, len(names)), given.shape[:-1]


def fates(point, names, flows, method, request):
    """The fates of phi0, w0: one skeleton for each set of the parameters `names`, then its initial states."""
    map_asked = basins.asked(request, names)
    starts = [np.asarray(point[key], dtype=float) for key in ("phi0", "w0")]
    given, own = _systems(point, names)
    systems = flows(given)
    shape = np.broadcast_shapes(own, *(array.shape for array in starts))
    group = np.broadcast_to(np.arange(len(systems)).reshape(own), shape).ravel()
    starts = np.stack([np.broadcast_to(array, shape).ravel() for array in starts], axis=-1)
    result = fate.empty(len(starts), INVALID_PARAMETERS)
    order = np.argsort(group, kind="stable")
    cuts = np.flatnonzero(np.diff(group[order])) + 1
    for members in np.split(order, cuts):
        system = systems[group[members[0]]]
        good = members[np.isfinite(starts[members]).all(axis=1)]
        if np.isfinite(system).all() and len(good):
            s = fate.remembered(method, system)
            out = basins.followed(method, system, s, starts[good], request.rtol, map_asked)
            fate.write(s, out, starts[good], result, good)
    return {name: values.reshape(shape) for name, values in result.items()}


def portraits(point, names, flows, method, request):
    """One portrait for each set of the parameters `names`."""
    given, shape = _systems(point, names)
    systems = flows(given)
    good = np.isfinite(systems).all(axis=1)
    result = portrait.empty(len(systems), INVALID_PARAMETERS, systems.shape[1])

    def beside(i):
        near = given[good][i]
        away = BESIDE * (1.0 + np.abs(near)) * np.sin(1.0 + np.arange(len(near)))
        rows = [flows((near + side * away)[None])[0] for side in (1.0, -1.0)]
        return next((row for row in rows if np.isfinite(row).all()), rows[0])

    for name, values in portrait.solve(method, systems[good], request.rtol, beside).items():
        result[name][good] = values
    return {name: values.reshape(shape + values.shape[1:]) for name, values in result.items()}
