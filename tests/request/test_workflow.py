"""TOML -> a checked workflow: what is right is taken as it stands, what is wrong is refused by name."""

import tomllib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import survey
from survey.errors import BadInput
from survey.request import workflow

GOOD = """
scene = "satellite"
[axes]
k   = { start = 0.1, stop = 0.9, num = 5 }
rho = { values = [0.6, 1.0, 4.0] }
[output]
path = "map.nc"
"""


def check(text, *overrides):
    data = tomllib.loads(text)
    for override in overrides:
        workflow._apply(data, override)
    return workflow.check(data)


def test_axes_are_the_dimensions_in_order():
    grid = check(GOOD).grid
    assert dict(grid.sizes) == {"k": 5, "rho": 3}
    np.testing.assert_array_equal(grid.parameters["k"][1], np.linspace(0.1, 0.9, 5))


def test_defaults_are_filled_in():
    checked = check(GOOD)
    assert checked.request.options == {"body": "prolate"}
    assert (checked.request.method, checked.request.rtol, checked.title) == (
        "auto",
        1e-10,
        checked.scene.TITLE,
    )


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (["axis.k.num=3"], ["unknown key axis", "'axes'"]),
        (["axes.k.number=3"], ["unknown key axes.k.number", "'num'"]),
        (["solver.metod=auto"], ["unknown key solver.metod", "'method'"]),
        (["axes.kk.values=[1.0]"], ["parameter of scene satellite 'kk'", "did you mean 'k'"]),
        (
            ["axes.kk.num=40"],
            ["axes.kk: unknown parameter of scene satellite 'kk'; did you mean 'k'? (allowed: k, "],
        ),
        (
            ["axes.K.num=40"],
            ["axes.K: unknown parameter of scene satellite 'K'; did you mean 'k'?"],
        ),
        (
            ["axes.kk.num=40", "scene=satelite"],
            ["unknown scene 'satelite'; did you mean 'satellite'?"],
        ),
        (["axes.kk.num=40", "solvr.rtol=1"], ["unknown key solvr; did you mean 'solver'?"]),
        (["axes.rho.vales=[1.0]"], ["unknown key axes.rho.vales; did you mean 'values'?"]),
        (
            ["a=1"],
            [
                "unknown key a; parameters stand under [axes], options under [options] (allowed: title"
            ],
        ),
        (["outputs={path='x.nc'}"], ["unknown key outputs; did you mean 'output'?"]),
        (
            ["output.variables=['y1']", "output.figures=['verdict']"],
            ["output.figures: verdict is not among output.variables; add it there too"],
        ),
        (["refine.widht=0.1"], ["unknown key refine.widht; did you mean 'width'?"]),
        (["boundaries.axs=rho"], ["unknown key boundaries.axs; did you mean 'axis'?"]),
        (["output.variabls=['y1']"], ["unknown key output.variabls; did you mean 'variables'?"]),
        (
            ["output.figures=[verdict]"],
            ["output.figures = '[verdict]': it must be a list", "with quotes"],
        ),
        (["axes.k=1.0"], ["axes.k is 1", "k != 1"]),
        (["axes.k=-0.5"], ["axes.k is -0.5", "0 <= k"]),
        (["axes.k.start=-0.5"], ["axes.k has an end -0.5", "0 <= k"]),
        (["axes.k.stop=1.0"], ["axes.k has an end 1", "k != 1"]),
        (["axes.k.stop=nan"], ["axes.k.stop", "finite"]),
        (["axes.rho.values=[0.6, nan]"], ["axes.rho", "finite"]),
        (["axes.k.num=ten"], ["axes.k.num = 'ten'", "integer"]),
        (["axes.k=half"], ["axes.k = 'half'", "number"]),
        (["axes.k.num=0"], ["axes.k.num = 0", "greater than or equal to 1"]),
        (["axes.rho.values=[]"], ["axes.rho", "at least one value"]),
        (["axes.rho.values=[1.0, 1.0]"], ["axes.rho", "occurs twice"]),
        (["axes.rho.values=[1.0, 3.0, 2.0]"], ["axes.rho", "sort"]),
        (["axes.k.spacing=cubic"], ["axes.k.spacing = 'cubic'", "'linear' or 'log'"]),
        (["axes.k.start=0.0", "axes.k.spacing=log"], ["axes.k", "positive"]),
        (["axes.one_minus_k=0.5"], ["axes.k and axes.one_minus_k", "same thing"]),
        (["scene=satelite"], ["unknown scene 'satelite'", "'satellite'"]),
        (["solver.method=taylor61"], ["solver.method", "unknown method 'taylor61'", "'taylor16'"]),
        (["solver.rtol=0"], ["solver.rtol = 0", "greater than 0"]),
        (["solver.rtol=small"], ["solver.rtol = 'small'", "number"]),
        (["options.bodi=prolate"], ["unknown option 'bodi'", "'body'"]),
        (["options.body=prolat"], ["'prolat'", "'prolate'"]),
        (["output.variables=['verdikt']"], ["output.variables", "'verdict'"]),
        (["output.figures=['verdikt']"], ["output.figures", "'verdict'"]),
        (["output.path=/nowhere/at/all.nc"], ["output.path", "/nowhere/at", "no folder"]),
        (["output.path=/proc/map.nc"], ["output.path", "cannot be written"]),
        (["title=3"], ["title = 3", "string"]),
        (["axes.k.num.more=3"], ["num is a value"]),
        (["axes"], ["--set 'axes'", "KEY=VALUE"]),
        (["axes..k=3"], ["--set 'axes..k=3'", "empty part"]),
        (["axes.k=[0.1, 'x']"], ["axes.k.1 = 'x'", "number"]),
        (["axes.k=[0.1, [0.2]]"], ["axes.k.1 = [0.2]", "number"]),
        (["axes.k=[]"], ["axes.k", "value"]),
        (["axes.rho.num=3"], ["axes.rho.values cannot be combined", "values alone"]),
        (["axes.k.stop=0.1"], ["axes.k", "both 0.1"]),
        (["axes.k.num=1"], ["axes.k", "num = 1", "single number"]),
        (["axes.k.num=1000000000"], ["axes.k.num = 1000000000", "10000000"]),
        (["axes.body=1.0"], ["axes.body is an option", "[options]"]),
        (["options.k=0.5"], ["options.k is a parameter", "[axes]"]),
        (["solver=3"], ["solver = 3", "valid table"]),
        (["solver.rtol=nan"], ["solver.rtol = nan", "finite"]),
        (["axes.k=1" + "0" * 400], ["axes.k = 1000", " ... ", "number"]),
        (["axes.k=1" + "0" * 5000], ["axes.k = '1000", " ... ", "number"]),
        (
            ["axes.k.num=9000000", "axes.rho={start = 0.6, stop = 4.0, num = 9000000}"],
            ["8.1e+13 points", "at most 1e+11"],
        ),
        (["options.body=" + "x" * 5000], ["options.body", "xxx ... xxx", "prolate, oblate"]),
        (["x" * 5000 + "=1"], ["unknown key xxx", "xxx ... xxx"]),
        (
            ["output.path=" + "n" * 5000 + ".nc"],
            ["output.path", "nnn ... nnn", "no file can be created there (File name too long)"],
        ),
        (["output.path=" + "n" * 240 + ".nc"], ["output.path", "too long for the files beside it"]),
        (["output.path=a\u0000.nc"], ["output.path = 'a\\x00.nc'", "cannot be printed"]),
        (["title=\u001b[31mred"], ["title = '\\x1b[31mred'", "cannot be printed"]),
        (
            ["scene=" + "n" * 5000 + ".py"],
            ["scene = 'nnn", "nnn ... nnn", "no file can have this name"],
        ),
    ],
)
def test_bad_input_is_refused_in_one_line(overrides, words):
    with pytest.raises(BadInput) as refusal:
        check(GOOD, *overrides)
    message = str(refusal.value)
    assert "\n" not in message
    assert all(word in message for word in words), message


@pytest.mark.parametrize("key", ["rho", "k"])
def test_a_missing_axis_is_named(key):
    data = tomllib.loads(GOOD)
    del data["axes"][key]
    with pytest.raises(BadInput, match=rf"axes\.{key} is missing"):
        workflow.check(data)


def test_missing_tables_are_named():
    with pytest.raises(BadInput, match="axes is missing"):
        workflow.check({"scene": "satellite"})
    with pytest.raises(BadInput, match="neither the path"):
        survey.run(3)


def test_what_is_not_toml_or_not_there_is_refused(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text("scene = ")
    with pytest.raises(BadInput, match=r"broken\.toml: this is not TOML"):
        workflow.read(path)
    with pytest.raises(BadInput, match=r"absent\.toml: cannot read"):
        workflow.read(tmp_path / "absent.toml")
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadInput, match="cannot read"):
        workflow.read(path)


def test_an_interior_point_outside_the_domain_is_allowed():
    grid = check(GOOD, "axes.k={start = 0.0, stop = 2.0, num = 3}").grid
    assert 1.0 in grid.parameters["k"][1]


def test_overrides_take_toml_or_strings_and_are_recorded(tmp_path):
    path = tmp_path / "map.toml"
    path.write_text(GOOD)
    read = workflow.read(
        path, ["axes.k.num=7", "title=A new name", "solver.rtol=1e-6"], tmp_path / "o.nc"
    )
    assert (read.grid.sizes["k"], read.title, read.request.rtol) == (7, "A new name", 1e-6)
    assert read.text.startswith("# map.toml --set axes.k.num=7 --set title=A new name")
    again = workflow.check(tomllib.loads(read.text))
    assert (again.grid.sizes, again.title, again.request) == (
        read.grid.sizes,
        read.title,
        read.request,
    )
    assert read.path == tmp_path / "o.nc"


numbers = st.floats(allow_nan=True, allow_infinity=True)
junk = st.recursive(
    st.none() | st.booleans() | st.integers() | numbers | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["start", "stop", "num", "values", "k", "x"]), inner, max_size=4
        )
    ),
    max_leaves=8,
)


@settings(suppress_health_check=[HealthCheck.too_slow], deadline=None)
@given(
    st.dictionaries(
        st.sampled_from(["title", "scene", "axes", "options", "solver", "output", "x"]),
        junk,
        max_size=6,
    )
)
def test_junk_is_refused_in_one_line_and_never_with_a_traceback(data):
    with pytest.raises(BadInput) as refusal:
        workflow.check({"scene": "satellite"} | data)
    assert "\n" not in str(refusal.value)


@given(st.lists(st.floats(0.0, 0.99), min_size=1, max_size=6, unique=True), st.floats(-5, 5))
def test_listed_values_and_numbers_arrive_exactly(k, rho):
    k = sorted(k)
    checked = workflow.check({"scene": "satellite", "axes": {"k": {"values": k}, "rho": rho}})
    np.testing.assert_array_equal(checked.grid.parameters["k"][1], k)
    assert checked.grid.parameters["rho"][1] == rho and checked.grid.shape == (len(k),)


def test_a_parameter_in_the_way_is_named():
    with pytest.raises(
        BadInput, match=r"^axes.theta0 cannot be combined with axes.l, which is also given"
    ):
        workflow.check({"scene": "brun", "axes": {"l": 1.0, "theta0": 1.0}})


def test_boundaries_of_a_question_without_a_verdict_are_refused_before_any_point(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    axes = {"A": 1.0, "B": {"values": [0.8, 0.9]}, "C": {"values": [0.6, 0.7]}}
    asked = {
        "scene": "brun_triaxial",
        "options": {"question": "trajectory"},
        "boundaries": {},
        "axes": axes | {"t": 1},
    }
    with pytest.raises(
        BadInput, match="boundaries: brun_triaxial: question = trajectory has no verdict"
    ):
        survey.run(asked)
    assert not list(tmp_path.iterdir())
    with pytest.raises(
        BadInput, match="no boundaries are known along B: question = trajectory has no verdict"
    ):
        survey.edge(
            "brun_triaxial", question="trajectory", along="B", A=1.0, C=0.7, t=1.0, B=(0.5, 0.9)
        )


@pytest.mark.parametrize(
    "q",
    [[0.1, 0.2], np.array([0.1, 0.2]), {"values": np.array([0.1, 0.2])}],
    ids=["list", "array", "values"],
)
def test_lists_and_arrays_are_values_of_an_axis(q):
    data = {"scene": "mathieu", "axes": {"a": np.float32(1), "q": q}, "output": {"path": "m.nc"}}
    checked = workflow.check(data)
    assert checked.grid.parameters["q"][1].tolist() == [0.1, 0.2]
    again = workflow.check(tomllib.loads(checked.text))  # as a file holds it
    assert again.grid.parameters["q"][1].tolist() == [0.1, 0.2] and again.text == checked.text
