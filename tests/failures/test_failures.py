"""Where methods fail, on coarse planes: no lies; a wrong value, bar or verdict would be one; page,
picture and JSON.
"""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from snippets import ROOT

import survey
from survey import cli, failures, modules
from survey.failures import compare, planes
from survey.failures.plane import MAP, two_sided
from survey.truth.hill import mathieu

SCENES = [name for name in modules.names(planes) if name != "own_file"]
LONG = ("gyrostat", "own", "satellite")  # their truths compile or run for long
SHARE = 0.2
KEYS = ("name", "method", "points", "refused", "missed", "lies")


@pytest.mark.slow
@pytest.mark.parametrize(
    "scene", [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in SCENES]
)
def test_no_method_lies(scene):
    module = modules.load(planes, scene, "scene")
    of = module.planes(SHARE)
    assert len({plane.name for plane in of}) == len(of) and len(module.ABOUT) > 100
    for plane, results in zip(of, failures.measure(of), strict=True):
        records = [failures.record(plane, method, found) for method, found in results]
        assert not any(r.lies for r in records), records
        # NaN: none answered
        assert not any(r.largest_error_where_met > failures.RTOL for r in records), plane.name
        found = dict(results)
        auto = found["auto"]
        assert auto is not None and (auto.answered | plane_refused(found)).all(), plane.name
        assert any(r.largest_error_over_bar > 1e-3 for r in records), (
            f"{plane.name}: bars a thousand times the errors"
        )
        assert sum(r.unchecked for r in records) <= 0.25 * sum(
            r.points - r.refused for r in records
        )


def plane_refused(found):
    """Where every method refuses."""
    return ~np.any(
        [of.answered for method, of in found.items() if of is not None and method != MAP], axis=0
    )


def test_there_are_planes_of_every_scene_that_the_truths_cover():
    assert {
        "satellite",
        "mathieu",
        "own",
        "libration_elliptic",
        "libration",
        "brun",
        "gyrostat",
    } <= set(SCENES)


@pytest.fixture
def plane():
    return modules.load(planes, "mathieu", "scene").planes(0.25)[1]


def answered(plane, method="auto"):
    return compare.asked(plane, method, failures.RTOL)


def test_a_wrong_value_is_a_lie(plane):
    answer = answered(plane)
    honest = compare.judged(plane, answer, failures.RTOL)
    assert not honest.lie.any() and honest.answered.all()
    off = answer | {"discriminant": answer["discriminant"] + 1e-9}
    assert compare.judged(plane, off, failures.RTOL).lie.all()
    narrow = answer | {"y1_error": answer["y1_error"] * 1e-4}
    assert compare.judged(plane, narrow, failures.RTOL).lie.any()


def test_a_turned_verdict_is_a_lie(plane):
    answer = answered(plane)
    turned = answer | {"verdict": np.where(answer["verdict"] >= 0, 1 - answer["verdict"], -1)}
    decided = answer["verdict"] >= 0
    assert decided.mean() > 0.9
    assert compare.judged(plane, turned, failures.RTOL).lie.ravel()[decided].all()


def test_bars_that_miss_what_was_asked_and_undecided_verdicts_are_counted(plane):
    answer = answered(plane)
    wide = answer | {"exponent_error": np.full_like(answer["exponent_error"], 1.0)}
    assert compare.judged(plane, wide, failures.RTOL).missed.all()
    open_ = answer | {"verdict": np.full_like(answer["verdict"], -1)}
    assert compare.judged(plane, open_, failures.RTOL).undecided.all()


@pytest.mark.slow
def test_a_turning_point_is_held_against_the_true_one():
    plane = modules.load(planes, "gyrostat", "scene").planes(SHARE)[4]
    answer = answered(plane)
    assert (answer["status"] == 16).any() and (answer["status"] == 0).any()
    moved = answer | {"phi_turning": answer["phi_turning"] + 1e-6}
    lies = compare.judged(plane, moved, failures.RTOL).lie.ravel()
    assert lies[answer["status"] == 16].all() and not lies[answer["status"] == 0].any()


def test_points_that_are_refused_one_by_one():
    """Narrow spikes that are not named: a call that holds one is refused; the points beside it are
    answered.
    """
    plane = modules.load(planes, "own", "scene").planes(0.3)[0]
    found = compare.compared(plane, "auto", failures.RTOL)
    assert found.answered.any() and not found.answered.all() and not found.lie.any()
    # by width alone
    assert (~found.answered).all(axis=0).sum() == (~found.answered).any(axis=0).sum()


def test_the_command(tmp_path):
    path = ROOT / "workflows/whittaker_hill.py"
    done = CliRunner().invoke(
        cli.program, ["failures", str(path), "--share", "0.3", "-o", str(tmp_path)]
    )
    assert done.exit_code == 0, done.output
    written = json.loads((tmp_path / "failures_whittaker_hill.json").read_text())
    assert written["planes"] and all(key in row for row in written["planes"] for key in KEYS)
    assert {"auto", "taylor16", "rk4", MAP} <= {row["method"] for row in written["planes"]}
    assert sum(row["lies"] for row in written["planes"]) == 0
    text = (tmp_path / "failures_whittaker_hill.md").read_text()
    assert "there are **none**" in text and "| auto |" in text and "nan" not in text
    assert (tmp_path / "failures_whittaker_hill.png").stat().st_size > 20_000


def test_what_is_not_known_is_null(tmp_path, plane, monkeypatch):
    """JSON has no NaN: of a method that refuses all points no error is known."""
    monkeypatch.setattr(failures, "_planes", lambda scene, share: ("mathieu", "about", [plane]))
    auto = compare.compared(plane, "auto", failures.RTOL)
    monkeypatch.setattr(failures, "measure", lambda planes, say: [[("none", None), ("auto", auto)]])
    failures.write("mathieu", tmp_path)
    strict = {"parse_constant": lambda word: pytest.fail(f"{word} is not JSON")}
    rows = json.loads((tmp_path / "failures_mathieu.json").read_text(), **strict)["planes"]
    assert (
        rows[0]["largest_error"] is None
        and rows[0]["refused"] == plane.size
        and rows[1]["largest_error"] < 1e-9
    )


def test_what_has_no_planes_is_refused(tmp_path):
    with pytest.raises(survey.BadInput, match="unknown failure chart 'satelite'; did you mean"):
        failures.write("satelite", tmp_path)
    with pytest.raises(survey.BadInput, match="--share"):
        failures.write("mathieu", tmp_path, share=0.0)
    with pytest.raises(survey.BadInput, match="name your own file"):
        failures.write("own_file", tmp_path)
    (tmp_path / "linear.py").write_text(
        'PARAMETERS = ("a",)\nPERIOD = 1.0\nSTATES = ("x",)\ndef A(t, p, out):\n    out[0, 0] = p[0]\n'
    )
    with pytest.raises(survey.BadInput, match="true values are known only of Hill equations"):
        failures.write(tmp_path / "linear.py", tmp_path)


def test_a_lie_is_black_and_counted_in_the_page(tmp_path, plane, monkeypatch):
    def shifted(given, answer):
        found = mathieu(given, answer)
        value, low, doubt = found["y1"]
        return found | {"y1": (value, low + 1e-6, doubt)}

    of = [replace(plane, truth=shifted)]
    monkeypatch.setattr(failures, "_planes", lambda scene, share: ("mathieu", "about", of))
    failures.write("mathieu", tmp_path)
    rows = json.loads((tmp_path / "failures_mathieu.json").read_text())["planes"]
    assert all(row["lies"] == row["points"] - row["refused"] for row in rows)
    assert "there are **none**" not in (tmp_path / "failures_mathieu.md").read_text()


def test_a_two_sided_axis():
    axis, offsets = two_sided("x", np.array([-3.0, -2.0, -1.0]))
    assert (
        offsets.tolist() == [-0.1, -0.01, -0.001, 0.001, 0.01, 0.1]
        and axis.size == 6
        and axis.ticks[2.5] == "0"
    )
