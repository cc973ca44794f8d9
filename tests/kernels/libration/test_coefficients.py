"""Closed forms at L4 against exact fractions, Lie series of 30 digits and mpmath, next to the poles
too; resonances.
"""

import json
import os
import subprocess
import sys
from fractions import Fraction

import libration_exact as exact
import numpy as np
import pytest
from mpmath import mp, mpf

from survey.kernels.libration import closed_forms
from survey.kernels.libration.coefficients import LABELS, NAMES
from survey.measures.libration.normal_form import VECTORS

KERNELS = (closed_forms.closed_forms, closed_forms.closed_forms_double)
MASSES = exact.masses(25)


@pytest.fixture(scope="module")
def truth():
    return [exact.forms(mu) for mu in MASSES]


def solved(kernel, mu):
    values, bars = np.empty((2, len(NAMES), mu.size))
    kernel(mu, values, bars)
    return values, bars


@pytest.mark.parametrize(
    "point", exact.REFERENCE["exact_rational_points"], ids=lambda point: point["w1"]
)
def test_the_table_at_rational_frequencies(point):
    w1, w2 = Fraction(point["w1"]), Fraction(point["w2"])
    for label, value in point["c"].items():
        assert exact.form(label, w1, w2) == Fraction(value)
    c = {label: exact.form(label, w1, w2) for label in LABELS}
    assert exact.form("a20", w1, w2) == c["200"] - c["101"] * w1 + c["002"] * w1**2
    assert (
        exact.form("a11", w1, w2)
        == c["110"] + c["101"] * w2 - c["011"] * w1 - 2 * c["002"] * w1 * w2
    )
    assert exact.form("a02", w1, w2) == c["020"] + c["011"] * w2 + c["002"] * w2**2
    assert exact.form("D4", w1, w2) == c["200"] * w2**2 + c["110"] * w1 * w2 + c["020"] * w1**2
    planar = sum(
        c[label] * w2 ** int(label[0]) * w1 ** int(label[1])
        for label in LABELS[6:]
        if label[2] == "0"
    )
    assert exact.form("D6", w1, w2) == planar


@pytest.mark.parametrize("point", exact.REFERENCE["table"], ids=lambda point: point["mu"])
def test_the_table_against_lie_series(point):
    with mp.workdps(40):
        found = exact.forms(mpf(point["mu"]))
        known = point["c"] | {name: point["derived"][name] for name in NAMES[16:]}
        for name, value in known.items():
            assert abs(found[name] / mpf(value) - 1) < 1e-28, name


def test_the_modes_can_be_exchanged():
    """(omega1, r1) and (-omega2, r2) play the same part: c_ijk and c_jik change places."""
    w1, w2 = Fraction(21, 29), Fraction(20, 29)
    for label in LABELS:
        swapped = label[1] + label[0] + label[2]
        assert exact.form(label, w1, w2) == exact.form(swapped, -w2, -w1)


@pytest.mark.parametrize("kernel", KERNELS, ids=lambda kernel: kernel.__name__)
def test_every_value_lies_within_its_bar(kernel, truth):
    values, bars = solved(kernel, MASSES)
    for n, known in enumerate(truth):
        for row, name in enumerate(NAMES):
            assert abs(mpf(values[row, n]) - known[name]) <= mpf(bars[row, n]), (name, MASSES[n])


def test_double_double_keeps_every_digit():
    values, bars = solved(closed_forms.closed_forms_double, MASSES)
    assert (bars < 1.02 * 2.0**-53 * abs(values)).all()


def test_float64_keeps_its_digits(truth):
    """Bars of some 50 roundings, and of the conditioning of the numerators where these vanish;
    poles cost nothing.
    """
    values, bars = solved(closed_forms.closed_forms, MASSES)
    assert np.median(bars / abs(values)) < 4e-15 and (bars / abs(values)).max() < 3e-11
    errors = np.array([[float(abs(mpf(v) - known[name])) for v, known in zip(row, truth, strict=True)]
                       for name, row in zip(NAMES, values, strict=True)])  # fmt: skip
    largest = (errors / bars).max(axis=1)
    assert (largest > 0.02).all()  # no bar is 50 times too wide everywhere
    order4 = slice(0, 6)
    assert (errors[order4] < 3e-13 * abs(values[order4])).all()


def test_limits_and_poles():
    mu = np.array([1e-100])
    values, _ = solved(closed_forms.closed_forms, mu)
    w2 = float(exact.frequencies(mu[0])[1])
    assert values[NAMES.index("020"), 0] == pytest.approx(9 / 16, rel=1e-15)
    assert values[NAMES.index("030"), 0] * w2 == pytest.approx(345 / 256, rel=1e-15)
    near = 10.0 ** -np.arange(9, 12)
    for critical, name, power in ((0, "110", 1), (0, "111", 2), (0, "210", 3), (1, "120", 1), (2, "200", 1),
                                  (2, "300", 2.5)):  # fmt: skip
        # at the floats themselves, as they lie: their distance to the critical value is known to
        # all digits
        mu = closed_forms.__dict__[("MU_1", "MU_2", "MU_R")[critical]][0] - near
        gaps = np.array([float(exact.CRITICAL[critical] - mpf(m)) for m in mu])
        scaled = solved(closed_forms.closed_forms, mu)[0][NAMES.index(name)] * gaps**power
        assert scaled == pytest.approx(scaled[-1], rel=1e-3), name


def test_critical_values_are_the_roots():
    with mp.workdps(60):
        for name, square in (
            ("MU_1", mpf(611) / 675),
            ("MU_2", mpf(71) / 75),
            ("MU_R", mpf(23) / 27),
        ):
            parts = getattr(closed_forms, name)
            assert abs(sum(map(mpf, parts)) - (1 - mp.sqrt(square)) / 2) < 1e-50
            assert parts[0] == float((1 - mp.sqrt(square)) / 2)


def linear(mu):
    omega, nearest, distance = (
        np.empty((2, mu.size)),
        np.empty(mu.size, dtype=np.int64),
        np.empty((2, mu.size)),
    )
    closed_forms.linear(mu, VECTORS, omega, nearest, distance)
    return omega, nearest, distance


def test_frequencies_and_the_nearest_resonance():
    mu = MASSES[::5]
    omega, nearest, distance = linear(mu)
    for n in range(mu.size):
        with mp.workdps(exact.DIGITS):
            w1, w2 = exact.frequencies(mu[n])
            assert abs(omega[0, n] - w1) < 1.2e-16 * w1 and abs(omega[1, n] - w2) < 1.2e-16 * w2
            exactly = [abs(int(a) * w1 - int(b) * w2 + int(c)) for a, b, c in VECTORS]
            assert nearest[n] == int(np.argmin(exactly))
            assert abs(distance[0, n] - min(exactly)) < 1.2e-16 * min(exactly)


def test_the_distance_of_a_resonance_lies_within_its_bar():
    """Next to the resonances nearly all digits of k . omega cancel, and as mu -> 0 those of 2 omega1 - 2."""
    known = [float(entry["mu"]) for entry in exact.REFERENCE["resonances_order_le_8_k3_even"]]
    near = [
        mu + n * np.spacing(mu)
        for mu in [*known, closed_forms.MU_1[0], closed_forms.MU_2[0]]
        for n in range(-4, 5)
    ]
    mu = np.array([*near, *10 ** np.random.default_rng(1).uniform(-100, -4, 60)])
    _, nearest, distance = linear(mu)
    with mp.workdps(150):
        for n in range(mu.size):
            x = 27 * mpf(mu[n]) * (1 - mpf(mu[n])) / 4
            u = (1 + mp.sqrt(1 - 4 * x)) / 2
            first, second, third = (int(k) for k in VECTORS[nearest[n]])
            exactly = abs(first * mp.sqrt(u) - second * mp.sqrt(x / u) + third)
            assert abs(distance[0, n] - exactly) <= distance[1, n] < 1.2e-16 * exactly + 1e-29


def test_no_resonance_is_missed():
    """Those of the reference are the nearest at the float64 next to them, but where three meet at
    (4/5, 3/5).
    """
    known = exact.REFERENCE["resonances_order_le_8_k3_even"]
    mu = np.array([float(entry["mu"]) for entry in known])
    _, nearest, distance = linear(mu)
    assert (distance[0] < 1e-15).all()
    found = [tuple(VECTORS[i].astype(int)) for i in nearest]
    alone = [entry["w1"][:6] != "0.8000" for entry in known]
    assert [k for k, one in zip(found, alone, strict=True) if one] == [
        tuple(entry["k"]) for entry, one in zip(known, alone, strict=True) if one
    ]


def test_nothing_is_reported_outside_the_interval():
    mu = np.array([np.nan, 0.0, closed_forms.MU_R[0], 0.3])
    assert np.isnan(solved(closed_forms.closed_forms, mu)[0]).all()
    omega, nearest, distance = linear(mu)
    assert np.isnan(omega).all() and np.isnan(distance).all() and (nearest == -1).all()
    below = np.array([np.nextafter(closed_forms.MU_R[0], 0)])
    assert np.isfinite(solved(closed_forms.closed_forms, below)[0]).all()


PLAIN = """
import json, numpy as np
from survey.kernels.libration import closed_forms as libration
mu = np.array([1e-9, 0.0109, 0.0243, 0.0385])
values, bars = np.empty((2, 21, 4)), np.empty((2, 21, 4))
libration.closed_forms(mu, values[0], bars[0])
libration.closed_forms_double(mu, values[1], bars[1])
print(json.dumps([values.tolist(), bars.tolist()]))
"""


def test_plain_python_gives_the_same_bits():
    texts = []
    for off in ("0", "1"):
        environment = os.environ | {"NUMBA_DISABLE_JIT": off}
        run = subprocess.run(
            [sys.executable, "-c", PLAIN], capture_output=True, text=True, env=environment
        )
        assert run.returncode == 0, run.stderr
        texts.append(run.stdout)
    assert json.loads(texts[0]) and texts[0] == texts[1]
