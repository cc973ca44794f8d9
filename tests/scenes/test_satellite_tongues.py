"""Narrow tongues of librations (satellite.md: Numerics): no verdict is wrong, every point inside a
tongue is found.

The truth is the edges by Hill's method in mpmath: z = 2 w^2 + 2 rho w + rho^2 + c is a cosine
series in v = pi u / 2K, and a factor vanishes where the matrix that the equation makes of its
solution's Fourier series is singular.
"""

import numpy as np
import pytest
from hill_problems import BODY, cases, solve
from mpmath import mp, mpf

import survey
from survey.kernels.hill.answers import STABLE, UNSTABLE

DIGITS = 40
FACTORS = ("y1", "dy1", "y2", "dy2")
TONGUES = [("PL", n) for n in range(3, 9)] + [("OL", n) for n in range(2, 7)]
CELLS = [(family, n, k) for family, n in TONGUES for k in (0.15, 0.3, 0.5)]


def fourier(family, k, factor, size):
    """Matrices S, W: S + 2 rho W + rho^2 is singular where `factor` vanishes at T/2 (DLMF 22.11.2,
    22.11.13).
    """
    m = k * k
    first = mp.ellipk(m)
    q = mp.exp(-mp.pi * mp.ellipk(1 - m) / first)
    w, s = [[mpf(0)] * (2 * size + 1) for _ in range(2)]  # half the coefficients of w and of 2 w^2
    s[0] = 2 * (mp.ellipe(m) / first - 1 + m)
    for n in range(1, 2 * size + 1):
        if n % 2:
            w[n] = mp.pi / first * q ** (mpf(n) / 2) / (1 + q**n)
        else:
            s[n] = (mp.pi / first) ** 2 * n * q ** (mpf(n) / 2) / (1 - q**n)
    sign = 1 if factor in ("y1", "dy1") else -1  # cosines or sines
    orders = [mpf({"y1": 0.5, "dy2": 0.5, "dy1": 0, "y2": 1}[factor]) + j for j in range(size)]
    square, linear = mp.matrix(size), mp.matrix(size)
    for i, b in enumerate(orders):
        for j, a in enumerate(orders):
            near, far, once = int(abs(b - a)), int(b + a), mpf(1) if b > 0 else mpf(0.5)
            square[i, j] = once * (s[near] + sign * s[far])
            linear[i, j] = once * (w[near] + sign * w[far])
        square[i, i] += (1 - m if family == "PL" else -m) - (mp.pi * b / (2 * first)) ** 2
    return square, linear


def edge(family, k, factor, near, size=16):
    """The zero of `factor` in rho nearest to `near`: in float64, then by secants in mpmath."""
    square, linear = fourier(family, k, factor, size)
    a, b = (np.array(matrix.tolist(), dtype=float) for matrix in (square, linear))
    zeros = np.linalg.eigvals(np.block([[np.zeros((size, size)), np.eye(size)], [-a, -2 * b]]))
    x = zeros[abs(zeros - near).argmin()].real
    return mp.findroot(
        lambda rho: mp.det(square + 2 * rho * linear + rho * rho * mp.eye(size)), (mpf(x), mpf(x) + mpf("1e-13")),
        solver="secant", tol=mpf("1e-50"), maxsteps=2, verify=False,
    )  # fmt: skip


def tongue(family, n, k):
    """Both edges of tongue n, ascending (satellite.md: What is known: where it opens, and how it bends)."""
    opens = (n * n / 4 - 1) ** 0.5 if family == "PL" else n / 2
    bends = {("PL", 3): -13 / 32, ("PL", 4): -4 / 5, ("PL", 5): -43 / 32}.get(
        (family, n), 0
    ) / opens
    with mp.workdps(DIGITS):
        return sorted(
            edge(family, mpf(k), f, opens + bends * k * k)
            for f in (("y1", "dy2") if n % 2 else ("y2", "dy1"))
        )


def beside(low, high, count=100):
    """Doubles on both sides of both edges, from the next one to half the width away."""
    at = np.array([float(low), float(high)])[:, None]
    away = np.geomspace(np.spacing(at[1, 0]), 0.499 * float(high - low), count)
    return np.unique(np.concatenate([at - away, at + away]))


def within(rho, low, high):
    """Which doubles lie between the edges: close to one, rho - float(edge) is exact."""
    above, below = ((rho - float(edge)) - float(edge - float(edge)) for edge in (low, high))
    return (above > 0) & (below < 0)


@pytest.mark.parametrize("case", cases("boundaries"), ids=lambda case: f"{case['fam']} {case['k']}")
def test_hills_method_gives_the_reference(case):
    with mp.workdps(DIGITS):
        known = mpf(case["rho_star"])
        found = edge(
            case["fam"], mpf(float(case["k"])), case["factor_zero"][:-5], float(known), size=30
        )
        assert abs(found - known) < mpf("1e-22")


@pytest.mark.parametrize(
    ("family", "n", "k"),
    [pytest.param(*cell, marks=[pytest.mark.slow] * (i % 6 > 0)) for i, cell in enumerate(CELLS)],
)
def test_no_verdict_is_wrong_and_none_is_open(family, n, k):
    edges = tongue(family, n, k)
    rho = beside(*edges)
    inside = within(rho, *edges)
    assert min(inside.sum(), (~inside).sum()) > 150
    verdict = solve(BODY[family], k=k, rho=rho)["verdict"]
    np.testing.assert_array_equal(verdict, np.where(inside, UNSTABLE, STABLE))
    alone = solve(BODY[family], "taylor16", k=k, rho=rho)["verdict"]  # float64 leaves some open
    np.testing.assert_array_equal(alone[alone >= 0], verdict[alone >= 0])


@pytest.mark.parametrize(("family", "n", "widest"), [("PL", 7, 6e-10), ("PL", 8, 2e-11)])
def test_a_dense_row_finds_a_tongue_as_narrow(family, n, widest):
    """By way of the proxy of whole rows, which cannot see it: |D| - 2 is 3e-18."""
    low, high = tongue(family, n, 0.15)
    rho = np.unique(
        np.append(np.linspace(float(low) - 2e-9, float(high) + 2e-9, 400), beside(low, high))
    )
    ds = survey.evaluate(
        "satellite", k=0.15, rho=rho, body=BODY[family], variables=["discriminant", "verdict"]
    )
    assert 0 < high - low < widest
    np.testing.assert_array_equal(ds.verdict, np.where(within(rho, low, high), UNSTABLE, STABLE))
