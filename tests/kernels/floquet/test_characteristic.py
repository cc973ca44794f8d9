"""Multipliers from coefficients known within bounds: roots of every polynomial within them are in
the error bars.
"""

import mpmath
import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from survey.kernels.floquet import characteristic
from survey.measures.floquet.answers import Answers


def answered(coefficients, doubts, starts, n, paired, rtol=1.0, multipliers=True):
    """The Answers of one point, as a series of one term."""
    answer, asked = Answers(1, n), np.array([multipliers, True, True, False, False])
    K = len(coefficients)
    block = characteristic.blocks(1, K, len(starts))
    characteristic.fill_rows(
        np.array(coefficients, dtype=float).reshape(1, -1), np.array(doubts, dtype=float).reshape(-1, 1, 1),
        np.zeros(1), np.zeros(1), np.zeros(2, np.int64),
        np.stack([starts.real, starts.imag], axis=-1).reshape(1, 1, -1, 2), np.zeros((1, 1), np.int64), K, *block,
    )  # fmt: skip
    characteristic.answer(
        *block, True, n, paired, asked, rtol, answer.floats, answer.signs, answer.verdict, answer.crossing,
        answer.missed,
    )  # fmt: skip
    return answer


def roots_of(c, off):
    """The roots of the monic polynomial whose other coefficients are c + off."""
    given = [mpmath.mpf(a) + mpmath.mpf(b) for a, b in zip(c, off, strict=True)]
    return mpmath.polyroots([*given[::-1], 1], asc=True, maxsteps=400, extraprec=200)


def inside(answer, exact):
    """Are the exact multipliers, in some order, within the bars?"""
    n = answer.n
    re, im, bar_re, bar_im = (answer.floats[k * n : (k + 1) * n, 0] for k in range(4))
    off = [[max(abs(re[i] - z.real) / max(bar_re[i], 1e-300), abs(im[i] - z.imag) / max(bar_im[i], 1e-300))
            for z in exact] for i in range(n)]  # fmt: skip
    off = np.minimum(np.array(off, dtype=float), 1e9)
    rows, columns = linear_sum_assignment(off)
    return off[rows, columns].max()


@pytest.mark.parametrize("n", [1, 2, 3, 4, 7, pytest.param(12, marks=pytest.mark.slow)])
def test_roots_of_all_polynomials_within_the_doubts(n):
    rng, served, worst = np.random.default_rng(n), 0, 0.0
    radius_of = slice(4 * n, 4 * n + 2), 0
    for _ in range(60):
        pairs = rng.integers(0, n // 2 + 1)
        own = rng.normal(size=pairs) + 1j * rng.normal(size=pairs)
        roots = np.concatenate([own, own.conj(), 1.5 * rng.normal(size=n - 2 * pairs)])
        c = np.poly(roots)[1:].real
        doubts = 10.0 ** rng.uniform(-13, -5) * rng.uniform(size=n)
        starts = roots * (1 + 0.05 * rng.normal(size=n)) + 0.01j * rng.normal(size=n)
        answer = answered(c, doubts, starts, n, False)
        if n > 2:  # of two states the radius alone is known better
            alone = answered(c, doubts, starts, n, False, multipliers=False)
            assert alone.missed[0] <= answer.missed[0]
            if not answer.missed[0]:
                assert alone.verdict[0] == answer.verdict[0]
                np.testing.assert_allclose(
                    alone.floats[radius_of], answer.floats[radius_of], rtol=1e-14
                )
        if not np.isfinite(answer.floats).all() or answer.missed[0]:
            continue
        served += 1
        signs = rng.choice([-1.0, 1.0], size=n)
        with mpmath.workdps(40):
            other = [mpmath.mpf(1)] + [
                mpmath.mpf(a) + mpmath.mpf(s * b) for a, b, s in zip(c, doubts, signs, strict=True)
            ]
            exact = mpmath.polyroots(other[::-1], asc=True, maxsteps=400, extraprec=200)
        worst = max(worst, inside(answer, exact))
        radius = float(max(abs(root) for root in exact))
        assert abs(radius - answer.floats[4 * n, 0]) <= answer.floats[4 * n + 1, 0]
        assert answer.verdict[0] in (-1, int(radius < 1))
    assert served > 40
    assert worst <= 1.0
    assert worst > 1e-3  # the bars are not wide for nothing


@pytest.mark.parametrize("m", [1, 2, 3, 6])
def test_sums_of_multipliers_and_their_inverses(m):
    rng, kinds = np.random.default_rng(m), set()
    for _ in range(80):
        pairs = rng.integers(0, m // 2 + 1)
        own = 2 * rng.normal(size=pairs) + 1j * rng.normal(size=pairs)
        s = np.concatenate([own, own.conj(), rng.uniform(-2.3, 2.3, size=m - 2 * pairs)])
        if rng.random() < 0.5:
            s = rng.uniform(-2.0, 2.0, size=m).astype(complex)
        c = np.poly(s)[1:].real
        doubts = 10.0 ** rng.uniform(-13, -7) * rng.uniform(size=m)
        answer = answered(c, doubts, s * (1 + 0.02 * rng.normal(size=m)), 2 * m, True)
        if answer.missed[0]:
            continue
        with mpmath.workdps(40):
            signs = rng.choice([-1.0, 1.0], size=m)
            other = [mpmath.mpf(1)] + [
                mpmath.mpf(a) + mpmath.mpf(g * b) for a, b, g in zip(c, doubts, signs, strict=True)
            ]
            roots = mpmath.polyroots(other[::-1], asc=True, maxsteps=400, extraprec=200)
            exact = [
                (z + sign * mpmath.sqrt(mpmath.mpc(z) ** 2 - 4)) / 2
                for z in roots
                for sign in (1, -1)
            ]
            on_circle = all(abs(mpmath.im(z)) < 1e-25 and abs(mpmath.re(z)) < 2 for z in roots)
        assert inside(answer, exact) <= 1.0
        assert answer.verdict[0] in (-1, int(on_circle))
        kinds.add(int(answer.verdict[0]))
    assert kinds >= {0, 1}


@pytest.mark.parametrize("paired", [False, True])
def test_the_radius_of_two_states_in_closed_form(paired):
    """Asked for without the multipliers; near double roots, the unit circle and 0 too."""
    rng, kinds, sharp = np.random.default_rng(7), set(), 0
    for _ in range(600):
        near = 10.0 ** rng.uniform(-12, 0)
        if paired:
            c = np.array([rng.choice([2.0 + near, 2.0 - near, 10 * near, 1e5 * near])])
        else:
            size, angle = rng.choice([1.0 + near, 1.0 - near, near]), rng.choice([near, 1.0, np.pi])
            c = np.array([-2 * size * np.cos(angle), size**2])
            if rng.random() < 0.5:
                c = np.array([-(size + 0.7 * near), 0.7 * size * near * rng.choice([-1, 1])])
        c[0] *= rng.choice([-1.0, 1.0])
        doubts = near * 10.0 ** rng.uniform(-9, 0.5) * rng.uniform(size=c.size)
        answer = answered(c, doubts, np.zeros(c.size, complex), 2, paired, multipliers=False)
        value, off = answer.floats[8:10, 0]
        for signs in np.array([[-1, -1], [-1, 1], [1, -1], [1, 1], [0, 0]])[:, : c.size]:
            with mpmath.workdps(40):
                exact = roots_of(c, signs * doubts)
                if paired:
                    exact = [
                        (s + k * mpmath.sqrt(mpmath.mpc(s) ** 2 - 4)) / 2
                        for s in exact
                        for k in (1, -1)
                    ]
                radius = max(abs(root) for root in exact)
                if not answer.missed[0]:
                    assert abs(radius - mpmath.mpf(value)) <= off + 1e-30
                stable = abs(radius - 1) < 1e-25 if paired else radius < 1
            assert answer.verdict[0] in (-1, int(stable))
        kinds.add(int(answer.verdict[0]))
        within = answered(c, 0 * doubts, np.zeros(c.size, complex), 2, paired, multipliers=False)
        sharp += within.floats[9, 0] <= 1e-14 / near
    assert kinds == {-1, 0, 1} and sharp > 500


def test_double_roots_are_left_to_the_point_itself():
    roots = np.array([0.5, 0.5 + 1e-9, -0.3])
    answer = answered(
        np.poly(roots)[1:], np.full(3, 1e-14), roots + np.array([1e-3, -1e-3, 0]), 3, False
    )
    assert answer.missed[0] and answer.verdict[0] == -1


@pytest.mark.parametrize("n", [3, 4, 6])
def test_complex_roots_are_found_from_real_ones_at_the_node(n):
    """And real ones from complex ones: between a node and a point two of them may have met."""
    rng = np.random.default_rng(n)
    for near in 10.0 ** rng.uniform(-4, -0.5, size=40):
        others = np.array([-0.7, 0.3j, -0.3j, 1.4])[: n - 2]
        others = others if n == 4 else others.real + np.arange(n - 2) * 0.21
        real, pair = 0.9 + near * np.array([1, -1]), 0.9 + near * np.array([1j, -1j])
        for start, exact in ((real, pair), (pair, real)):
            roots = np.concatenate([exact, others])
            c = np.poly(roots)[1:].real
            starts = np.concatenate([start, others]).astype(complex)
            answer = answered(c, np.full(n, 1e-15), starts, n, False, rtol=1e-8)
            assert not answer.missed[0]
            assert inside(answer, roots_of(c, np.zeros(n))) <= 1.0
