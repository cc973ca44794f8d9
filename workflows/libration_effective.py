"""For how long motions near the triangular libration points stay near them: the radius of effective
stability over mu.

    python workflows/libration_effective.py [-o results]

Definition and assumptions: `survey/measures/libration/effective_stability.py`; series:
`survey/methods/lie.py`.
"""

import matplotlib.pyplot as plt
import numpy as np
from script import parser, say

from survey.kernels.libration.lie_plan import plan
from survey.measures.libration import effective_stability
from survey.measures.libration.normal_form import MU_R
from survey.methods import lie
from survey.show.palette import COLOURS

ORDERS = (6, 8, 10, 12)
PERIODS = (1e3, 1e6, 1e9)  # of the primaries
NUMBER, BLOCK = 1200, 64
# mass ratios: of the planets, IAU values; of the Moon, DE440
PLACES = {
    "Sun and Earth": 3.003e-6, "Sun and Saturn": 2.857e-4, "Sun and Jupiter": 9.5388e-4, "0.005": 0.005, "0.01": 0.01,
    "Earth and Moon": 0.01215058, "0.02": 0.02, "0.03": 0.03,
}  # fmt: skip


def radii(mu, order):
    """{periods: (radius, bar, r)} at every mu (N), block by block."""
    parts = {periods: [] for periods in PERIODS}
    for first in range(0, mu.size, BLOCK):
        norms = lie.remainders(mu[first : first + BLOCK], order)
        for periods in PERIODS:
            parts[periods].append(effective_stability.radius(norms, 2.0 * np.pi * periods))
    return {
        periods: tuple(np.concatenate(part) for part in zip(*found, strict=True))
        for periods, found in parts.items()
    }


def resonances(highest):
    """[(mu, k)]: where k1 w1 - k2 w2 + k3 = 0, k the shortest of its line, |k| <= highest, in the
    order of mu.
    """
    vectors, found = plan(highest, True).harmonics, {}
    vectors = vectors[np.lexsort((*vectors.T, abs(vectors).sum(axis=1)))]
    for k in vectors:
        values = distance(GRID, k)
        for n in np.flatnonzero(values[1:] * values[:-1] < 0.0):
            root = bisect(k, GRID[n], GRID[n + 1])
            found.setdefault(round(root, 12), (root, tuple(map(int, k))))
    return [found[key] for key in sorted(found)]


GRID = MU_R[0] * (1.0 - np.linspace(1.0, 1e-5, 2000) ** 2)  # denser towards mu_R


def frequencies(mu):
    """s = w1^2 - w2^2, w1, w2."""
    x = 6.75 * mu * (1.0 - mu)
    s = np.sqrt(1.0 - 4.0 * x)
    return s, np.sqrt(0.5 * (1.0 + s)), np.sqrt(2.0 * x / (1.0 + s))


def distance(mu, k):
    """k . Omega."""
    _s, w1, w2 = frequencies(mu)
    return k[0] * w1 - k[1] * w2 + k[2]


def bisect(k, low, high):
    """The root of k . Omega between low and high."""
    side = distance(low, k) > 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (distance(middle, k) > 0.0) == side else (low, middle)
    return 0.5 * (low + high)


def semi_axes(mu):
    """Greatest distance from L4, per unit of |z_j|, of short- and long-period motions (linear):
    their semi-axes.
    """
    s, *frequency = frequencies(mu)
    k, axes = 0.75 * np.sqrt(3.0) * (1.0 - 2.0 * mu), []
    for omega in frequency:
        g = 1.0 / np.sqrt(2.0 * omega * s * (omega**2 + 0.75))
        axes.append(
            2.0 * np.linalg.norm([[k * g, 2.0 * omega * g], [-(omega**2 + 0.75) * g, 0.0]], ord=2)
        )
    return axes


PAGE = """# Effective stability of the triangular libration points

Made by `python workflows/libration_effective.py`. The radius rho is the greatest for which motions that start with all
|z_j| <= rho, in the variables of the normal form (action r_j = |z_j|^2, unit distance, mass and mean motion), keep
their actions below 2 rho^2 for the stated time, as far as the remainders of the series show: degrees up to the order
plus 1, then a geometric tail (`survey/measures/libration/effective_stability.py`). r, of 2, ..., order - 1, is the
degree to which the Hamiltonian was normalised for it. It is an estimate from truncated series, not a proof; where r is
the greatest that the order allows, higher orders would give a larger radius. The bars hold rounding only.

## By order, for 10^9 periods of the primaries

| mu | {orders} |
|---|{rules}|
{by_order}

## By time, order {top}

Beside rho: r. The last two columns are the greatest distances from L4, in units of that of the primaries, of short- and
long-period motions with |z_j| = rho for 10^9 periods (first order).

| mu | {periods} | short | long |
|---|{time_rules}|---|---|
{by_time}

The widest radius for 10^9 periods is {widest:.3e} at mu = {widest_mu:.5f}. The bar is below {bar:.0e} of rho from
mu = 1e-4 on.

## At resonances of order {limit} or less

At k1 w1 - k2 w2 + k3 = 0 a generator of degree |k| cannot be had; r ends before it (r = |k| - 1), and so does what
a non-resonant normal form can say. Around it the divisor is small: the radius falls in a valley. rho for 10^9 periods,
order {top}:

| mu | k | r | rho | rho at mu (1 + 1e-3) |
|---|---|---|---|---|
{at_resonances}

(2:1 and 3:1, k = (1, 2, 0) and (1, 3, 0), make L4 unstable.)

![radius of effective stability over mu](libration_effective_stability.png)
"""


def main():
    folder = parser(__doc__, "the page and its picture").parse_args().output
    mu, places = MU_R[0] * (np.arange(NUMBER) + 0.5) / NUMBER, np.array(list(PLACES.values()))
    curves, at = {}, {}
    for order in ORDERS:
        say(f"order {order}")
        curves[order], at[order] = radii(mu, order), radii(places, order)
    found = resonances(max(ORDERS))
    low = [(root, k) for root, k in found if sum(map(abs, k)) <= 6]
    roots = np.array([root for root, _k in low])
    say("at the resonances")
    on, beside = radii(roots, ORDERS[-1]), radii(roots * 1.001, ORDERS[-1])
    (folder / "libration_effective_stability.md").write_text(
        page(mu, curves, at, low, on, beside), encoding="utf-8"
    )
    draw(mu, curves, found, folder / "libration_effective_stability.png")
    print(*(folder / f"libration_effective_stability.{end}" for end in ("md", "png")), sep="\n")


def page(mu, curves, at, low, on, beside):
    """The page's text."""
    top, long = ORDERS[-1], PERIODS[-1]
    radius, bar, _r = curves[top][long]
    widest = np.nanargmax(radius)
    names = [name if name[0] == "0" else f"{value:g} ({name})" for name, value in PLACES.items()]
    return PAGE.format(
        top=top,
        limit=6,
        orders=" | ".join(f"order {order}" for order in ORDERS),
        rules="|".join("---" for _ in ORDERS),
        by_order="\n".join(
            f"| {name} | " + " | ".join(f"{at[order][long][0][n]:.3e}" for order in ORDERS) + " |"
            for n, name in enumerate(names)
        ),
        periods=" | ".join(f"{periods:.0e} periods" for periods in PERIODS),
        time_rules="|".join("---" for _ in PERIODS),
        by_time="\n".join(
            f"| {name} | "
            + " | ".join(
                f"{at[top][periods][0][n]:.3e} ({at[top][periods][2][n]})" for periods in PERIODS
            )
            + "".join(f" | {axis * at[top][long][0][n]:.1e}" for axis in semi_axes(value))
            + " |"
            for n, (name, value) in enumerate(zip(names, PLACES.values(), strict=True))
        ),
        widest=radius[widest],
        widest_mu=mu[widest],
        bar=np.nanmax((bar / radius)[mu > 1e-4]),
        at_resonances="\n".join(
            f"| {root:.12f} | {k} | {on[long][2][n]} | {on[long][0][n]:.1e} | {beside[long][0][n]:.1e} |"
            for n, (root, k) in enumerate(low)
        ),
    )


def draw(mu, curves, found, path):
    """Left: by order for the longest time; right: by time for the highest order, and the resonances."""
    figure, (left, right) = plt.subplots(
        1, 2, figsize=(12.5, 5.8), sharey=True, layout="constrained"
    )
    top, long, shades = ORDERS[-1], PERIODS[-1], [COLOURS[i] for i in (0, 6, 4, 5)]
    for order, colour in zip(ORDERS, shades, strict=False):
        left.semilogy(mu, curves[order][long][0], color=colour, lw=1.1, label=f"order {order}")
    left.set(ylabel=r"radius $\rho$ of effective stability (of $|z_j|$)",
             title=f"for $10^{{{round(np.log10(long))}}}$ periods of the primaries, by order")  # fmt: skip
    for periods, colour in zip(PERIODS, shades, strict=False):
        label = f"$10^{{{round(np.log10(periods))}}}$ periods"
        right.semilogy(mu, curves[top][periods][0], color=colour, lw=1.1, label=label)
    right.set(title=f"order {top}, by time; ticks: resonances $k$ of order up to {top}")
    for root, k in found:
        size = sum(map(abs, k))
        right.axvline(root, ymin=1.0 - 0.5 / size, color="0.35", lw=0.8)
        if size <= 5:
            right.annotate(str(k).replace(" ", ""), (root, 0.99 - 0.5 / size), xycoords=("data", "axes fraction"),
                           fontsize=7, rotation=90, ha="center", va="top")  # fmt: skip
    right.set_ylim(1e-7, 0.1)  # room for the ticks and the legend
    for axes in (left, right):
        axes.set(xlabel=r"mass ratio $\mu$", xlim=(0.0, MU_R[0]))
        axes.grid(alpha=0.3)
        axes.legend(fontsize=8, frameon=False, loc="lower center", ncols=4)
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    main()
