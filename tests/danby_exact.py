"""Danby's map in multiprecision: the factors that decide, the verdict and the collision by the
multipliers' angles.
"""

from mpmath import mp, mpf

STEPS, DIGITS, ORDER = 8, 36, 52


def factors(mu, e, steps, order=40):
    """A, B, C, D, t and K (as KC) over half a period by Taylor series in f, in the digits of mpmath now."""
    s = mp.sqrt(1 - 3 * mu * (1 - mu))
    d1, d2, h, whole = 3 * (1 + s) / 2, 3 * (1 - s) / 2, mp.pi / steps, mp.eye(4)
    for j in range(steps):
        c = [mp.cos(j * h), -mp.sin(j * h), -mp.cos(j * h), mp.sin(j * h)]
        below = [e * c[k % 4] * h**k / mp.factorial(k) + (k == 0) for k in range(order)]
        r = []
        for k in range(order):
            r.append(((k == 0) - mp.fdot(below[1 : k + 1], r[::-1])) / below[0])
        step = mp.matrix(4, 4)
        for column in range(4):
            x, q, p, m = ([mpf(column == i)] for i in range(4))
            for k in range(order - 1):
                dx, dm = h * (p[k] - m[k]) / (k + 1), h * (x[k] - q[k]) / (k + 1)
                q.append(-dx - h * d2 * mp.fdot(r[: k + 1], m[::-1]) / (k + 1))
                p.append(h * d1 * mp.fdot(r[: k + 1], x[::-1]) / (k + 1) - dm)
                x.append(dx)
                m.append(dm)
            step[:, column] = mp.matrix([mp.fsum(values) for values in (x, q, p, m)])
        whole = step * whole
    a, b = mp.det(whole[:2, :2]), mp.det(whole[2:, 2:])
    t = mp.fsum(whole[2 + i, 2 + j] * whole[i, j] for i in range(2) for j in range(2))
    c, d = mp.det(whole[2:, :2]), mp.det(whole[:2, 2:])
    return {"A": a, "B": b, "C": c, "D": d, "t": t, "KC": t * t - 4 * a * b}


def decided(mu, e):
    """(verdict, collision) at two floats."""
    with mp.workdps(DIGITS):
        found = factors(mpf(float(mu)), mpf(float(e)), STEPS, ORDER)
        ab, cd, t, k = found["A"] * found["B"], found["C"] * found["D"], found["t"], found["KC"]
        if k < 0:
            return 0, 2
        # w = -sin^2(theta / 2) is this less 1
        first, second = ((t + sign * mp.sqrt(k)) / 2 for sign in (1, -1))
        if not (ab > 0 and cd > 0 and 0 < t < 2):
            return 0, 1 if min(first, second) < 0 else 0
        if found["B"] * found["D"] > 0:
            return 1, 1
        less, more = (mp.acos(2 * w - 1) for w in (first, second))
        return 1, 2 if more - less < 2 * (mp.pi - more) else 1
