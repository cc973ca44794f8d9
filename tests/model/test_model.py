"""Models of maps: true errors within the bars, verdicts that never contradict, and files that other
programs read.
"""

import hashlib
import json
import re
import shutil
import subprocess
import sys
import time
import zipfile
from io import BytesIO
from pathlib import Path

import mpmath
import numpy as np
import pytest
import tomli_w
import viewer as picture
import xarray as xr

import survey
from survey.errors import BadInput, Damaged
from survey.model import build, proved, reader
from survey.request.workflow import check, read
from survey.share import page

ROOT = Path(__file__).parents[2]
HILL = '''"""A Hill equation whose coefficient is not even."""
from math import cos, pi, sin
PARAMETERS, PERIOD, EVEN = ("a", "q"), pi, False
def z(u, p):
    return p[0] - 2 * p[1] * (cos(2 * u) + 0.3 * sin(4 * u))
'''
PAIR = '''"""Two coupled oscillators with damping: x' = A(t) x."""
from math import cos, pi
PARAMETERS, PERIOD, STATES = ("w", "e"), 2 * pi, ("x", "v")
def A(t, p, out):
    out[0, 1] = 1.0
    out[1, 0] = -p[0] ** 2 * (1.0 + p[1] * cos(t))
    out[1, 1] = -0.02
'''
DAMPED = '''"""Mathieu's equation with damping."""
from math import cos, pi
PARAMETERS, PERIOD, EVEN, DAMPING = ("a", "q", "c"), pi, True, "c"
def z(u, p):
    return p[0] - 2 * p[1] * cos(2 * u)
'''


def workflow(scene, axes, **more):
    table = {name: {"start": a, "stop": b, "num": 40} for name, (a, b) in axes.items()}
    return {
        "scene": str(scene),
        "axes": table,
        "solver": {"rtol": 1e-12},
        "output": {"path": "unused.nc"},
    } | more


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("models")
    (path / "odd.py").write_text(HILL)
    (path / "pair.py").write_text(PAIR)
    return path


@pytest.fixture(scope="module")
def satellite(folder):
    """The README's map at 1e-12."""
    path = folder / "satellite.model"
    build.model(read(ROOT / "workflows/satellite_prolate.toml", ["solver.rtol=1e-12"]), path)
    return path


MAPS = {
    "mathieu": lambda at: workflow("mathieu", {"a": (0.0, 20.0), "q": (0.0, 10.0)}),
    "libration_elliptic": lambda at: workflow(
        "libration_elliptic", {"mu": (0.0, 0.055), "e": (0.0, 0.7)}
    ),
    "rotations": lambda at: workflow(
        "satellite", {"k": (1.2, 2.5), "rho": (-1.5, 1.5)}, options={"body": "oblate"}
    ),
    "odd": lambda at: workflow(at / "odd.py", {"a": (0.0, 5.0), "q": (0.0, 2.0)}),
    "pair": lambda at: workflow(at / "pair.py", {"w": (0.3, 1.2), "e": (0.0, 0.8)}),
    "coupled": lambda at: workflow(
        ROOT / "workflows/coupled_mathieu.py", {"Omega": (1.0, 1.6), "epsilon": (0.0, 0.3)}
    ),
}


@pytest.fixture(scope="module", params=MAPS)
def other(request, folder):
    checked = check(MAPS[request.param](folder))
    path = folder / f"{request.param}.model"
    build.model(checked, path)
    return checked, path


def compared(checked, path, number, seed):
    """Model and `survey.evaluate` at random points: (outputs of the model, dataset)."""
    model = survey.Model(path)
    rng = np.random.default_rng(seed)
    x, y = (rng.uniform(low, high, number) for low, high in zip(model.low, model.high, strict=True))
    found = model.at(x, y, model.outputs)
    given = {
        name: xr.DataArray(values, dims="p")
        for name, values in zip(model.names, (x, y), strict=True)
    }
    scene = checked.name if isinstance(checked.scene, type(sys)) else checked.scene
    more = dict(checked.request.options) | model.about["fixed"]
    return found, survey.evaluate(scene, rtol=1e-13, method="auto", **more, **given)


def assert_agree(found, ds):
    for name in found:
        if f"{name}_error" in found and name in ds:
            off = abs(found[name] - ds[name].values)
            assert (off <= found[f"{name}_error"] + ds[f"{name}_error"].values).all(), name
    own, verdict = found["verdict"], ds.verdict.values
    both = (own >= 0) & (verdict >= 0) & (verdict < 2)
    assert (own[both] == verdict[both]).all() and both.mean() > 0.95


def test_a_model_agrees_with_evaluate_within_both_bars(other):
    assert_agree(*compared(*other, 300, 1))


@pytest.mark.parametrize(("axes", "number"), [({"q": (0.0, 2.0), "c": (-0.2, 0.4)}, {"a": 1.0}),
                                               ({"a": (0.0, 5.0), "q": (0.1, 2.0)}, {"c": 0.0})])  # fmt: skip
def test_damped_hill_equations_have_models(folder, axes, number):
    """Both coefficients of l^2 - D l + e^(-2 c T), and verdicts; without damping, D alone."""
    (folder / "damped.py").write_text(DAMPED)
    given = workflow(folder / "damped.py", axes)
    given["axes"] |= number
    build.model(check(given), folder / "damped.model")
    found, ds = compared(check(given), folder / "damped.model", 300, 3)
    assert_agree(found, ds)
    assert {0, 1} <= set(found["verdict"].tolist())
    if number == {"a": 1.0}:
        off = abs(found["c1"] + ds.discriminant.values)
        assert (off <= found["c1_error"] + ds.discriminant_error.values).all() and found[
            "c1_error"
        ].max() < 1e-9
        c = ds.c.values
        for value, bar, own in zip(found["c2"], found["c2_error"], c, strict=True):
            with mpmath.workdps(30):
                assert (
                    abs(
                        mpmath.mpf(float(value))
                        - mpmath.exp(-2 * mpmath.mpf(float(own)) * mpmath.pi)
                    )
                    <= bar
                    < 1e-9
                )


def test_the_readmes_map_fits_into_300_kb_and_agrees(satellite):
    assert satellite.stat().st_size < 300_000
    checked = read(ROOT / "workflows/satellite_prolate.toml")
    found, ds = compared(checked, satellite, 2000, 2)
    assert_agree(found, ds)
    assert np.median(found["discriminant_error"] / (1 + abs(found["discriminant"]))) < 1.5e-12


def test_true_errors_are_within_the_bars(satellite):
    """Against held references of the satellite (Taylor series in multiprecision)."""
    model, checked = survey.Model(satellite), 0
    for record in json.loads((ROOT / "survey/reference/satellite.json").read_text())["libration"]:
        k, rho = float(record["k"]), float(record["rho"])
        if record["fam"] != "PL" or not (0 <= k <= 0.99 and 0.6 <= rho <= 4.0):
            continue
        found = model.at(k, rho, model.outputs)
        for name in ("y1", "y2", "dy1", "dy2"):
            with mpmath.workdps(40):
                off = abs(mpmath.mpf(float(found[name])) - mpmath.mpf(record[f"{name}_half"]))
            assert off <= float(found[f"{name}_error"]), (k, rho, name)
            checked += 1
    assert checked >= 12


def test_next_to_edges_verdicts_never_contradict(satellite):
    """At distances down to 1e-12 of an edge, where D = +-2 has lost all digits but the factors have not."""
    model = survey.Model(satellite)
    edges = survey.edge("satellite", along="rho", near=1.2, k=0.9, body="prolate")
    rho = float(edges.edge.values.reshape(-1)[0])
    near = rho + np.concatenate([sign * 10.0 ** np.arange(-12, -2) for sign in (-1, 1)])
    found = model.at(0.9, near)
    ds = survey.evaluate("satellite", k=0.9, rho=np.sort(near), body="prolate")
    true = ds.verdict.values[np.argsort(np.argsort(near))]
    decided = found["verdict"] >= 0
    assert (found["verdict"][decided] == true[decided]).all() and decided[
        abs(near - rho) > 1e-10
    ].all()
    assert {0, 1} <= set(found["verdict"].tolist())


def test_grids_cells_and_points_give_the_same_within_their_bars(satellite):
    model, rng = survey.Model(satellite), np.random.default_rng(4)
    x, y = rng.uniform(0, 0.99, reader.FEW), rng.uniform(0.6, 4.0, reader.FEW)
    fast = model.at(x, y)
    slow = model.at(x[:3000], y[:3000])
    off = abs(fast["discriminant"][:3000] - slow["discriminant"])
    assert (off <= fast["discriminant_error"][:3000] + slow["discriminant_error"]).all()
    assert (fast["verdict"][:3000] == slow["verdict"]).all()
    for name in model.names:
        a, b = fast[f"discriminant_by_{name}"][:3000], slow[f"discriminant_by_{name}"]
        assert np.allclose(a, b, rtol=1e-7, atol=1e-7 * abs(b).max())
    grid = model.grid(x[:60], y[:50], model.outputs)
    points = model.at(*np.meshgrid(x[:60], y[:50], indexing="ij"), model.outputs)
    for name, values in grid.items():
        assert values.shape == (60, 50) and np.allclose(
            values, points[name], rtol=1e-9, atol=1e-9
        ), name


def test_gradients_are_those_of_the_values(satellite):
    model, h = survey.Model(satellite), 1e-6
    x, y = np.array([0.3, 0.6, 0.9]), np.array([1.0, 2.0, 3.5])
    found = model.at(x, y, model.outputs)
    for name in model.outputs:
        for p, dx, dy in (("k", h, 0.0), ("rho", 0.0, h)):
            ahead, behind = (model.at(x + s * dx, y + s * dy, name)[name] for s in (1, -1))
            assert np.allclose(
                found[f"{name}_by_{p}"], (ahead - behind) / (2 * h), rtol=1e-6, atol=1e-6
            ), (name, p)


def test_the_call_follows_xarray(satellite):
    model = survey.Model(satellite)
    ds = model(k=np.linspace(0.1, 0.9, 5), rho=np.linspace(1.0, 3.0, 4))
    assert ds.discriminant.dims == ("k", "rho") and {
        "verdict",
        "discriminant_error",
        "discriminant_by_k",
    } <= set(ds)
    pairs = model(
        k=xr.DataArray([0.1, 0.5], dims="p"), rho=xr.DataArray([1.0, 2.0], dims="p"), gradient=False
    )
    assert pairs.discriminant.dims == ("p",) and "discriminant_by_k" not in pairs
    assert float(model(k=0.1, rho=1.0).discriminant) == float(pairs.discriminant[0])
    evaluated = survey.evaluate("satellite", k=ds.k.values, rho=ds.rho.values, body="prolate")
    assert (
        abs(ds.discriminant - evaluated.discriminant)
        <= ds.discriminant_error + evaluated.discriminant_error
    ).all()


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"k": 0.995, "rho": 1.0}, "k = 0.99"),
        ({"k": 0.5, "rho": [1.0, np.nan]}, "rho = nan"),
        ({"k": 0.5}, "give k and rho"),
        ({"k": 0.5, "rho": 1.0, "variables": "period"}, "unknown variable 'period'"),
        ({"k": np.zeros((2, 2)), "rho": 1.0}, "give a DataArray"),
    ],
)
def test_places_outside_and_bad_arguments_are_refused(satellite, given, line):
    with pytest.raises(ValueError, match=re.escape(line)) as raised:
        survey.Model(satellite)(**given)
    assert "\n" not in str(raised.value)


def test_around_a_singularity_there_is_no_answer(folder):
    path = folder / "through.model"
    build.model(
        check(
            workflow("satellite", {"k": (0.9, 1.1), "rho": (0.5, 1.0)}, options={"body": "prolate"})
        ),
        path,
    )
    found = survey.Model(path).at([0.95, 1.0, 1.05], 0.7)
    assert (
        found["verdict"][1] == -1
        and np.isnan(found["discriminant"][1])
        and np.isnan(found["discriminant_error"][1])
    )
    assert np.isfinite(found["discriminant"][[0, 2]]).all()


def test_reading_needs_numpy_alone(satellite):
    """A copy of the reader, where survey cannot be imported, and survey.Model itself: neither loads numba."""
    shutil.copy(reader.__file__, satellite.parent / "copied_reader.py")
    alone = f"""
import sys; sys.path.insert(0, {str(satellite.parent)!r})
sys.modules["survey"] = sys.modules["numba"] = sys.modules["xarray"] = None
from copied_reader import Model
print(Model({str(satellite)!r}).at(0.5, 1.2)["verdict"])
"""
    within = f"""
import sys, survey
print(survey.Model({str(satellite)!r})(k=0.5, rho=[1.2]).verdict.values, "numba" in sys.modules)
"""
    outputs = [subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
               for code in (alone, within)]  # fmt: skip
    assert outputs == ["1\n", "[1] False\n"]


def test_the_documented_reader_of_60_lines_gives_the_same(satellite):
    text = (ROOT / "workflows/docs/model.md").read_text()
    code = re.search(r"```python\n# file: read_model.py\n(.*?)```", text, re.DOTALL)[1]
    assert len(code.splitlines()) <= 60
    scope = {}
    exec(code, scope)
    about, model = scope["read_model"](satellite), survey.Model(satellite)
    for k, rho in np.random.default_rng(9).uniform((0.0, 0.6), (0.99, 4.0), (40, 2)):
        found, own = scope["functions"](about, k, rho), model.at(k, rho, model.outputs)
        for name, (value, bar) in found.items():
            assert value == pytest.approx(float(own[name]), rel=1e-13, abs=1e-13) and bar == float(
                own[f"{name}_error"]
            )
        verdict, d = scope["hill"](found)
        assert verdict == own["verdict"] and d == pytest.approx(
            float(own["discriminant"]), abs=1e-11
        )
    assert scope["functions"](about, 0.995, 1.0) is None


def test_damaged_files_are_refused(satellite, tmp_path):
    with zipfile.ZipFile(satellite) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    series = bytearray(members["series.f64"])
    series[1000] ^= 1
    for name, changed, line in (("bits", {"series.f64": bytes(series)}, "its bits have changed"),
                                ("other", {"model.json": b'{"format": "x"}'}, "the format is 'x'")):  # fmt: skip
        with zipfile.ZipFile(tmp_path / name, "w") as archive:
            for member, content in (members | changed).items():
                archive.writestr(member, content)
        with pytest.raises(ValueError, match=line):
            survey.Model(tmp_path / name)
    (tmp_path / "text").write_text("no zip")
    with pytest.raises(ValueError, match="not a model"):
        survey.Model(tmp_path / "text")


def written(path, table, series):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("model.json", table if isinstance(table, bytes) else json.dumps(table))
        archive.writestr("series.f64", series)
    return path


def test_damage_at_any_byte_is_refused_in_a_line(satellite, tmp_path):
    """Bits in the packed series, in the headers of the zip, and an end that is missing."""
    whole, rng = satellite.read_bytes(), np.random.default_rng(5)
    model = survey.Model(satellite)
    places = [*range(60), *rng.integers(len(whole), size=60), *range(len(whole) - 140, len(whole))]
    copies = [
        bytes([*whole[:at], whole[at] ^ int(rng.integers(1, 256)), *whole[at + 1 :]])
        for at in places
    ]
    for damaged in copies + [whole[:end] for end in rng.integers(len(whole), size=10)]:
        (tmp_path / "damaged").write_bytes(damaged)
        try:
            found = survey.Model(tmp_path / "damaged")
        except ValueError as refused:
            assert "damaged: " in str(refused) and "\n" not in str(refused)
        else:  # a date, a comment
            assert found.about == model.about
    with pytest.raises(FileNotFoundError):
        survey.Model(tmp_path / "none")


def test_a_table_of_another_form_is_refused_in_a_line(satellite, tmp_path):
    with zipfile.ZipFile(satellite) as archive:
        table, series = json.loads(archive.read("model.json")), archive.read("series.f64")
    assert survey.Model(written(tmp_path / "m", table, series)).at(0.5, 1.2)["verdict"] == 1
    panel = table["panels"][0]
    wrong = [
        {key: value for key, value in table.items() if key != left}
        for left in ("panels", "rule", "title")
    ]
    wrong += [table | change for change in (
        {"rule": "danby"}, {"rule": []}, {"panels": []}, {"proof": {"areas": {}}},
        {"functions": table["functions"][:3]},
        {"parameters": [table["parameters"][0] | {"name": "\x1b[2J"}, table["parameters"][1]]},
    )]  # fmt: skip
    wrong += [table | {"panels": [panel | change]} for change in (
        {"first": -8}, {"first": len(series) // 8}, {"terms": [[10**9]] * 4}, {"terms": [[0] * 10**5] * 4},
        {"terms": panel["terms"][:3]}, {"bars": [1e-12] * 3}, {"bars": [-1.0] * 4}, {"bars": ["x"] * 4},
        {"bars": [float("nan")] * 4}, {"low": [0.0]}, {"low": panel["high"]},
    )]  # fmt: skip
    wrong += [
        b"[]",
        b"null",
        b"[" * 100_000,
        table | {"panels": [panel | {"terms": [[1024] + [0] * 1023] * 4}] * 100},
    ]
    for one in wrong:
        with pytest.raises(
            ValueError, match=r"not a model|not that of a model|its bits have changed"
        ) as refused:
            survey.Model(written(tmp_path / "m", one, series))
        assert "\n" not in str(refused.value) and refused.value.__cause__ is None
    with pytest.raises(ValueError, match="would unpack to more than"):
        survey.Model(written(tmp_path / "m", b" " * (reader.BYTES + 1), series))


def test_a_map_of_more_cells_than_can_be_numbered_is_answered_from_its_panels(tmp_path):
    """D = x + 3 y in strips: 67 x 66 edges make 70,752 cells."""
    places, numbers, n = [], [], 66
    for i in range(n):
        places += [
            ((0.5 * i / n, 0.0), (0.5 * (i + 1) / n, 1.0)),
            ((0.5, i / n), (1.0, (i + 1) / n)),
        ]
    for (x0, y0), (x1, y1) in places:
        numbers += [0.5 * (x0 + x1) + 1.5 * (y0 + y1), 1.5 * (y1 - y0), 0.5 * (x1 - x0)]
    series = np.array(numbers).tobytes()
    table = {
        "format": reader.FORMAT, "title": "strips", "scene": "own", "options": "", "rule": "trace",
        "parameters": [{"name": name, "low": 0.0, "high": 1.0} for name in "xy"],
        "functions": [{"name": "discriminant", "long_name": "D"}], "sha256": hashlib.sha256(series).hexdigest(),
        "panels": [{"low": low, "high": high, "bars": [1e-14], "first": 3 * i, "terms": [[2, 1]]}
                   for i, (low, high) in enumerate(places)],
    }  # fmt: skip
    model = survey.Model(written(tmp_path / "m", table, series))
    x, y = np.random.default_rng(3).uniform(size=(2, reader.FEW))
    found = model.at(x, y, "discriminant")
    assert (abs(found["discriminant"] - (x + 3 * y)) <= found["discriminant_error"]).all()
    assert ((found["verdict"] == 1) == (x + 3 * y < 2)).mean() > 0.9999


def test_progress_tells_how_much_of_the_map_is_served_and_budgets_end_the_search():
    checked = check(workflow("satellite", {"inertia_ratio": (0.0, 2.0), "amplitude": (0.0, 1.57)}))
    told = []
    content = build.packed(checked, None, 60_000, progress=lambda *given: told.append(given))
    done, totals, reused, _ = zip(*told, strict=True)
    assert (
        done[0] == 0
        and min(done[1:]) >= 1
        and list(done) == sorted(done)
        and 700 < done[-1] < totals[-1] == 1000
    )
    assert set(reused) == {0} and len(told) <= 60_000 // build.NODES**2 + 1
    fewer = build.packed(checked, None, 60_000, most=len(content) // 2)
    tables = [
        json.loads(zipfile.ZipFile(BytesIO(own)).read(reader.TABLE))["panels"]
        for own in (content, fewer)
    ]
    whole, part = ({(*own["low"], *own["high"]) for own in table} for table in tables)
    area = [np.prod(np.subtract(own[2:], own[:2])) for own in part]
    assert len(fewer) <= len(content) // 2 and part < whole
    assert min(area) >= max(np.prod(np.subtract(own[2:], own[:2])) for own in whole - part)


def test_the_same_map_has_the_same_bytes(folder):
    checked = check(workflow("mathieu", {"a": (0.0, 5.0), "q": (0.0, 2.0)}))
    assert build.packed(checked) == build.packed(checked)


@pytest.mark.parametrize(
    ("scene", "axes", "numbers", "line"),
    [
        (
            "brun",
            {"l": (0.0, 1.0), "alpha": (0.0, 1.0)},
            {"beta": 0.5},
            "no series are available for the scene",
        ),
        (
            "satellite_triaxial",
            {"roll_ratio": (0.1, 0.5), "C": (1.0, 2.0)},
            {"k": 0.5, "yaw_ratio": 0.1},
            "no series are available",
        ),
        ("mathieu", {"a": (0.0, 5.0)}, {"q": 1.0}, "a model needs exactly two"),
    ],
)
def test_what_has_no_series_is_refused_in_a_line(scene, axes, numbers, line):
    given = workflow(scene, axes)
    given["axes"] |= numbers
    with pytest.raises(BadInput, match=line):
        build.packed(check(given))


def test_the_command_needs_no_folder_but_that_of_its_own_output(tmp_path):
    table = workflow("mathieu", {"a": (0.0, 4.0), "q": (0.0, 1.0)}, output={"path": "results/m.nc"})
    (tmp_path / "m.toml").write_text(tomli_w.dumps(table))
    program = [sys.executable, "-m", "survey", "model", "m.toml", "-o"]
    done = subprocess.run([*program, "m.model"], cwd=tmp_path, capture_output=True, text=True)
    assert (
        done.returncode == 0 and survey.Model(tmp_path / "m.model").at(1.0, 0.5)["verdict"] == 0
    ), done.stderr
    done = subprocess.run([*program, "none/m.model"], cwd=tmp_path, capture_output=True, text=True)
    assert (
        done.returncode == 2
        and "'none/m.model': there is no folder 'none'; create it first" in done.stderr
    )


PLACES = (2.03, 0.51), (1.03, 0.51), (1.53, 0.51)  # within cells: the last of one that stays open


def _page_says_what_is_proved(folder, digest):
    page.write(survey.open(folder / "p.nc"), folder / "p.html")
    text = (folder / "p.html").read_text()
    assert (
        "<strong>Proved</strong>" in text
        and f"sha256 {digest}: survey-check p.cert verifies it" in text
    )
    if picture.missing():
        return
    with picture.browser() as driver:
        driver.get(f"file://{folder / 'p.html'}")
        while not driver.execute_script("return typeof idle == 'function' && idle()"):
            time.sleep(0.1)
        told = [driver.execute_script("return known(...arguments)", *at) for at in PLACES]
    ds = survey.open(folder / "p.nc")
    for (a, q), own in zip(PLACES, told, strict=True):
        inside = (
            (ds.cell_a_low <= a)
            & (a <= ds.cell_a_high)
            & (ds.cell_q_low <= q)
            & (q <= ds.cell_q_high)
        )
        known = {int(code) for code in ds.cell_verdict[inside.values]} - {-1}
        assert own["proved"] == ({1: "stable", 0: "unstable"}[known.pop()] if known else None)
    assert [own["proved"] for own in told[:2]] == ["stable", "unstable"]


@pytest.mark.slow
def test_a_proof_is_carried_and_another_maps_is_refused(tmp_path):
    pytest.importorskip("flint")
    table = workflow(
        "mathieu", {"a": (0.0, 4.0), "q": (0.0, 1.0)}, refine={"width": {"a": 0.1, "q": 0.1}}
    )
    table["output"] = {"path": str(tmp_path / "m.nc")}
    (tmp_path / "m.toml").write_text(tomli_w.dumps(table))
    program = [sys.executable, "-m", "survey"]
    subprocess.run([*program, "prove", "m.toml", "-o", "p.nc", "--quiet"], cwd=tmp_path, check=True)
    subprocess.run(
        [*program, "model", "m.toml", "-o", "m.model", "--proof", "p.nc"], cwd=tmp_path, check=True
    )
    model = survey.Model(tmp_path / "m.model")
    assert "Stable: all solutions are bounded" in model.about["proof"]["statement"]
    assert model(a=1.0, q=0.1).attrs["proof"] == model.about["proof"]["statement"]
    low, high = model.about["proof"]["areas"]["stable"]
    assert 0 < low < high < 4
    _page_says_what_is_proved(tmp_path, model.about["proof"]["sha256"])
    with pytest.raises(BadInput, match="another map"):
        proved.matching(
            survey.open(tmp_path / "p.nc"),
            check(workflow("mathieu", {"a": (0.0, 5.0), "q": (0.0, 1.0)})),
        )
    ds = survey.open(tmp_path / "p.nc")
    wide = ds.cell_a_low.copy(data=ds.cell_a_high.values)
    for damaged in (
        *(ds.drop_attrs(deep=False).assign_attrs({k: v for k, v in ds.attrs.items() if k != left})
          for left in ("refine", "proof_certificate", "proof_sha256")),
        ds.assign_attrs(refine="a"), ds.assign_attrs(refine="a, x"), ds.drop_vars("area_low"),
        ds.assign(area_low=ds.area_low * np.nan), ds.assign(cell_a_low=wide),
        ds.assign(cell_verdict=ds.cell_verdict + np.int8(7)),
    ):  # fmt: skip
        with pytest.raises(
            Damaged, match="what the file says of its proof is incomplete"
        ) as refused:
            proved.of(damaged)
        assert "\n" not in str(refused.value)
