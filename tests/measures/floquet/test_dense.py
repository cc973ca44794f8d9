"""Dense maps by series: the same answers as point by point, and exact ones within the bars, from
few points solved.
"""

import math

import mpmath
import numpy as np
import pytest
import xarray as xr
from floquet_truth import multipliers, rotating

import survey
from survey.measures.floquet import dense, monodromy, stability


def oscillators(kind, *, damped=False):
    def K(t, p, out):
        wave = p[1] * math.cos(p[0] * t)
        out[0, 0], out[1, 1] = 1.69 + wave, 0.49 + 0.5 * wave
        out[0, 1] = out[1, 0] = 0.7 * wave

    def C(t, p, out):
        out[0, 0], out[1, 1] = 0.02, 0.05

    more = {"C": C} if damped else {}
    names = {"parameters": ("W", "e"), "states": ("x", "y"), "structure": kind}
    return survey.floquet(K=K, **more, period=lambda p: 2 * math.pi / p[0], **names)


def mathieu(kind):
    def K(t, p, out):
        out[0, 0] = p[0] - 2 * p[1] * math.cos(2 * t)

    def C(t, p, out):
        out[0, 0] = 0.1

    more = {"C": C} if kind == "none" else {}
    return survey.floquet(
        K=K, **more, period=math.pi, parameters=("a", "q"), states="x", structure=kind
    )


@pytest.fixture
def solved(monkeypatch):
    """The number of points that are solved on their own, in a list."""
    number, solve = [0], monodromy.solve

    def counted(points, method, rtol, factor, those, sharp):
        number[0] += len(those)
        return solve(points, method, rtol, factor, those, sharp)

    monkeypatch.setattr(monodromy, "solve", counted)
    return number


MAPS = {
    "symplectic": (oscillators("symplectic"), {"W": (1.0, 2.6), "e": (0.0, 0.6)}),
    "reversible": (oscillators("reversible"), {"W": (1.0, 2.6), "e": (0.0, 0.6)}),
    "damped": (oscillators("none", damped=True), {"W": (1.0, 2.6), "e": (0.0, 0.6)}),
    "mathieu": (mathieu("symplectic"), {"a": (-0.4, 5.0), "q": (0.0, 3.0)}),
    "damped_mathieu": (mathieu("none"), {"a": (-0.4, 5.0), "q": (0.0, 3.0)}),
}


@pytest.mark.parametrize("name", MAPS)
def test_a_map_agrees_with_its_points(name, solved, monkeypatch):
    scene, ends = MAPS[name]
    axes = {
        key: np.linspace(*pair, num)
        for (key, pair), num in zip(ends.items(), (90, 70), strict=True)
    }
    on_map = survey.evaluate(scene, **axes)
    assert solved[0] < 0.35 * 90 * 70
    monkeypatch.setattr(dense, "serves", lambda *given: False)
    rows = {key: values[k::9] for k, (key, values) in enumerate(axes.items())}
    alone = survey.evaluate(scene, **rows)
    on_map = on_map.sel(rows)
    for output in ("verdict", "crossing", "krein"):
        if output in on_map:
            known = (
                (on_map[output] >= 0) & (alone[output] >= 0)
                if output != "krein"
                else on_map[output] > -2
            )
            assert (on_map[output] == alone[output]).where(known, True).all()
    assert (on_map.verdict >= 0).mean() > 0.98
    found, other = (
        ds.multiplier_re.values + 1j * ds.multiplier_im.values for ds in (on_map, alone)
    )
    bars = on_map.multiplier_re_error.values + alone.multiplier_re_error.values
    apart = abs(found[..., :, None] - other[..., None, :]) <= bars[..., :, None] * (1 + 1e-12)
    assert apart.any(axis=-1).all() and apart.any(axis=-2).all()
    for output in ("spectral_radius", "exponent"):
        off = abs(on_map[output] - alone[output]).values
        assert (off <= (on_map[f"{output}_error"] + alone[f"{output}_error"]).values).all()


def test_multipliers_of_one_modulus_do_not_ask_for_points_on_their_own(solved):
    """With equal damping all are of the modulus exp(-c T / 2) where coupling is weak: which of them
    leads stays open, at any accuracy.
    """

    def K(t, p, out):
        out[0, 0], out[1, 1] = p[0] + p[1] * math.cos(2 * t), 1.2 * p[0] + p[1] * math.cos(2 * t)
        out[0, 1] = out[1, 0] = 0.1 * math.cos(2 * t)

    def C(t, p, out):
        out[0, 0] = out[1, 1] = 0.1

    scene = survey.floquet(K=K, C=C, period=math.pi, parameters=("a", "e"), states=("x", "y"))
    ds = survey.evaluate(scene, a=np.linspace(1.3, 3.0, 80), e=np.linspace(0.0, 0.3, 70))
    assert solved[0] < 0.2 * 80 * 70
    off = abs(ds.spectral_radius - math.exp(-0.05 * math.pi))
    assert (off <= ds.spectral_radius_error).mean() > 0.9
    assert (ds.crossing == -1).mean() > 0.9 and (ds.verdict == 1).all()


@pytest.mark.parametrize(
    "n, rtol", [(2, 1e-10), (3, 1e-9), (4, 1e-9), pytest.param(6, 1e-8, marks=pytest.mark.slow)]
)
def test_exact_multipliers_of_a_map(n, rtol, solved):
    rng = np.random.default_rng(n)
    B = 0.25 * rng.normal(size=(n, n)) - 0.1 * np.eye(n)
    axes = {"b0": np.linspace(-0.3, 0.1, 60), "b1": np.linspace(-0.4, 0.5, 50)}
    given = {f"b{k}": value for k, value in enumerate(B.ravel())} | axes
    ds = survey.evaluate(rotating(n), **given, rtol=rtol)
    assert solved[0] < 0.6 * 60 * 50
    worst = 0.0
    for i, j in zip(rng.integers(0, 60, 25), rng.integers(0, 50, 25), strict=True):
        own = B.copy()
        own[0, 0], own[0, 1] = axes["b0"][i], axes["b1"][j]
        exact, one = multipliers(own), ds.isel(b0=i, b1=j)
        for re, im, bar in zip(
            one.multiplier_re.values,
            one.multiplier_im.values,
            one.multiplier_re_error.values,
            strict=True,
        ):
            off = min(abs(mpmath.mpc(float(re), float(im)) - value) for value in exact)
            worst = max(worst, float(off) / float(bar))
        radius = max(abs(value) for value in exact)
        assert abs(radius - float(one.spectral_radius)) <= float(one.spectral_radius_error)
        assert int(one.verdict) == int(radius < 1)
    assert worst <= 1.0


def test_a_frequency_is_replaced_by_its_inverse(solved):
    """As the period is linear in that, half the points at nodes serve; the ends of the axis are
    among those that series answer.
    """
    scene, _ends = MAPS["damped"]
    line = {"W": np.linspace(1.0, 2.6, 1000), "e": 0.3}
    found = survey.evaluate(scene, **line)
    assert solved[0] < 110
    solved[0] = 0
    alone = survey.evaluate(scene, W=line["W"][[0, 1, 500, -2, -1]], e=0.3)
    assert solved[0] >= 5
    off = abs(found.spectral_radius.sel(W=alone.W) - alone.spectral_radius)
    bars = found.spectral_radius_error.sel(W=alone.W) + alone.spectral_radius_error
    assert (off <= bars).all()

    (damped,) = (axis for axis in dense.axes_of({0: (1000, 1.0, 2.6)}))
    fixed = np.array([1.5, 0.3])
    (inverse,) = dense._by_period(scene._system, (damped,), fixed)
    assert inverse.inverse and (inverse.low, inverse.high) == (1 / 2.6, 1.0)
    (plain,) = dense._by_period(scene._system, (dense.Axis(1, 1000, 0.1, 0.6),), fixed)
    assert not plain.inverse


def test_one_axis_and_third_axes(solved):
    scene, _ends = MAPS["damped"]
    line = survey.evaluate(scene, W=np.linspace(1.0, 2.6, 400), e=0.3)
    assert solved[0] < 200
    some = survey.evaluate(scene, W=line.W.values[::37], e=0.3)
    off = abs(line.spectral_radius.sel(W=some.W) - some.spectral_radius)
    assert (off <= line.spectral_radius_error.sel(W=some.W) + some.spectral_radius_error).all()

    def K(t, p, out):
        out[0, 0] = p[0] - 2 * p[1] * math.cos(2 * t)

    def C(t, p, out):
        out[0, 0] = 2 * p[2]

    scene = survey.floquet(K=K, C=C, period=math.pi, parameters=("a", "q", "c"), states="x")
    a, q, c = np.linspace(0.1, 3.0, 70), np.linspace(0.1, 1.0, 60), np.array([0.05, 0.2, 0.3])
    solved[0] = 0
    cube = survey.evaluate(scene, a=a, q=q, c=c)
    assert cube.verdict.shape == (70, 60, 3) and solved[0] < 0.5 * cube.verdict.size
    known = survey.evaluate("mathieu", a=(a[:, None] - c * c).ravel(), q=q[17])
    exponent = known.exponent.values.reshape(70, 3) / math.pi - c
    off = abs(cube.exponent.values[:, 17] - exponent)
    assert (
        off
        <= cube.exponent_error.values[:, 17] + known.exponent_error.values.reshape(70, 3) + 1e-13
    ).all()


def test_multipliers_of_two_states_come_from_series_past_double_ones(solved):
    """Where a pair meets and parts, roots at the nodes are complex and those of points real, or the
    other way round: no iteration leads from the ones to the others.
    """
    ds = survey.evaluate(mathieu("none"), a=np.linspace(-1.0, 8.0, 10_000), q=0.7)
    real = (ds.multiplier_im == 0.0).all("multiplier")
    assert 0.1 < real.mean() < 0.9 and (ds.status == 0).all()
    assert solved[0] < 120


def test_bits_do_not_depend_on_the_block():
    scene, _ends = MAPS["damped"]
    W, e = np.linspace(1.0, 2.6, 80), np.linspace(0.0, 0.6, 50)
    lines = {0: (80, 1.0, 2.6), 1: (50, 0.0, 0.6)}
    points = np.stack(np.meshgrid(W, e, indexing="ij"), axis=-1)
    wanted = {"multiplier_re", "spectral_radius", "verdict", "crossing"}
    given = ("auto", 1e-10, wanted, lines)
    whole = stability.solve(scene._system, "none", points, *given)
    for rows, columns in (
        (slice(0, 1), slice(0, 50)),
        (slice(11, 37), slice(5, 6)),
        (slice(60, 80), slice(3, 41)),
    ):
        part = stability.solve(scene._system, "none", points[rows, columns], *given)
        for name, values in part.items():
            assert values.tobytes() == np.ascontiguousarray(whole[name][rows, columns]).tobytes()


def test_branches_on_parameters_are_solved_point_by_point(solved):
    def K(t, p, out):
        out[0, 0] = 1.0 + abs(p[0]) + p[1] * math.cos(2 * t)

    scene = survey.floquet(
        K=K, period=math.pi, parameters=("a", "b"), states="x", structure="symplectic"
    )
    survey.evaluate(scene, a=np.linspace(-1.0, 1.0, 41), b=np.linspace(0.0, 0.5, 40))
    assert solved[0] >= 41 * 40


@pytest.mark.parametrize("name", ["symplectic", "damped", "mathieu"])
def test_scattered_points_agree_with_points_on_their_own(name, solved, monkeypatch):
    scene, ends = MAPS[name]
    rng = np.random.default_rng(5)
    values = {
        key: xr.DataArray(rng.uniform(*pair, 12_000), dims="point") for key, pair in ends.items()
    }
    together = survey.evaluate(scene, **values)
    assert solved[0] < 0.5 * 12_000
    assert together.attrs["accuracy_missed"] == 0
    some = slice(None, None, 23)
    monkeypatch.setattr(dense, "serves_scattered", lambda *given: False)
    alone = survey.evaluate(scene, **{key: value[some] for key, value in values.items()})
    together = together.isel(point=some)
    assert (together.verdict >= 0).mean() > 0.98
    for output in ("verdict", "crossing"):
        known = (together[output] >= 0) & (alone[output] >= 0)
        assert (together[output] == alone[output]).where(known, True).all()
    found, other = (
        ds.multiplier_re.values + 1j * ds.multiplier_im.values for ds in (together, alone)
    )
    bars = together.multiplier_re_error.values + alone.multiplier_re_error.values
    apart = abs(found[..., :, None] - other[..., None, :]) <= bars[..., :, None] * (1 + 1e-12)
    assert apart.any(axis=-1).all() and apart.any(axis=-2).all()
    # they are not the same numbers: two ways led to them
    assert (found != other).any()


def test_bits_of_scattered_points_do_not_depend_on_the_block():
    scene, ends = MAPS["damped"]
    rng = np.random.default_rng(6)
    points = np.stack([rng.uniform(*ends[name], 5_000) for name in ("W", "e")], axis=1)
    ranges = {k: (5_000, points[:, k].min(), points[:, k].max()) for k in range(2)}
    wanted = {"multiplier_re", "spectral_radius", "verdict", "crossing"}
    whole, part, one = (
        stability.solve(scene._system, "none", points[rows], "auto", 1e-10, wanted, {}, ranges)
        for rows in (slice(None), slice(1_234, 3_000), slice(77, 78))
    )
    for name, values in whole.items():
        assert part[name].tobytes() == values[1_234:3_000].tobytes()
        assert one[name].tobytes() == values[77:78].tobytes()
