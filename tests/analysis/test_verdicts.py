"""Verdicts as counts, masks and words, and masks of several surveys combined and drawn."""

import matplotlib
import numpy as np
import pytest

import survey

matplotlib.use("Agg")


@pytest.fixture(scope="module")
def two():
    axes = {"a": np.linspace(-0.5, 2.0, 12), "q": np.linspace(0.0, 1.0, 9)}
    return survey.evaluate("mathieu", **axes), survey.evaluate(
        "mathieu", a=axes["a"], q=-axes["q"]
    ).assign_coords(q=axes["q"])


def test_counts_masks_and_names_agree(two):
    ds = two[0]
    counts = ds.survey.counts()
    assert (
        counts["verdict"]["stable"] + counts["verdict"]["unstable"] + counts["verdict"]["marginal"]
        == 108
    )
    for name, number in counts["verdict"].items():
        assert int(ds.survey.where(name).sum()) == number == int((ds.survey.names() == name).sum())
    assert int(ds.survey.where("ok").sum()) == 108
    means = ds.exponent.groupby(ds.survey.names()).mean()
    assert (
        float(means.sel(verdict_name="stable")) == 0.0 < float(means.sel(verdict_name="unstable"))
    )
    with pytest.raises(
        survey.BadInput, match="unknown verdict or status 'stabel'; did you mean 'stable'"
    ):
        ds.survey.where("stabel")


def test_a_point_without_an_answer_counts_by_its_status():
    ds = survey.evaluate("satellite", k=[0.5, 1.0], rho=1.0)
    assert ds.survey.names().values.tolist() == ["stable", "invalid_parameters"]
    assert ds.survey.where("invalid_parameters").values.tolist() == [False, True]
    assert not ds.survey.where("undecided").any()


def test_combined_verdicts_are_drawn(two):
    both = two[0].survey.where("stable") & two[1].survey.where("stable")
    axes = two[0].survey.map(both)
    labels = [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert f"yes ({int(both.sum()):,})" in labels and f"no ({int((~both).sum()):,})" in labels
    for plain in (both.values, both.variable):
        other = two[0].survey.map(plain)
        assert [text.get_text() for text in other.figure.legends[0].get_texts()] == labels
    with pytest.raises(survey.BadInput, match="holds booleans"):
        two[0].survey.map(both.values[:3])
    with pytest.raises(survey.BadInput, match="are not those of the survey"):
        two[0].survey.map(both.isel(a=slice(1, None)))
    with pytest.raises(survey.BadInput, match="holds booleans"):
        two[0].survey.map(two[0].exponent)


def test_the_title_of_a_mask_is_true(two):
    stable = two[0].survey.where("stable")
    for mask, title in (
        (stable, "\nstable"),
        (~stable, "\ncombined verdict"),
        (stable ^ (two[0].a > 1.0), "\ncombined verdict"),
        ((~stable).rename("lost_to_both"), "\nlost to both"),
        (two[0].discriminant > 0, "\ncombined verdict"),
    ):
        assert title in two[0].survey.map(mask).get_title()


def test_axes_and_colours_of_a_map_are_chosen(two):
    ds = two[0]
    axes = ds.survey.map("discriminant", x="q", y="a", cmap="magma", vmin=-3.0, vmax=3.0)
    assert "$q$" in axes.get_xlabel() and "$a$" in axes.get_ylabel()
    drawn = axes.collections[0]
    assert drawn.get_cmap().name == "magma" and drawn.get_clim() == (-3.0, 3.0)
    bar = next(other for other in axes.figure.axes if other.get_label() == "<colorbar>")
    assert bar._colorbar.extend == "both"
    curve = ds.survey.slice(q=0.5).survey.map("discriminant", vmin=-3.0, vmax=3.0)
    assert curve.get_ylim() == (-3.0, 3.0)
    full = ds.survey.map("discriminant", robust=False).collections[0]
    assert full.get_clim()[1] == float(abs(ds.discriminant).max())  # diverging about 0
    assert full.get_cmap().name == "RdBu_r" and full.get_clim()[0] == -full.get_clim()[1]
    assert ds.survey.map("exponent").collections[0].get_cmap().name == "viridis"
    for keywords, match in (
        ({"x": "aa"}, "x: unknown axis 'aa'; did you mean 'a'"),
        ({"x": "a", "y": "a"}, "x and y are both 'a'"),
        (
            {"var": "exponent", "cmap": "viridi"},
            "cmap: unknown colour map 'viridi'; did you mean 'viridis'",
        ),
    ):
        with pytest.raises(survey.BadInput, match=match):
            ds.survey.map(**keywords)
