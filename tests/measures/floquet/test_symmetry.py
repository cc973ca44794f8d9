"""Symmetric periodic orbits of conservative systems: against closed forms, multiprecision and SciPy."""

import math
import sys
from pathlib import Path

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import survey
from survey.measures.floquet import continuation
from survey.measures.floquet.multipliers import PLUS_ONE
from survey.request.workflow import check
from survey.sweep import boundaries

FOLDER = Path(__file__).parents[3] / "workflows"
sys.path.insert(0, str(FOLDER))
import lyapunov  # noqa: E402

MU = 0.01215058560962404  # of the Earth and the Moon


def beam(t, x, p, out):
    """x'' = -x - x^3, and z'' = -(w + b x^2) z beside it."""
    out[0], out[1] = x[1], -x[0] - x[0] ** 3
    out[2], out[3] = x[3], -(p[1] + p[2] * x[0] ** 2) * x[2]


def beams(**more):
    given = {"reversed": ("v", "u"), "held": "x", "transverse": ("z", "u")} | more
    return survey.orbit(
        beam, states=("x", "v", "z", "u"), period=None, parameters=("A", "w", "b"),
        start=lambda p: (p[0], 0.0, 0.0, 0.0, 2 * math.pi / math.sqrt(1 + 0.75 * p[0] ** 2)), **given,
    )  # fmt: skip


@pytest.mark.parametrize("method", ["auto", "dop853"])
@pytest.mark.parametrize("A, w", [(0.3, 0.7), (1.5, 0.2), (2.5, 0.3), (0.8, -0.5)])
def test_jacobis_and_lames_functions(method, A, w):
    """x = A cn(s t, m), of the period 4 K(m) / s. With b = 1 two solutions z have the product P =
    x^2 + 2 (1 - w), and are the square root of P times e^(+-i k int dt / P), k^2 = P P'' / 2 - P'^2
    / 4 + (w + x^2) P^2, a constant.
    """
    ds = survey.evaluate(beams(), A=A, w=w, b=1.0, method=method)
    with mpmath.workdps(25):
        a, c = mpmath.mpf(A), 2 * (1 - mpmath.mpf(w))
        speed, m = mpmath.sqrt(1 + a**2), a**2 / (2 * (1 + a**2))
        T = 4 * mpmath.ellipk(m) / speed
        k = mpmath.sqrt(mpmath.mpc(c * (a**2 + a**4 / 2 + w * c)))
        quarter = mpmath.quad(
            lambda t: 1 / ((a * mpmath.ellipfun("cn", speed * t, m=m)) ** 2 + c), [0, T / 8, T / 4]
        )
        half = mpmath.cos(4 * k * quarter).real
        root = mpmath.sqrt(mpmath.mpc(half) ** 2 - 1)
        exact = sorted([half + root, half - root], key=lambda one: (-abs(one), mpmath.arg(one)))
    assert int(ds.status) == 0 and ds.x0.values.tolist() == [A, 0.0, 0.0, 0.0]
    assert abs(float(ds.period) - T) <= float(ds.period_error) < 1e-9
    found = ds.multiplier_re.values + 1j * ds.multiplier_im.values
    for one, other, bar in zip(found, exact, ds.multiplier_re_error.values, strict=True):
        # pairs on the circle have no order but that of rounding
        assert min(abs(one - complex(other)), abs(one - complex(other.conjugate()))) <= bar + 1e-17
        assert bar < 1e-6
    assert int(ds.verdict) == (abs(half) < 1)
    if method == "auto":
        assert (ds.multiplier_re_error < 1e-10).all() and float(ds.period_error) < 1e-12


def rhs(t, y):
    """The planar motion from (x, v), then dX/dx(0) of all six states by columns, at MU; written anew."""
    s, D = y[:6], y[6:].reshape(6, 6)
    one, two = s[0] + MU, s[0] + MU - 1
    r, q = math.hypot(one, s[1]), math.hypot(two, s[1])
    a, b = (1 - MU) / r**3, MU / q**3
    c, d = 3 * (1 - MU) / r**5, 3 * MU / q**5
    A = np.zeros((6, 6))
    A[:3, 3:] = np.eye(3)
    A[3, 4], A[4, 3] = 2.0, -2.0
    A[3, 0] = 1 - a - b + c * one**2 + d * two**2
    A[4, 1] = 1 - a - b + (c + d) * s[1] ** 2
    A[3, 1] = A[4, 0] = (c * one + d * two) * s[1]
    A[5, 2] = -a - b
    forces = [2 * s[4] + s[0] - a * one - b * two, -2 * s[3] + s[1] * (1 - a - b), 0.0]
    return np.concatenate([s[3:], forces, (A @ D).ravel()])


def crossing(x, speed):
    """The half period, the state and D where the motion from (x, 0, 0, 0, speed, 0) crosses the
    axis again.
    """

    def axis(t, y):
        return y[1] if t > 0.1 else -1.0

    axis.terminal = True
    start = np.concatenate([[x, 0, 0, 0, speed, 0], np.eye(6).ravel()])
    end = solve_ivp(rhs, (0, 10), start, "DOP853", rtol=1e-12, atol=1e-13, events=axis)
    y = end.y_events[0][0]
    return end.t_events[0][0], y[:6], y[6:].reshape(6, 6)


def symmetric(x, near):
    """As `crossing`, and the speed, of the orbit that crosses at right angles."""
    speed = near
    for _ in range(12):
        half, y, D = crossing(x, speed)
        slope = D[3, 4] - rhs(0, np.concatenate([y, np.eye(6).ravel()]))[3] * D[1, 4] / y[4]
        speed -= y[3] / slope
        if abs(y[3]) < 1e-12:
            break
    return half, y, D, speed


@pytest.mark.slow
def test_halo_orbits_branch_off_where_scipy_says():
    """There z(0) alone comes back to v_z = 0 at the half period. The verdict changes within 1e-8 of it."""
    gamma = lyapunov.distance(MU)
    speed = -0.1337

    def off(a):
        return symmetric(1 - MU - gamma + a * gamma, speed)[2][5, 2]

    a = brentq(off, 0.115, 0.122, xtol=1e-12)
    scene = str(FOLDER / "lyapunov.py")
    edge = survey.edge(scene, along="a", mu=MU, a=(0.05, 0.4))
    assert edge.edge_class.attrs["flag_meanings"].split()[
        0
    ] == "plus_one" and edge.edge_class.values.tolist() == [1]
    assert abs(float(edge.edge[0]) - a) < 1e-9 and float(edge.edge_error[0]) < 1e-9
    across = survey.edge(scene, along="mu", a=a, mu=(0.01, 0.015))
    assert abs(float(across.edge[0]) - MU) < 1e-9 and float(across.edge_error[0]) < 1e-9
    ds = survey.evaluate(scene, mu=MU, a=a + np.array([-1e-8, 1e-8]))
    assert ds.verdict.values.tolist() == [1, 0] and ds.crossing.values.tolist() == [1, 1]
    x, v = ds.x0.values[0, 0], ds.x0.values[0, 4]
    half, _y, _D, known = symmetric(x, speed)
    assert abs(v - known) < 1e-10 and abs(float(ds.period[0]) - 2 * half) < 1e-9
    jacobi = x * x + 2 * (1 - MU) / (x + MU) + 2 * MU / abs(x - 1 + MU) - v * v
    assert abs(jacobi - 3.1743) < 1e-3  # as is known of halo orbits


def test_all_multipliers_and_the_monodromy_matrix():
    """Without TRANSVERSE, four multipliers are judged; the two of the family are 1."""
    scene = survey.orbit(
        lyapunov.f, states=lyapunov.STATES, period=None, parameters=("mu", "a"), start=lyapunov.START,
        reversed=lyapunov.REVERSED, held="x",
    )  # fmt: skip
    ds = survey.evaluate(
        scene,
        mu=MU,
        a=0.08,
        variables=["x0", "monodromy", "multiplier_re", "multiplier_im", "verdict"],
    )
    _half, _y, D, _speed = symmetric(float(ds.x0[0]), float(ds.x0[4]))
    R = np.diag([1, -1, 1, -1, 1, -1])
    M = R @ np.linalg.inv(D) @ R @ D
    assert (abs(ds.monodromy.values - M) <= ds.monodromy_error.values + 1e-8 * abs(M).max()).all()
    exact = np.linalg.eigvals(M)
    exact = exact[np.argsort(abs(exact - 1))]
    planar, vertical = (
        exact[abs(exact) > 2].real,
        exact[(abs(abs(exact) - 1) < 1e-3) & (abs(exact.imag) > 1e-2)],
    )
    found = ds.multiplier_re.values + 1j * ds.multiplier_im.values
    assert int(ds.verdict) == 0 and ds.sizes["multiplier"] == 4
    assert abs(found[0] - planar[0]) <= float(ds.multiplier_re_error[0]) + 1e-6 * planar[0]
    assert abs(np.sort(found[1:3].imag) - np.sort(vertical.imag)).max() < 1e-7


def test_the_trajectory_against_scipy():
    ds = survey.evaluate(str(FOLDER / "lyapunov.py"), mu=MU, a=0.3)
    motion = ds.survey.trajectory()
    start = np.concatenate([ds.x0.values, np.eye(6).ravel()])
    t = motion.t.values
    exact = solve_ivp(
        rhs, (0, t[-1]), start, "DOP853", t_eval=t[:: len(t) // 7], rtol=1e-12, atol=1e-13
    )
    for k, name in enumerate(lyapunov.STATES):
        off = abs(motion[name].values[:: len(t) // 7] - exact.y[k])
        # SciPy's own errors grow by the multiplier, some 1500
        assert (off <= motion[f"{name}_error"].values[:: len(t) // 7] + 1e-9).all()


def test_continuation_and_a_start_that_knows_small_orbits_alone():
    scene, a = str(FOLDER / "lyapunov.py"), [0.05, 0.3, 0.62, 0.7]
    whole = survey.evaluate(scene, mu=[0.01, MU], a=a)
    assert (whole.status == 0).all() and (whole.orbits == 1).all()
    assert whole.verdict.sel(mu=MU).values.tolist() == [1, 0, 0, 1]
    one = survey.evaluate(scene, mu=MU, a=0.62)
    for name in whole.data_vars:
        assert np.array_equal(whole[name].isel(mu=1, a=2).values, one[name].values, equal_nan=True)


@pytest.mark.parametrize(
    "more, words",
    [
        ({"reversed": ("v", "w")}, "reversed names 'w'; name states, each once: x, v, z, u"),
        ({"reversed": ("v",)}, "reversed names 1 of 4 states; half of all must change their sign"),
        ({"reversed": None}, "transverse is for orbits with reversed; name these states too"),
        ({"held": "v"}, "held = 'v': name one of x, whose value at t = 0 is that of start"),
        ({"transverse": ("z",)}, "transverse: half of these states must be reversed"),
        ({"reversed": ("x", "z"), "held": "v"}, "start has x = 0.5"),
    ],
)
def test_one_line_for_what_is_wrong(more, words):
    with pytest.raises(survey.BadInput) as error:
        survey.evaluate(beams(**more), A=0.5, w=1.0, b=0.5)
    assert words in str(error.value) and "\n" not in str(error.value)


def test_what_f_contradicts():
    def coupled(t, x, p, out):
        beam(t, x, p, out)
        out[1] += p[2] * x[2]

    def damped(t, x, p, out):
        beam(t, x, p, out)
        out[1] -= p[2] * x[1]

    for f, words in (
        (coupled, "transverse: where these states are 0, f couples them to the others"),
        (damped, "reversed: the derivative of v is not what time reversed would give"),
    ):
        scene = survey.orbit(
            f, states=("x", "v", "z", "u"), period=None, parameters=("A", "w", "b"),
            start=lambda p: (p[0], 0.0, 0.0, 0.0, 6.0), reversed=("v", "u"), held="x", transverse=("z", "u"),
        )  # fmt: skip
        with pytest.raises(survey.BadInput, match=words):
            survey.evaluate(scene, A=0.5, w=1.0, b=0.1)


def test_an_orbit_on_a_curve_has_the_held_state_of_its_start(monkeypatch):
    """Between their points curves are cubics, which miss it by 1e-11: the orbit would be a neighbour's."""
    monkeypatch.setattr("survey.measures.floquet.continuation.LONGEST", 0.5)
    scene = beams(continuation=("A", 0.1, 3.0))
    exact = 4 * float(mpmath.ellipk(0.9**2 / (2 * (1 + 0.9**2)))) / math.sqrt(1 + 0.9**2)
    for rtol in (1e-8, 1e-10):
        ds = survey.evaluate(scene, A=0.9, w=0.7, b=1.0, rtol=rtol, branch=1)
        assert ds.x0.values.tolist() == [0.9, 0.0, 0.0, 0.0]
        assert abs(float(ds.period) - exact) <= float(ds.period_error) + 1e-15 < 1e-9


@pytest.mark.parametrize(
    "more",
    [pytest.param({}, marks=pytest.mark.slow), {"continuation": ("A", 0.1, 3.0)}],
    ids=["start", "continuation"],
)
def test_curves_are_the_band_edges_of_lames_equation(monkeypatch, more):
    """With b = 1, z is dn, cn or sn of x = A cn where w = -A^2 / 2, 1 or 1 + A^2 / 2, and there
    alone l = 1.
    """
    monkeypatch.setattr("survey.measures.floquet.curves.LINES_OF_ORBITS", 33)
    axes = {
        "A": {"start": 0.3, "stop": 2.5, "num": 3},
        "w": {"start": -2.0, "stop": 4.0, "num": 3},
        "b": 1.0,
    }
    ds = boundaries.find(check({"scene": beams(**more), "axes": axes, "boundaries": {}}))
    assert "curves_unexplained" not in ds.attrs and ds.curve_class.values.tolist() == [PLUS_ONE] * 3
    A, w, found = ds.curve_A.values, ds.curve_w.values, set()
    for last, count in zip(np.cumsum(ds.curve_count.values), ds.curve_count.values, strict=True):
        a, error = A[last - count : last], ds.curve_position_error.values[last - count : last]
        exact = {"dn": (-(a**2) / 2, a), "cn": (1.0 + 0.0 * a, 0.0 * a), "sn": (1.0 + a**2 / 2, a)}
        size = {name: np.hypot(6.0, 2.2 * slope) for name, (_, slope) in exact.items()}
        off = {
            name: abs(w[last - count : last] - at) / size[name] for name, (at, _) in exact.items()
        }
        name = min(off, key=lambda name: off[name].max())
        assert (off[name] <= error).all() and np.median(error) < 1e-11
        found.add(name)
        # from border to border: dn leaves at w = -2, sn at w = 4
        assert a.min() == 0.3 and abs(a.max() - {"dn": 2.0, "cn": 2.5, "sn": 6**0.5}[name]) < 1e-9
    assert found == {"dn", "cn", "sn"}


def test_maps_without_the_amplitude_have_no_curves():
    axes = {
        "w": {"start": 0.5, "stop": 1.5, "num": 3},
        "b": {"start": 0.5, "stop": 1.5, "num": 3},
        "A": 1.0,
    }
    with pytest.raises(
        survey.BadInput, match="on maps of A, the parameter of CONTINUATION, and another one"
    ):
        check({"scene": beams(continuation=("A", 0.1, 3.0)), "axes": axes, "boundaries": {}})


def test_a_map_without_orbits_has_no_curves():
    """x'' = b x, b > 0, has no periodic solutions."""

    def f(t, x, p, out):
        out[0], out[1], out[2], out[3] = x[1], p[1] * x[0], x[3], -x[2]

    scene = survey.orbit(
        f, states=("x", "v", "z", "u"), period=None, parameters=("A", "b"), held="x", reversed=("v", "u"),
        start=lambda p: (p[0], 0.0, 0.0, 0.0, 5.0), transverse=("z", "u"), continuation=("A", 0.1, 2.0),
    )  # fmt: skip
    axes = {"A": {"start": 0.1, "stop": 1.0, "num": 3}, "b": {"start": 0.1, "stop": 1.0, "num": 3}}
    ds = boundaries.find(check({"scene": scene, "axes": axes, "boundaries": {}}))
    assert ds.sizes["curve"] == 0
    assert survey.edge(scene, along="A", b=0.5, A=(0.1, 1.0)).place.size == 0


def test_a_parameter_that_only_chooses_the_orbit_does_not_change_motions():
    """f of `beam` depends on w and b, and not on the amplitude A."""
    equation, x = beams().equation, np.full((3, 4), 0.4)
    points = np.tile([0.5, 0.7, 1.0], (3, 1))
    others = points + 0.1 * np.eye(3)
    assert continuation._flow_alike(equation, points, others, x).tolist() == [True, False, False]
    end, other = (
        continuation.rough_flow(equation, p, x, np.full(3, 2.0), derived=False)[0]
        for p in (points, others)
    )
    assert (end == other).all(axis=1).tolist() == [True, False, False]
