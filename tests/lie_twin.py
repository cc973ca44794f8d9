"""The normal form at L4 once more, slow and plain: Deprit's triangle on dictionaries, 40 digits, no
symmetry used.

Independent of `survey/kernels/lie*`: another expansion (Legendre's recurrence, in normal modes that
are found from the linear equations), another transformation (one generator, all of its terms),
another arithmetic.
"""

from math import comb, factorial

from mpmath import mp, mpc, mpf, mpmathify


def bracket(f, g):
    """{f, g} of polynomials {(a1, a2, a3, b1, b2, b3): coefficient} in x, y with {x_j, y_j} = 1."""
    out = {}
    for m, c in f.items():
        for n, d in g.items():
            for j in range(3):
                number = m[j] * n[3 + j] - m[3 + j] * n[j]
                if number:
                    e = [a + b for a, b in zip(m, n, strict=True)]
                    e[j] -= 1
                    e[3 + j] -= 1
                    out[tuple(e)] = out.get(tuple(e), 0) + number * c * d
    return out


def multiply(f, g):
    out = {}
    for m, c in f.items():
        for n, d in g.items():
            e = tuple(a + b for a, b in zip(m, n, strict=True))
            out[e] = out.get(e, 0) + c * d
    return out


def combine(*parts):
    """The sum of (number, polynomial)."""
    out = {}
    for number, f in parts:
        for m, c in f.items():
            out[m] = out.get(m, 0) + number * c
    return out


def modes(mu):
    """(w1, -w2, 1) and the columns (xi, eta, zeta) and momenta of x1, x2, x3, y1, y2, y3."""
    x = mpf(27) / 4 * mu * (1 - mu)
    u = (1 + mp.sqrt(1 - 4 * x)) / 2
    omega = (mp.sqrt(u), -mp.sqrt(1 - u), mpf(1))
    k = 3 * mp.sqrt(3) / 4 * (1 - 2 * mu)
    columns = []
    for w in omega[:2]:
        rate = mpc(0, w)
        a, b = 2 * rate + k, rate**2 - mpf(3) / 4
        column = [a, b, 0, rate * a - b, rate * b + a, 0]
        size = -2 * (a * mp.conj(column[3]) + b * mp.conj(column[4])).imag
        columns.append([c / mp.sqrt(size) for c in column])
    half = 1 / mp.sqrt(2)
    columns.append([0, 0, half, 0, 0, mpc(0, half)])
    return omega, columns + [
        [mpc(0, 1) * mp.conj(mpmathify(c)) for c in column] for column in columns
    ]


def hamiltonian(mu, top):
    """(omega, {degree: polynomial}), degrees 2 to `top`."""
    omega, columns = modes(mu)
    units = [tuple(int(i == j) for i in range(6)) for j in range(6)]
    xi, eta, zeta = (
        {m: column[i] for m, column in zip(units, columns, strict=True) if column[i] != 0}
        for i in range(3)
    )
    square = combine((1, multiply(xi, xi)), (1, multiply(eta, eta)), (1, multiply(zeta, zeta)))
    H = {2: {tuple(int(i % 3 == j) for i in range(6)): mpc(0, omega[j]) for j in range(3)}}
    for sign, mass in ((1, 1 - mu), (-1, mu)):
        s = combine((mpf(sign) / 2, xi), (mp.sqrt(3) / 2, eta))
        before, R = {(0,) * 6: mpc(1)}, s
        for n in range(1, top):
            after = combine(
                (mpf(2 * n + 1) / (n + 1), multiply(s, R)),
                (mpf(-n) / (n + 1), multiply(square, before)),
            )
            before, R = R, after
            if n + 1 > 2:
                H[n + 1] = combine((1, H.get(n + 1, {})), (mass * -((-1) ** (n + 1)), R))
    return omega, H


def normal_form(mu, order):
    """{(i, j, k): complex coefficient of r1^i r2^j r3^k} of degrees 4, ..., order, r_j = i x_j y_j."""
    omega, H = hamiltonian(mu, order)
    count = order - 2
    # F[n, k]: column n, row k
    F = {(n, 0): combine((factorial(n), H[n + 2])) for n in range(count + 1)}
    W, out = {}, {}
    for n in range(1, count + 1):
        W[n] = {}
        for k in range(1, n + 1):
            m = n - k
            parts = [(comb(m, j), bracket(F[m - j, k - 1], W[j + 1])) for j in range(m + 1)]
            F[m, k] = combine((1, F[m + 1, k - 1]), *parts)
        known = F[0, n]
        off = {e: c for e, c in known.items() if e[:3] != e[3:]}
        # {H2, m} = rate m
        rate = {e: mpc(0, sum(omega[j] * (e[3 + j] - e[j]) for j in range(3))) for e in off}
        W[n] = {e: -c / rate[e] for e, c in off.items()}
        for k in range(1, n + 1):
            F[n - k, k] = combine((1, F[n - k, k]), (-1, off))
        diagonal = {e[:3]: c for e, c in known.items() if e[:3] == e[3:]}
        out |= {e: c / factorial(n) / mpc(0, 1) ** sum(e) for e, c in diagonal.items()}
    return out
