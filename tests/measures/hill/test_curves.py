"""Curves of edges: every row between is crossed where its edges are; folds, closed curves, borders,
double points.
"""

import numpy as np
import pytest
from hill_problems import mp_factors
from hill_qep import coefficients, eigenvalues
from measures.hill.test_edges import solver

from survey.measures.hill import curves as hill_curves
from survey.measures.hill import edges as hill_edges
from survey.measures.hill import folds as hill_folds
from survey.measures.square import Square
from survey.scene import Request
from survey.scenes import mathieu, satellite

UNIT = Square(np.zeros(2), np.ones(2), np.zeros(2, bool))


def seeds(x, kind, index):
    x = np.atleast_2d(np.asarray(x, dtype=float))
    return hill_curves.Seeds(x, np.array(kind), np.array(index), np.zeros_like(x), np.ones_like(x))


def satellite_curves(body, k, rho):
    """The solver, the square and the curves from the rows k."""

    def solve(q, p, wanted):
        return satellite.solve(
            {"k": q, "rho": p}, Request({"body": body}, "auto", 1e-13, frozenset(wanted))
        )

    edges = hill_edges.find(solver(satellite, "k", k, "rho", body=body), k.size, *rho)
    square = Square(np.array([k[0], rho[0]]), np.array([k[-1], rho[1]]), np.zeros(2, bool))
    x = square.positions(np.stack([k[edges.row], edges.position], axis=1))
    return solve, square, hill_curves.trace(solve, square, seeds(x, edges.kind, edges.index))


def synthetic(f):
    """A solver whose factor y1 is f, known to 1e-15, with every edge in tongue 1."""

    def solve(q, p, wanted):
        q, p = np.broadcast_arrays(q, p)
        out = {name: np.ones(q.shape) for name in hill_edges.FACTORS} | {"y1": f(q, p)}
        out |= {f"{name}_error": np.full(q.shape, 1e-15) for name in hill_edges.FACTORS}
        return out | {
            "rotation_number": np.full(q.shape, 0.5),
            "verdict": np.zeros(q.shape, np.int8),
        }

    return solve


@pytest.mark.parametrize(
    ("body", "k", "rho"),
    [
        ("prolate", (0.3, 0.98), (0.3, 3.0)),
        ("oblate", (0.0, 0.98), (0.577, 3.2)),
        ("prolate", (1.02, 2.0), (-3.0, 2.0)),
    ],
)
def test_any_row_is_crossed_where_its_edges_are(body, k, rho):
    """Rows that no seed came from: each edge once, in its class and tongue, and nothing else."""
    _, square, curves = satellite_curves(body, np.linspace(*k, 12), rho)
    assert curves.complete.all() and (curves.of_seed >= 0).all()
    rows = np.random.default_rng(4).uniform(*k, 15)
    edges = hill_edges.find(solver(satellite, "k", rows, "rho", body=body), rows.size, *rho)
    parts = np.split(square.parameters(curves.x), np.cumsum(curves.count)[:-1])
    assert edges.complete.all()
    for row, value in enumerate(rows):
        crossed = []
        for part, kind, index in zip(parts, curves.kind, curves.index, strict=True):
            for at in np.flatnonzero(np.diff(part[:, 0] > value)):
                (q0, p0), (q1, p1) = part[at : at + 2]
                crossed.append((kind, index, p0 + (p1 - p0) * (value - q0) / (q1 - q0)))
        own = edges.row == row
        listed = sorted(zip(edges.kind[own], edges.index[own], edges.position[own], strict=True))
        assert [edge[:2] for edge in listed] == [cross[:2] for cross in sorted(crossed)]
        np.testing.assert_allclose(
            [e[2] for e in listed], [c[2] for c in sorted(crossed)], atol=2e-3 * np.ptp(rho)
        )


def test_the_error_bar_holds_the_curve():
    """With 30 digits, the factor changes sign within a point's error bar along the normal."""
    _, square, curves = satellite_curves("oblate", np.linspace(0.2, 0.9, 4), (0.6, 2.2))
    assert curves.error.max() < 1e-13
    whose = np.repeat(np.arange(curves.count.size), curves.count)
    inner = np.flatnonzero(((curves.x > 0.01) & (curves.x < 0.99)).all(axis=1))
    names = ("y1", "dy2", "dy1", "y2")
    for point in np.random.default_rng(7).choice(inner, 5):
        normal = np.array([-curves.along[point, 1], curves.along[point, 0]])
        signs = []
        for side in (-1, 1):
            k, rho = square.parameters(curves.x[point] + side * curves.error[point] * normal)
            y1, dy1, y2, dy2 = mp_factors("OL", float(k), float(rho))[:4]
            signs.append(dict(y1=y1, dy1=dy1, y2=y2, dy2=dy2)[names[curves.kind[whose[point]]]] > 0)
        assert signs[0] != signs[1]


def test_the_fold_of_the_rotations_is_where_eigenvalues_meet():
    """Half the sum, and the square of the difference, of the two eigenvalues are analytic in k
    through the fold.
    """
    solve, square, curves = satellite_curves("prolate", np.linspace(1.05, 1.4, 6), (-2.5, 0.5))
    folds = hill_folds.find(solve, square, curves)
    (k, rho), (k_error, rho_error) = (
        square.parameters(folds.x)[0],
        folds.error[0] * (square.high - square.low),
    )
    kind = int(curves.kind[folds.curve[0]])
    assert len(folds.x) == 1 and k_error < 1e-12 and rho_error < 1e-9

    def pair(k):
        roots = eigenvalues(*coefficients("prolate", k, 96), kind, 48)
        one, other = roots[np.argsort(abs(roots - rho))[:2]]
        return ((one + other) / 2).real, ((one - other) ** 2).real

    h = 1e-3
    places = k + h * np.array([-1.5, -0.5, 0.5, 1.5])
    middle, gap = np.array([pair(float(place)) for place in places]).T
    root = np.polynomial.Polynomial.fit(places, gap, 3).roots()
    root = root[abs(root - k).argmin()].real
    assert abs(root - k) <= k_error + 1e-10
    assert abs(np.polynomial.Polynomial.fit(places, middle, 3)(root) - rho) <= rho_error + 1e-9


def test_folds_lie_on_their_curves():
    """Mathieu's curves over rows of a: folds at q = 0 where a = n^2 (DLMF 28.6(i)), others in pairs +-q."""

    def solve(q, p, wanted):
        return mathieu.solve({"a": q, "q": p}, Request({}, "auto", 1e-13, frozenset(wanted)))

    rows = np.linspace(-5.0, 20.0, 60)
    edges = hill_edges.find(solver(mathieu, "a", rows, "q"), rows.size, -10.0, 10.0)
    square = Square(np.array([-5.0, -10.0]), np.array([20.0, 10.0]), np.zeros(2, bool))
    x = square.positions(np.stack([rows[edges.row], edges.position], axis=1))
    curves = hill_curves.trace(solve, square, seeds(x, edges.kind, edges.index))
    folds = hill_folds.find(solve, square, curves)
    parts = np.split(curves.x, np.cumsum(curves.count)[:-1])
    for curve, place in zip(folds.curve, folds.x, strict=True):
        assert np.hypot(*(parts[curve] - place).T).min() < hill_curves.LONGEST
    a, q = square.parameters(folds.x).T
    error = folds.error * (square.high - square.low)
    still = abs(q) < 1
    assert (abs(q) <= error[:, 1])[still].all() and (abs(a - np.rint(a)) <= error[:, 0])[
        still
    ].all()
    assert sorted(np.rint(a[still])) == [0, 4, 4, 9, 9, 16, 16]
    np.testing.assert_allclose(np.sort(q[~still]), np.sort(-q[~still]), atol=1e-11)
    assert (~still).sum() == 6 and (folds.error < 1e-11).all()


def test_a_closed_curve_closes_and_has_two_folds():
    solve = synthetic(lambda q, p: (q - 0.5) ** 2 + 4 * (p - 0.4) ** 2 - 0.09)
    x = [[0.5, 0.55], [0.5, 0.25], [0.7, 0.4 + np.sqrt(0.05) / 2]]
    curves = hill_curves.trace(solve, UNIT, seeds(x, [0, 0, 0], [1, 1, 1]))
    assert curves.count.size == 1 and curves.complete.all() and curves.of_seed.tolist() == [0, 0, 0]
    q, p = (curves.x - [0.5, 0.4]).T
    np.testing.assert_allclose(q**2 + 4 * p**2, 0.09, atol=1e-13)
    np.testing.assert_array_equal(curves.x[0], curves.x[-1])
    turns = np.unwrap(np.arctan2(2 * p, q))
    assert abs(abs(turns[-1] - turns[0]) - 2 * np.pi) < 1e-9 and abs(np.diff(turns)).max() < 0.3
    folds = hill_folds.find(solve, UNIT, curves)
    order = np.argsort(folds.x[:, 0])
    assert (abs(folds.x[order] - [[0.2, 0.4], [0.8, 0.4]]) <= folds.error[order]).all() and (
        folds.error < 1e-9
    ).all()


def test_neighbours_are_not_taken_for_each_other():
    """The factor has a zero every 1e-3, and each curve keeps to its own."""
    solve = synthetic(lambda q, p: np.sin(1e3 * np.pi * (p - 0.1 * np.sin(3 * q))))
    p = np.array([0.5, 0.501, 0.502, 0.503])
    curves = hill_curves.trace(solve, UNIT, seeds(np.stack([0 * p, p], axis=1), [0] * 4, [1] * 4))
    assert curves.complete.all() and curves.count.size == 4
    for part, start in zip(np.split(curves.x, np.cumsum(curves.count)[:-1]), p, strict=True):
        np.testing.assert_allclose(part[:, 1] - 0.1 * np.sin(3 * part[:, 0]), start, atol=1e-12)
        assert sorted(part[[0, -1], 0]) == [0, 1]


def test_a_curve_that_meets_a_double_point_is_lost_there():
    solve = synthetic(lambda q, p: (q - 0.5) ** 2 - (p - 0.5) ** 2)
    curves = hill_curves.trace(solve, UNIT, seeds([[0.1, 0.1], [0.25, 0.75]], [0, 0], [1, 1]))
    assert not curves.complete.any()


def test_a_logarithmic_axis_keeps_its_ends():
    square = Square(np.array([1e-8, -1.0]), np.array([0.5, 3.0]), np.array([True, False]))
    ends = square.parameters(np.array([[0.0, 0.0], [1.0, 1.0]]))
    np.testing.assert_array_equal(ends, [square.low, square.high])
    x = np.random.default_rng(0).uniform(size=(50, 2))
    np.testing.assert_allclose(square.positions(square.parameters(x)), x, atol=4 * square.grain)
