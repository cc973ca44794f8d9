"""Curves on a map: what measures hand to [boundaries]; parametrised curves, sampled closely enough
to be drawn.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

FIRST = 65
LONGEST, FLAT = 0.02, 3e-5  # of the map: chords, and how far a curve may lie off them
ROUNDS = 60


@dataclass
class Curves:
    """Curves one after another: `count` points each, of class `kind`.

    Per point its `parameters` (m, 2), its `error` (m), in the unit square of the map, and `along`:
    {name of ALONG: (values, errors)}. `unexplained`: segments of lines across the map along which a
    curve is missing, by what is known at their ends; None where nothing is counted. `complete`: is
    it shown that there are no others? None where this is not known. `index`: the number of each curve,
    `segments.UNKNOWN` where it is not certain; None where curves have no numbers.
    """

    count: np.ndarray
    kind: np.ndarray
    parameters: np.ndarray
    error: np.ndarray
    along: dict
    unexplained: int | None = None
    complete: bool | None = None
    index: np.ndarray | None = None


def sampled(position, low, high, first=FIRST):
    """Numbers t from low to high, spaced so that chords on the map are short and near the curve
    position(t) (m, 2).
    """
    if low == high:
        return np.array([low])
    t = np.linspace(low, high, first)
    for _ in range(ROUNDS):
        middle = 0.5 * (t[:-1] + t[1:])
        x, between = position(t), position(middle)
        chord, half = x[1:] - x[:-1], between - x[:-1]
        path = np.hypot(*half.T) + np.hypot(*(x[1:] - between).T)
        with np.errstate(all="ignore"):
            off = abs(chord[:, 0] * half[:, 1] - chord[:, 1] * half[:, 0]) / np.hypot(*chord.T)
        away = np.maximum(np.maximum(-x, x - 1.0), 0.0).max(axis=1)
        split = (np.minimum(away[1:], away[:-1]) <= path) & (
            (path > LONGEST) | ~(off <= FLAT) & (path > FLAT)
        )
        split &= (middle > t[:-1]) & (middle < t[1:])
        if not split.any():
            break
        t = np.sort(np.concatenate([t, middle[split]]))
    return t


def changes(test, t):
    """The numbers next to a change of the test, on the side where it holds; t is sampled."""
    holds = test(t)
    at = np.flatnonzero(holds[1:] != holds[:-1])
    yes, no = np.where(holds[at], t[at], t[at + 1]), np.where(holds[at], t[at + 1], t[at])
    while True:
        middle = 0.5 * (yes + no)
        if ((middle == yes) | (middle == no)).all():
            return yes
        good = test(middle)
        yes, no = np.where(good, middle, yes), np.where(good, no, middle)


def inside(x):
    """Which positions (m, 2) are on the map?"""
    return ((x >= 0.0) & (x <= 1.0)).all(axis=-1)


def runs(position, low, high, tests=(), first=FIRST):
    """Arrays of t, one for each run of the curve position(t) on the map, parted where one of the
    `tests` changes.
    """
    t = sampled(position, low, high, first)
    cuts = [changes(lambda s: inside(position(s)), t), *(changes(test, t) for test in tests)]
    t = np.unique(np.concatenate([t, *cuts]))
    cuts = np.unique(np.concatenate([t[[0, -1]], *cuts]))
    if cuts.size == 1:
        return [t] if inside(position(t)).all() else []
    found = [t[(t >= a) & (t <= b)] for a, b in pairwise(cuts)]
    middles = [own[own.size // 2] if own.size > 2 else 0.5 * (own[0] + own[-1]) for own in found]
    return [
        own
        for own, middle in zip(found, middles, strict=True)
        if inside(position(np.array([middle])))[0]
    ]


def joined(found, names):
    """The Curves of [(kind, parameters (m, 2), errors (m), {name: (values, errors)})]; `names`:
    those of ALONG.
    """

    def of(name, parameters, known, which):
        given = known.get(name)
        return (
            np.full(len(parameters), np.nan)
            if given is None
            else np.broadcast_to(given[which], len(parameters))
        )

    def all_of(arrays):
        return np.concatenate([np.zeros(0), *arrays])

    return Curves(
        count=np.array([len(parameters) for _, parameters, _, _ in found], int),
        kind=np.array([kind for kind, _, _, _ in found], int),
        parameters=np.concatenate(
            [np.zeros((0, 2)), *(parameters for _, parameters, _, _ in found)]
        ),
        error=all_of(error for _, _, error, _ in found),
        along={
            name: tuple(
                all_of(of(name, parameters, known, i) for _, parameters, _, known in found)
                for i in (0, 1)
            )
            for name in names
        },
    )
