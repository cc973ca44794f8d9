"""Resonances of order 3 and 4 on Danby's map: where they lie, and which of them destroy stability
in the plane.

    python workflows/libration_resonances.py -o results

The planar motion about a triangular point of the elliptic problem has a symplectic map over one
revolution. Its Taylor polynomial of degree 3 is carried along the motion; complex coordinates q1,
q2 that diagonalise the linear map, with {q, conj q} = -i, remove all quadratic terms but resonant
ones. With the angles theta of q1, q2 per revolution:

    order 3, k1 theta1 + k2 theta2 = 0 (mod 2 pi), k1 + k2 = 3, k >= 0: unstable if the resonant term is not 0;
    order 4, H4 = a11 I1^2 + a12 I1 I2 + a22 I2^2 + 2 B I1^(k1/2) I2^(k2/2) cos(...): unstable if
        2 B k1^(k1/2) k2^(k2/2) > |a11 k1^2 + a12 k1 k2 + a22 k2^2|, else stable in all terms to order 4.

Resonances with k1 k2 < 0 keep |k2| I1 + |k1| I2 to all orders and do no harm alone.

Source: A. P. Markeev, Libration points in celestial mechanics and cosmodynamics (1978), chapters 2,
3 and 9.
"""

import csv
from itertools import pairwise, product

import matplotlib
import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp
from script import parser, say

import survey

matplotlib.use("agg")
import matplotlib.pyplot as plt

DEGREE = 3
ROWS = np.round(np.arange(0.0, 0.901, 0.025), 4)
COLUMNS = np.linspace(1e-4, 0.048, 1600)
CALM = 1e-6  # resonant terms below it, over the next order's, cannot be told from 0
VECTORS = [
    (k1, k2) for order in (3, 4) for k1 in range(order + 1) for k2 in {order - k1, k1 - order}
]
HARMLESS, STABLE, UNSTABLE, OPEN = "harmless", "stable to order 4", "unstable", "open"

POWERS = [p for p in product(range(DEGREE + 1), repeat=4) if sum(p) <= DEGREE]
PLACE = {p: i for i, p in enumerate(POWERS)}
# the places of the variables themselves
LINEAR = [PLACE[tuple(row)] for row in np.eye(4, dtype=int)]
PAIRS = np.array([(i, j, PLACE[tuple(np.add(p, q))]) for i, p in enumerate(POWERS) for j, q in enumerate(POWERS)
                  if sum(p) + sum(q) <= DEGREE]).T  # fmt: skip


def times(a, b):
    """The product of two polynomials in four variables, to DEGREE."""
    return np.bincount(PAIRS[2], a[PAIRS[0]] * b[PAIRS[1]], len(POWERS))


def potential(mu):
    """Taylor coefficients {(i, j): c} of x^i y^j, to degree 4, of Omega about L4, in u and v from there."""
    found, half = {}, np.sqrt(3.0) / 2.0
    for mass, across in ((1.0 - mu, 0.5), (mu, -0.5)):
        # 1 / |(across, half) + (u, v)| = sum of homogeneous parts, by the recurrence of Legendre's polynomials
        linear = {(1, 0): across, (0, 1): half}
        square = {(2, 0): 1.0, (0, 2): 1.0}
        parts = [{(0, 0): 1.0}, _scaled(linear, -1.0)]
        for n in range(1, 4):
            one = _scaled(_multiplied(linear, parts[n]), -(2.0 * n + 1.0) / (n + 1.0))
            two = _scaled(_multiplied(square, parts[n - 1]), -n / (n + 1.0))
            parts.append({key: one.get(key, 0.0) + two.get(key, 0.0) for key in {*one, *two}})
        for part in parts[2:]:
            for key, value in part.items():
                found[key] = found.get(key, 0.0) + mass * value
    for key in ((2, 0), (0, 2)):
        found[key] += 0.5
    return found


def _scaled(polynomial, factor):
    return {key: factor * value for key, value in polynomial.items()}


def _multiplied(a, b):
    out = {}
    for (i, j), x in a.items():
        for (k, m), y in b.items():
            out[i + k, j + m] = out.get((i + k, j + m), 0.0) + x * y
    return out


def revolution(mu, e):
    """The map over one revolution from f = 0, as polynomials (4, monomials) of (u, v, p_u, p_v)."""
    terms = potential(mu)

    def slope(f, state):
        u, v, p, q = state.reshape(4, -1)
        monomials = {(1, 0): u, (0, 1): v}
        for i, j in ((2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)):
            monomials[i, j] = times(monomials[i - 1, j], u) if i else times(monomials[0, j - 1], v)
        force = np.zeros((2, u.size))
        for (i, j), c in terms.items():
            if i:
                force[0] += i * c * monomials[i - 1, j]
            if j:
                force[1] += j * c * monomials[i, j - 1]
        force /= 1.0 + e * np.cos(f)
        return np.concatenate([p + v, q - u, q - u + force[0], -p - v + force[1]])

    start = np.zeros((4, len(POWERS)))
    start[range(4), LINEAR] = 1.0
    end = solve_ivp(
        slope, (0.0, 2.0 * np.pi), start.ravel(), method="DOP853", rtol=1e-11, atol=1e-13
    ).y[:, -1]
    return end.reshape(4, -1)


def diagonal(linear):
    """(multipliers l1, l2, vectors (4, 4)): u = V (q1, q2, conj q1, conj q2), {q, conj q} = -i,
    |arg l1| < |arg l2|.
    """
    J = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])
    values, vectors = np.linalg.eig(linear)
    sizes = np.array([(v @ J @ v.conj()).imag for v in vectors.T])
    own = [i for i in np.argsort(abs(np.angle(values))) if sizes[i] < 0.0]
    V = vectors[:, own] / np.sqrt(-sizes[own])
    return values[own], np.concatenate([V, V.conj()], axis=1)


def of_coordinates(images, V):
    """The map of (q1, q2, conj q1, conj q2): its coefficients (4, monomials)."""
    powers = {(0, 0, 0, 0): np.eye(1, len(POWERS), PLACE[0, 0, 0, 0])[0].astype(complex)}
    linear = np.zeros((4, len(POWERS)), complex)
    linear[:, LINEAR] = V
    for p in sorted(POWERS, key=sum)[1:]:
        i = next(k for k in range(4) if p[k])
        below = tuple(p[k] - (k == i) for k in range(4))
        re, im = powers[below], linear[i]
        powers[p] = (times(re.real, im.real) - times(re.imag, im.imag)
                     + 1j * (times(re.real, im.imag) + times(re.imag, im.real)))  # fmt: skip
    return np.linalg.inv(V) @ images @ np.array([powers[p] for p in POWERS])


def normal_form(mu, e):
    """(theta1, theta2, quadratic map (4, monomials), cubic map) in coordinates without quadratic
    terms that can go.
    """
    images = revolution(mu, e)
    own, V = diagonal(images[:, LINEAR])
    if len(own) != 2:
        raise ValueError(f"mu = {mu}, e = {e} is not linearly stable")
    F, both = of_coordinates(images, V), np.concatenate([own, own.conj()])
    h = np.zeros_like(F)
    for p in POWERS:
        if sum(p) == 2:
            gaps = np.prod(both**p) - both
            h[:, PLACE[p]] = np.where(
                abs(gaps) > 1e-6, F[:, PLACE[p]] / np.where(abs(gaps) > 1e-6, gaps, 1.0), 0.0
            )
    # G3 = F3 + DF2 h
    cubic = np.array([F[:, PLACE[p]] if sum(p) == 3 else np.zeros(4) for p in POWERS]).T.astype(
        complex
    )
    for p in POWERS:
        for k in range(4):
            if sum(p) == 2 and p[k]:
                rest = tuple(p[m] - (m == k) for m in range(4))
                for q in POWERS:
                    if sum(q) == 2:
                        cubic[:, PLACE[tuple(np.add(rest, q))]] += (
                            p[k] * F[:, PLACE[p]] * h[k, PLACE[q]]
                        )
    return np.angle(own), F, cubic


def twist(theta, cubic):
    """a11, a12, a22 of H4: the angles grow by its derivatives, per revolution."""
    own = np.exp(1j * theta)
    a = [(cubic[0, PLACE[2, 0, 1, 0]] / own[0]).imag / 2, (cubic[0, PLACE[1, 1, 0, 1]] / own[0]).imag,
         (cubic[1, PLACE[0, 2, 0, 1]] / own[1]).imag / 2]  # fmt: skip
    return np.array(a)


def resonant(k, F, cubic):
    """|B| of the term B q^k + conjugate of the generating function."""
    i = 0 if k[0] else 1
    conjugate = tuple(n - (j == i) for j, n in enumerate(k))
    return abs((F if sum(k) == 3 else cubic)[i, PLACE[0, 0, *conjugate]]) / k[i]


def effect(k, theta, F, cubic):
    """(what the resonance k does, its term, what it must outweigh)."""
    if k[0] * k[1] < 0:
        return HARMLESS, np.nan, np.nan
    B = resonant(k, F, cubic)
    if sum(k) == 3:
        return (UNSTABLE if B > CALM else OPEN), B, 0.0
    size = 2.0 * B * np.prod([float(n) ** (n / 2) for n in k if n])
    against = abs(twist(theta, cubic) @ [k[0] ** 2, k[0] * k[1], k[1] ** 2])
    return (
        (OPEN if abs(size - against) < CALM * against else UNSTABLE if size > against else STABLE),
        size,
        against,
    )


def angles(mu, e):
    """theta1, theta2 over 2 pi and the verdict, from the outputs of the scene; the signs are those
    of Krein.
    """
    ds = survey.evaluate("libration_elliptic", mu=mu, e=e)
    root = np.sqrt(np.maximum(ds.a**2 / 4.0 - ds.b + 2.0, 0.0))
    first, second = (
        np.arccos(np.clip((ds.a / 2.0 + s * root) / 2.0, -1.0, 1.0)) / (2 * np.pi) for s in (1, -1)
    )
    # below the curve B the slow mode turns by less than half a turn, above A by more
    return -first.values, second.values, ds.verdict.values


def places(e):
    """[(k, mu, above)] of the resonances on the row e; above: right of the curve A, not left of B."""
    one, two, verdict = angles(COLUMNS, e)
    found, stable = [], verdict == 1
    gaps = np.flatnonzero(stable[1:] & ~stable[:-1]) + 1
    above = np.zeros(COLUMNS.size, bool)
    above[(gaps[0] if stable[0] and gaps.size else COLUMNS.size) :] = True
    if e == 0.0:
        above = COLUMNS > 0.02859547920896832
    for k in VECTORS:
        if k[0] < 0 or (k[0] == 0 and k[1] < 0):
            continue

        def off(first, second, up, k=k):
            turns = k[0] * first + k[1] * np.where(up, second, -second)
            return turns - np.round(turns)

        values = off(one, two, above)
        for i, j in pairwise(range(COLUMNS.size)):
            if stable[i] and stable[j] and above[i] == above[j] and values[i] * values[j] <= 0 and (
                    abs(values[i] - values[j]) < 0.2):  # fmt: skip
                up = bool(above[i])
                found.append(
                    (
                        k,
                        _zero(
                            lambda mu, up=up, off=off: off(*angles(mu, e)[:2], up), *COLUMNS[[i, j]]
                        ),
                        up,
                    )
                )
    return found


def _zero(function, low, high):
    """The zero between, by the secant method."""
    x, values = [low, high], [float(function(low)), float(function(high))]
    for _ in range(5):
        if values[-1] == values[-2]:
            break
        x.append(x[-1] - values[-1] * (x[-1] - x[-2]) / (values[-1] - values[-2]))
        values.append(float(function(x[-1])))
    return x[-1]


def table(rows):
    """[(k, e, mu, effect, term, against, above)] of all rows."""
    out = []
    for e in map(float, rows):
        for k, mu, up in places(e):
            what, term, against = (
                effect(k, *normal_form(mu, e)) if k[0] * k[1] >= 0 else (HARMLESS, np.nan, np.nan)
            )
            if e == 0.0 and what == OPEN:
                # the circular problem does not depend on f: it has terms of k1 w1 = k2 w2 alone
                what = HARMLESS
            out.append((k, e, mu, what, term, against, up))
        say(f"e = {e:g}")
    return out


def main(arguments=None):
    folder = parser(__doc__, "the table and the picture").parse_args(arguments).output
    found = table(ROWS)
    with open(folder / "libration_resonances.csv", "w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["k1", "k2", "e", "mu", "effect", "resonant term", "against"])
        for k, e, mu, what, term, other, _above in found:
            writer.writerow([*k, e, f"{mu:.10f}", what, f"{term:.6g}", f"{other:.6g}"])
    draw(found).savefig(folder / "libration_resonances.png", dpi=110)


def draw(found):
    figure, axes = plt.subplots(figsize=(8.0, 5.6), layout="constrained")
    mu, e = np.linspace(1e-4, 0.0485, 400), np.linspace(0.0, 0.92, 300)
    ds = survey.evaluate(
        "libration_elliptic", mu=xr.DataArray(mu, dims="mu"), e=xr.DataArray(e, dims="e")
    )
    axes.contourf(
        mu, e, (ds.verdict == 1).transpose("e", "mu"), levels=[0.5, 1.5], colors=["#dbe9f4"]
    )
    colors, ends = {HARMLESS: "0.6", STABLE: "tab:blue", UNSTABLE: "tab:orange", OPEN: "black"}, []
    for k, up in dict.fromkeys((row[0], row[-1]) for row in found):
        own = sorted((row for row in found if (row[0], row[-1]) == (k, up)), key=lambda row: row[1])
        for one in own:
            after = [
                two for two in own if 0.0 < two[1] - one[1] < 0.03 and abs(two[2] - one[2]) < 0.0015
            ]
            for two in sorted(after, key=lambda two, one=one: abs(two[2] - one[2]))[:1]:
                what = two[3] if one[1] == 0.0 else one[3]
                axes.plot([one[2], two[2]], [one[1], two[1]], color=colors[what], linewidth=1.4)
        ends.append((own[0][2], own[0][1], f"{k[0]},{k[1]}"))
    below = sorted(end for end in ends if end[1] == 0.0)
    for (x, y, text), at in zip(below, spread([x for x, _, _ in below], 0.0012), strict=True):
        axes.annotate(text, (x, y), (at, -0.03), fontsize=8, rotation=90, va="top", ha="center",
                      arrowprops={"arrowstyle": "-", "linewidth": 0.5, "shrinkA": 0, "shrinkB": 0})  # fmt: skip
    for x, y, text in ends:
        if y > 0.0:
            axes.annotate(text, (x, y), (4, -4), textcoords="offset points", fontsize=8, va="top")
    for what, color in colors.items():
        if any(row[3] == what for row in found):
            axes.plot([], [], color=color, label=what)
    axes.set(xlabel=r"$\mu$", ylabel="$e$", xlim=(0, 0.0485), ylim=(-0.1, 0.92),
             title=r"Resonances $k_1\theta_1 + k_2\theta_2 = 0$ (mod $2\pi$) of order 3 and 4")  # fmt: skip
    axes.legend(loc="upper right")
    return figure


def spread(x, least):
    """Ascending positions moved apart, until neighbours have the least distance."""
    x = np.array(x)
    for _ in range(1000):
        short = least - np.diff(x)
        if (short <= 1e-3 * least).all():
            break
        push = 0.5 * np.maximum(short, 0.0)
        x[:-1] -= 0.5 * push
        x[1:] += 0.5 * push
    return x


if __name__ == "__main__":
    main()
