"""Closed forms of nutations by the arithmetic-geometric mean, the advances of pi split off: no
steps, a few means.

Domain: every motion between turning points; near separatrices and poles too. Bars are a few
roundings.

Source: DLMF 19.8(i), 19.22(ii); formulas (S5), (S10)-(S14), (S22) of `scenes/brun.md`.
"""

from math import copysign, log, pi, sqrt

from survey.kernels.jit import inline, kernel
from survey.kernels.math import double as dd
from survey.kernels.math.roundoff import ROUNDOFF
from survey.kernels.math.third_kind import mean, third, third_double
from survey.kernels.nutation import records as rc
from survey.kernels.nutation import wells as nu
from survey.kernels.nutation.action import ROUGH, action
from survey.kernels.nutation.motion import cosine_by_means, motion

ORDER = 0  # no steps
SERVES = ("nutation",)
_CANCELLED = 0.01  # advances that are a smaller part of their terms are computed in double-double
_FINE = 2.0**-94
_CLOSE = 0.1  # poles that are nearer, in units of a well's width, bound rates by nothing
# where the line through the roots of Q is lower at the pole, relative, pi is not split off
_SLANT = 0.25


@kernel
def _advance(gap, near, far, width, root_near, root_far, incline, q, bend, period, x, y):
    """(b -+ a) J/A, J the time integral of 1/(1 -+ u) over half a period (S11), (S13).

    As whole multiples of pi, the rest, and the size of its terms.
    """
    if gap == 0.0:
        return 0.0, 0.0, 0.0
    line = root_near + incline * near
    if line <= _SLANT * root_near:
        p = root_far * sqrt(near / far)
        half = 0.5 * (p + y * y / p)
        ratio = 1.0 + 0.5 * (p - y) * (p + y) / (p * p + y * y) * third(x, y, half * half)
        value = 0.5 * gap * period / far * (1.0 + 0.5 * width * ratio / near)
        return 0.0, value, abs(value)
    level = root_far * near + root_near * far
    ratio = third(x, y, q * (y / line) ** 2)
    second = 0.25 * level * bend * ratio / q
    part = 0.5 * gap * period / line
    return copysign(1.0, gap), part * (incline + second), abs(part) * (abs(incline) + abs(second))


@kernel
def _fine_part(gap, near, far, root_near, root_far, incline, bend, x, y):
    """What `_advance` splits off pi, times 2 / T, and the mean of x and y: pairs, in double-double."""
    line = dd.add(root_near, dd.mul(incline, near))
    q = dd.div(dd.mul(gap, gap), dd.mul(near, far))
    ratio = dd.div(y, line)
    ratio, middle = third_double(x, y, dd.mul(q, dd.mul(ratio, ratio)))
    level = dd.add(dd.mul(root_far, near), dd.mul(root_near, far))
    second = dd.times(dd.div(dd.mul(dd.mul(level, bend), ratio), q), 0.25)
    return dd.mul(dd.div(gap, line), dd.add(incline, second)), middle


@kernel
def _fine_parts(row):
    """The sum of the parts of both poles and their difference, where one of these is next to
    nothing (fast spin).
    """
    k = nu.pair(row, nu.K)
    total = nu.pair(row, nu.SUM)
    near = nu.pair(row, nu.Q_HIGH)
    far = nu.pair(row, nu.Q_LOW)
    high, low = dd.sqrt(near), dd.sqrt(far)
    g = dd.mul(high, low)
    above, n = dd.add(nu.pair(row, nu.MIDDLE), g), nu.pair(row, nu.BEND)
    if row[nu.MIDDLE] < 0.0:  # (S10)
        width = dd.sub(nu.pair(row, nu.LOW_PLUS), nu.pair(row, nu.HIGH_PLUS))
        rest = dd.times(dd.sub(g, nu.pair(row, nu.MIDDLE)), 4.0)
        above = dd.div(dd.mul(dd.mul(k, n), dd.mul(width, width)), rest)
    incline = dd.times(dd.div(dd.mul(k, total), dd.add(high, low)), 2.0)
    bend = dd.times(dd.div(dd.mul(k, n), above), 0.5)
    x, y = dd.sqrt(dd.times(above, 0.5)), dd.sqrt(g)
    plus = nu.pair(row, nu.MINUS), nu.pair(row, nu.HIGH_PLUS), nu.pair(row, nu.LOW_PLUS)
    minus = nu.pair(row, nu.PLUS), nu.pair(row, nu.LOW_MINUS), nu.pair(row, nu.HIGH_MINUS)
    up, middle = _fine_part(*plus, high, low, incline, bend, x, y)
    down, middle = _fine_part(*minus, low, high, dd.neg(incline), bend, x, y)
    return dd.add(down, up)[0] * (pi / middle[0]), dd.sub(down, up)[0] * (pi / middle[0])


@inline
def _shares(x, y):
    """What part of relative changes of x and of y, at most, their mean changes by (S23)."""
    least = 1.0 / log(4.0 * max(x, y) / min(x, y))
    return (least, 1.0) if x < y else (1.0, least)


@inline
def _rates(row, to_plus, to_minus):
    """2 psi' and 2 phi' (S4), less the drift, in size, where 1 - u and 1 + u are these."""
    up = row[nu.MINUS] / to_plus if row[nu.MINUS] != 0.0 else 0.0
    down = row[nu.PLUS] / to_minus if row[nu.PLUS] != 0.0 else 0.0
    return abs(down + up), abs(down - up)


@inline
def _blurred(row, roots, up, down, period, x, y):
    """Errors of precession and spin (S23) due to those of Q at the turning points and of s + g;
    advances up, down.
    """
    share = _shares(x, y)
    low = row[nu.NOISE_LOW]
    high = row[nu.NOISE_HIGH]
    above = row[nu.NOISE_ABOVE]
    full, rest, time = abs(up) + abs(down), min(x, y) / max(x, y), 0.5 * period
    if x < y:  # the motion is slow where Q is least
        to_plus = (row[nu.LOW_PLUS] * roots[1] + row[nu.HIGH_PLUS] * roots[0]) / (
            roots[0] + roots[1]
        )
        to_minus = (row[nu.LOW_MINUS] * roots[1] + row[nu.HIGH_MINUS] * roots[0]) / (
            roots[0] + roots[1]
        )
        psi, phi = _rates(row, to_plus, to_minus)
        generic, part = (low + high + rest * above) * full, share[0] * above * time
        return generic + part * psi, generic + part * phi
    if min(row[nu.HIGH_PLUS], row[nu.LOW_MINUS]) < _CLOSE * row[nu.WIDTH]:
        generic = (low + high + above) * full
        return generic, generic
    generic, part = (above + rest * (low + high)) * full, share[1] * time
    psi, phi = _rates(row, row[nu.LOW_PLUS], row[nu.LOW_MINUS])
    other_psi, other_phi = _rates(row, row[nu.HIGH_PLUS], row[nu.HIGH_MINUS])
    return generic + part * (low * psi + high * other_psi), generic + part * (
        low * phi + high * other_phi
    )


@inline
def _tilted(gap, near, root_near, incline, rest):
    """By what an advance changes with h of (S11): in units of T/2, which may cancel between the poles;
    and, in size, by the `rest` of it.
    """
    line = root_near + incline * near
    if line <= _SLANT * root_near:
        return 0.0, 0.0
    return gap / line, abs(rest) * near / line


@inline
def _periods_of(row, out):
    """T / A, the precession, the spin less a (1/C - 1/A) T, the action, and their bars; of one well."""
    root_low, root_high = sqrt(row[nu.Q_LOW]), sqrt(row[nu.Q_HIGH])
    g = root_low * root_high
    k, width, above = row[nu.K], row[nu.WIDTH], nu.above(row, g)
    x, y = sqrt(0.5 * above), sqrt(g)
    middle, series = mean(x, y)
    period = 2.0 * pi / middle
    incline = 2.0 * k * row[nu.SUM] / (root_low + root_high)
    bend = 0.5 * k * row[nu.BEND] / above
    plus = row[nu.MINUS], row[nu.HIGH_PLUS], row[nu.LOW_PLUS]  # for the pole u = 1
    minus = row[nu.PLUS], row[nu.LOW_MINUS], row[nu.HIGH_MINUS]
    turns_up, up, size_up = _advance(
        *plus, width, root_high, root_low, incline, row[nu.Q_PLUS], bend, period, x, y
    )
    turns_down, down, size_down = _advance(
        *minus, width, root_low, root_high, -incline, row[nu.Q_MINUS], bend, period, x, y
    )
    low, high = row[nu.NOISE_LOW], row[nu.NOISE_HIGH]
    noise, share = low + high + row[nu.NOISE_ABOVE], _shares(x, y)
    out[rc.PERIOD] = period
    out[rc.PERIOD_BAR] = (
        12.0 * ROUNDOFF + 0.5 * share[0] * row[nu.NOISE_ABOVE] + 0.25 * share[1] * (low + high)
    ) * period
    total, difference, size = down + up, down - up, size_up + size_down
    roots = root_low, root_high
    blur_psi, blur_phi = _blurred(
        row, roots, pi * turns_up + up, pi * turns_down + down, period, x, y
    )
    ends = 4.0 * row[nu.WIDTH] * (row[nu.NOISE_ENDS] + row[nu.NOISE_WIDTH])
    error, rounding = (24.0 * ROUNDOFF + ends) * size, 2.0 * ROUNDOFF
    # h has the error of ul + uh, which may be a large part of it in narrow wells
    tilt = abs(k) * row[nu.BAR_SUM] / (root_low + root_high)
    one, rest_up = _tilted(row[nu.MINUS], row[nu.HIGH_PLUS], root_high, incline, up)
    other, rest_down = _tilted(row[nu.PLUS], row[nu.LOW_MINUS], root_low, -incline, down)
    sizes = abs(one) + abs(other)
    more = tilt * (2.0 * (rest_up + rest_down) + 4.0 * ROUNDOFF * period * sizes)
    tilted_psi = tilt * period * abs(one - other) + more
    tilted_phi = tilt * period * abs(one + other) + more
    # without multiples of pi
    bare = abs(total) if turns_up + turns_down == 0.0 else abs(difference)
    if bare < _CANCELLED * size and turns_up * turns_down != 0.0:
        total, difference = _fine_parts(row)
        error, rounding = (_FINE + ends) * size, 12.0 * ROUNDOFF
    out[rc.PRECESSION], out[rc.SPIN] = (
        pi * (turns_down + turns_up) + total,
        pi * (turns_down - turns_up) + difference,
    )
    turned = 2.0 * ROUNDOFF * pi
    turned_psi = turned * abs(turns_down + turns_up)
    turned_phi = turned * abs(turns_down - turns_up)
    out[rc.PRECESSION_BAR] = (
        error + min(4.0 * noise * size, blur_psi) + tilted_psi + rounding * abs(total) + turned_psi
    )
    out[rc.SPIN_BAR] = (
        error
        + min(4.0 * noise * size, blur_phi)
        + tilted_phi
        + rounding * abs(difference)
        + turned_phi
    )
    up, down = row[nu.MINUS] * (pi * turns_up + up), row[nu.PLUS] * (pi * turns_down + down)
    rest = 0.5 * (0.5 * above - series)
    out[rc.ACTION] = (period * (row[nu.LEVEL] + rest) - up - down) / (2.0 * pi)
    size = period * (abs(row[nu.LEVEL]) + abs(rest))
    size += abs(row[nu.MINUS]) * (pi + size_up) + abs(row[nu.PLUS]) * (pi + size_down)
    out[rc.ACTION_BAR] = (24.0 * ROUNDOFF + 4.0 * noise) * size / (2.0 * pi)
    if out[rc.ACTION_BAR] > ROUGH * abs(out[rc.ACTION]):
        out[rc.ACTION], out[rc.ACTION_BAR] = action(row)


@kernel
def nutation_periods(rows, kinds, tolerance, out):
    """Fill `out` (n, PERIODS) for the wells `rows` (n, SIZE); wells of other kinds are skipped."""
    for i in range(len(rows)):
        if kinds[i] >= nu.NUTATION:
            _periods_of(rows[i], out[i])


@kernel
def nutation_motions(rows, kinds, starts, periods, times, out):
    """Fill `out` (n, m, MOTION) at `times` (n, m) in units of A."""
    for i in range(len(rows)):
        if kinds[i] >= nu.NUTATION:
            motion(cosine_by_means, rows[i], starts[i], periods[i], times[i], out[i])
