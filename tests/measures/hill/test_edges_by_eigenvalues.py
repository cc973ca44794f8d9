"""Edges against the Fourier quadratic eigenproblem and Mathieu's characteristic values: number,
class and place.
"""

from itertools import pairwise

import numpy as np
import pytest
import scipy.special
from hill_qep import edges as eigenproblem
from measures.hill.test_edges import solver

from survey.measures.hill import edges as hill_edges
from survey.scenes import mathieu, satellite


def agree(mine, row, theirs, doubt):
    """The edges of a row are those of another method, one for one, each within its bar and theirs."""
    own = mine.row == row
    assert mine.complete[row]
    order = np.lexsort((mine.position[own], mine.kind[own]))
    position, kind, error = (
        values[own][order] for values in (mine.position, mine.kind, mine.error)
    )
    theirs = np.array(sorted(theirs, key=lambda edge: (edge[1], edge[0])))
    np.testing.assert_array_equal(kind, theirs[:, 1])
    assert (abs(position - theirs[:, 0]) <= error + doubt).all()
    assert error.max() < 1e-12 * (1 + abs(position).max())


@pytest.mark.parametrize(
    ("body", "low", "high", "moduli"),
    [
        ("prolate", 0.1, 4.0, (0.3, 0.9)),
        pytest.param("oblate", 0.1, 4.0, (0.3, 0.9), marks=pytest.mark.slow),
        pytest.param("prolate", 0.1, 4.0, (0.5, 0.99), marks=pytest.mark.slow),
        pytest.param("oblate", 0.1, 4.0, (0.5, 0.99), marks=pytest.mark.slow),
        pytest.param("prolate", -4.0, 4.0, (1.02, 1.16, 1.5), marks=pytest.mark.slow),
        ("oblate", -4.0, 4.0, (1.02, 1.16, 1.5)),
    ],
)
def test_the_eigenproblem_has_the_same_edges(body, low, high, moduli):
    if body == "oblate" and low > 0:
        # below it edges come in pairs closer than 1e-9 as k grows, where eigenvalues are not sharp
        low = 0.6
    mine = hill_edges.find(solver(satellite, "k", moduli, "rho", body=body), len(moduli), low, high)
    for row, k in enumerate(moduli):
        coarse, fine = (eigenproblem(body, k, low, high, n) for n in (48, 64))
        assert [kind for _, kind in coarse] == [kind for _, kind in fine]
        change = max(abs(a - b) for (a, _), (b, _) in zip(coarse, fine, strict=True))
        assert change < 3e-12
        agree(mine, row, fine, 3 * change + 1e-13)


def test_mathieus_characteristic_values_by_scipy():
    q = np.array([0.3, 3.0, 12.0, 30.0])
    low, high = -60.0, 90.0
    mine = hill_edges.find(solver(mathieu, "q", q, "a"), q.size, low, high)
    for row, value in enumerate(q):
        even = [(scipy.special.mathieu_a(n, value), 2 - 2 * (n % 2)) for n in range(12)]
        odd = [(scipy.special.mathieu_b(n, value), 3 - 2 * (n % 2)) for n in range(1, 12)]
        agree(mine, row, [edge for edge in even + odd if low <= edge[0] <= high], 1e-12)


@pytest.mark.parametrize(
    ("scene", "lane", "name", "bounds", "span", "options"),
    [
        (satellite, "rho", "k", (0.01, 0.995), (0.3, 4.0), {"body": "prolate"}),
        *(
            pytest.param(
                satellite, "rho", "k", bounds, span, {"body": body}, marks=pytest.mark.slow
            )
            for bounds, span, body in (
                ((0.01, 0.995), (0.3, 4.0), "oblate"),
                ((1.01, 3.0), (-5.0, 5.0), "prolate"),
            )
        ),
        (satellite, "rho", "k", (1.01, 3.0), (-5.0, 5.0), {"body": "oblate"}),
        (mathieu, "a", "q", (-20.0, 20.0), (-30.0, 60.0), {}),
    ],
)
def test_the_rotation_number_counts_the_edges_of_random_rows(
    scene, lane, name, bounds, span, options
):
    """On a fine scan: wherever it tells a band or a gap, so many edges of so many tongues lie between."""
    rows = np.random.default_rng(20).uniform(*bounds, 40)
    solve = solver(scene, name, rows, lane, **options)
    edges = hill_edges.find(solve, rows.size, *span)
    assert edges.complete.all()
    x = np.linspace(*span, 401)
    band = hill_edges._band(
        solve(np.arange(rows.size), np.tile(x, (rows.size, 1)), hill_edges.COUNTS)
    )
    for row in range(rows.size):
        known = np.flatnonzero(np.isfinite(band[row]))
        own = edges.row == row
        for a, b in pairwise(known):
            between = own & (edges.position > x[a]) & (edges.position < x[b])
            # each edge is half a step of the staircase, up or down; between neighbours of the scan
            # it is climbed once
            assert between.sum() == 2 * abs(band[row, b] - band[row, a])
            passed = np.sort(edges.index[between])
            low, high = sorted((band[row, a], band[row, b]))
            np.testing.assert_array_equal(
                passed, np.rint(np.arange(low, high, 0.5) + 0.25 + 1e-9).astype(int)
            )


def test_a_list_that_lacks_an_edge_is_not_complete():
    solve = solver(satellite, "k", [0.5], "rho", body="oblate")
    edges = hill_edges.find(solve, 1, 0.3, 3.2)
    whole = [edges.row, edges.position, edges.error, edges.kind]

    def complete(edges):
        return hill_edges._complete(solve, np.array([0]), edges, 0.3, 3.2)

    sound, index = complete(whole)
    assert sound.all()
    np.testing.assert_array_equal(index, edges.index)
    n = edges.index == 2
    for left_out in (np.flatnonzero(n)[:1], np.flatnonzero(n)):  # one edge, a whole tongue
        assert not complete([np.delete(values, left_out) for values in whole])[0].any()
    wrong = np.where(n, (edges.kind + 2) % 4, edges.kind)  # odd and even tongues
    assert not complete([*whole[:3], wrong])[0].any()


def test_a_band_of_the_wrong_parity_has_no_tongue_with_such_an_edge():
    """Antiperiodic edges bound odd tongues: those of the gap 3, or beside the bands 2.5 and 3.5."""
    band = np.array([2.0, 2.5, 3.0, 3.5, np.nan])
    odd, even = (hill_edges._beside(band, np.full(5, kind)) for kind in (0, 2))
    np.testing.assert_array_equal(odd, [np.nan, 3, 3, 3, np.nan])
    np.testing.assert_array_equal(even, [2, 2, np.nan, 4, np.nan])
