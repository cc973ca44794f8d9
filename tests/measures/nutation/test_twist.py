"""Twist determinants against derivatives of the frequencies by differences of quadratures, to 40 digits."""

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf

import survey
from survey.kernels.math import bounded
from survey.measures.nutation import twist

NAMES = tuple(twist.NAMES)
STEP = mpf(10) ** -16
# l, alpha, beta, sign, ratio: poles, next to separatrices, narrow wells, one momentum 0, fast
HARD = [
    (0.9, 0.3, 0.5, 1, 0.5),
    (0.9, 0.3, 0.3001, 1, 0.5),
    (-0.2, 0.15, 0.1, 1, 1.7),
    (0.3, 0.0, 0.1, 1, 0.5),
    (2.2, 0.7, -0.4, -1, 1.3),
    (2.0, 1.3, 0.4, -1, 0.1),
    (0.0101, 0.1, 1e-9, 1, 0.5),
    (40.0, 2.0, 5.0, 1, 0.5),
    (1e4, 30.0, -50.0, -1, 1.9),
    (0.250001, 0.5, 0.0, 1, 0.5),
    (0.249999, 0.5, 0.0, 1, 0.5),
    (0.5 + 1e-13, 0.5, 0.5, -1, 0.7),
]


def turning_points(k, level, a, b, well):
    coefficients = [-k, 0, k - level, 2 * a * b, level - a * a - b * b]
    roots = mp.polyroots(coefficients, maxsteps=2000, extraprec=400)
    real = sorted(z.real for z in roots if abs(z.imag) < mpf(10) ** -25 and abs(z.real) <= 1)
    return real[2 * well], real[2 * well + 1]


def frequencies(k, h, b, a, ratio, well):
    """dH/d(J, p_psi, p_phi), and dJ/dh, for A = |k| = 1: one quadrature each, smooth in x, u =
    middle + half sin x.
    """
    epsilon = k / (1 - ratio)
    level = 2 * h - a * a / ratio - epsilon + a * a
    low, high = turning_points(k, level, a, b, well)
    middle, half, total = (low + high) / 2, (high - low) / 2, low + high
    q0 = level - k + k * (total * total - low * high)

    def integral(f):
        def integrand(x):
            u = middle + half * mp.sin(x)
            return f(u) / mp.sqrt(k * u * u + k * total * u + q0)

        return 2 * mp.quad(integrand, mp.linspace(-mp.pi / 2, mp.pi / 2, 9))

    period = integral(lambda u: 1)
    psi = integral(lambda u: (b - a * u) / (1 - u * u))
    phi = integral(lambda u: a / ratio - a + (a - b * u) / (1 - u * u))
    return (2 * mp.pi / period, psi / period, phi / period), period / (2 * mp.pi)


def truth(level, alpha, beta, sign, ratio, well):
    """{name: value}: dH'/dI = d omega/d(h, b, a) by the inverse of dI/d(h, b, a)."""
    with mp.workdps(40):
        k, level, a, b, ratio = mpf(sign), mpf(level), mpf(alpha), mpf(beta), mpf(ratio)
        h = (level - a * a + a * a / ratio + k / (1 - ratio)) / 2
        point = (h, b, a)

        def moved(i, step):
            at = [x + (step if i == j else 0) for j, x in enumerate(point)]
            return frequencies(k, *at, ratio, well)[0]

        omega, over = frequencies(k, *point, ratio, well)
        slopes = mp.matrix(3, 3)
        for i in range(3):
            up, down = moved(i, STEP), moved(i, -STEP)
            for j in range(3):
                slopes[j, i] = (up[j] - down[j]) / (2 * STEP)
        actions = mp.matrix([[over, -omega[1] * over, -omega[2] * over], [0, 1, 0], [0, 0, 1]])
        second = slopes * actions**-1
        # derivatives of one function
        assert mp.norm(second - second.T) < mpf(10) ** -9 * mp.norm(second)

        def bordered(keep):
            n = len(keep)
            m = mp.matrix(n + 1, n + 1)
            for i, one in enumerate(keep):
                m[i, n] = m[n, i] = omega[one]
                for j, other in enumerate(keep):
                    m[i, j] = second[one, other]
            return mp.det(m)

        kept = mp.matrix([[second[i, j] for j in (0, 2)] for i in (0, 2)])
        return dict(
            zip(
                NAMES,
                (mp.det(kept), bordered((0, 2)), mp.det(second), bordered((0, 1, 2))),
                strict=True,
            )
        )


@pytest.mark.parametrize(
    "case",
    [pytest.param(case, marks=[pytest.mark.slow] * (i % 6 > 0)) for i, case in enumerate(HARD)],
)
def test_determinants_are_those_of_the_frequency_map(case):
    level, alpha, beta, sign, ratio = case
    ds = survey.evaluate(
        "brun", l=level, alpha=alpha, beta=beta, ratio=ratio, sign=str(sign), variables=[*NAMES]
    )
    for well in range(2):
        if not np.isfinite(float(ds[NAMES[0]][well])):
            assert well == 1
            continue
        for name, known in truth(*case, well).items():
            value, bar = float(ds[name][well]), float(ds[f"{name}_error"][well])
            assert abs(mpf(value) - known) <= bar + abs(known) * mpf(10) ** -17, (
                name,
                well,
                value,
                known,
                bar,
            )
            assert bar < 1e-7 * (1 + abs(value)), name


def test_a_state_has_the_determinants_of_its_scaled_integrals():
    """Units: H'' goes as 1/A, frequencies as sqrt|k|/A."""
    size_a, ratio, epsilon, theta, p_theta, b, a = 2.0, 0.5, 0.6, 1.1, 0.5, 1.3, 0.9
    state = {
        "A": size_a,
        "C": ratio * size_a,
        "epsilon": epsilon,
        "theta0": theta,
        "p_theta0": p_theta,
        "p_psi": b,
    }
    ds = survey.evaluate("brun", **state, p_phi=a, variables=[*NAMES])
    k = epsilon * size_a * size_a * (1 - ratio)
    u = np.cos(theta)
    level = p_theta**2 + (b - a * u) ** 2 / (1 - u * u) - k * u * u + a * a
    scaled = survey.evaluate(
        "brun", l=level / k, alpha=a / np.sqrt(k), beta=b / np.sqrt(k), variables=[*NAMES]
    )
    units = (size_a**-2, k * size_a**-3, size_a**-3, k * size_a**-4)
    for name, unit in zip(NAMES, units, strict=True):
        assert float(ds[name]) == pytest.approx(unit * float(scaled[name][0]), rel=1e-12)


def test_a_free_body():
    """H = G^2/2A + p_phi^2 (1/C - 1/A)/2, G = J + max(|p_psi|, |p_phi|): (1/C - 1/A)/A, and
    degenerate in 3 degrees.
    """
    state = {"A": 2.0, "C": 1.3, "epsilon": 0.0, "theta0": 1.1, "p_theta0": 0.5}
    for b, a in ((1.3, 0.4), (0.4, 1.3), (-0.7, 0.2)):
        ds = survey.evaluate("brun", **state, p_psi=b, p_phi=a, variables=[*NAMES])
        known = (1 / 1.3 - 1 / 2.0) / 2.0
        assert abs(float(ds.kam_determinant) - known) <= float(ds.kam_determinant_error)
        assert abs(float(ds.kam_determinant_3)) <= float(ds.kam_determinant_3_error) < 1e-12


def test_bars_hold_in_a_crowd():
    """Against the same determinants of the point next to it by less than the bar can tell, of
    random wells.
    """
    random = np.random.default_rng(8)
    n = 4000
    alpha, beta = random.normal(size=(2, n))
    columns = {"l": alpha**2 + beta**2 + random.uniform(-1, 3, n), "alpha": alpha, "beta": beta}
    given = {name: xr.DataArray(x, dims="point") for name, x in columns.items()}
    near = {name: xr.DataArray(x * (1 + 2.0**-52), dims="point") for name, x in columns.items()}
    for sign in ("1", "-1"):
        ds, other = (
            survey.evaluate("brun", **x, sign=sign, variables=[*NAMES]) for x in (given, near)
        )
        good = ds[NAMES[0]].notnull() & other[NAMES[0]].notnull()
        assert int(good.sum()) > n // 3
        for name in NAMES:
            bar = ds[f"{name}_error"].where(good)
            assert float((bar / (1 + abs(ds[name]))).median()) < 1e-11, name
            assert (
                float((abs(ds[name] - other[name]) <= 1000 * bar).where(good, True).mean()) == 1.0
            ), name


def test_nothing_is_given_where_there_is_no_motion():
    ds = survey.evaluate("brun", l=[-5.0, 0.25], alpha=0.5, beta=0.0, variables=[*NAMES])
    assert ds.kam_determinant.isnull().all()


def test_running_bounds():
    """Of random formulas, against exact fractions."""
    from fractions import Fraction

    random = np.random.default_rng(0)
    for x, y, z in random.uniform(0.1, 2.0, (200, 3)):
        px, py, pz = ((v, 2.0**-53 * v) for v in (x, y, z))
        got = bounded.div(
            bounded.sub(bounded.mul(px, py), bounded.add(pz, pz)), bounded.scaled(py, 3.0)
        )
        known = (Fraction(x) * Fraction(y) - 2 * Fraction(z)) / (3 * Fraction(y))
        assert abs(Fraction(got[0]) - known) <= Fraction(got[1]) < 1e-13
        root = bounded.root(px)
        assert abs(Fraction(root[0]) ** 2 - Fraction(x)) <= Fraction(root[1]) * 3 * Fraction(
            root[0]
        )
    assert (
        bounded.div((1.0, 0.0), (1e-20, 1e-10))[1] == np.inf
        and bounded.root((0.0, 1.0))[1] == np.inf
    )
