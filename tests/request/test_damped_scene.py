"""Damped Hill equations against independent integrations, exact solutions, and Hill's equation itself."""

from math import cos, pi

import numpy as np
import pytest

import survey
from survey.errors import BadInput


def z(u, p):
    return p[0] - 2 * p[1] * cos(2 * u)


def scene(**keywords):
    return survey.hill(z, period=pi, even=True, parameters=("a", "q"), **keywords)


def by_scipy(a, q, c):
    """(trace, log of the spectral radius) of the monodromy of y'' + 2 c y' + z y = 0."""
    integrate = pytest.importorskip("scipy.integrate")

    def f(u, y):
        return [y[1], -2 * c * y[1] - (a - 2 * q * np.cos(2 * u)) * y[0]]

    columns = [
        integrate.solve_ivp(f, (0, pi), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        for start in ([1, 0], [0, 1])
    ]
    matrix = np.array(columns).T
    return np.trace(matrix), np.log(abs(np.linalg.eigvals(matrix)).max())


POINTS = [
    (1.0, 0.3, 0.05),
    (1.0, 0.3, 0.2),
    (2.5, 0.4, 0.1),
    (0.9, 0.5, -0.1),
    (4.1, 2.0, 0.01),
    (-0.3, 0.2, 0.3),
]


@pytest.mark.parametrize(
    "point", [*POINTS[:2], *(pytest.param(point, marks=pytest.mark.slow) for point in POINTS[2:])]
)
def test_trace_exponent_and_verdict_are_those_of_the_damped_equation(point):
    a, q, c = point
    trace, growth = by_scipy(a, q, c)
    ds = survey.evaluate(scene(damping="c"), a=a, q=q, c=c)
    assert abs(float(ds.discriminant) - trace) <= float(ds.discriminant_error) + 1e-9
    assert abs(float(ds.exponent) - growth) <= float(ds.exponent_error) + 1e-9
    assert int(ds.verdict) == (1 if growth < 0 else 0) and float(ds.exponent_error) < 1e-8
    same = survey.evaluate(scene(damping=c), a=a, q=q)
    assert abs(float(same.exponent) - float(ds.exponent)) <= float(ds.exponent_error) + float(
        same.exponent_error
    )
    assert int(same.verdict) == int(ds.verdict)


def test_constant_coefficients_are_exact():
    """y'' + 2 c y' + s y = 0: the exponent per period is -c T, or -(c - sqrt(c^2 - s)) T where c^2 > s."""
    own = survey.hill(lambda u, p: p[0], period=1.0, even=True, parameters="s", damping="c")
    c = np.array([0.1, 0.5, 2.0, 3.0])
    ds = survey.evaluate(own, s=2.0, c=c)
    exact = np.where(c * c < 2.0, -c, -(c - np.sqrt(np.maximum(c * c - 2.0, 0.0))))
    assert (abs(ds.exponent - exact) <= ds.exponent_error + 4e-16).all() and (
        ds.exponent_error < 1e-9
    ).all()
    assert (ds.verdict == 1).all()


def test_a_map_without_damping_keeps_its_verdicts():
    axes = {"a": np.linspace(-1.0, 4.0, 15), "q": np.linspace(0.0, 2.0, 12)}
    plain = survey.evaluate(scene(), **axes)
    damped = survey.evaluate(scene(damping="c"), c=[0.0, 0.02, 0.1], **axes)
    assert (damped.verdict.sel(c=0.0) == plain.verdict).all()
    stable = (damped.verdict == 1).sum(["a", "q"]).values
    assert stable[0] <= stable[1] <= stable[2]  # tongues recede
    gains = (damped.verdict.sel(c=0.1) == 1) & (plain.verdict == 0)
    assert gains.any() and not ((damped.verdict.sel(c=0.1) == 0) & (plain.verdict == 1)).any()


@pytest.mark.slow
def test_from_a_file_and_on_worker_processes(tmp_path):
    (tmp_path / "z.py").write_text(
        "from math import cos, pi\nPARAMETERS = ('a', 'q')\nPERIOD = pi\nEVEN = True\nDAMPING = 0.05\n"
        "def z(u, p):\n    return p[0] - 2 * p[1] * cos(2 * u)\n"
    )
    asked = {
        "scene": str(tmp_path / "z.py"),
        "axes": {"a": {"start": 0.0, "stop": 2.0, "num": 5}, "q": 0.3},
    }
    ds = survey.run(asked, output=tmp_path / "o.nc", workers=1)
    point = survey.evaluate(scene(damping=0.05), a=ds.a, q=0.3)
    np.testing.assert_array_equal(ds.verdict, point.verdict)
    assert "per period" in ds.survey.point(a=1.0).why


def test_what_cannot_be_is_refused():
    for damping in (True, float("nan"), [0.1], "not a name"):
        with pytest.raises(BadInput, match="damping = "):
            scene(damping=damping)


@pytest.mark.parametrize("even", [True, False])
def test_the_motion_in_time_and_its_multipliers(even):
    """With z = a against y = e^(-c u) (cos w u + c sin w u / w); else the pair has the trace and
    the product known.
    """
    a, c = 1.7, 0.21
    plain = survey.hill(
        lambda u, p: p[0] + p[1] * cos(2 * u),
        period=pi,
        parameters=("a", "q"),
        damping=c,
        even=even,
    )
    motion = survey.evaluate(plain, a=a, q=0.0).survey.trajectory()
    u, w = motion.u.values, np.sqrt(a - c * c)
    fall = np.exp(-c * u)
    exact = fall * (np.cos(w * u) + c / w * np.sin(w * u)), fall * np.sin(w * u) / w
    for name, values in zip(("y1", "y2"), exact, strict=True):
        assert (abs(motion[name] - values) <= motion[f"{name}_error"] + 1e-15).all() and motion[
            f"{name}_error"
        ].max() < 1e-10
    driven = survey.evaluate(plain, a=1.0, q=0.9)
    moved = driven.survey.trajectory()
    pair = moved.multiplier_real.values + 1j * moved.multiplier_imag.values
    bars = moved.multiplier_error.values + 1e-15
    assert abs(pair.sum() - float(driven.discriminant)) <= bars.sum() + float(
        driven.discriminant_error
    )
    assert abs(np.prod(pair) - np.exp(-2 * c * pi)) <= 2 * bars.sum() and abs(pair).max() > 1
    last = moved.y1.values[moved.u.values <= pi + 1e-9][-1]
    free = survey.hill(
        lambda u, p: p[0] + p[1] * cos(2 * u) - c * c, period=pi, parameters=("a", "q"), even=even
    )
    x1, x2 = (
        survey.evaluate(free, a=1.0, q=0.9).survey.trajectory()[n].sel(u=pi, method="nearest")
        for n in ("y1", "y2")
    )
    assert abs(last - np.exp(-c * pi) * float(x1 + c * x2)) < 1e-10
