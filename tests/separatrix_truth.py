"""Branches of the saddles with mpmath: from a point next to the saddle, by the series at it, to 40 digits."""

import mpmath as mp
from flow_truth import exact

DIGITS = 45


def saddles(six):
    """The saddles' angles, ascending in [0, 2 pi): roots of the quartic in tan(phi/2)."""
    _b12, _b31, d, c23, s2, s3 = map(mp.mpf, six)
    row = [-c23 - s2, 2 * (d - s3), 6 * c23, -2 * (d + s3), s2 - c23]
    found = [] if row[0] else [mp.pi]
    row = row[next((i for i, x in enumerate(row) if x), 4) :]
    found += [
        2 * mp.atan(u.real)
        for u in mp.polyroots(row, 2000, extraprec=900)
        if abs(u.imag) < mp.mpf(10) ** -20
    ]
    return sorted(x % (2 * mp.pi) for x in found if slope(six, x) > 0)


def slope(six, x):
    """g' at x."""
    _b12, _b31, d, c23, s2, s3 = map(mp.mpf, six)
    return -d * mp.cos(2 * x) + 2 * c23 * mp.sin(2 * x) - s2 * mp.sin(x) - s3 * mp.cos(x)


def branch(six, number, phi0, stable, left):
    """(angle of the saddle, w at phi0) of the branch that passes phi0 before it turns."""
    with mp.workdps(DIGITS):
        six = list(map(mp.mpf, six))
        angle, phi0 = saddles(six)[number - 1], mp.mpf(phi0)
        sign = -1 if stable else 1
        b12, b31, d, c23, s2, s3 = six
        f0, dg = b12 * mp.cos(angle) - b31 * mp.sin(angle), slope(six, angle)
        a = [0, (f0 + sign * mp.sqrt(f0**2 + 4 * dg)) / 2]
        f = [f0, -b12 * mp.sin(angle) - b31 * mp.cos(angle), -f0 / 2]
        double = d / 2 * mp.sin(2 * angle) + c23 * mp.cos(2 * angle)
        turned = d / 2 * mp.cos(2 * angle) - c23 * mp.sin(2 * angle)
        one, other = (
            s2 * mp.cos(angle) - s3 * mp.sin(angle),
            -s2 * mp.sin(angle) - s3 * mp.cos(angle),
        )
        g = [0, dg, -one / 2 + 2 * double, -other / 6 + mp.mpf(8) / 6 * turned]
        for n in (2, 3):
            known = (
                g[n]
                + sum(f[n - j] * a[j] for j in range(1, n))
                - sum(a[j] * (n + 1 - j) * a[n + 1 - j] for j in range(2, n))
            )
            a.append(known / ((n + 1) * a[1] - f0))
        x = (-1 if left else 1) * mp.mpf(10) ** -14
        phi, w = angle + x, sum(c * x**n for n, c in enumerate(a))
        turn = 2 * mp.pi
        goal = angle + ((phi0 - angle) % turn - (turn if left else 0))
        t = mp.log(abs(goal - angle) / abs(x)) / a[1]
        for _ in range(60):
            at, v = exact(six, phi, w, t, DIGITS, float_out=False)
            move = (goal - at) / v
            t += mp.sign(move) * min(abs(move), mp.mpf("0.3"))
            if abs(move) < mp.mpf(10) ** -40:
                return angle, v, (phi, w, t, phi0 - goal)
        raise ValueError("phi0 is not passed")


def at(six, start, t):
    """phi and w on the branch at the time t after phi0."""
    phi, w, origin, turned = start
    with mp.workdps(DIGITS):
        x, v = exact(six, phi, w, origin + mp.mpf(t), DIGITS, float_out=False)
        return x + turned, v
