"""Dense rows and maps by their Chebyshev series: within the bars of points solved one by one, in
any block.
"""

import numpy as np
import pytest
import xarray as xr

import survey
from survey.file.labels import error_bars
from survey.measures.hill import dense as hill_dense
from survey.scene import Request
from survey.scenes import mathieu, satellite

NAMES = frozenset({"discriminant", "exponent", "verdict"})


@pytest.fixture
def served(monkeypatch):
    """How many points were left to be solved one by one, of how many."""
    counts, solve = [], hill_dense.solve

    def counted(problem, method, asked, answers):
        left = solve(problem, method, asked, answers)
        counts.append((int(left.sum()), left.size))
        return left

    monkeypatch.setattr(hill_dense, "solve", counted)
    return counts


@pytest.mark.parametrize("rtol", [1e-6, 1e-10, 1e-12])
@pytest.mark.parametrize(
    ("body", "k", "rho"),
    [
        ("prolate", np.linspace(0.01, 0.999, 12), np.linspace(0.5, 4.0, 400)),
        ("oblate", np.linspace(0.0, 0.95, 12), np.linspace(-2.0, 3.0, 400)),
        ("prolate", np.geomspace(1.001, 50.0, 12), np.linspace(-6.0, 5.0, 400)),
        ("oblate", np.geomspace(1.01, 5.0, 12), np.linspace(1.0, 30.0, 700)),
    ],
)
def test_dense_rows_agree_with_their_points(served, body, k, rho, rtol):
    dense = survey.evaluate("satellite", k=k, rho=rho, body=body, rtol=rtol, variables=NAMES)
    alone = survey.evaluate(
        "satellite", k=k, rho=rho, body=body, rtol=min(rtol, 1e-12), method="taylor16"
    )
    assert len(served) == 1 and (rtol == 1e-12 or served[0][0] < 0.3 * served[0][1])
    for name in ("discriminant", "exponent"):
        off = abs(dense[name] - alone[name]).values
        assert (
            off <= dense[f"{name}_error"].values.astype(float) + alone[f"{name}_error"].values
        ).all(), name
        assert (
            dense[f"{name}_error"].values <= rtol * 1.001 * (1 + abs(dense[name].values))
        ).mean() > 0.99
    both = (dense.verdict >= 0) & (alone.verdict >= 0)
    assert (dense.verdict == alone.verdict).where(both, True).all() and both.mean() > 0.999


@pytest.fixture
def surfaces(monkeypatch):
    """The panels of rows that were found."""
    found, solve = [], hill_dense.panels

    def kept(*arguments):
        found.append(solve(*arguments))
        return found[-1]

    monkeypatch.setattr(hill_dense, "panels", kept)
    return found


MAPS = [
    ("satellite", {"k": (0.0, 0.99), "rho": (0.6, 4.0)}, {"body": "prolate"}, 1),
    ("satellite", {"one_minus_k": (1e-3, 1e-2), "rho": (0.6, 4.0)}, {"body": "prolate"}, 1),
    ("satellite", {"amplitude": (0.1, 1.3), "rho": (-1.0, 3.0)}, {"body": "oblate"}, 1),
    ("satellite", {"k": (1.02, 3.0), "rho": (-4.0, 4.0)}, {"body": "oblate"}, 1),
    ("satellite", {"k": (0.9, 0.9001), "rho": (50.0, 50.01)}, {"body": "prolate"}, 1),
    ("satellite", {"amplitude": (0.0, 1.5), "inertia_ratio": (0.02, 0.97)}, {}, 1),
    ("satellite", {"k": (1.02, 3.0), "inertia_ratio": (1.1, 2.0)}, {"direction": "-1"}, 0),
    ("mathieu", {"q": (-2.0, 3.0), "a": (-1.0, 60.0)}, {}, 1),
]
# Wide gaps, narrow bands, long periods.
STEEP = [
    ("mathieu", {"q": (0.0, 120.0), "a": (-250.0, 250.0)}, {}, 0),
    ("satellite", {"one_minus_k": (1e-9, 1e-6), "rho": (-3.0, 6.0)}, {"body": "oblate"}, 0),
    ("satellite", {"k": (1.0001, 1.2), "rho": (-1.5, 0.5)}, {"body": "prolate"}, 0),
]


@pytest.mark.parametrize(("scene", "ranges", "options", "fewest"), MAPS)
def test_dense_maps_agree_with_their_points(surfaces, scene, ranges, options, fewest):
    (row, rows), (lane, lanes) = ranges.items()
    axes = {row: np.linspace(*rows, 600), lane: np.linspace(*lanes, 240)}
    dense = survey.evaluate(scene, **axes, **options, variables=NAMES)
    assert len(surfaces[0]) >= fewest
    random = np.random.default_rng(0)
    places = {
        name: xr.DataArray(random.integers(0, axes[name].size, 1500), dims="point") for name in axes
    }
    mine = dense.isel(places)
    points = {name: mine[name].drop_vars(list(axes)) for name in axes}
    alone = survey.evaluate(scene, **points, **options, rtol=1e-13, method="taylor16")
    for name in ("discriminant", "exponent"):
        off = abs(mine[name].values - alone[name].values)
        assert (
            off <= mine[f"{name}_error"].values.astype(float) + alone[f"{name}_error"].values
        ).all(), name
    both = (mine.verdict.values >= 0) & (alone.verdict.values >= 0)
    assert both.mean() > 0.99 and (mine.verdict.values == alone.verdict.values)[both].all()


def test_one_panel_serves_though_the_discriminant_falls_along_its_rows(surfaces):
    """Where |D| = 1e5 at one end, its rounding there is as large as what is asked for at the other."""
    axes = {"q": np.linspace(0.0, 15.0, 300), "a": np.linspace(0.0, 25.0, 240)}
    dense = survey.evaluate("mathieu", **axes, variables=["discriminant", "verdict"])
    assert len(surfaces[0]) == 1
    random = np.random.default_rng(5)
    places = {
        name: xr.DataArray(random.integers(0, axes[name].size, 1500), dims="point") for name in axes
    }
    mine = dense.isel(places)
    points = {name: mine[name].drop_vars(list(axes)) for name in axes}
    alone = survey.evaluate("mathieu", **points, rtol=1e-13, method="dop853")
    bar, exact = mine.discriminant_error.values.astype(float), alone.discriminant_error.values
    assert (abs(mine.discriminant.values - alone.discriminant.values) <= bar + exact).all()
    assert (bar <= 1e-10 * (1 + abs(mine.discriminant.values))).mean() > 0.99
    both = (mine.verdict.values >= 0) & (alone.verdict.values >= 0)
    assert both.mean() > 0.98 and (mine.verdict.values == alone.verdict.values)[both].all()


@pytest.mark.parametrize("rtol", [1e-6, 1e-10])
@pytest.mark.parametrize(("scene", "ranges", "options", "fewest"), [*MAPS, *STEEP])
def test_all_outputs_of_maps_agree_with_their_points(served, scene, ranges, options, fewest, rtol):
    """The factors by series, and rotation numbers from the zeros that nodes around and signs tell."""
    (row, rows), (lane, lanes) = ranges.items()
    axes = {row: np.linspace(*rows, 300), lane: np.linspace(*lanes, 240)}
    dense = survey.evaluate(scene, **axes, **options, rtol=rtol)
    left, points = map(sum, zip(*served, strict=True))
    assert left < 0.45 * points or not fewest
    random = np.random.default_rng(0)
    places = {
        name: xr.DataArray(random.integers(0, axes[name].size, 3000), dims="point") for name in axes
    }
    mine = dense.isel(places)
    points = {name: mine[name].drop_vars(list(axes)) for name in axes}
    alone = survey.evaluate(scene, **points, **options, rtol=1e-13, method="taylor16")
    assert (mine.status.values == alone.status.values).all()
    for name in error_bars(mine):
        off = abs(mine[name].values - alone[name].values)
        bars = mine[f"{name}_error"].values.astype(float) + alone[f"{name}_error"].values
        assert (off <= bars)[np.isfinite(bars)].all(), name
        assert (np.isfinite(mine[name].values) == np.isfinite(alone[name].values)).all(), name
    both = (mine.verdict.values >= 0) & (alone.verdict.values >= 0)
    assert both.mean() > 0.99 and (mine.verdict.values == alone.verdict.values)[both].all()


def test_blocks_of_a_map_share_its_panels(surfaces):
    rows, lanes = np.linspace(0.05, 0.95, 200)[:, None], np.linspace(0.6, 4.0, 300)[None, :]
    lines = {"rho": (300, 0.6, 4.0), "k": (200, 0.05, 0.95)}
    request = Request({"body": "prolate"}, "auto", 1e-10, NAMES, lines)
    whole = satellite.solve({"k": rows, "rho": lanes}, request)
    for cut in (slice(3, 4), slice(100, 200)):
        part = satellite.solve({"k": rows[cut], "rho": lanes[:, 100:107]}, request)
        for name in ("discriminant", "discriminant_error", "exponent", "verdict"):
            np.testing.assert_array_equal(part[name], whole[name][cut, 100:107], err_msg=name)
    assert len(surfaces) == 3 and surfaces[0] and surfaces[1] is surfaces[0] is surfaces[2]


def test_mathieu_rows_are_served_too(served):
    a, q = np.linspace(-1.0, 60.0, 500), np.array([0.0, 0.5, 3.0, 10.0])
    dense = survey.evaluate("mathieu", a=a, q=q, variables=["discriminant", "verdict"])
    alone = survey.evaluate("mathieu", a=a, q=q, method="dop853", rtol=1e-12)
    assert served[0][0] < 0.6 * served[0][1]
    bars = dense.discriminant_error.astype(float) + alone.discriminant_error
    assert (abs(dense.discriminant - alone.discriminant) <= bars).all()
    assert ((dense.verdict == alone.verdict) | (alone.verdict < 0)).all()


@pytest.mark.parametrize("names", [NAMES, NAMES | {"y1", "y2", "dy1", "dy2", "rotation_number"}])
@pytest.mark.parametrize(("scene", "row", "lane"), [(satellite, "k", "rho"), (mathieu, "q", "a")])
def test_any_block_has_the_same_bits(scene, row, lane, names):
    rows, lanes = np.linspace(0.05, 0.95, 6)[:, None], np.linspace(0.6, 4.0, 300)[None, :]
    options = {"body": "prolate"} if scene is satellite else {}
    request = Request(options, "auto", 1e-10, names, {lane: (300, 0.6, 4.0)})
    whole = scene.solve({row: rows, lane: lanes}, request)
    for rows_of, lanes_of in [
        (slice(2, 3), slice(None)),
        (slice(None), slice(100, 107)),
        (slice(4, 6), slice(290, 300)),
    ]:
        part = scene.solve({row: rows[rows_of], lane: lanes[:, lanes_of]}, request)
        for name in whole:
            np.testing.assert_array_equal(part[name], whole[name][rows_of, lanes_of], err_msg=name)


SCATTERED = [
    ("satellite", {"k": (0.01, 0.99), "rho": (-2.0, 4.0)}, {"body": "prolate"}),
    ("satellite", {"one_minus_k": (-3.0, -0.05), "rho": (-3.0, 2.0)}, {"body": "oblate"}),
    ("mathieu", {"q": (-4.0, 9.0), "a": (-10.0, 40.0)}, {}),
]


@pytest.mark.parametrize("variables", [None, ["discriminant", "verdict"]])
@pytest.mark.parametrize(("scene", "ranges", "options"), SCATTERED)
def test_scattered_points_agree_with_points_on_their_own(
    scene, ranges, options, variables, monkeypatch
):
    from survey.sweep import cost

    random = np.random.default_rng(4)
    given = {
        name: xr.DataArray(random.uniform(*ends, 6000), dims="point")
        for name, ends in ranges.items()
    }
    for name in given:
        # where exact rules decide
        given[name][[10, 20]] = 0.0 if name in ("rho", "q") else given[name][10]
    given["rho" if "rho" in given else "a"][30] = np.nan
    many = survey.evaluate(scene, **given, **options, variables=variables)
    few = survey.evaluate(
        scene, **{name: v[:1500] for name, v in given.items()}, **options, rtol=1e-13
    )
    one = many.isel(point=slice(0, 1500))
    assert (one.status.values == few.status.values).all() and int(one.status[30]) != 0
    for name in error_bars(one):
        off, bars = (
            abs(one[name].values - few[name].values),
            one[f"{name}_error"].values.astype(float),
        )
        assert (off <= bars + few[f"{name}_error"].values)[np.isfinite(bars)].all(), name
        assert (bars <= 1.001e-10 * (1 + abs(one[name].values)))[np.isfinite(bars)].mean() > 0.99
    both = (one.verdict.values >= 0) & (few.verdict.values >= 0)
    assert both.mean() > 0.99 and (one.verdict.values == few.verdict.values)[both].all()
    assert int(one.verdict[10]) == int(few.verdict[10])
    with monkeypatch.context() as patch:
        patch.setattr(cost, "BLOCK_POINTS", 1700)
        patch.setattr(cost, "IN_MEMORY", 1)
        xr.testing.assert_identical(
            survey.evaluate(scene, **given, **options, variables=variables), many
        )


def test_a_sparse_axis_is_solved_point_by_point(served):
    survey.evaluate(
        "satellite", k=[0.3, 0.4], rho=np.linspace(0.6, 4.0, 20), variables=["discriminant"]
    )
    assert served == [(40, 40)]


def test_inside_a_narrow_tongue_the_factors_decide():
    """n = 7 at k = 0.15 is 5.4e-10 wide in rho, where |D| - 2 is 3e-18: D alone cannot tell."""
    low, high = 3.2, 3.4  # rotation number 7/2 lies between
    for _ in range(5):
        rho = np.linspace(low, high, 2001)
        ds = survey.evaluate("satellite", k=0.15, rho=rho)
        at = int(np.argmin(abs(ds.rotation_number.values - 3.5)))
        low, high = rho[max(at - 2, 0)], rho[min(at + 2, 2000)]
    row = np.unique(
        np.concatenate([np.linspace(0.6, 4.0, 500), np.linspace(low - 1e-9, high + 1e-9, 301)])
    )
    dense = survey.evaluate("satellite", k=0.15, rho=row, variables=["discriminant", "verdict"])
    sure = survey.evaluate("satellite", k=0.15, rho=row)
    assert (dense.verdict == sure.verdict).all() and (sure.verdict < 0).sum() < 3
    assert 5 < (dense.verdict == 0).sum() < 300
