"""The bifurcation set of nutations against the quartic's discriminant in multiprecision, and the
map's own points.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf

import survey
from survey.measures.nutation import curves as nc
from survey.request.workflow import check
from survey.show import figures
from survey.sweep import boundaries

MAPS = [  # sign, the number, the two axes with their ends
    (1, ("alpha", 0.1), {"l": (-1.0, 2.0), "beta": (-1.5, 1.6)}),
    (1, ("alpha", -1e-7), {"l": (-1.2, 1.5), "beta": (-1.3, 1.4)}),
    (1, ("beta", 0.7), {"alpha": (1.5, -1.4), "l": (-0.7, 3.0)}),
    (1, ("beta", 2.2), {"l": (0.5, 9.0), "alpha": (-2.8, 2.7)}),
    (1, ("l", 0.5), {"alpha": (-1.3, 1.4), "beta": (-1.3, 1.4)}),
    (1, ("l", 0.3), {"beta": (-1.3, 1.4), "alpha": (-0.9, 1.4)}),
    (1, ("l", 1.0 / 3.0), {"alpha": (-1.3, 1.4), "beta": (-1.3, 1.4)}),
    (1, ("l", 40.0), {"alpha": (-7.0, 8.0), "beta": (-7.0, 6.0)}),
    (-1, ("alpha", 0.45), {"l": (-0.5, 4.0), "beta": (-2.1, 2.0)}),
    (-1, ("alpha", 2.5), {"l": (2.0, 30.0), "beta": (-5.0, 5.2)}),
    (-1, ("l", 3.7), {"alpha": (-2.3, 2.2), "beta": (-1.9, 2.3)}),
    (-1, ("l", 6.1), {"alpha": (-2.9, 2.8), "beta": (-2.9, 3.0)}),
]  # fmt: skip
each = pytest.mark.parametrize(
    ("sign", "given", "axes"),
    [pytest.param(*m, marks=[pytest.mark.slow] * (i % 6 in (1, 3, 5))) for i, m in enumerate(MAPS)],
    ids=lambda v: str(v),
)
LINES = (nc.STABLE, nc.SADDLE)


def found(sign, given, axes, num=3):
    """The dataset of the curves on a map."""
    table = {name: {"start": low, "stop": high, "num": num} for name, (low, high) in axes.items()}
    workflow = check(
        {
            "scene": "brun",
            "options": {"sign": sign},
            "axes": table | dict([given]),
            "boundaries": {},
        }
    )
    return boundaries.find(workflow)


def runs(ds, kinds=LINES):
    """(kind, slice of the points) of the curves of these classes."""
    ends = np.cumsum(ds.curve_count.values)
    own = zip(ds.curve_class.values, ends - ds.curve_count.values, ends, strict=True)
    return [(kind, slice(first, last)) for kind, first, last in own if kind in kinds]


def quartic(sign, l, alpha, beta):  # noqa: E741
    """P (S2), highest power first."""
    return [mpf(-sign), mpf(0), sign - l, 2 * alpha * beta, l - alpha * alpha - beta * beta]


def discriminant(sign, l, alpha, beta):  # noqa: E741
    """g2^3 - 27 g3^2 of P."""
    k, rest = mpf(sign), l - alpha * alpha - beta * beta
    g2 = (k - l) ** 2 / 12 - k * rest
    g3 = -k * (k - l) * rest / 6 - (k - l) ** 3 / 216 + k * (alpha * beta) ** 2 / 4
    return g2**3 - 27 * g3**2


def roots(c):
    # mpmath 1.4 asks for another order of coefficients, which 1.3 does not know
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return mp.polyroots(c, maxsteps=300, extraprec=100)


@each
def test_each_point_lies_on_the_discriminant_within_its_error(sign, given, axes):
    ds = found(sign, given, axes)
    assert float(ds.curve_position_error.max()) < 3e-14
    with mp.workdps(70):
        for _, own in runs(ds):
            for i in range(own.start, own.stop, 3):
                point = {given[0]: mpf(given[1])} | {
                    name: mpf(float(ds[f"curve_{name}"][i])) for name in axes
                }
                step, slopes = mpf(10) ** -30, []
                for name, (low, high) in axes.items():
                    aside = [
                        discriminant(sign, **point | {name: point[name] + s * step})
                        for s in (1, -1)
                    ]
                    slopes.append((aside[0] - aside[1]) / (2 * step) * (high - low))
                value, steep = discriminant(sign, **point), mp.hypot(*slopes)
                # a cusp has no tangent: there the distance is as D^(1/2) at most
                far = abs(value) / steep if steep > mpf(10) ** -20 else mp.sqrt(abs(value))
                assert far <= float(ds.curve_position_error[i]), (i, float(far))


def crossings(ds, across, along, value, kinds=LINES):
    """Places along a row where the curves cross it, interpolated."""
    places = []
    for _, own in runs(ds, kinds):
        q, p = ds[f"curve_{across}"].values[own], ds[f"curve_{along}"].values[own]
        at = np.flatnonzero((q[1:] > value) != (q[:-1] > value))
        places += [*(p[at] + (value - q[at]) / (q[at + 1] - q[at]) * (p[at + 1] - p[at]))]
    return np.sort(places)


def exact_crossings(sign, given, across, along, value, ends):
    """Zeros of the discriminant along the row, whose double root is a real u in (-1, 1)."""
    point = {given[0]: mpf(given[1]), across: mpf(value)}
    with mp.workdps(50):
        nodes = [mpf(n) for n in range(-8, 9)]
        values = [discriminant(sign, **point | {along: x}) for x in nodes]
        series = mp.lu_solve(
            mp.matrix([[x**n for n in range(17)] for x in nodes]), mp.matrix(values)
        )
        c = [x if abs(x) > mpf(10) ** -30 else mpf(0) for x in reversed(list(series))]
        c = c[next(i for i, x in enumerate(c) if x) :]
        places = []
        for place in roots(c):
            if abs(place.imag) > mpf(10) ** -15 or not min(ends) < place.real < max(ends):
                continue
            u = roots(quartic(sign, **point | {along: place.real}))
            near = min(
                ((x, y) for i, x in enumerate(u) for y in u[:i]),
                key=lambda pair: abs(pair[0] - pair[1]),
            )
            double = (near[0] + near[1]) / 2
            if abs(double.imag) < mpf(10) ** -9 and abs(double.real) < 1:
                places.append(float(place.real))
    return np.sort(places)


@each
def test_no_curve_is_missed(sign, given, axes):
    """Row by row, both ways: as many crossings as the discriminant has zeros, and wells change
    there and only there.
    """
    ds, random = found(sign, given, axes), np.random.default_rng(5)
    for (across, of), (along, ends) in zip(axes.items(), reversed(axes.items()), strict=True):
        for value in random.uniform(*sorted(of), 3):
            exact = exact_crossings(sign, given, across, along, value, ends)
            own = crossings(ds, across, along, value)
            assert own.size == exact.size, (across, value, own, exact)
            np.testing.assert_allclose(own, exact, atol=2e-3 * abs(np.ptp(ends)))
            edges = np.concatenate([[min(ends)], exact, [max(ends)]])
            inside = edges[:-1, None] + np.diff(edges)[:, None] * np.array(
                [1e-4, 0.3, 0.7, 1 - 1e-4]
            )
            point = {given[0]: given[1], across: value, along: inside.ravel()}
            wells = survey.evaluate(
                "brun", sign=sign, **point, variables=["wells"]
            ).wells.values.reshape(-1, 4)
            assert (wells == wells[:, :1]).all() and (wells[1:, 0] != wells[:-1, 0]).all()


def test_regular_precessions_are_motions_of_the_scene():
    """Scaled up to a body: at a stable point theta rests, psi' = y sqrt|k|/A, and T = 2 pi/omega_n
    beside it.
    """
    for sign, given, axes in (MAPS[0], MAPS[4], MAPS[8]):
        ds = found(sign, given, axes)
        stable = np.concatenate(
            [np.arange(own.start + 5, own.stop - 5, 9) for _, own in runs(ds, (nc.STABLE,))]
        )
        at = {
            name: ds[f"curve_{name}"].values[stable]
            for name in (*axes, "u", "precession_rate", "nutation_square")
        }
        at |= {given[0]: np.full(stable.size, given[1])}
        k, some = 0.7, (abs(at["u"]) < 0.999) & (at["nutation_square"] > 1e-3)
        at = {name: values[some] for name, values in at.items()}
        body = {"A": 2.0, "C": 1.3, "epsilon": sign * k / (2.0 * 0.7), "p_theta0": 1e-7}
        state = {
            "theta0": np.arccos(at["u"]),
            "p_psi": at["beta"] * k**0.5,
            "p_phi": at["alpha"] * k**0.5,
        }
        out = survey.evaluate(
            "brun", **body, **{name: xr.DataArray(v, dims="p") for name, v in state.items()}
        )
        assert some.sum() > 10
        np.testing.assert_allclose(
            out.period, 2 * np.pi * 2.0 / np.sqrt(k * at["nutation_square"]), rtol=1e-6
        )
        np.testing.assert_allclose(
            out.precession / out.period, at["precession_rate"] * k**0.5 / 2.0, atol=1e-5
        )


def test_duality():
    """p_psi and p_phi exchanged: the same curves, and psi' for the reduced phi'."""
    one = found(1, ("alpha", 0.3), {"l": (-1.0, 2.0), "beta": (-1.5, 1.6)})
    other = found(1, ("beta", 0.3), {"l": (-1.0, 2.0), "alpha": (-1.5, 1.6)})
    for name, dual in (
        ("beta", "alpha"),
        ("l", "l"),
        ("u", "u"),
        ("precession_rate", "reduced_spin_rate"),
    ):
        lines = [np.concatenate([ds[f"curve_{n}"].values[own] for _, own in runs(ds)])
                 for ds, n in ((one, name), (other, dual))]  # fmt: skip
        np.testing.assert_allclose(*lines, rtol=0, atol=3e-15)


def test_cusps_uprights_and_passages():
    """Triple roots (digest), the ends of the surface, and lines where the precession jumps by 2 pi."""
    ds = found(1, ("l", 0.7), {"alpha": (-1.4, 1.4), "beta": (-1.4, 1.4)})
    cusps = [own for _, own in runs(ds, (nc.CUSP,))]
    u = np.sqrt((1 - 0.7) / 6)
    minus, plus = (1 - u) ** 3 * (1 + 3 * u), (1 + u) ** 3 * (1 - 3 * u)
    for own in cusps:
        a, b = float(ds.curve_alpha[own][0]), float(ds.curve_beta[own][0])
        side = np.sign(float(ds.curve_u[own][0]))
        np.testing.assert_allclose(
            [(a - side * b) ** 2, (a + side * b) ** 2], [minus, plus], atol=1e-14
        )
    assert len(cusps) == 8 and [kind for kind, _ in runs(ds, (nc.UPRIGHT,))] == [nc.UPRIGHT] * 4
    for sign, given, axes in MAPS:
        ds = found(sign, given, axes)
        for _, own in runs(ds, (nc.PASSAGE,)):
            middle = {
                name: float(ds[f"curve_{name}"].values[own] @ [0.7, 0.3]) for name in axes
            } | dict([given])
            jump = [survey.evaluate("brun", sign=sign, **middle | {"beta": middle["beta"] + step}).precession.values
                    for step in (1e-9, -1e-9)]  # fmt: skip
            assert np.nanmax(abs(jump[0] - jump[1])) == pytest.approx(2 * np.pi, abs=1e-5)


def test_without_spin():
    """alpha = 0: the sheets l = beta^2, u = 0, and l = 2 |beta| - 1, u^2 = 1 - |beta|, cross at
    beta = 1, l = 1.
    """
    ds = found(1, ("alpha", 0.0), {"l": (-1.5, 3.0), "beta": (-2.0, 2.0)})
    for kind, own in runs(ds):
        l, b, u = (ds[f"curve_{name}"].values[own] for name in ("l", "beta", "u"))  # noqa: E741
        flat = (u == 0).all()
        np.testing.assert_allclose(l, b * b if flat else 2 * abs(b) - 1, atol=2e-15)
        np.testing.assert_allclose(u * u, 0 * u if flat else 1 - abs(b), atol=2e-15)
        assert (abs(b) <= 1).all() if kind == nc.SADDLE or not flat else (abs(b) >= 1).all()
    assert [sum(kind == k for kind, _ in runs(ds, range(6))) for k in range(6)] == [
        4,
        1,
        2,
        2,
        0,
        2,
    ]


@pytest.mark.parametrize(("alpha", "sign", "kind"), [(0.45, -1, 4), (2.5, -1, 3), (0.45, 1, 3)])
def test_threads_are_unstable_where_the_spin_is_slow(alpha, sign, kind):
    ds = found(sign, ("alpha", alpha), {"l": (-2.0, 9.0), "beta": (-3.0, 3.0)})
    points = [own for k, own in runs(ds, (3, 4)) if k == kind]
    assert sorted(float(ds.curve_beta[own][0]) for own in points) == [-alpha, alpha]
    assert all(abs(float(ds.curve_l[own][0]) - (alpha**2 - sign)) < 1e-15 for own in points)


def test_they_are_in_the_file_and_in_the_picture(tmp_path):
    axes = {
        "l": {"start": -1.0, "stop": 2.0, "num": 9},
        "beta": {"start": -1.5, "stop": 1.5, "num": 7},
        "alpha": 0.1,
    }
    survey.run({"scene": "brun", "axes": axes, "boundaries": {}}, output=tmp_path / "map.nc")
    ds = survey.open(tmp_path / "map.nc")
    assert int(ds.curve_count.sum()) == ds.sizes["curve_point"] == ds.curve_u.size
    assert (
        ds.curve_u.attrs["ancillary_variables"] == "curve_u_error"
        and ds.curve_class.attrs["flag_values"].size == 6
    )
    figure = figures.draw(ds, "period")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert {"separatrices", "cusps", "pole passages", "stable regular precessions"} < set(labels)
    assert len(figure.axes[0].lines) == ds.sizes["curve"]
    plt.close(figure)


def test_three_axes_make_a_stack_of_maps():
    axes = {"l": {"start": -1.0, "stop": 2.0, "num": 9}, "beta": {"start": -1.5, "stop": 1.6, "num": 7},
            "alpha": {"values": [-0.4, 0.1]}}  # fmt: skip
    workflow = check({"scene": "brun", "axes": axes, "boundaries": {}})
    ds, one = (
        boundaries.find(workflow),
        found(1, ("alpha", 0.1), {"l": (-1.0, 2.0), "beta": (-1.5, 1.6)}),
    )
    upper = np.flatnonzero(ds.curve_alpha.values == 0.1)
    assert upper.size == one.sizes["curve_point"] and set(ds.curve_alpha.values) == {-0.4, 0.1}
    np.testing.assert_array_equal(ds.curve_beta.values[upper], one.curve_beta.values)
    with_map = survey.evaluate(
        "brun", **{name: workflow.grid.parameters[name][1] for name in axes}
    ).merge(ds)
    figure = figures.draw(with_map.isel(alpha=[1, 0]), "period")
    assert len(figure.axes[0].lines) == one.sizes["curve"]
    plt.close(figure)


def test_a_logarithmic_axis():
    axes = {
        "l": {"start": 0.01, "stop": 10.0, "num": 5, "spacing": "log"},
        "beta": {"start": -2.0, "stop": 2.0, "num": 3},
    }
    ds = boundaries.find(check({"scene": "brun", "axes": axes | {"alpha": 0.1}, "boundaries": {}}))
    assert (ds.curve_l >= 0.01).all() and float(ds.curve_position_error.max()) < 1e-13
    plain = found(1, ("alpha", 0.1), {"l": (0.01, 10.0), "beta": (-2.0, 2.0)})
    for value in (0.02, 0.3, 2.0):
        one, other = (crossings(d, "l", "beta", value) for d in (ds, plain))
        np.testing.assert_allclose(one, other, atol=2e-3)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"axes": {"l": 0.1, "alpha": 0.1, "beta": 0.2}}, "not on none"),
        ({"axes": {"l": {"values": [0.1, 0.2]}, "beta": {"values": [0.1]}, "alpha": 0.1}}, "beta has one value"),
        ({"boundaries": {"axis": "beta"}}, "no axis is searched"),
        ({"axes": {n: {"values": [0.1, 0.2]} for n in ("t", "p_psi")} | {"A": 2.0, "C": 1.0, "epsilon": 0.6,
          "theta0": 0.4, "p_theta0": 0.0, "p_phi": 1.0}}, "not on t, p_psi"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(changes, words):
    axes = {"l": {"values": [0.1, 0.2]}, "beta": {"values": [0.1, 0.2]}, "alpha": 0.1}
    with pytest.raises(survey.BadInput, match=words) as refused:
        check({"scene": "brun", "axes": axes, "boundaries": {}} | changes)
    assert "\n" not in str(refused.value)
