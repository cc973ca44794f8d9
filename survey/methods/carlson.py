"""Closed forms of nutations by Carlson's R_F, R_J and duplication: a few dozen square roots.

Domain: every motion between turning points. Precessions that nearly cancel keep an absolute
accuracy only.

Source: B. C. Carlson, Numer. Algorithms 10 (1995) 13-26; formulas (S5), (S6), (S14), (S22) of
`scenes/brun.md`.
"""

from math import cos, hypot, pi, sin, sqrt

from survey.kernels.jit import inline, kernel
from survey.kernels.math.carlson import rf_complete, rj, rj_spread
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.nutation import records as rc
from survey.kernels.nutation import wells as nu
from survey.kernels.nutation.action import ROUGH, action
from survey.kernels.nutation.motion import first_kind, motion

ORDER = 0  # no steps
SERVES = ("nutation",)
_STEPS = 60


@inline
def _advance(gap, near, far, width, q, time, s, g, spread):
    """(b -+ a) J/A (S6): J has its turning point far from the pole as origin; `time` is R_F."""
    if gap == 0.0:
        return 0.0
    third = rj_spread(0.0, s, g, spread, q * near / far)
    return gap * (2.0 * time / far + 2.0 * width * q / (3.0 * far * far) * third)


@inline
def _second_kind(first, y, z, g):
    """R_G(0, X, Y), g^2 = X Y, from `first` = R_F and the means of sqrt X, sqrt Y, squared (DLMF
    19.22.2, 19.21.10).
    """
    y, z = max(y, z), min(y, z)
    return (z - 0.5 * g) * first + z * (y - z) / 3.0 * rj(0.0, 0.5 * (y + z), sqrt(y) * sqrt(z), z)


@inline
def _periods_of(row, out):
    """See `agm._periods_of`."""
    width = row[nu.WIDTH]
    low, high = row[nu.Q_LOW], row[nu.Q_HIGH]
    g = sqrt(low) * sqrt(high)
    s, spread, above = row[nu.MIDDLE], nu.spread(row), nu.above(row, g)
    time = rf_complete(above, g)
    up = _advance(
        row[nu.MINUS], row[nu.HIGH_PLUS], row[nu.LOW_PLUS], width, low, time, s, g, spread
    )
    down = _advance(
        row[nu.PLUS], row[nu.LOW_MINUS], row[nu.HIGH_MINUS], width, high, time, s, g, spread
    )
    noise = row[nu.NOISE_LOW] + row[nu.NOISE_HIGH] + row[nu.NOISE_ABOVE]
    out[rc.PERIOD], out[rc.PRECESSION], out[rc.SPIN] = 4.0 * time, up + down, down - up
    out[rc.PERIOD_BAR] = (32.0 * ROUNDOFF + noise) * out[rc.PERIOD]
    # here, unlike in agm, the distances from poles enter the advances through these alone
    noise += 0.5 * row[nu.NOISE_ENDS]
    out[rc.PRECESSION_BAR] = out[rc.SPIN_BAR] = (48.0 * ROUNDOFF + 4.0 * noise) * (
        abs(up) + abs(down)
    )
    square = _second_kind(time, 0.5 * above, g, g)
    parts = out[rc.PERIOD] * row[nu.LEVEL], 4.0 * square, row[nu.MINUS] * up, row[nu.PLUS] * down
    out[rc.ACTION] = (parts[0] + parts[1] - parts[2] - parts[3]) / (2.0 * pi)
    size = abs(parts[0]) + parts[1] + abs(parts[2]) + abs(parts[3])
    out[rc.ACTION_BAR] = (48.0 * ROUNDOFF + 4.0 * noise) * size / (2.0 * pi)
    if out[rc.ACTION_BAR] > ROUGH * abs(out[rc.ACTION]):
        out[rc.ACTION], out[rc.ACTION_BAR] = action(row)


@kernel
def nutation_periods(rows, kinds, tolerance, out):
    """See `agm.nutation_periods`."""
    for i in range(len(rows)):
        if kinds[i] >= nu.NUTATION:
            _periods_of(rows[i], out[i])


@inline
def _cosine(z, kc, quarter, pairs, last):
    """As `agm._cosine`: F(chi) = z by Newton's method, from the side where F, convex or concave,
    lets it be monotone.

    chi and pi/2 - chi, each with all its digits: next to a separatrix c = cos chi is as small as
    k'.
    """
    over = z > quarter
    z = 2.0 * quarter - z if over else z
    chi = min(z, 0.5 * pi)
    rest = 0.5 * pi - chi
    for _ in range(_STEPS):
        sine, c = (cos(rest), sin(rest)) if rest < chi else (sin(chi), cos(chi))
        delta = hypot(c, kc * sine)
        move = (first_kind(sine, c, kc) - z) * delta
        move = min(max(move, -rest), chi)
        chi, rest = chi - move, rest + move
        if abs(move) <= 1e-15 * min(chi, delta):
            break
    sine, c = (cos(rest), sin(rest)) if rest < chi else (sin(chi), cos(chi))
    low, high = 0.5 * (1.0 + c), 0.5 * sine * sine / (1.0 + c)
    return (high, low, -c) if over else (low, high, c)


@kernel
def nutation_motions(rows, kinds, starts, periods, times, out):
    """See `agm.nutation_motions`."""
    for i in range(len(rows)):
        if kinds[i] >= nu.NUTATION:
            motion(_cosine, rows[i], starts[i], periods[i], times[i], out[i])
