"""A curve of orbits with a multiplier on the unit circle, followed by its arc length over a map of
two parameters.
"""

import numpy as np

from survey.measures.floquet.multipliers import NEIMARK_SACKER
from survey.measures.floquet.newton import inverse
from survey.measures.sampled import FLAT, LONGEST

FIRST_STEP, LONGEST_STEP, SHORTEST = 0.01, 0.2, 1e-7  # relative to the unknowns' sizes
MOST_STEPS = 2000  # in each direction
TURN, LITTLE, GROWTH = 0.4, 0.15, 1.5  # of the tangent in a step, in radians
CORRECTED = 0.25  # the first of Newton's steps, relative to the step
NEAREST = 3e-2  # of the angle, to 0 and pi: where a curve ends that turns back there
CUSP = 1e-3  # of the map: the longest chord across a cusp


class Walk:
    """Follows curves of `points` (`CriticalPoints`); positions(y) are those on the map."""

    def __init__(self, points, square, positions):
        self.points, self.square, self.positions = points, square, positions
        self.own = points.critical

    def curve(self, seed):
        """(y (m, size), columns (m) of the parameter at the map's border, or -1) through the seed."""
        ahead = self._half(seed, 1.0)
        back = ([], [], True) if ahead[2] else self._half(seed, -1.0)
        y = [*back[0][::-1], seed, *ahead[0]]
        return np.array(y), np.array([*back[1][::-1], -1, *ahead[1]])

    def _tangent(self, y, slope, size, before):
        """The tangent (size), of length 1 in units of `size`; None if there is none."""
        rows = self.points.conditions(y[None])[0]
        matrix = np.concatenate([slope[None], rows], axis=1)[0] * size
        if not np.isfinite(matrix).all():
            return None
        matrix /= np.linalg.norm(matrix, axis=1, keepdims=True)
        if before is None:
            vector = np.linalg.svd(matrix)[2][-1]
        else:
            vector = inverse(np.concatenate([matrix, (before / size)[None]])[None])[0][:, -1]
        return vector / np.linalg.norm(vector) * size if np.isfinite(vector).all() else None

    def _half(self, seed, sense):
        """Points after the seed to one side, their borders, and whether the curve closes."""
        y = seed
        step = FIRST_STEP
        found = []
        borders = []
        _value, slope, size = self.points.linearised(seed[None])
        slope, size = slope[0], size[0]
        tangent = self._tangent(y, slope, size, None)
        if tangent is None:
            return [], [], False
        tangent *= sense
        first = tangent
        for _ in range(MOST_STEPS):
            if step < SHORTEST:
                break
            new, slope, new_size = self._corrected(y, tangent, size, step)
            ahead = None if new is None else self._tangent(new, slope, new_size, tangent)
            if ahead is None or not self._near(y, tangent, new, ahead, size):
                step *= 0.5
                continue
            back = self._on_map(y, tangent) @ self._on_map(new, ahead) < 0.0
            end = self._end(y, new, back)
            if end is not None:
                return found + end[0], borders + end[1], False
            found.append(new)
            borders.append(-1)
            if len(found) > 3 and self._closed(seed, first, y, new, ahead):
                return [*found[:-1], seed], [*borders[:-1], -1], True
            if _turn(tangent / size, ahead / size) < LITTLE:
                step = min(GROWTH * step, LONGEST_STEP)
            y, tangent, size = new, ahead, new_size
        return found, borders, False

    def _corrected(self, y, tangent, size, step):
        """The point of the curve in the plane across the tangent through y + step tangent,
        derivatives and sizes.
        """
        guess = y + step * tangent
        row = (tangent / size**2)[None, None, :]
        rows, goal = self.points.conditions(y[None])
        rows, goal = (
            np.concatenate([rows, row], axis=1),
            np.concatenate([goal, row[:, 0] @ guess[:, None]], axis=1),
        )
        new, good, slope, sizes = self.points.newton(
            guess[None], rows, goal, first=CORRECTED * step
        )
        return (new[0], slope[0], sizes[0]) if good[0] else (None, None, None)

    def _near(self, y, tangent, new, ahead, size):
        """Is the chord on the map short and flat enough, and does the tangent turn little?"""
        if not _turn(tangent / size, ahead / size) < TURN:
            return False
        one, two = (
            self._on_map(coordinate, along) for coordinate, along in ((y, tangent), (new, ahead))
        )
        chord = np.hypot(*(self.positions(new[None]) - self.positions(y[None]))[0])
        bend = abs(one[0] * two[1] - one[1] * two[0]) / max(np.hypot(*one) * np.hypot(*two), 1e-300)
        flat = chord * bend <= 8.0 * FLAT or chord <= FLAT
        return chord <= LONGEST and flat and (one @ two >= 0.0 or chord <= CUSP)

    def _on_map(self, y, tangent):
        """The tangent's direction on the map."""
        low, high = y - 1e-6 * tangent, y + 1e-6 * tangent
        return np.subtract(*self.positions(np.stack([high, low])))

    def _closed(self, seed, first, y, new, ahead):
        """Is the curve back at its seed?"""
        a, b, s = self.positions(np.stack([y, new, seed]))
        chord = b - a
        share = (s - a) @ chord / max(chord @ chord, 1e-300)
        if not 0.0 <= share <= 1.0 or abs(a + share * chord - s).max() > FLAT + 0.1 * np.hypot(
            *chord
        ):
            return False
        own = y + share * (new - y)
        n = self.own.n
        if self.own.free:
            alike = (
                abs(own[self.own.period_at] - seed[self.own.period_at])
                <= 0.01 * seed[self.own.period_at]
            )
        else:
            alike = (abs(own[:n] - seed[:n]) <= 0.01 * abs(seed[:n]).max() + abs(new - y)[:n]).all()
        return bool(alike) and self._on_map(seed, first) @ self._on_map(new, ahead) > 0.0

    def _end(self, y, new, back):
        """([the last point], [its border]) if the curve leaves the map before `new`, or turns
        `back` where its complex pair meets, at an angle of 0 or pi.
        """
        goals = []
        at, end = self.positions(np.stack([y, new]))
        ends = np.stack([self.square.low, self.square.high])
        for k in range(2):
            if not 0.0 <= end[k] <= 1.0:
                side = float(end[k] > 1.0)
                goals.append(
                    (
                        (side - at[k]) / (end[k] - at[k]),
                        self.own.parameters_at + k,
                        ends[int(side), k],
                        k,
                    )
                )
        if self.own.kind == NEIMARK_SACKER and back:
            before, after = y[self.own.angle_at], new[self.own.angle_at]
            nearest = np.pi * np.round(0.5 * (before + after) / np.pi)
            if min(abs(before - nearest), abs(after - nearest)) <= NEAREST:
                return [], []
            if (before - nearest) * (after - nearest) < 0.0:
                angle = nearest + np.copysign(NEAREST, before - nearest)
                goals.append(((angle - before) / (after - before), self.own.angle_at, angle, -1))
        if not goals:
            return None
        share, coordinate, value, border = min(goals)
        guess = y + share * (new - y)
        guess[coordinate] = value
        last, good = self.points.solved(
            guess[None], *self.points.held(guess[None], np.array([coordinate]))
        )
        last[0, coordinate] = value
        here = self.positions(last)[0]
        if not good[0] or not ((here > -1e-9) & (here < 1 + 1e-9)).all():
            return [], []
        return [last[0]], [border]


def _turn(a, b):
    return np.arccos(np.clip(a @ b / np.sqrt((a @ a) * (b @ b)), -1.0, 1.0))
