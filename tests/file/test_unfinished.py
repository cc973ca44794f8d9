"""What an unfinished run has left: how much is done, how to resume, what differs from the run that
is asked for.
"""

import json
import re
import zlib

import numpy as np
import pytest

import survey
from survey.errors import BadInput, Damaged
from survey.file import blocks, reading, unfinished
from survey.request import workflow
from survey.sweep import cost, engine, fingerprint, plan

DONE = (1, 3, 4)


@pytest.fixture
def left(small, tmp_path, monkeypatch):
    """The folder of a run that was stopped when three of its six blocks were kept."""
    monkeypatch.setattr(cost, "BLOCK_POINTS", 4)
    monkeypatch.chdir(tmp_path)

    def stop(job, blocks, finished):
        for number in DONE:
            job(blocks[number])
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(engine.dispatch, "on_threads", stop)
        engine.run(workflow.read(small))
    return tmp_path / "small.nc.blocks"


def refusal(small, *overrides):
    """The line that refuses the run."""
    with pytest.raises(BadInput) as refused:
        engine.run(workflow.read(small, overrides))
    return str(refused.value)


def test_what_is_left_is_reported(left, small):
    answer = unfinished.summary("small.nc")
    assert (answer["blocks_done"], answer["blocks"], answer["points_done"], answer["points"]) == (
        3,
        6,
        12,
        24,
    )
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", answer["last_written"])
    assert answer["resume"] == "survey run small.nc.blocks/workflow.toml -o small.nc"
    with pytest.raises(
        Damaged,
        match=r"does not exist yet; .* 3 of 6 blocks \(12 of 24 points\).* resume with: survey run",
    ):
        survey.open("small.nc")
    # the command that `resume` names
    again = workflow.read(left / "workflow.toml", output="small.nc")
    seen = []
    engine.run(again, progress=lambda done, total, reused, **_: seen.append((done, total, reused)))
    assert (
        seen[0] == (3, 6, 3)
        and reading.check("small.nc") == []
        and unfinished.summary("small.nc") == {}
    )


def test_the_command_that_began_is_reported_with_its_folder(left, small, tmp_path, monkeypatch):
    holder = json.loads((left / "holder.json").read_text())
    (left / "holder.json").write_text(
        json.dumps(holder | {"resume_command": "survey run small.toml --workers 2"})
    )
    assert unfinished.summary("small.nc")["resume"] == "survey run small.toml --workers 2"
    monkeypatch.chdir("/")
    assert (
        unfinished.summary(tmp_path / "small.nc")["resume"]
        == f"cd {tmp_path} && survey run small.toml --workers 2"
    )


def test_a_run_at_work_is_reported_and_not_disturbed(left, small):
    checked = workflow.read(small)
    with blocks.Blocks(checked.path, fingerprint.fingerprint(checked)) as kept:
        answer = unfinished.summary("small.nc")
        assert f"pid {kept.holder['pid']}" in answer["at_work"] and "resume" not in answer
        assert unfinished.sentence(answer).endswith("is writing it")


def test_drift_names_the_keys_and_the_ways_on(left, small):
    answer = refusal(small, "solver.rtol=1e-6")
    assert answer == (
        "small.nc.blocks contains 3 finished blocks from another workflow (solver.rtol 1e-09 -> 1e-06); go back to "
        "that workflow (survey run small.nc.blocks/workflow.toml -o small.nc), or write to another file with -o, or "
        "start again with --fresh, which deletes 3 finished blocks"
    )
    answer = refusal(small, "axes.w0.num=7", "axes.t=1.5", "title='other'")
    assert "(axes.t {'start': 0.0, 'stop': 3.0, 'num': 4} -> 1.5, axes.w0.num 6 -> 7)" in answer
    answer = refusal(small, *[f"axes.{key}=0.1" for key in ("b12", "b31", "d", "s2", "s3")])
    assert "(axes.b12 0.7 -> 0.1, axes.b31 -0.4 -> 0.1, axes.d 1.1 -> 0.1 and 2 more)" in answer
    engine.run(workflow.read(small, ["solver.rtol=1e-6"]), fresh=True)
    assert survey.open("small.nc").attrs["blocks_reused"] == 0


def _of_another_run(left, manifest):
    (left / "manifest.json").write_text(json.dumps(manifest))
    for file in left.glob("*.block"):
        arrays = blocks.unpack(file.read_bytes())
        with open(file, "wb") as opened:
            blocks.pack(arrays, opened, "of that version")


def test_other_code_is_reported_plainly(left, small):
    manifest = json.loads((left / "manifest.json").read_text())
    manifest["code"]["survey"], manifest["kernels"] = "0.0.9", "old"
    _of_another_run(left, manifest)
    now = manifest["code"] | {"survey": survey.__version__}
    assert (
        f"blocks from another version of the code (survey 0.0.9 -> {now['survey']}); go back to that"
        in refusal(small)
    )
    answer = refusal(small, "solver.rtol=1e-6")
    assert "-> 1e-06)" in answer and "go back to that version and that workflow" in answer


def test_a_processor_of_other_arithmetic_is_reported_plainly(left, small):
    manifest = json.loads((left / "manifest.json").read_text())
    manifest["fused_multiply_adds"] = not manifest["fused_multiply_adds"]
    _of_another_run(left, manifest)
    answer = refusal(small)
    assert "fused multiply-adds, which decide last bits; go back to such a processor" in answer


@pytest.mark.parametrize("damage", ["flipped", "gone", "another"])
def test_a_damaged_manifest_costs_nothing_as_blocks_say_of_which_survey_they_are(
    left, small, damage
):
    manifest = left / "manifest.json"
    bits = bytearray(manifest.read_bytes())
    bits[3] ^= 128
    manifest.write_bytes({"flipped": bits, "gone": b"", "another": b'{"format": 1}'}[damage])
    engine.run(workflow.read(small))
    assert survey.open("small.nc").attrs["blocks_reused"] == 3 and not left.exists()


def test_without_a_manifest_blocks_of_another_survey_are_not_taken(left, small):
    (left / "manifest.json").unlink()
    with pytest.raises(
        Damaged, match=r"manifest\.json is missing or damaged, .* --fresh deletes them"
    ):
        engine.run(workflow.read(small, ["solver.rtol=1e-6"]))
    assert len(list(left.glob("*.block"))) == 3
    assert not (left.parent / "small.nc.lock").exists()


def test_blocks_of_an_older_format_are_kept_and_reported(left, small):
    """Format 2: the first line is a table of the arrays alone."""
    manifest = json.loads((left / "manifest.json").read_text())
    (left / "manifest.json").write_text(json.dumps(manifest | {"format": 2}))
    for file in left.glob("*.block"):
        body = file.read_bytes()[:-8].split(b"\n", 1)[1]
        head = b'{"w": ["<f8", [4]], "status": ["|i1", [4]], "w_error": ["<f4", [4]]}\n'
        file.write_bytes(head + body + zlib.crc32(head + body).to_bytes(8, "little"))
    assert (
        "small.nc.blocks contains 3 finished blocks from another version of the code (format)"
        in refusal(small)
    )
    assert len(list(left.glob("*.block"))) == 3


def test_what_is_there_already_needs_no_more_room(left, small, monkeypatch):
    written = sum(file.stat().st_size for file in left.iterdir())
    needed = 2 * 24 * cost.bytes_per_point(workflow.read(small).scene, workflow.read(small).request)
    assert written > needed // 4
    usage = plan.shutil.disk_usage(left)
    monkeypatch.setattr(plan.shutil, "disk_usage", lambda _: usage._replace(free=needed - 1))
    with pytest.raises(BadInput, match=r"24 points need [\d.]+ kB, and the disk"):
        engine.run(workflow.read(small, output="other.nc"))
    engine.run(workflow.read(small))
    assert survey.open("small.nc").attrs["blocks_reused"] == 3


def test_the_kept_workflow_finds_a_scene_that_lay_beside_it(tmp_path, monkeypatch):
    away = tmp_path / "away"
    away.mkdir()
    (away / "own.py").write_text(
        "PARAMETERS = ('a',)\nPERIOD = 1.0\n\n\ndef z(u, p):\n    return p[0]\n"
    )
    (away / "own.toml").write_text('scene = "own.py"\naxes = { a = { values = [1.0, 2.0] } }\n')
    monkeypatch.chdir(tmp_path)

    def stop(job, blocks, finished):
        job.kept.save(0, {"status": np.zeros(2, np.int8)})
        raise KeyboardInterrupt

    monkeypatch.setattr(engine.dispatch, "on_threads", stop)
    with pytest.raises(KeyboardInterrupt):
        engine.run(workflow.read(away / "own.toml"))
    assert "from another workflow (axes.a.values [1.0, 2.0] -> [1.5])" in refusal(
        away / "own.toml", "axes.a.values=[1.5]"
    )
    kept = workflow.read("own.nc.blocks/workflow.toml", output="own.nc")
    assert fingerprint.fingerprint(kept) == fingerprint.fingerprint(
        workflow.read(away / "own.toml")
    )


def test_where_nothing_is_finished_another_survey_begins(left, small):
    for number in DONE:
        (left / f"{number:08d}.block").unlink()
    engine.run(workflow.read(small, ["solver.rtol=1e-6"]))
    assert survey.open("small.nc").attrs["rtol"] == 1e-6
