"""Curves of [boundaries] of periodic orbits: true curves lie within the position errors, and are found."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

import survey
from survey.errors import BadInput
from survey.measures.floquet import orbit_curves
from survey.measures.floquet.curves import CLASSES
from survey.request.workflow import check
from survey.sweep import boundaries

WORKFLOWS = Path(survey.__file__).parents[1] / "workflows"


def found(scene, **axes):
    """The dataset of the curves; of a pair of numbers the ends of an axis."""
    table = {
        k: {"start": v[0], "stop": v[1], "num": 3} if np.ndim(v) else v for k, v in axes.items()
    }
    return boundaries.find(check({"scene": scene, "axes": table, "boundaries": {}}))


def curves(ds, kind):
    """[slice of the points] of each curve of a class."""
    ends = np.cumsum(ds.curve_count.values)
    of = zip(ds.curve_class.values, ends, ds.curve_count.values, strict=True)
    return [slice(last - count, last) for code, last, count in of if code == CLASSES[kind]]


def assert_on(ds, part, distance, widths, gradient):
    """Points of a curve are as near to the zeros of `distance` as their errors say, and few errors
    are large.
    """
    errors = ds.curve_position_error.values[part]
    names = [
        n
        for n in ds
        if n[:5] == "curve" and ds[n].attrs.get("ancillary_variables") == "curve_position_error"
    ]
    a, b = (ds[name].values[part] for name in names)
    slope = np.hypot(*(np.array(gradient(a, b)) * np.array(widths)[:, None]))
    off = abs(distance(a, b)) / slope
    assert (off <= errors + 1e-16).all(), (off / errors).max()
    assert np.median(errors) < 1e-11


def cycles(t, x, p, out):
    """r' = r (m + b r^2 - r^4), theta' = 1.5: a fold of limit cycles at m = -b^2 / 4, b > 0."""
    r2 = x[0] ** 2 + x[1] ** 2
    grow = p[0] + p[1] * r2 - r2**2
    out[0], out[1] = grow * x[0] - 1.5 * x[1], 1.5 * x[0] + grow * x[1]


@pytest.mark.slow
def test_a_fold_of_limit_cycles_in_closed_form():
    scene = survey.orbit(
        cycles,
        states=("x", "y"),
        parameters=("m", "b"),
        period=None,
        start=(1.0, 0.0, 4.2),
        continuation=("m", -0.6, 0.5),
    )
    ds = found(scene, m=(-0.6, 0.5), b=(0.3, 1.4), branch=1)
    [fold] = curves(ds, "plus_one")
    assert set(ds.curve_class.values) == {CLASSES["plus_one"]}
    assert_on(
        ds, fold, lambda m, b: m + b * b / 4, (1.1, 1.1), lambda m, b: (np.ones_like(m), b / 2)
    )
    b = ds.curve_b.values[fold]
    assert {b.min(), b.max()} == {0.3, 1.4}  # from border to border
    assert (ds.curve_angle.values[fold] == 0).all() and (ds.curve_outside.values[fold] == 0).all()


@pytest.mark.parametrize(
    "eps, a",
    [
        *(pytest.param(*at, marks=pytest.mark.slow) for at in ((0.897, 3.718), (0.711, 3.805))),
        (0.564, 2.929),
    ],
)
def test_folds_of_limit_cycles_that_are_no_circles(eps, a):
    """On one side of a fold there are two cycles, on the other side none."""

    def lienard(t, x, p, out):
        out[0], out[1] = x[1], -x[0] - p[0] * (x[0] ** 4 - p[1] * x[0] ** 2 + p[2]) * x[1]

    scene = survey.orbit(
        lienard, states=("x", "v"), period=None, parameters=("eps", "a", "b"), start=(2.0, 0.0, 6.3),
        continuation=("b", 0.05, 2.0),
    )  # fmt: skip
    found = survey.edge(scene, along="b", eps=eps, a=a)
    assert found.sizes["place"] == 1
    b = float(found.edge[0]) + 1e-6 * np.array([-1.0, 1.0])
    assert survey.evaluate(scene, eps=eps, a=a, b=b).orbits.values.tolist() == [2, 0]


def test_period_doubling_in_closed_form():
    """x' = R(t) diag(a, -1) R(-t) x, R turns by half a circle in a period: the multipliers are -e^a
    and -1 / e.
    """

    def f(t, x, p, out):
        c, s = math.cos(math.pi * t), math.sin(math.pi * t)
        one, two = c * x[0] + s * x[1], c * x[1] - s * x[0]
        one, two = (p[0] - p[1] ** 2) * one - one**3, -two
        out[0], out[1] = c * one - s * two - math.pi * x[1], s * one + c * two + math.pi * x[0]

    scene = survey.orbit(f, states=("x", "y"), parameters=("a", "b"), period=1.0, start=(0.0, 0.0))
    ds = found(scene, a=(-0.2, 0.7), b=(0.0, 0.9))
    [curve] = curves(ds, "minus_one")
    assert set(ds.curve_class.values) == {CLASSES["minus_one"]}
    assert_on(ds, curve, lambda a, b: a - b * b, (0.9, 0.9), lambda a, b: (np.ones_like(a), -2 * b))
    assert ds.curve_b.values[curve].min() == 0.0 and ds.curve_a.values[curve].max() == 0.7
    assert abs(ds.curve_angle.values[curve] - math.pi).max() < 1e-15


@pytest.mark.slow
def test_complex_pairs_in_closed_form():
    """A limit cycle of angular velocity w, and beside it z' = (a - b^2 + i v) z: multipliers exp((a
    - b^2 + i v) T).
    """
    w, v = 2.0, 0.6

    def f(t, x, p, out):
        rest, grow = 1 - x[0] ** 2 - x[1] ** 2, p[0] - p[1] ** 2
        out[0], out[1] = rest * x[0] - w * x[1], w * x[0] + rest * x[1]
        out[2] = grow * x[2] - v * x[3] + 0.1 * x[0] * x[2] ** 2
        out[3] = v * x[2] + grow * x[3] - x[3] * (x[2] ** 2 + x[3] ** 2)

    scene = survey.orbit(
        f,
        states=("x", "y", "u", "v"),
        parameters=("a", "b"),
        period=None,
        start=(1.0, 0, 0, 0, 3.1),
    )
    ds = found(scene, a=(-0.2, 0.7), b=(0.05, 0.8))
    [curve] = curves(ds, "neimark_sacker")
    assert_on(
        ds, curve, lambda a, b: a - b * b, (0.9, 0.75), lambda a, b: (np.ones_like(a), -2 * b)
    )
    angle, bar = ds.curve_angle.values[curve], ds.curve_angle_error.values[curve]
    assert (abs(angle - v * 2 * math.pi / w) <= bar).all() and (bar < 1e-10).all()
    assert (ds.curve_outside.values[curve] == 0).all()


@pytest.mark.slow
def test_a_pitchfork_of_a_symmetric_system():
    """x = 0 loses stability where a = b^2, and two orbits, each other's mirror images, branch off."""

    def f(t, x, p, out):
        out[0] = (p[0] - p[1] ** 2) * x[0] - x[0] ** 3 * (2 + math.cos(4 * math.pi * t))

    scene = survey.orbit(f, states="x", parameters=("a", "b"), period=1.0, start=0.0)
    ds = found(scene, a=(-0.2, 0.7), b=(0.0, 0.9))
    [curve] = curves(ds, "plus_one")
    assert_on(ds, curve, lambda a, b: a - b * b, (0.9, 0.9), lambda a, b: (np.ones_like(a), -2 * b))
    ds = survey.edge(scene, along="a", a=(0.0, 0.6), b=0.5)
    assert abs(float(ds.edge[0]) - 0.25) <= float(ds.edge_error[0]) < 1e-12 and ds.edge.size == 1


def shot(f, jacobian, y, T):
    """x(T) - x(0) and M of a forced oscillator by SciPy."""

    def rhs(t, y):
        return np.concatenate([f(t, y[:2]), (jacobian(t, y[:2]) @ y[2:].reshape(2, 2)).ravel()])

    z = np.concatenate([y, np.eye(2).ravel()])
    z = solve_ivp(rhs, (0.0, T), z, "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    return z[:2] - y, z[2:].reshape(2, 2)


def van_der_pol(omega, F, mu):
    def f(t, x):
        return np.array([x[1], mu * (1 - x[0] ** 2) * x[1] - x[0] + mu * F * math.cos(omega * t)])

    def jacobian(t, x):
        return np.array([[0.0, 1.0], [-2 * mu * x[0] * x[1] - 1, mu * (1 - x[0] ** 2)]])

    return f, jacobian


@pytest.mark.slow
def test_entrainment_against_scipy():
    """Folds, complex pairs, and the angle of these, where SciPy's integrator puts them."""
    ds = found(str(WORKFLOWS / "entrainment.py"), omega=(0.8, 1.1), F=(0.5, 1.3), mu=0.5, branch=-1)
    assert set(ds.curve_class.values) == {CLASSES["plus_one"], CLASSES["neimark_sacker"]}
    for kind in ("plus_one", "neimark_sacker"):
        tried = 0
        for part in curves(ds, kind):
            places = np.arange(part.start, part.stop)
            for k in places[:: max(1, places.size // 3)]:
                omega, F = float(ds.curve_omega[k]), float(ds.curve_F[k])

                def equations(u, omega=omega, kind=kind):
                    off, M = shot(*van_der_pol(omega, u[2], 0.5), u[:2], 2 * math.pi / omega)
                    det = (
                        np.linalg.det(M) - 1
                        if kind == "neimark_sacker"
                        else np.linalg.det(M - np.eye(2))
                    )
                    return [*off, det]

                near = {"F": F + np.array([-1e-3, 1e-3]), "branch": [1, 2, 3]}
                at = survey.evaluate(str(WORKFLOWS / "entrainment.py"), omega=omega, mu=0.5, **near)
                starts = at.x0.values[at.status.values == 0]
                roots = [fsolve(equations, [*x, F], xtol=1e-12, full_output=True) for x in starts]
                off = min(abs(u[2] - F) for u, _info, good, _why in roots if good == 1)
                assert off < 1e-9, (kind, omega, F, off)
                tried += 1
        assert tried >= 4
    # a complex pair meets at 1 where its curve touches that of the folds
    for part in curves(ds, "neimark_sacker"):
        ends = np.array([ds.curve_angle.values[part][k] for k in (0, -1)])
        if ends.min() < 0.05:
            k = (part.start, part.stop - 1)[int(ends.argmin())]
            x = np.stack([ds.curve_omega - ds.curve_omega[k], ds.curve_F - ds.curve_F[k]])
            own = np.concatenate([np.arange(p.start, p.stop) for p in curves(ds, "plus_one")])
            assert np.hypot(*x[:, own]).min() < 0.02


@pytest.mark.slow
def test_the_cusp_and_the_number_of_orbits():
    """Between the folds of Duffing's oscillator there are three orbits, elsewhere one; the folds
    meet in a cusp.
    """
    ds = found(str(WORKFLOWS / "duffing.py"), omega=(0.9, 3.0), F=(0.02, 1.5), branch=2)
    [fold] = curves(ds, "plus_one")
    omega, F = ds.curve_omega.values[fold], ds.curve_F.values[fold]
    assert 170 > F.argmin() > 5 and (np.diff(np.sign(np.diff(F))) != 0).sum() == 1
    for level in (0.2, 0.6, 1.1):
        at = np.flatnonzero(np.diff(np.sign(F - level)))
        edges = [np.interp(level, *sorted_pair(F[k : k + 2], omega[k : k + 2])) for k in at]
        tried = np.array([e + side * 0.004 for e in edges for side in (-1, 1)])
        inside = [sum(e < w for e in edges) % 2 == 1 for w in tried]
        number = survey.evaluate(
            str(WORKFLOWS / "duffing.py"), omega=np.sort(tried), F=level, variables=["orbits"]
        )
        assert number.orbits.values.tolist() == [
            3 if yes else 1 for _w, yes in sorted(zip(tried, inside, strict=True))
        ]


@pytest.mark.slow
def test_without_damping():
    """A conservative oscillator: one curve of folds, though v = 0 on it; det M = 1 everywhere is no
    complex pair.
    """

    def f(t, x, p, out):
        out[0], out[1] = x[1], -x[0] - x[0] ** 3 + p[0] * math.cos(p[1] * t)

    given = {"period": lambda p: 2 * math.pi / p[1], "start": (0.0, 0.0)}
    ds = found(
        survey.orbit(f, states=("x", "v"), parameters=("F", "w"), **given),
        F=(0.1, 0.5),
        w=(1.2, 2.0),
    )
    assert ds.curve_class.values.tolist() == [CLASSES["plus_one"]]


def sorted_pair(x, y):
    order = np.argsort(x)
    return x[order], y[order]


@pytest.mark.slow
def test_a_map_without_the_parameter_of_the_continuation():
    """From each point of the fold of Duffing's oscillator, that in the frequency is back."""
    scene = str(WORKFLOWS / "duffing.py")
    ds = found(scene, F=(0.05, 0.4), zeta=(0.01, 0.15), omega=1.5)
    assert (
        ds.curve_class.values.tolist() == [CLASSES["plus_one"]]
        and ds.curve_position_error.max() < 1e-12
    )
    F, zeta = ds.curve_F.values, ds.curve_zeta.values
    assert {F.min(), F.max()} == {0.05, 0.4}
    for k in (0, F.size // 2, -1):
        back = survey.edge(scene, along="omega", omega=(1.2, 1.8), F=F[k], zeta=zeta[k])
        assert abs(back.edge.values - 1.5).min() < 1e-10


def narrow_cusp(t, x, p, out):
    """x' = l + h x - x^3, three orbits for h > 3 (l / 2)^(2 / 3): within 0.024 of q = 0.43 here."""
    out[0] = p[0] + (0.03 - 20 * (p[1] - 0.43) ** 2) * x[0] - x[0] ** 3


NARROW_CUSP = survey.orbit(
    narrow_cusp,
    states="x",
    parameters=("l", "q"),
    period=1.0,
    start=(0.0,),
    continuation=("l", -0.5, 0.5),
)


def test_a_line_meets_orbits_that_begin_and_end_on_it():
    """Between two of the values of q at which the continuation along l had been asked for orbits."""
    found = survey.edge(NARROW_CUSP, along="q", q=(0.0, 1.0), l=1e-3)
    half = math.sqrt((0.03 - 3 * (1e-3 / 2) ** (2 / 3)) / 20)
    assert found.edge_class.values.tolist() == [CLASSES["plus_one"]] * 2
    assert (abs(found.edge.values - [0.43 - half, 0.43 + half]) <= found.edge_error.values).all()
    assert found.edge_error.max() < 1e-9 and "complete" not in found.attrs


def test_a_line_says_where_numbers_of_orbits_have_no_fold_between_them(monkeypatch):
    monkeypatch.setattr(orbit_curves, "KINDS", ())
    found = survey.edge(NARROW_CUSP, along="q", q=(0.0, 1.0), l=1e-3)
    assert found.edge.size == 0 and found.attrs["complete"] == 0


def crossed(t, x, p, out):
    """The orbit x = 0, of the multiplier exp(2 pi (l + 0.7 m / 1.3)), exchanges its stability with another."""
    out[0] = x[0] * (p[0] + 0.4 * math.cos(t) + 0.7 * x[1] - x[0])
    out[1] = p[1] + math.cos(t) - 1.3 * x[1]


@pytest.mark.parametrize("start", [(0.0, 0.5), (0.6, 0.1)])
@pytest.mark.parametrize(
    "continuation", [None, ("l", -0.9, 0.8), pytest.param(("m", -1.0, 1.0), marks=pytest.mark.slow)]
)
def test_a_line_shows_where_curves_of_orbits_cross(start, continuation):
    """There is no fold: on one curve each side has an orbit."""
    scene = survey.orbit(
        crossed,
        states=("x", "y"),
        parameters=("l", "m"),
        period=2 * math.pi,
        start=start,
        continuation=continuation,
    )
    found = survey.edge(scene, along="l", l=(-0.8, 0.7), m=0.4)
    assert found.edge_class.values.tolist() == [1]  # once
    off = abs(float(found.edge[0]) + 0.7 * 0.4 / 1.3)
    assert off <= found.edge_error[0] < 1e-6


def test_where_there_are_none():
    scene = str(WORKFLOWS / "duffing.py")
    with pytest.raises(BadInput, match="let `branch` be a number"):
        found(scene, omega=(1.0, 1.2), F=(0.1, 0.2), branch=(1, 2))

    def f(t, x, p, out):
        out[0] = (p[1] - 0.3) * x[0] * (1.0 if p[0] > 0.5 else 2.0) - x[0] ** 3

    branches = survey.orbit(f, states="x", parameters=("a", "b"), period=2 * math.pi, start=0.0)
    assert (survey.evaluate(branches, a=[0.2, 0.8], b=1.0).status == 0).all()
    with pytest.raises(BadInput, match="a branch depends on t, a state or an axis of the map"):
        found(branches, a=(0.1, 0.9), b=(0.0, 1.0))
