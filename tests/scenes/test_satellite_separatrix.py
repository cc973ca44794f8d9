"""Satellites close to the separatrix and at large rho (satellite.md: Numerics), against
double-double and mpmath.
"""

import numpy as np
import pytest
from hill_problems import factors, mp_factors, solve
from mpmath import mp, mpf

import survey
from survey import status
from survey.kernels.hill.answers import MARGINAL, STABLE, UNSTABLE
from survey.kernels.hill.satellite import half_periods

NAMES = ("y1", "dy1", "y2", "dy2")
BODIES = ("prolate", "oblate")


def decided(y1, dy1, y2, dy2):
    """D and the verdict from the factors, known so well that their signs are certain."""
    d = 4 * y1 * dy2 - 2 if abs(y1 * dy2) < abs(dy1 * y2) else 4 * dy1 * y2 + 2
    return d, UNSTABLE if dy1 * y2 > 0 or y1 * dy2 < 0 else STABLE


def miss(body, rho, scale=1.0, **modulus):
    """|error of D| / max(scale, |D|); asserts that the verdict is right, that every factor and D lie within their bars.

    The truth is that of the double-double kernel, whose own bar is half an ulp.
    """
    exact = factors(body, rho, **modulus)
    out = solve(body, rtol=1e-13, rho=rho, **modulus)
    d, verdict = decided(*exact[:4])
    off = abs(out["discriminant"][0] - d)
    assert out["status"][0] == status.OK and out["verdict"][0] == verdict, (body, rho, modulus)
    assert off <= out["discriminant_error"][0] + 4e-16 * (2 + abs(d)), (body, rho, modulus)
    for i, name in enumerate(NAMES):
        assert abs(out[name][0] - exact[i]) <= out[f"{name}_error"][0] + exact[4 + i], (
            body,
            rho,
            modulus,
            name,
        )
    return off / max(scale, abs(d))


@pytest.mark.parametrize(
    ("body", "side"),
    [
        ("prolate", 1),
        ("oblate", -1),
        pytest.param("prolate", -1, marks=pytest.mark.slow),
        pytest.param("oblate", 1, marks=pytest.mark.slow),
    ],
)
def test_relative_error_down_to_1e_12(body, side):
    """Random rho, 1 - k = +- 1e-2 .. 1e-12."""
    random = np.random.default_rng(11)
    for _ in range(200):
        rho, short = random.uniform(-4, 4), side * 10 ** random.uniform(-12, -2)
        assert miss(body, rho, one_minus_k=short) < 1e-12, (rho, short)


@pytest.mark.parametrize(
    ("short", "rho"),
    [
        ("0x1.e5b73e07bce59p-25", "0x1.f92bccbd2e08ap-1"),
        pytest.param("0x1.07187afae09a5p-22", "0x1.f95d27096cca3p-1", marks=pytest.mark.slow),
        pytest.param("0x1.1feb9aee30cc3p-34", "0x1.f904cdaf59ba2p-1", marks=pytest.mark.slow),
        pytest.param("0x1.4720c897d62dfp-21", "0x1.f97f1af054814p-1", marks=pytest.mark.slow),
    ],
)
def test_a_discriminant_that_an_ulp_of_rho_moves_by_more(short, rho):
    """The worst of 4,500 beside the thin bands of oblate bodies: an ulp of rho moves D by up to 3e-11."""
    short, rho = float.fromhex(short), float.fromhex(rho)
    with mp.workdps(40):
        d, verdict = decided(*mp_factors("OL", 1 - mpf(short), mpf(rho), 40)[:4])
        for rtol, most in ((1e-10, 5e-11), (1e-12, 1e-12), (1e-13, 1e-12)):
            out = solve("oblate", rtol=rtol, rho=rho, one_minus_k=short)
            assert abs(out["discriminant"][0] - d) < min(
                most * max(1, abs(d)), mpf(out["discriminant_error"][0])
            )
            assert out["verdict"][0] == verdict


@pytest.mark.parametrize("body", [pytest.param("prolate", marks=pytest.mark.slow), "oblate"])
def test_rho_up_to_1000(body):
    random = np.random.default_rng(12)
    for _ in range(30):
        k, rho = random.uniform(0, 0.999), 10 ** random.uniform(1, 3)
        assert miss(body, rho, k=k) < 1e-11, (rho, k)
        assert miss(body, random.choice([-1, 1]) * rho, k=1 / k) < 1e-11, (rho, 1 / k)


@pytest.mark.slow
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("body", BODIES)
def test_rho_of_1000_at_the_separatrix(body, side):
    """Both at once: 6e4 radians, half an ulp of each step alone would be 7e-12 of the scale 2."""
    random = np.random.default_rng(14)
    # the first was the worst of 3,000 (1.02e-11) when steps did not fill the half period exactly
    points = [(1.038732346326154e-09, 1000.0), (1e-12, 1000.0)]
    points += [(10 ** random.uniform(-12, -8), random.uniform(880, 1000)) for _ in range(8)]
    for short, rho in points:
        assert miss(body, rho, scale=2.0, one_minus_k=side * short) < 6e-12, (rho, short)


@pytest.mark.parametrize("short", [1e-4, 1e-12, -1e-12])
@pytest.mark.parametrize("body", BODIES)
def test_dense_rows_by_the_separatrix(body, short):
    """By way of the proxy of whole rows: every verdict right, D within its bar."""
    rho = np.linspace(0.1, 4, 3000)
    ds = survey.evaluate(
        "satellite", one_minus_k=short, rho=rho, body=body, variables=["discriminant", "verdict"]
    )
    for i in range(0, rho.size, 30):
        d, verdict = decided(*factors(body, rho[i], one_minus_k=short)[:4])
        assert int(ds.verdict[i]) == verdict, rho[i]
        assert abs(float(ds.discriminant[i]) - d) <= float(ds.discriminant_error[i]), rho[i]
        assert float(ds.discriminant_error[i]) < 1e-9 * (1 + abs(d))


@pytest.mark.parametrize("short", [1e-2, 1e-4, 1e-8, 1e-12])
def test_exponentially_thin_stable_bands_of_an_oblate_body(short):
    """For rho < 1 a stable band is as narrow as exp(-4 K sqrt(1 - rho^2)); both its edges, from the
    next double on.
    """
    rho = np.linspace(0.05, 0.999, 300)
    out = solve("oblate", one_minus_k=short, rho=rho)
    assert (out["status"] == status.OK).all() and (out["verdict"] >= 0).all()
    count = 0
    for place, name in enumerate(NAMES):
        for i in np.flatnonzero(np.diff(np.sign(out[name]))):
            edge, count = (
                closed_in(
                    lambda x, at=place: factors("oblate", x, one_minus_k=short)[at], *rho[i : i + 2]
                ),
                count + 1,
            )
            for away in (0.0, 2e-16, 1e-15, 1e-13, 1e-10, 1e-7):
                miss("oblate", edge - away, one_minus_k=short)
                miss("oblate", np.nextafter(edge, 9) + away, one_minus_k=short)
    assert count >= 2


def closed_in(function, low, high):
    """The double below the zero of a function between `low` and `high`."""
    side = function(low) > 0
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if (function(middle) > 0) == side else (low, middle)
    return low


def test_no_overflow_and_no_false_alarm():
    """|D| of an oblate body is up to 1e31 at the last double below k = 1; far beyond, its bar
    leaves float32.
    """
    rho = np.linspace(0.02, 3, 150)
    for body in BODIES:
        near = solve(body, one_minus_k=np.array([[1e-14], [1e-16], [-1e-14], [-2e-16]]), rho=rho)
        assert (near["status"] == status.OK).all() and (near["verdict"] >= 0).all()
        far = solve(body, one_minus_k=1e-100, rho=rho)
        np.testing.assert_array_equal(far["status"] == status.OVERFLOW, (far["verdict"] < 0))
        assert (far["status"][rho > 1] == status.OK).all()
    assert abs(near["discriminant"]).max() > 1e30


def test_half_period_to_an_ulp():
    random = np.random.default_rng(13)
    bound = 2.3e-16 if np.finfo(np.longdouble).eps < 1e-18 else 6e-16
    for k in np.concatenate(
        [1 - 10 ** random.uniform(-12, 0, 20), 1 + 10 ** random.uniform(-12, 3, 20)]
    ):
        with mp.workdps(30):
            small = min(mpf(k), 1 / mpf(k))
            true, kc = (
                mp.ellipk(small**2) * (2 if k < 1 else 1 / mpf(k)),
                float(mp.sqrt(1 - small**2)),
            )
            assert abs(half_periods(np.array([k]), np.array([kc]))[0][0] - true) < bound * true, k


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_the_same_by_mpmath(seed):
    """No kernel of ours in the truth: near the separatrix, and at rho about 100."""
    random = np.random.default_rng(seed)
    body, short = BODIES[seed % 2], (-1) ** (seed // 2) * 10 ** random.uniform(-12, -2)
    rho = 100 * random.uniform(0.5, 1) if seed > 8 else random.uniform(-4, 4)
    family = ("P" if body == "prolate" else "O") + ("L" if short > 0 else "R")
    with mp.workdps(45):
        exact = mp_factors(family, 1 - mpf(short), mpf(rho), 45)[:4]
        d, verdict = decided(*exact)
        out = solve(body, rtol=1e-13, rho=rho, one_minus_k=short)
        assert abs(out["discriminant"][0] - d) < min(
            1e-12 * max(1, abs(d)), mpf(out["discriminant_error"][0])
        )
    assert out["verdict"][0] == verdict
    miss(body, rho, one_minus_k=short)


def test_a_bar_for_every_value_where_solutions_differ_by_30_orders():
    """An oblate body at next to no rho: the ellipse of the errors is so thin that rounding could
    turn it inside out.
    """
    out = survey.evaluate(
        "satellite",
        one_minus_k=np.geomspace(1e-16, 1e-9, 8),
        rho=np.append(0.0, np.geomspace(1e-18, 1, 19)),
        body="oblate",
    )
    for name in NAMES:
        assert (np.isfinite(out[name]) == np.isfinite(out[f"{name}_error"])).all(), name
    assert (out.status == status.OK).all() and (out.verdict.sel(rho=0.0) == MARGINAL).all()


@pytest.mark.parametrize("method", ["auto", "taylor16", "magnus6", "dop853"])
@pytest.mark.parametrize("body", ["prolate", "oblate"])
def test_a_rotation_number_whose_zeros_cannot_be_counted_says_so(method, body):
    """Where y1 is known to nothing at T/2, a zero next to it may be miscounted. At rho = 0 it is 1/2 or 0."""
    ds = survey.evaluate(
        "satellite", k=float(np.nextafter(1, 0)), rho=0.0, body=body, method=method, rtol=1e-12
    )
    # the same on the whole line rho = 0
    exact = survey.evaluate("satellite", k=0.5, rho=0.0, body=body)
    off = abs(abs(float(ds.rotation_number)) - abs(float(exact.rotation_number)))
    assert off <= float(ds.rotation_number_error) + 1e-15
