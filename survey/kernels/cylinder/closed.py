"""Solutions in closed form of the flow on the cylinder where g = 0 or w = mu F + n; where b = 0,
the time at an angle.

Trigonometric, kind 1: w = mu F(phi) + n is an invariant curve, g = (mu - 1) f (mu F + n); mu = 1 is
g = 0 (50), other mu are (61). With u = tan(x/2), x = phi - phi0, du/dt is quadratic in u: one
formula in Delta^2 = n^2 - (mu b)^2. Elliptic, b = 0: w^2 = w0^2 + 2 (V(phi0) - V(phi)), a
trigonometric polynomial of degree 2, and chi = am(theta), theta = Omega t + theta0, after a real
projective map of tan(phi/2) that is centred on the turning points (libration, kind 2) or on the
complex roots (rotation, kind 3). Nothing lies at infinity, so no variant of (66) needs its own
case.

For phi and w at a time see `trigonometric` and `weierstrass`.

All start with w0 >= 0 (the caller mirrors). `data` holds what `start_*` has found; `*_reach` take
it.
"""

import cmath
import math

import numpy as np

from survey.kernels.cylinder import records as rc
from survey.kernels.cylinder.flow import B12, B31, C23, S2, S3, TWO_PI, D
from survey.kernels.cylinder.trigonometric import deviation, drift, misfit
from survey.kernels.jit import inline, kernel
from survey.kernels.math.carlson import rf
from survey.kernels.math.elliptic import complete
from survey.kernels.math.roundoff import ROUNDOFF_UP

NONE, TRIGONOMETRIC, LIBRATION, ROTATION, LOST = 0, 1, 2, 3, 4
SIZE = 32
# how far, relative, parameters may miss the conditions of (61); the miss goes into the bars
SAME = 64.0 * ROUNDOFF_UP

# indices into data
W0, A1, B1, A2, B2, ROUGH = range(6)  # g(phi0 + x) = A1 cos x + B1 sin x + A2 cos 2x + B2 sin 2x
F0, SLOPE, SQUARE, NOISE, OFFSET, MISS, GAIN, MU, OTHER = range(6, 15)  # kind 1
LEFT, RIGHT, BAR_LEFT, BAR_RIGHT, RATIO = range(6, 11)  # kind 2
RHO, RHO_M, THETA0, OMEGA, KC, KC2, QUARTER, SLACK = range(11, 19)  # kinds 2 and 3
RE, IM, TILT, LEAST, MISFIT = range(20, 25)  # kind 3
MARGIN = 1.5


@inline
def local(p, phi0, side, data):
    """Coefficients of g about phi0, mirrored (x -> -x, w -> -w) where side < 0."""
    s, c = math.sin(phi0), math.cos(phi0)
    s2, c2 = 2.0 * s * c, (c - s) * (c + s)
    a2, b2 = -p[C23], -0.5 * p[D]
    data[A1], data[B1] = side * (p[S2] * c - p[S3] * s), -p[S2] * s - p[S3] * c
    # what A1 and A2 are rounded against
    data[ROUGH] = abs(p[S2] * c) + abs(p[S3] * s) + abs(a2 * c2) + abs(b2 * s2)
    data[A2], data[B2] = side * (a2 * c2 + b2 * s2), b2 * c2 - a2 * s2


@inline
def square_of_w(data, x):
    """w^2 at phi0 + x on the energy of the start, its derivative, and a bound of its rounding."""
    s, c = math.sin(0.5 * x), math.cos(0.5 * x)
    sx, cx = 2.0 * s * c, (c - s) * (c + s)
    inner = 2.0 * c * (data[A1] + data[A2] * cx) + s * (2.0 * data[B1] + 4.0 * data[B2] * c * c)
    first, second = math.hypot(data[A1], data[B1]), math.hypot(data[A2], data[B2])
    slope = (
        data[A1] * cx + data[B1] * sx + data[A2] * (cx - sx) * (cx + sx) + 2.0 * data[B2] * sx * cx
    )
    noise = (
        4.0
        * ROUNDOFF_UP
        * (data[W0] ** 2 + 6.0 * abs(s) * (data[ROUGH] + abs(s) * (first + 2.0 * second)))
    )
    return data[W0] ** 2 + 2.0 * s * inner, 2.0 * slope, noise


@inline
def reach(data, side):
    """(distance to the first zero of w^2 on that side, its bar); (inf, 0) if none within a turn,
    NaN if unsure.

    Each step ends where a parabola of the greatest curvature, which lies below w^2, has its zero:
    none is jumped over.
    """
    first, second = math.hypot(data[A1], data[B1]), math.hypot(data[A2], data[B2])
    bend = 2.02 * (first + 2.0 * second)
    x = 0.0
    for _ in range(200):
        h, slope, noise = square_of_w(data, side * x)
        slope *= side
        if h <= noise:
            if x > 0.0 or data[W0] == 0.0:
                if slope < 0.0 and slope * slope > 1e3 * noise * bend:
                    new = x - h / slope
                    return new, 2.0 * noise / -slope + 4.0 * ROUNDOFF_UP * new
                if not (data[W0] == 0.0 and x == 0.0 and slope > 0.0):
                    return math.nan, 0.0
        root = math.sqrt(slope * slope + 2.0 * bend * max(h, 0.0))
        step = (slope + root) / bend if slope > 0.0 else 2.0 * h / (root - slope)
        x += step
        if x >= TWO_PI:
            return math.inf, 0.0
        if step <= 2.0 * ROUNDOFF_UP * x:
            _h, slope, noise = square_of_w(data, side * x)
            slope *= side
            if slope < 0.0 and slope * slope > 1e3 * noise * bend:
                return x, 2.0 * noise / -slope + 4.0 * ROUNDOFF_UP * x
            return math.nan, 0.0
    return math.nan, 0.0


@inline
def first_kind(chi, kc2, quarter):
    """F(chi | m), 1 - m = kc2, for any chi (DLMF 19.25.5)."""
    j = math.floor(chi / math.pi + 0.5)
    s, c = math.sin(chi), math.cos(chi)
    s = -s if j % 2 else s
    square = c * c + kc2 * s * s
    return 2.0 * quarter * j + s * rf(c * c, 0.5 * (1.0 + square), math.sqrt(square))


@inline
def applies(p, phi0, w0):
    """(kind, mu, 1 - mu): NONE, LIBRATION if b = 0, TRIGONOMETRIC where g = (mu - 1) f (mu F + n)
    but for roundings.
    """
    b12, b31 = p[B12], p[B31]
    if p[D] == 0.0 and p[C23] == 0.0 and p[S2] == 0.0 and p[S3] == 0.0:
        return TRIGONOMETRIC, 1.0, 0.0
    square = b12 * b12 + b31 * b31
    if square == 0.0:
        return LIBRATION, 0.0, 0.0
    u, v = b12 * b12 - b31 * b31, b12 * b31
    delta = (p[D] * u + 4.0 * p[C23] * v) / (u * u + 4.0 * v * v)
    sigma = (p[S2] * b12 + p[S3] * b31) / square
    rest = 0.5 * abs(p[D] - delta * u) + abs(p[C23] - delta * v)
    rest += abs(p[S2] - sigma * b12) + abs(p[S3] - sigma * b31)
    b = math.sqrt(square)
    inner = 0.25 - delta
    if inner < -SAME:
        return NONE, 0.0, 0.0
    root = math.sqrt(inner) if inner > SAME else 0.0
    for i in range(2):
        one, two = 0.5 + root, delta / (0.5 + root)
        mu, other = (one, two) if i == 0 else (two, one)
        size = b * (abs(sigma) + abs(delta) * b + abs(other) * (abs(w0) + abs(mu) * b))
        if not rest <= SAME * size:  # as a rule, and no sine is needed
            continue
        n = w0 - mu * (b12 * math.sin(phi0) + b31 * math.cos(phi0))
        miss = rest + b * (abs(other * n + sigma) + b * abs(delta - mu * other))
        if miss <= SAME * size:
            return TRIGONOMETRIC, mu, other
    return NONE, 0.0, 0.0


@kernel
def served(rows, which):
    """Note for which rows of GIVEN numbers (see `records`) a closed form applies."""
    for i in range(len(rows)):
        which[i] = applies(rows[i], rows[i, rc.PHI0], rows[i, rc.W0])[0] != NONE


@kernel
def start(p, phi0, w0, data):
    """Fill data for the solution from (phi0, w0); returns (kind, side): multiply x and w by side."""
    kind, mu, other = applies(p, phi0, w0)
    side = 1.0 if w0 >= 0.0 else -1.0
    if kind == TRIGONOMETRIC:
        start_trigonometric(p, phi0, w0, side, mu, other, data)
        return kind, side
    if kind == NONE:
        return kind, side
    local(p, phi0, side, data)
    if w0 == 0.0 and data[A1] + data[A2] < 0.0:
        side = -1.0
        data[A1], data[A2] = -data[A1], -data[A2]
    data[W0] = abs(w0)
    right, bar_right = reach(data, 1.0)
    if right == math.inf:
        return (ROTATION if start_rotation(data) else LOST), side
    if w0 == 0.0:
        left, bar_left = 0.0, 0.0
    else:
        left, bar_left = reach(data, -1.0)
    if not (math.isfinite(left) and math.isfinite(right)):
        return LOST, side
    data[LEFT], data[RIGHT], data[BAR_LEFT], data[BAR_RIGHT] = left, right, bar_left, bar_right
    return (LIBRATION if start_libration(data) else LOST), side


@inline
def start_trigonometric(p, phi0, w0, side, mu, other, data):
    s, c = math.sin(phi0), math.cos(phi0)
    F = mu * (p[B12] * s + p[B31] * c)
    f = mu * (p[B12] * c - p[B31] * s)
    b = math.hypot(p[B12], p[B31])
    data[W0], data[F0], data[SLOPE], data[MU], data[OTHER] = abs(w0), side * F, f, mu, other
    data[SQUARE] = (abs(w0) - 2.0 * side * F) * abs(w0) - f * f  # n^2 - (mu b)^2
    offset, miss, blur = misfit(p[B12], p[B31], p[D], p[C23], p[S2], p[S3], mu, other, w0, F)
    slack = 6.0 * ROUNDOFF_UP * abs(mu) * b
    data[NOISE] = slack + (4.0 * ROUNDOFF_UP * abs(w0) + 2.0 * b * blur if b > 0.0 else 0.0)
    data[OFFSET], data[MISS], data[GAIN] = (
        offset + (0.0 if other == 0.0 else slack),
        miss,
        b * abs(other),
    )


@inline
def deviating(data, x, t, w):
    """Bound of w - (mu F + n) until phi0 + x, which is reached at t with w: see `trigonometric.deviation`."""
    F, f = data[F0], data[SLOPE]
    slope = f * math.cos(x) - F * math.sin(x)
    return deviation(data[OFFSET], data[MISS], data[GAIN], data[MU], data[OTHER], data[W0], F, f, data[SQUARE], w,
                     slope, t)  # fmt: skip


@inline
def trigonometric_reach(data, x):
    """(t, bar t) at which phi0 + x, x >= 0, is reached; inf beyond an equilibrium, NaN if rounding
    leaves it open.
    """
    w0, f, square = data[W0], data[SLOPE], data[SQUARE]
    if data[F0] == 0.0 and f == 0.0:
        t = x / w0
        return t, (2.0 * ROUNDOFF_UP + deviating(data, x, t, w0) / w0) * t
    root = math.sqrt(abs(square))
    turns = math.floor(0.5 * x / math.pi + 0.5)
    rest = 0.5 * x - turns * math.pi
    y1, y2 = math.sin(rest), w0 * math.cos(rest) + f * math.sin(rest)
    blur = 4.0 * ROUNDOFF_UP * (w0 * abs(math.cos(rest)) + abs(f * y1))
    if square > 0.0:
        theta = (math.atan2(root * y1, y2) + turns * math.pi) / root
        near = y2 * y2 + square * y1 * y1
        s, c = math.sin(root * theta) / root, math.cos(root * theta)
        total = drift(w0, f, square, theta, s, c, 1.0)
    else:
        if x >= TWO_PI:
            return math.inf, 0.0
        if turns == 1.0:
            y1, y2 = -y1, -y2
        margin = y2 - root * y1
        if margin <= 0.0:
            return (math.inf if margin < -1e3 * (blur + data[NOISE]) else math.nan), 0.0
        near = margin * (y2 + root * y1)
        if root * y1 >= y2:
            return math.nan, 0.0
        theta = math.atanh(root * y1 / y2) / root if root > 0.0 else y1 / y2
        if root * theta > 300.0:
            return math.nan, 0.0
        s = math.sinh(root * theta) / root if root > 0.0 else theta
        total = drift(w0, f, square, theta, s, math.cosh(root * theta), 1.0)
    t = 2.0 * theta
    # the formula is evaluated with rounded data, which moves Delta^2 as well
    moved = deviating(data, x, t, near / w0)  # near = w0 w
    bar = (data[NOISE] + moved) * total / w0 + 2.0 * abs(y1) * blur / near + 6.0 * ROUNDOFF_UP * t
    bar += 3.0 * ROUNDOFF_UP * (abs(x) + 1.0) * w0 / near * 2.0
    return t, MARGIN * bar


@inline
def start_libration(data):
    """Turning points, parameter m and phase of the libration; False where the digits are lost."""
    left, right = data[LEFT], data[RIGHT]
    middle, half = 0.5 * (right - left), 0.5 * (right + left)
    s, c = math.sin(middle), math.cos(middle)
    s2, c2 = 2.0 * s * c, (c - s) * (c + s)
    b1 = data[B1] * c - data[A1] * s
    a2 = data[A2] * c2 + data[B2] * s2
    b2 = data[B2] * c2 - data[A2] * s2
    ch, sh = math.cos(half), math.sin(half)
    # w^2 = sin((x - a)/2) sin((b - x)/2) Q, Q = q0 + q1 cos xi + p1 sin xi, xi = x - middle
    q0, q1, p1 = -4.0 * b1 - 4.0 * b2 * ch, -4.0 * b2, 4.0 * a2
    qa, qb = q0 + q1 * ch - p1 * sh, q0 + q1 * ch + p1 * sh
    first, second = math.hypot(data[A1], data[B1]), math.hypot(data[A2], data[B2])
    blur = 4.0 * (first + 3.0 * second) * (8.0 * ROUNDOFF_UP + data[BAR_LEFT] + data[BAR_RIGHT])
    if not (qa > 30.0 * blur and qb > 30.0 * blur and sh > 0.0):
        return False
    product = math.sqrt(qa) * math.sqrt(qb)
    beta = (q0 * ch + q1) / product
    kc2 = 0.5 * (1.0 + beta)
    if beta < 0.0:
        kc2 = 0.5 * sh * sh * (q0 * q0 - q1 * q1 - p1 * p1) / (product * product * (1.0 - beta))
    rho = blur / qa + blur / qb
    bar = 0.5 * (2.0 * blur / product + abs(beta) * rho)
    if not kc2 > 30.0 * bar:
        return False
    data[RATIO], data[RHO], data[RHO_M] = math.sqrt(qa / qb), rho, bar / kc2
    data[OMEGA], data[KC2], data[KC] = 0.5 * math.sqrt(product), kc2, math.sqrt(kc2)
    quarter, _second = complete(0.0, data[KC])
    data[QUARTER] = quarter
    v = math.sin(0.5 * left) / math.sin(0.5 * right)
    chi = 2.0 * math.atan(math.sqrt(v / data[RATIO]))
    data[THETA0] = first_kind(chi, kc2, quarter)
    if left == 0.0:
        data[SLACK] = 0.0
        return True
    edge = data[BAR_LEFT] / left + data[BAR_RIGHT] / right + rho + 8.0 * ROUNDOFF_UP
    data[SLACK] = (
        0.5 * math.sin(chi) * edge / math.sqrt(math.cos(chi) ** 2 + kc2 * math.sin(chi) ** 2)
    )
    return True


@inline
def phase_bar(data, theta):
    """Bound of the error of theta - theta0, as time."""
    angle = theta + data[THETA0]
    relative = (
        0.25 * data[RHO] * theta + 0.5 * data[RHO_M] * angle + 12.0 * ROUNDOFF_UP * (angle + 1.0)
    )
    return (relative + data[SLACK]) / data[OMEGA]


@inline
def flight(data, chi, slack):
    """(t, bar t) at which chi >= chi0 is reached; slack is the error of chi."""
    theta = first_kind(chi, data[KC2], data[QUARTER])
    slack += 8.0 * ROUNDOFF_UP * (1.0 + abs(chi))
    slack /= math.sqrt(math.cos(chi) ** 2 + data[KC2] * math.sin(chi) ** 2)
    return (theta - data[THETA0]) / data[OMEGA], MARGIN * (
        phase_bar(data, theta) + slack / data[OMEGA]
    )


@inline
def libration_reach(data, x):
    """(t, bar t) at which phi0 + x, x in [0, RIGHT], is first reached."""
    ahead, behind = data[RIGHT] - x, data[LEFT] + x
    chi = 2.0 * math.atan2(
        math.sqrt(math.sin(0.5 * behind)), math.sqrt(data[RATIO] * math.sin(0.5 * ahead))
    )
    blur = 2.0 * ROUNDOFF_UP * (data[LEFT] + data[RIGHT])
    edge = (data[BAR_LEFT] + blur) / behind if behind > 0.0 else 0.0
    edge += (data[BAR_RIGHT] + blur) / ahead if ahead > 0.0 else 0.0
    slack = 0.5 * math.sin(chi) * (edge + data[RHO])
    return flight(data, chi, slack)


@inline
def start_rotation(data):
    """The complex roots of w^2 (z = e^{ix}) within the unit circle and the map; False where the
    digits are lost.

    w^2 = kappa |z^2 - sigma z + pi|^2: pi and sigma follow from y = 2 kappa, the greatest root of one equation, that
    Newton's method reaches from above. What the roots r, s miss of the coefficients is carried as an error of w^2.
    """
    a1, b1, a2, b2 = data[A1], data[B1], data[A2], data[B2]
    mean = data[W0] ** 2 + 2.0 * b1 + b2
    # w^2 = mean + Re(first z + second z^2)
    first, second = complex(-2.0 * b1, -2.0 * a1), complex(-b2, -a2)
    top, cross, tail = abs2(first), (second.conjugate() * first * first).real, abs2(second)
    y = 2.0 * mean
    for _ in range(100):
        q = y * y - tail
        number = top * (y * y + tail) - 2.0 * y * cross
        value = 0.5 * (y + tail / y + y * number / (q * q)) - mean
        slope = 0.5 - 0.5 * tail / (y * y) + 0.5 * (number + 2.0 * y * (y * top - cross)) / (q * q)
        slope -= 2.0 * y * y * number / (q * q * q)
        move = value / slope
        if not move > 2.0 * ROUNDOFF_UP * y:
            break
        y -= move
    q = y * y - tail
    if not (mean > 0.0 and q > 0.0):
        return False
    sigma, pi = (second.conjugate() * first - y * first.conjugate()) / q, second.conjugate() / y
    spread = cmath.sqrt(0.25 * sigma * sigma - pi)
    r, s = 0.5 * sigma + spread, 0.5 * sigma - spread
    if not (abs2(r) < 1.0 and abs2(s) < 1.0):
        return False
    kappa = mean / ((1.0 + abs2(r)) * (1.0 + abs2(s)) + 2.0 * (r * s.conjugate()).real)
    c1 = -2.0 * kappa * (r.conjugate() * (1.0 + abs2(s)) + s.conjugate() * (1.0 + abs2(r)))
    c2 = 2.0 * kappa * r.conjugate() * s.conjugate()
    gaps = (
        abs(c1 - first)
        + abs(c2 - second)
        + 12.0 * ROUNDOFF_UP * (abs(mean) + abs(first) + abs(second))
    )
    least = kappa * ((1.0 - abs(r)) * (1.0 - abs(s))) ** 2
    if not least > 30.0 * gaps:
        return False
    gap = (s - r) / (1.0 - r.conjugate() * s)
    kc2 = (1.0 - abs2(r)) * (1.0 - abs2(s)) / abs2(1.0 - r.conjugate() * s)
    step = gap / (1.0 + math.sqrt(kc2))
    centre = (step + r) / (1.0 + r.conjugate() * step)
    image = (s - centre) / (1.0 - centre.conjugate() * s)
    scale = abs(1.0 - centre.conjugate() * r) * abs(1.0 - centre.conjugate() * s)
    data[OMEGA] = (1.0 + abs2(image)) * math.sqrt(kappa) * scale / (1.0 - abs2(centre))
    data[KC2], data[KC] = kc2, math.sqrt(kc2)
    data[RE], data[IM], data[TILT] = (
        centre.real,
        centre.imag,
        math.atan2(image.imag, image.real) + 0.5 * math.pi,
    )
    data[QUARTER], _second = complete(0.0, data[KC])
    data[LEAST], data[MISFIT] = least, gaps
    data[RHO], data[RHO_M] = 0.0, 0.0
    data[SLACK] = 16.0 * ROUNDOFF_UP * (1.0 + 2.0 / (1.0 - abs(centre))) / data[KC]
    data[THETA0] = first_kind(mapped(data, 0.0), kc2, data[QUARTER])
    return True


@inline
def abs2(z):
    return z.real * z.real + z.imag * z.imag


@inline
def mapped(data, x):
    """chi at phi0 + x."""
    c = complex(data[RE], data[IM])
    v = 1.0 - c * complex(math.cos(x), -math.sin(x))
    return x + 2.0 * math.atan2(v.imag, v.real) - data[TILT]


@inline
def rotation_bar(data, theta, t):
    centre = math.hypot(data[RE], data[IM])
    return phase_bar(data, theta + abs(data[THETA0])) + t * (
        0.5 * data[MISFIT] / data[LEAST] + 16.0 * ROUNDOFF_UP / (1.0 - centre)
    )


@inline
def rotation_reach(data, x):
    """(t, bar t) at which phi0 + x is reached."""
    chi = mapped(data, x)
    t, bar = flight(data, chi, 8.0 * ROUNDOFF_UP * (1.0 + abs(x)))
    return t, bar + MARGIN * (
        rotation_bar(data, 0.0, t)
        + data[SLACK] / data[OMEGA]
        + 8.0 * ROUNDOFF_UP * abs(x) / math.sqrt(data[LEAST])
    )


@inline
def scratch():
    """Empty data."""
    return np.zeros(SIZE)
