"""Points a few doubles to 1e-12 beside edges of tongues: verdicts, exponents and rotation numbers
within their bars.

The truth beside an edge is the polynomial through the half-period factors, with 40 digits, at
places 1e-7 around it. With 30 digits it would not do: beside an edge an exponent hangs on the 28th
digit of a factor.
"""

import numpy as np
import pytest
import xarray as xr
from hill_problems import BODY, mp_factors
from mpmath import mp, mpf

import survey

# Family, k, and places beside edges at which a factor (its place in y1, y1', y2, y2') vanishes.
EDGES = [
    ("PL", 0.5, 1.1, 0), ("OL", 0.3, 0.9, 1), ("PR", 1.6, 1.5, 2), ("OR", 1.3, 0.8, 3),
]  # fmt: skip


def polynomial(family, k, rho, nodes=6):
    """The four factors as functions of rho within 1e-7, by Newton's interpolation."""
    with mp.workdps(45):
        width = mpf("1e-7")
        places = [mpf(rho) + width * mp.cos(mp.pi * (i + 0.5) / nodes) for i in range(nodes)]
        table = [list(mp_factors(family, k, place, 40)[:4]) for place in places]
        for order in range(1, nodes):
            for i in range(nodes - 1, order - 1, -1):
                gap = places[i] - places[i - order]
                table[i] = [(a - b) / gap for a, b in zip(table[i], table[i - 1], strict=True)]

        def at(x):
            total = table[-1]
            for i in range(nodes - 2, -1, -1):
                total = [
                    value * (x - places[i]) + own
                    for value, own in zip(total, table[i], strict=True)
                ]
            return total

        return at


def edge_near(family, k, rho, which):
    """The zero of a factor nearest to rho, by the secant method."""
    with mp.workdps(20):
        return float(
            mp.findroot(lambda x: mp_factors(family, k, x, 20)[which], (rho, rho + 0.02), tol=1e-30)
        )


@pytest.mark.slow
@pytest.mark.parametrize(("family", "k", "rho", "which"), EDGES, ids=[edge[0] for edge in EDGES])
def test_what_is_said_beside_an_edge_is_true(family, k, rho, which):
    edge = edge_near(family, k, rho, which)
    random = np.random.default_rng(1)
    ulps = edge + np.arange(-60, 61) * np.spacing(edge)
    places = np.concatenate(
        [ulps, edge + random.choice([-1, 1], 80) * 10 ** random.uniform(-16, -12, 80)]
    )
    ds = survey.evaluate("satellite", k=k, rho=xr.DataArray(places, dims="x"), body=BODY[family])
    exact, index = polynomial(family, k, edge), np.rint(2 * float(ds.rotation_number[0]))
    assert (ds.verdict == -1).sum() == 0
    with mp.workdps(45):
        for i, place in enumerate(places):
            y1, v1, y2, v2 = exact(mpf(float(place)))
            sine, cosine = -v1 * y2, y1 * v2
            stable = sine > 0 and cosine > 0
            assert int(ds.verdict[i]) == stable
            exponent = 0 if stable else 2 * mp.asinh(mp.sqrt(-min(sine, cosine)))
            # n pi + theta, or n pi + pi - theta, whichever has the parity of the signs and lies at
            # the edge's index
            turn = mp.atan2(mp.sqrt(abs(sine)), mp.sqrt(abs(cosine))) / mp.pi
            odd = (y1 < 0) != (y2 < 0)
            part = 1 - 2 * turn if odd else 2 * turn
            turns = (
                (2 * mp.nint((index - part - odd) / 2) + odd + part) / 2
                if stable
                else mpf(int(index)) / 2
            )
            for name, value in (("exponent", exponent), ("rotation_number", turns)):
                assert abs(mpf(float(ds[name][i])) - value) <= float(ds[f"{name}_error"][i]), (
                    name,
                    place,
                )
