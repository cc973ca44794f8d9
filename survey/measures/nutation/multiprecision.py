"""Nutations in decimal arithmetic with as many digits as a point takes: the few that double-double
leaves open.

The set-up of `kernels.nutation.wells` is double-double already, so where its error bounds are too
wide (1e-26 from separatrices) only more digits help. Each point is solved with twice the digits
until the answers agree; their difference bounds the error of the last one. No subtraction is
avoided; digits make up for it. What stays open after MOST lies on a separatrix or a regular
precession, as far as can be decided. A point takes about a millisecond.

Formulas (S1)-(S14) of `scenes/brun.md`; the quartic by Ferrari's resolvent.
"""

from decimal import (
    MAX_EMAX,
    MIN_EMIN,
    Context,
    Decimal,
    DivisionByZero,
    InvalidOperation,
    getcontext,
    localcontext,
)
from functools import cache
from itertools import pairwise

from survey.kernels.math.roundoff import ROUNDOFF

FIRST, MOST = 50, 400  # digits
SURE = 3  # a third of the digits at least are right where a sign is trusted
CLOSE = Decimal("1e-20")  # relative to 1 + |value|, of answers that agree
LEAST = 5e-324
HALF, ONE, TWO, FOUR = Decimal("0.5"), Decimal(1), Decimal(2), Decimal(4)
CUSP = Decimal("0.15")  # saddles need |a b| < 4 k / 27
FAR = Decimal("1e38")  # as in `wells.distance`


class Unclear(ArithmeticError):
    """These digits do not decide."""


class NoMotion(Exception):
    """No motion has these integrals."""


def of_state(size_a, size_c, epsilon, theta, p_theta, b, a):
    """For an initial state: does it pass a pole, the number of wells, [{name: value, name_error:
    bound}] of its own.

    None where it stays open.
    """
    if not p_theta and (not theta or not (a or b or epsilon * (size_a - size_c))):
        return None  # upright, or at rest: exactly
    given = tuple(map(Decimal, (size_a, size_c, epsilon, theta, p_theta, b, a)))
    return _settled(lambda: _of_state(*given))


def of_integrals(level, a, b, ratio, sign):
    """As `of_state`, at (l, alpha, beta), of all wells, lower u first. Raises NoMotion."""
    given = tuple(map(Decimal, (sign, level, a, b, 1.0, ratio)))
    return _settled(lambda: _solved(*given, None))


def _settled(solve):
    before = None
    digits = FIRST
    while digits <= MOST:
        with localcontext(Context(prec=digits, Emax=MAX_EMAX, Emin=MIN_EMIN)):
            try:
                now = solve()
            except (Unclear, DivisionByZero, InvalidOperation):  # 0 for what has yet too few digits
                now = None
            if now is not None and before is not None and _agree(before, now):
                passes, number, found = now
                _passes, _number, rougher = before
                return passes, number, [_rounded(*x) for x in zip(rougher, found, strict=True)]
        before, digits = now, 2 * digits
    return None


def _agree(before, now):
    """Do two answers agree, that of fewer digits and that of more?"""
    *kind, rougher = before
    *same, found = now
    if kind != same:
        return False
    pairs = list(zip(rougher, found, strict=True))
    return all(x.keys() == y.keys() for x, y in pairs) and all(
        abs(x[name] - y[name]) <= CLOSE * (ONE + abs(y[name])) for x, y in pairs for name in y
    )


def _rounded(before, now):
    """{name: float64, name_error: its error bound}: half an ulp, and what fewer digits make of it."""
    found = {}
    for name, exact in now.items():
        value, apart = float(exact), float(abs(exact - before[name]))
        found |= {name: value, f"{name}_error": ROUNDOFF * abs(value) + 2.0 * apart + LEAST}
    return found


def _of_state(size_a, size_c, epsilon, theta, p_theta, b, a):
    """(S1)."""
    k = epsilon * size_a * (size_a - size_c)
    v = versine(theta)
    w = TWO - v
    square = (HALF * ((b - a) * w + (b + a) * v)) ** 2 / (v * w) if theta else Decimal(0)
    u = ONE - v
    level = p_theta * p_theta + square - k * u * u + a * a
    return _solved(k, level, a, b, size_a, size_c, u)


def _solved(k, level, a, b, size_a, size_c, u):
    """Passage?, the number of wells, and the outputs of all of them or of the one that holds u."""
    ends = wells(k, level, a, b)
    mine = (
        ends
        if u is None
        else [well for well in ends if well[0] - _slack() <= u <= well[1] + _slack()]
    )
    if u is not None and len(mine) != 1:
        raise Unclear
    if not mine:
        raise NoMotion
    passes = any((a == b and high == ONE) or (a == -b and low == -ONE) for low, high in mine)
    distance = separatrix_distance(k, level, a, b)
    return (
        passes,
        len(ends),
        [_outputs(k, level, a, b, size_a, size_c, *well) | distance for well in mine],
    )


def _slack():
    """Points that are nearer to one another than this count as one."""
    return Decimal(10) ** (-getcontext().prec // SURE)


def versine(theta):
    """1 - cos theta, to a few digits less than those of the context: the series, and 10 doublings
    of the angle.
    """
    x = (theta / 1024) ** 2
    total, term, n = Decimal(0), HALF * x, 2
    while total + term != total:
        total += term
        term *= -x / ((n + 1) * (n + 2))
        n += 2
    for _ in range(10):
        total = TWO * total * (TWO - total)
    return total


def wells(k, level, a, b):
    """The pairs of turning points in [-1, 1] between which P > 0, lower u first."""
    slack = _slack()
    roots = _snapped(sorted(_real_roots(k, level, a, b)), a, b)
    if any(0 < abs(ONE - abs(u)) < slack for u in roots):
        raise Unclear
    inside = [u for u in roots if abs(u) <= ONE]

    def height(u):
        return (ONE - u * u) * (level + k * u * u) - (a * a + b * b - TWO * a * b * u)

    return [(low, high) for low, high in pairwise(inside) if height(HALF * (low + high)) > 0]


def _snapped(roots, a, b):
    """With poles that are roots of P exactly."""
    for pole, here in ((ONE, a == b), (-ONE, a == -b)):
        near = [i for i, u in enumerate(roots) if abs(u - pole) < _slack()]
        if here and len(near) != 1:
            raise Unclear
        if here:
            roots[near[0]] = pole
    return roots


def _real_roots(k, level, a, b):
    """The real roots that matter of P (S2): u^4 + p u^2 + q u + r, k times."""
    c1, c0 = TWO * a * b, level - a * a - b * b
    if k == 0:
        return _of_quadratic(HALF * c1 / -level, c0 / -level) if level else []
    p, q, r = (level - k) / k, -c1 / k, -c0 / k
    if q == 0:
        return [
            sign * z.sqrt() for z in _of_quadratic(HALF * p, r, positive=True) for sign in (1, -1)
        ]
    y = _largest(TWO * p, p * p - FOUR * r, -q * q)
    w = y.sqrt()
    found = []
    for side in (1, -1):
        found += _of_quadratic(
            HALF * side * w, HALF * (p + y) - side * q / (TWO * w), abs(p) + abs(q / w)
        )
    return found


def _of_quadratic(half, c, size=0, positive=False):
    """Real roots of x^2 + 2 half x + c, terms of that size; that may be in [-1, 1], or are positive."""
    square = half * half - c
    rough = (half * half + abs(c) + size) * _slack() ** 2
    if abs(square) <= rough:
        if abs(half) > ONE + _slack() or (positive and half > 0):
            return []
        raise Unclear
    if square < 0:
        return []
    root = square.sqrt()
    far = -half - root if half > 0 else -half + root
    both = [far, c / far if far else -far]
    if not positive:
        return both
    if any(abs(x) <= rough for x in both):
        raise Unclear
    return [x for x in both if x > 0]


def _largest(c2, c1, c0):
    """The greatest root of y^3 + c2 y^2 + c1 y + c0, c0 < 0: Newton's method from above, in a
    bracket if it is lost.
    """
    size = max(abs(c2), abs(c1).sqrt(), Decimal(10) ** (abs(c0).adjusted() // 3 + 1))
    low, high, close = Decimal(0), TWO * size, Decimal(10) ** (2 - getcontext().prec)
    y = high
    for _ in range(4 * getcontext().prec):
        height = ((y + c2) * y + c1) * y + c0
        low, high = (low, y) if height > 0 else (y, high)
        slope = (3 * y + TWO * c2) * y + c1
        new = y - height / slope if slope > 0 else low
        if not low < new < high:
            new = HALF * (low + high)
        if abs(new - y) <= close * y:
            return new
        y = new
    raise Unclear


def separatrix_distance(k, level, a, b):
    """{name: (L - W at the saddle)/|k|}, or nothing where there is none, or FAR away."""
    value = None
    if k < 0 and abs(a) == abs(b) and a * a < -FOUR * k:
        value = (level + k - a * a) / -k
    elif k > 0 and abs(a * b) < CUSP * k:
        u = _saddle(k, a, b)
        if u is not None:
            rest = (ONE - u) * (ONE + u)
            value = (rest * (level + k * u * u) - (a * a + b * b - TWO * a * b * u)) / (rest * k)
    return {} if value is None or abs(value) > FAR else {"separatrix_distance": value}


def _saddle(k, a, b):
    """The increasing zero of F, from the point where F' is greatest: F is convex towards it."""
    u, bend = Decimal(0), a * b / k
    while True:
        move = (u * (10 * u * u - 6) + bend) / (30 * u * u - 6)
        u -= move
        if abs(move) <= abs(u) * _slack() ** 2:
            break
    last = None
    while True:
        rest = (ONE - u) * (ONE + u)
        rise = k * rest * (ONE - 5 * u * u) - b * (b - a * u) - a * (a - b * u)
        if not rise > 0:
            return None
        move = ((a - b * u) * (b - a * u) + k * u * rest * rest) / rise
        if abs(move) <= abs(u) * _slack() ** 2 or (
            last is not None and abs(move) >= last and abs(move) < _slack()
        ):
            return u - move
        u, last = u - move, abs(move)


def _outputs(k, level, a, b, size_a, size_c, low, high):
    """(S5), (S12)-(S14)."""
    total, product = low + high, low * high
    q0 = level - k + k * (total * total - product)
    at_low, at_high = k * low * (low + total) + q0, k * high * (high + total) + q0
    g = (at_low * at_high).sqrt()
    above = level - k + Decimal("1.5") * k * total * total + g
    if not (at_low > 0 and at_high > 0 and above > 0):
        raise Unclear
    x, y = (HALF * above).sqrt(), g.sqrt()
    mean, series = _mean(x, y)
    period = TWO * pi() / mean
    up = _advance(b - a, ONE - high, ONE - low, high - low, at_low, period, x, y)
    down = _advance(b + a, ONE + low, ONE + high, high - low, at_high, period, x, y)
    rest = HALF * (HALF * above - series)
    action = period * (level - HALF * (k * product + q0) + rest) - (b - a) * up - (b + a) * down
    drift = a * (size_a - size_c) / (size_a * size_c)
    return {
        "u_min": low,
        "u_max": high,
        "period": size_a * period,
        "precession": up + down,
        "spin": down - up + drift * size_a * period,
        "action": action / (TWO * pi()),
    }


def _mean(x, y):
    """As `kernels.math.third_kind.mean`."""
    weight, total, close = ONE, Decimal(0), _slack() ** 2
    while True:
        c = HALF * (x - y)
        weight *= 2
        total += weight * c * c
        x, y = HALF * (x + y), (x * y).sqrt()
        if abs(c) <= close * x:
            return HALF * (x + y), total


def _advance(gap, near, far, width, square, period, x, y):
    """(S13): (b -+ a) J/A."""
    if gap == 0:
        return Decimal(0)
    p0, g = square * near / far, y * y
    half = HALF * (p0 + g) / p0.sqrt()
    ratio = ONE + HALF * (p0 - g) / (p0 + g) * _third(x, y, half)
    return HALF * gap * period / far * (ONE + HALF * width * ratio / near)


def _third(x, y, p):
    """(S12)."""
    total, weight, close = Decimal(0), ONE, _slack() ** SURE
    while abs(weight) > close * abs(total):
        total += weight
        xy = x * y
        weight *= HALF * (p * p - xy) / (p * p + xy)
        p = HALF * (p + xy / p)
        x, y = HALF * (x + y), xy.sqrt()
    return total


def pi():
    """pi to the digits of the context."""
    return _pi(getcontext().prec)


@cache
def _pi(digits):
    """Machin's formula, in integers."""
    one = 10 ** (digits + 10)

    def arctan(n):
        total, term, m, sign = 0, one // n, 1, 1
        while term:
            total += sign * (term // m)
            term, m, sign = term // (n * n), m + 2, -sign
        return total

    return Decimal(4 * (4 * arctan(5) - arctan(239))).scaleb(-digits - 10)
