"""Lie series at L4: within the bars of the closed forms and of Deprit's triangle, and the algebra
that it rests on.
"""

import json
from importlib.resources import files

import libration_exact as exact
import lie_twin
import numpy as np
import pytest
from mpmath import mp, mpf

from survey.kernels.libration import lie as kernel
from survey.kernels.libration import lie_plan
from survey.kernels.libration.monomials import LEFT, brackets, monomials
from survey.methods import lie

MU_R = float(exact.CRITICAL[2])
MASSES = np.random.default_rng(6).uniform(1e-4, MU_R, 100)
SMALL = np.array([1e-7, 1e-5, 9.5388e-4])
# by `lie_twin.normal_form(mpf(mu), 8)`, 40 digits
DATA = json.loads((files("survey.reference") / "libration_order_8.json").read_text())
ORDER_8 = {
    row["mu"]: {tuple(map(int, name)): c for name, c in row["c8"].items()} for row in DATA["points"]
}


def name(label):
    return "".join(map(str, label))


def ratios(mu, order=6):
    """|error| / bar and |error| / |value| (M, N), against the closed forms."""
    values, bars = lie.coefficients(mu, order)
    errors = np.empty((2, *values.shape))
    for n, one in enumerate(mu):
        known = exact.forms(one)
        for m, label in enumerate(lie.labels(order)):
            error, size = abs(mpf(values[m, n]) - known[name(label)]), abs(known[name(label)])
            errors[:, m, n] = error / mpf(bars[m, n]), error / size
    return errors


@pytest.mark.parametrize(
    "mu", [MASSES, exact.masses(12, seed=3)], ids=["random", "small and near the critical values"]
)
def test_the_bars_hold(mu):
    values, bars = lie.coefficients(mu, 6)
    assert (np.isfinite(values) == np.isfinite(bars)).all() and np.isfinite(values[:6]).mean() > 0.9
    by_bar, _relative = ratios(mu)
    assert np.nanmax(by_bar) < 1.0


def test_the_bars_are_not_absurd():
    by_bar, relative = ratios(MASSES)
    assert np.median(by_bar[:6]) > 1e-3 and np.median(by_bar[6:]) > 3e-5
    assert np.median(relative) < 1e-11


# what plain float64 leaves of the digits at (place, distance): worst of order 4, worst of order 6
# without c003, c003
MU_1, MU_2 = map(float, exact.CRITICAL[:2])
DIGITS = {
    (0, 1e-7): (5.0, -6, -6), (0, 1e-5): (8.2, 3.5, -0.2), (0, 9.5388e-4): (11.3, 8.2, 6.1),
    (0, 0.005): (12.4, 9.1, 8.3), (0, 0.01): (12.3, 10.8, 9.4), (0, 0.02): (12.5, 11.4, 9.8),
    (0, 0.03): (12.3, 11.9, 9.7),
    (MU_1, 1e-5): (12.1, 7.2, 7.2), (MU_1, 1e-7): (10.4, 4.1, 4.1), (MU_1, 1e-9): (8.7, 0, 0),
    (MU_2, 1e-9): (12.2, 8.6, 8.6), (MU_2, 1e-11): (12.7, 6.4, 6.4), (MU_R, -1e-5): (9.9, 6, 6),
    (MU_R, -1e-9): (6.4, -0.4, -0.4),
}  # fmt: skip


@pytest.mark.parametrize("place, digits", DIGITS.items())
def test_the_digits_that_cancellation_leaves(place, digits):
    around = place[0] + place[1] * (1 + 1e-2 * np.arange(-4, 5))  # a place's own digits are luck
    by_bar, relative = ratios(around)
    assert by_bar.max() < 1.0
    lost = np.log10(np.median(relative, axis=1))
    for rows, kept in zip((slice(0, 6), slice(6, 15), slice(15, 16)), digits, strict=True):
        assert lost[rows].max() < 0.7 - kept


def test_order_8_against_deprits_triangle():
    """Values of `lie_twin.normal_form(mpf(mu), 8)`, 40 digits: `test_the_triangle` makes them again."""
    for mu, known in ORDER_8.items():
        values, bars = lie.coefficients(np.array([mu]), 8)
        found = dict(zip(lie.labels(8), zip(values[:, 0], bars[:, 0], strict=True), strict=True))
        for label, digits in known.items():
            value, bar = found[label]
            assert abs(mpf(value) - mpf(digits)) <= bar <= 1e-2 * abs(value)
            assert value == pytest.approx(float(digits), rel=2e-7)


@pytest.mark.slow
def test_the_triangle():
    """The twin, which is real and agrees with the closed forms, gives the stored values of order 8."""
    with mp.workdps(40):
        for mu, known in ORDER_8.items():
            found = lie_twin.normal_form(mpf(mu), 8)
            assert max(abs(c.imag) for c in found.values()) < 1e-28
            for label, digits in known.items():
                assert abs(found[label].real - mpf(digits)) < 1e-20 * abs(mpf(digits))
            for label, value in exact.forms(mu).items():
                if label.isdigit():
                    assert abs(found[tuple(map(int, label))].real - value) < 1e-28 * abs(value)


def test_order_10_has_the_lower_orders_in_it():
    mu = MASSES[:5]
    low, high = lie.coefficients(mu, 6), lie.coefficients(mu, 10)
    assert (abs(low[0] - high[0][:16]) <= low[1] + high[1][:16]).all()
    assert len(lie.labels(10)) == 52 == len(high[0]) and np.isfinite(high[0]).all()


@pytest.mark.parametrize("order", [4, 6, 8])
def test_imaginary_parts_vanish(order):
    values, _norms = lie_plan.solved(kernel.normal_forms, np.concatenate([MASSES, SMALL]), order)
    assert (abs(values[1]) <= values[2]).all()


def test_exchanging_the_modes_exchanges_the_indices():
    """c_jik of (w1, w2) is c_ijk of (-w2, -w1): the kernel run with the two modes' linear forms and
    rates exchanged.
    """
    mu = MASSES[:8]
    plain, exchanged = lie_plan.solved(kernel.normal_forms, mu, 8)[0], solved_exchanged(mu, 8)
    for m, (i, j, k) in enumerate(lie.labels(8)):
        other = lie.labels(8).index((j, i, k))
        assert (abs(plain[0, m] - exchanged[0, other]) <= plain[2, m] + exchanged[2, other]).all()


def solved_exchanged(mu, order):
    """The plan run on rows in which z1 and z2 have changed places."""
    code, places, numbers, harmonics, diagonal, rows, _measured = lie_plan.plan(order)
    out = np.empty((3, len(diagonal), len(mu)))
    big, divisors = np.zeros((rows, kernel.WIDTH)), np.empty((len(harmonics), kernel.LANES))
    for lane in range(kernel.LANES):
        kernel.start(mu[min(lane, len(mu) - 1)], lane, harmonics, big, divisors)
    for form in (lie_plan.XI, lie_plan.ETA):
        big[form : form + 4] = big[form + np.array([1, 0, 3, 2])]
    w = np.array([[float(x) for x in exact.frequencies(one)] for one in mu])
    for lane, (w1, w2) in enumerate(w):
        divisors[:, lane] = -harmonics[:, 0] * w2 + harmonics[:, 1] * w1 + harmonics[:, 2]
    kernel.run(code, places, numbers, divisors, big, np.empty((0, 2, 3, len(mu))), 0, len(mu))
    found = big[diagonal]
    columns = {
        lie_plan.REAL: kernel.RE,
        lie_plan.IMAGINARY: kernel.IM,
        lie_plan.COEFFICIENT_BAR: kernel.BAR,
    }
    for part, first in columns.items():
        out[part] = found[:, first : first + len(mu)]
    return out


def test_brackets_are_canonical():
    """The tables' {z_j, zbar_l} = i on all pairs, and Leibniz on monomials: {z1 zbar1, m} has the
    eigenvalue i k_1.
    """
    ones, squares = monomials(1, True), brackets(2, 2)
    quadratic = monomials(2)
    assert len(ones.keys) == 4
    for j in range(3):
        unit = np.eye(6, dtype=int)[j] + np.eye(6, dtype=int)[3 + j]
        f = quadratic.row[quadratic.find(unit[None])][0]
        # {r_j, i m} = -k_j m for m a representative: {r_j, m} = i k_j m
        for out, _, g, number, _ in squares[:, squares[LEFT] == f].T:
            same = quadratic.row[g] == out and quadratic.sign[g] == 1
            assert same and number == -quadratic.harmonic[g, j]


def test_twice_the_bracket_of_a_cubic_is_antisymmetric():
    """{F, i G} over representatives equals -{G, i F} where both are whole functions of random real
    coefficients.
    """
    random = np.random.default_rng(0)
    m, out = monomials(3), monomials(4)
    parts = []
    half = [random.normal(size=(16, 2)) @ [1, 1j] for _ in range(2)]
    whole = [np.where(m.sign > 0, h[m.row], h[m.row].conj()) for h in half]
    for f, g in ((0, 1), (1, 0)):
        total = np.zeros(out.rows(4), complex)
        for o, i, j, number, sign in brackets(3, 3).T:
            total[o] += number * (half[f][i] if sign > 0 else half[f][i].conjugate()) * whole[g][j]
        parts.append(total)
    np.testing.assert_allclose(parts[0], -parts[1], atol=1e-13)
    assert abs(parts[0]).max() > 1.0


def test_a_mass_has_the_same_bits_in_any_batch():
    together = lie_plan.solved(kernel.normal_forms, MASSES, 8)[0]
    for part in (slice(0, 1), slice(37, 80), slice(50, 99)):
        np.testing.assert_array_equal(
            lie_plan.solved(kernel.normal_forms, MASSES[part], 8)[0], together[:, :, part]
        )


def test_outside_the_domain_and_at_a_resonance():
    values, bars = lie.coefficients(
        np.array([0.0, -0.01, MU_R * 1.001, 0.3, np.nan, float(exact.CRITICAL[0])]), 6
    )
    assert np.isnan(values[:, :5]).all() and np.isnan(bars[:, :5]).all()
    assert np.isnan(values[1:3, 5]).all()
    with pytest.raises(ValueError, match="even"):
        lie.coefficients(MASSES, 7)
