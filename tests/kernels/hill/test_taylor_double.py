"""Double-double: what float64 leaves undecided is decided, within bars that mpmath confirms."""

import numpy as np
import pytest
from hill_problems import factors, mp_factors
from mpmath import mp, mpf

import survey
from survey.kernels.hill.answers import STABLE, UNSTABLE
from survey.kernels.lanes import RESULTS
from survey.scenes import mathieu

FAMILIES = {
    ("prolate", True): "PL",
    ("prolate", False): "PR",
    ("oblate", True): "OL",
    ("oblate", False): "OR",
}


@pytest.mark.parametrize(
    ("body", "k", "rho"),
    [
        ("prolate", 0.5, 1.3),
        ("oblate", 0.9, 0.7),
        ("prolate", 1.4, -0.8),
        ("oblate", 3.0, 2.0),
        ("prolate", 0.05, 4.0),
    ],
)
def test_factors_lie_within_their_bars(body, k, rho):
    out = factors(body, rho, k=k)
    assert out.shape == (RESULTS,)
    exact = mp_factors(FAMILIES[body, k < 1], k, rho, digits=40)
    for i, value in enumerate(exact[:4]):
        assert abs(value - mpf(float(out[i]))) <= out[4 + i] < 3e-16 * abs(out[i]) + 1e-24, (
            i,
            value,
        )
    assert tuple(out[8:]) == exact[4:]


@pytest.mark.parametrize("body", ["prolate", "oblate"])
@pytest.mark.parametrize("rho", [1e-9, 1e-12])
def test_beside_lames_edge_the_verdict_is_given(body, rho):
    """|D| - 2 is of the order of rho^2: float64 cannot tell, and mpmath does."""
    ds = survey.evaluate("satellite", k=0.5, rho=rho, body=body)
    alone = survey.evaluate("satellite", k=0.5, rho=rho, body=body, method="taylor16")
    y1, dy1, y2, dy2, *_ = mp_factors(FAMILIES[body, True], 0.5, rho, digits=50)
    assert int(alone.verdict) == -1
    assert int(ds.verdict) == (UNSTABLE if dy1 * y2 > 0 or y1 * dy2 < 0 else STABLE)


@pytest.mark.slow
def test_both_sides_of_the_edge_of_a_tongue_two_ulp_apart():
    """An edge of the prolate tongue n = 4 at k = 0.3, closed in by mpmath to 1e-30: its neighbours
    are decided.
    """
    k = 0.3
    with mp.workdps(40):
        rho = mp.findroot(
            lambda x: mp_factors("PL", k, x, digits=40)[2],
            (mpf("1.66"), mpf("1.67")),
            solver="anderson",
        )
    below = np.nextafter(float(rho), 0.0) if mpf(float(rho)) > rho else float(rho)
    ds = survey.evaluate("satellite", k=k, rho=[below, np.nextafter(below, 9.0)])
    assert sorted(ds.verdict.values) == [UNSTABLE, STABLE]
    assert np.sign(ds.y2.values[0]) == -np.sign(ds.y2.values[1])


def test_mathieus_narrow_tongue():
    """n = 3 opens as q^3 (DLMF 28.6(ii)): at q = 1e-4 it is 1e-13 wide, and a = 9 + q^2/16 +-
    q^3/64 its edges.
    """
    q = 1e-4
    centre, half = 9 + q**2 / 16, q**3 / 64
    a = np.array([centre - 3e-15 - 4 * half, centre + 4 * half + 3e-15])
    ds = survey.evaluate("mathieu", a=a, q=q)
    assert ds.verdict.values.tolist() == [STABLE, STABLE]
    problem = mathieu._problem(np.array([q]), a[None, :])
    out = problem.exact(np.zeros(2, int), a, np.zeros(2), np.array([8, 8]))
    assert (abs(out[:, 0]) > out[:, 4]).all() and (abs(out[:, 3]) > out[:, 7]).all()
    assert np.sign(out[0, 0]) == -np.sign(out[1, 0]) and np.sign(out[0, 3]) == -np.sign(out[1, 3])
