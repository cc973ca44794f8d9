"""The bifurcation diagram of Clebsch's case: energy H against F2 at one value of F3, with random
motions.

python workflows/brun_triaxial_diagram.py -o results
"""

import matplotlib
import numpy as np
from script import parser

import survey

matplotlib.use("agg")
import matplotlib.pyplot as plt

BODY = {"A": 2.0, "B": 1.5, "C": 1.0, "epsilon": 1.0}
AREA = 1.0  # F3
NAMES = {1: ("stable", "tab:blue"), 0: ("unstable: they carry separatrices", "tab:orange")}


def curves():
    """H, F2 and the verdict along sigma, for both senses; gaps (NaN) where there is no critical motion."""
    ends = sorted(-1.0 / BODY[name] for name in "ABC")
    sigma = np.unique(np.concatenate([
        *(np.sinh(np.linspace(np.arcsinh(a), np.arcsinh(b), 6001))[1:-1] for a, b in
          zip([-300.0, *ends], [*ends, 300.0], strict=True)),
        *(end + side * np.geomspace(1e-9, 0.1, 2000) for end in ends for side in (-1.0, 1.0)),
    ]))  # fmt: skip
    for sense in ("1", "-1"):
        ds = survey.evaluate(
            "brun_triaxial", question="critical", **BODY, p_psi=AREA, sense=sense, sigma=sigma
        )
        yield ds.H.values, ds.F2.values, np.where(ds.status == 0, ds.verdict.values, -1)


def rotations():
    """H and F2 of the permanent rotations about the principal axes with this F3."""
    for axis in "ABC":
        ds = survey.evaluate("brun_triaxial", axis=axis, **BODY, Omega=AREA / BODY[axis])
        yield float(ds.H), float(ds.F2), axis, int(ds.verdict)


def motions(number):
    """H and F2 of random states with this F3."""
    draw = np.random.default_rng(1)
    nu = draw.normal(size=(number, 3))
    nu /= np.linalg.norm(nu, axis=1, keepdims=True)
    M = draw.normal(size=(number, 3)) * draw.uniform(0.0, 1.6, (number, 1))
    M += (AREA - (M * nu).sum(axis=1, keepdims=True)) * nu
    inertia = np.array([BODY[name] for name in "ABC"])
    energy = 0.5 * (M**2 / inertia + BODY["epsilon"] * inertia * nu**2).sum(axis=1)
    second = (M**2 - BODY["epsilon"] * np.prod(inertia) / inertia * nu**2).sum(axis=1)
    return energy, second


def draw():
    figure, axes = plt.subplots(figsize=(7.2, 5.2), layout="constrained")
    axes.plot(*motions(60_000), ",", color="0.75", zorder=0)
    axes.plot([], [], "s", color="0.75", label="motions")
    for energy, second, verdict in curves():
        for code, (_words, color) in NAMES.items():
            on = verdict == code
            # a verdict changes between two points: the curve runs on to the next
            on |= np.roll(on, 1) & (verdict >= 0)
            axes.plot(
                np.where(on, energy, np.nan),
                np.where(on, second, np.nan),
                color=color,
                zorder=2 - code,
            )
    for words, color in NAMES.values():
        axes.plot([], [], color=color, label=f"critical motions, {words}")
    for energy, second, axis, verdict in rotations():
        axes.plot(energy, second, "o", color=NAMES[verdict][1], markeredgecolor="black", zorder=4)
        axes.annotate(
            f"rotation about {axis}",
            (energy, second),
            (6, -12),
            textcoords="offset points",
            fontsize=8,
        )
    axes.set(xlim=(0.65, 2.6), ylim=(-3.1, 3.4), xlabel="$H$", ylabel="$F_2$",
             title=rf"Clebsch's case, A : B : C = {BODY['A']:g} : {BODY['B']:g} : {BODY['C']:g}, "
             rf"$\varepsilon$ = {BODY['epsilon']:g}, $F_3$ = {AREA:g}")  # fmt: skip
    axes.legend(loc="upper left", fontsize=8)
    return figure


def main(arguments=None):
    folder = parser(__doc__, "the picture").parse_args(arguments).output
    draw().savefig(folder / "brun_triaxial_diagram.png", dpi=110)


if __name__ == "__main__":
    main()
