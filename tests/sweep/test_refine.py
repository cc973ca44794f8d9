"""[refine] in a workflow: cells and areas in the netCDF file, shown by `survey info`, drawn instead
of pixels.
"""

import matplotlib.pyplot as plt
import pytest
import xarray as xr

import survey
from survey.file import reading
from survey.file.labels import percent
from survey.file.summary import summary
from survey.request import workflow
from survey.show import figures
from survey.sweep import plan

WORKFLOW = {
    "scene": "satellite",
    "options": {"body": "prolate"},
    "axes": {
        "k": {"start": 0.7, "stop": 1.3, "num": 7},
        "rho": {"start": 2.0, "stop": 0.6, "num": 40},
    },
    "output": {"variables": ["verdict"]},
    "refine": {"width": 0.02},
}


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    path = tmp_path_factory.mktemp("refine") / "map.nc"
    survey.run(WORKFLOW, output=path)
    return path


def test_the_cells_fill_the_map_and_agree_with_its_points(path):
    ds = xr.load_dataset(path)
    assert reading.check(path) == []
    sides = {
        end: ds[f"cell_{name}_high"] - ds[f"cell_{name}_low"]
        for end, name in (("x", "k"), ("y", "rho"))
    }
    assert float((sides["x"] * sides["y"]).sum()) == pytest.approx(0.6 * 1.4)
    undecided = ds.cell_verdict == -1
    assert (sides["x"] <= 0.02 * 0.6)[undecided].all() and (sides["y"] <= 0.02 * 1.4 + 1e-15)[
        undecided
    ].all()
    seen = 0
    for k in ds.k.values:
        for rho in ds.rho.values:
            inside = (
                (ds.cell_k_low < k)
                & (k < ds.cell_k_high)
                & (ds.cell_rho_low < rho)
                & (rho < ds.cell_rho_high)
            )
            own = ds.cell_verdict.values[inside.values]
            point = ds.sel(k=k, rho=rho).verdict
            seen += int((own >= 0).sum())
            assert own.size <= 1 and all(verdict in (-1, int(point)) for verdict in own)
    assert seen > 100


def test_no_cell_reaches_across_the_separatrix(path):
    """k = 1 is no part of the domain: librations on one side, rotations on the other, edges without
    number between.
    """
    ds = xr.load_dataset(path)
    assert not ((ds.cell_k_low < 1) & (ds.cell_k_high > 1)).any()
    touching = (ds.cell_k_low == 1) | (ds.cell_k_high == 1)
    assert touching.sum() > 60 and (ds.cell_verdict[touching] == -1).all()


def test_the_areas_are_reported_with_their_bounds(path):
    ds = survey.open(path)
    total = 0.6 * 1.4
    assert float(ds.area.sum()) == pytest.approx(total) and float(
        ds.area_fraction.sum()
    ) == pytest.approx(1)
    finer = survey.run(
        WORKFLOW | {"refine": {"width": {"k": 0.001, "rho": 0.004}}},
        output=path.with_name("finer.nc"),
    )
    assert (abs(finer.area - ds.area) <= ds.area_error + finer.area_error).all()
    assert (finer.area_error < 0.3 * ds.area_error).all()
    lines = summary(ds)["areas"]
    assert list(lines) == ["unstable", "stable"] and all(
        "+-" in line and line.endswith(" %)") for line in lines.values()
    )
    assert ds.attrs["areas"].startswith("unstable: ")


def test_the_plan_bounds_the_cells_and_their_bytes(path):
    planned, ds = plan.plan(workflow.check(WORKFLOW, output=path)), xr.load_dataset(path)
    bytes_of_cells = sum(
        variable.nbytes for variable in ds.variables.values() if variable.dims == ("cell",)
    )
    assert planned["cells"]["most"] == 2 * 32 * 64 and planned["estimated_seconds"] > 0
    assert (
        bytes_of_cells / ds.sizes["cell"]
        == planned["cells"]["bytes_at_most"] / planned["cells"]["most"]
    )
    assert planned["cells"]["usually"] / 5 < ds.sizes["cell"] < 5 * planned["cells"]["usually"]


def test_a_share_is_written_to_two_digits_of_its_bar():
    assert percent(0.349695, 0.0058) == "34.97 +- 0.58 %" and percent(0.5, 0.12) == "50 +- 12 %"
    assert percent(1 / 3, 0.0) == "33.33 +- 0.00 %"


def test_the_cells_are_drawn_instead_of_the_points(path):
    figure = figures.draw(survey.open(path))
    drawn = sum(len(collection.get_paths()) for collection in figure.axes[0].collections)
    assert drawn == survey.open(path).sizes["cell"]
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert [label.split(" ")[0] for label in labels] == [
        "stable",
        "unstable",
        "undecided",
    ] and "±" in labels[0]
    assert figure.axes[0].get_xlim() == (0.7, 1.3)
    plt.close(figure)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"refine": {}}, r"refine.width is missing"),
        ({"refine": {"width": 1}}, r"refine.width = 1: it must lie between 0 and 1, such as 0.001"),
        ({"refine": {"width": 0.0}}, r"refine.width = 0: it must lie between 0 and 1"),
        ({"refine": {"width": 1e-7}}, r"refine.width = 1e-07: there would be too many cells"),
        ({"refine": {"width": "fine"}}, r"refine.width = 'fine': input should be a valid number"),
        ({"refine": {"width": {"k": "fine", "rho": 0.1}}}, r"refine.width.k = 'fine': input should be a valid number"),
        ({"refine": {"width": {"k": 0.1}}}, r"refine.width.rho is missing; give a width for each axis"),
        ({"refine": {"width": {"k": 0.1, "roh": 0.1}}}, r"refine.width.roh: unknown axis 'roh'; did you mean 'rho'"),
        ({"refine": {"width": {"k": 0.7, "rho": 0.1}}}, r"refine.width.k = 0.7: it must lie between 0 and 0.6"),
        ({"refine": {"widht": 0.1}}, r"unknown key refine.widht; did you mean 'width'"),
        ({"axes": {"k": 0.5, "rho": {"values": [1.0, 2.0]}}}, r"refine: cells need exactly two axes"),
        ({"scene": "gyrostat", "axes": {"w0": {"values": [1.0, 2.0]}}, "options": {}}, "not supported for the scene"),
        ({"scene": "satellite_triaxial", "axes": {"yaw_ratio": {"values": [-0.5, 0.5]}, "amplitude": 0.5,
                                                  "roll_ratio": {"values": [-0.5, 0.5]}}, "options": {}},
         "refine: satellite_triaxial: cells are available only"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused(changes, words):
    with pytest.raises(survey.BadInput, match=words) as refusal:
        survey.run(WORKFLOW | {"output": {}} | changes)
    assert "\n" not in str(refusal.value)


def test_a_width_in_the_units_of_a_logarithmic_axis_is_relative(tmp_path):
    axes = {
        "a": {"start": 0.5, "stop": 3.0, "num": 3},
        "q": {"start": 0.1, "stop": 10.0, "num": 3, "spacing": "log"},
    }
    workflow = {"scene": "mathieu", "axes": axes, "refine": {"width": {"a": 0.05, "q": 0.1}}}
    ds = survey.run(workflow, output=tmp_path / "log.nc")
    undecided = ds.cell_verdict == -1
    ratio = (ds.cell_q_high / ds.cell_q_low)[undecided]
    assert (
        1.05 < ratio.min()
        and ratio.max() < 1.1
        and ((ds.cell_a_high - ds.cell_a_low)[undecided] <= 0.05).all()
    )
