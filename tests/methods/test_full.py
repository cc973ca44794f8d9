"""The full equations: their vector form, their integrals, and why the reduced scene suffices."""

import json
from importlib.resources import files

import mpmath as mp
import numpy as np
import pytest

import survey
from survey.kernels.cylinder import gyrostat
from survey.kernels.cylinder.flow import coefficients
from survey.measures.cylinder import solution
from survey.methods import full, taylor

SIX, START = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2), (1.5, 0.8)
(REFERENCE,) = json.loads((files("survey.reference") / "gyrostat.json").read_text())["sixd"]
# (A22, A23, A33, B22, B23, B33, C11, lambda1) / A11: axis 1 has the largest, the middle, the
# smallest inertia
LARGEST = (0.5, 0.07, 0.6, 0.3, 0.07, -0.2, 0.1, 3.0)
MIDDLE = (0.6, 0.07, 1.4, 0.3, 0.07, -0.2, 0.1, 0.0)
SMALLEST = (1.7, 0.07, 1.4, 0.3, 0.07, -0.2, 0.1, 0.0)
TIMES = np.linspace(0.0, 20.0, 81)


def system(free, six=SIX, start=START):
    """(G, initial state) of a full gyrostat in the rotated frame that holds the reduced flow."""
    G, state = np.empty((gyrostat.ROWS, 3)), np.empty(6)
    gyrostat.embed(coefficients(*six), np.array(free), G)
    gyrostat.start(*start, state)
    return G, state


def motion(G, state, times=TIMES, tolerance=1e-16):
    """States and tangent maps at the times."""
    out, tangent = np.empty((len(times), 6)), np.empty((len(times), 6, 6))
    assert gyrostat.states(G, state, times, tolerance, 100_000, out, tangent) > 0
    return out, tangent


def aligned(states):
    """(w, nu) in the axes of the scene."""
    return np.concatenate([states[:, :3] @ gyrostat.FRAME, states[:, 3:] @ gyrostat.FRAME], axis=1)


def slopes(G, state):
    """(1)-(6), component by component as printed."""
    (a11, a12, a31), (_, a22, a23), (_, _, a33) = G[:3]
    (b11, b12, b31), (_, b22, b23), (_, _, b33) = G[6:9]
    (c11, c12, c31), (_, c22, c23), (_, _, c33) = G[9:12]
    (l1, l2, l3), (s1, s2, s3), (w1, w2, w3, v1, v2, v3) = G[12], G[13], state
    torque = [
        (a12 * w1 + a22 * w2 + a23 * w3) * w3 - (a31 * w1 + a23 * w2 + a33 * w3) * w2
        + (b12 * w1 + b22 * w2 + b23 * w3) * v3 - (b31 * w1 + b23 * w2 + b33 * w3) * v2 + l2 * w3 - l3 * w2
        - (c12 * v1 + c22 * v2 + c23 * v3) * v3 + (c31 * v1 + c23 * v2 + c33 * v3) * v2 + s2 * v3 - s3 * v2,
        (a31 * w1 + a23 * w2 + a33 * w3) * w1 - (a11 * w1 + a12 * w2 + a31 * w3) * w3
        + (b31 * w1 + b23 * w2 + b33 * w3) * v1 - (b11 * w1 + b12 * w2 + b31 * w3) * v3 + l3 * w1 - l1 * w3
        - (c31 * v1 + c23 * v2 + c33 * v3) * v1 + (c11 * v1 + c12 * v2 + c31 * v3) * v3 + s3 * v1 - s1 * v3,
        (a11 * w1 + a12 * w2 + a31 * w3) * w2 - (a12 * w1 + a22 * w2 + a23 * w3) * w1
        + (b11 * w1 + b12 * w2 + b31 * w3) * v2 - (b12 * w1 + b22 * w2 + b23 * w3) * v1 + l1 * w2 - l2 * w1
        - (c11 * v1 + c12 * v2 + c31 * v3) * v2 + (c12 * v1 + c22 * v2 + c23 * v3) * v1 + s1 * v2 - s2 * v1,
    ]  # fmt: skip
    turn = [v2 * w3 - v3 * w2, v3 * w1 - v1 * w3, v1 * w2 - v2 * w1]
    return np.concatenate(
        [np.linalg.solve(G[:3].astype(float), np.array(torque, float)), np.array(turn, float)]
    )


def random_system(seed):
    """A gyrostat of no special form: nothing of the reduction holds."""
    random = np.random.default_rng(seed)
    G = random.normal(size=(14, 3))
    for row in (0, 6, 9):
        G[row : row + 3] += G[row : row + 3].T.copy()
    G[:3] += 6.0 * np.eye(3)
    gyrostat.invert(G)
    return G, random.normal(size=6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_series_begins_with_the_printed_equations(seed):
    G, state = random_system(seed)
    T = np.zeros((gyrostat.LAST + 1, 12))
    gyrostat.series(G, state, T, gyrostat.ORDER)
    np.testing.assert_allclose(T[1, :6], slopes(G, state), rtol=0, atol=1e-13)


def test_measured_order():
    """One step in 100 digits, by the same source, against steps of a quarter."""
    G, state = random_system(4)
    zero = mp.mpf(0)

    def step(state, h):
        T = np.full((gyrostat.LAST + 1, 12), zero, dtype=object)
        gyrostat.series.py_func(wide, state, T, gyrostat.ORDER)
        return [sum(T[n, i] * h**n for n in range(gyrostat.ORDER + 1)) for i in range(6)]

    def error(h):
        fine = start
        for _ in range(4):
            fine = step(fine, h / 4)
        return mp.norm([a - b for a, b in zip(step(start, h), fine, strict=True)])

    with mp.workdps(100):
        wide = np.array([[mp.mpf(x) for x in row] for row in G], dtype=object)
        start = [mp.mpf(x) for x in state]
        order = mp.log(error(mp.mpf("0.002")) / error(mp.mpf("0.001"))) / mp.log(2) - 1
    assert abs(order - full.ORDER) < 0.15


@pytest.mark.parametrize("free", [LARGEST, MIDDLE, SMALLEST])
def test_the_integrals_are_conserved(free):
    """k (7) and |nu|^2 (8), on the set's system and off the set."""
    G, state = system(free)
    for kick in (np.zeros(6), np.array([0.02, -0.03, 0.05, 0.01, -0.02, 0.03])):
        states, _ = motion(G, state + kick)
        w, nu = states[:, :3], states[:, 3:]
        for integral in (np.sum((w @ G[:3] + G[12]) * nu, axis=1), np.sum(nu * nu, axis=1)):
            assert np.ptp(integral) < 1e-12


def test_energy_is_no_integral():
    """dE/dt = (B w) . (nu x w): a check that the conservation above is no accident of the test."""
    G, state = system(LARGEST)
    states, _ = motion(G, state)
    w, nu = states[:, :3], states[:, 3:]
    energy = np.sum((w @ G[:3]) * w + (nu @ G[9:12]) * nu, axis=1) / 2 - nu @ G[13]
    assert np.ptp(energy) > 0.1


def test_reference_in_the_rotated_frame():
    case = {
        k: float(v)
        for k, v in REFERENCE.items()
        if k in ("lambda1", "s2", "s3", "phi0", "w0", "t", "phi", "w")
    }
    A, B, C = ({k: float(v) for k, v in REFERENCE[name].items()} for name in "ABC")
    a = A["A11"]
    six = np.array([B["B12"], B["B31"], C["C22"] - C["C33"], C["C23"], case["s2"], case["s3"]]) / a
    shift = (0.75 * C["C33"] + 0.25 * C["C22"]) / a  # C + x I moves nothing, as nu x nu = 0
    free = (
        np.array(
            [A["A22"], A["A23"], A["A33"], B["B22"], B["B23"], B["B33"], C["C11"], case["lambda1"]]
        )
        / a
    )
    free[gyrostat.C11] -= shift
    states, _ = motion(*system(free, six, (case["phi0"], case["w0"])), np.array([case["t"]]))
    w1, w2, w3, nu1, nu2, nu3 = aligned(states)[0]
    assert max(abs(np.array([w1 - case["w"], w2, w3, nu1]))) < 1e-12
    assert abs(np.array([nu2 - np.sin(case["phi"]), nu3 - np.cos(case["phi"])])).max() < 1e-12


def residual(free, six=SIX, start=START):
    """Largest distance of the full motion to the reduced one over t <= 20, and the largest growth
    of a deviation.
    """
    states, tangent = motion(*system(free, six, start))
    floats, _n, status = solution.trajectories(
        taylor, np.array([[*six, *start]]), TIMES[None], 1e-13
    )
    assert (status == 0).all()
    phi, w = floats[0, :, 0], floats[0, :, 1]
    zero = np.zeros_like(phi)
    wanted = np.stack([w, zero, zero, zero, np.sin(phi), np.cos(phi)], axis=1)
    return np.abs(aligned(states) - wanted).max(), np.abs(tangent).max()


def test_the_reduced_motion_is_reproduced():
    """Of a libration and of a rotation, axis 1 having the largest inertia."""
    for start in (START, (0.4, 2.0)):
        off, _ = residual(LARGEST, start=start)
        assert off < 1e-11


def test_where_the_set_is_unstable_rounding_grows_as_measured():
    growth = []
    for free in (MIDDLE, SMALLEST):
        off, growth_here = residual(free)
        assert off < 1e-14 * growth_here
        growth.append(growth_here)
    assert max(growth) > 1e4


def test_another_question_is_refused():
    with pytest.raises(survey.BadInput, match="'full' does not support question = fate"):
        survey.evaluate("gyrostat", b12=0.1, method="full")


def test_the_tangent_map_is_the_derivative():
    G, state = random_system(5)
    _, tangent = motion(G, state, np.array([2.0]))
    for i in range(6):
        kick = 1e-6 * np.eye(6)[i]
        ahead, behind = (motion(G, state + s * kick, np.array([2.0]))[0][0] for s in (1, -1))
        np.testing.assert_allclose(
            tangent[0, :, i], (ahead - behind) / 2e-6, rtol=0, atol=1e-6 * np.abs(tangent).max()
        )


def test_bars_hold_on_random_points():
    rows = np.random.default_rng(7).normal(size=(40, 8)) * [1, 1, 2, 2, 2, 2, 2, 3]
    times = np.tile([-20.0, -3.0, 0.0, 1.0, 20.0], (40, 1))
    mine, count, ok = solution.trajectories(full, rows, times, 1e-11)
    best, truth, fine = solution.trajectories(taylor, rows, times, 1e-13)
    both = (ok == 0) & (fine == 0)
    assert both.mean() > 0.95
    assert (np.abs(mine - best)[both][:, :2] <= mine[both][:, 2:] + best[both][:, 2:]).all()
    assert np.median(mine[both][:, 2:]) < 1e-10
    known = both & (count >= 0) & (truth >= 0)
    assert known.mean() > 0.9 and np.array_equal(count[known], truth[known])


@pytest.mark.parametrize(
    "scale", [(1, 1, 1, 1, 1, 1, 3, 0), (0, 0, 1, 0, 0, 1, 3, 0), (10, 10, 1, 1, 1, 1, 3, 1)]
)
def test_bars_hold_and_are_narrow_at_coarse_tolerances(scale):
    """From rest every second term vanishes; steps are shorter than the tolerance asks, and the bars know."""
    rows, times = (
        np.random.default_rng(8).normal(size=(20, 8)) * scale,
        np.tile([0.3, 2.0, 8.0], (20, 1)),
    )
    mine, _count, ok = solution.trajectories(full, rows, times, 1e-4)
    best, _truth, fine = solution.trajectories(taylor, rows, times, 1e-13)
    assert (ok == 0).all() and (fine == 0).all()
    assert (np.abs(mine - best)[..., :2] <= mine[..., 2:] + best[..., 2:]).all()
    assert np.median(mine[..., 2:]) < 1e-11


@pytest.mark.parametrize("steps", [1, 4, 100])
@pytest.mark.parametrize("growth", [0.1, 1.0, 5.0])
def test_errors_that_add_up_lie_within_the_bars(steps, growth):
    """The local errors of all six components, each with its worst sign, by equal steps that mix them."""
    G, T, V = (
        np.zeros((14, 3)),
        np.zeros((gyrostat.LAST + 1, 12)),
        np.zeros((gyrostat.LOW + 1, 6, 12)),
    )
    T[gyrostat.LAST, 0] = local = 1e-12
    _G, state = system(LARGEST)
    s, c = np.sin(START[0]), np.cos(START[0])
    weights = np.zeros((2, 6))  # of the components in phi and in w
    weights[0, 3:] = c * gyrostat.FRAME[:, 1] - s * gyrostat.FRAME[:, 2]
    weights[1, :3] = gyrostat.FRAME[:, 0]
    for at, weight in enumerate(weights):
        signs = np.where(weight < 0, -1.0, 1.0)
        matrix = np.eye(6) + np.expm1(growth / steps) * np.outer(signs, signs) / 6
        V[0, :, :6] = matrix.T
        squares, J, work, out = (
            local**2 * np.eye(6),
            np.empty((6, 6)),
            np.empty((6, 6)),
            np.empty(4),
        )
        worst, rows = 0.0, weight
        for _ in range(steps):
            gyrostat.carry(G, T, V, 0.0, squares, J, work)
            worst, rows = worst + local * abs(rows).sum(), rows @ matrix
        worst += local * abs(rows).sum()  # of the initial state
        full._read(state, squares, steps, START[0], out)
        assert worst <= out[2 + at] * (1 + 1e-9)
