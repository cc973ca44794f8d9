"""What pictures say: labels without repetition, one meaning for one colour, lines at |D| = 2,
ensembles, error bars.
"""

import math

import matplotlib
import numpy as np
import pytest
import xarray as xr

import survey
from survey.show import palette
from survey.show.text import label_of, title_of

matplotlib.use("Agg")


@pytest.fixture(scope="module")
def ds():
    return survey.evaluate("mathieu", a=np.linspace(-0.5, 3.0, 30), q=np.linspace(0.0, 1.0, 20))


def test_a_symbol_stands_once_and_the_unit_on_its_line():
    named = xr.DataArray(
        0.0, name="delta", attrs={"long_name": "delta", "symbol": r"\delta", "units": "1"}
    )
    assert label_of(named) == r"$\delta$"
    for parameter in survey.hill(lambda u, p: p[0], parameters=("delta", "c_1"), period=1.0).own:
        about = {"long_name": parameter.long_name, "symbol": parameter.symbol, "units": "1"}
        assert label_of(xr.DataArray(0.0, attrs=about)) == f"${parameter.symbol}$"
    long = xr.DataArray(
        0.0,
        name="x",
        attrs={"long_name": "a long name of a quantity", "symbol": "x", "units": "rad"},
    )
    for width in range(10, 40):
        assert "quantity, $x$ (rad)" in label_of(long, width)


@pytest.mark.parametrize(
    ("spelt", "shown"),
    [
        ("scaled momentum p_psi / sqrt|k|", r"scaled momentum $p_\psi$ / √|k|"),
        ("momentum p_phi where u = cos theta", r"momentum $p_\varphi$ where u = cos θ"),
        ("where the solution ends as t -> +inf", "where the solution ends as t → +∞"),
        ("does w -> -inf attract?", "does w → \N{MINUS SIGN}∞ attract?"),
        ("slower than sqrt(epsilon)", "slower than √ε"),
        ("strength of the field, 3 mu / R^3", "strength of the field, 3 mu / R³"),
        ("x-1 at 1e-3, thetas and R^n", "x-1 at 1e-3, thetas and R^n"),
    ],
)
def test_letters_roots_and_powers_are_printed(spelt, shown):
    variable = xr.DataArray(0.0, attrs={"long_name": spelt})
    assert label_of(variable, 80) == shown
    ds = xr.Dataset({"v": ((), 0.0)}, attrs={"title": spelt})
    assert title_of(ds, ds.v.assign_attrs(long_name=spelt)) == shown


@pytest.mark.parametrize(
    ("units", "shown"), [("rad s-1", "(rad s⁻¹)"), ("m2 s-2", "(m² s⁻²)"), ("kg", "(kg)")]
)
def test_units_have_their_powers_raised(units, shown):
    rate = xr.DataArray(
        0.0, name="n", attrs={"long_name": "rate", "symbol": r"\Omega", "units": units}
    )
    assert label_of(rate).replace("\N{NO-BREAK SPACE}", " ") == rf"rate, $\Omega$ {shown}"


def test_the_number_of_an_orbit_stands_in_the_title_where_it_tells_it_from_others(ds):
    for number, words in (
        (-1.0, "stability of the linear motion"),
        (1.0, "stability of the linear motion\ni = 1"),
    ):
        branch = xr.DataArray(number, name="branch", attrs={"symbol": "i"})
        assert title_of(
            ds.assign_attrs(title=""), ds.verdict.assign_coords(branch=branch)
        ).strip() == words.replace("i = 1", "$i = 1$")


def test_titles_have_no_internals_and_repeat_nothing(ds):
    shown = ds.assign_attrs(
        title="A map, stability of the linear motion",
        options="question=fate, direction=1, body=prolate",
    )
    assert title_of(shown, shown.verdict) == "A map, stability of the linear motion (prolate)"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("question=rotation, axis=A", " (rotation about the axis of A)"),
        ("separatrix=unstable, side=right", " (unstable separatrix, right side)"),
        ("motion=at_t", ""),
    ],
)
def test_titles_say_in_words_what_options_are(ds, options, words):
    shown = ds.assign_attrs(title="Stability of the linear motion", options=options)
    assert title_of(shown, shown.verdict) == f"Stability of the linear motion{words}"


def test_orange_means_unstable_alone():
    assert (
        palette.colours_of({"undecided": -1, "unstable": 0, "stable": 1})["unstable"]
        == palette.COLOURS[0]
    )
    fates = survey.scenes.load("gyrostat").OUTPUTS
    for output in fates:
        if output.flags is not None:
            colours = palette.colours_of(output.flags)
            meant = [colours[name] for name in output.flags if name != "undecided"]
            assert palette.COLOURS[0] not in meant and len(set(meant)) == len(meant)


@pytest.mark.parametrize("scene", survey.scenes())
def test_one_colour_has_one_meaning(scene):
    """Orange: unstable; light blue: stable; no two meanings of a variable share a colour."""
    for output in survey.scenes.load(scene).OUTPUTS:
        if output.flags is None:
            continue
        colours = palette.colours_of(output.flags)
        meant = {
            name: colours[name] for name in output.flags if name not in ("undecided", "ok", "none")
        }
        assert len(set(meant.values())) == len(meant)
        for name, colour in meant.items():
            assert colour != palette.COLOURS[0] or "unstable" in name, name
            assert colour != palette.COLOURS[1] or ("stab" in name and "unstable" not in name), name


def test_the_discriminant_has_lines_at_2_and_a_diverging_map(ds):
    axes = ds.survey.map("discriminant")
    lines = [c for c in axes.collections if type(c).__name__ == "QuadContourSet"]
    assert [sorted(c.levels) for c in lines] == [[-2.0, 2.0]] and axes.collections[
        0
    ].get_cmap().name == "RdBu_r"
    row = ds.survey.slice(q=0.5).survey.map("discriminant")
    assert sorted(line.get_ydata()[0] for line in row.lines if len(set(line.get_ydata())) == 1) == [
        -2.0,
        2.0,
    ]


def contours(axes):
    return [c for c in axes.collections if type(c).__name__ == "QuadContourSet"]


def test_the_coarse_lines_at_2_are_left_out_where_exact_edges_are_drawn(tmp_path):
    axes = {"a": {"start": 0.5, "stop": 5.0, "num": 12}, "q": {"start": 0.1, "stop": 1.0, "num": 9}}
    asked = {"scene": "mathieu", "axes": axes, "boundaries": {"axis": "a"}}
    made = survey.run(asked, output=tmp_path / "tongues.nc")
    exact = made.survey.map("discriminant")
    assert exact.lines and not contours(exact)
    assert contours(made.survey.map("discriminant", boundaries=False))


def test_lines_at_2_are_drawn_only_where_stability_ends_there():
    damped = survey.hill(
        lambda u, p: p[0] - 2 * p[1] * math.cos(2 * u),
        period=math.pi,
        parameters=("a", "q"),
        damping=0.2,
    )
    made = survey.evaluate(damped, a=np.linspace(0.0, 2.0, 9), q=np.linspace(0.5, 2.0, 8))
    assert abs(made.discriminant).max() > 2.0 and not contours(made.survey.map("discriminant"))
    assert not level_lines(made.survey.slice(q=2.0).survey.map("discriminant"))
    other = survey.evaluate("libration", mu=np.linspace(0.002, 0.01, 9))
    assert not level_lines(other.survey.map("discriminant"))


def level_lines(axes):
    return [line for line in axes.lines if len(set(line.get_ydata())) == 1]


def test_error_bars_are_drawn(ds):
    drawn = ds.survey.map("discriminant_error").collections[0]
    np.testing.assert_allclose(np.nanmax(drawn.get_array()), float(ds.discriminant_error.max()))
    with pytest.raises(survey.BadInput, match="unknown variable 'verdict_error'"):
        ds.survey.map("verdict_error")


def test_ensembles_are_scattered_over_their_parameters():
    random = np.random.default_rng(1)
    points = {
        name: xr.DataArray(random.uniform(0.0, 2.0, 40), dims="sample") for name in ("a", "q")
    }
    made = survey.evaluate("mathieu", **points)
    axes = made.survey.map()
    assert axes.get_xlabel().endswith("$a$") and axes.get_ylabel().endswith("$q$")
    offsets = np.concatenate([c.get_offsets() for c in axes.collections])
    assert sorted(map(tuple, offsets)) == sorted(zip(made.a.values, made.q.values, strict=True))
    assert made.survey.map("discriminant").collections[0].get_offsets().shape == (40, 2)


def drawn_a(number=40):
    return xr.DataArray(np.random.default_rng(2).uniform(0.0, 4.0, number), dims="draw")


def test_draws_of_one_parameter_are_a_profile_over_it():
    made = survey.evaluate("mathieu", a=drawn_a(), q=[0.5])
    for ds in (made, made.isel(q=0)):
        axes = ds.survey.map()
        heights = [text.get_text() for text in axes.get_yticklabels()]
        shown = {x: heights[int(y)] for line in axes.lines for x, y in line.get_xydata()}
        words = ds.survey.names().values.ravel().tolist()
        assert axes.get_xlabel().endswith("$a$") and shown == dict(
            zip(made.a.values, words, strict=True)
        )
        axes = ds.survey.map("discriminant")
        order = np.argsort(made.a.values)
        x, y = axes.lines[0].get_xydata().T
        assert x.tolist() == made.a.values[order].tolist() and axes.get_xlabel().endswith("$a$")
        assert y.tolist() == made.discriminant.values[order, 0].tolist()


def test_draws_of_one_parameter_and_an_axis_are_scattered_over_both():
    made = survey.evaluate("mathieu", a=drawn_a(), q=[0.5, 1.0])
    pairs = sorted((a, q) for a in made.a.values for q in made.q.values)
    for name in ("verdict", "discriminant"):
        axes = made.survey.map(name)
        assert axes.get_xlabel().endswith("$a$") and axes.get_ylabel().endswith("$q$")
        offsets = np.concatenate(
            [c.get_offsets() for c in axes.collections if len(c.get_offsets())]
        )
        assert sorted(map(tuple, offsets)) == pairs
    assert made.survey.map("discriminant", x="q").get_ylabel().endswith("$a$")


def test_an_ensemble_of_a_variable_with_a_further_dimension_shows_its_first_place():
    mu = xr.DataArray(np.linspace(0.002, 0.01, 5), dims="draw")
    made = survey.evaluate("libration", mu=mu).assign_coords(other=("draw", np.arange(5.0)))
    assert "monomial 200" in made.survey.map("c").get_title()


def test_narrow_tongues_are_lines_in_the_colour_of_instability(tmp_path):
    """Edges of tongues narrower than the grid coincide: between their dashes the tongue itself is
    seen, undotted.
    """
    axes = {
        "a": {"start": 0.5, "stop": 10.0, "num": 12},
        "q": {"start": 0.1, "stop": 1.0, "num": 4},
    }
    made = survey.run(
        {"scene": "mathieu", "axes": axes, "boundaries": {"axis": "a"}},
        output=tmp_path / "tongues.nc",
    )
    for name, colour in (("verdict", palette.COLOURS[0]), ("exponent", None)):
        dashed = [line for line in made.survey.map(name).lines if line.is_dashed()]
        assert dashed and {line.get_gapcolor() for line in dashed} == {colour}


def test_limits_and_colour_maps_are_checked_for_verdicts_too(ds):
    for wrong in (
        {"vmin": "a"},
        {"vmin": 2, "vmax": 1},
        {"vmax": np.inf},
        {"cmap": "virids"},
        {"cmap": 3},
    ):
        for name in ("verdict", "exponent"):
            with pytest.raises(survey.BadInput):
                ds.survey.map(name, **wrong)
