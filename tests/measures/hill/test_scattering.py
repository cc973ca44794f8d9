"""The separatrix as a problem of scattering: against 40 digits, and against what satellites do as k -> 1."""

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpc, mpf

import survey
from survey import status
from survey.measures.hill import scattering

NAMES = tuple(scattering.NAMES)
WAVES = NAMES[:5]


def passage(rho, m):
    """Re f f'* and |f f'| at 0 by the power series of y1, y2 about 0, joined to Jost's solution at
    u = 0.8.
    """
    order, u = 160, mpf(0.8)
    s, th, square = [mpf(1)], [mpf(0)], []
    for n in range(order):
        square.append(mp.fsum(s[i] * s[n - i] for i in range(n + 1)))
        s.append(-mp.fsum(s[i] * th[n - i] for i in range(n + 1)) / (n + 1))
        th.append(square[n] / (n + 1))
    solutions = []
    for first in ((mpf(1), mpf(0)), (mpf(0), mpf(1))):
        y = [*first]
        for n in range(order - 2):
            total = m * y[n] + mp.fsum(
                2 * (square[i] + rho * s[i]) * y[n - i] for i in range(n + 1)
            )
            y.append(-total / ((n + 1) * (n + 2)))
        solutions.append(
            (
                mp.fsum(c * u**n for n, c in enumerate(y)),
                mp.fsum(n * c * u ** (n - 1) for n, c in enumerate(y) if n),
            )
        )
    nu = mpc(0, -mp.sqrt(m)) if m > 0 else mp.sqrt(-m)
    # sech u = 2 sum (-1)^j x^(2j+1), sech^2 u = its square, x = exp(-u)
    terms = 110
    sech = [mpf(0)] * terms
    sech[1::2] = [mpf(2) * (-1) ** j for j in range(len(sech[1::2]))]
    both = [mp.fsum(sech[i] * sech[n - i] for i in range(n + 1)) for n in range(terms)]
    a = [mpc(1)]
    for n in range(1, terms):
        total = sum((2 * both[j] + 2 * rho * sech[j]) * a[n - j] for j in range(1, n + 1))
        a.append(-total / (n * (n + 2 * nu)))
    f = sum(c * mp.exp(-(nu + n) * u) for n, c in enumerate(a))
    slope = -sum((nu + n) * c * mp.exp(-(nu + n) * u) for n, c in enumerate(a))
    (y1, d1), (y2, d2) = solutions
    f0, slope0 = f * d2 - slope * y2, slope * y1 - f * d1
    product = f0 * mp.conj(slope0)
    return product.real, abs(product)


@pytest.mark.parametrize(
    ("body", "rho"), [("prolate", 0.3), ("prolate", 2.5), ("oblate", 1.02), ("oblate", 0.7)]
)
def test_against_40_digits(body, rho):
    with mp.workdps(60):
        m = mpf(rho) ** 2 - (1 if body == "oblate" else 0)
        rate = mp.sqrt(abs(m))
        along, back = (passage(sign * mpf(rho), m)[0] for sign in (1, -1))
        if m > 0:
            a, b = (mp.asinh(abs(x) / rate) for x in (along, back))
            share = 2 / mp.pi * mp.acos(min(1 / mp.cosh(a), 1 / mp.cosh(b)))
            values = (
                1 / mp.cosh(a),
                1 / mp.cosh(b),
                share,
                mp.log(mp.cosh(a) * mp.cosh(b)) / 2,
                (a + b) / 2,
            )
            known = dict(zip(WAVES, values, strict=True))
        else:
            known = dict(zip(NAMES[5:], (-along / rate, -back / rate), strict=True))
    ds = survey.evaluate("satellite", k=0.5, rho=rho, body=body, variables=[*NAMES])
    for name in NAMES:
        value, bar = float(ds[name]), float(ds[f"{name}_error"])
        if name in known:
            assert abs(value - known[name]) <= bar + mpf(10) ** -25 and bar < 3e-12, (
                name,
                value,
                known[name],
                bar,
            )
        else:
            assert np.isnan(value)


def test_the_values_of_the_mathematics_page():
    rho = np.array([1 / np.sqrt(3), 1.0])
    ds = survey.evaluate("satellite", k=0.5, rho=rho, variables=[*NAMES])
    assert float(ds.separatrix_transmission[0]) == pytest.approx(0.9941371190, abs=5e-11)
    assert float(ds.separatrix_transmission_back[0]) == pytest.approx(0.6736900155, abs=5e-11)
    np.testing.assert_allclose(
        2 * np.cosh(2 * ds.separatrix_largest_growth), [3.224854, 2.144280], atol=6e-7
    )


def test_the_separatrix_itself():
    """k = 1 has these outputs alone, those of the neighbours: librations' means, and each passage's
    own numbers.
    """
    rho = np.linspace(-3.0, 3.0, 40)
    for body in ("prolate", "oblate"):
        for name, values in (("k", [0.99, 1.0, 1.01]), ("one_minus_k", [-0.01, 0.0, 0.01])):
            ds = survey.evaluate(
                "satellite", **{name: values}, rho=rho, body=body, variables=[*NAMES]
            )
            assert (ds.status == status.OK).all()
            at, below, above = (
                ds.sel({name: v}, drop=True)
                for v in (values[1], *values[:: 2 if name == "k" else -2])
            )
            xr.testing.assert_identical(at, below)
            for output in (*NAMES[:2], *NAMES[5:]):
                xr.testing.assert_identical(at[output].variable, above[output].variable)
    bodies = survey.evaluate(
        "satellite", k=1.0, inertia_ratio=[0.3, 1.0, 1.2, 1.9], variables=[*NAMES]
    )
    assert bodies.status.values.tolist() == [
        status.OK,
        status.INVALID_PARAMETERS,
        status.OK,
        status.OK,
    ]
    rho = 1 / np.sqrt(3 * np.array([0.7, 0.2, 0.9]))
    for i, (body, place) in enumerate((("prolate", 0), ("oblate", 2), ("oblate", 3))):
        own = survey.evaluate("satellite", k=1.0, rho=rho[i], body=body, variables=[*NAMES])
        for output in NAMES:
            np.testing.assert_allclose(bodies[output][place], own[output], atol=1e-12)


def test_no_verdict_on_the_separatrix():
    for variables in (None, ["verdict", "separatrix_growth"]):
        with pytest.raises(
            survey.BadInput, match=r"k = 1 .* \(there request the variables separatrix_\*"
        ):
            survey.evaluate("satellite", k=1.0, rho=0.7, variables=variables)
    ds = survey.evaluate(
        "satellite", k=[0.9, 1.0], rho=0.7, variables=["verdict", "separatrix_growth"]
    )
    assert ds.status.values.tolist() == [status.OK, status.INVALID_PARAMETERS]
    assert np.isnan(ds.separatrix_growth[1])
    lone = survey.evaluate("satellite", k=1.0, rho=0.7, variables=["separatrix_growth"])
    with pytest.raises(survey.BadInput, match=r"k = 1 is outside"):
        lone.survey.trajectory()


@pytest.mark.parametrize(
    ("body", "rho", "side"), [("prolate", 0.6, 1), ("prolate", -0.6, -1), ("oblate", 1.2, 1)]
)
def test_satellites_as_k_approaches_1(body, rho, side):
    """Over whole turns of the phase 2 K q, 1 - k from 1e-9 to 1e-14 or so: share, mean and largest growth."""
    q = np.sqrt(rho**2 - (body == "oblate"))
    turns = max(1, int(3 * q / np.pi))
    quarters = 11.0 + np.pi / q * turns * (np.arange(1500) + 0.5) / 1500
    short = side * 8.0 * np.exp(-2.0 * quarters)
    assert abs(short).min() > 1e-14
    wanted = [*WAVES, "exponent", "verdict"]
    ds = survey.evaluate("satellite", one_minus_k=short, rho=rho, body=body, variables=wanted)
    passages = 2 if side > 0 else 1
    growth = ds.exponent / passages
    assert float((ds.verdict == 0).mean()) == pytest.approx(
        float(ds.separatrix_unstable_share[0]), abs=2e-3
    )
    assert float(growth.mean()) == pytest.approx(float(ds.separatrix_growth[0]), rel=3e-3)
    most = float(ds.separatrix_largest_growth[0])
    assert most * (1 - 1e-4) < float(growth.max()) < most * (1 + 1e-4)


@pytest.mark.parametrize("rho", [0.6, 0.9])
def test_an_evanescent_plateau(rho):
    """D exp(-4 K sqrt(1 - rho^2)) -> a+ a-, with errors of the size of 1 - k and of the other wave."""
    short = 1e-12
    names = ["separatrix_amplification", "separatrix_amplification_back", "discriminant", "period"]
    ds = survey.evaluate("satellite", one_minus_k=short, rho=rho, body="oblate", variables=names)
    scaled = float(ds.discriminant) * np.exp(-float(ds.period) * np.sqrt((1 - rho) * (1 + rho)))
    both = float(ds.separatrix_amplification) * float(ds.separatrix_amplification_back)
    assert scaled == pytest.approx(both, rel=1e-3)


def test_rotations_take_the_sign_of_rho():
    along = survey.evaluate("satellite", k=2.0, rho=[0.6, -0.6], variables=[*WAVES])
    assert along.separatrix_transmission[0] == along.separatrix_transmission_back[1]
    assert along.separatrix_growth[1] > along.separatrix_growth[0]
    lib = survey.evaluate("satellite", k=0.5, rho=[0.6, -0.6], variables=[*WAVES])
    np.testing.assert_allclose(lib.separatrix_growth[0], lib.separatrix_growth[1], rtol=1e-13)
    known = (along.separatrix_growth[0] + along.separatrix_growth[1]) / 2
    np.testing.assert_allclose(lib.separatrix_growth[0], known, rtol=1e-12)


def test_where_it_does_not_apply():
    ds = survey.evaluate("satellite", k=0.5, rho=[0.0, 2000.0], variables=[*NAMES, "verdict"])
    assert all(ds[name].isnull().all() for name in NAMES) and (ds.status == 0).all()
