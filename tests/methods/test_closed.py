"""Closed forms against 40 digits, quadrature and Taylor series: within the bars, and the bars are narrow."""

import json
from importlib.resources import files

import mpmath as mp
import numpy as np
import pytest

import survey
from survey.measures.cylinder import auto as cylinder_auto
from survey.measures.cylinder import solution
from survey.methods import closed, taylor
from survey.precision.cases import gyrostat as precision
from survey.scene import Request
from survey.scenes import gyrostat

REFERENCE = json.loads((files("survey.reference") / "gyrostat.json").read_text())
NO_FORM, EQUILIBRIUM, TURNING = 19, 17, 16


def at(row, *times):
    floats, turnings, status = solution.trajectories(
        closed, np.array([row], float), np.array([times], float), 1e-10
    )
    return floats[0], turnings[0], status[0]


def passing(row, *places):
    floats, status = solution.abel(closed, np.array([row], float), np.array([places], float), 1e-10)
    return floats[0], status[0]


def check(found, wanted, widest):
    values, bars = found[:2], found[2:]
    assert (np.abs(values - wanted) <= bars).all()
    assert (bars <= widest * (1.0 + np.abs(values))).all()


@pytest.mark.parametrize("case", REFERENCE["closed50"], ids=lambda case: case["case"])
def test_the_three_cases_of_50(case):
    A11, B12, B31, theta, n, phi0, t = (
        float(case[k]) for k in ("A11", "B12", "B31", "theta0", "n", "phi0", "t")
    )
    b12, b31 = B12 * np.sin(theta) / A11, B31 * np.sin(theta) / A11
    w0 = b12 * np.sin(phi0) + b31 * np.cos(phi0) + n / A11
    found, turnings, status = at([b12, b31, 0, 0, 0, 0, phi0, w0], t)
    assert status[0] == 0 and turnings[0] == 0
    check(found[0] + [0, 0, 1e-15, 1e-15], [float(case["phi"]), float(case["w"])], 1e-12)


@pytest.mark.parametrize(
    "case", REFERENCE["elliptic"] + REFERENCE["multiple_root"], ids=lambda case: case["note"][:20]
)
def test_elliptic_references(case):
    row = [*map(float, case["p"]), float(case["phi0"]), float(case["w0"])]
    found, _n, status = at(row, float(case["t"]))
    # a double root: digits are lost
    if "near-degenerate" in case["note"] or case.get("variant") in (1, 3):
        assert (
            status[0] == 3
            or (np.abs(found[0, :2] - [float(case["phi"]), float(case["w"])]) <= found[0, 2:]).all()
        )
        return
    assert status[0] == 0
    check(found[0], [float(case["phi"]), float(case["w"])], 3e-12)


@pytest.mark.parametrize("case", REFERENCE["trig61"])
def test_61(case):
    b12, b31, d, c23, s2, s3, phi0 = (
        float(case[k]) for k in ("b12", "b31", "d", "c23", "s2", "s3", "phi0")
    )
    F = b12 * np.sin(phi0) + b31 * np.cos(phi0)
    row = [b12, b31, d, c23, s2, s3, phi0, float(case["mu"]) * F + float(case["n"])]
    found, _n, status = at(row, float(case["t"]))
    assert status[0] == 0 and abs(found[0, 0] - float(case["phi_t"])) < found[0, 2] < 1e-11
    found, status = passing(row, float(case["phi1"]))
    assert status[0] == 0
    check(found[0], [float(case["w_phi1"]), float(case["t_phi1"])], 1e-11)
    _f, _n, status = at([*row[:7], row[7] + 1e-12], 1.0)
    assert status[0] == NO_FORM


@pytest.mark.parametrize("work", ["g = 0", "(61)"])
def test_references_to_t_20(work):
    for point, _options, wanted, _verdict in precision.references(work):
        found, turnings, status = at([point[name] for name in precision._NAMES], 20.0)
        assert status[0] == 0 and turnings[0] == 0
        assert abs(found[0, 0] - wanted["phi"]) <= found[0, 2] < 1e-12 * (1 + abs(wanted["phi"]))


def exact50(b12, b31, phi0, w0, t):
    """phi, w by the matrix exponential of the linear system whose ratio is tan(x/2)."""
    b12, b31, phi0, w0, t = map(mp.mpf, (b12, b31, phi0, w0, t))
    F, f = b12 * mp.sin(phi0) + b31 * mp.cos(phi0), b12 * mp.cos(phi0) - b31 * mp.sin(phi0)
    y = mp.expm(mp.matrix([[f, w0], [2 * F - w0, -f]]) * t / 2, method="taylor") * mp.matrix([0, 1])
    x = 2 * mp.atan2(y[0], y[1])
    return phi0 + x, w0 - F + F * mp.cos(x) + f * mp.sin(x)


@pytest.mark.parametrize("gap", [0.0, 1e-15, -1e-15, 1e-9, -1e-9, 1e-4, -1e-4])
def test_digits_are_kept_where_delta_squared_changes_sign(gap):
    phi0, t = 0.3, 7.5
    w0 = 0.5 * np.sin(phi0) + 0.5 + gap  # n = b + gap
    found, _n, status = at([0.5, 0, 0, 0, 0, 0, phi0, w0], t)
    with mp.workdps(40):
        wanted = [float(v) for v in exact50(0.5, 0, phi0, w0, t)]
    assert status[0] == 0
    check(found[0], wanted, 3e-14)


def test_many_turns_of_50_are_counted():
    """Over k periods 2 pi/Delta phi grows by 2 pi k."""
    w0 = 0.6 * np.sin(0.4) + 1.0
    period = 2 * np.pi / 0.8
    found, _n, _s = at([0.6, 0, 0, 0, 0, 0, 0.4, w0], 1000 * period)
    assert abs(found[0, 0] - 0.4 - 2000 * np.pi) < found[0, 2] + 1e-15 * 1000 * period < 1e-9


def test_uniform_rotation_and_rest():
    found, _n, status = at([0, 0, 0, 0, 0, 0, 0.25, -1.5], 4.0, -2.0)
    assert np.array_equal(found[:, :2], [[-5.75, -1.5], [3.25, -1.5]]) and (status == 0).all()
    found, _n, _s = at([0.4, 0.2, 0, 0, 0, 0, 1.0, 0.0], 1e6)
    assert found[0, 0] == 1.0 and found[0, 1] == 0.0


def test_aperiodic_motion_ends_at_the_equilibrium_of_50():
    row = [0.8, 0, 0, 0, 0, 0, 0.0, 0.4]  # phi' = 0.8 sin phi + 0.4: reaches pi + pi/6
    found, status = passing(row, 3.0, 4.0)
    assert status.tolist() == [0, EQUILIBRIUM]
    with mp.workdps(30):
        t = mp.quad(lambda x: 1 / (mp.mpf(0.8) * mp.sin(x) + mp.mpf(0.4)), [0, 1, 2, 3])
    check(found[0], [0.8 * np.sin(3.0) + 0.4, float(t)], 1e-13)


def test_where_g_is_0_w_keeps_its_sign_however_small():
    found, turnings, status = at([0.8, 0, 0, 0, 0, 0, 0.0, 0.4], 60.0)
    assert status[0] == 0 and found[0, 1] < found[0, 3] and turnings[0] == 0


ELLIPTIC = {  # d, c23, s2, s3, phi0, w0 with the roots of the quartic
    "rotation, two complex pairs": (1.1, 0.3, 0.5, -0.2, 0.3, 2.0),
    "rotation backwards": (-1.7, 0.4, 0.3, 0.2, 2.3, -3.1),
    "fast rotation": (1.1, 0.3, 0.5, -0.2, 0.3, 300.0),
    "libration, two real roots": (0.2, 0.1, 0.3, 1.0, 0.5, 0.7),
    "libration, four real roots": (-4.0, 0.3, 0.2, 0.3, 1.2, 1.4),
    "libration through pi": (0.0, 0.0, 0.0, -1.0, 3.0, 1.2),
    "small libration": (0.0, 0.0, 0.0, 1.0, 0.0, 1e-6),
    "wide libration": (0.0, 0.0, 0.0, 1.0, 0.0, 1.99),
    "complex double roots": (-0.07, 0.12, -0.48, 0.36, 0.7, 1.171765581290270106),
    "pendulum rotation": (0.0, 0.0, 0.0, 1.0, 0.0, 2.1),
}


def quadrature(row, a, b):
    """Time from a to b by quadrature of 1/w at 30 digits."""
    d, c23, s2, s3, phi0, w0 = map(mp.mpf, row)

    def V(x):
        return d / 2 * mp.sin(x) ** 2 + c23 / 2 * mp.sin(2 * x) - s2 * mp.sin(x) - s3 * mp.cos(x)

    return mp.quad(
        lambda x: 1 / mp.sqrt(w0**2 + 2 * (V(phi0) - V(x))), mp.linspace(mp.mpf(a), mp.mpf(b), 9)
    )


@pytest.mark.parametrize("name", ELLIPTIC)
def test_time_of_flight_against_quadrature(name):
    row = ELLIPTIC[name]
    scale = 1.0 if abs(row[5]) > 0.01 else abs(row[5])
    place = row[4] + 0.35 * scale * np.sign(row[5])
    found, status = passing([0, 0, *row], place)
    assert status[0] == 0
    with mp.workdps(30):
        t = float(abs(quadrature(row, row[4], place)))
    assert abs(found[0, 1] - t) <= found[0, 3] < (1e-9 if "wide" in name else 1e-10) * t
    there, _n, _s = at([0, 0, *row], t)
    assert abs(there[0, 0] - place) <= there[0, 2] + abs(there[0, 1]) * 2e-16 and there[0, 2] < 1e-9


@pytest.mark.parametrize("name", ELLIPTIC)
def test_elliptic_against_taylor(name):
    row, times = np.array([[0, 0, *ELLIPTIC[name]]]), np.array([[-9.0, -0.01, 0.0, 0.7, 3.0, 20.0]])
    mine, n, ok = solution.trajectories(closed, row, times, 1e-10)
    other, m, fine = solution.trajectories(taylor, row, times, 1e-13)
    assert (ok == 0).all() and (fine == 0).all() and np.array_equal(n, m)
    assert (np.abs(mine - other)[..., :2] <= mine[..., 2:] + other[..., 2:]).all()


def test_turning_points():
    """A pendulum from the bottom turns where cos phi = 1 - w0^2/2, after K/omega; phase and
    turnings at large t.
    """
    row = [0, 0, 0, 0, 0, 1.0, 0.0, 1.0]
    quarter = float(mp.ellipk(0.25))
    found, status = passing(row, 0.5, 2.0)
    assert status.tolist() == [0, TURNING]
    check(found[1], [np.pi / 3, quarter], 1e-13)
    found, turnings, _s = at(row, *(quarter * np.array([0.5, 1.5, 3.5, 20001.5])))
    assert turnings.tolist() == [0, 1, 2, 10001]
    start, n, _s = at([0, 0, 0, 0, 0, 1.0, -np.pi / 3, 0.0], 0.0, quarter, 2.5 * quarter)
    assert n.tolist() == [0, 0, 1] and abs(start[1, 0]) <= start[1, 2] < 1e-13


@pytest.mark.parametrize("kind", ["g = 0", "b = 0", "pendulum", "s = 0", "61"])
def test_random_points_agree_with_taylor_within_both_bars(kind):
    random = np.random.default_rng(5)
    rows = random.normal(size=(150, 8)) * [1, 1, 2, 2, 2, 2, 3, 2]
    zero = {
        "g = 0": [2, 3, 4, 5],
        "b = 0": [0, 1],
        "pendulum": [0, 1, 2, 3],
        "s = 0": [0, 1, 4, 5],
        "61": [],
    }[kind]
    rows[:, zero] = 0.0
    if kind == "61":
        b12, b31, n, mu = rows[:, 0], rows[:, 1], random.normal(size=150), random.normal(size=150)
        rows[:, 2:6] = np.transpose([(mu - mu**2) * (b12**2 - b31**2), (mu - mu**2) * b12 * b31,
                                     n * (mu - 1) * b12, n * (mu - 1) * b31])  # fmt: skip
        rows[:, 7] = mu * (b12 * np.sin(rows[:, 6]) + b31 * np.cos(rows[:, 6])) + n
    times = np.tile([-2.0, 0.3, 6.0], (150, 1))
    mine, n, ok = solution.trajectories(closed, rows, times, 1e-10)
    other, m, fine = solution.trajectories(taylor, rows, times, 1e-13)
    both = (ok == 0) & (fine == 0)
    assert both.mean() > 0.9 and ((n == m) | (n == -2))[both].all()
    assert (np.abs(mine - other)[both][:, :2] <= mine[both][:, 2:] + other[both][:, 2:]).all()
    mine, ok = solution.abel(closed, rows, rows[:, 6:7] + times, 1e-10)
    other, fine = solution.abel(taylor, rows, rows[:, 6:7] + times, 1e-13)
    both = (ok == fine) & ((ok == 0) | (ok == TURNING))
    assert (np.abs(mine - other)[both][:, :2] <= mine[both][:, 2:] + other[both][:, 2:]).all()
    decided = ~np.isin(ok, (3, NO_FORM)) & np.isin(fine, (0, TURNING, EQUILIBRIUM))
    assert np.array_equal(ok[decided], fine[decided])


NAMES = (*gyrostat._SYSTEM, "phi0", "w0")


def solve(question, method, **values):
    point = {
        name: np.atleast_1d(np.asarray(values.get(name, 0.0), float))
        for name in (*gyrostat._SYSTEM, "phi0", "w0")
    }
    point |= {
        name: np.atleast_1d(np.asarray(values[name], float))
        for name in ("t", "phi")
        if name in values
    }
    return gyrostat.solve(point, Request({"question": question}, method, 1e-10))


def test_auto_takes_the_closed_form_point_by_point():
    b12, t = np.array([0.0, 0.3, 0.0]), np.array([4.0])
    system = {"b12": b12, "d": 1.0, "s3": 0.5, "phi0": 0.4, "w0": [1.0, 1.0, np.sqrt(2.0)], "t": t}
    auto, by_name, steps = (
        solve("trajectory", method, **system) for method in ("auto", "closed", "taylor")
    )
    assert by_name["status"].tolist()[:2] == [0, NO_FORM] and (auto["status"] == 0).all()
    assert auto["phi"][0] == by_name["phi"][0] and auto["phi"][1] == steps["phi"][1]
    for i in range(3):
        alone = solve(
            "trajectory", "auto", **(system | {"b12": b12[i : i + 1], "w0": [system["w0"][i]]})
        )
        assert all(alone[name][0] == auto[name][i] for name in auto)


def test_auto_falls_back_near_a_separatrix():
    row = np.array([[0, 0, 0, 0, 0, 1.0, 0.0, 2.0 * (1 - 1e-15)]])
    times = np.array([[2.0]])
    assert solution.trajectories(closed, row, times, 1e-10)[2][0, 0] == 3
    floats, _n, status = cylinder_auto.trajectories(taylor, row, times, 1e-10)
    with mp.workdps(30):
        wanted = float(2 * mp.asin(mp.tanh(2)))
    assert status[0, 0] == 0 and abs(floats[0, 0, 0] - wanted) < 1e-12


def test_no_fate_in_closed_form():
    with pytest.raises(survey.BadInput, match="'closed' does not support question = fate"):
        survey.evaluate("gyrostat", b12=0.3, d=1.0, w0=1.0, method="closed")
