"""The curves that [boundaries] draws on a map of two parameters: where multipliers reach the unit
circle or leave it.

Those of periodic orbits are found by `orbit_curves`; what follows is about linear systems, and
about orbits that are symmetric, whose multipliers `family` gives. There the curves are zeros of the
functions of `bifurcations`. These are known on LINES lines of the map each way, and their splines,
on lines FINER times as dense, show where to look (marching squares). Every point is then bracketed
along an axis by signs of the function itself that are certain within the error bounds of M, and
curves are followed on from their ends inside the map, into the tips of tongues (see `tips`). A
tongue that the splines do not show is found where a function dips below zero between two points of
the lattice (see `dips`); one that is narrower still may be missed. Curves are drawn wherever a
multiplier passes, also where another one is outside the circle already: `outside` counts those.
`row_count` tells where they do not explain how many multipliers are outside, or, by the Maslov
index, how often some have passed 1 or -1. Along one axis, ALONE points are searched, and
`counted_edges` finds what is missing.
"""

from functools import partial
from itertools import pairwise

import contourpy
import numpy as np
from scipy.interpolate import CubicSpline, RectBivariateSpline
from scipy.ndimage import binary_erosion

from survey.measures import contours, tips
from survey.measures.floquet import bifurcations, counted_edges, dips, narrow, numbers, row_count
from survey.measures.floquet.multipliers import MINUS_ONE, PLUS_ONE
from survey.measures.floquet.stability import CROSSINGS
from survey.measures.hill.edges import close_in
from survey.measures.sampled import FLAT, LONGEST, joined
from survey.scene import Output, Request

CLASSES = {
    name: CROSSINGS[name] for name in ("plus_one", "minus_one", "neimark_sacker", "collision")
}
TITLE = "how a multiplier passes the unit circle"
NUMBER = (
    "number of the curve among those of its class: the greater of the Maslov indices on its sides"
)
ALONG = (
    Output("angle", "argument of the multiplier on the unit circle", r"\theta", units="rad"),
    Output("outside", "number of other multipliers outside the unit circle: stability is lost or gained where it is 0",
           applies="where the error bounds allow one number alone"),
)  # fmt: skip
LINES, LINES_OF_ORBITS, FINER = 97, 49, 8
# points along one axis; with damping, tongues are wide or none
ALONE, ALONE_DAMPED = 769, 193
NEAR = 3e-5  # of the map: how near curves of splines are
BESIDE = 1e-9  # of the map: how near zeros are of what is computed roughly
# one after another: times NEAR, along the best axis or the other
TRIED = ((1.0, 0), (2.3, 0), (1.0, 1), (2.3, 1))
TRIED_OF_ORBITS = TRIED[::2]  # which take long
CORNER = 0.7  # cosine of the turn at a point beyond which it is a corner
SURE = 1e-6  # the widest bracket of a point, half of it, that is drawn
BEST = 1e-12  # the position error above which M may differ along it by more than its bounds
RTOL, ROUGH = 1e-13, 1e-9  # of M for points of curves, and to see where these are


def refusal(axes, scene, options=None):
    """Why there are no curves on a map of these axes, in words; None if there are."""
    if scene is not None and scene.FAMILY == "orbit" and scene.continued is not None:
        along = scene.own[scene.continued.index].name
        if "branch" in axes:
            whose = (
                "all orbits, whatever their number"
                if scene.symmetry is None
                else "the orbits of one number"
            )
            return f"curves are those of {whose}: let `branch` be a number, not an axis"
        alone = len([name for name in axes if name]) == 1
        if scene.symmetry is not None and along not in axes[:2] and not alone:
            return (
                f"curves are drawn along one parameter, or on maps of {along}, the parameter of "
                "CONTINUATION, and another one"
            )
    return (
        None
        if len(axes) in (1, 2, 3)
        else f"curves are drawn on two or three axes, not on {len(axes)}"
    )


def searched(scene, square, axes, fixed, options):
    """The Curves on the map of `axes`, the unit square `square`; `fixed` holds the other parameters."""
    names = [output.name for output in ALONG]
    if scene.FAMILY == "orbit":
        if scene.symmetry is None:
            found, lacking = scene.curves(square, axes, fixed)
            curves = joined(found, names)
            curves.complete = False if lacking else None
            return curves
        structure = "reversible"
        number = LINES_OF_ORBITS
        orbits = scene.family(square, axes, fixed, number)
        matrices = orbits.matrices
        on_lattice = orbits.on_lattice()
    else:
        structure, orbits = scene.structure, None
        alone = ALONE_DAMPED if structure == "none" else ALONE
        number = LINES if square.across is None else alone
        matrices = matrices_of(scene, square, axes, fixed, options)
        on_lattice = matrices(contours.lattice(number, square.across), ROUGH)
    n = on_lattice[0].shape[1]
    functions = list(  # several of one kind, where a scene has one for each edge
        scene.functions(n)
        if hasattr(scene, "functions")
        else bifurcations.functions(n, structure).items()
    )
    drawing = _Drawing(square, matrices, structure)
    for kind, function in functions:
        for x, error in _zeros(drawing, function, orbits, on_lattice, number):
            drawing.add(kind, x, error)
    if square.across is not None and scene.FAMILY == "orbit":  # whose family may end in between
        return joined(drawing.found, names)
    indices = _indices(scene, square, axes) if structure == "symplectic" else {}
    solved = _solved(scene, square, axes, fixed, options, "auto", ["monodromy", *indices.values()])

    def index(kind, x):
        name = indices.get(kind)
        return None if name is None else solved(x, rtol=ROUGH)[name]

    if square.across is not None:
        curves = _on_border(drawing, on_lattice, partial(solved, rtol=ROUGH), indices)
        curves.index = numbers.of_curves(curves, square, index) if indices else None
        return curves
    passed = _add_by_indices(drawing, dict(functions), partial(solved, rtol=ROUGH), indices, number)
    if len(on_lattice) > 2:
        passed = {
            kind: one.reshape(number, number) for kind, one in scene.passed(*on_lattice[2:]).items()
        }
    if scene.FAMILY != "orbit":
        _add_by_dips(drawing, functions, on_lattice, number)
    counts = row_count.outside(*on_lattice[:2], structure).reshape(number, number)
    if scene.FAMILY != "orbit":
        _add_by_number(drawing, row_count.known(counts))
    curves = joined(drawing.found, names)
    curves.index = numbers.of_curves(curves, square, index) if indices else None
    curves.unexplained = row_count.unexplained(counts, drawing.drawn, passed)[0]
    return curves


class _Drawing:
    """The curves `found` on a map so far, as `joined` takes them, and `drawn`: [(kind, positions)],
    as often as they may explain a count.
    """

    def __init__(self, square, matrices, structure):
        self.square, self.matrices, self.structure = square, matrices, structure
        self.found = []
        self.drawn = []

    def add(self, kind, x, error, copies=1, counted=False):
        """Add what is certain of a curve of positions x (N, 2) within `error` (N), or all of it if
        it is `counted`, though several multipliers that pass together may be uncertain.
        """
        M, E = self.matrices(x, RTOL)[:2]
        sure, angle, bar, outside = bifurcations.passing(M, E, kind, self.structure)
        if (rough := np.flatnonzero(error > BEST)).size:
            about = _about(self.matrices, x[rough], error[rough], M[rough], E[rough])
            there, _angle, wide, others = bifurcations.passing(*about, kind, self.structure)
            bar[rough] = np.where(there, np.maximum(bar[rough], wide), bar[rough])
            outside[rough] = np.where(others == outside[rough], others, np.nan)
        if counted:
            angle, bar, outside = (np.where(sure, one, np.nan) for one in (angle, bar, outside))
            sure = np.ones_like(sure)
        for part in contours.runs(sure):
            known = {"angle": (angle[part], bar[part]), "outside": (outside[part], 0.0 * bar[part])}
            self.found.append((kind, self.square.parameters(x[part]), error[part], known))
            self.drawn += [(kind, x[part])] * copies


def _on_lattice(function, on_lattice, number):
    """The values of a function of M on the lattice (number, lines), NaN where they are noise."""
    values, bars = function(*on_lattice)
    # where no sign is certain all around, as where the function is 0 throughout, there is only noise
    open_ = ~(abs(values) > bars).reshape(number, -1)
    around = np.ones((3, 3 if open_.shape[1] > 1 else 1))
    values = np.where(binary_erosion(open_, around, border_value=1).ravel(), np.nan, values)
    return values.reshape(open_.shape)


def _zeros(drawing, function, orbits, on_lattice, number):
    """[(positions (m, 2), errors (m))] of the curves on which a function of M is 0; `orbits`: the Family
    of those that M belongs to, if there is one.
    """
    values, square = _on_lattice(function, on_lattice, number), drawing.square
    lines = _lines if square.across is None else partial(_crossings, across=square.across)

    if orbits is None:
        return lines(lambda x: function(*drawing.matrices(x, RTOL)), square.grain, values)
    nearly = lines(lambda x: function(*orbits.rough(x)), square.grain, values, TRIED_OF_ORBITS)
    return _sharpened(lambda x: function(*orbits.close(x)), nearly, square.grain)


def _add_by_indices(drawing, functions, solved, indices, number):
    """Add the curves that the Maslov `indices`, {kind: name}, show besides; returns {kind: the index
    on the lattice}.
    """
    on_lattice = solved(contours.lattice(number)) if indices else {}
    passed = {kind: on_lattice[name].reshape(number, number) for kind, name in indices.items()}
    for kind, name in indices.items():

        def index(x, name=name):
            return solved(x)[name]

        def function(x, kind=kind):
            return functions[kind](*drawing.matrices(x, RTOL))

        missing = narrow.curves(index, function, passed[kind], kind, drawing.drawn)
        for x, error in missing:
            drawing.add(kind, x, error + drawing.square.grain)
    return passed


def _add_by_dips(drawing, functions, on_lattice, number):
    """Add the tongues that lie between two points of the lattice, and that are not drawn yet."""
    for kind, function in functions:

        def sharp(x, function=function):
            return function(*drawing.matrices(x, RTOL))

        drawn = [x for own, x in drawing.drawn if own == kind]
        values = _on_lattice(function, on_lattice, number)
        for x, error in dips.curves(sharp, drawn, drawing.square.grain, values):
            drawing.add(kind, x, error)


def _add_by_number(drawing, counts):
    """Add the curves that the number of multipliers outside the unit circle shows besides, `counts`
    (n, n) on the lattice.
    """

    def outside(x):
        return row_count.known(row_count.outside(*drawing.matrices(x, RTOL)[:2], drawing.structure))

    def kinds_of(x):
        return counted_edges.kinds(drawing.matrices(x, RTOL)[0], drawing.structure)

    for kind, x, error, copies in narrow.counted(outside, kinds_of, counts, drawing.drawn):
        # two at least: perhaps they pass together
        drawing.add(kind, x, error + drawing.square.grain, max(copies, 2), counted=True)


def _on_border(drawing, on_lattice, solved, indices):
    """The Curves at the border that alone is asked for, with the edges that the number of
    multipliers outside the unit circle and the Maslov `indices`, {kind: name}, show besides.
    """
    square, matrices, structure = drawing.square, drawing.matrices, drawing.structure

    def on_line(x):
        return np.stack([x, np.full(x.size, square.across)], axis=1)

    def outside(x):
        return row_count.known(row_count.outside(*matrices(on_line(x), RTOL)[:2], structure))

    def kinds_of(x):
        return counted_edges.kinds(matrices(on_line(x), RTOL)[0], structure)

    found = drawing.found
    own = [
        (kind, *one)
        for kind, parameters, error, _known in found
        for one in zip(square.positions(parameters)[:, 0], error, strict=True)
    ]
    number = row_count.known(row_count.outside(*on_lattice[:2], structure))
    ticks = np.linspace(0.0, 1.0, number.size)
    counted = [(outside, kinds_of, number, ticks, CLASSES.values())]
    if structure == "symplectic" and on_lattice[0].shape[1] > 2:

        def order(x):
            return counted_edges.order(*matrices(on_line(x), RTOL)[:2])

        signs = counted_edges.order(*on_lattice[:2])
        inside = counted_edges.crossings(order, signs, ticks, own)
        if inside.size:
            at = np.concatenate([ticks, inside])
            sorts = np.argsort(at)
            number = np.concatenate([number, outside(inside)])[sorts]
            counted = [(outside, kinds_of, number, at[sorts], CLASSES.values())]
    on_ticks = solved(on_line(ticks)) if indices else {}
    for kind, name in indices.items():

        def index(x, name=name):
            return solved(on_line(x))[name]

        def own_kind(x, kind=kind):
            return np.full(x.size, kind)

        counted.append((index, own_kind, on_ticks[name], ticks, (kind,)))
    unknown = {output.name: (np.array([np.nan]), np.array([np.nan])) for output in ALONG}
    lost = 0
    for count, kinds_at, values, at, kinds in counted:
        some = [one for one in own if one[0] in kinds]
        missing, left = counted_edges.edges(count, kinds_at, values, at, some, square.grain)
        lost += left
        for name, x, error in missing:
            own.append((name, x, error))
            found.append(
                (name, square.parameters(on_line(np.array([x]))), np.array([error]), unknown)
            )
    curves = joined(found, [output.name for output in ALONG])
    curves.complete = False if lost else None
    return curves


def _indices(scene, square, axes):
    """{kind: name} of the outputs that are Maslov indices; {} where an excluded value cuts the map
    into parts whose indices have nothing to do with one another.
    """
    ends = {name: (square.low[k], square.high[k]) for k, name in enumerate(axes)}
    cut = any(
        ends[p.name][0] < x < ends[p.name][1]
        for p in scene.PARAMETERS
        if p.name in ends
        for x in p.excluded
    )
    return {} if cut else {PLUS_ONE: "index_plus_one", MINUS_ONE: "index_minus_one"}


def matrices_of(scene, square, axes, fixed, options, method="auto"):
    """matrices(positions (N, axes), rtol) -> (M, E), the monodromy matrices without what is
    conserved, and "edges" with their error, if the scene counts them.
    """
    solved = _solved(scene, square, axes, fixed, options, method, ["monodromy"])

    def matrices(x, rtol=RTOL):
        out = solved(x, rtol)
        found = tuple(
            out[name + end]
            for name in ("monodromy", "edges")
            if name in out
            for end in ("", "_error")
        )
        # a system of one's own may have a conserved quantity
        return (
            scene.judged(square.parameters(x), axes, fixed, *found)
            if hasattr(scene, "judged")
            else found
        )

    return matrices


def _about(matrices, x, error, M, E):
    """M and bounds that contain, besides E, how M differs within the `error` (N) of positions x (N,
    2), along either axis.
    """
    for axis in range(x.shape[1]):
        for side in (-1.0, 1.0):
            there = x.copy()
            there[:, axis] = np.clip(there[:, axis] + side * error, 0.0, 1.0)
            other, bar = matrices(there, RTOL)[:2]
            E = np.maximum(E, abs(other - M) + bar)
    return M, E


def _solved(scene, square, axes, fixed, options, method, variables):
    """solved(positions (N, axes), rtol) -> {name: values}, these variables of the scene."""

    def solved(x, rtol):
        values = square.parameters(x)
        point = fixed | {name: values[:, k] for k, name in enumerate(axes)}
        with np.errstate(all="ignore"):
            return scene.solve(point, Request(options, method, rtol, frozenset(variables)))

    return solved


def _lines(function, grain, values, tried=TRIED):
    """[(positions (m, 2), errors (m))] of the curves function(x) = 0, from its values on the
    lattice (lines, lines).
    """
    lines = len(values)
    known = np.isfinite(values)
    ticks, fine = np.linspace(0.0, 1.0, lines), np.linspace(0.0, 1.0, (lines - 1) * FINER + 1)
    spline = RectBivariateSpline(ticks, ticks, contours.filled(values))
    dense = spline(fine, fine)
    if not known.all():
        hole = (
            RectBivariateSpline(ticks, ticks, np.where(known, 0.0, 1.0), kx=1, ky=1)(fine, fine)
            > 0.0
        )
        dense = np.ma.masked_array(dense, hole)
    found = contourpy.contour_generator(fine, fine, dense).lines(0.0)
    parts = [_thinned(np.asarray(line)[:, ::-1]) for line in found]
    if not parts:
        return []
    x = np.concatenate(parts)
    slope = abs(np.stack([spline.ev(*x.T, dx=1), spline.ev(*x.T, dy=1)], axis=1))
    border = (x == 0.0) | (x == 1.0)
    along = np.argmax(np.where(border, -1.0, slope), axis=1)
    # marching squares have higher values on the right, as the axes are here
    run = np.concatenate([np.gradient(part, axis=0) for part in parts])
    signs = np.sign(run[:, ::-1]) * [1.0, -1.0]
    signs[abs(run[:, ::-1]) < 0.1 * np.hypot(*run.T)[:, None]] = 0.0
    pieces = _closed_in(function, parts, along, grain, 0.5 / (lines - 1), tried, signs=signs)
    return tips.followed(function, [part for one in pieces for part in _smooth(*one)], grain)


def _smooth(x, error):
    """The parts of a piece (positions (m, 2), errors (m)) between its corners: marching squares
    join both edges of a tongue, and the branches of two curves that cross.
    """
    bent = _cosines(x)
    # two points that have moved past each other along the curve
    for i in np.flatnonzero((bent[:-1] < 0.0) & (bent[1:] < 0.0)):
        x[[i, i + 1]], error[[i, i + 1]] = x[[i + 1, i]], error[[i + 1, i]]
    bent = _cosines(x)
    # of the chords at a corner the one that turns more at its other end leaves the curve
    last = {i - (bent[i - 1] < bent[i + 1]) for i in np.flatnonzero(bent < CORNER)}
    own = np.split(np.arange(len(x)), 1 + np.array(sorted(last), int))
    return [(x[part], error[part]) for part in own if part.size > 1]


def _cosines(x):
    """Of the turn at each of the points (m, 2); 1 at the ends."""
    run = np.diff(x, axis=0)
    run /= np.maximum(np.hypot(*run.T), 1e-300)[:, None]
    return np.concatenate([[1.0], (run[1:] * run[:-1]).sum(axis=1), [1.0]])


def _crossings(function, grain, values, tried=TRIED, *, across):
    """As `_lines`, where only the border at `across` is asked for: the points on it, each alone."""
    lines = len(values)
    ticks, fine = np.linspace(0.0, 1.0, lines), np.linspace(0.0, 1.0, (lines - 1) * FINER + 1)
    known = np.isfinite(values[:, 0])
    dense = CubicSpline(ticks, contours.filled(values[:, 0]))(fine)
    dense[np.interp(fine, ticks, np.where(known, 0.0, 1.0)) > 0.0] = np.nan
    with np.errstate(invalid="ignore"):
        at = np.flatnonzero(
            np.isfinite(dense[1:] + dense[:-1]) & ((dense[1:] > 0.0) != (dense[:-1] > 0.0))
        )
    start = fine[at] + dense[at] / (dense[at] - dense[at + 1]) / (fine.size - 1)

    def on_line(_line, t):
        x = np.stack([t.ravel(), np.full(t.size, across)], axis=1)
        return function(x)[0].reshape(t.shape)

    start = np.sort(np.append(start, dips.zeros(on_line, ticks, values.T)[1]))
    if not start.size:
        return []
    parts = [np.array([[t, across]]) for t in start]
    found = _closed_in(
        function,
        parts,
        np.zeros(len(parts), int),
        grain,
        0.5 / (lines - 1),
        tried[: len(tried) // 2],
    )
    # one that the spline and a dip both show is found twice
    found.sort(key=lambda one: one[0][0, 0])
    position, error = (np.array([one[i].flat[0] for one in found]) for i in (0, 1))
    keep = np.diff(position, prepend=-1.0) > error + np.append(0.0, error)[:-1]
    return [one for one, good in zip(found, keep, strict=True) if good]


def _sharpened(function, pieces, grain):
    """The pieces [(positions (m, 2), errors (m))], which are nearly zeros of the function,
    bracketed by it.
    """
    if not pieces:
        return []
    along = []
    for x, _error in pieces:
        step = abs(np.gradient(x, axis=0)) if len(x) > 1 else np.array([[0.0, 1.0]])
        along.append(np.argmin(np.where((x == 0.0) | (x == 1.0), np.inf, step), axis=1))
    parts = [x for x, _error in pieces]
    return _closed_in(function, parts, np.concatenate(along), grain, SURE, TRIED[:1], BESIDE)


def _closed_in(function, parts, along, grain, widest, tried=TRIED, near=NEAR, signs=None):
    """The curves near positions, moved along the axis `along` of each, by `widest` at most; cut
    where one is not certain. Brackets are `near` wide at first. `signs` (m, 2): of the slopes of
    the function, 0 where any will do: a narrow tongue has edges of both.
    """
    x = np.concatenate(parts)

    def at(left, axis, which, t):
        here = np.repeat(x[left[which], None], t.shape[1], axis=1)
        here[np.arange(len(t)), :, axis[which]] = t
        value, bar = function(here.reshape(-1, 2))
        return value.reshape(t.shape), bar.reshape(t.shape)

    found, error = x.copy(), np.full(len(x), np.inf)
    for times, other in tried:
        left = np.flatnonzero(error == np.inf)
        axis = abs(along[left] - other)
        start, same = x[left, axis], np.ones(left.size)
        t, width, sure = close_in(
            partial(at, left, axis), start, times * near * same, grain * same, widest
        )
        sure &= (width < SURE) & (t >= 0.0) & (t <= 1.0) & (abs(t - start) < widest)
        if signs is not None and left.size:
            beyond = at(left, axis, np.arange(left.size), (t + width)[:, None])[0][:, 0]
            sure &= ~(beyond * signs[left, axis] < 0.0)
        found[left[sure], axis[sure]], error[left[sure]] = t[sure], width[sure] + grain
    firsts = np.cumsum([0, *map(len, parts)])
    own = [
        first + run
        for first, last in pairwise(firsts)
        for run in contours.runs(np.isfinite(error[first:last]))
    ]
    return [(found[part], error[part]) for part in own]


def _thinned(x):
    """So many of the positions (m, 2) of a curve that chords are short, and all others are near them."""
    kept, left = {0, len(x) - 1}, [(0, len(x) - 1)]
    while left:
        first, last = left.pop()
        if last - first < 2:
            continue
        chord, rest = x[last] - x[first], x[first + 1 : last] - x[first]
        length = np.hypot(*chord)
        off = (
            abs(chord[0] * rest[:, 1] - chord[1] * rest[:, 0]) / length
            if length > 0
            else np.hypot(*rest.T)
        )
        if length > LONGEST or off.max() > FLAT:
            middle = (first + last) // 2
            kept.add(middle)
            left += [(first, middle), (middle, last)]
    return x[sorted(kept)]
