"""Folds of cycles on a map of two parameters: where a return map touches the identity, and two
cycles are one.

There the change D of the map has an extremum on which it is 0: a multiplier passes +1. Extrema are
looked for on a lattice of the map, by the signs of the map's slope less 1 among SCANNED points, and
where the extremal D changes its sign from one node to the next a fold is followed
(`survey.measures.tracks`). Where curves do not explain how the number of cycles changes between two
nodes (`cycle_counts`), as between a connection and K = 0 that are close to each other, the segment
is searched again, more finely. What a fold does between lines of the lattice alone, and folds whose
cycles nearly touch a saddle throughout, may be missed.
"""

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import returns as rt
from survey.kernels.cylinder.flow import BOUND_DG, BOUND_F, values
from survey.measures import tracks
from survey.measures.cylinder.fate import (
    FINE,
    MIRROR,
    G,
    flow_of,
    mirrored_equilibria,
    outline,
    signed,
)
from survey.methods import taylor

LINES, SCANNED = 33, 26
BISECTIONS, APPROACHES = 18, 6  # of the border of a map, and points beside it
ROTATION_PLUS, ROTATION_MINUS, LIBRATION = range(3)
# slowest and fastest rotation that is looked at, in velocities of the system
LEAST, FASTEST = 1e-3, 30.0
TWO_PI = 2.0 * math.pi


class Node(NamedTuple):
    """A return map at a coordinate: its class, its change (of log w), its slope less 1, and their bars."""

    coordinate: float
    own: int
    change: float
    slope: float
    change_bar: float
    slope_bar: float


class Maps:
    """The return maps at one parameter point: rows of `flow_image`, by the logarithm of w or by the
    turning point.
    """

    def __init__(self, row):
        s = outline(row)
        self.good = s.stratum == G and not s.folded and not s.unknown
        self.flows = {}
        self.flows[ROTATION_PLUS] = self.flows[LIBRATION] = s.p, s.equilibria
        self.scale = s.p[BOUND_F] + math.sqrt(s.p[BOUND_DG])
        mirrored = flow_of(signed(s.p, MIRROR))
        self.flows[ROTATION_MINUS] = mirrored, mirrored_equilibria(s.equilibria)

    def node(self, kind, coordinate):
        """(class, a, b, bar of a, bar of b) of a map: a its change (of log w), b its slope less 1.

        The section of rotations is phi = 0.
        """
        p, eqs = self.flows[kind]
        node = np.zeros(rt.NODE_SIZE)
        if not self.good:
            return 0, *np.full(4, np.nan)
        if kind == LIBRATION:
            high = self._end(eqs, coordinate)
            if high is None:
                return 0, *np.full(4, np.nan)
            taylor.flow_image(rt.LIBRATION, p, eqs, len(eqs), high, coordinate, FINE, node)
            size = 1.0
            steep = p[BOUND_DG] / (abs(values(p, coordinate)[1]) + tracks.TINY)
        else:
            size = math.exp(coordinate)
            taylor.flow_image(rt.ROTATION, p, eqs, len(eqs), 0.0, size, FINE, node)
            steep = 1.0 / size
        change, slope, error = node[rt.CHANGE], node[rt.SLOPE], node[rt.ERROR]
        bar = 1e-14 * (1.0 + slope) + 20.0 * error + 2.0 * slope * steep * (abs(change) + error)
        # of motions into a focus only the sign is known
        own = int(node[rt.CLASS]) if slope > 0.0 else rt.NO_IMAGE
        return own, change / size, slope - 1.0, error / size, bar

    @staticmethod
    def _end(eqs, coordinate):
        """The equilibrium to the right of the angle, if the one to its left is not a saddle."""
        if not len(eqs):
            return None
        away = (eqs[:, eq.ANGLE] - coordinate) % TWO_PI
        left = int(np.argmax(away))
        return None if eqs[left, eq.KIND] == eq.SADDLE else coordinate + away.min()

    def extrema(self):
        """[(label, is it a minimum?, coordinate, a)] of the extrema of all maps; a label is (kind, class)."""
        if not self.good:
            return
        speeds = np.log(self.scale * np.geomspace(LEAST, FASTEST, SCANNED))
        scans = [(ROTATION_PLUS, speeds), (ROTATION_MINUS, speeds)]
        eqs = self.flows[LIBRATION][1]
        share = 1.0 / (1.0 + np.exp(-np.linspace(-7.0, 7.0, SCANNED - 4)))
        for i, row in enumerate(eqs):
            if row[eq.DG] < 0.0 and row[eq.KIND] != eq.DEGENERATE:
                high = eqs[i + 1, eq.ANGLE] if i + 1 < len(eqs) else eqs[0, eq.ANGLE] + TWO_PI
                scans.append((LIBRATION, row[eq.ANGLE] + share * (high - row[eq.ANGLE])))
        for kind, coordinates in scans:
            yield from self._extrema(kind, coordinates)

    def _node(self, kind, coordinate):
        return Node(coordinate, *self.node(kind, coordinate))

    def _extrema(self, kind, coordinates):
        nodes = [self._node(kind, x) for x in coordinates]
        for low, high in pairwise(nodes):
            parts = [low, high]
            if low.own != high.own:
                parts = self._beside(kind, low, high)
            for one, two in pairwise(parts):
                if one.own == two.own > 0 and one.slope * two.slope < 0.0:
                    x, a = self._extremum(kind, one, two)
                    yield (kind, one.own), two.slope > 0.0, x, a

    def _beside(self, kind, low, high):
        """Nodes on both sides of the border of a class, that lies between two nodes."""
        ends = [low, high]
        one, two = low, high
        for _ in range(BISECTIONS):
            middle = self._node(kind, 0.5 * (one.coordinate + two.coordinate))
            one, two = (middle, two) if middle.own == low.own else (one, middle)
        found = []
        for border, end in ((one, ends[0]), (two, ends[1])):
            shares = 10.0 ** -np.arange(1.0, APPROACHES) if end.own > 0 else np.zeros(0)
            coordinates = border.coordinate + shares * (end.coordinate - border.coordinate)
            beside = [self._node(kind, x) for x in coordinates]
            found += [end, *beside, border]
        return sorted(found)

    def _extremum(self, kind, one, two):
        """(coordinate, a) of the extremum between two nodes, to a few digits."""
        for _ in range(6):
            share = min(max(one.slope / (one.slope - two.slope), 0.05), 0.95)
            middle = self._node(kind, one.coordinate + share * (two.coordinate - one.coordinate))
            if middle.own != one.own:
                break
            one, two = (middle, two) if middle.slope * one.slope > 0.0 else (one, middle)
        best = min((one, two), key=lambda node: abs(node.slope))
        return best.coordinate, best.change


def found(plane, segments=None):
    """[(class, parameters (m, 2), errors (m), {name: (values, errors)})] of the folds on the map, or of
    those that cross `segments` [positions (2, 2)].
    """
    known = {}

    def maps(position):
        key = position.tobytes()
        if key not in known:
            if len(known) > 8:
                known.pop(next(iter(known)))
            row = plane.flows(position[None])[0]
            known[key] = Maps(row) if np.isfinite(row).all() else None
        return known[key]

    def things(position):
        here = maps(position)
        return list(here.extrema()) if here else []

    def function_of(label):
        kind, own = label

        def function(coordinate, position):
            here = maps(np.asarray(position))
            found = here.node(kind, coordinate) if here else (0,) * 5
            return found[1:] if found[0] == own else np.full(4, np.nan)

        return function, TWO_PI if kind == LIBRATION else math.inf

    given = things, function_of, plane.square
    for (kind, _class), track in (
        tracks.from_lattice(LINES, *given)
        if segments is None
        else tracks.from_segments(segments, *given)
    ):
        for part in track.certain():
            yield "cycle_fold", plane.square.parameters(part.x), part.error, _known(kind, part)


def _known(kind, part):
    """A state on the cycle at each point of a fold, and its multiplier there."""
    none = np.zeros(len(part.x))
    known = {"multiplier": (none + 1.0, none), "cycle_phi": (none, none), "cycle_w": (none, none)}
    if kind == LIBRATION:
        return known | {"cycle_phi": (part.coordinate, part.coordinate_error)}
    w = np.exp(part.coordinate)
    side = 1.0 if kind == ROTATION_PLUS else -1.0
    return known | {"cycle_w": (side * w, w * np.expm1(part.coordinate_error) + 4e-16 * w)}
