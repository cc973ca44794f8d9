"""Clebsch's case against the linearised equations in 50 digits, the full motion, and the scene of a
body with A = B.
"""

import body_truth as truth
import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import survey

MOMENTS = ("A", "B", "C")


def bodies(number, seed):
    """Moments of inertia (number, 3) that a body can have, and epsilon of either sign."""
    draw = np.random.default_rng(seed)
    squares = draw.uniform(0.05, 1.0, (number, 3))  # integrals of x^2, y^2, z^2 over the mass
    return squares.sum(axis=1, keepdims=True) - squares, draw.normal(size=number), draw


def ask(question, moments, **point):
    ds = survey.evaluate(
        "brun_triaxial", question=question, **dict(zip(MOMENTS, moments, strict=True)), **point
    )
    return ds.load()


def linearised(moments, epsilon, rate, axis):
    """Exponents of the linearised equations (1) in w and nu beside the rotation, by the eigenvalues
    of 6 x 6.
    """
    inertias, e = [mp.mpf(float(A)) for A in moments], mp.mpf(float(epsilon))
    nu = [mp.mpf(i == axis) for i in range(3)]
    w = [mp.mpf(float(rate)) * x for x in nu]
    M, f = (
        [A * p for A, p in zip(inertias, w, strict=True)],
        [A * x for A, x in zip(inertias, nu, strict=True)],
    )

    def cross(v):
        return mp.matrix([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    inertia = mp.diag(inertias)
    torque_w = cross(M) - cross(w) * inertia
    torque_nu = e * (cross(nu) * inertia - cross(f))
    top = (
        mp.diag([1 / A for A in inertias]) * torque_w,
        mp.diag([1 / A for A in inertias]) * torque_nu,
    )
    full = mp.matrix(6, 6)
    for i in range(3):
        for j in range(3):
            full[i, j], full[i, 3 + j] = top[0][i, j], top[1][i, j]
            full[3 + i, j], full[3 + i, 3 + j] = cross(nu)[i, j], -cross(w)[i, j]
    return mp.eig(full, left=False, right=False)


def test_rotations_are_those_of_the_linearised_equations():
    moments, epsilons, draw = bodies(40, 1)
    seen = set()
    for body, epsilon in zip(moments, epsilons, strict=True):
        rate, axis = float(draw.normal() * abs(epsilon) ** 0.5), int(draw.integers(3))
        ds = ask("rotation", body, epsilon=epsilon, Omega=rate, axis=MOMENTS[axis])
        with mp.workdps(50):
            roots = linearised(body, epsilon, rate, axis)
            growth = max(mp.re(x) for x in roots)
            # two of the six are 0: those of F3 and of |nu|
            turns = sorted(abs(mp.im(x)) for x in sorted(roots, key=abs)[2:])
            assert abs(float(ds.growth) - growth) <= float(ds.growth_error) + 1e-18
            for name, value in (("frequency_slow", turns[0]), ("frequency_fast", turns[-1])):
                assert abs(float(ds[name]) - value) <= float(ds[f"{name}_error"]) + 1e-18, (
                    name,
                    body,
                    epsilon,
                    rate,
                )
        assert int(ds.verdict) == (0 if growth > 1e-12 else 1)
        assert float(ds.growth_error) < 1e-8 and (
            not growth > 1e-12 or float(ds.growth) > float(ds.growth_error)
        )
        seen.add((int(ds.verdict), int(ds.place)))
    assert seen >= {(0, -1), (0, 0), (0, 1), (1, -1), (1, 1)}


def test_at_the_critical_rate_stability_changes():
    moments, epsilons, _draw = bodies(20, 2)
    for body, epsilon in zip(moments, epsilons, strict=True):
        axis = int(np.argmax(body) if epsilon > 0 else np.argmin(body))
        one = ask("rotation", body, epsilon=epsilon, Omega=1.0, axis=MOMENTS[axis])
        a, b = (np.arcsin(np.sqrt(x / body[axis])) if epsilon > 0 else np.arcsinh(np.sqrt(x / body[axis] - 1))
                for x in np.delete(body, axis))  # fmt: skip
        if epsilon > 0:
            other = epsilon**0.5 * np.sin(a + b)
            assert abs(float(one.critical_rate) - other) < 1e-12
        rate = float(one.critical_rate)
        with mp.workdps(50):
            grows = [
                max(mp.re(x) for x in linearised(body, epsilon, rate * (1 + s * 1e-9), axis))
                for s in (-1, 1)
            ]
        assert grows[0] > 1e-7 > 1e-15 > grows[1]
        beside = [rate * (1 - 1e-9), rate, rate * (1 + 1e-9)]
        assert ask("rotation", body, epsilon=epsilon, Omega=beside, axis=MOMENTS[axis]).verdict.values.tolist() == [
            0, -1, 1]  # fmt: skip


def test_bodies_that_turn_stably_stay_and_others_leave():
    moments, epsilons, draw = bodies(30, 3)
    for body, epsilon in zip(moments, epsilons, strict=True):
        rate, axis = float(draw.normal()), int(draw.integers(3))
        ds = ask("rotation", body, epsilon=epsilon, Omega=rate, axis=MOMENTS[axis])
        growth = float(ds.growth)
        if int(ds.verdict) == 0 and growth < 0.1:
            continue
        start = {f"gamma{i + 1}": 1.0 if i == axis else 1e-5 for i in range(3)} | {
            f"omega{axis + 1}": rate
        }
        t = np.linspace(0.0, 12.0 / max(growth, 0.1) + 20.0, 200)
        path = ask("trajectory", body, epsilon=epsilon, t=t, **start)
        away = 1.0 - float(path[f"nu{axis + 1}"].min())
        # the least and the middle moment may be close: then small forces let the body go far
        assert (away > 1e-4) == (int(ds.verdict) == 0), (body, epsilon, rate, axis, away)


def test_equal_moments_and_rest_without_field_are_left_open():
    assert int(ask("rotation", (1.0, 1.0, 1.5), epsilon=1.0, Omega=1.0, axis="A").verdict) == -1
    assert int(ask("rotation", (1.0, 1.2, 1.5), epsilon=0.0, Omega=0.0, axis="A").verdict) == -1
    free = [
        int(ask("rotation", (1.0, 1.2, 1.5), epsilon=0.0, Omega=0.3, axis=axis).verdict)
        for axis in MOMENTS
    ]
    assert free == [1, 0, 1]
    # Omega^2 = epsilon: rotations about all axes are permanent
    assert int(ask("rotation", (1.0, 1.2, 1.5), epsilon=1.0, Omega=1.0, axis="B").verdict) == -1


def test_equal_moments_are_unstable_where_deviations_grow_exponentially():
    """Omega = 0, A = B = 3/2, C = 1, axis A: tilts about the axis of B obey B x'' = epsilon (A - C) x."""
    ds = ask("rotation", (1.5, 1.5, 1.0), epsilon=[1.0, -1.0], Omega=0.0, axis="A")
    assert ds.verdict.values.tolist() == [0, -1]
    assert abs(float(ds.growth[0]) - np.sqrt(0.5 / 1.5)) <= float(ds.growth_error[0])
    assert (
        str(ds.isel(epsilon=0).survey.point()).splitlines()[2].startswith("why: growth = 0.57735")
    )


def test_no_body_has_such_moments():
    ds = ask("rotation", (1.0, 1.0, [2.0, 2.1]), epsilon=1.0, Omega=1.0)
    assert ds.status.values.tolist() == [0, 1] and ds.verdict.values[1] == -1


def draws(number, seed):
    """Critical motions: body, epsilon, sigma, sense, F3, and a state on each."""
    moments, epsilons, draw = bodies(40 * number, seed)
    found = []
    for body, epsilon in zip(moments, epsilons, strict=True):
        sigma, sense, nu = (
            float(draw.normal() * 2.0),
            int(draw.choice([-1, 1])),
            draw.normal(size=3),
        )
        square = epsilon * np.prod(1.0 + sigma * body)
        if square > 1e-2 and len(found) < number:
            nu /= np.linalg.norm(nu)
            w = sense * square**0.5 * nu / (1.0 + sigma * body)
            found.append((body, float(epsilon), sigma, sense, float(w @ (body * nu)), w, nu))
    return found


def test_critical_motions_close_and_have_these_integrals():
    for body, epsilon, sigma, sense, area, w, nu in draws(6, 5):
        ds = ask("critical", body, epsilon=epsilon, sigma=sigma, p_psi=area, sense=str(sense))
        energy = 0.5 * (w @ (body * w) + epsilon * nu @ (body * nu))
        second = ((body * w) ** 2).sum() - epsilon * (np.prod(body) / body) @ nu**2
        assert abs(float(ds.H) - energy) < 1e-12 * (1 + abs(energy)) and float(ds.H_error) < 1e-11
        assert abs(float(ds.F2) - second) < 1e-12 * (1 + abs(second)) and float(ds.F2_error) < 1e-11
        parts = {"A11": body[0], "A22": body[1], "A33": body[2]}
        parts |= {f"C{i}{i}": mp.mpf(epsilon) * mp.mpf(body[i - 1]) for i in (1, 2, 3)}
        with mp.workdps(30):
            end = truth.motion(parts, [*w, *nu], float(ds.period), 30)
        speed = np.linalg.norm(np.cross(nu, w))
        off = max(abs(float(x) - y) for x, y in zip(end[3:], nu, strict=True))
        assert off <= speed * float(ds.period_error) + 1e-10, (off, float(ds.period_error))


def multiplier(body, epsilon, w, nu, period):
    """The sum of the two multipliers that are not 1, by integration of the variational equations."""

    def slope(_t, z):
        w, nu, V = z[:3], z[3:6], z[6:].reshape(6, 6)
        torque = np.cross(body * w, w) + epsilon * np.cross(nu, body * nu)
        turn = np.vstack([
            np.cross(body * V[:3].T, w) + np.cross(body * w, V[:3].T)
            + epsilon * (np.cross(V[3:].T, body * nu) + np.cross(nu, body * V[3:].T))]) / body  # fmt: skip
        beside = np.cross(V[3:].T, w) + np.cross(nu, V[:3].T)
        return np.concatenate(
            [torque / body, np.cross(nu, w), np.vstack([turn.T, beside.T]).ravel()]
        )

    start = np.concatenate([w, nu, np.eye(6).ravel()])
    end = solve_ivp(slope, (0.0, period), start, method="DOP853", rtol=1e-11, atol=1e-12).y[6:, -1]
    return np.trace(end.reshape(6, 6)) - 4.0


def test_the_second_variation_tells_stable_from_unstable():
    seen = set()
    for body, epsilon, sigma, sense, area, w, nu in draws(60, 6):
        ds = ask("critical", body, epsilon=epsilon, sigma=sigma, p_psi=area, sense=str(sense))
        if float(ds.period) > 25.0:
            continue
        total = multiplier(body, epsilon, w, nu, float(ds.period))
        if abs(abs(total) - 2.0) > 1e-5 * (1.0 + abs(total)):
            assert int(ds.verdict) == (1 if abs(total) < 2.0 else 0), (
                body,
                epsilon,
                sigma,
                area,
                total,
            )
            seen.add(int(ds.verdict))
    assert seen == {0, 1}


def test_bars_of_critical_motions_against_fifty_digits():
    for body, epsilon, sigma, sense, area, *_ in draws(40, 7):
        ds = ask("critical", body, epsilon=epsilon, sigma=sigma, p_psi=area, sense=str(sense))
        with mp.workdps(50):
            Is, e, s, p = (
                [mp.mpf(float(A)) for A in body],
                mp.mpf(epsilon),
                mp.mpf(sigma),
                mp.mpf(area),
            )
            alpha = sense * mp.sqrt(e * mp.fprod(1 + s * A for A in Is))
            D = sorted(A / (1 + s * A) for A in Is)
            y = p / alpha
            one, two = (D[2] - D[0]) * (y - D[1]), (D[2] - D[1]) * (y - D[0])
            if y < D[1]:
                one, two = (D[2] - D[0]) * (D[1] - y), (D[1] - D[0]) * (D[2] - y)
            m = 1 - one / two
            exact = {
                "period": 4 * mp.ellipk(m) / (abs(alpha * s) * mp.sqrt(two)),
                "turn_rate": alpha,
            }
            for name, value in exact.items():
                assert abs(mp.mpf(float(ds[name])) - value) <= float(ds[f"{name}_error"]), (
                    name,
                    body,
                    sigma,
                )
                assert float(ds[f"{name}_error"]) < 1e-9 * abs(value)


def test_there_is_no_critical_motion_where_the_square_is_negative_or_the_area_too_large():
    points = ((-0.55, 1.2), (-0.3, 1.2), (-0.3, 90.0))
    found = [
        int(ask("critical", (2.0, 1.5, 1.0), epsilon=1.0, sigma=s, p_psi=p).status)
        for s, p in points
    ]
    assert found == [16, 0, 16]


@pytest.mark.slow
def test_trajectories_lie_within_their_bars_and_keep_the_integrals():
    moments, epsilons, draw = bodies(4, 8)
    for body, epsilon in zip(moments, epsilons, strict=True):
        w, nu = draw.normal(size=3), draw.normal(size=3)
        start = {f"omega{i + 1}": w[i] for i in range(3)} | {
            f"gamma{i + 1}": nu[i] for i in range(3)
        }
        t = [-3.0, 0.0, 20.0]
        ds = ask("trajectory", body, epsilon=epsilon, t=t, **start)
        parts = {"A11": body[0], "A22": body[1], "A33": body[2]}
        parts |= {f"C{i}{i}": mp.mpf(epsilon) * mp.mpf(body[i - 1]) for i in (1, 2, 3)}
        with mp.workdps(30):
            length = mp.sqrt(sum(mp.mpf(x) ** 2 for x in nu))
            state = [*(mp.mpf(x) for x in w), *(mp.mpf(x) / length for x in nu)]
            for at in range(3):
                end = truth.motion(parts, state, t[at], 30)
                for name, value in zip(("w1", "w2", "w3", "nu1", "nu2", "nu3"), end, strict=True):
                    assert abs(mp.mpf(float(ds[name][at])) - value) <= float(
                        ds[f"{name}_error"][at]
                    ), (name, at)
        for name in ("H_drift", "F2_drift", "F3_drift"):
            assert (abs(ds[name]) <= ds[f"{name}_error"]).all() and float(
                ds[f"{name}_error"].max()
            ) < 1e-6


def test_motions_from_far_ends_have_bars_or_a_status():
    draw = np.random.default_rng(9)
    ends = [0.0, 1e-300, -1e-17, 1.0, -30.0, 1e3]
    for _ in range(12):
        moments = draw.choice([3e-12, 1.0, 1e11]) * np.array(
            [1.0, 1.5, draw.choice([0.5, 0.5 + 1e-9, 2.5])]
        )
        start = {f"{kind}{i}": draw.choice(ends) for kind in ("omega", "gamma") for i in (1, 2, 3)}
        ds = ask(
            "trajectory",
            moments,
            epsilon=draw.choice(ends),
            t=float(draw.choice([0.0, 1e-9, -0.1])),
            **start,
        )
        known = int(ds.status) == 0
        assert all(
            bool(np.isfinite(ds[name])) == known for name in ("w1", "nu3", "nu3_error", "F2_drift")
        )
        assert known == any(start[f"gamma{i}"] for i in (1, 2, 3))


def test_a_body_with_an_axis_of_symmetry_moves_as_in_brun():
    A, C, epsilon, theta = 2.0, 1.0, 0.6, 1.1
    p_psi, p_phi, p_theta = 1.3, 0.9, 0.5
    t = np.linspace(0.0, 10.0, 5)
    one = survey.evaluate("brun", A=A, C=C, epsilon=epsilon, theta0=theta, p_theta0=p_theta, p_psi=p_psi, p_phi=p_phi,
                          t=t, motion="at_t").load()  # fmt: skip
    # phi = 0: p = theta', q = psi' sin theta, r = p_phi / C
    rate = (p_psi - p_phi * np.cos(theta)) / (A * np.sin(theta) ** 2)
    two = ask("trajectory", (A, A, C), epsilon=epsilon, t=t, omega1=p_theta / A, omega2=rate * np.sin(theta),
              omega3=p_phi / C, gamma1=0.0, gamma2=np.sin(theta), gamma3=np.cos(theta))  # fmt: skip
    assert (abs(one.u - two.nu3) <= one.u_error + two.nu3_error + 1e-13).all()


def test_the_picture_of_a_point_shows_that_point():
    rotation = ask("rotation", (2.0, 1.5, 1.0), epsilon=1.0, Omega=[0.5, 1.5])
    leaves, stays = (rotation.survey.trajectory(Omega=x) for x in (0.5, 1.5))
    assert float(leaves.nu1.min()) < 0.9 < 0.99 < float(stays.nu1.min())
    critical = ask("critical", (2.0, 1.5, 1.0), epsilon=1.0, sigma=[-0.3, 0.4], p_psi=1.0)
    path = critical.survey.trajectory(sigma=-0.3)
    period = float(critical.period[0])
    again = np.interp(period, path.t, path.nu1) if period < 40 else float(path.nu1[0])
    assert abs(again - float(path.nu1[0])) < 1e-3
