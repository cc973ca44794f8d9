"""`survey verify` solves points again by another method: sound maps have no complaints, a planted
value has one.
"""

from pathlib import Path

import numpy as np
import pytest
from test_scenes import draw, questions

import survey
from survey.analysis.audit import audit
from survey.file.labels import error_bars
from survey.request.user_scene import find

WORKFLOWS = Path(__file__).parents[2] / "workflows"
OTHERS = [
    ("satellite", {}, {"inertia_ratio": [0.3, 0.8, 1.4], "amplitude": [0.4, 1.2]}),
    ("satellite", {"direction": "-1"}, {"inertia_ratio": [0.3, 1.4], "k": [1.2, 2.0]}),
    ("libration", {}, {"mu": [0.001, 0.012, 0.03]}),
    ("libration_elliptic", {}, {"mu": [0.01, 0.03], "e": [0.0, 0.1, 0.4]}),
    (str(WORKFLOWS / "meissner.py"), {}, {"q": [1.3, 2.6], "a": [1.1, 4.2, 9.3]}),
]


def maps():
    """(scene, options, axes) of small maps of every scene and every value of its options."""
    for case in questions():
        scene, options = case.values
        axes = {
            key: np.sort(np.atleast_1d(v)).tolist() for key, v in draw(scene, options, 5).items()
        }
        slow = [pytest.mark.slow] * (case.id in ("gyrostat-fate", "gyrostat-portrait"))
        yield pytest.param(scene.__name__.rpartition(".")[2], options, axes, id=case.id, marks=slow)
    for scene, options, axes in OTHERS:
        yield pytest.param(scene, options, axes, id="-".join([Path(scene).stem, *axes]))


@pytest.mark.parametrize(("scene", "options", "axes"), list(maps()))
def test_a_sound_map_has_no_complaints_and_every_planted_value_is_found(
    scene, options, axes, tmp_path
):
    listed = {
        key: {"values": values} if len(values) > 1 else values[0] for key, values in axes.items()
    }
    ds = survey.run(
        {"scene": scene, "options": options, "axes": listed}, output=tmp_path / "map.nc"
    )
    healthy = audit(ds, 12)
    assert healthy["complaints"] == [] and healthy["points"] >= min(ds.status.size, 12) // 2, (
        healthy
    )
    names = {name for name in ds.data_vars if not name.endswith("_error") and name != "status"}
    fills = {o.name: o.fill for o in find(scene)[1].OUTPUTS if o.flags is None}
    # beside a wrong verdict counts say nothing
    for some in (names & {"verdict"}, names - {"verdict"}):
        planted = ds.copy(deep=True)
        wrong = {name for name in some if _plant(planted, name, fills.get(name))}
        found = {line.split(" at ")[0] for line in audit(planted, 1000)["complaints"]}
        assert found == wrong, (found, wrong)
        assert wrong or "verdict" not in some or (ds.verdict == -1).all()


def _plant(ds, name, fill):
    """Is there a known value of `name`, now wrong: just beyond its bar, or another code?"""
    values = ds[name].values
    known = np.argwhere(
        np.isfinite(values) if name in error_bars(ds) else (values >= 0) & (values != fill)
    )
    if not len(known):
        return False
    where = tuple(known[len(known) // 2])
    if name in error_bars(ds):
        values[where] += 1e-6 * (1 + abs(values[where])) + 4 * ds[f"{name}_error"].values[where]
        return True
    codes = ds[name].attrs.get("flag_values", np.array([values[where], values[where] + 1]))
    values[where] = codes[(codes != values[where]) & (codes >= 0)][0]
    return True


def test_edges_and_cells_are_solved_again(tmp_path):
    axes = {"a": {"start": 0.5, "stop": 9.5, "num": 5}, "q": {"start": 0.5, "stop": 5.0, "num": 4}}
    workflow = {"scene": "mathieu", "axes": axes, "output": {"variables": ["verdict"]}}
    ds = survey.run(
        workflow | {"boundaries": {"axis": "a"}, "refine": {"width": 0.05}},
        output=tmp_path / "map.nc",
    )
    sound = audit(ds, 30)
    assert (
        sound["complaints"] == []
        and sound["cells"] == 30
        and sound["edges"] == ds.sizes["edge"] > 10
    )
    planted = ds.copy(deep=True)
    planted.edge_position[5] += 1e-7
    (line,) = audit(planted, 1000)["complaints"]
    assert (
        line.startswith("edge_position at q = ")
        and "has no zero within its error bar, by dop853" in line
    )
    planted = ds.copy(deep=True)
    largest = ((ds.cell_a_high - ds.cell_a_low) * (ds.cell_verdict != -1)).values.argmax()
    planted.cell_verdict[largest] = 1 - ds.cell_verdict[largest]
    (line,) = audit(planted, 100_000)["complaints"]
    assert line.startswith("cell_verdict at a = ") and " not " in line


def test_boundaries_on_one_axis_of_a_linear_system_are_no_factors_of_hills_equation(tmp_path):
    (tmp_path / "pair.py").write_text(
        "from math import cos, pi\nPARAMETERS = ('d', 'e')\nSTATES = ('x', 'y')\nPERIOD = pi\n"
        "STRUCTURE = 'symplectic'\n\ndef K(t, p, out):\n"
        "    out[0, 0] = p[0] + p[1] * cos(2 * t)\n    out[1, 1] = 2.3 * p[0]\n"
        "    out[0, 1] = out[1, 0] = p[1] * cos(2 * t)\n"
    )
    axes = {"d": {"start": 0.1, "stop": 3.0, "num": 12}, "e": 1.0}
    workflow = {"scene": str(tmp_path / "pair.py"), "axes": axes, "boundaries": {}}
    ds = survey.run(workflow, output=tmp_path / "pair.nc")
    report = audit(ds, 4)
    assert ds.sizes["edge"] > 2 and report["points"] == 4 and report["complaints"] == []


def test_multipliers_are_compared_whatever_their_order(tmp_path):
    """Moduli that differ by 1e-7 are equal within the bars of a coarse map, and come by their angles; its audit
    tells which is larger.
    """
    (tmp_path / "apart.py").write_text(
        "from math import pi\nPARAMETERS = ('c',)\nSTATES = ('x', 'y', 'u', 'v')\nPERIOD = pi\n\n"
        "def A(t, p, out):\n    out[0, 2] = out[1, 3] = 1.0\n    out[2, 0], out[3, 1] = -1.7, -2.7\n"
        "    out[2, 2], out[3, 3] = -p[0], -p[0] - 1e-7\n"
    )
    axes = {"c": {"start": 0.1, "stop": 0.3, "num": 9}}
    solver = {"method": "rk4", "rtol": 1e-4}
    ds = survey.run(
        {"scene": str(tmp_path / "apart.py"), "axes": axes, "solver": solver},
        output=tmp_path / "apart.nc",
    )
    report = audit(ds, 9)
    assert report["points"] == 9 and report["complaints"] == []
    sharp = survey.evaluate(
        str(tmp_path / "apart.py"), method="dop853", rtol=1e-6, c=ds.c.values
    ).multiplier_im
    assert (np.sign(sharp) != np.sign(ds.multiplier_im)).any()  # in another order
    planted = ds.copy(deep=True)
    planted.multiplier_im[4, 2] *= 1.001
    assert [line.split(" at ")[0] for line in audit(planted, 9)["complaints"]] == ["multiplier_im"]
    assert any(
        "multiplier_re" in line
        for line in audit(ds.drop_vars("multiplier_re_error"), 9)["complaints"]
    )
