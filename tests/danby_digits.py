"""Danby's trace invariants to 40 digits and more with mpmath, also for e near 1, where the monodromy
matrix is large: Taylor series in the eccentric anomaly (`survey.truth.danby_flow` has the equations),
and M multiplied out.
"""

from mpmath import mp, mpf

DIGITS = 40  # of the invariants, besides those that products of four entries of Phi cancel
SPARE = 15


def invariants(mu, e):
    """a and b (mpf), to DIGITS digits and more of the larger of 1 and themselves."""
    spare = SPARE
    while True:
        with mp.workdps(DIGITS + spare):
            phi = _half_period(mpf(mu), mpf(e))
            largest = max(abs(x) for column in phi for x in column)
            needed = SPARE + int(4 * mp.log10(1 + largest))
            if needed <= spare:
                return _invariants(phi)
        spare = needed


def _half_period(mu, e):
    """The four solutions at E = pi, a column each, from unit vectors at E = 0."""
    order = mp.dps
    product = mu * (1 - mu)
    big = (1 + mp.sqrt(1 - 3 * product)) * 3 / 2
    small = product * 27 / 4 / big
    s = mp.sqrt((1 - e) * (1 + e))
    d1, d2 = big / s, small / s
    columns = [[mpf(int(i == j)) for i in range(4)] for j in range(4)]
    at, end = mpf(0), +mp.pi
    while at < end:
        g = _driver(e, s, at, order)
        series = [_solution(column, g, d1, d2, order) for column in columns]
        length = min(_reach(one, column) for column, own in zip(columns, series, strict=True)
                     for one in own)  # fmt: skip
        length = min(length, end - at)
        columns = [[mp.polyval(one[::-1], length) for one in own] for own in series]
        at = end if length == end - at else at + length
    return columns


def _driver(e, s, at, order):
    """Series of s / (1 - e cos E) about `at`."""
    c = [mpf(0)] * order
    a, b = -e * mp.cos(at), e * mp.sin(at)
    first = (1 - e) + 2 * e * mp.sin(at / 2) ** 2
    for n in range(1, order):
        a, b = b / n, -a / n
        c[n] = a
    g = [s / first]
    for n in range(1, order):
        g.append(-mp.fdot(c[1 : n + 1], g[n - 1 :: -1]) / first)
    return g


def _solution(state, g, d1, d2, order):
    """Series of x, q, p, m from their values."""
    x, q, p, m = ([value] for value in state)
    u, v = [], []
    for n in range(order - 1):
        u.append(p[n] - m[n])
        v.append(x[n] - q[n])
        back = g[n::-1] if n else g[:1]
        gu, gv = mp.fdot(back, u), mp.fdot(back, v)
        x.append(gu / (n + 1))
        q.append(-(gu + d2 * m[n]) / (n + 1))
        p.append((d1 * x[n] - gv) / (n + 1))
        m.append(gv / (n + 1))
    return x, q, p, m


def _reach(series, state):
    """How far a series goes until its last two terms are no more than rounding."""
    size = mp.eps * sum(map(abs, state))
    return min((size / max(abs(series[n]), size * mpf(10) ** -999)) ** (mpf(1) / n)
               for n in (len(series) - 2, len(series) - 1))  # fmt: skip


def _invariants(columns):
    """a and b of M = R Phi^-1 R Phi, R = diag(1, 1, -1, -1)."""
    phi = mp.matrix(4, 4)
    for j, column in enumerate(columns):
        for i, value in enumerate(column):
            phi[i, j] = value
    signs = mp.diag([1, 1, -1, -1])
    m = signs * mp.inverse(phi) * signs * phi
    pairs = [(i, j) for i in range(4) for j in range(i)]
    return (
        mp.fsum(m[i, i] for i in range(4)),
        mp.fsum(m[i, i] * m[j, j] - m[i, j] * m[j, i] for i, j in pairs),
    )
