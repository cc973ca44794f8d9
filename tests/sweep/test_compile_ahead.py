"""On a new machine, a map finds on disk what a process beside it compiles, and waits for it."""

import os
import subprocess
import sys

import pytest

from survey import waiting
from survey.sweep import dispatch

# between tongues: nothing stays undecided, for which more would be compiled
WORKFLOW = """
scene = "{scene}"
axes.{row} = {{ start = 0.1, stop = 0.2, num = 9 }}
axes.{lane} = {{ start = 1.9, stop = 2.1, num = 200 }}
output.variables = {variables}
"""
# the program, telling which of these kernels it has compiled and which it has read
TELLING = """
import sys
from survey import cli
from survey.kernels.hill import answers, series
from survey.methods import taylor16
try:
    cli.main(sys.argv[1:])
finally:
    for kernel in (taylor16.hill_chain, series.discriminants, answers.exponents, answers.transcendental):
        print(kernel.__name__, len(kernel.stats.cache_hits), len(kernel.stats.cache_misses))
"""
READ, COMPILED, UNUSED = "1 0", "0 1", "0 0"


@pytest.mark.slow
@pytest.mark.skipif(dispatch.cpus() == 1, reason="nothing is compiled beside on one processor")
@pytest.mark.parametrize(
    ("scene", "row", "lane", "variables", "kernels"),
    [
        ("mathieu", "q", "a", ["discriminant", "verdict"], (READ, UNUSED, UNUSED)),
        *(
            ("satellite", "k", "rho", variables, kernels)
            for variables, kernels in (
                # meanwhile the other process compiles the longer one of factors
                (["exponent", "rotation_number", "verdict"], (UNUSED, UNUSED, COMPILED)),
                (["exponent_per_orbit", "period", "verdict"], (READ, READ, UNUSED)),
            )
        ),
    ],
)
def test_the_map_reads_what_the_process_beside_it_compiles(
    tmp_path, scene, row, lane, variables, kernels
):
    text = WORKFLOW.format(scene=scene, row=row, lane=lane, variables=variables).replace("'", '"')
    (tmp_path / "map.toml").write_text(text)
    # a module of the user's folder is not taken for Python's
    (tmp_path / "struct.py").write_text("raise SystemExit")
    done = subprocess.run(
        [sys.executable, "-P", "-c", TELLING, "run", "map.toml", "--quiet"],
        cwd=tmp_path, capture_output=True, text=True,
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert found == dict(
        zip(
            ("hill_chain", "discriminants", "exponents", "transcendental"),
            (COMPILED, *kernels),
            strict=True,
        )
    )


# the call, and kernels that it must read from disk: another signature would be compiled a second
# time
READING = """
import importlib
import numpy as np
import survey
{call}
for name in {kernels}:
    module, kernel = name.split(":")
    found = getattr(importlib.import_module(module), kernel).stats
    print(name, len(found.cache_hits), len(found.cache_misses))
"""
GYROSTAT = 'survey.evaluate("gyrostat", b12=0.7, b31=-0.4, d=1.1, c23=0.3, s2=0.3, s3=0.1, {more})'
FLOWS = "survey.methods.taylor:"
OWN = """scene = survey.abel(
    lambda phi, p: -p[0], lambda phi, p: p[1] - np.sin(phi), period=2 * np.pi, parameters=("a", "I")
)
survey.evaluate(scene, {more}, a=0.3, I=0.5)"""
STATE = 'survey.evaluate("brun", A=1.0, C=0.5, epsilon=0.3, theta0=1.0, p_theta0=0.1, p_psi=0.3, p_phi=0.2{more})'
BRUN = [
    "lanes:wells",
    "lanes_double:begin",
    "lanes_double:go",
    "lanes_double:end",
    "brun_lanes:enter",
]
ORBIT = """def f(t, x, p, out):
    out[0], out[1] = x[1], p[0] * np.cos(t) - 0.2 * x[1] - x[0] - x[0] ** 3

scene = survey.orbit(f, states=("x", "v"), period=2 * np.pi, parameters=("F",), start=(0.1, 0.1))
survey.evaluate(scene, F=0.1)"""
HILL = """scene = survey.hill(
    lambda u, p: p[0] - 2 * p[1] * np.cos(2 * u), period=np.pi, even=True, parameters=("a", "q")
)
survey.evaluate(scene, a=np.linspace(1.9, 2.1, 200), {more})"""
DAMPED = """scene = survey.hill(
    lambda u, p: p[0] - 2 * p[1] * np.cos(2 * u), period=np.pi, even=True, damping=0.1, parameters=("a", "q")
)
survey.evaluate(scene, a=np.linspace(1.9, 2.1, 200), q=np.linspace(0.1, 0.2, 9), variables=["verdict"])"""
STEPS = ["steps:factors", "steps:carried"]
FLOQUET = ["leverrier:fill_matrices", "characteristic:answer"]
DANBY = ["danby_double:chain", "traces_double:measure"]


@pytest.mark.slow
@pytest.mark.skipif(dispatch.cpus() == 1, reason="nothing is compiled beside on one processor")
@pytest.mark.parametrize(
    ("call", "kernels"),
    [
        (
            GYROSTAT.format(more='question="abel", phi0=0.1, w0=2.0, phi=3.0'),
            [FLOWS + "_abels_in_angle"],
        ),
        (GYROSTAT.format(more='question="fate", phi0=0.1, w0=2.0'), [FLOWS + "flow_fates"]),
        (
            GYROSTAT.format(more='question="portrait"'),
            [FLOWS + "flow_fates"],
        ),
        (
            OWN.format(more='question="abel", phi0=0.0, w0=1.0, phi=1.0'),
            ["survey.kernels.cylinder.lockstep_program:abels_near"],
        ),
        (
            OWN.format(more='question="trajectory", phi0=0.0, w0=1.0, t=1.0'),
            ["survey.kernels.cylinder.lockstep_program:trajectories"],
        ),
        (
            OWN.format(more='question="portrait"'),
            [FLOWS + "flow_fates"],
        ),
        (
            HILL.format(more="q=0.1, variables=['discriminant', 'verdict']"),
            ["survey.kernels.hill.answers:measure", "survey.kernels.hill.series:discriminants"],
        ),
        (
            HILL.format(more="q=np.linspace(0.1, 0.2, 9)"),
            ["survey.kernels.hill.answers:measure", "survey.kernels.hill.series:factors"],
        ),
        (
            DAMPED,
            ["survey.kernels.hill.answers:measure", "survey.kernels.hill.series:factors"],
        ),
        (STATE.format(more=""), [f"survey.kernels.nutation.{name}" for name in BRUN]),
        (
            'survey.evaluate("brun", l=0.5, alpha=0.1, beta=0.2, sign="1")',
            [f"survey.kernels.nutation.{name}" for name in BRUN],
        ),
        (STATE.format(more=', t=1.0, motion="at_t"'), ["survey.kernels.nutation.brun:of_states"]),
        (
            'survey.evaluate("satellite_triaxial", A=0.5, B=0.8, C=1.0, k=0.2)',
            [f"survey.kernels.floquet.{name}" for name in FLOQUET],
        ),
        (ORBIT, [f"survey.kernels.floquet.{name}" for name in STEPS]),
        (
            'survey.evaluate("libration_elliptic", mu=0.01, e=0.9, rtol=1e-15)',
            [f"survey.kernels.libration.{name}" for name in DANBY],
        ),
    ],
)
def test_kernels_are_compiled_ahead_for_the_arguments_of_the_call(tmp_path, call, kernels):
    done = subprocess.run(
        [sys.executable, "-c", READING.format(call=call, kernels=kernels)], capture_output=True, text=True,
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [f"{name} {READ}" for name in kernels]


@pytest.mark.slow
@pytest.mark.skipif(dispatch.cpus() == 1, reason="nothing is compiled beside on one processor")
@pytest.mark.parametrize(
    ("more", "kernels"),
    [
        ('question="trajectory", phi0=0.0, w0=1.0, t=1.0', ["balls.balls", "lockstep.record"]),
        ('question="abel", phi0=0.0, w0=1.0, phi=1.0', ["balls.balls", "lockstep_program.cross"]),
        (
            'question="fate", phi0=0.0, w0=1.0',
            ["balls.balls_of_one", "creeping.crept", "returns.runs_in"],
        ),
    ],
)
def test_what_the_waiting_process_compiles_first_serves_the_other(tmp_path, more, kernels):
    done = subprocess.run(
        [sys.executable, "-c", READING.format(call=OWN.format(more=more), kernels=[])],
        capture_output=True, text=True,
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    # for other arguments each would be there twice
    assert [len([*tmp_path.rglob(f"{name}-*.nbc")]) for name in kernels] == [1] * len(kernels)


def test_what_has_a_name_is_waited_for_once(monkeypatch):
    lines = iter(["first\n", "second\n", "third\n", "", "", ""])
    monkeypatch.setattr(waiting, "other_compiler", lambda: next(lines))
    monkeypatch.setattr(waiting, "_done", set())
    waiting.wait("second")
    waiting.wait("first")
    waiting.wait("second")
    assert next(lines) == "third\n"
    waiting.wait("never")
    waiting.wait("third")
    assert list(lines) == [""]
