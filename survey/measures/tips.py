"""Curves followed on from where a lattice loses them: into the tips of tongues, or up to the next
piece.

Inside a narrow tongue the function is a shallow valley, a parabola across whose zeros are the
tongue's two edges. Of the parabola through three values the zero with the curve's own slope is
taken, so that one edge is not mistaken for the other, and it is bracketed by certain signs, as all
points are. All ends take their steps together, each of its own length.
"""

import numpy as np

from survey.measures.hill.edges import close_in
from survey.measures.sampled import FLAT, LONGEST

LEAST = 1e-4  # of the map: a shorter step than this is the end
FITS = 3  # parabolas, one inside the other
MOST = 60  # steps
ENDS = 256  # that are followed, those of the longest pieces: where tongues crowd there are hundreds
SURE = 1e-6  # the widest bracket of a point, half of it, that is drawn
SAME = 1e-8  # how near one point is found again, besides the brackets
BESIDE = 1e-4  # of the map: a step that ends so near a piece of the same sense is on its curve


class _End:
    """An end of a piece: its outermost points, the one that is nearest to the end last, and the
    length of a step.
    """

    def __init__(self, x, error, sense):
        self.sense = sense  # 1 if pieces are positive on the same side as it, on its way out
        self.x = [*x]
        self.error = [*error]
        self.own = len(x)
        self.step = max(LEAST, min(np.hypot(*(x[-1] - x[-2])), 0.25 * LONGEST))
        self.going = True
        self.side = 0.0

    @property
    def ahead(self):
        back = next(
            p for p in self.x[-2::-1] if np.hypot(*(self.x[-1] - p)) > 0.1 * LEAST or p is self.x[0]
        )
        run = self.x[-1] - back
        return run / max(np.hypot(*run), 1e-300)

    @property
    def new(self):
        return np.array(self.x[self.own :]).reshape(-1, 2), np.array(self.error[self.own :])


def followed(function, pieces, grain, first=0):
    """The pieces [(positions (m, 2), errors (m))] of curves function(x) = 0, longer at ends inside
    the map; those before the `first` are left out, and no other is followed along them.

    Those that meet end to end are one. All pieces are positive on one side, as those of marching
    squares are, so that none is followed along another one; where one is not, as two points that
    have moved past each other, it is turned.
    """
    if not pieces:
        return []
    ends = [_End(x[::sense], error[::sense], sense) for x, error in pieces for sense in (-1, 1)]
    chords = np.concatenate([np.stack([x[:-1], x[1:]], axis=1) for x, _error in pieces])
    for k, end in enumerate(ends):
        tip = end.x[-1]
        end.going = k >= 2 * first and bool(((tip > 0.0) & (tip < 1.0)).all())
    for end in sorted((end for end in ends if end.going), key=lambda end: -end.own)[ENDS:]:
        end.going = False
    _sides(function, [end for end in ends if end.going])
    pieces = _turned(pieces, ends)
    for _ in range(MOST):
        going = [
            end
            for k, end in enumerate(ends)
            if end.going and not any(_faces(end, one) for one in ends[:k])
        ]
        if not going:
            break
        chords = _steps(function, going, ends, chords, grain)
    longer = []
    for i, (x, error) in enumerate(pieces):
        (before, before_error), (after, after_error) = (end.new for end in ends[2 * i : 2 * i + 2])
        longer.append(
            (
                np.concatenate([before[::-1], x, after]),
                np.concatenate([before_error[::-1], error, after_error]),
            )
        )
    return _merged(longer[first:])


def _merged(pieces):
    """The pieces, those one that end where another one and no third begins."""
    ends = np.array([x[[0, -1]] for x, _error in pieces]).reshape(-1, 2)
    widths = np.array([error[[0, -1]] for _x, error in pieces]).ravel()
    met = np.hypot(*(ends[:, None] - ends).T) <= SAME + widths[:, None] + widths
    np.fill_diagonal(met, False)
    partner = np.where(met.sum(axis=0) == 1, met.argmax(axis=0), -1)
    partner = np.where((partner >= 0) & (partner[partner] == np.arange(len(ends))), partner, -1)
    done = []
    left = set(range(len(pieces)))

    def chain(end):
        """The pieces from this end on: [(number, is it taken backwards?)]."""
        passed = []
        while end >= 0 and end // 2 in left:
            left.discard(end // 2)
            passed.append((end // 2, end % 2 == 1))
            end = partner[end ^ 1]
        return passed

    for end in [*np.flatnonzero(partner < 0), *range(len(ends))]:  # what closes has no first piece
        linked = chain(end)
        if linked and linked[0][1]:  # all keep their sense
            linked = [(number, not back) for number, back in linked[::-1]]
        parts = [
            tuple(one[::-1] if back else one for one in pieces[number]) for number, back in linked
        ]
        if parts:
            joined = [parts[0], *((x[1:], error[1:]) for x, error in parts[1:])]
            done.append(tuple(np.concatenate(one) for one in zip(*joined, strict=True)))
    return done


def _turned(pieces, ends):
    """The pieces, those turned that are positive on the other side than most; their ends with them."""
    sides = np.array([end.side * end.sense for end in ends])
    most = np.sign(sides @ [end.own for end in ends])
    turned = []
    for i, piece in enumerate(pieces):
        if most != 0.0 and (sides[2 * i : 2 * i + 2] == -most).all():
            piece = tuple(one[::-1] for one in piece)
            ends[2 * i : 2 * i + 2] = ends[2 * i + 1], ends[2 * i]
            ends[2 * i].sense, ends[2 * i + 1].sense = -1, 1
        turned.append(piece)
    return turned


def _sides(function, ends):
    """Note the sign of the function to the left of each end, on its way out; ends where it is open
    go nowhere.
    """
    if not ends:
        return
    width = np.array([max(10.0 * end.error[-1], 1e-9) for end in ends])
    left = np.array([[-end.ahead[1], end.ahead[0]] for end in ends])
    tips = np.array([end.x[-1] for end in ends])
    for _ in range(4):  # as far from the end as its sign needs
        values, bars = function(
            np.concatenate([tips + width[:, None] * left, tips - width[:, None] * left])
        )
        sign = np.where(abs(values) > bars, np.sign(values), 0.0).reshape(2, -1)
        for k, end in enumerate(ends):
            if end.side == 0.0 and sign[0, k] * sign[1, k] < 0.0:
                end.side = sign[0, k]
        width = 5.0 * width
    for end in ends:
        end.going = end.side != 0.0


def _steps(function, going, ends, chords, grain):
    """One step of all ends that are going; those that cannot take it try a shorter one next, or stop.

    `chords` (m, 2, 2): ends of those of the curves so far, in one sense; returned with the new ones.
    """
    goals, met = zip(*(_goal(end, ends) for end in going), strict=True)
    ahead, goals = np.array([end.ahead for end in going]), np.array(goals)
    axis = np.argmin(abs(ahead), axis=1)
    rows = np.arange(len(going))
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1)
    slope = np.array([end.side for end in going]) * np.sign(left[rows, axis])
    length = np.hypot(*(goals - [end.x[-1] for end in going]).T)

    def at(which, t):
        here = np.repeat(goals[which][:, None], t.shape[1], axis=1)
        here[np.arange(len(t)), :, axis[which]] = t
        value, bar = function(here.reshape(-1, 2))
        return value.reshape(t.shape), bar.reshape(t.shape)

    t, reach = zeros(at, goals[rows, axis].copy(), 0.2 * length, slope)
    found = np.isfinite(t)
    t[~found] = goals[rows, axis][~found]
    wide = np.where(found, np.maximum(0.1 * reach, 4.0 * grain), 1e-3)
    error, sure = np.full((2, len(going)), np.inf)
    some = np.flatnonzero(found)
    if some.size:
        t[some], error[some], certain = close_in(
            lambda which, x: at(some[which], x),
            t[some],
            wide[some],
            np.full(some.size, grain),
            LONGEST,
        )
        beyond, bars = at(some, (t[some] + error[some])[:, None])
        right = (beyond[:, 0] * slope[some] > 0.0) & (abs(beyond[:, 0]) > bars[:, 0])
        sure[some] = certain & right & (error[some] < SURE)
    inside = (t >= 0.0) & (t <= 1.0)
    off = abs(t - goals[rows, axis])
    known = [chords]
    for k, end in enumerate(going):
        if not end.going or (met[k] is None and end in met):  # another one has met it, or is to
            continue
        point = goals[k].copy()
        point[axis[k]] = t[k]
        other = met[k]
        bend = off[k] if other is None else 0.0  # a goal that is met is where the curve goes
        if (
            sure[k] != 1.0
            or not inside[k]
            or bend > 8.0 * FLAT + 0.1 * LEAST
            or off[k] > 0.5 * length[k]
            or _runs_along(end, point, np.concatenate(known))
        ):
            end.step *= 0.5
            end.going = end.step >= LEAST
            continue
        known.append(np.array([[end.x[-1], point][:: end.sense]]))
        end.x.append(point)
        end.error.append(error[k] + grain)
        if other is not None and off[k] <= SAME + error[k] + other.error[-1]:
            end.going = other.going = False
        elif ((point <= 0.0) | (point >= 1.0)).any():
            end.going = False
        elif bend < 2.0 * FLAT:
            end.step = min(1.5 * end.step, LONGEST)
    return np.concatenate(known)


def _meets(end, other, reach):
    """Is the tip of the other end, which comes from there, straight ahead of this one and not
    farther than `reach`? That of a tongue's other edge is not the same curve's.
    """
    if other.sense == end.sense:
        return False
    run, ahead = other.x[-1] - end.x[-1], end.ahead
    along = run @ ahead
    return (
        0.0 < along <= reach
        and np.hypot(*(run - along * ahead)) <= 0.2 * along
        and ahead @ other.ahead < 0.0
    )


def _runs_along(end, point, chords):
    """Does the step to the point end beside chords (m, 2, 2) that are taken in the same sense?"""
    run, chord = point - chords[:, 0], chords[:, 1] - chords[:, 0]
    square, share = (chord * chord).sum(axis=1), (run * chord).sum(axis=1)
    off = abs(run[:, 0] * chord[:, 1] - run[:, 1] * chord[:, 0])
    beside = (share > 0.0) & (share < square) & (off <= BESIDE * np.sqrt(square))
    return bool((beside & (end.sense * (chord @ (point - end.x[-1])) > 0.0)).any())


def _faces(end, other):
    """Would both pass each other in their next steps? Then one of them waits."""
    return (
        other.going
        and _meets(end, other, 1.3 * (end.step + other.step))
        and not _meets(end, other, 1.3 * end.step)
    )


def _goal(end, ends):
    """(where the next step leads to, the end of another piece that is met there, or None)."""
    tip, ahead = end.x[-1], end.ahead
    for other in ends:
        if other is not end and _meets(end, other, 1.3 * end.step):
            return other.x[-1], other
    goal = tip + end.step * ahead
    with np.errstate(all="ignore"):
        room = np.where(
            ahead > 0.0, (1.0 - tip) / ahead, np.where(ahead < 0.0, -tip / ahead, np.inf)
        )
    nearest = int(np.argmin(room))
    if room[nearest] < end.step:
        goal = tip + room[nearest] * ahead
        goal[nearest] = float(ahead[nearest] > 0.0)
    return goal, None


def zeros(at, t, reach, slope):
    """(zeros near t (n) at which functions have slopes of the signs `slope`, or NaN; within what
    they are known).
    """
    rows = np.arange(t.size)
    for _ in range(FITS):
        f, _bars = at(rows, t[:, None] + reach[:, None] * np.array([-1.0, 0.0, 1.0]))
        with np.errstate(all="ignore"):
            b, c = 0.5 * (f[:, 2] - f[:, 0]), 0.5 * (f[:, 2] + f[:, 0]) - f[:, 1]
            root = slope * np.sqrt(b * b - 4.0 * c * f[:, 1])
            zero = np.where(b * root > 0.0, -2.0 * f[:, 1] / (b + root), (root - b) / (2.0 * c))
            apart = abs(root / c)  # from the other zero
        zero = np.where(abs(zero) < 3.0, zero, np.nan)
        t = t + reach * zero
        reach = reach * np.clip(0.3 * np.nan_to_num(apart, nan=1.0, posinf=1.0), 1e-4, 0.3)
        lost = ~np.isfinite(t)
        if lost.all():
            break
        t, reach = np.where(lost, np.nan, t), np.where(lost, 1e-3, reach)
    return t, reach
