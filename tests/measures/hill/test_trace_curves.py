"""Curves of Hill's equations that are not even, or damped: against Mathieu's values and `survey.floquet`."""

import math

import numpy as np
import pytest
import xarray as xr
from scipy import special

import survey
from survey.errors import BadInput
from survey.measures.floquet.curves import CLASSES
from survey.measures.hill import trace_curves
from survey.request.workflow import check
from survey.sweep import boundaries

WIDTHS = {"q": 2.5, "a": 8.0}


def shifted(u, p):
    """Mathieu's equation, begun an eighth of its period later."""
    return p[0] - 2 * p[1] * math.sin(2 * u)


def mathieu(u, p):
    return p[0] - 2 * p[1] * math.cos(2 * u)


SHIFTED = survey.hill(shifted, period=math.pi, parameters=("a", "q"))
DAMPED = survey.hill(mathieu, period=math.pi, parameters=("a", "q", "c"), even=True, damping="c")


def curves(scene, **fixed):
    axes = {"q": {"start": 0.5, "stop": 3.0, "num": 3}, "a": {"start": -2.0, "stop": 6.0, "num": 3}}
    return boundaries.find(check({"scene": scene, "axes": axes | fixed, "boundaries": {}}))


def characteristic(q):
    """{class: values (curves, len(q))} on which Mathieu's equation has a multiplier 1 or -1."""
    even = [special.mathieu_a(0, q), *(f(2, q) for f in (special.mathieu_a, special.mathieu_b))]
    odd = [f(n, q) for n in (1, 3) for f in (special.mathieu_a, special.mathieu_b)]
    return {CLASSES["plus_one"]: np.array(even), CLASSES["minus_one"]: np.array(odd)}


def test_the_edges_of_an_equation_that_is_not_even():
    edge = survey.edge(SHIFTED, along="a", q=1.5, a=(-3.0, 12.0))
    for kind, values in characteristic(np.array([1.5])).items():
        own = edge.edge_class == kind
        assert own.sum() == len(values)
        off = abs(edge.edge[own].values - np.sort(values[:, 0]))
        assert (off <= edge.edge_error[own].values + 1e-13).all() and edge.edge_error[
            own
        ].max() < 1e-9
    margin = survey.evaluate(SHIFTED, a=1.0, q=1.5).survey.margin()
    assert set(margin.parameter.values) == {"a", "q"} and (margin.edge_error < 1e-9).all()


def test_the_curves_of_an_equation_that_is_not_even():
    ds = curves(SHIFTED)
    kind = np.repeat(ds.curve_class.values, ds.curve_count.values)
    for code, values in characteristic(ds.curve_q.values).items():
        off = abs(ds.curve_a.values - values).min(axis=0) / WIDTHS["a"]
        assert (off <= ds.curve_position_error.values + 1e-13)[kind == code].all()
        for value in values:  # every curve on the map is drawn, nearly to its ends
            on = (abs(ds.curve_a.values - value) < 1e-6) & (kind == code)
            here = (value > -1.9) & (value < 5.9)
            assert not here.any() or np.ptp(ds.curve_q.values[on]) > 0.9 * np.ptp(
                ds.curve_q.values[here]
            )


def test_narrow_tongues_and_bands_are_drawn_whole():
    """Tongues a millionth of the map wide at small q, and bands as narrow at the bottom right."""
    axes = {
        "q": {"start": 0.0, "stop": 10.0, "num": 3},
        "a": {"start": -12.0, "stop": 40.0, "num": 3},
    }
    ds = boundaries.find(check({"scene": SHIFTED, "axes": axes, "boundaries": {}}))
    assert "curves_unexplained" not in ds.attrs and ds.curve_position_error.max() < 1e-12
    # a0 to a6 and b1 to b6, none in pieces
    assert np.bincount(ds.curve_class.values).tolist() == [0, 7, 6]
    start = np.cumsum(ds.curve_count.values) - ds.curve_count.values
    ends = np.stack([start, start + ds.curve_count.values - 1])
    on_border = (
        np.isin(ds.curve_q.values, [0.0, 10.0]) | np.isin(ds.curve_a.values, [-12.0, 40.0])
    )[ends]
    assert on_border.all()
    kind = np.repeat(ds.curve_class.values, ds.curve_count.values)
    q = ds.curve_q.values
    plus = [
        *(special.mathieu_a(n, q) for n in (0, 2, 4, 6)),
        *(special.mathieu_b(n, q) for n in (2, 4, 6)),
    ]
    minus = [f(n, q) for n in (1, 3, 5) for f in (special.mathieu_a, special.mathieu_b)]
    for code, values in ((CLASSES["plus_one"], plus), (CLASSES["minus_one"], minus)):
        off = abs(ds.curve_a.values - np.array(values)).min(axis=0) / 52.0
        assert (off <= ds.curve_position_error.values + 1e-13)[kind == code].all()


@pytest.mark.slow
def test_a_missing_curve_is_found_by_counting_or_noticed(monkeypatch):
    """By the number outside the circle; by the number of edges that verdict and rotation number count."""
    whole = curves(SHIFTED)
    lines = trace_curves.curves._lines
    monkeypatch.setattr(trace_curves.curves, "_lines", lambda *args: lines(*args)[1:])
    found = curves(SHIFTED)
    assert "curves_unexplained" not in found.attrs
    assert sorted(found.curve_class.values) == sorted(whole.curve_class.values)
    monkeypatch.setattr(trace_curves.curves.narrow, "counted", lambda *args: [])
    assert curves(SHIFTED).attrs["curves_unexplained"] > 0


def test_verdicts_beside_an_edge_need_no_double_double():
    """A narrow tongue is known to the error bars of the four values, where D - 2 is lost in that of D."""
    q, place = 0.1, np.array([-1e-9, 1e-9])
    a = np.concatenate([f(3, q) + place for f in (special.mathieu_b, special.mathieu_a)])
    ds = survey.evaluate(SHIFTED, a=a, q=q, method="taylor16")
    assert ds.verdict.values.ravel().tolist() == [1, 0, 0, 1]
    assert (abs(abs(ds.discriminant) - 2.0) < 1e-11).all() and (ds.discriminant_error < 1e-14).all()


def test_damped_curves_lie_where_the_linear_system_has_them():
    ds = curves(DAMPED, c=0.1)
    assert "curves_unexplained" not in ds.attrs and ds.curve_position_error.max() < 1e-6

    def matrix(t, p, out):
        out[0, 1], out[1, 0], out[1, 1] = 1.0, -mathieu(t, p), -2.0 * p[2]

    system = survey.floquet(matrix, period=math.pi, parameters=("a", "q", "c"), states=("y", "v"))
    kind = np.repeat(ds.curve_class.values, ds.curve_count.values)
    at = {name: xr.DataArray(ds[f"curve_{name}"].values, dims="point") for name in ("q", "a")}
    found = survey.evaluate(system, c=0.1, **at)
    goal = np.where(kind == CLASSES["plus_one"], 1.0, -1.0)
    off = abs(found.multiplier_re.values - goal[:, None]).min(axis=1)
    # multipliers change by less than 50 where a changes by 1
    assert (
        off
        <= found.multiplier_re_error.values.max(axis=1) + 50 * 8 * ds.curve_position_error.values
    ).all()
    assert ds.curve_class.values.tolist() == [1, 1, 2, 2]  # tongues are rounded off


def test_the_damping_that_closes_a_tongue():
    """With the damping c, |D| = 2 cosh(c T) of the undamped equation with a - c^2 is where
    stability is lost.
    """
    edge = survey.edge(DAMPED, along="c", a=1.0, q=0.5, c=(0.01, 1.0))
    c = float(edge.edge[0])
    plain = survey.evaluate("mathieu", a=1.0 - c * c, q=0.5)
    assert edge.edge.size == 1 and int(edge.edge_class[0]) == CLASSES["minus_one"]
    assert abs(abs(float(plain.discriminant)) - 2 * math.cosh(c * math.pi)) < 1e-10
    sides = survey.evaluate(DAMPED, a=1.0, q=0.5, c=[c - 1e-9, c + 1e-9])
    assert sides.verdict.values.tolist() == [0, 1]


def test_cells_of_damped_equations_are_refused():
    axes = {
        "q": {"start": 0.5, "stop": 3.0, "num": 3},
        "a": {"start": -2.0, "stop": 6.0, "num": 3},
        "c": 0.1,
    }
    with pytest.raises(BadInput, match="only for undamped equations"):
        check({"scene": DAMPED, "axes": axes, "refine": {"width": 0.1}})
