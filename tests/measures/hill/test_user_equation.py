"""A user's z: closed forms, other scenes and other methods; true errors within the bars, with
breaks and without.
"""

import itertools
from math import cos, pi, sin

import numpy as np
import pytest
import xarray as xr
from mpmath import mp, mpf
from scipy.integrate import solve_ivp

import survey
from survey import status
from survey.file.labels import error_bars
from survey.measures.hill import user_equation
from survey.sweep import cost

METHODS = ["auto", "taylor16", "magnus6", "rk4", "dop853"]
A, Q = np.linspace(-2.0, 30.0, 9), np.array([0.0, 0.7, 5.0, 20.0])


def mathieu(u, p):
    return p[0] - 2 * p[1] * cos(2 * u)


def shifted(u, p):
    return p[0] - 2 * p[1] * cos(2 * (u - 0.3))


def scaled(u, p):
    return p[2] ** 2 * (p[0] - 2 * p[1] * cos(2 * p[2] * u))


EVEN = survey.hill(mathieu, period=pi, parameters=("a", "q"), even=True)
SHIFTED = survey.hill(shifted, period=pi, parameters=("a", "q"))


def within(one, other, names):
    """The largest difference of the two, relative to the sum of their bars."""
    bars = {n: one[f"{n}_error"].astype(float) + other[f"{n}_error"].astype(float) for n in names}
    return max(float((abs(one[n] - other[n]) / (bars[n] + 1e-300)).max()) for n in names)


@pytest.mark.parametrize("method", METHODS)
def test_mathieu_by_an_own_function_is_the_scene(method):
    rtol = 1e-6 if method in ("rk4", "magnus6") else 1e-10
    own, scene = (
        survey.evaluate(EVEN, a=A, q=Q, method=method, rtol=rtol),
        survey.evaluate("mathieu", a=A, q=Q),
    )
    assert within(own, scene, error_bars(scene)) <= 1
    decided = (own.verdict != -1) & (scene.verdict != 2)
    assert (own.verdict == scene.verdict).values[decided].all() and decided.sum() >= 34


@pytest.mark.parametrize("method", METHODS)
def test_a_shift_changes_neither_discriminant_nor_exponent_nor_rotation_number(method):
    rtol = 1e-6 if method in ("rk4", "magnus6") else 1e-10
    own, scene = (
        survey.evaluate(SHIFTED, a=A, q=Q, method=method, rtol=rtol),
        survey.evaluate("mathieu", a=A, q=Q),
    )
    assert within(own, scene, ["discriminant", "exponent", "rotation_number", "period"]) <= 1
    decided = (own.verdict != -1) & (scene.verdict != 2)
    assert (own.verdict == scene.verdict).values[decided].all() and decided.sum() >= 34
    assert float(abs(own.y1 - own.dy2).max()) > 1  # not symmetric: the values are those at T


def test_the_period_may_depend_on_the_parameters():
    scene = survey.hill(scaled, period=lambda p: pi / p[2], parameters=("a", "q", "s"), even=True)
    own = survey.evaluate(scene, a=A, q=5.0, s=[0.01, 1.0, 300.0])
    for s in own.s:
        assert (
            within(
                own.sel(s=s),
                survey.evaluate("mathieu", a=A, q=5.0),
                ["discriminant", "rotation_number"],
            )
            <= 1
        )
    np.testing.assert_allclose(
        own.period.values, np.broadcast_to(pi / own.s.values, own.period.shape), rtol=1e-15
    )


def test_no_symmetry_at_all_against_another_integrator():
    scene = survey.hill(
        lambda u, p: p[0] + cos(2 * u) + p[1] * sin(4 * u), period=pi, parameters=("a", "r")
    )
    own = survey.evaluate(scene, a=[0.3, 4.0, 9.1], r=[-1.0, 0.4, 3.0])
    for a in own.a.values:
        for r in own.r.values:

            def slope(u, y, a=a, r=r):
                z = a + np.cos(2 * u) + r * np.sin(4 * u)
                return [y[1], -z * y[0], y[3], -z * y[2]]

            ends = solve_ivp(
                slope, (0, pi), [1, 0, 0, 1], method="DOP853", rtol=1e-12, atol=1e-12
            ).y[:, -1]
            here = own.sel(a=a, r=r)
            for name, value in zip(("y1", "dy1", "y2", "dy2"), ends, strict=True):
                assert abs(float(here[name]) - value) < 1e-9 + float(here[f"{name}_error"])
            assert int(here.verdict) == int(abs(ends[0] + ends[3]) < 2)


def bent(u, p):
    return p[0] if u < p[2] else p[1]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-6, 1.5396245461649855e-10, 1e-13])
def test_the_rounding_of_large_values_reaches_small_ones_beside_them(method, rtol):
    """z = 10^4, then 4 pi^2 in so few steps that its rounding, relative to 10^4, acts within the
    last of them.
    """
    a, b, place = 1e4, 39.47841760435743, 0.5642194903320384
    scene = survey.hill(
        bent, period=1.0, parameters=("a", "b", "place"), breaks=lambda p: [0.0, p[2]]
    )
    own = survey.evaluate(scene, a=a, b=b, place=place, method=method, rtol=rtol)
    with mp.workdps(40):
        flow = mp.eye(2)
        for z, length in ((mpf(a), mpf(place)), (mpf(b), 1 - mpf(place))):
            w = mp.sqrt(z)
            c, s = mp.cos(w * length), mp.sin(w * length)
            flow = mp.matrix([[c, s / w], [-w * s, c]]) * flow
        for name, true in zip(("y1", "y2", "dy1", "dy2"), flow, strict=True):
            assert abs(mpf(float(own[name])) - true) <= float(own[f"{name}_error"]), name


def lorentzian(u, p):
    x = (u - p[2]) / p[3]
    return p[0] + p[1] / (1.0 + x * x)


@pytest.mark.parametrize("rtol", [1e-4, 1e-6, 1e-8])
@pytest.mark.parametrize("width", [1e-2, 1e-3, 1.6429032378987633e-4])
def test_what_ten_nodes_take_for_lower_degrees_is_in_the_bars(rtol, width):
    """Next to a pole of z that lies closer to a break than a step is long, by solve_ivp in pieces."""
    p = a, b, c, d = 18.862271708754122, 42.95125459284832, 0.2807229970669972, width
    breaks = [c - 4 * d, c, c + 4 * d]
    scene = survey.hill(lorentzian, period=1.0, parameters=("a", "b", "c", "d"),
                        breaks=lambda p: [0.0, p[2] - 4 * p[3], p[2], p[2] + 4 * p[3]])  # fmt: skip
    own, y = survey.evaluate(scene, a=a, b=b, c=c, d=d, rtol=rtol), np.array([1.0, 0.0, 0.0, 1.0])

    def slope(u, y):
        z = lorentzian(u, p)
        return [y[1], -z * y[0], y[3], -z * y[2]]

    for low, high in itertools.pairwise([0.0, *breaks, c + 40 * d, 1.0]):
        y = solve_ivp(slope, (low, high), y, method="DOP853", rtol=3e-14, atol=1e-14).y[:, -1]
    for name, true in zip(("y1", "dy1", "y2", "dy2"), y, strict=True):
        assert abs(float(own[name]) - true) <= float(own[f"{name}_error"]) + 1e-12 * (
            1 + abs(true)
        ), name


def square(u, p):
    d = 0.5 * p[2] * pi
    return p[0] + p[1] if u < d or u > pi - d else p[0] - p[1]


def edges_of_square(p):
    return 0.5 * p[2] * pi, pi - 0.5 * p[2] * pi


def stair(u, p):
    return p[0] + p[1] if u < p[2] * pi else p[0] - p[1]


def closed_form(a, q, duty):
    """D of Meissner's equation, from the product of two propagators with constant z, for binary64's pi."""
    with mp.workdps(40):
        a, q, period = mpf(a), mpf(q), mpf(pi)
        trace = mp.eye(2)
        for z, length in ((a + q, mpf(duty) * period), (a - q, (1 - mpf(duty)) * period)):
            w = mp.sqrt(mp.mpc(z))
            s = mp.sin(w * length) / w if w else length
            trace = mp.matrix([[mp.cos(w * length), s], [-z * s, mp.cos(w * length)]]) * trace
        return mp.re(trace[0, 0] + trace[1, 1])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("z", "breaks", "even"),
    [(square, edges_of_square, True), (stair, lambda p: [0, p[2] * pi], False)],
)
def test_meissner_by_its_closed_form(z, breaks, even, method):
    scene = survey.hill(z, period=pi, parameters=("a", "q", "duty"), even=even, breaks=breaks)
    own = survey.evaluate(
        scene, a=[-3.0, 0.4, 7.3, 60.0], q=[0.0, 2.5, 11.0], duty=[0.01, 0.3, 0.5], method=method
    )
    flat = own.stack(point=("a", "q", "duty"))
    for a, q, duty, d, bar in zip(flat.a.values, flat.q.values, flat.duty.values, flat.discriminant.values,
                                  flat.discriminant_error.values, strict=True):  # fmt: skip
        error = abs(float(mpf(d) - closed_form(a, q, duty)))
        assert error <= bar
        if method == "auto":
            assert error < 1e-13 * (1 + abs(d)) and bar < 1e-11 * (1 + abs(d))


def test_where_a_square_wave_starts_does_not_matter():
    given = {"period": pi, "parameters": ("a", "q", "duty")}
    even = survey.hill(square, **given, even=True, breaks=edges_of_square)
    whole = survey.hill(stair, **given, breaks=lambda p: [0, p[2] * pi])
    point = {"a": [-3.0, 0.4, 7.3, 60.0], "q": [0.5, 2.5, 11.0], "duty": [0.01, 0.3, 0.5]}
    one, other = survey.evaluate(even, **point), survey.evaluate(whole, **point)
    assert within(one, other, ["discriminant", "exponent", "rotation_number"]) <= 1
    np.testing.assert_array_equal(one.verdict, other.verdict)


def ince(u, p):
    return p[0] + 4 * p[1] * p[2] * cos(2 * u) + 2 * p[2] * p[2] * cos(4 * u)


WHITTAKER_HILL = survey.hill(ince, period=pi, parameters=("a", "m", "alpha"), even=True)


@pytest.mark.parametrize(
    ("m", "closed", "exact"),
    [
        (1, (2, 4), {(2, 0): lambda x: -2 * x * x}),
        (
            2,
            (3, 5),
            {(0, 1): lambda x: 1 - 4 * x - 2 * x * x, (1, 1): lambda x: 1 + 4 * x - 2 * x * x},
        ),
        (3, (4,), {}),
    ],
)
def test_gaps_of_whittaker_and_hill_coexist(m, closed, exact, tmp_path):
    """Magnus and Winkler, chapter 7; the exact edges by substituting exp(alpha cos 2u) times 1, cos
    u, sin u.
    """
    axes = {"a": {"start": -12.0, "stop": 30.0, "num": 2}, "m": float(m), "alpha": 0.7}
    ds = survey.run(
        {"scene": WHITTAKER_HILL, "axes": axes, "boundaries": {"axis": "a"}},
        output=tmp_path / "o.nc",
    )
    place, bar, n = ds.edge_position.values, ds.edge_position_error.values, ds.edge_index.values
    assert int(ds.edge_complete) == 1 and n.tolist() == [0, *np.repeat(np.arange(1, 6), 2)]
    for index in range(1, 6):
        width, sure = float(np.ptp(place[n == index])), float(bar[n == index].sum())
        assert width <= sure < 1e-11 if index in closed else width > 1e-5
    for (kind, index), formula in exact.items():
        own = (n == index) & (ds.edge_class.values == kind)
        assert abs(float(place[own][0]) - formula(0.7)) <= float(bar[own][0]) + 1e-15
    for a in place[n == closed[0]]:  # both factors vanish: |D| = 2 without a gap
        here = survey.evaluate(WHITTAKER_HILL, a=a, m=m, alpha=0.7, rtol=1e-13)
        assert (
            abs(abs(float(here.discriminant)) - 2) <= float(here.discriminant_error)
            and int(here.verdict) != 0
        )


def test_what_rounding_leaves_of_z_is_in_the_bars():
    """z = (a + 1e7) - 1e7 - 2 q cos 2u has lost 7 digits: the bars say so, and hold the error."""
    rough = survey.hill(
        lambda u, p: (1e7 + (p[0] - 2 * p[1] * cos(2 * u))) - 1e7,
        period=pi,
        parameters=("a", "q"),
        even=True,
    )
    own, scene = survey.evaluate(rough, a=A, q=Q[1:]), survey.evaluate("mathieu", a=A, q=Q[1:])
    assert within(own, scene, ["discriminant", "exponent"]) <= 1
    assert 1e-11 < float((own.discriminant_error / (1 + abs(own.discriminant))).median()) < 1e-6


def test_what_is_not_smooth_or_not_even_or_no_number_costs_one_point():
    def z(u, p):
        return (
            2.0
            + p[0] * abs(cos(2 * u))
            + p[1] * cos(200 * u)
            + p[2] * sin(2 * u)
            + (p[3] - 1.0) ** 0.5
        )

    scene = survey.hill(z, period=pi, parameters=("bend", "b", "odd", "root"), even=True)
    bend, odd, root = np.zeros(9), np.zeros(9), np.ones(9)
    bend[1], odd[3], root[5] = 1.0, 1e-7, 0.5
    given = {
        name: xr.DataArray(v, dims="point")
        for name, v in (("bend", bend), ("odd", odd), ("root", root))
    }
    own = survey.evaluate(scene, b=5.0, **given)
    bad = status.INVALID_PARAMETERS
    assert own.status.values.tolist() == [0, status.NO_CONVERGENCE, 0, bad, 0, bad, 0, 0, 0]
    assert np.isnan(own.discriminant.values).tolist() == (own.status.values != 0).tolist()
    assert (
        "breaks" in own.status.attrs["comment"] and "even but is not" in own.status.attrs["comment"]
    )


def test_bits_do_not_depend_on_the_block(monkeypatch):
    scene = survey.hill(
        square, period=pi, parameters=("a", "q", "duty"), even=True, breaks=edges_of_square
    )
    point = {"a": A, "q": Q, "duty": [0.0, 0.2, 0.5, 1.0]}
    for one, given in ((scene, point), (SHIFTED, {"a": A, "q": Q})):
        whole = survey.evaluate(one, **given)
        monkeypatch.setattr(cost, "BLOCK_POINTS", 1)
        monkeypatch.setattr(cost, "IN_MEMORY", 1)
        xr.testing.assert_identical(whole.drop_attrs(), survey.evaluate(one, **given).drop_attrs())
        monkeypatch.undo()


def spike(u, p):
    return p[0] + p[1] / p[3] * np.exp(-(((u - p[2]) / p[3]) ** 2))


@pytest.mark.parametrize("seed", range(12))
def test_a_spike_is_seen_or_refused(seed):
    """Gaussian spikes of an area that matters, down to 1e-4 of the period; by solve_ivp in pieces
    about the spike.
    """
    random = np.random.default_rng(seed)
    a, area, at = random.uniform(1, 40), random.uniform(0.5, 3), random.uniform(0.02, 0.98)
    w = 10 ** random.uniform(-4, -2)
    try:
        own = survey.evaluate(SPIKE, a=a, area=area, at=at, w=w)
    except survey.BadInput as refusal:
        assert "spike near u" in str(refusal) or "not smooth" in str(refusal)
        return
    y = np.array([1.0, 0.0, 0.0, 1.0])
    for low, high in itertools.pairwise(
        np.unique(np.clip([0, *(at + w * np.array([-8, -4, -2, 0, 2, 4, 8])), 1], 0, 1))
    ):

        def slope(u, y):
            z = spike(u, (a, area, at, w))
            return [y[1], -z * y[0], y[3], -z * y[2]]

        y = solve_ivp(slope, (low, high), y, method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    assert abs(y[0] + y[3] - float(own.discriminant)) < 1e-8 * (1 + abs(y).max()) + float(
        own.discriminant_error
    )


SPIKE = survey.hill(spike, period=1.0, parameters=("a", "area", "at", "w"))


def test_a_spike_that_a_run_would_miss_is_refused_with_its_place_and_resolved_with_a_break_there():
    point = {"a": 4.0, "area": 2.0, "at": 0.3045, "w": 2e-4}
    with pytest.raises(
        survey.BadInput, match=r"z has a spike near u = 0\.304.*T/128; name its position in breaks"
    ):
        survey.evaluate(SPIKE, **point)
    breaks = {"breaks": lambda p: [p[2] - 8 * p[3], p[2], p[2] + 8 * p[3]]}
    named = survey.evaluate(
        survey.hill(spike, period=1.0, parameters=SPIKE.PARAMETERS, **breaks), **point
    )
    # as narrow as this it makes y' jump by its area times y, to the order of w
    trace = 2 * cos(2.0) - 2.0 * np.sqrt(pi) / 2 * sin(2.0)
    assert abs(float(named.discriminant) - trace) < 5e-3 and float(named.discriminant_error) < 1e-8
    assert named.attrs["z_resolved_width"] == 1 / 128 and "breaks" in named.attrs["z_resolution"]


def test_z_of_several_points_at_the_same_u_has_the_bits_of_each():
    rng = np.random.default_rng(3)
    u, points = rng.uniform(0, pi, (4, 50)), rng.normal(size=(3, 4, 3))
    found = user_equation.at(scaled, points, u)
    for own, values in zip(points, found, strict=True):
        assert (user_equation.at(scaled, own, u) == values).all()
        assert values[2, 7] == scaled(u[2, 7], own[2])
