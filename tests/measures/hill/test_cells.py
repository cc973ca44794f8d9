"""Cells with a verdict of their own: areas by quadrature of the edges, no tongue missed, no
aliasing believed.
"""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import mathieu_a, mathieu_b

from survey.kernels.hill.answers import STABLE, UNDECIDED, UNSTABLE
from survey.kernels.hill.cells import HALVED_X, HALVED_Y, descend
from survey.measures.hill import cells as hill_cells
from survey.measures.hill import edges as hill_edges
from survey.measures.hill.cells import Side
from survey.scene import Request
from survey.scenes import mathieu, satellite


def solver(scene, *names, outputs=hill_edges.FACTORS, rtol=1e-11, **options):
    """The scene's outputs at arrays of two parameters."""
    request = Request(options, "auto", rtol, frozenset(outputs))
    return lambda *values: scene.solve(dict(zip(names, values, strict=True)), request)


def holding(cells, x, y):
    """Verdicts of the cells that hold the points (by their closed boxes, the first that does)."""
    box = cells.box[:, :, None]
    inside = (box[:, 0] <= x) & (x <= box[:, 1]) & (box[:, 2] <= y) & (y <= box[:, 3])
    assert inside.any(axis=0).all()
    return cells.verdict[inside.argmax(axis=0)]


def tongues(q):
    """Widths of the tongues 0 (down to a = -7), 1 and 2 of Mathieu's equation."""
    return mathieu_a(0, q) + 7 + sum(mathieu_a(n, q) - mathieu_b(n, q) for n in (1, 2))


@pytest.mark.parametrize("log", [False, True])
@pytest.mark.parametrize(("depth", "narrow"), [(5, 0.2), (9, 1e-3)])
def test_mathieus_unstable_area_is_the_integral_of_the_characteristic_values(log, depth, narrow):
    """No edge meets a = -7 or a = 6 for q <= 2, so the widths are smooth: Gauss's rule is exact to
    rounding.
    """
    low = 0.05 if log else 0.0
    x, weights = np.polynomial.legendre.leggauss(30)
    exact = (1 - low / 2) * (weights * tongues(low + (1 - low / 2) * (x + 1))).sum()
    cells = hill_cells.find(solver(mathieu, "a", "q"), Side(-7, 6, depth), Side(low, 2, depth, log))
    bar = 0.5 * (cells.total - cells.stable - cells.unstable)
    assert abs(cells.unstable + bar - exact) <= bar < narrow
    sides = cells.box.reshape(-1, 2, 2)
    assert np.ptp(sides, axis=2).prod(axis=1).sum() == pytest.approx(cells.total, rel=1e-12)


def _edges(k, low, high, rtol):
    """All edges of the prolate tongues in rows k."""

    def solve(row, rho, wanted):
        return solver(satellite, "k", "rho", outputs=wanted, rtol=rtol, body="prolate")(
            k[row][:, None], rho
        )

    return hill_edges.find(solve, k.size, low, high)


def test_the_area_of_a_satellites_tongue_is_the_integral_of_its_edges():
    """Prolate tongue n = 3, which lies in 0.9 < rho < 1.3 for k <= 0.5."""
    x, weights = np.polynomial.legendre.leggauss(12)
    k = 0.3 + 0.2 * x
    edges = _edges(k, 0.9, 1.3, 1e-11)
    assert edges.complete.all() and np.bincount(edges.row).tolist() == [2] * 12
    exact = 0.2 * (weights * np.diff(edges.position.reshape(12, 2))[:, 0]).sum()
    cells = hill_cells.find(
        solver(satellite, "k", "rho", body="prolate"), Side(0.1, 0.5, 9), Side(0.9, 1.3, 9)
    )
    bar = 0.5 * (cells.total - cells.stable - cells.unstable)
    assert abs(cells.unstable + bar - exact) <= bar < 1e-6


@pytest.mark.parametrize(("start", "share"), [(0, 0.148), (1, 0.54)])
def test_the_unstable_shares_of_librations(start, share):
    """14.8 % of prolate and 54 % of oblate bodies and amplitudes (satellite.md: What is known)."""
    solve = solver(satellite, "inertia_ratio", "amplitude", direction="1", rtol=1e-9)
    cells = hill_cells.find(solve, Side(start, start + 1, 7), Side(0, 1.57, 7))
    low, high = cells.unstable / cells.total, 1 - cells.stable / cells.total
    assert low < share < high < low + 0.045


def test_blocks_of_few_cells_are_not_solved_again_and_would_decide_next_to_nothing():
    """Beside inertia_ratio = 1, where tongues are dense, no series serves."""
    solve = solver(satellite, "inertia_ratio", "amplitude", direction="1", rtol=1e-9)
    sides, blocks = (Side(0.5, 1, 8), Side(0.3, 1.57, 7)), []

    def each(task, items, _what):
        blocks.extend(items)
        return [task(item) for item in items]

    few = hill_cells.find(solve, *sides, each)
    many = hill_cells.find(solve, *sides, descend=lambda *given: descend(*given, 0))
    halved = np.concatenate(blocks)[:, [HALVED_X, HALVED_Y]]
    assert (15 - halved.sum(axis=1) >= hill_cells.FEWEST).all() and (halved > 2).any()
    assert many.points > 1.5 * few.points
    assert many.stable + many.unstable - few.stable - few.unstable < 1e-3 * many.total


def test_no_tongue_is_stable_however_narrow():
    """Rows of prolate tongues n = 3 ... 7, down to 3e-13 wide: all that lies in them is unstable or
    undecided.
    """
    k = np.array([0.0512, 0.1512, 0.3013])
    edges = _edges(k, 0.61, 3.41, 1e-13)
    cells = hill_cells.find(
        solver(satellite, "k", "rho", body="prolate"), Side(0.0, 0.4, 7), Side(0.6, 3.42, 7)
    )
    assert (holding(cells, k[edges.row], edges.position) == UNDECIDED).all()
    inside = edges.index[1:] == edges.index[:-1]
    width, middle = (
        np.diff(edges.position)[inside],
        (0.5 * (edges.position[1:] + edges.position[:-1]))[inside],
    )
    assert inside.sum() >= 14 and width.min() < 1e-11
    assert set(holding(cells, k[edges.row[1:]][inside], middle)) <= {UNDECIDED, UNSTABLE}


@settings(deadline=None, max_examples=10)
@given(st.sampled_from([("prolate", (0.0, 0.97)), ("oblate", (0.0, 0.97)), ("prolate", (1.05, 2.5))]),
       st.floats(-2.5, 1.0), st.floats(0.3, 5.0), st.integers(0, 2**32 - 1))  # fmt: skip
def test_a_decided_cell_has_that_verdict_at_all_its_points(kind, low, size, seed):
    body, ends = kind
    cells = hill_cells.find(
        solver(satellite, "k", "rho", body=body), Side(*ends, 6), Side(low, low + size, 6)
    )
    part = np.random.default_rng(seed).random((2, 2000))
    k, rho = ends[0] + np.ptp(ends) * part[0], low + size * part[1]
    own = holding(cells, k, rho)
    known = solver(satellite, "k", "rho", outputs=["verdict"], body=body)(k, rho)["verdict"]
    decided = own != UNDECIDED
    assert decided.mean() > 0.3 and (own == known)[decided & (known != UNDECIDED)].all()


def test_a_factor_that_vanishes_between_the_nodes_is_not_believed():
    """T_32 is -1 at all nodes of T_16: a series through these alone is constant, and stable."""

    def solve(x, y):
        local = 2 * ((4 * x) % 1) - 1  # on each of the first blocks
        hidden = 0.5 - np.cos(32 * np.arccos(local)) + 0 * y
        one, bar = np.ones_like(hidden), np.full_like(hidden, 1e-15)
        values = {"y1": hidden, "dy2": one, "dy1": -one, "y2": one}
        return values | {f"{name}_error": bar for name in values}

    cells = hill_cells.find(solve, Side(0, 1, 2), Side(0, 1, 2))
    assert (cells.verdict == UNDECIDED).all() and cells.stable == cells.unstable == 0


def test_what_is_not_finite_stays_undecided():
    """The scene has no answer in a corner: no verdict there, and the true one elsewhere."""

    def solve(x, y):
        one = np.where((x > 0.7) & (y > 0.7), np.nan, 1.0)
        values = {"y1": one, "dy2": one, "dy1": -one, "y2": one}
        return values | {f"{name}_error": 1e-15 * one for name in values}

    cells = hill_cells.find(solve, Side(0, 1, 5), Side(0, 1, 5))
    corner = (cells.box[:, 1] > 0.7) & (cells.box[:, 3] > 0.7)
    assert (cells.verdict[corner] == UNDECIDED).all() and (cells.verdict[~corner] == STABLE).all()
    assert 1 - 0.3**2 - 0.05 < cells.stable < 1 - 0.3**2 and cells.unstable == 0


def test_threads_give_the_same_bits():
    solve, axes = solver(mathieu, "a", "q"), (Side(-2, 12, 7), Side(0, 5, 6))
    with ThreadPoolExecutor(3) as pool:
        threaded = hill_cells.find(
            solve, *axes, each=lambda task, items, what: list(pool.map(task, items))
        )
    alone = hill_cells.find(solve, *axes)
    np.testing.assert_array_equal(alone.box, threaded.box)
    np.testing.assert_array_equal(alone.verdict, threaded.verdict)
    assert (alone.stable, alone.unstable) == (threaded.stable, threaded.unstable)
