"""The curves that bound Danby's region of stability, and their tip, with error bounds; and the map
with the curves.

    python workflows/libration_elliptic_boundaries.py [-o results]

On A and B a pair of multipliers meets at -1, on KC two pairs meet on the circle. A and KC are
tangent at the tip, where all four multipliers are -1: it is found as the common zero of A and t
(`survey/scenes/libration_elliptic.md`).
"""

import csv
from dataclasses import dataclass

import numpy as np
import xarray as xr
from script import parser, say

import survey
from survey.kernels.libration.traces import discriminant, product
from survey.measures.hill.edges import close_in
from survey.measures.libration import danby

ROWS = np.round(np.concatenate([np.arange(0, 0.9, 0.01), np.arange(0.9, 0.991, 0.005)]), 3)
STRIP = np.round(np.concatenate([np.arange(0.296, 0.3141, 0.002), [0.3142, 0.3144, 0.3145]]), 4)
SHOWN = (
    0.0,
    0.05,
    0.1,
    0.15,
    0.2,
    0.25,
    0.3,
    0.31,
    0.314,
    0.3145,
    0.35,
    0.4,
    0.5,
    0.6,
    0.7,
    0.8,
    0.9,
    0.95,
    0.99,
)
MU_LEAST, MU_MOST, SAMPLES = 1e-9, 0.055, 1000
# mu, or mu less that of A; e
FULL, NEAR = ((0.0, 0.055), (0.0, 0.98)), ((-2e-5, 5e-5), (0.296, 0.3156))
LABELS = {
    "A": "a pair meets at -1 (factor A)",
    "B": "a pair meets at -1 (factor B)",
    "KC": "two pairs meet (K)",
}


@dataclass(frozen=True)
class Point:
    """A boundary of stability at eccentricity e: mu within `error`."""

    curve: str
    e: float
    mu: float
    error: float


def functions(e, mu):
    """The functions whose zeros are the curves, {name: (values, bars)}, at points (N each); and t."""
    values, bars = danby.factors(e, mu)
    (a, b, c, d, t), (ea, eb, ec, ed, et) = values.T, bars.T
    (ab, ab_bar), (cd, cd_bar) = product.py_func(a, b, ea, eb), product.py_func(c, d, ec, ed)
    k, k_bar = np.vectorize(discriminant.py_func)(t, ab, cd, et, ab_bar, cd_bar)
    return {"A": (a, ea), "B": (b, eb), "KC": (k, k_bar), "t": (t, et)}


def tip():
    """(mu, e) of the tip and their error bounds: Newton's method for A = t = 0; the error includes
    its last step.
    """
    x = np.array([0.047, 0.3145])
    for _ in range(8):
        value, bar = (np.array(part) for part in both(*x))
        sides = np.diag([1e-6, 1e-6])
        slopes = [(both(*(x + s))[0] - both(*(x - s))[0]) / 2e-6 for s in sides]
        inverse = np.linalg.inv(np.array(slopes).T)
        step = inverse @ value
        x = x - step
    return x, abs(inverse) @ bar + abs(step) + np.spacing(x)


def both(mu, e):
    """(A, t) and their bars at one point."""
    found = functions(np.array([e]), np.array([mu]))
    return np.array([found["A"][0][0], found["t"][0][0]]), np.array(
        [found["A"][1][0], found["t"][1][0]]
    )


def trace(curve, e):
    """The curve's Points at the eccentricities e: its first zero in mu, enclosed by certain signs."""
    mu = np.geomspace(MU_LEAST, MU_MOST, SAMPLES)
    found, rows = [], []
    for i, at in enumerate(e):
        f = functions(np.full(SAMPLES, at), mu)[curve][0]
        change = np.flatnonzero(np.sign(f[1:]) != np.sign(f[:-1]))
        if not change.size:
            raise SystemExit(f"libration_elliptic_boundaries: no zero of {curve} at e = {at}")
        j = change[0]
        found.append(mu[j] - f[j] * (mu[j + 1] - mu[j]) / (f[j + 1] - f[j]))
        rows.append(i)
    rows = np.array(rows)

    def evaluate(who, x):
        points = np.repeat(e[rows[who]], x.shape[1])
        return (part.reshape(x.shape) for part in functions(points, x.reshape(-1))[curve])

    found = np.array(found)
    x, width, sure = close_in(evaluate, found, 1e-6 * found, 2 * np.spacing(found))
    if not sure.all():
        raise SystemExit(f"libration_elliptic_boundaries: {curve} is not certain at e = {e[~sure]}")
    return [Point(curve, *row) for row in zip(e, x, width, strict=True)]


def curves(end):
    """All Points: B at every row, A and KC up to the tip at e = `end`."""
    below = np.union1d(ROWS[ROWS < end], STRIP)
    return [*trace("B", np.union1d(ROWS, STRIP)), *trace("A", below), *trace("KC", below)]


PAGE = """# The boundaries of stability of the triangular points of the elliptic problem

Made by `python workflows/libration_elliptic_boundaries.py`; `libration_elliptic_boundaries.csv` holds all {number}
points. The motion is stable for mu < B(e), and for A(e) < mu < KC(e) up to the tip. On A and B a pair of multipliers
meets at -1, on KC two pairs of unlike kind meet on the unit circle. Every mu is certain within its error: the
function that vanishes on the curve has opposite, certain signs at mu - error and mu + error. No error exceeds {worst}.

**The tip**, where A and KC are tangent and all four multipliers are -1:

    mu = {mu:.17f} +- {mu_error}      e = {e:.16f} +- {e_error}

| e | B | A | KC | width of the strip, KC - A | largest error of the curves |
|---|---|---|---|---|---|
{rows}
"""


def row(e, points):
    """A line of the page: the curves at one e."""
    here = {point.curve: point for point in points if point.e == e}
    values = [f"{here[name].mu:.15f}" if name in here else "" for name in ("B", "A", "KC")]
    width = f"{here['KC'].mu - here['A'].mu:.15f}" if "A" in here else ""
    return f"| {e:g} | {' | '.join(values)} | {width} | {upward(max(point.error for point in here.values()))} |"


def upward(error):
    """One digit of an error bound, rounded up."""
    unit = 10.0 ** np.floor(np.log10(error))
    return f"{np.ceil(error / unit) * unit:.0e}"


def draw(points, end, path):
    """The map, and the strip near its tip, with the curves over them."""
    import matplotlib.pyplot as plt
    from matplotlib.colors import ListedColormap

    from survey.show.palette import COLOURS, UNDECIDED

    figure, panels = plt.subplots(1, 2, figsize=(9.6, 4.6), layout="constrained")
    near = np.linspace(*NEAR[1], 99)
    line = np.array([point.mu for point in trace("A", near)])  # beyond the tip it is not a boundary

    def map_of(axes, window, base):
        e, x = np.linspace(*window[1], 400), np.linspace(*window[0], 600)
        mu = xr.DataArray(base(e)[:, None] + x, dims=("row", "column"))
        ds = survey.evaluate(
            "libration_elliptic", mu=mu, e=xr.DataArray(e, dims="row"), variables=["verdict"]
        )
        shown = {
            "cmap": ListedColormap([UNDECIDED, *COLOURS[:2]]),
            "vmin": -1.5,
            "vmax": 1.5,
            "rasterized": True,
        }
        axes.pcolormesh(x, e, ds.verdict.transpose("row", "column"), **shown)
        for name, style in (("B", "-"), ("A", "--"), ("KC", ":")):
            curve = np.array(
                [(point.mu, point.e) for point in points if point.curve == name and point.e >= e[0]]
            )
            axes.plot(
                curve[:, 0] - base(curve[:, 1]),
                curve[:, 1],
                style,
                color="black",
                lw=1.0,
                label=LABELS[name],
            )
        axes.plot(
            end[0] - base(end[1]),
            end[1],
            "o",
            color="black",
            ms=4,
            label="tip: all four multipliers at -1",
        )
        axes.set(xlim=window[0], ylim=window[1], ylabel="eccentricity e")

    map_of(panels[0], FULL, lambda e: 0.0 * e)
    map_of(panels[1], NEAR, lambda e: np.interp(e, near, line))
    panels[0].set(xlabel=r"mass ratio $\mu$", title="stable (blue) and unstable (orange)")
    panels[1].set(xlabel=r"$\mu - \mu_A(e)$", title="the strip between A and KC")
    panels[0].legend(fontsize=8, loc="upper right")
    figure.savefig(path, dpi=150)
    plt.close(figure)


def main():
    folder = parser(__doc__, "the page, table and picture").parse_args().output
    page, listed, picture = (
        folder / f"libration_elliptic_boundaries.{kind}" for kind in ("md", "csv", "png")
    )
    end, end_error = tip()
    say("the tip is found")
    points = curves(end[1])
    with listed.open("w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(["curve", "e", "mu", "mu_error"])
        out.writerows([p.curve, f"{p.e:g}", repr(float(p.mu)), f"{p.error:.3g}"] for p in points)
    page.write_text(PAGE.format(
        number=len(points), worst=upward(max(p.error for p in points)), mu=end[0], e=end[1],
        mu_error=upward(end_error[0]), e_error=upward(end_error[1]),
        rows="\n".join(row(e, points) for e in SHOWN if e in ROWS or e in STRIP),
    ), encoding="utf-8")  # fmt: skip
    draw(points, end, picture)
    print(page, listed, picture, sep="\n")


if __name__ == "__main__":
    main()
