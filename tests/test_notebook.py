"""What Python and a notebook show: names, reprs, tables, and errors in a line."""

import re
from math import cos, pi

import pytest

import survey


def z(u, p):
    return p[0] - 2 * p[1] * cos(2 * u)


OWN = {
    "hill": lambda: survey.hill(z, period=pi, even=True, parameters=("a", "q")),
    "abel": lambda: survey.abel(lambda phi, p: -p[0], lambda phi, p: -phi, parameters=("c",)),
}


def test_the_package_shows_its_public_names():
    assert dir(survey) == [*sorted(survey.__all__), "__version__"] or set(dir(survey)) == {
        *survey.__all__,
        "__version__",
    }
    assert all(getattr(survey, name) is not None for name in dir(survey))
    assert re.fullmatch(r"\d+\.\d+\.\d+.*", survey.__version__)


@pytest.mark.parametrize("kind", OWN)
def test_scenes_of_ones_own_show_what_they_take_and_give(kind):
    scene = OWN[kind]()
    text, page = repr(scene), scene._repr_html_()
    assert (
        "outputs: " in text
        and "object at 0x" not in text
        and page.startswith("<div")
        and "<table>" in page
    )
    for p in scene.PARAMETERS:
        assert f"  {p.name}: " in text and f"<th>{p.name}</th>" in page


def test_a_survey_is_shown_as_a_table():
    ds = survey.evaluate("mathieu", a=[0.5, 2.0], q=0.3)
    page = ds.survey._repr_html_()
    assert "0.5 to 2.0, 2 values" in page and "<td" in page and "stable: " in page
    hostile = ds.assign_attrs(title="<script>alert(1)</script>")
    assert "<script>" not in hostile.survey._repr_html_()


def test_the_scenes_are_listed():
    found = survey.scenes()
    assert isinstance(found, dict) and found == dict(found)
    lines = repr(found).splitlines()
    assert len(lines) == len(found) and lines[0].split() == ["brun", *found["brun"].split()]
    assert found._repr_html_().count("<tr>") == len(found)


def test_a_scene_is_described():
    described = survey.describe("satellite")
    assert described["parameters"]["rho"] and described["methods"]["auto"]
    assert (
        "parameters:" in repr(described)
        and "  rho " in repr(described)
        and "<table>" in described._repr_html_()
    )
    assert "a" in survey.describe(OWN["hill"]())["parameters"]
    ds = survey.evaluate("satellite", k=0.5, rho=1.0)
    assert survey.describe(ds) == described == survey.describe(ds.verdict.assign_attrs(ds.attrs))
    with pytest.raises(survey.BadInput, match="describe: this dataset was not written by survey"):
        survey.describe(ds.verdict)
    with pytest.raises(survey.BadInput, match="did you mean 'satellite'"):
        survey.describe("satelite")


def test_ipython_shows_an_error_in_its_line():
    with pytest.raises(survey.BadInput) as caught:
        survey.evaluate("satellite", k=0.5)
    lines = caught.value._render_traceback_()
    assert lines == [f"BadInput: {caught.value}"] and "rho is missing" in lines[0]
