"""Edges of tongues as curves on a map of two parameters: each zero set of a factor, followed
through its folds.

An edge is a zero of one of the four factors F of `edges`, analytic in both parameters. From edges
of rows (and of some columns) as seeds, both ways along F = 0: predictor by tangent and curvature,
corrector along the normal with F, its gradient and second derivatives from nine neighbouring
points; all curves step together. A step is taken if the corrector is short against it, the curve
turns little, and F keeps its positive side (neighbouring zeros of F have opposite ones); else it is
halved. Curves end at the border of the map, where they close, or are lost where F has a double
point. At last every point is bracketed by certain signs of F.

Positions are those of `survey.measures.square`.
A closed curve that meets neither a row nor a column that was searched has no seed, and is not found.

Source: E. L. Allgower, K. Georg, Numerical Continuation Methods (1990), chapters 2, 6 and 10.
"""

from dataclasses import dataclass

import numpy as np

from survey.measures.hill.edges import (
    ASIDE,
    COUNTS,
    FACTORS,
    close_in,
    has_factors,
    of_kind,
    tongue,
)
from survey.measures.hill.expansion import expander, tangents
from survey.measures.tasks import in_turn

LONGEST, SHORTEST = 0.02, 1e-9  # steps
BEND = 0.15  # radians per step
TURN = np.cos(2 * BEND)  # a step that turns more is repeated
OFF = 0.05  # of a step: how long the corrector may be
STEPS = 10_000
NEAR = 0.02  # of a step: how far a seed may lie from the curve that goes through it
REACH = 2.0  # of a step: no point of it is farther from its beginning
WIDE = 1e-7  # half the width of the first bracket of a point
CHUNK = 1024  # points bracketed together


def serves(scene):
    """Are its curves found here?"""
    return has_factors(scene)


@dataclass
class Seeds:
    """Edges as positions (n, 2) with `kind`, `index`; `low`, `high` (n, 2) the rectangle in which F
    is analytic.
    """

    x: np.ndarray
    kind: np.ndarray
    index: np.ndarray
    low: np.ndarray
    high: np.ndarray


@dataclass
class FollowedCurves:
    """Curves one after another: `count` points each; `kind`, `index`, `complete` per curve.

    Per point its position `x` (m, 2), unit tangent `along` (m, 2) and `error`, a bound of its
    distance from the curve; `of_seed` is the curve of each seed.
    """

    count: np.ndarray
    kind: np.ndarray
    index: np.ndarray
    complete: np.ndarray
    x: np.ndarray
    along: np.ndarray
    error: np.ndarray
    of_seed: np.ndarray


def trace(solve, square, seeds, each=in_turn):
    """The FollowedCurves through all seeds.

    `solve(q, p, wanted)` gives outputs at q (m, 1), p (m, n), the square's parameters; `each`: see
    `measures.tasks`.
    """
    expand = expander(solve, square)
    of_seed = np.full(seeds.kind.size, -1)
    towards = np.full(seeds.x.shape, np.nan)
    row = np.unique(seeds.x[:, 0], return_inverse=True)[1].ravel()
    in_row = np.bincount(row)

    def doubtful(of):
        """Which of the seeds beside a path may lie on another curve, which crosses it: a row that the
        path crosses has its own seed there, and others are listed too.
        """
        beside = np.bincount(row[of], minlength=in_row.size)
        return of[((beside > 1) | (in_row == 1))[row[of]]]

    def know_directions(of):
        of = of[np.isnan(towards[of, 0])]

        def task(some):
            own = of[some]
            at = seeds.x[own], seeds.kind[own], np.full(own.size, LONGEST)
            towards[own] = tangents(solve, square, *at, seeds.low[own], seeds.high[own])

        _in_chunks(each, task, of.size, "parts of the curves' seeds")

    paths, starts = [], []
    while (of_seed < 0).any():
        start = _starts(seeds, np.flatnonzero(of_seed < 0))
        new = _follow(expand, seeds, start)
        beside = []
        for path, seed in zip(new, start, strict=True):
            alike = (seeds.kind == seeds.kind[seed]) & (seeds.index == seeds.index[seed])
            near = np.flatnonzero((of_seed < 0) & alike)
            beside.append(near[_on(path, seeds.x[near], towards[near])])
        doubts = [doubtful(near) for near in beside]
        know_directions(np.concatenate(doubts))
        for path, seed, near, some in zip(new, start, beside, doubts, strict=True):
            other = some[~_on(path, seeds.x[some], towards[some])]
            of_seed[np.setdiff1d(near, other)] = len(paths)
            of_seed[seed] = len(paths)
            paths.append(path)
            starts.append(seed)
    order = np.argsort(np.unique(of_seed, return_index=True)[1])  # as their first seeds are
    paths, starts = [paths[i] for i in order], np.array(starts, int)[order]
    return _close_all_in(solve, square, paths, starts, seeds, np.argsort(order)[of_seed], each)


def _starts(seeds, left):
    """Of the seeds `left` one of each kind and index, so that no two lie on the same curve: the
    middle one, from which both ends are few steps away.
    """
    own = np.stack([seeds.kind[left], seeds.index[left]], axis=1)
    _, first, group, number = np.unique(
        own, axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    before = np.cumsum(number) - number
    middle = np.argsort(group.ravel(), kind="stable")[before + number // 2]
    return left[middle[np.argsort(first)]]


def _in_chunks(each, task, number, what):
    each(
        lambda at: task(np.arange(at * CHUNK, min((at + 1) * CHUNK, number))),
        range(-(-number // CHUNK)),
        what,
    )


@dataclass
class BracketedPath:
    """Points of a curve in order: positions, tangents, lines on which they are bracketed.

    `complete`: the curve is closed, or both its ends lie on borders.
    """

    x: np.ndarray
    along: np.ndarray
    line: np.ndarray
    complete: bool


def _follow(expand, seeds, start):
    """The paths through the seeds `start`, both ways, all together."""
    n = start.size
    kind, index = np.tile(seeds.kind[start], 2), np.tile(seeds.index[start], 2)
    low, high = (np.tile(v[start], (2, 1)) for v in (seeds.low, seeds.high))
    side = np.repeat([1.0, -1.0], n)
    x = np.tile(seeds.x[start], (2, 1))
    step = np.full(2 * n, 0.1 * LONGEST)
    # on the edge itself the rotation number would ask for double-double arithmetic
    along, normal, bend = expand(x, kind, step, low, high, count=False).course(side)
    home, heading, gone = x.copy(), along.copy(), np.zeros(2 * n)
    ended, closed, lost = np.zeros((3, 2 * n), bool)
    trail = [(np.arange(2 * n), home, heading, _first_line(x, normal, low, high))]
    for _ in range(STEPS):
        a = np.flatnonzero(~ended & ~lost)
        if not a.size:
            break
        length, guess, edge, border = _predict(
            x[a], along[a], normal[a], bend[a], step[a], low[a], high[a]
        )
        leaves = border & (length < 4 * SHORTEST)  # it stands at the border and points outside
        with np.errstate(all="ignore"):
            seen = expand(guess, kind[a], length, low[a], high[a])
            border &= abs(seen.zero(edge)) <= OFF * length
            line = np.where(border[:, None], edge, seen.course(side[a])[1])
            off = seen.zero(line)
            new = guess + off[:, None] * line
            t, nrm, c = seen.moved(new - guess).course(side[a])
        good = (
            (abs(off) <= OFF * length)
            & ((t * along[a]).sum(axis=1) >= TURN)
            & np.isfinite(c)
            & ~leaves
        )
        good &= ((new >= low[a]) & (new <= high[a])).all(axis=1)
        astray = abs(seen.turns - index[a])
        # in the tongue, near it, or beyond a band too thin to be seen
        good &= (astray < 0.5) | (astray == 1)
        closing = good & _returns(x[a], new, t, home[a], heading[a], length, gone[a])
        new[closing], t[closing], line[closing] = (
            home[a][closing],
            heading[a][closing],
            trail[0][3][a][closing],
        )
        took = a[good]
        trail.append((took, new[good], t[good], line[good]))
        x[took], along[took], normal[took], bend[took] = new[good], t[good], nrm[good], c[good]
        gone[took] += length[good]
        with np.errstate(all="ignore"):
            step[took] = np.minimum(np.minimum(2 * length, LONGEST), BEND / abs(c))[good]
        step[a[~good]] = 0.5 * length[~good]
        ended[a[leaves | (good & border) | closing]] = True
        lost[a[~good & ~leaves & (step[a] < SHORTEST)]] = True
        closed[a[closing]] = True
        ended[(a[closing] + n) % (2 * n)] = True  # its twin would go round the same way
    return _joined(trail, ended, closed)


def _predict(x, along, normal, bend, step, low, high):
    """Steps along the parabola of tangent and curvature: (length, position, line to correct along,
    border).

    Where it leaves the rectangle it goes to its border, and is corrected along that.
    """

    def reached(length):
        return x + length[:, None] * along + (0.5 * bend * length**2)[:, None] * normal

    def outside(at):
        return (at < low) | (at > high)

    guess = reached(step)
    border = outside(guess).any(axis=1)
    length, line = step.copy(), np.zeros_like(x)
    if border.any():
        inner, outer = np.zeros_like(step), step.copy()
        for _ in range(50):
            middle = 0.5 * (inner + outer)
            out = outside(reached(middle)).any(axis=1)
            inner, outer = np.where(out, inner, middle), np.where(out, middle, outer)
        end = reached(outer)
        across = outside(end)
        end = np.clip(end, low, high)
        guess[border], length[border] = end[border], outer[border]
        line = np.where(border[:, None], ~across & (np.cumsum(~across, axis=1) == 1), 0.0)
    return length, guess, line, border


def _first_line(x, normal, low, high):
    """The line to close a seed in along: the normal, or the border on which it lies."""
    on = (x <= low) | (x >= high)
    border = np.stack([on[:, 1] & ~on[:, 0], on[:, 0]], axis=1)
    return np.where(on.any(axis=1)[:, None], border, normal)


def _returns(x, new, t, home, heading, length, gone):
    """Does the step from x to new pass the position where its curve began?"""
    before, after = home - x, home - new
    there = ((before * t).sum(axis=1) >= 0) & ((after * t).sum(axis=1) <= 0)
    near = abs(after[:, 0] * heading[:, 1] - after[:, 1] * heading[:, 0]) <= OFF * length
    return there & near & ((t * heading).sum(axis=1) > TURN) & (gone > 2 * length)


def _joined(trail, ended, closed):
    """The paths: backwards to the seed and forwards from it, or once round."""
    which, *values = (np.concatenate(parts) for parts in zip(*trail, strict=True))
    order, n = np.argsort(which, kind="stable"), ended.size // 2
    tips = np.split(order, np.cumsum(np.bincount(which, minlength=2 * n))[:-1])
    paths = []
    for tip in range(n):
        forth, back = tips[tip], tips[tip + n][::-1]
        if closed[tip]:
            back = back[:0]
        elif closed[tip + n]:
            forth = forth[:0]
        else:
            forth = forth[1:]  # the seed is in both
        x, along, line = (np.concatenate([v[back], v[forth]]) for v in values)
        along[: back.size] *= -1
        paths.append(BracketedPath(x, along, line, bool(ended[tip] and ended[tip + n])))
    return paths


def _on(path, x, towards):
    """Which of the positions x (n, 2), with tangents `towards` (NaN where any will do), lie on the
    path (its cubic Hermite pieces)?
    """
    found = np.zeros(len(x), bool)
    length = np.hypot(*np.diff(path.x, axis=0).T)
    for first in range(0, len(x), CHUNK):
        away = x[first : first + CHUNK, None] - path.x[:-1]
        i, piece = np.nonzero((away**2).sum(axis=2) <= (REACH * length) ** 2)
        i += first
        a, b, ta, tb = path.x[piece], path.x[piece + 1], path.along[piece], path.along[piece + 1]
        chord = length[piece]
        with np.errstate(all="ignore"):
            s = np.clip(((x[i] - a) * (b - a)).sum(axis=1) / chord**2, 0, 1)[:, None]
        curve = (1 + 2 * s) * (1 - s) ** 2 * a + s**2 * (3 - 2 * s) * b
        curve += chord[:, None] * (s * (1 - s) ** 2 * ta - s**2 * (1 - s) * tb)
        other = (((1 - s) * ta + s * tb) * towards[i]).sum(axis=1) <= TURN
        found[i[~other & (np.hypot(*(curve - x[i]).T) <= NEAR * chord)]] = True
    return found


def _close_all_in(solve, square, paths, starts, seeds, of_seed, each):
    """The FollowedCurves of the paths, each point bracketed on its line and counted by its rotation number."""
    count = np.array([len(path.x) for path in paths], int)
    whose = np.repeat(np.arange(len(paths)), count)
    x, along, line = (np.concatenate([getattr(p, name) for p in paths] or [np.zeros((0, 2))])
                      for name in ("x", "along", "line"))  # fmt: skip
    kind, index = seeds.kind[starts], seeds.index[starts]
    new = x.copy()
    error = np.zeros(len(x))
    sure = np.zeros(len(x), bool)

    def task(own):
        def at(which, t, wanted):
            here = square.parameters(x[own[which], None] + t[..., None] * line[own[which], None])
            out = solve(here[..., 0].reshape(-1, 1), here[..., 1].reshape(-1, 1), wanted)
            return {name: values.reshape(t.shape) for name, values in out.items()}

        mine = kind[whose[own]]
        t, width, good = close_in(
            lambda which, t: of_kind(at(which, t, FACTORS), mine[which]),
            np.zeros(own.size), np.full(own.size, WIDE), np.full(own.size, square.grain),
        )  # fmt: skip
        sides = t[:, None] + ASIDE * width[:, None] * np.array([-1.0, 1.0])
        good &= tongue(at(slice(None), sides, COUNTS), mine) == index[whose[own]]
        new[own] = x[own] + t[:, None] * line[own]
        error[own] = width + square.grain
        sure[own] = good

    _in_chunks(each, task, len(x), "parts of the curves")
    complete = np.array([path.complete for path in paths], bool)
    complete[whose[~sure]] = False
    return FollowedCurves(
        np.bincount(whose[sure], minlength=len(paths)), kind, index, complete, new[sure], along[sure], error[sure],
        of_seed,
    )  # fmt: skip
