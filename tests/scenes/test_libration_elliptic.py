"""Danby's map against 30-digit references, the curves' known points, the full period, and the
circular problem.
"""

import json
import os
import subprocess
import sys
from importlib import resources

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

import survey
from survey.measures.libration import danby
from survey.sweep import cost

REFERENCE = json.loads(
    resources.files("survey.reference").joinpath("libration_elliptic.json").read_text()
)
POINTS, BOUNDARY = REFERENCE["points"], REFERENCE["boundary"]
STABLE_BELOW = {"A": False, "B": True, "KC": True}


def points(mu, e, **more):
    mu, e = np.broadcast_arrays(mu, e)
    return survey.evaluate(
        "libration_elliptic", mu=xr.DataArray(mu, dims="p"), e=xr.DataArray(e, dims="p"), **more
    )


@pytest.mark.parametrize(
    ("method", "rtol"),
    [("auto", 1e-6), ("auto", 1e-12), ("taylor16", 3e-9), ("dop853", 3e-8), ("rk4", 1e-6)],
)
def test_references_lie_within_the_bars(method, rtol):
    """At e < 0.7 the bars of methods by name come down to those asked here, of float64's roundings with
    the worst signs. The errors are 1e-13.
    """
    ds = points(
        [row["mu"] for row in POINTS], [row["e"] for row in POINTS], method=method, rtol=rtol
    )
    with mp.workdps(30):
        for name in "ab":
            exact = [mpf(row[name]) for row in POINTS]
            error = [
                abs(float(mpf(v) - x)) for v, x in zip(ds[name].values.tolist(), exact, strict=True)
            ]
            assert (
                (1e-4 if method == "auto" else 1e-5) < max(error / ds[f"{name}_error"].values) <= 1
            )
            size = np.array([1 + abs(float(x)) for x in exact])
            near = np.array([row["e"] < 0.7 for row in POINTS])
            assert (ds[f"{name}_error"].values < rtol * size)[near].all()
    decided = ds.verdict.values != -1
    assert (ds.verdict.values == [row["stable"] for row in POINTS])[decided].all()
    assert decided.all() or method != "auto"


def test_factors_within_their_bars():
    values, bars = danby.factors(
        np.array([row["e"] for row in POINTS]), np.array([row["mu"] for row in POINTS])
    )
    exact = np.array([[float(row[name]) for name in ("A", "B", "C", "D", "t")] for row in POINTS])
    assert (abs(values - exact) <= bars + np.spacing(abs(exact))).all()
    assert np.median(bars / (abs(values - exact) + np.spacing(abs(exact)))) < 1000


@pytest.mark.parametrize(
    "row", [r for r in BOUNDARY if r["e"] != "0"], ids=lambda r: f"{r['curve']}-{r['e']}"
)
def test_the_verdict_changes_across_the_curves(row):
    edge = float(row["mu"])
    ds = points([edge - 1e-12, edge + 1e-12], float(row["e"]), rtol=1e-13)
    below = STABLE_BELOW[row["curve"]]
    assert ds.verdict.values.tolist() == [below, not below]
    assert (ds.collision == (2 if row["curve"] == "KC" else 1)).all()


def test_all_multipliers_are_minus_one_at_the_tip():
    mu, e = (float(REFERENCE["tip"][name]) for name in ("mu", "e"))
    ds = points([mu], [e], rtol=1e-13)
    assert abs(float(ds.a[0]) + 4) <= ds.a_error[0] + 100 * np.spacing(1.0)  # mu and e are rounded
    assert abs(float(ds.b[0]) - 6) <= ds.b_error[0] + 100 * np.spacing(1.0)
    assert int(ds.verdict[0]) == 0  # so near it, by multiprecision


def test_the_strip_is_there_up_to_the_tip():
    """In the middle between A and KC, as the kept curves have them at e = 0.3."""
    a, kc = (float(r["mu"]) for r in BOUNDARY if r["e"] == "0.3" and r["curve"] != "B")
    ds = points([2 * a - kc, 0.5 * (a + kc), 2 * kc - a], 0.3)
    assert ds.verdict.values.tolist() == [0, 1, 0] and ds.collision.values[2] == 2


def monodromy(mu, e):
    """Over the full period, in the variables of (1), by scipy."""
    s = np.sqrt(1 - 3 * mu * (1 - mu))

    def slope(f, y):
        xi, eta, dxi, deta = y.reshape(4, 4)
        r = 1.5 / (1 + e * np.cos(f))
        return np.concatenate([dxi, deta, 2 * deta + (1 + s) * r * xi, (1 - s) * r * eta - 2 * dxi])

    return (
        solve_ivp(slope, (0, 2 * np.pi), np.eye(4).ravel(), "DOP853", rtol=1e-12, atol=1e-12)
        .y[:, -1]
        .reshape(4, 4)
    )


FAMILY = [
    "multiplier_re",
    "multiplier_im",
    "spectral_radius",
    "exponent",
    "krein",
    "crossing",
    "monodromy",
]


def test_multipliers_are_the_zeros_of_the_reference_polynomial():
    """Krein signs: two pairs on the circle have like ones where B D > 0 (section 3 of the digest)."""
    given = [row["mu"] for row in POINTS], [row["e"] for row in POINTS]
    ds = points(*given, variables=["verdict", *FAMILY])
    assert (ds.status == 0).all()
    like = set()
    with mp.workdps(40):
        for i, row in enumerate(POINTS):
            a, b = mpf(row["a"]), mpf(row["b"])
            exact = mp.polyroots([1, -a, b, -a, 1], maxsteps=500, extraprec=400)
            here = ds.isel(p=i)
            for re, im, bar in zip(
                here.multiplier_re.values.tolist(), here.multiplier_im.values.tolist(),
                here.multiplier_re_error.values.tolist(), strict=True,
            ):  # fmt: skip
                assert min(abs(complex(re, im) - z) for z in exact) <= bar
            radius = max(map(abs, exact))
            off = abs(mpf(float(here.spectral_radius)) - radius)
            assert off <= float(here.spectral_radius_error) + 1e-30
            exponent = abs(mpf(float(here.exponent)) - mp.log(radius) / (2 * mp.pi))
            assert exponent <= float(here.exponent_error) + 1e-30
            signs = here.krein.values
            if not row["stable"]:
                assert (signs[abs(here.multiplier_im.values) < 1e-9] == 0).all()
                continue
            upper = signs[here.multiplier_im.values > 0]
            like.add(bool(upper[0] == upper[1]))
            assert (upper[0] == upper[1]) == (float(row["B"]) * float(row["D"]) > 0)
            assert here.spectral_radius == 1.0 and here.spectral_radius_error == 0.0
    assert like == {True, False}


def test_the_monodromy_matrix_is_that_of_the_whole_period():
    """Of DOP853 in the variables of (1), brought to the canonical state (3)."""
    to = np.array([[1.0, 0, 0, 0], [1, 0, 0, 1], [0, -1, 1, 0], [0, -1, 0, 0]])
    for mu, e in ((0.01, 0.2), (0.04, 0.15), (0.045, 0.1), (0.02, 0.6), (0.0, 0.3)):
        here = points([mu], e, variables=FAMILY).isel(p=0)
        other = to @ monodromy(mu, e) @ np.linalg.inv(to)
        off = abs(here.monodromy.values - other)
        assert (off <= here.monodromy_error.values + 2e-8 * abs(other).max()).all()


def test_what_the_family_gives_agrees_with_the_map_and_leaves_it_alone():
    axes = {"mu": np.linspace(0.0, 0.06, 61), "e": np.linspace(0.0, 0.95, 39)}
    plain = survey.evaluate("libration_elliptic", **axes)
    ds = survey.evaluate(
        "libration_elliptic", variables=["a", "verdict", "collision", *FAMILY[:-1]], **axes
    )
    assert (ds.status == 0).all()
    assert all((ds[name] == plain[name]).all() for name in ("a", "verdict", "collision"))
    bars = ds.multiplier_re_error.sum("multiplier") + ds.a_error + 1e-14 * (1 + abs(ds.a))
    assert (abs(ds.multiplier_re.sum("multiplier") - ds.a) <= bars).all()
    assert ((ds.spectral_radius == 1.0) == (ds.verdict == 1)).all()
    unstable = (ds.verdict == 0) & (ds.mu > 0)
    assert (ds.spectral_radius - ds.spectral_radius_error > 1.0).where(unstable, True).mean() > 0.99
    how = ds.crossing.where(unstable & (ds.crossing > 0))
    assert (how == 4).where((ds.collision == 2) & how.notnull(), True).all()
    assert (how == 2).where((ds.collision == 1) & how.notnull() & (ds.a < -4), True).all()
    assert {2.0, 4.0} <= set(np.unique(how.values[np.isfinite(how.values)]))


def test_beyond_the_reach_of_float64_the_named_outputs_have_no_value_and_the_others_keep_theirs():
    given = {"mu": 0.01, "e": 1 - 1e-11}
    names = ["a", "verdict", "collision", "spectral_radius", "krein", "crossing"]
    ds = survey.evaluate("libration_elliptic", variables=names, **given)
    assert ds.status.attrs["flag_meanings"].split()[int(ds.status)] == "overflow"
    assert np.isnan(ds.a) and np.isnan(ds.spectral_radius)
    assert int(ds.verdict) == int(ds.collision) == int(ds.crossing) == -1
    assert (ds.krein == 0).all()
    assert int(survey.evaluate("libration_elliptic", **given).status) == 0


def test_half_the_period_gives_the_monodromy_of_the_whole_and_the_collision_its_multipliers():
    random = np.random.default_rng(3)
    mu, e = random.uniform(0.001, 0.05, 24), random.uniform(0.0, 0.5, 24)
    mu[:6], e[:6] = (
        [0.031, 0.034, 0.0365, 0.038, 0.042, 0.0455],
        [0.02, 0.06, 0.05, 0.06, 0.21, 0.29],
    )
    ds = points(mu, e)
    codes = set()
    for i in range(mu.size):
        matrix = monodromy(mu[i], e[i])
        polynomial, found = np.poly(matrix)[1:4], np.array([-ds.a[i], ds.b[i], -ds.a[i]])
        np.testing.assert_allclose(polynomial, found, rtol=0, atol=1e-8 * (1 + abs(found).max()))
        codes.add((expected := by_multipliers(matrix), int(ds.verdict[i])))
        assert expected == int(ds.collision[i])
    assert codes == {(1, 0), (1, 1), (2, 0), (2, 1)}


# xi, eta, xi' - eta, eta' + xi
CANONICAL = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, -1, 1, 0], [1, 0, 0, 1]])
FORM = np.block([[np.zeros((2, 2)), np.eye(2)], [-np.eye(2), np.zeros((2, 2))]])


def by_multipliers(matrix):
    """The code of `collision` by the multipliers and their Krein signs."""
    multipliers, vectors = np.linalg.eig(matrix)
    off = abs(abs(multipliers) - 1) > 1e-5
    if off.any():
        return 1 if (abs(multipliers[off].imag) < 1e-6).all() else 2
    upper = np.flatnonzero(multipliers.imag > 0)
    theta, z = np.sort(np.angle(multipliers[upper])), CANONICAL @ vectors[:, upper]
    signs = np.sign(np.einsum("ik,ij,jk->k", z.conj(), FORM, z).imag)
    return 2 if signs[0] != signs[1] and theta[1] - theta[0] < 2 * (np.pi - theta[1]) else 1


def circular(mu):
    """a and b at e = 0 from the frequencies, in 30 digits."""
    with mp.workdps(30):
        x = mpf(27) / 4 * mpf(mu) * (1 - mpf(mu))
        root = mp.sqrt(1 - 4 * x)
        f, g = (mp.cos(2 * mp.pi * mp.sqrt((1 + sign * root) / 2)) for sign in (1, -1))
        return float(mp.re(2 * (f + g))), float(mp.re(2 + 4 * f * g))


def test_the_circular_problem():
    routh, half = (float(r["mu"]) for r in BOUNDARY if r["e"] == "0" and r["curve"] in ("KC", "B"))
    mu = np.array([1e-9, 1e-3, half, 0.036, routh - 1e-15, routh + 1e-15, 0.1, 0.5])
    ds = points(mu, 0.0)
    exact = np.array([circular(value) for value in mu]).T
    for name, values in zip("ab", exact, strict=True):
        assert (
            abs(ds[name] - values) <= ds[f"{name}_error"].astype(float) + np.spacing(abs(values))
        ).all()
        assert (ds[f"{name}_error"] < 1e-12 * (1 + abs(ds[name]))).all()
    assert ds.verdict.values.tolist() == [1, 1, 1, 1, 1, 0, 0, 0]
    assert ds.collision.values.tolist() == [1, 1, 1, 2, 2, 2, 2, 2]
    other = points(mu, 0.0, method="taylor16")
    for name in "ab":
        assert (
            abs(ds[name] - other[name])
            <= ds[f"{name}_error"].astype(float) + other[f"{name}_error"]
        ).all()


def test_the_curves_leave_the_circular_problem_as_known():
    e, half, routh = 1e-4, 0.0285954792089683171, 0.0385208965045513971
    slope, bend = 0.056416933365573, 0.0802573
    for curve, at in (
        ("B", half - slope * e),
        ("A", half + slope * e),
        ("KC", routh + bend * e * e),
    ):
        width = 1e-12 if curve == "KC" else 2e-8  # what the next terms move
        ds = points([at - width, at + width], e)
        below = STABLE_BELOW[curve]
        assert ds.verdict.values.tolist() == [below, not below], curve


def test_without_a_lesser_primary_it_is_keplers_problem():
    ds = points(0.0, [0.0, 0.3, 0.9])
    assert (
        (ds.a == 4).all()
        and (ds.b == 6).all()
        and (ds.verdict == 0).all()
        and (ds.collision == 0).all()
    )
    near = points(1e-6, [0.0, 0.3, 0.9])
    assert (near.verdict == 1).all() and (abs(near.a - 4) < 0.05).all()


def test_a_dense_row_is_that_of_its_points():
    mu, e = np.linspace(0.0, 0.5, 120), np.array([0.05, 0.4, 0.8, 0.97])
    row, alone = (
        survey.evaluate("libration_elliptic", mu=mu, e=e, **more)
        for more in ({}, {"method": "taylor16"})
    )
    for name in "ab":
        assert (
            abs(row[name] - alone[name])
            <= row[f"{name}_error"].astype(float) + alone[f"{name}_error"]
        ).all()
        assert (row[name] != alone[name]).any()  # it is another way
    decided = (alone.verdict != -1) & (row.verdict != -1)
    assert (row.verdict == alone.verdict).where(decided, True).all() and decided.mean() > 0.95


def test_a_dense_map_has_the_same_bits_in_any_block(monkeypatch):
    given = {"mu": np.linspace(0.0, 0.05, 90), "e": np.array([0.0, 0.2, 0.314, 0.9])}
    whole = survey.evaluate("libration_elliptic", **given)
    monkeypatch.setattr(cost, "BLOCK_POINTS", 17)
    monkeypatch.setattr(cost, "IN_MEMORY", 1)
    xr.testing.assert_identical(
        whole.drop_attrs(), survey.evaluate("libration_elliptic", **given).drop_attrs()
    )


def test_eccentricities_near_one_keep_honest_bars():
    e = 1 - 10.0 ** -np.arange(2, 9)
    ds, other = points(0.1, e), points(0.1, e, method="dop853")
    ok = (ds.status == 0) & (other.status == 0)
    for name in "ab":
        bars = ds[f"{name}_error"].astype(float) + other[f"{name}_error"]
        assert (abs(ds[name] - other[name]) <= bars).where(ok, True).all()
    assert ok.sum() >= 3 and (ds.verdict.where(ds.verdict != -1, 0) == 0).all()


PLAIN = """
import numpy as np
from survey.measures.libration import danby
e, mu = np.array([0.1, 0.93]), np.array([[0.02, 0.3], [1e-4, 0.5]])
for method, rtol in (("auto", 1e-9), ("dop853", 1e-3), ("rk4", 1e-3)):
    out = danby.solve(e, mu, method, rtol)
    print(method, *(value.hex() for name in ("a", "b", "b_error") for value in out[name].ravel()), out["collision"])
print(*(v.hex() for v in danby.solve(np.array([0.3]), np.linspace(0, 0.5, 75)[None, 1:], "auto", 1e-9, True)["b"][0]))
"""


@pytest.mark.slow
def test_plain_python_gives_the_same_bits():
    printed = [
        subprocess.run(
            [sys.executable, "-c", PLAIN],
            capture_output=True,
            text=True,
            env=os.environ | {"NUMBA_DISABLE_JIT": off},
        ).stdout
        for off in ("0", "1")
    ]
    assert printed[0] == printed[1] and printed[0].count("0x1.") > 100
