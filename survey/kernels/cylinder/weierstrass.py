"""The flow without Barnett-London effect, b = 0, in closed form: Weierstrass's functions, in vector
lanes.

w^2 = m + p cos x + q sin x + r cos 2x + o sin 2x, x = phi - phi0, and u = tan(x/2) obeys u'^2 =
quartic(u). With wp of the quartic's invariants, Biermann's and Weierstrass's formula gives u(t) =
N/D without the quartic's roots, a phase or cases: N = -w0 wp'/2 + B v + C0, D = 2 (v^2 - C), v = wp
- A. Where N cancels, u = L/N*, N* = B v + C0 + w0 wp'/2, N N* = D L, L = L0 - w0^2 v/2. Of (N, D)
and (L, N*) that is taken in which no sum cancels; x = 2 atan2 of it.

wp = e1 + xi, e1 the greatest real root of 4 e^3 - g2 e - g3, and xi lies on y^2 = xi (xi^2 + 3 e1
xi + H^2), H^2 = (e1 - e2)(e1 - e3). The isogenies xi = z (z + b^2)/(z + a^2) of the means a, b,
from a1^2 = (H + 3 e1/2)/2, b1^2 = H, lead to it from (M cot M t)^2, and all their terms are
positive, for real and for complex e2, e3. The period is pi/M.

One lane is one solution at one time; no lane calls libm. Every error bound is carried forward with
its value: "d_" is a bound of an error, "e_" of a relative one. `delay` is an error in time; it acts
through w and w'.

Sources: E. T. Whittaker, G. N. Watson, A Course of Modern Analysis, 20.6; DLMF 23.10, 23.22(ii);
J.-B. Bost, J.-F. Mestre, Gaz. Math. 38 (1988) 36-64 (isogenies); `scenes/gyrostat.md`, (62)-(68).
"""

import math

import numpy as np

from survey.kernels.cylinder import flow
from survey.kernels.cylinder.flow import TWO_PI, TWO_PI_LOW, centred
from survey.kernels.cylinder.lockstep import sine_cosine
from survey.kernels.cylinder.steps import UNDETERMINED
from survey.kernels.jit import inline
from survey.kernels.math.roundoff import ROUNDOFF_UP

LANES = 32
_LEVELS = 7  # of the means: enough for 1e-6 <= b1/a1 <= 1e6
_HALLEY = 5

# Rows of the work array: the results, the inputs, what one stage leaves for the next, and the
# means.
X, W, BAR_X, BAR_W, COUNT = range(5)
D, C23, S2, S3, PHI, SLIP, W0, TIME = range(5, 13)
_SIDE, _M, _P, _Q, _R, _O, _D_M, _D_1, _D_2, _BEND = range(13, 23)
_E1, _D_E1, _H2, _E_H, _Q4, _D_Q4 = range(23, 29)
_DELAY, _TURNS, _PHASE, _XI_P, _XI_Q, _Y = range(29, 35)
_LOST, _E_A, _E_B, _BY_SHAPE = range(35, 39)
_MEAN_A, _MEAN_B, _BY_A, _BY_B = (39 + i * (_LEVELS + 1) for i in range(4))
ROWS = _BY_B + _LEVELS + 1

_NEAREST = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to an integer
_PI_LOW = 0.5 * TWO_PI_LOW
_SMALLEST, _LARGEST = 1e-60, 1e60  # of g2: beyond, products leave the range of binary64
_LEAST = 1e-250
_SAFE = 1.5  # what the bars leave out: second order
_A10 = 1.62858201153657823623e-02


@inline
def arctangent(y, x):
    """atan2(y, x), to 2 ulp; branch-free and without libm (polynomial of fdlibm's atan)."""
    tall, wide = abs(y), abs(x)
    upright = tall > wide
    low, high = (wide, tall) if upright else (tall, wide)
    steep = low > 0.41421356237309503 * high
    ratio = ((low - high) if steep else low) / ((low + high) if steep else high)
    z = ratio * ratio
    v = z * z
    odd = 9.09088713343650656196e-02 + v * (
        6.66107313738753120669e-02 + v * (4.97687799461593236017e-02 + v * _A10)
    )
    odd = z * (3.33333333333329318027e-01 + v * (1.42857142725034663711e-01 + v * odd))
    even = -7.69187620504482999495e-02 + v * (
        -5.83357013379057348645e-02 + v * -3.65315727442169155270e-02
    )
    even = v * (-1.99999999998764832476e-01 + v * (-1.11111104054623557880e-01 + v * even))
    angle = (0.25 * math.pi if steep else 0.0) - (
        (ratio * (odd + even) - (0.25 * _PI_LOW if steep else 0.0)) - ratio
    )
    angle = 0.5 * math.pi - (angle - 0.5 * _PI_LOW) if upright else angle
    angle = math.pi - (angle - _PI_LOW) if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@inline
def _energy(T):
    """The coefficients of w^2 about phi0, mirrored (x -> -x) where the solution starts to the left,
    and their bars.
    """
    for i in range(LANES):
        d, c23, s2, s3, w0 = T[D, i], T[C23, i], T[S2, i], T[S3, i], T[W0, i]
        s, c = sine_cosine(T[PHI, i])
        double_s, double_c = 2.0 * s * c, (c - s) * (c + s)
        q, o = 2.0 * (s2 * c - s3 * s), -c23 * double_c - 0.5 * d * double_s
        back = w0 < 0.0 or (w0 == 0.0 and 0.5 * q + o < 0.0)
        p, r = 2.0 * (s2 * s + s3 * c), 0.5 * d * double_c - c23 * double_s
        first, second = math.sqrt(s2 * s2 + s3 * s3), math.sqrt(c23 * c23 + 0.25 * d * d)
        m, slip = w0 * w0 - p - r, T[SLIP, i]
        T[_SIDE, i] = -1.0 if back else 1.0
        T[W0, i] = abs(w0)
        T[_M, i], T[_P, i], T[_Q, i], T[_R, i], T[_O, i] = (
            m,
            p,
            -q if back else q,
            r,
            -o if back else o,
        )
        T[_D_1, i], T[_D_2, i] = (
            (8.0 * ROUNDOFF_UP + 2.0 * slip) * first,
            (9.0 * ROUNDOFF_UP + 2.0 * slip) * second,
        )
        T[_D_M, i] = T[_D_1, i] + T[_D_2, i] + ROUNDOFF_UP * (2.0 * w0 * w0 + abs(p) + abs(m))
        T[_BEND, i] = 2.0 * (first + 2.0 * second)


@inline
def _lattice(T):
    """e1, H and the first means, from the invariants g2 and g3."""
    for i in range(LANES):
        d, c23, s2, s3, m, d_m = T[D, i], T[C23, i], T[S2, i], T[S3, i], T[_M, i], T[_D_M, i]
        first, second = 0.25 * (s2 * s2 + s3 * s3), 0.25 * (c23 * c23 + 0.25 * d * d)
        mean, share = m * m * (1.0 / 12.0), (2.0 * second + first) * (1.0 / 12.0)
        cross = d * (s3 - s2) * (s3 + s2) - 4.0 * s2 * s3 * c23
        g2, wide = (second - first) + mean, first + second + mean
        g3 = m * (mean * (1.0 / 18.0) - share) + cross * (1.0 / 32.0)
        d_g2 = 3.0 * ROUNDOFF_UP * wide
        d_g3 = (
            4.0 * ROUNDOFF_UP * (abs(m) * (mean * (1.0 / 18.0) + share) + math.sqrt(second) * first)
        )
        flipped, height = g3 < 0.0, abs(g3)
        root = 0.5 * math.sqrt(g2 if g2 > 0.0 else 0.0) + 0.9 * math.sqrt(height / math.sqrt(wide))
        move = 0.0
        for _ in range(_HALLEY):  # to the greatest root of 4 e^3 - g2 e - |g3|
            value, slope = (4.0 * root * root - g2) * root - height, 12.0 * root * root - g2
            move = value * slope / (slope * slope - 12.0 * root * value)
            root -= move
        square, slope = root * root, 12.0 * root * root - g2
        # the error of m moves both invariants at once: by its derivatives
        by_m = mean * (1.0 / 6.0) - share
        by_m = (root * m * (1.0 / 6.0) + (-by_m if flipped else by_m)) / slope
        d_value = d_g3 + ROUNDOFF_UP * (4.0 * root * square + 2.0 * height)
        d_root = (root * d_g2 + d_value) / slope + ROUNDOFF_UP * root
        q4 = g2 - 3.0 * square  # (difference of the other two)^2; an error of g2 moves the root too
        d_q4 = (abs(slope - 6.0 * square) * d_g2 + 6.0 * root * d_value) / slope + ROUNDOFF_UP * (
            abs(q4) + 12.0 * square
        )
        d_q4 += abs(m * (1.0 / 6.0) - 6.0 * root * by_m) * d_m
        d_root += abs(by_m) * d_m
        apart = flipped and q4 > 0.0
        gap = math.sqrt(abs(q4))
        e1 = 0.5 * (root + gap) if apart else (-root if flipped else root)
        d_e1 = 0.5 * d_root + 0.25 * d_q4 / gap + ROUNDOFF_UP * e1 if apart else d_root
        H2 = gap * (e1 + root) if apart else 0.25 * (9.0 * square - q4)
        near = 0.25 * d_q4 / q4 + 0.5 * (d_e1 + d_root) / (e1 + root)
        e_h = (near if apart else (18.0 * root * d_root + d_q4) / (8.0 * H2)) + 2.0 * ROUNDOFF_UP
        H = math.sqrt(H2)
        inner = H + 1.5 * abs(e1)
        e_inner = (H * e_h + 1.5 * d_e1) / inner
        a2 = 0.125 * abs(q4) / inner if e1 < 0.0 else 0.5 * inner
        e_a = 0.5 * (e_inner + (d_q4 / abs(q4) if e1 < 0.0 else 0.0)) + 2.0 * ROUNDOFF_UP
        e_b = 0.5 * e_h + ROUNDOFF_UP
        lost = not (abs(move) <= 1e-6 * root and wide > _SMALLEST and wide < _LARGEST)
        lost = lost or (flipped and abs(q4) <= 30.0 * d_q4)
        T[_E1, i], T[_D_E1, i], T[_H2, i], T[_E_H, i], T[_Q4, i], T[_D_Q4, i] = (
            e1,
            d_e1,
            H2,
            e_h,
            q4,
            d_q4,
        )
        T[_MEAN_A, i], T[_MEAN_B, i], T[_E_A, i], T[_E_B, i] = math.sqrt(a2), math.sqrt(H), e_a, e_b
        T[_BY_A, i], T[_BY_B, i], T[_LOST, i] = 1.0, -1.0, 1.0 if lost else 0.0


@inline
def _mean(T, n):
    """Means a, b of the next level, and the derivatives of ln a, ln b where a1 grows and b1 shrinks."""
    for i in range(LANES):
        a, b, by_a, by_b = T[_MEAN_A + n, i], T[_MEAN_B + n, i], T[_BY_A + n, i], T[_BY_B + n, i]
        T[_MEAN_A + n + 1, i], T[_MEAN_B + n + 1, i] = 0.5 * (a + b), math.sqrt(a * b)
        T[_BY_A + n + 1, i], T[_BY_B + n + 1, i] = (
            (a * by_a + b * by_b) / (a + b),
            0.5 * (by_a + by_b),
        )


@inline
def _phase(T):
    """M t without whole periods, and (cot M t)^2 as P/Q."""
    for i in range(LANES):
        a, b, by_shape = T[_MEAN_A + _LEVELS, i], T[_MEAN_B + _LEVELS, i], T[_BY_A + _LEVELS, i]
        mean, t = 0.5 * (a + b), T[TIME, i]
        theta = mean * t
        turns = (theta * (1.0 / math.pi) + _NEAREST) - _NEAREST
        phase = (theta - turns * math.pi) - turns * _PI_LOW
        s, c = sine_cosine(phase)
        e_mean = (
            0.5 * ((1.0 + by_shape) * T[_E_A, i] + (1.0 - by_shape) * T[_E_B, i])
            + 12.0 * ROUNDOFF_UP
        )
        delay = t * (e_mean + 4.0 * ROUNDOFF_UP) + 2.0 * ROUNDOFF_UP / mean
        T[_DELAY, i] = delay if abs(a - b) <= 1e-15 * a else math.inf
        T[_TURNS, i], T[_PHASE, i], T[_BY_SHAPE, i] = turns, phase, 2.0 * by_shape
        T[_XI_P, i], T[_XI_Q, i], T[_Y, i] = c * c, s * s, s * c


@inline
def _ascend(T, n):
    """One isogeny: xi = P/Q and y = Y/Q^2, in units of M, of the level above; and the derivative of ln xi."""
    for i in range(LANES):
        mean = 0.5 * (T[_MEAN_A + _LEVELS, i] + T[_MEAN_B + _LEVELS, i])
        P, Q, unit = T[_XI_P, i], T[_XI_Q, i], 1.0 / (mean * mean)
        a, b = T[_MEAN_A + n, i], T[_MEAN_B + n, i]
        a, b = a * a * unit, b * b * unit
        above, below = P + b * Q, P + a * Q
        u, v = P / above, P / below
        direct = T[_BY_B + n, i] * (1.0 - u) - T[_BY_A + n, i] * (1.0 - v)
        T[_BY_SHAPE, i] = T[_BY_SHAPE, i] * (1.0 + u - v) + 2.0 * direct
        T[_Y, i] *= P * P + a * Q * (2.0 * P + b * Q)
        T[_XI_P, i], T[_XI_Q, i] = P * above, Q * below


@inline
def _square(m, p, q, r, o, s, c):
    """w^2 and |w'| where x has the sine s and the cosine c."""
    double_s, double_c = 2.0 * s * c, (c - s) * (c + s)
    square = m + (p * c + q * s) + (r * double_c + o * double_s)
    return square, abs(0.5 * (q * c - p * s) + (o * double_c - r * double_s))


@inline
def _branch(half, plus, lower, v, C, curved, steep):
    """The sign that makes (N, D) a positive multiple of (sin x/2, cos x/2) on the whole of a
    libration.

    N and D vanish together, and so change it, where v = +-sqrt(C) in that half of the period in
    which the solution does not pass x = pi. `plus` is B v + C0 at sqrt(C), which decides the half;
    `curved` - `steep` has the sign of the product with that at -sqrt(C).
    """
    between = half if plus >= 0.0 else -half
    beyond = 1.0 if v >= 0.0 or C < 0.0 or curved >= steep else -1.0
    return between if lower < 0.0 else beyond


@inline
def _formula(T):
    """x, w, their bars and the turnings, from xi and y."""
    for i in range(LANES):
        w0, m, p, q, r, o = T[W0, i], T[_M, i], T[_P, i], T[_Q, i], T[_R, i], T[_O, i]
        d_m, d_1, d_2, bend = T[_D_M, i], T[_D_1, i], T[_D_2, i], T[_BEND, i]
        e1, d_e1, H2, e_h, q4, d_q4 = (
            T[_E1, i],
            T[_D_E1, i],
            T[_H2, i],
            T[_E_H, i],
            T[_Q4, i],
            T[_D_Q4, i],
        )
        delay = T[_DELAY, i]
        turns = T[_TURNS, i]
        phase = T[_PHASE, i]
        by_shape = 0.5 * T[_BY_SHAPE, i]
        e = abs(1.0 + by_shape) * T[_E_A, i] + abs(1.0 - by_shape) * T[_E_B, i] + 40.0 * ROUNDOFF_UP
        mean = 0.5 * (T[_MEAN_A + _LEVELS, i] + T[_MEAN_B + _LEVELS, i])
        size, unit = 1.0 / (T[_XI_P, i] + T[_XI_Q, i]), mean * mean
        P = T[_XI_P, i] * size * unit
        Q = T[_XI_Q, i] * size
        Y = T[_Y, i] * size * size * unit * mean
        # the constants of the formula
        start, g = w0 * w0, 0.5 * q + o
        d_g = 0.5 * d_1 + d_2 + ROUNDOFF_UP * abs(g)
        A = (m - 3.0 * r) * (1.0 / 24.0)
        d_a = (d_m + 3.0 * d_2) * (1.0 / 24.0) + 2.0 * ROUNDOFF_UP * abs(A)
        E, B, tilt, far = e1 - A, 0.5 * g, q - 2.0 * o, m - p + r  # far = w^2 at x = pi
        C0, C = start * tilt * (1.0 / 32.0), start * far * (1.0 / 64.0)
        d_c0 = start * (d_1 + 2.0 * d_2) * (1.0 / 32.0) + 2.0 * ROUNDOFF_UP * abs(C0)
        d_c = start * (d_m + d_1 + d_2 + ROUNDOFF_UP * abs(far)) * (
            1.0 / 64.0
        ) + 2.0 * ROUNDOFF_UP * abs(C)
        L0 = 0.125 * g * g - 1.5 * start * A
        d_l0 = (
            0.25 * abs(g) * d_g
            + 1.5 * start * d_a
            + ROUNDOFF_UP * (0.25 * g * g + 3.0 * start * abs(A))
        )
        # v Q, and what is linear in it
        v = P + E * Q
        d_v = e * P + (d_e1 + d_a + ROUNDOFF_UP * abs(E)) * Q + ROUNDOFF_UP * abs(v)
        line, low = B * v + C0 * Q, L0 * Q - 0.5 * start * v
        d_line = (
            abs(B) * d_v
            + 0.5 * d_g * abs(v)
            + d_c0 * Q
            + 2.0 * ROUNDOFF_UP * (abs(B * v) + abs(C0 * Q))
        )
        d_low = d_l0 * Q + 0.5 * start * d_v + ROUNDOFF_UP * (abs(L0 * Q) + start * abs(v))
        rise, rest = w0 * Y, line * Q
        d_n = 2.0 * e * abs(rise) + d_line * Q
        lower = 2.0 * (v * v - C * Q * Q)
        d_lower = (
            4.0 * abs(v) * d_v + 2.0 * d_c * Q * Q + 6.0 * ROUNDOFF_UP * (v * v + abs(C) * Q * Q)
        )
        plain = rise * rest > 0.0 or (rise * rest == 0.0 and w0 > 0.0)
        other = rest - rise
        y1, y2 = rise + rest if plain else low * Q, lower if plain else other
        d_1y, d_2y = d_n if plain else d_low * Q, d_lower if plain else d_n
        norm = y1 * y1 + y2 * y2
        fixed = 2.0 * (abs(y1) * d_2y + abs(y2) * d_1y) / norm
        # w = 2 (y1' y2 - y1 y2') / norm, Y^2 = Q P (P^2 + 3 e1 P Q + H2 Q^2)
        force, pull = 0.5 * w0 * (6.0 * P * P + 12.0 * e1 * P * Q + 2.0 * H2 * Q * Q), 2.0 * B * Y
        most = 0.5 * w0 * (6.0 * P * P + 12.0 * abs(e1) * P * Q + 2.0 * H2 * Q * Q)
        d_force = 2.0 * e * most + w0 * Q * (6.0 * P * d_e1 + 2.0 * H2 * e_h * Q)
        d_force += 4.0 * e * abs(pull) + d_g * abs(Y)
        cube = w0 * P * (P * P + 3.0 * e1 * P * Q + H2 * Q * Q)
        d_cube = 3.0 * e * P * most + w0 * P * Q * (3.0 * P * d_e1 + 2.0 * H2 * e_h * Q)
        inner = cube + line * Y
        d_inner = d_cube + d_line * abs(Y) + 2.0 * e * abs(line * Y)
        one = 8.0 * v * inner - (force + pull) * lower
        two = start * Y * other - low * Q * (force - pull)
        d_one = (
            8.0 * (d_v * abs(inner) + abs(v) * d_inner)
            + d_force * abs(lower)
            + abs(force + pull) * d_lower
        )
        d_two = start * abs(Y) * (2.0 * e * abs(other) + d_n) + Q * (
            d_low * abs(force - pull) + abs(low) * d_force
        )
        wronskian, d_w = one if plain else two, d_one if plain else d_two
        w = 2.0 * wronskian / norm
        d_w = (
            2.0 * d_w / norm
            + 2.0 * abs(w) * (abs(y1) * d_1y + abs(y2) * d_2y) / norm
            + 8.0 * ROUNDOFF_UP * abs(w)
        )
        square, slope = _square(m, p, q, r, o, 2.0 * y1 * y2 / norm, (y2 - y1) * (y2 + y1) / norm)
        # the root of w^2 is better than the formula where w is not small
        noise = d_m + d_1 + 2.0 * d_2 + 6.0 * ROUNDOFF_UP * (abs(m) + 2.0 * bend)
        d_square = 2.0 * (slope + bend * fixed) * fixed + noise
        speed = math.sqrt(abs(square))
        d_speed = 0.6 * d_square / speed + 2.0 * ROUNDOFF_UP * speed
        clear = d_square < 0.1 * square and d_speed < d_w and d_w < speed
        w, d_w = math.copysign(speed, w) if clear else w, d_speed if clear else d_w
        # does it swing or rotate?
        bound = A + 0.5 * e1
        split = 0.125 * g * g - start * bound
        d_split = (
            0.25 * abs(g) * d_g
            + start * (d_a + 0.5 * d_e1)
            + ROUNDOFF_UP * (g * g + 2.0 * start * abs(bound))
        )
        swings = split > 0.0 or (split >= -d_split and q4 < 0.0)
        known = abs(split) > d_split or q4 < -d_q4
        half = 1.0 if phase >= 0.0 else -1.0
        plus = B * math.sqrt(C if C > 0.0 else 0.0) + C0
        sign = _branch(half, plus, lower, v, C, start * tilt * tilt, 4.0 * g * g * far)
        sign = sign if plain or other * lower >= 0.0 else -sign
        sign = sign if swings else (1.0 if y1 * phase >= 0.0 else -1.0)
        x = 2.0 * arctangent(sign * y1, sign * y2) + (0.0 if swings else turns * TWO_PI)
        bar_x = abs(w) * delay + bend * delay * delay + fixed + 4.0 * ROUNDOFF_UP * abs(x)
        bar_w = slope * delay + bend * delay * (abs(w) * delay + bend * delay * delay) + d_w
        lost = T[_LOST, i] != 0.0 or not (known and norm > _LEAST)
        T[X, i], T[W, i] = T[_SIDE, i] * x, T[_SIDE, i] * w
        T[BAR_X, i], T[BAR_W, i] = math.inf if lost else _SAFE * bar_x, _SAFE * bar_w
        passed = 2.0 * turns + (0.0 if w > 0.0 else half) if swings else 0.0
        T[COUNT, i] = passed if abs(w) > T[BAR_W, i] else float(UNDETERMINED)


@inline
def solve(T):
    """Rows X to COUNT of T (ROWS, LANES) from rows D to TIME, |PHI| <= pi and off by SLIP, TIME > 0; W0 is changed.

    BAR_X is infinite where the digits are lost. COUNT is UNDETERMINED where |W| <= BAR_W.
    """
    _energy(T)
    _lattice(T)
    for n in range(_LEVELS):
        _mean(T, n)
    _phase(T)
    for n in range(_LEVELS - 1, -1, -1):
        _ascend(T, n)
    _formula(T)


@inline
def enter(T, i, p, phi0, w0, t, curve):
    """Set lane i to one solution of the coefficients p at one time; `curve` has no meaning here."""
    rest, slip = centred(phi0)
    T[D, i], T[C23, i], T[S2, i], T[S3, i] = p[flow.D], p[flow.C23], p[flow.S2], p[flow.S3]
    T[PHI, i], T[SLIP, i], T[W0, i], T[TIME, i] = rest, slip, w0, t


@inline
def lanes():
    """A work array; lanes that are never entered hold numbers without meaning that divide by no zero."""
    return np.ones((ROWS, LANES))
