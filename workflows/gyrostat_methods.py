"""Where the gyrostat's methods fail: the true error of each over planes with separatrices, turning points, stiffness.

    python workflows/gyrostat_methods.py [-o results]

Needs mpmath: pip install -e ".[test]". The truth is the flow (57) in double-double arithmetic (some 31 digits): a Taylor
series of its own, solved twice with other orders and steps, and checked against mpmath's trajectories.
"""

# ruff: noqa: E501  (the page's lines)
import json
import math
from dataclasses import dataclass
from importlib.resources import files

import matplotlib.pyplot as plt
import mpmath as mp
import numpy as np
import xarray as xr
from matplotlib.colors import BoundaryNorm
from matplotlib.patches import Patch
from script import parser, say

import survey
from survey import methods, modules
from survey.kernels.cylinder.flow import coefficients, longest_step
from survey.kernels.jit import fresh
from survey.kernels.math.double import add, convolved, mul, over, sub, times

RTOL, GREY = 1e-10, "#c8c8c8"
SIX = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)
NAMES = ("b12", "b31", "d", "c23", "s2", "s3")
OK, TURNING = 0, 16  # of `status`, and of the truth
METHODS = ("closed", "taylor", "dop853", "rk4", "full", "auto")
FINE, COARSE = (30, 1e-33), (25, 1e-32)  # order and truncation per step of the two references
LIMIT = 400_000

# the truth: a state is phi, w, sin phi, cos phi, each a pair (hi, lo); T[q, hi or lo, n] its series in t
PHI, W, SIN, COS = range(4)


@fresh
def expand(p, T, order):
    """Fill T from its first column."""
    for n in range(order):
        cw, sw = convolved(T[COS], T[W], n), convolved(T[SIN], T[W], n)
        cs, ss = convolved(T[COS], T[SIN], n), convolved(T[SIN], T[SIN], n)
        double = add((1.0 if n == 0 else 0.0, 0.0), times(ss, -2.0))  # cos 2 phi
        s, c = (T[SIN, 0, n], T[SIN, 1, n]), (T[COS, 0, n], T[COS, 1, n])
        rate = add(times(cw, p[0]), times(sw, -p[1]))
        rate = add(rate, add(times(cs, -p[2]), times(double, -p[3])))
        rate = add(rate, add(times(c, p[4]), times(s, -p[5])))
        T[PHI, 0, n + 1], T[PHI, 1, n + 1] = over((T[W, 0, n], T[W, 1, n]), n + 1.0)
        T[W, 0, n + 1], T[W, 1, n + 1] = over(rate, n + 1.0)
        T[SIN, 0, n + 1], T[SIN, 1, n + 1] = over(cw, n + 1.0)
        T[COS, 0, n + 1], T[COS, 1, n + 1] = over(sw, -(n + 1.0))


@fresh
def value(T, q, dt):
    """Quantity q at dt (a pair) after the start of the step."""
    order = T.shape[2] - 1
    v = (T[q, 0, order], T[q, 1, order])
    for n in range(order - 1, -1, -1):
        v = add(mul(v, dt), (T[q, 0, n], T[q, 1, n]))
    return v


@fresh
def slope(T, q, dt):
    """Derivative of quantity q, in float64: Newton's method needs no more."""
    v = 0.0
    for n in range(T.shape[2] - 1, 0, -1):
        v = v * dt[0] + n * T[q, 0, n]
    return v


@fresh
def reach(p, T, tolerance):
    """The step that keeps the last two terms below the tolerance, and w to one zero at most."""
    order = T.shape[2] - 1
    h = longest_step(p, T[W, 0, 0])
    for n in (order - 1, order):
        size = max(abs(T[W, 0, n]), max(abs(T[SIN, 0, n]), abs(T[COS, 0, n]))) + 1e-300
        h = min(h, (tolerance / size) ** (1.0 / n))
    return h


@fresh
def advance(T, dt):
    """Put the state at dt into the first column of T."""
    state = (value(T, PHI, dt), value(T, W, dt), value(T, SIN, dt), value(T, COS, dt))
    T[PHI, 0, 0], T[PHI, 1, 0] = state[0]
    T[W, 0, 0], T[W, 1, 0] = state[1]
    T[SIN, 0, 0], T[SIN, 1, 0] = state[2]
    T[COS, 0, 0], T[COS, 1, 0] = state[3]


@fresh
def in_time(p, T, abscissae, tolerance, out):
    """out[j] = phi, its low part, w, its low part at the ascending times abscissae[j] >= 0; NaN beyond LIMIT steps."""
    t, j = (0.0, 0.0), 0
    for _ in range(LIMIT):
        if j == len(abscissae):
            return
        expand(p, T, T.shape[2] - 1)
        h = reach(p, T, tolerance)
        while j < len(abscissae):
            dt = sub((abscissae[j], 0.0), t)
            if dt[0] > h:
                break
            out[j, 0], out[j, 1] = value(T, PHI, dt)
            out[j, 2], out[j, 3] = value(T, W, dt)
            j += 1
        advance(T, (h, 0.0))
        t = add(t, (h, 0.0))


@fresh
def zero(T, q, level, dt):
    """dt where quantity q is `level`: Newton's method, its last steps in pairs."""
    for _ in range(200):
        move = sub(value(T, q, dt), level)[0] / slope(T, q, dt)
        if not abs(move) > 1e-31 * (abs(dt[0]) + 1e-30):
            break
        dt = sub(dt, (move, 0.0))
    return dt


@fresh
def in_phi(p, T, abscissae, tolerance, out, codes):
    """out[j] = w, t (pairs) at the ascending angles abscissae[j], for w > 0; or phi, t of the turning point before it."""
    t, j = (0.0, 0.0), 0
    for _ in range(LIMIT):
        if j == len(abscissae):
            return
        expand(p, T, T.shape[2] - 1)
        h = (reach(p, T, tolerance), 0.0)
        turned = value(T, W, h)[0] <= 0.0
        if turned:
            h = zero(T, W, (0.0, 0.0), (h[0] * T[W, 0, 0] / (T[W, 0, 0] - value(T, W, h)[0]), 0.0))
        end = value(T, PHI, h)
        while j < len(abscissae) and sub((abscissae[j], 0.0), end)[0] <= 0.0:
            dt = zero(T, PHI, (abscissae[j], 0.0), (0.0, 0.0))  # phi is concave before a turning point: from below
            out[j, 0], out[j, 1] = value(T, W, dt)
            out[j, 2], out[j, 3] = add(t, dt)
            codes[j] = OK
            j += 1
        if turned:
            for i in range(j, len(abscissae)):
                out[i, 0], out[i, 1] = end
                out[i, 2], out[i, 3] = add(t, h)
                codes[i] = TURNING
            return
        advance(T, h)
        t = add(t, h)


def begun(phi0, w0, order):
    """An empty table with the state in its first column, sin and cos from mpmath."""
    T = np.zeros((4, 2, order + 1))
    with mp.workdps(40):
        for q, v in enumerate((mp.mpf(phi0), mp.mpf(w0), mp.sin(phi0), mp.cos(phi0))):
            T[q, 0, 0] = float(v)
            T[q, 1, 0] = float(v - T[q, 0, 0])
    return T


def truth(rows, abscissae, over_phi, accuracy=FINE):
    """Pairs (values, low parts), each (rows, columns, 2), and codes, for rows of eight numbers; abscissae ascend."""
    order, tolerance = accuracy
    out = np.full((*abscissae.shape, 4), np.nan)
    codes = np.zeros(abscissae.shape, dtype=np.int64)
    for row, at, o, code in zip(rows, np.ascontiguousarray(abscissae), out, codes, strict=True):
        p, T = coefficients(*row[:6]), begun(row[6], row[7], order)
        if over_phi:
            in_phi(p, T, at, tolerance, o, code)
        else:
            in_time(p, T, at, tolerance, o)
    return out[..., ::2], out[..., 1::2], codes


def checked(plane):
    """The truth of a plane, by FINE, and how far COARSE is from it: values, low parts, codes, differences."""
    high, low, codes = truth(plane.rows, plane.abscissae, plane.over_phi)
    other, rest, others = truth(plane.rows, plane.abscissae, plane.over_phi, COARSE)
    if not (np.isfinite(high).all() and np.array_equal(codes, others)):
        raise RuntimeError(f"{plane.name}: the reference is no reference")
    return high, low, codes, np.abs((high - other) + (low - rest))


def held():
    """Distances of the truth from trajectories that mpmath integrated in 48 digits, over 1 + |value|."""
    data = json.loads((files("survey.reference") / "gyrostat_trajectories.json").read_text())
    for case in (*data["trajectories"], *data["still"]):
        row = [float.fromhex(x) for x in (*case["p_hex"], case["phi0_hex"], case["w0_hex"])]
        high, low, _codes = truth(np.array([row]), np.array([[float(case["t"])]]), False)
        with mp.workdps(40):
            for k, name in enumerate(("phi", "w")):
                wanted = mp.mpf(case[name])
                yield float(abs(mp.mpf(high[0, 0, k]) + mp.mpf(low[0, 0, k]) - wanted) / (1 + abs(wanted)))


@dataclass(frozen=True)
class Axis:
    """An axis of a picture: its label, the number of its cells, and {cell: tick label}."""

    label: str
    size: int
    ticks: dict


@dataclass(frozen=True)
class Plane:
    """Solutions (rows of eight numbers) and the times or angles asked of each: a picture's points."""

    title: str
    x: Axis
    y: Axis
    rows: np.ndarray  # (n, 8)
    abscissae: np.ndarray  # (n, m), ascending along m
    across: str = ""  # the axis along which abscissae run, if they do
    over_phi: bool = False

    @property
    def name(self):
        return self.title.replace("$", "").replace("\n", " ")

    @property
    def question(self):
        return "abel" if self.over_phi else "trajectory"

    def picture(self, values):
        """Values of the points in the order of the picture (y, x)."""
        return values.T if self.across == "y" else values.reshape(self.y.size, self.x.size)


def system(phi0, w0, *six):
    """Rows of eight numbers, of what broadcasts."""
    return np.stack([a.ravel() for a in np.broadcast_arrays(*six, phi0, w0)], axis=-1).astype(float)


def plain(label, values):
    """An axis of even values."""
    some = np.linspace(0, len(values) - 1, 5).round().astype(int)
    return Axis(label, len(values), {i: f"{values[i]:.3g}" for i in some})


def logarithmic(label, exponents):
    """An axis of powers of ten, ticks at whole exponents."""
    whole = np.arange(math.ceil(exponents[0]), math.floor(exponents[-1]) + 1)
    whole = whole[:: max(1, len(whole) // 4)]
    at = np.interp(whole, exponents, np.arange(len(exponents)))
    return Axis(label, len(exponents), {i: f"$10^{{{k}}}$" for i, k in zip(at, whole, strict=True)})


def two_sided(label, exponents):
    """(axis, offsets): -10^e, e descending, then 10^e ascending; the middle of the axis is 0."""
    offsets = np.concatenate([-(10.0 ** exponents[::-1]), 10.0**exponents])
    size = len(exponents)
    few = round(0.5 * (exponents[0] + exponents[-1])), math.floor(exponents[-1])
    at = np.interp(few, exponents, np.arange(size))
    ticks = {size - 1 - i: f"$-10^{{{k}}}$" for i, k in zip(at, few, strict=True)} | {size - 0.5: "0"}
    return Axis(label, 2 * size, ticks | {size + i: f"$10^{{{k}}}$" for i, k in zip(at, few, strict=True)}), offsets


def separatrix(six, phi0, saddle):
    """w at phi0 on the separatrix of b = 0 that runs into the saddle next to `saddle`."""
    with mp.workdps(40):
        _b12, _b31, d, c23, s2, s3 = (mp.mpf(float(v)) for v in six)

        def V(x):
            return d / 2 * mp.sin(x) ** 2 + c23 / 2 * mp.sin(2 * x) - s2 * mp.sin(x) - s3 * mp.cos(x)

        def slope(x):
            return d / 2 * mp.sin(2 * x) + c23 * mp.cos(2 * x) - s2 * mp.cos(x) + s3 * mp.sin(x)

        top = mp.findroot(slope, saddle)
        return float(mp.sqrt(2 * (V(top) - V(mp.mpf(phi0)))))


def threshold(six, phi0, low, high):
    """w at phi0 between `low`, which turns back, and `high`, which passes the next turn: on a stable separatrix."""
    while low < (middle := 0.5 * (low + high)) < high:
        codes = truth(system(phi0, middle, *six), np.array([[phi0 + 2.0]]), True, COARSE)[2]
        low, high = (middle, high) if codes[0, 0] == TURNING else (low, middle)
    return low


def phase_plane(n=44):
    """Two wells, b = 0: all of its initial states."""
    phi0, w0 = np.linspace(-np.pi, np.pi, n), np.linspace(-3.0, 3.0, 3 * n // 4)
    rows = system(phi0, w0[:, None], 0, 0, *SIX[2:])
    return Plane(
        "b = 0: initial states,\n$t = 20$", plain("initial angle $\\varphi_0$", phi0),
        plain("initial velocity $w_0$", w0), rows, np.full((len(rows), 1), 20.0),
    )  # fmt: skip


def roots(n=16):
    """b = 0: two roots of w^2 merge on the separatrix, and a third where the saddle itself does (g = g' = 0)."""
    x, offsets = two_sided("distance to the separatrix, $w_0 - w_s$", np.linspace(-15.5, -0.5, n))
    gaps, phi0, place = np.linspace(-6.0, 0.0, n), 0.3, 2.0
    s, c, s2, c2 = math.sin(place), math.cos(place), math.sin(2 * place), math.cos(2 * place)
    d, c23, systems, speeds = 1.1, 0.3, [], []
    for gap in 10.0**gaps:  # g(place) = 0, g'(place) = gap
        a, b = d * c * s + c23 * c2, d * c2 - 2 * c23 * s2 + gap
        systems.append((0, 0, d, c23, a * c - b * s, -a * s - b * c))
        speeds.append(separatrix(systems[-1], phi0, place))
    rows = system(phi0, np.array(speeds)[:, None] + offsets, *np.array(systems).T[:, :, None])
    y = logarithmic("distance to a fold,\n$g'$ at the saddle", gaps)
    return Plane("b = 0: double and triple\nroots, $t = 20$", x, y, rows, np.full((len(rows), 1), 20.0))


def beside(n=16):
    """b != 0: how long solutions next to a stable separatrix keep their digits."""
    x, offsets = two_sided("distance to the separatrix, $w_0 - w_s$", np.linspace(-15.0, -0.5, n))
    t = np.linspace(1.0, 40.0, 30)
    rows = system(3.5, threshold(SIX, 3.5, 1.85, 1.86) + offsets, *SIX)
    return Plane(
        "b = (0.7, -0.4):\nbeside a separatrix", x, plain("time $t$", t), rows, np.tile(t, (len(rows), 1)), "y"
    )


def stiff(n=26):
    """On the invariant curve (61), w = mu F + 1 with mu = 1/2: from conservative to stiff."""
    b, t = np.linspace(-2.0, 3.0, n), np.linspace(-1.0, 2.0, 22)
    b12, b31 = 0.6 * 10.0**b, 0.8 * 10.0**b
    six = b12, b31, 0.25 * (b12 * b12 - b31 * b31), 0.25 * b12 * b31, -0.5 * b12, -0.5 * b31
    rows = system(0.5, 0.5 * (b12 * math.sin(0.5) + b31 * math.cos(0.5)) + 1.0, *six)
    return Plane(
        "on $w = F/2 + 1$, (61):\nfrom conservative to stiff", logarithmic(r"size of b, $\sqrt{b_{12}^2 + b_{31}^2}$", b), logarithmic("time $t$", t),
        rows, np.tile(10.0**t, (n, 1)), "y",
    )  # fmt: skip


def turning(six, phi0, limit, title, n=16):
    """Abel solutions: angles around the turning point, of solutions ever closer to the separatrix."""
    x, offsets = two_sided("distance to the turning point, $\\varphi - \\varphi_T$", np.linspace(-16.0, -1.0, n))
    gaps = np.linspace(-14.0, -1.0, 20)
    rows = system(phi0, limit - 10.0**gaps, *six)
    ends = truth(rows, np.full((len(rows), 1), np.inf), True, COARSE)[0][:, 0, 0]
    y = logarithmic("distance to the separatrix,\n$w_s - w_0$", gaps)
    return Plane(title, x, y, rows, np.sort(ends[:, None] + offsets, axis=1), "x", over_phi=True)


def planes(share=1.0):
    """All planes; a share below 1 makes them coarser."""
    n, still = round(16 * share), (0.0, 0.0, *SIX[2:])
    return {
        "phase": phase_plane(round(44 * share)),
        "roots": roots(n),
        "beside": beside(n),
        "stiff": stiff(round(26 * share)),
        "turning_still": turning(still, 0.3, separatrix(still, 0.3, 4.65), "b = 0: Abel solutions\nthat turn", n),
        "turning": turning(SIX, 3.5, threshold(SIX, 3.5, 1.85, 1.86), "b = (0.7, -0.4): Abel\nsolutions that turn", n),
    }


@dataclass(frozen=True)
class Comparison:
    """One method on one plane, arrays in the picture's order (y, x)."""

    error: np.ndarray  # largest true error of the two outputs over 1 + |value|; NaN where there is no answer
    ratio: np.ndarray  # largest true error over its bar
    doubtful: np.ndarray  # largest error of the truth over a bar
    missed: np.ndarray  # answered, but its bar misses RTOL
    wrong: np.ndarray  # reached where the solution has turned, or turned beyond the bar where it has not

    @property
    def answered(self):
        return ~np.isnan(self.error)

    @property
    def met(self):
        return self.answered & ~self.missed


def compared(plane, method, true, rtol=RTOL):
    """The errors of a method, or None if it does not support the question."""
    served = getattr(modules.load(methods, method, "method"), "WHEN", None) if method != "auto" else None
    if served and plane.question not in served["question"]:
        return None
    ds = asked(plane, method, rtol)
    status = ds.status.values
    names = ("w", "t") if plane.over_phi else ("phi", "w")
    turned = status == TURNING
    value, bar = ([ds[name + end].values for name in names] for end in ("", "_error"))
    high, low, codes, doubt = true
    if plane.over_phi:
        value, bar = (
            [np.where(turned, ds[f"{name}_turning{end}"].values, old) for name, old in zip(("phi", "t"), olds, strict=True)]
            for end, olds in (("", value), ("_error", bar))
        )  # fmt: skip
        # the last abscissa lies beyond the turning point
        high, low, doubt = (np.where(turned[..., None], part[:, -1:], part) for part in (high, low, doubt))
    value, bar = np.stack(value, axis=-1), np.stack(bar, axis=-1)
    error = np.abs((value - high) - low)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio, doubtful = (np.where(part > 0.0, part / bar, 0.0).max(axis=-1) for part in (error, doubt))
    early = turned & (codes == OK) & ~(np.abs(value[..., 0] - plane.abscissae) <= bar[..., 0])
    wrong = early | ((status == OK) & (codes == TURNING))
    kept = np.isin(status, (OK, TURNING))
    error = np.where(kept & ~wrong, (error / (1.0 + np.abs(high))).max(axis=-1), np.nan)
    missed = kept & (bar > rtol * (1.0 + np.abs(value))).any(axis=-1)
    ratio, doubtful = (np.where(np.isnan(error), 0.0, part) for part in (ratio, doubtful))
    return Comparison(*(plane.picture(part) for part in (error, ratio, doubtful, missed, wrong)))


def asked(plane, method, rtol):
    """The answers of `survey.evaluate`, (row, column)."""
    columns = {
        name: xr.DataArray(values, dims="row")
        for name, values in zip((*NAMES, "phi0", "w0"), plane.rows.T, strict=True)
    }
    abscissa = {"phi" if plane.over_phi else "t": xr.DataArray(plane.abscissae, dims=("row", "column"))}
    ds = survey.evaluate("gyrostat", question=plane.question, method=method, rtol=rtol, **columns, **abscissa)
    return ds.transpose("row", "column")


PAGE = """# Where methods fail

Made by `python workflows/gyrostat_methods.py`. Each method that answers `trajectory` or `abel` is asked, at rtol = {rtol:g}, for every
point of six planes; shown is the true error, the larger of its two outputs', over 1 + |value|. Parameters, where not said
otherwise: d = 1.1, c23 = 0.3, s2 = 0.5, s3 = -0.2.

The truth is (57) in double-double arithmetic by a Taylor series of its own (order {order}), which shares no step, series or
arithmetic with the methods. It is solved twice, with another order and other steps: the two differ by at most {differ:.0e} of
1 + |value| (next to separatrices and turning points, where errors grow), and by at most {doubtful:.0e} of any error bar below. From the
48 trajectories of 30 digits in `survey/reference` it differs by at most {mpmath:.0e}.

Hatched: the method's own error bar misses rtol. Grey: it gives no answer, and says why in `status`. {wrong} of {answers} answers say
that the solution has turned where it has not, or the other way round, and {outside} have
a true error beyond their bar: the largest is {ratio:.2g} of it.

![true errors of each method](gyrostat_methods.png)

{tables}

## The rule of `auto`

{rule}
"""
TABLE = """## {title}

| method | answers | meets rtol | median error | largest error | largest where it meets rtol | largest error / bar |
|---|---|---|---|---|---|---|
{rows}
"""
RULE = """1. A closed form where one applies. With b = 0 it meets rtol at {closed:.1%} of all states, with a median error of {closed_error:.0e} against
   {taylor_error:.0e} of `taylor`, and its cost is free of t. (61) holds for parameters to their rounding only, and what they miss grows
   with b t: it keeps its digits on {kept:.0%} of the plane from conservative to stiff.
2. Not where it loses its digits. Next to a separatrix two roots of w^2 merge: it misses rtol up to a distance of {near:.0e} (g' = 1
   at the saddle), or of {fold:.0e} where a third root is near (g' = 1e-6), mostly by its bar; `taylor` up to {taylor_near:.0e} and {taylor_fold:.0e}.
   Likewise next to a turning point. So `auto` goes by the bars: where the closed form has no answer, or its bar misses rtol,
   `taylor` is asked, and its answer taken if its bar is no wider.
3. No other method is needed. At {others} of {points} points `dop853`, `rk4` or `full` meets rtol where `taylor` does not; `auto` fails to
   meet it at {lost} points where any method does. `rk4` runs out of steps on stiff systems and of digits first, the error of `dop853` is
   {dop853:.1f} times that of `taylor` (median over all points), and `full` also pays for the instability of its set.
4. Near enough to a stable separatrix or a turning point every method in binary64 fails: errors grow there as the solutions
   themselves part; the bars and `status` say so. There `auto` solves in double-double arithmetic, and meets rtol again.
"""


def main():
    words = parser(__doc__, "the page and its picture")
    words.add_argument("--share", type=float, default=1.0, help="of the points along each axis: below 1 coarser")
    given = words.parse_args()
    folder = given.output
    say("planes")
    maps, true, results = planes(given.share), {}, {}
    for name, plane in maps.items():
        say(plane.name)
        true[name] = checked(plane)
        results[name] = {method: compared(plane, method, true[name]) for method in METHODS}
    (folder / "gyrostat_methods.md").write_text(page(maps, true, results))
    draw(maps, results, folder / "gyrostat_methods.png")
    print(folder / "gyrostat_methods.md", folder / "gyrostat_methods.png", sep="\n")


def page(maps, true, results):
    """The page's text."""
    every = [j for plane in results.values() for j in plane.values() if j]
    return PAGE.format(
        rtol=RTOL, order=FINE[0], mpmath=max(held()),
        differ=max((doubt / (1 + np.abs(high))).max() for high, _low, _codes, doubt in true.values()),
        doubtful=max(j.doubtful.max() for j in every), ratio=max(j.ratio.max() for j in every),
        wrong=sum(int(j.wrong.sum()) for j in every),
        outside=sum(int((j.ratio > 1).sum()) for j in every), answers=f"{sum(int(j.answered.sum()) for j in every):,}",
        tables="\n".join(table(maps[name], plane) for name, plane in results.items()), rule=rule(maps, results),
    )  # fmt: skip


def table(plane, results):
    rows = []
    for method, j in results.items():
        if j is None or not j.answered.any():
            why = "not its question" if j is None else "no closed form applies"
            rows.append(f"| {method} | {why} | | | | | |")
            continue
        best = f"{j.error[j.met].max():.0e}" if j.met.any() else ""
        rows.append(
            f"| {method} | {j.answered.mean():.1%} | {j.met.mean():.1%} | {np.nanmedian(j.error):.0e} | {np.nanmax(j.error):.0e}"
            f" | {best} | {j.ratio.max():.2g} |"
        )
    return TABLE.format(title=plane.name, rows="\n".join(rows))


def rule(maps, results):
    """The rule of `auto` with the figures that it is drawn from."""
    phase, stiffness = results["phase"], results["stiff"]
    others = lost = points = 0
    for plane in results.values():
        served = {method: j for method, j in plane.items() if j}
        rest = np.any([j.met for method, j in served.items() if method in ("dop853", "rk4", "full")], axis=0)
        others += int((rest & ~served["taylor"].met).sum())
        lost += int((np.any([j.met for j in served.values()], axis=0) & ~served["auto"].met).sum())
        points += rest.size
    both = [(plane["dop853"].error / plane["taylor"].error).ravel() for plane in results.values()]
    reached = {
        (method, k): furthest(maps["roots"], results["roots"][method], k)
        for method in ("closed", "taylor")
        for k in (-1, 0)
    }
    return RULE.format(
        closed=phase["closed"].met.mean(), closed_error=np.nanmedian(phase["closed"].error),
        taylor_error=np.nanmedian(phase["taylor"].error), kept=stiffness["closed"].met.mean(),
        near=reached["closed", -1], fold=reached["closed", 0], taylor_near=reached["taylor", -1],
        taylor_fold=reached["taylor", 0], others=others, points=f"{points:,}", lost=lost,
        dop853=np.nanmedian(np.concatenate(both)),
    )  # fmt: skip


def furthest(plane, results, line):
    """Largest distance to the separatrix at which a method misses rtol, on a line of the picture; 0 if it does not."""
    speeds = plane.rows[:, 7].reshape(results.met.shape)[line]
    middle = 0.5 * (speeds[len(speeds) // 2 - 1] + speeds[len(speeds) // 2])
    return np.abs(speeds - middle)[~results.met[line]].max(initial=0.0)


def draw(maps, results, path):
    """A row per plane, a column per method: log10 of the true error."""
    figure, axes = plt.subplots(len(maps), len(METHODS), figsize=(13, 2.15 * len(maps) + 0.8), layout="constrained")
    norm = BoundaryNorm(np.arange(-17, -3), 256, extend="both")
    for ax, method in zip(axes[0], METHODS, strict=True):
        ax.set_title(method, fontsize=11)
    for line, (name, plane) in zip(axes, maps.items(), strict=True):
        for i, (ax, method) in enumerate(zip(line, METHODS, strict=True)):
            shown = panel(ax, results[name][method], norm)
            ax.set_xticks(list(plane.x.ticks), list(plane.x.ticks.values()), fontsize=6.5)
            ax.set_yticks(list(plane.y.ticks), [] if i else list(plane.y.ticks.values()), fontsize=6.5)
            ax.set(xlim=(-0.5, plane.x.size - 0.5), ylim=(-0.5, plane.y.size - 0.5))
        line[0].set_ylabel(f"{plane.title}\n\n{plane.y.label}", fontsize=8)
        line[2].set_xlabel(plane.x.label, fontsize=8, x=1.05)
    label = r"true error over $1 + |\mathrm{value}|$, $\log_{10}$"
    figure.colorbar(shown, ax=axes, label=label, location="right", aspect=60, fraction=0.02, pad=0.01)
    handles = [Patch(facecolor=GREY, label="no answer"), Patch(facecolor="white", edgecolor="black", hatch="////", label=f"its error bar misses rtol = {RTOL:g}")]  # fmt: skip
    figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def panel(ax, j, norm):
    """One method on one plane; returns what a colour bar needs."""
    ax.set_facecolor(GREY)
    if j is None or not j.answered.any():
        why = "not its question" if j is None else "no closed form\napplies"
        ax.text(0.5, 0.5, why, transform=ax.transAxes, ha="center", va="center", fontsize=8)
        return None
    look = {"origin": "lower", "aspect": "auto", "interpolation": "nearest", "norm": norm, "cmap": "viridis"}
    shown = ax.imshow(np.log10(np.maximum(j.error, 1e-30)), **look)
    if j.missed.any():
        wide = np.pad(j.missed.astype(float), 1, mode="edge")
        at = [np.arange(-1, size + 1) for size in (j.missed.shape[1], j.missed.shape[0])]
        ax.contourf(*at, wide, levels=[0.5, 1.5], colors="none", hatches=["////"])
    return shown


if __name__ == "__main__":
    main()
