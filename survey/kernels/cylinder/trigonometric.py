"""The flow on an invariant curve w = mu F + n, b != 0 or not: g = 0 (50), mu = 1, and (61), in
vector lanes.

With u = tan(x/2), x = phi - phi0, phi' = w is quadratic: u = y1/y2, y1 = w0 s, y2 = c - f0 s, w =
w0 l/(y1^2 + y2^2), f0 the derivative of mu F at phi0, Delta^2 = n^2 - (mu b)^2. For Delta^2 > 0, s
= sin(Delta t/2)/Delta, c = cos(Delta t/2), l = 1; for Delta^2 < 0 all divided by cosh: s = tanh(D
t/2)/D, c = 1, l = 1/cosh^2(D t/2), D^2 = -Delta^2.

Numbers miss (61) by roundings at least: g = (mu - 1) f (mu F + n) + R, |R| <= `miss`, and the start is off the curve by
`offset`. Then e = w - (mu F + n) obeys e' = (1 - mu) f e + R, and w' = mu f w bounds its growth.

One lane is one solution at one time; no lane calls libm. The solutions start with w0 >= 0, others
are mirrored.

Source: M. E. Lesina, Ya. V. Zinovyeva (2004), (50), (61), as corrected in `scenes/gyrostat.md`.
"""

import math

import numpy as np

from survey.kernels.cylinder import flow
from survey.kernels.cylinder.flow import TWO_PI, TWO_PI_LOW, centred
from survey.kernels.cylinder.lockstep import sine_cosine
from survey.kernels.cylinder.steps import UNDETERMINED
from survey.kernels.cylinder.weierstrass import BAR_W, BAR_X, COUNT, LANES, W, X, arctangent
from survey.kernels.jit import inline
from survey.kernels.math.double import two_prod
from survey.kernels.math.roundoff import ROUNDOFF_UP

# Rows of the work array after the results: the inputs, and what one stage leaves for the next.
B12, B31, D, C23, S2, S3, MU, OTHER, PHI, SLIP, W0, TIME = range(5, 17)
_F, _SLOPE, _NOISE, _OFFSET, _MISS, _GAIN, _SQUARE, _PHASE, _TURNS, _DECAY = range(17, 27)
ROWS = 27
MARGIN = 1.5
SPREAD = 0.125  # roots mu closer together move with their sum of squares rather than with delta

# of squares of w and mu F: beyond, products leave the range of binary64
_SMALLEST, _LARGEST = 1e-200, 1e200
_EXACT = 4e-31  # of what two_prod makes exact
_NEAREST = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to an integer
_PI_LOW = 0.5 * TWO_PI_LOW
_MOST = 700.0  # e^-700 is a normal number
_WILDEST = 100.0  # growth by more leaves no digit
_LN2, _LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10
_P1, _P2, _P3 = 1.66666666666666019037e-01, -2.77777777770155933842e-03, 6.61375632143793436117e-05
_P4, _P5 = -1.65339022054652515390e-06, 4.13813679705723846039e-08


@inline
def _shrunk(k, scale, n, power):
    """k - n and scale 2^-n where k >= n."""
    return (k - n if k >= n else k), (scale * power if k >= n else scale)


@inline
def falling(y):
    """exp(-y) and 1 - exp(-y), 0 <= y <= 700, to 2 ulp; branch-free and without libm (as fdlibm's exp)."""
    k = (y * (1.0 / math.log(2.0)) + _NEAREST) - _NEAREST
    high, low = k * _LN2 - y, -k * _LN2_LOW
    x = high - low
    z = x * x
    c = x - z * (_P1 + z * (_P2 + z * (_P3 + z * (_P4 + z * _P5))))
    more = high - (low - x * c / (2.0 - c))  # exp(x) - 1
    k, scale = _shrunk(k, 1.0, 512.0, 2.0**-512)
    k, scale = _shrunk(k, scale, 256.0, 2.0**-256)
    k, scale = _shrunk(k, scale, 128.0, 2.0**-128)
    k, scale = _shrunk(k, scale, 64.0, 2.0**-64)
    k, scale = _shrunk(k, scale, 32.0, 2.0**-32)
    k, scale = _shrunk(k, scale, 16.0, 2.0**-16)
    k, scale = _shrunk(k, scale, 8.0, 2.0**-8)
    k, scale = _shrunk(k, scale, 4.0, 2.0**-4)
    k, scale = _shrunk(k, scale, 2.0, 2.0**-2)
    k, scale = _shrunk(k, scale, 1.0, 2.0**-1)
    return scale + scale * more, (1.0 - scale) - scale * more


@inline
def misfit(b12, b31, d, c23, s2, s3, mu, other, w0, F):
    """(offset, miss, error of mu): how far numbers miss (61), mu + other = 1; F = mu F(phi0) is off
    by no rounding.

    c = (d/2, c23) and (s2, s3) must be parallel to (u/2, v) and to b: miss is how far they are not.
    What they are along those gives mu and n, so its rounding moves the curve; only where both roots
    mu are close that is part of miss.
    """
    square = b12 * b12 + b31 * b31
    p, p_low = two_prod(b12, b12)
    q, q_low = two_prod(b31, b31)
    v, v_low = two_prod(b12, b31)
    u = p - q
    back = p - u
    u_low = ((p - (u + back)) + (back - q)) + (p_low - q_low)
    left, left_low = two_prod(d, v)
    right, right_low = two_prod(c23, u)
    across = (left - right) + ((left_low + d * v_low) - (right_low + c23 * u_low))
    left, left_low = two_prod(s2, b31)
    right, right_low = two_prod(s3, b12)
    beside = (left - right) + (left_low - right_low)
    miss = (
        abs(across) / square
        + abs(beside) / math.sqrt(square)
        + _EXACT * (abs(d) + abs(c23) + abs(s2) + abs(s3))
    )
    delta = (d * u + 4.0 * c23 * v) / (square * square)
    near = abs(mu - other) < SPREAD
    unequal = abs(delta - mu * other) + 8.0 * ROUNDOFF_UP * abs(delta)
    moved = 0.0 if near else 8.0 * ROUNDOFF_UP * abs(delta / (mu - other))
    blur = moved + 2.0 * ROUNDOFF_UP * abs(mu)
    miss += 0.5 * square * unequal if near else 0.0
    n = -(s2 * b12 + s3 * b31) / (square * other)
    error = (
        ROUNDOFF_UP * (12.0 * abs(n) + 2.0 * abs(w0))
        + moved * abs(n / other)
        + blur * math.sqrt(square)
    )
    exact = other == 0.0
    return (
        (0.0 if exact else abs((w0 - n) - F) + error),
        (0.0 if exact else miss),
        (0.0 if exact else blur),
    )


@inline
def _curve(T):
    """mu F and its derivative at the start, mirrored where w0 < 0, and what errs: noise of w',
    offset and miss.
    """
    for i in range(LANES):
        b12, b31, mu, other, w0, slip = (
            T[B12, i],
            T[B31, i],
            T[MU, i],
            T[OTHER, i],
            T[W0, i],
            T[SLIP, i],
        )
        s, c = sine_cosine(T[PHI, i])
        F, f = mu * (b12 * s + b31 * c), mu * (b12 * c - b31 * s)
        offset, miss, blur = misfit(
            b12, b31, T[D, i], T[C23, i], T[S2, i], T[S3, i], mu, other, w0, F
        )
        b = math.sqrt(b12 * b12 + b31 * b31)
        slack = (6.0 * ROUNDOFF_UP + 2.0 * slip) * abs(mu) * b
        T[_F, i], T[_SLOPE, i] = -F if w0 < 0.0 else F, f
        T[_NOISE, i] = slack + (4.0 * ROUNDOFF_UP * abs(w0) + 2.0 * b * blur if b > 0.0 else 0.0)
        T[_OFFSET, i], T[_MISS, i], T[_GAIN, i] = (
            offset + (0.0 if other == 0.0 else slack),
            miss,
            b * abs(other),
        )


@inline
def _phase(T):
    """Delta t/2 without whole half turns where Delta^2 > 0, D t where Delta^2 < 0."""
    for i in range(LANES):
        w0, F, f, t = abs(T[W0, i]), T[_F, i], T[_SLOPE, i], T[TIME, i]
        square = (w0 - 2.0 * F) * w0 - f * f
        angle = math.sqrt(abs(square)) * t
        turns = (angle * (0.5 / math.pi) + _NEAREST) - _NEAREST if square > 0.0 else 0.0
        phase = (0.5 * angle - turns * math.pi) - turns * _PI_LOW
        T[_SQUARE, i], T[_TURNS, i], T[_PHASE, i] = square, turns, phase if square > 0.0 else 0.0
        T[_DECAY, i] = min(angle, _MOST) if square < 0.0 else 0.0


@inline
def drift(w0, f, square, half, s, c, low):
    """Integral of w(0)/w over the time 2 half, plus a bound of what cancellation of its terms may lose;
    divided by cosh^2 where low = 1/cosh^2, c = 1 and s = tanh/Delta.
    """
    short = abs(square) * half * half < 1e-3
    third = 2.0 / 3.0 * half * half * half * low if short else (half * low - s * c) / square
    first, second, last = half * low + s * c, 2.0 * f * s * s, (w0 * w0 + f * f) * abs(third)
    return first - second + last + 8.0 * ROUNDOFF_UP * (abs(first) + abs(second) + last)


@inline
def _fourth(z):
    return (z * z) * (z * z)


@inline
def deviation(offset, miss, gain, mu, other, w0, F, f, square, w, slope, t):
    """Bound of e until t, where w and dw/dx = `slope` are reached: of two bounds of its growth the lesser.

    The integral of f dt is at most b t, and |change of F|/least w; mu times it is ln w at the end less that at the
    start; ln z <= (z - 1)/sqrt z, exp z <= 1/(1 - z). Where w has passed its maximum, that counts.
    """
    highest, passed = abs(w0 - F) + math.sqrt(F * F + f * f), f > 0.0 and slope < 0.0
    most = highest if square > 0.0 or passed else max(w, w0)
    least = square / highest if square > 0.0 else min(w, w0)
    ratio = most / least
    ratio = 1.0 if (ratio < 1.0) & (ratio > 0.0) else ratio  # by a rounding; NaN stays NaN
    root = math.sqrt(math.sqrt(math.sqrt(math.sqrt(math.sqrt(math.sqrt(ratio))))))
    # six roots lose what is small beside 1, of which ln z <= z - 1 keeps all
    logarithm = min(
        64.0 * ((root - 1.0) / math.sqrt(root)) + 160.0 * ROUNDOFF_UP,
        (ratio - 1.0) + 8.0 * ROUNDOFF_UP,
    )
    steep = abs(other) / max(abs(mu), 1e-300) * logarithm
    # e as w^((1 - mu)/mu), where w is monotone
    shrinks = square <= 0.0 and not passed and (w < w0) == (mu * other > 0.0)
    steep = 0.0 if shrinks else steep
    growth = 1.0 / (1.0 - min(gain * min(t, 2.0 / least), min(steep, _WILDEST)) / 1024.0)
    growth = _fourth(_fourth(_fourth(_fourth(_fourth(growth)))))
    return 0.0 if other == 0.0 else (offset + miss * t) * growth


@inline
def _formula(T):
    """x, w and their bars."""
    for i in range(LANES):
        w0, F, f, t, square = abs(T[W0, i]), T[_F, i], T[_SLOPE, i], T[TIME, i], T[_SQUARE, i]
        other, turns, noise = T[OTHER, i], T[_TURNS, i], T[_NOISE, i]
        sine, cosine = sine_cosine(T[_PHASE, i])
        left, gone = falling(T[_DECAY, i])
        root, half = math.sqrt(abs(square)), 0.5 * t
        swings, plain = square > 0.0, square == 0.0
        s = half if plain else (sine if swings else gone / (1.0 + left)) / root
        c = cosine if swings else 1.0
        low = 1.0 if swings or plain else 4.0 * left / ((1.0 + left) * (1.0 + left))
        y1, y2 = w0 * s, c - f * s
        norm = y1 * y1 + y2 * y2
        x, w = 2.0 * arctangent(y1, y2) + turns * TWO_PI, w0 * low / norm
        sx, cx = 2.0 * y1 * y2 / norm, (y2 - y1) * (y2 + y1) / norm
        slope = f * cx - F * sx
        moved = deviation(
            T[_OFFSET, i], T[_MISS, i], T[_GAIN, i], T[MU, i], other, w0, F, f, square, w, slope, t
        )
        bar = (noise + moved) * max(drift(w0, f, square, half, s, c, low), 0.0) / norm
        bar += 16.0 * ROUNDOFF_UP * (
            abs(y1) * (abs(c) + abs(f * s)) + abs(y1 * y2)
        ) / norm + 6.0 * ROUNDOFF_UP * (w * t + abs(x))
        steepest = abs(slope) + math.sqrt(F * F + f * f) * bar
        bar_w = MARGIN * (steepest * bar + moved + 4.0 * noise + 4.0 * ROUNDOFF_UP * w)
        # near the largest w, y1^2 + y2^2 loses more digits than w(x) on the curve does
        lost = w * (abs(y2) * (abs(c) + abs(f * s)) + y1 * y1) / norm
        on_curve = w0 + 2.0 * y1 * (f * y2 - F * y1) / norm
        w = on_curve if lost > 0.125 * (w0 + abs(F) + abs(f)) else w
        # uniform rotation, and rest
        uniform, rests = F == 0.0 and f == 0.0, w0 == 0.0
        x, w = (w0 * t if uniform else x), (w0 if uniform else w)
        size = w0 * w0 + F * F + f * f
        bar_x = MARGIN * bar if size > _SMALLEST and size < _LARGEST else math.inf
        bar_x = 2.0 * ROUNDOFF_UP * x + moved * t if uniform else bar_x
        bar_w = moved if uniform else bar_w
        bar_x, bar_w = (
            (0.0 if other == 0.0 else math.inf) if rests else bar_x,
            0.0 if rests else bar_w,
        )
        x, w = (0.0 if rests else x), (0.0 if rests else w)
        back = T[W0, i] < 0.0
        T[X, i], T[W, i], T[BAR_X, i], T[BAR_W, i] = (
            -x if back else x,
            -w if back else w,
            bar_x,
            bar_w,
        )
        # on the curve itself w keeps its sign
        T[COUNT, i] = 0.0 if other == 0.0 or w > bar_w else float(UNDETERMINED)


@inline
def solve(T):
    """Rows X to COUNT of T (ROWS, LANES) from rows B12 to TIME, |PHI| <= pi and off by SLIP, TIME > 0.

    BAR_X is infinite or NaN where no digit is left.
    """
    _curve(T)
    _phase(T)
    _formula(T)


@inline
def enter(T, i, p, phi0, w0, t, curve):
    """Set lane i to one solution of the coefficients p, on the curve of (mu, 1 - mu), at one time."""
    rest, slip = centred(phi0)
    T[B12, i], T[B31, i], T[D, i], T[C23, i] = p[flow.B12], p[flow.B31], p[flow.D], p[flow.C23]
    T[S2, i], T[S3, i], T[MU, i], T[OTHER, i] = p[flow.S2], p[flow.S3], curve[0], curve[1]
    T[PHI, i], T[SLIP, i], T[W0, i], T[TIME, i] = rest, slip, w0, t


@inline
def lanes():
    """A work array; lanes that are never entered hold numbers without meaning that divide by no zero."""
    return np.ones((ROWS, LANES))
