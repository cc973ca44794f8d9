"""What a process compiles beside, on a new machine, is what the map then finds on disk."""

import os
import subprocess
import sys

import pytest

WORKFLOW = """
scene = "{scene}"
axes.{row} = {{ start = 0.1, stop = 0.9, num = 9 }}
axes.{lane} = {{ start = 0.6, stop = 4.0, num = 200 }}
output.variables = {variables}
"""
# the program, telling which of these kernels it has compiled and which it has read
TELLING = """
import sys
from survey import cli
from survey.kernels import chebyshev, hill
from survey.scenes import {scene}
kernels = dict(sample={scene}.sample, measure=hill.measure, transcendental=hill.transcendental,
               discriminants=chebyshev.discriminants)
try:
    cli.main(sys.argv[1:])
finally:
    for name, kernel in kernels.items():
        print(name, len(kernel.stats.cache_hits), len(kernel.stats.cache_misses))
"""


@pytest.mark.parametrize(
    ("scene", "row", "lane", "variables", "needed"),
    [
        ("satellite", "k", "rho", ["exponent", "rotation_number", "verdict"], "transcendental"),
        ("mathieu", "q", "a", ["discriminant", "verdict"], "discriminants"),
    ],
)
def test_the_map_reads_what_the_process_beside_it_compiled(tmp_path, scene, row, lane, variables, needed):
    text = WORKFLOW.format(scene=scene, row=row, lane=lane, variables=variables).replace("'", '"')
    (tmp_path / "map.toml").write_text(text)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "NUMBA_DISABLE_JIT": "0"}

    def python(program, *words):
        command = [sys.executable, "-c", program, *words]
        done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return done.stdout

    python(f"from survey import engine; from survey.scenes import {scene}; exec(engine.beside({scene}, {variables}))")
    told = python(TELLING.format(scene=scene), "run", "map.toml", "--quiet")
    counts = {name: (int(read), int(compiled)) for name, read, compiled in map(str.split, told.splitlines())}
    assert counts["sample"] == counts["measure"] == counts[needed] == (1, 0)
