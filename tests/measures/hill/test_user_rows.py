"""Maps of a user's z in rows and by series: within the bars of points solved one by one by another method."""

from math import cos, exp, pi, sin

import mpmath
import numpy as np
import pytest
import xarray as xr

import survey
from survey import status
from survey.file.labels import error_bars
from survey.measures.hill import user_equation, user_rows

WAVE = survey.hill(
    lambda u, p: p[0] + p[1] if u < p[2] * pi or u > (2 - p[2]) * pi else p[0] - p[1],
    period=2 * pi, parameters=("a", "b", "duty"), breaks=lambda p: [p[2] * pi, (2 - p[2]) * pi], even=True,
)  # fmt: skip
HARMONICS = survey.hill(
    lambda u, p: p[0] + p[1] * cos(2 * u) + p[2] * p[1] * sin(4 * u),
    period=pi,
    parameters=("a", "q", "r"),
)
MAPS = [
    ("even", survey.hill(lambda u, p: p[0] - 2 * p[1] * cos(2 * u), period=pi, parameters=("a", "q"), even=True),
     {"a": (-3.0, 40.0, 120), "q": (-6.0, 9.0, 90)}),
    ("not even", HARMONICS, {"q": (-3.0, -1.0, 70), "a": (0.0, 18.0, 100), "r": 0.7}),
    ("negative axis", HARMONICS, {"a": (-9.0, -1.0, 100), "q": (0.0, 6.0, 70), "r": 0.1}),
    ("square wave", WAVE, {"a": (0.0, 6.0, 90), "b": (-2.0, 3.0, 60), "duty": 0.3}),
    ("lane with changing sign", HARMONICS, {"a": 4.0, "q": (-3.0, 5.0, 300), "r": (0.0, 1.0, 40)}),
    ("vanishing inside", survey.hill(lambda u, p: (p[0] - 4) * (p[1] - 1.5) + 1e-3 * p[1] * cos(60 * u), period=pi,
                                     parameters=("a", "q"), even=True), {"a": (0.0, 8.0, 90), "q": (0.0, 3.0, 80)}),
    ("exponential", survey.hill(lambda u, p: p[0] + exp(p[1] * cos(u)), period=2 * pi, parameters=("a", "s"),
                                even=True), {"a": (-1.0, 4.0, 200), "s": (-2.0, 2.0, 150)}),
]  # fmt: skip


def axes_of(ranges):
    return {name: np.linspace(*r) if isinstance(r, tuple) else r for name, r in ranges.items()}


@pytest.fixture
def rows(monkeypatch):
    """How many problems were made in rows, and how many points on their own."""
    counts = {"rows": 0, "points": 0}
    for name, module in (("rows", user_rows), ("points", user_equation)):

        def counted(*given, name=name, make=module.problem):
            counts[name] += 1
            return make(*given)

        monkeypatch.setattr(module, "problem", counted)
    return counts


@pytest.mark.parametrize("variables", [None, ["discriminant", "exponent", "verdict"]])
@pytest.mark.parametrize(
    ("scene", "ranges"),
    [
        pytest.param(*m[1:], id=m[0], marks=[pytest.mark.slow] * (m[0] in ("exponential", "even")))
        for m in MAPS
    ],
)
def test_maps_agree_with_their_points(rows, scene, ranges, variables):
    axes = axes_of(ranges)
    dense = survey.evaluate(scene, **axes, variables=variables)
    assert rows["rows"] > 0 and rows["points"] == 0
    long = [name for name, values in axes.items() if np.ndim(values)]
    random = np.random.default_rng(0)
    mine = dense.isel(
        {name: xr.DataArray(random.integers(0, axes[name].size, 60), dims="point") for name in long}
    )
    points = {
        name: mine[name].drop_vars(mine.coords) if name in long else axes[name] for name in axes
    }
    alone = survey.evaluate(scene, **points, method="dop853", rtol=1e-13)
    for name in error_bars(mine):
        bars = mine[f"{name}_error"].values.astype(float) + alone[f"{name}_error"].values
        assert (abs(mine[name].values - alone[name].values) <= bars).all(), name
    both = (mine.verdict.values >= 0) & (alone.verdict.values >= 0)
    assert both.mean() > 0.95 and (mine.verdict.values == alone.verdict.values)[both].all()
    # next to edges, where the exponent is steep
    assert dense.attrs["accuracy_missed"] < 1e-3 * dense.status.size


def test_blocks_of_a_map_have_the_same_bits(monkeypatch):
    from survey.sweep import cost

    scene, axes = MAPS[0][1], axes_of(MAPS[0][2])
    for variables in (None, ["discriminant", "verdict"]):
        whole = survey.evaluate(scene, **axes, variables=variables)
        with monkeypatch.context() as patch:
            patch.setattr(cost, "BLOCK_POINTS", 700)
            patch.setattr(cost, "IN_MEMORY", 1)
            part = survey.evaluate(scene, **axes, variables=variables)
        xr.testing.assert_identical(whole.drop_attrs(), part.drop_attrs())


def test_a_bad_row_affects_only_itself():
    scene = survey.hill(
        lambda u, p: p[0] + 1 / p[1] * cos(2 * u), period=pi, parameters=("a", "c"), even=True
    )
    a, c = np.linspace(0, 9, 30), np.array([-1.0, 0.0, 2.0])
    ds = survey.evaluate(scene, a=a, c=c)
    assert (ds.status.sel(c=0) != 0).all() and (ds.status.sel(c=[-1.0, 2.0]) == 0).all()
    alone = survey.evaluate("mathieu", a=a, q=[0.5, -0.25])
    bars = ds.discriminant_error.astype(float).values[:, ::2] + alone.discriminant_error.values
    assert (abs(ds.discriminant.values[:, ::2] - alone.discriminant.values) <= bars).all()


def test_large_cancelling_terms_widen_the_bars():
    """z is the same function with 10^6 added and taken away: its rounding counts in rows, too."""
    plain = survey.hill(
        lambda u, p: p[0] + p[1] * cos(2 * u), period=pi, parameters=("a", "q"), even=True
    )
    noisy = survey.hill(
        lambda u, p: ((p[0] + p[1] * cos(2 * u)) + 1e6 * (1 + 0.1 * sin(u) ** 2)) - 1e6 * (1 + 0.1 * sin(u) ** 2),
        period=pi, parameters=("a", "q"), even=True,
    )  # fmt: skip
    axes = {"a": np.linspace(0, 20, 50), "q": np.linspace(0.1, 4, 20)}
    one, other = (survey.evaluate(scene, **axes) for scene in (plain, noisy))
    for name in ("y1", "y2", "dy1", "dy2", "discriminant"):
        bars = one[f"{name}_error"].astype(float) + other[f"{name}_error"].astype(float)
        assert (abs(one[name] - other[name]) <= bars).all()
        assert float(other[f"{name}_error"].median()) > 50 * float(one[f"{name}_error"].median())


@pytest.mark.parametrize("variables", [None, ["discriminant", "verdict"]])
@pytest.mark.parametrize("even", [True, False])
def test_scattered_points_are_served_by_series(rows, even, variables):
    scene = survey.hill(
        lambda u, p: p[0] + 2 * p[1] * cos(2 * u - (0.0 if even else 0.3)),
        period=pi,
        parameters=("a", "q"),
        even=even,
    )
    random = np.random.default_rng(2)
    a, q = random.uniform(-5, 30, 6000), random.uniform(-3, 6, 6000)
    a[0], q[9] = np.nan, np.inf
    given = {name: xr.DataArray(values, dims="point") for name, values in (("a", a), ("q", q))}
    own = survey.evaluate(scene, **given, variables=variables)
    assert rows["rows"] > 0 and set(np.flatnonzero(own.status.values)) == {0, 9}
    scene = survey.evaluate("mathieu", a=given["a"][:800], q=-given["q"][:800], rtol=1e-12)
    first = own.isel(point=slice(0, 800))
    for name in (
        ("discriminant", "exponent", "rotation_number") if variables is None else ("discriminant",)
    ):
        bars = first[f"{name}_error"].astype(float) + scene[f"{name}_error"].astype(float)
        off = abs(first[name] - scene[name]).values
        assert (off <= bars.values)[np.isfinite(bars.values)].all(), name
    both = (first.verdict >= 0) & (scene.verdict >= 0)
    assert float(both.mean()) > 0.99 and bool(
        (first.verdict == scene.verdict).where(both, True).all()
    )


def test_a_row_that_is_rough_leaves_the_others():
    """|cos u| counts in the second of five rows alone, where the check of the axes' ends and
    middles does not look.
    """
    scene = survey.hill(
        lambda u, p: p[0] + exp(-1e4 * (p[1] - 0.25) ** 2) * abs(cos(u)),
        period=2 * pi,
        parameters=("a", "c"),
        even=True,
    )
    ds = survey.evaluate(scene, a=np.linspace(0.1, 4, 12), c=np.linspace(0, 1, 5))
    assert set(ds.status.sel(c=0.25).values.tolist()) == {status.NO_CONVERGENCE}
    assert (ds.status.drop_sel(c=0.25) == 0).all()
    free = 2 * np.cos(2 * pi * np.sqrt(ds.a))
    assert (
        abs(ds.discriminant - free).drop_sel(c=0.25)
        <= ds.discriminant_error.drop_sel(c=0.25) + 1e-14
    ).all()


def test_bars_hold_where_z_is_smaller_by_far_than_in_other_corners_of_the_map():
    scene = survey.hill(
        lambda u, p: p[0] - 2 * p[1] * cos(2 * u), period=pi, parameters=("a", "q"), even=True
    )
    a, q = np.append(-np.geomspace(300.0, 1e-6, 100), 0.0), np.linspace(0.0, 1e-6, 101)
    dense = survey.evaluate(scene, a=a, q=q, variables=["discriminant", "exponent", "verdict"])
    known = dense.isel(q=0)
    with mpmath.workdps(30):
        right = [2 * mpmath.cosh(mpmath.pi * mpmath.sqrt(-mpmath.mpf(float(x)))) for x in a]
        off = [
            abs(mpmath.mpf(float(d)) - r) for d, r in zip(known.discriminant, right, strict=True)
        ]
    assert (np.array(off, float) <= known.discriminant_error.values).all()
    assert (known.discriminant_error <= 1e-10 * (1 + abs(known.discriminant))).all()
    some = np.arange(0, 101, 5)
    alone = survey.evaluate(
        scene, a=xr.DataArray(a[some], dims="i"), q=0.0, variables=["exponent"], method="dop853"
    )
    apart = abs(known.exponent.values[some] - alone.exponent.values)
    bars = known.exponent_error.values[some] + alone.exponent_error.values
    assert (apart <= bars).all()
