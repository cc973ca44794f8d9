"""Fates of many initial states of one system, by the side of the curves between basins on which
they lie.

The curves are found once, and so are the regions between them: in a region all motions end alike,
with as many turning points as those which they pass on their way through it. Each region is
followed from two starts, as `fate` follows every start; then a start takes what holds in its
region. Followed by themselves are the starts nearer to a curve than its error bar, and those of
regions that a curve may part which was cut off: windings that come too near to one another, as on
the way to an unstable cycle, or leave the range of the map.
"""

import math
import sys
import threading
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from survey.kernels.cylinder import basins as kb
from survey.kernels.cylinder import branches
from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import fate as kf
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder import returns as rt
from survey.kernels.cylinder.flow import BOUND_DG, BOUND_F, values
from survey.measures.cylinder import fate
from survey.status import OK

COARSE, FINE = 96, 384  # cells of a turn, about
FEW = 20_000  # pieces: as few are found again in fine cells
TOLERANCE = 1e-16  # truncation of one step
PIECES = 16_000, 96_000  # of one curve: the least and the greatest number at which it is cut off
LOOSE = 1e-3  # bar of a cycle, in the same units, beyond which fates are known only far from it
NARROWEST = 1e-9  # gaps, relative, in which fates are known
BACK = np.array([-1.0, -1.0, 1.0, 1.0, 1.0, 1.0])  # S1, see `solution`
SHARP = 1e-13  # error of a state that is no more than rounding beside the least bar of a piece
FEWEST = 1_000  # starts of one system: fewer are followed
# share of the time for all cycles that the fates of few starts take, as most need none
SELDOM = 0.08
SYSTEMS = 8  # whose curves are kept: on maps of more, blocks would find them again
_LOCK = threading.Lock()


@dataclass(frozen=True)
class Basins:
    """The curves of one system, and the fates (VERDICT to STATUS of `records`) of the gaps between
    their pieces.
    """

    p: np.ndarray
    breaks: np.ndarray
    numbers: np.ndarray  # of the first cell after each break
    edges: np.ndarray
    pieces: np.ndarray
    first: np.ndarray
    limits: np.ndarray
    fates: np.ndarray  # (gaps, FATE); UNDECIDED: to be followed

    def of(self, starts):
        """(fates (N, FATE), are they known?)"""
        gaps, turned = np.empty(len(starts), np.int64), np.empty(len(starts))
        kb.located(self.p, starts, self.breaks, self.numbers, self.edges, self.pieces, self.first, self.limits, gaps,
                   turned)  # fmt: skip
        out = self.fates[gaps]
        known = (gaps >= 0) & (out[:, rc.VERDICT] != kf.UNDECIDED)
        finite = known & (out[:, rc.NET_TURNS] != kf.NO_TURNS)
        out[finite, rc.NET_TURNS] += turned[finite]
        return out, known

    def fate_of(self, state):
        """The fate of a state (PHI to W_BAR of `records`) if it is known far better than the
        curves; else None.
        """
        if not state[rc.PHI_BAR] + state[rc.W_BAR] < SHARP * min(
            1.0, self.p[BOUND_F] + math.sqrt(self.p[BOUND_DG])
        ):
            return None
        out, known = self.of(np.ascontiguousarray(state[None, : rc.EXACT_START]))
        return out[0] if known[0] else None


@dataclass(frozen=True)
class StartRange:
    """What decides in a survey how far curves are followed: the number of starts of a system and their
    largest |w|.
    """

    starts: int
    fastest: float


def asked(request, names):
    """The StartRange of a request for fates of systems with the parameters `names`; None if they are few,
    or not known.
    """
    own = [request.lines.get(name) for name in ("phi0", "w0")]
    shared = [request.ranges.get(name) for name in ("phi0", "w0")]
    size = math.prod(line[0] for line in own if line) * max(
        (line[0] for line in shared if line), default=1
    )
    last = own[1] or shared[1]
    if not last or size < FEWEST:
        return None
    if any(shared) and not set(names) <= request.fixed:
        return None  # how many belong to one system depends on values
    if math.prod(request.lines[name][0] for name in names if name in request.lines) > SYSTEMS:
        return None
    return StartRange(size, max(abs(last[1]), abs(last[2])))


def cost(starts, each, system):
    """Seconds per start, of so many of one system: `each` where it is followed, `system` for the cycles."""
    if starts <= fate.FEW:
        return each + SELDOM * system / starts
    return (each if starts < FEWEST else 3e-6 + 0.2 / starts) + system / starts


def followed(method, six, s, starts, rtol, map_asked=None):
    """`fate.followed`, of as few starts as can be where the StartRange `map_asked` says that there are many."""
    basins = None
    if map_asked is not None and hasattr(method, "flow_pieces"):
        with _LOCK:  # threads that wait find it done
            basins = _remembered(
                method.__name__, tuple(float(value) for value in six), float(rtol), map_asked
            )
    if basins is None:
        return fate.followed(method, s, starts, rtol)
    out, known = basins.of(starts)
    if not known.all():
        out[~known] = fate.followed(method, s, starts[~known], rtol, basins.fate_of)
    return out


@lru_cache(maxsize=SYSTEMS)
def _remembered(method, six, rtol, map_asked):
    """The Basins of a system, or None; blocks of one survey share them."""
    return found(sys.modules[method], fate.remembered(sys.modules[method], six), rtol, map_asked)


def forget():
    """Forget all Basins, so that the next call is timed with its own."""
    _remembered.cache_clear()


def found(method, s, rtol, map_asked):
    """The Basins of the skeleton s, or None where each start must be followed."""
    scale = s.p[BOUND_F] + math.sqrt(s.p[BOUND_DG])
    if s.stratum != fate.G or s.unknown or s.folded or not s.conclusive or not len(s.equilibria):
        return None
    limits = _limits(s, scale)
    if limits is None:
        return None
    top = min(max(map_asked.fastest, scale), 0.5 * limits.min())
    most = min(max(2 * map_asked.starts, PIECES[0]), PIECES[1])
    for cells in (COARSE, FINE):
        breaks, numbers, edges = _lattice(s, cells)
        falls = (_forces(s.p, 0.5 * (edges[1:] + edges[:-1])) < 0.0).astype(np.int64)
        curves = list(_curves(method, s, edges, falls, scale, top, most))
        if any(curve is None for curve in curves):
            return None
        if sum(map(len, curves)) > FEW:
            break
    pieces = np.vstack([np.zeros((0, kb.PIECE)), *curves])
    ends = np.cumsum([0, *map(len, curves)])
    curve = np.repeat(np.stack([ends[:-1], ends[1:]], axis=1), np.diff(ends), axis=0)
    order = np.lexsort(
        (pieces[:, kb.OTHER], pieces[:, kb.REFERENCE], 2 * pieces[:, kb.CELL] + pieces[:, kb.SIDE])
    )
    pieces, curve = pieces[order], curve[order]
    keys = 2 * len(falls)
    first = np.zeros(keys + 1, np.int64)
    turning = np.zeros(keys, np.int64)
    resting = np.zeros(keys, np.int64)
    if not kb.numbers(pieces, falls, first, turning, resting):
        return None
    gaps = len(pieces) + keys
    links = np.zeros((2 * gaps + keys, kb.LINK), np.int64)
    seeds = np.zeros(len(curves) + 1, np.int64)
    size, cuts = kb.neighbours(pieces, order, curve, falls, first, turning, links, seeds)
    if size < 0:
        return None
    parent, turns, counts, loops = (
        np.zeros(shape, np.int64) for shape in (gaps, gaps, gaps, (gaps, kb.LOOPS))
    )
    open_ = np.zeros(gaps, dtype=bool)
    kb.regions(links, size, seeds, cuts, gaps, parent, turns, counts, loops, open_)
    joined = Regions(parent, turns, counts, loops, open_)
    fates = _fates(method, s, rtol, Lattice(edges, falls, pieces, first, limits, scale), joined)
    return Basins(s.p, breaks, numbers, edges, pieces, first, limits, fates)


@dataclass(frozen=True)
class Lattice:
    """Cells and the pieces in them; see `kernels.cylinder.basins`."""

    edges: np.ndarray
    falls: np.ndarray
    pieces: np.ndarray
    first: np.ndarray
    limits: np.ndarray
    scale: float


@dataclass(frozen=True)
class Regions:
    """What gap each belongs to, and how its fates differ from those there; see
    `kernels.cylinder.basins.regions`.
    """

    parent: np.ndarray
    turns: np.ndarray
    counts: np.ndarray
    loops: np.ndarray
    open_: np.ndarray


def _forces(p, angles):
    """g at the angles."""
    return np.array([values(p, angle)[1] for angle in angles])


def _limits(s, scale):
    """The |w| up to which the curves are known, for w > 0 and w < 0; None if not even the slow ones are."""
    limits = [math.inf, math.inf]
    for side, table in enumerate((s.plus, s.minus)):
        for row in table:
            if row[rt.CYCLE_BAR] > LOOSE * scale and row[rt.CYCLE_X] > 20.0 * scale:
                limits[side] = min(limits[side], 0.5 * row[rt.CYCLE_X])
            elif (
                row[rt.CYCLE_CLASS] < 0.0
                or row[rt.CYCLE_BAR] > LOOSE * scale
                or row[rt.BELOW] == row[rt.ABOVE]
            ):
                return None
    for row in s.librations:
        if row[rt.CYCLE_CLASS] < 0.0 or row[rt.CYCLE_BAR] > LOOSE or row[rt.BELOW] == row[rt.ABOVE]:
            return None
    return np.array(limits)


def _lattice(s, number):
    """Breaks (equilibria and the section, over one turn), the numbers of the first cells after
    them, edges of cells.
    """
    breaks = np.unique([*s.equilibria[:, eq.ANGLE], s.section % (2.0 * math.pi)])
    breaks = breaks[np.append(True, np.diff(breaks) > 1e-14)]
    breaks = np.append(breaks, breaks[0] + 2.0 * math.pi)
    cells = np.maximum(np.ceil(np.diff(breaks) * (number / (2.0 * math.pi))), 4).astype(np.int64)
    edges = [
        low + (high - low) / n * np.arange(n)
        for low, high, n in zip(breaks[:-1], breaks[1:], cells, strict=True)
    ]
    return breaks, np.append(0, np.cumsum(cells)), np.append(np.concatenate(edges), breaks[-1])


def _curves(method, s, edges, falls, scale, top, most):
    """The pieces of every curve that parts fates; None in place of one that cannot be followed."""
    p = fate.flow_of(fate.signed(s.p, BACK))
    eqs = s.equilibria.copy()
    for row, old in zip(eqs, s.equilibria, strict=True):
        eq.describe(p, old[eq.ANGLE], -old[eq.F], old[eq.DG], old[eq.BAR], row)
    out = np.empty((most, kb.PIECE))
    size = np.diff(edges)

    def followed(start, kind, cell):
        given = (
            p,
            start,
            edges,
            falls.astype(float),
            eqs,
            len(eqs),
            kind,
            cell,
            top,
            scale,
            TOLERANCE,
        )
        count = method.flow_pieces(*given, most, out)
        map_asked = count and (kind == kb.BRANCH or out[count - 1, kb.ENDING] == kb.CLOSES)
        return out[:count].copy() if map_asked else None

    for kind in (eq.SADDLE, eq.NODE):
        starts = np.zeros((2, rc.START))
        for row in eqs:
            if row[eq.KIND] != kind or (kind == eq.NODE and row[eq.F] <= 0.0):
                continue
            edge = int(np.argmin(np.abs(edges[:-1] - row[eq.ANGLE])))
            slope = 0.5 * (row[eq.F] + math.sqrt(row[eq.F] ** 2 + 4.0 * row[eq.DG]))
            reach = 0.25 * min(size[edge], size[edge - 1])
            branches.unstable(p, row[None], 1, starts, reach, kind)
            for side, at in ((-1, 0), (1, 1)):
                cell = edge if side > 0 else (edge - 1) % len(size)
                turn = 2.0 * math.pi if side < 0 and edge == 0 else 0.0
                start = np.array([*starts[at], edges[edge] + turn, row[eq.BAR], slope])
                start[rc.START_PHI] += turn
                if not np.isfinite(start).all():
                    yield None
                    return
                yield followed(start, kb.BRANCH, cell)
    for side, table in ((1.0, s.plus), (-1.0, s.minus), (0.0, s.librations)):
        for row in table:
            if row[rt.BELOW] > 0.0:  # it attracts
                continue
            if side:
                if row[rt.CYCLE_BAR] > LOOSE * scale:  # beyond the limits
                    continue
                edge = int(np.argmin(np.abs(edges[:-1] - s.section % (2.0 * math.pi))))
                start = np.array(
                    [edges[edge], -side * row[rt.CYCLE_X], 0.0, row[rt.CYCLE_BAR], 0.0, 0.0, 0.0]
                )
                yield followed(start, kb.ROTATION, edge)
                continue
            x = (row[rt.CYCLE_X] - edges[0]) % (2.0 * math.pi) + edges[0]
            cell = int(np.searchsorted(edges, x, side="right")) - 1
            start = np.array([x, 0.0, row[rt.CYCLE_BAR], 0.0, 0.0, 0.0, 0.0])
            yield followed(start, kb.LIBRATION, cell)


def _fates(method, s, rtol, lattice, regions):
    """The fate of a start, at turn 0, in every gap."""
    phi, w, width, key = _middles(lattice)
    width[regions.open_] = -1.0
    out = np.zeros((len(key), rc.FATE))
    out[:] = kf.UNDECIDED, -1, kf.UNDETERMINED, kf.NO_TURNS, OK
    # the widest gap of each region, and the widest on the other side of w = 0, or else the next one
    order = np.lexsort((-width, regions.parent))
    regions_of, pairs = [], []
    for members in np.split(order, 1 + np.flatnonzero(np.diff(regions.parent[order]))):
        members = members[width[members] > NARROWEST]
        if len(members):
            others = members[key[members] % 2 != key[members[0]] % 2]
            regions_of.append(members)
            pairs.append(
                (members[0], others[0] if len(others) else members[min(1, len(members) - 1)])
            )
    if not pairs:
        return out
    pairs = np.array(pairs)
    rows = fate.followed(method, s, np.stack([phi[pairs], w[pairs]], axis=-1).reshape(-1, 2), rtol)
    rows = _moved(rows, -regions.turns[pairs.ravel()], -regions.counts[pairs.ravel()]).reshape(
        -1, 2, rc.FATE
    )
    for members, (one, two) in zip(regions_of, rows, strict=True):
        winds, counts = one[rc.NET_TURNS] != kf.NO_TURNS, one[rc.TURNINGS] >= 0
        loops = regions.loops[regions.parent[members[0]]]
        if (
            one[rc.VERDICT] == kf.UNDECIDED
            or not np.array_equal(one, two)
            or (winds and loops[kb.BY_TURNS])
        ):
            continue
        if (counts and loops[kb.BY_TURNINGS]) or one[rc.TURNINGS] == kf.UNDETERMINED:
            continue
        out[members] = _moved(
            np.tile(one, (len(members), 1)), regions.turns[members], regions.counts[members]
        )
    return out


def _middles(lattice):
    """phi and w in the middle of every gap, at its reference edge; its relative width; 2 cell + side."""
    first, pieces = lattice.first, lattice.pieces
    key = np.repeat(np.arange(len(first) - 1), np.diff(first) + 1)
    rank = np.arange(len(key)) - key
    u = np.append(pieces[:, kb.REFERENCE], 0.0)
    low = np.where(rank > first[key], u[rank - 1], 0.0)
    high = np.where(rank < first[key + 1], u[np.minimum(rank, len(pieces))], low + lattice.scale)
    high = np.minimum(high, lattice.limits[key % 2])
    phi = lattice.edges[np.where(lattice.falls[key // 2] != 0, key // 2, key // 2 + 1)]
    return (
        phi,
        0.5 * (low + high) * np.where(key % 2 == 0, 1.0, -1.0),
        (high - low) / (lattice.scale + low),
        key,
    )


def _moved(rows, turns, counts):
    """Fates whose limits lie `turns` turns further, after `counts` turning points more."""
    rows = rows.copy()
    winds, counted = rows[:, rc.NET_TURNS] != kf.NO_TURNS, rows[:, rc.TURNINGS] >= 0
    rows[winds, rc.NET_TURNS] += turns[winds]
    rows[counted, rc.TURNINGS] += counts[counted]
    return rows
