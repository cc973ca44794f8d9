"""What a model holds series of: the analytic functions of the parameters from which a family's
verdict follows.

Each family gives a Source: names of the functions, the rule by which `survey.model.reader` decides,
and the values with their error bounds at points. Functions rather than D or multipliers, so that
verdicts keep their digits at edges.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from survey import api
from survey.errors import BadInput
from survey.kernels.math.roundoff import EPS
from survey.measures.hill.edges import has_factors
from survey.model.reader import HALF
from survey.request.function_scene import FunctionScene

BEST = 1e-15  # what is asked at the nodes: as well as can be
INVARIANTS = {"A": "det P", "B": "det T", "C": "det Q", "D": "det S", "t": "trace of T'P"}


@dataclass(frozen=True)
class Source:
    """`at(x, y)`: values and bounds (F, N1, N2) on the grid of x (N1) and y (N2); NaN where there
    is no answer.
    """

    rule: str
    names: tuple[str, ...]
    long_names: tuple[str, ...]
    at: Callable


def of(workflow, names, fixed):
    """The Source of a checked workflow with axes `names` (two) and `fixed` parameters; raises BadInput."""
    maker = {"hill": _hill, "danby": _danby, "floquet": _floquet}.get(workflow.scene.FAMILY)
    if maker is None or (maker is _floquet and not isinstance(workflow.scene, FunctionScene)):
        raise BadInput(
            f"model: no series are available for the scene {workflow.name}; they are for satellite, "
            "mathieu, libration_elliptic, and Hill equations and linear periodic systems of your own"
        )
    return (_damped if getattr(workflow.scene, "DAMPED", False) else maker)(workflow, names, fixed)


def _hill(workflow, names, fixed):
    """The factors at T/2; or, where z is not even, D alone."""
    scene = workflow.scene
    even = has_factors(scene)
    wanted = HALF if even else ("discriminant",)
    outputs = {o.name: o for o in scene.OUTPUTS}
    solve = _evaluated(workflow, names, fixed, wanted)

    def at(x, y):
        found = solve(x, y)
        return tuple(np.stack([found[f"{name}{end}"] for name in wanted]) for end in ("", "_error"))

    return Source(
        "hill" if even else "trace", wanted, tuple(outputs[name].long_name for name in wanted), at
    )


def _damped(workflow, names, fixed):
    """l^2 + c1 l + c2 of y'' + 2 c y' + z y = 0: c1 = -D, c2 = e^(-2 c T); where c is 0 throughout,
    D alone.
    """
    scene = workflow.scene
    columns = [p.name for p in scene.PARAMETERS]
    if (scene.damping if scene.column is None else fixed.get(columns[scene.column])) == 0.0:
        return _hill(workflow, names, fixed)
    solve = _evaluated(workflow, names, fixed, ("discriminant", "period"))

    def at(x, y):
        found = solve(x, y)
        points = {names[0]: x[:, None], names[1]: y} | fixed
        c = scene.damping if scene.column is None else points[columns[scene.column]]
        turn = np.broadcast_to(2.0 * c, (x.size, y.size)) * found["period"]
        det = np.exp(-turn)
        off = (
            det * np.expm1(abs(turn) * (8.0 * EPS + 2.0 * found["period_error"] / found["period"]))
            + 4.0 * EPS * det
        )
        return np.stack([-found["discriminant"], det]), np.stack([found["discriminant_error"], off])

    words = "minus the trace of the monodromy matrix", "its determinant, e^(-2 c T)"
    return Source("schur", ("c1", "c2"), words, at)


def _evaluated(workflow, names, fixed, wanted):
    """What `survey.evaluate` gives on the grid of x and y, in any order: {name: values (N1, N2)},
    bars too.
    """
    given = dict(workflow.request.options) | fixed
    asked = workflow.scene if isinstance(workflow.scene, FunctionScene) else workflow.name

    def at(x, y):
        # increasing, as evaluate may answer grids by rows
        order = [np.argsort(values) for values in (x, y)]
        grid = {name: values[o] for name, values, o in zip(names, (x, y), order, strict=True)}
        ds = api.evaluate(asked, method="auto", rtol=BEST, variables=list(wanted), **given, **grid)
        back = np.ix_(*(np.argsort(o) for o in order))
        shaped = ds.broadcast_like(ds.status).transpose(*names)
        both = [f"{name}{end}" for name in wanted for end in ("", "_error")]
        return {name: shaped[name].values[back].astype(float) for name in both}

    return at


def _danby(workflow, names, fixed):
    """The invariants of `survey.kernels.libration.traces`."""
    from survey.measures.libration import danby_double

    def at(x, y):
        points = {names[0]: np.repeat(x, y.size), names[1]: np.tile(y, x.size)} | fixed
        mu, e = (
            np.broadcast_to(points[name], x.size * y.size).astype(float) for name in ("mu", "e")
        )
        values, bars = danby_double.factors(np.ascontiguousarray(e), np.ascontiguousarray(mu))
        return values.T.reshape(-1, x.size, y.size), bars.T.reshape(-1, x.size, y.size)

    return Source("danby", tuple(INVARIANTS), tuple(INVARIANTS.values()), at)


def _floquet(workflow, names, fixed):
    """The coefficients of the characteristic polynomial, or of the one in s = l + 1 / l."""
    from survey.measures.floquet import dense

    scene = workflow.scene
    n = len(scene.states)
    paired = scene.structure != "none"
    number = n // 2 if paired else n
    if n > dense.LARGEST or (paired and (n % 2 or number > 2)):
        raise BadInput(
            f"model: series cannot decide a system of {n} states with the structure "
            f"{scene.structure!r}; they can for at most {4 if paired else dense.LARGEST} states"
        )
    columns = [p.name for p in scene.PARAMETERS]
    system = scene._system
    others = tuple(float(fixed.get(name, 0.0)) for name in columns)

    def at(x, y):
        points = np.tile(np.array(others), (x.size * y.size, 1))
        points[:, columns.index(names[0])] = np.repeat(x, y.size)
        points[:, columns.index(names[1])] = np.tile(y, x.size)
        known = scene._called(dense.at_points, system, scene.structure, points, dense.BEST)
        if known is None:
            return np.full((2, number, x.size, y.size), np.nan)
        return tuple(part[:, :number].T.reshape(number, x.size, y.size) for part in known)

    power = "s = l + 1 / l" if paired else "l"
    words = tuple(f"coefficient of {power} to the power {number - k}" for k in range(1, number + 1))
    rule = "reciprocal" if paired else "schur"
    return Source(rule, tuple(f"c{k}" for k in range(1, number + 1)), words, at)
