"""Boundaries of Clebsch's case, against the closed form (7) in 30 digits, and verdicts on either side."""

import numpy as np
import pytest
import xarray as xr
from mpmath import mp

import survey
from survey import BadInput

BODY = {"A": 2.0, "B": 1.5, "C": 1.0, "epsilon": 1.0}


def test_the_critical_rate_is_the_boundary_along_Omega():
    found = survey.edge("brun_triaxial", along="Omega", near=0.1, axis="A", **BODY)
    with mp.workdps(30):
        wanted = float(mp.sin(mp.asin(mp.sqrt(mp.mpf(3) / 4)) + mp.asin(mp.sqrt(mp.mpf(1) / 2))))
    assert found.edge_class.values.tolist() == [0, 0]
    assert (abs(found.edge.values - [-wanted, wanted]) <= found.edge_error.values).all()
    assert (found.edge_error.values < 1e-11).all()


def test_along_a_moment_all_changes_of_the_verdict_are_found():
    """About the axis of the least, the middle and the largest moment, in turn."""
    others = {"B": 1.5, "C": 1.0, "epsilon": 1.0, "Omega": 0.9, "axis": "A"}
    found = survey.edge("brun_triaxial", along="A", A=(0.5001, 2.4999), **others)
    assert found.edge_class.values.tolist() == [1, 1, 0]
    assert found.edge.values[:2].tolist() == [1.0, 1.5] and found.attrs["complete"] == 1
    aside = (1e-13 + 10 * found.edge_error.values[:, None]) * [-1, 1] + found.edge.values[:, None]
    beside = survey.evaluate("brun_triaxial", A=aside.ravel(), **others)
    assert beside.verdict.values.reshape(3, 2).tolist() == [[1, 0], [0, 1], [1, 0]]


@pytest.mark.parametrize("epsilon", [1.0, -1.0])
@pytest.mark.parametrize("axis", "ABC")
def test_curves_on_a_map_of_shapes_part_the_verdicts(tmp_path, epsilon, axis):
    """On either side of every third point, along the normal."""
    moments = {name: {"start": 0.2, "stop": 1.7, "num": 12} for name in ("A", "B")}
    ds = survey.run({
        "scene": "brun_triaxial", "options": {"axis": axis}, "boundaries": {},
        "axes": moments | {"C": 1.0, "epsilon": epsilon, "Omega": 0.8}, "output": {"path": str(tmp_path / "map.nc")},
    })  # fmt: skip
    x = np.stack([ds.curve_A.values, ds.curve_B.values])
    first = np.cumsum(ds.curve_count.values) - ds.curve_count.values
    inner = np.setdiff1d(np.arange(x.shape[1]), [*first, *(first + ds.curve_count.values - 1)])[::3]
    along = x[:, inner + 1] - x[:, inner - 1]
    aside = 1e-7 * np.stack([-along[1], along[0]]) / np.hypot(*along)
    verdicts = []
    for side in (1, -1):
        a, b = (xr.DataArray(values, dims="row") for values in x[:, inner] + side * aside)
        found = survey.evaluate(
            "brun_triaxial", axis=axis, A=a, B=b, C=1.0, epsilon=epsilon, Omega=0.8
        )
        verdicts.append(found.verdict.values)
    assert inner.size > 20
    assert (np.sort(verdicts, axis=0) == [[0], [1]]).all()


def test_margins_of_a_rotation():
    point = survey.evaluate("brun_triaxial", axis="A", **BODY, Omega=0.9)
    margin = point.survey.margin()
    distance = dict(zip(margin.parameter.values.tolist(), margin.distance.values, strict=True))
    assert distance["Omega"] == pytest.approx(float(point.critical_rate) - 0.9, abs=1e-10)
    assert distance["epsilon"] == pytest.approx(
        (0.9 / float(point.critical_rate)) ** 2 - 1.0, abs=1e-8
    )
    # nearer than where the search is coarse
    assert distance["A"] == pytest.approx(1.7677 - 2.0, abs=1e-3)


def test_stability_of_critical_motions_has_its_boundary():
    given = {"A": 2.0, "B": 1.5, "C": 1.0, "epsilon": -1.0, "sigma": -0.6, "question": "critical"}
    found = survey.edge("brun_triaxial", along="p_psi", p_psi=(0.0, 9.0), **given)
    assert found.edge.size == 1
    aside = found.edge.values + 10 * found.edge_error.values * np.array([-1.0, 1.0])
    assert sorted(
        survey.evaluate("brun_triaxial", p_psi=aside, **given).verdict.values.tolist()
    ) == [0, 1]


def test_boundaries_next_to_the_ends_of_the_critical_motions_are_found():
    """Of motions on a short part of the line: where the product in (12) vanishes, in multiprecision."""
    moments, epsilon, p = (1.0770838, 1.4884492, 1.2128309), -2.2038222, 0.0363895
    given = dict(zip("ABC", moments, strict=True)) | {"epsilon": epsilon, "p_psi": p}
    found = survey.edge(
        "brun_triaxial", along="sigma", sigma=(-3.0, 3.0), question="critical", **given
    )
    assert found.edge.values == pytest.approx([-0.81781, -0.68189], abs=1e-4)
    for edge, error in zip(found.edge.values, found.edge_error.values, strict=True):
        with mp.workdps(30):
            low, high = (
                certificate(mp.mpf(edge) + side * error, moments, epsilon, p) for side in (-1, 1)
            )
        assert low * high < 0 and error < 1e-10


def certificate(sigma, moments, epsilon, p):
    """The bracket in (12)."""
    factors = [1 + sigma * mp.mpf(A) for A in moments]
    one, two, three = (A / factor for A, factor in zip(moments, factors, strict=True))
    y = p / mp.sqrt(mp.mpf(epsilon) * mp.fprod(factors))
    half, second = (one + two + three) / 2, one * two + one * three + two * three
    return (half * half - second) * y + one * two * three


@pytest.mark.parametrize(
    ("scene", "given", "words"),
    [
        (
            "brun_triaxial",
            {"along": "omega1", "question": "trajectory", "t": 1.0, **BODY},
            "no boundaries are known along omega1",
        ),
        (
            "brun_triaxial",
            {"along": "A", "question": "trajectory", "t": 1.0, "B": 1.5, "C": 1.0},
            "has no verdict",
        ),
        ("gyrostat_body", {"along": "A11"}, "no boundaries are known for the scene gyrostat_body"),
    ],
)
def test_what_has_no_boundaries_says_so(scene, given, words):
    with pytest.raises(BadInput, match=words) as error:
        survey.edge(scene, near=1.0, **given)
    assert "\n" not in str(error.value)


def test_a_body_that_cannot_exist_has_no_critical_rate():
    """One moment exceeds the sum of the others, by a little or by much; at equality the body is a plate."""
    body = {"along": "Omega", "Omega": (-9.0, 9.0), "axis": "B", "A": 0.5, "B": 1.0}
    for C in (0.3, 0.4999):
        with pytest.raises(BadInput, match="no moment of inertia may exceed the sum of the others"):
            survey.edge("brun_triaxial", **body, C=C)
    assert survey.edge("brun_triaxial", **body, C=0.5).place.size == 2
