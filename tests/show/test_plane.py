"""With three axes or more, pictures and the viewer begin with the same plane."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import survey
from survey.viewer.shown import ShownMap

TWO, THREE = [0.4, 0.8], [0.1, 0.2, 0.3]


def own():
    return survey.hill(
        lambda t, p: p[0] + p[1] * np.cos(2 * t) + p[2],
        period=np.pi, parameters=("a", "q", "c"), even=True,
    )  # fmt: skip


CASES = {
    "first_two": (own, {"a": TWO, "q": THREE, "c": [0.0, 0.1]}, ("a", "q"), {"c": 0}),
    "one_value": (own, {"a": [0.4], "q": THREE, "c": TWO}, ("q", "c"), {"a": 0}),
    "abel": (lambda: "gyrostat", {"w0": THREE, "phi": [0.0, 0.5, 1.0], "s2": TWO}, ("w0", "s2"), {"phi": 2}),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_pictures_and_the_viewer_begin_with_the_same_plane(name):
    scene, axes, dims, further = CASES[name]
    options = {"question": "abel"} if name == "abel" else {}
    ds = survey.evaluate(scene(), **axes, **options)
    shown = ShownMap("map.nc", ds)
    view = shown.read("")
    assert shown.dims == dims and "at_" not in shown.link(view)
    assert {dim: at for dim, at in view.others.items() if dim in axes} == further
    output = "w_error" if name == "abel" else "discriminant"
    pictures = [ds.survey.map(output), ds.isel(further).survey.map(output)]
    first, same = (
        (
            axis.get_xlabel(),
            axis.get_ylabel(),
            np.ma.filled(axis.collections[0].get_array(), np.nan),
        )
        for axis in pictures
    )
    for axis in pictures:
        plt.close(axis.figure)
    assert first[:2] == same[:2]
    np.testing.assert_array_equal(first[2], same[2])
