"""Critical amplitudes of the thin rod and the flat disc: where planar motions lose and regain
stability out of plane.

    python workflows/satellite_critical_amplitudes.py [-o results]

Both have rho = 1/sqrt(3), the least of any body. The edges are searched along x = -ln |1 - k|, where they are evenly
spaced and lose no digits: librations from rest to 2e-11 rad short of 90 degrees, rotations from k = 1000 to as near
k = 1.
"""

import csv
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from script import parser, say

import survey
from survey.measures.hill import edges as hill_edges
from survey.scene import Request
from survey.scenes import satellite

NEAREST = 50.0  # 1 - k = 2e-22; beyond, 12 digits of it are no longer certain
FASTEST = -np.log(999.0)
SHORTEST = 1e-6  # rad short of 90 degrees, on the page; the CSV file has all
RHO_ROUNDING = 3e-16  # of 1 / sqrt(3 |1 - alpha|), relative
MOVED = 1e-6  # of alpha, to measure how the edges move with rho
CLASSES = list(hill_edges.CLASSES)


@dataclass(frozen=True)
class Case:
    """A body (inertia ratio alpha), its librations (side 1) or rotations (side -1), with or against
    the orbit.
    """

    body: str
    motion: str
    alpha: float
    side: int
    direction: int = 1

    @property
    def range(self):
        """x from the mildest motion to the one nearest to the separatrix."""
        return (0.0 if self.side > 0 else FASTEST), NEAREST

    def one_minus_k(self, x):
        return self.side * np.exp(-x)


CASES = tuple(
    Case(body, *motion[:1], alpha, *motion[1:])
    for body, alpha in (("thin rod", 0.0), ("disc", 2.0))
    for motion in (
        ("librations", 1),
        ("rotations with the orbit", -1, 1),
        ("rotations against the orbit", -1, -1),
    )
)


@dataclass(frozen=True)
class Edge:
    """An edge of instability at |1 - k| = `short` within `error` (relative), of tongue `index`."""

    x: float
    short: float
    error: float
    kind: str
    index: int


def edges(case, panels=8):
    """All edges of the case, from the mildest motion on; two rows, the second of a slightly
    different body.
    """
    alpha = np.array([case.alpha, case.alpha + np.sign(1 - case.alpha) * MOVED])

    def solve(row, x, wanted):
        request = Request({"direction": str(case.direction)}, "auto", 1e-13, frozenset(wanted))
        return satellite.solve(
            {"inertia_ratio": alpha[row][:, None], "one_minus_k": case.one_minus_k(x)}, request
        )

    found = hill_edges.find(solve, alpha.size, *case.range, panels)
    own, other = (found.row == 0), (found.row == 1)
    if not found.complete.all() or list(found.index[own]) != list(found.index[other]):
        raise SystemExit(
            f"satellite_critical_amplitudes: {case.body}, {case.motion}: an edge is missing"
        )
    # rho is the square root of 1 / 3 |1 - alpha|, so it moves by half as much
    slope = abs(found.position[other] - found.position[own]) / (0.5 * MOVED)
    error = found.error[own] + slope * RHO_ROUNDING + 1e-15  # the last for exp
    return [
        Edge(x, np.exp(-x), e, CLASSES[kind], index)
        for x, e, kind, index in zip(
            found.position[own], error, found.kind[own], found.index[own], strict=True
        )
    ]


def growth(case, x):
    """Growth of the logarithm of the amplitude per orbit; 0 where stable."""
    ds = survey.evaluate("satellite", inertia_ratio=case.alpha, one_minus_k=case.one_minus_k(x), rtol=1e-12,
                         direction=case.direction, variables=["exponent_per_orbit"])  # fmt: skip
    return ds.exponent_per_orbit.values


def largest(case, low, high):
    """Where in low..high the growth is largest (to about 1e-6), and its value."""
    for _ in range(5):
        x = np.linspace(low, high, 65)
        value = growth(case, x)
        at = int(value.argmax())
        low, high = x[max(at - 1, 0)], x[min(at + 1, 64)]
    return x[at], value[at]


def unstable(case, found):
    """The unstable intervals as pairs of edges, None where the range ends first."""
    ends = [case.range[0], *(edge.x for edge in found), case.range[1]]
    middles = 0.5 * (np.array(ends[1:]) + ends[:-1])
    grows = growth(case, middles) > 0
    return [pair for pair, yes in zip(pairwise([None, *found, None]), grows, strict=True) if yes]


def rest(short):
    """90 degrees - amplitude, in rad, from 1 - k: cos rest = k."""
    return 2 * np.arcsin(np.sqrt(short / 2))


def table(case, found):
    """The edges as rows of the CSV file, every number with its error bound."""
    for edge in found:
        row = {"body": case.body, "motion": case.motion, "tongue": edge.index, "class": edge.kind}
        if case.side > 0:
            left = rest(edge.short)
            error = (np.tan(left / 2) * edge.error + 1e-15 * left) * 1.001
            row |= {"amplitude_deg": np.degrees(np.pi / 2 - left), "amplitude_rad": np.pi / 2 - left,
                    "amplitude_error_rad": error + 3e-16,
                    "rest_rad": left, "rest_error_rad": error}  # fmt: skip
        k = 1 - case.side * edge.short
        row |= {"k": k, "k_error": edge.error * edge.short + 2e-16 * k,
                "one_minus_k": case.side * edge.short, "one_minus_k_error": edge.error * edge.short}  # fmt: skip
        yield row


COLUMNS = ("body", "motion", "tongue", "class", "amplitude_deg", "amplitude_rad", "amplitude_error_rad", "rest_rad",
           "rest_error_rad", "k", "k_error", "one_minus_k", "one_minus_k_error")  # fmt: skip

PAGE = """# Critical amplitudes of the thin rod and of the disc

Made by `python workflows/satellite_critical_amplitudes.py`; all {number} edges, with every error bound, are in
`satellite_critical_amplitudes.csv`. Edges of instability out of the orbital plane of the planar motions of an
axisymmetric satellite with Iz / I = 0 (thin rod) and 2 (disc), both with rho = 1/sqrt(3). A libration's amplitude is
asin k; k > 1 rotates. "error" bounds the relative error of the column before it. No edge is missing: between those
listed every factor has the sign that the list says. Growth is that of the logarithm of the amplitude per orbital
revolution; its bars are below 1e-12.
{sections}
## Beyond the tables

Towards the separatrix the tongues of the rod repeat forever: two tongues on, |1 - k| is smaller by exp(-sqrt(3) pi) =
{ratio:.6e} for librations, by its square for rotations (as the last tongues of the file, within {deviation}). The
disc is unstable all the way: its growth per orbit tends to 2 pi sqrt(2) = {limit:.6f}. Rotations with k > 1000 are
stable: tongue n = 1 lies within 1 / (2 k^2) of rho / k = 0 (`survey/scenes/satellite.md`: What is known).
"""
LIBRATIONS = """
## {title}

| tongue | class | amplitude, deg | amplitude, rad | k | 90 deg - amplitude, rad | error |
|---|---|---|---|---|---|---|
{rows}

| unstable in tongue | largest growth per orbit | at the amplitude, deg | 90 deg - amplitude, rad |
|---|---|---|---|
{growth}
"""
ROTATIONS = """
## {title}

| tongue | class | k | k - 1 | error |
|---|---|---|---|---|
{rows}

| unstable in tongue | largest growth per orbit | at k | k - 1 |
|---|---|---|---|
{growth}
"""


def section(case, found):
    """One case of the page."""
    shown = [edge for edge in found if rest(edge.short) > SHORTEST]
    inside = [pair for pair in unstable(case, found) if pair[0] in shown]
    return (LIBRATIONS if case.side > 0 else ROTATIONS).format(
        title=f"{case.body.capitalize()}: {case.motion}",
        rows="\n".join(edge_line(case, edge) for edge in shown),
        growth="\n".join(growth_line(case, *pair) for pair in inside),
    )


def edge_line(case, edge):
    [row] = table(case, [edge])
    start = f"| {edge.index} | {edge.kind.replace('_', ' ')} "
    if case.side < 0:
        return f"{start}| {row['k']:.15f} | {edge.short:.12e} | {upward(edge.error)} |"
    left, error = row["rest_rad"], row["rest_error_rad"]
    amplitudes = f"{row['amplitude_deg']:.13f} | {row['amplitude_rad']:.15f}"
    return f"{start}| {amplitudes} | {row['k']:.15f} | {left:.12e} | {upward(error / left)} |"


def growth_line(case, first, last):
    if last is None:
        return f"| {first.index} | it grows towards the separatrix | | |"
    x, value = largest(case, first.x, last.x)
    short = np.exp(-x)
    left = rest(short)
    position = (
        f"{90 - np.degrees(left):.5f} | {left:.5e}"
        if case.side > 0
        else f"{1 + short:.7f} | {short:.5e}"
    )
    return f"| {first.index} | {value:.10f} | {position} |"


def upward(error):
    """One digit of an error bound, rounded up."""
    unit = 10.0 ** np.floor(np.log10(error))
    return f"{np.ceil(error / unit) * unit:.0e}"


def main():
    folder = parser(__doc__, "the page and its table").parse_args().output
    page, listed = (
        folder / "satellite_critical_amplitudes.md",
        folder / "satellite_critical_amplitudes.csv",
    )
    found = {}
    for case in CASES:
        say(f"{case.body}, {case.motion}")
        found[case] = edges(case)
    with listed.open("w", newline="") as file:
        out = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        out.writeheader()
        out.writerows(row for case, own in found.items() for row in table(case, own))
    page.write_text(PAGE.format(
        number=sum(map(len, found.values())), sections="".join(section(case, own) for case, own in found.items()),
        ratio=np.exp(-np.sqrt(3) * np.pi), limit=2 * np.pi * np.sqrt(2), deviation=upward(deviation(found)),
    ), encoding="utf-8")  # fmt: skip
    print(page, listed, sep="\n")


def deviation(found):
    """How far the last tongues of the rod are from repeating, in x."""
    ends = [(case, own[-8:-4], own[-4:]) for case, own in found.items() if len(own) > 8]
    period = np.sqrt(3) * np.pi
    return max(
        abs(last.x - first.x - period * (1 if case.side > 0 else 2))
        for case, before, after in ends
        for first, last in zip(before, after, strict=True)
    )


if __name__ == "__main__":
    main()
