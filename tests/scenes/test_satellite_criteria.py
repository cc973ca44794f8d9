"""What Lyapunov's and Zhukovskii's criteria compare, and the planar motion itself, against mpmath."""

import numpy as np
import pytest
from hill_problems import solve
from mpmath import mp, mpf

import survey

COMPARED = ["lyapunov_integral", "least_z", "lyapunov", "zhukovskii", "verdict", "period"]


def z_of(body, k, rho, u):
    """z by mpmath's own elliptic functions."""
    w = k * mp.ellipfun("cn", u, k=k) if k < 1 else k * mp.ellipfun("dn", k * u, k=1 / k)
    return 2 * w * w + 2 * rho * w + rho * rho + (1 - k * k if body == "prolate" else -k * k)


@pytest.mark.parametrize("body", ["prolate", "oblate"])
@pytest.mark.parametrize(
    ("k", "rho"),
    [
        (0.3, 0.7),
        (0.999, -1.1),
        (1.2, -1.4),
        *(pytest.param(*at, marks=pytest.mark.slow) for at in ((0.95, 2.0), (3.0, 0.6))),
    ],
)
def test_the_integral_and_the_least_z(body, k, rho):
    out = solve(body, k=k, rho=rho)
    with mp.workdps(25):
        K, R = mpf(k), mpf(rho)
        period = 4 * mp.ellipk(K * K) if k < 1 else 2 * mp.ellipk(1 / K**2) / K
        total = period * mp.quad(lambda u: z_of(body, K, R, u), mp.linspace(0, period, 9))
        assert abs(out["lyapunov_integral"][0] - total) <= out["lyapunov_integral_error"][0]
        values = [z_of(body, K, R, period * i / 400) for i in range(401)]
        assert out["least_z"][0] <= min(values) + out["least_z_error"][0]
        # of the samples, not of z
        assert out["least_z"][0] >= min(values) - 1e-3 * (1 + abs(min(values)))
        edge = [(i * mp.pi / period) ** 2 for i in range(60)]
        n = [i for i in range(59) if edge[i] <= min(values) and max(values) <= edge[i + 1]]
        assert bool(out["zhukovskii"][0]) == bool(n)


@pytest.mark.parametrize(
    ("body", "low", "high"),
    [("prolate", 0.01, 0.95), ("oblate", 0.01, 0.95), ("prolate", 1.02, 3.0)],
)
def test_no_point_that_a_criterion_certifies_is_unstable(body, low, high):
    rho = np.linspace(-4.0, 4.0, 301)
    ds = survey.evaluate(
        "satellite", body=body, k=np.linspace(low, high, 90), rho=rho, variables=COMPARED
    )
    certain = (ds.zhukovskii == 1) | (ds.lyapunov == 1)
    assert (ds.verdict == 1).where(certain, True).all()
    assert (ds.zhukovskii == 1).sum() > 100
    nonnegative = ds.least_z >= 0
    assert ((ds.lyapunov == 1) == ((ds.lyapunov_integral <= 4) & nonnegative)).all()


def test_zhukovskii_certifies_some_librations():
    """The share that was counted apart: 4665 of 28280 stable points (k <= 0.95, 0.577 <= rho <= 4)."""
    k, rho = np.linspace(0.01, 0.95, 150), np.linspace(0.577, 4, 210)
    ds = survey.evaluate("satellite", k=k, rho=rho, variables=COMPARED)
    share = float((ds.zhukovskii == 1).sum() / (ds.verdict == 1).sum())
    assert abs(share - 4665 / 28280) < 0.03


@pytest.mark.parametrize(
    "given", [{"k": 0.4}, {"one_minus_k": 1e-9}, {"k": 0.0}, {"k": 1.3}, {"one_minus_k": -1e-7}]
)
def test_the_planar_motion(given):
    ds = survey.evaluate("satellite", rho=0.9, **given).survey.trajectory(time=30.0)
    with mp.workdps(40):
        k = mpf(given["k"]) if "k" in given else 1 - mpf(given["one_minus_k"])
        for i in range(0, ds.u.size, max(1, ds.u.size // 12)):
            u = mpf(float(ds.u[i]))
            if k < 1:
                x = mp.asin(k * mp.ellipfun("sn", u, k=k))
            else:
                side, cosine = mp.ellipfun("sn", k * u, k=1 / k), mp.ellipfun("cn", k * u, k=1 / k)
                x = mp.atan2(side, cosine)
                x += 2 * mp.pi * mp.nint((mpf(float(ds.x[i])) - x) / (2 * mp.pi))
            assert abs(mpf(float(ds.x[i])) - x) <= float(ds.x_error[i]), (given, float(u))
