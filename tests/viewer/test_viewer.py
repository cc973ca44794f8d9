"""The viewer: no point is lost on the way to a pixel, a link shows its view again, nobody sees it
without the token.
"""

import asyncio
import importlib.util
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import hostile
import netCDF4
import numpy as np
import pytest
import viewer as picture
import xarray as xr

import survey
from survey import status
from survey.analysis.point import reading
from survey.errors import BadInput
from survey.viewer import finer, raster
from survey.viewer.shown import ShownMap

ROOT = Path(__file__).parents[2]
MAP = ROOT / "results/satellite_prolate_small.nc"
served = pytest.mark.skipif(
    not importlib.util.find_spec("bokeh"), reason="bokeh is missing (pip install bokeh)"
)
browsed = pytest.mark.skipif(
    bool(picture.missing()), reason=f"no browser: missing {picture.missing()}"
)
FLAGS = {
    "flag_values": np.array([-1, 0, 1, 2], np.int8),
    "flag_meanings": "undecided unstable stable marginal",
}


def made(x, y, seed=0):
    """A map over the axes x and y: half stable, half unstable, ten undecided, ten failed; and
    numbers of any sign.
    """
    rng = np.random.default_rng(seed)
    shape = x.size, y.size
    verdict = np.ones(shape, np.int8)
    verdict[: x.size // 2] = 0
    rare = rng.choice(verdict.size, 20, replace=False)
    verdict.flat[rare] = -1
    state = np.zeros(shape, np.int8)
    state.flat[rare[:10]] = status.STEP_LIMIT
    value = rng.standard_normal(shape)
    data = {
        "verdict": (("x", "y"), verdict, FLAGS),
        "value": (("x", "y"), value),
        "status": (("x", "y"), state),
    }
    return xr.Dataset(data, {"x": x, "y": y})


def whole(layer):
    """The layer, all of its map read."""
    assert layer.overview.complete.share == 1
    return layer


def uneven(number):
    return np.cumsum(np.random.default_rng(1).uniform(0.1, 1.0, number))


AXES = [
    (np.linspace(-1, 1, 301), np.linspace(0, 5, 203)),
    (np.geomspace(1e-3, 1e3, 211), np.linspace(-3, 3, 97)),
    (uneven(150), np.geomspace(1, 2, 400)),
]


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("direct", [True, False])
@pytest.mark.parametrize("sizes", [(40, 30), (900, 700)])
def test_every_point_is_in_the_pixel_where_it_lies(axes, direct, sizes, monkeypatch):
    """Against each point's pixel, found one by one; with the overview's cells, a neighbour of it."""
    monkeypatch.setattr(raster, "DIRECT", 10**9 if direct else 0)
    monkeypatch.setattr(raster, "OVERVIEW", 10**4 if direct else 90)
    ds = made(*axes)
    layer = raster.Layer(ds, "verdict", ("x", "y"), {})
    xs, ys = (
        axis.pixels(*axis.ends, size)
        for axis, size in zip(map(raster.MapAxis, axes), sizes, strict=True)
    )
    mask, value = whole(layer).pixels(xs, ys)
    assert mask.shape == sizes[::-1] and value is None
    factors = (1, 1) if direct else [-(-a.size // 90) for a in axes]
    for kind, where in (
        ("undecided", (ds.verdict == -1) & (ds.status == 0)),
        ("failed", ds.status != 0),
    ):
        for i, j in np.argwhere(where.values):
            column, line = (
                int(np.searchsorted(pixels.edges, pixels.axis.centres[at], side="right")) - 1
                for pixels, at in ((xs, i), (ys, j))
            )
            # cells of the overview that straddle pixels show in the later one
            spare = [0 if f == 1 else 1 + int(np.ceil(f * size / axis.size))
                     for f, size, axis in zip(factors, sizes, axes, strict=True)]  # fmt: skip
            near = mask[
                max(line - spare[1], 0) : line + spare[1] + 1,
                max(column - spare[0], 0) : column + spare[0] + 1,
            ]
            assert (near & layer.bits[kind]).any(), (kind, i, j)


def test_a_pixel_of_numbers_shows_the_largest_magnitude_of_its_points():
    ds = made(np.arange(120.0), np.arange(90.0))
    ds["value"][5, 7] = -1e4
    ds["value"][50:60, 50:60] = np.nan
    for overview in (False, True):
        layer = raster.Layer(ds, "value", ("x", "y"), {})
        xs, ys = (
            raster.MapAxis(ds[dim].values).pixels(-0.5, ds[dim].size - 0.5, ds[dim].size // 10)
            for dim in "xy"
        )
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(raster, "DIRECT", 0 if overview else 10**9)
            _, value = whole(layer).pixels(xs, ys)
        good = ds.value.where(ds.status == 0).values.astype(np.float32)
        blocks = good.reshape(12, 10, 9, 10).transpose(2, 0, 1, 3).reshape(9, 12, 100)
        largest = np.nan_to_num(np.abs(blocks), nan=-1.0).argmax(axis=-1)
        expected = np.take_along_axis(blocks, largest[..., None], axis=-1)[..., 0]
        np.testing.assert_array_equal(value, expected)
    assert np.isnan(value[5, 5]) and value[0, 0] == -1e4


def test_the_rarest_kind_is_seen_and_undecided_and_failed_before_all():
    ds = made(np.arange(1000.0), np.arange(800.0))
    ds["verdict"][100, 100] = 2
    layer = raster.Layer(ds, "verdict", ("x", "y"), {})
    xs, ys = (raster.MapAxis(ds[dim].values).pixels(-0.5, ds[dim].size - 0.5, 80) for dim in "xy")
    mask, _ = layer.pixels(xs, ys)
    image, kinds = raster.paint(mask, None, layer)
    image = image.view(np.uint8).reshape(80, 80, 4)
    colours = {"undecided": (0, 0, 0), "failed": (255, 255, 255), "marginal": (0xE6, 0x9F, 0x00)}
    for kind, colour in colours.items():
        where = (mask & layer.bits[kind]) != 0
        seen = (image[..., :3] == colour).all(axis=-1)
        lines = (image[..., :3] == 0x77).all(axis=-1)  # the hatching of what failed
        assert where.any() and (seen | lines)[where].all() and not seen[~where].any()
    assert list(kinds)[-2:] == ["undecided", "failed"]


@pytest.mark.parametrize("name", ["verdict", "value"])
def test_what_is_not_read_yet_is_not_drawn_and_what_is_drawn_is_true(name, monkeypatch):
    monkeypatch.setattr(raster, "DIRECT", 0)
    monkeypatch.setattr(raster, "OVERVIEW", 100)
    ds = made(np.arange(1000.0), np.arange(300.0))
    ds[name].encoding["chunksizes"] = (47, 30)
    layer, last = (raster.Layer(ds, name, ("x", "y"), {}) for _ in range(2))
    xs, ys = (raster.MapAxis(ds[dim].values).pixels(-0.5, ds[dim].size - 0.5, 60) for dim in "xy")
    true_mask, true_value = whole(last).pixels(xs, ys)
    drawn = []
    while layer.waits(xs, ys):
        layer.overview.read()
        mask, value = layer.pixels(xs, ys)
        known = (mask & layer.bits["not read yet"]) == 0
        np.testing.assert_array_equal(mask[known], true_mask[known])
        if value is not None:
            np.testing.assert_array_equal(value[known], true_value[known])
        image, kinds = raster.paint(mask, value, layer)
        background = np.array([0xF4, 0xF4, 0xF4, 0xFF], np.uint8).view(np.uint32)
        assert (image[~known] == background).all() and (
            ("not read yet" in kinds) == (not known.all())
        )
        drawn.append(known.mean())
    assert len(drawn) == 22 and drawn[1] < 0.15 and drawn[-1] == 1 and sorted(drawn) == drawn
    assert (
        layer.limits == last.limits
        if name == "value"
        else layer.overview.number == last.overview.number
    )


def test_what_is_undefined_is_grey_and_named_by_its_status(tmp_path):
    """A map of Brun's problem: below the least effective potential there is no motion."""
    ds = survey.evaluate(
        "brun", l=np.linspace(-1, 1, 12), beta=np.linspace(-1, 1, 10), alpha=0.1, sign="1"
    )
    bare = ds.status.values == status.FIRST_OF_SCENE
    layer = raster.Layer(ds, "verdict", ("l", "beta"), {})
    xs, ys = (raster.MapAxis(ds[dim].values).pixels(-2, 2, 400) for dim in ("l", "beta"))
    mask, _ = layer.pixels(xs, ys)
    image, kinds = raster.paint(mask, None, layer)
    seen = image.view(np.uint8).reshape(*mask.shape, 4)[..., :3]
    grey = (seen == 0x80).all(axis=-1)
    np.testing.assert_array_equal(grey, bare[np.ix_(xs.starts, ys.starts)].T)
    assert 0 < grey.sum() < grey.size and set(kinds) == {"no_motion", "regular_nutation"}
    counts = ds.attrs["verdict_counts"]
    assert counts == f"regular_nutation: {(~bare).sum()}, no_motion: {bare.sum()}"
    ds.attrs["complete"] = 1
    ds.to_netcdf(tmp_path / "map.nc")
    shown = ShownMap(tmp_path / "map.nc")
    assert shown.shares("verdict")["no_motion"] == f" ({bare.sum()} in all)"
    lines = list(shown.under(shown.read(""), (0, 0)))
    assert any("no_motion: " in line for line in lines) and not any(
        "undecided" in line for line in lines
    )
    assert "undecided" not in str(ds.survey.point(l=-1, beta=-1))


def test_of_a_refined_map_each_cell_is_seen_where_it_lies():
    rng = np.random.default_rng(3)
    ds = made(np.linspace(0, 1, 20), np.linspace(0, 1, 20))
    low, size = rng.uniform(0, 0.9, (2, 400)), rng.choice([1e-5, 0.01, 0.1], 400)
    for k, dim in enumerate("xy"):
        ds[f"cell_{dim}_low"], ds[f"cell_{dim}_high"] = ("cell", low[k]), ("cell", low[k] + size)
    ds["cell_verdict"] = ("cell", rng.choice([-1, 0, 1], 400).astype(np.int8), FLAGS)
    layer = raster.CellLayer(ds, "verdict", ("x", "y"), {})
    xs, ys = (raster.MapAxis(ds[dim].values).pixels(0.2, 0.8, 50) for dim in "xy")
    mask, _ = layer.pixels(xs, ys)
    for flag, code in (("undecided", -1), ("unstable", 0), ("stable", 1)):
        own = ds.cell_verdict.values == code
        reach = [(low[k][own, None] < p.edges[1:]) & ((low[k] + size)[own, None] > p.edges[:-1])
                 for k, p in enumerate((xs, ys))]  # fmt: skip
        expected = (reach[1][:, :, None] & reach[0][:, None, :]).any(axis=0)
        np.testing.assert_array_equal((mask & layer.bits[flag]) != 0, expected)


def test_a_link_tells_its_view():
    shown = ShownMap(MAP)
    view = shown.read("")
    assert view.name == "verdict" and view.point is None and view.boundaries
    view.name, view.boundaries, view.point = "exponent", False, shown.position((3, 5))
    view.window = [(0.1, 0.30000000000000004), (1.0, 2.0 / 3.0 + 1)]
    assert shown.read(shown.link(view)) == view
    lines = list(shown.under(view, (3, 5)))
    ds = xr.open_dataset(MAP).isel(k=3, rho=5)
    assert lines[0] == f"k = {float(ds.k):.8g}, rho = {float(ds.rho):.8g}"
    assert (
        lines[1] == f"exponent = {reading(ds, 'exponent', True)}".replace("+-", "±")
        and "±" in lines[1]
    )


def test_a_falling_axis_is_drawn_rising(tmp_path):
    xr.open_dataset(MAP).isel(k=slice(None, None, -1)).to_netcdf(tmp_path / "falling.nc")
    images = []
    for path in (MAP, tmp_path / "falling.nc"):
        shown = ShownMap(path)
        view = shown.read("var=exponent")
        pixels = [axis.pixels(*axis.ends, 60) for axis in shown.axes]
        mask, value = shown.layer(view).pixels(*pixels)
        images.append(raster.paint(mask, value, shown.layer(view))[0])
    np.testing.assert_array_equal(*images)


@pytest.mark.parametrize(
    ("query", "message"),
    [
        ("var=exponents", "did you mean 'exponent'"),
        ("x=0.1", "x = 0.1: it must be 2 numbers"),
        ("x=0.5,nan", "x = 0.5,nan"),
        ("x=7,8", "overlaps the map's, 0 to 0.99"),
        ("y=2,1", "low,high"),
        ("point=0.1,9", "outside the map"),
        ("z=1", "unknown key of the link 'z'"),
    ],
)
def test_a_link_of_another_map_is_one_line(query, message):
    with pytest.raises(BadInput, match=re.escape(message)) as refused:
        ShownMap(MAP).read(query)
    assert "\n" not in str(refused.value)


def test_where_an_integer_does_not_apply_it_is_no_value():
    shown = ShownMap(ROOT / "results/gyrostat_fate_small.nc")
    view = shown.read("var=net_turns")
    _, value = shown.layer(view).pixels(*(axis.pixels(*axis.ends, 50) for axis in shown.axes))
    assert np.isnan(value).any() and np.nanmax(np.abs(value)) < 1000
    spun_up = tuple(np.argwhere(shown.ds.verdict.values == 5)[0])
    assert (
        next(line for line in shown.under(view, spun_up) if "net_turns" in line)
        == "net_turns = does not apply"
    )


def answer(address):
    """The HTTP status of an address."""
    try:
        return urllib.request.urlopen(address, timeout=20).status
    except urllib.error.HTTPError as error:
        return error.code


@served
def test_without_the_token_there_is_nothing_and_from_elsewhere_nobody():
    old = "http://127.0.0.1:1/old/?var=exponent&x=0.1,0.5"
    with picture.served(MAP, "--link", old) as (address, process):
        address, query = address.split("?")
        assert query.startswith("var=exponent&x=0.1,0.5&y=")
        printed = process.stderr.readline() + process.stderr.readline()
        host, token = re.fullmatch(r"(http://127\.0\.0\.1:\d+/)([\w-]{32})/", address).groups()
        port = int(host.rstrip("/").rpartition(":")[2])
        assert "Only this machine" in printed and f"ssh -L {port}:127.0.0.1:{port}" in printed
        assert answer(address) == 200
        other = token[:-1] + ("B" if token.endswith("A") else "A")
        for path in (
            "",
            "ws",
            "static/js/bokeh.min.js",
            "autoload.js",
            token[:-1],
            f"{other}/",
            f"x/{token}/",
        ):
            assert answer(host + path) == 403, path
        with socket.socket() as other, pytest.raises(ConnectionRefusedError):
            other.connect(("127.0.0.2", port))  # another address of this machine
        words = [sys.executable, "-m", "survey", "view", MAP, "--no-browser", "--port", str(port)]
        taken = subprocess.run(words, capture_output=True, text=True)
        assert taken.returncode == 2 and taken.stderr.startswith(
            f"survey: --port {port}: Address already in use"
        )
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=20) == 0
        assert process.stderr.read().endswith("stopped\n")


@served
def test_the_socket_wants_token_origin_and_a_session_that_the_page_signed():
    from tornado.httpclient import HTTPClientError, HTTPRequest
    from tornado.websocket import websocket_connect

    from survey.viewer.server import start

    async def first_message(address, origin, session):
        request = HTTPRequest(address.replace("http", "ws"), headers={"Origin": origin})
        connection = await websocket_connect(request, subprotocols=["bokeh", session])
        try:
            return await connection.read_message()
        finally:
            connection.close()

    async def check():
        server, address = start(ShownMap(MAP), 0)
        page = await asyncio.to_thread(
            lambda: urllib.request.urlopen(address, timeout=20).read().decode()
        )
        (session,) = re.findall(r'"token":"([^"]+)"', page)
        origin = address[: address.index("/", 7)]
        assert "ACK" in await first_message(f"{address}ws", origin, session)
        assert await first_message(f"{address}ws", origin, session[:-4] + "AAAA") is None
        for where, whence in ((f"{address}ws", "http://elsewhere.org"), (f"{origin}/ws", origin)):
            with pytest.raises(HTTPClientError, match="403"):
                await first_message(where, whence, session)
        server.stop()

    asyncio.run(check())


@served
def test_the_browser_is_led_by_a_file_that_only_this_user_can_read():
    from survey.viewer.server import _redirect

    with _redirect("http://127.0.0.1:1/token/?var=w&x=1,2") as page:
        file = Path(page.removeprefix("file://"))
        assert file.stat().st_mode & 0o077 == 0
        assert 'url=http://127.0.0.1:1/token/?var=w&amp;x=1,2"' in file.read_text()
    assert not file.exists()


def test_what_cannot_be_viewed_is_one_line(tmp_path):
    with netCDF4.Dataset(tmp_path / "other.nc", "w") as file:
        file.createDimension("x", 3)
    xr.open_dataset(MAP).isel(k=0).to_netcdf(tmp_path / "line.nc")
    xr.open_dataset(MAP).drop_vars("k").to_netcdf(tmp_path / "bare.nc")
    for name, message in (
        ("absent.nc", "there is no such file"),
        ("other.nc", "this netCDF file was not written by survey"),
        ("line.nc", "this survey has fewer than two axes"),
        ("bare.nc", "the axis k has no values, so there is no map to view"),
    ):
        with pytest.raises(BadInput, match=message) as refused:
            ShownMap(tmp_path / name)
        assert "\n" not in str(refused.value)


def test_without_its_package_the_command_names_it(tmp_path):
    blocked = "import sys; sys.modules['bokeh'] = None; from survey.cli import main; main(['view', 'map.nc'])"
    done = subprocess.run(
        [sys.executable, "-c", blocked], cwd=tmp_path, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (
        2,
        "survey: survey view needs the package bokeh: pip install bokeh\n",
    )


PIXELS = """
const source = [...Bokeh.documents[0]._all_models.values()].find(m => m.data?.image?.length == 1)
const pixels = new Uint32Array(source.data.image[0].buffer ?? source.data.image[0])
return pixels.reduce((hash, pixel) => (Math.imul(hash, 31) + pixel) | 0, pixels.length)
"""
ZOOM = """
const plot = Bokeh.documents[0].roots()[0].children[0]
plot.x_range.setv({start: 0.5, end: 0.95})
plot.y_range.setv({start: 0.6, end: 1.7})
"""
TEXTS = "return [...Bokeh.documents[0]._all_models.values()].filter(m => m.text !== undefined).map(m => String(m.text))"


@served
@browsed
def test_in_a_browser_a_point_is_described_and_clicked_and_its_link_shows_the_same(tmp_path):
    with picture.served(MAP) as (address, _), picture.browser() as driver:
        driver.get(address)
        picture.wait(driver)
        whole = driver.execute_script(PIXELS)
        picture.act(driver, 0.85, 0.75)
        verdict = "verdict: unstable\n"
        picture.wait(driver, lambda: any(verdict in text for text in driver.execute_script(TEXTS)))
        (near,) = (text for text in driver.execute_script(TEXTS) if verdict in text)
        assert re.search(r"discriminant = -?[\d.e-]+ ± [\d.e-]+\n", near) and near.startswith(
            "k = 0.8415, rho = 0.77"
        )
        picture.act(driver, 0.85, 0.75, click=True)

        def motion():
            return any("<img class='motion'" in text for text in driver.execute_script(TEXTS))

        picture.wait(driver, motion)
        assert "point=0.841" in driver.current_url
        driver.execute_script(ZOOM)
        picture.wait(driver, lambda: "x=0.5,0.95&y=0.6,1.7" in driver.current_url)
        picture.wait(driver, lambda: driver.execute_script(PIXELS) != whole)
        driver.save_screenshot(tmp_path / "viewer.png")
        assert (tmp_path / "viewer.png").stat().st_size > 20_000
        seen, link = driver.execute_script(PIXELS), driver.current_url
        driver.get("about:blank")
        driver.get(link)
        picture.wait(driver, motion)
        picture.wait(driver, lambda: driver.execute_script(PIXELS) == seen)
        assert driver.current_url == link
        driver.execute_script(
            ZOOM.replace("0.5, end: 0.95", "0.8, end: 0.81").replace(
                "0.6, end: 1.7", "0.7, end: 0.72"
            )
        )
        afresh = "this window is solved afresh, 240 × 160 points"
        picture.wait(driver, lambda: "x=0.8,0.81&y=0.7,0.72" in driver.current_url)
        picture.wait(driver, lambda: any(afresh in text for text in driver.execute_script(TEXTS)))
        before = driver.current_url
        picture.act(driver, 0.803, 0.711, click=True)
        picture.wait(driver, lambda: driver.current_url != before)
        picture.wait(driver, lambda: any("survey.evaluate(&#x27;satellite&#x27;, k=0.803" in text
                                         for text in driver.execute_script(TEXTS)))  # fmt: skip
        (copy,) = [
            b
            for b in driver.execute_script(BUTTONS, "BUTTON")
            if b.text == "Copy Python for this point"
        ]
        copy.click()
        seen, link = driver.execute_script(PIXELS), driver.current_url
        driver.get("about:blank")
        driver.get(link)
        picture.wait(driver, lambda: any(afresh in text for text in driver.execute_script(TEXTS)))
        assert driver.current_url == link
        plot, side = driver.execute_script(STACKED)
        assert side[0] >= plot[0] + plot[2] - 1  # beside the map
        driver.set_window_size(600, 900)
        picture.wait(driver, lambda: driver.execute_script(STACKED)[1][1] > 100)
        plot, side = driver.execute_script(STACKED)
        assert side[1] >= plot[1] + plot[3] - 1 and plot[3] > 300 and plot[2] > 400  # below it
        driver.save_screenshot(tmp_path / "narrow.png")
        grave = [
            line
            for line in driver.get_log("browser")
            if line["level"] == "SEVERE" and "favicon" not in line["message"]
        ]
        assert not grave


FINE = "x=0.8,0.81&y=0.7,0.72"  # less than a cell of the map
STACKED = """
const views = Bokeh.index.roots[0].child_views
return views.map(view => { const r = view.el.getBoundingClientRect(); return [r.left, r.top, r.width, r.height] })
"""


def test_a_window_narrower_than_the_grid_is_solved_afresh_and_is_what_evaluate_gives():
    shown = ShownMap(MAP)
    view = shown.read("var=discriminant&" + FINE)
    assert finer.wanted(shown, view) and not finer.wanted(shown, shown.read(""))
    fresh = finer.of_window(shown, view)
    assert fresh.status.shape == finer.FINE and set(fresh.data_vars) >= {
        "discriminant",
        "verdict",
        "status",
    }
    same = survey.evaluate(
        "satellite", k=fresh.k.values, rho=fresh.rho.values, variables=["discriminant"]
    )
    bars = fresh.discriminant_error + same.discriminant_error
    assert (
        abs(fresh.discriminant - same.discriminant) <= bars
    ).all() and fresh.discriminant_error.max() < 1e-9
    (low, high), axis = view.window[0], ShownMap("window", fresh).axes[0]
    assert axis.ends == pytest.approx((low, high), abs=1e-15)  # the cells tile the window
    # a link shows the same
    assert finer.of_window(shown, shown.read(shown.link(view))).equals(fresh)


def test_beyond_the_map_nothing_is_solved():
    shown = ShownMap(MAP)
    ends = ShownMap("window", finer.of_window(shown, shown.read("x=-1,0.05&y=0.5,0.62"))).axes
    assert ends[0].values[0] > 0.0 and ends[1].values[0] > 0.6


def test_a_window_that_takes_too_long_is_refused(monkeypatch):
    shown = ShownMap(ROOT / "results/gyrostat_fate_small.nc")
    view = shown.read("x=0.1,0.2&y=0.1,0.2")
    monkeypatch.setattr(finer, "SECONDS", 1e-3)
    with pytest.raises(BadInput, match="too few to show more than the map does"):
        finer.of_window(shown, view)


def test_any_point_of_a_window_is_solved_and_given_in_python():
    shown = ShownMap(MAP)
    view = shown.read("var=exponent&" + FINE + "&point=0.8031,0.711")
    assert shown.coords(view) is None  # the map has no such point
    point = finer.of_point(shown, view).survey.point()
    assert point.parameters == {"k": 0.8031, "rho": 0.711} and "exponent_per_orbit" in point.dataset
    scope = {}
    exec(point.python, scope)
    assert scope["point"].dataset.equals(point.dataset)


BUTTONS = """
const found = []
const search = root => root.querySelectorAll("*").forEach(element => {
  if (element.shadowRoot) search(element.shadowRoot)
  if (element.tagName == arguments[0] && element.getClientRects().length) found.push(element)
})
search(document)
return found
"""  # or other elements that are seen
READ, RUN = "Show the file", "I have read it: allow it to run until survey view ends"


@served
@browsed
@pytest.mark.slow
def test_in_a_browser_a_strange_scene_runs_only_once_its_text_was_shown_and_allowed(
    tmp_path, monkeypatch
):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    (tmp_path / "files").mkdir()
    ran = hostile.base(tmp_path / "files")
    with picture.served(tmp_path / "files/base.nc") as (address, _), picture.browser() as driver:

        def seen(tag="BUTTON"):
            texts = [element.text for element in driver.execute_script(BUTTONS, tag)]
            return [text for text in texts if not re.search("Copy Python|survey.evaluate", text)]

        def press(label):
            (button,) = (
                button
                for button in driver.execute_script(BUTTONS, "BUTTON")
                if button.text == label
            )
            button.click()

        def choose(a, q):
            before = driver.current_url
            picture.act(driver, a, q, click=True)
            picture.wait(driver, lambda: driver.current_url != before)

        driver.get(address)
        picture.wait(driver)
        assert seen() == []
        for a in (3.5, 6.5):  # another point hides the text again
            choose(a, 2.5)
            picture.wait(
                driver,
                lambda: any("Read it first" in text for text in driver.execute_script(TEXTS)),
            )
            picture.wait(driver, lambda: seen() == [READ])
            assert seen("PRE") == []
            press(READ)
            picture.wait(driver, lambda: seen() == [RUN])
            assert seen("PRE") == [(tmp_path / "files/evil.py").read_text().rstrip()]
            assert not ran.exists()
        press(RUN)
        picture.wait(driver, ran.exists)
        for a in (6.5, 3.5):  # the second without a question
            picture.wait(
                driver,
                lambda: any("<img class='motion'" in text for text in driver.execute_script(TEXTS)),
            )
            assert seen() == [] == seen("PRE")
            choose(a, 5.0)
    assert not (tmp_path / "state").exists(), "allowed once, not for good"
