"""Portraits at a distance k from a fold of equilibria, where motions creep for a time ~ 1/sqrt(|k|)."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from survey.kernels.cylinder import creeping, flow
from survey.kernels.cylinder import equilibria as eq
from survey.kernels.cylinder import returns as rt
from survey.measures.cylinder import fate as cf
from survey.measures.cylinder import portrait as cp
from survey.methods import taylor

DISTANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)


def near_fold(k, b12):
    """g = k + 0.45 x^2 + ... at phi = x, f = b12 + ..."""
    return b12, -0.4, 1.1, 0.3, 0.3 + k, -1.1


@pytest.mark.parametrize("b12", [0.7, -0.7])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_nothing_changes_between_a_fold_and_1e_4_beside_it(side, b12):
    found = cp.solve(taylor, np.array([near_fold(side * k, b12) for k in DISTANCES]), 1e-10)
    assert (found["verdict"] == cp.STABLE).all()
    for name in ("equilibrium_type", "branch_end", "branch_limit", *cp.COUNTS):
        assert (found[name] == found[name][0]).all(), name


@pytest.mark.parametrize("k", [1e-6, 1e-10, 1e-13])
def test_a_turn_through_a_bottleneck_has_an_image(k):
    s, node = cf.outline(near_fold(k, -0.7)), np.zeros(rt.NODE_SIZE)
    images = []
    for w in (0.01, 0.1):
        taylor.flow_image(
            rt.ROTATION, s.p, s.equilibria, len(s.equilibria), s.section, w, 1e-16, node
        )
        assert node[rt.CLASS] == 1.0
        assert node[rt.ERROR] < 1e-12
        assert node[rt.SLOPE] < 1e-60
        images.append(w + node[rt.CHANGE])
    assert abs(images[0] - images[1]) < 2e-12  # all that pass the bottleneck leave it alike
    # pi / sqrt(0.45 k) |f| of the time is spent at the bottleneck itself
    assert node[rt.TIME] == pytest.approx(0.7 * math.pi / math.sqrt(0.45 * k), rel=0.3)


@pytest.mark.parametrize(
    ("k", "phi"), [(1e-5, -0.05), (1e-8, -0.03), (1e-8, 0.0), (-1e-6, 0.0016), (-1e-8, 0.0002)]
)
@pytest.mark.parametrize("share", [0.2, 1.0, 1.5])
def test_a_passage_along_the_slow_manifold_ends_within_its_bar(k, phi, share):
    """w there against dw/dphi = f + g/w, by Radau."""
    s, end = cf.outline(near_fold(k, -0.7)), np.zeros(creeping.PASSAGE)
    f, g, _dg = flow.values(s.p, phi)
    w = -share * g / f
    assert creeping.crept(
        s.p, s.equilibria, len(s.equilibria), phi, w, 1e-13, 1e-13, True, 7.0, end
    )

    def slope(x, y):
        f, g, _dg = flow.values(s.p, x)
        return [f + g / y[0]]

    there = solve_ivp(slope, (phi, end[creeping.END_PHI]), [w], "Radau", rtol=1e-9, atol=1e-16)
    assert abs(there.y[0, -1] - end[creeping.END_W]) < end[creeping.END_BAR]
    assert end[creeping.END_BAR] < 0.02 * end[creeping.END_W]
    assert end[creeping.EXPONENT] < -creeping.WORTH


def test_what_is_trapped_runs_into_the_node():
    """States all about nodes, a saddle near on one side, against DOP853."""
    random, tried, size = np.random.default_rng(7), 0, 80
    for k in 10.0 ** random.uniform(-3.0, -2.0, 4):
        p = flow.coefficients(*near_fold(-k, -random.uniform(1.0, 2.0)))
        table = np.zeros((eq.MOST, eq.EQUILIBRIUM_SIZE))
        count = eq.bisected(p, table)
        i = next(i for i in range(count) if table[i, eq.KIND] == eq.NODE)
        x = random.uniform(-0.2, 0.2, size)
        starts = np.column_stack([table[i, eq.ANGLE] + x, 2.0 * random.normal(size=size) * x])
        held = [creeping.trapped(p, table, count, *state, 0.0, True) == i for state in starts]
        starts, n = starts[held], np.count_nonzero(held)

        def right(_t, y, p=p, n=n):
            s, c = np.sin(y[:n]), np.cos(y[:n])
            f = p[0] * c - p[1] * s
            g = -p[2] * s * c - p[3] * (c * c - s * s) + p[4] * c - p[5] * s
            return np.concatenate([y[n:], f * y[n:] + g])

        there = solve_ivp(
            right, (0.0, 30.0 / math.sqrt(k)), starts.T.ravel(), "DOP853", rtol=1e-9, atol=1e-12
        )
        assert np.abs(there.y[:n, -1] - table[i, eq.ANGLE]).max() < 1e-5
        w = there.y[n:]
        turned = np.count_nonzero((w[:, 1:] * w[:, :-1] < 0.0) & (np.abs(w[:, 1:]) > 1e-9), axis=1)
        ahead = np.array(
            [creeping.turnings_ahead(p, table, count, i, *state, 1e-12) for state in starts]
        )
        assert (turned == ahead)[ahead >= 0].all()
        tried += np.count_nonzero(ahead >= 0)
    assert tried > 60
