"""The triaxial satellite against the rotation of a rigid body, the axisymmetric scene, and closed forms."""

import numpy as np
import pytest
import xarray as xr
from triaxial_truth import monodromies

import survey
from survey import status

BODY = {"A": 0.7, "B": 1.5, "C": 1.9}


def evaluate(**given):
    options = {
        name: given.pop(name)
        for name in ("direction", "rtol", "variables", "method")
        if name in given
    }
    columns = np.broadcast_arrays(*np.atleast_1d(*given.values()))
    point = {
        name: xr.DataArray(values, dims="point")
        for name, values in zip(given, columns, strict=True)
    }
    return survey.evaluate("satellite_triaxial", **point, **options).load()


def random_bodies(count, seed):
    random = np.random.default_rng(seed)
    B = random.uniform(0.3, 2.0, count)
    A = B * random.uniform(0.2, 0.97, count)
    return {"A": A, "B": B, "C": random.uniform(B - A, B + A)}, random


def compare(count, seed):
    body, random = random_bodies(count, seed)
    k = np.where(
        random.random(count) < 0.6,
        random.uniform(0.0, 0.98, count),
        random.uniform(1.02, 3.0, count),
    )
    for direction in (1, -1):
        known = monodromies(*body.values(), k, direction, rtol=1e-13)
        ds = evaluate(
            **body, k=k, direction=direction, variables=["monodromy", "verdict", "spectral_radius"]
        )
        assert (ds.status == status.OK).all()
        size = abs(known).max(axis=(1, 2))
        off = abs(ds.monodromy.values - known).max(axis=(1, 2))
        assert (off <= ds.monodromy_error.values.max(axis=(1, 2)) + 1e-6 * size).all()
        radius = abs(np.linalg.eigvals(known)).max(axis=1)
        clear = abs(radius - 1.0) > 1e-3
        assert clear.any() and (ds.verdict.values[clear] == 0).all()
        assert (ds.verdict.values[~clear] != -1).all()


@pytest.mark.slow
def test_the_rotation_of_a_body_in_three_dimensions():
    compare(30, 1)


@pytest.mark.slow
def test_it_at_a_thousand_points():
    for seed in range(10, 20):
        compare(100, seed)


def test_the_truth_can_fail():
    """A monodromy of a body that is off by one part in 10^5 is not this one's."""
    one, other = (monodromies(0.7, b, 1.9, np.array([0.8]), 1) for b in (1.5, 1.5 * (1 + 1e-5)))
    assert abs(one - other).max() > 1e-6 * abs(one).max()


def test_a_complex_quadruple():
    ds = evaluate(**BODY, k=0.8)
    value = (ds.multiplier_re + 1j * ds.multiplier_im).values[0]
    assert ds.verdict == 0 and ds.crossing == 4
    assert (abs(value.imag) > 0.5).all()
    first = value[abs(value).argmax()]
    four = np.array([first, first.conj(), 1 / first, 1 / first.conj()])
    assert all(abs(four - one).min() <= 1e-9 for one in value)


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("body", ["prolate", "oblate"])
def test_a_body_with_an_axis_of_symmetry_is_the_other_scene(body, direction):
    """B = C: the axis is in the plane, alpha = A / C; A = C: alpha = B / C. Two multipliers are 1,
    two are Hill's.
    """
    k = np.array([0.0, 0.3, 0.6, 0.8, 0.95, 1.05, 1.2, 2.0])
    alpha, moments = (
        (0.3, {"A": 0.6, "B": 2.0, "C": 2.0})
        if body == "prolate"
        else (1.7, {"A": 2.0, "B": 3.4, "C": 2.0})
    )
    ds = evaluate(**moments, k=k, direction=direction)
    known = survey.evaluate("satellite", inertia_ratio=alpha, k=k, direction=direction).load()
    value = (ds.multiplier_re + 1j * ds.multiplier_im).values
    trace = value.sum(axis=1) - 2.0
    bars = (ds.multiplier_re_error + ds.multiplier_im_error).sum("multiplier").values
    assert (abs(trace - known.discriminant.values) <= bars + known.discriminant_error.values).all()
    assert (ds.verdict.values == np.where(known.verdict == 1, 2, 0)).all()
    np.testing.assert_allclose(ds.period, known.period, rtol=1e-14)
    off = abs(ds.exponent_per_orbit.values - known.exponent_per_orbit.values)
    assert (off <= ds.exponent_per_orbit_error.values + known.exponent_per_orbit_error.values).all()


def test_the_relative_equilibrium():
    """At k = 0, s^4 + (1 + 3 r + r y) s^2 + 4 r y = 0 in orbital rates (Hughes 1986, section 9.2)."""
    random = np.random.default_rng(4)
    roll, yaw = random.uniform(-0.95, 0.95, (2, 200))
    roll, yaw = np.maximum(roll, yaw), np.minimum(roll, yaw)
    ds = evaluate(roll_ratio=roll, yaw_ratio=yaw, k=0.0)
    b, c = 1 + 3 * roll + roll * yaw, 4 * roll * yaw
    square = (-b[:, None] + np.array([1, -1]) * np.sqrt(b * b - 4 * c + 0j)[:, None]) / 2
    rate = np.sqrt(3 * (roll - yaw) / (1 - roll * yaw))  # of pitch
    exponents = abs(np.sqrt(square).real).max(axis=1) * 2 * np.pi / rate
    assert (
        abs(ds.exponent.values - exponents) <= ds.exponent_error.values + 1e-9 * (1 + exponents)
    ).all()
    stable = (c > 0) & (b > 0) & (b * b > 4 * c)
    assert (ds.verdict.values == stable).all() and 20 < stable.sum() < 180


def test_all_names_of_a_motion_mean_the_same():
    first = evaluate(**BODY, k=0.6)
    a, b, c = BODY.values()
    ways = [
        {"roll_ratio": (c - a) / b, "yaw_ratio": (c - b) / a, "k": 0.6},
        {"roll_ratio": (c - a) / b, "B": b, "C": c, "one_minus_k": 1 - 0.6},
        {"A": a, "yaw_ratio": (c - b) / a, "C": c, "amplitude": np.arcsin(0.6)},
        {"A": 1e-3 * a, "B": 1e-3 * b, "C": 1e-3 * c, "k": 0.6},
    ]
    for way in ways:
        ds = evaluate(**way)
        off = abs(ds.multiplier_re - first.multiplier_re).values
        assert (off <= (ds.multiplier_re_error + first.multiplier_re_error).values + 1e-13).all(), (
            way
        )


@pytest.mark.parametrize("short", [1e-4, 1e-8, -1e-4, -1e-8])
def test_next_to_the_separatrix_methods_agree(short):
    one, other = (
        evaluate(**BODY, one_minus_k=short, method=method) for method in ("taylor16", "dop853")
    )
    assert one.status == other.status == status.OK
    bars = (one.multiplier_re_error + other.multiplier_re_error).values
    assert (abs(one.multiplier_re - other.multiplier_re).values <= bars).all() and bars.max() < 1e-4


def test_what_is_no_body_has_its_status():
    a = np.array([0.7, 0.3, 1.5, 2.0, 0.1, np.nan])
    ds = evaluate(A=a, B=1.5, C=1.6, k=0.5)
    assert (ds.status.values == [0, 0, 1, 1, 0, 1]).all()
    flat = evaluate(A=0.1, B=0.2, C=0.1 + 0.2, k=0.5)
    assert flat.status == status.OK
    assert evaluate(A=0.2, B=1.5, C=1.2, k=0.5).status == status.INVALID_PARAMETERS


def test_a_map_by_series_has_the_points_answers():
    k, b = np.linspace(0.05, 0.9, 60), np.linspace(1.25, 1.6, 50)
    ds = survey.evaluate("satellite_triaxial", A=0.7, B=b, C=1.9, k=k).load()
    random = np.random.default_rng(2)
    i, j = random.integers(0, 60, 80), random.integers(0, 50, 80)
    points = evaluate(A=0.7, B=b[j], C=1.9, k=k[i], rtol=1e-12)
    own = ds.isel(k=xr.DataArray(i, dims="point"), B=xr.DataArray(j, dims="point")).transpose(
        "point", ...
    )
    assert ((own.verdict == points.verdict) | (own.verdict == -1) | (points.verdict == -1)).all()
    off = abs(own.spectral_radius - points.spectral_radius)
    assert (off <= own.spectral_radius_error + points.spectral_radius_error).all()
