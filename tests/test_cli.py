"""The program as a user runs it: outputs, messages, exit codes, and no file touched by bad input."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import time

import netCDF4
import pytest

from survey.cli import main
from survey.request import workflow
from survey.sweep import plan


def test_run_ends_with_a_file_a_digest_and_a_picture(program, small):
    done = program("run", "small.toml")
    assert done.returncode == 0 and done.stdout == "", done.stderr
    assert sorted(f.name for f in program.folder.iterdir()) == [
        "small.nc",
        "small.nc.sha256",
        "small.png",
        "small.toml",
    ]
    for words in (
        "24 points in",
        "computed 1, reused 0",
        "ETA",
        "wrote small.nc",
        "status: ok: 24",
    ):
        assert words in done.stderr
    subprocess.run(
        ["sha256sum", "-c", "small.nc.sha256"], cwd=program.folder, check=True, capture_output=True
    )


def test_quiet_says_nothing_and_o_chooses_the_file(program, small):
    done = program("run", "small.toml", "--quiet", "-o", "other.nc", "--set", "axes.t.num=2")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    with netCDF4.Dataset(program.folder / "other.nc") as file:
        assert file["w"].shape == (6, 2) and file["w"].dimensions == ("w0", "t")


@pytest.mark.slow
def test_worker_processes_give_the_same_file(program, small):
    for name, words in (("a.nc", ()), ("b.nc", ("--workers", "2"))):
        assert program("run", "small.toml", "--quiet", "-o", name, *words).returncode == 0
    with (
        netCDF4.Dataset(program.folder / "a.nc") as a,
        netCDF4.Dataset(program.folder / "b.nc") as b,
    ):
        assert all((a[name][:] == b[name][:]).all() for name in a.variables)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "absent.toml"], "absent.toml: cannot read this workflow file"),
        (["run", "small.toml", "--set", "axes.w0.num=many"], "axes.w0.num = 'many'"),
        (["run", "small.toml", "--set", "scene=gyrostats"], "did you mean 'gyrostat'"),
        (["run", "small.toml", "-o", "nowhere/out.nc"], "there is no folder 'nowhere'"),
        (["run", "small.toml", "-o", "."], "is a folder"),
        (
            ["run", "small.toml", "--workers", "none"],
            "is not a valid integer; see survey run --help",
        ),
        (["run"], "Missing argument 'WORKFLOW'; see survey run --help"),
        (["runn"], "No such command 'runn'"),
        (["runn"], "; see survey --help"),
        (["plot", "small.nc", "--stile", "paper"], "--stile"),
        (
            ["run", "small.toml", "--set", "axes.wo.num=3"],
            "unknown parameter of scene gyrostat 'wo'; did you mean 'w0'",
        ),
        (["info", "absent.nc"], "absent.nc: there is no such file"),
        (["verify", "absent.nc"], "absent.nc: there is no such file"),
        (["plot", "absent.nc"], "absent.nc: there is no such file"),
        (
            ["info", "small.toml"],
            "small.toml: this is not a netCDF file of survey; name one written by survey run",
        ),
        (["verify", "small.toml"], "small.toml: this is not a netCDF file of survey"),
        (["scenes", "gyroscope"], "did you mean 'gyrostat'"),
        (["precision", "gyroscope"], "did you mean 'gyrostat'"),
    ],
)
def test_bad_input_is_one_line_exit_2_and_no_file(small, words, message, monkeypatch, capfd):
    monkeypatch.chdir(small.parent)
    with pytest.raises(SystemExit) as ended:
        main(words)
    said, complaint = capfd.readouterr()
    assert ended.value.code == 2, complaint
    assert message in complaint and complaint.count("\n") == 1 and said == ""
    assert [f.name for f in small.parent.iterdir()] == ["small.toml"]


def test_no_words_show_the_help(capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["survey"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0 and "Commands:" in capsys.readouterr().out


def test_the_plan_says_how_long_in_words_and_names_compiling_apart(small, monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    planned = plan.plan(workflow.read(small))
    assert planned["time"].startswith("about ") and planned["size"].endswith("bytes")
    assert planned["compiling"].endswith("s besides, once on this machine")
    assert [plan.lasting(s) for s in (0.2, 44.0, 400.0, 20000.0)] == [
        "about 1 s",
        "about 44 s",
        "about 6.7 min",
        "about 5.6 h",
    ]


def test_plan_counts_what_run_does_and_calls_no_kernel(program, small):
    planned = json.loads(
        program("plan", "small.toml", "--json", env={"NUMBA_DISABLE_JIT": "1"}).stdout
    )
    assert (planned["points"], planned["blocks"]) == (24, 1)
    assert planned["bytes"] == 24 * (2 * 8 + 2 * 4 + 4 + 1)
    assert [f.name for f in program.folder.iterdir()] == ["small.toml"]


def test_info_verify_and_plot(program, ran, monkeypatch, capfd):
    answer = json.loads(program("info", "small.nc", "--json").stdout)
    assert answer["counts"]["status"]["ok"] == 24 and answer["provenance"]["kernel_hash"]
    assert "phi0" in program("info", "small.nc").stdout
    verified = program("verify", "small.nc")
    assert (
        verified.returncode == 0 and "20 points solved again by dop853 and full" in verified.stdout
    ), verified.stderr
    plotted = program("plot", "small.nc", "--var", "turnings", "-o", "t.pdf")
    assert plotted.returncode == 0 and (program.folder / "t.pdf").read_bytes()[:4] == b"%PDF"
    assert (
        program(
            "plot", "small.nc", "--at", "w0=1.1", "--var", "turnings", "-o", "row.png"
        ).returncode
        == 0
    )
    monkeypatch.chdir(program.folder)
    for words, message in (
        (("--var", "turning"), "did you mean 'turnings'"),
        (("-o", "t.docx"), "t.docx"),
        (("--at", "w0=x"), "give one number"),
        (("--at", "w=1"), "unknown axis"),
        (("--at", "w0=99"), "lies outside the map"),
        (("--width", "double"), "give both, or neither"),
    ):
        capfd.readouterr()
        with pytest.raises(SystemExit) as ended:
            main(["plot", "small.nc", *words])
        complaint = capfd.readouterr().err
        assert ended.value.code == 2, complaint
        assert message in complaint and complaint.count("\n") == 1, complaint


def test_verify_finds_a_flipped_bit(program, ran):
    path = program.folder / "small.nc"
    bits = bytearray(path.read_bytes())
    bits[len(bits) // 2] ^= 1
    path.write_bytes(bits)
    found = program("verify", "small.nc")
    assert found.returncode == 3 and "digest" in found.stderr and found.stderr.count("\n") == 1


def test_verify_says_what_it_checks_without_a_digest(program, ran):
    (program.folder / "small.nc.sha256").unlink()
    found = program("verify", "small.nc")
    assert found.returncode == 3 and found.stderr.count("\n") == 1, found.stderr
    assert (
        "there is no digest small.nc.sha256 beside it" in found.stderr
        and "solved again are checked" in found.stderr
    )
    assert (
        "sound except for the digest; 20 points solved again by dop853 and full, all within"
        in found.stdout
    )
    accepted = found.stderr.rpartition("accept the file as it is: ")[2]
    subprocess.run(accepted, shell=True, cwd=program.folder, check=True)
    found = program("verify", "small.nc", "--points", "1")
    assert (found.returncode, found.stderr) == (
        0,
        "",
    ) and "small.nc: sound; 1 point solved again by" in found.stdout


def test_a_single_point_and_block_are_reported_as_one(program, small):
    words = [word for key in ("w0=0.5", "t=1.0") for word in ("--set", f"axes.{key}")]
    done = program("run", "small.toml", *words, "--set", "output.figures=[]")
    assert "gyrostat: 1 point in 1 block, 0 already done" in done.stderr, done.stderr
    assert "1 of 1 block, " in done.stderr and "computed 1, reused 0 of 1 block\n" in done.stderr


def test_verify_finds_a_wrong_value_by_solving_again(program, ran):
    (program.folder / "small.nc.sha256").unlink()
    with netCDF4.Dataset(program.folder / "small.nc", "a") as file:
        file["w"][3, 2] += 1e-6
    (program.folder / "small.nc.sha256").write_text("")
    subprocess.run(
        "sha256sum small.nc > small.nc.sha256", shell=True, cwd=program.folder, check=True
    )
    found = program("verify", "small.nc", "--points", "24")
    assert found.returncode == 3 and "w at " in found.stderr, found.stderr


def test_scenes_tell_all_that_is_needed(program):
    assert "satellite" in program("scenes").stdout
    answer = program("scenes", "satellite").stdout
    for words in (
        "k != 1",
        "body",
        "prolate | oblate",
        "discriminant",
        "taylor16",
        "undecided -1",
        "Astakhova",
    ):
        assert words in answer
    assert json.loads(program("scenes", "gyrostat", "--json").stdout)["name"] == "gyrostat"


def test_no_color_is_honoured(program, ran):
    assert (
        "\x1b" not in program("info", "small.nc", env={"NO_COLOR": "1", "FORCE_COLOR": "1"}).stdout
    )


@pytest.mark.parametrize(
    ("name", "code"), [("SIGINT", 130), pytest.param("SIGTERM", 143, marks=pytest.mark.slow)]
)
def test_an_interrupted_run_can_be_resumed(program, small, name, code):
    many = ("axes.w0.num=4000", "axes.t.num=40", "axes.t.stop=40")
    command = ["run", "small.toml", *[word for text in many for word in ("--set", text)]]
    running = subprocess.Popen(
        [sys.executable, "-m", "survey", *command],
        cwd=program.folder,
        stderr=subprocess.PIPE,
        text=True,
        # a shell's background job ignores it
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    blocks = program.folder / "small.nc.blocks"
    deadline = time.time() + 60
    while not list(blocks.glob("*.block")) and time.time() < deadline:
        time.sleep(0.005)
    running.send_signal(getattr(signal, name))
    answer = running.communicate(timeout=30)[1]
    assert running.returncode == code and "resume with: survey run small.toml" in answer, answer
    finished = len(list(blocks.glob("*.block")))
    assert finished and not (program.folder / "small.nc").exists()
    left = json.loads(program("info", "small.nc", "--json").stdout)["unfinished"]
    safe, blocks_asked = map(
        int, re.search(r"finished blocks are safe: (\d+) of (\d+); resume with", answer).groups()
    )
    assert 1 <= safe <= left["blocks_done"] == finished and blocks_asked == left["blocks"]
    assert 0 < left["points_done"] <= left["points"] == 160_000 and left["resume"] == shlex.join(
        ["survey", *command]
    )
    seen = program("verify", "small.nc")
    assert seen.returncode == 3 and f"{finished} of {left['blocks']} blocks" in seen.stderr, (
        seen.stderr
    )
    resumed = program(*command)
    assert resumed.returncode == 0 and f", reused {finished} of" in resumed.stderr, resumed.stderr
    assert not blocks.exists() and not os.path.exists(program.folder / "small.nc.lock")


def test_failed_points_exit_1(program, small):
    done = program("run", "small.toml", "--set", "axes.t.stop=1e12")
    assert done.returncode == 1 and "step_limit" in done.stderr, done.stderr
