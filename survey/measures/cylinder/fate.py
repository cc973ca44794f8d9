"""Fates of the flow phi' = w, w' = f w + g on the cylinder: the skeleton of a parameter point, then
each initial state.

The skeleton holds what decides fates: stratum, ends, equilibria, cycles of the return maps. It
depends on the six parameters alone and is computed once for all initial states.
"""

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import numpy as np

from survey import waiting
from survey.kernels.cylinder import borders as bo
from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import fate as kf
from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder import returns as rt
from survey.kernels.cylinder import taylor_double
from survey.kernels.cylinder.flow import BOUND_DG, BOUND_F, BOUND_G, OF_F, OF_G, coefficients
from survey.kernels.cylinder.flow_double import energy as energy_beside
from survey.kernels.cylinder.program import COLUMNS, MEAN
from survey.kernels.cylinder.steps import OK, SEPARATRIX, STEP_LIMIT
from survey.measures.cylinder import ends
from survey.measures.cylinder.solution import tolerances, trajectories

NO_TURNS = kf.NO_TURNS
I0, I1, I2, G = 0, 1, 2, 3  # strata
KINDS = PLUS, MINUS, LIBRATIONS = kf.NEEDS_PLUS, kf.NEEDS_MINUS, kf.NEEDS_LIBRATIONS  # of cycles
_NONE = np.zeros((0, rt.CYCLE_SIZE))
# starts of one system that are followed before its cycles are searched, which most may do without
FEW = 8
EXACT = 7e-16  # three ulp: K and L are 0 within the rounding of decimal parameters
STEPS = 20_000  # budget of one fate: about 15 ms
MORE = 10  # times the budget for those that use it up
MOST = 2_000_000  # steps in all
BATCH = 50  # fates per kernel call, so that a call stays below a second
# times, in those of the system, at which float64 takes over again
HANDED_OVER = np.geomspace(0.5, 2000.0, 28)
SELDOM = 3  # every third time only, where looking the fate up at every time did not settle it
MIRROR = np.array([1.0, -1.0, 1.0, -1.0, -1.0, 1.0])  # S2, see `solution`
MOST_OF_PROGRAM = 16  # equilibria
UNKNOWN, NO_ENDS = 21, 22  # as in the STATUS of scenes/gyrostat.py and of request/abel_scene.py
# rtol: with wider bars more fates stay open, and to decide these costs more than smaller steps
COARSEST = 1e-9
LEAST = 1e-6  # slowest rotation of the lattice, in velocities of the system
COLUMNS_OF = {
    "verdict": rc.VERDICT,
    "turnings": rc.TURNINGS,
    "net_turns": rc.NET_TURNS,
    "status": rc.STATUS,
}
LIMITS = [name + end for name in ("limit_phi", "limit_w", "multiplier") for end in ("", "_error")]
SAME = 1e-10  # relative: up to there w_c and w_d count as equal
FINE = 1e-16  # truncation per step for cycles, or the finest of the method


def empty(size, status):
    """The outputs of `solve` for `size` states, filled with what does not apply."""
    result = {name: np.full(size, np.nan) for name in LIMITS}
    for name, fill in (
        ("verdict", -1),
        ("turnings", kf.UNDETERMINED),
        ("net_turns", NO_TURNS),
        ("status", status),
    ):
        result[name] = np.full(size, fill, dtype=np.int64)
    return result


def solve(method, six, starts, rtol, result, where):
    """Fates at one parameter point, written into `result` (see `empty`) at the indices `where`."""
    s = remembered(method, six)
    write(s, followed(method, s, starts, rtol), starts, result, where)


def write(s, out, starts, result, where):
    """Write the fates `out` (VERDICT to STATUS of `records`) of the skeleton's starts into `result`."""
    for name, column in COLUMNS_OF.items():
        result[name][where] = out[:, column]
    for first, alike in _alike(out):
        limits(s, out[first], result, where[first])
        for name in LIMITS:
            result[name][where[alike]] = result[name][where[first]]
    wind(s, out, starts[:, rc.START_PHI], result, where)


def _alike(out):
    """(the first, where) of the fates with one verdict and one limit."""
    if out.shape[1] != rc.FATE:  # g = 0: each motion ends at an angle of its own
        yield from ((i, slice(i, i + 1)) for i in range(len(out)))
        return
    kinds = (64.0 * out[:, rc.VERDICT] + out[:, rc.LIMIT]).astype(np.int64)
    for kind in np.unique(kinds):
        alike = np.flatnonzero(kinds == kind)
        yield alike[0], alike


def wind(s, out, angles, result, where):
    """Write the net turns of fates that start at these angles."""
    middle = np.where(out[:, rc.NET_TURNS] != NO_TURNS, 0.0, np.nan) + _middles(s, out)
    turns = np.trunc((middle + 2.0 * math.pi * out[:, rc.NET_TURNS] - angles) / (2.0 * math.pi))
    known = np.isfinite(turns) & (out[:, rc.VERDICT] != kf.PERIODIC_LIBRATION)
    result["net_turns"][where[known]] = turns[known]


def followed(method, s, starts, rtol, fate_of=None):
    """`fates` of the skeleton s, solved again with a greater budget or finer steps where they are
    not decided.

    `fate_of` (see `basins`) gives the fate of a later state of the same motion, or None.
    """
    first, second = tolerances(method, min(rtol, COARSEST))
    out = fates(method, s, starts, first)
    for code, tolerance in ((STEP_LIMIT, first), (SEPARATRIX, second)):
        open_ = out[:, rc.STATUS] == code
        if open_.any():
            out[open_] = fates(method, s, starts[open_], tolerance, MORE)
    if (
        s.stratum not in (I0, I1) and starts.shape[1] == rc.EXACT_START and len(s.p) == COLUMNS
    ):  # no better than the bars of a start can its fate be
        for i in np.flatnonzero(out[:, rc.STATUS] == SEPARATRIX):
            _handed_over(method, s, starts[i], first, out[i], fate_of)
    return out


def _handed_over(method, s, start, tolerance, out, fate_of=None):
    """Follow one start in double-double past what float64 cannot decide, until its fate from there
    on is decided.
    """
    times = HANDED_OVER / (s.p[BOUND_F] + math.sqrt(s.p[BOUND_DG]) + abs(start[rc.START_W]))
    row = np.concatenate([s.p[: rc.SIX], start])[None]
    done = 0
    ways = ([fate_of] if fate_of else []) + [
        lambda state: fates(method, s, state[None], tolerance)[0]
    ]
    for later_of in ways:  # looking the fate up costs nothing, so that comes first, at every time
        for last in (10, 19, len(times)):  # most are decided early, and what comes later costs most
            floats, turnings, status = trajectories(taylor_double, row, times[None, :last], 0.0)
            states = list(zip(floats[0], turnings[0], status[0], strict=True))[done:]
            for state, turned, code in (
                states[SELDOM - 1 :: SELDOM] if fate_of and later_of is not fate_of else states
            ):
                later = later_of(state) if code == OK else None
                if later is not None and later[rc.VERDICT] != kf.UNDECIDED:
                    out[:] = later
                    if later[rc.TURNINGS] >= 0:
                        out[rc.TURNINGS] = (
                            later[rc.TURNINGS] + turned if turned >= 0 else kf.UNDETERMINED
                        )
                    return
            done = last
        done = 0


def _middles(s, out):
    """Angle that counts for net_turns: the equilibrium, or the middle of a libration cycle."""
    angles = np.full(len(out), np.nan)
    for first, alike in _alike(out):
        row = out[first]
        if row[rc.VERDICT] in (kf.EQUILIBRIUM, kf.EQUILIBRIUM_START) and row[rc.LIMIT] >= 0:
            angles[alike] = s.equilibria[int(row[rc.LIMIT]), eq.ANGLE]
        elif row[rc.VERDICT] == kf.LIBRATION:
            cycle = s.librations[int(row[rc.LIMIT])]
            angles[alike] = 0.5 * (cycle[rt.CYCLE_X] + cycle[rt.CYCLE_LEFT])
    return angles


def limits(s, row, result, i):
    """limit_phi, limit_w and multiplier of one fate."""
    verdict, index = int(row[rc.VERDICT]), int(row[rc.LIMIT])
    phi = w = cycle = None
    if verdict in (kf.EQUILIBRIUM, kf.EQUILIBRIUM_START):
        angle, bar = (
            (s.equilibria[index, eq.ANGLE], s.equilibria[index, eq.BAR])
            if index >= 0
            else row[rc.LIMIT_PHI :]
        )
        phi = angle % (2.0 * math.pi), bar
    elif verdict == kf.LIBRATION:
        cycle = s.librations[index]
        phi = cycle[rt.CYCLE_X], cycle[rt.CYCLE_BAR]
    elif verdict in (kf.ROTATION_PLUS, kf.ROTATION_MINUS):
        sign = 1.0 if verdict == kf.ROTATION_PLUS else -1.0
        cycle = (s.plus if sign > 0 else s.minus)[index]
        w = sign * cycle[rt.CYCLE_X], cycle[rt.CYCLE_BAR]
    if phi is not None:
        result["limit_phi"][i], result["limit_phi_error"][i] = phi[0], phi[1] + 1e-15
    if w is not None:
        result["limit_w"][i], result["limit_w_error"][i] = w
    if cycle is not None:
        result["multiplier"][i] = cycle[rt.MULTIPLIER]
        result["multiplier_error"][i] = cycle[rt.MULTIPLIER_BAR]


def remembered(method, six):
    """The skeleton of the parameter point `six`; blocks of one survey share it."""
    return _remembered(method.__name__, tuple(float(value) for value in six))


@lru_cache(maxsize=256)
def _remembered(method, six):
    return skeleton(sys.modules[method], six)


def forget():
    """Forget all skeletons, so that the next call is timed with its own."""
    _remembered.cache_clear()


@dataclass(frozen=True)
class Cycles:
    """Cycles of one kind, in a table as in `kernels.cylinder.returns`, and (w_c, w_d) of their map
    if they rotate.
    """

    table: np.ndarray
    threshold: tuple = (math.nan, math.nan)  # NaN where every turn from w > 0 is completed
    # do the signs of D fit together (so the parity law holds), and did every map answer?
    conclusive: bool = True


def _no_cycles(s, kind, above=0.0):
    return Cycles(_NONE)


@dataclass(frozen=True)
class Skeleton:
    """What decides the fates at one parameter point; tables as in `kernels.cylinder.equilibria` and
    `returns`.

    Cycles are searched when they are first asked for, as they take almost all of the time.
    """

    p: np.ndarray
    stratum: int
    K: float
    L: float
    ends: np.ndarray  # 1 attracting, 0 neutral, -1 repelling, for w -> +inf and w -> -inf
    section: float
    equilibria: np.ndarray
    # is an equilibrium degenerate, or so nearly that float64 hides it, and with it cycles?
    folded: bool
    unknown: bool = False  # does that hide how many equilibria there are?
    search: Callable = _no_cycles  # of this skeleton and a kind, the Cycles; see `_searched`
    found: dict = field(default_factory=dict)  # the Cycles by kind, as far as they are known

    def cycles(self, kind):
        """The Cycles of a kind: PLUS, MINUS or LIBRATIONS."""
        if kind not in self.found:
            self.found[kind] = self.search(self, kind)
        return self.found[kind]

    @property
    def plus(self):
        return self.cycles(PLUS).table

    @property
    def minus(self):
        return self.cycles(MINUS).table

    @property
    def librations(self):
        return self.cycles(LIBRATIONS).table

    @property
    def thresholds(self):
        """(w_c, w_d) of the two rotation maps."""
        return np.array([self.cycles(PLUS).threshold, self.cycles(MINUS).threshold])

    @property
    def conclusive(self):
        """Are the Cycles of all kinds conclusive?"""
        return all(self.cycles(kind).conclusive for kind in KINDS)


def sizes(b12, b31, d, c23, s2, s3):
    """Sums of the magnitudes of the terms of K and of L."""
    b = math.hypot(b12, b31)
    return abs(b12 * s3) + abs(b31 * s2), math.pi * (abs(c23) * b * b + abs(d * b12 * b31))


def constants(b12, b31, d, c23, s2, s3):
    """K and L, which decide the ends; 0 where they vanish within rounding."""
    K = b12 * s3 - b31 * s2
    L = 0.5 * math.pi * (c23 * (b12 * b12 - b31 * b31) - d * b12 * b31)
    return tuple(
        0.0 if abs(value) <= EXACT * size else value
        for value, size in zip((K, L), sizes(b12, b31, d, c23, s2, s3), strict=True)
    )


def stratum_of(b12, b31, d, c23, s2, s3):
    """I0: g = 0, I1: b = 0, I2: K = L = 0, and the rest G."""
    if d == c23 == s2 == s3 == 0.0:
        return I0
    if b12 == b31 == 0.0:
        return I1
    return I2 if constants(b12, b31, d, c23, s2, s3) == (0.0, 0.0) else G


def skeleton(method, six):
    """The skeleton of one parameter point (six numbers)."""
    s = outline(six)
    return replace(s, search=partial(_searched, method)) if s.stratum == G and not s.unknown else s


def _searched(method, s, kind, above=0.0):
    """The Cycles of a kind, rotations from that velocity on."""
    if kind == LIBRATIONS:
        return _librations(method, s.p, s.equilibria, s.folded)
    if kind == PLUS:
        return _rotations(method, s.p, s.equilibria, s.section, s.ends[0], s.K, s.L, above)
    mirrored = flow_of(signed(s.p, MIRROR))
    return _rotations(
        method, mirrored, mirrored_equilibria(s.equilibria), -s.section, s.ends[1], s.K, -s.L, above
    )


def flow_of(six):
    """The row p of the kernels for six parameters, or for a program, which is that row."""
    return np.ascontiguousarray(six if len(six) > COLUMNS else coefficients(*six[: rc.SIX]))


def signed(six, signs):
    return np.concatenate([np.asarray(six[: rc.SIX]) * signs, six[rc.SIX :]])


def _outline_of_program(p):
    """As `outline`: the strata in which no fate is decided are I0 for g = 0, I1 for f = 0, I2 for
    neutral ends.
    """
    known = ends.of(p)
    p[MEAN] = known.mean_f
    f_is_0, g_is_0 = p[BOUND_F] == 0.0, p[BOUND_G] == 0.0
    stratum = I0 if g_is_0 else I1 if f_is_0 else G if known.attract.all() else I2
    table = np.zeros((MOST_OF_PROGRAM, eq.EQUILIBRIUM_SIZE))
    count = eq.bisected(p, table) if not g_is_0 else 0
    eqs = table[: max(count, 0)]
    saddles = eqs[eqs[:, eq.KIND] == eq.SADDLE, eq.ANGLE]
    highest = float(saddles[np.argmax(ends.potential(p, saddles))]) if len(saddles) else 0.0
    section = highest - 2.0 * math.pi if highest > math.pi else highest
    return Skeleton(p, stratum, 0.0, 0.0, known.attract, section, eqs, count < 0, count < 0)


def outline(six):
    """The skeleton without cycles."""
    if len(six) > COLUMNS:
        return _outline_of_program(np.array(six, dtype=float))
    six = [float(value) for value in six[: rc.SIX]]
    p = np.ascontiguousarray(coefficients(*six))
    K, L = constants(*six)
    stratum = stratum_of(*six)
    sign = np.sign(K) if K != 0.0 else np.sign(L)
    ends = np.array([sign, sign if K != 0.0 else -sign])
    table = np.zeros((eq.MOST, eq.EQUILIBRIUM_SIZE))
    count, folded = eq.equilibria(p, table) if stratum != I0 else (0, False)
    eqs = table[:count]
    return Skeleton(p, stratum, K, L, ends, _section(p, eqs), eqs, folded)


def _section(p, eqs):
    """The saddle of highest V, in [-pi, pi]; 0 where there is none."""
    saddles = eqs[eqs[:, eq.KIND] == eq.SADDLE, eq.ANGLE] if len(eqs) else ()
    if not len(saddles):
        return 0.0
    d, c23, s2, s3 = p[OF_G]
    s, c = np.sin(saddles), np.cos(saddles)
    highest = saddles[np.argmax(0.5 * d * s * s + c23 * s * c - s2 * s - s3 * c)]
    return float(highest - 2.0 * math.pi if highest > math.pi else highest)


def mirrored_equilibria(eqs):
    """The equilibria under S2."""
    turned = eqs.copy()
    turned[:, eq.ANGLE] = -eqs[:, eq.ANGLE] % (2.0 * math.pi)
    return turned


def _rotations(method, p, eqs, section, end, K, L, above):
    """The Cycles with w > `above` of the flow p, ascending in w; conclusive only where these are all."""
    scale = p[BOUND_F] + math.sqrt(p[BOUND_DG])
    table, edges = np.zeros((rt.MOST_CYCLES, rt.CYCLE_SIZE)), np.zeros(rt.EDGES)
    fine = max(FINE, method.FLOW_FINEST)
    xs = scale * np.geomspace(LEAST, 30.0, 80)
    xs = xs[min(max(np.searchsorted(xs, above) - 1, 0), len(xs) - 2) :]
    places = borders(method, rt.ROTATION, p, eqs, section, fine)
    guesses = places[:, bo.PLACE].copy()
    given = rt.ROTATION, p, eqs, len(eqs), section, 0
    found = method.flow_cycles(*given, xs, guesses, fine, table, 0, edges)
    border, image, image_error = edges[rt.BORDER], edges[rt.IMAGE], edges[rt.IMAGE_ERROR]
    if border > 0.0 and len(places) and abs(places[-1, bo.PLACE] - border) <= SAME * border:
        border = places[-1, bo.PLACE]
        behind = _behind(method, p, eqs, section, int(places[-1, bo.OF]), fine)
        image, image_error = (behind, 0.0) if behind >= 0.0 else (image, image_error)
    start, unknown = edges[rt.FIRST_CHANGE], edges[rt.UNANSWERED]
    top, change, error, last = xs[-1], edges[rt.LAST_CHANGE], edges[rt.LAST_ERROR], 0.0
    while (
        change * end < 0.0
        and abs(change) > 4.0 * error
        and top < 1e5 * scale
        and found < len(table) - 1
    ):
        last = np.sign(change)
        xs = top * np.array([1.0, 1.3, 1.7, 2.2, 3.0])
        before = found
        found = method.flow_cycles(*given, xs, guesses, fine, table, found, edges)
        unknown += edges[rt.UNANSWERED]
        if found > before and (found - before) % 2:
            break
        top, change, error = xs[-1], edges[rt.LAST_CHANGE], edges[rt.LAST_ERROR]
    cycles = table[:found]
    last = np.sign(change) if abs(change) > error else last  # the last certain sign of D
    last = cycles[-1, rt.ABOVE] if found else last
    if last * end < 0.0 and K != 0.0:
        cycles = np.vstack([cycles, _far_cycle(p, section, K, L, scale)])
    # where every turn is completed, D tends to w_d > 0 as w -> 0: cycles below the lattice need w_d
    # below it too
    near = np.sign(start)
    if border > 0.0:
        # of a velocity w is w^2 known to the rounding of scale^2
        slower = max(min(border, image), 1e-300)
        error = image_error + SAME * border + 1e-14 * scale * scale / slower * (image > 0.0)
        near = np.sign(image - border) if abs(image - border) > error else math.nan
    sure = border > 0.0 or start > LEAST * scale
    sides = [near, *(cycles[:, rt.ABOVE])], [*cycles[:, rt.BELOW], end]
    fit = unknown == 0.0 and sure and found < len(table) - 2 and sides[0] == sides[1]
    return Cycles(cycles, (border, image), bool(fit))


def _behind(method, p, eqs, section, saddle, tolerance):
    """w_d, the limit of the images from above w_c, whose orbit tends to a saddle: w of its unstable branch
    on the section; NaN where that is lost.
    """
    angle = eqs[eqs[:, eq.KIND] == eq.SADDLE, eq.ANGLE][saddle]
    if abs(math.remainder(angle - section, 2.0 * math.pi)) < 1e-9:
        return 0.0
    out = np.empty((3 * len(eqs), bo.BORDER))
    mirrored = flow_of(signed(p, MIRROR)), mirrored_equilibria(eqs), len(eqs), -section
    found = method.flow_borders(rt.ROTATION, *mirrored, tolerance, out)
    own = out[:found, bo.PLACE][out[:found, bo.OF] == saddle]
    return own[0] if len(own) else math.nan


def borders(method, kind, p, eqs, section, tolerance):
    """Where a return map of the flow p ends, as in `kernels.cylinder.borders`, ascending."""
    if waiting.other_compiler:  # compile what comes next, while that process compiles this
        none, table = np.empty(0), np.empty((0, rt.CYCLE_SIZE))
        given = kind, p, eqs, len(eqs), section, 0, none, none, tolerance
        method.flow_cycles(*given, table, 0, np.empty(rt.EDGES))
        waiting.wait("borders")
    back, rests = p.copy(), eqs.copy()  # in reversed time
    back[OF_F] *= -1.0
    rests[:, eq.F] *= -1.0
    back.flags.writeable = p.flags.writeable
    out = np.empty((3 * len(eqs), bo.BORDER))
    found = method.flow_borders(kind, back, rests, len(eqs), section, tolerance, out)
    return out[np.argsort(out[:found, bo.PLACE])]


def _far_cycle(p, section, K, L, scale):
    """The large cycle w(0) ~ -L/(pi K) where the return map does not show it (D = pi K/w^2 + ...,
    below rounding).

    The expansion leaves a shift of the size of the velocities of the system, which the error bound
    covers.
    """
    b12, b31 = p[OF_F]
    w = -L / (math.pi * K) - 2.0 * b31 + b12 * math.sin(section) + b31 * math.cos(section) - b31
    w = max(w, 30.0 * scale)
    slope, side, bar = math.pi * K / w**3, np.sign(K), 10.0 * scale
    row = np.zeros(rt.CYCLE_SIZE)
    row[[rt.CYCLE_X, rt.CYCLE_BAR, rt.CYCLE_SPEED, rt.SPEED_BAR]] = w, bar, w, bar
    row[[rt.MULTIPLIER, rt.MULTIPLIER_BAR]] = 1.0 + slope, abs(slope) + 1e-15
    row[[rt.PERIOD, rt.PERIOD_BAR]] = 2.0 * math.pi / w, 2.0 * math.pi / w * bar / (w - bar)
    row[[rt.CYCLE_CLASS, rt.BELOW, rt.ABOVE]] = 1.0, -side, side
    return row


def _librations(method, p, eqs, folded):
    """The Cycles of librations, by their right turning point, of every interval where g < 0."""
    table = np.zeros((rt.MOST_CYCLES, rt.CYCLE_SIZE))
    edges = np.zeros(rt.EDGES)
    fine = max(FINE, method.FLOW_FINEST)
    found = 0
    share = 1.0 / (1.0 + np.exp(-np.linspace(-11.0, 11.0, 56)))
    sure = True
    places = borders(method, rt.LIBRATION, p, eqs, 0.0, fine)
    for i, row in enumerate(eqs):
        if row[eq.DG] < 0.0 and row[eq.KIND] != eq.DEGENERATE:
            if folded and eq.blurred(p, row[eq.ANGLE], row[eq.DG])[1]:
                continue  # in float64 motions beside it stand still
            high = eqs[i + 1, eq.ANGLE] if i + 1 < len(eqs) else eqs[0, eq.ANGLE] + 2.0 * math.pi
            xs = row[eq.ANGLE] + share * (high - row[eq.ANGLE])
            here = (places[:, bo.OF] == i) | np.isnan(places[:, bo.PLACE])
            guesses = places[here, bo.PLACE]
            found = method.flow_cycles(
                rt.LIBRATION, p, eqs, len(eqs), high, i, xs, guesses, fine, table, found, edges
            )
            against = (
                row[eq.KIND] == eq.FOCUS
                and edges[rt.FIRST_CHANGE] * row[eq.STABLE] < 0.0
                and abs(edges[rt.FIRST_CHANGE]) > edges[rt.FIRST_ERROR]
            )
            sure = sure and not against and edges[rt.UNANSWERED] == 0.0
    return Cycles(table[:found], conclusive=bool(sure and found < len(table) - 2))


def fates(method, s, starts, tolerance, more=1):
    """The fates (VERDICT to STATUS of `records`) of starts phi0, w0 (and their error bounds) of the
    skeleton s.
    """
    if len(s.p) > COLUMNS and (s.stratum != G or s.unknown):
        out = np.zeros((len(starts), rc.FATE))
        out[:] = (
            kf.UNDECIDED,
            -1,
            kf.UNDETERMINED,
            kf.NO_TURNS,
            NO_ENDS if s.stratum != G else UNKNOWN,
        )
        return out
    if s.stratum in (I0, I1):
        return (_free if s.stratum == I0 else _conservative)(s, starts)
    starts = np.pad(starts, ((0, 0), (0, 4 - starts.shape[1])))
    known = {kind: s.cycles(kind).table for kind in (KINDS if len(starts) > FEW else s.found)}
    run = partial(_by_tables, method, s, tolerance, more)
    waiting.wait("fates")
    out = run(known, starts)
    for kind in (PLUS, MINUS):
        rising = (_needs(out) == kind) & (out[:, rc.RISING_FROM] > 0.0)
        if rising.any():  # cycles below do not matter, and mostly there are none above
            above = s.search(s, kind, out[rising, rc.RISING_FROM].min()).table
            if not len(above):
                out[rising] = run(known | {kind: above}, starts[rising])
    while (needs := _needs(out)).any():
        kind = int(needs.min())
        known[kind] = s.cycles(kind).table
        out[needs == kind] = run(known, starts[needs == kind])
    return out


def _needs(out):
    """The kind of cycles that would decide each fate, or 0."""
    return np.where(
        (out[:, rc.VERDICT] == kf.UNDECIDED) & (out[:, rc.LIMIT] < -1), out[:, rc.LIMIT], 0
    )


def _by_tables(method, s, tolerance, more, known, starts):
    """`fates` by the equilibria and the tables of the `known` kinds of cycles alone."""
    out = np.zeros((len(starts), rc.FATE))
    section = s.section if s.stratum == G else math.atan2(*s.p[OF_F])
    tables = [
        np.ascontiguousarray(table)
        for table in (s.equilibria, *(known.get(kind, _NONE) for kind in KINDS))
    ]
    rows = [len(known[kind]) if kind in known else kf.NOT_KNOWN for kind in KINDS]
    stratum = kf.GENERIC if s.stratum == G else kf.REVERSIBLE
    sizes = np.array([len(s.equilibria), *rows, stratum, int(s.K < 0.0)])
    size = max(1, BATCH // (more * method.FLOW_WORK))
    limit = min(more * STEPS * method.FLOW_WORK, MOST)
    for i in range(0, len(starts), size):
        part = np.ascontiguousarray(starts[i : i + size])
        method.flow_fates(
            s.p, section, s.ends, sizes, *tables, part, tolerance, limit, out[i : i + size]
        )
    return out


def _free(s, starts):
    """g = 0: w - F is conserved and phi' = w on a line; every state with w = 0 is an equilibrium.

    There is no table of limits: LIMIT_PHI is the unwrapped angle that is reached.
    """
    b12, b31 = s.p[OF_F]
    b, axis = math.hypot(b12, b31), math.atan2(b12, b31)
    out = np.zeros((len(starts), rc.FREE_FATE))
    for row, (phi, w) in zip(out, starts, strict=True):
        y = w - b12 * math.sin(phi) - b31 * math.cos(phi)
        noise = 4e-16 * (abs(w) + b * (1.0 + abs(phi)))
        row[:] = kf.EQUILIBRIUM, -1, 0, kf.NO_TURNS, 0, np.nan, np.nan
        if w == 0.0:
            row[rc.VERDICT], row[rc.NET_TURNS] = kf.EQUILIBRIUM_START, 0
            row[rc.LIMIT_PHI], row[rc.LIMIT_PHI_BAR] = phi, 0.0
        elif abs(abs(y) - b) <= noise:
            row[rc.VERDICT], row[rc.TURNINGS], row[rc.STATUS] = (
                kf.UNDECIDED,
                kf.UNDETERMINED,
                SEPARATRIX,
            )
        elif abs(y) > b:
            row[rc.VERDICT] = kf.PERIODIC_ROTATION
        else:  # the next root of y + b cos(phi - axis)
            half = math.acos(-y / b)
            distances = [
                ((axis + side * half - phi) * np.sign(w)) % (2.0 * math.pi) for side in (1, -1)
            ]
            row[rc.LIMIT_PHI] = phi + np.sign(w) * min(distances)
            row[rc.LIMIT_PHI_BAR] = 2.0 * noise / math.sqrt(b * b - y * y) + 1e-15 * (
                1.0 + abs(row[rc.LIMIT_PHI])
            )
            row[rc.NET_TURNS] = math.trunc((row[rc.LIMIT_PHI] - phi) / (2.0 * math.pi))
    return out


def _above(p, phi, w, row):
    """Sign of the energy less that of the equilibrium `row`, in double-double; 0 where its error
    bound reaches 0.
    """
    gap, bar = energy_beside(p, phi, w, row[eq.ANGLE])
    bar += 0.5 * p[BOUND_DG] * row[eq.BAR] ** 2  # V' = 0 at the equilibrium
    return 0 if abs(gap) <= bar else math.copysign(1.0, gap)


def _conservative(s, starts):
    """b = 0: H = w^2/2 + V is conserved; rotation above the highest V, libration below, but for
    separatrices.
    """
    d, c23, s2, s3 = s.p[OF_G]

    def potential(phi):
        sin, cos = np.sin(phi), np.cos(phi)
        return 0.5 * d * sin * sin + c23 * sin * cos - s2 * sin - s3 * cos

    phi, w = starts.T
    energy = 0.5 * w * w + potential(phi)
    rest = s.equilibria[
        (s.equilibria[:, eq.KIND] == eq.SADDLE) | (s.equilibria[:, eq.KIND] == eq.DEGENERATE)
    ]
    levels = potential(rest[:, eq.ANGLE])
    noise = 4e-16 * (
        np.abs(energy) + w * w + (abs(d) + abs(c23) + abs(s2) + abs(s3)) * (1.0 + np.abs(phi))
    )
    near = (np.abs(energy[:, None] - levels) <= noise[:, None] + 1e-15).any(axis=1)
    rotates = energy > levels.max()
    for i in np.flatnonzero(near):
        above = [_above(s.p, phi[i], w[i], row) for row in rest]
        near[i], rotates[i] = 0 in above, min(above) > 0
    out = np.zeros((len(starts), rc.FATE))
    out[:, rc.VERDICT] = np.where(rotates, kf.PERIODIC_ROTATION, kf.PERIODIC_LIBRATION)
    out[:, rc.LIMIT] = -1
    out[:, rc.TURNINGS] = np.where(rotates, 0, kf.INFINITE)
    out[:, rc.NET_TURNS] = np.where(rotates, kf.NO_TURNS, 0)
    out[near, rc.VERDICT], out[near, rc.STATUS] = kf.UNDECIDED, SEPARATRIX
    out[near, rc.TURNINGS], out[near, rc.NET_TURNS] = kf.UNDETERMINED, kf.NO_TURNS
    for i in np.flatnonzero(w == 0.0):
        row = eq.resting(s.p, s.equilibria, len(s.equilibria), phi[i])
        if row >= 0:
            out[i] = (
                kf.EQUILIBRIUM_START,
                row,
                0,
                round((phi[i] - s.equilibria[row, eq.ANGLE]) / (2 * math.pi)),
                0,
            )
    return out
