"""Edges along initial states of the gyrostat, against rows of fates, closed forms and the slopes of
saddles.
"""

import mpmath as mp
import numpy as np
import pytest

import survey


def lines_of_fates(number, seed):
    """Random lines along w0 and phi0 of random gyrostats."""
    names, rng = ("b12", "b31", "d", "c23", "s2", "s3"), np.random.default_rng(seed)
    for i in range(number):
        system = dict(zip(names, rng.uniform(-1.0, 1.0, 6).tolist(), strict=True))
        if i % 2:
            yield system | {"w0": float(rng.uniform(-1.0, 1.0))}, "phi0", (0.1, 6.2)
        else:
            yield system | {"phi0": float(rng.uniform(0.0, 6.2))}, "w0", (-1.5, 1.5)


def missed(system, along, ends, points=401):
    """The pairs of neighbours whose verdicts differ although no edge lies between."""
    found = survey.edge("gyrostat", along=along, question="fate", **system, **{along: ends})
    x = np.linspace(*ends, points)
    fates = survey.evaluate("gyrostat", question="fate", **system, **{along: x})
    verdict, ok = fates.verdict.values, fates.status.values == 0
    at = np.flatnonzero((np.diff(verdict) != 0) & ok[1:] & ok[:-1])
    edges = np.append(found.edge.values, np.inf)
    after = edges[np.searchsorted(edges, x[at] - 1e-9)]
    return list(x[at[after > x[at + 1] + 1e-9]]), found


def test_no_separatrix_is_missed_along_an_initial_state():
    """These two lines, 1e-4 apart, had no edges and two; the border of a narrow map was lost by
    rounding.
    """
    system = {"b12": 0.5941388575, "b31": -0.0641300943, "d": -0.3939351464, "c23": -0.4431487758,
              "s2": -0.4902608247, "s3": -0.1098473882}  # fmt: skip
    for phi0 in (0.0272, 0.0273):
        lost, found = missed(system | {"phi0": phi0}, "w0", (0.0, 0.5))
        assert not lost
        assert found.sizes["place"] == 3
    for system, along, ends in lines_of_fates(24, seed=11):
        lost, found = missed(system, along, ends)
        assert not lost, (system, along)
        assert (found.edge_error < 1e-6).all()


@pytest.mark.parametrize(
    "system",
    [{"b12": 0.0, "b31": 0.0, "d": 0.7, "c23": 0.2, "s2": 0.3, "s3": 0.1},
     {"b12": 0.3, "b31": 0.4, "d": 0.0, "c23": 0.0, "s2": 0.0, "s3": 0.0}],
    ids=["without_friction", "free"],
)  # fmt: skip
@pytest.mark.parametrize(
    "line", [("w0", "phi0", 1.1, (-3.0, 3.0)), ("phi0", "w0", 0.3, (0.0, 6.28))]
)
def test_closed_separatrices_cross_a_line(system, line):
    """V and F in closed form: each edge lies on one level of them, within its error."""
    along, other, value, ends = line
    _, found = missed(system | {other: value}, along, ends)
    assert found.sizes["place"] >= 2
    phi, w = (found.edge.values, value) if along == "phi0" else (value, found.edge.values)
    b12, b31, d, c23, s2, s3 = system.values()
    if b12:
        level = abs(w - b12 * np.sin(phi) - b31 * np.cos(phi))
        levels = [np.hypot(b12, b31)]
        slope = b12 * np.cos(phi) - b31 * np.sin(phi) if along == "phi0" else 1.0
    else:

        def potential(x):
            return (
                -0.25 * d * np.cos(2.0 * x)
                + 0.5 * c23 * np.sin(2.0 * x)
                - s2 * np.sin(x)
                - s3 * np.cos(x)
            )

        x = np.linspace(0.0, 2.0 * np.pi, 200_001)
        top = potential(x)
        levels = top[1:-1][(top[1:-1] > top[2:]) & (top[1:-1] > top[:-2])]
        level = 0.5 * np.square(w) + potential(phi)
        slope = np.gradient(potential(x), x)[np.searchsorted(x, phi)] if along == "phi0" else w
    off = abs(level[:, None] - np.asarray(levels)).min(axis=1)
    # the levels of the lattice are 1e-10 too low, at most
    assert (off <= 1.01 * abs(slope) * found.edge_error.values + (0.0 if b12 else 1e-9)).all()


def test_a_line_through_a_focus_is_not_complete():
    """A branch that winds round it crosses the line w = 0 at every half turn; at a node at most once."""
    system = {"b12": 0.7, "b31": -0.4, "d": 0.0, "c23": 0.0, "s2": 0.5, "s3": -0.2}
    for b12, complete in ((0.7, 0), (12.0, None)):
        b31 = -0.4 / 0.7 * b12
        found = survey.edge(
            "gyrostat", along="phi0", question="fate", **system | {"b12": b12, "b31": b31},
            w0=0.0, phi0=(0.0, 6.28),
        )  # fmt: skip
        assert found.attrs.get("complete") == complete


def test_lines_that_touch_a_separatrix():
    """w = F - |F|, F = 0.3 sin phi + 0.4 cos phi, is 0 where F is greatest; -w where it is least."""
    system = {"b12": 0.3, "b31": 0.4, "d": 0.0, "c23": 0.0, "s2": 0.0, "s3": 0.0}
    found = survey.edge(
        "gyrostat", along="phi0", question="fate", **system, w0=0.0, phi0=(0.0, 6.28)
    )
    off = abs(found.edge.values - np.arctan2(0.3, 0.4) - [0.0, np.pi])
    assert (off <= found.edge_error.values).all() and (found.edge_error < 1e-7).all()


def test_a_separatrix_that_begins_on_the_line_is_one_edge():
    """Along w = 0 without friction: both branches of a saddle begin at its angle."""
    system = {"b12": 0.0, "b31": 0.0, "d": 0.7, "c23": 0.2, "s2": 0.3, "s3": 0.1}
    found = survey.edge(
        "gyrostat", along="phi0", question="fate", **system, w0=0.0, phi0=(0.0, 6.28)
    )
    own = found.edge.values[found.edge_class.values == 0]
    assert own.size == 2 and np.diff(own)[0] > 1.0


@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-9, 3e-9, 1e-7, -1e-5])
def test_lines_beside_a_saddle_meet_its_branch(off):
    """There w = slope (phi - phi_s), to first order."""
    system = {"b12": 0.7, "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": 0.5, "s3": -0.2}
    saddle, dg, f = saddle_of(system)
    slope = 0.5 * (f - np.sqrt(f * f + 4.0 * dg))
    for along, other, value, wanted, ends in (
        ("w0", "phi0", saddle + off, slope * off, (-1.0, 1.0)),
        ("phi0", "w0", off, saddle + off / slope, (0.0, 6.28)),
    ):
        found = survey.edge(
            "gyrostat", along=along, question="fate", **system, **{other: value, along: ends}
        )
        away = abs(found.edge.values - wanted) - found.edge_error.values
        assert away.min() <= 30.0 * off * off + 1e-14


def saddle_of(system):
    """Its angle, g' there (positive) and f, by mpmath's findroot on g."""
    b12, b31, d, c23, s2, s3 = (mp.mpf(value) for value in system.values())

    def g(x):
        return -d * mp.sin(x) * mp.cos(x) - c23 * mp.cos(2 * x) + s2 * mp.cos(x) - s3 * mp.sin(x)

    x = np.linspace(0.0, 6.28, 400)
    rising = next(i for i in range(399) if g(x[i]) < 0.0 < g(x[i + 1]))
    root = mp.findroot(g, (x[rising], x[rising + 1]), solver="anderson")
    return float(root), float(mp.diff(g, root)), float(b12 * mp.cos(root) - b31 * mp.sin(root))
