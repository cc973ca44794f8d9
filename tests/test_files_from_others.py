"""Files from others: nothing of them runs, and each question ends in an answer or in one line (see
`hostile.py`).
"""

import hashlib
import html
import json
import os
import re
import resource
import shlex
import subprocess
import sys
import time

import h5py
import hostile
import netCDF4
import numpy as np
import pytest
import xarray as xr

import survey
from survey import errors, modules, scenes
from survey.errors import BadInput, Damaged
from survey.file import unfinished
from survey.show.style import STYLES
from survey.show.text import formula
from survey.viewer import widgets
from survey.wording import plain

HTML = "<script>alert(1)</script><img src=x onerror=alert(1)>"


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "files").mkdir()
    return tmp_path / "files"


def checked(folder, seeds, scene="evil.py", **asked):
    sentinel = hostile.base(folder, scene)
    found = []
    for seed in seeds:
        mutation = hostile.mutate(folder / "base.nc", folder / "file.nc", seed)
        found += [
            (seed, mutation, *one) for one in hostile.ask(folder / "file.nc", sentinel, **asked)
        ]
    assert not found, found


def test_the_file_that_is_mutated_is_sound(folder):
    sentinel = hostile.base(folder)
    assert hostile.ask(folder / "base.nc", sentinel) == []
    ds = survey.open(folder / "base.nc")
    assert (
        ds.survey.areas().sizes["area_verdict"] == 3 and ds.survey.boundary().sizes["place"] > 100
    )


def test_every_mutation_ends_in_an_answer_or_one_line(folder):
    checked(folder, range(6), draw=False)


def test_mutations_that_once_ended_in_a_traceback_or_in_hidden_text(folder):
    """An axis without values, areas without units, hidden text in a name, areas of -1e308, bars of
    a verdict.
    """
    checked(folder, (10459, 10509, 10569, 10089, 11392), draw=False)


@pytest.mark.slow
def test_mutations_are_drawn_or_refused(folder):
    checked(folder, range(1000, 1002))


@pytest.mark.slow
def test_mutations_of_cells_and_areas(folder):
    """A cell that ends at -1e308, of which a picture overflows; areas of a single verdict, joined
    with another file.
    """
    checked(folder, (20506,))
    checked(folder, (30082,), "mathieu")


def test_ticks_near_the_largest_number_warn_of_nothing(folder):
    checked(folder, (30039,), "mathieu")


@pytest.mark.slow
@pytest.mark.parametrize("part", range(20))
def test_ten_thousand_mutations(folder, part):
    checked(folder, range(10_000 + 450 * part, 10_000 + 450 * (part + 1)), draw=False)
    checked(folder, range(20_000 + 40 * part, 20_000 + 40 * (part + 1)))
    checked(
        folder, range(30_000 + 10 * part, 30_000 + 10 * (part + 1)), "mathieu", points=3, solve=True
    )


def changed(folder, **attributes):
    """The path of the sound file with other global attributes, of the scene `mathieu`."""
    hostile.base(folder, "mathieu")
    with h5py.File(folder / "base.nc", "r+") as file:
        for name, value in attributes.items():
            file.attrs[name] = value
    hostile.digest(folder / "base.nc")
    return folder / "base.nc"


@pytest.mark.parametrize(
    "scene",
    ["../x", "os", "survey.api", "libration.os", "__init__", "", "/etc/passwd", "x" * 10**6],
)
def test_a_scene_is_a_module_of_the_folder_of_scenes_and_nothing_else(folder, scene):
    path, before = changed(folder, scene=scene), set(sys.modules)
    started = time.process_time()
    with pytest.raises(errors.SurveyError) as refused:
        survey.open(path).survey.trajectory(a=1.0, q=1.0)
    assert (
        "\n" not in str(refused.value)
        and len(str(refused.value)) < 2100
        and time.process_time() - started < 20
    )
    assert not {name for name in set(sys.modules) - before if "passwd" in name or name == "x"}


def test_a_scene_that_names_a_file_without_a_hash_does_not_run(folder):
    sentinel = hostile.base(folder)
    with h5py.File(folder / "base.nc", "r+") as file:
        del file.attrs["scene_hash"]
    hostile.digest(folder / "base.nc")
    with pytest.raises(BadInput, match="its file has changed since"):
        survey.open(folder / "base.nc", trust_scene=True).survey.trajectory(a=1.0, q=1.0)
    assert not sentinel.exists()


@pytest.mark.parametrize("method", ["../../evil", "os", "", "evil.py"])
def test_a_method_is_one_of_the_folder_of_methods(folder, method):
    ds = survey.open(changed(folder, method=method))
    with pytest.raises(BadInput, match="unknown method"):
        ds.survey.zoom(a=(0.0, 1.0), num=2)


def test_zoom_takes_no_path_from_the_file(folder, monkeypatch):
    text = '[output]\npath = "owned.nc"\nfigures = ["verdict"]\n[solver]\nrtol = 0.5\n'
    path = changed(folder, workflow=text)
    monkeypatch.chdir(folder)
    before = sorted(folder.iterdir())
    with pytest.warns(UserWarning, match="beyond the map's"):
        finer = survey.open(path).survey.zoom(a=(0.0, 1.0), q=(0.1, 0.5), num=2)
    assert (
        finer.verdict.shape == (2, 2)
        and sorted(folder.iterdir()) == before
        and "owned" not in finer.attrs["workflow"]
    )


def test_what_a_file_says_is_text_in_html_and_in_a_terminal(folder):
    path = changed(folder, title=HTML + "\x1b[2J$$x$$")
    ds = survey.open(path)
    seen = ds.survey.point(a=1.0, q=1.0)._repr_html_()
    assert (
        "<script" not in seen
        and "<img" not in seen
        and "\x1b" not in seen
        and html.escape(HTML) in seen
    )
    assert "tex2jax_ignore" in seen
    # xarray's own
    assert "<script>alert" not in ds._repr_html_() and "<img src=x" not in ds._repr_html_()
    assert r"\x1b[2J" in repr(ds.survey.point(a=1.0, q=1.0))
    assert "<script>alert" not in hostile.page(path)


def test_the_browser_page_of_a_hostile_file_holds_text_only(folder):
    import asyncio
    import urllib.request

    from survey.viewer.server import start
    from survey.viewer.shown import ShownMap

    path = changed(
        folder, title="</title><script>alert(1)</script>", options=f"a={HTML.replace('=', '')}"
    )

    async def page():
        server, address = start(ShownMap(path), 0)
        try:
            return await asyncio.to_thread(
                lambda: urllib.request.urlopen(address, timeout=20).read().decode()
            )
        finally:
            server.stop()

    assert "<script>alert(1)" not in asyncio.run(page())


def test_latex_is_off_and_what_is_no_formula_is_text():
    assert all(style.rc["text.usetex"] is False for style in STYLES.values())
    for symbol in (
        r"\frac{",
        r"\input{/etc/passwd}",
        "$",
        "a" * 500,
        r"\frac{a}{" * 50,
        r"\hspace{1e9}",
        "\x1b",
        "",
    ):
        shown = formula(symbol, "a$b")
        assert shown == r"a\$b", symbol
    for name in modules.names(scenes):
        scene = modules.load(scenes, name, "scene")
        for part in (*scene.PARAMETERS, *scene.OUTPUTS):
            symbol = part.symbol or part.name
            assert formula(symbol, "") == f"${symbol}$", (name, symbol)


def test_a_figure_on_axes_made_with_latex_on_is_drawn_without(folder):
    import matplotlib
    from matplotlib.figure import Figure

    ds = survey.open(changed(folder, title=r"\input{/etc/passwd}"))
    with matplotlib.rc_context({"text.usetex": True}):
        axes = Figure().subplots()
        ds.survey.map(ax=axes)
        assert not any(
            text.get_usetex()
            for text in axes.figure.findobj(matplotlib.text.Text)
            if text.get_text()
        )


def test_bokeh_finds_no_tex_in_words():
    long_name = r"$$\href{javascript:alert(1)}{x}$$ \(y\) \[z\]"
    variable = xr.DataArray(
        0.0, attrs={"long_name": long_name, "symbol": "x", "units": "1"}, name="v"
    )
    for text in (widgets.label(variable), widgets.literal(long_name), widgets.literal("$$$$")):
        assert not re.search(r"\$\$|\\\(|\\\[", text), text
    assert widgets.label(variable.assign_attrs(long_name="a_b")) == r"a\_b, $$x$$"


def test_plain_text_hides_nothing():
    assert plain("a\x1b[2J\u202e\n") == r"a\x1b[2J\u202e\n" and plain("é µ\u00a0") == "é µ\u00a0"
    assert plain("a\n\x9b", lines=True) == "a\n" + r"\x9b" and plain(plain("\x07")) == plain("\x07")
    assert len(plain("x" * 10**6)) < 2100 and str(BadInput("a\r\nb")) == r"a\r\nb"


def test_declared_sizes_are_refused_before_anything_is_allocated(tmp_path):
    path = tmp_path / "huge.nc"
    with netCDF4.Dataset(path, "w") as file:
        for name in ("x", "y"):
            file.createDimension(name, 10**6)
        status = file.createVariable("status", "i1", ("x", "y"), zlib=True, chunksizes=(1000, 1000))
        status.setncatts({"flag_values": np.array([0], np.int8), "flag_meanings": "ok"})
        file.setncatts(
            {
                "scene": "mathieu",
                "options": "",
                "method": "auto",
                "rtol": 1e-10,
                "complete": np.int8(1),
            }
        )
    assert path.stat().st_size < 40_000
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for words in (["info", str(path)], ["verify", str(path)], ["plot", str(path)]):
        assert list(hostile.command(words)) == []
    with pytest.raises(
        Damaged, match="declares 1,000,000,000,000 bytes of values, more than a file of"
    ):
        survey.open(path)
    # kB; matplotlib's import takes some
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000


def test_an_axis_that_was_never_written_is_refused(tmp_path):
    path = tmp_path / "axis.nc"
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("x", 10**12)
        file.createVariable("x", "f8", ("x",))
        file.createVariable("status", "i1", ())
        file.setncatts({"scene": "mathieu", "complete": np.int8(1)})
    with pytest.raises(
        Damaged, match=r"the axis x has 1,000,000,000,000 values, more than 100,000,000"
    ):
        survey.open(path)


def test_types_of_another_kind_are_refused(tmp_path):
    def compound(file):
        return file.createCompoundType(np.dtype([("x", "f8")]), "pair")

    def ragged(file):
        return file.createVLType(np.float64, "ragged")

    for make in (compound, ragged):
        path = tmp_path / f"{make.__name__}.nc"
        with netCDF4.Dataset(path, "w") as file:
            file.createDimension("x", 3)
            file.createVariable("other", make(file), ("x",))
            file.createVariable("status", "i1", ())
            file.setncatts({"scene": "mathieu", "complete": np.int8(1)})
        with pytest.raises(Damaged, match="the variable other contains neither numbers nor text"):
            survey.open(path)


def test_a_digest_that_is_no_file_does_not_hang(folder):
    path = changed(folder)
    beside = folder / "base.nc.sha256"
    beside.unlink()
    os.mkfifo(beside)
    with pytest.raises(Damaged, match="differ from the digest"):
        survey.open(path)


def test_codes_that_no_flag_names_are_found(folder):
    path = changed(folder)
    with netCDF4.Dataset(path, "a") as file:
        file["status"][1, 1] = 77
    hostile.digest(path)
    done = subprocess.run(
        [sys.executable, "-m", "survey", "verify", path], capture_output=True, text=True
    )
    assert (
        done.returncode == 3
        and "status contains codes that are not among its flag_values" in done.stderr
    )
    assert (
        "77"
        in survey.open(path)
        .survey.point(a=float(survey.open(path).a[1]), q=float(survey.open(path).q[1]))
        .status
    )


def test_the_hash_of_the_evil_scene_is_that_of_its_text(folder):
    hostile.base(folder)
    text = (folder / "evil.py").read_bytes()
    assert survey.open(folder / "base.nc").attrs["scene_hash"] == hashlib.sha256(text).hexdigest()


@pytest.mark.parametrize("blocks", [3, "\x1b[2Jmany", [1], None, 1e400])
def test_what_an_unfinished_run_says_is_text_and_its_command_is_no_other_program(tmp_path, blocks):
    folder = tmp_path / "map.nc.blocks"
    folder.mkdir()
    (folder / "manifest.json").write_text(json.dumps({"blocks": blocks, "points": "\x1b[31m"}))
    for command in (
        "rm -rf ~",
        "survey run x.toml; rm -rf ~",
        "survey run $(reboot)",
        5,
        "'",
        ["survey"],
    ):
        (folder / "holder.json").write_text(
            json.dumps({"resume_command": command, "folder": "/tmp/$(reboot)\x1b", "host": "\x1b"})
        )
        assert list(hostile.command(["info", str(tmp_path / "map.nc")])) == []
        resume = unfinished.summary(tmp_path / "map.nc")["resume"]
        command = resume.rpartition(" && ")[2]
        words = shlex.split(command)
        assert (
            words[:2] == ["survey", "run"]
            and command == shlex.join(words)
            and "rm" not in shlex.split(resume)[:1]
        )
