"""Pictures: titled, labelled, with a legend; undecided and failed points are visible as such."""

from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb

import survey
from survey import status
from survey.errors import BadInput
from survey.file.labels import fill_of, flag_codes
from survey.show import figures, maps, marks, palette


@pytest.fixture
def toy():
    """A 40 x 50 map with all kinds of points."""
    verdict = np.ones((40, 50), np.int8)
    verdict[:10] = 0
    verdict[20, 20] = -1
    state = np.zeros((40, 50), np.int8)
    state[30:, 40:] = status.STEP_LIMIT
    state[0, 0] = status.INVALID_PARAMETERS
    flags = {
        "flag_values": np.array([-1, 0, 1, 2], np.int8),
        "flag_meanings": "undecided unstable stable marginal",
    }
    return xr.Dataset(
        {"verdict": (("k", "rho"), verdict, flags | {"long_name": "verdict"}), "status": (("k", "rho"), state)},
        {"k": ("k", np.linspace(0, 1, 40), {"symbol": "k", "long_name": "modulus", "units": "1"}),
         "rho": ("rho", np.geomspace(1, 10, 50), {"symbol": r"\rho", "long_name": "ratio", "units": "rad"})},
        {"title": "A toy map", "options": "body=prolate"},
    )  # fmt: skip


def test_the_legend_counts_every_kind_of_point(toy):
    figure = figures.draw(toy)
    axes = figure.axes[0]
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [
        "unstable (499)",
        "stable (1,399)",
        "undecided (1)",
        "failed (100)",
        "outside the domain (1)",
    ]
    assert axes.get_xlabel() == "modulus, $k$" and axes.get_ylabel() == r"ratio, $\rho$ (rad)"
    assert axes.get_title().startswith("A toy map") and axes.get_yscale() == "log"
    assert [line.get_xydata().shape[0] for line in axes.lines] == [1, 1]  # rare points are ringed
    plt.close(figure)


def test_undecided_is_not_counted_where_the_point_failed(toy):
    toy.verdict[30:, 40:] = -1
    labels = [text.get_text() for text in figures.draw(toy).legends[0].get_texts()]
    assert "undecided (1)" in labels
    plt.close("all")


@pytest.mark.parametrize("style", ["screen", "paper"])
def test_a_map_wholly_outside_the_domain(toy, style):
    toy.status[...] = status.INVALID_PARAMETERS
    labels = [text.get_text() for text in figures.draw(toy, style=style).legends[0].get_texts()]
    assert labels == ["outside the domain (2,000)" if style == "screen" else "outside the domain"]
    plt.close("all")


def test_a_plane_across_that_of_the_curves_is_drawn_on_its_two_axes():
    of = [
        xr.DataArray(np.linspace(0.0, 1.0, n), dims=dim)
        for dim, n in zip("kmr", (3, 4, 5), strict=True)
    ]
    ds = xr.Dataset(
        {"status": sum(of), "curve_count": ("curve", [3])}, attrs={"boundary_planes": "k, r"}
    )
    assert figures._chosen(ds, (None, None)) == ["k", "r"]
    # fixed, it has one value: the map is over the two others
    for at, others in (("r", ["k", "m"]), ("k", ["m", "r"])):
        chosen = figures._chosen(ds.isel({at: slice(1)}), (None, None))
        assert (chosen or list(ds.status.dims[:2])) == others


@pytest.fixture
def bare(toy):
    """The toy map where 50 points are undefined, as the scene says."""
    flags = {"flag_values": np.array([0, 1, 4, 16], np.int8),
             "flag_meanings": "ok invalid_parameters step_limit no_motion"}  # fmt: skip
    toy["status"] = (toy.status.dims, toy.status.values, flags)
    toy.status[10, :], toy.verdict[10, :] = status.FIRST_OF_SCENE, -1
    return toy


@pytest.mark.parametrize("style", ["screen", "paper"])
def test_undefined_points_are_grey_and_listed_by_their_status(bare, style):
    figure = figures.draw(bare, style=style)
    legend = figure.legends[0]
    labels = [text.get_text() for text in legend.get_texts()]
    expected = ["unstable (499)", "stable (1,349)", "no motion (50)", "undecided (1)", "failed (100)",
                "outside the domain (1)"]  # fmt: skip
    assert labels == (
        expected if style == "screen" else [label.partition(" (")[0] for label in expected]
    )
    patch, mesh = legend.legend_handles[2], figure.axes[0].collections[0]
    assert to_hex(patch.get_facecolor()).upper() == palette.GREYS[0] and not patch.get_hatch()
    drawn = mesh.cmap(mesh.norm(mesh.get_array().reshape(50, 40)))[5, [10, 12]]
    assert [to_hex(colour).upper() for colour in drawn] == [palette.GREYS[0], palette.COLOURS[1]]
    plt.close(figure)


def test_undefined_points_are_grey_in_a_large_map_too(bare, monkeypatch):
    monkeypatch.setattr(maps, "MAX_DRAWN", 20)
    monkeypatch.setattr(maps, "MAX_CELLS", 20)
    figure = figures.draw(bare)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "no motion (50)" in labels and "undecided (1)" in labels
    mesh = figure.axes[0].collections[0]
    drawn = mesh.cmap(mesh.norm(mesh.get_array()))[2]
    assert (
        to_hex(drawn[5]).upper() == palette.GREYS[0]
        and to_hex(drawn[12]).upper() == palette.COLOURS[1]
    )
    plt.close(figure)


def test_a_row_shows_undefined_points_apart(bare):
    figure = figures.draw(bare.isel(rho=0))
    axes = figure.axes[0]
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert names == ["undecided", "unstable", "stable", "marginal", "no motion"]
    # one is outside the domain
    assert [line.get_xdata().size for line in axes.lines[:5]] == [0, 9, 29, 0, 1]
    plt.close(figure)


def test_a_large_map_is_reduced_for_the_picture_and_counted_in_full(toy, monkeypatch):
    monkeypatch.setattr(maps, "MAX_DRAWN", 20)
    monkeypatch.setattr(maps, "MAX_CELLS", 20)
    figure = figures.draw(toy)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [
        "unstable (499)",
        "stable (1,399)",
        "undecided (1)",
        "failed (100)",
        "outside the domain (1)",
    ]
    assert figure.axes[0].collections[0].get_array().shape == (17, 20)
    plt.close(figure)


def test_the_colours_differ_for_the_colour_blind_and_in_grey():
    def grey(*colours):
        return [np.dot(to_rgb(colour), (0.299, 0.587, 0.114)) for colour in colours]

    def apart(values):
        return min(abs(a - b) for i, a in enumerate(values) for b in values[:i])

    assert apart(grey(*palette.COLOURS[:2], palette.UNDECIDED)) > 0.25
    # not hatched in print
    assert apart(grey(palette.COLOURS[1], palette.UNDECIDED, palette.GREYS[0], "white")) > 0.15
    assert apart(grey(*palette.GREYS)) > 0.1 and not set(palette.GREYS) & set(palette.COLOURS)


@pytest.mark.parametrize("name", ["w", "turnings", pytest.param("status", marks=pytest.mark.slow)])
def test_any_variable_can_be_drawn(surveyed, tmp_path, name):
    ds = survey.open(surveyed)
    figures.save(ds, tmp_path / "map.png", name)
    figures.save(ds.isel(t=-1), tmp_path / "curve.png", name)
    assert all(
        (tmp_path / file).read_bytes()[:4] == b"\x89PNG" for file in ("map.png", "curve.png")
    )


def test_a_third_axis_is_named_with_its_place(surveyed):
    ds = survey.open(surveyed).expand_dims(d=[1.0, 2.0], axis=2)
    figure = figures.draw(ds, "w")
    assert "= 1$ (1 of 2)" in figure.axes[0].get_title()
    plt.close(figure)


def test_a_labelled_dimension_is_named_with_its_place(surveyed):
    ds = survey.open(surveyed).expand_dims(monomial=["200", "110"], axis=2)
    figure = figures.draw(ds, "w")
    assert "monomial 200 (1 of 2)" in figure.axes[0].get_title()
    plt.close(figure)


def test_a_row_of_verdicts_is_drawn_by_its_names(toy):
    figure = figures.draw(toy.isel(rho=0))
    names = [label.get_text() for label in figure.axes[0].get_yticklabels()]
    assert names == ["undecided", "unstable", "stable", "marginal"]
    plt.close(figure)


def test_for_papers_verdicts_are_hatched_in_columns_and_fonts_embedded(toy, tmp_path):
    figure = figures.draw(toy, style="paper", width="double")
    assert (
        figure.get_size_inches()[0] == pytest.approx(175 / 25.4, abs=0.01)
        and not figure.axes[0].get_title()
    )
    legend = figure.legends[0]
    hatches = {
        t.get_text(): p.get_hatch()
        for t, p in zip(legend.get_texts(), legend.get_patches(), strict=False)
    }
    assert hatches["unstable"] == "//////" and not hatches["stable"]
    assert figure.axes[0].get_ylabel() == r"ratio, $\rho$ (rad)"
    figures.save(toy, tmp_path / "map.pdf", style="paper")
    content = (tmp_path / "map.pdf").read_bytes()
    assert content.startswith(b"%PDF") and b"/FontFile2" in content and b"/Type3" not in content


def test_a_workflow_may_ask_for_the_style_of_papers(small, tmp_path):
    text = small.read_text().replace('figures = ["w"]', 'figures = ["w", "phi"]\nstyle = "paper"')
    small.write_text(text)
    survey.run(small, output=tmp_path / "small.nc")
    assert (tmp_path / "small.pdf").exists() and (tmp_path / "small_phi.pdf").exists()


def test_hatching_follows_the_edges_of_cells(toy):
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    one = toy.isel(k=slice(0, 3), rho=slice(0, 3))
    where = np.array([[False, False, False], [False, True, False], [False, False, False]])
    marks.hatched(axes, one.k, one.rho, where, "////")
    (path,) = axes.collections[0].get_paths()
    middles = [0.5 * (v[1:] + v[:-1]) for v in (one.k.values, one.rho.values)]
    for corner in np.unique(path.vertices.round(12), axis=0):
        assert all(
            np.isclose(value, edges).any() for value, edges in zip(corner, middles, strict=True)
        )


LONG = (
    "Is this motion, whose name is long, in this system, whose name is longer still, a stable one?"
)


@pytest.mark.parametrize(
    ("columns", "size", "style"), [(1, (3, 4), None), (3, (11, 4), None), (1, (3.35, 2.9), "paper")]
)
def test_nothing_is_clipped_in_narrow_axes(bare, columns, size, style):
    bare.attrs["title"] = LONG
    bare.rho.attrs["long_name"] = LONG[:60]
    figure, panels = plt.subplots(1, columns, figsize=size, layout="constrained", squeeze=False)
    for axes in panels[0]:
        figures.onto(axes, bare, style=style)
    figure.draw_without_rendering()
    whole = figure.bbox.padded(2)
    for axes in panels[0]:
        legends = [axes.get_legend(), *figure.legends]
        for text in (
            axes.title,
            axes.xaxis.label,
            axes.yaxis.label,
            *(t for g in legends if g for t in g.get_texts()),
        ):
            box = text.get_window_extent()
            assert not text.get_text() or (whole.x0 <= box.x0 and box.x1 <= whole.x1), text
            assert not text.get_text() or (whole.y0 <= box.y0 and box.y1 <= whole.y1), text
    titles = [axes.title.get_window_extent() for axes in panels[0]]
    assert all(a.x1 <= b.x0 for a, b in pairwise(titles))
    assert style or panels[0, 0].get_title().replace("\n", " ").startswith(LONG)
    plt.close(figure)


@pytest.mark.parametrize("style", [None, "paper"])
@pytest.mark.parametrize(
    "words",
    [
        "growth exponent of the amplitude per period, negative where all motions decay",
        "equilibrium that is reached, in [0, 2 pi), or right turning point of the libration cycle",
    ],
)
def test_labels_of_colour_bars_are_wrapped_evenly_within_the_bar(surveyed, words, style):
    ds = survey.open(surveyed).load()
    ds.w.attrs |= {"long_name": words, "symbol": r"\phi_\infty", "units": "rad"}
    figure = figures.draw(ds, "w", style)
    figure.draw_without_rendering()
    (bar,) = (axes for axes in figure.axes if axes.get_label() == "<colorbar>")
    label = bar.yaxis.label
    drawn, lines = label.get_window_extent(), label.get_text().split("\n")
    assert 1 < len(lines) <= 4 and drawn.height <= bar.get_window_extent().height
    assert drawn.x1 <= figure.bbox.x1 and " ".join(lines).startswith(words)
    assert min(map(len, lines)) > 0.4 * max(map(len, lines)), lines
    assert "[0, 2 pi)" in label.get_text() or "pi" not in words
    plt.close(figure)


def test_a_single_number_has_no_figure(surveyed):
    with pytest.raises(BadInput, match="at least one axis"):
        figures.draw(survey.open(surveyed).isel(t=0, w0=0), "w")


def test_the_legend_of_a_refined_map_says_what_is_drawn_as_undecided(tmp_path):
    """Areas inside undecided cells are known in part, so they are not what these cells cover."""
    axes = {
        "k": {"start": 0.02, "stop": 0.98, "num": 9},
        "rho": {"start": 0.02, "stop": 4.0, "num": 9},
    }
    ds = survey.run(
        {"scene": "satellite", "axes": axes, "boundaries": {}, "refine": {"width": 0.02}},
        output=tmp_path / "map.nc",
    )
    here = ds.cell_verdict.values == -1
    sizes = (ds.cell_k_high - ds.cell_k_low) * (ds.cell_rho_high - ds.cell_rho_low)
    covered = 100.0 * float(sizes[here].sum() / sizes.sum())
    figure = figures.draw(ds, "verdict")
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"undecided cells ({covered:.2g} % of the map)" in labels
    plt.close(figure)
    # the curves have a light rim
    curves = [name for name in ds.data_vars if name.startswith(("curve_", "edge_"))]
    figure = figures.draw(ds.drop_vars(curves), "verdict")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba()).astype(int)
    box = figure.axes[0].get_window_extent()
    inside = pixels[::-1][int(box.y0) + 3 : int(box.y1) - 3, int(box.x0) + 3 : int(box.x1) - 3]
    black = 100.0 * (inside[..., :3].sum(axis=-1) < 120).mean()
    assert 0.6 * covered < black < 1.4 * covered
    plt.close(figure)


def test_dark_curves_are_seen_on_the_black_cells_of_a_refined_map(tmp_path):
    axes = {
        "mu": {"start": 0.0, "stop": 0.06, "num": 9},
        "e": {"start": 0.0, "stop": 0.3, "num": 9},
    }
    ds = survey.run(
        {"scene": "libration_elliptic", "axes": axes, "boundaries": {}, "refine": {"width": 0.02}},
        output=tmp_path / "map.nc",
    )
    figure = figures.draw(ds, "verdict")
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba())[::-1].astype(int)
    ends = np.cumsum(ds.curve_count.values)
    for kind in ("A", "B"):
        code = flag_codes(ds.curve_class.attrs)[kind]
        first = int(np.flatnonzero(ds.curve_class.values == code)[0])
        part = slice(ends[first] - ds.curve_count.values[first], ends[first])
        at = np.stack([ds.curve_mu.values[part], ds.curve_e.values[part]], axis=1)
        columns, rows = figure.axes[0].transData.transform(at[3:-3]).T.astype(int)
        # the brightest pixel within three of the curve's; the cells are below 20
        around = [
            pixels[r - 3 : r + 4, c - 3 : c + 4, :3].min(axis=-1).max()
            for r, c in zip(rows, columns, strict=True)
        ]
        assert np.mean(np.array(around) > 140) > 0.8, kind
    plt.close("all")


def test_bars_of_counts_have_whole_ticks():
    rng = np.random.default_rng(1)
    points = {
        key: xr.DataArray(rng.uniform(*ends, 60), dims="point")
        for key, ends in {"phi0": (-3.0, 3.0), "w0": (-3.0, 3.0)}.items()
    }
    ds = survey.evaluate("gyrostat", question="fate", d=0.5, s3=0.3, **points)
    counts = [name for name in ds.data_vars if fill_of(ds[name]) is not None]
    assert counts
    for spread in (1, 40):
        for name in counts[:1]:
            some = ds.assign(
                {name: (ds[name] * 0 + np.arange(60) % 3 * spread).assign_attrs(ds[name].attrs)}
            )
            figure = figures.draw(some, name)
            figure.canvas.draw()
            ticks = figure.axes[1].get_yticks()
            assert (ticks == np.round(ticks)).all()
            plt.close(figure)
