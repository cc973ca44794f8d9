"""The whole gyrostat by other means, with mpmath: motions by Taylor series, multipliers from
motions beside them.
"""

import flow_truth
import mpmath as mp


def tensors(body):
    """A, B, C as matrices and lambda, s as lists, of the scene's parameters; what is not given has
    its default.
    """
    given = {name: mp.mpf(value) for name, value in body.items()}

    def matrix(name):
        entry = {
            key: given.get(f"{name}{key}", mp.mpf(1 if name == "A" and key[0] == key[1] else 0))
            for key in KEYS
        }
        return mp.matrix(
            [[entry["11"], entry["12"], entry["31"]], [entry["12"], entry["22"], entry["23"]],
             [entry["31"], entry["23"], entry["33"]]]
        )  # fmt: skip

    vectors = [[given.get(f"{name}{i}", mp.mpf(0)) for i in (1, 2, 3)] for name in ("lambda", "s")]
    return (*(matrix(name) for name in "ABC"), *vectors)


KEYS = ("11", "22", "33", "12", "23", "31")


def turned(body, Q):
    """The body's parameters, as mpf, in axes in which its vectors v become Q v; `body` may hold
    omega and gamma too.
    """
    A, B, C, moment, s = tensors(body)
    out = {}
    for name, tensor in zip("ABC", (A, B, C), strict=True):
        new = Q * tensor * Q.T
        out |= {f"{name}{key}": new[int(key[0]) - 1, int(key[1]) - 1] for key in KEYS}
    state = [[mp.mpf(body.get(f"{name}{i}", 0)) for i in (1, 2, 3)] for name in ("omega", "gamma")]
    for name, vector in zip(("lambda", "s", "omega", "gamma"), (moment, s, *state), strict=True):
        new = Q * mp.matrix(vector)
        out |= {f"{name}{i + 1}": new[i] for i in range(3)}
    return out


def rotation(a, b, c, d):
    """The rotation matrix of a quaternion, of any length."""
    a, b, c, d = (mp.mpf(x) for x in (a, b, c, d))
    n = a * a + b * b + c * c + d * d
    return mp.matrix([
        [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
        [2 * (b * c + a * d), a * a - b * b + c * c - d * d, 2 * (c * d - a * b)],
        [2 * (b * d - a * c), 2 * (c * d + a * b), a * a - b * b - c * c + d * d],
    ]) / n  # fmt: skip


def _series(body, inverse, state, order):
    """Taylor coefficients of w and nu: A w' = (A w + lambda) x w + (B w) x nu + nu x (C nu) + s x
    nu, nu' = nu x w.
    """
    A, B, C, moment, s = body
    w, nu = [[x] for x in state[:3]], [[x] for x in state[3:]]
    Aw, Bw, Cnu = ([], [], []), ([], [], []), ([], [], [])
    for n in range(order):
        for i in range(3):
            Aw[i].append(sum(A[i, j] * w[j][n] for j in range(3)) + (moment[i] if n == 0 else 0))
            Bw[i].append(sum(B[i, j] * w[j][n] for j in range(3)))
            Cnu[i].append(sum(C[i, j] * nu[j][n] for j in range(3)))
        torque, turn = [], []
        for i in range(3):
            a, b = (i + 1) % 3, (i + 2) % 3
            total = s[a] * nu[b][n] - s[b] * nu[a][n]
            for x, y in ((Aw, w), (Bw, nu), (nu, Cnu)):
                total += mp.fdot(x[a], y[b][::-1]) - mp.fdot(x[b], y[a][::-1])
            torque.append(total)
            turn.append(mp.fdot(nu[a], w[b][::-1]) - mp.fdot(nu[b], w[a][::-1]))
        for i in range(3):
            w[i].append(sum(inverse[i, j] * torque[j] for j in range(3)) / (n + 1))
            nu[i].append(turn[i] / (n + 1))
    return w + nu


def _value(row, x):
    """The sum of a series of coefficients."""
    total = mp.mpf(0)
    for term in reversed(row):
        total = total * x + term
    return total


def motion(body, state, t, digits=40):
    """(w, nu) at t, a list of six mpf; `state` is a sequence of six."""
    with mp.workdps(digits):
        system, state, left = tensors(body), [mp.mpf(x) for x in state], mp.mpf(t)
        inverse = system[0] ** -1
        while left:
            rows = _series(system, inverse, state, digits)
            largest = max(
                abs(c) ** (mp.mpf(1) / n) for row in rows for n, c in list(enumerate(row))[-2:]
            )
            step = mp.sign(left) * min(abs(left), 1 / (10 * largest))
            state = [_value(row, step) for row in rows]
            left -= step
        return state


def returned(six, phi, w, rotates, digits=40):
    """(time, phi, w) at which the reduced motion has made a turn, or (from w = 0) comes to rest for
    the second time.
    """
    with mp.workdps(digits):
        six, phi, w, t = [mp.mpf(x) for x in six], mp.mpf(phi), mp.mpf(w), mp.mpf(0)
        target, sign, rests = phi + 2 * mp.pi * mp.sign(w), None, 0
        while True:
            rows = flow_truth.series(six, phi, w, digits)
            step = 1 / (
                10
                * max(
                    abs(c) ** (mp.mpf(1) / n) for row in rows for n, c in list(enumerate(row))[-2:]
                )
            )
            at = [_value(row, step) for row in rows]
            ahead = _value(rows[1], step / 1000) if sign is None else sign
            turned_back = not rotates and ahead * at[1] < 0
            rests += turned_back
            if (rotates and (at[0] - target) * mp.sign(w) >= 0) or rests == 2:
                row = rows[0] if rotates else rows[1]
                goal = target if rotates else mp.mpf(0)
                step = mp.findroot(lambda x: _value(row, x) - goal, (0, step), solver="anderson")  # noqa: B023
                return t + step, *(_value(row, step) for row in rows)
            (phi, w), t, sign = at, t + step, mp.sign(at[1])


def cycle(six, phi, w, rotates, digits=40):
    """The reduced cycle next to a start, to all digits: (phi, w, period)."""
    with mp.workdps(digits):

        def off(x):
            _t, end, speed = returned(six, *((phi, x) if rotates else (x, 0)), rotates, digits)
            return (speed if rotates else end) - x

        x = mp.findroot(off, (mp.mpf(w if rotates else phi), mp.mpf(w if rotates else phi) * (1 + mp.mpf(10) ** -9)),
                        solver="secant", tol=mp.mpf(10) ** -digits)  # fmt: skip
        start = (mp.mpf(phi), x) if rotates else (x, mp.mpf(0))
        return (*start, returned(six, *start, rotates, digits)[0])


def multipliers(body, Q, theta, phi, w, period, digits=40):
    """Eigenvalues of the map of (w2, w3, eta) over the period, from motions beside it, in axes
    turned by Q.

    theta = None stands for pi/2.
    """
    with mp.workdps(digits):
        turned_body, h = turned(body, Q), mp.mpf(10) ** (-digits // 2)
        theta, phi, w = mp.pi / 2 if theta is None else mp.mpf(theta), mp.mpf(phi), mp.mpf(w)
        sin, cos = mp.sin(theta), mp.cos(theta)

        def start(kick):
            dw2, dw3, eta = kick
            nu = [
                cos + sin * eta,
                sin * mp.sin(phi) - cos * mp.sin(phi) * eta,
                sin * mp.cos(phi) - cos * mp.cos(phi) * eta,
            ]
            aligned = [w, dw2, dw3, *nu]
            return [*(Q * mp.matrix(aligned[:3])), *(Q * mp.matrix(aligned[3:]))]

        def end(kick):
            state = motion(turned_body, start(kick), period, digits)
            w_end, nu_end = Q.T * mp.matrix(state[:3]), Q.T * mp.matrix(state[3:])
            return [w_end[1], w_end[2], nu_end[0] / sin]

        base = end([0, 0, 0])
        assert max(abs(base[0]), abs(base[1]), abs(base[2] - cos / sin)) < mp.mpf(10) ** (
            -digits // 2 - 4
        )
        columns = [
            [(a - b) / h for a, b in zip(end([h * (i == j) for i in range(3)]), base, strict=True)]
            for j in range(3)
        ]
        return sorted(mp.eig(mp.matrix(columns).T, left=False, right=False), key=lambda x: -abs(x))
