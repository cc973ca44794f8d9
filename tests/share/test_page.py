"""The page of a map, in headless Chromium from file://, and by Node: values, verdicts, link, zoom,
and no request.
"""

import json
import re
import shutil
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
import viewer as picture
import xarray as xr

import survey
from survey.errors import BadInput
from survey.file.labels import scene_statuses
from survey.model import build
from survey.request.workflow import check
from survey.share import page

ROOT = Path(__file__).parents[2]
MAP, FATES = ROOT / "results/satellite_prolate_small.nc", ROOT / "results/gyrostat_fate_small.nc"
SCRIPTS = ROOT / "survey/share"
browsed = pytest.mark.skipif(
    bool(picture.missing()), reason=f"no browser: missing {picture.missing()}"
)
noded = pytest.mark.skipif(
    not shutil.which("node"), reason="node is missing (Debian: apt-get install nodejs)"
)
HOSTILE = "</script><script>window.owned = 1</script><img src=x onerror='window.owned = 1'>{{data}}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("pages")
    page.write(survey.open(MAP), path / "map.html")
    page.write(survey.open(FATES), path / "fates.html")
    return path


@pytest.fixture(scope="module")
def driver():
    with picture.browser() as found:
        found.set_script_timeout(120)
        yield found


def shown(driver, path, link=""):
    """The page, opened and drawn."""
    driver.get("about:blank")
    driver.get(f"file://{path}{link}")
    drawn(driver)


def drawn(driver, seconds=120):
    end = time.monotonic() + seconds
    while not driver.execute_script(
        "return typeof idle == 'function' && idle() && performance.now() > 500"
    ):
        assert time.monotonic() < end, driver.execute_script("return document.body.innerText")
        time.sleep(0.1)


def pixel(driver, x, y):
    """The colour that the canvas shows at a point of the map."""
    return driver.execute_script(
        "const [px, py] = toPlot(arguments), own = front.canvas.getContext('2d');"
        "return [...own.getImageData(Math.round(px * plot.ratio), Math.round(py * plot.ratio), 1, 1).data].slice(0, 3)",
        x, y,
    )  # fmt: skip


def test_pages_are_small_and_name_no_address(folder):
    for name in ("map.html", "fates.html"):
        text = (folder / name).read_text()
        assert len(text) < 2_000_000
        outside = re.findall(
            r"(?:src|href|url|import|fetch)\s*[=(:]\s*[\"']?(https?:|//)[^\"' ]*", text
        )
        assert (
            not outside
            and "default-src 'none'" in text
            and "eval(" not in text.replace("'unsafe-eval'", "")
        )


@browsed
def test_hover_values_agree_with_evaluate_at_1000_places(folder, driver):
    shown(driver, folder / "map.html")
    rng = np.random.default_rng(5)
    k, rho = rng.uniform(0, 0.99, 1000), rng.uniform(0.6, 4.0, 1000)
    known_at = "return arguments[0].map(([x, y]) => known(x, y))"
    found = driver.execute_script(known_at, np.column_stack([k, rho]).tolist())
    ds = survey.evaluate(
        "satellite", k=xr.DataArray(k, dims="p"), rho=xr.DataArray(rho, dims="p"), body="prolate"
    )
    codes = {"undecided": -1, "unstable": 0, "stable": 1}
    for i, own in enumerate(found):
        for name in ("discriminant", "exponent", "y1", "dy1", "y2", "dy2"):
            value, bar = own["values"][name]
            assert abs(value - float(ds[name][i])) <= bar + float(ds[f"{name}_error"][i]), (
                name,
                k[i],
                rho[i],
            )
        verdict = codes[own["verdict"]]
        assert verdict == int(ds.verdict[i]) or -1 in (verdict, int(ds.verdict[i]))


DAMPED = '''"""Hill's equation with damping, its coefficient not even."""
from math import cos, pi, sin
PARAMETERS, PERIOD, DAMPING = ("a", "q"), pi, 0.05
def z(u, p):
    return p[0] - 2 * p[1] * (cos(2 * u) + 0.3 * sin(4 * u))
'''
OTHERS = {  # scene: axes
    "mathieu": {"a": (0.0, 10.0), "q": (0.0, 5.0)},
    "libration_elliptic": {"mu": (0.0, 0.055), "e": (0.0, 0.7)},
    "damped.py": {"a": (0.0, 5.0), "q": (0.0, 2.0)},
    "coupled_mathieu.py": {"Omega": (1.0, 1.6), "epsilon": (0.0, 0.3)},
}


@browsed
@pytest.mark.slow
@pytest.mark.parametrize("name", OTHERS)
def test_hover_values_of_other_scenes_agree_with_evaluate_at_1000_places(name, tmp_path, driver):
    (tmp_path / "damped.py").write_text(DAMPED)
    scene = {
        "damped.py": str(tmp_path / name),
        "coupled_mathieu.py": str(ROOT / "workflows" / name),
    }.get(name, name)
    axes = {
        axis: {"start": low, "stop": high, "num": 9} for axis, (low, high) in OTHERS[name].items()
    }
    told = page.write(
        survey.run({"scene": scene, "axes": axes}, output=tmp_path / "m.nc"), tmp_path / "m.html"
    )
    assert told["series"] and told["bytes"] < 2_000_000
    shown(driver, tmp_path / "m.html")
    low, high = np.array(list(OTHERS[name].values())).T
    places = np.random.default_rng(12).uniform(low, high, (1000, 2))
    found = driver.execute_script(
        "return arguments[0].map(([x, y]) => known(x, y))", places.tolist()
    )
    given = {
        axis: xr.DataArray(values, dims="p") for axis, values in zip(axes, places.T, strict=True)
    }
    ds = survey.evaluate(scene, rtol=1e-13, **given)
    codes, decided = {"undecided": -1, "unstable": 0, "stable": 1}, 0
    for i, own in enumerate(found):
        for output, (value, bar) in own["values"].items():
            if output in ds:
                assert abs(value - float(ds[output][i])) <= bar + float(ds[f"{output}_error"][i]), (
                    output,
                    *places[i],
                )
        verdict, true = codes[own["verdict"]], int(ds.verdict[i])
        assert verdict == true or -1 in (verdict, true) or true == 2
        decided += verdict >= 0
    assert decided > 950
    if name.endswith(".py"):  # minus the trace: of a damped equation, or the sum of all multipliers
        trace, off = (
            ds[f"{'discriminant' if name == 'damped.py' else 'multiplier_re'}{end}"].astype(float)
            for end in ("", "_error")
        )
        trace, off = (
            own.sum("multiplier") if "multiplier" in own.dims else own for own in (trace, off)
        )
        c1, bar = np.array([own["values"]["c1"] for own in found]).T
        assert (abs(c1 + trace.values) <= bar + off.values).all() and bar.max() < 1e-9
    else:
        assert sum(output in ds for output in found[0]["values"]) >= 2


@browsed
def test_the_pointer_shows_what_is_there_with_its_bar(folder, driver):
    from selenium.webdriver.common.actions.action_builder import ActionBuilder

    shown(driver, folder / "map.html")
    left, top = driver.execute_script(
        "const [px, py] = toPlot([0.85, 0.7]), b = figure.getBoundingClientRect();"
        "return [b.left + plot.left + px, b.top + plot.top + py]"
    )
    moves = ActionBuilder(driver)
    moves.pointer_action.move_to_location(round(left), round(top))
    moves.perform()
    time.sleep(1)
    told = driver.execute_script("return document.getElementById('readout').textContent")
    assert re.search(
        r"k = 0\.8\d+, rho = 0\.[67]\d+\nunstable\ndiscriminant = -?[\d.]+ ± \d\.\de-1\d", told
    )


@browsed
def test_zoom_is_sharp_at_every_scale(folder, driver):
    """At the edge of a tongue, in windows down to 1e-9: the pixels have the colours of the verdicts there."""
    shown(driver, folder / "map.html")
    rho = float(
        survey.edge("satellite", along="rho", near=0.75, k=0.9, body="prolate").edge.values.reshape(
            -1
        )[0]
    )
    colours = driver.execute_script("return TEXT.shown[0].colours")
    driver.execute_script("state.lines = false")
    for width in (1e-2, 1e-5, 1e-9):
        driver.execute_script(
            "const [y, d] = arguments; setView([0.9 - d, 0.9 + d], [y - d, y + d])",
            rho,
            width,
        )
        time.sleep(0.2)
        drawn(driver)
        seen = set()
        for u, v in np.random.default_rng(6).uniform(-0.9, 0.9, (12, 2)):
            x, y = 0.9 + u * width, rho + v * width
            verdict = driver.execute_script("return model.at(...arguments).verdict", x, y)
            step = 3 * width / 400
            if {
                driver.execute_script("return model.at(...arguments).verdict", x, y + s * step)
                for s in (-1, 1)
            } == {verdict}:
                assert pixel(driver, x, y) == colours[str(verdict)], (x, y, width)
                seen.add(verdict)
        assert seen == {0, 1}


@browsed
def test_a_link_shows_the_same_view(folder, driver):
    shown(driver, folder / "map.html")
    driver.execute_script(
        "const list = document.getElementById('show'); list.value = 'discriminant'; list.onchange();"
        "setView([0.5, 0.7], [1, 1.5])"
    )
    time.sleep(0.3)
    drawn(driver)
    link, before = driver.current_url, driver.execute_script("return picture().toDataURL()")
    assert "#x=0.5,0.7&y=1,1.5&show=discriminant" in link
    driver.get("about:blank")
    driver.get(link)
    drawn(driver)
    assert (
        driver.execute_script("return picture().toDataURL()") == before
        and driver.current_url == link
    )


@browsed
def test_no_request_leaves_and_nothing_is_complained_of(folder, driver):
    for name in ("map.html", "fates.html"):
        shown(driver, folder / name)
        assert (
            driver.execute_script(
                "return performance.getEntriesByType('resource').filter(r => !r.name.startsWith('blob:')).length"
            )
            == 0
        )
        assert not [line for line in driver.get_log("browser") if line["level"] == "SEVERE"]
    refused = driver.execute_async_script(
        "const done = arguments[0]; fetch('http://127.0.0.1:9/').then(() => done('sent'), e => done(String(e)))"
    )
    assert "Failed to fetch" in refused
    assert any("Content Security Policy" in line["message"] for line in driver.get_log("browser"))


@browsed
def test_hostile_text_is_shown_as_text(tmp_path, driver):
    ds = survey.open(FATES)
    dim = ds.status.dims[0]
    hostile = ds.assign_attrs(
        title=HOSTILE,
        references=HOSTILE,
        options="question=fate",
        workflow=HOSTILE,
        history=HOSTILE,
    )
    hostile[dim].attrs |= {"long_name": HOSTILE, "symbol": HOSTILE}
    hostile.verdict.attrs["long_name"] = HOSTILE
    page.write(hostile, tmp_path / "hostile.html")
    shown(driver, tmp_path / "hostile.html")
    assert driver.execute_script("return window.owned ?? null") is None
    assert driver.execute_script("return document.images.length + document.scripts.length") == 3
    assert driver.execute_script("return document.querySelector('h1').textContent") == HOSTILE


@browsed
def test_points_without_series_are_shown_as_they_are(folder, driver):
    """Each pixel is that of the nearest point, and its values are the file's."""
    ds = survey.open(FATES)
    shown(driver, folder / "fates.html")
    driver.execute_script("state.lines = false; front = coarse = null; changed()")
    time.sleep(0.3)
    drawn(driver)
    axes, colours = ds.verdict.dims, driver.execute_script("return TEXT.shown[0].colours")
    for i, j in np.random.default_rng(7).integers(0, [ds.sizes[dim] for dim in axes], (20, 2)):
        x, y = (float(ds[dim][n]) for dim, n in zip(axes, (i, j), strict=True))
        own = driver.execute_script("return known(...arguments)", x, y)
        code = int(ds.verdict[i, j])
        names = dict(
            zip(
                ds.verdict.attrs["flag_values"].tolist(),
                ds.verdict.attrs["flag_meanings"].split(),
                strict=True,
            )
        )
        assert own["verdict"] == names[code] and (own["x"], own["y"]) == (x, y)
        assert pixel(driver, x, y) == colours[str(code)]


@browsed
def test_along_a_logarithmic_axis_the_nearest_point_is_that_of_the_least_ratio(tmp_path, driver):
    """Up to the ends of the map, half a step beyond the last points; three a decade."""
    ds = survey.evaluate(
        "brun", l=np.linspace(0.5, 6.5, 7), alpha=np.geomspace(0.02, 2.0, 6), beta=0.3, sign=1
    )
    page.write(ds, tmp_path / "log.html")
    shown(driver, tmp_path / "log.html")
    ends, colours = driver.execute_script(
        "return [TEXT.axes.map(a => a.ends), TEXT.shown[0].colours]"
    )
    assert driver.execute_script("return TEXT.axes.map(a => a.log)") == [False, True]
    driver.execute_script("state.lines = false; front = coarse = null; changed()")
    time.sleep(0.3)
    drawn(driver)
    level, alpha = ds.l.values, np.log(ds.alpha.values)
    random, checked = np.random.default_rng(4), 0
    for u, v in random.uniform(0.002, 0.998, (60, 2)):
        x, y = (a + t * (b - a) for (a, b), t in zip(ends, (u, v), strict=True))
        if (
            min(
                abs((y - alpha[0]) / (alpha[1] - alpha[0]) % 1 - 0.5), abs((x - level[0]) % 1 - 0.5)
            )
            < 0.02
        ):
            continue  # half way between two points
        i, j = int(abs(level - x).argmin()), int(abs(alpha - y).argmin())
        found = driver.execute_script(
            "return known(real(arguments[0], 0), real(arguments[1], 1))", x, y
        )
        assert (found["x"], found["y"]) == (level[i], ds.alpha.values[j])
        if int(ds.status[i, j]) == 0:
            assert pixel(driver, x, y) == colours[str(int(ds.verdict[i, j]))]
            value, bar = found["values"]["u_max (well 1)"]
            true = ds.u_max.sel(well=1).isel(l=i, alpha=j)
            assert value == true and bar == ds.u_max_error.sel(well=1).isel(l=i, alpha=j)
            checked += 1
    assert checked > 20
    told = driver.execute_script("return document.getElementById('legend').textContent")
    assert ("no motion" in told) == bool((ds.status == scene_statuses(ds)["no_motion"]).any())


@browsed
def test_the_keyboard_moves_and_zooms_and_pictures_are_saved(folder, driver):
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    shown(driver, folder / "map.html")
    figure = driver.find_element(By.ID, "figure")
    figure.send_keys("+", "+", Keys.ARROW_RIGHT)
    time.sleep(0.5)
    x = driver.execute_script("return state.view.x")
    assert x[1] - x[0] == pytest.approx(0.99 / 1.5**2) and x[0] > 0.28
    assert (
        "verdict"
        not in driver.execute_script("return document.getElementById('readout').textContent").split(
            "\n"
        )[0]
    )
    drawn(driver)
    text = driver.execute_script("return svg()")
    assert (
        text.startswith("<svg")
        and "data:image/png;base64" in text
        and "<polyline" in text
        and "script" not in text
    )
    figure.send_keys("0")
    assert driver.execute_script("return state.view.x") == [0, 0.99]
    driver.execute_script("window.saved = []; save = (name, blob) => saved.push([name, blob.size])")
    driver.find_element(By.ID, "png").click()
    driver.find_element(By.ID, "svg").click()
    time.sleep(1)
    assert sorted(name for name, size in driver.execute_script("return saved") if size > 5000) == [
        "png",
        "svg",
    ]


def touch(driver, kind, *places):
    """A touch event of Chromium's own input, with fingers at places of the map (x, y)."""
    at = driver.execute_script(
        "const b = figure.getBoundingClientRect();"
        "return arguments[0].map(p => toPlot(p)).map(([px, py]) => [b.left + plot.left + px, b.top + plot.top + py])",
        [list(place) for place in places],
    )
    points = [{"x": x, "y": y, "id": number} for number, (x, y) in enumerate(at)]
    driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    return at


@browsed
def test_fingers_read_move_and_zoom_the_map(folder, driver):
    """A tap tells the value there, a finger moves the map, and two of them zoom it: what is under
    each stays there.
    """
    shown(driver, folder / "map.html")
    driver.execute_cdp_cmd(
        "Emulation.setTouchEmulationEnabled", {"enabled": True, "maxTouchPoints": 2}
    )
    under = (
        "const b = figure.getBoundingClientRect();"
        "return toMap(arguments[0] - b.left - plot.left, arguments[1] - b.top - plot.top)"
    )
    try:
        touch(driver, "touchStart", (0.6, 2.0))
        touch(driver, "touchEnd")
        time.sleep(0.2)
        told = driver.execute_script("return document.getElementById('readout').textContent")
        x, y = (float(text) for text in re.match(r"k = ([\d.]+), rho = ([\d.]+)\n", told).groups())
        assert (x, y) == pytest.approx((0.6, 2.0), abs=0.01) and "\ndiscriminant = " in told

        driver.execute_script("setView([0.3, 0.8], [1.5, 3])")
        begun = touch(driver, "touchStart", (0.6, 2.0))[0]
        driver.execute_cdp_cmd(
            "Input.dispatchTouchEvent",
            {
                "type": "touchMove",
                "touchPoints": [{"x": begun[0] + 120, "y": begun[1] + 50, "id": 0}],
            },
        )
        touch(driver, "touchEnd")
        assert driver.execute_script(under, begun[0] + 120, begun[1] + 50) == pytest.approx(
            [0.6, 2.0], abs=1e-9
        )

        driver.execute_script("setView([0.3, 0.8], [1.5, 3])")
        one, two = touch(driver, "touchStart", (0.5, 2.0), (0.6, 2.5))
        # twice as far apart, along one line
        to = [[one[0] - (two[0] - one[0]), one[1] - (two[1] - one[1])], two]
        for t in (0.25, 0.5, 0.75, 1.0):
            points = [{"x": a[0] + t * (b[0] - a[0]), "y": a[1] + t * (b[1] - a[1]), "id": number}
                      for number, (a, b) in enumerate(zip((one, two), to, strict=True))]  # fmt: skip
            driver.execute_cdp_cmd(
                "Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": points}
            )
        touch(driver, "touchEnd")
        for (px, py), place in zip(to, ((0.5, 2.0), (0.6, 2.5)), strict=True):
            assert driver.execute_script(under, px, py) == pytest.approx(list(place), abs=1e-6)
        x, y = driver.execute_script("return [state.view.x, state.view.y]")
        assert (x[1] - x[0], y[1] - y[0]) == pytest.approx((0.25, 0.75))
    finally:
        driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})


# ten steps of a zoom, one a frame: the calls that draw, and how far the picture's middle is from
# where it belongs
MOVING = """
const done = arguments[0], places = []
let touched = 0, n = 0
for (const kind of [CanvasRenderingContext2D, OffscreenCanvasRenderingContext2D]) {
 for (const name of ["drawImage", "putImageData"]) {
  const own = kind.prototype[name]
  kind.prototype[name] = function (...all) { touched++; return own.apply(this, all) }
 }
}
const go = () => {
  const own = front.canvas.getBoundingClientRect(), area = $("plot").getBoundingClientRect(), [u, v] = toPlot([0.4, 2])
  if (n > 1) places.push([own.left + own.width / 2 - area.left - u, own.top + own.height / 2 - area.top - v])
  if (n++ < 10) { zoom(1.08, 10, 20); clearTimeout(resting); requestAnimationFrame(() => setTimeout(go)) }
  else { resting = setTimeout(sharply); done([touched, places]) }
}
go()
"""


@browsed
def test_a_moving_view_is_moved_by_the_compositor(folder, driver):
    """No script touches pixels while the picture covers the view; when it rests it is drawn afresh,
    in its place.
    """
    shown(driver, folder / "map.html")
    driver.execute_script("setView([0.2, 0.6], [1.5, 2.5])")
    drawn(driver)
    touched, places = driver.execute_async_script(MOVING)
    assert touched == 0 and len(places) == 9 and np.abs(places).max() < 1e-3
    drawn(driver)
    assert driver.execute_script(
        "return new DOMMatrix(getComputedStyle(front.canvas).transform).isIdentity"
    )
    hidden = (
        "return papers.filter(one => getComputedStyle(one.canvas).visibility === 'visible').length"
    )
    assert driver.execute_script(hidden) == 1


@noded
@pytest.mark.parametrize("scene", ["mathieu", "libration_elliptic"])
def test_the_javascript_reader_gives_what_the_python_reader_gives(scene, tmp_path):
    axes = {
        "mathieu": {"a": (0.0, 5.0), "q": (0.0, 2.0)},
        "libration_elliptic": {"mu": (0.005, 0.04), "e": (0.05, 0.5)},
    }
    given = {
        "scene": scene,
        "axes": {name: {"start": a, "stop": b, "num": 9} for name, (a, b) in axes[scene].items()},
    }
    (tmp_path / "map.model").write_bytes(build.packed(check(given | {"output": {"path": "x.nc"}})))
    model = survey.Model(tmp_path / "map.model")
    rng = np.random.default_rng(8)
    points = np.column_stack(
        [rng.uniform(low, high, 50) for low, high in zip(model.low, model.high, strict=True)]
    )
    (tmp_path / "run.mjs").write_text(
        "import fs from 'fs'\n"
        f"const text = fs.readFileSync({str(SCRIPTS / 'model.js')!r}, 'utf8')\n"
        "const readModel = new Function(text + '; return readModel')()\n"
        f"const model = await readModel(new Uint8Array(fs.readFileSync({str(tmp_path / 'map.model')!r})))\n"
        f"console.log(JSON.stringify({json.dumps(points.tolist())}.map(p => model.at(...p))))\n"
    )
    out = subprocess.run(
        ["node", str(tmp_path / "run.mjs")], capture_output=True, text=True, check=True
    ).stdout
    found = model.at(*points.T, model.outputs)
    for i, own in enumerate(json.loads(out)):
        assert own["verdict"] == found["verdict"][i]
        for name in model.outputs:
            assert own[name][0] == pytest.approx(found[name][i], rel=1e-12, abs=1e-12)
            assert own[name][1] == pytest.approx(found[f"{name}_error"][i], rel=1e-2)


@noded
@pytest.mark.parametrize("rule", ["hill", "reciprocal"])
def test_every_pixel_has_the_colour_of_the_verdict_at_its_place(rule, tmp_path):
    """Also where two multipliers touch without harm, which shortened series alone would colour unstable."""
    if rule == "hill":
        given = {
            "scene": "mathieu",
            "axes": {
                "a": {"start": 0.0, "stop": 9.0, "num": 9},
                "q": {"start": 0.0, "stop": 4.0, "num": 9},
            },
        }
    else:
        own = str(ROOT / "workflows/coupled_mathieu.py")
        given = {
            "scene": own,
            "axes": {
                "Omega": {"start": 0.9, "stop": 1.3, "num": 9},
                "epsilon": {"start": 0.0, "stop": 0.3, "num": 9},
            },
        }
    (tmp_path / "map.model").write_bytes(build.packed(check(given | {"output": {"path": "x.nc"}})))
    model = survey.Model(tmp_path / "map.model")
    assert model.rule == rule
    width, height = 230, 170
    steps = [(b - a) / n for a, b, n in zip(model.low, model.high, (width, height), strict=True)]
    x, y = (
        model.low[0] + (np.arange(width) + 0.5) * steps[0],
        model.high[1] - (np.arange(height) + 0.5) * steps[1],
    )
    job = {
        "x": [x[0], steps[0]],
        "y": [y[0], -steps[1]],
        "width": width,
        "height": height,
        "show": "verdict",
    }
    job |= {
        "colours": {code: [code + 1] * 3 for code in (-1, 0, 1)},
        "lines": False,
        "thick": 1,
        "phase": [0, 0],
    }
    (tmp_path / "run.mjs").write_text(
        "import fs from 'fs'\n"
        f"const read = name => fs.readFileSync({str(SCRIPTS)!r} + '/' + name, 'utf8')\n"
        "const engine = new Function(read('model.js') + read('engine.js') + '; return {readModel, draw}')()\n"
        f"const model = await engine.readModel(new Uint8Array(fs.readFileSync({str(tmp_path / 'map.model')!r})))\n"
        "Object.assign(model, {rule: model.about.rule, functions: model.about.functions.map(f => f.name)})\n"
        f"const pixels = engine.draw(model, {json.dumps(job)})\n"
        "console.log(JSON.stringify([...pixels.filter((_, i) => i % 4 === 0)]))\n"
    )
    out = subprocess.run(
        ["node", str(tmp_path / "run.mjs")], capture_output=True, text=True, check=True
    ).stdout
    drawn_verdicts = np.array(json.loads(out)).reshape(height, width) - 1
    verdicts = model.grid(x, y)["verdict"].T
    unlike = drawn_verdicts != verdicts
    assert (
        {0, 1} <= set(np.unique(verdicts))
        and unlike.mean() < 1e-3
        and not (unlike & (drawn_verdicts >= 0) & (verdicts >= 0)).any()
    )


def test_a_map_of_three_axes_shows_a_plane_and_says_which(tmp_path):
    ds = survey.evaluate(
        "satellite",
        k=np.linspace(0.1, 0.9, 4),
        body="oblate",
        rho=xr.DataArray(np.linspace(0.6, 2.0, 5), dims="rho"),
    )
    three = xr.concat([ds, ds], "r").assign_coords(r=("r", [0.0, 2.0]))
    three = three.transpose("k", "rho", "r").assign_attrs(ds.attrs)
    for at, chosen, r in (({}, {"r": "0.0"}, "0"), ({"r": "2"}, {}, "2")):
        told = page.write(three, tmp_path / "map.html", at)
        assert told["plane"] == chosen
        subtitle = f"satellite, oblate, r = {r}: "
        assert subtitle in (tmp_path / "map.html").read_text()


def test_what_cannot_be_shown_is_refused_in_a_line():
    ds = survey.evaluate("mathieu", a=np.linspace(0.0, 1.0, 5), q=0.5)
    with pytest.raises(BadInput, match="two numeric axes"):
        page.made(ds)


def test_a_folder_that_does_not_exist_is_named_before_anything_is_computed(tmp_path):
    with pytest.raises(BadInput, match=r"there is no folder .* create it first"):
        page.write(survey.open(MAP), tmp_path / "none/map.html")
