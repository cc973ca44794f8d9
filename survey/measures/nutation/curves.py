"""The bifurcation set of nutations on a map of two of the scaled integrals l, alpha, beta, in
closed form.

On maps of initial states the same curves are level curves, see `level_curves`.

A map cuts the surface of regular precessions (S18) in curves. The precessions are stable, and a well begins, where
A^2 omega_n^2 / |k| = y^2 + z^2 - s (1 - 3 y^2 z^2) is positive; where it is negative they are saddles, the
separatrices; where it is 0 the sheets of the surface meet in cusps (k > 0). The surface ends at the upright rotations,
alpha = +-beta, l = alpha^2 - s, which for k < 0 go on without it as threads; with the same alpha and beta and a greater
l the motion passes the pole, where the advances jump. Equation numbers: `scenes/brun.md`.

Curves are sampled until chords are short and near them, cut where they leave the map or become
unstable.
"""

from itertools import pairwise, product

import numpy as np

from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation.wells import TINY
from survey.measures.nutation import level_curves
from survey.measures.nutation.regular_precessions import parts, surface
from survey.measures.sampled import Curves, changes, sampled
from survey.scene import Output

CLASSES = {
    "stable_precession": 0, "separatrix": 1, "cusp": 2, "stable_upright": 3, "unstable_upright": 4, "pole_passage": 5,
}  # fmt: skip
STABLE, SADDLE, CUSP, UPRIGHT, THREAD, PASSAGE = CLASSES.values()
TITLE = "motion that the curve belongs to"
AXES = ("l", "alpha", "beta")
ALONG = (
    Output("u", "u = cos theta of the regular precession", "u", applies="not to curves of the class pole_passage"),
    Output("precession_rate", "d psi / dt of the regular precession, times A / sqrt|k|", "y",
           applies="to regular precessions off the poles"),
    Output("reduced_spin_rate", "d phi / dt - p_phi (1/C - 1/A) of the regular precession, times A / sqrt|k|", "z",
           applies="to regular precessions off the poles"),
    Output("nutation_square", "squared frequency of small nutations, times A^2 / |k|; negative: unstable",
           r"\omega_n^2", applies="not to curves of the class pole_passage"),
)  # fmt: skip


def refusal(axes, scene, options=None):
    """Why there are no curves on a map of these axes, in words; None if there are."""
    if len(axes) in (2, 3) and (set(axes) <= set(AXES) or set(axes) <= set(level_curves.STATE)):
        return None
    return (
        f"curves are known on two or three axes of {', '.join(AXES)} or of {', '.join(level_curves.STATE)}, "
        f"not on {', '.join(axes) or 'none'}"
    )


def closed(square, axes, fixed, options):
    """The Curves on the map of `axes`, the unit square `square`; `fixed` holds the other parameters."""
    if not set(axes) <= set(AXES):
        return _of_states(square, axes, fixed)
    s = float(options["sign"])
    third = next(name for name in AXES if name not in axes)
    value = float(fixed[third])
    found = []
    for part in parts(third, value, s, _furthest(square, axes)):
        found += _traced(part, square, axes, s)
    found += _uprights(third, value, s, square, axes) + _passages(third, value, s, square, axes)
    return _joined(found, square, axes)


def seconds(axes):
    """Estimated seconds on one thread of the curves on one map, measured."""
    return 0.1 if set(axes) <= set(AXES) else 1.5


def _of_states(square, axes, fixed):
    """The Curves on a map of initial states."""
    count, kinds, parameters, errors, known = [], [], [], [], []
    for function, x, error, columns in level_curves.traced(square, axes, fixed):
        here = _nowhere(len(x)) | level_curves.along(function, columns)
        kind = np.full(
            len(x),
            PASSAGE if function in (level_curves.upper_pole, level_curves.lower_pole) else SADDLE,
        )
        if function is level_curves.precession:
            kind[here["nutation_square"][0] > 0.0] = STABLE
        for part in np.split(np.arange(len(x)), 1 + np.flatnonzero(np.diff(kind))):
            count.append(part.size)
            kinds.append(kind[part[0]])
        parameters.append(square.parameters(x))
        errors.append(error)
        known.append(here)
    return Curves(
        count=np.array(count, int),
        kind=np.array(kinds, int),
        parameters=np.concatenate([np.zeros((0, 2)), *parameters]),
        error=np.concatenate([np.zeros(0), *errors]),
        along={
            output.name: tuple(
                np.concatenate([np.zeros(0), *(here[output.name][i] for here in known)])
                for i in (0, 1)
            )
            for output in ALONG
        },
    )


def _furthest(square, axes):
    """The largest |alpha| or |beta| on the map."""
    return max(
        max(abs(square.low[i]), abs(square.high[i])) for i, name in enumerate(axes) if name != "l"
    )


def _traced(part, square, axes, s):
    """[(kind, {name: (values, errors)})]: the runs of a part on the map, cut at cusps, and these as
    points.
    """

    def position(t):
        here = surface(*part.at(t), s)
        return square.positions(
            _positive(np.stack([here[name][0] for name in axes], axis=-1), square)
        )

    def inside(t):
        x = position(t)
        return ((x >= 0.0) & (x <= 1.0)).all(axis=-1)

    def stable(t):
        return s < 0.0 or surface(*part.at(t), s)["nutation_square"][0] >= 0.0

    t = sampled(position, part.low, part.high)
    borders = changes(inside, t)
    cusps = changes(stable, t) if s > 0.0 else np.array([])
    t = np.unique(np.concatenate([t, borders, cusps]))
    cuts = np.unique(np.concatenate([t[[0, -1]], borders, cusps]))
    found = [(CUSP, _points(part, cusps[[i]], s)) for i in np.flatnonzero(inside(cusps))]
    for low, high in pairwise(cuts) if cuts.size > 1 else [(t[0], t[0])]:
        own = t[(t >= low) & (t <= high)]
        middle = own[own.size // 2] if own.size > 2 else 0.5 * (low + high)
        if inside(middle):
            found.append((STABLE if stable(middle) else SADDLE, _points(part, own, s)))
    if square.across is None:
        return found
    border = square.parameters(np.full(2, square.across))[1]
    along = [(kind, here) for kind, here in found if (here[axes[1]][0] == border).all()]
    at = changes(lambda t: position(t)[:, 1] >= square.across, t)
    return along + [
        (STABLE if stable(u) else SADDLE, _crossing(part, u, s, axes, border))
        for u in at[(position(at)[:, 0] >= 0.0) & (position(at)[:, 0] <= 1.0)]
    ]


def _crossing(part, t, s, axes, border):
    """The point of the part next to t at which its second parameter is `border`: rounding hides where, so
    the error of the first covers all t at which the second may have that value.
    """
    here = _points(part, np.array([t]), s)
    step, ends = np.spacing(abs(t)), np.array([t, t])
    while (ends[0] > part.low or ends[1] < part.high) and step < part.high - part.low:
        ends = np.clip([t - step, t + step], part.low, part.high)
        value, bar = _points(part, ends, s)[axes[1]]
        if (abs(value - border) > bar).all():
            break
        step *= 2.0
    first, bar = here[axes[0]]
    reach = abs(_points(part, ends, s)[axes[0]][0] - first).max()
    return here | {axes[0]: (first, bar + reach), axes[1]: (np.array([border]), np.zeros(1))}


def _points(part, t, s):
    return surface(*(np.broadcast_to(v, t.shape) for v in part.at(t)), s)


def _positive(values, square):
    """Values that have a logarithm where one is taken."""
    return np.where(square.log, np.maximum(values, TINY), values)


def _uprights(third, value, s, square, axes):
    """Upright rotations u = 1 (alpha = beta) and u = -1 (alpha = -beta), l = alpha^2 - s, on the map."""
    found = []
    for p, side in product(_momenta(third, value, s), (1.0, -1.0)):
        a, b = (p, side * p) if third == "alpha" else (side * p, p)
        square_p = (value + s if third == "l" else p * p) + 4.0 * s
        here = _nowhere(1) | {
            "l": (
                np.array([value if third == "l" else p * p - s]),
                np.array([2.0 * ROUNDOFF * (p * p + 1.0)]),
            ),
            "alpha": (np.array([a]), np.array([2.0 * ROUNDOFF * abs(p) * (third == "l")])),
            "beta": (np.array([b]), np.array([2.0 * ROUNDOFF * abs(p) * (third == "l")])),
            "u": (np.array([side]), np.zeros(1)),
            "nutation_square": (np.array([square_p]), np.array([4.0 * ROUNDOFF * (p * p + 4.0)])),
        }
        if _on_map(here, square, axes)[0]:
            found.append((UPRIGHT if square_p >= 0.0 else THREAD, here))
    return found


def _momenta(third, value, s):
    """alpha (or beta, where that is given) of upright rotations."""
    if third != "l":
        return [value]
    if value + s <= 0.0:
        return [0.0] if value + s == 0.0 else []
    return [np.sqrt(value + s), -np.sqrt(value + s)]


def _passages(third, value, s, square, axes):
    """Straight lines alpha = +-beta, l >= alpha^2 - s, where motions pass a pole."""
    low, high = (dict(zip(axes, ends, strict=True)) for ends in (square.low, square.high))
    found = []
    for side in (1.0, -1.0):
        if third == "l":
            far = np.sqrt(max(value + s, 0.0))
            least, most = (
                (low["beta"], high["beta"]) if side > 0.0 else (-high["beta"], -low["beta"])
            )
            ends = np.array([max(low["alpha"], least, -far), min(high["alpha"], most, far)])
            here = {"alpha": ends, "beta": side * ends, "l": np.full(2, value)}
        else:
            ends = np.array([max(low["l"], value * value - s), high["l"]])
            other = "beta" if third == "alpha" else "alpha"
            here = {"l": ends, third: np.full(2, value), other: np.full(2, side * value)}
        here = _nowhere(2) | {
            name: (v, 2.0 * ROUNDOFF * (abs(v) + 1.0)) for name, v in here.items()
        }
        if ends[0] < ends[1] and _on_map(here, square, axes).all():
            found.append((PASSAGE, here))
    return found


def _nowhere(number):
    return {output.name: (np.full(number, np.nan), np.full(number, np.nan)) for output in ALONG}


def _on_map(here, square, axes):
    values = np.stack([here[name][0] for name in axes], axis=-1)
    return ((values >= square.low) & (values <= square.high)).all(axis=-1)


def _joined(found, square, axes):
    """The Curves of [(kind, {name: (values, errors)})]."""

    def all_of(name, which):
        return np.concatenate([here[name][which] for _, here in found] or [np.zeros(0)])

    parameters = np.stack([all_of(name, 0) for name in axes], axis=-1)
    bars = np.stack([all_of(name, 1) for name in axes], axis=-1)
    ends = _positive(np.stack([square.low, square.high]), square)
    ratios = np.log(np.divide(ends[1], ends[0], out=np.ones(2), where=square.log))
    width = np.where(square.log, ratios * abs(parameters), square.high - square.low)
    return Curves(
        count=np.array([here["l"][0].size for _, here in found], int),
        kind=np.array([kind for kind, _ in found], int),
        parameters=parameters,
        error=np.hypot(*(bars / width).T),
        along={output.name: (all_of(output.name, 0), all_of(output.name, 1)) for output in ALONG},
    )
