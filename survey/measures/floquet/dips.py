"""Tongues that lie between two points of a line: there a function of `bifurcations` has an extremum
that its values on both sides do not show to pass zero.

Candidates are the values that a parabola continues to zero; their surroundings are cut until a
value of the other sign is met. On a map each edge of such a tongue, found on a line of the lattice,
begins a piece of two points, from where `tips` follows it.
"""

import numpy as np

from survey.measures import tips
from survey.measures.hill.edges import close_in
from survey.measures.sampled import FLAT

DIPS, PARTS = 12, 8  # how often, and into how many parts, the surroundings of an extremum are cut
ASIDE = 1e-4  # of the map: the second point of a piece lies so far beside the line
REACH = 3.0  # times ASIDE: where it is looked for along the line
ROUNDS = 4  # a tongue that is followed explains where it dips on other lines
KNOWN = 2.0 * FLAT  # how near the crossing of a drawn chord and a line is to the curve's


def zeros(function, ticks, values):
    """(lines, positions, ends of brackets, slopes' signs) of zeros of functions on lines, about an
    extremum between `ticks` (n) at which their `values` (L, n) have one sign.

    `function(lines (m), t (m, k))` are values at positions t.
    """
    before, here, after = values[:, :-2], values[:, 1:-1], values[:, 2:]
    with np.errstate(invalid="ignore"):
        least = (here * before > 0.0) & (here * after > 0.0)
        least &= (abs(here) <= abs(before)) & (abs(here) < abs(after))
        line, at = np.nonzero(least & _low(before, here, after))
    ends, sign = np.stack([ticks[at], ticks[at + 2]], axis=1), np.sign(here[line, at])
    found = [np.empty((5, 0))]
    for _ in range(DIPS):
        if not line.size:
            break
        t = np.linspace(*ends.T, PARTS + 1, axis=1)
        value = function(line, t) * sign[:, None]
        value[np.isnan(value)] = np.inf
        crossed = (value < 0.0).any(axis=1)
        own, v, side = t[crossed], value[crossed], sign[crossed]
        with np.errstate(invalid="ignore"):
            i, k = np.nonzero(
                ((v[:, 1:] < 0.0) != (v[:, :-1] < 0.0)) & np.isfinite(v[:, 1:] + v[:, :-1])
            )
        share = v[i, k] / (v[i, k] - v[i, k + 1])
        low, high = own[i, k], own[i, k + 1]
        rise = side[i] * np.sign(v[i, k + 1] - v[i, k])
        found.append(np.stack([line[crossed][i], low + (high - low) * share, low, high, rise]))
        rows, k = np.arange(len(t)), np.clip(value.argmin(axis=1), 1, PARTS - 1)
        ends = np.stack([t[rows, k - 1], t[rows, k + 1]], axis=1)
        keep = ~crossed & _low(*(value[rows, k + side] for side in (-1, 0, 1)))
        line, ends, sign = line[keep], ends[keep], sign[keep]
    line, t, low, high, slope = np.concatenate(found, axis=1)
    return line.astype(int), t, (low, high), slope


def _low(before, here, after):
    """May the extremum near the middle one of three values pass zero? That of their parabola does
    within twice its depth.
    """
    with np.errstate(all="ignore"):
        depth = (after - before) ** 2 / (8.0 * (after - 2.0 * here + before))
        return abs(here) < 2.0 * abs(depth)


def curves(function, drawn, grain, values):
    """[(positions (m, 2), errors (m))] of curves function(x) = 0 on a map that its `values` (n, n) on
    the lattice show to lie between two points, but for those that are `drawn` [positions].
    """
    ticks = np.linspace(0.0, 1.0, len(values))
    seeds = [_Seeds(function, ticks, values, axis, grain) for axis in (0, 1)]
    known, found = [(x, np.zeros(len(x))) for x in drawn if len(x) > 1], []
    for _ in range(ROUNDS):
        new = [piece for own in seeds for piece in own.pieces(known + found)]
        if not new:
            break
        found += tips.followed(function, known + found + new, grain, len(known + found))
    return found


class _Seeds:
    """Zeros on the lines of the lattice along one axis, which are not on pieces."""

    def __init__(self, function, ticks, values, axis, grain):
        self.function, self.axis, self.grain, self.ticks = function, axis, grain, ticks

        def on_lines(line, t):
            return function(self.placed(t, ticks[line][:, None]).reshape(-1, 2))[0].reshape(t.shape)

        self.line, _t, (low, high), self.slope = zeros(
            on_lines, ticks, values.T if axis == 0 else values
        )
        self.t, self.error, sure = self._closed_in(
            0.5 * (low + high), 0.5 * (high - low), ticks[self.line], self.slope
        )
        self._keep(sure)

    def _keep(self, some):
        self.line, self.slope = self.line[some], self.slope[some]
        self.t, self.error = self.t[some], self.error[some]

    def placed(self, t, across):
        """Positions (..., 2) at t along the lines, at `across` on the other axis."""
        pair = np.broadcast_arrays(t, across)
        return np.stack(pair if self.axis == 0 else pair[::-1], axis=-1)

    def pieces(self, drawn):
        """Two points each of curves that are not drawn: of those that neighbouring lines show, one."""
        self._keep(self._unknown(drawn))
        first = self._chains()
        x, error, slope = self.t[first], self.error[first], self.slope[first]
        across = self.ticks[self.line[first]]
        self._keep(np.setdiff1d(np.arange(self.t.size), first))  # whatever becomes of it
        aside = across + np.where(across < 0.5, ASIDE, -ASIDE)
        near, reach = self._near(x, aside, slope)
        y, other, certain = self._closed_in(near, reach, aside, slope)
        found = []
        for k in np.flatnonzero(certain):
            points = self.placed(np.array([x[k], y[k]]), np.array([across[k], aside[k]]))
            # higher values lie on the right
            onward = slope[k] * (aside[k] - across[k]) * (1.0 if self.axis == 0 else -1.0) > 0.0
            both = slice(None) if onward else slice(None, None, -1)
            found.append((points[both], np.array([error[k], other[k]])[both] + self.grain))
        return found

    def _at(self, across):
        """The functions and their bounds on lines `across` (m), as `close_in` takes them."""

        def at(which, t):
            where = self.placed(t, across[which][:, None])
            value, bar = self.function(where.reshape(-1, 2))
            return value.reshape(t.shape), bar.reshape(t.shape)

        return at

    def _near(self, t, across, slope):
        """Zeros on lines `across`, ASIDE of those at t (m), with these signs of slopes, and within what."""
        if not t.size:
            return t, t
        at = self._at(across)
        near, reach = tips.zeros(at, t.copy(), np.full(t.size, REACH * ASIDE), slope)
        lost = ~np.isfinite(near)
        reach = np.where(lost, ASIDE, np.maximum(0.1 * reach, 4.0 * self.grain))
        return np.where(lost, t, near), reach

    def _closed_in(self, t, width, across, slope):
        """(zeros near t (m) on lines `across`, half widths, are they certain?), with these signs of slopes."""
        if not t.size:
            return t, t, np.zeros(0, bool)
        at = self._at(across)
        x, width, sure = close_in(at, t, width, np.full(t.size, self.grain), 1.0)
        beyond, bars = at(np.arange(t.size), (x + width)[:, None])
        right = (beyond[:, 0] * slope > 0.0) & (abs(beyond[:, 0]) > bars[:, 0])
        return x, width, sure & right & (width < tips.SURE) & (x >= 0.0) & (x <= 1.0)

    def _unknown(self, drawn):
        """Which zeros lie on no piece that is drawn? Those of one sense may be the other edge's, unless
        they are at a point of it.
        """
        if not self.line.size:
            return np.zeros(0, bool)
        along, other = self.axis, 1 - self.axis
        known = np.zeros(self.line.size, bool)
        for x, _error in drawn:
            first, last = x[:-1], x[1:]
            slope = np.sign(last[:, other] - first[:, other]) * (1.0 if along == 0 else -1.0)
            near = (np.minimum(first, last).min(axis=0)[other], x[:, other].max())
            some = np.flatnonzero(
                (self.ticks[self.line] >= near[0] - KNOWN)
                & (self.ticks[self.line] <= near[1] + KNOWN)
                & ~known
            )
            for i in some:
                tick = self.ticks[self.line[i]]
                k = np.flatnonzero((first[:, other] - tick) * (last[:, other] - tick) <= 0.0)
                run = last[k] - first[k]
                with np.errstate(invalid="ignore"):  # a chord along the line
                    share = (tick - first[k, other]) / run[:, other]
                    off = abs(first[k, along] + share * run[:, along] - self.t[i])
                known[i] = (off <= np.where(slope[k] == self.slope[i], KNOWN, tips.SURE)).any()
        return ~known

    def _chains(self):
        """The middle one of each chain of zeros of one slope on neighbouring lines, two cells apart at most."""
        chains = []
        for i in np.lexsort((self.t, self.line)):
            near = [
                chain
                for chain in chains
                if self.line[chain[-1]] == self.line[i] - 1
                and self.slope[chain[-1]] == self.slope[i]
                and abs(self.t[chain[-1]] - self.t[i]) <= 2.0 * self.ticks[1]
            ]
            if near:
                min(near, key=lambda chain: abs(self.t[chain[-1]] - self.t[i])).append(i)
            else:
                chains.append([i])
        return np.array([chain[len(chain) // 2] for chain in chains], int)
