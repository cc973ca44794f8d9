"""The boundaries of the triangular points: critical mass ratios; of the elliptic problem, curves on
maps of mu and e.

Of the circular problem they are the numbers of `critical`. Of the elliptic one they are Danby's A
and B, and KC: on A and B a pair of multipliers meets at -1, on KC two pairs of unlike kind meet on
the unit circle. They are zeros of the half-period factors A and B, and of K, where 0 < t < 2
(`scenes/libration_elliptic.md`, section 3), searched for on LINES lines of the map each way; every
point is bracketed on its line by certain signs.
"""

import numpy as np

from survey.kernels.libration.traces import discriminant, product
from survey.measures import contours
from survey.measures.libration import critical, danby
from survey.measures.sampled import joined

DANBY = {"A": 0, "B": 1, "KC": 2}
CLASSES = DANBY | critical.CLASSES
TITLE = "curve of Danby's diagram, where multipliers meet at -1 (A, B) or two pairs meet (KC); or critical mass ratio"
AXES = ("mu", "e")
ALONG = ()
LINES = 129


def refusal(axes, scene, options=None):
    """Why there are no curves on a map of these axes, in words; None if there are."""
    if scene.FAMILY == "normal_form":
        return (
            None
            if list(axes) == ["mu"]
            else f"boundaries are known only along mu, not on {', '.join(axes)}"
        )
    if set(axes) == set(AXES) and len(axes) == 2:
        return None
    return f"curves are known on the axes mu and e of libration_elliptic, not on {', '.join(axes) or 'none'}"


def closed(square, axes, fixed, options):
    """The Curves on the map of `axes`, the unit square `square`."""
    if set(axes) != set(AXES):
        return _of_circular(square)
    found = []
    for name, code in DANBY.items():

        def on_map(x, name=name):
            here = dict(zip(axes, square.parameters(x).T, strict=True))
            return _function(name, here["e"], here["mu"])

        for x, error in contours.lines(on_map, square, LINES):
            at = square.parameters(x)
            for part in contours.runs(_is_boundary(**dict(zip(axes, at.T, strict=True)))):
                found.append((code, at[part], error[part], {}))
    return joined(found, [])


def seconds(axes):
    """Estimated seconds on one thread of the curves on one map, measured; or along one axis alone."""
    return 1.0 if len(axes) > 1 else 0.4


def _of_circular(square):
    """The Curves on a map of mu and something on which no verdict depends."""
    low, high = square.low[0], square.high[0]
    across = [(kind, mu, bar) for kind, mu, bar in critical.ratios() if low <= mu <= high]
    found = [
        (
            kind,
            np.array([[mu, square.low[1]], [mu, square.high[1]]]),
            np.full(2, bar / (high - low)),
            {},
        )
        for kind, mu, bar in across
    ]
    curves = joined(found, [])
    curves.complete = True
    return curves


def _function(name, e, mu):
    """(values, bars) of the function that vanishes on the curve, at points (N); NaN where it is not
    defined.

    At mu = 0 A and B are negative, and known: the first line of a map is no end of what is
    searched. There K vanishes for all e.
    """
    out, bars = np.full((2, e.size), np.nan)
    inside = ((mu > 0.0) if name == "KC" else (mu >= 0.0)) & (mu <= 0.5) & (e >= 0.0) & (e < 1.0)
    if not inside.any():
        return out, bars
    values, errors = danby.factors(e[inside], mu[inside])
    (a, b, c, d, t), (ea, eb, ec, ed, et) = values.T, errors.T
    if name == "KC":
        (ab, ab_bar), (cd, cd_bar) = product.py_func(a, b, ea, eb), product.py_func(c, d, ec, ed)
        value, bar = np.vectorize(discriminant)(t, ab, cd, et, ab_bar, cd_bar)
        value = np.where(_between(t), value, np.nan)
    else:
        value, bar = (a, ea) if name == "A" else (b, eb)
    out[inside], bars[inside] = value, bar
    return out, bars


def _is_boundary(mu, e):
    """Is stability lost at these points, which lie on one of the curves? Beyond the tip A vanishes
    between unstable motions.
    """
    return _between(danby.factors(e, mu)[0][:, 4])


def _between(t):
    return (t > 0.0) & (t < 2.0)
