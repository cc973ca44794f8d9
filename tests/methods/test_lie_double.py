"""Lie series in double-double: within bars that are those of rounding, where those of float64 hold
nothing any more.
"""

import json
from importlib.resources import files

import libration_exact as exact
import lie_twin
import numpy as np
import pytest
from mpmath import mp, mpf

import survey
from survey.kernels.libration import lie_double as kernel
from survey.kernels.libration import lie_plan
from survey.methods import lie, lie_double

MU_1, _MU_2, MU_R = map(float, exact.CRITICAL)
MASSES = np.random.default_rng(8).uniform(1e-4, MU_R, 60)
BESIDE = np.array([*exact.masses(12, seed=4), 1e-15, MU_1 * (1 + 1e-13), np.nextafter(MU_R, 0)])
DATA = json.loads((files("survey.reference") / "libration_order_8.json").read_text())["points"]
# (2, 3, 0) is of order 5, (0, 4, 2) of order 6, (1, -2, -2) of order 5
HARD = (2e-5, 0.032622406831841425 * (1 + 1e-9), 0.0285954792089683170661 * (1 - 1e-11), 0.0385208)


def over_bars(mu, order, known):
    """|error| / bar (M, N) with coefficients `known`, {label: value} at each mu; NaN where there is
    no answer.
    """
    values, bars = lie_double.coefficients(mu, order)
    found = np.full(values.shape, np.nan)
    for n, exactly in enumerate(known):
        for m, label in enumerate(lie.labels(order)):
            if np.isfinite(values[m, n]):
                found[m, n] = abs(mpf(values[m, n]) - exactly[label]) / mpf(bars[m, n])
    return found, bars / abs(values)


@pytest.mark.parametrize("mu", [MASSES, BESIDE], ids=["random", "beside poles, mu_R and 0"])
def test_order_6_against_the_closed_forms(mu):
    with mp.workdps(45):
        known = [
            {tuple(map(int, k)): v for k, v in exact.forms(one).items() if k.isdigit()}
            for one in mu
        ]
        off, relative = over_bars(mu, 6, known)
    assert np.nanmax(off) < 1.0 and np.isfinite(off).mean() > 0.98 and np.nanmedian(off) > 0.1
    if mu is MASSES:
        assert relative.max() < 1e-15


def test_order_8_against_deprits_triangle():
    with mp.workdps(45):
        known = [{tuple(map(int, k)): mpf(v) for k, v in row["c8"].items()} for row in DATA]
        for row, exactly in zip(DATA, known, strict=True):
            values, bars = lie_double.coefficients(np.array([row["mu"]]), 8)
            found = dict(
                zip(lie.labels(8), zip(values[:, 0], bars[:, 0], strict=True), strict=True)
            )
            for label, c in exactly.items():
                value, bar = found[label]
                assert abs(mpf(value) - c) <= bar < 2e-16 * abs(value)


@pytest.mark.slow
def test_order_8_beside_resonances_against_deprits_triangle():
    """There float64's bars are wider than the values, or it has no answer; these are not absurd either."""
    with mp.workdps(70):
        known = [lie_twin.normal_form(mpf(mu), 8) for mu in HARD]
        known = [{label: c.real for label, c in one.items()} for one in known]
        off, _relative = over_bars(np.array(HARD), 8, known)
    assert np.nanmax(off) < 1.0 and np.nanmedian(off) > 1e-6


def test_the_parts_behind_the_point_are_right():
    """The high and the low part together are within the bar that leaves the rounding to float64 out."""
    what, mu = lie_plan.plan(6), MASSES[: kernel.LANES]
    big, divisors = (
        np.zeros((what.rows, kernel.WIDTH)),
        np.empty((len(what.harmonics), kernel.DIVISOR_WIDTH)),
    )
    for i, one in enumerate(mu):
        kernel.start(one, i, what.harmonics, big, divisors)
    kernel.run(
        what.code,
        what.indices,
        what.numbers,
        divisors,
        big,
        np.empty((0, 2, 3, mu.size)),
        0,
        mu.size,
    )
    with mp.workdps(45):
        off = []
        for i, one in enumerate(mu):
            known = exact.forms(one)
            for row, label in zip(what.diagonal, lie.labels(6), strict=True):
                high, low, bar = (
                    big[row, part + i] for part in (kernel.RE, kernel.RE_LOW, kernel.BAR)
                )
                off.append(abs(mpf(high) + mpf(low) - known["".join(map(str, label))]) / mpf(bar))
    assert max(off) < 1.0 and np.median(np.array(off, dtype=float)) > 1e-7


def test_constants_have_their_second_halves():
    """sqrt(3) and 1/n! are given to 30 digits: of the multiples some are no float64."""
    what = lie_plan.plan(6)
    terms = [
        t for op, *_, first, last in what.code if op == lie_plan.LINEAR for t in range(first, last)
    ]
    high, low = what.numbers[:, terms]
    assert (abs(low) <= 2.0**-51 * abs(high)).all() and np.count_nonzero(low) > 100


def test_auto_meets_the_accuracy_at_order_8():
    mu = np.array([0.001, 0.01, 0.02, 0.03, 0.0354, 0.038])
    one, other = (
        survey.evaluate("libration", mu=mu, order="8", method=method) for method in ("lie", "auto")
    )
    assert (one.c8_error > 1e-10 * (1 + abs(one.c8))).any("monomial8").all()
    assert (other.c8_error <= 1e-10 * (1 + abs(other.c8))).all()
    assert (abs(one.c8 - other.c8) <= one.c8_error + other.c8_error).all()
    assert (other.effective_radius_error <= 1e-10).all()


def test_a_coefficient_that_is_not_known_leaves_the_others():
    ds = survey.evaluate("libration", mu=[1e-30, MU_1 * (1 + 1e-15)], order="8")
    assert (ds.status == 0).all() and (ds.verdict == 1).all() and ds.c.notnull().all()
    assert ds.c8.isnull().any("monomial8").all() and (ds.c8.isnull() == ds.c8_error.isnull()).all()
