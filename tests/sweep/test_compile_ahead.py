"""On a new machine, a map finds on disk what a process beside it compiles, and waits for it."""

import os
import subprocess
import sys

import pytest

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


@pytest.mark.skipif(dispatch.cpus() == 1, reason="nothing is compiled beside on one processor")
@pytest.mark.parametrize(
    ("scene", "row", "lane", "variables", "kernels"),
    [
        ("mathieu", "q", "a", ["discriminant", "verdict"], (READ, UNUSED, UNUSED)),
        *(
            pytest.param("satellite", "k", "rho", variables, kernels, marks=pytest.mark.slow)
            for variables, kernels in (
                (["exponent", "rotation_number", "verdict"], (UNUSED, UNUSED, READ)),
                (["exponent_per_orbit", "period", "verdict"], (READ, READ, UNUSED)),
            )
        ),
    ],
)
def test_the_map_reads_what_the_process_beside_it_compiles(tmp_path, scene, row, lane, variables, kernels):
    text = WORKFLOW.format(scene=scene, row=row, lane=lane, variables=variables).replace("'", '"')
    (tmp_path / "map.toml").write_text(text)
    done = subprocess.run(
        [sys.executable, "-c", TELLING, "run", "map.toml", "--quiet"], cwd=tmp_path, capture_output=True, text=True,
        env=os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    found = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert found == dict(
        zip(("hill_chain", "discriminants", "exponents", "transcendental"), (COMPILED, *kernels), strict=True)
    )
