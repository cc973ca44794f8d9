"""How a deviation from the gyrostat's rotation about axis 1 grows: why, and where, the reduced
scene suffices.

    python workflows/gyrostat_deviation.py [-o results]

The six equations (1)-(6) are solved in a rotated body frame, where no component is zero, and read
in the scene's axes.
"""

# ruff: noqa: E501  (the page's lines)

import matplotlib.pyplot as plt
import numpy as np
from script import parser, say

import survey
from survey.kernels.cylinder import gyrostat
from survey.kernels.cylinder.flow import coefficients
from survey.show.palette import COLOURS

SIX = {"b12": 0.7, "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": 0.5, "s3": -0.2}
START = {"phi0": 1.5, "w0": 0.8}
END, TIMES, REDUCED = 60.0, np.linspace(0.0, 60.0, 601), 20.0
FREE = ("A22", "A23", "A33", "B22", "B23", "B33", "C11", "lambda1")
REST = (0.3, 0.07, -0.2, 0.1)  # B22, B23, B33, C11 over A11
BODIES = {
    "axis 1 of largest inertia, lambda1 = 3": (0.5, 0.07, 0.6, *REST, 3.0),
    "of middle inertia, lambda1 = 0": (0.6, 0.07, 1.4, *REST, 0.0),
    "of smallest inertia, lambda1 = 0": (1.7, 0.07, 1.4, *REST, 0.0),
    "as the method `full` chooses": None,
}
# where a condition stands in G's aligned tensors: (first row, i, j), and for vectors (row, i)
CONDITIONS = {
    "A12 = 0": (0, 0, 1), "A31 = 0": (0, 0, 2), "B11 = 0": (6, 0, 0), "C12 = 0": (9, 0, 1), "C31 = 0": (9, 0, 2),
    "lambda2 = 0": (12, 1), "lambda3 = 0": (12, 2), "s1 = 0": (13, 0),
}  # fmt: skip
START_CONDITIONS = {"w2 = 0 at the start": 1, "w3 = 0 at the start": 2, "nu1 = 0 at the start": 3}
Q = gyrostat.FRAME


def body(free=None):
    """(G, initial state) of a full gyrostat that holds the reduced flow; by default as the method
    `full` builds it.
    """
    p, G, state = coefficients(*SIX.values()), np.empty((14, 3)), np.empty(6)
    values = np.empty(8) if free is None else np.array(free, float)
    if free is None:
        gyrostat.generic(p, START["w0"], values)
    gyrostat.embed(p, values, G)
    gyrostat.start(START["phi0"], START["w0"], state)
    return G, state


def broken(free, condition, size):
    """The body with one condition off by `size` (over A11)."""
    G, state = body(free)
    if condition in START_CONDITIONS:
        return G, state + size * np.kron(np.eye(2), Q)[:, START_CONDITIONS[condition]]
    row, *where = CONDITIONS[condition]
    size *= gyrostat.A11
    if len(where) == 1:
        G[row] += size * Q[:, where[0]]
        return G, state
    i, j = where
    G[row : row + 3] += size * (
        np.outer(Q[:, i], Q[:, j]) + (np.outer(Q[:, j], Q[:, i]) if i != j else 0)
    )
    gyrostat.invert(G)
    return G, state


def motion(G, state, times=TIMES):
    """w and nu at the times, and their tangent map, in the scene's axes: (n, 6), (n, 6, 6)."""
    out, tangent = np.empty((len(times), 6)), np.empty((len(times), 6, 6))
    if gyrostat.states(G, state, times, 1e-16, 100_000, out, tangent) < 0:
        raise RuntimeError("the six equations could not be followed to the end")
    turn = np.kron(np.eye(2), Q)
    return out @ turn, np.swapaxes(turn, 0, 1) @ tangent @ turn


def deviation(states):
    """Largest of |w2|, |w3|, |nu1| at each time."""
    return np.abs(states[:, 1:4]).max(axis=1)


def off_reduced(states, times=TIMES):
    """Largest difference of (w, nu) from the scene's at each time."""
    ds = survey.evaluate(
        "gyrostat", question="trajectory", method="taylor", rtol=1e-13, t=times, **SIX, **START
    )
    zero = np.zeros(times.size)
    true = np.stack([ds.w, zero, zero, zero, np.sin(ds.phi), np.cos(ds.phi)], axis=1)
    return np.abs(states - true).max(axis=1)


def growth(tangent):
    """Largest singular value of the map of (w2, w3, nu1) at each time: how much a deviation has
    grown at most.
    """
    return np.linalg.norm(tangent[:, 1:4, 1:4], ord=2, axis=(1, 2))


PAGE = """# Why the reduced scene suffices

Made by `python workflows/gyrostat_deviation.py`. The scene is the rotation about axis 1 that the six equations (1)-(6) keep
under the conditions of case B: A12 = A31 = B11 = C12 = C31 = 0, lambda2 = lambda3 = s1 = 0, and w2 = w3 = nu1 = 0 at the start.
Here the six equations are solved in a rotated body frame, where no component is zero and nothing helps the set to be kept.
Parameters over A11: {six}; phi0 = {phi0}, w0 = {w0}.

## The set is kept, up to rounding times the growth of deviations

Greatest distance of the six-dimensional motion from the scene's (double precision), and the growth of (w2, w3, nu1): the
largest singular value of the tangent map. Rounding is 1e-16; it is amplified as any other deviation is.

| body | distance, t <= 20 | growth, t <= 20 | distance, t <= 60 | growth, t <= 60 |
|---|---|---|---|---|
{bodies}

So the set need not attract, and that axis 1 has the largest inertia does not make it: where the reduced flow contracts
(f < 0) the transversal one expands, as on the set div(w2', w3') = -(B12 cos phi / A22 - B31 sin phi / A33) for A23 = 0. Large
A22 and A33 and a gyrostatic moment along axis 1 keep this slow; the method `full`, by which `survey verify` checks
trajectories, chooses them, as the reduced motion depends on neither.

## Each condition is needed, and nothing else

Axis 1 of largest inertia. One condition at a time is broken; the greatest of |w2|, |w3|, |nu1|:

| broken condition | by 0.1, t <= 1 | by 0.1, t <= 20 | by 1e-6, t <= 1 | by 1e-6, t <= 20 |
|---|---|---|---|---|
{conditions}

What the conditions leave free, moved by 0.1 (over A11), leaves the motion where it is: largest distance from the scene's
for t <= 20:

| free | distance |
|---|---|
{free}

![growth of deviations from rotation about axis 1](gyrostat_deviation.png)
"""


def main():
    folder = parser(__doc__, "the page and its picture").parse_args().output
    say("growth of deviations")
    runs = {name: motion(*body(free)) for name, free in BODIES.items()}
    kept = {
        name: (off_reduced(states), growth(tangent)) for name, (states, tangent) in runs.items()
    }
    say("conditions broken one by one")
    first = next(iter(BODIES.values()))
    names = [*CONDITIONS, *START_CONDITIONS]
    off = {
        (name, size): deviation(motion(*broken(first, name, size))[0])
        for name in names
        for size in (0.1, 1e-6)
    }
    one, twenty = TIMES <= 1.0, TIMES <= REDUCED
    page = PAGE.format(
        six=", ".join(f"{key} = {value:g}" for key, value in SIX.items()),
        **START,
        bodies="\n".join(
            f"| {name} | {a[twenty].max():.0e} | {b[twenty].max():.2g} | {a.max():.0e} | {b.max():.2g} |"
            for name, (a, b) in kept.items()
        ),
        conditions="\n".join(
            f"| {name} | "
            + " | ".join(
                f"{off[name, size][part].max():.1e}"
                for size in (0.1, 1e-6)
                for part in (one, twenty)
            )
            + " |"
            for name in names
        ),
        free="\n".join(f"| {name} | {distance:.0e} |" for name, distance in moved(first)),
    )
    (folder / "gyrostat_deviation.md").write_text(page, encoding="utf-8")
    draw(kept, {name: off[name, 1e-6] for name in names}, folder / "gyrostat_deviation.png")
    print(folder / "gyrostat_deviation.md", folder / "gyrostat_deviation.png", sep="\n")


def moved(free):
    """(name, distance from the scene's motion for t <= 20) for each free parameter moved by 0.1."""
    times = TIMES[TIMES <= REDUCED]
    for i, name in enumerate(FREE):
        shifted = np.array(free, float) + 0.1 * np.eye(8)[i]
        yield name, off_reduced(motion(*body(shifted), times)[0], times).max()


def draw(kept, off, path):
    """Left: growth of deviations and what rounding becomes; right: |w2|, |w3|, |nu1| with one
    condition broken.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(11.5, 5.4), layout="constrained")
    dark = [COLOURS[i] for i in (0, 6, 4, 5)]
    for (name, (distance, grown)), colour in zip(kept.items(), dark, strict=True):
        left.semilogy(TIMES, grown, color=colour, label=name.replace("`", ""))
        left.semilogy(TIMES, np.maximum(distance, 1e-17), color=colour, lw=0.7, ls=":")
    left.set(
        xlabel="time, $t$",
        title="growth of $(w_2, w_3, \\nu_1)$ (solid)\nand distance from the scene's motion (dotted)",
    )
    left.legend(fontsize=8, frameon=False, loc="upper left")
    low, high = left.get_ylim()
    left.set_ylim(low, high * 1e6)  # room for the legend
    shades = plt.get_cmap("tab20")
    for i, (name, values) in enumerate(off.items()):
        style = "-" if name in CONDITIONS else "--"
        # largest so far: the motions oscillate
        right.semilogy(
            TIMES[1:], np.maximum.accumulate(values)[1:], style, lw=1.1, color=shades(i), label=name
        )
    right.set(xlabel="time, $t$", title="one condition broken by $10^{-6}$, axis 1 of largest inertia:\n"
              "largest of $|w_2|, |w_3|, |\\nu_1|$ so far")  # fmt: skip
    right.legend(fontsize=8, frameon=False, ncols=2)
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    main()
