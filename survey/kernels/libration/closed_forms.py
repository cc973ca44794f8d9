"""The triangular libration point L4 of the spatial circular problem: frequencies, closed forms,
nearest resonance.

Equation numbers are those of `scenes/libration.md`. No digit is lost from mu = 1e-100 to mu_R: s, 1
- 5v and 1 - 10v, which vanish at mu_R, mu1 and mu2, are made from the differences of mu and these
numbers, v from the small root, and every factor in double-double; numerators by Horner's rule in v,
since in u their leading terms cancel as v -> 0.
"""

import numpy as np

from survey.kernels.jit import inline, kernel
from survey.kernels.libration.coefficients import COMMON, FORM_FACTORS, LABELS, NUMERATORS, POWERS
from survey.kernels.math import double as dd
from survey.kernels.math.roundoff import PAIR_ROUNDOFF, ROUNDOFF

WIDE = 16.0 * PAIR_ROUNDOFF  # of one double-double operation, generously
MARGIN = 1.01  # for what is of second order in the bars
# (1 - sqrt(611/675))/2, (1 - sqrt(71/75))/2 and (1 - sqrt(23/27))/2, each the sum of three numbers
MU_1 = (0.024293897142052323, -1.424188204168191e-18, -8.15199000958143e-35)
MU_2 = (0.013516016022452526, 3.178279201104934e-19, -4.772058303155615e-36)
MU_R = (0.0385208965045514, -2.49642603804579e-18, -6.208077310548691e-35)
W1, W2, U, V, S, FIVE_U, FIVE_V, TEN_U, TEN_V, FOUR_U, FOUR_V, NINE = range(len(FORM_FACTORS))


@inline
def apart(mu, critical):
    """mu - critical, however near they are."""
    d = dd.two_sum(mu, -critical[0])
    return dd.add(dd.add(d, (-critical[1], 0.0)), (-critical[2], 0.0))


@inline
def gap(mu, critical):
    """mu (1 - mu) - critical (1 - critical) = (mu - critical) (1 - mu - critical)."""
    other = dd.sub(dd.two_sum(1.0, -mu), (critical[0], critical[1]))
    return dd.mul(apart(mu, critical), other)


@inline
def store(f, which, number):
    f[0, which], f[1, which] = number


@kernel
def factors(mu, f):
    """The FORM_FACTORS (F1)-(F6) in double-double, f[:, factor]; True where 0 < mu < mu_R, else
    nothing is done.
    """
    square = dd.times(gap(mu, MU_R), -27.0)  # s^2 = 1 - 4x
    if not (mu > 0.0 and square[0] > 0.0):
        return False
    one = (1.0, 0.0)
    s = dd.sqrt(square)
    x = dd.times(dd.times(dd.two_sum(1.0, -mu), mu), 6.75)
    u = dd.times(dd.add(one, s), 0.5)
    v = dd.div(x, u)  # the small root
    five, ten = dd.sub(one, dd.times(u, 5.0)), dd.sub(one, dd.times(u, 10.0))
    store(f, W1, dd.sqrt(u))
    store(f, W2, dd.sqrt(v))
    store(f, U, u)
    store(f, V, v)
    store(f, S, s)
    store(f, FIVE_U, five)
    store(f, FIVE_V, dd.div(dd.times(gap(mu, MU_1), 168.75), five))  # (1 - 5u)(1 - 5v) = 25x - 4
    store(f, TEN_U, ten)
    store(f, TEN_V, dd.div(dd.times(gap(mu, MU_2), 675.0), ten))  # (1 - 10u)(1 - 10v) = 100x - 9
    store(f, FOUR_U, dd.sub((4.0, 0.0), u))
    store(f, FOUR_V, dd.sub((4.0, 0.0), v))
    store(f, NINE, dd.sub((9.0, 0.0), dd.times(x, 4.0)))
    return True


@inline
def form(row, f):
    """One closed form in float64 and its error bound, from the leading parts of the factors."""
    v, last = f[0, V], NUMERATORS.shape[1] - 1
    value, slope = NUMERATORS[row, last], 0.0
    noise = 0.5 * abs(value)
    for k in range(last - 1, -1, -1):
        slope = slope * v + value
        value = value * v + NUMERATORS[row, k]
        noise = noise * v + abs(value)
    # running bound of Horner's rule; v is rounded
    noise = ROUNDOFF * (2.0 * noise - abs(value) + v * abs(slope))
    above, below, count = 1.0, COMMON[row], 3
    for j in range(f.shape[1]):
        for _ in range(POWERS[row, j]):
            above *= f[0, j]
        for _ in range(-POWERS[row, j]):
            below *= f[0, j]
        count += 2 * abs(POWERS[row, j])
    above /= below
    value *= above
    return value, MARGIN * (abs(above) * noise + ROUNDOFF * count * abs(value))


@inline
def form_double(row, f):
    """One closed form in double-double, rounded, and its error bound."""
    v, last = (f[0, V], f[1, V]), NUMERATORS.shape[1] - 1
    value, size = (0.0, 0.0), 0.0
    for k in range(last, -1, -1):
        value = dd.add(dd.mul(value, v), (NUMERATORS[row, k], 0.0))
        size = size * v[0] + abs(NUMERATORS[row, k])
    above, below, count = (1.0, 0.0), (COMMON[row], 0.0), 3
    for j in range(f.shape[1]):
        factor = (f[0, j], f[1, j])
        for _ in range(POWERS[row, j]):
            above = dd.mul(above, factor)
        for _ in range(-POWERS[row, j]):
            below = dd.mul(below, factor)
        count += 2 * abs(POWERS[row, j])
    above = dd.div(above, below)
    value = dd.mul(value, above)
    wide = WIDE * ((last + 1) * size * abs(above[0]) + count * abs(value[0]))
    return value[0], MARGIN * (wide + ROUNDOFF * abs(value[0]))


@kernel
def closed_forms(mu, values, bars):
    """The first closed forms (rows of `values` and `bars`) at every mu, in float64; NaN outside 0 <
    mu < mu_R.
    """
    f = np.empty((2, len(FORM_FACTORS)))
    for n in range(len(mu)):
        good = factors(mu[n], f)
        for row in range(len(values)):
            values[row, n], bars[row, n] = form(row, f) if good else (np.nan, np.nan)


@kernel
def closed_forms_double(mu, values, bars):
    """As `closed_forms`, in double-double: every value within little more than a rounding."""
    f = np.empty((2, len(FORM_FACTORS)))
    for n in range(len(mu)):
        good = factors(mu[n], f)
        for row in range(len(values)):
            values[row, n], bars[row, n] = form_double(row, f) if good else (np.nan, np.nan)


@inline
def product(k, f):
    """k . omega = (k1 + k3) - k1 (1 - omega1) - k2 omega2 and its error bound; 1 - omega1 = v / (1
    + omega1).
    """
    first = dd.times(dd.div((f[0, V], f[1, V]), dd.shifted((f[0, W1], f[1, W1]), 1.0)), -k[0])
    second = dd.times((f[0, W2], f[1, W2]), -k[1])
    integer = k[0] + k[2]
    total = dd.shifted(dd.add(first, second), integer)
    size = abs(integer) + abs(first[0]) + abs(second[0])
    return total[0], MARGIN * (ROUNDOFF * abs(total[0]) + WIDE * size)


@kernel
def linear(mu, vectors, frequencies, nearest, distance):
    """omega1, omega2 (rows of `frequencies`), the index among `vectors` of the nearest resonance, |k . omega|, its bar.

    The last two are rows of `distance`. NaN and -1 outside 0 < mu < mu_R. Of equals the first
    counts.
    """
    f = np.empty((2, len(FORM_FACTORS)))
    near = 64.0 * ROUNDOFF  # |k . omega| in float64 is good to less
    for n in range(len(mu)):
        frequencies[:, n], distance[:, n], nearest[n] = np.nan, np.nan, -1
        if not factors(mu[n], f):
            continue
        frequencies[0, n], frequencies[1, n] = f[0, W1], f[0, W2]
        least = np.inf
        for k in vectors:
            least = min(least, abs(k[0] * f[0, W1] - k[1] * f[0, W2] + k[2]))
        best = np.inf
        for i in range(len(vectors)):
            k = vectors[i]
            if abs(k[0] * f[0, W1] - k[1] * f[0, W2] + k[2]) <= least + near:
                here, bar = product(k, f)
                if abs(here) < best:
                    best, nearest[n] = abs(here), i
                    distance[0, n], distance[1, n] = best, bar


ROWS = {4: 6, 6: len(LABELS)}  # of the table of closed forms, up to an order


def tabulate(kernel, mu, rows):
    """The first rows of the table of closed forms, and their bars."""
    values, bars = np.empty((rows, mu.size)), np.empty((rows, mu.size))
    kernel(mu, values, bars)
    return values, bars
