"""The gyrostat: separatrices, turning points, merging roots, stiffness, closed forms."""

import math

import mpmath as mp
import numpy as np

from survey.failures.plane import Plane, few, logarithmic, plain, two_sided
from survey.truth import gyrostat as true
from survey.truth import gyrostat_flow

ABOUT = """Parameters, where not said otherwise: d = 1.1, c23 = 0.3, s2 = 0.5, s3 = -0.2. `auto` takes a closed form
where one applies and its bar meets rtol: with b = 0 its cost is free of t, but next to a separatrix two roots of
w^2 merge, and it loses its digits first; (61) holds for parameters to their rounding only. Otherwise
`taylor` solves it, and is taken if its bar is no wider. Close enough to a stable separatrix or a turning point every
method in binary64 fails, as the solutions themselves separate; there `auto` solves in double-double."""
SOURCE = (
    "Truth: Taylor series of order 26 in double-double, solved twice where a bar seems to miss it."
)
NAMES = (*true.SYSTEM, "phi0", "w0")
SIX = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)


def planes(share):
    n, still = few(share, 16), (0.0, 0.0, *SIX[2:])
    return [
        _phase(few(share, 44)), _roots(n), _beside(n), _stiff(few(share, 26)),
        _turning(still, 0.3, _separatrix(still, 0.3, 4.65), "b = 0: Abel solutions\nthat turn", n),
        _turning(SIX, 3.5, _threshold(SIX, 3.5, 1.85, 1.86), "b = (0.7, -0.4): Abel\nsolutions that turn", n),
    ]  # fmt: skip


def _plane(title, x, y, question, six, phi0, w0, at):
    """`six`: numbers or arrays; `at`: times or angles, last in `given`."""
    given = dict(zip(NAMES, (*six, phi0, w0), strict=True)) | {
        "t" if question == "trajectory" else "phi": at
    }
    truth = true.flow if question == "trajectory" else true.along
    return Plane(title, x, y, "gyrostat", given, truth, SOURCE, {"question": question}, shared=True)


def _separatrix(six, phi0, saddle):
    """w at phi0 on the separatrix of b = 0 that runs into the saddle next to `saddle`."""
    with mp.workdps(40):
        _b12, _b31, d, c23, s2, s3 = (mp.mpf(float(v)) for v in six)

        def V(x):
            return (
                d / 2 * mp.sin(x) ** 2 + c23 / 2 * mp.sin(2 * x) - s2 * mp.sin(x) - s3 * mp.cos(x)
            )

        def slope(x):
            return d / 2 * mp.sin(2 * x) + c23 * mp.cos(2 * x) - s2 * mp.cos(x) + s3 * mp.sin(x)

        top = mp.findroot(slope, saddle)
        return float(mp.sqrt(2 * (V(top) - V(mp.mpf(phi0)))))


def _ends(six, phi0, w0, angle=1e9):
    """(phi where each solution of w0 (N) turns, True where it turns before `angle`)."""
    points = np.array([(*six, phi0, w, angle) for w in w0])
    out = np.empty((len(points), gyrostat_flow.COLUMNS))
    gyrostat_flow.along(points, 1e-30, out)
    return out[:, gyrostat_flow.VALUE], out[:, gyrostat_flow.TURNED] == 1.0


def _threshold(six, phi0, low, high):
    """w at phi0 between `low`, which turns back, and `high`, which passes the next turn: on a
    stable separatrix.
    """
    while low < (middle := 0.5 * (low + high)) < high:
        turns = _ends(six, phi0, [middle], phi0 + 2.0)[1][0]
        low, high = (middle, high) if turns else (low, middle)
    return low


def _phase(n):
    """Two wells, b = 0: all of its initial states."""
    phi0, w0 = np.linspace(-np.pi, np.pi, n), np.linspace(-3.0, 3.0, max(3 * n // 4, 3))
    axes = plain(r"initial angle $\varphi_0$", phi0), plain("initial velocity $w_0$", w0)
    six = (0.0, 0.0, *SIX[2:])
    return _plane(
        "b = 0: initial states,\n$t = 20$", *axes, "trajectory", six, phi0[None], w0[:, None], 20.0
    )


def _roots(n):
    """b = 0: two roots of w^2 merge on the separatrix, and a third where the saddle itself does (g
    = g' = 0).
    """
    x, away = two_sided("distance to the separatrix, $w_0 - w_s$", np.linspace(-15.5, -0.5, n))
    gaps, phi0, saddle_phi = np.linspace(-6.0, 0.0, n), 0.3, 2.0
    s, c, s2, c2 = (
        math.sin(saddle_phi),
        math.cos(saddle_phi),
        math.sin(2 * saddle_phi),
        math.cos(2 * saddle_phi),
    )
    d = 1.1
    c23 = 0.3
    systems = []
    speeds = []
    for gap in 10.0**gaps:  # g(saddle_phi) = 0, g'(saddle_phi) = gap
        a, b = d * c * s + c23 * c2, d * c2 - 2 * c23 * s2 + gap
        systems.append((0.0, 0.0, d, c23, a * c - b * s, -a * s - b * c))
        speeds.append(_separatrix(systems[-1], phi0, saddle_phi))
    y = logarithmic("distance to a fold,\n$g'$ at the saddle", gaps)
    six = (0.0, 0.0, d, c23, *(values[:, None] for values in np.array(systems).T[4:]))
    w0 = np.array(speeds)[:, None] + away[None]
    return _plane(
        "b = 0: double and triple\nroots, $t = 20$", x, y, "trajectory", six, phi0, w0, 20.0
    )


def _beside(n):
    """b != 0: how long solutions next to a stable separatrix keep their digits."""
    x, away = two_sided("distance to the separatrix, $w_0 - w_s$", np.linspace(-15.0, -0.5, n))
    t = np.linspace(1.0, 40.0, max(2 * n - 2, 3))
    w0 = _threshold(SIX, 3.5, 1.85, 1.86) + away[None]
    title = "b = (0.7, -0.4):\nbeside a separatrix"
    return _plane(title, x, plain("time $t$", t), "trajectory", SIX, 3.5, w0, t[:, None])


def _stiff(n):
    """On the invariant curve (61), w = mu F + 1 with mu = 1/2: from conservative to stiff."""
    b, t = np.linspace(-2.0, 3.0, n), np.linspace(-1.0, 2.0, max(n - 4, 3))
    b12, b31 = 0.6 * 10.0 ** b[None], 0.8 * 10.0 ** b[None]
    six = b12, b31, 0.25 * (b12 * b12 - b31 * b31), 0.25 * b12 * b31, -0.5 * b12, -0.5 * b31
    w0 = 0.5 * (b12 * math.sin(0.5) + b31 * math.cos(0.5)) + 1.0
    axes = logarithmic(r"size of b, $\sqrt{b_{12}^2 + b_{31}^2}$", b), logarithmic("time $t$", t)
    title = "on $w = F/2 + 1$, (61):\nfrom conservative to stiff"
    return _plane(title, *axes, "trajectory", six, 0.5, w0, 10.0 ** t[:, None])


def _turning(six, phi0, limit, title, n):
    """Abel solutions: angles around the turning point, of solutions ever closer to the separatrix."""
    x, away = two_sided(
        r"distance to the turning point, $\varphi - \varphi_T$", np.linspace(-16.0, -1.0, n)
    )
    gaps = np.linspace(-14.0, -1.0, max(n + 4, 3))
    w0 = limit - 10.0**gaps
    at = np.sort(_ends(six, phi0, w0)[0][:, None] + away[None], axis=1)
    y = logarithmic("distance to the separatrix,\n$w_s - w_0$", gaps)
    return _plane(title, x, y, "abel", six, phi0, w0[:, None], at)
