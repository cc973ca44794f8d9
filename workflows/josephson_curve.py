"""The homoclinic curve of the driven Josephson junction beside its expansion I = 4 a / pi + O(a^3),
and over the map.

    python workflows/josephson_curve.py [-o results]

On the curve the branch that leaves the saddle to the right changes its end: below, it falls into
the equilibrium; above, it tends to the rotation cycle. The portrait's table of branches tells
which, so the curve is bisected.

Source: J. Guckenheimer, P. Holmes, Nonlinear Oscillations, Dynamical Systems, and Bifurcations of
Vector Fields (1983), 4.6: Melnikov's method gives I = 4 a / pi to first order.
"""

import tomllib
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from script import parser, say

import survey

HERE = Path(__file__).parent
DAMPINGS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8, 1.0, 1.1)
WIDTH = 1e-9  # of the bracket, relative
UP, DOWN = 2, 1  # a rotation cycle, an equilibrium (codes of `branch_end`)


def end(a, current):
    """Where the branch to the right of the saddle goes."""
    ds = survey.evaluate(str(HERE / "josephson.py"), question="portrait", a=a, I=current)
    saddle = int(np.flatnonzero(ds.equilibrium_type == 1)[0])
    return int(ds.branch_end[saddle].sel(branch="unstable_right"))


def homoclinic(a):
    """Bracket of the current on the curve; the ends are certain."""
    low, high = 0.7 * a, min(1.4 * a, 0.999999)
    if (end(a, low), end(a, high)) != (DOWN, UP):
        raise SystemExit(f"josephson_curve: the curve does not cross [{low}, {high}] at a = {a}")
    while high - low > WIDTH * high:
        middle = 0.5 * (low + high)
        found = end(a, middle)
        if found not in (UP, DOWN):
            break  # within the error bar
        low, high = (low, middle) if found == UP else (middle, high)
    return low, high


def draw(rows, folder):
    """The map of `josephson.toml` with the curve and its expansion."""
    import matplotlib.pyplot as plt

    job = tomllib.loads((HERE / "josephson.toml").read_text(encoding="utf-8")) | {
        "scene": str(HERE / "josephson.py")
    }
    job["output"] |= {"figures": []}
    with TemporaryDirectory() as own:
        ds = survey.run(job, output=Path(own) / "josephson.nc").load()
    figure = plt.figure(figsize=(7.2, 5.2), layout="constrained")
    axes = ds.survey.map("rotations_plus", ax=figure.subplots())
    a, middle = (
        np.array([row[0] for row in rows]),
        np.array([0.5 * (row[1] + row[2]) for row in rows]),
    )
    line = np.array([0.0, 0.25 * pi])
    axes.plot(line, 4 * line / pi, "--", color="#D40000", lw=1.4, label=r"$I = 4a/\pi$")
    axes.plot(a, middle, "o", color="white", mec="black", ms=5, label="homoclinic, bisected")
    axes.legend(loc="lower right", fontsize=9)
    figure.savefig(folder / "josephson_curve.png", dpi=150)


def table(rows):
    yield "# The homoclinic curve of the driven Josephson junction"
    yield ""
    yield "phi'' = I - sin phi - a phi': the current I at which the branch to the right of the saddle returns to it,"
    yield "bisected by the end that the portrait finds for that branch (`branch_end`); both ends of each bracket are"
    yield "certain. The last column tends to a constant if I = 4 a / pi + O(a^3)."
    yield ""
    yield "| a | I | half the bracket | 4 a / pi | (I - 4 a / pi) / a^3 |"
    yield "|---|---|---|---|---|"
    for a, low, high in rows:
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        cubic, blur = (middle - 4 * a / pi) / a**3, half / a**3
        yield f"| {a} | {middle:.10f} | {half:.1e} | {4 * a / pi:.10f} | {cubic:.5f} +- {blur:.0e} |"


def main():
    folder = parser(__doc__, "the page and the picture").parse_args().output
    rows = []
    for a in DAMPINGS:
        rows.append((a, *homoclinic(a)))
        say(f"a = {a}: I = {0.5 * (rows[-1][1] + rows[-1][2]):.10f}, 4 a / pi = {4 * a / pi:.10f}")
    (folder / "josephson_curve.md").write_text("\n".join(table(rows)) + "\n", encoding="utf-8")
    draw(rows, folder)


if __name__ == "__main__":
    main()
