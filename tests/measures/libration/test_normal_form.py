"""Formal stability by the normal form: combinations and the ray against mpmath, verdicts at the
edges, lost points.
"""

from types import SimpleNamespace

import libration_exact as exact
import numpy as np
import pytest
from mpmath import mp, mpf

from survey import status
from survey.kernels.libration.closed_forms import MU_1, MU_2, MU_R
from survey.measures.libration import normal_form
from survey.methods import rational, rational_double

MU_C, MU_D = (float(exact.CONSTANTS[name]) for name in ("mu_c_D4=0", "mu_d_a02=0"))
MASSES = exact.masses(15, seed=1)


def neighbours(value, count=2):
    """The floats around a value: `count` on each side of the nearest."""
    values = [value]
    for _ in range(count):
        values = [np.nextafter(values[0], 0), *values, np.nextafter(values[-1], 1)]
    return np.array(values)


def solved(mu, method="auto", rtol=1e-10):
    return normal_form.solve(np.atleast_1d(np.asarray(mu, dtype=float)), method, rtol)


@pytest.mark.parametrize("method", ["auto", "rational", "rational_double"])
def test_every_output_lies_within_its_bar(method):
    answer = solved(MASSES, method)
    assert (answer["status"] == status.OK).all()
    for n, mu in enumerate(MASSES):
        known = exact.forms(mu)
        found = dict(
            zip(exact.LABELS, zip(answer["c"][n], answer["c_error"][n], strict=True), strict=True)
        )
        found |= {
            name: (answer[name][n], answer[f"{name}_error"][n]) for name in normal_form.COMBINED
        }
        for name, (value, bar) in found.items():
            assert abs(mpf(value) - known[name]) <= mpf(bar), (name, mu)


def test_sums_of_coefficients_keep_their_bars():
    """As a method without forms of its own for them gets them."""
    values, bars = rational.coefficients(MASSES, 6)
    omega = np.array([[float(w) for w in exact.frequencies(mu)] for mu in MASSES]).T
    summed = normal_form.combine(values, bars, *omega)
    for (value, bar), name in zip(summed, normal_form.COMBINED, strict=True):
        for n, mu in enumerate(MASSES):
            assert abs(mpf(value[n]) - exact.forms(mu)[name]) <= mpf(bar[n]), (name, mu)


@pytest.mark.parametrize("method", ["rational", "rational_double"])
def test_the_form_on_the_ray(method):
    """Where the ray is in the octant, its bar is tight, to the very floats beside mu2."""
    mu = np.concatenate(
        [
            np.linspace(MU_C, MU_D, 40)[1:-1],
            neighbours(MU_2[0]),
            MU_2[0] + 10.0 ** -np.arange(4, 17),
        ]
    )
    answer = solved(mu, method)
    for n, one in enumerate(mu):
        known, bar = exact.on_ray(one), answer["M_ray_error"][n]
        assert abs(mpf(answer["M_ray"][n]) - known) <= bar <= 2e-12 * abs(known), one
    outside = solved([1e-4, 0.01, 0.017, 0.03])
    assert np.isnan(outside["M_ray"]).all() and np.isnan(outside["M_ray_error"]).all()


def test_the_form_on_the_ray_at_its_ends():
    ends = exact.CONSTANTS["ends"]
    at = solved([np.nextafter(MU_C, 1), np.nextafter(MU_D, 0)])["M_ray"]
    assert at == pytest.approx([float(ends[name]["M"]) for name in ("mu_c", "mu_d")], rel=1e-12)
    mu = MU_2[0] + 1e-9
    residue = (1 - 10 * float(exact.frequencies(mu)[1] ** 2)) * solved(mu)["M_ray"][0]
    assert residue == pytest.approx(float(ends["mu2_limit"]["(1-10 w2^2) M"]), rel=1e-4)


def test_the_verdict_changes_between_neighbouring_floats():
    """mu_c and mu_d lie between two float64; no point beside them stays undecided."""
    with mp.workdps(40):
        for name, inside in (("mu_c_D4=0", 1), ("mu_d_a02=0", -1)):
            critical = mpf(exact.CONSTANTS[name])
            mu = neighbours(float(critical), 6)
            wanted = [2 if (mpf(m) - critical) * inside > 0 else 1 for m in mu]
            assert solved(mu)["verdict"].tolist() == wanted


def test_resonances_and_the_boundary_take_one_float_each():
    assert solved(neighbours(MU_1[0]))["verdict"].tolist() == [1, 1, 3, 1, 1]
    assert solved(neighbours(MU_2[0]))["verdict"].tolist() == [2, 2, 3, 2, 2]
    assert solved(neighbours(MU_R[0]))["verdict"].tolist() == [1, 1, 4, 0, 0]
    assert np.isnan(solved(0.04)["c"]).all() and solved(0.04)["status"] == status.OK


def spoiled(factor=1.0, shift=0.0):
    """A method whose bars are wide, or whose values are lost."""

    def coefficients(mu, order):
        values, bars = rational_double.coefficients(mu, order)
        return values + shift, bars * factor

    return SimpleNamespace(coefficients=coefficients)


def test_bars_decide_how_much_is_decided():
    mu = np.array([0.005, MU_C + 1e-6, 0.0145, MU_D + 1e-6, 0.03])
    assert normal_form.answers(mu, spoiled())["verdict"].tolist() == [1, 2, 2, 1, 1]
    assert normal_form.answers(mu, spoiled(1e13))["verdict"].tolist() == [1, -1, 2, -1, 1]
    assert (normal_form.answers(mu, spoiled(1e17))["verdict"] == -1).all()


def test_lost_values_are_a_status():
    with np.errstate(invalid="ignore"):  # as in the engine
        answer = normal_form.answers(np.array([0.01, 0.2, np.nan]), spoiled(shift=np.inf))
    assert answer["status"].tolist() == [status.OVERFLOW, status.OK, status.INVALID_PARAMETERS]
    assert answer["verdict"].tolist() == [-1, 0, -1]
    assert all(np.isnan(values).all() for values in answer.values() if values.dtype.kind == "f")


def test_effort_grows_where_digits_are_missed():
    """Near a zero of a coefficient float64 misses what double-double keeps."""
    mu = np.array([0.02, float(exact.CONSTANTS["coeff_zeros"]["120"][1])])
    coarse, fine = solved(mu, "rational", 1e-15), solved(mu, "auto", 1e-15)
    asked = 1e-15 * (1 + abs(fine["c"]))
    assert (coarse["c_error"] > asked).any(axis=1).all() and (fine["c_error"] <= asked).all()
    np.testing.assert_array_equal(solved(0.02)["c"], solved(0.02, "rational")["c"])


def test_the_vectors_are_all_and_once():
    found = {tuple(k) for k in normal_form.vectors(4).astype(int).tolist()}
    assert len(found) == len(normal_form.vectors(4))
    for k in ((1, 3, 0), (0, 2, 2), (2, 0, -2), (1, 1, 2), (0, 0, 2)):
        assert k in found
    for k in ((2, 2, 0), (0, 0, 4), (1, 0, 1), (-1, 3, 0), (1, 4, 0)):
        assert k not in found
    assert [int(abs(k).sum()) for k in normal_form.vectors(4)] == sorted(
        int(abs(k).sum()) for k in normal_form.vectors(4)
    )
