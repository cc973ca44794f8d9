"""Trajectories and Abel solutions against the reference, mpmath, closed forms and identities."""

import json
import math
from importlib.resources import files

import mpmath as mp
import numpy as np
import pytest
from flow_truth import exact, zeros_beside_a_focus

import survey
from survey.kernels.cylinder import taylor_double
from survey.kernels.cylinder.steps import (
    EQUILIBRIUM,
    NO_CONVERGENCE,
    OK,
    SEPARATRIX,
    TURNING,
    UNDETERMINED,
)
from survey.measures.cylinder import auto, solution
from survey.methods import closed, dop853, rk4, taylor

REFERENCE = json.loads((files("survey.reference") / "gyrostat.json").read_text())
SIX = (0.7, -0.4, 1.1, 0.3, 0.5, -0.2)
INPUTS = 1e-12  # the reference's inputs are decimals, which binary64 rounds


def number(text):
    return 2 * math.pi if text == "2*pi" else float(text)


def row_of(case):
    return np.array([[*map(float, case["p"]), float(case["phi0"]), float(case["w0"])]])


def in_time(six, phi, w, times, rtol=1e-10):
    row = np.array([[*six, phi, w]])
    return solution.trajectories(taylor, row, np.atleast_2d(np.asarray(times, float)), rtol)


def in_phi(six, phi, w, places, solve=solution, rtol=1e-10):
    row = np.array([[*six, phi, w]])
    floats, status = solve.abel(taylor, row, np.atleast_2d(np.asarray(places, float)), rtol)
    return floats[0], status[0]


def solved_once(row, places):
    """floats and status by the Taylor series with steps of one tolerance."""
    P, starts = solution.split(row)
    planes, status = np.empty((4, 1, places.size)), np.zeros((1, places.size), dtype=np.int8)
    taylor.flow_abels(P, starts, places[None], 1e-13, solution.STEPS, planes, status)
    return np.moveaxis(planes, 0, 2), status


def close(found, bars, wanted):
    """Within 1e-10 (1 + |value|), and within the bar but for the rounding of the inputs."""
    scale = 1 + np.abs(wanted)
    error = np.abs(found - wanted)
    return (error < 1e-10 * scale).all() and (error <= bars + INPUTS * scale).all()


def cases(form):
    return [
        pytest.param(case, id=f"{group}-{i}")
        for group in ("abel_time", "elliptic", "multiple_root")
        for i, case in enumerate(REFERENCE[group])
        if case.get("form", "time") == form
    ]


@pytest.mark.parametrize("case", cases("time"))
def test_reference_in_time(case):
    floats, _n, status = solution.trajectories(
        taylor, row_of(case), np.array([[float(case["t"])]]), 1e-10
    )
    assert status[0, 0] == OK
    assert close(
        floats[0, 0, :2], floats[0, 0, 2:], np.array([float(case["phi"]), float(case["w"])])
    )


@pytest.mark.parametrize("case", cases("abel"))
def test_reference_over_phi(case):
    floats, status = solution.abel(taylor, row_of(case), np.array([[number(case["phi1"])]]), 1e-10)
    assert status[0, 0] == OK
    assert close(floats[0, 0, :2], floats[0, 0, 2:], np.array([float(case["w"]), float(case["t"])]))


@pytest.mark.parametrize("case", cases("turning"))
def test_reference_turning_point(case):
    """N2: the Abel solution ends at phi*; beyond it where and when it turned, before it w ~
    sqrt(phi* - phi).
    """
    turning = float(case["phi_star"])
    floats, status = solution.abel(
        taylor, row_of(case), np.array([[turning - 4e-11, turning + 1e-9, 6.0]]), 1e-10
    )
    assert status[0].tolist() == [OK, TURNING, TURNING]
    for row in floats[0, 1:]:
        assert close(row[:2], row[2:], np.array([turning, float(case["t_star"])]))
    wanted = math.sqrt(2 * 1.0374658223956445361 * 4e-11)
    assert (
        abs(floats[0, 0, 0] - wanted) < 1e-6
        and abs(floats[0, 0, 0] - wanted) <= floats[0, 0, 2] + 2e-10
    )


def test_reference_separatrix():
    """N1: just above the threshold the solution passes the saddle, just below it turns; at it
    nothing is claimed.
    """
    (case,) = (case for case in REFERENCE["abel_time"] if case["form"] == "separatrix")
    saddle, phi, w = (float(case[key]) for key in ("saddle", "phi", "w"))
    for gap in (1e-6, 1e-9, 1e-11, 1e-12):
        # nearer, only double-double arithmetic knows when it has passed
        solve = auto if gap < 1e-11 else solution
        floats, status = in_phi(SIX, phi, w + gap, [saddle - 1e-3, saddle + 1.0], solve)
        assert status.tolist() == [OK, OK]
        floats, status = in_phi(SIX, phi, w - gap, [saddle - 1e-3, saddle + 1.0], solve)
        assert status.tolist() == [OK, TURNING]
        assert floats[1, 0] < saddle
    assert in_phi(SIX, phi, w, [saddle + 1.0])[1][0] in (SEPARATRIX, OK, TURNING)
    floats, status = in_phi(SIX, phi, w, [saddle - 0.01])
    slope = float(case["slope_at_saddle"])
    assert floats[0, 0] == pytest.approx(-0.01 * slope, rel=0.02)


def test_beside_a_turning_point_ok_is_certain_and_turning_holds_within_its_bar():
    """A pendulum from the bottom turns at pi/3: targets before and beyond, down to an ulp, together
    and alone.
    """
    places = np.pi / 3 + np.concatenate(
        [-(10.0 ** np.arange(-8, -16, -0.25)), 10.0 ** np.arange(-15.75, -8, 0.25)]
    )
    with mp.workdps(40):
        gaps = np.array([float(mp.mpf(x) - mp.pi / 3) for x in places])
        time = float(mp.ellipk(mp.mpf("0.25")))
    row = np.array([[0, 0, 0, 0, 0, 1.0, 0.0, 1.0]])
    for method in (taylor, dop853, rk4, closed):
        floats, status = (part[0] for part in solution.abel(method, row, places[None], 1e-10))
        reached, turned = status == OK, status == TURNING
        assert (
            reached.sum() > 10
            and turned.sum() > 30
            and np.isin(status, (OK, TURNING, NO_CONVERGENCE)).all()
        )
        assert (gaps[reached] < 0).all() and turned[gaps > 1e-13].all()
        assert (np.abs(floats[turned, 0] - np.pi / 3) <= floats[turned, 2]).all()
        assert (np.abs(floats[turned, 1] - time) <= floats[turned, 3]).all()
        early = turned & (gaps < 0)
        assert (np.abs(floats[early, 0] - places[early]) <= floats[early, 2]).all()
        back = -gaps[reached]  # w^2 = 2 (cos phi - 1/2)
        wanted = 2.0 * np.sqrt(np.sin(np.pi / 3 - back / 2) * np.sin(back / 2))
        assert (np.abs(floats[reached, 0] - wanted) <= floats[reached, 2]).all()
    together = solved_once(row, places)
    for j in range(0, len(places), 5):
        alone = solved_once(row, places[j : j + 1])
        assert all(np.array_equal(a[0, 0], b[0, j]) for a, b in zip(alone, together, strict=True))


RANDOM = np.random.default_rng(11).normal(size=(5, 9)) * [1, 1, 2, 2, 2, 2, 2, 3, 3]
HARD = [
    [25.0, -10.0, 0.5, 0.7, 1.2, -0.4, 0.2, -0.5, 1.5],  # stiff
    [0.3, 0.2, 1.0, 0.5, 0.4, 0.1, 0.2, 60.0, 1.0],  # fast
    [0.7, -0.4, 1.1, 0.3, 0.5, -0.2, 3.5, 1.854144577, 5.0],  # beside a separatrix
    # the last term of the series is small by accident
    [2.0525587626450255e-06, 1.195645286994414e-06, 5.601784490366319e-12, 9.864457289570756e-13,
     -1.914357676431763e-13, 1.1325806940900474e-12, 378975.8919006513, -4.448201450408445e-06,
     156550.85109858488],
]  # fmt: skip


def test_the_series_agree_with_mpmaths_own_integrator():
    *six, phi, w, _t = RANDOM[0].tolist()
    b12, b31, d, c23, s2, s3 = six

    def rates(_t, y):
        s, c = mp.sin(y[0]), mp.cos(y[0])
        return [
            y[1],
            (b12 * c - b31 * s) * y[1] - d * c * s - c23 * (c * c - s * s) + s2 * c - s3 * s,
        ]

    assert mp.odefun(rates, 0, [phi, w])(0.5) == pytest.approx(exact(six, phi, w, 0.5), rel=1e-13)


@pytest.mark.parametrize("numbers", [*RANDOM.tolist(), *HARD])
def test_against_mpmath(numbers):
    """All inputs are binary64 numbers here: the true error lies within the bar, without any allowance."""
    *six, phi, w, t = numbers
    floats, _n, status = in_time(six, phi, w, t)
    error = np.abs(floats[0, 0, :2] - exact(six, phi, w, t))
    assert status[0, 0] == OK
    assert (error <= floats[0, 0, 2:]).all()
    assert (floats[0, 0, 2:] <= 1e-8).all()


def test_abel_and_time_agree():
    random = np.random.default_rng(3)
    for _ in range(20):
        six, phi, w = random.normal(size=6), random.uniform(-3, 3), random.normal() * 3
        floats, status = in_phi(six, phi, w, phi + np.array([-2.0, -0.3, 0.4, 3.0]))
        for place, row, code in zip(
            phi + np.array([-2.0, -0.3, 0.4, 3.0]), floats, status, strict=True
        ):
            if code not in (OK, TURNING):
                continue
            when = row[1]
            back, _n, ok = in_time(six, phi, w, when)
            wanted = (place, row[0]) if code == OK else (row[0], 0.0)
            speed = np.array([abs(back[0, 0, 1]), 50.0])
            assert ok[0, 0] == OK
            assert (
                np.abs(back[0, 0, :2] - wanted)
                <= 2 * (back[0, 0, 2:] + row[2] + speed * row[3]) + 1e-13
            ).all()


def test_a_start_at_a_turning_point_goes_to_the_side_of_g():
    """g(0.5) < 0 here: w = 0 starts to the left, forward in time, and has turned for places on the right."""
    floats, status = in_phi(SIX, 0.5, 0.0, [0.3, 0.5, 0.7])
    assert status.tolist() == [OK, OK, TURNING]
    assert floats[0, 0] < 0 < floats[0, 1] and floats[1, :2].tolist() == [0.0, 0.0]
    assert floats[2, :2].tolist() == [0.5, 0.0]


def test_a_node_is_reached_in_infinite_time_only():
    """Damped descent into a stable node: places before it are reached, places beyond never."""
    six = (3.0, 0.0, 0.0, 0.0, 0.0, -0.5)  # near phi = pi: x'' = -3 x' - x/2
    floats, status = in_phi(six, math.pi - 0.3, 0.1, [math.pi - 0.2, math.pi - 1e-3, math.pi + 0.1])
    assert status.tolist() == [OK, OK, EQUILIBRIUM]
    assert np.isfinite(floats[:2]).all()


def test_equilibrium_start():
    floats, _n, status = in_time((0, 0, 0, 0, 0, 1.0), 0.0, 0.0, [0.0, 5.0, 1e3])
    assert np.array_equal(floats[0, :, :2], np.zeros((3, 2))) and (status == OK).all()
    assert in_phi((0, 0, 0, 0, 0, 1.0), 0.0, 0.0, [0.0, 1.0])[1].tolist() == [OK, EQUILIBRIUM]


def test_a_start_at_rest_beside_an_equilibrium_leaves_it():
    """The double next to pi is no equilibrium of a pendulum: it falls, slowly, to the side of g."""
    row = np.array([[0, 0, 0, 0, 0, 1.0, math.pi, 0.0]])
    places = np.array([[1.0, math.pi, 4.0]])
    assert solution.abel(taylor, row, places, 1e-10)[1][0].tolist() == [SEPARATRIX, OK, SEPARATRIX]
    floats, status = auto.abel(taylor, row, places, 1e-10)
    assert status[0].tolist() == [OK, OK, TURNING]
    # a quarter of the libration, less what is left of it at phi = 1; 1 - k^2 is 4e-33
    with mp.workdps(90):
        start = mp.mpf(math.pi)
        k = mp.sin(start / 2)
        time = mp.ellipk(k**2) - mp.ellipf(mp.asin(mp.sin(mp.mpf(1) / 2) / k), k**2)
        w = -mp.sqrt(2 * (mp.cos(1) - mp.cos(start)))
    assert (
        abs(floats[0, 0, 0] - w) <= floats[0, 0, 2]
        and abs(floats[0, 0, 1] - time) <= floats[0, 0, 3] < 1e-10
    )


@pytest.mark.parametrize("method", [taylor, dop853])
@pytest.mark.parametrize("six", [SIX, (0, 0, 1.1, 0.3, 0.5, -0.2)])
def test_the_branch_before_is_where_the_motion_came_from(six, method):
    row = np.array([[*six, 0.5, 0.0]])
    places = np.array([[0.3, 0.5, 0.7, 0.45]])
    floats, status = solution.abel(method, row, places, 1e-10, before=True)
    assert status[0].tolist() == [OK, OK, TURNING, OK] and floats[0, 2, :2].tolist() == [0.5, 0.0]
    for place, (w, t, bar_w, bar_t) in zip(places[0, [0, 3]], floats[0, [0, 3]], strict=True):
        assert w > 0 > t
        phi, speed = exact(six, 0.5, 0.0, t)
        assert abs(phi - place) <= speed * bar_t + 1e-15 and abs(speed - w) <= bar_w + 3 * bar_t
    plain = np.array([[*six, 0.5, 0.1]])
    one, other = (
        solution.abel(method, plain, places, 1e-10, before=choice) for choice in (False, True)
    )
    assert all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_closed_form_50():
    """Case A is the reduced flow with F alone: phi' = (P sin + Q cos + n)/A11, so g = (n/A11) f
    with w = F + n/A11.
    """
    for case in REFERENCE["closed50"]:
        A11, theta, n = (float(case[key]) for key in ("A11", "theta0", "n"))
        P, Q = (float(case[key]) * math.sin(theta) / A11 for key in ("B12", "B31"))
        phi = float(case["phi0"])
        w = P * math.sin(phi) + Q * math.cos(phi) + n / A11
        floats, _n, _s = in_time((P, Q, 0, 0, 0, 0), phi, w, float(case["t"]))
        assert close(
            floats[0, 0, :2], floats[0, 0, 2:], np.array([float(case["phi"]), float(case["w"])])
        )


def test_closed_form_61():
    """(61) corrected: w = mu F + n."""
    for case in REFERENCE["trig61"]:
        mu, b12, b31, n, c23, d, s2, s3, phi0, phi1, t = (
            float(case[key])
            for key in ("mu", "b12", "b31", "n", "c23", "d", "s2", "s3", "phi0", "phi1", "t")
        )
        w = mu * (b12 * math.sin(phi0) + b31 * math.cos(phi0)) + n
        six = (b12, b31, d, c23, s2, s3)
        floats, _n, _s = in_time(six, phi0, w, t)
        assert abs(floats[0, 0, 0] - float(case["phi_t"])) < 1e-10
        floats, _s = in_phi(six, phi0, w, phi1)
        assert close(
            floats[0, :2], floats[0, 2:], np.array([float(case["w_phi1"]), float(case["t_phi1"])])
        )


def test_energy_balance():
    """dH/dt = f w^2 (identity): the change of H is the integral, by Gauss-Legendre over the dense output."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    b12, b31, d, c23, s2, s3 = SIX
    times = np.append(1.5 * (nodes + 1), [0.0, 3.0])
    phi, w = in_time(SIX, 1.5, 0.8, times)[0][0, :, :2].T
    s, c = np.sin(phi), np.cos(phi)
    H = w * w / 2 + d / 2 * s * s + c23 * s * c - s2 * s - s3 * c
    power = (b12 * c - b31 * s) * w * w
    assert H[-1] - H[-2] == pytest.approx(1.5 * weights @ power[:-2], abs=1e-12)


def test_symmetries_S1_and_S2():
    row = np.random.default_rng(2).normal(size=(10, 8))
    times = np.tile([-3.0, 2.0], (10, 1))
    plain, _n, _s = solution.trajectories(taylor, row, times, 1e-10)
    back, _n, _s = solution.trajectories(taylor, solution.reverse(row), -times, 1e-10)
    assert np.array_equal(plain[..., 0], back[..., 0]) and np.array_equal(
        plain[..., 1], -back[..., 1]
    )
    other, _n, _s = solution.trajectories(taylor, solution.mirror(row), times, 1e-10)
    assert np.array_equal(plain[..., :2], -other[..., :2])


def test_turnings_of_a_pendulum():
    """A pendulum from rest turns every half period."""
    period = 4 * float(mp.ellipk(math.sin(0.5) ** 2))
    times = period * (np.arange(8) / 2 + 0.25)
    _f, turnings, _s = in_time((0, 0, 0, 0, 0, 1.0), 1.0, 0.0, times)
    assert turnings[0].tolist() == list(range(8))


@pytest.mark.parametrize(
    "six", [SIX, pytest.param((0.4, 0.3, -0.9, 0.7, 1.1, 0.6), marks=pytest.mark.slow)]
)
def test_turnings_far_into_a_focus_are_reported(six):
    """Where w is far below rounding, down to e^-400, they are counted about the focus in polar
    coordinates.
    """
    times = np.array([10.0, 100.0, 333.0, 1000.0])
    _f, turnings, _s = in_time(six, 2.5, 0.1, times)
    assert turnings[0].tolist() == zeros_beside_a_focus(six, 2.5, 0.1, times)


def test_a_turning_within_the_bar_of_w_is_not_counted_but_by_double_double():
    """A start beside a double root: w does not reach 0, by 3e-17."""
    row = np.array([[0, 0, -1.200558782775014, -0.2737773771513731, 1.2166661048093794, 0.2739402077906878,
                     -1.5913397469582256, 6.652845693193966e-18]])  # fmt: skip
    times = np.array([[1.2577104547576345]])
    assert solution.trajectories(taylor, row, times, 1e-10)[1][0, 0] == UNDETERMINED
    assert auto.trajectories(taylor, row, times, 1e-10)[1][0, 0] == 0
    assert exact(row[0, :6], *row[0, 6:], times[0, 0])[1] > 0


def test_a_lost_trajectory_is_not_answered():
    """Along a separatrix and far beyond the bar grows past the trust in it."""
    six = (0, 0, 0, 0, 0, 1.0)
    floats, _n, status = in_time(six, math.pi - 1e-13, 0.0, [1.0, 60.0])
    assert status[0, 0] == OK and status[0, 1] != OK and np.isnan(floats[0, 1]).all()


@pytest.mark.slow
def test_many_against_dop853():
    random = np.random.default_rng(21)
    rows = random.normal(size=(2000, 8)) * [1, 1, 2, 2, 2, 2, 2, 3]
    times = np.tile([-5.0, 3.0, 20.0], (2000, 1))
    a, n, ok = solution.trajectories(taylor, rows, times, 1e-10)
    b, m, fine = solution.trajectories(dop853, rows, times, 1e-12)
    both = (ok == OK) & (fine == OK)
    assert both.mean() > 0.95
    assert (np.abs(a - b)[both][:, :2] <= a[both][:, 2:] + b[both][:, 2:]).all()
    known = both & (n >= 0) & (m >= 0)
    assert np.array_equal(n[known], m[known])


def test_rows_that_no_closed_form_serves_have_the_same_bits_among_those_that_one_serves():
    """`auto` looks at some rows first: the others are solved as if they stood alone."""
    rng = np.random.default_rng(11)
    rows = np.column_stack([rng.uniform(-1, 1, (256, 6)), rng.uniform(-3, 3, (256, 2))])
    rows[:, :2] = np.where(np.arange(256)[:, None] % 7 == 1, rows[:, :2], 0.0)
    rows[:: 1 + 256 // auto.SAMPLE, :2] = 0.0  # those that are looked at
    own, times, targets = np.flatnonzero(rows[:, 0]), np.full((256, 1), 15.0), rows[:, 6:7] + 1.0
    assert 20 < own.size < 40
    for measure, columns in ((auto.trajectories, times), (auto.abel, targets)):
        among = measure(taylor, rows, columns, 1e-10)
        for i in own:
            for part, alone in zip(
                among, measure(taylor, rows[i : i + 1], columns[i : i + 1], 1e-10), strict=True
            ):
                np.testing.assert_array_equal(part[i], alone[0])


def test_long_motions_take_finer_steps_and_have_the_same_bits_among_others():
    rng = np.random.default_rng(4)
    rows = np.column_stack([rng.normal(size=(40, 6)) * rng.uniform(0.05, 1, (40, 1)),
                            rng.uniform(0, 6, 40), rng.uniform(-2, 2, 40)])  # fmt: skip
    times = np.where(np.arange(40)[:, None] % 3, 250.0, 5.0) * np.array([[0.5, 1.0]])
    decades = solution._decades(rows, times)
    assert len(np.unique(decades)) > 2 and (decades[::3] <= 1).all()
    floats, turnings, status = solution.trajectories(taylor, rows, times, 1e-7)
    assert (status == OK).mean() > 0.9
    exact, _n, _status = solution.trajectories(dop853, rows, times, 1e-12)
    good = status == OK
    error = np.abs(floats - exact)[..., :2]
    assert (error <= floats[..., 2:] + exact[..., 2:])[good].all()
    for i in range(40):
        alone = solution.trajectories(taylor, rows[i : i + 1], times[i : i + 1], 1e-7)
        for one, many in zip(alone, (floats, turnings, status), strict=True):
            np.testing.assert_array_equal(one[0], many[i])


def test_angles_on_both_sides_of_the_start_are_served_as_those_of_either():
    rng = np.random.default_rng(6)
    rows = np.column_stack(
        [rng.uniform(-0.5, 0.5, (30, 6)), rng.uniform(1, 5, 30), rng.uniform(-4, 4, 30)]
    )
    rows[:6, 7], rows[6:15, 7] = 0.0, rng.choice([-1, 1], 9) * 10.0 ** rng.uniform(-13, -2, 9)
    angles = np.broadcast_to(np.linspace(0.0, 6.0, 25), (30, 25))
    floats, status = solution.abel(taylor, rows, angles, 1e-9)
    for row, found, codes in zip(rows, floats, status, strict=True):
        for mine in (angles[0] >= row[6], angles[0] < row[6]):
            own, own_codes = solution.abel(taylor, row[None], angles[:1, mine], 1e-9)
            np.testing.assert_array_equal(own[0], found[mine])
            np.testing.assert_array_equal(own_codes[0], codes[mine])


def test_turnings_are_counted_on_demand_alone(monkeypatch):
    """Beside a focus w is less than its bar, and zeros of w are counted apart."""
    row, times = np.array([[-0.4, 0.0, 0.0, 0.0, 0.0, 1.0, 0.3, 1.0]]), np.array([[5.0, 400.0]])
    floats, turnings, status = auto.trajectories(taylor, row, times, 1e-10)
    assert (status == OK).all() and turnings[0, 1] > 50

    def refuse(*_):
        raise AssertionError("counted")

    monkeypatch.setattr(taylor, "flow_turnings", refuse)
    monkeypatch.setattr(taylor_double, "flow_trajectories", refuse)
    alone, unknown, codes = auto.trajectories(taylor, row, times, 1e-10, counted=False)
    np.testing.assert_array_equal(alone[0, 0], floats[0, 0])
    assert (unknown == UNDETERMINED).all() and (codes == OK).all()
    given = dict(zip(("b12", "b31", "d", "c23", "s2", "s3", "phi0", "w0"), row[0], strict=True))
    ds = survey.evaluate(
        "gyrostat", question="trajectory", t=400.0, variables=["phi", "w"], **given
    )
    assert ds.status == 0 and abs(ds.w) <= ds.w_error + 1e-12 and "turnings" not in ds


def test_w_without_times_does_not_depend_on_other_points():
    """Times that are not asked for hold anything: which points get more digits may not follow from them."""
    known = {
        "b12": [0, 0.7], "b31": -0.4, "d": 1.1, "c23": 0.3, "s2": [0, 0.5], "phi0": [0.0, 3.0],
    }  # fmt: skip
    speeds, phi = [0.0, -1.0, 2.0, 30.0], np.linspace(-10, 10, 41)

    def found(w0, phi):
        ds = survey.evaluate(
            "gyrostat", question="abel", w0=w0, phi=phi, rtol=1e-10, variables=["w"], **known
        )
        return np.stack([ds.w.transpose("w0", ..., "phi"), ds.w_error.transpose("w0", ..., "phi")])

    whole = found(speeds, phi)
    alone = np.concatenate([found([w0], phi) for w0 in speeds], axis=1)
    halves = np.concatenate([found(speeds, phi[:20]), found(speeds, phi[20:])], axis=-1)
    for other in (found(speeds, phi), alone, halves):
        np.testing.assert_array_equal(whole, other)
