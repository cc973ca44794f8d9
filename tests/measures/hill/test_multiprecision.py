"""A user's z in double-double: every verdict beside edges, held against mpmath; what cannot be run
so says why.
"""

import math
from math import cos, exp, pi

import numba
import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf

import survey
from survey.measures.hill import multiprecision

HARMONIC = 2.0


@numba.njit
def helper(u, q):
    return -HARMONIC * q * np.cos(HARMONIC * u)


def even(u, p):
    return p[0] + helper(u, p[1])


def shifted(u, p):
    return p[0] - 2 * p[1] * math.cos(2 * (u - 0.3))


def stair(u, p):
    return p[0] + p[1] if u < p[2] * pi else p[0] - p[1]


def trace(a, q, shift=0.0, steps=24, order=40):
    """(D - 2, D + 2) of Mathieu's equation over binary64's pi, started `shift` early; Taylor series
    by mpmath.
    """
    with mp.workdps(45):
        a, q, h = mpf(a), mpf(q), mpf(pi) / steps
        y1, v1, y2, v2 = mpf(1), mpf(0), mpf(0), mpf(1)
        for step in range(steps):
            angle = 2 * (step * h - mpf(shift))
            z = [
                -2 * q * mp.cos(angle + n * mp.pi / 2) * (2 * h) ** n / mp.factorial(n) * h * h
                for n in range(order)
            ]
            z[0] += a * h * h
            ends = []
            for series in ([mpf(1), mpf(0)], [mpf(0), mpf(1)]):
                for n in range(order):
                    series.append(-mp.fdot(z[: n + 1], series[n::-1]) / ((n + 1) * (n + 2)))
                ends.append((mp.fsum(series), mp.fsum(n * c for n, c in enumerate(series)) / h))
            (p11, p21), (p12, p22) = ends[0], (ends[1][0] * h, ends[1][1] * h)
            y1, v1, y2, v2 = (
                p11 * y1 + p12 * v1,
                p21 * y1 + p22 * v1,
                p11 * y2 + p12 * v2,
                p21 * y2 + p22 * v2,
            )
        return y1 + v2 - 2, y1 + v2 + 2


def around(edge, number):
    """Consecutive doubles about `edge`."""
    return edge + (np.arange(number) - number // 2) * np.spacing(edge)


@pytest.mark.parametrize(("z", "is_even", "shift"), [(even, True, 0.0), (shifted, False, 0.3)])
@pytest.mark.parametrize(
    "edge", [9.047739259809374, pytest.param(25.02085434544858, marks=pytest.mark.slow)]
)
def test_consecutive_doubles_beside_an_edge_are_decided_as_mpmath_does(z, is_even, shift, edge):
    places = around(edge, 9)
    scene = survey.hill(z, period=pi, parameters=("a", "q"), even=is_even)
    ds = survey.evaluate(scene, a=xr.DataArray(places, dims="x"), q=1.0)
    assert (ds.verdict != -1).all()
    for i, a in enumerate(places):
        # z is not quite even, as binary64's pi is not pi: what is solved is z up to T/2, and its
        # mirror image
        if is_even and i % 4:
            continue
        low, high = trace(a, 1.0, shift)
        exact = 0 if low > 0 or high < 0 else 1
        growth = max(low, -high, 0)
        if not is_even:
            assert int(ds.verdict[i]) == exact
            with mp.workdps(45):
                error = abs(mpf(float(ds.exponent[i])) - 2 * mp.asinh(mp.sqrt(growth) / 2))
            assert error <= float(ds.exponent_error[i])
        assert abs(float(ds.discriminant[i] - (low + 2))) <= float(ds.discriminant_error[i]) + 1e-15


def test_a_jump_whose_place_is_computed_too():
    """Meissner's equation: the product of two propagators with constant z, of numbers as they are."""
    scene = survey.hill(
        stair, period=pi, parameters=("a", "q", "d"), breaks=lambda p: [0, p[2] * pi]
    )

    def exact(a):
        with mp.workdps(45):
            product = mp.eye(2)
            for z, length in (
                (a + mpf(2.5), mpf(0.3) * mpf(pi)),
                (a - mpf(2.5), mpf(pi) - mpf(0.3) * mpf(pi)),
            ):
                w = mp.sqrt(mp.mpc(z))
                s, c = mp.sin(w * length) / w, mp.cos(w * length)
                product = mp.matrix([[c, s], [-z * s, c]]) * product
            return mp.re(product[0, 0] + product[1, 1])

    low, high = next(
        (a, a + 0.1)
        for a in np.arange(5, 30, 0.1)
        if (abs(exact(a)) < 2) != (abs(exact(a + 0.1)) < 2)
    )
    with mp.workdps(45):
        edge = mp.findroot(lambda a: abs(exact(a)) - 2, (low, high), solver="anderson")
    places = around(float(edge), 9)
    ds = survey.evaluate(scene, a=xr.DataArray(places, dims="x"), q=2.5, d=0.3)
    with mp.workdps(45):
        assert ds.verdict.values.tolist() == [int(abs(exact(mpf(float(a)))) < 2) for a in places]


def test_what_cannot_be_run_with_more_digits_says_why_and_keeps_its_answer():
    table = np.array([1.0, 2.0])
    known = survey.hill(
        lambda u, p: p[0] + table[1] * cos(u) ** 2 * exp(-float(p[1])),
        period=pi,
        parameters=("a", "q"),
    )
    assert known.NOTES["z_more_digits"].startswith("double-double")
    places, levels = np.array([-1.0, 99.0]), np.array([1.0, 1.0])
    scene = survey.hill(
        lambda u, p: p[0] + np.interp(u, places, levels) * cos(2 * u), period=pi, parameters="a"
    )
    ds = survey.evaluate(scene, a=np.array([3.0, 5.0]))
    assert ds.attrs["z_more_digits"] == "none: it uses interp"
    assert ds.status.values.tolist() == [0, 0]


@pytest.mark.parametrize("name", sorted(multiprecision.SAME - {"cbrt", "power", "sign"}))
def test_functions_mean_the_same_with_more_digits(name):
    function, twice = getattr(math, name), name in ("atan2", "hypot")
    if name == "cbrt" and not hasattr(math, "cbrt"):
        return
    x = (1.25,) if name == "acosh" else (0.3,)
    lifted = multiprecision.lifted(lambda u: function(u, 0.7) if twice else function(u))
    with multiprecision.LOCK:
        value = lifted(multiprecision.context().mpf(x[0]))
    assert abs(float(value) - (function(x[0], 0.7) if twice else function(x[0]))) <= 4e-16 * max(
        1, abs(float(value))
    )


def test_a_function_of_another_kind_is_refused():
    for bad in (lambda u: round(u), lambda u: np.dot(u, u), lambda u: mp.zeta(u), lambda u: "a"):
        with pytest.raises(multiprecision.Unsupported), multiprecision.LOCK:
            multiprecision.lifted(bad)(multiprecision.context().mpf(0.5))
