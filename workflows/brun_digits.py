"""Where textbook formulas and direct integration of Brun's problem lose their digits: error against
distance.

    python workflows/brun_digits.py [-o results]

Needs scipy: pip install -e ".[test]". States near a separatrix, a pole and a regular precession,
with 60-digit truths (survey/reference/brun_distances.json).
"""

import argparse
import sys
import warnings
from functools import partial
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.special import elliprf, elliprj

import survey
from survey.precision.cases import brun as chart
from survey.precision.peers import scipy as integrator

FAMILIES = {
    "separatrix": "energy above the separatrix, over k",
    "pole": "p_psi / p_phi - 1, past the pole",
    "precession": "p_theta0 / sqrt k, beside a regular precession",
}
NODES = 64
ANSWERED = 1e-17  # a chart in logarithms has no zero


def polynomial(point):
    """k, the numbers that conserve, and the turning points next to u0 by the eigenvalues of P's
    companion matrix.
    """
    A, C, epsilon, theta, p, b, a = (
        point[name] for name in ("A", "C", "epsilon", "theta0", "p_theta0", "p_psi", "p_phi")
    )
    u, k = np.cos(theta), epsilon * A * (A - C)
    level = p * p + ((b - a * u) / np.sin(theta)) ** 2 - k * u * u + a * a
    roots = np.roots([-k, 0.0, k - level, 2 * a * b, level - a * a - b * b])
    real = np.sort(roots[abs(roots.imag) < 1e-9].real)
    low, high = real[real <= u], real[real >= u]
    return A, k, level, a, b, (low[-1] if low.size else np.nan), (high[0] if high.size else np.nan)


def textbook(point):
    """The precession by (S6) in float64: roots of the quartic, 1 - u and 1 + u by subtraction,
    scipy's R_F and R_J.
    """
    A, k, level, a, b, low, high = polynomial(point)
    total = low + high
    rest = level - k + k * (total**2 - low * high)
    near, far = k * high**2 + k * total * high + rest, k * low**2 + k * total * low + rest
    s, g = level - k + 1.5 * k * total**2, np.sqrt(near * far)
    spread = np.sqrt(complex(s * s - g * g))
    x, y = s + spread, s - spread
    period = 4 * A * elliprf(0, x, y).real
    up = (
        period / (2 * (1 - low))
        + 2
        * A
        * (high - low)
        * far
        / (3 * (1 - low) ** 2)
        * elliprj(0, x, y, far * (1 - high) / (1 - low)).real
    )
    down = (
        period / (2 * (1 + high))
        + 2
        * A
        * (high - low)
        * near
        / (3 * (1 + high) ** 2)
        * elliprj(0, x, y, near * (1 + low) / (1 + high)).real
    )
    return ((b - a) * up + (b + a) * down) / A


def quadrature(point, chebyshev):
    """The precession as the quadrature of (S4): Gauss and Legendre in u, or Gauss and Chebyshev."""
    _A, k, level, a, b, low, high = polynomial(point)
    if chebyshev:
        x, weights = np.cos((np.arange(NODES) + 0.5) * np.pi / NODES), np.full(NODES, np.pi / NODES)
    else:
        x, weights = np.polynomial.legendre.leggauss(NODES)
    u = 0.5 * (low + high) + 0.5 * (high - low) * x
    value = -k * u**4 + (k - level) * u**2 + 2 * a * b * u + level - a * a - b * b
    rates = ((b - a) / (1 - u) + (b + a) / (1 + u)) / np.sqrt(value)
    return 0.5 * (high - low) * np.sum(weights * rates * (np.sqrt(1 - x * x) if chebyshev else 1.0))


def integrated(point):
    """The precession by DOP853 over one period, which it is given, to 1e-12."""
    if abs(point["p_psi"] - point["p_phi"]) < 5e-5:
        return np.nan  # comes to no end near the pole
    return float(
        chart.outcome(integrator.integrate(chart.system(point, {}), 1e-12))[chart.ERROR][0]
    )


def solved(point, method):
    return float(
        survey.evaluate("brun", method=method, variables=["precession"], **point).precession
    )


WAYS = {
    "survey": partial(solved, method="auto"),
    "chebyshev": partial(solved, method="chebyshev"),
    "R_F, R_J of naive roots": textbook,
    f"Gauss-Legendre, {NODES} nodes": partial(quadrature, chebyshev=False),
    f"Gauss-Chebyshev, {NODES} nodes": partial(quadrature, chebyshev=True),
    "DOP853 over one period": integrated,
}


def errors(family):
    """distances (n), {way: errors of the precession (n)}, floors (n)."""
    rows = chart.states(family)
    found = {}
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        for way, precession in WAYS.items():
            exact = [float(values[chart.ERROR]) for _, _, values, _ in rows]
            found[way] = np.array(
                [abs(precession(row[1]) - value) for row, value in zip(rows, exact, strict=True)]
            )
    return (
        np.array([row[0] for row in rows]),
        found,
        np.array([float(row[3][chart.ERROR]) for row in rows]),
    )


def draw(results, path):
    """One panel per family."""
    figure, panels = plt.subplots(
        1, len(results), figsize=(4.8 * len(results), 4.8), sharey=True, layout="constrained"
    )
    for axes, (family, (distances, found, floors)) in zip(panels, results.items(), strict=True):
        for marker, (way, off) in zip("osD^vP", found.items(), strict=True):
            axes.loglog(
                distances,
                np.maximum(off, ANSWERED),
                marker=marker,
                ms=4,
                lw=2.5 if way == "survey" else 1,
                label=way,
            )
        axes.loglog(distances, floors, "k--", lw=1, label="what half-ulp changes of the inputs do")
        axes.set(title=family, xlabel=FAMILIES[family])
        axes.grid(alpha=0.3)
    panels[0].set_ylabel("error of the precession per period (rad)")
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8
    )
    figure.savefig(path, dpi=150)
    plt.close(figure)


def table(results):
    """Markdown: the errors at four distances."""
    lines = ["# Where Brun's problem loses digits", "", "Errors of the precession per period (rad); written by",
             "`python workflows/brun_digits.py`. `-`: no answer.", ""]  # fmt: skip
    for family, (distances, found, floors) in results.items():
        shown = [int(np.argmin(abs(np.log(distances / at)))) for at in (1e-2, 1e-4, 1e-8, 1e-12)]
        head = " | ".join(f"{distances[i]:.0e}" for i in shown)
        lines += [
            f"## {family}: {FAMILIES[family]}",
            "",
            f"| | {head} |",
            "|---" * (len(shown) + 1) + "|",
        ]
        for way, off in (found | {"half-ulp changes of the inputs": floors}).items():
            cells = (f"{off[i]:.0e}" if np.isfinite(off[i]) else "-" for i in shown)
            lines.append(f"| {way} | " + " | ".join(cells) + " |")
        lines.append("")
    return "\n".join(lines)


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("-o", default="results", metavar="FOLDER")
    folder = Path(parser.parse_args(argv).o)
    folder.mkdir(parents=True, exist_ok=True)
    results = {family: errors(family) for family in FAMILIES}
    draw(results, folder / "brun_digits.png")
    (folder / "brun_digits.md").write_text(table(results), encoding="utf-8")
    print(f"wrote {folder / 'brun_digits.md'} and {folder / 'brun_digits.png'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
